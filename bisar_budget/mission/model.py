"""All sections and keys of a mission file (`schema_version` 1), with their types and meanings.

Values are in SI units and radians.
"""

import math
from collections.abc import Iterator, Mapping
from datetime import date
from typing import TYPE_CHECKING, Annotated, NamedTuple

from bisar_budget import units
from bisar_budget.arrays import PerCase
from bisar_budget.constants import GATING_MODELS, SPEED_OF_LIGHT_MPS
from bisar_budget.error_kinds.path_kinds import TERRAIN_KIND
from bisar_budget.error_kinds.registry import motion_kind
from bisar_budget.faults import Changed, KeyPath, ParserEvent, Place, Problem, SetValue, changes_words, shown, upwards
from bisar_budget.geometry import BistaticGeometry, PlatformState
from bisar_budget.json_types import Definitions, JsonObject
from bisar_budget.mission.instruments import SYNCHRONIZATION, Synchronization, TakenFigure
from bisar_budget.mission.navigation import MAX_FIX_COUNT
from bisar_budget.mission.platforms import FLOWN_SECTIONS, INSTANT, CommonMotionError, Platforms, without_image
from bisar_budget.mission.propagation import PROPAGATION, Propagation, too_low
from bisar_budget.mission.readers import (
    COORDINATE,
    DIRECTION,
    DURATION,
    HEIGHT,
    LATITUDE,
    LIMIT_FIELD,
    PHASE,
    PHASE_REQUIREMENT,
    RADAR_FREQUENCY,
    RANGE,
    SHARE,
    SIDELOBE_REQUIREMENT,
    SIZE_FIELD,
    UNCERTAINTY_TEXT,
    Choice,
    Day,
    Glob,
    IdMap,
    Key,
    Lines,
    ListOf,
    OneOf,
    Quantity,
    Reader,
    Reference,
    Section,
    SectionValues,
    SizeMap,
    Statement,
    Text,
    TextMap,
    Undirected,
    Version,
    Weights,
    Whole,
    WithBias,
    WithConfidence,
    Words,
    either,
)
from bisar_budget.paths.earth import Geodetic, SceneAxes, axes_at
from bisar_budget.paths.instant import Instant
from bisar_budget.paths.orientation import MAX_POLE_RAD, MAX_UT1_S, UNKNOWN, Orientation
from bisar_budget.units import format_quantity

if TYPE_CHECKING:
    from bisar_budget.mission.quantities import Number


class DocumentChange(NamedTuple):
    """An entry in the change record of a document."""

    issue: Annotated[str, Key(Text(), "Issue of the document with the change.")]
    date: Annotated[date, Key(Day(), "Day of the issue.")]
    what: Annotated[str, Key(Text(), "Text of the change.")]


class Document(NamedTuple):
    """The document that a report of this mission becomes; every report shows it.

    Its fields are shown on reports: number, issue, author, applicable documents and change record.
    """

    number: Annotated[str | None, Key(Text())] = None
    issue: Annotated[str | None, Key(Text())] = None
    author: Annotated[str | None, Key(Text())] = None
    applicable: Annotated[tuple[str, ...], Key(Lines(), "Applicable documents, such as standards.")] = ()
    changes: Annotated[tuple[DocumentChange, ...], Key(ListOf(DocumentChange), "Change record, oldest first.")] = ()


class Radar(NamedTuple):
    """The waveform."""

    center_frequency: Annotated[float, Key(RADAR_FREQUENCY, "Centre of the band; every phase uses it.")]
    bandwidth: Annotated[float, Key(RADAR_FREQUENCY, "Width of the band, for the resolution.")]

    @staticmethod
    def problems(values: SectionValues) -> Iterator[Problem]:
        """Require a bandwidth below twice the centre frequency, so that the lower edge of the band is above 0 Hz."""
        if (
            values.keys() >= {"bandwidth", "center_frequency"}
            and values["bandwidth"] >= 2 * values["center_frequency"]
        ):
            yield Problem("must be less than twice the centre frequency", at=("bandwidth",))

    @property
    def wavelength(self) -> float:
        """Wavelength at the centre frequency. [m]"""
        return SPEED_OF_LIGHT_MPS / self.center_frequency


class Collection(NamedTuple):
    """The data collection."""

    aperture_time: Annotated[float, Key(DURATION, "T; the aperture is -T/2 to T/2.")]
    pulses: Annotated[
        int | None, Key(Whole(2, 10_000_000), "For the simulator; omitted: as many as the patch needs.")
    ] = None
    center_time: Annotated[Instant | None, Key(INSTANT, "UTC of the middle of the aperture.")] = None


