"""Draw a sweep over one key as curves, or a sweep over two keys as a map.

Curves show the utilizations of rows and their limit, or the values of a column in the table of the sweep. A map shows
the statuses of the cases, or the values of a column.

In a report, the drawing is inlined and has the colours of the page. `sweep --plot` writes it to a file with light and
dark colours. A polar map is a view from above: its angle is the azimuth, counter-clockwise from east, and its radius
is the other key.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from operator import itemgetter
from textwrap import wrap
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.arrays import NumbersOrWords
from bisar_budget.faults import changes_words, printable
from bisar_budget.findings.status import STATUS
from bisar_budget.findings.trade import Axis, Trade
from bisar_budget.geometry import BistaticGeometry
from bisar_budget.mission.model import Mission
from bisar_budget.report.drawing import svg
from bisar_budget.report.drawing.trades import borders, cell_edges, level_lines, per_word, regions, runs, thinned
from bisar_budget.report.words.key_names import in_words, key_beside
from bisar_budget.report.words.sentences import percent

_TRADE_WIDTH_PX, _TRADE_HEIGHT_PX = 560.0, 270.0  # width of a drawing, height of its frame
_TRADE_LEFT_PX, _TRADE_RIGHT_PX = 58.0, 12.0  # margins beside the frame
_MAX_NAMES_PX = 190.0  # width of names at an axis
_WORD_PX = 24.0  # height of the bar of a word
_POLAR_RIM_PX = 165.0  # radius of a polar map
_HEAT_BAR_PX = 80.0  # width of the colour scale beside a map
_SHOWN_USE_PERCENT, _MIN_USE_PERCENT = 10.0, 0.1  # largest and smallest lower end of an axis of utilizations
_STATUS_OPACITIES = (0.24, 0.13, 0.36)  # of the first, second and third status of one colour
_CURVE_COLOURS = ("transmitter", "receiver", "clock", "pass", "mission", "doubt", "reserve")
_CURVE_DASHES = ("", "7 3", "2 3", "9 3 2 3", "5 5", "1 4", "12 4")
_MAX_WORD_CELLS = 60  # of a map with words in each cell
_MAX_DOTTED_SAMPLES = 40  # of a curve with a dot for each sample
_REGION_LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
_HEAD_LINES = ((60, 2), (88, 3))  # characters and lines of the name above a drawing, and of its subtitle
_CURVE_STEP_RAD = math.radians(3)  # angle of a segment of a curved line
_VIRIDIS = ("440154", "482878", "3e4989", "31688e", "26828e", "1f9e89", "35b779", "6ece58", "b5de2b", "fde725")
_HEAT_COLOUR_COUNT = 48

Floats = NDArray[np.float64]


def trade_drawing(
    trade: Trade,
    rows: Mapping[str, Floats],
    key: str,
    title: str,
    description: str,
    *,
    above: Sequence[str] = (),
    seen_from_above: BistaticGeometry | None = None,
) -> str:
    """Draw a sweep over one or two keys as SVG.

    Parameters
    ----------
    trade : Trade
        Sweep over one or two keys. The first axis of a polar map is the azimuth.
    rows : Mapping[str, ndarray]
        For a sweep over one key: the rows that are the worst row in at least one case, with their utilizations
        (cases,). [-]
    key : str
        String that makes the ids in the SVG unique.
    title, description : str
        Title of the drawing, and a description for readers who cannot see it.
    above : Sequence[str]
        Lines of text to print above the drawing if it is stored in a file of its own. The first line is the name of
        the mission.
    seen_from_above : BistaticGeometry, optional
        Collection geometry for a polar map, in which the direction of the fixed platform is marked.
    """
    canvas = svg.Canvas()
    top = svg.head(canvas, above)
    by_word = per_word(trade)
    if by_word is not None or (len(trade.axes) == 1 and not trade.axes[0].words):
        bottom = _curves(canvas, top, trade, rows, *(by_word or (None, {})))
    elif len(trade.axes) == 1:
        bottom = _bars(canvas, top, trade, rows)
    else:
        bottom = _map(canvas, top, trade, seen_from_above)
    return canvas.document((_TRADE_WIDTH_PX, bottom + 4), f"{key} study", title, description, _style(trade))


def head_of(trade: Trade, mission: Mission, *, is_polar: bool) -> list[str]:
    """Lines of text to print above a drawing that is stored in a file of its own.

    They state the name of the mission, the values that do not vary, the changes made by options, and the model that
    decides the verdicts. For a polar map, the last two lines describe the angle and the radius, with their keys.
    """
    is_gating = any(axis.key == "allocation.model" for axis in trade.axes)
    model = "" if is_gating else f"{mission.gating_model} model"
    subtitle = ", ".join(filter(None, (*trade.fixed, changes_words(mission.changes), model)))
    lines = []
    for text, (width, count) in zip((printable(mission.name), subtitle), _HEAD_LINES, strict=True):
        lines += wrap(text, width, max_lines=count, placeholder=" ...")
    if is_polar:
        around, radius = trade.axes
        lines.append(f"angle: {_label(around)}, radius: {_label(radius)}")
        lines.append(f"({around.key}, {radius.key})")
    return lines


def _label(axis: Axis) -> str:
    """The key of an axis in words, and its unit."""
    return f"{in_words(axis.key)} [{axis.unit}]" if axis.unit else in_words(axis.key)


def _style(trade: Trade) -> str:
    """CSS rules for a drawing of a sweep."""
    light, _ = svg.colours()
    rules = []
    for index, (name, dashes) in enumerate(zip(_CURVE_COLOURS, _CURVE_DASHES, strict=True)):
        rules.append(f".row{index}{{fill:none;stroke:var(--{name},{light[name]});stroke-width:1.8")
        rules[-1] += f";stroke-dasharray:{dashes}}}" if dashes else "}"
        rules.append(f".dot{index}{{fill:var(--{name},{light[name]});stroke:var(--paper,#fff);stroke-width:.8}}")
    for name, strength in svg.marks_within_colours(trade.statuses, _STATUS_OPACITIES).items():
        tone = svg.tone_of(name)
        rules.append(
            f".is-{name}{{fill:var(--{tone},{light[tone]});fill-opacity:{strength};shape-rendering:crispEdges}}"
        )
        rules.append(f".bar.is-{name}{{fill-opacity:.75}}")
    if trade.column and len(trade.axes) == 2:
        for index in range(_HEAT_COLOUR_COUNT):
            colour = _heat_colour(index / (_HEAT_COLOUR_COUNT - 1))
            rules.append(f".heat{index}{{fill:{colour};stroke:{colour};stroke-width:.6;shape-rendering:crispEdges}}")
    rules.append(".curved{shape-rendering:auto}")
    rules.append(f".limit{{fill:none;stroke:var(--fail,{light['fail']});stroke-width:1.6;stroke-dasharray:7 4}}")
    rules.append(".border{fill:none;stroke:var(--ink,#222);stroke-width:1.7}")
    rules.append(".halo{fill:none;stroke:var(--paper,#fff);stroke-width:3.7;stroke-opacity:.7}")
    rules.append(".between{fill:none;stroke:var(--muted,#595f66);stroke-width:.8;stroke-dasharray:2 2}")
    rules.append(".worst{fill:none;stroke:var(--muted,#595f66);stroke-opacity:.35;stroke-width:6}")
    rules.append(".own{fill:var(--paper,#fff);stroke:var(--ink,#222);stroke-width:1.6}")
    rules.append(".frame{fill:none;stroke:var(--muted,#595f66);stroke-width:1}")
    rules.append(".at{fill:none;stroke:var(--ink,#222);stroke-width:1.1;stroke-dasharray:1.5 3}")
    return svg.style_sheet(
        rules, [name for name in (*_CURVE_COLOURS, "fail") if name not in ("transmitter", "receiver")]
    )


def _heat_colour(fraction: float) -> str:
    """Colour of Matplotlib's viridis map at a fraction from 0 to 1."""
    index = min(int(fraction * (len(_VIRIDIS) - 1)), len(_VIRIDIS) - 2)
    remainder = fraction * (len(_VIRIDIS) - 1) - index
    ends = [[int(colour[start : start + 2], 16) for start in (0, 2, 4)] for colour in _VIRIDIS[index : index + 2]]
    return "#" + "".join(f"{round(a + remainder * (b - a)):02x}" for a, b in zip(*ends, strict=True))


