"""The image of a point with a mission's declared errors: Section V and VI of Rigling & Moses, Figures 3 to 7."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from bisar_budget.budget.analysis import Analysis
from bisar_budget.budget.correlation import correlated_errors, likely_error
from bisar_budget.budget.effects import PLATFORMS
from bisar_budget.budget.exact_arrays import aperture_nodes
from bisar_budget.budget.pieces import Piece, gradients_of, indicated_point
from bisar_budget.budget.vibration_lines import along_line_of_sight, lines_of
from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.geometry import BistaticGeometry, GroundVector, Vector
from bisar_budget.mission.model import Mission, Simulation
from bisar_budget.mission.model import MotionError as DeclaredError
from bisar_budget.simulate.autofocus import ALGORITHMS
from bisar_budget.simulate.collection import baseband, superposed_motion
from bisar_budget.simulate.exact import ExactEffect, exact_effect
from bisar_budget.simulate.image_formation import backprojection, ground_grid, taylor_window
from bisar_budget.simulate.impulse_response import ImpulseResponse, impulse_response
from bisar_budget.simulate.phase_history import (
    Complexes,
    Floats,
    MotionError,
    Path,
    PhaseHistory,
    Sinusoid,
    cell_centres,
    path,
    phase_history,
)
from bisar_budget.simulate.range_lines import Flown

_MARGIN_CELLS = 16  # of the patch beyond the smear, each way
_SAMPLES_PER_CELL = 3
_MIN_PULSES, _MAX_PULSES = 256, 1 << 15
_MIN_FREQUENCIES = 64
_ECHO_CELLS = 256  # from the peak; paired echoes farther away are said, not shown
_SCENE_PIXELS = 1 << 18  # of the image in (x, y)
_BYTES_PER_PIXEL = 16 * 4  # image, grid and what forming a block of them holds
_BYTES_PER_SAMPLE = 16 * 5  # of the phase history; it is a product of terms of its own size
_BYTES_HELD = 40e6  # profiles of a block of pulses, and copies of a block of pixels
_BLOCK = 1 << 18  # pixels formed between two words on the progress


class SimulationError(Exception):
    """An image that cannot be formed as asked; the message says what to change."""


class PointImages(NamedTuple):
    """Images of a point scatterer at the scene centre, and what explains them.

    `in_scene` is on a grid along (x, y), of as much of the patch as a quarter of a million pixels hold; the others
    are on `grid`, (nx, ny, 3) [m], whose lines are lines of equal range, along y′. All are complex and centred where
    the errors move the point; `scene_spacing` and `spacing`, (2,) [m], are those of their pixels there. `range_error`
    is its quadratic and higher part over `slow_time`; `segments` are the slopes and `points` the ground points of
    (26)-(29), relative to the displaced point; `points_by` says by which gradients (29) has them. `outside` says
    which declared echoes lie beyond the patch.
    """

    slow_time: Floats
    range_error: Floats
    segment_times: Floats
    segments: Floats
    points: Floats
    points_by: str
    effect: ExactEffect
    spacing: tuple[float, float]
    scene_spacing: tuple[float, float]
    look_azimuth: float
    grid: Floats
    in_scene: Complexes
    rotated: Complexes
    focused: Complexes
    error_free: Complexes
    response: ImpulseResponse
    focused_response: ImpulseResponse
    clean_response: ImpulseResponse
    outside: str = ""


class Patch(NamedTuple):
    """Ground patch around the displaced point: pixels along both axes, and their spacing there. [m]"""

    shape: tuple[int, int]
    spacing: tuple[float, float]

    @property
    def pixels(self) -> int:
        """Number of them."""
        return self.shape[0] * self.shape[1]

    @property
    def size(self) -> tuple[float, float]:
        """Extent. [m]"""
        return (self.shape[0] * self.spacing[0], self.shape[1] * self.spacing[1])


class Plan(NamedTuple):
    """What the images of a mission take, known before any is formed."""

    rotated: Patch
    in_scene: Patch
    pulses: int
    frequencies: int
    outside: str

    @property
    def memory(self) -> float:
        """At the peak. [B]"""
        images = _BYTES_PER_PIXEL * (self.in_scene.pixels + 3 * self.rotated.pixels)
        return images + _BYTES_PER_SAMPLE * self.pulses * self.frequencies + _BYTES_HELD

    @property
    def work(self) -> int:
        """Pixels times pulses: of the image in the scene's axes, of the rotated one and of the error-free one."""
        return self.pulses * (self.in_scene.pixels + 2 * self.rotated.pixels)

    def require_memory(self, limit: float, given_pulses: int | None) -> None:
        """Raise SimulationError where the plan exceeds a limit. [B]"""
        if self.memory > limit:
            x, y = self.rotated.shape
            fewer = ""
            if given_pulses is not None and given_pulses > 2 * y / _SAMPLES_PER_CELL:
                fewer = f", or lower collection.pulses, of which {2 * math.ceil(y / _SAMPLES_PER_CELL)} are enough"
            raise SimulationError(
                f"images of {x} x {y} pixels from {self.pulses} pulses of {self.frequencies} frequencies need about "
                f"{self.memory / 1e6:.4g} MB, simulation.memory_limit is {limit / 1e6:.4g} MB: raise it{fewer}"
            )


