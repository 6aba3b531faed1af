"""Change of the quadratic phase error from the scene centre to the scene's edge, for many cases at once.

The paper's errors are spatially invariant. In the full model they are not: both platforms have other lines of sight
at a point p of the scene than at the scene centre. The exact ranges are therefore computed with p in place of the
scene centre. An autofocus correction is one phase for the whole image, so it does not remove the difference between p
and the centre. Derived here. `tests/simulate/test_scene_edge.py` checks it against exact ranges and against images at
250 m and 1 km.

The requirement is that this difference stays within the total budget without the gain of autofocus, because it
remains after autofocus has corrected an error of any size. Without autofocus, it is the phase that the edge adds to
the phase at the centre, to which the rows of the report refer. The report also warns if the phase at the edge itself
exceeds a limit, autofocus gain included, that the phase at the centre meets.

A place is a ground point of one of the cases. The argument `of` holds the index of the case for each place. The rows
of arrays are the errors of motion and clocks, followed by the parts of the random errors (`scene_random`).
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
from bisar_budget.effects.declared import DeclaredErrors
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
    """Settings of the searches around the scene centre.

    Attributes
    ----------
    rim_points : int
        Number of evenly spaced points on a circle.
    wide_fraction : float
        Radius, as a fraction of the nearest slant range, above which a circle has twice as many points.
    nearest_m : float
        Distance between a platform and a ground point below which there is no image. [m]
    crest_fraction : float
        A search for a maximum ends when the computed value differs from the predicted crest of the cosine by less
        than this fraction of the crest. The azimuth is then accurate to a degree.
    crest_error_fraction : float
        Assumed error of a crest that is predicted from the points of a circle, as a fraction of the crest.
    max_climb_rounds : int
        Largest number of rounds of a search for a maximum. Each round searches a quarter of the previous arc.
    narrow_clearance_ratio : float
        A local minimum of the clearance is searched only if it is expected to be below this value.
    max_radius_fraction : float
        Radius at which the search for a radius ends, as a fraction of the nearest slant range.
    radius_fraction : float
        Tolerance of a radius, as a fraction of the radius.
    similar_size_fraction : float
        The radius found with first-order effects is kept if the largest difference there, for errors of any size,
        deviates from the total by at most this fraction of the total.
    max_azimuth_rounds : int
        Number of worst azimuths along which a radius is searched before the whole circle is searched.
    probe_count : int
        Number of azimuths at which the exact difference of a large error is compared with the first-order difference.
    small_phase_rad, small_phase_fraction : float
        Deviation of an exact difference from the first-order difference up to which an error is treated as small: the
        larger of this phase [rad] and this fraction of the largest difference on the circle.
    azimuth_rad : float
        Tolerance of the azimuth of a largest difference [rad]. The relative loss of a cosine is half the square of
        it.
    folding_fraction : float
        Area spanned by the range and Doppler gradients, as a fraction of their area without an error, below which the
        search looks for places without an image.
    cases_per_block, lanes_per_block : int
        Numbers of cases, and of large errors at ground points, in one block of a computation, so that its arrays fit
        into a cache.
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
    """Quadratic phases of errors and parts at places, and their combined difference from the scene centre.

    `phases` (errors and parts, places) are the quadratic phases. [rad] `size` (places,) is the difference from the
    phases at the centre, combined over all errors by the mission's rule. [rad]

    `clearance` (places,) is the sine of the angle between the directions that band and aperture resolve, divided by
    the smallest sine that gives an image. A place has an image if its clearance is above 1. The clearance is positive
    at the centre. It is negative if the two directions become parallel between the centre and the place.
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
        """Values that the search along circles maximises, (2, places): the negative of `clearance`, and `size`."""
        return np.array((-self.clearance, self.size))


@dataclass(frozen=True, slots=True, eq=False)
class Rims:
    """Results on circles around scene centres: largest difference from the centre and its azimuth, (circles,). [rad]

    The differences are computed as if all errors were small. A difference is infinite if a part of its circle has no
    image. `phases` (errors or parts, points, circles) are the quadratic phases at evenly spaced points of the
    circles. [rad]
    """

    azimuth: Floats
    difference: Floats
    phases: Floats

    def of(self, indices: Indices) -> "Rims":
        """Select the circles with the given indices."""
        return Rims(self.azimuth[indices], self.difference[indices], self.phases[..., indices])


Selection = int | Booleans | Indices | tuple[Indices, ...]  # of the cases


class Heights(NamedTuple):
    """Values found by a search along circles, such as combined phase differences, and their azimuths. [rad]

    If two values are equal, the one with the larger azimuth counts as higher.
    """

    height: Floats
    azimuth: Floats

    @property
    def highest(self) -> "Heights":
        """Highest value along the first axis, with its azimuth."""
        height = self.height.max(axis=0)
        return Heights(height, np.where(self.height == height, self.azimuth, -math.inf).max(axis=0))

    def with_others(self, *candidates: "Heights") -> "Heights":
        """Element-wise maximum of these values and the candidates, with the azimuths."""
        return Heights(*map(np.array, zip(self, *candidates, strict=True))).highest

    def of(self, indices: Selection) -> "Heights":
        """Select the values with the given indices."""
        return Heights(self.height[indices], self.azimuth[indices])

    def where(self, is_kept: Booleans, replacements: "Heights") -> "Heights":
        """Return these values where `is_kept` is true, and the replacements elsewhere."""
        return Heights(*(np.where(is_kept, *both) for both in zip(self, replacements, strict=True)))

    def put(self, indices: Selection, heights: "Heights") -> None:
        """Replace the values at the given indices."""
        self.height[indices], self.azimuth[indices] = heights


class ScenePhases:
    """Quadratic phases of the declared errors at arbitrary places of the scenes.

    In all arrays, the first rows are the errors of motion and clocks (`members`), one row for each. They are followed
    by the random errors, with one row for each of their parts (`scene_random`).
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
        self.sizes = np.array([errors.array(error.declared) for error in self.members]).reshape(shape)
        per_unit = [errors.array(error.full.qpe) for error in self.members]
        self.centre = np.concatenate((np.array(per_unit).reshape(shape) * self.sizes, self.random.centre))
        self.is_large = np.zeros(self.centre.shape, dtype=bool)
        for index, error in enumerate(self.members):
            self.is_large[index] = errors.is_large(error)
        transmitter, receiver = errors.geometries.both
        self.nearest = errors.array(np.minimum(transmitter.slant_range, receiver.slant_range))

    def ranges_at(self, radius: Floats, azimuth: Floats, of: Indices) -> ExactRanges:
        """Exact ranges at places given by radius [m] and azimuth [rad]."""
        return self.exact.at(*at(radius, azimuth), of)

    def places(self, radius: Floats, azimuth: Floats, of: Indices) -> ScenePlaces:
        """Phases of the errors at ground points, combined differences from the centre, and clearances."""
        return self.there(self.ranges_at(radius, azimuth, of), of)

    def there(self, there: ExactRanges, of: Indices) -> ScenePlaces:
        """Return the same result as `places`, from the exact ranges `there` of the places."""
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
        """Combine phases at places by the mission's rule, for all errors or for those with the given indices. [rad]

        `phases` (errors and parts, places) are signed. The phases of a covariance are combined with their
        correlations.
        """
        phases_of_errors = self.of_errors(phases)
        if indices is None and not self.groups:
            return np.asarray(combined(list(phases_of_errors), self.combine))
        chosen = range(len(self.ids)) if indices is None else indices
        groups = [group.of(of) for group in self.groups]
        total = combined_phase([(self.ids[i], phases_of_errors[i]) for i in chosen], self.combine, groups)
        return np.asarray(np.broadcast_to(total, phases.shape[1:]))

    def of_errors(self, phases: Floats) -> Floats:
        """Phase of each error, (errors, ...), from the phases of errors and parts, (errors and parts, ...). [rad]

        The phase of a random error is its sigma, computed from its parts.
        """
        count = len(self.members)
        return np.concatenate((phases[:count], self.random.of_errors(phases[count:])))

    def differences(self, radius: Floats, azimuth: Floats, of: Indices) -> Floats:
        """Phase of each error or part at places less its phase at the centre, (errors and parts, places). [rad]

        For a large error it is the difference for the worse sign of the error.
        """
        return self.around(radius, azimuth, of, self.is_large.take(of, axis=1))[1]

    def around(self, radius: Floats, azimuth: Floats, of: Indices, exact: Booleans) -> tuple[Floats, Floats, Floats]:
        """Phase differences from the centre, to first order and by exact ranges, and the smallest area ratios.

        Returns three arrays. The first, (errors, places), holds the first-order differences. [rad] The second is
        equal to the first, except that the differences of the errors marked in `exact` (errors, places) follow from
        exact ranges. [rad]

        The third, (places,), is the smallest area ratio of the errors marked in `exact`. The area ratio of an error
        is the area that the range and Doppler gradients span at the point to which the error moves the image, divided
        by the area without the error. It is 0 where there is no image.
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
        """Replace differences and area ratios in `kept`, for pairs of an error and a place, by exact results."""
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

    @cached_property
    def _rows(self) -> Indices:
        """Index of the block of lanes of each large error and sign in `_lanes`, (2, errors).

        A block has one lane, which is one error of one sign in one case, for each case.
        """
        lane = np.cumsum(self.is_large.any(axis=1)) - 1
        return np.array((2 * lane, 2 * lane + 1))

    @cached_property
    def _lanes(self) -> Lanes:
        """Lanes of the errors that are large in any case: both signs of each error, in all cases."""
        large = np.flatnonzero(self.is_large.any(axis=1))
        return self.errors.lanes(*(self.members[i] for i in large), signs=(1.0, -1.0))

    @cached_property
    def _by_sign(self) -> Floats:
        """Quadratic phases of the large errors at the centre for each sign, (2, errors, cases). [rad]"""
        phases = np.full((2, *self.is_large.shape), math.nan)
        for i in np.flatnonzero(self.is_large.any(axis=1)):
            phases[:, i] = self.errors.quadratic_by_sign(self.members[i])
        return phases

    @cached_property
    def more(self) -> Floats:
        """Exact less first-order quadratic phase at the centre, (errors and parts, cases). [rad]

        The exact phase is that for the worse sign of the error. The value is 0 for errors that are not large.
        """
        exactly = self.centre.copy()
        for index, error in enumerate(self.members):
            exactly[index] = self.errors.does("full", error).qpe
        return np.where(self.is_large, exactly - self.centre, 0.0)

    # ------------------------------------------------------------------ circles
    def points(self, radius: Floats, of: Indices) -> Indices:
        """Number of evenly spaced points at which a circle of the given radius [m] needs to be evaluated."""
        return np.where(radius <= _SCENE.wide_fraction * self.nearest[of], _SCENE.rim_points, 2 * _SCENE.rim_points)

    def rims(self, radius: Floats, of: Indices) -> Rims:
        """Evaluate circles at evenly spaced points and around their worst points.

        All circles must need the same number of evenly spaced points. The worst point of a circle is the point with
        the largest difference. If the smallest clearance comes close to 1, its surroundings are searched too. There
        the difference grows as the inverse of the clearance, within an arc that the evenly spaced points may miss.
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
    """Ground point at a radius [m] and azimuth [rad] from the scene centre, east and north. [m]"""
    return radius * np.cos(azimuth), radius * np.sin(azimuth)


