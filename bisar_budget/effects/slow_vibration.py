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
from bisar_budget.effects.tones import tone
from bisar_budget.effects.vibration_lines import lines_of
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
    """What has no displacement, but phases that count in sums: row id, owner, QPE and cubic phase. [rad]

    `coverage` is the coverage factor that both phases have in them.
    """

    row_id: str
    owner: str
    qpe_rad: float
    cubic_rad: float
    coverage: float = 1.0


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
                found.append(OwnPhase(row_id, name, phase * quadratic_part(cycles), phase * cubic_part(cycles)))
    return found
