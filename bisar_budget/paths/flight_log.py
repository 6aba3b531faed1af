"""Logs of flights as CSV: a header that names quantity and unit of each column, then a fix in each line.

    # comment
    time [s], latitude [deg], longitude [deg], height [m]
    0.00, 48.086600, 11.279700, 3000.0

Time is `time [s]`, counted from any start, or stamps of ISO 8601: `utc` with a Z at the end, `gpst` or `tai` without.
`time [UTC]` is the same as `utc`, and a `time` without a unit is in the scale of the mission file. The coordinates of
a fix are `latitude`, `longitude` and `height` above the ellipsoid of WGS-84 or `altitude` above mean sea level, or
Earth-fixed `x`, `y`, `z`, or `east`, `north`, `up` of the scene's centre. `geoid_separation` turns an altitude into a
height. `sigma_east`, `sigma_north`, `sigma_up` are one-sigma errors of a fix. Their names in other programs are
accepted too. A cell of such a column without a number above 0 is an unknown error. All further columns are ignored.
Cells are separated by commas, semicolons or tabs. Exporters have their own headers, see below.
"""

import csv
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from bisar_budget import units
from bisar_budget.faults import InvalidValueError, fault_words, shown
from bisar_budget.paths.earth import Floats, Geodetic, axes_at, earth_fixed_places, geodetic_places
from bisar_budget.paths.flight import Log, PathFileError, hold_to_bytes
from bisar_budget.paths.instant import DAY, GPS_EPOCH_DAY, SCALES, WEEK_S, Instant, parse_instant
from bisar_budget.paths.log_places import (
    NO_KEYS,
    LogKeys,
    LogRecords,
    counted,
    from_sea_level,
    hold_to_ellipsoid,
    hold_to_scale,
    is_wgs84,
    known_sigmas,
    level_sigmas,
    most_left_out,
    needs_separation,
    one_instance,
    unix_instant,
    usable_log,
)

MAX_CSV_BYTES = 200_000_000  # bytes; four hours at 200 Hz
_CHUNK_LINES = 1 << 16  # lines that are in memory as text and as numbers at the same time
_MAX_COORDINATE_M = 1e9  # beyond the Moon
_MAX_TIME_S = 1e11  # 3000 years, so that Unix time is accepted
_MIN_RADIUS_M = 6.2e6  # from the Earth's centre; the poles are at 6.357e6
_MAX_GEOID_SEPARATION_M = 200.0
_MAX_LATITUDE_RAD = math.pi / 2 * (1 + 1e-12)  # 90 deg, rounded
_GEODETIC = ("latitude", "longitude", "height")
_EARTH_FIXED, _LOCAL = ("x", "y", "z"), ("east", "north", "up")
_COORDINATES = (_GEODETIC, _EARTH_FIXED, _LOCAL)
_SCALE_OF_STAMP = {"utc": "utc", "gpst": "gps", "gps": "gps", "tai": "tai"}  # names of columns, or units of a time
_HEIGHT_COLUMNS = ("altitude", "geoid_separation")
_LEVEL_ACCURACIES = ("horizontal_accuracy", "vertical_accuracy")
_SIGMA_COLUMNS = tuple(tuple(f"sigma_{axis}" for axis in kind) for kind in (_LOCAL, _EARTH_FIXED))
_ACCURACY_COLUMNS = (*_LEVEL_ACCURACIES, *_SIGMA_COLUMNS[0], *_SIGMA_COLUMNS[1])
# Names of columns of accuracy: `sde` of RTKLIB, `std_lat`, `height_sigma`; `hAcc` of u-blox, `eph` of PX4.
_SIGMA_WORD = r"(?:sigma|σ|sd|std|stdev|stddev|std_dev|accuracy)"
_AXIS_WORD = r"(east|north|up|e|n|u|longitude|latitude|height|altitude|lon|lat|alt|x|y|z)"
_SIGMA_NAME = re.compile(f"{_SIGMA_WORD}_?{_AXIS_WORD}|{_AXIS_WORD}_{_SIGMA_WORD}").fullmatch
_LEVEL_NAMES = {
    "horizontal_accuracy": ("horizontal_accuracy", "accuracy_horizontal", "hacc", "h_acc", "eph", "accuracy"),
    "vertical_accuracy": (
        "vertical_accuracy",
        "accuracy_vertical",
        "vacc",
        "v_acc",
        "epv",
        "height_accuracy",
        "altitude_accuracy",
        "accuracy_height",
    ),
}
_AXIS_OF_WORD = {
    "e": "east",
    "lon": "east",
    "longitude": "east",
    "n": "north",
    "lat": "north",
    "latitude": "north",
    "u": "up",
    "alt": "up",
    "altitude": "up",
    "height": "up",
}
_DIMENSIONS = {"latitude": units.ANGLE, "longitude": units.ANGLE, "time": units.TIME}
_HEADER_CELL = re.compile(r"([^\[\]()]*)(?:\[([^\[\]]*)\])?")
_QUOTED = re.compile('"').search
_NUMBER_BYTES = b"0123456789+-.eE \t"
_SECOND = r"(?:[0-5]\d(?:[.,]\d{1,12})?|60(?:[.,]0{1,12})?)"  # 59.996 is rounded to 60.00
_SECOND_WITH_ZONE = re.compile(_SECOND + r"(?:Z|\+00:?00)", re.ASCII).fullmatch
_SECOND_WITHOUT_ZONE = re.compile(_SECOND, re.ASCII).fullmatch
_SECOND_WITH_OR_WITHOUT_ZONE = re.compile(_SECOND + r"(?:Z|\+00:?00)?", re.ASCII).fullmatch
_DATUM_COMMENT = re.compile(
    r"#\W*(?:geodetic )?(?:datum|crs|reference (?:frame|system))\s*[:=]\s*(\S.*)", re.IGNORECASE
)
_MIN_HALVED_ROWS = 64  # rows with a fault are halved down to this count, and then read one by one
_STAMP_EXAMPLE = "2026-06-01T05:20:31.250Z"
_MAX_CLOCK_DRIFT_S = 1.0  # between an exporter's two clocks, in addition to the whole second of the coarse clock


