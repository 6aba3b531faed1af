"""Phases that cause echoes or spread energy over the image: tones, noise, and cubic phase without a requirement.

Independent powers add, even if `allocation.combine` sets another rule for phases. Each effect is judged once. A tone
counts against PSLR or, without a requirement on PSLR, with its power φ²/2 against ISLR. A cubic phase counts against
its own requirement. Without such a requirement its power counts against ISLR, since it is part of the sidelobes.

Noise of phase variance σ² leaves exp(-σ²) of the energy in the response and spreads the rest over the image. A share
E of the response lies within the first nulls, which are taken as the limits of the mainlobe in an image. Noise
therefore adds (exp(σ²) - 1)/E to the ISLR. The paper's rule adds σ² instead.
"""

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bisar_budget.analysis.allocation import Allocation
from bisar_budget.arrays import Floats, PerCase, PerCaseFlag
from bisar_budget.constants import MAINLOBE_ENERGY
from bisar_budget.effects.declared import CUBIC
from bisar_budget.effects.effect import PLATFORMS, Subject, subject
from bisar_budget.effects.oscillator_acceleration import accelerated_tones
from bisar_budget.effects.oscillator_tones import LeftTone, spurs_of
from bisar_budget.effects.vibration import SLOWEST_ECHO_CYCLES, counted, lines_of
from bisar_budget.geometry import BistaticGeometry
from bisar_budget.mission.model import Mission, Simulation, has_instruments

if TYPE_CHECKING:
    from bisar_budget.analysis.analysis import Analysis

CUBIC_POWER = 4 / 175  # a cubic phase φ₃ at the edge has the Legendre part 2/5·φ₃, with the mean square (4/25)/7·φ₃²
SMALLEST_CUBIC_RAD = 1e-3  # a power of -76 dB, which no image shows
SMALLEST_REST_RAD = 1e-3  # rms, a power of -60 dB


class Tone(NamedTuple):
    """Tone of a platform's vibration, of an oscillator's spur, or of an oscillator's vibration.

    `phase` is the peak phase [rad], and `cycles` the number of cycles per aperture. `in_quadrature` is the row of
    another tone whose phase is a quarter cycle away from this tone's. If it is None, the tone may have any phase.
    """

    subject: Subject
    phase: Any
    cycles: Any
    is_there: PerCaseFlag = True  # cases in which a vibration is fast enough
    in_quadrature: str | None = None


class SpreadPhase(NamedTuple):
    """Variance of a spread phase [rad²], with the id of its row and the owner of the share it counts against."""

    row_id: str
    owner: str
    variance: Any


class StatedPower(NamedTuple):
    """Error that was determined elsewhere and is stated by the ISLR that it adds. [dB]"""

    subject: Subject
    islr: Any

    def rms(self, model: str, energy: float) -> Any:
        """Rms phase that spreads the same power in a model, see `spread_phase`. [rad]"""
        return spread_phase(10 ** (np.asarray(self.islr) / 10), model, energy)


def mainlobe_energy(mission: Mission) -> float:
    """Share E of the response's energy that lies within its first nulls.

    The response is that without errors, under the window of the images.
    """
    return MAINLOBE_ENERGY[(mission.simulation or Simulation()).window]


def spread_phase(ratio: PerCase, model: str, energy: float) -> Any:
    """Rms phase of noise that adds a given ISLR, the inverse of `islr_db`. [rad]

    Parameters
    ----------
    ratio : float or array
        ISLR as a power ratio.
    model : str
        `published` takes the ISLR by the paper's rule, σ². Any other name takes the ISLR of an image.
    energy : float
        Share E, see `mainlobe_energy`.
    """
    return np.sqrt(ratio if model == "published" else np.log1p(ratio * energy))


def islr_db(variance: PerCase, model: str, energy: float) -> Any:
    """ISLR that noise with a phase variance [rad²] above 0 adds. [dB]

    In the published model it is σ², by the paper's rule; otherwise it is the ISLR of an image. `spread_phase`
    documents the parameters.
    """
    if model == "published":
        return 10 * np.log10(variance)
    # The logarithm of (exp(σ²) - 1)/E, without exp(σ²), which overflows.
    return 10 / math.log(10) * (variance + np.log(-np.expm1(-variance)) - math.log(energy))


def islr_of(mission: Mission, variance: PerCase) -> Floats:
    """ISLR that noise with a phase variance [rad²] adds to an image; NaN without noise. [dB]"""
    with np.errstate(all="ignore"):
        return np.where(variance > 0, islr_db(variance, "full", mainlobe_energy(mission)), math.nan)


def spread_limit(mission: Mission, allocation: Allocation, owner: str, model: str) -> Any:
    """Largest rms phase that an owner may spread under the requirement on ISLR; None without that requirement. [rad]

    In the published model it follows from the paper's rule, otherwise from the ISLR of an image.
    """
    if mission.requirements.islr is None:
        return None
    rms_of_mission = spread_phase(10 ** (np.asarray(mission.requirements.islr) / 10), model, mainlobe_energy(mission))
    return rms_of_mission * np.sqrt(allocation.islr.of(owner))