class Scene(NamedTuple):
    """The imaged ground."""

    latitude: Annotated[
        float | None, Key(LATITUDE, "Latitude of the centre, geodetic, WGS-84; all three coordinates or none.")
    ] = None
    longitude: Annotated[float | None, Key(DIRECTION, "Longitude of the centre, positive to the east.")] = None
    height: Annotated[float | None, Key(HEIGHT, "Height of the centre above the ellipsoid.")] = None

    radius: Annotated[float | None, Key(RANGE, "Radius of the scene about its centre.")] = None
    height_error: Annotated[float | None, Key(COORDINATE, TERRAIN_KIND.description)] = None

    @staticmethod
    def problems(values: SectionValues) -> Iterator[Problem]:
        """Refuse a scene whose centre on the Earth lacks one or two of its three coordinates."""
        if values.keys() >= set(PLACE_KEYS):
            missing = [key for key in PLACE_KEYS if values[key] is None]
            if 0 < len(missing) < len(PLACE_KEYS):
                yield Problem(f"lacks {', '.join(missing)}", "accepted: latitude, longitude and height, or none")

    @property
    def is_on_earth(self) -> bool:
        """Whether the file states the position of the scene on the Earth."""
        return self.latitude is not None

    @property
    def axes(self) -> SceneAxes | None:
        """Directions east, north and up of the scene in Earth-fixed axes; None if the scene is not on the Earth."""
        if self.latitude is None or self.longitude is None or self.height is None:
            return None
        return axes_at(Geodetic(self.latitude, self.longitude, self.height))


PLACE_KEYS = ("latitude", "longitude", "height")

_ACCEPTED_ORIENTATIONS = "accepted: ut1_minus_utc, with or without polar_motion_x and polar_motion_y; or file"
_POLE = Quantity(units.ANGLE, ge=-MAX_POLE_RAD, le=MAX_POLE_RAD)


class EarthOrientation(NamedTuple):
    """UT1 - UTC and polar motion in the middle of the aperture; orbits in celestial axes need them."""

    ut1_minus_utc: Annotated[
        float | None, Key(Quantity(units.TIME, ge=-MAX_UT1_S, le=MAX_UT1_S), "IERS, Bulletin A or B.")
    ] = None
    polar_motion_x: Annotated[float | None, Key(_POLE, "Position of the pole, towards Greenwich.")] = None
    polar_motion_y: Annotated[float | None, Key(_POLE, "Position of the pole, towards 90 deg west.")] = None
    file: Annotated[
        str | None, Key(Reference(), "Table of the IERS in place of the figures: finals2000A, daily or all.")
    ] = None

    @staticmethod
    def problems(values: SectionValues) -> Iterator[Problem]:
        """Require either the name of a table, or UT1 - UTC, optionally with both coordinates of the polar motion."""
        figures = [key for key in values if key != "file" and values[key] is not None]
        if values.get("file") is not None:
            if figures:
                yield Problem(f"mixes file with {figures[0]}", _ACCEPTED_ORIENTATIONS, at=(figures[0],))
        elif "ut1_minus_utc" not in figures:
            yield Problem("lacks ut1_minus_utc", _ACCEPTED_ORIENTATIONS)
        elif len(figures) == 2:
            yield Problem("has half of the polar motion", _ACCEPTED_ORIENTATIONS, at=(figures[1],))

    @property
    def orientation(self) -> Orientation:
        """Orientation of the Earth, made from the values in the file.

        If the file does not state the polar motion, the pole is at (0, 0) and has the default uncertainty.
        """
        x, y = self.polar_motion_x, self.polar_motion_y
        pole, doubt = UNKNOWN.pole, UNKNOWN.pole_doubt
        if x is not None and y is not None:
            pole, doubt = (x, y), 0.0
        return Orientation(self.ut1_minus_utc or 0.0, pole, 0.0, doubt)


class TimingError(NamedTuple):
    """Clock error between the platforms, constant + linear·τ + quadratic·τ² + cubic·τ³."""

    constant: Annotated[float | None, Key(WithBias(Quantity(units.TIME, ge=-1e6, le=1e6), "ClockConstant"))] = None
    linear: Annotated[float | None, Key(WithBias(Quantity(units.RATIO, ge=-1e6, le=1e6), "ClockLinear"))] = None
    quadratic: Annotated[float | None, Key(WithBias(Quantity(units.RATE, ge=-1e6, le=1e6), "ClockQuadratic"))] = None
    cubic: Annotated[float | None, Key(WithBias(Quantity(units.RATE_SQUARED, ge=-1e6, le=1e6), "ClockCubic"))] = None
    bias: Mapping[str, float | None] = {}


