"""Verification of the limits on quadratic phase (with and without autofocus), cubic phase, and location error."""

import math

from bisar_budget import phrases
from bisar_budget.analysis.allocation import ROOM, range_walk_cap
from bisar_budget.effects.declared import CUBIC
from bisar_budget.effects.effect import ErrorSource, Subject, subject
from bisar_budget.effects.slow_tones import TONE_PHASE_COUNT
from bisar_budget.effects.vibration import lines_of, unit_of_line
from bisar_budget.error_kinds.clock_kinds import TIMING_KIND
from bisar_budget.findings.images import Verdict
from bisar_budget.geometry import GroundVector
from bisar_budget.phrases import NOTHING, Note
from bisar_budget.ranges.exact_ranges import ExactEffect
from bisar_budget.simulator.collection import CUT_CELLS, MAX_CELLS, OVERSAMPLING_FACTOR, RANGE_CELLS
from bisar_budget.simulator.impulse_response import highest, impulse_response, line_at, row_of_peak
from bisar_budget.simulator.phase_history import Errors, NoGroundPointError, PathError, PathSinusoid
from bisar_budget.simulator.point import sinusoids_of
from bisar_budget.verifier.aperture_reading import READ_CELLS, ApertureReading
from bisar_budget.verifier.study import Responses, Sizes, Study, VerdictFields

TOLERANCE_FRACTION = 0.05  # largest relative deviation from the budget at which a limit is confirmed
INSIDE_FRACTION, BEYOND_FACTOR = 0.9, 1.1  # of the limit; between these sizes the phase must grow with the error
FOCUSED_CELLS, FOCUSED_RAD = 2 * CUT_CELLS, 12.0  # of a small patch, and the largest phase that is read in it
_PEAK_CELLS = 3  # additional range cells, because the peak may lie between two lines
_LOCATION_FRACTION = 1e-6  # relative tolerance when errors are scaled to the location requirement
_MAX_SMEAR_CELLS = 64  # with a longer smear, images are formed only at the limit and not beside it


def quadratic(study: Study, source: ErrorSource) -> Verdict:
    """Verify the limit that the quadratic phase sets on the size of an error, with and without autofocus.

    If the quadratic phase of the error never reaches the budget, the limit that is set by its cubic phase or by its
    displacement is verified instead.
    """
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


def slow_vibration(study: Study, vibration: Subject) -> Verdict:
    """Verify the limit that is set by the quadratic phase of a vibration with less than one cycle per aperture.

    An image is formed for each axis, with vibration only along this axis and with the worst starting phase. The
    phases measured in these images are added. For a vibration along several axes, the amplitudes are scaled until the
    sum of the phases computed from exact ranges reaches the limit.
    """
    name, entry, budget = vibration.owner, vibration.entry or 0, study.allocation.qpe_limit(vibration.owner)
    mission, tone = study.mission, study.analysis.slow_tones[vibration.id]
    line, size = lines_of(mission, name)[entry], budget / float(tone.per_metre.judged(1.0)[0])
    blank = study.blank(
        vibration.id, size * float(line.per_metre), unit_of_line(mission, name, entry), budget_rad=budget
    )
    lines = sinusoids_of(mission, name, entry)
    use = float(tone.declared.judged(1.0)[0]) / budget
    if not use or (len(lines) == 1 and lines[0].axis is None):
        lines, use = [PathSinusoid(size, float(line.frequency))], 1.0
    try:
        worst = [_worst_phase(study, name, sine._replace(amplitude=sine.amplitude / use)) for sine in lines]
        images = [study.images(errors) for errors in worst]
        readings = [study.read(image) for image in images]
    except ValueError as error:
        return _without_image(study, blank, error)
    readings_of_images = list(zip(images, readings, strict=True))
    measured = [study.equal_loss(*pair) for pair in readings_of_images]
    largest = measured.index(max(measured))
    phases = [predicted(image.effect) for image in images]
    summed = {key: math.fsum(fields[key] for fields in phases) for key in phases[0] if key.endswith("_rad")}
    return blank._replace(
        **(phases[largest] | summed),
        **_of_response(study, *readings_of_images[largest]),
        measured_qpe_rad=math.fsum(abs(reading.quadratic) for reading in readings),
        measured_equal_loss_qpe_rad=math.fsum(measured),
        verdict=compare(math.fsum(measured) / budget - 1, TOLERANCE_FRACTION),
        reason=phrases.in_its_worst_phase(len(lines)),
    )


