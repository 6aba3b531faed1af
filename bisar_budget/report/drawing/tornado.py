"""Draw a tornado diagram: the effect of each number of a mission file on the worst utilization, largest at the top.

Each bar shows the effect of a change of 1 %. Depending on the kind of number, this is 1 % of the number itself, 1 %
of a radian, 1 % of a power ratio (for a level in dB), or 1 % of the smaller slant range.
"""

from bisar_budget.faults import changes_words, printable
from bisar_budget.findings.slopes import COMPARED_CHANGE_FRACTION, Sensitivity, Slope
from bisar_budget.report.drawing import svg
from bisar_budget.report.words.key_names import in_words, key_beside
from bisar_budget.report.words.sentences import percent

MAX_BAR_COUNT = 20
_TORNADO_WIDTH_PX, _TORNADO_EDGE_PX = 860.0, 12.0  # width of the drawing, and of the margin at its right
_MAX_NAME_WIDTH_PX = 580.0  # of the names of numbers
_BOLD_RATIO = 0.86  # width of a plain text, relative to the same text in bold
_TORNADO_ROW_PX, _HALF_BAR_PX = 28.0, 8.0  # height of a row, and half the height of its bar
_TORNADO_STYLE = (
    "svg.drawing .worse{fill:var(--receiver,#a8471a)}svg.drawing .better{fill:var(--transmitter,#1f5fa8)}"
    "svg.drawing .bar{fill:var(--muted,#595f66)}svg.drawing .pale{fill-opacity:.4}"
)
_TONES = {"worse": "rises", "better": "falls"}
_BAR_STYLES = {"larger": "", "smaller": " pale"}  # style of a bar by the change of its number


def tornado(sensitivity: Sensitivity) -> str:
    """Draw the numbers of a mission file with the largest effects as SVG.

    A strong bar shows the effect of increasing a number, a pale bar the effect of decreasing it. Both effects are
    computed from the same slope.
    """
    canvas = svg.Canvas()
    shown = sensitivity.shown[:MAX_BAR_COUNT]
    name = printable(f"{sensitivity.name} {changes_words(sensitivity.changes)}".rstrip())
    row = sensitivity.row or sensitivity.worst_row
    subject = printable(f"{'row' if sensitivity.row else 'worst row'}: {in_words(row)} ({row})")
    top = svg.head(
        canvas,
        [
            svg.short(name, _BOLD_RATIO * _TORNADO_WIDTH_PX),
            subject,
            f"change of its utilization, now {percent(sensitivity.asked)}, for the stated change of one number",
        ],
    )
    labels = [svg.short(_label(slope), 1.1 * _MAX_NAME_WIDTH_PX) for slope in shown]
    keys = [svg.short(key_beside(slope.key), 1.3 * _MAX_NAME_WIDTH_PX) for slope in shown]
    widths = [
        max(0.9 * svg.text_width(label), svg.KEY_FONT_RATIO * svg.text_width(key))
        for label, key in zip(labels, keys, strict=True)
    ]
    left = min(max(widths, default=0.0) + 16, _MAX_NAME_WIDTH_PX)
    frame = svg.Box(left, top, _TORNADO_WIDTH_PX - _TORNADO_EDGE_PX, top + _TORNADO_ROW_PX * max(len(shown), 1))
    reach = 105 * max((abs(slope.even_effect) for slope in shown), default=0.0) or 1.0
    along = svg.Scale(-reach, reach, frame.left, frame.right)
    svg.grid(canvas, frame, along, None)
    zero, middle = along.at(0.0), top + _TORNADO_ROW_PX / 2 + 4
    for index, (slope, label, key) in enumerate(zip(shown, labels, keys, strict=True)):
        y, change = top + _TORNADO_ROW_PX * (index + 0.5), 100 * slope.even_effect
        for direction, value in (("larger", change), ("smaller", -change)):
            start, end = sorted((zero, along.at(value)))
            bar = svg.Box(start, y - _HALF_BAR_PX, end, y + _HALF_BAR_PX)
            canvas.boxes([bar], ("worse" if value > 0 else "better") + _BAR_STYLES[direction])
        canvas.text((frame.left - 6, y), [label], "axis", "end")
        canvas.text((frame.left - 6, y + 10), [key], "key", "end")
    canvas.lines([frame.upright(zero)], "line")
    if not shown:
        canvas.text((zero, middle), ["no number changes it"], "", "middle")
    bottom = svg.x_axis(canvas, frame, along, "change of the utilization [percentage points]")
    entries = [
        svg.box_entry(canvas, f"the number is {direction}", f"bar{style}") for direction, style in _BAR_STYLES.items()
    ]
    entries += [svg.box_entry(canvas, f"utilization {change}", tone) for tone, change in _TONES.items()]
    if any(slope.is_mixed for slope in shown):
        entries.append(svg.LegendLine("*: two rows are the worst, one on each side", lambda at: None))
    bottom = svg.legend(canvas, bottom, _TORNADO_WIDTH_PX, entries)
    return canvas.document(
        (_TORNADO_WIDTH_PX, bottom + 4),
        f"tornado {sensitivity.name}",
        f"Sensitivity: {name}",
        subject,
        _TORNADO_STYLE,
    )


def _label(slope: Slope) -> str:
    mark = " *" if slope.is_mixed else ""
    return f"{printable(in_words(slope.key))} = {printable(slope.given)} ± {_even(slope)}{mark}"


def _even(slope: Slope) -> str:
    """Text with the size and unit of the change to which a bar refers, such as `1 %`."""
    if slope.measure == COMPARED_CHANGE_FRACTION:
        return slope.per_text
    size, _, unit = slope.per_text.partition(" ")
    return f"{float(size) * COMPARED_CHANGE_FRACTION / slope.measure:.2g} {unit}"
