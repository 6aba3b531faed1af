"""Images of point targets with a mission's declared errors: Rigling & Moses, Sections V and VI, Figures 3 to 7."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.analysis.spread import mainlobe_energy, stated_powers
from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.effects.combined import correlated_errors, likely_error
from bisar_budget.effects.effect import PLATFORMS, LinePiece, gradients_of, indicated_point
from bisar_budget.effects.vibration import counted, lines_of, sight_of
from bisar_budget.geometry import GroundVector, dot
from bisar_budget.mission.model import OTHER_EFFECTS, Mission, Simulation
from bisar_budget.mission.platforms import MotionError as DeclaredError
from bisar_budget.ranges.exact_ranges import ExactEffect
from bisar_budget.simulator.autofocus import ALGORITHMS
from bisar_budget.simulator.collection import PointCollection, RangeLines
from bisar_budget.simulator.flown_errors import flown_together
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
    Course,
    Errors,
    Flight,
    Floats,
    PathError,
    PathSinusoid,
    PhaseHistory,
    ReceiverNoise,
    cell_centres,
    look_sum,
    superposed,
)
from bisar_budget.simulator.realisations import clock_seconds, drawn_errors, oscillator_sinusoids
from bisar_budget.simulator.targets import Target, Targets
from bisar_budget.workers import Progress, unseen

_MARGIN_CELLS = 16  # cells of the patch beyond the smear, on each side
_SAMPLES_PER_CELL = 3
_MIN_PULSES, _MAX_PULSES = 256, 1 << 15
_MIN_FREQUENCY_COUNT = 64
_TRIAL_PULSES = 64  # pulses of the trial that estimates the time
_MAX_ECHO_CELLS = 256  # largest distance of a paired echo that the patch includes; echoes farther away are only named
_SCENE_PIXELS = 1 << 18  # largest number of pixels of the image in (x, y)
_BYTES_PER_SCENE_PIXEL = 16 * 8  # in (x, y): image and grid, the image rotated back, and all of them in an archive
_BYTES_PER_ROTATED_PIXEL = 16 * 16  # grid, three images, and one image within autofocus and interpolation
_BYTES_PER_SAMPLE = 16 * 5  # of the phase history; it is a product of terms of its own size
_SEPARATE_RANGE_CELLS = 3.0  # responses of targets that are nearer in range overlap
_MIN_WINDOW_CELLS = 6  # half width of a target's response in cross-range
_BLUR_COLUMNS_PER_LINE = 6  # blur of a point outside a patch of finer pixels, per line of distance
_MIN_HEIGHT_FRACTION = 0.5  # smallest peak at a target's position; with less, the patch does not contain the target
_LINE_UPSAMPLING_FACTOR = 16  # interpolation after which the highest sample is accurate to 1e-3 dB
_STATED_PHASE_SAMPLES = 4097  # of a phase that the file states by its size at the aperture edge
_CLUTTER_STREAM_INDEX = 1  # used with the file's seed, so that clutter does not change the noise


A_POINT = Targets()  # at the scene centre


class SimulationError(Exception):
    """The images cannot be formed as requested. The message states how the user can change the request."""


@dataclass(frozen=True, slots=True)
class Response:
    """Position of one target in the images, and the measured width, peak and sidelobes of its response.

    `effect` is the effect of the errors, computed from exact ranges; its displacement is relative to the target. The
    target appears at the ground point `shown` [m] in the rotated images, and at `shown_in_scene` [m] in the image
    along (x, y); both are east and north. `clean`, `smeared` and `focused` are measures of the cross-range cuts
    through the target in the image without errors, the image with errors and the image after autofocus. A measure is
    None if the response cannot be measured, for example because a neighbouring target covers it.
    """

    target: Target
    effect: ExactEffect
    shown: GroundVector
    shown_in_scene: GroundVector
    clean: ImpulseResponse | None
    smeared: ImpulseResponse | None
    focused: ImpulseResponse | None


class PointImages(NamedTuple):
    """Images of point scatterers, by default of a single one at the scene centre, and quantities that explain them.

    All points [m] are in the axes of the scene, east and north of its centre.

    Images are complex, and cover the ground around the displaced targets. `in_scene` is on `scene_grid`, (nx, ny, 3),
    along (x, y), and shows as much of the patch as fits into a quarter of a million pixels. `rotated`, `focused` and
    `error_free` are on `grid`, (nx, ny, 3), along (x′, y′). This grid follows lines of equal range if the image
    former uses exact ranges, and the axes of equation (10) if it uses plane waves. `scene_spacing` and `spacing` (2,)
    [m] are the distances between neighbouring pixels of these grids.

    `effect` and `range_error` are for a point at the scene centre. `range_error` is the range error over `slow_time`
    without its constant and linear part. `segments` (3, 2) holds its value [m] and slope [m/s] at the three
    `segment_times`. `points` (3, 2) holds the ground points that equation (29) gives for these three segments of the
    full range error, computed with the gradients named by `points_by`. According to equation (25), the scene centre
    appears at the second of these points.

    `responses` has one entry for each target. `clean_response`, `response` and `focused_response` are cuts through
    the peaks of the brightest target. `rows` are the rows of these peaks in the images. `misread_db` [dB] is the
    error of the measured peak of a single point without errors. It is above 0 if the pixels do not sample the
    response well enough, and NaN if it is unknown. `outside` names the declared paired echoes that are beyond the
    patch.
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
    """Ground patch around the displaced points: numbers of pixels along both axes, and their spacing. [m]"""

    shape: tuple[int, int]
    spacing: tuple[float, float]

    @property
    def pixels(self) -> int:
        """Number of pixels of the patch."""
        return self.shape[0] * self.shape[1]

    @property
    def size(self) -> tuple[float, float]:
        """Extent of the patch along both axes. [m]"""
        return (self.shape[0] * self.spacing[0], self.shape[1] * self.spacing[1])


