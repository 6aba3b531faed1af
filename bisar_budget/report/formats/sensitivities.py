"""Effects of a mission's numbers on its worst utilization: text for reading, JSON `bisar-budget/sensitivity/1`."""

import json
import math
import re
from collections.abc import Iterator, Sequence
from typing import Any

from bisar_budget.design.sensitivity import LITTLE, Relaxed, Sensitivity, Slope
from bisar_budget.faults import changes_words, printable
from bisar_budget.findings.status import STATUS
from bisar_budget.report import Style
from bisar_budget.report.words.requirements import overrides_lines
from bisar_budget.report.words.sentences import BINDING_WORDS, percent, table, wrapped

FORMAT = "bisar-budget/sensitivity/1"


def as_json(version: str, found: Sequence[Sensitivity]) -> str:
    """Write the contract; values in SI, null where there is none."""
    document = {"format": FORMAT, "version": version, "missions": [_mission(one) for one in found]}
    return json.dumps(document, indent=2, allow_nan=False) + "\n"


def _mission(found: Sensitivity) -> dict[str, Any]:
    return {
        "file": found.file,
        "name": found.name,
        "set": [change._asdict() for change in found.changes],
        "overrides": [one._asdict() for one in found.overrides],
        "model": found.model,
        "status": found.status,
        "worst_row": found.worst_row,
        "binding_requirement": found.requirement,
        "utilization": found.utilization,
        "row": found.row,
        "row_utilization": found.row_utilization,
        "numbers": [_slope(slope) | {"to_limit": found.to_limit(slope)} for slope in found.slopes],
        "without_effect": list(found.unchanging),
        "skipped": [skipped._asdict() for skipped in found.skipped],
        "relaxed": [_relaxed(relaxed) for relaxed in found.relaxed] if found.is_balanced else None,
    }


def _slope(slope: Slope) -> dict[str, Any]:
    return {
        "key": slope.key,
        "text": slope.text,
        "value": slope.value,
        "unit": slope.unit,
        "per": slope.per_text,
        "per_value": slope.per,
        "step": slope.step,
        "difference": slope.difference,
        "utilization_change": slope.change,
        "row_change": slope.row_change,
        "worst_row_below": slope.row_below,
        "worst_row_above": slope.row_above,
        "is_mixed": slope.is_mixed,
        "part": slope.part or None,
    }


def _relaxed(relaxed: Relaxed) -> dict[str, Any]:
    def platform(others: tuple[str, float, float] | None) -> dict[str, Any] | None:
        return None if others is None else dict(zip(("row", "before", "after"), others, strict=True))

    return {
        "key": relaxed.key,
        "share_transmitter": {"before": relaxed.shares_before[0], "after": relaxed.shares_after[0]},
        "share_receiver": {"before": relaxed.shares_before[1], "after": relaxed.shares_after[1]},
        "transmitter": platform(relaxed.transmitter),
        "receiver": platform(relaxed.receiver),
    }


def as_text(found: Sequence[Sensitivity], style: Style) -> str:
    """Write the numbers that change something; first that which has to change least to use up the margin."""
    return "\n\n".join("\n".join(_lines(one, style)) for one in found) + "\n"


def _lines(found: Sensitivity, style: Style) -> Iterator[str]:
    status = STATUS[found.status]
    requirement = BINDING_WORDS.get(found.requirement, found.requirement.replace("_", " "))
    said = f"worst utilization {percent(found.utilization)}: {printable(found.worst_row)} ({requirement})"
    first, *rest = wrapped(said, "  ")
    yield f"\x1b[{status.sgr}m{first}\x1b[0m" if style.color else first
    yield from rest
    if found.row is not None and found.row_utilization is not None:
        yield from wrapped(f"row {printable(found.row)}: {percent(found.row_utilization)}", "  ")
    changed = f" {changes_words(found.changes)}" if found.changes else ""
    yield from wrapped(
        f"{printable(found.file)}{changed}, {printable(found.name)}: {status.text}, {found.model} model", "  "
    )
    yield from overrides_lines(found)
    yield ""
    yield from _table(found)
    yield from _notes(found)
    if found.is_balanced:
        yield ""
        yield from _balance(found)


