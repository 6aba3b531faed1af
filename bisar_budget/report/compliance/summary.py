"""The compliance report of a run: an index of missions, a summary of each, options, signatures, and the annexes."""

from collections.abc import Iterator, Sequence
from hashlib import sha256

from bisar_budget.analysis.allocation import Allocation
from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.effects.effect import MOTION_UNITS
from bisar_budget.faults import KeyPath, changes_words
from bisar_budget.findings.mission import MissionFindings, Report, UnusableMission
from bisar_budget.findings.requirement import NAMES
from bisar_budget.findings.row import Row
from bisar_budget.findings.status import STATUS
from bisar_budget.mission.model import Document
from bisar_budget.mission.platforms import Platforms
from bisar_budget.mission.propagation import Propagation
from bisar_budget.report import Style
from bisar_budget.report.compliance import document as doc
from bisar_budget.report.compliance.annex import annex, sources
from bisar_budget.report.compliance.rows import (
    Page,
    grouped,
    largest_contributions,
    matrix_table,
    page_of,
    undeclared_table,
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
from bisar_budget.report.words.requirements import (
    confidence_words,
    kind_names,
    requirement_id,
    requirement_lines,
    shifted_names,
    unjudged_effects,
    unseen,
    verdict,
)
from bisar_budget.report.words.sentences import (
    counted,
    dashed,
    measure,
    own_id,
    phase_limit,
    requirement_size,
    sentence,
    shown_use,
    use_words,
    waiver_names,
)
from bisar_budget.units import format_quantity

_NOTHING = "Nothing was judged"
_ALONE = "; each error alone"
_CHANGED = "; with values set by options"
_DRIVERS = 3
_DISTRIBUTIONS = {
    "normal": "one-sigma values",
    "uniform": "uniform within the values given",
    "bound": "values that are not exceeded",
}
_VALIDITY = {
    "published": (
        "Rigling & Moses, Tables I and II. It is of first order in the errors and holds the slant ranges constant "
        "over the aperture. It is accurate near broadside. At a squint, a look off broadside, limits of velocity "
        "errors can be a third too generous or several times too strict. A row that fails by the full model is a "
        "warning."
    ),
    "full": (
        "Exact ranges, for errors of any size. Lines of sight turn over the aperture, and the displaced response has "
        "a phase of its own. A row that the published model fails is a warning."
    ),
    "strictest": (
        "Two complete checks, by the published model (Rigling & Moses, Tables I and II) and by the full model "
        "(exact ranges). Each row is that of the stricter verdict."
    ),
}
_RULES = {
    "each": "each error alone is held to its share of the budget",
    "sum": "the worst-case sum of a platform's errors is held to its share",
    "rss": "the errors of a platform are taken as independent; their root-sum-square is held to its share",
}


def compliance(report: Report, style: Style) -> doc.Compliance:
    """Arrange the findings of a run for a report that people read.

    Raises
    ------
    ValueError
        Findings that do not carry their analysis.
    """
    count = len(report.missions)
    index: list[doc.Line] = []
    missions, margins, annexes = [], [], []
    for number, mission in enumerate(report.missions, start=1):
        anchor = f"m{number}"
        if isinstance(mission, UnusableMission):
            file = name = source_path(mission.file, style)
            data, document = mission.data, Document()
            blocks: list[doc.Block] = [_faults(mission, name, anchor)]
            faults = counted(len(mission.faults), "fault")
            index.append((doc.Name(name, anchor), doc.Name(file), doc.Badge("error"), "–", "–", faults))
        else:
            page = page_of(mission, style, anchor)
            file, name, data, document = page.file, page.name, page.mission.data, mission.document
            blocks = _summary(page)
            index.append(_index_line(page))
            annexes += annex(page, several=count > 1)
        digest = "" if data is None else sha256(data).hexdigest()
        facts = _facts_of_file(file, digest, document, index[-1][-1])
        missions.append(doc.Chapter(name, [facts, *blocks], anchor, level=2, is_article=True, is_listed=count == 1))
        margins.append(doc.Margins(anchor, name, document_words(document), f"SHA-256 {digest}" if digest else file))
    subject = f"{count} missions" if count > 1 else margins[0].name
    about: list[tuple[doc.Text, doc.Text]] = [] if count > 1 else [("Mission", subject)]
    about.append(("Result", (doc.Badge(report.status), " ", _overall(report))))
    about += [("Date", report.day.isoformat())] if report.day else []
    about.append(("Tool", f"bisar-budget {report.version}"))
    sections = [_index(index)] if count > 1 else []
    sections += [*missions, _made(report), _approval(report), *annexes]
    return doc.Compliance(report.version, subject, doc.Facts(about), margins, sections)


# ---------------------------------------------------------------------- the run
_WAIVED = (
    ("row over its limit is", "rows over their limits are"),
    ("requirement or row that cannot be judged is", "requirements or rows that cannot be judged are"),
)


def _judged(status: str, waived: Sequence[int]) -> str:
    """Verdict on rows and requirements, with what it owes to waivers."""
    said = [f"{count} {words[count > 1]} waived" for count, words in zip(waived, _WAIVED, strict=True) if count]
    return "; ".join([STATUS[status].verdict, *said])


def _waived(found: MissionFindings) -> tuple[int, int]:
    """Number of rows that are waived, and of requirements that are and have no such row: over a limit, not judged."""
    rows = [row for row in found.rows if row.status == "waived"]
    over = sum((row.utilization or 0.0) > 1 for row in rows)
    return over, len(rows) - over + sum(one.status == "waived" for one in unseen(found))


def _overall(report: Report) -> str:
    """Verdict on the run: a mission that declares nothing complies with nothing."""
    usable = [mission for mission in report.missions if isinstance(mission, MissionFindings)]
    count = len(report.missions)
    empty = sum(mission.is_empty and not mission.changes for mission in usable)
    if empty == count:
        return _NOTHING
    said = _judged(report.status, [sum(counts) for counts in zip(*map(_waived, usable), strict=True)] or (0, 0))
    if empty:
        said = f"{said}; of {count} missions {empty} declare no error"
    if any(mission.changes for mission in usable):
        said += _CHANGED
    alone = sum(map(_is_alone, usable))
    if not alone:
        return said
    return said + (_ALONE if alone == count else f"{_ALONE} in {alone} of {count} missions")


def _is_alone(found: MissionFindings) -> bool:
    """Whether errors are judged one by one."""
    return not found.is_empty and found.combine == "each"


def _index(lines: Sequence[doc.Line]) -> doc.Chapter:
    file, worst = doc.Head("File", "id"), doc.Head("Worst row", "id")
    columns = doc.heads("Mission", file, "Status", worst, *doc.numbers("Use"), "Rows")
    caption = (
        f"{len(lines)} missions, in the order given. Use is declared over allowable. A name leads to its report."
    )
    table = doc.TextTable("Index of the missions", caption, columns, lines, "index")
    return doc.Chapter("Index", [table], "summary", level=2)


def _index_line(page: Page) -> doc.Line:
    """Name of a mission and of what decides it: its worst row, or a requirement that is worse than any row."""
    found, judged = page.found, page.judged
    decides = [requirement_id(one) for one in found.requirements if one.status == found.status]
    worst = judged[0].id if judged else ""
    if decides and not (judged and judged[0].status == found.status):
        worst = decides[0]
    use = shown_use(judged[0]) if judged and worst == judged[0].id else None
    counts = ", ".join(f"{count} {STATUS[status].words}" for status, count in found.summary.items())
    counts += f"; {waiver_names([one.id for one in found.waived_by])}" if found.waived_by else ""
    name, decided = doc.Name(page.name, page.anchor), doc.Name(worst) if worst else "–"
    return name, doc.Name(page.file), doc.Badge(found.status), decided, dashed(use_words(use)), counts


def _made(report: Report) -> doc.Chapter:
    which = "s above, each" if len(report.missions) > 1 else " above,"
    said = (
        f"By bisar-budget {report.version} from the mission file{which} known by the SHA-256 of its bytes. The same "
        "input gives the same bytes. Options that bear on the result:"
    )
    options: list[doc.Line] = [
        (doc.Styled("id", option.name), option.value, option.origin) for option in report.options
    ]
    columns = doc.heads("Option", "Value", "From")
    table = doc.TextTable("Options of the run", "Options of this run", columns, options or [("none", "–", "–")])
    return doc.Chapter("How this report was made", [doc.Paragraph(said), table], "made", level=2)


def _approval(report: Report) -> doc.Chapter:
    """The table of signatures; above it what is signed although it is not what its source states."""
    blocks: list[doc.Block] = []
    shifted = [
        (found.name, doc.Styled("id", doc.Name(one.key)), one.level, one.off)
        for found in report.missions
        if not isinstance(found, UnusableMission)
        for one in found.kinds.shifted
    ]
    if shifted:
        heads = doc.heads("Mission", "Key", "Level", "From")
        blocks.append(doc.TextTable("Figures that a level shifts", "Figures off their data sheets", heads, shifted))
    columns = doc.heads("Role", "Name", "Date", "Signature")
    lines = [(role, "", "", "") for role in ("Prepared", "Reviewed", "Approved")]
    blocks.append(doc.TextTable("", "Signatures", columns, lines, "approval"))
    return doc.Chapter("Approval", blocks, "approval", level=2)


# ---------------------------------------------------------------------- one mission
def _facts_of_file(file: str, digest: str, document: Document, counts: doc.Text) -> doc.Facts:
    pairs: list[tuple[doc.Text, doc.Text]] = [
        ("File", doc.Styled("id", doc.Name(file))),
        ("SHA-256", doc.Styled("digest", digest or "not read")),
    ]
    if words := document_words(document):
        pairs.append(("Document", words + (f"; author {document.author}" if document.author else "")))
    elif document.author:
        pairs.append(("Author", document.author))
    return doc.Facts([*pairs, ("Rows", counts)])


def _faults(found: UnusableMission, name: str, anchor: str) -> doc.Chapter:
    """Faults of a file that cannot be used."""
    said = f"{STATUS['error'].verdict}: the mission file is not usable."
    lines = [(f"{fault.line or '–'}:{fault.column or '–'}", str(fault)) for fault in found.faults]
    columns = doc.heads("Line:column", "Fault")
    table = doc.TextTable(f"Faults of {name}", "Faults of the mission file", columns, lines)
    return doc.Chapter("Verdict", [doc.Paragraph(said, "verdict error"), table], f"{anchor}-verdict", is_listed=False)


def _summary(page: Page) -> list[doc.Block]:
    return [
        doc.Chapter("Verdict", list(_verdict(page)), f"{page.anchor}-verdict"),
        doc.Chapter("Compliance matrix", list(_matrix(page)), f"{page.anchor}-matrix"),
        doc.Chapter(
            "Where phase and displacement come from",
            list(largest_contributions(page)),
            f"{page.anchor}-contributions",
            short="Contributions",
        ),
        doc.Chapter("Geometry", list(_geometry(page)), f"{page.anchor}-geometry"),
        doc.Chapter("Allocation", list(_allocation(page)), f"{page.anchor}-allocation", style="allocation"),
        doc.Chapter("Assumptions and validity", list(_validity(page)), f"{page.anchor}-validity"),
    ]


def _verdict(page: Page) -> Iterator[doc.Block]:
    found, waived = page.found, _waived(page.found)
    said = _NOTHING if found.is_empty else _judged(found.status, waived)
    said += f";{confidence}" if (confidence := confidence_words(found)) else ""
    said += (_CHANGED if found.changes else "") + (_ALONE if _is_alone(found) else "")
    yield doc.Paragraph(said, f"verdict {found.status}")
    if doubt := doubtful_model(found):
        yield doc.Paragraph(doubt)
    yield doc.Paragraph(f"{sentence(verdict(found))}. {sentence(rule_words(found))}.")
    yield _requirements(page)
    facts: list[tuple[doc.Text, doc.Text]] = [
        ("Not judged", f"{one.text} ({', '.join(row.id for row in one.rows)})") for one in unjudged_effects(found)
    ]
    facts.append(("Declared", f"{len(found.kinds.declared)} of {found.kinds.in_all} kinds of error"))
    for name, kinds in (("Not declared", found.kinds.missing), ("Without source", found.kinds.without_source)):
        facts += [(name, ", ".join(kind_names(kinds)))] if kinds else []
    if found.kinds.shifted:
        facts.append(("Off the data sheet", ", ".join(shifted_names(found.kinds))))
    facts += [
        ("" if place else "Overrides", f"{one.name} {one.value} ({one.origin})")
        for place, one in enumerate(found.overrides)
    ]
    yield doc.Facts(facts, "facts wide")
    if narrow := narrow_gradients(found.geometry):
        yield doc.Paragraph(narrow)
    if drivers := list(_drivers(page)):
        who = "rows that drive" if len(drivers) > 1 else "row that drives"
        yield doc.Paragraph(f"The {who} it (QPE is the quadratic phase error at the aperture edge):")
        yield doc.Items([_driver(row, found) for row in drivers], "drivers", is_numbered=True)


def _requirements(page: Page) -> doc.TextTable:
    lines: list[doc.Line] = []
    for one in requirement_lines(page.found):
        decided: doc.Text = dashed(one.decided_by)
        if one.decided_by == one.requirement.row:
            decided = doc.Styled("id", doc.Name(one.decided_by))
        lines.append(
            (
                sentence(one.name) + (" (default)" if one.requirement.is_default else ""),
                dashed(one.allowed),
                dashed(one.reached),
                (dashed(one.use), doc.Use(None if one.use == "-" else one.requirement.utilization, one.status)),
                doc.Badge(one.status),
                (decided, ", " if one.decided_by and one.remark else "", one.remark),
            )
        )
    columns = doc.heads("Requirement", *doc.numbers("Allowed", "Reached", "Use"), "Status", "Decided by")
    caption = "Requirements, and whether each was judged and is met"
    return doc.TextTable(f"Requirements of {page.name}", caption, columns, lines, "requirements")


def _drivers(page: Page) -> Iterator[Row]:
    """Rows that a verdict rests on: what breaks, is in doubt or is waived; of a pass also what comes nearest."""
    is_met = STATUS[page.found.status].is_met
    for row in page.judged[:_DRIVERS]:
        if not STATUS[row.status].is_met or (is_met and row.utilization):
            yield row


def _driver(row: Row, found: MissionFindings) -> tuple[doc.Text, doc.Text]:
    said = f"{sentence(measure(row, found))}."
    said += f" {sentence('; '.join(row.decisive))}." if row.decisive else ""
    bar = doc.Use(shown_use(row), row.status)
    return (doc.Styled("id", doc.Name(row.id)), own_id(row), " ", doc.Badge(row.status), " ", bar), said


def _matrix(page: Page) -> Iterator[doc.Block]:
    if not page.matrix:
        yield undeclared_table(page)
        return
    caption = (
        "What is declared or limits something, the worst first. Utilization is declared over allowable, in dB of "
        "amplitudes; the mark on its bar is the allowable. A margin of × 12 is an allowable of twelve times what is "
        "declared. The requirement is the one that sets the allowable."
    )
    caption += " The annex has the formulas of each id." if page.is_full else ""
    shown = [row for row in page.matrix if row.id in page.in_summary]
    yield matrix_table(page, shown, f"Compliance matrix of {page.name}", caption)
    hidden = len(page.hidden)
    left = [f"{hidden} rows that pass or limit nothing" if hidden > 1 else "1 row that passes or limits nothing"]
    left = (left if hidden else []) + ([f"{len(page.undeclared)} not declared"] if page.undeclared else [])
    if left:
        where: doc.Text = " (in the annex)" if page.is_full else (" (", doc.Code("--detail full"), " has them)")
        yield doc.Paragraph((f"Not shown: {', '.join(left)}", where, "."), "more")
    driving = {row.id for row in _drivers(page)}
    reasons = grouped(
        (row.id, row.decisive) for row in page.judged if STATUS[row.status].is_explained and row.id not in driving
    )
    if reasons:
        yield reasons


def _geometry(page: Page) -> Iterator[doc.Block]:
    yield doc.Facts([(name, sentence(text)) for name, text in head(page.found)], "facts wide")
    figures = []
    for name, title, svg in (
        ("plan", "Plan: the collection from above", geometry_plan(page.found)),
        ("elevation", "Elevation: the collection from the side", geometry_elevation(page.found)),
    ):
        label = f"{title} of {page.name}"
        figures.append(doc.Figure(f"{page.number}-{name}.svg", page.anchor, title, label, svg, is_told=False))
    yield doc.Group("figures", figures)


def _allocation(page: Page) -> Iterator[doc.Block]:
    """Shares of the quadratic phase error and of the power."""
    found, allocation = page.found, page.found.allocation
    total, gain = allocation.qpe_total, allocation.autofocus_gain
    yield doc.Paragraph(
        f"The quadratic phase error at the aperture edge may be {phase_limit(total, found)} in all; "
        f"{_gain(allocation)}."
    )
    shares = [
        (owner, getattr(allocation.qpe, owner) or 0.0) for owner in ("transmitter", "receiver", "clock", "reserve")
    ]
    bars = (("Before autofocus", 1.0), ("With autofocus", gain)) if gain > 1 else (("Budget", 1.0),)
    for label, factor in bars:
        parts = [
            (one, part * factor / gain, phase_limit(part * total * factor, found)) for one, part in shares if part
        ]
        yield doc.Stack(label, parts)
    lines: list[doc.Line] = []
    for owner, part in shares:
        if part or owner == "clock":
            limit = part * total if part else allocation.qpe_limit(owner)
            name: doc.Text = (doc.Swatch(owner, part), owner) if part else owner
            share = f"{part:.3g}" if part else "held to the receiver’s"
            lines.append((name, share, phase_limit(limit, found), phase_limit(limit * gain, found)))
    columns = doc.heads("Owner", *doc.numbers("Share", "Before autofocus", "With autofocus"))
    yield doc.TextTable(f"Allocation of {page.name}", "Shares of the quadratic phase error", columns, lines)
    yield from _power_shares(page)


def _power_shares(page: Page) -> Iterator[doc.TextTable]:
    """Shares of the power that vibration and noise may add; that of the clock only where it has one."""
    required, allocation = page.mission.requirements, page.found.allocation
    stated = [
        (name, value, split)
        for name, value, split in (
            ("PSLR", required.pslr, allocation.pslr),
            ("ISLR", required.islr, allocation.islr),
        )
        if value is not None
    ]
    has_clock = any(split.clock is not None for _, _, split in stated)
    heads = ("Requirement", "Transmitter", "Receiver", *(["Clock"] if has_clock else []))
    lines = []
    for name, value, split in stated:
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
    found, file = page.found, page.file
    stated = [(name, sentence(text) + ("" if text.endswith(".") else ".")) for name, text in _assumptions(page)]
    yield doc.Facts(stated, "facts wide")
    warnings: list[doc.Text] = []
    for warning in found.warnings:
        place = file if warning.line is None else f"{file}:{warning.line}"
        warnings.append(("Warning, ", doc.Styled("id", doc.Name(place)), f": {warning.message}."))
    remarks = [*warnings, *(f"{sentence(note)}." for note in found.notes)]
    if remarks:
        yield doc.Items([[remark] for remark in remarks])
    inputs = [
        (name, (value, " ", doc.Styled("origin", doc.Name(origin.replace(f"{file}:", "line ")))))
        for name, value, origin in _inputs(page)
    ]
    yield doc.Facts(inputs, "inputs")
    by_source, unsourced = sources(found)
    said = "; ".join(f"“{text}” for {counted(len(rows), 'row')}" for text, rows in by_source.items())
    texts = [f"Sources: {said}."] if said else []
    if unsourced:
        texts.append(f"The file names no source for {counted(len(unsourced), 'declared row')}.")
    if texts:
        yield doc.Paragraph(" ".join(texts))


_BESIDE = {"accuracy": "Accuracy", "earth_orientation": "The Earth’s orientation"}  # files that say more of a path


def _assumptions(page: Page) -> Iterator[tuple[str, str]]:
    """Assumptions of the verdict, and where it holds."""
    mission, found = page.mission, page.found
    if found.changes:
        yield "Mission", f"not that of the file, but that of the file with {changes_words(found.changes)}"
    yield "Model", _VALIDITY[found.model]
    if mission.has_direct_path:
        yield (
            "Direct path",
            "the receiver hears the transmitter and takes it as its clock: ranges are less the distance of the "
            "platforms, and timing errors have no effect. The published model does not know that: its values are "
            "those without, and a row that it fails is no warning",
        )
    for name, path in found.paths:
        yield f"Path of the {name}", path_words(path)
        if path.sha256 is not None:
            yield f"File of the {name}’s path", f"{path.file or 'in the mission file'}, SHA-256 {path.sha256}"
        for said, file in path.beside.items():
            if file is not None:
                yield f"{_BESIDE[said]} of the {name}’s path", "{}, SHA-256 {}".format(*file)
    yield "Combination", _RULES[found.combine]
    yield "Phases", f"at the centre frequency, c = {SPEED_OF_LIGHT / 1e3:.3f} km/s; at the aperture edge, ±T/2"
    factor = f"{found.coverage_factor:g} times the file’s value" if found.coverage_factor != 1 else "the file’s value"
    yield "Declared", f"for position, velocity, acceleration and clock {factor}"
    for name in ("transmitter", "receiver"):
        error = getattr(mission.platforms, name).motion_error
        if any(error.stated(kind) for kind in MOTION_UNITS):
            said = _DISTRIBUTIONS[error.distribution]
            said += ", position and velocity by their covariance" if error.covariance is not None else ""
            yield f"Errors of the {name}", f"along the axes of the frame “{error.frame}”; {said}"
    common = mission.common_motion_error
    if common is not None:
        said = _DISTRIBUTIONS[common.distribution]
        frame = (
            "along the axes of the scene"
            if common.frame == "scene"
            else f"the same along the axes of each platform’s own frame “{common.frame}”"
        )
        yield "Errors of both platforms", f"{frame}; {said}"
    yield (
        "Autofocus",
        _gain(found.allocation) + ("" if found.allocation.n_pull is None else f" ({mission.autofocus.algorithm})"),
    )
    yield (
        "Sidelobes",
        "PSLR and ISLR bound what vibration and noise add along the line of sight, not the sidelobes of the window",
    )
    if any(platform.motion_error.imu or platform.motion_error.random for platform in mission.platforms):
        yield (
            "Sensors",
            "one sigma, axes independent. Inertial sensors act from mid-aperture on: position and velocity there are "
            "those declared. Attitude and gyros turn the specific force, scale factors add a part of it",
        )
    if any(platform.motion_error.lever_arm for platform in mission.platforms):
        yield (
            "Lever arms",
            "along, cross and up of the velocity, turning with it; of a platform that stands still along the axes of "
            "the scene. Attitude swings an arm and turns the specific force: the row of the inertial sensor has both",
        )
    if any(row.subject.kind == "time_tag" for row in found.rows):
        yield "Time tags", "a path is measured where its platform is later by so much"
    if any(platform.oscillator for platform in mission.platforms) or mission.synchronization:
        yield (
            "Clocks",
            "spectra of phase are one-sided, and count to the mask’s end or the oscillator’s bandwidth, 1 kHz where "
            "neither is stated. The level of an oscillator is that of its noise against the noise declared, 0 dB",
        )
    if mission.propagation is not None:
        yield (
            "Delays in the air",
            f"one sigma of what correction leaves above the scene, {_air_of(mission.propagation)}. Below 80 km a leg "
            "is as long as over a flat Earth and crosses no free electrons; above, it crosses spherical shells at "
            "7 km and 350 km",
        )
    for row in found.rows:
        if row.subject.kind == "oscillator" and row.remarks:
            shaken = " under acceleration" if row.subject.axis == "acceleration" else ""
            yield f"Oscillator of the {row.owner}{shaken}", "; ".join(row.remarks)


def _air_of(propagation: Propagation) -> str:
    """Say which air the legs have, and in which time it changes."""
    legs = {name: propagation.leg(name) for name in Platforms._fields}
    times = {name: leg.correlation_time for name, leg in legs.items() if leg is not None}
    said = {
        name: "as it is within the aperture"
        if time is None
        else f"with a correlation time of {format_quantity(time, 's')}"
        for name, time in times.items()
    }
    air = "one air over both legs" if propagation.is_one_air else "legs independent"
    if len({*said.values()}) == 1:
        return f"{air}, {next(iter(said.values()))}"
    return f"{air}: {', '.join(f'{name} {words}' for name, words in said.items())}"


def _inputs(page: Page) -> Iterator[tuple[str, str, str]]:
    """Values that the findings rest on, with the line of the file or `default`."""
    mission, found, file = page.mission, page.found, page.file

    def given(name: str, value: str, path: KeyPath) -> tuple[str, str, str]:
        if mission.is_changed(path):
            return name, value, "--set"
        is_in_file = path in mission.places
        return name, value, f"{file}:{mission.line(path)}" if is_in_file else "default"

    requirements = mission.requirements
    yield given(
        "centre frequency", format_quantity(mission.radar.center_frequency, "Hz", 6), ("radar", "center_frequency")
    )
    yield given("bandwidth", format_quantity(mission.radar.bandwidth, "Hz", 6), ("radar", "bandwidth"))
    yield given(
        "aperture time", format_quantity(mission.collection.aperture_time, "s", 6), ("collection", "aperture_time")
    )
    stated = {one.key: one for one in found.requirements}
    for key, name in NAMES.items():
        if key == "declare":
            continue
        if key not in stated:
            yield name, "none: computed, not judged", "not in the file"
            continue
        value = requirement_size(stated[key].value, stated[key], "down")
        if key == "quadratic_phase_error":
            value += f" ({requirements.quadratic_phase_error:.4g} rad)"
        yield given(name, value, ("requirements", key))
    allocation = mission.allocation
    split = allocation.split
    yield given("split", split if isinstance(split, str) else "shares of the file", ("allocation", "split"))
    yield given("combination", allocation.combine, ("allocation", "combine"))
    yield given("model", allocation.model, ("allocation", "model"))
    if mission.has_direct_path:
        yield given("clock", "the direct path; the full model gates", ("synchronization", "method"))
    yield given("coverage factor", f"{allocation.coverage_factor:g}", ("allocation", "coverage_factor"))
    yield given("warning above", f"{100 * allocation.warn_above:g} % of a limit", ("allocation", "warn_above"))
