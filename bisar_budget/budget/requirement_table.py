"""Report rows and report entries of requirements for one case, with their text and numbers.

The entry of a requirement gives its limit, the value that the mission reaches, and the row that decides its status.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from bisar_budget import phrases
from bisar_budget.analysis.analysis import Case
from bisar_budget.analysis.spread import islr_db, mainlobe_energy, spread_limit
from bisar_budget.analysis.totals import PERCENTILES
from bisar_budget.analysis.vibration_limits import level_of, tone_limits
from bisar_budget.budget.aggregates import PULL_IN
from bisar_budget.budget.declarations import (
    DECLARATIONS,
    Missing,
    is_asked_for,
    missing_declarations,
    shifted_figures,
)
from bisar_budget.budget.doubts import input_doubts, is_in_doubt
from bisar_budget.budget.half_causes import half_cause_of, half_causes
from bisar_budget.budget.judged_mission import JudgedMission
from bisar_budget.budget.judged_requirements import (
    EXAMPLES,
    REQUIREMENT_UNITS,
    TAKEN_BY,
    RequirementState,
)
from bisar_budget.budget.judged_rows import FamilyRow, Judged, Why, statuses
from bisar_budget.budget.waivers import Waived
from bisar_budget.effects.declared import LIMITING_REQUIREMENTS, LOCATION, MODELS, QUADRATIC
from bisar_budget.error_kinds.registry import kind_of
from bisar_budget.findings.requirement import DecidingShare, JudgedRequirement
from bisar_budget.findings.row import DECLARE, AppliedWaiver, Row, holding, in_order
from bisar_budget.mission.model import id_of_requirement
from bisar_budget.phrases import NOTHING, Note
from bisar_budget.random_vector import RandomVector


# ---------------------------------------------------------------------- rows
def rows_in_words(judged: JudgedMission, case: Case) -> Iterator[Row]:
    """Yield the report rows of one case, before waivers, in the order of the JSON output."""
    families: dict[tuple[str, str], FamilyRow] = {
        (model, judged_row.judged.subject.id): judged_row
        for model, family in judged.families.items()
        for judged_row in family
        if judged_row.is_there is True or judged_row.is_there[case.place]
    }
    for judged_row in judged.before:
        if judged_row.metric == DECLARE:
            yield _declarations(case, judged_row)
            continue
        model = MODELS[judged_row.model[case.place]]
        family = families.get((model, judged_row.subject.id))
        if family is None:  # the row exists only in other cases
            continue
        row, status = family.in_words(case, model), statuses(judged_row.status[case.place])
        changes: dict[str, Any] = {"model": model, "status": status, "is_unjudged": status == "not_evaluated"}
        if status != row.status and status == "info":
            changes |= {"utilization": None, "margin": None}
        row = row._replace(**changes)
        yield row._replace(reason=_why(judged, case, judged_row, row)) if judged_row.why[case.place] else row


def _declarations(case: Case, judged_row: Judged) -> Row:
    """Build the row that judges whether the file declares every kind of error that it is required to declare.

    It also covers kinds of error that have no row of their own.
    """
    mission = case.mission
    missing, shifted = missing_declarations(mission), shifted_figures(mission)
    return Row(
        DECLARATIONS,
        DECLARE,
        unit="",
        status=statuses(judged_row.status[case.place]),
        line=mission.line(("requirements", "declare")),
        reason=_declarations_missing(missing) if missing else None,
        equation="requirements.declare",
        requirement_ids=mission.requirement_ids.get(DECLARATIONS.id, ()),
        model=mission.gating_model,
        is_unjudged=bool(missing),
        remarks=tuple(
            phrases.note("declared-off-its-source", key=judged_row.key, level=judged_row.level, off=judged_row.off)
            for judged_row in shifted
        ),
    )


def _declarations_missing(missing: Sequence[Missing]) -> Note:
    """Write a note that lists the required errors that the file does not declare.

    Errors that the file does not mention come first. They are followed by errors for which the file gives only one of
    two necessary entries, for example a lever arm without an attitude error.
    """
    halves = [
        phrases.not_declared_as_required(declaration.key, declaration.lacks)
        for declaration in missing
        if declaration.lacks
    ]
    keys = [declaration.key for declaration in missing if not declaration.lacks]
    if not keys:
        return halves[0].then(*halves[1:])
    return phrases.declarations_are_missing(keys).then(*halves)


def _why(judged: JudgedMission, case: Case, judged_row: Judged, row: Row) -> Note:
    """Explain the status of a row if this status does not follow from the numbers of the row."""
    mission, why = case.mission, Why(judged_row.why[case.place])
    if why is Why.NOT_DECLARED_AS_REQUIRED:
        missing = (each for each in missing_declarations(mission) if is_asked_for(judged_row.subject, each))
        first = next(missing)
        return phrases.not_declared_as_required(first.key, first.lacks)
    if why is Why.INPUT_IN_DOUBT:
        doubts = input_doubts(mission)
        reasons = [each.note for each in doubts if is_in_doubt(judged_row.subject, each.owner, mission, each.state)]
        return reasons[0].then(*reasons[1:])
    if why is Why.NO_PLACE:
        return unknown_place(judged, case)
    if why is Why.AIR_STAYS:
        return judged.air.reason(case, row.id)
    if why is Why.HALF_A_CAUSE:
        halves = [half.note for half in half_causes(mission) if half.holds(judged_row.subject)]
        return halves[0].then(*halves[1:])
    if why is Why.NOTHING_SPREADS:
        return phrases.nothing_judges("islr")
    reasons = [row.reason] if row.status == "fail" and row.reason else []  # fails, and an effect is not judged
    for each in judged.untaken:
        if row.id in each.makers and each.makers[row.id][case.place]:
            lines = [f"{key}: {EXAMPLES[key]}" for key in TAKEN_BY[each.effect]]
            sizes = case.number(each.parts[row.id]), case.number(each.total)
            reasons.append(phrases.effect_is_not_judged(each.effect, *sizes, lines))
    return reasons[0].then(*reasons[1:])


def unknown_place(judged: JudgedMission, case: Case) -> Note:
    """Explain why errors displace the image by an amount that no row limits; empty if no cause is found.

    Possible causes are clocks that were never set, and an inaccurate path.
    """
    clocks = [row_id for row_id, is_there in judged.unplaced.items() if is_there[case.place]]
    if clocks:
        return phrases.note("clocks-are-not-set", row_ids=clocks)
    doubts = [doubt for doubt in input_doubts(case.mission) if not doubt.is_phase]
    return doubts[0].note if doubts else NOTHING


_OWNERS_OF_ROWS = {PULL_IN: "autofocus", "spatial_variance": "scene", "dispersion": "band"}  # by kind of row


def negligible_effects(judged: JudgedMission, case: Case) -> Iterator[Note]:
    """Yield a note for each negligible effect that no requirement limits."""
    for effect in judged.untaken:
        if effect.is_negligible[case.place]:
            yield phrases.effect_is_negligible(
                effect.effect, case.number(effect.total), list(TAKEN_BY[effect.effect])
            )
    yield from judged.air.note(case)


# ---------------------------------------------------------------------- requirements
def requirements_in_words(judged: JudgedMission, case: Case, waived: Waived) -> tuple[JudgedRequirement, ...]:
    """Build the report entries of all judged requirements in one case.

    `waived` holds the report rows of the case, with waivers applied.
    """
    rows = {row.id: row for row in waived.rows}
    of_all = [rows.get(judged_row.subject.id) for judged_row in judged.before]  # None: only other cases have the row
    return tuple(_entry(state, judged, case, of_all, waived) for state in judged.requirements)


def _entry(
    state: RequirementState, judged: JudgedMission, case: Case, rows: Sequence[Row | None], waived: Waived
) -> JudgedRequirement:
    mission, key = case.mission, state.key
    value = None if key == DECLARE else getattr(mission.requirements, key)
    status, decider_index = statuses(state.status[case.place]), state.decider[case.place]
    decider, user = (rows[index] if index >= 0 else None for index in (decider_index, state.user[case.place]))
    is_open = bool(state.is_unjudged[case.place])
    utilization = case.number(state.utilization)  # not finite if the point has no image with the error
    has_use = user is not None and user.utilization is not None and math.isfinite(utilization)
    use = utilization if has_use and not is_open else None
    reason: Note | None = None
    if is_open and (decider is None or not decider.is_unjudged):
        reason = (unknown_place(judged, case) if key == LOCATION else NOTHING) or (
            judged.air.reason_of_requirement(case, key) or half_cause_of(mission, key) or phrases.nothing_judges(key)
        )
    elif decider is not None and status not in ("pass", "info"):
        reason = decider.reason
    judges = [row for row, does_judge in zip(rows, state.judges[:, case.place], strict=True) if row and does_judge]
    path = ("requirements", key)
    requirement = JudgedRequirement(
        key=key,
        value=value,
        unit=REQUIREMENT_UNITS[key],
        is_default=path not in mission.places and not mission.is_changed(path),
        status=status,
        allowed=value,
        reached=None if is_open else _total(key, judged, case, rows),
        utilization=use,
        row=None if decider is None else decider.id,
        rows=tuple(row.id for row in judges),
        reason=reason,
        line=mission.line(path),
        waivers=_waivers(status, waived.requirements.get(f"mission.{key}", ()), judges),
        is_unjudged=is_open,
        share=None if user is None or is_open else _share(user, key, case, use),
        autofocus_gain=case.allocation.autofocus_gain if key == QUADRATIC else None,
        use_row=None if user is None or use is None else user.id,
        requirement_ids=mission.requirement_ids.get(id_of_requirement(key), ()),
        confidence=mission.requirements.confidence_of(key),
    )
    is_distributed = not is_open and key in LIMITING_REQUIREMENTS
    if not is_distributed:
        return requirement
    model = next((row.model for row in rows if row and row.id == f"mission.{key}" and row.model), "")
    return _with_distribution(requirement, judged, case, model or next(iter(judged.families)))


def _with_distribution(
    requirement: JudgedRequirement, judged: JudgedMission, case: Case, model: str
) -> JudgedRequirement:
    """Add the distribution of the quantity that a requirement limits to the requirement.

    It is the distribution by the model that judges the sum of the errors, of all declared errors together, whatever
    the mission's rule. The requirement is returned unchanged if no image forms with a declared error, or if no error
    is declared. The percentiles of a quadratic phase are those before autofocus, and its probability is that with
    autofocus.
    """
    key, totals = requirement.key, judged.totals
    together = judged.analysis.together(model)
    if not (together.phases or together.is_placed):
        return requirement
    of_all = together.moved("rss") if key == LOCATION else together.judged(together.phases, "rss")
    if not math.isfinite(case.number(of_all)):
        return requirement
    vector, limit = totals.of_all(model, key, case.place), getattr(case.mission.requirements, key)
    if not vector.is_finite:
        return requirement
    requirement = requirement._replace(percentiles=_percentiles(vector))
    if limit is not None:
        gain = case.allocation.autofocus_gain if key == QUADRATIC else 1.0
        with_gain = vector if gain == 1 else totals.vector(model, key, lambda owner: True, case.place, gain)
        requirement = requirement._replace(probability=with_gain.probability(limit * gain))
    if key == LOCATION:
        east, north = (case.number(component) for component in case.geometry.range_gradient)
        along = np.array((east, north)) / math.hypot(east, north)
        across = np.array((-along[1], along[0]))
        requirement = requirement._replace(
            percentiles_range=_percentiles(vector.along(along)),
            percentiles_azimuth=_percentiles(vector.along(across)),
        )
    return requirement


_PERCENTILE_NAMES = tuple(f"{100 * confidence:g}" for confidence in PERCENTILES)


def _percentiles(vector: RandomVector) -> dict[str, float]:
    """Lengths that a random vector does not exceed with each of the reported probabilities, by their percent."""
    return dict(zip(_PERCENTILE_NAMES, vector.quantiles(PERCENTILES), strict=True))


def _waivers(
    status: str, of_requirement: Sequence[AppliedWaiver], judges: Sequence[Row]
) -> tuple[AppliedWaiver, ...]:
    """List the waivers of a waived requirement: its own waivers, and the waivers of the rows that judge it."""
    return holding(status, in_order([*of_requirement, *(waiver for row in judges for waiver in row.waived_by)]))


def _total(key: str, judged: JudgedMission, case: Case, rows: Sequence[Row | None]) -> float | None:
    """Return the value that the mission reaches for a requirement; None if there is no such value.

    The value is the declared size in the mission's row for this requirement, in the unit of the requirement. If the
    mission has no row for the quadratic phase, the value is the largest quadratic phase [rad] of a single error.
    """
    row_of_mission = next((row for row in rows if row is not None and row.id == f"mission.{key}"), None)
    if row_of_mission is not None and key != DECLARE:
        return row_of_mission.declared
    if key != QUADRATIC:
        return None
    totals = [
        together.judged(together.phases, gain=1.0) for together in map(judged.analysis.together, judged.families)
    ]
    largest = case.number(np.max(totals, axis=0))
    return largest if math.isfinite(largest) else None


def _share(row: Row, key: str, case: Case, utilization: float | None) -> DecidingShare | None:
    """Return the share of a requirement that a row may use; None if the row may use the full requirement.

    `key` is the key of the requirement. `utilization` is copied to the result.
    """
    owner = _OWNERS_OF_ROWS.get(row.subject.kind)
    if key == QUADRATIC and owner is not None:
        return DecidingShare(
            owner=owner,
            allowed=row.allowable,
            reached=row.declared,
            utilization=utilization,
        )
    if row.owner == "mission" or key not in (QUADRATIC, "pslr", "islr"):
        return None
    allowed, reached = _sizes(row, key, case)
    if allowed is None and reached is None:
        return None
    return DecidingShare(owner=row.owner, allowed=allowed, reached=reached, utilization=utilization)


def _sizes(row: Row, key: str, case: Case) -> tuple[float | None, float | None]:
    """Return the share of a requirement that is allotted to the owner of a row, and the value that the row reaches.

    The owner is a part of the system, such as a platform (`Subject.owner`). `key` is the key of the requirement. Both
    numbers are in the unit of the requirement, [rad] or [dB], and do not include the autofocus gain. A number that is
    not available is None.
    """
    mission, allocation = case.mission, case.allocation
    if key == QUADRATIC:
        qpe = row.qpe_published_rad
        if row.model == "full":
            qpe = row.qpe_full_rad if row.equal_loss_qpe_rad is None else row.equal_loss_qpe_rad
        return allocation.qpe_limit(row.owner), None if qpe is None else abs(qpe)
    if row.unit == "dB" and (row.subject.facts is kind_of(key) or key == "pslr"):
        return row.allowable, row.declared
    if key == "islr":
        model = row.model or "full"
        limit, use = spread_limit(mission, allocation, row.owner, model) or 0.0, row.utilization or 0.0
        sizes = [islr_db(rms**2, model, mainlobe_energy(mission)) if rms else None for rms in (limit, limit * use)]
        return sizes[0], sizes[1]
    limits = tone_limits(mission, allocation)[1].get(row.owner)
    if limits is None:
        return None, None
    phase = 2 * math.pi / mission.radar.wavelength * float(limits.by(row.model or "full"))
    return _echo_db(phase), None if row.utilization is None else _echo_db(phase * row.utilization)


def _echo_db(phase: float) -> float | None:
    amplitude = level_of(phase)
    return 20 * math.log10(amplitude) if amplitude else None
