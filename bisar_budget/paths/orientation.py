"""How the Earth is turned below the stars: sidereal time, precession and nutation, UT1 and the motion of the pole.

UT1 - UTC and polar motion come from tables which the IERS issues every week. UT1 - UTC is kept below 0.9 s: 1 ms
turns the Earth by 0.51 m at the distance of a low orbit. Polar motion is up to 0.6", which is 20 m there. Where a
mission states neither, orbits are turned with UT1 = UTC and without polar motion. The turn is the same throughout an
aperture: it moves the whole path, and bends nothing.
"""

import math
from collections.abc import Callable
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
    the farthest that the pole goes.
    """

    ut1_minus_utc: float = 0.0
    pole: tuple[float, float] = (0.0, 0.0)
    ut1_doubt: float = 0.1
    pole_doubt: float = 0.6 * _ARCSEC

    @property
    def words(self) -> str:
        """Figures that places are turned with, for reports; empty where there are none."""
        return "" if self == UNKNOWN else f", UT1 - UTC {self.ut1_minus_utc:.6g} s"

    def misplaced(self, place: Vector) -> tuple[float, float]:
        """How far a place may be off by its doubts, of UT1 and of the pole. [m]"""
        return ROTATION_RATE * self.ut1_doubt * math.hypot(place[0], place[1]), self.pole_doubt * math.hypot(*place)


UNKNOWN = Orientation()


def from_teme(place: Vector, instant: Instant, orientation: Orientation = UNKNOWN) -> Vector:
    """Earth-fixed coordinates from those of the true equator and mean equinox of date. [m]"""
    angle = sidereal_time(instant.after(orientation.ut1_minus_utc))
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
        ut1 = instant.after(orientation.ut1_minus_utc)
        days = (tt.day, tt.seconds / DAY), (ut1.day, ut1.seconds / DAY)
        dates = (number for day, part in days for number in (_JULIAN_DATE_OF_MJD + day, part))
        x, y, z = (erfa.c2t06a(*dates, *orientation.pole) @ (bias @ place)).tolist()
        return (x, y, z)

    return turn


# ---------------------------------------------------------------------- tables of the IERS
_ROW = ((7, 15), (18, 27), (27, 36), (37, 46), (46, 55), (58, 68), (68, 78))  # columns of a row, from 0
_ROWS = ("MJD", "x of the pole", "its error", "y of the pole", "its error", "UT1 - UTC", "its error")
_FINAL = {1: (134, 144), 3: (144, 154), 5: (154, 165)}  # of Bulletin B, where they are known


def read_finals(data: bytes, name: str, instant: Instant) -> Orientation:
    """Orientation at an instant, from a table of the IERS: finals2000A, or finals of the IAU 1980, daily or all.

    Between two days it is linear: tides that are faster, of 0.03 ms and 0.5 mas, are not in the table. Its doubts are
    the errors that the rows state; those of predictions grow to a few ms in a month.

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
    Columns: the IERS' readme.finals2000A; the values of Bulletin B where the row has them, else of Bulletin A.
    UT1 - UTC jumps with a leap second, UT1 - TAI does not.
    """
    first: list[float] | None = None
    begins = ends = None
    for at, line in enumerate(data.decode("ascii", "replace").splitlines(), 1):
        if not line.strip():
            continue
        row = _row(line, f"{name}:{at}")
        if row is None:  # a day of the future without values
            continue
        day = int(row[0])
        if ends is not None and day <= ends:
            raise PathFileError(f"{name}:{at}: the day {day} is not after {ends} of a row before; days must rise")
        begins, ends = day if begins is None else begins, day
        if day == instant.day:
            first = row
        elif first is not None and day == instant.day + 1:
            return _between(first, row, instant.seconds / DAY)
    if ends is None or begins is None:
        raise PathFileError(f"{name}: has no row of values")
    spans = " to ".join(Instant(day, 0.0).as_text()[:10] for day in (begins, ends))
    raise PathFileError(
        f"{name}: has no values for {instant.as_text()}; it covers {spans}",
        "accepted: a table with the day of the aperture and the one after it",
    )


def _row(line: str, where: str) -> list[float] | None:
    """Numbers of a row, None where it has only its date."""
    cells = [line[first:last].strip() for first, last in _ROW]
    for index, (first, last) in _FINAL.items():
        cells[index] = line[first:last].strip() or cells[index]
    if cells[0] and not any(cells[1:]):
        return None
    found = []
    for cell, called in zip(cells, _ROWS, strict=True):
        try:
            number = float(cell or "nan") if cell.isascii() and "_" not in cell else math.nan
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise PathFileError(
                f"{where}: {called} must be a number, in the columns of the IERS' finals2000A (got {shown(cell)})"
            )
        found.append(number)
    day, x, _, y, _, ut1, _ = found
    if day != int(day) or max(abs(x), abs(y)) * _ARCSEC > FARTHEST_POLE or abs(ut1) > FARTHEST_UT1:
        raise PathFileError(
            f"{where}: cannot be a row of the IERS' finals2000A: day {day:g}, pole {x:g} and {y:g} arcsec, UT1 - UTC"
            f" {ut1:g} s"
        )
    return found


def _between(first: list[float], second: list[float], part: float) -> Orientation:
    leaps = tai_less_utc(int(second[0])) - tai_less_utc(int(first[0]))
    change = [b - a for a, b in zip(first, second, strict=True)]
    _, x, of_x, y, of_y, ut1, of_ut1 = (
        a + part * one for a, one in zip(first, (*change[:5], change[5] - leaps, change[6]), strict=True)
    )
    return Orientation(ut1, (x * _ARCSEC, y * _ARCSEC), of_ut1, math.hypot(of_x, of_y) * _ARCSEC)
