"""Paths of a mission's platforms over the aperture, from an orbit, a flight log, or a geodetic position."""

import hashlib
import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple, TypeVar

import numpy as np

from bisar_budget.arrays import Booleans
from bisar_budget.error_kinds.path_kinds import MEASURED_KINDS
from bisar_budget.faults import KeyPath, Problem, printable
from bisar_budget.geometry import STRAIGHT, PlatformState, UndefinedFrameError
from bisar_budget.mission.covariance import MOTION_KINDS, Covariance
from bisar_budget.mission.instruments import Overridden
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import (
    ORBIT,
    RAW,
    SMOOTHED,
    TRAJECTORY,
    FlownPath,
    LogNoise,
    MotionError,
    OrbitSource,
    Platform,
    Platforms,
    TrajectorySource,
    without_image,
)
from bisar_budget.mission.propagation import too_low
from bisar_budget.mission.readers import INVALID, Invalid, Report, SectionValues
from bisar_budget.paths import earth
from bisar_budget.paths.accuracy import (
    StatedAccuracy,
    as_matrix,
    as_rows,
    block_turned,
    correlations,
    covering_sigmas,
    diagonal,
    with_rate,
)
from bisar_budget.paths.flight import (
    Fitted,
    Log,
    Orbit,
    PathDoubt,
    PathFileError,
    around_aperture,
    dated,
    hold_to_usable_records,
    interpolated,
    slow_times,
    smoothed,
    stretch_around,
    track_around,
    widest_stretch,
)
from bisar_budget.paths.flight_history import history_of
from bisar_budget.paths.free_fall import fall_of, of_scene
from bisar_budget.paths.instant import DAY_S, Instant, later
from bisar_budget.paths.log_places import LogKeys, filled_sigmas, hold_to_motion
from bisar_budget.paths.orientation import UNKNOWN, Orientation, read_earth_rotation
from bisar_budget.paths.path_formats import ORBIT_FORMATS, hold_to_format, hold_to_log, read_log
from bisar_budget.paths.sbet import read_accuracy
from bisar_budget.resources import DISK, Files, UnreadableError
from bisar_budget.units import format_quantity

_T = TypeVar("_T")
Floats = earth.Floats
Beside = Callable[[str], bytes]  # name of a file in a mission to the content of the file

_FILE_KEYS = (*ORBIT_FORMATS, "file", "accuracy")  # keys of orbits and trajectories that name files
_MAX_FILE_BYTES = 500_000_000
_KEPT_LOG_COUNT = 2  # both logs of a mission that is read repeatedly, as in `solve`
_logs: dict[tuple[object, ...], Log] = {}  # by the hash of the file and by the keys that affect its reading
_KEPT_PATH_COUNT = 256  # cases of a sweep share a path if the sweep changes nothing that affects it
_paths: dict[tuple[object, ...], FlownPath] = {}  # by all values that affect the path
_MAX_ORBIT_RADIUS_M = 4.1e8  # beyond the Moon
_ROUNDED_CORRELATION_FRACTION = 1e-6  # a correlation this small is a rounding error of turned axes
_MAX_DOUBT_FRACTION = 0.1  # of the slant range; with a larger uncertainty of the orbit the geometry is unknown
_DOUBTED_RESIDUAL_M = 1.0  # a larger residual of a log counts as an error of the path, like that of an ephemeris
_ACCEPTED_SCENE = "accepted: scene.latitude, scene.longitude and scene.height"


class _UnusablePathError(Exception):
    """A path that cannot be used: the key below the platform, and the problem."""

    def __init__(self, key: tuple[str, ...], problem: Problem) -> None:
        super().__init__(problem)
        self.key, self.problem = key, problem


def reader_of(folder: str, files: Files = DISK) -> Beside:
    """Return a function that takes the name of a file relative to `folder`, and returns its content.

    The function raises `PathFileError` if a file cannot be read, is not a regular file, or is larger than 500 MB.
    """

    def read(name: str) -> bytes:
        try:
            data = files.content(os.path.join(folder, name), _MAX_FILE_BYTES, name)
        except UnreadableError as error:
            raise PathFileError(printable(str(error))) from None
        if len(data) > _MAX_FILE_BYTES:
            raise PathFileError(f"{printable(name)} is larger than {_MAX_FILE_BYTES // 10**6} MB")
        return data

    return read


