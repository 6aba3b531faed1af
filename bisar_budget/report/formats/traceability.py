"""Write every requirement and row for tools that trace them: JUnit XML, and `needs.json` of Sphinx-Needs."""

import json
import re
from collections import Counter
from collections.abc import Container, Iterable, Iterator, Sequence
from functools import cache

from bisar_budget.faults import changes_words
from bisar_budget.findings.mission import MissionFindings, Report, UnusableMission
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.findings.row import Row
from bisar_budget.findings.status import STATUS
from bisar_budget.report import Style
from bisar_budget.report.words.heading import overrides_words
from bisar_budget.report.words.identity import Identity, distinct, identities, stem
from bisar_budget.report.words.requirements import declared_words, requirement_finding, requirement_id, share_columns
from bisar_budget.report.words.sentences import cause, counted, measure, need_text, rst_text, xml_text

_NamedNeed = tuple[tuple[str, ...], dict[str, object]]  # name and fields of a need


def as_junit(report: Report, style: Style) -> str:
    """Write a test suite for each mission, with a test case for each requirement and row.

    The output can be read by GitLab, Jenkins and requirements tools. It follows the schema junit-10 of Jenkins; test
    cases have properties, as in the output of pytest. A broken requirement is a failure, a row that checks no
    requirement is skipped, and an unusable file is an error. A test case with a warning passes, and its output
    contains a remark. All times are 0, so that identical runs give identical reports.

    To keep the file small (a set of missions may have 10⁵ rows), lines are not indented, and a row without a verdict
    has no properties apart from its values.
    """
    counts: Counter[str] = Counter()
    suites: list[str] = []
    mission_identities = identities(report.missions, style)
    class_names = distinct(list(map(_class_name, mission_identities)), [(each.name,) for each in mission_identities])
    for mission, identity, class_name in zip(report.missions, mission_identities, class_names, strict=True):
        suite_keys = xml_text(class_name), identity.path
        suites += _unusable_suite(mission, *suite_keys, counts) if isinstance(mission, UnusableMission) else ()
        suites += _suite_of(mission, *suite_keys, counts) if isinstance(mission, MissionFindings) else ()
    head = f'<testsuites name="bisar-budget" tests="{counts["tests"]}" failures="{counts["failures"]}"'
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', f'{head} errors="{counts["errors"]}" time="0">', *suites]
    return "\n".join([*lines, "</testsuites>"]) + "\n"


def _unusable_suite(mission: UnusableMission, class_name: str, file: str, counts: Counter[str]) -> Iterator[str]:
    counts.update(tests=1, errors=1)
    yield _suite(file, tests=1, failures=0, errors=1, skipped=0)
    yield f'<testcase classname="{class_name}" name="mission file" time="0">'
    message = f"cannot be used, {counted(len(mission.faults), 'fault')}: {mission.faults[0]}"
    fault_lines = [f"{file}:{f.line or '-'}:{f.column or '-'}: {f}" for f in mission.faults]
    text = "\n".join(map(xml_text, fault_lines))
    yield f'<error message="{xml_text(message)}" type="error">{text}</error>'
    yield "</testcase>"
    yield "</testsuite>"


def _suite_of(mission: MissionFindings, class_name: str, file: str, counts: Counter[str]) -> Iterator[str]:
    statuses = [*(requirement.status for requirement in mission.requirements), *(row.status for row in mission.rows)]
    outcomes = Counter(STATUS[name].junit for name in statuses)
    tests, failures = outcomes.total(), outcomes["failure"]
    counts.update(tests=tests, failures=failures)
    yield _suite(mission.name, tests=tests, failures=failures, errors=0, skipped=outcomes["skipped"])
    yield from _properties(
        (
            ("file", file),
            ("budget_status", mission.status),
            ("waived_by", _waived_by(mission)),
            ("model", mission.model),
            ("combine", mission.combine),
            ("confidence", mission.confidence),
            ("set", changes_words(mission.changes) or None),
            ("overrides", overrides_words(mission) or None),
            ("declared_kinds", declared_words(mission.kinds)),
            *((f"document_{name}", value) for name, value in mission.document._asdict().items()),
        )
    )
    file = xml_text(file)
    for requirement in mission.requirements:
        yield from _requirement_case(requirement, mission, class_name, file)
    for row in mission.rows:
        yield from _row_case(row, mission, class_name, file)
    if mission.warnings:
        texts = "\n".join(f"{file}:{w.line or '-'}: {xml_text(w.message)}" for w in mission.warnings)
        yield f"<system-out>{texts}</system-out>"
    yield "</testsuite>"


