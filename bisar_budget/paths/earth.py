"""The Earth as WGS-84 has it: geodetic places, the axes of a scene on it, and how it turns below the stars.

Earth-fixed axes: x through Greenwich on the equator, z through the north pole. [m]

Orbits are turned to the Earth with UT1 = UTC and without polar motion. Both that is left out comes from tables which
the IERS issues every week. UT1 - UTC is kept below 0.9 s: 1 ms turns the Earth by 0.51 m at the distance of a low
orbit. Polar motion is up to 0.6", which is 20 m there. The turn is the same throughout an aperture: it moves the
whole path, and bends nothing.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.geometry import STRAIGHT, Axes, Vector, cross, dot, unit
from bisar_budget.paths.flight import PathFileError
from bisar_budget.paths.instant import DAY, TAI_LESS, Instant, tai

Floats = NDArray[np.float64]

# NGA.STND.0036, table 3.1
EQUATORIAL_RADIUS = 6378137.0  # m
FLATTENING = 1 / 298.257223563
ROTATION_RATE = 7.292115e-5  # rad/s
_ECCENTRICITY_SQUARED = FLATTENING * (2 - FLATTENING)
_POLAR_RADIUS = EQUATORIAL_RADIUS * (1 - FLATTENING)
_STEPS = 4
_SETTLED = 1e-15  # rad; a metre on the ground is 1.6e-7


class Geodetic(NamedTuple):
    """Geodetic latitude and longitude [rad], height above the ellipsoid [m]."""

    latitude: float
    longitude: float
    height: float


class SceneAxes(NamedTuple):
    """East, north and up at a place, and the place itself, in Earth-fixed axes."""

    origin: Vector
    axes: Axes

    def place(self, earth_fixed: Vector) -> Vector:
        """A place in the scene's axes. [m]"""
        x, y, z = earth_fixed
        return self.turned((x - self.origin[0], y - self.origin[1], z - self.origin[2]))

    def places(self, earth_fixed: Floats) -> Floats:
        """Places (n, 3) in the scene's axes. [m]"""
        turned: Floats = (earth_fixed - np.array(self.origin)) @ np.array(self.axes).T
        return turned

    def turned(self, earth_fixed: Vector) -> Vector:
        """A direction or velocity in the scene's axes."""
        east, north, up = self.axes
        return (dot(east, earth_fixed), dot(north, earth_fixed), dot(up, earth_fixed))

    def earth_fixed(self, place: Vector) -> Vector:
        """A place of the scene in Earth-fixed axes. [m]"""
        x, y, z = self.turned_back(place)
        return (x + self.origin[0], y + self.origin[1], z + self.origin[2])

    def turned_back(self, vector: Vector) -> Vector:
        """A direction or velocity of the scene in Earth-fixed axes."""
        x, y, z = (dot(axis, vector) for axis in zip(*self.axes, strict=True))
        return (x, y, z)

    def radial(self, place: Vector, velocity: Vector) -> Axes:
        """Axes of the `ric` frame of a platform, in the scene's axes.

        Radial: away from the Earth's centre. Cross-track: normal of the plane that holds the velocity against the
        stars, v + ω×r. In-track completes them, and is not quite the velocity on an eccentric orbit (CCSDS 502.0-B,
        RTN).
        """
        r = self.earth_fixed(place)
        x, y, z = self.turned_back(velocity)
        against_stars = (x - ROTATION_RATE * r[1], y + ROTATION_RATE * r[0], z)
        radial = unit(r)
        across = unit(cross(r, against_stars))
        return self.turned(radial), self.turned(cross(across, radial)), self.turned(across)


def earth_fixed_places(latitude: Any, longitude: Any, height: Any) -> Floats:
    """Earth-fixed coordinates (..., 3) [m] of geodetic places, each (...), [rad], [rad], [m]."""
    sine, cosine = np.sin(latitude), np.cos(latitude)
    _, normal = curvature_radii(sine)
    level = (normal + height) * cosine
    polar = (normal * (1 - _ECCENTRICITY_SQUARED) + height) * sine
    return np.stack([level * np.cos(longitude), level * np.sin(longitude), polar], axis=-1)


def earth_fixed(place: Geodetic) -> Vector:
    """Earth-fixed coordinates of a geodetic place. [m]"""
    x, y, z = earth_fixed_places(*place).tolist()
    return (x, y, z)


def curvature_radii(sine: Any) -> tuple[Any, Any]:
    """Radii of curvature along the meridian and across it, by the sine of the latitude. [m]"""
    across = EQUATORIAL_RADIUS / np.sqrt(1 - _ECCENTRICITY_SQUARED * sine * sine)
    return across**3 * (1 - _ECCENTRICITY_SQUARED) / EQUATORIAL_RADIUS**2, across


