"""Put the path of each platform into a mission: from its orbit, the log of its flight or its geodetic place."""

import hashlib
import math
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple, TypeVar

import numpy as np

from bisar_budget.faults import KeyPath, Problem, printable
from bisar_budget.geometry import STRAIGHT, PlatformState, UndefinedFrameError
from bisar_budget.mission.covariance import KINDS, Covariance
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
from bisar_budget.mission.readers import INVALID, Report
from bisar_budget.paths import earth
from bisar_budget.paths.accuracy import (
    StatedAccuracy,
    as_matrix,
    as_rows,
    block_turned,
    correlations,
    covering_sigmas,
    diagonal,
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
from bisar_budget.paths.instant import DAY, Instant, later
from bisar_budget.paths.log_places import LogKeys, filled_sigmas, hold_to_motion
from bisar_budget.paths.orientation import UNKNOWN, Orientation, read_earth_rotation
from bisar_budget.paths.path_formats import ORBIT_FORMATS, hold_to_format, hold_to_log, read_log
from bisar_budget.paths.sbet import read_accuracy
from bisar_budget.resources import DISK, Files, UnreadableError
from bisar_budget.units import format_quantity

_T = TypeVar("_T")
Floats = earth.Floats
Beside = Callable[[str], bytes]  # content of a file that a mission names

_FILES = (*ORBIT_FORMATS, "file", "accuracy")  # keys of a path that name one
_MOST_BYTES = 500_000_000
_LOGS_KEPT = 2  # of a mission that is read again and again, such as by `solve`
_logs: dict[tuple[object, ...], Log] = {}  # by what they were read from; the bytes themselves are let go
_PATHS_KEPT = 256  # of cases that a sweep reads: where nothing that a path follows from changes
_paths: dict[tuple[object, ...], FlownPath] = {}  # by what they follow from
_FARTHEST_M = 4.1e8  # of a satellite from the Earth's centre
_UNCORRELATED = 1e-6  # of a correlation: what turning axes leaves by rounding
_LOST = 0.1  # of the slant range: a satellite that may be farther off leaves nothing of the geometry
_NOISE_M = 1.0  # residual of a log that is doubted where the file declares no position error; as of an ephemeris
_PLACE = "accepted: scene.latitude, scene.longitude and scene.height"


class _UnusablePathError(Exception):
    """A path that cannot be found: below which key of the platform, and why."""

    def __init__(self, key: tuple[str, ...], problem: Problem) -> None:
        super().__init__(problem)
        self.key, self.problem = key, problem


def reader_of(folder: str, files: Files = DISK) -> Beside:
    """Return a function that reads files beside a mission file in a folder.

    It raises `PathFileError` where a file cannot be read, is no regular file, or is larger than 500 MB.
    """

    def read(name: str) -> bytes:
        try:
            data = files.content(os.path.join(folder, name), _MOST_BYTES, name)
        except UnreadableError as error:
            raise PathFileError(printable(str(error))) from None
        if len(data) > _MOST_BYTES:
            raise PathFileError(f"{printable(name)} is larger than {_MOST_BYTES // 10**6} MB")
        return data

    return read


def path_files(mission: Mission) -> Iterator[tuple[str, str]]:
    """Keys under which a mission names an orbit or a log, and the names."""
    for name, platform in mission.platforms._asdict().items():
        for key, section in (("orbit", platform.orbit), ("trajectory", platform.trajectory)):
            for form in _FILES:
                if isinstance(file := getattr(section, form, None), str):
                    yield f"platforms.{name}.{key}.{form}", file
    if mission.earth_orientation is not None and mission.earth_orientation.file is not None:
        yield "earth_orientation.file", mission.earth_orientation.file


def report_files(root: Any, read: Beside, report: Report) -> None:
    """Say which orbits and logs cannot be read, of a file that is no mission for other reasons.

    What they say is looked at where the rest of the mission is there: a path depends on its scene, time and aperture.
    `root` is what the file says.
    """
    platforms, stated = root.get("platforms"), root.get("earth_orientation")
    named: dict[KeyPath, Any] = {}
    for name in Platforms._fields:
        platform = platforms.get(name) if isinstance(platforms, dict) else None
        for key, section in (("orbit", ORBIT), ("trajectory", TRAJECTORY)):
            values = section.each(platform.get(key)) if isinstance(platform, dict) else {}
            named |= {("platforms", name, key, form): values.get(form) for form in _FILES}
    named["earth_orientation", "file"] = stated.get("file") if isinstance(stated, dict) else None
    for path, file in named.items():
        if isinstance(file, str):
            try:
                read(file)
            except PathFileError as error:
                report(path, _of_file(file, error))


def with_paths(mission: Mission, read: Beside, report: Report) -> Any:
    """Put in the paths; `INVALID` after a report. `read` gives the content of a file, and raises `PathFileError`."""
    axes, platforms, is_valid = mission.scene.axes, mission.platforms, True
    if (wrong := _unusable_orientation(mission, read)) is not None:
        report(("earth_orientation", "file"), wrong)
        return INVALID
    for name, platform in platforms._asdict().items():
        try:
            found = _with_path(mission, platform, axes, read)
        except _UnusablePathError as unusable:
            report(("platforms", name, *unusable.key), unusable.problem)
            is_valid = False
            continue
        for problem in found.without_image(found.motion_error):
            report(("platforms", name), problem)
            is_valid = False
        platforms = platforms._replace(**{name: found})
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
    """Say what keeps the table of the Earth's orientation from being used, whether a path needs it or not."""
    stated, center = mission.earth_orientation, mission.collection.center_time
    if stated is None or stated.file is None:
        return None
    if center is None:
        return Problem("needs an instant", "accepted: collection.center_time")
    try:
        _orientation(mission, center, read)
    except PathFileError as error:
        return _of_file(stated.file, error)
    return None


def _with_path(mission: Mission, platform: Platform, axes: earth.SceneAxes | None, read: Beside) -> Platform:
    if platform.orbit is not None:
        path = _of_orbit(mission, platform.orbit, _known(axes, "orbit"), read)
    elif platform.trajectory is not None:
        path = _of_log(mission, platform.trajectory, axes, read)
    elif platform.latitude is not None:
        path = _of_place(platform, _known(axes, "latitude"), mission.collection.aperture_time)
    else:
        path = FlownPath(platform.state)
    if path.state.position[2] < 0:
        words = f"puts the platform below the scene's horizon, to z = {path.state.position[2]:.6g} m"
        raise _UnusablePathError((platform.way,), Problem(words))
    if axes is not None:
        path = path._replace(state=with_radial(path.state, axes))
    trajectory, error = platform.trajectory, platform.motion_error
    if trajectory is not None and trajectory.accuracy is not None:
        accuracy, digest = _by_accuracy(mission, trajectory, error, read)
        path = path._replace(accuracy=(trajectory.accuracy, digest), stated=(accuracy,))
    for one in path.stated:
        error = _filled(error, one, path.state)
    return platform._replace(path=path, motion_error=error)


def _of_file(file: str | None, error: PathFileError) -> Problem:
    """The problem with a file, which is the value of a key and is named once."""
    said = str(error)
    said = f"{file} {said}" if file is not None and said.startswith("has ") else said
    return Problem(said, error.accepted, error.hint, names_value=file is not None and said.startswith(file))


def _known(axes: earth.SceneAxes | None, key: str) -> earth.SceneAxes:
    if axes is None:
        raise _UnusablePathError((key,), Problem("needs the scene's place on the Earth", _PLACE))
    return axes


def with_radial(state: PlatformState, axes: earth.SceneAxes) -> PlatformState:
    """The path with the axes of its `ric` frame, of a scene on the Earth; without them where there are none."""
    try:
        return replace(state, radial=axes.radial(state.position, state.velocity))
    except ZeroDivisionError:  # at rest against the stars, on the Earth's axis: no plane
        return state


class _OrbitFile(NamedTuple):
    """The file of an orbit: the form it has, its name, its content, and which object of it is wanted.

    One that `is_planned` is flown as it stands. The name is None where an element set stands in the mission file.
    """

    form: str
    name: str | None
    data: bytes
    object: str | None
    is_planned: bool = False

    @classmethod
    def of(cls, route: OrbitSource, read: Beside) -> "_OrbitFile":
        """Read the file of an orbit; raises `PathFileError`."""
        form = _form_of(route)
        named = getattr(route, form)
        if isinstance(named, str):
            return cls(form, named, read(named), route.object, bool(route.planned))
        return cls(form, None, "\n".join(named).encode(), route.object, bool(route.planned))

    def orbit(self, center: Instant, orientation: Orientation) -> Orbit:
        """The orbit that is flown at an instant; raises `PathFileError` where there is none."""
        name = self.name or "the element set"
        hold_to_format(self.data, name, self.form)
        orbit = ORBIT_FORMATS[self.form].read(self.data, name, self.object, center, orientation)
        return orbit.as_planned() if self.is_planned else orbit


def _form_of(route: OrbitSource) -> str:
    """Key under which the mission file has an orbit."""
    return next(form for form in ORBIT_FORMATS if getattr(route, form) is not None)


def orbits_of(mission: Mission, route: OrbitSource, read: Beside) -> Callable[[Instant], Orbit]:
    """Return a function that gives the orbit which a mission flies in an aperture around an instant.

    Of several element sets, or segments of an ephemeris, that is the nearest one. Both raise `PathFileError`. The
    Earth is turned as at noon of the day: UT1 - UTC changes by a millisecond a day.
    """
    given = _OrbitFile.of(route, read)

    @lru_cache(maxsize=64)
    def orientation(day: int) -> Orientation:
        return _orientation(mission, Instant(day, DAY / 2), read)[0]

    return lambda center: given.orbit(center, orientation(center.day))


def _of_orbit(mission: Mission, route: OrbitSource, axes: earth.SceneAxes, read: Beside) -> FlownPath:
    center = mission.collection.center_time
    if center is None:
        raise _UnusablePathError(("orbit",), Problem("needs an instant", "accepted: collection.center_time"))
    orientation, table = _orientation(mission, center, read)
    try:
        given = _OrbitFile.of(route, read)
        digest, T = hashlib.sha256(given.data).hexdigest(), mission.collection.aperture_time

        def found() -> FlownPath:
            orbit = given.orbit(center, orientation)
            path = _orbit_path(orbit, given.name, center, axes, T)
            return path._replace(orientation=table) if orbit.is_turned else path

        key = (*given._replace(data=digest.encode()), center, axes, T, orientation, table)
        path = _kept(_paths, _PATHS_KEPT, key, found)
    except PathFileError as error:
        named = getattr(route, _form_of(route))
        file = named if isinstance(named, str) else None
        raise _UnusablePathError(("orbit", _form_of(route)), _of_file(file, error)) from None
    return path._replace(sha256=digest, is_planned=given.is_planned)


def _orientation(mission: Mission, center: Instant, read: Beside) -> tuple[Orientation, tuple[str, str] | None]:
    """How the Earth is turned in the middle of the aperture, and the table that says it with its SHA-256."""
    stated = mission.earth_orientation
    if stated is None:
        return UNKNOWN._replace(day=center.day), None
    if stated.file is None:
        return stated.orientation._replace(day=center.day), None
    data = read(stated.file)  # that it can be read is known, see `with_paths`
    turned = read_earth_rotation(data, stated.file, center)._replace(day=center.day)
    return turned, (stated.file, hashlib.sha256(data).hexdigest())


def _kept(kept: dict[tuple[object, ...], _T], most: int, key: tuple[object, ...], made: Callable[[], _T]) -> _T:
    """The value of a key, as it was made before or made now; so many are kept, the last that were asked for."""
    found = kept.pop(key, None) or made()
    kept[key] = found
    for old in list(kept)[:-most]:
        kept.pop(old, None)
    return found


def _orbit_path(
    orbit: Orbit, file: str | None, center: Instant, axes: earth.SceneAxes, aperture_time_s: float
) -> FlownPath:
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
    if far > _FARTHEST_M:
        words = f"{far:.4g} m from the Earth's centre, farther than the Moon; are its units km?"
        raise PathFileError(f"{name}: is {words}")

    def places(times: earth.Floats) -> earth.Floats:
        return axes.places(np.array([orbit.place(later(center, time)) for time in times.tolist()]))

    fitted = interpolated(places, aperture_time_s, widest)
    # An interpolation is worst between the places of a file.
    instants = [later(center, part * half) for part in (0.0, -0.5, 0.5, -1.0, 1.0)]
    of_orbit = max((orbit.doubts(instant) for instant in instants), key=len)
    doubt = max(orbit.doubt(instant) for instant in instants)
    _hold_to_range(doubt, fitted.state.slant_range, of_orbit, orbit.remedy, name)
    age = None if orbit.epoch is None else center.since(orbit.epoch)
    doubts = (*of_orbit, *fitted.doubts)
    return _flown(fitted, orbit.words, file)._replace(
        age=age,
        doubts=doubts,
        doubt_m=doubt.size + fitted.farthest,
        doubt_of=doubt.words,
        is_doubted=bool(doubts),
        stated=tuple(_stated_of_orbit(orbit, center, axes, name)),
    )


def _stated_of_orbit(orbit: Orbit, center: Instant, axes: earth.SceneAxes, name: str) -> Iterator[StatedAccuracy]:
    """Accuracy that the file of an orbit states in the middle of the aperture, along the scene's axes."""
    stated = orbit.stated(center)
    if stated is not None:
        own = stated.covariance
        turned = None if own is None else as_matrix(block_turned(np.array(own), np.array(axes.axes)))
        yield stated._replace(covariance=turned, words=f"{name}, {stated.words}")


def _hold_to_range(doubt: PathDoubt, slant_range: float, said: Sequence[str], remedy: str, name: str) -> None:
    """Refuse an orbit that may be elsewhere by more than a tenth of the slant range: the geometry is not known."""
    if not doubt.size <= _LOST * slant_range:
        away, known, size = (format_quantity(one, "m", 4) for one in (slant_range, _LOST * slant_range, doubt.size))
        words = said[0] if said else f"{name}: {doubt.words}"
        raise PathFileError(
            f"{words}; a doubt of {size} is more than a tenth of the slant range, {away}",
            f"accepted: an orbit that is known to {known}",
            remedy,
        )


def _of_log(mission: Mission, route: TrajectorySource, axes: earth.SceneAxes | None, read: Beside) -> FlownPath:
    aperture_time = mission.collection.aperture_time
    try:
        data = read(route.file)
        digest = hashlib.sha256(data).hexdigest()
        key = (route, digest, mission.collection.center_time, axes, aperture_time)
        return _kept(_paths, _PATHS_KEPT, key, lambda: _log_path(mission, route, axes, data, digest))
    except PathFileError as error:
        problem = _of_file(None if error.key else route.file, error)
        raise _UnusablePathError(("trajectory", error.key or "file"), problem) from None


def _log_path(
    mission: Mission, route: TrajectorySource, axes: earth.SceneAxes | None, data: bytes, digest: str
) -> FlownPath:
    center, aperture_time = mission.collection.center_time, mission.collection.aperture_time
    log = dated(track_around(_log(route, data, digest), center, route.center, aperture_time, route.file), center)
    if log.is_earth_fixed:
        known = _known(axes, "trajectory")
        grid = as_rows(np.array(log.grid) @ np.array(known.axes).T)
        log = replace(log, places=known.places(log.places), is_earth_fixed=False, grid=grid)
    times = slow_times(log, center, route.center, aperture_time, route.file)
    needed = stretch_around(times, aperture_time)
    hold_to_usable_records(log, times, needed)
    hold_to_motion(times, log.places, needed, route.file)
    fitted = smoothed(times, log.places, aperture_time, widest_stretch(log, times, aperture_time))
    if fitted.stretch > needed:
        try:
            hold_to_motion(times, log.places, fitted.stretch, route.file)
        except PathFileError:  # beside what is needed, a place that cannot be flown does not refuse the log
            fitted = smoothed(times, log.places, aperture_time)
    words = log.words + {SMOOTHED: ", flown smooth by the processor", RAW: ", flown as it is by the processor"}.get(
        route.processed or "", ""
    )
    if log.start is None:
        words += f", {route.center or 0.0:.12g} s of it at mid-aperture"
    path = _flown(fitted, words, route.file, digest)
    path = path._replace(stated=tuple(_stated_of_log(log, around_aperture(times, aperture_time), route.file)))
    # The root mean square is what a sigma is compared with: the largest of thousands of places is four of them.
    words = "residual of the smoothed log at places left out, root mean square"
    return path._replace(
        doubt_m=fitted.missed,
        doubt_of=words,
        is_doubted=fitted.missed > _NOISE_M,
        log_noise=LogNoise(fitted.residual, fitted.correlation_time, log.grid, route.processed),
        acceleration_noise=fitted.acceleration_noise,
        path_noise=fitted.path_noise,
    )


def _log(route: TrajectorySource, data: bytes, digest: str) -> Log:
    """Read a log, or take it as it was read before."""
    keys = LogKeys(route.week, route.time_scale, route.geoid_separation, route.talker, route.track, route.instance)
    key = (route.file, route.format, keys, digest)

    def made() -> Log:
        hold_to_log(data, route.file)
        return read_log(data, route.file, route.format, keys)

    return _kept(_logs, _LOGS_KEPT, key, made)


def _by_accuracy(
    mission: Mission, route: TrajectorySource, error: MotionError, read: Beside
) -> tuple[StatedAccuracy, str]:
    """Errors that the accuracy file of a log states, and its SHA-256."""
    file = route.accuracy or ""
    key = ("trajectory", "accuracy")
    if error.frame != "scene":
        raise _UnusablePathError(key, Problem("states errors east, north, up", "accepted: motion_error.frame: scene"))
    try:
        data = read(file)
        collection = mission.collection
        stated = read_accuracy(data, file, route.week, collection.center_time, route.center, collection.aperture_time)
    except PathFileError as unusable:
        raise _UnusablePathError(key, _of_file(file, unusable)) from None
    if error.distribution != "normal" and error.covariance is None and None in (error.position, error.velocity):
        raise _UnusablePathError(key, Problem("states one sigma", "accepted: motion_error.distribution: normal"))
    variances = [sigma**2 for sigma in (*stated.position, *stated.velocity)]
    return StatedAccuracy(f"accuracy file {file}", diagonal(variances)), hashlib.sha256(data).hexdigest()


def _stated_of_log(log: Log, near: slice, file: str) -> Iterator[StatedAccuracy]:
    """Accuracy that a log states of its fixes around the aperture: the largest sigmas, or what is usual of them.

    Along an axis of which the log states none, the largest of the others counts. The usual one counts for fixes of
    which the log does not state all sigmas.
    """
    unstated: Any = np.ones(log.times[near].shape, dtype=bool)
    if log.sigmas is not None:
        sigmas = np.nan_to_num(log.sigmas[near])
        largest = filled_sigmas(sigmas.max(axis=0))
        unstated = np.logical_not((sigmas > 0).all(axis=1))
        if largest.any():  # 0 is not known
            yield StatedAccuracy(f"solution {file}", diagonal((largest**2).tolist()))
    if log.typical_sigmas is not None:
        usual = np.where(unstated, np.nan_to_num(log.typical_sigmas[near]), 0.0)
        worst = int(usual.argmax())
        if usual[worst]:
            quality = log.quality_words(worst + (near.start or 0))
            words = f"fixes of {file} ({quality})" if quality else f"fixes of {file}"
            yield StatedAccuracy(words, diagonal([usual[worst] ** 2] * 3), is_typical=True)


def _filled(error: MotionError, stated: StatedAccuracy, state: PlatformState) -> MotionError:
    """Errors with those that the source of a path states, where the mission file states none.

    Along the axes of the motion error. The figure of a source that states no direction is taken on each axis: the
    error may have any. Figures that the mission file has itself are noted beside those of the source.
    """
    if stated.is_typical:
        return error
    try:
        axes = np.array(state.frame(error.frame), dtype=float)
    except UndefinedFrameError:  # which is said of the mission
        return error
    own = diagonal([stated.total**2] * 3) if stated.covariance is None else stated.covariance
    along = block_turned(np.array(own), axes)
    kinds = KINDS[: len(along) // 3]
    sigmas = np.sqrt(np.diag(along))
    is_complete = error.covariance is None and error.position is None and error.velocity is None
    if is_complete and len(kinds) == 2 and error.distribution == "normal" and _is_correlated(along):
        covariance = Covariance(tuple(sigmas.tolist()), correlations(along), is_matrix=False)
        parts = tuple((figure, stated.words) for figure in ("covariance", *kinds))
        return error._replace(covariance=covariance, of_parts=(*error.of_parts, *parts))
    for place, kind in enumerate(kinds):
        block = along[3 * place : 3 * place + 3, 3 * place : 3 * place + 3]
        if not np.trace(block) > 0:
            continue
        unit = {"position": "m", "velocity": "m/s"}[kind]
        if error.covariance is not None or getattr(error, kind) is not None:
            figure = [format_quantity(sigma, unit) for sigma in np.sqrt(np.diag(block)).tolist()]
            key = f"motion_error.{'covariance' if error.covariance is not None else kind}"
            if stated.covariance is not None:
                replaced = Overridden(kind, key, stated.words, f"[{', '.join(figure)}]")
                error = error._replace(overridden=(*error.overridden, replaced))
        elif error.distribution == "normal":
            figures: Any = {kind: covering_sigmas(block)}
            error = error._replace(**figures, of_parts=(*error.of_parts, (kind, stated.words)))
    return error


def _is_correlated(covariance: Floats) -> bool:
    """Whether errors of a covariance are correlated, beyond rounding."""
    apart = np.array(correlations(covariance)) - np.eye(len(covariance))
    return bool(np.abs(apart).max() > _UNCORRELATED)


def _of_place(platform: Platform, axes: earth.SceneAxes, aperture_time_s: float) -> FlownPath:
    """Flight along the geodesic, `speed` over ground at its height, which `climb` changes."""
    place = earth.Geodetic(platform.latitude or 0.0, platform.longitude or 0.0, platform.altitude or 0.0)
    speed, heading, climb = platform.speed or 0.0, platform.heading or 0.0, platform.climb or 0.0
    if not speed and not climb:
        return FlownPath(
            PlatformState(position=axes.place(earth.earth_fixed(place)), velocity=STRAIGHT), "geodetic place"
        )

    def path() -> FlownPath:
        fitted = interpolated(
            lambda times: axes.places(earth.flown(place, heading, speed, climb, times)), aperture_time_s
        )
        return _flown(fitted, "geodetic place, flight along the geodesic")

    key = (place, heading, speed, climb, axes, aperture_time_s)
    return _kept(_paths, _PATHS_KEPT, key, path)


def _flown(fitted: Fitted, words: str, file: str | None = None, digest: str | None = None) -> FlownPath:
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
