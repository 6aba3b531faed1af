"""The scene's edge: how far a quadratic phase error there differs from the one at the centre.

The paper's errors are spatially invariant; in the full model they are not. At a point p of the scene both platforms
have other lines of sight: exact ranges are taken there, with p in place of the
centre. One autofocus correction is one phase for the whole image, so that it leaves the difference behind. Against
exact ranges and against images at 250 m and 1 km: `tests/simulate/test_scene_edge.py`. Derived here.

What gates is the difference against the total budget, without the gain of autofocus: that is what must be left of any
error after a correction. Without autofocus it is what the edge has more than the centre, where the rows stand; then,
and with a correction that has its own bound, an edge whose phase itself exceeds a limit is a warning.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property, partial
from operator import add
from typing import NamedTuple

import numpy as np

from bisar_budget import phrases
from bisar_budget.analysis.allocation import Allocation
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.constants import MIN_GRADIENT_ANGLE_DEG, MIN_GROUND_GRADIENT, UTILIZATION_TOLERANCE
from bisar_budget.effects.combined import combined, phase_parts
from bisar_budget.geometry import BistaticGeometry, GroundVector
from bisar_budget.phrases import NOTHING, Note
from bisar_budget.ranges.exact_ranges import ExactRanges, joined
from bisar_budget.ranges.point_paths import PointPaths
from bisar_budget.units import format_quantity

RIM_POINTS = 16
WIDE = 0.1  # of the nearest slant range; beyond, twice as many
LIKE_A_COSINE = 1e-4  # as near to the crest of a cosine; its azimuth is then right to a degree
ROUGH = 0.1  # by so much, of itself, a crest through points of the rim may be off
CLIMBS = 5  # until then, each in a quarter of the arc before
NARROW = 10.0  # of a place's clearances; below, it is looked at whatever its difference
MIN_SINE = math.sin(math.radians(MIN_GRADIENT_ANGLE_DEG))
NEAREST_M = 1.0  # of a platform to a place; nearer, no image
_FARTHEST = 0.5  # of the nearest slant range: the search for a radius ends there
_PRECISION = 1e-3  # of the radius
_ALIKE = 5e-3  # of the total: so near to it, large errors need no search of their own
_TURNS = 2  # of the azimuth along which it is searched; then it is the whole circle's
PROBES = 3
FLOOR_RAD, SHARE = 1e-4, 3e-4  # of the largest difference: what one error may differ by and be taken as small
FINEST = 1e-3  # rad, of the azimuth of a largest difference: a cosine loses half its square
MAY_FOLD = 0.7  # of what gradients span without an error: with less left of it a point may have no image nearby


class SceneEdge(NamedTuple):
    """What the edge of the scene adds.

    `difference` is the largest of the quadratic phases between edge and centre, combined as the mission says [rad],
    at `azimuth` on the rim. `autofocus_radius` is that within which it stays inside the total budget [m]; None where
    it does as far as `searched` [m], which is 0 if nobody asked. `degeneracy` says why a part of the edge has no
    image, `doubt` which error is over its limit there and not at the centre.
    """

    radius: float
    difference: float
    azimuth: float
    autofocus_radius: float | None
    searched: float
    degeneracy: Note
    doubt: Note

    def notes(self, total: float) -> tuple[Note, ...]:
        """Where the difference is largest, and how far one autofocus correction serves."""
        if not self.difference:
            return (phrases.same_at_the_edge(),)
        largest = phrases.largest_at_the_edge(math.degrees(self.azimuth), self.radius)
        return (largest, phrases.one_correction_serves(self.served, total)) if self.searched else (largest,)

    @property
    def served(self) -> str:
        """How far one correction serves, in words."""
        if self.autofocus_radius is None:
            return f"farther than {format_quantity(self.searched, 'm', 3, 'down')} out"
        return f"out to {format_quantity(self.autofocus_radius, 'm', 3, 'down')}"


class ScenePhases:
    """Quadratic phases of the declared errors at any point of the scene.

    Of errors so small that their effects are proportional to them; `large` are the others, by their place among
    the members.
    """

    def __init__(self, analysis: Analysis) -> None:
        mission = analysis.mission
        self.geometry, self.full = analysis.geometry, analysis.full
        self.combine, self.groups = mission.allocation.combine, analysis.groups
        self.members = [source for source in analysis.stated if source.is_motion]
        self.sizes = [source.declared or 0.0 for source in self.members]
        self.centre = [source.full.qpe * size for source, size in zip(self.members, self.sizes, strict=True)]
        self.large = [
            i
            for i, (source, size) in enumerate(zip(self.members, self.sizes, strict=True))
            if size and not self.full.is_small(source, abs(size))
        ]
        self.nearest = min(self.geometry.transmitter.slant_range, self.geometry.receiver.slant_range)
        self.nowhere = RimPlace(self.centre, 0.0, (0.0, 0.0))  # without an image
        self.exact, self.errors = analysis.exact, analysis.errors
        self.turn = math.copysign(1.0, self.exact.sine[0])
        self.lanes = [analysis.errors.lanes(source) for source in self.members]

    def geometry_at(self, point: GroundVector) -> BistaticGeometry:
        """Both platforms as a point of the ground has them."""
        states = (self.geometry.transmitter, self.geometry.receiver)
        transmitter, receiver = (
            replace(s, position=(s.position[0] - point[0], s.position[1] - point[1], s.position[2])) for s in states
        )
        return BistaticGeometry(transmitter=transmitter, receiver=receiver)

    def ranges_at(self, radius: float, azimuths: Sequence[float]) -> ExactRanges:
        """Exact ranges of points of a circle on the ground, one a case."""
        east, north = np.array([at(radius, azimuth) for azimuth in azimuths]).T
        return self.exact.at(east, north, np.zeros(len(azimuths), dtype=int))

    def place(self, radius: float, azimuth: float) -> "RimPlace":
        """What there is at a point of the ground."""
        return self.places(self.ranges_at(radius, [azimuth]))[0]

    @np.errstate(all="ignore")  # a gradient vanishes, or both are parallel to the last digit
    def places(self, there: ExactRanges) -> "list[RimPlace]":
        """What there is where exact ranges are taken."""
        per_unit = np.array(there.quadratics_of(self.lanes))
        phases = np.broadcast_to(per_unit.T, (there.half.size, len(self.lanes))) * self.sizes
        clearances = np.array((self.turn * there.sine / MIN_SINE, there.range_gradient / MIN_GROUND_GRADIENT))
        is_seen = (there.nearest >= NEAREST_M) & np.isfinite(clearances.sum(axis=0) + phases.sum(axis=1))
        found = []
        for is_there, of_errors, (sine, gradient) in zip(
            is_seen.tolist(), phases.tolist(), clearances.T.tolist(), strict=True
        ):
            whole = RimPlace(of_errors, self.combined(of_errors), (sine, gradient)) if is_there else self.nowhere
            found.append(whole)
        return found

    def differences(self, radius: float, azimuth: float) -> list[float]:
        """Phase of each error there less that at the centre; by the worse sign of the large ones. [rad]"""
        return self.around(radius, [azimuth], self.large)[0][0]

    def around(
        self, radius: float, azimuths: Sequence[float], exact: Sequence[int]
    ) -> list[tuple[list[float], float]]:
        """The same at places of a circle, some of the members taken exactly, by their indices.

        With what range and Doppler gradients span where these lead, over what they span without them, at least: 0
        where there is no image.
        """
        there = self.ranges_at(radius, azimuths)
        count = len(azimuths)
        phases = np.array([place.phases for place in self.places(there)]) - self.centre
        turns = np.ones(count)
        if exact:
            signs = (1.0, -1.0)
            small = [there.effect(there.range_error(self.lanes[i])) for i in exact]
            per_unit = [there.displacement(effect, sign) for effect in small for sign in signs]
            lanes = joined([self.errors.lanes(self.members[i], sign) for i in exact for sign in signs])
            lanes = lanes.of(np.repeat(np.arange(lanes.case.size), count))
            lanes = replace(lanes, case=np.tile(np.arange(count), 2 * len(exact)))
            paths = PointPaths(there, lanes, np.array(per_unit).swapaxes(0, 1).reshape(2, -1))
            sizes = np.repeat(np.abs([self.sizes[i] for i in exact]), 2 * count)
            every = np.arange(sizes.size)
            paths.to(every, sizes)
            known = paths.known(every, sizes).reshape(6, len(exact), 2, count)
            turns = np.nan_to_num(known[5]).min(axis=(0, 1))
            for i, away in zip(exact, known[3], strict=True):
                here = [self.full.at(self.members[i], sign * abs(self.sizes[i])) for sign in signs]
                centre = np.array([math.nan if one is None else one.quadratic for one in here])
                differs = np.abs(away - centre[:, None])
                worst = np.where(np.isnan(differs), math.inf, differs).max(axis=0)
                phases[:, i] = np.copysign(worst, phases[:, i])
        return list(zip(phases.tolist(), turns.tolist(), strict=True))

    def exactly(self, phases: Sequence[float]) -> list[float]:
        """Phases with what large errors have more at the centre than small ones, by the worse sign. [rad]"""
        return list(map(add, phases, self._more))

    @cached_property
    def _more(self) -> list[float]:
        more = [0.0] * len(self.members)
        for i in self.large:
            more[i] = self.full.does(self.members[i], self.sizes[i]).qpe - self.centre[i]
        return more

    def largest(self, rim: "Rim", radius: float) -> tuple[float, float]:
        """Largest difference on a circle, errors of any size counted, and its azimuth. [rad], [rad]

        It is climbed from the highest of some places of the circle, and of where it is largest of small errors.
        """
        if not self.large:
            return rim.difference, rim.azimuth
        bent = self._bent(rim, radius)
        azimuth = self._climbed(rim, radius, bent) if bent else rim.azimuth
        return self.together(self.differences(radius, azimuth)), azimuth

    def _climbed(self, rim: "Rim", radius: float, bent: list[int]) -> float:
        """Azimuth of the largest difference, or of a place without an image, some errors taken exactly. [rad]

        Where gradients become parallel the image ends, on an arc that may lie between the places that are looked at:
        it is also sought where they are nearest to parallel.
        """
        seen: list[tuple[float, float]] = []  # least turn, and azimuth

        def look(azimuths: Sequence[float]) -> tuple[float, float]:
            found = self.around(radius, azimuths, bent)
            seen.extend((turn, azimuth) for (_, turn), azimuth in zip(found, azimuths, strict=True))
            return max((self.together(sizes), azimuth) for (sizes, _), azimuth in zip(found, azimuths, strict=True))

        arc = math.pi / RIM_POINTS
        size, azimuth = look([rim.azimuth, *(2 * arc * place for place in range(RIM_POINTS))])
        while arc > FINEST and math.isfinite(size):
            side = look([azimuth - arc, azimuth + arc])
            if side[0] > size:
                size, azimuth = side
            else:
                arc /= 4
        turn, lowest = min(seen)
        arc = math.pi / RIM_POINTS
        while math.isfinite(size) and turn < MAY_FOLD and arc > FINEST:
            size, azimuth = max((size, azimuth), look([lowest - arc, lowest + arc]))
            if min(seen)[0] < turn:
                turn, lowest = min(seen)
            else:
                arc /= 4
        return azimuth % (2 * math.pi)

    def _bent(self, rim: "Rim", radius: float) -> list[int]:
        """Which of the large errors differ otherwise than small ones do: seen at three places, two harmonics show."""
        found = set[int]()
        floor = max(FLOOR_RAD, SHARE * rim.difference)
        thirds = [rim.azimuth + 2 * math.pi * third / PROBES for third in range(PROBES)]
        both = (self.around(radius, thirds, which) for which in ((), self.large))
        for (small, _), (exact, _) in zip(*both, strict=True):
            found |= {i for i in self.large if not abs(exact[i] - small[i]) <= floor}
        return sorted(found)

    def combined(self, phases: Sequence[float]) -> float:
        """Differences of phases to the centre's, combined: the largest, their sum or root-sum-square. [rad]"""
        return self.together([there - c for there, c in zip(phases, self.centre, strict=True)])

    def together(self, phases: Sequence[float], indices: Sequence[int] | None = None) -> float:
        """Phases of the errors, or of some of them, combined; those of a covariance with their correlations. [rad]"""
        if not self.groups or self.combine != "rss":
            return float(combined(phases if indices is None else [phases[i] for i in indices], self.combine))
        return float(combined([phase for _, phase in self.parts(phases, indices)], self.combine))

    def parts(self, phases: Sequence[float], indices: Sequence[int] | None = None) -> list[tuple[str, float]]:
        """What they combine from: ids and phases, of a covariance one under `rss`. [rad]"""
        chosen = range(len(self.members)) if indices is None else indices
        return phase_parts([(self.members[i].id, phases[i]) for i in chosen], self.combine, self.groups)

    def rim(self, radius: float) -> "Rim":
        """Evaluate a circle evenly, and around its worst point.

        That is where the difference is largest; and where a clearance is least, if it comes near to 1: a difference
        grows there as its inverse, in an arc that points of a circle may miss.
        """
        count = RIM_POINTS if radius <= WIDE * self.nearest else 2 * RIM_POINTS
        places = self.places(self.ranges_at(radius, [2 * math.pi * k / count for k in range(count)]))
        phases = [place.phases for place in places]

        def size_at(azimuth: float) -> float:
            return self.place(radius, azimuth).size

        narrow = []
        for which in (0, 1):

            def nearness_at(azimuth: float, which: int = which) -> float:
                return -self.place(radius, azimuth).clearances[which]

            # None is left out: a valley that is milder at the points may be the deeper one between them.
            narrow += _tops([-place.clearances[which] for place in places], nearness_at, -NARROW)
        nearness, azimuth = max(narrow, default=(-math.inf, 0.0))
        if nearness >= -1:
            return Rim(azimuth % (2 * math.pi), math.inf, phases, self.centre)
        tops = _tops([place.size for place in places], size_at, rough=ROUGH)
        arc = math.pi / count / 8
        for _, azimuth in narrow:
            sides = (size_at(azimuth - arc), size_at(azimuth + arc))
            tops.append(_climbed(size_at, sides, size_at(azimuth), azimuth, arc))
        size, azimuth = max(tops)
        return Rim(azimuth % (2 * math.pi), size, phases, self.place(radius, azimuth).phases)


