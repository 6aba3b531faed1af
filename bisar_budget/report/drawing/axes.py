"""Axes of a drawing: scales with their ticks, a frame with its numbers, and a legend below it."""

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from textwrap import wrap
from typing import NamedTuple

from bisar_budget.faults import printable
from bisar_budget.report.drawing.svg import LINE_HEIGHT, Box, Canvas, Point, text_width

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
    canvas.text(((frame.left + frame.right) / 2, bottom + 31), [label], "small", "middle")
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
    canvas.upright_text((12, (frame.top + frame.bottom) / 2), label, "small")


def outline(canvas: Canvas, frame: Box, style: str) -> None:
    """Draw the edges of a rectangle."""
    left, top, right, bottom = frame
    canvas.polygon([(left, top), (right, top), (right, bottom), (left, bottom)], style, is_obstacle=False)


def grid(canvas: Canvas, frame: Box, across: Scale | None, up: Scale | None) -> None:
    """Draw lines at the ticks of one scale or both."""
    if across is not None:
        places = [across.at(value) for value in across.ticks(_ROOM["x"])]
        canvas.lines([((x, frame.top), (x, frame.bottom)) for x in places], "grid")
    if up is not None:
        places = [up.at(value) for value in up.ticks(_ROOM["y"])]
        canvas.lines([((frame.left, y), (frame.right, y)) for y in places], "grid")


class LegendLine(NamedTuple):
    """One entry of a legend: its words, and how its mark is drawn from the left middle of 25 px."""

    words: str
    mark: Callable[[Point], None]


def line_entry(canvas: Canvas, words: str, style: str) -> LegendLine:
    """LegendLine of a line of some style."""
    return LegendLine(words, lambda at: canvas.lines([(at, (at[0] + 25, at[1]))], style))


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
