"""Vibration: what a platform's motion along the line of sight does, by the paper's rule and from first principles.

A motion of amplitude A along the line of sight is a phase of peak φ = 2πA/λ. A sinusoid makes paired echoes of
J₁(φ)/J₀(φ) of the response, about φ/2; Gaussian noise of rms σ leaves exp(-σ²) of the power in the response and
spreads the rest, so that its ISLR is exp(σ²) - 1. Derived here, checked against the transform of the phase.

What a platform may have, so that both within their shares meet the requirement: where both vibrate at one frequency
their echoes add in amplitude in the worst phase, so that amplitudes are divided, in the ratio that the shares of
power set; where the motions are noise, which is independent from platform to platform, variances add and powers are
divided. The paper's rule, φ² ≤ PSLR·share and σ² ≤ ISLR·share, stays 3 dB inside the first at equal shares and equals
the second where σ² is small; the same noise on both platforms would add 3 dB.
"""

import math
from collections.abc import Iterator, Sequence
from functools import cache
from typing import NamedTuple

from bisar_budget import evaluators
from bisar_budget.budget.allocation import Allocation, Split
from bisar_budget.budget.effects import PLATFORMS
from bisar_budget.constants import UTILIZATION_TOLERANCE
from bisar_budget.errors import KeyPath
from bisar_budget.geometry import FRAME_AXES, PlatformState, Vector, dot, without_rounding
from bisar_budget.mission.model import Mission, MotionError, Sinusoid
from bisar_budget.units import format_limit, format_quantity

ECHO_CYCLES = 3.0  # per aperture; below, echoes lie beside the mainlobe and the motion is a quadratic phase as well

_LARGEST = 2.0  # rad; beyond, echoes are above the response


class VibrationLimits(NamedTuple):
    """What one platform may have, by the paper's rule and from first principles, 0 to peak or rms. [m]"""

    published: float
    full: float

    def by(self, model: str) -> float:
        """The limit that gates."""
        return min(self) if model == "strictest" else self.full if model == "full" else self.published

    @property
    def margin_db(self) -> float:
        """How far the published rule stays inside first principles. [dB]"""
        return 20 * math.log10(self.full / self.published)


class VibrationCase(NamedTuple):
    """One row to be judged: a line, lines that share a frequency, or the noise of a platform.

    `declared` and the limits are along the line of sight [m]; `qpe` is the worst-phase quadratic phase [rad], where
    the motion is slow enough to have one. The texts are those of a row.
    """

    id: str
    metric: str
    declared: float | None
    limits: VibrationLimits | None
    path: KeyPath
    equation: str
    missing: str
    not_evaluated: str
    doubt: str
    over: str
    evidence: str | None
    notes: tuple[str, ...]
    qpe: float | None = None


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


def echo_level(phase: float) -> float:
    """Amplitude of a paired echo over that of the response, J₁(φ)/J₀(φ), of a sinusoid of peak φ up to 2 rad."""
    square, term, j0, j1 = -((phase / 2) ** 2), 1.0, 0.0, 0.0
    for k in range(1, 13):  # the series of both; the last terms are rounding
        j0 += term
        j1 += term / k
        term *= square / (k * k)
    return phase / 2 * j1 / j0


def echo_phase(level: float) -> float:
    """Peak phase of a sinusoid whose echoes have an amplitude of up to 1 times the response's. [rad]"""
    phase = min(2 * level, 1.5)  # J₁/J₀ is above φ/2, convex, and 1 at 1.43: from here Newton's steps go down to it
    for _ in range(8):
        reached = echo_level(phase)
        phase -= (reached - level) / (1 - reached / phase + reached**2)
    return phase


def spread_phase(ratio: float) -> float:
    """Rms phase of noise that spreads so much power, over the response's: exp(σ²) - 1. [rad]"""
    return math.sqrt(math.log1p(ratio))


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


def vibration_limits(mission: Mission, allocation: Allocation, metric: str) -> dict[str, VibrationLimits]:
    """Limits of each platform for `pslr` or `islr`; empty without a requirement."""
    requirement_db = mission.requirements.pslr if metric == "pslr" else mission.requirements.islr
    if requirement_db is None:
        return {}
    power = 10 ** (requirement_db / 10)  # -30 dB is 10⁻³: PSLR and ISLR are power ratios
    split = allocation.pslr if metric == "pslr" else allocation.islr
    wavelength = mission.radar.wavelength

    if metric == "pslr":
        all_of_it, part = echo_phase(math.sqrt(power * (split.transmitter + split.receiver))), amplitude_share
    else:
        all_of_it, part = spread_phase(power), power_share
    found = {}
    for name in PLATFORMS:
        phases = (math.sqrt(power * split.of(name)), all_of_it * part(split, name))
        found[name] = VibrationLimits(*(evaluators.vibration_limit(wavelength, phase) for phase in phases))
    return found


def amplitude_share(split: Split, name: str) -> float:
    """Part of a platform in the amplitude of both: they sum to 1, in the ratio of the roots of power."""
    return math.sqrt(split.of(name)) / (math.sqrt(split.transmitter) + math.sqrt(split.receiver))