def path_files(mission: Mission) -> Iterator[tuple[str, str]]:
    """Yield the key and the file name of each file that a mission names, except for files of parts."""
    for name, platform in mission.platforms._asdict().items():
        for key, section in (("orbit", platform.orbit), ("trajectory", platform.trajectory)):
            for form in _FILE_KEYS:
                if isinstance(file := getattr(section, form, None), str):
                    yield f"platforms.{name}.{key}.{form}", file
    if mission.earth_orientation is not None and mission.earth_orientation.file is not None:
        yield "earth_orientation.file", mission.earth_orientation.file
    if mission.requirements.file is not None:
        yield "requirements.file", mission.requirements.file


def report_files(root: Mapping[str, object], read: Beside, report: Report) -> None:
    """Report orbits, logs and orientation tables that an otherwise invalid mission names but that cannot be read.

    Their content is not checked, because a path depends on the scene, time and aperture of a valid mission. `root` is
    the content of the mission file.
    """
    platforms, orientation = root.get("platforms"), root.get("earth_orientation")
    files: dict[KeyPath, object] = {}
    for name in Platforms._fields:
        platform = platforms.get(name) if isinstance(platforms, dict) else None
        for key, section in (("orbit", ORBIT), ("trajectory", TRAJECTORY)):
            values = section.each(platform.get(key)) if isinstance(platform, dict) else {}
            files |= {("platforms", name, key, form): values.get(form) for form in _FILE_KEYS}
    files["earth_orientation", "file"] = orientation.get("file") if isinstance(orientation, dict) else None
    for path, file in files.items():
        if isinstance(file, str):
            try:
                read(file)
            except PathFileError as error:
                report(path, _file_problem(file, error))


def with_paths(mission: Mission, read: Beside, report: Report) -> Mission | Invalid:
    """Return a mission with the paths of its platforms; if a path is unusable, report it and return `INVALID`.

    `read` returns the content of a file, and may raise `PathFileError`.
    """
    axes, platforms, is_valid = mission.scene.axes, mission.platforms, True
    if (orientation_problem := _unusable_orientation(mission, read)) is not None:
        report(("earth_orientation", "file"), orientation_problem)
        return INVALID
    for name, platform in platforms._asdict().items():
        try:
            placed = _with_path(mission, platform, axes, read)
        except _UnusablePathError as unusable:
            report(("platforms", name, *unusable.key), unusable.problem)
            is_valid = False
            continue
        for problem in placed.without_image(placed.motion_error):
            report(("platforms", name), problem)
            is_valid = False
        platforms = platforms._replace(**{name: placed})
    if not is_valid:
        return INVALID
    aperture_time, common = mission.collection.aperture_time, mission.common_motion_error
    problems = list(
        without_image(platforms, mission.radar, aperture_time, common, has_direct_path=mission.has_direct_path)
    )
    if mission.propagation is not None:
        problems += too_low(mission.propagation, platforms, aperture_time)
    for problem in problems:
        report((), problem)
    return INVALID if problems else mission._replace(platforms=platforms)


def _unusable_orientation(mission: Mission, read: Beside) -> Problem | None:
    """Problem with the Earth-orientation file that a mission names; None if it is usable, or if no file is named.

    The file is checked even if no path needs it.
    """
    section, center = mission.earth_orientation, mission.collection.center_time
    if section is None or section.file is None:
        return None
    if center is None:
        return Problem("needs an instant", "accepted: collection.center_time")
    try:
        _orientation(mission, center, read)
    except PathFileError as error:
        return _file_problem(section.file, error)
    return None


def _with_path(mission: Mission, platform: Platform, axes: earth.SceneAxes | None, read: Beside) -> Platform:
    """Return a platform with its path; errors that the source of the path states are added to its motion error.

    Raises `_UnusablePathError` if there is no usable path.
    """
    if platform.orbit is not None:
        path = _of_orbit(mission, platform.orbit, _required_axes(axes, "orbit"), read)
    elif platform.trajectory is not None:
        path = _of_log(mission, platform.trajectory, axes, read, _flight_of(mission, platform))
    elif platform.latitude is not None:
        path = _of_position(platform, _required_axes(axes, "latitude"), mission.collection.aperture_time)
    else:
        path = FlownPath(platform.state)
    if path.state.position[2] < 0:
        words = f"puts the platform below the scene's horizon, to z = {path.state.position[2]:.6g} m"
        raise _UnusablePathError((platform.way,), Problem(words))
    if axes is not None:
        path = path._replace(state=with_radial(path.state, axes))
    path = path._replace(state=with_dynamics(path.state, axes, is_orbit=platform.orbit is not None))
    trajectory, error = platform.trajectory, platform.motion_error
    if trajectory is not None and trajectory.accuracy is not None:
        accuracy, digest = _by_accuracy(mission, trajectory, error, read)
        path = path._replace(accuracy=(trajectory.accuracy, digest), stated=(accuracy,))
    for accuracy_stated in path.stated:
        error = _filled(error, accuracy_stated, path.state)
    return platform._replace(path=path, motion_error=error)


