"""Timeline of an aided navigation: moments of the fixes, nodes over the aperture, and steps between them.

The moments of one case form a column; shorter columns are padded by repeating their last moment.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bisar_budget.arrays import Booleans, Floats, Indices

# Nodes over an aperture. Integrals of products of two Legendre polynomials of up to order 23 must be exact, or a
# constant error would leak into every order.
_FEWEST_SMOOTHED_NODE_COUNT, _MOST_SMOOTHED_NODE_COUNT = 48, 256
_FEWEST_PIECE_COUNT, _FEWEST_FILTERED_NODE_COUNT = 12, 72
_FEW_PIECE_COUNT, _NODES_OF_FEW_COUNT, _NODES_OF_MANY_COUNT = 100, 4, 2  # nodes in each of few, and of many pieces
_COINCIDENCE_S = 1e-9  # moments that are closer are one moment


@dataclass(frozen=True, kw_only=True)
class FixSchedule:
    """Schedule of the fixes of one case.

    Attributes
    ----------
    half_s : float
        Half the aperture time. [s]
    before_s, after_s : float
        Durations of the flight before and after the aperture from which fixes are used. [s]
    rate_hz : float
        Rate of the fixes [Hz]. Without outages, there is a fix at mid-aperture.
    outages : sequence of (float, float)
        Intervals without fixes, relative to mid-aperture, both ends included. [s]
    turning_step_s : float
        Longest step between two moments within the aperture, which has to resolve turns of the path. [s]
    outer_step_s : float
        Longest step between two moments outside the aperture. [s]
    is_smoothed : bool
        Whether fixes after a moment contribute to the position at this moment.
    """

    half_s: float
    before_s: float
    after_s: float
    rate_hz: float
    outages: Sequence[tuple[float, float]] = ()
    turning_step_s: float = math.inf
    outer_step_s: float = 1.0
    is_smoothed: bool = True

    def fixes(self) -> Floats:
        """Times of the fixes relative to mid-aperture: multiples of 1/rate, except during outages. [s]

        A fix at the first or the last time of the flight is included.
        """
        first = math.ceil((-self.half_s - self.before_s) * self.rate_hz - _COINCIDENCE_S)
        last = math.floor((self.half_s + self.after_s) * self.rate_hz + _COINCIDENCE_S)
        times = np.arange(first, last + 1) / self.rate_hz
        for start, end in self.outages:
            times = times[(times < start - _COINCIDENCE_S) | (times > end + _COINCIDENCE_S)]
        return times

    def nodes(self) -> tuple[Floats, Floats]:
        """Nodes over the aperture [s] and weights whose sum is 1, by Gauss–Legendre quadrature.

        The error of a filter jumps at each fix, so it is integrated piece by piece, and no piece extends over a fix.
        A smoothed error has no jumps.
        """
        fixes = self.fixes()
        inner = fixes[np.abs(fixes) < self.half_s - _COINCIDENCE_S]
        if self.is_smoothed:
            edges, fewest = np.array((-self.half_s, self.half_s)), 2 * (inner.size + 1)
            count = min(max(fewest, _FEWEST_SMOOTHED_NODE_COUNT), _MOST_SMOOTHED_NODE_COUNT)
        else:
            ends = -self.half_s * np.cos(np.linspace(0.0, np.pi, _FEWEST_PIECE_COUNT + 1))  # closer near the ends
            edges = _distinct(np.concatenate((ends, inner)))
            pieces = edges.size - 1
            fewest = _NODES_OF_FEW_COUNT if pieces < _FEW_PIECE_COUNT else _NODES_OF_MANY_COUNT
            count = max(fewest, -(-_FEWEST_FILTERED_NODE_COUNT // pieces))
        abscissas, weights = np.polynomial.legendre.leggauss(count)
        middles, halves = (edges[1:] + edges[:-1]) / 2, np.diff(edges) / 2
        times = middles[:, None] + halves[:, None] * abscissas
        return times.ravel(), (halves[:, None] * weights / (2 * self.half_s)).ravel()


@dataclass(frozen=True)
class Timeline:
    """Moments of an aided navigation, from the start of the flight to its end, in each case.

    Attributes
    ----------
    times : (moments, cases)
        Slow times in ascending order. [s]
    is_fix : (moments, cases)
        Whether a fix is taken at the moment.
    weights : (moments, cases)
        Weights of a mean over the aperture; 0 for moments that are not nodes.
    middle : (cases,)
        Index of the moment that is mid-aperture.
    """

    times: Floats
    is_fix: Booleans
    weights: Floats
    middle: Indices

    @property
    def steps(self) -> Floats:
        """Duration of each step between two moments, (moments − 1, cases). [s]"""
        return np.diff(self.times, axis=0)

    @property
    def middles(self) -> Floats:
        """Time in the middle of each step, (moments − 1, cases). [s]"""
        return np.asarray((self.times[1:] + self.times[:-1]) / 2)


def timeline_of(schedules: Sequence[FixSchedule]) -> Timeline:
    """Make the timeline of the schedules of all cases."""
    columns = [_column(schedule) for schedule in schedules]
    length = max(column[0].size for column in columns)
    times, is_fix, weights = (np.zeros((length, len(columns))) for _ in range(3))
    for case, (moments, fixes, node_weights) in enumerate(columns):
        times[:, case] = moments[-1]
        times[: moments.size, case] = moments
        is_fix[: moments.size, case] = fixes
        weights[: moments.size, case] = node_weights
    middle = np.array([np.abs(moments).argmin() for moments, _, _ in columns])
    return Timeline(times, is_fix.astype(bool), weights, middle)


def _column(schedule: FixSchedule) -> tuple[Floats, Booleans, Floats]:
    """Moments of one case, whether each is a fix, and its weight in a mean over the aperture."""
    half, start, end = schedule.half_s, -schedule.half_s - schedule.before_s, schedule.half_s + schedule.after_s
    fixes, (nodes, node_weights) = schedule.fixes(), schedule.nodes()
    moments = _distinct(np.concatenate(([start, -half, 0.0, half, end], fixes, nodes)))
    moments = _divided(moments, half, schedule.turning_step_s, schedule.outer_step_s)
    is_fix, weights = np.zeros(moments.size, dtype=bool), np.zeros(moments.size)
    is_fix[_index_of(moments, fixes)] = True
    np.add.at(weights, _index_of(moments, nodes), node_weights)
    return moments, is_fix, weights


def _divided(moments: Floats, half: float, inner: float, outer: float) -> Floats:
    """Divide each step between two moments into equal parts of limited duration, and return all moments. [s]

    The limit is `inner` [s] within the aperture, and `outer` [s] before and after it.
    """
    steps, is_inner = np.diff(moments), np.abs(moments[1:] + moments[:-1]) < 2 * half
    counts = np.maximum(1, np.ceil(steps / np.where(is_inner, inner, outer) - _COINCIDENCE_S)).astype(int)
    if np.all(counts == 1):
        return moments
    divided_steps = [
        start + step * np.arange(count) / count for start, step, count in zip(moments, steps, counts, strict=False)
    ]
    return np.concatenate((*divided_steps, moments[-1:]))


def _distinct(moments: Floats) -> Floats:
    """Sort moments, and drop each moment that coincides with an earlier moment."""
    ascending = np.sort(moments)
    return ascending[np.concatenate(([True], np.diff(ascending) > _COINCIDENCE_S))]


def _index_of(moments: Floats, times: Floats) -> Indices:
    """Index of the moment that coincides with each time."""
    return np.searchsorted(moments, times - 2 * _COINCIDENCE_S)
