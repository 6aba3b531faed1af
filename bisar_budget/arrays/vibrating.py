"""Rows about vibration of many cases: those of `vibration_rows`, case by case, a tenth of the work of a check.

They depend on the wavelength, the aperture time, the lines of sight and the shares alone.
"""

import math
from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from bisar_budget.analysis.spread import tones
from bisar_budget.arrays.rows import REQUIREMENTS, Judged
from bisar_budget.arrays.together import ManyOwnPhases
from bisar_budget.effects.models import QUADRATIC
from bisar_budget.effects.slow_vibration import slow_phases
from bisar_budget.effects.subject import Subject
from bisar_budget.findings.row import Row
from bisar_budget.findings.status import RANK
from bisar_budget.mission.model import Mission
from bisar_budget.ranges.exact_ranges import Floats


def many_slow_phases(count: int, one: Callable[[int], Mission]) -> list[ManyOwnPhases]:
    """Phases of slow vibrations in `count` cases, 0 where one is faster; `one` gives the mission of a case."""
    found: dict[str, ManyOwnPhases] = {}
    for place in range(count):
        for phase in slow_phases(one(place)):
            if phase.row_id not in found:
                nothing = (np.zeros(count), np.zeros(count), np.zeros(count, dtype=bool))
                found[phase.row_id] = ManyOwnPhases(phase.row_id, phase.owner, *nothing, moves=np.zeros(count))
            of_row = found[phase.row_id]
            of_row.moves[place] = phase.moves
            of_row.qpe[place], of_row.cubic[place], of_row.is_there[place] = phase.qpe_rad, phase.cubic_rad, True
    return list(found.values())


def many_tones(count: int, one: Callable[[int], Mission]) -> dict[Subject, Floats]:
    """Peak phases of tones in `count` cases, NaN where one has no echoes; `one` gives the mission of a case. [rad]"""
    found: dict[Subject, Floats] = {}
    for place in range(count):
        for tone in tones(one(place)):
            found.setdefault(tone.subject, np.full(count, math.nan))[place] = tone.phase
    return found


def _quadratic_use(row: Row) -> float | None:
    """Quadratic phase of a slow vibration over its limit."""
    if row.declared is None or row.metric != QUADRATIC or row.allowable_full is None:
        return None
    return row.declared / row.allowable_full


def judged_one_by_one(cases: NDArray[np.intp], count: int, rows_of: Callable[[int], Iterable[Row]]) -> list[Judged]:
    """Rows of some of `count` cases as `check` judges them; one that a case does not have is not declared."""
    found: dict[str, Judged] = {}
    for place in cases.tolist():
        for row in rows_of(place):
            if row.id not in found:
                found[row.id] = Judged.of_none(row.subject, count)
            judged = found[row.id]
            judged.status[place] = RANK[row.status]
            judged.binding[place] = REQUIREMENTS.index(row.binding_requirement or row.metric)
            for array, value in (
                (judged.declared, row.declared),
                (judged.allowable, row.allowable),
                (judged.utilization, row.utilization),
                (judged.qpe_published_rad, row.qpe_published_rad),
                (judged.cubic_rad, row.cubic_rad),
                (judged.quadratic_use, _quadratic_use(row)),
            ):
                array[place] = math.nan if value is None else value
    return list(found.values())
