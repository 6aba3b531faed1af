"""The two models behind one interface: what a declared error does, and how large an error may be.

The published model is linear. The full model is true for errors of any size: where the second order provably does
not matter, its effects are proportional to the error, and everywhere else they are those of exact ranges. An error
has two signs and a bound covers both, so that phases and allowables are those of the worse one.
"""

import math
from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from bisar_budget import evaluators, phrases
from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.effects.effect import CLOCK_UNITS, PLATFORMS, Effect, ErrorSource, ImagePlane, image_plane
from bisar_budget.geometry import BistaticGeometry, GroundVector
from bisar_budget.phrases import Note
from bisar_budget.ranges import point_paths
from bisar_budget.ranges.exact_ranges import ExactRanges, Lanes, joined
from bisar_budget.ranges.point_paths import Held, PointPaths

QUADRATIC, CUBIC, LOCATION = "quadratic_phase_error", "cubic_phase_error", "location_error"
HELD = {QUADRATIC: point_paths.QUADRATIC, CUBIC: point_paths.CUBIC, LOCATION: point_paths.WAY}
END_OF_IMAGE = "end_of_image"  # no requirement: no ground point has the range history of a larger error

# No navigation error: it takes the platform, within the aperture, farther than this part of its slant range.
FARTHEST = 0.1
SHARE = 0.004  # what the second order may add, of a phase, a displacement or a limit; the aim is 1 %
FLOOR_RAD, FLOOR_M = 1e-3, 2e-3  # and whatever the size

_SIGNS = (1.0, -1.0)
_CLOCK_POWERS = {unit: power for power, unit in enumerate(CLOCK_UNITS.values())}

Asked = tuple[ErrorSource, str, float, float]  # an error, a requirement, its limit, and how far to look


class ExactPhases(NamedTuple):
    """Displacement east, north [m]; quadratic and cubic phase at the aperture edge, signed like β̃. [rad]

    `turn` is what range and Doppler gradients span there, over what they span at the centre.
    """

    displacement: GroundVector
    quadratic: float
    cubic: float
    turn: float


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

    def allowables(self, asked: Sequence[Asked]) -> list[float | None]:
        """Those of several errors."""
        return [self.allowable(*one) for one in asked]

    def ends_image(self, source: ErrorSource, size: float) -> bool:
        """Whether an image ends at an allowable: to a linear model none does."""
        return False


