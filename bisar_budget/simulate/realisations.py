"""Time series of sensors, clocks and the air: what each may have done within one aperture, drawn moment by moment.

They share nothing with the formulas that they judge: walks are sums of steps, correlated noise follows its recursion,
phase noise is a sum of tones, and synchronisation joins samples of it by straight lines.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.effects.air_delays import CONTENT, DELAY, group_delay
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.effects.navigation_errors import acceleration_errors, process_of, specific_force
from bisar_budget.effects.oscillators import noise_of
from bisar_budget.effects.random_effect import RandomError
from bisar_budget.effects.random_errors import random_errors
from bisar_budget.effects.spectra import PowerLawPiece
from bisar_budget.geometry import PlatformState
from bisar_budget.mission.instruments import GaussMarkov
from bisar_budget.mission.model import Mission, Simulation
from bisar_budget.mission.propagation import DELAYS
from bisar_budget.simulate.phase_history import Course, Errors, Floats, PathError

_STEPS = 512  # from mid-aperture to the end of it, in which a walk is summed up
_SLOW_TONES = 80  # over logarithms, below a tone per two apertures
_SLOWEST = 1e-4  # of a tone per aperture; its quadratic phase is nothing
_PERIODS = 4  # apertures in which phase noise repeats
_PER_CYCLE = 4  # samples of the fastest tone, joined by straight lines
_MAX_TONES = 1 << 18
_MOST_KNOTS = 1 << 13  # exchanges in an aperture that are drawn
_FLOWN = 4097  # moments of a time series that is flown


def position_courses(
    mission: Mission, error: RandomError, times: Floats, draws: int, rng: np.random.Generator
) -> Floats:
    """Position errors by one sensor, (draws, times, 3), east, north, up, of one sigma of what is declared. [m]

    Parameters
    ----------
    mission : Mission
        Says the sizes along each axis.
    error : RandomError
        Of an inertial sensor, or of correlated noise; `declared` may be any size.
    times : (times,) ndarray
        Slow time within the aperture. [s]
    draws : int
        How many.
    rng : numpy Generator
        Source of the draws.
    """
    platform = getattr(mission.platforms, error.owner)
    motion, kind = platform.motion_error, error.subject.axis
    factor = mission.allocation.coverage_factor
    axes = np.array(platform.state.frame(motion.frame))
    process = process_of(mission, error) if error.subject.kind == "random" else None
    values = process.sigma if process is not None else getattr(motion.imu, kind) or (1.0, 1.0, 1.0)
    sizes = np.array(values) / max(values) if max(values) else np.ones(3)
    sizes = sizes * (error.declared or 0.0) / factor
    if process is None:
        axes = acceleration_errors(kind, axes, np.array(specific_force(mission, platform.state)))
    draw = _correlated(process) if process is not None else _INERTIAL[kind]
    total = np.zeros((draws, times.size, 3))
    for axis, size in zip(axes, sizes, strict=True):
        if size:
            total += size * draw(times, draws, rng)[:, :, None] * axis
    return total


def delay_courses(
    mission: Mission, error: RandomError, times: Floats, draws: int, rng: np.random.Generator
) -> Floats:
    """Group delays on one leg at the centre frequency, (draws, times), of one sigma of what is declared. [m]

    Parameters are those of `position_courses`. What is above the scene stays as it is within an aperture.
    """
    size = (error.declared or 0.0) / mission.allocation.coverage_factor
    path: PlatformState = getattr(mission.geometry, error.owner)
    of_unit = np.broadcast_to(group_delay(mission, path, error.subject.axis, times), times.shape)
    found: Floats = np.multiply.outer(size * rng.standard_normal(draws), of_unit)
    return found


def electrons_at_1_hz(mission: Mission, times: Floats, group: Floats) -> Course:
    """Group delays at the centre frequency by free electrons, (times,) [m], as a history of `Errors`. [s·Hz²]"""
    return Course(times, group / SPEED_OF_LIGHT * mission.radar.center_frequency**2)


def has_unset_clocks(mission: Mission) -> bool:
    """Whether oscillators are flown without mean and slope: the file does not say how they are set."""
    return any(error.displaces_unknown for error in random_errors(mission))


def drawn_errors(analysis: Analysis) -> Errors:
    """One time series of each declared error of sensors, clocks and the air, with the coverage factor, by the seed.

    A clock is flown as it is set. What setting leaves, `timing_error` has, so that an oscillator beside it is flown
    without mean and slope; and so is a free one of which the file does not say how it is set.
    """
    mission = analysis.mission
    seed, factor = (mission.simulation or Simulation()).seed, mission.allocation.coverage_factor
    half = mission.collection.aperture_time / 2
    times: Floats = np.linspace(-half, half, _FLOWN)
    moved: dict[str, Floats] = {}
    phase: Floats = np.zeros(times.size)
    air = dict.fromkeys(DELAYS, np.zeros(times.size))
    for error in analysis.random:
        if not error.declared:
            continue
        rng = np.random.default_rng([seed, *error.id.encode()])
        if error.subject.kind in ("imu", "random"):
            drawn = factor * position_courses(mission, error, times, 1, rng)[0]
            moved[error.owner] = moved.get(error.owner, 0.0) + drawn
        elif error.subject.kind == "propagation":
            (group,) = factor * delay_courses(mission, error, times, 1, rng)
            air[error.subject.axis] = air[error.subject.axis] + group
        elif error.published.spread:
            drawn = factor * phase_courses(mission, error, times, 1, rng)[0]
            phase = phase + (drawn if error.full.displacement > 0 else drawn - Course(times, drawn).smooth(1).values)
    transmitter, receiver = (
        PathError(course=Course(times, moved[name]) if name in moved else None) for name in PLATFORMS
    )
    seconds = clock_seconds(phase, mission.radar.wavelength) + air[DELAY] / SPEED_OF_LIGHT
    clock = Course(times, seconds) if seconds.any() else None
    electrons = electrons_at_1_hz(mission, times, air[CONTENT]) if air[CONTENT].any() else None
    return Errors(transmitter, receiver, clock_course=clock, electrons=electrons)


def _bias(order: int) -> Callable[[Floats, int, np.random.Generator], Floats]:
    def draw(times: Floats, draws: int, rng: np.random.Generator) -> Floats:
        found: Floats = rng.standard_normal((draws, 1)) * times**order / math.factorial(order)
        return found

    return draw


def _walk(integrals: int) -> Callable[[Floats, int, np.random.Generator], Floats]:
    """White noise, summed up so many times from mid-aperture on; each side has a noise of its own."""

    def draw(times: Floats, draws: int, rng: np.random.Generator) -> Floats:
        end = float(np.abs(times).max())
        step = end / _STEPS
        fine = np.linspace(0, end, _STEPS + 1)
        found = np.zeros((draws, times.size))
        for sign in (1, -1):
            side = np.zeros((draws, _STEPS + 1))
            np.cumsum(rng.standard_normal((draws, _STEPS)) * math.sqrt(step), axis=1, out=side[:, 1:])
            for _ in range(integrals - 1):
                area = np.cumsum((side[:, 1:] + side[:, :-1]) * (step / 2), axis=1)
                side[:, 1:] = area
            where = np.flatnonzero(sign * times > 0)
            at = np.abs(times[where]) / step
            low = np.minimum(at.astype(int), fine.size - 2)
            part = at - low
            found[:, where] = side[:, low] * (1 - part) + side[:, low + 1] * part
        return found

    return draw


def _correlated(process: GaussMarkov) -> Callable[[Floats, int, np.random.Generator], Floats]:
    """First-order Gauss-Markov noise of variance 1, by its recursion from time to time."""

    def draw(times: Floats, draws: int, rng: np.random.Generator) -> Floats:
        found = rng.standard_normal((times.size, draws))
        for index, step in enumerate(np.diff(times).tolist(), 1):
            decay = math.exp(-step / process.correlation_time)
            found[index] = decay * found[index - 1] + math.sqrt(1 - decay**2) * found[index]
        return found.T

    return draw


_INERTIAL = {
    "accelerometer_bias": _bias(2),
    "accelerometer_scale_factor": _bias(2),
    "attitude": _bias(2),
    "gyro_bias": _bias(3),
    "velocity_random_walk": _walk(2),
    "angle_random_walk": _walk(3),
}


def phase_courses(
    mission: Mission,
    error: RandomError,
    times: Floats,
    draws: int,
    rng: np.random.Generator,
    highest: float = math.inf,
) -> Floats:
    """Phases of one oscillator, or of the link, at the centre frequency, (draws, times), of one sigma. [rad]

    Parameters are those of `position_courses`; of an oscillator `declared` is a factor on its amplitude. Tones above
    `highest` [Hz] may be left out, where no exchange of pulses folds them.
    """
    sync, T = mission.synchronization, mission.collection.aperture_time
    size = error.declared or 0.0
    if error.subject.kind == "synchronization":
        size /= mission.allocation.coverage_factor
        if sync is None or sync.interval is None:
            white: Floats = size * rng.standard_normal((draws, times.size))
            return white
        joined, drawn_at = [], max(sync.interval, T / _MOST_KNOTS)
        for _ in range(draws):
            knots = _knots(times, drawn_at, rng)
            joined.append(np.interp(times, knots, rng.standard_normal(knots.size)))
        # More exchanges than are drawn: of the same spectrum where it is flat.
        return size * math.sqrt(sync.interval / drawn_at) * np.stack(joined)
    oscillator = getattr(mission.platforms, error.owner).oscillator
    pieces = noise_of(oscillator, mission.radar.center_frequency, T).pieces
    if sync is None:
        pieces = tuple(piece._replace(high=min(piece.high, highest)) for piece in pieces if piece.low < highest)
    tones = _Tones(pieces, T)
    waves = _slow_waves(tones.slow, times)
    interval = sync.interval if sync is not None and sync.method == "linear" else None
    found = np.empty((draws, times.size))
    for index in range(draws):
        drawn = tones.draw(rng)
        found[index] = drawn.at(times, waves)
        if interval is not None:
            # Pulses that follow each other faster take the phase away to nothing that an image shows.
            knots = _knots(times, max(interval, T / _MOST_KNOTS), rng)
            found[index] -= np.interp(times, knots, drawn.at(knots))
    return size * found


def _knots(times: Floats, interval: float, rng: np.random.Generator) -> Floats:
    """When pulses are exchanged: from before the first time to behind the last, beginning anywhere in an interval."""
    start = float(times.min()) - interval * float(rng.random())
    knots: Floats = np.arange(start, float(times.max()) + interval, interval)
    return knots


class _Drawn(NamedTuple):
    """One draw of a spectrum: slow tones, (n,) each, and the fast ones over a time in which they repeat.

    What is faster still is another number at every moment, of the sigma `rest`.
    """

    frequency: Floats
    cosine: Floats
    sine: Floats
    fast: Course
    rest: float
    rng: np.random.Generator

    def at(self, times: Floats, waves: tuple[Floats, Floats] | None = None) -> Floats:
        """Sum of the tones; `waves` are those of the slow ones at these times, where they are known. [rad]"""
        cosines, sines = waves or _slow_waves(self.frequency, times)
        found: Floats = cosines @ self.cosine + sines @ self.sine + self.fast.at(times)
        return found + self.rest * self.rng.standard_normal(times.size) if self.rest else found


def _slow_waves(frequency: Floats, times: Floats) -> tuple[Floats, Floats]:
    """Cosines and sines of tones at some times, (times, tones) each."""
    turn = 2 * math.pi * np.multiply.outer(times, frequency)
    return np.cos(turn), np.sin(turn)


class _Tones:
    """A spectrum as tones: those that turn within the aperture at even distances, the others by logarithms."""

    def __init__(self, pieces: tuple[PowerLawPiece, ...], aperture_time: float) -> None:
        high, fine = max(piece.high for piece in pieces), 1 / (_PERIODS * aperture_time)
        slow: Floats = np.geomspace(_SLOWEST / aperture_time, fine / 2, _SLOW_TONES + 1)
        self.slow: Floats = (slow[1:] + slow[:-1]) / 2
        widths: Floats = slow[1:] - slow[:-1]
        self.slow_size = self._size(pieces, self.slow, widths)
        count = min(_MAX_TONES, max(1, math.ceil(high / fine)))
        fast: Floats = fine * np.arange(1.0, count + 1)
        self.fast_size = self._size(pieces, fast, np.full(count, fine))
        top = float(fast[-1]) + fine / 2
        beyond = [piece.integral(max(piece.low, top), piece.high) for piece in pieces if piece.high > top]
        self.rest = math.sqrt(math.fsum(beyond))
        samples = 1 << (2 * _PER_CYCLE * count - 1).bit_length() - 1
        self.times: Floats = (np.arange(samples + 1) / samples - 0.5) / fine

    @staticmethod
    def _size(pieces: tuple[PowerLawPiece, ...], frequency: Floats, width: Floats) -> Floats:
        """Sigma of what a tone has of cosine, and of sine: √(S·Δf)."""
        density = np.zeros(frequency.size)
        for piece in pieces:
            inside = (frequency >= piece.low) & (frequency < piece.high)
            density[inside] += piece.density * frequency[inside] ** -piece.slope
        found: Floats = np.sqrt(density * width)
        return found

    def draw(self, rng: np.random.Generator) -> _Drawn:
        """Random sizes of cosine and sine."""
        cosine, sine = rng.standard_normal((2, self.slow.size)) * self.slow_size
        samples = self.times.size - 1
        spectrum = np.zeros(samples // 2 + 1, dtype=complex)
        both = rng.standard_normal((2, self.fast_size.size)) * self.fast_size
        spectrum[1 : both.shape[1] + 1] = (both[0] - 1j * both[1]) * samples / 2
        fast = np.fft.irfft(spectrum, samples)
        return _Drawn(self.slow, cosine, sine, Course(self.times, np.append(fast, fast[0])), self.rest, rng)


def clock_seconds(phase: Floats, wavelength_m: float) -> Floats:
    """Clock error that makes a phase at the centre frequency. [s]"""
    return phase * wavelength_m / (2 * math.pi * SPEED_OF_LIGHT)
