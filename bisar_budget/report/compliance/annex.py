"""The annex of a compliance report: a sweep, images, draws that somebody asked for; with `--detail full` all rows."""

from collections.abc import Iterator

from bisar_budget.catalogue import EQUATIONS
from bisar_budget.effects.effect import MOTION_UNITS
from bisar_budget.findings.images import ImageEvidence, PointImage
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.monte_carlo import MonteCarlo
from bisar_budget.report.compliance import document as doc
from bisar_budget.report.compliance.contributions import all_contributions
from bisar_budget.report.compliance.matrix import (
    Page,
    all_remarks,
    grouped,
    limit_words,
    matrix_table,
    undeclared_table,
)
from bisar_budget.report.compliance.trade_study import studied
from bisar_budget.report.drawing.evidence_drawings import (
    chip_caption,
    chip_png,
    chip_size,
    impulse_response_cuts,
    numbers_in_words,
)
from bisar_budget.report.explain.explanation import chain, collection_chain
from bisar_budget.report.formats import verification
from bisar_budget.report.words.requirements import held
from bisar_budget.report.words.sentences import sentence
from bisar_budget.units import format_quantity

_SOURCED = (*MOTION_UNITS, "vibration", "other", "imu", "random", "oscillator", "synchronization")


def annex(page: Page, *, several: bool) -> list[doc.Section]:
    """The annex of a mission; none where there is nothing beyond the summary."""
    found = page.found
    sections = [] if found.study is None else [studied(page, found.study)]
    if found.verdicts is not None:
        sections.append(doc.Section("Image evidence", list(_evidence(page)), f"{page.anchor}-evidence"))
    if found.monte_carlo is not None:
        sections.append(doc.Section("Monte Carlo", list(_draws(page, found.monte_carlo)), f"{page.anchor}-draws"))
    if page.is_full:
        title = "Formulas, with the numbers put in"
        sections += [
            doc.Section("Rows in full", list(_rows(page)), f"{page.anchor}-rows"),
            doc.Section("Sources", list(_sources(page)), f"{page.anchor}-sources"),
            doc.Section(title, list(_formulas(page)), f"{page.anchor}-formulas", short="Formulas"),
        ]
    title = f"Annex: {page.name}" if several else "Annex"
    whole = doc.Section(title, sections, f"{page.anchor}-annex", level=2, style="annex", is_article=True)
    return [whole] if sections else []


# ---------------------------------------------------------------------- images
def _evidence(page: Page) -> Iterator[doc.Block]:
    """What images show of the limits, beside what was predicted."""
    verdicts = page.found.verdicts or ()
    yield doc.Paragraph(
        "Each error was set to its limit in data simulated from exact ranges, and the phase was measured in the "
        "image."
    )
    yield doc.Table(
        f"Image evidence of {page.name}",
        "At the limit: what the budget promises, what Table II, the full model and exact ranges predict, what the "
        "image shows. Phases in rad.",
        _columns("Limit", "Budget", "Table II", "Full model", "Exact ranges", "Image"),
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
        yield doc.Table(
            f"Refocused images of {page.name}",
            "At the limit with autofocus, refocused",
            _columns("Limit", "Budget", "Residual", "Peak loss"),
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


def _columns(*heads: str) -> list[doc.Column]:
    return doc.columns(doc.Column("Id", "id"), *doc.numbers(*heads), "Verdict")


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
        doc.Chip(
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
    return doc.Group("illustration", [words, doc.Group("images", [doc.Chips(chips), cuts])], heading)


def _on_page(image: PointImage) -> tuple[int, int]:
    """Width and height on a page, at most 240 px each. [px]"""
    width, height = chip_size(image)
    shrink = max(1.0, width / 240, height / 240)
    return max(1, round(width / shrink)), max(1, round(height / shrink))


# ---------------------------------------------------------------------- draws
def _draws(page: Page, drawn: MonteCarlo) -> Iterator[doc.Block]:
    """How often each requirement holds."""
    lines: list[doc.Line] = []
    for one in drawn.requirements:
        sizes = ("–" if size is None else format_quantity(size, one.unit) for size in (one.sum, one.rss, one.sigma))
        in_draws = held(one.probability, one.probability_low, one.probability_high)
        lines.append((doc.Name(one.id), limit_words(one.limit, one.unit), *sizes, in_draws))
    if drawn.probability is not None and len(drawn.requirements) > 1:
        ends = (drawn.probability_low or 0.0, drawn.probability_high or 1.0)
        lines.append((doc.Name("all at once"), *("–",) * 4, held(drawn.probability, *ends)))
    if lines:
        yield doc.Table(
            f"Monte Carlo of {page.name}",
            f"How often each requirement holds: {drawn.draws:,} draws, seed {drawn.seed}, {drawn.model} model; "
            f"intervals of {100 * drawn.confidence:.0f} %. Beside it what needs no draws: worst-case sum, "
            "root-sum-square, standard deviation.",
            doc.columns(
                doc.Column("Requirement", "id"), *doc.numbers("Limit", "Sum", "Rss", "Sigma"), "Over the draws"
            ),
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
    """What a summary leaves out of the matrix and of the contributions."""
    if page.hidden:
        yield matrix_table(page, page.hidden, f"Other rows of {page.name}", "Rows that are not in the summary")
    if page.undeclared and page.matrix:
        yield undeclared_table(page)
    if remarks := grouped(all_remarks(page)):
        yield doc.Section("Remarks", [remarks], level=4)
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
    yield doc.Section("The collection", [collection], level=4)
    for number, row in enumerate(page.matrix, start=1):
        title = (doc.Styled("id", doc.Name(row.id)), " ", doc.Badge(row.status))
        derivation = doc.Steps(f"Formulas of {row.id}, {page.name}", list(chain(placed, found, row)))
        yield doc.Section(title, [derivation], f"{page.anchor}-row-{number}", level=4, style="derivation")
    general = [
        (f"{number or 'Full model'}, {title[:1].lower()}{title[1:]}", doc.Equality(left, right))
        for number, title, left, right in EQUATIONS
        if number not in ("(11)", "(31)") and (page.mission.has_direct_path or not title.startswith("Direct path"))
    ]
    yield doc.Section("In general", [doc.Steps(f"General formulas, {page.name}", general)], level=4)
