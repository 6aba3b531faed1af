"""Simulated images of point scatterers with motion errors, formed from exact ranges. The package needs NumPy."""

# Modules that other packages may import.
__all__ = [
    "autofocus",
    "collection",
    "flown_errors",
    "image_formation",
    "impulse_response",
    "phase_history",
    "point",
    "realisations",
    "targets",
]