@dataclass(frozen=True)
class _Column:
    """A column that is read: its name, unit as written, factor to SI and index in a row. An instant has no unit.

    Columns of exporters have the names of plain logs, and `unix` since 1970 in UTC, GPS `week`, kind of `fix`, number
    of the `receiver`.
    """

    name: str
    unit: str = ""
    scale: float = 1.0
    index: int = -1


class _Vendor(NamedTuple):
    """An exporter of logs, with all names of columns in small letters.

    Attributes
    ----------
    words : str
        The exporter in reports.
    signs : frozenset of str
        Names of columns that identify the exporter.
    columns : mapping
        The column that is read, by the exporter's name of it.
    least_fix : int
        Smallest number of the kind of fix that has a height.
    """

    words: str
    signs: frozenset[str]
    columns: Mapping[str, _Column]
    least_fix: int = 0


@dataclass(frozen=True)
class _Header:
    """The header of a log, and the columns that are read.

    Attributes
    ----------
    line : int
        Line of the header, from 1.
    delimiter : str
        Character between cells.
    width : int
        Number of cells in a row.
    numbers : tuple of _Column
        Columns of numbers.
    stamp : _Column, optional
        Column of instants.
    scale : str
        Scale of the instants.
    zone : callable
        Matches the seconds and the zone of a stamp: a zone is needed, forbidden or optional.
    vendor : _Vendor, optional
        The exporter.
    accuracy : tuple of _Column
        Columns of one-sigma errors, whose cells may be empty.
    """

    line: int
    delimiter: str
    width: int
    numbers: tuple[_Column, ...]
    stamp: _Column | None = None
    scale: str = "utc"
    zone: Callable[[str], object] = _SECOND_WITH_ZONE
    vendor: _Vendor | None = None
    accuracy: tuple[_Column, ...] = ()

    @property
    def columns(self) -> tuple[_Column, ...]:
        """Columns of a table: numbers, then errors."""
        return (*self.numbers, *self.accuracy)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(column.name for column in self.columns)

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the three coordinates."""
        return next((kind for kind in _COORDINATES if kind[1] in self.names), _GEODETIC)

    def index_of(self, name: str) -> int | None:
        """Index of a column in a table; None without the column."""
        return self.names.index(name) if name in self.names else None


class _Table(NamedTuple):
    """Rows of a log.

    Attributes
    ----------
    lines : (n,)
        Lines of the rows in the file.
    numbers : (n, columns)
        Numbers in units of the file.
    minutes, seconds : (n,)
        Instant as whole minutes since MJD 0 and the seconds after; NaN in rows without an instant. [s]
    """

    lines: NDArray[np.int64]
    numbers: Floats
    minutes: Floats
    seconds: Floats


def is_csv(data: bytes) -> bool:
    """Whether the first line that is neither blank nor a comment names columns of coordinates."""
    head = data[:100_000].decode("utf-8-sig", "replace").replace("\r\n", "\n").replace("\r", "\n").split("\n")
    header = next(filter(_has_content, _dataflash_as_csv(head)), "")
    cells = header.split(max(",;\t", key=header.count))
    names = {_name_of(cell)[0] for cell in cells}
    return _vendor_of(cells) is not None or any(names.issuperset(kind[:2]) for kind in _COORDINATES)


def read_csv(data: bytes, name: str, keys: LogKeys = NO_KEYS) -> Log:
    """Read a log of a flight, UTF-8 of at most `MAX_CSV_BYTES` bytes, as every reader of `LOG_FORMATS` does.

    Geodetic coordinates become Earth-fixed coordinates. Instants become seconds after the first instant.
    """
    lines = _dataflash_as_csv(_text(data, name).split("\n"))
    header = _header(lines, name, keys)
    _hold_to_datum(lines[: header.line], name)
    rows = _all_rows(lines, header, name)
    table, without_fix = _with_fix(rows.table, header, keys, name)
    records = LogRecords(name, len(table.lines), table.lines, rows.broken)
    times, start, clock_words = _times(table, header, records)
    coordinates = _coordinates(table, header, records, keys)
    words = header.vendor.words if header.vendor else f"CSV of {', '.join(header.axes)}"
    words += "" if keys.instance is None else f", instance {keys.instance}"
    is_earth_fixed = header.axes != _LOCAL
    log = usable_log(
        records,
        words,
        times,
        start,
        header.scale,
        lambda kept: _earth_fixed(coordinates[:, kept], header),
        clock_words=clock_words,
        is_earth_fixed=is_earth_fixed,
        sigmas=_sigmas(table, header, coordinates),
        geodetic=tuple(coordinates) if header.axes == _GEODETIC else None,
    )
    without_fix += rows.empty
    without_fix_words = f", {counted(without_fix, 'row')} without a fix left out" if without_fix else ""
    return replace(log, words=log.words + without_fix_words)


def _with_fix(table: _Table, header: _Header, keys: LogKeys, name: str) -> tuple[_Table, int]:
    """The rows of the chosen receiver that have a fix, and the number of rows without a fix.

    A log of several receivers is refused unless the mission file chooses a receiver.
    """
    receiver = header.index_of("receiver")
    if keys.instance is not None and receiver is None:
        raise PathFileError(f"{name}: has no column that numbers receivers", key="instance")
    if header.vendor is None:
        return table, 0
    numbers = table.numbers
    fix, unix = header.index_of("fix"), header.index_of("unix")
    latitude, longitude = (header.names.index(axis) for axis in _GEODETIC[:2])
    has_place = (numbers[:, latitude] != 0) | (numbers[:, longitude] != 0)
    if fix is not None:
        has_place &= numbers[:, fix] >= header.vendor.least_fix
    if unix is not None:
        has_place &= numbers[:, unix] > 0
    if not has_place.any():
        raise PathFileError(f"{name}: has no row with a fix")
    is_kept = has_place
    if receiver is not None:
        instances, counts = np.unique(numbers[has_place, receiver], return_counts=True)
        chosen = one_instance(dict(zip(instances.tolist(), counts.tolist(), strict=True)), keys, name)
        is_kept = has_place & (numbers[:, receiver] == chosen)
    return _Table(*(column[is_kept] for column in table)), int((~has_place).sum())


def _hold_to_datum(lines: Sequence[str], name: str) -> None:
    """Refuse a log with a comment before the header that names another datum than WGS-84."""
    for number, line in enumerate(lines, 1):
        match = _DATUM_COMMENT.match(line.strip())
        if match is not None and not is_wgs84(match[1]):
            raise PathFileError(
                f"{name}:{number}: has places of the datum {shown(match[1])}",
                "accepted: WGS-84 or ITRF",
            )


def _times(table: _Table, header: _Header, records: LogRecords) -> tuple[Floats, Instant | None, str]:
    """Times [s], the instant from which they count, and the words for the accuracy of that instant."""
    time_index = header.index_of("time")
    counted_s = np.zeros(len(table.lines))
    if time_index is not None:
        column, raw = header.numbers[time_index], table.numbers[:, time_index]
        with np.errstate(over="ignore"):
            counted_s = raw * column.scale
        records.leave_out(
            np.abs(counted_s) > _MAX_TIME_S, lambda i: f"time {raw[i]:.10g} {column.unit} is beyond {_MAX_TIME_S:g} s"
        )
    unix, week = header.index_of("unix"), header.index_of("week")
    if unix is not None:
        raw = table.numbers[:, unix]
        scale = header.numbers[unix].scale
        records.leave_out(raw * scale > _MAX_TIME_S, lambda i: f"time {raw[i]:.10g} us is beyond {_MAX_TIME_S:g} s")
        first = raw[records.first]
        return (raw - first) * scale, unix_instant(int(first)), ""
    if week is not None:
        weeks = table.numbers[:, week]
        records.leave_out(
            (weeks % 1 != 0) | (weeks < 0) | (weeks > 9999),
            lambda i: f"GPS week must be a whole number from 0 to 9999 (got {weeks[i]:g})",
        )
        first = records.first
        start = Instant(GPS_EPOCH_DAY + 7 * int(weeks[first]), 0.0).after(float(counted_s[first]))
        return (weeks - weeks[first]) * WEEK_S + (counted_s - counted_s[first]), start, ""
    if header.stamp is None:
        return counted_s, None, ""
    minutes, seconds = table.minutes, table.seconds
    if time_index is not None:
        return _by_two_clocks(counted_s, minutes + seconds, records)
    start = Instant(0, 0.0).after(float(minutes[0])).after(float(seconds[0]))
    return (minutes - minutes[0]) + (seconds - seconds[0]), start, ""


def _by_two_clocks(counted_s: Floats, instants: Floats, records: LogRecords) -> tuple[Floats, Instant, str]:
    """Times of a clock that counts fractions of seconds, in UTC by a clock that writes whole seconds.

    An instant is cut to its second. So each instant less its time bounds the start: the start is at the bound or less
    than a second after it. The start is taken in the middle of the interval that all bounds allow.
    """
    has_instant = np.isfinite(instants) & records.is_usable
    if not has_instant.any():
        raise PathFileError(f"{records.name}: has no instant of UTC")
    offsets = instants - counted_s
    median_offset = float(np.median(offsets[has_instant]))
    deviations = np.abs(offsets - median_offset)
    records.leave_out(
        has_instant & (deviations > 1.0 + _MAX_CLOCK_DRIFT_S),
        lambda i: f"its clocks, time(millisecond) and datetime(utc), drift apart by {deviations[i]:.3g} s",
    )
    bounds = offsets[has_instant & records.is_usable]
    earliest, latest = float(bounds.max()), float(bounds.min()) + 1.0
    if earliest - latest > _MAX_CLOCK_DRIFT_S:
        raise PathFileError(
            f"{records.name}: its clocks, time(millisecond) and datetime(utc), drift apart by "
            f"{earliest - latest:.3g} s",
            "accepted: the log of one flight",
        )
    start = Instant(0, 0.0).after((earliest + latest) / 2 + float(counted_s[0]))
    return counted_s - counted_s[0], start, f", UTC to {abs(latest - earliest) / 2:.2g} s by whole seconds"


def _coordinates(table: _Table, header: _Header, records: LogRecords, keys: LogKeys) -> Floats:
    """Coordinates (3, n) along the header's axes, heights above the ellipsoid. [rad, m]

    Records with impossible coordinates are left out.
    """
    axes = header.axes
    is_geodetic = axes == _GEODETIC
    is_above_sea_level = is_geodetic and "height" not in header.names
    columns = axes if not is_above_sea_level else (*_GEODETIC[:2], "altitude")
    coordinates = []
    for axis in columns:
        index = header.names.index(axis)
        column, raw = header.numbers[index], table.numbers[:, index]
        with np.errstate(over="ignore"):
            values = raw * column.scale
        limit = {"latitude": _MAX_LATITUDE_RAD, "longitude": 2 * math.pi * (1 + 1e-12)}.get(axis, _MAX_COORDINATE_M)
        limit_words = {"latitude": "90 deg", "longitude": "360 deg"}.get(axis, f"{_MAX_COORDINATE_M:g} m")
        records.leave_out(
            np.abs(values) > limit,
            lambda i, raw=raw, column=column, limit_words=limit_words: (  # type: ignore[misc]
                f"{column.name} {raw[i]:.10g} {column.unit} is beyond {limit_words}"
            ),
        )
        coordinates.append(values)
    if not is_above_sea_level:
        hold_to_ellipsoid(
            keys, records.name, "has heights above the ellipsoid" if is_geodetic else f"has {', '.join(axes)}"
        )
    else:
        separation_index = header.index_of("geoid_separation")
        separations = None
        if separation_index is not None:
            column, raw = header.numbers[separation_index], table.numbers[:, separation_index]
            separations = raw * column.scale
            records.leave_out(
                np.abs(separations) > _MAX_GEOID_SEPARATION_M,
                lambda i: f"geoid_separation {raw[i]:.10g} {column.unit} is beyond {_MAX_GEOID_SEPARATION_M:g} m",
            )
        coordinates[2] = from_sea_level(coordinates[2], separations, keys, records.name)
    if axes == _EARTH_FIXED:
        radius = np.sqrt(sum(axis**2 for axis in coordinates))
        records.leave_out(
            radius < _MIN_RADIUS_M,
            lambda i: (
                f"x, y, z are {radius[i] / 1e3:.4g} km from the Earth's centre; Earth-fixed coordinates are wanted, "
                "places of the scene are named east, north, up"
            ),
        )
    return np.array(coordinates)


def _earth_fixed(coordinates: Floats, header: _Header) -> Floats:
    """Positions (n, 3) from coordinates (3, n): Earth-fixed, or in the axes of the scene. [m]"""
    return earth_fixed_places(*coordinates) if header.axes == _GEODETIC else np.ascontiguousarray(coordinates.T)


def _sigmas(table: _Table, header: _Header, coordinates: Floats) -> Floats | None:
    """One-sigma errors (n, 3) east, north, up at coordinates (3, n). [m]

    An error that the log does not state is NaN; None if the log states no error at all.
    """
    figures = {
        column.name: table.numbers[:, header.names.index(column.name)] * column.scale for column in header.accuracy
    }
    local_sigmas, earth_fixed_sigmas = (
        np.column_stack([figures[name] for name in names]) if figures.keys() >= set(names) else None
        for names in _SIGMA_COLUMNS
    )
    if local_sigmas is not None:
        return known_sigmas(local_sigmas)
    if earth_fixed_sigmas is None:
        return level_sigmas(*(figures.get(name) for name in _LEVEL_ACCURACIES))
    if header.axes == _GEODETIC:
        latitude, longitude = coordinates[:2]
    else:
        latitude, longitude, _ = geodetic_places(coordinates.T)
    points: Any = (latitude, longitude, np.zeros_like(latitude))
    axes: Floats = np.moveaxis(np.array(axes_at(Geodetic(*points)).axes), -1, 0)
    usable_sigmas = np.where(np.all(earth_fixed_sigmas > 0, axis=1, keepdims=True), earth_fixed_sigmas, np.nan)
    return known_sigmas(np.sqrt(np.einsum("nij,nj->ni", axes**2, usable_sigmas**2)))


def _text(data: bytes, name: str) -> str:
    """Text of the file, with a line feed at the end of each line."""
    hold_to_bytes(data, MAX_CSV_BYTES, name)
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise PathFileError(f"{name}:1: is in UTF-16; save it in UTF-8")
    zero_index = data.find(b"\0")
    if zero_index >= 0:
        raise PathFileError(
            f"{name}:{_line_of(data, zero_index)}: has a zero byte; CSV is text in UTF-8, not in UTF-16"
        )
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        offset = error.start
        # The codec that skips the mark counts from behind it.
        offset += 3 if data.startswith(b"\xef\xbb\xbf") and error.object != data else 0
        problem = f"has the byte 0x{data[offset]:02x}, which is not UTF-8; save it in UTF-8"
        raise PathFileError(f"{name}:{_line_of(data, offset)}: {problem}") from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _line_of(data: bytes, byte: int) -> int:
    before = data[:byte].replace(b"\r\n", b"\n")
    return before.count(b"\n") + before.count(b"\r") + 1


def _has_content(line: str) -> bool:
    """Whether a line is neither blank nor a comment."""
    text = line.lstrip()
    return bool(text) and text[0] != "#"


def _name_of(cell: str) -> tuple[str, str | None]:
    """Name of a column in small letters, up to a bracket, and the unit in square brackets."""
    cell = cell.strip()
    match = _HEADER_CELL.fullmatch(cell)
    name = (match[1] if match else re.split(r"[\[(]", cell)[0]).strip().strip('"').lower()
    return name.replace(" ", "_"), match[2].strip() if match and match[2] is not None else None


def _accuracy_of(column: str) -> str | None:
    """The kind of one-sigma error that a column states, by the name of the column; None for all other columns."""
    for level, names in _LEVEL_NAMES.items():
        if column in names:
            return level
    match = _SIGMA_NAME(column)
    if match is None:
        return None
    axis = match[1] or match[2]
    return f"sigma_{_AXIS_OF_WORD.get(axis, axis)}"


def _accuracy_columns(
    cells: Sequence[str], axes: Sequence[str], refuse: Callable[[str], NoReturn]
) -> tuple[_Column, ...]:
    """Columns of one-sigma errors of fixes that have these axes."""
    columns: dict[str, _Column] = {}
    for index, cell in enumerate(cells):
        column, unit = _name_of(cell)
        name = _accuracy_of(column)
        if name is None:
            continue
        if name in columns:
            refuse(f"has two columns of {name}")
        in_brackets = re.search(r"\(([^()]*)\)", cell)
        columns[name] = replace(
            _measured(column, index, unit or (in_brackets[1] if in_brackets else None), refuse), name=name
        )
    for names in _SIGMA_COLUMNS:
        missing = [name for name in names if name not in columns]
        if 0 < len(missing) < len(names):
            present = next(name for name in names if name in columns)
            refuse(f"has {present} and no {missing[0]}; write all of {', '.join(names)}")
    if axes == _LOCAL and _SIGMA_COLUMNS[1][0] in columns:
        refuse(f"has {_SIGMA_COLUMNS[1][0]} beside east; write {', '.join(_SIGMA_COLUMNS[0])}")
    return tuple(columns.values())


def _header(lines: Sequence[str], name: str, keys: LogKeys) -> _Header:
    """The header, from the first line that is neither blank nor a comment."""
    header_index = next((n for n, line in enumerate(lines) if _has_content(line)), None)
    if header_index is None:
        raise PathFileError(f"{name}:1: is empty; its first line names columns, like 'time [s], x [m], y [m], z [m]'")

    def refuse(problem: str) -> NoReturn:
        raise PathFileError(f"{name}:{header_index + 1}: {problem}")

    delimiter = max(",;\t", key=lines[header_index].count)
    cells = _cells(lines[header_index], delimiter)
    if isinstance(cells, str):
        refuse(cells)
    vendor = _vendor_of(cells)
    if vendor is not None:
        return _vendor_header(vendor, cells, delimiter, header_index + 1, f"{name}:{header_index + 1}", keys)
    columns: dict[str, tuple[int, str | None]] = {}
    for index, cell in enumerate(cells):
        column, unit = _name_of(cell)
        if column not in (
            "time",
            *_SCALE_OF_STAMP,
            *_HEIGHT_COLUMNS,
            *(axis for axis_names in _COORDINATES for axis in axis_names),
        ):
            continue
        if column in columns:
            refuse(f"has two columns {column}")
        columns[column] = (index, unit)
    present = [axis_names for axis_names in _COORDINATES if any(axis in columns for axis in axis_names)]
    if not present:
        refuse("names no place; the first line names columns, like 'latitude [deg]', 'x [m]' or 'east [m]'")
    if len(present) > 1:
        axis_name, mixed_axis_name = (
            next(axis for axis in axis_names if axis in columns) for axis_names in present[:2]
        )
        accepted = ", or ".join(map(", ".join, _COORDINATES))
        refuse(f"mixes {axis_name} with {mixed_axis_name}; places are {accepted}")
    axis_names = present[0]
    if axis_names == _GEODETIC and "altitude" in columns:
        if "height" in columns:
            refuse("has both height and altitude; keep one")
        axis_names = (*_GEODETIC[:2], "altitude")
    missing = [axis for axis in axis_names if axis not in columns]
    if missing:
        refuse(f"has no column {missing[0]}")
    time_columns = [column for column in ("time", *_SCALE_OF_STAMP) if column in columns]
    if len(time_columns) > 1:
        refuse(f"has both {time_columns[0]} and {time_columns[1]}; keep one")
    if not time_columns:
        refuse("has no column of time; write 'time [s]' or 'utc'")
    coordinates = [_measured(axis, *columns[axis], refuse) for axis in axis_names]
    same_unit_columns = coordinates[:2] if axis_names[0] == "latitude" else coordinates
    mismatch = next((axis for axis in same_unit_columns if axis.scale != same_unit_columns[0].scale), None)
    if mismatch:
        refuse(
            f"mixes units: {same_unit_columns[0].name} [{same_unit_columns[0].unit}] and "
            f"{mismatch.name} [{mismatch.unit}]"
        )
    if axis_names[-1] == "altitude" and "geoid_separation" in columns:
        coordinates.append(_measured("geoid_separation", *columns["geoid_separation"], refuse))
    elif axis_names[-1] == "altitude" and keys.geoid_separation is None:
        raise needs_separation(
            f"{name}:{header_index + 1}: altitude counts from mean sea level, and there is no column "
            "geoid_separation; a height counts from the ellipsoid of WGS-84"
        )
    accuracy = _accuracy_columns(cells, axis_names, refuse)
    index, unit = columns[time_columns[0]]
    scale = _SCALE_OF_STAMP.get(time_columns[0]) or _SCALE_OF_STAMP.get((unit or "").lower())
    if time_columns[0] in _SCALE_OF_STAMP and unit and _SCALE_OF_STAMP.get(unit.lower()) != scale:
        refuse(f"{time_columns[0]} has the unit {shown(unit)!r}; stamps like {_example(str(scale))} need none")
    zone = _SECOND_WITH_ZONE if scale == "utc" else _SECOND_WITHOUT_ZONE
    if scale is None and not unit and keys.time_scale is not None:
        scale, zone = (
            keys.time_scale,
            _SECOND_WITH_OR_WITHOUT_ZONE if keys.time_scale == "utc" else _SECOND_WITHOUT_ZONE,
        )
    if scale is None:
        time = _measured("time", index, unit, refuse)
        if keys.time_scale is not None:
            refuse(f"time counts in {time.unit}; trajectory.time_scale says of instants in which scale they are")
        return _Header(header_index + 1, delimiter, len(cells), (time, *coordinates), accuracy=accuracy)
    hold_to_scale(scale, keys, f"{name}:{header_index + 1}")
    stamp = _Column(time_columns[0], index=index)
    return _Header(header_index + 1, delimiter, len(cells), tuple(coordinates), stamp, scale, zone, accuracy=accuracy)


def _vendor_header(
    vendor: _Vendor, cells: Sequence[str], delimiter: str, line: int, location: str, keys: LogKeys
) -> _Header:
    """The header of an exporter's log."""
    columns: dict[str, _Column] = {}
    for index, cell in enumerate(cells):
        meaning = vendor.columns.get(cell.strip().lower())
        if meaning is not None:
            columns.setdefault(meaning.name, replace(meaning, index=index))
    if "height" not in columns and "altitude" not in columns:
        raise PathFileError(
            f"{location}: {vendor.words} has no height above the sea or the ellipsoid; one above take-off is no place"
        )
    if "height" in columns:
        columns.pop("altitude", None)
    stamp = columns.pop("utc", None)
    scale = "gps" if "week" in columns else "utc"
    if stamp is not None or not columns.keys().isdisjoint(("unix", "week")):
        hold_to_scale(scale, keys, location)
    elif keys.time_scale is not None:
        raise PathFileError(f"{location}: time counts since the start of the autopilot, and is in no scale")
    accuracy = tuple(columns.pop(name) for name in _ACCURACY_COLUMNS if name in columns)
    numbers = tuple(columns.values())
    return _Header(line, delimiter, len(cells), numbers, stamp, scale, _SECOND_WITH_OR_WITHOUT_ZONE, vendor, accuracy)


