"""The collection of a mission and images of one point in it, with any errors, where exact ranges put it."""

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.geometry import BistaticGeometry, GroundVector
from bisar_budget.mission.model import Mission, Simulation
from bisar_budget.simulate.exact import ExactEffect, exact_effect
from bisar_budget.simulate.image_formation import backprojection, ground_grid, taylor_window
from bisar_budget.simulate.phase_history import (
    Complexes,
    Floats,
    MotionError,
    Path,
    cell_centres,
    path,
    phase_history,
)

OVERSAMPLING = 2.5  # samples of an image per resolution cell
CELLS = 48  # resolution cells of a cross-range cut; fewer blur the aperture by over 1 % of a phase under a taper
RANGE_CELLS = 12  # of a chip
_FREQUENCIES = 64  # a chip stays within a few range cells
_MAX_CELLS = 1024
_BYTES_PER_PIXEL = 16 * 8  # the image, its grid, and what forming it holds at once
_BYTES_PER_PULSE = 16 * 6 * _FREQUENCIES  # samples and oversampled range profile
_PULSES_PER_CELL = 4  # a response repeats after as many cells as there are pulses


class Errors(NamedTuple):
    """What is wrong in one image: both platforms, and the clock's t̃₀ … t̃₃ of (1). [s], [1], [1/s], [1/s²]"""

    transmitter: MotionError = MotionError()
    receiver: MotionError = MotionError()
    clock: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)

    def of(self, platform: str, error: MotionError) -> "Errors":
        """Give one platform an error."""
        return self._replace(transmitter=error) if platform == "transmitter" else self._replace(receiver=error)


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


def superposed_motion(a: MotionError, b: MotionError) -> MotionError:
    """Two polynomial errors of one platform at once; vibration is not added."""

    def add(u: tuple[float, float, float], v: tuple[float, float, float]) -> tuple[float, float, float]:
        return (u[0] + v[0], u[1] + v[1], u[2] + v[2])

    return MotionError(
        position=add(a.position, b.position),
        velocity=add(a.velocity, b.velocity),
        acceleration=add(a.acceleration, b.acceleration),
    )