class OtherError(NamedTuple):
    """An error from elsewhere, stated by its effects on the image; at least one effect.

    The causes of such an error are not modelled; the mission file states its effects.
    """

    name: Annotated[str, Key(Text(), "Becomes the row ids other.NAME, other.NAME.cubic_phase_error and so on.")]
    quadratic_phase_error: Annotated[
        float | None, Key(WithBias(PHASE, "QuadraticPhaseError"), "At the aperture edge.")
    ] = None
    cubic_phase_error: Annotated[float | None, Key(WithBias(PHASE, "CubicPhaseError"), "At the aperture edge.")] = (
        None
    )
    location_error: Annotated[
        float | None, Key(Undirected(units.LENGTH, ge=0, le=1e9), "Displacement of the image, in any direction.")
    ] = None
    islr: Annotated[float | None, Key(SIDELOBE_REQUIREMENT, "Power that it spreads over the image. [dB]")] = None
    source: Annotated[str | None, Key(Text())] = None
    bias: Mapping[str, float | None] = {}

    @staticmethod
    def any_of() -> tuple[str, ...]:
        """Keys of the effects; at least one of them is required."""
        return OTHER_EFFECTS

    @staticmethod
    def problems(values: SectionValues) -> Iterator[Problem]:
        """Require that the error states at least one effect."""
        if values.keys() >= set(OTHER_EFFECTS) and all(values[effect] is None for effect in OTHER_EFFECTS):
            yield Problem("states no effect", f"accepted: any of {', '.join(OTHER_EFFECTS)}")

    @property
    def stated(self) -> dict[str, float]:
        """Sizes of the stated effects by row id: phases [rad], location error [m], ISLR [dB]."""
        first, *further = OTHER_EFFECTS
        sizes = {f"other.{self.name}": getattr(self, first)}
        sizes |= {f"other.{self.name}.{effect}": getattr(self, effect) for effect in further}
        return {row_id: size for row_id, size in sizes.items() if size is not None}


OTHER_EFFECTS = ("quadratic_phase_error", "cubic_phase_error", "location_error", "islr")


# Kinds of error that each platform has, and those of the mission as a whole.
OF_PLATFORMS = (
    *("position", "velocity", "acceleration", "covariance", "vibration", "imu", "random", "oscillator"),
    *("navigation", "time_tag", "lever_arm"),
)
OF_MISSION = ("timing", "synchronization", "propagation", "common", "other", "terrain")
DECLARABLE = (*OF_PLATFORMS, *OF_MISSION)
_OF_ONE_PLATFORM = tuple(f"{name}.{kind}" for name in Platforms._fields for kind in OF_PLATFORMS)


_QUARTER_TURN_RAD = math.pi / 4


class Requirements(NamedTuple):
    """Requirements: limits that the image has to keep, and errors that the file has to declare.

    `confidence` maps the key of a limit to the probability with which the limit has to be kept, as text. A limit
    without a confidence is not in the mapping, or has the value None.
    """

    quadratic_phase_error: Annotated[
        float,
        Key(
            WithConfidence(PHASE_REQUIREMENT, "QuadraticPhaseRequirement", _QUARTER_TURN_RAD),
            "Total for a single error, at the aperture edge; default π/4.",
        ),
    ] = _QUARTER_TURN_RAD
    cubic_phase_error: Annotated[
        float | None, Key(WithConfidence(PHASE_REQUIREMENT, "CubicPhaseRequirement"), "At the aperture edge.")
    ] = None
    pslr: Annotated[float | None, Key(SIDELOBE_REQUIREMENT, "Bounds the echoes that vibration adds. [dB]")] = None
    islr: Annotated[float | None, Key(SIDELOBE_REQUIREMENT, "Bounds the power that vibration adds. [dB]")] = None
    location_error: Annotated[
        float | None,
        Key(
            WithConfidence(Quantity(units.LENGTH, gt=0, ge=1e-9, le=1e9), "LocationRequirement"),
            "Displacement of the image on the ground.",
        ),
    ] = None
    declare: Annotated[
        tuple[str, ...],
        Key(
            Words(
                *DECLARABLE,
                *_OF_ONE_PLATFORM,
                accepted=f"{', '.join(DECLARABLE)}; of one platform receiver.imu and the like",
                is_more=lambda word: (
                    motion_kind(word.removeprefix("transmitter.").removeprefix("receiver.")) is not None
                ),
            ),
            "Errors that the file must declare, for both platforms or for one (receiver.imu); a missing error is "
            "not_evaluated. A zero declares; a still platform has to declare only its position. A covariance "
            "declares position and velocity; timing: any term of timing_error; propagation: the delays of each leg; "
            "common: common_motion_error; other: other_errors; terrain: scene.height_error.",
        ),
    ] = ()
    file: Annotated[
        str | None,
        Key(
            Reference(),
            "CSV of requirements with the columns id, text, key and limit, in addition to the keys beside it and to "
            "requirement_ids and requirement_texts.",
        ),
    ] = None
    confidence: Mapping[str, str | None] = {}

    @property
    def has_confidence(self) -> bool:
        """Whether any limit has to be kept with a stated probability."""
        return any(confidence is not None for confidence in self.confidence.values())

    def confidence_of(self, key: str) -> float | None:
        """Probability with which the limit `key` has to be kept; None if the file states no confidence for it."""
        text = self.confidence.get(key)
        return None if text is None else float(text)


