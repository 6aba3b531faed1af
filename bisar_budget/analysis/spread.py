"""Phases that cause echoes or spread energy over the image: tones, noise, and cubic phases.

Independent powers add, even if `allocation.combine` sets another rule for phases. Each effect is judged only once. A
tone counts against PSLR. If there is no requirement on PSLR, its power φ²/2 counts against ISLR. A cubic phase counts
against its own requirement. If there is no such requirement, its power counts against ISLR, since it raises the
sidelobes.

Noise with the phase variance σ² leaves the fraction exp(-σ²) of the energy in the impulse response, and spreads the
remaining energy over the image. In an image, the mainlobe is taken to extend to the first nulls of the response. It
contains the fraction E of the response's energy. Noise therefore adds (exp(σ²) - 1)/E to the ISLR. The rule of
Rigling & Moses adds σ² instead.
"""

import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bisar_budget.analysis.allocation import Allocation
from bisar_budget.arrays import Floats, PerCase, PerCaseFlag
from bisar_budget.constants import MAINLOBE_ENERGY
from bisar_budget.effects.declared import CUBIC, DeclaredErrors
from bisar_budget.effects.effect import PLATFORMS, Subject, subject
from bisar_budget.effects.oscillator_acceleration import accelerated_tones
from bisar_budget.effects.oscillator_tones import LeftTone, spurs_of
from bisar_budget.effects.random_effect import RandomError
from bisar_budget.effects.slow_tones import SlowTone
from bisar_budget.effects.vibration import SLOWEST_ECHO_CYCLES, DeclaredPhase, counted, lines_of
from bisar_budget.geometry import BistaticGeometry
from bisar_budget.mission.model import Mission, Simulation, has_instruments

if TYPE_CHECKING:
    from bisar_budget.analysis.analysis import Analysis

CUBIC_POWER = 4 / 175  # a cubic phase φ₃ at the edge has the Legendre part 2/5·φ₃, with the mean square (4/25)/7·φ₃²
SMALLEST_CUBIC_RAD = 1e-3  # a power of -76 dB, which no image shows
SMALLEST_REST_RAD = 1e-3  # rms, a power of -60 dB


class Tone(NamedTuple):
    """Sinusoidal phase error due to a platform's vibration, an oscillator's spur, or an oscillator's vibration.

    `phase` is the peak phase [rad], and `cycles` is the number of cycles per aperture. `in_quadrature` is the row id
    of another tone, relative to which this tone is shifted by a quarter cycle. If it is None, the tone may have any
    phase.
    """

    subject: Subject
    phase: Any
    cycles: Any
    is_there: PerCaseFlag = True  # cases in which a vibration is fast enough
    in_quadrature: str | None = None


class SpreadPhase(NamedTuple):
    """Phase error that spreads energy over the image, with its variance [rad²] and the id of its row.

    The error counts against its owner's share of the ISLR requirement. The owner is a platform, the clock or the
    mission.
    """

    row_id: str
    owner: str
    variance: Any


class StatedPower(NamedTuple):
    """Error for which the mission file states a contribution to the ISLR [dB], as determined by the user."""

    subject: Subject
    islr: Any

    def rms(self, model: str, energy: float) -> Any:
        """Rms phase of the noise that would add the stated ISLR. [rad]

        For the parameters `model` and `energy` see `spread_phase`.
        """
        return spread_phase(10 ** (np.asarray(self.islr) / 10), model, energy)


def mainlobe_energy(mission: Mission) -> float:
    """Fraction E of the impulse response's energy that lies within the first nulls.

    The response is error-free and uses the window that the mission states for image formation.
    """
    return MAINLOBE_ENERGY[(mission.simulation or Simulation()).window]


def spread_phase(ratio: PerCase, model: str, energy: float) -> Any:
    """Rms phase of the noise that adds a given ISLR. [rad]

    This is the inverse of `islr_db`.

    Parameters
    ----------
    ratio : float or array
        ISLR as a power ratio.
    model : str
        `published` or `full`. With σ² as the variance of the phase, the ISLR is σ² in the published model, by the
        rule of Rigling & Moses, and (exp(σ²) - 1)/E in the full model, as in an image.
    energy : float
        Fraction E of the response's energy within the first nulls, see `mainlobe_energy`.
    """
    return np.sqrt(ratio if model == "published" else np.log1p(ratio * energy))


def islr_db(variance: PerCase, model: str, energy: float) -> Any:
    """ISLR that noise with a given phase variance adds. [dB]

    The variance σ² [rad²] must be above 0. In the published model the ISLR is σ², by the rule of Rigling & Moses. In
    the full model it is (exp(σ²) - 1)/E, as in an image. `energy` is the fraction E, see `mainlobe_energy`.
    """
    if model == "published":
        return 10 * np.log10(variance)
    # The logarithm of (exp(σ²) - 1)/E, without exp(σ²), which overflows.
    return 10 / math.log(10) * (variance + np.log(-np.expm1(-variance)) - math.log(energy))


