"""Two-line element sets, with or without a line of the name above each.

Format: Hoots & Roehrich, Spacetrack Report No. 3, 1980, section 12, and Space-Track's alpha-5 catalogue numbers.
"""

import re
from calendar import isleap
from collections.abc import Iterator

from bisar_budget.faults import shown
from bisar_budget.paths.elements import PLAIN_TYPES, Elements, angle_of, motion_of, orbit_of
from bisar_budget.paths.flight import Orbit, PathFileError
from bisar_budget.paths.instant import DAY, Instant, day_of_year
from bisar_budget.paths.messages import decoded, hold_to_size
from bisar_budget.paths.orientation import UNKNOWN, Orientation

_COLUMNS = 69
_DECIMAL = r"\d+\.\d*"


def read_tle(
    data: bytes, name: str, wanted: str | None, center: Instant, orientation: Orientation = UNKNOWN
) -> Orbit:
    """Orbit from two-line element sets.

    Parameters
    ----------
    data, name, wanted, center, orientation
        As of every reader of `ORBIT_FORMATS`. Blank lines, and those that begin with `#`, are no part of the file.

    Raises
    ------
    PathFileError
        The text is not what the format asks for, or as of `elements.orbit_of`.
    """
    hold_to_size(len(data), name)
    return orbit_of(list(element_sets(decoded(data, name), name)), name, wanted, center, orientation)


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

    def angle(start: int, end: int, most: float, called: str) -> float:
        """Angle in columns of line 2, counted from 1."""
        return angle_of(_column(line_2, where_2, start, end, called, _DECIMAL), most, called, where_2)

    return Elements(
        name=object_name,
        number=number,
        epoch=_epoch(line_1, where_1),
        mean_motion=motion_of(_column(line_2, where_2, 53, 63, "mean motion", _DECIMAL), where_2),
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
