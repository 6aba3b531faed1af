"""How a requirement stands, what must be declared, and why a row is not judged: the numbers behind it."""

from collections.abc import Iterator

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.budget.aggregates import effect_parts, effect_totals
from bisar_budget.budget.doubts import declared_position_error, input_doubts, is_in_doubt
from bisar_budget.budget.judged_requirements import (
    MAKES_UP,
    SMALL_RAD,
    TENTH,
    UntakenEffect,
    missing_declarations,
    untaken_effects,
)
from bisar_budget.faults import printable
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.findings.row import DECLARE, Row
from bisar_budget.findings.status import STATUS
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import Platform
from bisar_budget.phrases import Note
from bisar_budget.report.explain.explained_budget import combined
from bisar_budget.report.explain.explained_error import as_written, place
from bisar_budget.report.explain.formulas import Step, Sum, equation, number, step, with_unit
from bisar_budget.report.words.sentences import percent

_EFFECTS = {"cubic": "Cubic phase", "spread": "Rms phase that spreads", "tone": "Peak phase of the tones"}


def finding_of(mission: Mission, found: MissionFindings, one: JudgedRequirement) -> Iterator[Step]:
    """Where a requirement stands in the file, and the rows that judge it."""
    path = ("requirements", one.key)
    if one.key == DECLARE:
        yield from _asked_for(mission)
    elif one.is_default:
        yield from step("The file does not state it: the default")
    else:
        yield from step(f"Required in {place(mission, path)}", as_written(mission, path))
    judging = [row for row in found.rows if row.id in one.rows]
    width = max((len(row.id) for row in judging), default=0)
    listed = [
        f"{printable(row.id):<{width}}  {STATUS[row.status].text}"
        + ("" if row.utilization is None else f", {percent(row.utilization)}")
        for row in judging
    ]
    yield from step("Rows that judge it", *(listed or ["none"]))


def declarations(mission: Mission) -> Iterator[Step]:
    """The errors that must be declared, and those of them that the file lacks."""
    yield from _asked_for(mission)
    missing = [one.key for one in missing_declarations(mission)]
    yield from step("Not in the file", *(missing or ["nothing: all of it is declared"]))


def _asked_for(mission: Mission) -> Iterator[Step]:
    asked = ", ".join(mission.requirements.declare)
    yield from step(f"Required in {place(mission, ('requirements', 'declare'))}", f"requirements.declare: [{asked}]")


def not_judged(found: MissionFindings, row: Row) -> Iterator[Step]:
    """Numbers behind what could not be judged: an effect, a path in doubt, a place that is not known."""
    analysis = found.analysed()
    mission, reason = analysis.mission, _reason(found, row)
    if reason is None:
        return
    code = reason.code
    if code == "not-declared-as-required":
        yield from _asked_for(mission)
    elif code == "input-in-doubt":
        yield from _path_in_doubt(mission, row)
    elif code == "place-is-not-known":
        yield from _displacing(analysis, row, reason)
    else:
        for one in untaken_effects(mission, effect_totals(analysis)):
            if row.id in one.makers and one.makers[row.id][0]:
                yield from _untaken(analysis, row, one)


def _reason(found: MissionFindings, row: Row) -> Note | None:
    """Why a row is not judged, or the requirement that is the mission's own row of it."""
    if row.status in ("not_evaluated", "waived"):
        return row.reason
    if row.status == "not_declared":
        for one in found.requirements:
            if one.id == row.id and one.status in ("not_evaluated", "waived"):
                return one.reason
    return None


def _untaken(analysis: Analysis, row: Row, one: UntakenEffect) -> Iterator[Step]:
    """How large an effect is that no requirement takes, what would be negligible, and the part of a row."""
    kind = one.kind
    totals = []
    for model in analysis.gates:
        together, parts = analysis.together(model), effect_parts(analysis, model)[kind]
        rule = together.rule_of_all
        totals.append((float(together.combined(parts, rule)[0]), rule, together.phase_parts(parts, rule)))
    total, rule, parts = max(totals, key=lambda found: found[0])
    yield from combined(f"{_EFFECTS[kind]}: no requirement takes it", rule, parts, total, symbol="total")
    required = analysis.mission.requirements.quadratic_phase_error
    values = {"required": required}
    level = min(TENTH * required, SMALL_RAD)
    lines = equation("negligible", f"min({TENTH:g}*required, {SMALL_RAD:g})", values, level, "rad")
    yield from step(
        "Below a tenth of requirements.quadratic_phase_error and below 0.08 rad it would be negligible", *lines
    )
    largest, own = max(float(size[0]) for size in one.parts.values()), float(one.parts[row.id][0])
    count = sum(float(size[0]) > 0 for size in one.parts.values())
    values = {"largest": largest, "negligible": level}
    lines = equation("least", f"min({MAKES_UP:g}*largest, negligible/{count})", values, float(one.least[0]), "rad")
    title = (
        "Parts of at least a tenth of the largest make it up, and smaller ones that together would not be negligible"
    )
    yield from step(f"{title}; this row’s is {with_unit(own, 'rad')}", *lines)


def _path_in_doubt(mission: Mission, row: Row) -> Iterator[Step]:
    """How far a path may be from the truth, and the position errors that the file declares of it."""
    for one in input_doubts(mission):
        if row.owner != "mission" and not is_in_doubt(row.subject, one.owner, mission):
            continue
        platform: Platform = getattr(mission.platforms, one.owner)
        error, path = platform.motion_error, platform.path
        said = f": {printable(path.doubt_of)}" if path is not None and path.doubt_of else ""
        yield from step(f"How far the {one.owner}’s path may be off{said}", f"doubt = {with_unit(one.doubt, 'm')}")
        declared = declared_position_error(error)
        if declared is None:
            yield from step("It declares no position error")
            continue
        sizes = [*(error.stated("position") or ()), *(sigma for process in error.random for sigma in process.sigma)]
        terms = " + ".join(f"{number(size)}^2" for size in sizes)
        line = Sum(f"stated = sqrt({terms}) = {with_unit(declared, 'm')}")
        yield from step("Position errors that it declares, without coverage factor: less than the doubt", line)


def _displacing(analysis: Analysis, row: Row, reason: Note) -> Iterator[Step]:
    """Phases of the errors that move the image by an amount that is not computed."""
    model = row.model or "published"
    names, lines = reason.values[0], []
    for one in analysis.together(model).own:
        if isinstance(names, list | tuple) and one.row_id in names:
            qpe, cubic = (with_unit(float(phase[0]), "rad") for phase in (one.qpe_rad, one.cubic_rad))
            lines.append(f"{printable(one.row_id)}: QPE {qpe}, cubic {cubic}")
    yield from step(
        f"Not in the displacement, by an amount that is not computed: {reason.values[1]} the image too", *lines
    )
