"""Annotate mission files with the findings that need attention: as GitHub workflow commands and as SARIF 2.1.0.

Each finding points to a value in the mission file. Rows are left out if they pass, if no requirement applies to them,
or if they are not declared. A requirement that is broken or waived is a separate finding if none of its rows has the
same status. If values from outside override the mission file, this is also reported as a finding.
"""

import json
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from bisar_budget.faults import Fault, Place, Region, changes_words, printable, sentences
from bisar_budget.findings.mission import MissionFindings, Report, UnusableMission
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.findings.row import AppliedWaiver, Row, worst_first
from bisar_budget.findings.status import STATUS
from bisar_budget.report import Style
from bisar_budget.report.words.heading import overrides_words
from bisar_budget.report.words.identity import Identity, digest, identities, source_path
from bisar_budget.report.words.requirements import (
    confidence_words,
    requirement_finding,
    requirement_id,
    share_columns,
    shown_ids,
    unseen,
)
from bisar_budget.report.words.sentences import (
    command_property,
    command_text,
    counted,
    finding,
    markdown_row,
    markdown_text,
    percent,
    uri,
    waiver_names,
)

_Object = dict[str, object]  # an object of SARIF, which is JSON

_COMMANDS_WORST_FIRST = ("error", "warning", "notice")
_MAX_SUMMARY_LINES = 20


class _Annotation(NamedTuple):
    command: str
    file: str
    region: Region | None
    title: str
    message: str


def as_github(report: Report, style: Style) -> str:
    """Write one GitHub workflow command for each finding, worst first.

    If there are no findings, the output is a single line, which is not a command.

    A GitHub runner shows at most ten errors and ten warnings per step.
    """
    annotations = sorted(
        _annotations(report, style), key=lambda annotation: _COMMANDS_WORST_FIRST.index(annotation.command)
    )
    lines = [_command(annotation) for annotation in annotations]
    return "\n".join(lines or [f"bisar-budget: {counted(len(report.missions), 'mission')}, no findings"]) + "\n"


def _annotations(report: Report, style: Style) -> Iterator[_Annotation]:
    for mission in report.missions:
        file = source_path(mission.file, style)
        if isinstance(mission, UnusableMission):
            for fault in mission.faults:
                yield _Annotation("error", file, _fault_region(fault), "Unusable mission file", str(fault))
            continue
        for requirement in unseen(mission):
            title = f"{STATUS[requirement.status].text} {requirement_id(requirement)}"
            text = requirement_finding(requirement, mission)
            yield _Annotation(STATUS[requirement.status].github, file, _region_of(requirement.line), title, text)
        if overrides := overrides_words(mission):
            yield _Annotation("notice", file, None, "Overrides", overrides)
        for row in worst_first(mission.rows):
            if command := STATUS[row.status].github:
                title = f"{STATUS[row.status].text} {row.id}"
                yield _Annotation(command, file, _region_of(row.line), title, _finding(row, mission))
        for warning in mission.warnings:
            yield _Annotation("warning", file, _region_of(warning.line), "Mission file", warning.message)


def _finding(row: Row, mission: MissionFindings) -> str:
    """Sentence about a row, with the ids of its broken or waived requirements that have the same status."""
    ids = shown_ids(row, mission)
    return sentences(finding(row, mission), f"Requirement: {', '.join(ids)}" if ids else "")


def _fault_region(fault: Fault) -> Region | None:
    return None if fault.line is None else Region(fault.line, fault.column or 1)


def _region_of(line: int | None) -> Region | None:
    if isinstance(line, Place):
        return line.region
    return None if line is None else Region(line, 1)


def _command(annotation: _Annotation) -> str:
    properties = {"file": annotation.file} if annotation.file != "-" else {}
    region = annotation.region
    if region is not None and properties:  # standard input has no lines in a repository
        properties |= {"line": str(region.line)}
        if region.end_line is not None and region.end_line != region.line:
            properties |= {"endLine": str(region.end_line)}  # GitHub takes columns within one line only
        else:
            properties |= {"col": str(region.column)}
            properties |= {"endColumn": str(region.end_column)} if region.end_column is not None else {}
    properties |= {"title": annotation.title}
    property_text = ",".join(f"{key}={command_property(value)}" for key, value in properties.items())
    return f"::{annotation.command} {property_text}::{command_text(annotation.message)}"


