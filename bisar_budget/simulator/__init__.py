"""Simulation of bistatic SAR images of point scatterers with motion, clock and atmosphere errors.

The data are computed from exact ranges. The package needs NumPy.
"""

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
