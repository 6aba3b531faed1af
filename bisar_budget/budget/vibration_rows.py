"""Budget rows for platform vibration: single sinusoids (spectral lines), groups of neighbouring lines, and noise."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bisar_budget import phrases
from bisar_budget.analysis.analysis import Analysis, Case
from bisar_budget.analysis.spread import islr_of
from bisar_budget.analysis.vibration_limits import (
    MAX_ECHO_PHASE_RAD,
    VibrationLimits,
    echo_level,
    slow_limits,
    tone_limits,
    vibration_limits,
)
from bisar_budget.arrays import Booleans, Floats, PerCase, PerCaseFlag
from bisar_budget.budget.judged_rows import LIMIT_RATIO, REQUIREMENTS, FamilyRow, Judged, Judging, worded
from bisar_budget.budget.near_phases import NearPhases, phase_over, phase_requirement
from bisar_budget.effects.declared import CUBIC, OTHER_MODEL, QUADRATIC
from bisar_budget.effects.effect import PLATFORMS, Subject, subject
from bisar_budget.effects.vibration import (
    ECHO_CYCLES,
    NEAR_CYCLES,
    SLOWEST_ECHO_CYCLES,
    counted,
    lines_of,
    near_groups,
    projected,
    unit_of_line,
    worst_phases,
)
from bisar_budget.error_kinds.random_kinds import VIBRATION_KIND
from bisar_budget.findings.row import Row
from bisar_budget.geometry import Vector
from bisar_budget.mission.platforms import MotionError
from bisar_budget.phrases import NOTHING, Note
from bisar_budget.units import format_quantity

_ROUNDING_DB = 1e-6  # tolerance for rounding of a level


class Vibrations:
    """Builds the budget rows for vibration, for an array of cases."""

    def __init__(self, judging: Judging, analysis: Analysis) -> None:
        mission, geometry, allocation = analysis.mission, analysis.geometry, analysis.allocation
        self.judging, self.mission, self.geometry, self.slow_tones = judging, mission, geometry, analysis.slow_tones
        self.allocation, self.array = allocation, judging.array
        self.metric, self.tones = tone_limits(mission, allocation)
        self.noise = vibration_limits(mission, allocation, "islr")
        self.to_phase = 2 * math.pi / mission.radar.wavelength
        lines = {name: lines_of(mission, name, geometry) for name in PLATFORMS}
        self.count = {name: len(lines_of_platform) for name, lines_of_platform in lines.items()}
        self.amplitudes = {
            name: self._columns([line.amplitude for line in lines_of_platform])
            for name, lines_of_platform in lines.items()
        }
        T = mission.collection.aperture_time
        self.cycles = {
            name: self._columns([line.frequency * T for line in lines_of_platform])
            for name, lines_of_platform in lines.items()
        }
        self.per_metre = {
            name: self._columns([line.per_metre for line in lines_of_platform])
            for name, lines_of_platform in lines.items()
        }
        # Groups of neighbouring lines, each with the amplitude [m] of a single line that has an equally high echo.
        self._near = {name: list(_together(self.amplitudes[name], self.cycles[name])) for name in PLATFORMS}
        self._both = self._of_both_platforms()

    def _columns(self, numbers: Sequence[PerCase]) -> Floats:
        return np.array([self.array(number) for number in numbers]).reshape(-1, self.judging.cases)

    def rows(self, model: str) -> Iterator["VibrationRow"]:
        """Yield all vibration rows, as judged by one model, in the order of the JSON output.

        `model` is `published` or `full`. A platform without declared lines gets a single row for lines, with the
        status `not_declared`. A line with less than one cycle per aperture in only some of the cases gets two rows:
        one for these cases and one for the remaining cases.
        """
        everywhere = np.ones(self.judging.cases, dtype=bool)
        for name in PLATFORMS:
            for index in range(self.count[name]):
                is_slow = self.cycles[name][index] < SLOWEST_ECHO_CYCLES
                if is_slow.any():
                    yield self._slow(name, index, is_slow).in_unit(self.per_metre[name][index])
                if not is_slow.all():
                    yield self._line(model, name, index, ~is_slow).in_unit(self.per_metre[name][index])
            if not self.count[name]:
                row_subject = subject(name, "vibration", "sinusoidal", entry=0)
                yield self._row(model, row_subject, self.metric, None, self.tones.get(name), everywhere)
            elif self.metric == "pslr":
                yield from self._near_each_other(model, name)
            wideband = getattr(self.mission.platforms, name).motion_error.vibration.wideband
            rms = None
            if wideband is not None:
                rms = self.array(counted(self.mission, name, wideband.rms, "islr", self.geometry))
            row_subject = subject(name, "vibration", "wideband")
            yield self._row(model, row_subject, "islr", rms, self.noise.get(name), everywhere)

    def _row(
        self,
        model: str,
        row_subject: Subject,
        metric: str,
        declared: Floats | None,
        limits: VibrationLimits | None,
        is_there: Booleans,
        *,
        doubt: PerCaseFlag = False,
        phases: NearPhases | None = None,
        **others: Any,
    ) -> "VibrationRow":
        allowable, is_over_other = None, np.zeros(self.judging.cases, dtype=bool)
        if limits is not None:
            allowable = self.array(limits.by(model))
            if declared is not None and not self.mission.has_direct_path:  # the published model has no direct path
                is_over_other = declared > limits.by(OTHER_MODEL[model]) * LIMIT_RATIO
        if phases is None or declared is None:
            judged = self.judging.row(
                row_subject, declared, allowable, doubt=doubt | is_over_other, is_info=limits is None
            )
            judged = judged.held_to(metric)
        else:
            judged = phases.row(self.judging, row_subject, metric, declared, allowable, doubt=doubt | is_over_other)
        if self.judging.is_complete:
            if limits is not None:
                judged = self._with_limits(judged, limits)
            if phases is not None and declared is not None:
                limit = phases.limit(declared)
                both = (np.fmin(by_model, limit) for by_model in (judged.allowable_published, judged.allowable_full))
                published, full = (np.where(np.isinf(by_model), math.nan, by_model) for by_model in both)
                judged = judged._replace(allowable_published=published, allowable_full=full)
            if declared is not None and metric == "islr":
                variance = (self.to_phase * declared) ** 2
                of_row = variance if row_subject.axis == "wideband" else variance / 2
                judged = judged._replace(islr_db=islr_of(self.mission, of_row))
        return VibrationRow(judged, limits, is_there=is_there, is_over_other=is_over_other, **others)

    def _with_limits(self, judged: Judged, limits: VibrationLimits) -> Judged:
        published, full = map(self.array, limits)
        return judged._replace(allowable_published=published, allowable_full=full)

    def _line(self, model: str, name: str, index: int, is_there: Booleans) -> "VibrationRow":
        """Build the row of a vibration line with one or more cycles per aperture.

        If PSLR limits the line, the level of its echoes is compared with the limit. If ISLR limits the line, the
        power of its echoes is compared with the limit. Below three cycles per aperture, the quadratic and cubic phase
        of the line are limited as well.
        """
        cycles, both = self.cycles[name][index], self._both[name][index]
        is_near, phases = cycles < ECHO_CYCLES, None
        row_subject = subject(name, "vibration", "sinusoidal", entry=index)
        if is_near.any():
            does, gain = self.slow_tones[row_subject.id].declared, self.allocation.autofocus_gain
            phases_of_line = (does.quadratic, does.cubic, does.judged(1.0), does.judged(gain))
            phases = NearPhases.of(self.mission, self.allocation, name, is_near, phases_of_line)
        level = 20 * np.log10(echo_level(np.minimum(both, MAX_ECHO_PHASE_RAD)))
        required = self.mission.requirements.pslr
        is_over_both = np.zeros(is_there.shape, dtype=bool) if required is None else level > required + _ROUNDING_DB
        return self._row(
            model,
            row_subject,
            self.metric,
            self.amplitudes[name][index],
            self.tones.get(name),
            is_there,
            doubt=is_over_both,
            phases=phases,
            cycles=cycles,
            qpe=math.nan if phases is None else phases.quadratic,
            cubic=math.nan if phases is None else phases.cubic,
            without_autofocus=0.0 if phases is None else phases.without_autofocus,
            both=both,
            level=level,
            is_over_both=is_over_both,
        )

    def _slow(self, name: str, index: int, is_there: Booleans) -> "VibrationRow":
        """Build the row of a vibration line with less than one cycle per aperture.

        The quadratic and cubic phase of the line are compared with their limits. For a vibration along three axes,
        the declared size in the row is the amplitude of a vibration along the line of sight that has the same
        utilization.
        """
        row_subject, cycles = subject(name, "vibration", "sinusoidal", entry=index), self.cycles[name][index]
        tone = self.slow_tones[row_subject.id]
        limits = slow_limits(self.mission, self.allocation, tone)
        declared = limits.use * limits.smallest if tone.hears_part else self.amplitudes[name][index]
        does = tone.declared
        without_autofocus = does.judged(1.0) / self.allocation.qpe_limit(name)
        judged = self.judging.row(
            row_subject,
            declared,
            self.array(limits.smallest),
            without_autofocus=without_autofocus,
            is_info=self.mission.allocation.combine != "each",
        )
        qpe, cubic = does.quadratic, does.cubic
        judged = judged._replace(
            binding=np.where(limits.is_cubic, *map(REQUIREMENTS.index, (CUBIC, QUADRATIC))).astype(np.int8),
            qpe_published_rad=qpe,
            cubic_rad=cubic,
            equal_loss_qpe_rad=does.judged(1.0),
            rest_rad=does.rest,
            quadratic_use=limits.quadratic_use,
        )
        both_limits = VibrationLimits(limits.quadratic, limits.quadratic)
        if self.judging.is_complete:
            judged = self._with_limits(judged, both_limits)._replace(qpe_full_rad=qpe)
        return VibrationRow(
            judged,
            both_limits,
            is_there=is_there,
            is_slow=True,
            cycles=cycles,
            qpe=qpe,
            cubic=cubic,
            without_autofocus=without_autofocus,
        )

    def _near_each_other(self, model: str, name: str) -> Iterator["VibrationRow"]:
        """Yield the rows of groups of vibration lines whose frequencies are so close that their echoes add.

        The size in each row is the amplitude [m] of a single line whose echo is as high as the echo of the group.
        """
        for index, (members, amplitude) in enumerate(self._near[name]):
            row_subject = subject(name, "vibration", "sinusoidal.sum", entry=index)
            is_there = np.asarray(members.any(axis=0))
            yield self._row(model, row_subject, "pslr", amplitude, self.tones.get(name), is_there, members=members)

    def _of_both_platforms(self) -> dict[str, Floats]:
        """Compute the peak phases of single lines that are equivalent to groups of lines of both platforms. [rad]

        A group consists of vibration lines with neighbouring frequencies, whose echoes add with their worst starting
        phases. The equivalent single line has an echo of the same height. The result gives, for each line of each
        platform, the peak phase of the equivalent line, (lines, cases). It is NaN if the line has no neighbour on the
        other platform, if all lines of the group have the amplitude 0, or if there is no requirement on PSLR.
        """
        ours = self.count[PLATFORMS[0]]
        amplitudes, cycles = (
            np.concatenate([of[name] for name in PLATFORMS]) for of in (self.amplitudes, self.cycles)
        )
        phases = np.full(cycles.shape, math.nan)
        if self.mission.requirements.pslr is not None and all(self.count.values()):
            for members, amplitude in _together(amplitudes, cycles):
                is_of_both = members[:ours].any(axis=0) & members[ours:].any(axis=0)
                phases = np.where(members & is_of_both & (amplitude > 0), self.to_phase * amplitude, phases)
        return {PLATFORMS[0]: phases[:ours], PLATFORMS[1]: phases[ours:]}


def _together(amplitudes: Floats, cycles: Floats) -> Iterator[tuple[Booleans, Floats]]:
    """Yield each group of neighbouring lines, and the amplitude of a single line with an equally high echo. [m]

    A group is a mask of the lines that belong to it, (lines, cases). The amplitude, (cases,), is 0 in the cases in
    which the group has no line. `cycles` are the cycles per aperture of all lines.
    """
    groups = near_groups(cycles)
    for index in range(groups.max(initial=-1) + 1):
        members = groups == index
        amplitude, cases = np.zeros(members.shape[1]), np.flatnonzero(members.any(axis=0))
        amplitude[cases] = worst_phases(amplitudes[:, cases], cycles[:, cases], members[:, cases]).amplitude
        yield members, amplitude


@dataclass(frozen=True, slots=True, eq=False)
class VibrationRow(FamilyRow):
    """Row for a spectral line, a group of neighbouring lines, or the noise of a platform, for an array of cases.

    `members` marks the lines of a group. `qpe` and `cubic` are the quadratic and cubic phase [rad] of a motion below
    three cycles per aperture, at its worst starting phase. If `is_slow` is set, only these phases have limits;
    otherwise the echoes of the motion have a limit too. `is_over_other` marks the cases in which the row would fail
    in the other model, which does not decide its status.

    If lines of both platforms are neighbours, their echoes add. `both` is the peak phase [rad] of a single line with
    an echo as high as the sum of these echoes. `level` is the level of that echo [dB], and `is_over_both` marks the
    cases in which it is too high.

    `per_metre` converts sizes from metres to the unit of the row.
    """

    limits: VibrationLimits | None = None
    is_slow: bool = False
    members: Booleans | None = None
    cycles: Any = math.nan
    qpe: Any = math.nan
    cubic: Any = math.nan
    both: Any = math.nan
    level: Any = math.nan
    is_over_other: Any = False
    is_over_both: Any = False
    without_autofocus: PerCase = 0.0
    per_metre: PerCase = 1.0

    def in_unit(self, per_metre: Floats) -> "VibrationRow":
        """Return the row in the unit in which the file states the line; `per_metre` converts metres to this unit."""
        if np.all(per_metre == 1):
            return self
        return replace(self, judged=self.judged.in_unit(per_metre), per_metre=per_metre)

    def in_words(self, case: Case, model: str) -> Row:
        """Build the report row of one case, including its notes; `model` is the model that determines the verdict."""
        row_subject = self.judged.subject
        error: MotionError = getattr(case.mission.platforms, row_subject.owner).motion_error
        if self.is_slow:
            return _slow_row(case, self, error, model)
        if self.members is not None:
            members = np.flatnonzero(self.members[:, case.place]).tolist()
            note = _lines_together(error, members, case.number(self.judged.declared))
            return _row(case, self, error, model, ("sinusoidal", members[0], "frequency"), (note,))
        if row_subject.axis == "wideband":
            wideband = error.vibration.wideband
            seen = () if wideband is None else _seen(case, self, error, wideband.rms)
            return _row(case, self, error, model, ("wideband", "rms"), seen)
        return _line_row(case, self, error, model)


# ---------------------------------------------------------------------- in words
def _line_row(case: Case, vibration_row: VibrationRow, error: MotionError, model: str) -> Row:
    mission, allocation, case_index = case.mission, case.allocation, case.place
    owner, index = vibration_row.judged.subject.owner, vibration_row.judged.subject.entry or 0
    key, lines = ("sinusoidal", index, "amplitude"), error.vibration.sinusoidal
    if not lines:
        return _row(case, vibration_row, error, model, key)
    doubt, more, required = NOTHING, list[Note](), mission.requirements.pslr
    if required is not None and not math.isnan(vibration_row.both[case_index]):
        (other_platform,) = (platform for platform in PLATFORMS if platform != owner)
        note = phrases.both_platforms_vibrate(
            other_platform,
            NEAR_CYCLES,
            float(vibration_row.level[case_index]),
            bool(vibration_row.both[case_index] > MAX_ECHO_PHASE_RAD),
            required,
        )
        more, doubt = [note], note if vibration_row.is_over_both[case_index] else NOTHING
    if vibration_row.cycles[case_index] < ECHO_CYCLES:
        limit = allocation.qpe_allowed(owner)
        qpe, cubic, allowed = (
            float(vibration_row.qpe[case_index]),
            float(vibration_row.cubic[case_index]),
            mission.requirements.cubic_phase_error,
        )
        more.insert(
            0, phrases.slower_than_three_cycles(float(vibration_row.cycles[case_index]), qpe, limit, cubic, allowed)
        )
    return _row(
        case,
        vibration_row,
        error,
        model,
        key,
        _seen(case, vibration_row, error, lines[index].displacement),
        more,
        doubt,
    )


def _row(
    case: Case,
    vibration_row: VibrationRow,
    error: MotionError,
    model: str,
    key: tuple[str | int, ...],
    notes: Sequence[Note] = (),
    more: Sequence[Note] = (),
    doubt: Note = NOTHING,
) -> Row:
    """Build the report row of a line, a group of lines or noise, with a limit on its echoes or its spread power.

    `key` is the key of the declared value below `vibration`. In the report, `notes` come before the notes on the
    limit of the row, and `more` after them.
    """
    row_subject, metric = vibration_row.judged.subject, vibration_row.judged.metric
    equation = VIBRATION_KIND.size(row_subject.axis.split(".")[0]).equation
    equation = equation if model == "published" else "first principles"
    missing, margin = phrases.note("no-requirement-of", metric=metric), None
    if vibration_row.limits is not None:
        limits = VibrationLimits(*map(case.number, vibration_row.limits))
        margin = float(limits.margin_db)
        notes = (*notes, phrases.published_rule_is_off(margin))
        if vibration_row.is_over_other[case.place]:
            other_model = OTHER_MODEL[model]
            allowed = float(limits.by(other_model)) * case.number(vibration_row.per_metre)
            doubt = phrases.note(
                "other-model-allows", model=other_model, limit=allowed, unit=_unit(case, vibration_row)
            )
    return worded(
        case,
        vibration_row.judged,
        unit=_unit(case, vibration_row),
        path=(*VIBRATION_KIND.section(row_subject.owner), *key),
        equation=equation,
        over=phase_over(case, vibration_row.judged) or phrases.share_of_power_over(metric, equation),
        doubt=doubt,
        no_limit=missing,
        info=missing,
        without_autofocus=case.number(vibration_row.without_autofocus),
        evidence=error.source,
        remarks=(*notes, *more),
        published_margin_db=margin,
        binding_requirement=phase_requirement(case, vibration_row.judged),
        displacement_m=case.moved_by_tone(row_subject, model),
    )


def _seen(case: Case, vibration_row: VibrationRow, error: MotionError, value: float | Vector) -> tuple[Note, ...]:
    metres = case.number(vibration_row.judged.declared) / case.number(vibration_row.per_metre)
    seen = projected(case.mission, value, error, metres, is_slow=vibration_row.is_slow)
    stated = (
        ()
        if seen or _unit(case, vibration_row) == "m"
        else (phrases.note("amplitude-of-acceleration", amplitude=metres),)
    )
    return (*stated, *seen)


def _unit(case: Case, vibration_row: VibrationRow) -> str:
    row_subject = vibration_row.judged.subject
    return (
        unit_of_line(case.mission, row_subject.owner, row_subject.entry or 0)
        if row_subject.axis == "sinusoidal"
        else "m"
    )


def _lines_together(error: MotionError, members: Sequence[int], declared: float) -> Note:
    shown = ", ".join(map(str, members[:5])) + (f" and {len(members) - 5} more" if len(members) > 5 else "")
    frequencies = [error.vibration.sinusoidal[member].frequency for member in members]
    ends = [format_quantity(end(frequencies), "Hz", 4) for end in (min, max)]
    return phrases.note(
        "lines-together", entries=shown, band=" to ".join(dict.fromkeys(ends)), apart=NEAR_CYCLES, amplitude=declared
    )


def _slow_row(case: Case, vibration_row: VibrationRow, error: MotionError, model: str) -> Row:
    mission = case.mission
    row_subject, combine = vibration_row.judged.subject, mission.allocation.combine
    cycles, qpe, cubic = map(case.number, (vibration_row.cycles, vibration_row.qpe, vibration_row.cubic))
    entry = row_subject.entry or 0
    return worded(
        case,
        vibration_row.judged,
        unit=_unit(case, vibration_row),
        path=VIBRATION_KIND.path(row_subject.owner, row_subject.axis, entry),
        equation="first principles",
        over=phase_over(case, vibration_row.judged),
        info=NOTHING if combine == "each" else phrases.note("aggregate-decides", combine=combine),
        without_autofocus=case.number(vibration_row.without_autofocus),
        evidence=error.source,
        remarks=(
            *_seen(case, vibration_row, error, error.vibration.sinusoidal[entry].displacement),
            phrases.note("slower-than-a-cycle", cycles=cycles, quadratic=qpe, cubic=cubic),
        ),
        binding_requirement=vibration_row.judged.requirement(case),
        displacement_m=case.moved_by_tone(row_subject, model),
    )
