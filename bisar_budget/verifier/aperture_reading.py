"""A chip read for each part of the aperture: the phase that an error leaves there, taken from the image.

Every pulse contributes to every pixel what exact ranges by the measured paths say. A polynomial of the phase over the
aperture is fitted to the pixels themselves, so that the ends of the patch, where a finite image cuts sidelobes off,
count as what they are. The fit starts where exact ranges put the response. What it leaves over of the image says
whether the polynomial is the image's; if not, the image is correlated with each pulse's contribution. That gives the
pulse's phase: the projection of the spectrum to slow time, with range walk and bent lines as they are. The error-free
response, formed and read by the same paths, takes out what is common to both.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.geometry import GroundVector
from bisar_budget.ranges.exact_ranges import ExactEffect
from bisar_budget.simulator.autofocus import Focused
from bisar_budget.simulator.collection import (
    CELLS,
    CONTRIBUTIONS,
    OVERSAMPLING,
    Chip,
    PointCollection,
    pulses_for,
)
from bisar_budget.simulator.image_formation import taylor_window
from bisar_budget.simulator.impulse_response import place_of_peak
from bisar_budget.simulator.phase_history import Complexes, Errors, Floats, cell_centres

READ_CELLS = 1  # of range that a chip needs around the middle line, beside what a response walks
_STRIDE = 2  # lines from one that is read to the next
_INNER = 0.95  # of the aperture, in the correlation; its edges ring in a patch of finite extent
# Order of the polynomial: a turn of ±0.5 rad shows sixth powers; continued to what a patch does not hold, high ones
# are worth nothing.
_ORDERS = ((0.9, 6), (0.6, 3), (-1.0, 2))
_PRESENT = 0.25  # of the median strength over the aperture; less is smeared out of the patch
_WALKS = 2  # fits, the range walk being that of the fit before
_REFINEMENTS, _HALVINGS, _SETTLED_RAD = 20, 6, 1e-5
# Of an image's norm, which is the phase's rms: less left over, and the polynomial is the image's; is it for sure, a
# quarter of the 0.02 rad that a measured phase may be off.
_REPRODUCED, _EXACT = 0.05, 5e-3
_BLOCK = 1 << 18  # contributions formed at once
_SUPPORT = 0.4  # of the largest error-free spectral magnitude; the band's edges ring in a finite image
_TIMES = 64  # read from the lines' spectra at once
_KERNEL = np.linspace(0, 64, 4097)  # range cells, of a tapered range response


class ApertureReading(NamedTuple):
    """Phases at the aperture edge, signed like the range error [rad].

    `across_pixels` is how far the response lies from the middle along y′, by the linear part of the phase.
    `walked_pixels` is what the other parts put the centre of gravity nearer along x′: at a frequency of y′ it lies
    where the range error less its slope times slow time puts it. `coverage` is what the patch holds of the aperture,
    1 unless a smear leaves it.
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
    beside: int = 0,
    expected: ExactEffect | None = None,
) -> ApertureReading:
    """Read quadratic and cubic phase of a response.

    Parameters
    ----------
    collection, errors
        Those that formed the chips; the errors are of the measured paths.
    centre : (2,) float
        Middle of the chips and place of the reference. [m]
    chip, reference : Chip
        With and without error, on the same pixels.
    beside : int
        Lines on either side of the middle one that are read too.
    expected : ExactEffect, optional
        Where the fit starts. If no polynomial near it reproduces the pixels, what single pulses say is tried too.

    Raises
    ------
    ValueError
        The response is not in the image.
    """
    lines, columns = chip.image.shape
    middle = lines // 2
    half = min(middle, lines - 1 - middle, beside) // _STRIDE * _STRIDE
    rows = slice(middle - half, middle + half + 1, _STRIDE)
    slow_time = cell_centres(collection.aperture_time, pulses_for(round(columns / OVERSAMPLING)))
    pixels = chip.grid[rows].reshape(-1, 3)
    images = [one.image[rows] for one in (chip, reference)]
    fitting = _Fitting(collection, errors, centre, pixels, slow_time, images, bool(beside))
    best, covered = _Refined(np.zeros(4), math.inf), 1.0
    if expected is not None:
        best = fitting.refined(np.array([0.0, 0.0, -expected.quadratic / 1.5, -expected.cubic / 2.5]))
    if best.misfit >= _EXACT:
        by_pulses, covered = _fit_to_pulses(_Pixels(collection, errors, centre, pixels), slow_time, images, columns)
        if expected is None and not covered:
            raise ValueError("the response is not in the image")
        best = min(best, fitting.refined(by_pulses), key=lambda one: one.misfit)
        if best.misfit < _REPRODUCED:
            covered = 1.0
        elif covered:
            best = _Refined(by_pulses, best.misfit)
        else:
            raise ValueError("the response is not in the image")
    fit = best.fit
    # A pixel along y′ changes the range sum over the aperture by λ / OVERSAMPLING, twice its P₁ part.
    turn = 1 if collection.range_lines(errors).turns_left(centre) else -1
    across = -turn * OVERSAMPLING / math.pi * float(fit[1])
    place = 2 * slow_time / collection.aperture_time
    slope = np.polynomial.legendre.legder([0.0, 0.0, *fit[2:]])
    mean = float(np.mean(place * np.polynomial.legendre.legval(place, slope)))
    radar = collection.radar
    by_range = collection.range_lines(errors).gradients(np.asarray(centre, dtype=float))[0]
    lines_per_cell = collection.range_cell / (float(np.hypot(*by_range)) * chip.spacing[0])
    # Range cells that a wavelength of range error walks: the bandwidth over the centre frequency.
    walked = mean / (2 * math.pi) * (radar.bandwidth / radar.center_frequency) * lines_per_cell
    # The image's phase is −2π/λ times the range error; P₂ = (3t² - 1)/2, P₃ = (5t³ - 3t)/2.
    return ApertureReading(float(-1.5 * fit[2]), float(-2.5 * fit[3]), across, -walked, min(1.0, covered * 1.02))


