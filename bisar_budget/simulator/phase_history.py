"""Bistatic phase history of point scatterers from exact ranges, as in equations (1) to (3) of Rigling & Moses.

The simulator is used to check the series expansions of the budget, so it uses no Taylor series itself. Frame: scene
centre at the origin, x east, y north, z up. All quantities are in SI units.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.geometry import BistaticGeometry, GroundVector, PlatformState, Vector, VectorArrays
from bisar_budget.image_plane import LEGENDRE_LEADING, Sampling, band_variance
from bisar_budget.mission.model import Radar
from bisar_budget.ranges.exact_ranges import ExactEffect, ExactRanges, followed
from bisar_budget.simulator.orbit_error import orbit_error

_BLOCK_SAMPLES = 1 << 18  # complex numbers in memory at once
_MIN_SIGHT_RATIO = 1e-20  # square of the range change per metre of platform motion; less is rounding
SMOOTH_ORDER = 12  # order of the polynomial that is the smooth part of an error history
_FIT_ORDER = 12  # order of the polynomial fitted to samples at any times of the aperture
_FREQUENCY_ROUNDING_FRACTION = 1e-14  # of a frequency: rounding of numpy.linspace

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


class PathSinusoid(NamedTuple):
    """A sinusoidal vibration of a platform: zero-to-peak amplitude [m], frequency [Hz], and phase at τ = 0 [rad].

    The platform moves along `axis`, a unit vector. If `axis` is None, it moves along the line of sight, which turns
    over the aperture.
    """

    amplitude: float
    frequency: float
    phase: float = 0.0
    axis: Vector | None = None


class ReceiverNoise(TypedDict, total=False):
    """Keyword arguments of `phase_history` for receiver noise: the noise power and the random generator."""

    noise_power: float
    rng: np.random.Generator | None


@dataclass(frozen=True, eq=False)
class Course:
    """Error as a function of slow time, defined by samples and linear interpolation between them.

    `times` (n,) [s] holds the slow times of the samples. `values` has the shape (n,), or (n, 3) for vectors.
    """

    times: Floats
    values: Floats

    def at(self, slow_time: Floats) -> Floats:
        """Linearly interpolated values at m slow times. The result has the shape (m,), or (m, 3) for vectors."""
        if self.values.ndim == 1:
            values: Floats = np.interp(slow_time, self.times, self.values)
            return values
        return np.stack([np.interp(slow_time, self.times, column) for column in self.values.T], axis=1)

    def plus(self, other: "Course") -> "Course":
        """Sum of this error and another, sampled at the union of their sample times."""
        times = np.union1d(self.times, other.times)
        return Course(times, self.at(times) + other.at(times))

    def smooth(self, order: int = SMOOTH_ORDER) -> "Course":
        """Slow part of the error, which displaces and defocuses a response: a polynomial fitted to the values."""
        scaled_time = 2 * (self.times - self.times[0]) / (self.times[-1] - self.times[0]) - 1
        fit = np.polynomial.legendre.legfit(scaled_time, self.values, order)
        return Course(self.times, np.polynomial.legendre.legval(scaled_time, fit).T)

    @property
    def mean(self) -> float:
        """Mean over time of the linearly interpolated values (n,)."""
        middles = (self.values[1:] + self.values[:-1]) / 2
        return float(middles @ np.diff(self.times) / (self.times[-1] - self.times[0]))


class PathError(NamedTuple):
    """Measured minus actual position of one platform, r̃(τ): a polynomial, and faster errors.

    The polynomial is equation (22) of Rigling & Moses. Its errors of position [m], velocity [m/s] and acceleration
    [m/s²] have the components east, north and up. The same applies to `course` [m], an error with an arbitrary time
    history. Noise, and vibrations for which no axis is given, are along the line of sight, positive away from the
    scene. The errors of position, velocity and acceleration apply at mid-aperture. For a platform in free fall, they
    are the initial errors of the measured orbit. For any other platform, they are the coefficients of a polynomial of
    time. `height` [m] is the error of the assumed scene height, positive if the scene is assumed too high. A height
    error raises the measured path of a platform; the path of a platform in orbit is not affected. `time_tag` [s] is
    the delay of the time tags: the measured position at a time τ is the true position at τ plus the delay.
    `wideband_rms` [m] is the rms position noise of the pulses, which is white, or limited to the band `wideband_band`
    (low, high) [Hz]. Simulating it requires a random generator.
    """

    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    acceleration: tuple[float, float, float] = (0.0, 0.0, 0.0)
    sinusoids: tuple[PathSinusoid, ...] = ()
    wideband_rms: float = 0.0
    wideband_band: tuple[float, float] | None = None
    course: Course | None = None
    time_tag: float = 0.0
    height: float = 0.0

    def slow(self) -> "PathError":
        """Return the same error with `course` replaced by its slow part, a polynomial of slow time.

        Vibration is unchanged.
        """
        return self if self.course is None else self._replace(course=self.course.smooth())

    def still(self) -> "PathError":
        """Return the same error without sinusoidal and wideband vibration."""
        return self._replace(sinusoids=(), wideband_rms=0.0)

    def plus(self, other: "PathError") -> "PathError":
        """Sum of this error and another. Vibration is left out."""
        position, velocity, acceleration = (
            (u[0] + v[0], u[1] + v[1], u[2] + v[2]) for u, v in zip(self[:3], other[:3], strict=True)
        )
        time_tag, height = self.time_tag + other.time_tag, self.height + other.height
        course = _sum(self.course, other.course)
        return PathError(position, velocity, acceleration, course=course, time_tag=time_tag, height=height)


class Errors(NamedTuple):
    """Errors that affect one image: path errors of both platforms, clock errors, and delays in the atmosphere.

    `clock` holds the clock error coefficients t̃₀ … t̃₃ of equation (1), in s, 1, 1/s and 1/s². `clock_course` [s] is
    a clock error with an arbitrary time history; it includes delays in the atmosphere that do not depend on
    frequency. `electrons` [s·Hz²] is the delay due to free electrons at a frequency of 1 Hz; at a frequency f, the
    delay is `electrons`/f². Free electrons delay the signal, but advance its phase.
    """

    transmitter: PathError = PathError()
    receiver: PathError = PathError()
    clock: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    clock_course: Course | None = None
    electrons: Course | None = None

    def of(self, platform: str, error: PathError) -> "Errors":
        """Return the same errors with the path error of `platform` replaced by `error`.

        `platform` is "transmitter" or "receiver".
        """
        return self._replace(transmitter=error) if platform == "transmitter" else self._replace(receiver=error)

    def smooth(self) -> "Errors":
        """Return the same errors without vibration, and with each `Course` replaced by its slow part."""
        return self.slow().still()

    def still(self) -> "Errors":
        """Return the same errors without the vibration of both platforms."""
        return self._replace(transmitter=self.transmitter.still(), receiver=self.receiver.still())

    def slow(self) -> "Errors":
        """Return the same errors with each `Course` replaced by its slow part. Vibration is unchanged.

        Fast noise would distort a phase that is computed from only a few slow times.
        """
        return self._replace(
            transmitter=self.transmitter.slow(),
            receiver=self.receiver.slow(),
            clock_course=self.clock_course and self.clock_course.smooth(),
            electrons=self.electrons and self.electrons.smooth(),
        )


def superposed(errors_of_sources: Iterable[Errors]) -> Errors:
    """Sum of several sets of errors of the same image. Vibration is left out."""
    total = Errors()
    for errors in errors_of_sources:
        total = Errors(
            transmitter=total.transmitter.plus(errors.transmitter),
            receiver=total.receiver.plus(errors.receiver),
            clock=tuple(a + b for a, b in zip(total.clock, errors.clock, strict=True)),
            clock_course=_sum(total.clock_course, errors.clock_course),
            electrons=_sum(total.electrons, errors.electrons),
        )
    return total


def _sum(course: Course | None, other: Course | None) -> Course | None:
    """Sum of two errors, each of which is a function of slow time.

    None counts as zero; the sum is None if both are None.
    """
    return course.plus(other) if course is not None and other is not None else course or other


@dataclass(frozen=True, kw_only=True, eq=False)
class Path:
    """Actual and measured positions of a platform at each pulse; both are (pulses, 3). [m]"""

    actual: Floats
    measured: Floats

    def seen_from(self, ground_point: GroundVector) -> "Path":
        """Return the same path with positions relative to a ground point, east and north. [m]"""
        offset = np.array([*ground_point, 0.0])
        return Path(actual=self.actual - offset, measured=self.measured - offset)


@dataclass(frozen=True, eq=False)
class Flight:
    """Paths of both platforms at given slow times, and the clock error and delay at these times.

    `clock` [s] is the clock error. `electrons` [s·Hz²] is the delay due to free electrons at a frequency of 1 Hz, or
    None if there is no such delay. `seen` [s] is the equivalent clock error, which has the same effect on an image as
    `clock` and the electrons together. All arrays have the shape (times,).
    """

    transmitter: Path
    receiver: Path
    clock: Floats
    seen: Floats
    electrons: Floats | None = None

    @property
    def paths(self) -> tuple[Path, Path]:
        """Paths of transmitter and receiver."""
        return self.transmitter, self.receiver

    def as_measured(self) -> "Flight":
        """Return the flight that the processor assumes: the measured paths and a perfect clock."""
        transmitter, receiver = (Path(actual=path.measured, measured=path.measured) for path in self.paths)
        return Flight(transmitter, receiver, np.zeros_like(self.clock), np.zeros_like(self.clock))

    def range_error(self, scatterer: GroundVector, seen_at: GroundVector) -> Floats:
        """Recorded range sum of `scatterer` minus the range sum of `seen_at` from the measured paths, (times,). [m]

        Both are ground points. The recorded range sum includes the clock error `seen`.
        """
        scatterer_position, seen_position = np.array([*scatterer, 0.0]), np.array([*seen_at, 0.0])
        total: Floats = np.zeros(self.clock.shape)
        for path in self.paths:
            total += np.linalg.norm(path.actual - scatterer_position, axis=1) - np.linalg.norm(
                path.measured - seen_position, axis=1
            )
        return total + SPEED_OF_LIGHT_MPS * self.seen

    def record(
        self,
        scatterers: Floats,
        amplitudes: Complexes,
        slow_time: Floats,
        frequency: Floats,
        **noise: Unpack[ReceiverNoise],
    ) -> "PhaseHistory":
        """Record the phase history of scatterers with the paths, clock error and delays of this flight.

        The arguments are the same as for `phase_history`. `slow_time` must hold the slow times of the flight.
        """
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
    """Received samples after motion compensation to the scene centre, and the measured paths.

    `samples` is (pulses, frequencies). `slow_time` [s] is the time of each pulse, and `frequency` [Hz] is the
    frequency of each sample. Backprojection and the polar format need evenly spaced frequencies. `transmitter` and
    `receiver` (pulses, 3) [m] are the measured positions.
    """

    samples: Complexes
    slow_time: Floats
    frequency: Floats
    transmitter: Floats
    receiver: Floats


def look_sum(transmitter: Floats, receiver: Floats) -> Floats:
    """Sum of the unit vectors from the scene centre to both platforms, as in equation (6), with shape (pulses, 3)."""
    total: Floats = np.zeros(transmitter.shape)
    for positions in (transmitter, receiver):
        total += positions / np.linalg.norm(positions, axis=1, keepdims=True)
    return total


def cell_centres(length: float, count: int) -> Floats:
    """Centres (count,) of `count` equal cells that divide an interval of a given length, centred at zero."""
    centres: Floats = np.linspace(-(length - length / count) / 2, (length - length / count) / 2, count)
    return centres


def is_even(frequency: Floats) -> bool:
    """Whether there are more than two frequencies and they are evenly spaced.

    Rounding errors of the frequencies are tolerated if their effect is negligible over kilometres of range.
    """
    return frequency.size > 2 and float(np.ptp(np.diff(frequency))) <= _FREQUENCY_ROUNDING_FRACTION * float(
        np.abs(frequency).max()
    )


def split(wavenumber: Floats) -> tuple[Floats, Floats]:
    """Find coarse and fine wavenumbers whose sums are the given, evenly spaced wavenumbers.

    In a table of all sums, with a row for each coarse wavenumber, the given wavenumbers appear in order; the last row
    may extend beyond them. The phasor of a sum is the product of two phasors, so n wavenumbers need only about 2√n
    exponentials.
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
    """Compute the actual positions of one platform, and the positions that are measured with an error.

    Parameters
    ----------
    state : PlatformState
        State of the platform at τ = 0, which determines its true path.
    slow_time : (pulses,) ndarray
        Slow times of the pulses. [s]
    error : PathError, optional
        Error of the measured path. None means that the path is measured without error.
    rng : numpy Generator, optional
        Random generator. It is required only for wideband vibration.
    way : (pulses, 3) ndarray, optional
        Displacement vector for each metre of noise, and of vibrations for which no axis is given [m/m]. If it is
        None, the unit vector along the line of sight is used.

    Returns
    -------
    Path
        Actual and measured positions.

    Raises
    ------
    ValueError
        The error contains wideband vibration, but there is no generator, or the pulses cannot sample any frequency of
        its band.
    """
    actual = _placed(state, slow_time)
    if error is None:
        return Path(actual=actual, measured=actual)
    measured = _placed(state, slow_time + error.time_tag) if error.time_tag else actual
    if state.fall is None or not any(map(any, error[:3])):
        # (22): p̃ + ṽτ + ãτ²/2
        tau = slow_time[:, None]
        measured = measured + np.asarray(error.position) + np.asarray(error.velocity) * tau
        measured = measured + np.asarray(error.acceleration) * tau**2 / 2
    else:
        measured = measured + orbit_error(state, error.position, error.velocity, error.acceleration, slow_time)
    if error.height:
        measured = measured + np.array((0.0, 0.0, error.height))
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
    """Positions (times, 3) of a platform on its path at given slow times. [m]"""
    return np.stack(np.broadcast_arrays(*state.place(slow_time)), axis=1)


