"""Time series of sensors, clocks and the air: what each may have done within one aperture, drawn moment by moment.

They share nothing with the formulas that they judge: walks are sums of steps, correlated noise follows its recursion,
phase noise is a sum of tones, and synchronisation joins samples of it by straight lines.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.effects.air_delays import CONTENT, DELAY, correlation_time_of, group_delay, legs_of
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.effects.navigation_errors import (
    CORRELATED,
    TILTS,
    acceleration_errors,
    arm_at,
    body_axes,
    process_axes,
    process_of,
    specific_force,
)
from bisar_budget.effects.oscillator_acceleration import (
    accelerated_tones,
    flies_a_turn,
    pieces_by_acceleration,
    turn_courses,
)
from bisar_budget.effects.oscillator_tones import LeftTone, spurs_of
from bisar_budget.effects.oscillators import noise_of, states_both_terms
from bisar_budget.effects.random_effect import RandomError, parts_of_largest
from bisar_budget.effects.random_errors import random_errors
from bisar_budget.effects.spectra import PowerLawPiece, density
from bisar_budget.effects.vibration import SLOWEST_ECHO_CYCLES, counted, pieces_of_vibration
from bisar_budget.geometry import PlatformState
from bisar_budget.mission.model import Mission, Simulation
from bisar_budget.mission.platforms import MotionError
from bisar_budget.mission.propagation import DELAYS
from bisar_budget.simulator.phase_history import Complexes, Course, Errors, Floats, PathError, PathSinusoid

_STEPS = 512  # from mid-aperture to the end of it, in which a walk is summed up
_SLOW_TONES = 80  # over logarithms, below a tone per two apertures
_SLOWEST = 1e-4  # of a tone per aperture; its quadratic phase is nothing
_PERIODS = 4  # apertures in which phase noise repeats
_AGES, _PER_AGE = 24, 8  # turns within the age of a setting that are followed, and tones for each
_TURNED = 256  # turns within an averaging, beyond which nothing of a tone is left in its line
_PER_CYCLE = 8  # samples of the fastest tone that is flown, joined by straight lines
_MAX_TONES = 1 << 18
_NARROW, _IN_NARROW = 4, 8  # tones at even distances below which a piece is narrow, and those it then has of its own
_NUMBERS = 1 << 20  # drawn at once
_FAR = 32  # apertures from which on an exchange knows nothing of a tone that turns in one
_FEWEST = 4  # exchanges in a period of tones: those on either side of an aperture are not the same
_MOST_KNOTS = 1 << 13  # exchanges in an aperture that are drawn
_FLOWN = 4097  # moments of a time series that is flown
_MOST_FLOWN = 1 << 19  # steps of phase noise, whose fastest tones would else be joined by straight lines


def position_courses(
    mission: Mission, error: RandomError, times: Floats, draws: int, rng: np.random.Generator
) -> dict[str, Floats]:
    """Position errors by one sensor, (draws, times, 3), east, north, up, of one sigma of what is declared. [m]

    They are by the name of the platform: of what both have in common the same draws, along the axes of each. The
    error is that of an inertial sensor, a lever arm, or of correlated noise, `declared` any size. Times (times,) are
    slow times within the aperture [s]. The mission says the sizes along each axis.
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
    """Motion of each platform by a unit of the largest axis."""
    kind, figure = error.subject.kind, error.subject.axis
    if kind in CORRELATED:
        process = process_of(mission, error)
        _, sizes = parts_of_largest(np.array(process.sigma))
        of_axis = [
            (axis, size * _correlated(process.correlation_time, times, draws, rng))
            for axis, size in enumerate(sizes)
            if size
        ]
        axes = process_axes(mission, error)
        return {name: [(drawn, of_platform[axis]) for axis, drawn in of_axis] for name, of_platform in axes.items()}
    state: PlatformState = getattr(mission.platforms, error.owner).state
    motion = _motion(mission, error.owner)
    lever, axes_now = motion.lever_arm, np.asarray(state.frame(motion.frame), float)
    if kind == "lever_arm" and figure == "uncertainty":
        stated = lever.uncertainty if lever is not None else None
        _, sizes = parts_of_largest(np.array(stated or (1.0, 1.0, 1.0)))
        body = np.moveaxis(body_axes(state, times), 1, 2)
        drawn = [size * rng.standard_normal((draws, 1)) * np.ones(times.size) for size in sizes]
        return {error.owner: list(zip(drawn, body, strict=True))}
    figure = "attitude" if kind == "lever_arm" else figure
    _, sizes = parts_of_largest(np.array(getattr(motion.imu, figure, None) or (1.0, 1.0, 1.0)))
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


