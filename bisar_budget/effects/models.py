"""The two models behind one interface: what a declared error does, and how large an error may be.

The published model is linear. The full model is true for errors of any size: where the second order provably does
not matter, its effects are proportional to the error, and everywhere else they are those of exact ranges. An error
has two signs and a bound covers both, so that phases and allowables are those of the worse one.
"""

import math
from typing import NamedTuple

from bisar_budget import evaluators, phrases
from bisar_budget.effects.effect import PLATFORMS, Effect, ErrorSource, ImagePlane, image_plane
from bisar_budget.effects.exact_ranges import ExactPhases, ExactRanges
from bisar_budget.effects.point_path import PointPath, Value
from bisar_budget.geometry import BistaticGeometry, GroundVector
from bisar_budget.phrases import Note

QUADRATIC, CUBIC, LOCATION = "quadratic_phase_error", "cubic_phase_error", "location_error"
END_OF_IMAGE = "end_of_image"  # no requirement: no ground point has the range history of a larger error

# No navigation error: it takes the platform, within the aperture, farther than this part of its slant range.
FARTHEST = 0.1
SHARE = 0.004  # what the second order may add, of a phase, a displacement or a limit; the aim is 1 %
FLOOR_RAD, FLOOR_M = 1e-3, 2e-3  # and whatever the size

_VALUES: dict[str, Value] = {
    QUADRATIC: lambda phases: phases.quadratic,
    CUBIC: lambda phases: phases.cubic,
    LOCATION: lambda phases: math.hypot(*phases.displacement),
}


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

    def __init__(self, geometry: BistaticGeometry, *, is_blind: bool = False) -> None:
        self.plane = image_plane(geometry)
        self.is_blind = is_blind  # to what the collection has: a direct path

    def effect(self, source: ErrorSource) -> Effect:
        """Effect of a unit of an error."""
        return source.effect

    def equation(self, source: ErrorSource) -> str:
        """Where it comes from."""
        return source.equation

    def no_limit(self, source: ErrorSource) -> Note:
        """Say why an error has no limit from its quadratic phase."""
        return source.no_limit

    def small(self, source: ErrorSource, requirement: str, limit: float) -> float:
        """Size at which an error would reach a limit, were its effects those of a small one; infinite: never."""
        found = _size(limit, _per_unit(source.effect, self.plane, requirement))
        return math.inf if found is None else found

    def declared(self, source: ErrorSource) -> Declared:
        """What the declared error does."""
        size = source.declared
        if not size:
            return NOTHING if size is None or not source.is_motion else _still(self.plane)
        moved = self.plane.displacement(source.effect, size) if source.is_motion else None
        return Declared(source.effect.qpe * size, source.effect.cubic * size, moved, _back(moved))

    def allowable(self, source: ErrorSource, requirement: str, limit: float, upto: float = math.inf) -> float | None:
        """Largest size of an error within a limit [rad], or [m] for the location; None: no limit, or none `upto`."""
        found = _size(limit, _per_unit(source.effect, self.plane, requirement))
        return found if found is not None and found <= upto else None

    def ends_image(self, source: ErrorSource, size: float) -> bool:
        """Whether an image ends at an allowable: to a linear model none does."""
        return False