@dataclass(frozen=True, slots=True)
class Plan:
    """Patch sizes, numbers of samples and memory for the images of a mission, chosen before an image is formed.

    `rotated` is the patch of the images along (x′, y′), and `in_scene` is the patch of the image along (x, y). A
    range cell has `finer` times as many pixels as a cross-range cell. The response of a target, including its margin,
    is `own_cells` resolution cells wide in cross-range. `outside` names the paired echoes that are beyond the patch,
    or is empty. `bytes_held` [B] is the memory that the image formers need besides images and phase history.
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
        """Peak memory used for images, phase history and image formation together. [B]"""
        images = _BYTES_PER_SCENE_PIXEL * self.in_scene.pixels + _BYTES_PER_ROTATED_PIXEL * self.rotated.pixels
        return images + _BYTES_PER_SAMPLE * self.pulses * self.frequencies + self.bytes_held

    @property
    def work(self) -> int:
        """Number of pixels times pulses, summed over the image along (x, y), the rotated and the error-free image."""
        return self.pulses * (self.in_scene.pixels + 2 * self.rotated.pixels)

    def require_memory(self, limit: float, given_pulses: int | None) -> None:
        """Raise a `SimulationError` if the plan needs more memory than `limit` [B].

        The message also proposes fewer pulses if `given_pulses`, the number in the mission file, is larger than
        necessary. `given_pulses` is None if the file gives no number.
        """
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
    foreseen: Callable[[float], None] | None = None,
) -> PointImages:
    """Form images of point targets with the declared errors, before and after autofocus.

    Errors have the signs and the coverage factor of the mission file. A covariance has no sign. It is represented by
    the most probable error with a quadratic phase of one sigma, multiplied by the coverage factor. Vibration along
    the line of sight is part of the data. Wideband vibration is drawn with the seed of the file. The patch contains
    the displaced points, and follows the lines of equal range of the measured paths. It is long enough for the smear
    and the paired echoes. The error-free image is formed by the same processor from error-free data: the targets are
    at the displaced points, and the platforms fly along the measured paths.

    Parameters
    ----------
    mission : Mission
        The mission, as loaded.
    progress : callable
        Called during image formation with the finished work and the total work, both as pixels times pulses.
    image_former : str
        One of `IMAGE_FORMERS`. The polar format forms only the rotated images; the image along (x, y) is then formed
        by backprojection. In the same way, Figure 5 of the paper is formed by equation (4), and Figure 6 by equation
        (14).
    targets : Targets
        Point targets and clutter of the scene. Clutter consists of a random scatterer for each resolution cell of the
        patch.
    foreseen : callable, optional
        Called before the images are formed, with the estimated time [s] needed to form them. The estimate is made
        from a trial with a few pulses and pixels, which is omitted if `foreseen` is None.

    Raises
    ------
    SimulationError
        No ground point has the recorded range history; the pulses are too few for the patch; images and phase history
        need more memory than `simulation.memory_limit`; or the image former cannot process the collection. All this
        is checked before an image is formed.
    ValueError
        The image former is unknown.
    """
    if image_former not in IMAGE_FORMERS:
        raise ValueError(f"image former {image_former!r}; known: {', '.join(IMAGE_FORMERS)}")
    geometry, settings = mission.geometry, mission.simulation or Simulation()
    T = mission.collection.aperture_time
    fine = cell_centres(T, 2049)
    collection, declared = PointCollection(mission, geometry), declared_errors(mission)
    target_points = [(target.east, target.north) for target in targets.points]
    try:
        effect, *effects = (collection.effect(declared.still(), point) for point in ((0.0, 0.0), *target_points))
        slow = declared.smooth()
        smooth = collection.flight(slow, fine)
        former, scene_former = _formers(collection, image_former, collection.range_lines(declared), smooth)
        displaced = [moved.moved(point) for point, moved in zip(target_points, effects, strict=True)]
        remaining_range = smooth.range_error((0.0, 0.0), effect.displacement)
        recorded_range = [smooth.range_error(point, (0.0, 0.0)) for point in target_points]
        shown = [former.place(*point) for point in zip(displaced, recorded_range, strict=True)]
        in_scene_shown = [scene_former.place(*point) for point in zip(displaced, recorded_range, strict=True)]
        smear = former.remaining_range(shown[0], remaining_range, recorded_range[0])
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
    amplitudes = np.concatenate(([10 ** (target.level_db / 20) for target in targets.points], clutter_amplitudes))

    def history(flight: Flight, scatterer_places: Floats) -> PhaseHistory:
        scatterers, power = np.c_[scatterer_places, np.zeros(len(scatterer_places))], settings.noise
        noise: ReceiverNoise = {"noise_power": 0.0 if power is None else 10 ** (power / 10), "rng": rng}
        return collection.record(flight, scatterers, amplitudes.astype(complex), slow_time, plan.frequencies, **noise)

    done_work = 0

    def image(by: Former, data: PhaseHistory, grid: Floats) -> Complexes:
        def on_pixels(pixels: int) -> None:
            nonlocal done_work
            done_work += plan.pulses * pixels
            progress(done_work, plan.work)

        return by.image(data, grid, on_pixels)

    def seconds() -> float:
        """Estimate the time to record the phase histories and to form all images. [s]"""
        start_time, trial_times = time.perf_counter(), cell_centres(T, _TRIAL_PULSES)
        trial_flight = collection.flight(slow, trial_times)
        scatterer_places = np.pad(np.concatenate((target_points, clutter)), ((0, 0), (0, 1)))
        trial_history = collection.record(
            trial_flight, scatterer_places, amplitudes.astype(complex), trial_times, plan.frequencies
        )
        recording = 2 * (time.perf_counter() - start_time) * plan.pulses / trial_times.size
        rotating = 2 * former.seconds(trial_history, plan.pulses, lines)
        return recording + rotating + scene_former.seconds(trial_history, plan.pulses, scene)

    if foreseen is not None:
        foreseen(seconds())
    as_declared = collection.flight(declared, slow_time, rng)
    data = history(as_declared, np.concatenate((target_points, clutter - np.asarray(effect.displacement))))
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
        """Fractional rows of the peak of a target in the error-free, the rotated and the focused image.

        The rows differ between images, because errors change the row in which a target is in focus.
        """
        smeared_rows = [row_of_peak(image, windows[index]) for image in formed[1:]]
        if isinstance(former, ExactRangeFormer):
            return (
                plan.rotated.shape[0] // 2 + _SAMPLES_PER_CELL * plan.finer * float(cells[index, 0]),
                *smeared_rows,
            )
        return (row_of_peak(error_free, windows[index]), *smeared_rows)  # plane waves may displace the peak

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
        highest_sample = np.abs(
            upsampled(line_at(error_free, row_of_peak(error_free)), _LINE_UPSAMPLING_FACTOR)
        ).max()
        misread_db = 20 * math.log10(highest_sample / heights[0])
    # Figure 3 shows the range error without its constant and linear part at mid-aperture. (29) uses the full range
    # error, relative to the displaced point.
    slope = np.gradient(remaining_range, fine)
    curved_range_error = remaining_range - remaining_range[fine.size // 2] - slope[fine.size // 2] * fine
    times = np.array([-T / 3, 0.0, T / 3])  # centres of three sub-apertures
    values, slopes = np.interp(times, fine, remaining_range), np.interp(times, fine, slope)
    pieces = [LinePiece(*map(float, numbers)) for numbers in zip(times, values, slopes, strict=True)]
    model = mission.gating_model
    return PointImages(
        slow_time=fine,
        range_error=curved_range_error,
        segment_times=times,
        segments=np.stack((np.interp(times, fine, curved_range_error), slopes - slope[fine.size // 2]), axis=1),
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
            Response(target, moved, place, scene_place, *measured)
            for target, moved, place, scene_place, measured in zip(
                targets.points, effects, shown, in_scene_shown, cuts, strict=True
            )
        ),
        outside=plan.outside,
    )


def declared_errors(mission: Mission) -> Errors:
    """Declared errors of a mission as they occur together in one flight.

    They have the signs, the seed and the coverage factor of the mission file. A covariance has no sign. It is
    represented by the most probable error with a quadratic phase of one sigma, multiplied by the coverage factor. A
    bias is added with its own sign.
    """
    analysis = Analysis(mission)
    sizes = {source.id: source.declared for source in analysis.stated if source.displaces}
    sources = {source.id: source for source in analysis.stated}
    for group in correlated_errors(mission):
        likely_sizes = likely_error(group, [sources[row_id] for row_id in group.ids])
        sizes |= dict(zip(group.ids, likely_sizes, strict=True))
    declared = [(sources[row_id], size + sources[row_id].bias) for row_id, size in sizes.items()]
    of_known_motion = flown_together(declared, mission.geometry, mission.collection.aperture_time)
    errors = superposed((of_known_motion, drawn_errors(analysis)))
    for name in PLATFORMS:
        wideband = getattr(mission.platforms, name).motion_error.vibration.wideband
        error: PathError = getattr(errors, name)
        error = error._replace(
            sinusoids=_sinusoids(mission, name),
            wideband_rms=float(counted(mission, name, wideband.rms, "islr") if wideband else 0.0),
        )
        errors = errors.of(name, error)
    return _with_stated_effects(mission, errors)


def _with_stated_effects(mission: Mission, errors: Errors) -> Errors:
    """Add to `errors` motions and clock errors with the effects that the mission file states in `other_errors`.

    A quadratic and a cubic phase are added as a clock error over slow time. A displacement moves both measured paths
    to the east, which moves the image to the east by the same distance. A stated ISLR becomes white noise of the
    measured path of the receiver. The coverage factor is not applied to these effects.
    """
    quadratic, cubic, shift = (
        math.fsum(
            (getattr(stated, effect) or 0.0) + (stated.bias.get(effect) or 0.0) for stated in mission.other_errors
        )
        for effect in OTHER_EFFECTS[:3]
    )
    if quadratic or cubic:
        T, times = mission.collection.aperture_time, np.linspace(-1.0, 1.0, _STATED_PHASE_SAMPLES)
        course = errors.clock_course or Course(times * T / 2, np.zeros(times.size))
        scaled_times = course.times / (T / 2)
        phase = quadratic * scaled_times**2 + cubic * scaled_times**3
        seconds = course.values + clock_seconds(phase, mission.radar.wavelength)
        errors = errors._replace(clock_course=Course(course.times, seconds))
    if shift:
        for name in PLATFORMS:
            error: PathError = getattr(errors, name)
            east, north, up = error.position
            errors = errors.of(name, error._replace(position=(east + shift, north, up)))
    power = math.fsum(float(stated.rms("full", mainlobe_energy(mission))) ** 2 for stated in stated_powers(mission))
    if power:
        rms = math.sqrt(power) * mission.radar.wavelength / (2 * math.pi)
        receiver = errors.receiver
        errors = errors._replace(receiver=receiver._replace(wideband_rms=math.hypot(receiver.wideband_rms, rms)))
    return errors


def _formers(
    collection: PointCollection, image_former: str, lines: RangeLines, flight: Flight
) -> tuple[Former, Former]:
    """Return the image former for the rotated images, and the image former for the image along (x, y).

    They are the same, except that the polar format is combined with backprojection for the image along (x, y).
    """
    radar = collection.radar
    exact = ExactRangeFormer(lines, radar, image_former == "matched_filter", collection.kernel)
    if image_former in ("backprojection", "matched_filter"):
        return exact, exact
    sight = look_sum(*(path.measured for path in flight.paths))[:, :2]
    plane = PlaneWaves(sight, radar.center_frequency, radar.bandwidth, image_former == "polar_format")
    return plane, exact if plane.is_polar else plane


def _middle(points: Sequence[GroundVector] | Floats) -> GroundVector:
    """Centre of the smallest box that contains the given ground points, used as the centre of a patch. [m]"""
    low, high = np.min(points, axis=0), np.max(points, axis=0)
    return float(low[0] + high[0]) / 2, float(low[1] + high[1]) / 2


def _plan(
    mission: Mission,
    former: Former,
    scene_former: Former,
    shown: Floats,
    scene_shown: Floats,
    remaining_range: Floats,
    slope: Floats,
) -> Plan:
    """Choose the smallest patches and numbers of samples for which the images contain the responses.

    The sizes follow from the remaining range error [m] and its slope [m/s] over slow time. `shown` and `scene_shown`,
    (targets, 2) [m], are the ground points at which the two image formers show the targets. On a grid along lines of
    equal range and of equal Doppler, the band of a response is a rectangle and its smear is along y′. In the image
    along (x, y), the rectangle and the smear are rotated.
    """
    T, radar = mission.collection.aperture_time, mission.radar
    centre, scene_centre = _middle(shown), _middle(scene_shown)
    cell, scene_cell = former.sampled(centre), scene_former.sampled(scene_centre)
    finer = former.cells(centre)[0] / cell[0]
    # One cycle over the aperture is one cell in cross-range. The walk of the range error is in cells of c/B.
    reach = float(np.abs(slope).max()) * T / radar.wavelength
    time = cell_centres(T, remaining_range.size)
    walk = float(np.abs(remaining_range - slope * time).max()) * radar.bandwidth / SPEED_OF_LIGHT_MPS
    farthest_cells = np.abs(former.offsets(shown, centre)).max(axis=0)
    echoes = sorted({line.frequency * T for line in _flown_lines(mission)})
    mission_pulses = mission.collection.pulses
    echo_room = (
        _MAX_ECHO_CELLS
        if mission_pulses is None
        else min(_MAX_ECHO_CELLS, mission_pulses / 4 - reach - farthest_cells[1] - _MARGIN_CELLS - 1)
    )
    shown_echoes = [cycles for cycles in echoes if cycles <= echo_room]
    hidden_echoes = echoes[len(shown_echoes) :]
    outside = "" if not hidden_echoes else (
        f"echoes {', '.join(f'{cycles:.4g}' for cycles in hidden_echoes)} resolution cells from the peak lie "
        "outside the patch"
    )  # fmt: skip
    reach += max(shown_echoes, default=0.0)
    cells = [
        2 * math.ceil(extra + _MARGIN_CELLS)
        for extra in (finer * (walk + farthest_cells[0]), reach + farthest_cells[1])
    ]
    pulses = pulses_for(mission, cells[1])
    rotated = Patch(
        (_SAMPLES_PER_CELL * cells[0], _SAMPLES_PER_CELL * cells[1]),
        (cell[0] / _SAMPLES_PER_CELL, cell[1] / _SAMPLES_PER_CELL),
    )
    cosine, sine = (float(component) for component in np.abs(scene_former.look(scene_centre)))
    size = rotated.size
    extent = max(size[0] * cosine + size[1] * sine, size[0] * sine + size[1] * cosine)
    samples_per_metre = (cosine / scene_cell[0] + sine / scene_cell[1], sine / scene_cell[0] + cosine / scene_cell[1])
    capped = extent * min(
        1.0,
        math.sqrt(_SCENE_PIXELS / (_SAMPLES_PER_CELL**2 * extent**2 * samples_per_metre[0] * samples_per_metre[1])),
    )
    # The patch includes all targets with the ends of their responses, even if it then exceeds the cap.
    targets_extent = 2 * float(np.abs(scene_shown - scene_centre).max())
    extent = max(capped, min(extent, targets_extent + _MARGIN_CELLS * max(scene_cell))) if targets_extent else capped
    shape = tuple(2 * math.ceil(_SAMPLES_PER_CELL * extent * density / 2) for density in samples_per_metre)
    in_scene = Patch((shape[0], shape[1]), (extent / shape[0], extent / shape[1]))
    # Twice the number of frequencies for which a profile does not repeat within a patch, including its range cells
    # and the range walk of its cross-range cells.
    relative = radar.bandwidth / radar.center_frequency
    diagonal = extent * (cosine + sine)
    longest = max(
        cells[0] / finer + cells[1] * relative,
        diagonal / scene_former.cells(scene_centre)[0] + diagonal / scene_cell[1] * relative,
    )
    frequencies = max(_MIN_FREQUENCY_COUNT, math.ceil(2 * longest))
    own_cells = 2 * math.ceil(reach + _MARGIN_CELLS)
    bytes_held = max(former.bytes_held, scene_former.bytes_held)
    return Plan(rotated, in_scene, pulses, frequencies, own_cells, finer, outside, bytes_held)


def _flown_lines(mission: Mission) -> list[PathSinusoid]:
    """Sinusoidal motions of both platforms: declared vibrations, and motions that represent oscillator phases.

    The latter cause the same phase as an oscillator that vibrates with its platform. Motions with an amplitude of 0
    are omitted.
    """
    return [line for name in PLATFORMS for line in _sinusoids(mission, name) if line.amplitude]


def _sinusoids(mission: Mission, name: str) -> tuple[PathSinusoid, ...]:
    """Sinusoidal motions of one platform: declared vibrations, and motions that represent its oscillator's phases."""
    count = len(getattr(mission.platforms, name).motion_error.vibration.sinusoidal)
    declared_lines = (line for entry in range(count) for line in sinusoids_of(mission, name, entry))
    return (*declared_lines, *oscillator_sinusoids(mission, name))