def delay_courses(
    mission: Mission, error: RandomError, times: Floats, draws: int, rng: np.random.Generator
) -> Floats:
    """Group delays at the centre frequency, (draws, times), of one sigma of what is declared. [m]

    On one leg, or of one air the sum of both legs.
    """
    return group_delays(mission, error, times, zenith_delays(mission, error, times, draws, rng))


def zenith_delays(
    mission: Mission, error: RandomError, times: Floats, draws: int, rng: np.random.Generator
) -> Floats:
    """Delays at the zenith in sigmas of what is declared, (draws, times): one number each, or what changes."""
    correlation_time = correlation_time_of(mission, error.owner)
    if correlation_time is not None:
        return _correlated(correlation_time, times, draws, rng)
    return np.multiply.outer(rng.standard_normal(draws), np.ones(times.size))


def group_delays(mission: Mission, error: RandomError, times: Floats, at_zenith: Floats) -> Floats:
    """Group delays at the centre frequency by delays at the zenith in sigmas of the declared, (draws, times). [m]"""
    size = (error.declared or 0.0) / mission.allocation.coverage_factor
    of_unit = np.zeros(times.shape)
    for name in legs_of(error.owner):
        path: PlatformState = getattr(mission.geometry, name)
        of_unit = of_unit + group_delay(mission, path, error.subject.axis, times)
    return np.asarray(size * of_unit * at_zenith)


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
    steps = fast_steps(min(max(_FLOWN - 1, math.ceil(4 * _PER_CYCLE * half * fastest)), _MOST_FLOWN))
    moments: Floats = np.linspace(-half, half, steps + 1)
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
            is_clock = not error.subject.axis
            is_free = error.displaces_unknown or (is_clock and states_both_terms(mission))
            phase = phase + (drawn - Course(moments, drawn).smooth(1).values if is_free else drawn)
    transmitter, receiver = (
        PathError(course=Course(flown, moved[name]) if name in moved else None) for name in PLATFORMS
    )
    seconds = clock_seconds(phase, mission.radar.wavelength)
    if air[DELAY].any():
        seconds = seconds + np.interp(moments, times, air[DELAY]) / SPEED_OF_LIGHT
    clock = Course(moments, seconds) if seconds.any() else None
    electrons = electrons_at_1_hz(mission, times, air[CONTENT]) if air[CONTENT].any() else None
    return Errors(transmitter, receiver, clock_course=clock, electrons=electrons)


MOVING = ("imu", *CORRELATED, "lever_arm")  # kinds of error that move platforms
_Draw = Callable[[Floats, int, np.random.Generator], tuple[Floats, Floats]]


def _biased(order: int) -> _Draw:
    """Position error by a bias, and the tilt that goes with it: two integrals less."""

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


def _correlated(correlation_time: float, times: Floats, draws: int, rng: np.random.Generator) -> Floats:
    """First-order Gauss-Markov noise of variance 1, by its recursion from time to time."""
    found = rng.standard_normal((times.size, draws))
    for index, step in enumerate(np.diff(times).tolist(), 1):
        decay = math.exp(-step / correlation_time)
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

    Of an oscillator `declared` is a factor on its amplitude. Times are evenly spaced and divide the aperture. Tones
    above `highest` [Hz] may be left out, where no exchange of pulses folds them.
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
    bends = [bend.draw(rng) for _ in range(draws)] if bend is not None else []
    if interval is not None:
        # Pulses that follow each other faster take the phase away to nothing that an image shows.
        left = _between_exchanges(pieces, T, max(interval, T / _MOST_KNOTS), times, draws, rng, bends)
        for frequency, amplitude in _folded_tones(mission, error):
            start = rng.uniform(0, 2 * math.pi, (draws, 1))
            left += math.sqrt(2) * amplitude * np.cos(2 * math.pi * frequency * times + start)
        return size * left
    pieces = _below(pieces, highest)
    if sync is not None and sync.is_direct_path:
        if error.owner == "transmitter":  # both paths have its phase at one time
            return np.zeros((draws, times.size))
        return size * _Tones(pieces, T).at(times, draws, rng, later=float(mission.geometry.echo_delay))
    if sync is not None and sync.is_holdover and not error.subject.axis:
        setting = _Setting(pieces, T, sync.age or T, sync.averaging or T)
        slow = setting.tones.draw_slow(draws, rng)
        found = setting.tones.slow_at(times, slow) + setting.tones.fast_at(times, draws, rng)
        found -= setting.lines(slow, times, rng)
    else:
        found = _Tones(pieces, T).at(times, draws, rng)
    if bends:
        found += np.stack([bent(times) for bent in bends])
    return size * found


