"""Path error of a platform in free fall: the orbit from the measured state minus the orbit from the true state.

Both orbits are integrated with the full law of gravity of a flattened Earth. The budget uses the linearised dynamics
of `paths.free_fall` instead. The simulator does not use them, because it checks the budget.
"""

import math
from collections.abc import Sequence

import numpy as np

from bisar_budget.arrays import Floats
from bisar_budget.constants import EARTH_GRAVITATIONAL_PARAMETER_M3_PER_S2
from bisar_budget.geometry import PlatformState
from bisar_budget.paths.earth import EQUATORIAL_RADIUS_M, J2_FACTOR

_STEP_COUNT = 64  # Runge-Kutta steps on each side of mid-aperture
_ORDER = 14  # order of the polynomial fitted to the differences of both orbits


def orbit_error(
    state: PlatformState,
    position: Sequence[float],
    velocity: Sequence[float],
    acceleration: Sequence[float],
    slow_time: Floats,
) -> Floats:
    """Error of the measured path of a platform in free fall, from the errors of its state at mid-aperture.

    Parameters
    ----------
    state : PlatformState
        The true path. Its attribute `fall`, the dynamics of its errors, must be set.
    position, velocity, acceleration : (3,)
        Errors at mid-aperture: east, north, up. [m], [m/s], [m/s²] The velocity error is the rate of the position
        error in Earth-fixed axes. The acceleration error is constant in Earth-fixed axes.
    slow_time : (times,)
        Slow times. [s]

    Returns
    -------
    (times, 3)
        Measured minus true position: east, north, up. [m]
    """
    fall = state.fall
    assert fall is not None
    rotation = np.array(fall.rotation, dtype=float)
    r = np.array(state.position, dtype=float) - np.array(fall.centre, dtype=float)
    v = np.array(state.velocity, dtype=float) + np.cross(rotation, r)
    wrong_r = r + np.array(position)
    wrong_v = np.array(state.velocity) + np.array(velocity) + np.cross(rotation, wrong_r)
    half = max(float(np.abs(slow_time).max()), 1e-9)
    times = np.linspace(-half, half, 2 * _STEP_COUNT + 1)
    start = np.array(((r, v), (wrong_r, wrong_v)))  # by orbit, then place and velocity
    push = np.array(acceleration, dtype=float)

    def rates(time: float, states: Floats) -> Floats:
        """Inertial velocity and acceleration on both orbits, in axes fixed at mid-aperture, (2, 2, 3).

        The first axis is the orbit, true and then measured. The second axis is the velocity, then the acceleration.
        """
        fallen = _gravity(states[:, 0], rotation)
        fallen[1] += _turned_by(rotation, time) @ push
        return np.stack((states[:, 1], fallen), axis=1)

    differences = np.empty((times.size, 3))
    for sign in (1, -1):
        states, step = start, sign * half / _STEP_COUNT
        for index in range(_STEP_COUNT + 1):
            time = index * step
            back = _turned_by(rotation, time).T
            differences[_STEP_COUNT + sign * index] = back @ (states[1, 0] - states[0, 0])
            first = rates(time, states)
            second = rates(time + step / 2, states + step / 2 * first)
            third = rates(time + step / 2, states + step / 2 * second)
            fourth = rates(time + step, states + step * third)
            states = states + step / 6 * (first + 2 * second + 2 * third + fourth)
    fitted = np.polynomial.legendre.legfit(times / half, differences, _ORDER)
    return np.asarray(np.polynomial.legendre.legval(slow_time / half, fitted).T)


def _gravity(places: Floats, rotation: Floats) -> Floats:
    """Gravity at places (n, 3) relative to the Earth's centre. [m/s²]

    The Earth's axis is along `rotation`, its rate of rotation. Gravity is the gradient of the potential
    (μ/r)·[1 − J₂·(R/r)²·(3z²/r² − 1)/2], where z is the component along the axis and R the equatorial radius. Without
    rotation the Earth is a sphere.
    """
    distance = np.linalg.norm(places, axis=1, keepdims=True)
    pull = -EARTH_GRAVITATIONAL_PARAMETER_M3_PER_S2 / distance**3
    rate = float(np.linalg.norm(rotation))
    if rate == 0:
        return np.asarray(pull * places)
    pole = rotation / rate
    along = places @ pole[:, None]
    oblate = 1.5 * J2_FACTOR * (EQUATORIAL_RADIUS_M / distance) ** 2
    return np.asarray(pull * (places + oblate * ((1 - 5 * (along / distance) ** 2) * places + 2 * along * pole)))


def _turned_by(rotation: Floats, time: float) -> Floats:
    """Rotation matrix (3, 3) for a rotation at the angular rate `rotation` [rad/s] during `time`. [s]"""
    rate = float(np.linalg.norm(rotation))
    if rate == 0:
        return np.eye(3)
    x, y, z = rotation / rate
    spin = np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))
    return np.asarray(np.eye(3) + math.sin(rate * time) * spin + (1 - math.cos(rate * time)) * spin @ spin)
