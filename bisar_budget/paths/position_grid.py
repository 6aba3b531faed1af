"""Rounding of the fixes in a log to a grid, which limits the accuracy of the positions even for a perfect receiver.

A log writes degrees, minutes and metres with a fixed number of decimals. The step of the grid is the coarsest decimal
step such that all values differ by multiples of it. It is found from the values alone; trailing zeros in a cell are
not used as evidence. A step counts as a grid only if the fixes deviate from a smooth path by about the rounding error
of the step. This condition is needed because the fixes of a simulated platform may lie on a coarse grid by chance, if
the platform is at rest or its speed is a round number.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.polynomial import chebyshev

from bisar_budget.paths.accuracy import Matrix
from bisar_budget.paths.earth import Floats, earth_fixed_places

_ARC_UNITS_RAD = (math.pi / 180, math.pi / 10_800, math.pi / 648_000)  # degree, minute, second
_LENGTH_UNITS_M = (1.0,)
_DECIMAL_DIGITS = range(-3, 13)
_MIN_FIXES = 12  # with fewer fixes, a grid cannot be recognised
_MAX_FIXES = 4096  # only this number of fixes is examined
_PATH_ORDER = 8  # of the smooth path from which the roughness is measured
_MIN_ROUGHNESS_RATIO = 0.1  # of the rms deviation from a smooth path to a step; rounding to the step gives 0.29
_BINARY_ROUNDING_FACTOR = 16  # times the machine epsilon: rounding of a difference of two numbers
_MAX_ROUNDING_RATIO = 0.05  # of binary rounding to a step; if it is larger, a grid cannot be recognised


def decimal_step(times: Floats, values: Floats, units: Sequence[float]) -> float:
    """Largest decimal step to which all values of a coordinate are rounded; 0 if there is no such step. [SI]

    Parameters
    ----------
    times : (n,) ndarray
        Times, in ascending order. [s]
    values : (n,) ndarray
        Values of the coordinate. [SI]
    units : sequence of float
        Units in which the log may contain the coordinate, each as its size in SI. A decimal step is a unit times a
        power of ten.
    """
    stride = -(-len(values) // _MAX_FIXES)
    values, times = values[::stride], times[::stride]
    if len(values) < _MIN_FIXES or not np.ptp(values):
        return 0.0
    from_first, largest = values - values[0], float(np.abs(values).max())
    steps = []
    for unit in units:
        for decimals in _DECIMAL_DIGITS:
            step = unit * 10.0**-decimals
            rounding = _BINARY_ROUNDING_FACTOR * np.finfo(float).eps * largest / step
            if rounding > _MAX_ROUNDING_RATIO:
                break
            count = from_first / step
            if np.abs(count - np.round(count)).max() <= rounding:
                steps.append(step)
                break
    step = max(steps, default=0.0)
    return step if step and _roughness(times, values) >= _MIN_ROUGHNESS_RATIO * step else 0.0


def _roughness(times: Floats, values: Floats) -> float:
    """Root mean square deviation of values (n,) from a polynomial fitted to them, in the unit of the values."""
    normalised_times = 2 * (times - times[0]) / (times[-1] - times[0]) - 1
    basis = chebyshev.chebvander(normalised_times, min(_PATH_ORDER, len(values) // 3))
    centred = values - values.mean()
    residuals = centred - basis @ np.linalg.lstsq(basis, centred, rcond=None)[0]
    return float(np.sqrt(np.mean(residuals**2)))


def geodetic_grid(times: Floats, latitude: Floats, longitude: Floats, height: Floats) -> Matrix:
    """Displacements by one grid step in latitude, longitude and height, in Earth-fixed axes, (3, 3). [m]

    The result has a row for each coordinate. The row of a coordinate without a grid is zero.
    """
    middle = len(times) // 2
    middle_fix = np.array([latitude[middle], longitude[middle], height[middle]])
    units = (_ARC_UNITS_RAD, _ARC_UNITS_RAD, _LENGTH_UNITS_M)
    steps = [
        decimal_step(times, values, unit) for values, unit in zip((latitude, longitude, height), units, strict=True)
    ]
    corners = [middle_fix, *(middle_fix + step * axis for step, axis in zip(steps, np.eye(3), strict=True))]
    origin, *neighbours = earth_fixed_places(*np.array(corners).T)
    return tuple(
        tuple((neighbour - origin).tolist()) if step else (0.0, 0.0, 0.0)
        for neighbour, step in zip(neighbours, steps, strict=True)
    )


def cartesian_grid(times: Floats, positions: Floats) -> Matrix:
    """Displacements by one grid step along each axis of positions (n, 3), as vectors (3, 3). [m]

    The result has a row for each axis. The row of an axis without a grid is zero.
    """
    steps = [decimal_step(times, values, _LENGTH_UNITS_M) for values in positions.T]
    return tuple(tuple(row) for row in np.diag(steps).tolist())
