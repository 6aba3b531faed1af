"""The annex of a compliance report: a sweep, images, draws that somebody asked for; with `--detail full` all rows."""

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from shlex import quote
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bisar_budget.catalogue import EQUATIONS
from bisar_budget.effects.effect import MOTION_UNITS
from bisar_budget.faults import changes_words, printable
from bisar_budget.findings.images import ImageEvidence, PointImage
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.monte_carlo import MonteCarlo
from bisar_budget.findings.specification import SpecificationSheet
from bisar_budget.findings.status import STATUS, complying
from bisar_budget.findings.trade import Axis, Trade, TradeStudy
from bisar_budget.report.compliance import document as doc
from bisar_budget.report.compliance.rows import (
    Page,
    all_contributions,
    all_remarks,
    grouped,
    limit_words,
    matrix_table,
    undeclared_table,
)
from bisar_budget.report.drawing.evidence_drawings import (
    chip_caption,
    chip_png,
    chip_size,
    impulse_response_cuts,
    numbers_in_words,
)
from bisar_budget.report.drawing.trade_drawing import trade_drawing
from bisar_budget.report.drawing.trades import per_word, stretches
from bisar_budget.report.explain.explanation import chain, collection_chain
from bisar_budget.report.formats import verification
from bisar_budget.report.formats.specification_sheet import specified
from bisar_budget.report.words.requirements import probability_words
from bisar_budget.report.words.sentences import BINDING_WORDS, counted, percent, sentence, waived_count
from bisar_budget.units import format_quantity

_MOST = 20  # lines of the table of a sweep
_FEW = 6  # words that are listed in a sentence
_SOURCED = (
    *(*MOTION_UNITS, "time_tag", "lever_arm", "vibration", "other"),
    *("imu", "random", "trajectory", "oscillator", "synchronization", "propagation"),
)


def annex(page: Page, *, several: bool) -> list[doc.Chapter]:
    """The annex of a mission; none where there is nothing beyond the summary."""
    found = page.found
    sections = [] if found.study is None else [_studied(page, found.study)]
    if found.sheet is not None:
        sections.append(
            doc.Chapter("Specifications", list(_specified(page, found.sheet)), f"{page.anchor}-specified")
        )
    if found.verdicts is not None:
        sections.append(doc.Chapter("Image evidence", list(_evidence(page)), f"{page.anchor}-evidence"))
    if found.monte_carlo is not None:
        sections.append(doc.Chapter("Monte Carlo", list(_draws(page, found.monte_carlo)), f"{page.anchor}-draws"))
    if page.is_full:
        title = "Formulas, with the numbers put in"
        sections += [
            doc.Chapter("Rows in full", list(_rows(page)), f"{page.anchor}-rows"),
            doc.Chapter("Sources", list(_sources(page)), f"{page.anchor}-sources"),
            doc.Chapter(title, list(_formulas(page)), f"{page.anchor}-formulas", short="Formulas"),
        ]
    title = f"Annex: {page.name}" if several else "Annex"
    whole = doc.Chapter(title, sections, f"{page.anchor}-annex", level=2, style="annex", is_article=True)
    return [whole] if sections else []


# ---------------------------------------------------------------------- specifications
def _specified(page: Page, sheet: SpecificationSheet) -> Iterator[doc.Block]:
    """The sheet of the errors that the file has specified, and what it declares of them."""
    outside = sum(one.declared is not None and not one.holds(one.declared) for one in sheet.specifications)
    silent = sum(one.declared is None and one.ordered is not None for one in sheet.specifications)
    said = list[str]()
    if not sheet.broken:
        said.append(
            f"of what the file declares {counted(outside, 'figure')} {'is' if outside == 1 else 'are'} larger"
        )
        said += [f"not declared: {silent}"] if silent else []
    told = "; ".join(["", *said])
    what = "Sizes that together meet every requirement, of the errors that "
    yield doc.Paragraph((what, doc.Code("allocation.specify"), f" names{told}."))
    yield from specified(sheet, f"{page.anchor}-specified")
    yield doc.Paragraph(doc.Code(f"bisar-budget allocate {quote(page.file)}"), "command")


