"""The section `navigation` of a motion error: an inertial unit that a GNSS receiver aids, filtered or smoothed.

Values are in SI units, 1 sigma.
"""

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, NamedTuple

from bisar_budget import units
from bisar_budget.arrays import PerCase
from bisar_budget.faults import KeyPath, Problem
from bisar_budget.geometry import Vector
from bisar_budget.json_types import Definitions, JsonObject
from bisar_budget.mission.instruments import (
    AccelerometerBias,
    AccelerometerScaleFactor,
    AngleRandomWalk,
    GyroBias,
    Overridden,
    VelocityRandomWalk,
)
from bisar_budget.mission.readers import (
    INVALID,
    MISSING,
    Choice,
    Invalid,
    Key,
    ListOf,
    Quantity,
    Reader,
    Reference,
    Report,
    Section,
    SectionValues,
    Source,
    Triple,
    read_part,
)
from bisar_budget.mission.vibrations import LEVEL

SMOOTHED_METHOD, FILTERED_METHOD = "smoothed", "filtered"
DEFAULT_FLIGHT_S = 60.0  # of the flight before and after the aperture
DEFAULT_HEADING_RAD = math.radians(5)
MAX_FIX_COUNT = 20_000  # of a flight; a check takes 0.1 ms and 10 kB for each
_FLIGHT_TIME = Quantity(units.TIME, ge=0, le=1e5)
_OUTAGE_TIME = Quantity(units.TIME, ge=-1e6, le=1e6)


class AidedImu(NamedTuple):
    """Figures of the inertial unit of an aided navigation, 1 sigma, along the axes of the body."""

    sensor: Annotated[
        str | None,
        Key(Reference(), "An inertial sensor of the catalogue, or a file; other keys of the section override it."),
    ] = None
    accelerometer_bias: AccelerometerBias = None
    accelerometer_scale_factor: AccelerometerScaleFactor = None
    gyro_bias: GyroBias = None
    velocity_random_walk: VelocityRandomWalk = None
    angle_random_walk: AngleRandomWalk = None
    source: Source = None


AIDED_IMU_FIGURES = AidedImu._fields[1:-1]
NEEDED_IMU_FIGURES = ("accelerometer_bias", "gyro_bias", "velocity_random_walk", "angle_random_walk")


class AidedGnss(NamedTuple):
    """Figures of the GNSS receiver of an aided navigation, 1 sigma, east, north and up."""

    rate: Annotated[float, Key(Quantity(units.FREQUENCY, gt=0, ge=1e-4, le=1e4), "Fixes per second.")]
    sensor: Annotated[
        str | None,
        Key(Reference(), "A GNSS receiver of the catalogue, or a file; other keys of the section override it."),
    ] = None
    position: Annotated[
        Vector | None,
        Key(Triple(Quantity(units.LENGTH, gt=0, ge=1e-6, le=1e6), or_scalar=True), "Error of each fix."),
    ] = None
    velocity: Annotated[
        Vector | None,
        Key(
            Triple(Quantity(units.SPEED, gt=0, ge=1e-6, le=1e6), or_scalar=True),
            "Error of the velocity of each fix; omitted: the fixes have no velocity.",
        ),
    ] = None
    correlation_time: Annotated[
        float | None,
        Key(
            Quantity(units.TIME, gt=0, ge=1e-3, le=1e9),
            "Correlation time of the errors of the positions; omitted: each fix has a new error.",
        ),
    ] = None
    source: Source = None


AIDED_GNSS_FIGURES = ("position", "velocity")


OUTAGE_KEYS = {"from": "start", "to": "end"}  # keys of the file to fields


class Outage(NamedTuple):
    """Interval without fixes, relative to mid-aperture, both ends included. [s]"""

    start: float
    end: float


class _OutageReader(Reader[Outage]):
    """A mapping with the keys `from` and `to`."""

    accepted = "accepted: from and to, such as {from: -2 s, to: 3 s}"

    def read(self, value: object, path: KeyPath, report: Report) -> Outage | Invalid:
        """Read the times at which an outage begins and ends; it has to end after it begins."""
        if not isinstance(value, dict):
            report(path, Problem("must be a mapping of times", self.accepted))
            return INVALID
        is_valid = True
        for key in value.keys() - {"from", "to"}:
            report((*path, key), Problem("is not a known key", self.accepted, is_of_key=True))
            is_valid = False
        ends: list[float | Invalid] = []
        for key in ("from", "to"):
            if key not in value:
                report((*path, key), Problem(MISSING, self.accepted))
                ends.append(INVALID)
            else:
                ends.append(read_part(_OUTAGE_TIME, value[key], (*path, key), report))
        start, end = ends
        if start is INVALID or end is INVALID or not is_valid:
            return INVALID
        if not start < end:
            report((*path, "to"), Problem("is not after from", self.accepted))
            return INVALID
        return Outage(start, end)

    def below(self, step: str) -> Reader[object] | None:
        """Reader of the time at which an outage begins or ends; None for an unknown key."""
        return _OUTAGE_TIME if step in ("from", "to") else None

    def schema(self, definitions: Definitions) -> JsonObject:
        """JSON Schema: an object with the times `from` and `to`."""
        time = _OUTAGE_TIME.schema(definitions)
        return {
            "type": "object",
            "properties": {"from": time, "to": time},
            "required": ["from", "to"],
            "additionalProperties": False,
        }


