"""How a row is judged: what is declared against what is allowed, and everything that may stand between them."""

import math
from typing import Any, NamedTuple

import numpy as np

from bisar_budget import phrases
from bisar_budget.budget.judged_rows import Judged
from bisar_budget.constants import UTILIZATION_TOLERANCE
from bisar_budget.effects.subject import Subject
from bisar_budget.faults import KeyPath
from bisar_budget.findings.row import Row
from bisar_budget.findings.status import STATUS
from bisar_budget.geometry import GroundVector
from bisar_budget.mission.model import Mission
from bisar_budget.phrases import NOTHING, Note

_STATUSES = tuple(STATUS)


def judged(
    mission: Mission,
    *,
    subject: Subject,
    metric: str,
    unit: str,
    declared: float | None,  # magnitude
    allowable: float | None,  # autofocus gain included
    path: KeyPath,  # of the declared value in the mission file
    equation: str,
    gain: float = 1.0,  # of autofocus, within `allowable`
    over: Note = NOTHING,  # what to say when over the limit
    doubt: Note = NOTHING,  # what the model that does not gate says against a pass
    no_limit: Note = NOTHING,  # why there is no allowable
    not_evaluated: Note = NOTHING,  # why a declared value cannot be judged
    info: Note = NOTHING,  # why the row judges nothing
    is_declared: bool = True,  # with `declared` None: something is declared, but its effect has no value
    never_fails: bool = False,
    limits: tuple[float | None, float | None] | None = None,  # by the published and the full model; None: one rule
    qpe: float | None = None,  # by the published model
    qpe_full: float | None = None,
    displacement: GroundVector | None = None,
    evidence: str | None = None,
    is_independent: bool = True,
    notes: tuple[Note, ...] = (),
    published_margin_db: float | None = None,
) -> Row:
    """Judge one row; see `judgement`."""
    found = judgement(
        warn_above=mission.allocation.warn_above,
        declared=declared,
        allowable=allowable,
        without_autofocus=declared / allowable * gain if declared is not None and allowable is not None else 0.0,
        over=over,
        doubt=doubt,
        no_limit=no_limit,
        not_evaluated=not_evaluated,
        info=info,
        is_declared=is_declared,
        never_fails=never_fails,
    )
    allowable_published, allowable_full = limits or (allowable, None)
    return Row(
        subject=subject,
        metric=metric,
        unit=unit,
        declared=declared,
        allowable=allowable,
        allowable_published=allowable_published,
        allowable_full=allowable_full,
        qpe_published_rad=qpe,
        qpe_full_rad=qpe_full,
        displacement_m=displacement,
        utilization=found.utilization,
        margin=found.margin,
        status=found.status,
        line=mission.line(path),
        reason=found.reason or None,
        remarks=(*notes, *found.remarks),
        equation=equation,
        requirement_id=mission.requirement_ids.get(subject.id),
        evidence=evidence,
        is_independent=is_independent,
        published_margin_db=published_margin_db,
    )


def worded(
    mission: Mission,
    row: Judged,
    *,
    unit: str,
    path: KeyPath,  # of the declared value in the mission file
    equation: str,
    over: Note = NOTHING,  # what to say where it fails
    doubt: Note = NOTHING,  # what makes a pass a warning
    no_limit: Note = NOTHING,  # why there is no allowable
    not_evaluated: Note = NOTHING,  # why a declared value cannot be judged
    info: Note = NOTHING,  # why the row judges nothing
    without_autofocus: float = 0.0,  # utilization without its gain
    limits: tuple[float | None, float | None] = (None, None),  # by the published and the full model
    **others: Any,  # further fields of the row
) -> Row:
    """Put a row as judged, of one case, into words: they follow from its status, and decide nothing."""
    status = _STATUSES[row.status[0]]
    declared, allowable, utilization = (number(one) for one in (row.declared, row.allowable, row.utilization))
    reason, remarks = no_limit if allowable is None else NOTHING, tuple[Note, ...](others.pop("remarks", ()))
    if status == "info":
        reason = reason or info
    elif status == "not_evaluated":
        reason = not_evaluated
    elif status == "fail":
        reason = over
    elif status == "warn":
        reason = doubt or phrases.above_warn_above(mission.allocation.warn_above)
    elif status == "pass_with_autofocus":
        reason = phrases.over_the_limit_without_autofocus(without_autofocus)
        if utilization is not None and utilization > mission.allocation.warn_above:
            remarks = (*remarks, phrases.near_the_limit_with_autofocus(utilization))
    fields: dict[str, Any] = {
        "allowable": allowable,
        "cubic_rad": number(row.cubic_rad),
        "allowable_published": limits[0],
        "allowable_full": limits[1],
        "utilization": utilization,
        "margin": number(row.margin),
        "line": mission.line(path),
        "reason": reason or None,
        "remarks": remarks,
        "equation": equation,
        "requirement_id": mission.requirement_ids.get(row.subject.id),
    }
    return Row.without_numbers(row.subject, row.metric, unit, status, declared=declared, **(fields | others))


def number(column: Any) -> float | None:
    """The number of the only case; None where there is none."""
    value = float(np.ravel(column)[0])
    return None if math.isnan(value) else value


class Judgement(NamedTuple):
    """How a row stands; `reason` is empty where there is nothing to say."""

    utilization: float | None
    margin: float | None
    status: str
    reason: Note
    remarks: tuple[Note, ...] = ()


def judgement(
    *,
    warn_above: float,
    declared: float | None,
    allowable: float | None,
    without_autofocus: float = 0.0,
    over: Note = NOTHING,
    doubt: Note = NOTHING,
    no_limit: Note = NOTHING,
    not_evaluated: Note = NOTHING,
    info: Note = NOTHING,
    is_declared: bool = True,
    never_fails: bool = False,
) -> Judgement:
    """Judge what is declared against what is allowed.

    `without_autofocus` is the utilization that there would be without its gain; the other parameters are those of
    `judged`.

    The status is the first that applies, in the order of the contract; waivers come after.
    """
    utilization = margin = None
    reason, remarks = no_limit if allowable is None else NOTHING, tuple[Note, ...]()
    if declared is not None:
        utilization = 0.0 if allowable is None else declared / allowable
        margin = None if allowable is None else _margin(allowable, declared)
    if declared is None and not (is_declared and not_evaluated):
        status = "not_declared"
    elif info:
        status, reason = "info", reason or info
    elif not_evaluated or utilization is None:
        status, reason = "not_evaluated", not_evaluated
    elif utilization > 1 + UTILIZATION_TOLERANCE:
        status, reason = ("warn" if never_fails else "fail"), over
    elif doubt:
        status, reason = "warn", doubt
    elif without_autofocus > 1 + UTILIZATION_TOLERANCE:
        status, reason = "pass_with_autofocus", phrases.over_the_limit_without_autofocus(without_autofocus)
        if utilization > warn_above:
            remarks = (phrases.near_the_limit_with_autofocus(utilization),)
    elif utilization > warn_above:
        status, reason = "warn", phrases.above_warn_above(warn_above)
    else:
        status = "pass"
    return Judgement(utilization, margin, status, reason, remarks)


def _margin(allowable: float, declared: float) -> float | None:
    """Allowable over declared less one; None where that is not finite."""
    headroom = allowable / declared if declared else math.inf
    return headroom - 1 if math.isfinite(headroom) else None
