"""Simulation of a mission's data collection with errors, and of images around the displaced point of a scatterer."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Unpack

import numpy as np
from numpy.typing import NDArray

from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.effects.air_delays import CONTENT, seen_course
from bisar_budget.geometry import BistaticGeometry, GroundVector
from bisar_budget.image_plane import Band
from bisar_budget.mission.model import Mission, Simulation
from bisar_budget.ranges.exact_ranges import ExactEffect, aperture_nodes
from bisar_budget.ranges.resolution import cells_of_support
from bisar_budget.simulator.image_formation import (
    backprojection,
    bytes_held,
    ground_grid,
    kernel_within,
    taylor_window,
)
from bisar_budget.simulator.phase_history import (
    Complexes,
    Errors,
    Flight,
    Floats,
    PhaseHistory,
    ReceiverNoise,
    cell_centres,
    direct_path_error,
    direct_path_ways,
    exact_effect,
    path,
)

OVERSAMPLING_FACTOR = 2.5  # samples of an image per resolution cell
CUT_CELLS = 48  # resolution cells of a cross-range cut; with fewer, a phase under a taper is wrong by over 1 %
RANGE_CELLS = 8  # resolution cells of a chip in range
MAX_CELLS = 1024
MAX_CONTRIBUTION_COUNT = 1 << 21  # products of pulses and pixels that are in memory at once when an image is measured

_MAX_SPECTRUM_CELLS = (
    1.5  # ratio of a spectrum's width to the bandwidth: half of the ratio that three samples per cell allow
)
_MIN_CHIP_FREQUENCY_COUNT = 64  # half of them are for the response itself
_BYTES_PER_PIXEL = 16 * 16  # two images, their grid, and the arrays that form or refocus one of them
_BYTES_PER_SAMPLE = 16 * 5  # of the phase history; it is a product of terms of its own size
_BYTES_PER_CONTRIBUTION = 8 + 2 * 16  # in single and in double precision
_GRID_STRIDE_PIXELS = 4  # pixels in a step along a line; a cubic interpolates between steps
_MAX_STRETCH_FACTOR = 4.0  # largest ratio of pixel length to spacing, used where Doppler hardly changes along a line
_PATH_SAMPLES = 65  # slow times of the paths from which the turn of the line of sight is computed
_ONE_WAY_FRACTION = 0.99  # smallest fraction of the Doppler interval that the aperture's ends span without reversal
_MAX_SLANT_RATIO = 60.0  # largest ratio of a step to the shortest step; with more, both kinds of lines are parallel
_CORRECTION_STEPS = 3  # Newton steps that correct each pixel's range sum
_BLOCK_PIXELS_COUNT = 1 << 14  # pixels that are corrected at once
_PULSES_PER_CELL, _LARGE_PATCH_CELLS = 4, 128  # a response repeats after as many cells as there are pulses


@dataclass(frozen=True, slots=True, eq=False)
class RangeLines:
    """Grid of ground pixels along lines of equal range and of equal Doppler.

    On this grid a point response is the product of its range cut and its cross-range cut. On a straight grid this
    does not hold if a platform is near, because the cross-range cut follows an ellipse, and the range sidelobes
    follow lines of equal Doppler. Here all pixels of a line have the same range sum at mid-aperture, and all pixels
    of a column have the same change of the range sum over the aperture. Lines are followed from the middle outwards,
    so a patch may bend around a platform.

    Doppler may reverse within the aperture if the line of sight turns far, as on a full circle. The range sums at the
    start, middle and end of the aperture then do not determine a point. In this case the pixels are placed along
    straight lines, with a spacing that samples the full wave-number support.

    `transmitter` and `receiver` (times, 3) [m] are the measured positions at an odd number of times that are evenly
    spaced over the aperture.
    """

    transmitter: Floats
    receiver: Floats

    def gradients(self, points: Floats) -> tuple[Floats, Floats]:
        """Ground gradients of the range sum at mid-aperture, and of its change over the aperture. [m/m]

        For points (..., 2) the results are two arrays (..., 2), in this order. The change is the last range sum minus
        the first.
        """
        first, middle, last = self._sums(points)
        return middle, last - first

    def _sums(self, points: Floats) -> tuple[Floats, Floats, Floats]:
        """Ground gradients of the range sum at the start, middle and end of the aperture. [m/m]

        For points (..., 2) the results are three arrays (..., 2).
        """
        sums = self._gradients(points, np.array([0, len(self.transmitter) // 2, -1]))
        return sums[..., 0, :], sums[..., 1, :], sums[..., 2, :]

    def _gradients(self, points: Floats, times: slice | NDArray[np.intp]) -> Floats:
        """Ground gradients of the range sum at selected times. [m/m]

        `times` are indices into the times of the paths. For points (..., 2) the result is (..., times, 2).
        """
        sums: Floats = np.zeros(1)
        for platform in (self.transmitter[times], self.receiver[times]):
            ground = points[..., None, :] - platform[:, :2]
            square = ground[..., 0] ** 2 + ground[..., 1] ** 2 + platform[:, 2] ** 2
            sums = sums + ground / np.sqrt(square)[..., None]
        return sums

    @property
    def turns_back(self) -> bool:
        """Whether Doppler reverses within the aperture along the line of equal range through the scene centre."""
        gradients = self._gradients(np.zeros(2), slice(None))
        along = gradients @ _left(gradients[len(gradients) // 2])
        return bool(abs(along[-1] - along[0]) < _ONE_WAY_FRACTION * np.ptp(along))

    @staticmethod
    def _column(by_range: Floats, by_doppler: Floats) -> Floats:
        """Ground vector along the line of equal Doppler that increases the range sum by one metre, (..., 2). [m/m]

        `by_range` and `by_doppler` are the results of `gradients` at points (..., 2). Where this vector would be too
        long, it is replaced by a vector perpendicular to the lines of equal range.
        """
        slant = _left(by_doppler)
        square, slope = _dot(by_range, by_range), _dot(by_range, slant)
        is_short = _dot(slant, slant) * square <= _MAX_SLANT_RATIO**2 * slope**2
        step: Floats = np.where(is_short, slant / np.where(is_short, slope, 1.0), by_range / square)
        return step

    def range_sum(self, points: Floats) -> Floats:
        """Range sum at mid-aperture for ground points. [m]

        For points (..., 2 or 3) the result has the shape (...).
        """
        return self._range_sum(points, [len(self.transmitter) // 2])

    def carrier(self, points: Floats) -> Floats:
        """Range sum whose phase is removed from images, for ground points. [m]

        For points (..., 2 or 3) the result has the shape (...). It is the range sum at mid-aperture, or the mean
        range sum over time if Doppler reverses within the aperture.
        """
        return self._range_sum(
            points, range(len(self.transmitter)) if self.turns_back else [len(self.transmitter) // 2]
        )

    def _range_sum(self, points: Floats, times: Sequence[int]) -> Floats:
        """Mean range sum over the times with the given indices. [m]

        For ground points (..., 2 or 3) the result has the shape (...).
        """
        total: Floats = np.zeros(points.shape[:-1])
        for x, y, z in (platform[time] for time in times for platform in (self.transmitter, self.receiver)):
            total += np.sqrt((points[..., 0] - x) ** 2 + (points[..., 1] - y) ** 2 + z**2)
        return total / len(times)

    def turns_left(self, centre: GroundVector) -> bool:
        """Whether the change of the range sum over the aperture increases along y′ at a ground point `centre`.

        The axis y′ is 90° counter-clockwise of the direction to the platforms.
        """
        by_range, by_doppler = self.gradients(np.asarray(centre, dtype=float))
        return float(by_doppler @ _left(by_range)) < 0

    def axes(self, centre: GroundVector) -> Floats:
        """Unit vectors along x′ and y′ at a ground point, as the columns of an array (2, 2).

        The axis x′ points towards the platforms, and y′ is 90° counter-clockwise of x′.
        """
        by_range = self.gradients(np.asarray(centre, dtype=float))[0]
        towards = -by_range / float(np.hypot(*by_range))
        return np.stack((towards, _left(towards)), axis=1)

    def cells(self, centre: GroundVector, radar: Band) -> tuple[float, float]:
        """Resolution at a ground point across and along the lines of equal range, from peak to first null. [m]

        If Doppler reverses within the aperture, the result is the pixel spacing that samples the full wave-number
        support. A `ValueError` is raised if range or Doppler is constant over the ground at this point.
        """
        ground_point = np.asarray(centre, dtype=float)
        if self.turns_back:
            across, along = cells_of_support(self._gradients(ground_point, slice(None)), self.axes(centre), radar)
            return float(across), float(along)
        by_range, by_doppler = self.gradients(ground_point)
        steepness, area = float(np.hypot(*by_range)), abs(float(by_doppler @ _left(by_range)))
        if not area:
            raise ValueError("range or Doppler does not change over the ground there: no image plane")
        wavelength = SPEED_OF_LIGHT_MPS / radar.center_frequency
        return float(SPEED_OF_LIGHT_MPS / (radar.bandwidth * steepness)), float(wavelength / (area / steepness))

    def sampled(self, centre: GroundVector, radar: Band) -> tuple[float, float]:
        """Cell sizes that set the pixel spacing, across and along the lines of equal range. [m]

        The sizes are the results of `cells`, except that the size across the lines may be smaller. If the aperture is
        long and a platform is near, the wavefronts are so strongly curved that a response is defocused along its
        column even within one cell of its peak. The spectrum along the column is then wider than the bandwidth, so
        that smaller pixels are needed.
        """
        across, along = self.cells(centre, radar)
        if self.turns_back:
            return across, along
        first, middle, last = self._sums(np.asarray(centre, dtype=float))
        column = self._column(middle, last - first) * float(np.hypot(*middle))  # step per metre across the lines
        wider = (
            abs(float(((first + last) / 2 - middle) @ column)) * float(radar.center_frequency) / SPEED_OF_LIGHT_MPS
        )
        return min(across, _MAX_SPECTRUM_CELLS / (1 / across + wider)), along

    def offsets(self, ground_points: Floats, centre: GroundVector, radar: Band) -> Floats:
        """Signed distances of ground points from a centre along x′ and y′, in resolution cells, (n, 2).

        `ground_points` is (n, 2). The distances are computed from the range sum at mid-aperture and from its change
        over the aperture. If Doppler reverses within the aperture, they are computed along straight axes.
        """
        if self.turns_back:
            return np.asarray(
                (ground_points - np.asarray(centre)) @ self.axes(centre) / np.array(self.cells(centre, radar))
            )
        points = np.concatenate(([centre], ground_points))
        nearer, last, first = (self._range_sum(points, [time]) for time in (len(self.transmitter) // 2, -1, 0))
        turned = (1 if self.turns_left(centre) else -1) * (last - first)
        cells = (nearer[0] - nearer) * radar.bandwidth, (turned - turned[0]) * radar.center_frequency
        return np.stack(cells, axis=1)[1:] / SPEED_OF_LIGHT_MPS

    def baseband(self, points: Floats, wavelength_m: float) -> Complexes:
        """Phasor that removes the phase of the `carrier` range from an image, at the pixel positions `points`.

        For points (..., 3) the result has the shape (...). The pixels of a backprojected image have the phase of
        their range. Close to a platform this phase is a chirp across the patch, which hides the spectrum of the
        aperture from autofocus. Removing the phase reveals this spectrum.
        """
        carrier_range = self.carrier(points) - self.carrier(np.zeros(2))
        phase: Complexes = np.exp(-2j * math.pi / wavelength_m * carrier_range)
        return phase

    def grid(self, centre: GroundVector, spacing: tuple[float, float], shape: tuple[int, int]) -> Floats:
        """Positions of the pixels of a patch around a ground point, along lines of equal range and of equal Doppler.

        Parameters
        ----------
        centre : (2,) float
            East and north of the pixel (nx // 2, ny // 2). [m]
        spacing : (2,) float
            Distance between neighbouring pixels at the centre, across the lines of equal range and along them. [m]
        shape : (2,) int
            Number nx of lines of equal range, and number ny of pixels per line. The first index increases towards the
            platforms, and the second index increases 90° counter-clockwise of this direction.

        Returns
        -------
        (nx, ny, 3) ndarray
            East, north and up of each pixel. [m]
        """
        nx, ny = shape
        middle = np.asarray(centre, dtype=float)
        if self.turns_back:
            east, north = self.axes(centre)[:, 0]
            return ground_grid(centre, math.atan2(north, east), (nx * spacing[0], ny * spacing[1]), shape)
        by_range, by_doppler = self.gradients(middle)
        range_step = -spacing[0] * float(np.hypot(*by_range))
        doppler_step = -spacing[1] * float(by_doppler @ _left(by_range)) / float(np.hypot(*by_range))

        def across(points: Floats) -> Floats:
            """Vectors from points (..., 2) along lines of equal Doppler to the next line of equal range. [m]"""
            return range_step * self._column(*self.gradients(points))

        def along(points: Floats) -> Floats:
            """Vectors from points (..., 2) to the next pixel on their line of equal range. [m]

            Neighbouring pixels differ by the same step in Doppler. A vector is shortened if it exceeds a maximum
            length.
            """
            g, d = self.gradients(points)
            tangent = -_left(g) / np.sqrt(_dot(g, g))
            slope, longest = _dot(d, tangent), _MAX_STRETCH_FACTOR * spacing[1]
            is_long_enough = slope * longest / doppler_step > 1
            return np.where(is_long_enough, doppler_step / np.where(is_long_enough, slope, 1.0), longest) * tangent

        start = _followed(across, middle, nx)
        followed = np.moveaxis(_followed(along, start, ny), 0, 1)
        range_sums = self.range_sum(middle) + range_step * (np.arange(nx) - nx // 2)
        grid = np.zeros((nx, ny, 3))
        lines = max(1, _BLOCK_PIXELS_COUNT // ny)
        for top in range(0, nx, lines):
            rows = slice(top, top + lines)
            points = followed[rows]
            for _ in range(_CORRECTION_STEPS):
                g = self.gradients(points)[0]
                correction = (range_sums[rows, None] - self.range_sum(points)) / np.sum(g**2, axis=-1)
                points = points + correction[..., None] * g
            grid[rows, :, :2] = points
        return grid


class Chip(NamedTuple):
    """Image of a patch, (nx, ny), and the ground points of its pixels, (nx, ny, 3). [m]

    `spacing` [m] is the distance between neighbouring pixels in the middle of the patch, along x′ and y′. According
    to the measured paths, all pixels of a line along y′ have the same range, and all pixels of a column have the same
    Doppler. The phase of the range to each pixel at mid-aperture is removed, so that the spectrum of the image is the
    spectrum of the aperture, centred at zero.
    """

    image: Complexes
    grid: Floats
    spacing: tuple[float, float]

    @property
    def cut(self) -> Complexes:
        """Cross-range cut through the centre pixel, (ny,)."""
        middle: Complexes = self.image[self.image.shape[0] // 2]
        return middle

    def within(self, cells: int) -> "Chip":
        """Crop the chip to its middle `cells` resolution cells along y′. A narrower chip is returned unchanged."""
        columns = 2 * round(cells * OVERSAMPLING_FACTOR / 2)
        start = self.image.shape[1] // 2 - columns // 2
        if start <= 0:
            return self
        middle_columns = slice(start, start + columns)
        return Chip(self.image[:, middle_columns], self.grid[:, middle_columns], self.spacing)


class PointCollection:
    """Simulated data collection of a mission, from which images of a single point are formed."""

    def __init__(self, mission: Mission, geometry: BistaticGeometry) -> None:
        self.radar, self.geometry = mission.radar, geometry
        self.wavelength = mission.radar.wavelength
        self.aperture_time = mission.collection.aperture_time
        self.has_direct_path = mission.has_direct_path
        self.pulses = mission.collection.pulses
        self.memory_limit = (mission.simulation or Simulation()).memory_limit
        self.kernel = kernel_within(self.memory_limit)
        self.is_tapered = mission.simulation is not None and mission.simulation.window == "taylor"
        self._nodes = aperture_nodes(self.aperture_time)
        self._last_grid: tuple[object, Floats, tuple[float, float]] | None = None

    @property
    def range_cell(self) -> float:
        """Resolution of the range sum, c/B. [m]"""
        return SPEED_OF_LIGHT_MPS / self.radar.bandwidth

    def window(self, count: int) -> Floats:
        """Window weights of `count` samples over the aperture or the band, (count,). They are 1 without a taper."""
        return taylor_window(count) if self.is_tapered else np.ones(count)

    def flight(self, errors: Errors, slow_time: Floats, rng: np.random.Generator | None = None) -> Flight:
        """Compute the true and measured paths of both platforms and the clock errors at given slow times.

        If the receiver uses the direct signal of the transmitter as its clock, the errors of both paths also cause a
        clock error. The random generator `rng` is needed if the errors contain wideband vibration.
        """
        metre_motions = direct_path_ways(self.geometry, slow_time) if self.has_direct_path else (None, None)
        transmitter = path(self.geometry.transmitter, slow_time, errors.transmitter, rng, metre_motions[0])
        receiver = path(self.geometry.receiver, slow_time, errors.receiver, rng, metre_motions[1])
        clock: Floats = np.asarray(np.polynomial.polynomial.polyval(slow_time, errors.clock), dtype=float)
        if errors.clock_course is not None:
            clock = clock + errors.clock_course.at(slow_time)
        if self.has_direct_path:
            clock = clock + direct_path_error((transmitter, receiver))
        if errors.electrons is None:
            return Flight(transmitter, receiver, clock, clock)
        square = self.radar.center_frequency**2
        group = errors.electrons.at(slow_time)
        seen = clock + seen_course(group, np.asarray(errors.electrons.mean), CONTENT) / square
        return Flight(transmitter, receiver, clock, seen, group)

    def record(
        self,
        flight: Flight,
        scatterers: Floats,
        amplitudes: Complexes,
        slow_time: Floats,
        frequencies: int,
        **noise: Unpack[ReceiverNoise],
    ) -> PhaseHistory:
        """Record the phase history of scatterers (n, 3) at `frequencies` frequencies over the band.

        The samples are weighted by the window of the mission, over the aperture and over the band.
        """
        frequency = self.radar.center_frequency + cell_centres(self.radar.bandwidth, frequencies)
        history = flight.record(scatterers, amplitudes, slow_time, frequency, **noise)
        if self.is_tapered:
            history.samples[:] *= np.outer(self.window(slow_time.size), self.window(frequencies))
        return history

    def effect(self, errors: Errors, seen_from: GroundVector = (0.0, 0.0)) -> ExactEffect:
        """Compute from exact ranges how errors displace a ground point in the image, and which phase errors remain.

        `seen_from` [m] holds east and north of this ground point. The displacement is relative to the point.

        Raises
        ------
        ValueError
            No ground point has the recorded range history.
        """
        flight = self.flight(errors.slow(), self._nodes)
        transmitter, receiver = (path.seen_from(seen_from) for path in flight.paths)
        return exact_effect(self._nodes, transmitter, receiver, flight.seen, self.radar, self.aperture_time)

    def range_lines(self, errors: Errors) -> RangeLines:
        """Lines of equal range along which a processor places its pixels.

        They are computed from the measured paths without vibration.
        """
        times = np.linspace(-1.0, 1.0, _PATH_SAMPLES) * self.aperture_time / 2
        return RangeLines(*(path.measured for path in self.flight(errors.smooth(), times).paths))

    def chip(
        self,
        centre: GroundVector,
        errors: Errors,
        *,
        scatterer: GroundVector = (0.0, 0.0),
        cells: int = CUT_CELLS,
        range_cells: int = 0,
        is_reference: bool = False,
    ) -> Chip:
        """Form the image of a scatterer, without noise, on a patch that is centred at a ground point.

        Parameters
        ----------
        centre : (2,) float
            East and north of the centre of the image. [m]
        errors : Errors
            Errors of the recorded data and of the measured paths from which the image is formed.
        scatterer : (2,) float
            East and north of the scatterer. [m]
        cells, range_cells : int
            Extent of the image in resolution cells along y′ and x′. If `range_cells` is 0, the image is a single line
            through the centre.
        is_reference : bool
            If true, the data are recorded as if the platforms flew the measured paths with a perfect clock. The
            result is the image that the same processor forms without errors.

        Raises
        ------
        ValueError
            The mission's number of pulses is so small that the patch aliases, the patch is too large, or forming or
            measuring the image needs more memory than `memory_limit`. This is checked before data are computed.
        """
        grid, spacing = self._grid(centre, errors, cells, range_cells)
        slow_time = cell_centres(self.aperture_time, pulses_for(cells))
        flight = self.flight(errors, slow_time)
        if is_reference:
            flight = flight.as_measured()
        frequencies = self._frequencies(grid, flight, scatterer)
        self._require_memory(grid.shape[0] * grid.shape[1], slow_time.size, frequencies)
        history = self.record(
            flight, np.array([[*scatterer, 0.0]]), np.ones(1, dtype=complex), slow_time, frequencies
        )
        image = backprojection(history, grid, self.kernel)
        image = image * self.range_lines(errors).baseband(grid, self.wavelength)
        return Chip(image, grid, spacing)

    def pair(
        self, errors: Errors, ground_point: GroundVector, cells: int = CUT_CELLS, range_cells: int = RANGE_CELLS
    ) -> tuple[Chip, Chip]:
        """Form the image of the scene centre with errors, and a reference image without errors, on the same pixels.

        `ground_point` is the displaced point at which the scene centre appears, and the centre of both images. In the
        reference image the scatterer is at `ground_point`.
        """
        return (
            self.chip(ground_point, errors, cells=cells, range_cells=range_cells),
            self.chip(
                ground_point, errors, scatterer=ground_point, cells=cells, range_cells=range_cells, is_reference=True
            ),
        )

    def _grid(
        self, centre: GroundVector, errors: Errors, cells: int, range_cells: int
    ) -> tuple[Floats, tuple[float, float]]:
        """Pixel positions of a chip, (nx, ny, 3), and the spacing of its pixels along x′ and y′. [m]

        The last grid is cached, because images are formed in pairs. A `ValueError` is raised if the patch aliases or
        is too large.
        """
        key = (centre, errors.smooth(), cells, range_cells)
        if self._last_grid is None or self._last_grid[0] != key:
            lines = self.range_lines(errors)
            cell = lines.sampled(centre, self.radar)
            finer = lines.cells(centre, self.radar)[0] / cell[0]
            self._require_room(cells, finer * range_cells)
            spacing = (cell[0] / OVERSAMPLING_FACTOR, cell[1] / OVERSAMPLING_FACTOR)
            shape = (
                max(1, 2 * round(finer * range_cells * OVERSAMPLING_FACTOR / 2)),
                2 * round(cells * OVERSAMPLING_FACTOR / 2),
            )
            self._last_grid = (key, lines.grid(centre, spacing, shape), spacing)
        return self._last_grid[1:]

    def _frequencies(self, grid: Floats, flight: Flight, scatterer: GroundVector) -> int:
        """Number of frequencies that is sufficient to keep range profiles from repeating within the patch.

        Range walk is taken into account.
        """
        farthest = 0.0
        point = np.array([*scatterer, 0.0])
        for pulse in (0, len(flight.clock) // 2, -1):
            range_difference = np.zeros(grid.shape[:-1])
            if self.has_direct_path:  # the clock error cancels most of the range error of a distant platform
                range_difference -= SPEED_OF_LIGHT_MPS * flight.clock[pulse]
            for flown in flight.paths:
                range_difference += np.linalg.norm(grid - flown.measured[pulse], axis=-1)
                range_difference -= np.linalg.norm(point - flown.actual[pulse])
            farthest = max(farthest, float(np.abs(range_difference).max()))
        cells = 2 * farthest * self.radar.bandwidth / SPEED_OF_LIGHT_MPS
        return max(_MIN_CHIP_FREQUENCY_COUNT, 16 * math.ceil((cells + _MIN_CHIP_FREQUENCY_COUNT / 2) / 16))

    def _require_room(self, cells: int, range_cells: float) -> None:
        """Raise a `ValueError` if a patch aliases, is too large or needs too much memory.

        The patch is `cells` resolution cells wide along y′ and `range_cells` along x′. The memory is computed for the
        number of pulses that the patch needs, even if the mission has more: additional pulses would not change the
        image.
        """
        if cells > MAX_CELLS:
            raise ValueError(f"a patch of {cells} resolution cells, at most {MAX_CELLS} are formed")
        if self.pulses is not None and self.pulses < 2 * cells:
            raise ValueError(
                f"collection.pulses is {self.pulses}, but the patch with its echoes is {cells} resolution cells wide "
                f"and aliases below {2 * cells} pulses; omit the key to get what it takes"
            )
        pixels = max(1, round(range_cells * OVERSAMPLING_FACTOR)) * round(cells * OVERSAMPLING_FACTOR)
        self._require_memory(pixels, pulses_for(cells), _MIN_CHIP_FREQUENCY_COUNT)

    def _require_memory(self, pixels: int, pulses: int, frequencies: int) -> None:
        """Raise a `ValueError` if forming or measuring a pair of images needs more than the allowed memory."""
        forming = pulses * frequencies * _BYTES_PER_SAMPLE + bytes_held(self.kernel)
        reading = _BYTES_PER_CONTRIBUTION * min(pulses * pixels, 2 * MAX_CONTRIBUTION_COUNT) + bytes_held("numpy")
        needed = pixels * _BYTES_PER_PIXEL + max(forming, reading)
        if needed > self.memory_limit:
            raise ValueError(
                f"an image of {pixels} pixels from {pulses} pulses of {frequencies} frequencies needs about "
                f"{needed / 1e6:.4g} MB, simulation.memory_limit is {self.memory_limit / 1e6:.4g} MB: raise it"
            )


def pulses_for(cells: int) -> int:
    """Number of pulses for a patch that is `cells` resolution cells wide in cross-range.

    A patch of up to 128 cells gets four pulses per cell. A patch of 256 or more cells needs only two pulses per cell,
    because its aliases are far from the response.
    """
    return max(_PULSES_PER_CELL * min(cells, _LARGE_PATCH_CELLS), _PULSES_PER_CELL // 2 * cells)


def _followed(step: Callable[[Floats], Floats], start: Floats, count: int) -> Floats:
    """Follow the curves of a vector field from the points `start` (..., 2) in both directions.

    `step` returns the vector from a point to the next point on its curve. The result is the points along the curves,
    (count, ..., 2), with `start` at the index count // 2.
    """
    back = count // 2
    direction = np.array([-1.0, 1.0]).reshape(2, *[1] * start.ndim)
    points = np.stack((start, start))
    velocity = direction * step(points)
    pixels = [points[:1]]
    fractions = (np.arange(1, _GRID_STRIDE_PIXELS + 1) / _GRID_STRIDE_PIXELS).reshape(-1, *[1] * points.ndim)
    for _ in range(-(-back // _GRID_STRIDE_PIXELS)):
        half = points + _GRID_STRIDE_PIXELS / 2 * velocity
        ahead = points + _GRID_STRIDE_PIXELS * direction * step(half)
        slope = direction * step(ahead)
        pixels.append(_between(points, velocity, ahead, slope, fractions))
        points, velocity = ahead, slope
    outwards = np.concatenate(pixels[1:]) if back else np.empty((0, *points.shape))
    return np.concatenate((outwards[:back, 0][::-1], pixels[0], outwards[: count - 1 - back, 1]))


def _between(a: Floats, slope_a: Floats, b: Floats, slope_b: Floats, t: Floats) -> Floats:
    """Interpolate between the points a and b by a cubic.

    `t` holds positions between the points, as fractions of the way from a (0) to b (1). `slope_a` and `slope_b` are
    the slopes of the cubic at a and b, per pixel.
    """
    slope_a, slope_b = _GRID_STRIDE_PIXELS * slope_a, _GRID_STRIDE_PIXELS * slope_b
    s = 1 - t
    cubic: Floats = s * s * (1 + 2 * t) * a + t * t * (1 + 2 * s) * b + s * t * (s * slope_a - t * slope_b)
    return cubic


def _dot(a: Floats, b: Floats) -> Floats:
    """Scalar products of plane vectors (..., 2); the result has the shape (..., 1)."""
    return a[..., :1] * b[..., :1] + a[..., 1:] * b[..., 1:]


def _left(vectors: Floats) -> Floats:
    """Rotate plane vectors (..., 2) by 90° counter-clockwise."""
    turned: Floats = vectors[..., ::-1] * np.array([-1.0, 1.0])
    return turned
