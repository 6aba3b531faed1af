"""The scene's edge: how far a quadratic phase error there differs from the one at the centre, in many cases at once.

The paper's errors are spatially invariant; in the full model they are not. At a point p of the scene both platforms
have other lines of sight: exact ranges are taken there, with p in place of the
centre. One autofocus correction is one phase for the whole image, so that it leaves the difference behind. Against
exact ranges and against images at 250 m and 1 km: `tests/simulate/test_scene_edge.py`. Derived here.

What gates is the difference against the total budget, without the gain of autofocus: that is what must be left of any
error after a correction. Without autofocus it is what the edge has more than the centre, where the rows stand; then,
and with a correction that has its own bound, an edge whose phase itself exceeds a limit is a warning.

A place is a point of the ground of one of the cases; `of` says of which. Rows of arrays are errors, and below them
the parts of those at random (`scene_random`).
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
from bisar_budget.constants import UTILIZATION_TOLERANCE
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

RIM_POINTS = 16
WIDE = 0.1  # of the nearest slant range; beyond, twice as many
LIKE_A_COSINE = 1e-4  # as near to the crest of a cosine; its azimuth is then right to a degree
ROUGH = 0.1  # by so much, of itself, a crest through points of the rim may be off
CLIMBS = 5  # until then, each in a quarter of the arc before
NARROW = 10.0  # of a place's clearances; below, it is looked at whatever its difference
NEAREST_M = 1.0  # of a platform to a place; nearer, no image
FARTHEST = 0.5  # of the nearest slant range: the search for a radius ends there
PRECISION = 1e-3  # of the radius
ALIKE = 5e-3  # of the total: so near to it, large errors need no search of their own
TURNS = 2  # of the azimuth along which it is searched; then it is the whole circle's
PROBES = 3
FLOOR_RAD, SHARE = 1e-4, 3e-4  # of the largest difference: what one error may differ by and be taken as small
FINEST = 1e-3  # rad, of the azimuth of a largest difference: a cosine loses half its square
MAY_FOLD = 0.7  # of what gradients span without an error: with less left of it a point may have no image nearby
AT_ONCE, TOGETHER = 512, 1024  # cases, and large errors at places: arrays of more do not stay in a cache

_BOUND = 1 + UTILIZATION_TOLERANCE
_ARC = math.pi / RIM_POINTS
_SIDES = np.array([[-1.0], [1.0]])
HeightAt = Callable[[Floats, Indices], Floats]  # heights at azimuths, of some climbers
SizeAt = Callable[[Floats, Indices], Floats]  # sizes at radii, of some cases


@dataclass(frozen=True, slots=True, eq=False)
class ScenePlaces:
    """Quadratic phase of each error or part at places, (errors, places); how far they are from the centre's. [rad]

    There is an image where the `clearance`, (places,), is above 1: the sine of the angle between the directions that
    band and aperture resolve, over the least. It has the centre's sign: below zero they are parallel on the way.
    """

    phases: Floats
    size: Floats
    clearance: Floats

    @property
    def has_image(self) -> Booleans:
        """Whether an image can be formed there."""
        return np.asarray(self.clearance > 1)

    @property
    def heights(self) -> Floats:
        """Heights that a search along circles climbs, (2, places): the clearance, negative, and the size."""
        return np.array((-self.clearance, self.size))


@dataclass(frozen=True, slots=True, eq=False)
class Rims:
    """Circles about centres: where the largest difference is, that difference, and the phases around it. [rad]

    Small errors are looked at, `phases` (errors, points, circles). Where a part has no image the difference is
    infinite.
    """

    azimuth: Floats
    difference: Floats
    phases: Floats

    def of(self, some: Indices) -> "Rims":
        """Some of the circles."""
        return Rims(self.azimuth[some], self.difference[some], self.phases[..., some])


Selection = int | Booleans | Indices | tuple[Indices, ...]  # of the cases


class Heights(NamedTuple):
    """Heights and their azimuths; of heights alike the larger azimuth is the higher."""

    height: Floats
    azimuth: Floats

    @property
    def highest(self) -> "Heights":
        """The highest along the first axis."""
        height = self.height.max(axis=0)
        return Heights(height, np.where(self.height == height, self.azimuth, -math.inf).max(axis=0))

    def with_others(self, *others: "Heights") -> "Heights":
        """The highest of these and others, one by one."""
        return Heights(*map(np.array, zip(self, *others, strict=True))).highest

    def of(self, some: Selection) -> "Heights":
        """Some of them."""
        return Heights(self.height[some], self.azimuth[some])

    def where(self, is_own: Booleans, others: "Heights") -> "Heights":
        """These in some places, in the rest others."""
        return Heights(*(np.where(is_own, *both) for both in zip(self, others, strict=True)))

    def put(self, some: Selection, others: "Heights") -> None:
        """Put others into some places."""
        self.height[some], self.azimuth[some] = others


class ScenePhases:
    """Quadratic phases of the declared errors at any places of the scenes.

    An error at random has a phase for each of its parts (`scene_random`): they follow those of the others, `members`.
    """

    def __init__(self, errors: DeclaredErrors, random: Sequence[RandomError] = ()) -> None:
        self.errors, self.exact, self.combine = errors, errors.exact, errors.mission.allocation.combine
        self.groups = correlated_errors(errors.mission) if self.combine == "rss" else ()
        self.members = [error for error in errors.stated if error.is_motion]
        self.random = RandomPhases(errors, random)
        subjects = [*(error.subject for error in self.members), *self.random.subjects]
        self.ids, self.owners = ([getattr(what, part) for what in subjects] for part in ("id", "owner"))
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
        """Exact ranges of places."""
        return self.exact.at(*at(radius, azimuth), of)

    def places(self, radius: Floats, azimuth: Floats, of: Indices) -> ScenePlaces:
        """Phases, size of their differences, and clearances at places."""
        return self.there(self.ranges_at(radius, azimuth, of), of)

    def there(self, there: ExactRanges, of: Indices) -> ScenePlaces:
        """The same where exact ranges are taken."""
        centre = self.centre.take(of, axis=1)
        phases = self.random.there(there, of)
        if self.members:
            small = there.quadratics_of(self.small.there(of)) * self.sizes.take(of, axis=1)
            phases = np.concatenate((small, phases))
        way = np.copysign(1.0, there.matrix.turned_from(self.exact.matrix, of))
        clearance = way * there.sine / MIN_SINE
        is_nowhere = (there.nearest < NEAREST_M) | ~np.isfinite(phases.sum(axis=0) + clearance)
        if is_nowhere.any():
            phases, clearance = np.where(is_nowhere, centre, phases), np.where(is_nowhere, 0.0, clearance)
        return ScenePlaces(phases, self.together(phases - centre, of), clearance)

    def together(self, phases: Floats, of: Indices, indices: Sequence[int] | None = None) -> Floats:
        """Phases of the errors, or of some of them, combined; those of a covariance with their correlations. [rad]"""
        found = self.of_errors(phases)
        if indices is None and not self.groups:
            return np.asarray(combined(list(found), self.combine))
        chosen = range(len(self.ids)) if indices is None else indices
        groups = [group.of(of) for group in self.groups]
        one = combined_phase([(self.ids[i], found[i]) for i in chosen], self.combine, groups)
        return np.asarray(np.broadcast_to(one, phases.shape[1:]))

    def of_errors(self, phases: Floats) -> Floats:
        """Phases of the errors, (errors, ...), of one at random the sigma, by those of their parts. [rad]"""
        count = len(self.members)
        return np.concatenate((phases[:count], self.random.of_errors(phases[count:])))

    def differences(self, radius: Floats, azimuth: Floats, of: Indices) -> Floats:
        """Phase of each error there less that at the centre; by the worse sign of the large ones. [rad]"""
        return self.around(radius, azimuth, of, self.is_large.take(of, axis=1))[1]

    def around(self, radius: Floats, azimuth: Floats, of: Indices, exact: Booleans) -> tuple[Floats, Floats, Floats]:
        """The same were all errors small; with some taken exactly, (errors, places); and how gradients turn.

        That is the least of what range and Doppler gradients span where each of these leads, over what they span
        without it: 0 where there is no image.
        """
        there = self.ranges_at(radius, azimuth, of)
        small = self.there(there, of).phases - self.centre.take(of, axis=1)
        found, turns = small.copy(), np.full(of.shape, math.inf)
        error, place = np.nonzero(exact)
        for start in range(0, error.size, TOGETHER):
            some = slice(start, start + TOGETHER)
            self._exactly(there, of, error[some], place[some], (found, turns))
        return small, found, turns

    def _exactly(
        self, there: ExactRanges, of: Indices, error: Indices, place: Indices, kept: tuple[Floats, Floats]
    ) -> None:
        """Put what exact ranges say into the differences and turns of some errors at places."""
        (found, turns), case, count = kept, of[place], error.size
        lanes = self._lanes.of((self._rows[:, error] * self.errors.cases + case).reshape(-1))
        lanes = replace(lanes, case=np.tile(place, 2))
        sizes, every = np.tile(np.abs(self.sizes[error, case]), 2), np.arange(2 * count)
        none = np.zeros(2 * count)
        way = np.array(there.way(lanes, none, (none, none)))
        paths = PointPaths(there, lanes, way, is_alike=self.errors.is_complete)
        paths.follow_to(every, sizes)
        known = paths.known(every, sizes).reshape(len(ROWS), 2, count)
        np.minimum.at(turns, place, np.nan_to_num(known[-1]).min(axis=0))
        differs = np.abs(known[3] - self._by_sign[:, error, case])
        worst = np.where(np.isnan(differs), math.inf, differs).max(axis=0)
        found[error, place] = np.copysign(worst, found[error, place])

    @cached_property
    def _rows(self) -> Indices:
        """Places of the errors of each sign among `_lanes`, in lanes of all cases, (2, errors)."""
        place = np.cumsum(self.is_large.any(axis=1)) - 1
        return np.array((2 * place, 2 * place + 1))

    @cached_property
    def _lanes(self) -> Lanes:
        """Lanes of the errors that are large in any case, in all of them, of each sign."""
        large = np.flatnonzero(self.is_large.any(axis=1))
        return self.errors.lanes(*(self.members[i] for i in large), signs=(1.0, -1.0))

    @cached_property
    def _by_sign(self) -> Floats:
        """Quadratic phases of large errors at the centre, of each sign, (2, errors, cases). [rad]"""
        found = np.full((2, *self.is_large.shape), math.nan)
        for i in np.flatnonzero(self.is_large.any(axis=1)):
            found[:, i] = self.errors.quadratic_by_sign(self.members[i])
        return found

    @cached_property
    def more(self) -> Floats:
        """Quadratic phase at the centre beyond that of a small error, by the worse sign, (errors, cases). [rad]"""
        exactly = self.centre.copy()
        for index, error in enumerate(self.members):
            exactly[index] = self.errors.does("full", error).qpe
        return np.where(self.is_large, exactly - self.centre, 0.0)

    # ------------------------------------------------------------------ circles
    def points(self, radius: Floats, of: Indices) -> Indices:
        """Number of even points that circles need."""
        return np.where(radius <= WIDE * self.nearest[of], RIM_POINTS, 2 * RIM_POINTS)

    def rims(self, radius: Floats, of: Indices) -> Rims:
        """Evaluate circles that need the same number of points, evenly and around their worst point.

        That is where the difference is largest; and where a clearance is least, if it comes near to 1: a difference
        grows there as its inverse, in an arc that points of a circle may miss.
        """
        count, circles = int(self.points(radius, of)[0]), np.arange(of.size)

        def look(azimuth: Floats, circle: Indices) -> ScenePlaces:
            return self.places(radius[circle], azimuth, of[circle])

        even = look(np.repeat(2 * math.pi * np.arange(count) / count, of.size), np.tile(circles, count))
        clear, tops = _tops(even.heights.reshape(2, count, of.size), lambda *where: look(*where).heights)
        nearest = clear.highest
        has_image = nearest.height < -1
        some, circle = np.nonzero((clear.height > -math.inf) & has_image)
        if some.size:  # beside the narrowest
            arc, azimuth = math.pi / count / 8, clear.azimuth[some, circle]
            three = np.concatenate((azimuth - arc, azimuth, azimuth + arc))
            before, height, after = look(three, np.tile(circle, 3)).size.reshape(3, -1)
            top = _climbed(
                lambda way, which: look(way, circle[which]).size, (before, after), Heights(height, azimuth), arc
            )
            clear.height[:] = -math.inf
            clear.put((some, circle), top)
            tops = Heights(*(np.concatenate(both) for both in zip(tops, clear, strict=True)))
        top = tops.highest.where(has_image, nearest)
        phases = even.phases.reshape(-1, count, of.size)
        return Rims(top.azimuth % (2 * math.pi), np.where(has_image, top.height, math.inf), phases)


@overload
def at(radius: float, azimuth: float) -> tuple[float, float]: ...
@overload
def at(radius: Floats, azimuth: Floats) -> tuple[Floats, Floats]: ...
def at(radius: PerCase, azimuth: PerCase) -> tuple[PerCase, PerCase]:
    """Place on the ground, east and north. [m]"""
    return radius * np.cos(azimuth), radius * np.sin(azimuth)


# ---------------------------------------------------------------------- climbs
def _tops(heights: Floats, look: Callable[[Floats, Indices], Floats]) -> tuple[Heights, Heights]:
    """Climb from each of the even points of circles, (2, points, circles), that is above its neighbours.

    Heights are clearances, less than nothing, and sizes, as `look` has them at azimuths of circles. Arrived at are
    tops of the clearances and of the sizes, (points, circles) each; minus infinity where none climbed. Left out are
    clearances that do not seem to come below `NARROW`, and sizes that seem to stay below the
    highest by more than a crest may be off; a valley that is milder at the points may be the deeper between them.
    """
    arc = 2 * math.pi / heights.shape[1]
    before, after = np.roll(heights, 1, axis=1), np.roll(heights, -1, axis=1)
    _, crests = _crest(before, after, heights, arc)
    most = crests[1] + ROUGH * np.abs(crests[1])
    is_start = heights >= np.maximum(before, after)
    is_start[0] &= crests[0] > -NARROW
    is_start[1] &= (most >= heights[1].max(axis=0)) & (heights[0] < -1).all(axis=0)
    kind, point, circle = np.nonzero(is_start)
    top = _climbed(
        lambda azimuth, some: look(azimuth, circle[some])[kind[some], np.arange(some.size)],
        (before[is_start], after[is_start]),
        Heights(heights[is_start], arc * point),
        arc,
    )
    found = Heights(np.full(heights.shape, -math.inf), np.zeros(heights.shape))
    found.put(is_start, top)
    # As if they had been climbed one by one, from the highest crest on.
    order = np.argsort(np.where(is_start[1], -crests[1], math.inf), axis=0, kind="stable")
    climbed, seemed = (np.take_along_axis(one, order, axis=0) for one in (found.height[1], most))
    is_low = seemed[1:] < np.maximum.accumulate(climbed, axis=0)[:-1]
    climbed[1:][is_low] = -math.inf
    np.put_along_axis(found.height[1], order, climbed, axis=0)
    return found.of(0), found.of(1)


def _climbed(height_at: HeightAt, sides: tuple[Floats, Floats], start: Heights, arc: float) -> Heights:
    """Climb to the highest near places of circles whose sides, an arc away, are no higher.

    Linear in the radius, a height is a constant and a cosine of the azimuth. Where its crest does not tell what is
    found there, that is looked for again in a quarter of the arc.
    """
    found, here, some = Heights(*map(np.array, start)), start, np.arange(start.height.size)
    for _ in range(CLIMBS):
        if not some.size:
            break
        offset, crests = _crest(*sides, here.height, arc)
        azimuth = here.azimuth + offset
        there = Heights(height_at(azimuth, some), azimuth)
        found.put(some, found.of(some).with_others(there))
        going = ~(np.abs(there.height - crests) <= LIKE_A_COSINE * np.abs(crests))
        some, here = some[going], here.of(going).with_others(there.of(going))
        if some.size:
            arc /= 4
            both = np.array((here.azimuth - arc, here.azimuth + arc))
            around = Heights(height_at(both.reshape(-1), np.tile(some, 2)).reshape(2, -1), both)
            found.put(some, found.of(some).with_others(around.highest))
            sides = (around.height[0], around.height[1])
    return found


def _crest(before: Floats, after: Floats, middle: Floats, arc: float) -> tuple[Floats, Floats]:
    """Offset from the middle of three points an arc apart to the crest of the cosine through them, and its height."""
    sine = (after - before) / (2 * math.sin(arc))
    cosine = (middle - (after + before) / 2) / (1 - math.cos(arc))
    offset = np.minimum(np.maximum(np.arctan2(sine, cosine), -arc), arc)
    return offset, middle - cosine + np.hypot(sine, cosine)


class _Climb:
    """The largest differences on circles, errors of any size counted.

    They are climbed from the highest of some places of each circle, and of where it is largest of small errors.
    """

    def __init__(self, phases: ScenePhases, radius: Floats, of: Indices, rims: Rims) -> None:
        self.phases, self.radius, self.of, self.rims = phases, radius, of, rims
        self.large = phases.is_large.take(of, axis=1)
        self.bent = self._bent()
        self.lowest = Heights(np.full(of.size, -math.inf), np.zeros(of.size))  # turns and azimuths, negative

    def largest(self) -> Heights:
        """The largest differences [rad]; where there is no image somewhere they are infinite."""
        azimuth, some = self.rims.azimuth.copy(), np.flatnonzero(self.bent.any(axis=0))
        if some.size:
            azimuth[some] = self._azimuths(some) % (2 * math.pi)
        differences = self.phases.differences(self.radius, azimuth, self.of)
        return Heights(self.phases.together(differences, self.of), azimuth)

    def _bent(self) -> Booleans:
        """Which of the large errors differ otherwise than small ones do: seen at three places, two harmonics show."""
        thirds = self.rims.azimuth + 2 * math.pi * np.arange(PROBES)[:, None] / PROBES
        radius, of, large = np.tile(self.radius, PROBES), np.tile(self.of, PROBES), np.tile(self.large, PROBES)
        small, exact, _ = self.phases.around(radius, thirds.reshape(-1), of, large)
        floor = np.tile(np.maximum(FLOOR_RAD, SHARE * self.rims.difference), PROBES)
        is_bent = large & ~(np.abs(exact - small) <= floor)
        return np.asarray(is_bent.reshape(len(large), PROBES, -1).any(axis=1))

    def _look(self, some: Indices, azimuths: Floats) -> Heights:
        """The largest of differences at azimuths (n, some); the least turns are kept in mind."""
        count = len(azimuths)
        of, bent = np.tile(self.of[some], count), np.tile(self.bent[:, some], count)
        _, found, turns = self.phases.around(np.tile(self.radius[some], count), azimuths.reshape(-1), of, bent)
        seen = Heights(-turns.reshape(count, -1), -azimuths).highest
        self.lowest.put(some, self.lowest.of(some).with_others(seen))
        return Heights(self.phases.together(found, of).reshape(count, -1), azimuths).highest

    def _azimuths(self, some: Indices) -> Floats:
        """Azimuths of the largest differences, or of places without an image, the bent errors taken exactly. [rad]

        Where gradients become parallel the image ends, on an arc that may lie between the places that are looked at:
        it is also sought where they are nearest to parallel.
        """
        even = np.broadcast_to(2 * _ARC * np.arange(RIM_POINTS)[:, None], (RIM_POINTS, some.size))
        top = self._look(some, np.concatenate((self.rims.azimuth[some][None], even)))
        arc = np.full(some.size, _ARC)
        while (going := np.flatnonzero((arc > FINEST) & np.isfinite(top.height))).size:
            before = top.of(going)
            side = self._look(some[going], before.azimuth + arc[going] * _SIDES)
            is_higher = side.height > before.height
            top.put(going, side.where(is_higher, before))
            arc[going] = np.where(is_higher, arc[going], arc[going] / 4)
        arc, low = np.full(some.size, _ARC), self.lowest.of(some)
        while (going := np.flatnonzero((arc > FINEST) & np.isfinite(top.height) & (low.height > -MAY_FOLD))).size:
            before = low.of(going)
            top.put(going, top.of(going).with_others(self._look(some[going], arc[going] * _SIDES - before.azimuth)))
            seen = self.lowest.of(some[going])
            is_lower = seen.height > before.height
            low.put(going, seen.where(is_lower, before))
            arc[going] = np.where(is_lower, arc[going], arc[going] / 4)
        return top.azimuth


@np.errstate(all="ignore")
def differences_at(
    errors: DeclaredErrors, radius: float, azimuth: float, random: Sequence[RandomError] = ()
) -> list[tuple[str, float]]:
    """Phase of each error of one case at a place less that at the centre, by row id, in the file's order. [rad]

    Of one at random it is the sigma, coverage factor included.
    """
    phases = ScenePhases(errors, random)
    found = phases.of_errors(phases.differences(np.array([radius]), np.array([azimuth]), np.zeros(1, dtype=int)))
    return list(zip(phases.ids, found[:, 0].tolist(), strict=True))


# ---------------------------------------------------------------------- edges
@dataclass(frozen=True, slots=True, eq=False)
class SceneEdges:
    """Differences that the edges of the scenes of many cases add.

    `rim` is where small errors differ most from the centre, `largest` where errors of their size do, combined as the
    mission says [rad]; infinite where there is no image. `over` are the phases [rad], (names, cases), of the errors
    that are inside their `limit` at the centre and over it at the edge; else 0.
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
        """The largest of the phases between edge and centre. [rad]"""
        return self.largest.height

    @property
    def has_doubt(self) -> Booleans:
        """Whether an error is over its limit at the edge alone."""
        return np.asarray((self.over > 0).any(axis=0))


