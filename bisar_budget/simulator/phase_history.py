"""Bistatic phase history of point scatterers, (1) to (3) of Rigling & Moses, from exact ranges.

There is no Taylor series here: the simulator judges the expansions, so it must not share them.
Frame: scene centre at the origin, x east, y north, z up. SI units.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.geometry import BistaticGeometry, GroundVector, PlatformState, Vector, Vectors
from bisar_budget.image_plane import LEADING, Sampling, band_variance
from bisar_budget.mission.model import Radar
from bisar_budget.ranges.exact_ranges import ExactEffect, ExactRanges, followed

_HELD = 1 << 18  # complex numbers held at once
_NO_SIGHT = 1e-20  # square of what a metre of a platform changes; less is rounding
SMOOTH = 12  # order of what is smooth of a history
_ORDER = 12  # of the fit to samples anywhere over the aperture
_ROUNDING = 1e-14  # of a frequency: what numpy.linspace leaves

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


class PathSinusoid(NamedTuple):
    """One vibration: amplitude 0 to peak [m], frequency [Hz], phase at τ = 0 [rad].

    It moves its platform along `axis`, a unit vector; along the line of sight, as it turns, where there is none.
    """

    amplitude: float
    frequency: float
    phase: float = 0.0
    axis: Vector | None = None


@dataclass(frozen=True, eq=False)
class Course:
    """An error over slow time: `times` (n,) [s] and `values` (n,) or (n, 3), joined by straight lines."""

    times: Floats
    values: Floats

    def at(self, slow_time: Floats) -> Floats:
        """Values at other times, (m,) or (m, 3)."""
        if self.values.ndim == 1:
            found: Floats = np.interp(slow_time, self.times, self.values)
            return found
        return np.stack([np.interp(slow_time, self.times, along) for along in self.values.T], axis=1)

    def smooth(self, order: int = SMOOTH) -> "Course":
        """The part that moves and defocuses a response: the polynomial fitted to it, without what is faster."""
        place = 2 * (self.times - self.times[0]) / (self.times[-1] - self.times[0]) - 1
        fit = np.polynomial.legendre.legfit(place, self.values, order)
        return Course(self.times, np.polynomial.legendre.legval(place, fit).T)

    @property
    def mean(self) -> float:
        """Mean over its times, of values (n,)."""
        middles = (self.values[1:] + self.values[:-1]) / 2
        return float(middles @ np.diff(self.times) / (self.times[-1] - self.times[0]))


class PathError(NamedTuple):
    """Measured minus actual position of one platform, r̃(τ): (22) and what is faster.

    Position [m], velocity [m/s], acceleration [m/s²] and `course` [m], which is any other history, are
    east-north-up; noise is along the line of sight, positive away from the scene, and so is a vibration without an
    axis. `time_tag` [s] takes the true path for what it is so much later. `wideband_rms` [m] is noise of the pulses,
    white or within `wideband_band` (low, high) [Hz], and needs a generator.
    """

    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    acceleration: tuple[float, float, float] = (0.0, 0.0, 0.0)
    sinusoids: tuple[PathSinusoid, ...] = ()
    wideband_rms: float = 0.0
    wideband_band: tuple[float, float] | None = None
    course: Course | None = None
    time_tag: float = 0.0

    def slow(self) -> "PathError":
        """The same with what is smooth of its other history."""
        return self if self.course is None else self._replace(course=self.course.smooth())

    def still(self) -> "PathError":
        """The same without vibration."""
        return self._replace(sinusoids=(), wideband_rms=0.0)

    def plus(self, other: "PathError") -> "PathError":
        """Both polynomial errors and time tags at once; vibration is not added."""
        position, velocity, acceleration = (
            (u[0] + v[0], u[1] + v[1], u[2] + v[2]) for u, v in zip(self[:3], other[:3], strict=True)
        )
        return PathError(position, velocity, acceleration, time_tag=self.time_tag + other.time_tag)


class Errors(NamedTuple):
    """Errors in one image: of both platforms, the clock's t̃₀ … t̃₃ of (1), and any other history of the clock.

    [s], [1], [1/s], [1/s²]; `clock_course` [s], which a delay in the air is too. `electrons` is the delay by free
    electrons at a frequency f of 1 Hz, which falls as 1/f² and advances the phase. [s·Hz²]
    """

    transmitter: PathError = PathError()
    receiver: PathError = PathError()
    clock: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    clock_course: Course | None = None
    electrons: Course | None = None

    def of(self, platform: str, error: PathError) -> "Errors":
        """Give one platform an error."""
        return self._replace(transmitter=error) if platform == "transmitter" else self._replace(receiver=error)

    def smooth(self) -> "Errors":
        """The same errors without vibration, and with what is smooth of other histories."""
        return self.slow().still()

    def still(self) -> "Errors":
        """The same without vibration."""
        return self._replace(transmitter=self.transmitter.still(), receiver=self.receiver.still())

    def slow(self) -> "Errors":
        """The same with what is smooth of other histories: noise between a few nodes would pass for a phase."""
        return self._replace(
            transmitter=self.transmitter.slow(),
            receiver=self.receiver.slow(),
            clock_course=self.clock_course and self.clock_course.smooth(),
            electrons=self.electrons and self.electrons.smooth(),
        )


def superposed(parts: Iterable[Errors]) -> Errors:
    """All of several polynomial errors at once; vibration is not added."""
    total = Errors()
    for part in parts:
        total = Errors(
            transmitter=total.transmitter.plus(part.transmitter),
            receiver=total.receiver.plus(part.receiver),
            clock=tuple(a + b for a, b in zip(total.clock, part.clock, strict=True)),
        )
    return total


@dataclass(frozen=True, kw_only=True, eq=False)
class Path:
    """Where a platform is at each pulse and where its navigation says it is, each (pulses, 3). [m]"""

    actual: Floats
    measured: Floats

    def seen_from(self, place: GroundVector) -> "Path":
        """The same with a ground point for its origin."""
        away = np.array([*place, 0.0])
        return Path(actual=self.actual - away, measured=self.measured - away)


@dataclass(frozen=True, eq=False)
class Flight:
    """Both platforms at some slow times, and the error of the clock there, (times,). [s]

    `electrons` is the delay by free electrons at 1 Hz [s·Hz²], None without. `seen` is the error of a clock that has
    the same effect at the centre frequency as the clock and they have together. [s]
    """

    transmitter: Path
    receiver: Path
    clock: Floats
    seen: Floats
    electrons: Floats | None = None

    @property
    def paths(self) -> tuple[Path, Path]:
        """Those of transmitter and receiver."""
        return self.transmitter, self.receiver

    def as_measured(self) -> "Flight":
        """The flight that the processor believes in: where the paths were measured, by a perfect clock."""
        transmitter, receiver = (Path(actual=one.measured, measured=one.measured) for one in self.paths)
        return Flight(transmitter, receiver, np.zeros_like(self.clock), np.zeros_like(self.clock))

    def range_error(self, scatterer: GroundVector, seen_at: GroundVector) -> Floats:
        """Range sum of a ground point as recorded, less that of another by the measured paths, (times,). [m]"""
        there, here = np.array([*scatterer, 0.0]), np.array([*seen_at, 0.0])
        total: Floats = np.zeros(self.clock.shape)
        for one in self.paths:
            total += np.linalg.norm(one.actual - there, axis=1) - np.linalg.norm(one.measured - here, axis=1)
        return total + SPEED_OF_LIGHT * self.seen

    def record(
        self, scatterers: Floats, amplitudes: Complexes, slow_time: Floats, frequency: Floats, **noise: Any
    ) -> "PhaseHistory":
        """The phase history of scatterers as the receiver records it at these slow times: `phase_history`."""
        return phase_history(
            scatterers,
            amplitudes,
            slow_time=slow_time,
            frequency=frequency,
            transmitter=self.transmitter,
            receiver=self.receiver,
            clock_error=self.clock,
            electrons=self.electrons,
            **noise,
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class PhaseHistory:
    """Received samples after motion compensation to the scene centre, and what the processor knows of them.

    `samples` is (pulses, frequencies); `slow_time` [s] and `frequency` [Hz] are evenly spaced;
    `transmitter` and `receiver` are the measured positions, (pulses, 3). [m]
    """

    samples: Complexes
    slow_time: Floats
    frequency: Floats
    transmitter: Floats
    receiver: Floats


def look_sum(transmitter: Floats, receiver: Floats) -> Floats:
    """Unit vectors from the origin of positions (pulses, 3) to them, added: what stands in (6). (pulses, 3)"""
    total: Floats = np.zeros(transmitter.shape)
    for positions in (transmitter, receiver):
        total += positions / np.linalg.norm(positions, axis=1, keepdims=True)
    return total


def cell_centres(length: float, count: int) -> Floats:
    """Centres of `count` equal cells of an interval about zero: samples that stand for the whole of it."""
    centres: Floats = np.linspace(-(length - length / count) / 2, (length - length / count) / 2, count)
    return centres


def is_even(frequency: Floats) -> bool:
    """Whether frequencies are evenly spaced, to rounding: over kilometres of range that is no phase."""
    return frequency.size > 2 and float(np.ptp(np.diff(frequency))) <= _ROUNDING * float(np.abs(frequency).max())


def split(wavenumber: Floats) -> tuple[Floats, Floats]:
    """Wavenumbers, evenly spaced, as the sums of a coarse and a fine one, row by row; the last row may be too long.

    A phase over n of them is a product, of which only 2√n exponentials are formed.
    """
    fine = math.isqrt(wavenumber.size - 1) + 1
    coarse = -(-wavenumber.size // fine)
    step = float(wavenumber[-1] - wavenumber[0]) / (wavenumber.size - 1)
    return float(wavenumber[0]) + step * fine * np.arange(float(coarse)), step * np.arange(float(fine))


def path(
    state: PlatformState,
    slow_time: Floats,
    error: PathError | None = None,
    rng: np.random.Generator | None = None,
    way: Floats | None = None,
) -> Path:
    """Fly one platform along its path, and measure it with an error.

    Parameters
    ----------
    state : PlatformState
        At τ = 0.
    slow_time : (pulses,) ndarray
        [s]
    error : PathError, optional
        None: the navigation is perfect.
    rng : numpy Generator, optional
        Needed for wideband vibration only.
    way : (pulses, 3) ndarray, optional
        By which a vibration of a metre moves; a metre along the line of sight. [m/m]

    Raises
    ------
    ValueError
        Wideband vibration without a generator, or in a band that holds no frequency of the pulses.
    """
    actual = _placed(state, slow_time)
    if error is None:
        return Path(actual=actual, measured=actual)
    # (22): p̃ + ṽτ + ãτ²/2
    tau = slow_time[:, None]
    measured = _placed(state, slow_time + error.time_tag) if error.time_tag else actual
    measured = measured + np.asarray(error.position) + np.asarray(error.velocity) * tau
    measured = measured + np.asarray(error.acceleration) * tau**2 / 2
    if error.course is not None:
        measured = measured + error.course.at(slow_time)
    along = np.zeros_like(slow_time)
    for sinusoid in error.sinusoids:
        course = sinusoid.amplitude * np.sin(2 * math.pi * sinusoid.frequency * slow_time + sinusoid.phase)
        if sinusoid.axis is None:
            along += course
        else:
            measured = measured + np.multiply.outer(course, sinusoid.axis)
    if error.wideband_rms:
        if rng is None:
            raise ValueError("wideband vibration needs a random generator")
        along += error.wideband_rms * _noise(slow_time, error.wideband_band, rng)
    sight = actual / np.linalg.norm(actual, axis=1, keepdims=True) if way is None else way
    return Path(actual=actual, measured=measured + sight * along[:, None])


def _placed(state: PlatformState, slow_time: Floats) -> Floats:
    """Positions of a path, (times, 3). [m]"""
    return np.stack(np.broadcast_arrays(*state.place(slow_time)), axis=1)


def _noise(slow_time: Floats, band: tuple[float, float] | None, rng: np.random.Generator) -> Floats:
    """Gaussian noise of unit variance over the pulses, white or within a band [Hz]."""
    white: Floats = rng.normal(0.0, 1.0, slow_time.shape)
    if band is None:
        return white
    step = float(slow_time[1] - slow_time[0])
    frequency = np.fft.rfftfreq(slow_time.size, step)
    inside = (frequency >= band[0]) & (frequency <= band[1])
    # Every frequency stands for two of the full spectrum, but zero and, of an even number, the highest.
    stands_for = np.full(frequency.size, 2.0)
    stands_for[0] = 1.0
    stands_for[-1] = 2.0 if slow_time.size % 2 else 1.0
    weight = stands_for @ inside
    if not weight:
        raise ValueError(
            f"the band from {band[0]:g} to {band[1]:g} Hz holds no frequency of the pulses: they are "
            f"{frequency[1]:.3g} Hz apart, up to {frequency[-1]:.4g} Hz"
        )
    noise: Floats = np.fft.irfft(np.fft.rfft(white) * inside, slow_time.size)
    return noise * math.sqrt(slow_time.size / float(weight))


def direct_path_ways(geometry: BistaticGeometry, slow_time: Floats) -> tuple[Floats, Floats]:
    """Shortest ways of both platforms that change the range less the direct path by a metre, each (pulses, 3). [m/m]

    They lead along u_t − b and u_r + b. A platform that changes nothing has none.
    """
    places = (PlatformState(position=one.place(slow_time), velocity=one.velocity) for one in geometry.both)
    moved = BistaticGeometry(**dict(zip(("transmitter", "receiver"), places, strict=True)))
    sights = (np.stack(one, axis=1) for one in moved.sights(has_direct_path=True))
    squares = ((sight, np.sum(sight**2, axis=1, keepdims=True)) for sight in sights)
    transmitter, receiver = (
        np.where(square > _NO_SIGHT, sight / np.maximum(square, _NO_SIGHT), 0.0) for sight, square in squares
    )
    return transmitter, receiver


def direct_path_error(paths: tuple[Path, Path]) -> Floats:
    """Clock error of a receiver that hears the transmitter, (pulses,): how much too far apart both are measured. [s]

    Its clock is the direct signal, which is late by the actual distance; the processor takes the measured one off.
    """
    a, b = paths
    grown: Floats = np.linalg.norm(a.measured - b.measured, axis=-1) - np.linalg.norm(a.actual - b.actual, axis=-1)
    return grown / SPEED_OF_LIGHT


def phase_history(
    scatterers: Floats,
    amplitudes: Complexes,
    *,
    slow_time: Floats,
    frequency: Floats,
    transmitter: Path,
    receiver: Path,
    clock_error: Floats | float = 0.0,
    electrons: Floats | None = None,
    noise_power: float = 0.0,
    rng: np.random.Generator | None = None,
) -> PhaseHistory:
    """Return what the receiver records, motion compensated with the measured positions.

    Parameters
    ----------
    scatterers : (scatterers, 3) ndarray
        Positions. [m]
    amplitudes : (scatterers,) ndarray
        Complex reflection coefficients A_m of (3).
    slow_time : (pulses,) ndarray
        [s]
    frequency : (frequencies,) ndarray
        [Hz]
    transmitter, receiver : Path
        At the pulses.
    clock_error : (pulses,) ndarray or float
        t̃(τ) of (1). [s]
    electrons : (pulses,) ndarray, optional
        Delay by free electrons at a frequency of 1 Hz, the same for every scatterer. [s·Hz²]
    noise_power : float
        Variance of the circular white Gaussian noise of a sample, relative to amplitude 1.
    rng : numpy Generator, optional
        Needed for noise only.

    Returns
    -------
    PhaseHistory

    Raises
    ------
    ValueError
        Noise without a generator, or not one amplitude for each scatterer.
    """
    wavenumber = 2 * math.pi * frequency / SPEED_OF_LIGHT
    reference = np.linalg.norm(transmitter.measured, axis=1) + np.linalg.norm(receiver.measured, axis=1)
    clock = SPEED_OF_LIGHT * np.broadcast_to(np.asarray(clock_error, dtype=float), slow_time.shape)
    samples = np.zeros((slow_time.size, frequency.size), dtype=complex)
    scatterers, amplitudes = np.atleast_2d(scatterers), np.atleast_1d(amplitudes)
    if len(scatterers) != len(amplitudes):
        raise ValueError(f"{len(scatterers)} scatterers have {len(amplitudes)} amplitudes")
    # (3) with the frequency split into coarse and fine steps: e^{-j(k + q)R} is a product, and the sum over
    # scatterers one of matrices, so that 2√n exponentials do for n frequencies.
    coarse, fine = split(wavenumber) if is_even(frequency) else (wavenumber, np.zeros(1))
    many = max(1, _HELD // (coarse.size + fine.size))
    together = max(1, min(many, len(scatterers)))
    pulses = max(1, min(many // together, _HELD // (coarse.size * fine.size)))
    for begin in range(0, slow_time.size, pulses):
        some = slice(begin, begin + pulses)
        total: Complexes = np.zeros((slow_time[some].size, coarse.size, fine.size), dtype=complex)
        for start in range(0, len(scatterers), together):
            part = slice(start, start + together)
            ranges = np.linalg.norm(transmitter.actual[some, None] - scatterers[part], axis=-1)
            ranges += np.linalg.norm(receiver.actual[some, None] - scatterers[part], axis=-1)
            ranges = ranges - reference[some, None] + clock[some, None]  # (1)
            by_coarse = np.exp(-1j * coarse[:, None] * ranges[:, None]) * amplitudes[part]  # (2), (3)
            total += by_coarse @ np.exp(-1j * ranges[..., None] * fine)
        samples[some] = total.reshape(len(total), -1)[:, : wavenumber.size]
    if electrons is not None:  # a delay of K/f² is a phase of +2πK/f: its derivative by 2πf is -K/f²
        samples *= np.exp(2j * math.pi * electrons[:, None] / frequency)
    if noise_power:
        if rng is None:
            raise ValueError("noise needs a random generator")
        scale = math.sqrt(noise_power / 2)
        samples += rng.normal(0.0, scale, samples.shape) + 1j * rng.normal(0.0, scale, samples.shape)
    return PhaseHistory(
        samples=samples,
        slow_time=slow_time,
        frequency=frequency,
        transmitter=transmitter.measured,
        receiver=receiver.measured,
    )


# ---------------------------------------------------------------------- by exact ranges
class NoGroundPointError(ValueError):
    """No ground point has the recorded range history: the point has no image."""


def exact_effect(
    slow_time: Floats,
    transmitter: Path,
    receiver: Path,
    clock_error: Floats | float,
    radar: Radar,
    aperture_time_s: float,
) -> ExactEffect:
    """Effect of one error, its paths sampled anywhere over the aperture: see `ranges.exact_ranges`.

    Raises
    ------
    NoGroundPointError
        No ground point has the recorded range history.
    """
    half, paths = aperture_time_s / 2, (transmitter, receiver)
    exact = ExactRanges(
        np.array([half]),
        np.array([2 * math.pi / radar.wavelength]),
        np.array([band_variance(radar)]),
        _sampling(slow_time / half),
        [_columns(one.actual) for one in paths],
        [_columns(one.actual[slow_time.size // 2]) for one in paths],
    )
    clock = np.broadcast_to(SPEED_OF_LIGHT * np.asarray(clock_error, dtype=float), slow_time.shape)[:, None]
    shifts = [_columns(one.measured - one.actual) for one in paths]
    found = followed(exact, clock, shifts, np.zeros(1, dtype=int))
    if not found.is_settled[0]:
        raise NoGroundPointError("no ground point has the recorded range history")
    east, north, *phases = (float(one[0]) for one in found[1:-1])
    return ExactEffect((east, north), *phases)


def _columns(positions: Floats) -> Vectors:
    """Positions (..., 3) by component, each (..., 1)."""
    x, y, z = np.moveaxis(positions, -1, 0)[..., None]
    return x, y, z


def _sampling(places: Floats) -> Sampling:
    """Samples anywhere in −1 … 1, fitted by the polynomial through them."""
    legendre = np.polynomial.legendre.legvander(places, min(_ORDER, max(3, places.size // 4)))
    return Sampling(places, LEADING[:, None] * np.linalg.pinv(legendre)[:4])