def _value_scale(values: Floats, start: float, end: float, *, is_use: bool) -> svg.Scale:
    """Make the axis scale for the values of a column of the sweep's table.

    The scale for utilizations [%] is logarithmic and includes 10 % and 100 %.
    """
    finite = values[np.isfinite(values)]
    if is_use:
        finite = np.append(finite[finite > 0], 100.0)
        low = min(max(_MIN_USE_PERCENT, float(finite.min())), _SHOWN_USE_PERCENT)
        return svg.Scale(low / 1.3, 1.3 * float(finite.max()), start, end, is_log=True)
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    margin = (high - low) / 20 or abs(high) / 20 or 1.0
    return svg.Scale(low - margin, high + margin, start, end)


def _swatches(canvas: svg.Canvas, statuses: Sequence[str]) -> list[svg.LegendLine]:
    return [svg.box_entry(canvas, svg.status_words(name), f"is-{name}", "frame") for name in statuses]


# ---------------------------------------------------------------- one key
def _curves(
    canvas: svg.Canvas,
    top: float,
    trade: Trade,
    rows: Mapping[str, Floats],
    word_axis: Axis | None,
    by_word: Mapping[str, Trade],
) -> float:
    """Draw curves over a key with numerical values; return the y coordinate of the bottom of the drawing. [px]

    The curves show utilizations with their limit, or the values of a column in the table of the sweep. There is one
    curve for each row. If a second key has words as its values, there is one curve for each word instead: `word_axis`
    is the axis of this key, and `by_word` has the sweep for each word. Without a second key, the colour of the
    background shows the status.
    """
    first = next(iter(by_word.values())) if by_word else trade
    (axis,) = first.axes
    name = trade.column or "utilization"
    named_values = {word: word_trade.values[name] for word, word_trade in by_word.items()} or (
        {name: trade.values[name]} if trade.column else rows
    )
    curves = [(word, f"row{index}", values) for index, (word, values) in enumerate(named_values.items())]
    if not by_word and not trade.column:
        curves.insert(0, ("worst row", "worst", trade.values[name]))
    factor = 1 if trade.column else 100
    curves = [(word, style, factor * np.asarray(values, float)) for word, style, values in curves]
    frame = svg.Box(_TRADE_LEFT_PX, top, _TRADE_WIDTH_PX - _TRADE_RIGHT_PX, top + _TRADE_HEIGHT_PX)
    across = _axis_scale(axis, frame.left, frame.right)
    all_values = np.concatenate([values for *_, values in curves])
    up = _value_scale(all_values, frame.bottom, frame.top, is_use=not trade.column)
    statuses = [] if by_word else trade.statuses
    for status, low, high in () if by_word else runs(axis, trade.values["status"]):
        canvas.boxes([svg.Box(across.at(low), frame.top, across.at(high), frame.bottom)], f"is-{status}")
    svg.grid(canvas, frame, None, up)
    entries = []
    if word_axis is not None:
        entries.append(svg.LegendLine(f"{_label(word_axis)}:", lambda at: None, word_axis.key))
    for word, style, values in curves:
        _curve(canvas, frame, across, up, axis.values, values, style)
        entry = svg.line_entry(canvas, word if by_word else in_words(word), style)
        entries.append(entry if by_word else entry._replace(key=key_beside(word)))
    if not trade.column:
        canvas.lines([frame.level(up.at(100.0))], "limit")
        entries.append(svg.line_entry(canvas, "limit", "limit"))
    if axis.own is not None and axis.values[0] <= axis.own <= axis.values[-1]:
        canvas.lines([frame.upright(across.at(axis.own))], "at")
        entries.append(svg.line_entry(canvas, "this mission", "at"))
    svg.outline(canvas, frame, "frame")
    use = "worst utilization [%]" if by_word else "utilization [%]"
    svg.y_axis(canvas, frame, up, trade.heading or use, key=key_beside(trade.column))
    bottom = svg.x_axis(canvas, frame, across, _label(axis), key=key_beside(axis.key))
    return svg.legend(canvas, bottom, _TRADE_WIDTH_PX, [*entries, *_swatches(canvas, statuses)])