def tones(mission: Mission, geometry: BistaticGeometry | None = None) -> list[Tone]:
    """List the tones that make paired echoes.

    These are vibrations with at least one cycle per aperture, tones of vibrating oscillators, and spurs. `geometry`
    holds many cases if numbers of the mission are arrays.
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
    """Tones that represent the echoes of an oscillator's tone.

    A folded tone gives one tone per frequency. Without a PSLR requirement it gives one tone with all of the power, at
    the frequency of the largest echo.
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


def noise(analysis: "Analysis", model: str) -> list[SpreadPhase]:
    """List the noise phases, which spread energy over the image, with their variances [rad²].

    They come from wideband vibration, sensor noise, phase noise, synchronization links, and powers that the file
    states.
    """
    mission, spreads = analysis.mission, []
    for name in PLATFORMS:
        wideband = getattr(mission.platforms, name).motion_error.vibration.wideband
        if wideband is not None:
            rms = counted(mission, name, wideband.rms, "islr", analysis.geometry)
            variance = (2 * math.pi * rms / mission.radar.wavelength) ** 2
            spreads.append(SpreadPhase(subject(name, "vibration", "wideband").id, name, variance))
    for error in analysis.random:
        if error.declared is not None and error.spreads and not error.counted_in:
            spreads.append(SpreadPhase(error.id, error.owner, (error.effect(model).spread * error.declared) ** 2))
    energy = mainlobe_energy(mission)
    for power in stated_powers(mission):
        spreads.append(SpreadPhase(power.subject.id, power.subject.owner, power.rms(model, energy) ** 2))
    return spreads


def rests(analysis: "Analysis", model: str) -> list[SpreadPhase]:
    """List the phases beyond the cubic order of errors of motion, clocks, sensors and slow vibrations.

    Their variances [rad²] are those at one sigma. Negligible ones are left out. They are very small for short
    apertures, and larger for a quarter of a circle. The list is empty in the published model. Where a line of sight
    turns by more than a radian, the phase of equal loss already contains them.
    """
    if model == "published":
        return []
    spreads, errors = [], analysis.errors
    factor = analysis.mission.allocation.coverage_factor
    for error in errors.stated:
        if error.is_motion:
            rms = np.asarray(errors.does(model, error).rest) / (factor if error.is_covered else 1.0)
            shows = (rms > SMALLEST_REST_RAD) & np.isfinite(rms) & ~errors.exact.is_turned
            if shows.any():
                spreads.append(SpreadPhase(error.id, error.owner, np.where(shows, rms**2, math.nan)))
    for sensor in analysis.random:
        if sensor.declared is not None and not sensor.counted_in:
            rms = np.asarray(sensor.full.rest * sensor.declared)
            shows = rms > SMALLEST_REST_RAD
            if shows.any():
                spreads.append(SpreadPhase(sensor.id, sensor.owner, np.where(shows, rms**2, math.nan)))
    slow = {phase.row_id: phase.is_there for phase in analysis.slow}
    for tone in analysis.slow_tones.values():
        rms = tone.declared.rest
        shows = slow.get(tone.subject.id, False) & (rms > SMALLEST_REST_RAD) & ~errors.exact.is_turned
        if shows.any():
            spreads.append(SpreadPhase(tone.subject.id, tone.subject.owner, np.where(shows, rms**2, math.nan)))
    return spreads


def stated_powers(mission: Mission) -> list[StatedPower]:
    """List the errors determined elsewhere that the file states by the ISLR that they add."""
    return [
        StatedPower(subject("mission", "other", f"{stated.name}.islr", entry=index), stated.islr)
        for index, stated in enumerate(mission.other_errors)
        if stated.islr is not None
    ]


def powers_held_by_islr(analysis: "Analysis", owners: Iterable[str], model: str) -> list[list[SpreadPhase]]:
    """List, for each owner, the phases that count against its share of the ISLR.

    For the owner `mission`, these are the phases of all owners. The phases are noise, the phases of errors beyond the
    cubic order, the tones if there is no requirement on PSLR, and the cubic phase if it has no requirement of its
    own. The cubic phase combines the errors of the owner at one sigma. It is left out where it is negligible, or
    where an error is too large for an image. A variance [rad²] is NaN in cases that do not have the phase.
    """
    mission, split, together = analysis.mission, analysis.allocation.islr, analysis.together(model)
    spreads = noise(analysis, model) + analysis.rests(model)
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
    """List the phases of an owner that count against ISLR, for a single case, in plain numbers."""
    (powers,) = powers_held_by_islr(analysis, [owner], model)
    return [power._replace(variance=float(np.ravel(power.variance)[0])) for power in powers]