def scene_edges(
    errors: DeclaredErrors, random: Sequence[RandomError], limits: Mapping[str, Floats], split: Shares
) -> SceneEdges | None:
    """Evaluate the errors of many cases at the edges of their scenes; None without a declared error.

    Parameters
    ----------
    errors : DeclaredErrors
        Of missions with `scene.radius`.
    random : sequence of RandomError
        Of the same, declared or not.
    limits : mapping of str to (cases,)
        What each owner's phases are held to, autofocus gain included. [rad]
    split : Shares
        Whose errors count against whose limit.
    """
    phases = ScenePhases(errors, random)
    if not phases.ids:
        return None
    owners, radius = phases.owners, errors.array(errors.mission.scene.radius)
    if phases.combine == "each":
        held = [(name, [i], limits[owner]) for i, (name, owner) in enumerate(zip(phases.ids, owners, strict=True))]
    else:
        held = [
            (
                f"{owner}.quadratic_phase_error",
                [i for i, one in enumerate(owners) if owner == "mission" or split.includes(one, owner)],
                limit,
            )
            for owner, limit in limits.items()
        ]
    names, members, limit = zip(*held, strict=True)
    rim, largest = (Heights(np.full(errors.cases, math.inf), np.zeros(errors.cases)) for _ in range(2))
    found = SceneEdges(phases, radius, rim, largest, names, np.array(limit), np.zeros((len(held), errors.cases)))
    counts = phases.points(radius, errors.each)
    for count in (RIM_POINTS, 2 * RIM_POINTS):
        cases = np.flatnonzero(counts == count)
        for start in range(0, cases.size, AT_ONCE):
            _evaluate(found, members, cases[start : start + AT_ONCE])
    return found


