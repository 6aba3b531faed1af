"""Rows about vibration of many cases: those of `vibration_rows`, case by case, a tenth of the work of a check.

They depend on the wavelength, the aperture time, the lines of sight and the shares alone.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.analysis.allocation import Allocation
from bisar_budget.arrays.collections import Floats
from bisar_budget.arrays.rows import REQUIREMENTS, Judged
from bisar_budget.budget.vibration_rows import vibration_rows
from bisar_budget.effects.slow_vibration import slow_phases
from bisar_budget.findings.status import RANK
from bisar_budget.mission.model import Mission


class ManyOwnPhases(NamedTuple):
    """What has no displacement, but phases that count in sums, (cases,); as `OwnPhase`. [rad]"""

    row_id: str
    owner: str
    qpe: Floats
    cubic: Floats


def many_slow_phases(count: int, one: Callable[[int], Mission]) -> list[ManyOwnPhases]:
    """Phases of slow vibrations in `count` cases, 0 where one is faster; `one` gives the mission of a case."""
    found: dict[str, ManyOwnPhases] = {}
    for place in range(count):
        for phase in slow_phases(one(place)):
            if phase.row_id not in found:
                found[phase.row_id] = ManyOwnPhases(phase.row_id, phase.owner, np.zeros(count), np.zeros(count))
            found[phase.row_id].qpe[place] = phase.qpe_rad
            found[phase.row_id].cubic[place] = phase.cubic_rad
    return list(found.values())


def judged_vibrations(
    cases: NDArray[np.intp], count: int, one: Callable[[int], tuple[Mission, Allocation]], model: str
) -> list[Judged]:
    """Judge the vibrations of some of `count` cases by a model; a row that a case does not have is not declared.

    `one` gives the mission of a case, with its numbers, and its shares.
    """
    found: dict[str, Judged] = {}
    for place in cases.tolist():
        for row in vibration_rows(*one(place), model):
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
            ):
                array[place] = math.nan if value is None else value
    return list(found.values())
