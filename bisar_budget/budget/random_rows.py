"""Budget rows of random errors (sensors, clocks, atmosphere).

The rows limit the phase and the displacement of the image that these errors cause, and the power that they spread
over the image. Independent random errors add in power. The rule `allocation.combine` is for phases and does not apply
to powers. Each platform's share of the ISLR requirement limits the total power that wideband vibration, sensor noise
and phase noise spread over the image.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget import phrases
from bisar_budget.analysis.allocation import Allocation, autofocus_gain_of
from bisar_budget.analysis.analysis import Analysis, Case
from bisar_budget.analysis.spread import (
    CUBIC_POWER,
    SpreadPhase,
    islr_db,
    islr_of,
    mainlobe_energy,
    powers_held_by_islr,
    spread_limit,
    stated_powers,
)
from bisar_budget.arrays import Booleans, Floats, PerCase, PerCaseFlag
from bisar_budget.budget.continued_masks import (
    MIN_USE_FRACTION,
    continuation_note,
    continued_power,
    part_of,
    rests_on_masks,
)
from bisar_budget.budget.doubted_noise import doubted_noise_note, rests_on_doubted_noise
from bisar_budget.budget.judged_rows import CODE, EFFECT_WORDS, LIMIT_RATIO, REQUIREMENTS, FamilyRow, Judging, worded
from bisar_budget.budget.tone_rows import evidence, notes_of_acceleration
from bisar_budget.effects.air_delays import CONTENT, legs_of
from bisar_budget.effects.declared import CUBIC, LOCATION, OTHER_MODEL, QUADRATIC
from bisar_budget.effects.effect import PLATFORMS, override_notes, subject
from bisar_budget.effects.navigation_errors import process_of
from bisar_budget.effects.oscillator_acceleration import lacks_a_spectrum
from bisar_budget.effects.oscillator_tones import spurs_of
from bisar_budget.effects.oscillators import POOR_FIT_FRACTION
from bisar_budget.effects.random_effect import RandomEffect, RandomError
from bisar_budget.effects.vibration import counted, displacement_rms, power_of, projected
from bisar_budget.error_kinds.clock_kinds import OSCILLATOR_KIND
from bisar_budget.error_kinds.random_kinds import OTHER_KIND, VIBRATION_KIND
from bisar_budget.findings.row import NavigationState, Row
from bisar_budget.geometry import GroundVector
from bisar_budget.mission.instruments import OSCILLATOR_NOISE_FORMS, Oscillator, Synchronization
from bisar_budget.mission.model import Mission
from bisar_budget.mission.navigation import Navigation
from bisar_budget.mission.platforms import FlownPath, MotionError
from bisar_budget.mission.readers import SortedPoints
from bisar_budget.mission.vibrations import Vibration
from bisar_budget.phrases import NOTHING, Note

ISLR = "islr"
RANDOM_REQUIREMENTS = (QUADRATIC, CUBIC, ISLR, LOCATION)  # in the order of the fields of `Limits`
_GOOD_FIT_FRACTION = 0.005  # largest misfit of a power law to an Allan deviation that needs no remark
_CONVERGED_FRACTION = 0.3  # of an error at the start; with more at mid-aperture, a navigation rests on its start


class Limits(NamedTuple):
    """Limits on the effects of a single error: phases [rad] and displacement of the image [m].

    `spread` limits the rms phase of errors that spread power over the image. A limit is None if there is no
    requirement for it.
    """

    quadratic: Any
    cubic: Any
    spread: Any
    displacement: Any


def limits_for(mission: Mission, allocation: Allocation, owner: str, model: str, gain: PerCase = 1.0) -> Limits:
    """Return the limits that apply to a single error of an owner (platform, clock or mission) in one model.

    `gain` is the autofocus gain. It multiplies the limit on the quadratic phase.
    """
    spread = spread_limit(mission, allocation, owner, model)
    needs = mission.requirements
    return Limits(allocation.qpe_limit(owner) * gain, needs.cubic_phase_error, spread, needs.location_error)


def held_effect(
    mission: Mission,
    effect: RandomEffect,
    coverage: PerCase,
    gain: PerCase = 1.0,
    judged_effect: RandomEffect | None = None,
) -> RandomEffect:
    """Return the effect of an error in terms of the quantities that the requirements limit.

    The quadratic phase of the result is the judged phase, see `RandomEffect.judged`, for the autofocus gain `gain`.
    If there is no requirement on the cubic phase, the power of the cubic phase at one sigma is added to the power
    that spreads over the image. `coverage` is the coverage factor that `effect` includes. `judged_effect` is the
    effect at the quantiles of the requirements; if it is None, `effect` is used.
    """
    limited = effect if judged_effect is None else judged_effect
    limited = limited._replace(quadratic=limited.judged(gain))
    if mission.requirements.cubic_phase_error is not None:
        return limited
    cubic = effect.cubic / coverage
    return limited._replace(spread=np.sqrt(effect.spread**2 + CUBIC_POWER * cubic**2))


def judged_effect_of(mission: Mission, error: RandomError, model: str, gain: PerCase = 1.0) -> RandomEffect:
    """Return the effect of one unit of a random error in terms of the quantities that the requirements limit.

    It is the effect at the quantiles of the requirements, in one model; see `held_effect`.
    """
    judged_effect = error.judged_effect(model, mission.requirements.confidence_of, gain)
    return held_effect(mission, error.effect(model), error.coverage(mission), gain, judged_effect)


def sizes_at(effect: RandomEffect, limits: Limits) -> list[PerCase]:
    """Compute the sizes at which an error reaches each of its limits, in the order of `RANDOM_REQUIREMENTS`.

    The sizes are in the unit of the error. A size is infinite if there is no limit or no effect.
    """
    with np.errstate(all="ignore"):
        return [
            math.inf
            if limit is None
            else np.where(np.asarray(effect_part) > 0, limit / np.asarray(effect_part), math.inf)
            for effect_part, limit in zip((*effect[:3], effect.displacement), limits, strict=True)
        ]


class RandomRows:
    """Builds the rows of random errors, and the rows of the total power spread by random errors and vibration."""

    def __init__(self, judging: Judging, analysis: Analysis) -> None:
        self.judging, self.analysis, self.mission = judging, analysis, analysis.mission
        self.allocation, self.errors = analysis.allocation, analysis.random

    def _table(self, values: Sequence[PerCase | PerCaseFlag]) -> Floats:
        """Stack values, each a number or an array (cases,), into an array (values, cases)."""
        table = np.empty((len(values), self.judging.cases))
        for row, value in zip(table, values, strict=True):
            row[:] = value
        return table

    def _effects(self, model: str, *, is_judged: bool = False) -> RandomEffect:
        """Compute the effects of each random error, per unit of the error, in one model, (errors, cases).

        If `is_judged` is true, they are taken at the quantiles of the requirements, and otherwise at one sigma.
        """
        confidence_of, gain = self.mission.requirements.confidence_of, self.allocation.autofocus_gain
        effects = [
            error.judged_effect(model, confidence_of, gain) if is_judged else error.effect(model)
            for error in self.errors
        ]
        quadratic, cubic, spread, east, north, hidden, rest = (
            self._table(column)
            for column in zip(*((*effect[:5], effect.hidden, effect.rest) for effect in effects), strict=True)
        )
        return RandomEffect(quadratic, cubic, spread, east, north, hidden=hidden, rest=rest)

    def _sizes(
        self, model: str, effects: RandomEffect, judged_effects: RandomEffect, declared: Floats
    ) -> tuple[Floats, Floats | None]:
        """Compute the size at which each error reaches the limit of each requirement, (requirements, errors, cases).

        The utilizations (errors, cases) follow, if an error has a bias, and otherwise None.

        The sizes are in the unit of the error. A size is infinite if there is no requirement or no effect. `effects`
        are those of one unit at one sigma, and `judged_effects` those at the quantiles of the requirements.
        """
        gain, owners = self.allocation.autofocus_gain, [error.owner for error in self.errors]
        by_owner = {
            owner_name: limits_for(self.mission, self.allocation, owner_name, model, gain) for owner_name in {*owners}
        }
        columns = zip(*(by_owner[owner] for owner in owners), strict=True)
        limits = Limits(*(None if column[0] is None else self._table(column) for column in columns))
        sizes = np.full((len(RANDOM_REQUIREMENTS), len(owners), self.judging.cases), math.inf)
        coverage = self._table([error.coverage(self.mission) for error in self.errors])
        limited = held_effect(self.mission, effects, coverage, gain, judged_effects)
        for row, size in zip(sizes, sizes_at(limited, limits), strict=True):
            row[:] = size
        return sizes, self._with_biases(model, limits, sizes, declared)

    def _with_biases(self, model: str, limits: Limits, sizes: Floats, declared: Floats) -> Floats | None:
        """Replace the sizes of errors with a bias, and compute the utilizations of all errors, (errors, cases).

        `sizes` (requirements, errors, cases) changes in place. The result is None if no error has a bias.
        """
        if not any(error.biased for error in self.errors):
            return None
        with np.errstate(all="ignore"):
            uses = np.where(np.isnan(declared), math.nan, declared / sizes.min(axis=0))
        confidence_of, gain = self.mission.requirements.confidence_of, self.allocation.autofocus_gain
        rows = [RANDOM_REQUIREMENTS.index(key) for key in (QUADRATIC, CUBIC, LOCATION)]
        for index, error in enumerate(self.errors):
            if error.biased is not None:
                of_error = [
                    None if limit is None else limit[index]
                    for limit in (limits.quadratic, limits.cubic, limits.displacement)
                ]
                uses[index], of_random_part = error.uses(model, of_error, confidence_of, gain)
                for row, size in zip(rows, of_random_part, strict=True):
                    sizes[row, index] = size
                spread = sizes[RANDOM_REQUIREMENTS.index(ISLR), index]
                by_bias = self._spread_use_of_bias(
                    error, model, None if limits.spread is None else limits.spread[index]
                )
                uses[index] = np.maximum(uses[index], np.hypot(declared[index] / spread, by_bias))
                spread[by_bias >= 1] = 0.0
                spread *= np.sqrt(np.maximum(1 - by_bias**2, 0.0))
        return uses

    def _spread_use_of_bias(self, error: RandomError, model: str, limit: Floats | None) -> Floats:
        """Fraction of the limit on the rms phase that the cubic phase of an error's bias uses, (cases,)."""
        if limit is None or error.biased is None or self.mission.requirements.cubic_phase_error is not None:
            return np.zeros(self.judging.cases)
        _, cubic, _ = error.biased.sizes(model, 1.0)
        return np.asarray(self.judging.array(math.sqrt(CUBIC_POWER) * cubic / limit))

    def rows(self, model: str) -> Iterator["RandomRow"]:
        """Yield the rows of all random errors, declared or not, as judged by the model `published` or `full`."""
        if not self.errors:
            return
        other_model = OTHER_MODEL[model]
        mine, theirs = self._effects(model), self._effects(other_model)
        judged_by_mine, judged_by_theirs = mine, theirs
        if self.mission.requirements.has_confidence:
            judged_by_mine, judged_by_theirs = (self._effects(name, is_judged=True) for name in (model, other_model))
        declared = self._table([math.nan if error.declared is None else error.declared for error in self.errors])
        sizes, uses = self._sizes(model, mine, judged_by_mine, declared)
        sizes_of_other, uses_of_other = self._sizes(other_model, theirs, judged_by_theirs, declared)
        allocation, smallest, combine = self.allocation, sizes.min(axis=0), self.mission.allocation.combine
        gain = allocation.autofocus_gain
        is_open = self._table([_is_open(self.mission, error) for error in self.errors]) > 0
        is_limited = np.isfinite(smallest) & ~is_open
        binds = np.where(is_open, RANDOM_REQUIREMENTS.index(ISLR), np.where(is_limited, sizes.argmin(axis=0), -1))
        allowable = np.where(is_limited, smallest, math.nan)
        qpe, limit = (
            judged_by_mine.judged(1.0) * declared,
            self._table([allocation.qpe_limit(error.owner) for error in self.errors]),
        )
        within = qpe / limit
        without_autofocus = np.where((gain > 1) & (qpe > 0) & is_limited, within, 0.0)
        is_over_other = declared > sizes_of_other.min(axis=0) * LIMIT_RATIO
        if uses_of_other is not None:
            is_over_other = uses_of_other > LIMIT_RATIO
        published, full = (mine, theirs) if model == "published" else (theirs, mine)
        is_continued = self._rests_on_masks(mine, sizes)
        in_doubt = self._table([error.is_in_doubt for error in self.errors]) > 0
        with np.errstate(all="ignore"):
            use = declared / allowable
        use = use if uses is None else uses
        is_in_doubt = in_doubt & (use > MIN_USE_FRACTION) & ~(use > LIMIT_RATIO)
        judged = self.judging.row(
            self.errors[0].subject,
            declared,
            allowable,
            doubt=is_over_other | is_continued,
            without_autofocus=without_autofocus,
            is_info=(self._table([combine != "each" or bool(error.counted_in) for error in self.errors]) > 0)
            & ~is_open,
            is_unknown=is_open | is_in_doubt,
            use=uses,
        )._replace(
            binding=np.array([-1, *map(REQUIREMENTS.index, RANDOM_REQUIREMENTS)], np.int8)[binds + 1],
            qpe_published_rad=published.quadratic * declared,
            cubic_rad=mine.cubic * declared,
            # If a sum limits the phase, a row that cannot be judged does not break the quadratic requirement.
            quadratic_use=np.where(
                is_open & (combine != "each"), math.nan, judged_by_mine.judged(gain) * declared / (limit * gain)
            ),
        )
        judged = judged._replace(utilization=np.where(is_open, math.nan, judged.utilization))
        if self.judging.is_complete:
            by_published, by_full = (
                np.where(effect.judged(gain) > 0, limit * gain / effect.judged(gain), math.nan)
                for effect in (
                    (judged_by_mine, judged_by_theirs) if model == "published" else (judged_by_theirs, judged_by_mine)
                )
            )
            judged = judged._replace(
                allowable_published=by_published,
                allowable_full=by_full,
                qpe_full_rad=full.quadratic * declared,
                equal_loss_qpe_rad=full.judged(1.0) * declared,
                rest_rad=np.where(full.rest > 0, full.rest * declared, math.nan),
                islr_db=islr_of(self.mission, (mine.spread * declared) ** 2),
            )
        columns = (is_over_other, sizes_of_other.argmin(axis=0), without_autofocus)
        for error_index, (error, *columns_of_error) in enumerate(zip(self.errors, *columns, strict=True)):
            row = judged.at(error_index, error.subject)
            yield RandomRow(row.in_decibel() if error.unit == "dB" else row, error_index, *columns_of_error)

    def _rests_on_masks(self, effects: RandomEffect, sizes: Floats) -> Booleans:
        """Mark the errors that depend on phase noise at frequencies below the first point of a mask, (errors, cases).

        `effects` are the effects per unit of each error. `sizes` are the sizes at which the errors reach their
        limits, (requirements, errors, cases).
        """
        rests_on_mask = np.zeros(sizes.shape[1:], dtype=bool)
        for row, error in enumerate(self.errors):
            for effect_kind, limit in zip(("quadratic", "cubic", "spread", "displacement"), sizes, strict=True):
                if error.continued is not None and error.declared is not None:
                    size = part_of(effects, effect_kind)[row] * error.declared
                    reached = (
                        limit[row] * part_of(effects, effect_kind)[row]
                    )  # effect of the error at the size that just meets the requirement
                    rests_on_mask[row] |= np.isfinite(limit[row]) & rests_on_masks(
                        [error], effect_kind, size, reached
                    )
        return rests_on_mask

    # ---------------------------------------------------------------- powers together
    def islr_rows(self, model: str) -> Iterator["IslrRow"]:
        """Yield the rows that limit the total power spread by errors (the ISLR), for each owner and for the mission.

        An owner is a platform or the clock. The rows of the owners are absent in a case in which only wideband
        vibration and errors with a stated ISLR spread power.
        """
        mission, split = self.mission, self.allocation.islr
        owners = ("transmitter", "receiver", *(["clock"] if split.clock is not None else []), "mission")
        members = powers_held_by_islr(self.analysis, owners, model)
        powers = [self._table([phase.variance for phase in of_owner]) for of_owner in members]
        has_variance = [~np.isnan(of_owner) for of_owner in powers]
        variance = np.array(
            [phase.sum(axis=0, where=has_phase) for phase, has_phase in zip(powers, has_variance, strict=True)]
        )
        apart = {phase.subject.id for phase in stated_powers(mission)}
        apart |= {subject(name, VIBRATION_KIND.name, "wideband").id for name in PLATFORMS}
        is_held_by_shares = [phase.row_id in apart for phase in members[-1]]
        is_there = np.array([has_variance[-1][~np.array(is_held_by_shares, dtype=bool)].any(axis=0)] * len(owners))
        # The rows of vibration apply the shares themselves, and a stated ISLR has no share.
        is_there[-1] = True
        is_declared = np.array([has_phase.any(axis=0) for has_phase in has_variance]) & is_there
        shares = np.sqrt(self._table([split.of(owner) for owner in owners]))
        limit, limit_of_other = (
            shares * spread_limit(mission, self.allocation, "mission", phase) for phase in (model, OTHER_MODEL[model])
        )
        rms = np.sqrt(variance)
        masked = [[phase for phase in self.errors if split.includes(phase.owner, owner)] for owner in owners]
        rests_on = np.array([
            np.broadcast_to(rests_on_masks(errors_of_owner, "spread", size, most), size.shape)
            for errors_of_owner, size, most in zip(masked, rms, limit, strict=True)
        ])  # fmt: skip
        is_in_doubt = np.array([
            np.broadcast_to(rests_on_doubted_noise(errors_of_owner, "spread", model, most), most.shape)
            for errors_of_owner, most in zip(masked, limit, strict=True)
        ])  # fmt: skip
        is_over_other = rms > limit_of_other * LIMIT_RATIO
        judged = self.judging.row(
            subject("mission", ISLR),
            np.where(is_declared, rms, math.nan),
            np.where(is_there, limit, math.nan),
            doubt=is_over_other | rests_on,
            is_unknown=is_in_doubt & is_there & ~(rms > limit * LIMIT_RATIO),
        )
        published, full = (limit, limit_of_other) if model == "published" else (limit_of_other, limit)
        # All columns are converted by one model, so that a total at its limit equals the requirement.
        columns = (judged.declared, judged.allowable, published, full)
        declared, allowable, by_published, by_full = (self._level(column, model) for column in columns)
        judged = judged._replace(
            declared=declared,
            allowable=allowable,
            allowable_published=by_published,
            allowable_full=by_full,
            islr_db=islr_of(mission, variance),
        ).held_to(ISLR)
        of_rows = (members, variance, limit, limit_of_other, is_over_other, rests_on)
        for owner_index, (owner, *columns_of_owner) in enumerate(zip(owners, *of_rows, strict=True)):
            yield IslrRow(
                judged.at(owner_index, subject(owner, ISLR)), *columns_of_owner, is_there=is_there[owner_index]
            )

    def stated_rows(self, model: str) -> Iterator["StatedRow"]:
        """Yield a row for each error in `other_errors` for which the file states an ISLR.

        The limit in each row is the full requirement on ISLR.
        """
        mission = self.mission
        allowed = spread_limit(mission, self.allocation, "mission", model)
        for power in stated_powers(mission):
            rms = self.judging.array(power.rms(model, mainlobe_energy(mission)))
            judged = self.judging.row(
                power.subject,
                rms,
                self.judging.array(allowed),
                is_info=mission.allocation.combine != "each" or allowed is None,
            )
            declared, allowable = (self._level(column, model) for column in (judged.declared, judged.allowable))
            yield StatedRow(
                judged._replace(
                    declared=declared,
                    allowable=allowable,
                    allowable_published=allowable,
                    allowable_full=allowable,
                    islr_db=islr_of(mission, rms**2),
                ).held_to(ISLR)
            )

    def _level(self, rms: Floats, model: str) -> Floats:
        """Convert rms phases [rad] to the ISLR [dB] that they cause in one model; NaN for a phase of zero or NaN."""
        return np.where(rms > 0, islr_db(rms**2, model, mainlobe_energy(self.mission)), math.nan)


