"""Verdicts on the limits of quadratic and cubic phase, and on what autofocus makes of them."""

import math
from typing import Any

import numpy as np

from bisar_budget.analysis.allocation import range_walk_cap
from bisar_budget.analysis.vibration_limits import slow_limits
from bisar_budget.budget.doubts import COARSE_CELL_RAD, phase_across_a_cell
from bisar_budget.budget.pull_in import ROOM
from bisar_budget.effects.declared import CUBIC
from bisar_budget.effects.effect import ErrorSource
from bisar_budget.effects.vibration import Line
from bisar_budget.findings.images import Verdict
from bisar_budget.geometry import GroundVector
from bisar_budget.phrases import Note
from bisar_budget.simulate.collection import CELLS, MAX_CELLS, OVERSAMPLING, RANGE_CELLS, Chip, Errors
from bisar_budget.simulate.exact import ExactEffect, NoGroundPointError
from bisar_budget.simulate.impulse_response import highest, impulse_response
from bisar_budget.simulate.phase_history import PathError, PathSinusoid
from bisar_budget.verify import reasons
from bisar_budget.verify.aperture_reading import READ_CELLS, ApertureReading
from bisar_budget.verify.shift import measured_shift
from bisar_budget.verify.study import Sizes, Study

TOLERANCE = 0.05  # of the budget: nearer than this a limit is confirmed
INSIDE, BEYOND = 0.9, 1.1  # of the limit: through it the phase must grow with the error
FOCUSED_CELLS, FOCUSED_RAD = 2 * CELLS, 12.0  # a phase up to which a response is read in so many cells
_PEAK_CELLS = 3  # of range around the lines that autofocus reads: the peak is between two lines
_BESIDE_CELLS = 64  # of smear; beyond, no images are formed on both sides of a limit


def quadratic(study: Study, source: ErrorSource) -> Verdict:
    """Limit of one error."""
    budget, gain = study.allocation.qpe_limit(source.owner), study.allocation.autofocus_gain
    boundary = study.boundary(source, budget)
    if boundary is None:
        return _bound_elsewhere(study, source)
    blank = Verdict(id=source.id, model=study.model, boundary_error=boundary, unit=source.unit, budget_rad=budget)
    verdict = _judged(study, blank, [(source, boundary)])
    farther = study.boundary(source, gain * budget) if gain > 1 else None
    if farther is None:
        return verdict
    return verdict._replace(boundary_autofocus=farther, **refocused(study, [(source, farther)], budget))


def slow_vibration(study: Study, row_id: str, name: str, line: Line) -> Verdict:
    """Limit of a vibration below one cycle per aperture, in its worst phase: its turning point at mid-aperture."""
    allocation, budget = study.allocation, study.allocation.qpe_limit(name)
    limits = slow_limits(study.mission, allocation, name, line.frequency * study.collection.aperture_time)
    size = limits.quadratic / allocation.autofocus_gain
    blank = Verdict(id=row_id, model=study.model, boundary_error=size, unit="m", budget_rad=budget)
    try:
        both = [
            Errors().of(name, PathError(sinusoids=(PathSinusoid(size, line.frequency, phase),)))
            for phase in (math.pi / 2, -math.pi / 2)
        ]
        effects = [study.collection.effect(errors) for errors in both]
        errors, effect = max(zip(both, effects, strict=True), key=lambda one: abs(one[1].quadratic))
        chip, reference = study.chips(errors, effect)
        reading = study.read(errors, effect, chip, reference)
    except (ValueError, np.linalg.LinAlgError) as error:
        return _without_image(study, blank, error)
    measured = abs(reading.quadratic)
    return blank._replace(
        **predicted(effect),
        **_of_response(chip, reference, effect, reading),
        measured_qpe_rad=measured,
        verdict=compare(measured / budget - 1, TOLERANCE),
        reason=reasons.in_its_worst_phase(),
    )


