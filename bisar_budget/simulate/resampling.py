"""An image read anywhere: between pixels of a grid that may bend, and rotated back to the axes of the scene."""

import math

import numpy as np

from bisar_budget.simulate.impulse_response import upsampled
from bisar_budget.simulate.phase_history import Complexes, Floats

_STEPS = 8  # towards a pixel's place in a grid
_CLOSE = 0.02  # pixels: found
_BLOCK = 1 << 16  # points read at once
_FINER = 2  # before the interpolation
_TAPS = 6  # with these a response sampled three times per cell is read to -70 dB


def between(values: Floats, row: Floats, column: Floats) -> Floats:
    """Read a table (nx, ny, k) at fractional rows and columns (n,), straight lines between; beyond it, continued."""
    nx, ny = values.shape[:2]
    i = np.clip(np.floor(row).astype(np.int64), 0, nx - 2)
    j = np.clip(np.floor(column).astype(np.int64), 0, ny - 2)
    u, v = (row - i)[:, None], (column - j)[:, None]
    read: Floats = (
        (1 - u) * ((1 - v) * values[i, j] + v * values[i, j + 1])
        + u * ((1 - v) * values[i + 1, j] + v * values[i + 1, j + 1])
    )  # fmt: skip
    return read


def places_in(grid: Floats, points: Floats) -> tuple[Floats, Floats]:
    """Fractional row and column in a grid (nx, ny, 2) at which it has ground points (n, 2); NaN outside."""
    nx, ny = grid.shape[:2]
    middle = grid[nx // 2, ny // 2]
    steps = np.stack((np.gradient(grid, axis=0), np.gradient(grid, axis=1)), axis=-1)
    inverse = np.linalg.inv(steps[nx // 2, ny // 2])
    place = (points - middle) @ inverse.T + (nx // 2, ny // 2)
    for _ in range(_STEPS):
        clipped = np.clip(place, -1, (nx, ny))
        jacobian = between(steps.reshape(nx, ny, 4), clipped[:, 0], clipped[:, 1]).reshape(-1, 2, 2)
        off = points - between(grid, clipped[:, 0], clipped[:, 1])
        step = np.linalg.solve(jacobian, off[..., None])[..., 0]
        place = clipped + step
    lost = np.abs(step).max(axis=1) > _CLOSE
    lost |= ((place < -0.5) | (place > np.array([nx, ny]) - 0.5)).any(axis=1)
    place[lost] = math.nan
    return place[:, 0], place[:, 1]


def resampled(image: Complexes, grid: Floats, points: Floats) -> Complexes:
    """Read an image on a grid at other ground points: in another rotation, the same image.

    Parameters
    ----------
    image : (nx, ny) ndarray
        At baseband, three samples per resolution cell or more.
    grid : (nx, ny, 3) ndarray
        Its pixels: east, north, up. [m]
    points : (mx, my, 3) ndarray
        Where to read it. [m]

    Returns
    -------
    (mx, my) ndarray
        Zero where the grid does not reach.
    """
    flat = points[..., :2].reshape(-1, 2)
    read = np.zeros(len(flat), dtype=complex)
    fine = upsampled(upsampled(image, _FINER).T, _FINER).T
    for start in range(0, len(flat), _BLOCK):
        row, column = places_in(grid[..., :2], flat[start : start + _BLOCK])
        inside = np.nonzero(np.isfinite(row))[0]
        read[start + inside] = _interpolated(fine, _FINER * row[inside], _FINER * column[inside])
    return read.reshape(points.shape[:2])


def _interpolated(image: Complexes, row: Floats, column: Floats) -> Complexes:
    """Lagrange interpolation at scattered places; an image repeats beyond its edges, as its spectrum has it."""
    total = np.zeros(row.size, dtype=complex)
    (i, by_row), (j, by_column) = _weights(row), _weights(column)
    for a in range(_TAPS):
        line = np.zeros(row.size, dtype=complex)
        for b in range(_TAPS):
            line += by_column[b] * image[(i + a) % image.shape[0], (j + b) % image.shape[1]]
        total += by_row[a] * line
    return total


def _weights(place: Floats) -> tuple[np.ndarray[tuple[int], np.dtype[np.int64]], Floats]:
    """First sample of each stencil, (n,), and the stencil's weights, (taps, n)."""
    first = np.floor(place).astype(np.int64) - _TAPS // 2 + 1
    offset = place - first
    weights = np.ones((_TAPS, place.size))
    for tap in range(_TAPS):
        for other in range(_TAPS):
            if other != tap:
                weights[tap] *= (offset - other) / (tap - other)
    return first, weights
