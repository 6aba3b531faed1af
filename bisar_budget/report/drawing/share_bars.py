"""Shares of every row that limits a specification, as stacked bars: errors by their numbers on the sheet."""

from bisar_budget.faults import printable
from bisar_budget.findings.requirement import NAMES
from bisar_budget.findings.specification import RowUse, SpecificationSheet
from bisar_budget.report.drawing import svg
from bisar_budget.report.words.sentences import percent

_WIDTH, _LEFT, _EDGE = 860.0, 250.0, 16.0  # px, of the drawing, of the names of rows, at the right
_ROW, _BAR = 34.0, 20.0  # px for a row, of its bar
_LEAST = 13.0  # px of a part that a number fits into
LIMITS = 1e-4  # of the weights: what a row is worth that limits a specification
_TONES = 5
_STYLE = (
    "svg.drawing .fixed{fill:var(--muted,#595f66)}"
    "svg.drawing .t0{fill:var(--transmitter,#1f5fa8)}svg.drawing .t1{fill:var(--receiver,#a8471a)}"
    "svg.drawing .t2{fill:var(--transmitter,#1f5fa8);fill-opacity:.55}"
    "svg.drawing .t3{fill:var(--receiver,#a8471a);fill-opacity:.55}"
    "svg.drawing .t4{fill:var(--muted,#595f66);fill-opacity:.5}"
    "svg.drawing .track{fill:var(--grid,#e2e5e9)}"
)


def limiting(sheet: SpecificationSheet) -> list[RowUse]:
    """Rows that limit a specification, each requirement's together."""
    rows = [row for row in sheet.rows if row.multiplier > LIMITS]
    order = [*NAMES, None]
    return sorted(rows, key=lambda row: order.index(row.requirement))


def share_bars(sheet: SpecificationSheet) -> str:
    """Draw the bars as SVG: parts of the power, or of the sum, of what each row may use."""
    canvas = svg.Canvas()
    keys = [one.key for one in sheet.specifications]
    what = "squares add up" if sheet.combine == "rss" else "sizes add up"
    top = svg.head(canvas, [svg.short(printable(sheet.name), _WIDTH), f"what each error takes of a limit; {what}"])
    rows = limiting(sheet)
    frame = svg.Box(_LEFT, top, _WIDTH - _EDGE, top + _ROW * max(len(rows), 1))
    along = svg.Scale(0, 100, frame.left, frame.right)
    svg.grid(canvas, frame, along, None)
    for place, row in enumerate(rows):
        middle = top + _ROW * (place + 0.5)
        canvas.boxes([svg.Box(frame.left, middle - _BAR / 2, frame.right, middle + _BAR / 2)], "track")
        start = 0.0
        for name, part in [("fixed", row.fixed), *row.shares.items()]:
            end = min(start + 100 * part, 100.0)
            box = svg.Box(along.at(start), middle - _BAR / 2, along.at(end), middle + _BAR / 2)
            if box.right - box.left > 0.5:
                number = 0 if name == "fixed" else keys.index(name) + 1
                canvas.boxes([box], "fixed" if not number else f"t{(number - 1) % _TONES}")
                canvas.lines([box.upright(box.right)], "grid")
                if box.right - box.left >= _LEAST:
                    said = str(number) if number else "fixed" if box.right - box.left > 40 else ""
                    canvas.text((box.middle[0], middle + 4), [said], "", "middle")
            start = end
        canvas.text((frame.left - 8, middle + 4), [svg.short(_name(row), _LEFT - 16)], "axis", "end")
    if not rows:
        canvas.text((frame.middle[0], top + _ROW / 2 + 4), ["no row limits anything"], "", "middle")
    bottom = svg.x_axis(canvas, frame, along, "part of what the row may use [%]")
    for number, one in enumerate(sheet.specifications, 1):
        if any(one.key in row.shares for row in rows):
            bottom += svg.LINE_HEIGHT
            text = f"{number}  {printable(one.key)}: {printable(one.text)}"
            canvas.text((_EDGE, bottom), [svg.short(text, _WIDTH - 2 * _EDGE)], "axis")
    told = "; ".join(f"{_name(row)} uses {percent(row.used)}" for row in rows)
    title = f"Shares of the limits: {printable(sheet.name)}"
    return canvas.document((_WIDTH, bottom + 12), f"shares {sheet.name}", title, told, _STYLE)


def _name(row: RowUse) -> str:
    return printable(row.id.replace("_", " "))