def simulate_point(mission: Mission, progress: Callable[[int, int], None] = lambda done, work: None) -> PointImages:
    """Form the image of a point at the scene centre with the declared errors, before and after autofocus.

    Signs and coverage factor of the file are used; of a covariance, which has no sign, the most probable error
    whose quadratic phase is one sigma, times the coverage factor. Vibration along the line of sight is in the
    data, wideband by the file's seed. The patch lies where the errors move the point, along the lines of equal range
    of the measured paths, and is as long as the smear and the paired echoes. The error-free image is that of the same
    processor: a point at the displaced place, recorded from where the paths were measured.

    Parameters
    ----------
    mission : Mission
        As loaded.
    progress : callable
        Told the pixels times pulses done since it was last told, and all there are.

    Raises
    ------
    SimulationError
        No ground point has the recorded range history, too few pulses for the patch, or images and phase history
        beyond `simulation.memory_limit`. Nothing is formed before that is known.
    """
    geometry, settings = mission.geometry, mission.simulation
    T, wavelength = mission.collection.aperture_time, mission.radar.wavelength
    nodes, fine = aperture_nodes(T), cell_centres(T, 2049)
    try:
        effect = exact_effect(
            nodes, *_paths(mission, geometry, nodes, vibrating=False), _clock(mission, nodes), wavelength, T
        )
        begin, middle, end = (
            _paths(mission, geometry, np.array([tau]), vibrating=False) for tau in (-T / 2, 0.0, T / 2)
        )
        flown = Flown(*(np.concatenate([at[leg].measured for at in (begin, middle, end)]) for leg in (0, 1)))
        cells = flown.cells(effect.displacement, mission.radar.bandwidth, wavelength)
    except ValueError as error:
        raise SimulationError(f"the declared errors leave no image of a point: {error}") from None
    left = _left_over(_paths(mission, geometry, fine, vibrating=False), effect) + SPEED_OF_LIGHT * _clock(
        mission, fine
    )
    slope = np.gradient(left, fine)
    plan = _plan(mission, flown, effect, cells, left, slope)
    plan.require_memory((settings or Simulation()).memory_limit, mission.collection.pulses)
    slow_time = cell_centres(T, plan.pulses)
    frequency = mission.radar.center_frequency + cell_centres(mission.radar.bandwidth, plan.frequencies)
    rng = np.random.default_rng(settings.seed if settings else 1)

    def history(paths: tuple[Path, Path], clock: Floats, scatterer: GroundVector) -> PhaseHistory:
        recorded = phase_history(
            np.array([[*scatterer, 0.0]]),
            np.ones(1, dtype=complex),
            slow_time=slow_time,
            frequency=frequency,
            transmitter=paths[0],
            receiver=paths[1],
            clock_error=clock,
            noise_power=10 ** (settings.noise / 10) if settings and settings.noise is not None else 0.0,
            rng=rng,
        )
        if settings and settings.window == "taylor":
            recorded.samples[:] *= np.outer(taylor_window(plan.pulses), taylor_window(plan.frequencies))
        return recorded

    def image(recorded: PhaseHistory, grid: Floats) -> Complexes:
        formed = np.empty(grid.shape[:2], dtype=complex)
        rows = max(1, _BLOCK // grid.shape[1])
        for start in range(0, grid.shape[0], rows):
            part = grid[start : start + rows]
            formed[start : start + rows] = backprojection(recorded, part) * baseband(flown, part, wavelength)
            progress(plan.pulses * part.shape[0] * part.shape[1], plan.work)
        return formed

    recorded = history(
        _paths(mission, geometry, slow_time, vibrating=True, rng=rng), _clock(mission, slow_time), (0.0, 0.0)
    )
    lines = flown.grid(effect.displacement, plan.rotated.spacing, plan.rotated.shape)
    scene = ground_grid(effect.displacement, 0.0, plan.in_scene.size, plan.in_scene.shape)
    rotated, in_scene = image(recorded, lines), image(recorded, scene)
    measured = [one.measured for one in _paths(mission, geometry, slow_time, vibrating=False)]
    as_measured = (Path(actual=measured[0], measured=measured[0]), Path(actual=measured[1], measured=measured[1]))
    error_free = image(history(as_measured, 0 * slow_time, effect.displacement), lines)
    focused = ALGORITHMS[mission.autofocus.algorithm](rotated).image
    across = plan.rotated.spacing[1]
    clean = _measured(error_free, across, None)
    bent = left - left[fine.size // 2] - slope[fine.size // 2] * fine  # as Figure 3 has it, from mid-aperture on
    bent_slope = slope - slope[fine.size // 2]
    times = np.array([-T / 3, 0.0, T / 3])  # centres of three sub-apertures
    values, slopes = np.interp(times, fine, bent), np.interp(times, fine, bent_slope)
    pieces = [Piece(*map(float, one)) for one in zip(times, values, slopes, strict=True)]
    return PointImages(
        slow_time=fine,
        range_error=bent,
        segment_times=times,
        segments=np.stack((values, slopes), axis=1),
        points=np.array([indicated_point(geometry, one, mission.allocation.model) for one in pieces]),
        points_by=gradients_of(mission.allocation.model),
        effect=effect,
        spacing=plan.rotated.spacing,
        scene_spacing=plan.in_scene.spacing,
        look_azimuth=geometry.look_azimuth,
        grid=lines,
        in_scene=in_scene,
        rotated=rotated,
        focused=focused,
        error_free=error_free,
        response=_measured(rotated, across, clean.mask_m),
        focused_response=_measured(focused, across, clean.mask_m),
        clean_response=clean,
        outside=plan.outside,
    )


def _plan(
    mission: Mission, flown: Flown, effect: ExactEffect, cell: tuple[float, float], left: Floats, slope: Floats
) -> Plan:
    """Choose patches and samples no larger than the response asks for, from its range error and that one's slope.

    Along lines of equal range and of equal Doppler the band of a response is a box, and its smear lies along y′; in
    (x, y) both are turned.
    """
    T, radar = mission.collection.aperture_time, mission.radar
    # Cycles over the aperture are cells of cross range; what the range error walks, cells of c/B.
    reach = float(np.abs(slope).max()) * T / radar.wavelength
    time = cell_centres(T, left.size)
    walk = float(np.abs(left - slope * time).max()) * radar.bandwidth / SPEED_OF_LIGHT
    echoes = sorted(line.frequency * T for name in PLATFORMS for line in lines_of(mission, name) if line.amplitude)
    given = mission.collection.pulses
    room = _ECHO_CELLS if given is None else min(_ECHO_CELLS, given / 4 - reach - _MARGIN_CELLS - 1)
    shown = [cycles for cycles in echoes if cycles <= room]
    outside = "" if len(shown) == len(echoes) else (
        f"echoes {', '.join(f'{cycles:.4g}' for cycles in echoes[len(shown) :])} resolution cells from the peak lie "
        "outside the patch"
    )  # fmt: skip
    reach += max(shown, default=0.0)
    cells = [2 * math.ceil(extra + _MARGIN_CELLS) for extra in (walk, reach)]
    pulses = _pulses(mission, cells[1])
    rotated = Patch(
        (_SAMPLES_PER_CELL * cells[0], _SAMPLES_PER_CELL * cells[1]),
        (cell[0] / _SAMPLES_PER_CELL, cell[1] / _SAMPLES_PER_CELL),
    )
    by_range = flown.gradients(np.asarray(effect.displacement))[0]
    cosine, sine = np.abs(by_range) / float(np.hypot(*by_range))
    size = rotated.size
    extent = max(size[0] * cosine + size[1] * sine, size[0] * sine + size[1] * cosine)
    band = (cosine / cell[0] + sine / cell[1], sine / cell[0] + cosine / cell[1])
    extent *= min(1.0, math.sqrt(_SCENE_PIXELS / (_SAMPLES_PER_CELL**2 * extent**2 * band[0] * band[1])))
    shape = tuple(2 * math.ceil(_SAMPLES_PER_CELL * extent * one / 2) for one in band)
    in_scene = Patch((shape[0], shape[1]), (extent / shape[0], extent / shape[1]))
    # Twice what keeps a profile from repeating within a patch: over its range cells and what those across walk.
    relative = radar.bandwidth / radar.center_frequency
    diagonal = extent * (cosine + sine)
    longest = max(cells[0] + cells[1] * relative, diagonal / cell[0] + diagonal / cell[1] * relative)
    frequencies = max(_MIN_FREQUENCIES, math.ceil(2 * longest))
    return Plan(rotated, in_scene, pulses, frequencies, outside)


def _pulses(mission: Mission, cells: int) -> int:
    """Pulses that sample the patch and every declared vibration twice over."""
    given = mission.collection.pulses
    lines = [line for name in PLATFORMS for line in lines_of(mission, name) if line.amplitude]
    cycles = max((line.frequency for line in lines), default=0.0) * mission.collection.aperture_time
    if given is not None and given <= 2 * cycles:
        raise SimulationError(
            f"collection.pulses is {given}, but a declared vibration makes {cycles:.4g} cycles in the aperture and "
            f"aliases up to {2 * cycles:.4g} pulses; omit the key to get what it takes"
        )
    if given is None:
        needed = max(2 * cells, 4 * cycles)
        if needed > _MAX_PULSES:
            raise SimulationError(
                f"a patch of {cells} resolution cells and {cycles:.4g} cycles of vibration take {needed:.3g} pulses, "
                f"at most {_MAX_PULSES} are simulated unless collection.pulses asks for more"
            )
        return max(_MIN_PULSES, 1 << (math.ceil(needed) - 1).bit_length())
    if given < 2 * cells:
        raise SimulationError(
            f"collection.pulses is {given}, but the patch is {cells} resolution cells wide and aliases below "
            f"{2 * cells} pulses; omit the key to get what it takes"
        )
    return given


def _vector(declared: Vector | None, axes: tuple[Vector, Vector, Vector], factor: float) -> Vector:
    """Turn an error stated along a frame's axes into the scene's, with its signs."""
    if declared is None:
        return (0.0, 0.0, 0.0)
    x, y, z = (factor * sum(d * axis[i] for d, axis in zip(declared, axes, strict=True)) for i in range(3))
    return (x, y, z)


def _paths(
    mission: Mission,
    geometry: BistaticGeometry,
    slow_time: Floats,
    *,
    vibrating: bool,
    rng: np.random.Generator | None = None,
) -> tuple[Path, Path]:
    factor = mission.allocation.coverage_factor
    common = mission.common_motion_error
    likely = _likely_errors(mission)
    flown = []
    for name in ("transmitter", "receiver"):
        declared: DeclaredError = getattr(mission.platforms, name).motion_error
        state = getattr(geometry, name)
        axes = state.frame(declared.frame)
        error = MotionError(
            position=_vector(declared.position, axes, factor),
            velocity=_vector(declared.velocity, axes, factor),
            acceleration=_vector(declared.acceleration, axes, factor),
        )
        if name in likely:
            position, velocity = (_vector(values, axes, 1.0) for values in likely[name])
            error = error._replace(position=position, velocity=velocity)
        if common is not None:
            scene = state.frame("scene")
            shared = MotionError(
                position=_vector(common.position, scene, factor),
                velocity=_vector(common.velocity, scene, factor),
                acceleration=_vector(common.acceleration, scene, factor),
            )
            error = superposed_motion(error, shared)
        if vibrating:
            wideband = declared.vibration.wideband
            error = error._replace(
                sinusoids=tuple(Sinusoid(*line) for line in lines_of(mission, name)),
                wideband_rms=along_line_of_sight(wideband.rms, declared, state, "islr") if wideband else 0.0,
            )
        flown.append(path(state, slow_time, error, rng))
    return flown[0], flown[1]


def _likely_errors(mission: Mission) -> dict[str, tuple[Vector, Vector]]:
    """Position and velocity error along the frame's axes of each platform with a covariance: one of its errors.

    A covariance has no sign to fly with. Shown is its most probable error of one sigma of quadratic phase.
    """
    groups = correlated_errors(mission)
    sources = {source.id: source for source in Analysis(mission).sources} if groups else {}
    errors = {}
    for group in groups:
        a, b, c, d, e, f = likely_error(group, [sources[row_id] for row_id in group.ids])
        errors[group.platform] = ((a, b, c), (d, e, f))
    return errors


def _clock(mission: Mission, slow_time: Floats) -> Floats:
    error = mission.timing_error
    terms = (error.constant or 0.0, error.linear or 0.0, error.quadratic or 0.0, error.cubic or 0.0)
    polynomial = np.polynomial.polynomial.polyval(slow_time, terms)
    clock: Floats = np.asarray(mission.allocation.coverage_factor * polynomial, dtype=float)
    return clock


def _left_over(paths: tuple[Path, Path], effect: ExactEffect) -> Floats:
    """Range error left at the displaced point, clock excluded. [m]"""
    point = np.array([*effect.displacement, 0.0])
    legs = [np.linalg.norm(p.actual, axis=1) - np.linalg.norm(p.measured - point, axis=1) for p in paths]
    total: Floats = np.sum(legs, axis=0)
    return total


def _measured(image: Complexes, spacing: float, mask_m: float | None) -> ImpulseResponse:
    """Measure the cross-range cut through the brightest pixel, moved to the middle."""
    row, column = np.unravel_index(np.argmax(np.abs(image)), image.shape)
    cut = np.roll(image[row], image.shape[1] // 2 - int(column))
    return impulse_response(cut, spacing, mask_m)
