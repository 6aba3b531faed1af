"""Doubts about the input of a check: inaccurate paths, and collections for which a model may not be valid.

A path from an orbit or a log may differ from the true path by a known distance. The causes are the age of the orbital
elements, the interpolation of the ephemeris, and the residual of the smoothed log. A declared position error smaller
than this distance cannot be right. A declared error cannot be right either if the source of the path states a larger
error.

A log of position fixes has two further sources of error. The residual is the difference between the fixes and the
smooth path fitted to them. The rounding step is the step to which the fixes are rounded. A processor that uses the
smooth path has neither error. A processor that uses the fixes has both errors in its image. If the file does not
state which path the processor uses (`trajectory.processed`), neither error can be judged.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bisar_budget import phrases
from bisar_budget.analysis.analysis import Case
from bisar_budget.arrays import Booleans, Floats, PerCase, PerCaseFlag
from bisar_budget.constants import ONE_PEAK_DB
from bisar_budget.effects.effect import PLATFORMS, Subject, subject
from bisar_budget.effects.navigation_errors import residual_subject
from bisar_budget.error_kinds.path_kinds import MEASURED_KINDS, POSITION_KIND, StateKind
from bisar_budget.findings.row import Row
from bisar_budget.geometry import FRAME_AXES, BistaticGeometry, PlatformState, norm, unit
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import FlownPath, LogNoise, MotionError, Platform
from bisar_budget.paths.accuracy import StatedAccuracy
from bisar_budget.phrases import NOTHING, Note

LEAST_M = 1e-3  # smallest inaccuracy of a path that is compared with a declared error, even an error of zero
NEGLIGIBLE_USE_FRACTION = 0.1  # part of a requirement that an inaccuracy may use without being noted
NEGLIGIBLE_RAD = 0.08  # quadratic phase that is negligible in any image
_TYPICAL_SHARE = 1 / 3  # a fix may be this factor better than the typical error of its quality class
MOST_RESIDUAL_RAD = 0.2  # largest rms phase of the residual along the line of sight that needs no statement
MOST_GRID_SHARE = 0.1  # largest step of a log, relative to the declared position error, that needs no statement
_EQUAL_VARIANCE_FRACTION = 1e-6  # relative tolerance for rounding, when axes are rotated


@dataclass(frozen=True)
class InputDoubt:
    """A possible error of a platform's path that is larger than the error that the file declares.

    `doubt` is the possible error: the distance by which the true path may differ from the given path, or the error
    that the source of the path states. `declared` is the declared error without the coverage factor; it is 0 if the
    file declares no error. Both are given along the axis on which `doubt` exceeds `declared` most. If the possible
    error has no direction, both are root-sum-squares over the axes. Their unit follows from `state`, the kind of the
    error. `note` gives both values in words.

    If `is_of_log` is set, the doubt concerns the residual or the rounding of a log of position fixes. For a residual,
    which is the difference between the fixes and the smooth path, `doubt` is the phase that it causes, and `declared`
    is the largest acceptable phase [rad]. For rounding, `doubt` is the step to which the fixes are rounded [m].
    """

    owner: str
    doubt: float
    declared: float
    note: Note
    state: StateKind | None = POSITION_KIND
    is_stated: bool = False
    is_of_log: bool = False

    @property
    def is_phase(self) -> bool:
        """Whether the doubt is about the phase that the residual of a log causes, and not about an error of the path.

        The residual is the difference between the position fixes of the log and the smooth path fitted to them.
        """
        return self.state is None

    @property
    def kind(self) -> str:
        """Name of the kind of error, such as `position`; it is `residual` for the residual of a log."""
        return "residual" if self.state is None else self.state.name

    @property
    def unit(self) -> str:
        """Unit of `doubt` and of `declared`, for example `m` for a position error or `rad` for a log's residual."""
        return "rad" if self.state is None else self.state.unit


