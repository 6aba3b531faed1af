"""Paths of the image point as a function of the size of an error.

A path is the position of the image point as a function of the size of an error. It starts at the scene centre, at
size 0. It ends where the hidden phase exceeds π and the root of the determinant of the matrix H is less than a fifth
of its value at the centre (`exact_ranges` defines the hidden phase and H). For any larger error, no ground point has
the recorded range history. Near a fold the gradients of range and Doppler are almost parallel, and the determinant of
H is small. If the hidden phase does not exceed π at a fold, the path continues. If the peak on the path fades into a
wider peak there, the path continues from the wider peak.

A lane is one error of one case. All lanes take their steps at the same time. If there are only a few lanes, each lane
tries several sizes in one step, because this adds little computing time. `ranges.limit_search` finds the first size
at which a path reaches a limit.
"""

import math
from dataclasses import dataclass

import numpy as np

from bisar_budget.arrays import Booleans, Floats, Indices
from bisar_budget.constants import VECTOR_ROUNDING_FRACTION
from bisar_budget.ranges.exact_ranges import POINT_SETTINGS, ExactRanges, Lanes

# Rows of a known point: the size of the error [unit], then the fields of `ImagePoints`.
SIZE, EAST, NORTH, QUADRATIC, CUBIC, HIDDEN, REST, AREA = ROWS = range(8)
_NO_ERROR = np.array((0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))

# Fractions of a step that are tried in addition to the step itself if there are only a few lanes.
STEP_FRACTIONS = np.array((0.25, 0.5, 1.2, 2.0, 4.0))


@dataclass(frozen=True)
class PathSettings:
    """Numerical settings of the steps along a path.

    Attributes
    ----------
    stray_fraction : float
        Largest distance of a point from its prediction, as a fraction of the step. A point farther away belongs to
        another path.
    stray_m : float
        Distance that is allowed in addition to `stray_fraction`, because steps may have almost no length. [m]
    fade_fraction : float
        Largest distance between a peak that is lost at a fold and the wider peak into which it fades, as a fraction
        of the displacement.
    straight_fraction : float
        Largest deviation from a straight line at which a path counts as almost straight, as a fraction of the
        displacement.
    finest_step_fraction : float
        Smallest step, as a fraction of the size. A path that needs smaller steps ends.
    fold_fraction : float
        Fraction of the predicted distance to a fold that one step covers.
    least_fold_fraction : float
        Smallest trusted distance to a predicted fold, as a fraction of the last step.
    end_fraction : float
        Largest half width of an interval within which the end of a path is interpolated, as a fraction of the size.
        With this width, linear interpolation is accurate to 1e-9.
    early_fraction : float
        Size at which the curvature of a path at its start is measured, as a fraction of the first size that is tried.
    same_size_fraction : float
        Largest difference between two sizes that count as equal, as a fraction of the size.
    few_lanes_count : int
        A step tries several sizes per lane if there are fewer lanes than this number.
    """

    stray_fraction: float = 0.15
    stray_m: float = 1e-3
    fade_fraction: float = 0.3
    straight_fraction: float = 0.1
    finest_step_fraction: float = 1e-6
    fold_fraction: float = 0.8
    least_fold_fraction: float = 0.1
    end_fraction: float = 1e-6
    early_fraction: float = 0.125
    same_size_fraction: float = 1e-5
    few_lanes_count: int = 256


PATH_SETTINGS = PathSettings()


def tries_several_sizes(lane_count: int, is_alike: bool) -> bool:
    """Whether a step tries several sizes per lane.

    This is the case if `is_alike` (see `PointPaths`) is True, or if there are only a few lanes.
    """
    return is_alike or lane_count < PATH_SETTINGS.few_lanes_count


def up_to(sizes: Floats, largest: Floats) -> Floats:
    """Replace sizes that exceed `largest`, or are equal to it except for rounding, by `largest`."""
    return np.where(sizes > (1 - PATH_SETTINGS.same_size_fraction) * largest, largest, sizes)


