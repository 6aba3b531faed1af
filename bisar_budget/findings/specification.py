"""The sheet of specifications that hold together: what is to be ordered, and what each limit is used by."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

from bisar_budget.faults import SetValue
from bisar_budget.findings.requirement import JudgedRequirement, Override
from bisar_budget.findings.status import exit_code

if TYPE_CHECKING:
    from bisar_budget.findings.mission import MissionFindings


class Specification(NamedTuple):
    """The largest size of one error, and what is to be ordered.

    `value` is the size as found, `ordered` the same rounded down, `text` that as the file would have it; None, and
    empty, where no requirement limits it. `found_text` is the value in the same unit, `remark` what the number means
    to a supplier. `declared` is what the file has today, the largest of three axes. `shares` are the parts of what
    each requirement may use, by its row in which the error takes most of it. `parts` are those of the catalogue that
    keep to what is ordered.
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
        """Whether a size keeps to what is ordered: where nothing is ordered it does, where none is stated not."""
        if self.ordered is None:
            return True
        if value is None:
            return False
        size = value if self.unit.startswith("dB") else abs(value)  # a level may be below 0
        return size <= self.ordered + 1e-12 * abs(self.ordered)


class RowUse(NamedTuple):
    """How one row that can fail is used by the sizes as found.

    `requirement` judges it; None: the effect has no requirement, and must stay negligible. `used` is its utilization,
    `allowed` what it may be; `fixed` is the part of that which all other errors take, `shares` those of the specified
    ones. `multiplier` says what the row is worth: Σ multiplier·share over rows is the weight of each error.
    """

    id: str
    requirement: str | None
    used: float
    allowed: float
    fixed: float
    shares: Mapping[str, float]
    multiplier: float


LEAST_ROOM = 1e-6  # of a limit, that other errors must leave


class Broken(NamedTuple):
    """A row that the other errors leave no room in, by its requirement, with what they use of it.

    `used` is None where they have no image.
    """

    id: str
    requirement: str | None
    used: float | None
    allowed: float


class SpecificationSheet(NamedTuple):
    """Specifications of one mission that hold together.

    `status` is that of the check with what is ordered in place, and `requirements` how each then stands. `rows` are
    those that limit a specification, `broken` those in which there is no room: then there are no values. `reserve` is
    the part of every limit that is kept free. `notes` say what was taken otherwise than the file has it. `findings`
    are those of the check.
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
    is_equal: tuple[SetValue, ...] = ()  # what balanced shares were replaced by

    @property
    def complies(self) -> bool:
        """Whether the mission meets every requirement with what is ordered."""
        return not self.broken and exit_code({self.status}, strict=False) == 0

    @property
    def ordered(self) -> tuple[SetValue, ...]:
        """The values set in the mission file with which `check` holds it to what is ordered."""
        return (*self.is_equal, *(SetValue(one.key, one.text) for one in self.specifications if one.text))
