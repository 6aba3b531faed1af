"""One row for each error: the largest size that every requirement allows, and what is declared against it."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from bisar_budget import phrases
from bisar_budget.analysis.allocation import Allocation
from bisar_budget.analysis.analysis import Analysis, Model
from bisar_budget.budget.judgement import judgement
from bisar_budget.budget.pull_in import caps, needed_sentence
from bisar_budget.constants import UTILIZATION_TOLERANCE
from bisar_budget.effects.effect import ErrorSource
from bisar_budget.effects.models import CUBIC, END_OF_IMAGE, LOCATION, QUADRATIC, Declared
from bisar_budget.findings.row import Row
from bisar_budget.geometry import FRAME_AXES
from bisar_budget.phrases import NOTHING, Note


class Allowed(NamedTuple):
    """How large one error may be by one model [unit]: by its quadratic phase alone, and by every requirement.

    None: no limit. `binding` is the requirement that sets the smallest, or that the image ends there.
    """

    quadratic: float | None
    smallest: float | None
    binding: str | None


NOT_ASKED = Allowed(None, None, None)


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
    # A terminal shows allowables of undeclared errors only where nothing else is there to show.
    is_brief = analysis.is_brief and bool(analysis.stated)
    shown = [one for one in analysis.sources if not is_brief or (one.declared is not None and one.is_independent)]
    held = [(source, limits[source.owner]) for source in shown]
    allowed_of = dict(zip([source.id for source in shown], allowed_by(analysis, model, held), strict=True))
    others_of: dict[str, Allowed] = {}
    if not is_brief:
        others_of = dict(zip(allowed_of, allowed_by(analysis, other, held), strict=True))
    elif model.name == "published" and not analysis.is_bare:  # whether it holds is said beside the verdict
        asked = [(source, QUADRATIC, limit, math.inf) for source, limit in held]
        for source, *both in zip(shown, model.allowables(asked), other.allowables(asked), strict=True):
            allowed_of[source.id] = allowed_of[source.id]._replace(quadratic=both[0])
            others_of[source.id] = NOT_ASKED._replace(quadratic=both[1])
    for source in analysis.sources:
        limit = limits[source.owner]
        declared = None if source.declared is None else abs(source.declared)
        if source.id not in allowed_of:
            yield _unseen(analysis, model, source, declared)
            continue
        allowed, allowed_other = allowed_of[source.id], others_of.get(source.id, NOT_ASKED)
        published, full = (allowed, allowed_other) if model.name == "published" else (allowed_other, allowed)
        info = over = doubt = NOTHING
        notes = source.notes
        qpe_published = qpe_full = cubic = displacement = None
        qpe = 0.0
        if declared is not None:
            mine, theirs = analysis.does(model, source), analysis.does(other, source)
            by_published, by_full = (mine, theirs) if model.name == "published" else (theirs, mine)
            qpe, qpe_published = abs(mine.qpe), abs(by_published.qpe)
            qpe_full = by_full.qpe if math.isfinite(by_full.qpe) else None
            cubic = abs(mine.cubic) if math.isfinite(mine.cubic) else None
            displacement = mine.displacement
            if displacement is None and source.is_motion and model.plane.degeneracy:
                notes = (*notes, model.plane.degeneracy)
            if not source.is_independent:
                info = _stated_elsewhere(analysis, source)
            elif combine != "each":
                info = phrases.aggregate_decides(combine)
            else:
                if allowed.smallest is not None and declared > allowed.smallest:
                    over = _over(analysis, model, source, mine, allowed, limit, allocation)
                doubt = _doubt(analysis, other, source, theirs, limit)
        found = judgement(
            warn_above=mission.allocation.warn_above,
            declared=declared,
            allowable=allowed.smallest,
            without_autofocus=qpe / (limit / gain) if gain > 1 else 0.0,
            over=over,
            doubt=doubt,
            no_limit=model.no_limit(source) if allowed.smallest is None else NOTHING,
            info=info,
        )
        yield Row(
            subject=source.subject,
            metric=QUADRATIC,
            unit=source.unit,
            declared=declared,
            allowable=allowed.smallest,
            allowable_published=published.quadratic,
            allowable_full=full.quadratic,
            qpe_published_rad=qpe_published,
            qpe_full_rad=qpe_full,
            displacement_m=displacement,
            utilization=found.utilization,
            margin=found.margin,
            status=found.status,
            line=mission.line(source.path),
            reason=found.reason or None,
            remarks=(*notes, *found.remarks),
            equation=model.equation(source),
            requirement_id=mission.requirement_ids.get(source.id),
            evidence=source.evidence,
            is_independent=source.is_independent,
            qpe_exact_rad=qpe_full,
            binding_requirement=allowed.binding,
            cubic_rad=cubic,
            model=model.name,
        )


def allowed_by(analysis: Analysis, model: Model, sources: Sequence[tuple[ErrorSource, float]]) -> list[Allowed]:
    """How large errors may be by a model, the quadratic phase of each being held to a limit. [unit]"""
    requirements, is_brief = analysis.mission.requirements, analysis.is_brief
    found = [Allowed(None, None, None) for _ in sources]
    held: list[list[tuple[str, float]]] = []
    for source, limit in sources:
        of_it = [(QUADRATIC, limit)]
        if source.is_motion:
            others = ((CUBIC, requirements.cubic_phase_error), (LOCATION, requirements.location_error))
            of_it += [(name, required) for name, required in others if required is not None]
        if is_brief:  # the one that binds is likely to be found first, and nothing beyond it is searched
            of_it.sort(key=lambda one, source=source: model.small(source, *one))  # type: ignore[misc]
        held.append(of_it)
    for turn in range(3):
        places = [place for place, of_it in enumerate(held) if turn < len(of_it)]
        asked = []
        for place in places:
            name, required = held[place][turn]
            upto = found[place].smallest
            if upto is None or (name == QUADRATIC and not is_brief):
                upto = math.inf
            asked.append((sources[place][0], name, required, upto))
        for place, (_, name, *_), size in zip(places, asked, model.allowables(asked), strict=True):
            one = found[place]
            if name == QUADRATIC:
                one = one._replace(quadratic=size)
            if size is not None and (one.smallest is None or size < one.smallest):
                one = one._replace(smallest=size, binding=name)
            found[place] = one
    for place, (source, _) in enumerate(sources):
        smallest = found[place].smallest
        if smallest is not None and model.ends_image(source, smallest):
            found[place] = found[place]._replace(binding=END_OF_IMAGE)
    return found


def _over(
    analysis: Analysis,
    model: Model,
    source: ErrorSource,
    mine: Declared,
    allowed: Allowed,
    limit: float,
    allocation: Allocation,
) -> Note:
    """Say which requirement the declared error breaks, should it break one."""
    requirements = analysis.mission.requirements
    if allowed.binding == END_OF_IMAGE and allowed.smallest is not None:
        return phrases.beyond_the_image(allowed.smallest, source.unit)
    if allowed.binding == CUBIC and requirements.cubic_phase_error is not None:
        return phrases.cubic_phase_over(mine.cubic, requirements.cubic_phase_error, model.equation(source))
    if allowed.binding == LOCATION and requirements.location_error is not None:
        moved = None if mine.farthest is None else math.hypot(*mine.farthest)
        by = "equation (25)" if model.name == "published" else "full model"
        return phrases.location_over(moved, requirements.location_error, by)
    qpe = abs(mine.qpe)
    over = phrases.quadratic_phase_over(qpe, limit, model.equation(source))
    if not math.isfinite(qpe):
        return over
    return over.then(needed_sentence(allocation.n_pull_needed(qpe, source.owner), caps(analysis.mission)))


def _doubt(analysis: Analysis, other: Model, source: ErrorSource, theirs: Declared, limit: float) -> Note:
    """Say that the model that does not gate fails the declared error, and why it thinks otherwise; else nothing."""
    requirements = analysis.mission.requirements
    moved = 0.0 if theirs.farthest is None else math.hypot(*theirs.farthest)
    held = [(abs(theirs.qpe), limit, QUADRATIC)]
    if source.is_motion:
        held += [
            (size, required, name)
            for size, required, name in (
                (abs(theirs.cubic), requirements.cubic_phase_error, CUBIC),
                (moved, requirements.location_error, LOCATION),
            )
            if required is not None
        ]
    size, allowed, binding = max(held, key=lambda one: one[0] / one[1])
    if size <= allowed * (1 + UTILIZATION_TOLERANCE) or other.is_blind:
        return NOTHING
    if binding == LOCATION:
        return phrases.other_model_fails(other.name, moved, allowed, "m", "displacement")
    if binding == CUBIC:
        return phrases.other_model_fails(other.name, size, allowed, "rad", "cubic phase")
    if other.name == "published":
        return phrases.other_model_fails(other.name, size, allowed, "rad", "QPE", source.equation)
    return phrases.other_model_fails(other.name, size, allowed, "rad", "QPE").then(_cause(source))


def _unseen(analysis: Analysis, model: Model, source: ErrorSource, declared: float | None) -> Row:
    """Row of an error that a terminal counts and does not show."""
    return Row.without_numbers(
        source.subject,
        QUADRATIC,
        source.unit,
        "not_declared" if declared is None else "info",
        declared=declared,
        line=analysis.mission.line(source.path),
        equation=model.equation(source),
        requirement_id=analysis.mission.requirement_ids.get(source.id),
        evidence=source.evidence,
        is_independent=source.is_independent,
        model=model.name,
    )


def _cause(source: ErrorSource) -> Note:
    """Say what the full model counts and the published one does not."""
    if source.subject.kind == "terrain":
        return phrases.wrong_height_defocuses()
    if source.unit == "m":
        return phrases.position_defocuses()
    if not source.is_position:
        return phrases.displacement_defocuses()
    return phrases.turning_defocuses()


def _stated_elsewhere(analysis: Analysis, source: ErrorSource) -> Note:
    frame = getattr(analysis.mission.platforms, source.owner).motion_error.frame
    return phrases.stated_along_other_axes([axis.replace("_", " ") for axis in FRAME_AXES[frame]])
