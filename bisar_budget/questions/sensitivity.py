"""Sensitivity of the worst utilization to each number of a mission, from differences between full checks.

Each number that the file states, or takes from a catalogue part, is changed alone, and all cases are checked
together. If the shares of the budget are balanced, that is in proportion to the declared errors, each error is also
doubled, to show how much the allowables of the other errors shrink. Values are in SI and radians.
"""

import datetime as dt
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from datetime import date
from typing import NamedTuple

import numpy as np

from bisar_budget import units
from bisar_budget.analysis.allocation import is_balanced
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.budget.judged_mission import JudgedMission, judged_mission
from bisar_budget.budget.judged_requirements import IS_JUDGED
from bisar_budget.budget.judged_rows import Judged
from bisar_budget.effects.effect import MOTION, PLATFORMS
from bisar_budget.error_kinds.clock_kinds import TIMING_KIND
from bisar_budget.error_kinds.path_kinds import TIME_TAG_KIND
from bisar_budget.faults import SetValue
from bisar_budget.findings.requirement import Outside
from bisar_budget.findings.slopes import Relaxed, Sensitivity, Skipped, Slope
from bisar_budget.json_types import JsonObject
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
from bisar_budget.mission.tree import Content
from bisar_budget.questions.outside import influences_of
from bisar_budget.questions.progress import watched_checks
from bisar_budget.questions.results import SensitivityResult
from bisar_budget.questions.table import Question, Table, Variation, hold_to_decisions, standing
from bisar_budget.questions.varied import scaled
from bisar_budget.workers import Progress, unseen

_UTILIZATION_ROUNDING_FRACTION = 1e-9  # of a utilization; a smaller difference of checks is a rounding error
_RELAXED_FACTOR = 2.0  # factor by which an error is relaxed
_EQUAL_FRACTION = 1e-9  # of a declared value; a smaller difference is a rounding error
# Half the width of a central difference, as a fraction h of the number. For a power law with the exponent p the slope
# is wrong by the fraction (p - 1)(p - 2)h²/6, which is 2e-4 for p = -2. Allowables from exact ranges are within 1e-5
# of a limit, which is 1e-3 of a change by 1 %.
DIFFERENCE_STEP_FRACTION = 0.01
# With these steps the slopes are wrong by the fraction 3e-6 for sines, and 1.4e-4 for decibels.
DIRECTION_STEP = math.radians(0.25)
LEVEL_STEP = 0.25  # dB
_EARTH_RADIUS_M = 6.371e6  # mean radius


# ---------------------------------------------------------------- results