class FullModel:
    """The full model of one collection, for errors of any size.

    `sources` are all errors that may be asked for: each, with either sign, is a lane of `exact`.
    """

    name = "full"
    is_blind = False

    def __init__(self, exact: ExactRanges, geometry: BistaticGeometry, sources: Sequence[ErrorSource]) -> None:
        self.exact, self.sources = exact, sources
        k: float
        first, second, (determinant, k), *terms = np.array(
            [*exact.adjugate, [exact.determinant, exact.k], *exact.phases_per_term]
        )[..., 0].tolist()
        self.plane = ImagePlane((tuple(first), tuple(second)), determinant, phrases.NOTHING)
        half = float(exact.half[0])
        self._nearest_of = {name: float(R.min()) for name, R in zip(PLATFORMS, exact.ranges, strict=True)}
        self._nearest = min(self._nearest_of.values())
        self._apart = float(exact.baselines.min()) if exact.has_direct_path else math.inf
        self._slant_ranges: dict[str, float] = {
            "transmitter": geometry.transmitter.slant_range,
            "receiver": geometry.receiver.slant_range,
        }
        self._edge = {"m": 1.0, "m/s": half, "m/s^2": half**2 / 2}
        (a, b), (c, d) = self.plane.inverse
        (q_0, q_1), (c_0, c_1) = terms
        # A range error of a metre at most, whatever its course: its fit has a value of 1 at most, a slope of 1.5, a
        # quadratic and a cubic of 2.5 and 4 at most; so much displacement and phase follow.
        self._followed = set[bool]()  # declared errors along axes of the file, and along those of the scene
        self._per_metre: dict[str, float] = {
            LOCATION: math.hypot(a, c) + 1.5 / half * math.hypot(b, d),
            QUADRATIC: 2.5 * k + abs(q_0) + 1.5 / half * abs(q_1),
            CUBIC: 4 * k + abs(c_0) + 1.5 / half * abs(c_1),
        }

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
        return self.allowables([(source, requirement, limit, upto)])[0]

    def allowables(self, asked: Sequence[Asked]) -> list[float | None]:
        """Search for the allowables of several errors together, each asked for once; as `allowable`."""
        found: list[float | None] = []
        searched: list[tuple[int, ErrorSource, str, float, float, float]] = []
        for source, requirement, limit, upto in asked:
            linear = _size(limit, _per_unit(source.full, self.plane, requirement))
            if source.is_motion and not self.is_heard_out(source):
                farthest = min(upto, max(self.farthest(source), abs(source.declared or 0.0)))
                first = farthest if linear is None else min(linear, farthest)
                if self._adds(source, first, requirement) > SHARE * limit:
                    searched.append((len(found), source, requirement, limit, first, farthest))
                elif linear is not None and linear > farthest:
                    linear = None
            found.append(linear)
        if searched:
            for (place, *_), size in zip(searched, self._smallest([one[1:] for one in searched]), strict=True):
                found[place] = size
        return found

    def ends_image(self, source: ErrorSource, size: float) -> bool:
        """Whether an allowable, as found, is where the image ends: the search stopped there short of its limit."""
        lanes = [self._lane[source.id, sign] for sign in _SIGNS if (source.id, sign) in self._lane]
        return bool((self._paths.end[lanes] == size).any())

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
            return FARTHEST * min(self._slant_ranges.values()) / self.largest_range_error(source)
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
        per_metre = self._per_metre[requirement]
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
        """Phases and displacement of an error of a size, with its sign, by exact ranges; None: no ground point.

        The first declared one that is asked for is found together with its like.
        """
        some, sizes = np.array([self._lane[source.id, math.copysign(1.0, size)]]), np.array([abs(size)])
        if source.declared and source.is_independent not in self._followed:
            self._followed.add(source.is_independent)
            self._follow([one for one in self.sources if one.is_independent == source.is_independent])
        self._paths.to(some, sizes)
        _, east, north, quadratic, cubic, turn = self._paths.known(some, sizes)[:, 0].tolist()
        return None if math.isnan(east) else ExactPhases((east, north), quadratic, cubic, turn)

    def largest_range_error(self, source: ErrorSource) -> float:
        """Largest range error at the nodes of a small unit of an error, before it displaces anything. [m/unit]"""
        return float(np.abs(self.exact.range_error(lanes_of(self.exact, source))).max())

    def _follow(self, sources: Sequence[ErrorSource]) -> None:
        """Find together where the large ones of declared errors lead."""
        large = [
            (self._lane[one.id, sign], abs(one.declared))
            for one in sources
            if one.declared and (one.id, 1.0) in self._lane and not self.is_small(one, abs(one.declared))
            for sign in _SIGNS
        ]
        if large:
            lanes, sizes = zip(*large, strict=True)
            self._paths.to(np.array(lanes), np.array(sizes))

    def left_over(self, source: ErrorSource, size: float, place: GroundVector) -> list[float]:
        """Range error at the nodes that an error leaves at a ground point. [m]"""
        left = self.exact.left_over(lanes_of(self.exact, source), np.array([size]), place)
        found: list[float] = left[:, 0].tolist()
        return found

    def left_over_small(self, source: ErrorSource, size: float) -> list[float]:
        """The same at the displaced point, of an error so small that its effects are proportional to it. [m]"""
        east, north = self.plane.displacement(source.full, size) or (0.0, 0.0)
        by_east, by_north = self.exact.slopes
        left = size * self.exact.range_error(lanes_of(self.exact, source)) + east * by_east + north * by_north
        found: list[float] = left[:, 0].tolist()
        return found

    @cached_property
    def _lane(self) -> dict[tuple[str, float], int]:
        """Lane of each error that displaces the image, with either sign."""
        moving = [one.id for one in self.sources if one.is_motion and not self.is_heard_out(one)]
        return {(name, sign): 2 * place + n for place, name in enumerate(moving) for n, sign in enumerate(_SIGNS)}

    @cached_property
    def _paths(self) -> PointPaths:
        """Ways of the scene centre by all of them."""
        moving = [one for one in self.sources if (one.id, 1.0) in self._lane]
        lanes = [lanes_of(self.exact, one, sign) for one in moving for sign in _SIGNS]
        per_unit = [self.plane.displacement(one.full, sign) or (0.0, 0.0) for one in moving for sign in _SIGNS]
        return PointPaths(self.exact, joined(lanes), np.array(per_unit).T)

    def _smallest(self, searched: Sequence[tuple[ErrorSource, str, float, float, float]]) -> list[float | None]:
        """Search for sizes that reach limits, of errors from a first guess to the farthest, by both signs."""
        rows, numbers = [], []
        for source, requirement, limit, first, farthest in searched:
            of_length = _per_unit(source.full, self.plane, LOCATION)
            slope = {QUADRATIC: source.full.qpe, CUBIC: source.full.cubic}.get(requirement, of_length)
            rows.append(HELD[requirement])
            numbers.append((limit, slope, first, farthest))
        limits, slopes, firsts, farthests = np.array(numbers).T
        both = [np.array([self._lane[source.id, sign] for source, *_ in searched]) for sign in _SIGNS]
        found = self._paths.either_reaching(both, Held(np.array(rows), limits, slopes), firsts, farthests)
        return [size if math.isfinite(size) else None for size in found.tolist()]


def lanes_of(exact: ExactRanges, source: ErrorSource, sign: float = 1.0) -> Lanes:
    """Build the lane of a unit of an error, with a sign, over the exact ranges of one case."""
    case = np.zeros(1, dtype=int)
    if source.is_position:
        moves = (float(source.moves(PLATFORMS[0])), float(source.moves(PLATFORMS[1])))
        return Lanes(case, sign * exact.powers[source.unit], moves, source.direction, source.unit)
    if source.owner != "clock":  # a phase as such: a quadratic that displaces nothing
        return Lanes(case, sign * ((exact.times / exact.half) ** 2 - 1 / 3) / exact.k)
    silent = 0.0 if exact.has_direct_path else 1.0
    power = _CLOCK_POWERS[source.unit]
    return Lanes(case, sign * silent * SPEED_OF_LIGHT * exact.times**power)


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
