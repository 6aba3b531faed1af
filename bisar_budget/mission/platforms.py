"""Platforms of a mission file: their paths, each stated in one of five ways, and their motion errors.

A motion error is the error of the measured motion of a platform.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, NamedTuple

import numpy as np

from bisar_budget import units
from bisar_budget.arrays import Booleans, Floats, PerCase
from bisar_budget.constants import LEAST_FALLING_HEIGHT_M
from bisar_budget.error_kinds.path_kinds import ACCELERATION_KIND, POSITION_KIND, TIME_TAG_KIND, VELOCITY_KIND
from bisar_budget.error_kinds.random_kinds import RANDOM_KIND
from bisar_budget.faults import InvalidValueError, KeyPath, Problem
from bisar_budget.geometry import (
    STILL_SPEED_MPS,
    STRAIGHT,
    BistaticGeometry,
    PlatformState,
    UndefinedFrameError,
    Vector,
    norm,
    state_from_angles,
)
from bisar_budget.image_plane import degeneracy
from bisar_budget.json_types import Definitions, JsonObject
from bisar_budget.mission.covariance import COVARIANCE, MOTION_KINDS, Covariance, misplaced_axes
from bisar_budget.mission.instruments import (
    IMU,
    LEVER_ARM,
    OSCILLATOR,
    RANDOM,
    GaussMarkov,
    Imu,
    LeverArm,
    Oscillator,
    Overridden,
)
from bisar_budget.mission.navigation import NAVIGATION, Navigation
from bisar_budget.mission.readers import (
    ACCELERATION_COMPONENT,
    COORDINATE,
    DIRECTION,
    DISTRIBUTION,
    DISTRIBUTION_TEXT,
    ELEVATION,
    GROUND_SPEED,
    HEIGHT,
    INVALID,
    JERK_COMPONENT,
    LATITUDE,
    RANGE,
    SNAP_COMPONENT,
    UNCERTAINTY_TEXT,
    VELOCITY,
    Choice,
    Distributions,
    Invalid,
    Key,
    Quantity,
    Reader,
    Reference,
    RegisteredSizes,
    Report,
    Section,
    SectionValue,
    SectionValues,
    Source,
    Text,
    TextList,
    Triple,
    Whole,
    WithBias,
    YesNo,
    date_schema,
    either,
)
from bisar_budget.mission.vibrations import Vibration
from bisar_budget.paths.accuracy import Matrix, PathNoise, StatedAccuracy
from bisar_budget.paths.flight_history import FlightHistory
from bisar_budget.paths.instant import SCALES, Instant, parse_instant

if TYPE_CHECKING:
    from bisar_budget.mission.model import Radar

MIN_BASELINE_M = 1.0  # between platforms with a direct path
# Largest ratio of the relative motion in half an aperture to the smallest baseline. Up to this ratio, a fit through
# 16 nodes is accurate.
MAX_TRAVEL_RATIO = 3

_LEVEL_FRACTION = 1e-3  # of the speed; the direction of a smaller horizontal speed counts as undefined
# In units of half the aperture time. The steps of 1/32 are so small that the minimum of a distance is not missed.
_FINE_APERTURE_TIMES = np.linspace(-1, 1, 65)[:, None]

FRAMES = Choice("scene", "track", "look", "ric")
TIME_TAG = Quantity(units.TIME, ge=-1e3, le=1e3)
# Copies of `paths.path_formats`, whose import would load all readers in every check.
FLOWN_SECTIONS = ("orbit", "trajectory")  # of a platform: they take its path from a file
SMOOTHED, RAW = "smoothed", "raw"  # path that a processor uses: the log smoothed, or its raw fixes
_LOG_FORMAT_NAMES = ("csv", "sbet", "pos", "nmea", "gpx", "ulog")
# Keys of a motion error that describe what `navigation` computes.
_REPLACED_BY_NAVIGATION = ("imu", "covariance", "random", "sensor")
_POSITION_ERROR = WithBias(Triple(COORDINATE, or_scalar=True), "PositionError")
_VELOCITY_ERROR = WithBias(Triple(VELOCITY, or_scalar=True), "VelocityError")
_ACCELERATION_ERROR = WithBias(Triple(ACCELERATION_COMPONENT, or_scalar=True), "AccelerationError")
_TIME_TAG_ERROR = WithBias(TIME_TAG, "TimeTagError")
PART_REFERENCES = either(list, TextList(), Reference())


def distribution_for(distribution: str | Distributions, kind: str) -> str:
    """Distribution of the error of a `kind`, such as `velocity`; a mapping does not apply to other kinds of error."""
    if isinstance(distribution, str):
        return distribution
    name: str = getattr(distribution, kind, "normal")
    return name


def _size_of(error: "MotionError | CommonMotionError", kind: str) -> Vector | None:
    size: Vector | None = getattr(error, kind)
    return (0.0, 0.0, 0.0) if size is None and error.bias.get(kind) is not None else size


class MotionError(NamedTuple):
    """Error of the measured motion of one platform. A scalar means each axis.

    `of_parts` contains the figures that come from parts of the catalogue or from the source of the path, as pairs of
    the figure's name and its source. `overridden` lists figures of parts, and of the source of the path, that are
    replaced by keys of the mission file. `bias` has the biases by the keys of the errors: a vector along the axes of
    the frame, or a number, or None.
    """

    frame: Annotated[
        str,
        Key(
            FRAMES,
            "scene: east, north, up; track: along, cross, up; look: line of sight, cross, up; ric: radial, in-track, "
            "cross-track.",
        ),
    ] = "scene"
    position: Annotated[Vector | None, Key(_POSITION_ERROR, POSITION_KIND.description)] = None
    velocity: Annotated[Vector | None, Key(_VELOCITY_ERROR, VELOCITY_KIND.description)] = None
    acceleration: Annotated[Vector | None, Key(_ACCELERATION_ERROR, ACCELERATION_KIND.description)] = None
    covariance: Annotated[
        Covariance | None,
        Key(
            COVARIANCE,
            "Covariance of position and velocity, in place of the two keys: 6 x 6 in m and s, or sigmas with "
            "correlations.",
        ),
    ] = None
    distribution: Annotated[str | Distributions, Key(DISTRIBUTION, DISTRIBUTION_TEXT)] = "normal"
    vibration: Annotated[Vibration, Key(Section(Vibration))] = Vibration()
    sensor: Annotated[
        str | tuple[str, ...] | None,
        Key(
            PART_REFERENCES,
            "Parts of the catalogue (`bisar-budget sensors`), or files; keys of this file override theirs.",
        ),
    ] = None
    imu: Annotated[Imu | None, Key(IMU, "Figures of the inertial sensor.")] = None
    random: Annotated[
        tuple[GaussMarkov, ...],
        Key(RANDOM, RANDOM_KIND.description),
    ] = ()
    navigation: Annotated[
        Navigation | None,
        Key(
            NAVIGATION,
            "An inertial unit that a GNSS receiver aids, in place of imu, covariance, random and sensor.",
        ),
    ] = None
    time_tag: Annotated[
        float | None,
        Key(_TIME_TAG_ERROR, TIME_TAG_KIND.description),
    ] = None
    lever_arm: Annotated[
        LeverArm | None, Key(LEVER_ARM, "From the navigation's reference to the antenna's phase centre.")
    ] = None
    registered: Annotated[
        Mapping[str, float],
        Key(RegisteredSizes(), "Errors whose kinds installed packages register, by the name of the kind."),
    ] = {}
    source: Source = None
    of_parts: tuple[tuple[str, str], ...] = ()
    overridden: tuple[Overridden, ...] = ()
    bias: Mapping[str, SectionValue] = {}

    @staticmethod
    def problems(values: SectionValues) -> Iterator[Problem]:
        """Require a covariance that is consistent with the other keys of the motion error.

        A covariance must be stated in place of position and velocity, must name only axes of the frame, and must have
        the distribution `normal`. The names of the errors in `random` must be distinct.
        """
        yield from _names_twice(values.get("random", ()))
        if values.get("navigation") is not None:
            for key in _REPLACED_BY_NAVIGATION:
                if values.get(key):
                    yield Problem("stands beside navigation, which replaces it", "accepted: one of both", at=(key,))
        covariance: Covariance | None = values.get("covariance")
        if covariance is None:
            return
        replaced = [kind for kind in MOTION_KINDS if values.get(kind) is not None]
        if replaced:
            yield Problem(f"replaces position and velocity, but there is also a {replaced[0]}", at=("covariance",))
        distribution = values.get("distribution", "normal")
        if any(distribution_for(distribution, kind) != "normal" for kind in MOTION_KINDS):
            yield Problem("a covariance is that of a normal distribution", "accepted: normal", at=("distribution",))
        if "frame" in values:
            yield from misplaced_axes(covariance, values["frame"])

    def stated(self, kind: str) -> Vector | None:
        """Error of the given `kind` along the axes of the frame; None if no error of this kind is stated.

        `kind` is "position" [m], "velocity" [m/s] or "acceleration" [m/s²]. If a covariance is stated, the sigmas of
        position and velocity are taken from it.
        """
        if self.covariance is not None and kind in MOTION_KINDS:
            return self.covariance.of(kind)
        return _size_of(self, kind)

    def bias_of(self, kind: str) -> Vector | None:
        """Bias of the error of the given `kind` along the axes of the frame; None if none is stated."""
        bias: Vector | None = self.bias.get(kind)
        return bias

    def distribution_of(self, kind: str) -> str:
        """Distribution of the error of the given `kind`: `normal`, `uniform` or `bound`."""
        return distribution_for(self.distribution, kind)

    @property
    def is_measured(self) -> bool:
        """Whether errors of position and velocity are normal, so that their sizes are one sigma."""
        return all(self.distribution_of(kind) == "normal" for kind in MOTION_KINDS)

    def evidence(self, figure: str) -> str | None:
        """Source of a figure; None if no source is stated.

        If the figure comes from a part, this is the part's source. Otherwise it is the source that the mission file
        states for all figures of the section.
        """
        return dict(self.of_parts).get(figure, self.source)

    def is_of_part(self, figure: str) -> bool:
        """Whether a figure comes from a part of the catalogue or from the source of the path."""
        return figure in dict(self.of_parts)

    def key_of(self, figure: str) -> str:
        """Key under which the mission file states a figure; `sensor` if the figure is listed in `of_parts`."""
        return "sensor" if self.is_of_part(figure) else figure


def _names_twice(random: Sequence[GaussMarkov]) -> Iterator[Problem]:
    """Yield a problem for each random position error that has the same name as an earlier error."""
    seen: set[str] = set()
    for index, error in enumerate(random):
        if error.name in seen:
            yield Problem("is the name of an earlier error", at=("random", index, "name"))
        seen.add(error.name)


class CommonMotionError(NamedTuple):
    """The same error on both platforms, such as the bias of one GNSS service. A scalar means each axis.

    In the frame `scene` both platforms are displaced by the same vector. In any other frame each platform is
    displaced by the same components along its own axes: for example, both are too far along their tracks, or too far
    from the scene.
    """

    frame: Annotated[
        str,
        Key(
            FRAMES,
            "scene: one vector, east, north, up; track, look, ric: the same components in each platform's own axes.",
        ),
    ] = "scene"
    position: Annotated[Vector | None, Key(_POSITION_ERROR, POSITION_KIND.description)] = None
    velocity: Annotated[Vector | None, Key(_VELOCITY_ERROR, VELOCITY_KIND.description)] = None
    acceleration: Annotated[Vector | None, Key(_ACCELERATION_ERROR, ACCELERATION_KIND.description)] = None
    distribution: Annotated[str | Distributions, Key(DISTRIBUTION, DISTRIBUTION_TEXT)] = "normal"
    random: Annotated[
        tuple[GaussMarkov, ...],
        Key(RANDOM, "Position errors that change within the aperture, the same on both platforms."),
    ] = ()
    time_tag: Annotated[
        float | None,
        Key(
            _TIME_TAG_ERROR,
            "As for a platform, if a single clock tags both platforms.",
        ),
    ] = None
    source: Source = None
    bias: Mapping[str, SectionValue] = {}

    def stated(self, kind: str) -> Vector | None:
        """Error of the given `kind` along the axes of the frame; 0 if only its bias is stated."""
        return _size_of(self, kind)

    def bias_of(self, kind: str) -> Vector | None:
        """Bias of the error of the given `kind` along the axes of the frame; None if none is stated."""
        bias: Vector | None = self.bias.get(kind)
        return bias

    def distribution_of(self, kind: str) -> str:
        """Distribution of the error of the given `kind`: `normal`, `uniform` or `bound`."""
        return distribution_for(self.distribution, kind)

    @property
    def is_stated(self) -> bool:
        """Whether the file states a common error.

        An error of zero counts as stated. If only axes or a source are given, no error is stated.
        """
        figures = (self.position, self.velocity, self.acceleration, self.time_tag, *self.bias.values())
        return bool(self.random) or any(figure is not None for figure in figures)

    @staticmethod
    def problems(values: SectionValues) -> Iterator[Problem]:
        """Require that the errors in `random` have distinct names."""
        yield from _names_twice(values.get("random", ()))


# ---------------------------------------------------------------------- paths of platforms
_FILE_REFERENCE = Reference()
_TALKER = "[A-Z]{2}"


class _Lines(Reader[tuple[str, ...]]):
    """The two lines of an element set.

    The class reads these lines if they are written in the mission file itself.
    """

    is_word = True
    accepted = "[line 1, line 2]"

    def read(self, value: object, path: KeyPath, report: Report) -> tuple[str, ...] | Invalid:
        """Read the two lines of an element set; their content is not checked here."""
        if not isinstance(value, list) or len(value) != 2 or not all(isinstance(line, str) for line in value):
            report(path, Problem("must be the name of a file, or the two lines of an element set"))
            return INVALID
        return tuple(value)

    def schema(self, definitions: Definitions) -> JsonObject:
        """JSON Schema: an array of the two lines as strings."""
        return {"type": "array", "items": Reference().schema(definitions), "minItems": 2, "maxItems": 2}


class OrbitSource(NamedTuple):
    """An orbit; the mission needs the scene's latitude, longitude and height, and `collection.center_time`."""

    tle: Annotated[
        str | tuple[str, str] | None,
        Key(
            either(list, _Lines(), _FILE_REFERENCE),
            "File of two-line elements, or the two lines; SGP4.",
        ),
    ] = None
    omm: Annotated[str | None, Key(_FILE_REFERENCE, "Orbit mean-elements message, text, XML, JSON or CSV; SGP4.")] = (
        None
    )
    oem: Annotated[
        str | None, Key(_FILE_REFERENCE, "Orbit ephemeris message, text or XML; interpolated as the message states.")
    ] = None
    eof: Annotated[str | None, Key(_FILE_REFERENCE, "Orbit file of a Sentinel, POEORB or RESORB; Hermite.")] = None
    sp3: Annotated[
        str | None, Key(_FILE_REFERENCE, "Orbits of GNSS or low satellites, SP3-c or SP3-d; object: G05.")
    ] = None
    object: Annotated[str | None, Key(Reference(), "Name or catalogue number, where a file has several.")] = None
    planned: Annotated[
        bool | None,
        Key(YesNo(), "The orbit is the plan, flown as stated: neither its age nor its interpolation counts."),
    ] = None

    @staticmethod
    def any_of() -> tuple[str, ...]:
        """Keys of the orbit formats; one of them is required."""
        return tuple(key for key in OrbitSource._fields if key not in ("object", "planned"))

    @staticmethod
    def problems(values: SectionValues) -> Iterator[Problem]:
        """Require that the orbit is stated in exactly one format."""
        formats = OrbitSource.any_of()
        stated = [key for key in formats if values.get(key) is not None]
        if len(stated) != 1 and values.keys() >= set(formats):
            problem = f"mixes {' with '.join(stated)}" if stated else "is empty"
            yield Problem(problem, f"accepted: one of {', '.join(formats)}")


