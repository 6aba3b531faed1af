"""What errors do by exact ranges: no expansion, and no array library, so that a check can ask for it.

The data hold the ranges of the true path; the processor subtracts those of the measured one. What is left is fitted
over the whole aperture by Legendre polynomials Pₙ, at the nodes of Gauss-Legendre quadrature (`LEGENDRE_FITS`). The
response sits at the ground point for which nothing is left of P₀ and P₁; what then is left of P₂ and P₃ defocuses.
`Linear` is the same for errors so small that their effects are proportional to them. `exact_arrays.py` does both on
arrays. Derived here.

A receiver that hears the transmitter takes the direct path as its clock: the data then hold R_t + R_r less the actual
distance of the platforms, and the processor subtracts ranges less the measured one. No ground point changes that
distance, so that it counts like a clock error, c·t̃ = |r̂_t − r̂_r| − |r_t − r_r|, and other clock errors have no part.
"""

import math
from collections.abc import Iterable, Sequence
from functools import cached_property
from math import sqrt
from operator import add, mul
from typing import NamedTuple

from bisar_budget.constants import ROUNDING, SPEED_OF_LIGHT
from bisar_budget.effects.effect import CLOCK_UNITS, PLATFORMS, Effect, ErrorSource, ImagePlane
from bisar_budget.evaluators import LEGENDRE_FITS, direct_motion, full_ground_inverse, full_motion
from bisar_budget.geometry import BistaticGeometry, GroundVector, PlatformState, Vector
from bisar_budget.phrases import NOTHING

# Way of a platform in half an aperture, over its slant range, up to which so many nodes change phases by less than
# 1e-6 of themselves; beyond the last, 16 nodes are right to 1e-3 at 1.25.
NODES = ((0.1, 6), (0.5, 10), (math.inf, 16))
ITERATIONS = 40
MEETS = 1e-5  # of the nearest range; of a platform that is nearer, rounding decides in which direction it is seen
NEAR = 0.003  # of the nearest slant range; a point so near to the centre has slopes that differ by no more
SKEWED = 0.01  # the same over the sine between the gradients, where they are near to parallel
BENT = 0.05  # of what Doppler turns by at the centre: velocity errors turn it by less, or its slopes are others
FEW = 4
SHRINKS = 0.5  # square of each step of the search over that of the one before; else it does not settle
EPSILON = 2e-15  # of a range sum: what rounding of a few operations leaves
UNSEEN_RAD = 3e-5  # what the last step of the search may change a phase by beyond the part counted linearly

_CLOCK_POWERS = {unit: power for power, unit in enumerate(CLOCK_UNITS.values())}

Samples = Sequence[float]
Track = list[tuple[float, float, float]]  # positions at the nodes


_Ray = tuple[float, float, float, float, float]  # p, 2x̂, 2ŷ, R and R² of `ExactRanges._taken`
_Node = tuple[float, _Ray, _Ray]


class ExactPhases(NamedTuple):
    """Displacement east, north [m]; quadratic and cubic phase at the aperture edge, signed like β̃. [rad]

    `turn` is what range and Doppler gradients span there, over what they span at the centre.
    """

    displacement: GroundVector
    quadratic: float
    cubic: float
    turn: float = 1.0


def nodes_for(geometry: BistaticGeometry, aperture_time_s: float, *, has_direct_path: bool = False) -> int:
    """Number of nodes that a collection needs: of the lines of sight, and of the direct path where that counts."""
    half = aperture_time_s / 2
    turning = (geometry.transmitter, geometry.receiver, *((geometry.apart,) if has_direct_path else ()))
    way = max(state.travelled(half) / state.slant_range for state in turning)
    return next(count for limit, count in NODES if way <= limit)