def input_doubts(mission: Mission) -> list[InputDoubt]:
    """List the doubts about the paths of the platforms, which may be less accurate than the file declares."""
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
        for state in MEASURED_KINDS:
            doubts += [
                _stated_doubt(platform, name, state, stated)
                for stated in path.stated
                if np.any(states_more(mission, name, state, stated))
            ]
        if np.any(is_coarse(mission, name)):
            doubts.append(_coarse_grid(platform, name))
        if np.any(leaves_unsaid(mission, name)):
            phase, key = float(residual_phase(mission, name)), f"platforms.{name}.trajectory.processed"
            note = phrases.note("log-leaves-too-much", phase=phase, most=MOST_RESIDUAL_RAD, key=key)
            doubts.append(InputDoubt(name, phase, MOST_RESIDUAL_RAD, note, None, is_of_log=True))
    return doubts


def doubted_platforms(mission: Mission, cases: int) -> dict[tuple[str, StateKind | None], Booleans]:
    """Find the cases in which the path of a platform may be less accurate than the file declares.

    The result maps the name of the platform and the kind of error to a mask, (cases,). The kind is None for the
    residual of a log, which is the difference between its position fixes and the smooth path.
    """
    doubted: dict[tuple[str, StateKind | None], Booleans] = {}
    for name in PLATFORMS:
        path: FlownPath | None = getattr(mission.platforms, name).path
        if path is not None:
            for state in MEASURED_KINDS:
                doubts = [] if state.order else [strays(mission, name), is_coarse(mission, name)]
                doubts += [states_more(mission, name, state, stated) for stated in path.stated]
                doubted[name, state] = np.any(
                    [np.broadcast_to(doubt, (cases,)) for doubt in (False, *doubts)], axis=0
                )
            doubted[name, None] = np.array(np.broadcast_to(leaves_unsaid(mission, name), (cases,)))
    return doubted


# ---------------------------------------------------------------------- how far the truth may be from a path
def strays(mission: Mission, name: str) -> PerCaseFlag:
    """Whether a platform's true path may differ from its given path by more than the declared position error.

    The result is a Boolean or an array (cases,). If no position error is declared, one of two further conditions must
    hold. Either the age of the orbital elements, the interpolation of the ephemeris or the residual of the log is
    unusual, or the possible difference would use more than a negligible part of a requirement.
    """
    platform: Platform = getattr(mission.platforms, name)
    path, declared = platform.path, declared_position_error(platform.motion_error)
    if path is None:
        return False
    if declared is not None:
        return np.asarray(np.asarray(path.doubt_m) > np.maximum(declared, LEAST_M))
    is_large = np.asarray(path.doubt_m) > LEAST_M
    if not is_large.any() or path.is_doubted:
        return is_large
    in_any_direction = np.multiply.outer(np.asarray(path.doubt_m, dtype=float) ** 2, np.eye(3))
    return is_large & _matters(mission, name, POSITION_KIND, in_any_direction)


def declared_position_error(error: MotionError) -> Any:
    """Root-sum-square of a platform's constant and random position errors; None if no such error is declared. [m]

    The result is an array (cases,) if the mission has arrays in place of numbers.
    """
    stated = error.stated("position")
    sizes = [*(stated or ()), *(sigma for process in error.random for sigma in process.sigma)]
    return sum(size**2 for size in sizes) ** 0.5 if sizes else None


def is_in_doubt(row_subject: Subject, owner: str, mission: Mission, state: StateKind | None = POSITION_KIND) -> bool:
    """Whether a row depends on a doubtful path error of the platform `owner`.

    `state` is the kind of the path error. The row must refer to the frame in which the file states the error. If
    `state` is None, the error is the residual of a log, which spreads power over the image. The rows that depend on
    it are its own row, and the rows that sum spread power for the platform and for the mission.
    """
    if state is None:
        return row_subject in (residual_subject(owner), subject(owner, "islr"), subject("mission", "islr"))
    error: MotionError = getattr(mission.platforms, owner).motion_error
    frame = "scene" if error.stated(state.name) is None else error.frame
    return row_subject.owner == owner and row_subject.facts is state and row_subject.frame == frame