# ---------------------------------------------------------------------- a sweep
def _studied(page: Page, study: TradeStudy) -> doc.Chapter:
    """The question of a sweep, the command that gives its cases, what was found, drawn and as a table."""
    found, trade = page.found, study.trade
    by_word = per_word(trade)
    counts, question = _counts(study), _question(trade)
    if len(trade.axes) == 1:
        listed = list(_stretches(trade))
        heads = doc.heads("Values", "Status", doc.Head("Worst row", "id"), *doc.numbers("Utilization"))
        caption = "Where it complies, and what binds there: the row that uses most of its limit"
    else:
        listed = list(_parts(trade, by_word[1] if by_word else {}))
        name: doc.Text = doc.Name(by_word[0].key) if by_word else "Worst row"
        counts_of_waived = ["Waived"] if study.waived else []
        heads = doc.heads(doc.Head(name, "id"), *doc.numbers("Cases", "Comply", *counts_of_waived, "Utilization"))
        caption = "What binds in how many cases, and how many of them comply"
        caption = "How many cases comply with each" if by_word else caption
    said = "; ".join(words for _, words in listed[:_MOST]) + (" ..." if len(listed) > _MOST else ".")
    title = f"Trade study: {' and '.join(axis.key for axis in trade.axes)}"
    svg = trade_drawing(trade, study.rows, found.file, f"{title}, {page.name}", f"{question} {counts} {said}")
    beside: list[doc.Block] = [
        doc.Figure(f"{page.number}-study.svg", page.anchor, doc.Name(title), f"{title} of {page.name}", svg)
    ]
    if listed:
        lines = [line for line, _ in listed[:_MOST]]
        beside.append(doc.TextTable(f"Cases of {page.name}", caption, heads, lines))
    blocks: list[doc.Block] = [
        doc.Paragraph(question),
        doc.Paragraph(f"{counts} Each was checked as the mission itself. This writes them as a table:"),
        doc.Paragraph(doc.Code(_command(found, study, page.file)), "command"),
        doc.Group("beside", beside),
    ]
    if hidden := max(len(listed) - _MOST, 0):
        blocks.append(doc.Paragraph(f"Not shown: {counted(hidden, 'more line')}.", "more"))
    return doc.Chapter("Trade study", blocks, f"{page.anchor}-study", style="study")


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
    failing = study.cases - study.complying - study.waived - study.missing - study.unevaluated
    said = [f"{study.cases} cases", f"{study.complying} comply ({percent(study.complying / study.cases)})"]
    if study.waived:
        said.append(waived_count(study.waived, study.waived_by))
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


def _stretches(trade: Trade) -> Iterator[tuple[doc.Line, str]]:
    """Lines of values in their order, neighbours with one status and one worst row as one; each word by itself.

    Beside each line what it says in words. The requirement that sets the limit stands by the row, unless the name of
    the row says it.
    """
    (axis,) = trade.axes
    status, rows, uses = (trade.values[name] for name in ("status", "worst_row", "utilization"))
    begins = (status[1:] != status[:-1]) | (rows[1:] != rows[:-1]) | bool(axis.words)
    for start, stop in stretches(begins):
        where = _value(axis, start) + (f" to {_value(axis, stop - 1)}" if stop - 1 > start else "")
        row, use, badge = str(rows[start]), _uses(uses[start:stop]), doc.Badge(str(status[start]))
        name: doc.Text = doc.Name(row) if row else "–"
        binding = str(trade.values["binding_requirement"][start])
        if not row.endswith(binding):
            name = (name, doc.Styled("own-id", BINDING_WORDS.get(binding, binding.replace("_", " "))))
        said = f"{where}: {STATUS[badge.status].words}" + (f", {row} {use}" if row else "")
        yield (where, badge, name, use), said


def _uses(uses: NDArray[Any]) -> str:
    """Utilizations from the lowest to the highest."""
    known = sorted(float(use) for use in uses if math.isfinite(use))
    if not known:
        return "–"
    low, high = percent(known[0]), percent(known[-1])
    return low if low == high else f"{low} to {high}"


def _parts(trade: Trade, by_word: Mapping[str, Trade]) -> Iterator[tuple[doc.Line, str]]:
    """Lines of cases by word, else by row that is the worst somewhere, most cases first; beside each its words."""
    cases: dict[str, Mapping[str, NDArray[Any]]] = {printable(word): one.values for word, one in by_word.items()}
    if not by_word:
        values = {name: trade.values[name].ravel() for name in ("status", "worst_row", "utilization")}
        rows = values["worst_row"]
        names, counts = np.unique(rows[rows != ""].astype(str), return_counts=True)
        for place in np.argsort(-counts, kind="stable").tolist():
            cases[str(names[place])] = {name: column[rows == names[place]] for name, column in values.items()}
    is_waived = "waived" in trade.statuses
    for name, of_case in cases.items():
        statuses = of_case["status"].tolist()
        comply, waived = complying(Counter(statuses)), statuses.count("waived")
        apart = f", {waived} waived" if waived else ""
        numbers = (str(len(statuses)), str(comply), *([str(waived)] if is_waived else []))
        line: doc.Line = (doc.Name(name), *numbers, _uses(of_case["utilization"]))
        yield line, f"{name}: {comply} of {len(statuses)} comply{apart}"