class Navigation(NamedTuple):
    """An inertial unit that a GNSS receiver aids: its errors are those that a filter or a smoother leaves.

    `part_sources` has the names of the figures that come from parts of the catalogue, each with its source.
    `overridden` lists the figures of parts that keys of the file replace.
    """

    imu: Annotated[AidedImu, Key(Section(AidedImu), "The inertial unit.")]
    gnss: Annotated[AidedGnss, Key(Section(AidedGnss), "The GNSS receiver.")]
    heading: Annotated[
        float,
        Key(
            Quantity(units.ANGLE, gt=0, ge=1e-6, le=math.pi),
            "Heading error at the start, such as that of a dual antenna; default 5 deg.",
        ),
    ] = DEFAULT_HEADING_RAD
    method: Annotated[
        str,
        Key(
            Choice(SMOOTHED_METHOD, FILTERED_METHOD),
            "smoothed: processed afterwards, with the fixes after each moment too; filtered: the output of a filter "
            "in flight.",
        ),
    ] = SMOOTHED_METHOD
    before: Annotated[float, Key(_FLIGHT_TIME, "Flight before the aperture whose fixes are used.")] = DEFAULT_FLIGHT_S
    after: Annotated[
        float | None,
        Key(_FLIGHT_TIME, "Flight after the aperture whose fixes are used; default 60 s if smoothed, 0 if filtered."),
    ] = None
    outages: Annotated[
        tuple[Outage, ...],
        Key(ListOf(_OutageReader()), "Intervals without fixes, relative to mid-aperture: [{from: -2 s, to: 3 s}]."),
    ] = ()
    level: Annotated[float, Key(LEVEL, "Shifts the whole covariance of the position error.")] = 0.0
    source: Source = None
    part_sources: tuple[tuple[str, str], ...] = ()
    overridden: tuple[Overridden, ...] = ()

    @property
    def is_smoothed(self) -> bool:
        """Whether fixes after a moment contribute to the position at this moment."""
        return self.method == SMOOTHED_METHOD

    @property
    def after_s(self) -> PerCase:
        """Duration of the flight after the aperture from which fixes are used. [s]"""
        if not self.is_smoothed:
            return 0.0
        return DEFAULT_FLIGHT_S if self.after is None else self.after

    def fix_count(self, aperture_time: PerCase) -> PerCase:
        """Number of fixes during the flight for an aperture time [s]; outages are not subtracted."""
        return 1 + (self.before + aperture_time + self.after_s) * self.gnss.rate

    @property
    def figures(self) -> Mapping[str, Vector]:
        """Map each stated figure of the inertial unit and the receiver, such as `imu.gyro_bias`, to its value."""
        stated = {f"imu.{key}": getattr(self.imu, key) for key in AIDED_IMU_FIGURES}
        stated |= {f"gnss.{key}": getattr(self.gnss, key) for key in AIDED_GNSS_FIGURES}
        return {key: value for key, value in stated.items() if value is not None}

    def evidence(self, figure: str) -> str | None:
        """Source of a figure, such as `imu.gyro_bias`; None if no source is stated."""
        section: AidedImu | AidedGnss = getattr(self, figure.partition(".")[0])
        return dict(self.part_sources).get(figure) or section.source or self.source

    @property
    def sources(self) -> tuple[str, ...]:
        """Sources of all figures; a source of several figures is listed once."""
        return tuple(dict.fromkeys(filter(None, map(self.evidence, self.figures))))

    @staticmethod
    def problems(values: SectionValues) -> Iterator[Problem]:
        """Refuse a filter that is to use fixes after the aperture, and a section that lacks a needed figure.

        A section that names a part is not checked here, because the part may supply the figure.
        """
        if values.get("method") == FILTERED_METHOD and values.get("after"):
            yield Problem("a filter uses no fixes after the aperture", "accepted: no after, or 0 s", at=("after",))
        for key in ("imu", "gnss"):
            section: AidedImu | AidedGnss | None = values.get(key)
            if section is not None and section.sensor is None:
                for figure in missing_figures(section):
                    accepted = f"accepted: a figure of a data sheet, or {key}.sensor: a part that states it"
                    yield Problem(MISSING, accepted, at=(key, figure))


def missing_figures(section: AidedImu | AidedGnss) -> list[str]:
    """Keys of the figures that an aided navigation needs and that a section does not state."""
    needed = NEEDED_IMU_FIGURES if isinstance(section, AidedImu) else ("position",)
    return [figure for figure in needed if getattr(section, figure) is None]


NAVIGATION = Section(Navigation)
