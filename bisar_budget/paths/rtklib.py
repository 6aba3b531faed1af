"""Solutions of RTKLIB (`.pos`): a header line that names the time scale and the columns, then one fix per line.

    % (lat/lon/height=WGS84/ellipsoidal,Q=1:fix,2:float,3:sbas,4:dgps,5:single,6:ppp,ns=# of satellites)
    %  GPST                  latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m) ...
    2026/06/01 05:20:19.250   48.086600000   11.279700000  3000.0000   1  12   0.0100   0.0080   0.0200 ...

The header line begins with %. Each fix is followed by its errors. Times are in GPST, UTC or JST (UTC + 9 h). Each
time is written as a date and a time of day, or as a GPS week and the seconds of that week. A fix has latitude,
longitude and height, or Earth-fixed x, y, z. Latitude and longitude are in degrees, or in degrees, minutes and
seconds. Heights are `ellipsoidal`, or `geodetic`, which means above the geoid in RTKLIB. Cells are separated by
blanks, or by the character that follows the name of the first column in the header line.

Source: RTKLIB 2.4.3, src/solution.c, functions outsolheads, outsols, outpos and outecef, which write such files.
"""

import math
import re
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from bisar_budget.faults import shown
from bisar_budget.paths.earth import Floats, axes_at_places, geodetic_places
from bisar_budget.paths.flight import Log, PathFileError, hold_to_bytes
from bisar_budget.paths.instant import DAY_S, GPS_EPOCH_DAY, WEEK_S, Instant, parse_instant
from bisar_budget.paths.log_places import (
    LogKeys,
    LogRecords,
    counted,
    filled_sigmas,
    from_sea_level,
    geodetic_log,
    hold_to_ellipsoid,
    hold_to_scale,
    is_wgs84,
    known_sigmas,
    most_left_out,
    needs_separation,
)
from bisar_budget.paths.messages import decoded, number_in

MAX_SOLUTION_BYTES = 200_000_000  # a million fixes
_ANY_HEADER = re.compile(rb"(?m)^%[ \t]*(GPST|UTC|JST)\b[^\r\n]*(latitude\(|x-ecef\(m\)|e-baseline\(m\))")
_HEADER_LINE = re.compile(r"% ?(GPST|UTC|JST) ?([,;]?) ?((?:latitude|x-ecef|e-baseline)\(.*)")
_DATUM_WORDS = re.compile(r"(?:height|ecef)=([^/,)]+)")
_MIN_ROW_BYTES = 8
_COLUMN_NAME = re.compile(r"[a-z-]+\([^)]{0,9}\)|[A-Za-z]+")
_DATE_PATTERN = re.compile(r"(\d{4})/(\d\d)/(\d\d)", re.ASCII)
_CLOCK_PATTERN = re.compile(r"([01]\d|2[0-3]):([0-5]\d):([0-5]\d(?:\.\d{1,12})?|60(?:\.0{1,12})?)", re.ASCII)
_JST_LESS_UTC_S = 9 * 3600.0
_QUALITY_WORDS = {1: "fix", 2: "float", 3: "sbas", 4: "dgps", 5: "single", 6: "ppp", 7: "dead reckoning"}
_MAX_RTKLIB_SIGMA_M = 1e5


class _Columns(NamedTuple):
    """Layout of the lines in a solution, according to its header.

    Attributes
    ----------
    system : str
        Time system.
    delimiter : str
        Character between cells; empty for blanks.
    indices : dict
        Index of the cell of each column, by column name. The first two cells of a line are the time.
    width : int
        Number of cells in a line.
    is_in_minutes : bool
        Whether latitude and longitude have three cells each: degrees, minutes and seconds.
    """

    system: str
    delimiter: str
    indices: dict[str, int]
    width: int
    is_in_minutes: bool


def is_solution(data: bytes) -> bool:
    """Whether a file is a solution of RTKLIB: it has a line that names the columns of a solution."""
    return bool(_ANY_HEADER.search(data[:100_000]))


