"""The annex of a compliance report.

It contains the sweep, images and Monte Carlo draws that were requested. With `--detail full`, it also contains all
rows.
"""

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from shlex import quote

import numpy as np

from bisar_budget.arrays import NumbersOrWords
from bisar_budget.catalogue import EQUATIONS
from bisar_budget.faults import changes_words, printable
from bisar_budget.findings.images import ImageEvidence, PointImage
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.specification import SpecificationSheet
from bisar_budget.findings.status import STATUS, complying
from bisar_budget.findings.trade import Axis, Trade, TradeStudy
from bisar_budget.report import document as doc
from bisar_budget.report.answers import verify_answer as verification
from bisar_budget.report.answers.allocate_answer import specified
from bisar_budget.report.answers.monte_carlo_answer import draws
from bisar_budget.report.compliance.rows import (
    Page,
    all_contributions,
    all_remarks,
    grouped,
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
from bisar_budget.report.words.sentences import BINDING_WORDS, counted, percent, sentence, waived_count

_MAX_LISTED_LINES = 20  # of the table of a sweep
_MAX_LISTED_WORDS = 6  # words of an axis that a sentence lists


def annex(page: Page, *, several: bool) -> list[doc.Chapter]:
    """Return the annex of a mission as a list with one chapter; the list is empty if the annex would be empty."""
    findings = page.findings
    sections = [] if findings.study is None else [_studied(page, findings.study)]
    if findings.sheet is not None:
        sections.append(
            doc.Chapter("Specifications", list(_specified(page, findings.sheet)), f"{page.anchor}-specified")
        )
    if findings.verdicts is not None:
        sections.append(doc.Chapter("Image evidence", list(_evidence(page)), f"{page.anchor}-evidence"))
    if findings.monte_carlo is not None:
        sections.append(
            doc.Chapter("Monte Carlo", list(draws(findings.monte_carlo, page.name)), f"{page.anchor}-draws")
        )
    if page.is_full:
        title = "Formulas with their numbers"
        sections += [
            doc.Chapter("All rows", list(_rows(page)), f"{page.anchor}-rows"),
            doc.Chapter("Sources", list(_sources(page)), f"{page.anchor}-sources"),
            doc.Chapter(title, list(_formulas(page)), f"{page.anchor}-formulas", short="Formulas"),
        ]
    title = f"Annex: {page.name}" if several else "Annex"
    chapter = doc.Chapter(title, sections, f"{page.anchor}-annex", level=2, style="annex", is_article=True)
    return [chapter] if sections else []


# ---------------------------------------------------------------------- specifications
def _specified(page: Page, sheet: SpecificationSheet) -> Iterator[doc.Block]:
    """Yield the specification sheet of a mission, and the number of errors declared larger than specified."""
    outside = sum(spec.declared is not None and not spec.holds(spec.declared) for spec in sheet.specifications)
    silent = sum(spec.declared is None and spec.ordered is not None for spec in sheet.specifications)
    clauses = list[str]()
    if not sheet.broken:
        clauses.append(f"declared sizes above their specification: {outside}")
        clauses += [f"not declared: {silent}"] if silent else []
    suffix = "; ".join(["", *clauses])
    subject = "Sizes that together meet every requirement, for the errors in "
    yield doc.Paragraph((subject, doc.Code("allocation.specify"), f"{suffix}."))
    yield from specified(sheet, f"{page.anchor}-specified")
    yield doc.Paragraph(doc.Code(f"bisar-budget allocate {quote(page.file)}"), "command")


# ---------------------------------------------------------------------- a sweep
def _studied(page: Page, study: TradeStudy) -> doc.Chapter:
    """Return the chapter about a sweep: its question, a drawing, a table, and the command that reproduces it."""
    findings, trade = page.findings, study.trade
    by_word = per_word(trade)
    counts, question = _counts(study), _question(trade)
    if len(trade.axes) == 1:
        listed_lines = list(_stretches(trade))
        heads = doc.heads("Values", "Status", doc.Head("Worst row", "id"), *doc.numbers("Utilization"))
        caption = "Values that comply, and the binding row: the one that uses most of its limit"
    else:
        listed_lines = list(_binding_lines(trade, by_word[1] if by_word else {}))
        name: doc.Text = doc.Name(by_word[0].key) if by_word else "Worst row"
        waived_heads = ["Waived"] if study.waived else []
        heads = doc.heads(doc.Head(name, "id"), *doc.numbers("Cases", "Comply", *waived_heads, "Utilization"))
        caption = "Binding rows, with the number of their cases and of those that comply"
        caption = "Number of cases that comply, by value" if by_word else caption
    ellipsis = " ..." if len(listed_lines) > _MAX_LISTED_LINES else "."
    list_words = "; ".join(words for _, words in listed_lines[:_MAX_LISTED_LINES]) + ellipsis
    title = f"Trade study: {' and '.join(axis.key for axis in trade.axes)}"
    svg = trade_drawing(
        trade, study.rows, findings.file, f"{title}, {page.name}", f"{question} {counts} {list_words}"
    )
    illustration: list[doc.Block] = [
        doc.Figure(f"{page.number}-study.svg", page.anchor, doc.Name(title), f"{title} of {page.name}", svg)
    ]
    if listed_lines:
        lines = [line for line, _ in listed_lines[:_MAX_LISTED_LINES]]
        illustration.append(doc.TextTable(f"Cases of {page.name}", caption, heads, lines))
    blocks: list[doc.Block] = [
        doc.Paragraph(question),
        doc.Paragraph(f"{counts} Each was checked like the mission itself. This command writes them as a table:"),
        doc.Paragraph(doc.Code(_command(findings, study, page.file)), "command"),
        doc.Group("beside", illustration),
    ]
    if hidden := max(len(listed_lines) - _MAX_LISTED_LINES, 0):
        blocks.append(doc.Paragraph(f"Not shown: {counted(hidden, 'more line')}.", "more"))
    return doc.Chapter("Trade study", blocks, f"{page.anchor}-study", style="study")


def _question(trade: Trade) -> str:
    keys = [f"{printable(axis.key)}, {_values(axis)}" for axis in trade.axes]
    if len(keys) == 2:
        return f"Which combinations of {keys[0]}, and {keys[1]}, comply?"
    return f"Which values of {keys[0]}, comply?"


def _values(axis: Axis) -> str:
    """Describe the values of a sweep axis: a list of words, or the count and the first and last number."""
    count = len(axis.values)
    if axis.words:
        word_list = ", ".join(map(printable, axis.words[:_MAX_LISTED_WORDS]))
        return f"{word_list} and {count - _MAX_LISTED_WORDS} more" if count > _MAX_LISTED_WORDS else word_list
    steps = " in equal ratios" if axis.is_log else ""
    return f"{count} values{steps} from {_value(axis, 0)} to {_value(axis, -1)}"


def _value(axis: Axis, index: int) -> str:
    return printable(axis.words[index]) if axis.words else f"{axis.values[index]:.5g} {axis.unit}".rstrip()


def _counts(study: TradeStudy) -> str:
    failing = study.cases - study.complying - study.waived - study.missing - study.unevaluated
    clauses = [f"{study.cases} cases", f"{study.complying} comply ({percent(study.complying / study.cases)})"]
    if study.waived:
        clauses.append(waived_count(study.waived, study.waived_by))
    if study.unevaluated:
        clauses.append(f"{study.unevaluated} not evaluated")
    if failing:
        clauses.append(f"{failing} break a requirement")
    if study.missing:
        clauses.append(f"{study.missing} without a mission")
    return f"{clauses[0]}: {', '.join(clauses[1:])}."


def _command(findings: MissionFindings, study: TradeStudy, file: str) -> str:
    """Write the command line that repeats a sweep and stores its cases in a table and a plot."""
    analysed = findings.analysed().mission
    words = ["bisar-budget sweep", quote(printable(file))]
    words += [f"--vary {quote(printable(text))}" for text in study.asked]
    words += [changes_words(findings.changes)] if findings.changes else []
    words += [f"--model {study.model}"] if study.model else []
    words += [f"--date {study.day}"] if analysed.waivers else []
    return " ".join([*words, "-o study.csv --plot study.svg"])


def _stretches(trade: Trade) -> Iterator[tuple[doc.Line, str]]:
    """Yield the lines of the table of a sweep over one axis, each with a sentence about the line.

    Neighbouring numerical values with the same status and the same worst row share a line. A value that is a word has
    its own line. The binding requirement is written after the name of the row, unless the name ends with it.
    """
    (axis,) = trade.axes
    status, rows, uses = (trade.values[name] for name in ("status", "worst_row", "utilization"))
    begins = (status[1:] != status[:-1]) | (rows[1:] != rows[:-1]) | bool(axis.words)
    for start, stop in stretches(begins):
        value_range = _value(axis, start) + (f" to {_value(axis, stop - 1)}" if stop - 1 > start else "")
        row, use, badge = str(rows[start]), _uses(uses[start:stop]), doc.Badge(str(status[start]))
        name: doc.Text = doc.Name(row) if row else "–"
        binding = str(trade.values["binding_requirement"][start])
        if not row.endswith(binding):
            name = (name, doc.Styled("own-id", BINDING_WORDS.get(binding, binding.replace("_", " "))))
        text = f"{value_range}: {STATUS[badge.status].words}" + (f", {row} {use}" if row else "")
        yield (value_range, badge, name, use), text


def _uses(uses: NumbersOrWords) -> str:
    """Text with the range of the finite utilizations, from lowest to highest; a dash if no utilization is finite."""
    finite_uses = sorted(float(use) for use in uses if math.isfinite(use))
    if not finite_uses:
        return "–"
    low, high = percent(finite_uses[0]), percent(finite_uses[-1])
    return low if low == high else f"{low} to {high}"


def _binding_lines(trade: Trade, by_word: Mapping[str, Trade]) -> Iterator[tuple[doc.Line, str]]:
    """Yield the lines of the table of a sweep over two axes, each with a sentence about the line.

    If one axis has words as values, each line counts the cases with one of the words. Otherwise, each line counts the
    cases with the same worst row, and the line with the most cases comes first.
    """
    cases: dict[str, Mapping[str, NumbersOrWords]] = {printable(word): each.values for word, each in by_word.items()}
    if not by_word:
        values = {name: trade.values[name].ravel() for name in ("status", "worst_row", "utilization")}
        rows = values["worst_row"]
        names, counts = np.unique(rows[rows != ""].astype(str), return_counts=True)
        for index in np.argsort(-counts, kind="stable").tolist():
            cases[str(names[index])] = {name: column[rows == names[index]] for name, column in values.items()}
    is_waived = "waived" in trade.statuses
    for name, case_values in cases.items():
        statuses = case_values["status"].tolist()
        comply, waived = complying(Counter(statuses)), statuses.count("waived")
        waived_words = f", {waived} waived" if waived else ""
        numbers = (str(len(statuses)), str(comply), *([str(waived)] if is_waived else []))
        line: doc.Line = (doc.Name(name), *numbers, _uses(case_values["utilization"]))
        yield line, f"{name}: {comply} of {len(statuses)} comply{waived_words}"


# ---------------------------------------------------------------------- images
def _evidence(page: Page) -> Iterator[doc.Block]:
    """Yield the blocks that compare predictions with measurements in images, each with an error at its limit."""
    verdicts = page.findings.verdicts or ()
    yield doc.Paragraph(
        "Each error was set to its limit in data simulated from exact ranges, and the phase was measured in the "
        "image."
    )
    yield doc.TextTable(
        f"Image evidence of {page.name}",
        "At the limit: budget, predictions by Table II, the full model and exact ranges, and the measurement in the "
        "image. Phases in rad.",
        _heads("Limit", "Budget", "Table II", "Full model", "Exact ranges", "Image"),
        [
            (
                doc.Name(verdict.id),
                verification.limit(verdict),
                *verification.numbers(verdict),
                doc.Badge(verdict.verdict),
            )
            for verdict in verdicts
        ],
    )
    refocused: list[doc.Line] = [
        (doc.Name(verdict.id), *verification.refocused_cells(verdict), doc.Badge(verdict.verdict_autofocus))
        for verdict in verdicts
        if verdict.verdict_autofocus
    ]
    if refocused:
        yield doc.TextTable(
            f"Refocused images of {page.name}",
            "At the limit with autofocus, refocused",
            _heads("Limit", "Budget", "Residual", "Peak loss"),
            refocused,
        )
    for number, evidence in enumerate(page.findings.image_evidence or (), start=1):
        yield _images(page, evidence, number)
    remarks: list[list[doc.Text]] = [[f"{sentence(text)}."] for text in verification.geometry_remarks(verdicts)]
    for verdict in verdicts:
        with_autofocus = verdict.reason_autofocus and f"with autofocus: {verdict.reason_autofocus}"
        if reasons := [reason for reason in (verdict.reason, with_autofocus) if reason]:
            remarks.append([(doc.Styled("id", doc.Name(verdict.id)), f": {'; '.join(reasons)}.")])
    if remarks:
        yield doc.Items(remarks)


def _heads(*heads: str) -> list[doc.Head]:
    return doc.heads(doc.Head("Id", "id"), *doc.numbers(*heads), "Verdict")


def _images(page: Page, evidence: ImageEvidence, number: int) -> doc.Group:
    """Return the images that were formed for a row at its limit, with the cuts through them."""
    row_id = evidence.verdict.id
    subject = f"{row_id} at the limit with autofocus"
    point_images = [("limit", f"{row_id} at the limit", "At the limit", evidence.at_limit)]
    if evidence.before_autofocus and evidence.after_autofocus:
        before, after = "At the limit with autofocus, before autofocus", "After autofocus"
        point_images.append(("before", f"{subject}, before autofocus", before, evidence.before_autofocus))
        point_images.append(("after", f"{subject}, after autofocus", after, evidence.after_autofocus))
    chips = [
        doc.ShownImage(
            f"{page.number}-chip-{number}-{name}.png", title, f"{caption}: {chip_caption(image)}", chip_png(image),
            _page_size(image),
        )
        for name, title, caption, image in point_images
    ]  # fmt: skip
    title = f"Cross-range cuts of {row_id}"
    svg = impulse_response_cuts(evidence)
    cuts = doc.Figure(f"{page.number}-cuts-{number}.svg", page.anchor, title, f"{title}, {page.name}", svg, "cuts")
    words = doc.Paragraph(" ".join(numbers_in_words(evidence)))
    heading = ("Images of ", doc.Styled("id", doc.Name(row_id)))
    return doc.Group("illustration", [words, doc.Group("images", [doc.Images(chips), cuts])], heading)


def _page_size(image: PointImage) -> tuple[int, int]:
    """Width and height of an image on a page, each reduced to at most 240. [px]"""
    width, height = chip_size(image)
    shrink = max(1.0, width / 240, height / 240)
    return max(1, round(width / shrink)), max(1, round(height / shrink))


# ---------------------------------------------------------------------- draws
# ---------------------------------------------------------------------- all rows
def _rows(page: Page) -> Iterator[doc.Block]:
    """Yield the rows and contributions that are not in the summary, and the remarks on all rows."""
    if page.hidden:
        yield matrix_table(page, page.hidden, f"Other rows of {page.name}", "Rows that are not in the summary")
    if page.undeclared and page.matrix:
        yield undeclared_table(page)
    if remarks := grouped(all_remarks(page)):
        yield doc.Chapter("Remarks", [remarks], level=4)
    yield from all_contributions(page)


def sources(findings: MissionFindings) -> tuple[dict[str, list[str]], list[str]]:
    """Map each source in the file to the ids of its rows, and list the ids of declared rows without a source."""
    by_source: dict[str, list[str]] = {}
    unsourced = []
    for row in findings.rows:
        if row.declared is None or not row.is_independent:
            continue
        if row.evidence:
            by_source.setdefault(row.evidence, []).append(row.id)
        elif row.subject.facts.owes_source:
            unsourced.append(row.id)
    return by_source, unsourced


def _sources(page: Page) -> Iterator[doc.Block]:
    by_source, unsourced = sources(page.findings)
    if by_source:
        yield doc.Facts([(text, doc.Styled("id", doc.listed(ids))) for text, ids in by_source.items()], "remarks")
    if unsourced:
        names: list[doc.Text] = []
        for row_id in unsourced:
            names += [", " if names else "", doc.Styled("id", doc.Name(row_id))]
        yield doc.Paragraph(("The file names no source for ", *names, "."))
    elif not by_source:
        yield doc.Paragraph("No declared error needs a source.")


def _formulas(page: Page) -> Iterator[doc.Block]:
    """Yield the derivations of all rows with their numbers, followed by the general formulas."""
    findings = page.findings
    mission = page.mission._replace(file=page.file)  # every section writes the same path
    yield doc.Paragraph(
        "Formulas are as derived from the geometry; table and equation numbers are those of Rigling & Moses. SI "
        "units and radians, six digits."
    )
    steps = list(collection_chain(findings))
    collection = doc.Steps(f"Formulas of the collection, {page.name}", steps, "step long")
    yield doc.Chapter("The collection", [collection], level=4)
    for number, row in enumerate(page.matrix, start=1):
        title = (doc.Styled("id", doc.Name(row.id)), " ", doc.Badge(row.status))
        derivation = doc.Steps(f"Formulas of {row.id}, {page.name}", list(chain(mission, findings, row)))
        yield doc.Chapter(title, [derivation], f"{page.anchor}-row-{number}", level=4, style="derivation")
    general = [
        (f"{number or 'Full model'}, {title[:1].lower()}{title[1:]}", [doc.Equality(left, right)])
        for number, title, left, right in EQUATIONS
        if number not in ("(11)", "(31)") and (page.mission.has_direct_path or not title.startswith("Direct path"))
    ]
    yield doc.Chapter("General formulas", [doc.Steps(f"General formulas, {page.name}", general)], level=4)
