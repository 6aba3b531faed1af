"""Mean elements of orbits: two-line sets and orbit mean-elements messages (OMM), propagated by SGP4.

The error of a position from SGP4 is about 1 km at the epoch of the elements, and grows by 1 to 3 km with each day
from the epoch (documentation of the package sgp4; Vallado and others, Revisiting Spacetrack Report #3, AIAA
2006-6753). The constants of WGS-72 are used, because the elements are made with them. Positions are rotated from the
true equator and mean equinox of date to Earth-fixed axes with the mean sidereal time of 1982.

Two-line sets follow Hoots & Roehrich, Spacetrack Report No. 3, 1980, section 12, with Space-Track's alpha-5 catalogue
numbers. Messages follow CCSDS 502.0-B: they are text with keywords and values, XML, JSON or CSV. JSON and CSV use the
same keywords. In these two formats, CelesTrak leaves out keywords that can have only one value; Space-Track writes
all keywords.
"""

import csv
import io
import json
import math
import re
from calendar import isleap
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

from bisar_budget.extras import install_command
from bisar_budget.faults import shown
from bisar_budget.geometry import Vector
from bisar_budget.paths.accuracy import EpochCovariance, StatedAccuracy, stated_of_orbit
from bisar_budget.paths.flight import Orbit, PathDoubt, PathFileError, Sample, interpolate
from bisar_budget.paths.instant import DAY_S, Instant, day_of_year, later, tai, tai_less_utc
from bisar_budget.paths.messages import (
    FIRST_ORBIT_DAY,
    LAST_ORBIT_DAY,
    decoded,
    epoch_in,
    hold_to_size,
    is_markup,
    number_in,
    object_key,
    one_object,
    parse_markup,
)
from bisar_budget.paths.oem import named_covariance, read_covariance
from bisar_budget.paths.orientation import UNKNOWN, Orientation, from_teme

# CCSDS 502.0-B-3, EPHEMERIS_TYPE; 0 is SGP4 in all distributed elements, 4 is SGP4-XP. Two-line sets have a digit.
_SGP4_TYPES = ("", "0", "2", "SGP4")
_SGP4_EPOCH_DAY = 33281  # modified Julian day of 1949-12-31, from which SGP4 counts days
_SMOOTHING_NODES, _NODE_STEP_S = 8, 30.0
_MAX_FRESH_DAYS = 7.0
_MARGIN_S = 60.0  # beyond the epoch and the aperture; velocities are differences of positions within it
_MAX_AGE_DAYS = 36525.0  # SGP4 steps through the time to a resonant orbit
_EPOCH_ERROR_KM, _DAILY_ERRORS_KM = 1, (1, 3)
_DAILY_ERROR_KM = 2.0  # middle of the range in the sources
# The error codes of Satrec.sgp4; 5 is no longer in use.
_FAILURES = {
    1: "its mean eccentricity leaves the range from 0 to 1",
    2: "its mean motion falls below zero",
    3: "its perturbed eccentricity leaves the range from 0 to 1",
    4: "its semilatus rectum falls below zero",
    6: "it has decayed",
}


@dataclass(frozen=True, kw_only=True)
class Elements:
    """Mean elements of an object at an epoch, in the units of SGP4: angles in rad, mean motion in rad/min.

    `covariance` is the covariance of position and velocity at the epoch, or None if the file does not state it.
    """

    name: str
    number: int
    epoch: Instant
    mean_motion: float
    eccentricity: float
    inclination: float
    node: float
    perigee: float
    anomaly: float
    drag: float  # B*, 1/Earth radii
    kind: str  # kind of file, for reports
    where: str  # file and line or record
    covariance: EpochCovariance | None = None

    @property
    def object(self) -> str:
        """Name and catalogue number of the object, for messages."""
        return f"{self.name} ({self.number})" if self.name else str(self.number)

    @property
    def names(self) -> tuple[str, ...]:
        """Name and catalogue number of the object, normalised for comparison with the name in a mission."""
        return (object_key(self.name), str(self.number))


@dataclass(frozen=True, kw_only=True)
class BrokenEntry:
    """An unusable entry of an orbit file: the reason, and the names of the object as far as they could be read."""

    problem: str
    names: tuple[str, ...] = ()
    is_empty: bool = False  # without any value


