"""Measures of a point response: width, peak, sidelobe ratios, and the quadratic phase error itself.

A cut is a line of complex image samples, evenly spaced, that holds the whole response. Sidelobes can be
counted outside a fixed mask, the first nulls of the error-free response, or outside the nulls that the
response itself shows; under a window the second hides a quadratic phase error, because the shoulder it
raises joins the mainlobe. Other tools stop counting at some distance: perseo-quality takes its PSLR within
five widths of the peak and its ISLR within ten, which for a uniform aperture makes it -10.21 dB, not -9.68.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from bisar_budget.simulator.phase_history import Complexes, Floats

_WHOLE = slice(None), slice(None)
_UPSAMPLING = 32
_REACH = 8  # samples on each side from which what lies between is interpolated
_KAISER = 12.0  # with these a line sampled three times per cell is read to -110 dB
_CHIP_UPSAMPLING = 8
_COLUMNS = 512  # interpolated at once
_ASCENTS = 50  # at most, along x′ and y′ in turn
_NARROWED = 3  # times: a row is then within some thousandths
_SETTLED = 1e-4  # samples
_SEARCH = 8  # towards a pixel's place in a grid
_CLOSE = 0.02  # pixels: found
_READ = 1 << 16  # points read at once
_FINER = 2  # before the interpolation
_TAPS = 6  # with these a response sampled three times per cell is read to -70 dB


@dataclass(frozen=True, kw_only=True)
class ImpulseResponse:
    """Measures of one cut.

    `irw_m` is the width at half power, `peak` the magnitude and `peak_m` its place along the cut from the
    middle sample. `pslr_db` and `islr_db` count sidelobes beyond `mask_m` from the peak; ISLR is their energy
    over that of the mainlobe.
    """

    irw_m: float
    peak: float
    peak_m: float
    pslr_db: float
    islr_db: float
    mask_m: float


@dataclass(frozen=True, kw_only=True)
class ImpulseResponse2D:
    """Measures of a chip: both cuts through its peak, which is between samples, and sidelobes of the whole area.

    `peak_m` counts from the middle sample of each axis. `pslr_db` and `islr_db` take as mainlobe the rectangle
    `mask_m` of the cuts and as sidelobes everything outside it.
    """

    range_cut: ImpulseResponse
    cross_range_cut: ImpulseResponse
    peak: float
    peak_m: tuple[float, float]
    pslr_db: float
    islr_db: float


def upsampled(cut: Complexes, factor: int) -> Complexes:
    """Interpolate cuts, (..., samples), each a period of what repeats; the carrier may sit anywhere in the band."""
    count = cut.shape[-1]
    steps = np.arange(count * factor) / factor
    carrier: Complexes = np.exp(2j * math.pi / count * _carrier_of(cut) * steps)
    around = [(0, 0)] * (cut.ndim - 1) + [(_REACH - 1, _REACH)]
    samples = sliding_window_view(np.pad(cut * carrier[::factor].conj(), around, mode="wrap"), 2 * _REACH, axis=-1)
    fine: Complexes = (samples @ _kernel(steps[:factor]).T).reshape(*cut.shape[:-1], count * factor)
    return fine * carrier


def _kernel(offset: Floats) -> Floats:
    """Weights (n, taps) of the samples around places so far behind one of them, (n,): a sinc under a Kaiser window.

    A Fourier transform of the whole line would be exact for what does repeat. An image ends amid its sidelobes,
    and near a platform its band changes along it: then what is far away would spoil what is here.
    """
    apart = np.subtract.outer(offset, np.arange(1 - _REACH, _REACH + 1))
    inside = np.sqrt(np.maximum(1 - (apart / _REACH) ** 2, 0))
    weights: Floats = np.sinc(apart) * np.i0(_KAISER * inside) / np.i0(_KAISER)
    return weights


def _carrier_of(cut: Complexes) -> int:
    """Bin at the centre of gravity of the spectra of cuts, (..., samples)."""
    return _carrier(np.abs(np.fft.fft(cut).reshape(-1, cut.shape[-1])) ** 2)


def _carrier(power: Floats) -> int:
    """Bin at the centre of gravity of spectra, (lines, bins), on the circle: zeros go where they are empty."""
    count = power.shape[1]
    turn = np.exp(2j * math.pi * np.arange(count) / count)
    cycles = float(np.angle(power.sum(axis=0) @ turn)) / (2 * math.pi)
    bins: int = round(cycles * count)
    return bins


def impulse_response(
    cut: Complexes, spacing_m: float, mask_m: float | None = None, reach_m: float | None = None
) -> ImpulseResponse:
    """Measure a cut through the peak.

    Parameters
    ----------
    cut : (samples,) ndarray
        Complex, two samples per resolution cell or more.
    spacing_m : float
        Between samples.
    mask_m : float, optional
        Half width of the mainlobe mask; None searches the nulls of this response.
    reach_m : float, optional
        Sidelobes are counted to this distance from the peak; None counts the whole cut.

    Returns
    -------
    ImpulseResponse

    Raises
    ------
    ValueError
        The cut holds nothing or something else than numbers, or the peak, its half-power points, its mask or
        the reach lie at the edge of the cut.
    """
    _check(cut)
    fine = np.abs(upsampled(cut, _UPSAMPLING))
    step = spacing_m / _UPSAMPLING
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
    place = np.arange(fine.size)
    outside = ((place <= left) & (place >= first)) | ((place >= right) & (place <= last))
    # The mask's edge lies between samples, and under a window the highest shoulder lies at the edge.
    highest = max(*np.interp((left, right), place, fine), fine[outside].max(initial=0.0))
    energy = np.concatenate(([0.0], np.cumsum((power[1:] + power[:-1]) / 2)))
    start, below, above, end = np.interp((first, left, right, last), place, energy)
    mainlobe = above - below
    height = fine[top] ** 2 + (power[top + 1] - power[top - 1]) * (peak - top) / 4
    return ImpulseResponse(
        irw_m=(upper - lower) * step,
        peak=math.sqrt(height),
        peak_m=(peak - cut.size // 2 * _UPSAMPLING) * step,
        pslr_db=20 * math.log10(float(highest) / math.sqrt(height)),
        islr_db=10 * math.log10(float((end - start - mainlobe) / mainlobe)),
        mask_m=(right - left) / 2 * step,
    )


def impulse_response_2d(
    chip: Complexes, spacing_m: tuple[float, float], mask_m: tuple[float, float] | None = None
) -> ImpulseResponse2D:
    """Measure a chip: cuts along x′ and y′ through the peak of its interpolation, and its whole area.

    Parameters
    ----------
    chip : (nx, ny) ndarray
        Complex, two samples per resolution cell or more, with the whole response.
    spacing_m : (2,) float
        Between samples along x′ and y′.
    mask_m : (2,) float, optional
        Half widths of the mainlobe mask, as the error-free response gives them; None searches the nulls.

    Returns
    -------
    ImpulseResponse2D

    Raises
    ------
    ValueError
        As for `impulse_response`, or the chip is not two-dimensional.
    """
    if chip.ndim != 2:
        raise ValueError(f"a chip has two axes (got shape {chip.shape})")
    _check(chip)
    row, column = (float(index) for index in np.unravel_index(np.argmax(np.abs(chip)), chip.shape))
    for index, count in ((row, chip.shape[0]), (column, chip.shape[1])):
        if not 2 <= index <= count - 3:
            raise ValueError("the peak lies at the edge of the chip: centre it")
    for _ in range(_ASCENTS):
        before = row, column
        column = _peak(line_at(chip, row))
        row = _peak(line_at(chip.T, column))
        if max(abs(row - before[0]), abs(column - before[1])) < _SETTLED:
            break
    along, across = mask_m or (None, None)
    range_cut = impulse_response(line_at(chip.T, column), spacing_m[0], along)
    cross_range_cut = impulse_response(line_at(chip, row), spacing_m[1], across)
    magnitude = np.abs(upsampled(upsampled(chip, _CHIP_UPSAMPLING).T, _CHIP_UPSAMPLING).T)
    pair = range_cut, cross_range_cut
    edges = [
        tuple(_CHIP_UPSAMPLING * (place + sign * cut.mask_m / spacing) for sign in (-1, 1))
        for place, cut, spacing in zip((row, column), pair, spacing_m, strict=True)
    ]
    for size, (lower, upper) in zip(magnitude.shape, edges, strict=True):
        if lower < 0 or upper > size - 2:
            raise ValueError("the mainlobe reaches beyond the chip: take a larger one")
    weights = [_inside(size, *ends) for size, ends in zip(magnitude.shape, edges, strict=True)]
    energy = float(np.sum(magnitude**2))
    mainlobe = float(weights[0] @ magnitude**2 @ weights[1])
    outside = ~np.outer(weights[0] > 0, weights[1] > 0)
    lines = [_line_at(magnitude, end) * (weights[1] > 0) for end in edges[0]]
    lines += [_line_at(magnitude.T, end) * (weights[0] > 0) for end in edges[1]]
    highest = max(float(magnitude[outside].max()), *(float(line.max()) for line in lines))
    peak = cross_range_cut.peak
    return ImpulseResponse2D(
        range_cut=range_cut,
        cross_range_cut=cross_range_cut,
        peak=peak,
        peak_m=((row - chip.shape[0] // 2) * spacing_m[0], (column - chip.shape[1] // 2) * spacing_m[1]),
        pslr_db=20 * math.log10(highest / peak),
        islr_db=10 * math.log10((energy - mainlobe) / mainlobe),
    )


def line_at(chip: Complexes, row: float | Floats) -> Complexes:
    """Line of a chip along its second axis, at a fraction of a row; lines (n, ny) at rows (n,)."""
    count = chip.shape[0]
    turn = 2j * math.pi / count * _carrier_of(chip.T)
    rows = np.atleast_1d(row)
    first = np.floor(rows).astype(np.int64)
    taps = first[:, None] + np.arange(1 - _REACH, _REACH + 1)
    weights = _kernel(rows - first) * np.exp(turn * (rows[:, None] - taps))
    lines: Complexes = np.einsum("nt,ntc->nc", weights, chip[taps % count])
    return lines if np.ndim(row) else lines[0]


def row_of_peak(image: Complexes, window: tuple[slice, slice] = _WHOLE) -> float:
    """Row of the peak in a window of an image (nx, ny), which repeats beyond its edges.

    A peak lies between two lines of pixels: a third of a cell apart, the nearer of them may be 0.4 dB below it.
    """
    part = np.abs(image[window])
    row = float(np.argmax(part.max(axis=1))) + window[0].indices(image.shape[0])[0]
    columns, step = image[:, window[1]], 0.5
    for _ in range(_NARROWED):
        lines = upsampled(line_at(columns, row + step * np.arange(-1.0, 2.0)), _UPSAMPLING)
        row += step * min(max(_vertex(np.max(np.abs(lines) ** 2, axis=1), 1), -1.0), 1.0)
        step /= 4
    return row


def place_of_peak(image: Complexes) -> tuple[float, float]:
    """Row and column of the peak of an image (nx, ny)."""
    row = row_of_peak(image)
    power = np.abs(upsampled(line_at(image, row), _UPSAMPLING)) ** 2
    top = int(np.argmax(power))
    return row, (top + min(max(_vertex(power, top), -1.0), 1.0)) / _UPSAMPLING


def highest(chip: Complexes) -> float:
    """Largest magnitude of the interpolation of a chip (nx, ny)."""
    columns = upsampled(chip, _CHIP_UPSAMPLING).T
    parts = (columns[start : start + _COLUMNS] for start in range(0, len(columns), _COLUMNS))
    return max(float(np.abs(upsampled(part, _CHIP_UPSAMPLING)).max()) for part in parts)


def _check(samples: Complexes) -> None:
    if not np.isfinite(samples).all():
        raise ValueError("a response is made of finite samples; these hold NaN or infinity")
    if not np.any(samples):
        raise ValueError("the samples are all zero: there is no response to measure")


def _peak(cut: Complexes) -> float:
    power = np.abs(upsampled(cut, _UPSAMPLING)) ** 2
    top = int(np.argmax(power))
    if not 0 < top < power.size - 1:
        raise ValueError("the peak lies at the edge of the chip: centre it")
    return (top + _vertex(power, top)) / _UPSAMPLING


def _inside(count: int, lower: float, upper: float) -> Floats:
    """Weights of samples, cells of unit width, in an interval."""
    place = np.arange(count)
    return np.asarray(np.clip(np.minimum(place + 0.5, upper) - np.maximum(place - 0.5, lower), 0.0, 1.0))


def _line_at(magnitude: Floats, row: float) -> Floats:
    below = math.floor(row)
    line: Floats = magnitude[below] + (row - below) * (magnitude[below + 1] - magnitude[below])
    return line


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
    """Place of the extremum of the parabola through a sample and its neighbours, from that sample."""
    before, at, after = values[top - 1 : top + 2]
    bend = before - 2 * at + after
    return float((before - after) / (2 * bend)) if bend else 0.0


# ---------------------------------------------------------------------- an image read anywhere
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
    for _ in range(_SEARCH):
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
    for start in range(0, len(flat), _READ):
        row, column = places_in(grid[..., :2], flat[start : start + _READ])
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


def _weights(place: Floats) -> tuple[np.ndarray[tuple[int], np.dtype[np.int64]], list[Floats]]:
    """First sample of each stencil, (n,), and the stencil's weights, (n,) for each tap."""
    first = np.floor(place).astype(np.int64) - _TAPS // 2 + 1
    return first, [lagrange_weight(place - first, tap, _TAPS) for tap in range(_TAPS)]


def lagrange_weight(offset: Floats, tap: int, taps: int) -> Floats:
    """Weight of one sample of a stencil of Lagrange, for places so far from its first sample."""
    weight: Floats = np.ones(offset.shape)
    for other in range(taps):
        if other != tap:
            weight *= (offset - other) / (tap - other)
    return weight
