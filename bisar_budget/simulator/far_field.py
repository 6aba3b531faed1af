"""Image formation with plane waves (far field): the filter (7) or (12), and the polar format (13), (14).

Numbers in brackets refer to the equations of Rigling & Moses. Both methods use the approximation (5), and therefore
defocus and displace points that are not at the scene centre.
"""

import math
from functools import cache
from importlib.util import find_spec
from typing import Literal, NamedTuple

import numpy as np

from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.extras import install_command
from bisar_budget.geometry import GroundVector
from bisar_budget.simulator.image_formation import direct_sum
from bisar_budget.simulator.impulse_response import lagrange_weight
from bisar_budget.simulator.phase_history import Complexes, Floats, PhaseHistory, look_sum

_NUFFT_ERROR_FRACTION = 1e-8  # relative error of the non-uniform FFT
_SAMPLES_PER_GRID_CELL, _GRID_MARGIN_CELLS = 2, 10  # FFT grid along each axis: samples per cell, and margin
_MAX_GRID_SAMPLES = 1 << 22  # each sample takes about 40 bytes
_STENCIL_SAMPLES = 12  # samples that one interpolation uses


def far_field_filter(
    history: PhaseHistory, points: Floats, method: Literal["auto", "direct", "nufft"] = "auto"
) -> Complexes:
    """Form an image by the far-field filter of Rigling & Moses, equation (7); on the ground it becomes equation (12).

    Parameters
    ----------
    history : PhaseHistory
        Phase history; its frequencies may be unevenly spaced.
    points : (..., 3) ndarray
        Positions of the pixels. [m]
    method : "auto", "direct" or "nufft"
        "direct" computes the sum as in Rigling & Moses. "nufft" uses finufft (extra `fast`), gives the same values to
        -120 dB, and is much faster for images. "auto" uses finufft if it is installed, except if the points are so
        far apart that the grid of finufft would need too much memory.

    Returns
    -------
    (...) ndarray
        Complex image.

    Raises
    ------
    ValueError
        A position is not finite.
    ImportError
        `method` is "nufft" and finufft is not installed.
    """
    flat = np.reshape(np.asarray(points, dtype=float), (-1, 3))
    if not np.isfinite(flat).all():
        raise ValueError("points: positions must be finite numbers of metres")
    sight = look_sum(history.transmitter, history.receiver)
    if method != "direct" and flat.size:
        try:
            image = _by_nufft(history, sight, flat, bounded=method == "auto")
        except ImportError:
            if method == "nufft":
                raise ImportError(f"finufft is missing: {install_command('fast')}") from None
            image = None
        if image is not None:
            return image.reshape(np.shape(points)[:-1])
    image = direct_sum(history, flat, lambda part, pulse: -part @ sight[pulse])
    return image.reshape(np.shape(points)[:-1])


@cache
def is_nonuniform() -> bool:
    """Whether finufft, the library for non-uniform FFTs, is installed."""
    return find_spec("finufft") is not None


