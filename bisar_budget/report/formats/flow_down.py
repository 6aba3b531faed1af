"""Specifications as requirements below those of the mission, for Sphinx-Needs and for StrictDoc."""

from collections.abc import Iterator, Sequence
from typing import Any

from bisar_budget.faults import printable
from bisar_budget.findings.requirement import NAMES
from bisar_budget.findings.specification import Specification, SpecificationSheet
from bisar_budget.mission.changes import parts_of
from bisar_budget.report import Style
from bisar_budget.report.formats.specification_sheet import Answer
from bisar_budget.report.formats.traceability import identifier, needs_document
from bisar_budget.report.words.identity import Identity, distinct, identities
from bisar_budget.report.words.sentences import need_text, percent, rst_text

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


def as_needs(version: str, answers: Sequence[Answer], style: Style) -> str:
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
    return needs_document(version, _PREFIX, found)


def as_sdoc(version: str, answers: Sequence[Answer], style: Style) -> str:
    """Write each specification as a requirement of a document that StrictDoc reads, its parents by their UIDs."""
    found = list(_specified(answers, style))
    names = [identity.of(one.key) for _, identity, one in found]
    uids = distinct([identifier(_PREFIX, name) for name in names], names)
    lines = ["[DOCUMENT]", f"TITLE: specifications, by bisar-budget {version}", "", _GRAMMAR]
    for uid, (sheet, _, one) in zip(uids, found, strict=True):
        lines += ["[REQUIREMENT]", f"UID: {uid}", f"TITLE: {_line(_title(sheet, one))}"]
        lines += [f"STATEMENT: {_line(_statement(one))}", f"RATIONALE: {_line(_rationale(sheet, one))}"]
        parents = _parents(sheet, one)
        lines += ["RELATIONS:"] if parents else []
        lines += [line for parent in parents for line in ("- TYPE: Parent", f"  VALUE: {_line(parent)}")]
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
    """What is required, by the key of the mission file that says what the number means."""
    return f"{one.key}, as the mission file counts it, shall be at most {one.text}."


def _rationale(sheet: SpecificationSheet, one: Specification) -> str:
    shares = sorted(one.shares.items(), key=lambda item: -item[1])
    parts = [f"{percent(part)} of the {NAMES[key]}" for key, part in shares if part >= _LEAST]
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


def _line(text: str) -> str:
    """Text of one line of a document of StrictDoc."""
    return printable(text)
