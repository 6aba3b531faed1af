"""Rows of `specifications`: what the file declares, held to the sizes that suppliers were given."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from bisar_budget import phrases
from bisar_budget.analysis.analysis import Analysis, Case
from bisar_budget.budget.judged_rows import CODE, Judged, Judging, worded
from bisar_budget.effects.effect import PLATFORMS, subject
from bisar_budget.findings.row import SPECIFICATION, Row
from bisar_budget.mission.changes import name_of_error, parts_of
from bisar_budget.mission.quantities import Number, largest_at


def specification_rows(judging: Judging, analysis: Analysis) -> Iterator["SpecificationRow"]:
    """Judge each specification: no more may be declared, of three axes in the largest; coverage does not count.

    An error that is specified and not declared is not evaluated. All of a specification may be used, without warning.
    """
    for number in analysis.mission.specifications.values():
        most, found = judging.array(number.value), judging.array(largest_at(analysis.mission, number))
        what = subject(_owner(number.key), SPECIFICATION, name_of_error(number.key))
        of_amplitudes = _amplitude if number.is_level else np.asarray
        judged = judging._replace(warn_above=1.0).row(what, of_amplitudes(found), of_amplitudes(most))
        status = np.where(np.isnan(found), CODE["not_evaluated"], judged.status).astype(np.int8)
        judged = judged._replace(status=status, declared=found, allowable=most, metric=SPECIFICATION)
        yield SpecificationRow(judged, number)


@dataclass(frozen=True, slots=True, eq=False)
class SpecificationRow:
    """One specification in many cases."""

    judged: Judged
    number: Number
    is_there: Any = True

    def in_words(self, case: Case, model: str) -> Row:
        """The row of one case; models do not differ in it."""
        return worded(
            case,
            self.judged,
            unit=self.number.dimension.si,
            path=("specifications", self.number.key),
            equation="declared against specified",
            over=phrases.more_than_specified(),
            not_evaluated=phrases.specified_and_not_declared(self.number.key),
            is_independent=False,
        )


def _amplitude(level: Any) -> Any:
    return 10 ** (level / 20)


def _owner(key: str) -> str:
    section, name, *_ = (*parts_of(key), "")
    if section == "platforms":
        return name if name in PLATFORMS else "mission"
    return "clock" if section in ("timing_error", "synchronization") else "mission"
