"""Solutions of RTKLIB (`.pos`): a line of % that names time scale and columns, then a place with its errors in each.

    % (lat/lon/height=WGS84/ellipsoidal,Q=1:fix,2:float,3:sbas,4:dgps,5:single,6:ppp,ns=# of satellites)
    %  GPST                  latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m) ...
    2026/06/01 05:20:19.250   48.086600000   11.279700000  3000.0000   1  12   0.0100   0.0080   0.0200 ...

Times are in GPST, UTC or JST (UTC + 9 h), as a date or as a GPS week and its seconds in that scale. Places are
latitude and longitude in degrees or in degrees, minutes and seconds with a height, or Earth-fixed x, y, z. Heights
are `ellipsoidal`, or `geodetic`, which is above the geoid there. Cells are parted by blanks, or by what stands behind
the name of the first column.

Source: RTKLIB 2.4.3, src/solution.c, functions outsolheads, outsols, outpos and outecef, which write such files.
"""

import math
import re
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from bisar_budget.faults import shown
from bisar_budget.paths.earth import Floats, Geodetic, axes_at, geodetic_places
from bisar_budget.paths.flight import Log, PathFileError, hold_to_bytes
from bisar_budget.paths.instant import DAY, GPS_EPOCH, WEEK, Instant, parse_instant
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

LARGEST = 200_000_000  # bytes; a million places
_COLUMNS = re.compile(rb"(?m)^%[ \t]*(GPST|UTC|JST)\b[^\r\n]*(latitude\(|x-ecef\(m\)|e-baseline\(m\))")
_HEADER = re.compile(r"% ?(GPST|UTC|JST) ?([,;]?) ?((?:latitude|x-ecef|e-baseline)\(.*)")
_DATUM = re.compile(r"(?:height|ecef)=([^/,)]+)")
_LEAST_ROW = 8  # bytes
_NAME = re.compile(r"[a-z-]+\([^)]{0,9}\)|[A-Za-z]+")
_DATE = re.compile(r"(\d{4})/(\d\d)/(\d\d)", re.ASCII)
_CLOCK = re.compile(r"([01]\d|2[0-3]):([0-5]\d):([0-5]\d(?:\.\d{1,12})?|60(?:\.0{1,12})?)", re.ASCII)
_JST = 9 * 3600.0  # s ahead of UTC
_QUALITY = {1: "fix", 2: "float", 3: "sbas", 4: "dgps", 5: "single", 6: "ppp", 7: "dead reckoning"}
_LARGEST_SIGMA_M = 1e5


class _Columns(NamedTuple):
    """Time system, what parts cells other than blanks, and the place of each column behind the two of the time.

    `width` is how many cells a line has. Latitude and longitude have three cells each where `is_in_minutes`.
    """

    system: str
    delimiter: str
    columns: dict[str, int]
    width: int
    is_in_minutes: bool


def is_solution(data: bytes) -> bool:
    """Whether a file has the line that names the columns of a solution."""
    return bool(_COLUMNS.search(data[:100_000]))


