"""The sheet of specifications: `allocate/1`, CSV, text for a terminal, Markdown and HTML for whoever buys.

Its specifications are also requirements below those of the mission, for Sphinx-Needs and for StrictDoc.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Any

from bisar_budget import __version__
from bisar_budget.design.offers import Offer, OfferedFigure
from bisar_budget.faults import printable
from bisar_budget.findings.requirement import NAMES
from bisar_budget.findings.specification import LEAST_ROOM, Broken, Specification, SpecificationSheet
from bisar_budget.findings.status import STATUS
from bisar_budget.mission.changes import parts_of
from bisar_budget.report import Style
from bisar_budget.report.compliance import document as doc
from bisar_budget.report.drawing.share_bars import LIMITS, limiting, share_bars
from bisar_budget.report.formats.csv_table import csv_text
from bisar_budget.report.formats.json_document import document_text, outside_item
from bisar_budget.report.formats.text_table import requirement_table
from bisar_budget.report.formats.traceability import identifier, needs_document
from bisar_budget.report.words.heading import overrides_words, title_lines
from bisar_budget.report.words.identity import Identity, distinct, identities
from bisar_budget.report.words.requirements import RequirementLine, requirement_lines
from bisar_budget.report.words.sentences import counted, need_text, percent, rst_text, share_percent, table, wrapped

_LISTED = 3  # parts of the catalogue that a table names
_COLUMNS = ("file", "key", "value", "ordered", "unit", "text", "declared", "weight", "parts")


Answer = tuple[SpecificationSheet, Offer | None]  # the offer is what is held to the sheet, if any


# ---------------------------------------------------------------- for programs
def as_json(answers: Sequence[Answer], style: Style) -> str:
    """Write the contract; values in SI, null where there is none."""
    return document_text("bisar-budget/allocate/1", {"missions": [_document(one) for one in answers]})


def _document(answer: Answer) -> dict[str, Any]:
    sheet, offer = answer
    return {
        "file": sheet.file,
        "name": sheet.name,
        **outside_item(sheet),
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
        "rows": [row._asdict() for row in sheet.rows],
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


def as_csv(answers: Sequence[Answer], style: Style) -> str:
    """Write a line for each specification, values in SI; what each takes of a requirement stands behind the rest."""
    shares = [key for key in NAMES if any(key in one.shares for sheet, _ in answers for one in sheet.specifications)]
    lines: list[list[object]] = [[*_COLUMNS, *(f"share of {key}" for key in shares)]]
    for sheet, _ in answers:
        for one in sheet.specifications:
            sizes = (one.value, one.ordered, one.unit, one.text, one.declared, one.weight)
            parts = [f"{one.shares.get(key, 0.0):.6g}" for key in shares]
            lines.append([printable(sheet.file), printable(one.key), *sizes, " ".join(one.parts), *parts])
    return csv_text(lines)


# ---------------------------------------------------------------- for a terminal
def as_text(answers: Sequence[Answer], style: Style) -> str:
    """Write each sheet as lines for a person."""
    return "\n\n".join("\n".join(_lines(one, style)) for one in answers) + "\n"


def _lines(answer: Answer, style: Style) -> Iterator[str]:
    sheet, offer = answer
    sgr = "32" if sheet.complies else "1;31"
    yield from title_lines(sheet, _verdict(sheet), sgr, style, remark=f"; {_terms(sheet)}")
    if sheet.broken:
        yield from table([["row", "used", "may use", ""], *(_broken_words(one) for one in sheet.broken)])
        yield ""
        yield from wrapped(_way_out(sheet), "")
        if offer is not None:
            yield ""
            yield from wrapped(_offered(offer), "  ")
        return
    yield from table([["specification", "ordered", "today", "largest share"], *map(_line, sheet.specifications)])
    yield ""
    if sheet.findings is not None:
        yield from requirement_table(sheet.findings, style)
        yield ""
    keeping = [f"Parts that keep to {one.key}: {_parts_words(one)}." for one in sheet.specifications if one.parts]
    for text in [*_remarks(sheet), *keeping]:
        yield from wrapped(text, "  ")
    if offer is not None:
        yield ""
        yield from wrapped(_offered(offer), "  ")
        head = ["figure", "offered", "ordered", ""]
        lines = [[one.key, one.text or "-", one.ordered or "free", _side(one)] for one in offer.figures]
        yield from table([head, *lines])


def _verdict(sheet: SpecificationSheet) -> str:
    if sheet.broken:
        return "no specification can be found: other errors leave no room"
    number = sum(one.value is not None for one in sheet.specifications)
    count = counted(number, "specification")
    stands = STATUS[sheet.status].text
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
    share = f"{share_percent(one.shares[most])} of {NAMES[most]}" if most else "limited by nothing"
    return [one.key, one.text or "free", one.declared_text or "-", share]


def _offered(offer: Offer) -> str:
    outside = sum(one.is_inside is False for one in offer.figures)
    of_all = f"of {counted(len(offer.figures), 'figure')} {outside} {'is' if outside == 1 else 'are'} outside"
    other = f"; it differs in {', '.join(offer.notes)} too" if offer.notes else ""
    return f"Offer {printable(offer.file)}: the mission as a whole says {STATUS[offer.status].text}; {of_all}{other}."


def _parts_words(one: Specification) -> str:
    """Some of the parts of the catalogue that keep to a specification."""
    more = f" and {len(one.parts) - _LISTED} more" if len(one.parts) > _LISTED else ""
    return f"{', '.join(one.parts[:_LISTED])}{more}"


def _broken_words(one: Broken) -> list[str]:
    """Cells of a row in which there is no room."""
    if one.used is None:
        return [one.id, "-", percent(one.allowed), "over its limit: they leave no image"]
    if one.used > 1 + LEAST_ROOM:
        return [one.id, percent(one.used), percent(one.allowed), "over its limit"]
    is_full = one.used >= 1 - LEAST_ROOM
    within = "at its limit" if is_full else "within its limit, but not with the reserve"
    return [one.id, "100 %" if is_full else share_percent(one.used), percent(one.allowed), within]


def _way_out(sheet: SpecificationSheet) -> str:
    """Remedies where other errors leave no room."""
    used = [math.inf if one.used is None else one.used for one in sheet.broken]
    room = 1 - max(used) / (1 - LEAST_ROOM)
    permille = math.ceil(1e3 * room) - 1 if room > 0 else -1  # strictly less than they leave
    if permille >= 0:
        return f"The other errors use that much by themselves. --reserve {permille / 10:g}% or less leaves room."
    return "The other errors, which are fixed, use that much by themselves: make them smaller, or specify them too."


def _remarks(sheet: SpecificationSheet) -> Iterator[str]:
    """Remarks for the reader of a sheet."""
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


def _side(figure: OfferedFigure) -> str:
    """On which side of a specification a figure is."""
    if figure.is_inside is None:
        return figure.remark
    return "inside" if figure.is_inside else "OUTSIDE"


# ---------------------------------------------------------------- for a board, and a supplier
def as_markdown(answers: Sequence[Answer], style: Style) -> str:
    """Write the sheets as Markdown, without drawings."""
    from bisar_budget.report.compliance.markdown import written

    return written(_sheets(answers), "")


def as_html(answers: Sequence[Answer], style: Style) -> str:
    """Write the sheets as a page of their own."""
    from bisar_budget.report.compliance.html import page

    return page(_sheets(answers))


def _sheets(answers: Sequence[Answer]) -> doc.Compliance:
    chapters = [_chapter(one, f"sheet-{number}") for number, one in enumerate(answers, 1)]
    names = [printable(sheet.name) for sheet, _ in answers]
    facts = doc.Facts([("Tool", f"bisar-budget {__version__}")])
    margins = [
        doc.Margins(chapter.anchor, name, "", printable(sheet.file))
        for chapter, name, (sheet, _) in zip(chapters, names, answers, strict=True)
    ]
    subject = names[0] if len(names) == 1 else f"{len(names)} missions"
    return doc.Compliance(__version__, subject, facts, margins, chapters, title="Specification sheet")


def _chapter(answer: Answer, anchor: str) -> doc.Chapter:
    sheet, offer = answer
    facts: list[tuple[doc.Text, doc.Text]] = [("File", doc.Name(printable(sheet.file))), ("Terms", _terms(sheet))]
    if outside := overrides_words(sheet):
        facts.append(("Overrides", outside))
    blocks: list[doc.Block] = [
        doc.Paragraph(_verdict(sheet), f"verdict {'pass' if sheet.complies else 'fail'}"),
        doc.Facts(facts),
    ]
    blocks += [*_required(sheet), *specified(sheet, anchor)]
    if offer is not None:
        heads = doc.heads("Figure", *doc.numbers("Offered", "Ordered"), "")
        lines: list[doc.Line] = [
            [doc.Name(one.key), one.text or "–", one.ordered or "free", _side(one)] for one in offer.figures
        ]
        blocks += [doc.Paragraph(_offered(offer)), doc.TextTable("Offer", "Offer against the sheet", heads, lines)]
    return doc.Chapter(printable(sheet.name), blocks, anchor, level=2, is_article=True)


def _required(sheet: SpecificationSheet) -> Iterator[doc.Block]:
    heads = doc.heads("Requirement", *doc.numbers("Allowed", "Reached", "Use"), "Status", "Decided by")
    if sheet.findings is not None and not sheet.broken:
        rows: list[doc.Line] = [
            [one.name, one.allowed, one.reached, one.use, doc.Badge(one.status), _decided_by(one)]
            for one in requirement_lines(sheet.findings)
        ]
        yield doc.TextTable("Requirements", "Requirements, with what is ordered in place", heads, rows)


def _decided_by(one: RequirementLine) -> doc.Text:
    return (doc.Name(one.decided_by), f", {one.remark}") if one.remark else doc.Name(one.decided_by)


def specified(sheet: SpecificationSheet, anchor: str) -> Iterator[doc.Block]:
    """The specifications with their shares, and a drawing of what uses up each limit; or why there are none."""
    if sheet.broken:
        heads = doc.heads("Row", *doc.numbers("Used", "May use"), "")
        rows: list[doc.Line] = [[doc.Name(name), *cells] for name, *cells in map(_broken_words, sheet.broken)]
        yield doc.TextTable("Rows without room", "Rows in which other errors leave no room", heads, rows)
        yield doc.Paragraph(_way_out(sheet))
        return
    yield from _table(sheet)
    if limiting(sheet):
        yield doc.Figure(f"{anchor}-shares.svg", anchor, "What uses up each limit", "Shares", share_bars(sheet))
    if texts := list(_remarks(sheet)):
        yield doc.Items([[text] for text in texts])


def _table(sheet: SpecificationSheet) -> Iterator[doc.Block]:
    keys = [key for key in NAMES if any(key in one.shares for one in sheet.specifications)]
    sizes = doc.numbers("Ordered", "Found", "Today", *(f"Of {NAMES[key]}" for key in keys))
    heads = doc.heads(*doc.numbers("No."), "Specification", *sizes, "Parts")
    rows: list[doc.Line] = []
    for number, one in enumerate(sheet.specifications, 1):
        shares = [share_percent(one.shares[key]) if one.shares.get(key, 0.0) > LIMITS else "–" for key in keys]
        found = (one.text or "free", one.found_text or "–", one.declared_text or "–")
        rows.append([str(number), doc.Name(one.key), *found, *shares, _parts_words(one) or "–"])
    caption = "Specifications, rounded down to two digits; shares are those of what a limit may use."
    yield doc.TextTable("Specifications", caption, heads, rows)


# ---------------------------------------------------------------- for tools that trace requirements
_PREFIX = "SPEC"
_LEAST = 1e-3  # of a requirement: an error that takes less of it does not derive from it
_GRAMMAR = """[GRAMMAR]
ELEMENTS:
- TAG: REQUIREMENT
  FIELDS:
  - TITLE: UID
    TYPE: String
    REQUIRED: True
  - TITLE: TITLE
    TYPE: String
    REQUIRED: True
  - TITLE: STATEMENT
    TYPE: String
    REQUIRED: True
  - TITLE: RATIONALE
    TYPE: String
    REQUIRED: False
  RELATIONS:
  - TYPE: Parent