# ---------------------------------------------------------------------- errors that the source of a path states
def states_more(mission: Mission, name: str, state: StateKind, stated: StatedAccuracy) -> PerCaseFlag:
    """Whether the source of a path states a larger error than the file declares, as a Boolean or an array (cases,).

    An error is larger if its variance is larger in any direction. If the source gives no directions, the
    root-sum-squares are compared. A larger velocity error counts only if it would use more than a negligible part of
    a requirement. The reason is that an ephemeris may have good positions and bad velocities, and the path follows
    the positions. If the file declares no position error, the same condition applies to a position error that is
    merely typical of this kind of source.
    """
    platform: Platform = getattr(mission.platforms, name)
    stated_covariance = _stated_covariance(stated, state, platform)
    declared = _declared_covariance(platform, state)
    if stated.covariance is None:
        is_more = not state.order and stated.total**2 > np.trace(declared, axis1=-2, axis2=-1) * (
            1 + _EQUAL_VARIANCE_FRACTION
        )
        return np.asarray(is_more) & (stated.total > LEAST_M)
    if stated_covariance is None:
        return False
    share = _TYPICAL_SHARE**2 if stated.is_typical else 1.0
    seen = 0.0 if state.order else LEAST_M**2
    excess = declared * (1 + _EQUAL_VARIANCE_FRACTION) + seen * np.eye(3) - share * stated_covariance
    scale = np.trace(stated_covariance, axis1=-2, axis2=-1)
    is_more = np.linalg.eigvalsh(excess)[..., 0] < -1e-9 * scale
    is_open = (
        stated.is_typical and platform.motion_error.stated(state.name) is None and not platform.motion_error.random
    )
    if is_more.any() and (state.order or is_open):
        is_more = is_more & _matters(mission, name, state, stated_covariance)
    return np.asarray(is_more)


def _stated_covariance(stated: StatedAccuracy, state: StateKind, platform: Platform) -> Floats | None:
    """Covariance (..., 3, 3) of the stated errors along the scene's axes; None if the source does not state it.

    `state` is the kind of the errors, position [m²] or velocity [m²/s²]. If a platform is in free fall and the file
    states its errors in the orbital frame `ric`, the velocity is an inertial velocity.
    """
    covariance, row, fall = stated.covariance, 3 * state.order, platform.state.fall
    if covariance is None or len(covariance) <= row:
        return None

    def block(first: int, second: int) -> Floats:
        return _stack([line[second : second + 3] for line in covariance[first : first + 3]])

    if not state.order or fall is None or platform.motion_error.frame != "ric":
        return block(row, row)
    x, y, z = fall.rotation
    turning = _stack(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))
    mixed = turning @ block(0, 3)
    turned = turning @ block(0, 0) @ np.swapaxes(turning, -1, -2)
    return np.asarray(block(3, 3) + mixed + np.swapaxes(mixed, -1, -2) + turned)


def _declared_covariance(platform: Platform, state: StateKind) -> Floats:
    """Covariance (..., 3, 3) of the declared errors of one kind, along the scene's axes.

    `state` is the kind of the errors: position errors [m²] or velocity errors [m²/s²].
    """
    error = platform.motion_error
    sizes = error.stated(state.name) or (0.0, 0.0, 0.0)
    correlation = np.eye(3).tolist() if error.covariance is None else error.covariance.block(state.name)
    along = [[sizes[i] * sizes[j] * correlation[i][j] for j in range(3)] for i in range(3)]
    if not state.order:
        for process in error.random:
            for axis in range(3):
                along[axis][axis] = along[axis][axis] + process.sigma[axis] ** 2
    axes = _stack(platform.state.frame(error.frame))
    return np.asarray(np.swapaxes(axes, -1, -2) @ _stack(along) @ axes)