def _example(scale: str) -> str:
    return _STAMP_EXAMPLE if scale == "utc" else _STAMP_EXAMPLE[:-1]


def _measured(name: str, index: int, unit: str | None, refuse: Callable[[str], NoReturn]) -> _Column:
    """A column of numbers. A column without a unit, or with a unit of the wrong dimension, is refused."""
    dimension = _DIMENSIONS.get(name, units.LENGTH)
    example = {units.ANGLE: f"{name} [deg]", units.TIME: "time [s]', 'time [UTC]' or 'time [GPST]"}.get(
        dimension, f"{name} [m]"
    )
    if not unit:
        time_scale_hint = ", or say trajectory.time_scale" if name == "time" else ""
        refuse(f"{name} has no unit; write '{example}'{time_scale_hint}")
    try:
        return _Column(name, shown(unit), units.parse_quantity(f"1 {unit}", dimension), index)
    except InvalidValueError as error:
        refuse(fault_words(f"{name} {error.problem.problem}", "", f"write '{example}'", error.problem.hint))


@dataclass(eq=False)
class _Rows:
    """Rows of a log.

    Attributes
    ----------
    tables : list of _Table
        The rows that are read.
    broken : dict
        Messages about rows that cannot be read, by their lines.
    most_broken : int
        Largest number of broken rows that is accepted.
    empty : int
        Number of rows that an exporter left empty.
    """

    tables: list[_Table]
    broken: dict[int, str]
    most_broken: int
    empty: int = 0

    @property
    def table(self) -> _Table:
        """All rows."""
        return _Table(*(np.concatenate(columns) for columns in zip(*self.tables, strict=True)))


