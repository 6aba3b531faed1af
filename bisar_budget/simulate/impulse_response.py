"""Measures of a point response: width, peak, sidelobe ratios, and the quadratic phase error itself.

A cut is a line of complex image samples, evenly spaced, that holds the whole response. Sidelobes can be
counted outside a fixed mask, the first nulls of the error-free response, or outside the nulls that the
response itself shows; under a window the second hides a quadratic phase error, because the shoulder it
raises joins the mainlobe.
"""

import math
from dataclasses import dataclass

import numpy as np

from bisar_budget.simulate.phase_history import Complexes, Floats

_UPSAMPLING = 32
_INNER_BAND = 0.9  # of the aperture; its edges ring in an image of finite extent


@dataclass(frozen=True, kw_only=True)
class ImpulseResponse:
    """Measures of one cut.

    `irw_m` is the width at half power, `peak` the magnitude and `peak_m` its place along the cut from the
    middle sample. `pslr_db` and `islr_db` count sidelobes beyond `mask_m` from the peak.
    """

    irw_m: float
    peak: float
    peak_m: float
    pslr_db: float
    islr_db: float
    mask_m: float


def upsampled(cut: Complexes, factor: int) -> Complexes:
    """Interpolate a cut by zero-padding its spectrum; the image's carrier may sit anywhere in the band."""
    count = cut.size
    spectrum = np.fft.fft(cut)
    power = np.abs(spectrum) ** 2
    # The band's centre of gravity on the circle, so that the zeros go where the spectrum is empty.
    turn = np.exp(2j * math.pi * np.arange(count) / count)
    centre = round(float(np.angle(power @ turn)) / (2 * math.pi) * count)
    spectrum = np.fft.fftshift(np.roll(spectrum, -centre))
    padded = np.zeros(count * factor, dtype=complex)
    start = count * factor // 2 - count // 2
    padded[start : start + count] = spectrum
    fine = np.fft.ifft(np.fft.ifftshift(padded)) * factor
    carrier: Complexes = np.exp(2j * math.pi * centre * np.arange(fine.size) / fine.size)
    return fine * carrier


def impulse_response(cut: Complexes, spacing_m: float, mask_m: float | None = None) -> ImpulseResponse:
    """Measure a cut through the peak.

    Parameters
    ----------
    cut : (samples,) ndarray
        Complex, sampled finer than the band needs.
    spacing_m : float
        Between samples.
    mask_m : float, optional
        Half width of the mainlobe mask; None searches the nulls of this response.

    Returns
    -------
    ImpulseResponse

    Raises
    ------
    ValueError
        The peak, or its half-power points or mask, lie at the edge of the cut.
    """
    fine = np.abs(upsampled(cut, _UPSAMPLING))
    step = spacing_m / _UPSAMPLING
    top = int(np.argmax(fine))
    lower, upper = (_crossing(fine, top, direction) for direction in (-1, 1))
    if mask_m is None:
        left, right = (_null(fine, top, direction) for direction in (-1, 1))
    else:
        half = round(mask_m / step)
        left, right = top - half, top + half
    if left <= 0 or right >= fine.size - 1:
        raise ValueError("the mainlobe reaches the edge of the cut")
    sidelobes = np.concatenate((fine[:left], fine[right + 1 :]))
    mainlobe = fine[left : right + 1]
    offset = _vertex(fine, top)
    return ImpulseResponse(
        irw_m=(upper - lower) * step,
        peak=float(fine[top]),
        peak_m=(top + offset - cut.size // 2 * _UPSAMPLING) * step,
        pslr_db=20 * math.log10(float(sidelobes.max()) / float(fine[top])),
        islr_db=10 * math.log10(float(np.sum(sidelobes**2)) / float(np.sum(mainlobe**2))),
        mask_m=(right - left) / 2 * step,
    )


def _crossing(magnitude: Floats, top: int, direction: int) -> float:
    level = magnitude[top] / math.sqrt(2)
    index = top
    while 0 < index < magnitude.size - 1:
        if magnitude[index + direction] < level:
            above, below = magnitude[index], magnitude[index + direction]
            return index + direction * float((above - level) / (above - below))
        index += direction
    raise ValueError("the half-power point lies beyond the cut")


def _null(magnitude: Floats, top: int, direction: int) -> int:
    index = top
    while 0 < index < magnitude.size - 1 and magnitude[index + direction] <= magnitude[index]:
        index += direction
    return index


def _vertex(magnitude: Floats, top: int) -> float:
    before, at, after = magnitude[top - 1 : top + 2]
    return float((before - after) / (2 * (before - 2 * at + after)))


def quadratic_phase_error(
    cut: Complexes, reference: Complexes, spacing_m: float, slow_time: Floats, spatial_frequency: Floats
) -> tuple[float, float]:
    """Measure quadratic and cubic phase of a response against an error-free one at the same place.

    Both cuts go back to the aperture by FFT, tapered to their ends, where a finite image cuts sidelobes off.
    The phase of their product is fitted over the inner 90 % of the aperture: the reference takes out the
    ripple of the band's edges and the curvature that a displaced point has of its own.

    Parameters
    ----------
    cut, reference : (samples,) ndarray
        The same line of the image with and without error, the range at the aperture midpoint taken out.
    spacing_m : float
        Between samples.
    slow_time : (times,) ndarray
        -1 to 1, the ends of the aperture.
    spatial_frequency : (times,) ndarray
        Along the cut, at those times; monotonic, as it is where an image can be formed. [cycles/m]

    Returns
    -------
    quadratic, cubic : float
        Phase at the aperture edge, signed like the range error. [rad]
    """
    count = cut.size
    taper = np.cos(math.pi * (np.arange(count) - count // 2) / count) ** 2
    product = np.fft.fft(cut * taper) * np.conj(np.fft.fft(reference * taper))
    frequency = np.fft.fftfreq(count, spacing_m)
    order = np.argsort(spatial_frequency)
    place = np.interp(frequency, spatial_frequency[order], slow_time[order], left=np.inf, right=np.inf)
    inner = np.nonzero(np.abs(place) < _INNER_BAND)[0]
    inner = inner[np.argsort(place[inner])]
    phase = np.unwrap(np.angle(product[inner]))
    weights = np.sqrt(np.abs(product[inner]))
    fit = np.polynomial.polynomial.polyfit(place[inner], phase, 4, w=weights)
    # The image's phase is −2π/λ times the range error.
    return -float(fit[2]), -float(fit[3])
