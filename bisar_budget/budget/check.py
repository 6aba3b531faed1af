"""Hold a mission's declared errors to its allocated budget: one row for each, and what the rows add up to."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import date
from functools import partial
from typing import TYPE_CHECKING

from bisar_budget.budget import vibration
from bisar_budget.budget.allocation import Allocation, allocate
from bisar_budget.budget.correlation import (
    Correlated,
    combined_displacement,
    combined_phase,
    correlated_errors,
    correlation_notes,
    displacement_parts,
    phase_parts,
    unused_correlations,
)
from bisar_budget.budget.findings import FileWarning, MissionFindings, Resolution, Row
from bisar_budget.budget.pull_in import pull_in_caps
from bisar_budget.budget.sources import (
    ErrorSource,
    FullGround,
    ImagePlane,
    error_sources,
    full_ground,
    image_plane,
)
from bisar_budget.budget.validity import Beyond, FirstOrder, collection_notes, of_members
from bisar_budget.budget.waivers import apply_waivers
from bisar_budget.constants import SPEED_OF_LIGHT, UTILIZATION_TOLERANCE
from bisar_budget.errors import KeyPath
from bisar_budget.geometry import GroundVector
from bisar_budget.mission.model import Mission

if TYPE_CHECKING:
    from bisar_budget.budget.scene import SceneEdge

NO_REQUIREMENT = "no requirement in the file: computed, not judged"


def check_mission(mission: Mission, today: date) -> MissionFindings:
    """Check one mission.

    Parameters
    ----------
    mission : Mission
        As loaded.
    today : date
        Day on which waivers are judged, UTC.

    Returns
    -------
    MissionFindings
        Rows in the order of the contract, declared or not.
    """
    geometry = mission.geometry
    ground = full_ground(mission, geometry)
    plane = image_plane(geometry) if mission.allocation.model == "published" else ground.plane
    sources = error_sources(mission, geometry, ground)
    allocation = allocate(mission, sources)
    first_order = FirstOrder(mission, geometry, ground)
    errors = list(_error_rows(mission, allocation, sources, plane, first_order))
    judged = [
        *errors,
        *_vibration_rows(mission, allocation),
        *_aggregate_rows(mission, allocation, sources, errors, plane, first_order),
    ]
    scene = None
    if mission.scene.radius is not None:
        scene, row = _scene_row(mission, allocation, sources)
        judged.append(row)
    rows, warnings = apply_waivers(judged, mission, today)
    resolution = Resolution(
        range=geometry.range_resolution(mission.radar.bandwidth, SPEED_OF_LIGHT),
        cross_range=geometry.cross_range_resolution(mission.radar.wavelength, mission.collection.aperture_time),
    )
    return MissionFindings(
        mission=mission,
        file=mission.file,
        name=mission.name,
        model=mission.allocation.model,
        combine=mission.allocation.combine,
        coverage_factor=mission.allocation.coverage_factor,
        wavelength=mission.radar.wavelength,
        geometry=geometry,
        aperture_time=mission.collection.aperture_time,
        scene_radius=mission.scene.radius,
        resolution=resolution,
        allocation=allocation,
        rows=tuple(rows),
        warnings=(
            *_unknown_requirement_ids(mission, rows),
            *warnings,
            *_unused_correlations(mission),
            *pull_in_caps(mission, resolution),
            *_nothing_declared(rows),
        ),
        scene=scene,
        notes=(*collection_notes(mission, geometry, ground), *_unused_keys(mission)),
    )


def _error_rows(
    mission: Mission,
    allocation: Allocation,
    sources: Sequence[ErrorSource],
    plane: ImagePlane,
    first_order: FirstOrder,
) -> Iterator[Row]:
    combine = mission.allocation.combine
    info = f"combine is {combine}: the aggregate decides" if combine != "each" else ""
    gain = allocation.autofocus_gain
    owners = ("transmitter", "receiver", "clock", "mission")
    limits = {owner: allocation.qpe_limit(owner) * gain for owner in owners}
    model, warn_above = mission.allocation.model, mission.allocation.warn_above
    for source in sources:
        limit, signed = limits[source.owner], source.declared
        by_table, by_full = abs(source.effect.qpe), source.full.qpe
        published, full = _quotient(limit, by_table), _quotient(limit, abs(by_full))
        if signed is None:
            yield _undeclared(mission, source, published, full, first_order, limit)
            continue
        declared = abs(signed)
        qpe_published, qpe_full = by_table * declared, by_full * signed
        notes, displacement, exact = source.notes, None, None
        over = doubt = ""
        if source.is_motion:
            displacement = plane.displacement(source.effect if model == "published" else source.full, signed)
            if displacement is None:
                notes = (*notes, plane.degeneracy)
            beyond = first_order.beyond(source)
            if beyond is not None:
                exact = beyond.exact and beyond.qpe
                notes = (*notes, beyond.against(qpe_full))
                doubt = beyond.doubt(qpe_full, limit)
        allowable = _gating(model, published, full)
        if of_allowable := first_order.allowable_note(source, allowable, full, limit):
            notes = (*notes, of_allowable)
        if qpe_published > limit or abs(qpe_full) > limit:
            qpe = abs(source.qpe(model))
            doubt = _doubt(source, model, limit, first_order.ground) or doubt
            needed = allocation.n_pull_needed(qpe, source.owner)
            of_model = source.equation_by(model)
            over = (
                f"QPE {qpe:.3g} rad, {limit:.3g} rad allowed ({of_model}); "
                f"passes with autofocus from n_pull {needed:g}"
            )
        utilization, margin, status, reason, notes = _status(
            warn_above, declared, allowable, gain, over, doubt, _no_limit(source, model), "", info, True, False, notes
        )
        yield Row._make(  # twice as quick as by keyword, and there are a dozen in every mission
            (
                source.id,
                "quadratic_phase_error",
                source.unit,
                declared,
                allowable,
                published,
                full,
                qpe_published,
                qpe_full,
                displacement,
                utilization,
                margin,
                status,
                mission.line(source.path),
                reason or None,
                notes,
                source.equation_by(model),
                mission.requirement_ids.get(source.id),
                source.evidence,
                source.is_independent,
                exact,
                None,
            )
        )


def _no_limit(source: ErrorSource, model: str) -> str:
    return source.no_limit if model == "published" else "no quadratic phase to first order"


def _gating(model: str, published: float | None, full: float | None) -> float | None:
    """Allowable by the model that gates; the strictest takes the smaller, no limit being infinite."""
    if model == "published":
        return published
    if model == "full" or published is None:
        return full
    return published if full is None else min(published, full)


def _doubt(source: ErrorSource, model: str, limit: float, ground: FullGround) -> str:
    """Say that the model that does not gate fails the error, and why it thinks otherwise; else nothing."""
    if model == "published":
        qpe = abs(source.qpe("full"))
        if qpe <= limit * (1 + UTILIZATION_TOLERANCE):
            return ""
        moved = ground.moved(source.full)
        turned = source.full.qpe - moved - source.effect.qpe
        if source.id == "mission.terrain":
            cause = "a bistatic image defocuses on a wrong height"
        elif ".position." in source.id:
            cause = "the line of sight turns over a position error, and its displacement defocuses"
        elif abs(moved) >= abs(turned):
            cause = "the displaced response has a quadratic phase of its own"
        else:
            cause = "at a squint the range is not constant"
        return f"the full model says fail: QPE {qpe:.3g} rad, {limit:.3g} rad allowed; {cause}"
    qpe = abs(source.qpe("published"))
    if model == "full" and qpe > limit * (1 + UTILIZATION_TOLERANCE):
        return f"the published model says fail: QPE {qpe:.3g} rad, {limit:.3g} rad allowed ({source.equation})"
    return ""


def _undeclared(
    mission: Mission,
    source: ErrorSource,
    published: float | None,
    full: float | None,
    first_order: FirstOrder,
    limit: float,
) -> Row:
    """Row of an error that the file does not declare, as `_judged` would make it: half of all rows are such."""
    allowable = _gating(mission.allocation.model, published, full)
    notes = source.notes
    if of_allowable := first_order.allowable_note(source, allowable, full, limit):
        notes = (*notes, of_allowable)
    return Row._make(
        (
            source.id,
            "quadratic_phase_error",
            source.unit,
            None,
            allowable,
            published,
            full,
            None,
            None,
            None,
            None,
            None,
            "not_declared",
            mission.line(source.path),
            _no_limit(source, mission.allocation.model) if allowable is None else None,
            notes,
            source.equation_by(mission.allocation.model),
            mission.requirement_ids.get(source.id),
            source.evidence,
            source.is_independent,
            None,
            None,
        )
    )


def _quotient(numerator: float, denominator: float) -> float | None:
    """Divide; None where there is no finite quotient: a zero coefficient or a vanishing error."""
    quotient = numerator / denominator if denominator else math.inf
    return quotient if math.isfinite(quotient) else None


def _vibration_rows(mission: Mission, allocation: Allocation) -> Iterator[Row]:
    model = mission.allocation.model
    for case in vibration.cases(mission, allocation):
        allowed = case.limits
        yield _judged(
            mission,
            id=case.id,
            metric=case.metric,
            unit="m",
            declared=case.declared,
            allowable=None if allowed is None else allowed.by(model),
            path=case.path,
            equation=case.equation,
            no_limit=case.missing,
            not_evaluated=case.not_evaluated,
            is_declared=case.declared is not None,
            over=case.over,
            doubt=case.doubt,
            limits=allowed or (None, None),
            qpe_full=case.qpe,
            evidence=case.evidence,
            notes=case.notes,
        )._replace(published_margin_db=None if allowed is None else allowed.margin_db)


def _aggregate_rows(
    mission: Mission,
    allocation: Allocation,
    sources: Sequence[ErrorSource],
    errors: Sequence[Row],  # of the sources, in their order
    plane: ImagePlane,
    first_order: FirstOrder,
) -> Iterator[Row]:
    combine, model = mission.allocation.combine, mission.allocation.model
    groups = correlated_errors(mission)
    notes = correlation_notes(combine, groups) if combine != "each" else ()
    stated = [source for source in sources if source.declared is not None]
    declared = [source for source in stated if source.is_independent]
    if combine != "each":
        yield from _qpe_aggregates(mission, allocation, declared, groups, first_order.found)
    # `each` looks at single rows, those along the scene's axes included.
    motion = [source for source in (stated if combine == "each" else declared) if source.is_motion]
    cubic_limit, cubic_doubt = mission.requirements.cubic_phase_error, ""
    other = {"published": "full", "full": "published"}.get(model)
    if cubic_limit is not None and other is not None and motion:
        cubic = combined_phase(motion, "cubic", other, combine, groups)
        if cubic > cubic_limit * (1 + UTILIZATION_TOLERANCE):
            cubic_doubt = f"the {other} model says fail: {cubic:.3g} rad, {cubic_limit:.3g} rad allowed"
    found = first_order.found
    cubic_notes: tuple[str, ...] = ()
    if found and motion:
        by_exact = combined_phase(_with_exact(motion, found), "cubic", "full", combine, groups)
        cubic_notes, exact_doubt = of_members(found, motion, by_exact, cubic_limit, "rad")
        cubic_doubt = cubic_doubt or exact_doubt
    cubic_phase = combined_phase(motion, "cubic", model, combine, groups) if motion else None
    over = _exceeded(
        "cubic phase", cubic_phase, cubic_limit, "rad", lambda: phase_parts(motion, "cubic", model, combine, groups)
    )
    yield _judged(
        mission,
        id="mission.cubic_phase_error",
        metric="cubic_phase_error",
        unit="rad",
        declared=cubic_phase,
        allowable=mission.requirements.cubic_phase_error,
        path=("requirements", "cubic_phase_error"),
        equation="Table I, cubic column" if model == "published" else "full model",
        no_limit=NO_REQUIREMENT,
        info="" if mission.requirements.cubic_phase_error is not None else NO_REQUIREMENT,
        over=f"{over}; autofocus gain does not apply",
        doubt=cubic_doubt,
        notes=(*notes, *cubic_notes),
    )
    counted = {source.id for source in motion}
    known = [(row.id, row.displacement_m) for row in errors if row.displacement_m is not None and row.id in counted]
    moved = combined_displacement(known, combine, groups) if motion and len(known) == len(motion) else None
    if model == "strictest" and moved is not None:
        by_25 = image_plane(mission.geometry)
        published = [(s.id, by_25.displacement(s.effect, s.declared or 0.0)) for s in motion]
        moves = [(row_id, move) for row_id, move in published if move is not None]
        moved = max(moved, combined_displacement(moves, combine, groups))
    location_notes: tuple[str, ...] = ()
    location_doubt = _location_doubt(mission, motion, first_order.ground.plane, groups)
    if found and motion:
        exact_moves = [(s.id, _moved_exactly(s, found, first_order.ground.plane)) for s in motion]
        location_notes, exact_doubt = of_members(
            found,
            motion,
            combined_displacement(exact_moves, combine, groups),
            mission.requirements.location_error,
            "m",
        )
        location_doubt = location_doubt or exact_doubt
    yield _judged(
        mission,
        id="mission.location_error",
        metric="location_error",
        unit="m",
        declared=moved,
        allowable=mission.requirements.location_error,
        path=("requirements", "location_error"),
        equation="(25)" if model == "published" else "full model",
        no_limit=NO_REQUIREMENT,
        not_evaluated=plane.degeneracy if model == "published" else "",
        is_declared=bool(motion),
        info="" if mission.requirements.location_error is not None else NO_REQUIREMENT,
        over=_exceeded(
            "displacement of the image",
            moved,
            mission.requirements.location_error,
            "m",
            lambda: [(row_id, math.hypot(*move)) for row_id, move in displacement_parts(known, combine, groups)],
        ),
        doubt=location_doubt,
        notes=(*notes, *location_notes),
    )
    if allocation.n_pull is not None:
        pull_in = math.pi * allocation.n_pull
        total = math.fsum(abs(s.qpe(model)) for s in declared) if declared else None
        pull_in_notes: tuple[str, ...] = ()
        pull_in_doubt = ""
        if found:
            by_exact = math.fsum(abs(s.qpe("full")) for s in _with_exact(declared, found))
            pull_in_notes, pull_in_doubt = of_members(found, declared, by_exact, pull_in, "rad")
        by_other = math.fsum(abs(s.qpe(other)) for s in declared) if other is not None else 0.0
        if by_other > pull_in * (1 + UTILIZATION_TOLERANCE):
            pull_in_doubt = f"the {other} model says beyond it: QPE {by_other:.3g} rad, {pull_in:.3g} rad allowed"
        yield _judged(
            mission,
            id="mission.autofocus_pull_in",
            metric="quadratic_phase_error",
            unit="rad",
            declared=total,
            allowable=pull_in,
            path=("autofocus", "n_pull"),
            equation="Section VI",
            never_fails=True,
            over=_exceeded("QPE", total, pull_in, "rad", lambda: [(s.id, abs(s.qpe(model))) for s in declared])
            + "; autofocus corrects one total, not each error its own",
            doubt=pull_in_doubt,
            notes=pull_in_notes,
        )


def _location_doubt(
    mission: Mission, motion: Sequence[ErrorSource], by_full: ImagePlane, groups: Sequence[Correlated]
) -> str:
    """Say that the model that does not gate fails the location; else nothing."""
    model, limit = mission.allocation.model, mission.requirements.location_error
    if limit is None or model == "strictest" or not motion:
        return ""
    other, plane = ("full", by_full) if model == "published" else ("published", image_plane(mission.geometry))
    moves = [(s.id, plane.displacement(s.by(other), s.declared or 0.0)) for s in motion]
    known = [(row_id, move) for row_id, move in moves if move is not None]  # (25) may have none at all
    moved = combined_displacement(known, mission.allocation.combine, groups) if known else 0.0
    if moved <= limit * (1 + UTILIZATION_TOLERANCE):
        return ""
    return f"the {other} model says fail: {moved:.3g} m, {limit:.3g} m allowed"


def _exceeded(
    what: str, size: float | None, limit: float | None, unit: str, members: Callable[[], Sequence[tuple[str, float]]]
) -> str:
    """Say how large an aggregate is, what is allowed, and which of its members is the largest; nothing if inside."""
    if size is None or limit is None or size <= limit:
        return ""
    row_id, largest = max(members(), key=lambda member: abs(member[1]))
    return f"{what} {size:.3g} {unit}, {limit:.3g} {unit} allowed; largest: {row_id}, {abs(largest):.3g} {unit}"


def _with_exact(members: Sequence[ErrorSource], found: Mapping[str, Beyond]) -> list[ErrorSource]:
    """The errors, those beyond first order with effects that give what exact ranges give."""
    return [found[s.id].in_place_of(s) if s.id in found else s for s in members]


def _moved_exactly(source: ErrorSource, found: Mapping[str, Beyond], plane: ImagePlane) -> GroundVector:
    """Displacement by the full model, beyond first order by exact ranges. [m]"""
    if source.id in found:
        return found[source.id].displacement
    return plane.displacement(source.full, source.declared or 0.0) or (0.0, 0.0)


def _scene_row(
    mission: Mission, allocation: Allocation, sources: Sequence[ErrorSource]
) -> tuple["SceneEdge | None", Row]:
    """Row of the scene's edge; to the published model an error is the same all over the scene."""
    from bisar_budget.budget.scene import scene_edge

    combine, total = mission.allocation.combine, allocation.qpe_total
    single = [s for s in sources if combine == "each" or s.is_independent]
    edge = scene_edge(mission, mission.geometry, allocation, single)
    is_published = mission.allocation.model == "published"
    difference: float | None = None
    doubt, notes = "", tuple[str, ...]()
    if edge is not None and not edge.degeneracy:
        difference, doubt, notes = edge.difference, edge.doubt, edge.notes(total)
        if is_published and difference > total * (1 + UTILIZATION_TOLERANCE):
            doubt = f"the full model says fail: {difference:.3g} rad, {total:.3g} rad allowed"
    row = _judged(
        mission,
        id="mission.spatial_variance",
        metric="quadratic_phase_error",
        unit="rad",
        declared=difference,
        allowable=None if is_published else total,
        path=("scene", "radius"),
        equation="full model",
        no_limit="to the published model an error is the same all over the scene",
        not_evaluated="" if edge is None else edge.degeneracy,
        is_declared=edge is not None,
        over="quadratic phase at the scene's edge and at its centre differ by more than the total budget",
        doubt=doubt,
        limits=(None, total),
        qpe=None if difference is None else 0.0,
        qpe_full=difference,
        notes=notes,
    )
    return edge, row


