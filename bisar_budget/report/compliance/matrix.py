"""The compliance matrix: a line for each row of a mission: what sets its limit, how it is verified, its margin."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.effects.declared import END_OF_IMAGE
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.row import DECLARE, Row, worst_first
from bisar_budget.findings.status import STATUS
from bisar_budget.mission.model import Mission
from bisar_budget.report import Style
from bisar_budget.report.compliance import document as doc
from bisar_budget.report.words.identity import source_path
from bisar_budget.report.words.sentences import (
    allowable_words,
    dashed,
    matters,
    percent,
    phase_limit,
    row_size,
    sentence,
    shown_use,
)
from bisar_budget.units import format_quantity

_MATRIX_ROWS = 40  # of a summary; beyond, those that use least are left to the annex


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Page:
    """A mission that a report shows: what its sections share.

    `file` is the name of the mission file that is shown, `anchor` what tells it from other missions of the report.
    `matrix` are the rows that are declared or limit something, the worst first, `in_summary` the ids of those that a
    summary shows.
    """

    found: MissionFindings
    analysis: Analysis
    file: str
    anchor: str
    is_full: bool
    matrix: Sequence[Row]
    in_summary: frozenset[str]
    undeclared: Sequence[Row]

    @property
    def mission(self) -> Mission:
        """The mission file, as it was read."""
        return self.analysis.mission

    @property
    def name(self) -> str:
        """The name of the mission."""
        return self.found.name

    @property
    def number(self) -> str:
        """Its place in the report, from 1: the names of its pictures begin with it."""
        return self.anchor[1:]

    @property
    def judged(self) -> list[Row]:
        """Rows that were held to a limit or could not be, the worst first."""
        return [row for row in self.matrix if STATUS[row.status].is_judged]

    @property
    def hidden(self) -> list[Row]:
        """Rows of the matrix that a summary leaves out."""
        return [row for row in self.matrix if row.id not in self.in_summary]


def page_of(found: MissionFindings, style: Style, anchor: str) -> Page:
    """A mission, ready to be shown.

    Raises
    ------
    ValueError
        The findings do not carry their analysis.
    """
    rows = worst_first(found.rows)
    important = [row for row in rows if matters(row)]
    return Page(
        found=found,
        analysis=found.analysed(),
        file=source_path(found.file, style),
        anchor=anchor,
        is_full=style.detail == "full",
        matrix=[row for row in rows if row.status != "not_declared"],
        in_summary=frozenset(
            row.id for place, row in enumerate(important) if place < _MATRIX_ROWS or STATUS[row.status].is_explained
        ),
        undeclared=[row for row in found.rows if row.status == "not_declared"],
    )


def matrix_table(page: Page, rows: Iterable[Row], label: str, caption: str) -> doc.TextTable:
    """Lines of the matrix for some of its rows."""
    places = {row.id: place for place, row in enumerate(page.matrix, start=1)}
    verdicts = {verdict.id: verdict.verdict for verdict in page.found.verdicts or ()}
    sizes = doc.numbers("Utilization", "Declared", "Allowable", "Margin")
    said = ("Requirement", "Verified by", "Waiver")
    columns = doc.heads(doc.Head("Id", "id"), "Status", *sizes, *said, *doc.numbers("Line"))
    lines: list[doc.Line] = []
    for row in rows:
        name: doc.Text = doc.Name(row.id, f"{page.anchor}-row-{places[row.id]}" if page.is_full else "")
        use = shown_use(row)
        waiver = "; ".join(waiver.words for waiver in row.waivers)
        lines.append(
            (
                (name, doc.Styled("own-id", doc.Name(row.requirement_id))) if row.requirement_id else name,
                doc.Badge(row.status),
                (use_text(row), doc.Use(use, row.status)),
                "–" if row.declared is None else row_size(row.declared, row, page.found),
                dashed(allowable_words(row, page.found)),
                "–" if row.status == "not_evaluated" else margin(row),
                what_sets_it(page, row),
                method(row, verdicts.get(row.id)),
                doc.Styled("waiver", waiver) if waiver else "–",
                "–" if row.line is None else str(row.line),
            )
        )
    is_waived = any(row.waivers for row in page.matrix)
    return doc.TextTable(label, caption, columns, lines, "matrix" if is_waived else "matrix unwaived")


def undeclared_table(page: Page) -> doc.TextTable:
    """Errors that the file does not declare, and what each may be."""
    return doc.TextTable(
        f"Errors that {page.name} does not declare",
        "Not declared, so not judged, and what each may be",
        doc.heads(doc.Head("Id", "id"), *doc.numbers("Allowable"), "From"),
        [(doc.Name(row.id), dashed(allowable_words(row, page.found)), row.equation) for row in page.undeclared],
    )


def grouped(said: Iterable[tuple[str, Sequence[str]]]) -> doc.Facts | None:
    """Say once what several rows would say alike; None where none says anything."""
    groups: dict[str, list[str]] = {}
    for row_id, texts in said:
        if texts:
            groups.setdefault("; ".join(texts), []).append(row_id)
    pairs = [(doc.Styled("id", doc.listed(ids)), f"{sentence(text)}.") for text, ids in groups.items()]
    return doc.Facts(pairs, "remarks") if pairs else None


def all_remarks(page: Page) -> Iterator[tuple[str, Sequence[str]]]:
    """Remarks of each row of the matrix, besides its numbers."""
    for row in page.matrix:
        yield row.id, [text for text in (row.reason, *row.remarks, *row.refuted) if text]


def use_text(row: Row) -> str:
    """Utilization of a row in words."""
    use = shown_use(row)
    return "–" if use is None else percent(use)


def limit_words(value: float, unit: str) -> str:
    """Round down, everywhere alike: no limit is larger than it is, and none has two sizes on a page."""
    return format_quantity(value, unit, 3, "down")


def margin(row: Row) -> str:
    """Write allowable over declared less one, or the levels' difference, rounded down: never more than there is.

    From 1000 % on, how many times the declared value is allowed.
    """
    if row.margin is None:
        return "–"
    if row.unit == "dB" and row.allowable is not None and row.declared is not None:
        tenths = math.floor(10 * (row.allowable - row.declared) + 1e-9)
        return f"{tenths / 10:+.1f} dB".replace("-", "−")
    value = 100 * row.margin
    if value >= 1e8:
        return "× > 1e6"
    if value > 1000:
        return f"× {_down(1 + row.margin, 3):.7g}"
    down = _down(value, 3) if value else 0.0
    text = f"{down:+.0f}" if abs(value) >= 100 else f"{down:+.3g}"
    return ("0" if down == 0 else text).replace("-", "−") + " %"


def _down(value: float, digits: int) -> float:
    """Round to so many digits, never up; one part in 10¹² keeps an exact number what it is."""
    step = digits - 1 - math.floor(math.log10(abs(value)))
    return math.floor(value * 10.0**step * (1 + math.copysign(1e-12, value))) / 10.0**step if step < 300 else value


def what_sets_it(page: Page, row: Row) -> str:
    """Say which requirement sets the allowable of a row."""
    found, requirements, allocation = page.found, page.mission.requirements, page.found.allocation
    binding = row.binding_requirement if row.metric == "quadratic_phase_error" else row.metric
    if binding in ("pslr", "islr"):
        value = requirements.pslr if binding == "pslr" else requirements.islr
        what = "paired echoes" if binding == "pslr" else "power spread"
        split = allocation.pslr if binding == "pslr" else allocation.islr
        if value is None:
            return "none stated"
        return f"{what} ≤ {value:g} dB, {split.of(row.owner):.3g} of the power"
    if binding == "cubic_phase_error":
        value = requirements.cubic_phase_error
        return "none stated" if value is None else f"cubic phase ≤ {phase_limit(value, found)}"
    if binding == END_OF_IMAGE:
        return "end of the image: no ground point has the range history of a larger error"
    if binding == "location_error":
        value = requirements.location_error
        return "none stated" if value is None else f"displacement ≤ {limit_words(value, 'm')}"
    if row.metric == DECLARE:
        return f"declared: {', '.join(requirements.declare)}"
    if row.subject.kind == "autofocus_pull_in":
        return "all QPE together within what autofocus corrects, π·N_pull"
    if row.subject.kind == "spatial_variance":  # one correction for the whole scene: no gain
        return f"QPE differs over the scene by ≤ {phase_limit(allocation.qpe_total, found)}"
    limit = allocation.qpe_limit(row.owner) * allocation.autofocus_gain
    share = "" if row.owner == "mission" else f", {allocation.qpe.of(row.owner):.3g} of the budget"
    return f"QPE ≤ {phase_limit(limit, found)}{share}"


def method(row: Row, verdict: str | None) -> str:
    """Say how a row is verified: by analysis, and by the image where one was formed."""
    analysis = f"analysis: {row.equation}"
    if verdict is None:
        return analysis
    return f"{analysis}; simulation: {STATUS[verdict].words if verdict in STATUS else verdict}"
