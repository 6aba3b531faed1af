"""The change of the worst utilization by each number of a mission, by differences of whole checks.

Every number that the file states, or takes from a part, is changed by itself, and all of these cases are checked
together. Where the shares of a budget follow what is declared, it is also seen what an error that is relaxed costs
the others. Values in SI and radians.
"""

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from datetime import date
from typing import Any, NamedTuple

import numpy as np

from bisar_budget import units
from bisar_budget.analysis.allocation import is_balanced
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.budget.judged_mission import JudgedMission, judged_mission
from bisar_budget.budget.judged_requirements import IS_JUDGED
from bisar_budget.budget.judged_rows import Judged
from bisar_budget.design.table import Question, Table, Variation, hold_to_decisions, standing
from bisar_budget.design.varied import scaled
from bisar_budget.effects.effect import MOTION, PLATFORMS
from bisar_budget.faults import SetValue
from bisar_budget.findings.requirement import Override
from bisar_budget.mission.model import MISSION, SHARES, Mission
from bisar_budget.mission.propagation import DELAYS
from bisar_budget.mission.quantities import FACTOR, Number, QuestionError, as_number, form_of, tree_of
from bisar_budget.mission.readers import (
    DIRECTION,
    ELEVATION,
    INVALID,
    LATITUDE,
    Choice,
    ListOf,
    Quantity,
    Reader,
    Triple,
    Version,
    Whole,
)
from bisar_budget.workers import Progress, unseen

LITTLE = 1e-4  # of a utilization: less of a change is not shown
EVEN = 0.01  # part of every number for which effects are compared
_FURTHEST = math.log(1e6)  # times: a number that would have to change by more decides nothing
_NOTHING = 1e-9  # of a utilization: what rounding leaves of a check
_RELAXED = 2.0  # times, an error that is relaxed
_SAME = 1e-9  # of what is declared
# Half of a difference. A power law of exponent p is wrong by (p - 1)(p - 2)/6 of its square, 2e-4 for the inverse
# square; allowables by exact ranges end their search within 1e-5 of a limit, which is 1e-3 of a hundredth.
RELATIVE_STEP = 0.01
# Sines and decibels bend faster than powers: 3e-6 of a slope, and 1.4e-4.
DIRECTION_STEP = math.radians(0.25)
LEVEL_STEP = 0.25  # dB
_EARTH = 6.371e6  # m, mean radius


# ---------------------------------------------------------------- what is found
class Skipped(NamedTuple):
    """A key that is left out, what the file says there, and why."""

    key: str
    text: str
    reason: str


class Slope(NamedTuple):
    """Change of the utilization by one number of the file.

    `text` is its value as the file has it, `value` the same in `unit`; of a covariance the factor 1 on its sigmas.
    `per_text` says how much more of it `change` is for, `per` the same in SI, signed like the value, and `measure`
    the same by one measure for all numbers: a part of the number, of a radian, of a power, of a range. `change` is
    that of the worst utilization, `row_change` that of the row that was asked for; None where there is none. Both are
    differences over values `step` to either side, or, where there is no mission on one side, over two steps on the
    other (`difference`: central, forward, backward). `row_below` and `row_above` have the worst utilization at the
    smaller and the larger end of the difference, in magnitude; `is_mixed` is whether the row that has it at the value
    itself uses less at an end: the change is then made of the slopes of two rows. `part` is the part of the catalogue
    that the number is taken from; empty if the file states it.
    """

    key: str
    text: str
    value: float
    unit: str
    per: float
    per_text: str
    step: float
    difference: str
    change: float
    row_change: float | None
    row_below: str
    row_above: str
    is_mixed: bool
    part: str = ""
    measure: float = 0.01

    @property
    def given(self) -> str:
        """Its value as the file has it, and the part that it is from."""
        return f"{self.text} ({self.part})" if self.part else self.text

    @property
    def effect(self) -> float:
        """Change of what was asked for: the row, else the worst utilization."""
        return self.change if self.row_change is None else self.row_change

    @property
    def even_effect(self) -> float:
        """Effect of the same small part of every number: of itself, of a radian, of a power, of a range."""
        return self.effect * EVEN / self.measure

    @property
    def is_proportional(self) -> bool:
        """Whether it changes by parts of itself."""
        return self.per_text == "1 %"