Entry = Elements | BrokenEntry


def teme(elements: Elements) -> Callable[[Instant], Vector]:
    """Return a function that computes the position of an object at an instant with SGP4. [m]

    The axes are the true equator and mean equinox of date (TEME).

    Raises
    ------
    PathFileError
        The package sgp4 is not installed, or refuses the elements. The returned function raises this error for an
        instant for which SGP4 has no position.
    """
    try:
        from sgp4.api import WGS72, Satrec
    except ImportError:
        raise PathFileError(f"{elements.where}: needs the package sgp4: {install_command('orbits')}") from None
    satellite = Satrec()
    epoch = elements.epoch.day - _SGP4_EPOCH_DAY + elements.epoch.seconds / DAY_S
    # SGP4 does not use the derivatives of the mean motion, nor the catalogue number.
    shape = (elements.eccentricity, elements.perigee, elements.inclination, elements.anomaly)
    satellite.sgp4init(WGS72, "i", 0, epoch, elements.drag, 0.0, 0.0, *shape, elements.mean_motion, elements.node)
    if satellite.error:
        raise PathFileError(f"{elements.where}: SGP4 refuses {elements.object}: {_failure(satellite.error)}")

    def place(instant: Instant) -> Vector:
        elapsed = instant.since(elements.epoch) + tai_less_utc(instant.day) - tai_less_utc(elements.epoch.day)
        if abs(elapsed) > _MAX_AGE_DAYS * DAY_S:
            raise PathFileError(
                f"{elements.where}: the elements of {elements.object} are of {elements.epoch.as_text()}, more than a"
                " century from the aperture"
            )
        # A Julian date of two numbers would be as exact, but its epoch passes through a calendar.
        error, position, _ = satellite.sgp4_tsince(elapsed / 60)
        if error or not all(math.isfinite(coordinate) for coordinate in position):
            raise PathFileError(
                f"{elements.where}: SGP4 has no position of {elements.object} at {instant.as_text()}: "
                f"{_failure(error)}"
            )
        x, y, z = position
        return (1000 * x, 1000 * y, 1000 * z)

    return place


def smooth(place: Callable[[Instant], Vector]) -> Callable[[Instant], Vector]:
    """Return a smooth version of `place`, a function that returns the position at an instant. [m]

    Positions from SGP4 have rounding steps, which grow with the time from the epoch of the elements. SGP4 counts
    minutes and angles from the epoch, so a position is rounded to 2e-6 m a week from the epoch, and to 4e-5 m 100
    days from the epoch. A polynomial of slow time would follow these steps, which would give the path a false
    curvature. Instead, Lagrange's polynomial goes through eight positions 30 s apart. Its error in a low orbit is
    1e-8 m according to its remainder term. It also smooths the jumps of a few millimetres that SGP4 makes every half
    day in resonant orbits.
    """

    @lru_cache(maxsize=64)
    def node(day: int, count: int) -> Sample:
        midnight = Instant(day, 0.0)  # seconds of its day continue beyond the day, without leap seconds
        second = count * _NODE_STEP_S
        return Sample(midnight.after(second), place(later(midnight, second)), (0.0, 0.0, 0.0))

    def between(instant: Instant) -> Vector:
        count = math.floor(instant.seconds / _NODE_STEP_S)
        try:
            first = count + 1 - _SMOOTHING_NODES // 2
            samples = [node(instant.day, number) for number in range(first, first + _SMOOTHING_NODES)]
        except PathFileError:  # a node lies beyond the end of the orbit, which is minutes away
            return place(instant)
        return interpolate(samples, instant, _SMOOTHING_NODES, False)

    return between


