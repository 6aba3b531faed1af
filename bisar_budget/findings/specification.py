"""Specifications of a mission's errors: sizes that together meet every requirement, and shares of the limits."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

from bisar_budget.faults import SetValue
from bisar_budget.findings.requirement import JudgedRequirement, Override
from bisar_budget.findings.status import exit_code

if TYPE_CHECKING:
    from bisar_budget.findings.mission import MissionFindings


class Specification(NamedTuple):
    """Specification of one error: its largest permitted size, computed and rounded for a purchase order.

    `value` is the computed size. `ordered` is the specified value: the computed size rounded down. `text` is the
    specified value as written in a mission file. If no requirement limits the error, `value` and `ordered` are None
    and `text` is empty. `found_text` is the text of `value` in the same unit. `remark` explains the number to a
    supplier. `declared` is the declared size in the file; if the file states a size for each of three axes, it is the
    largest. `shares` maps each requirement to the fraction of its limit that the error uses, in the row in which this
    fraction is largest. `parts` are the parts of the catalogue that meet the specified value.
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
        """Whether a size meets the specification.

        Without a specified value, the result is True for any size. With a specified value, it is False if the size is
        None.
        """
        if self.ordered is None:
            return True
        if value is None:
            return False
        size = value if self.unit.startswith("dB") else abs(value)  # a level may be below 0
        return size <= self.ordered + 1e-12 * abs(self.ordered)


class RowUse(NamedTuple):
    """Utilization of one row with the computed sizes of the errors, and the share of each error in it.

    `requirement` is the requirement that judges the row; None if no requirement covers the effect, which must then
    stay negligible. `used` is the utilization of the row, and `allowed` is its limit. `fixed` is the share of the
    limit that all errors without a specification use, and `shares` are the shares of the specified errors.
    `multiplier` states how strongly the row limits the sizes: the weight of each error is the sum of multiplier·share
    over all rows.
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
    """A row in which the errors without a specification leave no room for specified errors.

    `used` is the utilization due to the errors without a specification alone; None if no image forms with them.
    `requirement` is the requirement of the row.
    """

    id: str
    requirement: str | None
    used: float | None
    allowed: float


class SpecificationSheet(NamedTuple):
    """Specifications for the errors of one mission that together meet every requirement.

    `findings` are the findings of a check with the specified values. `status` is the status of this check, and
    `requirements` are the requirements as this check judges them. `rows` are the rows that limit a specification.
    `broken` are the rows in which the errors without a specification leave no room for specified errors. If there is
    such a row, the specifications have no values. `reserve` is the fraction of every limit that is kept free. `notes`
    name the differences between the checked mission and the mission file.
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
        """Whether the mission meets every requirement with the specified values."""
        return not self.broken and exit_code({self.status}, strict=False) == 0

    @property
    def ordered(self) -> tuple[SetValue, ...]:
        """Changes to the mission file that make `check` use the specified values."""
        return (*self.is_equal, *(SetValue(one.key, one.text) for one in self.specifications if one.text))
