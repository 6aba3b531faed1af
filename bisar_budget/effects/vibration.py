"""Declared vibrations as they count: along the line of sight, and below one cycle per aperture as phases.

Of a receiver that hears the transmitter data hold ranges less the direct path: there a vibration counts as what it
changes of that.

A vibration of peak phase φ and n < 1 cycles per aperture makes no echoes. It has the Legendre parts 5·j₂(πn)·φ and
7·j₃(πn)·φ over the aperture where they are largest; 3/2 and 5/2 of them stand at its edge. Its sign and phase are not
known, so that it counts like any other error: alone against a limit, and in sums and root-sum-squares.

Numbers of a mission may be arrays (cases,); its geometry then is that of these cases, else the mission's own.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from bisar_budget import phrases
from bisar_budget.constants import ROUNDING
from bisar_budget.effects.echoes import SLOWEST
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.effects.subject import subject
from bisar_budget.effects.tones import SLOW, tone
from bisar_budget.geometry import FRAME_AXES, Vector, dot
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import MotionError
from bisar_budget.phrases import Note
from bisar_budget.units import format_quantity


class Line(NamedTuple):
    """One sinusoid: amplitude along the line of sight, 0 to peak [m], and frequency [Hz]."""

    amplitude: Any
    frequency: Any


def along_line_of_sight(value: Any, error: MotionError, state: Any, metric: str, sight: Vector | None = None) -> Any:
    """Amplitude (`pslr`) or rms (`islr`) along the line of sight at the aperture midpoint. [m]

    A single value is along it. Of a vector, amplitudes along the axes of the error's frame, projections add: the
    axes may vibrate in any phase. Rms values are taken for independent and add as squares. `sight` is what a metre
    takes from the range, where that is not the line of sight.
    """
    if not isinstance(value, tuple):
        return value if sight is None else value * np.abs(dot(state.look, sight))
    along = [dot(axis, sight or state.look) for axis in state.frame(error.frame)]
    floor = ROUNDING * np.sqrt(sum(one * one for one in along))
    parts = [np.where(np.abs(one) > floor, one, 0.0) * size for one, size in zip(along, value, strict=True)]
    return sum(map(np.abs, parts)) if metric == "pslr" else np.sqrt(sum(part * part for part in parts))


def sight_of(mission: Mission, name: str, geometry: Any = None) -> Vector:
    """Part of a metre of a platform's motion that the range loses, or the range less the direct path. [-]"""
    sights = (geometry or mission.geometry).sights(has_direct_path=mission.has_direct_path)
    found: Vector = sights[PLATFORMS.index(name)]
    return found


def counted(mission: Mission, name: str, value: Any, metric: str, geometry: Any = None) -> Any:
    """The same of a platform of a mission: what changes the range, or the range less the direct path. [m]"""
    platform = getattr(mission.platforms, name)
    error: MotionError = platform.motion_error
    state = getattr(geometry or mission.geometry, name)
    sight = sight_of(mission, name, geometry) if mission.has_direct_path else None
    return along_line_of_sight(value, error, state, metric, sight)


def lines_of(mission: Mission, name: str, geometry: Any = None) -> list[Line]:
    """Sinusoids of one platform, along the line of sight."""
    error: MotionError = getattr(mission.platforms, name).motion_error
    lines = error.vibration.sinusoidal
    return [Line(counted(mission, name, line.amplitude, "pslr", geometry), line.frequency) for line in lines]


def projected(mission: Mission, value: float | Vector, error: MotionError, along: float) -> tuple[Note, ...]:
    """Say of a vibration along three axes what is along the line of sight; nothing of one that is.

    With a direct path say of either what is left in the range less the direct path.
    """
    if not isinstance(value, tuple):
        stated = f"{format_quantity(value, 'm')} along the line of sight"
        return (phrases.seen_of_vibration(stated, along, True),) if mission.has_direct_path else ()
    axes = ", ".join(
        f"{axis} {format_quantity(part, 'm')}" for axis, part in zip(FRAME_AXES[error.frame], value, strict=True)
    )
    return (phrases.seen_of_vibration(axes, along, mission.has_direct_path),)


