"""Rotation of complex images by three shears, each a phase ramp in one dimension's spectrum.

Source: Unser, Thévenaz & Yaroslavsky, "Convolution-based interpolation for fast, high-quality rotation of
images", IEEE Trans. Image Processing 4 (1995); the shears here are by FFT and so exact for a band-limited image.
"""

import math

import numpy as np

from bisar_budget.simulate.phase_history import Complexes

_MARGIN = 2  # times the image's side, so that what is turned does not wrap around


def rotated(image: Complexes, look_azimuth: float) -> Complexes:
    """Turn an image in (x, y) into the frame (x′, y′) of (10).

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
