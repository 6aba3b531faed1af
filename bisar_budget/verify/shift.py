"""Where an error moves a response, and along which line it smears it, read from the image's spectrum.

Each part of the aperture sees the point at a place of its own, as (26) to (28) of Rigling & Moses have it for
three parts. In the spectrum of the image that place is the gradient of the phase against an error-free
response: its mean is the displacement of the centre of gravity, its spread the smear. That holds for a
smear far smaller than a resolution cell, where the outline of the response shows nothing yet.
"""

import math
from typing import NamedTuple

import numpy as np

from bisar_budget.geometry import GroundVector
from bisar_budget.simulate.collection import Chip
from bisar_budget.simulate.phase_history import Complexes, Floats
from bisar_budget.verify.aperture_reading import ApertureReading

_SUPPORT = 0.4  # of the largest error-free spectral magnitude; the band's edges ring in a finite image


class Shift(NamedTuple):
    """Displacement on the ground (east, north) [m], azimuth of the line of smear, 0 to π [rad].

    `pixels` is the displacement along x′ and y′ of the image.
    """

    displacement: GroundVector
    smear_azimuth: float
    pixels: tuple[float, float]


def measured_shift(chip: Chip, reference: Chip, reading: ApertureReading | None = None) -> Shift:
    """Compare a response with an error-free one on the same grid.

    A `reading` of the aperture says better where the response is: a cubic phase moves the centre of gravity along y′,
    a quadratic one along x′, neither what is displaced.

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
    middle = np.average(pixels, axis=1, weights=weights)
    if reading is not None:
        middle = np.array([middle[0] - reading.walked_pixels, reading.across_pixels])
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
