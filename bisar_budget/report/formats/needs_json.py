"""Requirements and rows as `needs.json`, which Sphinx-Needs imports (`needimport`): a need for each.

Only fields that every project of Sphinx-Needs has are used, so that an import warns of nothing. A
project's own requirement id becomes a link; numbers are in the content, which Sphinx reads as
reStructuredText.
"""

import json
import re
from collections.abc import Iterator, Sequence
from os.path import splitext
from typing import Any

from bisar_budget.faults import changes_words
from bisar_budget.findings.mission import MissionFindings, Report, UnusableMission
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.findings.row import Row
from bisar_budget.report import Style
from bisar_budget.report.words.escapes import need_text, rst_text, source_path
from bisar_budget.report.words.requirements import overrides_words, requirement_finding, requirement_id
from bisar_budget.report.words.sentences import cause, measure


def render(report: Report, style: Style) -> str:
    """Write every requirement and row of every mission; a file that cannot be used is one need, of status `error`."""
    needs: dict[str, dict[str, Any]] = {}
    for mission in report.missions:
        file = source_path(mission.file, style.root)
        if isinstance(mission, UnusableMission):
            _add(needs, file, "mission", _unusable(mission, file))
        else:
            for one in mission.requirements:
                _add(needs, file, requirement_id(one), _requirement(one, mission, file))
            for row in mission.rows:
                _add(needs, file, row.id, _row(row, mission, file))
    version = {
        "creator": {"program": "bisar-budget", "version": report.version},
        "needs": needs,
        "needs_amount": len(needs),
    }
    document = {"project": "bisar-budget", "current_version": report.version, "versions": {report.version: version}}
    return json.dumps(document, indent=1, allow_nan=False) + "\n"


def _add(needs: dict[str, dict[str, Any]], file: str, subject: str, need: dict[str, Any]) -> None:
    """Give a need an id that the default pattern of Sphinx-Needs accepts, `[A-Z0-9_]{5,}`, and no other has."""
    stem = re.sub("[^A-Z0-9]+", "_", splitext(file)[0].upper()).strip("_")
    wanted = identifier = f"BUDGET_{stem}_{re.sub('[^A-Z0-9]+', '_', subject.upper()).strip('_')}"
    number = 2
    while identifier in needs:
        identifier = f"{wanted}_{number}"
        number += 1
    needs[identifier] = {"id": identifier, **need}


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
