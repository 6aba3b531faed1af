"""The drawing of a sweep: utilizations over one key with the limit, a map of statuses or of a column over two.

A report has it inline, with the text and colours of the page; `sweep --plot` as a file of its own, with its own light
and dark. A polar map is one seen from above: azimuth from east, counter-clockwise, the other key as a radius.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from operator import itemgetter
from textwrap import wrap
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.faults import changes_words, printable
from bisar_budget.findings.status import STATUS
from bisar_budget.findings.trade import Axis, Trade
from bisar_budget.geometry import BistaticGeometry
from bisar_budget.mission.model import Mission
from bisar_budget.report.drawing import svg
from bisar_budget.report.drawing.trades import borders, cell_edges, level_lines, per_word, regions, runs, thinned
from bisar_budget.report.words.sentences import percent

_WIDTH, _HEIGHT = 560.0, 270.0  # of a drawing, of its frame [px]
_LEFT, _RIGHT = 58.0, 12.0  # px beside the frame
_MOST_LEFT = 190.0  # px that names at an axis may take
_BAR = 24.0  # px for a word
_RIM = 165.0  # px, of a polar map
_HEAT_BAR = 70.0  # px beside a map
_DECADE, _LEAST = 10.0, 0.1  # % of the limit: an axis shows the one; what is smaller than the other is of no interest
_STRENGTHS = (0.24, 0.13, 0.36)  # opacity of the first, second and third status of one colour
_ROWS = ("transmitter", "receiver", "clock", "pass", "mission", "doubt", "reserve")  # colours of curves
_DASHES = ("", "7 3", "2 3", "9 3 2 3", "5 5", "1 4", "12 4")
_CELLS = 60  # of a map that have room for words of their own
_DOTS = 40  # values of a curve that are seen one by one
_LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
_LINES = ((60, 2), (88, 3))  # characters and lines of the name above a drawing, and of what is said below it
_STEP = math.radians(3)  # of a curved line
_VIRIDIS = ("440154", "482878", "3e4989", "31688e", "26828e", "1f9e89", "35b779", "6ece58", "b5de2b", "fde725")
_HEATS = 48  # colours of a heat map

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
    """Draw a sweep over one key or two as SVG.

    Parameters
    ----------
    trade : Trade
        Over one key or two, the azimuth first where it is `seen_from_above`.
    rows : Mapping[str, ndarray]
        Utilizations of the rows that matter, over the one key that varies. [-]
    key : str
        What makes the ids of the drawing its own.
    title, description : str
        What it shows, and what it says to who cannot see it.
    above : Sequence[str]
        Lines above it, the name first: for a drawing that stands alone.
    seen_from_above : BistaticGeometry, optional
        Draws a polar map, with the place of the platform that does not move around.
    """
    canvas = svg.Canvas()
    top = svg.head(canvas, above)
    by_word = per_word(trade)
    if by_word is not None or (len(trade.axes) == 1 and not trade.axes[0].words):
        bottom = _curves(canvas, top, trade, rows, by_word[1] if by_word else {})
    elif len(trade.axes) == 1:
        bottom = _bars(canvas, top, trade, rows)
    else:
        bottom = _map(canvas, top, trade, seen_from_above)
    return canvas.document((_WIDTH, bottom + 4), f"{key} study", title, description, _style(trade))


def head_of(trade: Trade, mission: Mission, *, is_polar: bool) -> list[str]:
    """Lines above a drawing that stands alone: the mission, what holds for all cases, and what a polar map shows."""
    is_gating = any(axis.key == "allocation.model" for axis in trade.axes)
    model = "" if is_gating else f"{mission.gating_model} model"
    about = ", ".join(filter(None, (*trade.fixed, changes_words(mission.changes), model)))
    lines = []
    for text, (width, count) in zip((printable(mission.name), about), _LINES, strict=True):
        lines += wrap(text, width, max_lines=count, placeholder=" ...")
    if is_polar:
        lines.append(f"angle: {trade.axes[0].label}, radius: {trade.axes[1].label}")
    return lines


def _style(trade: Trade) -> str:
    """Rules for what only these drawings have."""
    light, _ = svg.colours()
    rules = []
    for place, (name, dashes) in enumerate(zip(_ROWS, _DASHES, strict=True)):
        rules.append(f".row{place}{{fill:none;stroke:var(--{name},{light[name]});stroke-width:1.8")
        rules[-1] += f";stroke-dasharray:{dashes}}}" if dashes else "}"
        rules.append(f".dot{place}{{fill:var(--{name},{light[name]});stroke:var(--paper,#fff);stroke-width:.8}}")
    for name, strength in svg.marks_within_colours(trade.statuses, _STRENGTHS).items():
        tone = svg.tone_of(name)
        rules.append(
            f".is-{name}{{fill:var(--{tone},{light[tone]});fill-opacity:{strength};shape-rendering:crispEdges}}"
        )
        rules.append(f".bar.is-{name}{{fill-opacity:.75}}")
    if trade.column and len(trade.axes) == 2:
        for place in range(_HEATS):
            colour = _heat_colour(place / (_HEATS - 1))
            rules.append(f".heat{place}{{fill:{colour};stroke:{colour};stroke-width:.6;shape-rendering:crispEdges}}")
    rules.append(".curved{shape-rendering:auto}")
    rules.append(f".limit{{fill:none;stroke:var(--fail,{light['fail']});stroke-width:1.6;stroke-dasharray:7 4}}")
    rules.append(".border{fill:none;stroke:var(--ink,#222);stroke-width:1.7}")
    rules.append(".halo{fill:none;stroke:var(--paper,#fff);stroke-width:3.7;stroke-opacity:.7}")
    rules.append(".between{fill:none;stroke:var(--muted,#595f66);stroke-width:.8;stroke-dasharray:2 2}")
    rules.append(".worst{fill:none;stroke:var(--muted,#595f66);stroke-opacity:.35;stroke-width:6}")
    rules.append(".own{fill:var(--paper,#fff);stroke:var(--ink,#222);stroke-width:1.6}")
    rules.append(".frame{fill:none;stroke:var(--muted,#595f66);stroke-width:1}")
    rules.append(".at{fill:none;stroke:var(--ink,#222);stroke-width:1.1;stroke-dasharray:1.5 3}")
    return svg.style_sheet(rules, [name for name in (*_ROWS, "fail") if name not in ("transmitter", "receiver")])


def _heat_colour(part: float) -> str:
    """Colour of a part, from 0 to 1, of the span of a heat map: Matplotlib's viridis."""
    place = min(int(part * (len(_VIRIDIS) - 1)), len(_VIRIDIS) - 2)
    along = part * (len(_VIRIDIS) - 1) - place
    ends = [[int(one[at : at + 2], 16) for at in (0, 2, 4)] for one in _VIRIDIS[place : place + 2]]
    return "#" + "".join(f"{round(a + along * (b - a)):02x}" for a, b in zip(*ends, strict=True))


