"""Rows of tones: spurs of oscillators, tones of vibrating oscillators, and the highest echo of all tones together."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bisar_budget import phrases
from bisar_budget.analysis.analysis import Analysis, Case
from bisar_budget.analysis.spread import Tone, islr_of
from bisar_budget.analysis.vibration_limits import Echo, VibrationLimits, highest_echo, tone_limits
from bisar_budget.arrays import Booleans, PerCase
from bisar_budget.budget.continued_masks import MIN_USE_FRACTION
from bisar_budget.budget.doubted_noise import doubted_noise_note, has_doubted_frequency
from bisar_budget.budget.judged_rows import LIMIT_RATIO, FamilyRow, Judging, worded
from bisar_budget.budget.near_phases import NearPhases, phase_over, phase_requirement
from bisar_budget.effects.declared import OTHER_MODEL
from bisar_budget.effects.effect import override_notes, subject
from bisar_budget.effects.oscillator_acceleration import (
    accelerated_tones,
    felt,
    flies_a_turn,
    lacks_a_spectrum,
)
from bisar_budget.effects.oscillator_tones import LeftTone, spurs_of
from bisar_budget.effects.vibration import ECHO_CYCLES, SLOWEST_ECHO_CYCLES, cubic_part, quadratic_part
from bisar_budget.error_kinds.clock_kinds import OSCILLATOR_KIND
from bisar_budget.error_kinds.random_kinds import VIBRATION_KIND
from bisar_budget.findings.row import Row
from bisar_budget.mission.instruments import Oscillator
from bisar_budget.mission.model import Mission, has_instruments
from bisar_budget.phrases import NOTHING, Note

SENSITIVITY = "acceleration_sensitivity"


# ---------------------------------------------------------------------- all tones together
def pslr_row(judging: Judging, tones: Sequence[Tone], required: PerCase) -> "PslrRow":
    """Judge the highest echo that all tones together can make, with the worst combination of their starting phases.

    The row is derived from first principles in both models, because the rule of Rigling & Moses for the shares would
    be 3 dB stricter. Tones that are at most 2.5 cycles per aperture apart raise each other's echoes, even if they
    come from different sources.
    """
    highest, allowed = highest_echo(tones, (judging.cases,)), judging.array(10 ** (np.asarray(required) / 20))
    row_subject = subject("mission", "pslr")
    judged = judging.row(row_subject, None, allowed)
    if highest is not None:
        is_declared = np.any([np.broadcast_to(tone.is_there, (judging.cases,)) for tone in tones], axis=0)
        judged = judged.where(is_declared, judging.row(row_subject, highest.level, allowed))
    judged = judged._replace(allowable_published=allowed, allowable_full=allowed)
    return PslrRow(judged.in_decibel().held_to("pslr"), tones, highest)


@dataclass(frozen=True, slots=True, eq=False)
class PslrRow(FamilyRow):
    """The row for the highest echo of all tones together, for an array of cases.

    The row exists only for missions with a requirement on PSLR.
    """

    tones: Sequence[Tone]
    highest: Echo | None

    def in_words(self, case: Case, _: str) -> Row:
        """Build the report row for one case, including its text. The row is the same for both models."""
        over = NOTHING
        if self.highest is not None:
            makers = [
                tone for tone, is_in in zip(self.tones, self.highest.is_of[:, case.place], strict=True) if is_in
            ]
            largest = max(makers, key=lambda tone: case.number(tone.phase))
            level, required = case.number(self.judged.declared), case.mission.requirements.pslr or 0.0
            over = phrases.echoes_together_over(level, required, largest.subject.id, len(makers))
        return worded(
            case,
            self.judged,
            unit="dB",
            path=("requirements", "pslr"),
            equation="first principles",
            over=over,
            binding_requirement="pslr",
        )


# ---------------------------------------------------------------------- spurs
def spur_rows(judging: Judging, analysis: Analysis, model: str) -> Iterator["SpurRow"]:
    """Yield the rows of the oscillators' spurs, as judged by one model.

    Like vibrations, spurs make paired echoes. The size in a row is the level [dB] of the echo relative to the impulse
    response.
    """
    mission = analysis.mission
    metric, by_platform = tone_limits(mission, analysis.allocation)
    for spur_index, spur in enumerate(spurs_of(mission, analysis.geometry) if has_instruments(mission) else ()):
        row_subject, phase, T = spur.subject, judging.array(spur.phase), mission.collection.aperture_time
        limits, is_over_other = by_platform.get(spur.name), np.zeros(judging.cases, dtype=bool)
        phases = _near_phases(judging, analysis, spur.name, _phases_beside(spur.left, spur.free, T))
        level = phase / 2  # amplitude of an echo divided by the amplitude of the response
        if limits is None:
            judged = phases.row(judging, row_subject, metric, level, None)
        else:
            limits = VibrationLimits(*(2 * math.pi / mission.radar.wavelength * limit for limit in limits))
            is_over_other = phase > limits.by(OTHER_MODEL[model]) * LIMIT_RATIO
            is_near = spur.left.slowest_echo(T) * T < ECHO_CYCLES
            is_in_doubt = has_doubted_frequency(mission, spur.name) & _is_used(phase, limits.by(model))
            is_unknown = (is_near & (metric == "pslr")) | is_in_doubt
            allowed = judging.array(limits.by(model) / 2)
            judged = phases.row(
                judging, row_subject, metric, level, allowed, doubt=is_over_other, is_unknown=is_unknown
            )
            published, full = (np.fmin(limit / 2, phases.limit(level)) for limit in limits)
            judged = judged._replace(allowable_published=published, allowable_full=full)
        judged = judged.in_decibel()
        if metric == "islr":
            judged = judged._replace(islr_db=islr_of(mission, phase**2 / 2))
        is_there = (phase > 0) | (not spur.left.is_folded)
        yield SpurRow(judged, spur_index, is_over_other, is_there=is_there)


def _is_used(size: PerCase, limit: PerCase) -> Booleans:
    """Whether a size lies between a tenth of its limit and the limit, (cases,).

    A doubt about such a size affects the verdict. A smaller size passes anyway, and a larger size fails.
    """
    return np.asarray((size > MIN_USE_FRACTION * limit) & ~(size > limit * LIMIT_RATIO))


@dataclass(frozen=True, slots=True, eq=False)
class SpurRow(FamilyRow):
    """The row of one spur of an oscillator, for an array of cases.

    The size of the row is the level [dB] of the spur's echo relative to the impulse response. `spur_index` is the
    index of the spur. `is_over_other` marks the cases in which the row would fail in the other model, which does not
    decide its status.
    """

    spur_index: int
    is_over_other: Booleans

    def in_words(self, case: Case, model: str) -> Row:
        """Build the report row for one case, including its text; `model` names the model that judges the row."""
        mission, row, doubt, over = case.mission, self.judged, NOTHING, phase_over(case, self.judged)
        spur = spurs_of(mission)[self.spur_index]
        oscillator: Oscillator = getattr(mission.platforms, spur.name).oscillator
        T, missing = mission.collection.aperture_time, phrases.note("no-requirement-of", metric="pslr")
        near = float(spur.left.slowest_echo(T))
        on_mainlobe = phrases.note("echoes-on-the-mainlobe", cycles=near * T, least=ECHO_CYCLES)
        doubted = doubted_noise_note(mission, [spur.name]) if has_doubted_frequency(mission, spur.name) else NOTHING
        if not math.isnan(row.allowable[case.place]):
            over = over or phrases.note(
                "echoes-over", level_db=case.number(row.declared), limit_db=case.number(row.allowable)
            )
            if self.is_over_other[case.place]:
                other_model = OTHER_MODEL[model]
                doubt = phrases.note(
                    "other-model-allows",
                    model=other_model,
                    limit=case.number(row.allowable_by(other_model)),
                    unit="dB",
                )
        return worded(
            case,
            row,
            unit="dB",
            path=OSCILLATOR_KIND.path(spur.name, row.subject.axis),
            equation="first principles" if model == "full" else OSCILLATOR_KIND.size(row.subject.axis).equation,
            over=over,
            doubt=doubt,
            no_limit=missing,
            not_evaluated=doubted
            or (
                phrases.note("echo-is-folded", frequency=near, reason=on_mainlobe)
                if spur.left.is_folded
                else on_mainlobe
            ),
            info=missing,
            evidence=oscillator.source,
            remarks=(
                phrases.note("tone-lies", frequency=spur.frequency, cells=spur.frequency * T),
                *_folds(spur.left, float(spur.free), T, f"{spur.name}.oscillator"),
                *override_notes(spur.name, oscillator.overridden, "frequency"),
            ),
            binding_requirement=phase_requirement(case, row),
            displacement_m=case.moved_by_tone(row.subject, model),
        )


def _folds(folded: LeftTone, free: float, aperture_time: float, row_id: str) -> tuple[Note, ...]:
    """Write a note that the low-frequency part of a folded tone is judged in the row `row_id`.

    Synchronisation by an exchange of pulses folds (aliases) a tone to low frequencies. The note is about the part of
    the tone below one cycle per aperture. The result is empty if there is no such part.
    """
    slow = [
        (float(share), float(frequency))
        for frequency, share in zip(folded.frequencies, folded.shares, strict=True)
        if folded.is_folded and frequency * aperture_time < SLOWEST_ECHO_CYCLES and share > 0
    ]
    if not slow:
        return ()
    variances = folded.slow_parts(aperture_time)
    qpe, cubic = (free * math.sqrt(float(variance)) for variance in (variances.quadratic, variances.cubic))
    frequency = max(slow)[1]
    return (
        phrases.note(
            "tone-is-folded",
            frequency=frequency,
            cycles=frequency * aperture_time,
            qpe=qpe,
            cubic=cubic,
            row_id=row_id,
        ),
    )


# ---------------------------------------------------------------------- oscillators that vibrate
def accelerated_rows(judging: Judging, analysis: Analysis, model: str) -> Iterator["AcceleratedRow"]:
    """Yield the rows of the vibration tones that act on oscillators, as judged by one model.

    The allowable is an acceleration sensitivity [s²/m]. A tone below one cycle per aperture causes a quadratic and a
    cubic phase instead of echoes. Such a tone is part of the row of the oscillator's random vibration.
    """
    mission = analysis.mission
    metric, by_platform = tone_limits(mission, analysis.allocation)
    for tone_index, tone in enumerate(
        accelerated_tones(mission, analysis.geometry) if has_instruments(mission) else ()
    ):
        T, per_unit = mission.collection.aperture_time, judging.array(tone.per_unit)
        is_there = per_unit > 0 if tone.left.is_folded else judging.array(tone.frequency * T) >= SLOWEST_ECHO_CYCLES
        if not is_there.any():
            continue
        declared, limits = judging.array(tone.sensitivity), by_platform.get(tone.name)
        phase = declared * per_unit
        phases_beside = _phases_beside(tone.left, tone.free * tone.sensitivity, T)
        phases = _near_phases(judging, analysis, tone.name, phases_beside)
        if limits is None:
            judged = phases.row(judging, tone.subject, metric, declared, None)
            is_over_other = np.zeros(judging.cases, dtype=bool)
        else:
            by_published, by_full = (
                judging.array(2 * math.pi / mission.radar.wavelength * limit) / per_unit for limit in limits
            )
            published, full = (np.where(per_unit > 0, tone, math.nan) for tone in (by_published, by_full))
            allowable = full if model == "full" else published
            is_over_other = declared > (published if model == "full" else full) * LIMIT_RATIO
            judged = phases.row(judging, tone.subject, metric, declared, allowable, doubt=is_over_other)
            published, full = (np.fmin(limit, phases.limit(declared)) for limit in (published, full))
            judged = judged._replace(allowable_published=published, allowable_full=full)
        if metric == "islr":
            judged = judged._replace(islr_db=islr_of(mission, phase**2 / 2))
        yield AcceleratedRow(judged, tone_index, is_over_other, is_there=is_there)


@dataclass(frozen=True, slots=True, eq=False)
class AcceleratedRow(FamilyRow):
    """The row of one tone that an oscillator feels as an acceleration, for an array of cases.

    `is_there` marks the cases in which the tone is fast enough for this row. `tone_index` is the index of the tone in
    `accelerated_tones`. `is_over_other` marks the cases in which the row would fail in the other model, which does
    not decide its status.
    """

    tone_index: int
    is_over_other: Booleans

    def in_words(self, case: Case, model: str) -> Row:
        """Build the report row for one case, including its text; `model` names the model that judges the row."""
        mission, row, doubt, over = case.mission, self.judged, NOTHING, phase_over(case, self.judged)
        tone = accelerated_tones(mission)[self.tone_index]
        T, missing = mission.collection.aperture_time, phrases.note("no-requirement-of", metric="pslr")
        if not math.isnan(row.allowable[case.place]):
            if row.declared[case.place] and not over:
                level_db, limit_db = (
                    20 * math.log10(tone.per_unit * case.number(size) / 2) for size in (row.declared, row.allowable)
                )
                over = phrases.note("echoes-over", level_db=level_db, limit_db=limit_db)
            if self.is_over_other[case.place]:
                other_model = OTHER_MODEL[model]
                doubt = phrases.note(
                    "other-model-allows",
                    model=other_model,
                    limit=case.number(row.allowable_by(other_model)),
                    unit="s^2/m",
                )
        oscillator: Oscillator = getattr(mission.platforms, tone.name).oscillator
        size = OSCILLATOR_KIND.size(row.subject.axis)
        return worded(
            case,
            row,
            unit=size.unit,
            path=OSCILLATOR_KIND.path(tone.name, row.subject.axis),
            equation=size.equation if model == "full" else VIBRATION_KIND.size("sinusoidal").equation,
            over=over,
            doubt=doubt,
            no_limit=missing,
            info=missing,
            evidence=evidence(oscillator),
            remarks=(
                phrases.note("tone-lies", frequency=float(tone.frequency), cells=float(tone.frequency * T)),
                phrases.note("shakes-an-oscillator", acceleration=float(tone.acceleration), phase=float(tone.phase)),
                *_folds(tone.left, float(tone.free * tone.sensitivity), T, f"{tone.name}.oscillator.acceleration"),
                *_whose(mission, tone.name),
                *override_notes(tone.name, oscillator.overridden, SENSITIVITY),
            ),
            binding_requirement=phase_requirement(case, row),
            displacement_m=case.moved_by_tone(row.subject, model),
        )


def _phases_beside(folded: LeftTone, free: PerCase, aperture_time: PerCase) -> tuple[PerCase, PerCase]:
    """Quadratic and cubic phase of a folded tone, from its parts below three cycles per aperture. [rad]

    Synchronisation by an exchange of pulses folds (aliases) the tone to several frequencies. The tone has one part at
    each of them. The quadratic and cubic phases are computed for the worst starting phase of each part, and added
    over all parts. `free` [rad] is the peak phase of the tone without synchronisation.
    """
    qpe: PerCase = 0.0
    cubic: PerCase = 0.0
    for frequency, share in zip(folded.frequencies, folded.echoes(aperture_time), strict=True):
        cycles = frequency * aperture_time
        phase = np.where(cycles < ECHO_CYCLES, free * share, 0.0)
        qpe, cubic = qpe + phase * quadratic_part(cycles), cubic + phase * cubic_part(cycles)
    return qpe, cubic


def _near_phases(judging: Judging, analysis: Analysis, name: str, phases: tuple[PerCase, PerCase]) -> NearPhases:
    """Compare the quadratic and cubic phase [rad] of a tone with the limits of the platform `name`."""
    qpe, cubic = map(judging.array, phases)
    return NearPhases.of(analysis.mission, analysis.allocation, name, qpe + cubic > 0, (qpe, cubic, qpe, qpe))


def evidence(oscillator: Oscillator) -> str | None:
    """Return the source of an oscillator's acceleration sensitivity: its catalogue part, or else its `source`."""
    return dict(oscillator.of_parts).get(SENSITIVITY, oscillator.source)


