"""A small SVG canvas with axes, colours, lines, markers, and automatically placed labels; its output is reproducible.

Colours are CSS custom properties with a fallback, so that a page with an inlined drawing can set them: --ink,
--muted, --grid, --paper, --transmitter, --receiver. A drawing in a separate file has its own light and dark colours.
Only the title and the description have ids. They contain the argument `key` of `Canvas.document`, so that one page
can have drawings of many missions.
"""

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from itertools import pairwise
from textwrap import wrap
from typing import NamedTuple, TypeVar

from bisar_budget.faults import printable
from bisar_budget.findings.status import STATUS
from bisar_budget.report.words.sentences import xml_text
from bisar_budget.resources import resource

Point = tuple[float, float]  # x to the right, y down [px]
Segment = tuple[Point, Point]
Mark = TypeVar("Mark")

FONT_PX = 12.0
LINE_PX = 14.5  # from a line of text to the next
KEY_FONT_RATIO = 0.72  # width of a key in small, relative to its usual width
_DARK = "--ink:#e6e6e6;--muted:#a9adb3;--grid:#3a3f46;--paper:#16191d;--transmitter:#7db4f2;--receiver:#f0a06a"
DRAWING_STYLE = (
    "svg.drawing{max-width:100%;height:auto;font:12px system-ui,'Segoe UI',Roboto,'DejaVu Sans',sans-serif}"
    "svg.drawing text{fill:var(--ink,#222);paint-order:stroke}"
    "svg.drawing text{stroke:var(--paper,#fff);stroke-width:3px;stroke-linejoin:round}"
    "svg.drawing .small,svg.drawing .axis{font-size:10.5px;fill:var(--muted,#595f66)}"
    "svg.drawing .key{font-size:8.5px;fill:var(--muted,#595f66)}"
    "svg.drawing .name{font-weight:600}"
    "svg.drawing .sub{font-size:9px}"
    "svg.drawing .line,svg.drawing .transmitter,svg.drawing .receiver"
    "{fill:none;stroke:var(--ink,#222);stroke-width:1.4}"
    "svg.drawing .transmitter{stroke:var(--transmitter,#1f5fa8)}"
    "svg.drawing .receiver{stroke:var(--receiver,#a8471a)}"
    "svg.drawing .path{stroke-width:4;stroke-opacity:.45;stroke-linecap:round}"
    "svg.drawing .solid{fill:var(--ink,#222);stroke:none}"
    "svg.drawing .solid.transmitter{fill:var(--transmitter,#1f5fa8)}"
    "svg.drawing .solid.receiver{fill:var(--receiver,#a8471a)}"
    "svg.drawing .hollow{fill:var(--paper,#fff)}"
    "svg.drawing .thin{stroke:var(--muted,#595f66);stroke-width:1;fill:none}"
    "svg.drawing .grid{stroke:var(--grid,#e2e5e9);stroke-width:1;fill:none}"
    "svg.drawing .dashed{stroke-dasharray:6 4}"
    "svg.drawing .dotted{stroke-dasharray:1.5 3}"
    "svg:root.drawing{background:var(--paper,#fff)}"
    f"@media (prefers-color-scheme:dark){{svg:root.drawing{{{_DARK}}}}}"
)

_NARROW_LETTERS, _WIDE_LETTERS = "fijlrtI.,:;'|!()[] ", "mwMW%@"
_MARGIN_PX = 2.0  # around a label


@dataclass(frozen=True)
class _LabelCosts:
    """Costs that determine the position of a label, in the unit of a covered area. [px²]

    Attributes
    ----------
    outside : float
        Cost of a position at which the label extends beyond the box in which it must be written.
    covered : float
        Cost of each obstacle covered by the label, in addition to the covered area.
    crossed_per_px : float
        Cost of each pixel of a line covered by the label.
    distance_per_px : float
        Cost of each pixel of the distance between the label and its point.
    direction : float
        Cost of each step in the order of preferred directions.
    """

    outside: float = 1e4
    covered: float = 60.0
    crossed_per_px: float = 2.0
    distance_per_px: float = 0.6
    direction: float = 0.15


