"""The Earth as WGS-84 has it: geodetic places, and the axes of a scene on it. Single places need no array library.

Earth-fixed axes: x through Greenwich on the equator, z through the north pole. [m]
"""

import math
from typing import TYPE_CHECKING, NamedTuple

from bisar_budget.geometry import Axes, Vector, cross, dot, unit

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

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
        return self.turned(_minus(earth_fixed, self.origin))

    def places(self, earth_fixed: "NDArray[np.float64]") -> "NDArray[np.float64]":
        """Places (n, 3) in the scene's axes. [m]"""
        import numpy as np

        turned: NDArray[np.float64] = (earth_fixed - np.array(self.origin)) @ np.array(self.axes).T
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
        (a, b, c), (u, v, w), (p, q, r) = self.axes
        e, n, h = vector
        return (a * e + u * n + p * h, b * e + v * n + q * h, c * e + w * n + r * h)

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


def earth_fixed(place: Geodetic) -> Vector:
    """Earth-fixed coordinates of a geodetic place. [m]"""
    sine, cosine = math.sin(place.latitude), math.cos(place.latitude)
    normal = _prime_vertical(sine)
    level = (normal + place.height) * cosine
    return (
        level * math.cos(place.longitude),
        level * math.sin(place.longitude),
        (normal * (1 - _ECCENTRICITY_SQUARED) + place.height) * sine,
    )


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
    here = axes.origin
    along = axes.turned_back((math.sin(heading), math.cos(heading), 0.0))
    step = time_s / _STEPS

    def rates(point: Vector, direction: Vector) -> tuple[Vector, Vector]:
        at = geodetic(point)
        east, north, up = axes_at(at).axes
        turn = speed / _radius_along(at, math.atan2(dot(direction, east), dot(direction, north)))
        moves = _sum((speed, direction), (climb, up))
        return moves, (-turn * up[0], -turn * up[1], -turn * up[2])

    for _ in range(_STEPS):
        a, p = rates(here, along)
        b, q = rates(_sum((1, here), (step / 2, a)), _sum((1, along), (step / 2, p)))
        c, r = rates(_sum((1, here), (step / 2, b)), _sum((1, along), (step / 2, q)))
        d, s = rates(_sum((1, here), (step, c)), _sum((1, along), (step, r)))
        here = _sum((1, here), (step / 6, a), (step / 3, b), (step / 3, c), (step / 6, d))
        along = _sum((1, along), (step / 6, p), (step / 3, q), (step / 3, r), (step / 6, s))
    return here


def _radius_along(place: Geodetic, heading: float) -> float:
    """Radius of curvature of the way of constant height over a place, by its compass heading: Euler's formula. [m]"""
    sine = math.sin(place.latitude)
    across = _prime_vertical(sine)
    along = across * (1 - _ECCENTRICITY_SQUARED) / (1 - _ECCENTRICITY_SQUARED * sine * sine)
    return 1 / (math.cos(heading) ** 2 / along + math.sin(heading) ** 2 / across) + place.height


def _sum(*parts: tuple[float, Vector]) -> Vector:
    """Sum of vectors times their factors."""
    x, y, z = (math.fsum(factor * vector[axis] for factor, vector in parts) for axis in range(3))
    return (x, y, z)


def _prime_vertical(sine: float) -> float:
    return EQUATORIAL_RADIUS / math.sqrt(1 - _ECCENTRICITY_SQUARED * sine * sine)


def _minus(a: Vector, b: Vector) -> Vector:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])
