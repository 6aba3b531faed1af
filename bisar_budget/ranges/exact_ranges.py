"""Effects of errors of any size by exact ranges, in many cases at once: no expansion.

The data hold the ranges of the true path; the processor subtracts the ranges of the measured path. For a ground point
x the range error ρ(τ; x) is the recorded range less the expected range. The phase over band and aperture is 2πfρ/c.
To second order in that phase the image peaks where the phase has the least variance, a constant phase being free:

    V(x) = Var_τ(ρ) + b²⟨ρ²⟩,    b² = B²/(12 f₀²),

for a band of width B, evenly filled, about f₀; ⟨ ⟩ is the mean over the aperture. With the product that belongs to V,
⟨a, c⟩ = (1 + b²)⟨ac⟩ − ⟨a⟩⟨c⟩, the point obeys ⟨∂ρ/∂x, ρ⟩ = 0. Where b is much larger than the square of the turn of
the line of sight, ρ then has no part along the Legendre polynomials P₀ and P₁ of the aperture. A narrow band or a
wide turn leaves a part of both.

Fitted over the aperture at the nodes of Gauss-Legendre quadrature, the P₂ and P₃ parts of ρ at that point are the
quadratic and the cubic phase, and the rest beyond P₃ spreads. The hidden phase holds the part of V that is neither
quadratic, nor cubic, nor rest, which band and turn do not resolve: it is the quadratic phase with the same loss of
the peak.

For errors so small that their effects are proportional to them, `effect` gives the same. Derived here. Images by
direct sums check it in `tests/theory/test_image_point.py`.

A receiver that hears the transmitter takes the direct path as its clock. The data then hold R_t + R_r less the actual
distance of the platforms, and the processor subtracts ranges less the measured distance. No ground point changes that
distance, so it counts like a clock error, c·t̃ = |r̂_t − r̂_r| − |r_t − r_r|, and no other clock error counts.

Samples over the aperture are (nodes, cases). Effects of errors are (nodes, lanes): a lane is one error of one case. A
single case serves any number of lanes.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bisar_budget import image_plane
from bisar_budget.arrays import Booleans, Floats, Indices, PerCase
from bisar_budget.constants import SPEED_OF_LIGHT_MPS, VECTOR_ROUNDING_FRACTION
from bisar_budget.geometry import GroundVector, PlatformState, VectorArrays, Vectors, dot, norm
from bisar_budget.image_plane import FEWEST_PATH_NODES, LEGENDRE_LEADING, GroundMatrix, Sampling, band_variance, nodes

if TYPE_CHECKING:
    from bisar_budget.mission.model import Radar

Shifts = Sequence[Sequence[Floats] | Floats]  # east, north and up of each platform, (nodes, lanes) or alike. [m]

FINE_NODE_COUNT = 24  # nodes of courses less smooth than the courses of (22)
RANGE_ROUNDING_FRACTION = 2e-15  # rounding error of a few operations, as a fraction of a range sum
MAX_TURN_RAD = 1.0  # turn of a line of sight within the aperture up to which Legendre orders have a meaning

# A quadratic phase φ at the aperture edge leaves the phase with a variance of 4φ²/45.
QUADRATIC_OF_VARIANCE = math.sqrt(45 / 4)

NO_SHIFTS = [np.zeros((1, 1))] * 3  # shifts of a platform that no error moves


@dataclass(frozen=True)
class PointSettings:
    """Tunings of the search for the image point.

    Attributes
    ----------
    end_rad : float
        Hidden phase from which a folded path has ended: no ground point has the range history. [rad]
    folded_fraction : float
        Area that the gradients of V span, as a fraction of their area at the centre. A path with a smaller area is
        near a fold or beyond it.
    near_fold_fraction : float
        The same for a path on which the area changes much in a small step, and a peak may fade into another.
    last_step_rad : float
        Largest change of a phase by the last step, beyond the part that is counted linearly. [rad]
    last_step_near_fold_fraction : float
        Square of the last step near a fold, as a fraction of its square elsewhere.
    nearest_fraction : float
        Distance between a platform and a point, as a fraction of the nearest range. At a smaller distance rounding
        decides the line of sight.
    shrinking_ratio : float
        Square of a step of Newton's method over the square of the step before. A larger ratio does not converge.
    bowl_fraction : float
        Determinant of the second derivative of V, as a fraction of the determinant of H. Where V bends less, a step
        uses H alone.
    damping_fraction : float
        Damping of the first step of a descent, as a fraction of the trace of H at the centre.
    damping_ratio : float
        Factor by which the damping changes with each step.
    max_newton_iterations, max_descent_steps : int
        Largest number of steps of both searches.
    course_steps : tuple of int
        Numbers of steps in which `followed` increases an error. The second number is for points that the first loses.
    samples_at_once : int
        Number of samples of lanes whose arrays stay in a cache.
    """

    end_rad: float = math.pi
    folded_fraction: float = 0.2
    near_fold_fraction: float = 0.1
    last_step_rad: float = 3e-5
    last_step_near_fold_fraction: float = 1e-4
    nearest_fraction: float = 1e-5
    shrinking_ratio: float = 0.5
    bowl_fraction: float = 0.05
    damping_fraction: float = 1e-3
    damping_ratio: float = 4.0
    max_newton_iterations: int = 40
    max_descent_steps: int = 80
    course_steps: tuple[int, ...] = (8, 40)
    samples_at_once: int = 1 << 16


POINT_SETTINGS = PointSettings()

# Number of arrays of both platforms that hold measured paths, and the number together with the arrays of a step.
_MEASURED_ARRAY_COUNT, _ARRAY_COUNT = 5, 11


def aperture_nodes(aperture_time_s: float) -> Floats:
    """Slow times of the nodes of an aperture for courses that are not smooth, (FINE_NODE_COUNT,). [s]"""
    return nodes(FINE_NODE_COUNT).places * (aperture_time_s / 2)


class Effect(NamedTuple):
    """Effect of one unit of an error by the published model, signed like the range error; numbers, or arrays.

    Constant [m/unit] and linear [(m/s)/unit] term of the range error at the aperture midpoint; quadratic and cubic
    phase at the aperture edge. [rad/unit]
    """

    constant: PerCase
    linear: PerCase
    qpe: PerCase
    cubic: PerCase


class FullEffect(NamedTuple):
    """Effect of one unit of a small error by the full model; numbers, or arrays of cases.

    Displacement east and north [m/unit]; quadratic and cubic phase at the aperture edge, signed like the range error
    that is left at the displaced point. [rad/unit]
    """

    east: PerCase
    north: PerCase
    qpe: PerCase
    cubic: PerCase


@dataclass(frozen=True, slots=True, eq=False)
class TimeTags:
    """Lanes that are time tags: each takes a platform's path at a later time, p(τ + δt) − p(τ).

    `paths` are the paths of both platforms, `times` the nodes of the cases (nodes, cases) [s]. `case` (lanes,) is the
    case whose path each lane takes, -1 for a lane that is no time tag.
    """

    paths: tuple[PlatformState, PlatformState]
    times: Floats
    case: Indices

    def of(self, lanes: Indices) -> "TimeTags | None":
        """Some of the lanes; None if no lane of them is a time tag."""
        case = self.case.take(lanes)
        return replace(self, case=case) if (case >= 0).any() else None

    def put(self, platform: int, tag_s: Floats, along: Floats, *, is_rate: bool = False) -> list[Any]:
        """Insert a platform's shift by time tags (nodes, lanes) [m], or its rate per second, into other motions."""
        tagged = np.flatnonzero(self.case >= 0)
        (times,), tag_s = _take_cases([self.times], self.case[tagged]), tag_s[:, tagged]
        path = self.paths[platform].of(self.case[tagged])
        shifts = [np.array(np.broadcast_to(component, (len(times), self.case.size))) for component in along]
        moved = path.at(times + tag_s)[1] if is_rate else path.later(times, tag_s)
        for shift, component in zip(shifts, moved, strict=True):
            shift[:, tagged] = component
        return shifts