class _Instant(Reader[Instant]):
    """An instant of UTC.

    The class reads an instant, such as `collection.center_time`, from its date and time of day.
    """

    is_word = True
    accepted = "2026-06-01T05:20:31.250Z and the like"

    def leaf(self, value: object) -> Instant:
        """Read an instant in UTC, such as 2026-06-01T05:20:31.250Z; an offset in place of Z is also accepted."""
        instant = parse_instant(value) if isinstance(value, str) else None
        if instant is None:
            is_zoneless = isinstance(value, str) and parse_instant(value, needs_zone=False) is not None
            problem = "has no zone" if is_zoneless else "must be an instant of UTC"
            hint = "Write Z behind it where it is UTC, or the offset from UTC, such as +01:00" if is_zoneless else ""
            raise InvalidValueError(problem, f"accepted: {self.accepted}", hint)
        return instant

    def schema(self, definitions: Definitions) -> JsonObject:
        """JSON Schema: a date and time as a string, or as the date type that YAML readers return."""
        return date_schema(r"^\s*\d{4}-\d\d-\d\d[T ]")


class _Talker(Text):
    """Talker of a sentence of NMEA 0183.

    The class reads the name of a talker, which is two capital letters, such as GP.
    """

    is_word = True

    def leaf(self, value: object) -> str:
        """Return the talker, which is two capital letters such as GP; refuse any other value."""
        if not isinstance(value, str) or not re.fullmatch(_TALKER, value, re.ASCII):
            raise InvalidValueError("must be two capital letters", "accepted: GN, GP and the like")
        return value

    def schema(self, definitions: Definitions) -> JsonObject:
        """JSON Schema: a string of two capital letters."""
        return {"type": "string", "pattern": f"^{_TALKER}$"}


