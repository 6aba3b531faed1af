"""Verdict on the location requirement: where the declared errors put the image, and where the gating model says."""

import math

import numpy as np

from bisar_budget.findings.images import Verdict
from bisar_budget.geometry import GroundVector
from bisar_budget.verify import reasons
from bisar_budget.verify.phase_cases import moved, predicted, published_displacement
from bisar_budget.verify.shift import measured_shift
from bisar_budget.verify.study import Sizes, Study

HALF_PIXEL = 0.5  # a displacement nearer than this is the predicted one
_SETTLED = 1e-6  # of the requirement


def location(study: Study, requirement: float) -> Verdict:
    """All declared errors scaled together until the gating model has them move the image by the requirement.

    Confirmed if the image, and by (25) each error alone by exact ranges, is within half a pixel of where the gating
    model puts it. A displacement that only is shorter is conservative; one that goes elsewhere is not.
    """
    blank = Verdict(id="mission.location_error", model=study.model, boundary_error=requirement, unit="m")
    sizes = [(s, s.declared or 0.0) for s in study.declared]
    if not sizes:
        return blank._replace(reason=reasons.nothing_moves_the_image())
    rule = "the full model" if study.is_full else "(25)"
    try:
        scale = _scale(study, sizes, requirement)
        if scale is None:
            degeneracy = study.analysis.published.degeneracy
            why = reasons.displacement_degenerates(degeneracy) if degeneracy else reasons.errors_move_nothing(rule)
            return blank._replace(reason=why)
        said = _places(study, sizes, scale)
        errors = study.together(sizes, scale)
        effect = study.collection.effect(errors)
        chips = study.chips(errors, effect)
        reading = study.read(errors, effect, *chips)
        shift = measured_shift(*chips, reading)
    except (ValueError, np.linalg.LinAlgError) as error:
        return blank._replace(reason=reasons.no_image_formed(str(error)))
    assert said is not None
    measured = moved(effect.displacement, shift.displacement)
    seen = [("all of them together", said, measured)]
    if not study.is_full:
        # Together, errors may hide each other: the sign each is declared with is not the sign it will fly with.
        for source, size in sizes:
            alone = published_displacement(study, [(source, size)], scale)
            if alone is not None:
                exact = study.effect([(source, size)], scale).displacement
                seen.append((f"{source.id} alone", alone, exact))
    verdict, farthest = _judged(study, seen)
    along, across = _pixels_apart(study, said, measured)
    if study.is_full:
        # What exact ranges predict is the middle of the chip, whose lines and columns are those of range and Doppler.
        along, across = abs(shift.pixels[0]), abs(shift.pixels[1])
        verdict = "confirmed" if max(along, across) <= HALF_PIXEL else "optimistic"
    reason = reasons.places_differ(rule, along, across)
    if verdict != "confirmed":
        who, by_rule, is_at = farthest
        reason = reason.then(reasons.rule_misplaces(who, rule, by_rule, is_at))
    return blank._replace(
        **predicted(effect),
        displacement_published_m=published_displacement(study, sizes, scale),
        displacement_full_m=effect.displacement,
        measured_displacement_m=measured,
        verdict=verdict,
        reason=reason,
    )


_Seen = tuple[str, GroundVector, GroundVector]


def _judged(study: Study, seen: list[_Seen]) -> tuple[str, _Seen]:
    """Verdict on what was said and where it is, and the pair that is farthest apart."""
    verdict = "confirmed"
    for _, said, is_at in seen:
        if max(_pixels_apart(study, said, is_at)) > HALF_PIXEL:
            is_harmless = verdict != "optimistic" and _is_shorter(study, said, is_at)
            verdict = "conservative" if is_harmless else "optimistic"
    return verdict, max(seen, key=lambda one: max(_pixels_apart(study, *one[1:])))


def _places(study: Study, sizes: Sizes, scale: float) -> GroundVector | None:
    """Displacement of errors together by the gating model; None where (25) has none."""
    if not study.is_full:
        return published_displacement(study, sizes, scale)
    return study.effect(sizes, scale).displacement


def _scale(study: Study, sizes: Sizes, requirement: float) -> float | None:
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


def _pixels_apart(study: Study, a: GroundVector, b: GroundVector) -> GroundVector:
    """Distance of two displacements along x′ and y′. [pixels]"""
    look = study.geometry.look_azimuth
    cosine, sine = math.cos(look), math.sin(look)
    east, north = b[0] - a[0], b[1] - a[1]
    spacing = study.collection.spacing
    return abs(east * cosine + north * sine) / spacing[0], abs(north * cosine - east * sine) / spacing[1]


def _is_shorter(study: Study, said: GroundVector, is_at: GroundVector) -> bool:
    """Whether a displacement is the one said but shorter: then no sum of several, over all signs, is longer."""
    length = math.hypot(*said)
    if not length:
        return False
    part = (is_at[0] * said[0] + is_at[1] * said[1]) / length**2
    on_line = (part * said[0], part * said[1])
    return -1 <= part <= 1 and max(_pixels_apart(study, on_line, is_at)) <= HALF_PIXEL