class Relaxed(NamedTuple):
    """Cost to the other errors of doubling one declared error where shares are balanced.

    `shares_before` and `shares_after` are those of transmitter and receiver. `transmitter` and `receiver` have, of
    each, the worst utilization of the judged rows that are not of this error, before and after, and the row that has
    it after; None where there is none.
    """

    key: str
    shares_before: tuple[float, float]
    shares_after: tuple[float, float]
    transmitter: tuple[str, float, float] | None
    receiver: tuple[str, float, float] | None

    @property
    def moves_shares(self) -> bool:
        """Whether it takes from anybody."""
        return abs(self.shares_after[0] - self.shares_before[0]) > LITTLE


class Sensitivity(NamedTuple):
    """Numbers of one mission by what they do, the largest effect first.

    `worst_row` has the worst utilization of all rows that are judged and can fail, `requirement` sets its allowable.
    `row` is the one that was asked for, whose effects order the numbers; None without one. `unchanging` are keys of
    numbers that change neither. `relaxed` is empty where shares are not balanced. `overrides` is what
    from outside the file bears on it.
    """

    file: str
    name: str
    model: str
    status: str
    worst_row: str
    requirement: str
    utilization: float
    row: str | None
    row_utilization: float | None
    slopes: tuple[Slope, ...]
    unchanging: tuple[str, ...]
    skipped: tuple[Skipped, ...]
    is_balanced: bool = False
    relaxed: tuple[Relaxed, ...] = ()
    changes: tuple[SetValue, ...] = ()
    overrides: tuple[Override, ...] = ()

    @property
    def asked(self) -> float:
        """Utilization of what was asked for: the row, else the worst."""
        return self.utilization if self.row_utilization is None else self.row_utilization

    def to_limit(self, slope: Slope) -> float | None:
        """Change of a number, by itself, that uses up the margin: the utilization is 1 there; signed, in its unit.

        The utilization goes on as it goes here: with a power of the number, or exponentially with a level or an
        angle. Exact where it does, as of the aperture time or of an error; None beyond a millionfold or half a turn.
        """
        if not slope.effect or self.asked <= 0:
            return None
        change = -math.log(self.asked) * self.asked / slope.effect  # in `per`s, of the logarithm of the utilization
        if slope.is_proportional:
            power = EVEN * change
            return slope.value * math.expm1(power) if abs(power) <= _FURTHEST else None
        is_near = (
            abs(change * slope.per) <= math.pi if slope.unit == "rad" else abs(change * slope.measure) <= _FURTHEST
        )
        return change * slope.per if is_near else None

    @property
    def shown(self) -> tuple[Slope, ...]:
        """Numbers that a reader wants to see: they change it by a ten-thousandth of itself, or more."""
        return tuple(slope for slope in self.slopes if abs(slope.even_effect) >= LITTLE * self.asked)


# ---------------------------------------------------------------- differences
class Stated(NamedTuple):
    """A number that the file states as `text`.

    `step` is half of the difference that is taken, `per` the change that an effect is said for, in SI, and `per_text`
    the same in words. `part` is how much of a change that is, by one measure for all: a part of the number, of a
    radian, of a power, or of the smaller slant range. `others` are numbers that change with it: shares sum to 1. Of a
    covariance the value is a factor on all sigmas.
    """

    number: Number
    text: str
    value: float
    step: float
    per: float
    per_text: str
    part: float = 0.01
    others: tuple[Number, ...] = ()

    def at(self, value: float) -> Mapping[Number, float]:
        """Give the numbers of the mission where this one has another value."""
        left = 1 - self.value
        rest = {one: (one.value or 0.0) * (1 - value) / left for one in self.others}
        return {self.number: value, **rest}


