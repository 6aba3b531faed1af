"""Verdicts on the limits of quadratic and cubic phase, on what autofocus makes of them, and on the location."""

import math
from typing import Any

from bisar_budget.analysis.allocation import ROOM, range_walk_cap
from bisar_budget.effects.declared import CUBIC
from bisar_budget.effects.effect import ErrorSource, Subject
from bisar_budget.effects.slow_tones import TONE_PHASE_COUNT
from bisar_budget.effects.vibration import lines_of, unit_of_line
from bisar_budget.findings.images import Verdict
from bisar_budget.geometry import GroundVector
from bisar_budget.phrases import NOTHING, Note
from bisar_budget.ranges.exact_ranges import ExactEffect
from bisar_budget.simulator.collection import CELLS, MAX_CELLS, OVERSAMPLING, RANGE_CELLS
from bisar_budget.simulator.impulse_response import highest, impulse_response, line_at, row_of_peak
from bisar_budget.simulator.phase_history import Errors, NoGroundPointError, PathError, PathSinusoid
from bisar_budget.simulator.point import sinusoids_of
from bisar_budget.verifier import reasons
from bisar_budget.verifier.aperture_reading import READ_CELLS, ApertureReading
from bisar_budget.verifier.study import Responses, Sizes, Study

TOLERANCE = 0.05  # of the budget: nearer than this a limit is confirmed
INSIDE, BEYOND = 0.9, 1.1  # of the limit: through it the phase must grow with the error
FOCUSED_CELLS, FOCUSED_RAD = 2 * CELLS, 12.0  # a phase up to which a response is read in so many cells
_PEAK_CELLS = 3  # of range around the lines that autofocus reads: the peak is between two lines
_SETTLED = 1e-6  # of the requirement of the location
_BESIDE_CELLS = 64  # of smear; beyond, no images are formed on both sides of a limit


def quadratic(study: Study, source: ErrorSource) -> Verdict:
    """Limit of one error."""
    budget, gain = study.allocation.qpe_limit(source.owner), study.allocation.autofocus_gain
    boundary = study.boundary(source, budget)
    if boundary is None:
        return _bound_elsewhere(study, source)
    blank = study.blank(source.id, boundary, source.unit, budget_rad=budget)
    verdict = _judged(study, blank, [(source, boundary)])
    farther = study.boundary(source, gain * budget, is_focused=True) if gain > 1 else None
    if farther is None:
        return verdict
    return verdict._replace(boundary_autofocus=farther, **refocused(study, [(source, farther)], budget))


def slow_vibration(study: Study, of: Subject) -> Verdict:
    """Limit of a vibration below one cycle per aperture: each of its axes alone, in its worst phase.

    The axes of a vector are so large together that by exact ranges they reach the limit, as the phases add up.
    """
    name, entry, budget = of.owner, of.entry or 0, study.allocation.qpe_limit(of.owner)
    mission, tone = study.mission, study.analysis.slow_tones[of.id]
    line, size = lines_of(mission, name)[entry], budget / float(tone.per_metre.judged(1.0)[0])
    blank = study.blank(of.id, size * float(line.per_metre), unit_of_line(mission, name, entry), budget_rad=budget)
    lines = sinusoids_of(mission, name, entry)
    use = float(tone.declared.judged(1.0)[0]) / budget
    if not use or (len(lines) == 1 and lines[0].axis is None):
        lines, use = [PathSinusoid(size, line.frequency)], 1.0
    try:
        worst = [_worst_phase(study, name, one._replace(amplitude=one.amplitude / use)) for one in lines]
        images = [study.images(errors) for errors in worst]
        readings = [study.read(one) for one in images]
    except ValueError as error:
        return _without_image(study, blank, error)
    both = list(zip(images, readings, strict=True))
    measured = [study.equal_loss(*one) for one in both]
    largest = measured.index(max(measured))
    phases = [predicted(one.effect) for one in images]
    summed = {key: math.fsum(one[key] for one in phases) for key in phases[0] if key.endswith("_rad")}
    return blank._replace(
        **(phases[largest] | summed),
        **_of_response(study, *both[largest]),
        measured_qpe_rad=math.fsum(abs(reading.quadratic) for reading in readings),
        measured_equal_loss_qpe_rad=math.fsum(measured),
        verdict=compare(math.fsum(measured) / budget - 1, TOLERANCE),
        reason=reasons.in_its_worst_phase(len(lines)),
    )


