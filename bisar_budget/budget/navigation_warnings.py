"""Warnings about navigations: inertial units that run free beside a GNSS receiver, and errors that contradict.

A warning is a sentence and the key to which it refers.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from bisar_budget import phrases
from bisar_budget.analysis.analysis import Case
from bisar_budget.effects.aided_navigation import aided_navigation
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.effects.random_effect import RandomError, SensorCases
from bisar_budget.error_kinds.path_kinds import POSITION_KIND
from bisar_budget.error_kinds.random_kinds import INERTIAL_FIGURES
from bisar_budget.faults import KeyPath
from bisar_budget.mission.model import Mission
from bisar_budget.mission.navigation import AIDED_IMU_FIGURES, NEEDED_IMU_FIGURES, AidedGnss, AidedImu, Navigation
from bisar_budget.mission.platforms import MotionError, Platform
from bisar_budget.phrases import Note

_ASSUMED_RATE_HZ = 1.0  # of the fixes of a receiver, for comparison
_CONTRADICTION_RATIO = 3.0  # of the way of a velocity error within half an aperture to the position error
_CONVERGED_FRACTION = 0.3  # of an error at the start; with more at mid-aperture, a navigation rests on its start


def navigation_warnings(case: Case) -> Iterator[tuple[KeyPath, Note]]:
    """Yield the warnings about the navigations of both platforms, with the keys to which they refer."""
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
        yield from _contradiction(mission, name, error)


def _of_aided(mission: Mission, navigation: Navigation, error: RandomError) -> Iterator[Note]:
    """Yield a warning if an aided navigation has no fix, or rests on the assumed errors at its start."""
    half, errors = mission.collection.aperture_time / 2, error.navigation
    assert errors is not None
    if not errors.has_fixes:
        start, end = -half - navigation.before, half + float(navigation.after_s)
        yield phrases.note("navigation-has-no-fix", platform=error.owner, start=start, end=end)
        return
    share, quantity = errors.remaining_start
    if share > _CONVERGED_FRACTION:
        yield phrases.note("navigation-has-not-converged", platform=error.owner, share=share, quantity=quantity)


def _of_free_running(mission: Mission, name: str, errors: Sequence[RandomError]) -> Note:
    """Warning about an inertial unit that runs free beside a GNSS receiver, with the phases of both readings."""
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
    """Quadratic phase if the receiver aided the inertial unit [rad]; None if the unit lacks a figure."""
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


def _contradiction(mission: Mission, name: str, error: MotionError) -> Iterator[tuple[KeyPath, Note]]:
    """Yield a warning if the sigmas of position and velocity cannot both hold over the whole aperture.

    A position error that is small at every moment leaves no room for the way of a large velocity error.
    """
    half = mission.collection.aperture_time / 2
    if error.distribution != "normal" or error.position is None or error.velocity is None:
        return
    ways = [
        (abs(velocity) * half / abs(position), position, velocity)
        for position, velocity in zip(error.position, error.velocity, strict=True)
        if position
    ]
    ratio, position, velocity = max(ways, default=(0.0, 0.0, 0.0))
    if ratio > _CONTRADICTION_RATIO:
        yield (
            ("platforms", name, "motion_error", "velocity"),
            phrases.note(
                "position-and-velocity-contradict",
                platform=name,
                position=abs(position),
                velocity=abs(velocity),
                way=abs(velocity) * half,
                half=half,
            ),
        )
