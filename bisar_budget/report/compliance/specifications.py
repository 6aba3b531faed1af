"""Specifications that hold together, as blocks of a report: on a sheet of their own, or in the annex of a check."""

import math
from collections.abc import Iterator

from bisar_budget.design.offers import OfferedFigure
from bisar_budget.findings.requirement import NAMES
from bisar_budget.findings.specification import Broken, Specification, SpecificationSheet
from bisar_budget.report.compliance import document as doc
from bisar_budget.report.drawing.share_bars import LIMITS, limiting, share_bars
from bisar_budget.report.words.sentences import percent

_LISTED = 3  # parts of the catalogue that a table names


def specified(sheet: SpecificationSheet, anchor: str) -> Iterator[doc.Block]:
    """The specifications with their shares, and a drawing of what uses up each limit; or why there are none."""
    if sheet.broken:
        heads = [*doc.heads("Row"), *doc.numbers("Used", "May use"), *doc.heads("")]
        rows: list[doc.Line] = [[doc.Name(name), *cells] for name, *cells in map(broken_words, sheet.broken)]
        yield doc.TextTable("Rows without room", "Rows in which other errors leave no room", heads, rows)
        yield doc.Paragraph(way_out(sheet))
        return
    yield from _table(sheet)
    if limiting(sheet):
        yield doc.Figure(f"{anchor}-shares.svg", anchor, "What uses up each limit", "Shares", share_bars(sheet))
    if texts := list(remarks(sheet)):
        yield doc.Items([[text] for text in texts])


def _table(sheet: SpecificationSheet) -> Iterator[doc.Block]:
    keys = [key for key in NAMES if any(key in one.shares for one in sheet.specifications)]
    heads = [
        *doc.numbers("No."),
        *doc.heads("Specification"),
        *doc.numbers("Ordered", "Found", "Today", *(f"Of {NAMES[key]}" for key in keys)),
        *doc.heads("Parts"),
    ]
    rows: list[doc.Line] = []
    for number, one in enumerate(sheet.specifications, 1):
        shares = [percent(one.shares[key]) if one.shares.get(key, 0.0) > LIMITS else "–" for key in keys]
        cells = [
            one.text or "free",
            one.found_text or "–",
            one.declared_text or "–",
            *shares,
            parts_words(one) or "–",
        ]
        rows.append([str(number), doc.Name(one.key), *cells])
    caption = "Specifications, rounded down to two digits; shares are those of what a limit may use."
    yield doc.TextTable("Specifications", caption, heads, rows)


def parts_words(one: Specification) -> str:
    """Some of the parts of the catalogue that keep to a specification."""
    more = f" and {len(one.parts) - _LISTED} more" if len(one.parts) > _LISTED else ""
    return f"{', '.join(one.parts[:_LISTED])}{more}"


def broken_words(one: Broken) -> list[str]:
    """Cells of a row in which there is no room."""
    if one.used is None:
        return [one.id, "-", percent(one.allowed), "over its limit: they leave no image"]
    over = "over its limit" if one.used > 1 else "within its limit, but not with the reserve"
    return [one.id, percent(one.used), percent(one.allowed), over]


def way_out(sheet: SpecificationSheet) -> str:
    """What can be done where other errors leave no room."""
    used = [math.inf if one.used is None else one.used for one in sheet.broken]
    if max(used) <= 1:
        least = 1 - max(used)
        return (
            f"The other errors use that much by themselves. A smaller --reserve, below {percent(least)}, leaves room."
        )
    return "The other errors, which are fixed, use that much by themselves: make them smaller, or specify them too."


def remarks(sheet: SpecificationSheet) -> Iterator[str]:
    """What a reader of a sheet should know of it."""
    for row in limiting(sheet):
        if row.requirement is None and row.id.startswith("negligible"):
            effect = row.id.partition(".")[2]
            yield f"{effect.capitalize()} phase is kept negligible, since no requirement takes it: that limits sizes."
        elif row.requirement is None:
            by = "where the image ends" if row.id.startswith("end") else "what a mission file may state"
            yield f"{row.id.partition('.')[2]} is limited by {by}."
    for one in sheet.specifications:
        if one.remark:
            yield f"{one.key} {one.text}: {one.remark}."
    yield from (f"{note[0].upper()}{note[1:]}." for note in sheet.notes)


def side(figure: OfferedFigure) -> str:
    """On which side of a specification a figure is."""
    if figure.is_inside is None:
        return figure.remark
    return "inside" if figure.is_inside else "OUTSIDE"
