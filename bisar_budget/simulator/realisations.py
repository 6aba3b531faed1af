"""Time series of sensors, clocks and the air: what each may have done within one aperture, drawn moment by moment.

They share nothing with the formulas that they judge: walks are sums of steps, correlated noise follows its recursion,
phase noise is a sum of tones, and synchronisation joins samples of it by straight lines.
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.effects.air_delays import CONTENT, DELAY, group_delay
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.effects.lever_arms import arm_at, body_axes
from bisar_budget.effects.navigation_errors import TILTS, acceleration_errors, process_of, specific_force
from bisar_budget.effects.oscillator_acceleration import (
    accelerated_tones,
    flies_a_turn,
    pieces_by_acceleration,
    turn_courses,
)
from bisar_budget.effects.oscillators import noise_of
from bisar_budget.effects.random_effect import RandomError
from bisar_budget.effects.random_errors import random_errors
from bisar_budget.effects.spectra import PowerLawPiece, density
from bisar_budget.effects.vibration import SLOWEST, counted
from bisar_budget.effects.vibration_spectra import pieces_of_vibration
from bisar_budget.geometry import PlatformState
from bisar_budget.mission.instruments import GaussMarkov
from bisar_budget.mission.model import Mission, Simulation
from bisar_budget.mission.platforms import MotionError
from bisar_budget.mission.propagation import DELAYS
from bisar_budget.simulator.phase_history import Course, Errors, Floats, PathError, PathSinusoid

_STEPS = 512  # from mid-aperture to the end of it, in which a walk is summed up
_SLOW_TONES = 80  # over logarithms, below a tone per two apertures
_SLOWEST = 1e-4  # of a tone per aperture; its quadratic phase is nothing
_PERIODS = 4  # apertures in which phase noise repeats
_AGES, _PER_AGE = 24, 8  # turns within the age of a setting that are followed, and tones for each
_TURNED = 256  # turns within an averaging, beyond which nothing of a tone is left in its line
_PER_CYCLE = 8  # samples of the fastest tone, joined by straight lines
_MAX_TONES = 1 << 18
_MOST_KNOTS = 1 << 13  # exchanges in an aperture that are drawn
_FLOWN = 4097  # moments of a time series that is flown
_MOST_FLOWN = 1 << 19  # of phase noise, whose fastest tones would else be joined by straight lines


def position_courses(
    mission: Mission, error: RandomError, times: Floats, draws: int, rng: np.random.Generator
) -> dict[str, Floats]:
    """Position errors by one sensor, (draws, times, 3), east, north, up, of one sigma of what is declared. [m]

    They are by the name of the platform: of what both have in common the same draws, along the axes of each.

    Parameters
    ----------
    mission : Mission
        Says the sizes along each axis.
    error : RandomError
        Of an inertial sensor, a lever arm, or of correlated noise; `declared` may be any size.
    times : (times,) ndarray
        Slow time within the aperture. [s]
    draws : int
        How many.
    rng : numpy Generator
        Source of the draws.
    """
    size = (error.declared or 0.0) / mission.allocation.coverage_factor
    found = {}
    for name, parts in _drawn_parts(mission, error, times, draws, rng).items():
        total = np.zeros((draws, times.size, 3))
        for drawn, way in parts:
            total += size * drawn[:, :, None] * way
        found[name] = total
    return found


# What is drawn, (draws, times), and how it moves a platform, (3,) or (times, 3).
_Parts = list[tuple[Floats, Floats]]


def _drawn_parts(
    mission: Mission, error: RandomError, times: Floats, draws: int, rng: np.random.Generator
) -> dict[str, _Parts]:
    """What moves each platform, of a unit of the largest axis."""
    kind, figure = error.subject.kind, error.subject.axis
    if kind == "random":
        process = process_of(mission, error)
        sizes = _of_largest(process.sigma)
        of_axis = [(axis, size * _correlated(process, times, draws, rng)) for axis, size in enumerate(sizes) if size]
        common, names = mission.common_motion_error, [error.owner]
        if error.owner not in PLATFORMS and common is not None:
            names, frame = [*PLATFORMS], common.frame
        else:
            frame = _motion(mission, error.owner).frame
        axes = {name: np.array(getattr(mission.platforms, name).state.frame(frame)) for name in names}
        return {name: [(drawn, of_platform[axis]) for axis, drawn in of_axis] for name, of_platform in axes.items()}
    state: PlatformState = getattr(mission.platforms, error.owner).state
    motion = _motion(mission, error.owner)
    lever, axes_now = motion.lever_arm, np.asarray(state.frame(motion.frame), float)
    if kind == "lever_arm" and figure == "uncertainty":
        sizes = _of_largest(lever.uncertainty if lever is not None and lever.uncertainty else (1.0, 1.0, 1.0))
        body = np.moveaxis(body_axes(state, times), 1, 2)
        drawn = [size * rng.standard_normal((draws, 1)) * np.ones(times.size) for size in sizes]
        return {error.owner: list(zip(drawn, body, strict=True))}
    figure = "attitude" if kind == "lever_arm" else figure
    sizes = _of_largest(getattr(motion.imu, figure, None) or (1.0, 1.0, 1.0))
    pushes = acceleration_errors(figure, axes_now, np.array(specific_force(mission, state)))
    swings = None
    if lever is not None and lever.arm is not None and figure in TILTS:
        arm = arm_at(state, lever.arm, times)
        swings = np.cross(axes_now[:, None], arm.T[None])
    parts: _Parts = []
    for axis, size in enumerate(sizes):
        if not size:
            continue
        pushed, tilted = _INERTIAL[figure](times, draws, rng)
        if kind == "imu":
            parts.append((size * pushed, pushes[axis]))
        if swings is not None:
            parts.append((size * tilted, swings[axis]))
    return {error.owner: parts}


def _motion(mission: Mission, name: str) -> MotionError:
    found: MotionError = getattr(mission.platforms, name).motion_error
    return found


def _of_largest(values: Sequence[float]) -> Floats:
    """Sizes over the largest; 1 where there is none."""
    largest: Floats = np.array(values) / max(values) if max(values) else np.ones(3)
    return largest


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
    fastest = max((_fastest(mission, error) for error in analysis.random), default=0.0)
    count = min(max(_FLOWN, math.ceil(4 * _PER_CYCLE * half * fastest)), _MOST_FLOWN)
    moments: Floats = np.linspace(-half, half, count)
    flown = moments if any(error.subject.kind == "vibration" for error in analysis.random) else times
    moved: dict[str, Floats] = {}
    phase: Floats = np.zeros(moments.size)
    air = dict.fromkeys(DELAYS, np.zeros(times.size))
    for error in analysis.random:
        if not error.declared or error.counted_in or error.subject.kind == "other":  # known by its effect alone
            continue
        rng = np.random.default_rng([seed, *error.id.encode()])
        if error.subject.kind in MOVING:
            for name, drawn in position_courses(mission, error, times, 1, rng).items():
                moved[name] = moved.get(name, 0.0) + Course(times, factor * drawn[0]).at(flown)
        elif error.subject.kind == "propagation":
            (group,) = factor * delay_courses(mission, error, times, 1, rng)
            air[error.subject.axis] = air[error.subject.axis] + group
        elif error.subject.kind == "vibration":
            along = phase_courses(mission, error, moments, 1, rng)[0] * mission.radar.wavelength / (2 * math.pi)
            part = float(counted(mission, error.owner, 1.0, "islr"))
            places = np.array(getattr(mission.platforms, error.owner).state.place(moments))
            sight = places / np.linalg.norm(places, axis=0)
            shaken = (factor * along / part * sight).T if part else np.zeros((moments.size, 3))
            moved[error.owner] = moved.get(error.owner, 0.0) + shaken
        elif error.published.spread or error.published.quadratic or error.full.displacement > 0:
            drawn = factor * phase_courses(mission, error, moments, 1, rng)[0]
            is_set = error.full.displacement > 0
            phase = phase + (drawn if is_set else drawn - Course(moments, drawn).smooth(1).values)
    transmitter, receiver = (
        PathError(course=Course(flown, moved[name]) if name in moved else None) for name in PLATFORMS
    )
    seconds = clock_seconds(phase, mission.radar.wavelength)
    if air[DELAY].any():
        seconds = seconds + np.interp(moments, times, air[DELAY]) / SPEED_OF_LIGHT
    clock = Course(moments, seconds) if seconds.any() else None
    electrons = electrons_at_1_hz(mission, times, air[CONTENT]) if air[CONTENT].any() else None
    return Errors(transmitter, receiver, clock_course=clock, electrons=electrons)


MOVING = ("imu", "random", "lever_arm")  # kinds of error that move platforms
_Draw = Callable[[Floats, int, np.random.Generator], tuple[Floats, Floats]]


def _biased(order: int) -> _Draw:
    """What a bias makes of a position, and the tilt that goes with it: two integrals less."""

    def draw(times: Floats, draws: int, rng: np.random.Generator) -> tuple[Floats, Floats]:
        found: Floats = rng.standard_normal((draws, 1))
        return found * times**order / math.factorial(order), found * times ** (order - 2)

    return draw


def _walk(integrals: int) -> _Draw:
    """White noise, summed up so many times from mid-aperture on, and once; each side has a noise of its own."""

    def draw(times: Floats, draws: int, rng: np.random.Generator) -> tuple[Floats, Floats]:
        end = float(np.abs(times).max())
        step = end / _STEPS
        fine = np.linspace(0, end, _STEPS + 1)
        found, first = np.zeros((2, draws, times.size))
        for sign in (1, -1):
            side = np.zeros((draws, _STEPS + 1))
            np.cumsum(rng.standard_normal((draws, _STEPS)) * math.sqrt(step), axis=1, out=side[:, 1:])
            where = np.flatnonzero(sign * times > 0)
            at = np.abs(times[where]) / step
            low = np.minimum(at.astype(int), fine.size - 2)
            part = at - low
            first[:, where] = side[:, low] * (1 - part) + side[:, low + 1] * part
            for _ in range(integrals - 1):
                area = np.cumsum((side[:, 1:] + side[:, :-1]) * (step / 2), axis=1)
                side[:, 1:] = area
            found[:, where] = side[:, low] * (1 - part) + side[:, low + 1] * part
        return found, first

    return draw


def _correlated(process: GaussMarkov, times: Floats, draws: int, rng: np.random.Generator) -> Floats:
    """First-order Gauss-Markov noise of variance 1, by its recursion from time to time."""
    found = rng.standard_normal((times.size, draws))
    for index, step in enumerate(np.diff(times).tolist(), 1):
        decay = math.exp(-step / process.correlation_time)
        found[index] = decay * found[index - 1] + math.sqrt(1 - decay**2) * found[index]
    return found.T


# By figure: draws of a position error by a unit of acceleration, or of its rate or noise, and of the tilt itself.
_INERTIAL = {
    "accelerometer_bias": _biased(2),
    "accelerometer_scale_factor": _biased(2),
    "attitude": _biased(2),
    "gyro_bias": _biased(3),
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
    bend: _Bend | None = None
    if error.subject.kind == "vibration":
        pieces, sync = pieces_of_vibration(mission, error.owner), None
    elif error.subject.axis == "acceleration":
        pieces, bend = pieces_by_acceleration(mission, error.owner), _Bend(mission, error.owner)
        size /= mission.allocation.coverage_factor
    else:
        oscillator = getattr(mission.platforms, error.owner).oscillator
        pieces = noise_of(oscillator, mission.radar.center_frequency, T).pieces
    interval = None if sync is None else sync.interval
    if interval is None:
        pieces = _below(pieces, highest)
    if sync is not None and sync.is_direct_path:
        if error.owner == "transmitter":  # both paths have its phase at one time
            return np.zeros((draws, times.size))
        tones, later = _Tones(pieces, T), times + float(mission.geometry.echo_delay)
        waves_of = (tones.draw(rng) for _ in range(draws))
        heard_twice: Floats = size * np.stack([one.at(later) - one.at(times) for one in waves_of])
        return heard_twice
    is_set = sync is not None and sync.is_holdover and not error.subject.axis
    setting = _Setting(pieces, T, sync.age or T, sync.averaging or T) if sync is not None and is_set else None
    tones = _Tones(pieces, T) if setting is None else setting.tones
    waves = _slow_waves(tones.slow, times) if times.size <= _FLOWN else None
    found = np.empty((draws, times.size))
    for index in range(draws):
        drawn = tones.draw(rng)
        bent = bend.draw(rng) if bend is not None else None
        found[index] = drawn.at(times, waves)
        if bent is not None:
            found[index] += bent(times)
        if setting is not None:
            found[index] -= setting.line(drawn, times, rng)
        if interval is not None:
            # Pulses that follow each other faster take the phase away to nothing that an image shows.
            knots = _knots(times, max(interval, T / _MOST_KNOTS), rng)
            sampled = drawn.at(knots) + (0.0 if bent is None else bent(knots))
            found[index] -= np.interp(times, knots, sampled)
    return size * found


def _below(pieces: tuple[PowerLawPiece, ...], highest: float) -> tuple[PowerLawPiece, ...]:
    """Pieces of a spectrum up to a frequency."""
    return tuple(piece._replace(high=min(piece.high, highest)) for piece in pieces if piece.low < highest)


def _fastest(mission: Mission, error: RandomError) -> float:
    """Highest frequency of an error by a spectrum; 0 of other errors. [Hz]"""
    own = max((piece.high for piece in error.noise.pieces), default=0.0) if error.noise else 0.0
    return max(own, fastest_shake(mission, error))


def fastest_shake(mission: Mission, error: RandomError) -> float:
    """Highest frequency of a vibration by its spectrum, or of an oscillator's by it; 0 of other errors. [Hz]"""
    pieces: tuple[PowerLawPiece, ...] = ()
    if error.subject.kind == "vibration":
        pieces = pieces_of_vibration(mission, error.owner)
    elif error.subject.kind == "oscillator" and error.subject.axis == "acceleration":
        pieces = pieces_by_acceleration(mission, error.owner)
    return max((piece.high for piece in pieces), default=0.0)


