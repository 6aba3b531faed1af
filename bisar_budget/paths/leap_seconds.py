"""Instants of other time systems, by the leap seconds of UTC.

TAI - UTC: table of the Earth orientation centre of the IERS, Bulletin C 52 (2016-07-06) and before. No leap second
came after that of 2016-12-31; one that is announced later needs a line here.
"""

from bisect import bisect_right
from datetime import date

from bisar_budget.paths.instant import DAY, Instant

_MJD_OF_ORDINAL = 678576
# The day from which a difference holds; it grew by one second each time, from 10 s on.
_DATES = (
    (1972, 1),
    (1972, 7),
    (1973, 1),
    (1974, 1),
    (1975, 1),
    (1976, 1),
    (1977, 1),
    (1978, 1),
    (1979, 1),
    (1980, 1),
    (1981, 7),
    (1982, 7),
    (1983, 7),
    (1985, 7),
    (1988, 1),
    (1990, 1),
    (1991, 1),
    (1992, 7),
    (1993, 7),
    (1994, 7),
    (1996, 1),
    (1997, 7),
    (1999, 1),
    (2006, 1),
    (2009, 1),
    (2012, 7),
    (2015, 7),
    (2017, 1),
)
_DAYS = tuple(date(year, month, 1).toordinal() - _MJD_OF_ORDINAL for year, month in _DATES)
FIRST_DAY = _DAYS[0]  # before it UTC ran at another rate than TAI

# What TAI is ahead. GPS: IS-GPS-200, 20.3.3.5.2.4, 19 leap seconds at its epoch. TT: IAU 1991, Recommendation IV.
TAI_LESS = {"TAI": 0.0, "GPS": 19.0, "TT": -32.184}


def tai_less_utc(day: int) -> int:
    """TAI - UTC on a day of UTC, from 1972 on. [s]"""
    return 9 + max(bisect_right(_DAYS, day), 1)


def has_leap_second(day: int) -> bool:
    """Whether a day of UTC has a second 23:59:60."""
    return day + 1 in _DAYS[1:]


def tai(instant: Instant) -> Instant:
    """The day and seconds of TAI at an instant of UTC."""
    return instant.after(tai_less_utc(instant.day))


def utc(of_tai: Instant) -> Instant:
    """The instant of UTC at a day and seconds of TAI; within a leap second, 86400 s and more of the day before it."""
    found = of_tai.after(-tai_less_utc(of_tai.day))
    earlier = of_tai.after(-tai_less_utc(found.day))
    if earlier.day > found.day:
        return Instant(found.day, earlier.seconds + DAY)
    return earlier