def id_of_requirement(key: str) -> str:
    """Id of a requirement as used in lists of row ids, such as `requirement.islr` for the key `islr`."""
    return f"requirement.{key}"


def least_age(averaging: PerCase, aperture_time: PerCase) -> PerCase:
    """Smallest age of a clock setting at which its averaging time does not overlap with the aperture. [s]

    The age is the time from the middle of the averaging to mid-aperture.
    """
    return (averaging + aperture_time) / 2


def _unset_clocks(values: SectionValues) -> Iterator[Problem]:
    """Yield the problems of a method of synchronisation other than the direct path.

    There is a problem if the averaging time of a holdover overlaps with the aperture. In a holdover, the clocks are
    set once and then run free. There is also a problem if both `timing_error` and `synchronization` state a clock
    error.
    """
    sync, collection, timing = (values.get(key) for key in ("synchronization", "collection", "timing_error"))
    if sync is None or sync.is_direct_path:
        return
    if sync.is_holdover and collection is not None:
        least = least_age(sync.averaging, collection.aperture_time)
        if sync.age < least:
            yield Problem(
                f"the averaging of {sync.averaging:g} s overlaps the aperture of {collection.aperture_time:g} s",
                f"accepted: at least {least:g} s, half of both",
                at=("synchronization", "age"),
            )
    for term, sync_key in (("constant", "time_error"), ("linear", "frequency_error")):
        if timing is None or getattr(timing, term) is None:
            continue
        if sync.is_holdover:
            yield Problem(
                "stands beside synchronization.method holdover, which says what the clocks are wrong by",
                f"accepted: synchronization.{sync_key}, or no holdover",
                at=("timing_error", term),
            )
        elif getattr(sync, sync_key) is not None:
            yield Problem(
                f"stands beside synchronization.{sync_key}: the same error would count twice",
                "accepted: one of the two",
                at=("timing_error", term),
            )


def least_bandwidth(aperture_time: PerCase) -> PerCase:
    """Smallest useful noise bandwidth of an oscillator: one cycle per aperture, 1/T. [Hz]

    A smaller bandwidth would exclude all noise that changes within the aperture.
    """
    return 1 / aperture_time


def _noise_cut_off(values: SectionValues) -> Iterator[Problem]:
    """Yield a problem for each oscillator whose `bandwidth` excludes all noise that changes within the aperture."""
    platforms, collection = values.get("platforms"), values.get("collection")
    if platforms is None or collection is None:
        return
    T = collection.aperture_time
    for name, platform in platforms._asdict().items():
        bandwidth = None if platform.oscillator is None else platform.oscillator.bandwidth
        if bandwidth is not None and bandwidth < least_bandwidth(T):
            yield Problem(
                f"counts no noise within an aperture of {T:g} s",
                f"accepted: at least {least_bandwidth(T):.3g} Hz, one cycle; omitted, all stated noise counts",
                at=("platforms", name, "oscillator", "bandwidth"),
            )


def _too_many_fixes(values: SectionValues) -> Iterator[Problem]:
    """Yield a problem for each aided navigation with more than `MAX_FIX_COUNT` fixes.

    With more fixes, a check would take too much time or memory.
    """
    platforms, collection = values.get("platforms"), values.get("collection")
    if platforms is None or collection is None:
        return
    for name, platform in platforms._asdict().items():
        navigation = platform.motion_error.navigation
        count = 0.0 if navigation is None else navigation.fix_count(collection.aperture_time)
        if navigation is not None and count > MAX_FIX_COUNT:
            yield Problem(
                f"makes {count:.3g} fixes from the start of the flight to its end",
                f"accepted: at most {MAX_FIX_COUNT}; a shorter before and after, or a rate of "
                f"{navigation.gnss.rate * MAX_FIX_COUNT / count:.2g} Hz",
                at=("platforms", name, "motion_error", "navigation", "gnss", "rate"),
            )


