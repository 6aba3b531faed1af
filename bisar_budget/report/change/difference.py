"""Effects of a change on missions, as text, Markdown or JSON `bisar-budget/diff/1`."""

from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

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
    """Write what changed, then a table per mission with the largest erosion first, and one summary line each."""
    parts = [_text(mission, gate, all_rows) for mission in comparison.missions]
    if refused := _refused_lines(comparison, gate):
        parts.append(refused)
    if said := _of_no_mission(comparison, gate):
        parts.append([line for text in said for line in wrapped(printable(text), "  ")])
    return "\n\n".join("\n".join(lines) for lines in parts) + "\n"


def _of_no_mission(comparison: ChangeSet, gate: Gate | None) -> list[str]:
    """Sentences on missions that came and went, on settings, and on what was not compared or not needed."""
    sentences = [f"{file}: new, there is nothing to compare it with" for file in comparison.new]
    if gate is None:
        sentences += [f"{file}: the mission file is gone" for file in comparison.gone]
        sentences += [f"{one.id}: {one.words}" for one in comparison.settings]
    else:
        sentences += [f"--allow {one}: lets nothing through" for one in comparison.unused(gate)]
    outside = "is outside of the repository; before and after it is read as it is now"
    return sentences + [f"{file} {outside}" for file in comparison.outside]


def _refusals(of: MissionChange | ChangeSet, gate: Gate | None) -> list[Refusal]:
    return [] if gate is None else of.refusals(gate)


class _Said(NamedTuple):
    """One thing that changed, in words: what it is (`input`), its name, and before -> after, or what is wrong."""

    kind: str
    name: str
    words: str


_TITLES = {
    "input": "Inputs",
    "geometry": "Geometry",
    "requirement": "Requirements",
    "loosened": "Loosened",
    "**refused**": "Refused",
    "let through by --allow:": "Let through by --allow",
}


def _changed(mission: MissionChange, gate: Gate | None) -> Iterator[_Said]:
    """Changes beside those of rows, in the order of the titles; a gate refuses what is loosened."""
    for kind, moves in (("input", mission.inputs), ("geometry", mission.geometry)):
        yield from (_Said(kind, one.name, f"{_said(one.before, one)} -> {_said(one.after, one)}") for one in moves)
    for one in mission.requirements:
        before, after = ("none" if status is None else STATUS[status].text for status in (one.before, one.after))
        yield _Said("requirement", one.name, f"{before} -> {after}")
    if gate is None:
        yield from (_Said("loosened", one.id, one.words) for one in mission.loosened)


def _refused(of: MissionChange | ChangeSet, gate: Gate | None) -> list[_Said]:
    """All that a gate refuses, then all that is let through."""
    kinds = {False: "**refused**", True: "let through by --allow:"}
    return [_Said(kinds[one.is_allowed], one.id, one.words) for one in _refusals(of, gate)]


def _blocks(said: Iterable[_Said]) -> Iterator[list[str]]:
    """Lines below a title, a block for each kind."""
    said = list(said)
    for kind, title in _TITLES.items():
        texts = [printable(f"  {one.name}: {one.words}") for one in said if one.kind == kind]
        if texts:
            yield [title, *(line for text in texts for line in wrapped(text, "    "))]


def _refused_lines(of: MissionChange | ChangeSet, gate: Gate | None) -> list[str]:
    return [line for block in _blocks(_refused(of, gate)) for line in block]


def _items(said: Iterable[_Said]) -> list[str]:
    """The same as a list in Markdown."""
    return [f"- {one.kind} {markdown_text(one.name)}: {_arrows(one.words)}" for one in said]


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
    """Changes worth reading: those of 1 % or more, and those that a gate refuses."""
    refused = mission.broken(gate.tolerated) if gate is not None else []
    return [change for change in mission.changes if all_rows or not change.is_small or change in refused]