class FullModel:
    """The full model of one collection, for errors of any size."""

    name = "full"
    is_blind = False

    def __init__(self, exact: ExactRanges, geometry: BistaticGeometry) -> None:
        self.exact, self.plane = exact, exact.plane
        self._nearest_of = {name: min(exact.ranges[name]) for name in PLATFORMS}
        self._nearest = min(self._nearest_of.values())
        self._apart = min(exact.baselines, default=math.inf)
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
        self._paths: dict[tuple[str, float], PointPath] = {}

    def effect(self, source: ErrorSource) -> Effect:
        """Effect of a unit of an error too small for a second order."""
        return source.full

    def equation(self, source: ErrorSource) -> str:
        """Where it comes from."""
        return "full model" if source.is_motion else source.equation

    def no_limit(self, source: ErrorSource) -> Note:
        """Say why an error has no limit from its quadratic phase."""
        if self.is_heard_out(source):
            return phrases.clock_is_heard()
        return phrases.no_size_reaches_the_limit() if source.is_motion else phrases.no_quadratic_phase()

    def small(self, source: ErrorSource, requirement: str, limit: float) -> float:
        """Size at which an error would reach a limit, were its effects those of a small one; infinite: never."""
        found = _size(limit, _per_unit(source.full, self.plane, requirement))
        return math.inf if found is None else found

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

    def allowable(self, source: ErrorSource, requirement: str, limit: float, upto: float = math.inf) -> float | None:
        """Smallest size, of either sign, at which an error reaches a limit [rad], or [m] for the location.

        None where none does that takes its platform no farther than a tenth of the slant range, or than the declared
        one does, or `upto`.
        """
        per_unit = _per_unit(source.full, self.plane, requirement)
        linear = _size(limit, per_unit)
        if not source.is_motion or self.is_heard_out(source):
            return linear
        farthest = min(upto, max(self.farthest(source), abs(source.declared or 0.0)))
        first = farthest if linear is None else min(linear, farthest)
        if self._adds(source, first, requirement) <= SHARE * limit:
            return None if linear is None or linear > farthest else linear
        signed = {QUADRATIC: source.full.qpe, CUBIC: source.full.cubic}.get(requirement)
        return self._smallest(source, requirement, limit, per_unit if signed is None else signed, first, farthest)

    def ends_image(self, source: ErrorSource, size: float) -> bool:
        """Whether an allowable, as found, is where the image ends: the search stopped there short of its limit."""
        paths = (self._paths.get((source.id, sign)) for sign in (1.0, -1.0))
        return any(path is not None and path.end == size for path in paths)

    def is_linear_at(self, source: ErrorSource, requirement: str, limit: float) -> bool:
        """Whether effects of an error are proportional to its size up to a limit."""
        if self.is_heard_out(source):
            return True
        linear, farthest = _size(limit, _per_unit(source.full, self.plane, requirement)), self.farthest(source)
        first = farthest if linear is None else min(linear, farthest)
        return self._adds(source, first, requirement) <= SHARE * limit

    def farthest(self, source: ErrorSource) -> float:
        """Size beyond which an error is none of navigation; infinite: it has no effect whatever its size. [unit]"""
        if self.is_heard_out(source):
            return math.inf
        if source.owner == "clock":
            return FARTHEST * min(self._slant_ranges.values()) / max(map(abs, self.exact.shape(source)))
        reached = [R for name, R in self._slant_ranges.items() if source.moves(name)]
        return FARTHEST * min(reached) / self._edge[source.unit]

    def is_heard_out(self, source: ErrorSource) -> bool:
        """Whether an error is one of a clock that the direct path stands in for."""
        return source.owner == "clock" and self.exact.has_direct_path

    def is_small(self, source: ErrorSource, size: float) -> bool:
        """Whether effects of an error are proportional to its size, as far as anybody can see."""
        for requirement, floor in ((QUADRATIC, FLOOR_RAD), (CUBIC, FLOOR_RAD), (LOCATION, FLOOR_M)):
            of_it = _per_unit(source.full, self.plane, requirement) * size
            if self._adds(source, size, requirement) > max(floor, SHARE * of_it):
                return False
        return True

    def _adds(self, source: ErrorSource, size: float, requirement: str) -> float:
        """Bound of what the second order adds to a phase [rad] or a displacement [m].

        Of two platforms it is −Σ|P⊥(r̃ − x̂)|²/2R, at most |r̃ − x̂|²/R of the nearer one.
        """
        edge, moved = self._edge.get(source.unit, 0.0), _per_unit(source.full, self.plane, LOCATION)
        per_metre = {QUADRATIC: self._radians, CUBIC: self._cubic_radians, LOCATION: self._metres}[requirement]
        if self.exact.has_direct_path and source.owner in PLATFORMS:
            return per_metre * self._adds_heard(source.owner, size * edge, size * moved)
        reach = size * (edge + moved)
        return per_metre * reach * reach / self._nearest

    def _adds_heard(self, platform: str, own: float, moved: float) -> float:
        """Bound of the second order of an error of one platform, a displacement included, with a direct path. [m]

        That of the ranges is kept apart by platform: of a distant one much cancels to first order. That of the
        distance, |P⊥r̃|²/2D, has the other sign: no more than the larger is added.
        """
        (other,) = (name for name in PLATFORMS if name != platform)
        of_ranges = (own + moved) ** 2 / self._nearest_of[platform] + moved**2 / self._nearest_of[other]
        return max(of_ranges, own**2 / self._apart) / 2

    def at(self, source: ErrorSource, size: float) -> ExactPhases | None:
        """Phases and displacement of an error of a size, with its sign, by exact ranges; None: no ground point."""
        return self._path(source, math.copysign(1.0, size)).to(abs(size))

    def _path(self, source: ErrorSource, sign: float) -> PointPath:
        key = (source.id, sign)
        if key not in self._paths:
            per_unit = self.plane.displacement(source.full, 1.0) or (0.0, 0.0)
            self._paths[key] = PointPath(self.exact, source, sign, per_unit)
        return self._paths[key]

    def _smallest(
        self, source: ErrorSource, requirement: str, limit: float, per_unit: float, first: float, farthest: float
    ) -> float | None:
        """Search for the size from a first guess, by both signs."""
        smallest = None
        for sign in (1.0, -1.0):
            slope = per_unit if requirement == LOCATION else sign * per_unit  # a length has no sign
            found = self._path(source, sign).first_reaching(_VALUES[requirement], limit, slope, first, farthest)
            if found is not None:
                smallest, farthest, first = found, found, min(first, found)
        return smallest


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


def _size(limit: float, per_unit: float) -> float | None:
    """Size at which an effect of so much per unit reaches a limit; None: it has no effect."""
    size = evaluators.allowable_error(limit, per_unit) if per_unit else math.inf
    return size if math.isfinite(size) else None
