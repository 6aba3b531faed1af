"""Budget row for the residual of a log, if the file does not state which path the processor uses.

The residual is the difference between the position fixes of the log and the smooth path fitted to them. For a
processor that uses the fixes, the residual is a random error with a row of its own (`effects.navigation_errors`). For
a processor that uses the smooth path, there is no residual. If the file does not state which path is used, the
residual cannot be judged. The row of this module is then not evaluated, whatever the requirements are.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bisar_budget.analysis.analysis import Case
from bisar_budget.budget.doubts import leaves_unsaid
from bisar_budget.budget.judged_rows import CODE, FamilyRow, Judged, Judging, Why, worded
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.effects.navigation_errors import residual_subject
from bisar_budget.error_kinds.random_kinds import TRAJECTORY_KIND
from bisar_budget.findings.row import Row
from bisar_budget.mission.model import Mission


def log_rows(judging: Judging, mission: Mission) -> Iterator["UnsaidResidual"]:
    """Yield the row for a log's residual that is too large, for each platform with such a log.

    The residual is the difference between the position fixes of the log and the smooth path fitted to them. The row
    exists only in the cases in which the residual is too large.
    """
    for name in PLATFORMS:
        is_there = np.broadcast_to(leaves_unsaid(mission, name), (judging.cases,))
        if is_there.any():
            none = Judged.of_none(residual_subject(name), judging.cases)
            judged = none._replace(
                status=np.where(is_there, CODE["not_evaluated"], none.status),
                why=np.where(is_there, np.int8(Why.INPUT_IN_DOUBT), none.why),
                metric="islr",
            )
            yield UnsaidResidual(judged, is_there=is_there)


@dataclass(frozen=True, slots=True, eq=False)
class UnsaidResidual(FamilyRow):
    """The row for the residual of a log, for an array of cases.

    The residual is the difference between the position fixes of the log and the smooth path fitted to them. The row
    is not evaluated. The report gives the reason: it is unknown whether the processor uses the fixes or the smooth
    path.
    """

    def in_words(self, case: Case, model: str) -> Row:
        """Build the report row for one case, including its text. The row is the same for both models."""
        path = TRAJECTORY_KIND.path(self.judged.subject.owner)
        unit = TRAJECTORY_KIND.unit
        return worded(case, self.judged, unit=unit, path=path, equation="residual of the smoothed log")
