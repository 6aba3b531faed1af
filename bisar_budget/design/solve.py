"""Solve a mission for one of its numbers: every value at which compliance begins or ends.

The range is looked at in places, and between two places where compliance differs, the border is bracketed. Where the
worst utilization turns between places, the turn is looked for first: compliance may change there and back. All of
these look at many values at once, in the case table. Values in SI and radians; factors are plain numbers.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from datetime import date
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.budget.judged_mission import JudgedMission, judged_mission
from bisar_budget.budget.judged_requirements import EQUAL_USE_FRACTION
from bisar_budget.design.table import (
    GEOMETRY,
    REASON,
    VERDICT,
    WAIVED_BY,
    Question,
    Table,
    Variation,
    breaking,
    hold_to_decisions,
    listed,
)
from bisar_budget.design.varied import scaled
from bisar_budget.faults import MissionError, SetValue
from bisar_budget.findings.images import Verdict
from bisar_budget.findings.requirement import Override
from bisar_budget.mission.model import Mission
from bisar_budget.mission.quantities import FACTOR, Number, QuestionError, Range, number_of, range_of, tree_of
from bisar_budget.workers import Progress, unseen

_OF_ALL = ", or --scale for all of them"
PLACES = 65  # of a range
PLACES_OF_CIRCLE = 181  # every 2 degrees: geometry changes fast where gradients are nearly parallel
_NARROW = 2e-7  # of the value, between the two sides of a crossing before they are written
_GOLDEN = (math.sqrt(5) - 1) / 2
_STEPS_TO_TURN = 20  # a golden section to 7e-5 of two places
_TURNS = 16  # that are looked for
_LEVELS, _LEVELS_READ = 5, 2  # steps of a search that are looked ahead; where each case is read, it costs more

# With what is known of values it has an outcome, or a set of values that it needs to know more of.
Search = Callable[[Mapping[float, "State"]], Any]


class State(NamedTuple):
    """How the mission stands at one value.

    `row` has the highest utilization of the rows that decide, `requirement` is what sets its allowable; None where
    nothing is judged. `reason` says why there is no mission at this value; empty where there is one. `waived_by` are
    ids of waivers where it is waived, which does not comply. Resolutions are peak to first null on the ground. [m]
    """

    value: float
    complies: bool
    status: str
    row: str | None = None
    requirement: str | None = None
    utilization: float | None = None
    range_resolution_m: float | None = None
    cross_range_resolution_m: float | None = None
    reason: str = ""
    waived_by: tuple[str, ...] = ()


class Crossing(NamedTuple):
    """A border of compliance: the last value that complies and the first beyond it that does not.

    `inside` and `outside` are 1e-6 of the value apart, `is_upper` is whether values below comply. `is_verified` is
    whether `check` of the mission with each of the two, as text, says so.
    """

    inside: State
    outside: State
    is_upper: bool
    is_verified: bool


class Imaged(NamedTuple):
    """Verdict of the image on the row that binds at a solution.

    `at` is the solution as text; `verdict` is None where a row has no image. `reason` says why there is no verdict,
    or what it rests on; empty where there is nothing to say.
    """

    row: str
    at: str
    verdict: Verdict | None
    reason: str

    @property
    def is_optimistic(self) -> bool:
        """Whether the image, with autofocus or without, shows more than the limit promises."""
        return self.verdict is not None and "optimistic" in (self.verdict.verdict, self.verdict.verdict_autofocus)


class Solution(NamedTuple):
    """The crossings of one mission in a range, in rising order.

    `key` is what was solved for, `unit` that of its values, `is_scale` whether they are factors of all numbers
    below the key. `low` and `high` are the ends of the range, `is_circle` whether they are one direction. `nearest`
    is the nearest miss where nothing complies, or where everything does the value with the least left. `given` is
    the value of the file. `texts` has every value as the file would have it. `is_constant` is whether the number
    changes no utilization that decides. `skipped` counts the places of the range at which there is no mission,
    `waived` those that are waived, by the waivers `waived_by`.
    `imaged` is what images say at the best crossing, if any were formed. `overrides` is what from outside the file
    bears on it.
    """

    file: str
    name: str
    key: str
    unit: str
    is_scale: bool
    target: str
    row: str | None
    model: str
    low: float
    high: float
    is_circle: bool
    given: State | None
    crossings: tuple[Crossing, ...]
    nearest: State
    is_constant: bool
    skipped: int
    texts: Mapping[float, str]
    changes: tuple[SetValue, ...] = ()
    imaged: Imaged | None = None
    overrides: tuple[Override, ...] = ()
    waived: int = 0
    waived_by: tuple[str, ...] = ()

    @property
    def value(self) -> float | None:
        """Largest value at which compliance ends or begins; None if it does so nowhere."""
        return max((crossing.inside.value for crossing in self.crossings), default=None)

    @property
    def best(self) -> Crossing | None:
        """The crossing of that value."""
        return max(self.crossings, key=lambda crossing: crossing.inside.value, default=None)

    @property
    def is_monotonic(self) -> bool:
        """Whether compliance changes once at most."""
        return len(self.crossings) <= 1

    @property
    def status(self) -> str:
        """`crossing`, or `all` or `none` of the range complies; `waived` where none does and some of it is waived."""
        if self.crossings:
            return "crossing"
        return "all" if self.nearest.complies else "waived" if self.waived else "none"


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

    Arguments are those of `bisar_budget.solve`; `between` is `A..B` with units, of a factor 0.1 to 10 where it is
    omitted. By the target `fail` complies what `check` exits with 0 on, by `warn` what `check --strict` does.
    `progress` is told how many values are done, and how many there are. Values found are in SI.

    Raises
    ------
    QuestionError
        The question cannot be asked of this mission; says why.
    """
    search = _Search(mission, key, between, row, target, model, is_scale, today)
    scanned, given = search.scanned(progress)
    borders = [(low, high) for low, high in pairwise(scanned) if low.complies != high.complies]
    crossings = search.crossings(borders)
    missions = [state for state in scanned if not state.reason]
    if not missions:
        raise QuestionError(f"{key}: no value of the range makes a mission: {scanned[0].reason}")
    nearest = _nearest(missions)
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
        given=given,
        crossings=crossings,
        nearest=nearest,
        is_constant=missions[0].status != "not_evaluated"
        and all(
            one.row == missions[0].row and _is_alike(one.utilization, missions[0].utilization) for one in missions[1:]
        ),
        skipped=sum(bool(state.reason) for state in scanned),
        waived=sum(state.status == "waived" for state in scanned),
        waived_by=tuple(dict.fromkeys(waiver for state in scanned for waiver in state.waived_by)),
        changes=mission.changes,
        texts=search.texts(crossings, nearest),
    )


