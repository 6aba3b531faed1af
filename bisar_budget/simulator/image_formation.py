"""Image formation by the matched filter (4) of Rigling & Moses, which is exact, and by backprojection, which is fast.

Both use the measured platform positions, because a real processor does not know the actual positions. The image of a
point scatterer of amplitude A has a peak of |A|.
"""

import math
from collections.abc import Callable
from functools import cache, partial
from typing import Literal

import numpy as np

from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.extras import install_command
from bisar_budget.memory import is_spacious
from bisar_budget.simulator.phase_history import Complexes, Floats, PhaseHistory, is_even, split

PROFILE_BYTES = 3 * 16  # per sample while a profile is formed: spectrum, profile and working memory of the FFT
_SAMPLES_PER_RANGE_CELL = 16  # profile samples per cell; interpolation between them has an error of -119 dB
_BLOCK_TERMS_COUNT = 1 << 20  # complex samples in memory at once
_CACHED_PIXELS_COUNT = 1 << 13  # pixels formed at once; their data fit into a processor's second cache
_WORKING_BYTES = {"numpy": 30e6, "cubic": 110e6}  # in addition to data and image: work arrays, and the compiled code
_SPACIOUS_BYTES = 3 * _WORKING_BYTES["cubic"]

Kernel = Literal["auto", "numpy", "cubic"]


def differential_range(history: PhaseHistory, points: Floats, pulse: int) -> Floats:
    """Exact differential range ΔR of points (n, 3) at a pulse, (n,). [m]

    It is the range sum of a point minus the range sum of the scene centre, for the measured platform positions.
    """
    total: Floats = np.zeros(len(points))
    for position in (history.transmitter[pulse], history.receiver[pulse]):
        total = total + np.linalg.norm(position - points, axis=-1) - np.linalg.norm(position, axis=-1)
    return total


def matched_filter(history: PhaseHistory, points: Floats) -> Complexes:
    """Form an image by the matched filter of equation (4), a sum over pulses and frequencies without approximation.

    Parameters
    ----------
    history : PhaseHistory
        Recorded data. If a window is used, it must already have been applied to the samples.
    points : (..., 3) ndarray
        Positions of the pixels. [m]

    Returns
    -------
    (...) ndarray
        Complex image.
    """
    flat = np.reshape(points, (-1, 3))
    image = direct_sum(history, flat, partial(differential_range, history))
    return image.reshape(np.shape(points)[:-1])