# ---------------------------------------------------------------------- below one cycle per aperture
def quadratic_part(cycles: Any) -> Any:
    """Worst quadratic phase at the aperture edge of a sinusoid, over its peak phase: 7.5·j₂(π·cycles).

    The least-squares quadratic of cos(πnx) over the aperture; half of it is a Taylor term where n is small.
    """
    return np.abs(tone(math.pi * cycles)[0])


def cubic_part(cycles: Any) -> Any:
    """Worst cubic phase likewise: 17.5·j₃(π·cycles), of the least-squares cubic of sin(πnx)."""
    return np.abs(tone(math.pi * cycles)[1])


class DeclaredPhase(NamedTuple):
    """Phases of one declared error, which sums count: row id, owner, quadratic and cubic phase. [rad]

    What is a quadratic phase and nothing else has no cubic one: None. A vibration is there, and its phases are not
    0, only in the cases in which it is slow. `coverage` is the coverage factor that both phases have in them,
    `moves` the most by which a slow vibration displaces the image. [m]
    """

    row_id: str
    owner: str
    qpe_rad: Any
    cubic_rad: Any
    coverage: Any = 1.0
    moves: Any = 0.0
    is_there: Any = True


def slow_phases(mission: Mission, geometry: Any = None) -> list[DeclaredPhase]:
    """Phases of the declared vibrations below one cycle per aperture, which count with those of other errors."""
    T = mission.collection.aperture_time
    found = []
    for name in PLATFORMS:
        for index, line in enumerate(lines_of(mission, name, geometry)):
            cycles = line.frequency * T
            is_slow = np.asarray(cycles < SLOWEST)[()]
            if np.any(is_slow):
                phase = is_slow * 2 * math.pi * line.amplitude / mission.radar.wavelength
                row_id = subject(name, "vibration", "sinusoidal", entry=index).id
                qpe, cubic = phase * quadratic_part(cycles), phase * cubic_part(cycles)
                moves = is_slow * _largest_displacement(mission, name, index, line, geometry or mission.geometry)
                found.append(DeclaredPhase(row_id, name, qpe, cubic, moves=moves, is_there=is_slow))
    return found


def _largest_displacement(mission: Mission, name: str, index: int, line: Line, geometry: Any) -> Any:
    """Upper bound of what a slow vibration displaces the image by, in any phase, to first order. [m]

    Its mean A·j₀(x) and its slope (2/T)·3A·j₁(x), x = πfT, are those of a range error, which lie a quarter of a cycle
    apart; a line of sight that turns sees what moves across it as well. Along the gradients s and ṡ a metre of the
    one is 1/(|s| sin γ) on the ground and a metre per second of the other 1/(|ṡ| sin γ).
    """
    T = mission.collection.aperture_time
    stated: Any = getattr(mission.platforms, name).motion_error.vibration.sinusoidal[index].amplitude
    x = math.pi * line.frequency * T
    mean = np.sin(x) / x
    slope = np.where(x > SLOW, 3 * (mean - np.cos(x)) / x, x)  # 3·j₁(x), which is below x
    whole = np.sqrt(sum(part * part for part in stated)) if isinstance(stated, tuple) else stated
    rate = 2 / T * line.amplitude * slope
    if isinstance(stated, tuple):
        rate = rate + whole * _length(getattr(geometry, name).look_rate)
    if mission.has_direct_path:
        rate = rate + whole * _length(geometry.apart.look_rate)
    sine = np.sin(geometry.gradient_angle)
    by_mean = line.amplitude * mean / (np.hypot(*geometry.range_gradient) * sine)
    return np.hypot(by_mean, rate / (np.hypot(*geometry.doppler_gradient) * sine))


def _length(vector: Vector) -> Any:
    return np.sqrt(dot(vector, vector))
