"""When a satellite is above an elevation at a place: rise, culmination and set, and where it has a squint.

An orbit is sampled each two minutes in the axes of the scene, and read between by Lagrange's polynomials through
eight places: they leave centimetres of a low orbit, and less than a metre at the perigee of a transfer orbit. All
that is looked for is then found on arrays. The rate of the elevation is looked at each half minute, and each extremum
found where it changes its sign. From one extremum to the next a low orbit makes about half a turn. Between two of
them the elevation only rises or only falls, so that no pass is missed, however short, and none is there twice.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.geometry import PlatformState
from bisar_budget.paths.earth import Floats, SceneAxes
from bisar_budget.paths.flight import Orbit, PathFileError
from bisar_budget.paths.instant import Instant

STEP = 120.0  # s between places
_NODES = 8
_FINE = 4  # times as many places are looked at
_HALVINGS = 40  # of a bracket, to 1e-10 s
_APART = 1e-3  # s to which it is found where one orbit ends and the next begins
_TOUCHING = 5 * _APART
_LOOKED_FOR = 16  # parts of a span in which an orbit is looked for, where a file does not say when it has one
_SHORTEST = 3600.0  # s; shorter parts are not looked into
# Powers of a place between two nodes to the weights of the places around: the inverse of Vandermonde's matrix.
_WEIGHTS = np.linalg.inv(np.vander(np.arange(_NODES, dtype=float), increasing=True))
_POWERS = np.arange(_NODES)


class OrbitGap(NamedTuple):
    """A part of a span in which nothing is known of where a satellite is, and why. [s]"""

    start: float
    stop: float
    reason: str


class Stretch(NamedTuple):
    """A part of a span in which a satellite is above an elevation. [s]

    `rises` and `sets` are false where it is above at the beginning, or the end, of what is known.
    """

    start: float
    stop: float
    rises: bool = True
    sets: bool = True


class _Sampled:
    """Places of one orbit in the axes of a scene, each two minutes from `start` to `stop` or a little closer. [s]"""

    def __init__(self, orbit: Orbit, axes: SceneAxes, origin: Instant, start: float, stop: float) -> None:
        self.orbit, self.start, self.reason = orbit, start, ""
        count = max(math.ceil((stop - start) / STEP), _NODES - 1)
        self.step = (stop - start) / count
        places = []
        for n in range(count + 1):
            try:
                places.append(orbit.place(origin.after(start + n * self.step)))
            except PathFileError as error:  # it has decayed
                self.reason = str(error)
                break
        self.stop = start + (len(places) - 1) * self.step
        self.places: Floats = axes.places(np.array(places)) if places else np.empty((0, 3))

    def at(self, times: Floats) -> tuple[Floats, Floats]:
        """Places and velocities (n, 3) at times (n,) within. [m], [m/s]"""
        where = (times - self.start) / self.step
        first = np.clip(where.astype(int) - (_NODES // 2 - 1), 0, len(self.places) - _NODES)
        past = (where - first)[:, None]
        powers = past**_POWERS
        rates = np.hstack([np.zeros_like(past), powers[:, :-1] * _POWERS[1:]])
        near = self.places[first[:, None] + _POWERS]
        weights, slopes = powers @ _WEIGHTS, rates @ _WEIGHTS / self.step
        return np.einsum("nk,nkx->nx", weights, near), np.einsum("nk,nkx->nx", slopes, near)


@dataclass(frozen=True, eq=False)
class Watched:
    """A satellite as it is seen from the origin of a scene over a span of time, and the parts without an orbit.

    Times are seconds after `origin`. Where a file has several element sets, or segments, each is flown where it is
    nearest, as `orbits_of` a mission has it.
    """

    origin: Instant
    pieces: Sequence[_Sampled]
    gaps: Sequence[OrbitGap]

    @classmethod
    def over(
        cls, orbit_at: Callable[[Instant], Orbit], axes: SceneAxes, origin: Instant, duration_s: float
    ) -> "Watched":
        """Sample the orbits of a span from `origin` on; `orbit_at` raises `PathFileError` where there is none."""
        pieces: list[_Sampled] = []
        gaps: list[OrbitGap] = []
        for start, stop, orbit in _orbits(orbit_at, origin, duration_s):
            if isinstance(orbit, PathFileError):
                gaps.append(OrbitGap(start, stop, str(orbit)))
                continue
            piece = _Sampled(orbit, axes, origin, start, stop)
            if len(piece.places) >= _NODES:
                pieces.append(piece)
                start = piece.stop
            if piece.reason:
                gaps.append(OrbitGap(start, stop, piece.reason))
        return cls(origin, pieces, gaps)

    @cached_property
    def _starts(self) -> Floats:
        return np.array([piece.start for piece in self.pieces])

    def _of(self, times: Floats) -> NDArray[np.intp]:
        """Number of the piece that each time is in."""
        return np.maximum(np.searchsorted(self._starts, times, "right") - 1, 0)

    def at(self, times: Floats) -> tuple[Floats, Floats]:
        """Places and velocities (n, 3) in the scene's axes at times (n,) that have an orbit. [m], [m/s]"""
        place, velocity = np.empty((2, times.size, 3))
        which = self._of(times)
        for number in np.unique(which).tolist():
            same = which == number
            place[same], velocity[same] = self.pieces[number].at(times[same])
        return place, velocity

    def state(self, time: float) -> PlatformState:
        """Place and velocity at a time."""
        (place,), (velocity,) = self.at(np.array([time]))
        return PlatformState(position=tuple(place.tolist()), velocity=tuple(velocity.tolist()))

    def orbit(self, time: float) -> Orbit:
        """The orbit that is flown at a time."""
        return self.pieces[int(self._of(np.array([time]))[0])].orbit

    def sine_of_elevation(self, times: Floats) -> Floats:
        """Sine of the elevation (n,)."""
        place, _ = self.at(times)
        sine: Floats = place[:, 2] / np.linalg.norm(place, axis=1)
        return sine

    def _rate(self, times: Floats) -> Floats:
        """Rate of the sine of the elevation (n,), times the slant range. [m/s]"""
        place, velocity = self.at(times)
        square = np.sum(place**2, axis=1)
        rate: Floats = velocity[:, 2] - place[:, 2] * np.sum(place * velocity, axis=1) / square
        return rate

    def squint(self, times: Floats) -> Floats:
        """Squint (n,) of `PlatformState.squint`, of many times. [rad]"""
        place, velocity = self.at(times)
        lengths = np.linalg.norm(place, axis=1) * np.linalg.norm(velocity, axis=1)
        with np.errstate(invalid="ignore"):
            sine = -np.sum(place * velocity, axis=1) / lengths
        angle: Floats = np.arcsin(np.clip(sine, -1.0, 1.0))
        return angle

    def above(self, elevation: float) -> list[Stretch]:
        """Stretches of time above an elevation [rad], in their order."""
        least = math.sin(elevation)
        found: list[Stretch] = []
        for piece in self.pieces:
            times = _times(piece.start, piece.stop)
            times = np.sort(np.concatenate([times, _roots(self._rate, times)]))
            crossings = _roots(lambda at: self.sine_of_elevation(at) - least, times)
            edges = [piece.start, *crossings.tolist(), piece.stop]
            middles = np.array([(a + b) / 2 for a, b in pairwise(edges)])
            for (start, stop), is_above in zip(
                pairwise(edges), (self.sine_of_elevation(middles) > least).tolist(), strict=True
            ):
                if not is_above:
                    continue
                stretch = Stretch(start, stop, start > piece.start, stop < piece.stop)
                before = found[-1] if found else None
                if before is not None and start - before.stop < _TOUCHING:  # the next elements, or a grazed edge
                    found[-1] = before._replace(stop=stop, sets=stretch.sets)
                else:
                    found.append(stretch)
        return found

    def culmination(self, stretch: Stretch) -> float:
        """Time within a stretch at which the satellite stands highest. [s]"""
        times = _times(stretch.start, stretch.stop)
        times = np.concatenate([times, _roots(self._rate, times)])
        return float(times[self.sine_of_elevation(times).argmax()])

    def with_squint(self, stretch: Stretch, squint: float) -> float | None:
        """Time within a stretch at which it has a squint [rad], of several the one where it stands highest. [s]"""
        found = _roots(lambda at: self.squint(at) - squint, _times(stretch.start, stretch.stop))
        return float(found[self.sine_of_elevation(found).argmax()]) if found.size else None


