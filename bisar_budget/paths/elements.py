"""Mean elements of orbits: two-line sets and orbit mean-elements messages (OMM), propagated by SGP4.

SGP4 places a satellite about 1 km off at the epoch of its elements, and 1 to 3 km more with each day from it
(documentation of the package sgp4; Vallado and others, Revisiting Spacetrack Report #3, AIAA 2006-6753). Constants
are those of WGS-72, which the elements are made with. Places in the true equator and mean equinox of date turn to the
Earth by the mean sidereal time of 1982.

Two-line sets are those of Hoots & Roehrich, Spacetrack Report No. 3, 1980, section 12, with Space-Track's alpha-5
catalogue numbers. Messages are those of CCSDS 502.0-B, as text of keywords and values, as XML, JSON or CSV. JSON and
CSV have the message's keywords. CelesTrak leaves those out there that can have one value only; Space-Track writes all
of them.
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
from typing import Any

from bisar_budget.extras import install_command
from bisar_budget.faults import shown
from bisar_budget.geometry import Vector
from bisar_budget.paths.accuracy import EpochCovariance, StatedAccuracy, stated_of_orbit
from bisar_budget.paths.flight import Orbit, PathDoubt, PathFileError, Sample, interpolate
from bisar_budget.paths.instant import DAY, Instant, day_of_year, later, tai, tai_less_utc
from bisar_budget.paths.messages import (
    EARLIEST,
    LATEST,
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

# CCSDS 502.0-B-3, EPHEMERIS_TYPE; 0 is SGP4 in all that is distributed, 4 is SGP4-XP. Two-line sets have a digit.
_PROPAGATED = ("", "0", "2", "SGP4")
_DAY_OF_1950 = 33281  # modified Julian day of 1949-12-31, from which SGP4 counts days
_NODES, _STEP_S = 8, 30.0
_FRESH_DAYS = 7.0
_AROUND_S = 60.0  # beyond the epoch and the aperture, where velocities are taken from places
_FARTHEST_DAYS = 36525.0  # SGP4 steps through the time to a resonant orbit
_AT_EPOCH_KM, _PER_DAY_KM = 1, (1, 3)
_USUAL_PER_DAY_KM = 2.0  # middle of what the sources say
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
    """Mean elements of an object at an epoch, as SGP4 takes them: angles in rad, mean motion in rad/min.

    `covariance` is that of position and velocity at the epoch, where the message states one.
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
    kind: str  # what they were read from
    where: str  # file and line or record
    covariance: EpochCovariance | None = None

    @property
    def object(self) -> str:
        """Name and catalogue number."""
        return f"{self.name} ({self.number})" if self.name else str(self.number)

    @property
    def names(self) -> tuple[str, ...]:
        """Name and catalogue number, as they are compared."""
        return (object_key(self.name), str(self.number))


@dataclass(frozen=True, kw_only=True)
class BrokenEntry:
    """An entry of a catalogue that cannot be used: why, and the names that tell whose it is, as far as it says."""

    problem: str
    names: tuple[str, ...] = ()
    is_empty: bool = False  # it says nothing of anybody


Entry = Elements | BrokenEntry


def teme(elements: Elements) -> Callable[[Instant], Vector]:
    """Return a function that places an object in the true equator and mean equinox of date, by SGP4. [m]

    Raises
    ------
    PathFileError
        The package sgp4 is not installed, or refuses the elements. What is returned raises it without a prefix where
        SGP4 has no place.
    """
    try:
        from sgp4.api import WGS72, Satrec
    except ImportError:
        raise PathFileError(f"{elements.where}: needs the package sgp4: {install_command('orbits')}") from None
    satellite = Satrec()
    epoch = elements.epoch.day - _DAY_OF_1950 + elements.epoch.seconds / DAY
    # The derivatives of the mean motion are no part of SGP4, and the number is ours to keep.
    shape = (elements.eccentricity, elements.perigee, elements.inclination, elements.anomaly)
    satellite.sgp4init(WGS72, "i", 0, epoch, elements.drag, 0.0, 0.0, *shape, elements.mean_motion, elements.node)
    if satellite.error:
        raise PathFileError(f"{elements.where}: SGP4 refuses {elements.object}: {_failure(satellite.error)}")

    def place(instant: Instant) -> Vector:
        elapsed = instant.since(elements.epoch) + tai_less_utc(instant.day) - tai_less_utc(elements.epoch.day)
        if abs(elapsed) > _FARTHEST_DAYS * DAY:
            raise PathFileError(
                f"{elements.where}: the elements of {elements.object} are of {elements.epoch.as_text()}, more than a"
                " century from the aperture"
            )
        # A Julian date of two numbers would be as exact, but its epoch passes through a calendar.
        error, position, _ = satellite.sgp4_tsince(elapsed / 60)
        if error or not all(math.isfinite(one) for one in position):
            raise PathFileError(
                f"{elements.where}: SGP4 has no place of {elements.object} at {instant.as_text()}: {_failure(error)}"
            )
        x, y, z = position
        return (1000 * x, 1000 * y, 1000 * z)

    return place


