"""The sheet of specifications: `allocate/1`, CSV, text for a terminal, Markdown and HTML for whoever buys."""

import csv
import io
import json
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from bisar_budget.design.allocate import Broken, Specification, SpecificationSheet
from bisar_budget.design.offers import Offer
from bisar_budget.faults import changes_words, printable
from bisar_budget.findings.requirement import NAMES
from bisar_budget.findings.status import STATUS
from bisar_budget.report import Style
from bisar_budget.report.compliance import document as doc
from bisar_budget.report.drawing.share_bars import LIMITS, limiting, share_bars
from bisar_budget.report.formats.text_table import requirement_table
from bisar_budget.report.words.requirements import overrides_lines, overrides_words, requirement_lines
from bisar_budget.report.words.sentences import counted, percent, table, wrapped

_FORMAT = "bisar-budget/allocate/1"
_LISTED = 3  # parts of the catalogue that a table names
_COLUMNS = ("file", "key", "value", "ordered", "unit", "text", "declared", "weight", "parts")


class Answer(NamedTuple):
    """A sheet, and the offer that is held to it, if any."""

    sheet: SpecificationSheet
    offer: Offer | None = None


# ---------------------------------------------------------------- for programs
def as_json(version: str, answers: Sequence[Answer]) -> str:
    """Write the contract; values in SI, null where there is none."""
    document = {"format": _FORMAT, "version": version, "missions": [_document(one) for one in answers]}
    return json.dumps(document, indent=2, allow_nan=False) + "\n"


def _document(answer: Answer) -> dict[str, Any]:
    sheet, offer = answer
    return {
        "file": sheet.file,
        "name": sheet.name,
        "set": [change._asdict() for change in sheet.changes],
        "overrides": [one._asdict() for one in sheet.overrides],
        "status": sheet.status,
        "complies": sheet.complies,
        "model": sheet.model,
        "combine": sheet.combine,
        "reserve": sheet.reserve,
        "requirements": [
            {
                "key": one.key,
                "value": one.value,
                "unit": one.unit,
                "used": one.utilization,
                "status": one.status,
                "row": one.row,
                "reason": str(one.reason) if one.reason else None,
            }
            for one in sheet.requirements
        ],
        "specifications": [
            {
                "key": one.key,
                "weight": one.weight,
                "value": one.value,
                "ordered": one.ordered,
                "unit": one.unit,
                "text": one.text or None,
                "shares": dict(one.shares),
                "declared": one.declared,
                "parts": list(one.parts),
            }
            for one in sheet.specifications
        ],
        "rows": [
            {
                "id": row.id,
                "requirement": row.requirement,
                "used": row.used,
                "allowed": row.allowed,
                "fixed": row.fixed,
                "shares": dict(row.shares),
                "multiplier": row.multiplier,
            }
            for row in sheet.rows
        ],
        "broken": [one._asdict() for one in sheet.broken],
        "notes": list(sheet.notes),
        "offer": None if offer is None else _offer(offer),
    }


def _offer(offer: Offer) -> dict[str, Any]:
    return {
        "file": offer.file,
        "status": offer.status,
        "complies": offer.complies,
        "figures": [figure._asdict() for figure in offer.figures],
    }