def _qpe_aggregates(
    mission: Mission,
    allocation: Allocation,
    declared: Sequence[ErrorSource],
    groups: Sequence[Correlated],
    found: Mapping[str, Beyond],
) -> Iterator[Row]:
    combine, model, gain = mission.allocation.combine, mission.allocation.model, allocation.autofocus_gain
    owners = ["transmitter", "receiver", "mission"]
    if allocation.qpe.clock is not None:
        owners.insert(2, "clock")  # else it counts with the receiver
    for owner in owners:
        members = [s for s in declared if owner == "mission" or allocation.qpe.includes(s.owner, owner)]
        published, full = (
            combined_phase(members, "qpe", of, combine, groups) if members else None for of in ("published", "full")
        )
        qpe = published if model == "published" else full
        if model == "strictest" and members:
            qpe = combined_phase(members, "qpe", model, combine, groups)
        limit = allocation.qpe_limit(owner) * gain
        over = ""
        if qpe is not None:
            parts = partial(phase_parts, members, "qpe", model, combine, groups)
            exceeded = _exceeded("QPE", qpe, limit, "rad", parts)
            over = f"{exceeded}; passes with autofocus from n_pull {allocation.n_pull_needed(qpe, owner):g}"
        other = {"published": ("full", full), "full": ("published", published)}.get(model)
        doubt = ""
        if other is not None and other[1] is not None and other[1] > limit * (1 + UTILIZATION_TOLERANCE):
            doubt = f"the {other[0]} model says fail: {other[1]:.3g} rad, {limit:.3g} rad allowed"
        exact_notes: tuple[str, ...] = ()
        exact_doubt = ""
        if found:
            by_exact = combined_phase(_with_exact(members, found), "qpe", "full", combine, groups)
            exact_notes, exact_doubt = of_members(found, members, by_exact, limit, "rad")
        yield _judged(
            mission,
            id=f"{'timing' if owner == 'clock' else owner}.quadratic_phase_error",
            metric="quadratic_phase_error",
            unit="rad",
            declared=qpe,
            allowable=limit,
            path={"mission": ("platforms",), "clock": ("timing_error",)}.get(
                owner, ("platforms", owner, "motion_error")
            ),
            equation="sum of the rows" if combine == "sum" else "root-sum-square of the rows",
            gain=gain,
            over=over,
            doubt=doubt or exact_doubt,
            limits=(limit, limit),
            qpe=published,
            qpe_full=full,
            notes=(
                *correlation_notes(combine, [g for g in groups if owner in (g.platform, "mission")]),
                *exact_notes,
            ),
        )


