"""Search for the smallest size at which an error reaches a limit, along the path of the image point.

A search works with the squared ratio of a phase or displacement to its limit. The square is used because it is a
smooth function of the size, whereas the magnitude is not. After each step the search uses all known points of the
path. It ends as soon as an interpolated point is close enough to the limit and a local maximum above the limit is
impossible at all smaller sizes. All searches take their steps at the same time.
"""

import math
from dataclasses import dataclass, fields

import numpy as np

from bisar_budget.arrays import Booleans, Floats, Indices
from bisar_budget.ranges.point_paths import (
    AREA,
    CUBIC,
    EAST,
    HIDDEN,
    NORTH,
    SIZE,
    PointPaths,
    tries_several_sizes,
    up_to,
)
from bisar_budget.ranges.point_paths import QUADRATIC as QUADRATIC_ROW

QUADRATIC_LIMIT, CUBIC_LIMIT, DISPLACEMENT_LIMIT = range(3)

LIMIT_FRACTION = 1e-5  # accuracy of a search, as a fraction of the limit


@dataclass(frozen=True)
class SearchSettings:
    """Numerical settings of the search for a limit.

    Attributes
    ----------
    trusted_fraction, trusted_bent_fraction : float
        Largest distance to the limit at which an interpolated size is accepted, as a fraction of the limit.
        `trusted_fraction` applies where the value is almost linear in the size, and `trusted_bent_fraction` where its
        slope changes by more than `bent_fraction` within the interval.
    bent_fraction : float
        Threshold for the change of the slope within an interval, as a fraction of the slope. An interval with a
        larger change counts as bent.
    crest_fraction : float
        Tolerance below the limit, as a fraction of the limit. A local maximum of an interpolation within this
        tolerance counts as possibly above the limit.
    departure_fraction : float
        Largest accepted departure from linearity within an interval, as a fraction of the limit. The departure is the
        difference between two increases of the value over the interval: the actual increase, and the increase
        predicted from the slope at the lower end of the interval. If the departure is larger, the search also tries a
        size within the interval.
    trusted_interval_fraction : float
        Largest width of an interval within which an interpolation is trusted, as a fraction of the size.
    steep_ratio : float
        Threshold for the squared ratio of a value to its limit. Above it, the size at the limit is predicted by a
        power law, which is then more accurate than a cubic.
    growth_factor : float
        Factor by which the size grows in a step.
    newton_steps : int
        Steps of Newton's method on an interpolating cubic.
    max_rounds : int
        Largest number of steps of a search. No known search takes more than 25.
    """

    trusted_fraction: float = 0.002
    trusted_bent_fraction: float = 3e-5
    bent_fraction: float = 0.1
    crest_fraction: float = 0.01
    departure_fraction: float = 0.5
    trusted_interval_fraction: float = 0.02
    steep_ratio: float = 2.0
    growth_factor: float = 1.5
    newton_steps: int = 3
    max_rounds: int = 100


SEARCH_SETTINGS = SearchSettings()

# Additional sizes to try if there are only a few searches: fractions of the first size, factors around the size at
# which the limit is expected, and factors of the size as long as the limit is not yet exceeded.
FIRST_SIZE_FRACTIONS = np.array((0.25, 0.5, 0.75, 1.3, 2.0))
NEIGHBOUR_FACTORS = np.array((0.98, 0.996, 1.004, 1.02))
GROWTH_FACTORS = SEARCH_SETTINGS.growth_factor ** np.arange(1, 5)


@dataclass(frozen=True, eq=False)
class LimitSearches:
    """Searches for the smallest error size at which a phase or displacement reaches its limit.

    Attributes
    ----------
    lane : (searches,)
        Lane of the path that is searched.
    requirement : (searches,)
        QUADRATIC_LIMIT, CUBIC_LIMIT or DISPLACEMENT_LIMIT.
    limit : (searches,)
        Limit of the quadratic phase including the gain of autofocus [rad], of the cubic phase [rad], or of the
        displacement [m].
    gain : (searches,)
        Factor by which autofocus raises the limit of the quadratic phase. It does not raise the limit of the hidden
        phase, which `exact_ranges` defines.
    first : (searches,)
        Size that is tried first. At this size an effect that is proportional to the size reaches the limit. [unit]
    largest : (searches,)
        Size at which the search ends. [unit]
    group : (searches,)
        Group of each search. A search ends at the smallest size that a search of its group has found.
    is_alone : (searches,)
        If True, the search can be ended only by a search of its group for the same requirement. If False, it can be
        ended by any search of its group.
    """

    lane: Indices
    requirement: Indices
    limit: Floats
    gain: Floats
    first: Floats
    largest: Floats
    group: Indices
    is_alone: Booleans

    @classmethod
    def joined(cls, searches: "list[LimitSearches]") -> "LimitSearches":
        """Concatenate the searches of a list."""
        return cls(*(np.concatenate([getattr(each, field.name) for each in searches]) for field in fields(cls)))

    def of(self, index: Indices) -> "LimitSearches":
        """Select searches by index."""
        return LimitSearches(*(getattr(self, field.name)[index] for field in fields(self)))

    def square(self, points: Floats) -> Floats:
        """Squared ratio of each phase or displacement to its limit, at known points of paths, (searches, points).

        `points` are the known points, (rows, searches, points), with the rows of `point_paths.ROWS`.
        """
        requirement, gain = self.requirement[:, None], self.gain[:, None]
        judged = points[QUADRATIC_ROW] ** 2 + (gain * points[HIDDEN]) ** 2
        square = np.where(requirement == QUADRATIC_LIMIT, judged, points[CUBIC] ** 2)
        displacement = points[EAST] ** 2 + points[NORTH] ** 2
        square = np.where(requirement == DISPLACEMENT_LIMIT, displacement, square)
        return np.asarray(square / self.limit[:, None] ** 2)