_COSTS = _LabelCosts()

# Directions from a point to its label, (x, y), in the order of preference of maps: right, above, below, left.
_DIRECTIONS = [
    (math.cos(math.radians(angle)), -math.sin(math.radians(angle)))
    for angle in (0, 30, -30, 60, -60, 90, -90, 180, 150, -150, 120, -120)
]
_LABEL_GAPS_PX = (8.0, 15.0, 24.0, 36.0, 52.0)  # from the point to the label


class Box(NamedTuple):
    """A rectangle on the page, given by its edges [px]."""

    left: float
    top: float
    right: float
    bottom: float

    @property
    def middle(self) -> Point:
        """Centre of the box."""
        return (self.left + self.right) / 2, (self.top + self.bottom) / 2

    def upright(self, x: float) -> Segment:
        """Vertical line segment across the box at `x`."""
        return (x, self.top), (x, self.bottom)

    def level(self, y: float) -> Segment:
        """Horizontal line segment across the box at `y`."""
        return (self.left, y), (self.right, y)

    def covered_by(self, box: "Box") -> float:
        """Area shared with another box. [px²]"""
        left, top, right, bottom = self
        if box.left >= right or box.right <= left or box.top >= bottom or box.bottom <= top:
            return 0.0  # a fast exit for most boxes, which are far apart
        return (min(right, box.right) - max(left, box.left)) * (min(bottom, box.bottom) - max(top, box.top))

    def holds(self, point: Point) -> bool:
        """Whether a point is inside the box."""
        return self.left <= point[0] <= self.right and self.top <= point[1] <= self.bottom

    def clipped(self, segment: Segment) -> Segment | None:
        """Part of a line segment inside the box, by the Liang-Barsky algorithm; None if the segment is outside."""
        (x, y), (u, v) = segment
        dx, dy = u - x, v - y
        enter, leave = 0.0, 1.0
        for step, room in ((-dx, x - self.left), (dx, self.right - x), (-dy, y - self.top), (dy, self.bottom - y)):
            if step == 0:
                if room < 0:
                    return None
            elif step < 0:
                enter = max(enter, room / step)
            else:
                leave = min(leave, room / step)
        if enter > leave:
            return None
        return (x + enter * dx, y + enter * dy), (x + leave * dx, y + leave * dy)


class DrawnLabel(NamedTuple):
    """A label for a point: lines of text, and the box inside which they must be written."""

    at: Point
    lines: tuple[str, ...]
    within: Box


class _LabelPosition(NamedTuple):
    """A possible position of a label: its box, the anchor of its text, and the cost of the position."""

    box: Box
    anchor: str
    cost: float