def _flight_of(mission: Mission, platform: Platform) -> tuple[float, float] | None:
    """First and last slow time [s] of the part of the flight that the aided navigation of a platform uses.

    None if the platform has no aided navigation.
    """
    navigation, half = platform.motion_error.navigation, mission.collection.aperture_time / 2
    return None if navigation is None else (-half - navigation.before, half + float(navigation.after_s))


def _file_problem(file: str | None, error: PathFileError) -> Problem:
    """Convert an error of a file's reader to a problem of the mission; the text names the file exactly once.

    `file` is the file name at the key with the problem; None if the key does not name the file.
    """
    words = str(error)
    words = f"{file} {words}" if file is not None and words.startswith("has ") else words
    return Problem(words, error.accepted, error.hint, names_value=file is not None and words.startswith(file))


def _required_axes(axes: earth.SceneAxes | None, key: str) -> earth.SceneAxes:
    """Return the axes of the scene; raises `_UnusablePathError` for `key` if the scene is not on the Earth."""
    if axes is None:
        raise _UnusablePathError((key,), Problem("needs the scene's position on the Earth", _ACCEPTED_SCENE))
    return axes


def with_radial(state: PlatformState, axes: earth.SceneAxes) -> PlatformState:
    """Add the axes of the `ric` frame (radial, in-track, cross-track) to the path of a platform.

    `axes` are the axes of a scene on the Earth. The path is returned unchanged if the `ric` axes are undefined, that
    is, if the inertial velocity is zero.
    """
    try:
        return replace(state, radial=axes.radial(state.position, state.velocity))
    except ZeroDivisionError:  # without motion relative to the stars there is no orbital plane
        return state


def with_dynamics(state: PlatformState, axes: earth.SceneAxes | None, *, is_orbit: bool = False) -> PlatformState:
    """Add the dynamics of errors in free fall to the path of a platform that is in orbit or falls freely.

    Any other path gets no such dynamics.
    """
    return replace(state, fall=of_scene(axes) if is_orbit else fall_of(state, axes))


class _OrbitFile(NamedTuple):
    """The file of an orbit.

    Attributes
    ----------
    form : str
        Key of the file's format, one of `ORBIT_FORMATS`.
    name : str, optional
        Name of the file; None if the mission file itself contains the element set.
    data : bytes
        Content of the file, or of the element set.
    object : str, optional
        Name or number of the object, which is needed if the file has several objects.
    is_planned : bool
        Whether the orbit is only planned. Age and interpolation then do not make it uncertain.
    """

    form: str
    name: str | None
    data: bytes
    object: str | None
    is_planned: bool = False

    @classmethod
    def of(cls, route: OrbitSource, read: Beside) -> "_OrbitFile":
        """Read the file of an orbit, or the element set in the mission file; raises `PathFileError`."""
        form = _form_of(route)
        source = getattr(route, form)
        if isinstance(source, str):
            return cls(form, source, read(source), route.object, bool(route.planned))
        return cls(form, None, "\n".join(source).encode(), route.object, bool(route.planned))

    def orbit(self, center: Instant, orientation: Orientation) -> Orbit:
        """Read the orbit for the instant `center`; raises `PathFileError` if the file does not cover this instant."""
        name = self.name or "the element set"
        hold_to_format(self.data, name, self.form)
        orbit = ORBIT_FORMATS[self.form].read(self.data, name, self.object, center, orientation)
        return orbit.as_planned() if self.is_planned else orbit


def _form_of(route: OrbitSource) -> str:
    """Key of the format in which the mission states the orbit, such as `tle`."""
    return next(form for form in ORBIT_FORMATS if getattr(route, form) is not None)