@np.errstate(all="ignore")  # a gradient vanishes, or both are parallel to the last digit
def _evaluate(found: SceneEdges, members: Sequence[Sequence[int]], of: Indices) -> None:
    phases = found.phases
    rims = phases.rims(found.radius[of], of)
    found.rim.put(of, Heights(rims.difference, rims.azimuth))
    found.largest.put(of, _largest(phases, found.radius[of], of, rims))
    some = np.flatnonzero(np.isfinite(found.difference[of]))
    if some.size:
        found.over[:, of[some]] = _over_at_the_edge(found, members, of[some], rims.of(some))


def _largest(phases: ScenePhases, radius: Floats, of: Indices, rims: Rims) -> Heights:
    """Largest differences on circles, errors of any size counted. [rad]"""
    found = Heights(rims.difference.copy(), rims.azimuth.copy())
    some = np.flatnonzero(np.isfinite(rims.difference) & phases.is_large[:, of].any(axis=0))
    if some.size:
        found.put(some, _Climb(phases, radius[some], of[some], rims.of(some)).largest())
    return found


def _over_at_the_edge(found: SceneEdges, members: Sequence[Sequence[int]], of: Indices, rims: Rims) -> Floats:
    """Phases at the edge of what is inside its limit at the centre and over it there, else 0, (names, of). [rad]"""
    phases, limit = found.phases, found.limit[:, of] * _BOUND
    more = phases.more[:, of]

    def held(at_places: Floats) -> Floats:
        """Phases as they are held to limits, (names, ..., of)."""
        if phases.combine == "each":
            return np.abs(phases.of_errors(at_places))
        return np.array([phases.together(at_places, of, indices) for indices in members])

    around = held(rims.phases + more[:, None])
    top, count = around.argmax(axis=1)[:, None], around.shape[1]
    before, after, middle = (np.take_along_axis(around, (top + step) % count, axis=1)[:, 0] for step in (-1, 1, 0))
    _, crests = _crest(before, after, middle, 2 * math.pi / count)
    worst = phases.places(found.radius[of], rims.azimuth, of).phases
    size = np.maximum(crests, held(worst + more))
    is_over = (held(phases.centre[:, of] + more) <= limit) & (size > limit)
    return np.where(is_over, size, 0.0)


