"""The two models behind one interface: what a declared error does, and how large an error may be.

The published model is linear. The full model is true for errors of any size: where the second order provably does
not matter, its effects are proportional to the error, and everywhere else they are those of exact ranges. An error
has two signs and a bound covers both, so that phases and allowables are those of the worse one.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

from bisar_budget.budget.effects import PLATFORMS, Effect, ErrorSource, ImagePlane, image_plane
from bisar_budget.budget.exact_ranges import ExactPhases, ExactRanges
from bisar_budget.geometry import BistaticGeometry, GroundVector

QUADRATIC, CUBIC, LOCATION = "quadratic_phase_error", "cubic_phase_error", "location_error"

# No navigation error: it takes the platform, within the aperture, farther than this part of its slant range.
FARTHEST = 0.1
_SHARE = 0.002  # what the second order may add, of a phase, a displacement or a limit; the aim is 1 %
_FLOOR_RAD, _FLOOR_M = 5e-4, 1e-3  # and whatever the size
_CLOSE = 2e-4  # of a limit: near enough to go on in a straight line
_STEPS = 60
_AS_LINEAR = 0.2  # of a displacement; farther from where the linear model has it, a point is followed
_FIRST_STEPS, _LEAST_STEP = 8, 1e-5  # of the way from no error on
_STRAY = 0.3  # of a step; farther from where it led, a point is not the one that was followed
_INNER = (0.5, 0.25)  # of a size, where a phase that bends back may have been larger


class Declared(NamedTuple):
    """What one declared error does.

    Quadratic and cubic phase at the aperture edge, of the worse sign, signed like the first order of the declared
    one [rad]; displacement by the declared sign, and by the opposite one [m]. None where there is none: a plane
    without an inverse, or no ground point that has the range history, which makes phases infinite.
    """

    qpe: float
    cubic: float
    displacement: GroundVector | None
    opposite: GroundVector | None

    @property
    def farthest(self) -> GroundVector | None:
        """Displacement by the sign that moves farther, turned to the declared one's side. [m]"""
        if self.displacement is None or self.opposite is None:
            return None
        back = (-self.opposite[0], -self.opposite[1])
        return max(self.displacement, back, key=lambda move: math.hypot(*move))


NOTHING = Declared(0.0, 0.0, None, None)


class PublishedModel:
    """Tables I and II and (25) of Rigling & Moses, linear in every error."""

    name = "published"

    def __init__(self, geometry: BistaticGeometry) -> None:
        self.plane = image_plane(geometry)

    def effect(self, source: ErrorSource) -> Effect:
        """Effect of a unit of an error."""
        return source.effect

    def equation(self, source: ErrorSource) -> str:
        """Where it comes from."""
        return source.equation

    def no_limit(self, source: ErrorSource) -> str:
        """Say why an error has no limit from its quadratic phase."""
        return source.no_limit

    def declared(self, source: ErrorSource) -> Declared:
        """What the declared error does."""
        size = source.declared
        if not size:
            return NOTHING if size is None or not source.is_motion else _still(self.plane)
        moved = self.plane.displacement(source.effect, size) if source.is_motion else None
        return Declared(source.effect.qpe * size, source.effect.cubic * size, moved, _back(moved))

    def allowable(self, source: ErrorSource, requirement: str, limit: float) -> float | None:
        """Largest size of an error within a limit [rad], or [m] for the location; None: no limit."""
        return quotient(limit, _per_unit(source.effect, self.plane, requirement))


