"""Paths of platforms from orbits and logs of flights, and the Earth they are flown over."""

# What other rooms may use.
__all__ = [
    "earth",
    "ephemeris",
    "fields",
    "flight",
    "flight_log",
    "instant",
    "log_motion",
    "mean_elements",
    "polynomials",
    "sbet",
    "two_lines",
]