class TrajectorySource(NamedTuple):
    """A log of a flight."""

    file: Annotated[str, Key(_FILE_REFERENCE, "The log, by its path relative to the mission file.")]
    format: Annotated[
        str | None,
        Key(Choice(*_LOG_FORMAT_NAMES), "Omitted: detected from the content, or else from the ending of the name."),
    ] = None
    week: Annotated[int | None, Key(Whole(0, 9999), "GPS week in which an SBET begins, not rolled over.")] = None
    time_scale: Annotated[
        str | None,
        Key(Choice(*SCALES), "Time scale of stamps in CSV, if the header does not state it; other logs state it."),
    ] = None
    geoid_separation: Annotated[
        float | None,
        Key(
            Quantity(units.LENGTH, ge=-200, le=200),
            "Height of the geoid above the ellipsoid, for a log whose heights are above mean sea level.",
        ),
    ] = None
    center: Annotated[
        float | None,
        Key(
            Quantity(units.TIME, ge=-1e11, le=1e11),
            "Time of the log at the middle of the aperture; omitted: collection.center_time, or 0 s.",
        ),
    ] = None
    accuracy: Annotated[
        str | None, Key(_FILE_REFERENCE, "SBET accuracy file (smrmsg): fills position and velocity of motion_error.")
    ] = None
    talker: Annotated[
        str | None,
        Key(_Talker(), "Receiver in an NMEA log with fixes of several receivers: the two letters after the $."),
    ] = None
    track: Annotated[
        str | None,
        Key(
            Reference(),
            "Track of a GPX file with several tracks, by its name or number; omitted: the track that covers the "
            "aperture.",
        ),
    ] = None
    instance: Annotated[
        int | None,
        Key(Whole(0, 255), "Receiver in a log of PX4 or ArduPilot with fixes of several receivers, counted from 0."),
    ] = None
    processed: Annotated[
        str | None,
        Key(
            Choice(SMOOTHED, RAW),
            "Path that the processor uses: smoothed: a smooth path through the log; raw: the fixes themselves, "
            "whose noise spreads.",
        ),
    ] = None


