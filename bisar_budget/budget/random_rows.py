"""Rows of sensors and clocks: how bad may a figure be, by its quadratic phase, cubic phase and what it spreads.

Independent processes add their powers, whatever `allocation.combine` says of phases: what wideband vibration, noise
of sensors and phase noise spread is held together to each platform's share of ISLR.
"""

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

from bisar_budget import phrases
from bisar_budget.analysis.allocation import Allocation
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.analysis.spread import (
    CUBIC_POWER,
    islr_db,
    mainlobe_energy,
    shown_islr_db,
    spread_limit,
    spread_powers,
)
from bisar_budget.budget.judgement import judged
from bisar_budget.budget.pull_in import caps, needed_sentence
from bisar_budget.constants import UTILIZATION_TOLERANCE
from bisar_budget.effects.models import CUBIC, QUADRATIC
from bisar_budget.effects.random_errors import RandomEffect, RandomError
from bisar_budget.effects.subject import subject
from bisar_budget.findings.row import Row
from bisar_budget.mission.model import Mission
from bisar_budget.phrases import NOTHING, Note

ISLR = "islr"


class Limits(NamedTuple):
    """What the errors of an owner are held to, each alone: quadratic and cubic phase, rms of what spreads. [rad]"""

    quadratic: float
    cubic: float | None
    spread: float | None


def limits_for(mission: Mission, allocation: Allocation, owner: str, model: str, gain: float = 1.0) -> Limits:
    """What the errors of an owner are held to by a model; `gain` is that of autofocus."""
    spread = spread_limit(mission, allocation, owner, model)
    held = None if spread is None else float(spread)
    return Limits(allocation.qpe_limit(owner) * gain, mission.requirements.cubic_phase_error, held)


def sizes_at(effect: RandomEffect, limits: Limits) -> dict[str, float]:
    """Size at which an error reaches each requirement that it touches. [unit]"""
    parts = zip((QUADRATIC, CUBIC, ISLR), effect[:3], limits, strict=True)
    return {name: limit / per_unit for name, per_unit, limit in parts if per_unit and limit is not None}


def held_effect(mission: Mission, effect: RandomEffect) -> RandomEffect:
    """An effect as requirements hold it: a cubic phase that none takes is power that ISLR holds, at one sigma."""
    if mission.requirements.cubic_phase_error is not None:
        return effect
    cubic = effect.cubic / mission.allocation.coverage_factor
    return effect._replace(spread=math.sqrt(effect.spread**2 + CUBIC_POWER * cubic**2))


def random_rows(analysis: Analysis, gating: str, allocation: Allocation) -> Iterator[Row]:
    """Rows of every error of a sensor or a clock, declared or not."""
    other = "full" if gating == "published" else "published"
    for error in analysis.random:
        yield _row(analysis, error, gating, other, allocation)


def _row(analysis: Analysis, error: RandomError, gating: str, other: str, allocation: Allocation) -> Row:
    mission, gain, size = analysis.mission, allocation.autofocus_gain, error.declared
    mine, theirs = error.effect(gating), error.effect(other)
    held, held_by_other = held_effect(mission, mine), held_effect(mission, theirs)
    limits, others = (limits_for(mission, allocation, error.owner, model, gain) for model in (gating, other))
    sizes = sizes_at(held, limits)
    allowable = min(sizes.values(), default=None)
    binding = min(sizes, key=lambda name: sizes[name]) if sizes else None
    qpe = cubic = None
    over = doubt = info = NOTHING
    if size is not None:
        qpe, cubic = mine.quadratic * size, mine.cubic * size
        if mission.allocation.combine != "each":
            info = phrases.aggregate_decides(mission.allocation.combine)
        elif allowable is not None and size > allowable:
            over = _over(mission, error, gating, limits, binding or "", allocation).then(error.extrapolated)
        doubt = _doubt(mission, other, held_by_other, others, size)
    by_model = (mine, theirs) if gating == "published" else (theirs, mine)
    row = judged(
        mission,
        subject=error.subject,
        metric=QUADRATIC,
        unit=error.unit,
        declared=size,
        allowable=allowable,
        path=error.path,
        equation=error.equation,
        gain=_gain(binding, qpe, limits, gain, size, allowable),
        over=over,
        doubt=doubt,
        no_limit=_no_limit(error, mine) if allowable is None else NOTHING,
        info=info,
        limits=tuple(limits.quadratic / effect.quadratic if effect.quadratic else None for effect in by_model),  # type: ignore[arg-type]
        qpe=None if size is None else by_model[0].quadratic * size,
        qpe_full=None if size is None else by_model[1].quadratic * size,
        evidence=error.evidence,
        notes=error.notes,
    )
    row = row._replace(
        binding_requirement=binding,
        cubic_rad=cubic,
        islr_db=None if size is None else shown_islr_db(mission, (mine.spread * size) ** 2),
        model=gating,
    )
    return in_decibel(row) if error.unit == "dB" else row


def _no_limit(error: RandomError, effect: RandomEffect) -> Note:
    """Say why nothing limits an error: it does nothing, or what it does is not required."""
    parts = [name for name, size in (("cubic phase", effect.cubic), ("ISLR", effect.spread)) if size]
    return phrases.no_requirement_limits(parts) if parts else error.no_limit