def _nearest(states: Sequence[State]) -> State:
    """The first place with the least left where all comply, else the first that lacks the least.

    Of places that do not comply those that are waived come first. Where something is not evaluated nothing is broken:
    no limit is nearer.
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


def _is_alike(one: float | None, other: float | None) -> bool:
    """Whether two utilizations are one, but for rounding."""
    return one == other or (
        one is not None and other is not None and math.isclose(one, other, rel_tol=EQUAL_USE_FRACTION)
    )


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
        variation = Variation(mission, model)
        self.base, self.breaks = variation.read(), breaking(target)
        if is_scale:
            self.number, of_table = Number("the factor", FACTOR, 1.0, ""), Number(key, FACTOR, 1.0, "")
            scaled(self.base, key, 1.0)  # says what is wrong with the key
        else:
            self.number = of_table = number_of(tree_of(mission), key, _OF_ALL).said_like(between)
        self.range: Range = range_of(self.number, between)

        def judged() -> Iterator[JudgedMission]:
            """The mission, and that at the end of the range: the number may be an error that is not declared."""
            yield judged_mission(Analysis(self.base), today)
            with suppress(MissionError):
                end = self.range.high
                last = scaled(self.base, key, end) if is_scale else variation.at({self.number: end})
                yield judged_mission(Analysis(last), today)

        hold_to_decisions(list(judged()), row)
        self.table = Table(
            Question.of(mission, [key], model, today, row=row, breaks=self.breaks), mission, [of_table]
        )
        self.levels = _LEVELS_READ if self.table.to_read else _LEVELS

    def scanned(self, progress: Progress) -> tuple[list[State], State | None]:
        """Look at every place of the range, and where the utilization turns; beside it the state of the file."""
        places = self.range.places(PLACES_OF_CIRCLE if self.range.is_circle else PLACES)
        value = self.number.value
        if value is not None and self.range.low < value < self.range.high:
            places = sorted({*places, value})
        states = self.states(places if value is None else [*places, value], progress)
        given = None if value is None else states.pop()
        # Between places without a change of compliance it may change there and back, where the utilization turns.
        searches = [partial(_turn, *turn, self.levels - 1) for turn in _turns(states)[:_TURNS]]
        turned = [state for state in self._searched(searches) if state is not None]
        return sorted([*states, *turned], key=lambda state: state.value), given

    def states(self, values: Sequence[float], progress: Progress = unseen) -> list[State]:
        """Check the mission with each of many values."""
        (number,) = self.table.numbers
        found = self.table.watched({number.key: np.array(values)}, progress)
        columns = (*VERDICT, *GEOMETRY[:2], WAIVED_BY, REASON)
        states = []
        for value, *line in zip(values, *(found[column.name].tolist() for column in columns), strict=True):
            status, row, use, requirement, range_m, cross_range_m, waived_by, why = line
            if why:
                states.append(State(value, complies=False, status=status, reason=why))
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
                )
            )
        return states

    def crossings(self, borders: Sequence[tuple[State, State]]) -> tuple[Crossing, ...]:
        """Bracket borders between two places, write both sides with few digits, check them as they are written."""
        least = 1e-9 * (self.range.high - self.range.low)  # around 0, where no part of the value is small
        narrow = self._searched([partial(_bracketed, low, high, least, self.levels) for low, high in borders])
        texts = [
            text
            for low, high in narrow
            for text in (self.number.text(low.value, is_up=False), self.number.text(high.value, is_up=True))
        ]
        written = iter(self.states([self.number.read(text) for text in texts]) if texts else ())
        return tuple(_crossing(low, high, next(written), next(written)) for low, high in narrow)

    def _searched(self, searches: Sequence[Search]) -> list[Any]:
        """Go on with all searches at once, until each has what it looks for."""
        known: dict[float, State] = {}
        while True:
            found = [search(known) for search in searches]
            needed = {value for one in found if isinstance(one, set) for value in one} - known.keys()
            if not needed:
                return found
            values = sorted(needed)
            known.update(zip(values, self.states(values), strict=True))

    def texts(self, crossings: Sequence[Crossing], nearest: State) -> dict[float, str]:
        """Every value that is said, as the file would have it."""
        values = [self.range.low, self.range.high, nearest.value]
        values += [state.value for crossing in crossings for state in (crossing.inside, crossing.outside)]
        values += [] if self.number.value is None else [self.number.value]
        return {value: self.number.text(value) for value in values}


def _bracketed(
    low: State, high: State, least: float, levels: int, known: Mapping[float, State]
) -> tuple[State, State] | set[float]:
    """Halve the interval with a border in it until it is narrow; without a state, the values that may come next."""
    while high.value - low.value > _NARROW * max(abs(low.value), abs(high.value), least):
        middle = (low.value + high.value) / 2
        if not low.value < middle < high.value:
            break
        if middle not in known:
            return _ahead(_middle, low.value, high.value, levels)
        state = known[middle]
        low, high = (state, high) if state.complies == low.complies else (low, state)
    return low, high


def _ahead(points: Callable[[float, float], tuple[float, ...]], low: float, high: float, levels: int) -> set[float]:
    """Every value that so many steps may look at: each goes on below its last point, or above its first."""
    found = points(low, high)
    if not levels or not low < found[0] < high:
        return set()
    return {*found, *_ahead(points, low, found[-1], levels - 1), *_ahead(points, found[0], high, levels - 1)}


def _middle(low: float, high: float) -> tuple[float]:
    return ((low + high) / 2,)


def _golden(low: float, high: float) -> tuple[float, float]:
    return high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)


def _turns(states: Sequence[State]) -> list[tuple[float, float, State]]:
    """Places between which the utilization turns without a change of compliance, and the state between them."""
    found = []
    for before, here, after in zip(states, states[1:], states[2:], strict=False):
        uses = [state.utilization for state in (before, here, after)]
        if not before.complies == here.complies == after.complies or any(use is None for use in uses):
            continue
        first, middle, last = (_sign(here) * use for use in uses if use is not None)
        ends = [end for end in (first, last) if not _is_alike(end, middle)]  # a turn that rounding makes is none
        if ends and max(ends) < middle:
            found.append((before.value, after.value, here))
    return found


def _turn(
    low: float, high: float, here: State, levels: int, known: Mapping[float, State]
) -> State | set[float] | None:
    """The first state around a turn whose compliance differs, None if none does, or the values that may come next."""
    for _ in range(_STEPS_TO_TURN):
        values = _golden(low, high)
        if not known.keys() >= set(values):
            return _ahead(_golden, low, high, levels)
        left, right = (known[value] for value in values)
        for state in (left, right):
            if state.complies != here.complies and not state.reason:
                return state
        if left.utilization is None or right.utilization is None:
            return None
        is_left = _sign(here) * left.utilization > _sign(here) * right.utilization
        low, high = (low, right.value) if is_left else (left.value, high)
    return None


def _crossing(low: State, high: State, below: State, above: State) -> Crossing:
    """The border between two states, which stand beside it as they are written."""
    is_upper = low.complies
    is_verified = below.complies == low.complies and above.complies == high.complies
    if not is_verified:  # compliance changes again within the digits that are written
        below, above = low, high
    inside, outside = (below, above) if is_upper else (above, below)
    return Crossing(inside, outside, is_upper, is_verified)


def _sign(state: State) -> float:
    """Sign of utilization: 1 where a state complies, as the highest may not; else -1, as the lowest may."""
    return 1.0 if state.complies else -1.0