def _noise(slow_time: Floats, band: tuple[float, float] | None, rng: np.random.Generator) -> Floats:
    """Gaussian noise of variance 1 at the slow times of the pulses, (pulses,).

    The noise is white if `band` is None, and otherwise limited to the band (low, high) [Hz]. A `ValueError` is raised
    if the pulses cannot sample any frequency of the band.
    """
    white: Floats = rng.normal(0.0, 1.0, slow_time.shape)
    if band is None:
        return white
    step = float(slow_time[1] - slow_time[0])
    frequency = np.fft.rfftfreq(slow_time.size, step)
    inside = (frequency >= band[0]) & (frequency <= band[1])
    # Each frequency is two bins of the full spectrum, except zero and, for an even number of pulses, the highest.
    bin_count = np.full(frequency.size, 2.0)
    bin_count[0] = 1.0
    bin_count[-1] = 2.0 if slow_time.size % 2 else 1.0
    weight = bin_count @ inside
    if not weight:
        raise ValueError(
            f"the band from {band[0]:g} to {band[1]:g} Hz holds no frequency of the pulses: they are "
            f"{frequency[1]:.3g} Hz apart, up to {frequency[-1]:.4g} Hz"
        )
    noise: Floats = np.fft.irfft(np.fft.rfft(white) * inside, slow_time.size)
    return noise * math.sqrt(slow_time.size / float(weight))