def _worst_phase(study: Study, name: str, line: PathSinusoid) -> Errors:
    """Return a vibration with the starting phase that reduces the peak of the response most.

    The reduction of the peak is computed from exact ranges. `name` is the vibrating platform, and `line` is the
    vibration with an arbitrary starting phase.
    """
    lines = (line._replace(phase=2 * math.pi * step / TONE_PHASE_COUNT) for step in range(TONE_PHASE_COUNT))
    candidates = [Errors().of(name, PathError(sinusoids=(shifted,))) for shifted in lines]
    return max(candidates, key=lambda errors: study.collection.effect(errors).equal_loss)


def _bound_elsewhere(study: Study, source: ErrorSource) -> Verdict:
    """Verify the limit on an error if the limit is set by the cubic phase or the displacement of the error."""
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
            verdict=compare(abs(reading.cubic) / requirements.cubic_phase_error - 1, TOLERANCE_FRACTION),
            reason=phrases.note("bound-by-the-cubic-phase"),
        )
    shift = study.shift(images, reading)
    measured = images.effect.moved(shift.displacement)
    required = requirements.location_error or 0.0
    verdict = compare(math.hypot(*measured) / required - 1, TOLERANCE_FRACTION)
    return blank._replace(
        measured_displacement_m=measured,
        verdict=verdict,
        reason=None
        if verdict == "confirmed"
        else phrases.note("image-moves", moved=math.hypot(*measured), allowed=required),
    )


def total(study: Study, row_id: str, owner: str) -> Verdict:
    """Verify the limit on the sum of the quadratic phases of all declared errors of an owner, such as a platform.

    The signs of the errors are chosen so that their phases add. The verdict is `not_evaluated` if
    `allocation.combine` is not `sum`, or if the errors have no quadratic phase.
    """
    budget = study.allocation.qpe_limit(owner)
    blank = study.blank(row_id, budget, "rad", budget_rad=budget)
    if study.mission.allocation.combine != "sum":
        return blank._replace(reason=phrases.note("root-sum-square-is-of-many-flights"))
    sizes = study.summed(study.members(owner), budget)
    if not sizes:
        return blank._replace(reason=phrases.note("no-quadratic-phase-declared"))
    return _judged(study, blank, sizes)


def other(study: Study, source: ErrorSource) -> Verdict:
    """Return the verdict `not_evaluated` for an error that the mission file states as a phase and not as a motion."""
    budget = study.allocation.qpe_limit(source.owner)
    return study.blank(source.id, budget, source.unit, budget_rad=budget, reason=phrases.note("phase-without-motion"))


def stated(study: Study, row_id: str, limit: float, unit: str) -> Verdict:
    """Return the verdict `not_evaluated` for an error of which the mission file states only the effect.

    The effect is, for example, an ISLR or a displacement, but not a quadratic phase.
    """
    return study.blank(row_id, limit, unit, reason=phrases.note("stated-by-its-effect"))


def dispersion(study: Study) -> Verdict:
    """Return the verdict `not_evaluated` for dispersion, which is the phase over the band due to free electrons.

    The phase of an image is measured over slow time, so the images cannot show dispersion.
    """
    budget = study.allocation.qpe_total
    blank = study.blank("propagation.dispersion", budget, "rad", budget_rad=budget)
    return blank._replace(reason=phrases.note("images-are-read-over-slow-time"))


def edge(study: Study) -> Verdict:
    """Return the verdict `not_evaluated` for the phase difference between the centre and the edge of the scene.

    The images show only the scene centre. This difference is compared with images only in the tests of the package.
    """
    budget = study.allocation.qpe_total
    blank = study.blank("mission.spatial_variance", budget, "rad", budget_rad=budget)
    return blank._replace(reason=phrases.note("images-are-of-the-centre"))


