"""What a change of a mission does to its rows: use of the limits before and after, and how much it erodes."""

from collections.abc import Sequence
from typing import NamedTuple

from bisar_budget.budget.findings import MissionFindings, Row
from bisar_budget.constants import UTILIZATION_TOLERANCE

_JUDGES_NOTHING = ("info", "not_declared", "not_evaluated", "waived")


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
        """Whether it fails now and did not."""
        return _status(self.after) == "fail" != _status(self.before)

    @property
    def is_change(self) -> bool:
        """Whether anything that is reported differs; that it moved to another line does not count."""
        return _reported(self.before) != _reported(self.after)

    def breaks(self, tolerated: float) -> bool:
        """Whether it newly fails, or a row that is judged loses more than the tolerated part of what was left."""
        is_judged = _status(self.after) not in (None, *_JUDGES_NOTHING)
        return self.is_newly_failing or (is_judged and self.erosion > tolerated + UTILIZATION_TOLERANCE)


class MissionChange(NamedTuple):
    """A mission before and after; changes have the largest erosion first."""

    before: MissionFindings
    after: MissionFindings
    changes: tuple[Change, ...]
    unchanged: int

    def broken(self, tolerated: float) -> list[Change]:
        """List the changes that a gate refuses."""
        return [change for change in self.changes if change.breaks(tolerated)]


def compare(before: MissionFindings, after: MissionFindings) -> MissionChange:
    """Pair the rows of two findings by id."""
    old, new = _by_id(before.rows), _by_id(after.rows)
    changes = [Change(row_id, old.get(row_id), new.get(row_id)) for row_id in {**old, **new}]
    changed = [change for change in changes if change.is_change]
    changed.sort(key=lambda change: (not change.is_newly_failing, -change.erosion))
    return MissionChange(before, after, tuple(changed), len(changes) - len(changed))


def _by_id(rows: Sequence[Row]) -> dict[str, Row]:
    return {row.id: row for row in rows}


def _status(row: Row | None) -> str | None:
    return None if row is None else row.status


def _reported(row: Row | None) -> tuple[object, ...]:
    return () if row is None else (row.status, row.declared, row.allowable, row.utilization)
