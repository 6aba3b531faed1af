"""Compute the arrays for the drawing of a sweep: axes, curves, regions and contour lines."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.arrays import Floats, NumbersOrWords
from bisar_budget.findings.case_table import Cases, Column, Part, Values
from bisar_budget.findings.trade import Axis, Trade
from bisar_budget.mission.quantities import Number, QuestionError, Varied
from bisar_budget.mission.readers import DIRECTION
from bisar_budget.report.drawing.svg import Point
from bisar_budget.report.tables import Described
from bisar_budget.report.words.key_names import in_words

MAX_PLOT_CASES = 4_000_000  # of a plot, about as many as a screen has pixels
MAX_ROWS = 7  # rows with a curve each
_LABELLED_FRACTION = 0.02  # of the area of a map: smaller regions have no name
_MAX_MAP_CELLS = 500  # along an axis of a map, about as many as a drawing has pixels
_LOG_SPAN_RATIO = 8.0  # largest over smallest value, above which an axis may be logarithmic
_NEEDED_COLUMNS = ("status", "worst_row", "utilization")


def check_plot(cases: Cases, *, is_polar: bool) -> None:
    """Check that `--plot` can draw a sweep.

    Raises
    ------
    QuestionError
        The sweep is not a grid, does not vary one or two keys, or has too many cases. A polar map also requires that
        one key is an azimuth, and that the other key is a number without negative values.
    """
    accepted = "accepted: --vary of one key, or of two"
    if not cases.is_grid:
        raise QuestionError(f"--plot draws a grid; {accepted}. The cases of a table or a sample have no axes")
    varying = varying_keys(cases)
    if not 1 <= len(varying) <= 2:
        raise QuestionError(f"--plot draws one axis or two, and {len(varying)} keys vary; {accepted}")
    if cases.count > MAX_PLOT_CASES:
        raise QuestionError(f"--plot draws up to {MAX_PLOT_CASES} cases, and there are {cases.count}")
    if not is_polar:
        return
    if len(varying) != 2 or not any(varied.reader is DIRECTION for varied in varying):
        raise QuestionError("--polar draws a key over an azimuth; accepted: --vary of an azimuth and of another key")
    azimuth = next(varied for varied in varying if varied.reader is DIRECTION)
    radius = next(varied for varied in varying if varied is not azimuth)
    if not isinstance(radius, Number):
        raise QuestionError(f"--polar draws {radius.key} as a radius; accepted: a number")
    if cases.columns[cases.varied.index(radius)].min() < 0:
        raise QuestionError(f"--polar draws {radius.key} as a radius; accepted: values from 0")


def varying_keys(cases: Cases) -> list[Varied]:
    """Keys with more than one value in a sweep."""
    return [varied for varied, size in zip(cases.varied, cases.shape, strict=True) if size > 1]


class Gathered:
    """Columns of a sweep's table that are needed for a plot, collected while the parts of the sweep are computed."""

    def __init__(self, described: Described, names: Sequence[str] = (), column: str | None = None) -> None:
        self.described, self.cases = described, described.cases
        columns = {entry.name: entry for entry in described.columns}
        if column is not None and (column not in columns or columns[column].is_text):
            number_columns = [
                name for name, entry in columns.items() if not entry.is_text and name not in described.numbers
            ]
            raise QuestionError(
                f"--plot-column {column}: is no column of numbers; accepted: {', '.join(number_columns)}"
            )
        self.column, self.heading = column or "", _heading(columns[column]) if column is not None else ""
        needed = (*_NEEDED_COLUMNS, *names, *((column,) if column is not None else ()))
        self.pieces: dict[str, list[NumbersOrWords]] = {name: [] for name in needed}

    def add(self, part: Part) -> None:
        """Store the columns needed for the plot from one part of a sweep."""
        for name, column_pieces in self.pieces.items():
            column_pieces.append(self.described.converted(name, part.values[name]))

    def passing(self, parts: Iterable[Part]) -> Iterator[Part]:
        """Yield the parts of a sweep unchanged, and store the columns needed for the plot from each part."""
        for part in parts:
            self.add(part)
            yield part

    def trade(self, *, is_polar: bool = False) -> Trade:
        """Return the collected sweep with sorted axes. For a polar map, the azimuth is the first axis."""
        axes: list[Axis] = []
        varying_indices, fixed, orders = [], [], []
        for index, (varied, values) in enumerate(zip(self.cases.varied, self.cases.columns, strict=True)):
            axis = self._axis(varied, values)
            orders.append(np.arange(values.size) if axis.words else np.argsort(axis.values))
            if values.size == 1:
                value = axis.words[0] if axis.words else f"{axis.values[0]:.6g} {varied.unit}"
                fixed.append(f"{in_words(varied.key)} {value}".strip())
            else:
                varying_indices.append(index)
                rising = axis.values[orders[-1]]
                axes.append(axis._replace(values=rising, is_log=not axis.words and _is_log(rising)))
        sizes = [self.cases.shape[index] for index in varying_indices]
        laid_out = {
            name: np.concatenate(pieces).reshape(self.cases.shape)[np.ix_(*orders)].reshape(sizes)
            for name, pieces in self.pieces.items()
        }
        if is_polar and self.cases.varied[varying_indices[0]].reader is not DIRECTION:
            axes.reverse()
            laid_out = {name: values.T for name, values in laid_out.items()}
        return Trade(tuple(axes), laid_out, tuple(fixed), self.column, self.heading)

    def _axis(self, varied: Varied, values: Values) -> Axis:
        """Make the axis for a varied key, with the values in the order of the sweep."""
        if not isinstance(varied, Number):
            words = tuple(values.tolist())
            own_value = float(words.index(varied.value)) if varied.value in words else None
            return Axis(varied.key, "", np.arange(float(values.size)), words=words, own=own_value)
        shown = np.asarray(self.described.converted(varied.key, values), float)
        factor, divisor = varied.dimension.scales.get(varied.unit) or (1.0, 1.0)
        own_value = None if varied.value is None else varied.value / factor * divisor
        return Axis(varied.key, varied.unit, shown, scale=factor / divisor, own=own_value)


