"""Doubts about what is checked: paths that stray from the truth, a model or a collection at its edge.

A path by an orbit or a log says how far the truth may be from it: by the age of its elements, the interpolation of
its ephemeris, the residual of its smoothed log. A position error that is smaller cannot be that of this path. Nor can
a declared error that is smaller than the one that the source of the path states of itself.

A log says more than its smooth path: what the path leaves of the fixes, and the step to which they are written. A
processor that flies the smooth path does without both, and one that flies the fixes has both in its image. Where the
file does not say which one it is (`trajectory.processed`), neither can be judged.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bisar_budget import phrases
from bisar_budget.analysis.analysis import Case
from bisar_budget.constants import ONE_PEAK_DB
from bisar_budget.effects.effect import MOTION_UNITS, PLATFORMS, Subject
from bisar_budget.effects.navigation_errors import residual_subject
from bisar_budget.findings.row import Row
from bisar_budget.geometry import FRAME_AXES, BistaticGeometry, norm, unit
from bisar_budget.mission.covariance import KINDS
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import FlownPath, LogNoise, MotionError, Platform
from bisar_budget.paths.accuracy import StatedAccuracy
from bisar_budget.phrases import NOTHING, Note
from bisar_budget.ranges.exact_ranges import Floats, Truths

LEAST_M = 1e-3  # of a doubt; what is less is no story beside any declared error, zero included
NEGLIGIBLE_USE_FRACTION = 0.1  # of a requirement, by the doubt of a path or by a velocity that its source states
NEGLIGIBLE_RAD = 0.08  # of quadratic phase, in any image
_TYPICAL_SHARE = 1 / 3  # of a usual error; a fix may be as much better than those of its quality usually are
MOST_RESIDUAL_RAD = 0.2  # rms phase along the line of sight that a smooth path may leave of a log, unsaid
MOST_GRID_SHARE = 0.1  # of the declared position error, that a step of a log may have, unsaid
RESIDUAL = "residual"  # kind of doubt of what a smooth path leaves
_EQUAL_VARIANCE_FRACTION = 1e-6  # relative, of variances: equal is enough, and turned axes round


@dataclass(frozen=True)
class InputDoubt:
    """A platform whose path is in doubt by more than the file declares.

    `doubt` is how far the truth may be from the path, or the error that its source states, along the axis where it
    exceeds the declared one most. `declared` is that one, without the coverage factor, 0 where the file declares
    none. Both are root-sum-squares where the doubt has no direction. [m] or [m/s], by the `kind`. `note` says both.
    Where `is_of_log`, it is what a smooth path leaves of a log [rad], beside the most that may go unsaid, or a step
    of the log's fixes.
    """

    owner: str
    doubt: float
    declared: float
    note: Note
    kind: str = "position"
    is_stated: bool = False
    is_of_log: bool = False


def input_doubts(mission: Mission) -> list[InputDoubt]:
    """Platforms whose paths are in doubt by more than the file declares."""
    doubts = []
    for name in PLATFORMS:
        platform: Platform = getattr(mission.platforms, name)
        path, declared = platform.path, declared_position_error(platform.motion_error)
        if path is None:
            continue
        if np.any(strays(mission, name)):
            key = f"platforms.{name}.motion_error.position"
            note = phrases.input_in_doubt(path.doubt_m, path.doubt_of, declared, key)
            doubts.append(InputDoubt(name, path.doubt_m, declared or 0.0, note))
        for kind in KINDS:
            doubts += [
                _stated_doubt(platform, name, kind, stated)
                for stated in path.stated
                if np.any(states_more(mission, name, kind, stated))
            ]
        if np.any(is_coarse(mission, name)):
            doubts.append(_coarse_grid(platform, name))
        if np.any(leaves_unsaid(mission, name)):
            phase, key = float(residual_phase(mission, name)), f"platforms.{name}.trajectory.processed"
            note = phrases.log_leaves_too_much(phase, MOST_RESIDUAL_RAD, key)
            doubts.append(InputDoubt(name, phase, MOST_RESIDUAL_RAD, note, RESIDUAL, is_of_log=True))
    return doubts


def doubted_platforms(mission: Mission, cases: int) -> dict[tuple[str, str], Truths]:
    """Cases in which a platform's path is in doubt by more than the file declares, by owner and kind of error."""
    doubted = {}
    for name in PLATFORMS:
        path: FlownPath | None = getattr(mission.platforms, name).path
        if path is not None:
            for kind in KINDS:
                doubts = [strays(mission, name), is_coarse(mission, name)] if kind == "position" else []
                doubts += [states_more(mission, name, kind, stated) for stated in path.stated]
                doubted[name, kind] = np.any([np.broadcast_to(doubt, (cases,)) for doubt in (False, *doubts)], axis=0)
            doubted[name, RESIDUAL] = np.array(np.broadcast_to(leaves_unsaid(mission, name), (cases,)))
    return doubted


