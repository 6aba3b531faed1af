"""The compliance report of a run: an index and summaries of the missions, options, signatures, and annexes."""

from collections.abc import Iterator, Sequence
from hashlib import sha256
from shlex import quote

from bisar_budget.analysis.allocation import Allocation
from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.error_kinds.path_kinds import STATE_KINDS
from bisar_budget.faults import KeyPath, changes_words
from bisar_budget.findings.mission import MissionFindings, Report, UnusableMission
from bisar_budget.findings.requirement import REQUIREMENT_NAMES
from bisar_budget.findings.row import Row
from bisar_budget.findings.status import STATUS
from bisar_budget.mission.model import Document
from bisar_budget.mission.platforms import CommonMotionError, MotionError, Platforms
from bisar_budget.mission.propagation import Propagation
from bisar_budget.mission.work_tree import WorkTree
from bisar_budget.report import Style
from bisar_budget.report import document as doc
from bisar_budget.report.answers.shared_blocks import guard_blocks
from bisar_budget.report.compliance.annex import annex
from bisar_budget.report.compliance.overview import OverviewEntry, overview
from bisar_budget.report.compliance.record import document_facts, has_record, record
from bisar_budget.report.compliance.rows import (
    Declaration,
    Page,
    declared_by_owner,
    grouped,
    largest_contributions,
    matrix_table,
    page_of,
    undeclared_table,
    verification_words,
)
from bisar_budget.report.drawing.geometry_views import geometry_elevation, geometry_plan
from bisar_budget.report.words.heading import (
    document_words,
    doubtful_model,
    head,
    multiple_of_pi,
    narrow_gradients,
    path_words,
    rule_words,
)
from bisar_budget.report.words.identity import source_path
from bisar_budget.report.words.percentiles import (
    PERCENTILE_KEYS,
    has_percentiles,
    percentile_lines,
    percentile_words,
)
from bisar_budget.report.words.requirements import (
    confidence_words,
    kind_names,
    requirement_lines,
    share_of_collections,
    shifted_names,
    unjudged_effects,
    unseen,
    verdict,
)
from bisar_budget.report.words.sentences import (
    confidence_asked,
    counted,
    dashed,
    measure,
    own_id,
    phase_limit,
    requirement_limit,
    requirement_size,
    row_size,
    sentence,
    shown_use,
    waiver_names,
)
from bisar_budget.units import format_quantity

_NOTHING_JUDGED = "Nothing was judged"
_EACH_ALONE = "; each error alone"
_WITH_CHANGES = "; with values set by options"
_MAX_DRIVER_ROWS = 3
_DISTRIBUTION_WORDS = {
    "normal": "one-sigma values",
    "uniform": "uniform within the values given",
    "bound": "values that are not exceeded",
}
_VALIDITY = {
    "published": (
        "Rigling & Moses, Tables I and II. It is of first order in the errors and holds the slant ranges constant "
        "over the aperture. It is accurate near broadside. At a squint, limits of velocity errors can be a third too "
        "large or several times too small. A row that fails by the full model is a warning."
    ),
    "full": (
        "Exact ranges, for errors of any size. Lines of sight turn over the aperture, and the displaced response has "
        "a phase of its own. A row that fails by the published model is a warning."
    ),
    "strictest": (
        "Two complete checks, by the published model (Rigling & Moses, Tables I and II) and by the full model "
        "(exact ranges). Each row has the stricter verdict."
    ),
}
_COMBINATION_SENTENCES = {
    "each": "each error alone is limited by its share of the budget",
    "sum": "the worst-case sum of a platform's errors is limited by its share",
    "rss": "the errors of a platform are independent; their root-sum-square is limited by its share",
}