def _stack(rows: Sequence[Sequence[PerCase]]) -> Floats:
    """Stack the nine elements of 3-by-3 matrices, which are numbers or arrays (cases,), into an array (..., 3, 3).

    `rows` holds three rows of three elements.
    """
    elements = np.broadcast_arrays(*(np.asarray(element, dtype=float) for row in rows for element in row))
    return np.moveaxis(np.array(elements).reshape(3, 3, *elements[0].shape), (0, 1), (-2, -1))


def _stated_doubt(platform: Platform, name: str, state: StateKind, stated: StatedAccuracy) -> InputDoubt:
    """Describe the doubt that arises because the source of a path states a larger error than the file declares.

    Both errors are given along the axis on which they differ most.
    """
    error = platform.motion_error
    key = f"platforms.{name}.motion_error.{state.name if error.covariance is None else 'covariance'}"
    stated_covariance, declared = _stated_covariance(stated, state, platform), _declared_covariance(platform, state)
    is_declared = error.stated(state.name) is not None or (not state.order and bool(error.random))
    if stated_covariance is None:
        total = float(np.trace(declared)) ** 0.5
        both = phrases.StatedError(stated.words, state.name, (stated.total,), (total,), state.unit, key, is_declared)
        note = phrases.input_states_more(both)
        return InputDoubt(name, stated.total, total, note, state, is_stated=True)
    axes = _stack(platform.state.frame(error.frame))
    names: Sequence[str] = FRAME_AXES[error.frame]
    sizes = [np.sqrt(np.diag(axes @ covariance @ axes.T)).tolist() for covariance in (stated_covariance, declared)]
    share = _TYPICAL_SHARE if stated.is_typical else 1.0
    if all(
        share * size <= declared_size * (1 + _EQUAL_VARIANCE_FRACTION) + LEAST_M
        for size, declared_size in zip(*sizes, strict=True)
    ):
        # The declared error is large enough along each axis, but not in a direction between the axes.
        values, directions = np.linalg.eigh(declared - share**2 * stated_covariance)
        worst = directions[:, int(values.argmin())]
        sizes, names = (
            [[float(worst @ covariance @ worst) ** 0.5] for covariance in (stated_covariance, declared)],
            ("between the axes",),
        )
    worst_axis = max(range(len(sizes[0])), key=lambda axis: share * sizes[0][axis] - sizes[1][axis])
    phrase = phrases.input_usually_has_more if stated.is_typical else phrases.input_states_more
    note = phrase(
        phrases.StatedError(stated.words, state.name, sizes[0], sizes[1], state.unit, key, is_declared, names)
    )
    return InputDoubt(name, sizes[0][worst_axis], sizes[1][worst_axis], note, state, is_stated=True)


# ---------------------------------------------------------------------- the residual of a log
def leaves_unsaid(mission: Mission, name: str) -> PerCaseFlag:
    """Whether a log's residual causes too large a phase, and the file does not state which path the processor uses.

    The residual is the difference between the position fixes of the log and the smooth path fitted to them.
    """
    log = _unsaid_log(mission, name)
    return False if log is None else np.asarray(residual_phase(mission, name)) > MOST_RESIDUAL_RAD


def residual_phase(mission: Mission, name: str) -> PerCase:
    """Rms phase over the aperture that a log's residual causes along the line of sight; 0 without a log. [rad]

    The residual is the difference between the position fixes of the log and the smooth path fitted to them.
    """
    path: FlownPath | None = getattr(mission.platforms, name).path
    if path is None or path.log_noise is None:
        return 0.0
    residual, half = _stack(path.log_noise.residual), np.asarray(mission.collection.aperture_time) / 2
    square: PerCase = 0.0
    for weight, time in ((1 / 6, -half), (2 / 3, 0.0 * half), (1 / 6, half)):  # Simpson's rule over the aperture
        sight = np.stack(np.broadcast_arrays(*_sight(mission, name, time)), axis=-1)
        square = square + weight * np.einsum("...i,...ij,...j->...", sight, residual, sight)
    phase: PerCase = 2 * np.pi / np.asarray(mission.radar.wavelength) * np.sqrt(np.maximum(square, 0.0))
    return phase


