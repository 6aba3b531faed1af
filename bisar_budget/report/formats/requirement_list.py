"""Write the requirements of missions with their status as CSV.

The first columns, and the last one, are the same as in a requirements file. A line contains a requirement id of the
project and the requirement or row to which the id is assigned. A requirement without such an id has its own line. A
mission can read the CSV file with `requirements: {file: …}`; the columns from `status` to `overrides` are ignored.
"""

import math
from collections.abc import Iterator, Sequence

from bisar_budget.faults import Place
from bisar_budget.findings.mission import MissionFindings, UnusableMission
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.findings.row import DECLARE
from bisar_budget.report import Piece, Style
from bisar_budget.report.formats.csv_table import csv_text
from bisar_budget.report.words.heading import overrides_words
from bisar_budget.report.words.requirements import requirement_finding, requirement_lines
from bisar_budget.report.words.sentences import confidence_asked, declared_size, finding, shown_use, use_words

_STATUS_COLUMNS = (
    *("id", "text", "key", "limit"),
    *("status", "reached", "use", "decided_by", "file", "finding", "overrides", "confidence"),
)


def piece(mission: MissionFindings | UnusableMission, style: Style) -> str:
    """Write the lines of a mission, without the header.

    For a mission file that cannot be used, a single line with its status is written.
    """
    if isinstance(mission, UnusableMission):
        faults = "; ".join(map(str, mission.faults))
        return csv_text([["", "", "", "", mission.status, "", "", "", mission.file, faults, "", ""]])
    return csv_text([*_requirements(mission), *_rows(mission)])


def joined(pieces: Sequence[Piece], version: str, style: Style) -> str:
    """Write the lines of all missions below a header."""
    return csv_text([_STATUS_COLUMNS]) + "".join(piece.text for piece in pieces)


def _requirements(mission: MissionFindings) -> Iterator[list[str]]:
    for line in requirement_lines(mission):
        requirement = line.requirement
        sizes = (requirement.status, line.reached, line.use, requirement.row or "")
        result = [*sizes, mission.file, requirement_finding(requirement, mission)]
        result += [overrides_words(mission), confidence_asked(requirement)]
        for own_id in requirement.requirement_ids or ("",):
            text = mission.requirement_texts.get(own_id, "")
            yield [own_id, text, requirement.key, limit_of_file(requirement, mission), *map(_or_empty, result)]


def _rows(mission: MissionFindings) -> Iterator[list[str]]:
    for row in mission.rows:
        sizes = (row.status, declared_size(row, mission), use_words(shown_use(row)), row.id)
        result = [*sizes, mission.file, finding(row, mission), overrides_words(mission), ""]
        for own_id in row.requirement_ids:
            yield [own_id, mission.requirement_texts.get(own_id, ""), row.id, "", *map(_or_empty, result)]


def _or_empty(cell: str) -> str:
    return "" if cell == "-" else cell


def limit_of_file(requirement: JudgedRequirement, mission: MissionFindings) -> str:
    """Limit of a requirement as written in the mission file, or with full precision if the file does not state it."""
    if requirement.key == DECLARE or requirement.value is None:
        return ", ".join(mission.kinds.required)
    if isinstance(requirement.line, Place) and not requirement.is_default and requirement.line.text:
        return requirement.line.text
    if requirement.unit == "rad":
        return f"{math.degrees(requirement.value):.15g} deg"
    return f"{requirement.value!r} {requirement.unit}"