@dataclass(frozen=True, slots=True, eq=False)
class Lanes:
    """Units of errors, one per lane: a position error of platforms along a direction, or a range error by a clock.

    Attributes
    ----------
    case : (lanes,)
        The case of each error.
    at_nodes : (nodes, lanes)
        Position error, or for a clock the range error [m/unit], or for a time tag its sign.
    moves : (2, lanes)
        1 where the transmitter, or the receiver, moves, else 0.
    directions : (2, 3, nodes, lanes)
        Directions in which a unit of each error moves transmitter and receiver; zero for a platform that does not
        move. For a small time tag the velocity. [m/s] One node if no direction turns, one lane if all lanes share it.
    order : (lanes,)
        Power of slow time with which a position error grows; -1 for a clock. An error of velocity turns Doppler.
    tags : TimeTags, optional
        Paths of the lanes that are time tags, if any lane is.
    """

    case: Indices
    at_nodes: Floats
    moves: Floats
    directions: Floats
    order: Any
    tags: TimeTags | None = None

    @property
    def turns(self) -> bool:
        """Whether any direction turns within the aperture."""
        return bool(self.directions.shape[2] > 1)

    @property
    def platforms(self) -> list[int]:
        """Platforms that any of the lanes moves."""
        return [platform for platform in (0, 1) if self.moves[platform].any()]

    def of(self, lanes: Indices) -> "Lanes":
        """Some of the lanes."""
        moves, directions, order = _take([self.moves, self.directions, self.order], lanes)
        tags, at_nodes = self.tags and self.tags.of(lanes), self.at_nodes.take(lanes, axis=1)
        return Lanes(self.case.take(lanes), at_nodes, moves, directions, order, tags)

    def there(self, case: Indices) -> "Lanes":
        """The lanes, one per case, for a new choice of cases: errors of `ExactRanges.at`."""
        return replace(self.of(case), case=np.arange(case.size))

    def shifts(self, size: Any) -> Floats:
        """Shift of each platform at the nodes by errors of given sizes, (2, 3, nodes, lanes). [m]"""
        course = self.at_nodes * size
        shifts: Floats = self.directions * course
        return shifts if self.tags is None else self._tagged(self.tags, course, shifts)

    def ways(self, size: Any) -> Floats:
        """Directions in which larger errors move transmitter and receiver; for time tags they turn with the paths."""
        if self.tags is None:
            return self.directions
        return self._tagged(self.tags, self.at_nodes * size, self.directions, is_rate=True)

    def _tagged(self, tags: TimeTags, tag_s: Floats, along: Floats, *, is_rate: bool = False) -> Floats:
        """Shifts or directions of both platforms, with those of the time tags in their place."""
        both = np.array([tags.put(platform, tag_s, along[platform], is_rate=is_rate) for platform in (0, 1)])
        return np.asarray(both * self.moves[:, None, None])

    def clock(self, size: Any) -> Floats:
        """Range error at the nodes by clock errors of given sizes. [m]"""
        is_clock = 1.0 - self.moves.max(axis=0)
        return np.asarray(self.at_nodes * (size * is_clock))


class SmallErrors(NamedTuple):
    """Small errors that all cases have.

    `courses` of errors over the aperture are (courses, nodes, cases) [m/unit], and `course` is the index of the
    course of each error, (errors,). `ways` are the shifts by each error, (errors, 7, cases): transmitter east, north
    and up, receiver east, north and up, and the range by the clock. A row that all cases share has one case. For
    errors that turn, `turning` has these shifts at the nodes, (7, nodes, cases), by the index of the error.
    """

    courses: Floats
    course: Indices
    ways: Floats
    turning: Mapping[int, Floats] = {}

    @classmethod
    def of(cls, errors: Sequence[Lanes]) -> "SmallErrors":
        """Small errors from lanes, one `Lanes` per error, whose lanes are the cases."""
        keys = [int(lanes.order[0]) if lanes.platforms else -index for index, lanes in enumerate(errors, 1)]
        courses = dict(zip(keys, (lanes.at_nodes for lanes in errors), strict=True))
        cases = max((lanes.directions.shape[-1] for lanes in errors), default=1)
        ways, turning = np.zeros((len(errors), 7, cases)), dict[int, Floats]()
        for index, (lanes, way) in enumerate(zip(errors, ways, strict=True)):
            if lanes.turns:
                way = turning[index] = np.zeros((7, len(lanes.at_nodes), cases))
            by_axis = lanes.directions.reshape(6, -1, lanes.directions.shape[-1])
            way[:6] = by_axis * lanes.at_nodes if lanes.turns else by_axis[:, 0]
            way[6] = not lanes.platforms
        course = np.array([list(courses).index(key) for key in keys])
        return cls(np.array(list(courses.values())), course, ways, turning)

    def there(self, case: Indices) -> "SmallErrors":
        """The same errors for a new choice of cases, like `Lanes.there`."""
        courses, ways, *turning = _take_cases([self.courses, self.ways, *self.turning.values()], case)
        return SmallErrors(courses, self.course, ways, dict(zip(self.turning, turning, strict=True)))


