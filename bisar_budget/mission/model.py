"""Mission file, schema_version 1: every key, its type and its meaning. Values are SI and radians."""

import math
from collections.abc import Iterator, Mapping
from datetime import date
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from bisar_budget import units
from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.faults import KeyPath, Place, Problem
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
DIRECTION = Quantity(units.ANGLE, ge=-2 * math.pi, le=2 * math.pi)
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


class Scene(NamedTuple):
    """The imaged ground."""

    radius: Annotated[float | None, Key(RANGE, "Radius of the scene about its centre.")] = None
    height_error: Annotated[
        float | None, Key(COORDINATE, "How much higher the scene is than the processor takes it for.")
    ] = None


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


PART = Text()
PARTS = OneOf(lambda value: TextList() if isinstance(value, list) else PART, (PART, TextList()))


class MotionError(NamedTuple):
    """How wrong the measured motion of one platform may be. A scalar means each axis.

    `of_parts` names the figures that come from parts of the catalogue, and the source of each.
    """

    frame: Annotated[
        str,
        Key(
            Choice("scene", "track", "look"),
            "scene: east, north, up; track: along, cross, up; look: line of sight, cross, up.",
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
                refused=dict.fromkeys(("track", "look"), "each platform has its own, an error of both has none"),
            ),
            "east, north, up.",
        ),
    ] = "scene"
    position: Annotated[Vector | None, Key(Triple(COORDINATE, or_scalar=True), "At the midpoint.")] = None
    velocity: Annotated[Vector | None, Key(Triple(VELOCITY, or_scalar=True), "Constant part.")] = None
    acceleration: Annotated[Vector | None, Key(Triple(ACCELERATION, or_scalar=True), "Constant part.")] = None
    distribution: Annotated[str, Key(DISTRIBUTION, DISTRIBUTIONS)] = "normal"
    source: Annotated[str | None, Key(Text(), "Where the values come from; shown as evidence.")] = None


CARTESIAN_KEYS = ("position", "velocity")
POLAR_KEYS = ("slant_range", "azimuth", "elevation", "speed", "motion_azimuth", "climb")
GEOMETRY_KEYS = frozenset((*CARTESIAN_KEYS, *POLAR_KEYS))
WAYS = (
    "accepted: position and velocity, or slant_range, azimuth, elevation, speed, motion_azimuth (and climb); "
    "a fixed platform has speed 0 and no motion_azimuth"
)


class Platform(NamedTuple):
    """Position and velocity at the aperture midpoint, in one of two ways, and the motion error."""

    position: Annotated[Vector | None, Key(Triple(COORDINATE), "East, north, up of the scene centre.")] = None
    velocity: Annotated[Vector | None, Key(Triple(VELOCITY), "East, north, up.")] = None
    acceleration: Annotated[
        Vector | None, Key(Triple(ACCELERATION), "East, north, up; constant over the aperture: a curved path.")
    ] = None
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

    @staticmethod
    def problems(values: Mapping[str, Any]) -> Iterator[Problem]:
        """Hold it to one complete geometry, above the ground, off the scene centre."""
        if not values.keys() >= GEOMETRY_KEYS:
            return  # one of them is wrong by itself
        acceleration = values.get("acceleration")
        platform = Platform(acceleration=acceleration, **{key: values[key] for key in GEOMETRY_KEYS})
        unclear = platform._unclear_geometry()
        if unclear is not None:
            yield unclear
        if platform.position is not None and platform.position[2] < 0:
            yield Problem("puts the platform below the ground, z < 0", at=("position", 2))
        if unclear is not None:
            return
        state = platform.state
        if state.slant_range < 1:
            where = "position" if platform.position else "slant_range"
            yield Problem("puts the platform within 1 m of the scene centre", at=(where,))
        elif "motion_error" in values:
            try:
                state.frame(values["motion_error"].frame)
            except UndefinedFrameError as error:
                yield Problem(str(error), "accepted: scene", at=("motion_error", "frame"))

    def _unclear_geometry(self) -> Problem | None:
        cartesian = [key for key in CARTESIAN_KEYS if getattr(self, key) is not None]
        polar = [key for key in POLAR_KEYS if getattr(self, key) is not None]
        if cartesian and polar:
            return Problem(f"mixes {cartesian[0]} with {polar[0]}", WAYS, at=(polar[0],))
        if cartesian:
            missing = [key for key in CARTESIAN_KEYS if key not in cartesian]
        else:
            is_fixed = self.speed == 0
            if is_fixed and self.motion_azimuth is not None:
                return Problem("a platform with speed 0 has none", WAYS, at=("motion_azimuth",))
            optional = ("climb", "motion_azimuth") if is_fixed else ("climb",)
            missing = [key for key in POLAR_KEYS if key not in polar and key not in optional]
        return Problem(f"lacks {', '.join(missing)}", WAYS) if missing else None

    @property
    def state(self) -> PlatformState:
        """Position and velocity in the frame of the scene."""
        if self.position is not None and self.velocity is not None:
            return _state_from_vectors(self.position, self.velocity, self.acceleration)
        polar = (self.slant_range, self.azimuth, self.elevation, self.speed, self.motion_azimuth, self.climb)
        return _state_from_angles(*polar, self.acceleration)


