"""Write documents for StrictDoc that contain the requirements of missions and the results of their check.

The syntax is that of StrictDoc 0.30 (user guide, "Document syntax"). Texts are written as plain text, not as
reStructuredText.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from bisar_budget.faults import printable
from bisar_budget.findings.mission import MissionFindings, Report, UnusableMission
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.findings.row import DECLARE, Row
from bisar_budget.findings.status import worst
from bisar_budget.report import Style
from bisar_budget.report.formats.requirement_list import limit_of_file
from bisar_budget.report.formats.traceability import identifier, origin
from bisar_budget.report.words.identity import Identity, distinct, identities
from bisar_budget.report.words.requirements import requirement_finding, requirement_id
from bisar_budget.report.words.sentences import confidence_asked, finding, row_limit


@dataclass(frozen=True)
class StrictNode:
    """A node of a StrictDoc document: its fields in the order of the grammar, and the UIDs of its parents."""

    fields: Mapping[str, str]
    parents: Sequence[str] = ()
    tag: str = "REQUIREMENT"


def strict_document(title: str, grammar: Mapping[str, Mapping[str, bool]], nodes: Iterable[StrictNode]) -> str:
    """Write a document in the format of StrictDoc. Fields without text are left out.

    Parameters
    ----------
    title : str
        Title of the document.
    grammar : mapping
        For each node tag, a mapping from the names of its fields to booleans that are true for required fields.
    nodes : iterable of StrictNode
        Nodes in the order of the document.
    """
    lines = ["[DOCUMENT]", f"TITLE: {printable(title)}", "OPTIONS:", "  MARKUP: Text", "", "[GRAMMAR]", "ELEMENTS:"]
    for tag, fields in grammar.items():
        lines += [f"- TAG: {tag}", "  FIELDS:"]
        for name, is_required in fields.items():
            lines += [f"  - TITLE: {name}", "    TYPE: String", f"    REQUIRED: {is_required}"]
        lines += ["  RELATIONS:", "  - TYPE: Parent"]
    lines.append("")
    for node in nodes:
        lines.append(f"[{node.tag}]")
        lines += [f"{name}: {printable(text).strip()}" for name, text in node.fields.items() if text.strip()]
        lines += ["RELATIONS:"] if node.parents else []
        lines += [line for parent in node.parents for line in ("- TYPE: Parent", f"  VALUE: {parent}")]
        lines.append("")
    return "\n".join(lines)


def strict_uid(own_id: str) -> str:
    """Convert a requirement id of the project to a UID. Characters that StrictDoc rejects become underscores."""
    uid = re.sub(r"[^\w()\-/.: ]", "_", own_id.strip())
    return uid if re.match(r"\w", uid) else f"_{uid}"


# ---------------------------------------------------------------------- requirements of missions
_NAME_PREFIX = "BUDGET"  # of ids that the project does not give, as in needs.json
_RESULT = "RESULT"
_CHECK_GRAMMAR = {
    "REQUIREMENT": {
        "UID": True,
        "STATUS": True,
        "TITLE": True,
        "STATEMENT": True,
        "KEY": False,
        "LIMIT": False,
        "COMMENT": False,
    },
    _RESULT: {"UID": True, "STATUS": True, "TITLE": True, "STATEMENT": True, "COMMENT": False},
}
_UidName = tuple[str, ...]  # an id of the project, or the name of a finding as in needs.json


@dataclass
class _Required:
    """A requirement node of the document.

    Several missions may share a node, as may several requirements and rows of a mission.
    """

    titles: list[str] = field(default_factory=list)
    statements: list[str] = field(default_factory=list)
    statuses: list[str] = field(default_factory=list)
    keys: list[str] = field(default_factory=list)
    limits: list[str] = field(default_factory=list)
    findings: list[str] = field(default_factory=list)

    def node(self, uid: str) -> StrictNode:
        """Make the node with the given UID. Its status is the worst status in `statuses`."""
        fields = {"UID": uid, "STATUS": worst(self.statuses), "TITLE": _unique(self.titles)}
        texts = {"STATEMENT": _unique(self.statements, " "), "KEY": _unique(self.keys), "LIMIT": _unique(self.limits)}
        return StrictNode(fields | texts | {"COMMENT": _unique(self.findings)})


@dataclass
class _Result:
    """A result node of the document, with the names of the requirements that are its parents."""

    status: str
    title: str
    statement: str
    origin: str = ""
    required: list[_UidName] = field(default_factory=list)


def _unique(texts: Sequence[str], separator: str = "; ") -> str:
    """Join the strings that are not empty. A string that occurs several times is written once."""
    return separator.join(dict.fromkeys(filter(None, texts)))


def as_sdoc(report: Report, style: Style) -> str:
    """Write the requirements of missions as nodes, and the results that decide their status as child nodes.

    A requirement has the ids that the project gives it, or else an id as in `needs.json`. If several requirements,
    rows or missions share an id, they have a common node with the worst of their statuses. A result node is written
    for a row that decides a requirement, for a row with a requirement id of the project, and for a requirement that
    no row decides. For a mission file that cannot be used, there is a result without a requirement.
    """
    required: dict[_UidName, _Required] = {}
    results: dict[_UidName, _Result] = {}
    for mission, identity in zip(report.missions, identities(report.missions, style), strict=True):
        if isinstance(mission, UnusableMission):
            text = "; ".join(map(str, mission.faults))
            results[identity.of("mission")] = _Result(mission.status, f"{identity.path} cannot be used", text)
        else:
            _add_requirements(mission, identity, required, results)
            _add_rows(mission, identity, required, results)
    names = [*required, *results]
    spellings = [strict_uid(name[0]) if len(name) == 1 else identifier(_NAME_PREFIX, name) for name in names]
    uids = dict(zip(names, distinct(spellings, names), strict=True))
    nodes = [node.node(uids[name]) for name, node in required.items()]
    for name, result in results.items():
        fields = {"UID": uids[name], "STATUS": result.status, "TITLE": result.title}
        fields |= {"STATEMENT": result.statement, "COMMENT": result.origin}
        parents = [uids[parent] for parent in dict.fromkeys(result.required)]
        nodes.append(StrictNode(fields, parents, _RESULT))
    title = f"requirements and results, by bisar-budget {report.version}"
    return strict_document(title, _CHECK_GRAMMAR, nodes)


def _add_requirements(
    mission: MissionFindings,
    identity: Identity,
    required: dict[_UidName, _Required],
    results: dict[_UidName, _Result],
) -> None:
    """Add the requirements of a mission to `required`, and the rows that decide them to `results`.

    If no row decides a requirement, the requirement itself is added to `results`.
    """
    rows = {row.id: row for row in mission.rows}
    for requirement in mission.requirements:
        name = identity.of(requirement_id(requirement))
        above: list[_UidName] = [(own_id,) for own_id in requirement.requirement_ids] or [name]
        for requirement_name in above:
            node = required.setdefault(requirement_name, _Required())
            node.titles.append(f"{requirement.name} of {mission.name}")
            node.statements.append(_text_of(requirement_name, mission) or _sentence(requirement, mission))
            node.statuses.append(requirement.status)
            node.keys.append(requirement.key)
            node.limits.append(limit_of_file(requirement, mission))
            node.findings.append(requirement_finding(requirement, mission))
        row = rows.get(requirement.row or "")
        if row is not None:
            _result_of(row, mission, identity, results).required += above
        else:
            result_name = (*name, "result")
            title, text = f"result for {requirement.name}, {mission.name}", requirement_finding(requirement, mission)
            origin_words = _origin_words(requirement.line, mission, identity)
            results[result_name] = _Result(requirement.status, title, text, origin_words, list(above))


def _add_rows(
    mission: MissionFindings,
    identity: Identity,
    required: dict[_UidName, _Required],
    results: dict[_UidName, _Result],
) -> None:
    """Add the requirement ids of a mission's rows to `required`, and the results of these rows to `results`."""
    for row in mission.rows:
        for own_id in row.requirement_ids:
            node = required.setdefault((own_id,), _Required())
            node.titles.append(f"{row.id} of {mission.name}")
            node.statements.append(mission.requirement_texts.get(own_id) or _row_sentence(row, mission))
            node.statuses.append(row.status)
            node.keys.append(row.id)
            _result_of(row, mission, identity, results).required.append((own_id,))