class RimPlace(NamedTuple):
    """A place of the scene: quadratic phase of each error there, signed; how far they are from the centre's. [rad]

    There is an image where both `clearances` are above 1: the sine between range and Doppler gradient, and the range
    gradient, over the least of each. The sine has the centre's sign: below zero, they are parallel on the way.
    """

    phases: list[float]
    size: float
    clearances: tuple[float, float]

    @property
    def has_image(self) -> bool:
        """Whether an image can be formed there."""
        return min(self.clearances) > 1


class Rim(NamedTuple):
    """A circle about the centre: where the largest difference is, that difference, phases around it and there. [rad]

    Where a part of it has no image the difference is infinite.
    """

    azimuth: float
    difference: float
    phases: list[list[float]]
    worst: list[float]


def _tops(
    heights: Sequence[float],
    height_at: Callable[[float], float],
    floor: float = -math.inf,
    rough: float | None = None,
) -> list[tuple[float, float]]:
    """Climb from each of the even points of a circle that is above its neighbours: heights and azimuths of the tops.

    Left out are those that do not seem to rise above a floor and, given a part by which that may be off, those that
    seem to stay below the highest by more.
    """
    count = len(heights)
    arc = 2 * math.pi / count
    starts = []
    for k, height in enumerate(heights):
        sides = (heights[k - 1], heights[(k + 1) % count])
        if height >= max(sides):
            starts.append((_crest(*sides, height, arc)[1], sides, height, arc * k))
    tops: list[tuple[float, float]] = []
    for crest, sides, height, azimuth in sorted(starts, reverse=True):
        if crest > floor and (rough is None or not tops or crest + rough * abs(crest) >= max(tops)[0]):
            tops.append(_climbed(height_at, sides, height, azimuth, arc))
    return tops