def orbit_of(
    entries: Sequence[Entry], name: str, object_name: str | None, center: Instant, orientation: Orientation
) -> Orbit:
    """Orbit of an object from the element set whose epoch is nearest to `center`.

    If the epochs of several element sets are equally near, the last of these sets is used. `entries` are the entries
    of a file. The other arguments are the same as for `OrbitFormat.read`. `object_name` is a name or a catalogue
    number. Broken entries of other objects are left out, and counted in `Orbit.words`. Raises `PathFileError` in
    these cases: there are no element sets; there are element sets of several objects and `object_name` is None; an
    entry of the object is broken; an entry is broken and no object is named; SGP4 is missing or refuses the elements.
    """
    sets = [entry for entry in entries if isinstance(entry, Elements)]
    broken = [entry for entry in entries if isinstance(entry, BrokenEntry)]
    for entry in broken:
        is_fault = object_name is None and not (entry.is_empty and sets)
        if is_fault or not sets or (object_name is not None and object_key(object_name) in entry.names):
            raise PathFileError(entry.problem)
    if not sets:
        raise PathFileError(f"{name}: has no element set")
    candidates = one_object(sets, name, object_name, "number")
    elements = min(reversed(candidates), key=lambda candidate: abs(center.since(candidate.epoch)))
    for entry in broken:
        if elements.names[-1] in entry.names:
            raise PathFileError(entry.problem)
    left_out = f", {len(broken)} of {len(entries)} entries left out ({broken[0].problem})" if broken else ""
    inertial = smooth(teme(elements))
    inertial(elements.epoch)  # raises now if SGP4 refuses the elements

    def doubt(instant: Instant) -> PathDoubt:
        days = abs(instant.since(elements.epoch)) / DAY_S
        words = f"elements {days:.3g} days from their epoch: {_EPOCH_ERROR_KM} km there, {_DAILY_ERROR_KM:g} km a day"
        return PathDoubt(1e3 * (_EPOCH_ERROR_KM + _DAILY_ERROR_KM * days), words)

    def doubts(instant: Instant) -> Sequence[str]:
        days = instant.since(elements.epoch) / DAY_S
        if abs(days) <= _MAX_FRESH_DAYS:
            return ()
        smallest_km, largest_km = (_EPOCH_ERROR_KM + abs(days) * daily_km for daily_km in _DAILY_ERRORS_KM)
        return (
            f"{name}: the elements of {elements.object} are of {elements.epoch.as_text()}, {abs(days):.1f} days"
            f" {'before' if days > 0 else 'after'} the aperture; its position by SGP4 may be {smallest_km:.0f} to "
            f"{largest_km:.0f} km off",
        )

    def place(instant: Instant) -> Vector:
        return from_teme(inertial(instant), instant, orientation)

    def stated(instant: Instant) -> StatedAccuracy | None:
        if elements.covariance is None:
            return None
        span = (min(instant, elements.epoch).after(-_MARGIN_S), max(instant, elements.epoch).after(_MARGIN_S))
        return stated_of_orbit([elements.covariance], place, instant, span)

    words = f"{elements.kind} of {elements.object}, epoch {elements.epoch.as_text()}, SGP4{orientation.words}"
    return Orbit(
        place=place,
        words=words + left_out,
        epoch=elements.epoch,
        doubts=doubts,
        doubt=doubt,
        remedy="Take elements whose epoch is nearer to collection.center_time",
        is_turned=True,
        stated=stated,
    )


def _failure(error: int) -> str:
    return _FAILURES.get(error, "it gives no number")


def _hold_to_type(kind: str, location: str) -> None:
    if kind not in _SGP4_TYPES:
        raise PathFileError(f"{location}: the elements are of type {shown(kind)}, which SGP4 does not propagate")


def _angle(degrees: float, max_degrees: float, quantity: str, location: str) -> float:
    """Convert an angle from degrees to radians.

    Raises `PathFileError` if the angle is not from 0 to `max_degrees`.
    """
    if not 0 <= degrees <= max_degrees:
        raise PathFileError(f"{location}: {quantity} must be from 0 to {max_degrees:g} degrees (got {degrees:g})")
    return math.radians(degrees)


def _mean_motion(turns: float, location: str) -> float:
    """Convert a mean motion from revolutions per day to rad/min.

    Raises `PathFileError` if the mean motion is not between 0 and 20 revolutions per day.
    """
    if not 0 < turns < 20:
        raise PathFileError(f"{location}: mean motion must be more than 0 and less than 20 a day (got {turns:g})")
    return turns * 2 * math.pi / 1440


# ---------------------------------------------------------------------- two-line sets
_LINE_COLUMNS = 69
_DECIMAL = r"\d+\.\d*"