def _table(found: Sensitivity) -> Iterator[str]:
    shown = found.shown
    if not shown:
        yield "No number of the file changes it."
        return
    of_row = [] if found.row is None else ["of the row"]
    rows = [["key", "value", "to limit", "per", "worst", *of_row, ""]]
    for slope in shown:
        in_row = [] if slope.row_change is None else [_points(slope.row_change)]
        mixed = next((row for row in (slope.row_above, slope.row_below) if row != found.worst_row), "")
        note = f"({printable(mixed)})" if slope.is_mixed else ""
        rows.append(
            [
                printable(slope.key),
                printable(slope.given),
                to_limit(found, slope),
                slope.per_text,
                _points(slope.change),
                *in_row,
                note,
            ]
        )
    yield from table(rows)
    yield ""
    yield from wrapped(
        "to limit: what a number has to change by, alone, until the utilization is 100 %, if that goes on as it goes "
        "here; the least stands first. worst: change of the utilization in percentage points, if a number grows by "
        "what stands under per; a negative number grows away from 0.",
        "  ",
    )


def to_limit(found: Sensitivity, slope: Slope) -> str:
    """Write the change that uses up the margin: in percent, from tenfold on as a factor, or in degrees or decibel."""
    change = found.to_limit(slope)
    if change is None:
        return "-"
    if slope.is_proportional:
        part = change / slope.value
        return f"{100 * part:+.3g} %" if -0.99 < part < 9 else f"x {float(f'{1 + part:.3g}'):g}"
    return f"{change:+.3g} dB" if slope.per_text.endswith("dB") else f"{math.degrees(change):+.3g} deg"


def _points(change: float) -> str:
    return f"{100 * change:+.3g}" if change else "0"


def _notes(found: Sensitivity) -> Iterator[str]:
    shown = found.shown
    if any(slope.is_mixed for slope in shown):
        yield from wrapped(
            "In parentheses: the row that is the worst beside the value. The change is made of the slopes of both.",
            "  ",
        )
    if little := len(found.slopes) - len(shown):
        yield f"Less than a ten-thousandth of it: {_numbers(little)} (JSON lists them)."
    if found.unchanging:
        yield f"Without effect: {_numbers(len(found.unchanging))} (JSON lists them)."
    if found.skipped:
        kinds = ", ".join(dict.fromkeys(re.split("[:;]", one.reason)[0].removeprefix("is ") for one in found.skipped))
        yield from wrapped(f"Left out: {len(found.skipped)} keys ({kinds}).", "  ")


def _numbers(count: int) -> str:
    return f"{count} number{'s' if count != 1 else ''}"


def _balance(found: Sensitivity) -> Iterator[str]:
    moving = [one for one in found.relaxed if one.moves_shares]
    if not moving:
        yield "Shares are balanced; no error that is doubled would move them."
        return
    yield from wrapped("Shares are balanced. What an error that is doubled costs the others:", "  ")
    yield ""
    rows = [["doubled", "shares t/r", "transmitter", "receiver", ""]]
    for one in moving:
        shares = ["/".join(f"{100 * share:.3g}" for share in both) for both in (one.shares_before, one.shares_after)]
        rows.append([printable(one.key), " -> ".join(shares), _then(one.transmitter), _then(one.receiver), ""])
    yield from table(rows)
    yield ""
    yield from wrapped(
        "Of each platform the worst utilization of what is not doubled, before and after; shares in percent.", "  "
    )
    if still := len(found.relaxed) - len(moving):
        yield f"Doubling moves no share of {still} other{'s' if still != 1 else ''}."


def _then(others: tuple[str, float, float] | None) -> str:
    if others is None:
        return "-"
    _, before, after = others
    return percent(before) if abs(after - before) <= LITTLE * before else f"{percent(before)} -> {percent(after)}"
