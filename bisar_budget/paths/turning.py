"""From the axes of orbits to those of the Earth, with UT1 = UTC and without polar motion.

Both that is left out comes from tables which the IERS issues every week. UT1 - UTC is kept below 0.9 s: 1 ms turns
the Earth by 0.51 m at the distance of a low orbit. Polar motion is up to 0.6", which is 20 m there. The turn is the
same throughout an aperture: it moves the whole path, and bends nothing.
"""

import math
from collections.abc import Callable

from bisar_budget.geometry import Vector
from bisar_budget.paths.earth import ROTATION_RATE
from bisar_budget.paths.flight import PathFileError
from bisar_budget.paths.instant import DAY, Instant
from bisar_budget.paths.leap_seconds import TAI_LESS, tai

INSTALL = "pip install 'bisar-budget[orbits]'"
Turn = Callable[[Vector, Instant], Vector]
_JULIAN_DATE_OF_MJD = 2400000.5
_J2000 = 51544  # modified Julian day, at noon
_CENTURY = 36525.0  # days
_POLAR_MOTION = math.radians(0.6 / 3600)  # rad


def from_teme(place: Vector, instant: Instant) -> Vector:
    """Earth-fixed coordinates from those of the true equator and mean equinox of date."""
    return _about_pole(place, sidereal_time(instant))


def sidereal_time(ut1: Instant) -> float:
    """Greenwich mean sidereal time of the IAU, 1982. [rad]

    Source: Vallado, Fundamentals of Astrodynamics and Applications, 4th edition, equation 3-45 (also Aoki and others,
    1982). Its 876600 hours a century are a turn a day, and are left to the seconds of the day: written as it stands,
    the sum has 1e-7 s.
    """
    centuries = (ut1.day - _J2000 - 0.5 + ut1.seconds / DAY) / _CENTURY
    at_midnight = (ut1.day - _J2000 - 0.5) / _CENTURY
    seconds = (
        (67310.54841 + 8640184.812866 * at_midnight - DAY / 2) % DAY
        + ut1.seconds * (1 + 8640184.812866 / (_CENTURY * DAY))
        + (0.093104 - 6.2e-6 * centuries) * centuries**2
    )
    return seconds * (2 * math.pi / DAY)


def celestial_turn(is_j2000: bool) -> Turn:
    """From the axes of the GCRF, or the mean equator and equinox of J2000, to Earth-fixed ones.

    Precession and nutation are those of the IAU, 2006 and 2000A (IERS Conventions 2010, chapter 5). The axes of J2000
    are 0.023" from the GCRF's, 0.8 m at the distance of a low orbit; a file that calls the GCRF `EME2000` is that
    much off.

    Raises
    ------
    PathFileError
        The package pyerfa is not installed.
    """
    try:
        import erfa
    except ImportError:
        raise PathFileError(f"needs the package pyerfa: {INSTALL}") from None

    bias = erfa.bp06(_JULIAN_DATE_OF_MJD, _J2000 + 0.5)[0].T.tolist() if is_j2000 else None

    def turn(place: Vector, instant: Instant) -> Vector:
        tt = tai(instant).after(-TAI_LESS["TT"])
        matrix = erfa.c2t06a(
            _JULIAN_DATE_OF_MJD + tt.day,
            tt.seconds / DAY,
            _JULIAN_DATE_OF_MJD + instant.day,
            instant.seconds / DAY,
            0.0,
            0.0,
        ).tolist()
        return _product(matrix, _product(bias, place) if bias else place)

    return turn


def unknown_rotation(place: Vector) -> tuple[float, float]:
    """How far a place moves by 0.1 s of UT1, and by polar motion at most. [m]"""
    return 0.1 * ROTATION_RATE * math.hypot(place[0], place[1]), _POLAR_MOTION * math.hypot(*place)


def _about_pole(place: Vector, angle: float) -> Vector:
    """Coordinates in axes turned eastwards."""
    sine, cosine = math.sin(angle), math.cos(angle)
    x, y, z = place
    return (cosine * x + sine * y, cosine * y - sine * x, z)


def _product(matrix: list[list[float]], vector: Vector) -> Vector:
    x, y, z = (math.fsum(a * b for a, b in zip(row, vector, strict=True)) for row in matrix)
    return (x, y, z)
