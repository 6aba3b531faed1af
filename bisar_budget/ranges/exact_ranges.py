"""Effects of motion and clock errors of any size, computed from exact ranges without a series expansion.

A case is one collection. All functions take many cases at once.

The recorded data contain the ranges of the true paths. The processor subtracts the ranges of the measured paths. For
a ground point x, the range error ρ(τ; x) is the recorded range minus the range that the processor expects. The phase
at frequency f and slow time τ is 2πfρ/c. To second order in this phase, the image has its peak where the variance of
the phase over band and aperture is smallest. A constant phase has no effect. The image point therefore minimises

    V(x) = Var_τ(ρ) + b²⟨ρ²⟩,    b² = B²/(12 f₀²),

for an evenly filled band of width B about f₀. ⟨ ⟩ is the mean over the aperture. The scalar product of V is ⟨a, c⟩ =
(1 + b²)⟨ac⟩ − ⟨a⟩⟨c⟩, so that V = ⟨ρ, ρ⟩. The image point satisfies ⟨∂ρ/∂x, ρ⟩ = 0. H is the matrix ⟨g, gᵀ⟩ of the
gradient g = ∂ρ/∂x (see `image_plane`). The aperture is the interval −1 … 1 of the Legendre polynomials Pₙ. If b is
much larger than the square of the angle by which the line of sight turns, ρ at the image point has no P₀ part and no
P₁ part. If the band is narrow or the turn is wide, both parts remain.

The range error ρ at the image point is sampled at the nodes of Gauss-Legendre quadrature over the aperture, and
Legendre polynomials are fitted to the samples. The P₂ and P₃ parts are the quadratic and the cubic phase. The
remainder beyond P₃ spreads energy over the image. V has a further contribution, mainly from P₀ and P₁ parts that a
displacement cannot remove, because the band and the turn of the line of sight do not resolve them. The hidden phase
is the quadratic phase that would lower the peak as much as this contribution.

For errors so small that their effects are proportional to them, `ExactRanges.effect` gives the same results. The
method is derived here. `tests/theory/test_image_point.py` checks it against images formed by direct sums.

A receiver that receives the signal of the transmitter directly may use this direct path as its clock. The recorded
range is then R_t + R_r minus the actual distance between the platforms. The processor subtracts the measured ranges
minus the measured distance. The distance is the same for all ground points, so its error has the effect of a clock
error, c·t̃ = |r̂_t − r̂_r| − |r_t − r_r|. No other clock error has an effect in that case.

Arrays of samples over the aperture have the shape (nodes, cases). Arrays for errors have the shape (nodes, lanes). A
lane is one error of one case. If there is only one case, all lanes belong to it.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bisar_budget import image_plane
from bisar_budget.arrays import Booleans, Floats, Indices, PerCase
from bisar_budget.constants import VECTOR_ROUNDING_FRACTION
from bisar_budget.error_kinds.clock_kinds import clock_range_error
from bisar_budget.error_kinds.path_kinds import STATE_KINDS
from bisar_budget.geometry import GroundVector, PlatformState, VectorArrays, Vectors, dot, norm
from bisar_budget.image_plane import FEWEST_PATH_NODES, GroundMatrix, Sampling, band_variance, nodes

if TYPE_CHECKING:
    from bisar_budget.mission.model import Radar

Shifts = Sequence[Sequence[Floats] | Floats]  # [m] east, north, up of each platform; (nodes, lanes) or shared

FINE_NODE_COUNT = 24  # nodes for error histories that are less smooth than the polynomials of (22)
RANGE_ROUNDING_FRACTION = 2e-15  # rounding error of a few operations, as a fraction of a range sum
MAX_TURN_RAD = 1.0  # largest turn of a line of sight within the aperture for which Legendre orders are meaningful

# A phase history that is quadratic, with the value φ at the aperture edge, has the variance 4φ²/45.
QUADRATIC_OF_VARIANCE = math.sqrt(45 / 4)

NO_SHIFTS = [np.zeros((1, 1))] * 3  # shifts of a platform that no error moves


@dataclass(frozen=True)
class PointSettings:
    """Numerical settings of the search for the image point.

    The module docstring defines the matrix H, the gradient g, the hidden phase, and the function V, which has its
    minimum at the image point.

    Attributes
    ----------
    end_rad : float
        Largest hidden phase at which a path of image points continues if the area is below `folded_fraction`. With a
        larger hidden phase the path ends, because no ground point has the recorded range history. [rad]
    folded_fraction : float
        Threshold for the area that the gradient g spans, which is the root of the determinant of H, as a fraction of
        the area at the scene centre. Below this threshold, a path is near a fold or beyond it, and `end_rad` applies.
    near_fold_fraction : float
        Stricter threshold for the same fraction. Below it, the area changes much in a small step, so the last step
        of a search must be smaller (`last_step_near_fold_fraction`). A peak may also fade into a wider peak there.
    last_step_rad : float
        Largest change of a phase that the last step of a search may cause. The part of the change that is linear in
        the step does not count. [rad]
    last_step_near_fold_fraction : float
        Largest accepted square of the last step at a point below `near_fold_fraction`, as a fraction of the largest
        accepted square at all other points.
    nearest_fraction : float
        Smallest accepted distance between a platform and a point, as a fraction of the nearest range. At a smaller
        distance, rounding errors dominate the direction of the line of sight.
    shrinking_ratio : float
        Largest accepted ratio of the square of a Newton step to the square of the step before. If the ratio is
        larger, the iteration does not converge.
    bowl_fraction : float
        Threshold for the determinant of half the second derivative of V, as a fraction of the determinant of H. A
        step uses the second derivative if the fraction is larger, and H otherwise.
    damping_fraction : float
        Damping of the first step of a descent, as a fraction of the trace of H at the scene centre.
    damping_ratio : float
        Factor by which the damping changes with each step.
    max_newton_iterations, max_descent_steps : int
        Largest number of steps of a search by Newton's method, and of a descent.
    course_steps : tuple of int
        Numbers of steps in which `followed` increases an error to its full size. The second number is used for points
        that are lost with the first number.
    samples_at_once : int
        Number of samples (nodes times lanes) that one block processes, so that its arrays fit into a cache.
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

