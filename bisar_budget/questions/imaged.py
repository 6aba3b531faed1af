"""Simulated images of the mission at the solution of a design question.

The images show whether the limit of the row that decides the solution is correct.
"""

from glob import escape
from typing import NamedTuple

from bisar_budget.faults import SetValue
from bisar_budget.findings.solution import Comparison, Imaged, Solution
from bisar_budget.mission.model import Mission
from bisar_budget.questions.compare import mission_with
from bisar_budget.questions.table import Variation
from bisar_budget.questions.varied import scaled
from bisar_budget.verifier.limits import rows_to_verify, seconds_to_verify, verify_mission
from bisar_budget.workers import Progress, unseen


class ToImage(NamedTuple):
    """Data for forming images at the solution of a design question.

    `mission` is the mission at the solution, `row` is the binding row, and `at` is the solution as text.
    """

    mission: Mission
    row: str
    at: str

    @property
    def seconds(self) -> float:
        """Estimated time to form the images, or 0 if it is clearly less than a minute. [s]"""
        return seconds_to_verify(self.mission, escape(self.row))


def to_image(mission: Mission, solution: Solution | Comparison, model: str | None) -> ToImage | None:
    """Choose the mission and the row for which images are formed at a solution.

    The solution has either the crossings at which the mission begins or ceases to comply as a number varies, or a
    comparison of parts. In the first case, the number gets its value on the complying side of the crossing with the
    largest value. In the second case, the mission gets the complying part with the smallest margin. Returns None if
    no value complies, if all values comply, or if no row binds.
    """
    variation = Variation(mission, model)
    if isinstance(solution, Comparison):
        part = next(iter(solution.complying), None)
        if part is None or part.standing.row is None:
            return None
        return ToImage(mission_with(variation, solution.key, part), part.standing.row, part.id)
    best = solution.best
    row = None if best is None else best.outside.row or best.inside.row
    if best is None or row is None:
        return None
    text = solution.texts[best.inside.value]
    if solution.is_scale:
        return ToImage(scaled(variation.read(), solution.key, best.inside.value), row, f"factor {text}")
    return ToImage(variation.read([SetValue(solution.key, text)]), row, text)


def imaged(case: ToImage, progress: Progress = unseen) -> Imaged:
    """Form images at the limit of the binding row, and return the verdict on the limit that they show."""
    only = escape(case.row)
    if not rows_to_verify(case.mission, only):
        return Imaged(case.row, case.at, None, "its limit is not one that an image could show")
    (verdict,) = verify_mission(case.mission, only, progress=progress).rows
    return Imaged(case.row, case.at, verdict, verdict.reason or "")
