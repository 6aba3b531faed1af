"""What errors of any size do by exact ranges, in many cases at once: no expansion.

The data hold the ranges of the true path; the processor subtracts those of the measured one. What is left is fitted
over the whole aperture by Legendre polynomials Pₙ, at the nodes of Gauss-Legendre quadrature (`LEGENDRE_FITS`). The
response sits at the ground point for which nothing is left of P₀ and P₁; what then is left of P₂ and P₃ defocuses.
Of errors so small that their effects are proportional to them, `effect` says the same. Derived here.

A receiver that hears the transmitter takes the direct path as its clock: the data then hold R_t + R_r less the actual
distance of the platforms, and the processor subtracts ranges less the measured one. No ground point changes that
distance, so that it counts like a clock error, c·t̃ = |r̂_t − r̂_r| − |r_t − r_r|, and other clock errors have no part.

What is sampled over the aperture is (nodes, cases); what is asked of errors is (nodes, lanes), a lane being one error
of one case. A single case serves any number of lanes as it stands.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from bisar_budget.constants import ROUNDING, SPEED_OF_LIGHT
from bisar_budget.evaluators import LEGENDRE_FITS, full_ground_inverse
from bisar_budget.geometry import BistaticGeometry

Floats = NDArray[np.float64]
Places = NDArray[np.intp]
Truths = NDArray[np.bool_]
Vectors = tuple[Any, Any, Any]  # three components, each an array or a float

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
CLOCK_POWERS = {"s": 0, "s/s": 1, "1/s": 2, "1/s^2": 3}  # of slow time, by the unit of a clock error
EPSILON = 2e-15  # of a range sum: what rounding of a few operations leaves
UNSEEN_RAD = 3e-5  # what the last step of the search may change a phase by beyond the part counted linearly

_STILL = [np.zeros((1, 1))] * 3  # a platform that no error moves


class AnyPath(Protocol):
    """One platform in one case or in many, at mid-aperture: components are floats or (cases,)."""

    @property
    def position(self) -> Vectors:
        """[m]"""

    @property
    def velocity(self) -> Vectors:
        """[m/s]"""

    @property
    def acceleration(self) -> Vectors:
        """[m/s²]"""

    @property
    def bends(self) -> tuple[Vectors, ...]:
        """Coefficients of τ³, τ⁴, …. [m/s³], [m/s⁴], …"""


def dot(a: Vectors, b: Vectors) -> Any:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def norm(a: Vectors) -> Any:
    """Length."""
    return np.sqrt(dot(a, a))


def nodes_for(geometry: BistaticGeometry, aperture_time_s: float, *, has_direct_path: bool = False) -> int:
    """Number of nodes that a collection needs: of the lines of sight, and of the direct path where that counts."""
    half = aperture_time_s / 2
    turning = (geometry.transmitter, geometry.receiver, *((geometry.apart,) if has_direct_path else ()))
    way = max(state.travelled(half) / state.slant_range for state in turning)
    return next(count for limit, count in NODES if way <= limit)


class Effect(NamedTuple):
    """What one unit of an error does, signed like the range error; numbers, or arrays of cases.

    Constant [m/unit] and linear [(m/s)/unit] term of the range error; quadratic and cubic phase at the
    aperture edge [rad/unit]. By the published model they are coefficients at the aperture midpoint. By the full
    model they are fitted over the aperture, of an error too small for a second order, and its phases hold what the
    displacement of the image adds.
    """

    constant: Any
    linear: Any
    qpe: Any
    cubic: Any


@dataclass(frozen=True, slots=True, eq=False)
class Lanes:
    """Units of errors, one a lane: of the position of platforms along a direction, or of the range by a clock.

    Attributes
    ----------
    case : (lanes,)
        The case that each is an error of.
    at_nodes : (nodes, lanes)
        Position error, of a clock range error. [m/unit]
    moves : two of float or (lanes,)
        1 where transmitter, receiver moves, else 0.
    direction : Vectors
        Of the motion; floats or (lanes,).
    unit : str or (lanes,)
        Of each; velocity errors turn Doppler.
    """

    case: Places
    at_nodes: Floats
    moves: tuple[Any, Any] = (0.0, 0.0)
    direction: Vectors = (0.0, 0.0, 0.0)
    unit: Any = ""

    @property
    def platforms(self) -> list[int]:
        """Those that any of the lanes moves."""
        return [platform for platform in (0, 1) if np.any(self.moves[platform])]

    def of(self, some: Places) -> "Lanes":
        """Some of the lanes."""
        u, v = (part[some] if np.ndim(part) else part for part in self.moves)
        x, y, z = (part[some] if np.ndim(part) else part for part in self.direction)
        unit = self.unit[some] if np.ndim(self.unit) else self.unit
        return Lanes(self.case[some], self.at_nodes.take(some, axis=1), (u, v), (x, y, z), unit)

    def there(self, case: Places) -> "Lanes":
        """The same of lanes, one a case, where cases are chosen anew: errors of `ExactRanges.at`."""
        return replace(self.of(case), case=np.arange(case.size))

    def shifts(self, size: Any) -> list[Any]:
        """Shift of each platform by errors of sizes at the nodes. [m]"""
        along = [self.at_nodes * (size * part) for part in self.direction]
        return [_weighted(along, weight) for weight in self.moves]

    def clock(self, size: Any) -> Any:
        """Range error by clocks of errors of sizes at the nodes. [m]"""
        transmitter, receiver = self.moves
        is_clock = 1.0 - np.maximum(transmitter, receiver)
        return self.at_nodes * (size * is_clock) if np.any(is_clock) else np.zeros_like(self.at_nodes)


def joined(parts: Sequence[Lanes]) -> Lanes:
    """Lanes beside each other."""
    counts = [one.case.size for one in parts]
    kinds = zip(*((*one.moves, *one.direction, one.unit) for one in parts), strict=True)
    u, v, x, y, z, unit = (_beside(of_all, counts) for of_all in kinds)
    case = np.concatenate([one.case for one in parts])
    return Lanes(case, np.concatenate([one.at_nodes for one in parts], axis=1), (u, v), (x, y, z), unit)


def _beside(values: Sequence[Any], counts: Sequence[int]) -> Any:
    """One value for all lanes where they share it, else one for each."""
    if all(np.ndim(value) == 0 and value == values[0] for value in values):
        return values[0]
    return np.concatenate([np.broadcast_to(value, (count,)) for value, count in zip(values, counts, strict=True)])


class Found(NamedTuple):
    """What errors do by exact ranges; `is_found` where that is certain at once.

    Displacement east, north [m]; quadratic and cubic phase at the aperture edge, signed like β̃ [rad]. `turn` is what
    range and Doppler gradients span there, over what they span at the centre.
    """

    is_found: Truths
    east: Floats
    north: Floats
    quadratic: Floats
    cubic: Floats
    turn: Floats


class ExactRanges:
    """The exact paths of cases (n,) that need the same number of nodes.

    Parameters
    ----------
    half, k : (n,)
        Half the aperture time [s], and 2π over the wavelength. [rad/m]
    count : int
        Number of nodes.
    tracks : sequence of Vectors
        Positions of both platforms at the nodes, as what stands for the scene centre sees them, (count, n). [m]
    positions : sequence of Vectors
        The same at the middle of the aperture, (n,). [m]
    has_direct_path : bool
        Whether the direct path is the clock.
    """

    def __init__(
        self,
        half: Floats,
        k: Floats,
        count: int,
        tracks: Sequence[Vectors],
        positions: Sequence[Vectors],
        *,
        has_direct_path: bool = False,
    ) -> None:
        self.half, self.k, self.count, self.tracks, self.positions = half, k, count, tracks, positions
        self.has_direct_path = has_direct_path
        _, *fit = LEGENDRE_FITS[count]
        self.fit: Floats = np.array(fit)  # (4, nodes)
        self.ranges = [norm(track) for track in tracks]
        self.gradient = [self.fit @ one for one in self.slopes]
        (s_x, rate_x, *_), (s_y, rate_y, *_) = self.gradient
        self.determinant: Any
        with np.errstate(all="ignore"):
            first, second, (self.determinant,) = full_ground_inverse(s_x, s_y, rate_x / half, rate_y / half)
            self.adjugate = (first, second)
            self.range_gradient = np.hypot(s_x, s_y)
            self.sine = (s_x * rate_y - s_y * rate_x) / (self.range_gradient * np.hypot(rate_x, rate_y))

    @classmethod
    def of(
        cls,
        paths: Sequence[AnyPath],
        wavelength: Any,
        aperture_time: Any,
        count: int,
        cases: int = 1,
        *,
        has_direct_path: bool = False,
    ) -> "ExactRanges":
        """Exact ranges of collections, at their scene centres: of transmitter and receiver."""
        half: Floats = np.array(np.broadcast_to(np.asarray(aperture_time, dtype=float) / 2, (cases,)))
        k: Floats = np.array(np.broadcast_to(2 * math.pi / np.asarray(wavelength, dtype=float), (cases,)))
        times = np.array(LEGENDRE_FITS[count][0])[:, None] * half
        middles = []
        for path in paths:
            x, y, z = (np.broadcast_to(part, (cases,)) for part in path.position)
            middles.append((x, y, z))
        tracks = [positions(path, times) for path in paths]
        return cls(half, k, count, tracks, middles, has_direct_path=has_direct_path)

    def at(self, east: Floats, north: Floats, case: Places) -> "ExactRanges":
        """Exact ranges of cases at points of the ground, (case,), in place of the centre. [m]"""
        of = [[part.take(case, axis=1) for part in track] for track in self.tracks]
        tracks = [(x - east, y - north, z) for x, y, z in of]
        positions = [(x[case] - east, y[case] - north, z[case]) for x, y, z in self.positions]
        return ExactRanges(
            self.half[case], self.k[case], self.count, tracks, positions, has_direct_path=self.has_direct_path
        )

    @cached_property
    def times(self) -> Floats:
        """Slow times of the nodes, (nodes, cases). [s]"""
        times: Floats = np.array(LEGENDRE_FITS[self.count][0])[:, None] * self.half
        return times

    @cached_property
    def slopes(self) -> list[Floats]:
        """What a metre east, and north, takes from the range at the nodes: u_t + u_r on the ground. [m/m]"""
        (p, q), (R, S) = self.tracks, self.ranges
        return [p[axis] / R + q[axis] / S for axis in (0, 1)]

    @cached_property
    def phases_per_term(self) -> Any:
        """Quadratic phase, and cubic, that the displacement by a unit of the constant and of the linear part adds."""
        (_, _, q_x, c_x), (_, _, q_y, c_y) = self.gradient
        (a, b), (c, d) = self.adjugate
        scale = self.k / self.determinant
        return (
            ((q_x * a + q_y * c) * scale, (q_x * b + q_y * d) * scale),
            ((c_x * a + c_y * c) * scale, (c_x * b + c_y * d) * scale),
        )

    @cached_property
    def nearest_node(self) -> Floats:
        """Least range at the nodes. [m]"""
        return np.asarray(np.minimum(*(ranges.min(axis=0) for ranges in self.ranges)))

    @cached_property
    def nearest(self) -> Floats:
        """Least range at the nodes and, where they leave it out, at the middle of the aperture. [m]"""
        return np.asarray(np.minimum(np.minimum(*map(norm, self.positions)), self.nearest_node))

    @cached_property
    def rounding(self) -> Floats:
        """A phase history in double precision holds no phase that is smaller. [rad]"""
        recorded = (self.ranges[0] + self.ranges[1]).max(axis=0)
        if self.has_direct_path:
            recorded = recorded + self.baselines.max(axis=0)
        return np.asarray(EPSILON * self.k * recorded)

    @cached_property
    def _between(self) -> Vectors:
        """The transmitter at the nodes, as the receiver has it. [m]"""
        (x, y, z), (u, v, w) = self.tracks
        return (x - u, y - v, z - w)

    @cached_property
    def baselines(self) -> Floats:
        """Distances of the platforms at the nodes. [m]"""
        return np.asarray(norm(self._between))

    @cached_property
    def heard_along(self) -> tuple[Vectors, Vectors]:
        """Unit vectors along the direct path at the nodes, from the other platform to each."""
        x, y, z = (part / self.baselines for part in self._between)
        return ((x, y, z), (-x, -y, -z))

    @cached_property
    def reach(self) -> Floats:
        """Distance from the centre up to which its slopes find a point. [m]"""
        return np.asarray(np.minimum(NEAR, SKEWED * np.abs(self.sine)) * self.nearest)

    @cached_property
    def bend(self) -> Floats:
        """Way of both platforms by velocity errors within half an aperture up to which they do. [m]"""
        return np.asarray(BENT * np.abs(self.determinant) * self.half / self.range_gradient * self.nearest)

    # ------------------------------------------------------------------ small errors
    @cached_property
    def powers(self) -> dict[str, Floats]:
        """Position error at the nodes of a unit of an error: 1, τ or τ²/2 of (22)."""
        return {"m": np.ones_like(self.times), "m/s": self.times, "m/s^2": self.times**2 / 2}

    def clock_course(self, unit: str) -> Floats:
        """Range error at the nodes of a unit of a clock error; nothing if the direct path is the clock. [m/unit]"""
        metres: Floats = SPEED_OF_LIGHT * self.times ** CLOCK_POWERS[unit]
        return metres * 0.0 if self.has_direct_path else metres

    def along(self, platform: int, direction: Vectors) -> Floats:
        """What a metre along a direction does to the range of a platform at the nodes, −u·d; if heard, −(u − b)·d."""
        found: Floats = -dot(self.tracks[platform], direction) / self.ranges[platform]
        return found + dot(self.heard_along[platform], direction) if self.has_direct_path else found

    def range_error(self, lanes: Lanes) -> Floats:
        """Range error at the nodes of a small unit of errors, one of each case, or all of a single case. [m/unit]"""
        moved = lanes.clock(1.0)
        for platform in lanes.platforms:
            moved = moved + lanes.moves[platform] * self.along(platform, lanes.direction) * lanes.at_nodes
        return np.asarray(moved)

    def quadratics_of(self, errors: Sequence[Lanes]) -> list[Floats]:
        """Quadratic phase of a small unit of errors that all cases have, that of `effect`, in a tenth of its time.

        [rad/unit]
        """
        weights = self.phase_weights[0]
        whole = np.abs(weights).sum(axis=0)
        of_axes: dict[tuple[int, str], Vectors] = {}
        found = []
        for lanes in errors:
            course, platforms = lanes.at_nodes, lanes.platforms
            phase: Any
            if platforms:
                for platform in platforms:
                    if (platform, lanes.unit) not in of_axes:
                        of_axes[platform, lanes.unit] = self._along_axes(platform, weights * course)
                phase = sum(dot(of_axes[one, lanes.unit], lanes.direction) for one in platforms)
                seen = len(platforms) * whole * course[-1]
            else:
                parts = weights * course
                phase, seen = parts.sum(axis=0), np.abs(parts).sum(axis=0)
            found.append(np.where(np.abs(phase) > ROUNDING * seen, phase, 0.0))
        return found

    def _along_axes(self, platform: int, weights: Floats) -> Vectors:
        """What a metre at each node, weighted, does along x, y and z."""
        by_metre = -weights / self.ranges[platform]
        x, y, z = ((by_metre * track).sum(axis=0) for track in self.tracks[platform])
        if self.has_direct_path:
            a, b, c = ((weights * part).sum(axis=0) for part in self.heard_along[platform])
            x, y, z = x + a, y + b, z + c
        return (x, y, z)

    @cached_property
    def phase_weights(self) -> tuple[Floats, Floats]:
        """What a metre at each node adds to quadratic and cubic phase, that of the displacement included. [rad/m]"""
        value, slope, *phases = (weights[:, None] for weights in self.fit)
        quadratic, cubic = (
            self.k * own + by_value * value + by_slope / self.half * slope
            for own, (by_value, by_slope) in zip(phases, self.phases_per_term, strict=True)
        )
        return quadratic, cubic

    def effect(self, range_error: Floats) -> Effect:
        """Effect of a range error at the nodes, that of the displacement included."""
        lanes = range_error.shape[1:]  # the last axis is that of the cases
        constant, linear, own, own_cubic = (self.fit @ range_error.reshape(self.count, -1)).reshape(4, *lanes)
        linear = linear / self.half
        own, own_cubic = own * self.k, own_cubic * self.k
        size = np.abs(range_error).max(axis=0) * self.k
        (q_0, q_1), (c_0, c_1) = self.phases_per_term
        qpe, cubic = own + (q_0 * constant + q_1 * linear), own_cubic + (c_0 * constant + c_1 * linear)
        seen = size + np.abs(q_0 * constant) + np.abs(q_1 * linear)
        seen_cubic = size + np.abs(c_0 * constant) + np.abs(c_1 * linear)
        # What is left of terms that cancel exactly is rounding, and would make a limit out of nothing.
        return Effect(
            constant,
            np.where(np.abs(linear) * self.half <= ROUNDING * size / self.k, 0.0, linear),
            np.where(np.abs(qpe) <= ROUNDING * seen, 0.0, qpe),
            np.where(np.abs(cubic) <= ROUNDING * seen_cubic, 0.0, cubic),
        )

    def displacement(self, effect: Effect, size: Any) -> tuple[Any, Any]:
        """Displacement on the ground by so many units. [m]"""
        scale = size / self.determinant
        (a, b), (c, d) = self.adjugate
        return (
            (a * effect.constant + b * effect.linear) * scale,
            (c * effect.constant + d * effect.linear) * scale,
        )

    # ------------------------------------------------------------------ errors of any size
    def phases(self, lanes: Lanes, size: Floats, near: tuple[Any, Any]) -> Found:
        """Find where errors of given sizes move a point at the centre, and what defocuses there.

        The search starts `near` [m] and has to settle from there at once: `paths` follows a point. Not found is what
        does not, and what lies beyond a line on which range and Doppler gradients are parallel: no error leads there
        from nothing.
        """
        shifts = lanes.shifts(size)
        clock = lanes.clock(size)
        if self.has_direct_path:  # whose own clock errors are nothing
            clock = clock + self._heard(shifts, lanes.case)
        bend = np.abs(size) * np.where(lanes.unit == "m/s", lanes.moves[0] + lanes.moves[1], 0.0)
        return self.settled(clock, shifts, near, bend, lanes.case)

    def left_over(self, lanes: Lanes, size: Floats, place: tuple[Any, Any]) -> Floats:
        """Range error at the nodes that errors leave at ground points, (nodes, lanes). [m]"""
        shifts = lanes.shifts(size)
        clock = lanes.clock(size)
        if self.has_direct_path:
            clock = clock + self._heard(shifts, lanes.case)
        one = self._measured(clock, shifts, np.arange(lanes.case.size), lanes.case)
        return np.asarray(one[0] - _grown(one[1:8], *place)[0] - _grown(one[8:], *place)[0])

    def _heard(self, shifts: Sequence[Any], case: Places) -> Floats:
        """What shifts of the platforms make of c·t̃ at the nodes where the direct path is the clock. [m]"""
        a, b, c = (one - other for one, other in zip(*shifts, strict=True))
        x, y, z, baseline = _of([*self._between, self.baselines], case)
        grown = a * (2 * x + a) + b * (2 * y + b) + c * (2 * z + c)
        return np.asarray(grown / (baseline + np.sqrt(np.abs(baseline * baseline + grown))))

    def way(self, lanes: Lanes, size: Floats, place: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
        """Where points go with larger errors, at the places that errors of sizes move them to. [m/unit]"""
        (x, y, z), course = lanes.direction, lanes.at_nodes
        east, north = place
        change = lanes.clock(1.0)
        by_east, by_north = np.zeros_like(course), np.zeros_like(course)
        for track, weight, shift in zip(self.tracks, lanes.moves, lanes.shifts(size), strict=True):
            a, b, c = (one + moved for one, moved in zip(_of([*track], lanes.case), shift, strict=True))
            a, b = a - east, b - north
            R = np.sqrt(a * a + b * b + c * c)
            by_east, by_north = by_east + a / R, by_north + b / R
            if np.any(weight):
                change = change - weight * course * (a * x + b * y + c * z) / R
        side = lanes.moves[0] - lanes.moves[1]
        if self.has_direct_path and np.any(side):
            a, b, c = (side * part for part in _of([*self._between], lanes.case))
            a, b, c = a + size * course * x, b + size * course * y, c + size * course * z
            apart = np.sqrt(a * a + b * b + c * c)
            heard = np.where(apart > 0, course * (a * x + b * y + c * z) / apart, 0.0)
            change = change + np.where(side, heard, 0.0)
        (a, c), (b, d), (constant, linear) = (self.fit[:2] @ one for one in (by_east, by_north, change))
        determinant = a * d - b * c
        return (b * linear - d * constant) / determinant, (c * constant - a * linear) / determinant

    def settled(
        self, clock: Floats, shifts: Sequence[Any], near: tuple[Any, Any], bend: Floats, case: Places
    ) -> Found:
        """Newton's method for the point; with the slopes of the centre where it stays within reach of that.

        Range errors by clocks (nodes, lanes) [m], three shifts of each platform there [m], where the search starts
        [m], the velocity errors of both platforms [m/s], and the cases of the lanes.

        A range R grows by p/(R + √(R² + p)) where d is added to its vector r, with p = d·(2r + d): that has no
        rounding of the range itself. From a point at g = (east, north) it is p - 2r̂·g + |g|².
        """
        lanes = clock.shape[1]
        start = [np.array(np.broadcast_to(one, (lanes,)), dtype=float) for one in near]
        found = Found(np.zeros(lanes, dtype=bool), *(np.full(lanes, math.nan) for _ in range(5)))
        with np.errstate(all="ignore"):
            half, most, reach = _of([self.half, self.bend, self.reach], case)
            close = np.flatnonzero(np.hypot(*start) < np.where(bend * half < most, reach, 0.0))
            if close.size:
                self._settle_near(found, self._measured(clock, shifts, close, case), start, close, case)
            rest = np.flatnonzero(~found.is_found)
            if rest.size:
                self._settle(found, self._measured(clock, shifts, rest, case), start, rest, case)
        return found

    def _measured(self, clock: Floats, shifts: Sequence[Any], alive: Places, case: Places) -> list[Floats]:
        """Arrays (nodes, alive): the clock error; position, range and shift of each platform at the nodes."""
        found = _some([clock], alive)
        for track, ranges, shift in zip(self.tracks, self.ranges, shifts, strict=True):
            found += [*_of([*track, ranges], case[alive]), *_some(shift, alive)]
        return found

    def _settle_near(
        self, found: Found, measured: list[Floats], start: list[Floats], alive: Places, case: Places
    ) -> None:
        """Search with the slopes of the centre: a third of the work, where it settles in a few steps."""
        of = case[alive]
        gradient = _of(self.gradient, of)
        east, north = start[0][alive], start[1][alive]
        for _ in range(FEW):
            (a, c, quadratic_east, cubic_east), (b, d, quadratic_north, cubic_north) = gradient
            determinant = a * d - b * c
            left = measured[0] - _grown(measured[1:8], east, north)[0] - _grown(measured[8:], east, north)[0]
            constant, linear, quadratic, cubic = self.fit @ left
            step_east = (b * linear - d * constant) / determinant
            step_north = (c * constant - a * linear) / determinant
            east, north = east + step_east, north + step_north
            (k,) = _of([self.k], of)
            is_done = k * (np.abs(step_east) + np.abs(step_north)) < UNSEEN_RAD / NEAR
            phases = (
                k * (quadratic + quadratic_east * step_east + quadratic_north * step_north),
                k * (cubic + cubic_east * step_east + cubic_north * step_north),
            )
            self._keep(found, alive, of, is_done, east, north, phases, np.ones(alive.size))
            going = np.flatnonzero(~is_done)
            if not going.size:
                return
            alive, of, east, north = alive[going], of[going], east[going], north[going]
            gradient, measured = _some(gradient, going), _some(measured, going)

    def _settle(self, found: Found, measured: list[Floats], start: list[Floats], alive: Places, case: Places) -> None:
        of = case[alive]
        east, north, before = start[0][alive], start[1][alive], np.full(alive.size, math.inf)
        for _ in range(ITERATIONS):
            grown, u, v, near = _grown(measured[1:8], east, north)
            more, x, y, far = _grown(measured[8:], east, north)
            nearest = np.minimum(near, far).min(axis=0)
            left, by_east, by_north = measured[0] - grown - more, u / near + x / far, v / near + y / far
            a, c, quadratic_east, cubic_east = self.fit @ by_east  # what a step of a metre adds to what is left
            b, d, quadratic_north, cubic_north = self.fit @ by_north
            constant, linear, quadratic, cubic = self.fit @ left
            determinant = a * d - b * c
            step_east = (b * linear - d * constant) / determinant
            step_north = (c * constant - a * linear) / determinant
            east, north = east + step_east, north + step_north
            step = step_east * step_east + step_north * step_north
            k, meets, at_centre, half = _of([self.k, self.nearest, self.determinant, self.half], of)
            is_apart = nearest >= MEETS * meets
            is_done = is_apart & (k * step < UNSEEN_RAD * nearest)
            phases = (
                k * (quadratic + quadratic_east * step_east + quadratic_north * step_north),
                k * (cubic + cubic_east * step_east + cubic_north * step_north),
            )
            is_right = is_done & (determinant * at_centre > 0)
            turn = determinant / (at_centre * half)
            self._keep(found, alive, of, is_right, east, north, phases, turn)
            going = np.flatnonzero(~is_done & (step < SHRINKS * before) & is_apart)
            if not going.size:
                return
            alive, of, east, north, before = alive[going], of[going], east[going], north[going], step[going]
            measured = _some(measured, going)

    def _keep(
        self,
        found: Found,
        alive: Places,
        of: Places,
        is_done: Truths,
        east: Floats,
        north: Floats,
        phases: tuple[Floats, Floats],
        turn: Floats,
    ) -> None:
        """Note the lanes that have settled; what is less than rounding leaves is none."""
        places = alive[is_done]
        found.is_found[places] = True
        found.east[places], found.north[places], found.turn[places] = east[is_done], north[is_done], turn[is_done]
        (rounding,) = _of([self.rounding], of[is_done])
        for kept, phase in zip((found.quadratic, found.cubic), phases, strict=True):
            one = phase[is_done]
            kept[places] = np.where(np.abs(one) > rounding, one, 0.0)


def positions(path: AnyPath, times: Floats) -> Vectors:
    """Positions at slow times (nodes, cases). [m]"""
    found = []
    for axis in range(3):
        place = path.position[axis] + times * (path.velocity[axis] + times * path.acceleration[axis] / 2)
        for power, bend in enumerate(path.bends, 3):
            place = place + bend[axis] * times**power
        found.append(np.broadcast_to(place, times.shape))
    return (found[0], found[1], found[2])


def _weighted(along: Sequence[Any], weight: Any) -> Sequence[Any]:
    """A shift of a platform that lanes move or leave where it is."""
    if np.ndim(weight):
        return [weight * part for part in along]
    return along if weight else _STILL


def _grown(platform: list[Floats], east: Any, north: Any) -> tuple[Floats, Floats, Floats, Floats]:
    """How much longer the range of a platform is to points than it was, without rounding of the ranges themselves.

    With it where the platform is seen from there, east and north, and how far. [m]
    """
    x, y, z, R, a, b, c = platform
    u, v = x + a, y + b
    grown = a * (x + u) + b * (y + v) + c * (z + z + c) - 2 * u * east - 2 * v * north + (east * east + north * north)
    distance = np.sqrt(R * R + grown)
    return grown / (R + distance), u - east, v - north, distance


def _some(arrays: Sequence[Floats], some: Places) -> list[Floats]:
    """Some lanes of arrays (nodes, lanes); what all of them share stays as it is."""
    return [array if array.shape[-1] == 1 else array.take(some, axis=-1) for array in arrays]


_of = _some  # of cases, arrays (nodes, cases) or (cases,): a single case is shared by all lanes
