"""Autofocus of a complex image by phase gradient or map drift.

Motion errors smear an image along y′, across the bistatic look direction. Both estimators therefore take an image in
the rotated frame (x′, y′), with x′ along the first axis, as in Section VI of Rigling & Moses.

Sources: Wahl, Eichel, Ghiglia & Jakowatz, "Phase Gradient Autofocus - A Robust Tool for High Resolution SAR Phase
Correction", IEEE Trans. AES 30 (1994); Jakowatz & Wahl, "Eigenvector method for maximum-likelihood estimation of
phase errors in SAR imagery", JOSA A 10 (1993); map drift: Carrara, Goodman & Majewski, Spotlight Synthetic Aperture
Radar, chapter 6.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from bisar_budget.simulator.phase_history import Complexes, Floats

Indices = NDArray[np.int64]

_MAX_AUTOFOCUS_ITERATIONS = 40
_SUPPORT_FRACTION = 0.1  # fraction of the strongest aperture sample; weaker samples are leakage of a finite image
_MIN_GAP_FRACTION = 0.05  # smallest empty part of the sampling band in an oversampled image
_BLOCK_ROWS = 16  # range lines that are corrected at once, so that they fit into the cache
_DRIFT_TOLERANCE_RAD = 1e-3  # largest last change of the phase at the aperture edge
_CORRELATION_SIGMA = 6.0  # smallest accepted correlation peak; the highest peak of pure speckle is at about 4 sigma


@dataclass(frozen=True)
class PhaseGradientSettings:
    """Numerical settings of phase gradient autofocus.

    Attributes
    ----------
    max_lines : int
        Largest number of range lines that are used. Additional lines would take more time and hardly improve the
        estimate.
    target_count, targets_per_line : int
        Largest number of targets that are used in the whole image, and in each range line.
    secondary_fraction : float
        Smallest power of a further target in a range line, as a fraction of the largest power of the line. Sidelobes
        are weaker than this.
    false_alarm_probability : float
        Probability that a target is detected anywhere in an image of clutter alone.
    clutter_floor_ratio : float
        Lower bound of the clutter power of a line, relative to the peak power of the image. Lower values are caused
        by rounding, not by clutter.
    smear_fraction : float
        Power at which the mean response is considered to end, as a fraction of its peak power. The median of
        the mean response is first subtracted from both powers.
    shrink_factor : float
        Smallest ratio of the window width of an iteration to the window width of the previous iteration.
    narrowest_cells : int
        Smallest half width of a window. [cells]
    bridge_cells : int
        Largest gap in the mean response that is bridged next to the peak [cells]. Farther from the peak, wider gaps
        are bridged: half the distance from the peak is added to this limit. Nulls within a smeared response are
        narrower than this limit and are therefore bridged; a wider gap separates targets.
    coherent_rad : float
        Rms phase error below which responses can be added coherently over the full aperture. [rad]
    significant_sigma : float
        Smallest phase component that an iteration keeps, in standard deviations of the components that clutter alone
        causes.
    """

    max_lines: int = 96
    target_count: int = 96
    targets_per_line: int = 6
    secondary_fraction: float = 0.1
    false_alarm_probability: float = 1e-3
    clutter_floor_ratio: float = 1e-6
    smear_fraction: float = 0.1
    shrink_factor: float = 0.7
    narrowest_cells: int = 12
    bridge_cells: int = 8
    coherent_rad: float = 0.5
    significant_sigma: float = 2.0


_PGA = PhaseGradientSettings()


@dataclass(frozen=True, slots=True, eq=False)
class Focused:
    """Image after autofocus, and the phase [rad] that autofocus removed from its spectrum along the second axis.

    `phase` is (ny,), in the order of `numpy.fft.fftfreq(ny)`, and 0 outside the band of the aperture. Within the band
    it has no constant or linear part, because these parts do not defocus: a linear phase only displaces the image.
    """

    image: Complexes
    phase: Floats


def phase_gradient_autofocus(image: Complexes) -> Focused:
    """Estimate the phase error that is common to all range lines, whatever its shape, and remove it.

    Targets stronger than clutter are selected, centred to a fraction of a sample, windowed, and transformed to the
    aperture. While they are smeared, the gradient kernel estimates their common phase. Once they can be added
    coherently, the phase is estimated from the principal eigenvector of their covariance, by power iteration. The
    estimate contains only components that vary slowly enough for the window. Each iteration estimates the remaining
    phase, and drops components that are so small that clutter alone could cause them. The iterations end when all
    components are dropped.

    Parameters
    ----------
    image : (nx, ny) ndarray
        Complex image in the rotated frame (x′, y′), at baseband: the spectrum of the aperture must lie at the same
        frequencies for targets anywhere in the image. The image may be oversampled, and its band may lie anywhere.

    Returns
    -------
    Focused
        Focused image and removed phase. If no target exceeds the clutter, as in a homogeneous scene, the image is
        unchanged and the phase is zero.

    Raises
    ------
    ValueError
        The image is not two-dimensional, has values that are not finite, or has fewer than 16 samples along y′.

    Notes
    -----
    A target must exceed the clutter even if it is smeared: its power, divided by the number of cells over which it is
    smeared, must exceed the mean clutter power by a factor of ln(pixels / 10⁻³). In a million pixels this factor is
    13 dB.

    Clutter causes an error of the estimated phase of about √(window / (2 · targets · ratio)) rad rms. Here the window
    is ±12 cells, and the ratio is the target power divided by the clutter power. In an image of at most a dozen
    targets, targets that lie in each other's windows add 0.1 to 0.3 rad to this error. The phase is not corrected
    where the amplitude taper falls below a tenth of its maximum, as a Taylor taper of -45 dB does at its ends.
    """
    image = _checked(image)
    rows, level = _range_lines(image)
    phase: Floats = np.zeros(image.shape[1])
    if not rows.size:
        return Focused(image=image.copy(), phase=phase)
    spectrum = np.fft.fft(image[rows] / np.sqrt(level)[:, None], axis=1)
    band = aperture_band(spectrum)
    samples = 1 << (band.size - 1).bit_length()  # samples of a range line: one to two per resolution cell
    aperture = spectrum[:, band] * (samples / image.shape[1])
    phase[band] = _common_phase(aperture, samples, _threshold(image.size))
    return Focused(image=_corrected(image, phase), phase=phase)


def map_drift(image: Complexes, sub_apertures: int = 2) -> Focused:
    """Estimate a quadratic (or also a cubic) phase error from shifts between sub-aperture images, and remove it.

    The phase error over a sub-aperture is mainly linear, and a linear phase shifts the image of the sub-aperture
    along y′. The shift between two images is measured by cross-correlating their powers along y′, summed over range
    lines. The estimate is repeated until the images are no longer shifted against each other.

    Parameters
    ----------
    image : (nx, ny) ndarray
        As for `phase_gradient_autofocus`.
    sub_apertures : int
        2 to estimate a quadratic phase, or 3 to estimate a quadratic and a cubic phase.

    Returns
    -------
    Focused
        Focused image and removed phase. If the sub-aperture images do not correlate, the image is unchanged and the
        phase is zero.

    Raises
    ------
    ValueError
        As for `phase_gradient_autofocus`, or `sub_apertures` is neither 2 nor 3.

    Notes
    -----
    Map drift needs features that are visible in all sub-aperture images: points, edges, texture. The speckle of
    disjoint sub-apertures is independent, so a homogeneous scene gives no estimate. Phase errors of higher orders
    remain in the image and may bias the estimate. With two sub-apertures a cubic phase does not change the estimate,
    but a quartic phase is partly mistaken for a quadratic phase. The smear must be much narrower than the image,
    because the correlation is circular.
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
    aperture_place = _aperture_places(band.size)
    shapes = np.stack((aperture_place**2, aperture_place**3)[: sub_apertures - 1], axis=1)
    segments = np.array_split(np.arange(band.size), sub_apertures)
    pairs = [(a, b) for a in range(sub_apertures) for b in range(a + 1, sub_apertures)]
    # Slope per sample of each polynomial over each sub-aperture, from a fitted straight line.
    slopes = np.array([np.polyfit(segment, shapes[segment], 1)[0] for segment in segments])
    model = np.array([slopes[b] - slopes[a] for a, b in pairs])
    coefficients = np.zeros(shapes.shape[1])
    for _ in range(_MAX_AUTOFOCUS_ITERATIONS):
        drifts = _drifts(aperture * np.exp(-1j * shapes @ coefficients), segments, pairs)
        if drifts is None:
            break
        step = np.linalg.lstsq(model, drifts, rcond=None)[0]
        coefficients = coefficients + step
        if np.abs(step).max() < _DRIFT_TOLERANCE_RAD:
            break
    phase = shapes @ coefficients
    total[band] = phase - np.polyval(np.polyfit(aperture_place, phase, 1), aperture_place)
    return Focused(image=_corrected(image, total), phase=total)


