"""Effects of errors of any size by exact ranges, in many cases at once: no expansion.

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
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property, reduce
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.constants import ROUNDING, SPEED_OF_LIGHT
from bisar_budget.evaluators import LEGENDRE_FITS, full_ground_inverse
from bisar_budget.geometry import BistaticGeometry, GroundVector, PlatformState, Vectors, dot, norm

Floats = NDArray[np.float64]
Places = NDArray[np.intp]
Truths = NDArray[np.bool_]

# Way of a platform in half an aperture, over its slant range, up to which so many nodes change phases by less than
# 1e-6 of themselves; beyond the last, 16 nodes are right to 1e-3 at 1.25.
NODES = ((0.1, 6), (0.5, 10), (math.inf, 16))
FINE = 24  # nodes of courses that are not as smooth as those of (22)
ITERATIONS = 40
MEASURED, WORKED_ON = 8, 15  # arrays of all samples that hold measured paths; and these with what is worked on
TOGETHER = 1 << 16  # samples of lanes: what is made of them stays in a cache
STEPS = 8  # in which a point is followed by errors of any course
MEETS = 1e-5  # of the nearest range; of a platform that is nearer, rounding decides in which direction it is seen
NEAR = 0.003  # of the nearest slant range; a point so near to the centre has slopes that differ by no more
SKEWED = 0.01  # the same over the sine between the gradients, where they are near to parallel
BENT = 0.05  # of what Doppler turns by at the centre: velocity errors turn it by less, or its slopes are others
FEW = 4
SHRINKS = 0.5  # square of each step of the search over that of the one before; else it does not settle
EPSILON = 2e-15  # of a range sum: what rounding of a few operations leaves
AT_FOLD = 0.1  # of what gradients span at the centre: with less, what they span changes much in a small step
OF_UNSEEN = 1e-4  # of the square of a last step elsewhere, that is left of the last one there
UNSEEN_RAD = 3e-5  # what the last step of the search may change a phase by beyond the part counted linearly

STILL = [np.zeros((1, 1))] * 3  # a platform that no error moves


class Sampling(NamedTuple):
    """When a history is sampled: slow times over −1 … 1, in half apertures, (samples,); and the weights that fit it.

    The weights (4, samples) are those of `LEGENDRE_FITS`: value, slope, quadratic and cubic at the edge.
    """

    places: Floats
    fit: Floats


@cache
def nodes(count: int) -> Sampling:
    """Sampling at so many nodes of Gauss-Legendre quadrature."""
    places, *fit = LEGENDRE_FITS[count]
    return Sampling(np.array(places), np.array(fit))


def aperture_nodes(aperture_time_s: float) -> Floats:
    """Slow times of the nodes of an aperture for courses that are not smooth, (FINE,). [s]"""
    return nodes(FINE).places * (aperture_time_s / 2)


def nodes_for(geometry: BistaticGeometry, aperture_time_s: Any, *, has_direct_path: bool = False) -> Any:
    """Number of nodes that cases need: of the lines of sight, and of the direct path where that counts."""
    half = aperture_time_s / 2
    turning = (*geometry.both, *((geometry.apart,) if has_direct_path else ()))
    way = reduce(np.maximum, [path.travelled(half) / path.slant_range for path in turning])
    limits, counts = zip(*NODES, strict=True)
    found = np.array(counts)[np.searchsorted(limits, way)]
    return found if np.ndim(way) else int(found)


class Effect(NamedTuple):
    """Effect of one unit of an error, signed like the range error; numbers, or arrays of cases.

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
        Of the motion; floats, (lanes,), or (nodes, lanes) of one that turns.
    order : int or (lanes,)
        Power of slow time that a position error grows with, those of velocity turn Doppler; -1 of a clock.
    of_receiver : Vectors, optional
        Direction of the receiver's motion where it is another one.
    """

    case: Places
    at_nodes: Floats
    moves: tuple[Any, Any] = (0.0, 0.0)
    direction: Vectors = (0.0, 0.0, 0.0)
    order: Any = -1
    of_receiver: Vectors | None = None

    @property
    def directions(self) -> tuple[Vectors, Vectors]:
        """Directions in which transmitter and receiver are moved."""
        return self.direction, self.direction if self.of_receiver is None else self.of_receiver

    @property
    def turns(self) -> bool:
        """Whether any direction turns within the aperture."""
        return any(np.ndim(part) > 1 for direction in self.directions for part in direction)

    def turned(self) -> Any:
        """Half of what directions change by from the first node to the last, of both platforms. [m/unit]"""
        if not self.turns:
            return 0.0
        found: Any = 0.0
        for weight, direction in zip(self.moves, self.directions, strict=True):
            x, y, z = (part[-1] - part[0] if np.ndim(part) > 1 else 0.0 * part for part in direction)
            found = found + weight * norm((x, y, z)) / 2
        return found

    @property
    def platforms(self) -> list[int]:
        """Those that any of the lanes moves."""
        return [platform for platform in (0, 1) if np.any(self.moves[platform])]

    def of(self, some: Places) -> "Lanes":
        """Some of the lanes."""
        u, v, x, y, z, order, *others = (
            part.take(some, axis=-1) if isinstance(part, np.ndarray) else part
            for part in (*self.moves, *self.direction, self.order, *(self.of_receiver or ()))
        )
        of_receiver = (others[0], others[1], others[2]) if others else None
        return Lanes(self.case.take(some), self.at_nodes.take(some, axis=1), (u, v), (x, y, z), order, of_receiver)

    def there(self, case: Places) -> "Lanes":
        """The same of lanes, one a case, where cases are chosen anew: errors of `ExactRanges.at`."""
        return replace(self.of(case), case=np.arange(case.size))

    def shifts(self, size: Any) -> list[Any]:
        """Shift of each platform by errors of sizes at the nodes. [m]"""
        along = [self.at_nodes * (size * part) for part in self.direction]
        if self.of_receiver is None:
            return [_weighted(along, weight) for weight in self.moves]
        other = [self.at_nodes * (size * part) for part in self.of_receiver]
        return [_weighted(own, weight) for own, weight in zip((along, other), self.moves, strict=True)]

    def clock(self, size: Any) -> Any:
        """Range error by clocks of errors of sizes at the nodes. [m]"""
        transmitter, receiver = self.moves
        is_clock = 1.0 - np.maximum(transmitter, receiver)
        return self.at_nodes * (size * is_clock) if np.any(is_clock) else np.zeros_like(self.at_nodes)


class SmallErrors(NamedTuple):
    """Small errors that all cases have.

    `courses` of errors over the aperture are (courses, nodes, cases) [m/unit], and `course` is that of each error,
    (errors,). `ways` say how far each moves the transmitter east, north and up, so the receiver, and the range by the
    clock, (errors, 7, cases); what all cases share is there once. Of errors that turn it is `turning` that says so,
    by the place of each, at the nodes, (7, nodes, cases).
    """

    courses: Floats
    course: Places
    ways: Floats
    turning: Mapping[int, Floats] = {}

    @classmethod
    def of(cls, errors: Sequence[Lanes]) -> "SmallErrors":
        """Errors whose lanes are the cases."""
        courses: dict[Any, Floats] = {}
        parts = [part for one in errors for direction in one.directions for part in direction]
        cases = max((np.shape(part)[-1] for part in parts if np.ndim(part)), default=1)
        ways, turning = np.zeros((len(errors), 7, cases)), dict[int, Floats]()
        for index, (lanes, way) in enumerate(zip(errors, ways, strict=True), 1):
            courses[lanes.order if lanes.platforms else -index] = lanes.at_nodes
            if lanes.turns:
                way = turning[index - 1] = np.zeros((7, len(lanes.at_nodes), cases))
            for platform in lanes.platforms:
                for axis, part in enumerate(lanes.directions[platform]):
                    way[3 * platform + axis] = part * lanes.at_nodes if lanes.turns else part
            way[6] = not lanes.platforms
        names = list(courses)
        course = [names.index(one.order if one.platforms else -index) for index, one in enumerate(errors, 1)]
        return cls(np.array(list(courses.values())), np.array(course), ways, turning)

    def there(self, case: Places) -> "SmallErrors":
        """The same errors where cases are chosen anew; as `Lanes.there`."""
        courses, ways, *turning = _of([self.courses, self.ways, *self.turning.values()], case)
        return SmallErrors(courses, self.course, ways, dict(zip(self.turning, turning, strict=True)))


class Found(NamedTuple):
    """Effects of errors by exact ranges; `is_found` where they are certain at once.

    Displacement east, north [m]; quadratic and cubic phase at the aperture edge, signed like β̃ [rad]. `turn` is what
    range and Doppler gradients span there, over what they span at the centre.
    """

    is_found: Truths
    east: Floats
    north: Floats
    quadratic: Floats
    cubic: Floats
    turn: Floats


@dataclass(frozen=True)
class ExactEffect:
    """Effect of one error by exact ranges, in plain numbers.

    Displacement (east, north) [m]; phases at the aperture edge, signed like the range error [rad].
    """

    displacement: GroundVector
    quadratic: float
    cubic: float

    def moved(self, by: GroundVector) -> GroundVector:
        """The displacement and another one together."""
        return self.displacement[0] + by[0], self.displacement[1] + by[1]


class ExactRanges:
    """The exact paths of cases (n,) that need the same number of nodes.

    Parameters
    ----------
    half, k : (n,)
        Half the aperture time [s], and 2π over the wavelength. [rad/m]
    sampling : Sampling
        When the paths are sampled, at nodes or anywhere.
    tracks : sequence of Vectors
        Positions of both platforms at the nodes, as what stands for the scene centre sees them, (nodes, n). [m]
    positions : sequence of Vectors
        The same at the middle of the aperture, (n,). [m]
    has_direct_path : bool
        Whether the direct path is the clock.
    """

    def __init__(
        self,
        half: Floats,
        k: Floats,
        sampling: Sampling,
        tracks: Sequence[Vectors],
        positions: Sequence[Vectors],
        *,
        has_direct_path: bool = False,
    ) -> None:
        self.half, self.k, self.sampling, self.tracks, self.positions = half, k, sampling, tracks, positions
        self.has_direct_path = has_direct_path
        self.fit = sampling.fit
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
        paths: Sequence[PlatformState],
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
        sampling = nodes(count)
        times = sampling.places[:, None] * half
        middles = []
        for path in paths:
            x, y, z = (np.broadcast_to(part, (cases,)) for part in path.position)
            middles.append((x, y, z))
        tracks = [path.place(times) for path in paths]
        return cls(half, k, sampling, tracks, middles, has_direct_path=has_direct_path)

    def at(self, east: Floats, north: Floats, case: Places) -> "ExactRanges":
        """Exact ranges of cases at points of the ground, (case,), in place of the centre. [m]"""
        tracks = [(x - east, y - north, z) for x, y, z in (_of([*track], case) for track in self.tracks)]
        positions = [(x[case] - east, y[case] - north, z[case]) for x, y, z in self.positions]
        return ExactRanges(
            self.half[case], self.k[case], self.sampling, tracks, positions, has_direct_path=self.has_direct_path
        )

    @cached_property
    def times(self) -> Floats:
        """Slow times of the nodes, (nodes, cases). [s]"""
        times: Floats = self.sampling.places[:, None] * self.half
        return times

    @cached_property
    def slopes(self) -> list[Floats]:
        """Decrease of the range at the nodes per metre east, and north: u_t + u_r on the ground. [m/m]"""
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

    def clock_course(self, terms: Sequence[Any]) -> Floats:
        """Range error at the nodes of a clock error t̃₀ + t̃₁τ + t̃₂τ² + t̃₃τ³, by its terms. [m]"""
        seconds = sum(term * self.times**power for power, term in enumerate(terms) if np.any(term))
        return np.asarray(SPEED_OF_LIGHT * seconds + np.zeros_like(self.times))

    def along(self, platform: int, direction: Vectors) -> Floats:
        """Change of a platform's range at the nodes per metre along a direction, −u·d; if heard, −(u − b)·d."""
        found: Floats = -dot(self.tracks[platform], direction) / self.ranges[platform]
        return found + dot(self.heard_along[platform], direction) if self.has_direct_path else found

    def range_error(self, lanes: Lanes) -> Floats:
        """Range error at the nodes of a small unit of errors, one of each case, or all of a single case. [m/unit]"""
        moved = lanes.clock(1.0)
        for platform in lanes.platforms:
            moved = moved + lanes.moves[platform] * self.along(platform, lanes.directions[platform]) * lanes.at_nodes
        return np.asarray(moved)

    def quadratics_of(self, errors: SmallErrors) -> Floats:
        """Quadratic phase of a unit of small errors, that of `effect`, (errors, cases). [rad/unit]"""
        weights = self.phase_weights[0]
        along = np.empty((7, *weights.shape))  # what a metre does to the range at the nodes, along each way
        for platform in (0, 1):
            of_axes = along[3 * platform : 3 * platform + 3]
            for axis in (0, 1, 2):
                np.divide(self.tracks[platform][axis], -self.ranges[platform], out=of_axes[axis])
            if self.has_direct_path:
                of_axes += self.heard_along[platform]
        along[6] = 1.0
        by_way = np.einsum("cnp,wnp->cwp", weights * errors.courses, along)
        phase = np.einsum("ewp,ewp->ep", errors.ways, by_way[errors.course])
        seen = (np.abs(weights).sum(axis=0) * np.abs(errors.courses).max(axis=1))[errors.course]
        for place, ways in errors.turning.items():
            phase[place] = np.einsum("np,wnp,wnp->p", weights, ways, along)
            seen[place] = np.einsum("np,wnp->p", np.abs(weights), np.abs(ways))
        return np.where(np.abs(phase) > ROUNDING * seen, phase, 0.0)

    @cached_property
    def phase_weights(self) -> tuple[Floats, Floats]:
        """Quadratic and cubic phase per metre at each node, that of the displacement included. [rad/m]"""
        value, slope, *phases = (weights[:, None] for weights in self.fit)
        quadratic, cubic = (
            self.k * own + by_value * value + by_slope / self.half * slope
            for own, (by_value, by_slope) in zip(phases, self.phases_per_term, strict=True)
        )
        return quadratic, cubic

    @cached_property
    def place_weights(self) -> tuple[Floats, Floats]:
        """Displacement east and north per metre of range error at each node. [m/m]"""
        value, slope = (weights[:, None] for weights in self.fit[:2])
        east, north = (
            (by_value * value + by_slope / self.half * slope) / self.determinant
            for by_value, by_slope in self.adjugate
        )
        return east, north

    def effect(self, range_error: Floats) -> Effect:
        """Effect of range errors at the nodes, (..., nodes, cases), that of the displacement included."""
        constant, linear, own, own_cubic = np.moveaxis(self.fit @ range_error, -2, 0)
        linear = linear / self.half
        own, own_cubic = own * self.k, own_cubic * self.k
        size = np.abs(range_error).max(axis=-2) * self.k
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

    # ------------------------------------------------------------------ errors of any size
    def phases(self, lanes: Lanes, size: Floats, near: tuple[Any, Any]) -> Found:
        """Find where errors of given sizes move a point at the centre, and what defocuses there.

        The search starts `near` [m] and has to settle from there at once: `paths` follows a point. Not found is what
        does not, and what lies beyond a line on which range and Doppler gradients are parallel: no error leads there
        from nothing.
        """
        shifts = lanes.shifts(size)
        clock = lanes.clock(size)
        bend = np.abs(size) * np.where(lanes.order == 1, lanes.moves[0] + lanes.moves[1], 0.0)
        if lanes.turns:
            (half,) = _of([self.half], lanes.case)
            bend = bend + np.abs(size) * lanes.turned() / half
        return self.settled(clock, shifts, near, bend, lanes.case)

    def left_over(self, lanes: Lanes, size: Floats, place: tuple[Any, Any]) -> Floats:
        """Range error at the nodes that errors leave at ground points, (nodes, lanes). [m]"""
        room = self._room(lanes.case.size)
        measured = self._measured(lanes.clock(size), lanes.shifts(size), lanes.case, room)
        return _left(measured, *place, room[MEASURED:])

    def _heard(self, shifts: Sequence[Any], case: Places) -> Floats:
        """The c·t̃ at the nodes by shifts of the platforms where the direct path is the clock. [m]"""
        a, b, c = (one - other for one, other in zip(*shifts, strict=True))
        x, y, z, baseline = _of([*self._between, self.baselines], case)
        grown = a * (2 * x + a) + b * (2 * y + b) + c * (2 * z + c)
        return np.asarray(grown / (baseline + np.sqrt(np.abs(baseline * baseline + grown))))

    def way(self, lanes: Lanes, size: Floats, place: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
        """Where points go with larger errors, at the places that errors of sizes move them to. [m/unit]"""
        course = lanes.at_nodes
        east, north = place
        change = lanes.clock(1.0)
        by_east, by_north = np.zeros_like(course), np.zeros_like(course)
        for track, weight, shift, (x, y, z) in zip(
            self.tracks, lanes.moves, lanes.shifts(size), lanes.directions, strict=True
        ):
            a, b, c = (one + moved for one, moved in zip(_of([*track], lanes.case), shift, strict=True))
            a, b = a - east, b - north
            R = np.sqrt(a * a + b * b + c * c)
            by_east, by_north = by_east + a / R, by_north + b / R
            if np.any(weight):
                change = change - weight * course * (a * x + b * y + c * z) / R
        if self.has_direct_path:
            ahead, back = lanes.moves
            x, y, z = (ahead * one - back * other for one, other in zip(*lanes.directions, strict=True))
            a, b, c = _of([*self._between], lanes.case)
            a, b, c = a + size * course * x, b + size * course * y, c + size * course * z
            apart = np.sqrt(a * a + b * b + c * c)
            change = change + np.where(apart > 0, course * (a * x + b * y + c * z) / apart, 0.0)
        (a, c), (b, d), (constant, linear) = (self.fit[:2] @ one for one in (by_east, by_north, change))
        determinant = a * d - b * c
        return (b * linear - d * constant) / determinant, (c * constant - a * linear) / determinant

    def settled(self, clock: Floats, shifts: Sequence[Any], near: Any, bend: Any, case: Places) -> Found:
        """Newton's method for the point; with the slopes of the centre where it stays within reach of that.

        Range errors by clocks (nodes, lanes) [m], three shifts of each platform there [m], where the search starts
        [m], the velocity errors of both platforms [m/s], and the cases of the lanes.
        """
        lanes = clock.shape[1]
        size = max(1, min(lanes, TOGETHER // self.fit.shape[1]))
        found = Found(np.zeros(lanes, dtype=bool), *(np.full(lanes, math.nan) for _ in range(5)))
        start = [np.broadcast_to(np.asarray(one, dtype=float), (lanes,)) for one in near]
        with np.errstate(all="ignore"):
            half, most, reach = _of([self.half, self.bend, self.reach], case)
            is_close = np.hypot(*start) < np.where(bend * half < most, reach, 0.0)
            room = self._room(size)
            for first in range(0, lanes, size):
                some = slice(first, first + size)
                here = Found._make(one[some] for one in found)
                moved = [[along if along.shape[-1] == 1 else along[:, some] for along in one] for one in shifts]
                measured = self._measured(clock[:, some], moved, case[some], room)
                given = [case[some], *(one[some] for one in start), *measured]
                for settle, is_for in ((_PointSearch.near, is_close[some]), (_PointSearch.anywhere, np.True_)):
                    alive = np.flatnonzero(is_for & ~here.is_found)
                    if alive.size:
                        kept: list[Any] = given if alive.size == here.east.size else _some(given, alive)
                        of, east, north, *left = kept
                        settle(
                            _PointSearch(self, here, alive, of, east, north, left, room[MEASURED:, :, : alive.size])
                        )
        return found

    def _room(self, lanes: int) -> Floats:
        """Room in which so many lanes are worked on: the system takes longer to give it than it takes to fill it."""
        return np.empty((WORKED_ON, self.fit.shape[1], lanes))

    def _measured(self, clock: Floats, shifts: Sequence[Any], case: Places, room: Floats) -> list[Floats]:
        """Parts of errors that `_seen` takes, (nodes, lanes): the clock error, and five of each platform, in `room`.

        A range R grows by p/(R + √(R² + p)) where d is added to its vector r, with p = d·(2r + d): that has no
        rounding of the range itself. From a point at g = (east, north) it is p - 2r̂·g + |g|².
        """
        if self.has_direct_path:  # whose own clock errors are nothing
            clock = clock + self._heard(shifts, case)
        found = [clock]
        for track, ranges, (a, b, c), own in zip(
            self.tracks, self.ranges, shifts, (room[:4], room[4:8]), strict=True
        ):
            x, y, z, R = _of([*track, ranges], case)
            u, v, p, whole = own[..., : max(x.shape[-1], a.shape[-1])]  # what all lanes share is worked out once
            np.add(x, a, out=u)
            np.add(y, b, out=v)
            np.add(x, u, out=p)
            p *= a
            np.add(y, v, out=whole)
            whole *= b
            p += whole
            np.add(z, z, out=whole)
            whole += c
            whole *= c
            p += whole
            np.multiply(R, R, out=whole)
            whole += p
            found += [u, v, R, p, whole]
        return found


class _PointSearch:
    """Newton's method for the points of lanes, those that have settled left out: `alive` are their places in `found`.

    With them their cases, the points so far [m], and what is measured, in some room.
    """

    def __init__(
        self,
        exact: ExactRanges,
        found: Found,
        alive: Places,
        of: Places,
        east: Floats,
        north: Floats,
        measured: list[Floats],
        room: Floats,
    ) -> None:
        self.exact, self.found, self.alive, self.of = exact, found, alive, of
        self.east, self.north, self.measured, self.room = east, north, measured, room

    def near(self) -> None:
        """Search with the slopes of the centre: a third of the work, where it settles in a few steps."""
        exact, gradient = self.exact, _of(self.exact.gradient, self.of)
        for _ in range(FEW):
            left = exact.fit @ _left(self.measured, self.east, self.north, self.room)
            _, step_east, step_north, phases = _newton_step(left, *gradient)
            self.east, self.north = self.east + step_east, self.north + step_north
            (k,) = _of([exact.k], self.of)
            is_done = k * (np.abs(step_east) + np.abs(step_north)) < UNSEEN_RAD / NEAR
            self._keep(is_done, phases, np.ones(self.alive.size))
            going = np.flatnonzero(~is_done)
            if not going.size:
                return
            self._go_on(going)
            gradient = _some(gradient, going)

    def anywhere(self) -> None:
        """Search with the slopes of each point."""
        exact, before = self.exact, np.full(self.alive.size, math.inf)
        for _ in range(ITERATIONS):
            seen, nearest = _seen(self.measured, self.east, self.north, self.room)
            determinant, step_east, step_north, phases = _newton_step(*np.matmul(exact.fit, seen))
            self.east, self.north = self.east + step_east, self.north + step_north
            step = step_east * step_east + step_north * step_north
            k, meets, at_centre, half = _of([exact.k, exact.nearest, exact.determinant, exact.half], self.of)
            is_apart = nearest >= MEETS * meets
            turn = determinant / (at_centre * half)
            unseen = np.where(np.abs(turn) < AT_FOLD, OF_UNSEEN * UNSEEN_RAD, UNSEEN_RAD)
            is_done = is_apart & (k * step < unseen * nearest)
            self._keep(is_done & (determinant * at_centre > 0), phases, turn)
            going = np.flatnonzero(~is_done & (step < SHRINKS * before) & is_apart)
            if not going.size:
                return
            before = step
            if going.size < self.alive.size:
                before = step[going]
                self._go_on(going)

    def _go_on(self, going: Places) -> None:
        """Go on with some of the lanes."""
        self.alive, self.of = self.alive[going], self.of[going]
        self.east, self.north = self.east[going], self.north[going]
        self.measured, self.room = _some(self.measured, going), self.room[..., : going.size]

    def _keep(self, is_done: Truths, phases: tuple[Floats, Floats], turn: Floats) -> None:
        """Note the lanes that have settled, phases in metres; what is less than rounding leaves is none."""
        found, places = self.found, self.alive[is_done]
        found.is_found[places] = True
        for kept, one in ((found.east, self.east), (found.north, self.north), (found.turn, turn)):
            kept[places] = one[is_done]
        k, rounding = _of([self.exact.k, self.exact.rounding], self.of[is_done])
        for kept, phase in zip((found.quadratic, found.cubic), phases, strict=True):
            one = k * phase[is_done]
            kept[places] = np.where(np.abs(one) > rounding, one, 0.0)


def _newton_step(
    left: Floats, by_east: Floats, by_north: Floats
) -> tuple[Floats, Floats, Floats, tuple[Floats, Floats]]:
    """Step east and north after which nothing is left of the constant and the linear part, to first order. [m]

    Parts of what is left (4, lanes) [m], and what a step of a metre adds to them. With the step the determinant of
    its equations, and the quadratic and cubic part after it. [m]
    """
    constant, linear, quadratic, cubic = left
    (a, c, quadratic_east, cubic_east), (b, d, quadratic_north, cubic_north) = by_east, by_north
    determinant = a * d - b * c
    east = (b * linear - d * constant) / determinant
    north = (c * constant - a * linear) / determinant
    quadratic = quadratic + quadratic_east * east + quadratic_north * north
    return determinant, east, north, (quadratic, cubic + cubic_east * east + cubic_north * north)


def _weighted(along: Sequence[Any], weight: Any) -> Sequence[Any]:
    """A shift of a platform that lanes move or leave where it is."""
    if np.ndim(weight):
        return [weight * part for part in along]
    return along if weight else STILL


def _grow(platform: Sequence[Floats], east: Any, north: Any, room: Floats, distance: Floats) -> None:
    """Fill with how much longer than the true range a platform's range to points is, and with that range. [m]"""
    u, v, R, p, whole = platform
    grown, other = room[:2]
    np.multiply(u, 2 * east, out=grown)
    np.multiply(v, 2 * north, out=other)
    grown += other
    np.subtract(east * east + north * north, grown, out=grown)
    np.add(whole, grown, out=distance)
    np.sqrt(distance, out=distance)
    grown += p
    np.add(distance, R, out=other)
    grown /= other


def _left(measured: Sequence[Floats], east: Any, north: Any, room: Floats) -> Floats:
    """Range error at the nodes that is left at points (lanes,), (nodes, lanes). [m]"""
    clock, first, second = measured[0], room[:3], room[3:6]
    _grow(measured[1:6], east, north, first, room[6])
    _grow(measured[6:], east, north, second, room[6])
    left: Floats = np.subtract(clock, first[0], out=first[0])
    left -= second[0]
    return left


def _seen(measured: Sequence[Floats], east: Floats, north: Floats, room: Floats) -> tuple[Floats, Floats]:
    """The same, what a metre east, and north, adds to it, (3, nodes, lanes); the least range there, (lanes,). [m]"""
    clock, seen, other, distance, nearest = measured[0], room[:3], room[3:6], room[6], math.inf
    for platform, out in ((measured[1:6], seen), (measured[6:], other)):
        _grow(platform, east, north, out, distance)
        np.subtract(platform[0], east, out=out[1])
        np.subtract(platform[1], north, out=out[2])
        out[1:] /= distance
        nearest = np.minimum(nearest, distance.min(axis=0))
    seen += other
    np.subtract(clock, seen[0], out=seen[0])
    return seen, np.asarray(nearest)


def followed(exact: ExactRanges, clock: Floats, shifts: Sequence[Any], case: Places) -> Found:
    """Find where errors of any course move a point at the centre, in steps from no error on where need be.

    Parameters
    ----------
    exact : ExactRanges
        Of the cases.
    clock : (nodes, lanes)
        Range errors by clocks, none where the direct path is the clock. [m]
    shifts : two of three of (nodes, lanes)
        Of both platforms. [m]
    case : (lanes,)
        The case that each is an error of.

    Returns
    -------
    Found
        NaN where no ground point has the recorded history, or only one to which no error leads from nothing.
    """
    found = exact.settled(clock, shifts, (0.0, 0.0), math.inf, case)
    missed = np.flatnonzero(~found.is_found)
    if missed.size:
        (clock,), shifts = _some([clock], missed), [_some(one, missed) for one in shifts]
        near = np.zeros((2, missed.size))
        for step in range(STEPS):
            part = (step + 1) / STEPS
            ahead = [[part * along for along in one] for one in shifts]
            there = exact.settled(part * clock, ahead, near, math.inf, case[missed])
            near = np.array((there.east, there.north)) * ((step + 2) / (step + 1))  # NaN from the first lost one on
        for whole, later in zip(found, there, strict=True):
            whole[missed] = later
    return found


def _some(arrays: Sequence[Floats], some: Places) -> list[Floats]:
    """Some lanes of arrays (nodes, lanes); what all of them share stays as it is."""
    return [array if array.shape[-1] == 1 else array.take(some, axis=-1) for array in arrays]


_of = _some  # of cases, arrays (nodes, cases) or (cases,): a single case is shared by all lanes