class ImagePoints(NamedTuple):
    """Effects of errors by exact ranges; `is_settled` where the search was certain at once.

    Displacement east, north [m]; quadratic and cubic phase at the aperture edge, signed like β̃; the `hidden` phase,
    and the rms beyond the cubic. [rad] `turn` is the area that the gradients of V span at the point, over their area
    at the centre.
    """

    is_settled: Booleans
    east: Floats
    north: Floats
    quadratic: Floats
    cubic: Floats
    hidden: Floats
    rest: Floats
    turn: Floats


@dataclass(frozen=True)
class ExactEffect:
    """Effect of one error by exact ranges, in plain numbers.

    Displacement (east, north) [m]; quadratic and cubic phase at the aperture edge, signed like the range error; the
    phase that band and turn hide, and the rms beyond the cubic. [rad]
    """

    displacement: GroundVector
    quadratic: float
    cubic: float
    hidden: float = 0.0
    rest: float = 0.0

    @property
    def equal_loss(self) -> float:
        """Quadratic phase with the same loss of the peak as quadratic and hidden phase together. [rad]"""
        return math.hypot(self.quadratic, self.hidden)

    def moved(self, by: GroundVector) -> GroundVector:
        """Sum of this displacement and a second displacement."""
        return self.displacement[0] + by[0], self.displacement[1] + by[1]