def _all_rows(lines: list[str], header: _Header, name: str) -> _Rows:
    """Every row after the header, read in chunks of lines, which is fast and needs little memory."""
    no_values = np.zeros(0)
    empty = _Table(np.zeros(0, dtype=np.int64), np.zeros((0, len(header.columns))), no_values, no_values)
    rows = _Rows([empty], {}, most_left_out(len(lines) - header.line))
    has_rows = False
    for first in range(header.line, len(lines), _CHUNK_LINES):
        chunk = lines[first : first + _CHUNK_LINES]
        content_indices = [
            n for n, line in enumerate(chunk) if line[:1] > "#" or _has_content(line)
        ]  # numbers begin behind #
        if content_indices:
            has_rows = True
            _read_rows([chunk[n] for n in content_indices], np.array(content_indices) + first + 1, header, name, rows)
    if not has_rows:
        raise PathFileError(f"{name}:{header.line}: has a header and no places")
    return rows


def _read_rows(texts: list[str], lines: NDArray[np.int64], header: _Header, name: str, rows: _Rows) -> None:
    """Read rows at once. If that fails, halve the rows until the faulty rows are found."""
    cells = _plain_cells(texts, header) or _quoted_cells(texts, header)
    if cells is not None and np.isfinite(cells[0][:, : len(header.numbers)]).all():
        numbers, stamps = cells
        instants = (np.zeros(len(lines)),) * 2 if stamps is None else _instants(stamps, header)
        if instants is not None:
            rows.tables.append(_Table(lines, numbers, *instants))
            return
    if len(texts) > _MIN_HALVED_ROWS:
        half = len(texts) // 2
        _read_rows(texts[:half], lines[:half], header, name, rows)
        _read_rows(texts[half:], lines[half:], header, name, rows)
        return
    is_sound = []
    for text, line in zip(texts, lines.tolist(), strict=True):
        is_empty = header.vendor is not None and not _has_all_numbers(text, header)  # before the first fix
        fault = None if is_empty else _row_fault(text, header)
        rows.empty += is_empty
        if fault is not None:
            rows.broken[line] = f"{name}:{line}: {fault}"
            if len(rows.broken) > rows.most_broken:
                raise PathFileError(
                    rows.broken[min(rows.broken)]
                    + ("; more than 1 % of the rows cannot be used" if len(rows.broken) > 1 else "")
                )
        is_sound.append(not is_empty and fault is None)
    sound_indices = [index for index, is_good in enumerate(is_sound) if is_good]
    if len(sound_indices) == len(texts):
        raise AssertionError("a row that has no fault was refused")
    if sound_indices:
        _read_rows([texts[index] for index in sound_indices], lines[sound_indices], header, name, rows)


