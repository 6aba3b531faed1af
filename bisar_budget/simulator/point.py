"""Images of points with a mission's declared errors: Section V and VI of Rigling & Moses, Figures 3 to 7."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.effects.combined import correlated_errors, likely_error
from bisar_budget.effects.effect import PLATFORMS, LinePiece, gradients_of, indicated_point
from bisar_budget.effects.vibration import counted, lines_of, sight_of
from bisar_budget.geometry import GroundVector, Vector, dot
from bisar_budget.mission.model import Mission, Simulation
from bisar_budget.mission.platforms import MotionError as DeclaredError
from bisar_budget.ranges.exact_ranges import ExactEffect
from bisar_budget.simulator.autofocus import ALGORITHMS
from bisar_budget.simulator.collection import PointCollection, RangeLines
from bisar_budget.simulator.former import IMAGE_FORMERS, ExactRangeFormer, Former, PlaneWaves
from bisar_budget.simulator.image_formation import ground_grid
from bisar_budget.simulator.impulse_response import (
    ImpulseResponse,
    between,
    impulse_response,
    line_at,
    row_of_peak,
    upsampled,
)
from bisar_budget.simulator.phase_history import (
    Complexes,
    Errors,
    Flight,
    Floats,
    PathError,
    PathSinusoid,
    PhaseHistory,
    cell_centres,
    look_sum,
)
from bisar_budget.simulator.realisations import drawn_errors, oscillator_sinusoids
from bisar_budget.simulator.targets import Target, Targets
from bisar_budget.workers import Progress, unseen

_MARGIN_CELLS = 16  # of the patch beyond the smear, each way
_SAMPLES_PER_CELL = 3
_MIN_PULSES, _MAX_PULSES = 256, 1 << 15
_MIN_FREQUENCIES = 64
_FEW_PULSES = 64  # with which the time is foreseen
_ECHO_CELLS = 256  # from the peak; paired echoes farther away are said, not shown
_SCENE_PIXELS = 1 << 18  # of the image in (x, y)
_BYTES_PER_PIXEL = 16 * 8  # in (x, y): image and grid, the image rotated back, and all of them in an archive
_BYTES_PER_ROTATED = 16 * 16  # grid, three images, and what autofocus and interpolation hold of one
_BYTES_PER_SAMPLE = 16 * 5  # of the phase history; it is a product of terms of its own size
_APART = 3.0  # range cells: what is nearer in range shares a line with a target's response
_NEAREST = 6  # cells across that a response takes, at least
_BLUR = 6  # columns for each line beside a patch of finer pixels, by which a point there is out of focus
_THERE = 0.5  # of a target's height, at least, that is read at its place; else the patch does not reach there
_FINE = 16  # samples of a line for each, between which its highest is found to 1e-3 dB
_CLUTTER_STREAM = 1  # of the file's seed, so that clutter changes no noise


A_POINT = Targets()  # at the scene centre


class SimulationError(Exception):
    """An image that cannot be formed as asked; the message says what to change."""


@dataclass(frozen=True, slots=True)
class Response:
    """One target as the images show it.

    `effect` is what the errors do to it by exact ranges, its displacement counted from the target; `shown` is where
    the image former puts it in the rotated images, `shown_in_scene` in the one along (x, y) (east, north). [m]
    `clean`, `smeared` and `focused` are its cross-range cuts, None where it cannot be measured for what stands beside
    it.
    """

    target: Target
    effect: ExactEffect
    shown: GroundVector
    shown_in_scene: GroundVector
    clean: ImpulseResponse | None
    smeared: ImpulseResponse | None
    focused: ImpulseResponse | None


class PointImages(NamedTuple):
    """Images of point scatterers, by themselves one at the scene centre, and what explains them.

    All places are in the axes of the scene, east and north of its centre. [m]

    `in_scene` is on `scene_grid`, (nx, ny, 3) along (x, y), of as much of the patch as a quarter of a million pixels
    hold; the others are on `grid`, (nx, ny, 3), along (x′, y′): by exact ranges along lines of equal range, by plane
    waves along the axes of (10). All are complex and lie where the errors move the targets; `scene_spacing` and
    `spacing`, (2,) [m], are those of their pixels. `range_error` is what is quadratic and higher in the range error
    of the scene centre over `slow_time`; `segments` (3, 2) are its value [m] and slope [m/s] at `segment_times`,
    `points` (3, 2) the ground points (29) of those pieces of the whole range error: the middle one is where (25) puts
    a point at the scene centre; `points_by` says by which gradients (29) has them. `effect` is that of the
    scene centre, too. `responses` are one for each target, and `clean_response`, `response`, `focused_response` the
    cuts through the peaks of the brightest, which lie in these `rows` of the images. A lone point without errors is
    read `misread_db` too high where its pixels do not sample it; NaN where that is not known. `outside` says which
    declared echoes lie beyond the patch.
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
    image_former: str
    targets: Targets
    grid: Floats
    scene_grid: Floats
    in_scene: Complexes
    rotated: Complexes
    focused: Complexes
    error_free: Complexes
    rows: tuple[float, ...]
    misread_db: float
    response: ImpulseResponse
    focused_response: ImpulseResponse
    clean_response: ImpulseResponse
    responses: tuple[Response, ...]
    outside: str = ""