def _result_of(row: Row, mission: MissionFindings, identity: Identity, results: dict[_UidName, _Result]) -> _Result:
    """Return the result of a row. If `results` does not contain it yet, it is added."""
    texts = (f"{row.id} of {mission.name}", finding(row, mission), _origin_words(row.line, mission, identity))
    return results.setdefault(identity.of(row.id), _Result(row.status, *texts))


def _origin_words(line: int | None, mission: MissionFindings, identity: Identity) -> str:
    return "; ".join(origin(line, mission, identity.path))


def _text_of(name: _UidName, mission: MissionFindings) -> str:
    """Wording that a mission file gives for a requirement of the project, found by the id of the requirement.

    It is empty if the file gives no wording for the id, or if `name` refers to a finding without an id of the
    project.
    """
    return mission.requirement_texts.get(name[0], "") if len(name) == 1 else ""


def _sentence(requirement: JudgedRequirement, mission: MissionFindings) -> str:
    """Write a sentence that states a requirement for which the project gives no text."""
    limit = limit_of_file(requirement, mission)
    if requirement.key == DECLARE:
        return f"The mission file shall declare the errors {limit}."
    confidence = confidence_asked(requirement)
    return f"The {requirement.name} shall be at most {limit}{confidence and f' with {confidence} confidence'}."


def _row_sentence(row: Row, mission: MissionFindings) -> str:
    """Write a sentence that states the limit of a row as a requirement.

    It is used if the project gives no text for the requirement.
    """
    if row.allowable is None:
        return f"{row.id} shall comply with the budget."
    return f"{row.id} shall be at most {row_limit(row, mission)}."
