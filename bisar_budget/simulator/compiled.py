"""Parallel backprojection compiled by Numba, which needs the extra `fast`.

Import this module only in code that handles the `ImportError` of a missing Numba.

Range profiles are upsampled so finely that a cubic B-spline, which has four taps, can interpolate them. The spectrum
is divided by the transform of the spline, which is known in closed form. On a lattice of pixels, each line is divided
into segments of 32 pixels. The range is computed exactly in the middle of a segment, and expanded to fourth order
along the segment. For pixels that are not on a lattice, the range is computed exactly at each pixel. Whole cycles and
whole samples are removed in double precision or in integers, and only the remaining fractions are in single
precision. The accuracy therefore does not depend on the position of the scene or on the wavelength.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numba import njit, prange
from numpy.polynomial import Chebyshev, Polynomial

from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.simulator.image_formation import (
    PROFILE_BYTES,
    carrier_frequency,
    cells_per_metre,
    harmonics,
    profile_length,
    range_profiles,
)
from bisar_budget.simulator.phase_history import Complexes, Floats, PhaseHistory

_SEGMENT_LENGTH = 32  # pixels in one expansion; they fill two or four vector registers of a processor
_RUN_LENGTH = 64  # scattered pixels whose ranges are bounded together
_TILE_ROWS = 16  # lines of one tile; the part of a pulse that a tile reads stays in a processor's first cache
_FFT_OVERSAMPLING_FACTOR = 2  # oversampling of profiles that the FFT gives
_KERNEL_SAMPLES = 8  # width of the kernel that refines profiles; its error is -140 dB at this oversampling
_REFINEMENT_FACTOR = 8  # refined samples per sample from the FFT
_BSPLINE_ORDER = 3  # the spline has one tap more
_RANGE_MARGIN_SAMPLES = 8  # samples beyond the last pixel on each side
_BLOCK_BYTES = 24e6  # size of the profiles in memory at once, about that of a processor's last cache
_MAX_SAMPLES_PER_PIXEL = 8  # with more, refining takes longer than reading each pixel with the kernel itself
_MAX_NEGLECTED_RAD = 1e-6  # phase of the first neglected order of the expansion
_LATTICE_TOLERANCE_FRACTION = 1e-8  # largest distance of a pixel from the lattice, as a fraction of a wavelength


# Multiply-adds may be fused. Operations are not reordered, and NaN and infinity are preserved. Division by zero gives
# infinity as in NumPy, because a check for it would prevent the vectorisation of loops.
_compiled = njit(cache=True, fastmath={"contract"}, error_model="numpy")
_parallel = njit(cache=True, fastmath={"contract"}, error_model="numpy", parallel=True)
_F = np.float32
_I = np.int32
_COUNTS_PER_CYCLE = 2.0**32  # a cycle in 32 bits, so that integer arithmetic drops whole cycles


class Lattice(NamedTuple):
    """Lattice of evenly spaced pixels at `origin` + i·`across` + j·`along`.

    `origin`, `across` and `along` [m] are vectors (3,). `shape` holds the number of values of i and the number of
    values of j.
    """

    origin: Floats
    across: Floats
    along: Floats
    shape: tuple[int, int]

    def disc(self) -> tuple[Floats, float]:
        """Centre (3,) and radius of a disc that contains all pixels. [m]

        Each line is extended to a whole number of segments; the disc also contains the pixels that are added for
        this.
        """
        i, j = (self.shape[0] - 1) / 2, (-(-self.shape[1] // _SEGMENT_LENGTH) * _SEGMENT_LENGTH - 1) / 2
        centre = self.origin + i * self.across + j * self.along
        corners = (i * self.across + j * self.along, i * self.across - j * self.along)
        return centre, max(float(np.linalg.norm(corner)) for corner in corners)


def lattice_of(points: Floats, tolerance: float) -> Lattice | None:
    """Recognise evenly spaced pixels, and return their lattice.

    Parameters
    ----------
    points : (..., 3) ndarray
        Positions of the pixels. [m]
    tolerance : float
        Largest accepted distance of a pixel from its place on the lattice. [m]

    Returns
    -------
    Lattice or None
        Lattice of the points. None if their shape is neither (n, 3) nor (nx, ny, 3), or if they are empty or not
        evenly spaced.
    """
    if points.ndim not in (2, 3) or points.size == 0:
        return None
    grid = points.reshape((-1, *points.shape[-2:]))
    lines, count = grid.shape[:2]
    origin = grid[0, 0]
    across = (grid[-1, 0] - origin) / max(1, lines - 1)
    along = (grid[0, -1] - origin) / max(1, count - 1)
    first = origin + np.arange(count)[:, None] * along
    for top in range(0, lines, _TILE_ROWS):  # a few lines at a time, to avoid a second copy of the grid
        rows = grid[top : top + _TILE_ROWS]
        line = np.arange(top, top + rows.shape[0])[:, None, None]
        if not np.abs(rows - first - line * across).max() <= tolerance:
            return None
    return Lattice(origin, across, along, (lines, count))


def backproject(history: PhaseHistory, points: Floats) -> Complexes | None:
    """Form an image by backprojection, as in `image_formation.backprojection`. All inputs must be finite.

    Parameters
    ----------
    history : PhaseHistory
        Phase history; its frequencies must be evenly spaced.
    points : (..., 3) ndarray
        Positions of the pixels [m]. The computation is fastest if they are on a lattice.

    Returns
    -------
    (...) ndarray or None
        Complex image. The result is None if refined range profiles are not worthwhile: a few pixels need more than a
        full period of each profile, and the refinement would either take longer than computing each pixel separately
        or need more memory than a block of profiles.
    """
    shape = points.shape[:-1]
    image = np.zeros(shape, dtype=complex)
    if not image.size or not history.samples.size:
        return image
    lattice = lattice_of(points, _LATTICE_TOLERANCE_FRACTION * SPEED_OF_LIGHT_MPS / float(history.frequency.max()))
    if lattice is not None and lattice.shape[0] > lattice.shape[1]:
        origin, across, along, (lines, count) = lattice  # long lines fill whole segments
        lattice = Lattice(origin, along, across, (count, lines))
        shape = shape[::-1]
    within = None
    if lattice is not None and _neglected_phase(history, lattice) < _MAX_NEGLECTED_RAD:
        centre, radius = lattice.disc()
        middle = np.linalg.norm(history.transmitter - centre, axis=1)
        middle = middle + np.linalg.norm(history.receiver - centre, axis=1)
        # Neither leg's range changes faster than the pixel moves.
        within = _needed(history, middle - 2 * radius, middle + 2 * radius, image.size)
    if lattice is not None and within is not None:
        padded = np.zeros(
            (lattice.shape[0], -(-lattice.shape[1] // _SEGMENT_LENGTH) * _SEGMENT_LENGTH), dtype=complex
        )
        for block in _profile_blocks(history, within):
            _add_lattice(*block, lattice.origin, lattice.across, lattice.along, padded)
        image = padded[:, : lattice.shape[1]].reshape(shape)
        image = np.ascontiguousarray(image if shape == points.shape[:-1] else image.T)
    else:
        axes = np.ascontiguousarray(points.reshape(-1, 3).T)
        by_line = points.reshape(-1, *np.atleast_2d(points).shape[-2:])
        nearest, farthest = _reach(history.transmitter, history.receiver, *_boxes(by_line))
        within = _needed(history, nearest, farthest, image.size)
        if within is None:
            return None
        for block in _profile_blocks(history, within):
            _add_points(*block, axes, image.reshape(-1))
    image /= history.samples.size
    return image


def _neglected_phase(history: PhaseHistory, lattice: Lattice) -> float:
    """Upper bound of the fifth-order phase that the expansion of ranges over half a segment neglects. [rad]

    In the expansion of |r + x·e|/|r| in powers of x/|r|, the n-th coefficient is (P_{n-2} - P_n)/(2n - 1), where P_n
    is the Legendre polynomial of the cosine of the angle between r and the unit vector e. The result is infinite if a
    platform is too near for the expansion to converge fast enough.
    """
    centre, radius = lattice.disc()
    half = _SEGMENT_LENGTH / 2 * float(np.linalg.norm(lattice.along))
    total = 0.0
    for positions in (history.transmitter, history.receiver):
        nearest = float(np.linalg.norm(positions - centre, axis=1).min()) - radius
        if nearest <= 2 * half:  # the expansion does not converge fast enough
            return math.inf
        total += 2 / 9 * half**5 / nearest**4
    return 2 * math.pi * float(history.frequency.max()) / SPEED_OF_LIGHT_MPS * total


class _Block(NamedTuple):
    """Refined range profiles of a block of pulses, with platform positions and the constants for interpolation.

    `profiles` is (pulses, samples). A sample is a 64-bit integer that contains the real and the imaginary part in
    single precision. `transmitter` and `receiver` (pulses, 3) [m] are the measured positions. `reference` (pulses,)
    [m] is the range sum of the scene centre.
    """

    profiles: np.ndarray[tuple[int, int], np.dtype[np.int64]]
    first: Floats  # position of each profile's first sample, in samples
    transmitter: Floats
    receiver: Floats
    reference: Floats
    cells_per_metre: float
    cycles_per_metre: float


class _Needed(NamedTuple):
    """Part of each range profile that is needed for the pixels.

    `first` is the index of the first sample of this part, (pulses,). `samples` is its number of samples.
    """

    first: np.ndarray[tuple[int], np.dtype[np.int64]]
    samples: int


def _needed(history: PhaseHistory, nearest: Floats, farthest: Floats, pixels: int) -> _Needed | None:
    """Part of each range profile that is needed for pixels with range sums from `nearest` to `farthest`.

    Both range sums are (pulses,) [m]. `pixels` is the number of pixels. The result is None if the part has too many
    samples for so few pixels. A profile is periodic, so if the part is longer than the profile, its samples repeat.
    """
    length = profile_length(history, _FFT_OVERSAMPLING_FACTOR)
    per_metre = cells_per_metre(history, length)
    count = float((farthest - nearest).max()) * per_metre + 2 * _RANGE_MARGIN_SAMPLES + 1
    if count > max(
        length + 4 * _RANGE_MARGIN_SAMPLES,
        min(_MAX_SAMPLES_PER_PIXEL * pixels, _BLOCK_BYTES / 2 / (8 * _REFINEMENT_FACTOR)),
    ):
        return None
    return _Needed(
        np.floor((nearest - _reference(history)) * per_metre).astype(np.int64) - _RANGE_MARGIN_SAMPLES, int(count)
    )


def _reference(history: PhaseHistory) -> Floats:
    """Range sum of the scene centre at each pulse, for the measured positions, (pulses,). [m]"""
    total = np.zeros(history.slow_time.size)
    for positions in (history.transmitter, history.receiver):
        total += np.linalg.norm(positions, axis=1)
    return total


def _kernel(offset: Floats) -> Floats:
    """Interpolation kernel that refines range profiles: an exponential of a semicircle, 1 at the centre.

    `offset` [samples] is the distance from the centre. The kernel is meant for offsets within ±_KERNEL_SAMPLES/2.

    Source: Barnett, Magland & af Klinteberg, "A parallel non-uniform fast Fourier transform library based on an
    'exponential of semicircle' kernel", 2019. The shape parameter is the value that the authors give for this
    oversampling.
    """
    shape = 0.976 * math.pi * _KERNEL_SAMPLES * (1 - 1 / (2 * _FFT_OVERSAMPLING_FACTOR))
    return np.exp(shape * (np.sqrt(np.clip(1 - (2 * offset / _KERNEL_SAMPLES) ** 2, 0.0, None)) - 1))


def _kernel_transform(angle: Floats) -> Floats:
    """Fourier transform of `_kernel` at angular frequencies in radians per sample, by Gauss-Legendre quadrature."""
    nodes, weights = np.polynomial.legendre.leggauss(64)
    offset = nodes * _KERNEL_SAMPLES / 2
    transform: Floats = np.cos(np.outer(angle, offset)) @ (weights * _kernel(offset)) * _KERNEL_SAMPLES / 2
    return transform


def _profile_blocks(history: PhaseHistory, needed: _Needed) -> Iterator[_Block]:
    """Refine the part of each profile that is needed for the pixels, in blocks of as many pulses as fit into a cache.

    The part is determined from the pixels and not from a sphere around the patch. A resolution cell may be a hundred
    times longer than wide, and a sphere around such cells would need many more samples. All blocks share the same
    memory, so a block must be used before the next is requested.
    """
    length, factor, order = (
        profile_length(history, _FFT_OVERSAMPLING_FACTOR),
        _REFINEMENT_FACTOR,
        _BSPLINE_ORDER,
    )
    coarse = cells_per_metre(history, length)
    harmonic = harmonics(history)
    transform = _kernel_transform(2 * math.pi * harmonic / length)
    transform = transform * np.sinc(harmonic / (length * factor)) ** (order + 1)
    # Kernel weights of all taps, for each refined position between two samples.
    offset = np.arange(factor) / factor - (np.arange(_KERNEL_SAMPLES)[:, None] - _KERNEL_SAMPLES // 2 + 1)
    weights = _kernel(offset).astype(np.float32)
    reference = _reference(history)
    first, count = needed
    pulses = min(history.slow_time.size, max(1, int(_BLOCK_BYTES / (8 * count * factor + PROFILE_BYTES * length))))
    buffer = np.empty(
        (pulses, 2 * count * factor), dtype=np.float32
    )  # all blocks share it, because each block is used before the next is computed
    for start in range(0, history.slow_time.size, pulses):
        pulse_block = slice(start, start + pulses)
        profiles = range_profiles(history, length, transform, pulse_block)
        refined = buffer[: profiles.shape[0]]
        _refine(profiles, first[pulse_block], weights, refined)
        yield _Block(
            refined.view(np.int64),
            first[pulse_block].astype(np.float64) * factor,
            history.transmitter[pulse_block],
            history.receiver[pulse_block],
            reference[pulse_block],
            coarse * factor,
            carrier_frequency(history) / SPEED_OF_LIGHT_MPS,
        )


@_parallel
def _refine(profiles, first, weights, refined):
    """Interpolate periodic range profiles to a finer sampling, and write the result to `refined`.

    `first` is the index of the first needed sample of each profile. `weights` (taps, positions) are the kernel
    weights for each finer position between two samples. Real and imaginary parts alternate in `refined`.
    """
    length, factor = profiles.shape[1], weights.shape[1]
    count = refined.shape[1] // (2 * factor)
    for pulse in prange(profiles.shape[0]):
        real, imag = np.empty(count + _KERNEL_SAMPLES, np.float32), np.empty(count + _KERNEL_SAMPLES, np.float32)
        for n in range(count + _KERNEL_SAMPLES):
            sample = profiles[pulse, (first[pulse] + n - _KERNEL_SAMPLES // 2 + 1) % length]
            real[n], imag[n] = _F(sample.real), _F(sample.imag)
        for n in range(count):
            for position in range(factor):
                re = im = _F(0)
                for tap in range(_KERNEL_SAMPLES):
                    re += real[n + tap] * weights[tap, position]
                    im += imag[n + tap] * weights[tap, position]
                refined[pulse, 2 * (n * factor + position)] = re
                refined[pulse, 2 * (n * factor + position) + 1] = im


# sin(πx)/x and cos(πx) as polynomials of x², for |x| up to slightly more than ½.
_SINE = tuple(
    Chebyshev.interpolate(lambda z: math.pi * np.sinc(np.sqrt(z)), 4, domain=[0, 0.27]).convert(kind=Polynomial).coef
)
_COSINE = tuple(
    Chebyshev.interpolate(lambda z: np.cos(math.pi * np.sqrt(z)), 4, domain=[0, 0.27]).convert(kind=Polynomial).coef
)
_S0, _S1, _S2, _S3, _S4 = (np.float32(c) for c in _SINE)
_C0, _C1, _C2, _C3, _C4 = (np.float32(c) for c in _COSINE)


@_compiled
def _phasor(cycles):
    """Return the real and the imaginary part of exp(2πj·cycles) in single precision.

    It is computed as the square of exp(πj·cycles). |cycles| may slightly exceed ½.
    """
    z = cycles * cycles
    sine = cycles * (_S0 + z * (_S1 + z * (_S2 + z * (_S3 + z * _S4))))
    cosine = _C0 + z * (_C1 + z * (_C2 + z * (_C3 + z * _C4)))
    return cosine * cosine - sine * sine, _F(2) * sine * cosine


@_compiled
def _expand(middle, platform, along, ranges):
    """Add the range of one platform to `ranges`, as an expansion to fourth order along each segment of pixels.

    `middle` (3, segments) [m] holds the midpoints of the segments, and `along` [m] is the vector from pixel to pixel.
    Row 0 of `ranges` (5, segments) is the range [m] at the midpoint. Row n, for n from 1 to 4, is the coefficient
    [m/pixelⁿ] of the n-th power of the distance from the midpoint in pixels.
    """
    px, py, pz = platform[0], platform[1], platform[2]
    ex, ey, ez = along[0], along[1], along[2]
    square = ex * ex + ey * ey + ez * ez
    for i in range(ranges.shape[1]):
        x, y, z = middle[0, i] - px, middle[1, i] - py, middle[2, i] - pz
        distance = np.sqrt(x * x + y * y + z * z)
        inverse = 1 / distance
        g = (x * ex + y * ey + z * ez) * inverse
        s = (square - g * g) * inverse
        ranges[0, i] += distance
        ranges[1, i] += g
        ranges[2, i] += s / 2
        ranges[3, i] -= g * s * inverse / 2
        ranges[4, i] += s * inverse * inverse * (5 * g * g - square) / 8


@_compiled
def _split(ranges, per_metre, first, cycles, whole_samples, fraction, turn, order):
    """Split the ranges of segments into whole and fractional profile samples, and into fractions of carrier cycles.

    `ranges` holds the coefficients from `_expand`. Row 0 of `whole_samples` and `fraction` is the sample at the
    middle of a segment; row 1 is the number of samples per pixel. The range in carrier cycles is a polynomial in the
    distance from the middle of a segment in pixels: `turn` holds its coefficients 0 to 2, without whole cycles, as
    integers in units of 2⁻³² cycles, and `order` holds its coefficients 2 to 4 in cycles. Coefficient 2 is in both
    arrays, because `order` is also used to compute sample positions. All results are computed in double precision.
    """
    for i in range(ranges.shape[1]):
        cell, step = ranges[0, i] * per_metre - first, ranges[1, i] * per_metre
        whole_samples[0, i], whole_samples[1, i] = _I(np.floor(cell)), _I(np.rint(step))
        fraction[0, i], fraction[1, i] = _F(cell - np.floor(cell)), _F(step - np.rint(step))
    for n in range(3):
        for i in range(ranges.shape[1]):
            c = ranges[n, i] * cycles
            turn[n, i] = _I(np.int64((c - np.rint(c)) * _COUNTS_PER_CYCLE))
            order[n, i] = _F(ranges[n + 2, i] * cycles)


# Each of the loops below works on a full tile: line by line, calls and the counting of references to arrays would
# cost a third of the time.


@_compiled
def _sample_points(whole_samples, fraction, turn, order, cells_per_cycle, index, between, cycles):
    """Compute the position of each pixel in a range profile, and the carrier cycles of the pixel.

    The results are written to `index`, `between` and `cycles`, each (segments, pixels). `index` is the last profile
    sample before the pixel, and `between` is the distance from there in samples. The inputs are the results of
    `_split`. The carrier cycles are a polynomial in the distance from the middle of the segment in pixels. Its terms
    up to the quadratic are computed in integers, and its cubic and quartic terms in single precision.
    """
    for i in range(between.shape[0]):
        base, step, start, slope = whole_samples[0, i], whole_samples[1, i], fraction[0, i], fraction[1, i]
        c0, c1, c2 = turn[0, i], turn[1, i], turn[2, i]
        p2, p3, p4 = order[0, i], order[1, i], order[2, i]
        for j in range(_SEGMENT_LENGTH):
            k = _I(j - _SEGMENT_LENGTH // 2)
            x = _F(k)
            bend = x * x * (p2 + x * (p3 + x * p4))
            t = start + x * slope + cells_per_cycle * bend
            floor = np.floor(t)
            between[i, j] = t - floor
            index[i, j] = _I(base + k * step + _I(floor))
            turned = _I(c0 + k * _I(c1 + k * c2))
            cycles[i, j] = _F(turned) * _F(1 / _COUNTS_PER_CYCLE) + x * x * x * (p3 + x * p4)


@_compiled
def _cubic(v):
    """Weights of a cubic B-spline for the samples -1, 0, 1 and 2, at a position `v` between samples 0 and 1."""
    u = _F(1) - v
    w0, w3 = u * u * u * _F(1 / 6), v * v * v * _F(1 / 6)
    w1 = _F(2 / 3) - v * v * (_F(1) - _F(0.5) * v)
    return w0, w1, _F(1) - w0 - w1 - w3, w3


# This loop is separate, because scattered loads would prevent the vectorisation of arithmetic in the same loop. All
# neighbours are read before the first is written, so that their loads can overlap.


@_compiled
def _fetch(profile, index, fetched):
    """Copy to `fetched` the four profile samples that are needed for the interpolation at each pixel."""
    for i in range(index.shape[0]):
        for j in range(_SEGMENT_LENGTH):
            n = np.uint64(np.uint32(index[i, j] - _I(1)))
            s0, s1 = profile[n], profile[n + np.uint64(1)]
            s2, s3 = profile[n + np.uint64(2)], profile[n + np.uint64(3)]
            fetched[i, 4 * j], fetched[i, 4 * j + 1], fetched[i, 4 * j + 2], fetched[i, 4 * j + 3] = s0, s1, s2, s3


@_compiled
def _add_taps(taps, between, cycles, real, imag):
    """Add the interpolated profile, multiplied by the phasor of the carrier, to each pixel."""
    for i in range(real.shape[0]):
        for j in range(_SEGMENT_LENGTH):
            cosine, sine = _phasor(cycles[i, j])
            w0, w1, w2, w3 = _cubic(between[i, j])
            t = 8 * j
            re = w0 * taps[i, t] + w1 * taps[i, t + 2] + w2 * taps[i, t + 4] + w3 * taps[i, t + 6]
            im = w0 * taps[i, t + 1] + w1 * taps[i, t + 3] + w2 * taps[i, t + 5] + w3 * taps[i, t + 7]
            real[i, j] += re * cosine - im * sine
            imag[i, j] += re * sine + im * cosine


@_parallel
def _add_lattice(profiles, first, transmitter, receiver, reference, per_metre, cycles, origin, across, along, image):
    """Add the contributions of a block of pulses to the pixels of a lattice, in tiles of line segments."""
    segments = image.shape[1] // _SEGMENT_LENGTH
    groups = (image.shape[0] + _TILE_ROWS - 1) // _TILE_ROWS
    cells_per_cycle = _F(per_metre / cycles)
    for tile in prange(segments * groups):
        top, left = tile // segments * _TILE_ROWS, tile % segments * _SEGMENT_LENGTH
        rows = min(_TILE_ROWS, image.shape[0] - top)
        real, imag = np.zeros((rows, _SEGMENT_LENGTH), np.float32), np.zeros((rows, _SEGMENT_LENGTH), np.float32)
        index, between = np.empty((rows, _SEGMENT_LENGTH), np.int32), np.empty((rows, _SEGMENT_LENGTH), np.float32)
        carrier = np.empty((rows, _SEGMENT_LENGTH), np.float32)
        fetched = np.empty((rows, 4 * _SEGMENT_LENGTH), np.int64)
        taps = fetched.view(np.float32)
        whole, fraction = np.empty((2, rows), np.int32), np.empty((2, rows), np.float32)
        turn, order = np.empty((3, rows), np.int32), np.empty((3, rows), np.float32)
        middle, ranges = np.empty((3, rows)), np.empty((5, rows))
        for axis in range(3):
            for i in range(rows):
                middle[axis, i] = (
                    origin[axis] + (top + i) * across[axis] + (left + _SEGMENT_LENGTH // 2) * along[axis]
                )
        for pulse in range(profiles.shape[0]):
            ranges[0] = -reference[pulse]
            ranges[1:] = 0.0
            _expand(middle, transmitter[pulse], along, ranges)
            _expand(middle, receiver[pulse], along, ranges)
            _split(ranges, per_metre, first[pulse], cycles, whole, fraction, turn, order)
            _sample_points(whole, fraction, turn, order, cells_per_cycle, index, between, carrier)
            _fetch(profiles[pulse], index, fetched)
            _add_taps(taps, between, carrier, real, imag)
        for i in range(rows):
            for j in range(_SEGMENT_LENGTH):
                image[top + i, left + j] += complex(real[i, j], imag[i, j])


@_compiled
def _sums(points, transmitter, receiver, reference, sums):
    """Write the range sum of each point to `sums`, relative to the range sum `reference` of the pulse. [m]

    `points` is (3, n).
    """
    tx, ty, tz = transmitter[0], transmitter[1], transmitter[2]
    rx, ry, rz = receiver[0], receiver[1], receiver[2]
    for i in range(sums.shape[0]):
        x, y, z = points[0, i] - tx, points[1, i] - ty, points[2, i] - tz
        u, v, w = points[0, i] - rx, points[1, i] - ry, points[2, i] - rz
        sums[i] = math.sqrt(x * x + y * y + z * z) + math.sqrt(u * u + v * v + w * w) - reference


def _boxes(lines: Floats) -> tuple[Floats, Floats]:
    """Boxes around runs of successive pixels of `lines` (lines, pixels, 3), used to bound the ranges of the pixels.

    A box is oriented along the horizontal direction from the first to the last pixel of its run. With boxes, it takes
    little time to find the part of a range profile that is needed for a patch. With all pixels, it would take as long
    as forming an image.

    Returns
    -------
    centres : (3, m) ndarray
        Centres of the boxes. [m]
    halves : (m, 3, 3) ndarray
        Half axes of each box: `halves[i, k]` is the vector of the k-th half axis of box i. [m]
    """
    starts = np.arange(0, lines.shape[1], _RUN_LENGTH)
    ends = np.minimum(starts + _RUN_LENGTH, lines.shape[1]) - 1
    along = (lines[:, ends, :2] - lines[:, starts, :2]).reshape(-1, 2)
    length = np.hypot(*along.T)
    cosine, sine = np.where(length > 0, along.T / np.where(length > 0, length, 1.0), [[1.0], [0.0]])
    zero, ones = np.zeros_like(cosine), np.ones_like(cosine)
    axes = np.stack((cosine, sine, zero, -sine, cosine, zero, zero, zero, ones), axis=-1).reshape(-1, 3, 3)
    centres, halves = np.zeros((3, axes.shape[0])), np.empty_like(axes)
    of_run = np.repeat(np.arange(starts.size), ends + 1 - starts)
    by_line = axes.reshape(lines.shape[0], starts.size, 3, 3)
    for axis in range(3):
        projections = np.einsum("lni,lni->ln", by_line[:, of_run, axis], lines)
        least = np.minimum.reduceat(projections, starts, axis=1).reshape(-1)
        most = np.maximum.reduceat(projections, starts, axis=1).reshape(-1)
        centres += (least + most) / 2 * axes[:, axis].T
        halves[:, axis] = ((most - least) / 2)[:, None] * axes[:, axis]
    return centres, halves


@_compiled
def _leg(position, box, centres):
    """Distance from a platform to the centre of a box [m], and components x, y and z of the unit vector towards it.

    The components are 0 if the distance is 0.
    """
    x, y, z = centres[0, box] - position[0], centres[1, box] - position[1], centres[2, box] - position[2]
    distance = math.sqrt(x * x + y * y + z * z)
    scale = 1.0 / distance if distance > 0.0 else 0.0
    return distance, x * scale, y * scale, z * scale


@_compiled
def _bend(distance, size):
    """Upper bound of the error of a linearised distance. [m]

    The distance to a point is expanded to first order in a displacement of the point. `distance` [m] is the distance
    without displacement, and `size` [m] is the length of the largest displacement.
    """
    return min(size, size * size / (2.0 * (distance - size))) if distance > size else 2.0 * size


@_parallel
def _reach(transmitter, receiver, centres, halves):
    """Smallest and largest range sum that pixels in the boxes can have at each pulse, as two arrays (pulses,). [m]

    `centres` and `halves` are the results of `_boxes`. The range sum is a convex function of position, so it is never
    below its linearisation at the centre of a box. The range of each platform exceeds its linearisation by at most
    the result of `_bend`.
    """
    nearest, farthest = np.empty(transmitter.shape[0]), np.empty(transmitter.shape[0])
    for pulse in prange(transmitter.shape[0]):
        low, high = np.inf, -np.inf
        for box in range(centres.shape[1]):
            far_t, x, y, z = _leg(transmitter[pulse], box, centres)
            far_r, u, v, w = _leg(receiver[pulse], box, centres)
            slope, size = 0.0, 0.0
            for axis in range(3):
                a, b, c = halves[box, axis, 0], halves[box, axis, 1], halves[box, axis, 2]
                slope += abs((x + u) * a + (y + v) * b + (z + w) * c)
                size += a * a + b * b + c * c
            size = math.sqrt(size)
            low = min(low, far_t + far_r - slope)
            high = max(high, far_t + far_r + slope + _bend(far_t, size) + _bend(far_r, size))
        nearest[pulse], farthest[pulse] = low, high
    return nearest, farthest


@_compiled
def _split_points(sums, per_metre, first, cycles, index, between, turn):
    """Convert range sums of pixels to positions in a range profile, and to fractions of a carrier cycle.

    `sums` [m] are the range sums. `index` receives the index of the last profile sample before each pixel, `between`
    the distance from this sample to the pixel in samples, and `turn` the fraction of a carrier cycle.
    """
    for i in range(index.shape[0]):
        for j in range(_SEGMENT_LENGTH):
            cell = sums[i * _SEGMENT_LENGTH + j] * per_metre - first
            before = np.floor(cell)
            index[i, j], between[i, j] = _I(before), _F(cell - before)
            cycle = sums[i * _SEGMENT_LENGTH + j] * cycles
            turn[i, j] = _F(cycle - np.rint(cycle))


@_parallel
def _add_points(profiles, first, transmitter, receiver, reference, per_metre, cycles, points, image):
    """Add the contributions of a block of pulses to scattered pixels, (3, n), from the exact range of each pixel."""
    for tile in prange((image.shape[0] + _TILE_ROWS * _SEGMENT_LENGTH - 1) // (_TILE_ROWS * _SEGMENT_LENGTH)):
        start = tile * _TILE_ROWS * _SEGMENT_LENGTH
        count = min(_TILE_ROWS * _SEGMENT_LENGTH, image.shape[0] - start)
        rows = (count + _SEGMENT_LENGTH - 1) // _SEGMENT_LENGTH
        tile_points = np.empty((3, rows * _SEGMENT_LENGTH))
        for axis in range(3):
            tile_points[axis, :count] = points[axis, start : start + count]
            tile_points[axis, count:] = points[axis, start + count - 1]
        sums, index = np.empty(rows * _SEGMENT_LENGTH), np.empty((rows, _SEGMENT_LENGTH), np.int32)
        between, turn = np.empty((rows, _SEGMENT_LENGTH), np.float32), np.empty((rows, _SEGMENT_LENGTH), np.float32)
        fetched = np.empty((rows, 4 * _SEGMENT_LENGTH), np.int64)
        taps = fetched.view(np.float32)
        real, imag = np.zeros((rows, _SEGMENT_LENGTH), np.float32), np.zeros((rows, _SEGMENT_LENGTH), np.float32)
        for pulse in range(profiles.shape[0]):
            _sums(tile_points, transmitter[pulse], receiver[pulse], reference[pulse], sums)
            _split_points(sums, per_metre, first[pulse], cycles, index, between, turn)
            _fetch(profiles[pulse], index, fetched)
            _add_taps(taps, between, turn, real, imag)
        for i in range(count):
            image[start + i] += complex(
                real[i // _SEGMENT_LENGTH, i % _SEGMENT_LENGTH], imag[i // _SEGMENT_LENGTH, i % _SEGMENT_LENGTH]
            )
