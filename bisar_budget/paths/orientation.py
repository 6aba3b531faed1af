"""How the Earth is turned below the stars: sidereal time, precession and nutation, UT1 and the motion of the pole.

UT1 - UTC and polar motion come from tables which the IERS issues every week. UT1 - UTC is kept below 0.9 s: 1 ms
turns the Earth by 0.51 m at the distance of a low orbit. Polar motion is up to 0.6", which is 20 m there. Where a
mission states neither, orbits are turned with UT1 = UTC and without polar motion. The turn is the same throughout an
aperture: it moves the whole path, and bends nothing.
"""

import math
import re
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.extras import install_command
from bisar_budget.faults import shown
from bisar_budget.geometry import Vector
from bisar_budget.paths.earth import ROTATION_RATE
from bisar_budget.paths.flight import PathFileError
from bisar_budget.paths.instant import DAY, TAI_LESS, Instant, tai, tai_less_utc

Turn = Callable[[Vector, Instant], Vector]
_JULIAN_DATE_OF_MJD = 2400000.5
_J2000 = 51544  # modified Julian day, at noon
_CENTURY = 36525.0  # days
_ARCSEC = math.radians(1 / 3600)
FARTHEST_UT1 = 0.9  # s; leap seconds keep UT1 - UTC below
FARTHEST_POLE = 1.0 * _ARCSEC  # since 1900 it has been within 0.6"


class Orientation(NamedTuple):
    """UT1 - UTC [s] and the place of the pole, x towards Greenwich and y towards 90° west [rad], at one time.

    The doubts are how far each may be from the truth. Without figures they are what a report warns of: 0.1 s, and
    the farthest that the pole goes. UT1 - UTC is of a `day` of UTC, so that a leap second does not turn the Earth;
    None is the day that is asked about. Figures may be predictions, which reports say.
    """

    ut1_minus_utc: float = 0.0
    pole: tuple[float, float] = (0.0, 0.0)
    ut1_doubt: float = 0.1
    pole_doubt: float = 0.6 * _ARCSEC
    day: int | None = None
    is_predicted: bool = False

    @property
    def words(self) -> str:
        """Figures that places are turned with, for reports; empty where there are none."""
        if self._replace(day=None) == UNKNOWN:
            return ""
        return f", UT1 - UTC {self.ut1_minus_utc:.6g} s" + (" (predicted)" if self.is_predicted else "")

    def ut1(self, instant: Instant) -> Instant:
        """UT1 at an instant of UTC."""
        leaps = 0 if self.day is None else tai_less_utc(instant.day) - tai_less_utc(self.day)
        return instant.after(self.ut1_minus_utc + leaps)

    def misplaced(self, place: Vector) -> tuple[float, float]:
        """How far a place may be off by its doubts, of UT1 and of the pole. [m]"""
        return ROTATION_RATE * self.ut1_doubt * math.hypot(place[0], place[1]), self.pole_doubt * math.hypot(*place)


UNKNOWN = Orientation()


def from_teme(place: Vector, instant: Instant, orientation: Orientation = UNKNOWN) -> Vector:
    """Earth-fixed coordinates from those of the true equator and mean equinox of date. [m]"""
    angle = sidereal_time(orientation.ut1(instant))
    sine, cosine = math.sin(angle), math.cos(angle)
    x, y, z = place
    return _from_true_pole((cosine * x + sine * y, cosine * y - sine * x, z), orientation.pole)


def _from_true_pole(place: Vector, pole: tuple[float, float]) -> Vector:
    """Turn from axes whose z is the pole of rotation to Earth-fixed ones: R₁(-y)·R₂(-x), IERS Conventions, 5.1."""
    (sine_x, cosine_x), (sine_y, cosine_y) = ((math.sin(one), math.cos(one)) for one in pole)
    x, y, z = place
    x, z = cosine_x * x + sine_x * z, cosine_x * z - sine_x * x
    return (x, cosine_y * y - sine_y * z, cosine_y * z + sine_y * y)


def sidereal_time(ut1: Instant) -> float:
    """Greenwich mean sidereal time of the IAU, 1982. [rad]

    Source: Vallado, Fundamentals of Astrodynamics and Applications, 4th edition, equation 3-45 (also Aoki and others,
    1982). Its 876600 hours a century are a turn a day, and are left to the seconds of the day: written as it stands,
    the sum has 1e-7 s.
    """
    centuries = (ut1.day - _J2000 - 0.5 + ut1.seconds / DAY) / _CENTURY
    at_midnight = (ut1.day - _J2000 - 0.5) / _CENTURY
    seconds = (
        (67310.54841 + 8640184.812866 * at_midnight - DAY / 2) % DAY
        + ut1.seconds * (1 + 8640184.812866 / (_CENTURY * DAY))
        + (0.093104 - 6.2e-6 * centuries) * centuries**2
    )
    return seconds * (2 * math.pi / DAY)