@dataclass(frozen=True, slots=True, eq=False)
class RandomRow(FamilyRow):
    """The row of one random error, for an array of cases; `place` is the index of the error in the list of errors.

    `is_over_other` marks the cases in which the error would fail in the other model, which does not decide the status
    of the row. `bound_by_other` is the index in `RANDOM_REQUIREMENTS` of the requirement that limits the error in the
    other model.
    """

    place: int
    is_over_other: Booleans
    bound_by_other: NDArray[np.intp]
    without_autofocus: Floats

    def in_words(self, case: Case, gating: str) -> Row:
        """Build the report row for one case, including its text; `gating` names the model that judges the row."""
        mission, allocation, error = case.mission, case.allocation, case.random[self.place]
        combine, binding, over, doubt = mission.allocation.combine, self.judged.requirement(case), NOTHING, NOTHING
        if self.judged.status[case.place] == CODE["fail"]:
            over = _over(mission, error, gating, binding, allocation).then(error.extrapolated)
        if self.is_over_other[case.place]:
            limit = allocation.qpe_allowed(error.owner)
            doubt = _doubt(mission, error, gating, RANDOM_REQUIREMENTS[self.bound_by_other[case.place]], limit)
        elif error.continued is not None:
            doubt = _continuation(case, error, gating)
        evidence, notes = _wording(mission, error)
        return worded(
            case,
            self.judged,
            unit=error.unit,
            path=error.path,
            equation=error.equation,
            over=over,
            doubt=doubt,
            no_limit=_unlimited(mission, error, error.effect(gating)),
            not_evaluated=doubted_noise_note(mission, [error.owner])
            if error.is_in_doubt
            else phrases.note("wideband-has-no-spectrum", platform=error.owner),
            info=phrases.note("counted-in-another-row", row_id=error.counted_in)
            if error.counted_in
            else NOTHING
            if combine == "each"
            else phrases.note("aggregate-decides", combine=combine),
            is_independent=not error.counted_in,
            without_autofocus=case.number(self.without_autofocus),
            evidence=evidence,
            remarks=notes,
            binding_requirement=binding,
            displacement_m=_displacement(error, gating),
            bias=None if error.biased is None else case.number(error.biased.bias),
            navigation=error.navigation and NavigationState(*error.navigation.at_middle),
        )