def islr_of(mission: Mission, variance: PerCase) -> Floats:
    """ISLR that noise with a given phase variance [rad²] adds to an image of the mission. [dB]

    It is NaN where the variance is 0 or NaN.
    """
    with np.errstate(all="ignore"):
        return np.where(variance > 0, islr_db(variance, "full", mainlobe_energy(mission)), math.nan)


def spread_limit(mission: Mission, allocation: Allocation, owner: str, model: str) -> Any:
    """Largest rms noise phase with which an owner stays within its share of the required ISLR. [rad]

    An owner is a platform, the clock or the mission. In the published model the limit follows from the rule of
    Rigling & Moses, ISLR = σ². In the full model it follows from the ISLR in an image. The result is None if the
    mission has no requirement on ISLR.
    """
    if mission.requirements.islr is None:
        return None
    rms_of_mission = spread_phase(10 ** (np.asarray(mission.requirements.islr) / 10), model, mainlobe_energy(mission))
    return rms_of_mission * np.sqrt(allocation.islr.of(owner))


def tones(mission: Mission, geometry: BistaticGeometry | None = None) -> list[Tone]:
    """List the tones that make paired echoes.

    They are vibrations of platforms with at least one cycle per aperture, tones of vibrating oscillators, and spurs.
    `geometry` holds many cases if numbers of the mission are arrays.
    """
    T, echoes = mission.collection.aperture_time, []
    for name in PLATFORMS:
        for index, line in enumerate(lines_of(mission, name, geometry)):
            cycles = line.frequency * T
            is_there = np.asarray(cycles >= SLOWEST_ECHO_CYCLES)[()]
            if np.any(is_there):
                phase = 2 * math.pi * line.amplitude / mission.radar.wavelength
                row_subject = subject(name, "vibration", "sinusoidal", entry=index)
                echoes.append(Tone(row_subject, phase, cycles, is_there))
    if has_instruments(mission):
        for spur in spurs_of(mission, geometry):
            echoes += _echoes(Tone(spur.subject, spur.phase, spur.frequency * T), spur.free, spur.left, mission)
        for accelerated in accelerated_tones(mission, geometry):
            cycles = accelerated.frequency * T
            alone = Tone(
                accelerated.subject,
                accelerated.phase,
                cycles,
                np.asarray(cycles >= SLOWEST_ECHO_CYCLES)[()],
                accelerated.in_quadrature,
            )
            echoes += _echoes(alone, accelerated.free * accelerated.sensitivity, accelerated.left, mission)
    return [accelerated for accelerated in echoes if np.any(accelerated.is_there)]


def _echoes(alone: Tone, free: PerCase, remaining: LeftTone, mission: Mission) -> list[Tone]:
    """List the tones that remain of an oscillator's tone after synchronization, as sources of paired echoes.

    `alone` represents the result of synchronization as a single tone. If synchronization does not fold the
    oscillator's tone to other frequencies, the list contains only `alone`. If synchronization folds it to several
    frequencies, the list has a tone for each of them. Without a requirement on PSLR, a folded tone is listed as a
    single tone instead, which has the total power at the frequency of the largest echo. `free` [rad] is the peak
    phase of the oscillator's tone without synchronization.
    """
    if not remaining.is_folded:
        return [alone]
    T = mission.collection.aperture_time
    if mission.requirements.pslr is None:
        cycles = remaining.place(T) * T
        return [Tone(alone.subject, alone.phase, cycles, np.asarray(alone.phase > 0)[()])]
    each = [
        Tone(alone.subject, free * share, frequency * T, np.asarray(share > 0)[()])
        for frequency, share in zip(remaining.frequencies, remaining.echoes(T), strict=True)
    ]
    return [each[0]._replace(in_quadrature=alone.in_quadrature), *each[1:]]


def noise(
    mission: Mission, geometry: BistaticGeometry, random: Iterable[RandomError], model: str
) -> list[SpreadPhase]:
    """List the phase errors that are due to noise and spread energy over the image, with their variances [rad²].

    They are due to wideband vibration, to the random errors `random`, and to errors whose ISLR contribution the
    mission file states. The random errors are sensor noise, phase noise and the noise of synchronization links.
    """
    spreads = []
    for name in PLATFORMS:
        wideband = getattr(mission.platforms, name).motion_error.vibration.wideband
        if wideband is not None:
            rms = counted(mission, name, wideband.rms, "islr", geometry)
            variance = (2 * math.pi * rms / mission.radar.wavelength) ** 2
            spreads.append(SpreadPhase(subject(name, "vibration", "wideband").id, name, variance))
    for error in random:
        if error.declared is not None and error.spreads and not error.counted_in:
            spreads.append(SpreadPhase(error.id, error.owner, (error.effect(model).spread * error.declared) ** 2))
    energy = mainlobe_energy(mission)
    for power in stated_powers(mission):
        spreads.append(SpreadPhase(power.subject.id, power.subject.owner, power.rms(model, energy) ** 2))
    return spreads