class Canvas:
    """The elements of a drawing in progress, and the obstacles that its labels avoid."""

    def __init__(self) -> None:
        self._elements: list[str] = []
        self._texts: list[str] = []  # drawn last, above all lines
        self.obstacles: list[Box] = []
        self.segments: list[Segment] = []

    def polyline(
        self, points: Sequence[Point], style: str, within: Box | None = None, is_obstacle: bool = True
    ) -> None:
        """Draw a line through points, clipped to a box."""
        for run in _runs(points, within):
            self._path(_through(run), style)
            if is_obstacle:
                self.segments += pairwise(run)

    def polygons(self, shapes: Iterable[Sequence[Point]], style: str) -> None:
        """Draw many filled or hollow shapes as one element."""
        self._path("".join(f"{_through(points)}Z" for points in shapes), style)

    def polygon(self, points: Sequence[Point], style: str, is_obstacle: bool = True) -> None:
        """Draw a filled or hollow shape."""
        self.polygons([points], style)
        if is_obstacle:
            xs, ys = zip(*points, strict=True)
            self.obstacles.append(Box(min(xs), min(ys), max(xs), max(ys)))

    def lines(self, lines: Iterable[Segment], style: str) -> None:
        """Draw many straight lines, each between two points, as one element."""
        self._path("".join(map(_through, lines)), style)

    def boxes(self, boxes: Iterable[Box], style: str) -> None:
        """Fill many rectangles as one element."""
        sides = (tuple(map(_number, box)) for box in boxes)
        data = "".join(f"M{left} {top}H{right}V{bottom}H{left}Z" for left, top, right, bottom in sides)
        self._path(data, style)

    def _path(self, data: str, style: str) -> None:
        if data:
            self._elements.append(f'<path class="{style}" d="{data}"/>')

    def circle(self, centre: Point, radius: float, style: str) -> None:
        """Draw a circle around a point."""
        x, y = centre
        self._elements.append(f'<circle class="{style}" cx="{_number(x)}" cy="{_number(y)}" r="{_number(radius)}"/>')
        self.obstacles.append(Box(x - radius, y - radius, x + radius, y + radius))

    def arrow(self, tail: Point, tip: Point, colour: str = "", both_ends: bool = False) -> None:
        """Draw a straight line with an arrow head at its tip."""
        self.polyline([tail, tip], f"line {colour}".rstrip())
        for end, start in ((tip, tail), (tail, tip)) if both_ends else ((tip, tail),):
            length = math.dist(end, start)
            if length == 0:
                continue
            x, y = (end[0] - start[0]) / length, (end[1] - start[1]) / length
            back = (end[0] - 8 * x, end[1] - 8 * y)
            sides = [(back[0] - 3.2 * y * s, back[1] + 3.2 * x * s) for s in (1, -1)]
            self.polygon([end, *sides], f"solid {colour}".rstrip(), is_obstacle=False)

    def text(self, at: Point, lines: Sequence[str], style: str = "", anchor: str = "start") -> None:
        """Write lines of text, starting at `at` on the first baseline.

        The first of several lines is styled as a name.
        """
        x, y = at
        spans = []
        for index, line in enumerate(lines):
            name = ' class="name"' if index == 0 and len(lines) > 1 else ""
            dy = f' dy="{LINE_PX}"' if index else ""
            spans.append(f'<tspan x="{_number(x)}"{dy}{name}>{_with_subscripts(line)}</tspan>')
        attributes = (f' class="{style}"' if style else "") + (
            f' text-anchor="{anchor}"' if anchor != "start" else ""
        )
        self._texts.append(f'<text x="{_number(x)}" y="{_number(y)}"{attributes}>{"".join(spans)}</text>')

    def upright_text(self, at: Point, line: str, style: str) -> None:
        """Write a line of text that runs upwards, centred at a point."""
        x, y = (_number(coordinate) for coordinate in at)
        self._texts.append(
            f'<text class="{style}" text-anchor="middle" transform="translate({x} {y}) rotate(-90)">'
            f"{xml_text(line)}</text>"
        )

    def labels(self, labels: Sequence["DrawnLabel"]) -> None:
        """Write labels near their points, where they overlap least with the drawing and with other labels.

        Labels are placed one after the other. A label may occupy the only good position of a label that comes later.
        Therefore several orders are tried, and the order with the lowest total cost is used.
        """
        options = [self._options(label) for label in labels]
        indices = range(len(labels))
        orders = [[*indices[first:], *indices[:first]] for first in indices]
        trials = [_positioned(options, order) for order in (*orders, *(order[::-1] for order in orders))]
        _, best = min(trials, key=lambda trial: trial[0]) if trials else (0.0, {})
        for index, label in enumerate(labels):
            candidate = best[index]
            box = candidate.box
            self.obstacles.append(box)
            x = {"start": box.left + _MARGIN_PX, "middle": box.middle[0], "end": box.right - _MARGIN_PX}
            self.text((x[candidate.anchor], box.top + 0.8 * LINE_PX), label.lines, anchor=candidate.anchor)

    def _options(self, label: "DrawnLabel") -> list["_LabelPosition"]:
        """Possible positions of a label around its point with their costs, cheapest first."""
        width = max(text_width(line) for line in label.lines) + 2 * _MARGIN_PX
        height = LINE_PX * len(label.lines)
        candidates = list(_positions(label.at, width, height))
        costed = [
            candidate._replace(cost=candidate.cost + self._cost(candidate.box, label.within))
            for candidate in candidates
        ]
        return sorted(costed, key=lambda candidate: candidate.cost)

    def _cost(self, box: Box, within: Box) -> float:
        over = (within.left - box.left, within.top - box.top, box.right - within.right, box.bottom - within.bottom)
        outside = sum(max(0.0, overhang) for overhang in over)
        if outside > 0:
            return _COSTS.outside + outside * _COSTS.covered
        cost = math.fsum(_overlap(box, obstacle) for obstacle in self.obstacles)
        left, top, right, bottom = box
        for (x, y), (u, v) in self.segments:
            if (x < left and u < left) or (x > right and u > right):
                continue  # a fast exit for most lines, which are far away
            if (y < top and v < top) or (y > bottom and v > bottom):
                continue
            if (inside := box.clipped(((x, y), (u, v)))) is not None:
                cost += 2 + _COSTS.crossed_per_px * math.dist(*inside)
        return cost

    def document(self, size: tuple[float, float], key: str, title: str, description: str, style: str = "") -> str:
        """Return the drawing as SVG text, with a title and a description for readers who cannot see it.

        `key` makes the ids unique. `style` has the CSS rules for this kind of drawing, in addition to
        `DRAWING_STYLE`.
        """
        name = "d" + sha256(key.encode("utf-8", "surrogatepass")).hexdigest()[:10]
        width, height = (_number(side) for side in size)
        body = "\n".join((*self._elements, *self._texts))
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" class="drawing" role="img" viewBox="0 0 {width} {height}" '
            f'width="{width}" height="{height}" aria-labelledby="{name}-title" aria-describedby="{name}-desc">\n'
            f'<title id="{name}-title">{xml_text(title)}</title>\n'
            f'<desc id="{name}-desc">{xml_text(description)}</desc>\n'
            f"<style>{DRAWING_STYLE}{style}</style>\n{body}\n</svg>\n"
        )