def _bound_elsewhere(study: Study, source: ErrorSource) -> Verdict:
    """Limit of an error that no quadratic phase bounds: by the cubic phase, or by the location."""
    allowed, binding = study.allowed(source)
    size = allowed or 0.0
    blank = Verdict(id=source.id, model=study.model, boundary_error=size, unit=source.unit)
    requirements = study.mission.requirements
    try:
        errors = study.together([(source, study.worse_sign([(source, size)], 1.0) * size)])
        effect = study.collection.effect(errors)
        chips = study.chips(errors, effect)
        reading = study.read(errors, effect, *chips)
    except (ValueError, np.linalg.LinAlgError) as error:
        return _without_image(study, blank, error)
    blank = blank._replace(**predicted(effect), measured_qpe_rad=abs(reading.quadratic))
    if binding == CUBIC and requirements.cubic_phase_error is not None:
        return blank._replace(
            budget_rad=requirements.cubic_phase_error,
            measured_cubic_rad=abs(reading.cubic),
            verdict=compare(abs(reading.cubic) / requirements.cubic_phase_error - 1, TOLERANCE),
            reason=reasons.bound_by_the_cubic_phase(),
        )
    shift = measured_shift(*chips, reading)
    measured = moved(effect.displacement, shift.displacement)
    required = requirements.location_error or 0.0
    pixel = min(chips[0].spacing)
    excess = math.hypot(*measured) - required
    verdict = "confirmed" if abs(excess) <= pixel / 2 else compare(excess, 0.0)
    return blank._replace(
        measured_displacement_m=measured,
        verdict=verdict,
        reason=None if verdict == "confirmed" else reasons.image_moves(math.hypot(*measured), required),
    )


def total(study: Study, row_id: str, owner: str) -> Verdict:
    """All declared errors of an owner at once, each with the sign that makes their phases add."""
    budget = study.allocation.qpe_limit(owner)
    blank = Verdict(id=row_id, model=study.model, boundary_error=budget, unit="rad", budget_rad=budget)
    if study.mission.allocation.combine != "sum":
        return blank._replace(reason=reasons.root_sum_square_is_of_many_flights())
    sizes = study.summed(study.members(owner), budget)
    if not sizes:
        return blank._replace(reason=reasons.no_quadratic_phase_declared())
    return _judged(study, blank, sizes)


def other(study: Study, source: ErrorSource) -> Verdict:
    """Phase stated as such."""
    budget = study.allocation.qpe_limit(source.owner)
    return Verdict(
        id=source.id,
        model=study.model,
        boundary_error=budget,
        unit=source.unit,
        budget_rad=budget,
        reason=reasons.phase_without_motion(),
    )


def edge(study: Study) -> Verdict:
    """Difference between two places of the scene; what images and exact ranges say of it is in the tests."""
    budget = study.allocation.qpe_total
    blank = Verdict(
        id="mission.spatial_variance", model=study.model, boundary_error=budget, unit="rad", budget_rad=budget
    )
    return blank._replace(reason=reasons.images_are_of_the_centre())


def cubic(study: Study, requirement: float) -> Verdict:
    """All declared errors scaled together until the gating model's cubic phase reaches the requirement."""
    blank = Verdict(
        id="mission.cubic_phase_error",
        model=study.model,
        boundary_error=requirement,
        unit="rad",
        budget_rad=requirement,
    )
    sizes = [(s, s.declared or 0.0) for s in study.declared]
    if not sizes:
        return blank._replace(reason=reasons.no_motion_declared())
    by_model = abs(math.fsum((s.full if study.is_full else s.effect).cubic * size for s, size in sizes))
    if not by_model:
        return blank._replace(reason=reasons.no_cubic_phase_declared(study.model))
    try:
        scale = requirement / by_model
        if study.is_full:
            scale = _scale_of_cubic(study, sizes, scale, requirement)
        errors = study.together(sizes, scale)
        effect = study.collection.effect(errors)
        reading = study.read(errors, effect, *study.chips(errors, effect, READ_CELLS))
    except (ValueError, np.linalg.LinAlgError) as error:
        return _without_image(study, blank, error)
    measured = abs(reading.cubic)
    return blank._replace(
        **predicted(effect), measured_cubic_rad=measured, verdict=compare(measured / requirement - 1, TOLERANCE)
    )


def pull_in(study: Study, n_pull: float) -> Verdict:
    """A clock error of π·N_pull, which bends no geometry, refocused; no N_pull goes beyond the cap of range walk."""
    phase, budget, radar = math.pi * n_pull, study.allocation.qpe_total, study.mission.radar
    walk = n_pull * radar.bandwidth / radar.center_frequency / 2  # λN/2 over c/B
    blank = Verdict(
        id="mission.autofocus_pull_in", model=study.model, boundary_error=phase, unit="rad", budget_rad=budget
    )
    clock = next(s for s in study.sources if s.id == "timing.quadratic")
    found = refocused(study, [(clock, phase / abs(clock.effect.qpe))], budget)
    reason = reasons.range_walk(walk, range_walk_cap(study.mission))
    return blank._replace(boundary_autofocus=phase, **found, verdict=found["verdict_autofocus"], reason=reason)


