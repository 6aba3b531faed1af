"""Make of the findings what a compliance report shows: once, for one template per language.

Every number is one that the check found or an explanation shows; nothing is computed a second time.
"""

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from hashlib import sha256
from typing import TYPE_CHECKING

from bisar_budget.analysis.allocation import Allocation
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.catalogue import EQUATIONS
from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.effects.declared import END_OF_IMAGE
from bisar_budget.effects.effect import MOTION_UNITS, ErrorSource, Subject
from bisar_budget.effects.random_effect import RandomError
from bisar_budget.faults import KeyPath, changes_words
from bisar_budget.findings.images import PointImage
from bisar_budget.findings.mission import MissionFindings, Report, UnusableMission
from bisar_budget.findings.requirement import NAMES
from bisar_budget.findings.row import DECLARE, Row, worst_first
from bisar_budget.findings.status import STATUS
from bisar_budget.mission.model import Mission
from bisar_budget.report import Style
from bisar_budget.report.compliance.view import (
    Compliance,
    Contribution,
    Derivation,
    Driver,
    Evidence,
    General,
    Illustration,
    Input,
    MatrixRow,
    MissionPage,
    Move,
    Picture,
    PowerShare,
    Probability,
    Remark,
    Share,
    ShownImage,
    Source,
    Studied,
    Undeclared,
)
from bisar_budget.report.drawing.drawings import geometry_elevation, geometry_plan
from bisar_budget.report.drawing.evidence_drawings import (
    chip_caption,
    chip_png,
    chip_size,
    impulse_response_cuts,
    numbers_in_words,
)
from bisar_budget.report.explain.explanation import chain, collection_chain
from bisar_budget.report.formats import verification
from bisar_budget.report.words.identity import (
    doubtful_model,
    head,
    multiple_of_pi,
    narrow_gradients,
    path_words,
    source_path,
)
from bisar_budget.report.words.requirements import (
    kind_names,
    requirement_id,
    requirement_lines,
    rule_words,
    unjudged_effects,
    unseen,
    verdict,
)
from bisar_budget.report.words.sentences import (
    matters,
    measure,
    percent,
    phase_limit,
    phase_unit,
    requirement_size,
    row_limit,
    row_size,
)
from bisar_budget.units import format_in, format_quantity

if TYPE_CHECKING:
    from bisar_budget.findings.monte_carlo import MonteCarlo

_NOTHING = "Nothing was judged"
_ALONE = "; each error alone"
_CHANGED = "; with values set by options"
_OWNERS = ("transmitter", "receiver", "clock", "reserve")
_DRIVERS = 3
_MATRIX_ROWS = 40  # of a summary; beyond, those that use least are left to the annex
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


def compliance(report: Report, style: Style) -> Compliance:
    """Arrange the findings of a run for a report that people read.

    Raises
    ------
    ValueError
        Findings that do not carry their analysis.
    """
    pages = []
    for number, mission in enumerate(report.missions, start=1):
        anchor = f"m{number}"
        if isinstance(mission, UnusableMission):
            pages.append(_unusable(mission, style, anchor))
        else:
            pages.append(_page(mission, style, anchor))
    return Compliance(
        version=report.version,
        day=report.day,
        status=report.status,
        verdict=_overall(report, pages),
        is_full=style.detail == "full",
        options=report.options,
        missions=tuple(pages),
    )


def _verdict(status: str, waived: Counter[str]) -> str:
    """Verdict on rows and requirements, with what it owes to waivers."""
    said = [f"{count} {_plural(what, count)} {'are' if count > 1 else 'is'} waived" for what, count in waived.items()]
    return "; ".join([STATUS[status].verdict, *said])


_OVER, _UNJUDGED = "row over its limit", "requirement or row that cannot be judged"


def _plural(what: str, count: int) -> str:
    if count == 1:
        return what
    return "rows over their limits" if what == _OVER else "requirements or rows that cannot be judged"


def _waived(found: MissionFindings) -> Counter[str]:
    """Number of rows that are waived, and of requirements that are and have no such row."""
    rows = [row for row in found.rows if row.status == "waived"]
    over = sum((row.utilization or 0.0) > 1 for row in rows)
    unjudged = len(rows) - over + sum(one.status == "waived" for one in unseen(found))
    return Counter({what: count for what, count in ((_OVER, over), (_UNJUDGED, unjudged)) if count})