def _through(points: Iterable[Point]) -> str:
    """SVG path data of a line through the given points."""
    return "M" + "L".join(f"{_number(x)} {_number(y)}" for x, y in points)


def text_width(line: str) -> float:
    """Width of a line of text, estimated generously because the font is unknown. [px]"""
    return FONT_PX * math.fsum(
        0.36 if c in _NARROW_LETTERS else 0.95 if c in _WIDE_LETTERS else 0.74 if c.isupper() else 0.62 for c in line
    )


def _positions(at: Point, width: float, height: float) -> Iterator["_LabelPosition"]:
    """Yield possible positions of a label around a point, with their costs.

    The cost grows with the distance from the point, and is higher for less preferred directions.
    """
    for gap in _LABEL_GAPS_PX:
        for order, (x, y) in enumerate(_DIRECTIONS):
            # The nearest point of the box is `gap` away. Above and below its point the box is centred.
            left = at[0] + gap * x + (0.0 if x > 0.1 else -width if x < -0.1 else -width / 2)
            top = at[1] + gap * y + (-height / 2 if abs(y) < 0.1 else -height if y < 0 else 0.0)
            anchor = "start" if x > 0.1 else "end" if x < -0.1 else "middle"
            yield _LabelPosition(
                Box(left, top, left + width, top + height),
                anchor,
                _COSTS.distance_per_px * gap + _COSTS.direction * order,
            )


def _positioned(
    options: Sequence[Sequence["_LabelPosition"]], order: Sequence[int]
) -> tuple[float, dict[int, "_LabelPosition"]]:
    """Place labels one after the other in the given order.

    Returns the total cost, and a dictionary with the position of each label, by the index of the label.
    """
    total, taken = 0.0, dict[int, _LabelPosition]()
    for index in order:
        best, least = options[index][0], math.inf
        for candidate in options[index]:
            if candidate.cost >= least:
                break  # positions are sorted by cost
            cost = candidate.cost + math.fsum(_overlap(candidate.box, placed.box) for placed in taken.values())
            if cost < least:
                best, least = candidate, cost
        taken[index], total = best, total + least
    return total, taken