def slowest_shake(mission: Mission, error: RandomError) -> float:
    """Lowest frequency likewise. [Hz]"""
    pieces = pieces_of_vibration if error.subject.kind == "vibration" else pieces_by_acceleration
    return min((piece.low for piece in pieces(mission, error.owner)), default=0.0)


def oscillator_sinusoids(mission: Mission, name: str) -> tuple[PathSinusoid, ...]:
    """Motions of a platform that make the phases of its oscillator's tones, from one cycle per aperture on.

    A quarter of a turn from the motion that makes them. Slower ones are drawn, see `phase_courses`.
    """
    metres, T = mission.radar.wavelength / (2 * math.pi), mission.collection.aperture_time
    return tuple(
        PathSinusoid(metres * one.phase, one.frequency, 0.0 if one.in_quadrature is None else math.pi / 2)
        for one in accelerated_tones(mission)
        if one.name == name and one.frequency * T >= SLOWEST
    )


class _Bend:
    """Phase of an oscillator by slow tones and by the turn of its platform, of a unit of sensitivity.

    Each direction of the sensitivity is as likely, and each phase of a tone; one sigma is the most that they do.
    """

    def __init__(self, mission: Mission, name: str) -> None:
        self.scale, T = 2 * math.pi * mission.radar.center_frequency, mission.collection.aperture_time
        self.state = getattr(mission.platforms, name).state
        self.turns = not mission.has_direct_path and flies_a_turn(mission, name)
        sync = mission.synchronization
        is_linked = sync is not None and sync.interval is not None  # what exchanges leave is drawn
        self.slow = [
            (one.frequency, one.free if is_linked else one.per_unit)
            for one in accelerated_tones(mission)
            if one.name == name and one.frequency * T < SLOWEST
        ]

    def draw(self, rng: np.random.Generator) -> Callable[[Floats], Floats]:
        """One of them: the phase at any times. [rad]"""
        direction, starts = rng.standard_normal(3), rng.uniform(0, 2 * math.pi, len(self.slow))

        def at(times: Floats) -> Floats:
            found = np.zeros(times.size)
            if self.turns:
                found += self.scale * direction @ turn_courses(self.state, times)
            for (frequency, phase), start in zip(self.slow, starts, strict=True):
                found += math.sqrt(2) * phase * np.cos(2 * math.pi * frequency * times + start)
            return found

        return at


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
        few = times if times.size <= _FLOWN else np.linspace(times[0], times[-1], _FLOWN)
        cosines, sines = waves or _slow_waves(self.frequency, few)
        slow = cosines @ self.cosine + sines @ self.sine
        found: Floats = (slow if few is times else np.interp(times, few, slow)) + self.fast.at(times)
        return found + self.rest * self.rng.standard_normal(times.size) if self.rest else found