def rests(
    errors: DeclaredErrors,
    random: Iterable[RandomError],
    slow: Iterable[DeclaredPhase],
    slow_tones: Mapping[str, SlowTone],
) -> list[SpreadPhase]:
    """List, for each error, the part of its phase beyond the cubic order, with the variance of this part [rad²].

    The errors are errors of motion, clocks and sensors, and slow vibrations. The variances are at one sigma, without
    coverage factor. Negligible phases are left out. The phases are very small for short apertures, and larger for an
    aperture of a quarter of a circle. They are computed with the full model. Where a line of sight turns by more than
    a radian, they are left out. In this case the quadratic phase is defined as the phase that lowers the peak as much
    as the whole error does, so it already includes them.

    Parameters
    ----------
    errors : DeclaredErrors
        Errors of motion and clocks.
    random : iterable of RandomError
        Errors of sensors, clocks and the air.
    slow : iterable of DeclaredPhase
        Phases of vibrations below one cycle per aperture.
    slow_tones : mapping of str to SlowTone
        Vibrations below three cycles per aperture. The keys are the ids of their rows.
    """
    spreads, factor = [], errors.mission.allocation.coverage_factor
    for error in errors.stated:
        if error.is_motion:
            at_rms = errors.at_rms("full", error)
            rms = np.asarray(errors.does("full", error).rest) / (factor if error.is_covered else 1.0)
            rms = rms if at_rms is None else np.asarray(at_rms.rest)
            shows = (rms > SMALLEST_REST_RAD) & np.isfinite(rms) & ~errors.exact.is_turned
            if shows.any():
                spreads.append(SpreadPhase(error.id, error.owner, np.where(shows, rms**2, math.nan)))
    for sensor in random:
        if sensor.declared is not None and not sensor.counted_in:
            rms = np.asarray(sensor.full.rest * sensor.declared)
            shows = rms > SMALLEST_REST_RAD
            if shows.any():
                spreads.append(SpreadPhase(sensor.id, sensor.owner, np.where(shows, rms**2, math.nan)))
    is_slow = {phase.row_id: phase.is_there for phase in slow}
    for tone in slow_tones.values():
        rms = tone.declared.rest
        shows = is_slow.get(tone.subject.id, False) & (rms > SMALLEST_REST_RAD) & ~errors.exact.is_turned
        if shows.any():
            spreads.append(SpreadPhase(tone.subject.id, tone.subject.owner, np.where(shows, rms**2, math.nan)))
    return spreads


def stated_powers(mission: Mission) -> list[StatedPower]:
    """List the errors for which the file states a contribution to the ISLR, as determined by the user."""
    return [
        StatedPower(subject("mission", "other", f"{stated.name}.islr", entry=index), stated.islr)
        for index, stated in enumerate(mission.other_errors)
        if stated.islr is not None
    ]


def powers_held_by_islr(analysis: "Analysis", owners: Iterable[str], model: str) -> list[list[SpreadPhase]]:
    """List, for each owner, the phase errors that count against its share of the ISLR.

    An owner is a platform, the clock or `mission`, which means all owners together. The phase errors are noise and
    the parts of phases beyond the cubic order. Tones are included if there is no requirement on PSLR. The cubic
    phase, combined over the owner's errors at one sigma, is included if it has no requirement of its own. It is left
    out where it is negligible, or where an error is so large that there is no image. A variance [rad²] is NaN in the
    cases in which the phase error is left out or does not occur.
    """
    mission, split, together = analysis.mission, analysis.allocation.islr, analysis.together(model)
    spreads = analysis.noise[model] + analysis.rests[model]
    if mission.requirements.pslr is None:
        for spread in analysis.tones:
            variance = np.where(spread.is_there, spread.phase**2 / 2, math.nan)[()]
            spreads.append(SpreadPhase(spread.subject.id, spread.subject.owner, variance))
    powers_by_owner = []
    for owner in owners:
        powers = [spread for spread in spreads if split.includes(spread.owner, owner)]
        if mission.requirements.cubic_phase_error is None:
            phase = together.cubic_without_coverage(split, owner)
            shows = (phase > SMALLEST_CUBIC_RAD) & np.isfinite(phase)
            if shows.any():
                variance = np.where(shows, CUBIC_POWER * phase**2, math.nan)
                powers.append(SpreadPhase(subject("mission", CUBIC).id, "mission", variance))
        powers_by_owner.append(powers)
    return powers_by_owner


def declared_powers(analysis: "Analysis", owner: str, model: str) -> list[SpreadPhase]:
    """List the phase errors that count against an owner's share of the ISLR, for a single case.

    The errors are given as single numbers instead of arrays. `owner` is a platform, the clock or `mission`, and
    `model` is `published` or `full`.
    """
    (powers,) = powers_held_by_islr(analysis, [owner], model)
    return [power._replace(variance=float(np.ravel(power.variance)[0])) for power in powers]