def compliance(report: Report, style: Style) -> doc.AnswerDocument:
    """Make the compliance report of a run as a document.

    Raises
    ------
    ValueError
        The findings do not contain their analysis.
    """
    count = len(report.missions)
    is_brief = count > 1 and style.detail != "full"
    entries: list[OverviewEntry] = []
    missions, margins, annexes = [], [], []
    for number, mission in enumerate(report.missions, start=1):
        anchor = f"m{number}"
        if isinstance(mission, UnusableMission):
            file = name = source_path(mission.file, style)
            data, document = mission.data, Document()
            blocks: list[doc.Block] = [_faults(mission, name, anchor)]
            counts = counted(len(mission.faults), "fault")
            entries.append(OverviewEntry(name, anchor, file, "error", faults=counts))
        else:
            page = page_of(mission, style, anchor, is_brief=is_brief)
            file, name, data, document = page.file, page.name, page.mission.data, mission.document
            blocks = _brief(page) if is_brief else _summary(page)
            counts = _counts(mission)
            entries.append(OverviewEntry(name, anchor, file, mission.status, mission))
            annexes += annex(page, several=count > 1)
        digest = "" if data is None else sha256(data).hexdigest()
        facts = _facts_of_file(file, digest, document, report.work_trees.get(mission.file), counts)
        missions.append(doc.Chapter(name, [facts, *blocks], anchor, level=2, is_article=True, is_listed=count == 1))
        margins.append(doc.Margins(anchor, name, document_words(document), f"SHA-256 {digest}" if digest else file))
    subject = f"{count} missions" if count > 1 else margins[0].name
    about: list[tuple[doc.Text, doc.Text]] = [] if count > 1 else [("Mission", subject)]
    about.append(("Result", (doc.Badge(report.status), " ", _overall(report))))
    about += [("Date", report.day.isoformat())] if report.day else []
    about.append(("Tool", f"bisar-budget {report.version}"))
    sections = [overview(entries)] if count > 1 else []
    sections += [*missions, _provenance(report), _approval(report), *annexes]
    return doc.AnswerDocument(report.version, subject, doc.Facts(about), margins, sections)


# ---------------------------------------------------------------------- the run
_WAIVED = (
    ("row over its limit is", "rows over their limits are"),
    ("requirement or row that cannot be judged is", "requirements or rows that cannot be judged are"),
)


def _judged(status: str, waived: Sequence[int]) -> str:
    """Text of the verdict for a status, followed by the two numbers in `waived`, as counted by `_waived`."""
    clauses = [f"{count} {words[count > 1]} waived" for count, words in zip(waived, _WAIVED, strict=True) if count]
    return "; ".join([STATUS[status].verdict, *clauses])


def _waived(findings: MissionFindings) -> tuple[int, int]:
    """Count the waived rows above their limits, and the waived rows and requirements that cannot be judged.

    A waived requirement is counted only if none of its rows is waived.
    """
    rows = [row for row in findings.rows if row.status == "waived"]
    over = sum(not row.is_unjudged for row in rows)
    return over, len(rows) - over + sum(requirement.status == "waived" for requirement in unseen(findings))


def _overall(report: Report) -> str:
    """Text of the verdict on the run. Missions without declared errors are counted separately as not judged."""
    usable = [mission for mission in report.missions if isinstance(mission, MissionFindings)]
    count = len(report.missions)
    empty = sum(mission.is_empty and not mission.changes for mission in usable)
    if empty == count:
        return _NOTHING_JUDGED
    verdict_words = _judged(
        report.status, [sum(counts) for counts in zip(*map(_waived, usable), strict=True)] or (0, 0)
    )
    if empty:
        verdict_words = f"{verdict_words}; of {count} missions {empty} declare no error"
    if any(mission.changes for mission in usable):
        verdict_words += _WITH_CHANGES
    alone = sum(map(_judges_each_alone, usable))
    if not alone:
        return verdict_words
    return verdict_words + (_EACH_ALONE if alone == count else f"{_EACH_ALONE} in {alone} of {count} missions")


def _judges_each_alone(findings: MissionFindings) -> bool:
    """Whether each error of a mission is judged alone, so that errors are not combined."""
    return not findings.is_empty and findings.combine == "each"


def _counts(findings: MissionFindings) -> str:
    """Text that gives the number of rows of each status and names the waivers."""
    counts = ", ".join(f"{count} {STATUS[status].words}" for status, count in findings.summary.items())
    waivers = [waiver.id for waiver in findings.waived_by]
    return f"{counts}; {waiver_names(waivers)}" if waivers else counts