class FullModel:
    """The full model of one collection, for errors of any size."""

    name = "full"

    def __init__(self, exact: ExactRanges, geometry: BistaticGeometry) -> None:
        self.exact, self.plane = exact, exact.plane
        self._nearest = min(min(exact.ranges[name]) for name in PLATFORMS)
        self._slant_ranges = {
            "transmitter": geometry.transmitter.slant_range,
            "receiver": geometry.receiver.slant_range,
        }
        half = exact.half
        self._edge = {"m": 1.0, "m/s": half, "m/s^2": half**2 / 2}
        (a, b), (c, d) = self.plane.inverse
        (q_0, q_1), (c_0, c_1) = exact.phases_per_term
        # A range error of a metre at most, whatever its course: its fit has a value of 1 at most, a slope of 1.5, a
        # quadratic and a cubic of 2.5 and 4 at most; so much displacement and phase follow.
        self._metres = math.hypot(a, c) + 1.5 / half * math.hypot(b, d)
        self._radians = 2.5 * exact.k + abs(q_0) + 1.5 / half * abs(q_1)
        self._cubic_radians = 4 * exact.k + abs(c_0) + 1.5 / half * abs(c_1)
        self._known: dict[tuple[str, float], ExactPhases | None] = {}

    def effect(self, source: ErrorSource) -> Effect:
        """Effect of a unit of an error too small for a second order."""
        return source.full

    def equation(self, source: ErrorSource) -> str:
        """Where it comes from."""
        return "full model" if source.is_motion else source.equation

    def no_limit(self, source: ErrorSource) -> str:
        """Say why an error has no limit from its quadratic phase."""
        return (
            "no error up to a tenth of the slant range reaches the limit"
            if source.is_motion
            else "no quadratic phase"
        )

    def declared(self, source: ErrorSource) -> Declared:
        """What the declared error does."""
        size, full = source.declared, source.full
        if not size:
            return NOTHING if size is None or not source.is_motion else _still(self.plane)
        if not source.is_motion:
            return Declared(full.qpe * size, full.cubic * size, None, None)
        if self.is_small(source, abs(size)):
            moved = self.plane.displacement(full, size)
            return Declared(full.qpe * size, full.cubic * size, moved, _back(moved))
        ahead, back = self.at(source, size), self.at(source, -size)
        if ahead is None or back is None:
            return Declared(math.inf, math.inf, ahead and ahead.displacement, back and back.displacement)
        qpe, cubic = max(abs(ahead.quadratic), abs(back.quadratic)), max(abs(ahead.cubic), abs(back.cubic))
        signs = math.copysign(qpe, full.qpe * size), math.copysign(cubic, full.cubic * size)
        return Declared(*signs, ahead.displacement, back.displacement)

    def allowable(self, source: ErrorSource, requirement: str, limit: float) -> float | None:
        """Smallest size, of either sign, at which an error reaches a limit [rad], or [m] for the location.

        None where none does that takes its platform no farther than a tenth of the slant range.
        """
        per_unit = _per_unit(source.full, self.plane, requirement)
        linear = quotient(limit, per_unit)
        if not source.is_motion:
            return linear
        farthest = self.farthest(source)
        if self.is_linear_at(source, requirement, limit):
            return None if linear is None or linear > farthest else linear
        first = farthest if linear is None else min(linear, farthest)
        return self._smallest(source, requirement, limit, per_unit, first, farthest)

    def is_linear_at(self, source: ErrorSource, requirement: str, limit: float) -> bool:
        """Whether effects of an error are proportional to its size up to a limit."""
        linear, farthest = quotient(limit, _per_unit(source.full, self.plane, requirement)), self.farthest(source)
        first = farthest if linear is None else min(linear, farthest)
        return self._adds(source, first, requirement) <= _SHARE * limit

    def farthest(self, source: ErrorSource) -> float:
        """Size beyond which an error is none of navigation. [unit]"""
        if source.owner == "clock":
            return FARTHEST * min(self._slant_ranges.values()) / max(map(abs, self.exact.shape(source)))
        reached = [R for name, R in self._slant_ranges.items() if source.moves(name)]
        return FARTHEST * min(reached) / self._edge[source.unit]

    def is_small(self, source: ErrorSource, size: float) -> bool:
        """Whether effects of an error are proportional to its size, as far as anybody can see."""
        for requirement, floor in ((QUADRATIC, _FLOOR_RAD), (CUBIC, _FLOOR_RAD), (LOCATION, _FLOOR_M)):
            of_it = _per_unit(source.full, self.plane, requirement) * size
            if self._adds(source, size, requirement) > max(floor, _SHARE * of_it):
                return False
        return True

    def _adds(self, source: ErrorSource, size: float, requirement: str) -> float:
        """Bound of what the second order adds to a phase [rad] or a displacement [m].

        Of two platforms it is Σ|P⊥(r̃ − x̂)|²/2R, at most |r̃ − x̂|²/R of the nearer one.
        """
        reach = size * (self._edge.get(source.unit, 0.0) + _per_unit(source.full, self.plane, LOCATION))
        per_metre = {QUADRATIC: self._radians, CUBIC: self._cubic_radians, LOCATION: self._metres}[requirement]
        return per_metre * reach * reach / self._nearest

    def at(self, source: ErrorSource, size: float) -> ExactPhases | None:
        """Phases and displacement of an error of a size, with its sign, by exact ranges; None: no ground point."""
        key = (source.id, size)
        if key not in self._known:
            self._known[key] = self._found(source, size)
        return self._known[key]

    def _found(self, source: ErrorSource, size: float) -> ExactPhases | None:
        near = self.plane.displacement(source.full, size) or (0.0, 0.0)
        found = self.exact.phases([(source, size)], near)
        if found is not None and math.dist(found.displacement, near) <= _AS_LINEAR * math.hypot(*near) + _FLOOR_M:
            return found
        return self._followed(source, size)

    def _followed(self, source: ErrorSource, size: float) -> ExactPhases | None:
        """Follow the point from no error on, where it is not near to where the linear model has it.

        Where the way bends back no larger error has an image of the point: that is no step away, however small.
        """
        done, place, slope = 0.0, (0.0, 0.0), self.plane.displacement(source.full, 1.0) or (0.0, 0.0)
        step, is_tangent = size / _FIRST_STEPS, True
        found: ExactPhases | None = None
        while done != size:
            ahead = size if abs(size - done) < 1.5 * abs(step) else done + step
            way = (slope[0] * (ahead - done), slope[1] * (ahead - done))
            found = self.exact.phases([(source, ahead)], (place[0] + way[0], place[1] + way[1]))
            made = None if found is None else (found.displacement[0] - place[0], found.displacement[1] - place[1])
            if made is not None and math.dist(made, way) <= _STRAY * math.hypot(*way) + _FLOOR_M:
                slope = (made[0] / (ahead - done), made[1] / (ahead - done))
                place, done, step, is_tangent = (place[0] + made[0], place[1] + made[1]), ahead, 2 * step, False
            elif is_tangent:
                step /= 2
                if abs(step) < _LEAST_STEP * abs(size):
                    return None
            else:  # a chord leads astray where the way turns: look which way it goes
                probe = _LEAST_STEP * size
                near = self.exact.phases([(source, done + probe)], place)
                if near is None:
                    return None
                slope = ((near.displacement[0] - place[0]) / probe, (near.displacement[1] - place[1]) / probe)
                step, is_tangent = step / 2, True
        return found

    def worst(self, source: ErrorSource, size: float, requirement: str) -> float:
        """Phase [rad] or displacement [m] of the worse sign; infinite without a ground point."""
        both = self.at(source, size), self.at(source, -size)
        if both[0] is None or both[1] is None:
            return math.inf
        if requirement == QUADRATIC:
            return max(abs(one.quadratic) for one in both if one)
        if requirement == CUBIC:
            return max(abs(one.cubic) for one in both if one)
        return max(math.hypot(*one.displacement) for one in both if one)

    def _smallest(
        self,
        source: ErrorSource,
        requirement: str,
        limit: float,
        per_unit: float,
        first: float,
        farthest: float,
    ) -> float | None:
        """Search for the size from a first guess.

        Of the worse sign, first and second order only add up: what they give grows with the size, and the first size
        that is found is the smallest. Third orders may bend it back, so smaller sizes are looked at too.
        """

        def value_at(size: float) -> float:
            return self.worst(source, size, requirement)

        size, value = first, value_at(first)
        low, below = 0.0, 0.0
        while value < limit:
            if size >= farthest:
                size = next(
                    (part * size for part in _INNER if part * size > low and value_at(part * size) >= limit), 0.0
                )
                if not size:
                    return None
                value = value_at(size)
                break
            low, below = size, value
            size = min(farthest, size * min(1.5, 1.02 * limit / value if value else 1.5))
            value = value_at(size)
        found = _crossing(value_at, limit, per_unit, (low, below), (size, value))
        for part in _INNER:
            inner_size = part * found
            if inner_size > low and value > 1.5 * limit and (inner := value_at(inner_size)) >= limit * (1 + _CLOSE):
                return _crossing(value_at, limit, per_unit, (0.0, 0.0), (inner_size, inner))
        return found


