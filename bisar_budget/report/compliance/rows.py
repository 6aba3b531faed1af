"""Tables of the rows of a mission: the compliance matrix, and the contributions to phase and displacement."""

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.effects.declared import END_OF_IMAGE
from bisar_budget.effects.effect import Subject, plain
from bisar_budget.error_kinds.kind import SourceKind
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.findings.row import DECLARE, SPECIFICATION, Row, worst_first
from bisar_budget.findings.status import STATUS
from bisar_budget.mission.model import Mission
from bisar_budget.report import Style
from bisar_budget.report import document as doc
from bisar_budget.report.words.identity import source_path
from bisar_budget.report.words.percentiles import with_confidence
from bisar_budget.report.words.sentences import (
    allowable_words,
    dashed,
    declared_size,
    matters,
    percent,
    phase_limit,
    phase_unit,
    sentence,
    shown_use,
    use_words,
)
from bisar_budget.units import format_in, format_quantity

_MAX_LARGEST_ROWS = 6  # contributions in each table of a summary
_MAX_MATRIX_ROWS = 16  # rows in a summary; the annex has the other rows, with smaller utilizations
_MAX_BRIEF_ROWS = 6  # rows in the summary of one of several missions


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Page:
    """The findings about a mission that are used by all sections of its report.

    `file` is the path of the mission file as shown in the report. `anchor` identifies the mission within the report.
    `matrix` has all rows except undeclared errors, worst first. `in_summary` has the ids of the rows in the summary.
    `is_brief` is True in a report on several missions, which shows fewer rows of each.
    """

    findings: MissionFindings
    analysis: Analysis
    file: str
    anchor: str
    is_full: bool
    matrix: Sequence[Row]
    in_summary: frozenset[str]
    undeclared: Sequence[Row]
    is_brief: bool = False

    @property
    def mission(self) -> Mission:
        """The mission as it was read from its file."""
        return self.analysis.mission

    @property
    def name(self) -> str:
        """The name of the mission."""
        return self.findings.name

    @property
    def number(self) -> str:
        """Number of the mission in the report, counted from 1. The file names of its pictures begin with it."""
        return self.anchor[1:]

    @property
    def judged(self) -> list[Row]:
        """Rows with a verdict, and rows that could not be judged, worst first."""
        return [row for row in self.matrix if STATUS[row.status].is_judged]

    @property
    def hidden(self) -> list[Row]:
        """Rows of the matrix that are not in the summary."""
        return [row for row in self.matrix if row.id not in self.in_summary]


def page_of(findings: MissionFindings, style: Style, anchor: str, *, is_brief: bool = False) -> Page:
    """Collect the findings for the report on a mission; a brief report has fewer rows.

    Raises
    ------
    ValueError
        The findings do not contain their analysis.
    """
    rows = worst_first(findings.rows)
    important = [row for row in rows if matters(row)]
    most = _MAX_BRIEF_ROWS if is_brief else _MAX_MATRIX_ROWS
    return Page(
        findings=findings,
        analysis=findings.analysed(),
        file=source_path(findings.file, style),
        anchor=anchor,
        is_full=style.detail == "full",
        matrix=[row for row in rows if row.status != "not_declared"],
        in_summary=frozenset(
            row.id
            for index, row in enumerate(important)
            if index < most or (STATUS[row.status].is_explained and not is_brief)
        ),
        undeclared=[row for row in findings.rows if row.status == "not_declared"],
        is_brief=is_brief,
    )


# ---------------------------------------------------------------------- matrix
def matrix_table(page: Page, rows: Iterable[Row], label: str, caption: str) -> doc.TextTable:
    """Make the table of the compliance matrix with the given rows of a mission."""
    numbers = {row.id: number for number, row in enumerate(page.matrix, start=1)}
    verdicts = {verdict.id: verdict.verdict for verdict in page.findings.verdicts or ()}
    sizes = doc.numbers("Utilization", "Declared", "Allowable", "Margin")
    text_heads = ("Requirement", "Verified by", "Waiver")
    columns = doc.heads(doc.Head("Id", "id"), "Status", *sizes, *text_heads, *doc.numbers("Line"))
    lines: list[doc.Line] = []
    for row in rows:
        name: doc.Text = doc.Name(row.id, f"{page.anchor}-row-{numbers[row.id]}" if page.is_full else "")
        use = shown_use(row)
        waiver = "; ".join(waiver.words for waiver in row.waivers)
        lines.append(
            (
                (name, doc.Styled("own-id", doc.Name(row.requirement_id))) if row.requirement_id else name,
                doc.Badge(row.status),
                (dashed(use_words(use)), doc.Use(use, row.status)),
                dashed(declared_size(row, page.findings)),
                dashed(allowable_words(row, page.findings)),
                "–" if row.is_unjudged else margin(row),
                source_of_limit(page, row),
                method(row, verdicts.get(row.id)),
                doc.Styled("waiver", waiver) if waiver else "–",
                "–" if row.line is None else str(row.line),
            )
        )
    is_waived = any(row.waivers for row in page.matrix)
    return doc.TextTable(label, caption, columns, lines, "matrix" if is_waived else "matrix unwaived")