def read_tle(
    data: bytes, name: str, object_name: str | None, center: Instant, orientation: Orientation = UNKNOWN
) -> Orbit:
    """Read two-line element sets, and return the orbit of an object.

    The arguments and errors are the same for all readers; see `OrbitFormat.read`. A line with the name of the object
    may precede each set. Blank lines, and lines that begin with `#`, are ignored.
    """
    hold_to_size(len(data), name)
    return orbit_of(list(_entries(decoded(data, name), name)), name, object_name, center, orientation)


def element_sets(text: str, name: str) -> Iterator[Elements]:
    """Yield the element sets of a file; raises `PathFileError` at the first broken set."""
    for entry in _entries(text, name):
        if isinstance(entry, BrokenEntry):
            raise PathFileError(entry.problem)
        yield entry


def _entries(text: str, name: str) -> Iterator[Entry]:
    """Yield the element sets of a file in order, and a `BrokenEntry` in place of each broken set.

    After a broken set, reading continues at the next name or first line of a set.
    """
    name_line: tuple[int, str] | None = None
    line_1: tuple[int, str] | None = None

    def broken(number: int, problem: str, *lines: str) -> BrokenEntry:
        numbers = [object_key(line[2:7]) for line in lines]
        names = (object_key(name_line[1]),) if name_line else ()
        return BrokenEntry(problem=f"{name}:{number}: {problem}", names=(*names, *numbers))

    for number, line in enumerate(text.removeprefix("\ufeff").split("\n"), 1):
        line = line.rstrip(" \t\r")
        if not line or line.startswith("#"):
            continue
        if not line.isascii() or not line.isprintable():
            character = next(
                candidate for candidate in line if not candidate.isascii() or not candidate.isprintable()
            )
            lines = [text for text in (line_1[1] if line_1 else "", line) if text and text[0] in "12"]
            yield broken(number, f"has a character that element sets do not have (got {shown(character)})", *lines)
            name_line = line_1 = None
            continue
        if line_1 is not None and _begins(line, "2"):
            try:
                yield _from_lines(line_1, (number, line), name_line[1] if name_line else "", name)
            except PathFileError as error:
                entry = broken(number, "", line_1[1], line)
                yield BrokenEntry(problem=str(error), names=entry.names)
            name_line = line_1 = None
            continue
        if line_1 is not None:
            yield broken(number, f"must be line 2 of the set that begins in line {line_1[0]}{_got(line)}", line_1[1])
            name_line = line_1 = None
        if _begins(line, "1"):
            line_1 = (number, line)
        elif _begins(line, "2"):
            yield broken(number, "is line 2 of an element set; its line 1 must come before it", line)
            name_line = None
        else:
            if name_line is not None:
                yield broken(number, f"must be line 1 of the set that line {name_line[0]} names{_got(line)}")
            name_line = (number, shown(line.removeprefix("0 ").strip()))
    if line_1 is not None:
        yield broken(line_1[0], "line 1 of an element set has no line 2 after it", line_1[1])
    elif name_line is not None:
        problem = f"must be line 1 of an element set, or a name above one{_got(name_line[1])}"
        yield broken(name_line[0], problem)


def _got(line: str) -> str:
    return f" (got {shown(line)})"


def _begins(line: str, number: str) -> bool:
    return line[0] == number and line[1:2] in ("", " ")


