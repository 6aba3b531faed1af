"""A sweep as a drawing of a report: utilizations over one key with the limit, a map of statuses over two.

Text and colours are those of the page, light, dark and on paper; a file of its own brings them along.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.faults import printable
from bisar_budget.findings.status import STATUS
from bisar_budget.findings.trade import Axis, Trade, TradeStudy
from bisar_budget.report.drawing import status_colours
from bisar_budget.report.drawing.svg import (
    LINE_HEIGHT,
    Box,
    Canvas,
    Point,
    Segment,
    axis_number,
    round_step,
    text_width,
    ticks,
)
from bisar_budget.report.drawing.trades import borders, per_word, regions, runs
from bisar_budget.report.words.sentences import percent

_WIDTH, _HEIGHT = 560.0, 270.0  # of a drawing, of its frame [px]
_LEFT, _RIGHT, _TOP = 58.0, 12.0, 10.0  # px around the frame
_MOST_LEFT = 190.0  # px that names at an axis may take
_BAR = 24.0  # px for a word
_HIGH, _LEAST = 3.0, 1e-3  # of the limit: above it equal ratios; what is smaller is not of interest there
_STRENGTHS = (0.24, 0.13, 0.36)  # opacity of the first, second and third status of one colour
_DASHES = ("", "7 3", "2 3", "9 3 2 3", "5 5", "1 4", "12 4")
_CELLS = 60  # of a map that have room for words of their own
_LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"


def study_drawing(study: TradeStudy, key: str, title: str, description: str) -> str:
    """Draw a sweep as SVG.

    Parameters
    ----------
    study : TradeStudy
        Over one key or two.
    key : str
        What makes the ids of the drawing its own.
    title, description : str
        What it shows, and what it says to who cannot see it.
    """
    canvas = Canvas()
    by_word = per_word(study.trade)
    if by_word is not None:
        bottom = _curves_of_words(canvas, by_word[1])
    elif len(study.trade.axes) == 2:
        bottom = _map(canvas, study.trade)
    elif study.trade.axes[0].words:
        bottom = _bars(canvas, study.trade)
    else:
        bottom = _curves_of_rows(canvas, study)
    return canvas.document((_WIDTH, bottom + 4), f"{key} study", title, description, _style(study.trade.statuses))


def _style(statuses: Sequence[str]) -> str:
    """Rules for what only these drawings have."""
    light, dark = status_colours.light(), status_colours.dark()
    names = dict.fromkeys((*status_colours.ROWS, "fail"))
    rules = []
    for place, (name, dashes) in enumerate(zip(status_colours.ROWS, _DASHES, strict=True)):
        rules.append(f".row{place}{{fill:none;stroke:var(--{name},{light[name]});stroke-width:1.8")
        rules[-1] += f";stroke-dasharray:{dashes}}}" if dashes else "}"
    for name, strength in status_colours.strengths(statuses, _STRENGTHS).items():
        tone = status_colours.tone_of(name)
        rules.append(
            f".is-{name}{{fill:var(--{tone},{light[tone]});fill-opacity:{strength};shape-rendering:crispEdges}}"
        )
        rules.append(f".bar.is-{name}{{fill-opacity:.75}}")
    rules.append(f".limit{{fill:none;stroke:var(--fail,{light['fail']});stroke-width:1.6;stroke-dasharray:7 4}}")
    rules.append(".border{fill:none;stroke:var(--ink,#222);stroke-width:1.7}")
    rules.append(".between{fill:none;stroke:var(--muted,#595f66);stroke-width:.8;stroke-dasharray:2 2}")
    rules.append(".worst{fill:none;stroke:var(--muted,#595f66);stroke-opacity:.35;stroke-width:6}")
    rules.append(".own{fill:var(--paper,#fff);stroke:var(--ink,#222);stroke-width:1.6}")
    rules.append(".frame{fill:none;stroke:var(--muted,#595f66);stroke-width:1}")
    rules.append(".at{fill:none;stroke:var(--ink,#222);stroke-width:1.1;stroke-dasharray:1.5 3}")
    colours = ";".join(f"--{name}:{dark[name]}" for name in names if name not in ("transmitter", "receiver"))
    scoped = "".join(f"svg.drawing {rule}" for rule in rules)
    return f"{scoped}@media (prefers-color-scheme:dark){{svg:root.drawing{{{colours}}}}}"


# ---------------------------------------------------------------- axes
class _Scale(NamedTuple):
    """From a value to a place. [px]"""

    low: float
    high: float
    start: float
    end: float
    is_log: bool = False

    def at(self, value: float) -> float:
        """Place of a value."""
        low, high, value = (math.log(one) if self.is_log else one for one in (self.low, self.high, value))
        return self.start + (value - low) / (high - low) * (self.end - self.start)

    def ticks(self, room: float) -> Sequence[float]:
        """Round values, each with room for its number. [px]"""
        size = abs(self.end - self.start)
        if not self.is_log:
            return [*ticks(self.low, self.high, round_step((self.high - self.low) * room / size))]
        powers = range(math.floor(math.log10(self.low)), math.ceil(math.log10(self.high)) + 1)
        for factors in ((1, 2, 5), (1, 3), (1,)):
            found = [
                factor * 10.0**power
                for power in powers
                for factor in factors
                if self.low * (1 - 1e-9) <= factor * 10.0**power <= self.high * (1 + 1e-9)
            ]
            if all(abs(self.at(b) - self.at(a)) >= room for a, b in pairwise(found)):
                break
        return found


def _scale_of(axis: Axis, start: float, end: float) -> _Scale:
    """Of a map the cells of words stand side by side; numbers go from the first to the last."""
    if axis.words:
        return _Scale(-0.5, axis.values[-1] + 0.5, start, end)
    return _Scale(float(axis.values[0]), float(axis.values[-1]), start, end, axis.is_log)


def _scale_of_uses(uses: NDArray[Any], start: float, end: float) -> _Scale:
    """Utilizations from 0, or in equal ratios where some are far above their limit."""
    finite = uses[np.isfinite(uses) & (uses > 0)]
    if finite.max() <= _HIGH:
        return _Scale(0.0, 108.0 * float(finite.max()), start, end)
    return _Scale(100 * max(_LEAST, float(finite.min())) / 1.3, 130.0 * float(finite.max()), start, end, is_log=True)


def _short(word: str, room: float) -> str:
    """A word that has room, with an end that says that it is longer."""
    text = printable(word)
    while text_width(text) > room and len(text) > 2:
        text = f"{text[:-2].rstrip('…')}…"
    return text


def _x_axis(canvas: Canvas, frame: Box, axis: Axis, scale: _Scale) -> float:
    """Numbers or words below a frame, and the name of the key; returns where it ends."""
    bottom = frame.bottom
    if axis.words:
        room = (frame.right - frame.left) / len(axis.words)
        if any(text_width(word) > room - 4 for word in axis.words):
            names = [_short(word, 120.0) for word in axis.words]
            for place, name in enumerate(names):
                half = text_width(name) / 2
                canvas.upright_text((scale.at(place) + 4, bottom + 6 + half), name, "axis")
            bottom += max(map(text_width, names)) - 8
        else:
            for place, word in enumerate(axis.words):
                canvas.text((scale.at(place), bottom + 14), [printable(word)], "axis", "middle")
    else:
        for value in scale.ticks(46.0):
            x = scale.at(value)
            canvas.lines([((x, bottom), (x, bottom + 4))], "thin")
            canvas.text((x, bottom + 15), [axis_number(value)], "axis", "middle")
    canvas.text(((frame.left + frame.right) / 2, bottom + 31), [axis.label], "small", "middle")
    return bottom + 31


def _y_axis(canvas: Canvas, frame: Box, scale: _Scale, label: str, words: Sequence[str] = ()) -> None:
    """Numbers or words left of a frame, and what they are."""
    room = frame.left - 24
    for place, word in enumerate(words):
        canvas.text((frame.left - 6, scale.at(place) + 4), [_short(word, room)], "axis", "end")
    for value in () if words else scale.ticks(26.0):
        y = scale.at(value)
        canvas.lines([((frame.left - 4, y), (frame.left, y))], "thin")
        canvas.text((frame.left - 7, y + 3.5), [axis_number(value)], "axis", "end")
    canvas.upright_text((12, (frame.top + frame.bottom) / 2), label, "small")


def _frame(canvas: Canvas, frame: Box) -> None:
    canvas.polygon(
        [(frame.left, frame.top), (frame.right, frame.top), (frame.right, frame.bottom), (frame.left, frame.bottom)],
        "frame",
        is_obstacle=False,
    )


class _Entry(NamedTuple):
    """One line of a legend: its words, and how its mark is drawn from the left middle of 24 px."""

    words: str
    mark: Callable[[Point], None]


def _legend(canvas: Canvas, top: float, entries: Sequence[_Entry]) -> float:
    """Write entries in lines below a drawing; returns where they end."""
    x, y = _LEFT - 40, top + 20
    for entry in entries:
        words = _short(entry.words, _WIDTH - _LEFT)
        width = 32 + text_width(words) + 12
        if x + width > _WIDTH and x > _LEFT - 40:
            x, y = _LEFT - 40, y + LINE_HEIGHT + 3
        entry.mark((x, y - 4))
        canvas.text((x + 31, y), [words], "small")
        x += width
    return y + 6


def _line(canvas: Canvas, words: str, style: str) -> _Entry:
    return _Entry(words, lambda at: canvas.lines([(at, (at[0] + 25, at[1]))], style))


def _swatches(canvas: Canvas, statuses: Sequence[str]) -> Iterator[_Entry]:
    for name in statuses:
        yield _Entry(status_colours.status_words(name), lambda at, name=name: _swatch(canvas, at, name))  # type: ignore[misc]


def _swatch(canvas: Canvas, at: Point, status: str) -> None:
    box = Box(at[0] + 4, at[1] - 5, at[0] + 22, at[1] + 5)
    canvas.boxes([box], f"is-{status}")
    canvas.boxes([box], "frame")


# ---------------------------------------------------------------- one key
def _curves_of_rows(canvas: Canvas, study: TradeStudy) -> float:
    """Utilizations of rows over a number; behind them the status."""
    trade = study.trade
    (axis,) = trade.axes
    curves = [("worst row", "worst", np.asarray(trade.values["utilization"], float))]
    curves += [(row, f"row{place}", of_row) for place, (row, of_row) in enumerate(study.rows.items())]
    return _curves(canvas, axis, curves, "utilization [%]", trade)


def _curves_of_words(canvas: Canvas, trades: Mapping[str, Trade]) -> float:
    """The worst utilization over a number, a curve for each word."""
    (axis,) = next(iter(trades.values())).axes
    curves = [
        (word, f"row{place}", np.asarray(trade.values["utilization"], float))
        for place, (word, trade) in enumerate(trades.items())
    ]
    return _curves(canvas, axis, curves, "worst utilization [%]")


def _curves(
    canvas: Canvas,
    axis: Axis,
    curves: Sequence[tuple[str, str, NDArray[Any]]],
    title: str,
    behind: Trade | None = None,
) -> float:
    """Curves of utilization, each with its name and style, and their limit; `behind` gives the status behind them."""
    frame = Box(_LEFT, _TOP, _WIDTH - _RIGHT, _TOP + _HEIGHT)
    across = _scale_of(axis, frame.left, frame.right)
    up = _scale_of_uses(np.concatenate([[1.0], *(uses for *_, uses in curves)]), frame.bottom, frame.top)
    for run in () if behind is None else runs(axis, behind.values["status"]):
        canvas.boxes([Box(across.at(run.low), frame.top, across.at(run.high), frame.bottom)], f"is-{run.status}")
    canvas.lines([((frame.left, up.at(v)), (frame.right, up.at(v))) for v in up.ticks(26.0)], "grid")
    entries = []
    for name, style, uses in curves:
        _curve(canvas, frame, across, up, axis.values, uses, style)
        entries.append(_line(canvas, name, style))
    _limit(canvas, frame, up)
    entries.append(_line(canvas, "limit", "limit"))
    if axis.own is not None and axis.values[0] <= axis.own <= axis.values[-1]:
        x = across.at(axis.own)
        canvas.lines([((x, frame.top), (x, frame.bottom))], "at")
        entries.append(_line(canvas, "this mission", "at"))
    _frame(canvas, frame)
    _y_axis(canvas, frame, up, title)
    bottom = _x_axis(canvas, frame, axis, across)
    return _legend(canvas, bottom, [*entries, *_swatches(canvas, () if behind is None else behind.statuses)])


def _curve(
    canvas: Canvas, frame: Box, across: _Scale, up: _Scale, x: NDArray[Any], uses: NDArray[Any], style: str
) -> None:
    """One curve, broken where there is no utilization; a value alone between two of these is a short line."""
    points: list[Point] = []
    for value, use in zip(x.tolist(), (100 * uses).tolist(), strict=True):
        if math.isfinite(use) and (use > 0 or not up.is_log):
            points.append((across.at(value), up.at(use)))
            continue
        _run(canvas, frame, points, style)
        points = []
    _run(canvas, frame, points, style)


def _run(canvas: Canvas, frame: Box, points: Sequence[Point], style: str) -> None:
    if len(points) == 1:
        ((x, y),) = points
        points = [(x - 3, y), (x + 3, y)]
    if points:
        canvas.polyline(points, style, frame)


def _limit(canvas: Canvas, frame: Box, up: _Scale) -> None:
    canvas.lines([((frame.left, up.at(100.0)), (frame.right, up.at(100.0)))], "limit")


def _bars(canvas: Canvas, trade: Trade) -> float:
    """A bar of utilization for each word, in the colour of its status."""
    (axis,) = trade.axes
    count = len(axis.words)
    left = min(max(map(text_width, axis.words)) + 34, _MOST_LEFT)
    frame = Box(left, _TOP, _WIDTH - _RIGHT, _TOP + _BAR * count + 8)
    uses = np.asarray(trade.values["utilization"], float)
    along = _scale_of_uses(np.concatenate([[1.0], uses]), frame.left, frame.right - 50)  # with room for a number
    down = _Scale(-0.5, count - 0.5, frame.top + 4, frame.bottom - 4)
    canvas.lines([((along.at(v), frame.top), (along.at(v), frame.bottom)) for v in along.ticks(46.0)], "grid")
    limit = along.at(100.0)
    for place, (status, use) in enumerate(zip(trade.values["status"], uses.tolist(), strict=True)):
        y, end = down.at(place), frame.left
        if math.isfinite(use):
            end = max(along.at(max(100 * use, along.low)), frame.left + 2)
            canvas.boxes([Box(frame.left, y - 7, end, y + 7)], f"bar is-{status}")
        said = percent(use) if math.isfinite(use) else status_colours.status_words(status)
        beside = limit if end < limit < end + 60 else end
        canvas.text((beside + 6, y + 4), [said], "small")
    canvas.lines([((limit, frame.top), (limit, frame.bottom))], "limit")
    _frame(canvas, frame)
    _y_axis(canvas, frame, down, _short(axis.key, 1.3 * (frame.bottom - frame.top)), axis.words)
    bottom = _x_axis(canvas, frame, Axis("utilization", "%", np.zeros(1)), along)
    entries = [_line(canvas, "limit", "limit")]
    if axis.own is not None:
        canvas.circle((frame.left + 9, down.at(axis.own)), 5, "own")
        entries.append(_mark(canvas, "this mission"))
    return _legend(canvas, bottom, [*entries, *_swatches(canvas, trade.statuses)])


def _mark(canvas: Canvas, words: str) -> _Entry:
    return _Entry(words, lambda at: canvas.circle((at[0] + 13, at[1]), 5, "own"))


# ---------------------------------------------------------------- two keys
def _map(canvas: Canvas, trade: Trade) -> float:
    """Statuses over two keys, the line of 100 %, and what binds where."""
    x, y = trade.axes
    left = _LEFT + 10
    if y.words:
        left = min(max(map(text_width, y.words)) + 34, _MOST_LEFT)
    frame = Box(left, _TOP, _WIDTH - _RIGHT, _TOP + _HEIGHT + 60)
    across = _scale_of(x, frame.left, frame.right)
    up = _scale_of(y, frame.top, frame.bottom) if y.words else _scale_of(y, frame.bottom, frame.top)
    columns, lines = _cuts(x, across), _cuts(y, up)
    for name in trade.statuses:
        canvas.boxes(_cells(trade.values["status"] == name, columns, lines), f"is-{name}")
    rows = trade.values["worst_row"]
    entries = list(_swatches(canvas, trade.statuses))
    canvas.lines(_segments(borders(rows, np.array(columns), np.array(lines))), "between")
    if not (x.words or y.words):
        uses = np.asarray(trade.values["utilization"], float)
        unknown = [name for name in trade.statuses if not STATUS[name].is_held]
        uses = np.where(np.isin(trade.values["status"], unknown), np.nan, uses)
        with np.errstate(divide="ignore", invalid="ignore"):
            levels = np.log(uses)
        places = np.array([across.at(v) for v in x.values]), np.array([up.at(v) for v in y.values])
        if border := level_lines(levels, *places):
            canvas.lines(border, "border")
            entries.insert(0, _line(canvas, "utilization 100 %", "border"))
    if x.words and y.words and rows.size <= _CELLS:
        _in_cells(canvas, trade, columns, lines)
    else:
        entries += _names(canvas, rows, columns, lines)
    entries += _own(canvas, x, y, across, up)
    _frame(canvas, frame)
    label = _short(y.label, 1.3 * (frame.bottom - frame.top))
    _y_axis(canvas, frame, up, label, y.words)
    return _legend(canvas, _x_axis(canvas, frame, x, across), entries)


def _cuts(axis: Axis, scale: _Scale) -> list[float]:
    """Places of the edges of the cells; the first and the last end at the values themselves."""
    edges = axis.edges
    if not axis.words:
        edges[0], edges[-1] = axis.values[0], axis.values[-1]
    return [scale.at(edge) for edge in edges.tolist()]


def _cells(mask: NDArray[np.bool_], columns: Sequence[float], lines: Sequence[float]) -> Iterator[Box]:
    """Cells of a mask as rectangles, those side by side along the first axis as one."""
    for j in range(mask.shape[1]):
        padded = np.concatenate([[False], mask[:, j], [False]])
        ends = np.flatnonzero(padded[1:] != padded[:-1])
        low, high = sorted((lines[j], lines[j + 1]))
        for start, stop in zip(ends[::2].tolist(), ends[1::2].tolist(), strict=True):
            yield Box(columns[start], low, columns[stop], high)


def _segments(lines: NDArray[Any]) -> Iterator[Segment]:
    yield from (((x, y), (u, v)) for (x, y), (u, v) in lines.tolist())


def level_lines(levels: NDArray[Any], x: NDArray[Any], y: NDArray[Any]) -> list[Segment]:
    """Lines on which a grid of numbers is 0, linear between its points; none where a corner has no number.

    `levels` is (n, m) at places `x` (n,) and `y` (m,). Of a saddle the mean of its corners decides.
    """
    found: list[Segment] = []
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


def _in_cells(canvas: Canvas, trade: Trade, columns: Sequence[float], lines: Sequence[float]) -> None:
    """Write the utilization and the worst row into each cell of a map of words."""
    for (i, j), use in np.ndenumerate(trade.values["utilization"]):
        if math.isfinite(use):
            at = ((columns[i] + columns[i + 1]) / 2, (lines[j] + lines[j + 1]) / 2)
            row = _short(str(trade.values["worst_row"][i, j]), 1.1 * (columns[i + 1] - columns[i]) - 8)
            canvas.text((at[0], at[1] - 8), [percent(float(use))], "", "middle")
            canvas.text((at[0], at[1] + 24), [row], "small", "middle")


def _names(canvas: Canvas, rows: NDArray[Any], columns: Sequence[float], lines: Sequence[float]) -> list[_Entry]:
    """The name of a row in each region that has room for it, else a letter that the legend explains."""
    letters: dict[str, str] = {}
    named = set()
    for region in regions(rows):
        i, j = region.place
        cell = abs(columns[-1] - columns[0]) / rows.shape[0]
        at = ((columns[i] + columns[i + 1]) / 2, (lines[j] + lines[j + 1]) / 2 + 4)
        row = printable(region.row)
        half, low, high = 0.45 * text_width(row) + 6, columns[0], columns[-1]
        fits = region.size[0] * cell > 2 * half
        named.add(region.row)
        if not fits:
            row = letters.setdefault(region.row, _LETTERS[len(letters) % len(_LETTERS)])
            half = 8.0
        canvas.text((min(max(at[0], low + half), high - half), at[1]), [row], "", "middle")
    entries = [
        _Entry(row, lambda at, letter=letter: canvas.text((at[0] + 13, at[1] + 4), [letter], "", "middle"))  # type: ignore[misc]
        for row, letter in letters.items()
    ]
    occurring = set(rows.ravel().tolist()) - {""}
    if others := sorted(occurring - named):
        listed = f"{', '.join(others[:3])}{' …' * (len(others) > 3)}"
        entries.append(_line(canvas, f"another row binds, in small regions {listed}", "between"))
    elif len(occurring) > 1:
        entries.append(_line(canvas, "another row binds", "between"))
    return entries


def _own(canvas: Canvas, x: Axis, y: Axis, across: _Scale, up: _Scale) -> list[_Entry]:
    """Mark where the mission itself stands, if that is on the map."""
    for axis in (x, y):
        if axis.own is None or not axis.values[0] <= axis.own <= axis.values[-1]:
            return []

    assert x.own is not None
    assert y.own is not None
    canvas.circle((across.at(x.own), up.at(y.own)), 5, "own")
    return [_mark(canvas, "this mission")]
