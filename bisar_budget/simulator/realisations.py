"""Random time series of sensor, clock and atmosphere errors within one aperture.

The time series are used to check the formulas of the budget, so they are computed without these formulas. Random
walks are sums of steps. Correlated noise is computed by recursion over time. Phase noise is a sum of tones. To
simulate synchronisation by pulse exchanges, straight lines between the values of the phase noise at the exchanges are
subtracted.
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
from bisar_budget.error_kinds.random_kinds import INERTIAL_FIGURES, InertialFigure
from bisar_budget.geometry import PlatformState
from bisar_budget.mission.model import Mission, Simulation
from bisar_budget.mission.platforms import MotionError
from bisar_budget.mission.propagation import DELAYS
from bisar_budget.simulator.flown_navigation import navigation_courses
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
    """Draw the position errors of the platforms that a random error causes.

    The error is an error of an inertial sensor or of a lever arm, or correlated position noise. Its standard
    deviation is the declared size without the coverage factor. The keys of the result are the names of the platforms.
    The values [m] are (draws, times, 3): east, north, up. If the error is common to both platforms, both use the same
    random numbers along their axes. `error.declared` only scales the result; the ratios between the axes are taken
    from the mission. `times` (times,) [s] are slow times within the aperture.
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
    """Draw the motion of each platform due to a random error.

    The largest component of the error has a standard deviation of 1. The result maps the name of each platform to
    pairs of a random time series and the motion per unit of the series.
    """
    return error.kind.find_in(_MOTION_DRAWS, error.subject.axis)(mission, error, times, draws, rng)


def _noise_motions(
    mission: Mission, error: RandomError, times: Floats, draws: int, rng: np.random.Generator
) -> dict[str, _Motions]:
    """Draw the motion of each platform due to correlated position noise.

    The largest component of the noise has a standard deviation of 1. Platforms that share the noise get the same time
    series. The keys of the result are the names of the platforms.
    """
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
    """Draw the motion of a platform due to an error of its inertial sensor.

    The largest component of the error has a standard deviation of 1. The motion follows from the acceleration error.
    If the sensor error tilts the platform and the mission file states a lever arm, the motion of the antenna due to
    the tilt of the lever arm is added.
    """
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
    """Draw the antenna motion that an attitude error causes through the lever arm.

    The largest component of the attitude error has a standard deviation of 1 rad. The acceleration error that results
    from the tilt is not included.
    """
    motion, swings = _motion(mission, error.owner), _swings(mission, error.owner, times)
    assert swings is not None
    drawn = _drawn_by_axis(motion, INERTIAL_FIGURES["attitude"], times, draws, rng)
    return {error.owner: [(tilted, swings[axis]) for axis, _, tilted in drawn]}


def _arm_motions(
    mission: Mission, error: RandomError, times: Floats, draws: int, rng: np.random.Generator
) -> dict[str, _Motions]:
    """Draw the motion due to an error of the lever arm.

    The largest component of the error has a standard deviation of 1. The error turns with the body of the platform.
    """
    lever = _motion(mission, error.owner).lever_arm
    uncertainty = lever.uncertainty if lever is not None else None
    _, sizes = parts_of_largest(np.array(uncertainty or (1.0, 1.0, 1.0)))
    body = np.moveaxis(body_axes(getattr(mission.platforms, error.owner).state, times), 1, 2)
    drawn = [size * rng.standard_normal((draws, 1)) * np.ones(times.size) for size in sizes]
    return {error.owner: list(zip(drawn, body, strict=True))}


def _navigation_motions(
    mission: Mission, error: RandomError, times: Floats, draws: int, rng: np.random.Generator
) -> dict[str, _Motions]:
    """Draw the position errors of a platform with aided navigation, from simulated flights."""
    courses = navigation_courses(mission, error.owner, times, draws, rng)
    return {error.owner: [(courses[..., axis], direction) for axis, direction in enumerate(np.eye(3))]}


# Functions that draw the motion of platforms, by kind of error.
_MOTION_DRAWS: Mapping[
    str, Callable[[Mission, RandomError, Floats, int, np.random.Generator], dict[str, _Motions]]
] = {
    "imu": _sensor_motions,
    "lever_arm.attitude": _swing_motions,
    "lever_arm.uncertainty": _arm_motions,
    "navigation": _navigation_motions,
    "random": _noise_motions,
    "trajectory": _noise_motions,
}


