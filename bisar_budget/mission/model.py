"""Mission file, schema_version 1: every key, its type and its meaning. Values are SI and radians."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from datetime import date
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from bisar_budget import units
from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.faults import Change, Changed, KeyPath, Place, Problem
from bisar_budget.geometry import (
    STRAIGHT,
    BistaticGeometry,
    PlatformState,
    UndefinedFrameError,
    Vector,
    norm,
    state_from_angles,
)
from bisar_budget.mission.readers import (
    Choice,
    Day,
    Glob,
    Key,
    Label,
    Late,
    ListOf,
    OneOf,
    Quantity,
    Reader,
    Section,
    Text,
    TextList,
    TextMap,
    Triple,
    Version,
    Whole,
    Words,
)

if TYPE_CHECKING:
    from bisar_budget.mission.covariance import Covariance
    from bisar_budget.mission.instruments import GaussMarkov, Imu, Oscillator, Synchronization
    from bisar_budget.mission.routes import Orbit, Trajectory
    from bisar_budget.paths.instant import Instant

STILL = 1e-6  # m/s; slower than this no platform flies an aperture
_LEAST_BASELINE = 1.0  # m, between platforms of which one hears the other
_FARTHEST_BY = 3  # times the least baseline, that they move by in half an aperture: so far a fit of 16 nodes is true

FREQUENCY = Quantity(units.FREQUENCY, gt=0, ge=1e3, le=1e13)
VIBRATION_FREQUENCY = Quantity(units.FREQUENCY, gt=0, le=1e9)
DURATION = Quantity(units.TIME, gt=0, ge=1e-6, le=1e6)
COORDINATE = Quantity(units.LENGTH, ge=-1e9, le=1e9)
RANGE = Quantity(units.LENGTH, gt=0, le=1e9)
SIZE = Quantity(units.LENGTH, ge=0, le=1e9)
VELOCITY = Quantity(units.SPEED, ge=-1e6, le=1e6)
SPEED = Quantity(units.SPEED, ge=0, le=1e6)
ACCELERATION = Quantity(units.ACCELERATION, ge=-1e6, le=1e6)
JERK = Quantity(units.JERK, ge=-1e6, le=1e6)
SNAP = Quantity(units.SNAP, ge=-1e6, le=1e6)
DIRECTION = Quantity(units.ANGLE, ge=-2 * math.pi, le=2 * math.pi)
LATITUDE = Quantity(units.ANGLE, ge=-math.pi / 2, le=math.pi / 2)
HEIGHT = Quantity(units.LENGTH, ge=-1e4, le=1e9)
ELEVATION = Quantity(units.ANGLE, ge=0, le=math.pi / 2)
PHASE = Quantity(units.ANGLE, ge=-1e6, le=1e6)
# With a turn at the aperture edge a response has no mainlobe; 45 without a unit would be seven.
PHASE_REQUIREMENT = Quantity(units.ANGLE, gt=0, ge=1e-6, le=2 * math.pi)
SIDELOBE_REQUIREMENT = Quantity(units.POWER_RATIO, lt=0, ge=-200)
SHARE = Quantity(units.RATIO, gt=0, ge=1e-6, le=1)
DISTRIBUTION = Choice("normal", "uniform", "bound")
DISTRIBUTIONS = "normal: the values are one sigma; uniform, bound: they are not exceeded."


class Document(NamedTuple):
    """The document that a report of this mission becomes; every report shows it."""

    number: Annotated[str | None, Key(Label())] = None
    issue: Annotated[str | None, Key(Label())] = None
    author: Annotated[str | None, Key(Text())] = None


class Radar(NamedTuple):
    """The waveform."""

    center_frequency: Annotated[float, Key(FREQUENCY, "Centre of the band; every phase uses it.")]
    bandwidth: Annotated[float, Key(FREQUENCY, "Width of the band, for the resolution.")]

    @staticmethod
    def problems(values: Mapping[str, Any]) -> Iterator[Problem]:
        """Hold the band above 0 Hz."""
        if (
            values.keys() >= {"bandwidth", "center_frequency"}
            and values["bandwidth"] >= 2 * values["center_frequency"]
        ):
            yield Problem("must be less than twice the centre frequency", at=("bandwidth",))

    @property
    def wavelength(self) -> float:
        """At the centre frequency. [m]"""
        return SPEED_OF_LIGHT / self.center_frequency


class Collection(NamedTuple):
    """The data collection."""

    aperture_time: Annotated[float, Key(DURATION, "T; the aperture is -T/2 to T/2.")]
    pulses: Annotated[int | None, Key(Whole(2, 10_000_000), "For the simulator; omitted: what the patch needs.")] = (
        None
    )
    center_time: Annotated[
        "Instant | None", Key(Late(lambda: _routes("INSTANT")), "UTC of the middle of the aperture.")
    ] = None


class Scene(NamedTuple):
    """The imaged ground."""

    latitude: Annotated[float | None, Key(LATITUDE, "Of its centre, geodetic, WGS-84; all three or none.")] = None
    longitude: Annotated[float | None, Key(DIRECTION, "Of its centre, positive to the east.")] = None
    height: Annotated[float | None, Key(HEIGHT, "Of its centre above the ellipsoid.")] = None

    radius: Annotated[float | None, Key(RANGE, "Radius of the scene about its centre.")] = None
    height_error: Annotated[
        float | None, Key(COORDINATE, "How much higher the scene is than the processor takes it for.")
    ] = None

    @staticmethod
    def problems(values: Mapping[str, Any]) -> Iterator[Problem]:
        """Hold its place to all three coordinates."""
        if values.keys() >= set(PLACE_KEYS):
            missing = [key for key in PLACE_KEYS if values[key] is None]
            if 0 < len(missing) < len(PLACE_KEYS):
                yield Problem(f"lacks {', '.join(missing)}", "accepted: latitude, longitude and height, or none")

    @property
    def is_on_earth(self) -> bool:
        """Whether the file says where on the Earth it is."""
        return self.latitude is not None


PLACE_KEYS = ("latitude", "longitude", "height")
SIZES = Triple(SIZE)
ALONG_SIGHT_OR_AXES = OneOf(lambda value: SIZES if isinstance(value, list) else SIZE, (SIZE, SIZES))


class Sinusoid(NamedTuple):
    """One sinusoidal vibration."""

    amplitude: Annotated[
        float | Vector,
        Key(ALONG_SIGHT_OR_AXES, "0 to peak, along the line of sight; a vector: along each axis of the frame."),
    ]
    frequency: Annotated[float, Key(VIBRATION_FREQUENCY)]


class Wideband(NamedTuple):
    """Noise-like vibration."""

    rms: Annotated[
        float | Vector,
        Key(ALONG_SIGHT_OR_AXES, "Root mean square, along the line of sight; a vector: along each axis."),
    ]


class Vibration(NamedTuple):
    """High-frequency motion that the navigation does not measure."""

    sinusoidal: Annotated[tuple[Sinusoid, ...], Key(ListOf(Sinusoid), "One entry per line.")] = ()
    wideband: Annotated[Wideband | None, Key(Section(Wideband))] = None


def _covariance_reader() -> Reader:
    from bisar_budget.mission.covariance import COVARIANCE

    return COVARIANCE


def _instruments(name: str) -> Reader:
    """A reader of `instruments`, which few files need."""
    from bisar_budget.mission import instruments

    reader: Reader = getattr(instruments, name)
    return reader


def _routes(name: str) -> Reader:
    """A reader of `routes`, which few files need."""
    from bisar_budget.mission import routes

    reader: Reader = getattr(routes, name)
    return reader


PART = Text()
PARTS = OneOf(lambda value: TextList() if isinstance(value, list) else PART, (PART, TextList()))


class MotionError(NamedTuple):
    """How wrong the measured motion of one platform may be. A scalar means each axis.

    `of_parts` names the figures that come from parts of the catalogue, and the source of each.
    """

    frame: Annotated[
        str,
        Key(
            Choice("scene", "track", "look", "ric"),
            "scene: east, north, up; track: along, cross, up; look: line of sight, cross, up; ric: radial, in-track, "
            "cross-track.",
        ),
    ] = "scene"
    position: Annotated[Vector | None, Key(Triple(COORDINATE, or_scalar=True), "At the midpoint.")] = None
    velocity: Annotated[Vector | None, Key(Triple(VELOCITY, or_scalar=True), "Constant part.")] = None
    acceleration: Annotated[Vector | None, Key(Triple(ACCELERATION, or_scalar=True), "Constant part.")] = None
    covariance: Annotated[
        "Covariance | None",
        Key(
            Late(_covariance_reader),
            "Of position and velocity, instead of the two: 6 x 6 in m and s, or sigmas with correlations.",
        ),
    ] = None
    distribution: Annotated[str, Key(DISTRIBUTION, DISTRIBUTIONS)] = "normal"
    vibration: Annotated[Vibration, Key(Section(Vibration))] = Vibration()
    sensor: Annotated[
        str | tuple[str, ...] | None,
        Key(PARTS, "Parts of the catalogue (`bisar-budget sensors`), or files; keys of this file override theirs."),
    ] = None
    imu: Annotated["Imu | None", Key(Late(lambda: _instruments("IMU")), "Figures of the inertial sensor.")] = None
    random: Annotated[
        "tuple[GaussMarkov, ...]",
        Key(Late(lambda: _instruments("RANDOM")), "Position errors that change within the aperture."),
    ] = ()
    source: Annotated[str | None, Key(Text(), "Where the values come from; shown as evidence.")] = None
    of_parts: tuple[tuple[str, str], ...] = ()

    @staticmethod
    def problems(values: Mapping[str, Any]) -> Iterator[Problem]:
        """Hold a covariance to standing alone, to its frame and to a normal distribution; names to one each."""
        seen: set[str] = set()
        for index, one in enumerate(values.get("random", ())):
            if one.name in seen:
                yield Problem("is the name of an earlier error", at=("random", index, "name"))
            seen.add(one.name)
        covariance: Covariance | None = values.get("covariance")
        if covariance is None:
            return
        from bisar_budget.mission.covariance import misplaced_axes

        both = [kind for kind in ("position", "velocity") if values.get(kind) is not None]
        if both:
            yield Problem(f"replaces position and velocity, but there is also a {both[0]}", at=("covariance",))
        if values.get("distribution", "normal") != "normal":
            yield Problem("a covariance is that of a normal distribution", "accepted: normal", at=("distribution",))
        if "frame" in values:
            yield from misplaced_axes(covariance, values["frame"])

    def stated(self, kind: str) -> Vector | None:
        """Position, velocity or acceleration error along the frame's axes; of a covariance the marginal sigmas."""
        if self.covariance is not None and kind != "acceleration":
            return self.covariance.of(kind)
        stated: Vector | None = getattr(self, kind)
        return stated

    def evidence(self, figure: str) -> str | None:
        """Where a figure comes from: a part of the catalogue, else what the file says of all."""
        return dict(self.of_parts).get(figure, self.source)

    def key_of(self, figure: str) -> str:
        """Key under which the file states a figure, or the part that it is taken from."""
        return "sensor" if figure in dict(self.of_parts) else figure