# ---------------------------------------------------------------------- how far the truth may be from a path
def strays(mission: Mission, name: str) -> Any:
    """Whether the truth may be farther from a platform's path than the file declares, in each case.

    Age, interpolation and residual count against an error that is not declared where they are unusual, or where so
    much would be more than a negligible part of a requirement.
    """
    platform: Platform = getattr(mission.platforms, name)
    path, declared = platform.path, declared_position_error(platform.motion_error)
    if path is None:
        return False
    if declared is not None:
        return np.asarray(path.doubt_m) > np.maximum(declared, LEAST_M)
    is_large = np.asarray(path.doubt_m) > LEAST_M
    if not is_large.any() or path.is_doubted:
        return is_large
    in_any_direction = np.multiply.outer(np.asarray(path.doubt_m, dtype=float) ** 2, np.eye(3))
    return is_large & _matters(mission, name, "position", in_any_direction)


def declared_position_error(error: MotionError) -> Any:
    """Root-sum-square of the position errors of a platform, or None: constant ones, and random ones of GNSS. [m]

    Numbers of the mission may be arrays (cases,), and so may be the result.
    """
    stated = error.stated("position")
    sizes = [*(stated or ()), *(sigma for process in error.random for sigma in process.sigma)]
    return sum(size**2 for size in sizes) ** 0.5 if sizes else None


def is_in_doubt(row_subject: Subject, owner: str, mission: Mission, kind: str = "position") -> bool:
    """Whether a row is of a kind of error of a platform, along the axes that the file states it in.

    What a smooth path leaves of a log spreads: its own row, and those of the powers that spread.
    """
    if kind == RESIDUAL:
        return row_subject == residual_subject(owner) or (
            row_subject.kind == "islr" and row_subject.owner in (owner, "mission")
        )
    error: MotionError = getattr(mission.platforms, owner).motion_error
    frame = "scene" if error.stated(kind) is None else error.frame
    return row_subject.owner == owner and row_subject.kind == kind and row_subject.frame == frame


# ---------------------------------------------------------------------- what the source of a path states
def states_more(mission: Mission, name: str, kind: str, stated: StatedAccuracy) -> Any:
    """Whether the source of a path states a larger error than the file declares, in each case.

    An error is larger if it has more variance in any direction. A source that states no direction is held to the
    root-sum-square. A velocity counts where so much would be more than a negligible part of a requirement: an
    ephemeris may know its places well and its velocities badly, and it is the places that are flown. So does a usual
    position error where the file declares none.
    """
    platform: Platform = getattr(mission.platforms, name)
    stated_covariance = _stated_covariance(stated, kind)
    declared = _declared_covariance(platform, kind)
    if stated.covariance is None:
        is_more = kind == "position" and stated.total**2 > np.trace(declared, axis1=-2, axis2=-1) * (
            1 + _EQUAL_VARIANCE_FRACTION
        )
        return np.asarray(is_more) & (stated.total > LEAST_M)
    if stated_covariance is None:
        return False
    share = _TYPICAL_SHARE**2 if stated.is_typical else 1.0
    seen = LEAST_M**2 if kind == "position" else 0.0
    excess = declared * (1 + _EQUAL_VARIANCE_FRACTION) + seen * np.eye(3) - share * stated_covariance
    scale = np.trace(stated_covariance, axis1=-2, axis2=-1)
    is_more = np.linalg.eigvalsh(excess)[..., 0] < -1e-9 * scale
    is_open = stated.is_typical and platform.motion_error.stated(kind) is None and not platform.motion_error.random
    if is_more.any() and (kind == "velocity" or is_open):
        is_more = is_more & _matters(mission, name, kind, stated_covariance)
    return is_more