def _curve(
    canvas: svg.Canvas, frame: svg.Box, across: svg.Scale, up: svg.Scale, x: Floats, values: Floats, style: str
) -> None:
    """Draw a curve with gaps at missing values. A single value between gaps is drawn as a short line."""
    points = [
        (across.at(position), up.at(value)) if math.isfinite(value) and (value > 0 or not up.is_log) else None
        for position, value in zip(x.tolist(), values.tolist(), strict=True)
    ]
    run: list[svg.Point] = []
    for point in (*points, None):
        if point is not None:
            run.append(point)
            continue
        if len(run) == 1:
            run = [(run[0][0] - 3, run[0][1]), (run[0][0] + 3, run[0][1])]
        if run:
            canvas.polyline(_seen(run), style, frame)
        run = []
    if x.size <= _MAX_DOTTED_SAMPLES and style != "worst":
        for point in filter(None, points):
            if frame.holds(point):
                canvas.circle(point, 2.4, style.replace("row", "dot"))


def _seen(points: Sequence[svg.Point]) -> list[svg.Point]:
    """Reduce a dense curve to the points that can be distinguished in the drawing.

    These are the first, lowest, highest and last point within each half pixel of width.
    """
    height = itemgetter(1)
    visible: list[svg.Point] = []
    column: list[svg.Point] = []
    for point in (*points, (math.inf, 0.0)):
        if column and point[0] - column[0][0] > 0.5:
            ends = (column[0], *sorted((min(column, key=height), max(column, key=height))), column[-1])
            visible += dict.fromkeys(ends)
            column = []
        column.append(point)
    return visible


