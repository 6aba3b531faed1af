"""Where errors take the image of a point as they grow, and the first size at which each reaches a limit.

The point is followed from no error on. Its way ends where half a cycle is hidden and the gradients of V span less
than a fifth of the area that they span at the centre: no ground point has the range history of a larger error, which
counts as a limit reached. Where a way only comes near to a fold, nothing is hidden, and the way goes on. All lanes
take each step together, and of a few lanes several points; a search looks at what is known after each step and says
where to look next.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from bisar_budget.constants import ROUNDING
from bisar_budget.ranges.exact_ranges import AT_FOLD, ENDS_RAD, FOLDED, ExactRanges, Floats, Lanes, Places, Truths

STRAY = 0.15  # of a step; farther from where it led, a point is not the one that was followed
FADES = 0.3  # of a displacement, within which a peak that is lost at a fold has faded into another
STRAIGHT = 0.1  # of a displacement, by which it may be off a straight way
FLOOR_M = 1e-3
FINEST_STEP = 1e-6  # where the gradients stay apart, the way only turns
OF_FOLD = 0.8  # of the way to where the gradients seem to become parallel, that one step makes
SHORT = 0.1  # of the last step, below which that step says little of the way left
BESIDE_END = 1e-6  # of the size: so near to both sides of an end it is one, to 1e-9
CLOSE = 1e-5  # of a limit, where a search ends
ALMOST = 0.002  # of a limit, from where a curve leads to it
BENDS = 0.1  # of a slope: what changes more within an interval is bent, and a curve through its ends misses more
ALMOST_BENT = 3e-5  # of a limit, from where a curve leads to it there
CREST = 0.01  # of a limit: so little below it, the crest of a curve through few points may be above
STEEP = 2.0  # square of a value over its limit, from where a power leads to the limit better than a cubic
DEPARTS = 0.5  # of the limit: a value so far from a straight line may have been anywhere in between
COARSE = 0.02  # of the size: within a shorter interval a curve is trusted
GROWTH = 1.5  # of a size in a step
ROUNDS = 100  # of a search; none is known that takes more than 25
NEWTON = 3  # steps on a cubic
FEW = 256  # lanes: of so few, several points cost as much as one
LADDER = np.array((0.25, 0.5, 0.75, 1.3, 2.0))  # of the way to the size that is looked at first
BESIDE = np.array((0.98, 0.996, 1.004, 1.02))  # of a size at which a limit is likely to be reached
MORE = GROWTH ** np.arange(1, 5)  # of a size in a step, that are tried too
EARLY = 0.125  # of a size, at which the way tells how it bends from no error on
PARTS = np.array((0.25, 0.5, 1.2, 2.0, 4.0))  # of a step that are tried too

QUADRATIC, CUBIC, WAY = range(3)  # what is held to a limit: a phase, or the way to the point
ROWS, HIDDEN = 8, 5  # of a known point: its size, and what `Found` has of it
_NO_ERROR = np.array((0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))


class Held(NamedTuple):
    """Searches for the first size at which what is held in lanes reaches a limit, (searches,).

    `row` is QUADRATIC, CUBIC or WAY, and `gain` the factor by which autofocus lets quadratic phases be larger, which
    the hidden phase is not allowed. Each looks at `first` first, where a small error would reach its limit, and ends
    at `most` or where another of its `group` has found a smaller size; where `is_alone`, of its own row.
    """

    lane: Places
    row: Places
    limit: Floats
    gain: Floats
    first: Floats
    most: Floats
    group: Places
    is_alone: Truths

    def of(self, some: Any) -> "Held":
        """Some of the searches."""
        return Held(*(part[some] for part in self))

    def square(self, known: Floats) -> Floats:
        """Square of the value over the limit at known points, (ROWS, searches, points): smooth, where a value is not.

        That of a phase or of a way.
        """
        row, gain = self.row[:, None], self.gain[:, None]
        _, east, north, quadratic, cubic, hidden, _, _ = known
        found = np.where(row == QUADRATIC, quadratic**2 + (gain * hidden) ** 2, cubic**2)
        found = np.where(row == WAY, east**2 + north**2, found)
        return np.asarray(found / self.limit[:, None] ** 2)


def is_few(lanes: int, is_alike: bool) -> bool:
    """Whether several points of so many lanes are looked at together."""
    return is_alike or lanes < FEW


class PointPaths:
    """The ways of the point by errors, one a lane.

    Parameters
    ----------
    exact : ExactRanges
        Of the cases.
    lanes : Lanes
        The errors, each with its sign.
    per_unit : (2, lanes)
        Displacement by a small unit of each. [m/unit]
    is_alike : bool
        Look at as many points of each lane as of few lanes, so that what is found of a case does not depend on how
        many there are.

    Attributes
    ----------
    end : (lanes,)
        Size from which there is no point; infinite where none is known.
    """

    def __init__(self, exact: ExactRanges, lanes: Lanes, per_unit: Floats, *, is_alike: bool = False) -> None:
        self.exact, self.lanes, self._is_alike = exact, lanes, is_alike
        count = lanes.case.size
        self.end = np.full(count, math.inf)
        self._way = per_unit
        self._known = np.full((ROWS, count, 2), math.inf)  # by size; infinite where there is none
        self._known[:, :, 0] = _NO_ERROR[:, None]
        self._step = np.full(count, math.inf)  # the longest that is tried
        self._step_from = np.zeros(count)  # where: from sizes that are no smaller
        self._is_lost = np.zeros(count, dtype=bool)  # whether the last one led nowhere
        self._turns = np.zeros(count, dtype=bool)  # whether any one did: how the way begins no longer leads on

    def _at(self, index: Places, some: Places) -> Floats:
        """Known points by their places, (ROWS, some)."""
        found: Floats = self._known[:, some, index]
        return found

    def known(self, some: Places, size: Floats) -> Floats:
        """Known points by errors of sizes that `to` was asked for, (ROWS, some); not a number where the way ended."""
        found = self._at((self._known[0, some] <= size[:, None]).sum(axis=1) - 1, some)
        found[:, (found[0] != size) | (size >= self.end[some])] = math.nan
        return found

    # ---------------------------------------------------------------- one step
    @np.errstate(all="ignore")
    def to(self, some: Places, size: Floats) -> None:
        """Follow the point to a size in some lanes."""
        while True:
            going = (size < self.end[some]) & (self._known[0, some] != size[:, None]).all(axis=1)
            if not going.any():
                return
            some, size = some[going], size[going]
            self._follow(some, size)

    def _follow(self, some: Places, size: Floats) -> None:
        """Follow the point toward sizes in lanes, that may be there twice: a step from the known one before each."""
        index = (self._known[0, some] < size[:, None]).sum(axis=1) - 1
        last = self._at(index, some)
        fold = self._to_fold(index, some, last)
        longest = np.where(last[0] >= self._step_from[some], self._step[some], math.inf)
        step = np.minimum(longest, np.where(fold > FINEST_STEP * last[0], OF_FOLD * fold, math.inf))
        # A little beyond a step is one step too; but where that led nowhere, it would again.
        is_short = size - last[0] >= np.where(self._is_lost[some] & np.isfinite(longest), 1.0, 1.2) * step
        asked, size = size, np.where(is_short, last[0] + step, size)
        if is_few(some.size, self._is_alike) and is_short.any():
            more = (last[0] + np.multiply.outer(PARTS, step))[:, is_short]
            size = np.concatenate((size, _upto(more, asked[is_short]).ravel()))
            some, index, fold = (
                np.concatenate((one, np.tile(one[is_short], PARTS.size))) for one in (some, index, fold)
            )
        order = np.lexsort((size, some))
        lane, before = some[order], size[order]
        is_new = np.ones(order.size, dtype=bool)
        is_new[1:] = (lane[1:] != lane[:-1]) | (before[1:] - before[:-1] > ROUNDING * before[1:])
        order = order[is_new]
        some, index, size, fold = some[order], index[order], size[order], fold[order]
        last = self._at(index, some)
        near = self._guess(index, some, last, size)
        found = self.exact.phases(self.lanes.of(some), size, near)
        point = np.array((size, *found[1:]))
        is_on = found.is_found & _is_on_the_way(last, point, near)
        begins = np.ones(some.size, dtype=bool)
        begins[1:] = (some[1:] != some[:-1]) | (index[1:] != index[:-1])
        later = np.flatnonzero(~begins & ~is_on & found.is_found)
        if later.size:  # which the steps before lead to as well
            one, two = point[:, later - 1], np.where(begins[later - 1], last[:, later], point[:, later - 2])
            earlier = np.where(begins[later - 1], self._at(np.maximum(index - 1, 0), some)[:, later], last[:, later])
            is_on[later] = _is_on_the_way(one, point[:, later], _through(earlier, two, one, size[later]))
        lost = np.flatnonzero(~is_on & (last[-1] < AT_FOLD))
        if lost.size:  # at a fold a peak fades into a wider one, which is where V leads down to
            here = last[:, lost]
            there = self.exact.phases(self.lanes.of(some[lost]), size[lost], (here[1], here[2]), is_at_fold=True)
            point[1:, lost] = there[1:]
            led = np.hypot(there.east - here[1], there.north - here[2])
            is_on[lost] = there.is_found & (led <= FADES * np.hypot(here[1], here[2]))
        is_end = is_on & (np.abs(point[-1]) < FOLDED) & (point[HIDDEN] > ENDS_RAD)

        # Of several steps from one known point those count that come before the first that leads nowhere.
        is_bad = ~is_on | is_end
        missed = np.cumsum(is_bad)
        missed = missed - (missed - is_bad)[np.maximum.accumulate(np.where(begins, np.arange(some.size), 0))]
        is_kept, stops = missed == 0, (missed == 1) & is_bad
        self._step[some] *= 2
        self._is_lost[some] = False
        if stops.any():
            before = np.where(begins, last, np.roll(point, 1, axis=1))
            fold = np.where(begins & ~found.is_found, fold, math.inf)
            went = before[0] - last[0]
            self._stop(some[stops], point[:, stops], before[:, stops], went[stops], fold[stops], is_end[stops])
        self._insert(some[is_kept], point[:, is_kept])

    def _stop(self, some: Places, point: Floats, before: Floats, went: Floats, fold: Floats, is_end: Truths) -> None:
        """Note ends of ways where a step led nowhere, or go on in shorter ones from the known points before."""
        end = _end_between(before, point)
        step = np.where(is_end, 0.9 * (end - before[0]), np.maximum((point[0] - before[0]) / 2, went))
        apart = (end - before[0]) * (point[0] - end)  # what a straight line is off by grows with that
        is_near = is_end & (apart < (BESIDE_END * point[0]) ** 2)
        is_over = ~is_end & (step < FINEST_STEP * point[0])
        self.end[some[is_near]] = end[is_near]
        self.end[some[is_over]] = (before[0] + np.minimum(step, fold))[is_over]
        self._step[some], self._step_from[some] = step, before[0]
        self._is_lost[some] = self._turns[some] = True

    def _insert(self, some: Places, point: Floats) -> None:
        """Note known points, by lane and size."""
        if not some.size:
            return
        lane, first, count = np.unique(some, return_index=True, return_counts=True)
        before = np.isfinite(self._known[0, lane]).sum(axis=1)
        width, needed = self._known.shape[2], int((before + count).max())
        if needed > width:  # the first needs few, most need one
            more = np.full((ROWS, self.end.size, max(width, needed - width)), math.inf)
            self._known = np.concatenate((self._known, more), axis=2)
        self._known[:, some, np.repeat(before - first, count) + np.arange(some.size)] = point
        if (point[0, first] < self._known[0, lane, before - 1]).any():
            here = self._known[:, lane, :needed]
            order = here[0].argsort(axis=1, kind="stable")
            self._known[:, lane, :needed] = np.take_along_axis(here, order[None], axis=2)

    def _to_fold(self, index: Places, some: Places, last: Floats) -> Floats:
        """Way left to where the square of what gradients span is nothing by a parabola; infinite where nowhere."""
        before, earlier = (self._at(np.maximum(index - back, 0), some) for back in (1, 2))
        step, step_before = last[0] - before[0], before[0] - earlier[0]
        square, square_before = last[-1] ** 2, before[-1] ** 2
        falls = (square_before - square) / step
        bend = ((earlier[-1] ** 2 - square_before) / step_before - falls) / (step + step_before)
        bend = np.where(index > 1, bend, 0.0)
        falls = falls - bend * step
        fold = 2 * square / (falls + np.sqrt(np.maximum(falls * falls - 4 * bend * square, 0.0)))
        return np.where((index > 0) & (falls > 0) & (fold > SHORT * step), fold, math.inf)

    def _guess(self, index: Places, some: Places, last: Floats, size: Floats) -> tuple[Floats, Floats]:
        """Where known points lead: by a parabola from no error on where the way so far was nearly straight."""
        u, v = self._way[:, some]
        bent = (last[1] - u * last[0], last[2] - v * last[0])
        part = np.where(index > 0, (size / last[0]) ** 2, 0.0)
        is_straight = np.hypot(*bent) <= STRAIGHT * np.hypot(last[1], last[2])
        east, north = u * size + bent[0] * part, v * size + bent[1] * part
        fresh = np.flatnonzero(index == 0)
        if fresh.size:  # the way bends from its start as it does to a little error
            early, to_east, to_north = EARLY * size[fresh], u[fresh], v[fresh]
            way = self._way_at(some[fresh], np.array((early, to_east * early, to_north * early)))
            half = size[fresh] / (2 * EARLY)
            east[fresh] += half * (way[0] - to_east)
            north[fresh] += half * (way[1] - to_north)
        bends = np.flatnonzero(~is_straight | (self._turns[some] & (index > 0)))
        if bends.size:
            east[bends], north[bends] = self._ahead(index[bends], some[bends], last[:, bends], size[bends])
        return (east, north)

    def _ahead(self, index: Places, some: Places, last: Floats, size: Floats) -> tuple[Floats, Floats]:
        """Where known points lead along the way of the last, which bends as it did.

        It bends with the size or, near a fold, with the root of what is left to it.
        """
        before = self._at(np.maximum(index - 1, 0), some)
        both = self._way_at(np.tile(some, 2), np.concatenate((last, before), axis=1))
        fold = last[0] + self._to_fold(index, some, last)
        near, here, there = (
            np.where(np.isfinite(fold), -np.sqrt(np.maximum(fold - one, 0.0)), one)
            for one in (size, last[0], before[0])
        )
        of_here, of_there = (np.where(np.isfinite(fold), -2 * one, 1.0) for one in (here, there))
        step = near - here
        bend = np.where(index > 0, step / (2 * (here - there)), 0.0)
        (u, p), (v, q) = (part.reshape(2, -1) * (of_here, of_there) for part in both)
        return last[1] + (u + bend * (u - p)) * step, last[2] + (v + bend * (v - q)) * step

    def _way_at(self, some: Places, known: Floats) -> tuple[Floats, Floats]:
        """Where the point goes from known ones. [m/unit]"""
        east, north = self.exact.way(self.lanes.of(some), known[0], (known[1], known[2]))
        (u, v), is_first = self._way[:, some], known[0] == 0
        return np.where(is_first, u, east), np.where(is_first, v, north)

    # ---------------------------------------------------------------- the first size that reaches a limit
    @np.errstate(all="ignore")
    def first_reaching(self, held: Held, best: Floats) -> None:
        """Find the first sizes at which values reach limits; the best so far, (3, groups), are by row and group."""
        tries = np.zeros(held.lane.shape, dtype=int)
        for _ in range(ROUNDS):
            others = best[:, held.group]
            upto = np.where(held.is_alone, np.choose(held.row, others), others.min(axis=0))
            seen = _SearchState(self, held, np.minimum(held.most, upto), tries)
            ends = seen.is_sure
            np.minimum.at(best, (held.row[ends], held.group[ends]), seen.found[ends])
            going = np.flatnonzero(~ends)
            if not going.size:
                return
            some, size = seen.next(going, is_few=is_few(going.size, self._is_alike))
            self._follow(held.lane[some], size)
            held, tries, low = held.of(going), tries[going] + seen.is_between[going], seen.low[going]
        np.minimum.at(best, (held.row, held.group), low)  # which is safe, and no search is known that comes here


class _SearchState:
    """How searches stand by the points that are known.

    Attributes
    ----------
    found : (searches,)
        Sizes at which they end; infinite where nothing is reached.
    is_sure : (searches,)
        Whether they end there; the others go on.
    is_between : (searches,)
        Whether the limit lies between known points.
    """

    def __init__(self, paths: PointPaths, held: Held, upto: Floats, tries: Places) -> None:
        self.held, self.upto, self.tries, every = held, upto, tries, np.arange(tries.size)
        end = paths.end[held.lane]
        known = paths._known.take(held.lane, axis=1)
        is_known = known[0] < end[:, None]
        self.count = is_known.sum(axis=1)
        width = max(2, int(self.count.max()))
        known, is_known = known[:, :, :width], is_known[:, :width]
        self.size = np.where(is_known, known[0], math.nan)
        self.square = np.where(is_known, held.square(known), math.nan)
        reaches = self.square >= 1 - 2 * CLOSE
        self.is_between: Truths = np.asarray(reaches.any(axis=1))
        stop = np.where(self.is_between, reaches.argmax(axis=1), self.count)
        self._slopes(every)
        self.doubtful = self._doubtful(stop)
        low = stop - 1
        self.low, self.turn = self.size[every, low], known[-1, every, low]
        self.between, is_close = self._between(every, stop)
        self.ahead, is_ahead = self._ahead(every, low)
        is_past, ends = self.low >= upto, np.isfinite(end)
        self.is_sure = np.isnan(self.doubtful).all(axis=1)
        self.is_sure &= np.where(self.is_between, is_close, ends | is_ahead) | is_past
        found = np.where(self.is_between, self.between, np.minimum(end, self.ahead))
        self.found = np.where((found <= upto) & ~is_past, found, math.inf)

    def _slopes(self, every: Places) -> None:
        """Slopes at known points of the parabola through each and its neighbours; at the last of the one before."""
        self.width = self.size[:, 1:] - self.size[:, :-1]
        chord = (self.square[:, 1:] - self.square[:, :-1]) / self.width
        self.slope = np.empty(self.size.shape)
        self.slope[:, 0] = 0.0  # a square begins without a slope
        before, after = self.width[:, :-1], self.width[:, 1:]
        self.slope[:, 1:-1] = (chord[:, :-1] * after + chord[:, 1:] * before) / (before + after)
        last = np.maximum(self.count - 1, 1)
        self.slope[every, last] = 2 * chord[every, last - 1] - self.slope[every, last - 1]

    def _doubtful(self, stop: Places) -> Floats:
        """Size to look at within each interval whose ends are below the limit; not a number: what lies between is."""
        low, width = self.size[:, :-1], self.width
        a, b = self.square[:, :-1], self.square[:, 1:]
        rise, begins, ends = b - a, self.slope[:, :-1] * width, self.slope[:, 1:] * width
        expected = begins.copy()
        expected[:, 0] = (width[:, 0] / self.held.first) ** 2  # as it would be of a small error
        is_wide = width > COARSE * self.size[:, 1:]
        near = np.where(is_wide, (1 - CREST) ** 2, 1.0)
        found = np.where(is_wide & (np.abs(rise - expected) > DEPARTS), low + width / 2, math.nan)
        for part in reversed(_crests(begins, rise, ends)):
            is_above = (part > 0.02) & (part < 0.98) & (_on_cubic(part, a, rise, begins, ends) >= near)
            found = np.where(is_above, low + part * width, found)
        is_before = np.arange(1, self.size.shape[1]) < stop[:, None]
        return np.where(is_before & (low < self.upto[:, None]), found, math.nan)

    def _between(self, every: Places, stop: Places) -> tuple[Floats, Truths]:
        """Size at which a cubic between known points reaches the limit, and whether that is close to it."""
        high = np.minimum(stop, self.size.shape[1] - 1)
        low = high - 1
        width, top = self.width[every, low], self.size[every, high]
        a, b = self.square[every, low], self.square[every, high]
        begins, ends = (self.slope[every, point] * width for point in (low, high))
        part = chord = (1 - a) / (b - a)
        for _ in range(NEWTON):
            steep = begins + part * (2 * (3 * (b - a) - 2 * begins - ends) + 3 * part * (begins + ends - 2 * (b - a)))
            part = part - (_on_cubic(part, a, b - a, begins, ends) - 1) / steep
            part = np.where((part >= 0) & (part <= 1), part, chord)
        self.top, found = top, top - (1 - part) * width
        is_narrow = width <= CLOSE * top
        rise = np.sqrt(b) - np.sqrt(a)  # of the value itself, whose slopes a straight line would keep
        bends = np.where(a > 0, begins / (2 * np.sqrt(a)), rise) - ends / (2 * np.sqrt(b))
        almost = np.where(np.abs(bends) > BENDS * np.abs(rise), ALMOST_BENT, ALMOST)
        is_close = (b - 1 < 2 * almost) & (top - found < 2 * almost * top)
        is_close |= (1 - a < 2 * almost) & (found - (top - width) < 2 * almost * top)
        self.inside = top - (1 - np.where(self.tries % 4 == 3, 0.5, np.minimum(np.maximum(part, 0.01), 0.99))) * width
        by_power = self._by_power(every, low, high)
        is_steep = (b > STEEP) & (by_power > self.size[every, low]) & (by_power < top)
        self.inside = np.where(is_steep, by_power, self.inside)
        return np.where(is_narrow, top - width, found), is_close | is_narrow

    def _by_power(self, every: Places, low: Places, high: Places) -> Floats:
        """Size at which a power of the size reaches the limit: that of two points, or of two beyond the limit."""
        after = np.minimum(high + 1, self.count - 1)
        is_from_nothing = low == 0
        below, above = np.where(is_from_nothing, high, low), np.where(is_from_nothing, after, high)
        rise, growth = (np.log(part[every, above] / part[every, below]) for part in (self.square, self.size))
        power = np.where(below < above, rise / growth, 2.0)
        found: Floats = self.size[every, high] * self.square[every, high] ** (-1 / power)
        return found

    def _ahead(self, every: Places, last: Places) -> tuple[Floats, Truths]:
        """Size at which a parabola through the last known points reaches the limit; whether that is close to it."""
        before = np.maximum(last - 1, 0)
        slope = self.slope[every, last]
        bend = np.where(last > 0, (slope - self.slope[every, before]) / self.width[every, before], 0.0)
        left = 1 - self.square[every, last]
        root = slope * slope + 2 * bend * left
        steep = slope + np.sqrt(np.maximum(root, 0.0))
        ahead = np.where((root >= 0) & (steep > 0), self.low + 2 * left / steep, math.inf)
        value, value_before = np.sqrt(self.square[every, last]), np.sqrt(self.square[every, before])
        rise, led = value - value_before, slope / (2 * value) * self.width[every, before]
        almost = np.where(np.abs(led - rise) > BENDS / 2 * np.abs(rise), ALMOST_BENT, ALMOST)
        is_sure = (left < 2 * almost) & (ahead < (1 + 1.5 * almost) * self.low) & (self.turn > 0.5)
        return ahead, is_sure

    def next(self, going: Places, *, is_few: bool) -> tuple[Places, Floats]:
        """Sizes to look at next in the searches that go on: of many one each, and one a lane."""
        low, upto = self.low[going], self.upto[going]
        grown = np.minimum(np.maximum(self.ahead[going], 1.01 * low), GROWTH * low)
        is_before = low < self.held.first[going]
        ahead = np.where(is_before, self.held.first[going], grown)
        size = np.where(self.is_between[going], self.inside[going], np.minimum(ahead, upto))
        doubtful = self.doubtful[going]
        if not is_few:
            least = np.where(np.isnan(doubtful), math.inf, doubtful).min(axis=1)
            size = np.where(np.isfinite(least), least, size)
            order = np.lexsort((size, self.held.lane[going]))
            lane = self.held.lane[going][order]
            order = order[np.append(True, np.diff(lane) > 0)]
            return going[order], size[order]
        is_between, begins = self.is_between[going][:, None], low[:, None]
        size = np.where((low < upto) | self.is_between[going], size, math.nan)[:, None]
        is_beside = is_between & (begins < size * BESIDE) & (size * BESIDE < self.top[going][:, None])
        is_growing = ~is_between & (~is_before & (grown >= GROWTH * low))[:, None]
        is_rung = ~is_between & is_before[:, None]
        more = (
            np.where(is_beside, size * BESIDE, math.nan),
            np.where(is_growing, size * MORE, math.nan),
            np.where(is_rung, begins + (size - begins) * LADDER, math.nan),
        )
        sizes = np.concatenate((size, doubtful, *more), axis=1)
        sizes = np.where(is_between, sizes, _upto(sizes, upto[:, None]))
        place, column = np.nonzero(np.isfinite(sizes))
        return going[place], sizes[place, column]


def _upto(size: Floats, most: Floats) -> Floats:
    """Sizes, but none beyond a largest, and none that is hardly less."""
    return np.where(size > (1 - CLOSE) * most, most, size)


def _is_on_the_way(last: Floats, found: Floats, near: tuple[Floats, Floats]) -> Truths:
    stray = np.hypot(found[1] - near[0], found[2] - near[1])
    led = np.hypot(near[0] - last[1], near[1] - last[2])
    led = np.maximum(np.hypot(found[1] - last[1], found[2] - last[2]), led)
    is_on: Truths = stray <= STRAY * led + FLOOR_M
    return is_on


def _through(a: Floats, b: Floats, c: Floats, size: Floats) -> tuple[Floats, Floats]:
    """Where the parabola through three known points leads, or the straight line through two."""
    part = (size - c[0]) / (c[0] - b[0])
    bend = np.where(a[0] < b[0], (size - b[0]) / (c[0] - a[0]), 0.0) * part
    known = np.where(a[0] < b[0], (b[1:3] - a[1:3]) / (b[0] - a[0]) * (c[0] - b[0]), 0.0)
    east, north = c[1:3] + (c[1:3] - b[1:3]) * part + (c[1:3] - b[1:3] - known) * bend
    return east, north


def _end_between(before: Floats, beyond: Floats) -> Floats:
    """Size between two at which the image ends: from there on the way is folded, and half a cycle is hidden.

    The square of what gradients span is linear near a fold, and what is hidden beyond one.
    """
    low, high, square, less = before[HIDDEN], beyond[HIDDEN], before[-1] ** 2, beyond[-1] ** 2
    hides = np.where(low < ENDS_RAD, (ENDS_RAD - low) / (high - low), 0.0)
    narrows = np.where(square > FOLDED**2, (square - FOLDED**2) / (square - less), 0.0)
    found: Floats = before[0] + (beyond[0] - before[0]) * np.maximum(hides, narrows)
    return found


def _on_cubic(part: Floats, start: Floats, rise: Floats, begins: Floats, ends: Floats) -> Floats:
    """Value at a part of intervals of the cubic that rises so much, with these slopes at both ends."""
    square, cube = part * part, part * part * part
    found: Floats = start + begins * (part - 2 * square + cube) + ends * (cube - square)
    found += rise * (3 * square - 2 * cube)
    return found


def _crests(slope: Floats, rise: Floats, last: Floats) -> tuple[Floats, Floats]:
    """Parts of intervals at which a cubic has no slope, not finite where there is none."""
    b, c = 3 * rise - 2 * slope - last, slope + last - 2 * rise
    far = -(b + np.copysign(np.sqrt(b * b - 3 * c * slope), b))
    return far / (3 * c), slope / far
