"""Doubts about the checked mission itself, which set its status to at least `warn`.

Each kind of doubt is identified by the code of the warning that `check` gives for it. The functions work for a single
case and for an array of cases. A case of a sweep therefore gets the same status as a check of a mission with the same
values.
"""

import math
from collections.abc import Callable, Mapping

import numpy as np

from bisar_budget.arrays import Booleans, PerCase, PerCaseFlag
from bisar_budget.budget.declarations import swings_nothing
from bisar_budget.budget.doubts import is_coarse, leaves_unsaid, strays
from bisar_budget.budget.judged_requirements import negligible_rad
from bisar_budget.constants import (
    EARTH_GRAVITATIONAL_PARAMETER_M3_PER_S2,
    EARTH_RADIUS_M,
    LEAST_FALLING_HEIGHT_M,
    MAX_FLIGHT_SPEED_MPS,
)
from bisar_budget.effects.effect import NOWHERE, PLATFORMS
from bisar_budget.effects.navigation_errors import body_axes_of, specific_force
from bisar_budget.effects.oscillator_acceleration import is_unshaken
from bisar_budget.geometry import BistaticGeometry, PlatformState, dot, norm
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import Platform

_MAX_GROUND_HEIGHT_M = 20e3  # of a scene, above a sphere of the Earth's mean radius
_MIN_ORBIT_SPEED_MPS = 100.0  # over the ground, of satellites above 100 km that are not geostationary


# ---------------------------------------------------------------------- paths that resemble those of satellites
def flies_straight(mission: Mission, name: str, path: PlatformState) -> PerCaseFlag:
    """Whether a platform moves like a satellite, but on a straight path, as a Boolean or an array (cases,).

    A path without an acceleration counts as a satellite's path if it is as fast as a satellite, or if it is above
    100 km and moves. Over an aperture time T, a missing acceleration a moves the true path away from the straight
    path by aT²/8, for example 25 m in 5 s.
    """
    if not _is_unbent(getattr(mission.platforms, name)):
        return False
    speed = np.asarray(norm(path.velocity))
    is_satellite = (speed > MAX_FLIGHT_SPEED_MPS) | (_is_high(mission, path) & (speed > _MIN_ORBIT_SPEED_MPS))
    return is_satellite & ~_falls(path)


def does_not_fall(mission: Mission, name: str, path: PlatformState) -> PerCaseFlag:
    """Whether omitted orbital dynamics may affect the errors on a path above 100 km that is not in free fall.

    The result is a Boolean or an array (cases,). It is false for a path to which `flies_straight` applies. The
    dynamics matter if they may change a phase noticeably. They also matter if the errors are stated in the frame
    `ric`, because the velocity errors are then not inertial.
    """
    is_high = _is_high(mission, path) & ~_falls(path)
    if not np.any(is_high):
        return False
    matters = missing_phase_rad(mission, name, path) > np.asarray(negligible_rad(mission))
    is_here = is_high & ~np.asarray(flies_straight(mission, name, path))
    return np.asarray(is_here & (matters | _is_along_orbit(mission, name)))


def missing_phase_rad(mission: Mission, name: str, path: PlatformState) -> PerCase:
    """Upper bound on the quadratic phase that orbital dynamics add to the declared errors of a platform. [rad]

    A position error δr and a velocity error δv change the position by δr + δv·τ at slow time τ. The gradient of
    gravity and the rotation of the Earth add an acceleration of at most (2μ/r³ + ω²)|δr| + 2ω|δv|, where μ is the
    gravitational parameter of the Earth, ω is its rotation rate, and r is the distance from its centre. A constant
    acceleration a over an aperture time T causes the quadratic phase 2π/λ·aT²/8. The bound is derived here.
    """
    from bisar_budget.paths.earth import ROTATION_RATE_RAD_PER_S  # takes 8 ms; most missions have no satellite
    from bisar_budget.paths.free_fall import departure_of

    error, common = getattr(mission.platforms, name).motion_error, mission.common_motion_error
    position, velocity = (
        norm(of_platform or NOWHERE) + norm(of_both or NOWHERE)
        for of_platform, of_both in (
            (error.stated("position"), common and common.position),
            (error.stated("velocity"), common and common.velocity),
        )
    )
    distance = EARTH_RADIUS_M + departure_of(path, mission.scene.axes)[0]
    gradient = 2 * EARTH_GRAVITATIONAL_PARAMETER_M3_PER_S2 / distance**3 + ROTATION_RATE_RAD_PER_S**2
    pushed = mission.allocation.coverage_factor * (gradient * position + 2 * ROTATION_RATE_RAD_PER_S * velocity)
    phase_rad: PerCase = 2 * math.pi / mission.radar.wavelength * pushed * mission.collection.aperture_time**2 / 8
    return phase_rad


def _is_unbent(platform: Platform) -> bool:
    return platform.acceleration is None and not platform.is_of_the_earth


def _falls(path: PlatformState) -> Booleans:
    """Whether a path has the dynamics of free fall, as a Boolean or an array (cases,)."""
    return np.asarray(False if path.fall is None else np.asarray(path.fall.share) > 0)