def _gain(
    binding: str | None, qpe: float | None, limits: Limits, gain: float, size: float | None, allowable: float | None
) -> float:
    """Autofocus gain within an allowable: of one that the quadratic phase does not set, how far that is used."""
    if gain == 1 or not qpe or not size or allowable is None:
        return 1.0
    return gain if binding == QUADRATIC else qpe / (limits.quadratic / gain) / (size / allowable)


def in_decibel(row: Row) -> Row:
    """Write a row whose numbers are factors of amplitude in decibel; its utilization stays that of amplitudes."""

    def level(factor: float | None) -> float | None:
        return 20 * math.log10(factor) + 0.0 if factor else None

    return row._replace(
        declared=level(row.declared),
        allowable=level(row.allowable),
        allowable_published=level(row.allowable_published),
        allowable_full=level(row.allowable_full),
    )


def _over(
    mission: Mission, error: RandomError, model: str, limits: Limits, binding: str, allocation: Allocation
) -> Note:
    effect, size = held_effect(mission, error.effect(model)), error.declared or 0.0
    if binding == CUBIC:
        return phrases.cubic_phase_over(effect.cubic * size, limits.cubic or 0.0)
    if binding == ISLR:
        level = _levels(mission, model)
        return phrases.spreads_too_much(level(effect.spread * size), level(limits.spread or 0.0))
    qpe = effect.quadratic * size
    needed = needed_sentence(allocation.n_pull_needed(qpe, error.owner), caps(mission))
    return phrases.quadratic_phase_over(qpe, limits.quadratic).then(needed)


def _levels(mission: Mission, model: str) -> Callable[[float], float]:
    """ISLR of an rms phase [rad] by a model, whatever the size that it is compared with. [dB]"""
    energy = mainlobe_energy(mission)
    return lambda rms: islr_db(rms**2, model, energy) if rms else 0.0


def _doubt(mission: Mission, other: str, effect: RandomEffect, limits: Limits, size: float) -> Note:
    """Say that the model that does not gate fails a declared error; else nothing."""
    sizes = sizes_at(effect, limits)
    if not sizes or size <= min(sizes.values()) * (1 + UTILIZATION_TOLERANCE):
        return NOTHING
    name = min(sizes, key=lambda one: sizes[one])
    if name == ISLR:
        return phrases.other_model_spreads(other, _levels(mission, other)(effect.spread * size))
    if name == QUADRATIC:
        return phrases.other_model_fails(other, effect.quadratic * size, limits.quadratic, "rad", "QPE")
    return phrases.other_model_fails(other, effect.cubic * size, limits.cubic or 0.0, "rad", "cubic phase")


# ---------------------------------------------------------------------- powers together
def islr_rows(analysis: Analysis, gating: str, allocation: Allocation) -> Iterator[Row]:
    """Rows of what spreads in sum: for the mission, and for each owner unless only wideband vibration spreads."""
    mission = analysis.mission
    if mission.requirements.islr is None:
        return
    owners = ["transmitter", "receiver", "mission"]
    if allocation.islr.clock is not None:
        owners.insert(2, "clock")
    other = "full" if gating == "published" else "published"
    level = _levels(mission, gating)  # by one rule: what is required of the whole reads as required
    powers = {owner: spread_powers(analysis, allocation, owner, gating) for owner in owners}
    is_vibration_alone = all(row_id.endswith("vibration.wideband") for row_id, _ in powers["mission"])
    for owner, members in powers.items():
        if owner != "mission" and is_vibration_alone:  # its own row holds it to the platform's share
            continue
        variance = math.fsum(power for _, power in members)
        limit, by_other = (spread_limit(mission, allocation, owner, model) or 0.0 for model in (gating, other))
        rms = math.sqrt(variance)
        over = doubt = NOTHING
        if rms > limit and members:
            row_id, largest = max(members, key=lambda member: member[1])
            over = phrases.noise_spreads_too_much(level(rms), level(limit), row_id, level(math.sqrt(largest)))
        if rms > by_other * (1 + UTILIZATION_TOLERANCE):
            doubt = phrases.other_model_allows(other, level(by_other), "dB")
        row = judged(
            mission,
            subject=subject(owner, ISLR),
            metric=ISLR,
            unit="dB",
            declared=rms if members else None,
            allowable=limit,
            path=("requirements", "islr"),
            equation="powers of the rows",
            over=over,
            doubt=doubt,
            limits=(limit, by_other) if gating == "published" else (by_other, limit),
        )
        yield _as_islr(row, shown_islr_db(mission, variance), gating, level)


def _as_islr(row: Row, shown: float | None, gating: str, of_rms: Callable[[float], float]) -> Row:
    """Write rms phases as the ISLR that they add; `shown` is that of an image, whatever model gates. [dB]"""

    def level(rms: float | None) -> float | None:
        return of_rms(rms) if rms else None

    return row._replace(
        declared=level(row.declared),
        allowable=level(row.allowable),
        allowable_published=level(row.allowable_published),
        allowable_full=level(row.allowable_full),
        islr_db=shown,
        binding_requirement=ISLR,
        model=gating,
    )