SHARE_SUM_TOLERANCE_FRACTION = 1e-6  # largest difference of a sum of shares from 1


class Shares(NamedTuple):
    """Parts of one budget; they sum to 1.

    A share is assigned to each owner of errors: transmitter, receiver, and optionally the clock. The reserve is not
    assigned.
    """

    transmitter: Annotated[float, Key(SHARE)]
    receiver: Annotated[float, Key(SHARE)]
    clock: Annotated[float | None, Key(SHARE, "Omitted: the clock has the receiver's share.")] = None
    reserve: Annotated[float, Key(Quantity(units.RATIO, ge=0, lt=1))] = 0.0

    def of(self, owner: str) -> float:
        """Share of the budget that is assigned to an owner, such as `receiver`.

        The share of `mission`, to which errors without an owner are assigned, is 1. A clock without its own share has
        the share of the receiver.
        """
        if owner == "clock":
            return self.receiver if self.clock is None else self.clock
        if owner == "mission":
            return 1.0
        return self.transmitter if owner == "transmitter" else self.receiver

    def includes(self, owner: str, of: str) -> bool:
        """Whether the errors that `owner` causes count against the share of the owner `of`.

        All errors count if `of` is `mission`. The errors of the clock count against the receiver's share if the clock
        has no share of its own.
        """
        return of in ("mission", owner) or (owner == "clock" and of == "receiver" and self.clock is None)

    @staticmethod
    def problems(values: SectionValues) -> Iterator[Problem]:
        """Require that the shares, including the reserve, sum to 1."""
        if not values.keys() >= set(Shares._fields):
            return
        total = sum(values[name] or 0.0 for name in Shares._fields)
        if abs(total - 1) > SHARE_SUM_TOLERANCE_FRACTION:
            yield Problem(f"shares must sum to 1, these sum to {total:.9g}")


RULE = Choice("equal", "balanced")
SHARES = Section(Shares)
SPLIT = either(dict, SHARES, RULE)


class MetricSplits(NamedTuple):
    """A split of its own for each metric.

    A split divides the budget of a metric, such as the ISLR, among the owners of errors. It is the name of a rule, or
    a set of shares.
    """

    quadratic_phase_error: Annotated[str | Shares, Key(SPLIT)] = "equal"
    pslr: Annotated[str | Shares, Key(SPLIT)] = "equal"
    islr: Annotated[str | Shares, Key(SPLIT)] = "equal"


METRIC_SPLITS = Section(MetricSplits)


def _form_of_split(value: object) -> Reader[str | Shares | MetricSplits]:
    """Return the reader for a value of `allocation.split`: the name of a rule, shares, or a split for each metric."""
    if not isinstance(value, dict):
        return RULE
    return SHARES if value.keys().isdisjoint(METRIC_SPLITS.keys) else METRIC_SPLITS


class AllocationRules(NamedTuple):
    """How the budget is divided and which model gates.

    The results of the gating model, which is chosen by `model`, decide whether rows pass.
    """

    split: Annotated[
        str | Shares | MetricSplits,
        Key(
            OneOf(_form_of_split, (RULE, SHARES, METRIC_SPLITS)),
            "equal, balanced, shares that sum to 1, or one of these for each metric.",
        ),
    ] = "equal"
    combine: Annotated[
        str,
        Key(
            Choice("each", "sum", "rss"),
            "rss: independent errors together; sum: all at their worst; each: every error alone, as in the paper.",
        ),
    ] = "rss"
    model: Annotated[
        str,
        Key(
            Choice(*GATING_MODELS),
            "The model that gates: full: exact ranges; published: the paper's; strictest: the stricter for each row.",
        ),
    ] = "full"
    coverage_factor: Annotated[
        float,
        Key(
            Quantity(units.RATIO, ge=1, le=1e3),
            "Multiplies position, velocity, acceleration and clock errors; at least 1.",
        ),
    ] = 1.0
    warn_above: Annotated[
        float, Key(Quantity(units.RATIO, gt=0, le=1), "Utilization above which a pass becomes a warning.")
    ] = 0.8
    specify: Annotated[
        Mapping[str, float],
        Key(
            Weights(),
            "Keys of the errors that `bisar-budget allocate` specifies, each with its weight, or a list of keys.",
        ),
    ] = {}


