"""Effects of a change on missions: how much of each limit it erodes, what it loosens, what a gate refuses of it."""

from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase
from typing import NamedTuple

from bisar_budget.constants import UTILIZATION_TOLERANCE
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.row import Row
from bisar_budget.findings.status import STATUS
from bisar_budget.report.change.inputs import Moved, moved_geometry, moved_inputs
from bisar_budget.report.change.loosened import Loosened, loosenings
from bisar_budget.report.words.sentences import percent

SMALL = 0.01  # a row that moves by less than this part tells a reader nothing


class Change(NamedTuple):
    """One row before and after; None where the mission has no such row."""

    id: str
    before: Row | None
    after: Row | None

    @property
    def use(self) -> tuple[float, float]:
        """Part of the limit that is used before and after; what is not declared uses nothing."""
        before, after = (row.utilization or 0.0 if row else 0.0 for row in (self.before, self.after))
        return before, after

    @property
    def erosion(self) -> float:
        """Part of what was left of the limit that the change uses up, (u₂ − u₁)/(1 − u₁); negative is a gain.

        1 uses up everything. For a row that had nothing left, the relative growth of its use, u₂/u₁ − 1.
        """
        before, after = self.use
        if before == after:
            return 0.0
        left = 1 - before
        return (after - before) / left if left > UTILIZATION_TOLERANCE else after / before - 1

    @property
    def is_newly_failing(self) -> bool:
        """Whether it fails, or is not evaluated, now and was not."""
        return _is_newly_broken(_status(self.before), _status(self.after))

    @property
    def words(self) -> str:
        """The effect on the limit in words, for a gate that refuses it."""
        if self.is_newly_failing:
            return _worse(_status(self.after))
        before, after = self.use
        if 1 - before <= UTILIZATION_TOLERANCE:
            return f"had used up its limit and uses more: {percent(before)} -> {percent(after)}"
        return f"uses up {percent(self.erosion)} of what was left of its limit"

    @property
    def is_change(self) -> bool:
        """Whether anything that is reported differs; that it moved to another line does not count."""
        return _reported(self.before) != _reported(self.after)

    @property
    def is_small(self) -> bool:
        """Whether status and requirement stay, and declared, allowable and what is left move by less than 1 %."""
        before, after = self.before, self.after
        if before is None or after is None or before.status != after.status or abs(self.erosion) >= SMALL:
            return False
        return _is_near(before.declared, after.declared) and _is_near(before.allowable, after.allowable)

    def breaks(self, tolerated: float) -> bool:
        """Whether it newly fails, or a row that is judged loses more than the tolerated part of what was left.

        So does one that a waiver keeps from failing, before as after: it was granted for the row as it stood.
        """
        is_judged = self.after is not None and STATUS[self.after.status].is_held
        is_judged = is_judged or _status(self.before) == _status(self.after) == "waived"
        return self.is_newly_failing or (is_judged and self.erosion > tolerated + UTILIZATION_TOLERANCE)


class RequirementMove(NamedTuple):
    """How a requirement stood and stands: its statuses; None where the mission has no such requirement."""

    key: str
    name: str
    before: str | None
    after: str | None

    @property
    def id(self) -> str:
        """Its name in waivers and reports."""
        return f"mission.{self.key}"

    @property
    def is_newly_failing(self) -> bool:
        """Whether it is not met, or not evaluated, now and was not."""
        return _is_newly_broken(self.before, self.after)


class Refusal(NamedTuple):
    """One thing that a gate refuses: its id, what it does, and whether `--allow` lets it through."""

    id: str
    words: str
    is_allowed: bool


class Gate(NamedTuple):
    """A gate: the part of what was left of a limit that a change may use up, and the ids that it lets through."""

    tolerated: float
    allowed: tuple[str, ...] = ()

    def only(self, allowed: str) -> "Gate":
        """The same with one id let through."""
        return self._replace(allowed=(allowed,))

    def refusal(self, id: str, words: str, file: str) -> Refusal:
        """Refuse, or let through: the id, or the id behind the file and a colon, may be named or match a pattern."""
        names = (id, f"{file}:{id}")
        return Refusal(
            id, words, any(name == one or fnmatchcase(name, one) for one in self.allowed for name in names)
        )


