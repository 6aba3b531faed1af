"""Images of point scatterers with motion errors, from exact ranges. Needs NumPy."""

# What other rooms may use.
__all__ = [
    "autofocus",
    "collection",
    "image_formation",
    "impulse_response",
    "phase_history",
    "point",
    "realisations",
    "targets",
]
