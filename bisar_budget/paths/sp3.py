"""Orbits in the Extended Standard Product 3 (SP3-a to SP3-d), used by GNSS services and for low Earth orbits.

Sources: S. Hilla, The Extended Standard Product 3 Orbit Format (SP3-c), 2010, and SP3-d, 2016, NOAA. Positions
refer to the satellite's centre of mass, in the Earth-fixed axes that the header names.
"""

import math
import re
from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise

from bisar_budget.faults import shown
from bisar_budget.geometry import Vector
from bisar_budget.paths.accuracy import StatedAccuracy, diagonal
from bisar_budget.paths.ephemeris import (
    DEFAULT_DEGREE,
    MAX_VELOCITY_ERROR_RATIO,
    MIN_SAMPLE_STEP_S,
    Interpolation,
    Segment,
    orbit_through,
    velocity_error,
)
from bisar_budget.paths.flight import Orbit, PathFileError, Sample
from bisar_budget.paths.instant import FIRST_UTC_DAY, TAI_LESS, Instant, parse_instant, tai, tai_less_utc
from bisar_budget.paths.log_places import counted, most_left_out
from bisar_budget.paths.messages import LAST_ORBIT_DAY, coordinate_in, decoded, hold_to_size, number_in, object_key
from bisar_budget.paths.orientation import UNKNOWN, Orientation

_FIRST_LINE = re.compile(r"#[abcd][PV]", re.ASCII)
_SATELLITE = re.compile(r"[A-Z ][ \d]\d", re.ASCII)
# TAI minus the time of a file. GLO is UTC (SP3-c); BeiDou's time began in 2006 (BDS-SIS-ICD, 3.3).
_TAI_LESS_SYSTEM_S = {"GPS": TAI_LESS["GPS"], "GAL": 19.0, "QZS": 19.0, "IRN": 19.0, "BDT": 33.0, "TAI": 0.0}
_UTC_SYSTEMS = ("UTC", "GLO")
_MIN_COORDINATE_KM = 1e-6  # all three coordinates are 0 for a bad or absent position
_NAMED_LINES = 3  # most lines that the description of an orbit lists
_MAX_SAMPLE_GAP_RATIO = 1.5  # of a gap to the usual step; no polynomial crosses a longer gap


@dataclass
class _Satellite:
    """A satellite in an SP3 file, with the samples of its orbit.

    Attributes
    ----------
    id : str
        Name of the satellite.
    accuracy : float
        Accuracy of the orbit, from the header; 0 if it is unknown. [m]
    samples : list of Sample
        Times in TAI, positions and velocities.
    lines : list of int
        Line of the file in which each sample is written.
    deviations : list of Vector or None
        Standard deviations of the position of each sample; None if the file does not state them. [m]
    breaks : set of int
        Indices of samples that directly follow a manoeuvre or a missing position.
    predicted : Instant, optional
        Time of the first predicted position, in TAI.
    """

    id: str
    accuracy: float = 0.0
    samples: list[Sample] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    deviations: list[Vector | None] = field(default_factory=list)
    breaks: set[int] = field(default_factory=set)
    predicted: Instant | None = None


def read_sp3(
    data: bytes, name: str, object_name: str | None, center: Instant, orientation: Orientation = UNKNOWN
) -> Orbit:
    """Read an SP3 file, and return the orbit of a satellite, such as `G05`.

    Arguments and errors are the same for all readers, see `OrbitFormat.read`.

    The orbit is not interpolated across missing positions of the satellite, or across a manoeuvre that is flagged in
    the file. If the file has velocities that agree with the positions, Hermite's polynomial of degree 7 is used.
    Otherwise Lagrange's polynomial is used, with the degree from 7 to 15 that has the smallest estimated error around
    the aperture. The orientation is not needed, since the axes are fixed to the Earth. Unusable lines are left out
    and counted, up to 1 % of the satellite's positions. The orbit is not interpolated across a position that is left
    out.
    """
    hold_to_size(len(data), name, "time")
    lines = decoded(data, name).split("\n")
    header = _Heading(lines, name)
    # A file may have a hundred satellites. All are read only if a message has to name them.
    satellites = (object_name and _satellites(lines, header, name, object_name)) or _satellites(lines, header, name)
    segments = [
        segment for satellite in satellites.values() for segment in _segments(satellite, header, name, tai(center))
    ]
    try:
        return orbit_through(segments, name, object_name, center, orientation)
    except PathFileError as error:
        if not header.broken:
            raise
        problem = f"{error}; {_first_of(header.broken)}"
        raise PathFileError(problem, error.accepted, error.hint, error.key, error.spans) from None


