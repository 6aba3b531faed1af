"""Declared vibrations as they count: along the line of sight."""

import math
from typing import NamedTuple

from bisar_budget.geometry import FRAME_AXES, PlatformState, Vector, dot, without_rounding
from bisar_budget.mission.model import Mission, MotionError
from bisar_budget.units import format_quantity


class Line(NamedTuple):
    """One sinusoid: amplitude along the line of sight, 0 to peak [m], and frequency [Hz]."""

    amplitude: float
    frequency: float


def along_line_of_sight(value: float | Vector, error: MotionError, state: PlatformState, metric: str) -> float:
    """Amplitude (`pslr`) or rms (`islr`) along the line of sight at the aperture midpoint. [m]

    A single value is along it. Of a vector, amplitudes along the axes of the error's frame, projections add: the
    axes may vibrate in any phase. Rms values are taken for independent and add as squares.
    """
    if not isinstance(value, tuple):
        return value
    u, v, w = (dot(axis, state.look) for axis in state.frame(error.frame))
    u, v, w = without_rounding((u, v, w))
    parts = (value[0] * u, value[1] * v, value[2] * w)
    return math.fsum(map(abs, parts)) if metric == "pslr" else math.hypot(*parts)


def lines_of(mission: Mission, name: str) -> list[Line]:
    """Sinusoids of one platform, along the line of sight."""
    platform = getattr(mission.platforms, name)
    error: MotionError = platform.motion_error
    return [
        Line(along_line_of_sight(line.amplitude, error, platform.state, "pslr"), line.frequency)
        for line in error.vibration.sinusoidal
    ]


def projected(value: float | Vector, error: MotionError, along: float) -> tuple[str, ...]:
    """Say of a vibration along three axes what is along the line of sight; nothing of one that is."""
    if not isinstance(value, tuple):
        return ()
    axes = ", ".join(
        f"{axis} {format_quantity(part, 'm')}" for axis, part in zip(FRAME_AXES[error.frame], value, strict=True)
    )
    return (f"{axes}: {format_quantity(along, 'm')} of it along the line of sight",)
