"""Requirements and rows as `needs.json`, which Sphinx-Needs imports (`needimport`): a need for each.

Only fields that every project of Sphinx-Needs has are used, so that an import warns of nothing. A
project's own requirement id becomes a link; numbers are in the content, which Sphinx reads as
reStructuredText.
"""

import json
import re
from collections.abc import Container, Iterator, Sequence
from typing import Any

from bisar_budget.faults import changes_words
from bisar_budget.findings.mission import MissionFindings, Report, UnusableMission
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.findings.row import Row
from bisar_budget.report import Style
from bisar_budget.report.words.identity import distinct, identities, stem
from bisar_budget.report.words.requirements import overrides_words, requirement_finding, requirement_id
from bisar_budget.report.words.sentences import cause, measure, need_text, rst_text


def render(report: Report, style: Style) -> str:
    """Write every requirement and row of every mission; a file that cannot be used is one need, of status `error`."""
    names: list[tuple[str, ...]] = []
    found: list[dict[str, Any]] = []
    for mission, identity in zip(report.missions, identities(report.missions, style), strict=True):
        if isinstance(mission, UnusableMission):
            names.append(identity.of("mission"))
            found.append(_unusable(mission, identity.path))
            continue
        names += [identity.of(requirement_id(one)) for one in mission.requirements]
        found += [_requirement(one, mission, identity.path) for one in mission.requirements]
        names += [identity.of(row.id, row.requirement_id) for row in mission.rows]
        found += [_row(row, mission, identity.path) for row in mission.rows]
    needs: dict[str, dict[str, Any]] = {}
    for wanted, need in zip(distinct([_identifier(name) for name in names], names), found, strict=True):
        identifier = _unused(wanted, needs)
        needs[identifier] = {"id": identifier, **need}
    version = {
        "creator": {"program": "bisar-budget", "version": report.version},
        "needs": needs,
        "needs_amount": len(needs),
    }
    document = {"project": "bisar-budget", "current_version": report.version, "versions": {report.version: version}}
    return json.dumps(document, indent=1, allow_nan=False) + "\n"


def _identifier(name: tuple[str, ...]) -> str:
    """Spell a name by the default pattern of Sphinx-Needs, `[A-Z0-9_]{5,}`."""
    return "_".join(["BUDGET", *(re.sub("[^A-Z0-9]+", "_", stem(part).upper()).strip("_") for part in name)])


def _unused(identifier: str, needs: Container[str]) -> str:
    """Number the findings of a file that is named twice."""
    unique, number = identifier, 2
    while unique in needs:
        unique, number = f"{identifier}_{number}", number + 1
    return unique


def _row(row: Row, mission: MissionFindings, file: str) -> dict[str, Any]:
    texts = [measure(row, mission), cause(row), f"From {row.equation}."]
    texts += [f"Evidence: {row.evidence}"] if row.evidence else []
    return {
        "type": "test",
        "title": need_text(f"{row.id} of {mission.name}"),
        "status": row.status,
        "tags": ["bisar-budget", row.metric],
        "links": [need_text(row.requirement_id)] if row.requirement_id else [],
        "content": _content([*texts, *_origin(row.line, mission, file)]),
    }


def _requirement(one: JudgedRequirement, mission: MissionFindings, file: str) -> dict[str, Any]:
    return {
        "type": "test",
        "title": need_text(f"{one.name} of {mission.name}"),
        "status": one.status,
        "tags": ["bisar-budget", "requirement", one.key],
        "links": [],
        "content": _content([requirement_finding(one), *_origin(one.line, mission, file)]),
    }


def _origin(line: int | None, mission: MissionFindings, file: str) -> Iterator[str]:
    """Where a value stands, and what from outside the file bears on the verdict."""
    yield f"{mission.name}, {file}" + (f":{line}" if line is not None else "")
    if mission.changes:
        yield f"Not as the file says: {changes_words(mission.changes)}"
    if outside := overrides_words(mission, with_changes=False):
        yield f"From outside the file: {outside}"


def _content(texts: Sequence[str]) -> str:
    return "\n\n".join(rst_text(text) for text in texts if text)


def _unusable(mission: UnusableMission, file: str) -> dict[str, Any]:
    return {
        "type": "test",
        "title": need_text(f"{file} cannot be used"),
        "status": mission.status,
        "tags": ["bisar-budget"],
        "links": [],
        "content": "\n\n".join(
            rst_text(f"{fault.line or '-'}:{fault.column or '-'} {fault}") for fault in mission.faults
        ),
    }