def _has_all_numbers(text: str, header: _Header) -> bool:
    """Whether every number of a row is present. A row with any other fault counts as complete."""
    cells = _cells(text, header.delimiter)
    if isinstance(cells, str) or len(cells) != header.width:
        return True
    return all(cells[column.index].strip() for column in header.numbers)


def _plain_cells(texts: list[str], header: _Header) -> tuple[Floats, list[str] | None] | None:
    """Numbers (n, columns) and stamps of rows without quotes; None if the rows cannot be read in this way."""
    delimiter = header.delimiter
    if {text.count(delimiter) for text in texts} != {header.width - 1} or any(map(_QUOTED, texts)):
        return None
    try:
        numbers = np.loadtxt(
            texts,
            delimiter=delimiter,
            comments=None,
            usecols=[column.index for column in header.columns],
            converters={column.index: _or_nan for column in header.accuracy} or None,
            ndmin=2,
        )
    except ValueError:
        return None
    if header.stamp is None:
        return numbers, None
    index = header.stamp.index
    return numbers, [text.split(delimiter, index + 1)[index].strip() for text in texts]


def _quoted_cells(texts: list[str], header: _Header) -> tuple[Floats, list[str] | None] | None:
    """Numbers and stamps of rows with quotes, like `_plain_cells`, in six times the time."""
    try:
        rows = list(csv.reader(texts, delimiter=header.delimiter, skipinitialspace=True))
        if len(rows) != len(texts) or set(map(len, rows)) != {header.width}:
            return None
        cells = [[row[column.index] for row in rows] for column in header.numbers]
        if any("".join(column).encode().translate(None, _NUMBER_BYTES) for column in cells):
            return None
        errors = [[_or_nan(row[column.index]) for row in rows] for column in header.accuracy]
        numbers = np.array([list(map(float, column)) for column in cells] + errors).T
    except (csv.Error, ValueError):
        return None
    return numbers, None if header.stamp is None else [row[header.stamp.index].strip() for row in rows]