def sensitivity(
    mission: Mission,
    *,
    row: str | None = None,
    model: str | None = None,
    today: date,
    progress: Progress = unseen,
) -> Sensitivity:
    """Find what each number that a mission file states, or takes from a part, does to the worst utilization.

    Each number is changed by itself, to both sides, and the mission is checked anew: no effect is left out. Numbers
    change by 1 % of themselves, directions by a degree, levels by a decibel, latitudes and longitudes by 1 % of the
    smaller slant range. Arguments are those of `solve`, but that the utilization of a `row` is followed beside that
    of the mission.

    Returns
    -------
    Sensitivity
        Effects as changes of utilization, 0.01 being 1 % of a limit. The number that has to change least to use up
        the margin stands first, by one measure for all: parts of a number, of a radian, of a power, of a range.

    Raises
    ------
    QuestionError
        Nothing is declared or judged, the row is not there, or a part cannot be read any more.
    """
    variation = Variation(mission, model)
    base = variation.read()
    if taken := base.taken:  # as if the file stated the figures that it takes from parts
        stated = variation.read([SetValue(one.key, json.dumps(one.value)) for one in taken])
        variation = Variation(stated, model)
        base = variation.read()
    found = judged_mission(Analysis(base), today)
    hold_to_decisions([found], row)
    stands = standing(found, None, frozenset())
    nearest = min(path.slant_range for path in found.analysis.geometry.both)
    numbers, skipped = stated_numbers(tree_of(variation.mission), nearest)
    beside = _Beside(variation, numbers, stands.row, row, today)
    at_file = beside.uses([(None, 0)])[0] if stands.row else ""
    if isinstance(at_file, str):
        raise QuestionError("no utilization that is judged has a value: there is nothing to follow")
    slopes, unchanging = [], []
    for slope in beside.slopes(at_file, progress):
        if isinstance(slope, Skipped):
            skipped.append(slope)
        elif max(abs(slope.change), abs(slope.row_change or 0.0)) <= _NOTHING * max(
            at_file.worst, at_file.row or 0.0
        ):
            unchanging.append(slope.key)
        else:
            parts = (one.part for one in taken if f"{slope.key}.".startswith(f"{one.key}."))
            slopes.append(slope._replace(part=next(parts, "")))
    slopes.sort(key=lambda slope: -abs(slope.even_effect))
    balanced = is_balanced(base)
    return Sensitivity(
        file=mission.file,
        name=mission.name,
        model=base.gating_model,
        status=stands.status,
        worst_row=at_file.worst_row,
        requirement=at_file.requirement,
        utilization=at_file.worst,
        row=row,
        row_utilization=at_file.row,
        slopes=tuple(slopes),
        unchanging=tuple(unchanging),
        skipped=tuple(skipped),
        is_balanced=balanced,
        relaxed=tuple(relaxed_errors(base, found, today)) if balanced else (),
        changes=mission.changes,
    )


class _Uses(NamedTuple):
    """The worst utilization, whose it is, that of the row that was asked for, and that of the file's worst row."""

    worst_row: str
    requirement: str
    worst: float
    row: float | None
    of_worst: float

    @property
    def is_passed(self) -> bool:
        """Whether another row than the worst of the file is the worst, by more than rounding."""
        return self.worst - self.of_worst > _NOTHING * self.worst


class _Beside:
    """The numbers of a mission, and checks of it at values beside theirs."""

    def __init__(
        self, variation: Variation, numbers: Sequence[Stated], worst: str | None, row: str | None, today: date
    ) -> None:
        self.numbers, self.row, self.worst = numbers, row, worst
        varied = {one.key: one for number in numbers for one in number.at(number.value)}
        self.values = {one.key: one.value for one in varied.values()}
        mission, names = variation.mission, dict.fromkeys(name for name in (worst, row) if name is not None)
        columns = tuple(f"{name}.utilization" for name in names)
        asked = Question.of(mission, list(varied), variation.model, today, columns=columns, breaks=frozenset())
        self.table = Table(asked, mission, tuple(varied.values()))

    def uses(self, cases: Sequence[tuple[Stated | None, int]], progress: Progress = unseen) -> list[_Uses | str]:
        """Utilizations with one number some steps aside in each case; why there is no mission as text."""
        values = {key: np.full(len(cases), value) for key, value in self.values.items()}
        for place, (number, steps) in enumerate(cases):
            if number is not None:
                for one, value in number.at(number.value + steps * number.step).items():
                    values[one.key][place] = value
        found = self.table.watched(values, progress)
        texts = ("worst_row", "binding_requirement", "reason")
        asked = [found[f"{name}.utilization"] if name else [None] * len(cases) for name in (self.row, self.worst)]
        uses: list[_Uses | str] = []
        for line in zip(*(found[name] for name in texts), found["utilization"].tolist(), *asked, strict=True):
            worst_row, requirement, reason, worst, row, of_worst = line
            if not reason and (not math.isfinite(worst) or (row is not None and not math.isfinite(row))):
                reason = "no utilization has a value there"
            known = _Uses(worst_row, requirement, worst, row, 0.0 if math.isnan(of_worst) else of_worst)
            uses.append(reason or known)
        return uses

    def slopes(self, here: _Uses, progress: Progress) -> Iterator[Slope | Skipped]:
        """Take the difference to both sides of each number, or to the one side where there is a mission."""
        sides = [(number, side) for number in self.numbers for side in (-1, 1)]
        found = iter(self.uses(sides, progress) if sides else ())
        both = [(next(found), next(found)) for _ in self.numbers]
        farther = [
            (number, 2 if isinstance(below, str) else -2)
            for number, (below, above) in zip(self.numbers, both, strict=True)
            if isinstance(below, str) or isinstance(above, str)
        ]
        at_two = dict(zip(farther, self.uses(farther) if farther else (), strict=True))
        for number, (below, above) in zip(self.numbers, both, strict=True):
            if not isinstance(below, str) and not isinstance(above, str):
                yield self._slope(number, here, "central", [below, above], (-0.5, 0.5))
                continue
            # To second order, as the central one.
            side, kind, near = (1, "forward", above) if isinstance(below, str) else (-1, "backward", below)
            far = at_two[number, 2 * side]
            if isinstance(near, str) or isinstance(far, str):
                why = near if isinstance(near, str) else far
                yield Skipped(number.number.key, number.text, f"no mission beside it: {why}")
                continue
            ordered, weights = [here, near, far], (-1.5, 2.0, -0.5)
            yield self._slope(number, here, kind, ordered[::side], tuple(side * one for one in weights[::side]))

    def _slope(
        self, number: Stated, here: _Uses, kind: str, uses: Sequence[_Uses], weights: Sequence[float]
    ) -> Slope:
        """Slope for a number, by utilizations at rising values and their weights."""

        def change(values: Iterator[float]) -> float:
            return number.per / number.step * math.fsum(map(math.prod, zip(weights, values, strict=True)))

        return Slope(
            key=number.number.key,
            text=number.text,
            value=number.value,
            unit=number.number.dimension.si,
            per=number.per,
            per_text=number.per_text,
            measure=number.part,
            step=abs(number.step),
            difference=kind,
            change=change(use.worst for use in uses),
            row_change=None if self.row is None else change(use.row or 0.0 for use in uses),
            row_below=uses[0].worst_row,
            row_above=uses[-1].worst_row,
            is_mixed=any(use.is_passed for use in uses),
        )


