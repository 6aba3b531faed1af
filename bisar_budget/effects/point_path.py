"""Where one error takes the image of a point as it grows, and the first size at which it reaches a limit.

The point is followed from no error on. Where range and Doppler gradients become parallel there, its way ends:
they span less than 2 % of what they span at the centre. No larger error has an image of the point, which counts as a
limit reached.
"""

import math
from bisect import bisect
from collections.abc import Callable
from typing import NamedTuple

from bisar_budget.effects.effect import ErrorSource
from bisar_budget.effects.exact_ranges import ExactPhases, ExactRanges
from bisar_budget.geometry import GroundVector

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
_NOT_FOLDED = 0.5  # of what the gradients span at the centre
CREST = 0.01  # of a limit: so little below it, the crest of a curve through few points may be above
DEPARTS = 0.5  # of the limit: a value so far from a straight line may have been anywhere in between
COARSE = 0.02  # of the size: within a shorter interval a curve is trusted
STEPS = 40

Value = Callable[[ExactPhases], float]  # what is held to a limit, signed


class _Known(NamedTuple):
    size: float  # magnitude
    phases: ExactPhases


class PointPath:
    """The way of the point by one error with one sign.

    Parameters
    ----------
    exact : ExactRanges
        Of the collection.
    source : ErrorSource
        The error.
    sign : float
        ±1.
    per_unit : (2,)
        Displacement by a small unit of the error, without the sign. [m/unit]
    """

    def __init__(self, exact: ExactRanges, source: ErrorSource, sign: float, per_unit: GroundVector) -> None:
        self.exact, self.source, self.sign = exact, source, sign
        self.known = [_Known(0.0, ExactPhases((0.0, 0.0), 0.0, 0.0, 1.0))]
        self._ways = {0.0: (sign * per_unit[0], sign * per_unit[1])}
        self.end = math.inf  # size from which there is no point

    def to(self, size: float, until: Callable[[ExactPhases], bool] | None = None) -> ExactPhases | None:
        """What an error of a size does, or the first size met that is enough; None where its way has ended. [unit]"""
        step, is_first_try = math.inf, True
        while size < self.end:
            index = bisect(self.known, size, key=lambda one: one.size)
            last = self.known[index - 1]
            if last.size == size:
                return last.phases
            fold = self._to_fold(index)
            step = min(step, size - last.size, OF_FOLD * fold if fold > FINEST_STEP * last.size else math.inf)
            ahead = size if size - last.size < 1.2 * step else last.size + step
            near, is_straight = self._guess(index, ahead) if is_first_try else (self._ahead(index, ahead), False)
            found = self.exact.phases([(self.source, self.sign * ahead)], near)
            if found is not None and _is_on_the_way(last.phases.displacement, found.displacement, near):
                if abs(found.turn) < PARALLEL:
                    self.end = _parallel_between(last, _Known(ahead, found))
                    break
                self.known.insert(index, _Known(ahead, found))
                if until is not None and until(found):
                    return found
                step, is_first_try = 2 * step, True
                continue
            if is_straight:
                is_first_try = False
                continue
            is_fold = found is None and abs(last.phases.turn) < FOLDS and fold < LEAST_STEP * ahead
            step, is_first_try = step / 2, True
            if is_fold or step < FINEST_STEP * ahead:
                self.end = last.size + min(step, fold)
        return None

    def _to_fold(self, index: int) -> float:
        """How much larger the error may become before the gradients are parallel; infinite: nothing points to it.

        There the square of what they span goes through zero like a straight line, as far as the last step was short.
        """
        if index < 2:
            return math.inf
        last, before = self.known[index - 1], self.known[index - 2]
        square, earlier, step = last.phases.turn**2, before.phases.turn**2, last.size - before.size
        fold = square * step / (earlier - square) if square < earlier else math.inf
        return fold if fold > SHORT * step else math.inf

    def _way(self, known: _Known) -> GroundVector:
        """Where the point goes from a known one. [m/unit]"""
        if known.size not in self._ways:
            east, north = self.exact.way(self.source, self.sign * known.size, known.phases.displacement)
            self._ways[known.size] = (self.sign * east, self.sign * north)
        return self._ways[known.size]

    def _guess(self, index: int, size: float) -> tuple[GroundVector, bool]:
        """Where the last known point before an index leads, and whether the way so far was nearly straight."""
        last = self.known[index - 1]
        x, y = last.phases.displacement
        u, v = self._ways[0.0]
        bent = (x - u * last.size, y - v * last.size)
        if math.hypot(*bent) > STRAIGHT * math.hypot(x, y):
            return self._ahead(index, size), False
        part = (size / last.size) ** 2 if last.size else 0.0  # a parabola from no error on
        return (u * size + bent[0] * part, v * size + bent[1] * part), True

    def _ahead(self, index: int, size: float) -> GroundVector:
        """Where the known points before an index lead: along the way of the last, which bends as it did."""
        last = self.known[index - 1]
        (x, y), (u, v), step = last.phases.displacement, self._way(last), size - last.size
        if index > 1:
            before = self.known[index - 2]
            bend = step / (2 * (last.size - before.size))
            p, q = self._way(before)
            u, v = u + bend * (u - p), v + bend * (v - q)
        return (x + u * step, y + v * step)

    def first_reaching(
        self, value: Value, limit: float, per_unit: float, first: float, farthest: float
    ) -> float | None:
        """First size at which a value reaches a limit; None where it does not up to the farthest.

        Parameters
        ----------
        value : callable
            Of the phases: what is held to the limit, signed.
        limit : float
            [rad] or [m]
        per_unit : float
            Value of a small unit of the error, with the sign of the path.
        first, farthest : float
            Size to look at first, and the largest. [unit]
        """
        index = bisect(self.known, first, key=lambda one: one.size)
        is_met = index < len(self.known) and self.known[index].size <= (1 + ALMOST) * first
        size = self.known[index].size if is_met else first

        def is_enough(phases: ExactPhases) -> bool:
            return abs(value(phases)) >= limit * (1 - CLOSE)

        for _ in range(STEPS):
            self.to(size, is_enough)
            crossed = self._crossed(value, limit, per_unit, min(size, self.end))
            if crossed is not None:
                return crossed if crossed <= farthest else None
            if self.end <= size:
                return self.end if self.end <= farthest else None
            if size >= farthest:
                return None
            index = bisect(self.known, size, key=lambda one: one.size) - 1
            reached = abs(value(self.known[index].phases))
            if reached > (1 - ALMOST) * limit:
                ahead = self._just_ahead(index, value, limit, per_unit)
                if ahead is not None:
                    return ahead if ahead <= farthest else None
            size = min(farthest, size * min(1.5, max(1.01, 1.02 * limit / reached) if reached else 1.5))
        return size

    def _just_ahead(self, index: int, value: Value, limit: float, per_unit: float) -> float | None:
        """Size at which a value does that almost reaches the limit at a known point; None where nobody can tell."""
        last, before = self.known[index], self.known[index - 1]
        reached = abs(value(last.phases))
        if index == 1:
            ahead = _on_parabola(abs(per_unit), last.size, reached, limit)
        else:
            slope = (reached - abs(value(before.phases))) / (last.size - before.size)
            ahead = last.size + (limit - reached) / slope if slope > 0 else None
        is_sure = ahead is not None and last.size <= ahead < (1 + 1.5 * ALMOST) * last.size and last.phases.turn > 0.5
        return ahead if is_sure else None

    def _crossed(self, value: Value, limit: float, per_unit: float, upto: float) -> float | None:
        """First size among the known ones, or between them, at which the value reaches the limit."""
        index = 1
        while index < len(self.known) and self.known[index].size <= upto:
            if abs(value(self.known[index].phases)) >= limit * (1 - CLOSE):
                return self._between(value, limit, index, per_unit)
            doubtful = self._doubtful(index, value, limit, per_unit)
            if doubtful is not None and self.to(doubtful) is None:
                return None
            index += doubtful is None
        return None

    def _doubtful(self, index: int, value: Value, limit: float, per_unit: float) -> float | None:
        """Size to look at within an interval whose ends are below the limit; None where what lies between is too.

        That at which the value, led on by its slopes at both ends, stands above the limit; or the middle, where the
        end departs so far from the slope at the beginning that no curve through so few points is to be trusted.
        """
        low, high = self.known[index - 1], self.known[index]
        a, b, width = value(low.phases), value(high.phases), high.size - low.size
        slope = per_unit if index == 1 else self._slope(index - 1, value)
        last = self._slope(index, value) if index + 1 < len(self.known) else 2 * (b - a) / width - slope
        is_wide = width > COARSE * high.size
        near = limit * (1 - CREST) if is_wide else limit
        for part in _crests(slope * width, b - a, last * width):
            square, cube = part * part, part * part * part
            on_curve = a + slope * width * (part - 2 * square + cube) + last * width * (cube - square)
            on_curve += (b - a) * (3 * square - 2 * cube)
            if 0.02 < part < 0.98 and abs(on_curve) >= near:
                return low.size + part * width
        departs = abs(b - a - slope * width)
        return low.size + width / 2 if is_wide and departs > DEPARTS * limit else None

    def _slope(self, index: int, value: Value) -> float:
        """Slope at a known point of the parabola through it and its neighbours. [of the value per unit]"""
        before, at, after = self.known[index - 1 : index + 2]
        a, b, c = value(before.phases), value(at.phases), value(after.phases)
        first, second = at.size - before.size, after.size - at.size
        return ((b - a) / first * second + (c - b) / second * first) / (first + second)

    def _between(self, value: Value, limit: float, index: int, per_unit: float) -> float:
        """Size at which the magnitude reaches the limit, in the interval that ends at a known point."""
        low, high = self.known[index - 1], self.known[index]
        for step in range(STEPS):
            a, b = abs(value(low.phases)), abs(value(high.phases))
            if high.size - low.size <= CLOSE * high.size:
                return low.size
            chord = (b - a) / (high.size - low.size)
            size = low.size + (limit - a) / chord
            bent = _on_parabola(abs(per_unit), high.size, b, limit) if low.size == 0 else None
            if bent is not None:
                size = bent
            elif step % 3 == 2:
                size = (low.size + high.size) / 2
            if b - limit < ALMOST * limit:
                if low.size:  # the slope there of a parabola from no error through both
                    chord += (chord - a / low.size) * (high.size - low.size) / high.size
                    size = high.size - (b - limit) / chord if chord > 0 else 0.0
                if high.size - size < 2 * ALMOST * high.size:
                    return size
            inside = 0.01 * (high.size - low.size)
            size = min(max(size, low.size + inside), high.size - inside)
            found = self.to(size)
            if found is None:
                return low.size
            middle = _Known(size, found)
            if abs(value(found)) >= limit * (1 - CLOSE):
                high = middle
            else:
                low = middle
        return low.size


