"""Rows about vibration: each line of a platform, lines near each other, noise, and motion too slow for echoes."""

import math
from collections.abc import Iterator, Sequence
from functools import cache
from typing import NamedTuple

from bisar_budget import phrases
from bisar_budget.analysis.allocation import Allocation
from bisar_budget.analysis.spread import shown_islr_db
from bisar_budget.analysis.vibration_limits import (
    LARGEST_ECHO,
    VibrationLimits,
    echo_level,
    slow_limits,
    tone_limits,
    vibration_limits,
)
from bisar_budget.budget.judgement import judged
from bisar_budget.budget.pull_in import caps, needed_sentence
from bisar_budget.constants import UTILIZATION_TOLERANCE
from bisar_budget.effects.echoes import NEAR_CYCLES, SLOWEST, near_lines, worst_phases
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.effects.models import CUBIC, QUADRATIC
from bisar_budget.effects.slow_vibration import cubic_part, quadratic_part
from bisar_budget.effects.subject import Subject, subject
from bisar_budget.effects.vibration_lines import Line, counted, lines_of, projected
from bisar_budget.faults import KeyPath
from bisar_budget.findings.row import Row
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import MotionError
from bisar_budget.phrases import NOTHING, Note
from bisar_budget.units import format_quantity

ECHO_CYCLES = 3.0  # per aperture; below, echoes lie beside the mainlobe and the motion is a quadratic phase as well


class VibrationCase(NamedTuple):
    """One row to be judged: a line, lines near each other, or the noise of a platform.

    `declared` and the limits are along the line of sight [m]; `qpe` and `cubic` are the worst-phase quadratic and
    cubic phases [rad], where the motion is slow enough to have them; `islr_db` is what noise adds [dB]. The texts are
    those of a row.
    """

    subject: Subject
    metric: str
    declared: float | None
    limits: VibrationLimits | None
    path: KeyPath
    equation: str
    missing: Note
    doubt: Note
    over: Note
    evidence: str | None
    notes: tuple[Note, ...]
    qpe: float | None = None
    cubic: float | None = None
    islr_db: float | None = None


def vibration_rows(mission: Mission, allocation: Allocation, model: str) -> Iterator[Row]:
    """Every row about vibration, declared or not, in the order of the contract, by one of the two models."""
    mission = mission._replace(allocation=mission.allocation._replace(model=model))
    metric, sinusoidal = tone_limits(mission, allocation)
    wideband = vibration_limits(mission, allocation, "islr")
    T = mission.collection.aperture_time
    lines = {name: lines_of(mission, name) for name in PLATFORMS}
    joint = _of_both_platforms(mission, lines)
    for name in PLATFORMS:
        error: MotionError = getattr(mission.platforms, name).motion_error
        for index, line in enumerate(lines[name] or (None,)):
            if line is not None and line.frequency * T < SLOWEST:
                yield _slow_row(mission, allocation, name, index, line)
            else:
                both = joint.get((name, index), _Together())
                case = _line(mission, allocation, sinusoidal.get(name), name, index, line, both)
                yield _row(mission, case if metric == "pslr" else _as_spread(mission, case), model)
        near_each_other = near_lines([line.frequency * T for line in lines[name]]) if metric == "pslr" else ()
        for index, members in enumerate(near_each_other):
            near = [lines[name][member] for member in members]
            yield _row(mission, _together(mission, sinusoidal.get(name), name, index, near, members), model)
        yield _row(mission, _noise(mission, wideband.get(name), name, error), model)


def _as_spread(mission: Mission, case: VibrationCase) -> VibrationCase:
    """A line where ISLR holds it: the power φ²/2 that its echoes take."""
    over = phrases.share_of_power_over("islr", case.equation)
    if case.declared is None:
        return case._replace(metric="islr", over=over)
    phase = 2 * math.pi * case.declared / mission.radar.wavelength
    return case._replace(metric="islr", over=over, islr_db=shown_islr_db(mission, phase**2 / 2))