class Autofocus(NamedTuple):
    """Autofocus: the algorithm, and how far it can correct.

    `n_pull` is the pull-in range: autofocus corrects phase errors of up to n_pull·π rad.
    """

    algorithm: Annotated[str, Key(Choice("pga", "map_drift"))] = "pga"
    n_pull: Annotated[
        float | None,
        Key(
            Quantity(units.RATIO, gt=0, ge=1e-3, le=1e4),
            "Corrects n_pull·π radians, counts up to f₀/B; omitted: none.",
        ),
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


class PartFile(NamedTuple):
    """The file of a part whose figures a mission takes: the name in the mission, the path and the content."""

    name: str
    file: str
    data: bytes


class UncertainFigure(NamedTuple):
    """A figure whose standard uncertainty the file states, by its key; three axes with one value are one figure.

    `relative_uncertainty` is the standard uncertainty divided by the size of the figure. For a level it is that of
    the amplitude: 1 dB is 0.115.
    """

    key: str
    relative_uncertainty: float


class Mission(NamedTuple):
    """A mission file that can be used.

    The following fields are not keys of the file.

    Attributes
    ----------
    file : str
        Path of the file.
    places : mapping of KeyPath to event
        The YAML parser's event for each value, which contains the position of the value in the file.
    data : bytes
        Content of the file, byte for byte.
    changes : tuple of SetValue
        Values that `--set` options put in place of the file's values.
    parts : tuple of PartFile
        Files of the parts that the mission names.
    taken : tuple of TakenFigure
        Figures that the mission takes from parts. A file that stated these figures itself would describe the same
        mission.
    uncertainties : tuple of UncertainFigure
        Figures that the file states with an uncertainty. Only `check --guard` uses them.
    """

    schema_version: Annotated[int, Key(Version())]
    name: Annotated[str, Key(Text())]
    radar: Annotated[Radar, Key(Section(Radar))]
    collection: Annotated[Collection, Key(Section(Collection))]
    platforms: Annotated[Platforms, Key(Section(Platforms))]
    document: Annotated[
        Document, Key(Section(Document), "Number, issue, author and change record, for the reports.")
    ] = Document()
    scene: Annotated[Scene, Key(Section(Scene))] = Scene()
    earth_orientation: Annotated[
        EarthOrientation | None,
        Key(Section(EarthOrientation), "Orientation of the Earth, for orbits in celestial axes."),
    ] = None
    common_motion_error: Annotated[
        CommonMotionError | None, Key(Section(CommonMotionError), "Motion error common to both platforms.")
    ] = None
    timing_error: Annotated[TimingError, Key(Section(TimingError), UNCERTAINTY_TEXT)] = TimingError()
    synchronization: Annotated[
        Synchronization | None,
        Key(SYNCHRONIZATION, "How the receiver follows the transmitter's oscillator."),
    ] = None
    propagation: Annotated[
        Propagation | None, Key(PROPAGATION, "Delays in the air, on the way to the scene and back.")
    ] = None
    other_errors: Annotated[tuple[OtherError, ...], Key(ListOf(OtherError), UNCERTAINTY_TEXT)] = ()
    requirements: Annotated[Requirements, Key(Section(Requirements))] = Requirements()
    requirement_ids: Annotated[
        Mapping[str, tuple[str, ...]],
        Key(
            IdMap(),
            "Requirement ids of the project, by the id of a row or of a requirement (requirement.location_error): a "
            "text or a list.",
        ),
    ] = {}
    requirement_texts: Annotated[
        Mapping[str, str],
        Key(TextMap("requirement id", Statement()), "Text of each requirement, by the id in requirement_ids."),
    ] = {}
    specifications: Annotated[
        Mapping[str, "Number"],
        Key(
            SizeMap(),
            "Largest sizes that suppliers may deliver, by the keys of errors; `check` compares the declared sizes "
            "with them.",
        ),
    ] = {}
    allocation: Annotated[AllocationRules, Key(Section(AllocationRules))] = AllocationRules()
    autofocus: Annotated[Autofocus, Key(Section(Autofocus))] = Autofocus()
    simulation: Annotated[Simulation | None, Key(Section(Simulation))] = None
    waivers: Annotated[tuple[Waiver, ...], Key(ListOf(Waiver))] = ()
    file: str = ""
    places: Mapping[KeyPath, ParserEvent] = {}
    data: bytes = b""
    changes: tuple[SetValue, ...] = ()
    parts: tuple[PartFile, ...] = ()
    taken: tuple[TakenFigure, ...] = ()
    uncertainties: tuple[UncertainFigure, ...] = ()

    def __repr__(self) -> str:
        """Text on one line with the path of the file and the name of the mission."""
        return f"Mission({self.file!r}, {shown(self.name)!r})"

    def _repr_html_(self) -> str:
        """HTML table for a notebook.

        The table shows the centre frequency, the bandwidth and the aperture time; the range, the elevation and the
        speed of each platform; the bistatic angle; the model; and the rule by which errors are combined.
        """
        from html import escape  # a check does not need it

        from bisar_budget import notebook

        geometry = self.geometry
        rows = [
            ("center frequency", format_quantity(self.radar.center_frequency, "Hz", 4)),
            ("bandwidth", format_quantity(self.radar.bandwidth, "Hz", 4)),
            ("aperture time", format_quantity(self.collection.aperture_time, "s", 4)),
            ("transmitter", _at_a_glance(geometry.transmitter)),
            ("receiver", _at_a_glance(geometry.receiver)),
            ("bistatic angle", f"{math.degrees(geometry.bistatic_angle):.3g}°"),
            ("rules", f"{self.gating_model} model, combine: {self.allocation.combine}"),
        ]
        file = f'<p class="muted">{escape(" ".join((self.file, changes_words(self.changes))))}</p>'
        title = f"<p><strong>{escape(self.name)}</strong></p>"
        return notebook.page(title, notebook.table(("", ""), rows), file)

    def __eq__(self, other: object) -> bool:
        """Whether two missions have equal fields; `places` are not compared, because they follow from `data`."""
        return isinstance(other, Mission) and tuple(self._replace(places={})) == tuple(other._replace(places={}))

    def __ne__(self, other: object) -> bool:
        """Whether two missions differ. Without this method, Python would compare them as tuples."""
        return not self == other

    def replace(self, values: Mapping[str, object]) -> "Mission":
        """Return a mission in which some values are changed; `values` is the same as in `quantities.changed`."""
        from bisar_budget.mission.quantities import changed  # that module imports this one

        return changed(self, values)

    @staticmethod
    def problems(values: SectionValues) -> Iterator[Problem]:
        """Require sections that fit together.

        The paths and the collection must be able to form an image, and the settings of clocks and oscillators must
        suit the aperture. No name and no row id may occur twice in `other_errors`.
        """
        platforms: Platforms | None = values.get("platforms")
        if platforms is not None and not any(platform.is_of_the_earth for platform in platforms):
            collection, synchronization = values.get("collection"), values.get("synchronization")
            propagation: Propagation | None = values.get("propagation")
            if propagation is not None and collection is not None:
                yield from too_low(propagation, platforms, collection.aperture_time)
            yield from without_image(
                platforms,
                values.get("radar"),
                collection and collection.aperture_time,
                values.get("common_motion_error"),
                has_direct_path=synchronization is not None and synchronization.is_direct_path,
            )
        yield from _unset_clocks(values)
        yield from _noise_cut_off(values)
        yield from _too_many_fixes(values)
        names, row_ids = set[str](), set[str]()
        for index, other in enumerate(values.get("other_errors", ())):
            if other.name in names or not row_ids.isdisjoint(other.stated):
                problem = "is the name of an earlier error"
                if other.name not in names:
                    problem = f"makes the row id {min(row_ids.intersection(other.stated))}, as an earlier error does"
                yield Problem(problem, at=("other_errors", index, "name"))
            names.add(other.name)
            row_ids |= other.stated.keys()

    @property
    def geometry(self) -> BistaticGeometry:
        """Paths of transmitter and receiver in the axes of the scene."""
        return self.platforms.geometry

    @property
    def has_direct_path(self) -> bool:
        """Whether the receiver receives the transmitter's signal directly and uses it as its clock."""
        return self.synchronization is not None and self.synchronization.is_direct_path

    @property
    def gating_model(self) -> str:
        """Name of the model whose results decide whether rows pass.

        With a direct path it is always the full model, because the published model does not include a direct path.
        """
        return "full" if self.has_direct_path else self.allocation.model

    def written_path(self, path: KeyPath) -> KeyPath:
        """Path at which the file writes the number of a value.

        It differs from `path` for a size beside a bias, and for a limit beside a confidence, such as
        `requirements.location_error.limit`.
        """
        is_component = bool(path) and isinstance(path[-1], int)
        parent, component = (path[:-1], path[-1:]) if is_component else (path, ())
        for field in (SIZE_FIELD, LIMIT_FIELD):
            for written in ((*parent, field, *component), (*parent, field)):
                if written in self.places:
                    return written
        return path

    def line(self, path: KeyPath) -> Place | None:
        """Line number of a value in the mission file, starting at 1, and the region that the value occupies.

        If the file does not contain the value, the result refers to the nearest section above it, or, if there is no
        such section, to the first key of the file. The result is None for a mission without a file, and for a value
        that an option has set.
        """
        event = next(filter(None, map(self.places.get, (*upwards(self.written_path(path)), ()))), None)
        return None if event is None or isinstance(event, Changed) else Place.of(event)

    def is_changed(self, path: KeyPath) -> bool:
        """Whether an option has set the value at `path`, or a section or list that contains it."""
        event = next(filter(None, map(self.places.get, upwards(self.written_path(path)))), None)
        return bool(self.changes) and isinstance(event, Changed)


def _at_a_glance(state: PlatformState) -> str:
    """Text on one line with the slant range, the elevation and the speed of a platform."""
    speed = math.hypot(*state.velocity)
    moves = "stands still" if state.is_still else f"moves at {format_quantity(speed, 'm/s', 4)}"
    slant_range = format_quantity(float(state.slant_range), "m", 4)
    return f"{slant_range} away, {math.degrees(state.elevation):.1f}° high, {moves}"


def has_instruments(mission: Mission) -> bool:
    """Whether a mission has sensors, lever arms, clocks, vibration spectra, or flight logs used without smoothing.

    The errors that they cause vary randomly over an aperture.
    """
    return (
        mission.synchronization is not None
        or any(
            platform.oscillator is not None
            or platform.motion_error.imu is not None
            or platform.motion_error.random
            or platform.motion_error.navigation is not None
            or platform.motion_error.lever_arm is not None
            or platform.motion_error.vibration.spectrum is not None
            or (platform.path is not None and platform.path.is_raw)
            for platform in mission.platforms
        )
        or bool(mission.common_motion_error is not None and mission.common_motion_error.random)
    )


def has_random_errors(mission: Mission) -> bool:
    """Whether a mission has errors that vary randomly, or effects other than a quadratic phase error.

    These are the errors of `has_instruments`, propagation delays, and any effect in `other_errors` other than the
    quadratic phase error.
    """
    return (
        has_instruments(mission)
        or mission.propagation is not None
        or any(getattr(other, effect) is not None for other in mission.other_errors for effect in OTHER_EFFECTS[1:])
    )


def flies_on_earth(mission: Mission) -> bool:
    """Whether a mission needs positions on the Earth.

    This is the case if the scene has a position on the Earth, if a path needs such a position or comes from a file,
    or if errors are stated in the `ric` frame.
    """
    common = mission.common_motion_error
    return (
        mission.scene.is_on_earth
        or (common is not None and common.frame == "ric")
        or any(platform.is_of_the_earth or platform.motion_error.frame == "ric" for platform in mission.platforms)
    )


def names_parts(mission: Mission) -> bool:
    """Whether a mission takes figures from parts of the catalogue."""
    return any(platform.part_names for platform in mission.platforms)


def names_requirements(root: Mapping[str, object]) -> bool:
    """Whether the content of a mission file names a requirements file; the content may be invalid."""
    requirements = root.get("requirements")
    return isinstance(requirements, dict) and "file" in requirements


_KEYS_OF_PARTS = ("sensor", "navigation")  # keys of a section that name parts of the catalogue, or contain such keys


def names_files(root: Mapping[str, object]) -> bool:
    """Whether the content of a mission file names a part, an orbit, a log or a requirements file.

    The content may be invalid.
    """
    platforms = root.get("platforms")
    sections = platforms.values() if isinstance(platforms, dict) else ()
    return names_requirements(root) or any(
        key in FLOWN_SECTIONS or (isinstance(item, dict) and not item.keys().isdisjoint(_KEYS_OF_PARTS))
        for section in sections
        if isinstance(section, dict)
        for key, item in section.items()
    )


MISSION = Section(Mission)
# Draft of the JSON Schemas of missions and parts: the YAML support of every editor knows its keywords.
DRAFT = "http://json-schema.org/draft-07/schema#"


def mission_schema() -> JsonObject:
    """JSON Schema of a mission file.

    A quantity is a bare number, or a string with a unit. The schema checks units only in part; the reader of mission
    files checks them completely.
    """
    definitions: Definitions = {}
    return {
        "$schema": DRAFT,
        "title": "bisar-budget mission file",
        **MISSION.definition(definitions),
        "definitions": definitions,
    }