ORBIT, TRAJECTORY, INSTANT = Section(OrbitSource), Section(TrajectorySource), _Instant()


@dataclass(frozen=True)
class Way:
    """A way to state the path of a platform: required keys, optional keys, and the key of the direction of motion.

    The key of the direction is not needed for a fixed platform, which has no direction of motion.
    """

    keys: tuple[str, ...]
    optional: tuple[str, ...] = ()
    direction: str = ""

    @property
    def own(self) -> tuple[str, ...]:
        """Required keys that are unique to this way of stating a path."""
        return tuple(key for key in self.keys if key != "speed")


_HIGHER_DERIVATIVES = ("acceleration", "jerk", "snap")
WAYS = (
    Way(("position", "velocity"), _HIGHER_DERIVATIVES),
    Way(("orbit",)),
    Way(("trajectory",)),
    Way(("latitude", "longitude", "altitude", "speed", "heading"), ("climb",), "heading"),
    Way(
        ("slant_range", "azimuth", "elevation", "speed", "motion_azimuth"),
        ("climb", *_HIGHER_DERIVATIVES),
        "motion_azimuth",
    ),
)
_PATH_KEYS = tuple(dict.fromkeys(key for way in WAYS for key in (*way.keys, *way.optional)))
ACCEPTED_WAYS = (
    "accepted: position and velocity; slant_range, azimuth, elevation, speed, motion_azimuth (and climb); latitude, "
    "longitude, altitude, speed, heading (and climb); orbit; or trajectory. A fixed platform has speed 0 and no "
    "direction"
)


