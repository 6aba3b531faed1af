"""A small SVG canvas with axes and colours: lines, markers, labels that find a free place. The same bytes each time.

Colours are custom properties with a fallback, so that a page which inlines a drawing can set them: --ink, --muted,
--grid, --paper, --transmitter, --receiver. A drawing that is a file of its own brings light and dark itself.
Nothing but the title and its description has an id, made of `key`: drawings of many missions fit into one page.
"""

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
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

FONT = 12.0  # px
LINE_HEIGHT = 14.5  # px
_DARK = "--ink:#e6e6e6;--muted:#a9adb3;--grid:#3a3f46;--paper:#16191d;--transmitter:#7db4f2;--receiver:#f0a06a"
STYLE = (
    "svg.drawing{max-width:100%;height:auto;font:12px system-ui,'Segoe UI',Roboto,'DejaVu Sans',sans-serif}"
    "svg.drawing text{fill:var(--ink,#222);paint-order:stroke}"
    "svg.drawing text{stroke:var(--paper,#fff);stroke-width:3px;stroke-linejoin:round}"
    "svg.drawing .small,svg.drawing .axis{font-size:10.5px;fill:var(--muted,#595f66)}"
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

_NARROW, _WIDE = "fijlrtI.,:;'|!()[] ", "mwMW%@"
_MARGIN = 2.0  # px around a label
_OUTSIDE, _COVERED, _CROSSED, _AWAY, _ORDER = 1e4, 60.0, 2.0, 0.6, 0.15  # what a place for a label costs
# Right of the point first, then above, below, left, as maps are lettered; x and y of the label's middle.
_DIRECTIONS = [
    (math.cos(math.radians(angle)), -math.sin(math.radians(angle)))
    for angle in (0, 30, -30, 60, -60, 90, -90, 180, 150, -150, 120, -120)
]
_GAPS = (8.0, 15.0, 24.0, 36.0, 52.0)  # px from the point to the label


class Box(NamedTuple):
    """A rectangle. [px]"""

    left: float
    top: float
    right: float
    bottom: float

    @property
    def middle(self) -> Point:
        """Its centre."""
        return (self.left + self.right) / 2, (self.top + self.bottom) / 2

    def upright(self, x: float) -> Segment:
        """Line through it from above to below."""
        return (x, self.top), (x, self.bottom)

    def level(self, y: float) -> Segment:
        """Line through it from left to right."""
        return (self.left, y), (self.right, y)

    def covered_by(self, other: "Box") -> float:
        """Area shared with another. [px²]"""
        left, top, right, bottom = self
        if other.left >= right or other.right <= left or other.top >= bottom or other.bottom <= top:
            return 0.0  # most are far apart
        return (min(right, other.right) - max(left, other.left)) * (min(bottom, other.bottom) - max(top, other.top))

    def holds(self, point: Point) -> bool:
        """Say whether a point lies inside."""
        return self.left <= point[0] <= self.right and self.top <= point[1] <= self.bottom

    def clipped(self, segment: Segment) -> Segment | None:
        """Part of a line that lies inside (Liang-Barsky)."""
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
    """Lines of text that belong to a point, to be written inside a box."""

    at: Point
    lines: tuple[str, ...]
    within: Box


class _Place(NamedTuple):
    """Where a label could stand, the side its text is aligned to, and what that costs."""

    box: Box
    anchor: str
    cost: float


class Canvas:
    """Collects the elements of one drawing, and knows what is taken when labels look for a place."""

    def __init__(self) -> None:
        self._elements: list[str] = []
        self._texts: list[str] = []  # drawn last, above all lines
        self.obstacles: list[Box] = []
        self.segments: list[Segment] = []

    def polyline(
        self, points: Sequence[Point], style: str, within: Box | None = None, is_obstacle: bool = True
    ) -> None:
        """Draw a line through points, cut at the edges of a box."""
        for run in _runs(points, within):
            self._path(_through(run), style)
            if is_obstacle:
                self.segments += pairwise(run)

    def polygons(self, shapes: Iterable[Sequence[Point]], style: str) -> None:
        """Draw many filled or hollow shapes as one."""
        self._path("".join(f"{_through(points)}Z" for points in shapes), style)

    def polygon(self, points: Sequence[Point], style: str, is_obstacle: bool = True) -> None:
        """Draw a filled or hollow shape."""
        self.polygons([points], style)
        if is_obstacle:
            xs, ys = zip(*points, strict=True)
            self.obstacles.append(Box(min(xs), min(ys), max(xs), max(ys)))

    def lines(self, lines: Iterable[Segment], style: str) -> None:
        """Draw many lines, each from a point to another, as one."""
        self._path("".join(map(_through, lines)), style)

    def boxes(self, boxes: Iterable[Box], style: str) -> None:
        """Fill many rectangles as one."""
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
        """Draw a line with a head at its tip."""
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
        """Write lines of text; `at` is the baseline of the first. The first of several is the name of a thing."""
        x, y = at
        spans = []
        for index, line in enumerate(lines):
            name = ' class="name"' if index == 0 and len(lines) > 1 else ""
            dy = f' dy="{LINE_HEIGHT}"' if index else ""
            spans.append(f'<tspan x="{_number(x)}"{dy}{name}>{_with_subscripts(line)}</tspan>')
        attributes = (f' class="{style}"' if style else "") + (
            f' text-anchor="{anchor}"' if anchor != "start" else ""
        )
        self._texts.append(f'<text x="{_number(x)}" y="{_number(y)}"{attributes}>{"".join(spans)}</text>')

    def upright_text(self, at: Point, line: str, style: str) -> None:
        """Write a line that runs upwards, its middle at a point."""
        x, y = (_number(part) for part in at)
        self._texts.append(
            f'<text class="{style}" text-anchor="middle" transform="translate({x} {y}) rotate(-90)">'
            f"{xml_text(line)}</text>"
        )

    def labels(self, labels: Sequence["DrawnLabel"]) -> None:
        """Write texts near their points, where together they cover least of what is drawn and of each other.

        They are placed one after the other; the best of several orders counts, because who comes first may take
        the only place of another.
        """
        options = [self._options(label) for label in labels]
        indices = range(len(labels))
        orders = [[*indices[first:], *indices[:first]] for first in indices]
        trials = [_chosen(options, order) for order in (*orders, *(order[::-1] for order in orders))]
        _, best = min(trials, key=lambda trial: trial[0]) if trials else (0.0, {})
        for index, label in enumerate(labels):
            place = best[index]
            box = place.box
            self.obstacles.append(box)
            x = {"start": box.left + _MARGIN, "middle": box.middle[0], "end": box.right - _MARGIN}
            self.text((x[place.anchor], box.top + 0.8 * LINE_HEIGHT), label.lines, anchor=place.anchor)

    def _options(self, label: "DrawnLabel") -> list["_Place"]:
        """Places around the label's point with their costs, the cheapest first."""
        width = max(text_width(line) for line in label.lines) + 2 * _MARGIN
        height = LINE_HEIGHT * len(label.lines)
        places = list(_places(label.at, width, height))
        costed = [place._replace(cost=place.cost + self._cost(place.box, label.within)) for place in places]
        return sorted(costed, key=lambda place: place.cost)

    def _cost(self, box: Box, within: Box) -> float:
        over = (within.left - box.left, within.top - box.top, box.right - within.right, box.bottom - within.bottom)
        outside = sum(max(0.0, one) for one in over)
        if outside > 0:
            return _OUTSIDE + outside * _COVERED
        cost = math.fsum(_overlap(box, obstacle) for obstacle in self.obstacles)
        left, top, right, bottom = box
        for (x, y), (u, v) in self.segments:
            if (x < left and u < left) or (x > right and u > right):
                continue  # most lines are far away
            if (y < top and v < top) or (y > bottom and v > bottom):
                continue
            if (part := box.clipped(((x, y), (u, v)))) is not None:
                cost += 2 + _CROSSED * math.dist(*part)
        return cost

    def document(self, size: tuple[float, float], key: str, title: str, description: str, style: str = "") -> str:
        """Return the drawing as SVG, with its name and the text that stands for it where it cannot be seen.

        `style` are rules of this kind of drawing, beside those of all.
        """
        name = "d" + sha256(key.encode("utf-8", "surrogatepass")).hexdigest()[:10]
        width, height = (_number(side) for side in size)
        body = "\n".join((*self._elements, *self._texts))
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" class="drawing" role="img" viewBox="0 0 {width} {height}" '
            f'width="{width}" height="{height}" aria-labelledby="{name}-title" aria-describedby="{name}-desc">\n'
            f'<title id="{name}-title">{xml_text(title)}</title>\n'
            f'<desc id="{name}-desc">{xml_text(description)}</desc>\n'
            f"<style>{STYLE}{style}</style>\n{body}\n</svg>\n"
        )