def _climbed(
    height_at: Callable[[float], float], sides: tuple[float, float], height: float, azimuth: float, arc: float
) -> tuple[float, float]:
    """Climb to the highest near a place of a circle whose sides, an arc away, are no higher: height and azimuth.

    Linear in the radius, a height is a constant and a cosine of the azimuth. Where its crest does not tell what is
    found there, that is looked for again in a quarter of the arc.
    """
    found = [(height, azimuth)]
    for _ in range(CLIMBS):
        offset, crest = _crest(*sides, height, arc)
        there = (height_at(azimuth + offset), azimuth + offset)
        found.append(there)
        if abs(there[0] - crest) <= LIKE_A_COSINE * abs(crest):
            break
        height, azimuth = max(there, (height, azimuth))
        arc /= 4
        sides = (height_at(azimuth - arc), height_at(azimuth + arc))
        found += [(sides[0], azimuth - arc), (sides[1], azimuth + arc)]
    return max(found)


def _crest(before: float, after: float, middle: float, arc: float) -> tuple[float, float]:
    """Offset from the middle of three points an arc apart to the crest of the cosine through them, and its height."""
    sine = (after - before) / (2 * math.sin(arc))
    cosine = (middle - (after + before) / 2) / (1 - math.cos(arc))
    return max(-arc, min(arc, math.atan2(sine, cosine))), middle - cosine + math.hypot(sine, cosine)