class LogNoise(NamedTuple):
    """Noise of a log around its smooth path, along the scene's axes, and the path that the processor flies.

    Attributes
    ----------
    residual : Matrix
        Covariance of the residuals of the fixes in the aperture. [m²]
    correlation_time : float
        Correlation time of the Gauss-Markov process that describes the correlation of the residuals. [s]
    grid : Matrix
        Step to which each coordinate of the log is rounded, as a vector along the scene's axes; zero if the
        coordinates are not rounded. [m]
    processed : str, optional
        Value of `trajectory.processed`, which states whether the processor uses the smooth path or the fixes of the
        log; None if the file does not state it.
    """

    residual: Matrix
    correlation_time: float
    grid: Matrix
    processed: str | None = None


class FlownPath(NamedTuple):
    """The path of a platform from an orbit, a log of a flight, or a geodetic position.

    Attributes
    ----------
    state : PlatformState
        The path in the frame of the scene.
    source : str
        Text for reports that names the source of the path; empty if the mission file states the path itself.
    file, sha256 : str, optional
        File from which the path was read, and its SHA-256.
    age : float, optional
        Age of the orbital elements at mid-aperture. [s]
    order, pieces : int, optional
        Order of the fitted polynomial, and number of its pieces.
    farthest, rms : float, optional
        Largest and root-mean-square residual of the fit. [m]
    samples, stretch : int, float, optional
        Number of fixes of a log to which the path is fitted, and the time that they cover. [s]
    doubts : tuple of str
        Warnings about the path, for reports.
    doubt_m, doubt_of : float, str
        Uncertainty of the path as a distance from the true path [m], and the cause of the uncertainty: the age of
        elements, the interpolation of an ephemeris, or the residual of a smoothed log.
    is_doubted : bool
        Whether this uncertainty counts as an error if the mission file declares no position error.
    is_planned : bool
        Whether the orbit is planned. Its age and interpolation then do not count as errors.
    accuracy : tuple of str, optional
        File that states errors of the path, and its SHA-256.
    orientation : tuple of str, optional
        Table of the Earth's orientation that was used, and its SHA-256.
    stated : tuple of StatedAccuracy
        Accuracy that the source of the path states, along the scene's axes.
    log_noise : LogNoise, optional
        Noise of the log from which the path comes.
    acceleration_noise : Matrix, optional
        Covariance of the error of the fitted acceleration. [m²/s⁴]
    path_noise : PathNoise, optional
        Noise that remains in a smoothed path.
    history : FlightHistory, optional
        Velocity before and after the aperture, if the path comes from a log and the platform has an aided navigation.
    """

    state: PlatformState
    source: str = ""
    file: str | None = None
    sha256: str | None = None
    age: float | None = None
    order: int | None = None
    pieces: int | None = None
    farthest: float | None = None
    rms: float | None = None
    samples: int | None = None
    stretch: float | None = None
    doubts: tuple[str, ...] = ()
    doubt_m: float = 0.0
    doubt_of: str = ""
    is_doubted: bool = False
    is_planned: bool = False
    accuracy: tuple[str, str] | None = None
    orientation: tuple[str, str] | None = None
    stated: tuple[StatedAccuracy, ...] = ()
    log_noise: LogNoise | None = None
    acceleration_noise: Matrix | None = None
    path_noise: PathNoise | None = None
    history: FlightHistory | None = None

    @property
    def is_raw(self) -> bool:
        """Whether the path comes from a flight log whose fixes the processor uses without smoothing."""
        return self.log_noise is not None and self.log_noise.processed == RAW

    @property
    def largest_doubt_m(self) -> float:
        """Largest expected distance from the true path: `doubt_m`, or the stated accuracy if it is larger. [m]"""
        return max([self.doubt_m, *(accuracy.position_m for accuracy in self.stated)])

    @property
    def beside(self) -> Mapping[str, tuple[str, str] | None]:
        """Name and SHA-256 of the files for "accuracy" and "earth_orientation"; None for a file that is not used."""
        return {"accuracy": self.accuracy, "earth_orientation": self.orientation}


