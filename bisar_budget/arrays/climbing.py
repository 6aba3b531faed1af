"""Climbing to the highest places of many circles at once: the arrays beside `tops` and `climbed` of `analysis.scene`.

A climber is a place of the circle of one case; a case may have several. What is looked at is what the floats look at,
in their order.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.analysis import scene as scalar
from bisar_budget.ranges.exact_ranges import Floats

Places = NDArray[np.intp]
HeightAt = Callable[[Floats, Places], Floats]  # heights at azimuths of the circles of some cases


class Heights(NamedTuple):
    """The highest that was found of each: height and azimuth; of heights alike the larger azimuth, as of tuples."""

    height: Floats
    azimuth: Floats

    def or_higher(self, other: "Heights") -> "Heights":
        """The higher of two, one by one."""
        is_other = (other.height > self.height) | ((other.height == self.height) & (other.azimuth > self.azimuth))
        return self.where(is_other, other)

    def where(self, is_other: NDArray[np.bool_], other: "Heights") -> "Heights":
        """These, but in some places the others."""
        height, azimuth = (np.where(is_other, *pair) for pair in zip(other, self, strict=True))
        return Heights(height, azimuth)

    def of(self, some: NDArray[Any]) -> "Heights":
        """Some of them."""
        return Heights(self.height[some], self.azimuth[some])


class Tops(NamedTuple):
    """Where climbers arrived, and whose they are."""

    cases: Places
    top: Heights

    def highest(self, count: int) -> Heights:
        """The highest of each of `count` cases; minus infinity where none climbed."""
        found = Heights(np.full(count, -math.inf), np.zeros(count))
        order = np.lexsort((self.top.azimuth, self.top.height, self.cases))
        cases, top = self.cases[order], self.top.of(order)
        is_last = np.diff(cases, append=count) > 0
        for kept, column in zip(found, top, strict=True):
            kept[cases[is_last]] = column[is_last]
        return found


def joined(tops: list[Tops]) -> Tops:
    """Climbers of several climbs."""
    cases, heights = zip(*tops, strict=True)
    height, azimuth = (np.concatenate(column) for column in zip(*heights, strict=True))
    return Tops(np.concatenate(cases), Heights(height, azimuth))


def tops(heights: Floats, height_at: HeightAt, floor: float = -math.inf, rough: float | None = None) -> Tops:
    """Climb from each of the even points of circles, (points, cases), that is above its neighbours; as `_tops`."""
    count, cases = heights.shape
    arc = 2 * math.pi / count
    before, after = np.roll(heights, 1, axis=0), np.roll(heights, -1, axis=0)
    _, crests = crest(before, after, heights, arc)
    is_start = (heights >= np.maximum(before, after)) & (crests > floor)
    crests = np.where(is_start, crests, -math.inf)
    order = np.argsort(-crests, axis=0, kind="stable")
    best = np.full(cases, -math.inf)
    found = [Tops(np.zeros(0, dtype=np.intp), Heights(np.zeros(0), np.zeros(0)))]
    for points in order:
        of_all = crests[points, np.arange(cases)]
        climbs = of_all > -math.inf
        if rough is not None:
            climbs &= of_all + rough * np.abs(of_all) >= best
        some = np.flatnonzero(climbs)
        if not some.size:
            break
        at = points[some], some
        top = climbed(height_at, some, (before[at], after[at]), Heights(heights[at], arc * points[some]), arc)
        best[some] = np.maximum(best[some], top.height)
        found.append(Tops(some, top))
    return joined(found)


def climbed(height_at: HeightAt, cases: Places, sides: tuple[Floats, Floats], start: Heights, arc: float) -> Heights:
    """Climb to the highest near places whose sides, an arc away, are no higher; as `_climbed`."""
    found, place, here = start, np.arange(cases.size), start
    for _ in range(scalar.CLIMBS):
        offset, crests = crest(*sides, here.height, arc)
        azimuth = here.azimuth + offset
        there = Heights(height_at(azimuth, cases[place]), azimuth)
        found = _noted(found, place, there)
        going = np.flatnonzero(~(np.abs(there.height - crests) <= scalar.LIKE_A_COSINE * np.abs(crests)))
        if not going.size:
            break
        place, here = place[going], here.of(going).or_higher(there.of(going))
        arc /= 4
        around = [Heights(height_at(side, cases[place]), side) for side in (here.azimuth - arc, here.azimuth + arc)]
        for one in around:
            found = _noted(found, place, one)
        sides = (around[0].height, around[1].height)
    return found


def _noted(found: Heights, place: Places, there: Heights) -> Heights:
    better = found.of(place).or_higher(there)
    noted = Heights(found.height.copy(), found.azimuth.copy())
    noted.height[place], noted.azimuth[place] = better
    return noted


def crest(before: Floats, after: Floats, middle: Floats, arc: float) -> tuple[Floats, Floats]:
    """Offset from the middle of three points an arc apart to the crest of the cosine through them, and its height."""
    sine = (after - before) / (2 * math.sin(arc))
    cosine = (middle - (after + before) / 2) / (1 - math.cos(arc))
    offset = np.clip(np.arctan2(sine, cosine), -arc, arc)
    return offset, middle - cosine + np.hypot(sine, cosine)