def undeclared_table(page: Page) -> doc.TextTable:
    """Table of the errors that the file does not declare, with their allowables."""
    return doc.TextTable(
        f"Errors that {page.name} does not declare",
        "Not declared and not judged, with allowables",
        doc.heads(doc.Head("Id", "id"), *doc.numbers("Allowable"), "From"),
        [(doc.Name(row.id), dashed(allowable_words(row, page.findings)), row.equation) for row in page.undeclared],
    )


def grouped(row_texts: Iterable[tuple[str, Sequence[str]]]) -> doc.Facts | None:
    """Group row ids by text: each text appears once, with the ids of all its rows. None if there are no texts."""
    groups: dict[str, list[str]] = {}
    for row_id, texts in row_texts:
        if texts:
            groups.setdefault("; ".join(texts), []).append(row_id)
    pairs = [(doc.Styled("id", doc.listed(ids)), f"{sentence(text)}.") for text, ids in groups.items()]
    return doc.Facts(pairs, "remarks") if pairs else None


def all_remarks(page: Page) -> Iterator[tuple[str, Sequence[str]]]:
    """Yield the id and the remarks of each row of the matrix."""
    for row in page.matrix:
        yield row.id, [text for text in (row.reason, *row.remarks, *row.refuted) if text]


def limit_words(value: float, unit: str) -> str:
    """Write a limit with three digits, rounded down. All limits of a report are written by this function."""
    return format_quantity(value, unit, 3, "down")