def _bars(canvas: svg.Canvas, top: float, trade: Trade, rows: Mapping[str, Floats]) -> float:
    """Draw a sweep over a key whose values are words: one bar for each word, in the colour of its status.

    A bar shows the worst utilization, with a dot for each row, or the value of a column of the sweep's table. Returns
    the y coordinate of the bottom of the drawing. [px]
    """
    (axis,) = trade.axes
    left = min(max(map(svg.text_width, axis.words)) + 44, _MAX_NAMES_PX)
    label = in_words(axis.key)
    canvas.text((8, top + 8), [svg.short(label, _TRADE_WIDTH_PX)], "small")
    canvas.text((18 + 0.9 * svg.text_width(label), top + 8), [key_beside(axis.key)], "key")
    frame = svg.Box(left, top + 16, _TRADE_WIDTH_PX - _TRADE_RIGHT_PX, top + 24 + _WORD_PX * len(axis.words))
    values = np.asarray(trade.values[trade.column] if trade.column else 100 * trade.values["utilization"], float)
    is_use = not trade.column
    scaled_values = values if is_use else np.append(values, 0.0)
    along = _value_scale(scaled_values, frame.left, frame.right - 50, is_use=is_use)  # with room for a number
    down = svg.Scale(-0.5, len(axis.words) - 0.5, frame.top + 4, frame.bottom - 4)
    svg.grid(canvas, frame, along, None)
    base = frame.left if is_use else along.at(0.0)
    limit = along.at(100.0) if is_use else math.inf
    for index, (status, value) in enumerate(zip(trade.values["status"], values.tolist(), strict=True)):
        y, end = down.at(index), base
        label = svg.status_words(status)
        if math.isfinite(value):
            end = max(along.at(max(value, along.low)), frame.left + 2)
            canvas.boxes([svg.Box(min(base, end), y - 7, max(base, end), y + 7)], f"bar is-{status}")
            label = percent(value / 100) if is_use else svg.axis_number(value)
        label_start = max(base, limit if end < limit < end + 60 else end)
        canvas.text((label_start + 6, y + 4), [label], "small")
    entries = []
    if is_use:
        canvas.lines([frame.upright(limit)], "limit")
        entries.append(svg.line_entry(canvas, "limit", "limit"))
    for number, (row, uses) in enumerate(rows.items() if is_use else ()):
        shown = [(along.at(100 * use), down.at(index)) for index, use in enumerate(uses.tolist()) if use > 0]
        for point in filter(frame.holds, shown):
            canvas.circle(point, 3, f"dot{number}")
        entry = svg.circle_entry(canvas, in_words(row), 3, f"dot{number}")
        entries.append(entry._replace(key=key_beside(row)))
    if axis.own is not None:
        canvas.circle((frame.left + 9, down.at(axis.own)), 5, "own")
        entries.append(svg.circle_entry(canvas, "this mission", 5, "own"))
    svg.outline(canvas, frame, "frame")
    svg.y_axis(canvas, frame, down, "", axis.words)
    bottom = svg.x_axis(canvas, frame, along, trade.heading or "utilization [%]", key=key_beside(trade.column))
    return svg.legend(canvas, bottom, _TRADE_WIDTH_PX, [*entries, *_swatches(canvas, trade.statuses)])