def _stated_covariance(stated: StatedAccuracy, kind: str) -> Floats | None:
    """Covariance (..., 3, 3) of a kind of error along the scene's axes; None where the source states none."""
    if stated.covariance is None:
        return None
    first = 3 * KINDS.index(kind)
    if len(stated.covariance) <= first:
        return None
    rows = [row[first : first + 3] for row in stated.covariance[first : first + 3]]
    return _stack(rows)


def _declared_covariance(platform: Platform, kind: str) -> Floats:
    """Covariance (..., 3, 3) of the errors of a kind that the file declares, along the scene's axes."""
    error = platform.motion_error
    sizes = error.stated(kind) or (0.0, 0.0, 0.0)
    correlation = np.eye(3).tolist() if error.covariance is None else error.covariance.block(kind)
    along = [[sizes[i] * sizes[j] * correlation[i][j] for j in range(3)] for i in range(3)]
    if kind == "position":
        for process in error.random:
            for axis in range(3):
                along[axis][axis] = along[axis][axis] + process.sigma[axis] ** 2
    axes = _stack(platform.state.frame(error.frame))
    return np.asarray(np.swapaxes(axes, -1, -2) @ _stack(along) @ axes)


def _stack(rows: Sequence[Sequence[Any]]) -> Floats:
    """A matrix (..., 3, 3) from its elements, numbers or arrays (cases,)."""
    elements = np.broadcast_arrays(*(np.asarray(element, dtype=float) for row in rows for element in row))
    return np.moveaxis(np.array(elements).reshape(3, 3, *elements[0].shape), (0, 1), (-2, -1))


def _stated_doubt(platform: Platform, name: str, kind: str, stated: StatedAccuracy) -> InputDoubt:
    """The errors that a source states and that the file declares, along the axis where they differ most."""
    error = platform.motion_error
    key = f"platforms.{name}.motion_error.{kind if error.covariance is None else 'covariance'}"
    stated_covariance, declared = _stated_covariance(stated, kind), _declared_covariance(platform, kind)
    unit_name = MOTION_UNITS[kind]
    is_declared = error.stated(kind) is not None or (kind == "position" and bool(error.random))
    if stated_covariance is None:
        total = float(np.trace(declared)) ** 0.5
        both = phrases.StatedError(stated.words, kind, (stated.total,), (total,), unit_name, key, is_declared)
        note = phrases.input_states_more(both)
        return InputDoubt(name, stated.total, total, note, kind, is_stated=True)
    axes = _stack(platform.state.frame(error.frame))
    names: Sequence[str] = FRAME_AXES[error.frame]
    sizes = [np.sqrt(np.diag(axes @ covariance @ axes.T)).tolist() for covariance in (stated_covariance, declared)]
    share = _TYPICAL_SHARE if stated.is_typical else 1.0
    if all(
        share * size <= declared_size * (1 + _EQUAL_VARIANCE_FRACTION) + LEAST_M
        for size, declared_size in zip(*sizes, strict=True)
    ):
        # Along each axis enough is declared, but not between them.
        values, directions = np.linalg.eigh(declared - share**2 * stated_covariance)
        worst = directions[:, int(values.argmin())]
        sizes, names = (
            [[float(worst @ covariance @ worst) ** 0.5] for covariance in (stated_covariance, declared)],
            ("between the axes",),
        )
    worst_axis = max(range(len(sizes[0])), key=lambda axis: share * sizes[0][axis] - sizes[1][axis])
    phrase = phrases.input_usually_has_more if stated.is_typical else phrases.input_states_more
    note = phrase(phrases.StatedError(stated.words, kind, sizes[0], sizes[1], unit_name, key, is_declared, names))
    return InputDoubt(name, sizes[0][worst_axis], sizes[1][worst_axis], note, kind, is_stated=True)