@dataclass(frozen=True, slots=True, eq=False)
class IslrRow(FamilyRow):
    """The row for the total power spread by the errors of one owner (ISLR), for an array of cases.

    `variance` is the variance of the total phase [rad²]. `limit` is the rms phase [rad] that the gating model allows,
    and `limit_of_other` is the rms phase [rad] that the other model allows. `is_over_other` marks the cases that fail
    in the other model. `rests_on_masks` marks the cases that depend on phase noise at frequencies below the first
    point of a phase-noise mask.
    """

    members: Sequence[SpreadPhase]
    variance: Floats
    limit: Floats
    limit_of_other: Floats
    is_over_other: Booleans
    rests_on_masks: Booleans

    def in_words(self, case: Case, gating: str) -> Row:
        """Build the report row for one case, including its text; `gating` names the model that judges the row."""
        level = _levels(case.mission, gating)
        other_model, over, doubt = OTHER_MODEL[gating], NOTHING, NOTHING
        variance, limit, limit_by_other = map(case.number, (self.variance, self.limit, self.limit_of_other))
        if self.is_over_other[case.place]:
            doubt = phrases.note("other-model-allows", model=other_model, limit=level(limit_by_other), unit="dB")
        elif self.rests_on_masks[case.place]:
            makers = [member for member in case.random if member.id in {each.row_id for each in self.members}]
            doubt = continuation_note(case, makers, "spread", math.sqrt(variance))
        owners = {each.owner for each in self.members}
        if self.judged.status[case.place] == CODE["fail"]:
            with_variance = [member for member in self.members if not math.isnan(case.number(member.variance))]
            largest = max(with_variance, key=lambda member: case.number(member.variance))
            rms = math.sqrt(case.number(largest.variance))
            over = phrases.note(
                "noise-spreads-too-much",
                level_db=level(math.sqrt(variance)),
                limit_db=level(limit),
                row_id=largest.row_id,
                largest_db=level(rms),
            )
        return worded(
            case,
            self.judged,
            unit="dB",
            path=("requirements", "islr"),
            equation="powers of the rows",
            over=over,
            doubt=doubt,
            not_evaluated=doubted_noise_note(case.mission, [name for name in PLATFORMS if name in owners]),
            binding_requirement=ISLR,
        )