# Algorithms by their names in the mission file. Map drift uses three sub-apertures, to estimate a cubic phase too.
ALGORITHMS: dict[str, Callable[[Complexes], Focused]] = {
    "pga": phase_gradient_autofocus,
    "map_drift": partial(map_drift, sub_apertures=3),
}


def aperture_band(spectrum: Complexes) -> Indices:
    """Indices of the frequencies of a spectrum (lines, frequencies) that the aperture fills, sorted by frequency.

    The spectrum is in the order of the FFT, and the filled band may wrap around its ends. Frequencies with less than
    a tenth of the largest amplitude count as empty. If no gap of empty frequencies is wider than 5 % of the spectrum,
    the whole spectrum counts as filled, and the indices begin at the most negative frequency.
    """
    count = spectrum.shape[1]
    strength = np.sqrt(np.mean(np.abs(spectrum) ** 2, axis=0))
    used = np.nonzero(strength > _SUPPORT_FRACTION * strength.max())[0]
    gaps = np.diff(used, append=used[0] + count)
    widest = int(np.argmax(gaps))
    if gaps[widest] - 1 < _MIN_GAP_FRACTION * count:
        band: Indices = (np.arange(count) - count // 2) % count
        return band
    first = used[(widest + 1) % used.size]
    return np.asarray((first + np.arange(count - gaps[widest] + 1)) % count, dtype=np.int64)


def _checked(image: Complexes) -> Complexes:
    samples = np.asarray(image)
    if samples.ndim != 2 or samples.shape[0] < 1 or samples.shape[1] < 16:
        raise ValueError(f"autofocus takes an image of at least 1 x 16 samples (got shape {samples.shape})")
    if not np.isfinite(np.sum(samples)) and not np.isfinite(samples).all():
        raise ValueError(
            f"autofocus takes finite samples ({np.count_nonzero(~np.isfinite(samples))} are NaN or infinite)"
        )
    return samples.astype(complex, copy=False)


def _corrected(image: Complexes, phase: Floats) -> Complexes:
    turn = np.exp(-1j * phase)
    focused = np.empty(image.shape, dtype=complex)
    for start in range(0, image.shape[0], _BLOCK_ROWS):
        rows = slice(start, start + _BLOCK_ROWS)
        focused[rows] = np.fft.ifft(np.fft.fft(image[rows], axis=1) * turn, axis=1)
    return focused


def _aperture_places(count: int) -> Floats:
    """Normalised aperture positions of `count` samples: the centres of equal cells between -1 and 1, (count,)."""
    return (2 * np.arange(count) - (count - 1)) / count


def _threshold(pixels: int) -> float:
    """Power, relative to the mean clutter power, above which a pixel counts as a target.

    In an image of `pixels` pixels that contains only clutter, with exponentially distributed power, the probability
    that any pixel exceeds the threshold is the false-alarm probability.
    """
    return math.log(pixels / _PGA.false_alarm_probability)


def _range_lines(image: Complexes) -> tuple[Indices, Floats]:
    """Indices of the range lines that contain a target, and the mean clutter power of these lines.

    Both arrays are (lines,), and are empty if there is no target. The lines are sorted by the ratio of peak power to
    clutter power, beginning with the largest.
    """
    power = image.real**2 + image.imag**2
    peak = power.max(axis=1)
    if not peak.max():
        return np.zeros(0, dtype=np.int64), peak[:0]
    # A few targets hardly change a median. The median of an exponential distribution is ln 2 times its mean.
    level = np.median(power[:, :: max(1, power.shape[1] // 256)], axis=1) / math.log(2)
    level = np.maximum(level, _PGA.clutter_floor_ratio * peak.max())
    ratio = peak / level
    best = np.argsort(ratio)[::-1][: _PGA.max_lines]
    best = best[ratio[best] > _threshold(image.size)]
    return best, level[best]


def _common_phase(aperture: Complexes, line_samples: int, threshold: float) -> Floats:
    """Estimate from phase gradients the phase error that all range lines have in common, (count,). [rad]

    `aperture` (lines, count) is the spectrum of the range lines within the band of the aperture, scaled so that the
    clutter power is 1. Range lines of `line_samples` samples are computed from it. Pixels with a power above
    `threshold` count as targets.
    """
    count = aperture.shape[1]
    per_cell = line_samples / count
    narrowest = math.ceil(_PGA.narrowest_cells * per_cell)
    phase: Floats = np.zeros(count)
    strength = np.mean(np.abs(aperture) ** 2, axis=0)
    strength /= strength.mean()
    basis: Floats = np.zeros((count, 0))
    half_window = line_samples // 2 - 1
    distance = np.minimum(np.arange(line_samples), line_samples - np.arange(line_samples))
    for iteration in range(_MAX_AUTOFOCUS_ITERATIONS):
        turn = np.exp(-1j * phase)
        lines = np.fft.ifft(aperture * turn, line_samples, axis=1)
        power = lines.real**2 + lines.imag**2
        smear_window = max(narrowest, 2 * _smear(power, per_cell) + 4)
        half_window = min(
            half_window, max(smear_window, int(_PGA.shrink_factor * half_window)) if iteration else smear_window
        )
        if not iteration:
            basis = _basis(strength, math.ceil(half_window / per_cell) + 4)
        row, column = _targets(power, half_window, threshold)
        responses = np.fft.ifft(_centred(aperture[row] * turn, column, line_samples), line_samples, axis=1)
        responses[:, distance > half_window] = 0
        windowed = np.fft.fft(responses, axis=1)[:, :count]
        step = _step(windowed, basis[:, : math.ceil(half_window / per_cell) + 4], strength, line_samples)
        if not step.any():
            break
        phase += step
    return phase


def _smear(power: Floats, per_cell: float) -> int:
    """Half width of the mean response of range lines that are aligned at their peaks. [samples]

    At each distance from the peak, the stronger of the two sides of a line is used for the mean. `power` is (lines,
    samples), and `per_cell` is the number of samples per resolution cell.
    """
    samples = power.shape[1]
    column = power.argmax(axis=1)[:, None]
    distance = np.arange(samples // 2)
    row = np.arange(power.shape[0])[:, None]
    folded = np.maximum(power[row, (column + distance) % samples], power[row, column - distance]).mean(axis=0)
    floor = np.median(folded)
    bright = folded - floor > _PGA.smear_fraction * (folded[0] - floor)
    reach = 0
    while True:
        # Nulls within a smeared response are bridged. A wider gap separates targets.
        ahead = np.nonzero(bright[reach + 1 : reach + 1 + int(_PGA.bridge_cells * per_cell) + reach // 2])[0]
        if not ahead.size:
            return reach
        reach += int(ahead[-1]) + 1


def _targets(power: Floats, half: int, threshold: float) -> tuple[Indices, Indices]:
    """Rows and columns of targets: the strongest pixel of each line, and further strong pixels.

    Both arrays are (targets,). `power` is (lines, samples), in units of the clutter power. A further target must be
    more than 2 · `half` samples from all stronger targets of its line, and its power must exceed both `threshold` and
    a fraction of the largest power of its line.
    """
    remaining = power.copy()
    row = np.arange(power.shape[0])
    least_power = _PGA.secondary_fraction * power.max(axis=1)
    window = np.arange(-2 * half, 2 * half + 1)
    picks = []
    for order in range(_PGA.targets_per_line):
        column = remaining[row].argmax(axis=1)
        if order:
            stands_out = remaining[row, column] > np.maximum(threshold, least_power[row])
            row, column = row[stands_out], column[stands_out]
        picks.append((row, column))
        remaining[row[:, None], (column[:, None] + window) % power.shape[1]] = 0
    rows, columns = (np.concatenate(indices) for indices in zip(*picks, strict=True))
    best = np.argsort(power[rows, columns])[::-1][: _PGA.target_count]
    return rows[best], columns[best]


def _centred(aperture: Complexes, column: Indices, samples: int) -> Complexes:
    """Shift the interpolated peak of each response to sample 0 by a phase ramp over the aperture.

    `aperture` (targets, count) holds the spectra of the responses. `column` (targets,) is the strongest sample of
    each response, in a line of `samples` samples. The peak of the power between samples is found by Newton's method.

    A window that is off the peak by a fraction of a sample would bend the phase at the edges of the aperture. The
    bend would have the same direction in each iteration, so that the estimate would drift.
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
    """Phasors exp(j · angle · n) for several angles and n = 0 … count - 1, (angles, count).

    They are computed as products of coarse and fine phasors, so that only a few exponentials are needed.
    """
    fine = np.exp(1j * np.outer(angle, np.arange(32)))
    coarse = np.exp(1j * np.outer(angle, np.arange(0, count, 32)))
    phasors: Complexes = (coarse[:, :, None] * fine[:, None, :]).reshape(angle.size, -1)[:, :count]
    return phasors


def _basis(strength: Floats, order: int) -> Floats:
    """Smooth basis functions for a phase error, (count, functions): polynomials up to the cubic, then cosines.

    They are orthonormal with respect to the weights `strength` (count,), which are the power over the aperture. There
    are `order` functions, but at most count // 2. The polynomials represent the slopes at both ends, so that the
    cosine series of a smooth phase converges fast. The n-th cosine completes n/2 cycles over the aperture. In an
    image of finite extent, the spectrum leaks into samples outside the aperture; these samples have little power and
    therefore little weight.
    """
    aperture_place = _aperture_places(strength.size)
    columns = [aperture_place**power for power in range(4)]
    columns += [np.cos(math.pi / 2 * n * (aperture_place + 1)) for n in range(1, min(order, strength.size // 2) - 3)]
    functions = np.stack(columns, axis=1)
    _, triangle = np.linalg.qr(np.sqrt(strength)[:, None] * functions)
    basis: Floats = np.linalg.solve(triangle.T, functions.T).T
    return basis


def _step(responses: Complexes, basis: Floats, strength: Floats, samples: int) -> Floats:
    """Estimate the phase error that windowed, centred responses have in common over the aperture, (count,). [rad]

    `responses` (targets, count) holds the spectra of the responses. `samples` is the number of samples of a range
    line. A large phase is estimated by the gradient kernel alone. A small phase is refined by the principal
    eigenvector, and its insignificant components are removed.
    """
    count = responses.shape[1]
    # Gradient kernel: the maximum-likelihood phase difference of neighbours, integrated.
    difference = np.sum(responses[:, 1:] * responses[:, :-1].conj(), axis=0)
    phase = np.concatenate(([0.0], np.cumsum(np.angle(difference))))
    coefficients = basis.T @ (strength * phase)
    coefficients[:2] = 0  # constant and linear
    phase = basis @ coefficients
    if np.linalg.norm(coefficients) > _PGA.coherent_rad * math.sqrt(count):
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
    coefficients[np.abs(coefficients) < _PGA.significant_sigma * deviation] = 0
    step: Floats = basis @ coefficients
    return step


def _drifts(aperture: Complexes, segments: list[Indices], pairs: list[tuple[int, int]]) -> Floats | None:
    """Difference between the phase slopes over the two sub-apertures of each pair, (pairs,). [rad/sample]

    The slope over the first sub-aperture is subtracted from the slope over the second. `aperture` is (lines,
    samples), and each item of `segments` holds the sample indices of a sub-aperture. The result is None if the images
    of any pair do not correlate.
    """
    samples = 2 * aperture.shape[1]  # the power of an image has twice its bandwidth
    powers = [
        np.fft.fft(np.abs(np.fft.ifft(aperture[:, segment], samples, axis=1)) ** 2, axis=1) for segment in segments
    ]
    for power in powers:
        power[:, 0] = 0  # the mean correlates at every shift
        power /= np.linalg.norm(power)
    # Speckle of disjoint sub-apertures is independent between cells and between lines.
    least_correlation = _CORRELATION_SIGMA / math.sqrt(aperture.shape[0] * segments[-1].size)
    drifts = []
    for a, b in pairs:
        correlation = np.fft.ifft(np.sum(powers[b] * powers[a].conj(), axis=0)).real * samples
        top_sample = int(np.argmax(correlation))
        if correlation[top_sample] <= least_correlation:
            return None
        before, top_value, after = (
            correlation[top_sample - 1],
            correlation[top_sample],
            correlation[(top_sample + 1) % samples],
        )
        shift = top_sample + (before - after) / (2 * (before - 2 * top_value + after))
        shift = (shift + samples / 2) % samples - samples / 2
        drifts.append(-2 * math.pi * shift / samples)
    return np.array(drifts)