def _provenance(report: Report) -> doc.Chapter:
    files = "s above, each" if len(report.missions) > 1 else " above,"
    text = (
        f"By bisar-budget {report.version} from the mission file{files} identified by its SHA-256. The same input "
        "gives the same bytes. Options that affect the result:"
    )
    options: list[doc.Line] = [
        (doc.Styled("id", option.name), option.value, option.origin) for option in report.options
    ]
    columns = doc.heads("Option", "Value", "From")
    table = doc.TextTable(
        "Options of the run", "Options of this run", columns, options or [("none", "–", "–")], "options"
    )
    return doc.Chapter("How this report was made", [doc.Paragraph(text), table], "made", level=2)


def _approval(report: Report) -> doc.Chapter:
    """Return the chapter for signatures. It also lists the data-sheet spectra whose level a mission file shifts."""
    blocks: list[doc.Block] = []
    shifted = [
        (findings.name, doc.Styled("id", doc.Name(error.key)), error.level, error.off)
        for findings in report.missions
        if not isinstance(findings, UnusableMission)
        for error in findings.kinds.shifted
    ]
    if shifted:
        heads = doc.heads("Mission", "Key", "Level", "From")
        blocks.append(doc.TextTable("Figures that a level shifts", "Figures off their data sheets", heads, shifted))
    columns = doc.heads("Role", "Name", "Date", "Signature")
    lines = [(role, "", "", "") for role in ("Prepared", "Reviewed", "Approved")]
    blocks.append(doc.TextTable("", "Signatures", columns, lines, "approval"))
    return doc.Chapter("Approval", blocks, "approval", level=2)


# ---------------------------------------------------------------------- one mission
def _facts_of_file(
    file: str, digest: str, document: Document, work_tree: WorkTree | None, counts: doc.Text
) -> doc.Facts:
    pairs: list[tuple[doc.Text, doc.Text]] = [
        *document_facts(document, work_tree),
        ("File", doc.Styled("id", doc.Name(file))),
        ("SHA-256", doc.Styled("digest", digest or "not read")),
        ("Rows", counts),
    ]
    return doc.Facts(pairs)


def _faults(mission: UnusableMission, name: str, anchor: str) -> doc.Chapter:
    """Return the chapter with the faults of an unusable file."""
    verdict_words = f"{STATUS['error'].verdict}: the mission file is not usable."
    lines = [(f"{fault.line or '–'}:{fault.column or '–'}", str(fault)) for fault in mission.faults]
    columns = doc.heads("Line:column", "Fault")
    table = doc.TextTable(f"Faults of {name}", "Faults of the mission file", columns, lines)
    return doc.Chapter(
        "Verdict", [doc.Paragraph(verdict_words, "verdict error"), table], f"{anchor}-verdict", is_listed=False
    )


def _summary(page: Page) -> list[doc.Block]:
    return [
        doc.Chapter("Verdict", list(_verdict(page)), f"{page.anchor}-verdict"),
        doc.Chapter("Compliance matrix", list(_matrix(page)), f"{page.anchor}-matrix"),
        doc.Chapter(
            "Contributions to phase and displacement",
            list(largest_contributions(page)),
            f"{page.anchor}-contributions",
            short="Contributions",
        ),
        doc.Chapter("Geometry", list(_geometry(page)), f"{page.anchor}-geometry"),
        doc.Chapter("Allocation", list(_allocation(page)), f"{page.anchor}-allocation", style="allocation"),
        doc.Chapter("Assumptions and validity", list(_validity(page)), f"{page.anchor}-validity"),
        record(page),
    ]


def _brief(page: Page) -> list[doc.Block]:
    """Return the blocks about one of several missions: verdict, worst rows, geometry in words, inputs."""
    command = f"bisar-budget check {quote(page.file)} --report report.html"
    more = ("Contributions, drawings, allocation and assumptions: ", doc.Code(command), ".")
    return [
        doc.Chapter("Verdict", list(_verdict(page)), f"{page.anchor}-verdict", is_listed=False),
        doc.Chapter("Compliance matrix", list(_matrix(page)), f"{page.anchor}-matrix", is_listed=False),
        doc.Chapter("Geometry", [_geometry_facts(page)], f"{page.anchor}-geometry", is_listed=False),
        *([record(page)] if has_record(page) else []),
        doc.Paragraph(more, "more"),
    ]