def is_coarse(mission: Mission, name: str) -> PerCaseFlag:
    """Whether the fixes of a log are rounded too coarsely, and the file does not state which path the processor uses.

    The rounding step is too coarse if it exceeds a tenth of the declared position error along any direction. If the
    file declares no position error, the step must also use more than a negligible part of a requirement. Rounding is
    a uniform error with a variance of one twelfth of the square of the step.
    """
    log = _unsaid_log(mission, name)
    if log is None:
        return False
    platform: Platform = getattr(mission.platforms, name)
    grid = _stack(log.grid)
    squares = np.swapaxes(grid, -1, -2) @ grid
    declared = _declared_covariance(platform, POSITION_KIND)
    excess = MOST_GRID_SHARE**2 * declared * (1 + _EQUAL_VARIANCE_FRACTION) + LEAST_M**2 * np.eye(3) - squares
    coarse = np.linalg.eigvalsh(excess)[..., 0] < 0
    if coarse.any() and platform.motion_error.stated("position") is None and not platform.motion_error.random:
        coarse = coarse & _matters(mission, name, POSITION_KIND, squares / 12)
    return coarse


def _unsaid_log(mission: Mission, name: str) -> LogNoise | None:
    """Return the noise of a platform's log, if the file does not state which path the processor uses.

    The result is None if the file states this path, or if the platform has no log.
    """
    path: FlownPath | None = getattr(mission.platforms, name).path
    log = None if path is None else path.log_noise
    return log if log is not None and log.processed is None else None


def _coarse_grid(platform: Platform, name: str) -> InputDoubt:
    """Describe the doubt that arises from the coarse rounding of a log's position fixes.

    The rounding step and the declared position error are given along the axis on which the step most exceeds the
    permitted fraction of the declared position error.
    """
    assert platform.path is not None
    assert platform.path.log_noise is not None
    error = platform.motion_error
    axes = np.array(platform.state.frame(error.frame), dtype=float)
    grid, declared = np.array(platform.path.log_noise.grid), _declared_covariance(platform, POSITION_KIND)
    steps = np.sqrt(np.sum((grid @ axes.T) ** 2, axis=0))
    sigmas = np.sqrt(np.diag(axes @ declared @ axes.T))
    worst_axis = int(np.argmax(steps - MOST_GRID_SHARE * sigmas))
    is_declared = error.stated("position") is not None or bool(error.random)
    key, axis = f"platforms.{name}.trajectory.processed", FRAME_AXES[error.frame][worst_axis]
    step, sigma = float(steps[worst_axis]), float(sigmas[worst_axis])
    note = phrases.log_is_coarse(step, sigma if is_declared else None, axis, key)
    return InputDoubt(name, step, sigma, note, is_of_log=True)


