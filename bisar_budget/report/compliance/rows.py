"""The rows of a mission in a report: the compliance matrix, and where phase and displacement come from."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.effects.declared import END_OF_IMAGE
from bisar_budget.effects.effect import MOTION_UNITS, Subject
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.row import DECLARE, SPECIFICATION, Row, worst_first
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
    phase_unit,
    row_size,
    sentence,
    shown_use,
    use_words,
)
from bisar_budget.units import format_in, format_quantity

_TOP = 8  # contributions of a summary
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


# ---------------------------------------------------------------------- matrix
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
                (dashed(use_words(use)), doc.Use(use, row.status)),
                dashed(row_size(row.declared, row, page.found)),
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
        return f"× {_down(1 + row.margin):.7g}"
    down = _down(value) if value else 0.0
    text = f"{down:+.0f}" if abs(value) >= 100 else f"{down:+.3g}"
    return ("0" if down == 0 else text).replace("-", "−") + " %"


def _down(value: float) -> float:
    """Round to three digits, never up; one part in 10¹² keeps an exact number what it is."""
    step = 2 - math.floor(math.log10(abs(value)))
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
    if row.metric == SPECIFICATION:
        return "specified size of the error"
    if row.metric == DECLARE:
        return f"declared: {', '.join(requirements.declare)}"
    if row.subject.kind == "autofocus_pull_in":
        return "all QPE together within what autofocus corrects, π·N_pull"
    if row.subject.kind == "spatial_variance":  # one correction for the whole scene: no gain
        return f"QPE differs over the scene by ≤ {phase_limit(allocation.qpe_total, found)}"
    if row.subject.kind == "dispersion":
        return f"quadratic phase at the edges of the band ≤ {phase_limit(allocation.qpe_total, found)}"
    limit = allocation.qpe_allowed(row.owner)
    share = "" if row.owner == "mission" else f", {allocation.qpe.of(row.owner):.3g} of the budget"
    return f"QPE ≤ {phase_limit(limit, found)}{share}"


def method(row: Row, verdict: str | None) -> str:
    """Say how a row is verified: by analysis, and by the image where one was formed."""
    analysis = f"analysis: {row.equation}"
    if verdict is None:
        return analysis
    return f"{analysis}; simulation: {doc.Badge(verdict).words}"


# ---------------------------------------------------------------------- contributions
@dataclass(frozen=True, slots=True)
class Contribution:
    """Effect of one declared error; `part` is its size as a part of the largest, `more` what the annex says too."""

    id: str
    subject: Subject
    size: str
    part: float
    more: tuple[str, ...] = ()

    @property
    def owner(self) -> str:
        """Whose error it is: a platform's, both platforms', the clock's, the mission's."""
        is_common = self.subject.kind in (*MOTION_UNITS, "time_tag", "random") and self.subject.owner == "mission"
        return "both platforms" if is_common else self.subject.owner

    @property
    def axis(self) -> str:
        """Axis or term of the error."""
        return "height" if self.subject.kind == "terrain" else self.subject[3].replace("_", " ")


def phases(page: Page) -> list[Contribution]:
    """Quadratic phase errors, of equal loss, as the file states them, with their part of the sum, and by both models.

    An error that no image has comes before all others, and the others are no part of a sum with it.
    """
    by_model: dict[str, dict[str, float]] = {}
    for model in ("published", "full"):
        of_all = page.analysis.together(model).phases
        by_model[model] = {one.row_id: float(one.judged(1.0)[0]) for one in of_all}
    subjects = {row.id: row.subject for row in page.found.rows}
    gating = [name for name in by_model if page.found.model in (name, "strictest")]
    sizes = {row_id: max(by_model[name][row_id] for name in gating) for row_id in by_model["full"]}
    total, largest = math.fsum(sizes.values()), max(sizes.values(), default=0.0)
    result = []
    for row_id in sorted((row_id for row_id in sizes if sizes[row_id]), key=lambda row_id: -sizes[row_id]):
        qpe = sizes[row_id]
        part = 1.0 if qpe == largest else qpe / largest
        of_sum = percent(qpe / total) if math.isfinite(total) else "–"
        models = (_phase(of_all[row_id], page.found) for of_all in by_model.values())
        result.append(Contribution(row_id, subjects[row_id], _phase(qpe, page.found), part, (of_sum, *models)))
    return result


def _phase(value: float, found: MissionFindings) -> str:
    return format_in(value, "rad", phase_unit(found)) if math.isfinite(value) else "no image"


def moves(page: Page) -> list[Contribution]:
    """Displacements of the image by errors as the file states them."""
    rows = {row.id: row.displacement_m for row in page.found.rows}
    stated = [one.subject for one in page.analysis.stated]
    stated += [one.subject for one in page.analysis.random if one.declared is not None]
    stated += [one.subject for one in page.analysis.displacing_tones]
    known = [(what, rows.get(what.id)) for what in stated]
    moving = [(what, math.hypot(*by)) for what, by in known if by is not None and any(by)]
    moving.sort(key=lambda one: -one[1])
    largest = max((size for _, size in moving), default=1.0)
    return [Contribution(what.id, what, format_quantity(size, "m"), size / largest) for what, size in moving]


def largest_contributions(page: Page) -> Iterator[doc.Block]:
    """Tables of the errors with the largest phases and with the largest displacements."""
    found = (phases(page), moves(page))
    tables = [
        _largest(page, found[0], "phase", "QPE", "Quadratic phase error of each declared error, before autofocus"),
        _largest(page, found[1], "displacement", "Displacement", "Displacement of the image by each declared error"),
    ]
    if any(found):
        yield doc.Group("pair", [table for table, errors in zip(tables, found, strict=True) if errors])
    if not found[0]:
        yield doc.Paragraph("No declared error of motion, clock or another kind has a quadratic phase.")
    if not found[1]:
        yield doc.Paragraph("No declared error displaces the image.")


def _largest(page: Page, found: Sequence[Contribution], about: str, head: str, caption: str) -> doc.TextTable:
    of_sum = doc.numbers("Of the sum") if any(one.more for one in found) else []
    size = doc.Head(head, "number")
    columns = doc.heads("Owner", "Kind", "Axis or term", size, "Relative to the largest", *of_sum)
    lines: list[doc.Line] = [
        (one.owner, one.subject.kind, one.axis, one.size, doc.Bar(one.part, one.owner), *one.more[:1])
        for one in found[:_TOP]
    ]
    caption += f": the {_TOP} largest of {len(found)}" if len(found) > _TOP else ""
    return doc.TextTable(f"Contributions to the {about} of {page.name}", caption, columns, lines, "contributions")


def all_contributions(page: Page) -> Iterator[doc.Block]:
    """Tables of all errors that have a phase, and of all that displace the image."""
    models = ("Gating model", "Of the sum", "Published", "Full")
    for found, about, heads, caption in (
        (
            phases(page), "contributions to the phase", models,
            "Quadratic phase error of every declared error by the model that gates, the published and the full one, "
            "before autofocus; what has none is left out",
        ),
        (
            moves(page), "displacements", ("Displacement",),
            "Displacement of the image by every declared error",
        ),
    ):  # fmt: skip
        if found:
            columns = doc.heads(doc.Head("Id", "id"), *doc.numbers(*heads))
            lines: list[doc.Line] = [(doc.Name(one.id), one.size, *one.more) for one in found]
            yield doc.TextTable(f"All {about} of {page.name}", caption, columns, lines, "contributions")