@dataclass(frozen=True, slots=True, eq=False)
class StatedRow(FamilyRow):
    """The row for an error in `other_errors` for which the file states an ISLR [dB], for an array of cases."""

    def in_words(self, case: Case, _: str) -> Row:
        """Build the report row for one case, including its text. The row is the same for both models."""
        mission, row = case.mission, self.judged
        index, is_limited = row.subject.entry or 0, not math.isnan(row.allowable[case.place])
        missing, over = phrases.note("no-requirement-of", metric=ISLR), NOTHING
        if is_limited:
            over = phrases.note(
                "spreads-too-much", level_db=case.number(row.declared), limit_db=case.number(row.allowable)
            )
        return worded(
            case,
            row,
            unit="dB",
            path=OTHER_KIND.path("mission", ISLR, index),
            equation=OTHER_KIND.size(ISLR).equation,
            over=over,
            no_limit=missing,
            info=phrases.note("aggregate-decides", combine=mission.allocation.combine) if is_limited else missing,
            evidence=mission.other_errors[index].source,
            binding_requirement=ISLR if is_limited else None,
        )


def _is_open(mission: Mission, error: RandomError) -> PerCaseFlag:
    """Whether an error depends on a vibration spectrum that is missing from the file, so that ISLR is not judged.

    The result is a Boolean or an array (cases,).
    """
    is_shaken = error.subject == subject(error.owner, OSCILLATOR_KIND.name, "acceleration")
    return is_shaken and lacks_a_spectrum(mission, error.owner)