def _drawn_by_axis(
    motion: MotionError, figure: InertialFigure, times: Floats, draws: int, rng: np.random.Generator
) -> Iterator[tuple[int, Floats, Floats]]:
    """Draw the position error and the tilt that an error of an inertial sensor causes, for each axis of the sensor.

    `figure` is the data-sheet value that describes the sensor error, such as the gyro bias; the mission states it for
    each of the three axes. Before the errors are drawn, the three values are divided by the largest of them, which
    becomes 1. Yields the index of the axis, the position error (draws, times), and the tilt (draws, times). The
    position error is computed as if one unit of the sensor error caused an acceleration error of 1 m/s². To obtain
    the actual position error, the caller multiplies it by the acceleration error per unit. An axis without an error
    is omitted.
    """
    _, sizes = parts_of_largest(np.array(getattr(motion.imu, figure.key, None) or (1.0, 1.0, 1.0)))
    for axis, size in enumerate(sizes):
        if size:
            pushed, tilted = _INERTIAL_DRAWS[figure.key](times, draws, rng)
            yield axis, size * pushed, size * tilted


def _swings(mission: Mission, name: str, times: Floats) -> Floats | None:
    """Motion of the antenna per unit of tilt about each axis, (axes, times, 3). [m/rad]

    The result is None if the mission file states no lever arm.
    """
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
    """Draw group delays at the centre frequency due to the atmosphere, (draws, times). [m]

    The standard deviation of the zenith delays is the declared size without the coverage factor. A group delay is for
    the path to one platform, or the sum for both platforms if they have the same atmosphere.
    """
    return group_delays(mission, error, times, zenith_delays(mission, error, times, draws, rng))


def zenith_delays(
    mission: Mission, error: RandomError, times: Floats, draws: int, rng: np.random.Generator
) -> Floats:
    """Draw zenith delays in units of the declared standard deviation, (draws, times).

    The delays are correlated over time if the mission file states a correlation time, and constant otherwise.
    """
    correlation_time = correlation_time_of(mission, error.owner)
    if correlation_time is not None:
        return _correlated(float(correlation_time), times, draws, rng)
    return np.multiply.outer(rng.standard_normal(draws), np.ones(times.size))


def group_delays(mission: Mission, error: RandomError, times: Floats, at_zenith: Floats) -> Floats:
    """Convert zenith delays to group delays along the signal path at the centre frequency, (draws, times). [m]

    `at_zenith` (draws, times) are the zenith delays in units of the declared standard deviation.
    """
    size = (error.declared or 0.0) / mission.allocation.coverage_factor
    return np.asarray(size * _delay_of_unit(mission, error, times) * at_zenith)


def _delay_of_unit(mission: Mission, error: RandomError, times: Floats) -> Floats:
    """Group delay along the signal path due to one unit of a zenith delay or electron content, (times,). [m/unit]"""
    of_unit = np.zeros(times.shape)
    for name in legs_of(error.owner):
        path: PlatformState = getattr(mission.geometry, name)
        of_unit = of_unit + group_delay(mission, path, error.subject.axis, times)
    return of_unit


def electrons_at_1_hz(mission: Mission, times: Floats, group: Floats) -> Course:
    """Convert group delays due to free electrons to delays at a frequency of 1 Hz, as in `Errors.electrons`. [s·Hz²]

    `group` (times,) [m] are the group delays at the centre frequency. `times` [s] are their slow times.
    """
    return Course(times, group / SPEED_OF_LIGHT_MPS * mission.radar.center_frequency**2)


def has_unset_clocks(mission: Mission) -> bool:
    """Whether there are oscillators for which the mission file does not state how they are set before the aperture.

    The phases of such oscillators are simulated without mean and slope.
    """
    return any(error.displaces_unknown for error in random_errors(mission))


