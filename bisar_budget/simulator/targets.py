"""Contents of a simulated scene, as specified on the command line: point targets and clutter."""

import csv
import math
import re
from collections.abc import Iterator
from typing import NamedTuple

from bisar_budget import units
from bisar_budget.faults import InvalidValueError
from bisar_budget.resources import DISK, UnreadableError
from bisar_budget.units import parse_quantity

_MAX_POINTS = 100
_MAX_DISTANCE_M = 1e5  # largest distance of a target from the scene centre
_LEVEL_RANGE_DB = (-200.0, 200.0)
_ACCEPTED_FORMS = (
    "EAST, NORTH or EAST, NORTH, LEVEL or grid:NXxNY:SPACING or clutter LEVEL, separated by semicolons; or the name "
    "of a .csv file"
)
_GRID_PATTERN = re.compile(r"grid:\s*(\d{1,3})\s*x\s*(\d{1,3})\s*:(.+)", re.ASCII)
_LIST_COLUMNS = ("east [m]", "north [m]", "amplitude")
_MAX_LIST_BYTES = 1 << 20


class Target(NamedTuple):
    """Point target on the ground: its position relative to the scene centre, and its power.

    `east` and `north` are in metres. `level_db` [dB] is the power relative to a point of amplitude 1.
    """

    east: float = 0.0
    north: float = 0.0
    level_db: float = 0.0


class Targets(NamedTuple):
    """Point targets of a scene, and the level of its clutter.

    The clutter level [dB] is the mean power of a pixel relative to the peak of a point of 0 dB. It is None if there
    is no clutter.
    """

    points: tuple[Target, ...] = (Target(),)
    clutter_db: float | None = None


def parse_targets(text: str) -> Targets:
    """Read targets from text such as `0, 0; 30 m, -20 m, -6 dB; clutter -25 dB`, `grid:3x3:50 m`, or a file name.

    Entries are separated by semicolons. An entry is a point (east, north and optionally level), a grid of points
    centred at the scene centre, or a clutter level, which may be given only once. Units are written as in a mission
    file; numbers without a unit are in metres or decibels. An entry that ends in .csv is the name of a file with the
    columns east [m], north [m] and amplitude.

    Raises
    ------
    ValueError
        An entry cannot be read, there is no point, or there are more than a hundred points. The message names the
        first wrong entry and the reason.
    """
    points: list[Target] = []
    clutter = None
    for entry in (part.strip() for part in text.split(";")):
        if not entry:
            continue
        if entry.startswith("clutter"):
            if clutter is not None:
                raise ValueError("clutter is given twice; one level holds for the scene")
            clutter = _number(entry, entry.removeprefix("clutter").strip(), units.POWER_RATIO)
            continue
        if entry.lower().endswith(".csv"):
            points += read_list(entry)
            continue
        if entry.startswith("grid"):
            points += _grid(entry)
            continue
        fields = [field.strip() for field in entry.split(",")]
        if len(fields) not in (2, 3):
            raise ValueError(f"{entry!r} has {len(fields)} parts; accepted: {_ACCEPTED_FORMS}")
        east, north = (_number(entry, field, units.LENGTH) for field in fields[:2])
        points.append(Target(east, north, _number(entry, fields[2], units.POWER_RATIO) if fields[2:] else 0.0))
    if not points:
        raise ValueError(f"there is no point; accepted: {_ACCEPTED_FORMS}")
    if len(points) > _MAX_POINTS:
        raise ValueError(f"there are {len(points)} points, at most {_MAX_POINTS} are simulated")
    return Targets(tuple(points), clutter)


def _grid(entry: str) -> Iterator[Target]:
    """Yield points of 0 dB in a grid centred at the scene centre, from an entry `grid:NXxNY:SPACING`.

    NX and NY are the numbers of points in the east and north directions.
    """
    match = _GRID_PATTERN.fullmatch(entry)
    if match is None:
        raise ValueError(f"{entry!r} is no grid; accepted: {_ACCEPTED_FORMS}")
    columns, rows = int(match[1]), int(match[2])
    if not 0 < columns * rows <= _MAX_POINTS:
        raise ValueError(f"{entry!r} has {columns * rows} points, 1 to {_MAX_POINTS} are simulated")
    spacing = _number(entry, match[3].strip(), units.LENGTH)
    for row in range(rows):
        for column in range(columns):
            yield Target(spacing * (column - (columns - 1) / 2), spacing * (row - (rows - 1) / 2))


def read_list(file: str) -> list[Target]:
    """Read point targets from a CSV file with the columns east [m], north [m] and amplitude.

    A `ValueError` that names the file, the line and the reason is raised if the file cannot be read or a line is not
    a valid point.
    """
    try:
        data = DISK.content(file, _MAX_LIST_BYTES)
    except UnreadableError as error:
        raise ValueError(str(error)) from None
    if len(data) > _MAX_LIST_BYTES:
        raise ValueError(f"{file} is longer than {_MAX_LIST_BYTES} bytes")
    try:
        rows = list(csv.reader(data.decode("utf-8-sig").splitlines()))
    except UnicodeDecodeError:
        raise ValueError(f"{file} cannot be read: it is no text") from None
    except csv.Error as error:
        raise ValueError(f"{file} is not CSV: {error}") from None
    header = [name.strip() for name in (rows or [[]])[0]]
    if tuple(header) != _LIST_COLUMNS:
        raise ValueError(f"{file}:1: the columns must be {', '.join(_LIST_COLUMNS)} (got {', '.join(header)[:60]})")
    return [_listed(f"{file}:{line}", row) for line, row in enumerate(rows[1:], 2) if row]


def _listed(line_name: str, row: list[str]) -> Target:
    try:
        east, north, amplitude = (float(field) for field in row)
    except ValueError:
        raise ValueError(f"{line_name}: {', '.join(row)[:60]!r} is not three numbers") from None
    if not (abs(east) <= _MAX_DISTANCE_M and abs(north) <= _MAX_DISTANCE_M):
        raise ValueError(f"{line_name}: a point is beyond {_MAX_DISTANCE_M:g} m from the scene centre, or nowhere")
    level = 20 * math.log10(amplitude) if 0 < amplitude < math.inf else -math.inf
    if not _LEVEL_RANGE_DB[0] <= level <= _LEVEL_RANGE_DB[1]:
        raise ValueError(f"{line_name}: the amplitude must be from 1e-10 to 1e10 (got {amplitude:g})")
    return Target(east, north, level)


def _number(entry: str, quantity: str, dimension: units.Dimension) -> float:
    try:
        number = parse_quantity(quantity, dimension)
    except InvalidValueError as error:
        raise ValueError(f"{entry!r}: {quantity!r} {error.problem.problem}; accepted: {_ACCEPTED_FORMS}") from None
    low, high = (-_MAX_DISTANCE_M, _MAX_DISTANCE_M) if dimension is units.LENGTH else _LEVEL_RANGE_DB
    if not low <= number <= high:
        raise ValueError(f"{entry!r}: {quantity!r} is beyond {low:g} to {high:g} {dimension.si}")
    return number
