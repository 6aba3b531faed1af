"""One case of an analysis in plain numbers, to be put into words."""

from functools import cached_property
from typing import Any

from bisar_budget.analysis.allocation import Allocation
from bisar_budget.analysis.analysis import Analysis, Model
from bisar_budget.effects.declared import Declared
from bisar_budget.effects.effect import ErrorSource, plain
from bisar_budget.effects.random_errors import RandomError, in_one_case
from bisar_budget.geometry import BistaticGeometry
from bisar_budget.mission.model import Mission
from bisar_budget.phrases import Note


class Case:
    """One of the cases that were analysed together.

    Parameters
    ----------
    analysis : Analysis
        Of the cases.
    mission : Mission, optional
        That of this case, as loaded; omitted: the analysed one, which is the only case.
    place : int
        Of this case among them.
    """

    def __init__(self, analysis: Analysis, mission: Mission | None = None, place: int = 0) -> None:
        self.analysis, self.mission, self.place = analysis, mission or analysis.mission, place

    def number(self, column: Any) -> float:
        """The number that this case has in a column (cases,); a number that all cases have is its own."""
        return plain(column, self.place)

    @cached_property
    def geometry(self) -> BistaticGeometry:
        """Its geometry."""
        return self.mission.geometry

    @cached_property
    def allocation(self) -> Allocation:
        """Its budgets as divided."""
        allocation = self.analysis.allocation
        return allocation if self.analysis.is_by_itself else allocation.of(self.place)

    @cached_property
    def random(self) -> list[RandomError]:
        """Its errors of sensors and clocks, in the order of the analysis."""
        if self.analysis.is_by_itself:
            return self.analysis.random
        return [in_one_case(self.mission, error, self.place) for error in self.analysis.random]

    def does(self, model: Model, source: ErrorSource) -> Declared:
        """Effect of a declared error by a model."""
        return self.analysis.errors.does(model.name, source).in_one_case(self.place)

    def degeneracy(self, model: str) -> Note:
        """Why a model has no displacement here; nothing where it has one."""
        return self.analysis.errors.degeneracy(model, self.place)