def _or_nan(cell: str) -> float:
    """The number of a cell; NaN for a cell without a number."""
    try:
        return float(cell)
    except ValueError:
        return math.nan


def _instants(texts: list[str], header: _Header) -> tuple[Floats, Floats] | None:
    """Minutes since MJD 0 and the seconds after; None if a text is no instant. [s]

    An instant that an exporter leaves out is NaN.
    """
    is_stated = [bool(text) or header.vendor is None for text in texts]
    minutes = [_minute(text[:17]) if stated else math.nan for text, stated in zip(texts, is_stated, strict=True)]
    seconds = [text[17:] if stated else "00" for text, stated in zip(texts, is_stated, strict=True)]
    if None in minutes or not all(
        header.zone(text) if stated else True for text, stated in zip(seconds, is_stated, strict=True)
    ):
        return None
    numbers = [text.replace("Z", "").partition("+")[0].replace(",", ".") for text in seconds]
    return np.array(minutes, dtype=float), np.array(numbers, dtype=float)


@lru_cache(maxsize=256)
def _minute(text: str) -> float | None:
    """Seconds since MJD 0 of a stamp without its seconds, which many rows share; None if the text is no stamp."""
    instant = parse_instant(f"{text}00Z")
    return None if instant is None else instant.day * DAY + instant.seconds


