"""Logs of flights as CSV: a header that names quantity and unit of each column, then a place in each line.

    # comment
    time [s], latitude [deg], longitude [deg], height [m]
    0.00, 48.086600, 11.279700, 3000.0

Time is `time [s]`, counted from anywhere, or `utc` with stamps of ISO 8601 that end in Z. Places are `latitude`,
`longitude` and `height` above the ellipsoid of WGS-84, or Earth-fixed `x`, `y`, `z`, or `east`, `north`, `up` of the
scene's centre. Other columns are not read. Cells are parted by commas, semicolons or tabs.
"""

import csv
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from bisar_budget import units
from bisar_budget.faults import InvalidValueError, fault_words, shown
from bisar_budget.paths.earth import Floats, earth_fixed_places
from bisar_budget.paths.flight import Log, PathFileError
from bisar_budget.paths.instant import DAY, Instant, parse_instant
from bisar_budget.units import format_quantity

LARGEST = 200_000_000  # bytes; four hours at 200 Hz
_CHUNK = 1 << 16  # lines that are text and numbers at once
_FARTHEST_M = 1e9  # of a place; beyond the Moon
_LATEST_S = 1e11  # of a time; 3000 years, so that Unix time is one
_DEEPEST_M = 6.2e6  # m from the Earth's centre; the poles are at 6.357e6
_RIGHT_ANGLE = math.pi / 2 * (1 + 1e-12)  # 90 deg, rounded
_KINDS = (("latitude", "longitude", "height"), ("x", "y", "z"), ("east", "north", "up"))
_DIMENSIONS = {"latitude": units.ANGLE, "longitude": units.ANGLE, "time": units.TIME}
_HEADER = re.compile(r"([^\[\]()]*)(?:\[([^\[\]]*)\])?\s*")
_QUOTED = re.compile('"').search
_IN_NUMBERS = b"0123456789+-.eE \t"
_SECONDS = re.compile(r"[0-5]\d(?:[.,]\d{1,12})?(?:Z|\+00:00)", re.ASCII).fullmatch
_EXAMPLE = "2026-06-01T05:20:31.250Z"


@dataclass(frozen=True)
class _Column:
    """A column that is read: its name, place in a row, unit as written and factor to SI. UTC has no unit."""

    name: str
    place: int
    unit: str = ""
    scale: float = 1.0


@dataclass(frozen=True)
class _Header:
    """Line of the header, what parts its cells and how many there are, and the columns of time and place."""

    line: int
    delimiter: str
    width: int
    time: _Column
    axes: tuple[_Column, _Column, _Column]

    @property
    def is_utc(self) -> bool:
        return self.time.name == "utc"

    @property
    def numbers(self) -> tuple[_Column, ...]:
        return self.axes if self.is_utc else (self.time, *self.axes)


class _Rows(NamedTuple):
    """Lines (n,) of rows, their three coordinates (n, 3) in units of the file, and their times.

    A time is a number in the unit of the file, or whole minutes of UTC since MJD 0 and the seconds after, [s].
    """

    lines: NDArray[np.int64]
    coordinates: Floats
    times: Floats
    minutes: Floats