def _heading(column: Column) -> str:
    """Heading of a table column: its description and its unit."""
    return column._replace(name=in_words(column.name)).heading


def _is_log(values: Floats) -> bool:
    """Whether an axis should be logarithmic.

    This is the case if the ratio of the largest to the smallest value is large, and neighbouring values vary less in
    their ratios than in their differences.
    """
    if values[0] <= 0 or values[-1] / values[0] < _LOG_SPAN_RATIO or values.size < 3:
        return False
    steps, ratios = np.diff(values), np.diff(np.log(values))
    return bool(ratios.std() / ratios.mean() < steps.std() / steps.mean())


def per_word(trade: Trade) -> tuple[Axis, Mapping[str, Trade]] | None:
    """Split a sweep over a numerical key and a key with a few words into a numerical sweep for each word.

    Returns the axis of the words and the sweeps by word; None for any other sweep.
    """
    word_axes = [word_axis for word_axis, axis in enumerate(trade.axes) if axis.words]
    if len(trade.axes) != 2 or len(word_axes) != 1 or len(trade.axes[word_axes[0]].words) > MAX_ROWS:
        return None
    (word_axis,) = word_axes
    axis, number_axis = trade.axes[word_axis], trade.axes[1 - word_axis]
    return axis, {
        word: trade._replace(
            axes=(number_axis,), values={name: values.take(index, word_axis) for name, values in trade.values.items()}
        )
        for index, word in enumerate(axis.words)
    }


def rows_that_matter(trade: Trade) -> tuple[str, ...]:
    """Rows that are the worst row in at least one case, most frequent first, limited to `MAX_ROWS` rows."""
    rows, counts = np.unique(trade.values["worst_row"][trade.values["worst_row"] != ""], return_counts=True)
    return tuple(str(row) for row in rows[np.argsort(-counts, kind="stable")][:MAX_ROWS])