def celestial_turn(is_j2000: bool, orientation: Orientation = UNKNOWN) -> Turn:
    """From the axes of the GCRF, or the mean equator and equinox of J2000, to Earth-fixed ones.

    Precession and nutation are those of the IAU, 2006 and 2000A (IERS Conventions 2010, chapter 5). The axes of J2000
    are 0.023" from the GCRF's, 0.8 m at the distance of a low orbit; a file that calls the GCRF `EME2000` is that
    much off.

    Raises
    ------
    PathFileError
        The package pyerfa is not installed.
    """
    try:
        import erfa
    except ImportError:
        raise PathFileError(f"needs the package pyerfa: {install_command('orbits')}") from None

    bias: NDArray[np.float64] = erfa.bp06(_JULIAN_DATE_OF_MJD, _J2000 + 0.5)[0].T if is_j2000 else np.eye(3)

    def turn(place: Vector, instant: Instant) -> Vector:
        tt = tai(instant).after(-TAI_LESS["TT"])
        ut1 = orientation.ut1(instant)
        days = (tt.day, tt.seconds / DAY), (ut1.day, ut1.seconds / DAY)
        dates = (number for day, part in days for number in (_JULIAN_DATE_OF_MJD + day, part))
        x, y, z = (erfa.c2t06a(*dates, *orientation.pole) @ (bias @ place)).tolist()
        return (x, y, z)

    return turn


# ---------------------------------------------------------------------- tables of the IERS
_QUANTITIES = ("MJD", "x of the pole", "its error", "y of the pole", "its error", "UT1 - UTC", "its error")
# Columns of a row of finals2000A, from 0, by the IERS' readme.finals2000A; the second of each is of Bulletin B.
_FIXED = ((7, 15), (18, 27), (27, 36), (37, 46), (46, 55), (58, 68), (68, 78))
_FINAL = {1: (134, 144), 3: (144, 154), 5: (154, 165)}
_PREDICTION_FLAGS = (16, 57)  # columns of finals2000A, I or P, of the pole and of UT1 - UTC
# Names of the same columns in tables with a header: finals2000A.all.csv, and what CelesTrak makes of it.
_OF_IERS = ("MJD", "x_pole", "sigma_x_pole", "y_pole", "sigma_y_pole", "UT1-UTC", "sigma_UT1-UTC")
_OF_IERS_FINAL = {1: ("bulB/x_pole",), 3: ("bulB/y_pole",), 5: ("bulB/UT-UTC", "bulB/UT1-UTC")}
_OF_CELESTRAK = ("MJD", "X", "", "Y", "", "UT1-UTC", "")
# Values of a row of C04: 21 of the series 20 and later, which have an hour, 16 of the series 14 and 08 before them.
_OF_C04 = {21: (4, 5, 13, 6, 14, 7, 15), 16: (3, 4, 10, 5, 11, 6, 12)}
# What a table without errors is trusted to: errors of rows of finals2000A that are measured, and of predictions D
# days ahead by IERS Bulletin A, 0.00068 D^0.80 arcsec and 0.00025 D^0.75 s.
_MEASURED_POLE_ARCSEC, _MEASURED_UT1_S = 1e-4, 2e-5
_ACCEPTED_TABLES = "accepted: finals2000A.all or .csv of the IERS, its C04, or EOP-All.csv of CelesTrak"


class _TableRow(NamedTuple):
    """Texts of a day in a table: MJD, pole and UT1 - UTC, each with its error, empty where it has none."""

    line: int
    cells: list[str]
    is_predicted: bool
    form: str = "the IERS' finals2000A"


