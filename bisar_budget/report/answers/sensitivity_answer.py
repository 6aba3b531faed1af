"""Output of the `sensitivity` command: the effect of every number in a mission file on the worst utilization."""

import math
import re
from collections.abc import Iterator, Sequence

from bisar_budget.faults import printable
from bisar_budget.findings.slopes import MIN_SHOWN_CHANGE_FRACTION, Relaxed, Sensitivity, Slope
from bisar_budget.findings.status import STATUS
from bisar_budget.report import Style
from bisar_budget.report import document as doc
from bisar_budget.report.answers import Records
from bisar_budget.report.answers.check_content import outside_item
from bisar_budget.report.answers.shared_blocks import mission_chapter, mission_document, opening
from bisar_budget.report.drawing.tornado import tornado
from bisar_budget.report.words.sentences import BINDING_WORDS, counted, percent


# ---------------------------------------------------------------- for programs
def content(answers: Sequence[Sensitivity]) -> dict[str, object]:
    """Content of the JSON document `sensitivity/1`, in SI units; a missing value is null."""
    return {
        "missions": [
            {"file": answer.file, "name": answer.name, **outside_item(answer), **_ranked(answer)}
            for answer in answers
        ]
    }


_SLOPE_COLUMNS = (
    "file", "name", "key", "text", "value", "unit", "part", "per", "per_value", "step", "difference",
    "utilization_change", "row_change", "to_limit", "worst_row_below", "worst_row_above", "is_mixed",
)  # fmt: skip


def records(answers: Sequence[Sensitivity]) -> Records:
    """Table of the answers: one line for each number in a mission file, in SI units, largest effect first."""
    lines = [
        {"file": answer.file, "name": answer.name, **_slope(slope), "to_limit": answer.to_limit(slope)}
        for answer in answers
        for slope in answer.slopes
    ]
    return Records(_SLOPE_COLUMNS, lines)


def _ranked(sensitivity: Sensitivity) -> dict[str, object]:
    return {
        "model": sensitivity.model,
        "status": sensitivity.status,
        "worst_row": sensitivity.worst_row,
        "binding_requirement": sensitivity.requirement,
        "utilization": sensitivity.utilization,
        "row": sensitivity.row,
        "row_utilization": sensitivity.row_utilization,
        "numbers": [_slope(slope) | {"to_limit": sensitivity.to_limit(slope)} for slope in sensitivity.slopes],
        "without_effect": list(sensitivity.unchanging),
        "skipped": [skipped._asdict() for skipped in sensitivity.skipped],
        "relaxed": [_relaxed(relaxed) for relaxed in sensitivity.relaxed] if sensitivity.is_balanced else None,
    }


def _slope(slope: Slope) -> dict[str, object]:
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


def _relaxed(relaxed: Relaxed) -> dict[str, object]:
    def platform(change: tuple[str, float, float] | None) -> dict[str, object] | None:
        return None if change is None else dict(zip(("row", "before", "after"), change, strict=True))

    return {
        "key": relaxed.key,
        "share_transmitter": {"before": relaxed.shares_before[0], "after": relaxed.shares_after[0]},
        "share_receiver": {"before": relaxed.shares_before[1], "after": relaxed.shares_after[1]},
        "transmitter": platform(relaxed.transmitter),
        "receiver": platform(relaxed.receiver),
    }


# ---------------------------------------------------------------- for people
def document(answers: Sequence[Sensitivity], style: Style) -> doc.AnswerDocument:
    """Text of each answer: a table of the numbers in the mission file, and a drawing of their effects.

    If the shares of the platforms are balanced, the text also states the effect of doubling errors, because an error
    then affects the utilization of the other errors too.
    """
    chapters = [mission_chapter(answer, number, _blocks(answer, number)) for number, answer in enumerate(answers, 1)]
    return mission_document("Sensitivity", answers, chapters)


def _blocks(sensitivity: Sensitivity, number: int) -> Iterator[doc.Block]:
    """Yield the blocks of a sensitivity analysis, with a table of the numbers in the mission file.

    The table begins with the number that uses up the margin with the smallest change.
    """
    requirement = BINDING_WORDS.get(sensitivity.requirement, sensitivity.requirement.replace("_", " "))
    verdict = (
        f"worst utilization {percent(sensitivity.utilization)}: {printable(sensitivity.worst_row)} ({requirement})"
    )
    row_text = []
    if sensitivity.row is not None and sensitivity.row_utilization is not None:
        row_text = [f"row {printable(sensitivity.row)}: {percent(sensitivity.row_utilization)}"]
    terms = f"{STATUS[sensitivity.status].words}, {sensitivity.model} model"
    yield opening(sensitivity, verdict, sensitivity.status, terms, more=row_text)
    yield from _table(sensitivity)
    if sensitivity.shown:
        title = f"Effects on the worst utilization of {sensitivity.name}"
        anchor = f"mission-{number}"
        yield doc.Figure(f"{number}-effects.svg", anchor, title, "Effects", tornado(sensitivity))
    if notes := list(_notes(sensitivity)):
        yield doc.Items([[note] for note in notes])
    if sensitivity.is_balanced:
        yield from _balance(sensitivity)


