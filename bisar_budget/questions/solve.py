"""Search for every value of one number of a mission at which compliance begins or ends.

The search samples the range. If only one of two neighbouring samples complies, it brackets the border between them.
If the worst utilization has a maximum or minimum between samples, the search finds it first, because compliance may
change twice near it. Each step of the search checks many values at once with the module `table`. Values are in SI and
radians; factors are plain numbers.
"""

import datetime as dt
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import TypeVar

import numpy as np

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.budget.judged_mission import JudgedMission, judged_mission
from bisar_budget.budget.judged_requirements import EQUAL_USE_FRACTION
from bisar_budget.constants import TARGETS
from bisar_budget.faults import MissionError, printable
from bisar_budget.findings.requirement import Outside
from bisar_budget.findings.solution import Comparison, Crossing, Solution, State
from bisar_budget.mission.model import Mission
from bisar_budget.mission.quantities import (
    FACTOR,
    Number,
    QuestionError,
    Range,
    number_of,
    range_of,
    text_of,
    tree_of,
)
from bisar_budget.questions.compare import compare_parts, is_sensor_key
from bisar_budget.questions.outside import influences_of
from bisar_budget.questions.progress import FORMING, foretell, watched, watched_checks
from bisar_budget.questions.results import SolveResult
from bisar_budget.questions.table import (
    DOUBTS,
    GEOMETRY,
    REASON,
    VERDICT,
    WAIVED_BY,
    Question,
    Table,
    Variation,
    hold_to_decisions,
    listed,
)
from bisar_budget.questions.varied import scaled
from bisar_budget.workers import Progress, unseen

_OF_ALL = ", or --scale for all of them"
_GOLDEN = (math.sqrt(5) - 1) / 2


@dataclass(frozen=True)
class SolveSettings:
    """Settings of the search for the borders of compliance.

    Attributes
    ----------
    range_samples, circle_samples : int
        Number of samples of a range, and of a full circle of directions. A circle has a sample every 2 degrees,
        because the geometry changes quickly where the range and Doppler gradients are nearly parallel.
    border_fraction : float
        Largest distance between the values on the two sides of a border before rounding, as a fraction of the value.
    max_turns_count : int
        Limit on the number of maxima and minima of the utilization that are searched.
    turn_steps : int
        Number of steps of a golden-section search; the last interval is 7e-5 of the distance between samples.
    ahead_steps, read_ahead_steps : int
        Number of further steps whose values are checked in advance. `read_ahead_steps` applies if the mission has to
        be read again for each value, which takes longer.
    """

    range_samples: int = 65
    circle_samples: int = 181
    border_fraction: float = 2e-7
    max_turns_count: int = 16
    turn_steps: int = 20
    ahead_steps: int = 5
    read_ahead_steps: int = 2


SOLVE_SETTINGS = SolveSettings()

# A function of the known states by value; it returns its result, or the set of values whose states it needs.
SearchT = TypeVar("SearchT")
Search = Callable[[Mapping[float, "State"]], SearchT | set[float]]


def solve(
    mission: Mission,
    key: str,
    *,
    between: tuple[object, object] | str | None = None,
    scale: bool = False,
    row: str | None = None,
    target: str = "fail",
    verify: bool = False,
    model: str | None = None,
    date: str | dt.date | None = None,
    outside: Outside | None = None,
) -> SolveResult:
    """Find the values of a number at which a mission starts or stops complying with its requirements.

    Parameters
    ----------
    mission : Mission
        As in `check`.
    key : str
        Path of the number, such as `collection.aperture_time`. For keys such as
        `platforms.receiver.motion_error.sensor`, every part of the catalogue is tried.
    between : pair, optional
        Range of the search, such as `("0.2 s", "20 s")`. The default is from a tenth of the value in the file to ten
        times this value, and the full circle for an azimuth.
    scale : bool
        Whether to solve for a factor that multiplies all errors of a section; `key` is then the path of the section.
    row : str, optional
        Id of a row. If given, this row alone has to comply, instead of the whole mission.
    target : str
        With `fail`, a mission complies if nothing fails. With `warn`, it must have no warnings either.
    verify : bool
        Whether to verify the binding row with images at the solution, and add their verdict.
    model, date, outside
        As in `check`.

    Raises
    ------
    QuestionError
        The question cannot be answered for this mission, for example because the key is unknown; the message says
        why.
    """
    today, influences = influences_of(mission, model, date, outside)
    if target not in TARGETS:
        raise QuestionError(f"--target {printable(str(target))}: accepted: {' or '.join(TARGETS)}")
    if between is not None and not isinstance(between, str):
        between = "..".join(text_of("", end) for end in between)
    hold_to_parts(key, between, scale)
    question = Question.of(mission, [key], model, today, row=row, target=target)
    solution: Solution | Comparison
    with watched_checks(mission.name) as progress:
        if is_sensor_key(key):
            solution = compare_parts(mission, question, progress)
        else:
            solution = _Search(mission, question, between, is_scale=scale).solution(progress)
    solution = solution._replace(overrides=influences)
    return SolveResult(_imaged(mission, solution, model) if verify else solution)