"""


def as_needs(answers: Sequence[Answer], style: Style) -> str:
    """Write each specification as a need of the type `req`, with links to the ids of what it derives from."""
    found: list[tuple[tuple[str, ...], dict[str, Any]]] = []
    for sheet, identity, one in _specified(answers, style):
        content = [_statement(one), _rationale(sheet, one), f"{sheet.name}, {identity.path}"]
        need = {
            "type": "req",
            "title": need_text(_title(sheet, one)),
            "status": sheet.status,
            "tags": ["bisar-budget", "specification"],
            "links": [need_text(link) for link in _parents(sheet, one)],
            "content": "\n\n".join(rst_text(text) for text in content),
        }
        found.append((identity.of(one.key), need))
    return needs_document(__version__, _PREFIX, found)


def as_sdoc(answers: Sequence[Answer], style: Style) -> str:
    """Write each specification as a requirement of a document that StrictDoc reads, its parents by their UIDs."""
    found = list(_specified(answers, style))
    names = [identity.of(one.key) for _, identity, one in found]
    uids = distinct([identifier(_PREFIX, name) for name in names], names)
    lines = ["[DOCUMENT]", f"TITLE: specifications, by bisar-budget {__version__}", "", _GRAMMAR]
    for uid, (sheet, _, one) in zip(uids, found, strict=True):
        lines += ["[REQUIREMENT]", f"UID: {uid}", f"TITLE: {printable(_title(sheet, one))}"]
        lines += [f"STATEMENT: {printable(_statement(one))}", f"RATIONALE: {printable(_rationale(sheet, one))}"]
        parents = _parents(sheet, one)
        lines += ["RELATIONS:"] if parents else []
        lines += [line for parent in parents for line in ("- TYPE: Parent", f"  VALUE: {printable(parent)}")]
        lines.append("")
    return "\n".join(lines)


def _specified(
    answers: Sequence[Answer], style: Style
) -> Iterator[tuple[SpecificationSheet, Identity, Specification]]:
    """Every specification that has a value, with its sheet and what the mission is called."""
    sheets = [sheet for sheet, _ in answers if sheet.findings is not None]
    missions = [sheet.findings for sheet in sheets if sheet.findings is not None]
    for sheet, identity in zip(sheets, identities(missions, style), strict=True):
        yield from ((sheet, identity, one) for one in sheet.specifications if one.text)


def _title(sheet: SpecificationSheet, one: Specification) -> str:
    return f"{one.key} of {sheet.name}"


def _statement(one: Specification) -> str:
    """The requirement, by the key of the mission file that says what the number means."""
    return f"{one.key}, as the mission file counts it, shall be at most {one.text}."


def _rationale(sheet: SpecificationSheet, one: Specification) -> str:
    shares = sorted(one.shares.items(), key=lambda item: -item[1])
    parts = [f"{share_percent(part)} of the {NAMES[key]}" for key, part in shares if part >= _LEAST]
    takes = f"It takes {' and '.join(parts)} that may be used. " if parts else ""
    reserve = f"{percent(sheet.reserve)} of each limit is in reserve."
    return f"{takes}With all specifications of the sheet together the check says {sheet.status}; {reserve}"


def _parents(sheet: SpecificationSheet, one: Specification) -> list[str]:
    """The project's own ids of the rows that limit a specification, of their requirements, and of its own rows."""
    findings = sheet.findings
    if findings is None or findings.mission is None:
        return []
    limits = [row for row in sheet.rows if row.shares.get(one.key, 0.0) >= _LEAST]
    rows = [row.id for row in limits] + [f"mission.{row.requirement}" for row in limits]
    owner, kind = (*parts_of(one.key)[1:2], ""), parts_of(one.key)[-1]
    rows += [row.id for row in findings.rows if row.subject.owner == owner[0] and row.subject.kind == kind]
    ids = findings.mission.requirement_ids
    return list(dict.fromkeys(ids[row] for row in rows if row in ids))