def _verdict(page: Page) -> Iterator[doc.Block]:
    findings, waived = page.findings, _waived(page.findings)
    verdict_words = _NOTHING_JUDGED if findings.is_empty else _judged(findings.status, waived)
    verdict_words += f";{confidence}" if (confidence := confidence_words(findings)) else ""
    verdict_words += (_WITH_CHANGES if findings.changes else "") + (
        _EACH_ALONE if _judges_each_alone(findings) else ""
    )
    yield doc.Paragraph(verdict_words, f"verdict {findings.status}")
    if doubt := doubtful_model(findings):
        yield doc.Paragraph(doubt)
    yield doc.Paragraph(f"{sentence(verdict(findings))}. {sentence(rule_words(findings))}.")
    yield _requirements(page)
    yield from guard_blocks(findings.guard)
    yield from [] if page.is_brief else _how_sure(page)
    facts: list[tuple[doc.Text, doc.Text]] = [
        ("Not judged", f"{effect.text} ({', '.join(row.id for row in effect.rows)})")
        for effect in unjudged_effects(findings)
    ]
    facts.append(("Declared", f"{len(findings.kinds.declared)} of {findings.kinds.in_all} kinds of error"))
    if findings.kinds.missing:
        facts.append(("Not declared", ", ".join(kind_names(findings.kinds.missing))))
    if findings.kinds.shifted:
        facts.append(("Off the data sheet", ", ".join(shifted_names(findings.kinds))))
    facts += [
        ("" if index else "Overrides", f"{override.name} {override.value} ({override.origin})")
        for index, override in enumerate(findings.overrides)
    ]
    yield doc.Facts(facts, "facts wide")
    yield from _declarations(page)
    if narrow := narrow_gradients(findings.geometry):
        yield doc.Paragraph(narrow)
    if drivers := list(_drivers(page)):
        subject = "Rows that decide" if len(drivers) > 1 else "Row that decides"
        yield doc.Paragraph(f"{subject} the verdict (QPE: quadratic phase error at the aperture edge):")
        yield doc.Items([_driver(row, findings) for row in drivers], "drivers", is_numbered=True)


def _requirements(page: Page) -> doc.TextTable:
    """Make the table of requirements, with a column for project ids if the file states any."""
    lines: list[doc.Line] = []
    has_ids = any(requirement.requirement_ids for requirement in page.findings.requirements)
    for line in requirement_lines(page.findings):
        decided: doc.Text = dashed(line.decided_by)
        if line.decided_by == line.requirement.row:
            decided = doc.Styled("id", doc.Name(line.decided_by))
        name: list[doc.Text] = [sentence(line.name) + (" (default)" if line.requirement.is_default else "")]
        name += [doc.Styled("own-text", text) for text in line.texts]
        lines.append(
            (
                *([doc.listed(line.requirement.requirement_ids) or "–"] if has_ids else []),
                tuple(name),
                dashed(line.allowed),
                dashed(line.reached),
                (dashed(line.use), doc.Use(None if line.use == "-" else line.requirement.utilization, line.status)),
                doc.Badge(line.status),
                verification_words(page.findings, line.requirement),
                (decided, ", " if line.decided_by and line.remark else "", line.remark),
            )
        )
    ids = [doc.Head("Id", "id")] if has_ids else []
    sizes = doc.numbers("Limit", "Reached", "Use")
    columns = doc.heads(*ids, "Requirement", *sizes, "Status", "Verification", "Decided by")
    caption = "Requirements and their verdicts"
    return doc.TextTable(f"Requirements of {page.name}", caption, columns, lines, "requirements")


def _how_sure(page: Page) -> Iterator[doc.Block]:
    """Yield the table of percentiles, with the confidence of each limit and the share of collections that keep it."""
    lines: list[doc.Line] = []
    for line in percentile_lines(page.findings):
        requirement = line.requirement
        limit = (
            (
                dashed(requirement_limit(requirement.value, requirement)),
                confidence_asked(requirement) or "–",
                "–" if requirement.probability is None else share_of_collections(requirement.probability),
            )
            if line.is_limited
            else ("", "", "")
        )
        lines.append((sentence(line.name.strip()), *line.sizes, *limit))
    if lines:
        sizes = (*(f"{name} %" for name in PERCENTILE_KEYS), "Limit", "Confidence asked", "Collections within it")
        words = percentile_words(page.findings).removesuffix(".")
        caption = f"How sure: {words[:1].lower()}{words[1:]}"
        columns = doc.heads("Quantity", *doc.numbers(*sizes))
        yield doc.TextTable(f"Percentiles of {page.name}", caption, columns, lines, "percentiles")