def _is_high(mission: Mission, path: PlatformState) -> Booleans:
    """Whether a path is more than 100 km above the Earth, as a Boolean or an array (cases,)."""
    is_far = np.asarray(path.slant_range) >= LEAST_FALLING_HEIGHT_M - _MAX_GROUND_HEIGHT_M
    if not is_far.any():
        return is_far
    from bisar_budget.paths.free_fall import departure_of  # takes 8 ms; most missions have no satellite

    return is_far & (np.asarray(departure_of(path, mission.scene.axes)[0]) > LEAST_FALLING_HEIGHT_M)


def _is_along_orbit(mission: Mission, name: str) -> bool:
    """Whether the file states errors of a platform in the frame `ric`.

    Velocity errors in this frame are inertial only for platforms on an orbit.
    """
    error, common = getattr(mission.platforms, name).motion_error, mission.common_motion_error
    is_of_platform = error.frame == "ric" and any(error.stated(kind) is not None for kind in ("position", "velocity"))
    return is_of_platform or (common is not None and common.frame == "ric")


# ---------------------------------------------------------------------- paths and entries of the file
def has_doubtful_path(mission: Mission, name: str, path: PlatformState) -> PerCaseFlag:
    """Whether the path of a platform may be inaccurate and no row reports it, as a Boolean or an array (cases,).

    Doubts about the position and about the residual of a log are treated separately.
    """
    flown = getattr(mission.platforms, name).path
    if flown is None or not flown.doubts:
        return False
    if flown.samples:
        return True
    by_rows = (strays(mission, name), is_coarse(mission, name), leaves_unsaid(mission, name))
    return ~np.asarray(np.any(np.broadcast_arrays(*by_rows), axis=0))


def has_idle_arm(mission: Mission, name: str, path: PlatformState) -> PerCaseFlag:
    """Whether a lever arm has no attitude error that would rotate it, as a Boolean or an array (cases,)."""
    return swings_nothing(getattr(mission.platforms, name))


def has_calm_oscillator(mission: Mission, name: str, path: PlatformState) -> PerCaseFlag:
    """Whether the file states an oscillator's sensitivity to acceleration, but no vibration or turn that acts on it.

    A sensitivity that comes from a part of the catalogue causes no doubt. The result is a Boolean or an array
    (cases,).
    """
    oscillator = getattr(mission.platforms, name).oscillator
    return oscillator is not None and oscillator.states_sensitivity and is_unshaken(mission, name)


# ---------------------------------------------------------------------- aided navigation
def leaves_out_scale_factor(mission: Mission, name: str, path: PlatformState) -> PerCaseFlag:
    """Whether a scale factor of an aided navigation may cause more phase in a turn than an image takes unnoticed.

    The result is a Boolean or an array (cases,).
    """
    return np.asarray(scale_factor_phase_rad(mission, name, path) > np.asarray(negligible_rad(mission)))


def scale_factor_phase_rad(mission: Mission, name: str, path: PlatformState) -> PerCase:
    """Upper bound on the quadratic phase by the scale factor of an aided navigation on a path that accelerates. [rad]

    The covariance of the navigation does not contain this error. A scale factor s and a constant acceleration a of
    the path make an acceleration error of at most s·a, which over an aperture time T causes the quadratic phase
    2π/λ·s·a·T²/8. The bound is derived here. It is zero for a straight path, and in free fall.
    """
    navigation = getattr(mission.platforms, name).motion_error.navigation
    scale = None if navigation is None else navigation.imu.accelerometer_scale_factor
    if scale is None:
        return 0.0
    axes = body_axes_of(np.array(np.broadcast_arrays(*path.velocity), float), path.is_still)
    # Components of the acceleration error along the body axes; the specific force is zero in free fall.
    errors = (
        np.array([factor * dot(axis, force) for factor, axis in zip(scale, axes, strict=True)])
        for force in (path.acceleration, specific_force(mission, path))
    )
    sizes = [np.sqrt(np.sum(np.square(error), axis=0)) for error in errors]
    acceleration_mps2 = mission.allocation.coverage_factor * np.minimum(*sizes)
    phase_rad: PerCase = (
        2 * math.pi / mission.radar.wavelength * acceleration_mps2 * (mission.collection.aperture_time**2 / 8)
    )
    return phase_rad


MISSION_DOUBTS: Mapping[str, Callable[[Mission, str, PlatformState], PerCaseFlag]] = {
    "satellite-flies-straight": flies_straight,
    "satellite-does-not-fall": does_not_fall,
    "path-is-doubtful": has_doubtful_path,
    "nothing-swings-the-arm": has_idle_arm,
    "nothing-shakes-the-oscillator": has_calm_oscillator,
    "scale-factor-in-a-turn": leaves_out_scale_factor,
}


def mission_doubts(mission: Mission, geometry: BistaticGeometry, cases: int) -> dict[str, Booleans]:
    """Find the cases with each kind of doubt about at least one of the platforms.

    The result maps the code of each warning to a mask of the cases, (cases,).
    """
    masks = {}
    for code, is_doubted in MISSION_DOUBTS.items():
        of_platforms = [
            np.broadcast_to(is_doubted(mission, name, path), (cases,))
            for name, path in zip(PLATFORMS, geometry.both, strict=True)
        ]
        masks[code] = np.any(of_platforms, axis=0)
    return masks