# ---------------------------------------------------------------------- one correction
class Corrections:
    """How far from the centre one autofocus correction serves: where differences stay inside a total. [rad]

    Attributes
    ----------
    farthest : (cases,)
        How far it is searched for. [m]
    """

    def __init__(self, edges: SceneEdges, total: PerCase) -> None:
        self.edges, self.phases, self.total = edges, edges.phases, edges.phases.errors.array(total)
        self.farthest = np.maximum(FARTHEST * self.phases.nearest, edges.radius)

    @cached_property
    def served(self) -> Floats:
        """Radius at which the largest difference reaches the total, (cases,); infinite where it does not by then.

        Not a number where an edge has no image. [m]
        """
        found = np.full(self.total.shape, math.nan)
        cases = np.flatnonzero(np.isfinite(self.edges.rim.height) & np.isfinite(self.edges.difference))
        with np.errstate(all="ignore"):
            for start in range(0, cases.size, AT_ONCE):
                of = cases[start : start + AT_ONCE]
                found[of] = self._served(of)
        return found

    def _served(self, of: Indices) -> Floats:
        found, total = self._served_of_small(of), self.total[of]
        high = np.where(np.isinf(found), self.farthest[of], found)
        low, below, size = np.zeros(of.size), np.zeros(of.size), np.zeros(of.size)
        some = np.flatnonzero(self.phases.is_large[:, of].any(axis=0))
        if not some.size:
            return found

        def largest(radius: Floats, places: Indices) -> Floats:
            return self._crests(radius, of[places], of_small=False).height

        size[some] = largest(high[some], some)
        some = some[np.abs(size[some] - total[some]) > ALIKE * total[some]]
        self._grow(largest, of, some, low, below, high, size)
        over = some[size[some] > total[some]]
        found[some] = math.inf
        found[over] = where(largest, total, over, (low, below), (high, size))
        return found

    def _served_of_small(self, of: Indices) -> Floats:
        """The same, were effects of all errors proportional to them.

        Along the worst azimuth, and again where the rim at the radius found has a worse one.
        """
        total, high, found = self.total[of], self.edges.radius[of], np.full(of.size, math.inf)
        size, azimuth = self.edges.rim.of(of)
        some = np.flatnonzero(size)

        def along(radius: Floats, places: Indices) -> Floats:
            there = self.phases.places(radius, azimuth[places], of[places])
            return np.where(there.has_image, there.size, math.inf)

        for _ in range(TURNS):
            if not some.size:
                return found
            low, inside = np.zeros(of.size), np.zeros(of.size)
            self._grow(along, of, some, low, inside, high, size)
            over = some[size[some] > total[some]]
            high[over] = where(along, total, over, (low, inside), (high, size))
            around = self._crests(high[some], of[some])
            is_inside = around.height <= total[some] * (1 + PRECISION)
            done = some[is_inside]
            found[done] = np.where(size[done] <= total[done], math.inf, high[done])
            size[some], azimuth[some] = around
            some = some[~is_inside]

        def rim(radius: Floats, places: Indices) -> Floats:
            return self._crests(radius, of[places]).height

        none = np.zeros(of.size)
        found[some] = where(rim, total, some, (none, none), (high, size))
        return found

    def _grow(
        self, size_at: SizeAt, of: Indices, some: Indices, low: Floats, below: Floats, high: Floats, size: Floats
    ) -> None:
        """Look farther out until a size passes the total, or as far as it is searched for."""
        total, farthest = self.total[of], self.farthest[of]
        while True:
            some = some[(size[some] <= total[some]) & (high[some] < farthest[some])]
            if not some.size:
                return
            low[some], below[some] = high[some], size[some]
            by = np.clip(1.05 * total[some] / size[some], 1.05, 4.0)
            high[some] = np.minimum(farthest[some], high[some] * by)
            size[some] = size_at(high[some], some)

    def _crests(self, radius: Floats, of: Indices, *, of_small: bool = True) -> Heights:
        """Largest differences on circles; of errors of any size, or were all of them small. [rad]"""
        found, counts = Heights(np.empty(of.size), np.empty(of.size)), self.phases.points(radius, of)
        for count in np.unique(counts):
            same = np.flatnonzero(counts == count)
            rims = self.phases.rims(radius[same], of[same])
            crests = Heights(rims.difference, rims.azimuth)
            found.put(same, crests if of_small else _largest(self.phases, radius[same], of[same], rims))
        return found