@np.errstate(all="ignore")
def find_first_sizes(paths: PointPaths, searches: LimitSearches, smallest: Floats) -> None:
    """Find the smallest error sizes at which phases and displacements reach their limits; write them to `smallest`.

    Parameters
    ----------
    paths : PointPaths
        Paths of the image point as the sizes of the errors grow.
    searches : LimitSearches
        Limits to search for, each with its path and with the sizes at which the search begins and ends.
    smallest : (requirements, groups)
        Smallest sizes known so far [unit]. If a search finds a smaller size, this size is stored instead.
    """
    tries = np.zeros(searches.lane.shape, dtype=int)
    for _ in range(SEARCH_SETTINGS.max_rounds):
        of_group = smallest[:, searches.group]
        bound = np.where(searches.is_alone, np.choose(searches.requirement, of_group), of_group.min(axis=0))
        state = _SearchState(paths, searches, np.minimum(searches.largest, bound), tries)
        is_done = state.is_sure
        np.minimum.at(smallest, (searches.requirement[is_done], searches.group[is_done]), state.result[is_done])
        going = np.flatnonzero(~is_done)
        if not going.size:
            return
        index, size = state.next_sizes(going, is_several=tries_several_sizes(going.size, paths.is_alike))
        paths.step_toward(searches.lane[index], size)
        searches, tries, low = searches.of(going), tries[going] + state.is_between[going], state.low[going]
    np.minimum.at(smallest, (searches.requirement, searches.group), low)  # unfinished searches: a safe size