# ---------------------------------------------------------------- two keys
class _Plane(NamedTuple):
    """Conversion from the two varied keys of a map to coordinates on the page.

    The two scales convert values of the keys to horizontal and vertical coordinates [px]. For a polar map, they
    convert to azimuth [rad] and radius [px] around `middle`.
    """

    across: svg.Scale
    up: svg.Scale
    middle: svg.Point | None = None

    def at(self, p: float, q: float) -> svg.Point:
        """Point on the page [px] for coordinates `p`, `q` as given by the two scales."""
        if self.middle is None:
            return p, q
        return self.middle[0] + q * math.cos(p), self.middle[1] - q * math.sin(p)

    def line(self, points: Sequence[svg.Point]) -> list[svg.Point]:
        """Convert a line in the coordinates of the two scales to points on the page.

        On a polar map, points are added along each segment so that it appears curved.
        """
        line = [self.at(*points[0])]
        for (p, q), (u, v) in pairwise(points):
            step_count = 1 if self.middle is None else max(1, math.ceil(abs(u - p) / _CURVE_STEP_RAD - 1e-9))
            fractions = (step / step_count for step in range(1, step_count + 1))
            line += [self.at(p + (u - p) * fraction, q + (v - q) * fraction) for fraction in fractions]
        return line

    def fill(self, canvas: svg.Canvas, boxes: Iterator[svg.Box], style: str) -> None:
        """Fill map cells, which are rectangles in the coordinates of the two scales."""
        if self.middle is None:
            canvas.boxes(boxes, style)
            return
        corners = ([(a, b), (c, b), (c, d), (a, d)] for a, b, c, d in boxes)
        canvas.polygons([self.line(cell) for cell in corners], f"{style} curved")


def _axis_scale(axis: Axis, start: float, end: float) -> svg.Scale:
    """Make the scale of a map axis from `start` to `end` on the page.

    If the values are words, each word occupies a cell of width 1. If they are numbers, the scale extends from the
    first value to the last.
    """
    if axis.words:
        return svg.Scale(-0.5, axis.values[-1] + 0.5, start, end)
    return svg.Scale(float(axis.values[0]), float(axis.values[-1]), start, end, axis.is_log)


