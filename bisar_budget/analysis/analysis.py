"""Analysis shared by the checks of a mission: geometry, every possible error, and its effects in both models.

Cases of the same structure are analysed together. `Case` gives plain numbers of a single case for the text of a
report.
"""

import math
from collections.abc import Iterator, Mapping
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bisar_budget.analysis.allocation import Allocation, allocate, autofocus_gain_of
from bisar_budget.analysis.peak_loss import peak_loss_db
from bisar_budget.analysis.spread import SpreadPhase, rests, tones
from bisar_budget.analysis.together import Together
from bisar_budget.analysis.tone_displacement import tone_displacements
from bisar_budget.arrays import Floats, PerCase, PerCaseFlag
from bisar_budget.effects.combined import correlated_errors
from bisar_budget.effects.declared import MODELS, Declared, DeclaredErrors, Model
from bisar_budget.effects.effect import ErrorSource, Subject, plain
from bisar_budget.effects.random_effect import RandomError
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
    """Group the cases of a mission that need the same number of quadrature nodes over the aperture.

    Yields for each group the number of nodes, the indices of its cases, and their mission and geometry.
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
    """Analysis of the cases of one mission. A mission as loaded from its file is one case.

    Parameters
    ----------
    mission : Mission
        Some of its numbers may be arrays (cases,).
    cases : int
        Number of cases.
    geometry : BistaticGeometry, optional
        Geometry of many cases; omitted: the geometry of a single mission.
    nodes : int, optional
        Number of nodes of the aperture that all cases need.
    shown : mapping of str to Subject, optional
        Ids of rows whose allowable is needed although the file declares no error; omitted: all rows.
    is_complete : bool
        Compute all numbers of each row, not only those that decide. The results of a case then do not depend on the
        number of cases.
    is_of_sums : bool
        Compute only the sums of errors. An error that counts in a sum then needs no allowable of its own.

    Attributes
    ----------
    exact : ExactRanges
        Exact range histories of all cases at the nodes of the aperture.
    errors : DeclaredErrors
        Listed errors of the cases, with their effects: the declared errors and the errors in `shown`, or all errors
        that the cases can have.
    random : list of RandomError
        Errors of sensors, clocks and the air that the mission names; empty if it names none.
    tones : list of Tone
        Tones that make paired echoes: declared vibrations from one cycle per aperture on, and spurs.
    slow_tones : dict of str to SlowTone
        Declared vibrations below three cycles per aperture; the keys are the ids of their rows.
    slow : list of DeclaredPhase
        Phases of the declared vibrations below one cycle per aperture.
    displacing_tones : list of ToneDisplacement
        Displacement of the image by each vibration and each tone of an oscillator, slow or fast.
    groups : tuple of Correlated
        Covariances that the mission declares for the errors of its platforms.
    gates : list of str
        Names of the gating models, which are those whose limits the mission must meet. There is one name, or both
        names if the stricter model decides.
    published, full : Model
        The published model, Tables I and II and (25), which has no direct path; and the full model.
    allocation : Allocation
        Budgets of the cases, divided between the owners. A `balanced` division is in proportion to the phases in the
        gating model, or under `strictest` to the larger of the phases in both models.
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
        self._rests: dict[str, list[SpreadPhase]] = {}

    def together(self, model: str) -> Together:
        """Declared errors combined in a model."""
        return self._together[model]

    def rests(self, model: str) -> list[SpreadPhase]:
        """Phases beyond the cubic in a model; see `spread.rests`."""
        if model not in self._rests:
            self._rests[model] = rests(self, model)
        return self._rests[model]

    def models(self, gating: str) -> tuple[Model, Model]:
        """The gating model and the other model, given the name of the gating model, `published` or `full`."""
        return (self.full, self.published) if gating == "full" else (self.published, self.full)

    # ---------------------------------------------------------------- what only some questions need
    @cached_property
    def resolution(self) -> Resolution:
        """Widths of the impulse response without errors, (cases,)."""
        return resolution(self.exact, self.geometry, self.mission.radar, self.mission.collection.aperture_time)

    @cached_property
    def peak_loss_db(self) -> Floats:
        """Loss of the image peak due to all declared errors, (cases,). [dB]"""
        return peak_loss_db(self)

    @cached_property
    def sources(self) -> list[ErrorSource]:
        """Errors of a single case in plain numbers, in the order that the contract defines."""
        return [error.in_one_case() for error in self.errors.listed]

    @cached_property
    def stated(self) -> list[ErrorSource]:
        """Declared errors along the axes in which the file states them."""
        return [source for source in self.sources if source.declared is not None and source.is_independent]


class Case:
    """One of the cases of an analysis.

    Parameters
    ----------
    analysis : Analysis
        Analysis of the cases.
    mission : Mission, optional
        Mission of this case, as loaded; omitted: the analysed mission, which is the only case.
    place : int
        Index of this case.
    """

    def __init__(self, analysis: Analysis, mission: Mission | None = None, place: int = 0) -> None:
        self.analysis, self.mission, self.place = analysis, mission or analysis.mission, place

    def number(self, column: PerCase | PerCaseFlag) -> float:
        """Return the number of this case from an array (cases,), or from a single number that holds for all cases."""
        return plain(column, self.place)

    @cached_property
    def geometry(self) -> BistaticGeometry:
        """Geometry of this case."""
        return self.analysis.geometry if self.analysis.is_by_itself else self.mission.geometry

    @cached_property
    def resolution(self) -> Resolution:
        """Widths of the impulse response without errors in this case."""
        return Resolution._make(map(self.number, self.analysis.resolution))

    @cached_property
    def peak_loss_db(self) -> float | None:
        """Loss of this case's peak due to all declared errors; None without an image or declared error. [dB]"""
        loss = self.number(self.analysis.peak_loss_db)
        return loss if math.isfinite(loss) else None

    @cached_property
    def allocation(self) -> Allocation:
        """Budgets of this case, divided between the owners."""
        allocation = self.analysis.allocation
        return allocation if self.analysis.is_by_itself else allocation.of(self.place)

    @cached_property
    def random(self) -> list[RandomError]:
        """Random errors of sensors, clocks and the air in this case, in the order of the analysis."""
        if self.analysis.is_by_itself:
            return self.analysis.random
        return [in_one_case(self.mission, error, self.place) for error in self.analysis.random]

    def does(self, model: Model, source: ErrorSource) -> Declared:
        """Phases and displacements of a declared error in a model, in this case."""
        return self.analysis.errors.does(model.name, source).in_one_case(self.place)

    def moved_by_tone(self, row_subject: Subject, model: str) -> GroundVector | None:
        """Displacement of the image, east and north, by the tone of a row in the model of the given name. [m]

        Each component is that for the worst phase of the tone. None if the row has no tone or the model has no
        displacement.
        """
        for tone in self.analysis.displacing_tones:
            if tone.subject.id == row_subject.id:
                east, north = map(self.number, tone.by(model))
                return None if math.isnan(east) else (east, north)
        return None

    def degeneracy(self, model: str) -> Note:
        """Note on why the image has no displacement in a model in this case; empty if it has one."""
        return self.analysis.errors.degeneracy(model, self.place)