def read_csv(data: bytes, name: str) -> Log:
    """Read a log of a flight.

    Parameters
    ----------
    data : bytes
        The file: UTF-8, at most `LARGEST` bytes.
    name : str
        What messages call it.

    Returns
    -------
    Log
        Geodetic places become Earth-fixed ones. Stamps of UTC become seconds after the first of them.

    Raises
    ------
    PathFileError
        Names the file and the line of the fault: `flight.csv:17: ...`.
    """
    lines = _text(data, name).split("\n")
    header = _header(lines, name)
    rows = _all_rows(lines, header, name)

    def refuse(bad: NDArray[np.bool_], says: Callable[[int], str]) -> None:
        if bad.any():
            index = int(bad.argmax())
            raise PathFileError(f"{name}:{rows.lines[index]}: {says(index)}")

    start = None
    if header.is_utc:
        start = Instant(0, 0.0).after(float(rows.minutes[0])).after(float(rows.times[0]))
        times = (rows.minutes - rows.minutes[0]) + (rows.times - rows.times[0])
    else:
        with np.errstate(over="ignore"):
            times = rows.times * header.time.scale
        written = header.time.unit
        refuse(np.abs(times) > _LATEST_S, lambda i: f"time {rows.times[i]:.10g} {written} is beyond {_LATEST_S:g} s")
    late = np.concatenate([[False], np.diff(times) <= 0])
    refuse(
        late,
        lambda i: (
            f"time {_time(times[i], start)} is not after {_time(times[i - 1], start)} of line {rows.lines[i - 1]}; "
            "times must rise"
        ),
    )
    with np.errstate(over="ignore"):
        places = rows.coordinates * [axis.scale for axis in header.axes]
    for column, axis in enumerate(header.axes):
        limit = {"latitude": _RIGHT_ANGLE, "longitude": 2 * math.pi * (1 + 1e-12)}.get(axis.name, _FARTHEST_M)
        at_most = {"latitude": "90 deg", "longitude": "360 deg"}.get(axis.name, f"{_FARTHEST_M:g} m")
        refuse(
            np.abs(places[:, column]) > limit,
            lambda i, axis=axis, column=column, at_most=at_most: (  # type: ignore[misc]
                f"{axis.name} {rows.coordinates[i, column]:.10g} {axis.unit} is beyond {at_most}"
            ),
        )
    kind = tuple(axis.name for axis in header.axes)
    if kind == _KINDS[0]:
        places = earth_fixed_places(*places.T)
    elif kind == _KINDS[1]:
        radius = np.sqrt((places**2).sum(axis=1))
        refuse(
            radius < _DEEPEST_M,
            lambda i: (
                f"x, y, z are {radius[i] / 1e3:.4g} km from the Earth's centre; Earth-fixed coordinates are wanted, "
                "places of the scene are named east, north, up"
            ),
        )
    span = times[-1] - times[0]
    words = f"CSV of {', '.join(kind)}, {_counted(len(times))} over {span:.6g} s"
    return Log(times, places, kind != _KINDS[2], words, start)


def _text(data: bytes, name: str) -> str:
    """Text of the file, with a line feed at the end of each line."""
    if len(data) > LARGEST:
        raise PathFileError(f"{name}: has {len(data) / 1e6:.0f} MB, at most {LARGEST / 1e6:.0f} MB are read")
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise PathFileError(f"{name}:1: is in UTF-16; save it in UTF-8")
    zero = data.find(b"\0")
    if zero >= 0:
        raise PathFileError(f"{name}:{_line_of(data, zero)}: has a zero byte; CSV is text in UTF-8, not in UTF-16")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        at = error.start
        # The codec that skips the mark counts from behind it.
        at += 3 if data.startswith(b"\xef\xbb\xbf") and error.object != data else 0
        said = f"has the byte 0x{data[at]:02x}, which is not UTF-8; save it in UTF-8"
        raise PathFileError(f"{name}:{_line_of(data, at)}: {said}") from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _line_of(data: bytes, byte: int) -> int:
    before = data[:byte].replace(b"\r\n", b"\n")
    return before.count(b"\n") + before.count(b"\r") + 1


def _is_said(line: str) -> bool:
    """Whether a line is neither blank nor a comment."""
    text = line.lstrip()
    return bool(text) and text[0] != "#"