def step_summary(report: Report, style: Style) -> str:
    """Write the Markdown table of findings that GitHub shows on the summary page of a workflow run."""
    missions = counted(len(report.missions), "mission")
    lines = [f"### bisar-budget: {STATUS[report.status].text}, {missions}", ""]
    lines += [markdown_row(("status", "mission", "worst row", "use")), markdown_row(["---"] * 4)]
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
        if overrides := overrides_words(mission, with_changes=False):
            file += "; overrides: " + markdown_text(overrides)
        status = (
            STATUS[mission.status].text
            + confidence_words(mission)
            + ("; each error alone" if mission.combine == "each" else "")
        )
        if mission.waived_by:
            file += "; " + markdown_text(waiver_names([waiver.id for waiver in mission.waived_by]))
        lines.append(markdown_row((status, file, markdown_text(row.id), use)))
    usable = [mission for mission in report.missions if isinstance(mission, MissionFindings)]
    failures = [
        requirement_finding(requirement, mission)
        for mission in usable
        for requirement in mission.requirements
        if STATUS[requirement.status].fails
    ]
    failures += [finding(row, mission) for mission in usable for row in mission.rows if STATUS[row.status].fails]
    lines += ["", *(f"- {markdown_text(text)}" for text in failures[:_MAX_SUMMARY_LINES])] if failures else []
    if len(failures) > _MAX_SUMMARY_LINES:
        lines.append(f"- and {len(failures) - _MAX_SUMMARY_LINES} more")
    return "\n".join(lines) + "\n\n"


SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
SRCROOT = "%SRCROOT%"

# Rule id: title of the rule, and its explanation with remedies.
ANNOTATION_RULES = {
    "quadratic_phase_error": (
        "Quadratic phase error within its share of the budget",
        "An error of motion or clock may add at most its owner's share of requirements.quadratic_phase_error at the "
        "aperture edge (Rigling & Moses, Tables I and II). Declare a smaller error, give its owner a larger share, "
        "shorten the aperture, or let autofocus correct it (autofocus.n_pull).",
    ),
    "pslr": (
        "Paired echoes of a vibration within the platform's share of PSLR",
        "A sinusoidal vibration along the line of sight makes paired echoes, which requirements.pslr bounds "
        "(Rigling & Moses, Section V). Damp the vibration or allow higher echoes; autofocus does not help.",
    ),
    "islr": (
        "Power spread by a vibration within the platform's share of ISLR",
        "A wideband vibration along the line of sight spreads power, which requirements.islr bounds "
        "(Rigling & Moses, Section V). Damp the vibration or allow more power; autofocus does not help.",
    ),
    "cubic_phase_error": (
        "Cubic phase error within its requirement",
        "The cubic phase error at the aperture edge may be at most requirements.cubic_phase_error (Rigling & Moses, "
        "Table I, cubic column). Declare smaller errors or shorten the aperture; autofocus gain does not apply.",
    ),
    "location_error": (
        "Displacement of the image within its requirement",
        "Errors displace the image on the ground, by equation (25) of Rigling & Moses or by exact ranges. "
        "The displacement may be at most requirements.location_error. Declare smaller position, velocity or clock "
        "errors; autofocus does not help.",
    ),
    "declare": (
        "Everything declared that must be",
        "requirements.declare names errors that the file must declare. What is missing is not evaluated: declare it, "
        "a zero where there is none.",
    ),
    "specification": (
        "Declared error within its specification",
        "An error may be at most what specifications says of it. Take a part that meets the specification, or find "
        "new specifications with `bisar-budget allocate` that leave it more.",
    ),
    "autofocus_pull_in": (
        "All errors together within what autofocus corrects",
        "Autofocus corrects one total of n_pull·π radians, not each error separately (Rigling & Moses, Section VI). "
        "Raise autofocus.n_pull if the algorithm allows, or declare smaller errors.",
    ),
    "other": (
        "Declared value within its limit",
        "A declared value is held to a limit; the message says to which and from where.",
    ),
    "mission_file": (
        "Warnings about the mission file itself",
        "An entry of the mission file has no effect or is in doubt: a waiver or a requirement id that names no row, "
        "a file that declares no error, an n_pull beyond range walk. Correct the entry or remove it.",
    ),
}
_RULE_INDEX = {rule: index for index, rule in enumerate(ANNOTATION_RULES)}