def read_earth_rotation(data: bytes, name: str, instant: Instant) -> Orientation:
    """Orientation at an instant, from a table of the IERS or of CelesTrak.

    It is finals2000A, or finals of the IAU 1980, daily or all, in fixed columns; finals2000A.all.csv; C04 of any
    series; or EOP-All.csv of CelesTrak. Between two days it is linear: tides that are faster, of 0.03 ms and 0.5 mas,
    are not in the table. Its doubts are the errors that the rows state; those of predictions grow to a few ms in a
    month.

    Parameters
    ----------
    data : bytes
        A whole file.
    name : str
        What messages call it.
    instant : Instant
        Middle of the aperture.

    Raises
    ------
    PathFileError
        The file is no such table, or has no values of the day before and the day behind the instant.

    Notes
    -----
    The values of Bulletin B are taken where a row has them, else those of Bulletin A. UT1 - UTC jumps with a leap
    second, UT1 - TAI does not.
    """
    first: list[float] | None = None
    begins = ends = None
    measured: float | None = None  # the last day that is no prediction
    is_first_predicted = False
    form = ""
    for row in _rows(data.decode("utf-8-sig", "replace"), name):
        numbers = _numbers(row, measured, f"{name}:{row.line}")
        day = int(numbers[0])
        measured, form = measured if row.is_predicted else day, row.form
        if ends is not None and day <= ends:
            raise PathFileError(
                f"{name}:{row.line}: the day {day} is not after {ends} of a row before; days must rise"
            )
        begins, ends = day if begins is None else begins, day
        if day == instant.day:
            first, is_first_predicted = numbers, row.is_predicted
        elif first is not None and day == instant.day + 1:
            found = _between(first, numbers, instant.seconds / DAY)
            return found._replace(is_predicted=row.is_predicted or is_first_predicted)
    if ends is None or begins is None:
        raise PathFileError(f"{name}: has no row of values")
    spans = " to ".join(Instant(day, 0.0).as_text()[:10] for day in (begins, ends))
    raise PathFileError(
        f"{name}: has no values for {instant.as_text()}; it covers {spans} (read as {form})",
        "accepted: a table with the day of the aperture and the one after it",
    )


def _rows(text: str, name: str) -> Iterator[_TableRow]:
    """Rows of a table that have values, by the form that its first lines show."""
    lines = [(at, line) for at, line in enumerate(text.splitlines(), 1) if line.strip()]
    header = lines[0][1].strip() if lines else ""
    if header.lower().startswith(("<!doctype", "<html", "<?xml")):
        raise PathFileError(
            f"{name}: is a page of a web site, not a table of the Earth's rotation",
            _ACCEPTED_TABLES,
            "Save the file that it links to",
        )
    if header.startswith("MJD;"):
        yield from _of_iers_csv(lines, name)
    elif "MJD" in header.split(",") and "UT1-UTC" in header.split(","):
        yield from _of_celestrak(lines, name)
    elif (known := _named(text)) is not None:
        raise PathFileError(f"{name}: is {known}, which is not read", _ACCEPTED_TABLES)
    elif any(_is_c04(line) for _, line in lines[:_LONGEST_HEADER]):
        yield from _of_c04(lines, name)
    else:
        yield from _of_finals(lines)


_LONGEST_HEADER = 40  # lines of text above the rows of C04


def _named(text: str) -> str | None:
    """Words for a table of the Earth's rotation that is often taken for one that is read."""
    begins = text[:2000]
    if re.search(r"(?m)^\s*NUM_OBSERVED_POINTS|^BEGIN OBSERVED", begins):
        return "the text form of CelesTrak's EOP"
    if re.search(r"(?m)^\s*\*?\s*BULLETIN|IERS BULLETIN", begins, re.IGNORECASE):
        return "a bulletin of the IERS"
    if re.search(r"(?m)^EOP2=", begins) or "EOPCODE" in begins:
        return "a table of JPL's EOP2"
    return None


def _of_finals(lines: Sequence[tuple[int, str]]) -> Iterator[_TableRow]:
    for at, line in lines:
        cells = [line[first:last].strip() for first, last in _FIXED]
        final = {index: line[first:last].strip() for index, (first, last) in _FINAL.items()}
        cells = [final.get(index) or cell for index, cell in enumerate(cells)]
        if _is_empty(cells):
            continue
        is_final = all(final.values())
        yield _TableRow(at, cells, not is_final and any(line[at : at + 1] == "P" for at in _PREDICTION_FLAGS))


def _is_empty(cells: Sequence[str]) -> bool:
    """Whether a row is a day of the future that has no values yet."""
    return bool(cells[0]) and not any(cells[1:])


def _of_iers_csv(lines: Sequence[tuple[int, str]], name: str) -> Iterator[_TableRow]:
    header = lines[0][1].strip().split(";")
    places = [_column_of(header, (key,), name) for key in _OF_IERS]
    finals = {n: next((header.index(key) for key in keys if key in header), -1) for n, keys in _OF_IERS_FINAL.items()}
    kinds = [n for n, key in enumerate(header) if key == "Type"][:2]  # of the pole, and of UT1 - UTC
    for at, line in lines[1:]:
        row = _row_of(line, ";", header, f"{name}:{at}")
        final = {n: row[place] for n, place in finals.items() if place >= 0}
        cells = [final.get(n) or row[place] for n, place in enumerate(places)]
        if _is_empty(cells):
            continue
        is_final = len(final) == len(finals) and all(final.values())
        yield _TableRow(
            at, cells, not is_final and any(row[n].lower() == "prediction" for n in kinds), "finals2000A as CSV"
        )


