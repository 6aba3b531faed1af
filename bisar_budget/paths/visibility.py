"""Passes of a satellite over a scene: rise, culmination, set, and the times of a given squint.

A pass is the time during which the satellite is above a given elevation. An orbit is sampled every two minutes in the
axes of the scene, and interpolated by Lagrange polynomials through eight samples. The interpolation error is a few
centimetres in a low orbit, and less than a metre at the perigee of a transfer orbit. All searches use arrays of these
interpolated positions. The rate of the elevation is evaluated every half minute. An extremum of the elevation lies
where this rate changes sign. From one extremum to the next, a satellite in a low orbit makes about half a revolution.
Between two extrema the elevation only rises or only falls, so even the shortest pass is found, and it is found only
once.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.geometry import PlatformState
from bisar_budget.paths.earth import Floats, SceneAxes
from bisar_budget.paths.flight import Orbit, PathFileError
from bisar_budget.paths.instant import Instant

SAMPLE_STEP_S = 120.0
_INTERPOLATION_NODES = 8
_FINE_RATIO = 4  # number of evaluated times per sample
_HALVING_ROUNDS = 40  # of an interval around a root, which is then shorter than 1e-10 s
_CHANGE_ERROR_S = 1e-3  # of the time at which one orbit replaces another
_MAX_TOUCHING_GAP_S = 5 * _CHANGE_ERROR_S
_SEARCH_STEPS = 16  # of a span, in the search for orbits in a file that does not state its times
_MIN_SEARCH_STEP_S = 3600.0
# Inverse of Vandermonde's matrix, which gives the weights of the samples from powers of the time between two nodes.
_INTERPOLATION_WEIGHTS = np.linalg.inv(np.vander(np.arange(_INTERPOLATION_NODES, dtype=float), increasing=True))
_INTERPOLATION_POWERS = np.arange(_INTERPOLATION_NODES)


class OrbitGap(NamedTuple):
    """Part of a time span, from `start` [s] to `stop` [s], in which the position of a satellite is unknown."""

    start: float
    stop: float
    reason: str


class Stretch(NamedTuple):
    """Part of a time span, from `start` [s] to `stop` [s], in which a satellite is above a given elevation.

    `rises` is false if the satellite is already above the elevation when the known orbits begin. `sets` is false if
    it is still above the elevation when they end.
    """

    start: float
    stop: float
    rises: bool = True
    sets: bool = True


class _Sampled:
    """Samples of an orbit in the axes of a scene, from `start` [s] to `stop` [s].

    The samples are at most two minutes apart, and are interpolated. If the orbit ends early, `stop` is the end of the
    orbit, and `reason` states the cause.
    """

    def __init__(self, orbit: Orbit, axes: SceneAxes, origin: Instant, start: float, stop: float) -> None:
        self.orbit, self.start, self.reason = orbit, start, ""
        count = max(math.ceil((stop - start) / SAMPLE_STEP_S), _INTERPOLATION_NODES - 1)
        self.step = (stop - start) / count
        positions = []
        for n in range(count + 1):
            try:
                positions.append(orbit.place(origin.after(start + n * self.step)))
            except PathFileError as error:  # for example, the satellite has decayed
                self.reason = str(error)
                break
        self.stop = start + (len(positions) - 1) * self.step
        self.positions: Floats = axes.places(np.array(positions)) if positions else np.empty((0, 3))

    def at(self, times: Floats) -> tuple[Floats, Floats]:
        """Positions [m] and velocities [m/s], each (n, 3), interpolated at times (n,) within the samples."""
        sample_number = (times - self.start) / self.step
        last = len(self.positions) - _INTERPOLATION_NODES
        first = np.clip(sample_number.astype(int) - (_INTERPOLATION_NODES // 2 - 1), 0, last)
        offset = (sample_number - first)[:, None]
        powers = offset**_INTERPOLATION_POWERS
        rates = np.hstack([np.zeros_like(offset), powers[:, :-1] * _INTERPOLATION_POWERS[1:]])
        samples = self.positions[first[:, None] + _INTERPOLATION_POWERS]
        weights, slopes = powers @ _INTERPOLATION_WEIGHTS, rates @ _INTERPOLATION_WEIGHTS / self.step
        return np.einsum("nk,nkx->nx", weights, samples), np.einsum("nk,nkx->nx", slopes, samples)


@dataclass(frozen=True, eq=False)
class Watched:
    """Motion of a satellite as seen from a scene during a time span, and the parts of the span without an orbit.

    Times are seconds after `origin`. A file may have several element sets or segments. The position at each time then
    comes from one of them, chosen as in `orbits_of` for a mission.
    """

    origin: Instant
    pieces: Sequence[_Sampled]
    gaps: Sequence[OrbitGap]

    @classmethod
    def over(
        cls, orbit_at: Callable[[Instant], Orbit], axes: SceneAxes, origin: Instant, duration_s: float
    ) -> "Watched":
        """Sample a satellite's orbits during a time span that begins at `origin`.

        `orbit_at` returns the orbit that is valid at an instant, and raises `PathFileError` if there is no such
        orbit.
        """
        pieces: list[_Sampled] = []
        gaps: list[OrbitGap] = []
        for start, stop, orbit in _orbits(orbit_at, origin, duration_s):
            if isinstance(orbit, PathFileError):
                gaps.append(OrbitGap(start, stop, str(orbit)))
                continue
            piece = _Sampled(orbit, axes, origin, start, stop)
            if len(piece.positions) >= _INTERPOLATION_NODES:
                pieces.append(piece)
                start = piece.stop
            if piece.reason:
                gaps.append(OrbitGap(start, stop, piece.reason))
        return cls(origin, pieces, gaps)

    @cached_property
    def _starts(self) -> Floats:
        return np.array([piece.start for piece in self.pieces])

    def _of(self, times: Floats) -> NDArray[np.intp]:
        """Index in `pieces` of the orbit from which the position at each time is taken."""
        return np.maximum(np.searchsorted(self._starts, times, "right") - 1, 0)

    def at(self, times: Floats) -> tuple[Floats, Floats]:
        """Positions [m] and velocities [m/s] of the satellite in scene axes, each (n, 3).

        No time in `times` (n,) may be in one of the `gaps`, the parts of the time span without an orbit.
        """
        position, velocity = np.empty((2, times.size, 3))
        piece_numbers = self._of(times)
        for number in np.unique(piece_numbers).tolist():
            is_in_piece = piece_numbers == number
            position[is_in_piece], velocity[is_in_piece] = self.pieces[number].at(times[is_in_piece])
        return position, velocity

    def state(self, time: float) -> PlatformState:
        """`PlatformState` of the satellite at a time [s], with its position and velocity in scene axes."""
        (position,), (velocity,) = self.at(np.array([time]))
        return PlatformState(position=tuple(position.tolist()), velocity=tuple(velocity.tolist()))

    def orbit(self, time: float) -> Orbit:
        """Orbit from which the position at a time [s] is taken."""
        return self.pieces[int(self._of(np.array([time]))[0])].orbit

    def sine_of_elevation(self, times: Floats) -> Floats:
        """Sine of the elevation of the satellite at times (n,)."""
        position, _ = self.at(times)
        sine: Floats = position[:, 2] / np.linalg.norm(position, axis=1)
        return sine

    def _rate(self, times: Floats) -> Floats:
        """Rate of change of the sine of the elevation, multiplied by the slant range, at times (n,). [m/s]"""
        position, velocity = self.at(times)
        square = np.sum(position**2, axis=1)
        rate: Floats = velocity[:, 2] - position[:, 2] * np.sum(position * velocity, axis=1) / square
        return rate

    def squint(self, times: Floats) -> Floats:
        """Squint angle of the satellite at times (n,), as defined by `PlatformState.squint`. [rad]"""
        position, velocity = self.at(times)
        lengths = np.linalg.norm(position, axis=1) * np.linalg.norm(velocity, axis=1)
        with np.errstate(invalid="ignore"):
            sine = -np.sum(position * velocity, axis=1) / lengths
        angle: Floats = np.arcsin(np.clip(sine, -1.0, 1.0))
        return angle

    def above(self, elevation: float) -> list[Stretch]:
        """Find the stretches of time in which the satellite is above an elevation [rad], in chronological order."""
        min_sine = math.sin(elevation)
        stretches: list[Stretch] = []
        for piece in self.pieces:
            times = _times(piece.start, piece.stop)
            times = np.sort(np.concatenate([times, _roots(self._rate, times)]))
            crossings = _roots(lambda at: self.sine_of_elevation(at) - min_sine, times)
            edges = [piece.start, *crossings.tolist(), piece.stop]
            middles = np.array([(low + high) / 2 for low, high in pairwise(edges)])
            for (start, stop), is_above in zip(
                pairwise(edges), (self.sine_of_elevation(middles) > min_sine).tolist(), strict=True
            ):
                if not is_above:
                    continue
                stretch = Stretch(start, stop, start > piece.start, stop < piece.stop)
                previous = stretches[-1] if stretches else None
                # Stretches that touch at a change of elements, or where the elevation is just reached, are joined.
                if previous is not None and start - previous.stop < _MAX_TOUCHING_GAP_S:
                    stretches[-1] = previous._replace(stop=stop, sets=stretch.sets)
                else:
                    stretches.append(stretch)
        return stretches

    def culmination(self, stretch: Stretch) -> float:
        """Time of the highest elevation within a stretch. [s]"""
        times = _times(stretch.start, stretch.stop)
        times = np.concatenate([times, _roots(self._rate, times)])
        return float(times[self.sine_of_elevation(times).argmax()])

    def with_squint(self, stretch: Stretch, squint: float) -> float | None:
        """Time [s] within a stretch at which the squint has a given value [rad]; None if there is no such time.

        If there are several such times, the time with the highest elevation is returned.
        """
        squint_times = _roots(lambda at: self.squint(at) - squint, _times(stretch.start, stretch.stop))
        return float(squint_times[self.sine_of_elevation(squint_times).argmax()]) if squint_times.size else None


def shared(of_transmitter: Sequence[Stretch], of_receiver: Sequence[Stretch]) -> list[Stretch]:
    """Time spans in which both satellites are above their elevation limit: the overlaps of two lists of stretches."""
    overlaps = []
    for transmitter, receiver in product(of_transmitter, of_receiver):
        first = transmitter if transmitter.start >= receiver.start else receiver
        last = transmitter if transmitter.stop <= receiver.stop else receiver
        if first.start < last.stop:
            overlaps.append(Stretch(first.start, last.stop, first.rises, last.sets))
    return overlaps


def _times(start: float, stop: float) -> Floats:
    """Equally spaced times from `start` to `stop`, at most half a minute apart. [s]"""
    steps = max(math.ceil(_FINE_RATIO * (stop - start) / SAMPLE_STEP_S), _INTERPOLATION_NODES)
    times: Floats = np.linspace(start, stop, steps + 1)
    return times


def _roots(function: Callable[[Floats], Floats], times: Floats) -> Floats:
    """Times at which a function of time changes sign, found by bisection. [s]

    The function is assumed to change sign at most once between two neighbouring elements of `times`.
    """
    values = function(times)
    is_above = values > 0
    brackets = np.flatnonzero(is_above[1:] != is_above[:-1])
    low, high, rises = times[brackets], times[brackets + 1], is_above[brackets + 1]
    for _ in range(_HALVING_ROUNDS if brackets.size else 0):
        middle = (low + high) / 2
        is_after = (function(middle) > 0) == rises
        low, high = np.where(is_after, low, middle), np.where(is_after, middle, high)
    return (low + high) / 2


# ---------------------------------------------------------------------- one orbit after the other
def _orbits(
    orbit_at: Callable[[Instant], Orbit], origin: Instant, duration_s: float
) -> Iterator[tuple[float, float, Orbit | PathFileError]]:
    """Divide a time span into parts with one orbit each; yield the start [s], end [s] and orbit of each part.

    For a part without an orbit, the error that states the reason is yielded instead of the orbit. At each time, the
    element set with the nearest epoch is used, or, in an ephemeris, the segment in which the time is farthest from
    both ends. Each element set or segment is therefore used in a single part of the span.
    """
    orbits: dict[float, Orbit | PathFileError] = {}

    def at(time: float) -> Orbit | PathFileError:
        if time not in orbits:
            try:
                orbits[time] = orbit_at(origin.after(time))
            except PathFileError as error:
                orbits[time] = error
        return orbits[time]

    def search(start: float, stop: float) -> None:
        """Find all changes of the orbit between two times [s]; add the orbits before and after them to `orbits`."""
        orbit, next_orbit = at(start), at(stop)
        if stop - start <= _CHANGE_ERROR_S or (_are_same_orbit(orbit, next_orbit) and not _is_gap(orbit)):
            return
        inside = [time for time in _changes(orbit, next_orbit, origin) if start < time < stop]
        if _is_gap(orbit) and _is_gap(next_orbit) and not inside:
            has_spans = any(isinstance(gap, PathFileError) and gap.spans for gap in (orbit, next_orbit))
            is_explained = str(orbit) == str(next_orbit) or has_spans
            if is_explained or stop - start < max(_MIN_SEARCH_STEP_S, duration_s / _SEARCH_STEPS):
                return
        for begin_part, end_part in pairwise([start, *(inside or [(start + stop) / 2]), stop]):
            search(begin_part, end_part)

    search(0.0, duration_s)
    times = sorted(orbits)
    begin = times[0]
    for before, time in pairwise(times):
        if not _are_same_orbit(orbits[before], orbits[time]):
            yield begin, before, orbits[begin]
            begin = time
    yield begin, times[-1], orbits[begin]


def _is_gap(orbit: Orbit | PathFileError) -> bool:
    return isinstance(orbit, PathFileError)


def _are_same_orbit(orbit: Orbit | PathFileError, next_orbit: Orbit | PathFileError) -> bool:
    """Whether two orbits have the same epoch and the same span, or are both missing."""
    if isinstance(orbit, PathFileError) or isinstance(next_orbit, PathFileError):
        return _is_gap(orbit) and _is_gap(next_orbit)
    return (orbit.epoch, orbit.span) == (next_orbit.epoch, next_orbit.span)


def _changes(orbit: Orbit | PathFileError, next_orbit: Orbit | PathFileError, origin: Instant) -> list[float]:
    """Times at which one orbit is likely to replace another. [s]

    These are the start and end times of ephemerides, and the middle between the epochs of two element sets.
    """
    ends: list[Instant] = []
    for candidate in (orbit, next_orbit):
        if isinstance(candidate, PathFileError):
            ends += [end for span in candidate.spans for end in span]
        elif candidate.span is not None:
            ends += candidate.span
    times = [end.since(origin) for end in ends]
    epochs = [candidate.epoch for candidate in (orbit, next_orbit) if isinstance(candidate, Orbit)]
    known_epochs = [epoch.since(origin) for epoch in epochs if epoch is not None]
    if len(known_epochs) == 2:
        times.append(sum(known_epochs) / 2)
    return sorted({time + side for time in times for side in (-_CHANGE_ERROR_S / 2, _CHANGE_ERROR_S / 2)})
