"""Analysis of a mission for the checks: its geometry, its errors, and their effects in the two models.

A case is a mission in which each number has a single value. Cases whose mission files have the same structure are
analysed together, in arrays (cases,). `Case` provides the results of a single case as plain numbers, for the text of
a report.
"""

import math
from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from bisar_budget.analysis.allocation import allocate, autofocus_gain_of
from bisar_budget.analysis.spread import SpreadPhase, noise, rests, tones
from bisar_budget.analysis.together import Together
from bisar_budget.analysis.tone_displacement import tone_displacements
from bisar_budget.arrays import PerCase, PerCaseFlag
from bisar_budget.effects.combined import correlated_errors
from bisar_budget.effects.declared import MODELS, Declared, DeclaredErrors, Model
from bisar_budget.effects.effect import ErrorSource, Subject, plain
from bisar_budget.effects.random_errors import in_one_case, random_errors
from bisar_budget.effects.slow_tones import slow_phases, slow_tones
from bisar_budget.effects.sources import exact_ranges
from bisar_budget.geometry import BistaticGeometry, GroundVector
from bisar_budget.image_plane import nodes_for
from bisar_budget.mission.model import Mission, has_random_errors
from bisar_budget.mission.stacked import picked
from bisar_budget.phrases import Note
from bisar_budget.ranges.resolution import Resolution, resolution

__all__ = ["Analysis", "Case", "Model", "by_nodes"]


def by_nodes(
    mission: Mission, cases: int, geometry: BistaticGeometry
) -> Iterator[tuple[int, NDArray[np.intp], Mission, BistaticGeometry]]:
    """Group the cases of a mission by the number of quadrature nodes that they need over the aperture.

    Yields a tuple for each group. It contains the number of nodes, the indices of the cases in the group, the mission
    reduced to these cases, and the geometry of these cases.
    """
    T = np.broadcast_to(mission.collection.aperture_time, (cases,))
    counts = np.broadcast_to(nodes_for(geometry, T, has_direct_path=mission.has_direct_path), (cases,))
    for nodes in np.unique(counts).tolist():
        same_nodes = np.flatnonzero(counts == nodes)
        if same_nodes.size == cases:
            yield nodes, same_nodes, mission, geometry
        else:
            mission_of_nodes = picked(mission, same_nodes)
            yield nodes, same_nodes, mission_of_nodes, mission_of_nodes.geometry


class Analysis:
    """Errors and budgets of a mission in one or many cases.

    A mission as loaded from its file is a single case.

    Parameters
    ----------
    mission : Mission
        Mission to analyse. Some of its numbers may be arrays (cases,).
    cases : int
        Number of cases.
    geometry : BistaticGeometry, optional
        Geometry of the cases. If omitted, there is a single case with the geometry of the mission.
    nodes : int, optional
        Number of quadrature nodes over the aperture, the same for all cases. If omitted, it follows from the
        geometry.
    shown : mapping of str to Subject, optional
        Rows of the report whose allowable is needed even if the file declares no error for them. The keys are the ids
        of the rows. If omitted, all rows are included.
    is_complete : bool
        Compute all numbers of each row, not only the numbers that decide the result. The results of a case then do
        not depend on how many cases are analysed together.
    is_of_sums : bool
        Judge only the combined errors, and omit the allowables of the single errors. Ignored under the rule `each`.

    Attributes
    ----------
    exact : ExactRanges
        Exact range histories of all cases at the nodes of the aperture.
    errors : DeclaredErrors
        Declared errors and the errors of the rows in `shown`, with their effects. If `shown` is omitted, these are
        all errors that the cases can have.
    random : list of RandomError
        Errors of sensors, clocks and the air, as described in the mission file. The list may be empty.
    tones : list of Tone
        Tones that make paired echoes. They are vibrations of at least one cycle per aperture, tones of vibrating
        oscillators, and spurs.
    slow_tones : dict of str to SlowTone
        Declared vibrations below three cycles per aperture. The keys are the ids of their rows.
    slow : list of DeclaredPhase
        Phases of the declared vibrations below one cycle per aperture.
    displacing_tones : list of ToneDisplacement
        Displacement of the image by each vibration and each tone of an oscillator, at any frequency.
    groups : tuple of Correlated
        Covariances that the mission declares for the errors of its platforms.
    gates : list of str
        Names of the gating models, which are the models whose verdicts count. The list contains both models if the
        stricter verdict decides, otherwise a single name.
    published, full : Model
        Effects of the errors in each model. The published model follows Tables I and II and equation (25) of Rigling
        & Moses, and does not include the direct path. The full model follows from exact ranges.
    allocation : Allocation
        Budgets of the cases, divided between transmitter, receiver and clock. The split `balanced` divides in
        proportion to the phases in the model whose verdict counts. If the verdicts of both models count, it uses the
        larger of the two phases.
    noise : dict of str to list of SpreadPhase
        Phase errors due to noise, see `spread.noise`. The keys are the names of the models.
    rests : dict of str to list of SpreadPhase
        For each declared error, the part of its phase beyond the cubic order, see `spread.rests`. The keys are the
        names of the models. The published model has no such parts.
    resolution : Resolution
        Widths of the error-free impulse response, as arrays (cases,).
    """

    def __init__(
        self,
        mission: Mission,
        cases: int = 1,
        *,
        geometry: BistaticGeometry | None = None,
        nodes: int | None = None,
        shown: Mapping[str, Subject] | None = None,
        is_complete: bool = False,
        is_of_sums: bool = False,
    ) -> None:
        self.mission, self.cases, self.nodes, self.shown = mission, cases, nodes, shown
        self.is_of_sums = is_of_sums and mission.allocation.combine != "each"
        self.is_by_itself, self.is_complete = geometry is None, is_complete
        self.geometry = mission.geometry if geometry is None else geometry
        gain = autofocus_gain_of(mission)
        with np.errstate(all="ignore"):
            self.exact = exact_ranges(mission, self.geometry, nodes, cases)
            self.errors = DeclaredErrors(
                mission, cases, self.geometry, self.exact, shown, gain=gain, is_complete=is_complete
            )
            self.random = random_errors(mission, geometry, cases) if has_random_errors(mission) else []
            self.tones = tones(mission, self.geometry)
            self.slow_tones = slow_tones(mission, self.geometry, cases)
            self.slow = slow_phases(mission, self.slow_tones, gain)
            self.displacing_tones = tone_displacements(mission, self.geometry, self.exact)
            self.groups = correlated_errors(mission)
            self._together = {
                model: Together(self.errors, model, self.slow, self.displacing_tones, self.random, self.groups)
                for model in MODELS
            }
            self.gates = [model for model in MODELS if mission.gating_model in (model, "strictest")]
            self.allocation = allocate(mission, (self._together[model] for model in self.gates))
            self.published, self.full = Model(self.errors, "published"), Model(self.errors, "full")
            self.noise = {model: noise(mission, self.geometry, self.random, model) for model in MODELS}
            self.rests: dict[str, list[SpreadPhase]] = {
                "published": [],
                "full": rests(self.errors, self.random, self.slow, self.slow_tones),
            }
            self.resolution = resolution(self.exact, self.geometry, mission.radar, mission.collection.aperture_time)

    def together(self, model: str) -> Together:
        """Return the declared errors and their combination in the given model.

        `model` is `published` or `full`.
        """
        return self._together[model]

    def models(self, gating: str) -> tuple[Model, Model]:
        """Return both models, starting with the model whose verdict counts.

        `gating` is the name of the gating model, whose verdict counts: `published` or `full`.
        """
        return (self.full, self.published) if gating == "full" else (self.published, self.full)

    # ---------------------------------------------------------------- a single case
    @property
    def sources(self) -> list[ErrorSource]:
        """List the errors of a single-case analysis in the order of the rows in the report.

        The sizes and effects of the errors are single numbers instead of arrays.
        """
        return [error.in_one_case() for error in self.errors.listed]

    @property
    def stated(self) -> list[ErrorSource]:
        """List the declared errors of a single case along the axes in which the mission file states them."""
        return [source for source in self.sources if source.declared is not None and source.is_independent]