# ---------------------------------------------------------------- differences
class Stated(NamedTuple):
    """A number of the mission file that the sensitivity analysis varies; `text` is the number as written in the file.

    A central difference extends from `step` below the value to `step` above it. `per` is the increase, in SI, for
    which effects are given, and `per_text` is the same increase as text. `part` is this increase as a dimensionless
    ratio, with the same references as `Slope.measure`. `others` are further numbers that change with this number.
    For a share of a budget, these are all remaining shares, because the shares sum to 1. For a covariance, the
    number is a factor by which all sigmas are multiplied.
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
        """Compute the new values of this number and of the numbers that change with it, when it is set to `value`."""
        remainder = 1 - self.value
        further = {share: (share.value or 0.0) * (1 - value) / remainder for share in self.others}
        return {self.number: value, **further}


def sensitivity(
    mission: Mission,
    *,
    row: str | None = None,
    model: str | None = None,
    date: str | dt.date | None = None,
    outside: Outside | None = None,
) -> SensitivityResult:
    """Rank the numbers in a mission by their effects on its worst utilization, or on the utilization of `row`.

    All numbers that the file states or takes from a part are considered. Each is changed alone, in both directions,
    and the mission is checked again in full, so that no effect is left out. Effects are given for a change by 1 % of
    the number, by a degree for directions, by a decibel for levels, and by 1 % of the smaller slant range for
    latitudes and longitudes. An effect is a change of utilization; 0.01 is 1 % of a limit. The number that uses up
    the margin with the smallest change comes first. For this comparison, changes are expressed as dimensionless
    ratios; see `Slope.measure`. The arguments have the same meaning as for `solve`.

    Raises
    ------
    QuestionError
        No error is declared or judged, the row is unknown, or a part can no longer be read.
    """
    today, influences = influences_of(mission, model, date, outside)
    variation = Variation(mission, model)
    base = variation.read()
    if taken := base.taken:  # a mission whose file states the figures of its parts
        stated = variation.read([SetValue(figure.key, json.dumps(figure.value)) for figure in taken])
        variation = Variation(stated, model)
        base = variation.read()
    judged = judged_mission(Analysis(base), today)
    hold_to_decisions([judged], row)
    mission_standing = standing(judged, None, frozenset())
    nearest = min(path.slant_range for path in judged.analysis.geometry.both)
    numbers, skipped = stated_numbers(tree_of(variation.mission), float(nearest))
    neighbours = _Neighbours(variation, numbers, mission_standing.row, row, today)
    at_file = neighbours.uses([(None, 0)])[0] if mission_standing.row else ""
    if isinstance(at_file, str):
        raise QuestionError("no utilization that is judged has a value: there is nothing to follow")
    slopes, unchanging = [], []
    with watched_checks(mission.name) as progress:
        found_slopes = list(neighbours.slopes(at_file, progress))
    for slope in found_slopes:
        if isinstance(slope, Skipped):
            skipped.append(slope)
        elif max(abs(slope.change), abs(slope.row_change or 0.0)) <= _UTILIZATION_ROUNDING_FRACTION * max(
            at_file.worst, at_file.row or 0.0
        ):
            unchanging.append(slope.key)
        else:
            part_names = (figure.part for figure in taken if f"{slope.key}.".startswith(f"{figure.key}."))
            slopes.append(slope._replace(part=next(part_names, "")))
    slopes.sort(key=lambda slope: -abs(slope.even_effect))
    balanced = is_balanced(base)
    effects = Sensitivity(
        file=mission.file,
        name=mission.name,
        model=base.gating_model,
        status=mission_standing.status,
        worst_row=at_file.worst_row,
        requirement=at_file.requirement,
        utilization=at_file.worst,
        row=row,
        row_utilization=at_file.row,
        slopes=tuple(slopes),
        unchanging=tuple(unchanging),
        skipped=tuple(skipped),
        is_balanced=balanced,
        relaxed=tuple(relaxed_errors(base, judged, today)) if balanced else (),
        changes=mission.changes,
        overrides=influences,
    )
    return SensitivityResult(effects)


class _Uses(NamedTuple):
    """Utilizations of a mission in one case, in which one of its numbers may be changed.

    `worst` is the worst utilization of all rows. It is the utilization of the row `worst_row`, whose limit is set by
    `requirement`. `row` is the utilization of the requested row; None if no row is requested. `of_worst` is the
    utilization, in this case, of the row that is worst with the unchanged numbers of the file.
    """

    worst_row: str
    requirement: str
    worst: float
    row: float | None
    of_worst: float

    @property
    def is_passed(self) -> bool:
        """Whether another row is now worse than the row that is worst with the unchanged numbers of the file.

        Rounding differences are ignored.
        """
        return self.worst - self.of_worst > _UTILIZATION_ROUNDING_FRACTION * self.worst


class _Neighbours:
    """Checks of a mission with one number changed by one or two steps, and the slopes that follow from them."""

    def __init__(
        self, variation: Variation, numbers: Sequence[Stated], worst: str | None, row: str | None, today: date
    ) -> None:
        self.numbers, self.row, self.worst = numbers, row, worst
        varied = {changed.key: changed for number in numbers for changed in number.at(number.value)}
        self.values = {number.key: number.value for number in varied.values()}
        mission, names = variation.mission, dict.fromkeys(name for name in (worst, row) if name is not None)
        columns = tuple(f"{name}.utilization" for name in names)
        asked = Question.of(mission, list(varied), variation.model, today, columns=columns, target="")
        self.table = Table(asked, mission, tuple(varied.values()))

    def uses(self, cases: Sequence[tuple[Stated | None, int]], progress: Progress = unseen) -> list[_Uses | str]:
        """Check the mission in several cases, in each of which one number is changed.

        A case is a pair of the changed number and the number of steps, negative for a decrease. The case (None, 0) is
        the mission of the file. Returns the utilizations of each case, or the reason why the mission is invalid or
        has no utilization.
        """
        values = {key: np.full(len(cases), value) for key, value in self.values.items()}
        for case, (number, steps) in enumerate(cases):
            if number is not None:
                for changed, value in number.at(number.value + steps * number.step).items():
                    values[changed.key][case] = value
        columns = self.table.watched(values, progress)
        texts = ("worst_row", "binding_requirement", "reason")
        followed = [
            columns[f"{name}.utilization"] if name else [None] * len(cases) for name in (self.row, self.worst)
        ]
        uses: list[_Uses | str] = []
        for line in zip(*(columns[name] for name in texts), columns["utilization"].tolist(), *followed, strict=True):
            worst_row, requirement, reason, worst, row, of_worst = line
            if not reason and (not math.isfinite(worst) or (row is not None and not math.isfinite(row))):
                reason = "no utilization has a value there"
            case_uses = _Uses(worst_row, requirement, worst, row, 0.0 if math.isnan(of_worst) else of_worst)
            uses.append(reason or case_uses)
        return uses

    def slopes(self, here: _Uses, progress: Progress) -> Iterator[Slope | Skipped]:
        """Yield the slope of the utilization for each number, from a central difference if possible.

        If the mission is invalid on one side of the value, the difference is one-sided. `here` are the utilizations
        with the unchanged numbers of the file.
        """
        sides = [(number, side) for number in self.numbers for side in (-1, 1)]
        checked = iter(self.uses(sides, progress) if sides else ())
        both = [(next(checked), next(checked)) for _ in self.numbers]
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
            # A one-sided difference of second order, like the central one.
            side, kind, near = (1, "forward", above) if isinstance(below, str) else (-1, "backward", below)
            far = at_two[number, 2 * side]
            if isinstance(near, str) or isinstance(far, str):
                why = near if isinstance(near, str) else far
                yield Skipped(number.number.key, number.text, f"no mission beside it: {why}")
                continue
            ordered, weights = [here, near, far], (-1.5, 2.0, -0.5)
            yield self._slope(number, here, kind, ordered[::side], tuple(side * weight for weight in weights[::side]))

    def _slope(
        self, number: Stated, here: _Uses, kind: str, uses: Sequence[_Uses], weights: Sequence[float]
    ) -> Slope:
        """Compute the slope of the utilization with respect to a number, as a weighted sum of utilizations.

        `uses` are the utilizations at ascending values of the number, and `here` are the utilizations with the
        unchanged numbers of the file. `kind` is the kind of difference: `central`, `forward` or `backward`.
        """

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
def stated_numbers(tree: JsonObject, nearest_m: float) -> tuple[list[Stated], list[Skipped]]:
    """Find all numbers of a mission file that can be varied, and the keys that are skipped.

    Both are in the order of the file. `tree` is the content of the file, as strings, lists and mappings. A latitude
    or longitude is changed by a fraction of `nearest_m` [m], the slant range of the nearer platform.
    """
    numbers: list[Stated] = []
    skipped: list[Skipped] = []
    for key, reader, value, above in _leaves(MISSION, tree, (), None):
        if isinstance(reader, Triple):  # a scalar that holds for each axis
            reader = reader.component
        if key.endswith(".covariance"):  # the elements of a matrix do not change alone
            factor = Number(key, FACTOR, 1.0, "")
            numbers.append(Stated(factor, "its sigmas", 1.0, DIFFERENCE_STEP_FRACTION, 0.01, "1 %"))
        elif isinstance(reader, Quantity) and isinstance(value, str):
            stated = _stated(as_number(key, reader, value), value, nearest_m, above)
            (numbers if isinstance(stated, Stated) else skipped).append(stated)  # type: ignore[arg-type]
        elif reason := _no_number(key, reader):
            skipped.append(Skipped(key, ", ".join(map(str, value if isinstance(value, list) else [value])), reason))
    return numbers, skipped


Leaf = tuple[str, Reader[object], Content, Mapping[str, object] | None]


def _leaves(reader: Reader[object], value: object, path: tuple[str, ...], above: JsonObject | None) -> Iterator[Leaf]:
    """Yield the key, the reader, the value and the shares of every leaf in the tree of a mission file.

    If the leaf is the share of a budget, its shares are all shares in the same section, including the leaf itself.
    For any other leaf, the shares are None.
    """
    reader = form_of(reader, value)
    children: Sequence[tuple[str, object]] = ()
    if isinstance(value, dict):
        children = list(value.items())
    elif isinstance(value, list) and isinstance(reader, ListOf | Triple):
        children = [(str(index), item) for index, item in enumerate(value)]
    below = [(name, reader.below(name), item) for name, item in children]
    if not any(inner for _, inner, _ in below):
        if value is not INVALID:
            yield ".".join(path), reader, value, above
        return
    for name, inner, item in below:
        if inner is not None:
            shares = value if reader is SHARES and isinstance(value, dict) else None
            yield from _leaves(inner, item, (*path, name), shares)


def _stated(number: Number, text: str, nearest_m: float, shares: Mapping[str, object] | None) -> Stated | Skipped:
    """Choose the step by which a number is varied, or return the reason why the number cannot be varied.

    `shares` holds all shares in the same section of the file as the number; it is None if the number is not a share.
    """
    value = number.value or 0.0
    if number.reader is LATITUDE or number.key.endswith("longitude"):
        step = DIFFERENCE_STEP_FRACTION * nearest_m / _EARTH_RADIUS_M
        return Stated(number, text, value, step, step, f"{math.degrees(step):.2g} deg")
    if number.reader in (DIRECTION, ELEVATION):
        return Stated(number, text, value, DIRECTION_STEP, math.radians(1), "1 deg", part=math.radians(1))
    if number.dimension in units.LEVELS:
        return Stated(number, text, value, LEVEL_STEP, 1.0, "1 dB", part=math.log(10) / 10)
    if value == 0:
        return Skipped(number.key, text, "is 0: there is no part of it")
    step = DIFFERENCE_STEP_FRACTION * value
    further_shares: tuple[Number, ...] = ()
    if shares is not None:
        section, _, share_name = number.key.rpartition(".")
        further_shares = tuple(
            as_number(f"{section}.{name}", number.reader, share)
            for name, share in shares.items()
            if name != share_name
        )
        if value == 1:
            return Skipped(number.key, text, "is the whole: no other share could give what it takes")
    return Stated(number, text, value, step, 0.01 * value, "1 %", others=further_shares)


def _no_number(key: str, reader: Reader[object]) -> str:
    """Explain why the value at a key of the mission file is not varied.

    The result is empty for names and remarks, which have no effect on the verdict.
    """
    kinds = (
        ("is a whole number", isinstance(reader, Whole | Version)),
        ("is a choice", isinstance(reader, Choice)),
        ("is a part of the catalogue; solve --for compares parts", "sensor" in key.split(".")),
        ("is an instant", key == "collection.center_time"),
        ("is a matrix: its elements do not change alone", key.endswith(".correlation")),
    )
    return next((words for words, is_so in kinds if is_so), "")


# ---------------------------------------------------------------- shares that follow the declared errors
def relaxed_errors(mission: Mission, judged: JudgedMission, today: date) -> Iterator[Relaxed]:
    """Yield, for each declared error, the effect that doubling this error has on the other errors.

    `judged` is the judged mission with the errors as declared. Errors of size 0 are left out.
    """
    for key in _declared_errors(mission):
        try:
            doubled = scaled(mission, key, _RELAXED_FACTOR)
        except QuestionError:  # the error is 0
            continue
        after = judged_mission(Analysis(doubled), today)
        yield Relaxed(
            key=key,
            shares_before=_shares(judged),
            shares_after=_shares(after),
            transmitter=_of_others("transmitter", judged.rows, after.rows),
            receiver=_of_others("receiver", judged.rows, after.rows),
        )


def _declared_errors(mission: Mission) -> Iterator[str]:
    """Yield the key of every declared error of a mission, including errors whose values come from catalogue parts."""
    sections: list[tuple[str, object, Sequence[str], int]] = []  # key, section, its keys, and the length of a list
    for name in PLATFORMS:
        error, key = getattr(mission.platforms, name).motion_error, f"platforms.{name}.motion_error"
        sections.append((key, error, ("covariance", *MOTION, "vibration"), 0))
        if error.imu is not None:
            sections.append(
                (f"{key}.imu", error.imu, [figure for figure in error.imu._fields if figure != "source"], 0)
            )
        sections.append((f"{key}.random", None, (), len(error.random)))
        sections.append((key, error, (TIME_TAG_KIND.name,), 0))
        sections.append((f"{key}.lever_arm", error.lever_arm, ("uncertainty",), 0))
        yield from (f"{key}.registered.{kind}" for kind in error.registered)
    common, air = mission.common_motion_error, mission.propagation
    sections.append(("common_motion_error", common, (*MOTION, TIME_TAG_KIND.name), 0))
    sections.append(("common_motion_error.random", None, (), 0 if common is None else len(common.random)))
    sections.append(("timing_error", mission.timing_error, tuple(TIMING_KIND.sizes), 0))
    sections.append(("propagation", air, (*PLATFORMS, *DELAYS), 0))
    sections.append(("other_errors", None, (), len(mission.other_errors)))
    for key, section, names, count in sections:
        yield from (f"{key}.{name}" for name in names if getattr(section, name, None) is not None)
        yield from (f"{key}.{index}" for index in range(count))


def _shares(judged: JudgedMission) -> tuple[float, float]:
    """Return the shares of the quadratic-phase requirement that are allotted to transmitter and receiver."""
    split = judged.analysis.allocation.qpe
    return split.transmitter, split.receiver


def _of_others(owner: str, before: Sequence[Judged], after: Sequence[Judged]) -> tuple[str, float, float] | None:
    """Find the worst row of a platform after an error is doubled, and the highest utilization before and after.

    Returns the id of the worst row, the highest utilization of the platform before the doubling, and the highest
    utilization after it. Only judged rows whose own error is unchanged are included. Returns None if there is no such
    row.
    """
    now, kept = {row.subject.id: row for row in after}, []
    for row in before:
        was, then = float(row.utilization[0]), now.get(row.subject.id)
        is_owed = row.subject.owner in (owner, "clock" if owner == "receiver" else owner)
        if then is None or not is_owed or not math.isfinite(was) or not IS_JUDGED[row.status[0]]:
            continue
        old, new = np.nan_to_num([row.declared[0], then.declared[0]])
        if abs(new - old) <= _EQUAL_FRACTION * abs(old):
            kept.append((float(np.nan_to_num(then.utilization[0])), row.subject.id, was))
    use, row_id, _ = max(kept, default=(math.inf, "", 0.0))
    if not math.isfinite(use):
        return None
    return row_id, max(was for _, _, was in kept), use