class CommonMotionError(NamedTuple):
    """The same error on both platforms, such as the bias of one GNSS service. A scalar means each axis."""

    frame: Annotated[
        str,
        Key(
            Choice(
                "scene",
                refused=dict.fromkeys(
                    ("track", "look", "ric"), "each platform has its own, an error of both has none"
                ),
            ),
            "east, north, up.",
        ),
    ] = "scene"
    position: Annotated[Vector | None, Key(Triple(COORDINATE, or_scalar=True), "At the midpoint.")] = None
    velocity: Annotated[Vector | None, Key(Triple(VELOCITY, or_scalar=True), "Constant part.")] = None
    acceleration: Annotated[Vector | None, Key(Triple(ACCELERATION, or_scalar=True), "Constant part.")] = None
    distribution: Annotated[str, Key(DISTRIBUTION, DISTRIBUTIONS)] = "normal"
    source: Annotated[str | None, Key(Text(), "Where the values come from; shown as evidence.")] = None


class Way(NamedTuple):
    """A way to state the path of a platform: keys that it needs, others that it may have, and those of it alone.

    `direction` is the key that a platform which does not move has no use for.
    """

    keys: tuple[str, ...]
    optional: tuple[str, ...]
    own: tuple[str, ...]
    direction: str = ""


_CURVES = ("acceleration", "jerk", "snap")
WAYS = (
    Way(("position", "velocity"), _CURVES, ("position", "velocity")),
    Way(("orbit",), (), ("orbit",)),
    Way(("trajectory",), (), ("trajectory",)),
    Way(
        ("latitude", "longitude", "altitude", "speed", "heading"),
        ("climb",),
        ("latitude", "longitude", "altitude", "heading"),
        "heading",
    ),
    Way(
        ("slant_range", "azimuth", "elevation", "speed", "motion_azimuth"),
        ("climb", *_CURVES),
        ("slant_range", "azimuth", "elevation", "motion_azimuth"),
        "motion_azimuth",
    ),
)
_PATH_KEYS = tuple(dict.fromkeys(key for way in WAYS for key in (*way.keys, *way.optional)))
ACCEPTED_WAYS = (
    "accepted: position and velocity; slant_range, azimuth, elevation, speed, motion_azimuth (and climb); latitude, "
    "longitude, altitude, speed, heading (and climb); orbit; or trajectory. A fixed platform has speed 0 and no "
    "direction"
)


