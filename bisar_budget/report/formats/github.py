"""Findings that need attention as workflow commands: GitHub shows them in the pull request at the value's line.

The runner shows ten errors and ten warnings of a step, so the worst come first.
"""

from collections.abc import Iterator
from typing import NamedTuple

from bisar_budget.faults import Fault, Place, Region, changes_words
from bisar_budget.findings.mission import MissionFindings, Report, UnusableMission
from bisar_budget.findings.row import worst_first
from bisar_budget.findings.status import STATUS
from bisar_budget.report import Style
from bisar_budget.report.words.identity import source_path
from bisar_budget.report.words.requirements import overrides_words, requirement_finding, requirement_id, unseen
from bisar_budget.report.words.sentences import command_property, command_text, finding, markdown_text, percent

_ORDER = ("error", "warning", "notice")
_SHOWN_IN_SUMMARY = 20


class _Annotation(NamedTuple):
    command: str
    file: str
    region: Region | None
    title: str
    message: str


def render(report: Report, style: Style) -> str:
    """Write one command per finding; a run without findings says so in a line that is no command.

    A requirement is a finding where no row shows how it stands; so is what from outside a file bears on its verdict.
    """
    annotations = sorted(_annotations(report, style), key=lambda found: _ORDER.index(found.command))
    lines = [_command(annotation) for annotation in annotations]
    return "\n".join(lines or [f"bisar-budget: {_counted(report)}, no findings"]) + "\n"


def _annotations(report: Report, style: Style) -> Iterator[_Annotation]:
    for mission in report.missions:
        file = source_path(mission.file, style)
        if isinstance(mission, UnusableMission):
            for fault in mission.faults:
                yield _Annotation("error", file, _place(fault), "Unusable mission file", str(fault))
            continue
        for one in unseen(mission):
            title = f"{STATUS[one.status].text} {requirement_id(one)}"
            yield _Annotation(STATUS[one.status].github, file, _region(one.line), title, requirement_finding(one))
        if outside := overrides_words(mission):
            yield _Annotation("notice", file, None, "From outside the file", outside)
        for row in worst_first(mission.rows):
            if command := STATUS[row.status].github:
                title = f"{STATUS[row.status].text} {row.id}"
                yield _Annotation(command, file, _region(row.line), title, finding(row, mission))
        for warning in mission.warnings:
            yield _Annotation("warning", file, _region(warning.line), "Mission file", warning.message)


def _place(fault: Fault) -> Region | None:
    return None if fault.line is None else Region(fault.line, fault.column or 1)


def _region(line: int | None) -> Region | None:
    if isinstance(line, Place):
        return line.region
    return None if line is None else Region(line, 1)


def _command(annotation: _Annotation) -> str:
    properties = {"file": annotation.file} if annotation.file != "-" else {}
    region = annotation.region
    if region is not None and properties:  # a line of standard input is no place in a repository
        properties |= {"line": str(region.line)}
        if region.end_line is not None and region.end_line != region.line:
            properties |= {"endLine": str(region.end_line)}  # GitHub takes columns within one line only
        else:
            properties |= {"col": str(region.column)}
            properties |= {"endColumn": str(region.end_column)} if region.end_column is not None else {}
    properties |= {"title": annotation.title}
    written = ",".join(f"{key}={command_property(value)}" for key, value in properties.items())
    return f"::{annotation.command} {written}::{command_text(annotation.message)}"


def _counted(report: Report) -> str:
    count = len(report.missions)
    return f"{count} mission{'s' if count != 1 else ''}"


def step_summary(report: Report, style: Style) -> str:
    """Write the table that GitHub shows on the page of the run, as Markdown."""
    lines = [f"### bisar-budget: {STATUS[report.status].text}, {_counted(report)}", ""]
    lines += ["| status | mission | worst row | use |", "| --- | --- | --- | --- |"]
    for mission in report.missions:
        file = markdown_text(source_path(mission.file, style))
        if isinstance(mission, UnusableMission):
            fault = markdown_text(str(mission.faults[0]))
            lines.append(f"| {STATUS['error'].text} | {file} | {fault} | |")
            continue
        row, use = worst_first(mission.rows)[0], ""
        if row.utilization is not None and row.allowable is not None:
            use = percent(row.utilization)
        if mission.changes:
            file += " " + markdown_text(changes_words(mission.changes))
        if outside := overrides_words(mission, with_changes=False):
            file += "; from outside the file: " + markdown_text(outside)
        status = STATUS[mission.status].text + ("; each error alone" if mission.combine == "each" else "")
        lines.append(f"| {status} | {file} | {markdown_text(row.id)} | {use} |")
    usable = [mission for mission in report.missions if isinstance(mission, MissionFindings)]
    broken = [
        f"- {markdown_text(requirement_finding(one))}"
        for mission in usable
        for one in mission.requirements
        if STATUS[one.status].fails
    ]
    broken += [
        f"- {markdown_text(finding(row, mission))}"
        for mission in usable
        for row in mission.rows
        if STATUS[row.status].fails
    ]
    lines += ["", *broken[:_SHOWN_IN_SUMMARY]] if broken else []
    if len(broken) > _SHOWN_IN_SUMMARY:
        lines.append(f"- and {len(broken) - _SHOWN_IN_SUMMARY} more")
    return "\n".join(lines) + "\n\n"