def where(
    size_at: SizeAt,
    total: Floats,
    some: Indices,
    inside: tuple[Floats, Floats],
    outside: tuple[Floats, Floats],
) -> Floats:
    """Radii, to a thousandth, up to which sizes are inside a total: by secants, drawn near (Illinois).

    Parameters
    ----------
    size_at : callable
        Sizes at radii (some,), of places (some,).
    total : (n,)
        What the sizes are held to.
    some : (some,)
        Indices, of n, that are looked at.
    inside, outside : (radius, size) of (n,)
        Between these.
    """
    (low, below), (high, above) = ([part[some].copy() for part in pair] for pair in (inside, outside))
    slack = total[some] * PRECISION / 2
    goal = total[some] - slack
    below, above = below - goal, above - goal
    side = np.zeros(some.size)  # of the goal, on which the last one was
    going = np.flatnonzero(below <= 0)  # others are as near as asked for
    while True:
        going = going[high[going] - low[going] > PRECISION * high[going]]
        if not going.size:
            return low
        share = np.where(np.isinf(above[going]), 0.5, below[going] / (below[going] - above[going]))
        middle = low[going] + share * (high[going] - low[going])
        over = size_at(middle, some[going]) - goal[going]
        is_inside = over <= slack[going]
        is_near = is_inside & (over > -slack[going])
        ins, outs = going[is_inside], going[~is_inside]
        low[ins], below[ins] = middle[is_inside], over[is_inside]
        high[outs], above[outs] = middle[~is_inside], over[~is_inside]
        # Twice on one side: draw the other nearer.
        above[ins] = np.where(side[ins] > 0, above[ins] / 2, above[ins])
        below[outs] = np.where(side[outs] < 0, below[outs] / 2, below[outs])
        side[ins], side[outs] = 1.0, -1.0
        going = going[~is_near]