def _through(points: Iterable[Point]) -> str:
    """Data of a path from point to point."""
    return "M" + "L".join(f"{_number(x)} {_number(y)}" for x, y in points)


def text_width(line: str) -> float:
    """Width of a text, rather too large: whose font it will be is not known. [px]"""
    return FONT * math.fsum(
        0.36 if c in _NARROW else 0.95 if c in _WIDE else 0.74 if c.isupper() else 0.62 for c in line
    )


def _places(at: Point, width: float, height: float) -> Iterator["_Place"]:
    """Places for a label around a point; farther ones, and the left of it, cost a little."""
    for gap in _GAPS:
        for order, (x, y) in enumerate(_DIRECTIONS):
            # The nearest point of the box is `gap` away; above and below it is centred.
            left = at[0] + gap * x + (0.0 if x > 0.1 else -width if x < -0.1 else -width / 2)
            top = at[1] + gap * y + (-height / 2 if abs(y) < 0.1 else -height if y < 0 else 0.0)
            anchor = "start" if x > 0.1 else "end" if x < -0.1 else "middle"
            yield _Place(Box(left, top, left + width, top + height), anchor, _AWAY * gap + _ORDER * order)


def _chosen(options: Sequence[Sequence["_Place"]], order: Sequence[int]) -> tuple[float, dict[int, "_Place"]]:
    """Take the cheapest place for one label after the other; what it costs in all, and the places."""
    total, taken = 0.0, dict[int, _Place]()
    for index in order:
        best, least = options[index][0], math.inf
        for place in options[index]:
            if place.cost >= least:
                break  # sorted: the rest costs more
            cost = place.cost + math.fsum(_overlap(place.box, other.box) for other in taken.values())
            if cost < least:
                best, least = place, cost
        taken[index], total = best, total + least
    return total, taken


