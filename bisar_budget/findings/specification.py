"""The sheet of specifications that hold together: the values to order, and the errors that use each limit."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

from bisar_budget.faults import SetValue
from bisar_budget.findings.requirement import JudgedRequirement, Override
from bisar_budget.findings.status import exit_code

if TYPE_CHECKING:
    from bisar_budget.findings.mission import MissionFindings


class Specification(NamedTuple):
    """The largest size of one error, and the value to order.

    `value` is the computed size, `ordered` the size rounded down, and `text` the ordered value as written in a file;
    None and empty if no requirement limits the error. `found_text` is `value` in the same unit. `remark` explains the
    number to a supplier. `declared` is the declared size in the file, the largest of three axes. `shares` are the
    error's shares of each requirement, by the row of the requirement in which the error uses most. `parts` are the
    parts of the catalogue that meet the ordered value.
    """

    key: str
    weight: float
    unit: str
    value: float | None
    ordered: float | None
    text: str
    declared: float | None
    declared_text: str
    shares: Mapping[str, float]
    parts: tuple[str, ...] = ()
    found_text: str = ""
    remark: str = ""

    def holds(self, value: float | None) -> bool:
        """Whether a size meets the specification. True without an ordered value, False without a declared size."""
        if self.ordered is None:
            return True
        if value is None:
            return False
        size = value if self.unit.startswith("dB") else abs(value)  # a level may be below 0
        return size <= self.ordered + 1e-12 * abs(self.ordered)


class RowUse(NamedTuple):
    """Use of one row that can fail by the computed sizes.

    `requirement` judges the row; None: the effect has no requirement and must stay negligible. `used` is the
    utilization of the row, `allowed` its limit. `fixed` is the share of the limit that all errors without a
    specification use, `shares` are the shares of the specified errors. `multiplier` is the price of the row: the
    weight of each error is Σ multiplier·share over rows.
    """

    id: str
    requirement: str | None
    used: float
    allowed: float
    fixed: float
    shares: Mapping[str, float]
    multiplier: float


MIN_ROOM_FRACTION = 1e-6  # of a limit, that errors without a specification must leave free


class Broken(NamedTuple):
    """A row in which errors without a specification leave no room, by its requirement, with their utilization.

    `used` is None if these errors leave no image.
    """

    id: str
    requirement: str | None
    used: float | None
    allowed: float


class SpecificationSheet(NamedTuple):
    """Specifications of one mission that hold together.

    `status` is the status of the check with the ordered values in place, and `requirements` are the requirements as
    judged by that check. `rows` are the rows that limit a specification. `broken` are the rows without room: with
    such a row there are no values. `reserve` is the part of every limit that is kept free. `notes` name the
    differences from the file. `findings` are the findings of the check.
    """

    file: str
    name: str
    model: str
    combine: str
    status: str
    reserve: float
    requirements: tuple[JudgedRequirement, ...]
    specifications: tuple[Specification, ...]
    rows: tuple[RowUse, ...]
    broken: tuple[Broken, ...] = ()
    notes: tuple[str, ...] = ()
    changes: tuple[SetValue, ...] = ()
    overrides: tuple[Override, ...] = ()
    findings: "MissionFindings | None" = None
    is_equal: tuple[SetValue, ...] = ()  # values that replaced balanced shares

    @property
    def complies(self) -> bool:
        """Whether the mission meets every requirement with the ordered values."""
        return not self.broken and exit_code({self.status}, strict=False) == 0

    @property
    def ordered(self) -> tuple[SetValue, ...]:
        """The values to set in the mission file, so that `check` uses the ordered values."""
        return (*self.is_equal, *(SetValue(one.key, one.text) for one in self.specifications if one.text))