def refocused(study: Study, sizes: Sizes, budget: float) -> dict[str, Any]:
    """Form the image at the limit with autofocus and refocus it; hold what is left to the plain budget."""
    try:
        errors = study.together(sizes, study.worse_sign(sizes, 1.0))
        effect = study.collection.effect(errors)
        room = ROOM[study.mission.autofocus.algorithm]
        smear = study.spread(errors, effect).smear
        if room * smear > MAX_CELLS:
            reason = reasons.patch_too_large(room * smear, MAX_CELLS)
            return {"verdict_autofocus": "not_evaluated", "reason_autofocus": reason}
        across = math.ceil(2 * study.shared_lines(errors, effect) / OVERSAMPLING) + _PEAK_CELLS
        chip, reference = study.chips(errors, effect, min(RANGE_CELLS, across), room)
        focused = study.focused(errors, effect, chip)
        residual = abs(_read_focused(study, errors, effect, focused, reference).quadratic)
        peaks = [highest(one.image) for one in (reference, focused)]
        loss = 20 * math.log10(peaks[0] / peaks[1])
    except (ValueError, np.linalg.LinAlgError) as error:
        return {"verdict_autofocus": "not_evaluated", "reason_autofocus": reasons.no_image_formed(str(error))}
    is_met = residual <= budget * (1 + TOLERANCE)
    return {
        "measured_residual_qpe_rad": residual,
        "refocused_loss_db": loss,
        "verdict_autofocus": "confirmed" if is_met else "optimistic",
        "reason_autofocus": None if is_met else reasons.autofocus_leaves(residual, budget),
    }


def _read_focused(
    study: Study, errors: Errors, effect: ExactEffect, focused: Chip, reference: Chip
) -> ApertureReading:
    """Phase that autofocus left: where little, it is read from the middle of a large patch, else from all of it."""
    small, large = ([chip.within(cells) for chip in (focused, reference)] for cells in (FOCUSED_CELLS, MAX_CELLS))
    try:
        reading = study.read(errors, effect, small[0], small[1], is_focused=True)
        if abs(reading.quadratic) < FOCUSED_RAD:
            return reading
    except (ValueError, np.linalg.LinAlgError):
        pass
    return study.read(errors, effect, large[0], large[1], is_focused=True)


def predicted(effect: ExactEffect) -> dict[str, Any]:
    """Fields of a verdict that exact ranges fill."""
    return {
        "predicted_qpe_rad": abs(effect.quadratic),
        "predicted_cubic_rad": abs(effect.cubic),
        "displacement_m": effect.displacement,
    }


def _without_image(study: Study, blank: Verdict, error: ValueError | np.linalg.LinAlgError) -> Verdict:
    """Say why a limit has no image; one of the published model that leaves no point of the ground is no limit."""
    if isinstance(error, NoGroundPointError) and not study.is_full:
        return blank._replace(
            verdict="optimistic",
            reason=reasons.no_image_at_the_limit(),
        )
    return blank._replace(reason=reasons.no_image_formed(str(error)))


def moved(place: GroundVector, by: GroundVector) -> GroundVector:
    """Sum of two displacements."""
    return (place[0] + by[0], place[1] + by[1])


def compare(excess: float, tolerance: float) -> str:
    """Say what an excess over the budget means for the limit."""
    if abs(excess) <= tolerance:
        return "confirmed"
    return "optimistic" if excess > 0 else "conservative"


def published_displacement(study: Study, sizes: Sizes, scale: float) -> GroundVector | None:
    """Displacement of errors together by (25); None where it has none."""
    published = study.analysis.published  # (25)
    moves = [published.displacement(source.effect, scale * size) for source, size in sizes]
    if any(move is None for move in moves):
        return None
    return (math.fsum(m[0] for m in moves if m), math.fsum(m[1] for m in moves if m))


def _judged(study: Study, blank: Verdict, sizes: Sizes) -> Verdict:
    """Form the images of errors at the limit and on both sides, and hold the phase to the budget."""
    budget = blank.budget_rad or 0.0
    by_table = abs(math.fsum(s.effect.qpe * size for s, size in sizes))
    blank = blank._replace(published_qpe_rad=by_table)
    try:
        scale = study.worse_sign(sizes, 1.0)
        errors = study.together(sizes, scale)
        effect = study.collection.effect(errors)
        chip, reference = study.chips(errors, effect)
        reading = study.read(errors, effect, chip, reference)
    except (ValueError, np.linalg.LinAlgError) as error:
        return _without_image(study, blank, error)
    measured = abs(reading.quadratic)
    is_small = study.spread(errors, effect).smear <= _BESIDE_CELLS
    inside, beyond = (_phase(study, sizes, factor * scale) if is_small else None for factor in (INSIDE, BEYOND))
    verdict, remark = _through_the_limit(inside, measured, beyond, budget)
    return blank._replace(
        **predicted(effect),
        **_of_response(chip, reference, effect, reading),
        full_qpe_rad=abs(effect.quadratic),
        measured_qpe_rad=measured,
        measured_cubic_rad=None,
        measured_inside_rad=inside,
        measured_beyond_rad=beyond,
        displacement_published_m=published_displacement(study, sizes, scale),
        displacement_full_m=effect.displacement,
        smear_azimuth_published_rad=(study.geometry.look_azimuth + math.pi / 2) % math.pi,
        verdict=verdict,
        reason=_both(remark, _remark(study, reading.coverage)),
    )


