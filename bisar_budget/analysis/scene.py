"""Change of the quadratic phase error from the scene centre to the scene's edge, for many cases at once.

In the model of Rigling & Moses, the effects of errors are spatially invariant. In the full model they are not,
because the lines of sight of both platforms at a point p of the scene differ from the lines of sight at the scene
centre. The full model therefore uses the exact ranges to p, not the ranges to the scene centre. An autofocus
correction is a single phase history for the whole image, so it does not remove the difference between the phases at p
and at the centre. The computation is derived here. `tests/simulate/test_scene_edge.py` checks it against exact ranges
and against images at 250 m and 1 km.

The requirement is that this phase difference stays within the total budget without the gain of autofocus. The reason
is that the difference remains after autofocus has corrected an error of any size. Without autofocus, the difference
is the phase that the edge adds to the phase at the centre. The rows of the report refer to the centre. The report
also warns if the phase at the edge exceeds a limit that the phase at the centre meets. This limit includes the
autofocus gain.

In this module, a place is a ground point of the scene in one of the cases. An argument `of` holds the index of the
case for each place. An array with the axis "errors and parts" holds first the errors of motion and clocks, and then
the independent parts of which the random errors are composed (`scene_random`).
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, overload

import numpy as np

from bisar_budget import phrases
from bisar_budget.analysis.scene_random import RandomPhases
from bisar_budget.arrays import Booleans, Floats, Indices, PerCase
from bisar_budget.constants import UTILIZATION_TOLERANCE_FRACTION
from bisar_budget.effects.combined import combined, combined_phase, correlated_errors
from bisar_budget.effects.declared import QUADRATIC, DeclaredErrors
from bisar_budget.effects.random_effect import RandomError
from bisar_budget.geometry import BistaticGeometry, GroundVector
from bisar_budget.image_plane import MIN_SINE, degeneracy
from bisar_budget.mission.model import Mission, Shares
from bisar_budget.phrases import NOTHING, Note
from bisar_budget.ranges.exact_ranges import ExactRanges, Lanes, SmallErrors
from bisar_budget.ranges.point_paths import ROWS, PointPaths
from bisar_budget.units import format_quantity


@dataclass(frozen=True)
class SceneSettings:
    """Numerical settings of the searches for the largest phase difference on circles around the scene centre.

    Attributes
    ----------
    rim_points : int
        Number of evenly spaced points at which a circle is first evaluated.
    wide_fraction : float
        Radius, as a fraction of the shorter slant range, above which a circle has twice as many points.
    nearest_m : float
        Distance between a platform and a ground point below which there is no image. [m]
    crest_fraction : float
        Accuracy at which a search for a maximum ends. The search predicts the maximum as the crest of a cosine. It
        ends when the computed value differs from this crest by at most this fraction of the crest. The azimuth is
        then accurate to a degree.
    crest_error_fraction : float
        Assumed error of a maximum that is predicted from the evenly spaced points, as a fraction of the maximum.
    max_climb_rounds : int
        Largest number of rounds of a search for a maximum. Each round searches a quarter of the previous arc.
    narrow_clearance_ratio : float
        Threshold of the clearance, see `ScenePlaces`. A local minimum of the clearance is searched for only if it is
        expected to lie below this threshold.
    max_radius_fraction : float
        Largest radius to examine when searching for the radius within which one autofocus correction is sufficient,
        as a fraction of the shorter slant range.
    radius_fraction : float
        Tolerance of the radius found by this search, as a fraction of the radius.
    similar_size_fraction : float
        Tolerance of the phase difference, as a fraction of the total budget. A radius found from first-order effects
        is kept if the exact phase difference at this radius deviates from the budget by at most this tolerance.
    max_azimuth_rounds : int
        Largest number of searches for the radius along a single azimuth. If the phase difference on the circle with
        the last radius found is still larger at another azimuth, the search continues with whole circles.
    probe_count : int
        Number of azimuths at which the exact difference of a large error is compared with the first-order difference.
    small_phase_rad, small_phase_fraction : float
        An error counts as small if its exact phase difference deviates from the first-order difference by at most the
        larger of two values: this phase [rad], and this fraction of the largest difference on the circle.
    azimuth_rad : float
        Tolerance δ of the azimuth of a largest difference [rad]. The difference varies as a cosine near its maximum,
        so that an azimuth error of δ makes it too small by the fraction δ²/2.
    folding_fraction : float
        Area ratio, see `ScenePhases.around`, below which the search also looks for places without an image.
    cases_per_block, lanes_per_block : int
        Number of cases, and number of pairs of a large error and a place, in one block of a computation. The arrays
        of a block fit into a processor's cache.
    """

    rim_points: int = 16
    wide_fraction: float = 0.1
    nearest_m: float = 1.0
    crest_fraction: float = 1e-4
    crest_error_fraction: float = 0.1
    max_climb_rounds: int = 5
    narrow_clearance_ratio: float = 10.0
    max_radius_fraction: float = 0.5
    radius_fraction: float = 1e-3
    similar_size_fraction: float = 5e-3
    max_azimuth_rounds: int = 2
    probe_count: int = 3
    small_phase_rad: float = 1e-4
    small_phase_fraction: float = 3e-4
    azimuth_rad: float = 1e-3
    folding_fraction: float = 0.7
    cases_per_block: int = 512
    lanes_per_block: int = 1024


_SCENE = SceneSettings()

_LIMIT_FACTOR = 1 + UTILIZATION_TOLERANCE_FRACTION
_ARC = math.pi / _SCENE.rim_points
_SIDES = np.array([[-1.0], [1.0]])
HeightAt = Callable[
    [Floats, Indices], Floats
]  # values to maximise, at azimuths (n,), for the searches with indices (n,)
SizeAt = Callable[[Floats, Indices], Floats]  # combined differences at radii (n,), for the cases with indices (n,)


@dataclass(frozen=True, slots=True, eq=False)
class ScenePlaces:
    """Quadratic phases of errors at places, their combined difference from the scene centre, and the clearance.

    `phases` (errors and parts, places) [rad] are the quadratic phases of all errors and of the independent parts of
    which random errors are composed. `size` (places,) [rad] is the difference between the phases at the place and at
    the centre, combined over all errors according to the mission's rule (`allocation.combine`).

    A place has an image if its `clearance` (places,) exceeds 1. The bandwidth gives one direction of resolution, and
    the aperture gives a second direction. The clearance is the sine of the angle between these two directions,
    divided by the smallest sine for which there is an image. It is positive at the centre. It is negative if the two
    directions are parallel at some point between the centre and the place. It is 0 at a place that almost coincides
    with a platform.
    """

    phases: Floats
    size: Floats
    clearance: Floats

    @property
    def has_image(self) -> Booleans:
        """Whether an image can be formed at each place, (places,)."""
        return np.asarray(self.clearance > 1)

    @property
    def heights(self) -> Floats:
        """Values whose maxima are searched for on circles around the scene centre, (2, places).

        The first row is the negative of `clearance`, so its maximum is the smallest clearance. The second row is
        `size`.
        """
        return np.array((-self.clearance, self.size))


@dataclass(frozen=True, slots=True, eq=False)
class Rims:
    """Largest phase difference from the scene centre on each of several circles, and its azimuth. [rad]

    `difference` and `azimuth` are (circles,) each. Both are computed as if all errors were small, that is with
    effects proportional to their sizes. If a part of a circle has no image, its difference is infinite. `phases`
    (errors and parts, points, circles) [rad] are the quadratic phases at evenly spaced points of the circles, for all
    errors and for the independent parts of which random errors are composed.
    """

    azimuth: Floats
    difference: Floats
    phases: Floats

    def of(self, indices: Indices) -> "Rims":
        """Select the circles with the given indices."""
        return Rims(self.azimuth[indices], self.difference[indices], self.phases[..., indices])


Selection = int | Booleans | Indices | tuple[Indices, ...]  # of the cases


class Heights(NamedTuple):
    """Values found by a search along circles, and the azimuths [rad] at which they occur.

    The values are, for example, combined phase differences [rad]. If two values are equal, the value with the larger
    azimuth counts as higher.
    """

    height: Floats
    azimuth: Floats

    @property
    def highest(self) -> "Heights":
        """Highest value along the first axis, with its azimuth."""
        height = self.height.max(axis=0)
        return Heights(height, np.where(self.height == height, self.azimuth, -math.inf).max(axis=0))

    def with_others(self, *candidates: "Heights") -> "Heights":
        """Return the element-wise maximum of these values and the candidates, with the azimuth of each maximum."""
        return Heights(*map(np.array, zip(self, *candidates, strict=True))).highest

    def of(self, indices: Selection) -> "Heights":
        """Select the values with the given indices, and their azimuths."""
        return Heights(self.height[indices], self.azimuth[indices])

    def where(self, is_kept: Booleans, replacements: "Heights") -> "Heights":
        """Return these values where `is_kept` is true and `replacements` elsewhere; each value keeps its azimuth."""
        return Heights(*(np.where(is_kept, *both) for both in zip(self, replacements, strict=True)))

    def put(self, indices: Selection, heights: "Heights") -> None:
        """Overwrite the values at the given indices, and their azimuths, with `heights`."""
        self.height[indices], self.azimuth[indices] = heights


class ScenePhases:
    """Quadratic phases of the declared errors at arbitrary ground points of the scenes, for many cases.

    A place is a ground point of the scene in one of the cases. Most arrays have a first axis "errors and parts". It
    holds first the errors of motion and clocks (`members`), then the independent parts of which the random errors are
    composed (`scene_random`).

    The errors have the sizes that the requirement on the quadratic phase judges. Under root-sum-square with a
    confidence, the combination is exact for normal errors without a bias.
    """

    def __init__(self, errors: DeclaredErrors, random: Sequence[RandomError] = ()) -> None:
        self.errors, self.exact, self.combine = errors, errors.exact, errors.mission.allocation.combine
        self.groups = correlated_errors(errors.mission) if self.combine == "rss" else ()
        self.members = [error for error in errors.stated if error.is_motion]
        self.random = RandomPhases(errors, random)
        subjects = [*(error.subject for error in self.members), *self.random.subjects]
        self.ids, self.owners = (
            [getattr(subject, attribute) for subject in subjects] for attribute in ("id", "owner")
        )
        self.small = SmallErrors.of([errors.lanes(error) for error in self.members])
        shape = (len(self.members), errors.cases)
        self.sizes = np.array([errors.judged_size(error, QUADRATIC) for error in self.members]).reshape(shape)
        per_unit = [errors.array(error.full.qpe) for error in self.members]
        self.centre = np.concatenate((np.array(per_unit).reshape(shape) * self.sizes, self.random.centre))
        self.is_large = np.zeros(self.centre.shape, dtype=bool)
        for index, error in enumerate(self.members):
            self.is_large[index] = errors.is_large(error)
        transmitter, receiver = errors.geometries.both
        self.nearest = errors.array(np.minimum(transmitter.slant_range, receiver.slant_range))

    def ranges_at(self, radius: Floats, azimuth: Floats, of: Indices) -> ExactRanges:
        """Compute the exact ranges at ground points given by radius [m] and azimuth [rad] from the scene centre.

        `of` holds the index of the case for each ground point.
        """
        return self.exact.at(*at(radius, azimuth), of)

    def places(self, radius: Floats, azimuth: Floats, of: Indices) -> ScenePlaces:
        """Compute the phases of the errors at ground points and their combined differences from the centre.

        The result also tells whether each ground point has an image. The ground points (places) are given by radius
        [m] and azimuth [rad] from the scene centre. `of` holds the index of the case for each of them. The effects of
        all errors are taken to first order.
        """
        return self.there(self.ranges_at(radius, azimuth, of), of)

    def there(self, there: ExactRanges, of: Indices) -> ScenePlaces:
        """Compute the phases and differences that `places` returns, from exact ranges that are already known.

        `there` gives the exact ranges at the places, and `of` holds the index of the case for each place.
        """
        centre = self.centre.take(of, axis=1)
        phases = self.random.there(there, of)
        if self.members:
            small = there.quadratics_of(self.small.there(of)) * self.sizes.take(of, axis=1)
            phases = np.concatenate((small, phases))
        way = np.copysign(1.0, there.matrix.turned_from(self.exact.matrix, of))
        clearance = way * there.sine / MIN_SINE
        is_nowhere = (there.nearest < _SCENE.nearest_m) | ~np.isfinite(phases.sum(axis=0) + clearance)
        if is_nowhere.any():
            phases, clearance = np.where(is_nowhere, centre, phases), np.where(is_nowhere, 0.0, clearance)
        return ScenePlaces(phases, self.together(phases - centre, of), clearance)

    def together(self, phases: Floats, of: Indices, indices: Sequence[int] | None = None) -> Floats:
        """Combine the phases of several errors at each ground point by the mission's rule, (places,). [rad]

        `phases` (errors and parts, places) are signed; the parts are the independent parts of which random errors are
        composed. `of` holds the index of the case for each place. `indices` selects the errors to combine. If it is
        omitted, all errors are combined. The phases of a covariance are combined according to their correlations.
        """
        phases_of_errors = self.of_errors(phases)
        if indices is None and not self.groups:
            return np.asarray(combined(list(phases_of_errors), self.combine))
        chosen = range(len(self.ids)) if indices is None else indices
        groups = [group.of(of) for group in self.groups]
        total = combined_phase([(self.ids[i], phases_of_errors[i]) for i in chosen], self.combine, groups)
        return np.asarray(np.broadcast_to(total, phases.shape[1:]))

    def of_errors(self, phases: Floats) -> Floats:
        """Combine the parts of each random error, to give one phase for each error. [rad]

        `phases` is (errors and parts, ...), and the result is (errors, ...). The phase of a random error is its
        sigma, computed from the phases of its parts.
        """
        count = len(self.members)
        return np.concatenate((phases[:count], self.random.of_errors(phases[count:])))

    def differences(self, radius: Floats, azimuth: Floats, of: Indices) -> Floats:
        """Phase difference between ground points and the scene centre, for each error and part of an error. [rad]

        The result is (errors and parts, places). The parts are the independent parts of which random errors are
        composed. `of` holds the index of the case for each place. The places are given by radius [m] and azimuth
        [rad] from the centre. For a large error, whose effects are not proportional to its size, the result is the
        exact difference for the worse sign of the error.
        """
        return self.around(radius, azimuth, of, self.is_large.take(of, axis=1))[1]

    def around(self, radius: Floats, azimuth: Floats, of: Indices, exact: Booleans) -> tuple[Floats, Floats, Floats]:
        """Compute phase differences of ground points from the scene centre, and area ratios that show lost images.

        Returns three arrays. The first, (errors and parts, places), holds the first-order phase differences [rad].
        The second [rad], of the same shape, holds the same values, except that the differences of the errors marked
        in `exact` are computed from exact ranges. `exact` is (errors and parts, places). The parts are the
        independent parts of which random errors are composed.

        The third array, (places,), holds the smallest area ratio among the errors marked in `exact`. The range and
        Doppler gradients span an area. The area ratio of an error is the area with the error, at the point to which
        the error moves the image, divided by the area without the error. The ratio is 0 where there is no image. It
        is infinite where no error is marked.
        """
        there = self.ranges_at(radius, azimuth, of)
        small = self.there(there, of).phases - self.centre.take(of, axis=1)
        differences, turns = small.copy(), np.full(of.shape, math.inf)
        error, point = np.nonzero(exact)
        for start in range(0, error.size, _SCENE.lanes_per_block):
            block = slice(start, start + _SCENE.lanes_per_block)
            self._exactly(there, of, error[block], point[block], (differences, turns))
        return small, differences, turns

    def _exactly(
        self, there: ExactRanges, of: Indices, error: Indices, point: Indices, kept: tuple[Floats, Floats]
    ) -> None:
        """Replace first-order phase differences by exact differences, for given pairs of error and place.

        `kept` holds the two arrays to update in place: the phase differences, (errors and parts, places), and the
        smallest area ratios, (places,). The method `around` creates these arrays and explains them.
        `error` and `point` hold the indices of the error and of the place of each pair.
        """
        (differences, turns), case, count = kept, of[point], error.size
        lanes = self._lanes.of((self._rows[:, error] * self.errors.cases + case).reshape(-1))
        lanes = replace(lanes, case=np.tile(point, 2))
        sizes, every = np.tile(np.abs(self.sizes[error, case]), 2), np.arange(2 * count)
        none = np.zeros(2 * count)
        way = np.array(there.way(lanes, none, (none, none)))
        paths = PointPaths(there, lanes, way, is_alike=self.errors.is_complete)
        paths.follow_to(every, sizes)
        reached = paths.known(every, sizes).reshape(len(ROWS), 2, count)
        np.minimum.at(turns, point, np.nan_to_num(reached[-1]).min(axis=0))
        differs = np.abs(reached[3] - self._by_sign[:, error, case])
        worst = np.where(np.isnan(differs), math.inf, differs).max(axis=0)
        differences[error, point] = np.copysign(worst, differences[error, point])

    # The next three are cached: only scenes with a large error need them, and they follow exact ranges.
    @cached_property
    def _rows(self) -> Indices:
        """Index of the block of lanes in `_lanes` for each sign of each large error, (2, errors and parts).

        A lane is one error with one sign in one case. A block holds the lanes of all cases for one error with one
        sign. An error is large if its effects are not proportional to its size. The indices of errors that are not
        large in any case are meaningless.
        """
        lane = np.cumsum(self.is_large.any(axis=1)) - 1
        return np.array((2 * lane, 2 * lane + 1))

    @cached_property
    def _lanes(self) -> Lanes:
        """Lanes of the errors that are large in at least one case, for both signs and for all cases.

        A lane is one error with one sign in one case. The effects of a large error are not proportional to its
        size.
        """
        large = np.flatnonzero(self.is_large.any(axis=1))
        return self.errors.lanes(*(self.members[i] for i in large), signs=(1.0, -1.0))

    @cached_property
    def _by_sign(self) -> Floats:
        """Quadratic phases of the large errors at the scene centre for each sign. [rad]

        The result is (2, errors and parts, cases). It is NaN for errors that are large in no case. An error is large
        if its effects are not proportional to its size.
        """
        phases = np.full((2, *self.is_large.shape), math.nan)
        for i in np.flatnonzero(self.is_large.any(axis=1)):
            phases[:, i] = self.errors.quadratic_by_sign(self.members[i])
        return phases

    @cached_property  # not needed for single points, nor where a part of the edge has no image
    def more(self) -> Floats:
        """Exact quadratic phase at the scene centre minus the first-order phase, (errors and parts, cases). [rad]

        The exact phase is taken for the worse sign of the error. The value is 0 for an error that is not large. An
        error is large if its effects are not proportional to its size.
        """
        exactly = self.centre.copy()
        for index, error in enumerate(self.members):
            exactly[index] = self.errors.judged("full", error).qpe
        return np.where(self.is_large, exactly - self.centre, 0.0)

    # ------------------------------------------------------------------ circles
    def points(self, radius: Floats, of: Indices) -> Indices:
        """Number of evenly spaced points at which circles of given radii [m] must be evaluated, (circles,).

        `of` holds the index of the case for each circle.
        """
        return np.where(radius <= _SCENE.wide_fraction * self.nearest[of], _SCENE.rim_points, 2 * _SCENE.rim_points)

    def rims(self, radius: Floats, of: Indices) -> Rims:
        """Find the largest phase difference from the scene centre on each circle, with first-order effects.

        Each circle is evaluated at evenly spaced points and searched near the points with the largest differences.
        All circles must need the same number of evenly spaced points, see `points`. The difference grows as the
        inverse of the clearance (see `ScenePlaces`). Near a small minimum of the clearance, the largest difference
        may therefore lie on a short arc between two of the points. For this reason the surroundings of such minima
        are searched too.
        """
        count, circles = int(self.points(radius, of)[0]), np.arange(of.size)

        def look(azimuth: Floats, circle: Indices) -> ScenePlaces:
            return self.places(radius[circle], azimuth, of[circle])

        even = look(np.repeat(2 * math.pi * np.arange(count) / count, of.size), np.tile(circles, count))
        clear, tops = _tops(even.heights.reshape(2, count, of.size), lambda *where: look(*where).heights)
        nearest = clear.highest
        has_image = nearest.height < -1
        point, circle = np.nonzero((clear.height > -math.inf) & has_image)
        if point.size:  # the difference may peak near the smallest clearance
            arc, azimuth = math.pi / count / 8, clear.azimuth[point, circle]
            three = np.concatenate((azimuth - arc, azimuth, azimuth + arc))
            before, height, after = look(three, np.tile(circle, 3)).size.reshape(3, -1)
            top = _climbed(
                lambda way, index: look(way, circle[index]).size, (before, after), Heights(height, azimuth), arc
            )
            clear.height[:] = -math.inf
            clear.put((point, circle), top)
            tops = Heights(*(np.concatenate(both) for both in zip(tops, clear, strict=True)))
        top = tops.highest.where(has_image, nearest)
        phases = even.phases.reshape(-1, count, of.size)
        return Rims(top.azimuth % (2 * math.pi), np.where(has_image, top.height, math.inf), phases)


@overload
def at(radius: float, azimuth: float) -> tuple[float, float]: ...
@overload
def at(radius: Floats, azimuth: Floats) -> tuple[Floats, Floats]: ...
def at(radius: PerCase, azimuth: PerCase) -> tuple[PerCase, PerCase]:
    """Return the ground point, east and north [m], at a radius [m] and azimuth [rad] from the scene centre."""
    return radius * np.cos(azimuth), radius * np.sin(azimuth)


# ---------------------------------------------------------------------- climbs
def _tops(heights: Floats, look: Callable[[Floats, Indices], Floats]) -> tuple[Heights, Heights]:
    """Search for the local minima of the clearance and the local maxima of the phase difference on circles.

    `heights` (2, points, circles) are the negative clearances and the sizes at evenly spaced points. The sizes are
    combined phase differences, see `ScenePlaces`. `look` computes both quantities at given azimuths of given circles.
    The function returns the maxima of the negative clearances and the maxima of the sizes, (points, circles) each. A
    value is minus infinity where no search started or where its result is not needed.

    A search may start from each point whose value is at least as high as the values at both neighbours. A minimum of
    the clearance is searched for if it is expected to lie below `narrow_clearance_ratio`. A maximum of the size is
    searched for if it is expected to reach the highest size at the points of its circle, and if all these points have
    an image. The clearance may need several searches on a circle, because its lowest minimum is not always next to
    the point with the lowest clearance.
    """
    arc = 2 * math.pi / heights.shape[1]
    before, after = np.roll(heights, 1, axis=1), np.roll(heights, -1, axis=1)
    _, crests = _crest(before, after, heights, arc)
    most = crests[1] + _SCENE.crest_error_fraction * np.abs(crests[1])
    is_start = heights >= np.maximum(before, after)
    is_start[0] &= crests[0] > -_SCENE.narrow_clearance_ratio
    is_start[1] &= (most >= heights[1].max(axis=0)) & (heights[0] < -1).all(axis=0)
    kind, point, circle = np.nonzero(is_start)
    top = _climbed(
        lambda azimuth, climbers: look(azimuth, circle[climbers])[kind[climbers], np.arange(climbers.size)],
        (before[is_start], after[is_start]),
        Heights(heights[is_start], arc * point),
        arc,
    )
    tops = Heights(np.full(heights.shape, -math.inf), np.zeros(heights.shape))
    tops.put(is_start, top)
    # The result is that of searches one after another, in falling order of the predicted crests.
    order = np.argsort(np.where(is_start[1], -crests[1], math.inf), axis=0, kind="stable")
    climbed, seemed = (np.take_along_axis(values, order, axis=0) for values in (tops.height[1], most))
    is_low = seemed[1:] < np.maximum.accumulate(climbed, axis=0)[:-1]
    climbed[1:][is_low] = -math.inf
    np.put_along_axis(tops.height[1], order, climbed, axis=0)
    return tops.of(0), tops.of(1)


def _climbed(height_at: HeightAt, sides: tuple[Floats, Floats], start: Heights, arc: float) -> Heights:
    """Search for the maximum near each starting point on a circle.

    `start` holds the values and azimuths of the starting points. `sides` are the values at an angle `arc` [rad] on
    both sides of each starting point. They do not exceed the value at the starting point. `height_at` computes values
    at given azimuths. To first order in the radius, a value is a constant plus a cosine of the azimuth. The search
    predicts the crest of this cosine. If the value computed at the crest differs from the prediction, the search is
    repeated on a quarter of the arc.
    """
    best, here, climbers = Heights(*map(np.array, start)), start, np.arange(start.height.size)
    for _ in range(_SCENE.max_climb_rounds):
        if not climbers.size:
            break
        offset, crests = _crest(*sides, here.height, arc)
        azimuth = here.azimuth + offset
        there = Heights(height_at(azimuth, climbers), azimuth)
        best.put(climbers, best.of(climbers).with_others(there))
        going = ~(np.abs(there.height - crests) <= _SCENE.crest_fraction * np.abs(crests))
        climbers, here = climbers[going], here.of(going).with_others(there.of(going))
        if climbers.size:
            arc /= 4
            both = np.array((here.azimuth - arc, here.azimuth + arc))
            around = Heights(height_at(both.reshape(-1), np.tile(climbers, 2)).reshape(2, -1), both)
            best.put(climbers, best.of(climbers).with_others(around.highest))
            sides = (around.height[0], around.height[1])
    return best


def _crest(before: Floats, after: Floats, middle: Floats, arc: float) -> tuple[Floats, Floats]:
    """Find the crest of the cosine through three points of a circle whose azimuths are `arc` [rad] apart.

    Returns two arrays. The first is the azimuth of the crest relative to the middle point, limited to ±`arc` [rad].
    The second is the value at the crest.
    """
    sine = (after - before) / (2 * math.sin(arc))
    cosine = (middle - (after + before) / 2) / (1 - math.cos(arc))
    offset = np.minimum(np.maximum(np.arctan2(sine, cosine), -arc), arc)
    return offset, middle - cosine + np.hypot(sine, cosine)


class _Climb:
    """Search for the largest phase differences from the scene centre on circles, for errors of any size.

    On each circle, the difference is first computed at evenly spaced azimuths, and at the azimuth where it would be
    largest if all errors were small. The search starts from the azimuth with the largest difference.
    """

    def __init__(self, phases: ScenePhases, radius: Floats, of: Indices, rims: Rims) -> None:
        self.phases, self.radius, self.of, self.rims = phases, radius, of, rims
        self.large = phases.is_large.take(of, axis=1)
        self.bent = self._bent()
        self.lowest = Heights(
            np.full(of.size, -math.inf), np.zeros(of.size)
        )  # negative area ratios and negative azimuths

    def largest(self) -> Heights:
        """Find the largest phase difference from the scene centre on each circle, and its azimuth. [rad]

        The difference is infinite if a part of the circle has no image.
        """
        azimuth, bent_circles = self.rims.azimuth.copy(), np.flatnonzero(self.bent.any(axis=0))
        if bent_circles.size:
            azimuth[bent_circles] = self._azimuths(bent_circles) % (2 * math.pi)
        differences = self.phases.differences(self.radius, azimuth, self.of)
        return Heights(self.phases.together(differences, self.of), azimuth)

    def _bent(self) -> Booleans:
        """Mark the large errors whose exact phase differences on a circle deviate from the first-order differences.

        The result is (errors and parts, circles). The parts are the independent parts of which random errors are
        composed. An error is large if its effects are not proportional to its size. The differences are compared at
        three azimuths, which suffice to detect a deviation that consists of two harmonics of the azimuth.
        """
        thirds = self.rims.azimuth + 2 * math.pi * np.arange(_SCENE.probe_count)[:, None] / _SCENE.probe_count
        radius, of, large = (
            np.tile(self.radius, _SCENE.probe_count),
            np.tile(self.of, _SCENE.probe_count),
            np.tile(self.large, _SCENE.probe_count),
        )
        small, exact, _ = self.phases.around(radius, thirds.reshape(-1), of, large)
        floor = np.tile(
            np.maximum(_SCENE.small_phase_rad, _SCENE.small_phase_fraction * self.rims.difference), _SCENE.probe_count
        )
        is_bent = large & ~(np.abs(exact - small) <= floor)
        return np.asarray(is_bent.reshape(len(large), _SCENE.probe_count, -1).any(axis=1))

    def _look(self, circles: Indices, azimuths: Floats) -> Heights:
        """Find, for each circle, the largest combined phase difference among the given azimuths. [rad]

        `azimuths` is (n, circles). The result holds the difference and its azimuth. The method also updates `lowest`,
        which holds the smallest area ratio found so far on each circle, see `ScenePhases.around`.
        """
        count = len(azimuths)
        of, bent = np.tile(self.of[circles], count), np.tile(self.bent[:, circles], count)
        _, differences, turns = self.phases.around(
            np.tile(self.radius[circles], count), azimuths.reshape(-1), of, bent
        )
        seen = Heights(-turns.reshape(count, -1), -azimuths).highest
        self.lowest.put(circles, self.lowest.of(circles).with_others(seen))
        return Heights(self.phases.together(differences, of).reshape(count, -1), azimuths).highest

    def _azimuths(self, circles: Indices) -> Floats:
        """Find the azimuth of the largest difference on each circle, or of a place without an image. [rad]

        The effects of the errors marked in `bent` are computed from exact ranges. A place has no image if the range
        and Doppler gradients are parallel. Such places may lie on a short arc between the examined azimuths. A second
        search therefore runs towards the azimuth at which the gradients are nearest to parallel.
        """
        even = np.broadcast_to(2 * _ARC * np.arange(_SCENE.rim_points)[:, None], (_SCENE.rim_points, circles.size))
        top = self._look(circles, np.concatenate((self.rims.azimuth[circles][None], even)))
        arc = np.full(circles.size, _ARC)
        while (going := np.flatnonzero((arc > _SCENE.azimuth_rad) & np.isfinite(top.height))).size:
            before = top.of(going)
            side = self._look(circles[going], before.azimuth + arc[going] * _SIDES)
            is_higher = side.height > before.height
            top.put(going, side.where(is_higher, before))
            arc[going] = np.where(is_higher, arc[going], arc[going] / 4)
        arc, low = np.full(circles.size, _ARC), self.lowest.of(circles)
        while (
            going := np.flatnonzero(
                (arc > _SCENE.azimuth_rad) & np.isfinite(top.height) & (low.height > -_SCENE.folding_fraction)
            )
        ).size:
            before = low.of(going)
            top.put(
                going, top.of(going).with_others(self._look(circles[going], arc[going] * _SIDES - before.azimuth))
            )
            seen = self.lowest.of(circles[going])
            is_lower = seen.height > before.height
            low.put(going, seen.where(is_lower, before))
            arc[going] = np.where(is_lower, arc[going], arc[going] / 4)
        return top.azimuth


@np.errstate(all="ignore")
def differences_at(
    errors: DeclaredErrors, radius: float, azimuth: float, random: Sequence[RandomError] = ()
) -> list[tuple[str, float]]:
    """List, for each error, the quadratic phase at a ground point minus the phase at the scene centre. [rad]

    Each item is a pair of row id and phase difference. `errors` must have a single case. The ground point is given by
    its radius [m] and azimuth [rad] from the scene centre. Errors of motion and clocks come first, then random
    errors, then slow vibrations. For a random error the difference is a sigma that includes the coverage factor.
    """
    phases = ScenePhases(errors, random)
    differences = phases.of_errors(
        phases.differences(np.array([radius]), np.array([azimuth]), np.zeros(1, dtype=int))
    )
    return list(zip(phases.ids, differences[:, 0].tolist(), strict=True))


# ---------------------------------------------------------------------- edges
@dataclass(frozen=True, slots=True, eq=False)
class SceneEdges:
    """Changes of the quadratic phases from the centres to the edges of the scenes, for many cases.

    `phases` computes the phases at any ground point. `radius` (cases,) [m] is the radius of the scene's edge.

    `rim` holds the largest phase difference from the centre [rad] and the azimuth [rad] where it occurs, computed as
    if all errors were small. `largest` holds the same two quantities, computed for the declared sizes of the errors.
    In both, the errors are combined according to the mission's rule (`allocation.combine`). The differences are
    infinite if a part of the edge has no image.

    `names` are the ids of the errors, or of the sums of errors, that are judged at the edge. `limit` (names, cases)
    [rad] is the limit of their phases. `over` (names, cases) [rad] is the phase at the edge if it exceeds the limit
    although the phase at the centre meets it; otherwise it is 0.
    """

    phases: ScenePhases
    radius: Floats
    rim: Heights
    largest: Heights
    names: Sequence[str]
    limit: Floats
    over: Floats

    @property
    def difference(self) -> Floats:
        """Largest combined phase difference between the edge and the centre of the scene, (cases,). [rad]

        It is infinite if a part of the edge has no image.
        """
        return self.largest.height

    @property
    def has_doubt(self) -> Booleans:
        """Whether an error or a sum of errors exceeds its limit at the edge but not at the centre, (cases,)."""
        return np.asarray((self.over > 0).any(axis=0))


def scene_edges(
    errors: DeclaredErrors, random: Sequence[RandomError], limits: Mapping[str, Floats], split: Shares
) -> SceneEdges | None:
    """Evaluate the quadratic phases of the declared errors at the edges of the scenes, for many cases.

    Returns None if no error is declared.

    Parameters
    ----------
    errors : DeclaredErrors
        Errors of missions that state `scene.radius`.
    random : sequence of RandomError
        Random errors of the same missions. Errors without a declared size are ignored.
    limits : mapping of str to (cases,)
        Limit of the quadratic phase of each owner, autofocus gain included [rad]. An owner is a platform, the clock
        or the whole mission.
    split : Shares
        Division of the budget. It determines which errors count against each limit.
    """
    phases = ScenePhases(errors, random)
    if not phases.ids:
        return None
    owners, radius = phases.owners, errors.array(errors.mission.scene.radius)
    if phases.combine == "each":
        totals = [(name, [i], limits[owner]) for i, (name, owner) in enumerate(zip(phases.ids, owners, strict=True))]
    else:
        totals = [
            (
                f"{owner}.quadratic_phase_error",
                [
                    i
                    for i, contributor in enumerate(owners)
                    if owner == "mission" or split.includes(contributor, owner)
                ],
                limit,
            )
            for owner, limit in limits.items()
        ]
    names, members, limit = zip(*totals, strict=True)
    rim, largest = (Heights(np.full(errors.cases, math.inf), np.zeros(errors.cases)) for _ in range(2))
    edges = SceneEdges(phases, radius, rim, largest, names, np.array(limit), np.zeros((len(totals), errors.cases)))
    counts = phases.points(radius, errors.each)
    for count in (_SCENE.rim_points, 2 * _SCENE.rim_points):
        cases = np.flatnonzero(counts == count)
        for start in range(0, cases.size, _SCENE.cases_per_block):
            _evaluate(edges, members, cases[start : start + _SCENE.cases_per_block])
    return edges


@np.errstate(all="ignore")  # a gradient may vanish, or both gradients may be parallel to the last digit
def _evaluate(edges: SceneEdges, members: Sequence[Sequence[int]], of: Indices) -> None:
    phases = edges.phases
    rims = phases.rims(edges.radius[of], of)
    edges.rim.put(of, Heights(rims.difference, rims.azimuth))
    edges.largest.put(of, _largest(phases, edges.radius[of], of, rims))
    imaged = np.flatnonzero(np.isfinite(edges.difference[of]))
    if imaged.size:
        edges.over[:, of[imaged]] = _over_at_the_edge(edges, members, of[imaged], rims.of(imaged))


def _largest(phases: ScenePhases, radius: Floats, of: Indices, rims: Rims) -> Heights:
    """Find the largest phase difference from the scene centre on each circle, for errors of any size. [rad]

    The result holds the difference and its azimuth. `rims` are the results for small errors on the same circles. `of`
    holds the index of the case for each circle.
    """
    largest = Heights(rims.difference.copy(), rims.azimuth.copy())
    large_circles = np.flatnonzero(np.isfinite(rims.difference) & phases.is_large[:, of].any(axis=0))
    if large_circles.size:
        largest.put(
            large_circles, _Climb(phases, radius[large_circles], of[large_circles], rims.of(large_circles)).largest()
        )
    return largest


def _over_at_the_edge(edges: SceneEdges, members: Sequence[Sequence[int]], of: Indices, rims: Rims) -> Floats:
    """Combined phases that exceed their limits at the scene's edge but not at the centre. [rad]

    The result is (names, n), for the n cases in `of`. Each name is an error or a sum of errors that is judged at the
    edge. An element is 0 if the phase meets its limit at the edge, or exceeds it already at the centre. `members`
    holds, for each name, the indices of the errors that are combined.
    """
    phases, limit = edges.phases, edges.limit[:, of] * _LIMIT_FACTOR
    more = phases.more[:, of]

    def combined_phases(at_points: Floats) -> Floats:
        """Return the phases that are compared with the limits, (names, ...). [rad]

        Under the rule `each` they are the magnitudes of the phases of single errors. Under the other rules they are
        the combined phases of sums of errors. `at_points` holds the phases of all errors, and of the independent
        parts of which random errors are composed, (errors and parts, ...).
        """
        if phases.combine == "each":
            return np.abs(phases.of_errors(at_points))
        return np.array([phases.together(at_points, of, indices) for indices in members])

    around = combined_phases(rims.phases + more[:, None])
    top, count = around.argmax(axis=1)[:, None], around.shape[1]
    before, after, middle = (np.take_along_axis(around, (top + step) % count, axis=1)[:, 0] for step in (-1, 1, 0))
    _, crests = _crest(before, after, middle, 2 * math.pi / count)
    worst = phases.places(edges.radius[of], rims.azimuth, of).phases
    size = np.maximum(crests, combined_phases(worst + more))
    is_over = (combined_phases(phases.centre[:, of] + more) <= limit) & (size > limit)
    return np.where(is_over, size, 0.0)


# ---------------------------------------------------------------------- one correction
class Corrections:
    """Search for the distance from the scene centre within which a single autofocus correction is sufficient.

    Within this distance, the combined phase difference from the centre stays within the budget `total` [rad].

    Attributes
    ----------
    farthest : (cases,)
        Largest radius that the search examines. [m]
    """

    def __init__(self, edges: SceneEdges, total: PerCase) -> None:
        self.edges, self.phases, self.total = edges, edges.phases, edges.phases.errors.array(total)
        self.farthest = np.maximum(_SCENE.max_radius_fraction * self.phases.nearest, edges.radius)

    @cached_property  # a slow search, which a case without an image at the edge does not need
    def served(self) -> Floats:
        """Radius around the scene centre up to which a single autofocus correction is sufficient, (cases,). [m]

        At this radius the largest phase difference from the centre reaches the budget `total`. The radius is infinite
        if the difference stays within the budget up to `farthest`. It is NaN if a part of the scene's edge has no
        image.
        """
        radii = np.full(self.total.shape, math.nan)
        cases = np.flatnonzero(np.isfinite(self.edges.rim.height) & np.isfinite(self.edges.difference))
        with np.errstate(all="ignore"):
            for start in range(0, cases.size, _SCENE.cases_per_block):
                of = cases[start : start + _SCENE.cases_per_block]
                radii[of] = self._served(of)
        return radii

    def _served(self, of: Indices) -> Floats:
        radii, total = self._served_of_small(of), self.total[of]
        high = np.where(np.isinf(radii), self.farthest[of], radii)
        low, below, size = np.zeros(of.size), np.zeros(of.size), np.zeros(of.size)
        searched = np.flatnonzero(self.phases.is_large[:, of].any(axis=0))
        if not searched.size:
            return radii

        def largest(radius: Floats, indices: Indices) -> Floats:
            return self._crests(radius, of[indices], of_small=False).height

        size[searched] = largest(high[searched], searched)
        searched = searched[np.abs(size[searched] - total[searched]) > _SCENE.similar_size_fraction * total[searched]]
        self._grow(largest, of, searched, low, below, high, size)
        over = searched[size[searched] > total[searched]]
        radii[searched] = math.inf
        radii[over] = where(largest, total, over, (low, below), (high, size))
        return radii

    def _served_of_small(self, of: Indices) -> Floats:
        """Find the radii that `served` returns, with the effects of all errors taken to first order. [m]

        The search runs along the azimuth with the largest phase difference at the scene's edge. If the circle with
        the radius found has a larger difference at another azimuth, the search is repeated along that azimuth. After
        `max_azimuth_rounds` searches, the whole circle is evaluated at each radius.
        """
        total, high, radii = self.total[of], self.edges.radius[of], np.full(of.size, math.inf)
        size, azimuth = self.edges.rim.of(of)
        searched = np.flatnonzero(size)

        def along(radius: Floats, indices: Indices) -> Floats:
            there = self.phases.places(radius, azimuth[indices], of[indices])
            return np.where(there.has_image, there.size, math.inf)

        for _ in range(_SCENE.max_azimuth_rounds):
            if not searched.size:
                return radii
            low, inside = np.zeros(of.size), np.zeros(of.size)
            self._grow(along, of, searched, low, inside, high, size)
            over = searched[size[searched] > total[searched]]
            high[over] = where(along, total, over, (low, inside), (high, size))
            around = self._crests(high[searched], of[searched])
            is_inside = around.height <= total[searched] * (1 + _SCENE.radius_fraction)
            done = searched[is_inside]
            radii[done] = np.where(size[done] <= total[done], math.inf, high[done])
            size[searched], azimuth[searched] = around
            searched = searched[~is_inside]

        def rim(radius: Floats, indices: Indices) -> Floats:
            return self._crests(radius, of[indices]).height

        none = np.zeros(of.size)
        radii[searched] = where(rim, total, searched, (none, none), (high, size))
        return radii

    def _grow(
        self, size_at: SizeAt, of: Indices, searched: Indices, low: Floats, below: Floats, high: Floats, size: Floats
    ) -> None:
        """Increase radii until the phase difference exceeds the budget `total`, or until `farthest` is reached.

        `high` are the radii [m], and `size` are the phase differences [rad] at these radii. `low` and `below`
        receive the previous radii and differences. All four arrays are updated in place. `size_at` computes the
        differences, and `searched` selects the cases."""
        total, farthest = self.total[of], self.farthest[of]
        while True:
            searched = searched[(size[searched] <= total[searched]) & (high[searched] < farthest[searched])]
            if not searched.size:
                return
            low[searched], below[searched] = high[searched], size[searched]
            by = np.clip(1.05 * total[searched] / size[searched], 1.05, 4.0)
            high[searched] = np.minimum(farthest[searched], high[searched] * by)
            size[searched] = size_at(high[searched], searched)

    def _crests(self, radius: Floats, of: Indices, *, of_small: bool = True) -> Heights:
        """Find the largest phase difference from the scene centre on each circle, and its azimuth. [rad]

        The circles have the given radii [m], and `of` holds the index of the case for each circle. If `of_small` is
        true, the effects of all errors are taken to first order. Otherwise the effects of large errors are exact. An
        error is large if its effects are not proportional to its size.
        """
        largest, counts = Heights(np.empty(of.size), np.empty(of.size)), self.phases.points(radius, of)
        for count in np.unique(counts):
            circles = np.flatnonzero(counts == count)
            rims = self.phases.rims(radius[circles], of[circles])
            crests = Heights(rims.difference, rims.azimuth)
            largest.put(circles, crests if of_small else _largest(self.phases, radius[circles], of[circles], rims))
        return largest


def where(
    size_at: SizeAt,
    total: Floats,
    searched: Indices,
    inside: tuple[Floats, Floats],
    outside: tuple[Floats, Floats],
) -> Floats:
    """Find the radii up to which phase differences stay within a limit, by the Illinois secant method. [m]

    The radii are accurate to a thousandth (`radius_fraction`). The result is (searched,).

    Parameters
    ----------
    size_at : callable
        Function that returns combined phase differences [rad] for given radii [m] and the indices of their cases.
    total : (n,)
        Limit of the phase differences in each of the n cases. [rad]
    searched : (searched,)
        Indices of the cases to search.
    inside, outside : pairs of (n,)
        Two pairs of radius [m] and phase difference [rad]. At the radius in `inside` the difference is within the
        limit, and at the radius in `outside` it exceeds the limit. The solution lies between the two radii.
    """
    (low, below), (high, above) = ([values[searched].copy() for values in pair] for pair in (inside, outside))
    slack = total[searched] * _SCENE.radius_fraction / 2
    goal = total[searched] - slack
    below, above = below - goal, above - goal
    side = np.zeros(searched.size)  # side of the goal on which the last point was: 1 inside, -1 outside
    going = np.flatnonzero(below <= 0)  # the others are already within the tolerance
    while True:
        going = going[high[going] - low[going] > _SCENE.radius_fraction * high[going]]
        if not going.size:
            return low
        share = np.where(np.isinf(above[going]), 0.5, below[going] / (below[going] - above[going]))
        middle = low[going] + share * (high[going] - low[going])
        over = size_at(middle, searched[going]) - goal[going]
        is_inside = over <= slack[going]
        is_near = is_inside & (over > -slack[going])
        ins, outs = going[is_inside], going[~is_inside]
        low[ins], below[ins] = middle[is_inside], over[is_inside]
        high[outs], above[outs] = middle[~is_inside], over[~is_inside]
        # Illinois step: after two points on one side, halve the value of the other side.
        above[ins] = np.where(side[ins] > 0, above[ins] / 2, above[ins])
        below[outs] = np.where(side[outs] < 0, below[outs] / 2, below[outs])
        side[ins], side[outs] = 1.0, -1.0
        going = going[~is_near]


# ---------------------------------------------------------------------- in words
class SceneEdge(NamedTuple):
    """Largest change of the quadratic phase from the centre to the edge of a mission's scene.

    `radius` [m] is the radius of the edge. `difference` [rad] is the largest change of the phase, combined over all
    errors according to the mission's rule (`allocation.combine`). It occurs at `azimuth` [rad] on the edge.
    `difference` is NaN if a part of the edge has no image, and `degeneracy` then gives the reason.

    Up to `autofocus_radius` [m] the change stays within the total budget. This radius is None if the change stays
    within the budget up to `searched` [m], the largest radius that was examined. `doubt` names an error or a sum of
    errors that exceeds its limit at the edge, but not at the centre. `degeneracy` and `doubt` may be empty.
    """

    radius: float
    difference: float
    azimuth: float
    autofocus_radius: float | None
    searched: float
    degeneracy: Note
    doubt: Note

    @classmethod
    def of(cls, corrections: Corrections, mission: Mission, case: int = 0) -> "SceneEdge":
        """Create the scene edge of one case from the results for many cases.

        `mission` is the mission of this case, and `case` is the index of the case in `corrections`.
        """
        edges = corrections.edges
        (size, rim), (difference, azimuth) = (map(float, heights.of(case)) for heights in (edges.rim, edges.largest))
        radius, nowhere = float(edges.radius[case]), (math.nan, 0.0, None)
        if math.isinf(size):
            reason = phrases.note(
                "no-image-at-the-edge", azimuth_deg=math.degrees(rim), why=_degeneracy(mission, at(radius, rim))
            )
            return cls(
                radius, *nowhere, _SCENE.max_radius_fraction * float(edges.phases.nearest[case]), reason, NOTHING
            )
        searched = float(corrections.farthest[case])
        if math.isinf(difference):
            return cls(radius, *nowhere, searched, phrases.note("no-image"), NOTHING)
        served, doubt, worst = float(corrections.served[case]), NOTHING, int(edges.over[:, case].argmax())
        if edges.over[worst, case]:
            over, limit = float(edges.over[worst, case]), float(edges.limit[worst, case])
            doubt = phrases.note("over-at-the-edge", row_id=edges.names[worst], phase=over, limit=limit)
        within = None if math.isinf(served) else served
        return cls(radius, difference, azimuth, within, searched, NOTHING, doubt)

    def notes(self, total: float) -> tuple[Note, ...]:
        """Return notes on the azimuth of the largest change and on the radius that one autofocus correction covers.

        `total` [rad] is the total budget of the quadratic phase. If there is no change, a single note states this.
        """
        if not self.difference:
            return (phrases.note("same-at-the-edge"),)
        largest = phrases.note("largest-at-the-edge", azimuth_deg=math.degrees(self.azimuth), radius=self.radius)
        return (largest, phrases.note("one-correction-serves", how_far=self.served, total=total))

    @property
    def served(self) -> str:
        """Text on the radius within which a single autofocus correction is sufficient."""
        if self.autofocus_radius is None:
            return f"beyond the scene ({format_quantity(self.searched, 'm', 3, 'down')})"
        return f"up to {format_quantity(self.autofocus_radius, 'm', 3, 'down')} from the centre"


def _degeneracy(mission: Mission, ground_point: GroundVector) -> str:
    """Text that gives the reason why a ground point has no image.

    `ground_point` is the point's position (east, north) [m] relative to the scene centre.
    """
    (east, north), geometry = ground_point, mission.geometry
    transmitter, receiver = (
        replace(state, position=(state.position[0] - east, state.position[1] - north, state.position[2]))
        for state in (geometry.transmitter, geometry.receiver)
    )
    there = BistaticGeometry(transmitter=transmitter, receiver=receiver)
    if min(there.transmitter.slant_range, there.receiver.slant_range) < _SCENE.nearest_m:
        return phrases.note("platform-at-the-edge", distance=_SCENE.nearest_m)
    reason = degeneracy(there, mission.radar, mission.collection.aperture_time)
    return reason or phrases.note("gradients-become-parallel")