def _first_of(broken: Mapping[int, str]) -> str:
    """Error message for unusable lines.

    It states the fault in the first of these lines, and the number of lines if there are several.
    """
    problem = broken[min(broken)]
    return problem if len(broken) == 1 else f"{problem}; {len(broken)} lines cannot be used"


class _Heading:
    """Header of an SP3 file, and the unusable lines of the file.

    Attributes
    ----------
    frame, system : str
        Names of the Earth-fixed axes and of the time system.
    base : float
        Standard deviations of positions are written as exponents of this base; 0 if the file states no base.
    nameless : int
        Number of positions for which the name of the satellite cannot be read.
    broken : dict
        Messages about other unusable lines, by line number.
    first_epoch_line : int
        Number of the line with the first epoch.
    accuracy : dict
        Accuracy of the orbit of each satellite, by its name; 0 if it is unknown. [m]
    """

    def __init__(self, lines: Sequence[str], name: str) -> None:
        first = lines[0].lstrip("\ufeff")
        if not first.strip():
            raise PathFileError(f"{name}:1: is blank; SP3 begins with a line like #cP or #dV in line 1")
        if not _FIRST_LINE.match(first):
            raise PathFileError(f"{name}:1: must begin like #cP or #dV, as SP3 does (got {shown(first[:20])})")
        self.frame = shown(first[46:51].strip()) or "ITRF"
        self.system = "GPS"
        self.base = 0.0
        self.nameless = 0
        self.broken: dict[int, str] = {}
        ids: list[str] = []
        exponents: list[str] = []
        has_system = has_base = False
        for number, line in enumerate(lines, 1):
            if line[:1] == "*":
                self.first_epoch_line = number
                break
            cells = [line[first : first + 3] for first in range(9, 60, 3)]
            if line[:2] == "++":
                exponents += cells
            elif line[:2] == "+ ":
                ids += cells
            elif line[:2] == "%f" and not has_base:
                has_base = True
                self.base = number_in(line[3:13]) or 0.0
            elif line[:2] == "%c" and not has_system:
                has_system = True
                self.system = line[9:12].strip().upper().replace("CCC", "GPS") or "GPS"
                if self.system not in _TAI_LESS_SYSTEM_S and self.system not in _UTC_SYSTEMS:
                    raise PathFileError(
                        f"{name}:{number}: the time system {shown(self.system)} is not known; accepted:"
                        f" {', '.join((*_TAI_LESS_SYSTEM_S, *_UTC_SYSTEMS))}"
                    )
        else:
            raise PathFileError(f"{name}: has no epoch, a line that begins with *")
        self.accuracy = {
            _id(satellite): _accuracy(exponent)
            for satellite, exponent in zip(ids, exponents, strict=False)
            if satellite.strip(" 0")
        }


def _accuracy(exponent: str) -> float:
    """Accuracy of an orbit, 2ⁿ mm, from the text of the exponent n; 0 if it is unknown. [m]

    An exponent above 30 is not possible for an orbit, and counts as unknown.
    """
    text = exponent.strip()
    return 1e-3 * 2 ** int(text) if re.fullmatch(r"\d{1,2}", text, re.ASCII) and 0 < int(text) <= 30 else 0.0


def _deviations(line: str, base: float) -> Vector | None:
    """Standard deviations of the position in a line, baseⁿ mm for each axis; None if they are not stated. [m]

    The line states the exponents n. An axis without an exponent gets the largest exponent of the line. If all
    exponents are zero, the line states no standard deviation.
    """
    if base <= 1:
        return None
    cells = [line[first : first + 2].strip() for first in (61, 64, 67)]
    exponents = {axis: int(cell) for axis, cell in enumerate(cells) if re.fullmatch(r"\d{1,2}", cell, re.ASCII)}
    if not any(exponents.values()):
        return None
    largest = max(exponents.values())
    x, y, z = (1e-3 * base ** exponents.get(axis, largest) for axis in range(3))
    return (x, y, z)


def _id(text: str) -> str:
    """Standard name of a satellite, such as G05, from its name in a file: `G05`, `G 5`, or `5` in SP3-a."""
    return (text[:1].strip() or "G") + text[1:].strip().rjust(2, "0")


