"""Rows of single errors, which compare the declared size with the size that requirements or a specification allow."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from bisar_budget import phrases
from bisar_budget.analysis.analysis import Analysis, Case, Model
from bisar_budget.arrays import Floats, PerCase, PerCaseFlag
from bisar_budget.budget.judged_rows import (
    CODE,
    EFFECT_WORDS,
    LIMIT_RATIO,
    REQUIREMENTS,
    FamilyRow,
    Judged,
    Judging,
    worded,
)
from bisar_budget.effects.declared import (
    CUBIC,
    END_OF_IMAGE,
    LIMITING_REQUIREMENTS,
    LOCATION,
    OTHER_MODEL,
    QUADRATIC,
    Declared,
)
from bisar_budget.effects.effect import PLATFORMS, ErrorSource, subject
from bisar_budget.error_kinds.clock_kinds import SYNCHRONIZATION_KIND, TIMING_KIND
from bisar_budget.findings.row import SPECIFICATION, Row
from bisar_budget.geometry import FRAME_AXES
from bisar_budget.mission.changes import name_of_error, parts_of
from bisar_budget.mission.quantities import Number, largest_at
from bisar_budget.phrases import NOTHING, Note

_CLOCK_SECTIONS = [kind.section("clock")[0] for kind in (TIMING_KIND, SYNCHRONIZATION_KIND)]
_BINDING = np.array(
    [REQUIREMENTS.index(name) for name in (*LIMITING_REQUIREMENTS, END_OF_IMAGE)] + [-1], dtype=np.int8
)


class ErrorRows:
    """Builds the rows of position, velocity, acceleration and clock errors, and of the `other` errors.

    Parameters
    ----------
    judging : Judging
        Judges the rows of the cases.
    analysis : Analysis
        Analysis of the cases.
    limits : mapping of str to (cases,)
        Limit on the quadratic phase [rad] for each owner (platform, clock or mission), including the autofocus gain.
    """

    def __init__(self, judging: Judging, analysis: Analysis, limits: Mapping[str, Floats]) -> None:
        self.judging, self.errors, self.limits = judging, analysis.errors, limits
        self.gain = judging.array(analysis.allocation.autofocus_gain)
        self.is_of_sums = analysis.is_of_sums

    def rows(self, gating: str) -> Iterator["ErrorRow"]:
        """Yield the rows of position, velocity, acceleration, clock and `other` errors.

        `gating` is the model that judges the rows. A row that passes in this model becomes a warning if it fails in
        the other model.
        """
        for block_index in range(len(self.errors.blocks)):
            yield from self._of_block(block_index, gating)

    def _of_block(self, block_index: int, gating: str) -> Iterator["ErrorRow"]:
        errors, block, asks_for_all = self.errors, self.errors.blocks[block_index], self.judging.is_complete
        other_model = OTHER_MODEL[gating]
        needs, sources = errors.mission.requirements, block.sources
        limit = np.array([self.limits[source.owner] for source in sources])
        limits = (limit, needs.cubic_phase_error, needs.location_error)
        # A search for the allowable starts from the known effects of the declared error.
        mine, theirs = errors.of_block(gating, block_index), errors.of_block(other_model, block_index)
        judged_by_mine, judged_by_theirs = (
            errors.judged_of_block(model, block_index) for model in (gating, other_model)
        )
        searched = (None, None, None) if self.is_of_sums else limits
        allowed = block.allowed(gating, searched, is_complete=asks_for_all)
        published, full = (mine, theirs) if gating == "published" else (theirs, mine)
        is_again = np.array([[not source.is_independent] for source in sources])
        judged = self.judging.row(
            sources[0].subject,
            np.abs(block.declared),
            allowed.smallest,
            doubt=errors.doubts(other_model, _is_over(judged_by_theirs, self.gain, limits, block.is_motion)),
            without_autofocus=np.where(self.gain > 1, judged_by_mine.equal_loss / (limit / self.gain), 0.0),
            use=allowed.uses,
            is_info=is_again | (errors.mission.allocation.combine != "each"),
        )
        judged = judged._replace(
            binding=_BINDING[allowed.binding],
            qpe_published_rad=np.abs(published.qpe),
            cubic_rad=np.where(np.isfinite(mine.cubic), np.abs(mine.cubic), math.nan),
            quadratic_use=judged_by_mine.judged(self.gain) / limit,
            equal_loss_qpe_rad=np.where(np.isfinite(full.qpe) & block.is_motion, full.equal_loss, math.nan),
            rest_rad=np.where(np.isfinite(full.qpe) & block.is_motion, full.rest, math.nan),
        )
        if asks_for_all:
            allowed_by_other = block.allowed(other_model, (limit, None, None), is_complete=True)
            quadratic = {gating: allowed.quadratic, other_model: allowed_by_other.quadratic}
            judged = judged._replace(
                allowable_published=quadratic["published"],
                allowable_full=quadratic["full"],
                qpe_full_rad=np.where(np.isfinite(full.qpe), full.qpe, math.nan),
                is_of_ranges=True,
            )
        is_last = gating == "full" or errors.mission.gating_model == "published"
        if is_last and len(errors.blocks) > 1:
            block.forget()
        for row, source in enumerate(sources):
            yield ErrorRow(judged.at(row, source.subject), source, self.limits[source.owner])


def _is_over(
    does: Declared, gain: PerCase, limits: tuple[Floats, float | None, float | None], is_motion: PerCaseFlag
) -> PerCaseFlag:
    """Decide for each error whether at least one of its effects exceeds its limit, (errors, cases).

    The effects are the quadratic phase, the cubic phase and the displacement of the image. `limits` holds the three
    limits in this order.
    """
    limit, cubic, location = limits
    is_over = does.judged(gain) / limit > LIMIT_RATIO
    if cubic is not None:
        is_over |= is_motion & (np.abs(does.cubic) / cubic > LIMIT_RATIO)
    if location is not None:
        is_over |= np.hypot(*does.farthest) / location > LIMIT_RATIO
    return is_over


@dataclass(frozen=True, slots=True, eq=False)
class ErrorRow(FamilyRow):
    """The budget row of one error, for an array of cases; `limit` is the limit on its quadratic phase [rad]."""

    source: ErrorSource
    limit: Floats

    def in_words(self, case: Case, gating: str) -> Row:
        """Build the report row for one case, including its text; `gating` names the model that judges the row."""
        mission, row, source = case.mission, self.judged, self.source
        model, other_model = case.analysis.models(gating)
        gain, status = case.allocation.autofocus_gain, row.status[case.place]
        limit = case.number(self.limit)
        over = doubt = info = NOTHING
        notes, fields = source.notes, dict[str, Any]()
        equal_loss = 0.0
        if source.declared is not None:
            bias = case.number(source.bias)
            fields = {"displacement_m": case.does(model, source).displacement, "bias": bias or None}
            mine = case.judged(model, source)
            equal_loss = float(mine.equal_loss)
            if mine.displacement is None and source.is_motion:
                notes = (*notes, *filter(None, [case.degeneracy(gating)]))
            if status == CODE["fail"]:
                over = _over(case, model, row, source, mine, limit)
            elif status == CODE["warn"]:
                doubt = _doubt(case, other_model, source, limit)
            elif not source.is_independent:
                info = _stated_elsewhere(case, source)
            else:
                info = phrases.note("aggregate-decides", combine=mission.allocation.combine)
        return worded(
            case,
            row,
            unit=source.unit,
            path=source.path,
            equation=model.equation(source),
            over=over,
            doubt=doubt,
            no_limit=model.no_limit(source),
            info=info,
            without_autofocus=equal_loss / (limit / gain) if gain > 1 else 0.0,
            remarks=notes,
            evidence=source.evidence,
            is_independent=source.is_independent,
            binding_requirement=row.requirement(case),
            **fields,
        )


# ---------------------------------------------------------------------- in words
def _over(case: Case, model: Model, row: Judged, source: ErrorSource, mine: Declared, limit: float) -> Note:
    """Write the reason why a row fails, including the requirement that the declared error exceeds.

    `mine` holds the effects of the error in `model`, at the sizes that requirements judge. `limit` [rad] is the limit
    of its quadratic phase.
    """
    requirements, binding = case.mission.requirements, row.requirement(case)
    if binding == END_OF_IMAGE:
        return phrases.note("beyond-the-image", end=case.number(row.allowable), unit=source.unit)
    if binding == CUBIC and requirements.cubic_phase_error is not None:
        return phrases.cubic_phase_over(mine.cubic, requirements.cubic_phase_error, model.equation(source))
    if binding == LOCATION and requirements.location_error is not None:
        moved = None if mine.farthest is None else math.hypot(*mine.farthest)
        by = "equation (25)" if model.is_published else "full model"
        return phrases.location_over(moved, requirements.location_error, by)
    gain, hidden = case.allocation.autofocus_gain, float(mine.hidden)
    if not math.isfinite(mine.qpe):
        return phrases.note("no-image-of", allowable=case.number(row.allowable), unit=source.unit, limit=limit)
    over = phrases.quadratic_phase_over(float(mine.judged(gain)), limit, model.equation(source), abs(mine.qpe))
    return over.then(case.allocation.passes_with(abs(mine.qpe), hidden, source.owner, case.mission))


def _doubt(case: Case, other: Model, source: ErrorSource, limit: float) -> Note:
    """Explain why the declared error fails in the model `other`, which does not judge the error.

    The note is empty if the error passes in this model. `limit` [rad] is the limit of the quadratic phase.
    """
    needs, theirs = case.mission.requirements, case.judged(other, source)
    uses = [(float(theirs.judged(case.allocation.autofocus_gain)), limit, QUADRATIC)]
    if source.is_motion and needs.cubic_phase_error is not None:
        uses.append((abs(theirs.cubic), needs.cubic_phase_error, CUBIC))
    if source.is_motion and needs.location_error is not None:
        moved = 0.0 if theirs.farthest is None else math.hypot(*theirs.farthest)
        uses.append((moved, needs.location_error, LOCATION))
    size, allowed, binding = max(uses, key=lambda use: use[0] / use[1])
    if size <= allowed * LIMIT_RATIO or other.is_blind:
        return NOTHING
    if binding == QUADRATIC and other.is_published:
        return phrases.other_model_fails(other.name, size, allowed, *EFFECT_WORDS[binding], source.equation)
    note = phrases.other_model_fails(other.name, size, allowed, *EFFECT_WORDS[binding])
    return note.then(_cause(source)) if binding == QUADRATIC else note


def _cause(source: ErrorSource) -> Note:
    """Write a note on the effect that only the full model includes for this error."""
    if source.kind.direction:  # terrain
        return phrases.note("wrong-height-defocuses")
    if source.kind.order == 0:
        return phrases.note("position-defocuses")
    if not source.is_position:
        return phrases.note("displacement-defocuses")
    return phrases.note("turning-defocuses")


def _stated_elsewhere(case: Case, source: ErrorSource) -> Note:
    frame = getattr(case.mission.platforms, source.owner).motion_error.frame
    return phrases.note("stated-along-other-axes", axes=[axis.replace("_", " ") for axis in FRAME_AXES[frame]])


# ---------------------------------------------------------------------- specifications
def specification_rows(judging: Judging, analysis: Analysis) -> Iterator["SpecificationRow"]:
    """Yield the row of each specification, which compares the declared value with the specified value.

    If the file declares values for several axes, the largest of them must not exceed the specified value. The
    coverage factor is not applied. If an error is specified but not declared, its row is not evaluated. An error may
    use its full specification without causing a warning.
    """
    for number in analysis.mission.specifications.values():
        most, largest_declared = judging.array(number.value), judging.array(largest_at(analysis.mission, number))
        row_subject = subject(_owner(number.key), SPECIFICATION, name_of_error(number.key))
        of_amplitudes: Callable[[Floats], Floats] = _amplitude if number.is_level else np.asarray
        judged = judging._replace(warn_above=1.0).row(
            row_subject, of_amplitudes(largest_declared), of_amplitudes(most)
        )
        status = np.where(np.isnan(largest_declared), CODE["not_evaluated"], judged.status).astype(np.int8)
        judged = judged._replace(status=status, declared=largest_declared, allowable=most, metric=SPECIFICATION)
        yield SpecificationRow(judged, number)


@dataclass(frozen=True, slots=True, eq=False)
class SpecificationRow(FamilyRow):
    """The row of one specification, for an array of cases."""

    number: Number

    def in_words(self, case: Case, model: str) -> Row:
        """Build the report row for one case, including its text. The row is the same for both models."""
        return worded(
            case,
            self.judged,
            unit=self.number.dimension.si,
            path=("specifications", self.number.key),
            equation="declared against specified",
            over=phrases.note("more-than-specified"),
            not_evaluated=phrases.note("specified-and-not-declared", key=self.number.key),
            is_independent=False,
        )


def _amplitude(level: Floats) -> Floats:
    return np.asarray(10 ** (level / 20))


def _owner(key: str) -> str:
    section, name, *_ = (*parts_of(key), "")
    if section == "platforms":
        return name if name in PLATFORMS else "mission"
    return "clock" if section in _CLOCK_SECTIONS else "mission"
