"""Paths of platforms from orbits and logs of flights, and the Earth they are flown over."""

# What other rooms may use.
__all__ = [
    "accuracy",
    "earth",
    "flight",
    "free_fall",
    "instant",
    "log_places",
    "orientation",
    "path_formats",
    "sbet",
    "visibility",
]