class PointPaths:
    """The paths of the image point, one per lane.

    Parameters
    ----------
    exact : ExactRanges
        Exact ranges of the cases.
    lanes : Lanes
        The errors. The two signs of an error are two separate lanes.
    per_unit : (2, lanes)
        Displacement east and north per unit of each error, if the error is small. [m/unit]
    is_alike : bool
        Whether to try several sizes per lane for any number of lanes. The results of a case then do not depend on the
        number of cases.

    Attributes
    ----------
    end : (lanes,)
        Size at which the path ends; infinite if no end is known.
    """

    def __init__(self, exact: ExactRanges, lanes: Lanes, per_unit: Floats, *, is_alike: bool = False) -> None:
        self.exact, self.lanes, self.is_alike = exact, lanes, is_alike
        lane_count = lanes.case.size
        self.end = np.full(lane_count, math.inf)
        self._slope_at_start = per_unit
        self.known_points = np.full((len(ROWS), lane_count, 2), math.inf)  # sorted by size; unused: infinite
        self.known_points[:, :, 0] = _NO_ERROR[:, None]
        self._longest_step = np.full(lane_count, math.inf)
        self._limited_from = np.zeros(lane_count)  # `_longest_step` applies from this size on
        self._missed_last = np.zeros(lane_count, dtype=bool)  # whether the last step of the lane missed
        self._missed_ever = np.zeros(lane_count, dtype=bool)  # if so, the path's start predicts no point

    def known(self, lane: Indices, size: Floats) -> Floats:
        """Known point of each path at a given error size, (rows, lanes).

        `ROWS` lists the rows. `follow_to` must be called with the sizes before this function. The values are NaN
        beyond the end of a path.
        """
        points = self._point(lane, (self.known_points[SIZE, lane] <= size[:, None]).sum(axis=1) - 1)
        points[:, (points[SIZE] != size) | (size >= self.end[lane])] = math.nan
        return points

    def _point(self, lane: Indices, index: Indices) -> Floats:
        """Known point of each path by its position `index` in the lane's list of known points, (rows, lanes)."""
        return np.asarray(self.known_points[:, lane, index])

    # ---------------------------------------------------------------- steps
    @np.errstate(all="ignore")
    def follow_to(self, lane: Indices, size: Floats) -> None:
        """Follow the path of each lane to the given size, or to its end."""
        while True:
            is_short = (size < self.end[lane]) & (self.known_points[SIZE, lane] != size[:, None]).all(axis=1)
            if not is_short.any():
                return
            lane, size = lane[is_short], size[is_short]
            self.step_toward(lane, size)

    def step_toward(self, lane: Indices, size: Floats) -> None:
        """Make one step along the path of each lane toward a size, from the last known point below this size.

        The same lane may occur several times, with different sizes.
        """
        lane, index, size, to_fold = self._sizes_of_step(lane, size)
        last = self._point(lane, index)
        expected = self._predicted(index, lane, last, size)
        found = self.exact.phases(self.lanes.of(lane), size, expected)
        point = np.array((size, *found[1:]))
        is_on_path = found.is_settled & _is_near(last, point, expected)
        begins = _begins(lane) | _begins(index)

        # If a lane tries several sizes, its smaller ones may predict a point better than its last known point does.
        later = np.flatnonzero(~begins & ~is_on_path & found.is_settled)
        if later.size:
            is_second = begins[later - 1]
            near, middle = point[:, later - 1], np.where(is_second, last[:, later], point[:, later - 2])
            far = np.where(is_second, self._point(lane[later], np.maximum(index[later] - 1, 0)), last[:, later])
            is_on_path[later] = _is_near(near, point[:, later], _extrapolated(far, middle, near, size[later]))

        # At a fold a peak fades into a wider one. A descent on V leads to the wider peak.
        lost = np.flatnonzero(~is_on_path & (last[AREA] < POINT_SETTINGS.near_fold_fraction))
        if lost.size:
            start = last[:, lost]
            wider = self.exact.phases(
                self.lanes.of(lane[lost]), size[lost], (start[EAST], start[NORTH]), is_at_fold=True
            )
            point[1:, lost] = wider[1:]
            distance = np.hypot(wider.east - start[EAST], wider.north - start[NORTH])
            displacement = np.hypot(start[EAST], start[NORTH])
            is_on_path[lost] = wider.is_settled & (distance <= PATH_SETTINGS.fade_fraction * displacement)

        is_end = (
            is_on_path
            & (np.abs(point[AREA]) < POINT_SETTINGS.folded_fraction)
            & (point[HIDDEN] > POINT_SETTINGS.end_rad)
        )
        # Several steps may start from one known point. Only those before the first miss are kept.
        is_miss = ~is_on_path | is_end
        misses = np.cumsum(is_miss)
        misses = misses - (misses - is_miss)[np.maximum.accumulate(np.where(begins, np.arange(lane.size), 0))]
        is_kept, is_first_miss = misses == 0, (misses == 1) & is_miss
        self._longest_step[lane] *= 2
        self._missed_last[lane] = False
        if is_first_miss.any():
            before = np.where(begins, last, np.roll(point, 1, axis=1))
            to_fold = np.where(begins & ~found.is_settled, to_fold, math.inf)
            miss = np.flatnonzero(is_first_miss)
            reached = (before[SIZE] - last[SIZE])[miss]
            self._shorten_step(lane[miss], point[:, miss], before[:, miss], reached, to_fold[miss], is_end[miss])
        self._insert(lane[is_kept], point[:, is_kept])

    def _sizes_of_step(self, lane: Indices, size: Floats) -> tuple[Indices, Indices, Floats, Floats]:
        """Choose the error sizes that the next step of each lane tries.

        Returns four arrays (tries,), sorted by lane and size: the lane, the index of its last known point at a
        smaller size, the size to try, and the increase in size from that point to the next fold.
        """
        index = (self.known_points[SIZE, lane] < size[:, None]).sum(axis=1) - 1
        last = self._point(lane, index)
        to_fold = self._distance_to_fold(index, lane, last)
        longest = np.where(last[SIZE] >= self._limited_from[lane], self._longest_step[lane], math.inf)
        is_far_fold = to_fold > PATH_SETTINGS.finest_step_fraction * last[SIZE]
        step = np.minimum(longest, np.where(is_far_fold, PATH_SETTINGS.fold_fraction * to_fold, math.inf))
        # A size slightly beyond the step is also reached in one step, but not after a miss: it would miss again.
        is_after_miss = self._missed_last[lane] & np.isfinite(longest)
        is_beyond = size - last[SIZE] >= np.where(is_after_miss, 1.0, 1.2) * step
        asked, size = size, np.where(is_beyond, last[SIZE] + step, size)
        if tries_several_sizes(lane.size, self.is_alike) and is_beyond.any():
            more = (last[SIZE] + np.multiply.outer(STEP_FRACTIONS, step))[:, is_beyond]
            size = np.concatenate((size, up_to(more, asked[is_beyond]).ravel()))
            lane, index, to_fold = (
                np.concatenate((array, np.tile(array[is_beyond], STEP_FRACTIONS.size)))
                for array in (lane, index, to_fold)
            )
        order = np.lexsort((size, lane))
        is_new, next_size = _begins(lane[order]), size[order]
        is_new[1:] |= next_size[1:] - next_size[:-1] > VECTOR_ROUNDING_FRACTION * next_size[1:]
        order = order[is_new]
        return lane[order], index[order], size[order], to_fold[order]

    def _shorten_step(
        self, lane: Indices, point: Floats, before: Floats, reached: Floats, to_fold: Floats, is_end: Booleans
    ) -> None:
        """Shorten the next step on paths whose last step missed, or record the end of these paths.

        A step misses if it does not find a point on the path, or if the point lies beyond the end of the path.
        """
        end = _end_between(before, point)
        halved = np.maximum((point[SIZE] - before[SIZE]) / 2, reached)
        step = np.where(is_end, 0.9 * (end - before[SIZE]), halved)
        curvature = (end - before[SIZE]) * (point[SIZE] - end)  # bounds the error of the linear interpolation
        is_narrow = is_end & (curvature < (PATH_SETTINGS.end_fraction * point[SIZE]) ** 2)
        is_stuck = ~is_end & (step < PATH_SETTINGS.finest_step_fraction * point[SIZE])
        self.end[lane[is_narrow]] = end[is_narrow]
        self.end[lane[is_stuck]] = (before[SIZE] + np.minimum(step, to_fold))[is_stuck]
        self._longest_step[lane], self._limited_from[lane] = step, before[SIZE]
        self._missed_last[lane] = self._missed_ever[lane] = True

    def _insert(self, lane: Indices, point: Floats) -> None:
        """Insert new points into the lists of known points, which stay sorted by size."""
        if not lane.size:
            return
        first = np.flatnonzero(_begins(lane))
        changed, count = lane[first], np.append(first[1:], lane.size) - first
        filled = np.isfinite(self.known_points[SIZE, changed]).sum(axis=1)
        width, needed = self.known_points.shape[2], int((filled + count).max())
        if needed > width:  # doubled at least, because most steps add only one point
            more = np.full((len(ROWS), self.end.size, max(width, needed - width)), math.inf)
            self.known_points = np.concatenate((self.known_points, more), axis=2)
        self.known_points[:, lane, np.repeat(filled - first, count) + np.arange(lane.size)] = point
        if (point[SIZE, first] < self.known_points[SIZE, changed, filled - 1]).any():
            points = self.known_points[:, changed, :needed]
            order = points[SIZE].argsort(axis=1, kind="stable")
            self.known_points[:, changed, :needed] = np.take_along_axis(points, order[None], axis=2)

    # ---------------------------------------------------------------- predictions
    def _distance_to_fold(self, index: Indices, lane: Indices, last: Floats) -> Floats:
        """Increase of an error's size from its last known point to the next fold [unit]; infinite if no fold follows.

        At a fold the range and Doppler gradients are parallel, and the determinant of the matrix H (see
        `exact_ranges`) is zero. A parabola through the determinants (squared areas) at the last three known points is
        extrapolated to zero.
        """
        before, earlier = (self._point(lane, np.maximum(index - back, 0)) for back in (1, 2))
        step, step_before = last[SIZE] - before[SIZE], before[SIZE] - earlier[SIZE]
        square, square_before = last[AREA] ** 2, before[AREA] ** 2
        decrease = (square_before - square) / step
        curvature = ((earlier[AREA] ** 2 - square_before) / step_before - decrease) / (step + step_before)
        curvature = np.where(index > 1, curvature, 0.0)
        decrease = decrease - curvature * step
        distance = 2 * square / (decrease + np.sqrt(np.maximum(decrease**2 - 4 * curvature * square, 0.0)))
        is_ahead = (index > 0) & (decrease > 0) & (distance > PATH_SETTINGS.least_fold_fraction * step)
        return np.where(is_ahead, distance, math.inf)

    def _predicted(self, index: Indices, lane: Indices, last: Floats, size: Floats) -> tuple[Floats, Floats]:
        """Predict the image points at given sizes from the known points, east and north. [m]

        If the path is almost straight, a parabola that begins at its start is used. If the path is bent, the
        prediction begins at its last known point.
        """
        u, v = self._slope_at_start[:, lane]
        bend = (last[EAST] - u * last[SIZE], last[NORTH] - v * last[SIZE])
        growth = np.where(index > 0, (size / last[SIZE]) ** 2, 0.0)
        is_straight = np.hypot(*bend) <= PATH_SETTINGS.straight_fraction * np.hypot(last[EAST], last[NORTH])
        east, north = u * size + bend[0] * growth, v * size + bend[1] * growth
        fresh = np.flatnonzero(index == 0)
        if fresh.size:  # the slope at a small size shows the curvature of the path at its start
            early = PATH_SETTINGS.early_fraction * size[fresh]
            slope = self._slopes_at(lane[fresh], np.array((early, u[fresh] * early, v[fresh] * early)))
            half = size[fresh] / (2 * PATH_SETTINGS.early_fraction)
            east[fresh] += half * (slope[0] - u[fresh])
            north[fresh] += half * (slope[1] - v[fresh])
        bent = np.flatnonzero(~is_straight | (self._missed_ever[lane] & (index > 0)))
        if bent.size:
            east[bent], north[bent] = self._predicted_from_last(index[bent], lane[bent], last[:, bent], size[bent])
        return east, north

    def _predicted_from_last(
        self, index: Indices, lane: Indices, last: Floats, size: Floats
    ) -> tuple[Floats, Floats]:
        """Predict east and north [m] of the image points from the slopes of each path at its last two known points.

        The slope is assumed to be a linear function of the error size. Near a fold it is assumed to be a linear
        function of the square root of the distance to the fold.
        """
        before = self._point(lane, np.maximum(index - 1, 0))
        slopes = self._slopes_at(np.tile(lane, 2), np.concatenate((last, before), axis=1))
        fold = last[SIZE] + self._distance_to_fold(index, lane, last)
        is_at_fold = np.isfinite(fold)
        ahead, here, back = (
            np.where(is_at_fold, -np.sqrt(np.maximum(fold - at, 0.0)), at) for at in (size, last[SIZE], before[SIZE])
        )
        of_here, of_back = (np.where(is_at_fold, -2 * root, 1.0) for root in (here, back))
        step = ahead - here
        bend = np.where(index > 0, step / (2 * (here - back)), 0.0)
        (u, u_back), (v, v_back) = (slope.reshape(2, -1) * (of_here, of_back) for slope in slopes)
        return last[EAST] + (u + bend * (u - u_back)) * step, last[NORTH] + (v + bend * (v - v_back)) * step

    def _slopes_at(self, lane: Indices, points: Floats) -> tuple[Floats, Floats]:
        """Slopes of the path at known points, east and north. [m/unit]"""
        east, north = self.exact.way(self.lanes.of(lane), points[SIZE], (points[EAST], points[NORTH]))
        (u, v), is_start = self._slope_at_start[:, lane], points[SIZE] == 0
        return np.where(is_start, u, east), np.where(is_start, v, north)