def read_solution(data: bytes, name: str, keys: LogKeys) -> Log:
    """Read a solution of at most `LARGEST` bytes, as every reader of `LOG_FORMATS` does.

    The log has standard deviations of each place along east, north and up, where the file has some that are not 0.
    """
    hold_to_bytes(data, LARGEST, name)
    header: _Columns | None = None
    said, lines, days, numbers = "", [], [], []
    broken: dict[int, str] = {}
    for number, text in enumerate(decoded(data, name).splitlines(), 1):
        if text.startswith("%"):
            if _DATUM.search(text):
                said = text
            found = _header(text, f"{name}:{number}")
            if found is not None and header not in (None, found):
                raise PathFileError(f"{name}:{number}: names other columns than the lines before")
            header = found or header
        elif text.strip():
            if header is None:
                raise PathFileError(
                    f"{name}:{number}: no line that begins with '%  GPST', UTC or JST names the columns before it"
                )
            try:
                day, row = _row(text, header, f"{name}:{number}")
            except PathFileError as fault:
                broken[number] = str(fault)
                if len(broken) > most_left_out(len(data) // _LEAST_ROW):
                    break
                continue
            if row[header.columns.get("Q", 0)] or "Q" not in header.columns:
                lines.append(number)
                days.append(day)
                numbers.append(row)
    if header is None or not (lines or broken):
        raise PathFileError(f"{name}: has no solution")
    records = LogRecords(name, len(lines), lines, broken)
    scale = "gps" if header.system == "GPST" else "utc"
    hold_to_scale(scale, keys, name)
    _hold_to_datum(said, name)
    table = np.array(numbers)
    seconds = table[:, -1] - (_JST if header.system == "JST" else 0.0)
    start = Instant(days[0], 0.0).after(float(seconds[0]))
    times = (np.array(days) - days[0]) * DAY + (seconds - seconds[0])
    words = "RTKLIB solution" + _qualities(table, header)
    if "x-ecef(m)" in header.columns:
        hold_to_ellipsoid(keys, name, "has x, y, z")
        at = header.columns["x-ecef(m)"]
        with np.errstate(all="ignore"):  # a place that cannot be is refused later
            latitude, longitude, height = geodetic_places(table[:, at : at + 3])
    else:
        latitude, longitude = (_radians(table, header, axis, records) for axis in ("latitude", "longitude"))
        height = _heights(table[:, header.columns["height(m)"]], said, keys, name)
    sigmas = _sigmas(table, header, latitude, longitude, records)
    return geodetic_log(records, words, times, start, scale, (latitude, longitude, height), sigmas)


def _header(text: str, where: str) -> _Columns | None:
    """Columns that a line of % names; None where it says something else."""
    match = _HEADER.match(" ".join(text.split()))
    if match is None:
        return None
    if match[3].startswith("e-baseline"):
        raise PathFileError(
            f"{where}: has baselines from a base station, no places",
            "accepted: latitude, longitude and height, or x, y, z of RTKLIB's options of the output",
        )
    columns: dict[str, int] = {}
    place = 2  # behind the date and the time of day, or the week and its seconds
    is_in_minutes = match[3].startswith("latitude(d'\")")
    for column in _NAME.findall(match[3]):
        columns.setdefault(column.split("(")[0] if column.startswith(("latitude", "longitude")) else column, place)
        place += 3 if is_in_minutes and column.startswith(("latitude", "longitude")) else 1
    wanted = (
        ("x-ecef(m)", "y-ecef(m)", "z-ecef(m)") if "x-ecef(m)" in columns else ("latitude", "longitude", "height(m)")
    )
    missing = [column for column in wanted if column not in columns]
    if missing:
        raise PathFileError(f"{where}: names no column {missing[0]}")
    after = match[3][match[3].index(")") + 1 :][:1]
    return _Columns(match[1], after if after in ",;" else "", columns, place, is_in_minutes)


def _row(text: str, header: _Columns, where: str) -> tuple[int, list[float]]:
    """Modified Julian day, and the numbers of a line: those of the file, behind them the seconds of the day."""
    cells = (text.replace(header.delimiter, " ") if header.delimiter else text).split()
    if len(cells) != header.width:
        raise PathFileError(f"{where}: has {counted(len(cells), 'cell')}, the columns need {header.width}")
    if "/" in cells[0]:
        day, clock = _day(cells[0]), _CLOCK.fullmatch(cells[1])
        if day is None or clock is None:
            said = shown(f"{cells[0]} {cells[1]}")
            raise PathFileError(f"{where}: must begin with a time like 2026/06/01 05:20:19.250 (got {said!r})")
        seconds = int(clock[1]) * 3600.0 + int(clock[2]) * 60.0 + float(clock[3])
    else:
        week, second = number_in(cells[0]), number_in(cells[1])
        if week is None or second is None or week % 1 or not (0 <= week <= 9999 and 0 <= second <= WEEK):
            said = shown(f"{cells[0]} {cells[1]}")
            raise PathFileError(
                f"{where}: must begin with a GPS week and its second, like 2421 105619.250 (got {said!r})"
            )
        days, seconds = divmod(second, DAY)
        day = GPS_EPOCH + 7 * int(week) + int(days)
    row = [0.0, 0.0]  # in the places of the time
    for cell in cells[2:]:
        try:
            value = float(cell) if cell.isascii() and "_" not in cell else None
        except ValueError:
            value = None
        if value is None:
            raise PathFileError(f"{where}: must have numbers behind the time (got {shown(cell)!r})")
        row.append(value if math.isfinite(value) else math.nan)  # such as the ratio of no ambiguities
    return day, [*row, seconds]


@lru_cache(maxsize=64)
def _day(text: str) -> int | None:
    """Modified Julian day of 2026/06/01; None where the text is no date."""
    match = _DATE.fullmatch(text)
    instant = parse_instant("{}-{}-{}T00:00:00Z".format(*match.groups())) if match else None
    return None if instant is None else instant.day


def _radians(table: Floats, header: _Columns, axis: str, records: LogRecords) -> Floats:
    at = header.columns[axis]
    if not header.is_in_minutes:
        return np.radians(table[:, at])
    degrees, minutes, seconds = table[:, at : at + 3].T
    # RTKLIB's deg2dms and dms2deg: the sign is that of the degrees, -0 too.
    sexagesimal = [(minutes, "minutes"), (seconds, "seconds")]
    for values, said in sexagesimal:
        records.leave_out(
            ~((values >= 0) & (values <= 60)),
            lambda i, values=values, said=said: f"{axis} has {values[i]:.6g} {said}",  # type: ignore[misc]
        )
    found: Floats = np.copysign(np.radians(np.abs(degrees) + minutes / 60 + seconds / 3600), degrees)
    return found


def _hold_to_datum(said: str, name: str) -> None:
    """Refuse places of another datum than WGS-84, or a frame of the ITRF, by the line of % that says it."""
    match = _DATUM.search(said)
    if match is not None and not is_wgs84(match[1]):
        raise PathFileError(f"{name}: has places of the datum {shown(match[1])}", "accepted: WGS84")


def _heights(heights: Floats, said: str, keys: LogKeys, name: str) -> Floats:
    """Heights above the ellipsoid, by the line of % that says what they and the places count from."""
    match = re.search(r"height=[^/,)]+/(\w+)", said)
    if match is not None and match[1] == "ellipsoidal":
        hold_to_ellipsoid(keys, name)
        return heights
    if keys.geoid_separation is None and match is None:
        raise needs_separation(
            f"{name}: has no line of % that says whether heights are above the ellipsoid or the geoid"
        )
    return from_sea_level(heights, None, keys, name)


def _qualities(table: Floats, header: _Columns) -> str:
    """How many places have which quality, the most frequent first; empty without the column."""
    if "Q" not in header.columns:
        return ""
    values, counts = np.unique(table[:, header.columns["Q"]], return_counts=True)
    found = sorted(zip(counts.tolist(), values.tolist(), strict=True), key=lambda one: -one[0])
    said: Sequence[str] = [f"{_QUALITY.get(quality, f'quality {quality:g}')} {count}" for count, quality in found[:4]]
    return f" ({', '.join(said)})"


def _sigmas(
    table: Floats, header: _Columns, latitude: Floats, longitude: Floats, records: LogRecords
) -> Floats | None:
    """Standard deviations (n, 3) east, north, up [m]; None where the file has none, or zeros alone.

    A 0 states nothing. Those of x, y, z are turned with their covariances, of which the file has the signed roots.
    """
    is_turned = "sdx(m)" in header.columns
    names = ("sdx(m)", "sdy(m)", "sdz(m)") if is_turned else ("sde(m)", "sdn(m)", "sdu(m)")
    if any(column not in header.columns for column in names):
        return None
    own = table[:, [header.columns[column] for column in names]]
    records.leave_out(
        ~((own >= 0) & (own <= _LARGEST_SIGMA_M)).all(axis=1),
        lambda i: (
            f"standard deviations must be from 0 to {_LARGEST_SIGMA_M:g} m "
            f"(got {', '.join(f'{one:g}' for one in own[i])})"
        ),
    )
    known = known_sigmas(own)
    if known is None or not is_turned:
        return known
    own = filled_sigmas(known)
    covariance = np.zeros((len(own), 3, 3))
    covariance[:, range(3), range(3)] = own**2
    for column, i, j in (("sdxy(m)", 0, 1), ("sdyz(m)", 1, 2), ("sdzx(m)", 2, 0)):
        if column in header.columns:
            roots = np.nan_to_num(np.clip(table[:, header.columns[column]], -_LARGEST_SIGMA_M, _LARGEST_SIGMA_M))
            covariance[:, i, j] = covariance[:, j, i] = roots * np.abs(roots)
    places: Any = (latitude, longitude, np.zeros_like(latitude))
    axes: Floats = np.moveaxis(np.array(axes_at(Geodetic(*places)).axes), -1, 0)
    squares = np.einsum("nij,njk,nik->ni", axes, covariance, axes)
    found: Floats = np.sqrt(np.maximum(squares, 0.0))
    return found
