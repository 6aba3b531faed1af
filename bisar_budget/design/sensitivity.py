"""What each number of a mission does to its worst utilization, by differences of whole checks."""

import json
import math
from collections.abc import Mapping, Sequence
from datetime import date
from typing import NamedTuple

from bisar_budget.analysis.allocation import is_balanced
from bisar_budget.budget.check import check_mission
from bisar_budget.design.quantities import QuestionError, tree_of
from bisar_budget.design.relaxing import relaxed_errors
from bisar_budget.design.scaled import scaled
from bisar_budget.design.slopes import Sensitivity, Slope
from bisar_budget.design.stated import Skipped, Stated, stated_numbers
from bisar_budget.design.variation import Variation, deciding_row, hold_to_decisions
from bisar_budget.faults import MissionError, SetValue
from bisar_budget.findings.row import Row
from bisar_budget.mission.model import Mission
from bisar_budget.mission.parts import taken_figures
from bisar_budget.workers import Progress, unseen

_BREAKS = ("fail",)
_NOTHING = 1e-9  # of a utilization: what rounding leaves of a check


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
    smaller slant range.

    Parameters
    ----------
    mission : Mission
        As loaded; the file that it came from is read anew for each value, with the options that changed it.
    row : str, optional
        Id of a row whose utilization is followed too.
    model : str, optional
        Gating model in place of the mission's own.
    today : date
        Day on which waivers are judged, UTC.
    progress : callable, optional
        Is told, after each number, how many are done, and how many there are.

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
    variation, of_parts = _stating_its_parts(Variation(mission, model))
    base = variation.read()
    found = check_mission(base, today, is_brief=True, is_bare=True)
    hold_to_decisions([found], row)
    at_file = _uses(found.rows, row)
    if at_file is None:
        raise QuestionError("no utilization that is judged has a value: there is nothing to follow")
    geometry = found.geometry
    nearest = min(geometry.transmitter.slant_range, geometry.receiver.slant_range)
    numbers, skipped = stated_numbers(tree_of(variation.mission), nearest)
    slopes, unchanging = [], []
    for done, number in enumerate(numbers, 1):
        slope = _Differences(variation, base, number, row, today).slope(at_file)
        progress(done, len(numbers))
        if isinstance(slope, Skipped):
            skipped.append(slope)
        elif max(abs(slope.change), abs(slope.row_change or 0.0)) <= _NOTHING * max(
            at_file.worst, at_file.row or 0.0
        ):
            unchanging.append(slope.key)
        else:
            slopes.append(slope._replace(part=_part_of(slope.key, of_parts)))
    slopes.sort(key=lambda slope: -abs(slope.even_effect))
    balanced = is_balanced(base)
    return Sensitivity(
        file=mission.file,
        name=mission.name,
        model=base.gating_model,
        status=found.status,
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


def _stating_its_parts(variation: Variation) -> tuple[Variation, Mapping[str, str]]:
    """The same mission as if its file stated the figures that it takes from parts; the part by the key of each."""
    mission = variation.read()
    taken = list(taken_figures(mission))
    if not taken:
        return variation, {}
    stated = variation.read([SetValue(one.key, json.dumps(one.value)) for one in taken])
    return Variation(stated, variation.model), {one.key: one.part for one in taken}


def _part_of(key: str, of_parts: Mapping[str, str]) -> str:
    return next((part for figure, part in of_parts.items() if f"{key}.".startswith(f"{figure}.")), "")


class _Uses(NamedTuple):
    """The worst utilization, whose it is, that of the row that was asked for, and of all rows."""

    worst_row: str
    requirement: str
    worst: float
    row: float | None
    of: Mapping[str, float]

    def is_passed(self, row_id: str) -> bool:
        """Whether another row than this one is the worst, by more than rounding."""
        return self.worst - self.of.get(row_id, 0.0) > _NOTHING * self.worst


def _uses(rows: Sequence[Row], asked: str | None) -> _Uses | None:
    """Utilizations of a check; None where one of them has no value."""
    worst = deciding_row(rows, _BREAKS, complies=True)
    if worst is None or worst.utilization is None or not math.isfinite(worst.utilization):
        return None
    of = {row.id: row.utilization for row in rows if row.utilization is not None}
    use = None if asked is None else of.get(asked, math.inf)
    if use == math.inf:
        return None
    return _Uses(worst.id, worst.binding_requirement or worst.metric, worst.utilization, use, of)


class _Differences:
    """One number of a mission, and checks at values beside it."""

    def __init__(self, variation: Variation, base: Mission, number: Stated, row: str | None, today: date) -> None:
        self.variation, self.base, self.number, self.row, self.today = variation, base, number, row, today

    def slope(self, here: _Uses) -> Slope | Skipped:
        """Take the difference to both sides, or to the one side where there is a mission."""
        number = self.number
        below, above = self._at(-1), self._at(1)
        kind = "central"
        places = [(-1, below), (1, above)]
        weights: tuple[float, ...] = (-0.5, 0.5)
        if isinstance(below, str) or isinstance(above, str):
            side = 1 if isinstance(below, str) else -1
            kind = "forward" if side == 1 else "backward"
            # To second order, as the central one.
            places = [(0, here), (side, above if side == 1 else below), (2 * side, self._at(2 * side))]
            weights = (-1.5 * side, 2.0 * side, -0.5 * side)
        uses = []
        for _, use in places:
            if isinstance(use, str):
                return Skipped(number.number.key, number.text, f"no mission beside it: {use}")
            uses.append(use)
        ends = [
            use for _, use in sorted(zip((place for place, _ in places), uses, strict=True), key=lambda one: one[0])
        ]
        scale = number.per / number.step
        in_row = [use.row for use in uses if use.row is not None]
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
            change=scale * _sum(weights, [use.worst for use in uses]),
            row_change=None if self.row is None else scale * _sum(weights, in_row),
            row_below=ends[0].worst_row,
            row_above=ends[-1].worst_row,
            is_mixed=any(use.is_passed(here.worst_row) for use in uses),
        )

    def _at(self, steps: int) -> "_Uses | str":
        """Check the mission some steps aside; why there is none as text."""
        number = self.number
        value = number.value + steps * number.step
        try:
            if number.is_scale:
                mission = scaled(self.base, number.number.key, value)
            else:
                mission = self.variation.at(number.at(value))
        except MissionError as error:
            fault = error.faults[0]
            return f"{fault.key}: {fault.problem}"
        uses = _uses(check_mission(mission, self.today, is_brief=True, is_bare=True).rows, self.row)
        return "no utilization has a value there" if uses is None else uses


def _sum(weights: Sequence[float], values: Sequence[float]) -> float:
    return math.fsum(weight * value for weight, value in zip(weights, values, strict=True))