class _Pixels:
    """Pixels (n, 3) of an image, and what each pulse adds to them of a point at a place."""

    def __init__(self, collection: PointCollection, errors: Errors, centre: GroundVector, pixels: Floats) -> None:
        self.collection, self.errors, self.places = collection, errors.smooth(), pixels
        self.point = np.array([[*centre, 0.0]])
        lines = collection.range_lines(errors)
        self.carrier = lines.carrier(pixels) - lines.carrier(self.point[0, :2])
        self.squares = _squares(pixels)
        if collection.is_tapered:
            weights, frequency = taylor_window(257), cell_centres(1.0, 257)
            self.kernel = np.cos(2 * math.pi * np.outer(_KERNEL, frequency)) @ weights / 257

    def contributions(self, slow_time: Floats, left: Floats | None = None) -> NDArray[np.complex64]:
        """Contributions of pulses (m,) to pixels (n,), (m, n), at baseband.

        `left` (m,) is a range error that displaces the range responses, and has no part in the phase. [m]
        """
        collection = self.collection
        paths = collection.flight(self.errors, slow_time).paths
        if collection.is_tapered:  # over the aperture too
            fine = taylor_window(1024)
            by_time = np.interp(slow_time, cell_centres(collection.aperture_time, fine.size), fine)[:, None]
        contribution = np.empty((slow_time.size, self.places.shape[0]), dtype=np.complex64)
        pulses = max(1, _BLOCK // self.places.shape[0])
        for start in range(0, slow_time.size, pulses):
            part = slice(start, start + pulses)
            farther = np.zeros(contribution[part].shape)
            for one in paths:
                farther += _distance(one.measured[part], self.places, self.squares)
                farther -= _distance(one.measured[part], self.point, _squares(self.point))
            # Whole cycles are taken off in double precision; of what is left single precision holds 1e-6 rad, in a
            # quarter of the time.
            cycles = (farther - self.carrier) / collection.wavelength
            cycles -= np.rint(cycles)
            turned = (2 * math.pi * cycles).astype(np.float32)
            if left is not None:
                farther -= left[part, None]
            cells = (farther * (collection.radar.bandwidth / SPEED_OF_LIGHT)).astype(np.float32)
            if collection.is_tapered:
                strength = np.interp(np.abs(cells), _KERNEL, self.kernel, right=0.0) * by_time[part]
            else:
                strength = np.sinc(cells)
            np.multiply(np.cos(turned), strength, out=contribution[part].real)
            np.multiply(np.sin(turned), strength, out=contribution[part].imag)
        return contribution


def _squares(points: Floats) -> Floats:
    found: Floats = np.einsum("ij,ij->i", points, points)
    return found


def _distance(positions: Floats, points: Floats, squares: Floats) -> Floats:
    """From positions (m, 3) to points (n, 3), their squares known, (m, n): to 1e-8 m from geostationary orbit. [m]"""
    square: Floats = positions @ (-2 * points.T)
    square += _squares(positions)[:, None]
    square += squares
    return np.sqrt(square, out=square)


def _fit_to_pulses(
    every: _Pixels, slow_time: Floats, images: Sequence[Complexes], columns: int
) -> tuple[Floats, float]:
    """A polynomial through the phases of single pulses, and its share of the aperture: 0 without its middle.

    `images` are with and without error, of the same pixels.
    """
    place = 2 * slow_time / every.collection.aperture_time
    # The ends of a line, half the cells of a response without smear, fade.
    inside = np.minimum(np.arange(columns) + 0.5, columns - np.arange(columns) - 0.5)
    taper = np.sin(math.pi / 2 * np.clip(inside / round(CELLS * OVERSAMPLING / 2), 0, 1)) ** 2
    tapered = np.stack([(one * taper).reshape(-1) for one in images])
    correlated = np.empty((2, slow_time.size), dtype=complex)
    block = max(1, _BLOCK // every.places.shape[0])
    for start in range(0, slow_time.size, block):
        part = slice(start, start + block)
        correlated[:, part] = tapered @ every.contributions(slow_time[part]).conj().T
    seen, clean = correlated
    strength = np.abs(seen) / np.maximum(np.abs(clean), 1e-30)
    inner = np.abs(place) < _INNER
    present = strength > _PRESENT * np.median(strength[inner])
    middle = place.size // 2
    if not np.isfinite(strength).all():
        raise ValueError("the response is not in the image")
    if not present[middle]:
        return np.zeros(4), 0.0
    gaps = np.nonzero(~(present & inner))[0]
    first = int(gaps[gaps < middle].max(initial=-1)) + 1
    last = int(gaps[gaps > middle].min(initial=place.size))
    if last - first <= _ORDERS[0][1]:  # too few pulses for a polynomial
        return np.zeros(4), 0.0
    kept = slice(first, last)
    covered = float(place[last - 1] - place[first]) / (2 * _INNER)
    order = next(order for part, order in _ORDERS if covered > part)
    phase = np.unwrap(np.angle((seen * clean.conj())[kept]))
    fit = np.zeros(max(4, order + 1))
    fit[: order + 1] = np.polynomial.legendre.legfit(place[kept], phase, order, w=np.abs(clean[kept]))
    return fit, covered


@dataclass(frozen=True, slots=True, eq=False)
class _Refined:
    """Polynomial of the phase, and what of the image it leaves over, of its norm."""

    fit: Floats
    misfit: float


class _Fitting:
    """Fits of the phase's polynomial to some pixels of an image: of a large one they are enough."""

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
        some = slice(None, None, -(-pixels.shape[0] * slow_time.size // CONTRIBUTIONS))
        self.seen, clean = (one.reshape(-1)[some] for one in images)
        self.few = _Pixels(collection, errors, centre, pixels[some])
        self.slow_time, self.fits = slow_time, _WALKS if walks else 1
        at_rest = self.few.contributions(slow_time).sum(axis=0)
        self.gain = complex(np.vdot(at_rest, clean) / np.vdot(at_rest, at_rest))

    def refined(self, fit: Floats) -> _Refined:
        """Refine a polynomial, the range walk being that of the fit before."""
        collection = self.few.collection
        place = 2 * self.slow_time / collection.aperture_time
        found = _Refined(np.pad(fit, (0, _ORDERS[0][1] + 1 - fit.size)), math.inf)
        for _ in range(self.fits):
            # What is left of the range error takes a pulse to other range cells too.
            phase = np.polynomial.legendre.legval(place, [0.0, *found.fit[1:]])
            left = -collection.wavelength / (2 * math.pi) * phase
            single = self.few.contributions(self.slow_time, left)
            found = _refined(found.fit, place, single.astype(np.complex128), self.seen, self.gain)
        return found


def _refined(fit: Floats, place: Floats, contribution: Complexes, seen: Complexes, gain: complex) -> _Refined:
    """Fit the phase's polynomial to the pixels, by Gauss and Newton; a step that makes it worse is shortened."""
    legendre = np.polynomial.legendre.legvander(place, fit.size - 1)
    norm = float(np.linalg.norm(seen))

    def left_by(coefficients: Floats) -> tuple[Complexes, float, Complexes]:
        pulses = gain * np.exp(1j * (legendre @ coefficients))
        model = pulses @ contribution
        # The constant phase is free: what it takes is known at once.
        turn = np.angle(np.vdot(model, seen))
        pulses, model = pulses * np.exp(1j * turn), model * np.exp(1j * turn)
        amplitude = float(abs(np.vdot(model, seen)) / np.real(np.vdot(model, model)))
        return seen - amplitude * model, amplitude, pulses

    found = fit.copy()
    left, amplitude, pulses = left_by(found)
    for _ in range(_REFINEMENTS):
        columns = contribution.T @ (1j * amplitude * pulses[:, None] * legendre)
        both = np.concatenate((columns.real, columns.imag))
        step = np.linalg.lstsq(both, np.concatenate((left.real, left.imag)), rcond=1e-6)[0]
        for _ in range(_HALVINGS):
            ahead = left_by(found + step)
            if np.linalg.norm(ahead[0]) <= np.linalg.norm(left):
                break
            step = step / 2
        else:
            break
        found = found + step
        left, amplitude, pulses = ahead
        if np.abs(step[1:]).max() < _SETTLED_RAD:
            break
    return _Refined(found, float(np.linalg.norm(left)) / norm)


# ---------------------------------------------------------------------- displacement
@dataclass(frozen=True, slots=True)
class Shift:
    """Displacement on the ground (east, north) [m], azimuth of the line of smear, 0 to π [rad].

    `pixels` is the displacement along x′ and y′ of the image.
    """

    displacement: GroundVector
    smear_azimuth: float
    pixels: tuple[float, float]


def measured_shift(chip: Chip, reference: Chip, reading: ApertureReading | None = None) -> Shift:
    """Displacement of a response against an error-free one on the same grid, and the line of its smear.

    The displacement is where the image peaks. A response that is smeared so much that it has no one peak says it by a
    `reading` of its aperture: by the slope of the phase along y′, and by the centre of gravity along x′ less what the
    other parts of the phase move that by.

    Each part of the aperture sees the point at a place of its own, as (26) to (28) of Rigling & Moses have it for
    three parts. In the spectrum of the image that place is the gradient of the phase against an error-free response:
    its spread is the smear. That holds for a smear far smaller than a resolution cell, where the outline of the
    response shows nothing yet.

    Raises
    ------
    ValueError
        The spectra share no support: one of the two is not in the image.
    """
    spectra = [np.fft.fftshift(np.fft.fft2(one.image)) for one in (chip, reference)]
    product = spectra[0] * np.conj(spectra[1])
    strength = np.abs(spectra[1])
    inside = strength > _SUPPORT * strength.max()
    inside[:-1, :-1] &= inside[1:, :-1] & inside[:-1, 1:]
    inside[-1], inside[:, -1] = False, False
    if not inside.any():
        raise ValueError("the response is not in the image")
    steps = [_step(product, axis)[inside] for axis in (0, 1)]
    weights = np.abs(product[inside])
    # A shift by d turns the spectrum by −2π·d/extent from one frequency to the next.
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
    """One pixel along each axis at the middle of the grid, as columns (east, north), (2, 2). [m]"""
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
    half: int,
) -> Chip:
    """Estimate one phase over the aperture on some lines of a chip and take it out of all.

    Along a line of equal range a pulse has the frequency that the measured paths give it. Over a long aperture, or
    where range and Doppler gradients are nearly parallel, equal times take up unequal parts of that band: a quadratic
    phase in time is none in frequency, and what a few per cent of the band hold of the aperture is lost to an
    estimate. The lines' spectra are therefore read at equal times, focused there, and the phase is taken back to
    their frequencies. So many lines on either side of the middle one are used.
    """
    lines, columns = chip.image.shape
    slow_time = cell_centres(collection.aperture_time, max(64, round(columns / OVERSAMPLING)))
    frequency = _frequency(collection, errors, centre, chip, slow_time)
    step = np.gradient(frequency)
    if not (step > 0).all() and not (step < 0).all():
        raise ValueError("Doppler along the line does not change one way over the aperture: autofocus has no band")
    middle = lines // 2
    used = chip.image[middle - half : middle + half + 1]
    place = np.arange(columns) - columns // 2
    aperture = np.empty((used.shape[0], slow_time.size), dtype=complex)
    for start in range(0, slow_time.size, _TIMES):
        part = slice(start, start + _TIMES)
        aperture[:, part] = used @ np.exp(-2j * math.pi * np.outer(place, frequency[part]))
    aperture *= np.abs(step)
    # As an image of its own, sampled like the chip: the aperture in the middle of a band.
    count = slow_time.size
    samples = math.ceil(OVERSAMPLING * count)
    spectrum = np.zeros((used.shape[0], samples), dtype=complex)
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
    """Frequency of each pulse along the middle of a line, the carrier's taken out, (times,). [cycles/pixel]"""
    line = chip.grid[chip.grid.shape[0] // 2]
    middle = line.shape[0] // 2
    slope = np.zeros(slow_time.size)
    for one in collection.flight(errors.smooth(), slow_time).paths:
        for pixel, sign in ((line[middle + 1], 1), (line[middle - 1], -1)):
            slope += sign * np.linalg.norm(pixel - one.measured, axis=1) / 2
    lines = collection.range_lines(errors)
    carrier = (lines.carrier(line[middle + 1]) - lines.carrier(line[middle - 1])) / 2
    frequency: Floats = (slope - carrier) / collection.wavelength
    return frequency