def _overall(report: Report, pages: Sequence[MissionPage]) -> str:
    """Verdict on the run: a mission that declares nothing complies with nothing."""
    usable = [mission for mission in report.missions if isinstance(mission, MissionFindings)]
    said = _verdict(report.status, sum(map(_waived, usable), Counter()))
    empty = sum(page.verdict == _NOTHING for page in pages)
    if empty == len(pages):
        return _NOTHING
    if empty:
        said = f"{said}; of {len(pages)} missions {empty} declare no error"
    if any(mission.changes for mission in usable):
        said += _CHANGED
    alone = sum(bool(page.alone) for page in pages)
    if not alone:
        return said
    return said + (_ALONE if alone == len(pages) else f"{_ALONE} in {alone} of {len(pages)} missions")


def _unusable(found: UnusableMission, style: Style, anchor: str) -> MissionPage:
    count = len(found.faults)
    return MissionPage(
        anchor=anchor,
        file=source_path(found.file, style),
        sha256=_digest(found.data),
        status="error",
        verdict=STATUS["error"].verdict,
        name=source_path(found.file, style),
        counts=f"{count} fault{'s' if count != 1 else ''}",
        faults=tuple((f"{fault.line or '–'}:{fault.column or '–'}", str(fault)) for fault in found.faults),
    )


def _page(found: MissionFindings, style: Style, anchor: str) -> MissionPage:
    analysis = found.analysed()
    mission = analysis.mission
    sources = {source.id: source for source in analysis.sources}
    rows = worst_first(found.rows)
    judged = [row for row in rows if STATUS[row.status].is_judged]
    evidence = {verdict.id: verdict for verdict in found.verdicts or ()}
    file = source_path(found.file, style)
    placed = mission if mission.file == file else mission._replace(file=file)  # the same name in every section
    allocation = found.allocation
    is_full = style.detail == "full"
    important = [row for row in rows if matters(row)]
    in_summary = {
        row.id for place, row in enumerate(important) if place < _MATRIX_ROWS or STATUS[row.status].is_explained
    }
    matrix = tuple(
        MatrixRow(
            id=row.id,
            requirement_id=row.requirement_id or "",
            requirement=_requirement(mission, found, row, sources.get(row.id)),
            method=_method(found, row, evidence[row.id].verdict if row.id in evidence else None),
            allowable=_allowable(row, found),
            declared="–" if row.declared is None else row_size(row.declared, row, found),
            use=None if row.status == "not_evaluated" or row.allowable is None else row.utilization,
            use_text=_use(row),
            margin="–" if row.status == "not_evaluated" else _margin(row),
            status=row.status,
            waiver="; ".join(waiver.words for waiver in row.waivers),
            line=row.line,
            remarks=_remarks(row),
            in_summary=row.id in in_summary,
        )
        for row in rows
        if row.status != "not_declared"
    )
    drivers = tuple(_drivers(judged, found))
    waived = _waived(found)
    driving = {driver.id for driver in drivers}
    return MissionPage(
        anchor=anchor,
        file=file,
        sha256=_digest(mission.data),
        document=found.document,
        doubt=doubtful_model(found),
        alone=_ALONE if not found.is_empty and found.combine == "each" else "",
        narrow=narrow_gradients(found.geometry),
        status=found.status,
        verdict=(_NOTHING if found.is_empty else _verdict(found.status, waived))
        + (_CHANGED if found.changes else ""),
        is_empty=found.is_empty,
        said=verdict(found),
        rule=rule_words(found),
        requirements=tuple(requirement_lines(found)),
        effects=tuple(f"{one.text} ({', '.join(row.id for row in one.rows)})" for one in unjudged_effects(found)),
        declared=f"{len(found.kinds.declared)} of {found.kinds.in_all} kinds of error",
        missing=", ".join(kind_names(found.kinds.missing)),
        without_source=", ".join(kind_names(found.kinds.without_source)),
        overrides=found.overrides,
        name=found.name,
        counts=", ".join(f"{count} {STATUS[status].words}" for status, count in found.summary.items()),
        worst=_worst(found, judged),
        worst_use=_use(judged[0]) if judged and _worst(found, judged) == judged[0].id else "",
        head=tuple(head(found)),
        tone="warn" if STATUS[found.status].is_met and waived else found.status,
        drivers=drivers,
        matrix=matrix,
        remarks=tuple(_grouped((row.id, row.remarks) for row in matrix)),
        reasons=tuple(
            _grouped(
                (row.id, row.decisive) for row in judged if STATUS[row.status].is_explained and row.id not in driving
            )
        ),
        hidden=sum(not row.in_summary for row in matrix),
        pictures=drawings(found),
        total=phase_limit(allocation.qpe_total, found),
        gain=allocation.autofocus_gain,
        gain_text=_gain(allocation),
        shares=tuple(_shares(found)),
        power_shares=tuple(_power_shares(mission, allocation)),
        contributions=_contributions(analysis, found),
        moves=_moves(found, [*analysis.stated, *(one for one in analysis.random if one.declared is not None)]),
        validity=tuple(_validity(mission, found)),
        inputs=tuple(_inputs(mission, found, file)),
        undeclared=tuple(
            Undeclared(row.id, _allowable(row, found), row.equation)
            for row in found.rows
            if row.status == "not_declared"
        ),
        notes=found.notes,
        warnings=tuple(
            (f"{file}:{warning.line}" if warning.line is not None else file, warning.message)
            for warning in found.warnings
        ),
        sources=_sources(found.rows),
        unsourced=tuple(row.id for row in found.rows if _may_have_a_source(row) and not row.evidence),
        collection=tuple(collection_chain(found)) if is_full else (),
        general=tuple(_general(mission)),
        derivations=tuple(
            Derivation(row.id, row.status, row.line, tuple(chain(placed, found, row)))
            for row in rows
            if is_full and row.status != "not_declared"
        ),
        evidence=None if found.verdicts is None else tuple(_evidence(found)),
        evidence_remarks=tuple(verification.geometry_remarks(found.verdicts or ())),
        has_refocused=any(verdict.verdict_autofocus for verdict in found.verdicts or ()),
        illustrations=illustrations(found),
        draws=_draws(found.monte_carlo),
        probabilities=tuple(_probabilities(found.monte_carlo)),
        draws_remarks=tuple(_draws_remarks(found.monte_carlo)),
        study=studied(found, file),
    )