# ---------------------------------------------------------------------- the effect of a doubt
def _matters(mission: Mission, name: str, state: StateKind, covariance: Floats) -> Booleans:
    """Whether an error with the given covariance would use more than a negligible part of a requirement, (cases,).

    `state` is the kind of the error, position or velocity, and `name` is the platform.
    """
    needs, half = mission.requirements, np.asarray(mission.collection.aperture_time) / 2
    with np.errstate(all="ignore"):
        before, middle, after = _range_errors(mission, name, state, half)
        at_ends = np.asarray(half)[..., None]
        constant, linear, edge = middle, (after - before) / (2 * at_ends), (after + before) / 2 - middle
        at_edge = np.sqrt(np.einsum("...i,...ij,...j->...", edge, covariance, edge))
        phase = 2 * np.pi / np.asarray(mission.radar.wavelength) * at_edge
        matters = np.logical_not(
            phase < np.minimum(NEGLIGIBLE_USE_FRACTION * needs.quadratic_phase_error, NEGLIGIBLE_RAD)
        )
        if needs.location_error is not None:
            moved = _moved(mission.geometry, constant, linear)
            spread = np.sqrt(np.einsum("...ai,...ij,...aj->...", moved, covariance, moved))
            matters = matters | np.logical_not(spread < NEGLIGIBLE_USE_FRACTION * np.asarray(needs.location_error))
    return np.asarray(matters)


