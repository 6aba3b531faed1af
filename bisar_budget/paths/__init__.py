"""Paths of platforms from orbits and logs of flights, and the Earth they are flown over."""

# What other rooms may use.
__all__ = [
    "earth",
    "eof",
    "flight",
    "flight_log",
    "instant",
    "messages",
    "oem",
    "omm",
    "orientation",
    "sbet",
    "sp3",
    "tle",
]