# Numbers of work arrays for both platforms: those for the measured paths, and those plus the arrays of one step.
_MEASURED_ARRAY_COUNT, _ARRAY_COUNT = 5, 11


def aperture_nodes(aperture_time_s: float) -> Floats:
    """Slow times (FINE_NODE_COUNT,) at which error histories are sampled if they are not smooth. [s]"""
    return nodes(FINE_NODE_COUNT).places * (aperture_time_s / 2)


class Effect(NamedTuple):
    """Effect of one unit of an error according to the published model, with the sign of the range error.

    Fields are numbers for a single case, or arrays for many cases. `constant` [m/unit] and `linear` [(m/s)/unit] are
    the constant and the linear term of the range error at the aperture midpoint. `qpe` and `cubic` [rad/unit] are the
    quadratic and the cubic phase at the aperture edge.
    """

    constant: PerCase
    linear: PerCase
    qpe: PerCase
    cubic: PerCase


class FullEffect(NamedTuple):
    """Effect of one unit of a small error according to the full model.

    Fields are numbers for a single case, or arrays for many cases. `east` and `north` [m/unit] are the displacement.
    `qpe` and `cubic` [rad/unit] are the quadratic and the cubic phase at the aperture edge. They have the sign of the
    range error that remains at the displaced point.
    """

    east: PerCase
    north: PerCase
    qpe: PerCase
    cubic: PerCase


@dataclass(frozen=True, slots=True, eq=False)
class TimeTags:
    """Time-tag errors among the errors of `Lanes`.

    A time-tag error δt shifts a platform along its path p by p(τ + δt) − p(τ). `paths` are the paths of transmitter
    and receiver. `times` (nodes, cases) [s] are the slow times of the nodes. `case` (lanes,) is the case of each
    lane, or -1 for a lane whose error is of another kind.
    """

    paths: tuple[PlatformState, PlatformState]
    times: Floats
    case: Indices

    def of(self, lanes: Indices) -> "TimeTags | None":
        """Time tags of the lanes with the indices `lanes`; None if no selected lane has a time-tag error."""
        case = self.case.take(lanes)
        return replace(self, case=case) if (case >= 0).any() else None

    def put(self, platform: int, tag_s: Floats, along: Floats, *, is_rate: bool = False) -> list[Any]:
        """Return a copy of `along` in which the lanes with a time-tag error have the values due to this error.

        `along` has the shifts of one platform, or its directions if `is_rate`. The result is three arrays (nodes,
        lanes), one per axis. The new values are the shifts [m] due to the time-tag errors `tag_s` [s]. If `is_rate`,
        they are the changes of these shifts per second of time-tag error [m/s].
        """
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
    """Unit errors, one per lane: a position error of one or both platforms, a clock error, or a time-tag error.

    Attributes
    ----------
    case : (lanes,)
        The case of each error.
    at_nodes : (nodes, lanes)
        Size of a unit error at the nodes: the position error [m/unit], the range error due to a clock error [m/unit],
        or the sign of a time-tag error.
    moves : (2, lanes)
        1 if the error moves the transmitter (first row) or the receiver (second row), else 0.
    directions : (2, 3, nodes, lanes)
        Directions in which a unit of each error moves transmitter and receiver; zero for a platform that the error
        does not move. For a small time-tag error, the direction is the velocity [m/s]. The node axis has length 1 if
        no direction turns; the lane axis has length 1 if all lanes share the directions.
    order : (lanes,)
        Power of slow time with which a position error grows; -1 for a clock error.
    tags : TimeTags, optional
        Time-tag errors among the lanes; None if there are no such errors.
    """

    case: Indices
    at_nodes: Floats
    moves: Floats
    directions: Floats
    order: Any
    tags: TimeTags | None = None

    @property
    def turns(self) -> bool:
        """Whether the direction of any error changes within the aperture."""
        return bool(self.directions.shape[2] > 1)

    @property
    def platforms(self) -> list[int]:
        """Indices of the platforms that at least one lane moves: 0 for the transmitter, 1 for the receiver."""
        return [platform for platform in (0, 1) if self.moves[platform].any()]

    def of(self, lanes: Indices) -> "Lanes":
        """Select lanes by index."""
        moves, directions, order = _take([self.moves, self.directions, self.order], lanes)
        tags, at_nodes = self.tags and self.tags.of(lanes), self.at_nodes.take(lanes, axis=1)
        return Lanes(self.case.take(lanes), at_nodes, moves, directions, order, tags)

    def there(self, case: Indices) -> "Lanes":
        """Return the errors for the ground points of `ExactRanges.at`, one per entry of `case`.

        The result has one lane per ground point. This object must have one lane per case, in the order of the cases.
        """
        return replace(self.of(case), case=np.arange(case.size))

    def shifts(self, size: Any) -> Floats:
        """Shifts of both platforms at the nodes, caused by errors of given sizes, (2, 3, nodes, lanes). [m]"""
        course = self.at_nodes * size
        shifts: Floats = self.directions * course
        return shifts if self.tags is None else self._tagged(self.tags, course, shifts)

    def ways(self, size: Any) -> Floats:
        """Directions in which both platforms move if errors of the given sizes grow, in the shape of `directions`.

        For time-tag errors, the directions are the velocities at the shifted times, and the shape is (2, 3, nodes,
        lanes).
        """
        if self.tags is None:
            return self.directions
        return self._tagged(self.tags, self.at_nodes * size, self.directions, is_rate=True)

    def _tagged(self, tags: TimeTags, tag_s: Floats, along: Floats, *, is_rate: bool = False) -> Floats:
        """Return a copy of `along` in which the lanes with a time-tag error have the values due to this error.

        `along` has the shifts of both platforms, or their directions if `is_rate`. `TimeTags.put` computes the new
        values.
        """
        both = np.array([tags.put(platform, tag_s, along[platform], is_rate=is_rate) for platform in (0, 1)])
        return np.asarray(both * self.moves[:, None, None])

    def clock(self, size: Any) -> Floats:
        """Range error at the nodes due to clock errors of given sizes, (nodes, lanes). [m]

        It is 0 for errors of another kind.
        """
        is_clock = 1.0 - self.moves.max(axis=0)
        return np.asarray(self.at_nodes * (size * is_clock))


