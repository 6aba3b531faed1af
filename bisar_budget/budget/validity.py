"""Where the first order of the range error ends, and exact ranges beside it.

Against exact ranges on 500 random collections every row whose second-order phase stays below 2 % or 0.02 rad agrees
with the full model within 2 % or 0.02 rad, and beyond it this phase is the difference
(`tests/simulate/test_full_model.py`); so does the displacement, within 2 % or 0.1 m. A declared error beyond that, or
that moves the image by more than 10 m, or in a collection whose gradients are nearly parallel or whose lines of sight
turn far, gets its phase from exact ranges.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

from bisar_budget.budget.effects import Effect, ErrorSource, FullGround
from bisar_budget.budget.exact_ranges import ExactPhases, ExactRanges
from bisar_budget.budget.second_order import SecondOrder
from bisar_budget.constants import SPEED_OF_LIGHT, UTILIZATION_TOLERANCE
from bisar_budget.geometry import STRAIGHT, BistaticGeometry, GroundVector, norm
from bisar_budget.mission.model import Mission
from bisar_budget.units import format_limit, format_quantity

FLOOR_RAD = 0.02
FLOOR_M = 0.1  # of displacement, a fifth of a resolution cell
SHARE = 0.02  # of the first-order phase, and of the displacement
FAR_M = 10.0  # of displacement; beyond, 5 % of random geometries are off by more than 0.15 rad
LONG_APERTURE_RAD = 0.3  # half the turn of a line of sight; beyond, sixth powers show
_TURNING_RAD = 0.1  # the quartic term is 1 % of the quadratic there
_NARROW_SINE = 0.2  # between range and Doppler gradient; displacements grow as its inverse
_COARSE_CELL_RAD = 1.0  # of phase between points a range cell apart; beyond, a response spreads over cells
_ABSORBED_RAD = 6.1  # of the same, where the image shows half; measured, uniform window, 8 to 300 MHz


class Beyond(NamedTuple):
    """Why an error is beyond first order, and its phases by exact ranges; None where they have no solution."""

    cause: str
    exact: ExactPhases | None

    @property
    def qpe(self) -> float:
        """Quadratic phase by exact ranges, signed; not a number where they have no solution. [rad]"""
        return math.nan if self.exact is None else self.exact.quadratic

    @property
    def cubic(self) -> float:
        """Cubic phase by exact ranges, likewise. [rad]"""
        return math.nan if self.exact is None else self.exact.cubic

    @property
    def displacement(self) -> GroundVector:
        """Displacement by exact ranges, likewise. [m]"""
        return (math.nan, math.nan) if self.exact is None else self.exact.displacement

    def against(self, qpe_full: float) -> str:
        """Say the phase of both."""
        if self.exact is None:
            return f"beyond first order ({self.cause}): by exact ranges no ground point has this range history"
        by_both = f"the full model's {qpe_full:.3g} rad is {self.qpe:.3g} rad by exact ranges"
        return f"beyond first order ({self.cause}): {by_both}"

    def doubt(self, qpe_full: float, limit: float) -> str:
        """Say that exact ranges fail what first order may pass; else nothing."""
        if self.exact is None:
            return self.against(qpe_full)
        is_over = abs(self.qpe) > limit * (1 + UTILIZATION_TOLERANCE)
        return f"{self.against(qpe_full)}, {format_limit(limit, 'rad')} allowed" if is_over else ""


class FirstOrder:
    """The first order of one mission's range error, and what lies beyond it."""

    def __init__(self, mission: Mission, geometry: BistaticGeometry, ground: FullGround) -> None:
        self.geometry, self.ground = geometry, ground
        self.wavelength, self.T = mission.radar.wavelength, mission.collection.aperture_time
        self.second = SecondOrder(geometry, ground, self.wavelength, self.T)
        states = (geometry.transmitter, geometry.receiver)
        nearest = max(0.0, min(state.slant_range - state.travelled(self.T / 2) for state in states))
        # Within this of platform and image the second order cannot reach the floor.
        self._harmless = math.sqrt(FLOOR_RAD * nearest * self.wavelength / (4 * math.pi))
        (a, b), (c, d) = self.second.inverse
        self._by_constant, self._by_linear = math.hypot(a, c), math.hypot(b, d)
        # By so much at most, times the square of that, the second order moves the image.
        self._farthest = (self._by_constant + self._by_linear / self.T) / nearest if nearest else math.inf
        self._strain = _strain(geometry, self.T)
        self.found: dict[str, Beyond] = {}  # by row id, of the errors asked about
        self._exact_sources: dict[str, ErrorSource] = {}

    @cached_property
    def exact(self) -> ExactRanges:
        """Exact paths, sampled when the first error asks for them."""
        return ExactRanges(self.geometry, self.wavelength, self.T)

    def beyond(self, source: ErrorSource) -> Beyond | None:
        """Phases of a declared error by exact ranges; None inside first order, and for no error."""
        declared = source.declared
        if not declared:
            return None
        cause = self._cause(source, declared)
        if not cause:
            return None
        near = self.ground.plane.displacement(source.full, declared) or (0.0, 0.0)
        self.found[source.id] = beyond = Beyond(cause, self.exact.phases([(source, declared)], near))
        return beyond

    def exactly(self, sources: Sequence[ErrorSource]) -> list[ErrorSource]:
        """The same errors; those found beyond first order with phases by exact ranges for the full model's."""
        return [self._by_exact_ranges(source) if source.id in self.found else source for source in sources]

    def _by_exact_ranges(self, source: ErrorSource) -> ErrorSource:
        if source.id not in self._exact_sources:
            beyond, size, effect = self.found[source.id], source.declared or 1.0, source.full
            by_exact = Effect(effect.constant, effect.linear, beyond.qpe / size, beyond.cubic / size)
            self._exact_sources[source.id] = source._replace(full=by_exact)
        return self._exact_sources[source.id]

    def _reach(self, source: ErrorSource) -> float:
        """Bound of how far a unit of an error takes platform and image, over the aperture. [m/unit]"""
        full = source.full
        moves = self._by_constant * abs(full.constant) + self._by_linear * abs(full.linear)
        return self.second.edge.get(source.unit, 0.0) + moves

    def _cause(self, source: ErrorSource, declared: float) -> str:
        if self._strain and (source.full.qpe or source.is_position):
            return self._strain
        reach = self._reach(source)
        if abs(declared) * reach < self._harmless:
            return ""  # a bound on what follows
        moved = math.hypot(*(self.ground.plane.displacement(source.full, declared) or (0.0, 0.0)))
        if moved > FAR_M:
            return f"it moves the image by {format_quantity(moved, 'm')}"
        first, added = source.full.qpe * declared, self.second.phase(source) * declared * declared
        if abs(added) > max(FLOOR_RAD, SHARE * abs(first)):
            return f"the second order adds {added:.2g} rad"
        allowed = max(FLOOR_M, SHARE * moved)
        if self._farthest * (declared * reach) ** 2 <= allowed:
            return ""  # likewise a bound
        farther = self.second.drift(source) * declared * declared
        return f"the second order moves the image by {format_quantity(farther, 'm', 2)}" if farther > allowed else ""

    def allowable_note(self, source: ErrorSource, gating: float | None, full: float | None, limit: float) -> str:
        """Say that an allowable, which has a phase of `limit`, lies beyond first order; else nothing.

        Of the model that gates; where that has none, of the full model.
        """
        allowable, whose = (full, "the full model's") if gating is None else (gating, "the")
        if allowable is None or not source.is_motion:
            return ""
        if (
            allowable * self._reach(source) < FAR_M
            and allowable * self.second.edge.get(source.unit, 0.0) < self._harmless
        ):
            return ""  # the second order of what stays that near is a constant and a slope
        bend = math.sqrt(abs(self.second.phase(source)) / max(FLOOR_RAD, SHARE * limit))
        if allowable * bend <= 1:
            return ""
        size, held = (format_quantity(value, source.unit, 2) for value in (allowable, 1 / bend))
        return f"{whose} allowable of {size} speaks of the first order alone, which holds to about {held}"