# ---------------------------------------------------------------------- images
def _evidence(page: Page) -> Iterator[doc.Block]:
    """Evidence of images about the limits, beside what was predicted."""
    verdicts = page.found.verdicts or ()
    yield doc.Paragraph(
        "Each error was set to its limit in data simulated from exact ranges, and the phase was measured in the "
        "image."
    )
    yield doc.TextTable(
        f"Image evidence of {page.name}",
        "At the limit: what the budget promises, what Table II, the full model and exact ranges predict, what the "
        "image shows. Phases in rad.",
        _heads("Limit", "Budget", "Table II", "Full model", "Exact ranges", "Image"),
        [
            (doc.Name(one.id), verification.limit(one), *verification.numbers(one), doc.Badge(one.verdict))
            for one in verdicts
        ],
    )
    refocused: list[doc.Line] = [
        (doc.Name(one.id), *verification.refocused_cells(one)[:4], doc.Badge(one.verdict_autofocus))
        for one in verdicts
        if one.verdict_autofocus
    ]
    if refocused:
        yield doc.TextTable(
            f"Refocused images of {page.name}",
            "At the limit with autofocus, refocused",
            _heads("Limit", "Budget", "Residual", "Peak loss"),
            refocused,
        )
    for number, evidence in enumerate(page.found.image_evidence or (), start=1):
        yield _images(page, evidence, number)
    remarks: list[list[doc.Text]] = [[f"{sentence(text)}."] for text in verification.geometry_remarks(verdicts)]
    for one in verdicts:
        with_autofocus = one.reason_autofocus and f"with autofocus: {one.reason_autofocus}"
        if reasons := [reason for reason in (one.reason, with_autofocus) if reason]:
            remarks.append([(doc.Styled("id", doc.Name(one.id)), f": {'; '.join(reasons)}.")])
    if remarks:
        yield doc.Items(remarks)


def _heads(*heads: str) -> list[doc.Head]:
    return doc.heads(doc.Head("Id", "id"), *doc.numbers(*heads), "Verdict")


def _images(page: Page, evidence: ImageEvidence, number: int) -> doc.Group:
    """Images at a limit, and the cuts through them."""
    row_id = evidence.verdict.id
    at = f"{row_id} at the limit with autofocus"
    shown = [("limit", f"{row_id} at the limit", "At the limit", evidence.at_limit)]
    if evidence.before_autofocus and evidence.after_autofocus:
        before, after = "At the limit with autofocus, before it", "The same, after it"
        shown.append(("before", f"{at}, before it", before, evidence.before_autofocus))
        shown.append(("after", f"{at}, after it", after, evidence.after_autofocus))
    chips = [
        doc.ShownImage(
            f"{page.number}-chip-{number}-{name}.png", title, f"{what}: {chip_caption(image)}", chip_png(image),
            _on_page(image),
        )
        for name, title, what, image in shown
    ]  # fmt: skip
    title = f"Cross-range cuts of {row_id}"
    svg = impulse_response_cuts(evidence)
    cuts = doc.Figure(f"{page.number}-cuts-{number}.svg", page.anchor, title, f"{title}, {page.name}", svg, "cuts")
    words = doc.Paragraph(" ".join(numbers_in_words(evidence)))
    heading = ("Images of ", doc.Styled("id", doc.Name(row_id)))
    return doc.Group("illustration", [words, doc.Group("images", [doc.Images(chips), cuts])], heading)


def _on_page(image: PointImage) -> tuple[int, int]:
    """Width and height on a page, at most 240 px each. [px]"""
    width, height = chip_size(image)
    shrink = max(1.0, width / 240, height / 240)
    return max(1, round(width / shrink)), max(1, round(height / shrink))