def _overlap(box: Box, obstacle: Box) -> float:
    area = box.covered_by(obstacle)
    return _COSTS.covered + area if area else 0.0


def _runs(points: Sequence[Point], within: Box | None) -> Iterator[list[Point]]:
    """Yield the connected pieces of a line that are inside a box."""
    if within is None:
        yield list(points)
        return
    run: list[Point] = []
    for segment in pairwise(points):
        inside = within.clipped(segment)
        if inside is None or math.dist(*inside) == 0:
            continue
        if run and run[-1] != inside[0]:
            yield run
            run = []
        run = [*run, inside[1]] if run else list(inside)
    if run:
        yield run


_SUBSCRIPT = re.compile(r"([φθ])_(\w)(.*)")


def _with_subscripts(line: str) -> str:
    return _SUBSCRIPT.sub(r'\1<tspan class="sub" dy="3">\2</tspan><tspan dy="-3">\3</tspan>', xml_text(line))


def _number(value: float) -> str:
    """Write a coordinate, rounded to a hundredth of a pixel, without trailing zeros and without -0."""
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


_MIN_AXIS_STEP_SIZE = 1e-9  # smallest step of an axis, if all values are equal
_NUMBER_ROOM_PX = {"x": 46.0, "y": 26.0}  # space for a number at an axis
_LEGEND_INDENT_PX = 18.0
_LEGEND_CHARACTERS = 76  # of a line of a legend
_SMALL_FONT_RATIO = 0.9  # width of a text in the font of a legend, relative to its usual width


def axis_number(value: float) -> str:
    """Format a number for an axis label, with a typographic minus sign."""
    return f"{value + 0.0:.6g}".replace("-", "−")


def ticks(lower: float, upper: float, step: float) -> Sequence[float]:
    """Multiples of `step` between two values."""
    first, last = math.ceil(lower / step - 1e-9), math.floor(upper / step + 1e-9)
    return [index * step for index in range(first, last + 1)]


def round_step(least: float) -> float:
    """Round a value up to the next number of the form 1, 2 or 5 times a power of ten."""
    least = max(least, _MIN_AXIS_STEP_SIZE)
    power = 10.0 ** math.floor(math.log10(least))
    return next(factor * power for factor in (1, 2, 5, 10) if factor * power >= least * (1 - 1e-9))


class Scale(NamedTuple):
    """Linear or logarithmic scale that maps values `low` … `high` to coordinates `start` … `end` [px]."""

    low: float
    high: float
    start: float
    end: float
    is_log: bool = False

    def at(self, value: float) -> float:
        """Coordinate on the page for a value. [px]"""
        low, high, value = (math.log(number) if self.is_log else number for number in (self.low, self.high, value))
        return self.start + (value - low) / (high - low) * (self.end - self.start)

    def ticks(self, room: float) -> Sequence[float]:
        """Choose ticks at round values that are at least `room` px apart."""
        size, (low, high) = abs(self.end - self.start), sorted((self.low, self.high))
        if not self.is_log:
            return ticks(low, high, round_step((high - low) * room / size))
        powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
        for factors in ((1, 2, 5), (1, 3), (1,)):
            values = [factor * 10.0**power for power in powers for factor in factors]
            fitting = [value for value in values if low * (1 - 1e-9) <= value <= high * (1 + 1e-9)]
            if all(abs(self.at(b) - self.at(a)) >= room for a, b in pairwise(fitting)):
                break
        return fitting


def short(word: str, room: float) -> str:
    """Shorten a string to at most `room` px; a shortened string ends with an ellipsis."""
    text = printable(word)
    while text_width(text) > room and len(text) > 2:
        text = f"{text[:-2].rstrip('…')}…"
    return text


