"""Waivers: rows and requirements that may be broken until a date. What is waived, expired or useless is said."""

import re
from collections.abc import Mapping, Sequence
from datetime import date
from fnmatch import translate
from typing import NamedTuple

from bisar_budget import file_warnings
from bisar_budget.budget.judged_requirements import KEYS
from bisar_budget.findings.mission import FileWarning
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.findings.row import DECLARE, AppliedWaiver, Row
from bisar_budget.mission.model import Mission

_BROKEN = ("fail", "not_evaluated")  # statuses that a waiver covers


class Waived(NamedTuple):
    """Rows after waivers, and the waivers that name requirements.

    Rows that fail or are not evaluated, and that a valid waiver names, are `waived`; one with expired waivers keeps
    its status and has the last of them. `requirements` has the first valid waiver of each requirement, by its id.
    """

    mission: Mission
    rows: list[Row]
    requirements: Mapping[str, tuple[AppliedWaiver, ...]]
    covered: Sequence[tuple[int, int]]  # rows that it names, and those of them that are broken

    def unused(self, judged: Sequence[JudgedRequirement]) -> list[FileWarning]:
        """Warn of waivers that name nothing, everything, or nothing that is broken."""
        broken = {one.id for one in judged if one.status in (*_BROKEN, "waived")}
        ids = [one.id for one in judged]
        warnings = []
        for index, (waiver, (named, failing)) in enumerate(zip(self.mission.waivers, self.covered, strict=True)):
            line = self.mission.line(("waivers", index, "id"))
            requirements = [ids[place] for place in named_by(waiver.id, ids)]
            if not named and not requirements:
                warnings.append(FileWarning(line=line, message=file_warnings.waiver_matches_nothing(waiver.id)))
            elif named == len(self.rows):
                warnings.append(FileWarning(line=line, message=file_warnings.waiver_matches_everything(waiver.id)))
            elif not failing and broken.isdisjoint(requirements):
                warnings.append(FileWarning(line=line, message=file_warnings.waiver_not_used(waiver.id)))
        return warnings


def apply_waivers(rows: Sequence[Row], mission: Mission, today: date) -> Waived:
    """Waive rows that fail or are not evaluated and that a valid waiver names.

    Parameters
    ----------
    rows : sequence of Row
        Judged rows.
    mission : Mission
        Holds the waivers.
    today : date
        UTC; a waiver holds through its last day.
    """
    ids = [row.id for row in rows]
    broken = {position for position, row in enumerate(rows) if row.status in _BROKEN}
    requirements = [f"mission.{key}" for key in KEYS]
    missing = [n for n, row in enumerate(rows) if row.is_of_declare and row.status == "not_evaluated"]
    # A thousand waivers of one row would fill a report: it has the first that holds and the one that held longest.
    holding: dict[int, AppliedWaiver] = {}
    of_requirements: dict[str, tuple[AppliedWaiver, ...]] = {}
    over: list[tuple[AppliedWaiver, set[int]]] = []
    covered = []
    for index, waiver in enumerate(mission.waivers):
        line = mission.line(("waivers", index, "id"))
        named = named_by(waiver.id, ids)
        if any(rows[position].metric == DECLARE for position in named):  # it stands for all that is missing
            named = sorted({*named, *missing})
        failing = broken.intersection(named)
        covered.append((len(named), len(failing)))
        applied = AppliedWaiver(line, waiver.until, waiver.reason, is_expired=today > waiver.until)
        if applied.is_expired:
            over.append((applied, failing))
            continue
        holding = dict.fromkeys(failing, applied) | holding
        for place in named_by(waiver.id, requirements):
            of_requirements.setdefault(requirements[place], (applied,))
    last: dict[int, AppliedWaiver] = {}
    for applied, failing in sorted(over, key=lambda one: one[0].until):
        last |= dict.fromkeys(failing, applied)
    waived = [_waived(row, holding.get(position), last.get(position)) for position, row in enumerate(rows)]
    return Waived(mission, waived, of_requirements, covered)


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