class SmallErrors(NamedTuple):
    """List of small unit errors that all cases have in common; their effects are proportional to their sizes.

    `courses` (courses, nodes, cases) [m/unit] are the distinct error histories over the aperture. `course` (errors,)
    is the index of each error's history. `ways` (errors, 7, cases) are the components of a unit of each error:
    transmitter east, north and up, receiver east, north and up, and the range error due to the clock. The axis of
    cases has length 1 if all cases share the components. `turning` is for errors whose direction changes within the
    aperture. It maps the index of such an error to its components at the nodes, (7, nodes, cases).
    """

    courses: Floats
    course: Indices
    ways: Floats
    turning: Mapping[int, Floats] = {}

    @classmethod
    def of(cls, errors: Sequence[Lanes]) -> "SmallErrors":
        """Combine a list of errors; each is a `Lanes` object with one lane per case."""
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
        """Return the errors for the ground points of `ExactRanges.at`, one per entry of `case`."""
        courses, ways, *turning = _take_cases([self.courses, self.ways, *self.turning.values()], case)
        return SmallErrors(courses, self.course, ways, dict(zip(self.turning, turning, strict=True)))


class ImagePoints(NamedTuple):
    """Image points and the phases that remain there, computed from exact ranges, for one error per lane.

    Each field has the shape (lanes,). `is_settled` is True where the search converged. `east` and `north` [m] are the
    displacement. `quadratic` and `cubic` [rad] are the phases at the aperture edge, with the sign of the range error.
    `hidden` [rad] is the hidden phase that the module docstring defines, and `rest` [rad] the rms of the phase beyond
    the cubic phase. `turn` is an area ratio: the area that the range gradient spans over the aperture at the image
    point, divided by this area at the scene centre. It is negative beyond a fold. The area is the root of the
    determinant of the matrix H in the module docstring.
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
    """Effect of one error, computed from exact ranges, as floats.

    `displacement` [m] is the displacement east and north. `quadratic` and `cubic` [rad] are the phases at the
    aperture edge, with the sign of the range error. `hidden` [rad] is the hidden phase, caused by a range error that
    the band and the turn of the line of sight do not resolve. `rest` [rad] is the rms of the phase beyond the cubic
    phase.
    """

    displacement: GroundVector
    quadratic: float
    cubic: float
    hidden: float = 0.0
    rest: float = 0.0

    @property
    def equal_loss(self) -> float:
        """Quadratic phase that lowers the peak as much as the quadratic and the hidden phase together. [rad]"""
        return math.hypot(self.quadratic, self.hidden)

    def moved(self, by: GroundVector) -> GroundVector:
        """Sum of this displacement and the displacement `by`, east and north. [m]"""
        return self.displacement[0] + by[0], self.displacement[1] + by[1]


class ExactRanges:
    """Exact ranges from both platforms over the aperture, for n cases that need the same number of nodes.

    Parameters
    ----------
    half, k : (n,)
        Half the aperture time [s], and the wavenumber 2π/λ [rad/m] at the band's centre.
    band : (n,)
        b²: variance of the frequency over the band, divided by the square of the centre frequency.
    sampling : Sampling
        Slow times at which the paths are sampled. They may be quadrature nodes or any other times.
    tracks : sequence of Vectors
        Positions of both platforms at the nodes, relative to the scene centre or to the ground point that replaces
        it, (nodes, n). [m]
    positions : sequence of Vectors
        Positions of both platforms at the middle of the aperture, relative to the same point, (n,). [m]
    has_direct_path : bool
        Whether the receiver takes the direct path as its clock.

    Attributes
    ----------
    gradient : (2, 4, n)
        Change of the range error if the ground point moves a metre east (first row) or north (second row). Each row
        has the mean of the change over the aperture, and the values of its linear (P₁), quadratic and cubic parts at
        the aperture edge. [m/m]
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
        """Compute the exact ranges from the platforms of one or many collections to their scene centres.

        `paths` are the paths of transmitter and receiver, and `count` is the number of nodes.
        """

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
        """Compute the exact ranges to ground points instead of the scene centres, one point for each entry of `case`.

        `east` and `north` are the coordinates of the points [m], and `case` the indices of their cases. All three
        have the same shape (points,).
        """
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
        """Horizontal components of u_t + u_r, the sum of both lines of sight, (2, nodes, n). [m/m]

        A component is the decrease of the range sum if the ground point moves a metre east (first row) or north
        (second row).
        """
        (p, q), (R, S) = self.tracks, self.ranges
        return np.array([p[axis] / R + q[axis] / S for axis in (0, 1)])

    @cached_property
    def _both(self) -> tuple[Floats, Floats]:
        """Positions of both platforms at the nodes, (2, 3, nodes, n), and their ranges, (2, nodes, n). [m]"""
        tracks = np.array([np.broadcast_arrays(*track) for track in self.tracks])
        return tracks, np.array(np.broadcast_arrays(*self.ranges))

    @cached_property
    def sine(self) -> Floats:
        """Sine of the angle on the ground, at the scene centre, between the two directions of resolution, (n,).

        The band resolves points along one direction, and the turn of the line of sight resolves points along the
        other direction. See `GroundMatrix.sine`.
        """
        return self.matrix.sine

    @cached_property
    def product_weights(self) -> Floats:
        """Weights of the scalar product ⟨a, c⟩ that is defined in the module docstring, (nodes + 1, n).

        They apply to the histories a and c after both have been mapped by `Sampling.centred`.
        """
        return np.concatenate(((1 + self.band) * self.mean, self.band[None]))

    @cached_property
    def near_fold(self) -> Floats:
        """Threshold for the determinant of the matrix H, (n,); a point with a smaller determinant is near a fold.

        The module docstring defines the matrix H.
        """
        return np.asarray(POINT_SETTINGS.near_fold_fraction**2 * self.matrix.determinant)

    @cached_property
    def is_turned(self) -> Booleans:
        """Whether a line of sight turns by more than `MAX_TURN_RAD` within the aperture, (n,)."""
        least = np.full(self.half.shape, math.inf)
        if self.fit.shape[1] > FEWEST_PATH_NODES:  # with fewer nodes no line of sight turns that far
            for track, ranges in zip(self.tracks, self.ranges, strict=True):
                looks = np.stack(np.broadcast_arrays(*(component / ranges for component in track)))
                looks = np.concatenate((looks, self.sampling.to_ends @ looks), axis=1)
                middle = looks[:, len(self.fit[0]) // 2]
                # Within half the angle of one line of sight, no two are a whole angle apart: no pair is compared.
                if (np.einsum("an,amn->mn", middle, looks) > math.cos(MAX_TURN_RAD / 2)).all():
                    continue
                for later in looks.swapaxes(0, 1):
                    least = np.minimum(least, np.einsum("an,amn->mn", later, looks).min(axis=0))
        return np.asarray(least < math.cos(MAX_TURN_RAD))

    @cached_property
    def nearest_node(self) -> Floats:
        """Smallest range of either platform at the nodes, (n,). [m]"""
        return np.asarray(np.minimum(*(ranges.min(axis=0) for ranges in self.ranges)))

    @cached_property
    def nearest(self) -> Floats:
        """Smallest range of either platform at the nodes and at mid-aperture, (n,). [m]

        Mid-aperture is not always a node.
        """
        return np.asarray(np.minimum(np.minimum(*map(norm, self.positions)), self.nearest_node))

    @cached_property
    def rounding(self) -> Floats:
        """Threshold below which a phase counts as a rounding error of double precision, (n,). [rad]"""
        recorded = (self.ranges[0] + self.ranges[1]).max(axis=0)
        if self.has_direct_path:
            recorded = recorded + self.baselines.max(axis=0)
        return np.asarray(RANGE_ROUNDING_FRACTION * self.k * recorded)

    @cached_property
    def _between(self) -> VectorArrays:
        """Position of the transmitter relative to the receiver at the nodes, three components (nodes, n). [m]"""
        (x, y, z), (u, v, w) = self.tracks
        return (x - u, y - v, z - w)

    @cached_property
    def baselines(self) -> Floats:
        """Distance between the platforms at the nodes, (nodes, n). [m]"""
        return np.asarray(norm(self._between))

    @cached_property
    def heard_along(self) -> tuple[VectorArrays, VectorArrays]:
        """Unit vectors along the direct path at the nodes: from receiver to transmitter, and reversed.

        Each vector has three components (nodes, n).
        """
        x, y, z = (component / self.baselines for component in self._between)
        return ((x, y, z), (-x, -y, -z))

    # ------------------------------------------------------------------ small errors
    @cached_property
    def powers(self) -> tuple[Floats, ...]:
        """Position errors at the nodes due to unit errors of position, velocity and acceleration, (nodes, n) each."""
        return tuple(kind.course(self.times) for kind in STATE_KINDS)

    def clock_course(self, terms: Sequence[PerCase]) -> Floats:
        """Range error at the nodes for a clock error t̃₀ + t̃₁τ + t̃₂τ² + t̃₃τ³ with the coefficients `terms`. [m]"""
        return clock_range_error(terms, self.times)

    def along(self, platform: int, direction: Vectors) -> Floats:
        """Range error at the nodes per metre of position error of a platform along a direction, (nodes, n). [m/m]

        It is −u·d, or −(u − b)·d if the direct path is the clock. Here, u is the line of sight to the platform, d the
        direction, and b the unit vector from the other platform to this platform.
        """
        change: Floats = -dot(self.tracks[platform], direction) / self.ranges[platform]
        return change + dot(self.heard_along[platform], direction) if self.has_direct_path else change

    def range_error(self, lanes: Lanes) -> Floats:
        """Range error at the nodes due to one unit of each small error in `lanes`, (nodes, lanes). [m/unit]

        `lanes` has one error for each case, or any number of errors of a single case.
        """
        moved = lanes.clock(1.0)
        for platform in lanes.platforms:
            x, y, z = lanes.directions[platform]
            moved = moved + self.along(platform, (x, y, z)) * lanes.at_nodes
        return np.asarray(moved)

    def quadratics_of(self, errors: SmallErrors) -> Floats:
        """Quadratic phase at the displaced point for one unit of each small error, (errors, cases). [rad/unit]

        The values are the same as from `effect`, but are computed faster for many errors.
        """
        weights = self.phase_weights[0]
        along = np.empty((7, *weights.shape))  # range change at the nodes per metre along each component of `ways`
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
        """Displacement east and north per metre of range error at each node, (nodes, n) each. [m/m]"""
        return self.matrix.place_weights

    @cached_property
    def order_weights(self) -> Floats:
        """Legendre parts of the range error at the displaced point, per metre of error at a node. [m/m]

        The error at a node is the range error at the point before its displacement. The array has the shape
        (4, nodes, n), for the orders 0 to 3. To obtain the parts, as values at the aperture edge, multiply the array
        by the errors at the nodes, and sum over the nodes.
        """
        (by_east, by_north), (east, north) = self.gradient, self.place_weights
        return np.asarray(self.fit[..., None] + by_east[:, None] * east + by_north[:, None] * north)

    @cached_property
    def phase_weights(self) -> Floats:
        """Quadratic and cubic phase at the displaced point, per metre of range error at each node. [rad/m]

        The array has the shape (2, nodes, n).
        """
        return np.asarray(self.k * self.order_weights[2:])

    @cached_property
    def hidden_weights(self) -> Floats:
        """Contributions of Legendre parts to the hidden phase, per metre of range error at each node. [rad/m]

        The array has the shape (4, nodes, n), for the orders 0 to 3. The square of the hidden phase is the sum of the
        squares of its contributions. Range errors beyond order 3 are not included. Their weight in the hidden phase
        is only b² (the attribute `band`), which is small, unless a line of sight turns by more than `MAX_TURN_RAD`.
        """
        of_orders = np.array([self.band, (1 + self.band) / 3, self.band / 5 / 1.5**2, self.band / 7 / 2.5**2])
        of_orders[3] += self.is_turned / (7 * 2.5**2)
        return np.asarray(QUADRATIC_OF_VARIANCE * self.k * np.sqrt(of_orders)[:, None] * self.order_weights)

    @cached_property
    def most_per_metre(self) -> Floats:
        """Upper bounds of the effects of any range error whose magnitude is at most one metre, (4, n).

        The first three rows [rad] bound the quadratic, cubic and hidden phase. The last row [m] bounds the
        displacement.
        """
        mean, slope, quadratic, cubic = np.abs(self.order_weights).sum(axis=1)
        # V of such an error, and the variance as a part of V, are at most 1 + b². The displacement never increases V.
        hidden = QUADRATIC_OF_VARIANCE * np.sqrt(self.band * (1 + self.band + mean**2) + slope**2 / 3)
        hidden = np.where(self.is_turned, QUADRATIC_OF_VARIANCE * np.sqrt(1 + self.band), hidden)
        east, north = (np.abs(weights).sum(axis=0) for weights in self.place_weights)
        return np.array((self.k * quadratic, self.k * cubic, self.k * hidden, np.hypot(east, north)))

    def effect(self, range_error: Floats) -> FullEffect:
        """Displacement that small range errors cause, and the phases that remain at the displaced point.

        `range_error` [m] is the range error at the nodes, (..., nodes, cases). Results that are only rounding errors
        are set to 0.
        """
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
        # Where terms cancel exactly, a rounding error would remain and give a limit although none exists.
        return FullEffect(_unless_rounding(east, seen_east), _unless_rounding(north, seen_north), *phases)

    def left_of_small(self, range_error: Floats, moved: tuple[PerCase, PerCase]) -> Floats:
        """Range error that remains at the point to which small errors displace the response. [m]

        `range_error` [m] is the range error at the nodes before the displacement, (..., nodes, cases). `moved` [m] is
        the displacement east and north, (..., cases).
        """
        (by_east, by_north), (east, north) = self.slopes, (np.asarray(component)[..., None, :] for component in moved)
        return np.asarray(range_error + by_east * east + by_north * north)

    def unresolved(self, remaining: Floats) -> tuple[Floats, Floats]:
        """Hidden phase, and rms of the phase beyond the cubic phase, from range errors at the displaced point. [rad]

        `remaining` (..., nodes, cases) [m] are these range errors, sampled at the nodes.
        """
        orders = self.fit @ remaining
        squares = self.mean_squares(remaining, orders)
        return _unresolved(np.moveaxis(orders, -2, 0), squares, self.k, self.band, self.is_turned)

    def mean_squares(self, remaining: Floats, orders: Floats) -> tuple[Floats, Floats]:
        """Mean squares over the aperture of range errors and of their parts beyond Legendre order 3. [m²]

        Both results have the shape (..., cases). `remaining` (..., nodes, cases) [m] are the range errors at the
        nodes, and `orders` (..., 4, cases) [m] their Legendre parts of orders 0 to 3.
        """
        beyond = remaining - self.sampling.polynomials @ orders
        return self.fit[0] @ (remaining * remaining), self.fit[0] @ (beyond * beyond)

    # ------------------------------------------------------------------ errors of any size
    def phases(
        self, lanes: Lanes, size: Floats, near: tuple[Floats, Floats], *, is_at_fold: bool = False
    ) -> ImagePoints:
        """Find the points to which errors of given sizes displace the scene centre, and the phases that remain there.

        Newton's method searches from the point `near`, east and north [m]. If `is_at_fold`, a descent from the same
        point is used instead; it decreases the phase variance V of the module docstring in each step. Use
        `point_paths` to follow an image point as an error grows. On the ground there may be a line, the fold, on
        which the gradients of range and Doppler are parallel. Points beyond the fold are not returned, because the
        image point does not get there as an error grows.
        """
        return self.settled(lanes.clock(size), lanes.shifts(size), near, lanes.case, is_at_fold=is_at_fold)

    def left_over(self, lanes: Lanes, size: Floats, point: tuple[PerCase, PerCase]) -> Floats:
        """Range error that errors of given sizes leave at given ground points, at each node, (nodes, lanes). [m]

        Each lane has one error and one ground point. `size` has the sizes of the errors, and `point` [m] the
        coordinates of the ground points, east and north.
        """
        lane_count = lanes.case.size
        room = self._room(lane_count)
        clock, measured = self._measured(lanes.clock(size), lanes.shifts(size), lanes.case, room)
        east, north = (np.broadcast_to(component, lane_count) for component in point)
        growth, _, _ = _grown(measured, np.array((east, north)), room[_MEASURED_ARRAY_COUNT:])
        return np.asarray(clock - growth[0] - growth[1])

    def _heard(self, shifts: Iterable[Any], case: Indices) -> Floats:
        """Clock error c·t̃ due to shifts of the platforms, (nodes, lanes). [m]

        It arises if the receiver uses the direct path from the transmitter as its clock.
        """
        a, b, c = (of_transmitter - of_receiver for of_transmitter, of_receiver in zip(*shifts, strict=True))
        x, y, z, baseline = _take_cases([*self._between, self.baselines], case)
        grown = a * (2 * x + a) + b * (2 * y + b) + c * (2 * z + c)
        return np.asarray(grown / (baseline + np.sqrt(np.abs(baseline * baseline + grown))))

    def way(self, lanes: Lanes, size: Floats, point: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
        """Rate at which image points move as the errors grow, east and north. [m/unit]

        `point` has the image points for errors of the sizes `size`. The image point is the minimum of V, the function
        of the ground point that the module docstring defines. The result follows from the second derivative of V, and
        from the change of the slope of V as the error grows.
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
        """Find the image point of each lane by Newton's method, or by a descent if `is_at_fold`.

        A lane is one error of one case. The image point is the minimum of the function V in the module docstring.
        `clock` (nodes, lanes) [m] has the range errors due to clocks. `shifts` [m] has the three components of the
        shift of each platform at the nodes. `near` [m] is the point at which the search starts, east and north.
        `case` has the index of the case of each lane.
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
        """Allocate the work arrays of a search for `lanes` image points.

        All blocks of lanes use the same arrays, because allocation takes longer than filling.
        """
        return np.empty((_ARRAY_COUNT, 2, self.fit.shape[1], lanes))

    def _measured(self, clock: Floats, shifts: Iterable[Any], case: Indices, room: Floats) -> tuple[Floats, Floats]:
        """Prepare the arguments of `_grown`; return the clock error, and five arrays (2, nodes, lanes) in `room`.

        If a platform's position vector r changes by d, its range R grows by p/(R + √(R² + p)), with p = d·(2r + d).
        In this form, the rounding error is not proportional to the range. For a ground point at g = (east, north)
        instead of the origin, p is replaced by p − g·(2r̂ − g), with the measured position r̂ = r + d.
        """
        if self.has_direct_path:  # the error of the distance is then the only clock error
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
    """Search for the image points of errors by Newton's method or by a descent.

    A lane is one error of one case. `lane` has the indices of the lanes whose search has not converged. `of` has the
    cases of these lanes, and `point` [m] their current points, east and north. `settled` has one entry for each step
    in which the search of some lanes converged. An entry has the indices of these lanes, `_GroundView.seen` and
    `_GroundView.determinant` before the step, the step, and the points after the step.
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
        """Search by Newton's method until each lane has converged, or is found not to converge."""
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
        """Search by damped steps; a step that would increase the phase variance V is rejected.

        The module docstring defines V. The search is slower than `run`, but reliable where the second derivative of V
        is small, such as near a fold.
        """
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
        """Write the image points and the phases that remain there into `points`; points beyond a fold are left out.

        The range error at a point is the range error before the last step, plus its linear change due to this step.
        Phases smaller than the rounding error are set to 0.
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
        """Compute range errors, gradients and distances at the current points."""
        growth, looks, distances = _grown(self.measured, self.point, self.room)
        seen = np.empty((3, *growth.shape[1:]))
        np.subtract(self.clock, growth[0], out=seen[0])
        seen[0] -= growth[1]
        looks /= distances
        np.add(looks[:, 0], looks[:, 1], out=seen[1:])
        return _GroundView(seen, looks, distances, self.exact.sampling.centred, self.weights)

    def _last_step(self, view: "_GroundView") -> Floats:
        """Threshold at which the search of each lane ends. [m]

        The search of a lane ends when the square of its step, divided by the smallest range of a platform, is below
        this threshold.
        """
        is_near_fold = view.determinant < self.near_fold
        smaller, usual = (
            POINT_SETTINGS.last_step_near_fold_fraction * POINT_SETTINGS.last_step_rad,
            POINT_SETTINGS.last_step_rad,
        )
        return np.asarray(np.where(is_near_fold, smaller, usual) / self.k)

    def _set_cases(self) -> None:
        """Look up the wavenumber, smallest range, fold threshold and product weights of each lane's case."""
        exact = self.exact
        of_cases = [exact.k, POINT_SETTINGS.nearest_fraction * exact.nearest, exact.near_fold, exact.product_weights]
        self.k, self.least_range, self.near_fold, self.weights = _take_cases(of_cases, self.of)

    def _go_on(self, going: Indices) -> None:
        """Continue the search only for the lanes at the indices `going`."""
        self.lane, self.of = self.lane[going], self.of[going]
        self.point, self.clock, self.measured = _take([self.point, self.clock, self.measured], going)
        self.room = self.room[..., : going.size]
        if self.exact.k.size > 1:
            self._set_cases()

    def _keep(self, done: Indices, view: "_GroundView", step: Floats) -> None:
        """Record that the search of the lanes `lane[done]` has converged; store the last view, step and point."""
        if done.size:
            arrays = [self.lane, view.seen, view.determinant, step, self.point]
            self.settled.append(arrays if done.size == self.lane.size else _take(arrays, done))


class _GroundView:
    """Range errors, lines of sight, and derivatives of the phase variance V, at one ground point per lane.

    The module docstring defines V, the matrix H and the scalar product ⟨a, ρ⟩.

    Attributes
    ----------
    seen : (3, nodes, lanes)
        Range errors that remain at the nodes [m], and their changes if the ground point moves a metre east and a
        metre north. [m/m]
    looks : (2, 2, nodes, lanes)
        Horizontal components of the unit vectors to the platforms, by axis and platform.
    distances : (2, nodes, lanes)
        Ranges of both platforms. [m]
    nearest : (lanes,)
        Smallest range of either platform at the nodes. [m]
    slope : (2, lanes)
        Half the derivatives of V with respect to east and north. [m]
    matrix : (2, 2, lanes)
        The matrix H.
    determinant : (lanes,)
        Determinant of H.
    node_weights : (nodes, lanes)
        Weights at the nodes for the scalar product ⟨a, ρ⟩ with the range error ρ at the point. The scalar product
        with a history a is the sum over the nodes of the weights times a.
    bends : three of (lanes,)
        Half the second derivatives of V at the points: east-east, east-north, north-north.
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
        self.node_weights = centred.T @ self._weighted[0]
        bends = self.node_weights / distances
        turned, total = np.einsum("apnc,bpnc->abc", looks * bends, looks), bends.sum(axis=(0, 1))
        (xx, xy), (_, yy) = self.matrix + turned
        self.bends = xx - total, xy, yy - total

    @property
    def variance(self) -> Floats:
        """Phase variance V, which the module docstring defines, at the ground point of each lane, (lanes,). [m²]"""
        return np.asarray(np.einsum("nc,nc->c", self._weighted[0], self._parts[0]))

    def products(self, values: Floats) -> Floats:
        """Scalar products ⟨g, a⟩ of the range gradient g with error histories a over the aperture, (2, lanes).

        `values` (nodes, lanes) holds the histories a at the nodes. A lane is one error of one case. g is the change
        of the range error per metre east (first row) and per metre north (second row). The scalar product ⟨a, c⟩ is
        defined in the module docstring.
        """
        return np.asarray(np.einsum("anc,nc->ac", self._weighted[1:], self._centred @ values))

    def step(self, slope: Floats) -> Floats:
        """Newton step to the point at which the slope of the phase variance V is zero, (2, lanes). [m]

        `slope` is half the slope of V at the present point. The step uses half the second derivatives of V, or the
        matrix H where V has no minimum nearby. The module docstring defines V and H.
        """
        xx, xy, yy = self.bends
        is_bowl = (xx * yy - xy * xy > POINT_SETTINGS.bowl_fraction * self.determinant) & (xx > 0)
        if not is_bowl.all():
            (h_xx, h_xy), (_, h_yy) = self.matrix
            xx, xy, yy = np.where(is_bowl, self.bends, (h_xx, h_xy, h_yy))
        return _solved((xx, xy, yy), slope)


def _solved(bends: Sequence[Floats], slope: Floats) -> Floats:
    """Step to the point at which the slope of the phase variance V is zero, for a quadratic V, (2, lanes). [m]

    `bends` are half the second derivatives of V (east-east, east-north, north-north), and `slope` is half its slope.
    """
    (xx, xy, yy), (x, y) = bends, slope
    return np.asarray((xy * y - yy * x, xy * x - xx * y) / (xx * yy - xy * xy))


def _unresolved(
    orders: Floats, squares: tuple[Floats, Floats], k: Floats, band: Floats, is_turned: Booleans
) -> tuple[Floats, Floats]:
    """Hidden phase [rad], and RMS of the phase beyond order 3 [rad], due to the range error at the displaced point.

    The module docstring defines the hidden phase. `orders` [m] are the values at the aperture edge of the Legendre
    parts of orders 0 to 3 of the range error. `squares` [m²] are the mean square of the range error, and the mean
    square of its part beyond order 3. `k`, `band` and `is_turned` are attributes of `ExactRanges`.
    """
    _, slope, _, cubic = orders
    square, beyond_cubic = squares
    of_cubic = (cubic / 2.5) ** 2 / 7
    hidden = band * square + slope * slope / 3 + np.where(is_turned, of_cubic + beyond_cubic, 0.0)
    return QUADRATIC_OF_VARIANCE * k * np.sqrt(hidden), k * np.sqrt(beyond_cubic)


def _unless_rounding(value: Floats, seen: Floats) -> Floats:
    return np.where(np.abs(value) <= VECTOR_ROUNDING_FRACTION * seen, 0.0, value)


def _grown(measured: Floats, point: Floats, room: Floats) -> tuple[Floats, Floats, Floats]:
    """Measured ranges from both platforms to the points `point`, minus the true ranges to the scene centre. [m]

    `point` is (2, lanes), east and north. `measured` are the arrays that `ExactRanges._measured` prepares. Returns
    three views of the work arrays `room`. The first is the difference of the ranges, (2, nodes, lanes). The second
    has the horizontal vectors from the points to the platforms, (2, 2, nodes, lanes), by axis and platform. The third
    has the measured ranges, (2, nodes, lanes). All are in metres.
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
    """Find the points to which errors with any time history displace the scene centre.

    Parameters
    ----------
    exact : ExactRanges
        Exact ranges of the cases.
    clock : (nodes, lanes)
        Range errors due to clocks; zero if the direct path is the clock. [m]
    shifts : sequence
        For each platform, its shifts east, north and up, each (nodes, lanes). [m]
    case : (lanes,)
        The case of each error.

    Returns
    -------
    ImagePoints
        Image points and remaining phases. If a search does not converge, the error is increased to its full size in
        steps. The values are NaN if no ground point has the recorded range history, or if the image point does not
        reach such a ground point as the error grows. As in `point_paths`, it is assumed that no ground point has the
        recorded range history if the hidden phase exceeds half a cycle and the determinant of H is small. The module
        docstring defines the hidden phase and the matrix H.
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
            near = np.array((there.east, there.north)) * ((step + 2) / (step + 1))  # NaN after the first lost point
        for column, later in zip(points, there, strict=True):
            column[missed] = later
    has_ended = (np.abs(points.turn) < POINT_SETTINGS.folded_fraction) & (points.hidden > POINT_SETTINGS.end_rad)
    points.is_settled[has_ended] = False
    for values in points[1:]:
        values[has_ended] = math.nan
    return points


def _within_ends(points: ImagePoints) -> ImagePoints:
    """Replace points beyond the end of their path (see `point_paths`) by NaN, and mark them as not settled."""
    is_gone = (np.abs(points.turn) < POINT_SETTINGS.folded_fraction) & (points.hidden > POINT_SETTINGS.end_rad)
    return ImagePoints(points.is_settled & ~is_gone, *(np.where(is_gone, math.nan, column) for column in points[1:]))


def _take(arrays: Sequence[Floats] | Floats, indices: Indices) -> list[Floats]:
    """Select lanes of arrays (…, lanes); an array with a single lane, valid for all lanes, is returned unchanged."""
    return [array if array.shape[-1] == 1 else array.take(indices, axis=-1) for array in arrays]


_take_cases = _take  # the same selection for arrays (nodes, cases) or (cases,), where all lanes may share one case