def _by_nufft(history: PhaseHistory, sight: Floats, points: Floats, *, bounded: bool) -> Complexes | None:
    """Compute the image of equation (7) at points (n, 3) by a non-uniform FFT. The result has the shape (n,).

    The result is None if the FFT grid would be too large; this is checked only if `bounded` is true. The size of the
    grid is proportional to the area of a box around the points times the area of a box around the wavenumbers. Both
    boxes are aligned with the look direction. With any other orientation, a patch whose resolution cells are
    kilometres long would need millions of grid cells.
    """
    import finufft

    wavenumber = 2 * math.pi * history.frequency / SPEED_OF_LIGHT_MPS
    samples: Complexes = history.samples
    middle = sight[len(sight) // 2, :2] / float(np.hypot(*sight[len(sight) // 2, :2]))
    turn = np.array([[middle[0], -middle[1], 0.0], [middle[1], middle[0], 0.0], [0.0, 0.0, 1.0]])
    sight, points = sight @ turn, points @ turn
    height = points[0, 2]
    if (points[:, 2] == height).all():  # a grid of two dimensions is enough
        samples = samples * np.exp(-1j * height * np.outer(sight[:, 2], wavenumber))
        axes, transform = 2, finufft.nufft2d3
    else:
        axes, transform = 3, finufft.nufft3d3
    sources = [np.outer(sight[:, axis], wavenumber).ravel() for axis in range(axes)]
    targets = [np.ascontiguousarray(points[:, axis]) for axis in range(axes)]
    cells = [float(np.ptp(k)) * float(np.ptp(x)) / (2 * math.pi) for k, x in zip(sources, targets, strict=True)]
    if (
        bounded
        and math.prod(_SAMPLES_PER_GRID_CELL * (cell_count + _GRID_MARGIN_CELLS) for cell_count in cells)
        > _MAX_GRID_SAMPLES
    ):
        return None
    image: Complexes = transform(*sources, samples.ravel(), *targets, isign=-1, eps=_NUFFT_ERROR_FRACTION)
    return image / history.samples.size


class PolarFormat(NamedTuple):
    """Image (nx, ny) formed by the polar format, and the frequency grid from which it was formed.

    The grid is given by equation (13) of Rigling & Moses.

    `frequency_x` (Nx,) and `frequency_y` (Ny,) [Hz] are the frequencies f′x and f′y of the grid.
    """

    image: Complexes
    frequency_x: Floats
    frequency_y: Floats


def polar_format(
    history: PhaseHistory,
    look_azimuth: float,
    size: tuple[float, float],
    shape: tuple[int, int],
    centre: GroundVector = (0.0, 0.0),
) -> PolarFormat:
    """Form an image by the polar format: interpolate to a rectangular frequency grid, then apply an FFT.

    The grid and the FFT are given by equations (13) and (14) of Rigling & Moses.

    The grid is a rectangle in the rotated frame within the recorded frequencies, so it omits the corners of the
    aperture. The omitted part increases with the relative bandwidth and with the squint. The frequency step of the
    grid is c/(2·size), so the image is periodic with a period of `size`.

    Parameters
    ----------
    history : PhaseHistory
        Phase history; its frequencies and pulses must be evenly spaced.
    look_azimuth : float
        Bistatic look direction φ_b of equation (11) in Rigling & Moses. [rad]
    size : (2,) float
        Extent along x′ and y′, centred on the patch. [m]
    shape : (2,) int
        Number of pixels along x′ and y′. The pixels are the result of `ground_grid(centre, look_azimuth, size,
        shape)`.
    centre : (2,) float
        Centre of the patch, east and north [m]. The phase of a plane wave at the centre is removed from the samples
        before they are interpolated. This is equivalent to (14) at shifted pixels, with the same approximation (5).

    Returns
    -------
    PolarFormat
        Image, and the frequency grid from which it was formed.

    Raises
    ------
    ValueError
        The line of sight does not turn steadily over the aperture, no rectangle fits into the recorded frequencies,
        or the pixel spacing is coarser than the resolution of the rectangle.
    """
    cosine, sine = math.cos(look_azimuth), math.sin(look_azimuth)
    east, north = look_sum(history.transmitter, history.receiver)[:, :2].T / 2
    along, across = east * cosine + north * sine, north * cosine - east * sine  # (9), per hertz
    slope = across / along
    to_centre = 2 * (east * centre[0] + north * centre[1])
    samples = history.samples * np.exp(-2j * math.pi / SPEED_OF_LIGHT_MPS * np.outer(to_centre, history.frequency))
    turn = np.diff(slope)
    if (turn < 0).all():
        samples, along, slope = samples[::-1], along[::-1], slope[::-1]
    elif slope.size < _STENCIL_SAMPLES or not (turn > 0).all():
        raise ValueError(
            f"polar format needs {_STENCIL_SAMPLES} pulses or more ({slope.size} given), the line of sight turning "
            "one way"
        )
    low, high = float(history.frequency[0]), float(history.frequency[-1])
    if history.frequency.size < _STENCIL_SAMPLES or not (along > 0).all():
        raise ValueError(
            f"polar format needs {_STENCIL_SAMPLES} frequencies or more, and x′ pointing at the platforms"
        )
    # (13) with f₀ projected. With a squint, the projection of a frequency changes over the aperture.
    fx = _grid(low * along.max(), high * along.min(), SPEED_OF_LIGHT_MPS / (2 * size[0]))
    if not fx.size:
        raise ValueError(
            "no rectangle of frequencies fits into the aperture: too much squint for so little bandwidth"
        )
    edges = np.outer((slope[0], slope[-1]), (fx[0], fx[-1]))
    fy = _grid(edges[0].max(), edges[1].min(), SPEED_OF_LIGHT_MPS / (2 * size[1]))
    if not fy.size:
        raise ValueError("no rectangle of frequencies fits into the aperture: the line of sight turns off x′")
    for name, count, pixels in (("x′", fx.size, shape[0]), ("y′", fy.size, shape[1])):
        if pixels < count:
            raise ValueError(f"{pixels} pixels along {name} are coarser than the resolution; {count} or more are not")
    step = (high - low) / (history.frequency.size - 1)
    in_range = _interpolated(samples, (fx / along[:, None] - low) / step)
    pulse = np.interp(fy / fx[:, None], slope, np.arange(slope.size))
    rectangle = _interpolated(np.ascontiguousarray(in_range.T), pulse)
    spectrum = np.zeros(shape, dtype=complex)
    number_x, number_y = (
        np.rint(fx * 2 * size[0] / SPEED_OF_LIGHT_MPS),
        np.rint(fy * 2 * size[1] / SPEED_OF_LIGHT_MPS),
    )
    spectrum[np.ix_(number_x.astype(np.int64) % shape[0], number_y.astype(np.int64) % shape[1])] = rectangle
    image = np.fft.fft2(spectrum) / rectangle.size  # (14)
    return PolarFormat(np.roll(image, (shape[0] // 2, shape[1] // 2), axis=(0, 1)), fx, fy)


def _grid(low: float, high: float, step: float) -> Floats:
    """Multiples of a frequency step between the bounds `low` and `high` [Hz]. The result may be empty.

    An FFT of samples at such frequencies gives an image without a carrier.
    """
    first, last = math.ceil(low / step), math.floor(high / step)
    return np.arange(first, last + 1, dtype=float) * step


def _interpolated(rows: Complexes, positions: Floats) -> Complexes:
    """Interpolate rows of evenly spaced samples at given positions by Lagrange polynomials, (rows, points).

    Near the ends of a row, the stencil stays within the samples.

    Parameters
    ----------
    rows : (rows, samples) ndarray
        Samples, at least about twice as dense as the sampling theorem requires. The scene is then at most half as
        large as the sampling would allow.
    positions : (rows, points) ndarray
        Positions along each row at which to interpolate. [samples]
    """
    first = np.clip(
        np.floor(positions).astype(np.int64) - _STENCIL_SAMPLES // 2 + 1, 0, rows.shape[1] - _STENCIL_SAMPLES
    )
    offset = positions - first
    line = np.arange(rows.shape[0])[:, None]
    total = np.zeros(positions.shape, dtype=complex)
    for tap in range(_STENCIL_SAMPLES):
        total += lagrange_weight(offset, tap, _STENCIL_SAMPLES) * rows[line, first + tap]
    return total