def as_csv(answers: Sequence[Answer]) -> str:
    """Write a line for each specification, values in SI; what each takes of a requirement stands behind the rest."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    shares = [key for key in NAMES if any(key in one.shares for sheet, _ in answers for one in sheet.specifications)]
    writer.writerow([*_COLUMNS, *(f"share of {key}" for key in shares)])
    for sheet, _ in answers:
        for one in sheet.specifications:
            numbers = ["" if value is None else repr(value) for value in (one.value, one.ordered)]
            declared = "" if one.declared is None else repr(one.declared)
            line = [printable(sheet.file), printable(one.key), *numbers, one.unit, one.text, declared]
            parts = [f"{one.shares.get(key, 0.0):.6g}" for key in shares]
            writer.writerow([*line, repr(one.weight), " ".join(one.parts), *parts])
    return out.getvalue()


# ---------------------------------------------------------------- for a terminal
def as_text(answers: Sequence[Answer], style: Style) -> str:
    """Write each sheet as lines for a person."""
    return "\n\n".join("\n".join(_lines(one, style)) for one in answers) + "\n"


def _lines(answer: Answer, style: Style) -> Iterator[str]:
    sheet, offer = answer
    first, *rest = wrapped(_verdict(sheet), "  ")
    sgr = "32" if sheet.complies else "1;31"
    yield f"\x1b[{sgr}m{first}\x1b[0m" if style.color else first
    yield from rest
    changed = f" {changes_words(sheet.changes)}" if sheet.changes else ""
    yield from wrapped(f"{printable(sheet.file)}{changed}, {printable(sheet.name)}; {_terms(sheet)}", "  ")
    yield from overrides_lines(sheet)
    yield ""
    if sheet.broken:
        yield from table([["row", "used", "may use", ""], *(_broken(one) for one in sheet.broken)])
        yield ""
        yield from wrapped(_way_out(sheet), "")
        return
    yield from table([["specification", "ordered", "today", "largest share"], *map(_line, sheet.specifications)])
    yield ""
    if sheet.findings is not None:
        yield from requirement_table(sheet.findings, style)
        yield ""
    keeping = [f"Parts that keep to {one.key}: {_parts(one)}." for one in sheet.specifications if one.parts]
    for text in [*_remarks(sheet), *keeping]:
        yield from wrapped(text, "  ")
    if offer is not None:
        yield ""
        yield from wrapped(_offered(offer), "  ")
        head = ["figure", "offered", "ordered", ""]
        lines = [[one.key, one.text or "-", one.ordered or "free", _side(one.is_inside)] for one in offer.figures]
        yield from table([head, *lines])


def _verdict(sheet: SpecificationSheet) -> str:
    if sheet.broken:
        return "no specification can be found: other errors leave no room"
    number = sum(one.value is not None for one in sheet.specifications)
    count = counted(number, "specification")
    stands = STATUS[sheet.status].text if sheet.status in STATUS else sheet.status
    if not sheet.complies:
        return f"{count}, but the mission does not comply with them: {stands}"
    return f"{count} that meet{'s' if number == 1 else ''} every requirement together: check says {stands}"


def _terms(sheet: SpecificationSheet) -> str:
    how = "root-sum-square" if sheet.combine == "rss" else "sum of all at their worst"
    return f"{sheet.model} model, {how}, {percent(sheet.reserve)} of each limit in reserve"


def _broken(one: Broken) -> list[str]:
    over = "over its limit" if one.used > 1 else "within its limit, but not with the reserve"
    return [one.id, percent(one.used), percent(one.allowed), over]


def _way_out(sheet: SpecificationSheet) -> str:
    if all(one.used <= 1 for one in sheet.broken):
        least = 1 - max(one.used for one in sheet.broken)
        return (
            f"The other errors use that much by themselves. A smaller --reserve, below {percent(least)}, leaves room."
        )
    return "The other errors, which are fixed, use that much by themselves: make them smaller, or specify them too."


def _line(one: Specification) -> list[str]:
    most = max(one.shares, key=lambda key: one.shares[key], default="")
    share = f"{percent(one.shares[most])} of {NAMES[most]}" if most else "limited by nothing"
    return [one.key, one.text or "free", one.declared_text or "-", share]


def _remarks(sheet: SpecificationSheet) -> Iterator[str]:
    """What a reader of a sheet should know of it."""
    for row in limiting(sheet):
        if row.requirement is None and row.id.startswith("negligible"):
            effect = row.id.partition(".")[2]
            yield f"{effect.capitalize()} phase is kept negligible, since no requirement takes it: that limits sizes."
        elif row.requirement is None:
            yield f"{row.id.partition('.')[2]} is limited by where the image ends."
    for one in sheet.specifications:
        if one.remark:
            yield f"{one.key} {one.text}: {one.remark}."
    yield from (f"{note[0].upper()}{note[1:]}." for note in sheet.notes)


def _offered(offer: Offer) -> str:
    stands = STATUS[offer.status].text if offer.status in STATUS else offer.status
    outside = sum(not one.is_inside for one in offer.figures)
    figures = "every figure is inside" if not outside else f"{outside} of {len(offer.figures)} figures are outside"
    return f"Offer {printable(offer.file)}: the mission as a whole says {stands}; {figures}."


def _side(is_inside: bool) -> str:
    return "inside" if is_inside else "OUTSIDE"


# ---------------------------------------------------------------- for a board, and a supplier
def as_markdown(version: str, answers: Sequence[Answer]) -> str:
    """Write the sheets as Markdown, without drawings."""
    from bisar_budget.report.compliance.markdown import written

    return written(_sheets(version, answers), "")


def as_html(version: str, answers: Sequence[Answer]) -> str:
    """Write the sheets as a page of their own."""
    from bisar_budget.report.compliance.html import page

    return page(_sheets(version, answers))


def _sheets(version: str, answers: Sequence[Answer]) -> doc.Compliance:
    chapters = [_chapter(one, f"sheet-{number}") for number, one in enumerate(answers, 1)]
    names = [printable(sheet.name) for sheet, _ in answers]
    facts = doc.Facts([("Tool", f"bisar-budget {version}")])
    margins = [
        doc.Margins(chapter.anchor, name, "", printable(one.sheet.file))
        for chapter, name, one in zip(chapters, names, answers, strict=True)
    ]
    subject = names[0] if len(names) == 1 else f"{len(names)} missions"
    return doc.Compliance(version, subject, facts, margins, chapters, title="Specification sheet")


def _chapter(answer: Answer, anchor: str) -> doc.Chapter:
    sheet, offer = answer
    blocks: list[doc.Block] = [
        doc.Paragraph(_verdict(sheet), f"verdict {'pass' if sheet.complies else 'fail'}"),
        doc.Facts([("File", doc.Name(printable(sheet.file))), ("Terms", _terms(sheet)), *_outside(sheet)]),
    ]
    if sheet.broken:
        heads = [*doc.heads("Row"), *doc.numbers("Used", "May use"), *doc.heads("")]
        rows: list[doc.Line] = [[doc.Name(name), *cells] for name, *cells in map(_broken, sheet.broken)]
        blocks.append(doc.TextTable("Rows without room", "Rows in which other errors leave no room", heads, rows))
        blocks.append(doc.Paragraph(_way_out(sheet)))
    else:
        blocks += [*_specified(sheet), *_required(sheet), *_drawn(sheet, anchor)]
        remarks = list(_remarks(sheet))
        if remarks:
            blocks.append(doc.Items([[text] for text in remarks]))
    if offer is not None:
        heads = [*doc.heads("Figure"), *doc.numbers("Offered", "Ordered"), *doc.heads("")]
        lines: list[doc.Line] = [
            [doc.Name(one.key), one.text or "–", one.ordered or "free", _side(one.is_inside)] for one in offer.figures
        ]
        blocks += [doc.Paragraph(_offered(offer)), doc.TextTable("Offer", "Offer against the sheet", heads, lines)]
    return doc.Chapter(printable(sheet.name), blocks, anchor, level=2, is_article=True)


def _outside(sheet: SpecificationSheet) -> Iterator[tuple[str, str]]:
    said = overrides_words(sheet)
    if said:
        yield "From outside the file", said


def _specified(sheet: SpecificationSheet) -> Iterator[doc.Block]:
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
        cells = [one.text or "free", one.found_text or "–", one.declared_text or "–", *shares, _parts(one) or "–"]
        rows.append([str(number), doc.Name(one.key), *cells])
    caption = "Specifications, rounded down to two digits; shares are those of what a limit may use."
    yield doc.TextTable("Specifications", caption, heads, rows)


def _parts(one: Specification) -> str:
    """Some of the parts of the catalogue that keep to a specification."""
    more = f" and {len(one.parts) - _LISTED} more" if len(one.parts) > _LISTED else ""
    return f"{', '.join(one.parts[:_LISTED])}{more}"


def _required(sheet: SpecificationSheet) -> Iterator[doc.Block]:
    heads = [*doc.heads("Requirement"), *doc.numbers("Allowed", "Reached", "Use"), *doc.heads("Status", "Decided by")]
    if sheet.findings is not None:
        rows: list[doc.Line] = [
            [one.name, one.allowed, one.reached, one.use, doc.Badge(one.status), doc.Name(one.decided_by)]
            for one in requirement_lines(sheet.findings)
        ]
        yield doc.TextTable("Requirements", "Requirements, with what is ordered in place", heads, rows)


def _drawn(sheet: SpecificationSheet, anchor: str) -> Iterator[doc.Block]:
    if limiting(sheet):
        yield doc.Figure(f"{anchor}-shares.svg", anchor, "What uses up each limit", "Shares", share_bars(sheet))