class Platform(NamedTuple):
    """A platform: its path over the aperture, in one of five forms, and its motion error."""

    position: Annotated[Vector | None, Key(Triple(COORDINATE), "East, north, up of the scene centre.")] = None
    velocity: Annotated[Vector | None, Key(Triple(VELOCITY), "East, north, up.")] = None
    acceleration: Annotated[
        Vector | None, Key(Triple(ACCELERATION_COMPONENT), "East, north, up, at the midpoint: a curved path.")
    ] = None
    jerk: Annotated[Vector | None, Key(Triple(JERK_COMPONENT), "Rate of the acceleration, at the midpoint.")] = None
    snap: Annotated[Vector | None, Key(Triple(SNAP_COMPONENT), "Rate of the jerk.")] = None
    orbit: Annotated[OrbitSource | None, Key(ORBIT, "A satellite, by its orbit.")] = None
    trajectory: Annotated[TrajectorySource | None, Key(TRAJECTORY, "A log of a flight.")] = None
    latitude: Annotated[float | None, Key(LATITUDE, "Geodetic, WGS-84.")] = None
    longitude: Annotated[float | None, Key(DIRECTION, "Positive to the east.")] = None
    altitude: Annotated[float | None, Key(HEIGHT, "Above the ellipsoid; level flight follows it.")] = None
    heading: Annotated[float | None, Key(DIRECTION, "Direction of motion over ground, from north, clockwise.")] = None
    slant_range: Annotated[float | None, Key(RANGE, "Distance to the scene centre.")] = None
    azimuth: Annotated[float | None, Key(DIRECTION, "From east, counter-clockwise.")] = None
    elevation: Annotated[float | None, Key(ELEVATION, "Above the ground, seen from the scene centre.")] = None
    speed: Annotated[float | None, Key(GROUND_SPEED, "Over ground; 0 is a fixed platform.")] = None
    motion_azimuth: Annotated[
        float | None, Key(DIRECTION, "Direction of motion, counted like azimuth (not a compass heading).")
    ] = None
    climb: Annotated[float | None, Key(VELOCITY, "Vertical speed, up positive.")] = None
    motion_error: Annotated[MotionError, Key(Section(MotionError), UNCERTAINTY_TEXT)] = MotionError()
    oscillator: Annotated[Oscillator | None, Key(OSCILLATOR, "The oscillator and its noise.")] = None
    path: FlownPath | None = None

    @staticmethod
    def problems(values: SectionValues) -> Iterator[Problem]:
        """Require one complete way to state the path, and a position that is possible for a platform.

        The position must be above the ground and at least 1 m from the scene centre. If the path depends on a file or
        on the position of the scene on the Earth, the distance is checked later.
        """
        wrong = [key for key in _PATH_KEYS if key not in values]  # stated with an invalid value
        given = [key for key in _PATH_KEYS if key in wrong or values[key] is not None]
        unclear = _unclear_geometry(given, is_fixed=values.get("speed") == 0, may_be_fixed="speed" in wrong)
        if unclear is not None:
            yield unclear
        position: Vector | None = values.get("position")
        if position is not None and position[2] < 0:
            yield Problem("puts the platform below the ground, z < 0", at=("position", 2))
        if unclear is None and not wrong:
            platform = Platform(**{key: values[key] for key in _PATH_KEYS})
            if not platform.is_of_the_earth:
                yield from platform.without_image(values.get("motion_error"))

    def without_image(self, error: MotionError | None) -> Iterator[Problem]:
        """Yield a problem if the platform is within 1 m of the scene centre, or if `error` has undefined axes."""
        state = self.state
        if state.slant_range < 1:
            at_key: KeyPath = ("slant_range",) if self.slant_range is not None else (self.way,)
            yield Problem("puts the platform within 1 m of the scene centre", at=at_key)
        elif error is not None and (error.frame != "ric" or self.path is not None):
            try:
                state.frame(error.frame)
            except UndefinedFrameError as undefined:
                yield Problem(str(undefined), "accepted: scene", at=("motion_error", "frame"))

    @property
    def part_names(self) -> dict[str, str]:
        """Map each key below the platform that names a part of the catalogue to the name of the part."""
        names = {"motion_error.sensor": self.motion_error.sensor}
        if isinstance(self.motion_error.sensor, tuple):
            names = {f"motion_error.sensor.{n}": name for n, name in enumerate(self.motion_error.sensor)}
        if self.motion_error.navigation is not None:
            names["motion_error.navigation.imu.sensor"] = self.motion_error.navigation.imu.sensor
            names["motion_error.navigation.gnss.sensor"] = self.motion_error.navigation.gnss.sensor
        if self.oscillator is not None:
            names["oscillator.sensor"] = self.oscillator.sensor
        return {key: name for key, name in names.items() if isinstance(name, str)}

    @property
    def overridden(self) -> tuple[Overridden, ...]:
        """Figures of parts, and of the path's source, that keys of the file replace."""
        navigation, oscillator = self.motion_error.navigation, self.oscillator
        of_navigation = () if navigation is None else navigation.overridden
        return (*self.motion_error.overridden, *of_navigation, *(() if oscillator is None else oscillator.overridden))

    @property
    def way(self) -> str:
        """First of the keys with which the mission file states the path, such as `orbit` or `slant_range`."""
        firsts = [way.keys[0] for way in WAYS]
        return next((key for key in firsts if getattr(self, key) is not None), firsts[-1])

    @property
    def is_of_the_earth(self) -> bool:
        """Whether the path comes from an orbit, a flight log or a geodetic position.

        Such a path depends on a file or on the position of the scene on the Earth.
        """
        return self.way in (*FLOWN_SECTIONS, "latitude")

    @property
    def state(self) -> PlatformState:
        """Path of the platform in the axes of the scene.

        If the platform `is_of_the_earth`, the path is known only after `path` has been set. Numbers may be arrays
        (cases,).
        """
        if self.path is not None:
            return self.path.state
        acceleration, bends = self.acceleration or STRAIGHT, _bends(self.jerk, self.snap)
        if self.position is not None and self.velocity is not None:
            state = PlatformState(
                position=self.position, velocity=self.velocity, acceleration=acceleration, bends=bends
            )
            return _with_fall(state)
        # The reader requires these keys if position and velocity are missing.
        assert self.slant_range is not None
        assert self.azimuth is not None
        assert self.elevation is not None
        assert self.speed is not None
        state = state_from_angles(
            slant_range=self.slant_range,
            azimuth=self.azimuth,
            elevation=self.elevation,
            speed=self.speed,
            motion_azimuth=0.0 if self.motion_azimuth is None else self.motion_azimuth,  # a fixed platform has none
            climb=0.0 if self.climb is None else self.climb,
            acceleration=acceleration,
            bends=bends,
        )
        return _with_fall(state)