def drawn_errors(analysis: Analysis) -> Errors:
    """Draw time series of the declared errors of sensors, clocks and the atmosphere, and combine them for an image.

    The random numbers are drawn with the seed of the mission. Each series is multiplied by the coverage factor. The
    phase of an oscillator includes the error with which it was set before the aperture. Its mean and slope are
    removed in two cases: `timing_error` states the clock error that remains after the setting, or the oscillator runs
    freely and the file does not state how it is set.
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
    """Sums of the random time series of errors of one mission, each multiplied by the coverage factor.

    Parameters
    ----------
    mission : Mission
        The mission, with a single case.
    times : (n,)
        Slow times at which slowly changing errors are sampled. [s]
    noise_times : (m,)
        Slow times at which vibration and phase noise are sampled. [s]
    """

    def __init__(self, mission: Mission, times: Floats, noise_times: Floats) -> None:
        self.mission, self.times, self.noise_times = mission, times, noise_times
        self.factor = mission.allocation.coverage_factor
        self._motions: list[tuple[str, Course]] = []
        self._phase: Floats = np.zeros(noise_times.size)
        self._air = dict.fromkeys(DELAYS, np.zeros(times.size))

    def add_motion(self, error: RandomError, rng: np.random.Generator) -> None:
        """Draw motion due to a sensor error, a lever-arm error or position noise, and add it to the motions."""
        for name, series in position_courses(self.mission, error, self.times, 1, rng).items():
            self._motions.append((name, Course(self.times, self.factor * series[0])))

    def add_delay(self, error: RandomError, rng: np.random.Generator) -> None:
        """Draw the delay of the echoes in the atmosphere, and add it to the sum of delays of the same kind."""
        (group,) = self.factor * delay_courses(self.mission, error, self.times, 1, rng)
        if error.biased is not None:
            group = group + float(np.ravel(error.biased.bias)[0]) * _delay_of_unit(self.mission, error, self.times)
        self._air[error.subject.axis] = self._air[error.subject.axis] + group

    def add_vibration(self, error: RandomError, rng: np.random.Generator) -> None:
        """Draw random vibration of a platform along the line of sight, and add it to the motions."""
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
        """Draw the phase of an oscillator or of the synchronisation link, and add it to the phase of the echoes.

        An error without an effect on the image is omitted. Mean and slope are removed in the two cases listed in
        `drawn_errors`.
        """
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
        """Combine all time series into the errors that the simulator applies to an image."""
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
    "navigation": _DrawnErrors.add_motion,
    "random": _DrawnErrors.add_motion,
    "trajectory": _DrawnErrors.add_motion,
    "vibration": _DrawnErrors.add_vibration,
    "propagation": _DrawnErrors.add_delay,
    "oscillator": _DrawnErrors.add_phase,
    "synchronization": _DrawnErrors.add_phase,
}
_Draw = Callable[[Floats, int, np.random.Generator], tuple[Floats, Floats]]


def _biased(order: int) -> _Draw:
    """Return a function that draws a constant bias, and returns the resulting position error and tilt.

    The position error is the bias times τⁿ/n!, with n = `order`. The tilt is the bias times τ^(n−2).
    """

    def draw(times: Floats, draws: int, rng: np.random.Generator) -> tuple[Floats, Floats]:
        bias: Floats = rng.standard_normal((draws, 1))
        return bias * times**order / math.factorial(order), bias * times ** (order - 2)

    return draw


def _walk(integrals: int) -> _Draw:
    """Return a function that draws a random walk: a position error and a tilt that are integrals of white noise.

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
    """First-order Gauss-Markov noise with a variance of 1, (draws, times). It is computed by recursion over time."""
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
    """Draw the phases at the centre frequency that a random error causes, (draws, times). [rad]

    The error is an error of an oscillator or of the synchronisation link, or a vibration. Its standard deviation is
    usually the declared size without the coverage factor; for the noise of an oscillator and for a vibration,
    `error.declared` is a factor on the amplitude instead. `times` [s] are evenly spaced over the aperture. Tones
    above `highest` [Hz] may be omitted, unless pulse exchanges fold them to lower frequencies.
    """
    return error.kind.find_in(_PHASE_DRAWS, error.subject.axis)(mission, error, times, draws, rng, highest)


