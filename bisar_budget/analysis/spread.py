"""Phases that make echoes and phases that spread: tones, noise, and the cubic where nothing else holds it.

Independent powers add, whatever `allocation.combine` says of phases. Each effect is judged once: a tone by PSLR, and
without that requirement its power φ²/2 by ISLR; a cubic phase by its own requirement, and without one its power by
ISLR, since it is in the image's sidelobes.
"""

import math
from typing import NamedTuple

from bisar_budget.analysis.allocation import Allocation
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.analysis.together import Together
from bisar_budget.analysis.vibration_limits import spread_phase
from bisar_budget.effects.clocks import spurs_of
from bisar_budget.effects.echoes import SLOWEST
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.effects.models import CUBIC
from bisar_budget.effects.subject import Subject, subject
from bisar_budget.effects.vibration_lines import counted, lines_of
from bisar_budget.mission.model import Mission, has_instruments

CUBIC_POWER = 4 / 175  # of a cubic phase φ₃ at the edge: its Legendre part 2/5·φ₃, whose mean square is (4/25)/7·φ₃²
SMALLEST_CUBIC_RAD = 1e-6  # of a power of -136 dB; below, exact ranges are rounding
NOISE = ("velocity_random_walk", "angle_random_walk")  # figures of an inertial sensor that spread


class Tone(NamedTuple):
    """A vibration, or a spur of an oscillator: peak phase [rad] and cycles per aperture."""

    subject: Subject
    phase: float
    cycles: float


class Spread(NamedTuple):
    """A row, whose share it counts against, and the variance of the phase that it spreads. [rad²]"""

    row_id: str
    owner: str
    variance: float


def spread_limit(mission: Mission, allocation: Allocation, owner: str, model: str) -> float | None:
    """Rms phase that an owner may spread: the paper's rule, its square is the power, or first principles. [rad]"""
    if mission.requirements.islr is None:
        return None
    power = 10 ** (mission.requirements.islr / 10)
    whole = math.sqrt(power) if model == "published" else spread_phase(power)
    return whole * math.sqrt(allocation.islr.of(owner))


def tones(mission: Mission) -> list[Tone]:
    """List what makes paired echoes: declared vibrations from one cycle per aperture on, and spurs."""
    T, found = mission.collection.aperture_time, []
    for name in PLATFORMS:
        for index, line in enumerate(lines_of(mission, name)):
            if line.frequency * T >= SLOWEST:
                phase = 2 * math.pi * line.amplitude / mission.radar.wavelength
                what = subject(name, "vibration", "sinusoidal", entry=index)
                found.append(Tone(what, phase, line.frequency * T))
    if has_instruments(mission):
        for spur in spurs_of(mission):
            what = subject(spur.name, "oscillator", "spur", entry=spur.entry)
            found.append(Tone(what, spur.phase, spur.frequency * T))
    return found


def noise(analysis: Analysis, model: str) -> list[Spread]:
    """List what spreads beyond the cubic: wideband vibration, noise of sensors, phase noise, links."""
    mission, found = analysis.mission, []
    for name in PLATFORMS:
        wideband = getattr(mission.platforms, name).motion_error.vibration.wideband
        if wideband is not None:
            rms = counted(mission, name, wideband.rms, "islr")
            variance = (2 * math.pi * rms / mission.radar.wavelength) ** 2
            found.append(Spread(subject(name, "vibration", "wideband").id, name, variance))
    for one in analysis.random:
        if one.declared is not None and (one.subject.kind != "imu" or one.subject.axis in NOISE):
            found.append(Spread(one.id, one.owner, (one.effect(model).spread * one.declared) ** 2))
    return found


def spread_powers(analysis: Analysis, allocation: Allocation, owner: str, model: str) -> list[tuple[str, float]]:
    """Row id and phase variance of what ISLR holds of an owner, for the mission of all. [rad²]

    Noise, and the tones and the cubic that no other requirement takes.
    """
    needs = analysis.mission.requirements
    found = noise(analysis, model)
    if needs.pslr is None:
        found += [Spread(one.subject.id, one.subject.owner, one.phase**2 / 2) for one in tones(analysis.mission)]
    powers = [
        (one.row_id, one.variance)
        for one in found
        if owner == "mission" or allocation.islr.includes(one.owner, owner)
    ]
    if needs.cubic_phase_error is None:
        together = Together(analysis, analysis.full if model == "full" else analysis.published)
        cubic = together.cubic_without_coverage(allocation.islr, owner)
        if SMALLEST_CUBIC_RAD < cubic < math.inf:
            powers.append((subject("mission", CUBIC).id, CUBIC_POWER * cubic**2))
    return powers