def _with_fall(state: PlatformState) -> PlatformState:
    """Add the dynamics of errors in free fall to a freely falling path, for a scene that is not placed on the Earth.

    Any other path is returned unchanged.
    """
    if not np.any(np.asarray(state.slant_range) > LEAST_FALLING_HEIGHT_M):  # the height above the Earth is less
        return state
    from bisar_budget.paths.free_fall import fall_of  # takes 8 ms; most missions have no satellite

    return replace(state, fall=fall_of(state, None))


def _unclear_geometry(given: Sequence[str], *, is_fixed: bool, may_be_fixed: bool) -> Problem | None:
    """Problem if the path keys in `given` do not form exactly one complete way to state a path; otherwise None.

    `is_fixed` is true if the speed is 0. `may_be_fixed` is true if the speed has an invalid value, because 0 may have
    been meant.
    """
    ways = [way for way in WAYS if any(key in way.own for key in given)] or WAYS[-1:]
    known_keys = (*ways[0].keys, *ways[0].optional)
    foreign = [key for key in given if key not in known_keys]
    if foreign:
        own_key = next(key for key in given if key in ways[0].own)
        foreign_key = next((key for key in foreign if any(key in way.own for way in ways[1:])), foreign[0])
        return Problem(f"mixes {own_key} with {foreign_key}", ACCEPTED_WAYS, at=(foreign_key,))
    direction = ways[0].direction
    if is_fixed and direction in given:
        return Problem("a platform with speed 0 has none", ACCEPTED_WAYS, at=(direction,))
    needless = direction if is_fixed or may_be_fixed else ""
    missing = [key for key in ways[0].keys if key not in given and key != needless]
    return Problem(f"lacks {', '.join(missing)}", ACCEPTED_WAYS) if missing else None


def _bends(jerk: Vector | None, snap: Vector | None) -> tuple[Vector, ...]:
    """Coefficients of τ³ [m/s³] and τ⁴ [m/s⁴] of a path: jerk/6 and snap/24, with jerk [m/s³] and snap [m/s⁴].

    If only jerk or snap is missing, it counts as zero. The result is empty if both are missing.
    """
    if jerk is None and snap is None:
        return ()
    (a, b, c), (x, y, z) = jerk or STRAIGHT, snap or STRAIGHT
    return ((a / 6, b / 6, c / 6), (x / 24, y / 24, z / 24))


class Platforms(NamedTuple):
    """Transmitter and receiver."""

    transmitter: Annotated[Platform, Key(Section(Platform))]
    receiver: Annotated[Platform, Key(Section(Platform))]

    @property
    def geometry(self) -> BistaticGeometry:
        """Paths of transmitter and receiver in the axes of the scene."""
        return BistaticGeometry(transmitter=self.transmitter.state, receiver=self.receiver.state)


def without_image(
    platforms: Platforms,
    radar: "Radar | None",
    aperture_time_s: float | None,
    common: CommonMotionError | None = None,
    *,
    has_direct_path: bool,
) -> Iterator[Problem]:
    """Yield problems of paths that form no image, and of motion errors and lever arms whose axes are undefined.

    `common` is the motion error common to both platforms. If the aperture time is invalid, `aperture_time_s` is None,
    and problems that depend on it are not found.
    """
    geometry = platforms.geometry
    yield from _no_image(geometry, radar, aperture_time_s)
    if common is not None:
        yield from _no_common_frame(platforms, common.frame)
    if aperture_time_s is not None:
        yield from _dives(platforms, geometry, aperture_time_s)
        yield from _no_body_axes(platforms, aperture_time_s / 2)
        if has_direct_path:
            yield from _no_baseline(geometry.apart, aperture_time_s / 2)


