"""Images of point scatterers with motion errors, from exact ranges. Needs NumPy."""

__all__ = [
    "autofocus",
    "collection",
    "exact",
    "image_formation",
    "impulse_response",
    "phase_history",
    "point",
    "resampling",
    "targets",
]  # what other rooms may use