def hold_to_parts(key: str, between: object, scale: bool) -> None:
    """Raise an error if a range or a scale factor is given for a key whose values are parts of the catalogue.

    Raises
    ------
    QuestionError
        The key names a part of the catalogue, and `between` or `scale` is given.
    """
    if is_sensor_key(key) and (between is not None or scale):
        option = "--scale" if scale else "--between"
        raise QuestionError(f"{option}: {key} names parts of the catalogue, which are compared one by one.")


def _imaged(mission: Mission, solution: "Solution | Comparison", model: str | None) -> "Solution | Comparison":
    """Form images at the solution to verify the binding row, and return the solution with the resulting verdict.

    If there is no row to image, the solution is returned unchanged.
    """
    from bisar_budget.questions.imaged import imaged, to_image
    from bisar_budget.questions.verify import faster

    case = to_image(mission, solution, model)
    if case is None:
        return solution
    foretell(case.seconds, f"Forming the images of {case.row}", "without --verify none is formed" + faster())
    with watched(FORMING) as progress:
        return solution._replace(imaged=imaged(case, progress))


def _nearest(states: Sequence[State]) -> State:
    """Find the state with the smallest margin if all states comply, otherwise the state with the smallest excess.

    If several states are equally close, the first of them is returned. If some states are waived, only these are
    considered. A state that is not evaluated exceeds no limit, so its excess is taken as the smallest.
    """
    if all(state.complies for state in states):
        uses = [state.utilization or 0.0 for state in states]
        decides = max(uses)
    else:
        states = [state for state in states if state.status == "waived"] or states
        uses = [
            -1.0 if state.status == "not_evaluated" else math.inf if state.utilization is None else state.utilization
            for state in states
        ]
        decides = min(uses)
    return next(state for state, use in zip(states, uses, strict=True) if _is_alike(use, decides))


def _is_alike(first: float | None, second: float | None) -> bool:
    """Whether two utilizations are equal except for rounding."""
    return first == second or (
        first is not None and second is not None and math.isclose(first, second, rel_tol=EQUAL_USE_FRACTION)
    )