# ---------------------------------------------------------------- numbers of the file
def stated_numbers(tree: dict[str, Any], nearest_m: float) -> tuple[list[Stated], list[Skipped]]:
    """Find every number of a mission file, in its order, and what is none; `tree` is what it says, as text.

    A place on the Earth changes by a part of the slant range of the nearer platform. [m]
    """
    numbers: list[Stated] = []
    skipped: list[Skipped] = []
    for key, reader, value, above in _leaves(MISSION, tree, (), None):
        if isinstance(reader, Triple):  # a scalar that stands for each axis
            reader = reader.component
        if key.endswith(".covariance"):  # a matrix: its elements do not change alone
            one = Number(key, FACTOR, 1.0, "")
            numbers.append(Stated(one, "its sigmas", 1.0, RELATIVE_STEP, 0.01, "1 %"))
        elif isinstance(reader, Quantity) and isinstance(value, str):
            found = _stated(as_number(key, reader, value), value, nearest_m, above)
            (numbers if isinstance(found, Stated) else skipped).append(found)  # type: ignore[arg-type]
        elif reason := _no_number(key, reader):
            skipped.append(Skipped(key, ", ".join(map(str, value if isinstance(value, list) else [value])), reason))
    return numbers, skipped


Leaf = tuple[str, Reader, Any, Mapping[str, Any] | None]


def _leaves(reader: Reader, value: Any, path: tuple[str, ...], above: Mapping[str, Any] | None) -> Iterator[Leaf]:
    """Go through all that a file says: key, reader and value; of shares all of them."""
    reader = form_of(reader, value)
    parts: Sequence[tuple[str, Any]] = ()
    if isinstance(value, dict):
        parts = list(value.items())
    elif isinstance(value, list) and isinstance(reader, ListOf | Triple):
        parts = [(str(index), item) for index, item in enumerate(value)]
    below = [(name, reader.below(name), item) for name, item in parts]
    if not any(inner for _, inner, _ in below):
        if value is not INVALID:
            yield ".".join(path), reader, value, above
        return
    for name, inner, item in below:
        if inner is not None:
            yield from _leaves(inner, item, (*path, name), value if reader is SHARES else None)