def _range_errors(mission: Mission, name: str, state: StateKind, half: Floats) -> Sequence[Floats]:
    """Range errors that a unit error of a platform along each axis causes at the slow times −T/2, 0 and T/2.

    T is the aperture time, and `half` is T/2 [s]. Each of the three arrays has the shape (..., 3). Its unit is [m/m]
    for a position error, and [m per m/s] for a velocity error.
    """
    sights = [
        np.stack(np.broadcast_arrays(*_sight(mission, name, time)), axis=-1) for time in (-half, 0.0 * half, half)
    ]
    platform: Platform = getattr(mission.platforms, name)
    path = platform.state
    if path.fall is None:
        powers = [-half[..., None], 0.0, half[..., None]] if state.order else [1.0, 1.0, 1.0]
        return [sight * power for sight, power in zip(sights, powers, strict=True)]
    halves = np.atleast_1d(np.broadcast_to(half, np.broadcast_shapes(half.shape, sights[0].shape[:-1])))
    motions = path.fall.motions(path, halves, np.array((-1.0, 0.0, 1.0)))
    units = motions[state.order]
    if not state.order and platform.motion_error.frame == "ric":
        rates = [path.fall.rate_against_stars(axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
        turned = [sum(motions[1][i] * rate[i] for i in range(3)) for rate in rates]
        units = units + np.stack(turned)
    at_times = np.stack([np.broadcast_to(sight, (*halves.shape, 3)) for sight in sights])
    ranges = np.einsum("acqn,qnc->qna", units, at_times)
    return [range_error.reshape(*sight.shape) for range_error, sight in zip(ranges, sights, strict=True)]


def _sight(mission: Mission, name: str, time: Any) -> Any:
    """Change of range per metre of a platform's motion along each axis (x, y, z), at a given slow time. [m/m]

    If the receiver uses the direct path as its clock, the change of the direct path's range is subtracted.
    """
    platforms = mission.platforms
    path: PlatformState = getattr(platforms, name).state
    sight = unit(path.place(time))
    if not mission.has_direct_path:
        return sight
    sign = 1.0 if name == "transmitter" else -1.0
    baseline = unit(platforms.geometry.apart.place(time))
    x, y, z = (towards - sign * along for towards, along in zip(sight, baseline, strict=True))
    return (x, y, z)


def _moved(geometry: BistaticGeometry, constant: Floats, linear: Floats) -> Floats:
    """Displacement of the image on the ground per unit error along each axis, by equation (25) of Rigling & Moses.

    `constant` and `linear` are the range error and its rate, both per unit error. The result is (..., 2, 3). Its
    first row is the displacement east, and its second row is the displacement north.
    """
    (a, b), (c, d) = geometry.range_gradient, geometry.doppler_gradient
    determinant = np.asarray(a * d - b * c)[..., None]
    east = (np.asarray(d)[..., None] * constant - np.asarray(b)[..., None] * linear) / determinant
    north = (np.asarray(a)[..., None] * linear - np.asarray(c)[..., None] * constant) / determinant
    return np.stack((east, north), axis=-2)


# ---------------------------------------------------------------------- errors of an orbit
def orbit_notes(case: Case, rows: Sequence[Row]) -> Iterator[Note]:
    """Yield a note for each platform in free fall whose declared errors cannot be independent.

    The errors of an orbit are correlated: a position error δr comes with a velocity error of about n·δr, where n is
    the angular rate of the orbit. If the file declares independent errors, and a velocity error smaller than n·δr,
    the computed phase is larger than the phase that the errors of a real orbit cause. The note is given only if the
    position errors use more than a negligible part of a limit.
    """
    for index, name in enumerate(PLATFORMS):
        state, error = case.geometry.both[index], getattr(case.mission.platforms, name).motion_error
        position, velocity = error.stated("position"), error.stated("velocity") or (0.0, 0.0, 0.0)
        if state.fall is None or error.covariance is not None or position is None:
            continue
        rate = float(norm(state.fall.orbit_rate(state)))
        sizes = math.hypot(*position), math.hypot(*velocity)
        uses = [row.utilization or 0.0 for row in rows if row.owner == name and row.subject.facts is POSITION_KIND]
        if rate * sizes[0] > sizes[1] and max(uses, default=0.0) > NEGLIGIBLE_USE_FRACTION:
            yield phrases.orbit_errors_are_independent(name, sizes[0], rate, sizes[1])


# ---------------------------------------------------------------------- the published model
MAX_MODEL_DIFFERENCE_FRACTION = (
    0.05  # of the allowable by the full model; at a larger difference the published model does not hold
)


def model_doubt(case: Case, rows: Sequence[Row]) -> Note:
    """Write a note on declared errors for which the published model is inaccurate.

    The note names the row for which the utilizations in the two models differ most. It is empty if the published
    model is accurate for all declared errors.

    Parameters
    ----------
    case : Case
        The judged case.
    rows : sequence of Row
        Judged rows. Only rows that are judged by the published model, and whose declared error is not zero, are
        examined.
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
    """Absolute difference between the utilizations of a row in the published model and in the full model."""
    declared, limits = row.declared or 0.0, (row.allowable_published, row.allowable_full)
    published, full = (0.0 if limit is None else declared / limit if limit else math.inf for limit in limits)
    return 0.0 if published == full else abs(published - full)


# ---------------------------------------------------------------------- the collection
_TURNING_RAD = 0.1  # half the rotation of a line of sight at which the quartic term is 1 % of the quadratic term


def missing_settings(mission: Mission) -> list[str]:
    """List the keys, `time_error` or `frequency_error`, that clocks in holdover need but that the file lacks.

    They are keys of `synchronization`. The list is empty if the clocks are not in holdover.
    """
    sync = mission.synchronization
    if sync is None or not sync.is_holdover:
        return []
    return [key for key in ("time_error", "frequency_error") if getattr(sync, key) is None]


def collection_notes(case: Case, peak_loss_db: float | None) -> Iterator[Note]:
    """Yield notes on model assumptions that a collection may violate, and on images with several peaks.

    `peak_loss_db` [dB] is the loss of the image peak due to all declared errors. It is None if the loss is unknown.
    """
    mission = case.mission
    for name, state in zip(PLATFORMS, case.geometry.both, strict=True):
        if not state.is_straight:
            yield phrases.note("path-curves", platform=name)
        turn = float(norm(state.look_rate)) * mission.collection.aperture_time / 2
        if turn > _TURNING_RAD:
            yield phrases.note("sight-turns", platform=name, half_turn=turn)
    if peak_loss_db is not None and peak_loss_db > ONE_PEAK_DB:
        yield phrases.note("image-may-have-several-peaks", loss_db=peak_loss_db)
    if mission.has_direct_path:
        yield phrases.note("direct-path-is-the-clock")
    if mission.requirements.location_error is None and (missing := missing_settings(mission)):
        yield phrases.note(
            "setting-is-perfect", missing=missing
        )  # a required location depends on these errors, and gets a warning instead