@dataclass(frozen=True, slots=True)
class Patch:
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


@dataclass(frozen=True, slots=True)
class Plan:
    """Patches, samples and memory that the images of a mission take, known before any is formed.

    A range cell has `finer` times as many pixels as one across.
    """

    rotated: Patch
    in_scene: Patch
    pulses: int
    frequencies: int
    own_cells: int
    finer: float
    outside: str
    bytes_held: float

    @property
    def memory(self) -> float:
        """At the peak. [B]"""
        images = _BYTES_PER_PIXEL * self.in_scene.pixels + _BYTES_PER_ROTATED * self.rotated.pixels
        return images + _BYTES_PER_SAMPLE * self.pulses * self.frequencies + self.bytes_held

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


def simulate_point(
    mission: Mission,
    progress: Progress = unseen,
    *,
    image_former: str = "backprojection",
    targets: Targets = A_POINT,
    foreseen: Callable[[float], None] = lambda seconds: None,
) -> PointImages:
    """Form the image of points with the declared errors, before and after autofocus.

    Signs and coverage factor of the file are used; of a covariance, which has no sign, the most probable error
    whose quadratic phase is one sigma, times the coverage factor. Vibration along the line of sight is in the
    data, wideband by the file's seed. The patch lies where the errors move the points, along the lines of equal range
    of the measured paths, and is as long as the smear and the paired echoes. The error-free image is that of the same
    processor: points at the displaced places, recorded from where the paths were measured.

    Parameters
    ----------
    mission : Mission
        As loaded.
    progress : callable
        Told how many pixels times pulses are done, and how many there are.
    image_former : str
        One of `IMAGE_FORMERS`. Polar format forms the rotated images; the one along (x, y) is backprojected then, as
        Figure 5 of the paper is by (4) and Figure 6 by (14).
    targets : Targets
        What stands in the scene. Clutter is one random scatterer for each resolution cell of the patch.
    foreseen : callable
        Told about how long it will take [s], measured on a few pulses and pixels, before the images are formed.

    Raises
    ------
    SimulationError
        No ground point has the recorded range history, too few pulses for the patch, images and phase history
        beyond `simulation.memory_limit`, or a collection that the image former cannot take. Nothing is formed before
        that is known.
    ValueError
        An unknown image former.
    """
    if image_former not in IMAGE_FORMERS:
        raise ValueError(f"image former {image_former!r}; known: {', '.join(IMAGE_FORMERS)}")
    geometry, settings = mission.geometry, mission.simulation or Simulation()
    T = mission.collection.aperture_time
    fine = cell_centres(T, 2049)
    collection, declared = PointCollection(mission, geometry), declared_errors(mission)
    standing = [(one.east, one.north) for one in targets.points]
    try:
        effect, *effects = (collection.effect(declared.still(), place) for place in ((0.0, 0.0), *standing))
        slow = declared.smooth()
        smooth = collection.flight(slow, fine)
        former, scene_former = _formers(collection, image_former, collection.range_lines(declared), smooth)
        displaced = [moved.moved(place) for place, moved in zip(standing, effects, strict=True)]
        left = smooth.range_error((0.0, 0.0), effect.displacement)
        recorded = [smooth.range_error(place, (0.0, 0.0)) for place in standing]
        shown = [former.place(*one) for one in zip(displaced, recorded, strict=True)]
        in_scene_shown = [scene_former.place(*one) for one in zip(displaced, recorded, strict=True)]
        smear = former.left(shown[0], left, recorded[0])
        slope = np.gradient(smear, fine)
        plan = _plan(mission, former, scene_former, np.array(shown), np.array(in_scene_shown), smear, slope)
    except ValueError as error:
        raise SimulationError(f"the declared errors leave no image of a point: {error}") from None
    plan.require_memory(settings.memory_limit, mission.collection.pulses)
    slow_time = cell_centres(T, plan.pulses)
    rng = np.random.default_rng(settings.seed)
    lines = former.grid(_middle(shown), plan.rotated.spacing, plan.rotated.shape)
    scene = ground_grid(_middle(in_scene_shown), 0.0, plan.in_scene.size, plan.in_scene.shape)
    clutter, clutter_amplitudes = _clutter(targets.clutter_db, lines, plan.finer, settings.seed)
    amplitudes = np.concatenate(([10 ** (one.level_db / 20) for one in targets.points], clutter_amplitudes))

    def history(flight: Flight, places: Floats) -> PhaseHistory:
        scatterers, power = np.c_[places, np.zeros(len(places))], settings.noise
        noise = {"noise_power": 0.0 if power is None else 10 ** (power / 10), "rng": rng}
        return collection.record(flight, scatterers, amplitudes.astype(complex), slow_time, plan.frequencies, **noise)

    done = 0

    def image(by: Former, data: PhaseHistory, grid: Floats) -> Complexes:
        def told(pixels: int) -> None:
            nonlocal done
            done += plan.pulses * pixels
            progress(done, plan.work)

        return by.image(data, grid, told)

    begun, few = time.perf_counter(), cell_centres(T, _FEW_PULSES)
    still = collection.flight(slow, few)
    places = np.pad(np.concatenate((standing, clutter)), ((0, 0), (0, 1)))
    some = collection.record(still, places, amplitudes.astype(complex), few, plan.frequencies)
    recording = 2 * (time.perf_counter() - begun) * plan.pulses / few.size
    rotating = 2 * former.seconds(some, plan.pulses, lines)
    foreseen(recording + rotating + scene_former.seconds(some, plan.pulses, scene))
    as_declared = collection.flight(declared, slow_time, rng)
    data = history(as_declared, np.concatenate((standing, clutter - np.asarray(effect.displacement))))
    try:
        rotated, in_scene = image(former, data, lines), image(scene_former, data, scene)
        del data
        as_measured = collection.flight(slow, slow_time).as_measured()
        error_free = image(former, history(as_measured, np.concatenate((displaced, clutter))), lines)
    except ValueError as error:
        raise SimulationError(f"{image_former.replace('_', ' ')} cannot form this image: {error}") from None
    focused = ALGORITHMS[mission.autofocus.algorithm](rotated).image
    cells = former.offsets(np.array(shown), _middle(shown))
    formed, windows = (error_free, rotated, focused), [_window(plan, cells, index) for index in range(len(shown))]

    def rows_of(index: int) -> tuple[float, ...]:
        """Rows of a target's peaks. Without errors it is at its place; errors are in focus at another range."""
        found = [row_of_peak(image, windows[index]) for image in formed[1:]]
        if isinstance(former, ExactRangeFormer):
            return (plan.rotated.shape[0] // 2 + _SAMPLES_PER_CELL * plan.finer * float(cells[index, 0]), *found)
        return (row_of_peak(error_free, windows[index]), *found)  # plane waves may put it beside

    across, heights = plan.rotated.spacing[1], np.abs(amplitudes[: len(shown)])
    rows_of_all = [rows_of(index) for index in range(len(shown))]
    cuts = [
        _cuts(formed, rows, window[1], across, height)
        for rows, window, height in zip(rows_of_all, windows, heights, strict=True)
    ]
    brightest = max(range(len(shown)), key=lambda index: (cuts[index][0] is not None, heights[index]))
    rows = rows_of_all[brightest]
    through_peak = [line_at(image, row) for image, row in zip(formed, rows, strict=True)]
    clean = _measured(through_peak[0], across, None)
    misread_db, is_alone = math.nan, len(shown) == 1 and targets.clutter_db is None and settings.noise is None
    if is_alone and isinstance(former, ExactRangeFormer):
        read = np.abs(upsampled(line_at(error_free, row_of_peak(error_free)), _FINE)).max()
        misread_db = 20 * math.log10(read / heights[0])
    # Figure 3 has what is quadratic and higher, from mid-aperture on; (29) all of it, from the displaced point on.
    slope = np.gradient(left, fine)
    bent = left - left[fine.size // 2] - slope[fine.size // 2] * fine
    times = np.array([-T / 3, 0.0, T / 3])  # centres of three sub-apertures
    values, slopes = np.interp(times, fine, left), np.interp(times, fine, slope)
    pieces = [LinePiece(*map(float, one)) for one in zip(times, values, slopes, strict=True)]
    model = mission.gating_model
    return PointImages(
        slow_time=fine,
        range_error=bent,
        segment_times=times,
        segments=np.stack((np.interp(times, fine, bent), slopes - slope[fine.size // 2]), axis=1),
        points=np.array(effect.displacement)
        + [indicated_point(geometry, piece, model, seen_from=effect.displacement) for piece in pieces],
        points_by=gradients_of(model),
        effect=effect,
        spacing=plan.rotated.spacing,
        scene_spacing=plan.in_scene.spacing,
        look_azimuth=math.atan2(*former.look((0.0, 0.0))[::-1]),
        image_former=image_former,
        targets=targets,
        grid=lines,
        scene_grid=scene,
        in_scene=in_scene,
        rotated=rotated,
        focused=focused,
        error_free=error_free,
        rows=rows,
        misread_db=misread_db,
        response=_measured(through_peak[1], across, clean.mask_m),
        focused_response=_measured(through_peak[2], across, clean.mask_m),
        clean_response=clean,
        responses=tuple(
            Response(target, moved, place, at, *measured)
            for target, moved, place, at, measured in zip(
                targets.points, effects, shown, in_scene_shown, cuts, strict=True
            )
        ),
        outside=plan.outside,
    )


def declared_errors(mission: Mission) -> Errors:
    """The declared errors of a mission as they are flown once: by its signs, its seed and its coverage factor.

    A covariance has no sign to fly with: flown is its most probable error of one sigma of quadratic phase.
    """
    analysis, factor, common = Analysis(mission), mission.allocation.coverage_factor, mission.common_motion_error
    errors = drawn_errors(analysis)
    sources = {source.id: source for source in analysis.sources}
    likely = {
        group.platform: likely_error(group, [sources[row_id] for row_id in group.ids])
        for group in correlated_errors(mission)
    }
    for name in PLATFORMS:
        declared: DeclaredError = getattr(mission.platforms, name).motion_error
        state = getattr(mission.geometry, name)
        axes = state.frame(declared.frame)
        error = _turned((declared.position, declared.velocity, declared.acceleration), axes, factor)
        error = error._replace(time_tag=factor * (declared.time_tag or 0.0))
        if name in likely:
            flown = _turned((likely[name][:3], likely[name][3:]), axes, 1.0)
            error = flown._replace(acceleration=error.acceleration)
        if common is not None:
            shared = (common.position, common.velocity, common.acceleration)
            of_both = _turned(shared, state.frame(common.frame), factor)
            error = error.plus(of_both._replace(time_tag=factor * (common.time_tag or 0.0)))
        if mission.scene.height_error:  # a higher scene: both platforms are measured too high
            error = error.plus(PathError(position=(0.0, 0.0, mission.scene.height_error)))
        wideband = declared.vibration.wideband
        error = error._replace(
            sinusoids=_sinusoids(mission, name),
            wideband_rms=counted(mission, name, wideband.rms, "islr") if wideband else 0.0,
            course=getattr(errors, name).course,
        )
        errors = errors.of(name, error)
    of_clocks = [[one.declared * term for term in one.clock] for one in analysis.stated if one.clock is not None]
    return errors._replace(clock=tuple(map(math.fsum, zip((0.0,) * 4, *of_clocks, strict=True))))


def _turned(
    stated: Sequence[Sequence[float] | None], axes: tuple[Vector, Vector, Vector], factor: float
) -> PathError:
    """Position, velocity, acceleration error stated along a frame's axes, along the scene's, with their signs."""
    found = []
    for vector in stated:
        parts = (0.0, 0.0, 0.0) if vector is None else vector
        x, y, z = (factor * sum(d * axis[i] for d, axis in zip(parts, axes, strict=True)) for i in range(3))
        found.append((x, y, z))
    position, velocity, acceleration = (*found, (0.0, 0.0, 0.0))[:3]
    return PathError(position, velocity, acceleration)


def _formers(
    collection: PointCollection, image_former: str, lines: RangeLines, flight: Flight
) -> tuple[Former, Former]:
    """Image formers of the rotated images, and of the one along (x, y)."""
    radar = collection.radar
    exact = ExactRangeFormer(lines, radar, image_former == "matched_filter", collection.kernel)
    if image_former in ("backprojection", "matched_filter"):
        return exact, exact
    sight = look_sum(*(one.measured for one in flight.paths))[:, :2]
    plane = PlaneWaves(sight, radar.center_frequency, radar.bandwidth, image_former == "polar_format")
    return plane, exact if plane.is_polar else plane


def _middle(places: Sequence[GroundVector] | Floats) -> GroundVector:
    """Middle of the box around some places, on which a patch is centred."""
    low, high = np.min(places, axis=0), np.max(places, axis=0)
    return float(low[0] + high[0]) / 2, float(low[1] + high[1]) / 2


def _plan(
    mission: Mission,
    former: Former,
    scene_former: Former,
    shown: Floats,
    scene_shown: Floats,
    left: Floats,
    slope: Floats,
) -> Plan:
    """Choose patches and samples no larger than the responses ask for, from their range error and its slope.

    Along lines of equal range and of equal Doppler the band of a response is a box, and its smear lies along y′; in
    (x, y) both are turned.
    """
    T, radar = mission.collection.aperture_time, mission.radar
    centre, scene_centre = _middle(shown), _middle(scene_shown)
    cell, scene_cell = former.sampled(centre), scene_former.sampled(scene_centre)
    finer = former.cells(centre)[0] / cell[0]
    # Cycles over the aperture are cells of cross range; what the range error walks, cells of c/B.
    reach = float(np.abs(slope).max()) * T / radar.wavelength
    time = cell_centres(T, left.size)
    walk = float(np.abs(left - slope * time).max()) * radar.bandwidth / SPEED_OF_LIGHT
    apart = np.abs(former.offsets(shown, centre)).max(axis=0)
    echoes = sorted({line.frequency * T for line in _flown_lines(mission)})
    given = mission.collection.pulses
    room = _ECHO_CELLS if given is None else min(_ECHO_CELLS, given / 4 - reach - apart[1] - _MARGIN_CELLS - 1)
    seen = [cycles for cycles in echoes if cycles <= room]
    outside = "" if len(seen) == len(echoes) else (
        f"echoes {', '.join(f'{cycles:.4g}' for cycles in echoes[len(seen) :])} resolution cells from the peak lie "
        "outside the patch"
    )  # fmt: skip
    reach += max(seen, default=0.0)
    cells = [2 * math.ceil(extra + _MARGIN_CELLS) for extra in (finer * (walk + apart[0]), reach + apart[1])]
    pulses = pulses_for(mission, cells[1])
    rotated = Patch(
        (_SAMPLES_PER_CELL * cells[0], _SAMPLES_PER_CELL * cells[1]),
        (cell[0] / _SAMPLES_PER_CELL, cell[1] / _SAMPLES_PER_CELL),
    )
    cosine, sine = (float(part) for part in np.abs(scene_former.look(scene_centre)))
    size = rotated.size
    extent = max(size[0] * cosine + size[1] * sine, size[0] * sine + size[1] * cosine)
    band = (cosine / scene_cell[0] + sine / scene_cell[1], sine / scene_cell[0] + cosine / scene_cell[1])
    capped = extent * min(1.0, math.sqrt(_SCENE_PIXELS / (_SAMPLES_PER_CELL**2 * extent**2 * band[0] * band[1])))
    # All targets, whatever the cap says, with the ends of their responses.
    around = 2 * float(np.abs(scene_shown - scene_centre).max())
    extent = max(capped, min(extent, around + _MARGIN_CELLS * max(scene_cell))) if around else capped
    shape = tuple(2 * math.ceil(_SAMPLES_PER_CELL * extent * one / 2) for one in band)
    in_scene = Patch((shape[0], shape[1]), (extent / shape[0], extent / shape[1]))
    # Twice what keeps a profile from repeating within a patch: over its range cells and what those across walk.
    relative = radar.bandwidth / radar.center_frequency
    diagonal = extent * (cosine + sine)
    longest = max(
        cells[0] / finer + cells[1] * relative,
        diagonal / scene_former.cells(scene_centre)[0] + diagonal / scene_cell[1] * relative,
    )
    frequencies = max(_MIN_FREQUENCIES, math.ceil(2 * longest))
    own = 2 * math.ceil(reach + _MARGIN_CELLS)
    held = max(former.bytes_held, scene_former.bytes_held)
    return Plan(rotated, in_scene, pulses, frequencies, own, finer, outside, held)


def _flown_lines(mission: Mission) -> list[PathSinusoid]:
    """Declared vibrations, and what they do to oscillators."""
    return [line for name in PLATFORMS for line in _sinusoids(mission, name) if line.amplitude]


def _sinusoids(mission: Mission, name: str) -> tuple[PathSinusoid, ...]:
    """Those of one platform."""
    count = len(getattr(mission.platforms, name).motion_error.vibration.sinusoidal)
    lines = (one for entry in range(count) for one in sinusoids_of(mission, name, entry))
    return (*lines, *oscillator_sinusoids(mission, name))


def sinusoids_of(mission: Mission, name: str, entry: int) -> list[PathSinusoid]:
    """Motion of one declared vibration: of three axes along each, else along the line of sight.

    The axes are in the phase in which they add along the line of sight of mid-aperture.
    """
    error: DeclaredError = getattr(mission.platforms, name).motion_error
    line = error.vibration.sinusoidal[entry]
    if not isinstance(line.displacement, tuple):
        return [PathSinusoid(lines_of(mission, name)[entry].amplitude, line.frequency)]
    axes, sight = getattr(mission.geometry, name).frame(error.frame), sight_of(mission, name)
    return [
        PathSinusoid(size, line.frequency, 0.0 if dot(axis, sight) >= 0 else math.pi, axis)
        for axis, size in zip(axes, line.displacement, strict=True)
        if size
    ]


def pulses_for(mission: Mission, cells: int) -> int:
    """Pulses that sample the patch and every declared vibration twice over."""
    given = mission.collection.pulses
    cycles = max((line.frequency for line in _flown_lines(mission)), default=0.0) * mission.collection.aperture_time
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


def _measured(cut: Complexes, spacing: float, mask_m: float | None) -> ImpulseResponse:
    """Measure a cross-range cut through a peak, moved to the middle.

    A smear over most of the patch has its peak at one end, and would wrap around; it gets as much room again.
    """
    count, column = cut.size, int(np.argmax(np.abs(cut)))
    try:
        return impulse_response(np.roll(cut, count // 2 - column), spacing, mask_m)
    except ValueError:
        wide = np.concatenate((cut, np.zeros(count, dtype=complex)))
        return impulse_response(np.roll(wide, count - column), spacing, mask_m)


def _clutter(level_db: float | None, grid: Floats, finer: float, seed: int) -> tuple[Floats, Complexes]:
    """Random scatterers over a patch, (n, 2) [m] and (n,): one for each resolution cell, circular normal.

    A cell is as large as the energy of a response of unit peak, so `level_db` is the mean power of a pixel. A patch
    of finer pixels is narrower than a range cell is wide: what stands a range cell beside it counts there too, and is
    out of focus by some cells across for each finer line.
    """
    if level_db is None:
        return np.empty((0, 2)), np.empty(0, dtype=complex)
    rng = np.random.default_rng([seed, _CLUTTER_STREAM])
    nx, ny = grid.shape[:2]
    above = min(_SAMPLES_PER_CELL * (finer - 1), 2 * nx)  # farther away, lines do not go on as they do here
    beside = _BLUR * above
    count = round((nx - 1 + 2 * above) * (ny - 1 + 2 * beside) / (_SAMPLES_PER_CELL**2 * finer))
    row, column = rng.uniform(-above, nx - 1 + above, count), rng.uniform(-beside, ny - 1 + beside, count)
    amplitudes = 10 ** (level_db / 20) * (rng.normal(size=count) + 1j * rng.normal(size=count)) / math.sqrt(2)
    return between(grid[..., :2], row, column), amplitudes


def _window(plan: Plan, cells: Floats, index: int) -> tuple[slice, slice]:
    """Part of the rotated patch in which a target's response is by itself, as far as the others leave room."""
    away = np.abs(cells - cells[index])
    beside = away[(away[:, 0] < 2 * _APART) & (away[:, 1] > 0), 1]
    reach = plan.own_cells // 2 if len(cells) > 1 else plan.rotated.shape[1]
    if beside.size:
        reach = min(reach, max(_NEAREST, int(beside.min() / 2)))
    rows = math.ceil(plan.finer * _APART) if len(cells) > 1 else plan.rotated.shape[0]
    slices = []
    for cell, half, count in zip(cells[index] * (plan.finer, 1.0), (rows, reach), plan.rotated.shape, strict=True):
        middle = count // 2 + round(_SAMPLES_PER_CELL * float(cell))
        slices.append(slice(max(0, middle - _SAMPLES_PER_CELL * half), middle + _SAMPLES_PER_CELL * half + 1))
    return slices[0], slices[1]


def _cuts(
    images: Sequence[Complexes], rows: Sequence[float], columns: slice, spacing: float, amplitude: float
) -> list[ImpulseResponse | None]:
    """Measure a target in the error-free image first, whose mask the others take; None where it is not there."""
    found: list[ImpulseResponse | None] = []
    mask = None
    for image, row in zip(images, rows, strict=True):
        try:
            found.append(_measured(line_at(image[:, columns], row), spacing, mask))
        except ValueError:  # what stands beside it reaches into its mainlobe
            found.append(None)
        mask = found[0].mask_m if found[0] else None
    clean = found[0]
    return found if clean and clean.peak > _THERE * amplitude else [None] * len(found)
