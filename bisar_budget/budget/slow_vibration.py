"""Vibration below one cycle per aperture: a quadratic and a cubic phase, as large as in the worst of its phases.

A vibration of peak phase φ and n cycles per aperture has the Legendre parts 5·j₂(πn)·φ and 7·j₃(πn)·φ over the
aperture where they are largest; 3/2 and 5/2 of them stand at its edge. It makes no echoes. Its sign and phase are not
known, so that it counts like any other error: alone against a limit, and in sums and root-sum-squares.
"""

import math
from typing import NamedTuple

from bisar_budget.budget.allocation import Allocation
from bisar_budget.budget.echoes import SLOWEST
from bisar_budget.budget.effects import PLATFORMS
from bisar_budget.budget.judgement import judged
from bisar_budget.budget.models import CUBIC, QUADRATIC
from bisar_budget.budget.pull_in import caps, needed_sentence
from bisar_budget.budget.vibration_lines import Line, lines_of, projected
from bisar_budget.findings.row import Row, subject
from bisar_budget.mission.model import Mission, MotionError
from bisar_budget.units import format_limit


def quadratic_part(cycles: float) -> float:
    """Worst quadratic phase at the aperture edge of a sinusoid, over its peak phase: 7.5·j₂(π·cycles).

    The least-squares quadratic of cos(πnx) over the aperture; half of it is a Taylor term where n is small.
    """
    k = math.pi * cycles
    if k < 0.5:
        return 7.5 * k**2 / 15 * (1 - k**2 / 14 + k**4 / 504)
    return 7.5 * abs((3 / k**2 - 1) * math.sin(k) - 3 * math.cos(k) / k) / k


def cubic_part(cycles: float) -> float:
    """Worst cubic phase likewise: 17.5·j₃(π·cycles), of the least-squares cubic of sin(πnx)."""
    k = math.pi * cycles
    if k < 0.5:
        return 17.5 * k**3 / 105 * (1 - k**2 / 18 + k**4 / 792)
    return 17.5 * abs((15 / k**3 - 6 / k) * math.sin(k) - (15 / k**2 - 1) * math.cos(k)) / k


class SlowPhase(NamedTuple):
    """A vibration below one cycle per aperture: row id, platform, worst-phase QPE and cubic phase. [rad]"""

    row_id: str
    owner: str
    qpe_rad: float
    cubic_rad: float


def slow_phases(mission: Mission) -> list[SlowPhase]:
    """Phases of the declared vibrations below one cycle per aperture, which count with those of other errors."""
    T = mission.collection.aperture_time
    found = []
    for name in PLATFORMS:
        for index, line in enumerate(lines_of(mission, name)):
            cycles = line.frequency * T
            if cycles < SLOWEST:
                phase = 2 * math.pi * line.amplitude / mission.radar.wavelength
                row_id = subject(name, "vibration", "sinusoidal", entry=index).id
                found.append(SlowPhase(row_id, name, phase * quadratic_part(cycles), phase * cubic_part(cycles)))
    return found


class SlowLimits(NamedTuple):
    """Amplitudes at which a slow vibration reaches a platform's quadratic and the required cubic phase. [m]"""

    quadratic: float
    cubic: float | None

    @property
    def smallest(self) -> float:
        """The one that gates."""
        return self.quadratic if self.cubic is None else min(self.quadratic, self.cubic)

    @property
    def binding(self) -> str:
        """The requirement that sets it."""
        return CUBIC if self.smallest < self.quadratic else QUADRATIC


def slow_limits(mission: Mission, allocation: Allocation, name: str, cycles: float) -> SlowLimits:
    """Largest amplitude of a vibration below one cycle per aperture, in its worst phase.

    The quadratic phase is held to the platform's share, autofocus gain included; the cubic phase, where it is
    required, to the whole requirement without gain.
    """
    wavenumber = 2 * math.pi / mission.radar.wavelength
    quadratic = allocation.qpe_limit(name) * allocation.autofocus_gain / (wavenumber * quadratic_part(cycles))
    required = mission.requirements.cubic_phase_error
    return SlowLimits(quadratic, None if required is None else required / (wavenumber * cubic_part(cycles)))


def slow_row(mission: Mission, allocation: Allocation, name: str, index: int, line: Line) -> Row:
    """Judge a vibration below one cycle per aperture as the quadratic and cubic phase that it is."""
    error: MotionError = getattr(mission.platforms, name).motion_error
    combine, gain = mission.allocation.combine, allocation.autofocus_gain
    cycles = line.frequency * mission.collection.aperture_time
    phase = 2 * math.pi * line.amplitude / mission.radar.wavelength
    qpe, cubic = phase * quadratic_part(cycles), phase * cubic_part(cycles)
    limits = slow_limits(mission, allocation, name, cycles)
    limit = allocation.qpe_limit(name) * gain
    if limits.binding == CUBIC:
        allowed = format_limit(mission.requirements.cubic_phase_error or 0.0, "rad")
        over = f"cubic phase {cubic:.3g} rad in the worst phase, {allowed} allowed; autofocus gain does not apply"
    else:
        needed = needed_sentence(allocation.n_pull_needed(qpe, name), caps(mission)) if qpe > limit else ""
        over = f"QPE {qpe:.3g} rad in the worst phase, {format_limit(limit, 'rad')} allowed; {needed}"
    use = line.amplitude / limits.smallest
    row = judged(
        mission,
        subject=subject(name, "vibration", "sinusoidal", entry=index),
        metric=QUADRATIC,
        unit="m",
        declared=line.amplitude,
        allowable=limits.smallest,
        path=("platforms", name, "motion_error", "vibration", "sinusoidal", index, "amplitude"),
        equation="first principles",
        gain=qpe / (limit / gain) / use if use else 1.0,  # a cubic phase has none
        over=over,
        info="" if combine == "each" else f"combine is {combine}: the aggregate decides",
        limits=(limits.quadratic, limits.quadratic),
        qpe=qpe,
        qpe_full=qpe,
        evidence=error.source,
        notes=(
            *projected(error.vibration.sinusoidal[index].amplitude, error, line.amplitude),
            f"{cycles:.2g} cycles per aperture: below one a vibration makes no echoes but, in its worst phase, a "
            f"quadratic phase of {qpe:.3g} rad or a cubic phase of {cubic:.3g} rad",
        ),
    )
    return row._replace(binding_requirement=limits.binding, cubic_rad=cubic)
