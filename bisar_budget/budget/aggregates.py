"""What the declared errors add up to: phases of platforms and mission, cubic phase, location, autofocus pull-in."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from bisar_budget import phrases
from bisar_budget.analysis.allocation import Allocation
from bisar_budget.analysis.analysis import Analysis, Model
from bisar_budget.analysis.together import Together
from bisar_budget.budget.judgement import judged
from bisar_budget.budget.pull_in import caps, needed_sentence
from bisar_budget.constants import UTILIZATION_TOLERANCE
from bisar_budget.effects.correlation import (
    combined_displacement,
    combined_phase,
    correlation_notes,
    displacement_parts,
    phase_parts,
)
from bisar_budget.effects.models import CUBIC, LOCATION, QUADRATIC
from bisar_budget.effects.subject import subject
from bisar_budget.findings.row import Row
from bisar_budget.mission.model import Mission
from bisar_budget.phrases import NOTHING, Note


def aggregate_rows(analysis: Analysis, model: Model, other: Model, allocation: Allocation) -> Iterator[Row]:
    """Rows of the declared errors together, under the mission's rule of combination.

    Parameters
    ----------
    analysis : Analysis
        Of the mission.
    model, other : Model
        The one that gates, and the one that may doubt a pass.
    allocation : Allocation
        Shares of the quadratic phase.
    """
    mine, theirs = Together(analysis, model), Together(analysis, other)
    if analysis.mission.allocation.combine != "each":
        yield from _qpe_rows(analysis, mine, theirs, allocation)
    else:
        yield from _qpe_of_all(analysis, mine, allocation)
    yield _cubic_row(analysis, mine, theirs)
    yield _location_row(analysis, mine, theirs)
    if allocation.n_pull is not None:
        yield _pull_in_row(analysis, mine, theirs, math.pi * allocation.n_pull)


def _qpe_rows(analysis: Analysis, mine: Together, theirs: Together, allocation: Allocation) -> Iterator[Row]:
    mission, groups = analysis.mission, analysis.groups
    combine, gain = mission.allocation.combine, allocation.autofocus_gain
    owners = ["transmitter", "receiver", "mission"]
    if allocation.qpe.clock is not None:
        owners.insert(2, "clock")  # else it counts with the receiver
    for owner in owners:
        phases, others = mine.owed(allocation, owner), theirs.owed(allocation, owner)
        qpe, by_other = (combined_phase(of, combine, groups) if of else None for of in (phases, others))
        published, full = (qpe, by_other) if mine.model.name == "published" else (by_other, qpe)
        limit = allocation.qpe_limit(owner) * gain
        over = NOTHING
        if qpe is not None:
            over = _exceeded(
                "QPE", qpe, limit, "rad", partial(phase_parts, phases, combine, groups), mine.extrapolated
            )
            if over and math.isfinite(qpe):
                over = over.then(needed_sentence(allocation.n_pull_needed(qpe, owner), caps(mission)))
        yield _judged(
            mission,
            subject=subject(owner, QUADRATIC),
            metric=QUADRATIC,
            unit="rad",
            declared=qpe,
            allowable=limit,
            path={"mission": ("platforms",), "clock": ("timing_error",)}.get(
                owner, ("platforms", owner, "motion_error")
            ),
            equation="sum of the rows" if combine == "sum" else "root-sum-square of the rows",
            gain=gain,
            over=over,
            doubt=_doubt(theirs.model, by_other, limit, "rad"),
            limits=(limit, limit),
            qpe=published,
            qpe_full=full if full is None or math.isfinite(full) else None,
            notes=correlation_notes(combine, [g for g in groups if owner in (g.platform, "mission")]),
        )


def _qpe_of_all(analysis: Analysis, mine: Together, allocation: Allocation) -> Iterator[Row]:
    """Where each error stands alone: a warning if all together, by root-sum-square, exceed the total."""
    mission, phases = analysis.mission, mine.owed(allocation, "mission")
    limit = allocation.qpe_total * allocation.autofocus_gain
    warning = _of_all("QPE", combined_phase(phases, "rss", analysis.groups), limit, "rad")
    if not warning:
        return
    largest = combined_phase(phases, "each", analysis.groups)
    if largest > limit * (1 + UTILIZATION_TOLERANCE):
        return  # its own row says so
    yield _judged(
        mission,
        subject=subject("mission", QUADRATIC),
        metric=QUADRATIC,
        unit="rad",
        declared=largest,
        allowable=limit,
        path=("platforms",),
        equation="largest of the rows",
        gain=allocation.autofocus_gain,
        doubt=warning,
        limits=(limit, limit),
    )


def _cubic_row(analysis: Analysis, mine: Together, theirs: Together) -> Row:
    mission, groups = analysis.mission, analysis.groups
    combine, limit = mission.allocation.combine, mission.requirements.cubic_phase_error
    phases = mine.all_cubics()
    cubic, by_other = (combined_phase(of, combine, groups) if of else None for of in (phases, theirs.all_cubics()))
    over = _exceeded(
        "cubic phase", cubic, limit, "rad", lambda: phase_parts(phases, combine, groups), mine.extrapolated
    )
    doubt = _doubt(theirs.model, by_other, limit, "rad")
    if combine == "each":
        doubt = _of_all("cubic phase", combined_phase(phases, "rss", groups), limit, "rad") or doubt
    row = _judged(
        mission,
        subject=subject("mission", CUBIC),
        metric=CUBIC,
        unit="rad",
        declared=cubic,
        allowable=limit,
        path=("requirements", "cubic_phase_error"),
        equation="Table I, cubic column" if mine.model.name == "published" else "full model",
        no_limit=phrases.no_requirement(),
        info=NOTHING if limit is not None else phrases.no_requirement(),
        over=over.then(phrases.no_gain()),
        doubt=doubt,
        notes=correlation_notes(combine, groups) if combine != "each" else (),
    )
    return row._replace(cubic_rad=row.declared)


def _location_row(analysis: Analysis, mine: Together, theirs: Together) -> Row:
    mission, groups = analysis.mission, analysis.groups
    combine, limit = mission.allocation.combine, mission.requirements.location_error
    moves, others = mine.moves(combine), theirs.moves(combine)
    moved, by_other = (None if of is None else combined_displacement(of, combine, groups) for of in (moves, others))
    doubt = _doubt(theirs.model, by_other, limit, "m")
    if combine == "each" and moves is not None:
        doubt = _of_all("displacement", combined_displacement(moves, "rss", groups), limit, "m") or doubt
    is_published = mine.model.name == "published"
    return judged(
        mission,
        subject=subject("mission", LOCATION),
        metric=LOCATION,
        unit="m",
        declared=moved,
        allowable=limit,
        path=("requirements", "location_error"),
        equation="(25)" if is_published else "full model",
        no_limit=phrases.no_requirement(),
        not_evaluated=NOTHING
        if moved is not None or not mine.motion
        else mine.model.plane.degeneracy or phrases.no_image_to_place(),
        is_declared=bool(mine.motion),
        info=NOTHING if limit is not None else phrases.no_requirement(),
        over=_exceeded(
            "displacement of the image",
            moved,
            limit,
            "m",
            lambda: [
                (row_id, math.hypot(*move)) for row_id, move in displacement_parts(moves or [], combine, groups)
            ],
        ),
        doubt=doubt,
        notes=correlation_notes(combine, groups) if combine != "each" else (),
    )


def _pull_in_row(analysis: Analysis, mine: Together, theirs: Together, pull_in: float) -> Row:
    phases, others = (one.owed(analysis.allocation, "mission") for one in (mine, theirs))
    total, by_other = (math.fsum(abs(phase) for _, phase in of) if of else None for of in (phases, others))
    return _judged(
        analysis.mission,
        subject=subject("mission", "autofocus_pull_in"),
        metric=QUADRATIC,
        unit="rad",
        declared=total,
        allowable=pull_in,
        path=("autofocus", "n_pull"),
        equation="Section VI",
        never_fails=True,
        over=_exceeded("QPE", total, pull_in, "rad", lambda: phases).then(phrases.one_total()),
        doubt=_doubt(theirs.model, by_other, pull_in, "rad", phrases.other_model_is_beyond),
    )


def _judged(mission: Mission, *, declared: float | None, **of_row: Any) -> Row:
    """Judge an aggregate; one without a finite value fails, since one of its errors has no image at all."""
    if declared is None or math.isfinite(declared):
        return judged(mission, declared=declared, **of_row)
    known = {key: value for key, value in of_row.items() if key not in ("qpe", "qpe_full")}
    row = judged(mission, declared=None, **known)
    if of_row.get("info"):
        return row
    return row._replace(status="fail", reason=phrases.no_ground_point())


def _doubt(
    other: Model,
    size: float | None,
    limit: float | None,
    unit: str,
    phrase: Callable[[str, float, float, str], Note] = phrases.other_model_fails,
) -> Note:
    """Say that the model that does not gate fails an aggregate; else nothing."""
    if size is None or limit is None or size <= limit * (1 + UTILIZATION_TOLERANCE) or other.is_blind:
        return NOTHING
    return phrase(other.name, size, limit, unit)


def _of_all(what: str, size: float, limit: float | None, unit: str) -> Note:
    """Say that all declared errors together exceed what each alone is held to; else nothing."""
    if limit is None or size <= limit * (1 + UTILIZATION_TOLERANCE):
        return NOTHING
    return phrases.all_together_over(what, size, limit, unit)


def _exceeded(
    what: str,
    size: float | None,
    limit: float | None,
    unit: str,
    members: Callable[[], Sequence[tuple[str, float]]],
    extrapolated: Mapping[str, Note] | None = None,
) -> Note:
    """Say how large an aggregate is, what is allowed, and which of its members is the largest; nothing if inside.

    `extrapolated` says of members what they rest on beside the file.
    """
    if size is None or limit is None or size <= limit:
        return NOTHING
    row_id, largest = max(members(), key=lambda member: abs(member[1]))
    beyond = (extrapolated or {}).get(row_id, NOTHING)
    return phrases.aggregate_over(what, size, limit, unit, row_id, largest, beyond)