# ---------------------------------------------------------------------- in words
def _displacement(error: RandomError, model: str) -> GroundVector | None:
    """Return the sigmas of the displacement east and north that a declared error causes; None if unknown. [m]

    Both sigmas are multiplied by the coverage factor.
    """
    effect = error.effect(model)
    if error.declared is None or math.isnan(effect.displacement):
        return None
    return effect.east * error.declared, effect.north * error.declared


_Wording = tuple[str | None, tuple[Note, ...]]  # source and notes


def _wording(mission: Mission, error: RandomError) -> _Wording:
    """Return the source and the notes of the row of a random error."""
    return error.subject.facts.find_in(RANDOM_WORDINGS, error.subject.axis)(mission, error)


def _link_wording(mission: Mission, error: RandomError) -> _Wording:
    sync = mission.synchronization
    notes = () if sync is not None and sync.interval else (phrases.note("another-for-each-pulse"),)
    return sync and sync.source, notes


def _stated_wording(mission: Mission, error: RandomError) -> _Wording:
    return mission.other_errors[error.subject.entry or 0].source, ()


def _vibration_wording(mission: Mission, error: RandomError) -> _Wording:
    motion_error: MotionError = getattr(mission.platforms, error.owner).motion_error
    return motion_error.source, _spectrum_notes(mission, error.owner)


