"""Velocity of a logged flight before, during and after the aperture, for the errors of an aided navigation."""

import numpy as np

from bisar_budget.arrays import Floats

_STEP_S = 0.25
_WINDOW_S = 1.0  # on each side of a time, within which fixes determine the velocity
_FEWEST_FIXES_COUNT = 5
_POLYNOMIAL_ORDER_COUNT = 3  # constant, velocity, acceleration


class FlightHistory:
    """Velocity of a platform during its logged flight, interpolated linearly between given times.

    Histories are compared by identity, not by value. Cases of a sweep that share a history object therefore have
    equal histories.

    Parameters
    ----------
    times : (n,)
        Slow times in ascending order. [s]
    velocities : (n, 3)
        Velocities east, north, up. [m/s]
    """

    def __init__(self, times: Floats, velocities: Floats) -> None:
        self.times, self.velocities = times, velocities

    def at(self, times: Floats) -> Floats:
        """Velocities (3, ...) [m/s] at slow times (...) [s].

        Before the first and after the last time of the history, the velocity is constant.
        """
        return np.array([np.interp(times, self.times, component) for component in self.velocities.T])


def history_of(times: Floats, positions: Floats, start: float, end: float) -> FlightHistory | None:
    """Compute the velocities of a flight from the fixes of its log; None if the log has too few fixes.

    At each time of the history, a parabola is fitted to the fixes that are less than a second away. If there are too
    few such fixes, it is fitted to the nearest fixes. The slope of the parabola is the velocity.

    Parameters
    ----------
    times : (n,)
        Slow times of the fixes in ascending order. [s]
    positions : (n, 3)
        Positions of the fixes, east, north, up. [m]
    start, end : float
        First and last slow time for which velocities are needed. [s]
    """
    first, last = max(start, float(times[0])), min(end, float(times[-1]))
    if last - first < _STEP_S or np.count_nonzero((times >= first) & (times <= last)) < _FEWEST_FIXES_COUNT:
        return None
    moments = np.linspace(first, last, 2 + int((last - first) / _STEP_S))
    velocities = np.empty((moments.size, 3))
    for row, moment in zip(velocities, moments.tolist(), strict=True):
        low, high = np.searchsorted(times, (moment - _WINDOW_S, moment + _WINDOW_S))
        if high - low < _FEWEST_FIXES_COUNT:
            low = int(np.clip((low + high) // 2 - _FEWEST_FIXES_COUNT // 2, 0, times.size - _FEWEST_FIXES_COUNT))
            high = low + _FEWEST_FIXES_COUNT
        powers = np.vander(times[low:high] - moment, _POLYNOMIAL_ORDER_COUNT, increasing=True)
        row[:] = np.linalg.lstsq(powers, positions[low:high] - positions[low], rcond=None)[0][1]
    return FlightHistory(moments, velocities)