def _from_lines(first: tuple[int, str], second: tuple[int, str], object_name: str, name: str) -> Elements:
    lines = {}
    for line_number, line in (first, second):
        location = f"{name}:{line_number}"
        if len(line) == _LINE_COLUMNS - 1:
            raise PathFileError(f"{location}: has 68 columns: the checksum, column {_LINE_COLUMNS}, is missing")
        if len(line) != _LINE_COLUMNS:
            raise PathFileError(f"{location}: has {len(line)} columns, a line of an element set has {_LINE_COLUMNS}")
        digits = (sum(n * line.count(str(n), 0, -1) for n in range(1, 10)) + line.count("-", 0, -1)) % 10
        if line[-1] != str(digits):
            raise PathFileError(f"{location}: the checksum is {line[-1]}, its digits give {digits}")
        lines[line[0]] = (location, line)
    (where_1, line_1), (where_2, line_2) = lines["1"], lines["2"]
    number, second_number = _catalogue_number(line_1, where_1), _catalogue_number(line_2, where_2)
    if number != second_number:
        raise PathFileError(f"{where_2}: is of object {second_number}, line 1 above it of {number}")
    _hold_to_type(line_1[62].strip(), where_1)

    def angle(start: int, end: int, max_degrees: float, quantity: str) -> float:
        """Read an angle in degrees from the columns `start` to `end` of line 2, counted from 1; returns radians."""
        return _angle(_column(line_2, where_2, start, end, quantity, _DECIMAL), max_degrees, quantity, where_2)

    return Elements(
        name=object_name,
        number=number,
        epoch=_epoch(line_1, where_1),
        mean_motion=_mean_motion(_column(line_2, where_2, 53, 63, "mean motion", _DECIMAL), where_2),
        eccentricity=_column(line_2, where_2, 27, 33, "eccentricity", r"\d{7}", "0."),
        inclination=angle(9, 16, 180, "inclination"),
        node=angle(18, 25, 360, "ascending node"),
        perigee=angle(35, 42, 360, "argument of perigee"),
        anomaly=angle(44, 51, 360, "mean anomaly"),
        drag=_drag(line_1, where_1),
        kind="two-line elements",
        where=where_1,
    )


def _column(line: str, location: str, start: int, end: int, quantity: str, form: str, prefix: str = "") -> float:
    text = line[start - 1 : end].strip()
    if not re.fullmatch(form, text, re.ASCII):
        raise PathFileError(
            f"{location}: {quantity} must be a number in columns {start} to {end} (got {shown(text)})"
        )
    return float(prefix + text)


def _catalogue_number(line: str, location: str) -> int:
    """Read a catalogue number, written as five digits, or as a letter and four digits.

    The letter A means 10, B means 11 and so on; the letters I and O are not used.
    """
    text = line[2:7].strip()
    if re.fullmatch(r"\d{1,5}", text, re.ASCII):
        return int(text)
    if re.fullmatch(r"[A-HJ-NP-Z]\d{4}", text, re.ASCII):
        return (10 + "ABCDEFGHJKLMNPQRSTUVWXYZ".index(text[0])) * 10000 + int(text[1:])
    raise PathFileError(f"{location}: the catalogue number must be in columns 3 to 7 (got {shown(text)})")


def _epoch(line: str, location: str) -> Instant:
    year = int(_column(line, location, 19, 20, "epoch year", r"\d\d"))
    year += 1900 if year >= 57 else 2000
    quantity = "epoch day"
    _column(line, location, 21, 32, quantity, r"\d{1,3}\.\d+")
    day, fraction = line[20:32].strip().split(".")
    julian_day = day_of_year(year, int(day))
    if julian_day is None:
        raise PathFileError(f"{location}: {quantity} must be from 1 to {365 + isleap(year)} (got {day}.{fraction})")
    return Instant(julian_day, float(f"0.{fraction}") * DAY_S)


def _drag(line: str, location: str) -> float:
    """Read the drag term B*: five digits after an implied decimal point, and a signed one-digit exponent."""
    text = line[53:61].strip()
    match = re.fullmatch(r"([+-]?)\.?(\d{1,5})\s?([+-]\d)", text, re.ASCII)
    if match is None:
        raise PathFileError(f"{location}: B* must be a number in columns 54 to 61 (got {shown(text)})")
    return float(f"{match[1]}0.{match[2]}e{match[3]}")


# ---------------------------------------------------------------------- orbit mean-elements messages
_VERSION_KEYWORD = "CCSDS_OMM_VERS"


@dataclass(frozen=True, kw_only=True)
class _Message:
    """An orbit mean-elements message as read from a file: its keywords and values.

    `problem` describes a fault in the format; it is empty if there is no fault. `is_complete` is set if every keyword
    that the standard prescribes must be present, including keywords with a constant value.
    """

    where: str
    leaves: Mapping[str, object]
    problem: str = ""
    is_complete: bool = False  # by the standard; CelesTrak's JSON and CSV leave out constant keywords


_ACCEPTED_VALUES = {
    "MEAN_ELEMENT_THEORY": ("SGP4", "SGP/SGP4"),  # the second in examples of CCSDS 502.0-B
    "REF_FRAME": ("TEME",),
    "TIME_SYSTEM": ("UTC",),
    "CENTER_NAME": ("EARTH",),
}


