"""Output of the `allocate` command: the sheet of specifications, compared with a supplier's offer if there is one.

For Sphinx-Needs and StrictDoc, the specifications are written as requirements that are derived from the requirements
of the mission.
"""

import math
from collections.abc import Iterator, Sequence

from bisar_budget import __version__
from bisar_budget.faults import printable
from bisar_budget.findings.offer import Offer, OfferedFigure
from bisar_budget.findings.requirement import REQUIREMENT_NAMES
from bisar_budget.findings.specification import MIN_ROOM_FRACTION, Broken, Specification, SpecificationSheet
from bisar_budget.findings.status import STATUS
from bisar_budget.mission.changes import parts_of
from bisar_budget.mission.model import id_of_requirement
from bisar_budget.report import Style
from bisar_budget.report import document as doc
from bisar_budget.report.answers import Records
from bisar_budget.report.answers.check_content import outside_item
from bisar_budget.report.answers.shared_blocks import mission_chapter, mission_document, opening, requirement_table
from bisar_budget.report.drawing.share_bars import LEAST_WEIGHT_FRACTION, limiting, share_bars
from bisar_budget.report.formats.strictdoc import StrictNode, strict_document, strict_uid
from bisar_budget.report.formats.traceability import identifier, needs_document
from bisar_budget.report.words.identity import Identity, distinct, identities
from bisar_budget.report.words.sentences import counted, need_text, percent, rst_text, share_percent

_LISTED_COUNT = 3  # parts of the catalogue that a table names
_SHEET_COLUMNS = ("file", "key", "value", "ordered", "unit", "text", "declared", "weight", "parts")


Answer = tuple[SpecificationSheet, Offer | None]  # a sheet, and the offer that is compared with it


# ---------------------------------------------------------------- for programs
def content(answers: Sequence[Answer]) -> dict[str, object]:
    """Content of the JSON document `allocate/1`, in SI units; a missing value is null."""
    return {"missions": [_item(answer) for answer in answers]}


def _item(answer: Answer) -> dict[str, object]:
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
                "key": requirement.key,
                "requirement_ids": list(requirement.requirement_ids),
                "value": requirement.value,
                "unit": requirement.unit,
                "used": requirement.utilization,
                "status": requirement.status,
                "row": requirement.row,
                "reason": str(requirement.reason) if requirement.reason else None,
            }
            for requirement in sheet.requirements
        ],
        "specifications": [
            {
                "key": spec.key,
                "weight": spec.weight,
                "value": spec.value,
                "ordered": spec.ordered,
                "unit": spec.unit,
                "text": spec.text or None,
                "shares": dict(spec.shares),
                "declared": spec.declared,
                "parts": list(spec.parts),
            }
            for spec in sheet.specifications
        ],
        "rows": [row._asdict() for row in sheet.rows],
        "broken": [row._asdict() for row in sheet.broken],
        "notes": list(sheet.notes),
        "offer": None if offer is None else _offer(offer),
    }


def _offer(offer: Offer) -> dict[str, object]:
    return {
        "file": offer.file,
        "status": offer.status,
        "complies": offer.complies,
        "figures": [figure._asdict() for figure in offer.figures],
        "differs_in": list(offer.notes),
    }


def records(answers: Sequence[Answer]) -> Records:
    """Table of the answers: one line for each specification, in SI units.

    The last columns are the shares of the requirements that each specification uses.
    """
    shares = [
        key
        for key in REQUIREMENT_NAMES
        if any(key in spec.shares for sheet, _ in answers for spec in sheet.specifications)
    ]
    lines = [
        {
            "file": sheet.file,
            "key": spec.key,
            "value": spec.value,
            "ordered": spec.ordered,
            "unit": spec.unit,
            "text": spec.text,
            "declared": spec.declared,
            "weight": spec.weight,
            "parts": list(spec.parts),
            **{f"share of {key}": spec.shares.get(key, 0.0) for key in shares},
        }
        for sheet, _ in answers
        for spec in sheet.specifications
    ]
    return Records((*_SHEET_COLUMNS, *(f"share of {key}" for key in shares)), lines)