class Case:
    """Results of an analysis for one of its cases, as single numbers instead of arrays.

    Parameters
    ----------
    analysis : Analysis
        Analysis of one or many cases.
    mission : Mission, optional
        Mission of this case, as loaded from its file. If omitted, it is the mission of the analysis, which then has
        only this case.
    place : int
        Index of this case in the arrays of the analysis.

    Attributes
    ----------
    geometry : BistaticGeometry
        Geometry of this case.
    resolution : Resolution
        Widths of the error-free impulse response in this case.
    allocation : Allocation
        Budgets of this case, divided between transmitter, receiver and clock.
    random : list of RandomError
        Random errors of sensors, clocks and the air in this case, in the same order as in `Analysis.random`.
    """

    def __init__(self, analysis: Analysis, mission: Mission | None = None, place: int = 0) -> None:
        self.analysis, self.mission, self.place = analysis, mission or analysis.mission, place
        self.resolution = Resolution._make(map(self.number, analysis.resolution))
        if analysis.is_by_itself:
            self.geometry, self.allocation, self.random = analysis.geometry, analysis.allocation, analysis.random
        else:
            self.geometry, self.allocation = self.mission.geometry, analysis.allocation.of(place)
            self.random = [in_one_case(self.mission, error, place) for error in analysis.random]

    def number(self, column: PerCase | PerCaseFlag) -> float:
        """Return the value for this case from an array (cases,); a single number holds for all cases."""
        return plain(column, self.place)

    def does(self, model: Model, source: ErrorSource) -> Declared:
        """Return the phases and the displacement that a model gives for a declared error in this case."""
        return self.analysis.errors.does(model.name, source).in_one_case(self.place)

    def judged(self, model: Model, source: ErrorSource) -> Declared:
        """Return the effects that a model gives for an error at the sizes that requirements judge, in this case."""
        return self.analysis.errors.judged(model.name, source).in_one_case(self.place)

    def moved_by_tone(self, row_subject: Subject, model: str) -> GroundVector | None:
        """Displacement of the image, east and north, that a model gives for the tone of a row. [m]

        Each component is given for the phase of the tone at which it is largest. `model` is `published` or `full`.
        The result is None if the row has no tone, or if the model gives no displacement, for example because the
        matrix Q of equation (25) in Rigling & Moses is singular.
        """
        for tone in self.analysis.displacing_tones:
            if tone.subject.id == row_subject.id:
                east, north = map(self.number, tone.by(model))
                return None if math.isnan(east) else (east, north)
        return None

    def degeneracy(self, model: str) -> Note:
        """Return a note with the reason why a model gives no displacements in this case.

        The note is empty if the model gives displacements.
        """
        return self.analysis.errors.degeneracy(model, self.place)