def cubic(study: Study, requirement: float) -> Verdict:
    """Verify the limit on the cubic phase of all declared errors together.

    The errors are scaled by a common factor until their cubic phase, computed by the model that decides the verdict,
    reaches `requirement` [rad].
    """
    blank = study.blank("mission.cubic_phase_error", requirement, "rad", budget_rad=requirement)
    sizes = [(s, s.declared or 0.0) for s in study.declared]
    if not sizes:
        return blank._replace(reason=phrases.note("no-motion-declared"))
    by_model = abs(math.fsum((s.full if study.is_full else s.effect).cubic * size for s, size in sizes))
    if not by_model:
        return blank._replace(reason=phrases.note("no-cubic-phase-declared", model=study.model))
    try:
        scale = requirement / by_model
        if study.is_full:
            scale = _scale_of_cubic(study, sizes, scale, requirement)
        images = study.images(study.together(sizes, scale), READ_CELLS)
        reading = study.read(images)
    except ValueError as error:
        return _without_image(study, blank, error)
    measured = abs(reading.cubic)
    verdict = compare(measured / requirement - 1, TOLERANCE_FRACTION)
    return blank._replace(**predicted(images.effect), measured_cubic_rad=measured, verdict=verdict)


def pull_in(study: Study, n_pull: float) -> Verdict:
    """Verify autofocus at its pull-in limit, with an image of a clock error that has a quadratic phase of π·N_pull.

    N_pull is the pull-in range `autofocus.n_pull`, which is limited by range walk. A clock error is used because it
    does not change the geometry.
    """
    phase, budget, radar = math.pi * n_pull, study.allocation.qpe_total, study.mission.radar
    walk = n_pull * radar.bandwidth / radar.center_frequency / 2  # range error λN/2 divided by the range cell c/B
    blank = study.blank("mission.autofocus_pull_in", phase, "rad", budget_rad=budget)
    row_subject = subject("clock", TIMING_KIND.name, "quadratic")
    clock = next(source for source in study.sources if source.subject == row_subject)
    fields = refocused(study, [(clock, phase / abs(float(clock.effect.qpe)))], budget, holds_hidden=False)
    reason = phrases.note("range-walk", cells=walk, n_pull=range_walk_cap(study.mission))
    return blank._replace(boundary_autofocus=phase, **fields, verdict=fields["verdict_autofocus"], reason=reason)


def refocused(study: Study, sizes: Sizes, budget: float, *, holds_hidden: bool = True) -> VerdictFields:
    """Refocus an image with errors at their limit, and compare the phase left by autofocus with the budget.

    `budget` [rad] is the limit on the quadratic phase without autofocus gain. If `holds_hidden` is true, the
    remaining phase includes the hidden phase, which autofocus cannot estimate because the band and the turn of the
    line of sight do not resolve it. To verify only the pull-in range, the hidden phase is left out, because it is
    part of the verdicts on other rows. Returns the fields of the verdict that concern autofocus.
    """
    try:
        errors = study.together(sizes, study.worse_sign(sizes))
        room = ROOM[study.mission.autofocus.algorithm]
        spread = study.spread(errors, study.collection.effect(errors))
        if room * spread.smear > MAX_CELLS:
            reason = phrases.note("patch-too-large", cells=room * spread.smear, most=MAX_CELLS)
            return {"verdict_autofocus": "not_evaluated", "reason_autofocus": reason}
        across = math.ceil(2 * study.shared_lines(spread) / (OVERSAMPLING_FACTOR * spread.finer)) + _PEAK_CELLS
        focused = study.focused(study.images(errors, min(RANGE_CELLS, across), room))
        residual = abs(_read_focused(study, focused).quadratic)
        hidden = focused.effect.hidden if holds_hidden else 0.0  # autofocus does not correct it
        remaining_phase = math.hypot(residual, hidden)
        peaks = [highest(chip.image) for chip in (focused.reference, focused.chip)]
        loss = 20 * math.log10(peaks[0] / peaks[1])
    except ValueError as error:
        return {
            "verdict_autofocus": "not_evaluated",
            "reason_autofocus": phrases.note("no-image-formed", why=str(error)),
        }
    is_met = remaining_phase <= budget * (1 + TOLERANCE_FRACTION)
    return {
        "measured_residual_qpe_rad": residual,
        "refocused_loss_db": loss,
        "verdict_autofocus": "confirmed" if is_met else "optimistic",
        "reason_autofocus": None
        if is_met
        else phrases.note("autofocus-leaves", phase=remaining_phase, allowed=budget),
    }


