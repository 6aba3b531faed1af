"""Path error of a platform in free fall: the orbit from the measured state minus the orbit from the true state.

Both orbits are integrated with the full gravity of a flattened Earth. The budget uses the linearised dynamics of
`paths.free_fall` instead. The simulator does not use these dynamics, and is therefore an independent check of the
budget.
"""

from collections.abc import Sequence
from functools import cache

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
    """Path error of a platform in free fall (measured minus true), caused by errors of its state at mid-aperture.

    Parameters
    ----------
    state : PlatformState
        True path of the platform. Its attribute `fall`, the dynamics of its errors, must be set.
    position, velocity, acceleration : (3,)
        Errors of position [m], velocity [m/s] and acceleration [m/s²] at mid-aperture: east, north, up. The velocity
        error is the rate of the position error in Earth-fixed axes. The acceleration error is constant in Earth-fixed
        axes.
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
    step = half / _STEP_COUNT
    turns = _turned_by(rotation, np.linspace(0.0, half, 2 * _STEP_COUNT + 1))  # at the ends and middles of steps
    push = np.array(acceleration, dtype=float)
    pushes = np.stack((turns @ push, push @ turns), axis=1)  # a rotation back in time is the transposed one

    # Both directions of time are integrated at once, (directions, orbits, 3).
    way = np.array((1.0, -1.0))[:, None, None]
    positions, velocities = (np.stack((state, state)) for state in ((r, wrong_r), (v, wrong_v)))

    def fallen(there: Floats, half_steps: int) -> Floats:
        """Accelerations on both orbits at the positions `there`, in the inertial axes of mid-aperture. [m/s²]

        `half_steps` is the time, counted in half integration steps from mid-aperture.
        """
        pulled = _gravity(there, rotation)
        pulled[:, 1] += pushes[half_steps]
        return pulled

    apart = np.empty((_STEP_COUNT + 1, 2, 3))
    apart[0] = positions[:, 1] - positions[:, 0]
    for index in range(_STEP_COUNT):
        stride, first = way * step, fallen(positions, 2 * index)
        second_velocities = velocities + stride / 2 * first
        second = fallen(positions + stride / 2 * velocities, 2 * index + 1)
        third_velocities = velocities + stride / 2 * second
        third = fallen(positions + stride / 2 * second_velocities, 2 * index + 1)
        fourth_velocities = velocities + stride * third
        fourth = fallen(positions + stride * third_velocities, 2 * index + 2)
        positions = positions + stride / 6 * (
            velocities + 2 * second_velocities + 2 * third_velocities + fourth_velocities
        )
        velocities = velocities + stride / 6 * (first + 2 * second + 2 * third + fourth)
        apart[index + 1] = positions[:, 1] - positions[:, 0]
    later = np.einsum("kji,kj->ki", turns[::2], apart[:, 0])
    earlier = np.einsum("kij,kj->ki", turns[::2], apart[:, 1])
    differences = np.concatenate((earlier[:0:-1], later))
    return np.asarray(np.polynomial.legendre.legval(slow_time / half, _fit() @ differences).T)


@cache
def _fit() -> Floats:
    """Matrix (orders, ends) that fits Legendre polynomials to values at the ends of all integration steps."""
    times = np.linspace(-1.0, 1.0, 2 * _STEP_COUNT + 1)
    return np.asarray(np.linalg.pinv(np.polynomial.legendre.legvander(times, _ORDER)))


def _gravity(positions: Floats, rotation: Floats) -> Floats:
    """Gravitational acceleration at positions (..., 3) relative to the Earth's centre. [m/s²]

    `rotation` is the angular velocity of the Earth and gives the direction of its axis. Gravity is the gradient of
    the potential (μ/r)·[1 − J₂·(R/r)²·(3z²/r² − 1)/2], where z is the component of the position along the axis and R
    is the equatorial radius. If `rotation` is zero, the Earth is a sphere.
    """
    distance = np.sqrt((positions * positions).sum(axis=-1, keepdims=True))
    pull = -EARTH_GRAVITATIONAL_PARAMETER_M3_PER_S2 / (distance * distance * distance)
    rate = float(np.linalg.norm(rotation))
    if rate == 0:
        return np.asarray(pull * positions)
    pole = rotation / rate
    along = (positions @ pole)[..., None]
    oblate = 1.5 * J2_FACTOR * (EQUATORIAL_RADIUS_M / distance) ** 2
    return np.asarray(
        pull * (positions + oblate * ((1 - 5 * (along / distance) ** 2) * positions + 2 * along * pole))
    )


def _turned_by(rotation: Floats, times: Floats) -> Floats:
    """Rotation matrices (times, 3, 3) for rotations over `times` [s] with the angular velocity `rotation` [rad/s]."""
    rate = float(np.linalg.norm(rotation))
    if rate == 0:
        return np.broadcast_to(np.eye(3), (times.size, 3, 3))
    x, y, z = rotation / rate
    spin = np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))
    angle = rate * times[:, None, None]
    return np.asarray(np.eye(3) + np.sin(angle) * spin + (1 - np.cos(angle)) * spin @ spin)