def _header(lines: Sequence[str], name: str) -> _Header:
    """Columns that the first line names."""
    at = next((n for n, line in enumerate(lines) if _is_said(line)), None)
    if at is None:
        raise PathFileError(f"{name}:1: is empty; its first line names columns, like 'time [s], x [m], y [m], z [m]'")

    def refuse(says: str) -> NoReturn:
        raise PathFileError(f"{name}:{at + 1}: {says}")

    delimiter = max(",;\t", key=lines[at].count)
    cells = _cells(lines[at], delimiter)
    if isinstance(cells, str):
        refuse(cells)
    found: dict[str, tuple[int, str | None]] = {}
    others = []
    for index, cell in enumerate(cells):
        match = _HEADER.fullmatch(cell)
        column = (match[1] if match else re.split(r"[\[(]", cell)[0]).strip().lower()
        if column not in ("time", "utc", *(axis for kind in _KINDS for axis in kind)):
            others.append(column)
        elif column in found:
            refuse(f"has two columns {column}")
        else:
            found[column] = (index, match[2].strip() if match and match[2] is not None else None)
    kinds = [kind for kind in _KINDS if any(axis in found for axis in kind)]
    if not kinds:
        refuse("names no place; the first line names columns, like 'latitude [deg]', 'x [m]' or 'east [m]'")
    if len(kinds) > 1:
        one, other = (next(axis for axis in kind if axis in found) for kind in kinds[:2])
        refuse(f"mixes {one} with {other}; places are {', or '.join(', '.join(kind) for kind in _KINDS)}")
    missing = [axis for axis in kinds[0] if axis not in found]
    if missing:
        hint = ""
        if missing == ["height"] and any(other.startswith(("altitude", "alt", "elevation")) for other in others):
            hint = "; a height counts from the ellipsoid of WGS-84, an altitude often from the sea"
        refuse(f"has no column {missing[0]}{hint}")
    if "time" in found and "utc" in found:
        refuse("has both time and utc; keep one")
    if "time" not in found and "utc" not in found:
        refuse("has no column of time; write 'time [s]' or 'utc'")
    time = _time_column(found, refuse)
    axes = [_measured(axis, *found[axis], refuse) for axis in kinds[0]]
    alike = axes[:2] if kinds[0] == _KINDS[0] else axes
    other_unit = next((axis for axis in alike if axis.scale != alike[0].scale), None)
    if other_unit:
        refuse(f"mixes units: {alike[0].name} [{alike[0].unit}] and {other_unit.name} [{other_unit.unit}]")
    return _Header(at + 1, delimiter, len(cells), time, (axes[0], axes[1], axes[2]))


def _time_column(found: dict[str, tuple[int, str | None]], refuse: Callable[[str], NoReturn]) -> _Column:
    if "utc" in found:
        index, unit = found["utc"]
        if unit and unit.lower() != "utc":
            refuse(f"utc has the unit {shown(unit)!r}; stamps like {_EXAMPLE} need none")
        return _Column("utc", index)
    index, unit = found["time"]
    if unit is not None and unit.lower() == "utc":
        return _Column("utc", index)
    return _measured("time", index, unit, refuse)


def _measured(name: str, index: int, unit: str | None, refuse: Callable[[str], NoReturn]) -> _Column:
    """A column of numbers, whose unit is known and of the right dimension."""
    dimension = _DIMENSIONS.get(name, units.LENGTH)
    example = {units.ANGLE: f"{name} [deg]", units.TIME: "time [s]' or 'time [UTC]"}.get(dimension, f"{name} [m]")
    if not unit:
        refuse(f"{name} has no unit; write '{example}'")
    try:
        return _Column(name, index, shown(unit), units.parse_quantity(f"1 {unit}", dimension))
    except InvalidValueError as error:
        refuse(fault_words(f"{name} {error.problem.problem}", "", f"write '{example}'", error.problem.hint))