def _whose(mission: Mission, name: str) -> tuple[Note, ...]:
    """Write a note that an oscillator is assumed to feel the vibration of its platform.

    The result is empty if the file states a vibration for the oscillator itself.
    """
    felt_vibration = felt(mission, name)
    return (
        () if felt_vibration is not None and felt_vibration.is_own else (phrases.note("vibration-of-the-platform"),)
    )


def notes_of_acceleration(mission: Mission, name: str) -> tuple[Note, ...]:
    """Return the notes on the row of an oscillator's acceleration sensitivity.

    They state which vibration the oscillator is assumed to feel, which tones have rows of their own, and how much of
    the vibration's effect remains after synchronisation.
    """
    felt_vibration = felt(mission, name)
    oscillator: Oscillator = getattr(mission.platforms, name).oscillator
    notes = list[Note]()
    if felt_vibration is None or (mission.has_direct_path and name == "transmitter"):
        return ()
    vibration = felt_vibration.vibration
    if vibration.spectrum is not None or vibration.sinusoidal:
        notes += _whose(mission, name)
    elif not lacks_a_spectrum(mission, name):
        notes.append(phrases.oscillator_does_not_vibrate(bool(flies_a_turn(mission, name))))
    if any(line.frequency * mission.collection.aperture_time >= SLOWEST_ECHO_CYCLES for line in vibration.sinusoidal):
        notes.append(phrases.note("tones-have-rows", row_id=f"{name}.oscillator.acceleration"))
    if mission.synchronization is not None and mission.synchronization.interval is not None:
        notes.append(phrases.note("left-by-exchanges", interval=mission.synchronization.interval))
    if mission.has_direct_path:
        notes.append(phrases.note("heard-twice", delay=float(mission.geometry.echo_delay)))
    return (*notes, *override_notes(name, oscillator.overridden, SENSITIVITY))