def _read_focused(study: Study, focused: Responses) -> ApertureReading:
    """Measure the phase over the aperture that remains after autofocus.

    A small phase is measured in the middle of the patch, and a large phase in the whole patch.
    """
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


def predicted(effect: ExactEffect) -> VerdictFields:
    """Return the fields of a verdict that are computed from exact ranges: phases and displacement."""
    return {
        "predicted_qpe_rad": abs(effect.quadratic),
        "equal_loss_qpe_rad": effect.equal_loss,
        "predicted_cubic_rad": abs(effect.cubic),
        "displacement_m": effect.displacement,
    }


def _without_image(study: Study, blank: Verdict, error: ValueError) -> Verdict:
    """Return the verdict on a limit at which no image can be formed.

    `error` contains the reason. If no ground point has the recorded range history, a limit of the published model is
    `optimistic`. Otherwise the verdict is `not_evaluated`.
    """
    if isinstance(error, NoGroundPointError) and not study.is_full:
        return blank._replace(verdict="optimistic", reason=phrases.note("no-image-at-the-limit"))
    return blank._replace(reason=phrases.note("no-image-formed", why=str(error)))


def compare(excess: float, tolerance: float) -> str:
    """Return the verdict on a limit from the amount by which a measured quantity exceeds its permitted value.

    `excess` and `tolerance` are relative amounts, or both are levels in dB. The verdict is `confirmed` if the
    magnitude of `excess` is at most `tolerance`. Otherwise it is `optimistic` if `excess` is positive, and
    `conservative` if it is negative.
    """
    if abs(excess) <= tolerance:
        return "confirmed"
    return "optimistic" if excess > 0 else "conservative"


def published_displacement(study: Study, sizes: Sizes, scale: float) -> GroundVector | None:
    """Displacement (east, north) due to several errors together, from equation (25) of Rigling & Moses. [m]

    `scale` multiplies the sizes of the errors. The result is None if equation (25) has no solution.
    """
    published = study.analysis.published  # (25)
    moves = [published.displacement(source.effect, scale * size) for source, size in sizes]
    if any(move is None for move in moves):
        return None
    return (math.fsum(m[0] for m in moves if m), math.fsum(m[1] for m in moves if m))


def _judged(study: Study, blank: Verdict, sizes: Sizes) -> Verdict:
    """Return the verdict on a quadratic-phase limit from images with errors below, at and above the limit.

    `sizes` holds the errors with their sizes at the limit. The phases measured in the images are compared with the
    budget in `blank`. If the smear is long, only the image at the limit is formed.
    """
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
    is_small = images.spread.smear <= _MAX_SMEAR_CELLS
    inside, beyond = (
        _phase(study, sizes, factor * scale) if is_small else None for factor in (INSIDE_FRACTION, BEYOND_FACTOR)
    )
    verdict, remark = _through_the_limit(inside, measured, beyond, budget)
    unusual = phrases.note("smear-leaves-the-patch", part=reading.coverage) if reading.coverage < 0.9 else NOTHING
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
        smear_azimuth_published_rad=(float(study.geometry.look_azimuth + math.pi / 2) % math.pi),
        verdict=verdict,
        reason=remark.then(unusual) if remark else unusual or None,
    )


def _through_the_limit(
    inside: float | None, measured: float, beyond: float | None, budget: float
) -> tuple[str, Note | None]:
    """Return the verdict on a limit from measured phases, and a note if the phase does not grow with the error.

    `inside`, `measured` and `beyond` [rad] are the phases with the error below, at and above its limit. `inside` and
    `beyond` are None if no image is formed at these sizes. A limit is correct only if smaller errors have smaller
    phases. If the phase below the limit is at least as large as the phase at the limit, the verdict is based on the
    phase below the limit, without a tolerance. A smaller phase above the limit does not change the verdict. The note
    is None if the phase grows.
    """
    verdict = compare(measured / budget - 1, TOLERANCE_FRACTION)
    falls_inside = inside is not None and inside >= measured
    if inside is not None and falls_inside:
        verdict = compare(inside / budget - 1, 0.0)
    if not falls_inside and (beyond is None or beyond > measured):
        return verdict, None
    sizes = (
        (inside, f" at {INSIDE_FRACTION:g} of the limit"),
        (measured, " at it"),
        (beyond, f" at {BEYOND_FACTOR:g}"),
    )
    return verdict, phrases.phase_does_not_grow([(phase, position) for phase, position in sizes if phase is not None])