def _cells(text: str, delimiter: str) -> list[str] | str:
    """Cells of a line, or the reason why the line cannot be split."""
    try:
        rows = list(csv.reader([text, ""], delimiter=delimiter, skipinitialspace=True))
    except csv.Error:
        return f"has a cell of more than {csv.field_size_limit()} letters"
    return rows[0] if len(rows) == 2 else "has a quote that does not end on its line"


def _row_fault(text: str, header: _Header) -> str | None:
    """The reason why a row cannot be read; None for a sound row."""
    cells = _cells(text, header.delimiter)
    if isinstance(cells, str):
        return cells
    if len(cells) != header.width:
        return f"has {counted(len(cells), 'cell')}, the header has {header.width}"
    stamp = "" if header.stamp is None else cells[header.stamp.index].strip()
    is_left_out = header.vendor is not None and not stamp
    if header.stamp is not None and not is_left_out and (_minute(stamp[:17]) is None or not header.zone(stamp[17:])):
        scale = SCALES[header.scale]
        return (
            f"{header.stamp.name} must be an instant of {scale} like {_example(header.scale)} (got {shown(stamp)!r})"
        )
    for column in header.numbers:
        cell = cells[column.index].strip(" \t")
        if not cell:
            return f"{column.name} is empty"
        try:
            value = float(cell) if not cell.encode().translate(None, _NUMBER_BYTES) else None
        except ValueError:
            value = None
        if value is None or not math.isfinite(value):
            is_number = value is not None or cell.lower().lstrip("+-") in ("nan", "inf", "infinity")
            hint = "; write a decimal point" if re.fullmatch(r"[+-]?\d+,\d+", cell, re.ASCII) else ""
            return f"{column.name} must be a {'finite ' * is_number}number (got {shown(cell)!r}){hint}"
    return None


# ---------------------------------------------------------------------- headers of exporters
# Airdata, of DJI and other drones: `time(millisecond),datetime(utc),latitude,longitude,…,
# altitude_above_seaLevel(feet or meters),…`. Source: the headers in the README of drone-comp/m30ttools and in the
# reference of Aarhus University's DroneVideoMeasure, "Drone logfile input format"; the instant is to a second.
#
# PX4, by ulog2csv: topics `vehicle_gps_position` and `sensor_gps` in 1e-7 deg and mm, from release 1.14 on in deg and
# m; `vehicle_global_position` in deg and m, on the clock of the autopilot. Source: PX4-Autopilot msg/SensorGps.msg,
# msg/versioned/VehicleGlobalPosition.msg; pyulog/ulog2csv.py writes the names of fields.
#
# ArduPilot: rows GPS of a dataflash log, from `mavlogdump.py --format csv --types GPS`, or among others in the text
# that Mission Planner and mavlogdump write, whose FMT rows name the columns. Alt is above mean sea level. Source:
# ardupilot libraries/AP_GPS/LogStructure.h (LOG_STRUCTURE_FROM_GPS; a Status of 3 is a fix in three dimensions) and
# AP_GPS.h (undulation), pymavlink/tools/mavlogdump.py.
_DEGREE_RAD = math.pi / 180