def _satellites(
    lines: Sequence[str], header: _Heading, name: str, object_name: str | None = None
) -> dict[str, _Satellite]:
    """Read the samples of all satellites in a file, or only of the satellite `object_name`.

    Returns the satellites by name.
    """
    key = None if object_name is None else object_key(object_name)
    satellites: dict[str, _Satellite] = {}
    time: Instant | None = None
    last_epoch: Instant | None = None  # the last epoch that could be read
    position: tuple[_Satellite, int] | None = None  # satellite and index of the sample whose velocity may follow
    for number, line in enumerate(lines[header.first_epoch_line - 1 :], header.first_epoch_line):
        kind = line[:1]
        if kind == "*":
            position, time = None, None
            try:
                time = _epoch_after(line, last_epoch, header.system, f"{name}:{number}")
                last_epoch = time
            except PathFileError as error:
                header.broken[number] = str(error)
        elif kind in ("P", "V") and key is not None and not _is_of(line, key):
            header.nameless += kind == "P" and not _SATELLITE.fullmatch(line[1:4])
        elif kind == "P" and time is not None:
            try:
                position = _add_position(line, time, number, satellites, header, name)
            except PathFileError as error:
                header.broken[number], position = str(error), None
        elif kind == "V" and position is not None:
            try:
                _add_velocity(line, *position, f"{name}:{number}")
            except PathFileError as error:
                header.broken[number] = str(error)
        elif line.startswith("EOF"):
            break
        elif line.strip() and kind not in ("P", "V", "E", "/", "%"):
            header.broken[number] = (
                f"{name}:{number}: must be an epoch, a position or a velocity (got {shown(line[:20])})"
            )
    count = max((len(satellite.samples) for satellite in satellites.values()), default=0) + len(header.broken)
    if len(header.broken) > most_left_out(count):
        raise PathFileError(_first_of(header.broken), "accepted: 1 % of the positions, and one of 20 or more")
    return satellites


def _epoch_after(line: str, last_epoch: Instant | None, system: str, location: str) -> Instant:
    """Read the time of an epoch, in TAI; refuse an epoch that is not later than `last_epoch`."""
    time = _epoch(line, system, location)
    if last_epoch is not None and time.since(last_epoch) < MIN_SAMPLE_STEP_S:
        raise PathFileError(f"{location}: the epoch is not after the one before it; epochs must rise")
    return time


def _add_velocity(line: str, satellite: _Satellite, index: int, location: str) -> None:
    """Read a velocity from a line, and add it to the sample with index `index`.

    The position of that sample is in the preceding line.
    """
    if _satellite_of(line, location) != satellite.id:
        raise PathFileError(f"{location}: the velocity is not of {satellite.id}, whose position is above it")
    velocity = [speed / 10 for speed in _numbers(line, location, "dm/s")]
    if any(velocity):
        satellite.samples[index] = satellite.samples[index]._replace(velocity=(velocity[0], velocity[1], velocity[2]))


def _add_position(
    line: str, time: Instant, number: int, satellites: dict[str, _Satellite], header: _Heading, name: str
) -> tuple[_Satellite, int] | None:
    """Read a position from a line, and add it to the samples of its satellite; return the satellite and the index.

    The index identifies the new sample. Returns None if the line has no position, or repeats the previous sample.
    """
    location = f"{name}:{number}"
    satellite_id = _satellite_of(line, location)
    satellite = satellites.setdefault(satellite_id, _Satellite(satellite_id, header.accuracy.get(satellite_id, 0.0)))
    if line[78:79] == "M":
        satellite.breaks.add(len(satellite.samples))
    if line[79:80] == "P" and satellite.predicted is None:
        satellite.predicted = time
    try:
        x, y, z = _numbers(line, location, "km")
    except PathFileError:
        satellite.breaks.add(len(satellite.samples))
        raise
    if max(abs(x), abs(y), abs(z)) < _MIN_COORDINATE_KM:
        satellite.breaks.add(len(satellite.samples))
        return None
    if satellite.samples and time.since(satellite.samples[-1].time) < MIN_SAMPLE_STEP_S:
        if satellite.samples[-1].place == (1000 * x, 1000 * y, 1000 * z):
            return None
        satellite.samples.pop()  # which of both is right is unknown
        satellite.lines.pop()
        satellite.deviations.pop()
        satellite.breaks.add(len(satellite.samples))
        raise PathFileError(f"{location}: {satellite_id} has two positions at one epoch")
    satellite.samples.append(Sample(time, (1000 * x, 1000 * y, 1000 * z), (0.0, 0.0, 0.0)))
    satellite.lines.append(number)
    satellite.deviations.append(_deviations(line, header.base))
    return satellite, len(satellite.samples) - 1


def _is_of(line: str, key: str) -> bool:
    """Whether a line with a position or a velocity belongs to a satellite.

    `key` is the name of the satellite, normalised by `object_key`. A line without a name belongs to no satellite.
    """
    return bool(_SATELLITE.fullmatch(line[1:4])) and object_key(_id(line[1:4])) == key


def _satellite_of(line: str, location: str) -> str:
    if not _SATELLITE.fullmatch(line[1:4]):
        raise PathFileError(
            f"{location}: must name a satellite in columns 2 to 4, such as G05 (got {shown(line[1:4])})"
        )
    return _id(line[1:4])