# ---------------------------------------------------------------------- what a smooth path leaves of a log
def leaves_unsaid(mission: Mission, name: str) -> Any:
    """Whether a smooth path leaves more of a log than may go unsaid, and the file does not say which one is flown."""
    log = _unsaid_log(mission, name)
    return False if log is None else np.asarray(residual_phase(mission, name)) > MOST_RESIDUAL_RAD


def residual_phase(mission: Mission, name: str) -> Any:
    """Phase of what a smooth path leaves of a log's fixes along the line of sight, rms over the aperture. [rad]"""
    path: FlownPath | None = getattr(mission.platforms, name).path
    if path is None or path.log_noise is None:
        return 0.0
    residual, half = _stack(path.log_noise.residual), np.asarray(mission.collection.aperture_time) / 2
    square = 0.0
    for weight, time in ((1 / 6, -half), (2 / 3, 0.0 * half), (1 / 6, half)):  # Simpson, over the aperture
        sight = np.stack(np.broadcast_arrays(*_sight(mission, name, time)), axis=-1)
        square = square + weight * np.einsum("...i,...ij,...j->...", sight, residual, sight)
    return 2 * np.pi / np.asarray(mission.radar.wavelength) * np.sqrt(np.maximum(square, 0.0))


def is_coarse(mission: Mission, name: str) -> Any:
    """Whether a step of a log's fixes exceeds a tenth of the declared position error, and nobody says which is flown.

    Along any direction. Where the file declares no position error, it counts where rounding to it would use more than
    a negligible part of a requirement: its variance is that of a uniform error, a twelfth of the square of the step.
    """
    log = _unsaid_log(mission, name)
    if log is None:
        return False
    platform: Platform = getattr(mission.platforms, name)
    grid = _stack(log.grid)
    squares = np.swapaxes(grid, -1, -2) @ grid
    declared = _declared_covariance(platform, "position")
    excess = MOST_GRID_SHARE**2 * declared * (1 + _EQUAL_VARIANCE_FRACTION) + LEAST_M**2 * np.eye(3) - squares
    coarse = np.linalg.eigvalsh(excess)[..., 0] < 0
    if coarse.any() and platform.motion_error.stated("position") is None and not platform.motion_error.random:
        coarse = coarse & _matters(mission, name, "position", squares / 12)
    return coarse


def _unsaid_log(mission: Mission, name: str) -> LogNoise | None:
    """Noise of a platform's log where the file does not say which path of it is flown; None elsewhere."""
    path: FlownPath | None = getattr(mission.platforms, name).path
    log = None if path is None else path.log_noise
    return log if log is not None and log.processed is None else None


def _coarse_grid(platform: Platform, name: str) -> InputDoubt:
    """The step of a log's fixes that exceeds the declared position error most, along the axes of that error."""
    assert platform.path is not None
    assert platform.path.log_noise is not None
    error = platform.motion_error
    axes = np.array(platform.state.frame(error.frame), dtype=float)
    grid, declared = np.array(platform.path.log_noise.grid), _declared_covariance(platform, "position")
    steps = np.sqrt(np.sum((grid @ axes.T) ** 2, axis=0))
    sigmas = np.sqrt(np.diag(axes @ declared @ axes.T))
    worst_axis = int(np.argmax(steps - MOST_GRID_SHARE * sigmas))
    is_declared = error.stated("position") is not None or bool(error.random)
    key, axis = f"platforms.{name}.trajectory.processed", FRAME_AXES[error.frame][worst_axis]
    step, sigma = float(steps[worst_axis]), float(sigmas[worst_axis])
    note = phrases.log_is_coarse(step, sigma if is_declared else None, axis, key)
    return InputDoubt(name, step, sigma, note, is_of_log=True)