def _map(canvas: svg.Canvas, top: float, trade: Trade, geometry: BistaticGeometry | None) -> float:
    """Draw a map over two keys: the statuses, with the 100 % contour and the binding rows, or the values of a column.

    Returns the y coordinate of the bottom of the drawing. [px]
    """
    trade = thinned(trade)
    x, y = trade.axes
    left = min(max(map(svg.text_width, y.words)) + 44, _MAX_NAMES_PX) if y.words else _TRADE_LEFT_PX + 16
    right = _TRADE_WIDTH_PX - _TRADE_RIGHT_PX - (_HEAT_BAR_PX if trade.column else 0.0)
    frame = svg.Box(left, top, right, top + _TRADE_HEIGHT_PX + 60)
    if geometry is None:
        ends = (frame.top, frame.bottom) if y.words else (frame.bottom, frame.top)
        plane = _Plane(_axis_scale(x, frame.left, frame.right), _axis_scale(y, *ends))
    else:
        plane = _from_above(x, y, frame)
        frame = frame._replace(top=frame.top + 24, bottom=frame.top + 24 + 2 * _POLAR_RIM_PX)
    columns = [plane.across.at(edge) for edge in cell_edges(x)]
    lines = [plane.up.at(edge) for edge in cell_edges(y)]
    statuses = [name for name in trade.statuses if not trade.column or svg.has_no_mission(name)]
    entries = _swatches(canvas, statuses)
    for name in statuses:
        plane.fill(canvas, _cells(trade.values["status"] == name, columns, lines), f"is-{name}")
    if trade.column:
        _heat(canvas, frame, trade, plane, columns, lines)
    if geometry is not None:
        entries += _around(canvas, plane, x, geometry)
    has_words = bool(x.words or y.words)
    rows = trade.values["worst_row"]
    if x.words and y.words and rows.size <= _MAX_WORD_CELLS:
        _in_cells(canvas, trade, columns, lines)
    elif not trade.column:
        between = borders(rows, np.array(columns), np.array(lines)).tolist()
        canvas.lines([piece for line in between for piece in pairwise(plane.line(line))], "between")
        entries += _names(canvas, rows, plane, columns, lines)
    if not has_words and (border := _limit(trade, plane)):
        canvas.lines(border, "halo")
        canvas.lines(border, "border")
        entries.insert(0, svg.line_entry(canvas, "utilization 100 %", "border"))
    if all(axis.own is not None and axis.values[0] <= axis.own <= axis.values[-1] for axis in (x, y)):
        canvas.circle(plane.at(plane.across.at(x.own or 0.0), plane.up.at(y.own or 0.0)), 5, "own")
        entries.append(svg.circle_entry(canvas, "this mission", 5, "own"))
    if geometry is not None:
        return svg.legend(canvas, frame.bottom + 24, _TRADE_WIDTH_PX, entries)
    svg.outline(canvas, frame, "frame")
    svg.y_axis(canvas, frame, plane.up, _label(y), y.words, key=key_beside(y.key))
    bottom = svg.x_axis(canvas, frame, plane.across, _label(x), x.words, key=key_beside(x.key))
    return svg.legend(canvas, bottom, _TRADE_WIDTH_PX, entries)


def _cells(mask: NDArray[np.bool_], columns: Sequence[float], lines: Sequence[float]) -> Iterator[svg.Box]:
    """Yield the True cells of a mask as rectangles. Neighbours along the first axis are merged into one rectangle."""
    for j in range(mask.shape[1]):
        padded = np.concatenate([[False], mask[:, j], [False]])
        ends = np.flatnonzero(padded[1:] != padded[:-1])
        low, high = sorted((lines[j], lines[j + 1]))
        for start, stop in zip(ends[::2].tolist(), ends[1::2].tolist(), strict=True):
            yield svg.Box(columns[start], low, columns[stop], high)


def _limit(trade: Trade, plane: _Plane) -> list[tuple[svg.Point, svg.Point]]:
    """Contour line where the utilization is 100 %.

    The logarithm of the utilization is interpolated, because it is less curved than the utilization itself.
    """
    uses = np.asarray(trade.values["utilization"], float)
    # With a row that is not evaluated, the other rows do not determine the distance to the limit.
    unknown = [name for name in trade.statuses if not STATUS[name].is_held]
    uses = np.where(np.isin(trade.values["status"], unknown), np.nan, uses)
    with np.errstate(divide="ignore", invalid="ignore"):
        levels = np.log(uses)
    x, y = trade.axes
    coordinates = np.array([plane.across.at(v) for v in x.values]), np.array([plane.up.at(v) for v in y.values])
    return [(plane.at(*start), plane.at(*end)) for start, end in level_lines(levels, *coordinates)]