def _declarations(page: Page) -> Iterator[doc.Block]:
    """Yield the table of the errors that are declared for each platform, with their sources."""
    declarations = declared_by_owner(page.findings)
    if not declarations:
        return
    lines = [(declaration.owner, ", ".join(declaration.kinds), _source(declaration)) for declaration in declarations]
    columns = doc.heads("Platform", "Declared errors", "Source")
    caption = "Declared errors and their sources"
    yield doc.TextTable(f"Sources of {page.name}", caption, columns, lines, "sources")


def _source(declaration: Declaration) -> doc.Text:
    if declaration.source is not None:
        return declaration.source
    return doc.Styled("missing", "no source stated") if declaration.owes_source else "the mission file"


def _drivers(page: Page) -> Iterator[Row]:
    """Yield the rows that decide the verdict.

    These are the rows that fail, warn, cannot be judged or are waived. If all limits are met, they are the rows with
    the largest utilization. In a brief report, the rows with the largest utilization appear only in the compliance
    matrix.
    """
    is_met = STATUS[page.findings.status].is_met and not page.is_brief
    for row in page.judged[:_MAX_DRIVER_ROWS]:
        if not STATUS[row.status].is_met or (is_met and row.utilization):
            yield row


def _driver(row: Row, findings: MissionFindings) -> tuple[doc.Text, doc.Text]:
    text = f"{sentence(measure(row, findings))}."
    text += f" {sentence('; '.join(row.decisive))}." if row.decisive else ""
    bar = doc.Use(shown_use(row), row.status)
    return (doc.Styled("id", doc.Name(row.id)), own_id(row), " ", doc.Badge(row.status), " ", bar), text


def _matrix(page: Page) -> Iterator[doc.Block]:
    if not page.matrix:
        yield undeclared_table(page)
        return
    caption = (
        "Declared errors and rows with a limit, worst first. Utilization is declared over allowable, for levels in "
        "dB the ratio of amplitudes; the mark on its bar is the allowable. A margin of × 12: the allowable is twelve "
        "times the declared value. The requirement is the one that sets the allowable."
    )
    caption += " The annex has the formulas of each row." if page.is_full else ""
    caption = "Declared errors and rows with a limit, worst first" if page.is_brief else caption
    shown = [row for row in page.matrix if row.id in page.in_summary]
    yield matrix_table(page, shown, f"Compliance matrix of {page.name}", caption)
    hidden = len(page.hidden)
    counts = [f"{hidden} rows that pass or have no effect" if hidden > 1 else "1 row that passes or has no effect"]
    counts = (counts if hidden else []) + ([f"{len(page.undeclared)} not declared"] if page.undeclared else [])
    if counts:
        annex_words: doc.Text = " (in the annex)" if page.is_full else (" (", doc.Code("--detail full"), " has them)")
        yield doc.Paragraph((f"Not shown: {', '.join(counts)}", annex_words, "."), "more")
    driving = {row.id for row in _drivers(page)}
    reasons = grouped(
        (row.id, row.decisive) for row in page.judged if STATUS[row.status].is_explained and row.id not in driving
    )
    if reasons:
        yield reasons


def _geometry_facts(page: Page) -> doc.Facts:
    left_out = ("Budget", "Model") if page.is_brief else ()
    pairs = [(name, sentence(text)) for name, text in head(page.findings) if name not in left_out]
    return doc.Facts(pairs, "facts wide")


def _geometry(page: Page) -> Iterator[doc.Block]:
    yield _geometry_facts(page)
    figures = []
    for name, title, svg in (
        ("plan", "Plan: the collection from above", geometry_plan(page.findings)),
        ("elevation", "Elevation: the collection from the side", geometry_elevation(page.findings)),
    ):
        label = f"{title} of {page.name}"
        figures.append(doc.Figure(f"{page.number}-{name}.svg", page.anchor, title, label, svg, is_told=False))
    yield doc.Group("figures", figures)


