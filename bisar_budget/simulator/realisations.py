"""Random time series of the errors of sensors, clocks and the atmosphere within one aperture.

The time series check the formulas of the budget and do not use them. Random walks are sums of steps. Correlated noise
is computed by its recursion. Phase noise is a sum of tones. Synchronisation subtracts the straight lines between
samples of the phase noise.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.effects.air_delays import CONTENT, DELAY, correlation_time_of, group_delay, legs_of
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.effects.navigation_errors import (
    INERTIAL_FIGURES,
    InertialFigure,
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
from bisar_budget.effects.oscillators import noise_in_case, states_both_terms
from bisar_budget.effects.random_effect import RandomError, parts_of_largest
from bisar_budget.effects.random_errors import random_errors
from bisar_budget.effects.spectra import PowerLawPiece, density
from bisar_budget.effects.vibration import SLOWEST_ECHO_CYCLES, counted, pieces_of_vibration
from bisar_budget.geometry import PlatformState
from bisar_budget.mission.model import Mission, Simulation
from bisar_budget.mission.platforms import MotionError
from bisar_budget.mission.propagation import DELAYS
from bisar_budget.simulator.phase_history import Complexes, Course, Errors, Floats, PathError, PathSinusoid

_WALK_STEPS = 512  # steps of a random walk from mid-aperture to the end of the aperture
_SLOW_TONES_COUNT = 80  # tones at logarithmic steps, below one cycle per two apertures
_MIN_CYCLES_PER_APERTURE = 1e-4  # of the slowest tone; the quadratic phase of slower tones is negligible
_PERIOD_FACTOR = 4  # ratio of the period of the phase noise to the aperture time
_AGE_CYCLES, _TONES_PER_AGE_CYCLE = 24, 8  # tones up to this many cycles in a setting's age are common to both
_MAX_AVERAGING_CYCLES = 256  # of a tone within the averaging time; faster tones do not change the fitted line
_SAMPLES_PER_CYCLE = 8  # of the fastest simulated tone; samples are interpolated linearly
_MAX_TONES_COUNT = 1 << 18
_NARROW_COUNT, _TONES_PER_NARROW_PIECE = 4, 8  # a piece with fewer evenly spaced tones is narrow
_BLOCK_COUNT = 1 << 20  # random numbers drawn at once
_FAR_FACTOR = 32  # exchange interval in apertures; tones are independent at longer ones
_MIN_EXCHANGES_COUNT = 4  # in a period of the tones, so that the exchanges before and after an aperture differ
_MAX_EXCHANGES_COUNT = 1 << 13  # largest number that is drawn in an aperture
_COURSE_SAMPLES = 4097  # samples of a simulated time series
_MAX_FLOWN_STEPS = 1 << 19  # of phase noise; beyond, fast tones are interpolated linearly


def position_courses(
    mission: Mission, error: RandomError, times: Floats, draws: int, rng: np.random.Generator
) -> dict[str, Floats]:
    """Random position errors that one sensor causes, for one sigma of the declared size.

    The keys are the names of the platforms. The values are (draws, times, 3): east, north, up. [m] The error is an
    error of an inertial sensor or of a lever arm, or correlated noise. If it is common to both platforms, both use
    the same random numbers along their axes. `declared` only scales the result: the ratios between the axes are those
    of the mission. `times` (times,) are slow times within the aperture. [s]
    """
    size = (error.declared or 0.0) / mission.allocation.coverage_factor
    courses = {}
    for name, motions in _drawn_motions(mission, error, times, draws, rng).items():
        total = np.zeros((draws, times.size, 3))
        for series, direction in motions:
            total += size * series[:, :, None] * direction
        courses[name] = total
    return courses


# Pairs of a random series, (draws, times), and the motion of a platform per unit of it, (3,) or (times, 3).
_Motions = list[tuple[Floats, Floats]]


def _drawn_motions(
    mission: Mission, error: RandomError, times: Floats, draws: int, rng: np.random.Generator
) -> dict[str, _Motions]:
    """Random series and directions of the motion of each platform, for a unit error along its largest axis."""
    return error.kind.find_in(_MOTION_DRAWS, error.subject.axis)(mission, error, times, draws, rng)


def _noise_motions(
    mission: Mission, error: RandomError, times: Floats, draws: int, rng: np.random.Generator
) -> dict[str, _Motions]:
    """Motion by correlated noise of a position. Platforms that share the noise have the same random series."""
    process = process_of(mission, error)
    _, sizes = parts_of_largest(np.array(process.sigma))
    of_axis = [
        (axis, size * _correlated(process.correlation_time, times, draws, rng))
        for axis, size in enumerate(sizes)
        if size
    ]
    axes = process_axes(mission, error)
    return {name: [(drawn, of_platform[axis]) for axis, drawn in of_axis] for name, of_platform in axes.items()}


def _sensor_motions(
    mission: Mission, error: RandomError, times: Floats, draws: int, rng: np.random.Generator
) -> dict[str, _Motions]:
    """Motion by an inertial sensor: through the measured acceleration, and through the lever arm if one is stated."""
    figure, motion = INERTIAL_FIGURES[error.subject.axis], _motion(mission, error.owner)
    state: PlatformState = getattr(mission.platforms, error.owner).state
    pushes = acceleration_errors(
        figure, np.asarray(state.frame(motion.frame), float), np.array(specific_force(mission, state))
    )
    swings = _swings(mission, error.owner, times) if figure.tilts else None
    motions: _Motions = []
    for axis, pushed, tilted in _drawn_by_axis(motion, figure, times, draws, rng):
        motions.append((pushed, pushes[axis]))
        if swings is not None:
            motions.append((tilted, swings[axis]))
    return {error.owner: motions}


def _swing_motions(
    mission: Mission, error: RandomError, times: Floats, draws: int, rng: np.random.Generator
) -> dict[str, _Motions]:
    """Motion by an attitude error through the lever arm alone."""
    motion, swings = _motion(mission, error.owner), _swings(mission, error.owner, times)
    assert swings is not None
    drawn = _drawn_by_axis(motion, INERTIAL_FIGURES["attitude"], times, draws, rng)
    return {error.owner: [(tilted, swings[axis]) for axis, _, tilted in drawn]}


def _arm_motions(
    mission: Mission, error: RandomError, times: Floats, draws: int, rng: np.random.Generator
) -> dict[str, _Motions]:
    """Motion by an error of the lever arm itself, which turns with the body."""
    lever = _motion(mission, error.owner).lever_arm
    uncertainty = lever.uncertainty if lever is not None else None
    _, sizes = parts_of_largest(np.array(uncertainty or (1.0, 1.0, 1.0)))
    body = np.moveaxis(body_axes(getattr(mission.platforms, error.owner).state, times), 1, 2)
    drawn = [size * rng.standard_normal((draws, 1)) * np.ones(times.size) for size in sizes]
    return {error.owner: list(zip(drawn, body, strict=True))}


# Functions that draw the motion of platforms, by kind of error.
_MOTION_DRAWS: Mapping[
    str, Callable[[Mission, RandomError, Floats, int, np.random.Generator], dict[str, _Motions]]
] = {
    "imu": _sensor_motions,
    "lever_arm.attitude": _swing_motions,
    "lever_arm.uncertainty": _arm_motions,
    "random": _noise_motions,
    "trajectory": _noise_motions,
}


def _drawn_by_axis(
    motion: MotionError, figure: InertialFigure, times: Floats, draws: int, rng: np.random.Generator
) -> Iterator[tuple[int, Floats, Floats]]:
    """Draw the errors of a sensor along each axis, for one unit of the figure along its largest axis.

    Yields the index of the axis, the position error per unit of acceleration, and the tilt, (draws, times) each.
    """
    _, sizes = parts_of_largest(np.array(getattr(motion.imu, figure.name, None) or (1.0, 1.0, 1.0)))
    for axis, size in enumerate(sizes):
        if size:
            pushed, tilted = _INERTIAL_DRAWS[figure.name](times, draws, rng)
            yield axis, size * pushed, size * tilted


def _swings(mission: Mission, name: str, times: Floats) -> Floats | None:
    """Motion of the antenna per unit of tilt about each axis, (axes, times, 3); None without a lever arm. [m/rad]"""
    motion, state = _motion(mission, name), getattr(mission.platforms, name).state
    if motion.lever_arm is None or motion.lever_arm.arm is None:
        return None
    arm, axes = arm_at(state, motion.lever_arm.arm, times), np.asarray(state.frame(motion.frame), float)
    return np.cross(axes[:, None], arm.T[None])


def _motion(mission: Mission, name: str) -> MotionError:
    motion_error: MotionError = getattr(mission.platforms, name).motion_error
    return motion_error


def delay_courses(
    mission: Mission, error: RandomError, times: Floats, draws: int, rng: np.random.Generator
) -> Floats:
    """Random group delays at the centre frequency, (draws, times), for one sigma of the declared size. [m]

    The delay is that of one leg, or the sum of both legs if both have the same atmosphere.
    """
    return group_delays(mission, error, times, zenith_delays(mission, error, times, draws, rng))


def zenith_delays(
    mission: Mission, error: RandomError, times: Floats, draws: int, rng: np.random.Generator
) -> Floats:
    """Random zenith delays in units of the declared sigma, (draws, times): constant, or correlated over time."""
    correlation_time = correlation_time_of(mission, error.owner)
    if correlation_time is not None:
        return _correlated(float(correlation_time), times, draws, rng)
    return np.multiply.outer(rng.standard_normal(draws), np.ones(times.size))


def group_delays(mission: Mission, error: RandomError, times: Floats, at_zenith: Floats) -> Floats:
    """Group delays at the centre frequency, (draws, times). [m]

    They are computed from `at_zenith`, the zenith delays in units of the declared sigma.
    """
    size = (error.declared or 0.0) / mission.allocation.coverage_factor
    of_unit = np.zeros(times.shape)
    for name in legs_of(error.owner):
        path: PlatformState = getattr(mission.geometry, name)
        of_unit = of_unit + group_delay(mission, path, error.subject.axis, times)
    return np.asarray(size * of_unit * at_zenith)


def electrons_at_1_hz(mission: Mission, times: Floats, group: Floats) -> Course:
    """Convert group delays by free electrons to `Errors.electrons`, the delay at 1 Hz. [s·Hz²]

    `group` are the delays at the centre frequency, (times,). [m]
    """
    return Course(times, group / SPEED_OF_LIGHT_MPS * mission.radar.center_frequency**2)


def has_unset_clocks(mission: Mission) -> bool:
    """Whether the phases of oscillators are simulated without mean and slope.

    This is so if the file does not state how the oscillators are set.
    """
    return any(error.displaces_unknown for error in random_errors(mission))


def drawn_errors(analysis: Analysis) -> Errors:
    """Draw one time series of each declared error of sensors, clocks and the atmosphere.

    The random numbers have the seed of the mission. Each series is multiplied by the coverage factor. The phase of a
    clock includes the error of its setting. The phase of an oscillator has no mean and slope in two cases:
    `timing_error` states the remainder of the setting, or the oscillator is free and the file does not state how it
    is set.
    """
    mission = analysis.mission
    seed = (mission.simulation or Simulation()).seed
    half = mission.collection.aperture_time / 2
    times: Floats = np.linspace(-half, half, _COURSE_SAMPLES)
    fastest = max((_fastest(mission, error) for error in analysis.random), default=0.0)
    steps = fast_steps(
        min(max(_COURSE_SAMPLES - 1, math.ceil(4 * _SAMPLES_PER_CYCLE * half * fastest)), _MAX_FLOWN_STEPS)
    )
    noise_times: Floats = np.linspace(-half, half, steps + 1)
    drawn = _DrawnErrors(mission, times, noise_times)
    for error in analysis.random:
        if not error.declared or error.counted_in or error.kind.moves == "image":  # declared only by its effect
            continue
        error.kind.find_in(_ADDITIONS)(drawn, error, np.random.default_rng([seed, *error.id.encode()]))
    return drawn.errors


class _DrawnErrors:
    """Sums of the time series of errors, each multiplied by the coverage factor.

    Parameters
    ----------
    mission : Mission
        The mission, in one case.
    times, noise_times : (n,)
        Slow times of the samples of errors that change slowly, and of vibration and phase noise. [s]
    """

    def __init__(self, mission: Mission, times: Floats, noise_times: Floats) -> None:
        self.mission, self.times, self.noise_times = mission, times, noise_times
        self.factor = mission.allocation.coverage_factor
        self._motions: list[tuple[str, Course]] = []
        self._phase: Floats = np.zeros(noise_times.size)
        self._air = dict.fromkeys(DELAYS, np.zeros(times.size))

    def add_motion(self, error: RandomError, rng: np.random.Generator) -> None:
        """Draw the motion of platforms by a sensor, by a lever arm, or by noise of a position."""
        for name, series in position_courses(self.mission, error, self.times, 1, rng).items():
            self._motions.append((name, Course(self.times, self.factor * series[0])))

    def add_delay(self, error: RandomError, rng: np.random.Generator) -> None:
        """Draw the delay of the echoes in the air."""
        (group,) = self.factor * delay_courses(self.mission, error, self.times, 1, rng)
        self._air[error.subject.axis] = self._air[error.subject.axis] + group

    def add_vibration(self, error: RandomError, rng: np.random.Generator) -> None:
        """Draw the vibration of a platform as its motion along the line of sight."""
        mission, times = self.mission, self.noise_times
        line_of_sight_error = (
            phase_courses(mission, error, times, 1, rng)[0] * mission.radar.wavelength / (2 * math.pi)
        )
        counted_fraction = float(counted(mission, error.owner, 1.0, "islr"))
        positions = np.array(getattr(mission.platforms, error.owner).state.place(times))
        sight = positions / np.linalg.norm(positions, axis=0)
        shaken = (
            (self.factor * line_of_sight_error / counted_fraction * sight).T
            if counted_fraction
            else np.zeros((times.size, 3))
        )
        self._motions.append((error.owner, Course(times, shaken)))

    def add_phase(self, error: RandomError, rng: np.random.Generator) -> None:
        """Draw the phase of an oscillator, or of the link, if it has an effect on the image."""
        if not (error.published.spread or error.published.quadratic or error.full.displacement > 0):
            return
        series = self.factor * phase_courses(self.mission, error, self.noise_times, 1, rng)[0]
        is_clock = not error.subject.axis
        is_free = error.displaces_unknown or (is_clock and states_both_terms(self.mission))
        self._phase = self._phase + (
            series - Course(self.noise_times, series).smooth(1).values if is_free else series
        )

    @property
    def errors(self) -> Errors:
        """All time series as errors of an image."""
        times, noise_times = self.times, self.noise_times
        # All motions are sampled as finely as the finest.
        course_times = max((course.times for _, course in self._motions), key=len, default=times)
        platform_courses: dict[str, Floats] = {}
        for name, course in self._motions:
            platform_courses[name] = platform_courses.get(name, 0.0) + course.at(course_times)
        transmitter, receiver = (
            PathError(course=Course(course_times, platform_courses[name]) if name in platform_courses else None)
            for name in PLATFORMS
        )
        seconds = clock_seconds(self._phase, self.mission.radar.wavelength)
        if self._air[DELAY].any():
            seconds = seconds + np.interp(noise_times, times, self._air[DELAY]) / SPEED_OF_LIGHT_MPS
        clock = Course(noise_times, seconds) if seconds.any() else None
        content = self._air[CONTENT]
        electrons = electrons_at_1_hz(self.mission, times, content) if content.any() else None
        return Errors(transmitter, receiver, clock_course=clock, electrons=electrons)


# Methods that draw the time series of a random error and add it to the others, by kind of error.
_ADDITIONS: Mapping[str, Callable[[_DrawnErrors, RandomError, np.random.Generator], None]] = {
    "imu": _DrawnErrors.add_motion,
    "lever_arm": _DrawnErrors.add_motion,
    "random": _DrawnErrors.add_motion,
    "trajectory": _DrawnErrors.add_motion,
    "vibration": _DrawnErrors.add_vibration,
    "propagation": _DrawnErrors.add_delay,
    "oscillator": _DrawnErrors.add_phase,
    "synchronization": _DrawnErrors.add_phase,
}
_Draw = Callable[[Floats, int, np.random.Generator], tuple[Floats, Floats]]


def _biased(order: int) -> _Draw:
    """Return a function that draws the position error caused by a constant bias, and the tilt caused by the bias.

    The position error is the bias times τⁿ/n!, with n = `order`. The tilt is the bias times τ^(n−2).
    """

    def draw(times: Floats, draws: int, rng: np.random.Generator) -> tuple[Floats, Floats]:
        bias: Floats = rng.standard_normal((draws, 1))
        return bias * times**order / math.factorial(order), bias * times ** (order - 2)

    return draw


def _walk(integrals: int) -> _Draw:
    """Return a function that draws a position error and a tilt, both of which are integrals of white noise.

    The position error is the noise integrated `integrals` times, and the tilt is the same noise integrated once. The
    integrals start at mid-aperture. The noise before and after mid-aperture is independent.
    """

    def draw(times: Floats, draws: int, rng: np.random.Generator) -> tuple[Floats, Floats]:
        end = float(np.abs(times).max())
        step = end / _WALK_STEPS
        fine = np.linspace(0, end, _WALK_STEPS + 1)
        errors, tilts = np.zeros((2, draws, times.size))
        for sign in (1, -1):
            side = np.zeros((draws, _WALK_STEPS + 1))
            np.cumsum(rng.standard_normal((draws, _WALK_STEPS)) * math.sqrt(step), axis=1, out=side[:, 1:])
            indices = np.flatnonzero(sign * times > 0)
            step_count = np.abs(times[indices]) / step
            lower = np.minimum(step_count.astype(int), fine.size - 2)
            fraction = step_count - lower
            tilts[:, indices] = side[:, lower] * (1 - fraction) + side[:, lower + 1] * fraction
            for _ in range(integrals - 1):
                area = np.cumsum((side[:, 1:] + side[:, :-1]) * (step / 2), axis=1)
                side[:, 1:] = area
            errors[:, indices] = side[:, lower] * (1 - fraction) + side[:, lower + 1] * fraction
        return errors, tilts

    return draw


def _correlated(correlation_time: float, times: Floats, draws: int, rng: np.random.Generator) -> Floats:
    """First-order Gauss-Markov noise of variance 1, computed by its recursion over time, (draws, times)."""
    noise = rng.standard_normal((times.size, draws))
    for index, step in enumerate(np.diff(times).tolist(), 1):
        decay = math.exp(-step / correlation_time)
        noise[index] = decay * noise[index - 1] + math.sqrt(1 - decay**2) * noise[index]
    return noise.T


# Functions that draw the position error and the tilt per unit of a figure of an inertial sensor. The orders are
# stated here again, because the time series check those of the budget.
_INERTIAL_DRAWS: Mapping[str, _Draw] = {
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
    """Random phases of one oscillator, or of the link, at the centre frequency, for one sigma, (draws, times). [rad]

    For an oscillator, `declared` is a factor on its amplitude. `times` are evenly spaced over the aperture. Tones
    above `highest` [Hz] may be omitted if no exchange of pulses folds them.
    """
    return error.kind.find_in(_PHASE_DRAWS, error.subject.axis)(mission, error, times, draws, rng, highest)


def _link_phases(
    mission: Mission, error: RandomError, times: Floats, draws: int, rng: np.random.Generator, _highest: float
) -> Floats:
    """Phases by the errors of the exchanges of pulses; independent at all times without a stated interval."""
    sync, T = mission.synchronization, mission.collection.aperture_time
    size = (error.declared or 0.0) / mission.allocation.coverage_factor
    if sync is None or sync.interval is None:
        white: Floats = size * rng.standard_normal((draws, times.size))
        return white
    series, knot_interval = [], max(sync.interval, T / _MAX_EXCHANGES_COUNT)
    for _ in range(draws):
        knots = _knots(times, knot_interval, rng)
        series.append(np.interp(times, knots, rng.standard_normal(knots.size)))
    # If not all exchanges are drawn, this scale preserves the level of the flat part of the spectrum.
    return size * math.sqrt(sync.interval / knot_interval) * np.stack(series)


def _vibration_phases(
    mission: Mission, error: RandomError, times: Floats, draws: int, rng: np.random.Generator, highest: float
) -> Floats:
    """Phases by the random vibration of a platform, along the line of sight."""
    pieces = _below(pieces_of_vibration(mission, error.owner), highest)
    return (error.declared or 0.0) * _Tones(pieces, mission.collection.aperture_time).at(times, draws, rng)


def _oscillator_phases(
    mission: Mission, error: RandomError, times: Floats, draws: int, rng: np.random.Generator, highest: float
) -> Floats:
    """Phases of an oscillator by its own noise, and by spurs that exchanges of pulses fold to low frequencies."""
    sync, T, size = mission.synchronization, mission.collection.aperture_time, error.declared or 0.0
    pieces = noise_in_case(mission, error.owner).pieces
    spurs = [(float(spur.free), spur.left) for spur in spurs_of(mission) if spur.name == error.owner]
    linked = _linked_phases(mission, error.owner, pieces, spurs, times, draws, rng, highest)
    if linked is not None:
        return size * linked
    pieces = _below(pieces, highest)
    if sync is None or not sync.is_holdover:
        return size * _Tones(pieces, T).at(times, draws, rng)
    setting = _Setting(pieces, T, sync.age or T, sync.averaging or T)
    slow = setting.tones.draw_slow(draws, rng)
    phases = setting.tones.slow_at(times, slow) + setting.tones.fast_at(times, draws, rng)
    phases -= setting.lines(slow, times, rng)
    return size * phases


def _acceleration_phases(
    mission: Mission, error: RandomError, times: Floats, draws: int, rng: np.random.Generator, highest: float
) -> Floats:
    """Phases of an oscillator under acceleration: by random vibration, slow tones, and turns of the platform."""
    T, size = mission.collection.aperture_time, (error.declared or 0.0) / mission.allocation.coverage_factor
    pieces, turn_phase = pieces_by_acceleration(mission, error.owner), _TurnPhase(mission, error.owner)
    turn_phases = [turn_phase.draw(rng) for _ in range(draws)]
    # `_TurnPhase` draws the tones of vibrations that are slow themselves.
    tones = [
        (float(tone.free), tone.left)
        for tone in accelerated_tones(mission)
        if tone.name == error.owner and tone.frequency * T >= SLOWEST_ECHO_CYCLES
    ]
    linked = _linked_phases(mission, error.owner, pieces, tones, times, draws, rng, highest, turn_phases)
    if linked is not None:
        return size * linked
    phases = _Tones(_below(pieces, highest), T).at(times, draws, rng)
    if turn_phases:
        phases += np.stack([phase_at(times) for phase_at in turn_phases])
    return size * phases


# Functions that draw phases, by kind of error. Their arguments are those of `phase_courses`.
_PHASE_DRAWS: Mapping[str, Callable[[Mission, RandomError, Floats, int, np.random.Generator, float], Floats]] = {
    "vibration": _vibration_phases,
    "oscillator": _oscillator_phases,
    "oscillator.acceleration": _acceleration_phases,
    "synchronization": _link_phases,
}


def _linked_phases(
    mission: Mission,
    name: str,
    pieces: tuple[PowerLawPiece, ...],
    tones: Sequence[tuple[float, LeftTone]],
    times: Floats,
    draws: int,
    rng: np.random.Generator,
    highest: float,
    turn_phases: Sequence[Callable[[Floats], Floats]] = (),
) -> Floats | None:
    """Phases of a unit error of an oscillator that a link leaves, (draws, times); None without a link. [rad]

    The link exchanges pulses at a stated interval, or the receiver hears the transmitter directly. `tones` are tones
    of the oscillator, each with its amplitude without a link, and what the exchanges leave of it.
    """
    sync, T = mission.synchronization, mission.collection.aperture_time
    if sync is None:
        return None
    if sync.interval is not None:
        # After exchanges at shorter intervals, the remaining phase is too small to have an effect on an image.
        interval = max(sync.interval, T / _MAX_EXCHANGES_COUNT)
        residual = _between_exchanges(pieces, T, interval, times, draws, rng, turn_phases)
        for frequency, amplitude in _folded_tones(tones, T):
            start = rng.uniform(0, 2 * math.pi, (draws, 1))
            residual += math.sqrt(2) * amplitude * np.cos(2 * math.pi * frequency * times + start)
        return residual
    if not sync.is_direct_path:
        return None
    if name == "transmitter":  # direct path and echo have its phase of the same time
        return np.zeros((draws, times.size))
    delay = float(mission.geometry.echo_delay)
    return _Tones(_below(pieces, highest), T).at(times, draws, rng, later=delay)


def _between_exchanges(
    pieces: tuple[PowerLawPiece, ...],
    aperture_time: float,
    interval: float,
    times: Floats,
    draws: int,
    rng: np.random.Generator,
    turn_phases: Sequence[Callable[[Floats], Floats]] = (),
) -> Floats:
    """Phases minus the straight lines between their values at exchanges of pulses, (draws, times). [rad]

    The tones are periodic in a whole number of exchange intervals. Both the exchanges and the moments at which the
    phase is sampled then divide the period evenly. To achieve this, the times between the moments are scaled. The
    scale differs from 1 by less than the ratio of the spacing of the moments to the period.
    """
    step = min(interval, _FAR_FACTOR * aperture_time)
    exchanges = max(_MIN_EXCHANGES_COUNT, math.ceil(_PERIOD_FACTOR * aperture_time / step))
    tones = _Tones(pieces, aperture_time, period=exchanges * step)
    mid_time, spacing = (times[0] + times[-1]) / 2, float(times[-1] - times[0]) / (times.size - 1)
    count = round(tones.period / spacing)
    moments: Floats = mid_time + (times - mid_time) * (tones.period / count / spacing)
    slow = tones.draw_slow(draws, rng)
    phases = tones.slow_at(moments, slow)
    for index in range(draws):
        knots = _knots(moments, interval, rng)
        sampled = tones.slow_at(knots, slow[:, index : index + 1])[0]
        if turn_phases:
            phases[index] += turn_phases[index](moments)
            sampled += turn_phases[index](knots)
        cosine, sine = rng.standard_normal((2, tones.fast_size.size)) * tones.fast_size
        fast: Complexes = cosine - 1j * sine
        phases[index] += tones_at(fast, count)[: times.size]
        # With longer intervals, exchanges are in later periods of the tones, where fast tones are as independent.
        fast *= _phasors((knots[0] - moments[0]) / interval * step / tones.period, fast.size)
        sampled += np.resize(tones_at(fast, exchanges), knots.size)
        if tones.rest:  # independent at each moment
            phases[index] += tones.rest * rng.standard_normal(times.size)
            sampled += tones.rest * rng.standard_normal(knots.size)
        phases[index] -= np.interp(moments, knots, sampled)
    return phases


def _below(pieces: tuple[PowerLawPiece, ...], highest: float) -> tuple[PowerLawPiece, ...]:
    """Select the part of a spectrum below a frequency."""
    return tuple(piece._replace(high=min(piece.high, highest)) for piece in pieces if piece.low < highest)


def _above(pieces: tuple[PowerLawPiece, ...], lowest: float) -> tuple[PowerLawPiece, ...]:
    """Select the part of a spectrum above a frequency."""
    return tuple(piece._replace(low=max(piece.low, lowest)) for piece in pieces if piece.high > lowest)


def _fastest(mission: Mission, error: RandomError) -> float:
    """Highest frequency in the spectrum of an error, or 0 if it has no spectrum. [Hz]"""
    highest_of_noise = max((piece.high for piece in error.noise.pieces), default=0.0) if error.noise else 0.0
    return max(highest_of_noise, fastest_shake(mission, error))


def fastest_shake(mission: Mission, error: RandomError) -> float:
    """Highest frequency in the spectrum of a vibration, or of the oscillator phase that a vibration causes. [Hz]

    The result is 0 for any other error.
    """
    return max((piece.high for piece in _shake_pieces(mission, error)), default=0.0)


def slowest_shake(mission: Mission, error: RandomError) -> float:
    """Lowest frequency in the spectrum of a vibration, or of the oscillator phase that a vibration causes. [Hz]"""
    return min((piece.low for piece in _shake_pieces(mission, error)), default=0.0)


def _shake_pieces(mission: Mission, error: RandomError) -> tuple[PowerLawPiece, ...]:
    """Phase spectrum that vibration causes, directly or through an oscillator; empty for any other error."""
    pieces_of = _SHAKES.get(f"{error.kind.name}.{error.subject.axis}")
    return () if pieces_of is None else pieces_of(mission, error.owner)


# Functions that give the phase spectrum caused by vibration, by kind and axis of error.
_SHAKES: Mapping[str, Callable[[Mission, str], tuple[PowerLawPiece, ...]]] = {
    "vibration.spectrum": pieces_of_vibration,
    "oscillator.acceleration": pieces_by_acceleration,
}


def oscillator_sinusoids(mission: Mission, name: str) -> tuple[PathSinusoid, ...]:
    """Sinusoidal motions of a platform that give the same phases as the tones of its vibrating oscillator.

    Only tones of at least one cycle per aperture are included; slower tones are drawn by `phase_courses`. The tones
    differ in phase by a quarter of a cycle from the vibration that causes them.
    """
    metres, T = mission.radar.wavelength / (2 * math.pi), mission.collection.aperture_time
    return tuple(
        PathSinusoid(
            float(metres * tone.free * tone.sensitivity * share),
            float(frequency),
            0.0 if tone.in_quadrature is None or index else math.pi / 2,
        )
        for tone in accelerated_tones(mission)
        for index, (frequency, share) in enumerate(zip(tone.left.frequencies, tone.left.shares, strict=True))
        if tone.name == name
        and tone.frequency * T >= SLOWEST_ECHO_CYCLES
        and frequency * T >= SLOWEST_ECHO_CYCLES
        and (share or not index)
    )


def _folded_tones(tones: Sequence[tuple[float, LeftTone]], aperture_time: float) -> list[tuple[float, float]]:
    """Oscillator tones that exchanges of pulses fold to low frequencies: frequencies [Hz] and amplitudes per unit."""
    return [
        (float(frequency), free * float(share))
        for free, residual in tones
        for frequency, share in zip(residual.frequencies, residual.shares, strict=True)
        if frequency * aperture_time < SLOWEST_ECHO_CYCLES and share
    ]


class _TurnPhase:
    """Random phase of an oscillator from slow vibration and from the turns of its platform, per unit of sensitivity.

    All directions of the sensitivity are equally likely, and so are all phases of a tone. One sigma is the effect in
    the direction with the largest effect.
    """

    def __init__(self, mission: Mission, name: str) -> None:
        self.scale, T = 2 * math.pi * mission.radar.center_frequency, mission.collection.aperture_time
        self.state = getattr(mission.platforms, name).state
        self.turns = not mission.has_direct_path and flies_a_turn(mission, name)
        sync = mission.synchronization
        is_linked = sync is not None and sync.interval is not None  # lines are subtracted after drawing
        self.slow = [
            (tone.frequency, tone.free if is_linked else tone.free * tone.left.shares[0])
            for tone in accelerated_tones(mission)
            if tone.name == name and tone.frequency * T < SLOWEST_ECHO_CYCLES
        ]

    def draw(self, rng: np.random.Generator) -> Callable[[Floats], Floats]:
        """Draw one random phase, as a function of slow times. [rad]"""
        direction, starts = rng.standard_normal(3), rng.uniform(0, 2 * math.pi, len(self.slow))

        def at(times: Floats) -> Floats:
            phase = np.zeros(times.size)
            if self.turns:
                phase += self.scale * direction @ turn_courses(self.state, times)
            for (frequency, amplitude), start in zip(self.slow, starts, strict=True):
                phase += math.sqrt(2) * amplitude * np.cos(2 * math.pi * frequency * times + start)
            return phase

        return at


def _knots(times: Floats, interval: float, rng: np.random.Generator) -> Floats:
    """Times of exchanges of pulses, with a random start, that enclose all given times. [s]"""
    start = float(times.min()) - interval * float(rng.random())
    knots: Floats = np.arange(start, float(times.max()) + interval, interval)
    return knots


def _cosines_and_sines(frequency: Floats, times: Floats) -> tuple[Floats, Floats]:
    """Cosines and sines of tones of given frequencies at given times, (times, tones) each."""
    turn = 2 * math.pi * np.multiply.outer(times, frequency)
    return np.cos(turn), np.sin(turn)


def _phasors(turns: float, count: int) -> Complexes:
    """Phasors exp(2πi·n·turns) for n = 1 … `count`, (count,).

    They are the phasors of the harmonics n at a time at which the fundamental has completed `turns` cycles.
    """
    side = math.isqrt(count) + 1
    coarse = np.exp(2j * math.pi * turns * np.arange(side + 1) * side)
    phasors: Complexes = np.multiply.outer(coarse, np.exp(2j * math.pi * turns * np.arange(side))).ravel()
    return phasors[1 : count + 1]


Summed = TypeVar("Summed", np.float64, np.complex128)


def _folded(values: NDArray[Summed], count: int) -> NDArray[Summed]:
    """Sum the values of harmonics 1, 2 … that alias to the same harmonic, (count,).

    These harmonics coincide at `count` evenly spaced moments of the period.
    """
    padded = np.zeros(-(-(values.size + 1) // count) * count, values.dtype)
    padded[1 : values.size + 1] = values
    folded: NDArray[Summed] = padded.reshape(-1, count).sum(axis=0)
    return folded


def fast_steps(least: int) -> int:
    """Small number of steps that suits a Fourier transform, at least `least` and at most a sixteenth more."""
    unit = 1 << max(0, least.bit_length() - 5)
    return -(-least // unit) * unit


def tones_at(amplitudes: Complexes, count: int) -> Floats:
    """Sum of harmonics 1, 2 … at `count` evenly spaced times of one period, (count,).

    `amplitudes` are the complex amplitudes of the harmonics. The first time is the start of the period.
    """
    sums: Floats = np.fft.ifft(_folded(amplitudes, count), norm="forward").real
    return sums


def powers_at(powers: Floats, count: int) -> Floats:
    """Powers of harmonics 0 … count / 2 that replace harmonics 1, 2 … of random phase at `count` moments.

    The covariance at these moments is the same.

    The phase of harmonic k at moment n is 2πkn/count. Harmonic k + count has the same phase. Harmonic count − k has
    the opposite phase, which does not differ if the phase is random. The powers of these harmonics are therefore
    added.
    """
    folded = _folded(powers, count)
    one_sided: Floats = folded[: count // 2 + 1].copy()
    one_sided[1 : (count + 1) // 2] += folded[: count // 2 : -1]
    return one_sided


class _Tones:
    """Spectrum as a set of tones: fast tones at equal steps of frequency, slow tones at logarithmic steps.

    Fast tones complete cycles within the aperture, and repeat after `period` [s]. A narrow piece of the spectrum
    contains few fast tones. It gets additional tones, which follow the slow tones in the arrays. Noise at frequencies
    above those of the fast tones is independent at each time. Its standard deviation is `rest`.
    """

    def __init__(
        self,
        pieces: tuple[PowerLawPiece, ...],
        aperture_time: float,
        slow: Floats | None = None,
        period: float | None = None,
    ) -> None:
        self.period = _PERIOD_FACTOR * aperture_time if period is None else period
        high, fine = max((piece.high for piece in pieces), default=0.0), 1 / self.period
        narrow: list[PowerLawPiece] = []
        if slow is None:
            slow = np.geomspace(_MIN_CYCLES_PER_APERTURE / aperture_time, fine / 2, _SLOW_TONES_COUNT + 1)
            narrow = [
                piece for piece in pieces if piece.low >= fine / 2 and piece.high - piece.low < _NARROW_COUNT * fine
            ]
            pieces = tuple(piece for piece in pieces if piece not in narrow)
        self.slow: Floats = (slow[1:] + slow[:-1]) / 2
        # Standard deviation of the cosine part and of the sine part of a tone: √(S·Δf).
        self.slow_size: Floats = np.sqrt(density(pieces, self.slow) * (slow[1:] - slow[:-1]))
        self.count = self.slow.size
        for piece in narrow:
            width = (piece.high - piece.low) / _TONES_PER_NARROW_PIECE
            frequencies = piece.low + width * (np.arange(_TONES_PER_NARROW_PIECE, dtype=float) + 0.5)
            self.slow = np.append(self.slow, frequencies)
            self.slow_size = np.append(self.slow_size, np.sqrt(piece.at(frequencies) * width))
        pieces = _above(pieces, float(slow[-1]))
        count = min(_MAX_TONES_COUNT, max(1, math.ceil(high / fine)))
        self.fast: Floats = fine * np.arange(1.0, count + 1)
        self.fast_size: Floats = np.sqrt(density(pieces, self.fast) * fine)
        top = float(self.fast[-1]) + fine / 2
        beyond = [piece.integral(max(piece.low, top), piece.high) for piece in pieces if piece.high > top]
        self.rest = math.sqrt(math.fsum(beyond))

    def draw_slow(self, draws: int, rng: np.random.Generator) -> Floats:
        """Draw random amplitudes of the cosine and sine of each slow tone, (2, draws, tones)."""
        drawn: Floats = rng.standard_normal((2, draws, self.slow.size)) * self.slow_size
        return drawn

    def slow_at(self, times: Floats, drawn: Floats) -> Floats:
        """Sums of the slow tones and the tones of narrow pieces, with the drawn amplitudes, (draws, times). [rad]"""
        coarse_times = times if times.size <= _COURSE_SAMPLES else np.linspace(times[0], times[-1], _COURSE_SAMPLES)
        cosines, sines = _cosines_and_sines(self.slow[: self.count], coarse_times)
        sums: Floats = drawn[0, :, : self.count] @ cosines.T + drawn[1, :, : self.count] @ sines.T
        if coarse_times is not times:
            sums = np.stack([np.interp(times, coarse_times, values) for values in sums])
        for index in range(self.count, self.slow.size):
            turn = 2 * math.pi * self.slow[index] * times
            sums += np.outer(drawn[0, :, index], np.cos(turn)) + np.outer(drawn[1, :, index], np.sin(turn))
        return sums

    def fast_at(self, times: Floats, draws: int, rng: np.random.Generator, later: float | None = None) -> Floats:
        """Random sums of the fast tones at times that divide their period evenly, (draws, times). [rad]

        If `later` [s] is given, the result is the change of the sum during that time, as in `at`.
        """
        count = 2 * round(self.period * (times.size - 1) / float(times[-1] - times[0]) / 2)
        square, white_variance = np.square(self.fast_size), self.rest**2
        if later is not None:
            square, white_variance = square * (2 * np.sin(math.pi * self.fast * later)) ** 2, 2 * white_variance
        power = powers_at(square, count)
        power[1 : (count + 1) // 2] += 2 * white_variance / count
        power[:: count // 2] += white_variance / count
        size = np.sqrt(power) * count / 2
        size[:: count // 2] *= 2  # the lowest and the highest frequency have no sine part
        sums, block_draws = np.empty((draws, times.size)), max(1, _BLOCK_COUNT // count)
        for start in range(0, draws, block_draws):
            draw_count = min(block_draws, draws - start)
            drawn = rng.standard_normal((draw_count, size.size, 2)).view(complex)[..., 0] * size
            sums[start : start + draw_count] = np.fft.irfft(drawn, count)[:, : times.size]
        return sums

    def at(self, times: Floats, draws: int, rng: np.random.Generator, later: float | None = None) -> Floats:
        """Random sums of all tones at evenly spaced times, (draws, times). [rad]

        If `later` [s] is given, the result is the change of the sum during that time.
        """
        slow = self.draw_slow(draws, rng)
        sums = self.slow_at(times, slow)
        if later is not None:
            sums = self.slow_at(times + later, slow) - sums
        return sums + self.fast_at(times, draws, rng, later)


class _Setting:
    """Setting of a clock before the aperture: a line is fitted to its phase over an averaging time.

    The slow tones of the averaging time and of the aperture are the same. Tones that are faster than one cycle per
    eight apertures, and that complete two dozen cycles within the age of the setting, are drawn independently for the
    averaging time.
    """

    def __init__(self, pieces: tuple[PowerLawPiece, ...], aperture_time: float, age: float, averaging: float) -> None:
        self.age = age
        step, followed = 1 / (_TONES_PER_AGE_CYCLE * age), _AGE_CYCLES / age
        fast_frequency = max(followed, 1 / (2 * _PERIOD_FACTOR * aperture_time))
        edges = [np.geomspace(_MIN_CYCLES_PER_APERTURE / max(age, aperture_time), step, _SLOW_TONES_COUNT + 1)]
        edges += [np.arange(step, followed, step), np.geomspace(followed, fast_frequency, _SLOW_TONES_COUNT + 1)]
        self.tones = _Tones(pieces, aperture_time, np.unique(np.concatenate(edges)))
        count = 64 + math.ceil(16 * averaging * fast_frequency)
        self.window: Floats = ((np.arange(count) + 0.5) / count - 0.5) * averaging
        self.fit: Floats = np.linalg.pinv(np.stack((np.ones(count), self.window), axis=1)).astype(float)
        cosines, sines = _cosines_and_sines(self.tones.slow, self.window - age)
        self.of_cosine, self.of_sine = self.fit @ cosines, self.fit @ sines
        fast_pieces = _above(_below(pieces, _MAX_AVERAGING_CYCLES / averaging), fast_frequency)
        self.fast = _Tones(fast_pieces, averaging) if fast_pieces else None

    def lines(self, slow: Floats, times: Floats, rng: np.random.Generator) -> Floats:
        """Values of the fitted lines at slow times within the aperture, (draws, times). [rad]

        `slow` are the drawn amplitudes of the slow tones.
        """
        lines = self.of_cosine @ slow[0].T + self.of_sine @ slow[1].T
        if self.fast is not None:
            lines += self.fit @ self.fast.at(self.window, slow.shape[1], rng).T
        lines_at_times: Floats = lines[0][:, None] + np.multiply.outer(lines[1], times + self.age)
        return lines_at_times


def clock_seconds(phase: Floats, wavelength_m: float) -> Floats:
    """Clock error that corresponds to a phase at the centre frequency. [s]"""
    return phase * wavelength_m / (2 * math.pi * SPEED_OF_LIGHT_MPS)
