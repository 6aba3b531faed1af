"""Range profiles for backprojection: a pulse's spectrum taken to range so that a few taps read it anywhere.

A profile is the sum of (4) over frequency, carrier left out, as a function of ΔR. It is sampled finer than it
needs, and read by convolution with a short kernel by whose transform the spectrum was divided beforehand.
"""

import math
from functools import cache

import numpy as np

from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.simulate.phase_history import Complexes, Floats, PhaseHistory

PROFILE_BYTES = 3 * 16  # of a sample while it is formed: spectrum, profile and what the FFT holds


def kernel(offset: Floats, taps: int, oversampling: int) -> Floats:
    """Exponential of a semicircle over ±taps/2 cells, 1 at the centre.

    Source: Barnett, Magland & af Klinteberg, "A parallel non-uniform fast Fourier transform library based on an
    'exponential of semicircle' kernel", 2019; the shape parameter is theirs for the oversampling.
    """
    inside = np.clip(1 - (2 * offset / taps) ** 2, 0.0, None)
    return np.exp(kernel_shape(taps, oversampling) * (np.sqrt(inside) - 1))


def kernel_shape(taps: int, oversampling: int) -> float:
    """Shape parameter of the kernel."""
    return 0.976 * math.pi * taps * (1 - 1 / (2 * oversampling))


def kernel_transform(angle: Floats, taps: int, oversampling: int) -> Floats:
    """Fourier transform of the kernel at an angular frequency per cell, by Gauss-Legendre quadrature."""
    nodes, weights = _gauss()
    offset = nodes * taps / 2
    return np.cos(np.outer(angle, offset)) @ (weights * kernel(offset, taps, oversampling)) * taps / 2


@cache
def _gauss() -> tuple[Floats, Floats]:
    nodes, weights = np.polynomial.legendre.leggauss(64)
    return nodes, weights


def profile_length(history: PhaseHistory, oversampling: int) -> int:
    """Samples of a profile, a power of two: they span the c/Δf after which it repeats."""
    return 1 << (history.frequency.size * oversampling - 1).bit_length()


def cells_per_metre(history: PhaseHistory, length: int) -> float:
    """Profile samples per metre of ΔR."""
    step = (history.frequency[-1] - history.frequency[0]) / max(1, history.frequency.size - 1)
    return float(length * step / SPEED_OF_LIGHT)


def carrier_frequency(history: PhaseHistory) -> float:
    """Frequency that profiles leave out: the middle sample's, not always the middle of the band. [Hz]"""
    return float(history.frequency[history.frequency.size // 2])


def range_profiles(history: PhaseHistory, length: int, transform: Floats, pulses: slice) -> Complexes:
    """Profiles of some pulses: Σ S_k exp(+2πj k n/length), k counted from the carrier.

    Parameters
    ----------
    history : PhaseHistory
        Frequencies evenly spaced.
    length : int
        Samples of a profile.
    transform : (frequencies,) ndarray
        Of the kernels that will read it, at `harmonics`.
    pulses : slice
        Which pulses.

    Returns
    -------
    (pulses, length) ndarray
        Sample n is at ΔR = n over `cells_per_metre`, and repeats.
    """
    samples = history.samples[pulses]
    spectrum = np.zeros((samples.shape[0], length), dtype=complex)
    below = -int(harmonics(history)[0])  # the carrier
    np.divide(samples[:, below:], transform[below:], out=spectrum[:, : samples.shape[1] - below])
    np.divide(samples[:, :below], transform[:below], out=spectrum[:, length - below :])
    return np.fft.ifft(spectrum, axis=1, norm="forward")


def harmonics(history: PhaseHistory) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Number of each frequency, 0 at the carrier."""
    count = history.frequency.size
    return np.arange(count) - count // 2