def at(radius: float, azimuth: float) -> GroundVector:
    """Point of the ground, east and north. [m]"""
    return (radius * math.cos(azimuth), radius * math.sin(azimuth))


def scene_edge(analysis: Analysis, allocation: Allocation) -> SceneEdge | None:
    """Evaluate the errors of a mission at the edge of its scene; None without a radius or a declared error.

    Parameters
    ----------
    analysis : Analysis
        Of a mission with `scene.radius`.
    allocation : Allocation
        Total budget, and limits of the owners.
    """
    radius = analysis.mission.scene.radius
    edge = ScenePhases(analysis)
    if radius is None or not edge.members:
        return None
    searched = _FARTHEST * edge.nearest
    rim = edge.rim(radius)
    if math.isinf(rim.difference):
        why = _degeneracy(edge.geometry_at(at(radius, rim.azimuth)))
        reason = phrases.no_image_at_the_edge(math.degrees(rim.azimuth), why)
        return SceneEdge(radius, math.nan, 0.0, None, searched, reason, NOTHING)
    searched = max(searched, radius)
    difference, azimuth = edge.largest(rim, radius)
    if math.isinf(difference):
        return SceneEdge(radius, math.nan, 0.0, None, searched, phrases.no_image(), NOTHING)
    reach = None
    if analysis.is_bare:
        searched = 0.0
    else:
        reach = _autofocus_radius(edge, radius, rim, allocation.qpe_total, searched)
    doubt = _over_at_the_edge(edge, allocation, rim)
    return SceneEdge(radius, difference, azimuth, reach, searched, NOTHING, doubt)