def _said(value: str | float | None, move: Moved) -> str:
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
    small = f" ({hidden} by less than 1 %, not shown without --all)" if hidden else ""
    rows = counted(len(mission.changes), "row")
    text = f"{rows} changed{small}, {mission.unchanged} not, {newly} newly failing"
    if unmet := sum(one.is_newly_failing for one in mission.requirements):
        text += f"; {counted(unmet, 'requirement')} newly failing"
    if mission.loosened:
        text += f"; {len(mission.loosened)} loosened"
    if gate is not None:
        refusals = mission.refusals(gate)
        refused = sum(not one.is_allowed for one in refusals)
        text += f"; {refused} refused"
        if len(refusals) > refused:
            text += f", {len(refusals) - refused} let through by --allow"
    return text


_COLUMNS = ("row", "declared", "allowable", "use before", "use after", "erosion", "status")  # of a pull request


def as_markdown(comparison: ChangeSet, gate: Gate | None, all_rows: bool = False) -> str:
    """Write the same for the comment of a pull request, with declared and allowable values."""
    lines: list[str] = []
    for mission in comparison.missions:
        lines += [f"### {markdown_text(file_words(mission.after))}: {_summary(mission, gate, all_rows)}", ""]
        if outside := overrides_words(mission.after, with_changes=False):
            lines += [f"Overrides: {markdown_text(outside)}", ""]
        lines += [*_items(_changed(mission, gate)), *_items(_refused(mission, gate))]
        lines += [""] if lines[-1] else []
        changes = _shown(mission, gate, all_rows)
        if changes:
            lines += [markdown_row(_COLUMNS), markdown_row("---" for _ in _COLUMNS)]
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
    lines += [f"- {markdown_text(text)}" for text in _of_no_mission(comparison, gate)]
    return "\n".join(lines).rstrip("\n") + "\n"


def _values(change: Change, field: str, mission: MissionChange) -> str:
    texts = []
    for row, found in ((change.before, mission.before), (change.after, mission.after)):
        value = getattr(row, field, None)
        rounding = "down" if field == "allowable" else "nearest"
        texts.append("-" if row is None else row_size(value, row, found, rounding))
    return texts[0] if texts[0] == texts[1] else " → ".join(texts)


def as_json(comparison: ChangeSet, gate: Gate | None) -> str:
    """Write the contract; keys may be added, never changed or removed."""
    content = {
        "tolerated_erosion": None if gate is None else gate.tolerated,
        "allow": [] if gate is None else list(gate.allowed),
        "allow_unused": [] if gate is None else comparison.unused(gate),
        "gone": comparison.gone,
        "new": comparison.new,
        "settings": [one._asdict() for one in comparison.settings],
        "outside_repository": comparison.outside,
        "refused": [_refusal(one) for one in _refusals(comparison, gate)],
        "missions": [_mission(mission, gate) for mission in comparison.missions],
    }
    return document_text("bisar-budget/diff/1", content)


def _mission(mission: MissionChange, gate: Gate | None) -> dict[str, Any]:
    refusals = _refusals(mission, gate)
    refused = {one.id for one in refusals if not one.is_allowed}
    return {
        **{
            name: {
                "file": found.file,
                "status": found.status,
                "waived_by": [waiver.id for waiver in found.waived_by],
                **outside_item(found),
            }
            for name, found in (("before", mission.before), ("after", mission.after))
        },
        "unchanged": mission.unchanged,
        "inputs": [{"key": move.name, "before": move.before, "after": move.after} for move in mission.inputs],
        "geometry": [move._asdict() for move in mission.geometry],
        "requirements": [{**one._asdict(), "is_newly_failing": one.is_newly_failing} for one in mission.requirements],
        "loosened": [one._asdict() for one in mission.loosened],
        "refused": [_refusal(one) for one in refusals],
        "rows": [_document(change, change.id in refused) for change in mission.changes],
    }


def _refusal(one: Refusal) -> dict[str, Any]:
    return {"id": one.id, "reason": one.words, "is_allowed": one.is_allowed}


def _document(change: Change, is_refused: bool) -> dict[str, Any]:
    keys = ("status", "declared", "allowable", "utilization", "margin", "line", "requirement_id")
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