def _vendor(words: str, signs: str, least_fix: int = 0, **columns: _Column) -> _Vendor:
    return _Vendor(words, frozenset(signs.split()), columns, least_fix)


_LATITUDE, _LONGITUDE = _Column("latitude", "deg", _DEGREE_RAD), _Column("longitude", "deg", _DEGREE_RAD)
_FIX = _Column("fix")
_HORIZONTAL, _VERTICAL = (_Column(name, "m") for name in _LEVEL_ACCURACIES)
_UNIX = _Column("unix", "us", 1e-6)
_VENDORS = (
    _Vendor(
        "CSV of Airdata",
        frozenset(("time(millisecond)", "datetime(utc)", "latitude", "longitude")),
        {
            "time(millisecond)": _Column("time", "ms", 1e-3),
            "datetime(utc)": _Column("utc"),
            "latitude": _LATITUDE,
            "longitude": _LONGITUDE,
            "altitude_above_sealevel(feet)": _Column("altitude", "ft", 0.3048),
            "altitude_above_sealevel(meters)": _Column("altitude", "m"),
        },
    ),
    _vendor(
        "CSV of PX4's GPS topic",
        "time_utc_usec lat lon fix_type",
        3,
        time_utc_usec=_UNIX,
        lat=_Column("latitude", "1e-7 deg", 1e-7 * _DEGREE_RAD),
        lon=_Column("longitude", "1e-7 deg", 1e-7 * _DEGREE_RAD),
        alt_ellipsoid=_Column("height", "mm", 1e-3),
        alt=_Column("altitude", "mm", 1e-3),
        fix_type=_FIX,
        eph=_HORIZONTAL,
        epv=_VERTICAL,
    ),
    _vendor(
        "CSV of PX4's GPS topic",
        "time_utc_usec latitude_deg longitude_deg fix_type",
        3,
        time_utc_usec=_UNIX,
        latitude_deg=_LATITUDE,
        longitude_deg=_LONGITUDE,
        altitude_ellipsoid_m=_Column("height", "m"),
        altitude_msl_m=_Column("altitude", "m"),
        fix_type=_FIX,
        eph=_HORIZONTAL,
        epv=_VERTICAL,
    ),
    _vendor(
        "CSV of PX4's global position",
        "timestamp lat lon alt terrain_alt",
        1,
        lat_lon_valid=_FIX,
        timestamp=_Column("time", "us", 1e-6),
        lat=_LATITUDE,
        lon=_LONGITUDE,
        alt_ellipsoid=_Column("height", "m"),
        alt=_Column("altitude", "m"),
        eph=_HORIZONTAL,
        epv=_VERTICAL,
    ),
    _vendor(
        "GPS rows of ArduPilot",
        "gwk gms lat lng alt status",
        3,
        gwk=_Column("week"),
        gms=_Column("time", "ms", 1e-3),
        lat=_LATITUDE,
        lng=_LONGITUDE,
        alt=_Column("altitude", "m"),
        status=_FIX,
        i=_Column("receiver"),
        hacc=_HORIZONTAL,
        vacc=_VERTICAL,
    ),
)


def _vendor_of(cells: Sequence[str]) -> _Vendor | None:
    """The exporter with these columns; None for a plain log."""
    names = [cell.strip().lower() for cell in cells]
    return next((vendor for vendor in _VENDORS if vendor.signs.issubset(names)), None)


def _dataflash_as_csv(lines: list[str]) -> list[str]:
    """Lines of a dataflash log as CSV: its GPS rows, with their FMT row as the header, and empty lines for all else.

    Each line keeps its number. HAcc and VAcc of the GPA row with the time and receiver of a GPS row become two more
    cells. Lines of any other file are returned unchanged.
    """
    if not any(line.startswith("FMT,") for line in lines[:100]):
        return lines
    names: dict[str, list[str]] = {}
    accuracies: dict[tuple[str, ...], str] = {}
    for line in lines:
        cells = [cell.strip() for cell in line.split(",")] if line.startswith(("FMT,", "GPA,")) else []
        if cells[:1] == ["FMT"] and cells[3:4] in (["GPS"], ["GPA"]):
            names.setdefault(cells[3], cells[5:])
        elif cells and {"HAcc", "VAcc"}.issubset(names.get("GPA", ())) and len(cells) > len(names["GPA"]):
            row = dict(zip(names["GPA"], cells[1:], strict=False))
            accuracies[_time_and_receiver(row)] = f",{row['HAcc']},{row['VAcc']}"
    accuracy_header = ",HAcc,VAcc" if accuracies else ""
    csv_lines = []
    header = ""
    for line in lines:
        csv_line = ""
        if line.startswith("GPS,") and header:
            csv_line = line
            if accuracy_header:
                row = dict(zip(names["GPS"], (cell.strip() for cell in line.split(",")[1:]), strict=False))
                csv_line = line.rstrip() + accuracies.get(_time_and_receiver(row), ",,")
        elif line.startswith("FMT,") and not header and line.split(",")[3].strip() == "GPS":
            csv_line = header = ",".join(["GPS", *names["GPS"]]) + accuracy_header
        csv_lines.append(csv_line)
    return csv_lines


def _time_and_receiver(row: Mapping[str, str]) -> tuple[str, ...]:
    return tuple(row.get(name, "") for name in ("TimeUS", "I"))
