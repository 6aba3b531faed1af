"""Exact ranges of many collections at once: the arrays beside `effects.exact_ranges`.

What is sampled over the aperture is (nodes, cases). The algorithms are those of the floats, step by step, so that a
case has the same numbers here as there.
"""

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.arrays.collections import Floats, Geometries, Vectors, dot, norm
from bisar_budget.constants import ROUNDING
from bisar_budget.effects import exact_ranges as scalar
from bisar_budget.evaluators import LEGENDRE_FITS, full_ground_inverse

_STILL = [np.zeros((1, 1))] * 3  # a platform that no error moves


class Effects(NamedTuple):
    """What a unit of an error does in each case, as `Effect`."""

    constant: Any
    linear: Any
    qpe: Any
    cubic: Any


class CourseAtNodes(NamedTuple):
    """A unit of an error at the nodes, (nodes, cases): of the position of `platforms`, or of the range by a clock."""

    at_nodes: Floats
    unit: str
    platforms: tuple[int, ...] = ()
    direction: Vectors = (0.0, 0.0, 0.0)

    def of(self, some: NDArray[Any]) -> "CourseAtNodes":
        """The same in some of the cases."""
        x, y, z = (part[some] if np.ndim(part) else part for part in self.direction)
        return self._replace(at_nodes=self.at_nodes[:, some], direction=(x, y, z))


class Found(NamedTuple):
    """What errors of some cases do by exact ranges; `is_found` where that is certain at once."""

    is_found: NDArray[np.bool_]
    east: Floats
    north: Floats
    quadratic: Floats
    cubic: Floats
    turn: Floats


