"""Measures of a point response: width, peak and sidelobe ratios.

A cut is a line of evenly spaced complex image samples that contains the full response. Sidelobes are measured outside
a mask that covers the mainlobe. The mask is either fixed, with edges at the first nulls of the error-free response,
or it has edges at the nulls of the measured response itself. If an image is formed with a window, a mask of the
second kind conceals a quadratic phase error, because the shoulder raised by the error merges with the mainlobe.

Other tools measure sidelobes only up to a certain distance from the peak. For example, perseo-quality computes its
PSLR within five widths of the peak and its ISLR within ten. For a uniform aperture its ISLR is therefore -10.21 dB
instead of -9.68 dB.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from bisar_budget.simulator.phase_history import Complexes, Floats

_FULL_WINDOW = slice(None), slice(None)
_UPSAMPLING_FACTOR = 32
_REACH_SAMPLES = 8  # samples on each side that an interpolation uses
_KAISER_FACTOR = 12.0  # shape of the window; the error is -110 dB for three samples per cell
_CHIP_UPSAMPLING_FACTOR = 8
_BLOCK_COLUMNS = 512  # columns that are interpolated at once
_NARROWING_STEPS = 3  # steps after which a row is accurate to a few thousandths
_GRID_SEARCH_STEPS = 8  # Newton steps that find a point in a grid
_GRID_TOLERANCE_PX = 0.02  # pixels; last step of a search that has found its point
_BLOCK_POINTS = 1 << 16  # read at once
_IMAGE_UPSAMPLING_FACTOR = 2  # before the interpolation
_TAPS_COUNT = 6  # the error is -70 dB for three samples per cell


@dataclass(frozen=True, kw_only=True)
class ImpulseResponse:
    """Width, peak and sidelobe ratios of a point response along one cut.

    `irw_m` [m] is the width at half power. `peak` is the magnitude of the peak, and `peak_m` [m] is its position
    along the cut relative to the middle sample. `mask_m` [m] is the half width of the mainlobe mask. `pslr_db` and
    `islr_db` [dB] are the peak and integrated sidelobe ratios. Sidelobes are counted outside the mask; the integrated
    ratio is their energy divided by the energy of the mainlobe.
    """

    irw_m: float
    peak: float
    peak_m: float
    pslr_db: float
    islr_db: float
    mask_m: float


def upsampled(cut: Complexes, factor: int) -> Complexes:
    """Upsample periodic cuts (..., samples) by an integer factor. The result has the shape (..., samples · factor).

    A cut must cover a full period. Its spectrum may be centred anywhere in the sampling band.
    """
    count = cut.shape[-1]
    steps = np.arange(count * factor) / factor
    carrier: Complexes = np.exp(2j * math.pi / count * _carrier_of(cut) * steps)
    around = [(0, 0)] * (cut.ndim - 1) + [(_REACH_SAMPLES - 1, _REACH_SAMPLES)]
    samples = sliding_window_view(
        np.pad(cut * carrier[::factor].conj(), around, mode="wrap"), 2 * _REACH_SAMPLES, axis=-1
    )
    fine: Complexes = (samples @ _kernel(steps[:factor]).T).reshape(*cut.shape[:-1], count * factor)
    return fine * carrier


def _kernel(offset: Floats) -> Floats:
    """Interpolation weights (n, taps) at offsets (n,) from a sample: a sinc function with a Kaiser window.

    The offsets are in samples. The kernel is short on purpose. Interpolation by a Fourier transform of the full line
    would be exact only for a periodic line. An image, however, is cut off within its sidelobes, and its band changes
    along the line near a platform, so that distant samples would add errors.
    """
    distances = np.subtract.outer(offset, np.arange(1 - _REACH_SAMPLES, _REACH_SAMPLES + 1))
    inside = np.sqrt(np.maximum(1 - (distances / _REACH_SAMPLES) ** 2, 0))
    weights: Floats = np.sinc(distances) * np.i0(_KAISER_FACTOR * inside) / np.i0(_KAISER_FACTOR)
    return weights


def _carrier_of(cut: Complexes) -> int:
    """Signed FFT bin at the centre of gravity of the summed power spectra of all cuts (..., samples)."""
    return _carrier(np.abs(np.fft.fft(cut).reshape(-1, cut.shape[-1])) ** 2)


def _carrier(power: Floats) -> int:
    """Signed FFT bin at the centre of gravity of the sum of power spectra (lines, bins).

    The spectrum is periodic, so its bins are treated as points on a circle. The result is therefore opposite to the
    empty part of the spectrum.
    """
    count = power.shape[1]
    turn = np.exp(2j * math.pi * np.arange(count) / count)
    cycles = float(np.angle(power.sum(axis=0) @ turn)) / (2 * math.pi)
    bins: int = round(cycles * count)
    return bins


def impulse_response(
    cut: Complexes, spacing_m: float, mask_m: float | None = None, reach_m: float | None = None
) -> ImpulseResponse:
    """Measure width, peak and sidelobe ratios of a cut through the peak of a response.

    Parameters
    ----------
    cut : (samples,) ndarray
        Complex samples, at least two per resolution cell.
    spacing_m : float
        Distance between samples. [m]
    mask_m : float, optional
        Half width of the mainlobe mask [m]. If it is None, the mask ends at the nulls of this response.
    reach_m : float, optional
        Distance from the peak up to which sidelobes are counted [m]. If it is None, the whole cut is used.

    Returns
    -------
    ImpulseResponse
        Width, peak and sidelobe ratios.

    Raises
    ------
    ValueError
        The samples of the cut are all zero or not finite. Or the peak, its half-power points or its mask are at the
        edge of the cut, or `reach_m` extends beyond the cut.
    """
    _check(cut)
    fine = np.abs(upsampled(cut, _UPSAMPLING_FACTOR))
    step = spacing_m / _UPSAMPLING_FACTOR
    top = int(np.argmax(fine))
    lower, upper = (_crossing(fine, top, direction) for direction in (-1, 1))
    power = fine**2
    peak = top + _vertex(power, top)
    if mask_m is None:
        left, right = (_null(power, top, direction) for direction in (-1, 1))
    else:
        left, right = peak - mask_m / step, peak + mask_m / step
    first, last = (0.0, fine.size - 1.0) if reach_m is None else (peak - reach_m / step, peak + reach_m / step)
    if left <= 0 or right >= fine.size - 1:
        raise ValueError("the mainlobe reaches the edge of the cut: take a longer one, or centre the peak")
    if first < 0 or last > fine.size - 1:
        raise ValueError(f"the cut ends within {reach_m:g} m of the peak, where sidelobes should be counted")
    positions = np.arange(fine.size)
    outside = ((positions <= left) & (positions >= first)) | ((positions >= right) & (positions <= last))
    # The mask's edge lies between samples, and under a window the highest shoulder lies at the edge.
    highest = max(*np.interp((left, right), positions, fine), fine[outside].max(initial=0.0))
    energy = np.concatenate(([0.0], np.cumsum((power[1:] + power[:-1]) / 2)))
    start, below, above, end = np.interp((first, left, right, last), positions, energy)
    mainlobe = above - below
    height = fine[top] ** 2 + (power[top + 1] - power[top - 1]) * (peak - top) / 4
    return ImpulseResponse(
        irw_m=(upper - lower) * step,
        peak=math.sqrt(height),
        peak_m=(peak - cut.size // 2 * _UPSAMPLING_FACTOR) * step,
        pslr_db=20 * math.log10(float(highest) / math.sqrt(height)),
        islr_db=10 * math.log10(float((end - start - mainlobe) / mainlobe)),
        mask_m=(right - left) / 2 * step,
    )


def line_at(chip: Complexes, row: float | Floats) -> Complexes:
    """Interpolate the line (ny,) of an image (nx, ny) at a fractional row. For n rows the result is (n, ny)."""
    count = chip.shape[0]
    turn = 2j * math.pi / count * _carrier_of(chip.T)
    rows = np.atleast_1d(row)
    first = np.floor(rows).astype(np.int64)
    taps = first[:, None] + np.arange(1 - _REACH_SAMPLES, _REACH_SAMPLES + 1)
    weights = _kernel(rows - first) * np.exp(turn * (rows[:, None] - taps))
    lines: Complexes = np.einsum("nt,ntc->nc", weights, chip[taps % count])
    return lines if np.ndim(row) else lines[0]


def row_of_peak(image: Complexes, window: tuple[slice, slice] = _FULL_WINDOW) -> float:
    """Fractional row of the peak within a window (rows, columns) of an image (nx, ny).

    The row is counted from the first row of the image. The interpolation treats the rows of the image and the columns
    of the window as periodic. Interpolation is needed because the peak is usually between two lines of pixels: if
    lines are a third of a resolution cell apart, the nearest line may be 0.4 dB below the peak.
    """
    magnitude = np.abs(image[window])
    row = float(np.argmax(magnitude.max(axis=1))) + window[0].indices(image.shape[0])[0]
    columns, step = image[:, window[1]], 0.5
    for _ in range(_NARROWING_STEPS):
        lines = upsampled(line_at(columns, row + step * np.arange(-1.0, 2.0)), _UPSAMPLING_FACTOR)
        row += step * min(max(_vertex(np.max(np.abs(lines) ** 2, axis=1), 1), -1.0), 1.0)
        step /= 4
    return row


def place_of_peak(image: Complexes) -> tuple[float, float]:
    """Fractional row and column of the interpolated peak of an image (nx, ny). The image is treated as periodic."""
    row = row_of_peak(image)
    power = np.abs(upsampled(line_at(image, row), _UPSAMPLING_FACTOR)) ** 2
    top = int(np.argmax(power))
    return row, (top + min(max(_vertex(power, top), -1.0), 1.0)) / _UPSAMPLING_FACTOR


def highest(chip: Complexes) -> float:
    """Largest magnitude of a small image (nx, ny), interpolated in both axes."""
    columns = upsampled(chip, _CHIP_UPSAMPLING_FACTOR).T
    blocks = (columns[start : start + _BLOCK_COLUMNS] for start in range(0, len(columns), _BLOCK_COLUMNS))
    return max(float(np.abs(upsampled(block, _CHIP_UPSAMPLING_FACTOR)).max()) for block in blocks)


def _check(samples: Complexes) -> None:
    if not np.isfinite(samples).all():
        raise ValueError("a response is made of finite samples; these hold NaN or infinity")
    if not np.any(samples):
        raise ValueError("the samples are all zero: there is no response to measure")


def _crossing(magnitude: Floats, top: int, direction: int) -> float:
    level = magnitude[top] / math.sqrt(2)
    index = top
    while 0 < index < magnitude.size - 1:
        if magnitude[index + direction] < level:
            above, below = magnitude[index], magnitude[index + direction]
            return index + direction * float((above - level) / (above - below))
        index += direction
    raise ValueError("the half-power point lies beyond the cut: the peak is at its edge")


def _null(power: Floats, top: int, direction: int) -> float:
    index = top
    while 0 < index < power.size - 1 and power[index + direction] <= power[index]:
        index += direction
    return index + _vertex(power, index) if 0 < index < power.size - 1 else float(index)


def _vertex(values: Floats, top: int) -> float:
    """Offset from sample `top` to the vertex of the parabola through this sample and its neighbours. [samples]

    The result is 0 if the three samples are on a straight line.
    """
    before, middle, after = values[top - 1 : top + 2]
    bend = before - 2 * middle + after
    return float((before - after) / (2 * bend)) if bend else 0.0


# ---------------------------------------------------------------------- an image read anywhere
def between(values: Floats, row: Floats, column: Floats) -> Floats:
    """Interpolate values on a grid (nx, ny, k) linearly at n fractional rows and columns. The result is (n, k).

    Beyond the edges of the grid, the values are extrapolated.
    """
    nx, ny = values.shape[:2]
    i = np.clip(np.floor(row).astype(np.int64), 0, nx - 2)
    j = np.clip(np.floor(column).astype(np.int64), 0, ny - 2)
    u, v = (row - i)[:, None], (column - j)[:, None]
    value: Floats = (
        (1 - u) * ((1 - v) * values[i, j] + v * values[i, j + 1])
        + u * ((1 - v) * values[i + 1, j] + v * values[i + 1, j + 1])
    )  # fmt: skip
    return value


def places_in(grid: Floats, points: Floats) -> tuple[Floats, Floats]:
    """Fractional rows (n,) and columns (n,) of ground points (n, 2) in a grid of pixels (nx, ny, 2).

    Both are NaN for points that are more than half a pixel outside the grid.
    """
    nx, ny = grid.shape[:2]
    middle = grid[nx // 2, ny // 2]
    steps = np.stack((np.gradient(grid, axis=0), np.gradient(grid, axis=1)), axis=-1)
    inverse = np.linalg.inv(steps[nx // 2, ny // 2])
    positions = (points - middle) @ inverse.T + (nx // 2, ny // 2)
    for _ in range(_GRID_SEARCH_STEPS):
        clipped = np.clip(positions, -1, (nx, ny))
        jacobian = between(steps.reshape(nx, ny, 4), clipped[:, 0], clipped[:, 1]).reshape(-1, 2, 2)
        residual = points - between(grid, clipped[:, 0], clipped[:, 1])
        step = np.linalg.solve(jacobian, residual[..., None])[..., 0]
        positions = clipped + step
    is_outside = np.abs(step).max(axis=1) > _GRID_TOLERANCE_PX
    is_outside |= ((positions < -0.5) | (positions > np.array([nx, ny]) - 0.5)).any(axis=1)
    positions[is_outside] = math.nan
    return positions[:, 0], positions[:, 1]


def resampled(image: Complexes, grid: Floats, points: Floats) -> Complexes:
    """Interpolate an image at other ground points, such as the pixels of a rotated grid.

    Parameters
    ----------
    image : (nx, ny) ndarray
        Image at baseband, with at least three samples per resolution cell.
    grid : (nx, ny, 3) ndarray
        East, north and up of the pixels of the image. [m]
    points : (mx, my, 3) ndarray
        East, north and up of the points at which the image is interpolated. [m]

    Returns
    -------
    (mx, my) ndarray
        Interpolated image; zero at points outside the grid.
    """
    flat = points[..., :2].reshape(-1, 2)
    read = np.zeros(len(flat), dtype=complex)
    fine = upsampled(upsampled(image, _IMAGE_UPSAMPLING_FACTOR).T, _IMAGE_UPSAMPLING_FACTOR).T
    for start in range(0, len(flat), _BLOCK_POINTS):
        row, column = places_in(grid[..., :2], flat[start : start + _BLOCK_POINTS])
        inside = np.nonzero(np.isfinite(row))[0]
        read[start + inside] = _interpolated(
            fine, _IMAGE_UPSAMPLING_FACTOR * row[inside], _IMAGE_UPSAMPLING_FACTOR * column[inside]
        )
    return read.reshape(points.shape[:2])


def _interpolated(image: Complexes, row: Floats, column: Floats) -> Complexes:
    """Interpolate an image by Lagrange polynomials at n scattered points, given by fractional rows and columns.

    The image is treated as periodic.
    """
    total = np.zeros(row.size, dtype=complex)
    (i, by_row), (j, by_column) = _weights(row), _weights(column)
    for a in range(_TAPS_COUNT):
        line = np.zeros(row.size, dtype=complex)
        for b in range(_TAPS_COUNT):
            line += by_column[b] * image[(i + a) % image.shape[0], (j + b) % image.shape[1]]
        total += by_row[a] * line
    return total


def _weights(positions: Floats) -> tuple[np.ndarray[tuple[int], np.dtype[np.int64]], list[Floats]]:
    """First sample of the Lagrange stencil, and the Lagrange weights, for each of the `positions` (n,).

    The indices of the first samples are (n,). The list contains an array of weights (n,) for each sample of the
    stencil.
    """
    first = np.floor(positions).astype(np.int64) - _TAPS_COUNT // 2 + 1
    return first, [lagrange_weight(positions - first, tap, _TAPS_COUNT) for tap in range(_TAPS_COUNT)]


def lagrange_weight(offset: Floats, tap: int, taps: int) -> Floats:
    """Lagrange weights of the sample with index `tap` in a stencil of `taps` samples.

    `offset` [samples] holds the positions at which to interpolate, relative to the first sample of the stencil. The
    result has the shape of `offset`.
    """
    weight: Floats = np.ones(offset.shape)
    for node in range(taps):
        if node != tap:
            weight *= (offset - node) / (tap - node)
    return weight