def _log_wording(mission: Mission, error: RandomError) -> _Wording:
    path: FlownPath | None = getattr(mission.platforms, error.owner).path
    return path and path.source, (phrases.log_is_flown_as_it_is(error.subject.axis),)


def _navigation_wording(mission: Mission, error: RandomError) -> _Wording:
    navigation = getattr(mission.platforms, error.owner).motion_error.navigation
    return "; ".join(navigation.sources) or None, tuple(_navigation_notes(error, navigation))


def _navigation_notes(error: RandomError, navigation: Navigation) -> Iterator[Note]:
    """Yield notes on the assumptions behind the covariance of an aided navigation."""
    if navigation.is_smoothed:
        yield phrases.note("navigation-is-smoothed", before=navigation.before, after=navigation.after_s)
    else:
        yield phrases.note("navigation-is-filtered", before=navigation.before)
    if navigation.gnss.correlation_time is None:
        yield phrases.note("gnss-errors-are-white")
    if navigation.level:
        yield phrases.note("navigation-is-shifted", level_db=navigation.level)
    yield from override_notes(error.owner, navigation.overridden)


def _process_wording(mission: Mission, error: RandomError) -> _Wording:
    source = process_of(mission, error).source
    if error.owner not in PLATFORMS:
        common = mission.common_motion_error
        note = phrases.note("held-to-the-total", owners="both platforms")
        return source or (common and common.source), (note,)
    motion: MotionError = getattr(mission.platforms, error.owner).motion_error
    notes = override_notes(error.owner, motion.overridden, "random")
    return source or motion.evidence("random"), notes