def orbits_of(mission: Mission, route: OrbitSource, read: Beside) -> Callable[[Instant], Orbit]:
    """Return a function that takes the time of mid-aperture, and returns the orbit of a mission for this time.

    If a file has several element sets or segments, the set or segment nearest to that time is used. `orbits_of`
    itself and the returned function may raise `PathFileError`. The orientation of the Earth is taken at noon of the
    day, because UT1 - UTC changes by only a millisecond per day.
    """
    orbit_file = _OrbitFile.of(route, read)

    @lru_cache(maxsize=64)
    def orientation(day: int) -> Orientation:
        return _orientation(mission, Instant(day, DAY_S / 2), read)[0]

    return lambda center: orbit_file.orbit(center, orientation(center.day))


def _of_orbit(mission: Mission, route: OrbitSource, axes: earth.SceneAxes, read: Beside) -> FlownPath:
    """Path of a platform over the aperture, computed from the orbit that the mission names."""
    center = mission.collection.center_time
    if center is None:
        raise _UnusablePathError(("orbit",), Problem("needs an instant", "accepted: collection.center_time"))
    orientation, table = _orientation(mission, center, read)
    try:
        orbit_file = _OrbitFile.of(route, read)
        digest, T = hashlib.sha256(orbit_file.data).hexdigest(), mission.collection.aperture_time

        def orbit_path() -> FlownPath:
            orbit = orbit_file.orbit(center, orientation)
            path = _orbit_path(orbit, orbit_file.name, center, axes, T)
            return path._replace(orientation=table) if orbit.is_turned else path

        key = (*orbit_file._replace(data=digest.encode()), center, axes, T, orientation, table)
        path = _kept(_paths, _KEPT_PATH_COUNT, key, orbit_path)
    except PathFileError as error:
        source = getattr(route, _form_of(route))
        file = source if isinstance(source, str) else None
        raise _UnusablePathError(("orbit", _form_of(route)), _file_problem(file, error)) from None
    return path._replace(sha256=digest, is_planned=orbit_file.is_planned)


def _orientation(mission: Mission, center: Instant, read: Beside) -> tuple[Orientation, tuple[str, str] | None]:
    """Orientation of the Earth at mid-aperture, and the name and SHA-256 of the table from which it is read.

    The second value is None if no table is used.
    """
    section = mission.earth_orientation
    if section is None:
        return UNKNOWN._replace(day=center.day), None
    if section.file is None:
        return section.orientation._replace(day=center.day), None
    data = read(section.file)  # `with_paths` has checked that it can be read
    turned = read_earth_rotation(data, section.file, center)._replace(day=center.day)
    return turned, (section.file, hashlib.sha256(data).hexdigest())


def _kept(cache: dict[tuple[object, ...], _T], most: int, key: tuple[object, ...], make: Callable[[], _T]) -> _T:
    """Return the value of `key` from a cache; a missing value is computed with `make` and stored.

    The cache keeps the `most` values that were used most recently.
    """
    value = cache.pop(key, None) or make()
    cache[key] = value
    for old in list(cache)[:-most]:
        cache.pop(old, None)
    return value


def _orbit_path(
    orbit: Orbit, file: str | None, center: Instant, axes: earth.SceneAxes, aperture_time_s: float
) -> FlownPath:
    """Interpolate an orbit, and return the path over an aperture, its stated accuracy, and warnings about it.

    Raises `PathFileError` if the orbit does not cover the aperture or is too uncertain.
    """
    name, half, widest = file or "the element set", aperture_time_s / 2, math.inf
    if orbit.span is not None:
        before, after = center.since(orbit.span[0]), orbit.span[1].since(center)
        if min(before, after) < half:
            raise PathFileError(
                f"{file}: covers {orbit.span[0].as_text()} to {orbit.span[1].as_text()}, the aperture is "
                f"{aperture_time_s:g} s around {center.as_text()}"
            )
        widest = 2 * min(before, after)
    far = math.hypot(*orbit.place(center))
    if far > _MAX_ORBIT_RADIUS_M:
        words = f"{far:.4g} m from the Earth's centre, farther than the Moon; are its units km?"
        raise PathFileError(f"{name}: is {words}")

    def places(times: earth.Floats) -> earth.Floats:
        return axes.places(np.array([orbit.place(later(center, time)) for time in times.tolist()]))

    fitted = interpolated(places, aperture_time_s, widest)
    # An interpolation is worst between the positions of a file.
    instants = [later(center, fraction * half) for fraction in (0.0, -0.5, 0.5, -1.0, 1.0)]
    orbit_doubts = max((orbit.doubts(instant) for instant in instants), key=len)
    doubt = max(orbit.doubt(instant) for instant in instants)
    _hold_to_range(doubt, float(fitted.state.slant_range), orbit_doubts, orbit.remedy, name)
    age = None if orbit.epoch is None else center.since(orbit.epoch)
    doubts = (*orbit_doubts, *fitted.doubts)
    return _flown(fitted, orbit.words, file)._replace(
        age=age,
        doubts=doubts,
        doubt_m=doubt.size + fitted.farthest,
        doubt_of=doubt.words,
        is_doubted=bool(doubts),
        stated=tuple(_stated_of_orbit(orbit, center, axes, name)),
    )


