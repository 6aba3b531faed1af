"""The part of a compliance report about a sweep: its question, its command, what complies where."""

import math
from collections.abc import Iterator, Mapping
from shlex import quote
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.faults import changes_words, printable
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.status import STATUS
from bisar_budget.findings.trade import Axis, Trade, TradeStudy
from bisar_budget.report.compliance import document as doc
from bisar_budget.report.compliance.matrix import Page
from bisar_budget.report.drawing.trade_drawing import trade_drawing
from bisar_budget.report.drawing.trades import per_word
from bisar_budget.report.words.sentences import BINDING_WORDS, counted, percent

_MOST = 20  # lines of a table
_FEW = 6  # words that are listed in a sentence


def studied(page: Page, study: TradeStudy) -> doc.Section:
    """The question, the command that gives its cases, what was found, drawn and as a table."""
    found, trade = page.found, study.trade
    by_word = per_word(trade)
    counts, question = _counts(study), _question(trade)
    stretches = list(_stretches(trade)) if len(trade.axes) == 1 else []
    parts = list(_parts(trade, by_word)) if len(trade.axes) == 2 else []
    said = [
        f"{one.where}: {STATUS[one.status].words}{f', {one.row} {one.use}' if one.row else ''}" for one in stretches
    ]
    said += [f"{one.name}: {one.complying} of {one.cases} comply" for one in parts]
    description = f"{question} {counts} {'; '.join(said[:_MOST])}{' ...' if len(said) > _MOST else '.'}"
    title = f"Trade study: {' and '.join(axis.key for axis in trade.axes)}"
    drawing = trade_drawing(trade, study.rows, found.file, f"{title}, {page.name}", description)
    beside: list[doc.Block] = [
        doc.Figure(f"{page.number}-study.svg", page.anchor, doc.Name(title), f"{title} of {page.name}", drawing)
    ]
    label = f"Cases of {page.name}"
    if stretches:
        columns = doc.columns("Values", "Status", doc.Column("Worst row", "id"), *doc.numbers("Utilization"))
        caption = "Where it complies, and what binds there: the row that uses most of its limit"
        beside.append(doc.Table(label, caption, columns, [_line(one) for one in stretches[:_MOST]]))
    if parts:
        name: doc.Text = doc.Name(by_word[0].key) if by_word else "Worst row"
        columns = doc.columns(doc.Column(name, "id"), *doc.numbers("Cases", "Comply", "Utilization"))
        caption = "How many cases comply with each" if by_word else ""
        caption = caption or "What binds in how many cases, and how many of them comply"
        lines = [(doc.Name(one.name), str(one.cases), str(one.complying), one.use) for one in parts[:_MOST]]
        beside.append(doc.Table(label, caption, columns, lines))
    blocks: list[doc.Block] = [
        doc.Paragraph(question),
        doc.Paragraph(f"{counts} Each was checked as the mission itself. This writes them as a table:"),
        doc.Paragraph(doc.Code(_command(found, study, page.file)), "command"),
        doc.Group("beside", beside),
    ]
    if hidden := max(len(said) - _MOST, 0):
        blocks.append(doc.Paragraph(f"Not shown: {counted(hidden, 'more line')}.", "more"))
    return doc.Section("Trade study", blocks, f"{page.anchor}-study", style="study")


class Stretch(NamedTuple):
    """Neighbouring values of a sweep, or one word, with one status and one worst row.

    `requirement` sets its limit; empty where the name of the row says it.
    """

    where: str
    status: str
    row: str
    requirement: str
    use: str


class StudyPart(NamedTuple):
    """Cases of a sweep over two keys that have a word or a worst row in common."""

    name: str
    cases: int
    complying: int
    use: str


def _line(one: Stretch) -> doc.Line:
    row: doc.Text = doc.Name(one.row) if one.row else "–"
    return (
        one.where,
        doc.Badge(one.status),
        (row, doc.Styled("own-id", one.requirement)) if one.requirement else row,
        one.use,
    )