def _waived_by(judged: MissionFindings | JudgedRequirement | Row) -> str | None:
    """Ids of the waivers that apply, spelled as in the mission file; None if there is no waiver."""
    return "; ".join(waiver.id for waiver in judged.waived_by) or None


def _suite(name: str, *, tests: int, failures: int, errors: int, skipped: int) -> str:
    return (
        f'<testsuite name="{xml_text(name)}" tests="{tests}" failures="{failures}" errors="{errors}" '
        f'skipped="{skipped}" time="0">'
    )


def _requirement_case(
    requirement: JudgedRequirement, mission: MissionFindings, class_name: str, file: str
) -> Iterator[str]:
    yield f'<testcase classname="{class_name}" name="{requirement_id(requirement)}" time="0">'
    values: tuple[tuple[str, object], ...] = (
        ("budget_status", requirement.status),
        ("requirement_id", requirement.requirement_id),
        ("requirement_text", " ".join(mission.texts_of(requirement)) or None),
        ("unit", requirement.unit or None),
        ("value", requirement.value),
        ("allowed", requirement.allowed),
        ("confidence_required", requirement.confidence),
        ("probability", requirement.probability),
        ("reached", requirement.reached),
        ("utilization", requirement.utilization),
        ("decided_by", requirement.row),
        *share_columns(requirement).items(),
        ("line", requirement.line),
        ("waived_by", _waived_by(requirement)),
    )
    yield from _properties(values)
    text = requirement_finding(requirement, mission)
    yield from _outcome(requirement.status, text, text, requirement.line, file)
    yield "</testcase>"


def _row_case(row: Row, mission: MissionFindings, class_name: str, file: str) -> Iterator[str]:
    yield f'<testcase classname="{class_name}" name="{xml_text(row.id)}" time="0">'
    values: tuple[tuple[str, object], ...] = (
        ("requirement_id", row.requirement_id),
        ("requirement_text", " ".join(mission.texts_of(row)) or None),
        ("unit", row.unit),
        ("declared", row.declared),
        ("allowable", row.allowable),
    )
    if STATUS[row.status].is_judged:
        values += (
            ("budget_status", row.status),
            ("metric", row.metric),
            ("binding_requirement", row.binding_requirement),
            ("utilization", row.utilization),
            ("margin", row.margin),
            ("equation", row.equation),
            ("evidence", row.evidence),
            ("line", row.line),
            ("waived_by", _waived_by(row)),
        )
    yield from _properties(values)
    reason, size = cause(row), measure(row, mission)
    remark = f"{size}. {reason}" if reason else size
    if STATUS[row.status].junit == "failure":
        yield from _outcome(row.status, remark, f"{size}\n{reason}\n{row.equation}", row.line, file)
    else:
        yield from _outcome(
            row.status, reason if STATUS[row.status].junit == "skipped" else remark, "", row.line, file
        )
    yield "</testcase>"


def _outcome(status_name: str, message: str, text: str, line: int | None, file: str) -> Iterator[str]:
    """Yield the XML element for the outcome of a test case: failure, skip or remark.

    No element is written if the test case passes without a remark.
    """
    status = STATUS[status_name]
    if status.junit == "failure":
        location = f"{file}:{line}: " if line is not None else ""
        lines = "\n".join(map(xml_text, text.split("\n")))
        yield f'<failure message="{xml_text(message)}" type="{status.name}">{location}{lines}</failure>'
    elif status.junit == "skipped":
        skip_text = f"{status.junit_words}{f': {message}' if message else ''}"
        yield f'<skipped message="{xml_text(skip_text)}" type="{status.name}"/>'
    elif status.junit == "remark":
        yield f"<system-out>{xml_text(f'{status.name}: {message}')}</system-out>"


def _properties(values: Iterable[tuple[str, object]]) -> Iterator[str]:
    """Yield the XML elements for the properties of a test case or suite. Missing values are left out."""
    yield "<properties>"
    yield from [_property(name, value) for name, value in values if value is not None]
    yield "</properties>"


def _property(name: str, value: object) -> str:
    text = _escaped(value) if isinstance(value, str) else repr(value)
    return f'<property name="{name}" value="{text}"/>'


@cache
def _escaped(text: str) -> str:
    """Escape text for XML. Results are cached, because units, equations and sources recur in every mission."""
    return xml_text(text)


def _class_name(identity: Identity) -> str:
    """Dotted name of a mission for grouping in test tools: `missions/a.yaml` becomes `missions.a`."""
    return stem(identity.name).strip("/").replace(".", "_").replace("/", ".")