# ---------------------------------------------------------------------- climbs
def _tops(heights: Floats, look: Callable[[Floats, Indices], Floats]) -> tuple[Heights, Heights]:
    """Search for the local maxima of values on circles, starting from points that are above their neighbours.

    `heights` (2, points, circles) are the negative clearances and the sizes at evenly spaced points. `look` returns
    both at given azimuths of given circles. Returns the maxima of the negative clearances and the maxima of the
    sizes, (points, circles) each. A value is minus infinity where no search started.

    Two kinds of starting points are left out: clearances that are not expected to fall below
    `narrow_clearance_ratio`, and sizes that are expected to stay below the highest size by more than the error of a
    predicted crest. All other minima of the clearance are searched, not only the lowest, because the true minimum
    between the evenly spaced points may be beside a higher one.
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
    """Search for the maximum near each starting point, whose neighbours at a distance `arc` are not higher.

    `sides` are the values at both neighbours. To first order in the radius, a value is a constant plus a cosine of
    the azimuth. If the value computed at the predicted crest of this cosine differs from the prediction, the search
    is repeated in a quarter of the arc.
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
    """Crest of the cosine through three points on a circle that are `arc` apart [rad].

    Returns the offset of the crest from the middle point [rad], limited to ±`arc`, and the value at the crest.
    """
    sine = (after - before) / (2 * math.sin(arc))
    cosine = (middle - (after + before) / 2) / (1 - math.cos(arc))
    offset = np.minimum(np.maximum(np.arctan2(sine, cosine), -arc), arc)
    return offset, middle - cosine + np.hypot(sine, cosine)


