"""Autofocus of a complex image: phase gradient, map drift, and the rotation they need in a bistatic image.

Motion errors smear an image along y′, across the bistatic look direction. Both estimators therefore take the
rotated frame (x′, y′), x′ along the first axis; an image in (x, y) is turned there and back, as Section VI of
Rigling & Moses does.

Sources: Wahl, Eichel, Ghiglia & Jakowatz, "Phase Gradient Autofocus - A Robust Tool for High Resolution SAR
Phase Correction", IEEE Trans. AES 30 (1994); Jakowatz & Wahl, "Eigenvector method for maximum-likelihood
estimation of phase errors in SAR imagery", JOSA A 10 (1993); map drift: Carrara, Goodman & Majewski, Spotlight
Synthetic Aperture Radar, chapter 6.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from bisar_budget.simulator.phase_history import Complexes, Floats

Indices = NDArray[np.int64]

_MARGIN = 2  # times the side of an image that is rotated, so that nothing wraps around
_ITERATIONS = 40
_LINES = 96  # range lines used; more cost time and gain little
_TARGETS = 96
_PER_LINE = 6
_SECONDARY = 0.1  # of a line's strongest power: a further target, not its sidelobe
_FALSE_ALARM = 1e-3  # chance that clutter alone shows a target anywhere in the image
_RANGE_OF_LEVELS = 1e-6  # a line's clutter, of the image's peak power, at least: rounding is no clutter
_SUPPORT = 0.1  # of the strongest aperture sample: less is what leaks beside the band of a finite image
_SMALLEST_GAP = 0.05  # of the sampling band; an oversampled image leaves at least that empty
_SMEAR = 0.1  # of the mean response's peak
_SHRINK = 0.7  # of the window, each time
_NARROWEST = 12  # cells: half of the last window
_BRIDGE = 8  # cells: nulls within a smeared response are narrower
_COHERENT = 0.5  # rad rms: below it responses add up in phase over the whole aperture
_SIGNIFICANT = 2.0  # standard deviations
_BLOCK = 16  # range lines corrected at once, for the cache
_DRIFT_SETTLED = 1e-3  # rad at the aperture edge
_CORRELATED = 6.0  # standard deviations of the correlation of speckle, whose highest of many is about 4


@dataclass(frozen=True, slots=True, eq=False)
class Focused:
    """Image after autofocus, and the phase taken out of its spectrum along the second axis. [rad]

    `phase` is (ny,), in the order of `numpy.fft.fftfreq(ny)`, 0 outside the aperture's band and without constant
    and linear part over it: they do not defocus, a linear one displaces.
    """

    image: Complexes
    phase: Floats


def phase_gradient_autofocus(image: Complexes) -> Focused:
    """Estimate one phase error common to all range lines, of any shape, and take it out.

    Targets are picked where no clutter would reach, centred to a fraction of a sample, windowed, and taken to the
    aperture. The gradient kernel gives their common phase while they are smeared; once they add up coherently the
    principal eigenvector of their covariance does, by power iteration. The phase is kept to what the window can
    hold, and a component of a step that clutter alone would give is left out: nothing is left when it is done.

    Parameters
    ----------
    image : (nx, ny) ndarray
        Complex image in the rotated frame (x′, y′), at baseband: its aperture's spectrum must be the same for
        targets anywhere in the image. It may be oversampled and its band may lie anywhere.

    Returns
    -------
    Focused
        The image itself and no phase if no target stands out of the clutter, as in a homogeneous scene.

    Raises
    ------
    ValueError
        Not a two-dimensional image of finite numbers with at least 16 samples across.

    Notes
    -----
    A smeared target must still stand out: its power, divided by the cells it is smeared over, must exceed the mean
    clutter power by ln(pixels / 10⁻³), 13 dB in a million pixels. The error left behind follows from the clutter:
    about √(window / (2 · targets · ratio)) rad rms, window ±12 cells, ratio the target's to the clutter's power.
    Targets in each other's windows disturb it, 0.1 to 0.3 rad if there are no more than a dozen in all. A taper that
    falls below a tenth of its maximum (Taylor -45 dB) is left as it is beyond.
    """
    image = _checked(image)
    rows, level = _range_lines(image)
    phase: Floats = np.zeros(image.shape[1])
    if not rows.size:
        return Focused(image=image.copy(), phase=phase)
    spectrum = np.fft.fft(image[rows] / np.sqrt(level)[:, None], axis=1)
    band = aperture_band(spectrum)
    samples = 1 << (band.size - 1).bit_length()  # of a range line, from one to two per cell
    aperture = spectrum[:, band] * (samples / image.shape[1])
    phase[band] = _common_phase(aperture, samples, _threshold(image.size))
    return Focused(image=_corrected(image, phase), phase=phase)


def map_drift(image: Complexes, sub_apertures: int = 2) -> Focused:
    """Estimate a quadratic, or quadratic and cubic, phase error from the drift between sub-aperture images.

    The phase over a sub-aperture is in the main a slope and shifts its image; cross-correlation of the images'
    powers along y′, summed over range lines, measures the shifts. Repeated until nothing drifts.

    Parameters
    ----------
    image : (nx, ny) ndarray
        As for `phase_gradient_autofocus`.
    sub_apertures : int
        2: quadratic; 3: quadratic and cubic.

    Returns
    -------
    Focused
        The image itself and no phase if sub-aperture images do not correlate.

    Raises
    ------
    ValueError
        As for `phase_gradient_autofocus`, or another number of sub-apertures.

    Notes
    -----
    It sees what sub-apertures have in common: points, edges, texture. Speckle of disjoint sub-apertures is
    independent, so a homogeneous scene gives nothing. Orders above the model stay in the image and bias it: with
    two sub-apertures a cubic is not seen at all, a quartic is taken for a quadratic in part. The smear must stay
    small against the image's width, since the correlation is circular.
    """
    if sub_apertures not in (2, 3):
        raise ValueError(f"map drift works with 2 or 3 sub-apertures (got {sub_apertures})")
    image = _checked(image)
    total: Floats = np.zeros(image.shape[1])
    if not np.any(image):
        return Focused(image=image.copy(), phase=total)
    spectrum = np.fft.fft(image, axis=1)
    band = aperture_band(spectrum)
    aperture = spectrum[:, band]
    place = _place(band.size)
    shapes = np.stack((place**2, place**3)[: sub_apertures - 1], axis=1)
    parts = np.array_split(np.arange(band.size), sub_apertures)
    pairs = [(a, b) for a in range(sub_apertures) for b in range(a + 1, sub_apertures)]
    # Slope per sample of each shape over each sub-aperture, as a straight line fits it.
    slopes = np.array([np.polyfit(part, shapes[part], 1)[0] for part in parts])
    model = np.array([slopes[b] - slopes[a] for a, b in pairs])
    size = np.zeros(shapes.shape[1])
    for _ in range(_ITERATIONS):
        drifts = _drifts(aperture * np.exp(-1j * shapes @ size), parts, pairs)
        if drifts is None:
            break
        step = np.linalg.lstsq(model, drifts, rcond=None)[0]
        size = size + step
        if np.abs(step).max() < _DRIFT_SETTLED:
            break
    phase = shapes @ size
    total[band] = phase - np.polyval(np.polyfit(place, phase, 1), place)
    return Focused(image=_corrected(image, total), phase=total)


# As the mission file names them; map drift with the sub-apertures that see a cubic phase too.
ALGORITHMS: dict[str, Callable[[Complexes], Focused]] = {
    "pga": phase_gradient_autofocus,
    "map_drift": partial(map_drift, sub_apertures=3),
}


def autofocus_in_scene_axes(
    image: Complexes, look_azimuth: float, algorithm: Callable[[Complexes], Focused] = phase_gradient_autofocus
) -> Focused:
    """Rotate an image in (x, y) to (x′, y′), focus it there, and rotate it back: Section VI of the paper.

    Parameters
    ----------
    image : (n, n) ndarray
        Complex image on a square ground grid of equal spacing along x (first axis) and y, as `ground_grid` with
        azimuth 0 lays it, centred on its sample n // 2. At baseband: the phase of the range to each pixel must
        have been taken out, or it is a carrier beyond the sampling band. Sampled at least 1.42 times finer than
        the band needs, which turns.
    look_azimuth : float
        φ_b, (11): direction of x′. [rad]
    algorithm : callable
        `phase_gradient_autofocus` or `map_drift`.

    Returns
    -------
    Focused
        `image` in (x, y), (n, n); `phase` along y′ over (m,) frequencies of the same sampling interval, m the
        side of the largest square, turned, that lies in the image: the error is estimated there.

    Raises
    ------
    ValueError
        The image is not square, the azimuth not finite, or what `algorithm` raises.
    """
    image = _checked(image)
    turned = rotated(image, look_azimuth)
    side = turned.shape[0]
    inner = int(image.shape[0] / (abs(math.cos(look_azimuth)) + abs(math.sin(look_azimuth)))) // 2 * 2
    start = side // 2 - inner // 2
    phase = algorithm(turned[start : start + inner, start : start + inner]).phase
    fine = np.interp(np.fft.fftfreq(side), np.fft.fftfreq(inner), phase, period=1.0)
    back = scene_axes(_corrected(turned, fine), look_azimuth, image.shape[0])
    return Focused(image=back, phase=phase)


def aperture_band(spectrum: Complexes) -> Indices:
    """Indices of the aperture's band in a spectrum along the second axis, in ascending frequency.

    The band may wrap around. Without an empty gap the whole sampling band is the aperture, centred on zero.
    """
    count = spectrum.shape[1]
    strength = np.sqrt(np.mean(np.abs(spectrum) ** 2, axis=0))
    used = np.nonzero(strength > _SUPPORT * strength.max())[0]
    gaps = np.diff(used, append=used[0] + count)
    widest = int(np.argmax(gaps))
    if gaps[widest] - 1 < _SMALLEST_GAP * count:
        band: Indices = (np.arange(count) - count // 2) % count
        return band
    first = used[(widest + 1) % used.size]
    return np.asarray((first + np.arange(count - gaps[widest] + 1)) % count, dtype=np.int64)


def _checked(image: Complexes) -> Complexes:
    given = np.asarray(image)
    if given.ndim != 2 or given.shape[0] < 1 or given.shape[1] < 16:
        raise ValueError(f"autofocus takes an image of at least 1 x 16 samples (got shape {given.shape})")
    if not np.isfinite(np.sum(given)) and not np.isfinite(given).all():
        raise ValueError(
            f"autofocus takes finite samples ({np.count_nonzero(~np.isfinite(given))} are NaN or infinite)"
        )
    return given.astype(complex, copy=False)


def _corrected(image: Complexes, phase: Floats) -> Complexes:
    turn = np.exp(-1j * phase)
    focused = np.empty(image.shape, dtype=complex)
    for start in range(0, image.shape[0], _BLOCK):
        rows = slice(start, start + _BLOCK)
        focused[rows] = np.fft.ifft(np.fft.fft(image[rows], axis=1) * turn, axis=1)
    return focused


def _place(count: int) -> Floats:
    """Aperture samples from -1 to 1, at the centres of equal cells."""
    return (2 * np.arange(count) - (count - 1)) / count


def _threshold(pixels: int) -> float:
    """Power over the mean that exponential clutter exceeds anywhere with the chance of a false alarm."""
    return math.log(pixels / _FALSE_ALARM)


def _range_lines(image: Complexes) -> tuple[Indices, Floats]:
    """Range lines with a target, best first, and their clutter power."""
    power = image.real**2 + image.imag**2
    peak = power.max(axis=1)
    if not peak.max():
        return np.zeros(0, dtype=np.int64), peak[:0]
    # A median does not see targets; of an exponential distribution it is ln 2 of the mean.
    level = np.median(power[:, :: max(1, power.shape[1] // 256)], axis=1) / math.log(2)
    level = np.maximum(level, _RANGE_OF_LEVELS * peak.max())
    ratio = peak / level
    best = np.argsort(ratio)[::-1][:_LINES]
    best = best[ratio[best] > _threshold(image.size)]
    return best, level[best]


def _common_phase(aperture: Complexes, samples: int, threshold: float) -> Floats:
    """Phase over the band common to range lines of unit clutter: the iteration of phase gradient autofocus."""
    count = aperture.shape[1]
    per_cell = samples / count
    narrowest = math.ceil(_NARROWEST * per_cell)
    phase: Floats = np.zeros(count)
    strength = np.mean(np.abs(aperture) ** 2, axis=0)
    strength /= strength.mean()
    basis: Floats = np.zeros((count, 0))
    half = samples // 2 - 1
    distance = np.minimum(np.arange(samples), samples - np.arange(samples))
    for iteration in range(_ITERATIONS):
        turn = np.exp(-1j * phase)
        lines = np.fft.ifft(aperture * turn, samples, axis=1)
        power = lines.real**2 + lines.imag**2
        seen = max(narrowest, 2 * _smear(power, per_cell) + 4)
        half = min(half, max(seen, int(_SHRINK * half)) if iteration else seen)
        if not iteration:
            basis = _basis(strength, math.ceil(half / per_cell) + 4)
        row, column = _targets(power, half, threshold)
        responses = np.fft.ifft(_centred(aperture[row] * turn, column, samples), samples, axis=1)
        responses[:, distance > half] = 0
        windowed = np.fft.fft(responses, axis=1)[:, :count]
        step = _step(windowed, basis[:, : math.ceil(half / per_cell) + 4], strength, samples)
        if not step.any():
            break
        phase += step
    return phase


def _smear(power: Floats, per_cell: float) -> int:
    """Reach of the mean response around each line's peak, both sides folded; in samples."""
    samples = power.shape[1]
    column = power.argmax(axis=1)[:, None]
    distance = np.arange(samples // 2)
    row = np.arange(power.shape[0])[:, None]
    folded = np.maximum(power[row, (column + distance) % samples], power[row, column - distance]).mean(axis=0)
    floor = np.median(folded)
    bright = folded - floor > _SMEAR * (folded[0] - floor)
    reach = 0
    while True:
        # Nulls within a smeared response are bridged; farther on another target begins.
        ahead = np.nonzero(bright[reach + 1 : reach + 1 + int(_BRIDGE * per_cell) + reach // 2])[0]
        if not ahead.size:
            return reach
        reach += int(ahead[-1]) + 1


def _targets(power: Floats, half: int, threshold: float) -> tuple[Indices, Indices]:
    """Row and column of the strongest pixel of each line, and of further ones clear of its window."""
    left = power.copy()
    row = np.arange(power.shape[0])
    least = _SECONDARY * power.max(axis=1)
    window = np.arange(-2 * half, 2 * half + 1)
    found = []
    for order in range(_PER_LINE):
        column = left[row].argmax(axis=1)
        if order:
            stands_out = left[row, column] > np.maximum(threshold, least[row])
            row, column = row[stands_out], column[stands_out]
        found.append((row, column))
        left[row[:, None], (column[:, None] + window) % power.shape[1]] = 0
    rows, columns = (np.concatenate(part) for part in zip(*found, strict=True))
    best = np.argsort(power[rows, columns])[::-1][:_TARGETS]
    return rows[best], columns[best]


def _centred(aperture: Complexes, column: Indices, samples: int) -> Complexes:
    """Take each response's peak to sample 0 by a phase ramp, exactly.

    A window off the peak by a fraction of a sample bends the phase at the aperture's edges, the same way every
    time, and the iteration would follow. Newton's method on the power finds the interpolated peak.
    """
    count = aperture.shape[1]
    turn = 2 * math.pi / samples
    ramp = turn * (np.arange(count) - (count - 1) / 2)
    moments = np.stack((ramp**0, ramp, ramp**2), axis=1).astype(complex)
    centred = aperture * _phasors(turn * column.astype(np.float64), count)
    for _ in range(2):
        value, first, second = (centred @ moments).T
        slope = -np.imag(value.conj() * first)
        curvature = np.abs(first) ** 2 - np.real(value.conj() * second)
        bend = np.where(curvature < 0, curvature, -np.inf)
        move = np.asarray(np.clip(-slope / bend, -0.5, 0.5), dtype=np.float64)
        centred *= _phasors(turn * move, count)
    return centred


def _phasors(angle: Floats, count: int) -> Complexes:
    """exp(j · angle · n), n = 0 … count - 1, as products of coarse and fine steps: exponentials are dear."""
    fine = np.exp(1j * np.outer(angle, np.arange(32)))
    coarse = np.exp(1j * np.outer(angle, np.arange(0, count, 32)))
    phasors: Complexes = (coarse[:, :, None] * fine[:, None, :]).reshape(angle.size, -1)[:, :count]
    return phasors


def _basis(strength: Floats, order: int) -> Floats:
    """Smooth functions over the aperture by rising frequency, orthonormal under its power: a cubic, then cosines.

    The cubic takes up the ends' slopes, so that cosines of a smooth phase converge fast; the n-th turns n/2 times.
    Samples beside the band, which leak into it in an image of finite extent, have no weight.
    """
    place = _place(strength.size)
    columns = [place**power for power in range(4)]
    columns += [np.cos(math.pi / 2 * n * (place + 1)) for n in range(1, min(order, strength.size // 2) - 3)]
    functions = np.stack(columns, axis=1)
    _, triangle = np.linalg.qr(np.sqrt(strength)[:, None] * functions)
    basis: Floats = np.linalg.solve(triangle.T, functions.T).T
    return basis


def _step(responses: Complexes, basis: Floats, strength: Floats, samples: int) -> Floats:
    """One estimate of the common phase of windowed, centred responses over the aperture."""
    count = responses.shape[1]
    # Gradient kernel: the maximum-likelihood phase difference of neighbours, integrated.
    difference = np.sum(responses[:, 1:] * responses[:, :-1].conj(), axis=0)
    phase = np.concatenate(([0.0], np.cumsum(np.angle(difference))))
    coefficients = basis.T @ (strength * phase)
    coefficients[:2] = 0  # constant and linear
    phase = basis @ coefficients
    if np.linalg.norm(coefficients) > _COHERENT * math.sqrt(count):
        return phase
    lag = max(1, count // 4)
    for _ in range(2):
        aligned = responses * np.exp(-1j * phase)
        slope = np.angle(np.sum(aligned[:, lag:] * aligned[:, :-lag].conj(), axis=1)) / lag
        aligned *= _phasors(-slope, count)
        # Power iteration for the principal eigenvector of the covariance over the aperture.
        amplitude = aligned.mean(axis=1)
        vector = amplitude.conj() @ aligned
        weighted = np.abs(vector)[:, None] * basis
        phase = phase + basis @ np.linalg.solve(basis.T @ weighted, weighted.T @ np.angle(vector))
    coefficients = basis.T @ (strength * phase)
    coefficients[:2] = 0
    # Standard deviation of a coefficient from clutter of unit power alone.
    deviation = samples / math.sqrt(2 * count * float(np.sum(np.abs(amplitude) ** 2)))
    coefficients[np.abs(coefficients) < _SIGNIFICANT * deviation] = 0
    step: Floats = basis @ coefficients
    return step


def _drifts(aperture: Complexes, parts: list[Indices], pairs: list[tuple[int, int]]) -> Floats | None:
    """Difference of phase slope between sub-apertures, per aperture sample; None if they do not correlate."""
    samples = 2 * aperture.shape[1]  # of powers, which have twice the band
    powers = [np.fft.fft(np.abs(np.fft.ifft(aperture[:, part], samples, axis=1)) ** 2, axis=1) for part in parts]
    for power in powers:
        power[:, 0] = 0  # the mean correlates everywhere
        power /= np.linalg.norm(power)
    # Speckle of disjoint sub-apertures is independent, from cell to cell and from line to line.
    least = _CORRELATED / math.sqrt(aperture.shape[0] * parts[-1].size)
    drifts = []
    for a, b in pairs:
        correlation = np.fft.ifft(np.sum(powers[b] * powers[a].conj(), axis=0)).real * samples
        top = int(np.argmax(correlation))
        if correlation[top] <= least:
            return None
        before, at, after = correlation[top - 1], correlation[top], correlation[(top + 1) % samples]
        shift = top + (before - after) / (2 * (before - 2 * at + after))
        shift = (shift + samples / 2) % samples - samples / 2
        drifts.append(-2 * math.pi * shift / samples)
    return np.array(drifts)


# ---------------------------------------------------------------------- rotation
def rotated(image: Complexes, look_azimuth: float) -> Complexes:
    """Turn an image in (x, y) into the frame (x′, y′) of (10), by three shears, each a phase ramp in one dimension.

    Source: Unser, Thévenaz & Yaroslavsky, "Convolution-based interpolation for fast, high-quality rotation of
    images", IEEE Trans. Image Processing 4 (1995); the shears here are by FFT, so exact for a band-limited image.

    Parameters
    ----------
    image : (n, n) ndarray
        Baseband image, x along the first axis, equal spacing, about sample n // 2 of each axis. Exact if its
        spectrum lies within 0.35 cycles per sample of zero: beyond, the shears alias.
    look_azimuth : float
        Direction of x′. [rad]

    Returns
    -------
    (m, m) ndarray
        All of the image with a margin of zeros, m = 2 n rounded up to even, same spacing, about sample m // 2.

    Raises
    ------
    ValueError
        The image is not square or the azimuth not finite.
    """
    if image.ndim != 2 or image.shape[0] != image.shape[1]:
        raise ValueError(f"rotation takes a square image (got shape {image.shape})")
    count = image.shape[0]
    side = _MARGIN * count
    padded = np.zeros((side, side), dtype=complex)
    start = side // 2 - count // 2
    padded[start : start + count, start : start + count] = image
    return _turned(padded, look_azimuth)


def scene_axes(image: Complexes, look_azimuth: float, count: int) -> Complexes:
    """Turn an image in (x′, y′), as `rotated` gives it, back to (x, y) and take its middle, (count, count)."""
    start = image.shape[0] // 2 - count // 2
    return _turned(image, -look_azimuth)[start : start + count, start : start + count]


def _turned(image: Complexes, angle: float) -> Complexes:
    """Image whose axes are turned by an angle: quarter turns exactly, the rest, at most 45°, by shears."""
    if not math.isfinite(angle):
        raise ValueError(f"the look azimuth must be a finite angle (got {angle} rad)")
    quarters = round(angle / (math.pi / 2))
    rest = angle - quarters * math.pi / 2
    for _ in range(quarters % 4):
        # new(x′, y′) = old(−y′, x′); an even side has no partner for its first sample, which is margin.
        image = np.roll(image.T[:, ::-1], 1, axis=1)
    # old(x, y) with x = x′cos − y′ sin, y = x′ sin + y′ cos, split into x-, y- and x-shears.
    image = _sheared(image, -math.tan(rest / 2), axis=0)
    image = _sheared(image, math.sin(rest), axis=1)
    return _sheared(image, -math.tan(rest / 2), axis=0)


def _sheared(image: Complexes, shear: float, axis: int) -> Complexes:
    """new(u, v) = old(u + shear · v, v), u along `axis`."""
    side = image.shape[0]
    frequency = np.fft.fftfreq(side)
    across = np.arange(side) - side // 2
    ramp = np.exp(2j * math.pi * shear * np.outer(frequency, across))
    moved: Complexes = np.fft.ifft(np.fft.fft(image, axis=axis) * (ramp if axis == 0 else ramp.T), axis=axis)
    return moved
