"""Motion errors of platforms in free fall, from the linearised dynamics of the orbit.

If the measured position and velocity of a satellite are wrong at mid-aperture, the satellite is assumed to be on a
slightly different orbit. The difference between the true and the assumed orbit is not a straight line in time: a
height error changes the orbital period, and gravity is evaluated at a wrong position.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from bisar_budget.arrays import Floats, PerCase
from bisar_budget.constants import EARTH_GRAVITATIONAL_PARAMETER_M3_PER_S2, EARTH_RADIUS_M, LEAST_FALLING_HEIGHT_M
from bisar_budget.geometry import PlatformState, Vectors, cross, norm
from bisar_budget.paths.earth import (
    EQUATORIAL_RADIUS_M,
    J2_FACTOR,
    ROTATION_RATE_RAD_PER_S,
    SceneAxes,
    free_fall,
)

FREE_FALL_FRACTION = 0.05  # of gravity; a path in free fall has an acceleration that differs by less
_NODE_COUNT = 12  # of the collocation; over half a radian of an orbit its error is 1e-12 of the motion


@dataclass(frozen=True)
class FreeFall:
    """Dynamics of the errors of a platform in free fall, in the axes of a scene.

    Attributes
    ----------
    centre : Vectors
        Position of the Earth's centre. [m]
    rotation : Vectors
        Inertial rotation rate of the axes, along the Earth's axis [rad/s]. It is zero for a scene without a position
        on the Earth; the Earth is then a sphere.
    share : float or (cases,)
        1 in cases in which the platform is in free fall, and 0 in all other cases. If it is 0, errors p, v and a of
        position, velocity and acceleration cause the position error p + vτ + aτ²/2, without gravity and rotation.
    """

    centre: Vectors
    rotation: Vectors
    share: PerCase = 1.0

    def motions(self, path: PlatformState, half: Floats, places: Floats) -> Floats:
        """Position error over the aperture due to unit errors of position, velocity and acceleration at mid-aperture.

        Parameters
        ----------
        path : PlatformState
            The path of the platform.
        half : (cases,)
            Half the aperture time. [s]
        places : (nodes,)
            Slow times from -1 to 1, in units of `half`.

        Returns
        -------
        (3, 3, 3, nodes, cases)
            Position errors [m]. The axes of the array are: the unit error (1 m of position, 1 m/s of velocity, 1 m/s²
            of acceleration), the axis of this error, the component (east, north, up), the slow time and the case. The
            velocity error is the rate of change of the position error in the axes of the scene. The acceleration
            error is constant in these axes.

        Notes
        -----
        The method was derived for this program. In axes that rotate at the rate ω, δr̈ = Gδr − ω×(ω×δr) − 2ω×δṙ + a
        with the gravity gradient G. The acceleration δr̈ is approximated by a polynomial that satisfies the equation
        at Gauss-Legendre nodes. The values of the polynomial at the nodes are found from a linear system for each
        case.
        """
        collocation = _collocation()
        cases, count = half.size, collocation.times.size
        gravity, spin = self._matrices(path, collocation.times[:, None] * half, cases)
        times = (collocation.times[:, None] * half).T  # (cases, N)
        h = half[:, None, None, None, None]
        system = 2 * h * np.einsum("cab,ij->ciajb", spin, collocation.once)
        system -= h**2 * np.einsum("ciab,ij->ciajb", gravity, collocation.twice)
        system = system.reshape(cases, 3 * count, 3 * count) + np.eye(3 * count)
        forces = np.empty((cases, count, 3, 3, 3))  # by node, component, error, axis
        forces[..., 0, :] = gravity
        forces[..., 1, :] = times[..., None, None] * gravity - 2 * spin[:, None]
        forces[..., 2, :] = np.eye(3)
        accelerations = np.linalg.solve(system, forces.reshape(cases, 3 * count, 9)).reshape(forces.shape)
        bent = np.einsum("qj,cjaek->ekaqc", collocation.twice_at(places), accelerations) * half**2
        tau = places[:, None] * half
        for axis in range(3):
            bent[0, axis, axis] += 1.0
            bent[1, axis, axis] += tau
        return np.asarray(bent)

    def _matrices(self, path: PlatformState, times: Floats, cases: int) -> tuple[Floats, Floats]:
        """Matrices of the linearised dynamics: G − ω×(ω×·) (cases, nodes, 3, 3) [1/s²] and ω×· (cases, 3, 3) [1/s].

        G is the gravity gradient, and ω the rotation rate of the axes. `times` (nodes, cases) [s] are slow times.

        G is the second derivative of the potential of `earth.free_fall`; it was derived for this program. With the
        direction p of the Earth's axis, s = r̂·p and the equatorial radius R, the spherical Earth contributes
        μ/r³·(3r̂r̂ᵀ − 1), and the flattening adds −μ/r³·(3/2)J₂(R/r)²·[1 − 5s² − (5 − 35s²)r̂r̂ᵀ − 10s(r̂pᵀ + pr̂ᵀ) +
        2ppᵀ].
        """
        share = np.broadcast_to(self.share, (cases,))
        offset = np.stack(
            [np.broadcast_to(x - c, times.shape) for x, c in zip(path.place(times), self.centre, strict=True)],
            axis=-1,
        )
        distance = np.linalg.norm(offset, axis=-1)
        up = offset / distance[..., None]
        squared_up, identity = up[..., :, None] * up[..., None, :], np.eye(3)
        gradient = 3 * squared_up - identity
        if any(map(np.any, self.rotation)):  # without a place on the Earth, the Earth is a sphere
            pole = (
                np.stack([np.broadcast_to(w, times.shape) for w in self.rotation], axis=-1) / ROTATION_RATE_RAD_PER_S
            )
            sine = np.sum(up * pole, axis=-1)[..., None, None]
            mixed = up[..., :, None] * pole[..., None, :]
            flattened = (1 - 5 * sine**2) * identity - (5 - 35 * sine**2) * squared_up
            flattened += 2 * pole[..., :, None] * pole[..., None, :] - 10 * sine * (mixed + mixed.swapaxes(-1, -2))
            gradient -= 1.5 * J2_FACTOR * (EQUATORIAL_RADIUS_M / distance[..., None, None]) ** 2 * flattened
        gradient *= EARTH_GRAVITATIONAL_PARAMETER_M3_PER_S2 / distance[..., None, None] ** 3
        x, y, z = (np.broadcast_to(component, (cases,)) * share for component in self.rotation)
        zero = np.zeros(cases)
        spin = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)
        gravity = share[:, None, None, None] * gradient.swapaxes(0, 1) - (spin @ spin)[:, None]
        return gravity, spin

    def rate_against_stars(self, position: Vectors) -> Vectors:
        """Rate of change −ω×p, in the axes of the scene, of a position error p that is constant in inertial space.

        ω is the rotation rate of the axes of the scene. The result is in m/s for `position` in m, and in 1/s for a
        unit vector.
        """
        x, y, z = cross(self.rotation, position)
        return (-x * self.share, -y * self.share, -z * self.share)

    def orbit_rate(self, path: PlatformState) -> Vectors:
        """Inertial angular rate of the orbit about the Earth's centre at mid-aperture. [rad/s]"""
        x, y, z = (p - c for p, c in zip(path.position, self.centre, strict=True))
        turned = cross(self.rotation, (x, y, z))
        u, v, w = (rate + more for rate, more in zip(path.velocity, turned, strict=True))
        a, b, c = cross((x, y, z), (u, v, w))
        square = x * x + y * y + z * z
        return (a / square, b / square, c / square)

    def of(self, cases: Any) -> "FreeFall":
        """Select the dynamics of the cases with the indices `cases`."""

        def chosen(number: PerCase) -> PerCase:
            return number[cases] if isinstance(number, np.ndarray) and number.ndim else number

        centre, rotation = (tuple(map(chosen, vector)) for vector in (self.centre, self.rotation))
        return FreeFall(
            (centre[0], centre[1], centre[2]), (rotation[0], rotation[1], rotation[2]), chosen(self.share)
        )


