"""What spreads over the image: wideband vibration, noise of sensors, phase noise. Independent, so powers add."""

import math

from bisar_budget.analysis.allocation import Allocation
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.analysis.vibration_limits import spread_phase
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.effects.subject import subject
from bisar_budget.effects.vibration_lines import counted
from bisar_budget.mission.model import Mission


def spread_limit(mission: Mission, allocation: Allocation, owner: str, model: str) -> float | None:
    """Rms phase that an owner may spread: the paper's rule, its square is the power, or first principles. [rad]"""
    if mission.requirements.islr is None:
        return None
    power = 10 ** (mission.requirements.islr / 10)
    whole = math.sqrt(power) if model == "published" else spread_phase(power)
    return whole * math.sqrt(allocation.islr.of(owner))


def spread_powers(analysis: Analysis, allocation: Allocation, owner: str, model: str) -> list[tuple[str, float]]:
    """Row id and phase variance of what spreads and counts against an owner's share; all, for the mission. [rad²]"""
    mission, found = analysis.mission, []
    for name in PLATFORMS:
        wideband = getattr(mission.platforms, name).motion_error.vibration.wideband
        if wideband is not None:
            rms = counted(mission, name, wideband.rms, "islr")
            variance = (2 * math.pi * rms / mission.radar.wavelength) ** 2
            found.append((subject(name, "vibration", "wideband").id, name, variance))
    for one in analysis.random:
        spread = one.effect(model).spread
        if one.declared is not None and spread:
            found.append((one.id, one.owner, (spread * one.declared) ** 2))
    return [(row_id, v) for row_id, whose, v in found if owner == "mission" or allocation.islr.includes(whose, owner)]
