"""Output of the `diff` command: the effects of a change on missions, and the refusals of a gate.

A gate refuses a change that uses up too much of a margin or loosens a rule.
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from bisar_budget.faults import printable
from bisar_budget.findings.row import Row
from bisar_budget.findings.status import STATUS
from bisar_budget.report import Style
from bisar_budget.report import document as doc
from bisar_budget.report.answers import Records
from bisar_budget.report.answers.check_content import outside_item
from bisar_budget.report.answers.shared_blocks import mission_document
from bisar_budget.report.change.comparison import (
    Change,
    ChangeSet,
    Gate,
    MissionChange,
    Moved,
    Refusal,
)
from bisar_budget.report.words.heading import file_words, other_overrides
from bisar_budget.report.words.sentences import counted, percent, row_size
from bisar_budget.units import format_quantity


class Compared(NamedTuple):
    """A comparison and the gate that judges it. If `all_rows`, rows that changed by less than 1 % are shown too."""

    changes: ChangeSet
    gate: Gate | None
    all_rows: bool = False


# ---------------------------------------------------------------- for programs
def content(answers: Sequence[Compared]) -> dict[str, object]:
    """Content of the JSON document `diff/1`.

    Later versions of the format may add keys, but never change or remove them.
    """
    ((comparison, gate, _),) = answers
    return {
        "tolerated_erosion": None if gate is None else gate.tolerated,
        "allow": [] if gate is None else list(gate.allowed),
        "allow_unused": [] if gate is None else comparison.unused(gate),
        "gone": comparison.gone,
        "new": comparison.new,
        "settings": [loosened._asdict() for loosened in comparison.settings],
        "outside_repository": comparison.outside,
        "refused": [_refusal(refusal) for refusal in _refusals(comparison, gate)],
        "missions": [_mission(mission, gate) for mission in comparison.missions],
    }


def _mission(mission: MissionChange, gate: Gate | None) -> dict[str, object]:
    refusals = _refusals(mission, gate)
    refused = {refusal.id for refusal in refusals if not refusal.is_allowed}
    return {
        **{
            name: {
                "file": findings.file,
                "status": findings.status,
                "waived_by": [waiver.id for waiver in findings.waived_by],
                **outside_item(findings),
            }
            for name, findings in (("before", mission.before), ("after", mission.after))
        },
        "unchanged": mission.unchanged,
        "inputs": [{"key": move.name, "before": move.before, "after": move.after} for move in mission.inputs],
        "geometry": [move._asdict() for move in mission.geometry],
        "requirements": [
            {**requirement._asdict(), "is_newly_failing": requirement.is_newly_failing}
            for requirement in mission.requirements
        ],
        "loosened": [loosened._asdict() for loosened in mission.loosened],
        "refused": [_refusal(refusal) for refusal in refusals],
        "rows": [_document(change, change.id in refused) for change in mission.changes],
    }


def _refusal(refusal: Refusal) -> dict[str, object]:
    return {"id": refusal.id, "reason": refusal.words, "is_allowed": refusal.is_allowed}


def _document(change: Change, is_refused: bool) -> dict[str, object]:
    keys = ("status", "declared", "allowable", "utilization", "margin", "line", "requirement_id", "requirement_ids")
    return {
        "id": change.id,
        "erosion": change.erosion,
        "is_newly_failing": change.is_newly_failing,
        "is_refused": is_refused,
        **{
            name: None if row is None else {key: getattr(row, key) for key in keys}
            for name, row in (("before", change.before), ("after", change.after))
        },
    }


_COMPARED_KEYS = ("status", "declared", "allowable", "utilization")
_DIFF_COLUMNS = (
    "file", "kind", "id", "before", "after", "erosion", "is_newly_failing", "is_refused",
    *(f"{key}_{side}" for key in _COMPARED_KEYS for side in ("before", "after")),
)  # fmt: skip


def records(answers: Sequence[Compared]) -> Records:
    """Table of the answer: one line for each changed row, requirement and input, and for each refusal.

    The column `kind` distinguishes these lines. The columns `before` and `after` have the values of inputs and
    geometry, the statuses of requirements, and the reasons of refusals, as text.
    """
    lines: list[dict[str, object]] = []
    for comparison, gate, _ in answers:
        for mission in comparison.missions:
            item = {"file": mission.after.file}
            refused = {refusal.id for refusal in _refusals(mission, gate) if not refusal.is_allowed}
            lines += [{**item, **_row_line(change, change.id in refused)} for change in mission.changes]
            lines += [
                {**item, "kind": change.label, "id": change.name, "before": change.before, "after": change.after}
                for change in (*_changed(mission, gate), *_refused(mission, gate))
            ]
        lines += [
            {"kind": change.label, "id": change.name, "before": change.before, "after": change.after}
            for change in _refused(comparison, gate)
        ]
    return Records(_DIFF_COLUMNS, lines)


def _row_line(change: Change, is_refused: bool) -> dict[str, object]:
    sides = (("before", change.before), ("after", change.after))
    return {
        "kind": "row",
        "id": change.id,
        "erosion": change.erosion,
        "is_newly_failing": change.is_newly_failing,
        "is_refused": is_refused,
        **{
            f"{key}_{side}": None if row is None else getattr(row, key)
            for key in _COMPARED_KEYS
            for side, row in sides
        },
    }


# ---------------------------------------------------------------- for people
def document(answers: Sequence[Compared], style: Style) -> doc.AnswerDocument:
    """Text of the answer: the changes of each mission, with a table of the changed rows, the largest erosion first.

    The erosion is the fraction of a row's margin that the change uses up.
    """
    chapters: list[doc.Chapter] = []
    for comparison, gate, all_rows in answers:
        for number, mission in enumerate(comparison.missions, 1):
            blocks = list(_blocks(mission, gate, all_rows))
            name = printable(mission.after.name)
            chapters.append(doc.Chapter(name, blocks, f"mission-{number}", level=2, is_article=True))
        if run := list(_run_blocks(comparison, gate)):
            chapters.append(doc.Chapter("Run", run, "run", level=2, is_article=True))
    missions = [mission.after for comparison, _, _ in answers for mission in comparison.missions]
    return mission_document("Effects of a change", missions, chapters)


def _blocks(mission: MissionChange, gate: Gate | None, all_rows: bool) -> Iterator[doc.Block]:
    files = f"{printable(mission.before.file)} → {file_words(mission.after)}"
    name = printable(mission.after.name)
    is_worse = (
        any(not refusal.is_allowed for refusal in _refusals(mission, gate))
        or any(change.is_newly_failing for change in mission.changes)
        or any(requirement.is_newly_failing for requirement in mission.requirements)
    )
    summary = _summary(mission, gate, all_rows)
    yield doc.Opening(summary, "fail" if is_worse else "pass", files, name, overrides=other_overrides(mission.after))
    yield from _groups(_changed(mission, gate))
    if changes := _shown(mission, gate, all_rows):
        heads = [
            doc.Head("row"),
            *doc.numbers("declared", "allowable", medium=doc.PAGE),
            *doc.numbers("before", "after", "erosion"),
            doc.Head("status"),
        ]
        rows: list[doc.Line] = [
            [
                doc.Name(change.id),
                _values(change, "declared", mission),
                _values(change, "allowable", mission),
                _use(change.before),
                _use(change.after),
                _erosion(change),
                _statuses(change),
            ]
            for change in changes
        ]
        yield doc.TextTable(
            "Changed rows", "Use of the limits before and after the change, the largest erosion first", heads, rows
        )
    yield from _groups(_refused(mission, gate))


def _run_blocks(comparison: ChangeSet, gate: Gate | None) -> Iterator[doc.Block]:
    yield from _groups(_refused(comparison, gate))
    if sentences := _run_sentences(comparison, gate):
        yield doc.Items([[text] for text in sentences])


def _run_sentences(comparison: ChangeSet, gate: Gate | None) -> list[str]:
    """Sentences about the run: new and removed missions, settings, files outside the repository, unused `--allow`."""
    sentences = [f"{file}: new, there is nothing to compare it with" for file in comparison.new]
    if gate is None:
        sentences += [f"{file}: the mission file is gone" for file in comparison.gone]
        sentences += [f"{loosened.id}: {loosened.words}" for loosened in comparison.settings]
    else:
        sentences += [f"--allow {pattern}: lets nothing through" for pattern in comparison.unused(gate)]
    remark = "is outside of the repository; before and after it is read as it is now"
    return sentences + [f"{file} {remark}" for file in comparison.outside]


def _refusals(change: MissionChange | ChangeSet, gate: Gate | None) -> list[Refusal]:
    return [] if gate is None else change.refusals(gate)


class _ChangeInWords(NamedTuple):
    """A change as text: its label, such as `input`, its name, and the texts before and after the change.

    For a loosened rule or a refusal, `after` is the reason and `before` is empty.
    """

    label: str
    name: str
    before: str
    after: str

    @property
    def words(self) -> str:
        """Description of the change: the text before, an arrow and the text after, or the reason."""
        return f"{self.before} → {self.after}" if self.before else self.after


_TITLE_OF_LABEL = {
    "input": "Inputs",
    "geometry": "Geometry",
    "requirement": "Requirements",
    "loosened": "Loosened",
    "refused": "Refused",
    "allowed": "Let through by --allow",
}


def _changed(mission: MissionChange, gate: Gate | None) -> Iterator[_ChangeInWords]:
    """Yield the changed inputs, geometry values and requirements; without a gate, also the loosened rules."""
    for label, moves in (("input", mission.inputs), ("geometry", mission.geometry)):
        for move in moves:
            yield _ChangeInWords(label, move.name, _value_text(move.before, move), _value_text(move.after, move))
    for requirement in mission.requirements:
        statuses = (requirement.before, requirement.after)
        before, after = ("none" if status is None else STATUS[status].text for status in statuses)
        ids = ", ".join(requirement.requirement_ids)
        yield _ChangeInWords("requirement", f"{requirement.name} [{ids}]" if ids else requirement.name, before, after)
    if gate is None:
        yield from (
            _ChangeInWords("loosened", loosened.id, "", _arrow(loosened.words)) for loosened in mission.loosened
        )


def _refused(change: MissionChange | ChangeSet, gate: Gate | None) -> list[_ChangeInWords]:
    """Refusals of a gate, including the refusals that are overridden by `--allow`."""
    labels = {False: "refused", True: "allowed"}
    return [
        _ChangeInWords(labels[refusal.is_allowed], refusal.id, "", _arrow(refusal.words))
        for refusal in _refusals(change, gate)
    ]


def _arrow(words: str) -> str:
    return words.replace(" -> ", " → ")


def _groups(changes: Iterable[_ChangeInWords]) -> Iterator[doc.Block]:
    """Yield a group for each label: a list of the changes with this label, below a title."""
    changes = list(changes)
    for label, title in _TITLE_OF_LABEL.items():
        items: list[doc.Line] = [
            [(doc.Name(change.name), f": {change.words}")] for change in changes if change.label == label
        ]
        if items:
            yield doc.Group("", [doc.Items(items)], heading=title)


def _shown(mission: MissionChange, gate: Gate | None, all_rows: bool) -> list[Change]:
    """List the row changes to show: all if `all_rows`, otherwise changes of 1 % or more and refused changes."""
    refused = mission.broken(gate.tolerated) if gate is not None else []
    return [change for change in mission.changes if all_rows or not change.is_small or change in refused]


def _value_text(value: str | float | None, move: Moved) -> str:
    if value is None:
        return "none"
    if isinstance(value, str):
        return value
    return f"{value:.4g}°".replace("-0°", "0°") if move.unit == "deg" else format_quantity(value, move.unit, 4)


def _use(row: Row | None) -> str:
    return "-" if row is None or row.utilization is None else percent(row.utilization)


def _erosion(change: Change) -> str:
    sign = "-" if change.erosion < 0 else ""
    return sign + percent(abs(change.erosion))


def _statuses(change: Change) -> str:
    before, after = ("-" if row is None else STATUS[row.status].text for row in (change.before, change.after))
    return after if before == after else f"{before} → {after}"


def _summary(mission: MissionChange, gate: Gate | None, all_rows: bool) -> str:
    newly = sum(change.is_newly_failing for change in mission.changes)
    hidden = len(mission.changes) - len(_shown(mission, gate, all_rows))
    small = f" ({hidden} by less than 1 %, shown with --all)" if hidden else ""
    rows = counted(len(mission.changes), "row")
    text = f"{rows} changed{small}, {mission.unchanged} unchanged, {newly} newly failing"
    if unmet := sum(requirement.is_newly_failing for requirement in mission.requirements):
        text += f"; {counted(unmet, 'requirement')} newly failing"
    if mission.loosened:
        text += f"; {len(mission.loosened)} loosened"
    if gate is not None:
        refusals = mission.refusals(gate)
        refused = sum(not refusal.is_allowed for refusal in refusals)
        text += f"; {refused} refused"
        if len(refusals) > refused:
            text += f", {len(refusals) - refused} let through by --allow"
    return text


def _values(change: Change, field: str, mission: MissionChange) -> str:
    texts = []
    for row, findings in ((change.before, mission.before), (change.after, mission.after)):
        value = getattr(row, field, None)
        rounding = "down" if field == "allowable" else "nearest"
        texts.append("-" if row is None else row_size(value, row, findings, rounding))
    return texts[0] if texts[0] == texts[1] else " → ".join(texts)
