"""Hold a mission's declared errors to its allocated budget: one row for each, and what the rows add up to."""

from collections.abc import Iterator, Sequence
from datetime import date
from typing import TYPE_CHECKING

from bisar_budget.budget import vibration
from bisar_budget.budget.aggregates import aggregate_rows
from bisar_budget.budget.allocation import Allocation, allocate
from bisar_budget.budget.correlation import unused_correlations
from bisar_budget.budget.effects import ErrorSource, FullGround, ImagePlane, full_ground, image_plane
from bisar_budget.budget.findings import FileWarning, MissionFindings, Resolution, Row
from bisar_budget.budget.judgement import judged, judgement, quotient
from bisar_budget.budget.pull_in import pull_in_caps
from bisar_budget.budget.required import with_required
from bisar_budget.budget.sources import error_sources
from bisar_budget.budget.validity import FirstOrder, collection_notes
from bisar_budget.budget.waivers import apply_waivers
from bisar_budget.constants import SPEED_OF_LIGHT, UTILIZATION_TOLERANCE
from bisar_budget.mission.model import Mission
from bisar_budget.units import format_limit

if TYPE_CHECKING:
    from bisar_budget.budget.scene import SceneEdge


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
    unwaived = [
        *errors,
        *_vibration_rows(mission, allocation),
        *aggregate_rows(mission, allocation, sources, errors, plane, first_order),
    ]
    scene = None
    if mission.scene.radius is not None:
        scene, row = _scene_row(mission, allocation, sources)
        unwaived.append(row)
    rows, warnings = apply_waivers(with_required(unwaived, mission), mission, today)
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
        document=mission.document,
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
        published, full = quotient(limit, by_table), quotient(limit, abs(by_full))
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
                f"QPE {qpe:.3g} rad, {format_limit(limit, 'rad')} allowed ({of_model}); "
                f"passes with autofocus from n_pull {needed:g}"
            )
        utilization, margin, status, reason, notes = judgement(
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
                None,
                None,
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
        return f"the full model says fail: QPE {qpe:.3g} rad, {format_limit(limit, 'rad')} allowed; {cause}"
    qpe = abs(source.qpe("published"))
    if model == "full" and qpe > limit * (1 + UTILIZATION_TOLERANCE):
        allowed = f"{format_limit(limit, 'rad')} allowed ({source.equation})"
        return f"the published model says fail: QPE {qpe:.3g} rad, {allowed}"
    return ""


def _undeclared(
    mission: Mission,
    source: ErrorSource,
    published: float | None,
    full: float | None,
    first_order: FirstOrder,
    limit: float,
) -> Row:
    """Row of an error that the file does not declare, as `judged` would make it: half of all rows are such."""
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
            None,
            None,
            None,
        )
    )


def _vibration_rows(mission: Mission, allocation: Allocation) -> Iterator[Row]:
    model = mission.allocation.model
    for case in vibration.cases(mission, allocation):
        allowed = case.limits
        yield judged(
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
            published_margin_db=None if allowed is None else allowed.margin_db,
        )


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
            doubt = f"the full model says fail: {difference:.3g} rad, {format_limit(total, 'rad')} allowed"
    row = judged(
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