class _Climb:
    """Search for the largest differences on circles, for errors of any size.

    The search on a circle starts from the azimuth with the highest value. The azimuths compared are evenly spaced
    ones and the azimuth where the difference is largest for small errors.
    """

    def __init__(self, phases: ScenePhases, radius: Floats, of: Indices, rims: Rims) -> None:
        self.phases, self.radius, self.of, self.rims = phases, radius, of, rims
        self.large = phases.is_large.take(of, axis=1)
        self.bent = self._bent()
        self.lowest = Heights(
            np.full(of.size, -math.inf), np.zeros(of.size)
        )  # negative area ratios and negative azimuths

    def largest(self) -> Heights:
        """Largest differences on the circles, with their azimuths. [rad]

        A difference is infinite if a part of the circle has no image.
        """
        azimuth, bent_circles = self.rims.azimuth.copy(), np.flatnonzero(self.bent.any(axis=0))
        if bent_circles.size:
            azimuth[bent_circles] = self._azimuths(bent_circles) % (2 * math.pi)
        differences = self.phases.differences(self.radius, azimuth, self.of)
        return Heights(self.phases.together(differences, self.of), azimuth)

    def _bent(self) -> Booleans:
        """Mark the large errors whose exact differences deviate from the first-order differences on a circle.

        The differences are compared at three azimuths, which reveal two harmonics.
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
        """Largest combined difference of each circle among given azimuths (n, circles), with its azimuth. [rad]

        `lowest` keeps the smallest area ratio (see `ScenePhases.around`) that was found so far on each circle.
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
        """Azimuths of the largest differences, or of places without an image. [rad]

        The errors marked in `bent` are computed by exact ranges. The image ends where the gradients become parallel.
        This may happen on an arc between the azimuths examined, so the search also runs towards the azimuth where the
        gradients are nearest to parallel.
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
    """Phase of each error at a place less its phase at the centre, as pairs of row id and phase. [rad]

    `errors` have a single case. The place is given by its radius [m] and azimuth [rad] from the scene centre.

    The errors are in the order of the file. The value of a random error is its sigma, coverage factor included.
    """
    phases = ScenePhases(errors, random)
    differences = phases.of_errors(
        phases.differences(np.array([radius]), np.array([azimuth]), np.zeros(1, dtype=int))
    )
    return list(zip(phases.ids, differences[:, 0].tolist(), strict=True))


# ---------------------------------------------------------------------- edges
@dataclass(frozen=True, slots=True, eq=False)
class SceneEdges:
    """Changes of the phases from the centres to the edges of the scenes, for many cases. [rad]

    `rim` holds the largest combined difference from the centre, and its azimuth, as if all errors were small.
    `largest` holds the same for the declared sizes. Both combine the errors by the mission's rule, and are infinite
    where there is no image. `names` are the errors, or the sums of errors, that have a `limit` (names, cases). `over`
    (names, cases) is the phase at the edge where it exceeds the limit although the phase at the centre meets it, and
    0 elsewhere.
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
        """Largest combined difference of the phases between edge and centre, (cases,). [rad]"""
        return self.largest.height

    @property
    def has_doubt(self) -> Booleans:
        """Cases in which an error or a sum exceeds its limit at the edge, but not at the centre."""
        return np.asarray((self.over > 0).any(axis=0))


