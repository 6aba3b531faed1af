"""The mission of a file with other values, and the row that decides how it stands."""

from collections.abc import Container, Mapping, Sequence
from typing import NamedTuple

from bisar_budget.design.quantities import Number, QuestionError
from bisar_budget.faults import SetValue
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.row import Row, unknown_id
from bisar_budget.findings.status import STATUS
from bisar_budget.mission.changes import parts_of
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.model import Mission
from bisar_budget.mission.named import Named

ALIKE = 1e-9  # of a utilization: a common error along x and along y may bind alike, but for rounding


class Variation:
    """A mission whose file is read anew with other values: each is held to everything that a file is.

    Parameters
    ----------
    mission : Mission
        As loaded, with the options that changed it; they stay.
    model : str, optional
        Gating model in place of the mission's own.
    named : Named, optional
        What the mission names, where its files are not there.
    """

    def __init__(self, mission: Mission, model: str | None, named: Named | None = None) -> None:
        self.mission, self.model = mission, model
        self.parse = parse_mission if named is None else named.parse

    def read(self, changes: Sequence[SetValue] = ()) -> Mission:
        """Read the mission with values in place of its own.

        Raises
        ------
        MissionError
            With them there is no mission.
        """
        anew = {parts_of(change.key) for change in changes}
        given = [change for change in self.mission.changes if parts_of(change.key) not in anew]
        return self.parse(self.mission.data, self.mission.file, self.model, changes=(*given, *changes))

    def at(self, values: Mapping[Number, float], changes: Sequence[SetValue] = ()) -> Mission:
        """Read the mission with other numbers, in SI, after other changes; raises `MissionError`."""
        numbers = [SetValue(one.key, f"{value!r} {one.dimension.si}".rstrip()) for one, value in values.items()]
        return self.read([*changes, *numbers])


class Standing(NamedTuple):
    """How a mission stands: whether it complies, its status, and the row that binds; see `State` of `solution`."""

    complies: bool
    status: str
    row: str | None = None
    requirement: str | None = None
    utilization: float | None = None


def breaking(target: str) -> frozenset[str]:
    """Statuses that do not comply: what `check` breaks on (fail), or what `check --strict` does (warn)."""
    return frozenset(name for name, one in STATUS.items() if (one.fails if target == "fail" else one.fails_strict))


def standing(found: MissionFindings, row_id: str | None, breaks: Container[str]) -> Standing:
    """Say how a mission stands, or the row that was asked for."""
    rows = [row for row in found.rows if row_id is None or row.id == row_id]
    status = found.status if row_id is None else rows[0].status if rows else "not_evaluated"
    complies = status not in breaks
    worst = deciding_row(rows, breaks, complies)
    if worst is None:
        broken = [one.key for one in found.requirements if one.status == status and row_id is None and not complies]
        return Standing(complies, status, requirement=broken[0] if broken else None)
    return Standing(complies, status, worst.id, worst.binding_requirement or worst.metric, worst.utilization)


def deciding_row(rows: Sequence[Row], breaks: Container[str], complies: bool) -> Row | None:
    """Find the row that binds: of the rows that are judged the one that uses most of its limit.

    Of rows that use as much of it, but for rounding, the first. One that is not evaluated and has no number binds
    nothing.

    Parameters
    ----------
    rows : sequence of Row
        Of a mission, or the one that is asked for.
    breaks : container of str
        Statuses that do not comply.
    complies : bool
        Whether the rows do; where they do not, only those that break are looked at.
    """
    judged = [row for row in rows if STATUS[row.status].is_judged and row.status != "waived"]
    judged = [row for row in judged if row.status != "not_evaluated" or row.utilization is not None]
    if "warn" not in breaks:  # what only ever warns decides nothing
        judged = [row for row in judged if row.subject.kind != "autofocus_pull_in"]
    if not complies:
        judged = [row for row in judged if row.status in breaks]
    uses = [-1.0 if row.utilization is None else row.utilization for row in judged]
    highest = max(uses, default=0.0)
    return next((row for row, use in zip(judged, uses, strict=True) if use >= highest - ALIKE * abs(highest)), None)


def hold_to_decisions(findings: Sequence[MissionFindings], row_id: str | None) -> None:
    """Refuse what nothing can decide.

    Raises
    ------
    QuestionError
        None of the findings has a declared error, or the row that is asked for is not there or not judged.
    """
    if all(found.is_empty for found in findings):
        raise QuestionError("the mission declares no error: nothing decides whether it complies")
    if row_id is None:
        return
    rows = [row for found in findings for row in found.rows]
    statuses = [STATUS[row.status] for row in rows if row.id == row_id]
    if not statuses:
        raise QuestionError(f"--row {row_id}: {unknown_id(row_id, (row.id for row in rows), findings[0].file)}")
    if not any(status.gates for status in statuses):
        raise QuestionError(f"--row {row_id}: is {statuses[0].words}: nothing is judged there")