def _value_scale(values: Floats, start: float, end: float, *, is_use: bool) -> svg.Scale:
    """Scale of a column; of utilizations [%] in equal ratios, with the limit and a decade below it."""
    finite = values[np.isfinite(values)]
    if is_use:
        finite = np.append(finite[finite > 0], 100.0)
        low = min(max(_LEAST, float(finite.min())), _DECADE)
        return svg.Scale(low / 1.3, 1.3 * float(finite.max()), start, end, is_log=True)
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    margin = (high - low) / 20 or abs(high) / 20 or 1.0
    return svg.Scale(low - margin, high + margin, start, end)


def _swatches(canvas: svg.Canvas, statuses: Sequence[str]) -> list[svg.LegendLine]:
    return [svg.box_entry(canvas, svg.status_words(name), f"is-{name}", "frame") for name in statuses]


# ---------------------------------------------------------------- one key
def _curves(
    canvas: svg.Canvas, top: float, trade: Trade, rows: Mapping[str, Floats], by_word: Mapping[str, Trade]
) -> float:
    """Utilizations of rows, or of words, over a number with their limit, or a column; behind them the status."""
    first = next(iter(by_word.values())) if by_word else trade
    (axis,) = first.axes
    name = trade.column or "utilization"
    named = {word: one.values[name] for word, one in by_word.items()} or (
        {name: trade.values[name]} if trade.column else rows
    )
    curves = [(word, f"row{place}", values) for place, (word, values) in enumerate(named.items())]
    if not by_word and not trade.column:
        curves.insert(0, ("worst row", "worst", trade.values[name]))
    factor = 1 if trade.column else 100
    curves = [(word, style, factor * np.asarray(values, float)) for word, style, values in curves]
    frame = svg.Box(_LEFT, top, _WIDTH - _RIGHT, top + _HEIGHT)
    across = _axis_scale(axis, frame.left, frame.right)
    all_values = np.concatenate([values for *_, values in curves])
    up = _value_scale(all_values, frame.bottom, frame.top, is_use=not trade.column)
    statuses = [] if by_word else trade.statuses
    for status, low, high in () if by_word else runs(axis, trade.values["status"]):
        canvas.boxes([svg.Box(across.at(low), frame.top, across.at(high), frame.bottom)], f"is-{status}")
    svg.grid(canvas, frame, None, up)
    entries = []
    for word, style, values in curves:
        _curve(canvas, frame, across, up, axis.values, values, style)
        entries.append(svg.line_entry(canvas, word, style))
    if not trade.column:
        canvas.lines([frame.level(up.at(100.0))], "limit")
        entries.append(svg.line_entry(canvas, "limit", "limit"))
    if axis.own is not None and axis.values[0] <= axis.own <= axis.values[-1]:
        canvas.lines([frame.upright(across.at(axis.own))], "at")
        entries.append(svg.line_entry(canvas, "this mission", "at"))
    svg.outline(canvas, frame, "frame")
    svg.y_axis(canvas, frame, up, trade.heading or ("worst utilization [%]" if by_word else "utilization [%]"))
    bottom = svg.x_axis(canvas, frame, across, axis.label)
    return svg.legend(canvas, bottom, _WIDTH, [*entries, *_swatches(canvas, statuses)])


