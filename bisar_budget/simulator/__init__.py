"""Images of point scatterers with motion errors, formed from exact ranges. The package needs NumPy."""

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