def _link_phases(
    mission: Mission, error: RandomError, times: Floats, draws: int, rng: np.random.Generator, _highest: float
) -> Floats:
    """Draw the phases due to measurement errors of pulse exchanges, (draws, times). [rad]

    The standard deviation of an error is its declared size without the coverage factor. Between exchanges the phase
    is interpolated linearly. If the mission states no exchange interval, the phases at different times are
    independent.
    """
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
    """Draw the phases caused by random vibration of a platform along the line of sight, (draws, times). [rad]"""
    pieces = _below(pieces_of_vibration(mission, error.owner), highest)
    return (error.declared or 0.0) * _Tones(pieces, mission.collection.aperture_time).at(times, draws, rng)


def _oscillator_phases(
    mission: Mission, error: RandomError, times: Floats, draws: int, rng: np.random.Generator, highest: float
) -> Floats:
    """Draw the phases of an oscillator due to its own noise, (draws, times). [rad]

    Spurs are included if pulse exchanges fold them to low frequencies. If the oscillator is set before the aperture
    and then runs freely, the error of this setting is included.
    """
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
    """Draw the phases of an oscillator due to the acceleration of its platform, (draws, times). [rad]

    The acceleration sensitivity of the oscillator is the declared size without the coverage factor. The acceleration
    is caused by random vibration, by slow vibration tones and by turns of the platform. Faster tones are included if
    pulse exchanges fold them to low frequencies.
    """
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
    """Draw the oscillator phases that remain after correction by a synchronisation link, (draws, times). [rad]

    The phases are for a unit error. With the link, the platforms exchange pulses at a stated interval, or the
    receiver uses the direct signal of the transmitter. The result is None without such a link. `tones` contains a
    pair for each tone of the oscillator: its amplitude without a link, and the tones that remain after the exchanges.
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
    """Draw phases, and subtract straight lines between their values at successive pulse exchanges. [rad]

    The result is (draws, times). The phases are sums of tones, whose common period is a whole number of exchange
    intervals. The spacing of `times` is changed slightly, so that it also divides the period evenly. The relative
    change is less than the ratio of the spacing to the period. `turn_phases`, if not empty, holds additional phases
    as functions of slow time, one function for each draw.
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
    """Select the part of a power-law spectrum below the frequency `highest`. [Hz]"""
    return tuple(piece._replace(high=min(piece.high, highest)) for piece in pieces if piece.low < highest)


def _above(pieces: tuple[PowerLawPiece, ...], lowest: float) -> tuple[PowerLawPiece, ...]:
    """Select the part of a power-law spectrum above the frequency `lowest`. [Hz]"""
    return tuple(piece._replace(low=max(piece.low, lowest)) for piece in pieces if piece.high > lowest)


def _fastest(mission: Mission, error: RandomError) -> float:
    """Highest frequency in the noise or vibration spectrum of an error, or 0 if the error has no spectrum. [Hz]"""
    highest_of_noise = max((piece.high for piece in error.noise.pieces), default=0.0) if error.noise else 0.0
    return max(highest_of_noise, fastest_shake(mission, error))


def fastest_shake(mission: Mission, error: RandomError) -> float:
    """Highest frequency in the spectrum of a vibration, or of an oscillator phase due to vibration. [Hz]

    The result is 0 for any other error.
    """
    return max((piece.high for piece in _shake_pieces(mission, error)), default=0.0)


def slowest_shake(mission: Mission, error: RandomError) -> float:
    """Lowest frequency in the spectrum of a vibration, or of an oscillator phase due to vibration. [Hz]

    The result is 0 for any other error.
    """
    return min((piece.low for piece in _shake_pieces(mission, error)), default=0.0)


def _shake_pieces(mission: Mission, error: RandomError) -> tuple[PowerLawPiece, ...]:
    """Pieces of the phase spectrum that a vibration causes, directly or through an oscillator.

    The result is empty for any other error.
    """
    pieces_of = _SHAKES.get(f"{error.kind.name}.{error.subject.axis}")
    return () if pieces_of is None else pieces_of(mission, error.owner)


