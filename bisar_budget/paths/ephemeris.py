"""Ephemerides: positions of an object at given times, often with velocities, and the orbit through these samples.

A position is interpolated in the axes and the time system of the file, and then converted to Earth-fixed axes. The
realisations of `ITRF` from different years differ by centimetres; these differences are ignored.
"""

import math
from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

from bisar_budget.geometry import Vector
from bisar_budget.paths.accuracy import EpochCovariance, StatedAccuracy, stated_of_orbit
from bisar_budget.paths.flight import NO_DOUBT, Orbit, PathDoubt, PathFileError, Sample, interpolate
from bisar_budget.paths.instant import Instant, tai, utc
from bisar_budget.paths.messages import cut, one_object
from bisar_budget.paths.orientation import Orientation, Turn

MIN_SAMPLE_STEP_S = 0.9e-3  # closer samples count as one; times in two centuries are rounded to 1e-6 s
DEFAULT_DEGREE = 7  # for a file that states no degree
_TRIED_DEGREES = (7, 9, 11, 13, 15)  # for samples whose velocities cannot be used
# An interpolation error above the first value gives a warning. One above the second is refused at any slant range: it
# is a tenth of 500 km, the smallest distance of a satellite.
_MIN_STATED_ERROR_M, _MAX_ERROR_M = 1.0, 50_000.0
_REMEDY = "Write the ephemeris more often"
_EDGE_S = 1e-9  # a time at the end of a span is inside
MAX_VELOCITY_ERROR_RATIO = 0.001  # to the speed; velocities relative to the stars differ by up to 7 %
_MIN_SPEED_MPS = 100.0  # at lower speeds over the ground, differences up to 0.1 m/s are accepted
_NEIGHBOUR_SAMPLES = 4  # samples on each side for the comparison of velocities with positions
MAX_DENSE_STEP_S = 300.0  # between states of a low orbit; states with a larger step cannot confirm velocities
# Nodes and weights of Gauss-Legendre quadrature on (0, 1) with three points: Abramowitz & Stegun, table 25.4.
_GAUSS_NODES = ((0.5 - math.sqrt(0.15), 5 / 18), (0.5, 8 / 18), (0.5 + math.sqrt(0.15), 5 / 18))


@dataclass(frozen=True)
class Interpolation:
    """Polynomial between samples: Hermite's through positions and velocities, or Lagrange's through positions."""

    is_hermite: bool
    degree: int

    @property
    def nodes(self) -> int:
        """Number of samples through which the polynomial goes."""
        return (self.degree + 1) // 2 if self.is_hermite else self.degree + 1

    @property
    def words(self) -> str:
        """Name and degree of the polynomial, for reports."""
        return f"{'Hermite' if self.is_hermite else 'Lagrange'} degree {self.degree}"


@dataclass(frozen=True)
class Segment:
    """Samples of an object that can be interpolated by a polynomial, because there is no manoeuvre between them.

    Attributes
    ----------
    object : str
        Name of the object for messages.
    names : tuple of str
        Names by which a mission may choose the object.
    samples : sequence of Sample
        Times in TAI, positions and velocities.
    first, last : Instant
        First and last time, in TAI, between which the segment may be interpolated.
    where : str
        File and line, for messages.
    words : str
        Description of the segment for reports.
    interpolation : Interpolation, optional
        Interpolation that the file states. If None, the interpolation with the smallest estimated error is used.
    axes : str
        Axes of the positions.
    turn : callable, optional
        Function that converts positions to Earth-fixed axes; None if `axes` are fixed to the Earth.
    accuracy : callable
        Function that takes a time in TAI, and returns the accuracy that the file states, or None.
    covariances : sequence of EpochCovariance
        Covariances that the file states at epochs.
    remarks : tuple of str
        Warnings about the segment.
    """

    object: str
    names: tuple[str, ...]
    samples: Sequence[Sample]
    first: Instant
    last: Instant
    where: str
    words: str
    interpolation: Interpolation | None = None
    axes: str = "ITRF"
    turn: Turn | None = None
    accuracy: Callable[[Instant], StatedAccuracy | None] = lambda _: None
    covariances: Sequence[EpochCovariance] = ()
    remarks: tuple[str, ...] = ()

    def is_useable(self, time: Instant) -> bool:
        """Whether a time in TAI lies between the first and the last usable time."""
        return time.since(self.first) >= -_EDGE_S and time.since(self.last) <= _EDGE_S