def _worst_phase(study: Study, name: str, line: PathSinusoid) -> Errors:
    """The vibration in the phase in which exact ranges lose most of the peak."""
    turned = (line._replace(phase=2 * math.pi * step / TONE_PHASE_COUNT) for step in range(TONE_PHASE_COUNT))
    every = [Errors().of(name, PathError(sinusoids=(one,))) for one in turned]
    return max(every, key=lambda errors: study.collection.effect(errors).equal_loss)


def _bound_elsewhere(study: Study, source: ErrorSource) -> Verdict:
    """Limit of an error that no quadratic phase bounds: by the cubic phase, or by the location."""
    allowed, binding = study.allowed(source)
    size = allowed or 0.0
    blank = study.blank(source.id, size, source.unit)
    requirements = study.mission.requirements
    try:
        images = study.images(study.together([(source, size)], study.worse_sign([(source, size)])))
        reading = study.read(images)
    except ValueError as error:
        return _without_image(study, blank, error)
    blank = blank._replace(**predicted(images.effect), measured_qpe_rad=abs(reading.quadratic))
    if binding == CUBIC and requirements.cubic_phase_error is not None:
        return blank._replace(
            budget_rad=requirements.cubic_phase_error,
            measured_cubic_rad=abs(reading.cubic),
            verdict=compare(abs(reading.cubic) / requirements.cubic_phase_error - 1, TOLERANCE),
            reason=reasons.bound_by_the_cubic_phase(),
        )
    shift = study.shift(images, reading)
    measured = images.effect.moved(shift.displacement)
    required = requirements.location_error or 0.0
    verdict = compare(math.hypot(*measured) / required - 1, TOLERANCE)
    return blank._replace(
        measured_displacement_m=measured,
        verdict=verdict,
        reason=None if verdict == "confirmed" else reasons.image_moves(math.hypot(*measured), required),
    )


def total(study: Study, row_id: str, owner: str) -> Verdict:
    """All declared errors of an owner at once, each with the sign that makes their phases add."""
    budget = study.allocation.qpe_limit(owner)
    blank = study.blank(row_id, budget, "rad", budget_rad=budget)
    if study.mission.allocation.combine != "sum":
        return blank._replace(reason=reasons.root_sum_square_is_of_many_flights())
    sizes = study.summed(study.members(owner), budget)
    if not sizes:
        return blank._replace(reason=reasons.no_quadratic_phase_declared())
    return _judged(study, blank, sizes)


def other(study: Study, source: ErrorSource) -> Verdict:
    """Phase stated as such."""
    budget = study.allocation.qpe_limit(source.owner)
    return study.blank(source.id, budget, source.unit, budget_rad=budget, reason=reasons.phase_without_motion())


def stated(study: Study, row_id: str, limit: float, unit: str) -> Verdict:
    """Effect from elsewhere other than a quadratic phase."""
    return study.blank(row_id, limit, unit, reason=reasons.stated_by_its_effect())


def dispersion(study: Study) -> Verdict:
    """Phase that free electrons bend over the band: images are read over slow time."""
    budget = study.allocation.qpe_total
    blank = study.blank("propagation.dispersion", budget, "rad", budget_rad=budget)
    return blank._replace(reason=reasons.images_are_read_over_slow_time())


def edge(study: Study) -> Verdict:
    """Difference between two places of the scene; what images and exact ranges say of it is in the tests."""
    budget = study.allocation.qpe_total
    blank = study.blank("mission.spatial_variance", budget, "rad", budget_rad=budget)
    return blank._replace(reason=reasons.images_are_of_the_centre())


