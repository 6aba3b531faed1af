"""Effects of each number of a mission on its worst utilization, as bars to both sides, the largest above.

All bars are for the same part: 1 % of a number, of a radian, of a power, of the smaller slant range.
"""

from bisar_budget.design.sensitivity import EVEN, Sensitivity, Slope
from bisar_budget.faults import changes_words, printable
from bisar_budget.report.drawing import svg
from bisar_budget.report.words.sentences import percent

MOST = 20  # bars
_WIDTH, _EDGE, _MOST_LEFT = 860.0, 12.0, 580.0  # px, of the drawing, at its right, for the names of numbers
_BOLD = 0.86  # width of a text over that of a bold one
_ROW, _HALF = 22.0, 8.0  # px for a number, half of its bar
_STYLE = (
    "svg.drawing .worse{fill:var(--receiver,#a8471a)}svg.drawing .better{fill:var(--transmitter,#1f5fa8)}"
    "svg.drawing .bar{fill:var(--muted,#595f66)}svg.drawing .pale{fill-opacity:.4}"
)
_PARTS = {"larger": "", "smaller": " pale"}  # what a number becomes, and how its bar is drawn


def tornado(found: Sensitivity) -> str:
    """Draw the numbers with the largest effects as SVG.

    Strong is what a larger number does, pale what a smaller one does; both are the same slope.
    """
    canvas = svg.Canvas()
    shown = found.shown[:MOST]
    name = printable(f"{found.name} {changes_words(found.changes)}".rstrip())
    what = printable(f"row {found.row}" if found.row else f"worst utilization: {found.worst_row}")
    top = svg.head(
        canvas, [svg.short(name, _BOLD * _WIDTH), what, f"change of the utilization, {percent(found.asked)} now"]
    )
    labels = [svg.short(_label(slope), 1.1 * _MOST_LEFT) for slope in shown]
    left = min(0.9 * max(map(svg.text_width, labels), default=0.0) + 16, _MOST_LEFT)
    frame = svg.Box(left, top, _WIDTH - _EDGE, top + _ROW * max(len(shown), 1))
    reach = 105 * max((abs(slope.even_effect) for slope in shown), default=0.0) or 1.0
    along = svg.Scale(-reach, reach, frame.left, frame.right)
    svg.grid(canvas, frame, along, None)
    zero, middle = along.at(0.0), top + _ROW / 2 + 4
    for place, (slope, label) in enumerate(zip(shown, labels, strict=True)):
        y, change = top + _ROW * (place + 0.5), 100 * slope.even_effect
        for part, value in (("larger", change), ("smaller", -change)):
            start, end = sorted((zero, along.at(value)))
            bar = svg.Box(start, y - _HALF, end, y + _HALF)
            canvas.boxes([bar], ("worse" if value > 0 else "better") + _PARTS[part])
        canvas.text((frame.left - 6, y + 4), [label], "axis", "end")
    canvas.lines([frame.upright(zero)], "line")
    if not shown:
        canvas.text((zero, middle), ["no number changes it"], "", "middle")
    bottom = svg.x_axis(canvas, frame, along, "percentage points")
    entries = [svg.box_entry(canvas, f"the number is {part}", f"bar{style}") for part, style in _PARTS.items()]
    bottom = svg.legend(canvas, bottom, _WIDTH, entries)
    return canvas.document((_WIDTH, bottom + 4), f"tornado {found.name}", f"Sensitivity: {name}", what, _STYLE)


def _label(slope: Slope) -> str:
    mark = " *" if slope.is_mixed else ""
    return f"{printable(slope.key)} = {printable(slope.given)}, {_even(slope)}{mark}"


def _even(slope: Slope) -> str:
    """Write the change that its bar is for."""
    if slope.measure == EVEN:
        return slope.per_text
    size, _, unit = slope.per_text.partition(" ")
    return f"{float(size) * EVEN / slope.measure:.2g} {unit}"