def _stated_of_orbit(orbit: Orbit, center: Instant, axes: earth.SceneAxes, name: str) -> Iterator[StatedAccuracy]:
    """Yield the accuracy of an orbit at mid-aperture, along the axes of the scene, if its file states an accuracy."""
    accuracy = orbit.stated(center)
    if accuracy is not None:
        covariance = accuracy.covariance
        turned = None if covariance is None else as_matrix(block_turned(np.array(covariance), np.array(axes.axes)))
        yield accuracy._replace(covariance=turned, words=f"{name}, {accuracy.words}")


def _hold_to_range(doubt: PathDoubt, slant_range: float, doubts: Sequence[str], remedy: str, name: str) -> None:
    """Refuse an orbit whose uncertainty exceeds a tenth of the slant range [m]: the geometry is then unknown.

    Raises `PathFileError`. The message contains the warnings `doubts`, the advice `remedy`, and the file name `name`.
    """
    if not doubt.size <= _MAX_DOUBT_FRACTION * slant_range:
        lengths = (slant_range, _MAX_DOUBT_FRACTION * slant_range, doubt.size)
        slant_range_text, largest, size = (format_quantity(length, "m", 4) for length in lengths)
        words = doubts[0] if doubts else f"{name}: {doubt.words}"
        raise PathFileError(
            f"{words}; a doubt of {size} is more than a tenth of the slant range, {slant_range_text}",
            f"accepted: an orbit that is known to {largest}",
            remedy,
        )


def _of_log(
    mission: Mission,
    route: TrajectorySource,
    axes: earth.SceneAxes | None,
    read: Beside,
    flight: tuple[float, float] | None,
) -> FlownPath:
    """Path of a platform over the aperture from the flight log that the mission names, or from the cache.

    `flight` are the first and the last slow time [s] of the part of the flight that an aided navigation uses; None if
    the platform has no aided navigation.
    """
    aperture_time = mission.collection.aperture_time
    try:
        data = read(route.file)
        digest = hashlib.sha256(data).hexdigest()
        key = (route, digest, mission.collection.center_time, axes, aperture_time, flight)
        return _kept(_paths, _KEPT_PATH_COUNT, key, lambda: _log_path(mission, route, axes, data, digest, flight))
    except PathFileError as error:
        problem = _file_problem(None if error.key else route.file, error)
        raise _UnusablePathError(("trajectory", error.key or "file"), problem) from None


