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

from bisar_budget.constants import ROUNDING
from bisar_budget.effects.effect import PLATFORMS, subject
from bisar_budget.effects.random_effect import RandomError, SensorCases, parts_of_largest
from bisar_budget.effects.spectra import Floats
from bisar_budget.faults import KeyPath
from bisar_budget.geometry import PlatformState
from bisar_budget.mission.instruments import LeverArm


def body_axes(state: PlatformState, times: Floats) -> Floats:
    """Axes of a platform's body, along, cross and up of its velocity at slow times [s], (axes, 3, *times.shape)."""
    velocity = np.array([np.broadcast_to(part, times.shape) for part in state.at(times)[1]])
    still = np.broadcast_to(state.is_still, times.shape)
    east, north, up = np.eye(3).reshape(3, 3, *[1] * times.ndim)
    along = np.where(still, east, velocity)
    along = along / np.sqrt(np.square(along).sum(axis=0))
    cross = np.cross(up, along, axis=0)
    with np.errstate(all="ignore"):
        cross = np.where(still, north, cross / np.sqrt(np.square(cross).sum(axis=0)))
    axes = np.array((along, cross, np.cross(along, cross, axis=0)))
    return np.where(np.abs(axes) > ROUNDING, axes, 0.0)


def arm_at(state: PlatformState, arm: Any, times: Floats) -> Floats:
    """The arm at slow times [s] along the axes of the scene, (3, *times.shape). [m]"""
    return np.asarray(sum(length * axis for length, axis in zip(arm, body_axes(state, times), strict=True)))


def swung(axes: Floats, arm: Floats) -> Floats:
    """Displacement of an arm by a unit of tilt about each of some axes, (axes, 3, times, cases). [m/rad]

    The arm is (3, times, cases) [m], the axes are (axes, 3, cases).
    """
    return np.asarray(np.cross(axes[:, :, None], arm[None], axis=1))


def lever_arm_errors(seen: SensorCases, name: str) -> Iterator[RandomError]:
    """What attitude does through a platform's arm, declared or not, and how well the arm is known."""
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
        yield RandomError(what, "rad", declared, path, published, full, counted_in=counted)
    if lever.uncertainty is not None:
        declared, sizes = parts_of_largest(seen.vector(lever.uncertainty))
        published, full = seen.of_motion(place, body_axes(state, times) * sizes[:, None, None])
        what = subject(name, "lever_arm", "uncertainty")
        path = (*key, "lever_arm", "uncertainty")
        yield RandomError(what, "m", declared * seen.factor, path, published, full)