def _overlap(box: Box, other: Box) -> float:
    area = box.covered_by(other)
    return _COVERED + area if area else 0.0


def _runs(points: Sequence[Point], within: Box | None) -> Iterator[list[Point]]:
    """Pieces of a line that lie inside a box."""
    if within is None:
        yield list(points)
        return
    run: list[Point] = []
    for segment in pairwise(points):
        part = within.clipped(segment)
        if part is None or math.dist(*part) == 0:
            continue
        if run and run[-1] != part[0]:
            yield run
            run = []
        run = [*run, part[1]] if run else list(part)
    if run:
        yield run


_SUBSCRIPT = re.compile(r"([φθ])_(\w)(.*)")


def _with_subscripts(line: str) -> str:
    return _SUBSCRIPT.sub(r'\1<tspan class="sub" dy="3">\2</tspan><tspan dy="-3">\3</tspan>', xml_text(line))


def _number(value: float) -> str:
    """A coordinate to a hundredth of a pixel, without trailing zeros; never -0."""
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


_LEAST = 1e-9  # of a step: what is drawn may all be at one place
_ROOM = {"x": 46.0, "y": 26.0}  # px for a number
_INDENT = 18.0  # px left of a legend
_LETTERS = 76  # of a line of a legend
_SMALL = 0.9  # of the width of a text: a legend has a smaller font


