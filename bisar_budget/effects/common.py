"""Errors that both platforms have in common: the effects of both legs add with their signs.

A bias of one GNSS service moves both measured paths by the same vector. The range error, and with it Table I and the
full model, is linear in the errors, so the common effect is the sum of the two platforms' own.
"""

from collections.abc import Iterator, Sequence

from bisar_budget import phrases
from bisar_budget.constants import ROUNDING
from bisar_budget.effects.effect import MOTION_UNITS, PLATFORMS, Effect, ErrorSource
from bisar_budget.effects.subject import subject
from bisar_budget.mission.model import Mission
from bisar_budget.phrases import Note


def common_sources(mission: Mission, sources: Sequence[ErrorSource]) -> Iterator[ErrorSource]:
    """List the errors of `common_motion_error`, declared or not; nothing for a mission without the key.

    Parameters
    ----------
    mission : Mission
        As loaded.
    sources : sequence of ErrorSource
        Of the mission, those of both platforms along the scene's axes among them.
    """
    error = mission.common_motion_error
    if error is None:
        return
    by_subject = {source.subject: source for source in sources}
    factor = mission.allocation.coverage_factor
    for kind, unit in MOTION_UNITS.items():
        values = getattr(error, kind)
        for axis, letter in enumerate("xyz"):
            legs = [by_subject[subject(platform, kind, letter)] for platform in PLATFORMS]
            full = _sum([leg.full for leg in legs])
            if kind == "position" and letter != "z":
                # A horizontal shift of both platforms is a shift of the scene: x̂ is the error itself, and β̃ₙ and
                # ½s̈·x̂ cancel. What a sum of rounded numbers leaves would be a limit out of nothing.
                full = full._replace(qpe=0.0, cubic=0.0)
            yield ErrorSource(
                subject=subject("mission", kind, letter),
                unit=unit,
                declared=None if values is None else values[axis] * factor,
                path=("common_motion_error", kind, axis),
                effect=_sum([leg.effect for leg in legs]),
                full=full,
                direction=legs[0].direction,
                equation=f"{legs[0].equation}, both platforms",
                no_limit=_no_limit(kind, letter),
                evidence=error.source,
                notes=(phrases.held_to_the_total("both platforms"),),
            )


def _sum(effects: Sequence[Effect]) -> Effect:
    total = []
    for parts in zip(*effects, strict=True):
        term = sum(parts)
        # What is left of terms that cancel exactly is rounding.
        total.append(term if abs(term) > ROUNDING * sum(abs(part) for part in parts) else 0.0)
    return Effect._make(total)


def _no_limit(kind: str, axis: str) -> Note:
    if kind == "position":
        return phrases.no_quadratic_term_of_position()
    cause = "velocities" if kind == "velocity" else "lines of sight"
    return phrases.no_common_component(cause, axis)