def _no_image(geometry: BistaticGeometry, radar: "Radar | None", aperture_time_s: float | None) -> Iterator[Problem]:
    """Yield a problem if the geometry forms no image, because both platforms are at rest or no image plane exists."""
    if all(norm(platform.velocity) < STILL_SPEED_MPS for platform in geometry.both):
        yield Problem("both platforms are still: no aperture", at=("platforms",))
    elif radar and aperture_time_s and (reason := degeneracy(geometry, radar, aperture_time_s)):
        yield Problem(reason, at=("platforms",))


def _no_common_frame(platforms: Platforms, frame: str) -> Iterator[Problem]:
    """Yield a problem for each platform for which the axes of the common motion error are undefined."""
    for name, platform in platforms._asdict().items():
        if frame == "ric" and platform.path is None:  # its radial direction follows with the path
            continue
        try:
            platform.state.frame(frame)
        except UndefinedFrameError as undefined:
            yield Problem(f"of the {name}: {undefined}", "accepted: scene", at=("common_motion_error", "frame"))


def has_body_axes(state: PlatformState, half: PerCase, margin: float = 1.0) -> Booleans:
    """Whether a platform keeps a horizontal direction of motion over the aperture.

    The result is false if the velocity becomes vertical or zero, or if the platform turns back. The result is true
    for a fixed platform, whose direction does not matter. `half` (cases,) is half the aperture time [s]. `margin` is
    a factor on the smallest horizontal speed that is required.
    """
    times = half * _FINE_APERTURE_TIMES
    u, v, w = (np.broadcast_to(component, times.shape) for component in state.at(times)[1])
    fastest = np.sqrt(u * u + v * v + w * w).max(axis=0)
    is_level = np.hypot(u, v).min(axis=0) > margin * _LEVEL_FRACTION * fastest
    goes_on = (u[1:] * u[:-1] + v[1:] * v[:-1] > 0).all(
        axis=0
    )  # otherwise the platform stops and turns back between two times
    return np.asarray((is_level & goes_on) | state.is_still)


def _no_body_axes(platforms: Platforms, half: float) -> Iterator[Problem]:
    """Yield a problem for each lever arm on a platform that does not keep a horizontal direction of motion.

    `half` [s] is half the aperture time; the direction has to be kept over the whole aperture.
    """
    for name, platform in platforms._asdict().items():
        if platform.motion_error.lever_arm is None or platform.state.is_still:
            continue
        if not has_body_axes(platform.state, np.array([half]))[0]:
            yield Problem(
                "its axes are those of the velocity, which within the aperture stops or is vertical",
                "accepted: a velocity that keeps a direction on the ground, or a platform that stands still",
                at=("platforms", name, "motion_error", "lever_arm"),
            )


def _dives(platforms: Platforms, geometry: BistaticGeometry, aperture_time: float) -> Iterator[Problem]:
    """Yield a problem for each platform that goes below the ground (z < 0) during the aperture."""
    for (name, platform), state in zip(platforms._asdict().items(), geometry.both, strict=True):
        lowest = min(state.place(tau)[2] for tau in _turning_points(state, aperture_time / 2))
        if lowest < 0 <= state.position[2]:
            key: KeyPath = ("climb",) if platform.velocity is None else ("velocity", 2)
            if platform.acceleration is not None:
                key = ("acceleration", 2)
            if platform.is_of_the_earth:
                key = (platform.way,)
            yield Problem(
                f"takes the platform below the ground within the aperture, to z = {lowest:.4g} m",
                at=("platforms", name, *key),
            )


def least_baseline(apart: PlatformState, half: PerCase) -> Floats:
    """Smallest distance between the platforms during the aperture. [m]

    `apart` is the path of one platform relative to the other, and `half` [s] is half the aperture time.
    """
    return np.asarray(norm(apart.place(half * _FINE_APERTURE_TIMES)).min(axis=0))


def _no_baseline(apart: PlatformState, half: float) -> Iterator[Problem]:
    """Yield a problem if, during the aperture, the platforms come too close to each other for a direct path.

    `apart` is the path of one platform relative to the other, and `half` [s] is half the aperture time.
    """
    least, travelled = float(least_baseline(apart, half)[0]), apart.travelled(half)
    if least < max(MIN_BASELINE_M, travelled / MAX_TRAVEL_RATIO):
        yield Problem(
            f"there is no direct path to follow: the platforms come within {least:.3g} m of each other, and move "
            f"{travelled:.3g} m against each other in half an aperture",
            f"accepted: at least {MIN_BASELINE_M:g} m and a {MAX_TRAVEL_RATIO}rd of that way, or linear",
            at=("synchronization", "method"),
        )


def _turning_points(state: PlatformState, half: float) -> Iterator[float]:
    """Yield the slow times at which the height of a platform during the aperture may be smallest. [s]

    For a quadratic path, these are the ends of the aperture and the time at which the platform stops sinking. For any
    other path, they are spaced by 1/64 of the aperture. `half` [s] is half the aperture time.
    """
    yield from (-half, half)
    if not state.is_quadratic:
        yield from (half * step / 32 for step in range(-31, 32))
    elif state.acceleration[2] > 0:
        yield max(-half, min(half, -float(state.velocity[2]) / float(state.acceleration[2])))