# ---------------------------------------------------------------- for people
def document(answers: Sequence[Answer], style: Style) -> doc.AnswerDocument:
    """Text of each answer: the sheet of specifications, compared with a supplier's offer if there is one."""
    sheets = [sheet for sheet, _ in answers]
    chapters = [
        mission_chapter(answer[0], number, _blocks(answer, f"mission-{number}"))
        for number, answer in enumerate(answers, 1)
    ]
    return mission_document("Specification sheet", sheets, chapters)


def _blocks(answer: Answer, anchor: str) -> Iterator[doc.Block]:
    sheet, offer = answer
    yield opening(sheet, _verdict(sheet), "pass" if sheet.complies else "fail", _terms(sheet))
    yield from specified(sheet, anchor)
    if sheet.findings is not None and not sheet.broken:
        yield requirement_table(sheet.findings)
    if offer is not None:
        yield doc.Paragraph(_offered(offer))
        if not sheet.broken:
            heads = doc.heads("figure", *doc.numbers("offered", "ordered"), "")
            lines: list[doc.Line] = [
                [doc.Name(figure.key), figure.text or "–", figure.ordered or "free", _side(figure)]
                for figure in offer.figures
            ]
            yield doc.TextTable("Offer", "Offer against the sheet", heads, lines)


def _verdict(sheet: SpecificationSheet) -> str:
    if sheet.broken:
        return "no specification can be found: other errors leave no room"
    number = sum(spec.value is not None for spec in sheet.specifications)
    count = counted(number, "specification")
    status_text = STATUS[sheet.status].text
    if not number:
        return f"no requirement limits any of these errors; result of check: {status_text}"
    if not sheet.complies:
        return f"{count}, but the mission does not comply with them: {status_text}"
    verb = "meets" if number == 1 else "together meet"
    return f"{count} that {verb} every requirement; result of check: {status_text}"


def _terms(sheet: SpecificationSheet) -> str:
    combination = "root-sum-square" if sheet.combine == "rss" else "worst-case sum"
    return f"{sheet.model} model, {combination}, {percent(sheet.reserve)} of each limit in reserve"


def _largest_share(spec: Specification) -> str:
    most = max(spec.shares, key=lambda key: spec.shares[key], default="")
    return f"{share_percent(spec.shares[most])} of {REQUIREMENT_NAMES[most]}" if most else "no limit"


def _offered(offer: Offer) -> str:
    outside = sum(figure.is_inside is False for figure in offer.figures)
    count_words = f"{outside} of {counted(len(offer.figures), 'figure')} outside"
    difference = f"; it differs in {', '.join(offer.notes)} too" if offer.notes else ""
    subject = f"Offer {printable(offer.file)}: result of check {STATUS[offer.status].text}"
    return f"{subject}; {count_words}{difference}."


def _parts_words(spec: Specification) -> str:
    """Text with the first catalogue parts that meet a specification, and with the number of further parts."""
    more = f" and {len(spec.parts) - _LISTED_COUNT} more" if len(spec.parts) > _LISTED_COUNT else ""
    return f"{', '.join(spec.parts[:_LISTED_COUNT])}{more}"


def _broken_words(row: Broken) -> list[str]:
    """Table cells for a row in which the fixed errors leave no room for the specified errors.

    The cells are the id of the row, its utilization due to the fixed errors alone, the allowed utilization, and a
    remark.
    """
    if row.used is None:
        return [row.id, "-", percent(row.allowed), "over its limit: they leave no image"]
    if row.used > 1 + MIN_ROOM_FRACTION:
        return [row.id, percent(row.used), percent(row.allowed), "over its limit"]
    is_full = row.used >= 1 - MIN_ROOM_FRACTION
    remark = "at its limit" if is_full else "within its limit, but not with the reserve"
    return [row.id, "100 %" if is_full else share_percent(row.used), percent(row.allowed), remark]


def _way_out(sheet: SpecificationSheet) -> str:
    """Sentence that suggests a change if the fixed errors leave no room for the specified errors."""
    used = [math.inf if row.used is None else row.used for row in sheet.broken]
    room_fraction = 1 - max(used) / (1 - MIN_ROOM_FRACTION)
    permille = math.ceil(1e3 * room_fraction) - 1 if room_fraction > 0 else -1  # strictly less than the room
    if permille >= 0:
        return f"The other errors alone use this much. --reserve {permille / 10:g}% or less leaves room."
    return "The other errors, which are fixed, alone use this much: make them smaller, or specify them too."