def _uncertainty_wording(mission: Mission, error: RandomError) -> _Wording:
    motion: MotionError = getattr(mission.platforms, error.owner).motion_error
    lever = motion.lever_arm
    return (lever and lever.source) or motion.source, ()


def _sensor_wording(mission: Mission, error: RandomError) -> _Wording:
    figure = error.subject.axis
    motion: MotionError = getattr(mission.platforms, error.owner).motion_error
    is_of_imu = motion.imu is not None and not motion.is_of_part(figure)
    source = motion.imu.source if motion.imu and is_of_imu else None
    notes = override_notes(error.owner, motion.overridden, figure)
    if error.counted_in and error.declared is None:  # otherwise this note is the reason of the row
        notes = (phrases.note("counted-in-another-row", row_id=error.counted_in), *notes)
    return source or motion.evidence(figure), notes


def _spectrum_notes(mission: Mission, name: str) -> tuple[Note, ...]:
    vibration: Vibration = getattr(mission.platforms, name).motion_error.vibration
    spectrum, along = vibration.spectrum, float(counted(mission, name, 1.0, "islr"))
    if spectrum is None:
        return ()
    rms = displacement_rms(spectrum, float(power_of(vibration)))
    seen = projected(mission, rms, getattr(mission.platforms, name).motion_error, rms * along)
    order = (phrases.note("points-are-sorted"),) if isinstance(spectrum.points, SortedPoints) else ()
    return (phrases.spectrum_shakes(rms, vibration.spectrum_level or 0.0), *order, *seen)


def _acceleration_wording(mission: Mission, error: RandomError) -> _Wording:
    oscillator: Oscillator = getattr(mission.platforms, error.owner).oscillator
    return evidence(oscillator), notes_of_acceleration(mission, error.owner)


def _oscillator_wording(mission: Mission, error: RandomError) -> _Wording:
    oscillator: Oscillator = getattr(mission.platforms, error.owner).oscillator
    noise, sync = error.noise, mission.synchronization
    notes = [*override_notes(error.owner, oscillator.overridden, *OSCILLATOR_NOISE_FORMS, "frequency")]
    if oscillator.level:
        notes.append(phrases.note("noise-is-shifted", level_db=oscillator.level))
    is_heard = not mission.has_direct_path or error.owner == "receiver"
    if noise is not None and is_heard:
        notes += [note for note in (noise.extrapolated, *noise.notes) if note]
        notes += _kept_by(mission, sync)
        slow = [
            spur.slow_parts(mission.collection.aperture_time)
            for spur in spurs_of(mission)
            if spur.name == error.owner
        ]
        if any(spur is not None and spur.quadratic > 0 for spur in slow):
            notes.append(phrases.note("folded-spurs-count"))
    if noise is not None and _GOOD_FIT_FRACTION < noise.misfit <= POOR_FIT_FRACTION:
        notes.append(phrases.note("power-law-fits", misfit=noise.misfit))
    return oscillator.source, tuple(notes)


def _kept_by(mission: Mission, sync: Synchronization | None) -> Iterator[Note]:
    """Yield a note on how much oscillator noise remains after synchronisation, if the clocks are synchronised."""
    if sync is None:
        return
    if sync.interval is not None:
        yield phrases.note("left-by-exchanges", interval=sync.interval)
    elif sync.age is not None and sync.averaging is not None:
        yield phrases.note("left-since-setting", age=sync.age, averaging=sync.averaging)
    else:
        yield phrases.note("heard-twice", delay=float(mission.geometry.echo_delay))


def _air_wording(mission: Mission, error: RandomError) -> _Wording:
    """Return the source and the notes of the row of an atmospheric delay."""
    source = None if mission.propagation is None else mission.propagation.source_of(legs_of(error.owner)[0])
    if error.counted_in and error.declared is None:  # otherwise this note is the reason of the row
        return source, (phrases.note("counted-in-another-row", row_id=error.counted_in),)
    notes = () if error.owner in PLATFORMS else (phrases.note("held-to-the-total", owners="both legs, by one air"),)
    return source, notes


def _unlimited(mission: Mission, error: RandomError, effect: RandomEffect) -> Note:
    """Explain why an error has no allowable: either it has no effect, or no requirement limits its effects."""
    effects = (("cubic phase", effect.cubic), ("ISLR", effect.spread), ("displacement", effect.displacement))
    does = [name for name, size in effects if size > 0]
    return phrases.note("no-requirement-limits", effects=does) if does else no_effect(mission, error)


def no_effect(mission: Mission, error: RandomError) -> Note:
    """Explain why an error has no effect on the image."""
    return error.subject.facts.find_in(REASONS_FOR_NO_EFFECT, error.subject.axis)(mission, error)


def _across(mission: Mission, error: RandomError) -> Note:
    return phrases.note("across-the-line-of-sight")


def _outside_the_air(mission: Mission, error: RandomError) -> Note:
    is_content = error.subject.axis == CONTENT
    return (phrases.below_the_ionosphere if is_content else phrases.runs_along_the_ground)(error.owner)