class MissionChange(NamedTuple):
    """A mission before and after; changes have the largest erosion first. `inputs` are keys of the mission file.

    `requirements` are those that stand otherwise now, `loosened` what holds the mission less than before.
    """

    before: MissionFindings
    after: MissionFindings
    changes: tuple[Change, ...]
    unchanged: int
    inputs: tuple[Moved, ...] = ()
    geometry: tuple[Moved, ...] = ()
    requirements: tuple[RequirementMove, ...] = ()
    loosened: tuple[Loosened, ...] = ()

    def broken(self, tolerated: float) -> list[Change]:
        """List the rows that a gate refuses."""
        return [change for change in self.changes if change.breaks(tolerated)]

    def refusals(self, gate: Gate) -> list[Refusal]:
        """List what a gate refuses, and what of it is let through: rows, requirements, and what is loosened."""
        return [gate.refusal(id, words, self.after.file) for id, words in self._refused(gate.tolerated)]

    def _refused(self, tolerated: float) -> Iterator[tuple[str, str]]:
        broken = self.broken(tolerated)
        for change in broken:
            yield change.id, change.words
        for one in self.requirements:
            if one.is_newly_failing and one.id not in [change.id for change in broken]:
                yield one.id, _worse(one.after)
        for loosened in self.loosened:
            yield loosened.id, loosened.words


class ChangeSet(NamedTuple):
    """The effects of a change on all missions of a run.

    `gone` are mission files that the change removes, `new` those that it adds, `settings` what of the project's
    settings holds less than before, and `outside` files outside of the repository, which have one version.
    """

    missions: tuple[MissionChange, ...]
    gone: tuple[str, ...] = ()
    new: tuple[str, ...] = ()
    settings: tuple[Loosened, ...] = ()
    outside: tuple[str, ...] = ()

    def refusals(self, gate: Gate) -> list[Refusal]:
        """List what a gate refuses that is of no one mission."""
        gone = [gate.refusal(file, "the mission file is gone", file) for file in self.gone]
        return gone + [gate.refusal(one.id, one.words, "pyproject.toml") for one in self.settings]

    def is_refused(self, gate: Gate) -> bool:
        """Whether a gate refuses anything that is not let through."""
        return not all(one.is_allowed for one in self._all(gate))

    def unused(self, gate: Gate) -> list[str]:
        """List what `--allow` names and nothing needs."""
        return [one for one in gate.allowed if not any(found.is_allowed for found in self._all(gate.only(one)))]

    def _all(self, gate: Gate) -> list[Refusal]:
        return self.refusals(gate) + [one for mission in self.missions for one in mission.refusals(gate)]


def compare(before: MissionFindings, after: MissionFindings) -> MissionChange:
    """Pair the rows of two findings by id."""
    old, new = _by_id(before.rows), _by_id(after.rows)
    changes = [Change(row_id, old.get(row_id), new.get(row_id)) for row_id in {**old, **new}]
    changed = [change for change in changes if change.is_change]
    changed.sort(key=lambda change: (not change.is_newly_failing, -change.erosion))
    missions = (before.mission, after.mission) if before.mission and after.mission else ()
    return MissionChange(
        before,
        after,
        tuple(changed),
        len(changes) - len(changed),
        inputs=tuple(moved_inputs(*missions)) if missions else (),
        geometry=tuple(moved_geometry(before, after)),
        requirements=tuple(_requirements(before, after)),
        loosened=tuple(loosenings(before, after)) if missions else (),
    )


def _requirements(before: MissionFindings, after: MissionFindings) -> Iterator[RequirementMove]:
    """Requirements that stand otherwise now."""
    old, new = ({one.key: one for one in found.requirements} for found in (before, after))
    for key, one in {**old, **new}.items():
        statuses = [found[key].status if key in found else None for found in (old, new)]
        if statuses[0] != statuses[1]:
            yield RequirementMove(key, one.name, *statuses)


def _is_newly_broken(before: str | None, after: str | None) -> bool:
    """Whether what was held is so no more; what could not be judged and fails now is worse too."""
    return (after == "fail" != before) or (after == "not_evaluated" and before not in ("fail", "not_evaluated"))


def _worse(status: str | None) -> str:
    return "is not evaluated now" if status == "not_evaluated" else "fails now"


def _is_near(before: float | None, after: float | None) -> bool:
    if before is None or after is None:
        return before is after
    return abs(after - before) < SMALL * max(abs(before), abs(after)) or before == after


def _by_id(rows: Sequence[Row]) -> dict[str, Row]:
    return {row.id: row for row in rows}


def _status(row: Row | None) -> str | None:
    return None if row is None else row.status


def _reported(row: Row | None) -> tuple[object, ...]:
    return () if row is None else (row.status, row.declared, row.allowable, row.utilization)
