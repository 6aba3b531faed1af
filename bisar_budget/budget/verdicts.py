"""Addition of verdicts from simulated images to the rows of a check, and selection of the verdicts to show."""

from collections.abc import Mapping, Sequence
from datetime import date

from bisar_budget import phrases
from bisar_budget.budget.waivers import apply_waivers
from bisar_budget.findings.images import Verdict, VerifiedMission
from bisar_budget.findings.mission import FileWarning, MissionFindings
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.findings.row import AppliedWaiver, Row, holding, in_order
from bisar_budget.findings.status import RANK
from bisar_budget.phrases import NOTHING
from bisar_budget.units import format_limit

_SHOWN_ROWS = 4  # largest number of rows shown for a mission


def with_verdicts(findings: MissionFindings, verified: VerifiedMission, today: date | None = None) -> MissionFindings:
    """Add the verdicts from simulated images to the findings of a check.

    If an image refutes the limit of a row whose error is declared, the row fails, and so does its requirement. A row
    that passes only with autofocus also fails if an image shows that autofocus does not work. If the error of a row
    is not declared, the row only reports that its limit is refuted. A warning is given if an image refutes a limit
    for which the check has no row, or if no image gave a verdict.

    Parameters
    ----------
    findings : MissionFindings
        Findings of the check.
    verified : VerifiedMission
        Verdicts from the simulated images of the mission.
    today : date, optional
        Day (UTC) on which waivers are judged for rows that fail because of an image. If omitted, waivers do not
        apply.
    """
    verdicts = verified.rows
    by_id = {verdict.id: verdict for verdict in verdicts}
    rows = [_with_verdict(row, by_id[row.id]) if row.id in by_id else row for row in findings.rows]
    changed_indices = [
        index
        for index, (before, row) in enumerate(zip(findings.rows, rows, strict=True))
        if row.status != before.status
    ]
    used: set[str] = set()
    requirement_waivers: Mapping[str, tuple[AppliedWaiver, ...]] = {}
    if today is not None and findings.mission is not None:
        waived = apply_waivers([rows[index] for index in changed_indices], findings.mission, today)
        requirement_waivers = waived.requirements
        for index, row in zip(changed_indices, waived.rows, strict=True):
            rows[index] = row
        used = {
            waiver.id
            for waiver, (_, covered) in zip(findings.mission.waivers, waived.covered, strict=True)
            if covered
        }
    requirements = tuple(
        _with_refuted(entry, [rows[index] for index in changed_indices], requirement_waivers.get(entry.id, ()))
        for entry in findings.requirements
    )
    row_ids = {row.id for row in findings.rows}
    warnings = [
        entry
        for entry in findings.warnings
        if entry.message.code != "waiver-not-used" or entry.message.values[0] not in used
    ]
    if verified.doubt:
        warnings.append(FileWarning(line=None, message=verified.doubt))
    warnings += [
        FileWarning(line=None, message=phrases.note("limit-is-optimistic", row_id=verdict.id, shown=_shown(verdict)))
        for verdict in verdicts
        if verdict.id not in row_ids and verdict.verdict == "optimistic"
    ]
    images = (phrases.note("images-formed", conditions=verified.conditions),) if verified.conditions else ()
    return findings._replace(
        rows=tuple(rows),
        requirements=requirements,
        warnings=tuple(warnings),
        notes=(*findings.notes, *images),
        verdicts=verdicts,
        is_unverified=bool(verified.doubt),
    )


def _with_verdict(row: Row, verdict: Verdict) -> Row:
    remarks = []
    reason = NOTHING
    if verdict.verdict_autofocus == "optimistic":
        if row.status == "pass_with_autofocus":
            reason = phrases.note("autofocus-refuted", shown=str(verdict.reason_autofocus))
        else:
            remarks.append(phrases.note("optimistic-limit-with-autofocus", shown=str(verdict.reason_autofocus)))
    if verdict.verdict == "optimistic":
        if not reason and _is_gate(row):
            reason = phrases.note(
                "limit-refuted", limit=format_limit(verdict.boundary_error, verdict.unit), shown=_shown(verdict)
            )
        else:
            remarks.insert(0, phrases.note("optimistic-limit", shown=_shown(verdict)))
    refuted = (*row.refuted, *remarks)
    if not reason:
        return row._replace(refuted=refuted)
    return row._replace(status="fail", reason=reason, refuted=refuted)._replace(is_unjudged=False)


