"""Shares of the phase in many cases: the arrays beside `analysis.allocation`."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from bisar_budget.analysis.allocation import BALANCED_RANGE, EQUAL, Split, allocate
from bisar_budget.effects.combined import combined_phase, many_correlated
from bisar_budget.effects.declared import DeclaredErrors
from bisar_budget.effects.vibration import OwnPhase
from bisar_budget.mission.model import MetricSplits, Mission
from bisar_budget.ranges.exact_ranges import Floats


def is_balanced(mission: Mission) -> bool:
    """Whether shares of the phase follow from what is declared."""
    split = mission.allocation.split
    return (split.quadratic_phase_error if isinstance(split, MetricSplits) else split) == "balanced"


def shares_of(errors: DeclaredErrors, models: Sequence[str], own: Sequence[Sequence[OwnPhase]]) -> Split:
    """Divide the budget for the phase; `balanced` shares are arrays.

    Parameters
    ----------
    errors : DeclaredErrors
        Of the cases.
    models : sequence of str
        Those that gate.
    own : sequence of sequences of OwnPhase
        Phases of what displaces nothing, by each of these models.
    """
    mission = errors.mission
    if not is_balanced(mission):
        return allocate(mission, (), {}).qpe
    weights = []
    for owner in ("transmitter", "receiver"):
        members = [
            (error.subject.id, _largest([errors.does(model, error).qpe for model in models]))
            for error in errors.stated
            if EQUAL.includes(error.subject.owner, owner)
        ]
        members += [
            (of_one[0].row_id, _largest([one.qpe_rad for one in of_one]))
            for of_one in zip(*own, strict=True)
            if EQUAL.includes(of_one[0].owner, owner)
        ]
        combined = combined_phase(members, mission.allocation.combine, many_correlated(mission))
        weights.append(np.minimum(errors.array(combined), 1e300))
    total = weights[0] + weights[1]
    with np.errstate(all="ignore"):
        share: Any = np.where(total == 0, 0.5, np.clip(weights[0] / total, *BALANCED_RANGE))
    return Split(transmitter=share, receiver=1 - share)


def _largest(phases: Sequence[Floats]) -> Floats:
    """The phase with the largest magnitude, signed. [rad]"""
    of_all = np.array(phases)
    largest = np.abs(of_all).argmax(axis=0)
    return np.asarray(np.take_along_axis(of_all, largest[None], axis=0)[0])