def _nothing_spreads(mission: Mission, error: RandomError) -> Note:
    return phrases.note("nothing-spreads")


def _quiet(mission: Mission, error: RandomError) -> Note:
    if mission.has_direct_path and error.owner == "transmitter":
        return phrases.note("oscillators-drop-out")
    return phrases.note("no-acceleration") if error.subject.axis else phrases.note("no-phase-noise")


# By kind, or by kind and axis: the source and notes of a row, and the reason why an error has no effect.
RANDOM_WORDINGS: Mapping[str, Callable[[Mission, RandomError], _Wording]] = {
    "vibration": _vibration_wording,
    "imu": _sensor_wording,
    "lever_arm": _sensor_wording,
    "lever_arm.uncertainty": _uncertainty_wording,
    "navigation": _navigation_wording,
    "random": _process_wording,
    "trajectory": _log_wording,
    "oscillator": _oscillator_wording,
    "oscillator.acceleration": _acceleration_wording,
    "synchronization": _link_wording,
    "propagation": _air_wording,
    "other": _stated_wording,
}
REASONS_FOR_NO_EFFECT: Mapping[str, Callable[[Mission, RandomError], Note]] = {
    "vibration": _across,
    "imu": _across,
    "lever_arm": _across,
    "navigation": _across,
    "random": _across,
    "trajectory": _across,
    "oscillator": _quiet,
    "synchronization": _nothing_spreads,
    "propagation": _outside_the_air,
    "other": _quiet,
}


def _over(mission: Mission, error: RandomError, model: str, binding: str | None, allocation: Allocation) -> Note:
    gain, size = allocation.autofocus_gain, error.declared
    effect = judged_effect_of(mission, error, model, gain)._replace(covariance=None).of(0)
    limits = limits_for(mission, allocation, error.owner, model, gain)
    if binding == CUBIC:
        return phrases.cubic_phase_over(effect.cubic * size, limits.cubic)
    if binding == LOCATION:
        by = "equation (25)" if model == "published" else "full model"
        return phrases.location_over(effect.displacement * size, limits.displacement, by)
    if binding == ISLR:
        level = _levels(mission, model)
        return phrases.note("spreads-too-much", level_db=level(effect.spread * size), limit_db=level(limits.spread))
    unit_effect = error.judged_effect(model, mission.requirements.confidence_of, gain)._replace(covariance=None).of(0)
    qpe, hidden = unit_effect.quadratic * size, unit_effect.hidden * size
    over = phrases.quadratic_phase_over(effect.quadratic * size, limits.quadratic, quadratic=qpe)
    return over.then(allocation.passes_with(qpe, hidden, error.owner, mission))


def _continuation(case: Case, error: RandomError, model: str) -> Note:
    """Write a note that an oscillator's effect depends on noise at frequencies below the first point of its mask.

    Several kinds of effect may depend on this noise. The note describes the kind to which the noise contributes the
    largest fraction. It is empty if no kind depends on the noise.
    """
    effect, size, worst = error.effect(model), error.declared, NOTHING
    limits = limits_for(case.mission, case.allocation, error.owner, model, case.allocation.autofocus_gain)
    most = 0.0
    for effect_kind, limit in zip(("quadratic", "cubic", "spread", "displacement"), limits, strict=True):
        does = float(part_of(effect, effect_kind)) * size
        if limit is None or not rests_on_masks([error], effect_kind, does, limit):
            continue
        share = float(continued_power([error], effect_kind)) / does**2
        if share > most:
            most, worst = share, continuation_note(case, [error], effect_kind, does)
    return worst


def _doubt(mission: Mission, error: RandomError, gating: str, binding: str, limit: float) -> Note:
    """Write a note that an error fails in the model that does not judge it, with the limit that it exceeds.

    `gating` is the model that judges the error, `published` or `full`.
    """
    other_model, size = OTHER_MODEL[gating], error.declared
    effect = judged_effect_of(mission, error, other_model, autofocus_gain_of(mission))._replace(covariance=None).of(0)
    if binding == ISLR:
        return phrases.note(
            "other-model-spreads", model=other_model, level_db=_levels(mission, other_model)(effect.spread * size)
        )
    per_unit = {QUADRATIC: effect.quadratic, CUBIC: effect.cubic, LOCATION: effect.displacement}[binding]
    allowed = limit if binding == QUADRATIC else getattr(mission.requirements, binding)
    return phrases.other_model_fails(other_model, per_unit * size, allowed, *EFFECT_WORDS[binding])


def _levels(mission: Mission, model: str) -> Callable[[float], float]:
    """Return a function that converts an rms phase [rad] to the ISLR [dB] that it causes according to one model.

    A phase of 0 adds no power and thus has no level in dB. The function then returns 0.
    """
    energy = mainlobe_energy(mission)
    return lambda rms: float(islr_db(rms**2, model, energy)) if rms else 0.0