class FlownPath(NamedTuple):
    """The path of a platform that the scene's place on the Earth, an orbit or a log of a flight decide.

    `source` says where it comes from, empty where the file states it; `file` and `sha256` are those of the file it
    was read from, `age` that of its elements [s]. Of a fit the order, the residual at most and root mean square [m],
    and the number of places of a log. `doubts` are warnings, for reports.
    """

    state: PlatformState
    source: str = ""
    file: str | None = None
    sha256: str | None = None
    age: float | None = None
    order: int | None = None
    farthest: float | None = None
    rms: float | None = None
    samples: int | None = None
    doubts: tuple[str, ...] = ()
    accuracy: tuple[str, str] | None = None  # file that states its errors, and its SHA-256


class Platform(NamedTuple):
    """Its path over the aperture, in one of five ways, and the motion error."""

    position: Annotated[Vector | None, Key(Triple(COORDINATE), "East, north, up of the scene centre.")] = None
    velocity: Annotated[Vector | None, Key(Triple(VELOCITY), "East, north, up.")] = None
    acceleration: Annotated[
        Vector | None, Key(Triple(ACCELERATION), "East, north, up, at the midpoint: a curved path.")
    ] = None
    jerk: Annotated[Vector | None, Key(Triple(JERK), "Rate of the acceleration, at the midpoint.")] = None
    snap: Annotated[Vector | None, Key(Triple(SNAP), "Rate of the jerk.")] = None
    orbit: Annotated["Orbit | None", Key(Late(lambda: _routes("ORBIT")), "A satellite, by its orbit.")] = None
    trajectory: Annotated["Trajectory | None", Key(Late(lambda: _routes("TRAJECTORY")), "A log of a flight.")] = None
    latitude: Annotated[float | None, Key(LATITUDE, "Geodetic, WGS-84.")] = None
    longitude: Annotated[float | None, Key(DIRECTION, "Positive to the east.")] = None
    altitude: Annotated[float | None, Key(HEIGHT, "Above the ellipsoid; level flight follows it.")] = None
    heading: Annotated[float | None, Key(DIRECTION, "Of the way over ground, from north, clockwise.")] = None
    slant_range: Annotated[float | None, Key(RANGE, "Distance to the scene centre.")] = None
    azimuth: Annotated[float | None, Key(DIRECTION, "From east, counter-clockwise.")] = None
    elevation: Annotated[float | None, Key(ELEVATION, "Above the ground, seen from the scene centre.")] = None
    speed: Annotated[float | None, Key(SPEED, "Over ground; 0 is a fixed platform.")] = None
    motion_azimuth: Annotated[
        float | None, Key(DIRECTION, "Direction of motion, counted like azimuth (not a compass heading).")
    ] = None
    climb: Annotated[float | None, Key(VELOCITY, "Vertical speed, up positive.")] = None
    motion_error: Annotated[MotionError, Key(Section(MotionError))] = MotionError()
    oscillator: Annotated[
        "Oscillator | None", Key(Late(lambda: _instruments("OSCILLATOR")), "The oscillator and its noise.")
    ] = None
    path: FlownPath | None = None

    @staticmethod
    def problems(values: Mapping[str, Any]) -> Iterator[Problem]:
        """Hold it to one complete geometry, above the ground, off the scene centre."""
        if not values.keys() >= set(_PATH_KEYS):
            return  # one of them is wrong by itself
        platform = Platform(**{key: values[key] for key in _PATH_KEYS})
        unclear = platform._unclear_geometry()
        if unclear is not None:
            yield unclear
        if platform.position is not None and platform.position[2] < 0:
            yield Problem("puts the platform below the ground, z < 0", at=("position", 2))
        if unclear is None and not platform.is_of_the_earth:
            yield from platform.without_image(values.get("motion_error"))

    def without_image(self, error: MotionError | None) -> Iterator[Problem]:
        """Say what keeps its path from forming an image, and its errors from their frame."""
        state = self.state
        if state.slant_range < 1:
            where: KeyPath = ("slant_range",) if self.slant_range is not None else (self.way,)
            yield Problem("puts the platform within 1 m of the scene centre", at=where)
        elif error is not None and (error.frame != "ric" or self.path is not None):
            try:
                state.frame(error.frame)
            except UndefinedFrameError as undefined:
                yield Problem(str(undefined), "accepted: scene", at=("motion_error", "frame"))

    def _unclear_geometry(self) -> Problem | None:
        given = [key for key in _PATH_KEYS if getattr(self, key) is not None]
        ways = [way for way in WAYS if any(key in way.own for key in given)] or WAYS[-1:]
        known = (*ways[0].keys, *ways[0].optional)
        strange = [key for key in given if key not in known]
        if strange:
            own = next(key for key in given if key in ways[0].own)
            other = next((key for key in strange if any(key in way.own for way in ways[1:])), strange[0])
            return Problem(f"mixes {own} with {other}", ACCEPTED_WAYS, at=(other,))
        is_fixed, direction = self.speed == 0, ways[0].direction
        if is_fixed and direction in given:
            return Problem("a platform with speed 0 has none", ACCEPTED_WAYS, at=(direction,))
        missing = [key for key in ways[0].keys if key not in given and not (is_fixed and key == direction)]
        return Problem(f"lacks {', '.join(missing)}", ACCEPTED_WAYS) if missing else None

    @property
    def way(self) -> str:
        """First key of the way in which its path is stated."""
        keys = ("position", "orbit", "trajectory", "latitude")
        return next((key for key in keys if getattr(self, key) is not None), "slant_range")

    @property
    def is_of_the_earth(self) -> bool:
        """Whether its path needs to be found: by a file, or where the scene is on the Earth."""
        return self.way in ("orbit", "trajectory", "latitude")

    @property
    def state(self) -> PlatformState:
        """Its path in the frame of the scene; of a way that needs to be found once it is, see `is_of_the_earth`."""
        if self.path is not None:
            return self.path.state
        curves = (self.acceleration, self.jerk, self.snap)
        if self.position is not None and self.velocity is not None:
            return _state_from_vectors(self.position, self.velocity, *curves)
        polar = (self.slant_range, self.azimuth, self.elevation, self.speed, self.motion_azimuth, self.climb)
        return _state_from_angles(*polar, *curves)