def _heat(
    canvas: svg.Canvas, frame: svg.Box, trade: Trade, plane: _Plane, columns: Sequence[float], lines: Sequence[float]
) -> None:
    """Draw the values of `trade.column`, a column of the sweep's table, as a heat map with a colour bar.

    The colour scale is logarithmic if the values span more than two decades.
    """
    column_values = np.asarray(trade.values[trade.column], float)
    column_values = np.where(np.isfinite(column_values), column_values, np.nan)
    finite = column_values[np.isfinite(column_values)]
    if not finite.size:
        return
    low, high = float(finite.min()), float(finite.max())
    scale = svg.Scale(low, high if high > low else low + (abs(low) or 1.0), frame.bottom, frame.top)
    scale = scale._replace(is_log=low > 0 and high / low > 100)
    scaled_values, ends = (
        np.log(numbers) if scale.is_log else np.asarray(numbers) for numbers in (column_values, scale[:2])
    )
    with np.errstate(invalid="ignore"):
        heats = np.floor((scaled_values - ends[0]) / (ends[1] - ends[0]) * _HEAT_COLOUR_COUNT)
        heats = heats.clip(0, _HEAT_COLOUR_COUNT - 1)
    left = _TRADE_WIDTH_PX - _TRADE_RIGHT_PX - _HEAT_BAR_PX + 14
    step = (frame.bottom - frame.top) / _HEAT_COLOUR_COUNT
    for index in range(_HEAT_COLOUR_COUNT):
        plane.fill(canvas, _cells(heats == index, columns, lines), f"heat{index}")
        bottom = frame.bottom - index * step
        canvas.boxes([svg.Box(left, bottom - step, left + 12, bottom)], f"heat{index}")
    for value in scale.ticks(26.0):
        canvas.text((left + 16, scale.at(value) + 3.5), [svg.axis_number(value)], "axis")
    canvas.upright_text((_TRADE_WIDTH_PX - 15, frame.middle[1]), svg.short(trade.heading, 420.0), "small")
    canvas.upright_text((_TRADE_WIDTH_PX - 4, frame.middle[1]), key_beside(trade.column), "key")


def _in_cells(canvas: svg.Canvas, trade: Trade, columns: Sequence[float], lines: Sequence[float]) -> None:
    """Write the utilization and the worst row into each cell of a map with words on both axes."""
    max_characters = int((columns[1] - columns[0]) / 6.5)  # characters of a cell
    for (i, j), use in np.ndenumerate(trade.values["utilization"]):
        if math.isfinite(use):
            x, y = (columns[i] + columns[i + 1]) / 2, (lines[j] + lines[j + 1]) / 2
            row = printable(in_words(str(trade.values["worst_row"][i, j])))
            canvas.text((x, y - 10), [percent(float(use))], "", "middle")
            for index, line in enumerate(wrap(row, max(max_characters, 5), max_lines=2, placeholder="…")):
                canvas.text((x, y + 22 + 13 * index), [line], "small", "middle")


def _names(
    canvas: svg.Canvas, rows: NumbersOrWords, plane: _Plane, columns: Sequence[float], lines: Sequence[float]
) -> list[svg.LegendLine]:
    """Write the name of the binding row into each region of a map.

    The name is horizontal, or vertical in a tall region, with the id of the row in small type below it. A letter is
    written instead in polar maps, and in regions too small for the name. Returns legend entries for the letters and
    for regions without a name.
    """
    letters: dict[str, str] = {}
    named = set()
    cell = [abs(cuts[-1] - cuts[0]) / size for cuts, size in zip((columns, lines), rows.shape, strict=True)]
    for region in regions(rows):
        i, j = region.cell
        p, q = (columns[i] + columns[i + 1]) / 2, (lines[j] + lines[j + 1]) / 2
        x, y = plane.at(p, q)
        name, row_id = printable(in_words(region.row)), printable(key_beside(region.row))
        named.add(region.row)
        half = 0.45 * svg.text_width(name) + 6
        is_wide = plane.middle is None and region.size[0] * cell[0] >= 2 * half
        if plane.middle is None and not is_wide and region.size[1] * cell[1] > 2 * half:
            centre = min(max(y, min(lines) + half), max(lines) - half)
            canvas.upright_text((x + 4, centre), name, "")
            canvas.upright_text((x + 15, centre), row_id, "key")
            continue
        if not is_wide:
            name = letters.setdefault(region.row, _REGION_LETTERS[len(letters) % len(_REGION_LETTERS)])
            canvas.text((x, y + 4), [name], "", "middle")
            continue
        centre = min(max(x, columns[0] + half), columns[-1] - half)
        canvas.text((centre, y + 4), [name], "", "middle")
        canvas.text((centre, y + 15), [row_id], "key", "middle")
    entries = [
        svg.LegendLine(
            in_words(row),
            lambda at, letter=letter: canvas.text((at[0] + 13, at[1] + 4), [letter], "", "middle"),  # type: ignore[misc]
            key_beside(row),
        )
        for row, letter in letters.items()
    ]
    occurring = set(rows.ravel().tolist()) - {""}
    if unnamed := sorted(occurring - named):
        unnamed_words = f"{', '.join(map(in_words, unnamed[:3]))}{' …' * (len(unnamed) > 3)}"
        entries.append(svg.line_entry(canvas, f"another row decides, in small regions {unnamed_words}", "between"))
    elif len(occurring) > 1:
        entries.append(svg.line_entry(canvas, "another row decides", "between"))
    return entries


