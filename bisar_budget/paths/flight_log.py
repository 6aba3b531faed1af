"""Reader of flight logs as CSV: a header with the quantity and unit of each column, then one position per line.

    # comment
    time [s], latitude [deg], longitude [deg], height [m]
    0.00, 48.086600, 11.279700, 3000.0

The time column is either `time [s]`, counted from any origin, or contains ISO 8601 time stamps. Time stamps in a
column `utc` end with Z; time stamps in columns `gpst` and `tai` have no zone. `time [UTC]` means the same as `utc`. A
column `time` without a unit has time stamps in the time scale that the mission file states.

A position is stated as `latitude` and `longitude` with `height` above the WGS-84 ellipsoid or `altitude` above mean
sea level. It may also be stated as Earth-fixed `x`, `y`, `z`, or as `east`, `north`, `up` from the scene centre.
`geoid_separation` converts an altitude into a height.

`sigma_east`, `sigma_north` and `sigma_up`, or the names that other programs use, are 1-sigma errors of the
position. A cell in these columns is ignored if it does not contain a positive number. An unknown column that may be
an accuracy is refused. Other columns are not read. Cells are separated by commas, semicolons or tabs. The headers of
some exporters are also accepted; they are listed at the end of this module.
"""

import csv
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from types import MappingProxyType
from typing import NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from bisar_budget import units
from bisar_budget.faults import InvalidValueError, fault_words, shown
from bisar_budget.paths.accuracy_columns import ACCEPTED_ACCURACIES, CROSS_COVARIANCE, UNCLEAR, meaning_of
from bisar_budget.paths.earth import Floats, axes_at_places, earth_fixed_places, geodetic_places
from bisar_budget.paths.flight import Log, PathFileError, hold_to_bytes
from bisar_budget.paths.instant import DAY_S, GPS_EPOCH_DAY, SCALES, WEEK_S, Instant, parse_instant
from bisar_budget.paths.log_places import (
    NO_KEYS,
    LogKeys,
    LogRecords,
    counted,
    filled_sigmas,
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

MAX_CSV_BYTES = 200_000_000  # four hours at 200 Hz
_CHUNK_LINES = 1 << 16  # lines that are in memory both as text and as numbers
_FARTHEST_M = 1e9  # of a coordinate; beyond the Moon
_LATEST_S = 1e11  # of a time; 3000 years, so that Unix time is accepted
_DEEPEST_M = 6.2e6  # smallest distance from the Earth's centre; the poles are at 6.357e6 m
_MAX_LATITUDE_RAD = math.pi / 2 * (1 + 1e-12)  # 90 deg, rounded
_GEODETIC = ("latitude", "longitude", "height")
_POSITION_COLUMNS = (_GEODETIC, ("x", "y", "z"), ("east", "north", "up"))
_STAMPS = {"utc": "utc", "gpst": "gps", "gps": "gps", "tai": "tai"}  # time scales by column name or by unit of `time`
_SPARE = ("altitude", "geoid_separation")
_LEVEL_ACCURACIES = ("horizontal_accuracy", "vertical_accuracy")
_TOTAL = "position_accuracy"  # has no direction, and may lie along any axis
_SIGMA_COLUMNS = tuple(
    tuple(f"sigma_{axis}" for axis in kind) for kind in (_POSITION_COLUMNS[2], _POSITION_COLUMNS[1])
)
_VARIANCE = "variance_"
_EMPTY_CELLS = frozenset(("", "nan", "n/a", "na", "null", "none", "-", "--"))
_NO_NUMBER = -math.inf  # value of an accuracy cell that cannot be read
_COLUMN_DIMENSIONS = {"latitude": units.ANGLE, "longitude": units.ANGLE, "time": units.TIME}
_COLUMN_HEADER_PATTERN = re.compile(r"([^\[\]()]*)(?:\[([^\[\]]*)\])?")
_QUOTED = re.compile('"').search
_IN_NUMBERS = b"0123456789+-.eE \t"
_SECOND = r"(?:[0-5]\d(?:[.,]\d{1,12})?|60(?:[.,]0{1,12})?)"  # receivers round 59.996 to 60.00
_ZONED = re.compile(_SECOND + r"(?:Z|\+00:?00)", re.ASCII).fullmatch
_BARE = re.compile(_SECOND, re.ASCII).fullmatch
_EITHER = re.compile(_SECOND + r"(?:Z|\+00:?00)?", re.ASCII).fullmatch
_DATUM = re.compile(r"#\W*(?:geodetic )?(?:datum|crs|reference (?:frame|system))\s*[:=]\s*(\S.*)", re.IGNORECASE)
_MAX_SCANNED_ROWS = 64  # that are checked one by one, to find the unusable rows
_EXAMPLE = "2026-06-01T05:20:31.250Z"
_CLOCKS_APART_S = 1.0  # accepted drift of an exporter's two clocks, beyond the rounding of one to seconds


class _Column(NamedTuple):
    """A column that is read: its name, its unit as written, the factor to SI, and its index in a row.

    A column of time stamps has no unit. Columns of logs from known exporters are renamed to the names of a plain log.
    Such logs may have further columns: `unix` (time since 1970 in UTC), `week` (GPS week), `fix` (kind of fix), and
    `receiver` (number of the receiver).
    """

    name: str
    unit: str = ""
    scale: float = 1.0
    cell_index: int = -1


class _Vendor(NamedTuple):
    """A program that exports logs: its name in reports, the column names that identify it, and its columns.

    `columns` maps the column names of the exporter, in lower case, to the columns of a plain log. `least_fix` is the
    lowest code for a kind of fix that includes a height.
    """

    words: str
    signs: frozenset[str]
    columns: Mapping[str, _Column]
    least_fix: int = 0


@dataclass(frozen=True)
class _Header:
    """The header of a log: its line, the delimiter, the number of cells, and the columns that are read.

    `numbers` are the columns of numbers, except for position errors. `accuracy` are the columns of position errors,
    whose cells may be empty. `stamp` is the column of time stamps, which are in the time scale `scale`. `zone`
    matches the end of a time stamp; it decides whether a time zone is required, forbidden or optional.
    """

    line: int
    delimiter: str
    width: int
    numbers: tuple[_Column, ...]
    stamp: _Column | None = None
    scale: str = "utc"
    zone: Callable[[str], object] = _ZONED
    vendor: _Vendor | None = None
    accuracy: tuple[_Column, ...] = ()

    @property
    def columns(self) -> tuple[_Column, ...]:
        """All columns in the order in which a `_Table` stores them: `numbers`, followed by `accuracy`."""
        return (*self.numbers, *self.accuracy)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(column.name for column in self.columns)

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the three coordinates of a position, such as latitude, longitude and height."""
        return next((kind for kind in _POSITION_COLUMNS if kind[1] in self.names), _GEODETIC)

    def index_of(self, name: str) -> int | None:
        """Index of the column with a given name in a `_Table`; None if there is no such column."""
        return self.names.index(name) if name in self.names else None


class _Table(NamedTuple):
    """Rows of a log: their line numbers (n,), numbers (n, columns) in units of the file, and time stamps.

    A time stamp is split into two numbers [s]: `minutes`, the time from MJD 0 to the start of its minute, and
    `seconds`, the time within the minute. `minutes` is NaN if the exporter omits the time stamp.
    """

    lines: NDArray[np.int64]
    numbers: Floats
    minutes: Floats
    seconds: Floats


def is_csv(data: bytes) -> bool:
    """Whether a file is a CSV log: its first line that is neither blank nor a comment names columns of positions."""
    head = data[:100_000].decode("utf-8-sig", "replace").replace("\r\n", "\n").replace("\r", "\n").split("\n")
    line = next(filter(_has_content, _dataflash_as_csv(head)), "")
    cells = line.split(max(",;\t", key=line.count))
    names = {_name_of(cell)[0] for cell in cells}
    return _vendor_of(cells) is not None or any(names.issuperset(kind[:2]) for kind in _POSITION_COLUMNS)


def read_csv(data: bytes, name: str, keys: LogKeys = NO_KEYS) -> Log:
    """Read a CSV flight log, a file in UTF-8 with at most `MAX_CSV_BYTES` bytes.

    The arguments and errors are the same for all readers; see `LogFormat.read`. Geodetic positions are
    converted to Earth-fixed positions, and time stamps to seconds after the first time stamp.
    """
    lines = _dataflash_as_csv(_text(data, name).split("\n"))
    header = _header(lines, name, keys)
    _hold_to_datum(lines[: header.line], name)
    rows = _all_rows(lines, header, name)
    table, without_fix = _with_fix(rows.table, header, keys, name)
    records = LogRecords(name, len(table.lines), table.lines, rows.broken)
    times, start, clock_words = _times(table, header, records)
    positions = _positions(table, header, records, keys)
    words = header.vendor.words if header.vendor else f"CSV of {', '.join(header.axes)}"
    words += "" if keys.instance is None else f", instance {keys.instance}"
    is_earth_fixed = header.axes != _POSITION_COLUMNS[2]
    figures, figure_words = _figures(table, header, records)
    log = usable_log(
        records,
        words,
        times,
        start,
        header.scale,
        lambda kept: _earth_fixed(positions[:, kept], header),
        clock_words=clock_words,
        is_earth_fixed=is_earth_fixed,
        sigmas=_sigmas(figures, header, positions),
        geodetic=tuple(positions) if header.axes == _GEODETIC else None,
    )
    without_fix += rows.empty
    fix_words = f", {counted(without_fix, 'row')} without a fix left out" if without_fix else ""
    return replace(log, words=log.words + fix_words + figure_words)


def _with_fix(table: _Table, header: _Header, keys: LogKeys, name: str) -> tuple[_Table, int]:
    """Select the rows that have a position; return them, and the number of rows without a position.

    The rows of a plain log are unchanged. In a log from a known exporter, rows without a fix are dropped, as are rows
    of receivers that are not chosen. Raises `PathFileError` if no row has a fix, if there are several receivers and
    the mission file does not choose one, or if it chooses a receiver although the log has no column of receivers.
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
    """Refuse a log if a comment before the header states a datum other than WGS-84 or ITRF."""
    for number, line in enumerate(lines, 1):
        match = _DATUM.match(line.strip())
        if match is not None and not is_wgs84(match[1]):
            raise PathFileError(
                f"{name}:{number}: has positions of the datum {shown(match[1])}",
                "accepted: WGS-84 or ITRF",
            )


def _times(table: _Table, header: _Header, records: LogRecords) -> tuple[Floats, Instant | None, str]:
    """Times of the rows [s], the instant from which they are counted, and a note on the accuracy of this instant.

    The instant is in the time scale of the header; it is None if the log does not state it. The note may be empty.
    """
    time_index = header.index_of("time")
    counted_s = np.zeros(len(table.lines))
    if time_index is not None:
        column, raw = header.numbers[time_index], table.numbers[:, time_index]
        with np.errstate(over="ignore"):
            counted_s = raw * column.scale
        records.leave_out(
            np.abs(counted_s) > _LATEST_S, lambda i: f"time {raw[i]:.10g} {column.unit} is beyond {_LATEST_S:g} s"
        )
    unix, week = header.index_of("unix"), header.index_of("week")
    if unix is not None:
        raw = table.numbers[:, unix]
        scale = header.numbers[unix].scale
        records.leave_out(raw * scale > _LATEST_S, lambda i: f"time {raw[i]:.10g} us is beyond {_LATEST_S:g} s")
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
    """Convert the times of a fine clock to UTC, using time stamps from a second clock that writes whole seconds.

    `counted_s` are the times of the fine clock [s], and `instants` are the time stamps, truncated to whole seconds
    [s]. The fine clock was zero at an unknown time in UTC. In each row, the stamp minus the fine time is either equal
    to this unknown time, or earlier by less than 1 s. All rows together bound the unknown time, and the midpoint of
    the bounds is used. Returns the times since the first row [s], the instant of the first row, and a note on the
    accuracy of UTC. Raises `PathFileError` if there is no stamp, or if the clocks drift apart.
    """
    has_instant = np.isfinite(instants) & records.is_usable
    if not has_instant.any():
        raise PathFileError(f"{records.name}: has no instant of UTC")
    apart = instants - counted_s
    usual = float(np.median(apart[has_instant]))
    off = np.abs(apart - usual)
    records.leave_out(
        has_instant & (off > 1.0 + _CLOCKS_APART_S),
        lambda i: f"its clocks, time(millisecond) and datetime(utc), drift apart by {off[i]:.3g} s",
    )
    behind = apart[has_instant & records.is_usable]
    earliest, latest = float(behind.max()), float(behind.min()) + 1.0
    if earliest - latest > _CLOCKS_APART_S:
        raise PathFileError(
            f"{records.name}: its clocks, time(millisecond) and datetime(utc), drift apart by "
            f"{earliest - latest:.3g} s",
            "accepted: the log of one flight",
        )
    start = Instant(0, 0.0).after((earliest + latest) / 2 + float(counted_s[0]))
    return counted_s - counted_s[0], start, f", UTC to {abs(latest - earliest) / 2:.2g} s by whole seconds"


def _positions(table: _Table, header: _Header, records: LogRecords, keys: LogKeys) -> Floats:
    """Coordinates (3, n) of the positions; latitude and longitude are in rad, all other coordinates in m.

    The header determines which coordinates these are. An altitude is converted to a height above the ellipsoid. Rows
    with impossible coordinates are marked as unusable in `records`.
    """
    kind = header.axes
    is_geodetic = kind == _GEODETIC
    is_above_sea = is_geodetic and "height" not in header.names
    columns = kind if not is_above_sea else (*_GEODETIC[:2], "altitude")
    coordinates = []
    for axis in columns:
        at = header.names.index(axis)
        column, raw = header.numbers[at], table.numbers[:, at]
        with np.errstate(over="ignore"):
            values = raw * column.scale
        limit = {"latitude": _MAX_LATITUDE_RAD, "longitude": 2 * math.pi * (1 + 1e-12)}.get(axis, _FARTHEST_M)
        at_most = {"latitude": "90 deg", "longitude": "360 deg"}.get(axis, f"{_FARTHEST_M:g} m")
        records.leave_out(
            np.abs(values) > limit,
            lambda i, raw=raw, column=column, at_most=at_most: (  # type: ignore[misc]
                f"{column.name} {raw[i]:.10g} {column.unit} is beyond {at_most}"
            ),
        )
        coordinates.append(values)
    if not is_above_sea:
        hold_to_ellipsoid(
            keys, records.name, "has heights above the ellipsoid" if is_geodetic else f"has {', '.join(kind)}"
        )
    else:
        at_separation = header.index_of("geoid_separation")
        separations = None
        if at_separation is not None:
            column, raw = header.numbers[at_separation], table.numbers[:, at_separation]
            separations = raw * column.scale
            records.leave_out(
                np.abs(separations) > 200, lambda i: f"geoid_separation {raw[i]:.10g} {column.unit} is beyond 200 m"
            )
        coordinates[2] = from_sea_level(coordinates[2], separations, keys, records.name)
    if kind == _POSITION_COLUMNS[1]:
        radius = np.sqrt(sum(axis**2 for axis in coordinates))
        records.leave_out(
            radius < _DEEPEST_M,
            lambda i: (
                f"x, y, z are {radius[i] / 1e3:.4g} km from the Earth's centre; Earth-fixed coordinates are wanted, "
                "positions of the scene are named east, north, up"
            ),
        )
    return np.array(coordinates)


def _earth_fixed(coordinates: Floats, header: _Header) -> Floats:
    """Convert coordinates (3, n) to positions (n, 3) [m].

    Geodetic coordinates are converted to Earth-fixed positions. An array of `x`, `y`, `z` or `east`, `north`,
    `up` is only transposed.
    """
    return earth_fixed_places(*coordinates) if header.axes == _GEODETIC else np.ascontiguousarray(coordinates.T)


def _figures(table: _Table, header: _Header, records: LogRecords) -> tuple[dict[str, Floats], str]:
    """1-sigma errors (n,) [m] by name, such as `sigma_east`, and a note on the number of unusable cells.

    A row is dropped if an accuracy cell contains neither a number nor a usual code for a missing value. If a log
    states both a sigma and a variance along the same axis, the larger error is used.
    """
    figures: dict[str, Floats] = {}
    negative = 0
    for column in header.accuracy:
        values = table.numbers[:, header.names.index(column.name)]
        records.leave_out(
            values == _NO_NUMBER,
            lambda _, column=column: f"{column.name} must be a number, or empty",  # type: ignore[misc]
        )
        negative += int(np.count_nonzero(values[records.is_usable] < 0))
        with np.errstate(over="ignore", invalid="ignore"):
            scaled = values * column.scale
            sigmas = np.sqrt(scaled) if column.name.startswith(_VARIANCE) else scaled
        name = column.name.replace(_VARIANCE, "sigma_")
        figures[name] = np.fmax(figures[name], sigmas) if name in figures else sigmas
    words = f", {counted(negative, 'figure')} of accuracy that cannot be used left out" if negative else ""
    return figures, words


def _sigmas(figures: Mapping[str, Floats], header: _Header, positions: Floats) -> Floats | None:
    """1-sigma errors (n, 3) east, north, up; NaN for an unknown error. [m]

    `figures` are the errors (n,) by name that `_figures` returns, and `positions` are the coordinates (3, n). If
    several columns state an error along the same axis, the largest error is used. Returns None if no row states an
    error.
    """
    local, fixed = (
        known_sigmas(np.column_stack([figures[name] for name in names])) if figures.keys() >= set(names) else None
        for names in _SIGMA_COLUMNS
    )
    if fixed is not None:
        fixed = _level_axes(filled_sigmas(fixed), header, positions)
    level = level_sigmas(*(figures.get(name) for name in _LEVEL_ACCURACIES))
    total = level_sigmas(figures.get(_TOTAL), None)
    stated = [sigmas for sigmas in (local, fixed, level, total) if sigmas is not None]
    return None if not stated else known_sigmas(np.fmax.reduce(stated))


def _level_axes(fixed: Floats, header: _Header, positions: Floats) -> Floats:
    """Convert independent 1-sigma errors along Earth-fixed axes to errors (n, 3) east, north, up. [m]"""
    if header.axes == _GEODETIC:
        latitude, longitude = positions[:2]
    else:
        latitude, longitude, _ = geodetic_places(positions.T)
    axes: Floats = np.moveaxis(axes_at_places(latitude, longitude), -1, 0)
    squares: Floats = np.einsum("nij,nj->ni", axes**2, fixed**2)
    return np.sqrt(squares)


def _text(data: bytes, name: str) -> str:
    """Decode a file to text whose lines end with line feeds; raises `PathFileError` if it is not UTF-8."""
    hold_to_bytes(data, MAX_CSV_BYTES, name)
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise PathFileError(f"{name}:1: is in UTF-16; save it in UTF-8")
    zero = data.find(b"\0")
    if zero >= 0:
        raise PathFileError(f"{name}:{_line_of(data, zero)}: has a zero byte; CSV is text in UTF-8, not in UTF-16")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        at = error.start
        # The codec skips the byte order mark, and counts offsets from the byte after it.
        at += 3 if data.startswith(b"\xef\xbb\xbf") and error.object != data else 0
        fault = f"has the byte 0x{data[at]:02x}, which is not UTF-8; save it in UTF-8"
        raise PathFileError(f"{name}:{_line_of(data, at)}: {fault}") from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _line_of(data: bytes, byte: int) -> int:
    before = data[:byte].replace(b"\r\n", b"\n")
    return before.count(b"\n") + before.count(b"\r") + 1


def _has_content(line: str) -> bool:
    """Whether a line is neither blank nor a comment."""
    text = line.lstrip()
    return bool(text) and text[0] != "#"


def _name_of(cell: str) -> tuple[str, str | None]:
    """Name of a column in lower case, up to the first bracket, and the unit in square brackets.

    The unit is None if there is no unit in square brackets.
    """
    name, unit = _written_name(cell)
    return name.lower().replace(" ", "_"), unit


def _written_name(cell: str) -> tuple[str, str | None]:
    """Name of a column as written in the file, up to the first bracket, and the unit in square brackets.

    The unit is None if there is no unit in square brackets.
    """
    cell = cell.strip()
    match = _COLUMN_HEADER_PATTERN.fullmatch(cell)
    name = (match[1] if match else re.split(r"[\[(]", cell)[0]).strip().strip('"')
    return name, match[2].strip() if match and match[2] is not None else None


def _accuracy_columns(
    cells: Sequence[str],
    kind: Sequence[str],
    refuse: Callable[[str], NoReturn],
    level_columns: Mapping[str, _Column] = MappingProxyType({}),
) -> tuple[_Column, ...]:
    """Find the columns that state position errors, from the cells of a header.

    `kind` are the names of the coordinates. `level_columns` are error columns that are already known; they come first
    in the result. The function `refuse` is called to raise an error if a column is unclear or given twice, or if a
    column requires another column that the log lacks.
    """
    columns = dict(level_columns)
    has_covariance = False
    for index, cell in enumerate(cells):
        column, unit = _written_name(cell)
        in_brackets = re.search(r"\(([^()]*)\)", cell)
        meaning, unit = meaning_of(column, unit or (in_brackets[1] if in_brackets else None))
        has_covariance |= meaning == CROSS_COVARIANCE
        if meaning == UNCLEAR:
            refuse(
                f"{shown(column)} looks like an accuracy of the positions, but is not a known one: name it as what "
                f"it is, or leave it out where it is of something else; {ACCEPTED_ACCURACIES}"
            )
        if meaning in (None, CROSS_COVARIANCE):
            continue
        if meaning in columns:
            refuse(f"has two columns of {meaning}")
        dimension = units.POSITION_VARIANCE if meaning.startswith(_VARIANCE) else units.LENGTH
        column = column.lower().replace(" ", "_")
        columns[meaning] = _measured(column, index, unit, refuse, dimension)._replace(name=meaning)
    columns = _with_plain_heights(columns, refuse)
    stated = {name.replace(_VARIANCE, "sigma_") for name in columns}
    for names in _SIGMA_COLUMNS:
        missing = [name for name in names if name not in stated]
        if 0 < len(missing) < len(names):
            has = next(name for name in names if name in stated)
            refuse(f"has {has} and no {missing[0]}; write all of {', '.join(names)}")
    if has_covariance and not stated.issuperset(_SIGMA_COLUMNS[0]):
        refuse(f"has a covariance of two axes and no sigmas of them; {ACCEPTED_ACCURACIES}")
    if kind == _POSITION_COLUMNS[2] and _SIGMA_COLUMNS[1][0] in stated:
        refuse(f"has {_SIGMA_COLUMNS[1][0]} beside east; write {', '.join(_SIGMA_COLUMNS[0])}")
    return tuple(columns.values())


def _with_plain_heights(columns: dict[str, _Column], refuse: Callable[[str], NoReturn]) -> dict[str, _Column]:
    """Rename error columns whose names may refer either to the height or to a horizontal error.

    A `sigma_h` is a horizontal error if the log has a vertical accuracy. It is a height error if the log has an east
    error and no other error of the height. Any other `sigma_h` is refused. A `sigma_up` becomes a vertical accuracy
    if the log has a horizontal accuracy, but no errors east and north.
    """
    level, vertical = _LEVEL_ACCURACIES
    if "sigma_h" in columns:
        of_h = columns.pop("sigma_h")
        is_height = "sigma_east" in columns and "sigma_up" not in columns and vertical not in columns
        meaning = level if vertical in columns else "sigma_up" if is_height else ""
        if not meaning or meaning in columns:
            refuse(f"has an error of h, which may be the height or horizontal; {ACCEPTED_ACCURACIES}")
        columns[meaning] = of_h._replace(name=meaning)
    is_alone = "sigma_up" in columns and "sigma_east" not in columns and "sigma_north" not in columns
    if is_alone and vertical not in columns and level in columns:
        columns[vertical] = columns.pop("sigma_up")._replace(name=vertical)
    return columns


def _header(lines: Sequence[str], name: str, keys: LogKeys) -> _Header:
    """Read the header of a log from the first line that is neither blank nor a comment.

    Raises `PathFileError` if there is no such line, or if columns are missing, given twice or contradictory.
    """
    at = next((n for n, line in enumerate(lines) if _has_content(line)), None)
    if at is None:
        raise PathFileError(f"{name}:1: is empty; its first line names columns, like 'time [s], x [m], y [m], z [m]'")

    def refuse(says: str) -> NoReturn:
        raise PathFileError(f"{name}:{at + 1}: {says}")

    delimiter = max(",;\t", key=lines[at].count)
    cells = _cells(lines[at], delimiter)
    if isinstance(cells, str):
        refuse(cells)
    vendor = _vendor_of(cells)
    if vendor is not None:
        return _vendor_header(vendor, cells, delimiter, at + 1, f"{name}:{at + 1}", keys)
    headings: dict[str, tuple[int, str | None]] = {}
    for index, cell in enumerate(cells):
        column, unit = _name_of(cell)
        if column not in ("time", *_STAMPS, *_SPARE, *(axis for kind in _POSITION_COLUMNS for axis in kind)):
            continue
        if column in headings:
            refuse(f"has two columns {column}")
        headings[column] = (index, unit)
    kinds = [kind for kind in _POSITION_COLUMNS if any(axis in headings for axis in kind)]
    if not kinds:
        refuse("names no position; the first line names columns, like 'latitude [deg]', 'x [m]' or 'east [m]'")
    if len(kinds) > 1:
        first_axis, second_axis = (next(axis for axis in kind if axis in headings) for kind in kinds[:2])
        listed = ", or ".join(", ".join(kind) for kind in _POSITION_COLUMNS)
        refuse(f"mixes {first_axis} with {second_axis}; positions are {listed}")
    kind = kinds[0]
    if kind == _GEODETIC and "altitude" in headings:
        if "height" in headings:
            refuse("has both height and altitude; keep one")
        kind = (*_GEODETIC[:2], "altitude")
    missing = [axis for axis in kind if axis not in headings]
    if missing:
        refuse(f"has no column {missing[0]}")
    times = [column for column in ("time", *_STAMPS) if column in headings]
    if len(times) > 1:
        refuse(f"has both {times[0]} and {times[1]}; keep one")
    if not times:
        refuse("has no column of time; write 'time [s]' or 'utc'")
    axes = [_measured(axis, *headings[axis], refuse) for axis in kind]
    alike = axes[:2] if kind[0] == "latitude" else axes
    other_unit = next((axis for axis in alike if axis.scale != alike[0].scale), None)
    if other_unit:
        refuse(f"mixes units: {alike[0].name} [{alike[0].unit}] and {other_unit.name} [{other_unit.unit}]")
    if kind[-1] == "altitude" and "geoid_separation" in headings:
        axes.append(_measured("geoid_separation", *headings["geoid_separation"], refuse))
    elif kind[-1] == "altitude" and keys.geoid_separation is None:
        raise needs_separation(
            f"{name}:{at + 1}: altitude counts from mean sea level, and there is no column geoid_separation; "
            "a height counts from the ellipsoid of WGS-84"
        )
    accuracy = _accuracy_columns(cells, kind, refuse)
    index, unit = headings[times[0]]
    scale = _STAMPS.get(times[0]) or _STAMPS.get((unit or "").lower())
    if times[0] in _STAMPS and unit and _STAMPS.get(unit.lower()) != scale:
        refuse(f"{times[0]} has the unit {shown(unit)!r}; stamps like {_example(str(scale))} need none")
    zone = _ZONED if scale == "utc" else _BARE
    if scale is None and not unit and keys.time_scale is not None:
        scale, zone = keys.time_scale, _EITHER if keys.time_scale == "utc" else _BARE
    if scale is None:
        time = _measured("time", index, unit, refuse)
        if keys.time_scale is not None:
            refuse(f"time counts in {time.unit}; trajectory.time_scale says of instants in which scale they are")
        return _Header(at + 1, delimiter, len(cells), (time, *axes), accuracy=accuracy)
    hold_to_scale(scale, keys, f"{name}:{at + 1}")
    stamp = _Column(times[0], cell_index=index)
    return _Header(at + 1, delimiter, len(cells), tuple(axes), stamp, scale, zone, accuracy=accuracy)


def _vendor_header(
    vendor: _Vendor, cells: Sequence[str], delimiter: str, line: int, where: str, keys: LogKeys
) -> _Header:
    """Make the header of a log that was written by a known exporter, from the cells of its first line."""
    columns: dict[str, _Column] = {}
    for index, cell in enumerate(cells):
        column = vendor.columns.get(cell.strip().lower())
        if column is not None:
            columns.setdefault(column.name, column._replace(cell_index=index))
    if "height" not in columns and "altitude" not in columns:
        raise PathFileError(
            f"{where}: {vendor.words} has no height above the sea or the ellipsoid; one above take-off is no position"
        )
    if "height" in columns:
        columns.pop("altitude", None)
    stamp = columns.pop("utc", None)
    scale = "gps" if "week" in columns else "utc"
    if stamp is not None or not columns.keys().isdisjoint(("unix", "week")):
        hold_to_scale(scale, keys, where)
    elif keys.time_scale is not None:
        raise PathFileError(f"{where}: time counts since the start of the autopilot, and is in no scale")

    def refuse(says: str) -> NoReturn:
        raise PathFileError(f"{where}: {says}")

    # Columns that a user has added to those of an exporter are read as in a plain log.
    added_cells = ["" if cell.strip().lower() in vendor.columns else cell for cell in cells]
    level = {name: columns.pop(name) for name in _LEVEL_ACCURACIES if name in columns}
    accuracy = _accuracy_columns(added_cells, _GEODETIC, refuse, level)
    numbers = tuple(columns.values())
    return _Header(line, delimiter, len(cells), numbers, stamp, scale, _EITHER, vendor, accuracy)


def _example(scale: str) -> str:
    return _EXAMPLE if scale == "utc" else _EXAMPLE[:-1]


def _measured(
    name: str,
    index: int,
    unit: str | None,
    refuse: Callable[[str], NoReturn],
    dimension: units.Dimension | None = None,
) -> _Column:
    """Make a `_Column` of numbers; a unit that is missing, unknown or of the wrong dimension is refused."""
    dimension = dimension or _COLUMN_DIMENSIONS.get(name, units.LENGTH)
    example = (
        "time [s]', 'time [UTC]' or 'time [GPST]" if dimension is units.TIME else f"{name} [{_usual(dimension)}]"
    )
    if not unit:
        more = ", or say trajectory.time_scale" if name == "time" else ""
        refuse(f"{name} has no unit; write '{example}'{more}")
    try:
        return _Column(name, shown(unit), units.parse_quantity(f"1 {unit}", dimension), index)
    except InvalidValueError as error:
        refuse(fault_words(f"{name} {error.problem.problem}", "", f"write '{example}'", error.problem.hint))


@dataclass(eq=False)
class _Rows:
    """Rows of a log that have been read so far.

    `broken` contains messages about unusable rows, by line. `most_broken` is the largest permitted number of such
    rows. `empty` is the number of rows in which an exporter left numeric cells empty.
    """

    tables: list[_Table]
    broken: dict[int, str]
    most_broken: int
    empty: int = 0

    @property
    def table(self) -> _Table:
        """All rows that have been read so far, as a single table."""
        return _Table(*(np.concatenate(columns) for columns in zip(*self.tables, strict=True)))


def _all_rows(lines: list[str], header: _Header, name: str) -> _Rows:
    """Read all rows after the header, in chunks of many lines, which is fast and needs little memory."""
    nothing = np.zeros(0)
    empty = _Table(np.zeros(0, dtype=np.int64), np.zeros((0, len(header.columns))), nothing, nothing)
    rows = _Rows([empty], {}, most_left_out(len(lines) - header.line))
    is_any = False
    for first in range(header.line, len(lines), _CHUNK_LINES):
        chunk = lines[first : first + _CHUNK_LINES]
        kept = [n for n, line in enumerate(chunk) if line[:1] > "#" or _has_content(line)]  # numbers sort after #
        if kept:
            is_any = True
            _read_rows([chunk[n] for n in kept], np.array(kept) + first + 1, header, name, rows)
    if not is_any:
        raise PathFileError(f"{name}:{header.line}: has a header and no fixes")
    return rows


def _read_rows(texts: list[str], lines: NDArray[np.int64], header: _Header, name: str, rows: _Rows) -> None:
    """Read several rows at once, and add them to `rows`.

    If this fails, the rows are split into halves until the unusable rows are found. Raises `PathFileError` if too
    many rows are unusable.
    """
    read = _plain_cells(texts, header) or _quoted_cells(texts, header)
    if read is not None and np.isfinite(read[0][:, : len(header.numbers)]).all():
        numbers, stamps = read
        instants = (np.zeros(len(lines)),) * 2 if stamps is None else _instants(stamps, header)
        if instants is not None:
            rows.tables.append(_Table(lines, numbers, *instants))
            return
    if len(texts) > _MAX_SCANNED_ROWS:
        half = len(texts) // 2
        _read_rows(texts[:half], lines[:half], header, name, rows)
        _read_rows(texts[half:], lines[half:], header, name, rows)
        return
    is_sound = []
    for text, line in zip(texts, lines.tolist(), strict=True):
        is_empty = header.vendor is not None and not _is_complete(text, header)  # the exporter has no fix yet
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
    sound = [n for n, is_good in enumerate(is_sound) if is_good]
    if len(sound) == len(texts):
        raise AssertionError("a row that has no fault was refused")
    if sound:
        _read_rows([texts[n] for n in sound], lines[sound], header, name, rows)


def _is_complete(text: str, header: _Header) -> bool:
    """Whether all cells of a row that should contain numbers are filled.

    A row with a wrong number of cells also counts as complete here.
    """
    cells = _cells(text, header.delimiter)
    if isinstance(cells, str) or len(cells) != header.width:
        return True
    return all(cells[column.cell_index].strip() for column in header.numbers)


def _plain_cells(texts: list[str], header: _Header) -> tuple[Floats, list[str] | None] | None:
    """Read rows without quoted cells: numbers (n, columns) and time stamps; None if the rows cannot be read.

    The time stamps are None if the log has no column of time stamps.
    """
    delimiter = header.delimiter
    if {text.count(delimiter) for text in texts} != {header.width - 1} or any(map(_QUOTED, texts)):
        return None
    try:
        numbers = np.loadtxt(
            texts,
            delimiter=delimiter,
            comments=None,
            usecols=[column.cell_index for column in header.columns],
            converters={column.cell_index: _or_nan for column in header.accuracy} or None,
            ndmin=2,
        )
    except ValueError:
        return None
    if header.stamp is None:
        return numbers, None
    stamp_index = header.stamp.cell_index
    return numbers, [text.split(delimiter, stamp_index + 1)[stamp_index].strip() for text in texts]


def _quoted_cells(texts: list[str], header: _Header) -> tuple[Floats, list[str] | None] | None:
    """Read rows that may have quoted cells: numbers (n, columns) and time stamps; None if the rows cannot be read.

    The time stamps are None if the log has no column of time stamps. This takes six times as long as
    `_plain_cells`.
    """
    try:
        rows = list(csv.reader(texts, delimiter=header.delimiter, skipinitialspace=True))
        if len(rows) != len(texts) or set(map(len, rows)) != {header.width}:
            return None
        cells = [[row[column.cell_index] for row in rows] for column in header.numbers]
        if any("".join(column).encode().translate(None, _IN_NUMBERS) for column in cells):
            return None
        errors = [[_or_nan(row[column.cell_index]) for row in rows] for column in header.accuracy]
        numbers = np.array([list(map(float, column)) for column in cells] + errors).T
    except (csv.Error, ValueError):
        return None
    return numbers, None if header.stamp is None else [row[header.stamp.cell_index].strip() for row in rows]


def _or_nan(cell: str) -> float:
    """Convert a cell of an accuracy column to a number.

    The result is NaN for an empty cell, -1 for a word that means a missing value, and `_NO_NUMBER` for any other
    text.
    """
    try:
        return float(cell)
    except ValueError:
        content = cell.strip().strip('"').lower()
        return (-1.0 if content else math.nan) if content in _EMPTY_CELLS else _NO_NUMBER


def _instants(texts: list[str], header: _Header) -> tuple[Floats, Floats] | None:
    """Split time stamps into the start of the minute [s], counted from MJD 0, and the time within the minute [s].

    If the exporter omits a time stamp, the start is NaN and the time within the minute is 0. Returns None if a string
    is not a time stamp.
    """
    has_text = [bool(text) or header.vendor is None for text in texts]
    minutes = [_minute(text[:17]) if is_stated else math.nan for text, is_stated in zip(texts, has_text, strict=True)]
    seconds = [text[17:] if is_stated else "00" for text, is_stated in zip(texts, has_text, strict=True)]
    if None in minutes or not all(
        header.zone(text) if is_stated else True for text, is_stated in zip(seconds, has_text, strict=True)
    ):
        return None
    numbers = [text.replace("Z", "").partition("+")[0].replace(",", ".") for text in seconds]
    return np.array(minutes, dtype=float), np.array(numbers, dtype=float)


@lru_cache(maxsize=256)
def _minute(text: str) -> float | None:
    """Time from MJD 0 to the start of the minute of a time stamp; None if the text is not a time stamp. [s]

    `text` is the time stamp without its seconds. Many rows share a minute, so results are cached.
    """
    instant = parse_instant(f"{text}00Z")
    return None if instant is None else instant.day * DAY_S + instant.seconds


def _usual(dimension: units.Dimension) -> str:
    return "deg" if dimension is units.ANGLE else dimension.si


def _cells(text: str, delimiter: str) -> list[str] | str:
    """Cells of a line, or the reason why the line cannot be split into cells."""
    try:
        rows = list(csv.reader([text, ""], delimiter=delimiter, skipinitialspace=True))
    except csv.Error:
        return f"has a cell of more than {csv.field_size_limit()} letters"
    return rows[0] if len(rows) == 2 else "has a quote that does not end on its line"


def _row_fault(text: str, header: _Header) -> str | None:
    cells = _cells(text, header.delimiter)
    if isinstance(cells, str):
        return cells
    if len(cells) != header.width:
        return f"has {counted(len(cells), 'cell')}, the header has {header.width}"
    stamp = "" if header.stamp is None else cells[header.stamp.cell_index].strip()
    is_left_out = header.vendor is not None and not stamp
    if header.stamp is not None and not is_left_out and (_minute(stamp[:17]) is None or not header.zone(stamp[17:])):
        scale = SCALES[header.scale]
        return (
            f"{header.stamp.name} must be an instant of {scale} like {_example(header.scale)} (got {shown(stamp)!r})"
        )
    for column in header.numbers:
        cell = cells[column.cell_index].strip(" \t")
        if not cell:
            return f"{column.name} is empty"
        try:
            value = float(cell) if not cell.encode().translate(None, _IN_NUMBERS) else None
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


_LATITUDE_COLUMN, _LONGITUDE_COLUMN = (
    _Column("latitude", "deg", _DEGREE_RAD),
    _Column("longitude", "deg", _DEGREE_RAD),
)
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
            "latitude": _LATITUDE_COLUMN,
            "longitude": _LONGITUDE_COLUMN,
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
        latitude_deg=_LATITUDE_COLUMN,
        longitude_deg=_LONGITUDE_COLUMN,
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
        lat=_LATITUDE_COLUMN,
        lon=_LONGITUDE_COLUMN,
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
        lat=_LATITUDE_COLUMN,
        lng=_LONGITUDE_COLUMN,
        alt=_Column("altitude", "m"),
        status=_FIX,
        i=_Column("receiver"),
        hacc=_HORIZONTAL,
        vacc=_VERTICAL,
    ),
)