def _bends(jerk: Vector | None, snap: Vector | None) -> tuple[Vector, ...]:
    """Coefficients of τ³ and τ⁴."""
    if jerk is None and snap is None:
        return ()
    (a, b, c), (x, y, z) = jerk or STRAIGHT, snap or STRAIGHT
    return ((a / 6, b / 6, c / 6), (x / 24, y / 24, z / 24))


# Asked for while a platform is read, while its mission is, and when that is checked.
@lru_cache(maxsize=8)
def _state_from_vectors(
    position: Vector, velocity: Vector, acceleration: Vector | None, jerk: Vector | None, snap: Vector | None
) -> PlatformState:
    return PlatformState(
        position=position, velocity=velocity, acceleration=acceleration or STRAIGHT, bends=_bends(jerk, snap)
    )


@lru_cache(maxsize=8)
def _state_from_angles(
    slant_range: float | None,
    azimuth: float | None,
    elevation: float | None,
    speed: float | None,
    motion_azimuth: float | None,
    climb: float | None,
    acceleration: Vector | None,
    jerk: Vector | None,
    snap: Vector | None,
) -> PlatformState:
    state = state_from_angles(
        slant_range=slant_range or 0.0,
        azimuth=azimuth or 0.0,
        elevation=elevation or 0.0,
        speed=speed or 0.0,
        motion_azimuth=motion_azimuth or 0.0,
        climb=climb or 0.0,
        acceleration=acceleration or STRAIGHT,
    )
    return replace(state, bends=_bends(jerk, snap)) if jerk or snap else state