def read_omm(
    data: bytes, name: str, object_name: str | None, center: Instant, orientation: Orientation = UNKNOWN
) -> Orbit:
    """Read orbit mean-elements messages, and return the orbit of an object.

    The arguments and errors are the same for all readers; see `OrbitFormat.read`.
    """
    hold_to_size(len(data), name)
    if is_markup(data):
        records = _from_markup(data, name)
    else:
        text = decoded(data, name)
        begins = text.lstrip()
        if begins[:1] in ("[", "{"):
            records = _from_json(text, name)
        else:
            records = _from_keywords(text, name) if begins.startswith(_VERSION_KEYWORD) else _from_csv(text, name)
    return orbit_of([_entry(message, orientation) for message in records], name, object_name, center, orientation)


def _entry(message: _Message, orientation: Orientation) -> Entry:
    """Convert an orbit mean-elements message to `Elements`, or to a `BrokenEntry` if the message cannot be used."""
    try:
        if message.problem:
            raise PathFileError(message.problem)
        for key in _ACCEPTED_VALUES if message.is_complete else ():
            _value(message.leaves, key, message.where)
        elements = _from_message(message.leaves, message.where)
        covariance = _covariance(message.leaves, elements.epoch, orientation, message.where)
        return elements if covariance is None else replace(elements, covariance=covariance)
    except PathFileError as error:
        identifiers = [message.leaves.get(key) for key in ("OBJECT_NAME", "NORAD_CAT_ID")]
        names = tuple(object_key(str(value)) for value in identifiers if value not in (None, ""))
        is_empty = not message.problem and not any(value not in (None, "") for value in message.leaves.values())
        return BrokenEntry(problem=str(error), names=names, is_empty=is_empty)


def _from_markup(data: bytes, name: str) -> Iterator[_Message]:
    for message in parse_markup(data, name).all("omm"):
        leaves = {}
        for block in ("covarianceMatrix", "metadata", "meanElements", "tleParameters"):
            for element in message.all(block):
                leaves.update({leaf.name: leaf.text.strip() for leaf in element.children})
        yield _Message(where=f"{name}:{message.line}", leaves=leaves, is_complete=True)


def _from_keywords(text: str, name: str) -> Iterator[_Message]:
    """Split a text into messages; each line of the text has a keyword and a value.

    Each message begins with the keyword `CCSDS_OMM_VERS`.
    """
    leaves: dict[str, str] = {}
    first_line, problem = 0, ""
    for line_number, line in enumerate(text.split("\n"), 1):
        line = line.strip()
        if not line or line.startswith("COMMENT"):
            continue
        key, equals, value = (piece.strip() for piece in line.partition("="))
        if key == _VERSION_KEYWORD:
            if first_line:
                yield _Message(where=f"{name}:{first_line}", leaves=leaves, problem=problem, is_complete=True)
            leaves, first_line, problem = {}, line_number, ""
        elif not equals:
            problem = problem or f"{name}:{line_number}: must be a keyword, = and its value (got {shown(line)})"
        elif key in leaves:
            twice = f"{shown(key)} is there twice in the message of line {first_line}"
            problem = problem or f"{name}:{line_number}: {twice}"
        else:
            leaves[key] = value.partition("[")[0].strip()  # a unit in brackets can only be the unit of the standard
    if first_line:
        yield _Message(where=f"{name}:{first_line}", leaves=leaves, problem=problem, is_complete=True)


def _from_json(text: str, name: str) -> Iterator[_Message]:
    try:
        document = json.loads(text)
    except json.JSONDecodeError as error:
        raise PathFileError(f"{name}:{error.lineno}: is not JSON: {error.msg}") from None
    except (RecursionError, ValueError):  # brackets without end, digits without end
        raise PathFileError(f"{name}: is not JSON of orbit mean-elements messages") from None
    records = document if isinstance(document, list) else [document]
    for count, record in enumerate(records, 1):
        location = f"{name}: record {count}" if records is document else name
        if not isinstance(record, dict):
            yield _Message(where=location, leaves={}, problem=f"{location}: must have keywords and values")
            continue
        # No keyword has a list or a mapping as its value.
        leaves = {key: value for key, value in record.items() if isinstance(value, str | int | float)}
        yield _Message(where=location, leaves=leaves)