class ExactRanges:
    """The exact paths of one collection, sampled over the aperture.

    `centre` (2,) is the ground point [m] that stands for the scene centre: what errors do is asked there.
    `has_direct_path` says that the direct path is the clock.
    """

    def __init__(
        self,
        geometry: BistaticGeometry,
        wavelength_m: float,
        aperture_time_s: float,
        centre: GroundVector = (0.0, 0.0),
        count: int | None = None,
        *,
        has_direct_path: bool = False,
    ) -> None:
        self.wavelength, self.half = wavelength_m, aperture_time_s / 2
        self.k = 2 * math.pi / wavelength_m
        count = count or nodes_for(geometry, aperture_time_s, has_direct_path=has_direct_path)
        self.nodes, *self.fit = LEGENDRE_FITS[count]
        self.times = [node * self.half for node in self.nodes]
        east, north = centre
        self.tracks: dict[str, Track] = {}
        self.ranges: dict[str, list[float]] = {}
        for name, state in zip(PLATFORMS, (geometry.transmitter, geometry.receiver), strict=True):
            self.tracks[name] = track = _track(state, self.times, east, north)
            self.ranges[name] = [sqrt(x * x + y * y + z * z) for x, y, z in track]
        self._middle = min(
            math.dist(s.position, (east, north, 0.0)) for s in (geometry.transmitter, geometry.receiver)
        )
        self.recorded = [t + r for t, r in zip(*self.ranges.values(), strict=True)]

        # Distances of the platforms at the nodes, where they are the clock.
        self.baselines = list(map(math.dist, *self.tracks.values())) if has_direct_path else []

        # A phase history in double precision holds no phase that is smaller.
        self.rounding = EPSILON * self.k * (max(self.recorded) + max(self.baselines, default=0.0))

    @property
    def has_direct_path(self) -> bool:
        """Whether the direct path is the clock."""
        return bool(self.baselines)

    # ------------------------------------------------------------------ small errors
    @cached_property
    def _gradient(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """What a metre east, and north, takes from the range: s = u_t + u_r on the ground, fitted, (2, 4)."""
        return tuple(  # type: ignore[return-value]
            self._fitted(
                [
                    p[axis] / R + q[axis] / S
                    for p, R, q, S in zip(
                        self.tracks["transmitter"],
                        self.ranges["transmitter"],
                        self.tracks["receiver"],
                        self.ranges["receiver"],
                        strict=True,
                    )
                ]
            )
            for axis in (0, 1)
        )

    @cached_property
    def orientation(self) -> float:
        """Sign of the turn from range to Doppler gradient at the centre."""
        return math.copysign(1.0, self.plane.determinant)

    @cached_property
    def gradient_sine(self) -> float:
        """Sine of the angle from range to Doppler gradient on the ground, signed, both fitted. [-]"""
        (s_x, rate_x, *_), (s_y, rate_y, *_) = self._gradient
        return (s_x * rate_y - s_y * rate_x) / (math.hypot(s_x, s_y) * math.hypot(rate_x, rate_y))

    @cached_property
    def nearest(self) -> float:
        """Least range at the nodes and, where they leave it out, at the middle of the aperture. [m]"""
        return min(self._middle, *(min(ranges) for ranges in self.ranges.values()))

    @property
    def range_gradient(self) -> float:
        """Length of the range gradient on the ground, fitted. [m/m]"""
        return math.hypot(self._gradient[0][0], self._gradient[1][0])

    @cached_property
    def plane(self) -> ImagePlane:
        """Q⁻¹: from the constant [m] and the linear part [m/s] of a range error to the displacement."""
        (s_x, rate_x, *_), (s_y, rate_y, *_) = self._gradient
        rate_x, rate_y = rate_x / self.half, rate_y / self.half
        first, second, (determinant,) = full_ground_inverse(s_x, s_y, rate_x, rate_y)
        return ImagePlane((first, second), determinant, NOTHING)

    @cached_property
    def phases_per_term(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Quadratic phase, and cubic, that the displacement by a unit of the constant and of the linear part adds."""
        (_, _, q_x, c_x), (_, _, q_y, c_y) = self._gradient
        (a, b), (c, d) = self.plane.adjugate
        scale = self.k / self.plane.determinant
        return (
            ((q_x * a + q_y * c) * scale, (q_x * b + q_y * d) * scale),
            ((c_x * a + c_y * c) * scale, (c_x * b + c_y * d) * scale),
        )

    def _fitted(self, samples: Samples) -> tuple[float, ...]:
        """Value, slope over the half aperture, quadratic and cubic at its edge."""
        return tuple(_sum(weights, samples) for weights in self.fit)

    def motion_effects(self) -> dict[str, list[Effect]]:
        """Effects of a small unit error of each platform, nine: position, velocity, acceleration along x, y, z."""
        found = {}
        for name in PLATFORMS:
            nodes = zip(self.tracks[name], self.ranges[name], self.times, strict=True)
            if self.has_direct_path:
                at_nodes = [
                    direct_motion(*place, R, *b, tau)
                    for (place, R, tau), b in zip(nodes, self._heard_along[name], strict=True)
                ]
            else:
                at_nodes = [full_motion(*place, R, tau) for place, R, tau in nodes]
            kinds = zip(*at_nodes, strict=True)
            found[name] = [self.effect(along) for of_kind in kinds for along in zip(*of_kind, strict=True)]
        return found

    def clock_effects(self) -> list[Effect]:
        """Effects of a small unit of each power of the clock error, 1 to τ³."""
        if self.has_direct_path:
            return [Effect(0.0, 0.0, 0.0, 0.0)] * 4
        return [self.effect([SPEED_OF_LIGHT * tau**n for tau in self.times]) for n in range(4)]

    def effect_of(self, source: ErrorSource) -> Effect:
        """Effect of a small unit of any error."""
        return self.effect(self.range_error(source))

    def range_error(self, source: ErrorSource) -> list[float]:
        """Range error at the nodes of a small unit of any error, before it displaces anything. [m/unit]"""
        if not source.is_position:
            return self.shape(source)
        moved = [self.along(name, source.direction) for name in PLATFORMS if source.moves(name)]
        along = moved[0] if len(moved) == 1 else list(map(add, *moved))
        return along if source.unit == "m" else list(map(mul, along, self.powers[source.unit]))

    def along(self, name: str, direction: Vector) -> list[float]:
        """What a metre along a direction does to the range of a platform at the nodes, −u·d; if heard, −(u − b)·d."""
        key = (name, direction)
        if key not in self._known_along:
            x, y, z = direction
            along = [
                -(a * x + b * y + c * z) / R
                for (a, b, c), R in zip(self.tracks[name], self.ranges[name], strict=True)
            ]
            if self.has_direct_path:
                heard = (a * x + b * y + c * z for a, b, c in self._heard_along[name])
                along = list(map(add, along, heard))
            self._known_along[key] = along
        return self._known_along[key]

    @cached_property
    def _heard_along(self) -> dict[str, Track]:
        """Unit vectors along the direct path at the nodes, b from the other platform to each."""
        transmitter, receiver = self.tracks.values()
        b = [
            ((x - u) / D, (y - v) / D, (z - w) / D)
            for (x, y, z), (u, v, w), D in zip(transmitter, receiver, self.baselines, strict=True)
        ]
        return {"transmitter": b, "receiver": [(-x, -y, -z) for x, y, z in b]}

    def _heard(self, shifts: dict[str, Track]) -> list[float]:
        """What shifts of the platforms make of c·t̃ at the nodes where the direct path is the clock. [m]"""
        apart = shifts.get("transmitter", self._still)
        if "receiver" in shifts:
            apart = [(a - x, b - y, c - z) for (a, b, c), (x, y, z) in zip(apart, shifts["receiver"], strict=True)]
        return [
            (p := a * (x + a) + b * (y + b) + c * (z + c)) / (D + sqrt(abs(D * D + p)))
            for (a, b, c), (x, y, z), D in zip(apart, self._twice_apart, self.baselines, strict=True)
        ]

    @cached_property
    def _twice_apart(self) -> Track:
        tracks = zip(*self.tracks.values(), strict=True)
        return [(2 * (x - u), 2 * (y - v), 2 * (z - w)) for (x, y, z), (u, v, w) in tracks]

    @cached_property
    def _known_along(self) -> dict[tuple[str, Vector], list[float]]:
        return {}

    def quadratics_of(self, sources: Sequence[ErrorSource]) -> list[float]:
        """Quadratic phase of a small unit of each error, that of `effect_of`, in a tenth of its time. [rad/unit]"""
        of_axes, found = self._quadratics_of_axes, []
        for source in sources:
            if source.is_position:
                (a, b, c), whole = of_axes[source.owner, source.unit]
                x, y, z = source.direction
                phase = a * x + b * y + c * z
            else:
                parts = list(map(mul, self._quadratic_weights, self.shape(source)))
                phase, whole = sum(parts), sum(map(abs, parts))
            found.append(phase if abs(phase) > ROUNDING * whole else 0.0)
        return found

    @cached_property
    def _quadratic_weights(self) -> list[float]:
        return self.phase_weights[0]

    @cached_property
    def phase_weights(self) -> tuple[list[float], list[float]]:
        """What a metre at each node adds to quadratic and cubic phase, that of the displacement included. [rad/m]"""
        value, slope, *phases = self.fit
        found = []
        for own, (by_value, by_slope) in zip(phases, self.phases_per_term, strict=True):
            by_slope /= self.half
            found.append(
                [self.k * q + by_value * v + by_slope * s for q, v, s in zip(own, value, slope, strict=True)]
            )
        return found[0], found[1]

    @cached_property
    def _quadratics_of_axes(self) -> dict[tuple[str, str], tuple[Vector, float]]:
        """Quadratic phase of a unit along x, y, z, by owner and unit, and what adds up to it without its signs."""
        found: dict[tuple[str, str], tuple[Vector, float]] = {}
        whole = sum(map(abs, self._quadratic_weights))
        axes = [tuple(zip(*self.tracks[name], strict=True)) for name in PLATFORMS]
        metres = [
            [-weight / R for weight, R in zip(self._quadratic_weights, self.ranges[name], strict=True)]
            for name in PLATFORMS
        ]
        for unit, powers in self.powers.items():
            (a, b, c), (u, v, w) = (
                [sum(map(mul, of_unit, along)) for along in of_axes]
                for of_unit, of_axes in zip((list(map(mul, powers, one)) for one in metres), axes, strict=True)
            )
            if self.has_direct_path:
                of_unit = list(map(mul, powers, self._quadratic_weights))
                along_axes = zip(*self._heard_along["transmitter"], strict=True)
                x, y, z = (sum(map(mul, of_unit, along)) for along in along_axes)
                (a, b, c), (u, v, w) = (a + x, b + y, c + z), (u - x, v - y, w - z)
            most = whole * powers[-1]
            found["transmitter", unit], found["receiver", unit] = ((a, b, c), most), ((u, v, w), most)
            found["mission", unit] = ((a + u, b + v, c + w), 2 * most)
        return found

    def effect(self, range_error: Samples) -> Effect:
        """Effect of a range error sampled at the nodes [m/unit], that of the displacement included."""
        constant, linear, own, own_cubic = self._fitted(range_error)
        linear /= self.half
        own, own_cubic = own * self.k, own_cubic * self.k
        size = max(map(abs, range_error)) * self.k
        (q_0, q_1), (c_0, c_1) = self.phases_per_term
        moved, moved_cubic = (q_0 * constant, q_1 * linear), (c_0 * constant, c_1 * linear)
        qpe, cubic = own + sum(moved), own_cubic + sum(moved_cubic)
        # What is left of terms that cancel exactly is rounding, and would make a limit out of nothing.
        if abs(qpe) <= ROUNDING * (size + abs(moved[0]) + abs(moved[1])):
            qpe = 0.0
        if abs(cubic) <= ROUNDING * (size + abs(moved_cubic[0]) + abs(moved_cubic[1])):
            cubic = 0.0
        if abs(linear) * self.half <= ROUNDING * size / self.k:
            linear = 0.0
        return Effect._make((constant, linear, qpe, cubic))

    # ------------------------------------------------------------------ errors of any size
    def phases(
        self, errors: Iterable[tuple[ErrorSource, float]], near: GroundVector = (0.0, 0.0)
    ) -> ExactPhases | None:
        """Find where errors of given sizes move a point at the centre, and what defocuses there.

        The search starts `near` [m] and has to settle from there at once: `point_path` follows a point. None where it
        does not, and beyond a line on which range and Doppler gradients are parallel: no error leads there from
        nothing.
        """
        nodes, bend = self._taken(errors)
        try:
            return self._settled(nodes, near, self._reach if bend * self.half < self._bend else 0.0)
        except ValueError:  # by rounding, the square of the range of a point that meets a platform was below zero
            return None

    def _taken(self, errors: Iterable[tuple[ErrorSource, float]]) -> tuple[list[_Node], float]:
        """What errors make of the nodes: metres added to the recorded ranges, and where they put platforms.

        With the sum of the velocity errors of both [m/s].
        A range R grows by p/(R + √(R² + p)) where d is added to its vector r, with p = d·(2r + d): that has no
        rounding of the range itself. From a point at g = (east, north) it is p - 2r̂·g + |g|².
        """
        clock, bend = self._unheard, 0.0
        shifts: dict[str, Track] = {}
        for source, size in errors:
            if source.is_position:
                x, y, z = (size * part for part in source.direction)
                powers = self.powers[source.unit]
                shift = [(p * x, p * y, p * z) for p in powers]
                for name in PLATFORMS:
                    if source.moves(name):
                        bend += abs(size) if source.unit == "m/s" else 0.0
                        shifts[name] = _sums(shifts[name], shift) if name in shifts else shift
            else:  # a clock, or a phase as such
                shape = self.shape(source)
                clock = [whole + size * metres for whole, metres in zip(clock, shape, strict=True)]
        if self.has_direct_path:
            clock = list(map(add, clock, self._heard(shifts)))
        rays = self._rays | {name: self._rays_of(name, shift) for name, shift in shifts.items()}
        return list(zip(clock, *rays.values(), strict=True)), bend

    def _rays_of(self, name: str, shift: Track) -> list[_Ray]:
        return [
            (a * (x + x + a) + b * (y + y + b) + c * (z + z + c), 2 * (x + a), 2 * (y + b), R, R * R)
            for (x, y, z), R, (a, b, c) in zip(self.tracks[name], self.ranges[name], shift, strict=True)
        ]

    @cached_property
    def _rays(self) -> dict[str, list[_Ray]]:
        """Where the platforms are at the nodes."""
        return {name: self._rays_of(name, self._still) for name in PLATFORMS}

    @cached_property
    def _still(self) -> Track:
        return [(0.0, 0.0, 0.0)] * len(self.times)

    @cached_property
    def _unheard(self) -> list[float]:
        return [0.0] * len(self.times)

    @cached_property
    def _reach(self) -> float:
        """Distance from the centre up to which its slopes find a point. [m]"""
        return min(NEAR, SKEWED * abs(self.gradient_sine)) * self.nearest

    @cached_property
    def _bend(self) -> float:
        """Way of both platforms by velocity errors within half an aperture up to which they do. [m]"""
        return BENT * abs(self.plane.determinant) * self.half / self.range_gradient * self.nearest

    def left_over(self, source: ErrorSource, size: float, place: GroundVector) -> list[float]:
        """Range error at the nodes that an error leaves at a ground point. [m]"""
        east, north = place
        left, square = [], east * east + north * north
        for whole, (P, x, y, R, RR), (Q, u, v, S, SS) in self._taken([(source, size)])[0]:
            p, q = P - x * east - y * north + square, Q - u * east - v * north + square
            left.append(whole - p / (R + sqrt(abs(RR + p))) - q / (S + sqrt(abs(SS + q))))
        return left

    def left_over_small(self, source: ErrorSource, size: float) -> list[float]:
        """The same at the displaced point, of an error so small that its effects are proportional to it. [m]"""
        east, north = self.plane.displacement(source.full, size) or (0.0, 0.0)
        rays = zip(self.tracks["transmitter"], self.ranges["transmitter"], self.tracks["receiver"],
                   self.ranges["receiver"], strict=True)  # fmt: skip
        gradient = [(p[0] / R + q[0] / S, p[1] / R + q[1] / S) for p, R, q, S in rays]
        return [
            size * metres + east * x + north * y
            for metres, (x, y) in zip(self.range_error(source), gradient, strict=True)
        ]

    def way(self, source: ErrorSource, size: float, place: GroundVector) -> GroundVector:
        """Where the point goes with a larger error, at the place that an error of a size moves it to. [m/unit]"""
        east, north = place
        by_size = None if source.is_position else self.shape(source)
        by_east, by_north = [0.0] * len(self.times), [0.0] * len(self.times)
        change = list(by_size) if by_size else [0.0] * len(self.times)
        x, y, z = source.direction
        for name in PLATFORMS:
            moves = by_size is None and source.moves(name)
            powers = self.powers[source.unit] if moves else ()
            for j, (a, b, c) in enumerate(self.tracks[name]):
                p = powers[j] if moves else 0.0
                a, b, c = a + size * p * x - east, b + size * p * y - north, c + size * p * z
                R = sqrt(a * a + b * b + c * c)
                by_east[j] += a / R
                by_north[j] += b / R
                if moves:
                    change[j] -= p * (a * x + b * y + c * z) / R
        if self.has_direct_path and source.moves("transmitter") != source.moves("receiver"):
            change = list(map(add, change, self._way_heard(source, size)))
        value, slope = self.fit[0], self.fit[1]
        a, b, c, d = _sum(value, by_east), _sum(value, by_north), _sum(slope, by_east), _sum(slope, by_north)
        constant, linear = _sum(value, change), _sum(slope, change)
        determinant = a * d - b * c
        return ((b * linear - d * constant) / determinant, (c * constant - a * linear) / determinant)

    def _way_heard(self, source: ErrorSource, size: float) -> list[float]:
        """How a larger error of one platform changes the measured distance to the other at the nodes. [m/unit]"""
        x, y, z = source.direction
        own, other = sorted(PLATFORMS, key=source.moves, reverse=True)
        found = []
        nodes = zip(self.tracks[own], self.tracks[other], self.powers[source.unit], strict=True)
        for (a, b, c), (u, v, w), p in nodes:
            a, b, c = a + size * p * x - u, b + size * p * y - v, c + size * p * z - w
            apart = sqrt(a * a + b * b + c * c)
            found.append(p * (a * x + b * y + c * z) / apart if apart else 0.0)
        return found

    @cached_property
    def powers(self) -> dict[str, list[float]]:
        """Position error at each node of a unit of an error: 1, τ or τ²/2 of (22)."""
        return {"m": [1.0] * len(self.times), "m/s": self.times, "m/s^2": [tau**2 / 2 for tau in self.times]}

    def shape(self, source: ErrorSource) -> list[float]:
        """Range error at the nodes of a unit of a clock error, or of a phase as such. [m/unit]"""
        if source.owner == "clock":
            if self.has_direct_path:
                return [0.0] * len(self.times)
            power = _CLOCK_POWERS[source.unit]
            return [SPEED_OF_LIGHT * tau**power for tau in self.times]
        return [(node * node - 1 / 3) / self.k for node in self.nodes]  # a quadratic that displaces nothing

    def _settled(self, nodes: list[_Node], near: GroundVector, reach: float) -> ExactPhases | None:
        """Newton's method for the point; with the slopes of the centre where it stays within reach of that."""
        east, north = near
        if math.hypot(east, north) < reach:
            found = self._settled_near(nodes, east, north)
            if found is not None:
                return found
        value, slope, quadratic, cubic = self.fit
        before, meets = math.inf, MEETS * self.nearest
        for _ in range(ITERATIONS):
            left, by_east, by_north, nearest = [], [], [], math.inf
            square, twice_east, twice_north = east * east + north * north, 2 * east, 2 * north
            for whole, (P, x, y, R, RR), (Q, u, v, S, SS) in nodes:
                P, Q = P - x * east - y * north + square, Q - u * east - v * north + square
                p, q = sqrt(RR + P), sqrt(SS + Q)
                if p < nearest:
                    nearest = p
                if q < nearest:
                    nearest = q
                if nearest < meets:
                    return None
                left.append(whole - P / (R + p) - Q / (S + q))
                p, q = p + p, q + q
                by_east.append((x - twice_east) / p + (u - twice_east) / q)
                by_north.append((y - twice_north) / p + (v - twice_north) / q)
            # A step of a metre adds by_east, by_north to what is left.
            a, b = sum(map(mul, value, by_east)), sum(map(mul, value, by_north))
            c, d = sum(map(mul, slope, by_east)), sum(map(mul, slope, by_north))
            constant, linear = sum(map(mul, value, left)), sum(map(mul, slope, left))
            determinant = a * d - b * c
            if not determinant:
                return None
            step_east = (b * linear - d * constant) / determinant
            step_north = (c * constant - a * linear) / determinant
            east, north = east + step_east, north + step_north
            step = step_east * step_east + step_north * step_north
            if self.k * step < UNSEEN_RAD * nearest:
                if determinant * self.orientation <= 0:
                    return None
                phases = (
                    self.k
                    * (
                        _sum(weights, left)
                        + _sum(weights, by_east) * step_east
                        + _sum(weights, by_north) * step_north
                    )
                    for weights in (quadratic, cubic)
                )
                left_quadratic, left_cubic = (phase if abs(phase) > self.rounding else 0.0 for phase in phases)
                turn = determinant / (self.plane.determinant * self.half)
                return ExactPhases((east, north), left_quadratic, left_cubic, turn)
            if not step < SHRINKS * before:
                return None
            before = step
        return None

    def _settled_near(self, nodes: list[_Node], east: float, north: float) -> ExactPhases | None:
        """Search with the slopes of the centre: a third of the work. None where it does not settle in a few steps."""
        (by_east, turn_east, quadratic_east, cubic_east), (by_north, turn_north, *rest) = self._gradient
        (quadratic_north, cubic_north), (value, slope, quadratic, cubic) = rest, self.fit
        determinant = by_east * turn_north - by_north * turn_east
        for _ in range(FEW):
            left, square = [], east * east + north * north
            for whole, (P, x, y, R, RR), (Q, u, v, S, SS) in nodes:
                p, q = P - x * east - y * north + square, Q - u * east - v * north + square
                left.append(whole - p / (R + sqrt(RR + p)) - q / (S + sqrt(SS + q)))
            constant, linear = sum(map(mul, value, left)), sum(map(mul, slope, left))
            step_east = (by_north * linear - turn_north * constant) / determinant
            step_north = (turn_east * constant - by_east * linear) / determinant
            east, north = east + step_east, north + step_north
            if self.k * (abs(step_east) + abs(step_north)) < UNSEEN_RAD / NEAR:
                left_quadratic, left_cubic = (
                    phase if abs(phase := self.k * of_range) > self.rounding else 0.0
                    for of_range in (
                        sum(map(mul, quadratic, left)) + quadratic_east * step_east + quadratic_north * step_north,
                        sum(map(mul, cubic, left)) + cubic_east * step_east + cubic_north * step_north,
                    )
                )
                return ExactPhases((east, north), left_quadratic, left_cubic)
        return None


def _track(state: PlatformState, times: Samples, east: float, north: float) -> Track:
    (x, y, z), (u, v, w), (a, b, c) = state.position, state.velocity, state.acceleration
    x, y = x - east, y - north
    if state.bends:
        return [(p - east, q - north, r) for (p, q, r), _ in map(state.at, times)]
    return [(x + tau * (u + tau * a / 2), y + tau * (v + tau * b / 2), z + tau * (w + tau * c / 2)) for tau in times]


def _sums(one: Track, other: Track) -> Track:
    return [(a + x, b + y, c + z) for (a, b, c), (x, y, z) in zip(one, other, strict=True)]


def _sum(weights: Samples, samples: Samples) -> float:
    total: float = sum(map(mul, weights, samples))
    return total