def drawings(found: MissionFindings) -> tuple[Picture, ...]:
    """Draw a mission."""
    return (
        Picture("plan.svg", "Plan: the collection from above", geometry_plan(found)),
        Picture("elevation.svg", "Elevation: the collection from the side", geometry_elevation(found)),
    )


def studied(found: MissionFindings, file: str) -> Studied | None:
    """Write a sweep, where there is one; `file` is the name of the mission file that is shown."""
    if found.study is None:
        return None
    from bisar_budget.report.compliance.trade_study import written

    return written(found, found.study, file)


def illustrations(found: MissionFindings) -> tuple[Illustration, ...]:
    """Images at the limits that decide most, where they were formed."""
    result = []
    for number, evidence in enumerate(found.image_evidence or (), start=1):
        row_id = evidence.verdict.id
        images = [("limit", f"{row_id} at the limit", evidence.at_limit)]
        if evidence.before_autofocus and evidence.after_autofocus:
            at = f"{row_id} at the limit with autofocus"
            images.append(("before", f"{at}, before it", evidence.before_autofocus))
            images.append(("after", f"{at}, after it", evidence.after_autofocus))
        result.append(
            Illustration(
                id=row_id,
                words=tuple(numbers_in_words(evidence)),
                chips=tuple(
                    ShownImage(
                        f"chip-{number}-{name}.png", title, chip_caption(image), chip_png(image), _on_page(image)
                    )
                    for name, title, image in images
                ),
                cuts=Picture(f"cuts-{number}.svg", f"Cross-range cuts of {row_id}", impulse_response_cuts(evidence)),
            )
        )
    return tuple(result)


def _on_page(image: PointImage) -> tuple[int, int]:
    """Width and height on a page, at most 240 px each. [px]"""
    width, height = chip_size(image)
    shrink = max(1.0, width / 240, height / 240)
    return max(1, round(width / shrink)), max(1, round(height / shrink))


def _draws(drawn: "MonteCarlo | None") -> str:
    if drawn is None:
        return ""
    return (
        f"{drawn.draws:,} draws, seed {drawn.seed}, {drawn.model} model; intervals of {100 * drawn.confidence:.0f} %"
    )