def of_members(
    found: Mapping[str, Beyond], members: Sequence[ErrorSource], total: float, limit: float | None, unit: str
) -> tuple[tuple[str, ...], str]:
    """Notes of an aggregate some of whose members are beyond first order, and its doubt if exact ranges fail it.

    `total` is the aggregate with the members' exact values; of no account where one has none.
    """
    names = [source.id for source in members if source.id in found]
    if not names:
        return (), ""
    shown = ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
    if any(beyond.exact is None for beyond in (found.get(source.id) for source in members) if beyond):
        note = f"holds errors beyond first order ({shown}); by exact ranges one has no image of a point"
        return (note,), "" if limit is None else note
    note = f"holds errors beyond first order ({shown}); with exact ranges it is {format_quantity(total, unit)}"
    if limit is None or total <= limit * (1 + UTILIZATION_TOLERANCE):
        return (note,), ""
    return (note,), f"{note}, {format_quantity(limit, unit, 3, 'down')} allowed"


def _turn(state_rate: float, aperture_time_s: float) -> float:
    """Half of what a line of sight turns by over the aperture. [rad]"""
    return state_rate * aperture_time_s / 2


def _strain(geometry: BistaticGeometry, aperture_time_s: float) -> str:
    """Say what takes every error of a collection beyond first order; else nothing."""
    if math.sin(geometry.gradient_angle) < _NARROW_SINE:
        return f"range and Doppler gradients are {math.degrees(geometry.gradient_angle):.3g} deg apart"
    for name, state in (("transmitter", geometry.transmitter), ("receiver", geometry.receiver)):
        turn = _turn(norm(state.look_rate), aperture_time_s)
        if turn > LONG_APERTURE_RAD:
            return f"the {name}'s line of sight turns by ±{turn:.2g} rad"
    return ""


