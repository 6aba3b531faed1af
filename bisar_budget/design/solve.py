"""Solve a mission for one of its numbers: every value at which compliance begins or ends.

The range is looked at in places, and between two places where compliance differs, the border is bracketed. Where the
worst utilization turns between places, the turn is looked for first: compliance may change there and back. What
arrays hold is checked together, as a sweep does; what is said of a crossing or a nearest miss is what `check` says.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from datetime import date
from itertools import pairwise

import numpy as np

from bisar_budget.budget.check import check_mission
from bisar_budget.design.quantities import FACTOR, Number, QuestionError, Range, number_of, range_of, tree_of
from bisar_budget.design.scaled import scaled
from bisar_budget.design.solution import Crossing, Solution, State
from bisar_budget.design.sweep import GEOMETRY, REASON, VERDICT, Engine, Question
from bisar_budget.design.variation import ALIKE, Variation, breaking, hold_to_decisions, standing
from bisar_budget.faults import MissionError, SetValue
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.mission.model import Mission
from bisar_budget.workers import Progress, unseen

_OF_ALL = ", or --scale for all of them"
PLACES = 65  # of a range
PLACES_OF_CIRCLE = 181  # every 2 degrees: geometry changes fast where gradients are nearly parallel
_NARROW = 2e-7  # of the value, between the two sides of a crossing before they are written
_GOLDEN = (math.sqrt(5) - 1) / 2
_STEPS_TO_TURN = 20  # a golden section to 7e-5 of two places
_TURNS = 16  # that are looked for

Evaluate = Callable[[float], State]


def solve(
    mission: Mission,
    key: str,
    *,
    between: str | None = None,
    row: str | None = None,
    target: str = "fail",
    model: str | None = None,
    is_scale: bool = False,
    today: date,
    progress: Progress = unseen,
) -> Solution:
    """Find every value of a number of a mission at which its compliance begins or ends.

    Parameters
    ----------
    mission : Mission
        As loaded; the file that it came from is read anew for each value, with the options that changed it.
    key : str
        Path of the number in the mission file, such as `collection.aperture_time`; with `is_scale` of a section.
    between : str, optional
        Range to look at, `A..B` with units. Omitted: a tenth to ten times the file's value; of an azimuth the circle;
        of a factor 0.1 to 10.
    row : str, optional
        Id of the row that has to comply, instead of the whole mission.
    target : str
        fail: what `check` exits with 0 on complies; warn: what `check --strict` does.
    model : str, optional
        Gating model in place of the mission's own.
    is_scale : bool
        Solve for the factor that multiplies all errors below the key.
    today : date
        Day on which waivers are judged, UTC.
    progress : callable, optional
        Is told, after each value of the scan that is checked by itself, how many are done, and how many there are.

    Returns
    -------
    Solution
        Crossings in rising order, values in SI.

    Raises
    ------
    QuestionError
        The question cannot be asked of this mission; says why.
    """
    search = _Search(mission, key, between, row, target, model, is_scale, today)
    scanned = search.scanned(progress)
    crossings = tuple(search.crossing(low, high) for low, high in pairwise(scanned) if low.complies != high.complies)
    missions = [state for state in scanned if not state.reason]
    if not missions:
        raise QuestionError(f"{key}: no value of the range makes a mission: {scanned[0].reason}")
    nearest = search.evaluate(_nearest(missions).value)
    return Solution(
        file=mission.file,
        name=mission.name,
        key=key,
        unit=search.number.dimension.si,
        is_scale=is_scale,
        target=target,
        row=row,
        model=search.base.gating_model,
        low=search.range.low,
        high=search.range.high,
        is_circle=search.range.is_circle,
        given=search.given,
        crossings=crossings,
        nearest=nearest,
        is_constant=_is_constant(missions),
        skipped=sum(bool(state.reason) for state in scanned),
        changes=mission.changes,
        texts=search.texts(crossings, nearest),
    )


def _nearest(states: Sequence[State]) -> State:
    """The first place with the least left where all comply, else the first that lacks the least.

    Where something is not evaluated nothing is broken: no limit is nearer.
    """
    if all(state.complies for state in states):
        uses = [state.utilization or 0.0 for state in states]
        decides = max(uses)
    else:
        uses = [
            -1.0 if state.status == "not_evaluated" else math.inf if state.utilization is None else state.utilization
            for state in states
        ]
        decides = min(uses)
    return next(state for state, use in zip(states, uses, strict=True) if _is_alike(use, decides))


def _is_constant(states: Sequence[State]) -> bool:
    """Whether one row decides, with one utilization."""
    first, *others = states
    return all(state.row == first.row and _is_alike(state.utilization, first.utilization) for state in others)


def _is_alike(one: float | None, other: float | None) -> bool:
    """Whether two utilizations are one, but for rounding."""
    return one == other or (one is not None and other is not None and math.isclose(one, other, rel_tol=ALIKE))


class _Search:
    """One mission and one number of it."""

    def __init__(
        self,
        mission: Mission,
        key: str,
        between: str | None,
        row: str | None,
        target: str,
        model: str | None,
        is_scale: bool,
        today: date,
    ) -> None:
        self.variation, self.key, self.row, self.today = Variation(mission, model), key, row, today
        self.breaks = breaking(target)
        self.is_scale = is_scale
        self.base = self.variation.read()
        if is_scale:
            self.number = Number("the factor", FACTOR, 1.0, "")
            scaled(self.base, key, 1.0)  # says what is wrong with the key
        else:
            self.number = number_of(tree_of(self.variation.mission), key, _OF_ALL).said_like(between)
        self.range: Range = range_of(self.number, between)
        found = check_mission(self.base, today, is_bare=True)
        hold_to_decisions([found, *self._at_the_end()], row)
        self.given = None if self.number.value is None else self._state(self.number.value, found)
        self.engine = self._engine(found, target)

    def _engine(self, found: MissionFindings, target: str) -> Engine | None:
        """What checks many values together; None where no array holds them."""
        if self.is_scale or (self.row is not None and all(row.id != self.row for row in found.rows)):
            return None
        mission, model = self.variation.mission, self.variation.model
        question = Question(mission.data, mission.file, mission.changes, (self.key,), (), model, self.today)
        engine = Engine(question._replace(row=self.row, target=target), mission)
        return None if engine.not_held else engine

    def _at_the_end(self) -> Iterator[MissionFindings]:
        """Findings at the end of the range: the number may be an error that the file does not declare."""
        with suppress(MissionError):
            yield check_mission(self.at(self.range.high), self.today, is_bare=True)

    def places(self) -> list[float]:
        """Values that the scan looks at, in rising order; that of the file is among them."""
        places = self.range.places(PLACES_OF_CIRCLE if self.range.is_circle else PLACES)
        value = self.number.value
        if value is not None and self.range.low < value < self.range.high:
            places = sorted({*places, value})
        return places

    def at(self, value: float) -> Mission:
        """The mission with another value, or raises `MissionError`."""
        if self.is_scale:
            return scaled(self.base, self.key, value)
        return self.variation.at({self.number: value})

    def scanned(self, progress: Progress) -> list[State]:
        """Look at every place of the range, and where the utilization turns."""
        places = self.places()
        return _with_turns(self.states(places, progress), self.evaluate)

    def states(self, values: Sequence[float], progress: Progress) -> list[State]:
        """Check the mission with each of many values."""
        if self.engine is None:
            states = []
            for done, value in enumerate(values, 1):
                states.append(self.evaluate(value))
                progress(done, len(values))
            return states
        found = self.engine.part(0, len(values), {self.key: np.array(values)}, progress).values
        columns = (*VERDICT, *GEOMETRY[:2], REASON)
        lines = zip(values, *(found[column.name].tolist() for column in columns), strict=True)
        return [self._of_line(*line) for line in lines]

    def _of_line(
        self, value: float, status: str, row: str, use: float, bound_by: str, range_m: float, cross_m: float, why: str
    ) -> State:
        """State of a value by the columns of a sweep."""
        if why:
            return State(value, complies=False, status=status, reason=why)
        complies, utilization = status not in self.breaks, None if math.isnan(use) else use
        return State(value, complies, status, row or None, bound_by or None, utilization, range_m, cross_m)

    def evaluate(self, value: float) -> State:
        """Check the mission with another value."""
        try:
            return self._state(value, check_mission(self.at(value), self.today, is_bare=True))
        except MissionError as error:
            fault = error.faults[0]
            return State(value, complies=False, status="error", reason=f"{fault.key}: {fault.problem}")

    def _state(self, value: float, found: MissionFindings) -> State:
        resolution = found.resolution
        return State(value, *standing(found, self.row, self.breaks), resolution.range, resolution.cross_range)

    def crossing(self, low: State, high: State) -> Crossing:
        """Bracket the border between two places, write both sides with few digits, check them as they are written."""
        is_upper = low.complies
        least = 1e-9 * (self.range.high - self.range.low)  # around 0, where no part of the value is small
        while high.value - low.value > _NARROW * max(abs(low.value), abs(high.value), least):
            middle = (low.value + high.value) / 2
            if not low.value < middle < high.value:
                break
            state = self.evaluate(middle)
            low, high = (state, high) if state.complies == low.complies else (low, state)
        texts = [self.number.text(low.value, is_up=False), self.number.text(high.value, is_up=True)]
        below, above = (self._checked(text) for text in texts)
        is_verified = below.complies == low.complies and above.complies == high.complies
        if not is_verified:  # compliance changes again within the digits that are written
            below, above = low, high
        inside, outside = (below, above) if is_upper else (above, below)
        return Crossing(inside, outside, is_upper, is_verified)

    def _checked(self, text: str) -> State:
        """Check the mission with a value as it would stand in the file, in full."""
        value = self.number.read(text)
        if self.is_scale:
            return self.evaluate(value)
        try:
            mission = self.variation.read([SetValue(self.key, text)])
            return self._state(value, check_mission(mission, self.today, is_bare=True))
        except MissionError as error:
            fault = error.faults[0]
            return State(value, complies=False, status="error", reason=f"{fault.key}: {fault.problem}")

    def texts(self, crossings: Sequence[Crossing], nearest: State) -> dict[float, str]:
        """Every value that is said, as the file would have it."""
        values = [self.range.low, self.range.high, nearest.value]
        values += [state.value for crossing in crossings for state in (crossing.inside, crossing.outside)]
        values += [] if self.number.value is None else [self.number.value]
        return {value: self.number.text(value) for value in values}


def _with_turns(states: Sequence[State], evaluate: Evaluate) -> list[State]:
    """Add, where the utilization turns between places without a change of compliance, a place that differs in it."""
    found = list(states)
    turns = 0
    for before, here, after in zip(states, states[1:], states[2:], strict=False):
        uses = [state.utilization for state in (before, here, after)]
        if not before.complies == here.complies == after.complies or any(use is None for use in uses):
            continue
        first, middle, last = (_sign(here) * use for use in uses if use is not None)
        ends = [end for end in (first, last) if not _is_alike(end, middle)]  # a turn that rounding makes is none
        if ends and max(ends) < middle and turns < _TURNS:
            turns += 1
            if (turned := _turn(evaluate, before.value, after.value, here)) is not None:
                found.append(turned)
    return sorted(found, key=lambda state: state.value)


def _sign(state: State) -> float:
    """Of what complies the highest utilization may not, of the rest the lowest may."""
    return 1.0 if state.complies else -1.0


def _turn(evaluate: Evaluate, low: float, high: float, here: State) -> State | None:
    """Where the utilization turns between two places, the first value whose compliance differs; None if none does."""
    for _ in range(_STEPS_TO_TURN):
        left, right = (evaluate(high - _GOLDEN * (high - low)), evaluate(low + _GOLDEN * (high - low)))
        for state in (left, right):
            if state.complies != here.complies and not state.reason:
                return state
        if left.utilization is None or right.utilization is None:
            return None
        is_left = _sign(here) * left.utilization > _sign(here) * right.utilization
        low, high = (low, right.value) if is_left else (left.value, high)
    return None