def shared(some: Sequence[Stretch], others: Sequence[Stretch]) -> list[Stretch]:
    """Stretches in which both are above."""
    found = []
    for one in some:
        for other in others:
            first, last = (one if one.start >= other.start else other), (one if one.stop <= other.stop else other)
            if first.start < last.stop:
                found.append(Stretch(first.start, last.stop, first.rises, last.sets))
    return found


def _times(start: float, stop: float) -> Floats:
    """Times from a beginning to an end, half a minute apart or closer."""
    times: Floats = np.linspace(start, stop, max(math.ceil(_FINE * (stop - start) / STEP), _NODES) + 1)
    return times


def _roots(function: Callable[[Floats], Floats], times: Floats) -> Floats:
    """Times at which a function changes its sign, of which there is at most one between two of the given ones."""
    values = function(times)
    is_above = values > 0
    places = np.flatnonzero(is_above[1:] != is_above[:-1])
    low, high, rises = times[places], times[places + 1], is_above[places + 1]
    for _ in range(_HALVINGS if places.size else 0):
        middle = (low + high) / 2
        is_behind = (function(middle) > 0) == rises
        low, high = np.where(is_behind, low, middle), np.where(is_behind, middle, high)
    return (low + high) / 2


# ---------------------------------------------------------------------- one orbit after the other
def _orbits(
    orbit_at: Callable[[Instant], Orbit], origin: Instant, duration_s: float
) -> Iterator[tuple[float, float, Orbit | PathFileError]]:
    """Beginning and end of each part of a span in which one orbit is flown, or none, and why. [s]

    Of element sets the nearest is flown, of segments the one that has most around: either has one part of the time.
    """
    known: dict[float, Orbit | PathFileError] = {}

    def at(time: float) -> Orbit | PathFileError:
        if time not in known:
            try:
                known[time] = orbit_at(origin.after(time))
            except PathFileError as error:
                known[time] = error
        return known[time]

    def look(start: float, stop: float) -> None:
        """Find all that differ between two times."""
        a, b = at(start), at(stop)
        if stop - start <= _APART or (_are_one(a, b) and not _is_gap(a)):
            return
        inside = [time for time in _changes(a, b, origin) if start < time < stop]
        if _is_gap(a) and _is_gap(b) and not inside:
            is_known = str(a) == str(b) or any(isinstance(one, PathFileError) and one.spans for one in (a, b))
            if is_known or stop - start < max(_SHORTEST, duration_s / _LOOKED_FOR):
                return
        for c, d in pairwise([start, *(inside or [(start + stop) / 2]), stop]):
            look(c, d)

    look(0.0, duration_s)
    times = sorted(known)
    begin = times[0]
    for before, time in pairwise(times):
        if not _are_one(known[before], known[time]):
            yield begin, before, known[begin]
            begin = time
    yield begin, times[-1], known[begin]


def _is_gap(orbit: Orbit | PathFileError) -> bool:
    return isinstance(orbit, PathFileError)


def _are_one(a: Orbit | PathFileError, b: Orbit | PathFileError) -> bool:
    """Whether two orbits are of one epoch or span, or neither is there."""
    if isinstance(a, PathFileError) or isinstance(b, PathFileError):
        return _is_gap(a) and _is_gap(b)
    return (a.epoch, a.span) == (b.epoch, b.span)


def _changes(a: Orbit | PathFileError, b: Orbit | PathFileError, origin: Instant) -> list[float]:
    """Times around which one is likely to give way to another: ends of spans, the middle of two epochs. [s]"""
    ends: list[Instant] = []
    for one in (a, b):
        spans = one.spans if isinstance(one, PathFileError) else [one.span] if one.span is not None else []
        ends += [end for span in spans for end in span]
    times = [end.since(origin) for end in ends]
    if isinstance(a, Orbit) and isinstance(b, Orbit) and a.epoch is not None and b.epoch is not None:
        times.append((a.epoch.since(origin) + b.epoch.since(origin)) / 2)
    return sorted({time + side for time in times for side in (-_APART / 2, _APART / 2)})
