"""One row of the budget, judged for an array of cases, and the rules by which it is judged.

The check of one mission is a single case.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget import phrases
from bisar_budget.analysis.analysis import Case
from bisar_budget.arrays import Floats, PerCase, PerCaseFlag
from bisar_budget.constants import UTILIZATION_TOLERANCE_FRACTION
from bisar_budget.effects.declared import CUBIC, END_OF_IMAGE, LOCATION, QUADRATIC
from bisar_budget.effects.effect import Subject
from bisar_budget.faults import KeyPath
from bisar_budget.findings.row import Row
from bisar_budget.findings.status import RANK, STATUS
from bisar_budget.phrases import NOTHING, Note

Codes = NDArray[np.int8]  # indices of statuses in `STATUS`, from the worst to the best

LIMIT_RATIO = 1 + UTILIZATION_TOLERANCE_FRACTION
CODE = {name: np.int8(rank) for name, rank in RANK.items()}
_STATUS_NAMES = np.array(list(STATUS), dtype=object)
REQUIREMENTS = (QUADRATIC, CUBIC, LOCATION, "pslr", "islr", END_OF_IMAGE)
EFFECT_WORDS = {
    QUADRATIC: ("rad", "QPE"),
    CUBIC: ("rad", "cubic phase"),
    LOCATION: ("m", "displacement"),
}  # unit and name of each effect in a sentence

COMPLETE_FIELDS = (
    "allowable_published",
    "allowable_full",
    "qpe_full_rad",
    "qpe_exact_rad",
    "islr_db",
)  # computed only if `Judging.is_complete` is set
NUMBERS = (
    "declared",
    "allowable",
    "utilization",
    "qpe_published_rad",
    "cubic_rad",
    *COMPLETE_FIELDS[:3],
    "islr_db",
    "equal_loss_qpe_rad",
    "rest_rad",
)  # names of the numbers of a row in reports
_columns_of_numbers = attrgetter(*NUMBERS)
IN_UNIT = ("declared", "allowable", "allowable_published", "allowable_full")  # numbers in the unit of the row's error


def statuses(codes: Codes | np.int8) -> Any:
    """Convert a status code to the name of the status, or convert an array of codes to an array of names."""
    return _STATUS_NAMES[codes]


class Why(IntEnum):
    """Reason for the status of a row, if this status does not follow from the numbers of the row."""

    OWN = 0  # no reason: the row's own numbers decide
    NOT_DECLARED_AS_REQUIRED = 1
    INPUT_IN_DOUBT = 2
    EFFECT_NOT_TAKEN = 3
    NO_PLACE = 4
    NOTHING_SPREADS = 5
    AIR_STAYS = 6
    HALF_A_CAUSE = 7


class Judged(NamedTuple):
    """One row of the budget for an array of cases: its status codes (indices in `STATUS`) and its numbers, (cases,).

    A number is NaN in the cases for which it is not defined. The numbers in `COMPLETE_FIELDS` are computed only if
    `Judging.is_complete` is set.
    """

    subject: Subject
    status: Codes
    declared: Floats
    allowable: Floats
    utilization: Floats
    binding: Codes  # index in REQUIREMENTS of the requirement that sets the allowable, or -1: the row's metric
    why: Codes  # values of `Why`
    model: Codes  # index in MODELS of the model that judges
    qpe_published_rad: Floats
    cubic_rad: Floats
    quadratic_use: Floats  # quadratic phase divided by its limit, for any `binding`; NaN without such a phase
    allowable_published: Floats
    allowable_full: Floats
    qpe_full_rad: Floats
    islr_db: Floats
    equal_loss_qpe_rad: Floats
    rest_rad: Floats
    metric: str = QUADRATIC
    is_of_ranges: bool = False  # whether `qpe_full_rad` is computed from exact ranges

    @classmethod
    def of_none(cls, row_subject: Subject, cases: int) -> "Judged":
        """Create the row of an error that is not declared in any case."""
        status = np.full(cases, RANK["not_declared"], np.int8)
        return cls._with(row_subject, status, *(np.full(cases, math.nan) for _ in range(3)))

    @classmethod
    def _with(
        cls, row_subject: Subject, status: Codes, declared: Floats, allowable: Floats, utilization: Floats
    ) -> "Judged":
        none, zero = np.full(status.shape, math.nan), np.zeros(status.shape, dtype=np.int8)
        return cls(row_subject, status, declared, allowable, utilization, zero - 1, zero, zero, *(none,) * 9)

    def _of_columns(self, change: Callable[[Any], Any], names: Sequence[str]) -> "Judged":
        columns: dict[str, Any] = {name: change(getattr(self, name)) for name in names}
        return self._replace(**columns)

    def at(self, row_index: int, row_subject: Subject) -> "Judged":
        """Extract one row, at `row_index`, from several rows that were judged together as arrays (rows, cases)."""
        columns = {name: getattr(self, name)[row_index] for name in _ARRAY_FIELDS}
        return self._replace(subject=row_subject, **columns)

    def where(self, takes_other: PerCaseFlag, other: "Judged") -> "Judged":
        """Return this row with the values of `other` in the cases where `takes_other` is true."""
        columns: dict[str, Any] = {
            name: np.where(takes_other, getattr(other, name), getattr(self, name)) for name in _ARRAY_FIELDS
        }
        return self._replace(**columns)

    def in_decibel(self) -> "Judged":
        """Return the row with its sizes converted from amplitudes to decibels.

        The utilization remains a ratio of amplitudes.
        """
        return self._of_columns(decibels, IN_UNIT)

    def in_unit(self, factor: PerCase) -> "Judged":
        """Return the row in another unit, with each of its sizes multiplied by `factor`."""
        return self._of_columns(lambda column: column * factor, IN_UNIT)

    def held_to(self, key: str) -> "Judged":
        """Return the row with `key` as its metric and as the key of the requirement that sets its allowable."""
        return self._replace(metric=key, binding=np.full_like(self.binding, REQUIREMENTS.index(key)))

    def allowable_by(self, model: str) -> Floats:
        """Return the allowable according to one model, even if this model does not judge the row.

        `model` is `published` or `full`.
        """
        return self.allowable_published if model == "published" else self.allowable_full

    def requirement(self, case: Case) -> str | None:
        """Return the key of the requirement that sets the allowable in a case.

        The result is None if this is the requirement on the row's own metric.
        """
        requirement_index = self.binding[case.place]
        return None if requirement_index < 0 else REQUIREMENTS[requirement_index]

    def numbers(self, case: int) -> dict[str, float | None]:
        """Return the numbers of the row in one case as a mapping from name to value.

        A number that is NaN is returned as None. `case` is the index of the case.
        """
        columns = [column.item(case) for column in _columns_of_numbers(self)]
        return {name: None if math.isnan(number) else number for name, number in zip(NUMBERS, columns, strict=True)}

    @property
    def qpe_exact_rad(self) -> Floats:
        """Quadratic phase computed from exact ranges; NaN for a row that is not computed from exact ranges. [rad]"""
        return self.qpe_full_rad if self.is_of_ranges else np.full(self.qpe_full_rad.shape, math.nan)

    @property
    def margin(self) -> Floats:
        """Allowable divided by the declared size, minus one.

        For a row in decibels, both are converted to amplitudes before they are divided.
        """
        with np.errstate(all="ignore"):
            margin = 1 / self.utilization - 1
        margin[~np.isfinite(margin)] = math.nan
        return margin


_ARRAY_FIELDS = tuple(name for name in Judged._fields if name not in ("subject", "metric", "is_of_ranges"))


def decibels(amplitude: PerCase) -> Floats:
    """Convert amplitude factors to levels; a factor that is zero, negative or NaN gives NaN. [dB]"""
    with np.errstate(all="ignore"):
        return np.where(amplitude > 0, 20 * np.log10(amplitude) + 0.0, math.nan)


class Judging(NamedTuple):
    """Settings for judging rows: the number of cases, and the utilization above which a warning is given.

    A utilization above `warn_above` turns a pass into a warning. If `is_complete` is set, all numbers of each row are
    computed. Otherwise only the numbers that decide the status are computed.
    """

    cases: int
    warn_above: PerCase
    is_complete: bool = False

    def array(self, value: PerCase | None) -> Floats:
        """Expand a number to an array with one value for each case, (cases,); None becomes NaN."""
        return np.full(self.cases, math.nan if value is None else value, dtype=float)

    def row(
        self,
        row_subject: Subject,
        declared: Floats | None,
        allowable: Floats | None,
        *,
        doubt: PerCaseFlag = False,
        without_autofocus: PerCase = 0.0,
        is_info: PerCaseFlag = False,
        is_unknown: PerCaseFlag = False,
        never_fails: bool = False,
        use: Floats | None = None,
    ) -> Judged:
        """Judge a row in each case; the first rule that applies gives the status.

        The rules are applied in this order:

        - the error is not declared: `not_declared`;
        - `is_info` is true: `info`;
        - `is_unknown` is true, because the declared value cannot be judged: `not_evaluated`;
        - the utilization exceeds 1: `fail`, or `warn` if `never_fails` is set;
        - `doubt` is true: `warn`;
        - the utilization without autofocus exceeds 1: `pass_with_autofocus`;
        - the utilization exceeds `warn_above`: `warn`;
        - otherwise: `pass`.

        `declared` is NaN in the cases that do not declare the error. `use` is the utilization, if it is not the
        declared size divided by the allowable.
        """
        shape = (self.cases,) if declared is None else declared.shape  # several rows at once: (rows, cases)
        none = np.full(shape, math.nan)
        allowed = none if allowable is None else allowable
        if declared is None:
            return Judged._with(row_subject, np.full(shape, CODE["not_declared"]), none, allowed, none)
        is_silent = np.isnan(declared)
        if use is None:
            with np.errstate(all="ignore"):
                use = np.where(np.isnan(allowed) & ~is_silent, 0.0, declared / allowed)
        status = np.select(
            [
                is_silent,
                np.broadcast_to(is_info, shape),
                np.broadcast_to(is_unknown, shape),
                use > LIMIT_RATIO,
                np.broadcast_to(doubt, shape),
                np.broadcast_to(without_autofocus > LIMIT_RATIO, shape),
                use > self.warn_above,
            ],
            [
                CODE["not_declared"],
                CODE["info"],
                CODE["not_evaluated"],
                CODE["warn" if never_fails else "fail"],
                CODE["warn"],
                CODE["pass_with_autofocus"],
                CODE["warn"],
            ],
            CODE["pass"],
        ).astype(np.int8)
        return Judged._with(row_subject, status, declared, allowed, use)


# ---------------------------------------------------------------------- one case in words
@dataclass(frozen=True, slots=True, eq=False)
class FamilyRow(ABC):
    """Base class of budget rows. Each row is judged by one model, for an array of cases.

    `judged` holds the status and the numbers of the row. `is_there` marks the cases in which the row exists.
    """

    judged: Judged
    is_there: Any = field(default=True, kw_only=True)

    @abstractmethod
    def in_words(self, case: Case, model: str) -> Row:
        """Build the report row for one case, including its text; `model` names the model that judges the row."""


def worded(
    case: Case,
    row: Judged,
    *,
    unit: str,
    path: KeyPath,  # place of the declared value in the mission file
    equation: str,
    over: Note = NOTHING,  # reason for a fail
    doubt: Note = NOTHING,  # reason for a warning instead of a pass
    no_limit: Note = NOTHING,  # reason for a missing allowable
    not_evaluated: Note = NOTHING,  # reason why a declared value cannot be judged
    info: Note = NOTHING,  # reason why the row judges nothing
    without_autofocus: float = 0.0,  # utilization without the gain of autofocus
    **more_fields: Any,  # further fields of the row
) -> Row:
    """Build the report row for one case from a judged row and the notes for its text.

    The notes do not change the status of the row.
    """
    mission, status, numbers = case.mission, statuses(row.status[case.place]), row.numbers(case.place)
    allowable, utilization, full = numbers["allowable"], numbers["utilization"], numbers["qpe_full_rad"]
    reason, remarks = no_limit if allowable is None else NOTHING, tuple[Note, ...](more_fields.pop("remarks", ()))
    if status == "info":
        reason = reason or info
    elif status == "not_evaluated":
        reason = not_evaluated
    elif status == "fail":
        reason = over
    elif status == "warn":
        reason = doubt or phrases.note("above-warn-above", warn_above=mission.allocation.warn_above)
    elif status == "pass_with_autofocus":
        reason = phrases.note("over-the-limit-without-autofocus", times=without_autofocus)
        if utilization is not None and utilization > mission.allocation.warn_above:
            remarks = (*remarks, phrases.note("near-the-limit-with-autofocus", utilization=utilization))
    margin = 1 / utilization - 1 if utilization else math.inf
    fields: dict[str, Any] = numbers | {
        "qpe_exact_rad": full if row.is_of_ranges else None,
        "margin": margin if math.isfinite(margin) else None,
        "status": status,
        "line": mission.line(path),
        "reason": reason or None,
        "remarks": remarks,
        "equation": equation,
        "requirement_ids": mission.requirement_ids.get(row.subject.id, ()),
    }
    return Row(row.subject, row.metric, unit, **(fields | more_fields))
