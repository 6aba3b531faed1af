"""Waivers: rows that may fail until a date. What is waived, expired or useless is always said."""

import re
from collections.abc import Callable, Sequence
from datetime import date
from fnmatch import translate

from bisar_budget.findings.mission import FileWarning
from bisar_budget.findings.row import AppliedWaiver, Row
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
        Failing rows with a valid waiver are `waived`; one with expired waivers keeps its status and has the last of
        them.
    warnings : list of FileWarning
        Waivers that name no row, or none that fails.
    """
    result = list(rows)
    warnings = []
    expired: dict[int, AppliedWaiver] = {}  # of each row the one that held longest: a thousand would fill a report
    for index, waiver in enumerate(mission.waivers):
        line = mission.line(("waivers", index, "id"))
        is_named = _matcher(waiver.id)
        named = [position for position, row in enumerate(rows) if is_named(row.id)]
        failing = [position for position in named if rows[position].status == "fail"]
        applied = AppliedWaiver(line, waiver.until, waiver.reason, is_expired=today > waiver.until)
        for position in failing:
            row = result[position]
            if applied.is_expired:
                expired[position] = max(applied, expired.get(position, applied), key=lambda one: one.until)
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
    for position, last in expired.items():
        row = result[position]
        result[position] = row._replace(waivers=(*row.waivers, last))
    return result, warnings


def _matcher(pattern: str) -> Callable[[str], object]:
    """Tell which ids a waiver names; an id may hold a bracket of its own."""
    if not any(char in pattern for char in "*?["):
        return pattern.__eq__
    glob = re.compile(translate(pattern)).match
    return lambda row_id: row_id == pattern or glob(row_id)