def uses_of_rows(trade: Trade, gathered: Callable[[Sequence[str]], Gathered]) -> Mapping[str, Floats]:
    """Utilizations of the rows from `rows_that_matter` in a sweep over one key, each (cases,), by row id.

    The mapping is empty for any other sweep. `gathered` runs the sweep again and collects the columns with the given
    names.
    """
    if len(trade.axes) != 1 or trade.column or not (rows := rows_that_matter(trade)):
        return {}
    values = gathered([f"{row}.utilization" for row in rows]).trade().values
    return {row: values[f"{row}.utilization"] for row in rows}


def cell_edges(axis: Axis) -> list[float]:
    """Edges of the map cells that surround the values of an axis.

    If the values are numbers, the first cell begins at the first value, and the last cell ends at the last value. If
    they are words, all cells have their full width.
    """
    edges = axis.edges.tolist()
    return edges if axis.words else [float(axis.values[0]), *edges[1:-1], float(axis.values[-1])]


def stretches(begins: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """Yield the start and stop indices of each run of equal neighbouring items in a sequence of n items.

    `begins` (n - 1,) has a value for each item except the first: True if the item begins a new run.
    """
    return pairwise([0, *(np.flatnonzero(begins) + 1).tolist(), begins.size + 1])


def runs(axis: Axis, statuses: NumbersOrWords) -> Iterator[tuple[str, float, float]]:
    """Yield the intervals of an axis in which neighbouring cases have the same status.

    Each interval is given by its status and its two ends.
    """
    edges = cell_edges(axis)
    for start, stop in stretches(statuses[1:] != statuses[:-1]):
        yield str(statuses[start]), edges[start], edges[stop]


class MapRegion(NamedTuple):
    """A region of a map: neighbouring cells that have the same worst budget row.

    `cell` has the indices of the cell in which the name is written. `size` is the extent of the region through this
    cell, along the first and along the second axis, as numbers of cells.
    """

    row: str
    cell: tuple[int, int]
    size: tuple[int, int]


def thinned(trade: Trade) -> Trade:
    """Reduce a sweep over two keys to at most `_MAX_MAP_CELLS` numbers per axis, keeping the first and the last."""
    picks = [
        np.arange(size)
        if axis.words
        else np.unique(np.linspace(0, size - 1, min(size, _MAX_MAP_CELLS)).round().astype(int))
        for axis, size in zip(trade.axes, trade.values["status"].shape, strict=True)
    ]
    axes = tuple(axis._replace(values=axis.values[pick]) for axis, pick in zip(trade.axes, picks, strict=True))
    return trade._replace(axes=axes, values={name: values[np.ix_(*picks)] for name, values in trade.values.items()})


def regions(rows: NumbersOrWords) -> list[MapRegion]:
    """Regions of a map that are large enough for a name.

    A region consists of connected cells with the same worst budget row. The name of the row is written in the cell
    farthest from other regions. `rows` (n, m) identifies the worst budget row in each cell.
    """
    seen = rows == ""
    map_regions = []
    for first, second in np.argwhere(~seen).tolist():
        if seen[first, second]:
            continue
        cells = _connected(rows, seen, (first, second))
        if len(cells) >= _LABELLED_FRACTION * rows.size:
            mask = np.zeros(rows.shape, bool)
            mask[tuple(np.transpose(cells))] = True
            cell = _innermost(mask)
            spans = (_run(mask[:, cell[1]], cell[0]), _run(mask[cell[0]], cell[1]))
            map_regions.append(MapRegion(str(rows[first, second]), cell, spans))
    return map_regions


def _connected(rows: NumbersOrWords, seen: NDArray[np.bool_], start: tuple[int, int]) -> list[tuple[int, int]]:
    """Indices of the cells that have the same worst budget row as the cell `start`, and are connected to it by sides.

    These cells are marked in `seen`.
    """
    cells = [start]
    seen[start] = True
    for first, second in cells:  # the list grows in the loop
        for cell in ((first - 1, second), (first + 1, second), (first, second - 1), (first, second + 1)):
            is_inside = 0 <= cell[0] < rows.shape[0] and 0 <= cell[1] < rows.shape[1]
            if is_inside and not seen[cell] and rows[cell] == rows[start]:
                seen[cell] = True
                cells.append(cell)
    return cells


def _innermost(mask: NDArray[np.bool_]) -> tuple[int, int]:
    """Indices of the innermost cell of a mask, found by repeated removal of the border cells."""
    inner = mask
    while True:
        padded = np.pad(inner, 1)
        smaller = inner & padded[:-2, 1:-1] & padded[2:, 1:-1] & padded[1:-1, :-2] & padded[1:-1, 2:]
        if not smaller.any():
            cells = np.argwhere(inner)
            middle = cells.mean(axis=0)
            first, second = cells[((cells - middle) ** 2).sum(axis=1).argmin()].tolist()
            return first, second
        inner = smaller


def _run(line: NDArray[np.bool_], index: int) -> int:
    """Number of consecutive True cells in a line of cells, including the cell at `index`."""
    ends = np.flatnonzero(~line)
    low = ends[ends < index].max(initial=-1)
    high = ends[ends > index].min(initial=line.size)
    return int(high - low - 1)


def borders(rows: NumbersOrWords, first: Floats, second: Floats) -> Floats:
    """Border lines between neighbouring cells of a map whose worst budget rows differ, (count, 2, 2).

    Each line is given by its two end points. `rows` (n, m) identifies the worst budget row in each cell. `first`
    (n + 1,) and `second` (m + 1,) are the edges of the cells along the two axes.
    """
    lines = []
    i, j = np.nonzero(rows[1:] != rows[:-1])
    lines.append(np.stack([np.stack([first[i + 1], second[j]], -1), np.stack([first[i + 1], second[j + 1]], -1)], 1))
    i, j = np.nonzero(rows[:, 1:] != rows[:, :-1])
    lines.append(np.stack([np.stack([first[i], second[j + 1]], -1), np.stack([first[i + 1], second[j + 1]], -1)], 1))
    return np.concatenate(lines)


def level_lines(levels: Floats, x: Floats, y: Floats) -> list[tuple[Point, Point]]:
    """Contour lines at level 0 of values on a grid, found by linear interpolation between the grid points.

    `levels` (n, m) are the values at `x` (n,) and `y` (m,). A cell with a corner that is not finite has no line. In a
    saddle, the mean of the values at the four corners decides which corners are connected.
    """
    lines: list[tuple[Point, Point]] = []
    is_finite = np.isfinite(levels)
    is_complete = is_finite[1:, 1:] & is_finite[:-1, 1:] & is_finite[1:, :-1] & is_finite[:-1, :-1]
    signs = levels > 0
    first = signs[:-1, :-1]
    mixed = is_complete & ~((signs[1:, 1:] == first) & (signs[1:, :-1] == first) & (signs[:-1, 1:] == first))
    for i, j in np.argwhere(mixed).tolist():
        corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
        crossed: list[Point] = []
        for start, end in pairwise([*corners, corners[0]]):
            a, b = float(levels[start]), float(levels[end])
            if (a > 0) != (b > 0):
                fraction = a / (a - b)
                crossed.append(
                    (
                        float(x[start[0]] + fraction * (x[end[0]] - x[start[0]])),
                        float(y[start[1]] + fraction * (y[end[1]] - y[start[1]])),
                    )
                )
        if len(crossed) == 4:  # a saddle
            middle = sum(float(levels[corner]) for corner in corners) / 4
            if (middle > 0) != (levels[i, j] > 0):
                crossed = [*crossed[1:], crossed[0]]
        lines += [(crossed[index], crossed[index + 1]) for index in range(0, len(crossed), 2)]
    return lines