def as_sarif(report: Report, style: Style) -> str:
    """Write a SARIF log with one run, for code scanning and editors.

    A waived finding becomes a result with a suppression. Faults of an unusable file become tool notifications.
    """
    results: list[_Object] = []
    notifications = []
    artifacts: dict[str, _Object] = {}  # by URI: a file may be named in two ways
    for mission, identity in zip(report.missions, identities(report.missions, style), strict=True):
        location = _artifact_location(mission.file, style)
        artifacts.setdefault(location["uri"], {"location": location, "mimeType": "application/yaml"})
        artifact: _Object = {**location, "index": list(artifacts).index(location["uri"])}
        if isinstance(mission, UnusableMission):
            notifications += [_notification(fault, artifact) for fault in mission.faults]
            continue
        results += [_requirement(requirement, mission, artifact, identity) for requirement in unseen(mission)]
        results += [_result(row, mission, artifact, identity) for row in mission.rows if STATUS[row.status].sarif]
        results += [
            _located("mission_file", "warning", warning.message, warning.line, artifact, identity.of(warning.message))
            for warning in mission.warnings
        ]
        if overrides := overrides_words(mission):
            text = f"Overrides: {overrides}"
            name = identity.of("from outside the file")
            results.append(_located("mission_file", "note", text, None, artifact, name))
    run = {
        "tool": {"driver": _driver(report.version)},
        "columnKind": "unicodeCodePoints",
        "invocations": [
            {"executionSuccessful": not notifications, "toolExecutionNotifications": notifications},
        ],
        "artifacts": list(artifacts.values()),
        "results": results,
    }
    return json.dumps({"$schema": SCHEMA, "version": "2.1.0", "runs": [run]}, allow_nan=False) + "\n"


def _driver(version: str) -> _Object:
    return {
        "name": "bisar-budget",
        "version": version,
        "rules": [_rule(rule, short, help_text) for rule, (short, help_text) in ANNOTATION_RULES.items()],
        "notifications": [
            {
                "id": "unusable_mission",
                "name": "UnusableMission",
                "shortDescription": {"text": "A mission file that cannot be used; nothing in it was judged"},
            }
        ],
    }


def _rule(rule: str, short: str, help_text: str) -> _Object:
    is_remark = rule in ("mission_file", "autofocus_pull_in")
    return {
        "id": rule,
        "name": rule.title().replace("_", ""),
        "shortDescription": {"text": short},
        "fullDescription": {"text": help_text},
        "help": {"text": help_text},
        "defaultConfiguration": {"level": "warning" if is_remark else "error"},
        "properties": {
            "precision": "very-high",
            "problem.severity": "warning" if is_remark else "error",
            "tags": ["bistatic-sar"],
        },
    }


def _artifact_location(file: str, style: Style) -> dict[str, str]:
    path = "standard input" if file == "-" else source_path(file, style)
    address = uri(path)
    return {"uri": address} if address.startswith("file:") else {"uri": address, "uriBaseId": SRCROOT}


def _result(row: Row, mission: MissionFindings, artifact: _Object, identity: Identity) -> _Object:
    kind = row.subject.facts
    rule = kind.name if kind.only_warns else row.metric
    rule = rule if rule in ANNOTATION_RULES else "other"
    name = identity.of(row.id, *row.requirement_ids[:1])
    result = _located(rule, STATUS[row.status].sarif, _finding(row, mission), row.line, artifact, name)
    result["properties"] = _properties(
        mission,
        status=row.status,
        metric=row.metric,
        unit=row.unit,
        declared=row.declared,
        bias=row.bias,
        allowable=row.allowable,
        binding_requirement=row.binding_requirement,
        utilization=row.utilization,
        margin=row.margin,
        equation=row.equation,
        requirement_id=", ".join(dict.fromkeys([*row.requirement_ids, *shown_ids(row, mission)])) or None,
        evidence=row.evidence,
    )
    return result | _suppressed(row.status, row.waivers, artifact)