# ---------------------------------------------------------------------- what so much would do
def _matters(mission: Mission, name: str, kind: str, covariance: Floats) -> Any:
    """Whether an error of a platform, by its covariance, uses more than a negligible part of a requirement."""
    needs, half = mission.requirements, np.asarray(mission.collection.aperture_time) / 2
    with np.errstate(all="ignore"):
        ways = [_sight(mission, name, time) for time in (-half, 0.0 * half, half)]
        before, middle, after = (np.stack(np.broadcast_arrays(*way), axis=-1) for way in ways)
        at_ends = np.asarray(half)[..., None]
        if kind == "position":
            constant, linear, edge = middle, (after - before) / (2 * at_ends), (after + before) / 2 - middle
        else:
            constant, linear, edge = 0 * middle, (after + before) / 2, (after - before) * at_ends / 2
        at_edge = np.sqrt(np.einsum("...i,...ij,...j->...", edge, covariance, edge))
        phase = 2 * np.pi / np.asarray(mission.radar.wavelength) * at_edge
        matters = np.logical_not(
            phase < np.minimum(NEGLIGIBLE_USE_FRACTION * needs.quadratic_phase_error, NEGLIGIBLE_RAD)
        )
        if needs.location_error is not None:
            moved = _moved(mission.geometry, constant, linear)
            spread = np.sqrt(np.einsum("...ai,...ij,...aj->...", moved, covariance, moved))
            matters = matters | np.logical_not(spread < NEGLIGIBLE_USE_FRACTION * np.asarray(needs.location_error))
    return matters


def _sight(mission: Mission, name: str, time: Any) -> Any:
    """Range that a metre of a platform's motion adds at a slow time, along each axis; less that of a direct path."""
    platforms = mission.platforms
    sight = unit(getattr(platforms, name).state.place(time))
    if not mission.has_direct_path:
        return sight
    sign = 1.0 if name == "transmitter" else -1.0
    baseline = unit(platforms.geometry.apart.place(time))
    return [towards - sign * along for towards, along in zip(sight, baseline, strict=True)]


def _moved(geometry: BistaticGeometry, constant: Floats, linear: Floats) -> Floats:
    """Displacement on the ground (..., 2, 3) per metre of an error, by range and its rate per metre, as in (25)."""
    (a, b), (c, d) = geometry.range_gradient, geometry.doppler_gradient
    determinant = np.asarray(a * d - b * c)[..., None]
    east = (np.asarray(d)[..., None] * constant - np.asarray(b)[..., None] * linear) / determinant
    north = (np.asarray(a)[..., None] * linear - np.asarray(c)[..., None] * constant) / determinant
    return np.stack((east, north), axis=-2)


# ---------------------------------------------------------------------- the published model
MAX_MODEL_DIFFERENCE_FRACTION = (
    0.05  # of the full model's allowable; farther from it, the published one does not hold
)


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
    return abs(published - full) > MAX_MODEL_DIFFERENCE_FRACTION * full


def _difference(row: Row) -> float:
    """How differently the two allowables say how much of them is used."""
    declared, limits = row.declared or 0.0, (row.allowable_published, row.allowable_full)
    published, full = (0.0 if limit is None else declared / limit for limit in limits)
    return abs(published - full)


# ---------------------------------------------------------------------- the collection
_TURNING_RAD = 0.1  # half the turn of a line of sight; the quartic term is 1 % of the quadratic there


def missing_settings(mission: Mission) -> list[str]:
    """List the errors that setting left of clocks in holdover, and that the file does not state."""
    sync = mission.synchronization
    if sync is None or not sync.is_holdover:
        return []
    return [key for key in ("time_error", "frequency_error") if getattr(sync, key) is None]


def collection_notes(case: Case) -> Iterator[Note]:
    """Say where the published model leaves the collection, and where an image shows less than the full one."""
    mission = case.mission
    for name, state in zip(PLATFORMS, case.geometry.both, strict=True):
        if not state.is_straight:
            yield phrases.path_curves(name)
        turn = norm(state.look_rate) * mission.collection.aperture_time / 2
        if turn > _TURNING_RAD:
            yield phrases.sight_turns(name, turn)
    if case.peak_loss_db is not None and case.peak_loss_db > ONE_PEAK_DB:
        yield phrases.image_has_no_one_peak(case.peak_loss_db)
    if mission.has_direct_path:
        yield phrases.direct_path_is_the_clock()
    if mission.requirements.location_error is None and (missing := missing_settings(mission)):
        yield phrases.setting_is_perfect(missing)  # a location rests on it, and a warning says so