def as_needs(report: Report, style: Style) -> str:
    """Write `needs.json` with a need for each requirement and row.

    An unusable file is a single need of status `error`. Needs have only fields that every Sphinx-Needs project
    defines, so that importing them gives no warnings. The requirement ids of the project become links. Numbers are
    part of the content, which Sphinx reads as reStructuredText.
    """
    needs: list[_NamedNeed] = []
    for mission, identity in zip(report.missions, identities(report.missions, style), strict=True):
        file = identity.path
        if isinstance(mission, UnusableMission):
            needs.append((identity.of("mission"), _unusable_need(mission, file)))
            continue
        for requirement in mission.requirements:
            name = identity.of(requirement_id(requirement), *requirement.requirement_ids[:1])
            needs.append((name, _requirement_need(requirement, mission, file)))
        for row in mission.rows:
            needs.append((identity.of(row.id, *row.requirement_ids[:1]), _row_need(row, mission, file)))
    return needs_document(report.version, "BUDGET", needs)


def needs_document(version: str, prefix: str, named_needs: Sequence[_NamedNeed]) -> str:
    """Write needs as `needs.json`. The id of a need consists of the prefix and the items of its name."""
    names = [name for name, _ in named_needs]
    needs: dict[str, dict[str, object]] = {}
    ids = distinct([identifier(prefix, name) for name in names], names)
    for preferred, (_, need) in zip(ids, named_needs, strict=True):
        unique = _unused(preferred, needs)
        needs[unique] = {"id": unique, **need}
    current = {
        "creator": {"program": "bisar-budget", "version": version},
        "needs": needs,
        "needs_amount": len(needs),
    }
    document = {"project": "bisar-budget", "current_version": version, "versions": {version: current}}
    return json.dumps(document, indent=1, allow_nan=False) + "\n"


def identifier(prefix: str, name: tuple[str, ...]) -> str:
    """Make an id from a name. The id matches the default pattern of Sphinx-Needs, `[A-Z0-9_]{5,}`."""
    return "_".join([prefix, *(re.sub("[^A-Z0-9]+", "_", stem(part).upper()).strip("_") for part in name)])


def _unused(identifier: str, needs: Container[str]) -> str:
    """Make an identifier unique.

    If `needs` already contains it, for example because a file is given twice, a number is appended, starting with 2.
    """
    unique, number = identifier, 2
    while unique in needs:
        unique, number = f"{identifier}_{number}", number + 1
    return unique


def _row_need(row: Row, mission: MissionFindings, file: str) -> dict[str, object]:
    texts = [*mission.texts_of(row), measure(row, mission), cause(row), f"From {row.equation}."]
    texts += [f"Evidence: {row.evidence}"] if row.evidence else []
    texts += origin(row.line, mission, file)
    return _need(f"{row.id} of {mission.name}", row.status, texts, row.metric, links=row.requirement_ids)


def _requirement_need(requirement: JudgedRequirement, mission: MissionFindings, file: str) -> dict[str, object]:
    texts = [
        *mission.texts_of(requirement),
        requirement_finding(requirement, mission),
        *origin(requirement.line, mission, file),
    ]
    title, tags = f"{requirement.name} of {mission.name}", ("requirement", requirement.key)
    return _need(title, requirement.status, texts, *tags, links=requirement.requirement_ids)


def _unusable_need(mission: UnusableMission, file: str) -> dict[str, object]:
    texts = [f"{fault.line or '-'}:{fault.column or '-'} {fault}" for fault in mission.faults]
    return _need(f"{file} cannot be used", mission.status, texts)


def _need(title: str, status: str, texts: Sequence[str], *tags: str, links: Sequence[str] = ()) -> dict[str, object]:
    return {
        "type": "test",
        "title": need_text(title),
        "status": status,
        "tags": ["bisar-budget", *tags],
        "links": [need_text(link) for link in links],
        "content": "\n\n".join(rst_text(text) for text in texts if text),
    }


def origin(line: int | None, mission: MissionFindings, file: str) -> Iterator[str]:
    """Yield strings about the origin of a value.

    They give the mission, the file and the line, and then the changes and overrides from outside the file.
    """
    yield f"{mission.name}, {file}" + (f":{line}" if line is not None else "")
    if mission.changes:
        yield f"Not as the file says: {changes_words(mission.changes)}"
    if outside := overrides_words(mission, with_changes=False):
        yield f"Overrides: {outside}"
