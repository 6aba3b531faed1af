"""The grid on which a log writes its fixes: a position is known to a step of it, however good its receiver is.

Degrees, minutes and metres are written with some number of decimals. The coarsest decimal step on which all fixes lie
is found from the numbers: zeros at the end of a cell say nothing. It is a grid only where the fixes leave a smooth
path by about as much as rounding would: those of a platform that was made up, at rest or at a round speed, lie on any
grid.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.polynomial import chebyshev

from bisar_budget.paths.accuracy import Matrix
from bisar_budget.paths.earth import Floats, earth_fixed_places

_ARC_UNITS_RAD = (math.pi / 180, math.pi / 10_800, math.pi / 648_000)  # degree, minute, second
_METRE = (1.0,)
_COARSEST, _FINEST = -3, 12  # decimals
_FEWEST = 12  # fixes that tell a grid
_MOST_LOOKED_AT = 4096  # fixes
_ORDER = 8  # of the smooth path that exact numbers may follow
_ROUNDS_TO = 0.1  # of a step: the least that rounding leaves, root mean square; it is 0.29 of one
_ULPS = 16  # by which a number may be off its decimal, and the same for the first
_VISIBLE = 0.05  # of a step that rounding of binary numbers may be, where a grid can be told


def decimal_step(times: Floats, values: Floats, units: Sequence[float]) -> float:
    """The largest decimal step, of one of some units, on which all values lie; 0 where they lie on none.

    Parameters
    ----------
    times : (n,) ndarray
        Rising. [s]
    values : (n,) ndarray
        Of a coordinate. [SI]
    units : sequence of float
        In which the coordinate may be written. [SI]
    """
    stride = -(-len(values) // _MOST_LOOKED_AT)
    values, times = values[::stride], times[::stride]
    if len(values) < _FEWEST or not np.ptp(values):
        return 0.0
    from_first, largest = values - values[0], float(np.abs(values).max())
    steps = []
    for unit in units:
        for decimals in range(_COARSEST, _FINEST + 1):
            step = unit * 10.0**-decimals
            doubt = _ULPS * np.finfo(float).eps * largest / step
            if doubt > _VISIBLE:
                break
            count = from_first / step
            if np.abs(count - np.round(count)).max() <= doubt:
                steps.append(step)
                break
    step = max(steps, default=0.0)
    return step if step and _roughness(times, values) >= _ROUNDS_TO * step else 0.0


def _roughness(times: Floats, values: Floats) -> float:
    """Root mean square of what a polynomial leaves of values."""
    at = 2 * (times - times[0]) / (times[-1] - times[0]) - 1
    basis = chebyshev.chebvander(at, min(_ORDER, len(values) // 3))
    centred = values - values.mean()
    left = centred - basis @ np.linalg.lstsq(basis, centred, rcond=None)[0]
    return float(np.sqrt(np.mean(left**2)))


def geodetic_grid(times: Floats, latitude: Floats, longitude: Floats, height: Floats) -> Matrix:
    """One step north, east and up, each in the axes of the Earth; zeros where a coordinate has no grid. [m]"""
    middle = len(times) // 2
    here = np.array([latitude[middle], longitude[middle], height[middle]])
    units = (_ARC_UNITS_RAD, _ARC_UNITS_RAD, _METRE)
    steps = [
        decimal_step(times, values, unit) for values, unit in zip((latitude, longitude, height), units, strict=True)
    ]
    sides = [here, *(here + step * axis for step, axis in zip(steps, np.eye(3), strict=True))]
    first, *others = earth_fixed_places(*np.array(sides).T)
    return tuple(
        tuple((other - first).tolist()) if step else (0.0, 0.0, 0.0)
        for other, step in zip(others, steps, strict=True)
    )


def cartesian_grid(times: Floats, places: Floats) -> Matrix:
    """One step along each axis of places (n, 3); zeros where a coordinate has no grid. [m]"""
    steps = [decimal_step(times, values, _METRE) for values in places.T]
    return tuple(tuple(row) for row in np.diag(steps).tolist())