def _remarks(sheet: SpecificationSheet) -> Iterator[str]:
    """Yield remarks for the reader of a sheet: limits not due to a requirement, specifications, and notes."""
    for row in limiting(sheet):
        if row.requirement is None and row.id.startswith("negligible"):
            effect = row.id.partition(".")[2]
            yield f"{effect.capitalize()} phase is kept negligible, as no requirement judges it: this limits sizes."
        elif row.requirement is None:
            cause = "the end of the image" if row.id.startswith("end") else "the largest value that a file may state"
            yield f"{row.id.partition('.')[2]} is limited by {cause}."
    for spec in sheet.specifications:
        if spec.remark:
            yield f"{spec.key} {spec.text}: {spec.remark}."
    yield from (f"{note[0].upper()}{note[1:]}." for note in sheet.notes)


def _side(figure: OfferedFigure) -> str:
    """Text about a value that a supplier offers: whether it meets its specification, or why it cannot be compared."""
    if figure.is_inside is None:
        return figure.remark
    return "inside" if figure.is_inside else "OUTSIDE"


def specified(sheet: SpecificationSheet, anchor: str) -> Iterator[doc.Block]:
    """Yield the specifications with their shares of the limits, and a drawing of these shares for each limit.

    If there are no specifications, yield the rows in which the fixed errors leave no room, and the remedy.
    """
    if sheet.broken:
        heads = doc.heads("row", *doc.numbers("used", "may use"), "")
        rows: list[doc.Line] = [[doc.Name(name), *cells] for name, *cells in map(_broken_words, sheet.broken)]
        yield doc.TextTable("Rows without room", "Rows in which other errors leave no room", heads, rows)
        yield doc.Paragraph(_way_out(sheet))
        return
    yield _table(sheet)
    if limiting(sheet):
        yield doc.Figure(f"{anchor}-shares.svg", anchor, "Use of each limit", "Shares", share_bars(sheet))
    if texts := list(_remarks(sheet)):
        yield doc.Items([[text] for text in texts])
    keeping = [f"Parts that meet {spec.key}: {_parts_words(spec)}." for spec in sheet.specifications if spec.parts]
    if keeping:
        yield doc.Only(doc.TERMINAL, [doc.Items([[text] for text in keeping])])


def _table(sheet: SpecificationSheet) -> doc.TextTable:
    keys = [key for key in REQUIREMENT_NAMES if any(key in spec.shares for spec in sheet.specifications)]
    share_heads = (f"share of {REQUIREMENT_NAMES[key]}" for key in keys)
    heads = [
        doc.Head("specification"),
        *doc.numbers("ordered"),
        *doc.numbers("found", medium=doc.PAGE),
        *doc.numbers("declared"),
        *doc.numbers(*share_heads, medium=doc.PAGE),
        doc.Head("largest share", medium=doc.TERMINAL),
        doc.Head("parts", medium=doc.PAGE),
    ]
    rows: list[doc.Line] = []
    for spec in sheet.specifications:
        shares = [
            share_percent(spec.shares[key]) if spec.shares.get(key, 0.0) > LEAST_WEIGHT_FRACTION else "–"
            for key in keys
        ]
        sizes = (spec.text or "free", spec.found_text or "–", spec.declared_text or "–")
        rows.append([doc.Name(spec.key), *sizes, *shares, _largest_share(spec), _parts_words(spec) or "–"])
    caption = "Specifications, rounded down to two digits; shares refer to the usable part of each limit."
    return doc.TextTable("Specifications", caption, heads, rows)


# ---------------------------------------------------------------- for tools that trace requirements
_PREFIX = "SPEC"
_PARENT_SHARE_FRACTION = 1e-3  # smallest share of a requirement for which a specification derives from it
_SPECIFICATION_GRAMMAR = {"REQUIREMENT": {"UID": True, "TITLE": True, "STATEMENT": True, "RATIONALE": False}}