def _slow_row(mission: Mission, allocation: Allocation, name: str, index: int, line: Line) -> Row:
    """Judge a vibration below one cycle per aperture as the quadratic and cubic phase that it is."""
    error: MotionError = getattr(mission.platforms, name).motion_error
    combine, gain = mission.allocation.combine, allocation.autofocus_gain
    cycles = line.frequency * mission.collection.aperture_time
    phase = 2 * math.pi * line.amplitude / mission.radar.wavelength
    qpe, cubic = phase * quadratic_part(cycles), phase * cubic_part(cycles)
    limits = slow_limits(mission, allocation, name, cycles)
    limit = allocation.qpe_limit(name) * gain
    if limits.binding == CUBIC:
        over = phrases.slow_cubic_phase_over(cubic, mission.requirements.cubic_phase_error or 0.0)
    else:
        over = phrases.slow_quadratic_phase_over(qpe, limit)
        if qpe > limit:
            over = over.then(needed_sentence(allocation.n_pull_needed(qpe, name), caps(mission)))
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
        info=NOTHING if combine == "each" else phrases.aggregate_decides(combine),
        limits=(limits.quadratic, limits.quadratic),
        qpe=qpe,
        qpe_full=qpe,
        evidence=error.source,
        notes=(
            *projected(mission, error.vibration.sinusoidal[index].amplitude, error, line.amplitude),
            phrases.slower_than_a_cycle(cycles, qpe, cubic),
        ),
    )
    return row._replace(binding_requirement=limits.binding, cubic_rad=cubic)


def _row(mission: Mission, case: VibrationCase, model: str) -> Row:
    allowed = case.limits
    row = judged(
        mission,
        subject=case.subject,
        metric=case.metric,
        unit="m",
        declared=case.declared,
        allowable=None if allowed is None else allowed.by(model),
        path=case.path,
        equation=case.equation,
        no_limit=case.missing,
        info=case.missing,
        over=case.over,
        doubt=case.doubt,
        limits=allowed or (None, None),
        qpe_full=case.qpe,
        evidence=case.evidence,
        notes=case.notes,
        published_margin_db=None if allowed is None else allowed.margin_db,
    )
    if case.cubic is None and case.islr_db is None:
        return row
    return row._replace(cubic_rad=case.cubic, islr_db=case.islr_db)


def _case(
    mission: Mission,
    allowed: VibrationLimits | None,
    metric: str,
    name: str,
    axis: str,
    entry: int | None,
    *path: str | int,
) -> VibrationCase:
    """What every row of a platform's vibration has, before anything is declared."""
    error: MotionError = getattr(mission.platforms, name).motion_error
    case = _blank(subject(name, "vibration", axis, entry=entry), metric, path, mission.allocation.model)
    if allowed is None and error.source is None:
        return case
    missing = NOTHING if allowed else case.missing
    return case._replace(limits=allowed, missing=missing, evidence=error.source, notes=_margin(allowed))


@cache
def _blank(what_it_is: Subject, metric: str, path: KeyPath, model: str) -> VibrationCase:
    """The row of a mission that says nothing of vibration."""
    kind = "sinusoidal" if metric == "pslr" else "wideband"
    missing = phrases.no_requirement_of(metric)
    rule = f"Section V, {kind}" if model == "published" else "first principles"
    return VibrationCase(
        subject=what_it_is,
        metric=metric,
        declared=None,
        limits=None,
        path=("platforms", what_it_is.owner, "motion_error", "vibration", kind, *path),
        equation=rule,
        missing=missing,
        doubt=NOTHING,
        over=phrases.share_of_power_over(metric, rule),
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
    both: "_Together",
) -> VibrationCase:
    error: MotionError = getattr(mission.platforms, name).motion_error
    case = _case(mission, allowed, "pslr", name, "sinusoidal", index, index, "amplitude")
    if line is None:
        return case
    case = _with_doubt(case._replace(declared=line.amplitude), mission)
    notes = [*projected(mission, error.vibration.sinusoidal[index].amplitude, error, line.amplitude), *case.notes]
    cycles = line.frequency * mission.collection.aperture_time
    phase = 2 * math.pi * line.amplitude / mission.radar.wavelength
    if cycles >= ECHO_CYCLES:
        return case._replace(notes=(*notes, *both.notes), doubt=case.doubt or both.doubt)
    qpe, cubic = phase * quadratic_part(cycles), phase * cubic_part(cycles)
    limit = allocation.qpe_limit(name) * allocation.autofocus_gain
    allowed_cubic = mission.requirements.cubic_phase_error
    notes.append(phrases.slower_than_three_cycles(cycles, qpe, limit, cubic, allowed_cubic))
    breaks_cubic = allowed_cubic is not None and cubic > allowed_cubic * (1 + UTILIZATION_TOLERANCE)
    doubt = NOTHING
    if breaks_cubic or qpe > limit * (1 + UTILIZATION_TOLERANCE):
        doubt = phrases.phase_of_vibration_over(qpe, limit, cubic, allowed_cubic)
    return case._replace(notes=(*notes, *both.notes), doubt=case.doubt or doubt or both.doubt, qpe=qpe, cubic=cubic)