def smooth(place: Callable[[Instant], Vector]) -> Callable[[Instant], Vector]:
    """The same places without the steps of their rounding, which grow with the age of the elements.

    SGP4 counts minutes and angles from the epoch: a week from it a place is rounded to 2e-6 m, and 100 days from it
    to 4e-5 m, which a polynomial of slow time takes for bends of the path. Lagrange's polynomial through eight places
    30 s apart leaves 1e-8 m in a low orbit, by its remainder. It also rounds off the millimetres by which SGP4 jumps
    every half day in resonant orbits.
    """

    @lru_cache(maxsize=64)
    def node(day: int, count: int) -> Sample:
        midnight = Instant(day, 0.0)  # the seconds of its day run on beside it, whatever leaps
        return Sample(midnight.after(count * _STEP_S), place(later(midnight, count * _STEP_S)), (0.0, 0.0, 0.0))

    def between(instant: Instant) -> Vector:
        count = math.floor(instant.seconds / _STEP_S)
        try:
            near = [node(instant.day, count + n) for n in range(1 - _NODES // 2, 1 + _NODES // 2)]
        except PathFileError:  # within minutes of the end of an orbit
            return place(instant)
        return interpolate(near, instant, _NODES, False)

    return between


def orbit_of(
    entries: Sequence[Entry], name: str, wanted: str | None, center: Instant, orientation: Orientation
) -> Orbit:
    """Orbit of one object, by the elements whose epoch is nearest; of two that are as near the last of the file.

    All but the entries of a file are arguments of its reader; `wanted` is a name or a catalogue number. Entries of
    other objects that are broken are left out, and counted in the words of the orbit. A `PathFileError` says that
    there are no elements, or those of several objects; that an entry of the object is broken, or one of nobody knows
    whom where no object is named; that SGP4 is missing or refuses.
    """
    found = [entry for entry in entries if isinstance(entry, Elements)]
    broken = [entry for entry in entries if isinstance(entry, BrokenEntry)]
    for entry in broken:
        is_wanted = wanted is None and not (entry.is_empty and found)
        if is_wanted or not found or (wanted is not None and object_key(wanted) in entry.names):
            raise PathFileError(entry.problem)
    if not found:
        raise PathFileError(f"{name}: has no element set")
    elements = min(reversed(one_object(found, name, wanted, "number")), key=lambda one: abs(center.since(one.epoch)))
    for entry in broken:
        if elements.names[-1] in entry.names:
            raise PathFileError(entry.problem)
    left_out = f", {len(broken)} of {len(entries)} entries left out ({broken[0].problem})" if broken else ""
    inertial = smooth(teme(elements))
    inertial(elements.epoch)  # what SGP4 refuses is known before anybody asks

    def doubt(instant: Instant) -> PathDoubt:
        days = abs(instant.since(elements.epoch)) / DAY
        words = f"elements {days:.3g} days from their epoch: {_AT_EPOCH_KM} km there, {_USUAL_PER_DAY_KM:g} km a day"
        return PathDoubt(1e3 * (_AT_EPOCH_KM + _USUAL_PER_DAY_KM * days), words)

    def doubts(instant: Instant) -> Sequence[str]:
        days = instant.since(elements.epoch) / DAY
        if abs(days) <= _FRESH_DAYS:
            return ()
        least, most = (_AT_EPOCH_KM + abs(days) * one for one in _PER_DAY_KM)
        return (
            f"{name}: the elements of {elements.object} are of {elements.epoch.as_text()}, {abs(days):.1f} days"
            f" {'before' if days > 0 else 'after'} the aperture; SGP4 may place it {least:.0f} to {most:.0f} km off",
        )

    def place(instant: Instant) -> Vector:
        return from_teme(inertial(instant), instant, orientation)

    def stated(instant: Instant) -> StatedAccuracy | None:
        if elements.covariance is None:
            return None
        span = (min(instant, elements.epoch).after(-_AROUND_S), max(instant, elements.epoch).after(_AROUND_S))
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


def _hold_to_type(kind: str, where: str) -> None:
    if kind not in _PROPAGATED:
        raise PathFileError(f"{where}: the elements are of type {shown(kind)}, which SGP4 does not propagate")


def _angle(degrees: float, most: float, called: str, where: str) -> float:
    """An angle of a file, in rad, which must be within its range."""
    if not 0 <= degrees <= most:
        raise PathFileError(f"{where}: {called} must be from 0 to {most:g} degrees (got {degrees:g})")
    return math.radians(degrees)


def _mean_motion(turns: float, where: str) -> float:
    """From revolutions a day, to rad/min."""
    if not 0 < turns < 20:
        raise PathFileError(f"{where}: mean motion must be more than 0 and less than 20 a day (got {turns:g})")
    return turns * 2 * math.pi / 1440


# ---------------------------------------------------------------------- two-line sets
_COLUMNS = 69
_DECIMAL = r"\d+\.\d*"


def read_tle(
    data: bytes, name: str, wanted: str | None, center: Instant, orientation: Orientation = UNKNOWN
) -> Orbit:
    """Orbit from two-line element sets, as every reader of `ORBIT_FORMATS` gives it.

    A line of the name may stand above each. Blank lines, and those that begin with `#`, are no part of the file.
    """
    hold_to_size(len(data), name)
    return orbit_of(list(_entries(decoded(data, name), name)), name, wanted, center, orientation)


def element_sets(text: str, name: str) -> Iterator[Elements]:
    """The element sets of a file; a `PathFileError` says what is wrong with the first that is broken."""
    for entry in _entries(text, name):
        if isinstance(entry, BrokenEntry):
            raise PathFileError(entry.problem)
        yield entry


def _entries(text: str, name: str) -> Iterator[Entry]:
    """The element sets of a file, in its order; after a broken one reading goes on with the next line of its form."""
    above: tuple[int, str] | None = None
    first: tuple[int, str] | None = None

    def broken(at: int, problem: str, *lines: str) -> BrokenEntry:
        numbers = [object_key(line[2:7]) for line in lines]
        names = (object_key(above[1]),) if above else ()
        return BrokenEntry(problem=f"{name}:{at}: {problem}", names=(*names, *numbers))

    for at, line in enumerate(text.removeprefix("\ufeff").split("\n"), 1):
        line = line.rstrip(" \t\r")
        if not line or line.startswith("#"):
            continue
        if not line.isascii() or not line.isprintable():
            wrong = next(one for one in line if not one.isascii() or not one.isprintable())
            lines = [one for one in (first[1] if first else "", line) if one and one[0] in "12"]
            yield broken(at, f"has a character that element sets do not have (got {shown(wrong)})", *lines)
            above = first = None
            continue
        if first is not None and _begins(line, "2"):
            try:
                yield _from_lines(first, (at, line), above[1] if above else "", name)
            except PathFileError as error:
                entry = broken(at, "", first[1], line)
                yield BrokenEntry(problem=str(error), names=entry.names)
            above = first = None
            continue
        if first is not None:
            yield broken(at, f"must be line 2 of the set that begins in line {first[0]}{_got(line)}", first[1])
            above = first = None
        if _begins(line, "1"):
            first = (at, line)
        elif _begins(line, "2"):
            yield broken(at, "is line 2 of an element set; its line 1 must come before it", line)
            above = None
        else:
            if above is not None:
                yield broken(at, f"must be line 1 of the set that line {above[0]} names{_got(line)}")
            above = (at, shown(line.removeprefix("0 ").strip()))
    if first is not None:
        yield broken(first[0], "line 1 of an element set has no line 2 after it", first[1])
    elif above is not None:
        problem = f"must be line 1 of an element set, or a name above one{_got(above[1])}"
        yield broken(above[0], problem)


def _got(line: str) -> str:
    return f" (got {shown(line)})"


def _begins(line: str, number: str) -> bool:
    return line[0] == number and line[1:2] in ("", " ")


def _from_lines(first: tuple[int, str], second: tuple[int, str], object_name: str, name: str) -> Elements:
    lines = {}
    for at, line in (first, second):
        where = f"{name}:{at}"
        if len(line) == _COLUMNS - 1:
            raise PathFileError(f"{where}: has 68 columns: the checksum, column {_COLUMNS}, is missing")
        if len(line) != _COLUMNS:
            raise PathFileError(f"{where}: has {len(line)} columns, a line of an element set has {_COLUMNS}")
        digits = (sum(n * line.count(str(n), 0, -1) for n in range(1, 10)) + line.count("-", 0, -1)) % 10
        if line[-1] != str(digits):
            raise PathFileError(f"{where}: the checksum is {line[-1]}, its digits give {digits}")
        lines[line[0]] = (where, line)
    (where_1, line_1), (where_2, line_2) = lines["1"], lines["2"]
    number, again = _catalogue_number(line_1, where_1), _catalogue_number(line_2, where_2)
    if number != again:
        raise PathFileError(f"{where_2}: is of object {again}, line 1 above it of {number}")
    _hold_to_type(line_1[62].strip(), where_1)

    def angle(start: int, end: int, most: float, called: str) -> float:
        """Angle in columns of line 2, counted from 1."""
        return _angle(_column(line_2, where_2, start, end, called, _DECIMAL), most, called, where_2)

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


def _column(line: str, where: str, start: int, end: int, called: str, form: str, before: str = "") -> float:
    text = line[start - 1 : end].strip()
    if not re.fullmatch(form, text, re.ASCII):
        raise PathFileError(f"{where}: {called} must be a number in columns {start} to {end} (got {shown(text)})")
    return float(before + text)


def _catalogue_number(line: str, where: str) -> int:
    """Five digits, or a letter for ten thousands from 10 on, without I and O, and four digits."""
    text = line[2:7].strip()
    if re.fullmatch(r"\d{1,5}", text, re.ASCII):
        return int(text)
    if re.fullmatch(r"[A-HJ-NP-Z]\d{4}", text, re.ASCII):
        return (10 + "ABCDEFGHJKLMNPQRSTUVWXYZ".index(text[0])) * 10000 + int(text[1:])
    raise PathFileError(f"{where}: the catalogue number must be in columns 3 to 7 (got {shown(text)})")


def _epoch(line: str, where: str) -> Instant:
    year = int(_column(line, where, 19, 20, "epoch year", r"\d\d"))
    year += 1900 if year >= 57 else 2000
    called = "epoch day"
    _column(line, where, 21, 32, called, r"\d{1,3}\.\d+")
    day, fraction = line[20:32].strip().split(".")
    found = day_of_year(year, int(day))
    if found is None:
        raise PathFileError(f"{where}: {called} must be from 1 to {365 + isleap(year)} (got {day}.{fraction})")
    return Instant(found, float(f"0.{fraction}") * DAY)


def _drag(line: str, where: str) -> float:
    """B*: five digits behind a decimal point that is not written, and an exponent of a sign and a digit."""
    text = line[53:61].strip()
    match = re.fullmatch(r"([+-]?)\.?(\d{1,5})\s?([+-]\d)", text, re.ASCII)
    if match is None:
        raise PathFileError(f"{where}: B* must be a number in columns 54 to 61 (got {shown(text)})")
    return float(f"{match[1]}0.{match[2]}e{match[3]}")


# ---------------------------------------------------------------------- orbit mean-elements messages
_VERSION = "CCSDS_OMM_VERS"


@dataclass(frozen=True, kw_only=True)
class _Message:
    """Keywords and values of a message; what is wrong with its form; and whether it may leave nothing out."""

    where: str
    leaves: Mapping[str, Any]
    problem: str = ""
    is_complete: bool = False  # as the standard has it; JSON and CSV of CelesTrak leave out what has one value only


_MANDATORY = {
    "MEAN_ELEMENT_THEORY": ("SGP4", "SGP/SGP4"),  # the second in examples of CCSDS 502.0-B
    "REF_FRAME": ("TEME",),
    "TIME_SYSTEM": ("UTC",),
    "CENTER_NAME": ("EARTH",),
}


def read_omm(
    data: bytes, name: str, wanted: str | None, center: Instant, orientation: Orientation = UNKNOWN
) -> Orbit:
    """Orbit from orbit mean-elements messages, as every reader of `ORBIT_FORMATS` gives it."""
    hold_to_size(len(data), name)
    if is_markup(data):
        records = _from_markup(data, name)
    else:
        text = decoded(data, name)
        begins = text.lstrip()
        if begins[:1] in ("[", "{"):
            records = _from_json(text, name)
        else:
            records = _from_keywords(text, name) if begins.startswith(_VERSION) else _from_csv(text, name)
    return orbit_of([_entry(message, orientation) for message in records], name, wanted, center, orientation)


def _entry(message: _Message, orientation: Orientation) -> Entry:
    """Elements of a message, or what is wrong with it."""
    try:
        if message.problem:
            raise PathFileError(message.problem)
        for key in _MANDATORY if message.is_complete else ():
            _value(message.leaves, key, message.where)
        elements = _from_message(message.leaves, message.where)
        covariance = _covariance(message.leaves, elements.epoch, orientation, message.where)
        return elements if covariance is None else replace(elements, covariance=covariance)
    except PathFileError as error:
        stated = [message.leaves.get(key) for key in ("OBJECT_NAME", "NORAD_CAT_ID")]
        names = tuple(object_key(str(value)) for value in stated if value not in (None, ""))
        is_empty = not message.problem and not any(value not in (None, "") for value in message.leaves.values())
        return BrokenEntry(problem=str(error), names=names, is_empty=is_empty)


def _from_markup(data: bytes, name: str) -> Iterator[_Message]:
    for message in parse_markup(data, name).all("omm"):
        leaves = {}
        for block in ("covarianceMatrix", "metadata", "meanElements", "tleParameters"):
            for found in message.all(block):
                leaves.update({one.name: one.text.strip() for one in found.children})
        yield _Message(where=f"{name}:{message.line}", leaves=leaves, is_complete=True)


def _from_keywords(text: str, name: str) -> Iterator[_Message]:
    """Messages of a text that has a keyword and a value in each line; each begins with its version."""
    leaves: dict[str, str] = {}
    began, problem = 0, ""
    for at, line in enumerate(text.split("\n"), 1):
        line = line.strip()
        if not line or line.startswith("COMMENT"):
            continue
        key, equals, value = (part.strip() for part in line.partition("="))
        if key == _VERSION:
            if began:
                yield _Message(where=f"{name}:{began}", leaves=leaves, problem=problem, is_complete=True)
            leaves, began, problem = {}, at, ""
        elif not equals:
            problem = problem or f"{name}:{at}: must be a keyword, = and its value (got {shown(line)})"
        elif key in leaves:
            problem = problem or f"{name}:{at}: {shown(key)} is there twice in the message of line {began}"
        else:
            leaves[key] = value.partition("[")[0].strip()  # a unit, in brackets, is the standard's own
    if began:
        yield _Message(where=f"{name}:{began}", leaves=leaves, problem=problem, is_complete=True)


def _from_json(text: str, name: str) -> Iterator[_Message]:
    try:
        found = json.loads(text)
    except json.JSONDecodeError as error:
        raise PathFileError(f"{name}:{error.lineno}: is not JSON: {error.msg}") from None
    except (RecursionError, ValueError):  # brackets without end, digits without end
        raise PathFileError(f"{name}: is not JSON of orbit mean-elements messages") from None
    records = found if isinstance(found, list) else [found]
    for count, record in enumerate(records, 1):
        where = f"{name}: record {count}" if records is found else name
        if not isinstance(record, dict):
            yield _Message(where=where, leaves={}, problem=f"{where}: must have keywords and values")
            continue
        # A list or a mapping is no value of any keyword.
        leaves = {key: value for key, value in record.items() if isinstance(value, str | int | float)}
        yield _Message(where=where, leaves=leaves)


def _from_csv(text: str, name: str) -> Iterator[_Message]:
    lines = csv.reader(io.StringIO(text, newline=""))
    try:
        header = next(lines, [])
        if "NORAD_CAT_ID" not in header and "EPOCH" not in header:
            said = "is empty" if not text.strip() else "is no orbit mean-elements message"
            raise PathFileError(f"{name}: {said}; accepted: text of keywords, XML, JSON, CSV with a line of keywords")
        for line in lines:
            if not line:
                continue
            where = f"{name}:{lines.line_num}"
            is_cut = len(line) != len(header)
            problem = f"{where}: has {len(line)} values, line 1 has {len(header)} keywords" if is_cut else ""
            yield _Message(where=where, leaves=dict(zip(header, line, strict=False)), problem=problem)
    except csv.Error as error:
        raise PathFileError(f"{name}:{lines.line_num}: is not CSV: {error}") from None


_COVARIANCE = re.compile(r"C[XYZ](_DOT)?_[XYZ](_DOT)?", re.ASCII)


def _covariance(
    record: Mapping[str, Any], epoch: Instant, orientation: Orientation, where: str
) -> EpochCovariance | None:
    """The covariance that a message states at the epoch of its elements; None of one without."""
    stated = {key: str(value).strip() for key, value in record.items() if _COVARIANCE.fullmatch(key)}
    if not any(stated.values()):
        return None
    frame = str(record.get("COV_REF_FRAME") or "").strip()
    block = named_covariance({**stated, "COV_REF_FRAME": frame}, 0)
    return read_covariance(block, tai(epoch), "TEME", orientation, where)


def _value(record: Mapping[str, Any], key: str, where: str) -> Any:
    value = record.get(key)
    if value is None or value == "":
        raise PathFileError(f"{where}: has no {key}")
    return value


def _from_message(record: Mapping[str, Any], where: str) -> Elements:
    for key, accepted in _MANDATORY.items():
        value = record.get(key)
        if value not in (None, "") and str(value).strip().upper() not in accepted:
            raise PathFileError(f"{where}: {key} must be {accepted[0]} (got {shown(str(value))})")
    _hold_to_type(str(record.get("EPHEMERIS_TYPE", "")).strip(), where)

    def number(key: str) -> float:
        value = _value(record, key, where)
        found = number_in(value)
        if found is None:
            raise PathFileError(f"{where}: {key} must be a number (got {shown(str(value))})")
        return found

    def angle(key: str, most: float) -> float:
        return _angle(number(key), most, key, where)

    catalogue = number("NORAD_CAT_ID")
    if not 0 <= catalogue <= 999_999_999 or catalogue != int(catalogue):
        raise PathFileError(
            f"{where}: NORAD_CAT_ID must be a whole number of up to nine digits"
            f" (got {shown(str(record['NORAD_CAT_ID']))})"
        )
    written = str(_value(record, "EPOCH", where))
    epoch = epoch_in(written)
    if epoch is None or not EARLIEST <= epoch.day < LATEST:
        raise PathFileError(
            f"{where}: EPOCH must be an instant such as 2026-05-31T10:12:13.123 (got {shown(written)})"
        )
    eccentricity = number("ECCENTRICITY")
    if not 0 <= eccentricity < 1:
        raise PathFileError(f"{where}: ECCENTRICITY must be from 0 to less than 1 (got {eccentricity:g})")
    object_name = record.get("OBJECT_NAME")
    return Elements(
        name=shown(" ".join(str(object_name).split())) if object_name is not None else "",
        number=int(catalogue),
        epoch=epoch,
        mean_motion=_mean_motion(number("MEAN_MOTION"), where),
        eccentricity=eccentricity,
        inclination=angle("INCLINATION", 180),
        node=angle("RA_OF_ASC_NODE", 360),
        perigee=angle("ARG_OF_PERICENTER", 360),
        anomaly=angle("MEAN_ANOMALY", 360),
        drag=number("BSTAR"),
        kind="orbit mean elements",
        where=where,
    )