def _degeneracy(there: BistaticGeometry) -> str:
    if min(there.transmitter.slant_range, there.receiver.slant_range) < NEAREST_M:
        return phrases.platform_at_the_edge(NEAREST_M)
    return there.degeneracy() or phrases.gradients_become_parallel()


def _autofocus_radius(edge: ScenePhases, radius: float, rim: Rim, total: float, searched: float) -> float | None:
    """Radius at which the largest difference reaches the total; None if it does not by `searched`. [m]"""
    found = _radius_of_small(edge, radius, rim, total, searched)
    if not edge.large:
        return found

    def size_at(radius: float) -> float:
        around = edge.rim(radius)
        return around.difference if math.isinf(around.difference) else edge.largest(around, radius)[0]

    high = searched if found is None else found
    low, below, size = 0.0, 0.0, size_at(high)
    if abs(size - total) <= _ALIKE * total:
        return found
    while size <= total and high < searched:
        low, below, high = high, size, min(searched, high * max(1.05, min(4.0, 1.05 * total / size)))
        size = size_at(high)
    return None if size <= total else _where(size_at, total, (low, below), (high, size))[0]


def _radius_of_small(edge: ScenePhases, radius: float, rim: Rim, total: float, searched: float) -> float | None:
    """The same, were effects of all errors proportional to them.

    Along the worst azimuth, and again where the rim at the radius found has a worse one.
    """
    azimuth, size, high = rim.azimuth, rim.difference, radius
    if not size:
        return None
    for _ in range(_TURNS):
        size_at = partial(_size_or_beyond, edge, azimuth)
        low = inside = 0.0
        while size <= total and high < searched:
            low, inside = high, size
            high = min(searched, high * max(1.05, min(4.0, 1.05 * total / size)))
            size = size_at(high)
        if size > total:
            low, high = _where(size_at, total, (low, inside), (high, size))
        found = edge.rim(low if size > total else high)
        if found.difference <= total * (1 + _PRECISION):
            return None if size <= total else low
        azimuth, size, high = found.azimuth, found.difference, low if size > total else high
    return _where(lambda radius: edge.rim(radius).difference, total, (0.0, 0.0), (high, size))[0]


