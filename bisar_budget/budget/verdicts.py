"""What follows from images for the rows of a check, and which of the images are worth showing."""

from bisar_budget import file_warnings, phrases
from bisar_budget.constants import UTILIZATION_TOLERANCE
from bisar_budget.findings.images import Verdict, VerifiedMission
from bisar_budget.findings.mission import FileWarning, MissionFindings
from bisar_budget.findings.row import Row
from bisar_budget.findings.status import RANK
from bisar_budget.units import format_limit

_SHOWN = 4  # rows of a mission


def with_verdicts(findings: MissionFindings, verified: VerifiedMission) -> MissionFindings:
    """Add verdicts to findings: a limit that the image shows to be optimistic is said at its row.

    A row that passes a limit it would fail as measured becomes a warning, and so does one that passes by an autofocus
    that the image refutes: the model that gates says pass, but a gate must not be silent about what it knows. That no
    image gave a verdict is a warning too.
    """
    rows = verified.rows
    by_id = {verdict.id: verdict for verdict in rows}
    judged = tuple(_with_verdict(row, by_id[row.id]) if row.id in by_id else row for row in findings.rows)
    known = {row.id for row in findings.rows}
    warnings = tuple(
        FileWarning(line=None, message=file_warnings.limit_is_optimistic(verdict.id, _shown(verdict)))
        for verdict in rows
        if verdict.id not in known and verdict.verdict == "optimistic"
    )
    if verified.doubt:
        warnings = (FileWarning(line=None, message=verified.doubt), *warnings)
    images = (phrases.images_formed(verified.conditions),) if verified.conditions else ()
    return findings._replace(
        rows=judged,
        warnings=(*findings.warnings, *warnings),
        notes=(*findings.notes, *images),
        verdicts=rows,
        is_unverified=bool(verified.doubt),
    )


def _with_verdict(row: Row, verdict: Verdict) -> Row:
    refuted = row.refuted
    if verdict.verdict == "optimistic":
        refuted = (*refuted, phrases.optimistic_limit(_shown(verdict)))
    if verdict.verdict_autofocus == "optimistic":
        refuted = (*refuted, phrases.optimistic_limit_with_autofocus(str(verdict.reason_autofocus)))
        if row.status == "pass_with_autofocus":
            return row._replace(status="warn", reason=phrases.autofocus_refuted(), refuted=refuted)
    if row.metric == "location_error" and row.status == "pass" and verdict.verdict == "optimistic":
        return row._replace(status="warn", reason=phrases.location_refuted(), refuted=refuted)
    excess = _excess(verdict)
    if (
        row.status in ("pass", "pass_with_autofocus")
        and (row.utilization or 0.0) * excess > 1 + UTILIZATION_TOLERANCE
    ):
        reason = phrases.limit_refuted((row.utilization or 0.0) * excess)
        return row._replace(status="warn", reason=reason, refuted=refuted)
    return row._replace(refuted=refuted)


def _excess(verdict: Verdict) -> float:
    """What the image shows at the limit, over what the limit promises; 1 where it promises no less."""
    if verdict.verdict != "optimistic":
        return 1.0
    if verdict.measured_db is not None and verdict.requirement_db is not None:
        return 10 ** ((verdict.measured_db - verdict.requirement_db) / 20)
    measured = verdict.measured_cubic_rad if verdict.measured_cubic_rad is not None else verdict.measured_qpe_rad
    return measured / verdict.budget_rad if measured is not None and verdict.budget_rad else 1.0


def _shown(verdict: Verdict) -> str:
    if verdict.measured_db is not None:
        return f"the image shows {verdict.measured_db:.1f} dB at it"
    if verdict.measured_qpe_rad is not None and verdict.budget_rad is not None:
        budget = format_limit(verdict.budget_rad, "rad")
        return f"the image shows {verdict.measured_qpe_rad:.3g} rad at it, the budget is {budget}"
    return verdict.reason or "the image shows more than it promises"


def rows_worth_showing(findings: MissionFindings, count: int = _SHOWN) -> tuple[Verdict, ...]:
    """Verdicts with a measured quadratic phase whose rows decide most: worst status, limits that images refute.

    A row that nobody declared is shown only if its limit is refuted, or if there is nothing else.
    """
    rows = {row.id: row for row in findings.rows}
    known = [v for v in findings.verdicts or () if v.measured_qpe_rad is not None and v.id in rows]
    ordered = sorted(known, key=lambda verdict: _urgency(rows[verdict.id], verdict))
    wanted = [v for v in ordered if rows[v.id].status != "not_declared" or _is_refuted(v)]
    return tuple((wanted or ordered[:1])[:count])


def _urgency(row: Row, verdict: Verdict) -> tuple[int, bool, bool, float]:
    # Shown again along the scene's axes, an error has the same image as in its own frame.
    return (RANK[row.status], not _is_refuted(verdict), not row.is_independent, -(row.utilization or 0.0))


def _is_refuted(verdict: Verdict) -> bool:
    return "optimistic" in (verdict.verdict, verdict.verdict_autofocus)