def _judged(
    mission: Mission,
    *,
    id: str,
    metric: str,
    unit: str,
    declared: float | None,  # magnitude
    allowable: float | None,  # autofocus gain included
    path: KeyPath,  # of the declared value in the mission file
    equation: str,
    gain: float = 1.0,  # of autofocus, within `allowable`
    over: str = "",  # what to say when over the limit
    doubt: str = "",  # what the model that does not gate says against a pass
    no_limit: str = "",  # why there is no allowable
    not_evaluated: str = "",  # why a declared value cannot be judged
    info: str = "",  # why the row judges nothing
    is_declared: bool = True,  # with `declared` None: something is declared, but its effect has no value
    never_fails: bool = False,
    limits: tuple[float | None, float | None] | None = None,  # by the published and the full model; None: one rule
    qpe: float | None = None,  # by the published model
    qpe_full: float | None = None,
    displacement: GroundVector | None = None,
    evidence: str | None = None,
    is_independent: bool = True,
    notes: tuple[str, ...] = (),
) -> Row:
    """Judge one row; see `_status`."""
    utilization, margin, status, reason, notes = _status(
        mission.allocation.warn_above,
        declared,
        allowable,
        gain,
        over,
        doubt,
        no_limit,
        not_evaluated,
        info,
        is_declared,
        never_fails,
        notes,
    )
    return Row(  # in the order of its fields: keywords cost as much as the judgement
        id,
        metric,
        unit,
        declared,
        allowable,
        *(limits or (allowable, None)),
        qpe,
        qpe_full,
        displacement,
        utilization,
        margin,
        status,
        mission.line(path),
        reason or None,
        notes,
        equation,
        mission.requirement_ids.get(id),
        evidence,
        is_independent,
    )