def scene_edges(
    errors: DeclaredErrors, random: Sequence[RandomError], limits: Mapping[str, Floats], split: Shares
) -> SceneEdges | None:
    """Evaluate the errors of many cases at the edges of their scenes.

    Returns None if no error is declared.

    Parameters
    ----------
    errors : DeclaredErrors
        Errors of missions that state `scene.radius`.
    random : sequence of RandomError
        Random errors of the same missions, declared or not.
    limits : mapping of str to (cases,)
        Limit of the phase of each owner, autofocus gain included. [rad]
    split : Shares
        Division of the budget, which determines the errors that count against each limit.
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
    """Largest phase difference from the centre on each circle, and its azimuth, for errors of any size. [rad]"""
    largest = Heights(rims.difference.copy(), rims.azimuth.copy())
    large_circles = np.flatnonzero(np.isfinite(rims.difference) & phases.is_large[:, of].any(axis=0))
    if large_circles.size:
        largest.put(
            large_circles, _Climb(phases, radius[large_circles], of[large_circles], rims.of(large_circles)).largest()
        )
    return largest


def _over_at_the_edge(edges: SceneEdges, members: Sequence[Sequence[int]], of: Indices, rims: Rims) -> Floats:
    """Combined phases that exceed their limits at the edge but not at the centre, (names, cases in `of`). [rad]

    The value is 0 for all others.
    """
    phases, limit = edges.phases, edges.limit[:, of] * _LIMIT_FACTOR
    more = phases.more[:, of]

    def combined_phases(at_points: Floats) -> Floats:
        """Phases that are compared with the limits: of each error under `each`, otherwise of each sum. [rad]"""
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
    """Distance from the scene centre within which one autofocus correction is sufficient.

    Within this distance, the differences of the phases from the centre stay within `total`. [rad]

    Attributes
    ----------
    farthest : (cases,)
        Largest radius that the search examines. [m]
    """

    def __init__(self, edges: SceneEdges, total: PerCase) -> None:
        self.edges, self.phases, self.total = edges, edges.phases, edges.phases.errors.array(total)
        self.farthest = np.maximum(_SCENE.max_radius_fraction * self.phases.nearest, edges.radius)

    @cached_property
    def served(self) -> Floats:
        """Radius at which the largest difference reaches the total, (cases,). [m]

        Infinite if the difference stays within the total up to `farthest`. NaN if the edge has no image.
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
        """Return the radii of `served` if the effects of all errors were proportional to their sizes. [m]

        The search runs along the worst azimuth. It is repeated if the rim at the radius found has a worse azimuth.
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
        """Increase the radii [m] in place until the size exceeds the total, or until `farthest` is reached."""
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
        """Largest differences on circles with their azimuths. [rad]

        If `of_small` is true, the effects of all errors are taken to first order; otherwise they are those of any
        size.
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
    """Find the radii up to which sizes stay within a total, to a thousandth, by the Illinois secant method.

    Parameters
    ----------
    size_at : callable
        Function of radii (searched,) and the indices of their cases (searched,) that returns sizes.
    total : (n,)
        Limit of the sizes.
    searched : (searched,)
        Indices, out of n, of the cases to search.
    inside, outside : pairs of (n,)
        Radius with its size, at which the size is within the total (`inside`) or exceeds it (`outside`). The solution
        lies between the two radii.
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
    """Largest change of the quadratic phase from the scene centre to the edge of one mission's scene, with notes.

    `difference` is this change [rad], combined by the mission's rule, at `azimuth` on the rim. `autofocus_radius` is
    the radius within which the change stays within the total budget. [m] It is None if the change stays within the
    budget up to the radius `searched`. [m] `degeneracy` is the reason why a part of the edge has no image. `doubt`
    names an error that exceeds its limit at the edge, but not at the centre.
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
        """Create the scene edge of one case, given the mission of that case."""
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
        """Notes on the azimuth of the largest difference and the radius that one autofocus correction covers."""
        if not self.difference:
            return (phrases.note("same-at-the-edge"),)
        largest = phrases.note("largest-at-the-edge", azimuth_deg=math.degrees(self.azimuth), radius=self.radius)
        return (largest, phrases.note("one-correction-serves", how_far=self.served, total=total))

    @property
    def served(self) -> str:
        """Text that gives the radius within which one autofocus correction is sufficient."""
        if self.autofocus_radius is None:
            return f"beyond the scene ({format_quantity(self.searched, 'm', 3, 'down')})"
        return f"up to {format_quantity(self.autofocus_radius, 'm', 3, 'down')} from the centre"


def _degeneracy(mission: Mission, ground_point: GroundVector) -> str:
    """Reason why a ground point has no image."""
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