class Chip(NamedTuple):
    """Image of a patch, (nx, ny), and its pixels, (nx, ny, 3) [m]; y′ runs along lines of equal range.

    The phase of the range to each pixel at the midpoint is taken out, so that the spectrum is that of the
    aperture, about zero.
    """

    image: Complexes
    grid: Floats

    @property
    def cut(self) -> Complexes:
        """Cross-range line through the centre, (ny,)."""
        middle: Complexes = self.image[self.image.shape[0] // 2]
        return middle


class PointCollection:
    """A mission's collection, for images of a single point.

    `spacing` (2,) [m] is that of a chip's pixels along x′ and y′.
    """

    def __init__(self, mission: Mission, geometry: BistaticGeometry) -> None:
        self.radar, self.geometry = mission.radar, geometry
        self.wavelength = mission.radar.wavelength
        self.aperture_time = mission.collection.aperture_time
        self.pulses = mission.collection.pulses
        self.memory_limit = (mission.simulation or Simulation()).memory_limit
        self.is_tapered = mission.simulation is not None and mission.simulation.window == "taylor"
        self.resolution = (
            geometry.range_resolution(mission.radar.bandwidth, SPEED_OF_LIGHT),
            geometry.cross_range_resolution(self.wavelength, self.aperture_time),
        )
        self.spacing = (self.resolution[0] / OVERSAMPLING, self.resolution[1] / OVERSAMPLING)

    def paths(self, errors: Errors, slow_time: Floats, rng: np.random.Generator | None = None) -> tuple[Path, Path]:
        """Fly both platforms."""
        return (
            path(self.geometry.transmitter, slow_time, errors.transmitter, rng),
            path(self.geometry.receiver, slow_time, errors.receiver, rng),
        )

    def effect(self, errors: Errors) -> ExactEffect:
        """Displacement and phases of a point at the scene centre, by exact ranges."""
        slow_time = cell_centres(self.aperture_time, 256)
        clock = self.clock(errors, slow_time)
        return exact_effect(slow_time, *self.paths(errors, slow_time), clock, self.wavelength, self.aperture_time)

    def spatial_frequency(self, chip: Chip) -> tuple[Floats, Floats]:
        """Slow time over the aperture, -1 to 1, and the frequency at the middle of a chip's cut then. [cycles/m]"""
        slow_time = cell_centres(self.aperture_time, 257)
        cut = chip.grid[chip.grid.shape[0] // 2]
        middle = cut.shape[0] // 2
        slope = np.zeros_like(slow_time)
        for one in self.paths(Errors(), slow_time):
            for pixel, sign in ((cut[middle + 1], 1), (cut[middle - 1], -1)):
                slope += sign * np.linalg.norm(pixel - one.actual, axis=1) / (2 * self.spacing[1])
        return slow_time / (self.aperture_time / 2), (slope - slope[slope.size // 2]) / self.wavelength

    def clock(self, errors: Errors, slow_time: Floats) -> Floats:
        """Clock error over slow time. [s]"""
        error: Floats = np.asarray(np.polynomial.polynomial.polyval(slow_time, errors.clock), dtype=float)
        return error

    def chip(
        self,
        centre: GroundVector,
        errors: Errors,
        *,
        scatterer: GroundVector = (0.0, 0.0),
        cells: int = CELLS,
        range_cells: int = 0,
    ) -> Chip:
        """Form the image of a scatterer around a ground point, without noise.

        Parameters
        ----------
        centre : (2,) float
            East, north. [m]
        errors : Errors
            In the recorded data.
        scatterer : (2,) float
            East, north. [m]
        cells, range_cells : int
            Extent in resolution cells along y′ and x′; no range cells give the single line through the centre.

        Raises
        ------
        ValueError
            The patch aliases with the mission's pulses, or is too large to be formed.
        """
        self._require_room(cells, range_cells)
        slow_time = cell_centres(self.aperture_time, _PULSES_PER_CELL * cells)
        transmitter, receiver = self.paths(errors, slow_time)
        history = phase_history(
            np.array([[*scatterer, 0.0]]),
            np.ones(1, dtype=complex),
            slow_time=slow_time,
            frequency=self.radar.center_frequency + cell_centres(self.radar.bandwidth, _FREQUENCIES),
            transmitter=transmitter,
            receiver=receiver,
            clock_error=self.clock(errors, slow_time),
        )
        if self.is_tapered:
            history.samples[:] *= np.outer(taylor_window(slow_time.size), taylor_window(_FREQUENCIES))
        grid = self._grid(centre, range_cells, cells)
        return Chip(backprojection(history, grid) * baseband(self.geometry, grid, self.wavelength), grid)

    def _require_room(self, cells: int, range_cells: int) -> None:
        """Refuse a patch that aliases or is too large. More pulses than it takes would change nothing."""
        if cells > _MAX_CELLS:
            raise ValueError(f"a patch of {cells} resolution cells, at most {_MAX_CELLS} are formed")
        if self.pulses is not None and self.pulses < 2 * cells:
            raise ValueError(
                f"collection.pulses is {self.pulses}, but the patch with its echoes is {cells} resolution cells wide "
                f"and aliases below {2 * cells} pulses; omit the key to get what it takes"
            )
        pixels = max(1, range_cells * OVERSAMPLING) * cells * OVERSAMPLING
        needed = pixels * _BYTES_PER_PIXEL + _PULSES_PER_CELL * cells * _BYTES_PER_PULSE
        if needed > self.memory_limit:
            limit = f"simulation.memory_limit is {self.memory_limit / 1e6:.0f} MB"
            raise ValueError(f"the image needs about {needed / 1e6:.0f} MB, {limit}")

    def _grid(self, centre: GroundVector, range_cells: int, cells: int) -> Floats:
        """Pixels along y′ at the range sum of the middle one.

        The ridge of a response follows an ellipse on the ground; near a platform a straight line leaves it.
        """
        nx, ny = (max(1, 2 * round(n * OVERSAMPLING / 2)) for n in (range_cells, cells))
        look = self.geometry.look_azimuth
        size = (max(1, nx) * self.spacing[0], ny * self.spacing[1])
        grid = ground_grid(centre, look, size, (nx, ny))
        along = np.array([math.cos(look), math.sin(look), 0.0])
        wanted = range_sum(self.geometry, grid[:, ny // 2])[:, None]
        for _ in range(8):
            slope = sum(
                (grid - np.asarray(p.position)) @ along / np.linalg.norm(grid - np.asarray(p.position), axis=-1)
                for p in (self.geometry.transmitter, self.geometry.receiver)
            )
            grid = grid + ((wanted - range_sum(self.geometry, grid)) / slope)[..., None] * along
        return grid


def range_sum(geometry: BistaticGeometry, points: Floats) -> Floats:
    """Distance of points (..., 3) to both platforms at the aperture midpoint, (...). [m]"""
    total: Floats = np.zeros(points.shape[:-1])
    for state in (geometry.transmitter, geometry.receiver):
        total += np.linalg.norm(points - np.asarray(state.position), axis=-1)
    return total


def baseband(geometry: BistaticGeometry, points: Floats, wavelength_m: float) -> Complexes:
    """Phase that takes the range history at the midpoint out of an image of points (..., 3).

    What stays is the aperture's own spectrum. A backprojected image carries the phase of the range to each
    pixel, which close to a platform is a chirp across the patch and hides the aperture from autofocus.
    """
    reference = geometry.transmitter.slant_range + geometry.receiver.slant_range
    phase: Complexes = np.exp(-2j * math.pi / wavelength_m * (range_sum(geometry, points) - reference))
    return phase
