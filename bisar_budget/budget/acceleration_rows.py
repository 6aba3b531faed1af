"""Rows of oscillators that vibrate: each tone as its paired echoes, by how sensitive the oscillator may be."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from bisar_budget import phrases
from bisar_budget.analysis.analysis import Analysis, Case
from bisar_budget.analysis.spread import islr_of
from bisar_budget.analysis.vibration_limits import tone_limits
from bisar_budget.budget.judged_rows import BOUND, Judged, Judging, worded
from bisar_budget.budget.vibration_rows import folds
from bisar_budget.effects.effect import override_notes
from bisar_budget.effects.oscillator_acceleration import AcceleratedTone, accelerated_tones, felt, flies_a_turn
from bisar_budget.effects.vibration import SLOWEST, cubic_part, quadratic_part
from bisar_budget.findings.row import Row
from bisar_budget.mission.instruments import Oscillator
from bisar_budget.mission.model import Mission, has_instruments
from bisar_budget.mission.vibrations import Vibration
from bisar_budget.phrases import NOTHING, Note

SENSITIVITY = "acceleration_sensitivity"
_ECHO_CYCLES = 3.0  # per aperture; below, a vibration is a quadratic phase as well


def accelerated_rows(judging: Judging, analysis: Analysis, model: str) -> Iterator["AcceleratedRow"]:
    """Judge what each vibration does to an oscillator by a model: the sensitivity that it may have. [s²/m]

    Slower tones than one cycle per aperture are phases, which the row of the oscillator's random vibration has.
    """
    mission = analysis.mission
    metric, by_platform = tone_limits(mission, analysis.allocation)
    for place, one in enumerate(accelerated_tones(mission, analysis.geometry) if has_instruments(mission) else ()):
        cycles = judging.array(one.frequency * mission.collection.aperture_time)
        T, per_unit = mission.collection.aperture_time, judging.array(one.per_unit)
        is_there = per_unit > 0 if one.left.is_folded else cycles >= SLOWEST
        if not is_there.any():
            continue
        declared, limits = judging.array(one.sensitivity), by_platform.get(one.name)
        phase = declared * per_unit
        qpe, cubic = map(judging.array, phases_beside(one, T))
        is_over_phase = qpe > analysis.allocation.qpe_limit(one.name) * analysis.allocation.autofocus_gain * BOUND
        if mission.requirements.cubic_phase_error is not None:
            is_over_phase = is_over_phase | (cubic > mission.requirements.cubic_phase_error * BOUND)
        if limits is None:
            judged = judging.row(one.subject, declared, None, doubt=is_over_phase, is_info=~is_over_phase)
            is_over_other = np.zeros(judging.cases, dtype=bool)
        else:
            by_published, by_full = (
                judging.array(2 * math.pi / mission.radar.wavelength * limit) / per_unit for limit in limits
            )
            published, full = (np.where(per_unit > 0, one, math.nan) for one in (by_published, by_full))
            allowable = {"published": published, "full": full}[model]
            is_over_other = declared > (full if model == "published" else published) * BOUND
            judged = judging.row(one.subject, declared, allowable, doubt=is_over_phase | is_over_other)
            judged = judged._replace(allowable_published=published, allowable_full=full)
        judged = judged.held_to(metric)
        if metric == "islr":
            judged = judged._replace(islr_db=islr_of(mission, phase**2 / 2))
        yield AcceleratedRow(judged, place, is_there, is_over_other, is_over_phase)


def phases_beside(one: AcceleratedTone, aperture_time: Any) -> tuple[Any, Any]:
    """Quadratic and cubic phase of the echoes that lie beside the mainlobe, in their worst phases. [rad]"""
    found: list[Any] = [0.0, 0.0]
    for frequency, share in zip(one.left.frequencies, one.left.echoes(aperture_time), strict=True):
        cycles = frequency * aperture_time
        phase = np.where(cycles < _ECHO_CYCLES, one.free * one.sensitivity * share, 0.0)
        found = [
            total + phase * part(cycles) for total, part in zip(found, (quadratic_part, cubic_part), strict=True)
        ]
    return found[0], found[1]


@dataclass(frozen=True, slots=True, eq=False)
class AcceleratedRow:
    """A vibration of an oscillator in many cases, by its place among them; `is_there` where it is fast enough."""

    judged: Judged
    place: int
    is_there: Any
    is_over_other: Any
    is_over_phase: Any

    def in_words(self, case: Case, model: str) -> Row:
        """The row of one case, by the model that judges it."""
        mission, row, doubt, over = case.mission, self.judged, NOTHING, NOTHING
        one = accelerated_tones(mission)[self.place]
        T, missing = mission.collection.aperture_time, phrases.no_requirement_of("pslr")
        cycles = one.frequency * T
        if not math.isnan(row.allowable[case.place]):
            echoes = (20 * math.log10(one.per_unit * size / 2) for size in map(case.number, row[2:4]) if size)
            over = phrases.echoes_over(*echoes) if row.declared[case.place] else NOTHING
            if self.is_over_other[case.place]:
                other, by_other = (
                    ("published", row.allowable_published) if model == "full" else ("full", row.allowable_full)
                )
                doubt = phrases.other_model_allows(other, case.number(by_other), "s^2/m")
        if self.is_over_phase[case.place]:
            limit = float(case.allocation.qpe_limit(one.name) * case.allocation.autofocus_gain)
            phases = [float(phase) for phase in phases_beside(one, T)]
            doubt = phrases.phase_of_vibration_over(
                phases[0], limit, phases[1], mission.requirements.cubic_phase_error
            )
        oscillator: Oscillator = getattr(mission.platforms, one.name).oscillator
        return worded(
            case,
            row,
            unit="s^2/m",
            path=("platforms", one.name, "oscillator", SENSITIVITY),
            equation="acceleration sensitivity" if model == "full" else "Section V, sinusoidal",
            over=over,
            doubt=doubt,
            no_limit=missing,
            info=missing,
            evidence=evidence(oscillator),
            remarks=(
                phrases.tone_lies(one.frequency, cycles),
                phrases.shakes_an_oscillator(float(one.acceleration), one.phase),
                *folds(one.left, one.free * one.sensitivity, T, f"{one.name}.oscillator.acceleration"),
                *_whose(not _is_own(mission, one.name)),
                *override_notes(one.name, oscillator.overridden, SENSITIVITY),
            ),
        )


def evidence(oscillator: Oscillator) -> str | None:
    """Where the sensitivity of an oscillator comes from: its part, else what the file says of it."""
    return dict(oscillator.of_parts).get(SENSITIVITY, oscillator.source)


def _is_own(mission: Mission, name: str) -> bool:
    one = felt(mission, name)
    return one is not None and one.is_own


def _whose(is_of_the_platform: bool) -> tuple[Note, ...]:
    return (phrases.vibration_of_the_platform(),) if is_of_the_platform else ()


def notes_of_acceleration(mission: Mission, name: str) -> tuple[Note, ...]:
    """Say of the row of an oscillator's acceleration what counts in it, and what cannot."""
    one = felt(mission, name)
    oscillator: Oscillator = getattr(mission.platforms, name).oscillator
    notes = list[Note]()
    if one is None or (mission.has_direct_path and name == "transmitter"):
        return ()
    vibration = one.vibration
    if vibration.spectrum is not None or vibration.sinusoidal:
        notes += _whose(not one.is_own)
    else:
        notes.append(phrases.oscillator_does_not_vibrate(flies_a_turn(mission, name)))
    if isinstance(vibration, Vibration) and vibration.wideband is not None:
        notes.append(phrases.wideband_has_no_spectrum())
    if any(line.frequency * mission.collection.aperture_time >= SLOWEST for line in vibration.sinusoidal):
        notes.append(phrases.tones_have_rows(f"{name}.oscillator.acceleration"))
    if mission.synchronization is not None and mission.synchronization.interval is not None:
        notes.append(phrases.left_by_exchanges(mission.synchronization.interval))
    if mission.has_direct_path:
        notes.append(phrases.heard_twice(mission.geometry.echo_delay))
    return (*notes, *override_notes(name, oscillator.overridden, SENSITIVITY))
