"""Vibration below one cycle per aperture: a quadratic and a cubic phase, as large as in the worst of its phases.

A vibration of peak phase φ and n cycles per aperture has the Legendre parts 5·j₂(πn)·φ and 7·j₃(πn)·φ over the
aperture where they are largest; 3/2 and 5/2 of them stand at its edge. It makes no echoes. Its sign and phase are not
known, so that it counts like any other error: alone against a limit, and in sums and root-sum-squares.
"""

import math
from typing import NamedTuple

from bisar_budget.effects.echoes import SLOWEST
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.effects.subject import subject
from bisar_budget.effects.tones import SLOW, tone
from bisar_budget.effects.vibration_lines import Line, lines_of
from bisar_budget.geometry import norm
from bisar_budget.mission.model import Mission


def quadratic_part(cycles: float) -> float:
    """Worst quadratic phase at the aperture edge of a sinusoid, over its peak phase: 7.5·j₂(π·cycles).

    The least-squares quadratic of cos(πnx) over the aperture; half of it is a Taylor term where n is small.
    """
    return abs(tone(math.pi * cycles)[0])


def cubic_part(cycles: float) -> float:
    """Worst cubic phase likewise: 17.5·j₃(π·cycles), of the least-squares cubic of sin(πnx)."""
    return abs(tone(math.pi * cycles)[1])


class OwnPhase(NamedTuple):
    """Phases that count in sums and have no row of a displacement: row id, owner, QPE and cubic phase. [rad]

    `coverage` is the coverage factor that both phases have in them; `moves` the most by which a slow vibration
    displaces the image. [m]
    """

    row_id: str
    owner: str
    qpe_rad: float
    cubic_rad: float
    coverage: float = 1.0
    moves: float = 0.0


def slow_phases(mission: Mission) -> list[OwnPhase]:
    """Phases of the declared vibrations below one cycle per aperture, which count with those of other errors."""
    T = mission.collection.aperture_time
    found = []
    for name in PLATFORMS:
        for index, line in enumerate(lines_of(mission, name)):
            cycles = line.frequency * T
            if cycles < SLOWEST:
                phase = 2 * math.pi * line.amplitude / mission.radar.wavelength
                row_id = subject(name, "vibration", "sinusoidal", entry=index).id
                qpe, cubic = phase * quadratic_part(cycles), phase * cubic_part(cycles)
                moves = _largest_displacement(mission, name, index, line)
                found.append(OwnPhase(row_id, name, qpe, cubic, moves=moves))
    return found


def _largest_displacement(mission: Mission, name: str, index: int, line: Line) -> float:
    """Upper bound of what a slow vibration displaces the image by, in any phase, to first order. [m]

    Its mean A·j₀(x) and its slope (2/T)·3A·j₁(x), x = πfT, are those of a range error, which lie a quarter of a cycle
    apart; a line of sight that turns sees what moves across it as well. Along the gradients s and ṡ a metre of the
    one is 1/(|s| sin γ) on the ground and a metre per second of the other 1/(|ṡ| sin γ).
    """
    platform, geometry = getattr(mission.platforms, name), mission.geometry
    T, stated = mission.collection.aperture_time, platform.motion_error.vibration.sinusoidal[index].amplitude
    x = math.pi * line.frequency * T
    mean = math.sin(x) / x
    slope = 3 * (math.sin(x) / x - math.cos(x)) / x if x > SLOW else x  # 3·j₁(x), which is below x
    rate = 2 / T * line.amplitude * slope
    if isinstance(stated, tuple):
        rate += math.hypot(*stated) * norm(platform.state.look_rate)
    if mission.has_direct_path:
        whole = math.hypot(*stated) if isinstance(stated, tuple) else stated
        rate += whole * norm(geometry.apart.look_rate)
    sine = math.sin(geometry.gradient_angle)
    return math.hypot(
        line.amplitude * mean / (math.hypot(*geometry.range_gradient) * sine),
        rate / (math.hypot(*geometry.doppler_gradient) * sine),
    )