def head(canvas: Canvas, lines: Sequence[str]) -> float:
    """Write lines of text above a drawing; return the y coordinate of the top of the drawing. [px]

    The first line is styled as the name of the drawing.
    """
    for index, line in enumerate(lines):
        canvas.text((8, 18 + index * LINE_PX), [line], "small" if index else "name")
    return 16 + len(lines) * LINE_PX if lines else 10.0


def x_axis(
    canvas: Canvas, frame: Box, scale: Scale, label: str, words: Sequence[str] = (), *, key: str = ""
) -> float:
    """Write the tick labels (numbers or `words`) and the label of an axis below a frame; return its bottom. [px]

    `key` is written in small type below the axis label. The result is the y coordinate of the bottom of the axis.
    """
    bottom = frame.bottom
    room = (frame.right - frame.left) / max(len(words), 1)
    if any(text_width(word) > room - 4 for word in words):
        names = [short(word, 120.0) for word in words]
        for index, name in enumerate(names):
            canvas.upright_text((scale.at(index) + 4, bottom + 6 + text_width(name) / 2), name, "axis")
        bottom += max(map(text_width, names)) - 8
    else:
        for index, word in enumerate(words):
            canvas.text((scale.at(index), bottom + 14), [printable(word)], "axis", "middle")
    for value in () if words else scale.ticks(_NUMBER_ROOM_PX["x"]):
        x = scale.at(value)
        canvas.lines([((x, bottom), (x, bottom + 4))], "thin")
        canvas.text((x, bottom + 15), [axis_number(value)], "axis", "middle")
    canvas.text((frame.middle[0], bottom + 31), [label], "small", "middle")
    if not key:
        return bottom + 31
    canvas.text(
        (frame.middle[0], bottom + 42), [short(key, (frame.right - frame.left) / KEY_FONT_RATIO)], "key", "middle"
    )
    return bottom + 42


def y_axis(canvas: Canvas, frame: Box, scale: Scale, label: str, words: Sequence[str] = (), *, key: str = "") -> None:
    """Write tick labels (numbers or `words`) and the axis label to the left of a frame.

    `key` is written in small type beside the axis label.
    """
    for index, word in enumerate(words):
        canvas.text((frame.left - 6, scale.at(index) + 4), [short(word, frame.left - 34)], "axis", "end")
    for value in () if words else scale.ticks(_NUMBER_ROOM_PX["y"]):
        y = scale.at(value)
        canvas.lines([((frame.left - 4, y), (frame.left, y))], "thin")
        canvas.text((frame.left - 7, y + 3.5), [axis_number(value)], "axis", "end")
    label = short(label, 1.3 * (frame.bottom - frame.top))
    canvas.upright_text((12, frame.middle[1]), label, "small")
    if key:
        canvas.upright_text((23, frame.middle[1]), short(key, (frame.bottom - frame.top) / KEY_FONT_RATIO), "key")


def outline(canvas: Canvas, frame: Box, style: str) -> None:
    """Draw the edges of a rectangle."""
    left, top, right, bottom = frame
    canvas.polygon([(left, top), (right, top), (right, bottom), (left, bottom)], style, is_obstacle=False)


def grid(canvas: Canvas, frame: Box, across: Scale | None, up: Scale | None) -> None:
    """Draw grid lines at the ticks of the horizontal scale `across` and the vertical scale `up`; each may be None."""
    if across is not None:
        canvas.lines([frame.upright(across.at(value)) for value in across.ticks(_NUMBER_ROOM_PX["x"])], "grid")
    if up is not None:
        canvas.lines([frame.level(up.at(value)) for value in up.ticks(_NUMBER_ROOM_PX["y"])], "grid")


class LegendLine(NamedTuple):
    """An entry of a legend: its text, and a function that draws its mark to the right of a given point.

    The mark is 25 px wide. `key` is a key of the mission file or an id, which is written in small type after the
    text.
    """

    words: str
    mark: Callable[[Point], None]
    key: str = ""