def direct_path_ways(geometry: BistaticGeometry, slow_time: Floats) -> tuple[Floats, Floats]:
    """Shortest displacement of each platform that changes the excess range by one metre. [m/m]

    The excess range is the bistatic range minus the baseline, which is the length of the direct path. There are two
    results, for transmitter and receiver, (pulses, 3) each. The displacement is along u_t − b for the transmitter,
    and along u_r + b for the receiver. Here u_t and u_r are the unit vectors from the scene centre to the platforms,
    and b is the unit vector from receiver to transmitter. The displacement is zero for a platform whose motion cannot
    change the excess range.
    """
    platforms = (
        PlatformState(position=platform.place(slow_time), velocity=platform.velocity) for platform in geometry.both
    )
    geometries = BistaticGeometry(**dict(zip(("transmitter", "receiver"), platforms, strict=True)))
    sights = (np.stack(sight, axis=1) for sight in geometries.sights(has_direct_path=True))
    squares = ((sight, np.sum(sight**2, axis=1, keepdims=True)) for sight in sights)
    transmitter, receiver = (
        np.where(square > _MIN_SIGHT_RATIO, sight / np.maximum(square, _MIN_SIGHT_RATIO), 0.0)
        for sight, square in squares
    )
    return transmitter, receiver


def direct_path_error(paths: tuple[Path, Path]) -> Floats:
    """Clock error of a receiver that uses the direct signal of the transmitter as its clock, (pulses,). [s]

    The receiver measures the delay of an echo relative to the direct signal, which arrives late by the actual
    distance between the platforms divided by c. The processor corrects for this delay with the measured distance. The
    clock error is therefore the measured minus the actual distance, divided by c.
    """
    transmitter, receiver = paths
    excess_range: Floats = np.linalg.norm(transmitter.measured - receiver.measured, axis=-1) - np.linalg.norm(
        transmitter.actual - receiver.actual, axis=-1
    )
    return excess_range / SPEED_OF_LIGHT_MPS


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
    """Simulate the samples that the receiver records, after motion compensation with the measured positions.

    Parameters
    ----------
    scatterers : (scatterers, 3) ndarray
        Positions of the scatterers. [m]
    amplitudes : (scatterers,) ndarray
        Complex reflection coefficients A_m of equation (3).
    slow_time : (pulses,) ndarray
        Slow times of the pulses. [s]
    frequency : (frequencies,) ndarray
        Frequencies of the samples. [Hz]
    transmitter, receiver : Path
        Actual and measured positions at the pulses.
    clock_error : (pulses,) ndarray or float
        Clock error t̃(τ) of equation (1). [s]
    electrons : (pulses,) ndarray, optional
        Delay due to free electrons at a frequency of 1 Hz, the same for every scatterer [s·Hz²]. None means no delay.
    noise_power : float
        Variance of the circular white Gaussian noise of a sample. A scatterer of amplitude 1 has a power of 1.
    rng : numpy Generator, optional
        Random generator. It is required only for noise.

    Returns
    -------
    PhaseHistory

    Raises
    ------
    ValueError
        There is noise but no generator, or the number of amplitudes is not the number of scatterers.
    """
    wavenumber = 2 * math.pi * frequency / SPEED_OF_LIGHT_MPS
    reference = np.linalg.norm(transmitter.measured, axis=1) + np.linalg.norm(receiver.measured, axis=1)
    clock = SPEED_OF_LIGHT_MPS * np.broadcast_to(np.asarray(clock_error, dtype=float), slow_time.shape)
    samples = np.zeros((slow_time.size, frequency.size), dtype=complex)
    scatterers, amplitudes = np.atleast_2d(scatterers), np.atleast_1d(amplitudes)
    if len(scatterers) != len(amplitudes):
        raise ValueError(f"{len(scatterers)} scatterers have {len(amplitudes)} amplitudes")
    # (3) with the frequency split into coarse and fine steps: e^{-j(k + q)R} is a product, and the sum over
    # scatterers is a product of matrices, so that n frequencies take 2√n exponentials.
    coarse, fine = split(wavenumber) if is_even(frequency) else (wavenumber, np.zeros(1))
    block_exponentials = max(1, _BLOCK_SAMPLES // (coarse.size + fine.size))
    block_scatterers = max(1, min(block_exponentials, len(scatterers)))
    block_pulses = max(1, min(block_exponentials // block_scatterers, _BLOCK_SAMPLES // (coarse.size * fine.size)))
    for begin in range(0, slow_time.size, block_pulses):
        pulse_block = slice(begin, begin + block_pulses)
        total: Complexes = np.zeros((slow_time[pulse_block].size, coarse.size, fine.size), dtype=complex)
        for start in range(0, len(scatterers), block_scatterers):
            scatterer_block = slice(start, start + block_scatterers)
            ranges = np.linalg.norm(transmitter.actual[pulse_block, None] - scatterers[scatterer_block], axis=-1)
            ranges += np.linalg.norm(receiver.actual[pulse_block, None] - scatterers[scatterer_block], axis=-1)
            ranges = ranges - reference[pulse_block, None] + clock[pulse_block, None]  # (1)
            by_coarse = np.exp(-1j * coarse[:, None] * ranges[:, None]) * amplitudes[scatterer_block]  # (2), (3)
            total += by_coarse @ np.exp(-1j * ranges[..., None] * fine)
        samples[pulse_block] = total.reshape(len(total), -1)[:, : wavenumber.size]
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
    """No ground point has the recorded range history, so the target does not appear in the image."""


def exact_effect(
    slow_time: Floats,
    transmitter: Path,
    receiver: Path,
    clock_error: Floats | float,
    radar: Radar,
    aperture_time_s: float,
) -> ExactEffect:
    """Compute from exact ranges the displacement and the remaining phases that path and clock errors cause.

    The target is at the origin of the frame of the paths. `slow_time` [s] may be unevenly spaced, but its middle
    element must be mid-aperture. The method is described in `ranges.exact_ranges`.

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
        [_columns(path.actual) for path in paths],
        [_columns(path.actual[slow_time.size // 2]) for path in paths],
    )
    clock = np.broadcast_to(SPEED_OF_LIGHT_MPS * np.asarray(clock_error, dtype=float), slow_time.shape)[:, None]
    shifts = [_columns(path.measured - path.actual) for path in paths]
    solution = followed(exact, clock, shifts, np.zeros(1, dtype=int))
    if not solution.is_settled[0]:
        raise NoGroundPointError("no ground point has the recorded range history")
    east, north, *phases = (float(values[0]) for values in solution[1:-1])
    return ExactEffect((east, north), *phases)


def _columns(positions: Floats) -> VectorArrays:
    """Components x, y and z of positions (..., 3), as three arrays with a last axis of length 1."""
    x, y, z = np.moveaxis(positions, -1, 0)[..., None]
    return x, y, z


def _sampling(nodes: Floats) -> Sampling:
    """Sampling of range histories at arbitrary slow times `nodes` (samples,), in units of half the aperture time.

    The weights that give the Legendre components of a history result from a polynomial fit to its samples.
    """
    legendre = np.polynomial.legendre.legvander(nodes, min(_FIT_ORDER, max(3, nodes.size // 4)))
    return Sampling(nodes, LEGENDRE_LEADING[:, None] * np.linalg.pinv(legendre)[:4])