def power_share(split: Split, name: str) -> float:
    """Part of a platform in the rms phase: their squares are the shares of power."""
    return math.sqrt(split.of(name))


def cases(mission: Mission, allocation: Allocation) -> Iterator[VibrationCase]:
    """Every row about vibration, declared or not, in the order of the contract."""
    sinusoidal, wideband = (vibration_limits(mission, allocation, metric) for metric in ("pslr", "islr"))
    lines = {name: lines_of(mission, name) for name in PLATFORMS}
    for name in PLATFORMS:
        error: MotionError = getattr(mission.platforms, name).motion_error
        for index, line in enumerate(lines[name] or (None,)):
            yield _line(mission, allocation, sinusoidal.get(name), name, index, line, lines)
        for index, members in enumerate(shared_frequencies(lines[name], mission.collection.aperture_time)):
            yield _together(mission, sinusoidal.get(name), name, index, [lines[name][m] for m in members], members)
        yield _noise(mission, wideband.get(name), name, error)


class Line(NamedTuple):
    """One sinusoid: amplitude along the line of sight, 0 to peak [m], and frequency [Hz]."""

    amplitude: float
    frequency: float


def lines_of(mission: Mission, name: str) -> list[Line]:
    """Sinusoids of one platform, along the line of sight."""
    platform = getattr(mission.platforms, name)
    error: MotionError = platform.motion_error
    return [
        Line(along_line_of_sight(line.amplitude, error, platform.state, "pslr"), line.frequency)
        for line in error.vibration.sinusoidal
    ]


def shared_frequencies(lines: Sequence[Line | Sinusoid], aperture_time_s: float) -> list[tuple[int, ...]]:
    """Indices of lines less than one cycle per aperture apart, each largest set once: their echoes are one.

    Lines slower than one cycle per aperture make none.
    """
    order = sorted(range(len(lines)), key=lambda index: lines[index].frequency)
    order = [index for index in order if lines[index].frequency * aperture_time_s >= 1]
    found, reached = [], 0
    for start, first in enumerate(order):
        end = start
        while (
            end < len(order) and (lines[order[end]].frequency - lines[first].frequency) * aperture_time_s < 1 - 1e-9
        ):
            end += 1
        if end - start > 1 and end > reached:
            found.append(tuple(sorted(order[start:end])))
            reached = end
    return found


def _row(
    mission: Mission, allowed: VibrationLimits | None, metric: str, name: str, own_id: str, *path: str | int
) -> VibrationCase:
    """What every row of a platform's vibration has, before anything is declared."""
    error: MotionError = getattr(mission.platforms, name).motion_error
    case = _blank(metric, name, own_id, path, mission.allocation.model)
    if allowed is None and error.source is None:
        return case
    missing = "" if allowed else case.missing
    return case._replace(
        limits=allowed, missing=missing, not_evaluated=missing, evidence=error.source, notes=_margin(allowed)
    )


@cache
def _blank(metric: str, name: str, own_id: str, path: KeyPath, model: str) -> VibrationCase:
    """The row of a mission that says nothing of vibration."""
    what, kind = ("paired echoes", "sinusoidal") if metric == "pslr" else ("power spread", "wideband")
    missing = f"no requirements.{metric} to hold it to"
    rule = {
        "published": f"Section V, {kind}",
        "full": "first principles",
        "strictest": f"Section V, {kind} and first principles",
    }[model]
    return VibrationCase(
        id=f"{name}.vibration.{own_id}",
        metric=metric,
        declared=None,
        limits=None,
        path=("platforms", name, "motion_error", "vibration", kind, *path),
        equation=rule,
        missing=missing,
        not_evaluated=missing,
        doubt="",
        over=f"{what} above the platform's share of {metric.upper()} ({rule})",
        evidence=None,
        notes=(),
    )


def _line(
    mission: Mission,
    allocation: Allocation,
    allowed: VibrationLimits | None,
    name: str,
    index: int,
    line: Line | None,
    lines: dict[str, list[Line]],
) -> VibrationCase:
    error: MotionError = getattr(mission.platforms, name).motion_error
    case = _row(mission, allowed, "pslr", name, f"sinusoidal.{index}", index, "amplitude")
    if line is None:
        return case
    case = _with_doubt(case._replace(declared=line.amplitude), mission.allocation.model)
    notes = [*_projected(error.vibration.sinusoidal[index].amplitude, error, line.amplitude), *case.notes]
    cycles = line.frequency * mission.collection.aperture_time
    phase = 2 * math.pi * line.amplitude / mission.radar.wavelength
    if cycles >= ECHO_CYCLES:
        together = _with_the_other_platform(mission, name, line, lines)
        return case._replace(notes=(*notes, *together.notes), doubt=case.doubt or together.doubt)
    qpe, cubic = phase * quadratic_part(cycles), phase * cubic_part(cycles)
    limit = allocation.qpe_limit(name) * allocation.autofocus_gain
    worst = f"in the worst phase a quadratic phase error of {qpe:.3g} rad, {format_limit(limit, 'rad')} allowed"
    if cycles < 1:
        slow = (
            f"{cycles:.2g} cycles per aperture: slower than one it makes no echoes, but {worst}, or a cubic of "
            f"{cubic:.3g} rad"
        )
        return case._replace(notes=tuple(notes), not_evaluated=case.missing or slow, doubt="", qpe=qpe)
    or_cubic = f"or a cubic of {cubic:.3g} rad"
    allowed_cubic = mission.requirements.cubic_phase_error
    if allowed_cubic is not None:
        or_cubic += f", {format_limit(allowed_cubic, 'rad')} allowed"
    notes.append(
        f"{cycles:.3g} cycles per aperture: below three it also is {worst}, {or_cubic}; the same motion, in no sum"
    )
    breaks_cubic = allowed_cubic is not None and cubic > allowed_cubic * (1 + UTILIZATION_TOLERANCE)
    doubt = f"also {worst}, {or_cubic}" if breaks_cubic or qpe > limit * (1 + UTILIZATION_TOLERANCE) else ""
    together = _with_the_other_platform(mission, name, line, lines)
    return case._replace(
        notes=(*notes, *together.notes),
        doubt=case.doubt or doubt or together.doubt,
        qpe=qpe,
    )


