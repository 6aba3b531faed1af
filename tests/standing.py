"""How a mission stands by the findings of its check, row by row: what the case table says of many has to be this."""

from collections.abc import Container

from bisar_budget.budget.judged_requirements import EQUAL_USE_FRACTION
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.row import Row
from bisar_budget.findings.solution import Standing
from bisar_budget.findings.status import STATUS


def standing(found: MissionFindings, row_id: str | None, breaks: Container[str]) -> Standing:
    """Say whether a mission, or a row that is asked for, complies, and which row binds."""
    rows = [row for row in found.rows if row_id is None or row.id == row_id]
    status = found.status if row_id is None else rows[0].status if rows else "not_evaluated"
    complies = status not in breaks
    deciding = [row for row in rows if _decides(row, breaks) and (complies or row.status in breaks)]
    deciding = [row for row in deciding if row.status != "waived" or status == "waived"]
    waivers = (found if row_id is None else rows[0]).waived_by if rows and status == "waived" else ()
    waived_by = tuple(waiver.id for waiver in waivers)
    if not deciding:
        broken = [one.key for one in found.requirements if one.status == status and row_id is None and not complies]
        return Standing(complies, status, requirement=broken[0] if broken else None, waived_by=waived_by)
    highest = max(map(_use, deciding))
    worst = next(
        row for row in deciding if _use(row) >= highest - EQUAL_USE_FRACTION * abs(highest) or _use(row) == highest
    )
    is_unknown = (status == "not_evaluated" and not complies) or _use(worst) < 0
    use = None if is_unknown else worst.utilization  # it need not be that of what decides
    return Standing(complies, status, worst.id, worst.binding_requirement or worst.metric, use, waived_by)


def _decides(row: Row, breaks: Container[str]) -> bool:
    """Whether a row is judged by a number; what only ever warns decides nothing, unless a warning does."""
    has_say = row.utilization is not None or row.status != "not_evaluated"
    return STATUS[row.status].is_judged and has_say and ("warn" in breaks or row.subject.kind != "autofocus_pull_in")


def _use(row: Row) -> float:
    is_unknown = row.utilization is None or (row.status == "waived" and row.is_unjudged)
    return -1.0 if is_unknown else row.utilization
