"""Orbits from mean elements, propagated by SGP4: two-line element sets, and orbit mean-elements messages (OMM).

SGP4 places a satellite about 1 km off at the epoch of its elements, and 1 to 3 km more with each day from it
(documentation of the package sgp4; Vallado and others, Revisiting Spacetrack Report #3, AIAA 2006-6753). Constants
are those of WGS-72, which the elements are made with. Places in the true equator and mean equinox of date turn to the
Earth by the mean sidereal time of 1982, with UT1 = UTC: for a low orbit and UT1 - UTC of 56 ms this is 23 m from
where Skyfield has the satellite. Polar motion, which Skyfield too leaves out unless it is given, is up to 20 m.
"""

import csv
import io
import json
import math
import re
from calendar import isleap
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from bisar_budget.faults import shown
from bisar_budget.geometry import Vector
from bisar_budget.paths.earth import INSTALL, from_teme
from bisar_budget.paths.flight import Orbit, PathDoubt, PathFileError, Sample, interpolate
from bisar_budget.paths.instant import DAY, Instant, day_of_year
from bisar_budget.paths.messages import (
    EARLIEST,
    LATEST,
    decoded,
    epoch_in,
    hold_to_size,
    number_in,
    parse_markup,
)

_DAY_OF_1950 = 33281  # modified Julian day of 1949-12-31, from which SGP4 counts days
_NODES, _STEP_S = 8, 30.0
_FRESH_DAYS = 7.0
_FARTHEST_DAYS = 36525.0  # SGP4 steps through the time to a resonant orbit
_AT_EPOCH_KM, _PER_DAY_KM = 1, (1, 3)
_USUAL_PER_DAY_KM = 2.0  # middle of what the sources say
_LISTED = 10  # objects that an error names
_PLAIN_TYPES = ("", "0", "2")  # CCSDS 502.0-B-3, EPHEMERIS_TYPE; 0 is SGP4 in all that is distributed, 4 is SGP4-XP
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
    """Mean elements of an object at an epoch, as SGP4 takes them: angles in rad, mean motion in rad/min."""

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

    @property
    def object(self) -> str:
        """Name and catalogue number."""
        return f"{self.name} ({self.number})" if self.name else str(self.number)


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
        raise PathFileError(f"{elements.where}: needs the package sgp4: {INSTALL}") from None
    satellite = Satrec()
    epoch = elements.epoch.day - _DAY_OF_1950 + elements.epoch.seconds / DAY
    # The derivatives of the mean motion are no part of SGP4, and the number is ours to keep.
    shape = (elements.eccentricity, elements.perigee, elements.inclination, elements.anomaly)
    satellite.sgp4init(WGS72, "i", 0, epoch, elements.drag, 0.0, 0.0, *shape, elements.mean_motion, elements.node)
    if satellite.error:
        raise PathFileError(f"{elements.where}: SGP4 refuses {elements.object}: {_failure(satellite.error)}")

    def place(instant: Instant) -> Vector:
        elapsed = instant.since(elements.epoch)
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
        time = Instant(day, 0.0).after(count * _STEP_S)
        return Sample(time, place(time), (0.0, 0.0, 0.0))

    def between(instant: Instant) -> Vector:
        count = math.floor(instant.seconds / _STEP_S)
        try:
            near = [node(instant.day, count + n) for n in range(1 - _NODES // 2, 1 + _NODES // 2)]
        except PathFileError:  # within minutes of the end of an orbit
            return place(instant)
        return interpolate(near, instant, _NODES, False)

    return between


def _orbit_of(elements: Elements, name: str) -> Orbit:
    """Orbit of one element set."""
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

    return Orbit(
        place=lambda instant: from_teme(inertial(instant), instant),
        words=f"{elements.kind} of {elements.object}, epoch {elements.epoch.as_text()}, SGP4",
        epoch=elements.epoch,
        doubts=doubts,
        doubt=doubt,
        remedy="Take elements whose epoch is nearer to collection.center_time",
    )


def _failure(error: int) -> str:
    return _FAILURES.get(error, "it gives no number")


def _chosen(found: Sequence[Elements], name: str, wanted: str | None, center: Instant) -> Elements:
    """The elements of one object whose epoch is nearest; the last in the file of two that are as near."""
    if not found:
        raise PathFileError(f"{name}: has no element set")
    if wanted is not None:
        key = _key(wanted)
        ours = [one for one in found if key in (_key(one.name), str(one.number))]
        if not ours:
            raise PathFileError(f"{name}: has no object {shown(wanted)}; it has {_listed(found)}")
        found = ours
    if len({one.number for one in found}) > 1:
        said = "objects" if wanted is None else "objects of that name"
        raise PathFileError(
            f"{name}: has {len({one.number for one in found})} {said}: {_listed(found)}; choose one"
            f" by its {'name or number' if wanted is None else 'number'}"
        )
    return min(reversed(found), key=lambda one: abs(center.since(one.epoch)))


def _key(text: str) -> str:
    """A name or number as it is compared: neither case nor spaces, and a number without its leading zeros."""
    text = " ".join(text.split()).casefold()
    return text.lstrip("0") or "0" if text.isdecimal() and text.isascii() else text


def _listed(found: Sequence[Elements]) -> str:
    names = list({one.number: one.object for one in found}.values())
    return ", ".join(names[:_LISTED]) + (f" and {len(names) - _LISTED} more" if len(names) > _LISTED else "")


def _angle_of(degrees: float, most: float, called: str, where: str) -> float:
    """An angle of a file, in rad, which must be within its range."""
    if not 0 <= degrees <= most:
        raise PathFileError(f"{where}: {called} must be from 0 to {most:g} degrees (got {degrees:g})")
    return math.radians(degrees)


def _motion_of(turns: float, where: str) -> float:
    """From revolutions a day, to rad/min."""
    if not 0 < turns < 20:
        raise PathFileError(f"{where}: mean motion must be more than 0 and less than 20 a day (got {turns:g})")
    return turns * 2 * math.pi / 1440


# ---------------------------------------------------------------------- two-line element sets
_COLUMNS = 69
_DECIMAL = r"\d+\.\d*"


def read_tle(text: str, name: str, wanted: str | None, center: Instant) -> Orbit:
    """Orbit from two-line element sets, with or without a line of the name above each.

    Parameters
    ----------
    text : str
        A whole file; blank lines, and those that begin with `#`, are no part of it.
    name : str
        What messages call the file.
    wanted : str, optional
        Name or catalogue number of the object.
    center : Instant
        The element set whose epoch is nearest to it is taken, for all instants.

    Raises
    ------
    PathFileError
        The text is not what the format asks for, or does not say which object; SGP4 is missing or refuses.

    Notes
    -----
    Format: Hoots & Roehrich, Spacetrack Report No. 3, 1980, section 12, and Space-Track's alpha-5 catalogue numbers.
    """
    hold_to_size(len(text), name)
    return _orbit_of(_chosen(list(element_sets(text, name)), name, wanted, center), name)


def element_sets(text: str, name: str) -> Iterator[Elements]:
    """The element sets of a file."""
    above: tuple[int, str] | None = None
    first: tuple[int, str] | None = None
    for at, line in enumerate(text.removeprefix("\ufeff").split("\n"), 1):
        line = line.rstrip(" \t\r")
        if not line or line.startswith("#"):
            continue
        where = f"{name}:{at}"
        if not line.isascii() or not line.isprintable():
            wrong = next(one for one in line if not one.isascii() or not one.isprintable())
            raise PathFileError(f"{where}: has a character that element sets do not have (got {shown(wrong)})")
        if first is not None:
            if not _begins(line, "2"):
                raise PathFileError(f"{where}: must be line 2 of the set that begins in line {first[0]}{_got(line)}")
            yield _from_lines(first, (at, line), above[1] if above else "", name)
            above = first = None
        elif _begins(line, "1"):
            first = (at, line)
        elif _begins(line, "2"):
            raise PathFileError(f"{where}: is line 2 of an element set; its line 1 must come before it")
        elif above is not None:
            raise PathFileError(f"{where}: must be line 1 of the set that line {above[0]} names{_got(line)}")
        else:
            above = (at, shown(line.removeprefix("0 ").strip()))
    if first is not None:
        raise PathFileError(f"{name}:{first[0]}: line 1 of an element set has no line 2 after it")
    if above is not None:
        raise PathFileError(
            f"{name}:{above[0]}: must be line 1 of an element set, or a name above one{_got(above[1])}"
        )


def _got(line: str) -> str:
    return f" (got {shown(line)})"


def _begins(line: str, number: str) -> bool:
    return line[0] == number and line[1:2] in ("", " ")


def _from_lines(first: tuple[int, str], second: tuple[int, str], object_name: str, name: str) -> Elements:
    lines = {}
    for at, line in (first, second):
        where = f"{name}:{at}"
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
    if line_1[62].strip() not in _PLAIN_TYPES:
        raise PathFileError(f"{where_1}: the elements are of type {line_1[62]}, which SGP4 does not propagate")

    def angle(start: int, end: int, most: float, called: str) -> float:
        """Angle in columns of line 2, counted from 1."""
        return _angle_of(_column(line_2, where_2, start, end, called, _DECIMAL), most, called, where_2)

    return Elements(
        name=object_name,
        number=number,
        epoch=_epoch(line_1, where_1),
        mean_motion=_motion_of(_column(line_2, where_2, 53, 63, "mean motion", _DECIMAL), where_2),
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
_Records = Iterator[tuple[str, Mapping[str, Any]]]
_MANDATORY = {
    "MEAN_ELEMENT_THEORY": ("SGP4", "SGP/SGP4"),  # the second in examples of CCSDS 502.0-B
    "REF_FRAME": ("TEME",),
    "TIME_SYSTEM": ("UTC",),
    "CENTER_NAME": ("EARTH",),
}


def read_omm(data: bytes, name: str, wanted: str | None, center: Instant) -> Orbit:
    """Orbit from orbit mean-elements messages (CCSDS 502.0-B) as XML, JSON or CSV; arguments as of `read_tle`.

    JSON and CSV have the message's keywords. CelesTrak leaves those out there that can have one value only;
    Space-Track writes all of them.
    """
    hold_to_size(len(data), name)
    if data.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] == b"<":
        records = _from_markup(data, name)
    else:
        text = decoded(data, name)
        records = _from_json(text, name) if text.lstrip()[:1] in ("[", "{") else _from_csv(text, name)
    found = [_from_message(record, where) for where, record in records]
    return _orbit_of(_chosen(found, name, wanted, center), name)


def _from_markup(data: bytes, name: str) -> _Records:
    for message in parse_markup(data, name).all("omm"):
        leaves = {}
        for block in ("metadata", "meanElements", "tleParameters"):
            for found in message.all(block):
                leaves.update({one.name: one.text.strip() for one in found.children})
        where = f"{name}:{message.line}"
        for key in _MANDATORY:
            _value(leaves, key, where)
        yield where, leaves


def _from_json(text: str, name: str) -> _Records:
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
            raise PathFileError(f"{where}: must have keywords and values")
        # A list or a mapping is no value of any keyword.
        yield where, {key: value for key, value in record.items() if isinstance(value, str | int | float)}


def _from_csv(text: str, name: str) -> _Records:
    lines = csv.reader(io.StringIO(text, newline=""))
    try:
        header = next(lines, [])
        if "NORAD_CAT_ID" not in header and "EPOCH" not in header:
            said = "is empty" if not text.strip() else "is no orbit mean-elements message"
            raise PathFileError(f"{name}: {said}; accepted: XML, JSON, CSV with a line of keywords")
        for line in lines:
            if not line:
                continue
            where = f"{name}:{lines.line_num}"
            if len(line) != len(header):
                raise PathFileError(f"{where}: has {len(line)} values, line 1 has {len(header)} keywords")
            yield where, dict(zip(header, line, strict=True))
    except csv.Error as error:
        raise PathFileError(f"{name}:{lines.line_num}: is not CSV: {error}") from None


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
    kind = str(record.get("EPHEMERIS_TYPE", "")).strip()
    if kind not in (*_PLAIN_TYPES, "SGP4"):
        raise PathFileError(f"{where}: the elements are of type {shown(kind)}, which SGP4 does not propagate")

    def number(key: str) -> float:
        value = _value(record, key, where)
        found = number_in(value)
        if found is None:
            raise PathFileError(f"{where}: {key} must be a number (got {shown(str(value))})")
        return found

    def angle(key: str, most: float) -> float:
        return _angle_of(number(key), most, key, where)

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
        mean_motion=_motion_of(number("MEAN_MOTION"), where),
        eccentricity=eccentricity,
        inclination=angle("INCLINATION", 180),
        node=angle("RA_OF_ASC_NODE", 360),
        perigee=angle("ARG_OF_PERICENTER", 360),
        anomaly=angle("MEAN_ANOMALY", 360),
        drag=number("BSTAR"),
        kind="orbit mean elements",
        where=where,
    )
