"""Ephemerides: places of an object at times, often with velocities, and the orbit that goes through them.

A place is interpolated in the axes and the time of the file, then turned to the Earth. What the axes of `ITRF` of
other years differ by, centimetres, is not seen.
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

APART = 0.9e-3  # s; nearer samples are one, and differences of times of two centuries are rounded to 1e-6 s
USUAL_DEGREE = 7  # where a file says none
_FITTING = (7, 9, 11, 13, 15)  # degrees that are tried where velocities do not help
# Errors of an interpolation that are said, and that are refused whatever the slant range: the lowest satellites are
# 500 km away, and a tenth of that is lost.
_SEEN_M, _LOST_M = 1.0, 50_000.0
_MORE_OFTEN = "Write the ephemeris more often"
_EDGE = 1e-9  # s; a time at the end of a span is inside
OWN_VELOCITY = 0.001  # of the speed; one against the stars is up to 7 % off in a low orbit
_SLOW = 100.0  # m/s; slower ones over the ground are held to a tenth of a metre a second
_BESIDE = 4  # samples on each side that velocities are compared with places by
# Nodes and weights of Gauss and Legendre on (0, 1), of three points: Abramowitz & Stegun, table 25.4.
SPARSE_S = 300.0  # between states of a low orbit; what is farther apart says nothing about its velocities
_GAUSS = ((0.5 - math.sqrt(0.15), 5 / 18), (0.5, 8 / 18), (0.5 + math.sqrt(0.15), 5 / 18))


@dataclass(frozen=True)
class Interpolation:
    """The polynomial between samples: Hermite's through places and velocities, or Lagrange's through places."""

    is_hermite: bool
    degree: int

    @property
    def nodes(self) -> int:
        """Samples that it goes through."""
        return (self.degree + 1) // 2 if self.is_hermite else self.degree + 1

    @property
    def words(self) -> str:
        """Its name and degree."""
        return f"{'Hermite' if self.is_hermite else 'Lagrange'} degree {self.degree}"


@dataclass(frozen=True)
class Segment:
    """Samples of one object that a polynomial may go through: between two segments there may be a manoeuvre.

    `names` are those that a mission may choose the object by. `first` and `last` are the useable times, of TAI.
    `turn` takes places to the Earth, from axes that are not fixed to it. `accuracy` is the figure that the file
    states of itself, at a time of TAI, `covariances` are those that it states at epochs, `remarks` are warnings.
    Without an `interpolation` the one that fits best is taken.
    """

    object: str
    names: tuple[str, ...]
    samples: Sequence[Sample]
    first: Instant
    last: Instant
    where: str  # file and line
    words: str
    interpolation: Interpolation | None = None
    axes: str = "ITRF"
    turn: Turn | None = None
    accuracy: Callable[[Instant], StatedAccuracy | None] = lambda _: None
    covariances: Sequence[EpochCovariance] = ()
    remarks: tuple[str, ...] = ()

    def holds(self, time: Instant) -> bool:
        """Whether a time of TAI is a useable one."""
        return time.since(self.first) >= -_EDGE and time.since(self.last) <= _EDGE


def orbit_through(
    segments: Sequence[Segment], name: str, wanted: str | None, center: Instant, orientation: Orientation
) -> Orbit:
    """Orbit of one object through the segment that holds the middle of the aperture.

    Of several the one that holds the most around it is taken, for all instants. The error of an interpolation is
    estimated by one of two more degrees, and doubted from 1 m on.

    All but the segments of a file are arguments of its reader. A `PathFileError` says that the file does not say
    which object, has no place at `center`, or is too sparse there; `Orbit.place` raises it outside the span.
    """
    if not segments:
        raise PathFileError(f"{name}: has no ephemeris")
    segment = _at(one_object(segments, name, wanted), name, center)
    interpolation = segment.interpolation or _fitting(segment.samples, center)
    return _Between(segment, interpolation, orientation, center).orbit()


class _Between:
    """An orbit through the samples of a segment."""

    def __init__(
        self, segment: Segment, interpolation: Interpolation, orientation: Orientation, center: Instant
    ) -> None:
        self.segment, self.used, self.orientation = segment, interpolation, orientation
        self.span = (utc(segment.first), utc(segment.last))
        # Error at an instant, or between the samples around it: at a sample it is none, and what is missed between
        # two is a wrong velocity beside them. [m]
        self._off = lru_cache(maxsize=16)(lambda at: _misses_around(segment.samples, tai(at), interpolation))
        if not self._off(center) < _LOST_M:
            raise PathFileError(
                f"{segment.where}: the ephemeris is too sparse around {center.as_text()} to interpolate:"
                f" its states there are {minutes(_step_around(segment.samples, tai(center)))} apart",
                f"accepted: an interpolation that is less than {_LOST_M / 1e3:g} km off",
                _MORE_OFTEN,
            )

    def orbit(self) -> Orbit:
        segment = self.segment
        words = segment.words + (self.orientation.words if segment.turn else "")
        if segment.interpolation is None:
            words += f", {self.used.words}"
        return Orbit(
            place=self.place,
            words=words,
            span=self.span,
            doubts=self.doubts,
            doubt=self.doubt,
            remedy=_MORE_OFTEN,
            is_turned=segment.turn is not None,
            turning_doubt=self.turning_doubt,
            turning_doubts=self.turning_doubts,
            stated=self.stated,
        )

    def place(self, instant: Instant) -> Vector:
        found = self._inside(instant)
        return self.segment.turn(found, instant) if self.segment.turn else found

    def _inside(self, instant: Instant) -> Vector:
        time = tai(instant)
        if not self.segment.holds(time):
            raise PathFileError(
                f"{self.segment.where}: has no place at {instant.as_text()}; its useable time is"
                f" {self.span[0].as_text()} to {self.span[1].as_text()}"
            )
        found = interpolate(self.segment.samples, time, self.used.nodes, self.used.is_hermite)
        if not all(math.isfinite(one) for one in found):
            raise PathFileError(f"{self.segment.where}: the interpolation gives no number at {instant.as_text()}")
        return found

    def stated(self, instant: Instant) -> StatedAccuracy | None:
        segment = self.segment
        return stated_of_orbit(segment.covariances, self.place, instant, self.span) or segment.accuracy(tai(instant))

    def doubt(self, instant: Instant) -> PathDoubt:
        own, turning = PathDoubt(self._off(instant), "interpolation of the ephemeris"), self.turning_doubt(instant)
        # They are of other causes; at their worst they add.
        return PathDoubt(own.size + turning.size, ", ".join(filter(None, (own.words, turning.words))))

    def turning_doubt(self, instant: Instant) -> PathDoubt:
        if self.segment.turn is None:
            return NO_DOUBT
        unsure = "0.1 s of UT1 - UTC and polar motion" if not self.orientation.words else "the Earth's orientation"
        return PathDoubt(sum(self.orientation.misplaced(self._inside(instant))), unsure)

    def doubts(self, instant: Instant) -> Sequence[str]:
        said = list(self.segment.remarks)
        error = self._off(instant)
        if not error < _SEEN_M:
            said.append(
                f"{self.segment.where}: the interpolation of the ephemeris is about {error:.2g} m off; write it more"
                " often"
            )
        return (*said, *self.turning_doubts(instant))

    def turning_doubts(self, instant: Instant) -> Sequence[str]:
        if self.segment.turn is None:
            return ()
        turned, moved = self.orientation.misplaced(self._inside(instant))
        begins = f"{self.segment.where}: {self.segment.axes} is turned to the Earth"
        if not self.orientation.words:
            return (
                f"{begins} with UT1 = UTC and without polar motion: {turned:.0f} m off for each 0.1 s of UT1 - UTC,"
                f" and up to {moved:.0f} m; an ephemeris in ITRF has neither",
            )
        if turned + moved < _SEEN_M:
            return ()
        return (f"{begins} to about {turned + moved:.2g} m: UT1 or the pole is not known better",)


def every(samples: Sequence[Sample]) -> str:
    """Words on how often an ephemeris has a state, by its usual step."""
    return f"one state every {minutes(usual_step(samples))}"


def minutes(duration_s: float) -> str:
    """A time between two states, in minutes where it is as long."""
    return f"{duration_s / 60:.3g} min" if duration_s >= 60 else f"{duration_s:.3g} s"


def _step_around(samples: Sequence[Sample], time: Instant) -> float:
    """Time between the two samples around an instant. [s]"""
    before, after = _times_around(samples, time)
    return after.since(before)


def usual_step(samples: Sequence[Sample]) -> float:
    """Median time between two samples; 0 of a single one. [s]"""
    steps = sorted(after.time.since(before.time) for before, after in pairwise(samples))
    return steps[len(steps) // 2] if steps else 0.0


def _times_around(samples: Sequence[Sample], time: Instant) -> tuple[Instant, Instant]:
    """Times of the two samples around an instant; of the nearest two where it is outside."""
    behind = min(max(bisect_right(samples, time, key=lambda one: one.time), 1), len(samples) - 1)
    return samples[behind - 1].time, samples[behind].time


def _misses_around(samples: Sequence[Sample], time: Instant, used: Interpolation) -> float:
    """How far an interpolation is from one of two more degrees, at a time or between the samples around it. [m]

    Where there are no more samples, the other one has two degrees less, and is worse.
    """
    step = 1 if used.is_hermite else 2
    other = used.nodes + step if used.nodes + step <= len(samples) else used.nodes - step
    if other < 1:
        return math.inf

    def misses(at: Instant) -> float:
        both = (interpolate(samples, at, count, used.is_hermite) for count in (used.nodes, other))
        error = math.dist(*both)
        return error if math.isfinite(error) else math.inf

    before, after = _times_around(samples, time)
    return max(misses(time), misses(before.after(after.since(before) / 2)))


def _fitting(samples: Sequence[Sample], center: Instant) -> Interpolation:
    """The interpolation of Lagrange that is nearest to one of two more degrees around an instant."""
    possible = [Interpolation(False, degree) for degree in _FITTING if degree + 3 <= len(samples)]
    if not possible:
        return Interpolation(False, min(USUAL_DEGREE, len(samples) - 1))
    time = tai(center)
    return min(possible, key=lambda one: _misses_around(samples, time, one))


def _at(segments: Sequence[Segment], name: str, center: Instant) -> Segment:
    """The segment that holds an instant, of several the one that holds the most around it."""
    time = tai(center)
    holding = [one for one in segments if one.holds(time)]
    if not holding:
        spans = [(utc(one.first), utc(one.last)) for one in segments]
        said = ", ".join(f"{first.as_text()} to {last.as_text()}" for first, last in spans)
        raise PathFileError(
            f"{name}: has no place at {center.as_text()}; its useable time is {cut(said)}", spans=spans
        )
    return max(holding, key=lambda one: min(time.since(one.first), one.last.since(time)))


def velocity_off(samples: Sequence[Sample]) -> float:
    """How far velocities are from what the places do between two samples, over the speed; NaN where nobody knows.

    Sixteen pairs of neighbours are tried: near a pole the Earth's rotation hardly moves a place.
    """
    last = len(samples) - _BESIDE
    if last < _BESIDE:
        return 0.0
    found = [_off_at(samples, middle) for middle in range(_BESIDE, last + 1, max((last - _BESIDE) // 16, 1))]
    return max(found) if all(math.isfinite(one) for one in found) else math.nan


def _off_at(samples: Sequence[Sample], middle: int) -> float:
    """The same before one sample: the velocities, interpolated, are integrated after Gauss. Derived here."""
    near = [Sample(one.time, one.velocity, one.velocity) for one in samples[middle - _BESIDE : middle + _BESIDE]]
    a, b = samples[middle - 1 : middle + 1]
    step = b.time.since(a.time)
    means = [0.0, 0.0, 0.0]
    for share, weight in _GAUSS:
        velocity = interpolate(near, a.time.after(share * step), len(near), False)
        means = [mean + weight * one for mean, one in zip(means, velocity, strict=True)]
    moved = [(end - start) / step for start, end in zip(a.place, b.place, strict=True)]
    return math.dist(means, moved) / max(math.hypot(*moved), _SLOW)
