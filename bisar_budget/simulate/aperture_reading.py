"""What a chip says about each part of the aperture: the phase that an error leaves there, read from the image.

Every pulse contributes to every pixel what exact ranges by the measured paths say. Correlated with a pulse's
contribution, an image gives that pulse's phase: the projection of the spectrum to slow time, with range walk and bent
lines as they are. The error-free response, formed and read by the same paths, takes out what is common to both.
"""

import math
from typing import NamedTuple

import numpy as np

from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.geometry import GroundVector
from bisar_budget.simulate.collection import CELLS, OVERSAMPLING, Chip, Errors, PointCollection
from bisar_budget.simulate.phase_history import Complexes, Floats, cell_centres

READ_CELLS = 2  # of range that are read at most, beside what a response walks
_TIMES = 65  # at least
_INNER = 0.95  # of the aperture; its edges ring in a patch of finite extent
_ORDER = 6  # of the polynomial; a turn of ±0.5 rad shows sixth powers
_PRESENT = 0.25  # of the median strength over the aperture; less is smeared out of the patch
_BLOCK = 1 << 20  # contributions held at once


class ApertureReading(NamedTuple):
    """Phases at the aperture edge, signed like the range error [rad].

    `across_pixels` is how far the response lies from the middle along y′, by the linear part of the phase.
    `walked_pixels` is what the other parts put the centre of gravity nearer along x′: at a frequency of y′ it is where
    the range error less its slope times slow time puts it. `coverage` is the part of the aperture that the patch holds: 1 unless a smear leaves it.
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
    range_cells: float = 0.0,
) -> ApertureReading:
    """Read quadratic and cubic phase of a response.

    Parameters
    ----------
    collection : PointCollection
        That formed the chips.
    errors : Errors
        Of the measured paths.
    centre : (2,) float
        Middle of the chips and place of the reference. [m]
    chip, reference : Chip
        With and without error, on the same pixels.
    range_cells : float
        Read around the middle line: what the response walks, and no more where a range cell is long.

    Raises
    ------
    ValueError
        The response is not in the image.
    """
    count = max(_TIMES, round(2 * chip.image.shape[1] / OVERSAMPLING) + 1)
    slow_time = cell_centres(collection.aperture_time, count)
    seen, clean = _by_pulse(collection, errors, centre, slow_time, [chip, reference], range_cells)
    place = slow_time / (collection.aperture_time / 2)
    inner = np.abs(place) < _INNER
    product, strength = seen * clean.conj(), np.abs(seen) / np.maximum(np.abs(clean), 1e-30)
    present = strength > _PRESENT * np.median(strength[inner])
    middle = count // 2
    if not np.isfinite(strength).all() or not present[middle]:
        raise ValueError("the response is not in the image")
    gaps = np.nonzero(~(present & inner))[0]
    first = int(gaps[gaps < middle].max(initial=-1)) + 1
    last = int(gaps[gaps > middle].min(initial=count))
    kept = slice(first, last)
    phase = np.unwrap(np.angle(product[kept]))
    weights = np.abs(clean[kept])
    fit = np.polynomial.legendre.legfit(place[kept], phase, _ORDER, w=weights)
    covered = (place[last - 1] - place[first]) / (2 * _INNER)
    # The image's phase is −2π/λ times the range error; P₂ = (3t² - 1)/2, P₃ = (5t³ - 3t)/2.
    # A pixel along y′ changes the range sum over the aperture by λ / OVERSAMPLING, twice its P₁ part.
    turn = 1 if collection.flown(errors).turns_left(centre) else -1
    across = -turn * OVERSAMPLING / math.pi * float(fit[1])
    slope = np.polynomial.legendre.legder([0.0, 0.0, *fit[2:]])
    mean = float(np.mean(place[inner] * np.polynomial.legendre.legval(place[inner], slope)))
    walked = mean / (2 * math.pi) * collection.relative_bandwidth * OVERSAMPLING
    return ApertureReading(
        float(-1.5 * fit[2]), float(-2.5 * fit[3]), across, -walked, min(1.0, float(covered) * 1.02)
    )


def _by_pulse(
    collection: PointCollection,
    errors: Errors,
    centre: GroundVector,
    slow_time: Floats,
    chips: list[Chip],
    range_cells: float,
) -> list[Complexes]:
    """Correlation of images, tapered to their ends, with what a point at the centre contributes at each time."""
    grid = chips[0].grid
    lines, columns = grid.shape[:2]
    middle = lines // 2
    half = min(middle, lines - 1 - middle, round(range_cells * OVERSAMPLING / 2))
    rows = slice(middle - half, middle + half + 1)
    pixels = grid[rows].reshape(-1, 3)
    # The ends of the patch are half the cells of a response without smear; what is smeared stays as it is.
    ramp = round(CELLS * OVERSAMPLING / 2)
    inside = np.minimum(np.arange(columns) + 0.5, columns - np.arange(columns) - 0.5) / ramp
    taper = np.sin(math.pi / 2 * np.clip(inside, 0, 1)) ** 2
    images = np.stack([(one.image[rows] * taper).reshape(-1) for one in chips])
    flown = collection.flown(errors)
    k = 2 * math.pi / collection.wavelength
    at_middle = flown.range_sum(pixels) - flown.range_sum(np.asarray(centre, dtype=float))
    point = np.array([*centre, 0.0])
    paths = [one.measured for one in collection.paths(errors.smooth(), slow_time)]
    found = np.empty((len(chips), slow_time.size), dtype=complex)
    step = max(1, _BLOCK // pixels.shape[0])
    for begin in range(0, slow_time.size, step):
        part = slice(begin, begin + step)
        farther = np.zeros((slow_time[part].size, pixels.shape[0]))
        for track in paths:
            farther += _distance(track[part], pixels) - _distance(track[part], point[None])
        contribution = np.exp(1j * k * (farther - at_middle))
        contribution *= np.sinc(farther * (collection.radar.bandwidth / SPEED_OF_LIGHT))
        found[:, part] = images @ contribution.conj().T
    return list(found)


def _distance(positions: Floats, points: Floats) -> Floats:
    """From positions (m, 3) to points (n, 3), (m, n). [m]"""
    square = np.zeros((positions.shape[0], points.shape[0]))
    for axis in range(3):
        square += (positions[:, axis, None] - points[:, axis]) ** 2
    distance: Floats = np.sqrt(square)
    return distance