def _table(sensitivity: Sensitivity) -> Iterator[doc.Block]:
    shown = sensitivity.shown
    if not shown:
        yield doc.Paragraph("No number of the file changes the utilization.")
        return
    row_heads = () if sensitivity.row is None else ("of the row",)
    heads = doc.heads("key", *doc.numbers("value", "to limit", "per", "worst", *row_heads), "")
    rows: list[doc.Line] = []
    for slope in shown:
        row_cell = [] if slope.row_change is None else [_points(slope.row_change)]
        mixed = next((row for row in (slope.row_above, slope.row_below) if row != sensitivity.worst_row), "")
        note = f"({printable(mixed)})" if slope.is_mixed else ""
        cells = [slope.given, to_limit(sensitivity, slope), slope.per_text, _points(slope.change), *row_cell, note]
        rows.append([doc.Name(slope.key), *cells])
    yield doc.TextTable("Numbers", "Numbers of the mission, the smallest change to the limit first", heads, rows)
    yield doc.Paragraph(
        "to limit: change of this number alone that brings the utilization to 100 %, extrapolated from its slope "
        "here; smallest first. worst: change of the utilization in percentage points when the number grows by the "
        "step under per; a negative value becomes more negative."
    )


def to_limit(sensitivity: Sensitivity, slope: Slope) -> str:
    """Text with the change in a number of the mission file that would use up the margin.

    The change is in percent, degrees or dB, or is a factor if the number changes tenfold or more. The text is a
    hyphen if no change would use up the margin.
    """
    change = sensitivity.to_limit(slope)
    if change is None:
        return "-"
    if slope.is_proportional:
        ratio = change / slope.value
        return f"{100 * ratio:+.3g} %" if -0.99 < ratio < 9 else f"x {float(f'{1 + ratio:.3g}'):g}"
    return f"{change:+.3g} dB" if slope.per_text.endswith("dB") else f"{math.degrees(change):+.3g} deg"


def _points(change: float) -> str:
    return f"{100 * change:+.3g}" if change else "0"


def _notes(sensitivity: Sensitivity) -> Iterator[str]:
    shown = sensitivity.shown
    if any(slope.is_mixed for slope in shown):
        yield (
            "In parentheses: the worst row on the other side of the value. The change combines the slopes of both."
        )
    if negligible := len(sensitivity.slopes) - len(shown):
        yield f"Effect below a ten-thousandth of it: {counted(negligible, 'number')} (JSON lists them)."
    if sensitivity.unchanging:
        yield f"Without effect: {counted(len(sensitivity.unchanging), 'number')} (JSON lists them)."
    if sensitivity.skipped:
        kinds = ", ".join(
            dict.fromkeys(re.split("[:;]", skipped.reason)[0].removeprefix("is ") for skipped in sensitivity.skipped)
        )
        yield f"Left out: {len(sensitivity.skipped)} keys ({kinds})."


def _balance(sensitivity: Sensitivity) -> Iterator[doc.Block]:
    moving_errors = [error for error in sensitivity.relaxed if error.moves_shares]
    if not moving_errors:
        yield doc.Paragraph("Shares are balanced; doubling an error does not change them.")
        return
    yield doc.Paragraph("Shares are balanced. Cost of doubling an error for the other errors:")
    rows: list[doc.Line] = []
    for error in moving_errors:
        shares = [
            "/".join(f"{100 * share:.3g}" for share in platform_shares)
            for platform_shares in (error.shares_before, error.shares_after)
        ]
        changes = (_change_words(error.transmitter), _change_words(error.receiver))
        rows.append([doc.Name(error.key), " → ".join(shares), *changes])
    heads = doc.heads("doubled", *doc.numbers("shares t/r", "transmitter", "receiver"))
    yield doc.TextTable("Doubled errors", "Cost of doubling an error", heads, rows)
    remarks = ["For each platform the worst utilization of its other errors, before and after; shares in percent."]
    if unmoved := len(sensitivity.relaxed) - len(moving_errors):
        remarks.append(f"Doubling does not change the shares for {counted(unmoved, 'other error')}.")
    yield doc.Items([[remark] for remark in remarks])


def _change_words(change: tuple[str, float, float] | None) -> str:
    if change is None:
        return "-"
    _, before, after = change
    return (
        percent(before)
        if abs(after - before) <= MIN_SHOWN_CHANGE_FRACTION * before
        else f"{percent(before)} → {percent(after)}"
    )