def _probabilities(drawn: "MonteCarlo | None") -> Iterator[Probability]:
    if drawn is None:
        return
    from bisar_budget.report.words.requirements import held

    for one in drawn.requirements:
        limit = _limit(one.limit, one.unit)
        sizes = (_quantity(size, one.unit) for size in (one.sum, one.rss, one.sigma))
        yield Probability(one.id, (limit, *sizes), held(one.probability, one.probability_low, one.probability_high))
    if drawn.probability is not None and len(drawn.requirements) > 1:
        ends = (drawn.probability_low or 0.0, drawn.probability_high or 1.0)
        yield Probability("all at once", ("–",) * 4, held(drawn.probability, *ends))


def _draws_remarks(drawn: "MonteCarlo | None") -> Iterator[str]:
    if drawn is None:
        return
    yield from (f"{one.id}: {text}" for one in drawn.requirements for text in one.warnings)
    yield from drawn.notes
    if drawn.probability is None:
        yield "no declared error has a requirement to hold"


def _digest(data: bytes | None) -> str:
    return "" if data is None else sha256(data).hexdigest()


def _quantity(value: float | None, unit: str) -> str:
    return "–" if value is None else format_quantity(value, unit)


def _limit(value: float, unit: str) -> str:
    """Round down, everywhere alike: no limit is larger than it is, and none has two sizes on a page."""
    return format_quantity(value, unit, 3, "down")


def _worst(found: MissionFindings, judged: Sequence[Row]) -> str:
    """Name of what decides a mission in the index: its worst row, or a requirement that is worse than any row."""
    if judged and judged[0].status == found.status:
        return judged[0].id
    decides = [requirement_id(one) for one in found.requirements if one.status == found.status]
    return decides[0] if decides else judged[0].id if judged else ""


def _allowable(row: Row, found: MissionFindings) -> str:
    if row.allowable is not None:
        return row_limit(row.allowable, row, found)
    is_open = row.status in ("not_evaluated", "info") or row.metric in ("pslr", "islr", DECLARE)
    return "–" if is_open else "no limit"


def _use(row: Row) -> str:
    has_none = row.utilization is None or row.allowable is None or row.status == "not_evaluated"
    return "–" if has_none else percent(row.utilization or 0.0)


def _margin(row: Row) -> str:
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


def _drivers(judged: Sequence[Row], found: MissionFindings) -> Iterator[Driver]:
    """Rows that a verdict rests on: what breaks, is in doubt or is waived; of a pass also what comes nearest."""
    is_met = STATUS[found.status].is_met
    for row in judged[:_DRIVERS]:
        if not STATUS[row.status].is_met or (is_met and row.utilization):
            yield _driver(row, found)


def _driver(row: Row, found: MissionFindings) -> Driver:
    use = None if row.status == "not_evaluated" or row.allowable is None else row.utilization
    return Driver(row.id, row.requirement_id or "", row.status, measure(row, found), "; ".join(row.decisive), use)


def _remarks(row: Row) -> tuple[str, ...]:
    return tuple(text for text in (row.reason, *row.remarks, *row.refuted) if text)


def _grouped(said: Iterable[tuple[str, Sequence[str]]]) -> Iterator[Remark]:
    """Say once what several rows would say alike."""
    groups: dict[str, list[str]] = {}
    for row_id, texts in said:
        if texts:
            groups.setdefault("; ".join(texts), []).append(row_id)
    yield from (Remark(tuple(ids), text) for text, ids in groups.items())


def _requirement(mission: Mission, found: MissionFindings, row: Row, source: ErrorSource | None) -> str:
    """Say what sets the allowable of the row."""
    allocation, requirements = found.allocation, mission.requirements
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
        return "none stated" if value is None else f"displacement ≤ {_limit(value, 'm')}"
    if row.metric == DECLARE:
        return f"declared: {', '.join(requirements.declare)}"
    if row.subject.kind == "autofocus_pull_in":
        return "all QPE together within what autofocus corrects, π·N_pull"
    if row.subject.kind == "spatial_variance":  # one correction for the whole scene: no gain
        return f"QPE differs over the scene by ≤ {phase_limit(allocation.qpe_total, found)}"
    owner = row.owner
    limit = allocation.qpe_limit(owner) * allocation.autofocus_gain
    share = "" if owner == "mission" else f", {allocation.qpe.of(owner):.3g} of the budget"
    return f"QPE ≤ {phase_limit(limit, found)}{share}"