def _vendor_of(cells: Sequence[str]) -> _Vendor | None:
    """Exporter that wrote a header; None if it is unknown.

    The exporter is recognised by the column names in `cells`.
    """
    names = [cell.strip().lower() for cell in cells]
    return next((vendor for vendor in _VENDORS if vendor.signs.issubset(names)), None)


def _dataflash_as_csv(lines: list[str]) -> list[str]:
    """Convert a dataflash log to CSV with a header and GPS rows; any other log is returned unchanged.

    The FMT row that names the columns of GPS rows becomes the header. GPS rows are kept. All other lines become
    empty, so that line numbers do not change. Two cells are appended to each GPS row: HAcc and VAcc from the GPA row
    with the same time and receiver.
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
    more = ",HAcc,VAcc" if accuracies else ""
    csv_lines = []
    header = ""
    for line in lines:
        kept = ""
        if line.startswith("GPS,") and header:
            kept = line
            if more:
                row = dict(zip(names["GPS"], (cell.strip() for cell in line.split(",")[1:]), strict=False))
                kept = line.rstrip() + accuracies.get(_time_and_receiver(row), ",,")
        elif line.startswith("FMT,") and not header and line.split(",")[3].strip() == "GPS":
            kept = header = ",".join(["GPS", *names["GPS"]]) + more
        csv_lines.append(kept)
    return csv_lines


def _time_and_receiver(row: Mapping[str, str]) -> tuple[str, ...]:
    return tuple(row.get(name, "") for name in ("TimeUS", "I"))