# Functions that give the phase spectrum caused by vibration, by kind and axis of error.
_SHAKES: Mapping[str, Callable[[Mission, str], tuple[PowerLawPiece, ...]]] = {
    "vibration.spectrum": pieces_of_vibration,
    "oscillator.acceleration": pieces_by_acceleration,
}


def oscillator_sinusoids(mission: Mission, name: str) -> tuple[PathSinusoid, ...]:
    """Sinusoidal motions of a platform that cause the same phases as the vibration tones of its oscillator.

    Only tones with at least one cycle per aperture are included; slower tones are drawn by `phase_courses`. A tone of
    the oscillator is a quarter of a cycle out of phase with the vibration that causes it.
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
    """Frequencies [Hz] and amplitudes of slow oscillator tones that remain after pulse exchanges.

    Pulse exchanges fold fast tones to low frequencies. `tones` contains a pair for each tone of the oscillator: its
    amplitude without exchanges, and the tones that remain after them. All amplitudes are for a unit error.
    """
    return [
        (float(frequency), free * float(share))
        for free, residual in tones
        for frequency, share in zip(residual.frequencies, residual.shares, strict=True)
        if frequency * aperture_time < SLOWEST_ECHO_CYCLES and share
    ]


class _TurnPhase:
    """Random oscillator phase due to slow vibration and turns of the platform, per unit of acceleration sensitivity.

    All directions of the sensitivity are equally likely, and so are all phases of a vibration tone. The standard
    deviation of the phase due to a turn equals the phase that the turn would cause if the sensitivity had the
    direction of the turn's acceleration.
    """

    def __init__(self, mission: Mission, name: str) -> None:
        self.scale, T = 2 * math.pi * mission.radar.center_frequency, mission.collection.aperture_time
        self.state = getattr(mission.platforms, name).state
        self.turns = not mission.has_direct_path and bool(flies_a_turn(mission, name))
        sync = mission.synchronization
        is_linked = sync is not None and sync.interval is not None  # lines are subtracted after drawing
        self.slow = [
            (tone.frequency, tone.free if is_linked else tone.free * tone.left.shares[0])
            for tone in accelerated_tones(mission)
            if tone.name == name and tone.frequency * T < SLOWEST_ECHO_CYCLES
        ]

    def draw(self, rng: np.random.Generator) -> Callable[[Floats], Floats]:
        """Draw a random phase. It is returned as a function that maps slow times [s] to phases [rad]."""
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
    """Times of pulse exchanges at a given interval, from before the first to after the last of `times`. [s]

    The time of the first exchange is random.
    """
    start = float(times.min()) - interval * float(rng.random())
    knots: Floats = np.arange(start, float(times.max()) + interval, interval)
    return knots


def _cosines_and_sines(frequency: Floats, times: Floats) -> tuple[Floats, Floats]:
    """Cosines and sines of tones with given frequencies at given times, each (times, tones)."""
    turn = 2 * math.pi * np.multiply.outer(times, frequency)
    return np.cos(turn), np.sin(turn)


def _phasors(turns: float, count: int) -> Complexes:
    """Phasors exp(2πi·n·turns) of the harmonics n = 1 … `count`, (count,).

    They are the values of the harmonics when the fundamental has completed `turns` cycles.
    """
    side = math.isqrt(count) + 1
    coarse = np.exp(2j * math.pi * turns * np.arange(side + 1) * side)
    phasors: Complexes = np.multiply.outer(coarse, np.exp(2j * math.pi * turns * np.arange(side))).ravel()
    return phasors[1 : count + 1]


Summed = TypeVar("Summed", np.float64, np.complex128)


def _folded(values: NDArray[Summed], count: int) -> NDArray[Summed]:
    """Add the values of all harmonics 1, 2 … that have the same alias among the harmonics 0 … count - 1, (count,).

    Harmonics with the same alias have equal values at `count` evenly spaced times of a period.
    """
    padded = np.zeros(-(-(values.size + 1) // count) * count, values.dtype)
    padded[1 : values.size + 1] = values
    folded: NDArray[Summed] = padded.reshape(-1, count).sum(axis=0)
    return folded


def fast_steps(least: int) -> int:
    """Number of samples for which an FFT is fast.

    It is at least `least`, and at most a sixteenth larger.
    """
    unit = 1 << max(0, least.bit_length() - 5)
    return -(-least // unit) * unit


def tones_at(amplitudes: Complexes, count: int) -> Floats:
    """Sum of the harmonics 1, 2 … at `count` evenly spaced times of a period, (count,).

    `amplitudes` holds the complex amplitudes of the harmonics. The first time is the start of the period.
    """
    sums: Floats = np.fft.ifft(_folded(amplitudes, count), norm="forward").real
    return sums


def powers_at(powers: Floats, count: int) -> Floats:
    """Powers of the harmonics 0 … count // 2 that replace harmonics 1, 2 … at `count` samples, (count // 2 + 1,).

    The replaced harmonics have random phases and the powers `powers`. The samples are evenly spaced over the period.
    The covariance of the samples is the same with the new harmonics. At sample n, harmonic k has the phase
    2πkn/count. The harmonic k + count has the same phase. The harmonic count − k has the opposite phase, which is
    equivalent if phases are random. The powers of such harmonics are therefore added.
    """
    folded = _folded(powers, count)
    one_sided: Floats = folded[: count // 2 + 1].copy()
    one_sided[1 : (count + 1) // 2] += folded[: count // 2 : -1]
    return one_sided


class _Tones:
    """Tones that represent a phase spectrum: fast tones in equal frequency steps, slow tones in finer steps.

    Fast tones are the harmonics of 1/`period`, where `period` [s] is by default four apertures. Slow tones have lower
    frequencies. Their frequency intervals have the edges `slow` [Hz], or are logarithmic if `slow` is None. A narrow
    piece of the spectrum, which would contain only a few fast tones, is represented by tones of its own; these follow
    the slow tones in the arrays. Noise at frequencies above the fast tones is independent at each time, with the
    standard deviation `rest` [rad].
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
        """Draw random amplitudes for the cosine and the sine of each slow tone, (2, draws, tones). [rad]

        The tones of narrow pieces of the spectrum are included.
        """
        drawn: Floats = rng.standard_normal((2, draws, self.slow.size)) * self.slow_size
        return drawn

    def slow_at(self, times: Floats, drawn: Floats) -> Floats:
        """Sum of the slow tones and the tones of narrow pieces of the spectrum at given times, (draws, times). [rad]

        `drawn` holds the amplitudes returned by `draw_slow`.
        """
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
        """Draw the sum of the fast tones and of the noise above them at evenly spaced times, (draws, times). [rad]

        The spacing of the times must divide the period of the tones evenly. If `later` [s] is given, the result is
        the change of the sum from each time t to t + `later`.
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
        """Draw the sum of all tones at evenly spaced times, (draws, times). [rad]

        If `later` [s] is given, the result is the change of the sum from each time t to t + `later`.
        """
        slow = self.draw_slow(draws, rng)
        sums = self.slow_at(times, slow)
        if later is not None:
            sums = self.slow_at(times + later, slow) - sums
        return sums + self.fast_at(times, draws, rng, later)


class _Setting:
    """Setting of a clock before the aperture, by a straight line fitted to its phase over an averaging time.

    The middle of the averaging time precedes mid-aperture by `age` [s]. Slow tones are the same in the averaging time
    and in the aperture. Tones are drawn separately for the averaging time if they are faster than one cycle in eight
    aperture times and complete more than two dozen cycles within `age`.
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
        """Evaluate the lines fitted to the clock phase over the averaging time, at times in the aperture. [rad]

        The result is (draws, times). `slow` holds the amplitudes of the slow tones, as drawn by `_Tones.draw_slow`.
        """
        lines = self.of_cosine @ slow[0].T + self.of_sine @ slow[1].T
        if self.fast is not None:
            lines += self.fit @ self.fast.at(self.window, slow.shape[1], rng).T
        lines_at_times: Floats = lines[0][:, None] + np.multiply.outer(lines[1], times + self.age)
        return lines_at_times


def clock_seconds(phase: Floats, wavelength_m: float) -> Floats:
    """Clock error that causes a given phase at the centre frequency. [s]

    `phase` is in radians.
    """
    return phase * wavelength_m / (2 * math.pi * SPEED_OF_LIGHT_MPS)