class ManyExactRanges:
    """`ExactRanges` of cases (n,) that need the same number of nodes.

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
        self.gradient = [
            self._fitted(tracks[0][axis] / self.ranges[0] + tracks[1][axis] / self.ranges[1]) for axis in (0, 1)
        ]
        (s_x, rate_x, *_), (s_y, rate_y, *_) = self.gradient
        self.determinant: Any
        first, second, (self.determinant,) = full_ground_inverse(s_x, s_y, rate_x / half, rate_y / half)
        self.adjugate = (first, second)
        self.range_gradient = np.hypot(s_x, s_y)
        self.sine = (s_x * rate_y - s_y * rate_x) / (self.range_gradient * np.hypot(rate_x, rate_y))

    @classmethod
    def of(
        cls,
        geometries: Geometries,
        wavelength: Any,
        aperture_time: Any,
        count: int,
        cases: int,
        *,
        has_direct_path: bool = False,
    ) -> "ManyExactRanges":
        """Exact ranges of collections, at their scene centres."""
        half: Floats = np.array(np.broadcast_to(np.asarray(aperture_time, dtype=float) / 2, (cases,)))
        k: Floats = np.array(np.broadcast_to(2 * math.pi / np.asarray(wavelength, dtype=float), (cases,)))
        times = np.array(LEGENDRE_FITS[count][0])[:, None] * half
        tracks, positions = [], []
        for path in geometries.both:
            x, y, z = (np.broadcast_to(part, (cases,)) for part in path.position)
            tracks.append(path.at(times))
            positions.append((x, y, z))
        return cls(half, k, count, tracks, positions, has_direct_path=has_direct_path)

    def at(self, east: Floats, north: Floats, some: NDArray[Any]) -> "ManyExactRanges":
        """Exact ranges of some of the cases at points of the ground, (some,), in place of the centre. [m]"""
        of = [[part.take(some, axis=1) for part in track] for track in self.tracks]
        tracks = [(x - east, y - north, z) for x, y, z in of]
        positions = [(x[some] - east, y[some] - north, z[some]) for x, y, z in self.positions]
        return ManyExactRanges(
            self.half[some], self.k[some], self.count, tracks, positions, has_direct_path=self.has_direct_path
        )

    @cached_property
    def times(self) -> Floats:
        """Slow times of the nodes, (nodes, cases). [s]"""
        times: Floats = np.array(LEGENDRE_FITS[self.count][0])[:, None] * self.half
        return times

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
        """Least range at the nodes and at the middle of the aperture. [m]"""
        return np.asarray(np.minimum(np.minimum(*map(norm, self.positions)), self.nearest_node))

    @cached_property
    def rounding(self) -> Floats:
        """A phase history in double precision holds no phase that is smaller. [rad]"""
        recorded = (self.ranges[0] + self.ranges[1]).max(axis=0)
        if self.has_direct_path:
            recorded = recorded + self.baselines.max(axis=0)
        return np.asarray(scalar.EPSILON * self.k * recorded)

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
    def _heard_along(self) -> tuple[Vectors, Vectors]:
        """Unit vectors along the direct path at the nodes, from the other platform to each."""
        x, y, z = (part / self.baselines for part in self._between)
        return ((x, y, z), (-x, -y, -z))

    @cached_property
    def reach(self) -> Floats:
        """Distance from the centre up to which its slopes find a point. [m]"""
        return np.asarray(np.minimum(scalar.NEAR, scalar.SKEWED * np.abs(self.sine)) * self.nearest)

    @cached_property
    def bend(self) -> Floats:
        """Way of both platforms by velocity errors within half an aperture up to which they do. [m]"""
        return np.asarray(scalar.BENT * np.abs(self.determinant) * self.half / self.range_gradient * self.nearest)

    def _fitted(self, samples: Floats) -> Floats:
        """Value, slope over the half aperture, quadratic and cubic at its edge, (4, cases)."""
        fitted: Floats = self.fit @ samples
        return fitted

    @cached_property
    def powers(self) -> dict[str, Floats]:
        """Position error at the nodes of a unit of an error: 1, τ or τ²/2."""
        return {"m": np.ones_like(self.times), "m/s": self.times, "m/s^2": self.times**2 / 2}

    def along(self, platform: int, direction: Vectors) -> Floats:
        """What a metre along a direction does to the range of a platform at the nodes; as `along`."""
        found: Floats = -dot(self.tracks[platform], direction) / self.ranges[platform]
        return found + dot(self._heard_along[platform], direction) if self.has_direct_path else found

    def range_error(self, course: CourseAtNodes) -> Floats:
        """Range error at the nodes of a small unit of any error, before it displaces anything. [m/unit]"""
        if not course.platforms:
            return course.at_nodes
        moved: Floats = sum(self.along(platform, course.direction) for platform in course.platforms)  # type: ignore[assignment]
        return moved * course.at_nodes

    def quadratics_of(self, courses: Sequence[CourseAtNodes]) -> list[Floats]:
        """Quadratic phase of a small unit of each error, that of `effect`, in a tenth of its time. [rad/unit]"""
        weights = self.phase_weights[0]
        whole = np.abs(weights).sum(axis=0)
        of_axes: dict[tuple[int, str], Vectors] = {}
        found = []
        for course in courses:
            for platform in course.platforms:
                if (platform, course.unit) not in of_axes:
                    of_axes[platform, course.unit] = self._along_axes(platform, weights * course.at_nodes)
            if course.platforms:
                phase = sum(dot(of_axes[one, course.unit], course.direction) for one in course.platforms)
                seen = len(course.platforms) * whole * course.at_nodes[-1]
            else:
                parts = weights * course.at_nodes
                phase, seen = parts.sum(axis=0), np.abs(parts).sum(axis=0)
            found.append(np.where(np.abs(phase) > ROUNDING * seen, phase, 0.0))
        return found

    def _along_axes(self, platform: int, weights: Floats) -> Vectors:
        """What a metre at each node, weighted, does along x, y and z."""
        by_metre = -weights / self.ranges[platform]
        x, y, z = ((by_metre * track).sum(axis=0) for track in self.tracks[platform])
        if self.has_direct_path:
            a, b, c = ((weights * part).sum(axis=0) for part in self._heard_along[platform])
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

    def effect(self, range_error: Floats) -> Effects:
        """Effect of a range error at the nodes, that of the displacement included; as `ExactRanges.effect`."""
        constant, linear, own, own_cubic = self._fitted(range_error)
        linear = linear / self.half
        own, own_cubic = own * self.k, own_cubic * self.k
        size = np.abs(range_error).max(axis=0) * self.k
        (q_0, q_1), (c_0, c_1) = self.phases_per_term
        qpe, cubic = own + q_0 * constant + q_1 * linear, own_cubic + c_0 * constant + c_1 * linear
        seen = size + np.abs(q_0 * constant) + np.abs(q_1 * linear)
        seen_cubic = size + np.abs(c_0 * constant) + np.abs(c_1 * linear)
        return Effects(
            constant,
            np.where(np.abs(linear) * self.half <= ROUNDING * size / self.k, 0.0, linear),
            np.where(np.abs(qpe) <= ROUNDING * seen, 0.0, qpe),
            np.where(np.abs(cubic) <= ROUNDING * seen_cubic, 0.0, cubic),
        )

    def displacement(self, effect: Effects, size: Any) -> tuple[Any, Any]:
        """Displacement on the ground by so many units. [m]"""
        scale = size / self.determinant
        (a, b), (c, d) = self.adjugate
        return (
            (a * effect.constant + b * effect.linear) * scale,
            (c * effect.constant + d * effect.linear) * scale,
        )

    def phases(self, error: CourseAtNodes, size: Floats, near: tuple[Any, Any], some: NDArray[Any]) -> Found:
        """Find where an error of some cases moves a point at the centre, and what defocuses there.

        `size` (some,), signed, and `near`, where the search starts, are those of the cases `some`.
        """
        course, _, _, direction = error.of(some)
        if error.platforms:
            along = [course * (size * part) for part in direction]
            shifts = [along if platform in error.platforms else _STILL for platform in (0, 1)]
            clock = self._heard(shifts, some) if self.has_direct_path else np.zeros_like(course)
        else:
            shifts, clock = [_STILL, _STILL], course * size
        bend = np.abs(size) * (len(error.platforms) if error.unit == "m/s" else 0.0)
        return self._settled(clock, shifts, near, bend, some)

    def _heard(self, shifts: Sequence[Any], some: NDArray[Any]) -> Floats:
        """What shifts of the platforms make of c·t̃ at the nodes where the direct path is the clock. [m]"""
        a, b, c = (one - other for one, other in zip(*shifts, strict=True))
        x, y, z = (part[:, some] for part in self._between)
        grown = a * (2 * x + a) + b * (2 * y + b) + c * (2 * z + c)
        baseline = self.baselines[:, some]
        return np.asarray(grown / (baseline + np.sqrt(np.abs(baseline * baseline + grown))))

    def way(
        self, error: CourseAtNodes, size: Floats, place: tuple[Floats, Floats], some: NDArray[Any]
    ) -> tuple[Floats, Floats]:
        """Where the point goes with a larger error, at the places that errors of some cases move it to. [m/unit]"""
        course, _, _, (x, y, z) = error.of(some)
        east, north = place
        change = np.zeros_like(course) if error.platforms else course
        by_east, by_north = np.zeros_like(course), np.zeros_like(course)
        for platform, track in enumerate(self.tracks):
            a, b, c = (part[:, some] for part in track)
            moved = size * course if platform in error.platforms else 0.0
            a, b, c = a + moved * x - east, b + moved * y - north, c + moved * z
            R = np.sqrt(a * a + b * b + c * c)
            by_east, by_north = by_east + a / R, by_north + b / R
            if platform in error.platforms:
                change = change - course * (a * x + b * y + c * z) / R
        if self.has_direct_path and len(error.platforms) == 1:
            side = 1.0 if error.platforms == (0,) else -1.0
            a, b, c = (side * part[:, some] for part in self._between)
            a, b, c = a + size * course * x, b + size * course * y, c + size * course * z
            apart = np.sqrt(a * a + b * b + c * c)
            change = change + np.where(apart > 0, course * (a * x + b * y + c * z) / apart, 0.0)
        (a, c), (b, d), (constant, linear) = (self.fit[:2] @ one for one in (by_east, by_north, change))
        determinant = a * d - b * c
        return (b * linear - d * constant) / determinant, (c * constant - a * linear) / determinant

    def _settled(
        self, clock: Floats, shifts: list[Any], near: tuple[Any, Any], bend: Floats, some: NDArray[Any]
    ) -> Found:
        """Newton's method for the point, as `ExactRanges` has it: with the slopes of the centre where that does."""
        cases = clock.shape[1]
        start = [np.array(np.broadcast_to(one, (cases,)), dtype=float) for one in near]
        found = Found(np.zeros(cases, dtype=bool), *(np.full(cases, math.nan) for _ in range(5)))
        with np.errstate(all="ignore"):
            reach = np.where(bend * self.half[some] < self.bend[some], self.reach[some], 0.0)
            close = np.flatnonzero(np.hypot(*start) < reach)
            if close.size:
                self._settle_near(found, self._measured(clock, shifts, close, some), start, close, some)
            rest = np.flatnonzero(~found.is_found)
            if rest.size:
                self._settle(found, self._measured(clock, shifts, rest, some), start, rest, some)
        return found

    def _measured(self, clock: Floats, shifts: list[Any], alive: NDArray[Any], some: NDArray[Any]) -> list[Floats]:
        """Arrays (nodes, alive): the clock error; position, range and shift of each platform at the nodes."""
        found = _of([clock], alive)
        for track, ranges, shift in zip(self.tracks, self.ranges, shifts, strict=True):
            found += [*_of([*track, ranges], some[alive]), *_of(shift, alive)]
        return found

    def _settle_near(
        self, found: Found, measured: list[Floats], start: list[Floats], alive: NDArray[Any], some: Any
    ) -> None:
        of = some[alive]
        gradient = _of(self.gradient, of)
        east, north = start[0][alive], start[1][alive]
        for _ in range(scalar.FEW):
            (a, c, quadratic_east, cubic_east), (b, d, quadratic_north, cubic_north) = gradient
            determinant = a * d - b * c
            left = measured[0]
            for platform in (measured[1:8], measured[8:]):
                left = left - _grown(platform, east, north)[0]
            constant, linear, quadratic, cubic = self.fit @ left
            step_east = (b * linear - d * constant) / determinant
            step_north = (c * constant - a * linear) / determinant
            east, north = east + step_east, north + step_north
            k = self.k[of]
            is_done = k * (np.abs(step_east) + np.abs(step_north)) < scalar.UNSEEN_RAD / scalar.NEAR
            phases = (
                k * (quadratic + quadratic_east * step_east + quadratic_north * step_north),
                k * (cubic + cubic_east * step_east + cubic_north * step_north),
            )
            self._keep(found, alive, of, is_done, east, north, phases, np.ones(alive.size))
            going = np.flatnonzero(~is_done)
            if not going.size:
                return
            alive, of, east, north = alive[going], of[going], east[going], north[going]
            gradient = _of(gradient, going)
            measured = _of(measured, going)

    def _settle(
        self, found: Found, measured: list[Floats], start: list[Floats], alive: NDArray[Any], some: Any
    ) -> None:
        of = some[alive]
        east, north, before = start[0][alive], start[1][alive], np.full(alive.size, math.inf)
        for _ in range(scalar.ITERATIONS):
            left = measured[0]
            by_east, by_north = np.zeros_like(left), np.zeros_like(left)
            nearest = np.full(alive.size, math.inf)
            for platform in (measured[1:8], measured[8:]):
                grown, u, v, distance = _grown(platform, east, north)
                nearest = np.minimum(nearest, distance.min(axis=0))
                left, by_east, by_north = left - grown, by_east + u / distance, by_north + v / distance
            a, c, quadratic_east, cubic_east = self.fit @ by_east
            b, d, quadratic_north, cubic_north = self.fit @ by_north
            constant, linear, quadratic, cubic = self.fit @ left
            determinant = a * d - b * c
            step_east = (b * linear - d * constant) / determinant
            step_north = (c * constant - a * linear) / determinant
            east, north = east + step_east, north + step_north
            step, k = step_east * step_east + step_north * step_north, self.k[of]
            is_apart = nearest >= scalar.MEETS * self.nearest[of]
            is_done = is_apart & (k * step < scalar.UNSEEN_RAD * nearest)
            phases = (
                k * (quadratic + quadratic_east * step_east + quadratic_north * step_north),
                k * (cubic + cubic_east * step_east + cubic_north * step_north),
            )
            is_right = is_done & (determinant * self.determinant[of] > 0)
            turn = determinant / (self.determinant[of] * self.half[of])
            self._keep(found, alive, of, is_right, east, north, phases, turn)
            going = np.flatnonzero(~is_done & (step < scalar.SHRINKS * before) & is_apart)
            if not going.size:
                return
            alive, of, east, north, before = alive[going], of[going], east[going], north[going], step[going]
            measured = _of(measured, going)

    def _keep(
        self,
        found: Found,
        alive: NDArray[Any],
        of: NDArray[Any],
        is_done: NDArray[np.bool_],
        east: Floats,
        north: Floats,
        phases: tuple[Floats, Floats],
        turn: Floats,
    ) -> None:
        """Note the cases that have settled; what is less than rounding leaves is none."""
        places = alive[is_done]
        found.is_found[places] = True
        found.east[places], found.north[places], found.turn[places] = east[is_done], north[is_done], turn[is_done]
        for kept, phase in zip((found.quadratic, found.cubic), phases, strict=True):
            one = phase[is_done]
            kept[places] = np.where(np.abs(one) > self.rounding[of[is_done]], one, 0.0)


def _grown(platform: list[Floats], east: Floats, north: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """How much longer the range of a platform is to points than it was, without rounding of the ranges themselves.

    With it where the platform is seen from there, east and north, and how far. [m]
    """
    x, y, z, R, a, b, c = platform
    u, v = x + a, y + b
    grown = a * (x + u) + b * (y + v) + c * (z + z + c) - 2 * u * east - 2 * v * north + (east * east + north * north)
    distance = np.sqrt(R * R + grown)
    return grown / (R + distance), u - east, v - north, distance


def _of(arrays: Sequence[Floats], some: NDArray[Any]) -> list[Floats]:
    """Some of the cases of arrays (nodes, cases); a number that all of them share stays as it is."""
    return [array if array.size == 1 else array.take(some, axis=1) for array in arrays]