def _log_path(
    mission: Mission,
    route: TrajectorySource,
    axes: earth.SceneAxes | None,
    data: bytes,
    digest: str,
    flight: tuple[float, float] | None,
) -> FlownPath:
    """Path over an aperture, smoothed from a flight log, with the log's noise, stated accuracy and warnings.

    `flight` is described in `_of_log`.
    """
    center, aperture_time = mission.collection.center_time, mission.collection.aperture_time
    log = dated(track_around(_log(route, data, digest), center, route.center, aperture_time, route.file), center)
    if log.is_earth_fixed:
        scene_axes = _required_axes(axes, "trajectory")
        grid = as_rows(np.array(log.grid) @ np.array(scene_axes.axes).T)
        log = replace(log, places=scene_axes.places(log.places), is_earth_fixed=False, grid=grid)
    times = slow_times(log, center, route.center, aperture_time, route.file)
    needed = stretch_around(times, aperture_time)
    hold_to_usable_records(log, times, needed)
    hold_to_motion(times, log.places, needed, route.file)
    fitted = smoothed(times, log.places, aperture_time, widest_stretch(log, times, aperture_time))
    if fitted.stretch > needed:
        try:
            hold_to_motion(times, log.places, fitted.stretch, route.file)
        except PathFileError:  # an impossible fix outside the needed stretch does not make the log unusable
            fitted = smoothed(times, log.places, aperture_time)
    words = log.words + {SMOOTHED: ", smoothed by the processor", RAW: ", used as it is by the processor"}.get(
        route.processed or "", ""
    )
    if log.start is None:
        words += f", {route.center or 0.0:.12g} s of it at mid-aperture"
    path = _flown(fitted, words, route.file, digest)
    path = path._replace(stated=tuple(_stated_of_log(log, around_aperture(times, aperture_time), route.file)))
    # A sigma is compared with the root mean square; the largest residual of thousands of fixes is four times that.
    words = "residual of the smoothed log at fixes left out, root mean square"
    return path._replace(
        doubt_m=fitted.missed,
        doubt_of=words,
        is_doubted=fitted.missed > _DOUBTED_RESIDUAL_M,
        log_noise=LogNoise(fitted.residual, fitted.correlation_time, log.grid, route.processed),
        acceleration_noise=fitted.acceleration_noise,
        path_noise=fitted.path_noise,
        history=None if flight is None else history_of(times, log.places, *flight),
    )


def _log(route: TrajectorySource, data: bytes, digest: str) -> Log:
    """Read a flight log from the content of its file, or take it from the cache."""
    keys = LogKeys(route.week, route.time_scale, route.geoid_separation, route.talker, route.track, route.instance)
    key = (route.file, route.format, keys, digest)

    def read_file() -> Log:
        hold_to_log(data, route.file)
        return read_log(data, route.file, route.format, keys)

    return _kept(_logs, _KEPT_LOG_COUNT, key, read_file)


def _by_accuracy(
    mission: Mission, route: TrajectorySource, error: MotionError, read: Beside
) -> tuple[StatedAccuracy, str]:
    """Read the accuracy file of a flight log; return the accuracy over the aperture, and the SHA-256 of the file."""
    file = route.accuracy or ""
    key = ("trajectory", "accuracy")
    if error.frame != "scene":
        raise _UnusablePathError(key, Problem("states errors east, north, up", "accepted: motion_error.frame: scene"))
    try:
        data = read(file)
        collection = mission.collection
        accuracy = read_accuracy(
            data, file, route.week, collection.center_time, route.center, collection.aperture_time
        )
    except PathFileError as unusable:
        raise _UnusablePathError(key, _file_problem(file, unusable)) from None
    if not error.is_measured and error.covariance is None and None in (error.position, error.velocity):
        raise _UnusablePathError(key, Problem("states one sigma", "accepted: motion_error.distribution: normal"))
    variances = [sigma**2 for sigma in (*accuracy.position, *accuracy.velocity)]
    return StatedAccuracy(f"accuracy file {file}", diagonal(variances)), hashlib.sha256(data).hexdigest()


def _stated_of_log(log: Log, near: slice, file: str) -> Iterator[StatedAccuracy]:
    """Yield the accuracies of a log around the aperture: the largest stated sigmas, and the largest typical sigma.

    If no sigma is stated along an axis, the largest sigma of the other axes is used for this axis. The typical sigma
    of a fix follows from the quality of the fix. It is used for fixes whose stated sigmas are incomplete. `near`
    selects the fixes around the aperture.
    """
    unstated: Booleans = np.ones(log.times[near].shape, dtype=bool)
    if log.sigmas is not None:
        sigmas = np.nan_to_num(log.sigmas[near])
        largest = filled_sigmas(sigmas.max(axis=0))
        unstated = np.logical_not((sigmas > 0).all(axis=1))
        if largest.any():  # 0 means unknown
            yield StatedAccuracy(f"solution {file}", diagonal((largest**2).tolist()))
    if log.typical_sigmas is not None:
        usual = np.where(unstated, np.nan_to_num(log.typical_sigmas[near]), 0.0)
        worst = int(usual.argmax())
        if usual[worst]:
            quality = log.quality_words(worst + (near.start or 0))
            words = f"fixes of {file} ({quality})" if quality else f"fixes of {file}"
            yield StatedAccuracy(words, diagonal([usual[worst] ** 2] * 3), is_typical=True)