def sinusoids_of(mission: Mission, name: str, entry: int) -> list[PathSinusoid]:
    """Sinusoidal motions of a platform that represent one declared vibration.

    `entry` is the index of the vibration in the list of the mission file. If the displacement of the vibration is
    declared along three axes, there is a motion along each axis. If the displacement is a single number, the motion
    is along the line of sight. The phases of the axes are chosen so that the motions add up along the line of sight
    at mid-aperture.
    """
    error: DeclaredError = getattr(mission.platforms, name).motion_error
    line = error.vibration.sinusoidal[entry]
    if not isinstance(line.displacement, tuple):
        return [PathSinusoid(float(lines_of(mission, name)[entry].amplitude), line.frequency)]
    axes, sight = getattr(mission.geometry, name).frame(error.frame), sight_of(mission, name)
    return [
        PathSinusoid(size, line.frequency, 0.0 if dot(axis, sight) >= 0 else math.pi, axis)
        for axis, size in zip(axes, line.displacement, strict=True)
        if size
    ]


def pulses_for(mission: Mission, cells: int) -> int:
    """Number of pulses with which the patch and all declared vibrations are sampled without aliasing.

    This is `collection.pulses` if the mission file declares it. Otherwise it is a power of two, with at least two
    pulses per resolution cell and four per cycle of vibration. A `SimulationError` is raised if the declared number
    is too small, or if the necessary number is too large.
    """
    pulses = mission.collection.pulses
    cycles = max((line.frequency for line in _flown_lines(mission)), default=0.0) * mission.collection.aperture_time
    if pulses is not None and pulses <= 2 * cycles:
        raise SimulationError(
            f"collection.pulses is {pulses}, but a declared vibration makes {cycles:.4g} cycles in the aperture and "
            f"aliases up to {2 * cycles:.4g} pulses; omit the key to get what it takes"
        )
    if pulses is None:
        needed = max(2 * cells, 4 * cycles)
        if needed > _MAX_PULSES:
            raise SimulationError(
                f"a patch of {cells} resolution cells and {cycles:.4g} cycles of vibration take {needed:.3g} pulses, "
                f"at most {_MAX_PULSES} are simulated unless collection.pulses asks for more"
            )
        return max(_MIN_PULSES, 1 << (math.ceil(needed) - 1).bit_length())
    if pulses < 2 * cells:
        raise SimulationError(
            f"collection.pulses is {pulses}, but the patch is {cells} resolution cells wide and aliases below "
            f"{2 * cells} pulses; omit the key to get what it takes"
        )
    return pulses