def _allocation(page: Page) -> Iterator[doc.Block]:
    """Yield the paragraphs and tables about the shares of the quadratic phase error and of the power budget."""
    findings, allocation = page.findings, page.findings.allocation
    total, gain = allocation.qpe_total, allocation.autofocus_gain
    yield doc.Paragraph(
        f"Total quadratic phase error allowed at the aperture edge: {phase_limit(total, findings)}; "
        f"{_gain(allocation)}."
    )
    shares = [
        (owner, getattr(allocation.qpe, owner) or 0.0) for owner in ("transmitter", "receiver", "clock", "reserve")
    ]
    bars = (("Before autofocus", 1.0), ("With autofocus", gain)) if gain > 1 else (("Budget", 1.0),)
    for label, factor in bars:
        segments = [
            (owner, share * factor / gain, phase_limit(share * total * factor, findings))
            for owner, share in shares
            if share
        ]
        yield doc.Stack(label, segments)
    lines: list[doc.Line] = []
    for owner, share in shares:
        if share or owner == "clock":
            limit = share * total if share else allocation.qpe_limit(owner)
            name: doc.Text = (doc.Swatch(owner, share), owner) if share else owner
            share_words = f"{share:.3g}" if share else "limited by the receiver’s"
            lines.append((name, share_words, phase_limit(limit, findings), phase_limit(limit * gain, findings)))
    columns = doc.heads("Owner", *doc.numbers("Share", "Before autofocus", "With autofocus"))
    yield doc.TextTable(f"Allocation of {page.name}", "Shares of the quadratic phase error", columns, lines)
    yield from _power_shares(page)


def _power_shares(page: Page) -> Iterator[doc.TextTable]:
    """Yield the table with the power that vibration and noise may add, divided into shares of the platforms.

    The clock has a column only if it has a share.
    """
    required, allocation = page.mission.requirements, page.findings.allocation
    rows = [
        (name, value, split)
        for name, value, split in (
            ("PSLR", required.pslr, allocation.pslr),
            ("ISLR", required.islr, allocation.islr),
        )
        if value is not None
    ]
    has_clock = any(split.clock is not None for _, _, split in rows)
    heads = ("Requirement", "Transmitter", "Receiver", *(["Clock"] if has_clock else []))
    lines = []
    for name, value, split in rows:
        clock = "–" if split.clock is None else f"{split.clock:.3g}"
        shares = (f"{split.transmitter:.3g}", f"{split.receiver:.3g}", *([clock] if has_clock else []))
        lines.append((name, f"{value:g} dB", *shares))
    if lines:
        caption = "Shares of the power that vibration and noise may add; autofocus does not change them"
        columns = doc.heads("Metric", *doc.numbers(*heads))
        yield doc.TextTable(f"Shares of the power of {page.name}", caption, columns, lines)


def _gain(allocation: Allocation) -> str:
    if allocation.n_pull is None:
        return "no autofocus is declared"
    gain = f"limits of the quadratic phase × {allocation.autofocus_gain:.3g}"
    return f"autofocus corrects {multiple_of_pi(allocation.n_pull)} rad: {gain}"


def _validity(page: Page) -> Iterator[doc.Block]:
    findings, file = page.findings, page.file
    assumptions = [(name, sentence(text) + ("" if text.endswith(".") else ".")) for name, text in _assumptions(page)]
    yield doc.Facts(assumptions, "facts wide")
    warnings: list[doc.Text] = []
    for warning in findings.warnings:
        location = file if warning.line is None else f"{file}:{warning.line}"
        warnings.append(("Warning, ", doc.Styled("id", doc.Name(location)), f": {warning.message}."))
    remarks = [*warnings, *(f"{sentence(note)}." for note in findings.notes)]
    if remarks:
        yield doc.Items([[remark] for remark in remarks])
    inputs = [
        (name, (value, " ", doc.Styled("origin", doc.Name(origin.replace(f"{file}:", "line ")))))
        for name, value, origin in _inputs(page)
    ]
    yield doc.Facts(inputs, "inputs")