def direct_sum(history: PhaseHistory, points: Floats, ranges: Callable[[Floats, int], Floats]) -> Complexes:
    """Form an image (n,) at points (n, 3) by the sum of equation (4) over pulses and frequencies.

    `ranges(points, pulse)` returns the differential ranges ΔR (n,) [m] at a pulse.
    """
    image: Complexes = np.zeros(points.shape[0], dtype=complex)
    wavenumber = 2 * math.pi * history.frequency / SPEED_OF_LIGHT_MPS
    coarse, fine = split(wavenumber) if is_even(history.frequency) else (wavenumber, np.zeros(1))
    shape = (coarse.size, fine.size)
    points_per_block = max(1, _BLOCK_TERMS_COUNT // max(1, sum(shape)))
    for pulse in range(history.slow_time.size):
        samples = np.zeros(shape, dtype=complex)
        samples.ravel()[: wavenumber.size] = history.samples[pulse]
        for start in range(0, points.shape[0], points_per_block):
            block_points = slice(start, start + points_per_block)
            distance = ranges(points[block_points], pulse)
            by_coarse = np.exp(1j * np.outer(distance, fine)) @ samples.T
            image[block_points] += np.sum(np.exp(1j * np.outer(distance, coarse)) * by_coarse, axis=1)
    image /= max(1, history.samples.size)
    return image


def backprojection(history: PhaseHistory, points: Floats, kernel: Kernel = "auto") -> Complexes:
    """Form an image by backprojection. It agrees with equation (4) to -120 dB and takes a fraction of the time.

    The spectrum of each pulse is divided by the transform of a spline and transformed to a range profile by FFT. The
    profile is interpolated at the differential ranges of the pixels. Profiles repeat every c/Δf in range, where Δf is
    the frequency step. The caller must make sure that pixels are not farther apart than this, because they would
    alias.

    Parameters
    ----------
    history : PhaseHistory
        Phase history; its frequencies must be evenly spaced.
    points : (..., 3) ndarray
        Positions of the pixels. [m]
    kernel : "auto", "numpy" or "cubic"
        "numpy" works for all pixels. "cubic" uses a cubic spline and is compiled by Numba (extra `fast`). "auto"
        means "cubic" if Numba is installed, and "numpy" otherwise.

    Returns
    -------
    (...) ndarray
        Complex image.

    Raises
    ------
    ValueError
        A position is not finite.
    ImportError
        `kernel` is "cubic" and Numba is not installed.
    """
    points = np.asarray(points, dtype=float)
    for name, positions in (("points", points), ("transmitter", history.transmitter), ("receiver", history.receiver)):
        if not np.isfinite(positions).all():
            raise ValueError(f"{name}: positions must be finite numbers of metres")
    if kernel == "auto":
        kernel = "cubic" if is_compiled() else "numpy"
    if kernel == "numpy":
        return _backprojection(history, points)
    if not is_compiled():
        raise ImportError(f"kernel {kernel} needs Numba, which is missing: {install_command('fast')}")
    from bisar_budget.simulator.compiled import backproject

    image = backproject(history, points)
    return _backprojection(history, points) if image is None else image


def kernel_within(memory_limit: float) -> Kernel:
    """Choose the backprojection kernel, "cubic" or "numpy", for a memory limit [B].

    The compiled kernel "cubic" is chosen only if there is ample memory, because its code takes 60 MB.
    """
    return "cubic" if is_compiled() and memory_limit >= _SPACIOUS_BYTES else "numpy"


def bytes_held(kernel: Kernel) -> float:
    """Memory that backprojection needs in addition to the phase history and the image. [B]"""
    return _WORKING_BYTES["numpy" if kernel == "numpy" else "cubic"]


@cache
def is_compiled() -> bool:
    """Whether compiled kernels are available.

    Numba must be installed, memory must be sufficient, and it must be possible to cache compiled code.
    """
    if not is_spacious():
        return False
    try:
        import bisar_budget.simulator.compiled  # noqa: F401
    except (ImportError, RuntimeError):  # not installed, or no cache for compiled code
        return False
    return True


def _backprojection(history: PhaseHistory, points: Floats) -> Complexes:
    axes = np.ascontiguousarray(np.reshape(points, (-1, 3)).T)
    length = profile_length(history, _SAMPLES_PER_RANGE_CELL)
    transform = np.sinc(harmonics(history) / length) ** 4  # Fourier transform of a cubic B-spline
    per_metre = cells_per_metre(history, length)
    carrier = 2 * math.pi * carrier_frequency(history) / SPEED_OF_LIGHT_MPS
    image: Complexes = np.zeros(axes.shape[1], dtype=complex)
    for pulse in range(history.slow_time.size):
        spline = range_profiles(history, length, transform, slice(pulse, pulse + 1))[0]
        spline = np.concatenate((spline[-1:], spline, spline[:2]))
        for start in range(0, axes.shape[1], _CACHED_PIXELS_COUNT):
            block = slice(start, start + _CACHED_PIXELS_COUNT)
            ranges: Floats = np.zeros(())
            for positions in (history.transmitter, history.receiver):
                leg = axes[:, block] - positions[pulse, :, None]
                ranges = ranges + (np.sqrt(np.einsum("ij,ij->j", leg, leg)) - np.linalg.norm(positions[pulse]))
            formed = _read(spline, ranges * per_metre)
            turn = np.empty_like(formed)
            np.cos(carrier * ranges, out=turn.real)
            np.sin(carrier * ranges, out=turn.imag)
            image[block] += formed * turn
    image /= max(1, history.samples.size)
    return image.reshape(np.shape(points)[:-1])


def _read(spline: Complexes, cell: Floats) -> Complexes:
    """Evaluate a periodic cubic B-spline at fractional sample positions `cell` (n,). The result has the shape (n,).

    `spline` (samples + 3,) holds the coefficients at the samples, extended periodically by one coefficient at the
    start and two at the end.
    """
    first = np.floor(cell)
    fraction = cell - first
    remainder = 1 - fraction
    weights = (
        remainder * remainder * remainder / 6,
        2 / 3 - fraction * fraction * (1 - fraction / 2),
        2 / 3 - remainder * remainder * (1 - remainder / 2),
        fraction * fraction * fraction / 6,
    )
    index = first.astype(np.int64) % (spline.size - 3)
    value: Complexes = np.zeros(cell.shape, dtype=complex)
    for tap, weight in enumerate(weights):
        value += spline[tap:].take(index) * weight
    return value


# ---------------------------------------------------------------------- range profiles
def profile_length(history: PhaseHistory, oversampling: int) -> int:
    """Number of samples of a range profile over its period c/Δf; always a power of two.

    The number is at least `oversampling` times the number of frequencies.
    """
    return 1 << (history.frequency.size * oversampling - 1).bit_length()


def cells_per_metre(history: PhaseHistory, length: int) -> float:
    """Number of samples of a range profile per metre of differential range ΔR. [1/m]"""
    step = (history.frequency[-1] - history.frequency[0]) / max(1, history.frequency.size - 1)
    return float(length * step / SPEED_OF_LIGHT_MPS)


def carrier_frequency(history: PhaseHistory) -> float:
    """Carrier frequency that is removed from range profiles: the frequency of the middle sample. [Hz]

    If the number of frequencies is even, this is not the centre of the band.
    """
    return float(history.frequency[history.frequency.size // 2])


def range_profiles(history: PhaseHistory, length: int, transform: Floats, pulses: slice) -> Complexes:
    """Range profiles of selected pulses: Σ S_k exp(+2πj k n/length), where k counts frequencies from the carrier.

    A profile is the sum over frequency in equation (4) of Rigling & Moses, without the carrier, as a function of the
    differential range ΔR. It is oversampled, and will be interpolated by convolution with a short kernel. To
    compensate for this kernel, the samples S_k are first divided by its transform.

    Parameters
    ----------
    history : PhaseHistory
        Phase history with evenly spaced frequencies.
    length : int
        Number of samples of a profile.
    transform : (frequencies,) ndarray
        Fourier transform of the interpolation kernel, at the indices returned by `harmonics`.
    pulses : slice
        Pulses for which profiles are computed.

    Returns
    -------
    (pulses, length) ndarray
        Periodic range profiles. Sample n is at ΔR = n / `cells_per_metre`.
    """
    samples = history.samples[pulses]
    spectrum = np.zeros((samples.shape[0], length), dtype=complex)
    below = -int(harmonics(history)[0])  # the carrier
    np.divide(samples[:, below:], transform[below:], out=spectrum[:, : samples.shape[1] - below])
    np.divide(samples[:, :below], transform[:below], out=spectrum[:, length - below :])
    return np.fft.ifft(spectrum, axis=1, norm="forward")


def harmonics(history: PhaseHistory) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Index of each frequency of a phase history, counted from 0 at the carrier frequency, (frequencies,)."""
    count = history.frequency.size
    return np.arange(count) - count // 2


# ---------------------------------------------------------------------- pixels and weights
def ground_grid(
    centre: tuple[float, float], look_azimuth: float, size: tuple[float, float], shape: tuple[int, int]
) -> Floats:
    """Pixels of a ground patch (z = 0) in the rotated frame (x′, y′) of equation (10).

    Parameters
    ----------
    centre : (2,) float
        East and north of the centre of the patch. [m]
    look_azimuth : float
        Direction of x′ [rad]. The value 0 gives the frame (x, y).
    size : (2,) float
        Extent along x′ and y′. [m]
    shape : (2,) int
        Number of pixels along x′ and y′.

    Returns
    -------
    (nx, ny, 3) ndarray
        East, north and up of each pixel. [m]
    """
    along, across = ((np.arange(n) - n // 2) * (extent / n) for n, extent in zip(shape, size, strict=True))
    x, y = np.meshgrid(along, across, indexing="ij")
    cosine, sine = math.cos(look_azimuth), math.sin(look_azimuth)
    return np.stack((centre[0] + x * cosine - y * sine, centre[1] + x * sine + y * cosine, np.zeros_like(x)), axis=-1)


def taylor_window(count: int, sidelobe_db: float = -35.0, nbar: int = 5) -> Floats:
    """Taylor window weights (count,) with a mean of 1, so that the peak of a point response is unchanged.

    Parameters
    ----------
    count : int
        Number of samples. They are at the centres of equal cells.
    sidelobe_db : float
        Level of the near sidelobes relative to the peak, a negative number. [dB]
    nbar : int
        Number of near sidelobes at this level, plus one.

    Notes
    -----
    Source: T. T. Taylor, "Design of line-source antennas for narrow beamwidth and low side lobes", 1955;
    Carrara, Goodman & Majewski, Spotlight Synthetic Aperture Radar, appendix D.
    """
    a = math.acosh(10 ** (-sidelobe_db / 20)) / math.pi
    sigma2 = nbar**2 / (a**2 + (nbar - 0.5) ** 2)
    positions = (np.arange(count) - (count - 1) / 2) / count
    weights: Floats = np.ones(count)
    for m in range(1, nbar):
        numerator = math.prod(1 - m**2 / (sigma2 * (a**2 + (n - 0.5) ** 2)) for n in range(1, nbar))
        denominator = math.prod(1 - m**2 / n**2 for n in range(1, nbar) if n != m)
        weights += 2 * ((-1) ** (m + 1) * numerator / (2 * denominator)) * np.cos(2 * math.pi * m * positions)
    weights /= weights.mean()
    return weights
