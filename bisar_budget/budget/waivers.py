"""Waivers: rows that may fail until a date. What is waived, expired or useless is always said."""

from collections.abc import Sequence
from datetime import date
from fnmatch import fnmatchcase

from bisar_budget.findings.mission import FileWarning
from bisar_budget.findings.row import Row, Waiver
from bisar_budget.mission.model import Mission


def apply_waivers(rows: Sequence[Row], mission: Mission, today: date) -> tuple[list[Row], list[FileWarning]]:
    """Waive failing rows that a valid waiver names.

    Parameters
    ----------
    rows : sequence of Row
        Judged rows.
    mission : Mission
        Holds the waivers.
    today : date
        UTC; a waiver holds through its last day.

    Returns
    -------
    rows : list of Row
        Failing rows with a valid waiver are `waived`; one with an expired waiver keeps its status.
    warnings : list of FileWarning
        Waivers that name no row, or none that fails.
    """
    result = list(rows)
    warnings = []
    for index, waiver in enumerate(mission.waivers):
        line = mission.line(("waivers", index, "id"))
        named = [position for position, row in enumerate(rows) if _names(waiver.id, row.id)]
        failing = [position for position in named if rows[position].status == "fail"]
        applied = Waiver(line, waiver.until, waiver.reason, is_expired=today > waiver.until)
        for position in failing:
            row = result[position]
            if applied.is_expired:
                result[position] = row._replace(waivers=(*row.waivers, applied))
            elif row.status == "fail":
                result[position] = row._replace(status="waived", waivers=(*row.waivers, applied))
        if not named:
            warnings.append(FileWarning(line=line, message=f"waiver {waiver.id}: matches no row"))
        elif len(named) == len(rows):
            warnings.append(
                FileWarning(line=line, message=f"waiver {waiver.id}: names every row and would hide any new failure")
            )
        elif not failing:
            warnings.append(
                FileWarning(line=line, message=f"waiver {waiver.id}: not used: no row that it names fails")
            )
    return result, warnings


def _names(pattern: str, row_id: str) -> bool:
    return pattern == row_id or fnmatchcase(row_id, pattern)  # an id may hold a bracket of its own