def of_scene(axes: SceneAxes | None) -> FreeFall:
    """Dynamics of free fall in the axes of a scene.

    If `axes` is None, the scene has no position on the Earth. The Earth's centre is then one Earth radius below the
    scene centre, and the axes do not rotate.
    """
    if axes is None:
        return FreeFall((0.0, 0.0, -EARTH_RADIUS_M), (0.0, 0.0, 0.0))
    return FreeFall(axes.place((0.0, 0.0, 0.0)), axes.turned((0.0, 0.0, ROTATION_RATE_RAD_PER_S)))


def fall_of(path: PlatformState, axes: SceneAxes | None) -> FreeFall | None:
    """Dynamics of the errors of a path that is in free fall above a height of 100 km; None for any other path.

    A path is in free fall if its acceleration differs from the acceleration in free fall by at most 5 % of gravity,
    μ/r². The coordinates of the path may be arrays (cases,); `share` of the result then tells which cases are in free
    fall.
    """
    height, departure = departure_of(path, axes)
    falls = (height > LEAST_FALLING_HEIGHT_M) & (departure <= FREE_FALL_FRACTION)
    if not np.any(falls):
        return None
    fall = of_scene(axes)
    return fall if np.all(falls) else FreeFall(fall.centre, fall.rotation, np.asarray(falls, dtype=float))