def _method(found: MissionFindings, row: Row, verdict: str | None) -> str:
    """Say how the row is verified: by analysis, and by the image where one was formed."""
    analysis = f"analysis: {row.equation}"
    return (
        analysis
        if verdict is None
        else f"{analysis}; simulation: {STATUS[verdict].words if verdict in STATUS else verdict}"
    )


def _gain(allocation: Allocation) -> str:
    if allocation.n_pull is None:
        return "no autofocus is declared"
    gain = f"limits of the quadratic phase × {allocation.autofocus_gain:.3g}"
    return f"autofocus corrects {multiple_of_pi(allocation.n_pull)} rad: {gain}"


def _shares(found: MissionFindings) -> Iterator[Share]:
    allocation = found.allocation
    start, gain = 0.0, allocation.autofocus_gain
    for owner in _OWNERS:
        part = getattr(allocation.qpe, owner)
        if not part:
            if owner == "clock":
                limit = allocation.qpe_limit(owner)
                held = "held to the receiver’s"
                yield Share(owner, held, phase_limit(limit, found), phase_limit(limit * gain, found), start, 0.0)
            continue
        limit = part * allocation.qpe_total
        shown = (phase_limit(limit, found), phase_limit(limit * gain, found))
        yield Share(owner, f"{part:.3g}", *shown, start, part)
        start += part


def _power_shares(mission: Mission, allocation: Allocation) -> Iterator[PowerShare]:
    for name, value, split in (
        ("PSLR", mission.requirements.pslr, allocation.pslr),
        ("ISLR", mission.requirements.islr, allocation.islr),
    ):
        if value is not None:
            clock = "" if split.clock is None else f"{split.clock:.3g}"
            yield PowerShare(name, f"{value:g} dB", f"{split.transmitter:.3g}", f"{split.receiver:.3g}", clock)


def _contributions(analysis: Analysis, found: MissionFindings) -> tuple[Contribution, ...]:
    """Errors as the file states them, the largest quadratic phase error first.

    An error that no image has comes before all others, and the others are no part of a sum with it.
    """
    phases: dict[str, dict[str, float]] = {}
    for model in ("published", "full"):
        of_all = analysis.together(model).phases
        phases[model] = {one.row_id: abs(float(one.qpe_rad[0])) for one in of_all}
    subjects = {row.id: row.subject for row in found.rows}
    gating = [name for name in phases if found.model in (name, "strictest")]
    sizes = {row_id: max(phases[name][row_id] for name in gating) for row_id in phases["full"]}
    total, largest = math.fsum(sizes.values()), max(sizes.values(), default=0.0)
    result = []
    for row_id in sorted((row_id for row_id in sizes if sizes[row_id]), key=lambda row_id: -sizes[row_id]):
        owner, kind, axis = _kind(subjects[row_id])
        qpe = sizes[row_id]
        part = 1.0 if qpe == largest else qpe / largest
        of_sum = percent(qpe / total) if math.isfinite(total) else "–"
        published, full = (_phase(by_model[row_id], found) for by_model in phases.values())
        result.append(Contribution(row_id, owner, kind, axis, _phase(qpe, found), published, full, part, of_sum))
    return tuple(result)


def _moves(found: MissionFindings, stated: Iterable[ErrorSource | RandomError]) -> tuple[Move, ...]:
    """Errors as the file states them, the largest displacement of the image first."""
    rows = {row.id: row.displacement_m for row in found.rows}
    known = [(source, rows.get(source.id)) for source in stated]
    moving = [(source, math.hypot(*by)) for source, by in known if by is not None and any(by)]
    moving.sort(key=lambda one: -one[1])
    largest = max((size for _, size in moving), default=1.0)
    return tuple(
        Move(source.id, *_kind(source.subject), format_quantity(size, "m"), size / largest) for source, size in moving
    )