class Platforms(NamedTuple):
    """The two of them."""

    transmitter: Annotated[Platform, Key(Section(Platform))]
    receiver: Annotated[Platform, Key(Section(Platform))]


class TimingError(NamedTuple):
    """Clock error between the platforms, constant + linear·τ + quadratic·τ² + cubic·τ³."""

    constant: Annotated[float | None, Key(Quantity(units.TIME, ge=-1e6, le=1e6))] = None
    linear: Annotated[float | None, Key(Quantity(units.RATIO, ge=-1e6, le=1e6))] = None
    quadratic: Annotated[float | None, Key(Quantity(units.RATE, ge=-1e6, le=1e6))] = None
    cubic: Annotated[float | None, Key(Quantity(units.RATE_SQUARED, ge=-1e6, le=1e6))] = None


class OtherError(NamedTuple):
    """A quadratic phase error from elsewhere, at the aperture edge."""

    name: Annotated[str, Key(Text(), "Becomes the row id other.NAME.")]
    quadratic_phase_error: Annotated[float, Key(PHASE)]
    source: Annotated[str | None, Key(Text())] = None


DECLARABLE = ("position", "velocity", "acceleration", "timing")


class Requirements(NamedTuple):
    """What the image has to hold, and what the file has to say for it."""

    quadratic_phase_error: Annotated[
        float, Key(PHASE_REQUIREMENT, "Total for any one error, at the aperture edge; default π/4.")
    ] = math.pi / 4
    cubic_phase_error: Annotated[float | None, Key(PHASE_REQUIREMENT, "At the aperture edge.")] = None
    pslr: Annotated[float | None, Key(SIDELOBE_REQUIREMENT, "Bounds the echoes that vibration adds. [dB]")] = None
    islr: Annotated[float | None, Key(SIDELOBE_REQUIREMENT, "Bounds the power that vibration adds. [dB]")] = None
    location_error: Annotated[
        float | None, Key(Quantity(units.LENGTH, gt=0, ge=1e-9, le=1e9), "Displacement of the image on the ground.")
    ] = None
    declare: Annotated[
        tuple[str, ...],
        Key(
            Words(*DECLARABLE),
            "Errors that the file must declare, for both platforms; what is missing is not_evaluated. "
            "timing: any term of timing_error.",
        ),
    ] = ()