def _slow_waves(frequency: Floats, times: Floats) -> tuple[Floats, Floats]:
    """Cosines and sines of tones at some times, (times, tones) each."""
    turn = 2 * math.pi * np.multiply.outer(times, frequency)
    return np.cos(turn), np.sin(turn)


class _Tones:
    """A spectrum as tones: those that turn within the aperture at even distances, the others by logarithms."""

    def __init__(self, pieces: tuple[PowerLawPiece, ...], aperture_time: float, slow: Floats | None = None) -> None:
        high, fine = max((piece.high for piece in pieces), default=0.0), 1 / (_PERIODS * aperture_time)
        if slow is None:
            slow = np.geomspace(_SLOWEST / aperture_time, fine / 2, _SLOW_TONES + 1)
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
        found: Floats = np.sqrt(density(pieces, frequency) * width)
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


class _Setting:
    """A clock that was set before the aperture, by a line fitted to its phase over the averaging.

    Slow tones are the same in the averaging and in the aperture. Of what is faster than a tone per eight apertures,
    and so often turned within the age, the averaging has a draw of its own.
    """

    def __init__(self, pieces: tuple[PowerLawPiece, ...], aperture_time: float, age: float, averaging: float) -> None:
        self.age = age
        step, fast = 1 / (_PER_AGE * age), 1 / (2 * _PERIODS * aperture_time)
        followed = min(_AGES * _PER_AGE * step, fast)
        edges = [np.geomspace(_SLOWEST / max(age, aperture_time), min(step, fast), _SLOW_TONES + 1)]
        edges += [np.arange(step, followed, step), np.geomspace(followed, fast, _SLOW_TONES + 1)]
        self.tones = _Tones(pieces, aperture_time, np.unique(np.concatenate(edges)))
        count = 64 + math.ceil(16 * averaging * fast)
        self.window: Floats = ((np.arange(count) + 0.5) / count - 0.5) * averaging
        self.fit: Floats = np.linalg.pinv(np.stack((np.ones(count), self.window), axis=1)).astype(float)
        cosines, sines = _slow_waves(self.tones.slow, self.window - age)
        self.of_cosine, self.of_sine = self.fit @ cosines, self.fit @ sines
        own = tuple(piece._replace(low=max(piece.low, fast)) for piece in _below(pieces, _TURNED / averaging))
        own = tuple(piece for piece in own if piece.low < piece.high)
        self.fast = _Tones(own, averaging) if own else None

    def line(self, drawn: _Drawn, times: Floats, rng: np.random.Generator) -> Floats:
        """The line that was fitted, at other times, (times,). [rad]"""
        value, slope = self.of_cosine @ drawn.cosine + self.of_sine @ drawn.sine
        if self.fast is not None:
            own_value, own_slope = self.fit @ self.fast.draw(rng).at(self.window)
            value, slope = value + own_value, slope + own_slope
        found: Floats = value + slope * (times + self.age)
        return found


def clock_seconds(phase: Floats, wavelength_m: float) -> Floats:
    """Clock error that makes a phase at the centre frequency. [s]"""
    return phase * wavelength_m / (2 * math.pi * SPEED_OF_LIGHT)