def _between_exchanges(
    pieces: tuple[PowerLawPiece, ...],
    aperture_time: float,
    interval: float,
    times: Floats,
    draws: int,
    rng: np.random.Generator,
    bends: Sequence[Callable[[Floats], Floats]] = (),
) -> Floats:
    """Phases without the straight lines between their values at exchanges of pulses, (draws, times). [rad]

    The tones repeat after a whole number of intervals, so that exchanges divide their period as evenly as moments do.
    For this the moments spread by less than the share that one of them has of the period.
    """
    step = min(interval, _FAR * aperture_time)
    parts = max(_FEWEST, math.ceil(_PERIODS * aperture_time / step))
    tones = _Tones(pieces, aperture_time, period=parts * step)
    middle, apart = (times[0] + times[-1]) / 2, float(times[-1] - times[0]) / (times.size - 1)
    count = round(tones.period / apart)
    moments: Floats = middle + (times - middle) * (tones.period / count / apart)
    slow = tones.draw_slow(draws, rng)
    found = tones.slow_at(moments, slow)
    for index in range(draws):
        knots = _knots(moments, interval, rng)
        sampled = tones.slow_at(knots, slow[:, index : index + 1])[0]
        if bends:
            found[index] += bends[index](moments)
            sampled += bends[index](knots)
        cosine, sine = rng.standard_normal((2, tones.fast_size.size)) * tones.fast_size
        fast: Complexes = cosine - 1j * sine
        found[index] += tones_at(fast, count)[: times.size]
        # Exchanges farther apart than that lie where the tones have begun again, which is as far for fast ones.
        fast *= _turned((knots[0] - moments[0]) / interval * step / tones.period, fast.size)
        sampled += np.resize(tones_at(fast, parts), knots.size)
        if tones.rest:  # of which two moments know nothing of each other
            found[index] += tones.rest * rng.standard_normal(times.size)
            sampled += tones.rest * rng.standard_normal(knots.size)
        found[index] -= np.interp(moments, knots, sampled)
    return found


def _below(pieces: tuple[PowerLawPiece, ...], highest: float) -> tuple[PowerLawPiece, ...]:
    """Pieces of a spectrum up to a frequency."""
    return tuple(piece._replace(high=min(piece.high, highest)) for piece in pieces if piece.low < highest)


def _above(pieces: tuple[PowerLawPiece, ...], lowest: float) -> tuple[PowerLawPiece, ...]:
    """Pieces of a spectrum from a frequency on."""
    return tuple(piece._replace(low=max(piece.low, lowest)) for piece in pieces if piece.high > lowest)


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
        PathSinusoid(
            metres * one.free * one.sensitivity * share,
            frequency,
            0.0 if one.in_quadrature is None or place else math.pi / 2,
        )
        for one in accelerated_tones(mission)
        for place, (frequency, share) in enumerate(zip(one.left.frequencies, one.left.shares, strict=True))
        if one.name == name
        and one.frequency * T >= SLOWEST_ECHO_CYCLES
        and frequency * T >= SLOWEST_ECHO_CYCLES
        and (share or not place)
    )


def _folded_tones(mission: Mission, error: RandomError) -> list[tuple[float, float]]:
    """Frequencies [Hz] and amplitudes, by a unit, of what of an oscillator's tones straight lines make slow.

    What they leave of a vibration that is slow itself is drawn as a whole.
    """
    T, name = mission.collection.aperture_time, error.owner
    tones: list[tuple[float, LeftTone]] = []
    if error.subject.axis == "acceleration":
        of_platform = [one for one in accelerated_tones(mission) if one.name == name]
        tones = [(one.free, one.left) for one in of_platform if one.frequency * T >= SLOWEST_ECHO_CYCLES]
    elif error.subject.kind == "oscillator":
        tones = [(spur.free, spur.left) for spur in spurs_of(mission) if spur.name == name]
    return [
        (frequency, free * share)
        for free, left in tones
        for frequency, share in zip(left.frequencies, left.shares, strict=True)
        if frequency * T < SLOWEST_ECHO_CYCLES and share
    ]


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
            (one.frequency, one.free if is_linked else one.free * one.left.shares[0])
            for one in accelerated_tones(mission)
            if one.name == name and one.frequency * T < SLOWEST_ECHO_CYCLES
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


