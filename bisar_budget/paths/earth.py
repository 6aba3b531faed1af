"""The WGS-84 ellipsoid: geodetic coordinates, and the axes of a scene on the ground.

The Earth-fixed x axis points to Greenwich on the equator, and the z axis to the north pole. Coordinates are in m.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple, overload

import numpy as np
from numpy.typing import NDArray

from bisar_budget.arrays import PerCase
from bisar_budget.constants import EARTH_GRAVITATIONAL_PARAMETER_M3_PER_S2, EARTH_RADIUS_M
from bisar_budget.geometry import Axes, Vector, Vectors, cross, dot, unit

Floats = NDArray[np.float64]

# NGA.STND.0036, table 3.1
EQUATORIAL_RADIUS_M = 6378137.0  # m
FLATTENING_RATIO = 1 / 298.257223563
ROTATION_RATE_RAD_PER_S = 7.292115e-5
_SQUARED_ECCENTRICITY_RATIO = FLATTENING_RATIO * (2 - FLATTENING_RATIO)
_RUNGE_KUTTA_STEPS = 4
_MAX_CHANGE_RAD = 1e-15  # a metre on the ground is 1.6e-7

# Gravitation: GM of the same standard, and J₂ = −√5·C̄₂₀ of EGM2008, a thousandth at the equator.
J2_FACTOR = 1.08263e-3


class Geodetic(NamedTuple):
    """Geodetic latitude and longitude [rad], and height above the ellipsoid [m]."""

    latitude: float
    longitude: float
    height: float


@dataclass(frozen=True)
class SceneAxes:
    """Axes of a scene: the origin [m], and unit vectors east, north and up at the origin, in Earth-fixed axes."""

    origin: Vector
    axes: Axes

    def place(self, earth_fixed: Vector) -> Vector:
        """Convert an Earth-fixed position to the axes of the scene. [m]"""
        x, y, z = earth_fixed
        return self.turned((x - self.origin[0], y - self.origin[1], z - self.origin[2]))

    def places(self, earth_fixed: Floats) -> Floats:
        """Convert Earth-fixed positions (n, 3) to the axes of the scene. [m]"""
        turned: Floats = (earth_fixed - np.array(self.origin)) @ np.array(self.axes).T
        return turned

    @overload
    def turned(self, earth_fixed: Vector) -> Vector: ...
    @overload
    def turned(self, earth_fixed: Vectors) -> Vectors: ...
    def turned(self, earth_fixed: Vectors) -> Vectors:
        """Convert an Earth-fixed direction or velocity to the axes of the scene."""
        east, north, up = self.axes
        return (dot(east, earth_fixed), dot(north, earth_fixed), dot(up, earth_fixed))

    @overload
    def earth_fixed(self, position: Vector) -> Vector: ...
    @overload
    def earth_fixed(self, position: Vectors) -> Vectors: ...
    def earth_fixed(self, position: Vectors) -> Vectors:
        """Convert a position in the axes of the scene to Earth-fixed axes. [m]"""
        x, y, z = self.turned_back(position)
        return (x + self.origin[0], y + self.origin[1], z + self.origin[2])

    @overload
    def turned_back(self, vector: Vector) -> Vector: ...
    @overload
    def turned_back(self, vector: Vectors) -> Vectors: ...
    def turned_back(self, vector: Vectors) -> Vectors:
        """Convert a direction or velocity in the axes of the scene to Earth-fixed axes."""
        x, y, z = (dot(axis, vector) for axis in zip(*self.axes, strict=True))
        return (x, y, z)

    def radial(self, position: Vectors, velocity: Vectors) -> Axes:
        """Unit vectors of a platform's `ric` frame (radial, in-track, cross-track), in the axes of the scene.

        The radial axis points away from the Earth's centre. The cross-track axis is normal to the position and to the
        inertial velocity v + ω×r, where v is the velocity in Earth-fixed axes, ω the Earth's rotation rate and r the
        position. The in-track axis completes the frame. On an eccentric orbit, it differs slightly from the direction
        of the velocity (CCSDS 502.0-B, RTN).
        """
        r = self.earth_fixed(position)
        x, y, z = self.turned_back(velocity)
        against_stars = (x - ROTATION_RATE_RAD_PER_S * r[1], y + ROTATION_RATE_RAD_PER_S * r[0], z)
        radial = unit(r)
        across = unit(cross(r, against_stars))
        return self.turned(radial), self.turned(cross(across, radial)), self.turned(across)


@overload
def free_fall(position: Vector, velocity: Vector, axes: SceneAxes | None) -> Vector: ...
@overload
def free_fall(position: Vectors, velocity: Vectors, axes: SceneAxes | None) -> Vectors: ...
def free_fall(position: Vectors, velocity: Vectors, axes: SceneAxes | None) -> Vectors:
    """Acceleration of a body in free fall, in the axes of a scene. [m/s²]

    Parameters
    ----------
    position, velocity : (3,)
        East, north, up; numbers or arrays (cases,). [m, m/s]
    axes : SceneAxes or None
        Axes of a scene on the Earth. If None, the Earth is a non-rotating sphere of mean radius, centred vertically
        below the scene.

    Notes
    -----
    The formulas were derived for this program. With `axes` the acceleration is −∇U − 2ω×v − ω×(ω×r). The vector r
    from the Earth's centre is given in axes that rotate at the rate ω, and v is its rate of change in these axes. The
    potential of a flattened Earth is −U = (μ/r)·[1 − J₂·(a/r)²·(3z²/r² − 1)/2]. Without `axes` the acceleration is
    −μr/r³.
    """
    if axes is None:
        x, y, up = position
        z = up + EARTH_RADIUS_M
        factor = -EARTH_GRAVITATIONAL_PARAMETER_M3_PER_S2 / (x * x + y * y + z * z) ** 1.5
        return (factor * x, factor * y, factor * z)
    x, y, z = axes.earth_fixed(position)
    u, v, _ = axes.turned_back(velocity)
    square = x * x + y * y + z * z
    factor = -EARTH_GRAVITATIONAL_PARAMETER_M3_PER_S2 / square**1.5
    flat, polar = 1.5 * J2_FACTOR * EQUATORIAL_RADIUS_M**2 / square, z * z / square
    level = factor * (1 + flat * (1 - 5 * polar)) + ROTATION_RATE_RAD_PER_S**2
    return axes.turned(
        (
            level * x + 2 * ROTATION_RATE_RAD_PER_S * v,
            level * y - 2 * ROTATION_RATE_RAD_PER_S * u,
            factor * (1 + flat * (3 - 5 * polar)) * z,
        )
    )


def earth_fixed_places(latitude: PerCase, longitude: PerCase, height: PerCase) -> Floats:
    """Earth-fixed coordinates (..., 3) of geodetic positions. [m]

    Latitude [rad], longitude [rad] and height [m] are arrays of the shape (...).
    """
    sine, cosine = np.sin(latitude), np.cos(latitude)
    _, normal = curvature_radii(sine)
    level = (normal + height) * cosine
    polar = (normal * (1 - _SQUARED_ECCENTRICITY_RATIO) + height) * sine
    return np.stack([level * np.cos(longitude), level * np.sin(longitude), polar], axis=-1)


def earth_fixed(position: Geodetic) -> Vector:
    """Earth-fixed coordinates of a geodetic position, whose components may be arrays (cases,). [m]"""
    return _vector(earth_fixed_places(*np.broadcast_arrays(*position)))


def _vector(coordinates: Floats) -> Vector:
    """Convert an array (3,) to three numbers, or an array (cases, 3) to three arrays (cases,)."""
    x, y, z = (coordinate if coordinate.ndim else coordinate.item() for coordinate in np.moveaxis(coordinates, -1, 0))
    return (x, y, z)


def curvature_radii(sine: PerCase) -> tuple[PerCase, PerCase]:
    """Radii of curvature of the ellipsoid along the meridian and across it. [m]

    `sine` is the sine of the latitude.
    """
    across = EQUATORIAL_RADIUS_M / np.sqrt(1 - _SQUARED_ECCENTRICITY_RATIO * sine * sine)
    return across**3 * (1 - _SQUARED_ECCENTRICITY_RATIO) / EQUATORIAL_RADIUS_M**2, across


def geodetic_places(points: Floats) -> tuple[Floats, Floats, Floats]:
    """Geodetic latitude [rad], longitude [rad] and height [m] of Earth-fixed coordinates (..., 3).

    Each result has the shape (...). Bowring's iteration on the reduced latitude is used. It is valid for positions
    more than a few kilometres from the Earth's centre.
    """
    x, y, z = np.moveaxis(points, -1, 0)
    level = np.hypot(x, y)
    with np.errstate(divide="ignore", invalid="ignore"):
        tangent = np.where(level > 0, z / (level * (1 - FLATTENING_RATIO)), np.copysign(np.inf, z))
    latitude = np.arctan2(z, level)
    for _ in range(10):
        reduced = np.arctan(tangent)
        up = z + _SQUARED_ECCENTRICITY_RATIO / (1 - FLATTENING_RATIO) * EQUATORIAL_RADIUS_M * np.sin(reduced) ** 3
        out = level - _SQUARED_ECCENTRICITY_RATIO * EQUATORIAL_RADIUS_M * np.cos(reduced) ** 3
        previous, latitude = latitude, np.arctan2(up, out)
        if np.max(np.abs(latitude - previous)) < _MAX_CHANGE_RAD:
            break
        tangent = (1 - FLATTENING_RATIO) * np.tan(latitude)
    sine = np.sin(latitude)
    height = (
        level * np.cos(latitude)
        + z * sine
        - EQUATORIAL_RADIUS_M * np.sqrt(1 - _SQUARED_ECCENTRICITY_RATIO * sine * sine)
    )
    return latitude, np.arctan2(y, x), height


def geodetic(point: Vector) -> Geodetic:
    """Geodetic latitude [rad], longitude [rad] and height [m] of a point with Earth-fixed coordinates [m]."""
    latitude, longitude, height = map(float, geodetic_places(np.array(point)))
    return Geodetic(latitude, longitude, height)


def _directions(latitude: PerCase, longitude: PerCase) -> Floats:
    """Unit vectors east, north and up at geodetic positions, in Earth-fixed axes.

    Latitude and longitude are arrays of the shape (...), in radians. The axes of the result (3, ..., 3) are
    direction, position and component.
    """
    sine, cosine, zero = np.sin(latitude), np.cos(latitude), np.zeros_like(longitude)
    sine_l, cosine_l = np.sin(longitude), np.cos(longitude)
    east = (-sine_l, cosine_l, zero)
    north = (-sine * cosine_l, -sine * sine_l, cosine)
    up = (cosine * cosine_l, cosine * sine_l, sine)
    return np.stack([np.stack(direction, axis=-1) for direction in (east, north, up)])


def axes_at_places(latitude: Floats, longitude: Floats) -> Floats:
    """Unit vectors east, north and up at n geodetic positions, in Earth-fixed axes.

    `latitude` and `longitude` are arrays (n,) in radians. The axes of the result (3, 3, n) are direction, Earth-fixed
    component and position.
    """
    return np.ascontiguousarray(np.moveaxis(_directions(latitude, longitude), -1, 1))


def axes_at(position: Geodetic) -> SceneAxes:
    """Axes of a scene whose origin is a geodetic position; the coordinates may be arrays (cases,)."""
    east, north, up = map(_vector, _directions(*np.broadcast_arrays(position.latitude, position.longitude)))
    return SceneAxes(earth_fixed(position), (east, north, up))


def flown(position: Geodetic, heading: float, speed: float, climb: float, times_s: PerCase) -> Floats:
    """Earth-fixed positions (..., 3) of a flight along a geodesic with constant speed and climb rate. [m]

    Parameters
    ----------
    position : Geodetic
        Position at time 0.
    heading : float
        Heading at time 0, clockwise from north. [rad]
    speed : float
        Horizontal speed at the height of flight. [m/s]
    climb : float
        Vertical speed. [m/s]
    times_s : (...) array_like
        Times of the positions; may be negative. [s]

    Notes
    -----
    The method was derived for this program. The direction of flight rotates only with the normal of the ellipsoid.
    Its rate of rotation is the speed divided by the radius of curvature, which follows from Euler's formula. The
    fourth-order Runge-Kutta method integrates in Earth-fixed axes, where the poles need no special treatment.
    """
    axes = axes_at(position)
    start = np.array(axes.origin)
    step = np.asarray(times_s, dtype=float)[..., None] / _RUNGE_KUTTA_STEPS

    def rates(state: Floats) -> Floats:
        """Rates of change (2, ..., 3) of the state of the flight.

        The state consists of the displacement from the start [m] and the unit vector of the direction of flight.
        """
        displacement, direction = state
        latitude, longitude, height = geodetic_places(start + displacement)
        east, north, up = _directions(latitude, longitude)
        meridian_radius, transverse_radius = curvature_radii(np.sin(latitude))
        to_east, to_north = np.sum(direction * east, axis=-1), np.sum(direction * north, axis=-1)
        radius = 1 / (to_north**2 / meridian_radius + to_east**2 / transverse_radius) + height
        return np.stack([speed * direction + climb * up, -speed / radius[..., None] * up])

    # The displacement is integrated, because it is rounded less than coordinates as large as the Earth's radius.
    displacement = np.zeros((*step.shape[:-1], 3))
    state = np.stack([displacement, displacement + axes.turned_back((math.sin(heading), math.cos(heading), 0.0))])
    for _ in range(_RUNGE_KUTTA_STEPS):
        rates_1 = rates(state)
        rates_2 = rates(state + step / 2 * rates_1)
        rates_3 = rates(state + step / 2 * rates_2)
        rates_4 = rates(state + step * rates_3)
        state = state + step / 6 * (rates_1 + 2 * rates_2 + 2 * rates_3 + rates_4)
    positions: Floats = start + state[0]
    return positions