def _measured(cut: Complexes, spacing: float, mask_m: float | None) -> ImpulseResponse:
    """Measure the impulse response along a cross-range cut, after shifting its peak cyclically to the middle.

    If a smear covers most of the patch, the peak may be near an end of the cut, and the shift wraps the smear around.
    If the measurement then fails, it is repeated with a cut that is padded with zeros to twice its length.
    """
    count, column = cut.size, int(np.argmax(np.abs(cut)))
    try:
        return impulse_response(np.roll(cut, count // 2 - column), spacing, mask_m)
    except ValueError:
        padded = np.concatenate((cut, np.zeros(count, dtype=complex)))
        return impulse_response(np.roll(padded, count - column), spacing, mask_m)


def _clutter(level_db: float | None, grid: Floats, finer: float, seed: int) -> tuple[Floats, Complexes]:
    """Random scatterers of clutter over a patch: positions (n, 2) [m] and circular normal amplitudes (n,).

    There is one scatterer for each resolution cell. The area of a cell equals the energy of a response with a peak of
    1, which is its power integrated over the ground; `level_db` is therefore the mean power of a pixel. Both results
    are empty if `level_db` is None. A range cell has `finer` times as many pixels as a cross-range cell. If `finer`
    is above 1, scatterers up to a range cell beyond the patch are included, because their responses extend into it.
    These scatterers are out of focus: for each row of pixels between them and the patch, their blur in cross-range
    increases by several pixels.
    """
    if level_db is None:
        return np.empty((0, 2)), np.empty(0, dtype=complex)
    rng = np.random.default_rng([seed, _CLUTTER_STREAM_INDEX])
    nx, ny = grid.shape[:2]
    margin_rows = min(_SAMPLES_PER_CELL * (finer - 1), 2 * nx)  # the grid cannot be extrapolated farther
    margin_columns = _BLUR_COLUMNS_PER_LINE * margin_rows
    count = round((nx - 1 + 2 * margin_rows) * (ny - 1 + 2 * margin_columns) / (_SAMPLES_PER_CELL**2 * finer))
    row, column = (
        rng.uniform(-margin_rows, nx - 1 + margin_rows, count),
        rng.uniform(-margin_columns, ny - 1 + margin_columns, count),
    )
    amplitudes = 10 ** (level_db / 20) * (rng.normal(size=count) + 1j * rng.normal(size=count)) / math.sqrt(2)
    return between(grid[..., :2], row, column), amplitudes


def _window(plan: Plan, cells: Floats, index: int) -> tuple[slice, slice]:
    """Window (rows, columns) around the target with the given index in the rotated patch.

    `cells` (targets, 2) holds the positions of the targets, in resolution cells from the middle of the patch. A
    single target gets the whole patch. Among several targets, the window ends halfway to the nearest target of a
    similar range, but it has at least a minimum width.
    """
    distances = np.abs(cells - cells[index])
    neighbours = distances[(distances[:, 0] < 2 * _SEPARATE_RANGE_CELLS) & (distances[:, 1] > 0), 1]
    reach = plan.own_cells // 2 if len(cells) > 1 else plan.rotated.shape[1]
    if neighbours.size:
        reach = min(reach, max(_MIN_WINDOW_CELLS, int(neighbours.min() / 2)))
    rows = math.ceil(plan.finer * _SEPARATE_RANGE_CELLS) if len(cells) > 1 else plan.rotated.shape[0]
    slices = []
    for cell, half, count in zip(cells[index] * (plan.finer, 1.0), (rows, reach), plan.rotated.shape, strict=True):
        middle = count // 2 + round(_SAMPLES_PER_CELL * float(cell))
        slices.append(slice(max(0, middle - _SAMPLES_PER_CELL * half), middle + _SAMPLES_PER_CELL * half + 1))
    return slices[0], slices[1]


def _cuts(
    images: Sequence[Complexes], rows: Sequence[float], columns: slice, spacing: float, amplitude: float
) -> list[ImpulseResponse | None]:
    """Measure the response of a target in each image. The first image has no errors and sets the mainlobe mask.

    The entry is None for an image in which the target cannot be measured. All entries are None if the peak in the
    first image is not above half of `amplitude`, because the patch then does not contain the target.
    """
    measures: list[ImpulseResponse | None] = []
    mask = None
    for image, row in zip(images, rows, strict=True):
        try:
            measures.append(_measured(line_at(image[:, columns], row), spacing, mask))
        except ValueError:  # a neighbour reaches into its mainlobe
            measures.append(None)
        mask = measures[0].mask_m if measures[0] else None
    error_free = measures[0]
    return measures if error_free and error_free.peak > _MIN_HEIGHT_FRACTION * amplitude else [None] * len(measures)
