"""What a change does to missions, as text, Markdown or JSON `bisar-budget/diff/1`."""

import json
from collections.abc import Sequence
from typing import Any

from bisar_budget.faults import changes_words, printable
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.row import Row
from bisar_budget.findings.status import STATUS
from bisar_budget.report.change.comparison import Change, MissionChange, Moved, RequirementMove
from bisar_budget.report.words.escapes import markdown_text
from bisar_budget.report.words.layout import table, wrapped
from bisar_budget.report.words.requirements import overrides_lines, overrides_words
from bisar_budget.report.words.sentences import percent
from bisar_budget.report.words.sizes import row_size
from bisar_budget.units import format_quantity

FORMAT = "bisar-budget/diff/1"


def as_text(missions: Sequence[MissionChange], tolerated: float | None, all_rows: bool = False) -> str:
    """Write what changed, then a table per mission with the largest erosion first, and one summary line each."""
    return "\n\n".join("\n".join(_text(mission, tolerated, all_rows)) for mission in missions) + "\n"


def _text(mission: MissionChange, tolerated: float | None, all_rows: bool) -> list[str]:
    lines = [*wrapped(printable(f"{mission.before.file} -> {_named(mission.after)}"), "  ")]
    lines += [*overrides_lines(mission.after), ""]
    for title, moves in (("Inputs", mission.inputs), ("Geometry", mission.geometry)):
        if moves:
            texts = [
                printable(f"  {move.name}: {_said(move.before, move)} -> {_said(move.after, move)}") for move in moves
            ]
            lines += [title, *(line for text in texts for line in wrapped(text, "    ")), ""]
    if mission.requirements:
        texts = [f"  {one.name}: {_standings(one)}" for one in mission.requirements]
        lines += ["Requirements", *texts, ""]
    if changes := _shown(mission, tolerated, all_rows):
        rows = [
            (printable(change.id), _use(change.before), _use(change.after), _erosion(change), _statuses(change))
            for change in changes
        ]
        lines += [*table([("row", "before", "after", "erosion", "status"), *rows]), ""]
    return [*lines, *wrapped(_summary(mission, tolerated, all_rows), "  ")]


def _named(found: MissionFindings) -> str:
    """Name a mission by its file and the options that changed it."""
    return f"{found.file} {changes_words(found.changes)}".rstrip()


def _shown(mission: MissionChange, tolerated: float | None, all_rows: bool) -> list[Change]:
    """Changes worth reading: those of 1 % or more, and those that a gate refuses."""
    refused = mission.broken(tolerated) if tolerated is not None else []
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


def _standings(one: RequirementMove) -> str:
    before, after = ("none" if status is None else STATUS[status].text for status in (one.before, one.after))
    return f"{before} -> {after}"


def _summary(mission: MissionChange, tolerated: float | None, all_rows: bool) -> str:
    newly = sum(change.is_newly_failing for change in mission.changes)
    hidden = len(mission.changes) - len(_shown(mission, tolerated, all_rows))
    small = f" ({hidden} by less than 1 %, not shown without --all)" if hidden else ""
    count = len(mission.changes)
    text = f"{count} row{'s' if count != 1 else ''} changed{small}, {mission.unchanged} not, {newly} newly failing"
    if unmet := sum(one.is_newly_failing for one in mission.requirements):
        text += f"; {unmet} requirement{'s' if unmet != 1 else ''} newly failing"
    if tolerated is not None:
        refused = len(mission.broken(tolerated))
        text += f"; {refused} refused (newly failing, or erosion above {percent(tolerated)})"
    return text


def as_markdown(missions: Sequence[MissionChange], tolerated: float | None, all_rows: bool = False) -> str:
    """Write the same for the comment of a pull request, with declared and allowable values."""
    lines: list[str] = []
    for mission in missions:
        lines += [f"### {markdown_text(_named(mission.after))}: {_summary(mission, tolerated, all_rows)}", ""]
        if outside := overrides_words(mission.after, with_changes=False):
            lines += [f"From outside the file: {markdown_text(outside)}", ""]
        for title, moves in (("input", mission.inputs), ("geometry", mission.geometry)):
            for move in moves:
                said = (
                    markdown_text(f"{move.name}: {_said(move.before, move)}"),
                    markdown_text(_said(move.after, move)),
                )
                lines.append(f"- {title} {' → '.join(said)}")
        for one in mission.requirements:
            lines.append(f"- requirement {markdown_text(one.name)}: {_standings(one).replace('->', '→')}")
        lines += [""] if mission.inputs or mission.geometry or mission.requirements else []
        changes = _shown(mission, tolerated, all_rows)
        if changes:
            lines.append("| row | declared | allowable | use before | use after | erosion | status |")
            lines.append("| --- | --- | --- | --- | --- | --- | --- |")
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
            lines.append(f"| {' | '.join(cells)} |")
        lines += [""] if changes else []
    return "\n".join(lines).rstrip("\n") + "\n"


def _values(change: Change, field: str, mission: MissionChange) -> str:
    texts = []
    for row, found in ((change.before, mission.before), (change.after, mission.after)):
        value = getattr(row, field, None)
        rounding = "down" if field == "allowable" else "nearest"
        texts.append("-" if row is None or value is None else row_size(value, row, found, rounding))
    return texts[0] if texts[0] == texts[1] else " → ".join(texts)


def as_json(version: str, missions: Sequence[MissionChange], tolerated: float | None) -> str:
    """Write the contract; keys may be added, never changed or removed."""
    document = {
        "format": FORMAT,
        "version": version,
        "tolerated_erosion": tolerated,
        "missions": [
            {
                **{
                    name: {
                        "file": found.file,
                        "status": found.status,
                        "set": [change._asdict() for change in found.changes],
                        "overrides": [one._asdict() for one in found.overrides],
                    }
                    for name, found in (("before", mission.before), ("after", mission.after))
                },
                "unchanged": mission.unchanged,
                "inputs": [{"key": move.name, "before": move.before, "after": move.after} for move in mission.inputs],
                "geometry": [move._asdict() for move in mission.geometry],
                "requirements": [
                    {**one._asdict(), "is_newly_failing": one.is_newly_failing} for one in mission.requirements
                ],
                "rows": [_document(change, tolerated) for change in mission.changes],
            }
            for mission in missions
        ],
    }
    return json.dumps(document, indent=2, allow_nan=False) + "\n"


def _document(change: Change, tolerated: float | None) -> dict[str, Any]:
    keys = ("status", "declared", "allowable", "utilization", "margin", "line", "requirement_id")
    return {
        "id": change.id,
        "erosion": change.erosion,
        "is_newly_failing": change.is_newly_failing,
        "is_refused": tolerated is not None and change.breaks(tolerated),
        **{
            name: None if row is None else {key: getattr(row, key) for key in keys}
            for name, row in (("before", change.before), ("after", change.after))
        },
    }
