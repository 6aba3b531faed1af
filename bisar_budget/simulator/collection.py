"""The collection of a mission and images of one point in it, with any errors, where exact ranges put it."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.constants import SPEED_OF_LIGHT
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
    cell_centres,
    direct_path_error,
    direct_path_ways,
    exact_effect,
    path,
)

_WIDEST = 1.5  # cells of the bandwidth that a spectrum may be wide: half of what three samples per cell can hold
OVERSAMPLING = 2.5  # samples of an image per resolution cell
CELLS = 48  # resolution cells of a cross-range cut; fewer blur the aperture by over 1 % of a phase under a taper
RANGE_CELLS = 8  # of a chip
_FREQUENCIES = 64  # at least; half of them for the response itself
MAX_CELLS = 1024
_BYTES_PER_PIXEL = 16 * 16  # two images, their grid, and what forming or refocusing one holds at once
_BYTES_PER_SAMPLE = 16 * 5  # of the phase history; it is a product of terms of its own size
CONTRIBUTIONS = 1 << 21  # of pulses to pixels, which the reading of an image holds at once
_BYTES_PER_CONTRIBUTION = 8 + 2 * 16  # in single and in double precision
_STRIDE = 4  # pixels from one step along a line to the next; between them a cubic is drawn
_STRETCH = 4.0  # of a pixel, at most: where Doppler hardly changes along a line
_TIMES = 65  # at which paths show how far the line of sight turns
_ONE_WAY = 0.99  # of all that Doppler runs through over the aperture, which its ends span unless it turns back
_SLANT = 60.0  # of the way from line to line, at most: where equal Doppler runs along equal range
_CORRECTIONS = 3  # of each pixel's range sum
_BLOCK = 1 << 14  # pixels corrected at once
_PULSES_PER_CELL, _LARGE_CELLS = 4, 128  # a response repeats after as many cells as there are pulses


@dataclass(frozen=True, slots=True, eq=False)
class RangeLines:
    """Ground pixels along lines of equal range and of equal Doppler, in which a response is a product.

    A straight grid leaves a response where a platform is near: its ridge follows an ellipse, and its sidelobes in
    range follow lines of equal Doppler. Here the pixels of a line have one range sum at the aperture midpoint, those
    of a column one change of the range sum over the aperture. Lines are followed from the middle outwards, so a patch
    may bend around a platform.

    Where the line of sight turns so far that Doppler turns back, as on a full circle, no range sums of three moments
    say where a point is: there pixels lie along straight lines, and sample the whole wave-number support.

    Both platforms are where they were measured at an odd number of times, evenly over the aperture, (times, 3). [m]
    """

    transmitter: Floats
    receiver: Floats

    def gradients(self, points: Floats) -> tuple[Floats, Floats]:
        """Gradients of the midpoint's range sum and of its change over the aperture, at points (..., 2): (..., 2)."""
        first, middle, last = self._sums(points)
        return middle, last - first

    def _sums(self, points: Floats) -> tuple[Floats, Floats, Floats]:
        """Gradients of the range sum at the beginning, the middle and the end, at points (..., 2): (..., 2)."""
        sums = self._gradients(points, np.array([0, len(self.transmitter) // 2, -1]))
        return sums[..., 0, :], sums[..., 1, :], sums[..., 2, :]

    def _gradients(self, points: Floats, times: slice | NDArray[np.intp]) -> Floats:
        """Gradients of the range sum at some of the times, at points (..., 2): (..., times, 2)."""
        sums: Floats = np.zeros(1)
        for platform in (self.transmitter[times], self.receiver[times]):
            ground = points[..., None, :] - platform[:, :2]
            square = ground[..., 0] ** 2 + ground[..., 1] ** 2 + platform[:, 2] ** 2
            sums = sums + ground / np.sqrt(square)[..., None]
        return sums

    @property
    def turns_back(self) -> bool:
        """Whether Doppler turns back along the line of equal range through the scene centre."""
        every = self._gradients(np.zeros(2), slice(None))
        along = every @ _left(every[len(every) // 2])
        return bool(abs(along[-1] - along[0]) < _ONE_WAY * np.ptp(along))

    @staticmethod
    def _column(by_range: Floats, by_doppler: Floats) -> Floats:
        """Way along equal Doppler on which the range sum grows by 1, at points (..., 2)."""
        slant = _left(by_doppler)
        square, slope = _dot(by_range, by_range), _dot(by_range, slant)
        # Across the lines of equal range instead where that would lead too far.
        keeps = _dot(slant, slant) * square <= _SLANT**2 * slope**2
        way: Floats = np.where(keeps, slant / np.where(keeps, slope, 1.0), by_range / square)
        return way

    def range_sum(self, points: Floats) -> Floats:
        """At the midpoint, of ground points (..., 2 or 3), (...). [m]"""
        return self._range_sum(points, [len(self.transmitter) // 2])

    def carrier(self, points: Floats) -> Floats:
        """Range sum whose phase is taken out of images: at the midpoint, or where Doppler turns back its mean. [m]"""
        return self._range_sum(
            points, range(len(self.transmitter)) if self.turns_back else [len(self.transmitter) // 2]
        )

    def _range_sum(self, points: Floats, times: Sequence[int]) -> Floats:
        """Mean over some of the times, of ground points (..., 2 or 3), (...). [m]"""
        total: Floats = np.zeros(points.shape[:-1])
        for x, y, z in (platform[time] for time in times for platform in (self.transmitter, self.receiver)):
            total += np.sqrt((points[..., 0] - x) ** 2 + (points[..., 1] - y) ** 2 + z**2)
        return total / len(times)

    def turns_left(self, centre: GroundVector) -> bool:
        """Whether the range sum grows over the aperture for points counter-clockwise of a ground point."""
        by_range, by_doppler = self.gradients(np.asarray(centre, dtype=float))
        return float(by_doppler @ _left(by_range)) < 0

    def axes(self, centre: GroundVector) -> Floats:
        """Directions of x′, towards the platforms, and y′, counter-clockwise of it, as columns (2, 2)."""
        by_range = self.gradients(np.asarray(centre, dtype=float))[0]
        towards = -by_range / float(np.hypot(*by_range))
        return np.stack((towards, _left(towards)), axis=1)

    def cells(self, centre: GroundVector, radar: Band) -> tuple[float, float]:
        """Resolution at a ground point: peak to first null across the lines of equal range, and along them. [m]

        Where Doppler turns back they are the cells that sample the wave-number support.
        """
        place = np.asarray(centre, dtype=float)
        if self.turns_back:
            across, along = cells_of_support(self._gradients(place, slice(None)), self.axes(centre), radar)
            return float(across), float(along)
        by_range, by_doppler = self.gradients(place)
        steepness, area = float(np.hypot(*by_range)), abs(float(by_doppler @ _left(by_range)))
        if not area:
            raise ValueError("range or Doppler does not change over the ground there: no image plane")
        wavelength = SPEED_OF_LIGHT / radar.center_frequency
        return SPEED_OF_LIGHT / (radar.bandwidth * steepness), wavelength / (area / steepness)

    def sampled(self, centre: GroundVector, radar: Band) -> tuple[float, float]:
        """Cells for pixels to sample: those of `cells`, or finer ones across the lines. [m]

        Over a long aperture near a platform wavefronts bend: beside a point, along its column, it is out of focus
        within less than a cell, and the spectrum there is wider than that of the bandwidth.
        """
        across, along = self.cells(centre, radar)
        if self.turns_back:
            return across, along
        first, middle, last = self._sums(np.asarray(centre, dtype=float))
        column = self._column(middle, last - first) * float(np.hypot(*middle))  # by a metre across the lines
        wider = abs(float(((first + last) / 2 - middle) @ column)) * radar.center_frequency / SPEED_OF_LIGHT
        return min(across, _WIDEST / (1 / across + wider)), along

    def offsets(self, places: Floats, centre: GroundVector, radar: Band) -> Floats:
        """Resolution cells from a ground point along x′ and y′, by range sum and by its change over the aperture.

        Places (n, 2) give (n, 2).
        """
        if self.turns_back:
            return np.asarray((places - np.asarray(centre)) @ self.axes(centre) / np.array(self.cells(centre, radar)))
        points = np.concatenate(([centre], places))
        nearer, last, first = (self._range_sum(points, [time]) for time in (len(self.transmitter) // 2, -1, 0))
        turned = (1 if self.turns_left(centre) else -1) * (last - first)
        cells = (nearer[0] - nearer) * radar.bandwidth, (turned - turned[0]) * radar.center_frequency
        return np.stack(cells, axis=1)[1:] / SPEED_OF_LIGHT

    def baseband(self, points: Floats, wavelength_m: float) -> Complexes:
        """Phase that takes the `carrier` out of an image of points (..., 3).

        What stays is the aperture's own spectrum. A backprojected image carries the phase of the range to each
        pixel, which close to a platform is a chirp across the patch and hides the aperture from autofocus.
        """
        left = self.carrier(points) - self.carrier(np.zeros(2))
        phase: Complexes = np.exp(-2j * math.pi / wavelength_m * left)
        return phase

    def grid(self, centre: GroundVector, spacing: tuple[float, float], shape: tuple[int, int]) -> Floats:
        """Pixels around a ground point.

        Parameters
        ----------
        centre : (2,) float
            East, north; the pixel (nx // 2, ny // 2). [m]
        spacing : (2,) float
            At the centre, across the lines and along them. [m]
        shape : (2,) int
            Lines, towards the platforms, and pixels of a line, counter-clockwise.

        Returns
        -------
        (nx, ny, 3) ndarray
            East, north, up. [m]
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
            """To the next line, along equal Doppler."""
            return range_step * self._column(*self.gradients(points))

        def along(points: Floats) -> Floats:
            """To the next pixel of a line, by an equal step of Doppler; as long as may be where there is none."""
            g, d = self.gradients(points)
            tangent = -_left(g) / np.sqrt(_dot(g, g))
            slope, longest = _dot(d, tangent), _STRETCH * spacing[1]
            keeps = slope * longest / doppler_step > 1
            return np.where(keeps, doppler_step / np.where(keeps, slope, 1.0), longest) * tangent

        start = _followed(across, middle, nx)
        followed = np.moveaxis(_followed(along, start, ny), 0, 1)
        wanted = self.range_sum(middle) + range_step * (np.arange(nx) - nx // 2)
        grid = np.zeros((nx, ny, 3))
        lines = max(1, _BLOCK // ny)
        for top in range(0, nx, lines):
            part = slice(top, top + lines)
            points = followed[part]
            for _ in range(_CORRECTIONS):
                g = self.gradients(points)[0]
                off = (wanted[part, None] - self.range_sum(points)) / np.sum(g**2, axis=-1)
                points = points + off[..., None] * g
            grid[part, :, :2] = points
        return grid


class Chip(NamedTuple):
    """Image of a patch, (nx, ny), and its pixels, (nx, ny, 3) [m], `spacing` apart at the middle [m].

    Lines, along y′, are lines of equal range, columns those of equal Doppler, by the measured paths. The phase of the
    range to each pixel at the midpoint is taken out, so that the spectrum is that of the aperture, about zero.
    """

    image: Complexes
    grid: Floats
    spacing: tuple[float, float]

    @property
    def cut(self) -> Complexes:
        """Cross-range line through the centre, (ny,)."""
        middle: Complexes = self.image[self.image.shape[0] // 2]
        return middle

    def within(self, cells: int) -> "Chip":
        """The middle of the chip, so many resolution cells of y′ at most."""
        columns = 2 * round(cells * OVERSAMPLING / 2)
        start = self.image.shape[1] // 2 - columns // 2
        if start <= 0:
            return self
        part = slice(start, start + columns)
        return Chip(self.image[:, part], self.grid[:, part], self.spacing)


class PointCollection:
    """A mission's collection, for images of a single point."""

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
        self._kept: tuple[object, Floats, tuple[float, float]] | None = None

    @property
    def range_cell(self) -> float:
        """Resolution of the range sum, c/B. [m]"""
        return SPEED_OF_LIGHT / self.radar.bandwidth

    def window(self, count: int) -> Floats:
        """Weights over the aperture, or the band, at the centres of equal cells."""
        return taylor_window(count) if self.is_tapered else np.ones(count)

    def flight(self, errors: Errors, slow_time: Floats, rng: np.random.Generator | None = None) -> Flight:
        """Both platforms flown with errors; where the direct path is the clock, measured paths are in its error.

        Wideband vibration needs a generator.
        """
        ways = direct_path_ways(self.geometry, slow_time) if self.has_direct_path else (None, None)
        transmitter = path(self.geometry.transmitter, slow_time, errors.transmitter, rng, ways[0])
        receiver = path(self.geometry.receiver, slow_time, errors.receiver, rng, ways[1])
        clock: Floats = np.asarray(np.polynomial.polynomial.polyval(slow_time, errors.clock), dtype=float)
        if errors.clock_course is not None:
            clock = clock + errors.clock_course.at(slow_time)
        if self.has_direct_path:
            clock = clock + direct_path_error((transmitter, receiver))
        if errors.electrons is None:
            return Flight(transmitter, receiver, clock, clock)
        square = self.radar.center_frequency**2
        group = errors.electrons.at(slow_time)
        seen = clock + seen_course(group, errors.electrons.mean, CONTENT) / square
        return Flight(transmitter, receiver, clock, seen, group)

    def record(
        self,
        flight: Flight,
        scatterers: Floats,
        amplitudes: Complexes,
        slow_time: Floats,
        frequencies: int,
        **noise: Any,
    ) -> PhaseHistory:
        """Phase history of scatterers (n, 3) at so many frequencies over the band, under the window."""
        frequency = self.radar.center_frequency + cell_centres(self.radar.bandwidth, frequencies)
        history = flight.record(scatterers, amplitudes, slow_time, frequency, **noise)
        if self.is_tapered:
            history.samples[:] *= np.outer(self.window(slow_time.size), self.window(frequencies))
        return history

    def effect(self, errors: Errors, seen_from: GroundVector = (0.0, 0.0)) -> ExactEffect:
        """Displacement and phases of a point of the ground, by exact ranges.

        Raises
        ------
        ValueError
            No ground point has the recorded range history.
        """
        flight = self.flight(errors.slow(), self._nodes)
        transmitter, receiver = (one.seen_from(seen_from) for one in flight.paths)
        return exact_effect(self._nodes, transmitter, receiver, flight.seen, self.radar, self.aperture_time)

    def range_lines(self, errors: Errors) -> RangeLines:
        """Lines of equal range by the measured paths, vibration left out: what a processor lays its grid by."""
        times = np.linspace(-1.0, 1.0, _TIMES) * self.aperture_time / 2
        return RangeLines(*(one.measured for one in self.flight(errors.smooth(), times).paths))

    def chip(
        self,
        centre: GroundVector,
        errors: Errors,
        *,
        scatterer: GroundVector = (0.0, 0.0),
        cells: int = CELLS,
        range_cells: int = 0,
        is_reference: bool = False,
    ) -> Chip:
        """Form the image of a scatterer around a ground point, without noise.

        Parameters
        ----------
        centre : (2,) float
            East, north. [m]
        errors : Errors
            In the recorded data, and in the paths that the image is formed with.
        scatterer : (2,) float
            East, north. [m]
        cells, range_cells : int
            Extent in resolution cells along y′ and x′; no range cells give the single line through the centre.
        is_reference : bool
            The platforms flew as they were measured, by a perfect clock: what the image of the same processor
            would be without error.

        Raises
        ------
        ValueError
            The patch aliases with the mission's pulses, or is too large to be formed; or forming or reading it takes
            more than `memory_limit`. No data are formed before that is known.
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
        self, errors: Errors, place: GroundVector, cells: int = CELLS, range_cells: int = RANGE_CELLS
    ) -> tuple[Chip, Chip]:
        """Image of errors around the place they move the point to, and of no error there: see `chip`."""
        return (
            self.chip(place, errors, cells=cells, range_cells=range_cells),
            self.chip(place, errors, scatterer=place, cells=cells, range_cells=range_cells, is_reference=True),
        )

    def _grid(
        self, centre: GroundVector, errors: Errors, cells: int, range_cells: int
    ) -> tuple[Floats, tuple[float, float]]:
        """Pixels of a chip and their spacing; the last one is kept, since images come in pairs."""
        key = (centre, errors.smooth(), cells, range_cells)
        if self._kept is None or self._kept[0] != key:
            lines = self.range_lines(errors)
            cell = lines.sampled(centre, self.radar)
            finer = lines.cells(centre, self.radar)[0] / cell[0]
            self._require_room(cells, finer * range_cells)
            spacing = (cell[0] / OVERSAMPLING, cell[1] / OVERSAMPLING)
            shape = (max(1, 2 * round(finer * range_cells * OVERSAMPLING / 2)), 2 * round(cells * OVERSAMPLING / 2))
            self._kept = (key, lines.grid(centre, spacing, shape), spacing)
        return self._kept[1:]

    def _frequencies(self, grid: Floats, flight: Flight, scatterer: GroundVector) -> int:
        """How many keep a range profile from repeating within a patch: its range walk sets that."""
        farthest = 0.0
        point = np.array([*scatterer, 0.0])
        for pulse in (0, len(flight.clock) // 2, -1):
            off = np.zeros(grid.shape[:-1])
            if self.has_direct_path:  # takes out most of what a distant platform's error puts in
                off -= SPEED_OF_LIGHT * flight.clock[pulse]
            for one in flight.paths:
                off += np.linalg.norm(grid - one.measured[pulse], axis=-1)
                off -= np.linalg.norm(point - one.actual[pulse])
            farthest = max(farthest, float(np.abs(off).max()))
        cells = 2 * farthest * self.radar.bandwidth / SPEED_OF_LIGHT
        return max(_FREQUENCIES, 16 * math.ceil((cells + _FREQUENCIES / 2) / 16))

    def _require_room(self, cells: int, range_cells: float) -> None:
        """Refuse a patch that aliases or is too large. More pulses than it takes would change nothing."""
        if cells > MAX_CELLS:
            raise ValueError(f"a patch of {cells} resolution cells, at most {MAX_CELLS} are formed")
        if self.pulses is not None and self.pulses < 2 * cells:
            raise ValueError(
                f"collection.pulses is {self.pulses}, but the patch with its echoes is {cells} resolution cells wide "
                f"and aliases below {2 * cells} pulses; omit the key to get what it takes"
            )
        pixels = max(1, round(range_cells * OVERSAMPLING)) * round(cells * OVERSAMPLING)
        self._require_memory(pixels, pulses_for(cells), _FREQUENCIES)

    def _require_memory(self, pixels: int, pulses: int, frequencies: int) -> None:
        """Refuse what is beyond the limit: forming an image and the one beside it, or reading both."""
        forming = pulses * frequencies * _BYTES_PER_SAMPLE + bytes_held(self.kernel)
        reading = _BYTES_PER_CONTRIBUTION * min(pulses * pixels, 2 * CONTRIBUTIONS) + bytes_held("numpy")
        needed = pixels * _BYTES_PER_PIXEL + max(forming, reading)
        if needed > self.memory_limit:
            raise ValueError(
                f"an image of {pixels} pixels from {pulses} pulses of {frequencies} frequencies needs about "
                f"{needed / 1e6:.4g} MB, simulation.memory_limit is {self.memory_limit / 1e6:.4g} MB: raise it"
            )


def pulses_for(cells: int) -> int:
    """Pulses of an image; of a large patch half as many, its repeats being far enough away."""
    return max(_PULSES_PER_CELL * min(cells, _LARGE_CELLS), _PULSES_PER_CELL // 2 * cells)


def _followed(step: Callable[[Floats], Floats], start: Floats, count: int) -> Floats:
    """Follow a field of steps both ways from points (..., 2), (count, ..., 2), the start at count // 2."""
    back = count // 2
    way = np.array([-1.0, 1.0]).reshape(2, *[1] * start.ndim)
    place = np.stack((start, start))
    velocity = way * step(place)
    pixels = [place[:1]]
    within = (np.arange(1, _STRIDE + 1) / _STRIDE).reshape(-1, *[1] * place.ndim)
    for _ in range(-(-back // _STRIDE)):
        half = place + _STRIDE / 2 * velocity
        ahead = place + _STRIDE * way * step(half)
        slope = way * step(ahead)
        pixels.append(_between(place, velocity, ahead, slope, within))
        place, velocity = ahead, slope
    out = np.concatenate(pixels[1:]) if back else np.empty((0, *place.shape))
    return np.concatenate((out[:back, 0][::-1], pixels[0], out[: count - 1 - back, 1]))


def _between(a: Floats, slope_a: Floats, b: Floats, slope_b: Floats, t: Floats) -> Floats:
    """Cubic through two points with their slopes per pixel."""
    slope_a, slope_b = _STRIDE * slope_a, _STRIDE * slope_b
    s = 1 - t
    cubic: Floats = s * s * (1 + 2 * t) * a + t * t * (1 + 2 * s) * b + s * t * (s * slope_a - t * slope_b)
    return cubic


def _dot(a: Floats, b: Floats) -> Floats:
    """Scalar products of plane vectors, (..., 1)."""
    return a[..., :1] * b[..., :1] + a[..., 1:] * b[..., 1:]


def _left(vectors: Floats) -> Floats:
    """Turned by a quarter, counter-clockwise."""
    turned: Floats = vectors[..., ::-1] * np.array([-1.0, 1.0])
    return turned