def _through_the_limit(
    inside: float | None, measured: float, beyond: float | None, budget: float
) -> tuple[str, Note | None]:
    """Verdict on a phase at a limit, measured inside and beyond it where images are formed, and what is unusual.

    A limit promises that no smaller error has more phase. Where the phase falls towards it, the larger one counts,
    and none is near enough to the budget to be confirmed. Beyond the limit a phase may fall: that is said.
    """
    verdict = compare(measured / budget - 1, TOLERANCE)
    falls_inside = inside is not None and inside >= measured
    if inside is not None and falls_inside:
        verdict = compare(inside / budget - 1, 0.0)
    if not falls_inside and (beyond is None or beyond > measured):
        return verdict, None
    places = ((inside, f" at {INSIDE:g} of the limit"), (measured, " at it"), (beyond, f" at {BEYOND:g}"))
    return verdict, reasons.phase_does_not_grow([(phase, where) for phase, where in places if phase is not None])


def _both(first: Note | None, second: Note | None) -> Note | None:
    return first.then(second or "") if first else second


def _of_response(chip: Chip, reference: Chip, effect: ExactEffect, reading: ApertureReading) -> dict[str, Any]:
    """Measures of the response; those that a long smear or a bent patch leaves without value are missing."""
    found: dict[str, Any] = {}
    try:
        shift = measured_shift(chip, reference, reading)
        found["measured_displacement_m"] = moved(effect.displacement, shift.displacement)
        found["measured_smear_azimuth_rad"] = shift.smear_azimuth
    except (ValueError, np.linalg.LinAlgError):
        pass
    try:
        clean = impulse_response(reference.cut, reference.spacing[1])
        response = impulse_response(chip.cut, chip.spacing[1], mask_m=clean.mask_m)
    except ValueError:
        return found
    return found | {
        "irw_ratio": response.irw_m / clean.irw_m,
        "peak_loss_db": 20 * math.log10(clean.peak / response.peak),
        "pslr_db": response.pslr_db,
        "islr_db": response.islr_db,
    }


def _phase(study: Study, sizes: Sizes, scale: float) -> float | None:
    """Quadratic phase that the image of errors shows; None where there is no image."""
    errors: Errors = study.together(sizes, scale)
    try:
        effect = study.collection.effect(errors)
        chips = study.chips(errors, effect, READ_CELLS)
        return abs(study.read(errors, effect, *chips).quadratic)
    except (ValueError, np.linalg.LinAlgError):
        return None


def _remark(study: Study, coverage: float) -> Note | None:
    """Say what of the image is unusual: a smear beyond the patch, or range cells that absorb phase."""
    if coverage < 0.9:
        return reasons.smear_leaves_the_patch(coverage)
    cell = phase_across_a_cell(study.analysis)
    if cell > COARSE_CELL_RAD:
        return reasons.range_cells_absorb_phase(cell)
    return None


def _scale_of_cubic(study: Study, sizes: Sizes, scale: float, requirement: float) -> float:
    """Scale at which exact ranges give the cubic phase, from a first guess.

    Raises
    ------
    ValueError
        None was found: the phase goes past the requirement where the point has no image, or never reaches it.
    """
    low, high = 0.0, math.inf  # scales with less phase, and with more or without a point
    for _ in range(60):
        try:
            found = abs(study.effect(sizes, scale).cubic)
        except ValueError:
            found = math.inf
        if abs(found / requirement - 1) < 1e-4:
            return scale
        low, high = (scale, high) if found < requirement else (low, min(high, scale))
        ahead = scale * min(4.0, max(0.25, requirement / found)) if 0 < found < math.inf else low
        scale = ahead if low < ahead < high else (low + high) / 2 if high < math.inf else 2 * scale
    raise ValueError("no scale of the declared errors has this cubic phase")