def cubic(study: Study, requirement: float) -> Verdict:
    """All declared errors scaled together until the gating model's cubic phase reaches the requirement."""
    blank = study.blank("mission.cubic_phase_error", requirement, "rad", budget_rad=requirement)
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
        images = study.images(study.together(sizes, scale), READ_CELLS)
        reading = study.read(images)
    except ValueError as error:
        return _without_image(study, blank, error)
    measured = abs(reading.cubic)
    verdict = compare(measured / requirement - 1, TOLERANCE)
    return blank._replace(**predicted(images.effect), measured_cubic_rad=measured, verdict=verdict)


def pull_in(study: Study, n_pull: float) -> Verdict:
    """A clock error of π·N_pull, which bends no geometry, refocused; no N_pull goes beyond the cap of range walk."""
    phase, budget, radar = math.pi * n_pull, study.allocation.qpe_total, study.mission.radar
    walk = n_pull * radar.bandwidth / radar.center_frequency / 2  # λN/2 over c/B
    blank = study.blank("mission.autofocus_pull_in", phase, "rad", budget_rad=budget)
    clock = next(s for s in study.sources if s.id == "timing.quadratic")
    found = refocused(study, [(clock, phase / abs(clock.effect.qpe))], budget, holds_hidden=False)
    reason = reasons.range_walk(walk, range_walk_cap(study.mission))
    return blank._replace(boundary_autofocus=phase, **found, verdict=found["verdict_autofocus"], reason=reason)


def refocused(study: Study, sizes: Sizes, budget: float, *, holds_hidden: bool = True) -> dict[str, Any]:
    """Form the image at the limit with autofocus and refocus it; hold what is left to the plain budget.

    What band and turn hide counts, unless how far autofocus pulls in is asked alone: rows hold it by themselves.
    """
    try:
        errors = study.together(sizes, study.worse_sign(sizes))
        room = ROOM[study.mission.autofocus.algorithm]
        spread = study.spread(errors, study.collection.effect(errors))
        if room * spread.smear > MAX_CELLS:
            reason = reasons.patch_too_large(room * spread.smear, MAX_CELLS)
            return {"verdict_autofocus": "not_evaluated", "reason_autofocus": reason}
        across = math.ceil(2 * study.shared_lines(spread) / (OVERSAMPLING * spread.finer)) + _PEAK_CELLS
        focused = study.focused(study.images(errors, min(RANGE_CELLS, across), room))
        residual = abs(_read_focused(study, focused).quadratic)
        hidden = focused.effect.hidden if holds_hidden else 0.0  # autofocus corrects nothing of it
        left = math.hypot(residual, hidden)
        peaks = [highest(one.image) for one in (focused.reference, focused.chip)]
        loss = 20 * math.log10(peaks[0] / peaks[1])
    except ValueError as error:
        return {"verdict_autofocus": "not_evaluated", "reason_autofocus": reasons.no_image_formed(str(error))}
    is_met = left <= budget * (1 + TOLERANCE)
    return {
        "measured_residual_qpe_rad": residual,
        "refocused_loss_db": loss,
        "verdict_autofocus": "confirmed" if is_met else "optimistic",
        "reason_autofocus": None if is_met else reasons.autofocus_leaves(left, budget),
    }


def _read_focused(study: Study, focused: Responses) -> ApertureReading:
    """Phase that autofocus left: where little, it is read from the middle of a large patch, else from all of it."""
    small, large = (
        focused._replace(chip=focused.chip.within(cells), reference=focused.reference.within(cells))
        for cells in (FOCUSED_CELLS, MAX_CELLS)
    )
    try:
        reading = study.read(small, is_focused=True)
        if abs(reading.quadratic) < FOCUSED_RAD:
            return reading
    except ValueError:
        pass
    return study.read(large, is_focused=True)


def predicted(effect: ExactEffect) -> dict[str, Any]:
    """Fields of a verdict that exact ranges fill."""
    return {
        "predicted_qpe_rad": abs(effect.quadratic),
        "equal_loss_qpe_rad": effect.equal_loss,
        "predicted_cubic_rad": abs(effect.cubic),
        "displacement_m": effect.displacement,
    }