def _question(trade: Trade) -> str:
    keys = [f"{printable(axis.key)}, {_values(axis)}" for axis in trade.axes]
    if len(keys) == 2:
        return f"Which combinations of {keys[0]}, and {keys[1]}, comply?"
    return f"Which values of {keys[0]}, comply?"


def _values(axis: Axis) -> str:
    """Say which values an axis has."""
    count = len(axis.values)
    if axis.words:
        listed = ", ".join(map(printable, axis.words[:_FEW]))
        return f"{listed} and {count - _FEW} more" if count > _FEW else listed
    steps = " in equal ratios" if axis.is_log else ""
    return f"{count} values{steps} from {_value(axis, 0)} to {_value(axis, -1)}"


def _value(axis: Axis, place: int) -> str:
    return printable(axis.words[place]) if axis.words else f"{axis.values[place]:.5g} {axis.unit}".rstrip()


def _counts(study: TradeStudy) -> str:
    failing = study.cases - study.complying - study.missing - study.unevaluated
    said = [f"{study.cases} cases", f"{study.complying} comply ({percent(study.complying / study.cases)})"]
    if study.unevaluated:
        said.append(f"{study.unevaluated} not evaluated")
    if failing:
        said.append(f"{failing} break a requirement")
    if study.missing:
        said.append(f"{study.missing} {'are' if study.missing > 1 else 'is'} no mission")
    return f"{said[0]}: {', '.join(said[1:])}."


def _command(found: MissionFindings, study: TradeStudy, file: str) -> str:
    """The command that gives the cases as a table, and a plot."""
    analysed = found.analysed().mission
    words = ["bisar-budget sweep", quote(printable(file))]
    words += [f"--vary {quote(printable(text))}" for text in study.asked]
    words += [changes_words(found.changes)] if found.changes else []
    words += [f"--model {study.model}"] if study.model else []
    words += [f"--date {study.day}"] if analysed.waivers else []
    return " ".join([*words, "-o study.csv --plot study.svg"])


def _stretches(trade: Trade) -> Iterator[Stretch]:
    """Values in their order, neighbours with one status and one worst row as one; each word by itself."""
    (axis,) = trade.axes
    status, rows, uses = (trade.values[name] for name in ("status", "worst_row", "utilization"))
    start, count = 0, len(axis.values)
    for place in range(1, count + 1):
        is_same = place < count and not axis.words
        if is_same and (status[place], rows[place]) == (status[start], rows[start]):
            continue
        where = _value(axis, start)
        if place - 1 > start:
            where += f" to {_value(axis, place - 1)}"
        binding = str(trade.values["binding_requirement"][start])
        said = "" if str(rows[start]).endswith(binding) else BINDING_WORDS.get(binding, binding.replace("_", " "))
        yield Stretch(where, str(status[start]), str(rows[start]), said, _uses(uses[start:place]))
        start = place


def _uses(uses: NDArray[Any]) -> str:
    """Utilizations from the lowest to the highest."""
    known = sorted(float(use) for use in uses if math.isfinite(use))
    if not known:
        return "–"
    low, high = percent(known[0]), percent(known[-1])
    return low if low == high else f"{low} to {high}"


def _parts(trade: Trade, by_word: tuple[Axis, Mapping[str, Trade]] | None) -> Iterator[StudyPart]:
    """Numbers of cases that comply, by word, or else by row that is the worst somewhere; the most cases first."""
    status = trade.values["status"].ravel()
    complies = np.array([name != "error" and not STATUS[name].fails for name in status.tolist()])
    if by_word is not None:
        for word, of_word in by_word[1].items():
            names = of_word.values["status"].tolist()
            complying = sum(name != "error" and not STATUS[name].fails for name in names)
            yield StudyPart(printable(word), len(names), complying, _uses(of_word.values["utilization"]))
        return
    rows = trade.values["worst_row"].ravel()
    names, counts = np.unique(rows[rows != ""].astype(str), return_counts=True)
    for place in np.argsort(-counts, kind="stable").tolist():
        is_of = rows == names[place]
        uses = trade.values["utilization"].ravel()[is_of]
        yield StudyPart(str(names[place]), int(counts[place]), int(complies[is_of].sum()), _uses(uses))