def _stated(number: Number, text: str, nearest_m: float, shares: Mapping[str, Any] | None) -> Stated | Skipped:
    value = number.value or 0.0
    if number.reader is LATITUDE or number.key.endswith("longitude"):
        step = RELATIVE_STEP * nearest_m / _EARTH
        return Stated(number, text, value, step, step, f"{math.degrees(step):.2g} deg")
    if number.reader in (DIRECTION, ELEVATION):
        return Stated(number, text, value, DIRECTION_STEP, math.radians(1), "1 deg", part=math.radians(1))
    if number.dimension in units.LEVELS:
        return Stated(number, text, value, LEVEL_STEP, 1.0, "1 dB", part=math.log(10) / 10)
    if value == 0:
        return Skipped(number.key, text, "is 0: there is no part of it")
    step = RELATIVE_STEP * value
    others: tuple[Number, ...] = ()
    if shares is not None:
        place, _, own = number.key.rpartition(".")
        others = tuple(
            as_number(f"{place}.{name}", number.reader, share) for name, share in shares.items() if name != own
        )
        if value == 1:
            return Skipped(number.key, text, "is the whole: no other share could give what it takes")
    return Stated(number, text, value, step, 0.01 * value, "1 %", others=others)


def _no_number(key: str, reader: Reader) -> str:
    """Say what a key holds instead of a number; empty for names and remarks, which change nothing."""
    kinds = (
        ("is a whole number", isinstance(reader, Whole | Version)),
        ("is a choice", isinstance(reader, Choice)),
        ("is a part of the catalogue; solve --for compares parts", "sensor" in key.split(".")),
        ("is an instant", key == "collection.center_time"),
        ("is a matrix: its elements do not change alone", key.endswith(".correlation")),
    )
    return next((words for words, is_so in kinds if is_so), "")


# ---------------------------------------------------------------- shares that follow what is declared
def relaxed_errors(mission: Mission, found: JudgedMission, today: date) -> Iterator[Relaxed]:
    """Double one declared error after the other, and see what that leaves to the others; `found` is without that."""
    for key in _declared_errors(mission):
        try:
            doubled = scaled(mission, key, _RELAXED)
        except QuestionError:  # all of it is 0
            continue
        after = judged_mission(Analysis(doubled), today)
        yield Relaxed(
            key=key,
            shares_before=_shares(found),
            shares_after=_shares(after),
            transmitter=_of_others("transmitter", found.rows, after.rows),
            receiver=_of_others("receiver", found.rows, after.rows),
        )


def _declared_errors(mission: Mission) -> Iterator[str]:
    """Keys of the declared errors: of each platform by kind, with those of parts of the catalogue."""
    sections: list[tuple[str, Any, Sequence[str], int]] = []  # key, section, its keys, and how many a list has
    for name in PLATFORMS:
        error, key = getattr(mission.platforms, name).motion_error, f"platforms.{name}.motion_error"
        sections.append((key, error, ("covariance", *MOTION, "vibration"), 0))
        if error.imu is not None:
            sections.append((f"{key}.imu", error.imu, [one for one in error.imu._fields if one != "source"], 0))
        sections.append((f"{key}.random", None, (), len(error.random)))
        sections.append((key, error, ("time_tag",), 0))
        sections.append((f"{key}.lever_arm", error.lever_arm, ("uncertainty",), 0))
    common, air = mission.common_motion_error, mission.propagation
    sections.append(("common_motion_error", common, (*MOTION, "time_tag"), 0))
    sections.append(("common_motion_error.random", None, (), 0 if common is None else len(common.random)))
    sections.append(("timing_error", mission.timing_error, mission.timing_error._fields, 0))
    sections.append(("propagation", air, (*PLATFORMS, *DELAYS), 0))
    sections.append(("other_errors", None, (), len(mission.other_errors)))
    for key, section, names, count in sections:
        yield from (f"{key}.{name}" for name in names if getattr(section, name, None) is not None)
        yield from (f"{key}.{index}" for index in range(count))


def _shares(found: JudgedMission) -> tuple[float, float]:
    split = found.analysis.allocation.qpe
    return split.transmitter, split.receiver


def _of_others(owner: str, before: Sequence[Judged], after: Sequence[Judged]) -> tuple[str, float, float] | None:
    """Worst utilization of a platform, before and after, of judged rows whose declared value stays as it is."""
    now, kept = {row.subject.id: row for row in after}, []
    for row in before:
        was, then = float(row.utilization[0]), now.get(row.subject.id)
        is_owed = row.subject.owner in (owner, "clock" if owner == "receiver" else owner)
        if then is None or not is_owed or not math.isfinite(was) or not IS_JUDGED[row.status[0]]:
            continue
        old, new = np.nan_to_num([row.declared[0], then.declared[0]])
        if abs(new - old) <= _SAME * abs(old):
            kept.append((float(np.nan_to_num(then.utilization[0])), row.subject.id, was))
    use, row_id, _ = max(kept, default=(math.inf, "", 0.0))
    if not math.isfinite(use):
        return None
    return row_id, max(was for _, _, was in kept), use
