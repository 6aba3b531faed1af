"""Phase gradient autofocus on an image whose second axis is cross-range y′, where motion errors smear.

Source: Wahl, Eichel, Ghiglia & Jakowatz, "Phase Gradient Autofocus - A Robust Tool for High Resolution SAR
Phase Correction", IEEE Trans. AES 30 (1994); the phase difference is the maximum-likelihood one of Jakowatz
& Wahl, "Eigenvector method for maximum-likelihood estimation of phase errors in SAR imagery" (1993) for two
adjacent samples.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.simulate.phase_history import Complexes, Floats

_ITERATIONS = 30
_SETTLED = 1e-3  # rad rms of a step
_SUPPORT = 0.05  # of the strongest aperture sample: beyond the band there is nothing to estimate
_WINDOW_DB = 15.0
_WINDOW_MARGIN = 1.5


class Focused(NamedTuple):
    """Image after autofocus, and the phase taken out over the aperture samples, (ny,). [rad]"""

    image: Complexes
    phase: Floats


def phase_gradient_autofocus(image: Complexes) -> Focused:
    """Estimate one phase error common to all range lines and take it out.

    Parameters
    ----------
    image : (nx, ny) ndarray
        Complex image in the rotated frame (x′, y′), its cross-range band inside the sampling band.

    Returns
    -------
    Focused
        Constant and linear phase are left alone: they do not defocus, a linear one displaces.
    """
    spectrum = np.fft.fft(image, axis=1)
    strength = np.sqrt(np.mean(np.abs(spectrum) ** 2, axis=0))
    support = np.fft.fftshift(strength > _SUPPORT * strength.max())
    total = np.zeros(image.shape[1])
    for _ in range(_ITERATIONS):
        lines = np.fft.ifft(spectrum * np.exp(-1j * total), axis=1)
        step = _phase_step(lines, support)
        total += step
        if np.sqrt(np.mean(step[np.fft.ifftshift(support)] ** 2)) < _SETTLED:
            break
    return Focused(image=np.fft.ifft(spectrum * np.exp(-1j * total), axis=1), phase=total)


def _phase_step(lines: Complexes, support: NDArray[np.bool_]) -> Floats:
    """One estimate: centre-shift, window, gradient, integrate, detrend."""
    count = lines.shape[1]
    brightest = np.argmax(np.abs(lines), axis=1)
    rows = np.arange(lines.shape[0])[:, None]
    centred = lines[rows, (np.arange(count) + brightest[:, None] - count // 2) % count]
    blur = np.sum(np.abs(centred) ** 2, axis=0)
    wide = np.nonzero(blur > blur.max() * 10 ** (-_WINDOW_DB / 10))[0]
    half = int(np.ceil(max(count // 2 - wide[0], wide[-1] - count // 2) * _WINDOW_MARGIN)) + 2
    window = np.abs(np.arange(count) - count // 2) <= half
    aperture = np.fft.fftshift(np.fft.fft(np.fft.ifftshift(centred * window, axes=1), axis=1), axes=1)
    difference = np.sum(aperture[:, 1:] * np.conj(aperture[:, :-1]), axis=0)
    gradient = np.where(support[1:] & support[:-1], np.angle(difference), 0.0)
    phase = np.concatenate(([0.0], np.cumsum(gradient)))
    inside = np.nonzero(support)[0]
    trend = np.polynomial.polynomial.polyfit(inside, phase[inside], 1)
    phase = np.where(support, phase - np.polynomial.polynomial.polyval(np.arange(count), trend), 0.0)
    return np.fft.ifftshift(phase)