def _together(
    mission: Mission,
    allowed: VibrationLimits | None,
    name: str,
    index: int,
    members: Sequence[Line],
    numbers: Sequence[int],
) -> VibrationCase:
    """Lines of one platform at one frequency: in the worst phase their amplitudes add."""
    shown = ", ".join(map(str, numbers[:5])) + (f" and {len(numbers) - 5} more" if len(numbers) > 5 else "")
    at = format_quantity(members[0].frequency, "Hz")
    shared = f"entries {shown} share {at}, less than one cycle per aperture apart: amplitudes add"
    case = _row(mission, allowed, "pslr", name, f"sinusoidal.sum.{index}", numbers[0], "frequency")
    declared = math.fsum(line.amplitude for line in members)
    return _with_doubt(case._replace(declared=declared, notes=(shared, *case.notes)), mission.allocation.model)


def _noise(mission: Mission, allowed: VibrationLimits | None, name: str, error: MotionError) -> VibrationCase:
    wideband = error.vibration.wideband
    case = _row(mission, allowed, "islr", name, "wideband", "rms")
    if wideband is None:
        return case
    rms = along_line_of_sight(wideband.rms, error, getattr(mission.platforms, name).state, "islr")
    notes = (*_projected(wideband.rms, error, rms), *case.notes)
    return _with_doubt(case._replace(declared=rms, notes=notes), mission.allocation.model)


def _margin(allowed: VibrationLimits | None) -> tuple[str, ...]:
    """How far the published rule stays inside first principles, said of every limit."""
    if allowed is None:
        return ()
    if abs(allowed.margin_db) < 0.005:
        return ("the published rule is that of first principles, to 0.01 dB",)
    side = "inside" if allowed.margin_db >= 0 else "beyond"
    return (f"the published rule is {abs(allowed.margin_db):.2f} dB {side} first principles",)


def _projected(value: float | Vector, error: MotionError, along: float) -> tuple[str, ...]:
    if not isinstance(value, tuple):
        return ()
    axes = ", ".join(
        f"{axis} {format_quantity(part, 'm')}" for axis, part in zip(FRAME_AXES[error.frame], value, strict=True)
    )
    return (f"{axes}: {format_quantity(along, 'm')} of it along the line of sight",)


def _with_doubt(case: VibrationCase, model: str) -> VibrationCase:
    """Say that the model that does not gate fails it."""
    if case.limits is None or case.declared is None or model == "strictest":
        return case
    other, limit = ("full", case.limits.full) if model == "published" else ("published", case.limits.published)
    if case.declared <= limit * (1 + UTILIZATION_TOLERANCE):
        return case
    text = f"the {other} model says fail: {format_quantity(limit, 'm', 3, 'down')} allowed"
    return case._replace(doubt=text)


class _Together(NamedTuple):
    notes: tuple[str, ...] = ()
    doubt: str = ""


def _with_the_other_platform(mission: Mission, name: str, line: Line, lines: dict[str, list[Line]]) -> _Together:
    """What both platforms make of one frequency: echoes that in the worst phase add."""
    (other,) = (platform for platform in PLATFORMS if platform != name)
    requirement, T = mission.requirements.pslr, mission.collection.aperture_time
    near = {
        platform: [x for x in lines[platform] if x.frequency * T >= 1 > abs(x.frequency - line.frequency) * T + 1e-9]
        for platform in PLATFORMS
    }
    if requirement is None or not near[other]:
        return _Together()
    amplitude = math.fsum(x.amplitude for platform in PLATFORMS for x in near[platform])
    phase = 2 * math.pi * amplitude / mission.radar.wavelength
    if not phase:
        return _Together()
    level = 20 * math.log10(echo_level(min(phase, _LARGEST)))
    text = (
        f"the {other} vibrates at this frequency too: in the worst phase echoes of both together are "
        f"{'above ' if phase > _LARGEST else ''}{level:.1f} dB, {requirement:g} dB required"
    )
    return _Together((text,), text if level > requirement + 1e-6 else "")