class Shares(NamedTuple):
    """Parts of one budget; they sum to 1."""

    transmitter: Annotated[float, Key(SHARE)]
    receiver: Annotated[float, Key(SHARE)]
    clock: Annotated[float | None, Key(SHARE, "Omitted: the clock is held to the receiver's share.")] = None
    reserve: Annotated[float, Key(Quantity(units.RATIO, ge=0, lt=1))] = 0.0

    @staticmethod
    def problems(values: Mapping[str, Any]) -> Iterator[Problem]:
        """Hold the sum to 1."""
        if not values.keys() >= set(Shares._fields):
            return
        total = sum(values[name] or 0.0 for name in Shares._fields)
        if abs(total - 1) > 1e-6:
            yield Problem(f"shares must sum to 1, these sum to {total:.6g}")


RULE = Choice("equal", "balanced")
SHARES = Section(Shares)
SPLIT = OneOf(lambda value: SHARES if isinstance(value, dict) else RULE, (RULE, SHARES))


class MetricSplits(NamedTuple):
    """A split of its own for each metric."""

    quadratic_phase_error: Annotated[str | Shares, Key(SPLIT)] = "equal"
    pslr: Annotated[str | Shares, Key(SPLIT)] = "equal"
    islr: Annotated[str | Shares, Key(SPLIT)] = "equal"


METRIC_SPLITS = Section(MetricSplits)


def _form_of_split(value: Any) -> Reader:
    if not isinstance(value, dict):
        return RULE
    return SHARES if value.keys().isdisjoint(METRIC_SPLITS.keys) else METRIC_SPLITS


class AllocationRules(NamedTuple):
    """How the budget is divided and which model gates."""

    split: Annotated[
        str | Shares | MetricSplits,
        Key(
            OneOf(_form_of_split, (RULE, SHARES, METRIC_SPLITS)),
            "equal, balanced, shares that sum to 1, or one of these per metric.",
        ),
    ] = "equal"
    combine: Annotated[
        str,
        Key(Choice("each", "sum", "rss"), "each: every error alone; sum: worst case; rss: independent errors."),
    ] = "each"
    model: Annotated[
        str,
        Key(
            Choice("published", "full", "strictest"),
            "The model that gates: the paper's, the full one, or the stricter of both for each row.",
        ),
    ] = "published"
    coverage_factor: Annotated[
        float,
        Key(
            Quantity(units.RATIO, gt=0, ge=1e-3, le=1e3),
            "Multiplies position, velocity, acceleration and clock errors.",
        ),
    ] = 1.0
    warn_above: Annotated[
        float, Key(Quantity(units.RATIO, gt=0, le=1), "Utilization above which a pass becomes a warning.")
    ] = 0.8


