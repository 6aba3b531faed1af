"""Division of the budgets between transmitter, receiver and clock, and the gain of autofocus."""

import math
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from bisar_budget import evaluators
from bisar_budget.analysis.together import Together
from bisar_budget.effects.effect import plain
from bisar_budget.mission.model import MetricSplits, Mission, Shares
from bisar_budget.ranges.exact_ranges import Floats

BALANCED_RANGE = (0.05, 0.95)  # neither platform is left without a budget


EQUAL = Shares(transmitter=0.5, receiver=0.5)


class Allocation(NamedTuple):
    """The budgets as divided. `qpe_total` and limits in [rad], before autofocus; PSLR and ISLR share power.

    `n_pull` is what counts of the file's `autofocus.n_pull`, see `effective_n_pull`; `n_pull_stated` is the file's.
    """

    qpe_total: float
    qpe: Shares
    pslr: Shares
    islr: Shares
    n_pull: float | None
    n_pull_stated: float | None

    @property
    def autofocus_gain(self) -> Any:
        """Factor on QPE limits: π·N_pull over the total, never below 1 (Section VI; 4·N_pull for π/4)."""
        if self.n_pull is None:
            return 1.0
        gain = evaluators.autofocus_gain(self.n_pull, self.qpe_total)
        return gain * (gain > 1) + 1.0 * (gain <= 1)  # the larger one, of arrays too

    def qpe_limit(self, owner: str) -> float:
        """QPE that an owner may use, before autofocus. [rad]"""
        return self.qpe.of(owner) * self.qpe_total

    def of(self, case: int) -> "Allocation":
        """Those of one of many cases, in plain numbers."""
        qpe, pslr, islr = (Shares._make(_plain(share, case) for share in split) for split in self[1:4])
        total, n_pull, stated = (_plain(one, case) for one in (self.qpe_total, self.n_pull, self.n_pull_stated))
        return Allocation(total, qpe, pslr, islr, n_pull, stated)

    def n_pull_needed(self, qpe: float, owner: str) -> float:
        """Smallest N_pull that makes a QPE pass."""
        return qpe / (self.qpe.of(owner) * math.pi)


def _plain(number: Any, case: int) -> Any:
    return None if number is None else plain(number, case)


def range_walk_cap(mission: Mission) -> float:
    """Largest N_pull that counts, f₀/B; a number, or an array of many cases.

    A phase of π·N at the aperture edge walks N·B/2f₀ range cells, of which correction along one dimension takes half
    a cell (`budget.pull_in`).
    """
    return mission.radar.center_frequency / mission.radar.bandwidth


def effective_n_pull(mission: Mission) -> float | None:
    """N_pull that autofocus counts with: the file's, up to the cap of range walk; None: no autofocus is declared."""
    stated, cap = mission.autofocus.n_pull, range_walk_cap(mission)
    if stated is None:
        return None
    return stated * (stated <= cap) + cap * (stated > cap)  # the smaller one, of arrays too


def is_balanced(mission: Mission) -> bool:
    """Whether the shares of the phase follow from what is declared."""
    split = mission.allocation.split
    return (split.quadratic_phase_error if isinstance(split, MetricSplits) else split) == "balanced"


def allocate(mission: Mission, gates: Iterable[Together]) -> Allocation:
    """Divide the budgets of a mission as its `allocation.split` says.

    Parameters
    ----------
    mission : Mission
        Some of its numbers may be arrays (cases,); shares that are `balanced` then are, too.
    gates : iterable of Together
        Declared errors by each model that gates. `balanced` weighs their phases, and nothing else asks for them.
    """
    split = mission.allocation.split
    qpe, pslr, islr = (
        (split.quadratic_phase_error, split.pslr, split.islr) if isinstance(split, MetricSplits) else (split,) * 3
    )
    return Allocation(
        qpe_total=mission.requirements.quadratic_phase_error,
        qpe=_balanced(list(gates)) if qpe == "balanced" else _shares(qpe),
        pslr=_shares(pslr),
        islr=_shares(islr),
        n_pull=effective_n_pull(mission),
        n_pull_stated=mission.autofocus.n_pull,
    )


def _balanced(gates: Sequence[Together]) -> Shares:
    """Shares as the declared errors need them; by several models the larger phase of each error."""
    weights = []
    for owner in ("transmitter", "receiver"):
        by_model = zip(*(together.owed(EQUAL, owner) for together in gates), strict=True)
        phases = [(of_one[0].row_id, _largest([one.qpe_rad for one in of_one])) for of_one in by_model]
        # An error that leaves no image has no finite phase: it takes all that it may.
        weights.append(np.minimum(gates[0].combined(phases), 1e300))
    total = weights[0] + weights[1]
    with np.errstate(invalid="ignore"):
        share: Any = np.where(total == 0, 0.5, np.clip(weights[0] / total, *BALANCED_RANGE))
    if share.size == 1:
        share = float(share[0])
    return Shares(transmitter=share, receiver=1 - share)


def _largest(phases: Sequence[Floats]) -> Floats:
    """The phase with the largest magnitude, signed. [rad]"""
    if len(phases) == 1:
        return phases[0]
    of_all = np.array(phases)
    largest = np.abs(of_all).argmax(axis=0)
    return np.asarray(np.take_along_axis(of_all, largest[None], axis=0)[0])


def _shares(split: str | Shares) -> Shares:
    return EQUAL if isinstance(split, str) else split  # `balanced` weighs phase, not power
