"""Where errors take the image of a point as they grow, and the first size at which each reaches a limit.

The point is followed from no error on. Where range and Doppler gradients become parallel there, its way ends:
they span less than 2 % of what they span at the centre. No larger error has an image of the point, which counts as a
limit reached. All lanes take each step together; those that it does not concern are left out of it.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from bisar_budget.ranges.exact_ranges import ExactRanges, Floats, Lanes, Places, Truths

# Of what range and Doppler gradients span at the centre: with less a point has no image, they are parallel there.
PARALLEL = 0.02
STRAY = 0.15  # of a step; farther from where it led, a point is not the one that was followed
STRAIGHT = 0.1  # of a displacement, by which it may be off a straight way
FLOOR_M = 1e-3
LEAST_STEP = 1e-3  # of the size: allowables are right to 1 %
FINEST_STEP = 1e-6  # where the gradients stay apart, the way only turns
OF_FOLD = 0.8  # of the way to where the gradients seem to become parallel, that one step makes
SHORT = 0.1  # of the last step, below which that step says little of the way left
FOLDS = 0.1  # of what the gradients span at the centre; a way that ends at more of it does not end in a fold
CLOSE = 1e-5  # of a limit, where a search ends
ALMOST = 0.002  # of a limit, from where a parabola leads to it
CREST = 0.01  # of a limit: so little below it, the crest of a curve through few points may be above
DEPARTS = 0.5  # of the limit: a value so far from a straight line may have been anywhere in between
COARSE = 0.02  # of the size: within a shorter interval a curve is trusted
STEPS = 40

# Rows of a known point: size, east, north, quadratic, cubic, turn. A limit holds a phase, or the way to the point.
WAY, QUADRATIC, CUBIC = 1, 3, 4
_NO_ERROR = (0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


class Held(NamedTuple):
    """Row held to a limit in lanes, WAY, QUADRATIC or CUBIC; the limit; effect of a small unit on the row, signed."""

    row: Any  # one of all, or of each (lanes,)
    limit: Floats
    per_unit: Floats

    def of(self, some: Any) -> "Held":
        """The same for some of the lanes."""
        return Held(self.row[some] if np.ndim(self.row) else self.row, self.limit[some], self.per_unit[some])

    def value(self, known: Floats) -> Floats:
        """Value held to the limit, of known points, (6, lanes): a phase, signed [rad], or a way [m]."""
        if np.ndim(self.row):
            phase = np.where(self.row == QUADRATIC, known[QUADRATIC], known[CUBIC])
            phase = np.where(self.row == WAY, np.hypot(known[1], known[2]), phase)
        else:
            phase = np.hypot(known[1], known[2]) if self.row == WAY else known[self.row]
        return np.asarray(phase)

    def is_reached(self, known: Floats) -> Truths:
        """Whether a search that meets these points need not look farther."""
        found: Truths = np.abs(self.value(known)) >= self.limit * (1 - CLOSE)
        return found


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

    Attributes
    ----------
    end : (lanes,)
        Size from which there is no point; infinite where none is known.
    """

    def __init__(self, exact: ExactRanges, lanes: Lanes, per_unit: Floats) -> None:
        self.exact, self.lanes = exact, lanes
        count = lanes.case.size
        self.end = np.full(count, math.inf)
        self._way = per_unit
        self._known = np.full((count, 2, 6), math.inf)  # by size; infinite where there is none
        self._known[:, 0] = _NO_ERROR
        self._sizes = self._known[:, :, 0].copy()

    def _count(self, some: Places, size: Floats) -> Places:
        """How many known points are no larger than a size."""
        found: Places = (self._sizes.take(some, axis=0) <= size[:, None]).sum(axis=1)
        return found

    def _at(self, index: Places, some: Places) -> Floats:
        """Known points by their places, (6, some); infinite beyond the last."""
        room = self._known.shape[1]
        flat = self._known.reshape(-1, 6).take(some * room + np.minimum(index, room - 1), axis=0)
        found: Floats = np.ascontiguousarray(flat.T)
        found[:, index >= room] = math.inf
        return found

    def known(self, some: Places, size: Floats) -> Floats:
        """Known points by errors of sizes that `to` was asked for, (6, some); not a number where the way ended."""
        found = self._at(self._count(some, size) - 1, some)
        found[:, (found[0] != size) | (size >= self.end[some])] = math.nan
        return found

    def _insert(self, index: Places, some: Places, point: Floats) -> None:
        """Note a known point before those that an index names."""
        if np.isfinite(self._sizes[some, -1]).any():  # the first needs few, most need one
            more = np.full((len(self._sizes), 2 * self._sizes.shape[1], 6), math.inf)
            self._known = np.concatenate((self._known, more), axis=1)
            self._sizes = self._known[:, :, 0].copy()
        moves = np.flatnonzero(self._sizes[some, index] < math.inf)
        for place in range(self._sizes.shape[1] - 1, int(index[moves].min(initial=self._sizes.shape[1])), -1):
            later = some[moves[place > index[moves]]]
            self._known[later, place] = self._known[later, place - 1]
            self._sizes[later, place] = self._sizes[later, place - 1]
        self._known[some, index] = point.T
        self._sizes[some, index] = point[0]

    @np.errstate(all="ignore")
    def to(self, some: Places, size: Floats, held: Held | None = None) -> None:
        """Follow the point to a size in some lanes, or to the first size met that reaches what is held."""
        step, is_first_try = np.full(some.shape, math.inf), np.ones(some.shape, dtype=bool)
        while True:
            index = self._count(some, size)
            last = self._at(index - 1, some)
            going = (last[0] != size) & (size < self.end[some])
            if not going.any():
                return
            some, size, step, is_first_try = some[going], size[going], step[going], is_first_try[going]
            index, last, held = index[going], last[:, going], held and held.of(going)
            fold = self._to_fold(index, some, last)
            to_fold = np.where(fold > FINEST_STEP * last[0], OF_FOLD * fold, math.inf)
            step = np.minimum(np.minimum(step, size - last[0]), to_fold)
            ahead = np.where(size - last[0] < 1.2 * step, size, last[0] + step)
            near, is_straight = self._guess(index, some, last, ahead, is_first_try)
            found = self.exact.phases(self.lanes.of(some), ahead, near)
            point = np.array((ahead, *found[1:]))
            is_on = found.is_found & _is_on_the_way(last, point, near)
            is_end = is_on & (np.abs(point[5]) < PARALLEL)
            self.end[some[is_end]] = _parallel_between(last, point)[is_end]
            is_on &= ~is_end
            self._insert(index[is_on], some[is_on], point[:, is_on])

            # Where the point is not found, first another guess, then shorter steps.
            is_again = ~is_on & ~is_end & is_straight
            is_shorter = ~is_on & ~is_end & ~is_straight
            step = np.where(is_on, 2 * step, np.where(is_shorter, step / 2, step))
            is_fold = ~found.is_found & (np.abs(last[5]) < FOLDS) & (fold < LEAST_STEP * ahead)
            is_over = is_shorter & (is_fold | (step < FINEST_STEP * ahead))
            self.end[some[is_over]] = (last[0] + np.minimum(step, fold))[is_over]
            is_first_try = ~is_again
            if held is not None:
                more = ~(is_on & held.is_reached(point))
                some, size, step, is_first_try = some[more], size[more], step[more], is_first_try[more]
                held = held.of(more)

    def _to_fold(self, index: Places, some: Places, last: Floats) -> Floats:
        before = self._at(np.maximum(index - 2, 0), some)
        square, earlier, step = last[5] ** 2, before[5] ** 2, last[0] - before[0]
        fold = np.where(square < earlier, square * step / (earlier - square), math.inf)
        return np.where((index > 1) & (fold > SHORT * step), fold, math.inf)

    def _guess(
        self, index: Places, some: Places, last: Floats, size: Floats, is_first_try: Truths
    ) -> tuple[tuple[Floats, Floats], Truths]:
        """Where known points lead: by a parabola from no error on where the way so far was nearly straight."""
        u, v = self._way[:, some]
        bent = (last[1] - u * last[0], last[2] - v * last[0])
        part = np.where(last[0] > 0, (size / last[0]) ** 2, 0.0)
        is_straight = is_first_try & (np.hypot(*bent) <= STRAIGHT * np.hypot(last[1], last[2]))
        east, north = u * size + bent[0] * part, v * size + bent[1] * part
        bends = np.flatnonzero(~is_straight)
        if bends.size:
            east[bends], north[bends] = self._ahead(index[bends], some[bends], last[:, bends], size[bends])
        return (east, north), is_straight

    def _ahead(self, index: Places, some: Places, last: Floats, size: Floats) -> tuple[Floats, Floats]:
        """Where known points lead along the way of the last, which bends as it did."""
        before = self._at(np.maximum(index - 2, 0), some)
        (u, v), (p, q) = (self._way_at(some, known) for known in (last, before))
        step = size - last[0]
        bend = np.where(index > 1, step / (2 * (last[0] - before[0])), 0.0)
        return (
            last[1] + (u + np.where(index > 1, bend * (u - p), 0.0)) * step,
            last[2] + (v + np.where(index > 1, bend * (v - q), 0.0)) * step,
        )

    def _way_at(self, some: Places, known: Floats) -> tuple[Floats, Floats]:
        """Where the point goes from known ones. [m/unit]"""
        east, north = self.exact.way(self.lanes.of(some), known[0], (known[1], known[2]))
        (u, v), is_first = self._way[:, some], known[0] == 0
        return np.where(is_first, u, east), np.where(is_first, v, north)

    def either_reaching(self, some: Sequence[Places], held: Held, first: Floats, farthest: Floats) -> Floats:
        """Smallest size, of either sign, at which values reach limits; infinite: none up to the farthest.

        `some` are the lanes of the positive sign, and of the other. The slope of what is held is that of the first.
        """
        smallest = np.full(first.shape, math.inf)
        for lanes, sign in zip(some, (1.0, -1.0), strict=True):
            slopes = np.where(held.row == WAY, 1.0, sign) * held.per_unit  # a length has no sign
            found = self.first_reaching(lanes, held._replace(per_unit=slopes), first, farthest)
            smallest, farthest = np.minimum(found, smallest), np.minimum(found, farthest)
            first = np.minimum(first, farthest)
        return smallest

    @np.errstate(all="ignore")
    def first_reaching(self, some: Places, held: Held, first: Floats, farthest: Floats) -> Floats:
        """First size at which a value reaches a limit in some lanes; infinite: none up to the farthest."""
        found = np.full(some.shape, math.inf)
        met = self._at(self._count(some, first), some)[0]
        size = np.where(met <= (1 + ALMOST) * first, met, first)
        place = np.arange(some.size)  # of the lanes that still search
        for _ in range(STEPS):
            here, of, most = some[place], held.of(place), farthest[place]
            self.to(here, size, of)
            crossed = self._crossed(here, of, np.minimum(size, self.end[here]))
            index = self._count(here, size) - 1
            last = self._at(index, here)
            reached = np.abs(of.value(last))
            ahead = self._just_ahead(index, here, of, last)
            is_almost = (reached > (1 - ALMOST) * of.limit) & (size < most)
            ahead = np.where(is_almost, ahead, math.inf)
            end = self.end[here]
            ends = np.where(np.isfinite(crossed), crossed, np.where(end <= size, end, ahead))
            found[place] = np.where(ends <= most, ends, math.inf)
            going = ~(np.isfinite(ends) | (size >= most))
            if not going.any():
                return found
            place, size, most, reached = place[going], size[going], most[going], reached[going]
            growth = np.clip(1.02 * of.limit[going] / reached, 1.01, 1.5)
            size = np.minimum(most, size * growth)
        found[place] = size
        return found

    def _just_ahead(self, index: Places, some: Places, held: Held, last: Floats) -> Floats:
        """Size at which a value does that almost reaches the limit at known points; infinite where none can tell."""
        before = self._at(np.maximum(index - 1, 0), some)
        reached = np.abs(held.value(last))
        slope = (reached - np.abs(held.value(before))) / (last[0] - before[0])
        ahead = np.where(slope > 0, last[0] + (held.limit - reached) / slope, math.inf)
        ahead = np.where(index == 1, _on_parabola(held.limit, np.abs(held.per_unit), last[0], reached), ahead)
        is_sure = (last[0] <= ahead) & (ahead < (1 + 1.5 * ALMOST) * last[0]) & (last[5] > 0.5)
        return np.where(is_sure, ahead, math.inf)

    def _crossed(self, some: Places, held: Held, upto: Floats) -> Floats:
        """First size among the known ones, or between them, at which the value reaches the limit; infinite: none."""
        reaches = np.zeros(some.shape, dtype=int)  # the known point that does
        place, index = np.arange(some.size), np.ones(some.shape, dtype=int)
        while place.size:
            high, of = self._at(index, some[place]), held.of(place)
            is_known = high[0] <= upto[place]
            is_enough = is_known & of.is_reached(high)
            reaches[place[is_enough]] = index[is_enough]
            going = is_known & ~is_enough
            place, index, high, of = place[going], index[going], high[:, going], of.of(going)
            doubtful = self._doubtful(index, some[place], of, high)
            is_sure = np.isnan(doubtful)
            self.to(some[place[~is_sure]], doubtful[~is_sure])
            index = index + is_sure
            going = is_sure | (doubtful < self.end[some[place]])
            place, index = place[going], index[going]
        found, place = np.full(some.shape, math.inf), np.flatnonzero(reaches)
        found[place] = self._between(some[place], held.of(place), reaches[place])
        return found

    def _doubtful(self, index: Places, some: Places, held: Held, high: Floats) -> Floats:
        """Size to look at within intervals whose ends are below the limit; not a number: what lies between is too."""
        low, after = self._at(index - 1, some), self._at(index + 1, some)
        a, b, width = held.value(low), held.value(high), high[0] - low[0]
        before = self._at(np.maximum(index - 2, 0), some)
        slope = np.where(index == 1, held.per_unit, _slope(held, before, low, high))
        last = np.where(np.isfinite(after[0]), _slope(held, low, high, after), 2 * (b - a) / width - slope)
        is_wide = width > COARSE * high[0]
        near = np.where(is_wide, held.limit * (1 - CREST), held.limit)
        departs = np.abs(b - a - slope * width)
        found = np.where(is_wide & (departs > DEPARTS * held.limit), low[0] + width / 2, math.nan)
        for part in reversed(_crests(slope * width, b - a, last * width)):
            square, cube = part * part, part * part * part
            on_curve = a + slope * width * (part - 2 * square + cube) + last * width * (cube - square)
            on_curve += (b - a) * (3 * square - 2 * cube)
            is_above = (part > 0.02) & (part < 0.98) & (np.abs(on_curve) >= near)
            found = np.where(is_above, low[0] + part * width, found)
        return found

    def _between(self, some: Places, held: Held, index: Places) -> Floats:
        """Size at which the magnitude reaches the limit, in the intervals that end at known points."""
        found = np.full(some.shape, math.nan)
        place, low, high = np.arange(some.size), self._at(index - 1, some), self._at(index, some)
        for step in range(STEPS):
            of = held.of(place)
            a, b = np.abs(of.value(low)), np.abs(of.value(high))
            chord = (b - a) / (high[0] - low[0])
            size = low[0] + (of.limit - a) / chord
            if step % 3 == 2:
                size = (low[0] + high[0]) / 2
            is_first = low[0] == 0
            # A phase grows by a parabola from zero: of the slope there, or through both ends of the interval.
            through = (a / low[0] * high[0] - b / high[0] * low[0]) / (high[0] - low[0])
            bent = _on_parabola(of.limit, np.where(is_first, np.abs(of.per_unit), through), high[0], b)
            is_inside = (bent > low[0]) & (bent < high[0]) & (is_first | (step % 3 < 2))
            size = np.where(is_inside | (is_first & np.isfinite(bent)), bent, size)
            is_close = b - of.limit < ALMOST * of.limit
            chord = chord + (chord - a / low[0]) * (high[0] - low[0]) / high[0]
            back = np.where(chord > 0, high[0] - (b - of.limit) / chord, 0.0)
            size = np.where(is_close & ~is_first, back, size)
            is_narrow = high[0] - low[0] <= CLOSE * high[0]
            ends = is_narrow | (is_close & (high[0] - size < 2 * ALMOST * high[0]))
            found[place[ends]] = np.where(is_narrow, low[0], size)[ends]
            going = ~ends
            if not going.any():
                return found
            place, low, high, size = place[going], low[:, going], high[:, going], size[going]
            inside = 0.01 * (high[0] - low[0])
            size = np.minimum(np.maximum(size, low[0] + inside), high[0] - inside)
            self.to(some[place], size)
            middle = self.known(some[place], size)
            is_there = ~np.isnan(middle[0])
            found[place[~is_there]] = low[0, ~is_there]
            place, low, high, middle = place[is_there], low[:, is_there], high[:, is_there], middle[:, is_there]
            is_high = held.of(place).is_reached(middle)
            low, high = np.where(is_high, low, middle), np.where(is_high, middle, high)
        found[place] = low[0]
        return found