class Autofocus(NamedTuple):
    """What autofocus can correct."""

    algorithm: Annotated[str, Key(Choice("pga", "map_drift"))] = "pga"
    n_pull: Annotated[
        float | None,
        Key(Quantity(units.RATIO, gt=0, ge=1e-3, le=1e4), "Corrects n_pull·π radians; omitted: none."),
    ] = None


class Simulation(NamedTuple):
    """Settings of the simulator."""

    window: Annotated[str, Key(Choice("uniform", "taylor"))] = "uniform"
    noise: Annotated[float | None, Key(Quantity(units.POWER_RATIO, ge=-400, le=400))] = None
    seed: Annotated[int, Key(Whole(0, 2**53))] = 1
    memory_limit: Annotated[float, Key(Quantity(units.MEMORY, gt=0, ge=1e6, le=1e15))] = 500e6


class Waiver(NamedTuple):
    """A row that may fail until a date, for a reason."""

    id: Annotated[str, Key(Glob(), "A row id or a glob of ids, such as receiver.*")]
    until: Annotated[date, Key(Day(), "Last day on which it holds, UTC.")]
    reason: Annotated[str, Key(Text())]


class Mission(NamedTuple):
    """A mission file that can be used.

    `file` and `places` say where it stands: the path of each value to the parser's event. `data` is the file as
    read, byte for byte. `changes` are the values that options put in place of the file's.
    """

    schema_version: Annotated[int, Key(Version())]
    name: Annotated[str, Key(Text())]
    radar: Annotated[Radar, Key(Section(Radar))]
    collection: Annotated[Collection, Key(Section(Collection))]
    platforms: Annotated[Platforms, Key(Section(Platforms))]
    document: Annotated[Document, Key(Section(Document), "Number, issue and author, for the reports.")] = Document()
    scene: Annotated[Scene, Key(Section(Scene))] = Scene()
    common_motion_error: Annotated[
        CommonMotionError | None, Key(Section(CommonMotionError), "The same for both platforms, in the scene's axes.")
    ] = None
    timing_error: Annotated[TimingError, Key(Section(TimingError))] = TimingError()
    synchronization: Annotated[
        "Synchronization | None",
        Key(Late(lambda: _instruments("SYNCHRONIZATION")), "How the receiver follows the transmitter's oscillator."),
    ] = None
    other_errors: Annotated[tuple[OtherError, ...], Key(ListOf(OtherError))] = ()
    requirements: Annotated[Requirements, Key(Section(Requirements))] = Requirements()
    requirement_ids: Annotated[Mapping[str, str], Key(TextMap(), "Row id to the project's own requirement id.")] = {}
    allocation: Annotated[AllocationRules, Key(Section(AllocationRules))] = AllocationRules()
    autofocus: Annotated[Autofocus, Key(Section(Autofocus))] = Autofocus()
    simulation: Annotated[Simulation | None, Key(Section(Simulation))] = None
    waivers: Annotated[tuple[Waiver, ...], Key(ListOf(Waiver))] = ()
    file: str = ""
    places: Mapping[KeyPath, Any] = {}
    data: bytes = b""
    changes: tuple[Change, ...] = ()

    @staticmethod
    def problems(values: Mapping[str, Any]) -> Iterator[Problem]:
        """Hold it to a collection that forms an image, and to names that can be told apart."""
        platforms: Platforms | None = values.get("platforms")
        if platforms is not None and not any(platform.is_of_the_earth for platform in platforms):
            yield from without_image(platforms, values.get("collection"), values.get("synchronization"))
        seen: set[str] = set()
        for index, other in enumerate(values.get("other_errors", ())):
            if other.name in seen:
                yield Problem("is the name of an earlier error", at=("other_errors", index, "name"))
            seen.add(other.name)

    @property
    def geometry(self) -> BistaticGeometry:
        """Both platforms in the frame of the scene."""
        return _geometry(self.platforms)

    @property
    def has_direct_path(self) -> bool:
        """Whether the receiver hears the transmitter and takes it as its clock."""
        return self.synchronization is not None and self.synchronization.is_direct_path

    @property
    def gating_model(self) -> str:
        """The model that gates: with a direct path the full one, since the published one does not know it."""
        return "full" if self.has_direct_path else self.allocation.model

    def line(self, path: KeyPath) -> Place | None:
        """Line of a value in the mission file, from 1, else of the nearest key above it that exists.

        At last that is the file's first key; None for a mission that came from no file, and for a value that an
        option set.
        """
        get = self.places.get
        event = get(path)
        while event is None and path:
            path = path[:-1]
            event = get(path)
        return None if event is None or isinstance(event, Changed) else Place.of(event)

    def is_changed(self, path: KeyPath) -> bool:
        """Whether a value, or what holds it, comes from an option."""
        above = (self.places.get(path[:length]) for length in range(len(path), 0, -1))
        return bool(self.changes) and isinstance(next(filter(None, above), None), Changed)