def _status(
    warn_above: float,
    declared: float | None,
    allowable: float | None,
    gain: float,
    over: str,
    doubt: str,
    no_limit: str,
    not_evaluated: str,
    info: str,
    is_declared: bool,
    never_fails: bool,
    notes: tuple[str, ...],
) -> tuple[float | None, float | None, str, str, tuple[str, ...]]:
    """Judge what is declared against what is allowed: utilization, margin, status, reason and notes.

    The status is the first that applies, in the order of the contract; waivers come after.
    """
    utilization = margin = None
    reason = no_limit if allowable is None else ""
    if declared is not None:
        utilization = 0.0 if allowable is None else declared / allowable
        headroom = None if allowable is None else _quotient(allowable, declared)
        margin = None if headroom is None else headroom - 1
    if declared is None and not (is_declared and not_evaluated):
        status = "not_declared"
    elif info:
        status, reason = "info", reason or info
    elif not_evaluated or utilization is None:
        status, reason = "not_evaluated", not_evaluated
    elif utilization > 1 + UTILIZATION_TOLERANCE:
        status, reason = ("warn" if never_fails else "fail"), over
    elif doubt:
        status, reason = "warn", doubt
    elif utilization * gain > 1 + UTILIZATION_TOLERANCE:
        status, reason = "pass_with_autofocus", f"{utilization * gain:.3g} times the limit without autofocus"
        if utilization > warn_above:
            notes = (*notes, f"uses {100 * utilization:.3g} % of the limit with autofocus")
    elif utilization > warn_above:
        status, reason = "warn", f"above {100 * warn_above:g} % of the limit"
    else:
        status = "pass"
    return utilization, margin, status, reason, notes


def _unknown_requirement_ids(mission: Mission, rows: Sequence[Row]) -> Iterator[FileWarning]:
    known = {row.id for row in rows} if mission.requirement_ids else set()
    for row_id in mission.requirement_ids:
        if row_id not in known:
            yield FileWarning(
                line=mission.line(("requirement_ids", row_id)),
                message=f"requirement_ids: {row_id} is the id of no row",
            )


def _nothing_declared(rows: Sequence[Row]) -> Iterator[FileWarning]:
    if all(row.status == "not_declared" for row in rows):
        yield FileWarning(line=None, message="no error is declared: nothing was judged")


def _unused_correlations(mission: Mission) -> Iterator[FileWarning]:
    return (FileWarning(line, message) for line, message in unused_correlations(mission))


def _unused_keys(mission: Mission) -> Iterator[str]:
    """Say which keys that the file gives have no part in this check."""
    keys = {
        "collection.pulses": mission.collection.pulses is not None,
        "simulation": mission.simulation is not None,
    }
    given = [key for key, is_given in keys.items() if is_given]
    if given:
        yield f"{', '.join(given)}: no part in the published model's limits"