def _together(
    mission: Mission,
    allowed: VibrationLimits | None,
    name: str,
    index: int,
    members: Sequence[Line],
    numbers: Sequence[int],
) -> VibrationCase:
    """Lines of one platform so near each other that their echoes add: the one line that has an echo as high."""
    T = mission.collection.aperture_time
    shown = ", ".join(map(str, numbers[:5])) + (f" and {len(numbers) - 5} more" if len(numbers) > 5 else "")
    case = _case(mission, allowed, "pslr", name, "sinusoidal.sum", index, numbers[0], "frequency")
    declared = worst_phases([line.amplitude for line in members], [line.frequency * T for line in members]).amplitude
    near = phrases.lines_together(shown, _band(members), NEAR_CYCLES, declared)
    return _with_doubt(case._replace(declared=declared, notes=(near, *case.notes)), mission)


def _band(lines: Sequence[Line]) -> str:
    ends = [format_quantity(end(line.frequency for line in lines), "Hz", 4) for end in (min, max)]
    return " to ".join(dict.fromkeys(ends))


def _noise(mission: Mission, allowed: VibrationLimits | None, name: str, error: MotionError) -> VibrationCase:
    wideband = error.vibration.wideband
    case = _case(mission, allowed, "islr", name, "wideband", None, "rms")
    if wideband is None:
        return case
    rms = counted(mission, name, wideband.rms, "islr")
    notes = (*projected(mission, wideband.rms, error, rms), *case.notes)
    variance = (2 * math.pi * rms / mission.radar.wavelength) ** 2
    case = case._replace(declared=rms, notes=notes, islr_db=shown_islr_db(mission, variance))
    return _with_doubt(case, mission)


def _margin(allowed: VibrationLimits | None) -> tuple[Note, ...]:
    """How far the published rule stays inside first principles, said of every limit."""
    if allowed is None:
        return ()
    return (phrases.published_rule_is_off(allowed.margin_db),)


def _with_doubt(case: VibrationCase, mission: Mission) -> VibrationCase:
    """Say that the model that does not gate fails it; the published one does not know a direct path."""
    if case.limits is None or case.declared is None or mission.has_direct_path:
        return case
    is_published = mission.allocation.model == "published"
    other, limit = ("full", case.limits.full) if is_published else ("published", case.limits.published)
    if case.declared <= limit * (1 + UTILIZATION_TOLERANCE):
        return case
    return case._replace(doubt=phrases.other_model_allows(other, limit, "m"))


class _Together(NamedTuple):
    notes: tuple[Note, ...] = ()
    doubt: Note = NOTHING


def _of_both_platforms(mission: Mission, lines: dict[str, list[Line]]) -> dict[tuple[str, int], _Together]:
    """What both platforms make of near frequencies: echoes that in the worst phases add. By platform and line."""
    requirement, T = mission.requirements.pslr, mission.collection.aperture_time
    if requirement is None or not all(lines.values()):
        return {}
    known = [((name, index), line) for name in PLATFORMS for index, line in enumerate(lines[name])]
    found = {}
    for group in near_lines([line.frequency * T for _, line in known]):
        members = [known[index] for index in group]
        if len({name for (name, _), _ in members}) < 2:
            continue
        near = [line for _, line in members]
        amplitude = worst_phases([line.amplitude for line in near], [line.frequency * T for line in near]).amplitude
        phase = 2 * math.pi * amplitude / mission.radar.wavelength
        if not phase:
            continue
        level = 20 * math.log10(echo_level(min(phase, LARGEST_ECHO)))
        for (name, index), _ in members:
            (other,) = (platform for platform in PLATFORMS if platform != name)
            note = phrases.both_platforms_vibrate(other, NEAR_CYCLES, level, phase > LARGEST_ECHO, requirement)
            found[name, index] = _Together((note,), note if level > requirement + 1e-6 else NOTHING)
    return found
