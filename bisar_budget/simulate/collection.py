"""The collection of a mission and images of one point in it, with any errors, where exact ranges put it."""

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.geometry import BistaticGeometry, GroundVector
from bisar_budget.mission.model import Mission, Simulation
from bisar_budget.ranges.exact_ranges import aperture_nodes
from bisar_budget.simulate.exact import ExactEffect, exact_effect
from bisar_budget.simulate.image_formation import backprojection, bytes_held, kernel_within, taylor_window
from bisar_budget.simulate.phase_history import (
    Complexes,
    Course,
    Floats,
    Path,
    PathError,
    cell_centres,
    direct_path_error,
    direct_path_ways,
    path,
    phase_history,
)
from bisar_budget.simulate.range_lines import Flown

OVERSAMPLING = 2.5  # samples of an image per resolution cell
CELLS = 48  # resolution cells of a cross-range cut; fewer blur the aperture by over 1 % of a phase under a taper
RANGE_CELLS = 8  # of a chip
_FREQUENCIES = 64  # at least; half of them for the response itself
MAX_CELLS = 1024
_BYTES_PER_PIXEL = 16 * 16  # two images, their grid, and what forming or refocusing one holds at once
_BYTES_PER_SAMPLE = 16 * 5  # of the phase history; it is a product of terms of its own size
CONTRIBUTIONS = 1 << 21  # of pulses to pixels, which the reading of an image holds at once
_BYTES_PER_CONTRIBUTION = 8 + 2 * 16  # in single and in double precision
_PULSES_PER_CELL, _LARGE_CELLS = 4, 128  # a response repeats after as many cells as there are pulses


class MemoryLimitError(ValueError):
    """An image beyond `simulation.memory_limit`."""


class Errors(NamedTuple):
    """Errors in one image: of both platforms, the clock's t̃₀ … t̃₃ of (1), and any other history of the clock.

    [s], [1], [1/s], [1/s²]; `clock_course` [s].
    """

    transmitter: PathError = PathError()
    receiver: PathError = PathError()
    clock: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    clock_course: Course | None = None

    def of(self, platform: str, error: PathError) -> "Errors":
        """Give one platform an error."""
        return self._replace(transmitter=error) if platform == "transmitter" else self._replace(receiver=error)

    def smooth(self) -> "Errors":
        """The same errors without vibration, and with what is smooth of other histories."""
        slow = self.slow()
        return slow._replace(transmitter=_still(slow.transmitter), receiver=_still(slow.receiver))

    def slow(self) -> "Errors":
        """The same with what is smooth of other histories: noise between a few nodes would pass for a phase."""
        return self._replace(
            transmitter=_slow(self.transmitter),
            receiver=_slow(self.receiver),
            clock_course=self.clock_course and self.clock_course.smooth(),
        )


def _slow(error: PathError) -> PathError:
    return error if error.course is None else error._replace(course=error.course.smooth())


def _still(error: PathError) -> PathError:
    return error._replace(sinusoids=(), wideband_rms=0.0)


def superposed(parts: Iterable[Errors]) -> Errors:
    """All of several polynomial errors at once; vibration is not added."""
    total = Errors()
    for part in parts:
        total = Errors(
            transmitter=superposed_motion(total.transmitter, part.transmitter),
            receiver=superposed_motion(total.receiver, part.receiver),
            clock=tuple(a + b for a, b in zip(total.clock, part.clock, strict=True)),
        )
    return total