def collection_notes(mission: Mission, geometry: BistaticGeometry, ground: FullGround) -> Iterator[str]:
    """Say where the collection itself strains the expansion."""
    sine = math.sin(geometry.gradient_angle)
    if sine < _NARROW_SINE:
        yield (
            f"range and Doppler gradients on the ground are {math.degrees(geometry.gradient_angle):.3g} deg apart: "
            f"displacements are {1 / sine:.2g} times those at right angles, and first order ends earlier; declared "
            "errors carry exact ranges, allowables do not"
        )
    for name, state in (("transmitter", geometry.transmitter), ("receiver", geometry.receiver)):
        if state.acceleration != STRAIGHT:
            yield f"the {name}'s path curves: the published model takes it for straight, the full model does not"
        turn = _turn(norm(state.look_rate), mission.collection.aperture_time)
        if turn > LONG_APERTURE_RAD:
            yield (
                f"the {name}'s line of sight turns by ±{turn:.2g} rad: beyond ±{LONG_APERTURE_RAD:g} the full "
                "model's quartic term does not hold; declared errors carry exact ranges, allowables do not"
            )
        elif turn > _TURNING_RAD:
            yield (
                f"the {name}'s line of sight turns by ±{turn:.2g} rad: the phase is no longer a quadratic alone; the "
                f"full model counts the quartic term, about {100 * turn**2:.2g} % of it, the published one does not"
            )
    # A range cell as a constant term displaces by a cell, and so has a phase.
    cell = abs(ground.quadratic[0]) * SPEED_OF_LIGHT / mission.radar.bandwidth
    if cell > _COARSE_CELL_RAD:
        shown = 100 / (1 + (cell / _ABSORBED_RAD) ** 2)
        yield (
            f"points a range cell apart differ by {cell:.3g} rad of quadratic phase: a defocused response spreads "
            f"over range cells instead, an image shows about {shown:.2g} % of it, and the limits are conservative"
        )