def as_needs(answers: Sequence[Answer], style: Style) -> str:
    """Write each specification for Sphinx-Needs: a need of type `req`, with links to its parent requirements."""
    needs: list[tuple[tuple[str, ...], dict[str, object]]] = []
    for sheet, identity, spec in _specified(answers, style):
        content = [_statement(spec), _rationale(sheet, spec), f"{sheet.name}, {identity.path}"]
        need: dict[str, object] = {
            "type": "req",
            "title": need_text(_title(sheet, spec)),
            "status": sheet.status,
            "tags": ["bisar-budget", "specification"],
            "links": [need_text(link) for link in _parents(sheet, spec)],
            "content": "\n\n".join(rst_text(text) for text in content),
        }
        needs.append((identity.of(spec.key), need))
    return needs_document(__version__, _PREFIX, needs)


def as_sdoc(answers: Sequence[Answer], style: Style) -> str:
    """Write each specification as a requirement of a StrictDoc document, with the UIDs of its parent requirements."""
    specifications = list(_specified(answers, style))
    names = [identity.of(spec.key) for _, identity, spec in specifications]
    uids = distinct([identifier(_PREFIX, name) for name in names], names)
    nodes = [
        StrictNode(
            {
                "UID": uid,
                "TITLE": _title(sheet, spec),
                "STATEMENT": _statement(spec),
                "RATIONALE": _rationale(sheet, spec),
            },
            [strict_uid(parent) for parent in _parents(sheet, spec)],
        )
        for uid, (sheet, _, spec) in zip(uids, specifications, strict=True)
    ]
    return strict_document(f"specifications, by bisar-budget {__version__}", _SPECIFICATION_GRAMMAR, nodes)


def _specified(
    answers: Sequence[Answer], style: Style
) -> Iterator[tuple[SpecificationSheet, Identity, Specification]]:
    """Yield every specification that has a value, with its sheet and the identity of the mission."""
    sheets = [sheet for sheet, _ in answers if sheet.findings is not None]
    missions = [sheet.findings for sheet in sheets if sheet.findings is not None]
    for sheet, identity in zip(sheets, identities(missions, style), strict=True):
        yield from ((sheet, identity, spec) for spec in sheet.specifications if spec.text)


def _title(sheet: SpecificationSheet, spec: Specification) -> str:
    return f"{spec.key} of {sheet.name}"


def _statement(spec: Specification) -> str:
    """Write a specification as a sentence about its key, which has the same meaning as in the mission file."""
    return f"{spec.key}, as the mission file counts it, shall be at most {spec.text}."


def _rationale(sheet: SpecificationSheet, spec: Specification) -> str:
    shares = sorted(spec.shares.items(), key=lambda item: -item[1])
    share_words = [
        f"{share_percent(share)} of the {REQUIREMENT_NAMES[key]}"
        for key, share in shares
        if share >= _PARENT_SHARE_FRACTION
    ]
    takes = f"It takes {' and '.join(share_words)} that may be used. " if share_words else ""
    reserve = f"{percent(sheet.reserve)} of each limit is in reserve."
    return f"{takes}With all specifications of the sheet the result of the check is {sheet.status}; {reserve}"


def _parents(sheet: SpecificationSheet, spec: Specification) -> list[str]:
    """Ids of the project requirements from which a specification is derived.

    These ids are given in the mission file for the rows that limit the specification, for the requirements of these
    rows, and for the rows about the specified error itself.
    """
    findings = sheet.findings
    if findings is None or findings.mission is None:
        return []
    limits = [row for row in sheet.rows if row.shares.get(spec.key, 0.0) >= _PARENT_SHARE_FRACTION]
    rows = [row.id for row in limits] + [f"mission.{row.requirement}" for row in limits]
    rows += [id_of_requirement(row.requirement) for row in limits if row.requirement]
    keys = parts_of(spec.key)
    owner_and_kind = (keys[1] if len(keys) > 1 else "", keys[-1])
    rows += [row.id for row in findings.rows if (row.owner, row.subject.kind) == owner_and_kind]
    ids = findings.mission.requirement_ids
    return list(dict.fromkeys(own_id for row in rows for own_id in ids.get(row, ())))
