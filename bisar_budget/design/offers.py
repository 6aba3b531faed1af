"""A supplier's offer against a sheet of specifications: each figure, and the mission with the offer as a whole."""

from datetime import date
from typing import NamedTuple

from bisar_budget.budget.check import check_mission
from bisar_budget.design.quantities import QuestionError, number_of, tree_of
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.findings.specification import SpecificationSheet
from bisar_budget.mission.model import Mission


class OfferedFigure(NamedTuple):
    """What an offer has for a specification: None where its file is silent. `text` is that as the file has it."""

    key: str
    value: float | None
    text: str
    ordered: str
    is_inside: bool


class Offer(NamedTuple):
    """An offer: the file of a mission that has its figures, and how that mission stands as a whole."""

    file: str
    status: str
    figures: tuple[OfferedFigure, ...]
    requirements: tuple[JudgedRequirement, ...]

    @property
    def complies(self) -> bool:
        """Whether the mission meets every requirement with the offer, whatever single figures are."""
        return self.status not in ("fail", "not_evaluated", "error")


def offer(sheet: SpecificationSheet, mission: Mission, today: date) -> Offer:
    """Hold the mission of an offer to a sheet.

    A figure is inside where it is no larger than what is ordered, of three axes the largest one, or where nothing is.
    """
    tree, figures = tree_of(mission), []
    for one in sheet.specifications:
        try:
            number = number_of(tree, one.key, is_for_each=True)
        except QuestionError:
            value, text = None, ""
        else:
            value, text = number.value, "" if number.value is None else number.text(number.value)
        figures.append(OfferedFigure(one.key, value, text, one.text, one.holds(value)))
    found = check_mission(mission, today)
    return Offer(mission.file, found.status, tuple(figures), found.requirements)