def _from_csv(text: str, name: str) -> Iterator[_Message]:
    lines = csv.reader(io.StringIO(text, newline=""))
    try:
        header = next(lines, [])
        if "NORAD_CAT_ID" not in header and "EPOCH" not in header:
            fault = "is empty" if not text.strip() else "is no orbit mean-elements message"
            raise PathFileError(
                f"{name}: {fault}; accepted: text of keywords, XML, JSON, CSV with a line of keywords"
            )
        for line in lines:
            if not line:
                continue
            location = f"{name}:{lines.line_num}"
            is_cut = len(line) != len(header)
            problem = f"{location}: has {len(line)} values, line 1 has {len(header)} keywords" if is_cut else ""
            yield _Message(where=location, leaves=dict(zip(header, line, strict=False)), problem=problem)
    except csv.Error as error:
        raise PathFileError(f"{name}:{lines.line_num}: is not CSV: {error}") from None


_COVARIANCE_KEYWORD = re.compile(r"C[XYZ](_DOT)?_[XYZ](_DOT)?", re.ASCII)


def _covariance(
    record: Mapping[str, object], epoch: Instant, orientation: Orientation, location: str
) -> EpochCovariance | None:
    """Covariance that a message states at the epoch of its elements; None if it states no covariance."""
    elements = {key: str(value).strip() for key, value in record.items() if _COVARIANCE_KEYWORD.fullmatch(key)}
    if not any(elements.values()):
        return None
    frame = str(record.get("COV_REF_FRAME") or "").strip()
    block = named_covariance({**elements, "COV_REF_FRAME": frame}, 0)
    return read_covariance(block, tai(epoch), "TEME", orientation, location)


def _value(record: Mapping[str, object], key: str, location: str) -> object:
    value = record.get(key)
    if value is None or value == "":
        raise PathFileError(f"{location}: has no {key}")
    return value


def _from_message(record: Mapping[str, object], location: str) -> Elements:
    for key, accepted in _ACCEPTED_VALUES.items():
        value = record.get(key)
        if value not in (None, "") and str(value).strip().upper() not in accepted:
            raise PathFileError(f"{location}: {key} must be {accepted[0]} (got {shown(str(value))})")
    _hold_to_type(str(record.get("EPHEMERIS_TYPE", "")).strip(), location)

    def number(key: str) -> float:
        value = _value(record, key, location)
        value_number = number_in(value)
        if value_number is None:
            raise PathFileError(f"{location}: {key} must be a number (got {shown(str(value))})")
        return value_number

    def angle(key: str, max_degrees: float) -> float:
        return _angle(number(key), max_degrees, key, location)

    catalogue = number("NORAD_CAT_ID")
    if not 0 <= catalogue <= 999_999_999 or catalogue != int(catalogue):
        raise PathFileError(
            f"{location}: NORAD_CAT_ID must be a whole number of up to nine digits"
            f" (got {shown(str(record['NORAD_CAT_ID']))})"
        )
    epoch_text = str(_value(record, "EPOCH", location))
    epoch = epoch_in(epoch_text)
    if epoch is None or not FIRST_ORBIT_DAY <= epoch.day < LAST_ORBIT_DAY:
        raise PathFileError(
            f"{location}: EPOCH must be an instant such as 2026-05-31T10:12:13.123 (got {shown(epoch_text)})"
        )
    eccentricity = number("ECCENTRICITY")
    if not 0 <= eccentricity < 1:
        raise PathFileError(f"{location}: ECCENTRICITY must be from 0 to less than 1 (got {eccentricity:g})")
    object_name = record.get("OBJECT_NAME")
    return Elements(
        name=shown(" ".join(str(object_name).split())) if object_name is not None else "",
        number=int(catalogue),
        epoch=epoch,
        mean_motion=_mean_motion(number("MEAN_MOTION"), location),
        eccentricity=eccentricity,
        inclination=angle("INCLINATION", 180),
        node=angle("RA_OF_ASC_NODE", 360),
        perigee=angle("ARG_OF_PERICENTER", 360),
        anomaly=angle("MEAN_ANOMALY", 360),
        drag=number("BSTAR"),
        kind="orbit mean elements",
        where=location,
    )
