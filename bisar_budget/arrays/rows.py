"""A row of the budget in many cases at once."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.effects.models import CUBIC, END_OF_IMAGE, LOCATION, QUADRATIC
from bisar_budget.effects.subject import Subject
from bisar_budget.findings.status import RANK
from bisar_budget.ranges.exact_ranges import Floats

REQUIREMENTS = (QUADRATIC, CUBIC, LOCATION, "pslr", "islr", END_OF_IMAGE)


class Judged(NamedTuple):
    """One row of many cases: codes of statuses, by the place of each in `STATUS`, and numbers; NaN where none is."""

    subject: Subject
    status: NDArray[np.int8]
    declared: Floats
    allowable: Floats
    utilization: Floats
    binding: NDArray[np.int8]  # place in REQUIREMENTS of what sets the allowable, or -1: the row's metric
    qpe_published_rad: Floats
    cubic_rad: Floats
    quadratic_use: Floats  # quadratic phase over its limit, whatever sets the allowable; NaN where it has none
    never_fails: bool = False
    metric: str = QUADRATIC
    is_of_declare: bool = False  # as `Row.is_of_declare`, in some of the cases

    @classmethod
    def of_none(cls, what: Subject, cases: int) -> "Judged":
        """A row that is not declared in any case."""
        status, binding = np.full(cases, RANK["not_declared"], np.int8), np.full(cases, -1, np.int8)
        declared, allowable, utilization, qpe, cubic, use = (np.full(cases, math.nan) for _ in range(6))
        return cls(what, status, declared, allowable, utilization, binding, qpe, cubic, use)

    def where(self, is_other: Any, other: "Judged") -> "Judged":
        """This row, but in some cases the other."""
        return Judged(
            self.subject,
            np.where(is_other, other.status, self.status),
            np.where(is_other, other.declared, self.declared),
            np.where(is_other, other.allowable, self.allowable),
            np.where(is_other, other.utilization, self.utilization),
            np.where(is_other, other.binding, self.binding),
            np.where(is_other, other.qpe_published_rad, self.qpe_published_rad),
            np.where(is_other, other.cubic_rad, self.cubic_rad),
            np.where(is_other, other.quadratic_use, self.quadratic_use),
            self.never_fails,
            self.metric,
            self.is_of_declare,
        )

    @property
    def margin(self) -> Floats:
        """Allowable over declared less one, as factors where the row has them in decibel."""
        with np.errstate(all="ignore"):
            margin = 1 / self.utilization - 1
        margin[~np.isfinite(margin)] = math.nan
        return margin