class _Search:
    """Search for the crossings of one number of a mission: the borders of compliance in its range."""

    def __init__(self, mission: Mission, question: Question, between: str | None, *, is_scale: bool) -> None:
        (key,) = question.keys
        variation = Variation(mission, question.model)
        self.mission, self.question, self.is_scale = mission, question, is_scale
        self.base, self.breaks = variation.read(), question.breaks
        if is_scale:
            self.number, of_table = Number("the factor", FACTOR, 1.0, ""), Number(key, FACTOR, 1.0, "")
            scaled(self.base, key, 1.0)  # raises the problem of the key
        else:
            self.number = of_table = number_of(tree_of(mission), key, _OF_ALL).said_like(between)
        self.key = of_table.key  # beside a bias it is that of the sigma
        self.range: Range = range_of(self.number, between)

        def judged() -> Iterator[JudgedMission]:
            """Judge the mission with the number as in the file, and with the number at the upper end of the range.

            The second case is needed because an error may count as undeclared with the value in the file.
            """
            yield judged_mission(Analysis(self.base), question.today)
            with suppress(MissionError):
                end = self.range.high
                last = scaled(self.base, key, end) if is_scale else variation.at({self.number: end})
                yield judged_mission(Analysis(last), question.today)

        hold_to_decisions(list(judged()), question.row)
        self.table = Table(question, mission, [of_table])
        self.levels = SOLVE_SETTINGS.read_ahead_steps if self.table.to_read else SOLVE_SETTINGS.ahead_steps

    def solution(self, progress: Progress) -> Solution:
        """Search the range, and return the solution; raises `QuestionError` if no value gives a valid mission."""
        scanned, file_state = self.scanned(progress)
        borders = [(low, high) for low, high in pairwise(scanned) if low.complies != high.complies]
        crossings = self.crossings(borders)
        key = self.key
        missions = [state for state in scanned if not state.reason]
        if not missions:
            raise QuestionError(f"{key}: no value of the range makes a mission: {scanned[0].reason}")
        nearest = _nearest(missions)
        return Solution(
            file=self.mission.file,
            name=self.mission.name,
            key=key,
            unit=self.number.dimension.si,
            is_scale=self.is_scale,
            target=self.question.target,
            row=self.question.row,
            model=self.base.gating_model,
            low=self.range.low,
            high=self.range.high,
            is_circle=self.range.is_circle,
            given=file_state,
            crossings=crossings,
            nearest=nearest,
            is_constant=missions[0].status != "not_evaluated"
            and all(
                state.row == missions[0].row and _is_alike(state.utilization, missions[0].utilization)
                for state in missions[1:]
            ),
            skipped=sum(bool(state.reason) for state in scanned),
            waived=sum(state.status == "waived" for state in scanned),
            waived_by=tuple(dict.fromkeys(waiver for state in scanned for waiver in state.waived_by)),
            changes=self.mission.changes,
            texts=self.texts(crossings, nearest),
        )

    def scanned(self, progress: Progress) -> tuple[list[State], State | None]:
        """Find the states at the samples, and at maxima and minima of the utilization where compliance changes.

        Returns these states in ascending order of the number, and the state at the value in the mission file, which
        is None if the file has no such value.
        """
        values = self.range.places(
            SOLVE_SETTINGS.circle_samples if self.range.is_circle else SOLVE_SETTINGS.range_samples
        )
        value = self.number.value
        if value is not None and self.range.low < value < self.range.high:
            values = sorted({*values, value})
        states = self.states(values if value is None else [*values, value], progress)
        file_state = None if value is None else states.pop()
        # Between samples with equal compliance it may change there and back, at a turn of the utilization.
        searches = [
            partial(_turn, *turn, self.levels - 1) for turn in _turns(states)[: SOLVE_SETTINGS.max_turns_count]
        ]
        turned = [state for state in self._searched(searches) if state is not None]
        return sorted([*states, *turned], key=lambda state: state.value), file_state

    def states(self, values: Sequence[float], progress: Progress = unseen) -> list[State]:
        """Check the mission at values of the number, in SI, and return the state at each value."""
        (number,) = self.table.numbers
        columns_by_name = self.table.watched({number.key: np.array(values)}, progress)
        columns = (*VERDICT, *GEOMETRY[:2], DOUBTS, WAIVED_BY, REASON)
        states = []
        for value, *line in zip(values, *(columns_by_name[column.name].tolist() for column in columns), strict=True):
            status, row, use, requirement, range_m, cross_range_m, doubts, waived_by, reason = line
            if reason:
                states.append(State(value, complies=False, status=status, reason=reason))
                continue
            complies, utilization = status not in self.breaks, None if math.isnan(use) else use
            states.append(
                State(
                    value,
                    complies,
                    status,
                    row or None,
                    requirement or None,
                    utilization,
                    range_m,
                    cross_range_m,
                    waived_by=listed(waived_by),
                    doubts=listed(doubts),
                )
            )
        return states

    def crossings(self, borders: Sequence[tuple[State, State]]) -> tuple[Crossing, ...]:
        """Find the crossing at each border: bracket it, round both sides to a few digits, and check the result.

        A border is a pair of neighbouring states with different compliance.
        """
        least = 1e-9 * (self.range.high - self.range.low)  # near 0, where a fraction of the value is no useful width
        narrow = self._searched([partial(_bracketed, low, high, least, self.levels) for low, high in borders])
        texts = [
            text
            for low, high in narrow
            for text in (self.number.text(low.value, is_up=False), self.number.text(high.value, is_up=True))
        ]
        rounded = iter(self.states([self.number.read(text) for text in texts]) if texts else ())
        return tuple(_crossing(low, high, next(rounded), next(rounded)) for low, high in narrow)

    def _searched(self, searches: Sequence[Search[SearchT]]) -> list[SearchT]:
        """Run several searches in parallel until all are finished, and return their results.

        The values that any of the searches needs next are checked all at once.
        """
        states_by_value: dict[float, State] = {}
        while True:
            results = [search(states_by_value) for search in searches]
            needed = {
                value for result in results if isinstance(result, set) for value in result
            } - states_by_value.keys()
            if not needed:
                return [result for result in results if not isinstance(result, set)]
            values = sorted(needed)
            states_by_value.update(zip(values, self.states(values), strict=True))

    def texts(self, crossings: Sequence[Crossing], nearest: State) -> dict[float, str]:
        """Write all values of the solution as strings for a mission file; returns the strings by value."""
        values = [self.range.low, self.range.high, nearest.value]
        values += [state.value for crossing in crossings for state in (crossing.inside, crossing.outside)]
        values += [] if self.number.value is None else [self.number.value]
        return {value: self.number.text(value) for value in values}