# ---------------------------------------------------------------------- in words
class SceneEdge(NamedTuple):
    """Difference that the edge of the scene of one mission adds, in words.

    `difference` is the largest of the quadratic phases between edge and centre, combined as the mission says [rad],
    at `azimuth` on the rim. `autofocus_radius` is that within which it stays inside the total budget [m]; None where
    it does as far as `searched` [m]. `degeneracy` says why a part of the edge has no
    image, `doubt` which error is over its limit there and not at the centre.
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
        """That of one case, with its mission."""
        edges = corrections.edges
        (size, rim), (difference, azimuth) = (map(float, one.of(case)) for one in (edges.rim, edges.largest))
        radius, nowhere = float(edges.radius[case]), (math.nan, 0.0, None)
        if math.isinf(size):
            reason = phrases.no_image_at_the_edge(math.degrees(rim), _degeneracy(mission, at(radius, rim)))
            return cls(radius, *nowhere, FARTHEST * float(edges.phases.nearest[case]), reason, NOTHING)
        searched = float(corrections.farthest[case])
        if math.isinf(difference):
            return cls(radius, *nowhere, searched, phrases.no_image(), NOTHING)
        served, doubt, worst = float(corrections.served[case]), NOTHING, int(edges.over[:, case].argmax())
        if edges.over[worst, case]:
            over, limit = float(edges.over[worst, case]), float(edges.limit[worst, case])
            doubt = phrases.over_at_the_edge(edges.names[worst], over, limit)
        within = None if math.isinf(served) else served
        return cls(radius, difference, azimuth, within, searched, NOTHING, doubt)

    def notes(self, total: float) -> tuple[Note, ...]:
        """Where the difference is largest, and how far one autofocus correction serves."""
        if not self.difference:
            return (phrases.same_at_the_edge(),)
        largest = phrases.largest_at_the_edge(math.degrees(self.azimuth), self.radius)
        return (largest, phrases.one_correction_serves(self.served, total))

    @property
    def served(self) -> str:
        """How far one correction serves, in words."""
        if self.autofocus_radius is None:
            return f"farther than {format_quantity(self.searched, 'm', 3, 'down')} out"
        return f"out to {format_quantity(self.autofocus_radius, 'm', 3, 'down')}"


def _degeneracy(mission: Mission, place: GroundVector) -> str:
    """Why a place of the ground has no image."""
    (east, north), geometry = place, mission.geometry
    transmitter, receiver = (
        replace(state, position=(state.position[0] - east, state.position[1] - north, state.position[2]))
        for state in (geometry.transmitter, geometry.receiver)
    )
    there = BistaticGeometry(transmitter=transmitter, receiver=receiver)
    if min(there.transmitter.slant_range, there.receiver.slant_range) < NEAREST_M:
        return phrases.platform_at_the_edge(NEAREST_M)
    reason = degeneracy(there, mission.radar, mission.collection.aperture_time)
    return reason or phrases.gradients_become_parallel()
