"""Where the first order of the range error ends: the next order in closed form, and collections that strain it.

Of two platforms at R_k the range error has −Σ|P⊥(r̃_k − x̂)|²/2R_k in second order, P⊥ being the part across the line
of sight. Against exact ranges on 500 random collections every row whose second-order phase stays below 2 % or
0.02 rad agrees with the full model within 2 % or 0.02 rad, and beyond it this phase is the difference
(`tests/simulate/test_full_model.py`). Derived here.
"""

import math
from collections.abc import Iterator

from bisar_budget.budget.sources import Effect, ErrorSource, FullGround
from bisar_budget.geometry import STRAIGHT, BistaticGeometry, dot, norm
from bisar_budget.mission.model import Mission

FLOOR_RAD = 0.02
SHARE = 0.02  # of the first-order phase
_LONG_APERTURE_RAD = 0.1  # half the turn of a line of sight; the quartic term is 1 % of the quadratic there
_NARROW_SINE = 0.2  # between range and Doppler gradient; displacements grow as its inverse


class FirstOrder:
    """The first order of one mission's range error, and what the second adds to it."""

    def __init__(self, mission: Mission, geometry: BistaticGeometry, ground: FullGround) -> None:
        self.geometry, self.ground = geometry, ground
        self.wavelength, self.T = mission.radar.wavelength, mission.collection.aperture_time
        nearest = min(geometry.transmitter.slant_range, geometry.receiver.slant_range)
        # Within this of platform and image the second order cannot reach the floor.
        self._harmless = math.sqrt(FLOOR_RAD * nearest * self.wavelength / (4 * math.pi))
        (a, b), (c, d) = ground.plane.adjugate
        determinant = abs(ground.plane.determinant)
        self._by_constant, self._by_linear = math.hypot(a, c) / determinant, math.hypot(b, d) / determinant
        self._reach = {"m": 1.0, "m/s": self.T / 2, "m/s^2": self.T**2 / 8}  # of a unit of it at the aperture edge

    def beyond(self, source: ErrorSource) -> float | None:
        """Quadratic phase of a declared error with the second order, signed; None inside the first. [rad]"""
        declared, full = source.declared or 0.0, source.full
        moves = self._by_constant * abs(full.constant) + self._by_linear * abs(full.linear)
        if abs(declared) * (self._reach.get(source.unit, 0.0) + moves) < self._harmless:
            return None  # a bound on what follows
        first, added = full.qpe * declared, self.second(source, declared).qpe
        return None if abs(added) <= max(FLOOR_RAD, SHARE * abs(first)) else first + added

    def second(self, source: ErrorSource, size: float) -> Effect:
        """What the second order adds to an error of a size: displacement and quadratic phase."""
        T = self.T
        east, north = self.ground.plane.displacement(source.full, size) or (0.0, 0.0)

        def range_error(tau: float) -> float:
            total = 0.0
            for name, state in (("transmitter", self.geometry.transmitter), ("receiver", self.geometry.receiver)):
                own = size * source.power(tau) if source.moves(name) else 0.0
                d, at = source.direction, state.at(tau)[0]
                off = (own * d[0] - east, own * d[1] - north, own * d[2])
                R = norm(at)
                along = dot(off, at) / R
                total -= (dot(off, off) - along * along) / (2 * R)
            return total

        before, middle, after = range_error(-T / 2), range_error(0.0), range_error(T / 2)
        quadratic = 2 * math.pi / self.wavelength * ((before + after) / 2 - middle)
        return self.ground.effective([(middle, (after - before) / T, quadratic, 0.0)])[0]


def collection_notes(mission: Mission, geometry: BistaticGeometry) -> Iterator[str]:
    """Say where the collection itself strains the expansion."""
    sine = math.sin(geometry.gradient_angle)
    if sine < _NARROW_SINE:
        yield (
            f"range and Doppler gradients on the ground are {math.degrees(geometry.gradient_angle):.3g} deg apart: "
            f"displacements are {1 / sine:.2g} times those at right angles, and first order ends earlier"
        )
    for name, state in (("transmitter", geometry.transmitter), ("receiver", geometry.receiver)):
        if state.acceleration != STRAIGHT:
            yield f"the {name}'s path curves: the published model takes it for straight, the full model does not"
        turn = norm(state.look_rate) * mission.collection.aperture_time / 2
        if turn > _LONG_APERTURE_RAD:
            yield (
                f"the {name}'s line of sight turns by ±{turn:.2g} rad: the phase is no longer a quadratic alone, its "
                f"quartic term is about {100 * turn**2:.2g} % of it"
            )