@lru_cache(maxsize=4)  # asked for when a mission is read and again when it is checked
def _geometry(platforms: Platforms) -> BistaticGeometry:
    return BistaticGeometry(transmitter=platforms.transmitter.state, receiver=platforms.receiver.state)


def without_image(
    platforms: Platforms, collection: Collection | None, synchronization: "Synchronization | None"
) -> Iterator[Problem]:
    """Say what keeps paths from forming an image."""
    yield from _no_image(_geometry(platforms))
    if collection is not None:
        yield from _dives(platforms, collection.aperture_time)
        if synchronization is not None and synchronization.is_direct_path:
            yield from _no_baseline(_geometry(platforms).apart, collection.aperture_time / 2)


def _no_image(geometry: BistaticGeometry) -> Iterator[Problem]:
    if all(norm(platform.velocity) < STILL for platform in (geometry.transmitter, geometry.receiver)):
        yield Problem("both platforms are still: no aperture", at=("platforms",))
    elif degeneracy := geometry.degeneracy():
        yield Problem(degeneracy, at=("platforms",))


def _dives(platforms: Platforms, aperture_time: float) -> Iterator[Problem]:
    for name, platform in (("transmitter", platforms.transmitter), ("receiver", platforms.receiver)):
        state = platform.state
        lowest = min(state.at(tau)[0][2] for tau in _turning_points(state, aperture_time / 2))
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


def _no_baseline(apart: PlatformState, half: float) -> Iterator[Problem]:
    # A 32nd of the way from one place to the next, the distance between is not smaller by as much as matters.
    least = min(norm(apart.at(half * part / 32)[0]) for part in range(-32, 33))
    way = apart.travelled(half)
    if least < max(_LEAST_BASELINE, way / _FARTHEST_BY):
        yield Problem(
            f"there is no direct path to follow: the platforms come within {least:.3g} m of each other, and move "
            f"{way:.3g} m against each other in half an aperture",
            f"accepted: at least {_LEAST_BASELINE:g} m and a {_FARTHEST_BY}rd of that way, or linear",
            at=("synchronization", "method"),
        )


def _turning_points(state: PlatformState, half: float) -> Iterator[float]:
    """Slow times within the aperture where a platform can be lowest: its ends, and where it stops sinking.

    Of a path that bends more than once, places a 64th of the aperture apart.
    """
    yield from (-half, half)
    if state.bends:
        yield from (half * part / 32 for part in range(-31, 32))
    elif state.acceleration[2] > 0:
        yield max(-half, min(half, -state.velocity[2] / state.acceleration[2]))


def has_instruments(mission: Mission) -> bool:
    """Whether a mission says anything of inertial sensors, position noise, oscillators or synchronisation."""
    return mission.synchronization is not None or any(
        platform.oscillator is not None or platform.motion_error.imu is not None or platform.motion_error.random
        for platform in mission.platforms
    )


def flies_on_earth(mission: Mission) -> bool:
    """Whether paths of a mission depend on where on the Earth its scene is, or stand in files."""
    return mission.scene.is_on_earth or any(
        platform.is_of_the_earth or platform.motion_error.frame == "ric" for platform in mission.platforms
    )


def names_parts(mission: Mission) -> bool:
    """Whether a mission takes figures from parts of the catalogue."""
    return any(
        platform.motion_error.sensor or (platform.oscillator is not None and platform.oscillator.sensor)
        for platform in mission.platforms
    )


MISSION = Section(Mission)