# Asked for while a platform is read, while its mission is, and when that is checked.
@lru_cache(maxsize=8)
def _state_from_vectors(position: Vector, velocity: Vector, acceleration: Vector | None) -> PlatformState:
    return PlatformState(position=position, velocity=velocity, acceleration=acceleration or STRAIGHT)


@lru_cache(maxsize=8)
def _state_from_angles(
    slant_range: float | None,
    azimuth: float | None,
    elevation: float | None,
    speed: float | None,
    motion_azimuth: float | None,
    climb: float | None,
    acceleration: Vector | None,
) -> PlatformState:
    return state_from_angles(
        slant_range=slant_range or 0.0,
        azimuth=azimuth or 0.0,
        elevation=elevation or 0.0,
        speed=speed or 0.0,
        motion_azimuth=motion_azimuth or 0.0,
        climb=climb or 0.0,
        acceleration=acceleration or STRAIGHT,
    )


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
    read, byte for byte.
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

    @staticmethod
    def problems(values: Mapping[str, Any]) -> Iterator[Problem]:
        """Hold it to a collection that forms an image, and to names that can be told apart."""
        platforms: Platforms | None = values.get("platforms")
        collection: Collection | None = values.get("collection")
        if platforms is not None:
            yield from _no_image(_geometry(platforms))
        if platforms is not None and collection is not None:
            yield from _dives(platforms, collection.aperture_time)
            if values.get("synchronization") is not None and values["synchronization"].is_direct_path:
                yield from _no_baseline(_geometry(platforms).apart, collection.aperture_time / 2)
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

        At last that is the file's first key; None for a mission that came from no file.
        """
        get = self.places.get
        event = get(path)
        while event is None and path:
            path = path[:-1]
            event = get(path)
        return None if event is None else Place.of(event)


@lru_cache(maxsize=4)  # asked for when a mission is read and again when it is checked
def _geometry(platforms: Platforms) -> BistaticGeometry:
    return BistaticGeometry(transmitter=platforms.transmitter.state, receiver=platforms.receiver.state)


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
    """Slow times within the aperture where a platform can be lowest: its ends, and where it stops sinking."""
    yield from (-half, half)
    if state.acceleration[2] > 0:
        yield max(-half, min(half, -state.velocity[2] / state.acceleration[2]))


def has_instruments(mission: Mission) -> bool:
    """Whether a mission says anything of inertial sensors, position noise, oscillators or synchronisation."""
    return mission.synchronization is not None or any(
        platform.oscillator is not None or platform.motion_error.imu is not None or platform.motion_error.random
        for platform in mission.platforms
    )


def names_parts(mission: Mission) -> bool:
    """Whether a mission takes figures from parts of the catalogue."""
    return any(
        platform.motion_error.sensor or (platform.oscillator is not None and platform.oscillator.sensor)
        for platform in mission.platforms
    )


MISSION = Section(Mission)