# ---------------------------------------------------------------------- draws
def _draws(page: Page, drawn: MonteCarlo) -> Iterator[doc.Block]:
    """Probability that each requirement holds, with what needs no draws."""
    lines: list[doc.Line] = []
    for one in drawn.requirements:
        sizes = ("–" if size is None else format_quantity(size, one.unit) for size in (one.sum, one.rss, one.sigma))
        in_draws = probability_words(one.probability, one.probability_low, one.probability_high)
        lines.append((doc.Name(one.id), limit_words(one.limit, one.unit), *sizes, in_draws))
    if drawn.probability is not None and len(drawn.requirements) > 1:
        ends = (drawn.probability_low or 0.0, drawn.probability_high or 1.0)
        lines.append((doc.Name("all at once"), *("–",) * 4, probability_words(drawn.probability, *ends)))
    if lines:
        yield doc.TextTable(
            f"Monte Carlo of {page.name}",
            f"How often each requirement holds: {drawn.draws:,} draws, seed {drawn.seed}, {drawn.model} model; "
            f"intervals of {100 * drawn.confidence:.0f} %. Beside it what needs no draws: worst-case sum, "
            "root-sum-square, standard deviation.",
            doc.heads(doc.Head("Requirement", "id"), *doc.numbers("Limit", "Sum", "Rss", "Sigma"), "Over the draws"),
            lines,
        )
    remarks = [f"{one.id}: {text}" for one in drawn.requirements for text in one.warnings]
    remarks += drawn.notes
    if drawn.probability is None:
        remarks.append("no declared error has a requirement to hold")
    if remarks:
        yield doc.Items([[f"{sentence(text)}."] for text in remarks])


# ---------------------------------------------------------------------- all rows
def _rows(page: Page) -> Iterator[doc.Block]:
    """Rows and contributions that a summary leaves out, with the remarks of all rows."""
    if page.hidden:
        yield matrix_table(page, page.hidden, f"Other rows of {page.name}", "Rows that are not in the summary")
    if page.undeclared and page.matrix:
        yield undeclared_table(page)
    if remarks := grouped(all_remarks(page)):
        yield doc.Chapter("Remarks", [remarks], level=4)
    yield from all_contributions(page)


def sources(found: MissionFindings) -> tuple[dict[str, list[str]], list[str]]:
    """Rows by the source that the file names for their error, and the rows of which it names none and should."""
    by_source: dict[str, list[str]] = {}
    unsourced = []
    for row in found.rows:
        if row.declared is None or not row.is_independent:
            continue
        if row.evidence:
            by_source.setdefault(row.evidence, []).append(row.id)
        elif row.subject.kind in _SOURCED:
            unsourced.append(row.id)
    return by_source, unsourced


def _sources(page: Page) -> Iterator[doc.Block]:
    by_source, unsourced = sources(page.found)
    if by_source:
        yield doc.Facts([(text, doc.Styled("id", doc.listed(ids))) for text, ids in by_source.items()], "remarks")
    if unsourced:
        names: list[doc.Text] = []
        for row_id in unsourced:
            names += [", " if names else "", doc.Styled("id", doc.Name(row_id))]
        yield doc.Paragraph(("The file names no source for ", *names, "."))
    elif not by_source:
        yield doc.Paragraph("No error is declared that would need one.")


def _formulas(page: Page) -> Iterator[doc.Block]:
    """Every derivation with its numbers, then what no single row has."""
    found = page.found
    placed = page.mission._replace(file=page.file)  # the same name in every section
    yield doc.Paragraph(
        "Formulas are as derived from the geometry; table and equation numbers are those of Rigling & Moses. SI "
        "units and radians, six digits."
    )
    steps = list(collection_chain(found))
    collection = doc.Steps(f"Formulas of the collection, {page.name}", steps, "step long")
    yield doc.Chapter("The collection", [collection], level=4)
    for number, row in enumerate(page.matrix, start=1):
        title = (doc.Styled("id", doc.Name(row.id)), " ", doc.Badge(row.status))
        derivation = doc.Steps(f"Formulas of {row.id}, {page.name}", list(chain(placed, found, row)))
        yield doc.Chapter(title, [derivation], f"{page.anchor}-row-{number}", level=4, style="derivation")
    general = [
        (f"{number or 'Full model'}, {title[:1].lower()}{title[1:]}", [doc.Equality(left, right)])
        for number, title, left, right in EQUATIONS
        if number not in ("(11)", "(31)") and (page.mission.has_direct_path or not title.startswith("Direct path"))
    ]
    yield doc.Chapter("In general", [doc.Steps(f"General formulas, {page.name}", general)], level=4)