def orbit_through(
    segments: Sequence[Segment], name: str, object_name: str | None, center: Instant, orientation: Orientation
) -> Orbit:
    """Orbit of an object through the segment that contains the middle of the aperture.

    If several segments contain it, the time from the middle to the nearer end of each segment is compared. The
    segment with the longest time is used for all instants. The error of the interpolation is estimated by increasing
    the degree of the polynomial by two; the distance between the two polynomials is the estimate. An error of 1 m or
    more causes a warning in `Orbit.doubts`.

    `segments` are the segments of a file. The other arguments are the same as for `OrbitFormat.read`. Raises
    `PathFileError` if several objects are possible, if the file has no position at `center`, or if the samples around
    `center` are too far apart. `Orbit.place` raises it outside the span of the segment.
    """
    if not segments:
        raise PathFileError(f"{name}: has no ephemeris")
    segment = _segment_at(one_object(segments, name, object_name), name, center)
    interpolation = segment.interpolation or _fitting(segment.samples, center)
    return _Between(segment, interpolation, orientation, center).orbit()


class _Between:
    """Interpolation of a segment; the method `orbit` returns it as an `Orbit`."""

    def __init__(
        self, segment: Segment, interpolation: Interpolation, orientation: Orientation, center: Instant
    ) -> None:
        self.segment, self.interpolation, self.orientation = segment, interpolation, orientation
        self.span = (utc(segment.first), utc(segment.last))
        # The larger error at an instant and between the samples around the instant. At a sample the error is 0, but
        # an error between two samples is a wrong velocity at them. [m]
        self._error = lru_cache(maxsize=16)(lambda at: _error_around(segment.samples, tai(at), interpolation))
        if not self._error(center) < _MAX_ERROR_M:
            raise PathFileError(
                f"{segment.where}: the ephemeris is too sparse around {center.as_text()} to interpolate:"
                f" its states there are {minutes(_step_around(segment.samples, tai(center)))} apart",
                f"accepted: an interpolation that is less than {_MAX_ERROR_M / 1e3:g} km off",
                _REMEDY,
            )

    def orbit(self) -> Orbit:
        segment = self.segment
        words = segment.words + (self.orientation.words if segment.turn else "")
        if segment.interpolation is None:
            words += f", {self.interpolation.words}"
        return Orbit(
            place=self.place,
            words=words,
            span=self.span,
            doubts=self.doubts,
            doubt=self.doubt,
            remedy=_REMEDY,
            is_turned=segment.turn is not None,
            turning_doubt=self.turning_doubt,
            turning_doubts=self.turning_doubts,
            stated=self.stated,
        )

    def place(self, instant: Instant) -> Vector:
        position = self._interpolated(instant)
        return self.segment.turn(position, instant) if self.segment.turn else position

    def _interpolated(self, instant: Instant) -> Vector:
        time = tai(instant)
        if not self.segment.is_useable(time):
            raise PathFileError(
                f"{self.segment.where}: has no position at {instant.as_text()}; its useable time is"
                f" {self.span[0].as_text()} to {self.span[1].as_text()}"
            )
        position = interpolate(self.segment.samples, time, self.interpolation.nodes, self.interpolation.is_hermite)
        if not all(math.isfinite(coordinate) for coordinate in position):
            raise PathFileError(f"{self.segment.where}: the interpolation gives no number at {instant.as_text()}")
        return position

    def stated(self, instant: Instant) -> StatedAccuracy | None:
        segment = self.segment
        return stated_of_orbit(segment.covariances, self.place, instant, self.span) or segment.accuracy(tai(instant))

    def doubt(self, instant: Instant) -> PathDoubt:
        doubts = (PathDoubt(self._error(instant), "interpolation of the ephemeris"), self.turning_doubt(instant))
        # The causes are independent; their sum is the worst case.
        words = ", ".join(doubt.words for doubt in doubts if doubt.words)
        return PathDoubt(doubts[0].size + doubts[1].size, words)

    def turning_doubt(self, instant: Instant) -> PathDoubt:
        if self.segment.turn is None:
            return NO_DOUBT
        cause = "0.1 s of UT1 - UTC and polar motion" if not self.orientation.words else "the Earth's orientation"
        return PathDoubt(sum(self.orientation.misplaced(self._interpolated(instant))), cause)

    def doubts(self, instant: Instant) -> Sequence[str]:
        warnings = list(self.segment.remarks)
        error = self._error(instant)
        if not error < _MIN_STATED_ERROR_M:
            warnings.append(
                f"{self.segment.where}: the interpolation of the ephemeris is about {error:.2g} m off; write it more"
                " often"
            )
        return (*warnings, *self.turning_doubts(instant))

    def turning_doubts(self, instant: Instant) -> Sequence[str]:
        if self.segment.turn is None:
            return ()
        turn_error_m, pole_error_m = self.orientation.misplaced(self._interpolated(instant))
        subject = f"{self.segment.where}: {self.segment.axes} is turned to the Earth"
        if not self.orientation.words:
            return (
                f"{subject} with UT1 = UTC and without polar motion: {turn_error_m:.0f} m off for each 0.1 s of UT1 -"
                f" UTC, and up to {pole_error_m:.0f} m; an ephemeris in ITRF has neither",
            )
        if turn_error_m + pole_error_m < _MIN_STATED_ERROR_M:
            return ()
        return (f"{subject} to about {turn_error_m + pole_error_m:.2g} m: UT1 or the pole is not known better",)


