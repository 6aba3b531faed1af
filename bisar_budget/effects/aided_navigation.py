"""Random position error of a platform whose inertial unit is aided by GNSS, and its effect on the image.

The position errors at different times are correlated. The correlation determines the effect on the image, because a
constant error only displaces the image, whereas a change of the error over the aperture defocuses it. The module
`navigation.smoother` computes the joint covariance of the errors over the aperture. This module projects the
covariance on the line of sight, which turns over the aperture.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from bisar_budget.arrays import Booleans, Floats, PerCase
from bisar_budget.constants import STANDARD_GRAVITY_MPS2
from bisar_budget.effects.effect import PLATFORMS, subject
from bisar_budget.effects.navigation_errors import body_axes_of
from bisar_budget.effects.random_effect import Moves, RandomEffect, RandomError, SensorCases, factor
from bisar_budget.geometry import PlatformState, norm
from bisar_budget.image_plane import LEGENDRE_LEADING
from bisar_budget.mission.model import Mission
from bisar_budget.mission.navigation import AIDED_IMU_FIGURES, Navigation, Outage
from bisar_budget.mission.platforms import FlownPath
from bisar_budget.navigation.error_state import (
    ACCELEROMETER_BIAS,
    GYRO_BIAS,
    HEADING,
    LEVEL_TILT,
    POSITION,
    VELOCITY,
    Fixes,
    InertialUnit,
)
from bisar_budget.navigation.smoother import AidedCovariance, FlightSteps, StartSigmas, aided_covariance
from bisar_budget.navigation.timeline import FixSchedule, Timeline, timeline_of
from bisar_budget.paths.earth import free_fall
from bisar_budget.paths.flight_history import FlightHistory

_TURNING_STEP_S = 0.1  # within which attitude and specific force may be taken as constant
_STRAIGHT_STEP_S = 1.0
_OUTER_TURNING_STEP_S = 0.25  # of a log, beyond the aperture
_SHORTEST_STEP_S = 1e-12
WHITE_SIGMA_RATIO = 3.0  # of the sigma of fixes with a correlation time to the sigma of their white part
MOST_ORDER_COUNT = 24  # Legendre orders of the position error; higher ones only spread power


@dataclass(frozen=True, kw_only=True)
class NavigationErrors:
    """Joint covariance of the position error of an aided navigation, and the errors of its state at mid-aperture.

    Attributes
    ----------
    covariance : AidedCovariance
        Joint covariance of the position error over the aperture in each case. It does not include `level`, the factor
        in decibels by which the mission file scales the error.
    """

    covariance: AidedCovariance

    def of(self, case: int) -> "NavigationErrors":
        """Select the errors of the case with the given index."""
        return NavigationErrors(covariance=self.covariance.at(np.array([case])))

    @property
    def has_fixes(self) -> bool:
        """Whether the flight has at least one position fix; for a single case."""
        return bool(self.covariance.fix_count[0])

    @property
    def at_middle(self) -> tuple[float, ...]:
        """Rms errors at mid-aperture of a single case, in the order of `findings.row.NavigationState`."""
        states = (POSITION, VELOCITY, LEVEL_TILT, HEADING, GYRO_BIAS, ACCELEROMETER_BIAS)
        return tuple(float(self.covariance.rms(state)[0]) for state in states)

    @property
    def remaining_start(self) -> tuple[float, str]:
        """Fraction of an error assumed at the start that remains at mid-aperture, and the name of this error.

        The fractions of the velocity error and of the tilt are compared, and the larger fraction is returned. The
        heading error is left out, because it cannot be estimated on a straight flight, where it has no effect.
        """
        start = StartSigmas(heading_rad=np.zeros(1))
        _, velocity, tilt, *_ = self.at_middle
        ratios = {"velocity": velocity / (3**0.5 * start.velocity_mps), "tilt": tilt / (2**0.5 * start.tilt_rad)}
        return max((ratio, name) for name, ratio in ratios.items())


def aided_navigation(seen: SensorCases, name: str) -> Iterator[RandomError]:
    """Yield the random error of a platform's aided navigation, or nothing if the file states no such navigation.

    The size of the error is a factor on the position error that follows from the file; the declared size is this
    error itself, with the factor 1. The unit is nevertheless dB, because the row shows the factor in decibels.
    """
    error = seen.error(name)
    navigation = error.navigation
    if navigation is None:
        return
    count, errors = len(seen.exact.times), navigation_errors(seen, name)
    covariance = errors.covariance
    amplitude: PerCase = 10 ** (navigation.level / 20)
    platform_index, slow_times = PLATFORMS.index(name), seen.exact.sampling.places
    axes = np.eye(3)[:, :, None, None] * np.ones((1, 1, count, seen.cases))
    along = seen.range_errors(platform_index, axes)  # range error per metre east, north and up, (3, nodes, cases)
    at_nodes = np.asarray(np.polynomial.legendre.legvander(slow_times, covariance.order_count - 1), np.float64)
    effects = (
        _published(seen, platform_index, covariance),
        _in_full_model(seen, covariance, along, at_nodes),
    )
    published, full = (_times(effect, amplitude) for effect in effects)
    moves: tuple[Moves, ...] = ()
    if seen.has_edge:
        ways = np.einsum("no,aokc->kanc", at_nodes, _courses(covariance)) * amplitude
        moves = (Moves(platform_index, ways, np.ones((1, count, 1))),)
    yield RandomError(
        subject=subject(name, "navigation"),
        unit="dB",
        declared=np.ones(seen.cases) * seen.factor,
        path=("platforms", name, "motion_error", "navigation"),
        published=published,
        full=full,
        moves=moves,
        navigation=errors,
    )


def _times(effect: RandomEffect, amplitude: PerCase) -> RandomEffect:
    """Multiply an effect, including its spread phase, by the amplitude factor that the file states as a level."""
    return effect.times(amplitude)._replace(spread=effect.spread * amplitude)


def _in_full_model(seen: SensorCases, covariance: AidedCovariance, along: Floats, at_nodes: Floats) -> RandomEffect:
    """Effect of the position error in the full model.

    `along` (3, nodes, cases) [m/m] is the range error per metre of position error east, north and up. `at_nodes`
    (nodes, orders) are the values of the Legendre polynomials at the nodes of the aperture.
    """
    moved = np.einsum("no,oapbc,mp->nambc", at_nodes, covariance.of_orders, at_nodes, optimize=True)
    of_range = np.einsum("anc,nambc,bmc->nmc", along, moved, along, optimize=True)
    beyond = np.einsum("anc,abc,bnc->nc", along, covariance.beyond, along, optimize=True)
    return seen.of_process(of_range, seen.exact.fit[0] @ beyond)


def _published(seen: SensorCases, platform_index: int, covariance: AidedCovariance) -> RandomEffect:
    """Effect of the position error in the published model, along the line of sight at mid-aperture."""
    look = seen.vector(seen.geometry.both[platform_index].look)
    count, k = LEGENDRE_LEADING.size, seen.exact.k
    of_range = np.einsum("ac,oapbc,bc->opc", look, covariance.of_orders, look)
    constant, linear, quadratic, cubic = np.maximum(
        np.einsum("ooc->oc", of_range[:count, :count]) * np.square(LEGENDRE_LEADING)[:, None], 0.0
    )
    both = of_range[0, 1]
    scaled = 1 / (2 * np.arange(len(of_range)) + 1.0)
    resolved = np.einsum("ooc,o->c", of_range[count:, count:], scaled[count:])
    beyond = resolved + np.einsum("ac,abc,bc->c", look, covariance.beyond, look)
    spread = k * np.sqrt(np.maximum(beyond, 0.0)) / seen.factor
    return RandomEffect(k * np.sqrt(quadratic), k * np.sqrt(cubic), spread, *seen.moved(constant, linear, both))


def _courses(covariance: AidedCovariance) -> Floats:
    """Legendre coefficients of independent position errors that together have the given joint covariance. [m]

    The result is (3, orders, errors, cases). If each error is multiplied by an independent random number of variance
    1, the sum of all errors has this covariance.
    """
    orders, axes, _, _, cases = covariance.of_orders.shape
    flat = np.moveaxis(covariance.of_orders.reshape(orders * axes, orders * axes, cases), -1, 0)
    return np.transpose(factor(flat).reshape(cases, orders, axes, -1), (2, 1, 3, 0))


# ---------------------------------------------------------------------- from a mission to the covariance
def navigation_errors(seen: SensorCases, name: str) -> NavigationErrors:
    """Joint covariance of the position error of a platform's aided navigation in each case.

    For cases with the same navigation and the same path, the covariance is computed only once.
    """
    navigation = seen.error(name).navigation
    assert navigation is not None
    inputs = _inputs(seen, name, navigation)
    numbers = np.concatenate(
        [array.reshape(-1, seen.cases) for array in (*inputs.values(), _path_numbers(seen, name))]
    )
    _, index, group = np.unique(numbers, axis=1, return_index=True, return_inverse=True)
    chosen = {key: array[..., index] for key, array in inputs.items()}
    state: PlatformState = getattr(seen.geometry, name).of(index)
    count = min(len(seen.exact.times), MOST_ORDER_COUNT)
    return NavigationErrors(
        covariance=_covariance(seen.mission, name, navigation, chosen, state, count).at(group.ravel())
    )


def _inputs(seen: SensorCases, name: str, navigation: Navigation) -> dict[str, Floats]:
    """Collect the numbers that describe an aided navigation in each case, as arrays (..., cases)."""
    imu, gnss = navigation.imu, navigation.gnss
    scalars = {
        "half": seen.aperture_time / 2,
        "before": navigation.before,
        "after": navigation.after_s,
        "rate": gnss.rate,
        "heading": navigation.heading,
        "correlation_time": math.inf if gnss.correlation_time is None else gnss.correlation_time,
    }
    vectors = {figure: getattr(imu, figure) or (0.0, 0.0, 0.0) for figure in AIDED_IMU_FIGURES}
    vectors |= {"position": gnss.position, "velocity": gnss.velocity or (math.inf, math.inf, math.inf)}
    inputs = {key: np.broadcast_to(np.asarray(value, dtype=float), (seen.cases,)) for key, value in scalars.items()}
    inputs |= {key: seen.vector(value) for key, value in vectors.items()}
    outages = [np.broadcast_to(end, (seen.cases,)) for outage in navigation.outages for end in outage]
    inputs["outages"] = np.array(outages).reshape(-1, seen.cases)
    lever = seen.error(name).lever_arm
    inputs["arm"] = seen.vector((0.0, 0.0, 0.0) if lever is None or lever.arm is None else lever.arm)
    return inputs


def _path_numbers(seen: SensorCases, name: str) -> Floats:
    """Numbers that determine the path of a platform in each case, (numbers, cases).

    If the path consists of several pieces, the paths of all cases count as different.
    """
    state: PlatformState = getattr(seen.geometry, name)
    vectors = [seen.vector(vector) for vector in (state.position, state.velocity, state.acceleration, *state.bends)]
    if state.curve is not None:
        vectors.append(np.arange(float(seen.cases))[None])
    return np.concatenate(vectors)


def _covariance(
    mission: Mission,
    name: str,
    navigation: Navigation,
    inputs: Mapping[str, Floats],
    state: PlatformState,
    order_count: int,
) -> AidedCovariance:
    """Joint covariance of the position error in each of several cases.

    `inputs` holds the numbers that `_inputs` returns, and `state` the paths of the platform in the same cases.
    """
    half, is_smoothed = inputs["half"], navigation.is_smoothed
    turns = np.broadcast_to(_turns(state), half.shape)
    timeline = timeline_of([
        fix_schedule(
            navigation._replace(
                before=inputs["before"][case],
                after=inputs["after"][case] if is_smoothed else None,
                gnss=navigation.gnss._replace(rate=inputs["rate"][case]),
                outages=tuple(Outage(start, end) for start, end in inputs["outages"][:, case].reshape(-1, 2)),
            ),
            half[case],
            turns=bool(turns[case]),
            turns_outside=history_of(mission, name) is not None,
        )
        for case in range(half.size)
    ])  # fmt: skip
    arm = inputs["arm"]
    flight = flight_of(mission, name, state, half, timeline, arm if np.any(arm) else None)
    figures = {figure: inputs[figure].T for figure in AIDED_IMU_FIGURES}
    scale = np.zeros_like(figures["accelerometer_bias"])
    scale[:, 2] = figures["accelerometer_scale_factor"][:, 2] * STANDARD_GRAVITY_MPS2
    unit = InertialUnit(
        accelerometer_bias_mps2=figures["accelerometer_bias"],
        first_accelerometer_bias_mps2=np.hypot(figures["accelerometer_bias"], scale),
        gyro_bias_radps=figures["gyro_bias"],
        velocity_random_walk=figures["velocity_random_walk"],
        angle_random_walk=figures["angle_random_walk"],
    )
    position, correlation_time = inputs["position"].T, inputs["correlation_time"]
    wanders = np.isfinite(correlation_time)[:, None]
    fixes = Fixes(
        position_m=np.where(wanders, position / WHITE_SIGMA_RATIO, position),
        velocity_mps=inputs["velocity"].T,
        wander_m=np.where(wanders, position, 0.0),
        wander_time_s=correlation_time,
    )
    start = StartSigmas(heading_rad=inputs["heading"])
    return aided_covariance(
        timeline, flight, unit, fixes, start, half, order_count=order_count, is_smoothed=is_smoothed
    )


def history_of(mission: Mission, name: str) -> FlightHistory | None:
    """Velocity of a platform beyond the aperture, from the log of its path; None without a log."""
    path: FlownPath | None = getattr(mission.platforms, name).path
    return None if path is None else path.history


def fix_schedule(
    navigation: Navigation, half: float, *, turns: bool = True, turns_outside: bool = False
) -> FixSchedule:
    """Schedule of the position fixes of an aided navigation in a single case.

    `half` [s] is half the aperture time. `turns` is true if the path turns within the aperture, and `turns_outside`
    is true if it turns outside the aperture.
    """
    return FixSchedule(
        half_s=half,
        before_s=navigation.before,
        after_s=float(navigation.after_s),
        rate_hz=navigation.gnss.rate,
        outages=navigation.outages,
        turning_step_s=_TURNING_STEP_S if turns else _STRAIGHT_STEP_S,
        outer_step_s=_OUTER_TURNING_STEP_S if turns_outside else _STRAIGHT_STEP_S,
        is_smoothed=navigation.is_smoothed,
    )


def _turns(state: PlatformState) -> Booleans:
    """Whether a platform turns or changes its speed in each case.

    The result is an array (cases,), or a single value that holds for all cases.
    """
    bends = [np.abs(component) for vector in (state.acceleration, *state.bends) for component in vector]
    return np.asarray(sum(bends) > 0) | (state.curve is not None)


def flight_of(
    mission: Mission, name: str, state: PlatformState, half: Floats, timeline: Timeline, arm: Floats | None
) -> FlightSteps:
    """Attitude and specific force of a platform between the moments of a timeline.

    Outside the aperture, the platform has the velocity in its log. Without a log, it has the constant velocity with
    which it enters or leaves the aperture; a platform in free fall continues to fall. Gravity has its value at
    mid-aperture, and points down along the vertical axis of the scene, because a navigation turns its level axes with
    the Earth's curvature.

    Parameters
    ----------
    mission : Mission
        Mission whose scene defines the axes of the result.
    name : str
        Name of the platform.
    state : PlatformState
        Path of the platform in each case.
    half : (cases,)
        Half the aperture time. [s]
    timeline : Timeline
        Moments of the flight.
    arm : (3, cases), optional
        Lever arm along the axes of the body. [m]
    """
    history = history_of(mission, name)
    falling = 0.0 if state.fall is None else state.fall.share
    moments, middles = timeline.times, timeline.middles
    velocity, middle_velocity = (
        _velocities(mission, state, half, times, falling, history) for times in (moments, middles)
    )
    steps = np.maximum(timeline.steps, _SHORTEST_STEP_S)  # steps of no duration only pad the columns
    acceleration = np.diff(velocity, axis=1) / steps
    acceleration[2] += norm(free_fall(state.position, state.velocity, mission.scene.axes))
    force = acceleration * (1 - np.asarray(falling))
    axes = body_axes_of(middle_velocity, state.is_still)
    of_arm = None
    if arm is not None:
        of_arm = np.einsum("bc,bamc->mca", arm, body_axes_of(velocity, state.is_still))
    return FlightSteps(body=np.transpose(axes, (2, 3, 1, 0)), force=np.transpose(force, (1, 2, 0)), arm=of_arm)


def _velocities(
    mission: Mission,
    state: PlatformState,
    half: Floats,
    times: Floats,
    falling: PerCase,
    history: FlightHistory | None,
) -> Floats:
    """Velocities of a platform at slow times within and outside the aperture, (3, *times.shape). [m/s]

    `falling` is 1 for a platform in free fall, and 0 otherwise. `history` is the velocity in the log, if there is a
    log.
    """
    inside = np.clip(times, -half, half)
    position, velocity = (np.array(np.broadcast_arrays(*vector, inside)[:3]) for vector in state.at(inside))
    if history is not None:
        return np.where(times == inside, velocity, history.at(times))
    fallen = np.array(np.broadcast_arrays(*free_fall(tuple(position), tuple(velocity), mission.scene.axes)))
    return np.asarray(velocity + fallen * falling * (times - inside))
