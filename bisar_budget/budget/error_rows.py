"""One row for each error: the largest size that every requirement allows, and what is declared against it."""

import math
from collections.abc import Iterator
from typing import NamedTuple

from bisar_budget.budget.allocation import Allocation
from bisar_budget.budget.analysis import Analysis, Model
from bisar_budget.budget.effects import ErrorSource
from bisar_budget.budget.findings import Row
from bisar_budget.budget.judgement import judgement
from bisar_budget.budget.models import CUBIC, LOCATION, QUADRATIC, Declared
from bisar_budget.budget.pull_in import caps, needed_sentence
from bisar_budget.constants import UTILIZATION_TOLERANCE
from bisar_budget.geometry import FRAME_AXES
from bisar_budget.units import format_limit, format_quantity


class Allowed(NamedTuple):
    """How large one error may be by one model [unit]: by its quadratic phase alone, and by every requirement.

    None: no limit. `binding` is the requirement that sets the smallest.
    """

    quadratic: float | None
    smallest: float | None
    binding: str | None


def error_rows(analysis: Analysis, model: Model, other: Model, allocation: Allocation) -> Iterator[Row]:
    """Rows of every error, declared or not, in the order of the contract.

    Parameters
    ----------
    analysis : Analysis
        Of the mission.
    model, other : Model
        The one that gates, and the one that may doubt a pass.
    allocation : Allocation
        Shares of the quadratic phase.
    """
    mission = analysis.mission
    combine, gain = mission.allocation.combine, allocation.autofocus_gain
    limits = {owner: allocation.qpe_limit(owner) * gain for owner in ("transmitter", "receiver", "clock", "mission")}
    found, found_other = analysis.declared(model), analysis.declared(other)
    for source in analysis.sources:
        limit = limits[source.owner]
        allowed = allowed_by(analysis, model, source, limit)
        allowed_other = allowed_by(analysis, other, source, limit)
        published, full = (allowed, allowed_other) if model.name == "published" else (allowed_other, allowed)
        declared = None if source.declared is None else abs(source.declared)
        info = over = doubt = ""
        notes = source.notes
        qpe_published = qpe_full = cubic = displacement = None
        if declared is not None:
            mine, theirs = found[source.id], found_other[source.id]
            by_published, by_full = (mine, theirs) if model.name == "published" else (theirs, mine)
            qpe_published, qpe_full = abs(by_published.qpe), by_full.qpe
            if not math.isfinite(qpe_full):
                qpe_full = None
            cubic = abs(mine.cubic) if math.isfinite(mine.cubic) else None
            displacement = mine.displacement
            if displacement is None and source.is_motion and model.plane.degeneracy:
                notes = (*notes, model.plane.degeneracy)
            if not source.is_independent:
                info = _stated_elsewhere(analysis, source)
            elif combine != "each":
                info = f"combine is {combine}: the aggregate decides"
            else:
                if allowed.smallest is not None and declared > allowed.smallest:
                    over = _over(analysis, model, source, mine, allowed, limit, allocation)
                doubt = _doubt(analysis, model, other, source, theirs, allowed_other, declared, limit)
        no_limit = model.no_limit(source) if allowed.smallest is None else ""
        utilization, margin, status, reason, notes = judgement(
            mission.allocation.warn_above, declared, allowed.smallest, 1.0, over, doubt, no_limit, "", info, True,
            False, notes,
        )  # fmt: skip
        if status in ("pass", "warn") and not doubt and declared is not None and gain > 1:
            # Over the limit without the gain: the phase says so, the size would not where it is no longer linear.
            without = abs(found[source.id].qpe) / (limit / gain)
            if without > 1 + UTILIZATION_TOLERANCE:
                status, reason = "pass_with_autofocus", f"{without:.3g} times the limit without autofocus"
                if utilization is not None and utilization > mission.allocation.warn_above:
                    notes = (*notes, f"uses {100 * utilization:.3g} % of the limit with autofocus")
        yield Row._make(  # twice as quick as by keyword, and there are two dozen in every mission
            (
                source.id,
                QUADRATIC,
                source.unit,
                declared,
                allowed.smallest,
                published.quadratic,
                full.quadratic,
                qpe_published,
                qpe_full,
                displacement,
                utilization,
                margin,
                status,
                mission.line(source.path),
                reason or None,
                notes,
                model.equation(source),
                mission.requirement_ids.get(source.id),
                source.evidence,
                source.is_independent,
                qpe_full,
                None,
                allowed.binding,
                cubic,
                None,
                model.name,
            )
        )