def _kind(subject: Subject) -> tuple[str, str, str]:
    """Owner, kind and axis of an error."""
    _, owner, kind, axis, *_ = subject
    if kind in (*MOTION_UNITS, "time_tag"):
        return "both platforms" if owner == "mission" else owner, kind, axis.replace("_", " ")
    if kind == "terrain":
        return owner, kind, "height"
    return owner, kind, axis.replace("_", " ")


def _phase(value: float, found: MissionFindings) -> str:
    return format_in(value, "rad", phase_unit(found)) if math.isfinite(value) else "no image"


def _general(mission: Mission) -> Iterator[General]:
    """Formulas of the image plane and of the full model; of a direct path where there is one."""
    for equation in (General(*one) for one in EQUATIONS):
        is_of_direct_path = equation.title.startswith("Direct path")
        if equation.number not in ("(11)", "(31)") and (mission.has_direct_path or not is_of_direct_path):
            yield equation


def _validity(mission: Mission, found: MissionFindings) -> Iterator[tuple[str, str]]:
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
        if path.accuracy is not None:
            yield f"Accuracy of the {name}’s path", "{}, SHA-256 {}".format(*path.accuracy)
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
            "one sigma, axes independent. They act from the quadratic phase on: what displaces is the declared "
            "position and velocity. Attitude and gyros turn the specific force, scale factors add a part of it. "
            "Random walks start at mid-aperture",
        )
    if any(platform.motion_error.lever_arm for platform in mission.platforms):
        yield (
            "Lever arms",
            "along, cross and up of the velocity, turning with it; of a platform that stands still along the axes of "
            "the scene. Attitude swings an arm and turns the specific force: the row of the inertial sensor has both",
        )
    if any(row.subject.kind == "time_tag" for row in found.rows):
        yield "Time tags", "a path is measured where its platform is later by so much: velocity times the time"
    if any(platform.oscillator for platform in mission.platforms) or mission.synchronization:
        yield (
            "Clocks",
            "spectra of phase are one-sided, and count to the mask’s end or the oscillator’s bandwidth, 1 kHz where "
            "neither is stated. The level of an oscillator is that of its noise against the noise declared, 0 dB",
        )
    if mission.propagation is not None:
        yield (
            "Delays in the air",
            "one sigma of what correction leaves above the scene, legs independent. Below 80 km a leg is as long as "
            "over a flat Earth and crosses no free electrons; above, it crosses spherical shells at 7 km and 350 km",
        )
    for row in found.rows:
        if row.subject.kind == "oscillator" and row.remarks:
            shaken = " under acceleration" if row.subject.axis == "acceleration" else ""
            yield f"Oscillator of the {row.owner}{shaken}", "; ".join(row.remarks)


def _inputs(mission: Mission, found: MissionFindings, file: str) -> Iterator[Input]:
    """Values that the findings rest on, with the line of the file or `default`."""

    def given(name: str, value: str, path: KeyPath) -> Input:
        if mission.is_changed(path):
            return Input(name, value, "--set")
        is_in_file = path in mission.places
        return Input(name, value, f"{file}:{mission.line(path)}" if is_in_file else "default")

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
            yield Input(name, "none: computed, not judged", "not in the file")
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


_SOURCED = (
    *(*MOTION_UNITS, "time_tag", "lever_arm", "vibration", "other"),
    *("imu", "random", "oscillator", "synchronization", "propagation"),
)


def _may_have_a_source(row: Row) -> bool:
    return row.declared is not None and row.is_independent and row.subject.kind in _SOURCED


def _sources(rows: Sequence[Row]) -> tuple[Source, ...]:
    ids: dict[str, list[str]] = {}
    for row in rows:
        if row.evidence and row.declared is not None and row.is_independent:
            ids.setdefault(row.evidence, []).append(row.id)
    return tuple(Source(text, tuple(named)) for text, named in ids.items())


def _evidence(found: MissionFindings) -> Iterator[Evidence]:
    for one in found.verdicts or ():
        limit, numbers = verification.limit(one), verification.numbers(one)
        by_autofocus = one.verdict_autofocus
        refocused = (*verification.refocused_cells(one)[:4], by_autofocus) if by_autofocus else ()
        with_autofocus = one.reason_autofocus and f"with autofocus: {one.reason_autofocus}"
        reasons = tuple(reason for reason in (one.reason, with_autofocus) if reason)
        yield Evidence(one.id, limit, *numbers, one.verdict, refocused, reasons)