def departure_of(path: PlatformState, axes: SceneAxes | None) -> tuple[PerCase, PerCase]:
    """Height of a path above a spherical Earth [m], and the difference of its acceleration from free fall.

    The difference is given as a fraction of gravity, μ/r². Both results are numbers, or arrays (cases,).
    """
    centre = of_scene(axes).centre
    x, y, z = (component - origin for component, origin in zip(path.position, centre, strict=True))
    distance = norm((x, y, z))
    falling = free_fall(path.position, path.velocity, axes)
    u, v, w = (stated - fallen for stated, fallen in zip(path.acceleration, falling, strict=True))
    return distance - EARTH_RADIUS_M, norm((u, v, w)) * distance**2 / EARTH_GRAVITATIONAL_PARAMETER_M3_PER_S2


@dataclass(frozen=True, eq=False)
class _Collocation:
    """N Gauss-Legendre nodes from -1 to 1, and matrices (N, N) that integrate a function given by its values there.

    `times` (N,) are the nodes. Multiplied by the values of the function, `once` and `twice` give its single and
    double integrals from 0 to each node. `to_coefficients` gives the Legendre coefficients of the polynomial through
    the values.
    """

    times: Floats
    once: Floats
    twice: Floats
    to_coefficients: Floats

    def twice_at(self, places: Floats) -> Floats:
        """Matrix (places, N) that converts values at the N nodes to double integrals from 0 to the times `places`."""
        return _integral(places, 2) @ self.to_coefficients


def _integral(places: Floats, times: int) -> Floats:
    """Multiple integrals (places, N) of the first N Legendre polynomials from 0 to `places`.

    Each polynomial is integrated `times` times.
    """
    return np.asarray(np.polynomial.legendre.legvander(places, _NODE_COUNT - 1 + times) @ _integrated(times))


@cache
def _integrated(times: int) -> Floats:
    """Legendre coefficients of the first N Legendre polynomials, each integrated `times` times from 0.

    Each column of the result belongs to one polynomial.
    """
    return np.asarray(np.polynomial.legendre.legint(np.eye(_NODE_COUNT), m=times, lbnd=0.0))


@cache
def _collocation() -> _Collocation:
    times, _ = np.polynomial.legendre.leggauss(_NODE_COUNT)
    to_coefficients = np.asarray(np.linalg.inv(np.polynomial.legendre.legvander(times, _NODE_COUNT - 1)), dtype=float)
    once, twice = (_integral(times, order) @ to_coefficients for order in (1, 2))
    return _Collocation(times, once, twice, to_coefficients)
