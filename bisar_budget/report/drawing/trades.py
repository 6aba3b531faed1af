"""The content of a drawing of a sweep, as arrays."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.design.cases import Cases, Values
from bisar_budget.design.table import Part
from bisar_budget.findings.trade import Axis, Trade
from bisar_budget.mission.quantities import Number, QuestionError, Varied
from bisar_budget.mission.readers import DIRECTION
from bisar_budget.ranges.exact_ranges import Floats
from bisar_budget.report.drawing.svg import Point
from bisar_budget.report.tables import Described

MAX_CASES = 4_000_000  # of a plot: more than a screen has pixels
ROWS = 7  # curves, at most
_LABELLED = 0.02  # of a map: a smaller region has no name
_FINEST = 500  # cells along a map: a drawing has no more pixels
_WIDE = 8.0  # a span of values above this is drawn in equal ratios
_NEEDED = ("status", "worst_row", "utilization")


def check_plot(cases: Cases, *, is_polar: bool) -> None:
    """Say why `--plot` cannot draw a sweep.

    Raises
    ------
    QuestionError
        No grid, more than two keys that vary, or none, too many cases, or no azimuth where a polar map is asked for.
    """
    accepted = "accepted: --vary of one key, or of two"
    if not cases.is_grid:
        raise QuestionError(f"--plot draws a grid; {accepted}. The cases of a table or a sample have no axes")
    varying = varying_keys(cases)
    if not 1 <= len(varying) <= 2:
        raise QuestionError(f"--plot draws one axis or two, and {len(varying)} keys vary; {accepted}")
    if cases.count > MAX_CASES:
        raise QuestionError(f"--plot draws up to {MAX_CASES} cases, and there are {cases.count}")
    if not is_polar:
        return
    if len(varying) != 2 or not any(one.reader is DIRECTION for one in varying):
        raise QuestionError("--polar draws a key over an azimuth; accepted: --vary of an azimuth and of another key")
    azimuth = next(one for one in varying if one.reader is DIRECTION)
    other = next(one for one in varying if one is not azimuth)
    if not isinstance(other, Number):
        raise QuestionError(f"--polar draws {other.key} as a radius; accepted: a number")
    if cases.columns[cases.varied.index(other)].min() < 0:
        raise QuestionError(f"--polar draws {other.key} as a radius; accepted: values from 0")


def varying_keys(cases: Cases) -> list[Varied]:
    """Keys that have more than one value."""
    return [one for one, size in zip(cases.varied, cases.shape, strict=True) if size > 1]


class Gathered:
    """Collects the columns that a plot needs, as the parts of a sweep come."""

    def __init__(self, described: Described, names: Sequence[str] = (), column: str | None = None) -> None:
        self.described, self.cases = described, described.cases
        columns = {one.name: one for one in described.columns}
        if column is not None and (column not in columns or columns[column].is_text):
            known = [name for name, one in columns.items() if not one.is_text and name not in described.numbers]
            raise QuestionError(f"--plot-column {column}: is no column of numbers; accepted: {', '.join(known)}")
        self.column, self.heading = column or "", columns[column].heading if column is not None else ""
        needed = (*_NEEDED, *names, *((column,) if column is not None else ()))
        self.found: dict[str, list[NDArray[Any]]] = {name: [] for name in needed}

    def add(self, part: Part) -> None:
        """Take what is needed of a part."""
        for name, pieces in self.found.items():
            pieces.append(self.described.said(name, part.values[name]))

    def passing(self, parts: Iterable[Part]) -> Iterator[Part]:
        """Hand parts on, and take what is needed of each."""
        for part in parts:
            self.add(part)
            yield part

    def trade(self, *, is_polar: bool = False) -> Trade:
        """Lay it out; the azimuth first in a polar map."""
        axes: list[Axis] = []
        varying, fixed, orders = [], [], []
        for place, (one, values) in enumerate(zip(self.cases.varied, self.cases.columns, strict=True)):
            axis = self._axis(one, values)
            orders.append(np.arange(values.size) if axis.words else np.argsort(axis.values))
            if values.size == 1:
                fixed.append(
                    f"{one.key} {axis.words[0] if axis.words else f'{axis.values[0]:.6g} {one.unit}'}".strip()
                )
            else:
                varying.append(place)
                rising = axis.values[orders[-1]]
                axes.append(axis._replace(values=rising, is_log=not axis.words and _is_log(rising)))
        sizes = [self.cases.shape[place] for place in varying]
        laid = {
            name: np.concatenate(pieces).reshape(self.cases.shape)[np.ix_(*orders)].reshape(sizes)
            for name, pieces in self.found.items()
        }
        if is_polar and self.cases.varied[varying[0]].reader is not DIRECTION:
            axes.reverse()
            laid = {name: values.T for name, values in laid.items()}
        return Trade(tuple(axes), laid, tuple(fixed), self.column, self.heading)

    def _axis(self, one: Varied, values: Values) -> Axis:
        """The axis of a key, its values in the order that they were given in."""
        if not isinstance(one, Number):
            words = tuple(values.tolist())
            own = float(words.index(one.value)) if one.value in words else None
            return Axis(one.key, "", np.arange(float(values.size)), words=words, own=own)
        said = np.asarray(self.described.said(one.key, values), float)
        factor, divisor = one.dimension.scales.get(one.unit) or (1.0, 1.0)
        own = None if one.value is None else one.value / factor * divisor
        return Axis(one.key, one.unit, said, scale=factor / divisor, own=own)


def _is_log(values: Floats) -> bool:
    """Whether values are better seen in equal ratios: they have equal ones, and a wide span."""
    if values[0] <= 0 or values[-1] / values[0] < _WIDE or values.size < 3:
        return False
    steps, ratios = np.diff(values), np.diff(np.log(values))
    return bool(ratios.std() / ratios.mean() < steps.std() / steps.mean())


def per_word(trade: Trade) -> tuple[Axis, Mapping[str, Trade]] | None:
    """A sweep over a number and a few words as one over the number for each word; None of any other.

    The axis is that of the words.
    """
    with_words = [place for place, axis in enumerate(trade.axes) if axis.words]
    if len(trade.axes) != 2 or len(with_words) != 1 or len(trade.axes[with_words[0]].words) > ROWS:
        return None
    (place,) = with_words
    axis, other = trade.axes[place], trade.axes[1 - place]
    return axis, {
        word: trade._replace(
            axes=(other,), values={name: values.take(number, place) for name, values in trade.values.items()}
        )
        for number, word in enumerate(axis.words)
    }


def rows_that_matter(trade: Trade) -> tuple[str, ...]:
    """Rows that are the worst anywhere, the one that is most often first; not more than `ROWS`."""
    rows, counts = np.unique(trade.values["worst_row"][trade.values["worst_row"] != ""], return_counts=True)
    return tuple(str(row) for row in rows[np.argsort(-counts, kind="stable")][:ROWS])


def uses_of_rows(trade: Trade, gathered: Callable[[Sequence[str]], Gathered]) -> Mapping[str, Floats]:
    """Utilizations of the rows that matter over the one key that varies, none of another sweep.

    `gathered` sweeps again, with some columns.
    """
    if len(trade.axes) != 1 or trade.column or not (rows := rows_that_matter(trade)):
        return {}
    values = gathered([f"{row}.utilization" for row in rows]).trade().values
    return {row: values[f"{row}.utilization"] for row in rows}


def cell_edges(axis: Axis) -> list[float]:
    """Ends of the cells around the values; the first and the last end at the values themselves.

    Of words each has its room to both sides.
    """
    edges = axis.edges.tolist()
    return edges if axis.words else [float(axis.values[0]), *edges[1:-1], float(axis.values[-1])]


def stretches(begins: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """Starts and stops of neighbours of one kind; `begins` says of each but the first whether it begins another."""
    return pairwise([0, *(np.flatnonzero(begins) + 1).tolist(), begins.size + 1])


def runs(axis: Axis, statuses: NDArray[Any]) -> Iterator[tuple[str, float, float]]:
    """Stretches of one axis with one status each, from edge to edge."""
    edges = cell_edges(axis)
    for start, stop in stretches(statuses[1:] != statuses[:-1]):
        yield str(statuses[start]), edges[start], edges[stop]


class MapRegion(NamedTuple):
    """Neighbouring cells of a map with one worst row: where its name stands, and how many cells it has around."""

    row: str
    place: tuple[int, int]
    size: tuple[int, int]


def thinned(trade: Trade) -> Trade:
    """A sweep over two keys with no more values than a drawing shows, the first and the last among them."""
    picks = [
        np.arange(size) if axis.words else np.unique(np.linspace(0, size - 1, min(size, _FINEST)).round().astype(int))
        for axis, size in zip(trade.axes, trade.values["status"].shape, strict=True)
    ]
    axes = tuple(axis._replace(values=axis.values[pick]) for axis, pick in zip(trade.axes, picks, strict=True))
    return trade._replace(axes=axes, values={name: values[np.ix_(*picks)] for name, values in trade.values.items()})


def regions(rows: NDArray[Any]) -> list[MapRegion]:
    """Find the regions of a map that are large enough for a name, which stands where it is farthest from others.

    `rows` is (n, m); places are indices of it.
    """
    seen = rows == ""
    found = []
    for first, second in np.argwhere(~seen).tolist():
        if seen[first, second]:
            continue
        cells = _connected(rows, seen, (first, second))
        if len(cells) >= _LABELLED * rows.size:
            one = np.zeros(rows.shape, bool)
            one[tuple(np.transpose(cells))] = True
            place = _innermost(one)
            along = (_run(one[:, place[1]], place[0]), _run(one[place[0]], place[1]))
            found.append(MapRegion(str(rows[first, second]), place, along))
    return found


def _connected(rows: NDArray[Any], seen: NDArray[np.bool_], start: tuple[int, int]) -> list[tuple[int, int]]:
    """Cells of one row that hang together with a first one, side by side; they are seen then."""
    cells = [start]
    seen[start] = True
    for first, second in cells:  # it grows
        for cell in ((first - 1, second), (first + 1, second), (first, second - 1), (first, second + 1)):
            is_inside = 0 <= cell[0] < rows.shape[0] and 0 <= cell[1] < rows.shape[1]
            if is_inside and not seen[cell] and rows[cell] == rows[start]:
                seen[cell] = True
                cells.append(cell)
    return cells


def _innermost(mask: NDArray[np.bool_]) -> tuple[int, int]:
    """The cell that is left last when the rim is taken off again and again."""
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


def _run(line: NDArray[np.bool_], place: int) -> int:
    """Number of cells in one piece around a place of a line."""
    ends = np.flatnonzero(~line)
    low = ends[ends < place].max(initial=-1)
    high = ends[ends > place].min(initial=line.size)
    return int(high - low - 1)


def borders(rows: NDArray[Any], first: Floats, second: Floats) -> Floats:
    """Lines between cells of a map with different rows: (count, 2, 2), from edges (n + 1,) and (m + 1,)."""
    lines = []
    i, j = np.nonzero(rows[1:] != rows[:-1])
    lines.append(np.stack([np.stack([first[i + 1], second[j]], -1), np.stack([first[i + 1], second[j + 1]], -1)], 1))
    i, j = np.nonzero(rows[:, 1:] != rows[:, :-1])
    lines.append(np.stack([np.stack([first[i], second[j + 1]], -1), np.stack([first[i + 1], second[j + 1]], -1)], 1))
    return np.concatenate(lines)


def level_lines(levels: Floats, x: Floats, y: Floats) -> list[tuple[Point, Point]]:
    """Lines on which a grid of numbers is 0, linear between its points; none where a corner has no number.

    `levels` is (n, m) at places `x` (n,) and `y` (m,). Of a saddle the mean of its corners decides.
    """
    found: list[tuple[Point, Point]] = []
    is_finite = np.isfinite(levels)
    whole = is_finite[1:, 1:] & is_finite[:-1, 1:] & is_finite[1:, :-1] & is_finite[:-1, :-1]
    signs = levels > 0
    first = signs[:-1, :-1]
    mixed = whole & ~((signs[1:, 1:] == first) & (signs[1:, :-1] == first) & (signs[:-1, 1:] == first))
    for i, j in np.argwhere(mixed).tolist():
        corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
        crossed: list[Point] = []
        for one, other in pairwise([*corners, corners[0]]):
            a, b = float(levels[one]), float(levels[other])
            if (a > 0) != (b > 0):
                part = a / (a - b)
                crossed.append(
                    (
                        float(x[one[0]] + part * (x[other[0]] - x[one[0]])),
                        float(y[one[1]] + part * (y[other[1]] - y[one[1]])),
                    )
                )
        if len(crossed) == 4:  # a saddle: which corners hang together
            middle = sum(float(levels[corner]) for corner in corners) / 4
            if (middle > 0) != (levels[i, j] > 0):
                crossed = [*crossed[1:], crossed[0]]
        found += [(crossed[place], crossed[place + 1]) for place in range(0, len(crossed), 2)]
    return found
