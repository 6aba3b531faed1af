"""Write the effects of a change on missions as text, Markdown or JSON `bisar-budget/diff/1`."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

from bisar_budget.faults import printable
from bisar_budget.findings.row import Row
from bisar_budget.findings.status import STATUS
from bisar_budget.report.change.comparison import (
    Change,
    ChangeSet,
    Gate,
    MissionChange,
    Moved,
    Refusal,
)
from bisar_budget.report.formats.json_document import document_text, outside_item
from bisar_budget.report.words.heading import file_words, overrides_lines, overrides_words
from bisar_budget.report.words.sentences import (
    counted,
    markdown_row,
    markdown_text,
    percent,
    row_size,
    table,
    wrapped,
)
from bisar_budget.units import format_quantity


def as_text(comparison: ChangeSet, gate: Gate | None, all_rows: bool = False) -> str:
    """Write the changes of each mission, a table of its rows with the largest erosion first, and a summary."""
    blocks = [_text(mission, gate, all_rows) for mission in comparison.missions]
    if refused_lines := _refused_lines(comparison, gate):
        blocks.append(refused_lines)
    if sentences := _run_sentences(comparison, gate):
        blocks.append([line for text in sentences for line in wrapped(printable(text), "  ")])
    return "\n\n".join("\n".join(lines) for lines in blocks) + "\n"


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
    """A change as text: its label, such as `input`, its name, and a description.

    The description is `before -> after`, or the reason for a refusal.
    """

    label: str
    name: str
    words: str


_TITLE_OF_LABEL = {
    "input": "Inputs",
    "geometry": "Geometry",
    "requirement": "Requirements",
    "loosened": "Loosened",
    "**refused**": "Refused",
    "let through by --allow:": "Let through by --allow",
}


def _changed(mission: MissionChange, gate: Gate | None) -> Iterator[_ChangeInWords]:
    """Yield the changed inputs, geometry values and requirements; without a gate, also the loosened rules."""
    for label, moves in (("input", mission.inputs), ("geometry", mission.geometry)):
        for move in moves:
            values = f"{_value_text(move.before, move)} -> {_value_text(move.after, move)}"
            yield _ChangeInWords(label, move.name, values)
    for requirement in mission.requirements:
        statuses = (requirement.before, requirement.after)
        before, after = ("none" if status is None else STATUS[status].text for status in statuses)
        name = f"{requirement.name} [{', '.join(ids)}]" if (ids := requirement.requirement_ids) else requirement.name
        yield _ChangeInWords("requirement", name, f"{before} -> {after}")
    if gate is None:
        yield from (_ChangeInWords("loosened", loosened.id, loosened.words) for loosened in mission.loosened)


def _refused(change: MissionChange | ChangeSet, gate: Gate | None) -> list[_ChangeInWords]:
    """Refusals of a gate, including the ones that `--allow` lets through."""
    labels = {False: "**refused**", True: "let through by --allow:"}
    return [
        _ChangeInWords(labels[refusal.is_allowed], refusal.id, refusal.words) for refusal in _refusals(change, gate)
    ]


def _blocks(changes: Iterable[_ChangeInWords]) -> Iterator[list[str]]:
    """Yield one block of text lines for each label. The first line of a block is its title."""
    changes = list(changes)
    for label, title in _TITLE_OF_LABEL.items():
        texts = [printable(f"  {change.name}: {change.words}") for change in changes if change.label == label]
        if texts:
            yield [title, *(line for text in texts for line in wrapped(text, "    "))]


def _refused_lines(change: MissionChange | ChangeSet, gate: Gate | None) -> list[str]:
    return [line for block in _blocks(_refused(change, gate)) for line in block]


def _items(changes: Iterable[_ChangeInWords]) -> list[str]:
    """Markdown list with an item for each change."""
    return [f"- {change.label} {markdown_text(change.name)}: {_arrows(change.words)}" for change in changes]


def _arrows(words: str) -> str:
    return " → ".join(map(markdown_text, words.split(" -> ")))


def _text(mission: MissionChange, gate: Gate | None, all_rows: bool) -> list[str]:
    lines = [*wrapped(printable(f"{mission.before.file} -> {file_words(mission.after)}"), "  ")]
    lines += [*overrides_lines(mission.after), ""]
    for block in _blocks(_changed(mission, gate)):
        lines += [*block, ""]
    if changes := _shown(mission, gate, all_rows):
        rows = [
            (printable(change.id), _use(change.before), _use(change.after), _erosion(change), _statuses(change))
            for change in changes
        ]
        lines += [*table([("row", "before", "after", "erosion", "status"), *rows]), ""]
    if refused := _refused_lines(mission, gate):
        lines += [*refused, ""]
    return [*lines, *wrapped(_summary(mission, gate, all_rows), "  ")]


def _shown(mission: MissionChange, gate: Gate | None, all_rows: bool) -> list[Change]:
    """List the row changes to show: all with `all_rows`, otherwise changes of 1 % or more and refused changes."""
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
    return after if before == after else f"{before} -> {after}"


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


_CHANGE_COLUMNS = (
    "row",
    "declared",
    "allowable",
    "use before",
    "use after",
    "erosion",
    "status",
)  # of a pull request


def as_markdown(comparison: ChangeSet, gate: Gate | None, all_rows: bool = False) -> str:
    """Write the changes as Markdown for a comment on a pull request, with declared and allowable values."""
    lines: list[str] = []
    for mission in comparison.missions:
        lines += [f"### {markdown_text(file_words(mission.after))}: {_summary(mission, gate, all_rows)}", ""]
        if outside := overrides_words(mission.after, with_changes=False):
            lines += [f"Overrides: {markdown_text(outside)}", ""]
        lines += [*_items(_changed(mission, gate)), *_items(_refused(mission, gate))]
        lines += [""] if lines[-1] else []
        changes = _shown(mission, gate, all_rows)
        if changes:
            lines += [markdown_row(_CHANGE_COLUMNS), markdown_row("---" for _ in _CHANGE_COLUMNS)]
        for change in changes:
            cells = (
                markdown_text(change.id),
                _values(change, "declared", mission),
                _values(change, "allowable", mission),
                _use(change.before),
                _use(change.after),
                _erosion(change),
                _statuses(change).replace("->", "→"),
            )
            lines.append(markdown_row(cells))
        lines += [""] if changes else []
    lines += _items(_refused(comparison, gate))
    lines += [f"- {markdown_text(text)}" for text in _run_sentences(comparison, gate)]
    return "\n".join(lines).rstrip("\n") + "\n"


def _values(change: Change, field: str, mission: MissionChange) -> str:
    texts = []
    for row, findings in ((change.before, mission.before), (change.after, mission.after)):
        value = getattr(row, field, None)
        rounding = "down" if field == "allowable" else "nearest"
        texts.append("-" if row is None else row_size(value, row, findings, rounding))
    return texts[0] if texts[0] == texts[1] else " → ".join(texts)


def as_json(comparison: ChangeSet, gate: Gate | None) -> str:
    """Write the JSON document `diff/1`. Later versions may add keys, but never change or remove them."""
    content = {
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
    return document_text("bisar-budget/diff/1", content)


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
