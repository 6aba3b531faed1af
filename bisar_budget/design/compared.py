"""What comparing parts of the catalogue for a mission found, as frozen data."""

from typing import NamedTuple

from bisar_budget.design.solution import Imaged
from bisar_budget.design.variation import Standing
from bisar_budget.faults import SetValue
from bisar_budget.findings.requirement import Override


class PartState(NamedTuple):
    """How the mission stands with one part.

    `figures` are those that the mission takes of it; the file's own stand before them. `silent_on` are figures that
    the mission takes of other parts of the kind and this one does not state: they stay undeclared. `own_row` uses
    most of its limit among the rows that rest on these figures alone. `is_given` marks the part that the file names.
    `reason` says why it does not comply where no row does; empty else.
    """

    id: str
    name: str
    kind: str
    file: str
    is_given: bool
    figures: tuple[str, ...]
    standing: Standing
    own_row: str | None = None
    own_utilization: float | None = None
    reason: str = ""
    silent_on: tuple[str, ...] = ()

    @property
    def complies(self) -> bool:
        """Whether the mission does with it."""
        return self.standing.complies


class Comparison(NamedTuple):
    """Parts for one key of one mission.

    `parts` has those that comply first, the smallest margin first, then the others, the nearest miss first. `kinds`
    are those that were compared, `kept` parts of other kinds that stay. `overridden` are figures that parts have and
    the file states itself. `imaged` is what images say of the part with the smallest margin, if any were formed.
    `overrides` is what from outside the file bears on it.
    """

    file: str
    name: str
    key: str
    target: str
    row: str | None
    model: str
    kinds: tuple[str, ...]
    kept: tuple[str, ...]
    overridden: tuple[str, ...]
    parts: tuple[PartState, ...]
    changes: tuple[SetValue, ...] = ()
    imaged: Imaged | None = None
    overrides: tuple[Override, ...] = ()

    @property
    def complying(self) -> tuple[PartState, ...]:
        """The parts with which the mission complies."""
        return tuple(part for part in self.parts if part.complies)

    @property
    def status(self) -> str:
        """Whether `all`, `some` or `none` of the parts comply."""
        count = len(self.complying)
        return "none" if count == 0 else "all" if count == len(self.parts) else "some"