def _crossing(
    value_at: Callable[[float], float],
    limit: float,
    per_unit: float,
    inside: tuple[float, float],
    outside: tuple[float, float],
) -> float:
    """Size between two at which a value reaches a limit: that of a parabola through zero, drawn nearer."""
    (low, below), (high, above) = inside, outside
    for step in range(_STEPS):
        if abs(above - limit) <= _CLOSE * limit:
            return high * (1 - (above - limit) / (above + max(0.0, above - per_unit * high)))
        if high - low <= _CLOSE * high:
            return low
        size = math.nan
        if math.isfinite(above):
            bend = (above - per_unit * high) / high**2
            if step < 3 and bend > 0:
                size = 2 * limit / (per_unit + math.sqrt(per_unit**2 + 4 * bend * limit))
            elif step % 3:
                size = low + (high - low) * (limit - below) / (above - below)
        if not low < size < high:
            size = math.sqrt(low * high) if low > 0.1 * high else (low + high) / 2 if low else high / 8
        value = value_at(size)
        if value >= limit or abs(value - limit) <= _CLOSE * limit:
            high, above = size, value
        else:
            low, below = size, value
    return low


def _still(plane: ImagePlane) -> Declared:
    """An error of no size."""
    place = None if plane.degeneracy else (0.0, 0.0)
    return Declared(0.0, 0.0, place, place)


def _back(move: GroundVector | None) -> GroundVector | None:
    return None if move is None else (-move[0], -move[1])


def _per_unit(effect: Effect, plane: ImagePlane, requirement: str) -> float:
    """What a small unit of an error does: magnitude of a phase [rad], or displacement [m]."""
    if requirement == QUADRATIC:
        return abs(effect.qpe)
    if requirement == CUBIC:
        return abs(effect.cubic)
    return math.hypot(*(plane.displacement(effect, 1.0) or (0.0, 0.0)))


def quotient(numerator: float, denominator: float) -> float | None:
    """Divide; None where there is no finite quotient: a zero coefficient or a vanishing error."""
    quotient = numerator / denominator if denominator else math.inf
    return quotient if math.isfinite(quotient) else None
