"""A row of the budget in many cases at once, and how it is judged; a check is one case."""

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.constants import UTILIZATION_TOLERANCE
from bisar_budget.effects.declared import CUBIC, END_OF_IMAGE, LOCATION, QUADRATIC
from bisar_budget.effects.subject import Subject
from bisar_budget.findings.status import RANK

Floats = NDArray[np.float64]

BOUND = 1 + UTILIZATION_TOLERANCE
CODE = {name: np.int8(rank) for name, rank in RANK.items()}
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

    def at(self, place: int, what: Subject) -> "Judged":
        """One of several rows that were judged together, (rows, cases), by its place."""
        own = {name: part[place] for name, part in self._asdict().items() if isinstance(part, np.ndarray)}
        return self._replace(subject=what, **own)

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

    def apart(self, subjects: Sequence[Subject]) -> "Iterator[Judged]":
        """The rows of a row that stands for so many, each of whose cases follow one another."""
        cases = self.status.size // len(subjects)
        for start, what in zip(range(0, self.status.size, cases), subjects, strict=True):
            some = slice(start, start + cases)
            yield Judged(
                what,
                self.status[some],
                self.declared[some],
                self.allowable[some],
                self.utilization[some],
                self.binding[some],
                self.qpe_published_rad[some],
                self.cubic_rad[some],
                self.quadratic_use[some],
                self.never_fails,
                self.metric,
                self.is_of_declare,
            )

    def in_decibel(self) -> "Judged":
        """The row with its factors of amplitude in decibel; its utilization stays that of amplitudes."""
        with np.errstate(all="ignore"):
            declared, allowable = (
                np.where(column > 0, 20 * np.log10(column) + 0.0, math.nan)
                for column in (self.declared, self.allowable)
            )
        return self._replace(declared=declared, allowable=allowable)

    def held_to(self, key: str) -> "Judged":
        """The row with the requirement that sets its allowable."""
        return self._replace(metric=key, binding=np.full_like(self.binding, REQUIREMENTS.index(key)))

    @property
    def margin(self) -> Floats:
        """Allowable over declared less one, as factors where the row has them in decibel."""
        with np.errstate(all="ignore"):
            margin = 1 / self.utilization - 1
        margin[~np.isfinite(margin)] = math.nan
        return margin


class Judging(NamedTuple):
    """How many cases there are, and from which utilization on a pass of each is a warning."""

    cases: int
    warn_above: Any

    def array(self, value: Any) -> Floats:
        """One number for each case."""
        found: Floats = np.array(np.broadcast_to(np.asarray(value, dtype=float), (self.cases,)))
        return found

    def row(
        self,
        what: Subject,
        declared: Floats | None,
        allowable: Floats | None,
        *,
        doubt: Any = False,
        without_autofocus: Any = 0.0,
        is_info: Any = False,
        is_unknown: Any = False,
        never_fails: bool = False,
    ) -> Judged:
        """Judge a row: the first status that applies; where `is_unknown`, what is declared cannot be judged.

        What is declared is NaN in the cases that declare nothing.
        """
        shape = (self.cases,) if declared is None else declared.shape  # several rows judge alike: (rows, cases)
        none = np.full(shape, math.nan)
        allowed = none if allowable is None else allowable
        unknown = np.full(shape, -1, dtype=np.int8)
        if declared is None:
            status = np.full(shape, CODE["not_declared"])
            return Judged(what, status, none, allowed, none, unknown, none, none, none, never_fails)
        is_silent = np.isnan(declared)
        with np.errstate(all="ignore"):
            use = np.where(np.isnan(allowed) & ~is_silent, 0.0, declared / allowed)
        status = np.select(
            [
                is_silent,
                np.broadcast_to(is_info, shape),
                np.broadcast_to(is_unknown, shape),
                use > BOUND,
                np.broadcast_to(doubt, shape),
                np.broadcast_to(without_autofocus > BOUND, shape),
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
        return Judged(what, status, declared, allowed, use, unknown, none, none, none, never_fails)
