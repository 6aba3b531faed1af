"""Warnings about the navigation of platforms.

They concern aided navigations whose fixes do not determine the errors, inertial units that are not aided by the GNSS
receiver of their platform, and position errors that contradict the velocity errors. A warning consists of a sentence
and the key of the mission file to which it refers.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from bisar_budget import phrases
from bisar_budget.analysis.analysis import Case
from bisar_budget.budget.mission_doubts import leaves_out_scale_factor, scale_factor_phase_rad
from bisar_budget.effects.aided_navigation import aided_navigation
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.effects.random_effect import RandomError, SensorCases
from bisar_budget.error_kinds.path_kinds import POSITION_KIND, VELOCITY_KIND
from bisar_budget.error_kinds.random_kinds import INERTIAL_FIGURES
from bisar_budget.faults import KeyPath
from bisar_budget.geometry import PlatformState
from bisar_budget.mission.model import Mission
from bisar_budget.mission.navigation import AIDED_IMU_FIGURES, NEEDED_IMU_FIGURES, AidedGnss, AidedImu, Navigation
from bisar_budget.mission.platforms import MotionError, Platform
from bisar_budget.phrases import Note

_ASSUMED_RATE_HZ = 1.0  # of the fixes of a receiver, for comparison
_CONTRADICTION_RATIO = 3.0  # of the way of a velocity error within half an aperture to the position error
_CONVERGED_FRACTION = 0.3  # of an error at the start; with more at mid-aperture, a navigation rests on its start


def navigation_warnings(case: Case) -> Iterator[tuple[KeyPath, Note]]:
    """Yield the warnings about the navigation of both platforms, as pairs of key and note."""
    mission = case.mission
    for name in PLATFORMS:
        platform: Platform = getattr(mission.platforms, name)
        error, key = platform.motion_error, ("platforms", name, "motion_error")
        fixes = ".".join(map(str, POSITION_KIND.section(name)))  # a GNSS receiver of the catalogue states them
        if error.navigation is not None:
            yield from (
                ((*key, "navigation"), note)
                for random_error in case.random
                if random_error.navigation is not None and random_error.owner == name
                for note in _of_aided(mission, error.navigation, random_error)
            )
        elif error.imu is not None and any(figure.key == fixes for figure in mission.taken):
            yield (*key, "sensor"), _of_free_running(mission, name, case.random)
    yield from _contradictions(mission)


def _of_aided(mission: Mission, navigation: Navigation, error: RandomError) -> Iterator[Note]:
    """Yield a warning if an aided navigation has no fix, or if too much of an error assumed at its start remains."""
    half, errors = mission.collection.aperture_time / 2, error.navigation
    assert errors is not None
    if not errors.has_fixes:
        start, end = -half - navigation.before, half + float(navigation.after_s)
        yield phrases.note("navigation-has-no-fix", platform=error.owner, start=start, end=end)
        return
    share, quantity = errors.remaining_start
    if share > _CONVERGED_FRACTION:
        yield phrases.note("navigation-has-not-converged", platform=error.owner, share=share, quantity=quantity)
    state: PlatformState = getattr(mission.platforms, error.owner).state
    if np.all(leaves_out_scale_factor(mission, error.owner, state)):
        phase = float(scale_factor_phase_rad(mission, error.owner, state))
        yield phrases.note("scale-factor-in-a-turn", platform=error.owner, phase=phase)


def _of_free_running(mission: Mission, name: str, errors: Sequence[RandomError]) -> Note:
    """Warn that an inertial unit is not aided although its platform has a GNSS receiver.

    The note gives the quadratic phase of the unaided unit, and also the phase with aiding if it can be computed.
    """
    phases = [
        error.full.quadratic * (error.declared or 0.0)
        for error in errors
        if error.owner == name and error.kind.sizes is INERTIAL_FIGURES
    ]
    free = math.sqrt(math.fsum(float(phase) ** 2 for phase in phases))
    aided = _phase_if_aided(mission, name)
    if aided is None:
        return phrases.note("sensor-runs-free", platform=name, free=free)
    return phrases.note("sensor-runs-free-not-aided", platform=name, free=free, aided=aided, rate=_ASSUMED_RATE_HZ)


def _phase_if_aided(mission: Mission, name: str) -> float | None:
    """Quadratic phase [rad] if the GNSS receiver aided the inertial unit; None if a needed figure is missing."""
    platform: Platform = getattr(mission.platforms, name)
    imu, error = platform.motion_error.imu, platform.motion_error
    if any(getattr(imu, figure) is None for figure in NEEDED_IMU_FIGURES) or not np.all(error.position):
        return None
    velocity = error.velocity if error.velocity is not None and np.all(error.velocity) else None
    navigation = Navigation(
        imu=AidedImu(**{figure: getattr(imu, figure) for figure in AIDED_IMU_FIGURES}),
        gnss=AidedGnss(rate=_ASSUMED_RATE_HZ, position=error.position, velocity=velocity),
    )
    aided = platform._replace(motion_error=MotionError(navigation=navigation))
    with_aid = mission._replace(platforms=mission.platforms._replace(**{name: aided}))
    (random_error,) = aided_navigation(SensorCases(with_aid, mission.geometry, 1), name)
    return float(np.ravel(random_error.full.quadratic * random_error.declared)[0])


def _contradictions(mission: Mission) -> Iterator[tuple[KeyPath, Note]]:
    """Yield a warning if the sigmas of position and velocity cannot both hold over the whole aperture.

    A position error that is small at every moment leaves no room for the way of a large velocity error. One warning
    names all platforms, with the figures of the worst.
    """
    half = mission.collection.aperture_time / 2
    worst = {}
    for name in PLATFORMS:
        error: MotionError = getattr(mission.platforms, name).motion_error
        if not error.is_measured or error.position is None or error.velocity is None:
            continue
        ways = [
            (abs(velocity) * half / abs(position), abs(position), abs(velocity))
            for position, velocity in zip(error.position, error.velocity, strict=True)
            if position
        ]
        if max(ways, default=(0.0,))[0] > _CONTRADICTION_RATIO:
            worst[name] = max(ways)
    if worst:
        _, position, velocity = max(worst.values())
        key = VELOCITY_KIND.section(next(iter(worst)))
        platforms, way = list(worst), velocity * half
        note = phrases.note(
            "position-and-velocity-contradict", platforms=platforms, position=position, velocity=velocity, way=way
        )
        yield key, note
