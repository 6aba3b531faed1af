"""Declared vibrations as they count: along the line of sight.

Of a receiver that hears the transmitter data hold ranges less the direct path: there a vibration counts as what it
changes of that.
"""

import math
from typing import NamedTuple

from bisar_budget import phrases
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.geometry import FRAME_AXES, PlatformState, Vector, dot, without_rounding
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import MotionError
from bisar_budget.phrases import Note
from bisar_budget.units import format_quantity


class Line(NamedTuple):
    """One sinusoid: amplitude along the line of sight, 0 to peak [m], and frequency [Hz]."""

    amplitude: float
    frequency: float


def along_line_of_sight(
    value: float | Vector, error: MotionError, state: PlatformState, metric: str, sight: Vector | None = None
) -> float:
    """Amplitude (`pslr`) or rms (`islr`) along the line of sight at the aperture midpoint. [m]

    A single value is along it. Of a vector, amplitudes along the axes of the error's frame, projections add: the
    axes may vibrate in any phase. Rms values are taken for independent and add as squares. `sight` is what a metre
    takes from the range, where that is not the line of sight.
    """
    if not isinstance(value, tuple):
        return value if sight is None else value * abs(dot(state.look, sight))
    u, v, w = (dot(axis, sight or state.look) for axis in state.frame(error.frame))
    u, v, w = without_rounding((u, v, w))
    parts = (value[0] * u, value[1] * v, value[2] * w)
    return math.fsum(map(abs, parts)) if metric == "pslr" else math.hypot(*parts)


def sight_of(mission: Mission, name: str) -> Vector:
    """What a metre of a platform's motion takes from the range, or from the range less the direct path. [-]"""
    return mission.geometry.sights(has_direct_path=mission.has_direct_path)[PLATFORMS.index(name)]


def counted(mission: Mission, name: str, value: float | Vector, metric: str) -> float:
    """The same of a platform of a mission: what changes the range, or the range less the direct path. [m]"""
    platform = getattr(mission.platforms, name)
    sight = sight_of(mission, name) if mission.has_direct_path else None
    return along_line_of_sight(value, platform.motion_error, platform.state, metric, sight)


def lines_of(mission: Mission, name: str) -> list[Line]:
    """Sinusoids of one platform, along the line of sight."""
    error: MotionError = getattr(mission.platforms, name).motion_error
    lines = error.vibration.sinusoidal
    return [Line(counted(mission, name, line.amplitude, "pslr"), line.frequency) for line in lines]


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