def _size_or_beyond(edge: ScenePhases, azimuth: float, radius: float) -> float:
    place = edge.place(radius, azimuth)
    return place.size if place.has_image else math.inf


def _where(
    size_at: Callable[[float], float], total: float, inside: tuple[float, float], outside: tuple[float, float]
) -> tuple[float, float]:
    """Radii, to a thousandth, between which a size passes a total: the secant between both, drawn near (Illinois)."""
    (low, below), (high, above) = inside, outside
    goal = total * (1 - _PRECISION / 2)
    below, above = below - goal, above - goal
    if below > 0:  # as near as asked for
        return low, low
    was_inside = None
    while high - low > _PRECISION * high:
        share = 0.5 if math.isinf(above) else below / (below - above)
        middle = low + share * (high - low)
        over = size_at(middle) - goal
        is_inside = over <= total - goal
        if is_inside and over > -(total - goal):
            return middle, middle
        if is_inside:
            low, below = middle, over
            above = above / 2 if was_inside else above  # twice on one side: draw the other nearer
        else:
            high, above = middle, over
            below = below / 2 if was_inside is False else below
        was_inside = is_inside
    return low, high


def _over_at_the_edge(edge: ScenePhases, allocation: Allocation, rim: Rim) -> Note:
    """Say which error is inside its limit at the centre and over it at the edge; else nothing."""
    gain, rule = allocation.autofocus_gain, edge.combine
    centre, *around, worst_place = (edge.exactly(phases) for phases in (edge.centre, *rim.phases, rim.worst))
    owners = ["transmitter", "receiver", "clock", "mission"]
    if rule == "each":
        groups = [(s.id, [i], allocation.qpe_limit(s.owner) * gain) for i, s in enumerate(edge.members)]
    else:
        groups = [
            (
                f"{owner}.quadratic_phase_error",
                [i for i, s in enumerate(edge.members) if allocation.qpe.includes(s.owner, owner)],
                allocation.qpe_limit(owner) * gain,
            )
            for owner in owners
        ]
    worst = ("", 0.0, 0.0)
    for name, indices, limit in groups:
        if edge.together(centre, indices) > limit * (1 + UTILIZATION_TOLERANCE):
            continue  # its own row says so
        sizes = [edge.together(there, indices) for there in around]
        top, count = max(range(len(sizes)), key=sizes.__getitem__), len(sizes)
        _, crest = _crest(sizes[top - 1], sizes[(top + 1) % count], sizes[top], 2 * math.pi / count)
        phase = max(crest, edge.together(worst_place, indices))
        if phase > limit * (1 + UTILIZATION_TOLERANCE) and phase > worst[1]:
            worst = (name, phase, limit)
    name, phase, limit = worst
    return phrases.over_at_the_edge(name, phase, limit) if name else NOTHING