def _of_response(study: Study, images: Responses, reading: ApertureReading) -> VerdictFields:
    """Return the fields of a verdict that describe a response: displacement, smear, and measures of a cut.

    The cut goes through the response across range. Quantities that cannot be determined, because the smear is long or
    the patch is curved, are omitted.
    """
    chip, reference, measures = images.chip, images.reference, VerdictFields()
    try:
        shift = study.shift(images, reading)
        measures["measured_displacement_m"] = images.effect.moved(shift.displacement)
        measures["measured_smear_azimuth_rad"] = shift.smear_azimuth
    except ValueError:
        pass
    try:
        clean = impulse_response(reference.cut, reference.spacing[1])
        line = line_at(chip.image, row_of_peak(chip.image))
        response = impulse_response(line, chip.spacing[1], mask_m=clean.mask_m)
    except ValueError:
        return measures
    return measures | {
        "irw_ratio": response.irw_m / clean.irw_m,
        "peak_loss_db": 20 * math.log10(clean.peak / response.peak),
        "pslr_db": response.pslr_db,
        "islr_db": response.islr_db,
    }


def _phase(study: Study, sizes: Sizes, scale: float) -> float | None:
    """Measure the equal-loss quadratic phase in an image that contains several errors. [rad]

    The equal-loss quadratic phase is the purely quadratic phase that would reduce the peak as much as the errors do,
    apart from the loss due to the cubic phase and higher orders; see `Study.equal_loss`. `scale` multiplies the sizes
    of the errors. The result is None if the image cannot be formed or its phase cannot be measured.
    """
    try:
        images = study.images(study.together(sizes, scale), READ_CELLS)
        return study.equal_loss(images, study.read(images))
    except ValueError:
        return None


def _scale_of_cubic(study: Study, sizes: Sizes, scale: float, requirement: float) -> float:
    """Find the factor by which all errors must be multiplied for their cubic phase to equal the requirement.

    The cubic phase is computed from exact ranges. `scale` is a first guess of the factor, and `requirement` [rad] is
    the required cubic phase.

    Raises
    ------
    ValueError
        No such factor is found: the cubic phase never equals the requirement, or only for a factor with which no
        image can be formed.
    """
    low, high = 0.0, math.inf  # scale with too little phase, and scale with too much phase or without an image
    for _ in range(60):
        try:
            cubic_phase = abs(study.effect(sizes, scale).cubic)
        except ValueError:
            cubic_phase = math.inf
        if abs(cubic_phase / requirement - 1) < 1e-4:
            return scale
        low, high = (scale, high) if cubic_phase < requirement else (low, min(high, scale))
        next_scale = scale * min(4.0, max(0.25, requirement / cubic_phase)) if 0 < cubic_phase < math.inf else low
        scale = next_scale if low < next_scale < high else (low + high) / 2 if high < math.inf else 2 * scale
    raise ValueError("no scale of the declared errors has this cubic phase")