def _all_rows(lines: list[str], header: _Header, name: str) -> _Rows:
    """Every row behind the header; a chunk of lines at a time, which is fast and needs little memory."""
    parts = []
    for first in range(header.line, len(lines), _CHUNK):
        chunk = lines[first : first + _CHUNK]
        kept = [n for n, line in enumerate(chunk) if line[:1] > "#" or _is_said(line)]  # numbers begin behind #
        if kept:
            parts.append(_rows([chunk[n] for n in kept], np.array(kept) + first + 1, header, name))
    if not parts:
        raise PathFileError(f"{name}:{header.line}: has a header and no places")
    return _Rows(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def _rows(texts: list[str], lines: NDArray[np.int64], header: _Header, name: str) -> _Rows:
    """Numbers of some rows at once; where that fails, look for the cell that is none."""
    read = _plain_cells(texts, header) or _quoted_cells(texts, header)
    if read is not None and np.isfinite(read[0]).all():
        numbers, stamps = read
        if stamps is None:
            return _Rows(lines, numbers[:, 1:], numbers[:, 0], np.zeros(len(lines)))
        times = _times(stamps)
        if times is not None:
            return _Rows(lines, numbers, times[1], times[0])
    for text, line in zip(texts, lines, strict=True):
        says = _row_fault(text, header)
        if says:
            raise PathFileError(f"{name}:{line}: {says}")
    raise AssertionError("a row that has no fault was refused")


def _plain_cells(texts: list[str], header: _Header) -> tuple[Floats, list[str] | None] | None:
    """Numbers (n, 3 or 4) and stamps of rows without quotes; None where they are something else."""
    delimiter = header.delimiter
    if {text.count(delimiter) for text in texts} != {header.width - 1} or any(map(_QUOTED, texts)):
        return None
    try:
        numbers = np.loadtxt(
            texts, delimiter=delimiter, comments=None, usecols=[one.place for one in header.numbers], ndmin=2
        )
    except ValueError:
        return None
    if not header.is_utc:
        return numbers, None
    place = header.time.place
    return numbers, [text.split(delimiter, place + 1)[place].strip() for text in texts]


def _quoted_cells(texts: list[str], header: _Header) -> tuple[Floats, list[str] | None] | None:
    """The same of rows with quotes, which takes six times as long."""
    try:
        rows = list(csv.reader(texts, delimiter=header.delimiter, skipinitialspace=True))
        if len(rows) != len(texts) or set(map(len, rows)) != {header.width}:
            return None
        cells = [[row[column.place] for row in rows] for column in header.numbers]
        if any("".join(column).encode().translate(None, _IN_NUMBERS) for column in cells):
            return None
        numbers = np.array([list(map(float, column)) for column in cells]).T
    except (csv.Error, ValueError):
        return None
    return numbers, [row[header.time.place].strip() for row in rows] if header.is_utc else None


def _times(texts: list[str]) -> tuple[Floats, Floats] | None:
    """Minutes since MJD 0 [s] and the seconds after; None where one of them is no stamp."""
    minutes = [_minute(text[:17]) for text in texts]
    seconds = [text[17:] for text in texts]
    if None in minutes or not all(map(_SECONDS, seconds)):
        return None
    numbers = [text.replace("Z", "").replace("+00:00", "").replace(",", ".") for text in seconds]
    return np.array(minutes), np.array(numbers, dtype=float)


@lru_cache(maxsize=256)
def _minute(text: str) -> float | None:
    """Seconds since MJD 0 of the beginning of a stamp, which is that of many rows; None if it is none."""
    instant = parse_instant(f"{text}00Z")
    return None if instant is None else instant.day * DAY + instant.seconds


def _cells(text: str, delimiter: str) -> list[str] | str:
    """Cells of a line, or why it has none."""
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
        return f"has {_counted(len(cells), 'cell')}, the header has {header.width}"
    if header.is_utc and parse_instant(cells[header.time.place]) is None:
        stamp = shown(cells[header.time.place].strip())
        return f"utc must be an instant of UTC like {_EXAMPLE} (got {stamp!r})"
    for column in header.numbers:
        cell = cells[column.place].strip(" \t")
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


def _time(seconds: float, start: Instant | None) -> str:
    return start.after(seconds).as_text() if start else f"{seconds:.12g} s"


def _counted(number: int, noun: str = "place") -> str:
    return f"{number} {noun}" + "s" * (number != 1)


# ---------------------------------------------------------------------- logs that no platform can have flown
# A receiver that has frozen goes on writing its last place; one that is slower than its log writes each place several
# times; a filter that is set anew, or a cell that is wrong, makes a step that no platform takes. A polynomial through
# such places is smooth all the same, and wrong. What is below the limits here is noise, and counts as the residual.
_STILL_M = 1e-3  # over a whole aperture; the noise of any receiver is more
_SAME_M = 1e-6  # between two places; the same numbers, turned to the scene's axes, are rounded to 1e-9 m
_LEAST_M = 0.1  # of what is missed or jumped: six decimals of a degree are rounded by as much
_HARDEST = 30.0  # m/s², 3 g; and no platform takes that back within three samples
_USUAL = 20  # times the median; the largest of thousands of normal numbers is 4 times it, that of rough noise 10
_BESIDE = 3  # steps on each side that a step is compared with
_BEYOND = 10  # samples beyond each end of the aperture that say what is usual


def hold_to_motion(times: Floats, places: Floats, stretch_s: float, name: str) -> None:
    """Refuse a log that no platform can have flown.

    Parameters
    ----------
    times : (n,) ndarray
        Slow time, rising; what is far outside the stretch is not looked at. [s]
    places : (n, 3) ndarray
        In any axes. [m]
    stretch_s : float
        Time around the middle of the aperture whose places are used. [s]
    name : str
        What messages call the log.

    Raises
    ------
    PathFileError
        The places in the stretch are one place to 1 mm. Or places are those before them while the platform moves by
        more than 0.1 m, at its mean speed in the aperture. Or a step is off the median of seven around it by more
        than 0.1 m, by more than 3 g would make it, and by more than 20 times what is usual.
    """
    half = stretch_s / 2 * (1 + 1e-9)
    first, last = int(np.searchsorted(times, -half, "left")), int(np.searchsorted(times, half, "right"))
    at, flown = times[first:last], places[first:last]
    if at.size < 2 * _BESIDE - 1:  # too few for a path, too
        return
    extent = float(np.linalg.norm(flown - flown[0], axis=1).max())
    if extent <= _STILL_M:
        raise PathFileError(
            f"{name}: stands still: its {at.size} places around the aperture are the same to {1e3 * _STILL_M:g} mm",
            "accepted: the log of a platform that moves",
            "A fixed platform needs no log: give its place, and speed 0",
        )
    _hold_to_new_places(at, flown, extent, name)
    near = slice(max(first - _BEYOND, 0), last + _BEYOND)
    _hold_to_small_steps(times[near], places[near], half, name)


def _hold_to_new_places(at: Floats, flown: Floats, extent: float, name: str) -> None:
    """Refuse places that are the same as those before them, while the platform moves."""
    is_held = np.linalg.norm(np.diff(flown, axis=0), axis=1) <= _SAME_M
    if not is_held.any():
        return
    edges = np.diff(np.concatenate([[0], is_held.astype(np.int8), [0]]))
    begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    durations = at[ends] - at[begins]
    longest = int(durations.argmax())
    missed = extent * float(durations[longest] / (at[-1] - at[0]))
    if missed > _LEAST_M:
        raise PathFileError(
            f"{name}: repeats places: {int(is_held.sum())} of {at.size} around the aperture are the place before;"
            f" from {at[begins[longest]]:+.4g} s of mid-aperture on for {durations[longest]:.3g} s, in which the"
            f" platform moves {format_quantity(missed, 'm')}",
            f"accepted: repeats in which it moves at most {_LEAST_M:g} m",
            "Leave out places that were not measured anew, or write more digits",
        )


def _hold_to_small_steps(times: Floats, places: Floats, half: float, name: str) -> None:
    """Refuse steps between neighbouring places that those around them do not allow."""
    steps = np.diff(times)
    velocities = np.diff(places, axis=0) / steps[:, None]
    around = np.pad(velocities, ((_BESIDE, _BESIDE), (0, 0)), mode="reflect")
    usual = np.median(np.lib.stride_tricks.sliding_window_view(around, 2 * _BESIDE + 1, axis=0), axis=-1)
    off = np.linalg.norm(velocities - usual, axis=1) * steps
    allowed = np.maximum(np.maximum(_LEAST_M, _HARDEST * steps**2), _USUAL * np.median(off))
    is_jump = (off > allowed) & (times[1:] >= -half) & (times[:-1] <= half)
    if is_jump.any():
        worst = int(np.where(is_jump, off / allowed, 0.0).argmax())
        jump, least = format_quantity(float(off[worst]), "m"), format_quantity(float(allowed[worst]), "m", 2)
        raise PathFileError(
            f"{name}: jumps by {jump} within {steps[worst]:.3g} s, {times[worst]:+.4g} s from mid-aperture; the "
            f"steps beside it allow {least}",
            "accepted: the log of a flight without steps",
            "Take out the places that are wrong, or smooth the log before",
        )
