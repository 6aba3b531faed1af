"""Measure the phase of an error over the aperture in a small image of a point target (a chip).

The contribution of each pulse to each pixel follows from exact ranges along the measured paths. The phase over the
aperture is modelled as a polynomial, which is fitted to the pixels themselves, so that sidelobes cut off by the
finite image cause no error. The fit starts from the effect that exact ranges predict. Its residual shows whether the
polynomial describes the image. If it does not, the image is correlated with the contribution of each pulse, which
gives the phase of the pulse. This correlation corresponds to a projection of the image spectrum onto slow time, but
takes range walk and curved lines of equal range into account. The error-free response is formed and measured with the
same paths, so that effects common to both responses cancel.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.geometry import GroundVector
from bisar_budget.ranges.exact_ranges import ExactEffect
from bisar_budget.simulator.autofocus import Focused
from bisar_budget.simulator.collection import (
    CUT_CELLS,
    MAX_CONTRIBUTION_COUNT,
    OVERSAMPLING_FACTOR,
    Chip,
    PointCollection,
    pulses_for,
)
from bisar_budget.simulator.image_formation import taylor_window
from bisar_budget.simulator.impulse_response import place_of_peak
from bisar_budget.simulator.phase_history import Complexes, Errors, Floats, cell_centres

READ_CELLS = 1  # range cells that a chip needs around the middle line, in addition to the range walk
_READ_STRIDE_LINES = 2  # distance between two lines that are used
_INNER_FRACTION = 0.95  # part of the aperture that the correlation uses; the edges ring in a finite patch
# Smallest covered part of the aperture, and the order of the polynomial that is then fitted.
# A large rotation (±0.5 rad) causes phases of sixth order, but high orders cannot be extrapolated beyond the patch.
_POLYNOMIAL_ORDERS = ((0.9, 6), (0.6, 3), (-1.0, 2))
_PRESENT_FRACTION = 0.25  # of the median strength over the aperture; weaker pulses lie outside the patch
_WALK_ROUNDS = 2  # rounds of the fit, each with the range walk of the previous fit
_MAX_REFINEMENT_STEPS, _MAX_HALVING_STEPS, _REFINEMENT_TOLERANCE_RAD = 20, 6, 1e-5
# Norm of the residual divided by the norm of the image, which is the rms of the phase. Below the first limit the
# polynomial describes the image. Below the second limit no other fit is tried; this limit is a quarter of the
# permitted error of a measured phase, 0.02 rad.
_FITTED_RAD, _EXACT_RAD = 0.05, 5e-3
_BLOCK_CONTRIBUTIONS_COUNT = 1 << 18  # contributions that are computed at once
_SPECTRUM_FRACTION = 0.4  # of the largest error-free spectral magnitude; the band's edges ring in a finite image
_BLOCK_TIMES_COUNT = 64  # slow times read from the lines' spectra at once
_KERNEL_CELLS = np.linspace(0, 64, 4097)  # range cells of a tapered range response


class ApertureReading(NamedTuple):
    """Quadratic and cubic phase of a response at the edge of the aperture [rad], with the sign of the range error.

    `across_pixels` is the offset of the response from the middle of the image along y′. This offset follows from the
    linear part of the phase. `walked_pixels` is the offset of the response's centre of gravity along x′ that is due
    to the quadratic and higher parts of the phase: a pulse at slow time τ contributes at the range e(τ) − τ·e′(τ),
    where e is the range error. `coverage` is the fraction of the aperture whose response is within the patch. It is
    less than 1 if the smeared response extends beyond the patch, and 1 otherwise.
    """

    quadratic: float
    cubic: float
    across_pixels: float
    walked_pixels: float
    coverage: float


def read_aperture(
    collection: PointCollection,
    errors: Errors,
    centre: GroundVector,
    chip: Chip,
    reference: Chip,
    half_lines: int = 0,
    expected: ExactEffect | None = None,
) -> ApertureReading:
    """Measure the quadratic and cubic phase over the aperture in the image of a point target with errors.

    Parameters
    ----------
    collection, errors
        Simulated collection, and the errors in it. The data for `chip` contain these errors. Both chips are formed
        along the same measured paths, which contain the errors of the paths.
    centre : (2,) float
        Ground point (east, north) at the middle of the chips, which is the position of the error-free response. [m]
    chip, reference : Chip
        Images with and without errors, on the same pixels.
    half_lines : int
        Largest distance from the middle line up to which image lines are used [lines]. Every second line is used. If
        it is 0, only the middle line is used.
    expected : ExactEffect, optional
        Predicted effect, from which the fit starts. If it is None, or if no polynomial close to it fits the pixels,
        the fit starts from the phases of single pulses.

    Raises
    ------
    ValueError
        The response is not in the image.
    """
    lines, columns = chip.image.shape
    middle = lines // 2
    half = min(middle, lines - 1 - middle, half_lines) // _READ_STRIDE_LINES * _READ_STRIDE_LINES
    rows = slice(middle - half, middle + half + 1, _READ_STRIDE_LINES)
    slow_time = cell_centres(collection.aperture_time, pulses_for(round(columns / OVERSAMPLING_FACTOR)))
    pixels = chip.grid[rows].reshape(-1, 3)
    images = [member.image[rows] for member in (chip, reference)]
    fitting = _Fitting(collection, errors, centre, pixels, slow_time, images, bool(half_lines))
    solution, coverage = _Refined(np.zeros(4), math.inf), 1.0
    if expected is not None:
        solution = fitting.refined(np.array([0.0, 0.0, -expected.quadratic / 1.5, -expected.cubic / 2.5]))
    if solution.misfit >= _EXACT_RAD:
        by_pulses, coverage = _fit_to_pulses(_Pixels(collection, errors, centre, pixels), slow_time, images, columns)
        if expected is None and not coverage:
            raise ValueError("the response is not in the image")
        solution = min(solution, fitting.refined(by_pulses), key=lambda candidate: candidate.misfit)
        if solution.misfit < _FITTED_RAD:
            coverage = 1.0
        elif coverage:
            solution = _Refined(by_pulses, solution.misfit)
        else:
            raise ValueError("the response is not in the image")
    fit = solution.fit
    # A pixel along y′ changes the range sum over the aperture by λ / OVERSAMPLING_FACTOR, which is twice its P₁ part.
    turn = 1 if collection.range_lines(errors).turns_left(centre) else -1
    across = -turn * OVERSAMPLING_FACTOR / math.pi * float(fit[1])
    scaled_time = 2 * slow_time / collection.aperture_time
    slope = np.polynomial.legendre.legder([0.0, 0.0, *fit[2:]])
    mean = float(np.mean(scaled_time * np.polynomial.legendre.legval(scaled_time, slope)))
    radar = collection.radar
    by_range = collection.range_lines(errors).gradients(np.asarray(centre, dtype=float))[0]
    lines_per_cell = collection.range_cell / (float(np.hypot(*by_range)) * chip.spacing[0])
    # A range error of one wavelength is a range walk of (bandwidth / centre frequency) range cells.
    walked = mean / (2 * math.pi) * (radar.bandwidth / radar.center_frequency) * lines_per_cell
    # The image's phase is −2π/λ times the range error; P₂ = (3t² - 1)/2, P₃ = (5t³ - 3t)/2.
    return ApertureReading(float(-1.5 * fit[2]), float(-2.5 * fit[3]), across, -walked, min(1.0, coverage * 1.02))


class _Pixels:
    """Pixels of an image at positions (n, 3) [m], and the contributions of single pulses to them.

    The contributions are computed for a point target.
    """

    def __init__(self, collection: PointCollection, errors: Errors, centre: GroundVector, pixels: Floats) -> None:
        self.collection, self.errors, self.places = collection, errors.smooth(), pixels
        self.point = np.array([[*centre, 0.0]])
        lines = collection.range_lines(errors)
        self.carrier = lines.carrier(pixels) - lines.carrier(self.point[0, :2])
        self.squares = _squares(pixels)
        if collection.is_tapered:
            weights, frequency = taylor_window(257), cell_centres(1.0, 257)
            self.kernel = np.cos(2 * math.pi * np.outer(_KERNEL_CELLS, frequency)) @ weights / 257

    def contributions(self, slow_time: Floats, remaining_range: Floats | None = None) -> NDArray[np.complex64]:
        """Contributions of m pulses to the n pixels of a baseband image, (m, n).

        `slow_time` (m,) [s] holds the times of the pulses. `remaining_range` (m,) [m] is a range error that shifts
        the range responses without changing the phase. If it is None, the range responses are not shifted.
        """
        collection = self.collection
        paths = collection.flight(self.errors, slow_time).paths
        if collection.is_tapered:  # the window also weights the pulses
            weights = taylor_window(1024)
            by_time = np.interp(slow_time, cell_centres(collection.aperture_time, weights.size), weights)[:, None]
        contribution = np.empty((slow_time.size, self.places.shape[0]), dtype=np.complex64)
        pulses = max(1, _BLOCK_CONTRIBUTIONS_COUNT // self.places.shape[0])
        for start in range(0, slow_time.size, pulses):
            block = slice(start, start + pulses)
            range_difference = np.zeros(contribution[block].shape)
            for path in paths:
                range_difference += _distance(path.measured[block], self.places, self.squares)
                range_difference -= _distance(path.measured[block], self.point, _squares(self.point))
            # Whole cycles are subtracted in double precision. Single precision then holds the remainder to 1e-6 rad,
            # and takes a quarter of the time.
            cycles = (range_difference - self.carrier) / collection.wavelength
            cycles -= np.rint(cycles)
            phase = (2 * math.pi * cycles).astype(np.float32)
            if remaining_range is not None:
                range_difference -= remaining_range[block, None]
            cells = (range_difference * (collection.radar.bandwidth / SPEED_OF_LIGHT_MPS)).astype(np.float32)
            if collection.is_tapered:
                strength = np.interp(np.abs(cells), _KERNEL_CELLS, self.kernel, right=0.0) * by_time[block]
            else:
                strength = np.sinc(cells)
            np.multiply(np.cos(phase), strength, out=contribution[block].real)
            np.multiply(np.sin(phase), strength, out=contribution[block].imag)
        return contribution


def _squares(points: Floats) -> Floats:
    squares: Floats = np.einsum("ij,ij->i", points, points)
    return squares


def _distance(positions: Floats, points: Floats, squares: Floats) -> Floats:
    """Distances (m, n) from positions (m, 3) to points (n, 3), accurate to 1e-8 m even from geostationary orbit. [m]

    `squares` (n,) [m²] holds the squared norms of the points.
    """
    square: Floats = positions @ (-2 * points.T)
    square += _squares(positions)[:, None]
    square += squares
    return np.sqrt(square, out=square)


def _fit_to_pulses(
    pulse_pixels: _Pixels, slow_time: Floats, images: Sequence[Complexes], columns: int
) -> tuple[Floats, float]:
    """Fit a polynomial to the phases of single pulses, and determine which part of the aperture these pulses cover.

    Returns the Legendre coefficients of the polynomial over the aperture [rad], and the covered fraction of the
    aperture. The fraction is 0 if the pulses in the middle of the aperture are missing, or if too few pulses remain.
    `images` holds the image with errors and the error-free image at the same pixels, in lines of `columns` pixels.
    """
    scaled_time = 2 * slow_time / pulse_pixels.collection.aperture_time
    # Taper at both ends of a line; each tapered end is half as long as a response without smear.
    inside = np.minimum(np.arange(columns) + 0.5, columns - np.arange(columns) - 0.5)
    taper = np.sin(math.pi / 2 * np.clip(inside / round(CUT_CELLS * OVERSAMPLING_FACTOR / 2), 0, 1)) ** 2
    tapered = np.stack([(image * taper).reshape(-1) for image in images])
    correlated = np.empty((2, slow_time.size), dtype=complex)
    block_pulses = max(1, _BLOCK_CONTRIBUTIONS_COUNT // pulse_pixels.places.shape[0])
    for start in range(0, slow_time.size, block_pulses):
        block = slice(start, start + block_pulses)
        correlated[:, block] = tapered @ pulse_pixels.contributions(slow_time[block]).conj().T
    with_error, clean = correlated
    strength = np.abs(with_error) / np.maximum(np.abs(clean), 1e-30)
    inner = np.abs(scaled_time) < _INNER_FRACTION
    present = strength > _PRESENT_FRACTION * np.median(strength[inner])
    middle = scaled_time.size // 2
    if not np.isfinite(strength).all():
        raise ValueError("the response is not in the image")
    if not present[middle]:
        return np.zeros(4), 0.0
    gaps = np.nonzero(~(present & inner))[0]
    first = int(gaps[gaps < middle].max(initial=-1)) + 1
    last = int(gaps[gaps > middle].min(initial=scaled_time.size))
    if last - first <= _POLYNOMIAL_ORDERS[0][1]:  # too few pulses for a polynomial
        return np.zeros(4), 0.0
    fitted_pulses = slice(first, last)
    coverage = float(scaled_time[last - 1] - scaled_time[first]) / (2 * _INNER_FRACTION)
    order = next(order for least_coverage, order in _POLYNOMIAL_ORDERS if coverage > least_coverage)
    phase = np.unwrap(np.angle((with_error * clean.conj())[fitted_pulses]))
    fit = np.zeros(max(4, order + 1))
    fit[: order + 1] = np.polynomial.legendre.legfit(
        scaled_time[fitted_pulses], phase, order, w=np.abs(clean[fitted_pulses])
    )
    return fit, coverage


@dataclass(frozen=True, slots=True, eq=False)
class _Refined:
    """Phase polynomial fitted to an image: its Legendre coefficients `fit` over the aperture [rad], and its misfit.

    `misfit` is the norm of the residual of the fit divided by the norm of the image.
    """

    fit: Floats
    misfit: float


class _Fitting:
    """Fits of phase polynomials over the aperture to the pixels of an image.

    If the image is large, only every n-th pixel is used, so that the computation fits into memory.
    """

    def __init__(
        self,
        collection: PointCollection,
        errors: Errors,
        centre: GroundVector,
        pixels: Floats,
        slow_time: Floats,
        images: Sequence[Complexes],
        walks: bool,
    ) -> None:
        selection = slice(None, None, -(-pixels.shape[0] * slow_time.size // MAX_CONTRIBUTION_COUNT))
        self.seen, clean = (image.reshape(-1)[selection] for image in images)
        self.fitted_pixels = _Pixels(collection, errors, centre, pixels[selection])
        self.slow_time, self.fits = slow_time, _WALK_ROUNDS if walks else 1
        at_rest = self.fitted_pixels.contributions(slow_time).sum(axis=0)
        self.gain = complex(np.vdot(at_rest, clean) / np.vdot(at_rest, at_rest))

    def refined(self, fit: Floats) -> _Refined:
        """Refine a phase polynomial, given by its Legendre coefficients `fit` [rad], by fitting it to the pixels.

        The fit uses the range walk that follows from the initial coefficients. If several image lines are used, the
        fit is repeated once with the range walk that follows from the first fit.
        """
        collection = self.fitted_pixels.collection
        scaled_time = 2 * self.slow_time / collection.aperture_time
        solution = _Refined(np.pad(fit, (0, _POLYNOMIAL_ORDERS[0][1] + 1 - fit.size)), math.inf)
        for _ in range(self.fits):
            # The range error that remains also moves a pulse to other range cells.
            phase = np.polynomial.legendre.legval(scaled_time, [0.0, *solution.fit[1:]])
            remaining_range = -collection.wavelength / (2 * math.pi) * phase
            contribution = self.fitted_pixels.contributions(self.slow_time, remaining_range)
            solution = _refined(solution.fit, scaled_time, contribution.astype(np.complex128), self.seen, self.gain)
        return solution


def _refined(fit: Floats, scaled_time: Floats, contribution: Complexes, image: Complexes, gain: complex) -> _Refined:
    """Fit a phase polynomial to the pixels of an image by Gauss-Newton steps.

    The first step starts from the Legendre coefficients `fit` [rad]. A step that does not reduce the residual is
    halved. `contribution` holds the contributions of the pulses to the pixels, (pulses, pixels). `gain` is the
    complex amplitude of the error-free response.
    """
    legendre = np.polynomial.legendre.legvander(scaled_time, fit.size - 1)
    norm = float(np.linalg.norm(image))

    def remainder_of(trial: Floats) -> tuple[Complexes, float, Complexes]:
        pulses = gain * np.exp(1j * (legendre @ trial))
        model = pulses @ contribution
        # The constant phase is not fitted, because its best value follows directly.
        turn = np.angle(np.vdot(model, image))
        pulses, model = pulses * np.exp(1j * turn), model * np.exp(1j * turn)
        amplitude = float(abs(np.vdot(model, image)) / np.real(np.vdot(model, model)))
        return image - amplitude * model, amplitude, pulses

    coefficients = fit.copy()
    remainder, amplitude, pulses = remainder_of(coefficients)
    for _ in range(_MAX_REFINEMENT_STEPS):
        columns = contribution.T @ (1j * amplitude * pulses[:, None] * legendre)
        real_columns = np.concatenate((columns.real, columns.imag))
        step = np.linalg.lstsq(real_columns, np.concatenate((remainder.real, remainder.imag)), rcond=1e-6)[0]
        for _ in range(_MAX_HALVING_STEPS):
            next_remainder = remainder_of(coefficients + step)
            if np.linalg.norm(next_remainder[0]) <= np.linalg.norm(remainder):
                break
            step = step / 2
        else:
            break
        coefficients = coefficients + step
        remainder, amplitude, pulses = next_remainder
        if np.abs(step[1:]).max() < _REFINEMENT_TOLERANCE_RAD:
            break
    return _Refined(coefficients, float(np.linalg.norm(remainder)) / norm)


# ---------------------------------------------------------------------- displacement
@dataclass(frozen=True, slots=True)
class Shift:
    """Displacement of a response on the ground (east, north) [m], and azimuth of the line along which it is smeared.

    The azimuth is between 0 and π [rad]. `pixels` [pixels] is the same displacement along x′ and y′ of the image.
    """

    displacement: GroundVector
    smear_azimuth: float
    pixels: tuple[float, float]


def measured_shift(chip: Chip, reference: Chip, reading: ApertureReading | None = None) -> Shift:
    """Measure the displacement of a response from an error-free response on the same grid, and its smear direction.

    If `reading` is None, the displacement is the vector between the two peaks. A response that is strongly smeared
    has no single peak, so `reading` must provide the phase over its aperture. The displacement along y′ then follows
    from the slope of the phase. The displacement along x′ is the centre of gravity minus the offset that is due to
    the quadratic and higher parts of the phase.

    Each part of the aperture displaces the point differently; equations (26) to (28) of Rigling & Moses describe this
    for three parts. These displacements follow from the spectrum of the image: they are the gradient of its phase
    relative to the error-free response. Their spread is the smear. This method can measure a smear far smaller than a
    resolution cell, which is not yet visible in the shape of the response.

    Raises
    ------
    ValueError
        The spectra do not overlap: one of the two responses is not in the image.
    """
    spectra = [np.fft.fftshift(np.fft.fft2(member.image)) for member in (chip, reference)]
    product = spectra[0] * np.conj(spectra[1])
    strength = np.abs(spectra[1])
    inside = strength > _SPECTRUM_FRACTION * strength.max()
    inside[:-1, :-1] &= inside[1:, :-1] & inside[:-1, 1:]
    inside[-1], inside[:, -1] = False, False
    if not inside.any():
        raise ValueError("the response is not in the image")
    steps = [_step(product, axis)[inside] for axis in (0, 1)]
    weights = np.abs(product[inside])
    # A shift by d pixels changes the phase of the spectrum by −2π·d/extent from one frequency to the next.
    pixels = np.stack([-step * count / (2 * math.pi) for step, count in zip(steps, product.shape, strict=True)])
    ground = _pixel_vectors(reference.grid) @ pixels
    if reading is None:
        middle = np.subtract(place_of_peak(chip.image), place_of_peak(reference.image))
    else:
        centre_of_gravity = np.average(pixels[0], weights=weights)
        middle = np.array([centre_of_gravity - reading.walked_pixels, reading.across_pixels])
    mean = _pixel_vectors(reference.grid) @ middle
    spread = np.cov(ground, aweights=weights)
    east, north = np.linalg.eigh(spread)[1][:, -1]
    return Shift(
        (float(mean[0]), float(mean[1])), math.atan2(north, east) % math.pi, (float(middle[0]), float(middle[1]))
    )


def _step(product: Complexes, axis: int) -> Floats:
    steps: Floats = np.angle(np.roll(product, -1, axis) * np.conj(product))
    return steps


def _pixel_vectors(grid: Floats) -> Floats:
    """Ground vectors from pixel to pixel along x′ and y′ at the middle of the grid, (2, 2). [m]

    The vectors are the columns of the matrix. Their components are east and north.
    """
    i, j = grid.shape[0] // 2, grid.shape[1] // 2
    columns = (grid[i + 1, j] - grid[i - 1, j], grid[i, j + 1] - grid[i, j - 1])
    vectors: Floats = np.stack([column[:2] / 2 for column in columns], axis=1)
    return vectors


# ---------------------------------------------------------------------- autofocus
def refocused(
    collection: PointCollection,
    errors: Errors,
    centre: GroundVector,
    chip: Chip,
    algorithm: Callable[[Complexes], Focused],
    half_lines: int,
) -> Chip:
    """Estimate the phase error over the aperture from the middle lines of a chip, and remove it from all lines.

    The autofocus function `algorithm` estimates the phase from the middle line and `half_lines` lines on either side
    of it.

    Along a line of equal range, each pulse has its own spatial frequency, which follows from the measured paths. Over
    a long aperture, or if the range and Doppler gradients are nearly parallel, equal time intervals occupy unequal
    parts of the band. A quadratic phase in time is then not quadratic in frequency. An estimate as a function of
    frequency would lose a part of the aperture that is compressed into a few per cent of the band. Therefore the
    spectra of the lines are sampled at equal time steps. The phase is estimated at these times, and then interpolated
    to the frequencies of the image.

    Raises
    ------
    ValueError
        The spatial frequency does not change monotonically over the aperture.
    """
    lines, columns = chip.image.shape
    slow_time = cell_centres(collection.aperture_time, max(64, round(columns / OVERSAMPLING_FACTOR)))
    frequency = _frequency(collection, errors, centre, chip, slow_time)
    step = np.gradient(frequency)
    if not (step > 0).all() and not (step < 0).all():
        raise ValueError("Doppler along the line does not change one way over the aperture: autofocus has no band")
    middle = lines // 2
    lines_used = chip.image[middle - half_lines : middle + half_lines + 1]
    pixel = np.arange(columns) - columns // 2
    aperture = np.empty((lines_used.shape[0], slow_time.size), dtype=complex)
    for start in range(0, slow_time.size, _BLOCK_TIMES_COUNT):
        block = slice(start, start + _BLOCK_TIMES_COUNT)
        aperture[:, block] = lines_used @ np.exp(-2j * math.pi * np.outer(pixel, frequency[block]))
    aperture *= np.abs(step)
    # An auxiliary image with the sampling of the chip, in which the aperture lies in the middle of the band.
    count = slow_time.size
    samples = math.ceil(OVERSAMPLING_FACTOR * count)
    spectrum = np.zeros((lines_used.shape[0], samples), dtype=complex)
    bins = (np.arange(count) - count // 2) % samples
    spectrum[:, bins] = aperture
    phase = algorithm(np.fft.fftshift(np.fft.ifft(spectrum, axis=1), axes=1)).phase[bins]
    order = np.argsort(frequency)
    at_bins = np.interp(np.fft.fftfreq(columns), frequency[order], phase[order])
    image = np.fft.ifft(np.fft.fft(chip.image, axis=1) * np.exp(-1j * at_bins), axis=1)
    return chip._replace(image=image)


def _frequency(
    collection: PointCollection, errors: Errors, centre: GroundVector, chip: Chip, slow_time: Floats
) -> Floats:
    """Spatial frequency of each pulse along the middle line of a chip, (times,). [cycles/pixel]

    It is computed at the centre of the line. The spatial frequency of the carrier phase, which is removed from the
    image, is subtracted.
    """
    line = chip.grid[chip.grid.shape[0] // 2]
    middle = line.shape[0] // 2
    slope = np.zeros(slow_time.size)
    for path in collection.flight(errors.smooth(), slow_time).paths:
        for pixel, sign in ((line[middle + 1], 1), (line[middle - 1], -1)):
            slope += sign * np.linalg.norm(pixel - path.measured, axis=1) / 2
    lines = collection.range_lines(errors)
    carrier = (lines.carrier(line[middle + 1]) - lines.carrier(line[middle - 1])) / 2
    frequency: Floats = (slope - carrier) / collection.wavelength
    return frequency
