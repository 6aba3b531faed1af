"""The sheet of specifications: `allocate/1`, CSV, text for a terminal, Markdown and HTML for whoever buys."""

import csv
import io
import json
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from bisar_budget.design.offers import Offer
from bisar_budget.faults import changes_words, printable
from bisar_budget.findings.requirement import NAMES
from bisar_budget.findings.specification import Specification, SpecificationSheet
from bisar_budget.findings.status import STATUS
from bisar_budget.report import Style
from bisar_budget.report.compliance import document as doc
from bisar_budget.report.compliance.specifications import broken_words, parts_words, remarks, side, specified, way_out
from bisar_budget.report.formats.text_table import requirement_table
from bisar_budget.report.words.requirements import overrides_lines, overrides_words, requirement_lines
from bisar_budget.report.words.sentences import counted, percent, table, wrapped

_FORMAT = "bisar-budget/allocate/1"
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
        "differs_in": list(offer.notes),
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
        yield from table([["row", "used", "may use", ""], *(broken_words(one) for one in sheet.broken)])
        yield ""
        yield from wrapped(way_out(sheet), "")
        if offer is not None:
            yield ""
            yield from wrapped(_offered(offer), "  ")
        return
    yield from table([["specification", "ordered", "today", "largest share"], *map(_line, sheet.specifications)])
    yield ""
    if sheet.findings is not None:
        yield from requirement_table(sheet.findings, style)
        yield ""
    keeping = [f"Parts that keep to {one.key}: {parts_words(one)}." for one in sheet.specifications if one.parts]
    for text in [*remarks(sheet), *keeping]:
        yield from wrapped(text, "  ")
    if offer is not None:
        yield ""
        yield from wrapped(_offered(offer), "  ")
        head = ["figure", "offered", "ordered", ""]
        lines = [[one.key, one.text or "-", one.ordered or "free", side(one)] for one in offer.figures]
        yield from table([head, *lines])


def _verdict(sheet: SpecificationSheet) -> str:
    if sheet.broken:
        return "no specification can be found: other errors leave no room"
    number = sum(one.value is not None for one in sheet.specifications)
    count = counted(number, "specification")
    stands = STATUS[sheet.status].text if sheet.status in STATUS else sheet.status
    if not number:
        return f"no requirement limits any of these errors: check says {stands}"
    if not sheet.complies:
        return f"{count}, but the mission does not comply with them: {stands}"
    return f"{count} that meet{'s' if number == 1 else ''} every requirement together: check says {stands}"


def _terms(sheet: SpecificationSheet) -> str:
    how = "root-sum-square" if sheet.combine == "rss" else "sum of all at their worst"
    return f"{sheet.model} model, {how}, {percent(sheet.reserve)} of each limit in reserve"


def _line(one: Specification) -> list[str]:
    most = max(one.shares, key=lambda key: one.shares[key], default="")
    share = f"{percent(one.shares[most])} of {NAMES[most]}" if most else "limited by nothing"
    return [one.key, one.text or "free", one.declared_text or "-", share]


def _offered(offer: Offer) -> str:
    stands = STATUS[offer.status].text if offer.status in STATUS else offer.status
    outside = sum(one.is_inside is False for one in offer.figures)
    of_all = f"of {counted(len(offer.figures), 'figure')} {outside} {'is' if outside == 1 else 'are'} outside"
    other = f"; it differs in {', '.join(offer.notes)} too" if offer.notes else ""
    return f"Offer {printable(offer.file)}: the mission as a whole says {stands}; {of_all}{other}."


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
    blocks += [*_required(sheet), *specified(sheet, anchor)]
    if offer is not None:
        heads = [*doc.heads("Figure"), *doc.numbers("Offered", "Ordered"), *doc.heads("")]
        lines: list[doc.Line] = [
            [doc.Name(one.key), one.text or "–", one.ordered or "free", side(one)] for one in offer.figures
        ]
        blocks += [doc.Paragraph(_offered(offer)), doc.TextTable("Offer", "Offer against the sheet", heads, lines)]
    return doc.Chapter(printable(sheet.name), blocks, anchor, level=2, is_article=True)


def _outside(sheet: SpecificationSheet) -> Iterator[tuple[str, str]]:
    said = overrides_words(sheet)
    if said:
        yield "From outside the file", said


def _required(sheet: SpecificationSheet) -> Iterator[doc.Block]:
    heads = [*doc.heads("Requirement"), *doc.numbers("Allowed", "Reached", "Use"), *doc.heads("Status", "Decided by")]
    if sheet.findings is not None and not sheet.broken:
        rows: list[doc.Line] = [
            [one.name, one.allowed, one.reached, one.use, doc.Badge(one.status), doc.Name(one.decided_by)]
            for one in requirement_lines(sheet.findings)
        ]
        yield doc.TextTable("Requirements", "Requirements, with what is ordered in place", heads, rows)