def every(samples: Sequence[Sample]) -> str:
    """Phrase for reports that states the median time between the samples of an ephemeris."""
    return f"one state every {minutes(usual_step(samples))}"


def minutes(duration_s: float) -> str:
    """Write a duration [s] as text: in seconds if it is below one minute, otherwise in minutes."""
    return f"{duration_s / 60:.3g} min" if duration_s >= 60 else f"{duration_s:.3g} s"


def _step_around(samples: Sequence[Sample], time: Instant) -> float:
    """Time between the two samples around an instant. [s]"""
    before, after = _times_around(samples, time)
    return after.since(before)


def usual_step(samples: Sequence[Sample]) -> float:
    """Median time between successive samples; 0 for a single sample. [s]"""
    steps = sorted(after.time.since(before.time) for before, after in pairwise(samples))
    return steps[len(steps) // 2] if steps else 0.0


def _times_around(samples: Sequence[Sample], time: Instant) -> tuple[Instant, Instant]:
    """Times of the two samples around an instant; the nearest two if the instant is outside the samples."""
    after = min(max(bisect_right(samples, time, key=lambda sample: sample.time), 1), len(samples) - 1)
    return samples[after - 1].time, samples[after].time


def _error_around(samples: Sequence[Sample], time: Instant, interpolation: Interpolation) -> float:
    """Estimated error of an interpolation near a time. [m]

    If the degree of the interpolation is n, it is compared with the polynomial of degree n + 2. The result is the
    larger of their distances at the time itself and midway between the two samples around this time. If there are too
    few samples for degree n + 2, the interpolation is compared with the polynomial of degree n − 2. If this is not
    possible either, the result is infinite.
    """
    step = 1 if interpolation.is_hermite else 2
    nodes, is_hermite = interpolation.nodes, interpolation.is_hermite
    other_nodes = nodes + step if nodes + step <= len(samples) else nodes - step
    if other_nodes < 1:
        return math.inf

    def error_at(instant: Instant) -> float:
        positions = (interpolate(samples, instant, count, is_hermite) for count in (nodes, other_nodes))
        error = math.dist(*positions)
        return error if math.isfinite(error) else math.inf

    before, after = _times_around(samples, time)
    return max(error_at(time), error_at(before.after(after.since(before) / 2)))


def _fitting(samples: Sequence[Sample], center: Instant) -> Interpolation:
    """Return the Lagrange interpolation of the degree that has the smallest estimated error near `center`."""
    candidates = [Interpolation(False, degree) for degree in _TRIED_DEGREES if degree + 3 <= len(samples)]
    if not candidates:
        return Interpolation(False, min(DEFAULT_DEGREE, len(samples) - 1))
    time = tai(center)
    return min(candidates, key=lambda candidate: _error_around(samples, time, candidate))


def _segment_at(segments: Sequence[Segment], name: str, center: Instant) -> Segment:
    """Segment that contains the instant `center`.

    If several segments contain it, the time from the instant to the nearer end of each segment is compared, and the
    segment with the longest time is used.
    """
    time = tai(center)
    useable = [segment for segment in segments if segment.is_useable(time)]
    if not useable:
        spans = [(utc(segment.first), utc(segment.last)) for segment in segments]
        span_words = ", ".join(f"{first.as_text()} to {last.as_text()}" for first, last in spans)
        raise PathFileError(
            f"{name}: has no position at {center.as_text()}; its useable time is {cut(span_words)}", spans=spans
        )
    return max(useable, key=lambda segment: min(time.since(segment.first), segment.last.since(time)))


def velocity_error(samples: Sequence[Sample]) -> float:
    """Largest relative difference between the stated velocities and the rates of change of the positions.

    About sixteen pairs of neighbouring samples are compared. A single pair is not enough: near a pole, where the
    Earth's rotation hardly moves a position, velocities relative to the wrong axes are almost correct. The result is
    0 if there are too few samples, and NaN if a difference is not finite.
    """
    last = len(samples) - _NEIGHBOUR_SAMPLES
    if last < _NEIGHBOUR_SAMPLES:
        return 0.0
    stride = max((last - _NEIGHBOUR_SAMPLES) // 16, 1)
    errors = [_velocity_error_at(samples, middle) for middle in range(_NEIGHBOUR_SAMPLES, last + 1, stride)]
    return max(errors) if all(math.isfinite(error) for error in errors) else math.nan


def _velocity_error_at(samples: Sequence[Sample], middle: int) -> float:
    """Relative difference of the stated velocities from the rate of change of position between two samples.

    The two samples are the sample with the index `middle` and the sample before it. The stated velocities are
    interpolated, and averaged over the interval by Gauss-Legendre quadrature. Their mean is compared with the change
    of position divided by the time between the samples. This comparison was derived for this program.
    """
    neighbours = samples[middle - _NEIGHBOUR_SAMPLES : middle + _NEIGHBOUR_SAMPLES]
    velocities = [Sample(sample.time, sample.velocity, sample.velocity) for sample in neighbours]
    before, after = samples[middle - 1 : middle + 1]
    step = after.time.since(before.time)
    mean_velocity = [0.0, 0.0, 0.0]
    for fraction, weight in _GAUSS_NODES:
        velocity = interpolate(velocities, before.time.after(fraction * step), len(velocities), False)
        mean_velocity = [mean + weight * value for mean, value in zip(mean_velocity, velocity, strict=True)]
    velocity_of_positions = [(end - start) / step for start, end in zip(before.place, after.place, strict=True)]
    return math.dist(mean_velocity, velocity_of_positions) / max(math.hypot(*velocity_of_positions), _MIN_SPEED_MPS)