class ExactRanges:
    """The exact paths of cases (n,) that need the same number of nodes.

    Parameters
    ----------
    half, k : (n,)
        Half the aperture time [s], and 2π over the wavelength of the band's centre. [rad/m]
    band : (n,)
        b², the variance of the frequency over the band, over the square of its centre.
    sampling : Sampling
        Slow times at which the paths are sampled, at nodes or anywhere.
    tracks : sequence of Vectors
        Positions of both platforms at the nodes, relative to the scene centre or the point in its place, (nodes, n).
        [m]
    positions : sequence of Vectors
        The same at the middle of the aperture, (n,). [m]
    has_direct_path : bool
        Whether the direct path is the clock.

    Attributes
    ----------
    gradient : (2, 4, n)
        Mean, P₁ part at the edge, quadratic and cubic part of the range error that a metre east, and north, adds.
    """

    def __init__(
        self,
        half: Floats,
        k: Floats,
        band: Floats,
        sampling: Sampling,
        tracks: Sequence[VectorArrays],
        positions: Sequence[VectorArrays],
        *,
        has_direct_path: bool = False,
    ) -> None:
        self.half, self.k, self.band, self.sampling = half, k, band, sampling
        self.tracks, self.positions = tracks, positions
        self.has_direct_path = has_direct_path
        self.fit = sampling.fit
        self.mean = self.fit[0][:, None]
        self.ranges = [norm(track) for track in tracks]
        self.gradient = self.fit @ self.slopes
        self.matrix = GroundMatrix.of(self.slopes, self.fit, band)

    @classmethod
    def of(
        cls,
        paths: Sequence[PlatformState],
        radar: "Radar",
        aperture_time: PerCase,
        count: int,
        cases: int = 1,
        *,
        has_direct_path: bool = False,
    ) -> "ExactRanges":
        """Exact ranges of collections, with paths of transmitter and receiver, at their scene centres."""

        def of_each(value: PerCase) -> Floats:
            return np.array(np.broadcast_to(np.asarray(value, dtype=float), (cases,)))

        half, k, band = (
            of_each(aperture_time) / 2,
            2 * math.pi / of_each(radar.wavelength),
            of_each(band_variance(radar)),
        )
        sampling = nodes(count)
        times = sampling.places[:, None] * half
        middles = []
        for path in paths:
            x, y, z = (np.broadcast_to(component, (cases,)) for component in path.position)
            middles.append((x, y, z))
        tracks = [path.place(times) for path in paths]
        return cls(half, k, band, sampling, tracks, middles, has_direct_path=has_direct_path)

    def at(self, east: Floats, north: Floats, case: Indices) -> "ExactRanges":
        """Exact ranges of cases at points of the ground, (case,), instead of the centre. [m]"""
        tracks = [(x - east, y - north, z) for x, y, z in (_take_cases([*track], case) for track in self.tracks)]
        positions = [(x[case] - east, y[case] - north, z[case]) for x, y, z in self.positions]
        half, k, band = self.half[case], self.k[case], self.band[case]
        return ExactRanges(half, k, band, self.sampling, tracks, positions, has_direct_path=self.has_direct_path)

    @cached_property
    def times(self) -> Floats:
        """Slow times of the nodes, (nodes, cases). [s]"""
        times: Floats = self.sampling.places[:, None] * self.half
        return times

    @cached_property
    def slopes(self) -> Floats:
        """Decrease of the range at the nodes per metre east, and north, u_t + u_r on the ground, (2, nodes, n)."""
        (p, q), (R, S) = self.tracks, self.ranges
        return np.array([p[axis] / R + q[axis] / S for axis in (0, 1)])

    @cached_property
    def _both(self) -> tuple[Floats, Floats]:
        """Positions of both platforms at the nodes, (2, 3, nodes, n), and their ranges, (2, nodes, n). [m]"""
        tracks = np.array([np.broadcast_arrays(*track) for track in self.tracks])
        return tracks, np.array(np.broadcast_arrays(*self.ranges))

    @cached_property
    def sine(self) -> Floats:
        """Sine of the angle between the directions that band and turn resolve at the centre."""
        return self.matrix.sine

    @cached_property
    def product_weights(self) -> Floats:
        """Weights of the parts that `Sampling.centred` gives, in a product of V, (nodes + 1, n)."""
        return np.concatenate(((1 + self.band) * self.mean, self.band[None]))

    @cached_property
    def near_fold(self) -> Floats:
        """Determinant of H below which a point is near a fold, (n,)."""
        return np.asarray(POINT_SETTINGS.near_fold_fraction**2 * self.matrix.determinant)

    @cached_property
    def is_turned(self) -> Booleans:
        """Whether a line of sight turns by more than `MAX_TURN_RAD` between two times of the aperture, (n,)."""
        least = np.full(self.half.shape, math.inf)
        if self.fit.shape[1] > FEWEST_PATH_NODES:  # with fewer nodes no line of sight turns that far
            for track, ranges in zip(self.tracks, self.ranges, strict=True):
                looks = np.stack(np.broadcast_arrays(*(component / ranges for component in track)))
                looks = np.concatenate((looks, self.sampling.to_ends @ looks), axis=1)
                for later in looks.swapaxes(0, 1):
                    least = np.minimum(least, np.einsum("an,amn->mn", later, looks).min(axis=0))
        return np.asarray(least < math.cos(MAX_TURN_RAD))

    @cached_property
    def nearest_node(self) -> Floats:
        """Least range at the nodes. [m]"""
        return np.asarray(np.minimum(*(ranges.min(axis=0) for ranges in self.ranges)))

    @cached_property
    def nearest(self) -> Floats:
        """Least range at the nodes, and at the middle of the aperture, which the nodes may leave out. [m]"""
        return np.asarray(np.minimum(np.minimum(*map(norm, self.positions)), self.nearest_node))

    @cached_property
    def rounding(self) -> Floats:
        """Smallest phase that a phase history in double precision can hold. [rad]"""
        recorded = (self.ranges[0] + self.ranges[1]).max(axis=0)
        if self.has_direct_path:
            recorded = recorded + self.baselines.max(axis=0)
        return np.asarray(RANGE_ROUNDING_FRACTION * self.k * recorded)

    @cached_property
    def _between(self) -> VectorArrays:
        """Position of the transmitter relative to the receiver at the nodes. [m]"""
        (x, y, z), (u, v, w) = self.tracks
        return (x - u, y - v, z - w)

    @cached_property
    def baselines(self) -> Floats:
        """Distances of the platforms at the nodes. [m]"""
        return np.asarray(norm(self._between))

    @cached_property
    def heard_along(self) -> tuple[VectorArrays, VectorArrays]:
        """Unit vectors along the direct path at the nodes: receiver to transmitter, transmitter to receiver."""
        x, y, z = (component / self.baselines for component in self._between)
        return ((x, y, z), (-x, -y, -z))

    # ------------------------------------------------------------------ small errors
    @cached_property
    def powers(self) -> dict[str, Floats]:
        """Position error at the nodes by a unit of an error: 1, τ or τ²/2 of (22)."""
        return {"m": np.ones_like(self.times), "m/s": self.times, "m/s^2": self.times**2 / 2}

    def clock_course(self, terms: Sequence[PerCase]) -> Floats:
        """Range error at the nodes of a clock error t̃₀ + t̃₁τ + t̃₂τ² + t̃₃τ³, by its terms. [m]"""
        seconds = np.zeros_like(self.times)
        for term in reversed(terms):
            seconds = seconds * self.times + term
        return SPEED_OF_LIGHT_MPS * seconds

    def along(self, platform: int, direction: Vectors) -> Floats:
        """Change of a platform's range at the nodes per metre along a direction: −u·d, or −(u − b)·d if heard."""
        change: Floats = -dot(self.tracks[platform], direction) / self.ranges[platform]
        return change + dot(self.heard_along[platform], direction) if self.has_direct_path else change

    def range_error(self, lanes: Lanes) -> Floats:
        """Range error at the nodes by a small unit of errors, one per case, or all of a single case. [m/unit]"""
        moved = lanes.clock(1.0)
        for platform in lanes.platforms:
            x, y, z = lanes.directions[platform]
            moved = moved + self.along(platform, (x, y, z)) * lanes.at_nodes
        return np.asarray(moved)

    def quadratics_of(self, errors: SmallErrors) -> Floats:
        """Quadratic phase by a unit of small errors, as in `effect`, (errors, cases). [rad/unit]"""
        weights = self.phase_weights[0]
        along = np.empty((7, *weights.shape))  # range change at the nodes by a metre along each way
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
        for error_index, ways in errors.turning.items():
            phase[error_index] = np.einsum("np,wnp,wnp->p", weights, ways, along)
            seen[error_index] = np.einsum("np,wnp->p", np.abs(weights), np.abs(ways))
        return np.where(np.abs(phase) > VECTOR_ROUNDING_FRACTION * seen, phase, 0.0)

    @cached_property
    def place_weights(self) -> tuple[Floats, Floats]:
        """Displacement east and north per metre of range error at each node. [m/m]"""
        return self.matrix.place_weights

    @cached_property
    def order_weights(self) -> Floats:
        """Orders 0 to 3 left at the displaced point per metre of range error at each node, (4, nodes, n). [m/m]"""
        (by_east, by_north), (east, north) = self.gradient, self.place_weights
        return np.asarray(self.fit[..., None] + by_east[:, None] * east + by_north[:, None] * north)

    @cached_property
    def phase_weights(self) -> Floats:
        """Quadratic and cubic phase per metre at each node, displacement included, (2, nodes, n). [rad/m]"""
        return np.asarray(self.k * self.order_weights[2:])

    @cached_property
    def hidden_weights(self) -> Floats:
        """Four parts of the hidden phase, one for each order 0 to 3, per metre of range error at each node. [rad/m]

        The array is (4, nodes, n). The square of the hidden phase is the sum of the squares of the parts. The rest of
        the range error beyond order 3 has no part here. Its weight in the hidden phase is only the small b², except
        in cases in which a line of sight turns far.
        """
        of_orders = np.array([self.band, (1 + self.band) / 3, self.band / 5 / 1.5**2, self.band / 7 / 2.5**2])
        of_orders[3] += self.is_turned / (7 * 2.5**2)
        return np.asarray(QUADRATIC_OF_VARIANCE * self.k * np.sqrt(of_orders)[:, None] * self.order_weights)

    @cached_property
    def most_per_metre(self) -> Floats:
        """Bounds of the effects of a range error of at most a metre, for any course, (4, n).

        Quadratic, cubic and hidden phase [rad], and displacement. [m]
        """
        mean, slope, quadratic, cubic = np.abs(self.order_weights).sum(axis=1)
        # The displacement never increases V, which is 1 + b² at most, its variance included.
        hidden = QUADRATIC_OF_VARIANCE * np.sqrt(self.band * (1 + self.band + mean**2) + slope**2 / 3)
        hidden = np.where(self.is_turned, QUADRATIC_OF_VARIANCE * np.sqrt(1 + self.band), hidden)
        east, north = (np.abs(weights).sum(axis=0) for weights in self.place_weights)
        return np.array((self.k * quadratic, self.k * cubic, self.k * hidden, np.hypot(east, north)))

    def effect(self, range_error: Floats) -> FullEffect:
        """Effect of small range errors at the nodes, (..., nodes, cases), with the effect of the displacement."""
        size = np.abs(range_error)
        (east, seen_east), (north, seen_north) = (
            ((weights * range_error).sum(axis=-2), (np.abs(weights) * size).sum(axis=-2))
            for weights in self.place_weights
        )
        orders_here, most = np.moveaxis(self.fit[2:] @ range_error, -2, 0), size.max(axis=-2)
        phases = []
        for order_phase, by_east, by_north in zip(
            orders_here, *(by_metre[2:] for by_metre in self.gradient), strict=True
        ):
            phase = order_phase + by_east * east + by_north * north
            seen = most + np.abs(by_east) * seen_east + np.abs(by_north) * seen_north
            phases.append(self.k * _unless_rounding(phase, seen))
        # Where terms cancel exactly, the rest is rounding and would give a limit where none exists.
        return FullEffect(_unless_rounding(east, seen_east), _unless_rounding(north, seen_north), *phases)

    def left_of_small(self, range_error: Floats, moved: tuple[PerCase, PerCase]) -> Floats:
        """Range error that small errors (..., nodes, cases) leave at the point they move to, (..., cases). [m]"""
        (by_east, by_north), (east, north) = self.slopes, (np.asarray(component)[..., None, :] for component in moved)
        return np.asarray(range_error + by_east * east + by_north * north)

    def unresolved(self, remaining: Floats) -> tuple[Floats, Floats]:
        """Hidden phase, and rms beyond the cubic, of range errors left at the nodes, (..., nodes, cases). [rad]"""
        orders = self.fit @ remaining
        squares = self.mean_squares(remaining, orders)
        return _unresolved(np.moveaxis(orders, -2, 0), squares, self.k, self.band, self.is_turned)

    def mean_squares(self, remaining: Floats, orders: Floats) -> tuple[Floats, Floats]:
        """Mean squares of range errors left at the nodes, and of their rest beyond orders 0 to 3. [m²]"""
        beyond = remaining - self._legendre @ orders
        return self.fit[0] @ (remaining * remaining), self.fit[0] @ (beyond * beyond)

    @cached_property
    def _legendre(self) -> Floats:
        """Orders 0 to 3 at the nodes, each with its leading term equal to 1 at the edge, (nodes, 4)."""
        return np.asarray(np.polynomial.legendre.legvander(self.sampling.places, 3) / LEGENDRE_LEADING)

    # ------------------------------------------------------------------ errors of any size
    def phases(
        self, lanes: Lanes, size: Floats, near: tuple[Floats, Floats], *, is_at_fold: bool = False
    ) -> ImagePoints:
        """Find the point to which errors of given sizes move a point at the centre, and the defocus there.

        The search starts `near` [m]. It finds a point where it settles at once, or, `is_at_fold`, where V leads down
        to the point from the start. `point_paths` follows a point. The search does not find a point beyond a line on
        which range and Doppler gradients are parallel: no growing error leads there.
        """
        return self.settled(lanes.clock(size), lanes.shifts(size), near, lanes.case, is_at_fold=is_at_fold)

    def left_over(self, lanes: Lanes, size: Floats, point: tuple[PerCase, PerCase]) -> Floats:
        """Range error at the nodes that errors leave at ground points, (nodes, lanes). [m]"""
        lane_count = lanes.case.size
        room = self._room(lane_count)
        clock, measured = self._measured(lanes.clock(size), lanes.shifts(size), lanes.case, room)
        east, north = (np.broadcast_to(component, lane_count) for component in point)
        growth, _, _ = _grown(measured, np.array((east, north)), room[_MEASURED_ARRAY_COUNT:])
        return np.asarray(clock - growth[0] - growth[1])

    def _heard(self, shifts: Iterable[Any], case: Indices) -> Floats:
        """The c·t̃ at the nodes by shifts of the platforms if the direct path is the clock. [m]"""
        a, b, c = (of_transmitter - of_receiver for of_transmitter, of_receiver in zip(*shifts, strict=True))
        x, y, z, baseline = _take_cases([*self._between, self.baselines], case)
        grown = a * (2 * x + a) + b * (2 * y + b) + c * (2 * z + c)
        return np.asarray(grown / (baseline + np.sqrt(np.abs(baseline * baseline + grown))))

    def way(self, lanes: Lanes, size: Floats, point: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
        """Motion of points with growing errors, at the points to which errors of given sizes move them. [m/unit]

        It is the motion of the least of V: by the second derivative of V, and by the change of its slope with the
        error.
        """
        course, ways, shifts = lanes.at_nodes, lanes.ways(size), lanes.shifts(size)
        tracks, true_ranges = _take_cases(self._both, lanes.case)
        vectors = tracks + shifts
        vectors[:, :2] -= np.array(point)[:, None]
        distances = np.sqrt(np.einsum("panc,panc->pnc", vectors, vectors))
        vectors /= distances[:, None]
        looks = vectors[:, :2]
        along = np.einsum("panc,panc->pnc", vectors, ways)
        turns = (course / distances[:, None] * (ways[:, :2] - along[:, None] * looks)).sum(axis=0)
        remaining = lanes.clock(size) + (true_ranges - distances).sum(axis=0)
        change = lanes.clock(1.0) - course * along.sum(axis=0)
        if self.has_direct_path:
            (baseline,) = _take_cases([self.baselines], lanes.case)
            vector, way = tracks[0] - tracks[1] + shifts[0] - shifts[1], ways[0] - ways[1]
            apart = np.sqrt((vector * vector).sum(axis=0))
            remaining += apart - baseline
            change += np.where(apart > 0, course * (vector * way).sum(axis=0) / apart, 0.0)
        (weights,) = _take_cases([self.product_weights], lanes.case)
        seen = np.array((remaining, *looks.sum(axis=0)))
        view = _GroundView(seen, looks.swapaxes(0, 1), distances, self.sampling.centred, weights)
        east, north = view.step(view.products(change) + (view.node_weights * turns).sum(axis=1))
        return east, north

    def settled(
        self, clock: Floats, shifts: Iterable[Any], near: Any, case: Indices, *, is_at_fold: bool = False
    ) -> ImagePoints:
        """Newton's method for the least of V, or `is_at_fold` a descent.

        `clock` are range errors by clocks (nodes, lanes) [m], `shifts` three shifts of each platform at the nodes
        [m], `near` the start of the search [m], and `case` the cases of the lanes.
        """
        lanes = clock.shape[1]
        size = max(1, min(lanes, POINT_SETTINGS.samples_at_once // self.fit.shape[1]))
        points = ImagePoints(np.zeros(lanes, dtype=bool), *np.full((7, lanes), math.nan))
        start = np.empty((2, lanes))
        start[0], start[1] = near
        with np.errstate(all="ignore"):
            room = self._room(size)
            for first in range(0, lanes, size):
                block = slice(first, first + size)
                moved = [
                    [along if along.shape[-1] == 1 else along[:, block] for along in values] for values in shifts
                ]
                measured = self._measured(clock[:, block], moved, case[block], room)
                search = _PointSearch(self, case[block], start[:, block], *measured, room)
                search.descend() if is_at_fold else search.run()
                search.store(ImagePoints._make(values[block] for values in points))
        return points

    def _room(self, lanes: int) -> Floats:
        """Work arrays for a number of lanes, allocated once because allocation takes longer than filling them."""
        return np.empty((_ARRAY_COUNT, 2, self.fit.shape[1], lanes))

    def _measured(self, clock: Floats, shifts: Iterable[Any], case: Indices, room: Floats) -> tuple[Floats, Floats]:
        """Parts of errors that `_grown` takes: the clock error, and five arrays (2, nodes, lanes), in `room`.

        If d is added to a platform's vector r, its range R grows by p/(R + √(R² + p)), with p = d·(2r + d). This form
        has no rounding of the range itself. From a point at g = (east, north) the growth has p - g·(2r̂ - g) instead.
        """
        if self.has_direct_path:  # no other clock error counts
            clock = clock + self._heard(shifts, case)
        measured = room[:_MEASURED_ARRAY_COUNT, ..., : case.size]
        for platform, (track, (a, b, c)) in enumerate(zip(self.tracks, shifts, strict=True)):
            x, y, z, R = _take_cases([*track, self.ranges[platform]], case)
            u, v, p, true_range, squared_range = measured[:, platform]
            np.add(x, a, out=u)
            np.add(y, b, out=v)
            np.add(x, u, out=p)
            p *= a
            np.add(y, v, out=squared_range)
            squared_range *= b
            p += squared_range
            np.add(z, z, out=squared_range)
            squared_range += c
            squared_range *= c
            p += squared_range
            true_range[:] = R
            np.multiply(R, R, out=squared_range)
            squared_range += p
        return clock, measured


class _PointSearch:
    """Newton's method for the points of lanes, by the range errors that measured paths leave.

    `lane` are the indices of the lanes that have not settled, `of` their cases, and `point` their points so far,
    east and north. [m] `settled` holds the lanes that settled in each step: indices, what was seen before the step,
    the determinant of H there, the step, and the points after it.
    """

    def __init__(
        self, exact: ExactRanges, of: Indices, point: Floats, clock: Floats, measured: Floats, room: Floats
    ) -> None:
        self.exact, self.of, self.point, self.clock, self.measured = exact, of, point, clock, measured
        self.case, self.lane = of, np.arange(of.size)
        self.room = room[_MEASURED_ARRAY_COUNT:, ..., : of.size]
        self.settled: list[list[Any]] = []
        self._set_cases()

    def run(self) -> None:
        """Search with the slopes of each point."""
        before = np.full(self.lane.size, math.inf)
        for _ in range(POINT_SETTINGS.max_newton_iterations):
            view = self._view()
            step = view.step(view.slope)
            self.point = self.point + step
            square = step[0] ** 2 + step[1] ** 2
            is_apart = view.nearest >= self.least_range
            is_done = is_apart & (square < self._last_step(view) * view.nearest)
            self._keep(np.flatnonzero(is_done), view, step)
            going = np.flatnonzero(~is_done & (square < POINT_SETTINGS.shrinking_ratio * before) & is_apart)
            if not going.size:
                return
            before = square
            if going.size < self.lane.size:
                before = square[going]
                self._go_on(going)

    def descend(self) -> None:
        """Search by damped steps that only go down V. It is slower, and safe where V hardly bends, as near a fold."""
        exact, count = self.exact, self.lane.size
        (trace,) = _take_cases([exact.matrix.xx + exact.matrix.yy], self.of)
        damping, is_going = POINT_SETTINGS.damping_fraction * trace, np.ones(count, dtype=bool)
        least, best_point, slope, bends = np.full(count, math.inf), self.point, *np.zeros((2, 3, count))
        slope = slope[:2]
        for _ in range(POINT_SETTINGS.max_descent_steps):
            view = self._view()
            variance = view.variance
            falls = variance <= least
            least = np.minimum(least, variance)
            damping = damping * np.where(falls, 1 / POINT_SETTINGS.damping_ratio, POINT_SETTINGS.damping_ratio)
            best_point = np.where(falls, self.point, best_point)
            xx, xy, yy = bends = np.where(falls, view.bends, bends)
            slope = np.where(falls, view.slope, slope)
            flattest = (xx + yy) / 2 - np.hypot((xx - yy) / 2, xy)
            more = np.maximum(damping, -2 * flattest)
            step = _solved((xx + more, xy, yy + more), slope)
            last_step = POINT_SETTINGS.last_step_near_fold_fraction * POINT_SETTINGS.last_step_rad / self.k
            is_done = falls & (step[0] ** 2 + step[1] ** 2 < last_step * view.nearest)
            is_done &= view.nearest >= self.least_range
            self._keep(np.flatnonzero(is_going & is_done), view, step)
            is_going &= ~is_done
            if not is_going.any():
                return
            self.point = best_point + step

    def store(self, points: ImagePoints) -> None:
        """Store the points of the lanes that have settled, and the defocus there, unless they are beyond a fold.

        The range error is what was left before the last step, plus the change by the step. A phase below the rounding
        counts as 0.
        """
        if not self.settled:
            return
        exact = self.exact
        by_step = zip(*self.settled, strict=True)
        lanes, seen, determinant, step, point = (np.concatenate(arrays, axis=-1) for arrays in by_step)
        case = self.case[lanes]
        k, band, rounding = _take_cases([exact.k, exact.band, exact.rounding], case)
        orientation = image_plane.orientation(seen[1:], exact.fit, band, determinant)
        turn = image_plane.turn(determinant, orientation, exact.matrix, case)
        remaining = seen[0] + seen[1] * step[0] + seen[2] * step[1]
        orders = exact.fit @ remaining
        is_turned = exact.is_turned if exact.is_turned.size == 1 else exact.is_turned[case]
        hidden, beyond_cubic = _unresolved(orders, exact.mean_squares(remaining, orders), k, band, is_turned)
        phases = np.array((k * orders[2], k * orders[3], hidden, beyond_cubic))
        phases = np.where(np.abs(phases) > rounding, phases, 0.0)
        is_ahead = turn > -POINT_SETTINGS.folded_fraction
        lanes = lanes[is_ahead]
        points.is_settled[lanes] = True
        for kept, values in zip(points[1:], (*point, *phases, turn), strict=True):
            kept[lanes] = values[is_ahead]

    def _view(self) -> "_GroundView":
        """View of the ground at the points so far."""
        growth, looks, distances = _grown(self.measured, self.point, self.room)
        seen = np.empty((3, *growth.shape[1:]))
        np.subtract(self.clock, growth[0], out=seen[0])
        seen[0] -= growth[1]
        looks /= distances
        np.add(looks[:, 0], looks[:, 1], out=seen[1:])
        return _GroundView(seen, looks, distances, self.exact.sampling.centred, self.weights)

    def _last_step(self, view: "_GroundView") -> Floats:
        """Square of a step after which a lane has settled, over the distance to the nearer platform. [m]"""
        is_near_fold = view.determinant < self.near_fold
        smaller, usual = (
            POINT_SETTINGS.last_step_near_fold_fraction * POINT_SETTINGS.last_step_rad,
            POINT_SETTINGS.last_step_rad,
        )
        return np.asarray(np.where(is_near_fold, smaller, usual) / self.k)

    def _set_cases(self) -> None:
        """Numbers of the cases of the lanes."""
        exact = self.exact
        of_cases = [exact.k, POINT_SETTINGS.nearest_fraction * exact.nearest, exact.near_fold, exact.product_weights]
        self.k, self.least_range, self.near_fold, self.weights = _take_cases(of_cases, self.of)

    def _go_on(self, going: Indices) -> None:
        """Go on with some of the lanes."""
        self.lane, self.of = self.lane[going], self.of[going]
        self.point, self.clock, self.measured = _take([self.point, self.clock, self.measured], going)
        self.room = self.room[..., : going.size]
        if self.exact.k.size > 1:
            self._set_cases()

    def _keep(self, done: Indices, view: "_GroundView", step: Floats) -> None:
        """Mark the lanes `lane[done]` as settled, and store their view, point, step and determinant."""
        if done.size:
            arrays = [self.lane, view.seen, view.determinant, step, self.point]
            self.settled.append(arrays if done.size == self.lane.size else _take(arrays, done))


class _GroundView:
    """View of the ground from points.

    Attributes
    ----------
    seen : (3, nodes, lanes)
        Range errors left at the nodes [m], and what a metre east, and north, adds to them. [m/m]
    looks : (2, 2, nodes, lanes)
        Lines of sight over the ground, by axis and platform.
    distances : (2, nodes, lanes)
        Ranges of both platforms. [m]
    nearest : (lanes,)
        The smallest range. [m]
    slope : (2, lanes)
        Half the slope of V, east and north. [m]
    matrix : (2, 2, lanes)
        The matrix H.
    determinant : (lanes,)
        Determinant of H.
    """

    def __init__(self, seen: Floats, looks: Floats, distances: Floats, centred: Floats, weights: Floats) -> None:
        self.seen, self.looks, self.distances, self._centred = seen, looks, distances, centred
        self.nearest = distances.min(axis=(0, 1))
        self._parts = centred @ seen
        self._weighted = weights * self._parts
        products = np.einsum("anc,bnc->abc", self._weighted[1:], self._parts)
        self.slope, self.matrix = products[:, 0], products[:, 1:]
        (xx, xy), (_, yy) = self.matrix
        self.determinant = xx * yy - xy * xy

    @property
    def variance(self) -> Floats:
        """V at the points, (lanes,). [m²]"""
        return np.asarray(np.einsum("nc,nc->c", self._weighted[0], self._parts[0]))

    @cached_property
    def node_weights(self) -> Floats:
        """Weights at the nodes whose sum with a history is its product of V with the range error, (nodes, lanes)."""
        return np.asarray(self._centred.T @ self._weighted[0])

    @cached_property
    def bends(self) -> tuple[Floats, Floats, Floats]:
        """Half the second derivative of V: east and east, east and north, north and north."""
        bends = self.node_weights / self.distances
        turned, total = np.einsum("apnc,bpnc->abc", self.looks * bends, self.looks), bends.sum(axis=(0, 1))
        (xx, xy), (_, yy) = self.matrix + turned
        return xx - total, xy, yy - total

    def products(self, values: Floats) -> Floats:
        """Products of V of a history at the nodes with the range that a metre east, and north, adds, (2, lanes)."""
        return np.asarray(np.einsum("anc,nc->ac", self._weighted[1:], self._centred @ values))

    def step(self, slope: Floats) -> Floats:
        """Step that removes half a slope of V, by its second derivative; where V is no bowl, by H alone. [m]"""
        xx, xy, yy = self.bends
        is_bowl = (xx * yy - xy * xy > POINT_SETTINGS.bowl_fraction * self.determinant) & (xx > 0)
        if not is_bowl.all():
            (h_xx, h_xy), (_, h_yy) = self.matrix
            xx, xy, yy = np.where(is_bowl, self.bends, (h_xx, h_xy, h_yy))
        return _solved((xx, xy, yy), slope)


def _solved(bends: Sequence[Floats], slope: Floats) -> Floats:
    """Step that removes half a slope of V, by half the second derivative of V, (2, lanes). [m]"""
    (xx, xy, yy), (x, y) = bends, slope
    return np.asarray((xy * y - yy * x, xy * x - xx * y) / (xx * yy - xy * xy))


def _unresolved(
    orders: Floats, squares: tuple[Floats, Floats], k: Floats, band: Floats, is_turned: Booleans
) -> tuple[Floats, Floats]:
    """Hidden phase, and rms beyond the cubic, by orders 0 to 3 at the edge [m] and mean squares. [m²], [rad]"""
    _, slope, _, cubic = orders
    square, beyond_cubic = squares
    of_cubic = (cubic / 2.5) ** 2 / 7
    hidden = band * square + slope * slope / 3 + np.where(is_turned, of_cubic + beyond_cubic, 0.0)
    return QUADRATIC_OF_VARIANCE * k * np.sqrt(hidden), k * np.sqrt(beyond_cubic)


def _unless_rounding(value: Floats, seen: Floats) -> Floats:
    return np.where(np.abs(value) <= VECTOR_ROUNDING_FRACTION * seen, 0.0, value)


def _grown(measured: Floats, point: Floats, room: Floats) -> tuple[Floats, Floats, Floats]:
    """Growth of the ranges of both platforms to points (2, lanes), in `room`, (2, nodes, lanes). [m]

    Further the vectors over the ground from the points to the platforms, (2, 2, nodes, lanes), by axis and platform,
    and the ranges, (2, nodes, lanes). [m]
    """
    (p, true_range, squared_range), over_ground, point = measured[2:], measured[:2], point[:, None, None]
    looks, both, grown, distances = room[:2], room[2:4], room[4], room[5]
    np.subtract(over_ground, point, out=looks)
    np.add(over_ground, looks, out=both)
    both *= point
    np.add(both[0], both[1], out=grown)
    np.subtract(squared_range, grown, out=distances)
    np.sqrt(distances, out=distances)
    np.subtract(p, grown, out=grown)
    grown /= np.add(distances, true_range, out=both[0])
    return grown, looks, distances


def followed(exact: ExactRanges, clock: Floats, shifts: Shifts, case: Indices) -> ImagePoints:
    """Find where errors of any course move a point at the centre, if necessary in steps from no error on.

    Parameters
    ----------
    exact : ExactRanges
        Exact ranges of the cases.
    clock : (nodes, lanes)
        Range errors by clocks; zero if the direct path is the clock. [m]
    shifts : two of three of (nodes, lanes)
        Shifts of both platforms. [m]
    case : (lanes,)
        The case of each error.

    Returns
    -------
    ImagePoints
        NaN if no ground point has the recorded history, or only a point to which no growing error leads. As on a path
        of `point_paths`, no point has it if half a cycle is hidden and the gradients of V span little.
    """
    points = _within_ends(exact.settled(clock, shifts, (0.0, 0.0), case))
    for steps in POINT_SETTINGS.course_steps:
        missed = np.flatnonzero(~points.is_settled)
        if not missed.size:
            break
        (noise,), moved = _take([clock], missed), [_take(shift, missed) for shift in shifts]
        near = np.zeros((2, missed.size))
        for step in range(steps):
            fraction = (step + 1) / steps
            ahead = [[fraction * along for along in shift] for shift in moved]
            there = _within_ends(exact.settled(fraction * noise, ahead, near, case[missed]))
            near = np.array((there.east, there.north)) * ((step + 2) / (step + 1))  # NaN from the first lost point on
        for column, later in zip(points, there, strict=True):
            column[missed] = later
    has_ended = (np.abs(points.turn) < POINT_SETTINGS.folded_fraction) & (points.hidden > POINT_SETTINGS.end_rad)
    points.is_settled[has_ended] = False
    for values in points[1:]:
        values[has_ended] = math.nan
    return points


def _within_ends(points: ImagePoints) -> ImagePoints:
    """The points, without points beyond the end of the image."""
    is_gone = (np.abs(points.turn) < POINT_SETTINGS.folded_fraction) & (points.hidden > POINT_SETTINGS.end_rad)
    return ImagePoints(points.is_settled & ~is_gone, *(np.where(is_gone, math.nan, column) for column in points[1:]))


def _take(arrays: Sequence[Floats] | Floats, indices: Indices) -> list[Floats]:
    """Some lanes of arrays (nodes, lanes). An array that all lanes share stays as it is."""
    return [array if array.shape[-1] == 1 else array.take(indices, axis=-1) for array in arrays]


_take_cases = _take  # for cases, arrays (nodes, cases) or (cases,): all lanes share a single case