def axis_number(value: float) -> str:
    """Number at an axis, with a minus sign."""
    return f"{value + 0.0:.6g}".replace("-", "−")


def ticks(lower: float, upper: float, step: float) -> Sequence[float]:
    """Multiples of a step from one value to another."""
    first, last = math.ceil(lower / step - 1e-9), math.floor(upper / step + 1e-9)
    return [index * step for index in range(first, last + 1)]


def round_step(least: float) -> float:
    """Smallest of 1, 2, 5 times a power of ten that is not below a value."""
    least = max(least, _LEAST)
    power = 10.0 ** math.floor(math.log10(least))
    return next(factor * power for factor in (1, 2, 5, 10) if factor * power >= least * (1 - 1e-9))


class Scale(NamedTuple):
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
        size, (low, high) = abs(self.end - self.start), sorted((self.low, self.high))
        if not self.is_log:
            return ticks(low, high, round_step((high - low) * room / size))
        powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
        for factors in ((1, 2, 5), (1, 3), (1,)):
            values = [factor * 10.0**power for power in powers for factor in factors]
            found = [value for value in values if low * (1 - 1e-9) <= value <= high * (1 + 1e-9)]
            if all(abs(self.at(b) - self.at(a)) >= room for a, b in pairwise(found)):
                break
        return found


def short(word: str, room: float) -> str:
    """A word that has room, with an end that says that it is longer. [px]"""
    text = printable(word)
    while text_width(text) > room and len(text) > 2:
        text = f"{text[:-2].rstrip('…')}…"
    return text


def head(canvas: Canvas, lines: Sequence[str]) -> float:
    """Write lines above a drawing that stands alone, its name first; returns where the drawing begins. [px]"""
    for place, line in enumerate(lines):
        canvas.text((8, 18 + place * LINE_HEIGHT), [line], "small" if place else "name")
    return 16 + len(lines) * LINE_HEIGHT if lines else 10.0


def x_axis(canvas: Canvas, frame: Box, scale: Scale, label: str, words: Sequence[str] = ()) -> float:
    """Write numbers or words below a frame, and what they are; returns where they end. [px]"""
    bottom = frame.bottom
    room = (frame.right - frame.left) / max(len(words), 1)
    if any(text_width(word) > room - 4 for word in words):
        names = [short(word, 120.0) for word in words]
        for place, name in enumerate(names):
            canvas.upright_text((scale.at(place) + 4, bottom + 6 + text_width(name) / 2), name, "axis")
        bottom += max(map(text_width, names)) - 8
    else:
        for place, word in enumerate(words):
            canvas.text((scale.at(place), bottom + 14), [printable(word)], "axis", "middle")
    for value in () if words else scale.ticks(_ROOM["x"]):
        x = scale.at(value)
        canvas.lines([((x, bottom), (x, bottom + 4))], "thin")
        canvas.text((x, bottom + 15), [axis_number(value)], "axis", "middle")
    canvas.text((frame.middle[0], bottom + 31), [label], "small", "middle")
    return bottom + 31


def y_axis(canvas: Canvas, frame: Box, scale: Scale, label: str, words: Sequence[str] = ()) -> None:
    """Write numbers or words left of a frame, and what they are."""
    for place, word in enumerate(words):
        canvas.text((frame.left - 6, scale.at(place) + 4), [short(word, frame.left - 24)], "axis", "end")
    for value in () if words else scale.ticks(_ROOM["y"]):
        y = scale.at(value)
        canvas.lines([((frame.left - 4, y), (frame.left, y))], "thin")
        canvas.text((frame.left - 7, y + 3.5), [axis_number(value)], "axis", "end")
    label = short(label, 1.3 * (frame.bottom - frame.top))
    canvas.upright_text((12, frame.middle[1]), label, "small")


def outline(canvas: Canvas, frame: Box, style: str) -> None:
    """Draw the edges of a rectangle."""
    left, top, right, bottom = frame
    canvas.polygon([(left, top), (right, top), (right, bottom), (left, bottom)], style, is_obstacle=False)