# ---------------------------------------------------------------------- location
def location(study: Study, requirement: float) -> Verdict:
    """Verify the limit on location error with an image that contains all declared errors.

    The errors are scaled by a common factor so that the displacement computed by the gating model, which decides the
    verdict, equals `requirement` [m]. The limit is confirmed if the displacement in the image agrees with the gating
    model within 5 % of the requirement. For the published model, which uses equation (25) of Rigling & Moses, the
    displacement due to each single error must also agree with exact ranges. If some displacements disagree, and
    equation (25) makes all of these too long, the limit is conservative. In the remaining cases it is optimistic.
    """
    blank = study.blank("mission.location_error", requirement, "m")
    sizes = [(s, s.declared or 0.0) for s in study.declared]
    if not sizes:
        return blank._replace(reason=phrases.note("nothing-moves-the-image"))
    rule = "the full model" if study.is_full else "(25)"
    try:
        scale = _scale_of_location(study, sizes, requirement)
        if scale is None:
            degeneracy = study.analysis.published.degeneracy
            why = (
                phrases.note("displacement-degenerates", why=degeneracy)
                if degeneracy
                else phrases.note("errors-move-nothing", rule=rule)
            )
            return blank._replace(reason=why)
        published = published_displacement(study, sizes, scale)
        expected = study.effect(sizes, scale).displacement if study.is_full else published
        images = study.images(study.together(sizes, scale))
        effect = images.effect
        shift = study.shift(images, study.read(images))
    except ValueError as error:
        return blank._replace(reason=phrases.note("no-image-formed", why=str(error)))
    assert expected is not None
    measured = effect.moved(shift.displacement)
    comparisons = [("all of them together", expected, measured)]
    if not study.is_full:
        # Errors may cancel in the sum, and the true error may have a sign other than the declared one.
        for source, size in sizes:
            expected_alone = published_displacement(study, [(source, size)], scale)
            if expected_alone is not None:
                exact = study.effect([(source, size)], scale).displacement
                comparisons.append((f"{source.id} alone", expected_alone, exact))
    tolerance = TOLERANCE_FRACTION * requirement
    verdict = "confirmed"
    for _, rule_position, exact_position in comparisons:
        if math.dist(rule_position, exact_position) > tolerance:
            is_harmless = not study.is_full and verdict != "optimistic" and _is_shorter(rule_position, exact_position)
            verdict = "conservative" if is_harmless else "optimistic"
    along, across = _along_and_across(study, expected, measured)
    reason = phrases.note("places-differ", rule=rule, along=along, across=across)
    if verdict != "confirmed":
        who, rule_position, exact_position = max(comparisons, key=lambda comparison: math.dist(*comparison[1:]))
        reason = reason.then(phrases.rule_misplaces(who, rule, rule_position, exact_position))
    return blank._replace(
        **predicted(effect),
        displacement_published_m=published,
        displacement_full_m=effect.displacement,
        measured_displacement_m=measured,
        verdict=verdict,
        reason=reason,
    )


def _scale_of_location(study: Study, sizes: Sizes, requirement: float) -> float | None:
    """Find the factor by which all errors must be multiplied for their displacement to equal the requirement.

    The displacement is computed by the gating model, which decides the verdict. The result is None if the errors
    together do not displace the image. It is also None if the gating model is the published model and equation (25)
    of Rigling & Moses has no solution.
    """
    if not study.is_full:
        displacement = published_displacement(study, sizes, 1.0)
        length = math.hypot(*displacement) if displacement else 0.0
        return requirement / length if length else None
    full = study.analysis.full
    moves = [full.displacement(source.full, size) or (0.0, 0.0) for source, size in sizes]
    length = math.hypot(math.fsum(m[0] for m in moves), math.fsum(m[1] for m in moves))
    if not length:
        return None
    scale = requirement / length
    for _ in range(20):
        distance = math.hypot(*study.effect(sizes, scale).displacement)
        if not distance or abs(distance / requirement - 1) < _LOCATION_FRACTION:
            break
        scale *= min(2.0, max(0.5, requirement / distance))
    return scale


def _along_and_across(study: Study, a: GroundVector, b: GroundVector) -> GroundVector:
    """Absolute differences along x′ and along y′ between the displacements `a` and `b` (east, north). [m]"""
    look = study.geometry.look_azimuth
    cosine, sine = math.cos(look), math.sin(look)
    east, north = b[0] - a[0], b[1] - a[1]
    return abs(east * cosine + north * sine), abs(north * cosine - east * sine)


def _is_shorter(expected: GroundVector, actual: GroundVector) -> bool:
    """Whether sums of displacements like `actual` are never longer than sums of displacements like `expected`.

    If the signs of several displacements are chosen to maximise the length of their sum, this length is at least 2/π
    times the sum of their lengths. The component of `actual` perpendicular to `expected` is therefore harmless if it
    is at most 2/π times a difference of lengths: the length of `expected` minus the component of `actual` along it.
    The result is False if `expected` is zero.
    """
    length = math.hypot(*expected)
    if not length:
        return False
    along = abs(actual[0] * expected[0] + actual[1] * expected[1]) / length**2
    across = abs(actual[0] * expected[1] - actual[1] * expected[0]) / length**2
    return along + math.pi / 2 * across <= 1