# ---------------------------------------------------------------- from above
def _from_above(around: Axis, radius: Axis, frame: svg.Box) -> _Plane:
    """Make the scales of a polar map, for the azimuth (counter-clockwise from east) and for the radius.

    The radius shows the other key, and is 0 where the value of this key is 0. If this key is an elevation, the radius
    is 0 at 90 deg, because a platform at this elevation is above the scene.
    """
    first, last = float(around.values[0]), float(around.values[-1])
    is_elevation = radius.key.endswith(".elevation")
    inner, rim = (math.pi / 2 / radius.scale, radius.values[0]) if is_elevation else (0.0, radius.values[-1])
    return _Plane(
        svg.Scale(first, last, first * around.scale, last * around.scale),
        svg.Scale(inner, float(rim), 0.0, _POLAR_RIM_PX),
        (frame.middle[0], frame.top + 24 + _POLAR_RIM_PX),
    )


def _around(canvas: svg.Canvas, plane: _Plane, around: Axis, geometry: BistaticGeometry) -> list[svg.LegendLine]:
    """Draw the grid of a polar map: directions, and circles labelled with the values of the radius.

    If the azimuth belongs to only one platform, a mark at the rim shows the direction to the other platform. Returns
    the legend entry for this mark in a list, which is empty if there is no mark.
    """
    turn = (0.0, 2 * math.pi)
    names = {0: "east", 90: "north", 180: "west", 270: "south"}
    for degrees in range(0, 360, 45):
        angle = math.radians(degrees)
        canvas.lines([(plane.at(angle, 0.0), plane.at(angle, _POLAR_RIM_PX))], "grid")
        x, y = plane.at(angle, _POLAR_RIM_PX + 14)
        side = round(math.cos(angle), 3)
        anchor = "start" if side > 0 else "end" if side < 0 else "middle"
        canvas.text((x, y + 4), [names.get(degrees, f"{degrees}°")], "axis", anchor)
    # If the map is not a full circle, numbers are beside it.
    is_open = plane.across.end - plane.across.start < 1.9 * math.pi
    free = plane.across.start - math.radians(6) if is_open else math.pi / 8
    for value in plane.up.ticks(26.0):
        radius = plane.up.at(value)
        canvas.polyline(plane.line([(angle, radius) for angle in turn]), "grid", is_obstacle=False)
        canvas.text(plane.at(free, radius), [svg.axis_number(value)], "axis", "middle")
    canvas.polyline(plane.line([(angle, _POLAR_RIM_PX) for angle in turn]), "frame", is_obstacle=False)
    moved_platforms = [name for name in ("transmitter", "receiver") if f".{name}." in f".{around.key}"]
    if len(moved_platforms) != 1:
        return []
    still_platform = "receiver" if moved_platforms == ["transmitter"] else "transmitter"
    east, north, _ = getattr(geometry, still_platform).position
    angle = math.atan2(north, east)
    points = [
        plane.at(angle, _POLAR_RIM_PX - 7),
        *(plane.at(angle + side, _POLAR_RIM_PX + 6) for side in (0.045, -0.045)),
    ]
    canvas.polygon(points, f"solid {still_platform}")
    return [
        svg.LegendLine(
            f"direction of the {still_platform}",
            lambda at: canvas.polygon(
                [(at[0] + 6, at[1]), *((at[0] + 19, at[1] + side) for side in (7, -7))], f"solid {still_platform}"
            ),
        )
    ]
