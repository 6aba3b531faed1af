"""Where the first order of the range error ends: the next order in closed form, and collections that strain it.

Of two platforms at R_k the range error has −Σ|P⊥(r̃_k − x̂)|²/2R_k in second order, P⊥ being the part across the line
of sight. Against exact ranges on 500 random collections every row whose second-order phase stays below 2 % or
0.02 rad agrees with the full model within 2 % or 0.02 rad, and beyond it this phase is the difference
(`tests/simulate/test_full_model.py`). Derived here.
"""

import math
from collections.abc import Iterator

from bisar_budget.budget.sources import Effect, ErrorSource, FullGround
from bisar_budget.geometry import BistaticGeometry, Vector, norm
from bisar_budget.mission.model import Mission

FLOOR_RAD = 0.02
SHARE = 0.02  # of the first-order phase
_LONG_APERTURE_RAD = 0.1  # half the turn of a line of sight; the quartic term is 1 % of the quadratic there
_NARROW_SINE = 0.2  # between range and Doppler gradient; displacements grow as its inverse


def second_order_note(mission: Mission, geometry: BistaticGeometry, ground: FullGround, source: ErrorSource) -> str:
    """Say that a declared error is beyond first order and what the second order adds; empty where it is inside."""
    declared = source.declared or 0.0
    first = source.full.qpe * declared
    allowed = max(FLOOR_RAD, SHARE * abs(first))
    half, nearest = (
        mission.collection.aperture_time / 2,
        min(geometry.transmitter.slant_range, geometry.receiver.slant_range),
    )
    reach = abs(declared) * source.power(half) + norm((*source.full.displacement, 0.0)) * abs(declared)
    if 4 * math.pi / mission.radar.wavelength * reach**2 / nearest < FLOOR_RAD:
        return ""  # a bound on what follows, for the many errors that are small
    added = second_order(mission, geometry, ground, source, declared).qpe
    if abs(added) <= allowed:
        return ""
    return (
        f"beyond first order: the full model's {first:.3g} rad becomes {first + added:.3g} rad with the second order"
    )


def second_order(
    mission: Mission, geometry: BistaticGeometry, ground: FullGround, source: ErrorSource, size: float
) -> Effect:
    """What the second order of the range error adds to an error of a size: displacement and quadratic phase."""
    T = mission.collection.aperture_time
    moved = (source.full.displacement[0] * size, source.full.displacement[1] * size, 0.0)

    def range_error(tau: float) -> float:
        total = 0.0
        for name, state in (("transmitter", geometry.transmitter), ("receiver", geometry.receiver)):
            own = size * source.power(tau) if source.owner == name else 0.0
            off = tuple(own * d - m for d, m in zip(source.direction, moved, strict=True))
            at: Vector = tuple(p + v * tau for p, v in zip(state.position, state.velocity, strict=True))  # type: ignore[assignment]
            R = norm(at)
            along = sum(o * p for o, p in zip(off, at, strict=True)) / R
            total -= (sum(o * o for o in off) - along**2) / (2 * R)
        return total

    before, middle, after = range_error(-T / 2), range_error(0.0), range_error(T / 2)
    quadratic = 2 * math.pi / mission.radar.wavelength * ((before + after) / 2 - middle)
    return ground.effective(middle, (after - before) / T, quadratic, 0.0)


def collection_notes(mission: Mission, geometry: BistaticGeometry) -> Iterator[str]:
    """Say where the collection itself strains the expansion."""
    sine = math.sin(geometry.gradient_angle)
    if sine < _NARROW_SINE:
        yield (
            f"range and Doppler gradients on the ground are {math.degrees(geometry.gradient_angle):.3g} deg apart: "
            f"displacements are {1 / sine:.2g} times those at right angles, and first order ends earlier"
        )
    for name, state in (("transmitter", geometry.transmitter), ("receiver", geometry.receiver)):
        turn = norm(state.look_rate) * mission.collection.aperture_time / 2
        if turn > _LONG_APERTURE_RAD:
            yield (
                f"the {name}'s line of sight turns by ±{turn:.2g} rad: the phase is no longer a quadratic alone, its "
                f"quartic term is about {100 * turn**2:.2g} % of it"
            )