def allowed_by(analysis: Analysis, model: Model, source: ErrorSource, limit: float) -> Allowed:
    """How large an error may be by a model, its quadratic phase being held to a limit. [unit]"""
    quadratic = model.allowable(source, QUADRATIC, limit)
    smallest, binding = quadratic, None if quadratic is None else QUADRATIC
    if source.is_motion:
        requirements = analysis.mission.requirements
        for name, required in ((CUBIC, requirements.cubic_phase_error), (LOCATION, requirements.location_error)):
            if required is not None:
                size = model.allowable(source, name, required)
                if size is not None and (smallest is None or size < smallest):
                    smallest, binding = size, name
    return Allowed(quadratic, smallest, binding)


def _over(
    analysis: Analysis,
    model: Model,
    source: ErrorSource,
    mine: Declared,
    allowed: Allowed,
    limit: float,
    allocation: Allocation,
) -> str:
    """Say which requirement the declared error breaks, should it break one."""
    requirements = analysis.mission.requirements
    if allowed.binding == CUBIC and requirements.cubic_phase_error is not None:
        return (
            f"cubic phase {_phase(mine.cubic)}, {format_limit(requirements.cubic_phase_error, 'rad')} allowed "
            f"({model.equation(source)}); autofocus gain does not apply"
        )
    if allowed.binding == LOCATION and requirements.location_error is not None:
        moved = "out of sight" if mine.farthest is None else f"by {format_quantity(math.hypot(*mine.farthest), 'm')}"
        by = "equation (25)" if model.name == "published" else "full model"
        return f"moves the image {moved}, {format_limit(requirements.location_error, 'm')} allowed ({by})"
    qpe = abs(mine.qpe)
    text = f"QPE {_phase(qpe)}, {format_limit(limit, 'rad')} allowed ({model.equation(source)})"
    if not math.isfinite(qpe):
        return text
    return f"{text}; {needed_sentence(allocation.n_pull_needed(qpe, source.owner), caps(analysis.mission))}"


def _phase(phase: float) -> str:
    return (
        f"{abs(phase):.3g} rad"
        if math.isfinite(phase)
        else "without a value (no ground point has this range history)"
    )


def _doubt(
    analysis: Analysis,
    model: Model,
    other: Model,
    source: ErrorSource,
    theirs: Declared,
    allowed: Allowed,
    declared: float,
    limit: float,
) -> str:
    """Say that the model that does not gate fails the error, and why it thinks otherwise; else nothing."""
    if allowed.smallest is None or declared <= allowed.smallest * (1 + UTILIZATION_TOLERANCE):
        return ""
    requirements = analysis.mission.requirements
    says = f"the {other.name} model says fail"
    if allowed.binding == CUBIC and requirements.cubic_phase_error is not None:
        allows = format_limit(requirements.cubic_phase_error, "rad")
        return f"{says}: cubic phase {_phase(theirs.cubic)}, {allows} allowed"
    if allowed.binding == LOCATION and requirements.location_error is not None:
        moved = "out of sight" if theirs.farthest is None else format_quantity(math.hypot(*theirs.farthest), "m")
        return f"{says}: displacement {moved}, {format_limit(requirements.location_error, 'm')} allowed"
    text = f"{says}: QPE {_phase(theirs.qpe)}, {format_limit(limit, 'rad')} allowed"
    return f"{text}; {_cause(source)}" if other.name == "full" else f"{text} ({source.equation})"


def _cause(source: ErrorSource) -> str:
    """Say what the full model counts and the published one does not."""
    if source.id == "mission.terrain":
        return "a bistatic image defocuses on a wrong height"
    if source.unit == "m":
        return "the line of sight turns over a position error, and its displacement defocuses"
    if not source.is_position:
        return "the displaced response has a quadratic phase of its own"
    return "the line of sight turns, and the displaced response has a quadratic phase of its own"


def _stated_elsewhere(analysis: Analysis, source: ErrorSource) -> str:
    frame = getattr(analysis.mission.platforms, source.owner).motion_error.frame
    axes = ", ".join(axis.replace("_", " ") for axis in FRAME_AXES[frame])
    return f"the file states this error along other axes ({axes}): those rows decide"
