"""Orbits in the Extended Standard Product 3 (SP3-a to SP3-d), the format of the GNSS services and of low satellites.

Sources: S. Hilla, The Extended Standard Product 3 Orbit Format (SP3-c), 2010, and SP3-d, 2016, NOAA. Places are those
of a satellite's centre of mass in the Earth-fixed axes that the header names.
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
from bisar_budget.paths.ephemeris import APART, OWN_VELOCITY, USUAL_DEGREE, Interpolation, Segment, orbit_through
from bisar_budget.paths.ephemeris import velocity_off as off_places
from bisar_budget.paths.flight import Orbit, PathFileError, Sample
from bisar_budget.paths.instant import FIRST_DAY, TAI_LESS, Instant, parse_instant, tai, tai_less_utc
from bisar_budget.paths.log_places import counted, most_left_out
from bisar_budget.paths.messages import LATEST, coordinate_in, decoded, hold_to_size, number_in, object_key
from bisar_budget.paths.orientation import UNKNOWN, Orientation

_FIRST_LINE = re.compile(r"#[abcd][PV]", re.ASCII)
_SATELLITE = re.compile(r"[A-Z ][ \d]\d", re.ASCII)
# What TAI is ahead of the time of a file; GLO is UTC (SP3-c), BeiDou's time began with 2006 (BDS-SIS-ICD, 3.3).
_AHEAD = {"GPS": TAI_LESS["GPS"], "GAL": 19.0, "QZS": 19.0, "IRN": 19.0, "BDT": 33.0, "TAI": 0.0}
_OF_UTC = ("UTC", "GLO")
_NO_PLACE = 1e-6  # km; all three are 0 where a place is bad or absent
_LISTED = 3  # lines that the words of an orbit name
_GAP = 1.5  # usual intervals; beyond it no polynomial goes


@dataclass
class _Satellite:
    """Samples of one satellite in a file, with the lines they stand in, and where a manoeuvre was before."""

    id: str
    accuracy: float = 0.0  # m
    samples: list[Sample] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    deviations: list[Vector | None] = field(default_factory=list)  # standard deviations of each place, m
    breaks: set[int] = field(default_factory=set)
    predicted: Instant | None = None  # time of the first place that is, of TAI


def read_sp3(
    data: bytes, name: str, wanted: str | None, center: Instant, orientation: Orientation = UNKNOWN
) -> Orbit:
    """Orbit of one satellite of a file, such as `G05`, as every reader of `ORBIT_FORMATS` gives it.

    Between a satellite's places that are missing, and over a manoeuvre that the file flags, nothing is interpolated.
    Places with velocities of their own are interpolated after Hermite, degree 7; places alone after Lagrange, of the
    degree from 7 to 15 that is nearest to one of two more degrees around the aperture. The orientation is not needed:
    the axes are those of the Earth. Lines that cannot be used are left out and counted, up to 1 % of the satellite's
    places; nothing is interpolated over a place that is left out.
    """
    hold_to_size(len(data), name, "time")
    lines = decoded(data, name).split("\n")
    header = _Heading(lines, name)
    # Of a hundred satellites one is read; all of them where that is needed to say which there are.
    satellites = (wanted and _satellites(lines, header, name, wanted)) or _satellites(lines, header, name)
    segments = [segment for one in satellites.values() for segment in _segments(one, header, name, tai(center))]
    try:
        return orbit_through(segments, name, wanted, center, orientation)
    except PathFileError as error:
        if not header.broken:
            raise
        problem = f"{error}; {_first_of(header.broken)}"
        raise PathFileError(problem, error.accepted, error.hint, error.key, error.spans) from None


def _first_of(broken: Mapping[int, str]) -> str:
    """The first line that cannot be used, and how many there are, for messages."""
    problem = broken[min(broken)]
    return problem if len(broken) == 1 else f"{problem}; {len(broken)} lines cannot be used"


class _Heading:
    """Frame, time system and satellites of a file, with the accuracy that it states of each. [m]"""

    def __init__(self, lines: Sequence[str], name: str) -> None:
        first = lines[0].lstrip("\ufeff")
        if not first.strip():
            raise PathFileError(f"{name}:1: is blank; SP3 begins with a line like #cP or #dV in line 1")
        if not _FIRST_LINE.match(first):
            raise PathFileError(f"{name}:1: must begin like #cP or #dV, as SP3 does (got {shown(first[:20])})")
        self.frame = shown(first[46:51].strip()) or "ITRF"
        self.system = "GPS"
        self.base = 0.0  # of the exponents of standard deviations; 0 where there are none
        self.nameless = 0  # places whose satellite cannot be read
        self.broken: dict[int, str] = {}  # lines that cannot be used otherwise, and what is wrong with each
        ids: list[str] = []
        exponents: list[str] = []
        has_system = has_base = False
        for at, line in enumerate(lines, 1):
            if line[:1] == "*":
                self.begins = at
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
                if self.system not in _AHEAD and self.system not in _OF_UTC:
                    raise PathFileError(
                        f"{name}:{at}: the time system {shown(self.system)} is not known; accepted:"
                        f" {', '.join((*_AHEAD, *_OF_UTC))}"
                    )
        else:
            raise PathFileError(f"{name}: has no epoch, a line that begins with *")
        self.accuracy = {
            _id(one): _accuracy(power) for one, power in zip(ids, exponents, strict=False) if one.strip(" 0")
        }


def _accuracy(exponent: str) -> float:
    """Accuracy of 2ⁿ mm; 0 is not known, and more than 2³⁰ mm is no orbit. [m]"""
    text = exponent.strip()
    return 1e-3 * 2 ** int(text) if re.fullmatch(r"\d{1,2}", text, re.ASCII) and 0 < int(text) <= 30 else 0.0


def _deviations(line: str, base: float) -> Vector | None:
    """Standard deviations of the place of a line, baseⁿ mm; None of a line that states none. [m]

    Where an axis has none, it may be as bad as the worst of the others. Three zeros are what a line without has.
    """
    if base <= 1:
        return None
    cells = [line[first : first + 2].strip() for first in (61, 64, 67)]
    stated = {axis: int(cell) for axis, cell in enumerate(cells) if re.fullmatch(r"\d{1,2}", cell, re.ASCII)}
    if not any(stated.values()):
        return None
    worst = max(stated.values())
    x, y, z = (1e-3 * base ** stated.get(axis, worst) for axis in range(3))
    return (x, y, z)


def _id(written: str) -> str:
    """G05 of G05, G 5 or, in SP3-a, of 5 alone."""
    return (written[:1].strip() or "G") + written[1:].strip().rjust(2, "0")


def _satellites(
    lines: Sequence[str], header: _Heading, name: str, wanted: str | None = None
) -> dict[str, _Satellite]:
    """Satellites of a file by their names, or the one that is wanted."""
    key = None if wanted is None else object_key(wanted)
    found: dict[str, _Satellite] = {}
    time: Instant | None = None
    last: Instant | None = None  # epoch that can be read
    place: tuple[_Satellite, int] | None = None  # what the next line may give the velocity of
    for at, line in enumerate(lines[header.begins - 1 :], header.begins):
        kind = line[:1]
        if kind == "*":
            place, time = None, None
            try:
                time = _epoch_after(line, last, header.system, f"{name}:{at}")
                last = time
            except PathFileError as error:
                header.broken[at] = str(error)
        elif kind in ("P", "V") and key is not None and not _is_of(line, key):
            header.nameless += kind == "P" and not _SATELLITE.fullmatch(line[1:4])
        elif kind == "P" and time is not None:
            try:
                place = _place(line, time, at, found, header, name)
            except PathFileError as error:
                header.broken[at], place = str(error), None
        elif kind == "V" and place is not None:
            try:
                _add_velocity(line, *place, f"{name}:{at}")
            except PathFileError as error:
                header.broken[at] = str(error)
        elif line.startswith("EOF"):
            break
        elif line.strip() and kind not in ("P", "V", "E", "/", "%"):
            header.broken[at] = f"{name}:{at}: must be an epoch, a place or a velocity (got {shown(line[:20])})"
    most = max((len(one.samples) for one in found.values()), default=0) + len(header.broken)
    if len(header.broken) > most_left_out(most):
        raise PathFileError(_first_of(header.broken), "accepted: 1 % of the places, and one of 20 or more")
    return found


def _epoch_after(line: str, last: Instant | None, system: str, where: str) -> Instant:
    """Time of an epoch, of TAI, which is after the last one."""
    time = _epoch(line, system, where)
    if last is not None and time.since(last) < APART:
        raise PathFileError(f"{where}: the epoch is not after the one before it; epochs must rise")
    return time


def _add_velocity(line: str, satellite: _Satellite, index: int, where: str) -> None:
    """Give a place the velocity of the line below it."""
    if _satellite_of(line, where) != satellite.id:
        raise PathFileError(f"{where}: the velocity is not of {satellite.id}, whose place is above it")
    speed = [one / 10 for one in _numbers(line, where, "dm/s")]
    if any(speed):
        satellite.samples[index] = satellite.samples[index]._replace(velocity=(speed[0], speed[1], speed[2]))


def _place(
    line: str, time: Instant, at: int, found: dict[str, _Satellite], header: _Heading, name: str
) -> tuple[_Satellite, int] | None:
    """Keep the place of a line; None where it has none."""
    where = f"{name}:{at}"
    satellite_id = _satellite_of(line, where)
    satellite = found.setdefault(satellite_id, _Satellite(satellite_id, header.accuracy.get(satellite_id, 0.0)))
    if line[78:79] == "M":
        satellite.breaks.add(len(satellite.samples))
    if line[79:80] == "P" and satellite.predicted is None:
        satellite.predicted = time
    try:
        x, y, z = _numbers(line, where, "km")
    except PathFileError:
        satellite.breaks.add(len(satellite.samples))
        raise
    if max(abs(x), abs(y), abs(z)) < _NO_PLACE:
        satellite.breaks.add(len(satellite.samples))
        return None
    if satellite.samples and time.since(satellite.samples[-1].time) < APART:
        if satellite.samples[-1].place == (1000 * x, 1000 * y, 1000 * z):
            return None
        satellite.samples.pop()  # nobody knows which of them it is
        satellite.lines.pop()
        satellite.deviations.pop()
        satellite.breaks.add(len(satellite.samples))
        raise PathFileError(f"{where}: {satellite_id} has two places at one epoch")
    satellite.samples.append(Sample(time, (1000 * x, 1000 * y, 1000 * z), (0.0, 0.0, 0.0)))
    satellite.lines.append(at)
    satellite.deviations.append(_deviations(line, header.base))
    return satellite, len(satellite.samples) - 1


def _is_of(line: str, key: str) -> bool:
    """Whether a place or a velocity is of a satellite; of one without a name nobody knows, and it is not wanted."""
    return bool(_SATELLITE.fullmatch(line[1:4])) and object_key(_id(line[1:4])) == key


def _satellite_of(line: str, where: str) -> str:
    if not _SATELLITE.fullmatch(line[1:4]):
        raise PathFileError(f"{where}: must name a satellite in columns 2 to 4, such as G05 (got {shown(line[1:4])})")
    return _id(line[1:4])


def _numbers(line: str, where: str, unit: str) -> list[float]:
    """The three coordinates of a line, each of 14 columns."""
    says = f"must be a number of {unit} in columns"
    return [
        coordinate_in(line[first : first + 14], where, f"{says} {first + 1} to {first + 14}") for first in (4, 18, 32)
    ]


def _epoch(line: str, system: str, where: str) -> Instant:
    """Time of an epoch, of TAI: `*  2010  6 20  0 15  0.00000000`."""
    cells = line[1:].split()
    found = None
    if len(cells) == 6 and all(re.fullmatch(r"\d{1,4}", one, re.ASCII) for one in cells[:5]):
        year, month, day, hour, minute = map(int, cells[:5])
        found = parse_instant(f"{year:04d}-{month:02d}-{day:02d}T{hour:02d}:{minute:02d}:00", needs_zone=False)
    seconds = number_in(cells[5]) if len(cells) == 6 else None
    if found is None or seconds is None or not 0 <= seconds < 61 or not FIRST_DAY < found.day < LATEST:
        raise PathFileError(
            f"{where}: must be an epoch such as *  2026  5 31  0 15  0.00000000 (got {shown(line[:40])})"
        )
    return found.after(seconds + (tai_less_utc(found.day) if system in _OF_UTC else _AHEAD[system]))


def _segments(satellite: _Satellite, header: _Heading, name: str, center: Instant) -> Iterator[Segment]:
    """The stretches of a satellite without a gap or a manoeuvre; `center` is that of the aperture, of TAI."""
    samples = satellite.samples
    steps = sorted(after.time.since(before.time) for before, after in pairwise(samples))
    usual = steps[len(steps) // 2] if steps else 0.0
    predicted = satellite.predicted
    is_predicted = predicted is not None and predicted.since(center) < usual
    edges = [
        n
        for n in range(1, len(samples))
        if n in satellite.breaks or samples[n].time.since(samples[n - 1].time) > _GAP * usual
    ]
    lines = f"{header.nameless} place{'s' * (header.nameless > 1)}"
    nameless = f", {lines} without a satellite's name left out" if header.nameless else ""
    if header.broken:
        listed = ", ".join(map(str, sorted(header.broken)[:_LISTED])) + ", …" * (len(header.broken) > _LISTED)
        noun = "line" if len(header.broken) == 1 else "lines"
        nameless += f", {counted(len(header.broken), 'record')} that cannot be used left out ({noun} {listed})"
    for first, last in pairwise([0, *edges, len(samples)]):
        part = samples[first:last]
        if len(part) < 2:
            continue
        has_velocity = all(any(one.velocity) for one in part) and off_places(part) <= OWN_VELOCITY
        hermite = Interpolation(True, USUAL_DEGREE)
        used = hermite if has_velocity and len(part) >= hermite.nodes else None
        yield Segment(
            object=satellite.id,
            names=(object_key(satellite.id),),
            samples=part,
            first=part[0].time,
            last=part[-1].time,
            where=f"{name}:{satellite.lines[first]}",
            words=f"SP3 of {satellite.id}, {header.frame}{nameless}" + (f", {used.words}" if used else ""),
            interpolation=used,
            accuracy=partial(_stated, satellite, range(first, last)),
            remarks=(f"{name}: places of {satellite.id} around the aperture are predicted",) if is_predicted else (),
        )


def _stated(satellite: _Satellite, stretch: range, time: Instant) -> StatedAccuracy | None:
    """Accuracy at a time of TAI: that of the header, or deviations of the places around it where they are more."""
    after = bisect_left(satellite.samples, time, stretch.start, stretch.stop, key=lambda one: one.time)
    around = {min(max(index, stretch.start), stretch.stop - 1) for index in (after - 1, after)}
    known = [deviations for index in around if (deviations := satellite.deviations[index]) is not None]
    variances = [max(axis) ** 2 for axis in zip(*known, strict=True)]
    if math.fsum(variances) > satellite.accuracy**2:
        return StatedAccuracy(f"standard deviations of {satellite.id}", diagonal(variances))
    total = satellite.accuracy
    return StatedAccuracy(f"accuracy of {satellite.id}", total=total) if total else None