def _bracketed(
    low: State, high: State, least: float, levels: int, states_by_value: Mapping[float, State]
) -> tuple[State, State] | set[float]:
    """Bisect the interval between two states with different compliance until it is narrow.

    Returns the states at both ends of the interval. If a state is missing in `states_by_value`, the function returns
    the set of values that the next `levels` steps may need. The interval is narrow if its width is a small fraction
    of its values; if the values are smaller than `least`, the width is compared with `least` instead.
    """
    while high.value - low.value > SOLVE_SETTINGS.border_fraction * max(abs(low.value), abs(high.value), least):
        middle = (low.value + high.value) / 2
        if not low.value < middle < high.value:
            break
        if middle not in states_by_value:
            return _ahead(_middle, low.value, high.value, levels)
        state = states_by_value[middle]
        low, high = (state, high) if state.complies == low.complies else (low, state)
    return low, high


def _ahead(points: Callable[[float, float], tuple[float, ...]], low: float, high: float, levels: int) -> set[float]:
    """Find all values that the next `levels` steps of a search may need.

    `points` is a function that returns the values to check in an interval. The search continues either
    below the last of these values or above the first, within the same interval.
    """
    values = points(low, high)
    if not levels or not low < values[0] < high:
        return set()
    return {*values, *_ahead(points, low, values[-1], levels - 1), *_ahead(points, values[0], high, levels - 1)}


def _middle(low: float, high: float) -> tuple[float]:
    return ((low + high) / 2,)


def _golden(low: float, high: float) -> tuple[float, float]:
    return high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)


def _turns(states: Sequence[State]) -> list[tuple[float, float, State]]:
    """Find intervals in which compliance is constant, but the utilization has a maximum or minimum.

    Each interval extends from one sample to the next but one. Each item has the low and high value of the interval,
    and the state at the sample between them.
    """
    turns = []
    for before, here, after in zip(states, states[1:], states[2:], strict=False):
        uses = [state.utilization for state in (before, here, after)]
        if not before.complies == here.complies == after.complies or any(use is None for use in uses):
            continue
        first, middle, last = (_sign(here) * use for use in uses if use is not None)
        ends = [end for end in (first, last) if not _is_alike(end, middle)]  # turns within rounding do not count
        if ends and max(ends) < middle:
            turns.append((before.value, after.value, here))
    return turns


def _turn(
    low: float, high: float, here: State, levels: int, states_by_value: Mapping[float, State]
) -> State | set[float] | None:
    """Search near a maximum or minimum of the utilization for a state whose compliance differs from `here`.

    Returns the state, or None if the search finds no such state. If a state is missing in `states_by_value`, the
    function returns the set of values that the next `levels` steps may need.
    """
    for _ in range(SOLVE_SETTINGS.turn_steps):
        values = _golden(low, high)
        if not states_by_value.keys() >= set(values):
            return _ahead(_golden, low, high, levels)
        left, right = (states_by_value[value] for value in values)
        for state in (left, right):
            if state.complies != here.complies and not state.reason:
                return state
        if left.utilization is None or right.utilization is None:
            return None
        is_before = _sign(here) * left.utilization > _sign(here) * right.utilization
        low, high = (low, right.value) if is_before else (left.value, high)
    return None


def _crossing(low: State, high: State, below: State, above: State) -> Crossing:
    """Make the crossing at a border of compliance.

    `low` and `high` are the states on its two sides. `below` and `above` are the states at the rounded values of
    these sides. They replace `low` and `high` if they have the same compliance; otherwise compliance changes again
    within the rounding.
    """
    is_upper = low.complies
    is_verified = below.complies == low.complies and above.complies == high.complies
    if not is_verified:  # compliance changes again within the rounding
        below, above = low, high
    inside, outside = (below, above) if is_upper else (above, below)
    return Crossing(inside, outside, is_upper, is_verified)


def _sign(state: State) -> float:
    """Whether a higher (1) or a lower (-1) utilization would change compliance; 1 if the state complies."""
    return 1.0 if state.complies else -1.0