def _is_gate(row: Row) -> bool:
    """Whether a row must fail if an image refutes its limit.

    This is so for each row that has a declared error and does not fail already, with two exceptions. The first is a
    row that only converts an error from another frame to the scene's axes. The second is the row of the pull-in range
    of autofocus, because this range is not a requirement: if it is stated too large, the gain is used only up to the
    limit that range walk sets.
    """
    return (
        bool(row.utilization)
        and row.status not in ("fail", "waived", "not_declared")
        and not row.subject.facts.only_warns
        and row.is_independent
    )


def _with_refuted(
    requirement: JudgedRequirement, refuted: Sequence[Row], waivers: tuple[AppliedWaiver, ...]
) -> JudgedRequirement:
    """Return the requirement with the status of its worst refuted row, if that status is worse than the present one.

    A row is refuted if an image contradicts its limit. Two kinds of refuted rows are considered: rows that determine
    the verdict on the requirement, and rows whose limit follows from the requirement.
    """
    judges = [
        row
        for row in refuted
        if row.id in requirement.rows or requirement.key in (row.binding_requirement, row.metric)
    ]
    if not judges or RANK[requirement.status] <= RANK["fail"]:
        return requirement
    row = min(judges, key=lambda judge: RANK[judge.status])
    status = "waived" if waivers and row.status == "fail" else row.status
    if RANK[status] > RANK[requirement.status]:
        return requirement
    covering = in_order([*requirement.waivers, *waivers, *row.waived_by])
    refuted_requirement = requirement._replace(
        status=status, row=row.id, reason=row.reason, waivers=holding(status, covering), is_unjudged=False
    )
    if row.id == requirement.row:
        return refuted_requirement
    # The numbers of the row are not those of the requirement, but the row's limit is the one that the image refutes.
    return refuted_requirement._replace(utilization=row.utilization, use_row=row.id, share=None)


def _shown(verdict: Verdict) -> str:
    if verdict.measured_db is not None and verdict.requirement_db is not None:
        digits = 1 if verdict.measured_db_interval is None else 2  # half a decibel decides a verdict on noise
        levels = [f"{level:.{digits}f} dB" for level in (verdict.measured_db, verdict.requirement_db)]
        return f"the image shows {levels[0]} at it, {levels[1]} allowed"
    _, measured = verdict.judged_phases_rad
    if measured is not None and verdict.budget_rad is not None:
        phase, budget = f"{measured:.3g} rad{verdict.of_equal_loss}", format_limit(verdict.budget_rad, "rad")
        return f"the image shows {phase} at it, the budget is {budget}"
    return verdict.reason or "the image shows more than it promises"


def rows_worth_showing(findings: MissionFindings) -> tuple[Verdict, ...]:
    """Select the most important verdicts with a measured quadratic phase.

    The verdicts on the rows with the worst status come first. Among rows with the same status, rows with refuted
    limits come first. A row without a declared error is selected only if its limit is refuted, or if there is no
    other row.
    """
    rows = {row.id: row for row in findings.rows}
    measured = [v for v in findings.verdicts or () if v.measured_qpe_rad is not None and v.id in rows]
    ordered = sorted(measured, key=lambda verdict: _urgency(rows[verdict.id], verdict))
    decisive = [v for v in ordered if rows[v.id].status != "not_declared" or _is_refuted(v)]
    return tuple((decisive or ordered[:1])[:_SHOWN_ROWS])


def _urgency(row: Row, verdict: Verdict) -> tuple[int, bool, bool, float]:
    # A row that repeats an error along the scene's axes has the same image as the row in the error's own frame.
    return (RANK[row.status], not _is_refuted(verdict), not row.is_independent, -(row.utilization or 0.0))


def _is_refuted(verdict: Verdict) -> bool:
    return "optimistic" in (verdict.verdict, verdict.verdict_autofocus)