def _curve(
    canvas: svg.Canvas, frame: svg.Box, across: svg.Scale, up: svg.Scale, x: Floats, values: Floats, style: str
) -> None:
    """One curve, broken where there is no value; one alone between two of these is a short line."""
    points = [
        (across.at(at), up.at(value)) if math.isfinite(value) and (value > 0 or not up.is_log) else None
        for at, value in zip(x.tolist(), values.tolist(), strict=True)
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
    if x.size <= _DOTS and style != "worst":
        for point in filter(None, points):
            if frame.holds(point):
                canvas.circle(point, 2.4, style.replace("row", "dot"))


def _seen(points: Sequence[svg.Point]) -> list[svg.Point]:
    """The visible points of a curve of many: the first, lowest, highest and last of each half pixel."""
    height = itemgetter(1)
    kept: list[svg.Point] = []
    column: list[svg.Point] = []
    for point in (*points, (math.inf, 0.0)):
        if column and point[0] - column[0][0] > 0.5:
            ends = (column[0], *sorted((min(column, key=height), max(column, key=height))), column[-1])
            kept += dict.fromkeys(ends)
            column = []
        column.append(point)
    return kept


def _bars(canvas: svg.Canvas, top: float, trade: Trade, rows: Mapping[str, Floats]) -> float:
    """A bar of utilization, or of a column, for each word, in the colour of its status; on it some rows."""
    (axis,) = trade.axes
    left = min(max(map(svg.text_width, axis.words)) + 34, _MOST_LEFT)
    canvas.text((8, top + 8), [svg.short(axis.key, _WIDTH)], "small")
    frame = svg.Box(left, top + 16, _WIDTH - _RIGHT, top + 24 + _BAR * len(axis.words))
    values = np.asarray(trade.values[trade.column] if trade.column else 100 * trade.values["utilization"], float)
    is_use = not trade.column
    seen = values if is_use else np.append(values, 0.0)
    along = _value_scale(seen, frame.left, frame.right - 50, is_use=is_use)  # with room for a number
    down = svg.Scale(-0.5, len(axis.words) - 0.5, frame.top + 4, frame.bottom - 4)
    svg.grid(canvas, frame, along, None)
    base = frame.left if is_use else along.at(0.0)
    limit = along.at(100.0) if is_use else math.inf
    for place, (status, value) in enumerate(zip(trade.values["status"], values.tolist(), strict=True)):
        y, end = down.at(place), base
        said = svg.status_words(status)
        if math.isfinite(value):
            end = max(along.at(max(value, along.low)), frame.left + 2)
            canvas.boxes([svg.Box(min(base, end), y - 7, max(base, end), y + 7)], f"bar is-{status}")
            said = percent(value / 100) if is_use else svg.axis_number(value)
        beside = max(base, limit if end < limit < end + 60 else end)
        canvas.text((beside + 6, y + 4), [said], "small")
    entries = []
    if is_use:
        canvas.lines([frame.upright(limit)], "limit")
        entries.append(svg.line_entry(canvas, "limit", "limit"))
    for number, (row, uses) in enumerate(rows.items() if is_use else ()):
        shown = [(along.at(100 * use), down.at(place)) for place, use in enumerate(uses.tolist()) if use > 0]
        for point in filter(frame.holds, shown):
            canvas.circle(point, 3, f"dot{number}")
        entries.append(svg.circle_entry(canvas, row, 3, f"dot{number}"))
    if axis.own is not None:
        canvas.circle((frame.left + 9, down.at(axis.own)), 5, "own")
        entries.append(svg.circle_entry(canvas, "this mission", 5, "own"))
    svg.outline(canvas, frame, "frame")
    svg.y_axis(canvas, frame, down, "", axis.words)
    bottom = svg.x_axis(canvas, frame, along, trade.heading or "utilization [%]")
    return svg.legend(canvas, bottom, _WIDTH, [*entries, *_swatches(canvas, trade.statuses)])


# ---------------------------------------------------------------- two keys
class _Plane(NamedTuple):
    """Where a map has a place: to the right and up, or around a middle, in radians, and outwards. [px]"""

    across: svg.Scale
    up: svg.Scale
    middle: svg.Point | None = None

    def at(self, p: float, q: float) -> svg.Point:
        """Place on the page of one on the two scales."""
        if self.middle is None:
            return p, q
        return self.middle[0] + q * math.cos(p), self.middle[1] - q * math.sin(p)

    def line(self, points: Sequence[svg.Point]) -> list[svg.Point]:
        """Line through places on the two scales, on the page."""
        line = [self.at(*points[0])]
        for (p, q), (u, v) in pairwise(points):
            steps = 1 if self.middle is None else max(1, math.ceil(abs(u - p) / _STEP - 1e-9))
            line += [self.at(p + (u - p) * step / steps, q + (v - q) * step / steps) for step in range(1, steps + 1)]
        return line

    def fill(self, canvas: svg.Canvas, boxes: Iterator[svg.Box], style: str) -> None:
        """Fill cells, which are rectangles on the two scales."""
        if self.middle is None:
            canvas.boxes(boxes, style)
            return
        corners = ([(a, b), (c, b), (c, d), (a, d)] for a, b, c, d in boxes)
        canvas.polygons([self.line(four) for four in corners], f"{style} curved")


def _axis_scale(axis: Axis, start: float, end: float) -> svg.Scale:
    """The scale of an axis: on a map the cells of words stand side by side; numbers go from the first to the last."""
    if axis.words:
        return svg.Scale(-0.5, axis.values[-1] + 0.5, start, end)
    return svg.Scale(float(axis.values[0]), float(axis.values[-1]), start, end, axis.is_log)


def _map(canvas: svg.Canvas, top: float, trade: Trade, geometry: BistaticGeometry | None) -> float:
    """Statuses or a column over two keys, the line of 100 %, and what binds where."""
    trade = thinned(trade)
    x, y = trade.axes
    left = min(max(map(svg.text_width, y.words)) + 34, _MOST_LEFT) if y.words else _LEFT + 10
    right = _WIDTH - _RIGHT - (_HEAT_BAR if trade.column else 0.0)
    frame = svg.Box(left, top, right, top + _HEIGHT + 60)
    if geometry is None:
        ends = (frame.top, frame.bottom) if y.words else (frame.bottom, frame.top)
        plane = _Plane(_axis_scale(x, frame.left, frame.right), _axis_scale(y, *ends))
    else:
        plane = _from_above(x, y, frame)
        frame = frame._replace(top=frame.top + 24, bottom=frame.top + 24 + 2 * _RIM)
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
    if x.words and y.words and rows.size <= _CELLS:
        _in_cells(canvas, trade, columns, lines)
    elif not trade.column:
        between = borders(rows, np.array(columns), np.array(lines)).tolist()
        canvas.lines([part for line in between for part in pairwise(plane.line(line))], "between")
        entries += _names(canvas, rows, plane, columns, lines)
    if not has_words and (border := _limit(trade, plane)):
        canvas.lines(border, "halo")
        canvas.lines(border, "border")
        entries.insert(0, svg.line_entry(canvas, "utilization 100 %", "border"))
    if all(axis.own is not None and axis.values[0] <= axis.own <= axis.values[-1] for axis in (x, y)):
        canvas.circle(plane.at(plane.across.at(x.own or 0.0), plane.up.at(y.own or 0.0)), 5, "own")
        entries.append(svg.circle_entry(canvas, "this mission", 5, "own"))
    if geometry is not None:
        return svg.legend(canvas, frame.bottom + 24, _WIDTH, entries)
    svg.outline(canvas, frame, "frame")
    svg.y_axis(canvas, frame, plane.up, y.label, y.words)
    return svg.legend(canvas, svg.x_axis(canvas, frame, plane.across, x.label, x.words), _WIDTH, entries)


def _cells(mask: NDArray[np.bool_], columns: Sequence[float], lines: Sequence[float]) -> Iterator[svg.Box]:
    """Cells of a mask as rectangles, those side by side along the first axis as one."""
    for j in range(mask.shape[1]):
        padded = np.concatenate([[False], mask[:, j], [False]])
        ends = np.flatnonzero(padded[1:] != padded[:-1])
        low, high = sorted((lines[j], lines[j + 1]))
        for start, stop in zip(ends[::2].tolist(), ends[1::2].tolist(), strict=True):
            yield svg.Box(columns[start], low, columns[stop], high)


def _limit(trade: Trade, plane: _Plane) -> list[tuple[svg.Point, svg.Point]]:
    """Line of 100 %: through the logarithms of utilizations, which turn less than these."""
    uses = np.asarray(trade.values["utilization"], float)
    # Where a row is not evaluated, those that are left do not say how near the limit is.
    unknown = [name for name in trade.statuses if not STATUS[name].is_held]
    uses = np.where(np.isin(trade.values["status"], unknown), np.nan, uses)
    with np.errstate(divide="ignore", invalid="ignore"):
        levels = np.log(uses)
    x, y = trade.axes
    places = np.array([plane.across.at(v) for v in x.values]), np.array([plane.up.at(v) for v in y.values])
    return [(plane.at(*start), plane.at(*end)) for start, end in level_lines(levels, *places)]


def _heat(
    canvas: svg.Canvas, frame: svg.Box, trade: Trade, plane: _Plane, columns: Sequence[float], lines: Sequence[float]
) -> None:
    """A column in colours with their scale beside it, in equal ratios where it spans more than two decades."""
    shown = np.asarray(trade.values[trade.column], float)
    shown = np.where(np.isfinite(shown), shown, np.nan)
    finite = shown[np.isfinite(shown)]
    if not finite.size:
        return
    low, high = float(finite.min()), float(finite.max())
    scale = svg.Scale(low, high if high > low else low + (abs(low) or 1.0), frame.bottom, frame.top)
    scale = scale._replace(is_log=low > 0 and high / low > 100)
    seen, ends = (np.log(one) if scale.is_log else np.asarray(one) for one in (shown, scale[:2]))
    with np.errstate(invalid="ignore"):
        heats = np.floor((seen - ends[0]) / (ends[1] - ends[0]) * _HEATS).clip(0, _HEATS - 1)
    left = _WIDTH - _RIGHT - _HEAT_BAR + 14
    step = (frame.bottom - frame.top) / _HEATS
    for place in range(_HEATS):
        plane.fill(canvas, _cells(heats == place, columns, lines), f"heat{place}")
        bottom = frame.bottom - place * step
        canvas.boxes([svg.Box(left, bottom - step, left + 12, bottom)], f"heat{place}")
    for value in scale.ticks(26.0):
        canvas.text((left + 16, scale.at(value) + 3.5), [svg.axis_number(value)], "axis")
    canvas.upright_text((_WIDTH - 4, frame.middle[1]), svg.short(trade.heading, 420.0), "small")


def _in_cells(canvas: svg.Canvas, trade: Trade, columns: Sequence[float], lines: Sequence[float]) -> None:
    """Write the utilization and the worst row into each cell of a map of words."""
    room = int((columns[1] - columns[0]) / 6.5)  # characters of a cell
    for (i, j), use in np.ndenumerate(trade.values["utilization"]):
        if math.isfinite(use):
            x, y = (columns[i] + columns[i + 1]) / 2, (lines[j] + lines[j + 1]) / 2
            row = printable(str(trade.values["worst_row"][i, j])).replace(".", ". ")
            canvas.text((x, y - 10), [percent(float(use))], "", "middle")
            for place, line in enumerate(wrap(row, max(room, 5), max_lines=2, placeholder="…")):
                canvas.text((x, y + 22 + 13 * place), [line.replace(". ", ".")], "small", "middle")


def _names(
    canvas: svg.Canvas, rows: NDArray[Any], plane: _Plane, columns: Sequence[float], lines: Sequence[float]
) -> list[svg.LegendLine]:
    """The name of a row in each region, upright where it is tall, else a letter that the legend explains."""
    letters: dict[str, str] = {}
    named = set()
    cell = [abs(cuts[-1] - cuts[0]) / size for cuts, size in zip((columns, lines), rows.shape, strict=True)]
    for region in regions(rows):
        i, j = region.place
        p, q = (columns[i] + columns[i + 1]) / 2, (lines[j] + lines[j + 1]) / 2
        x, y = plane.at(p, q)
        row = printable(region.row)
        named.add(region.row)
        if plane.middle is not None:  # a name runs towards the middle, not over the rim
            side = math.cos(p)
            canvas.text((x, y + 4), [row], "", "start" if side < -0.3 else "end" if side > 0.3 else "middle")
            continue
        half = 0.45 * svg.text_width(row) + 6
        if region.size[0] * cell[0] < 2 * half < region.size[1] * cell[1]:
            canvas.upright_text((x + 4, min(max(y, min(lines) + half), max(lines) - half)), row, "")
            continue
        if region.size[0] * cell[0] < 2 * half:
            row = letters.setdefault(region.row, _LETTERS[len(letters) % len(_LETTERS)])
            half = 8.0
        canvas.text((min(max(x, columns[0] + half), columns[-1] - half), y + 4), [row], "", "middle")
    entries = [
        svg.LegendLine(row, lambda at, letter=letter: canvas.text((at[0] + 13, at[1] + 4), [letter], "", "middle"))  # type: ignore[misc]
        for row, letter in letters.items()
    ]
    occurring = set(rows.ravel().tolist()) - {""}
    if others := sorted(occurring - named):
        listed = f"{', '.join(others[:3])}{' …' * (len(others) > 3)}"
        entries.append(svg.line_entry(canvas, f"another row binds, in small regions {listed}", "between"))
    elif len(occurring) > 1:
        entries.append(svg.line_entry(canvas, "another row binds", "between"))
    return entries


# ---------------------------------------------------------------- from above
def _from_above(around: Axis, radius: Axis, frame: svg.Box) -> _Plane:
    """Azimuths from east, counter-clockwise; the other key as a radius from 0.

    An elevation is 90 deg in the middle: what is seen from above there stands over the scene.
    """
    first, last = float(around.values[0]), float(around.values[-1])
    is_elevation = radius.key.endswith(".elevation")
    inner, rim = (math.pi / 2 / radius.scale, radius.values[0]) if is_elevation else (0.0, radius.values[-1])
    return _Plane(
        svg.Scale(first, last, first * around.scale, last * around.scale),
        svg.Scale(inner, float(rim), 0.0, _RIM),
        (frame.middle[0], frame.top + 24 + _RIM),
    )


def _around(canvas: svg.Canvas, plane: _Plane, around: Axis, geometry: BistaticGeometry) -> list[svg.LegendLine]:
    """Directions, circles with their numbers, and at the rim where the other platform stands."""
    turn = (0.0, 2 * math.pi)
    names = {0: "east", 90: "north", 180: "west", 270: "south"}
    for degrees in range(0, 360, 45):
        angle = math.radians(degrees)
        canvas.lines([(plane.at(angle, 0.0), plane.at(angle, _RIM))], "grid")
        x, y = plane.at(angle, _RIM + 14)
        side = round(math.cos(angle), 3)
        anchor = "start" if side > 0 else "end" if side < 0 else "middle"
        canvas.text((x, y + 4), [names.get(degrees, f"{degrees}°")], "axis", anchor)
    # Numbers stand beside what is drawn where that is not the whole circle.
    is_open = plane.across.end - plane.across.start < 1.9 * math.pi
    free = plane.across.start - math.radians(6) if is_open else math.pi / 8
    for value in plane.up.ticks(26.0):
        radius = plane.up.at(value)
        canvas.polyline(plane.line([(angle, radius) for angle in turn]), "grid", is_obstacle=False)
        canvas.text(plane.at(free, radius), [svg.axis_number(value)], "axis", "middle")
    canvas.polyline(plane.line([(angle, _RIM) for angle in turn]), "frame", is_obstacle=False)
    moved = [name for name in ("transmitter", "receiver") if f".{name}." in f".{around.key}"]
    if len(moved) != 1:
        return []
    other = "receiver" if moved == ["transmitter"] else "transmitter"
    east, north, _ = getattr(geometry, other).position
    angle = math.atan2(north, east)
    points = [plane.at(angle, _RIM - 7), *(plane.at(angle + side, _RIM + 6) for side in (0.045, -0.045))]
    canvas.polygon(points, f"solid {other}")
    return [
        svg.LegendLine(
            f"direction of the {other}",
            lambda at: canvas.polygon(
                [(at[0] + 6, at[1]), *((at[0] + 19, at[1] + side) for side in (7, -7))], f"solid {other}"
            ),
        )
    ]