def _on_parabola(limit: Floats, slope: Floats, size: Floats, value: Floats) -> Floats:
    """Size at which a parabola from zero, of a slope there and a value at a size, reaches a limit; or infinite."""
    bend = (value / size - slope) / size
    root = slope * slope + 4 * bend * limit
    does = (root >= 0) & (slope + np.sqrt(np.where(root >= 0, root, 0.0)) > 0)
    return np.where(does, 2 * limit / (slope + np.sqrt(np.where(does, root, 1.0))), math.inf)


def _is_on_the_way(last: Floats, found: Floats, near: tuple[Floats, Floats]) -> Truths:
    stray = np.hypot(found[1] - near[0], found[2] - near[1])
    led = np.hypot(near[0] - last[1], near[1] - last[2])
    led = np.maximum(np.hypot(found[1] - last[1], found[2] - last[2]), led)
    is_on: Truths = stray <= STRAY * led + FLOOR_M
    return is_on


def _parallel_between(before: Floats, beyond: Floats) -> Floats:
    """Size between two at which gradients count as parallel; the square of what they span is linear."""
    square, less = before[5] ** 2, beyond[5] ** 2
    found: Floats = before[0] + (beyond[0] - before[0]) * (square - PARALLEL**2) / (square - less)
    return found


def _slope(held: Held, before: Floats, at: Floats, after: Floats) -> Floats:
    """Slope at known points of the parabola through each and its neighbours. [of the value per unit]"""
    a, b, c = held.value(before), held.value(at), held.value(after)
    first, second = at[0] - before[0], after[0] - at[0]
    found: Floats = ((b - a) / first * second + (c - b) / second * first) / (first + second)
    return found


def _crests(slope: Floats, rise: Floats, last: Floats) -> tuple[Floats, Floats]:
    """Parts of intervals at which a cubic has no slope, not finite where there is none."""
    b, c = 3 * rise - 2 * slope - last, slope + last - 2 * rise
    far = -(b + np.copysign(np.sqrt(b * b - 3 * c * slope), b))
    return far / (3 * c), slope / far