def _on_parabola(slope: float, size: float, value: float, limit: float) -> float | None:
    """Size at which a parabola from zero, of a slope there and a value at a size, reaches a limit; None: nowhere."""
    bend = (value / size - slope) / size
    root = slope * slope + 4 * bend * limit
    return 2 * limit / (slope + math.sqrt(root)) if root >= 0 and slope + root > 0 else None


def _crests(slope: float, rise: float, last: float) -> tuple[float, ...]:
    """Parts of an interval at which a cubic has no slope, by its slopes at both ends and its rise in between."""
    # The derivative is slope + 2·b·t + 3·c·t² with t from 0 to 1.
    b, c = 3 * rise - 2 * slope - last, slope + last - 2 * rise
    root = b * b - 3 * c * slope
    if root < 0:
        return ()
    # Without the difference of nearly equal numbers; a parabola has c = 0, and one crest.
    far = -(b + math.copysign(math.sqrt(root), b))
    return tuple(part for part in (far / (3 * c) if c else None, slope / far if far else None) if part is not None)


def _parallel_between(before: _Known, beyond: _Known) -> float:
    """Size between two at which the gradients span so little that they count as parallel; their square is linear."""
    square, less = before.phases.turn**2, beyond.phases.turn**2
    return before.size + (beyond.size - before.size) * (square - PARALLEL**2) / (square - less)


def _is_on_the_way(last: GroundVector, found: GroundVector, near: GroundVector) -> bool:
    return math.dist(found, near) <= STRAY * max(math.dist(found, last), math.dist(near, last)) + FLOOR_M