def _filled(error: MotionError, stated: StatedAccuracy, state: PlatformState) -> MotionError:
    """Complete a motion error with the accuracy that the source of the path states.

    The accuracy is rotated to the axes of the motion error. An accuracy without a direction is used for each axis,
    because the error may have any direction. If the mission file states the same figure, the figure in the mission
    file is kept, and the figure of the source is listed in `overridden`.
    """
    if stated.is_typical:
        return error
    try:
        axes = np.array(state.frame(error.frame), dtype=float)
    except UndefinedFrameError:  # reported for the mission
        return error
    covariance_of_source = diagonal([stated.total**2] * 3) if stated.covariance is None else stated.covariance
    along = block_turned(np.array(covariance_of_source), axes)
    if error.frame == "ric" and state.fall is not None and len(along) == 6:
        along = with_rate(along, axes @ np.array(state.fall.rotation))  # `ric` velocities are relative to the stars
    kinds = MOTION_KINDS[: len(along) // 3]
    sigmas = np.sqrt(np.diag(along))
    is_complete = error.covariance is None and error.position is None and error.velocity is None
    if is_complete and len(kinds) == 2 and error.is_measured and _is_correlated(along):
        covariance = Covariance(tuple(sigmas.tolist()), correlations(along), is_matrix=False)
        of_source = tuple((figure, stated.words) for figure in ("covariance", *kinds))
        return error._replace(covariance=covariance, of_parts=(*error.of_parts, *of_source))
    for index, kind in enumerate(kinds):
        block = along[3 * index : 3 * index + 3, 3 * index : 3 * index + 3]
        if not np.trace(block) > 0:
            continue
        unit = MEASURED_KINDS[MOTION_KINDS.index(kind)].unit
        if error.covariance is not None or getattr(error, kind) is not None:
            figure = [format_quantity(sigma, unit) for sigma in np.sqrt(np.diag(block)).tolist()]
            key = f"motion_error.{'covariance' if error.covariance is not None else kind}"
            if stated.covariance is not None:
                replaced = Overridden(kind, key, stated.words, f"[{', '.join(figure)}]")
                error = error._replace(overridden=(*error.overridden, replaced))
        elif error.distribution_of(kind) == "normal":
            figures: SectionValues = {kind: covering_sigmas(block)}
            error = error._replace(**figures, of_parts=(*error.of_parts, (kind, stated.words)))
    return error


def _is_correlated(covariance: Floats) -> bool:
    """Whether any two errors of a covariance matrix have a correlation that is larger than a rounding error."""
    off_diagonal = np.array(correlations(covariance)) - np.eye(len(covariance))
    return bool(np.abs(off_diagonal).max() > _ROUNDED_CORRELATION_FRACTION)


def _of_position(platform: Platform, axes: earth.SceneAxes, aperture_time_s: float) -> FlownPath:
    """Path over the aperture along a geodesic, from a geodetic position with the stated speed and climb rate.

    A platform without speed and climb rate stays at its position.
    """
    position = earth.Geodetic(platform.latitude or 0.0, platform.longitude or 0.0, platform.altitude or 0.0)
    speed, heading, climb = platform.speed or 0.0, platform.heading or 0.0, platform.climb or 0.0
    if not speed and not climb:
        return FlownPath(
            PlatformState(position=axes.place(earth.earth_fixed(position)), velocity=STRAIGHT), "geodetic position"
        )

    def path() -> FlownPath:
        fitted = interpolated(
            lambda times: axes.places(earth.flown(position, heading, speed, climb, times)), aperture_time_s
        )
        return _flown(fitted, "geodetic position, flight along the geodesic")

    key = (position, heading, speed, climb, axes, aperture_time_s)
    return _kept(_paths, _KEPT_PATH_COUNT, key, path)


def _flown(fitted: Fitted, words: str, file: str | None = None, digest: str | None = None) -> FlownPath:
    """Make a `FlownPath` from a fitted path, with the residuals of the fit and warnings about them.

    `words` is a phrase that names the source of the path. `file` and `digest` are the name and the SHA-256 of the
    source file, if there is one.
    """
    return FlownPath(
        fitted.state,
        source=words,
        file=file,
        sha256=digest,
        order=fitted.order,
        pieces=fitted.pieces,
        farthest=fitted.farthest,
        rms=fitted.rms,
        samples=fitted.samples or None,
        stretch=fitted.stretch or None,
        doubts=fitted.doubts,
        doubt_m=fitted.farthest,
        doubt_of="polynomial that is flown",
        is_doubted=bool(fitted.doubts),
    )