def geodetic(point: Vector) -> Geodetic:
    """Geodetic place of Earth-fixed coordinates, more than a few kilometres from the Earth's centre.

    Bowring's iteration, on the reduced latitude.
    """
    x, y, z = point
    level = math.hypot(x, y)
    if not level:
        return Geodetic(math.copysign(math.pi / 2, z), 0.0, abs(z) - _POLAR_RADIUS)
    tangent = z / (level * (1 - FLATTENING))
    latitude = math.atan2(z, level)
    for _ in range(10):
        reduced = math.atan(tangent)
        up = z + _ECCENTRICITY_SQUARED / (1 - FLATTENING) * EQUATORIAL_RADIUS * math.sin(reduced) ** 3
        out = level - _ECCENTRICITY_SQUARED * EQUATORIAL_RADIUS * math.cos(reduced) ** 3
        before, latitude = latitude, math.atan2(up, out)
        if abs(latitude - before) < _SETTLED:
            break
        tangent = (1 - FLATTENING) * math.tan(latitude)
    sine, cosine = math.sin(latitude), math.cos(latitude)
    height = level * cosine + z * sine - EQUATORIAL_RADIUS * math.sqrt(1 - _ECCENTRICITY_SQUARED * sine * sine)
    return Geodetic(latitude, math.atan2(y, x), height)


def axes_at(place: Geodetic) -> SceneAxes:
    """East, north and up at a place."""
    sine, cosine = math.sin(place.latitude), math.cos(place.latitude)
    sine_l, cosine_l = math.sin(place.longitude), math.cos(place.longitude)
    east = (-sine_l, cosine_l, 0.0)
    north = (-sine * cosine_l, -sine * sine_l, cosine)
    up = (cosine * cosine_l, cosine * sine_l, sine)
    return SceneAxes(earth_fixed(place), (east, north, up))


def flown(place: Geodetic, heading: float, speed: float, climb: float, time_s: float) -> Vector:
    """Earth-fixed place after a flight along the geodesic, at a height that `climb` changes. [m]

    Parameters
    ----------
    place : Geodetic
        At the beginning.
    heading : float
        There, from north, clockwise. [rad]
    speed, climb : float
        Level, at the height that is flown, and vertical; both constant. [m/s]
    time_s : float
        May be negative.

    Notes
    -----
    Derived here. The direction turns with the ellipsoid's normal alone, at speed over radius of curvature, which is
    Euler's formula. Runge and Kutta's fourth order, in Earth-fixed axes: there a pole is a place like others.
    """
    axes = axes_at(place)
    step = time_s / _STEPS
    start = np.array(axes.origin)

    def rates(state: Floats) -> Floats:
        """Rates of the way from the start and of the direction, (2, 3)."""
        at = geodetic(tuple((start + state[0]).tolist()))
        east, north, up = np.array(axes_at(at).axes)
        along, across = curvature_radii(math.sin(at.latitude))
        radius = 1 / ((state[1] @ north) ** 2 / along + (state[1] @ east) ** 2 / across) + at.height
        return np.array([speed * state[1] + climb * up, -speed / radius * up])

    # From the start on, so that rounding is that of the way and not of the Earth's radius.
    state: Floats = np.array([STRAIGHT, axes.turned_back((math.sin(heading), math.cos(heading), 0.0))])
    for _ in range(_STEPS):
        a = rates(state)
        b = rates(state + step / 2 * a)
        c = rates(state + step / 2 * b)
        d = rates(state + step * c)
        state = state + step / 6 * (a + 2 * b + 2 * c + d)
    x, y, z = (start + state[0]).tolist()
    return (x, y, z)


# ---------------------------------------------------------------------- below the stars
INSTALL = "pip install 'bisar-budget[orbits]'"
Turn = Callable[[Vector, Instant], Vector]
_JULIAN_DATE_OF_MJD = 2400000.5
_J2000 = 51544  # modified Julian day, at noon
_CENTURY = 36525.0  # days
_POLAR_MOTION = math.radians(0.6 / 3600)  # rad


def from_teme(place: Vector, instant: Instant) -> Vector:
    """Earth-fixed coordinates from those of the true equator and mean equinox of date."""
    angle = sidereal_time(instant)
    sine, cosine = math.sin(angle), math.cos(angle)
    x, y, z = place
    return (cosine * x + sine * y, cosine * y - sine * x, z)


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

    bias: Floats = erfa.bp06(_JULIAN_DATE_OF_MJD, _J2000 + 0.5)[0].T if is_j2000 else np.eye(3)

    def turn(place: Vector, instant: Instant) -> Vector:
        tt = tai(instant).after(-TAI_LESS["TT"])
        days = (tt.day, tt.seconds / DAY), (instant.day, instant.seconds / DAY)
        dates = (number for day, part in days for number in (_JULIAN_DATE_OF_MJD + day, part))
        x, y, z = (erfa.c2t06a(*dates, 0.0, 0.0) @ (bias @ place)).tolist()
        return (x, y, z)

    return turn


def unknown_rotation(place: Vector) -> tuple[float, float]:
    """How far a place moves by 0.1 s of UT1, and by polar motion at most. [m]"""
    return 0.1 * ROTATION_RATE * math.hypot(place[0], place[1]), _POLAR_MOTION * math.hypot(*place)
