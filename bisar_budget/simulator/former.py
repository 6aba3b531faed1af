"""Image formers with a common interface for pixels, displaced points, resolution and images.

Images are at baseband. The equation numbers refer to Rigling & Moses. With exact ranges, equation (4), a target
appears at its displaced point, and the pixels are along lines of equal range. With plane waves, equations (7) to
(14), a target appears at the point whose plane-wave range history is the best fit to the recorded range history, and
the pixels are along the axes (x′, y′) of equation (10). Ground points are given as east and north [m].
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.geometry import GroundVector
from bisar_budget.image_plane import Band, GroundMatrix, band_variance, nodes
from bisar_budget.ranges.resolution import cells_of_support
from bisar_budget.simulator.collection import RangeLines
from bisar_budget.simulator.far_field import far_field_filter, is_nonuniform, polar_format
from bisar_budget.simulator.image_formation import Kernel, backprojection, bytes_held, ground_grid, matched_filter
from bisar_budget.simulator.phase_history import Complexes, Floats, PhaseHistory

IMAGE_FORMERS = ("backprojection", "polar_format", "matched_filter", "far_field")

_HISTORY_ORDER = 8  # order of the polynomials that are fitted to range histories
_PROGRESS_PIXELS_COUNT = 1 << 18  # pixels formed between two calls of the progress
_TRIAL_PIXELS, _COMPILED_TRIAL_PIXELS = 1 << 10, 1 << 15  # pixels of a timed trial
_SECONDS_PER_SAMPLE = 3e-6  # for polar format or a non-uniform FFT to 1e-8, on one core of 2024
_DIRECT_BYTES = 30e6  # held by the sums over all pulses and frequencies for a block of pixels

OnPixels = Callable[[int], None]


@dataclass(frozen=True, slots=True, eq=False)
class ExactRangeFormer:
    """Image former with exact ranges: matched filter, or backprojection, which gives the same image.

    `is_direct` selects the matched filter, equation (4) of Rigling & Moses. `kernel` is the interpolation kernel of
    the backprojection.
    """

    lines: RangeLines
    radar: Band
    is_direct: bool
    kernel: Kernel = "auto"

    @property
    def bytes_held(self) -> float:
        """Memory that image formation needs besides the images and the phase history. [B]"""
        return _DIRECT_BYTES if self.is_direct else bytes_held(self.kernel)

    def place(self, displaced: GroundVector, recorded: Floats) -> GroundVector:
        """Ground point at which a target appears in the image, east and north. [m]

        With exact ranges this is `displaced`, the displaced point of the target.
        """
        return displaced

    def remaining_range(self, ground_point: GroundVector, remaining_range: Floats, recorded: Floats) -> Floats:
        """Recorded range history of a target minus the range history that the former assumes for `ground_point`. [m]

        With exact ranges this is the argument `remaining_range`, the difference at the displaced point.
        """
        return remaining_range

    def cells(self, centre: GroundVector) -> tuple[float, float]:
        """Resolution along x′ and y′, from peak to first null. [m]"""
        return self.lines.cells(centre, self.radar)

    def sampled(self, centre: GroundVector) -> tuple[float, float]:
        """Cell sizes along x′ and y′ that set the pixel spacing. They are at most as large as the resolution. [m]"""
        return self.lines.sampled(centre, self.radar)

    def look(self, centre: GroundVector) -> Floats:
        """Direction of x′ at a ground point, a unit vector (2,) towards the platforms."""
        towards: Floats = self.lines.axes(centre)[:, 0]
        return towards

    def offsets(self, ground_points: Floats, centre: GroundVector) -> Floats:
        """Signed distances of ground points (n, 2) from a centre along x′ and y′, in resolution cells, (n, 2)."""
        return self.lines.offsets(ground_points, centre, self.radar)

    def grid(self, centre: GroundVector, spacing: tuple[float, float], shape: tuple[int, int]) -> Floats:
        """Pixels of a patch along lines of equal range and of equal Doppler, (nx, ny, 3). [m]"""
        return self.lines.grid(centre, spacing, shape)

    def image(self, history: PhaseHistory, grid: Floats, on_pixels: OnPixels) -> Complexes:
        """Form the baseband image (nx, ny) at the pixel positions `grid`, (nx, ny, 3). [m]

        The image is formed in blocks. After each block `on_pixels` is called with the number of its pixels.
        """
        return _in_blocks(lambda block: self._formed(history, block), grid, on_pixels)

    def seconds(self, trial_history: PhaseHistory, pulses: int, grid: Floats) -> float:
        """Estimate the time to form an image from `pulses` pulses, based on a timed trial with few pulses. [s]"""
        is_quick = not self.is_direct and self.kernel != "numpy"
        return _extrapolated(
            self._formed, trial_history, pulses, grid, _COMPILED_TRIAL_PIXELS if is_quick else _TRIAL_PIXELS
        )

    def _formed(self, history: PhaseHistory, points: Floats) -> Complexes:
        formed = matched_filter(history, points) if self.is_direct else backprojection(history, points, self.kernel)
        formed *= self.lines.baseband(points, SPEED_OF_LIGHT_MPS / float(self.radar.center_frequency))
        return formed


@dataclass(frozen=True, slots=True, eq=False)
class PlaneWaves:
    """Image former with plane waves: far-field filter, or polar format.

    `sight` (times, 2) holds the horizontal components of a sum of two unit vectors: from the scene centre to the
    transmitter and to the receiver, both on their measured paths. The number of slow times is odd, so that the middle
    one is mid-aperture. The filter is equation (12) of Rigling & Moses, and the polar format uses equations (13) and
    (14). `is_polar` selects the polar format.
    """

    sight: Floats
    center_frequency: float
    bandwidth: float
    is_polar: bool
    bytes_held: float = _DIRECT_BYTES

    @property
    def middle(self) -> Floats:
        """Ground components of the sum of the unit vectors to both platforms at mid-aperture, (2,)."""
        towards: Floats = self.sight[len(self.sight) // 2]
        return towards

    @property
    def azimuth(self) -> float:
        """Bistatic look direction φ_b of equation (11) in Rigling & Moses, computed from the measured paths. [rad]"""
        return math.atan2(self.middle[1], self.middle[0])

    def place(self, displaced: GroundVector, recorded: Floats) -> GroundVector:
        """Ground point at which a target appears in the image, east and north. [m]

        At this point the plane-wave model, equation (5) of Rigling & Moses, is the best fit to the range history
        `recorded` [m]: the variance of the residual phase is smallest.
        """
        slow_time, sampling = np.linspace(-1, 1, len(self.sight)), nodes(_HISTORY_ORDER + 1)
        fitted = np.polynomial.legendre.legfit(slow_time, np.c_[self.sight, recorded], _HISTORY_ORDER)
        *sight, error = np.polynomial.legendre.legval(sampling.places, fitted)[..., None]
        matrix = GroundMatrix.of(np.array(sight), sampling.fit, np.atleast_1d(band_variance(self)))
        by_east, by_north = ((weights * error).sum() for weights in matrix.place_weights)
        return float(by_east), float(by_north)

    def remaining_range(self, ground_point: GroundVector, remaining_range: Floats, recorded: Floats) -> Floats:
        """Recorded range history of a target minus the plane-wave range history of `ground_point`. [m]

        `recorded` [m] is the range history relative to the range history of the scene centre. The result includes the
        error of the far-field approximation.
        """
        range_history: Floats = recorded + self.sight @ np.asarray(ground_point)
        return range_history

    def cells(self, centre: GroundVector) -> tuple[float, float]:
        """Resolution along x′ and y′ for the full wave-number support, including the corners of the aperture. [m]"""
        cosine, sine = math.cos(self.azimuth), math.sin(self.azimuth)
        along, across = cells_of_support(self.sight, np.array([[cosine, -sine], [sine, cosine]]), self)  # (9)
        return float(along), float(across)

    def sampled(self, centre: GroundVector) -> tuple[float, float]:
        """Cell sizes along x′ and y′ that set the pixel spacing. They are equal to the resolution. [m]"""
        return self.cells(centre)

    def look(self, centre: GroundVector) -> Floats:
        """Direction of x′, a unit vector (2,) towards the platforms. It is the same at all points."""
        return np.array([math.cos(self.azimuth), math.sin(self.azimuth)])

    def offsets(self, ground_points: Floats, centre: GroundVector) -> Floats:
        """Signed distances of ground points from a centre along the rotated axes x′ and y′, in resolution cells.

        The points and the result are (n, 2).
        """
        cosine, sine = self.look(centre)
        rotated = (ground_points - np.asarray(centre)) @ np.array([[cosine, -sine], [sine, cosine]])
        return np.asarray(rotated / np.array(self.cells(centre)))

    def grid(self, centre: GroundVector, spacing: tuple[float, float], shape: tuple[int, int]) -> Floats:
        """Pixels of a patch along the axes x′ and y′ of equation (10) in Rigling & Moses, (nx, ny, 3). [m]"""
        size = (spacing[0] * shape[0], spacing[1] * shape[1])
        return ground_grid(centre, self.azimuth, size, shape)

    def image(self, history: PhaseHistory, grid: Floats, on_pixels: OnPixels) -> Complexes:
        """Form the baseband image (nx, ny) at the pixel positions `grid`, (nx, ny, 3). [m]

        For the polar format, `grid` must be a result of the method `grid`. After each block of the image `on_pixels`
        is called with the number of its pixels.
        """
        if not self.is_polar:
            return _in_blocks(lambda block: far_field_filter(history, block) * self._carrier(block), grid, on_pixels)
        nx, ny = grid.shape[:2]
        size = tuple(
            count * float(np.linalg.norm(grid[step] - grid[0, 0]))
            for count, step in ((nx, (1, 0)), (ny, (0, 1)))
        )  # fmt: skip
        east, north = (float(coordinate) for coordinate in grid[nx // 2, ny // 2, :2])
        formed = polar_format(history, self.azimuth, (size[0], size[1]), (nx, ny), (east, north)).image
        on_pixels(nx * ny)
        return formed * self._carrier(grid)

    def seconds(self, trial_history: PhaseHistory, pulses: int, grid: Floats) -> float:
        """Estimate the time to form an image from `pulses` pulses. [s]

        If the image is formed by Fourier transforms, the time is estimated from the numbers of samples and pixels.
        Otherwise, for the far-field filter without finufft, it is extrapolated from a timed trial with few pulses.
        """
        if not self.is_polar and not is_nonuniform():
            return _extrapolated(far_field_filter, trial_history, pulses, grid, _TRIAL_PIXELS)
        pixels = grid.shape[0] * grid.shape[1]
        blocks = 1 if self.is_polar else -(-pixels // _PROGRESS_PIXELS_COUNT)
        return _SECONDS_PER_SAMPLE * float(blocks * pulses * trial_history.frequency.size + pixels)

    def _carrier(self, points: Floats) -> Complexes:
        """Phasor that removes the phase of the plane-wave range at mid-aperture from an image at points (..., 3).

        It is the counterpart of `RangeLines.baseband`, which uses exact ranges.
        """
        wavenumber = 2 * math.pi * self.center_frequency / SPEED_OF_LIGHT_MPS
        carrier: Complexes = np.exp(1j * wavenumber * (points[..., :2] @ self.middle))
        return carrier


Former = ExactRangeFormer | PlaneWaves


def _extrapolated(
    form: Callable[[PhaseHistory, Floats], Complexes],
    trial_history: PhaseHistory,
    pulses: int,
    grid: Floats,
    trial_count: int,
) -> float:
    """Estimate the time to form a full image, based on a timed trial with few pixels and few pulses. [s]

    The trial is run twice and the second run is timed, because the first may include compilation. `trial_count` is
    the largest number of pixels in the trial.
    """
    trial_pixels = grid[: max(1, trial_count // grid.shape[1]), :trial_count]
    form(trial_history, trial_pixels)
    start_time = time.perf_counter()
    form(trial_history, trial_pixels)
    trial_seconds = time.perf_counter() - start_time
    return float(trial_seconds * grid.size / trial_pixels.size * pulses / len(trial_history.slow_time))


def _in_blocks(form: Callable[[Floats], Complexes], grid: Floats, on_pixels: OnPixels) -> Complexes:
    formed = np.empty(grid.shape[:2], dtype=complex)
    rows = max(1, _PROGRESS_PIXELS_COUNT // grid.shape[1])
    for start in range(0, grid.shape[0], rows):
        block = grid[start : start + rows]
        formed[start : start + rows] = form(block)
        on_pixels(block.shape[0] * block.shape[1])
    return formed
