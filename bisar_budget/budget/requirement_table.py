"""Rows and requirements of one mission, as judged, in words: what is asked, what is reached, what decides."""

import math
from collections.abc import Iterator

from bisar_budget import phrases
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.analysis.spread import islr_db, mainlobe_energy, spread_limit
from bisar_budget.analysis.vibration_limits import level_of
from bisar_budget.budget.doubts import input_doubts, is_in_doubt
from bisar_budget.budget.judged_mission import FamilyRow, JudgedMission
from bisar_budget.budget.judged_requirements import (
    DECLARATIONS,
    TAKEN_BY,
    UNITS,
    RequirementState,
    is_asked_for,
    missing_declarations,
)
from bisar_budget.budget.judged_rows import Judged, Why
from bisar_budget.budget.waivers import Waived
from bisar_budget.effects.declared import CUBIC, LOCATION, MODELS, QUADRATIC
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.findings.row import DECLARE, Row
from bisar_budget.findings.status import STATUS
from bisar_budget.phrases import NOTHING, Note

_STATUSES = tuple(STATUS)
_EXAMPLES = {CUBIC: "22.5 deg", "islr": "-20 dB", "pslr": "-30 dB"}


# ---------------------------------------------------------------------- rows
def rows_in_words(judged: JudgedMission) -> Iterator[Row]:
    """Rows of the only case, before waivers, in the order of the contract."""
    families: dict[tuple[str, str], FamilyRow] = {
        (model, one.judged.subject.id): one
        for model, found in judged.families.items()
        for one in found
        if one.is_there is True or one.is_there[0]
    }
    for one in judged.before:
        if one.metric == DECLARE:
            yield _declarations(judged, one)
            continue
        model = MODELS[one.model[0]]
        row = families[model, one.subject.id].in_words(judged.analysis, model)._replace(model=model)
        status = _STATUSES[one.status[0]]
        if status != row.status and status == "info":
            row = row._replace(utilization=None, margin=None)
        row = row._replace(status=status)
        yield row if one.why[0] == Why.OWN else row._replace(reason=_why(judged, one, row))


def _declarations(judged: JudgedMission, one: Judged) -> Row:
    """The row that says whether all is declared: of kinds, too, that have no row where nothing is declared."""
    mission = judged.analysis.mission
    missing = missing_declarations(mission)
    return Row.without_numbers(
        DECLARATIONS,
        DECLARE,
        "",
        _STATUSES[one.status[0]],
        line=mission.line(("requirements", "declare")),
        reason=phrases.declarations_are_missing([one.key for one in missing]) if missing else None,
        equation="requirements.declare",
        requirement_id=mission.requirement_ids.get(DECLARATIONS.id),
        model=mission.gating_model,
    )


def _why(judged: JudgedMission, one: Judged, row: Row) -> Note:
    """Why a row is not judged by its own numbers."""
    mission, why = judged.analysis.mission, Why(one.why[0])
    if why is Why.NOT_DECLARED_AS_REQUIRED:
        missing = (each for each in missing_declarations(mission) if is_asked_for(one.subject, each))
        return phrases.not_declared_as_required(next(missing).key)
    if why is Why.INPUT_IN_DOUBT:
        doubts = (each for each in input_doubts(mission) if is_in_doubt(one.subject, each.owner, mission))
        return next(doubts).note
    if why is Why.NO_PLACE:
        return unknown_place(judged)
    if why is Why.NOTHING_SPREADS:
        return phrases.nothing_judges("islr")
    said = [row.reason] if row.status == "fail" and row.reason else []  # it is broken, and more of it not judged
    for each in judged.untaken:
        if row.id in each.makers and each.makers[row.id][0]:
            lines = [f"{key}: {_EXAMPLES[key]}" for key in TAKEN_BY[each.kind]]
            parts = float(each.parts[row.id][0]), float(each.total[0])
            said.append(phrases.effect_is_not_judged(each.kind, *parts, lines))
    return said[0].then(*said[1:])


