"""How a row is judged: what is declared against what is allowed, and everything that may stand between them."""

from bisar_budget.budget.findings import Row
from bisar_budget.budget.models import quotient
from bisar_budget.constants import UTILIZATION_TOLERANCE
from bisar_budget.errors import KeyPath
from bisar_budget.geometry import GroundVector
from bisar_budget.mission.model import Mission


def judged(
    mission: Mission,
    *,
    id: str,
    metric: str,
    unit: str,
    declared: float | None,  # magnitude
    allowable: float | None,  # autofocus gain included
    path: KeyPath,  # of the declared value in the mission file
    equation: str,
    gain: float = 1.0,  # of autofocus, within `allowable`
    over: str = "",  # what to say when over the limit
    doubt: str = "",  # what the model that does not gate says against a pass
    no_limit: str = "",  # why there is no allowable
    not_evaluated: str = "",  # why a declared value cannot be judged
    info: str = "",  # why the row judges nothing
    is_declared: bool = True,  # with `declared` None: something is declared, but its effect has no value
    never_fails: bool = False,
    limits: tuple[float | None, float | None] | None = None,  # by the published and the full model; None: one rule
    qpe: float | None = None,  # by the published model
    qpe_full: float | None = None,
    displacement: GroundVector | None = None,
    evidence: str | None = None,
    is_independent: bool = True,
    notes: tuple[str, ...] = (),
    published_margin_db: float | None = None,
) -> Row:
    """Judge one row; see `judgement`."""
    utilization, margin, status, reason, notes = judgement(
        mission.allocation.warn_above,
        declared,
        allowable,
        gain,
        over,
        doubt,
        no_limit,
        not_evaluated,
        info,
        is_declared,
        never_fails,
        notes,
    )
    return Row(  # in the order of its fields: keywords cost as much as the judgement
        id,
        metric,
        unit,
        declared,
        allowable,
        *(limits or (allowable, None)),
        qpe,
        qpe_full,
        displacement,
        utilization,
        margin,
        status,
        mission.line(path),
        reason or None,
        notes,
        equation,
        mission.requirement_ids.get(id),
        evidence,
        is_independent,
        None,
        published_margin_db,
    )


def judgement(
    warn_above: float,
    declared: float | None,
    allowable: float | None,
    gain: float,
    over: str,
    doubt: str,
    no_limit: str,
    not_evaluated: str,
    info: str,
    is_declared: bool,
    never_fails: bool,
    notes: tuple[str, ...],
) -> tuple[float | None, float | None, str, str, tuple[str, ...]]:
    """Judge what is declared against what is allowed: utilization, margin, status, reason and notes.

    The status is the first that applies, in the order of the contract; waivers come after.
    """
    utilization = margin = None
    reason = no_limit if allowable is None else ""
    if declared is not None:
        utilization = 0.0 if allowable is None else declared / allowable
        headroom = None if allowable is None else quotient(allowable, declared)
        margin = None if headroom is None else headroom - 1
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
    elif utilization * gain > 1 + UTILIZATION_TOLERANCE:
        status, reason = "pass_with_autofocus", f"{utilization * gain:.3g} times the limit without autofocus"
        if utilization > warn_above:
            notes = (*notes, f"uses {100 * utilization:.3g} % of the limit with autofocus")
    elif utilization > warn_above:
        status, reason = "warn", f"above {100 * warn_above:g} % of the limit"
    else:
        status = "pass"
    return utilization, margin, status, reason, notes