def margin(row: Row) -> str:
    """Write the margin of a row: allowable/declared − 1 in percent, or the difference of levels in dB.

    The margin is rounded down. Above 1000 %, the ratio allowable/declared is written instead.
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
    """Round down to three digits, with a tolerance of one part in 10¹² so that exact numbers are not changed."""
    step = 2 - math.floor(math.log10(abs(value)))
    return math.floor(value * 10.0**step * (1 + math.copysign(1e-12, value))) / 10.0**step if step < 300 else value


# Forms of the limits of sums that have no requirement of their own, by kind. Autofocus has one correction for the
# whole scene, so that the limit of the difference over the scene contains no gain.
LIMIT_FORMS = {
    "autofocus_pull_in": "total QPE within the pull-in range of autofocus, π·N_pull",
    "spatial_variance": "QPE differs over the scene by ≤ {}",
    "dispersion": "quadratic phase at the edges of the band ≤ {}",
}


def source_of_limit(page: Page, row: Row) -> str:
    """Text about the requirement that sets the allowable of a row."""
    findings, requirements, allocation = page.findings, page.mission.requirements, page.findings.allocation
    binding = row.binding_requirement if row.metric == "quadratic_phase_error" else row.metric
    judged = {requirement.key: requirement for requirement in findings.requirements}

    def phase_words(value: float, key: str) -> str:
        return with_confidence(phase_limit(value, findings), judged.get(key))

    if binding in ("pslr", "islr"):
        value = requirements.pslr if binding == "pslr" else requirements.islr
        effect = "paired echoes" if binding == "pslr" else "power spread"
        split = allocation.pslr if binding == "pslr" else allocation.islr
        if value is None:
            return "none stated"
        return f"{effect} ≤ {value:g} dB, {split.of(row.owner):.3g} of the power"
    if binding == "cubic_phase_error":
        value = requirements.cubic_phase_error
        return "none stated" if value is None else f"cubic phase ≤ {phase_words(value, binding)}"
    if binding == END_OF_IMAGE:
        return "end of the image: no ground point has the range history of a larger error"
    if binding == "location_error":
        value = requirements.location_error
        if value is None:
            return "none stated"
        return f"displacement ≤ {with_confidence(limit_words(value, 'm'), judged.get(binding))}"
    if row.metric == SPECIFICATION:
        return "specified size of the error"
    if row.metric == DECLARE:
        return f"declared: {', '.join(requirements.declare)}"
    if (limit_form := LIMIT_FORMS.get(row.subject.kind)) is not None:
        return limit_form.format(phase_limit(allocation.qpe_total, findings))
    limit = allocation.qpe_allowed(row.owner)
    share = "" if row.owner == "mission" else f", {allocation.qpe.of(row.owner):.3g} of the budget"
    return f"QPE ≤ {phase_words(limit, 'quadratic_phase_error')}{share}"


def method(row: Row, verdict: str | None) -> str:
    """Text on how a row was verified: by analysis, and also by simulation if its image was formed."""
    analysis = f"analysis: {row.equation}"
    if verdict is None:
        return analysis
    return f"{analysis}; simulation: {doc.Badge(verdict).words}"


# ---------------------------------------------------------------------- contributions
@dataclass(frozen=True, slots=True)
class Contribution:
    """Effect of one declared error on the phase or the position of the image.

    `fraction` is the ratio of this effect to the largest effect. `model_cells` are additional table cells for a
    phase: its share of the sum, and its values according to the published and the full model.
    """

    id: str
    subject: Subject
    size: str
    fraction: float
    model_cells: tuple[str, ...] = ()

    @property
    def kind(self) -> SourceKind:
        """The kind of error that causes the effect."""
        return self.subject.source_kind

    @property
    def owner(self) -> str:
        """Name of the platform to which the error belongs, or `both platforms`, `clock` or `mission`."""
        is_common = self.kind.is_shared and self.subject.owner == "mission"
        return "both platforms" if is_common else self.subject.owner

    @property
    def axis(self) -> str:
        """Axis of the error, or term of a clock error."""
        return self.kind.direction or self.subject.axis.replace("_", " ")


def phase_contributions(page: Page) -> list[Contribution]:
    """List the quadratic phase that each declared error causes by itself, largest first.

    The listed phase would cause the same peak loss as the quadratic phase of the error and its hidden phase together.
    The hidden phase is due mainly to constant and linear range errors that the bandwidth and the turn of the line of
    sight do not resolve. Each contribution has its share of the sum of all phases, and its values according to the
    published and the full model. An error that is too large to form an image has an infinite phase, and comes first.
    The sum is then infinite, and no contribution has a share.
    """
    by_model: dict[str, dict[str, float]] = {}
    for model in ("published", "full"):
        phases = page.analysis.together(model).phases
        by_model[model] = {phase.row_id: plain(phase.judged(1.0)) for phase in phases}
    subjects = {row.id: row.subject for row in page.findings.rows}
    gating = [name for name in by_model if page.findings.model in (name, "strictest")]
    sizes = {row_id: max(by_model[name][row_id] for name in gating) for row_id in by_model["full"]}
    total, largest = math.fsum(sizes.values()), max(sizes.values(), default=0.0)
    result = []
    for row_id in sorted((row_id for row_id in sizes if sizes[row_id]), key=lambda row_id: -sizes[row_id]):
        qpe = sizes[row_id]
        fraction = 1.0 if qpe == largest else qpe / largest
        sum_share = percent(qpe / total) if math.isfinite(total) else "–"
        models = (_phase(phases[row_id], page.findings) for phases in by_model.values())
        result.append(
            Contribution(row_id, subjects[row_id], _phase(qpe, page.findings), fraction, (sum_share, *models))
        )
    return result


def _phase(value: float, findings: MissionFindings) -> str:
    return format_in(value, "rad", phase_unit(findings)) if math.isfinite(value) else "no image"


def displacement_contributions(page: Page) -> list[Contribution]:
    """List the displacements of the image that are caused by the declared errors, largest first."""
    displacements = {row.id: row.displacement_m for row in page.findings.rows}
    subjects = [error.subject for error in page.analysis.stated]
    subjects += [error.subject for error in page.analysis.random if error.declared is not None]
    subjects += [tone.subject for tone in page.analysis.displacing_tones]
    distances = [(subject, math.hypot(*(displacements.get(subject.id) or (0.0, 0.0)))) for subject in subjects]
    distances = [(subject, distance) for subject, distance in distances if distance]
    distances.sort(key=lambda entry: -entry[1])
    largest = max((distance for _, distance in distances), default=1.0)
    return [
        Contribution(subject.id, subject, format_quantity(distance, "m"), distance / largest)
        for subject, distance in distances
    ]


def largest_contributions(page: Page) -> Iterator[doc.Block]:
    """Yield two tables: the errors with the largest phases, and the errors with the largest displacements."""
    by_phase, by_displacement = phase_contributions(page), displacement_contributions(page)
    phase_caption = "Quadratic phase error of each declared error, before autofocus"
    displacement_caption = "Displacement of the image by each declared error"
    tables = [
        _largest(page, contributions, name, head, caption)
        for contributions, name, head, caption in (
            (by_phase, "phase", "QPE", phase_caption),
            (by_displacement, "displacement", "Displacement", displacement_caption),
        )
        if contributions
    ]
    if tables:
        yield doc.Group("pair", tables)
    if not by_phase:
        yield doc.Paragraph("No declared error of motion, clock or another kind has a quadratic phase.")
    if not by_displacement:
        yield doc.Paragraph("No declared error displaces the image.")


def _largest(page: Page, contributions: Sequence[Contribution], name: str, head: str, caption: str) -> doc.TextTable:
    """Make the table of the largest contributions to the phase or the displacement."""
    sum_heads = doc.numbers("Share of the sum") if any(error.model_cells for error in contributions) else []
    size = doc.Head(head, "number")
    columns = doc.heads("Owner", "Kind", "Axis or term", size, "Relative to the largest", *sum_heads)
    lines: list[doc.Line] = [
        (
            error.owner,
            error.subject.kind,
            error.axis,
            error.size,
            doc.Bar(error.fraction, error.owner),
            *error.model_cells[:1],
        )
        for error in contributions[:_MAX_LARGEST_ROWS]
    ]
    count = len(contributions)
    caption += f": the {_MAX_LARGEST_ROWS} largest of {count}" if count > _MAX_LARGEST_ROWS else ""
    return doc.TextTable(f"Contributions to the {name} of {page.name}", caption, columns, lines, "contributions")


def all_contributions(page: Page) -> Iterator[doc.Block]:
    """Yield two tables: all errors with a quadratic phase, and all errors that displace the image."""
    models = ("Deciding model", "Share of the sum", "Published", "Full")
    for contributions, title, heads, caption in (
        (
            phase_contributions(page), "contributions to the phase", models,
            "Quadratic phase error of every declared error that has one, before autofocus: by the deciding model, "
            "the published and the full model",
        ),
        (
            displacement_contributions(page), "displacements", ("Displacement",),
            "Displacement of the image by every declared error",
        ),
    ):  # fmt: skip
        if contributions:
            columns = doc.heads(doc.Head("Id", "id"), *doc.numbers(*heads))
            lines: list[doc.Line] = [(doc.Name(error.id), error.size, *error.model_cells) for error in contributions]
            yield doc.TextTable(f"All {title} of {page.name}", caption, columns, lines, "contributions")


# ---------------------------------------------------------------------- requirements and sources


def verification_words(findings: MissionFindings, requirement: JudgedRequirement) -> str:
    """Text on how a run verified a requirement: by analysis, images with errors at limits, or Monte Carlo draws."""
    if requirement.is_unjudged:
        return "none"
    methods = ["analysis"]
    verdicts = [verdict.verdict for verdict in findings.verdicts or () if verdict.id in requirement.rows]
    if verdicts:
        counts = ", ".join(f"{count} {verdict}" for verdict, count in Counter(verdicts).items())
        methods.append(f"image ({counts})")
    if findings.monte_carlo is not None:
        drawn_ids = {drawn.id for drawn in findings.monte_carlo.requirements}
        if drawn_ids & {requirement.key, requirement.id, *requirement.rows}:
            methods.append("Monte Carlo")
    return ", ".join(methods)


class Declaration(NamedTuple):
    """Declared kinds of error that have the same source and the same owner.

    `owner` is a platform, both platforms, the clock or the mission. `source` is None if the file does not name a
    source. `owes_source` states whether a source is required.
    """

    owner: str
    kinds: Sequence[str]
    source: str | None
    owes_source: bool


def declared_by_owner(findings: MissionFindings) -> list[Declaration]:
    """List the declared errors by platform (or clock or mission) and source, in the order of the rows."""
    kinds: dict[tuple[str, str | None, bool], dict[str, None]] = {}
    for row in findings.rows:
        kind = row.subject.facts
        if row.declared is None or not row.is_independent or not isinstance(kind, SourceKind):
            continue
        owner = "both platforms" if kind.is_shared and row.subject.owner == "mission" else row.subject.owner
        owes_source = row.evidence is None and kind.owes_source
        words = row.subject.kind.replace("_", " ")
        kinds.setdefault((owner, row.evidence, owes_source), {})[words] = None
    declarations = [Declaration(owner, list(names), source, owes) for (owner, source, owes), names in kinds.items()]
    return sorted(declarations, key=lambda declaration: _DECLARING_OWNERS.index(declaration.owner))


_DECLARING_OWNERS = ("transmitter", "receiver", "both platforms", "clock", "mission")
