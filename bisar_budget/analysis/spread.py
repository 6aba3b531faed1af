"""What spreads over the image: wideband vibration, noise of sensors, phase noise. Independent, so powers add.

Noise of a phase variance σ² leaves exp(-σ²) of the energy in the response and spreads the rest over the image. Of the
response a share E lies within the first nulls, which an image counts as its mainlobe, so that noise adds
(exp(σ²) - 1)/E to the ISLR. The paper's rule takes σ² for it.
"""

import math
from typing import Any

from bisar_budget.analysis.allocation import Allocation
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.constants import MAINLOBE_ENERGY
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.effects.subject import subject
from bisar_budget.effects.vibration_lines import counted
from bisar_budget.mission.model import Mission, Simulation


def mainlobe_energy(mission: Mission) -> float:
    """Share E of the error-free response's energy within its first nulls, under the window of the images."""
    return MAINLOBE_ENERGY[(mission.simulation or Simulation()).window]


def spread_phase(ratio: Any, model: str, energy: float, xp: Any = math) -> Any:
    """Rms phase of noise that adds an ISLR, inverse of `islr_db`. [rad]

    Parameters
    ----------
    ratio : float or array
        ISLR, a power ratio.
    model : str
        `published` for the paper's rule; any other is what an image shows.
    energy : float
        Share E, see `mainlobe_energy`.
    xp : module
        `math` for floats, `numpy` for arrays.
    """
    return xp.sqrt(ratio if model == "published" else xp.log1p(ratio * energy))


def islr_db(variance: Any, model: str, energy: float, xp: Any = math) -> Any:
    """ISLR that noise of a phase variance [rad²], above 0, adds: σ² by the paper's rule, else as an image shows. [dB]

    Parameters are those of `spread_phase`.
    """
    if model == "published":
        return 10 * xp.log10(variance)
    # Of (exp(σ²) - 1)/E, without exp(σ²), which overflows.
    return 10 / math.log(10) * (variance + xp.log(-xp.expm1(-variance)) - math.log(energy))


def shown_islr_db(mission: Mission, variance: float) -> float | None:
    """ISLR that noise of a phase variance [rad²] adds to an image; None where there is none. [dB]"""
    return islr_db(variance, "full", mainlobe_energy(mission)) if variance else None


def spread_limit(mission: Mission, allocation: Allocation, owner: str, model: str) -> float | None:
    """Rms phase that an owner may spread, by the paper's rule or as an image shows it. [rad]"""
    if mission.requirements.islr is None:
        return None
    whole: float = spread_phase(10 ** (mission.requirements.islr / 10), model, mainlobe_energy(mission))
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