def _numbers(line: str, location: str, unit: str) -> list[float]:
    """Read the three coordinates in a line, each from 14 columns, in the unit of the file."""
    requirement = f"must be a number of {unit} in columns"
    return [
        coordinate_in(line[first : first + 14], location, f"{requirement} {first + 1} to {first + 14}")
        for first in (4, 18, 32)
    ]


def _epoch(line: str, system: str, location: str) -> Instant:
    """Read the time of an epoch in TAI from a line like `*  2010  6 20  0 15  0.00000000`."""
    cells = line[1:].split()
    minute_start = None
    if len(cells) == 6 and all(re.fullmatch(r"\d{1,4}", cell, re.ASCII) for cell in cells[:5]):
        year, month, day, hour, minute = map(int, cells[:5])
        minute_start = parse_instant(f"{year:04d}-{month:02d}-{day:02d}T{hour:02d}:{minute:02d}:00", needs_zone=False)
    seconds = number_in(cells[5]) if len(cells) == 6 else None
    if (
        minute_start is None
        or seconds is None
        or not 0 <= seconds < 61
        or not FIRST_UTC_DAY < minute_start.day < LAST_ORBIT_DAY
    ):
        raise PathFileError(
            f"{location}: must be an epoch such as *  2026  5 31  0 15  0.00000000 (got {shown(line[:40])})"
        )
    return minute_start.after(
        seconds + (tai_less_utc(minute_start.day) if system in _UTC_SYSTEMS else _TAI_LESS_SYSTEM_S[system])
    )


def _segments(satellite: _Satellite, header: _Heading, name: str, center: Instant) -> Iterator[Segment]:
    """Yield the segments of a satellite's orbit between gaps and manoeuvres.

    `center` is the middle of the aperture in TAI. If positions around it are predicted, the segments carry a warning.
    """
    samples = satellite.samples
    steps = sorted(after.time.since(before.time) for before, after in pairwise(samples))
    usual_step = steps[len(steps) // 2] if steps else 0.0
    predicted = satellite.predicted
    is_predicted = predicted is not None and predicted.since(center) < usual_step
    edges = [
        n
        for n in range(1, len(samples))
        if n in satellite.breaks or samples[n].time.since(samples[n - 1].time) > _MAX_SAMPLE_GAP_RATIO * usual_step
    ]
    lines = f"{header.nameless} position{'s' * (header.nameless > 1)}"
    nameless = f", {lines} without a satellite's name left out" if header.nameless else ""
    if header.broken:
        listed = ", ".join(map(str, sorted(header.broken)[:_NAMED_LINES])) + ", …" * (
            len(header.broken) > _NAMED_LINES
        )
        noun = "line" if len(header.broken) == 1 else "lines"
        nameless += f", {counted(len(header.broken), 'record')} that cannot be used left out ({noun} {listed})"
    for first, last in pairwise([0, *edges, len(samples)]):
        stretch = samples[first:last]
        if len(stretch) < 2:
            continue
        has_velocity = (
            all(any(sample.velocity) for sample in stretch) and velocity_error(stretch) <= MAX_VELOCITY_ERROR_RATIO
        )
        hermite = Interpolation(True, DEFAULT_DEGREE)
        interpolation = hermite if has_velocity and len(stretch) >= hermite.nodes else None
        yield Segment(
            object=satellite.id,
            names=(object_key(satellite.id),),
            samples=stretch,
            first=stretch[0].time,
            last=stretch[-1].time,
            where=f"{name}:{satellite.lines[first]}",
            words=f"SP3 of {satellite.id}, {header.frame}{nameless}"
            + (f", {interpolation.words}" if interpolation else ""),
            interpolation=interpolation,
            accuracy=partial(_stated, satellite, range(first, last)),
            remarks=(f"{name}: positions of {satellite.id} around the aperture are predicted",)
            if is_predicted
            else (),
        )


def _stated(satellite: _Satellite, stretch: range, time: Instant) -> StatedAccuracy | None:
    """Accuracy that the file states for the orbit of a satellite at a time in TAI; None if it states no accuracy.

    The accuracy in the header is used, or the standard deviations of the samples directly before and after the time,
    if these are larger. `stretch` is the range of the indices of the samples in a segment.
    """
    after = bisect_left(satellite.samples, time, stretch.start, stretch.stop, key=lambda sample: sample.time)
    neighbours = {min(max(index, stretch.start), stretch.stop - 1) for index in (after - 1, after)}
    stated = [deviations for index in neighbours if (deviations := satellite.deviations[index]) is not None]
    variances = [max(axis) ** 2 for axis in zip(*stated, strict=True)]
    if math.fsum(variances) > satellite.accuracy**2:
        return StatedAccuracy(f"standard deviations of {satellite.id}", diagonal(variances))
    total = satellite.accuracy
    return StatedAccuracy(f"accuracy of {satellite.id}", total=total) if total else None