def _requirement(
    requirement: JudgedRequirement, mission: MissionFindings, artifact: _Object, identity: Identity
) -> _Object:
    level = STATUS[requirement.status].sarif
    name = identity.of(requirement_id(requirement), *requirement.requirement_ids[:1])
    result = _located(
        requirement.key, level, requirement_finding(requirement, mission), requirement.line, artifact, name
    )
    result["properties"] = _properties(
        mission,
        status=requirement.status,
        metric=requirement.key,
        unit=requirement.unit or None,
        declared=requirement.reached,
        allowable=requirement.allowed,
        utilization=requirement.utilization,
        decided_by=requirement.row,
        requirement_id=requirement.requirement_id,
        **share_columns(requirement),
        confidence_required=requirement.confidence,
        probability=requirement.probability,
    )
    return result | _suppressed(requirement.status, requirement.waivers, artifact)


def _properties(mission: MissionFindings, **values: str | float | None) -> dict[str, str | float]:
    """SARIF properties of a finding and its mission.

    Missing values are left out, and unprintable characters in strings are made printable.
    """
    values = {
        "mission": mission.name,
        "confidence": mission.confidence,
        **values,
        "overrides": overrides_words(mission) or None,
    }
    return {
        key: printable(value) if isinstance(value, str) else value
        for key, value in values.items()
        if value is not None
    }


def _located(
    rule: str, level: str, message: str, line: int | None, artifact: _Object, name: tuple[str, ...]
) -> _Object:
    """Make a SARIF result, with its location in the mission file and with a fingerprint.

    The fingerprint depends on `rule` and on `name`. `name` identifies the finding, and does not change when lines in
    the file move. Its last item is the subject of the finding.
    """
    return {
        "ruleId": rule,
        "ruleIndex": _RULE_INDEX[rule],
        "level": level,
        "message": {"text": printable(message)},
        "locations": [
            {
                **_location(artifact, _sarif_region(line)),
                "logicalLocations": [{"fullyQualifiedName": printable(name[-1]), "kind": "member"}],
            }
        ],
        # Code scanning recognises an old alert by this key alone.
        "partialFingerprints": {"primaryLocationLineHash": digest(rule, *name)[:16] + ":1"},
    }


def _location(artifact: _Object, region: dict[str, int]) -> _Object:
    return {"physicalLocation": {"artifactLocation": artifact, "region": region}}


def _sarif_region(line: int | None) -> dict[str, int]:
    if not isinstance(line, Place):
        return {"startLine": 1 if line is None else line}
    start, column, end, end_column = line.region
    region = {"startLine": start, "startColumn": column}
    if end is not None and end_column is not None:
        region |= {"endLine": end, "endColumn": end_column}
    return region


def _suppressed(status: str, waivers: Sequence[AppliedWaiver], artifact: _Object) -> _Object:
    """Make the SARIF suppression of a waived finding from the first waiver that has not expired.

    The result is empty if the status is not `waived`.

    The kind of the suppression is `inSource`, because the waiver is written in the checked file.
    """
    if status != "waived" or not waivers:
        return {}
    waiver = next(waiver for waiver in waivers if not waiver.is_expired)
    suppression = {
        "kind": "inSource",
        "status": "accepted",
        "justification": printable(waiver.reason),
        "location": _location(artifact, {"startLine": int(waiver.line or 1)}),
        "properties": {"id": printable(waiver.id), "until": waiver.until.isoformat()},
    }
    return {"suppressions": [suppression]}


def _notification(fault: Fault, artifact: _Object) -> _Object:
    region: dict[str, int] = {"startLine": fault.line or 1}
    if fault.column is not None:
        region["startColumn"] = fault.column
    return {
        "descriptor": {"id": "unusable_mission", "index": 0},
        "level": "error",
        "message": {"text": printable(str(fault))},
        "locations": [_location(artifact, region)],
    }