def grid(canvas: Canvas, frame: Box, across: Scale | None, up: Scale | None) -> None:
    """Draw lines at the ticks of one scale or both."""
    if across is not None:
        canvas.lines([frame.upright(across.at(value)) for value in across.ticks(_ROOM["x"])], "grid")
    if up is not None:
        canvas.lines([frame.level(up.at(value)) for value in up.ticks(_ROOM["y"])], "grid")


class LegendLine(NamedTuple):
    """One entry of a legend: its words, and how its mark is drawn from the left middle of 25 px."""

    words: str
    mark: Callable[[Point], None]


def line_entry(canvas: Canvas, words: str, style: str) -> LegendLine:
    """Entry for a line of some style."""
    return LegendLine(words, lambda at: canvas.lines([(at, (at[0] + 25, at[1]))], style))


def circle_entry(canvas: Canvas, words: str, radius: float, style: str) -> LegendLine:
    """Entry for a circle of some style. [px]"""
    return LegendLine(words, lambda at: canvas.circle((at[0] + 13, at[1]), radius, style))


def box_entry(canvas: Canvas, words: str, *styles: str) -> LegendLine:
    """Entry for a rectangle of some styles, one over the other."""

    def mark(at: Point) -> None:
        for style in styles:
            canvas.boxes([Box(at[0] + 4, at[1] - 5, at[0] + 22, at[1] + 5)], style)

    return LegendLine(words, mark)


def legend(canvas: Canvas, top: float, width: float, entries: Sequence[LegendLine]) -> float:
    """Write entries in lines below a drawing; returns where they end. [px]"""
    x, y = _INDENT, top + 20
    for entry in entries:
        lines = wrap(printable(entry.words), _LETTERS, max_lines=3, placeholder=" …")
        room = 44 + _SMALL * max(map(text_width, lines))
        if x + room > width and x > _INDENT:
            x, y = _INDENT, y + LINE_HEIGHT + 3
        entry.mark((x, y - 4))
        for place, line in enumerate(lines):
            y += LINE_HEIGHT if place else 0
            canvas.text((x + 31, y), [line], "small")
        x += room
    return y + 6


EMPTY = "reserve"  # colour of what is no mission


@cache
def colours() -> tuple[Mapping[str, str], Mapping[str, str]]:
    """Colours of the page by name, on white paper and on a dark screen."""
    sheet = resource("templates", "report.css").read_text(encoding="utf-8")
    blocks = sheet.split("}", 2)[:2]
    light, dark = (dict(re.findall(r"--([\w-]+): (#[0-9a-f]{3,6})", block)) for block in blocks)
    return light, dark


def style_sheet(rules: Iterable[str], tones: Iterable[str]) -> str:
    """Rules of one kind of drawing, with colours that a drawing has on a dark screen if it is a file of its own."""
    _, dark = colours()
    scoped = "".join(f"svg.drawing {rule}" for rule in rules)
    own = ";".join(f"--{tone}:{dark[tone]}" for tone in dict.fromkeys(tones))
    return f"{scoped}@media (prefers-color-scheme:dark){{svg:root.drawing{{{own}}}}}" if own else scoped


def has_no_mission(status: str) -> bool:
    """Whether a status says that there was nothing to check."""
    return STATUS[status].junit == "error"


def tone_of(status: str) -> str:
    """Name of the colour of a status."""
    return EMPTY if has_no_mission(status) else STATUS[status].color


def status_words(status: str) -> str:
    """The words of a legend for a status."""
    return "no such mission" if has_no_mission(status) else STATUS[status].words


def marks_within_colours(statuses: Sequence[str], marks: Sequence[Mark]) -> Mapping[str, Mark]:
    """A mark for each status: of those that share a colour the first, the worst, has the first of `marks`."""
    tones = [tone_of(name) for name in statuses]
    places = (tones[:place].count(tone) for place, tone in enumerate(tones))
    return {name: marks[min(place, len(marks) - 1)] for name, place in zip(statuses, places, strict=True)}