def superposed_motion(a: PathError, b: PathError) -> PathError:
    """Two polynomial errors of one platform at once; vibration is not added."""

    def add(u: tuple[float, float, float], v: tuple[float, float, float]) -> tuple[float, float, float]:
        return (u[0] + v[0], u[1] + v[1], u[2] + v[2])

    return PathError(
        position=add(a.position, b.position),
        velocity=add(a.velocity, b.velocity),
        acceleration=add(a.acceleration, b.acceleration),
    )


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
    """A mission's collection, for images of a single point.

    `resolution` and `spacing` (2,) [m] are those of cells and of a chip's pixels at the scene centre, x′ first.
    """

    def __init__(self, mission: Mission, geometry: BistaticGeometry) -> None:
        self.radar, self.geometry = mission.radar, geometry
        self.wavelength = mission.radar.wavelength
        self.aperture_time = mission.collection.aperture_time
        self.has_direct_path = mission.has_direct_path
        self.pulses = mission.collection.pulses
        self.memory_limit = (mission.simulation or Simulation()).memory_limit
        self.kernel = kernel_within(self.memory_limit)
        self.is_tapered = mission.simulation is not None and mission.simulation.window == "taylor"
        self.resolution = (
            geometry.range_resolution(mission.radar.bandwidth, SPEED_OF_LIGHT),
            geometry.cross_range_resolution(self.wavelength, self.aperture_time),
        )
        self.spacing = (self.resolution[0] / OVERSAMPLING, self.resolution[1] / OVERSAMPLING)
        self._nodes = aperture_nodes(self.aperture_time)
        self._kept: tuple[object, Floats, tuple[float, float]] | None = None

    @property
    def range_cell(self) -> float:
        """Resolution of the range sum, c/B. [m]"""
        return SPEED_OF_LIGHT / self.radar.bandwidth

    @property
    def relative_bandwidth(self) -> float:
        """Over the centre frequency: range cells that a wavelength of range error walks."""
        return self.radar.bandwidth / self.radar.center_frequency

    def window(self, count: int) -> Floats:
        """Weights over the aperture, or the band, at the centres of equal cells."""
        return taylor_window(count) if self.is_tapered else np.ones(count)

    def paths(self, errors: Errors, slow_time: Floats, rng: np.random.Generator | None = None) -> tuple[Path, Path]:
        """Fly both platforms."""
        ways = direct_path_ways(self.geometry, slow_time) if self.has_direct_path else (None, None)
        return (
            path(self.geometry.transmitter, slow_time, errors.transmitter, rng, ways[0]),
            path(self.geometry.receiver, slow_time, errors.receiver, rng, ways[1]),
        )

    def effect(self, errors: Errors) -> ExactEffect:
        """Displacement and phases of a point at the scene centre, by exact ranges.

        Raises
        ------
        ValueError
            No ground point has the recorded range history.
        """
        errors = errors.slow()
        clock = self.clock(errors, self._nodes)
        flown = self.paths(errors, self._nodes)
        return exact_effect(self._nodes, *flown, clock, self.wavelength, self.aperture_time)

    def flown(self, errors: Errors) -> Flown:
        """Measured paths, vibration left out: what a processor lays its grid by."""
        ends = np.array([-1.0, 0.0, 1.0]) * self.aperture_time / 2
        transmitter, receiver = self.paths(errors.smooth(), ends)
        return Flown(transmitter.measured, receiver.measured)

    def clock(self, errors: Errors, slow_time: Floats) -> Floats:
        """Clock error over slow time, and what measured paths add where the direct path is the clock. [s]"""
        error: Floats = np.asarray(np.polynomial.polynomial.polyval(slow_time, errors.clock), dtype=float)
        if errors.clock_course is not None:
            error = error + errors.clock_course.at(slow_time)
        if self.has_direct_path:
            error = error + direct_path_error(self.paths(errors, slow_time))
        return error

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
            The patch aliases with the mission's pulses, or is too large to be formed.
        MemoryLimitError
            Forming or reading it takes more than `memory_limit`. No data are formed before that is known.
        """
        grid, spacing = self._grid(centre, errors, cells, range_cells)
        slow_time = cell_centres(self.aperture_time, pulses_for(cells))
        transmitter, receiver = self.paths(errors, slow_time)
        clock = self.clock(errors, slow_time)
        if is_reference:
            transmitter, receiver = (Path(actual=p.measured, measured=p.measured) for p in (transmitter, receiver))
            clock = 0 * clock
        frequencies = self._frequencies(grid, transmitter, receiver, scatterer, clock)
        self._require_memory(grid.shape[0] * grid.shape[1], slow_time.size, frequencies)
        history = phase_history(
            np.array([[*scatterer, 0.0]]),
            np.ones(1, dtype=complex),
            slow_time=slow_time,
            frequency=self.radar.center_frequency + cell_centres(self.radar.bandwidth, frequencies),
            transmitter=transmitter,
            receiver=receiver,
            clock_error=clock,
        )
        if self.is_tapered:
            history.samples[:] *= np.outer(self.window(slow_time.size), self.window(frequencies))
        image = backprojection(history, grid, self.kernel) * baseband(self.flown(errors), grid, self.wavelength)
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
            self._require_room(cells, range_cells)
            flown = self.flown(errors)
            cell = flown.cells(centre, self.radar.bandwidth, self.wavelength)
            spacing = (cell[0] / OVERSAMPLING, cell[1] / OVERSAMPLING)
            shape = (max(1, 2 * round(range_cells * OVERSAMPLING / 2)), 2 * round(cells * OVERSAMPLING / 2))
            self._kept = (key, flown.grid(centre, spacing, shape), spacing)
        return self._kept[1:]

    def _frequencies(
        self, grid: Floats, transmitter: Path, receiver: Path, scatterer: GroundVector, clock: Floats
    ) -> int:
        """How many keep a range profile from repeating within a patch: its range walk sets that."""
        farthest = 0.0
        point = np.array([*scatterer, 0.0])
        for pulse in (0, -1):
            off = np.zeros(grid.shape[:-1])
            if self.has_direct_path:  # takes out most of what a distant platform's error puts in
                off -= SPEED_OF_LIGHT * clock[pulse]
            for one in (transmitter, receiver):
                off += np.linalg.norm(grid - one.measured[pulse], axis=-1)
                off -= np.linalg.norm(point - one.actual[pulse])
            farthest = max(farthest, float(np.abs(off).max()))
        cells = 2 * farthest * self.radar.bandwidth / SPEED_OF_LIGHT
        return max(_FREQUENCIES, 16 * math.ceil((cells + _FREQUENCIES / 2) / 16))

    def _require_room(self, cells: int, range_cells: int) -> None:
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
            raise MemoryLimitError(
                f"an image of {pixels} pixels from {pulses} pulses of {frequencies} frequencies needs about "
                f"{needed / 1e6:.4g} MB, simulation.memory_limit is {self.memory_limit / 1e6:.4g} MB: raise it"
            )


def pulses_for(cells: int) -> int:
    """Pulses of an image; of a large patch half as many, its repeats being far enough away."""
    return max(_PULSES_PER_CELL * min(cells, _LARGE_CELLS), _PULSES_PER_CELL // 2 * cells)


def baseband(flown: Flown, points: Floats, wavelength_m: float) -> Complexes:
    """Phase that takes the range history at the midpoint out of an image of points (..., 3).

    What stays is the aperture's own spectrum. A backprojected image carries the phase of the range to each
    pixel, which close to a platform is a chirp across the patch and hides the aperture from autofocus.
    """
    reference = float(np.linalg.norm(flown.transmitter[1]) + np.linalg.norm(flown.receiver[1]))
    phase: Complexes = np.exp(-2j * math.pi / wavelength_m * (flown.range_sum(points) - reference))
    return phase