def _assumptions(page: Page) -> Iterator[tuple[str, str]]:
    """Yield the names and texts of the assumptions behind the verdict, including the range of validity."""
    mission, findings = page.mission, page.findings
    if findings.changes:
        yield "Mission", f"the mission of the file, changed by {changes_words(findings.changes)}"
    yield "Model", _VALIDITY[findings.model]
    if mission.has_direct_path:
        yield (
            "Direct path",
            "the receiver uses the direct signal of the transmitter as its clock: ranges are less the distance "
            "between the platforms, and timing errors have no effect. The published model ignores the direct path, "
            "so a row that fails only by it is no warning",
        )
    for name, path in findings.paths:
        yield f"Path of the {name}", path_words(path)
    yield "Combination", _COMBINATION_SENTENCES[findings.combine]
    yield "Phases", f"at the centre frequency, c = {SPEED_OF_LIGHT_MPS / 1e3:.3f} km/s; at the aperture edge, ±T/2"
    factor = (
        f"{findings.coverage_factor:g} times the file’s value"
        if findings.coverage_factor != 1
        else "the file’s value"
    )
    yield "Declared", f"for position, velocity, acceleration and clock {factor}"
    if has_percentiles(findings):
        yield "Confidence", _confidence_words(findings)
    if biases := [f"{row.id} {row_size(row.bias, row, findings)}" for row in findings.rows if row.bias is not None]:
        yield "Biases", f"known and constant, with their sign: {', '.join(biases)}"
    for name in ("transmitter", "receiver"):
        error = getattr(mission.platforms, name).motion_error
        if any(error.stated(kind.name) for kind in STATE_KINDS):
            text = _distribution_words(error)
            text += ", position and velocity by their covariance" if error.covariance is not None else ""
            yield f"Errors of the {name}", f"along the axes of the frame “{error.frame}”; {text}"
    common = mission.common_motion_error
    if common is not None:
        text = _distribution_words(common)
        frame = (
            "along the axes of the scene"
            if common.frame == "scene"
            else f"the same along the axes of each platform’s own frame “{common.frame}”"
        )
        yield "Errors of both platforms", f"{frame}; {text}"
    yield (
        "Autofocus",
        _gain(findings.allocation)
        + ("" if findings.allocation.n_pull is None else f" ({mission.autofocus.algorithm})"),
    )
    yield (
        "Sidelobes",
        "PSLR and ISLR bound what vibration and noise add along the line of sight, not the sidelobes of the window",
    )
    if any(platform.motion_error.imu or platform.motion_error.random for platform in mission.platforms):
        yield (
            "Sensors",
            "one sigma, axes independent. Errors of inertial sensors grow from mid-aperture, where position and "
            "velocity errors are as declared. Attitude errors and gyros turn the specific force, scale factor errors "
            "add a fraction of it",
        )
    if any(platform.motion_error.navigation for platform in mission.platforms):
        yield (
            "Aided navigation",
            "joint covariance of the position error over the aperture, in level axes without the rotation of the "
            "Earth. The flight begins with errors of 10 m, 1 m/s, 1° of roll and pitch, and the stated heading. "
            "Biases begin at their figure, and walk by √2 of it in 600 s. Beyond the aperture a platform without a "
            "log flies straight on",
        )
    if any(platform.motion_error.lever_arm for platform in mission.platforms):
        yield (
            "Lever arms",
            "components along, cross and up of the velocity, turning with it; for a fixed platform along the axes of "
            "the scene. Attitude errors swing the arm and turn the specific force: the row of the inertial sensor "
            "includes both",
        )
    if any(source.is_time_tag for source in page.analysis.sources):
        yield "Time tags", "measured positions belong to times later by the error"
    if any(platform.oscillator for platform in mission.platforms) or mission.synchronization:
        yield (
            "Clocks",
            "phase spectra are one-sided and count up to the end of the mask or the bandwidth of the oscillator, "
            "1 kHz if neither is stated. The level of an oscillator is its noise relative to the declared noise",
        )
    if mission.propagation is not None:
        yield (
            "Delays in the air",
            "one sigma of the residual after correction, at the zenith of the scene, "
            f"{_air_of(mission.propagation)}. Below a platform height of 80 km the Earth is flat for the leg and "
            "there are no free electrons; above, the leg crosses spherical shells at 7 km and 350 km",
        )
    for row in findings.rows:
        if row.navigation is not None:
            yield f"Navigation of the {row.owner}", "; ".join(row.remarks)
        if row.subject.facts.moves == "clock" and row.owner in Platforms._fields and row.remarks:
            shaken = " under acceleration" if row.subject.axis == "acceleration" else ""
            yield f"Oscillator of the {row.owner}{shaken}", "; ".join(row.remarks)


