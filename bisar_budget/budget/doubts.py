"""Doubts about what is checked: paths that stray from the truth, a model or a collection at its edge.

A path by an orbit or a log says how far the truth may be from it: by the age of its elements, the interpolation of
its ephemeris, the residual of its smoothed log. A position error that is smaller cannot be that of this path.
"""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from bisar_budget import phrases
from bisar_budget.analysis.analysis import Case
from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.effects.effect import PLATFORMS, Subject
from bisar_budget.findings.row import Row
from bisar_budget.geometry import norm
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import FlownPath, MotionError, Platform
from bisar_budget.phrases import NOTHING, Note

LEAST_M = 1e-3  # of a doubt; what is less is no story beside any declared error, zero included


class InputDoubt(NamedTuple):
    """A platform whose path is in doubt by more than the file declares.

    `doubt` is how far the truth may be from the path [m], `declared` the root-sum-square of the position errors that
    the file declares, without the coverage factor, 0 where it declares none [m]. `note` says both.
    """

    owner: str
    doubt: float
    declared: float
    note: Note


def input_doubts(mission: Mission) -> list[InputDoubt]:
    """Platforms whose paths are in doubt by more than the file declares."""
    found = []
    for name in PLATFORMS:
        platform: Platform = getattr(mission.platforms, name)
        path, declared = platform.path, declared_position_error(platform.motion_error)
        if path is not None and path.doubt_m > least_doubt(path, declared):
            key = f"platforms.{name}.motion_error.position"
            note = phrases.input_in_doubt(path.doubt_m, path.doubt_of, declared, key)
            found.append(InputDoubt(name, path.doubt_m, declared or 0.0, note))
    return found


def declared_position_error(error: MotionError) -> Any:
    """Root-sum-square of the position errors of a platform, or None: constant ones, and random ones of GNSS. [m]

    Numbers of the mission may be arrays (cases,), and so may be the result.
    """
    stated = error.stated("position")
    sizes = [*(stated or ()), *(sigma for one in error.random for sigma in one.sigma)]
    return sum(size**2 for size in sizes) ** 0.5 if sizes else None


def least_doubt(path: FlownPath, declared: Any) -> Any:
    """Doubt of a path that a declared position error allows, or None; shaped as that error. [m]"""
    if declared is None:
        return LEAST_M if path.is_doubted else path.doubt_m
    return declared + (LEAST_M - declared) * (declared < LEAST_M)


def is_in_doubt(what: Subject, owner: str, mission: Mission) -> bool:
    """Whether a row is of a position error of a platform, along the axes that the file states it in."""
    error: MotionError = getattr(mission.platforms, owner).motion_error
    frame = "scene" if error.stated("position") is None else error.frame
    return what.owner == owner and what.kind == "position" and what.frame == frame


# ---------------------------------------------------------------------- the published model
APART = 0.05  # of the full model's allowable; farther from it, the published one does not hold


def model_doubt(case: Case, rows: Sequence[Row]) -> Note:
    """Say of which declared error the published model, where it decides, does not hold; nothing if it does.

    Named is the row of which the two allowables say most differently how much of them is used.

    Parameters
    ----------
    case : Case
        That is judged.
    rows : sequence of Row
        As judged: those that the published model judges are looked at, of errors as stated and not zero.
    """
    stated = {source.id for source in case.analysis.errors.stated if case.number(source.declared)}
    apart = [row for row in rows if row.model == "published" and row.id in stated and _is_apart(row)]
    if not apart:
        return NOTHING
    worst = max(apart, key=_difference)
    return phrases.published_model_does_not_hold(
        worst.id, worst.allowable_published, worst.allowable_full, worst.unit, len(apart) - 1
    )


def _is_apart(row: Row) -> bool:
    published, full = row.allowable_published, row.allowable_full
    if published is None or full is None:
        return published is not full
    return abs(published - full) > APART * full


def _difference(row: Row) -> float:
    """How differently the two allowables say how much of them is used."""
    declared, limits = row.declared or 0.0, (row.allowable_published, row.allowable_full)
    published, full = (0.0 if limit is None else declared / limit for limit in limits)
    return abs(published - full)


# ---------------------------------------------------------------------- the collection
_TURNING_RAD = 0.1  # half the turn of a line of sight; the quartic term is 1 % of the quadratic there
COARSE_CELL_RAD = 1.0  # of phase between points a range cell apart; beyond, a response spreads over cells
_ABSORBED_RAD = 6.1  # of the same, where the image shows half; measured, uniform window, 8 to 300 MHz


def collection_notes(case: Case) -> Iterator[Note]:
    """Say where the published model leaves the collection, and where an image shows less than the full one."""
    mission = case.mission
    for name, state in zip(PLATFORMS, case.geometry.both, strict=True):
        if not state.is_straight:
            yield phrases.path_curves(name)
        turn = norm(state.look_rate) * mission.collection.aperture_time / 2
        if turn > _TURNING_RAD:
            yield phrases.sight_turns(name, turn)
    if mission.has_direct_path:
        yield phrases.direct_path_is_the_clock()
    sync = mission.synchronization
    if sync is not None and sync.is_holdover:
        missing = [key for key in ("time_error", "frequency_error") if getattr(sync, key) is None]
        if missing:
            yield phrases.setting_is_perfect(missing)
    cell = phase_across_a_cell(case)
    if cell > COARSE_CELL_RAD:
        yield phrases.range_cells_are_coarse(cell, 100 / (1 + (cell / _ABSORBED_RAD) ** 2))


def phase_across_a_cell(case: Case) -> float:
    """Quadratic phase between points of the ground a range cell c/B apart. [rad]"""
    (by_constant, _), _ = case.analysis.exact.phases_per_term
    return abs(case.number(by_constant)) * SPEED_OF_LIGHT / case.mission.radar.bandwidth
