"""How rows of many cases are judged: the arrays beside `budget.judgement`."""

import math
from typing import Any, NamedTuple

import numpy as np

from bisar_budget.arrays.rows import Judged
from bisar_budget.constants import UTILIZATION_TOLERANCE
from bisar_budget.effects.subject import Subject
from bisar_budget.findings.status import RANK
from bisar_budget.ranges.exact_ranges import Floats

BOUND = 1 + UTILIZATION_TOLERANCE
CODE = {name: np.int8(rank) for name, rank in RANK.items()}


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
        is_info: bool = False,
        never_fails: bool = False,
    ) -> Judged:
        """Judge a row: the first status that applies."""
        none = np.full(self.cases, math.nan)
        allowed = none if allowable is None else allowable
        unknown = np.full(self.cases, -1, dtype=np.int8)
        if declared is None:
            status = np.full(self.cases, CODE["not_declared"])
            return Judged(what, status, none, allowed, none, unknown, none, none, none, never_fails)
        with np.errstate(all="ignore"):
            use = np.where(np.isnan(allowed), 0.0, declared / allowed)
        if is_info:
            status = np.full(self.cases, CODE["info"])
        else:
            status = np.select(
                [
                    use > BOUND,
                    np.broadcast_to(doubt, (self.cases,)),
                    np.broadcast_to(without_autofocus > BOUND, (self.cases,)),
                    use > self.warn_above,
                ],
                [CODE["warn" if never_fails else "fail"], CODE["warn"], CODE["pass_with_autofocus"], CODE["warn"]],
                CODE["pass"],
            ).astype(np.int8)
        return Judged(what, status, declared, allowed, use, unknown, none, none, none, never_fails)