_QUANTILE_WORDS = {
    "each": "every error alone at its quantile",
    "sum": "the sum of the quantiles of all errors",
    "rss": "the quantile of all errors together, and of those of a platform",
}


def _confidence_words(findings: MissionFindings) -> str:
    """Text on the meaning of a confidence, and on the distributions of the errors."""
    text = (
        "the probability that the effect of all declared errors, drawn together, keeps a limit. Each error has its "
        "declared distribution, and a bound is at either end; clocks, sensors, covariances and delays of the air are "
        "normal; biases are constant. PSLR and ISLR are expectations. Percentiles are of all errors together, "
        "whatever the combination"
    )
    if any(requirement.confidence is not None for requirement in findings.requirements):
        text += f". A requirement with a confidence judges {_QUANTILE_WORDS[findings.combine]}"
    return text


def _air_of(propagation: Propagation) -> str:
    """Text about the atmospheric delays: whether they are the same for both platforms, and how fast they change."""
    legs = {name: propagation.leg(name) for name in Platforms._fields}
    times = {name: leg.correlation_time for name, leg in legs.items() if leg is not None}
    change_words = {
        name: "constant within the aperture"
        if time is None
        else f"with a correlation time of {format_quantity(time, 's')}"
        for name, time in times.items()
    }
    air = "one air over both legs" if propagation.is_one_air else "legs independent"
    if len({*change_words.values()}) == 1:
        return f"{air}, {next(iter(change_words.values()))}"
    return f"{air}: {', '.join(f'{name} {words}' for name, words in change_words.items())}"


def _inputs(page: Page) -> Iterator[tuple[str, str, str]]:
    """Yield the name, value and origin of each input that determines the findings.

    The origin is a line of the file, `default` or `--set`.
    """
    mission, findings, file = page.mission, page.findings, page.file

    def value_from(name: str, value: str, path: KeyPath) -> tuple[str, str, str]:
        if mission.is_changed(path):
            return name, value, "--set"
        is_in_file = path in mission.places
        return name, value, f"{file}:{mission.line(path)}" if is_in_file else "default"

    requirements = mission.requirements
    yield value_from(
        "centre frequency", format_quantity(mission.radar.center_frequency, "Hz", 6), ("radar", "center_frequency")
    )
    yield value_from("bandwidth", format_quantity(mission.radar.bandwidth, "Hz", 6), ("radar", "bandwidth"))
    yield value_from(
        "aperture time", format_quantity(mission.collection.aperture_time, "s", 6), ("collection", "aperture_time")
    )
    judged = {requirement.key: requirement for requirement in findings.requirements}
    for key, name in REQUIREMENT_NAMES.items():
        if key == "declare":
            continue
        if key not in judged:
            yield name, "none: computed, not judged", "not in the file"
            continue
        value = requirement_size(judged[key].value, judged[key], "down")
        if key == "quadratic_phase_error":
            value += f" ({requirements.quadratic_phase_error:.4g} rad)"
        confidence = confidence_asked(judged[key])
        value += f" with {confidence} confidence" if confidence else ""
        yield value_from(name, value, ("requirements", key))
    allocation = mission.allocation
    split = allocation.split
    yield value_from("split", split if isinstance(split, str) else "shares of the file", ("allocation", "split"))
    yield value_from("combination", allocation.combine, ("allocation", "combine"))
    yield value_from("model", allocation.model, ("allocation", "model"))
    if mission.has_direct_path:
        yield value_from("clock", "the direct path; the full model decides", ("synchronization", "method"))
    yield value_from("coverage factor", f"{allocation.coverage_factor:g}", ("allocation", "coverage_factor"))
    yield value_from("warning above", f"{100 * allocation.warn_above:g} % of a limit", ("allocation", "warn_above"))


def _distribution_words(error: MotionError | CommonMotionError) -> str:
    """Distribution of a motion error in words; one for each kind of error where they differ."""
    words = {kind.name: _DISTRIBUTION_WORDS[error.distribution_of(kind.name)] for kind in STATE_KINDS}
    if len(set(words.values())) == 1:
        return words["position"]
    return "; ".join(f"{kind}: {text}" for kind, text in words.items())
