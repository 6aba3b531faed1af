"""Draw stacked bars that show which fraction of a row's limit each error uses.

The errors are labelled with their numbers in the specification sheet.
"""

from bisar_budget.faults import printable
from bisar_budget.findings.requirement import REQUIREMENT_NAMES
from bisar_budget.findings.specification import RowUse, SpecificationSheet
from bisar_budget.report.drawing import svg
from bisar_budget.report.words.key_names import in_words, key_beside
from bisar_budget.report.words.sentences import percent

_SHARES_WIDTH_PX = 860.0  # of the drawing
_NAMES_PX, _SHARES_EDGE_PX = 250.0, 16.0  # beside the bars: for the names of rows, and at the right
_SHARES_ROW_PX, _BAR_PX = 34.0, 20.0  # height of a row, and of its bar
_MIN_NUMBERED_PX = 13.0  # width of a segment with room for a number
LEAST_WEIGHT_FRACTION = 1e-4  # a row with a smaller multiplier, relative to the weights, is not limiting
_TONE_COUNT = 5
_SHARES_STYLE = (
    "svg.drawing .fixed{fill:var(--muted,#595f66)}"
    "svg.drawing .t0{fill:var(--transmitter,#1f5fa8)}svg.drawing .t1{fill:var(--receiver,#a8471a)}"
    "svg.drawing .t2{fill:var(--transmitter,#1f5fa8);fill-opacity:.55}"
    "svg.drawing .t3{fill:var(--receiver,#a8471a);fill-opacity:.55}"
    "svg.drawing .t4{fill:var(--muted,#595f66);fill-opacity:.5}"
    "svg.drawing .track{fill:var(--grid,#e2e5e9)}"
)


def limiting(sheet: SpecificationSheet) -> list[RowUse]:
    """Rows of a specification sheet that limit at least one specification, in the order of their requirements."""
    rows = [row for row in sheet.rows if row.multiplier > LEAST_WEIGHT_FRACTION]
    order = [*REQUIREMENT_NAMES, None]
    return sorted(rows, key=lambda row: order.index(row.requirement))


def share_bars(sheet: SpecificationSheet) -> str:
    """Draw a stacked bar as SVG for each row that limits a specification.

    Each part of a bar shows the fraction of the row's limit that one error uses.
    """
    canvas = svg.Canvas()
    keys = [spec.key for spec in sheet.specifications]
    rule = "squares add up" if sheet.combine == "rss" else "sizes add up"
    top = svg.head(
        canvas, [svg.short(printable(sheet.name), _SHARES_WIDTH_PX), f"share of each error in a limit; {rule}"]
    )
    rows = limiting(sheet)
    frame = svg.Box(_NAMES_PX, top, _SHARES_WIDTH_PX - _SHARES_EDGE_PX, top + _SHARES_ROW_PX * max(len(rows), 1))
    along = svg.Scale(0, 100, frame.left, frame.right)
    svg.grid(canvas, frame, along, None)
    for index, row in enumerate(rows):
        middle = top + _SHARES_ROW_PX * (index + 0.5)
        canvas.boxes([svg.Box(frame.left, middle - _BAR_PX / 2, frame.right, middle + _BAR_PX / 2)], "track")
        start = 0.0
        for name, share in [("fixed", row.fixed), *row.shares.items()]:
            end = min(start + 100 * share, 100.0)
            box = svg.Box(along.at(start), middle - _BAR_PX / 2, along.at(end), middle + _BAR_PX / 2)
            if box.right - box.left > 0.5:
                number = 0 if name == "fixed" else keys.index(name) + 1
                canvas.boxes([box], "fixed" if not number else f"t{(number - 1) % _TONE_COUNT}")
                canvas.lines([box.upright(box.right)], "grid")
                if box.right - box.left >= _MIN_NUMBERED_PX:
                    label = str(number) if number else "fixed" if box.right - box.left > 40 else ""
                    canvas.text((box.middle[0], middle + 4), [label], "", "middle")
            start = end
        canvas.text((frame.left - 8, middle), [svg.short(in_words(row.id), _NAMES_PX - 16)], "axis", "end")
        canvas.text((frame.left - 8, middle + 11), [svg.short(key_beside(row.id), 1.3 * _NAMES_PX)], "key", "end")
    if not rows:
        canvas.text((frame.middle[0], top + _SHARES_ROW_PX / 2 + 4), ["no limiting row"], "", "middle")
    bottom = svg.x_axis(canvas, frame, along, "share of the usable part of the limit [%]")
    for number, spec in enumerate(sheet.specifications, 1):
        if any(spec.key in row.shares for row in rows):
            bottom += svg.LINE_PX
            text = f"{number}  {printable(in_words(spec.key))}: {printable(spec.text)}"
            text = svg.short(text, _SHARES_WIDTH_PX - 2 * _SHARES_EDGE_PX)
            canvas.text((_SHARES_EDGE_PX, bottom), [text], "axis")
            after = _SHARES_EDGE_PX + 0.8 * svg.text_width(text) + 14
            canvas.text((after, bottom), [printable(key_beside(spec.key))], "key")
    if any(row.fixed for row in rows):
        bottom += svg.LINE_PX
        canvas.text((_SHARES_EDGE_PX, bottom), ["fixed: errors that this sheet does not specify"], "axis")
    description = "; ".join(f"{printable(in_words(row.id))} uses {percent(row.used)}" for row in rows)
    title = f"Shares of the limits: {printable(sheet.name)}"
    return canvas.document((_SHARES_WIDTH_PX, bottom + 12), f"shares {sheet.name}", title, description, _SHARES_STYLE)
