"""Lever arms: from the navigation's reference to the antenna's phase centre, in axes that turn with the body.

The body's axes are along, cross and up of the velocity, at every moment of the aperture; those of a platform that
stands still are the scene's. The antenna's position is the navigation's plus R(τ)·l. An error δl of the arm is
carried along, R(τ)·δl: a displacement, and as the body turns a defocus. An attitude error ψ swings the arm,
ψ × R(τ)·l. It keeps its direction in space, as that of a strapdown navigation with perfect gyros does, and as it does
where it turns the specific force. A gyro's bias ε lets it grow, ψ = ε·τ, its noise lets it walk.

The same ψ acts through the specific force and through the arm. So a figure of an inertial sensor has both in its own
row, and what attitude does through the arm alone is a row that counts nowhere again. Derived here.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from bisar_budget.effects.effect import PLATFORMS, subject
from bisar_budget.effects.random_effect import RandomError, SensorCases, parts_of_largest
from bisar_budget.effects.spectra import Floats
from bisar_budget.faults import KeyPath
from bisar_budget.geometry import PlatformState, cross, unit, without_rounding
from bisar_budget.mission.instruments import LeverArm


def body_axes(state: PlatformState, times: Floats) -> Floats:
    """Axes of a platform's body, along, cross and up of its velocity at slow times [s], (axes, 3, *times.shape)."""
    u, v, w = (np.broadcast_to(part, times.shape) for part in state.at(times)[1])
    if np.any(state.is_still):
        u, v, w = (np.where(state.is_still, *both) for both in ((1.0, u), (0.0, v), (0.0, w)))
    with np.errstate(all="ignore"):
        along = without_rounding(unit((u, v, w)))
        left = without_rounding(unit((-v, u, 0.0 * w)))
    return np.array((along, left, cross(along, left)))


def arm_at(state: PlatformState, arm: Any, times: Floats) -> Floats:
    """The arm at slow times [s] along the axes of the scene, (3, *times.shape). [m]"""
    return np.asarray(sum(length * axis for length, axis in zip(arm, body_axes(state, times), strict=True)))


def swung(axes: Floats, arm: Floats) -> Floats:
    """Displacement of an arm by a unit of tilt about each of some axes, (axes, 3, times, cases). [m/rad]

    The arm is (3, times, cases) [m], the axes are (axes, 3, cases).
    """
    about = (axes[:, 0, None], axes[:, 1, None], axes[:, 2, None])
    return np.stack(cross(about, (arm[0], arm[1], arm[2])), axis=1)


def lever_arm_errors(seen: SensorCases, name: str) -> Iterator[RandomError]:
    """Errors that attitude makes through a platform's arm, declared or not, and errors of the arm itself."""
    error = seen.error(name)
    lever: LeverArm | None = error.lever_arm
    if lever is None:
        return
    place, state, times = PLATFORMS.index(name), getattr(seen.geometry, name), seen.exact.times
    key = ("platforms", name, "motion_error")
    if lever.arm is not None:
        declared, axes = None, seen.axes(name)
        attitude = None if error.imu is None else error.imu.attitude
        if attitude is not None:
            declared, sizes = parts_of_largest(seen.vector(attitude))
            declared, axes = declared * seen.factor, axes * sizes[:, None]
        published, full = seen.of_motion(place, swung(axes, arm_at(state, lever.arm, times)))
        is_of_part = error.key_of("attitude") != "attitude"
        path: KeyPath = (*key, "sensor") if is_of_part else (*key, "imu", "attitude")
        what = subject(name, "lever_arm", "attitude")
        counted = subject(name, "imu", "attitude").id
        yield RandomError(what, "rad", declared, path, published, full, spreads=False, counted_in=counted)
    if lever.uncertainty is not None:
        declared, sizes = parts_of_largest(seen.vector(lever.uncertainty))
        published, full = seen.of_motion(place, body_axes(state, times) * sizes[:, None, None])
        what = subject(name, "lever_arm", "uncertainty")
        path = (*key, "lever_arm", "uncertainty")
        yield RandomError(what, "m", declared * seen.factor, path, published, full, spreads=False)