def line_entry(canvas: Canvas, words: str, style: str) -> LegendLine:
    """Make a legend entry for a line that is drawn in `style`."""
    return LegendLine(words, lambda at: canvas.lines([(at, (at[0] + 25, at[1]))], style))


def circle_entry(canvas: Canvas, words: str, radius: float, style: str) -> LegendLine:
    """Make a legend entry for a circle that is drawn in `style`; `radius` is in px."""
    return LegendLine(words, lambda at: canvas.circle((at[0] + 13, at[1]), radius, style))


def box_entry(canvas: Canvas, words: str, *styles: str) -> LegendLine:
    """Make a legend entry for a rectangle that is drawn in several styles on top of each other."""

    def mark(at: Point) -> None:
        for style in styles:
            canvas.boxes([Box(at[0] + 4, at[1] - 5, at[0] + 22, at[1] + 5)], style)

    return LegendLine(words, mark)


def legend(canvas: Canvas, top: float, width: float, entries: Sequence[LegendLine]) -> float:
    """Write the entries of a legend in lines below a drawing; return the y coordinate of its bottom. [px]"""
    x, y = _LEGEND_INDENT_PX, top + 20
    for entry in entries:
        lines = wrap(printable(entry.words), _LEGEND_CHARACTERS, max_lines=3, placeholder=" …")
        width_px = _SMALL_FONT_RATIO * text_width(lines[-1])
        key_room = KEY_FONT_RATIO * text_width(entry.key) + 8 if entry.key else 0.0
        room = 44 + max(_SMALL_FONT_RATIO * max(map(text_width, lines)), width_px + key_room)
        if x + room > width and x > _LEGEND_INDENT_PX:
            x, y = _LEGEND_INDENT_PX, y + LINE_PX + 3
        entry.mark((x, y - 4))
        for index, line in enumerate(lines):
            y += LINE_PX if index else 0
            canvas.text((x + 31, y), [line], "small")
        if entry.key:
            canvas.text((x + 37 + width_px, y), [printable(entry.key)], "key")
        x += room
    return y + 6


EMPTY_TONE = "reserve"  # colour of a case without a valid mission


@cache
def colours() -> tuple[Mapping[str, str], Mapping[str, str]]:
    """Colours by name, in two mappings: for a white page, and for a dark screen."""
    sheet = resource("templates", "report.css").read_text(encoding="utf-8")
    blocks = sheet.split("}", 2)[:2]
    light, dark = (dict(re.findall(r"--([\w-]+): (#[0-9a-f]{3,6})", block)) for block in blocks)
    return light, dark


def style_sheet(rules: Iterable[str], tones: Iterable[str]) -> str:
    """CSS rules for one kind of drawing.

    They include the colours for dark mode, which apply only if the drawing is a file of its own.
    """
    _, dark = colours()
    scoped = "".join(f"svg.drawing {rule}" for rule in rules)
    dark_tones = ";".join(f"--{tone}:{dark[tone]}" for tone in dict.fromkeys(tones))
    return f"{scoped}@media (prefers-color-scheme:dark){{svg:root.drawing{{{dark_tones}}}}}" if dark_tones else scoped


def has_no_mission(status: str) -> bool:
    """Whether a status means that a case has no valid mission to check."""
    return STATUS[status].junit == "error"


def tone_of(status: str) -> str:
    """Name of the colour of a status."""
    return EMPTY_TONE if has_no_mission(status) else STATUS[status].color


def status_words(status: str) -> str:
    """Name of a status for a legend."""
    return "no such mission" if has_no_mission(status) else STATUS[status].words


def marks_within_colours(statuses: Sequence[str], marks: Sequence[Mark]) -> Mapping[str, Mark]:
    """Assign a mark to each status; statuses with the same colour get successive items of `marks`.

    If there are too few items, the last item is repeated.
    """
    tones = [tone_of(name) for name in statuses]
    indices = (tones[:index].count(tone) for index, tone in enumerate(tones))
    return {name: marks[min(index, len(marks) - 1)] for name, index in zip(statuses, indices, strict=True)}