class _SearchState:
    """State of searches, computed from the known points of the paths: results so far, and next steps.

    Attributes
    ----------
    result : (searches,)
        Sizes at which values reach their limits; infinite where no limit is reached.
    is_sure : (searches,)
        Whether the result is final.
    is_between : (searches,)
        Whether the limit lies between known points.
    low : (searches,)
        Largest known size below the limit.
    """

    def __init__(self, paths: PointPaths, searches: LimitSearches, bound: Floats, tries: Indices) -> None:
        self.searches, self.bound, self.tries, every = searches, bound, tries, np.arange(tries.size)
        end = paths.end[searches.lane]
        points = paths.known_points.take(searches.lane, axis=1)
        is_known = points[SIZE] < end[:, None]
        self.count = is_known.sum(axis=1)
        width = max(2, int(self.count.max()))
        points, is_known = points[:, :, :width], is_known[:, :width]
        self.size = np.where(is_known, points[SIZE], math.nan)
        self.square = np.where(is_known, searches.square(points), math.nan)
        reaches = self.square >= 1 - 2 * LIMIT_FRACTION
        self.is_between: Booleans = np.asarray(reaches.any(axis=1))
        first_above = np.where(self.is_between, reaches.argmax(axis=1), self.count)
        self._set_slopes(every)
        self.doubtful = self._doubtful_sizes(first_above)
        last_below = first_above - 1
        self.low, self.area = self.size[every, last_below], points[AREA, every, last_below]
        between, is_close = self._between(every, first_above)
        self.ahead, is_ahead = self._ahead(every, last_below)
        is_past, has_end = self.low >= bound, np.isfinite(end)
        self.is_sure = np.isnan(self.doubtful).all(axis=1)
        self.is_sure &= np.where(self.is_between, is_close, has_end | is_ahead) | is_past
        result = np.where(self.is_between, between, np.minimum(end, self.ahead))
        self.result = np.where((result <= bound) & ~is_past, result, math.inf)

    def _set_slopes(self, every: Indices) -> None:
        """Set the slopes at the known points, each from the parabola through the point and its neighbours."""
        self.width = self.size[:, 1:] - self.size[:, :-1]
        chord = (self.square[:, 1:] - self.square[:, :-1]) / self.width
        self.slope = np.empty(self.size.shape)
        self.slope[:, 0] = 0.0  # the square of a value that grows from 0 has no slope there
        before, after = self.width[:, :-1], self.width[:, 1:]
        self.slope[:, 1:-1] = (chord[:, :-1] * after + chord[:, 1:] * before) / (before + after)
        last = np.maximum(self.count - 1, 1)
        self.slope[every, last] = 2 * chord[every, last - 1] - self.slope[every, last - 1]

    def _doubtful_sizes(self, first_above: Indices) -> Floats:
        """Size to try next within each interval between known points below the limit, (searches, intervals). [unit]

        The size is NaN for an interval in which the value cannot exceed the limit.
        """
        low, width = self.size[:, :-1], self.width
        start, stop = self.square[:, :-1], self.square[:, 1:]
        rise, slope_low, slope_high = stop - start, self.slope[:, :-1] * width, self.slope[:, 1:] * width
        expected_rise = slope_low.copy()
        expected_rise[:, 0] = (width[:, 0] / self.searches.first) ** 2  # rise of a linear effect
        is_wide = width > SEARCH_SETTINGS.trusted_interval_fraction * self.size[:, 1:]
        threshold = np.where(is_wide, (1 - SEARCH_SETTINGS.crest_fraction) ** 2, 1.0)
        departs = np.abs(rise - expected_rise) > SEARCH_SETTINGS.departure_fraction
        size = np.where(is_wide & departs, low + width / 2, math.nan)
        for position in reversed(_crests(slope_low, rise, slope_high)):
            height = _on_cubic(position, start, rise, slope_low, slope_high)
            is_above = (position > 0.02) & (position < 0.98) & (height >= threshold)
            size = np.where(is_above, low + position * width, size)
        is_below = np.arange(1, self.size.shape[1]) < first_above[:, None]
        return np.where(is_below & (low < self.bound[:, None]), size, math.nan)

    def _between(self, every: Indices, first_above: Indices) -> tuple[Floats, Booleans]:
        """Sizes at which cubics between known points reach the limits, and whether each size is accurate enough."""
        high = np.minimum(first_above, self.size.shape[1] - 1)
        low = high - 1
        width, self.high = self.width[every, low], self.size[every, high]
        start, stop = self.square[every, low], self.square[every, high]
        slope_low, slope_high = (self.slope[every, point] * width for point in (low, high))
        position = chord = (1 - start) / (stop - start)
        square_term = 2 * (3 * (stop - start) - 2 * slope_low - slope_high)
        cube_term = 3 * (slope_low + slope_high - 2 * (stop - start))
        for _ in range(SEARCH_SETTINGS.newton_steps):
            steepness = slope_low + position * (square_term + cube_term * position)
            height = _on_cubic(position, start, stop - start, slope_low, slope_high)
            position = position - (height - 1) / steepness
            position = np.where((position >= 0) & (position <= 1), position, chord)
        size = self.high - (1 - position) * width
        is_narrow = width <= LIMIT_FRACTION * self.high
        rise = np.sqrt(stop) - np.sqrt(start)  # of the value: its slope is constant for a linear effect
        value_slope_low = np.where(start > 0, slope_low / (2 * np.sqrt(start)), rise)
        bend = np.abs(value_slope_low - slope_high / (2 * np.sqrt(stop)))
        is_bent = bend > SEARCH_SETTINGS.bent_fraction * np.abs(rise)
        trusted = np.where(is_bent, SEARCH_SETTINGS.trusted_bent_fraction, SEARCH_SETTINGS.trusted_fraction)
        is_close = (stop - 1 < 2 * trusted) & (self.high - size < 2 * trusted * self.high)
        is_close |= (1 - start < 2 * trusted) & (size - (self.high - width) < 2 * trusted * self.high)
        # Every fourth try halves the interval, which bounds the number of steps.
        position = np.where(self.tries % 4 == 3, 0.5, np.minimum(np.maximum(position, 0.01), 0.99))
        self.inside = self.high - (1 - position) * width
        by_power = self._by_power(every, low, high)
        is_steep = (stop > SEARCH_SETTINGS.steep_ratio) & (by_power > self.size[every, low]) & (by_power < self.high)
        self.inside = np.where(is_steep, by_power, self.inside)
        return np.where(is_narrow, self.high - width, size), is_close | is_narrow

    def _by_power(self, every: Indices, low: Indices, high: Indices) -> Floats:
        """Sizes at which power laws, each fitted to two known points of a path, reach the limits.

        The two points are the last known point below the limit and the first above it. If the lower point is the
        start of the path, the first two points above the limit are used instead.
        """
        after = np.minimum(high + 1, self.count - 1)
        is_start = low == 0
        below, above = np.where(is_start, high, low), np.where(is_start, after, high)
        rise, growth = (np.log(array[every, above] / array[every, below]) for array in (self.square, self.size))
        power = np.where(below < above, rise / growth, 2.0)
        return np.asarray(self.size[every, high] * self.square[every, high] ** (-1 / power))

    def _ahead(self, every: Indices, last: Indices) -> tuple[Floats, Booleans]:
        """Sizes at which parabolas through the last known points reach the limits, and whether each is accurate."""
        before = np.maximum(last - 1, 0)
        slope = self.slope[every, last]
        bend = np.where(last > 0, (slope - self.slope[every, before]) / self.width[every, before], 0.0)
        missing = 1 - self.square[every, last]
        discriminant = slope * slope + 2 * bend * missing
        steepness = slope + np.sqrt(np.maximum(discriminant, 0.0))
        is_rising = (discriminant >= 0) & (steepness > 0)
        ahead = np.where(is_rising, self.low + 2 * missing / steepness, math.inf)
        value, value_before = np.sqrt(self.square[every, last]), np.sqrt(self.square[every, before])
        rise, expected_rise = value - value_before, slope / (2 * value) * self.width[every, before]
        is_bent = np.abs(expected_rise - rise) > SEARCH_SETTINGS.bent_fraction / 2 * np.abs(rise)
        trusted = np.where(is_bent, SEARCH_SETTINGS.trusted_bent_fraction, SEARCH_SETTINGS.trusted_fraction)
        is_close = (missing < 2 * trusted) & (ahead < (1 + 1.5 * trusted) * self.low) & (self.area > 0.5)
        return ahead, is_close

    def next_sizes(self, going: Indices, *, is_several: bool) -> tuple[Indices, Floats]:
        """Choose the error sizes to try next; return the indices of the searches and the sizes, both (tries,).

        `going` are the indices of the unfinished searches. One size is tried per lane, or several if `is_several`.
        """
        growth = SEARCH_SETTINGS.growth_factor
        low, bound, is_between = self.low[going], self.bound[going], self.is_between[going]
        grown = np.minimum(np.maximum(self.ahead[going], 1.01 * low), growth * low)
        is_first = low < self.searches.first[going]
        ahead = np.where(is_first, self.searches.first[going], grown)
        size = np.where(is_between, self.inside[going], np.minimum(ahead, bound))
        doubtful = self.doubtful[going]
        if not is_several:
            least = np.where(np.isnan(doubtful), math.inf, doubtful).min(axis=1)
            size = np.where(np.isfinite(least), least, size)
            order = np.lexsort((size, self.searches.lane[going]))
            lane = self.searches.lane[going][order]
            order = order[np.append(True, np.diff(lane) > 0)]
            return going[order], size[order]
        is_needed = (low < bound) | is_between
        size, low, is_between = np.where(is_needed, size, math.nan)[:, None], low[:, None], is_between[:, None]
        neighbours = size * NEIGHBOUR_FACTORS
        is_inside = is_between & (low < neighbours) & (neighbours < self.high[going][:, None])
        is_growing = ~is_between & (~is_first & (grown >= growth * low[:, 0]))[:, None]
        is_starting = ~is_between & is_first[:, None]
        more = (
            np.where(is_inside, neighbours, math.nan),
            np.where(is_growing, size * GROWTH_FACTORS, math.nan),
            np.where(is_starting, low + (size - low) * FIRST_SIZE_FRACTIONS, math.nan),
        )
        sizes = np.concatenate((size, doubtful, *more), axis=1)
        sizes = np.where(is_between, sizes, up_to(sizes, bound[:, None]))
        row, column = np.nonzero(np.isfinite(sizes))
        return going[row], sizes[row, column]


def _on_cubic(position: Floats, start: Floats, rise: Floats, slope_low: Floats, slope_high: Floats) -> Floats:
    """Value of a cubic at a position from 0 to 1 within an interval.

    `start` is the value of the cubic at 0, and `rise` its increase from 0 to 1. `slope_low` and `slope_high` are its
    slopes at 0 and at 1.
    """
    square, cube = position**2, position * position * position
    height = start + slope_low * (position - 2 * square + cube) + slope_high * (cube - square)
    return np.asarray(height + rise * (3 * square - 2 * cube))


def _crests(slope_low: Floats, rise: Floats, slope_high: Floats) -> tuple[Floats, Floats]:
    """Positions at which the slope of the cubic in `_on_cubic` is zero; the interval extends from 0 to 1.

    If the slope is never zero, the positions are not finite.
    """
    b, c = 3 * rise - 2 * slope_low - slope_high, slope_low + slope_high - 2 * rise
    far = -(b + np.copysign(np.sqrt(b * b - 3 * c * slope_low), b))
    return far / (3 * c), slope_low / far
