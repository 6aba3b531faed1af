"""Autofocus of a chip with its aperture laid out evenly in slow time.

Along a line of equal range a pulse has the frequency that the measured paths give it. Over a long aperture, or where
range and Doppler gradients are nearly parallel, equal times take up unequal parts of that band: a quadratic phase in
time is none in frequency, and what a few per cent of the band hold of the aperture is lost to an estimate. The lines'
spectra are therefore read at equal times, focused there, and the phase is taken back to their frequencies.
"""

import math
from collections.abc import Callable

import numpy as np

from bisar_budget.geometry import GroundVector
from bisar_budget.simulate.autofocus import Focused
from bisar_budget.simulate.collection import OVERSAMPLING, Chip, Errors, PointCollection
from bisar_budget.simulate.phase_history import Complexes, Floats, cell_centres

_TIMES = 64  # read from the lines' spectra at once


def refocused(
    collection: PointCollection,
    errors: Errors,
    centre: GroundVector,
    chip: Chip,
    algorithm: Callable[[Complexes], Focused],
    half: int,
) -> Chip:
    """Estimate one phase over the aperture on some lines of a chip and take it out of all.

    Parameters
    ----------
    collection : PointCollection
        That formed the chip.
    errors : Errors
        Of the measured paths.
    centre : (2,) float
        Middle of the chip. [m]
    chip : Chip
        Image with the error.
    algorithm : callable
        `phase_gradient_autofocus` or `map_drift`.
    half : int
        Lines on either side of the middle one that are used.
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
    """Frequency of each pulse along the middle of a line, the midpoint's taken out, (times,). [cycles/pixel]"""
    line = chip.grid[chip.grid.shape[0] // 2]
    middle = line.shape[0] // 2
    slope = np.zeros(slow_time.size)
    for one in collection.paths(errors.smooth(), slow_time):
        for pixel, sign in ((line[middle + 1], 1), (line[middle - 1], -1)):
            slope += sign * np.linalg.norm(pixel - one.measured, axis=1) / 2
    flown = collection.flown(errors)
    at_middle = (flown.range_sum(line[middle + 1]) - flown.range_sum(line[middle - 1])) / 2
    frequency: Floats = (slope - at_middle) / collection.wavelength
    return frequency
