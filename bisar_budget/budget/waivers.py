"""Waivers: rows that may fail until a date. What is waived, expired or useless is always said."""

import re
from collections.abc import Sequence
from datetime import date
from fnmatch import translate

from bisar_budget import file_warnings
from bisar_budget.findings.mission import FileWarning
from bisar_budget.findings.row import DECLARE, AppliedWaiver, Row
from bisar_budget.mission.model import Mission


def apply_waivers(rows: Sequence[Row], mission: Mission, today: date) -> tuple[list[Row], list[FileWarning]]:
    """Waive failing rows that a valid waiver names, and what must be declared and is not.

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
    ids = [row.id for row in rows]
    missing = [n for n, row in enumerate(rows) if row.is_of_declare and row.status == "not_evaluated"]
    broken = {position for position, row in enumerate(rows) if row.status == "fail"}.union(missing)
    warnings = []
    # A thousand waivers of one row would fill a report: it has the first that holds and the one that held longest.
    holding: dict[int, AppliedWaiver] = {}
    over: list[tuple[AppliedWaiver, set[int]]] = []
    for index, waiver in enumerate(mission.waivers):
        line = mission.line(("waivers", index, "id"))
        named = named_by(waiver.id, ids)
        if any(rows[position].metric == DECLARE for position in named):  # it stands for all that is missing
            named = sorted({*named, *missing})
        failing = broken.intersection(named)
        applied = AppliedWaiver(line, waiver.until, waiver.reason, is_expired=today > waiver.until)
        if applied.is_expired:
            over.append((applied, failing))
        else:
            holding = dict.fromkeys(failing, applied) | holding
        if not named:
            warnings.append(FileWarning(line=line, message=file_warnings.waiver_matches_nothing(waiver.id)))
        elif len(named) == len(rows):
            warnings.append(FileWarning(line=line, message=file_warnings.waiver_matches_everything(waiver.id)))
        elif not failing:
            warnings.append(FileWarning(line=line, message=file_warnings.waiver_not_used(waiver.id)))
    last: dict[int, AppliedWaiver] = {}
    for applied, failing in sorted(over, key=lambda one: one[0].until):
        last |= dict.fromkeys(failing, applied)
    return [_waived(row, holding.get(position), last.get(position)) for position, row in enumerate(rows)], warnings


def _waived(row: Row, holding: AppliedWaiver | None, last: AppliedWaiver | None) -> Row:
    applied = [one for one in (holding, last) if one is not None]
    status = row.status if holding is None else "waived"
    return row._replace(status=status, waivers=(*row.waivers, *applied)) if applied else row


def is_waived(mission: Mission, today: date, ids: Sequence[str]) -> bool:
    """Whether a waiver that holds names one of some ids."""
    return any(today <= one.until and named_by(one.id, ids) for one in mission.waivers)


def named_by(pattern: str, ids: Sequence[str]) -> list[int]:
    """Places of the ids that a waiver names; an id may hold a bracket of its own."""
    if not any(char in pattern for char in "*?["):
        return [place for place, row_id in enumerate(ids) if row_id == pattern]
    matches = map(re.compile(translate(pattern)).match, ids)
    return [place for place, match in enumerate(matches) if match or ids[place] == pattern]
