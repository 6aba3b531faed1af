"""Phases at the edge of the scene in many cases: the arrays beside `ScenePhases` of `analysis.scene`."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.analysis import scene as scalar
from bisar_budget.arrays.climbing import HeightAt, Heights, Places, Tops, climbed, joined, tops
from bisar_budget.constants import MIN_GROUND_GRADIENT
from bisar_budget.effects.combined import combined_phase, correlated_errors
from bisar_budget.effects.declared import DeclaredErrors
from bisar_budget.ranges.exact_ranges import ExactRanges, Floats
from bisar_budget.ranges.point_paths import PointPaths


class RimPlaces(NamedTuple):
    """Places of scenes, one a case: phases of each error, (errors, cases), and as `RimPlace`. [rad]"""

    phases: Floats
    size: Floats
    clearances: Floats  # (2, cases)


class Rims(NamedTuple):
    """Circles about centres, one a case: phases around, (points, errors, cases), and as `Rim`. [rad]"""

    azimuth: Floats
    difference: Floats
    phases: Floats
    worst: Floats


class ManyScenePhases:
    """Quadratic phases of the declared errors at any points of the scene; as `ScenePhases`.

    Rows of arrays are errors, in the order of `members`, columns cases.
    """

    def __init__(self, errors: DeclaredErrors) -> None:
        self.errors, self.exact, self.combine = errors, errors.exact, errors.mission.allocation.combine
        self.groups = correlated_errors(errors.mission)
        self.members = [error for error in errors.stated if error.is_motion]
        self.lanes = [errors.lanes(error) for error in self.members]
        self.sizes: Floats = np.array([errors.array(error.declared) for error in self.members])
        of_all = zip(self.members, self.sizes, strict=True)
        self.centre: Floats = np.array([errors.array(error.full.qpe * size) for error, size in of_all])
        self.is_large = np.array([errors.is_large(error) for error in self.members])
        slant_ranges = (path.slant_range for path in (errors.geometries.transmitter, errors.geometries.receiver))
        self.nearest = errors.array(np.minimum(*slant_ranges))
        self.turn = np.copysign(1.0, self.exact.sine)

    def ranges_at(self, radius: Floats, azimuth: Floats, of: Places) -> ExactRanges:
        """Exact ranges of points of the ground in the cases `of`."""
        return self.exact.at(radius * np.cos(azimuth), radius * np.sin(azimuth), of)

    def place(self, radius: Floats, azimuth: Floats, of: Places) -> RimPlaces:
        """What there is at points of the ground."""
        return self.place_of(self.ranges_at(radius, azimuth, of), of)

    def place_of(self, there: ExactRanges, of: Places) -> RimPlaces:
        """What there is where exact ranges are taken."""
        per_unit = there.quadratics_of([lanes.there(of) for lanes in self.lanes])
        phases = np.array(per_unit) * self.sizes[:, of]
        clearances = np.array(
            [self.turn[of] * there.sine / scalar.MIN_SINE, there.range_gradient / MIN_GROUND_GRADIENT]
        )
        is_nowhere = (there.nearest < scalar.NEAREST_M) | ~np.isfinite(phases.sum(axis=0) + clearances.sum(axis=0))
        phases = np.where(is_nowhere, self.centre[:, of], phases)
        return RimPlaces(phases, self.differs(phases, of), np.where(is_nowhere, 0.0, clearances))

    def differs(self, phases: Floats, of: Places) -> Floats:
        """Differences of phases to the centre's, combined. [rad]"""
        return self.together(phases - self.centre[:, of], of)

    def together(self, phases: Floats, of: Places, indices: Sequence[int] | None = None) -> Floats:
        """Phases of the errors, or of some of them, combined; those of a covariance with their correlations. [rad]"""
        chosen = range(len(self.members)) if indices is None else indices
        groups = [group.of(of) for group in self.groups]
        one = combined_phase([(self.members[i].subject.id, phases[i]) for i in chosen], self.combine, groups)
        return np.asarray(np.broadcast_to(one, of.shape))

    def differences(
        self, radius: Floats, azimuth: Floats, of: Places, exact: NDArray[np.bool_], turns: Floats | None = None
    ) -> Floats:
        """Of each error, its phase there less that at the centre; by the worse sign of those taken exactly. [rad]

        `exact` says which those are, (errors, of). `turns` is lowered to what gradients span where each of these
        leads, over what they span without it.
        """
        there = self.ranges_at(radius, azimuth, of)
        found = self.place_of(there, of).phases - self.centre[:, of]
        for i, error in enumerate(self.members):
            some = np.flatnonzero(exact[i])
            if not some.size:
                continue
            size, worst = np.abs(self.sizes[i, of]), np.zeros(some.size)
            for sign, here in zip((1.0, -1.0), self.errors.quadratic_by_sign(error), strict=True):
                lanes = self.errors.lanes(error, sign).there(of)
                per_unit = np.array(there.displacement(there.effect(there.range_error(lanes)), 1.0))
                path = PointPaths(there, lanes, per_unit)
                path.to(some, size[some])
                away = path.known(some, size[some])
                is_gone, differs = np.isnan(away[0]), np.abs(away[3] - here[of[some]])
                worst = np.maximum(worst, np.where(np.isnan(differs), math.inf, differs))
                if turns is not None:
                    turns[some] = np.minimum(turns[some], np.where(is_gone, 0.0, away[5]))
            found[i, some] = np.copysign(worst, found[i, some])
        return found

    def rim(self, radius: Floats, of: Places, count: int) -> Rims:
        """Evaluate circles of the cases `of` evenly, at `count` points, and around their worst point; as `rim`."""
        around = [self.place(radius, np.full(of.size, 2 * math.pi * k / count), of) for k in range(count)]
        sizes = np.array([place.size for place in around])
        clearances = np.array([place.clearances for place in around])
        phases = np.array([place.phases for place in around])

        def size_at(azimuth: Floats, some: Places) -> Floats:
            return self.place(radius[some], azimuth, of[some]).size

        narrow = joined([self._nearest_to_none(radius, of, clearances[:, which], which) for which in (0, 1)])
        nearest = narrow.highest(of.size)
        has_image = nearest.height < -1
        some = np.flatnonzero(has_image)
        of_sizes = tops(sizes[:, some], lambda azimuth, which: size_at(azimuth, some[which]), rough=scalar.ROUGH)
        climbers = np.flatnonzero(has_image[narrow.cases])
        of_narrow = self._beside(size_at, narrow.cases[climbers], narrow.top.azimuth[climbers], count)
        top = joined([Tops(some[of_sizes.cases], of_sizes.top), of_narrow]).highest(of.size)
        top = nearest.where(has_image, top)
        worst = self.place(radius, top.azimuth, of).phases
        difference = np.where(has_image, top.height, math.inf)
        return Rims(top.azimuth % (2 * math.pi), difference, phases, worst)

    def _nearest_to_none(self, radius: Floats, of: Places, clearances: Floats, which: int) -> Tops:
        """Climb to where a clearance is least, if it comes near to 1."""

        def nearness_at(azimuth: Floats, some: Places) -> Floats:
            return np.asarray(-self.place(radius[some], azimuth, of[some]).clearances[which])

        return tops(-clearances, nearness_at, -scalar.NARROW)

    @staticmethod
    def _beside(size_at: HeightAt, cases: Places, azimuth: Floats, count: int) -> Tops:
        """Climb in the arc around places that points of a circle may miss."""
        arc = math.pi / count / 8
        sides = (size_at(azimuth - arc, cases), size_at(azimuth + arc, cases))
        return Tops(cases, climbed(size_at, cases, sides, Heights(size_at(azimuth, cases), azimuth), arc))
