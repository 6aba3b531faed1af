"""Paths of platforms from orbit files and flight logs, and the shape and orientation of the Earth."""

# What other rooms may use.
__all__ = [
    "accuracy",
    "earth",
    "flight",
    "flight_history",
    "free_fall",
    "instant",
    "log_places",
    "orientation",
    "path_formats",
    "sbet",
    "visibility",
]