def _begins(values: Indices) -> Booleans:
    """Whether each value differs from the previous value; True for the first value."""
    begins = np.ones(values.size, dtype=bool)
    begins[1:] = values[1:] != values[:-1]
    return begins


def _is_near(last: Floats, point: Floats, expected: tuple[Floats, Floats]) -> Booleans:
    """Whether points are close enough to their predicted positions to belong to the path, (lanes,)."""
    stray = np.hypot(point[EAST] - expected[0], point[NORTH] - expected[1])
    predicted_step = np.hypot(expected[0] - last[EAST], expected[1] - last[NORTH])
    step = np.maximum(np.hypot(point[EAST] - last[EAST], point[NORTH] - last[NORTH]), predicted_step)
    return np.asarray(stray <= PATH_SETTINGS.stray_fraction * step + PATH_SETTINGS.stray_m)


def _extrapolated(far: Floats, middle: Floats, near: Floats, size: Floats) -> tuple[Floats, Floats]:
    """Extrapolate paths to the error sizes `size`, each by a parabola through three points, east and north. [m]

    Where `far` and `middle` are the same point, a straight line is used instead.
    """
    has_three = far[SIZE] < middle[SIZE]
    reach = (size - near[SIZE]) / (near[SIZE] - middle[SIZE])
    weight = np.where(has_three, (size - middle[SIZE]) / (near[SIZE] - far[SIZE]), 0.0) * reach
    ratio = (near[SIZE] - middle[SIZE]) / (middle[SIZE] - far[SIZE])
    step = near[EAST : NORTH + 1] - middle[EAST : NORTH + 1]
    step_before = np.where(has_three, (middle[EAST : NORTH + 1] - far[EAST : NORTH + 1]) * ratio, 0.0)
    east, north = near[EAST : NORTH + 1] + step * reach + (step - step_before) * weight
    return east, north


def _end_between(before: Floats, beyond: Floats) -> Floats:
    """Size at which the path ends, between a point before and a point beyond the end. [unit]

    The path ends where two conditions are met: the determinant of the matrix H is small, as near a fold, and the
    hidden phase exceeds π (`exact_ranges` defines both quantities). The size at which each condition is first met is
    found by linear interpolation of the determinant or of the hidden phase.
    """
    low, high, square, square_beyond = before[HIDDEN], beyond[HIDDEN], before[AREA] ** 2, beyond[AREA] ** 2
    to_hidden = np.where(low < POINT_SETTINGS.end_rad, (POINT_SETTINGS.end_rad - low) / (high - low), 0.0)
    to_fold = np.where(
        square > POINT_SETTINGS.folded_fraction**2,
        (square - POINT_SETTINGS.folded_fraction**2) / (square - square_beyond),
        0.0,
    )
    return np.asarray(before[SIZE] + (beyond[SIZE] - before[SIZE]) * np.maximum(to_hidden, to_fold))