def read_solution(data: bytes, name: str, keys: LogKeys) -> Log:
    """Read the fixes from a solution of RTKLIB, a file of at most `MAX_SOLUTION_BYTES` bytes.

    Arguments and errors are the same for all readers, see `LogFormat.read`. The log has the standard deviations east,
    north and up of each fix, unless they are missing or all zero in the file.
    """
    hold_to_bytes(data, MAX_SOLUTION_BYTES, name)
    header: _Columns | None = None
    datum_line, lines, days, numbers = "", [], [], []
    broken: dict[int, str] = {}
    for number, text in enumerate(decoded(data, name).splitlines(), 1):
        if text.startswith("%"):
            if _DATUM_WORDS.search(text):
                datum_line = text
            columns = _header(text, f"{name}:{number}")
            if columns is not None and header not in (None, columns):
                raise PathFileError(f"{name}:{number}: names other columns than the lines before")
            header = columns or header
        elif text.strip():
            if header is None:
                raise PathFileError(
                    f"{name}:{number}: no line that begins with '%  GPST', UTC or JST names the columns before it"
                )
            try:
                day, row = _row(text, header, f"{name}:{number}")
            except PathFileError as fault:
                broken[number] = str(fault)
                if len(broken) > most_left_out(len(data) // _MIN_ROW_BYTES):
                    break
                continue
            if row[header.indices.get("Q", 0)] or "Q" not in header.indices:
                lines.append(number)
                days.append(day)
                numbers.append(row)
    if header is None or not (lines or broken):
        raise PathFileError(f"{name}: has no solution")
    records = LogRecords(name, len(lines), lines, broken)
    scale = "gps" if header.system == "GPST" else "utc"
    hold_to_scale(scale, keys, name)
    _hold_to_datum(datum_line, name)
    table = np.array(numbers)
    seconds = table[:, -1] - (_JST_LESS_UTC_S if header.system == "JST" else 0.0)
    start = Instant(days[0], 0.0).after(float(seconds[0]))
    times = (np.array(days) - days[0]) * DAY_S + (seconds - seconds[0])
    words = "RTKLIB solution" + _qualities(table, header)
    if "x-ecef(m)" in header.indices:
        hold_to_ellipsoid(keys, name, "has x, y, z")
        index = header.indices["x-ecef(m)"]
        with np.errstate(all="ignore"):  # impossible coordinates are refused later
            latitude, longitude, height = geodetic_places(table[:, index : index + 3])
    else:
        latitude, longitude = (_radians(table, header, axis, records) for axis in ("latitude", "longitude"))
        height = _heights(table[:, header.indices["height(m)"]], datum_line, keys, name)
    sigmas = _sigmas(table, header, latitude, longitude, records)
    return geodetic_log(records, words, times, start, scale, (latitude, longitude, height), sigmas)


def _header(text: str, location: str) -> _Columns | None:
    """Read the columns from a header line, which begins with %; None for any other line."""
    match = _HEADER_LINE.match(" ".join(text.split()))
    if match is None:
        return None
    if match[3].startswith("e-baseline"):
        raise PathFileError(
            f"{location}: has baselines from a base station, no positions",
            "accepted: latitude, longitude and height, or x, y, z of RTKLIB's options of the output",
        )
    indices: dict[str, int] = {}
    index = 2  # after the date and the time of day, or the week and its seconds
    is_in_minutes = match[3].startswith("latitude(d'\")")
    for column in _COLUMN_NAME.findall(match[3]):
        indices.setdefault(column.split("(")[0] if column.startswith(("latitude", "longitude")) else column, index)
        index += 3 if is_in_minutes and column.startswith(("latitude", "longitude")) else 1
    coordinates = (
        ("x-ecef(m)", "y-ecef(m)", "z-ecef(m)") if "x-ecef(m)" in indices else ("latitude", "longitude", "height(m)")
    )
    missing = [column for column in coordinates if column not in indices]
    if missing:
        raise PathFileError(f"{location}: names no column {missing[0]}")
    delimiter = match[3][match[3].index(")") + 1 :][:1]
    return _Columns(match[1], delimiter if delimiter in ",;" else "", indices, index, is_in_minutes)


def _row(text: str, header: _Columns, location: str) -> tuple[int, list[float]]:
    """Read a line with a fix; return the modified Julian day of the fix and a list of numbers.

    The list has a number for each cell of the line, and the seconds of the day at its end. The first two cells
    contain the time; their numbers are set to 0.
    """
    cells = (text.replace(header.delimiter, " ") if header.delimiter else text).split()
    if len(cells) != header.width:
        raise PathFileError(f"{location}: has {counted(len(cells), 'cell')}, the columns need {header.width}")
    if "/" in cells[0]:
        day, clock = _day(cells[0]), _CLOCK_PATTERN.fullmatch(cells[1])
        if day is None or clock is None:
            time_text = shown(f"{cells[0]} {cells[1]}")
            raise PathFileError(
                f"{location}: must begin with a time like 2026/06/01 05:20:19.250 (got {time_text!r})"
            )
        seconds = int(clock[1]) * 3600.0 + int(clock[2]) * 60.0 + float(clock[3])
    else:
        week, second = number_in(cells[0]), number_in(cells[1])
        if week is None or second is None or week % 1 or not (0 <= week <= 9999 and 0 <= second <= WEEK_S):
            time_text = shown(f"{cells[0]} {cells[1]}")
            raise PathFileError(
                f"{location}: must begin with a GPS week and its second, like 2421 105619.250 (got {time_text!r})"
            )
        days, seconds = divmod(second, DAY_S)
        day = GPS_EPOCH_DAY + 7 * int(week) + int(days)
    row = [0.0, 0.0]  # instead of the two cells of the time
    for cell in cells[2:]:
        try:
            value = float(cell) if cell.isascii() and "_" not in cell else None
        except ValueError:
            value = None
        if value is None:
            raise PathFileError(f"{location}: must have numbers behind the time (got {shown(cell)!r})")
        row.append(value if math.isfinite(value) else math.nan)  # for example, a ratio test without ambiguities
    return day, [*row, seconds]


@lru_cache(maxsize=64)
def _day(text: str) -> int | None:
    """Convert a date like 2026/06/01 to a modified Julian day; None if the text is not a date."""
    match = _DATE_PATTERN.fullmatch(text)
    instant = parse_instant("{}-{}-{}T00:00:00Z".format(*match.groups())) if match else None
    return None if instant is None else instant.day


def _radians(table: Floats, header: _Columns, axis: str, records: LogRecords) -> Floats:
    index = header.indices[axis]
    if not header.is_in_minutes:
        return np.radians(table[:, index])
    degrees, minutes, seconds = table[:, index : index + 3].T
    # As in RTKLIB's deg2dms and dms2deg, the sign is that of the degrees, which may be -0.
    sexagesimal = [(minutes, "minutes"), (seconds, "seconds")]
    for values, unit_name in sexagesimal:
        records.leave_out(
            ~((values >= 0) & (values <= 60)),
            lambda i, values=values, unit_name=unit_name: (  # type: ignore[misc]
                f"{axis} has {values[i]:.6g} {unit_name}"
            ),
        )
    angles: Floats = np.copysign(np.radians(np.abs(degrees) + minutes / 60 + seconds / 3600), degrees)
    return angles


def _hold_to_datum(datum_line: str, name: str) -> None:
    """Refuse a solution whose datum is neither WGS-84 nor an ITRF frame.

    `datum_line` is the line, beginning with %, that states the datum; it may be empty.
    """
    match = _DATUM_WORDS.search(datum_line)
    if match is not None and not is_wgs84(match[1]):
        raise PathFileError(f"{name}: has positions of the datum {shown(match[1])}", "accepted: WGS84")


def _heights(heights: Floats, datum_line: str, keys: LogKeys, name: str) -> Floats:
    """Convert the heights in a solution to heights above the ellipsoid. [m]

    `datum_line`, which begins with %, states whether the heights are above the ellipsoid or above the geoid.
    """
    match = re.search(r"height=[^/,)]+/(\w+)", datum_line)
    if match is not None and match[1] == "ellipsoidal":
        hold_to_ellipsoid(keys, name)
        return heights
    if keys.geoid_separation is None and match is None:
        raise needs_separation(
            f"{name}: has no line of % that says whether heights are above the ellipsoid or the geoid"
        )
    return from_sea_level(heights, None, keys, name)


def _qualities(table: Floats, header: _Columns) -> str:
    """Describe the qualities of the fixes: the four most frequent qualities, with the number of fixes of each.

    The result is empty if the solution has no quality column.
    """
    if "Q" not in header.indices:
        return ""
    values, counts = np.unique(table[:, header.indices["Q"]], return_counts=True)
    frequencies = sorted(zip(counts.tolist(), values.tolist(), strict=True), key=lambda frequency: -frequency[0])
    words: Sequence[str] = [
        f"{_QUALITY_WORDS.get(quality, f'quality {quality:g}')} {count}" for count, quality in frequencies[:4]
    ]
    return f" ({', '.join(words)})"


def _sigmas(
    table: Floats, header: _Columns, latitude: Floats, longitude: Floats, records: LogRecords
) -> Floats | None:
    """Standard deviations (n, 3) of the fixes east, north, up; None if the file has none, or only zeros. [m]

    A zero means unknown. Standard deviations of x, y, z are converted to east, north, up, with the covariances taken
    into account. The file states each covariance as the square root of its absolute value, with the sign of the
    covariance.
    """
    is_turned = "sdx(m)" in header.indices
    names = ("sdx(m)", "sdy(m)", "sdz(m)") if is_turned else ("sde(m)", "sdn(m)", "sdu(m)")
    if any(column not in header.indices for column in names):
        return None
    sigmas = table[:, [header.indices[column] for column in names]]
    records.leave_out(
        ~((sigmas >= 0) & (sigmas <= _MAX_RTKLIB_SIGMA_M)).all(axis=1),
        lambda i: (
            f"standard deviations must be from 0 to {_MAX_RTKLIB_SIGMA_M:g} m "
            f"(got {', '.join(f'{sigma:g}' for sigma in sigmas[i])})"
        ),
    )
    known = known_sigmas(sigmas)
    if known is None or not is_turned:
        return known
    sigmas = filled_sigmas(known)
    covariance = np.zeros((len(sigmas), 3, 3))
    covariance[:, range(3), range(3)] = sigmas**2
    for column, i, j in (("sdxy(m)", 0, 1), ("sdyz(m)", 1, 2), ("sdzx(m)", 2, 0)):
        if column in header.indices:
            roots = np.nan_to_num(
                np.clip(table[:, header.indices[column]], -_MAX_RTKLIB_SIGMA_M, _MAX_RTKLIB_SIGMA_M)
            )
            covariance[:, i, j] = covariance[:, j, i] = roots * np.abs(roots)
    axes: Floats = np.moveaxis(axes_at_places(latitude, longitude), -1, 0)
    squares = np.einsum("nij,njk,nik->ni", axes, covariance, axes)
    local_sigmas: Floats = np.sqrt(np.maximum(squares, 0.0))
    return local_sigmas
