"""What the edge of the scene adds in many cases: the arrays beside `scene_edge` of `analysis.scene`."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.analysis import scene as scalar
from bisar_budget.arrays.climbing import Heights, Places, crest
from bisar_budget.arrays.rim import ManyScenePhases, Rims
from bisar_budget.budget.judged_rows import BOUND
from bisar_budget.ranges.exact_ranges import Floats


class HeldTogether(NamedTuple):
    """Errors, by their places among the members, whose phase is held to a limit, (cases,). [rad]"""

    indices: Sequence[int]
    limit: Floats


class ManySceneEdges(NamedTuple):
    """As `SceneEdge`: the difference, infinite where there is no image; whether an error is over its limit there."""

    difference: Floats
    has_doubt: NDArray[np.bool_]


def many_scene_edges(phases: ManyScenePhases, held: Sequence[HeldTogether]) -> ManySceneEdges:
    """Evaluate the errors of many cases at the edge of their scenes; as `scene_edge`, without the radius served."""
    errors = phases.errors
    radius = errors.array(errors.mission.scene.radius)
    found = ManySceneEdges(np.full(errors.cases, math.inf), np.zeros(errors.cases, dtype=bool))
    is_wide = radius > scalar.WIDE * phases.nearest
    for count, of in ((scalar.RIM_POINTS, ~is_wide), (2 * scalar.RIM_POINTS, is_wide)):
        cases = np.flatnonzero(of & ~errors.is_left_out)
        if not cases.size:
            continue
        rim = phases.rim(radius[cases], cases, count)
        found.difference[cases] = _largest(phases, radius[cases], cases, rim)
        found.has_doubt[cases] = _is_over_at_the_edge(phases, cases, rim, held)
    return found


def _largest(phases: ManyScenePhases, radius: Floats, of: Places, rim: Rims) -> Floats:
    """Largest difference on circles, errors of any size counted; as `largest`. [rad]"""
    found = rim.difference.copy()
    some = np.flatnonzero(np.isfinite(found) & phases.is_large[:, of].any(axis=0))
    if some.size:
        large = phases.is_large[:, of[some]]
        climb = _Climb(phases, radius[some], of[some], rim.azimuth[some], rim.difference[some])
        azimuth = climb.azimuth(climb.bent(large))
        found[some] = phases.together(phases.differences(radius[some], azimuth, of[some], large), of[some])
    return found


class _Climb:
    """Where differences are largest, some errors taken exactly; as `_climbed` and `_bent` of `ScenePhases`."""

    def __init__(
        self, phases: ManyScenePhases, radius: Floats, of: Places, azimuth: Floats, difference: Floats
    ) -> None:
        self.phases, self.radius, self.of, self.start, self.difference = phases, radius, of, azimuth, difference
        self.lowest = Heights(np.full(of.size, -math.inf), np.zeros(of.size))  # of turns with the other sign

    def bent(self, large: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Which of the large errors differ otherwise than small ones do, (errors, cases)."""
        found = np.zeros_like(large)
        floor = np.maximum(scalar.FLOOR_RAD, scalar.SHARE * self.difference)
        for third in range(scalar.PROBES):
            azimuth = self.start + 2 * math.pi * third / scalar.PROBES
            small, exact = (
                self.phases.differences(self.radius, azimuth, self.of, which) for which in (large & False, large)
            )
            found |= large & ~(np.abs(exact - small) <= floor)
        return found

    def azimuth(self, bent: NDArray[np.bool_]) -> Floats:
        """Azimuths of the largest differences, or of places without an image; of none bent, where they start."""
        found = self.start.copy()
        some = np.flatnonzero(bent.any(axis=0))
        if some.size:
            places = [self.start[some], *(np.full(some.size, 2 * _ARC * k) for k in range(scalar.RIM_POINTS))]
            top = self._look(bent, some, places[0])
            for place in places[1:]:
                top = top.or_higher(self._look(bent, some, place))
            top = self._to_the_fold(bent, some, self._to_the_top(bent, some, top))
            found[some] = top.azimuth % (2 * math.pi)
        return found

    def _look(self, bent: NDArray[np.bool_], some: Places, azimuth: Floats) -> Heights:
        """Sizes at azimuths of some cases; the least turns there are kept in mind."""
        turns = np.full(some.size, math.inf)
        of = self.of[some]
        sizes = self.phases.differences(self.radius[some], azimuth, of, bent[:, some], turns)
        lower = self.lowest.of(some)
        is_lower = (-turns > lower.height) | ((-turns == lower.height) & (azimuth < lower.azimuth))
        self.lowest.height[some] = np.where(is_lower, -turns, lower.height)
        self.lowest.azimuth[some] = np.where(is_lower, azimuth, lower.azimuth)
        return Heights(self.phases.together(sizes, of), azimuth)

    def _sides(self, bent: NDArray[np.bool_], some: Places, middle: Floats, arc: Floats) -> list[Heights]:
        return [self._look(bent, some, middle + step) for step in (-arc, arc)]

    def _to_the_top(self, bent: NDArray[np.bool_], some: Places, top: Heights) -> Heights:
        arc = np.full(some.size, _ARC)
        while (going := np.flatnonzero((arc > scalar.FINEST) & np.isfinite(top.height))).size:
            one, other = self._sides(bent, some[going], top.azimuth[going], arc[going])
            side, before = one.or_higher(other), top.of(going)
            is_higher = side.height > before.height
            better = before.where(is_higher, side)
            top.height[going], top.azimuth[going] = better
            arc[going] = np.where(is_higher, arc[going], arc[going] / 4)
        return top

    def _to_the_fold(self, bent: NDArray[np.bool_], some: Places, top: Heights) -> Heights:
        """Look also where gradients are nearest to parallel: there an image may end, on a narrow arc."""
        arc, low = np.full(some.size, _ARC), self.lowest.of(some)

        def goes() -> Places:
            is_near = (-low.height < scalar.MAY_FOLD) & (arc > scalar.FINEST)
            return np.flatnonzero(np.isfinite(top.height) & is_near)

        while (going := goes()).size:
            one, other = self._sides(bent, some[going], low.azimuth[going], arc[going])
            better = top.of(going).or_higher(one).or_higher(other)
            top.height[going], top.azimuth[going] = better
            seen, before = self.lowest.of(some[going]), low.of(going)
            is_lower = seen.height > before.height
            low.height[going], low.azimuth[going] = before.where(is_lower, seen)
            arc[going] = np.where(is_lower, arc[going], arc[going] / 4)
        return top


_ARC = math.pi / scalar.RIM_POINTS


def _is_over_at_the_edge(
    phases: ManyScenePhases, of: Places, rim: Rims, held: Sequence[HeldTogether]
) -> NDArray[np.bool_]:
    """Whether an error is inside its limit at the centre and over it at the edge; as `_over_at_the_edge`."""
    more = np.array([phases.errors.does("full", error).qpe for error in phases.members])[:, of] - phases.centre[:, of]
    found = np.zeros(of.size, dtype=bool)
    for indices, limit_of_all in held:
        limit = limit_of_all[of] * BOUND
        is_inside = phases.together(phases.centre[:, of] + more, of, indices) <= limit
        if not is_inside.any():
            continue
        sizes = np.array([phases.together(there + more, of, indices) for there in rim.phases])
        top = sizes.argmax(axis=0)
        before, middle, after = (
            np.take_along_axis(sizes, (top + step)[None] % len(sizes), axis=0)[0] for step in (-1, 0, 1)
        )
        _, highest = crest(before, after, middle, 2 * math.pi / len(sizes))
        found |= is_inside & (np.maximum(highest, phases.together(rim.worst + more, of, indices)) > limit)
    return found