def _without_image(study: Study, blank: Verdict, error: ValueError) -> Verdict:
    """Say why a limit has no image; one of the published model that leaves no point of the ground is no limit."""
    if isinstance(error, NoGroundPointError) and not study.is_full:
        return blank._replace(verdict="optimistic", reason=reasons.no_image_at_the_limit())
    return blank._replace(reason=reasons.no_image_formed(str(error)))


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
    """Form the images of errors at the limit and on both sides, and hold the phase of equal loss to the budget."""
    budget = blank.budget_rad or 0.0
    by_table = abs(math.fsum(s.effect.qpe * size for s, size in sizes))
    blank = blank._replace(published_qpe_rad=by_table)
    try:
        scale = study.worse_sign(sizes)
        images = study.images(study.together(sizes, scale))
        reading = study.read(images)
    except ValueError as error:
        return _without_image(study, blank, error)
    measured = study.equal_loss(images, reading)
    is_small = images.spread.smear <= _BESIDE_CELLS
    inside, beyond = (_phase(study, sizes, factor * scale) if is_small else None for factor in (INSIDE, BEYOND))
    verdict, remark = _through_the_limit(inside, measured, beyond, budget)
    unusual = reasons.smear_leaves_the_patch(reading.coverage) if reading.coverage < 0.9 else NOTHING
    return blank._replace(
        **predicted(images.effect),
        **_of_response(study, images, reading),
        full_qpe_rad=abs(images.effect.quadratic),
        measured_qpe_rad=abs(reading.quadratic),
        measured_equal_loss_qpe_rad=measured,
        measured_cubic_rad=None,
        measured_inside_rad=inside,
        measured_beyond_rad=beyond,
        displacement_published_m=published_displacement(study, sizes, scale),
        displacement_full_m=images.effect.displacement,
        smear_azimuth_published_rad=(study.geometry.look_azimuth + math.pi / 2) % math.pi,
        verdict=verdict,
        reason=remark.then(unusual) if remark else unusual or None,
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


def _of_response(study: Study, images: Responses, reading: ApertureReading) -> dict[str, Any]:
    """Measures of the response; those that a long smear or a bent patch leaves without value are missing."""
    chip, reference, found = images.chip, images.reference, dict[str, Any]()
    try:
        shift = study.shift(images, reading)
        found["measured_displacement_m"] = images.effect.moved(shift.displacement)
        found["measured_smear_azimuth_rad"] = shift.smear_azimuth
    except ValueError:
        pass
    try:
        clean = impulse_response(reference.cut, reference.spacing[1])
        line = line_at(chip.image, row_of_peak(chip.image))
        response = impulse_response(line, chip.spacing[1], mask_m=clean.mask_m)
    except ValueError:
        return found
    return found | {
        "irw_ratio": response.irw_m / clean.irw_m,
        "peak_loss_db": 20 * math.log10(clean.peak / response.peak),
        "pslr_db": response.pslr_db,
        "islr_db": response.islr_db,
    }


def _phase(study: Study, sizes: Sizes, scale: float) -> float | None:
    """Quadratic phase of equal loss that the image of errors shows; None where there is no image. [rad]"""
    try:
        images = study.images(study.together(sizes, scale), READ_CELLS)
        return study.equal_loss(images, study.read(images))
    except ValueError:
        return None


def _scale_of_cubic(study: Study, sizes: Sizes, scale: float, requirement: float) -> float:
    """Scale at which exact ranges give the cubic phase, from a first guess.

    A `ValueError` says that none was found: the phase goes past the requirement where the point has no image, or
    never reaches it.
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


# ---------------------------------------------------------------------- location
def location(study: Study, requirement: float) -> Verdict:
    """All declared errors scaled together until the gating model has them move the image by the requirement.

    Confirmed if the image, and by (25) each error alone by exact ranges, is where the gating model puts it, to 5 % of
    the requirement. A displacement that only is shorter is conservative; one that goes elsewhere is not.
    """
    blank = study.blank("mission.location_error", requirement, "m")
    sizes = [(s, s.declared or 0.0) for s in study.declared]
    if not sizes:
        return blank._replace(reason=reasons.nothing_moves_the_image())
    rule = "the full model" if study.is_full else "(25)"
    try:
        scale = _scale_of_location(study, sizes, requirement)
        if scale is None:
            degeneracy = study.analysis.published.degeneracy
            why = reasons.displacement_degenerates(degeneracy) if degeneracy else reasons.errors_move_nothing(rule)
            return blank._replace(reason=why)
        by_25 = published_displacement(study, sizes, scale)
        said = study.effect(sizes, scale).displacement if study.is_full else by_25
        images = study.images(study.together(sizes, scale))
        effect = images.effect
        shift = study.shift(images, study.read(images))
    except ValueError as error:
        return blank._replace(reason=reasons.no_image_formed(str(error)))
    assert said is not None
    measured = effect.moved(shift.displacement)
    seen = [("all of them together", said, measured)]
    if not study.is_full:
        # Together, errors may hide each other: the sign each is declared with is not the sign it will fly with.
        for source, size in sizes:
            alone = published_displacement(study, [(source, size)], scale)
            if alone is not None:
                exact = study.effect([(source, size)], scale).displacement
                seen.append((f"{source.id} alone", alone, exact))
    room = TOLERANCE * requirement
    verdict = "confirmed"
    for _, by_rule, is_at in seen:
        if math.dist(by_rule, is_at) > room:
            is_harmless = not study.is_full and verdict != "optimistic" and _is_shorter(by_rule, is_at)
            verdict = "conservative" if is_harmless else "optimistic"
    reason = reasons.places_differ(rule, *_along_and_across(study, said, measured))
    if verdict != "confirmed":
        who, by_rule, is_at = max(seen, key=lambda one: math.dist(*one[1:]))
        reason = reason.then(reasons.rule_misplaces(who, rule, by_rule, is_at))
    return blank._replace(
        **predicted(effect),
        displacement_published_m=by_25,
        displacement_full_m=effect.displacement,
        measured_displacement_m=measured,
        verdict=verdict,
        reason=reason,
    )


def _scale_of_location(study: Study, sizes: Sizes, requirement: float) -> float | None:
    """Scale at which the gating model moves the image by the requirement; None where it moves nothing."""
    if not study.is_full:
        place = published_displacement(study, sizes, 1.0)
        length = math.hypot(*place) if place else 0.0
        return requirement / length if length else None
    full = study.analysis.full
    moves = [full.displacement(source.full, size) or (0.0, 0.0) for source, size in sizes]
    length = math.hypot(math.fsum(m[0] for m in moves), math.fsum(m[1] for m in moves))
    if not length:
        return None
    scale = requirement / length
    for _ in range(20):
        found = math.hypot(*study.effect(sizes, scale).displacement)
        if not found or abs(found / requirement - 1) < _SETTLED:
            break
        scale *= min(2.0, max(0.5, requirement / found))
    return scale


def _along_and_across(study: Study, a: GroundVector, b: GroundVector) -> GroundVector:
    """Distance of two displacements along x′ and y′. [m]"""
    look = study.geometry.look_azimuth
    cosine, sine = math.cos(look), math.sin(look)
    east, north = b[0] - a[0], b[1] - a[1]
    return abs(east * cosine + north * sine), abs(north * cosine - east * sine)


def _is_shorter(said: GroundVector, is_at: GroundVector) -> bool:
    """Whether a displacement is so much shorter than the one said that no sum of such errors is longer.

    Of all signs of several displacements, the longest sum is at least 2/π of the sum of their lengths: so much of
    what lies beside their lines is made up for by what is missing along them.
    """
    length = math.hypot(*said)
    if not length:
        return False
    along = abs(is_at[0] * said[0] + is_at[1] * said[1]) / length**2
    beside = abs(is_at[0] * said[1] - is_at[1] * said[0]) / length**2
    return along + math.pi / 2 * beside <= 1