def unknown_place(judged: JudgedMission) -> Note:
    """Say what displaces the image by an amount that no row holds: a random or slow error, a path in doubt."""
    at_random, slow = ([row_id for row_id, is_there in kind if is_there[0]] for kind in judged.misplacing)
    if not slow and not at_random:
        doubts = input_doubts(judged.analysis.mission)
        return doubts[0].note if doubts else NOTHING
    causes = [*(["random errors"] if at_random else []), *(["slow vibration"] if slow else [])]
    cause = f"{' and '.join(causes)} {'move' if at_random else 'moves'}"
    return phrases.place_is_not_known([*at_random, *slow], cause)


def negligible_effects(judged: JudgedMission) -> Iterator[Note]:
    """Say which effects no requirement takes, and are too small for one."""
    for one in judged.untaken:
        if one.is_negligible[0]:
            yield phrases.effect_is_negligible(one.kind, float(one.total[0]), list(TAKEN_BY[one.kind]))


# ---------------------------------------------------------------------- requirements
def requirements_in_words(judged: JudgedMission, waived: Waived) -> tuple[JudgedRequirement, ...]:
    """How every requirement of the only case stands; `waived` are its rows in words, after waivers."""
    return tuple(_entry(state, judged, waived) for state in judged.requirements)


def _entry(state: RequirementState, judged: JudgedMission, waived: Waived) -> JudgedRequirement:
    mission, key = judged.analysis.mission, state.key
    rows = waived.rows
    value = getattr(mission.requirements, key)
    status = _STATUSES[state.status[0]]
    decider = rows[state.decider[0]] if state.decider[0] >= 0 else None
    allowed, reached = _sizes(decider, key, judged.analysis) if decider is not None else (None, None)
    reason: Note | None = None
    if status == "not_evaluated" and (decider is None or decider.status != status or key == "islr"):
        reason = (unknown_place(judged) if key == LOCATION else NOTHING) or phrases.nothing_judges(key)
    elif decider is not None and status not in ("pass", "info"):
        reason = decider.reason
    path = ("requirements", key)
    return JudgedRequirement(
        key=key,
        value=None if key == "declare" else value,
        unit=UNITS[key],
        is_default=path not in mission.places and not mission.is_changed(path),
        status=status,
        allowed=allowed,
        reached=reached,
        utilization=None if decider is None or decider.utilization is None else float(state.utilization[0]),
        row=None if decider is None else decider.id,
        rows=tuple(row.id for row, judges in zip(rows, state.judges[:, 0], strict=True) if judges),
        reason=reason,
        line=mission.line(path),
        waivers=waived.requirements.get(f"mission.{key}", ()),
    )


def _sizes(row: Row, key: str, analysis: Analysis) -> tuple[float | None, float | None]:
    """Size that a row is allowed, and size that it reaches, in the unit of a requirement that it judges."""
    mission, allocation = analysis.mission, analysis.allocation
    if row.declared is None and row.metric != key:
        return None, None
    if row.unit == UNITS[key] and (
        row.subject.kind in (key, QUADRATIC, "spatial_variance", "autofocus_pull_in", "other")
        or (key == "pslr" and row.unit == "dB")
    ):
        return row.allowable, row.declared
    if key == QUADRATIC:
        qpe = row.qpe_full_rad if row.model == "full" else row.qpe_published_rad
        limit = allocation.qpe_limit(row.owner) * allocation.autofocus_gain
        return limit, None if qpe is None else abs(qpe)
    if key == CUBIC:
        return mission.requirements.cubic_phase_error, row.cubic_rad
    if key == LOCATION:
        moved = None if row.displacement_m is None else math.hypot(*row.displacement_m)
        return mission.requirements.location_error, moved
    if key == "islr":
        model = row.model or "full"
        limit, use = spread_limit(mission, allocation, row.owner, model) or 0.0, row.utilization or 0.0
        sizes = [islr_db(rms**2, model, mainlobe_energy(mission)) if rms else None for rms in (limit, limit * use)]
        return sizes[0], sizes[1]
    k = 2 * math.pi / mission.radar.wavelength
    levels = [None if size is None else _echo_db(k * size) for size in (row.allowable, row.declared)]
    return levels[0], levels[1]


def _echo_db(phase: float) -> float | None:
    amplitude = level_of(phase)
    return 20 * math.log10(amplitude) if amplitude else None