def _slow_waves(frequency: Floats, times: Floats) -> tuple[Floats, Floats]:
    """Cosines and sines of tones at some times, (times, tones) each."""
    turn = 2 * math.pi * np.multiply.outer(times, frequency)
    return np.cos(turn), np.sin(turn)


def _turned(turns: float, count: int) -> Complexes:
    """Phasors of the tones 1 … `count`, of which the first turns so many times."""
    side = math.isqrt(count) + 1
    whole = np.exp(2j * math.pi * turns * np.arange(side + 1) * side)
    found: Complexes = np.multiply.outer(whole, np.exp(2j * math.pi * turns * np.arange(side))).ravel()
    return found[1 : count + 1]


def _folded(values: NDArray[Any], count: int) -> NDArray[Any]:
    """Sums of the tones 1, 2 … that are one at `count` moments of their period, (count,)."""
    found = np.zeros(-(-(values.size + 1) // count) * count, values.dtype)
    found[1 : values.size + 1] = values
    folded: NDArray[Any] = found.reshape(-1, count).sum(axis=0)
    return folded


def fast_steps(least: int) -> int:
    """At least so many steps, and at most a sixteenth more, of a number that a Fourier transform divides well."""
    unit = 1 << max(0, least.bit_length() - 5)
    return -(-least // unit) * unit


def tones_at(amplitudes: Complexes, count: int) -> Floats:
    """Sum of the tones 1, 2 … at `count` moments that divide their period evenly, (count,), from its beginning on."""
    found: Floats = np.fft.ifft(_folded(amplitudes, count), norm="forward").real
    return found


def powers_at(powers: Floats, count: int) -> Floats:
    """Powers of tones 0 … count / 2 that have at `count` moments the covariance of the tones 1, 2 … of random phase.

    A tone's phase at a moment is 2πkn/count: one of `count` turns more is the same there, and one of as many less a
    whole number of them turns the other way, which a random phase does not show. So their powers add.
    """
    folded = _folded(powers, count)
    found: Floats = folded[: count // 2 + 1].copy()
    found[1 : (count + 1) // 2] += folded[: count // 2 : -1]
    return found


class _Tones:
    """A spectrum as tones: those that turn within the aperture at even distances, the others by logarithms.

    A piece so narrow that few of the fast ones lie in it has tones of its own, which stand behind the slow ones. The
    fast ones repeat after a period [s]. What is faster still is another number at every moment, of the sigma `rest`.
    """

    def __init__(
        self,
        pieces: tuple[PowerLawPiece, ...],
        aperture_time: float,
        slow: Floats | None = None,
        period: float | None = None,
    ) -> None:
        self.period = _PERIODS * aperture_time if period is None else period
        high, fine = max((piece.high for piece in pieces), default=0.0), 1 / self.period
        narrow: list[PowerLawPiece] = []
        if slow is None:
            slow = np.geomspace(_SLOWEST / aperture_time, fine / 2, _SLOW_TONES + 1)
            narrow = [one for one in pieces if one.low >= fine / 2 and one.high - one.low < _NARROW * fine]
            pieces = tuple(one for one in pieces if one not in narrow)
        self.slow: Floats = (slow[1:] + slow[:-1]) / 2
        # Sigma of what a tone has of cosine, and of sine: √(S·Δf).
        self.slow_size: Floats = np.sqrt(density(pieces, self.slow) * (slow[1:] - slow[:-1]))
        self.count = self.slow.size
        for piece in narrow:
            width = (piece.high - piece.low) / _IN_NARROW
            own = piece.low + width * (np.arange(_IN_NARROW) + 0.5)
            self.slow = np.append(self.slow, own)
            self.slow_size = np.append(self.slow_size, np.sqrt(piece.at(own) * width))
        pieces = _above(pieces, float(slow[-1]))
        count = min(_MAX_TONES, max(1, math.ceil(high / fine)))
        self.fast: Floats = fine * np.arange(1.0, count + 1)
        self.fast_size: Floats = np.sqrt(density(pieces, self.fast) * fine)
        top = float(self.fast[-1]) + fine / 2
        beyond = [piece.integral(max(piece.low, top), piece.high) for piece in pieces if piece.high > top]
        self.rest = math.sqrt(math.fsum(beyond))

    def draw_slow(self, draws: int, rng: np.random.Generator) -> Floats:
        """Random sizes of cosine and sine of the slow tones, (2, draws, tones)."""
        found: Floats = rng.standard_normal((2, draws, self.slow.size)) * self.slow_size
        return found

    def slow_at(self, times: Floats, drawn: Floats) -> Floats:
        """Sums of the slow tones, and of those of narrow pieces, (draws, times). [rad]"""
        few = times if times.size <= _FLOWN else np.linspace(times[0], times[-1], _FLOWN)
        cosines, sines = _slow_waves(self.slow[: self.count], few)
        found: Floats = drawn[0, :, : self.count] @ cosines.T + drawn[1, :, : self.count] @ sines.T
        if few is not times:
            found = np.stack([np.interp(times, few, one) for one in found])
        for index in range(self.count, self.slow.size):
            turn = 2 * math.pi * self.slow[index] * times
            found += np.outer(drawn[0, :, index], np.cos(turn)) + np.outer(drawn[1, :, index], np.sin(turn))
        return found

    def fast_at(self, times: Floats, draws: int, rng: np.random.Generator, later: float | None = None) -> Floats:
        """Sums of the fast tones at times that divide their period evenly, (draws, times); see `at`. [rad]"""
        count = 2 * round(self.period * (times.size - 1) / float(times[-1] - times[0]) / 2)
        square, rest = np.square(self.fast_size), self.rest**2
        if later is not None:
            square, rest = square * (2 * np.sin(math.pi * self.fast * later)) ** 2, 2 * rest
        power = powers_at(square, count)
        power[1 : (count + 1) // 2] += 2 * rest / count
        power[:: count // 2] += rest / count
        size = np.sqrt(power) * count / 2
        size[:: count // 2] *= 2  # these two have no sine
        found, together = np.empty((draws, times.size)), max(1, _NUMBERS // count)
        for first in range(0, draws, together):
            some = min(together, draws - first)
            drawn = rng.standard_normal((some, size.size, 2)).view(complex)[..., 0] * size
            found[first : first + some] = np.fft.irfft(drawn, count)[:, : times.size]
        return found

    def at(self, times: Floats, draws: int, rng: np.random.Generator, later: float | None = None) -> Floats:
        """Sums of all tones at evenly spaced times, (draws, times), or their change until so much later [s]. [rad]"""
        slow = self.draw_slow(draws, rng)
        found = self.slow_at(times, slow)
        if later is not None:
            found = self.slow_at(times + later, slow) - found
        return found + self.fast_at(times, draws, rng, later)


class _Setting:
    """A clock that was set before the aperture, by a line fitted to its phase over the averaging.

    Slow tones are the same in the averaging and in the aperture. Of what is faster than a tone per eight apertures
    and has turned two dozen times within the age, the averaging has a draw of its own.
    """

    def __init__(self, pieces: tuple[PowerLawPiece, ...], aperture_time: float, age: float, averaging: float) -> None:
        self.age = age
        step, followed = 1 / (_PER_AGE * age), _AGES / age
        fast = max(followed, 1 / (2 * _PERIODS * aperture_time))
        edges = [np.geomspace(_SLOWEST / max(age, aperture_time), step, _SLOW_TONES + 1)]
        edges += [np.arange(step, followed, step), np.geomspace(followed, fast, _SLOW_TONES + 1)]
        self.tones = _Tones(pieces, aperture_time, np.unique(np.concatenate(edges)))
        count = 64 + math.ceil(16 * averaging * fast)
        self.window: Floats = ((np.arange(count) + 0.5) / count - 0.5) * averaging
        self.fit: Floats = np.linalg.pinv(np.stack((np.ones(count), self.window), axis=1)).astype(float)
        cosines, sines = _slow_waves(self.tones.slow, self.window - age)
        self.of_cosine, self.of_sine = self.fit @ cosines, self.fit @ sines
        own = _above(_below(pieces, _TURNED / averaging), fast)
        self.fast = _Tones(own, averaging) if own else None

    def lines(self, slow: Floats, times: Floats, rng: np.random.Generator) -> Floats:
        """The lines that were fitted, at other times, (draws, times); `slow` is what was drawn. [rad]"""
        lines = self.of_cosine @ slow[0].T + self.of_sine @ slow[1].T
        if self.fast is not None:
            lines += self.fit @ self.fast.at(self.window, slow.shape[1], rng).T
        found: Floats = lines[0][:, None] + np.multiply.outer(lines[1], times + self.age)
        return found


def clock_seconds(phase: Floats, wavelength_m: float) -> Floats:
    """Clock error that makes a phase at the centre frequency. [s]"""
    return phase * wavelength_m / (2 * math.pi * SPEED_OF_LIGHT)