def _of_celestrak(lines: Sequence[tuple[int, str]], name: str) -> Iterator[_TableRow]:
    header = lines[0][1].strip().split(",")
    places = [_column_of(header, (key,), name) if key else -1 for key in _OF_CELESTRAK]
    kind = header.index("DATA_TYPE") if "DATA_TYPE" in header else -1
    for at, line in lines[1:]:
        row = _row_of(line, ",", header, f"{name}:{at}")
        cells = [row[place] if place >= 0 else "" for place in places]
        yield _TableRow(at, cells, kind >= 0 and row[kind] != "O", "CelesTrak's CSV")


def _of_c04(lines: Sequence[tuple[int, str]], name: str) -> Iterator[_TableRow]:
    begun = False
    for at, line in lines:
        if not begun and not _is_c04(line):
            continue  # the header
        begun = True
        values = line.split()
        if len(values) not in _OF_C04:
            raise PathFileError(f"{name}:{at}: has {len(values)} values; a row of the IERS' C04 has 16 or 21")
        if len(values) == 21 and float(values[3] if values[3].isdigit() else 1) != 0:
            continue  # a series of 12 hours has rows at noon
        yield _TableRow(at, [values[place] for place in _OF_C04[len(values)]], False, "the IERS' C04")


def _is_c04(line: str) -> bool:
    values = line.split()
    return len(values) in _OF_C04 and bool(re.fullmatch(r"(19|20|21)\d\d", values[0], re.ASCII))


def _column_of(header: Sequence[str], keys: Sequence[str], name: str) -> int:
    place = next((header.index(key) for key in keys if key in header), None)
    if place is None:
        raise PathFileError(f"{name}:1: has no column {keys[0]}", _ACCEPTED_TABLES)
    return place


def _row_of(line: str, separator: str, header: Sequence[str], where: str) -> list[str]:
    """Cells of a line; a line that was cut off has fewer than the header, and is refused."""
    cells = [cell.strip() for cell in line.split(separator)]
    if len(cells) < len(header):
        raise PathFileError(f"{where}: has {len(cells)} values, the header {len(header)}")
    return cells


def _numbers(row: _TableRow, measured: float | None, where: str) -> list[float]:
    """Numbers of a row, with what is usual for errors that the table does not state."""
    numbers: list[float] = []
    is_stated = any(row.cells[n] for n in (2, 4, 6))
    for index, (cell, called) in enumerate(zip(row.cells, _QUANTITIES, strict=True)):
        if not is_stated and index in (2, 4, 6):
            ahead_days = 0.0 if measured is None or not row.is_predicted else max(numbers[0] - measured, 0.0)
            pole, ut1 = 0.00068 * ahead_days**0.80, 0.00025 * ahead_days**0.75
            numbers.append(_MEASURED_UT1_S + ut1 if index == 6 else _MEASURED_POLE_ARCSEC + pole)
            continue
        try:
            number = float(cell or "nan") if cell.isascii() and "_" not in cell else math.nan
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise PathFileError(
                f"{where}: {called} must be a number, in the columns of {row.form} (got {shown(cell)})",
                _ACCEPTED_TABLES,
            )
        numbers.append(number)
    day, x, _, y, _, ut1, _ = numbers
    if day != int(day) or max(abs(x), abs(y)) * _ARCSEC > FARTHEST_POLE or abs(ut1) > FARTHEST_UT1:
        raise PathFileError(
            f"{where}: cannot be a row of {row.form}: day {day:g}, pole {x:g} and {y:g} arcsec, UT1 - UTC {ut1:g} s",
            _ACCEPTED_TABLES,
        )
    return numbers


def _between(first: list[float], second: list[float], part: float) -> Orientation:
    leaps = tai_less_utc(int(second[0])) - tai_less_utc(int(first[0]))
    change = [b - a for a, b in zip(first, second, strict=True)]
    _, x, of_x, y, of_y, ut1, of_ut1 = (
        a + part * one for a, one in zip(first, (*change[:5], change[5] - leaps, change[6]), strict=True)
    )
    return Orientation(ut1, (x * _ARCSEC, y * _ARCSEC), of_ut1, math.hypot(of_x, of_y) * _ARCSEC)
