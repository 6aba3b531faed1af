"""Rows as judged, of a single case, in words."""

import math
from typing import Any

import numpy as np

from bisar_budget import phrases
from bisar_budget.budget.judged_rows import Judged
from bisar_budget.faults import KeyPath
from bisar_budget.findings.row import Row
from bisar_budget.findings.status import STATUS
from bisar_budget.mission.model import Mission
from bisar_budget.phrases import NOTHING, Note

_STATUSES = tuple(STATUS)


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
        "allowable_published": number(row.allowable_published),
        "allowable_full": number(row.allowable_full),
        "qpe_published_rad": number(row.qpe_published_rad),
        "qpe_full_rad": number(row.qpe_full_rad),
        "qpe_exact_rad": number(row.qpe_exact_rad),
        "cubic_rad": number(row.cubic_rad),
        "islr_db": number(row.islr_db),
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
    value = column.item() if isinstance(column, np.ndarray) else float(column)
    return None if math.isnan(value) else value
