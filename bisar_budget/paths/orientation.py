"""Orientation of the Earth in inertial space: sidereal time, precession and nutation, UT1 and polar motion.

UT1 - UTC and polar motion come from tables that the IERS issues every week. UT1 - UTC is kept below 0.9 s. An error
of 1 ms in UT1 - UTC displaces a low orbit by 0.51 m. Polar motion is up to 0.6", which displaces a low orbit by 20 m.
If a mission states neither UT1 - UTC nor polar motion, orbits are converted with UT1 = UTC and without polar motion.
The resulting error of the orientation is constant throughout an aperture. It therefore shifts the path, but does not
bend it.
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
from bisar_budget.paths.earth import ROTATION_RATE_RAD_PER_S
from bisar_budget.paths.flight import PathFileError
from bisar_budget.paths.instant import DAY_S, TAI_LESS, Instant, tai, tai_less_utc

Turn = Callable[[Vector, Instant], Vector]
_MJD_EPOCH_JULIAN_DAYS = 2400000.5
_J2000_DAY = 51544  # modified Julian day, at noon
_CENTURY_DAYS = 36525.0  # days
_ARCSEC_RAD = math.radians(1 / 3600)
MAX_UT1_S = 0.9  # leap seconds keep UT1 - UTC below
MAX_POLE_RAD = 1.0 * _ARCSEC_RAD  # since 1900 the pole has been within 0.6"


class Orientation(NamedTuple):
    """Orientation of the Earth at an instant.

    Attributes
    ----------
    ut1_minus_utc : float
        UT1 - UTC. [s]
    pole : tuple of float
        Position of the pole, x towards Greenwich and y towards 90° west. [rad]
    ut1_doubt, pole_doubt : float
        Largest errors of UT1 - UTC [s] and of the pole [rad]. The defaults apply if no values are known. The default
        of `ut1_doubt`, 0.1 s, is an example value for the warning in reports. The default of `pole_doubt` is the
        largest displacement of the pole.
    day : int, optional
        UTC day for which UT1 - UTC is given. It is needed so that UT1 has no jump at a leap second. If it is None,
        UT1 - UTC is used on any day.
    is_predicted : bool
        Whether the values are predictions; this is stated in reports.
    """

    ut1_minus_utc: float = 0.0
    pole: tuple[float, float] = (0.0, 0.0)
    ut1_doubt: float = 0.1
    pole_doubt: float = 0.6 * _ARCSEC_RAD
    day: int | None = None
    is_predicted: bool = False

    @property
    def words(self) -> str:
        """Text about UT1 - UTC for reports; empty if the orientation is unknown."""
        if self._replace(day=None) == UNKNOWN:
            return ""
        return f", UT1 - UTC {self.ut1_minus_utc:.6g} s" + (" (predicted)" if self.is_predicted else "")

    def ut1(self, instant: Instant) -> Instant:
        """Convert an instant in UTC to UT1."""
        leaps = 0 if self.day is None else tai_less_utc(instant.day) - tai_less_utc(self.day)
        return instant.after(self.ut1_minus_utc + leaps)

    def misplaced(self, position: Vector) -> tuple[float, float]:
        """Largest errors of a position due to the uncertainties `ut1_doubt` and `pole_doubt`, in this order. [m]"""
        turned = ROTATION_RATE_RAD_PER_S * self.ut1_doubt * math.hypot(position[0], position[1])
        return turned, self.pole_doubt * math.hypot(*position)


UNKNOWN = Orientation()


def from_teme(position: Vector, instant: Instant, orientation: Orientation = UNKNOWN) -> Vector:
    """Convert a position from the true equator and mean equinox of date (TEME) to Earth-fixed axes. [m]"""
    angle = sidereal_time(orientation.ut1(instant))
    sine, cosine = math.sin(angle), math.cos(angle)
    x, y, z = position
    return _from_true_pole((cosine * x + sine * y, cosine * y - sine * x, z), orientation.pole)


def _from_true_pole(position: Vector, pole: tuple[float, float]) -> Vector:
    """Apply polar motion: convert a position from axes with z along the Earth's rotation axis to Earth-fixed axes.

    Both systems of axes rotate with the Earth. The conversion is R₁(-y)·R₂(-x) for the coordinates x, y of the pole
    [rad] (IERS Conventions, 5.1).
    """
    (sine_x, cosine_x), (sine_y, cosine_y) = ((math.sin(angle), math.cos(angle)) for angle in pole)
    x, y, z = position
    x, z = cosine_x * x + sine_x * z, cosine_x * z - sine_x * x
    return (x, cosine_y * y - sine_y * z, cosine_y * z + sine_y * y)


def sidereal_time(ut1: Instant) -> float:
    """Greenwich mean sidereal time as defined by the IAU in 1982. [rad]

    Source: Vallado, Fundamentals of Astrodynamics and Applications, 4th edition, equation 3-45 (see also Aoki et al.,
    1982). The equation contains a term of 876600 hours per century, which is one revolution per day. This term is
    computed from the seconds of the day, because the rounding error of a direct evaluation would be 1e-7 s.
    """
    centuries = (ut1.day - _J2000_DAY - 0.5 + ut1.seconds / DAY_S) / _CENTURY_DAYS
    at_midnight = (ut1.day - _J2000_DAY - 0.5) / _CENTURY_DAYS
    seconds = (
        (67310.54841 + 8640184.812866 * at_midnight - DAY_S / 2) % DAY_S
        + ut1.seconds * (1 + 8640184.812866 / (_CENTURY_DAYS * DAY_S))
        + (0.093104 - 6.2e-6 * centuries) * centuries**2
    )
    return seconds * (2 * math.pi / DAY_S)


def celestial_turn(is_j2000: bool, orientation: Orientation = UNKNOWN) -> Turn:
    """Return a function that converts positions from celestial to Earth-fixed axes.

    The celestial axes are the axes of the GCRF or, if `is_j2000` is set, of the mean equator and equinox of J2000.

    Precession follows the IAU 2006 model, and nutation the IAU 2000A model (IERS Conventions 2010, chapter 5). The
    axes of J2000 differ from the axes of the GCRF by 0.023", which is 0.8 m at the distance of a low orbit. If a file
    labels positions in the GCRF as `EME2000`, the converted positions are wrong by this amount.

    Raises
    ------
    PathFileError
        The package pyerfa is not installed.
    """
    try:
        import erfa
    except ImportError:
        raise PathFileError(f"needs the package pyerfa: {install_command('orbits')}") from None

    bias: NDArray[np.float64] = erfa.bp06(_MJD_EPOCH_JULIAN_DAYS, _J2000_DAY + 0.5)[0].T if is_j2000 else np.eye(3)

    def turn(position: Vector, instant: Instant) -> Vector:
        tt = tai(instant).after(-TAI_LESS["TT"])
        ut1 = orientation.ut1(instant)
        days = (tt.day, tt.seconds / DAY_S), (ut1.day, ut1.seconds / DAY_S)
        dates = (number for day, fraction in days for number in (_MJD_EPOCH_JULIAN_DAYS + day, fraction))
        x, y, z = (erfa.c2t06a(*dates, *orientation.pole) @ (bias @ position)).tolist()
        return (x, y, z)

    return turn


# ---------------------------------------------------------------------- tables of the IERS
_QUANTITIES = ("MJD", "x of the pole", "its error", "y of the pole", "its error", "UT1 - UTC", "its error")
# Character columns of finals2000A, from 0, for Bulletin A and then for Bulletin B (readme.finals2000A of the IERS).
_FINALS_COLUMNS = ((7, 15), (18, 27), (27, 36), (37, 46), (46, 55), (58, 68), (68, 78))
_BULLETIN_B_COLUMNS = {1: (134, 144), 3: (144, 154), 5: (154, 165)}
_PREDICTION_FLAGS = (16, 57)  # columns of finals2000A, I or P, of the pole and of UT1 - UTC
# Names of the same columns in tables with a header: finals2000A.all.csv, and CelesTrak's table from it.
_IERS_KEYS = ("MJD", "x_pole", "sigma_x_pole", "y_pole", "sigma_y_pole", "UT1-UTC", "sigma_UT1-UTC")
_BULLETIN_B_KEYS = {1: ("bulB/x_pole",), 3: ("bulB/y_pole",), 5: ("bulB/UT-UTC", "bulB/UT1-UTC")}
_CELESTRAK_KEYS = ("MJD", "X", "", "Y", "", "UT1-UTC", "")
# Indices in a row of C04: series 20 and later have 21 values with an hour, series 14 and 08 have 16 values.
_C04_COLUMNS = {21: (4, 5, 13, 6, 14, 7, 15), 16: (3, 4, 10, 5, 11, 6, 12)}
# Errors if a table states none: those of measured rows in finals2000A, and for predictions D days ahead also those of
# IERS Bulletin A, 0.00068 D^0.80 arcsec and 0.00025 D^0.75 s.
_MEASURED_POLE_ARCSEC, _MEASURED_UT1_S = 1e-4, 2e-5
_ACCEPTED_TABLES = "accepted: finals2000A.all or .csv of the IERS, its C04, or EOP-All.csv of CelesTrak"


class _TableRow(NamedTuple):
    """A row of an Earth rotation table: the values for one day.

    `cells` are strings: the MJD, then x of the pole, y of the pole and UT1 - UTC, each followed by its error. The
    string of an error may be empty.
    """

    line: int
    cells: list[str]
    is_predicted: bool
    form: str = "the IERS' finals2000A"


def read_earth_rotation(data: bytes, name: str, instant: Instant) -> Orientation:
    """Orientation of the Earth at an instant, from a table of the IERS or of CelesTrak.

    Supported tables are finals2000A and the finals for IAU 1980 in fixed columns (daily or complete file),
    finals2000A.all.csv, C04 of any series, and EOP-All.csv of CelesTrak. The orientation is interpolated linearly
    between two days. Such tables do not contain the tidal variations with periods below one day, which amount to 0.03
    ms and 0.5 mas. The errors stated in the rows become the `ut1_doubt` and `pole_doubt` of the result. For
    predictions, the error of UT1 grows to a few ms within a month.

    Parameters
    ----------
    data : bytes
        The bytes of the file.
    name : str
        Name of the file in messages.
    instant : Instant
        Middle of the aperture.

    Raises
    ------
    PathFileError
        The file is not a supported table, or has no values for the day of the instant or for the next day.

    Notes
    -----
    The values of Bulletin B are used if a row has them, and otherwise the values of Bulletin A. UT1 - TAI is
    interpolated, because UT1 - UTC jumps at a leap second.
    """
    first: list[float] | None = None
    first_day = last_day = None
    last_measured: float | None = None  # last day with measured values
    is_first_predicted = False
    form = ""
    for row in _rows(data.decode("utf-8-sig", "replace"), name):
        numbers = _numbers(row, last_measured, f"{name}:{row.line}")
        day = int(numbers[0])
        last_measured, form = last_measured if row.is_predicted else day, row.form
        if last_day is not None and day <= last_day:
            raise PathFileError(
                f"{name}:{row.line}: the day {day} is not after {last_day} of a row before; days must rise"
            )
        first_day, last_day = day if first_day is None else first_day, day
        if day == instant.day:
            first, is_first_predicted = numbers, row.is_predicted
        elif first is not None and day == instant.day + 1:
            orientation = _between(first, numbers, instant.seconds / DAY_S)
            return orientation._replace(is_predicted=row.is_predicted or is_first_predicted)
    if last_day is None or first_day is None:
        raise PathFileError(f"{name}: has no row of values")
    spans = " to ".join(Instant(day, 0.0).as_text()[:10] for day in (first_day, last_day))
    raise PathFileError(
        f"{name}: has no values for {instant.as_text()}; it covers {spans} (read as {form})",
        "accepted: a table with the day of the aperture and the one after it",
    )


def _rows(text: str, name: str) -> Iterator[_TableRow]:
    """Yield the rows of an Earth rotation table, except rows without values.

    The format of the table is recognised from its first lines.
    """
    lines = [(number, line) for number, line in enumerate(text.splitlines(), 1) if line.strip()]
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
    elif (unreadable := _unreadable_table(text)) is not None:
        raise PathFileError(f"{name}: is {unreadable}, which is not read", _ACCEPTED_TABLES)
    elif any(_is_c04(line) for _, line in lines[:_MAX_HEADER_LINES]):
        yield from _of_c04(lines, name)
    else:
        yield from _of_finals(lines)


_MAX_HEADER_LINES = 40  # lines of text above the rows of C04


def _unreadable_table(text: str) -> str | None:
    """Name, for a message, of the format of an Earth rotation table that is recognised but not supported.

    Returns None for any other text.
    """
    beginning = text[:2000]
    if re.search(r"(?m)^\s*NUM_OBSERVED_POINTS|^BEGIN OBSERVED", beginning):
        return "the text form of CelesTrak's EOP"
    if re.search(r"(?m)^\s*\*?\s*BULLETIN|IERS BULLETIN", beginning, re.IGNORECASE):
        return "a bulletin of the IERS"
    if re.search(r"(?m)^EOP2=", beginning) or "EOPCODE" in beginning:
        return "a table of JPL's EOP2"
    return None


def _of_finals(lines: Sequence[tuple[int, str]]) -> Iterator[_TableRow]:
    for number, line in lines:
        cells = [line[first:last].strip() for first, last in _FINALS_COLUMNS]
        bulletin_b = {index: line[first:last].strip() for index, (first, last) in _BULLETIN_B_COLUMNS.items()}
        cells = [bulletin_b.get(index) or cell for index, cell in enumerate(cells)]
        if _is_empty(cells):
            continue
        is_final = all(bulletin_b.values())
        has_flag = any(line[column : column + 1] == "P" for column in _PREDICTION_FLAGS)
        yield _TableRow(number, cells, not is_final and has_flag)


def _is_empty(cells: Sequence[str]) -> bool:
    """Whether a row has a date but no values, as is usual for days too far in the future."""
    return bool(cells[0]) and not any(cells[1:])


def _of_iers_csv(lines: Sequence[tuple[int, str]], name: str) -> Iterator[_TableRow]:
    header = lines[0][1].strip().split(";")
    columns = [_column_of(header, (key,), name) for key in _IERS_KEYS]
    bulletin_b_columns = {
        index: next((header.index(key) for key in keys if key in header), -1)
        for index, keys in _BULLETIN_B_KEYS.items()
    }
    type_columns = [index for index, key in enumerate(header) if key == "Type"][:2]  # for the pole, and for UT1 - UTC
    for number, line in lines[1:]:
        row = _row_of(line, ";", header, f"{name}:{number}")
        bulletin_b = {index: row[column] for index, column in bulletin_b_columns.items() if column >= 0}
        cells = [bulletin_b.get(index) or row[column] for index, column in enumerate(columns)]
        if _is_empty(cells):
            continue
        is_final = len(bulletin_b) == len(bulletin_b_columns) and all(bulletin_b.values())
        has_prediction = any(row[column].lower() == "prediction" for column in type_columns)
        yield _TableRow(number, cells, not is_final and has_prediction, "finals2000A as CSV")


def _of_celestrak(lines: Sequence[tuple[int, str]], name: str) -> Iterator[_TableRow]:
    header = lines[0][1].strip().split(",")
    columns = [_column_of(header, (key,), name) if key else -1 for key in _CELESTRAK_KEYS]
    type_column = header.index("DATA_TYPE") if "DATA_TYPE" in header else -1
    for number, line in lines[1:]:
        row = _row_of(line, ",", header, f"{name}:{number}")
        cells = [row[column] if column >= 0 else "" for column in columns]
        yield _TableRow(number, cells, type_column >= 0 and row[type_column] != "O", "CelesTrak's CSV")


def _of_c04(lines: Sequence[tuple[int, str]], name: str) -> Iterator[_TableRow]:
    is_header_over = False
    for number, line in lines:
        if not is_header_over and not _is_c04(line):
            continue  # the header
        is_header_over = True
        values = line.split()
        if len(values) not in _C04_COLUMNS:
            raise PathFileError(f"{name}:{number}: has {len(values)} values; a row of the IERS' C04 has 16 or 21")
        if len(values) == 21 and float(values[3] if values[3].isdigit() else 1) != 0:
            continue  # rows at noon, in a series with steps of 12 hours
        yield _TableRow(number, [values[column] for column in _C04_COLUMNS[len(values)]], False, "the IERS' C04")


def _is_c04(line: str) -> bool:
    values = line.split()
    return len(values) in _C04_COLUMNS and bool(re.fullmatch(r"(19|20|21)\d\d", values[0], re.ASCII))


def _column_of(header: Sequence[str], keys: Sequence[str], name: str) -> int:
    column = next((header.index(key) for key in keys if key in header), None)
    if column is None:
        raise PathFileError(f"{name}:1: has no column {keys[0]}", _ACCEPTED_TABLES)
    return column


def _row_of(line: str, separator: str, header: Sequence[str], location: str) -> list[str]:
    """Split a line of a table into cells; refuse a truncated line (with fewer cells than the header)."""
    cells = [cell.strip() for cell in line.split(separator)]
    if len(cells) < len(header):
        raise PathFileError(f"{location}: has {len(cells)} values, the header {len(header)}")
    return cells


def _numbers(row: _TableRow, last_measured: float | None, location: str) -> list[float]:
    """Convert a row to numbers: MJD, then x and y of the pole [arcsec] and UT1 - UTC [s], each followed by its error.

    If the row states no errors, typical errors are used. For predictions these grow with the time since
    `last_measured`, the last day with measured values. Raises `PathFileError` for a cell that is not a number, and
    for impossible values.
    """
    numbers: list[float] = []
    is_stated = any(row.cells[n] for n in (2, 4, 6))
    for index, (cell, quantity) in enumerate(zip(row.cells, _QUANTITIES, strict=True)):
        if not is_stated and index in (2, 4, 6):
            ahead_days = (
                0.0 if last_measured is None or not row.is_predicted else max(numbers[0] - last_measured, 0.0)
            )
            pole, ut1 = 0.00068 * ahead_days**0.80, 0.00025 * ahead_days**0.75
            numbers.append(_MEASURED_UT1_S + ut1 if index == 6 else _MEASURED_POLE_ARCSEC + pole)
            continue
        try:
            number = float(cell or "nan") if cell.isascii() and "_" not in cell else math.nan
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise PathFileError(
                f"{location}: {quantity} must be a number, in the columns of {row.form} (got {shown(cell)})",
                _ACCEPTED_TABLES,
            )
        numbers.append(number)
    day, x, _, y, _, ut1, _ = numbers
    if day != int(day) or max(abs(x), abs(y)) * _ARCSEC_RAD > MAX_POLE_RAD or abs(ut1) > MAX_UT1_S:
        raise PathFileError(
            f"{location}: cannot be a row of {row.form}: day {day:g}, pole {x:g} and {y:g} arcsec, "
            f"UT1 - UTC {ut1:g} s",
            _ACCEPTED_TABLES,
        )
    return numbers


def _between(first: list[float], second: list[float], fraction: float) -> Orientation:
    """Interpolate the orientation of the Earth linearly between the rows of two successive days.

    `first` and `second` are rows as returned by `_numbers`. `fraction` is the elapsed fraction of the first day.
    """
    leaps = tai_less_utc(int(second[0])) - tai_less_utc(int(first[0]))
    change = [end - start for start, end in zip(first, second, strict=True)]
    change[5] -= leaps
    _, x, x_doubt, y, y_doubt, ut1, ut1_doubt = (
        start + fraction * difference for start, difference in zip(first, change, strict=True)
    )
    return Orientation(ut1, (x * _ARCSEC_RAD, y * _ARCSEC_RAD), ut1_doubt, math.hypot(x_doubt, y_doubt) * _ARCSEC_RAD)
