"""Two-line element sets."""

import re
from collections.abc import Iterator

from bisar_budget.faults import shown
from bisar_budget.paths.elements import PLAIN_TYPES, Elements, angle_of, chosen, motion_of, orbit_of
from bisar_budget.paths.fields import days_of_year, hold_to_size
from bisar_budget.paths.flight import Orbit, PathFileError
from bisar_budget.paths.instant import DAY, Instant, parse_instant

_COLUMNS = 69


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
    return orbit_of(chosen(list(element_sets(text, name)), name, wanted, center), name)


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
    if line_1[62].strip() not in PLAIN_TYPES:
        raise PathFileError(f"{where_1}: the elements are of type {line_1[62]}, which SGP4 does not propagate")

    def field(start: int, end: int, called: str, form: str, before: str = "") -> float:
        """Number in columns of line 2, counted from 1."""
        return _column(line_2, where_2, start, end, called, form, before)

    return Elements(
        name=object_name,
        number=number,
        epoch=_epoch(line_1, where_1),
        mean_motion=motion_of(field(53, 63, "mean motion", r"\d+\.\d*"), where_2),
        eccentricity=field(27, 33, "eccentricity", r"\d{7}", "0."),
        inclination=angle_of(field(9, 16, "inclination", r"\d+\.\d*"), 180, "inclination", where_2),
        node=angle_of(field(18, 25, "ascending node", r"\d+\.\d*"), 360, "ascending node", where_2),
        perigee=angle_of(field(35, 42, "argument of perigee", r"\d+\.\d*"), 360, "argument of perigee", where_2),
        anomaly=angle_of(field(44, 51, "mean anomaly", r"\d+\.\d*"), 360, "mean anomaly", where_2),
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
    first = parse_instant(f"{year}-01-01T00:00:00Z")
    if first is None or not 1 <= int(day) <= days_of_year(year):
        raise PathFileError(f"{where}: {called} must be from 1 to {days_of_year(year)} (got {day}.{fraction})")
    return Instant(first.day + int(day) - 1, float(f"0.{fraction}") * DAY)


def _drag(line: str, where: str) -> float:
    """B*: five digits behind a decimal point that is not written, and an exponent of a sign and a digit."""
    text = line[53:61].strip()
    match = re.fullmatch(r"([+-]?)\.?(\d{1,5})\s?([+-]\d)", text, re.ASCII)
    if match is None:
        raise PathFileError(f"{where}: B* must be a number in columns 54 to 61 (got {shown(text)})")
    return float(f"{match[1]}0.{match[2]}e{match[3]}")
