"""Division of the budgets between transmitter, receiver and clock, and the gain of autofocus."""

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from bisar_budget import evaluators
from bisar_budget.effects.correlation import combined_phase, correlated_errors
from bisar_budget.effects.effect import ErrorSource
from bisar_budget.mission.model import MetricSplits, Mission, Shares

if TYPE_CHECKING:
    from bisar_budget.effects.vibration import OwnPhase

BALANCED_RANGE = (0.05, 0.95)  # neither platform is left without a budget


class Split(NamedTuple):
    """Shares of one budget; they sum to 1. Without a share of its own the clock is held to the receiver's."""

    transmitter: float
    receiver: float
    clock: float | None = None
    reserve: float = 0.0

    def of(self, owner: str) -> float:
        """Share of an owner; what belongs to nobody is held to the whole budget."""
        if owner == "clock":
            return self.receiver if self.clock is None else self.clock
        if owner == "mission":
            return 1.0
        return self.transmitter if owner == "transmitter" else self.receiver

    def includes(self, owner: str, of: str) -> bool:
        """Whether an owner's errors count against the share of `of`."""
        return owner == of or (owner == "clock" and of == "receiver" and self.clock is None)


EQUAL = Split(transmitter=0.5, receiver=0.5)


class Allocation(NamedTuple):
    """The budgets as divided. `qpe_total` and limits in [rad], before autofocus; PSLR and ISLR share power.

    `n_pull` is what counts of the file's `autofocus.n_pull`, see `effective_n_pull`; `n_pull_stated` is the file's.
    """

    qpe_total: float
    qpe: Split
    pslr: Split
    islr: Split
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

    def n_pull_needed(self, qpe: float, owner: str) -> float:
        """Smallest N_pull that makes a QPE pass."""
        return qpe / (self.qpe.of(owner) * math.pi)


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


def allocate(
    mission: Mission, stated: Sequence[ErrorSource], phases: Mapping[str, float], own: Sequence["OwnPhase"] = ()
) -> Allocation:
    """Divide the budgets of a mission as its `allocation.split` says.

    Parameters
    ----------
    mission : Mission
        As loaded.
    stated : sequence of ErrorSource
        Declared errors, along the axes that the file states them in.
    phases : mapping of str to float
        Quadratic phase of each by the gating model, by row id: `balanced` weighs them. [rad]
    own : sequence of OwnPhase
        Phases of slow vibrations, sensors and clocks, which it weighs too.
    """
    split = mission.allocation.split
    metrics = split if isinstance(split, MetricSplits) else None
    return Allocation(
        qpe_total=mission.requirements.quadratic_phase_error,
        qpe=_divide(metrics.quadratic_phase_error if metrics else split, mission, stated, phases, own),
        pslr=_divide_power(metrics.pslr if metrics else split),
        islr=_divide_power(metrics.islr if metrics else split),
        n_pull=effective_n_pull(mission),
        n_pull_stated=mission.autofocus.n_pull,
    )


def _divide_power(split: object) -> Split:
    return _split(split) if isinstance(split, Shares) else EQUAL  # `balanced` weighs phase, not power


def _divide(
    split: object,
    mission: Mission,
    stated: Sequence[ErrorSource],
    phases: Mapping[str, float],
    own: Sequence["OwnPhase"],
) -> Split:
    if isinstance(split, Shares):
        return _split(split)
    if split != "balanced":
        return EQUAL
    weight = {}
    for platform in ("transmitter", "receiver"):
        rule = mission.allocation.combine
        members = [(s.id, phases[s.id]) for s in stated if EQUAL.includes(s.owner, platform)]
        members += [(one.row_id, one.qpe_rad) for one in own if EQUAL.includes(one.owner, platform)]
        weight[platform] = combined_phase(members, rule, correlated_errors(mission))
    # An error that leaves no image has no finite phase: it takes all that it may.
    weight = {name: min(size, 1e300) for name, size in weight.items()}
    total = weight["transmitter"] + weight["receiver"]
    if total == 0:
        return EQUAL
    low, high = BALANCED_RANGE
    transmitter = min(high, max(low, weight["transmitter"] / total))
    return Split(transmitter=transmitter, receiver=1 - transmitter)


def _split(shares: Shares) -> Split:
    return Split(
        transmitter=shares.transmitter,
        receiver=shares.receiver,
        clock=shares.clock,
        reserve=shares.reserve,
    )
