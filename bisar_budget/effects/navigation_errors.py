"""Random navigation errors: errors of inertial sensors, errors of lever arms, and position noise.

A bias of an inertial sensor is a constant error over the aperture. Noise is an independent error at every moment. The
motion errors that both cause are zero at mid-aperture, because the mission separately declares the position and
velocity errors that remain at that moment after aiding. A tilt also rotates the lever arm, if the file states an arm.
An attitude error rotates the arm over the whole aperture, mid-aperture included.

A lever arm leads from the reference point of the navigation to the antenna's phase centre, in axes that turn with the
body. At every moment of the aperture, these axes are along the velocity, across it, and up; for a platform at rest
they are the scene's axes. The antenna's position is the position of the reference point plus R(τ)·l, where l is the
arm and R the rotation of the body. An error δl of the arm turns with the body, R(τ)·δl. It displaces the image, and
defocuses it if the body turns. An attitude error ψ moves the antenna by ψ × R(τ)·l. The error ψ keeps its direction
in space, like the attitude error of a strapdown system with perfect gyros; this also holds where ψ acts on the
specific force. A gyro bias ε makes the error grow as ψ = ε·τ; gyro noise makes it a random walk.

The same ψ acts through the specific force and through the arm, so the row for an error of an inertial sensor includes
both effects. A further row shows the effect of attitude through the arm alone; it is not included in any sum. These
relations are derived here, not taken from a publication.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from itertools import product
from typing import NamedTuple

import numpy as np

from bisar_budget import evaluators
from bisar_budget.arrays import Floats, PerCase, PerCaseFlag
from bisar_budget.effects.effect import PLATFORMS, Subject, subject
from bisar_budget.effects.random_effect import (
    Moves,
    RandomEffect,
    RandomError,
    SensorCases,
    factor,
    parts_of_largest,
)
from bisar_budget.effects.spectra import gauss_markov
from bisar_budget.error_kinds.random_kinds import (
    IMU_KIND,
    INERTIAL_FIGURES,
    LEVER_ARM_KIND,
    RANDOM_KIND,
    TRAJECTORY_KIND,
    InertialFigure,
)
from bisar_budget.faults import KeyPath
from bisar_budget.geometry import PlatformState, Vectors, cross, unit, without_rounding
from bisar_budget.image_plane import nodes
from bisar_budget.mission.instruments import GaussMarkov, LeverArm
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import RAW, CommonMotionError, FlownPath, LogNoise, MotionError

_CONSTANT_S = 1e9  # correlation time of an error that is constant over any aperture
_UNIFORM_SIGMA_RATIO = 12**-0.5  # ratio of sigma to step for an error that is uniformly distributed over the step


# ---------------------------------------------------------------------- correlated noise of a position
def process_of(mission: Mission, error: RandomError) -> GaussMarkov:
    """Gauss–Markov process of an error that is correlated position noise; its axes are given by `process_axes`."""
    return _PROCESSES[error.kind.name](mission, error)[0]


def process_axes(mission: Mission, error: RandomError) -> dict[str, Floats]:
    """Axes (3, 3) along which correlated position noise moves each platform, by the name of the platform."""
    return _PROCESSES[error.kind.name](mission, error)[1]


def _declared_process(mission: Mission, error: RandomError) -> tuple[GaussMarkov, dict[str, Floats]]:
    """Process that the file declares for a platform or for both platforms, and its axes on each platform.

    The axes are returned as a mapping from the name of the platform to an array (3, 3).
    """
    motion: MotionError | CommonMotionError | None = mission.common_motion_error
    names: tuple[str, ...] = PLATFORMS
    if error.owner in PLATFORMS:
        motion, names = getattr(mission.platforms, error.owner).motion_error, (error.owner,)
    assert motion is not None
    process = next(process for process in motion.random if process.name == error.subject.axis)
    return process, {name: np.array(getattr(mission.platforms, name).state.frame(motion.frame)) for name in names}


def _log_process(mission: Mission, error: RandomError) -> tuple[GaussMarkov, dict[str, Floats]]:
    """Gauss–Markov process for the noise of a trajectory log in a single case, and its axes on the platform.

    The axes are returned as a mapping from the name of the platform to an array (3, 3). The processor must use the
    fixes of the log without smoothing.
    """
    path: FlownPath | None = getattr(mission.platforms, error.owner).path
    assert path is not None
    assert path.log_noise is not None
    figure = error.subject.axis
    sizes, axes, correlation_time = _log_parts(path.log_noise, 1)[figure]
    x, y, z = sizes[:, 0].tolist()
    process = GaussMarkov(figure, (x, y, z), float(np.ravel(correlation_time)[0]))
    return process, {error.owner: axes[:, :, 0]}


# Functions, by kind of correlated noise, that give its process and the axes of the process on each platform.
_PROCESSES: Mapping[str, Callable[[Mission, RandomError], tuple[GaussMarkov, dict[str, Floats]]]] = {
    "random": _declared_process,
    "trajectory": _log_process,
}


# ---------------------------------------------------------------------- inertial sensors
def specific_force(mission: Mission, state: PlatformState) -> Vectors:
    """Specific force of a platform, f = a − g, in the axes of the scene. [m/s²]

    Accelerometers measure this force. It is zero in free fall. On the Earth, g includes the terms of the Earth's
    rotation (`earth.free_fall`).
    """
    from bisar_budget.paths.earth import free_fall  # the import takes 8 ms, and most missions name no sensor

    x, y, z = state.acceleration
    u, v, w = free_fall(state.position, state.velocity, mission.scene.axes)
    return (x - u, y - v, z - w)


def acceleration_errors(figure: InertialFigure, axes: Floats, force: Floats) -> Floats:
    """Acceleration error per unit of a sensor error about or along each axis, (axes, 3, ...). [m/s²/unit]

    `axes` (axes, 3, ...) are the unit vectors of the axes. `force` (3, ...) [m/s²] is the specific force. A tilt
    about an axis rotates the specific force. A scale factor error adds a fraction of the component of the specific
    force along the axis. Any other sensor error is an acceleration along the axis.
    """
    if figure.tilts:
        return np.asarray(np.cross(axes, force, axisa=1, axisb=0, axisc=1))
    if figure.is_scale:
        return np.asarray(axes * (axes * force).sum(axis=1, keepdims=True))
    return axes


def inertial_errors(seen: SensorCases, name: str) -> Iterator[RandomError]:
    """Yield the errors of a platform's inertial sensor, declared or not; nothing if the platform has no sensor."""
    error = seen.error(name)
    if error.imu is None:
        return
    axes, platform_index, state = seen.axes(name), PLATFORMS.index(name), getattr(seen.geometry, name)
    stated = None if error.lever_arm is None else error.lever_arm.arm
    arm = None if stated is None else arm_at(state, stated, seen.exact.times)
    force = seen.vector(specific_force(seen.mission, state))
    for index, figure in enumerate(INERTIAL_FIGURES.values()):
        values, path = getattr(error.imu, figure.key), IMU_KIND.path(name, figure.key)
        if error.is_of_part(figure.key):
            path = _path_of_sensor(name)
        declared, about = None, axes
        directions = acceleration_errors(figure, axes, force)
        if values is not None:
            declared, sizes = parts_of_largest(seen.vector(values))
            directions, about = directions * sizes[:, None], axes * sizes[:, None]
        along = seen.along(name, directions)
        row = _at_mid_aperture(seen.mission, index, along)
        if arm is not None and figure.tilts:
            published, full = _with_arm(seen, platform_index, figure, directions, about, arm)
        else:
            published = RandomEffect(row[0], row[1], row[2] / seen.factor, *_moved_by_imu(seen, figure, along))
            full = _over_aperture(seen, platform_index, figure, directions)
        yield RandomError(
            subject=subject(name, IMU_KIND.name, figure.key),
            unit=figure.unit,
            declared=None if declared is None else declared * seen.factor,
            path=path,
            published=published,
            full=full,
            spreads=figure.spreads,
            moves=_moves_by_imu(seen, platform_index, figure, directions, about, arm) if seen.has_edge else (),
        )


def _path_of_sensor(name: str) -> KeyPath:
    """Path of the key `sensor`, which names the catalogue parts from which a platform's motion error is taken."""
    return (*IMU_KIND.section(name)[:-1], "sensor")


def _moves_by_imu(
    seen: SensorCases,
    platform_index: int,
    figure: InertialFigure,
    directions: Floats,
    about: Floats,
    arm: Floats | None,
) -> tuple[Moves, ...]:
    """Motion of a platform per unit of a sensor error, due to the acceleration error and to the lever arm.

    `directions` (axes, 3, cases) [m/s²/unit] is the acceleration error per unit about or along each axis. `about`
    (axes, 3, cases) are the axes of the sensor error. `arm` (3, nodes, cases) is the lever arm [m]; None if the file
    states no arm.
    """
    ways, half = directions[:, :, None], seen.exact.half
    if arm is None or not figure.tilts:
        courses = _courses(figure, len(seen.exact.times))
        return (Moves(platform_index, ways, courses[..., None] * half ** (figure.growth_power / 2)),)
    swings = swung(about, arm)
    if not figure.spreads:
        grows, swing = figure.course(seen.exact.times), figure.tilt_course(seen.exact.times)
        return Moves(platform_index, ways, grows[None]), Moves(platform_index, swings, swing[None])
    twice, once = _courses_of_both_walks(len(seen.exact.times))
    return Moves(platform_index, ways, twice[..., None] * half**2.5), Moves(
        platform_index, swings, once[..., None] * half**0.5
    )


# The evaluators accept and return numbers, or arrays of cases.
_inertial_phases: Callable[..., tuple[tuple[PerCase, ...], ...]] = evaluators.inertial_phases


def _at_mid_aperture(mission: Mission, index: int, along: PerCase) -> tuple[PerCase, ...]:
    """Quadratic, cubic and higher-order phase due to one unit of a sensor error, in the published model. [rad/unit]

    `index` is the index of the sensor error in `INERTIAL_FIGURES`. `along` [m/s²/unit] is the acceleration error per
    unit along the line of sight at mid-aperture.
    """
    wavelength, T = mission.radar.wavelength, mission.collection.aperture_time
    return _inertial_phases(along, along, along, wavelength, T)[index]


def _moved_by_imu(seen: SensorCases, figure: InertialFigure, along: Floats) -> tuple[PerCase, PerCase]:
    """Sigmas of the displacement, east and north, per unit of a sensor error, in the published model. [m/unit]

    `along` [m/s²/unit] is the acceleration error per unit along the line of sight at mid-aperture.
    """
    fit = seen.exact.fit[:2]
    if figure.spreads:
        orders = fit @ _walk_of(figure, len(seen.exact.times)).at_nodes @ fit.T
        constant, linear = np.diagonal(orders)
    else:
        constant, linear = np.square(fit @ _courses(figure, len(seen.exact.times))[0])
    scale = along**2 * seen.exact.half**figure.growth_power
    return seen.moved(constant * scale, linear * scale)


def _over_aperture(
    seen: SensorCases, platform_index: int, figure: InertialFigure, directions: Floats
) -> RandomEffect:
    """Effect of one unit of a sensor error in the full model, along the exact paths.

    `directions` (axes, 3, cases) [m/s²/unit] is the acceleration error due to one unit on each axis. The motion error
    is computed for an aperture of 2 s. Its square is then scaled by a power of half the aperture time.
    """
    count, along = len(seen.exact.times), seen.range_errors(platform_index, directions[:, :, None])
    scale = seen.exact.half**figure.growth_power
    if not figure.spreads:
        courses = along * (_courses(figure, count)[0, :, None] * np.sqrt(scale))
        return seen.of_courses(courses, courses)[1]
    walk = _walk_of(figure, count)
    covariance = np.einsum("anc,amc->nmc", along, along) * walk.at_nodes[..., None] * scale
    power = seen.exact.fit[0] @ np.square(along).sum(axis=0)
    return seen.of_process(covariance, power * walk.beyond * scale)


def _walk_of(figure: InertialFigure, count: int) -> "_Walks":
    """Covariance of the position error that the noise of a sensor causes.

    The position error is a repeated integral of white noise. The noise is a white acceleration, or a white tilt rate;
    in the second case the tilt rotates the specific force. `count` is the number of nodes.
    """
    return _walks(figure.integrals - 1, figure.integrals - 1, count)


@cache
def _courses(figure: InertialFigure, count: int) -> Floats:
    """Independent components of the position error along an axis over an aperture of 2 s, (courses, nodes).

    For noise they are the components of the position error due to noise of unit density. Any other sensor error has a
    single component. It is the motion due to an acceleration of 1 m/s², or, for a gyro bias, due to an acceleration
    that grows by 1 m/s² per second. All components are zero at mid-aperture.
    """
    if figure.spreads:
        return factor(_walk_of(figure, count).at_nodes).T
    return figure.course(nodes(count).places)[None]


# ---------------------------------------------------------------------- lever arms
def body_axes(state: PlatformState, times: Floats) -> Floats:
    """Body axes of a platform at slow times [s], as unit vectors in the axes of the scene, (axes, 3, *times.shape).

    The axes are along the velocity, across it to the left, and up. For a platform at rest they are the axes of the
    scene.
    """
    velocity = np.array([np.broadcast_to(component, times.shape) for component in state.at(times)[1]])
    return body_axes_of(velocity, state.is_still)


def body_axes_of(velocity: Floats, is_still: PerCaseFlag) -> Floats:
    """Body axes at velocities (3, ...) [m/s], as unit vectors in the axes of the scene, (axes, 3, ...).

    `is_still` marks the cases of a platform at rest.
    """
    u, v, w = velocity
    if np.any(is_still):
        u, v, w = (np.where(is_still, *both) for both in ((1.0, u), (0.0, v), (0.0, w)))
    with np.errstate(all="ignore"):
        along = without_rounding(unit((u, v, w)))
        leftward = without_rounding(unit((-v, u, 0.0 * w)))
    return np.array((along, leftward, cross(along, leftward)))


def arm_at(state: PlatformState, arm: Vectors, times: Floats) -> Floats:
    """Lever arm at slow times [s] in the axes of the scene, (3, *times.shape). [m]

    `arm` [m] has the components of the lever arm along the body axes.
    """
    return np.asarray(sum(length * axis for length, axis in zip(arm, body_axes(state, times), strict=True)))


def swung(axes: Floats, arm: Floats) -> Floats:
    """Displacement of the antenna due to a unit tilt about each of several axes, (axes, 3, times, cases). [m/rad]

    The lever arm is (3, times, cases) [m], and the axes are (axes, 3, cases).
    """
    about = (axes[:, 0, None], axes[:, 1, None], axes[:, 2, None])
    return np.stack(cross(about, (arm[0], arm[1], arm[2])), axis=1)


def lever_arm_errors(seen: SensorCases, name: str) -> Iterator[RandomError]:
    """Yield the errors of a platform's lever arm; no errors if the file states no lever arm.

    They are the effect of declared and undeclared attitude errors through the arm, and the declared uncertainty of
    the arm. The row of an aided navigation includes the effect of its attitude errors through the arm.
    """
    error = seen.error(name)
    lever: LeverArm | None = error.lever_arm
    if lever is None:
        return
    platform_index, state, times = PLATFORMS.index(name), getattr(seen.geometry, name), seen.exact.times
    if lever.arm is not None and error.navigation is None:  # which includes the swing of the arm
        declared, axes = None, seen.axes(name)
        attitude = None if error.imu is None else error.imu.attitude
        if attitude is not None:
            declared, sizes = parts_of_largest(seen.vector(attitude))
            declared, axes = declared * seen.factor, axes * sizes[:, None]
        published, full = seen.of_motion(platform_index, swung(axes, arm_at(state, lever.arm, times)))
        path = _path_of_sensor(name) if error.is_of_part("attitude") else LEVER_ARM_KIND.path(name, "attitude")
        row_subject, unit = subject(name, LEVER_ARM_KIND.name, "attitude"), LEVER_ARM_KIND.size("attitude").unit
        counted = subject(name, IMU_KIND.name, "attitude").id
        yield RandomError(row_subject, unit, declared, path, published, full, spreads=False, counted_in=counted)
    if lever.uncertainty is not None:
        declared, sizes = parts_of_largest(seen.vector(lever.uncertainty))
        ways = body_axes(state, times) * sizes[:, None, None]
        published, full = seen.of_motion(platform_index, ways)
        axis = "uncertainty"
        moves = (Moves(platform_index, ways, np.ones((1, len(times), 1))),)
        yield RandomError(
            subject(name, LEVER_ARM_KIND.name, axis),
            LEVER_ARM_KIND.size(axis).unit,
            declared * seen.factor,
            LEVER_ARM_KIND.path(name, axis),
            published,
            full,
            spreads=False,
            moves=moves,
        )


def _with_arm(
    seen: SensorCases, platform_index: int, figure: InertialFigure, directions: Floats, about: Floats, arm: Floats
) -> tuple[RandomEffect, RandomEffect]:
    """Effects, in both models, of one unit of tilt, tilt rate or tilt noise on a platform with a lever arm.

    The tilt is about the axes `about`, (axes, 3, cases). `directions` (axes, 3, cases) [m/s²/unit] is the
    acceleration error due to the tilt of the specific force. `arm` (3, nodes, cases) [m] is the lever arm at the
    nodes over the aperture. The effect in the published model is returned first.
    """
    state, times = seen.geometry.both[platform_index], seen.exact.times
    swings = swung(about, arm)
    if not figure.spreads:
        moved = directions[:, :, None] * figure.course(times) + swings * figure.tilt_course(times)
        return seen.of_motion(platform_index, moved)
    # The tilt is a random walk. Its double integral is also a position error. Both follow from the same noise.
    along = [seen.range_errors(platform_index, way) for way in (directions[:, :, None], swings)]
    stated = seen.error(PLATFORMS[platform_index]).lever_arm
    assert stated is not None
    assert stated.arm is not None
    at_middle = swung(about, arm_at(state, stated.arm, np.zeros((1, seen.cases))))[:, :, 0]
    at_mid_aperture = [np.einsum("ac,eac->ec", seen.vector(state.look), way) for way in (directions, at_middle)]
    fit, half, k, count = seen.exact.fit, seen.exact.half, seen.exact.k, len(times)
    covariance, beyond, orders, beyond_cubic = (np.zeros(()) for _ in range(4))
    for (i, a), (j, b) in product(enumerate((2, 0)), repeat=2):  # integrals of the tilt: double for the force
        walk, scale = _walks(a, b, count), half ** (a + b + 1)
        moved = np.einsum("anc,amc->nmc", along[i], along[j])
        covariance = covariance + scale * walk.at_nodes[..., None] * moved
        beyond = beyond + scale * walk.beyond * (fit[0] @ np.einsum("nnc->nc", moved))
        power = scale * (at_mid_aperture[i] * at_mid_aperture[j]).sum(axis=0)
        orders = orders + np.diagonal(fit @ walk.at_nodes @ fit.T)[:, None] * power
        beyond_cubic = beyond_cubic + walk.left * power
    constant, linear, quadratic_power, cubic_power = np.maximum(orders, 0.0)
    # The declared size includes the coverage factor, which does not apply to the spread, a mean power.
    spread = k * np.sqrt(np.maximum(beyond_cubic, 0.0)) / seen.factor
    published = RandomEffect(
        k * np.sqrt(quadratic_power), k * np.sqrt(cubic_power), spread, *seen.moved(constant, linear)
    )
    return published, seen.of_process(np.asarray(covariance), beyond)


class _Walks(NamedTuple):
    """Covariance of two repeated integrals of the same white noise of density 1, over an aperture of 2 s.

    The noise is integrated once or several times, see `_walks`. Both integrals start at mid-aperture and run forward
    and backward in time. `at_nodes` (nodes, nodes) is the covariance of the first integral with the second at the
    nodes over the aperture, limited to the Legendre orders that the nodes can distinguish. `left` is the expected
    product of the two integrals, averaged over the aperture, after Legendre orders 0 to 3 are removed from both.
    `beyond` is the same average after every order that the nodes can distinguish is removed.
    """

    at_nodes: Floats
    left: float
    beyond: float


@cache
def _walks(first: int, second: int, count: int) -> _Walks:
    """Covariance of white noise integrated `first` + 1 times with the same noise integrated `second` + 1 times.

    `count` is the number of nodes. The value 0 for `first` or `second` means a random walk: noise integrated once.
    """
    gauss_nodes, weights = np.polynomial.legendre.leggauss(2 * count)
    start, weight = (1 + gauss_nodes) / 2, weights / 2  # on one side of the middle
    number = np.arange(count)

    def order_of(times: int) -> Floats:
        """Legendre coefficients of unit impulses that are integrated `times` + 1 times, (count, starts).

        Each column is for one start time of the impulse.
        """
        ahead = start[:, None] + (1 - start[:, None]) * start
        grown = ((ahead - start[:, None]) ** times / math.factorial(times)) * weight * (1 - start[:, None])
        return np.asarray((2 * number[:, None] + 1) / 2 * np.einsum("snp,sn->ps", _legendre(ahead, count), grown))

    both = np.einsum("is,js,s->ij", order_of(first), order_of(second), weight)
    both = both * (1 + (-1.0) ** np.add.outer(number, number))  # the second side adds as much
    mean = 1 / ((first + second + 2) * (first + second + 1) * math.factorial(first) * math.factorial(second))
    at_nodes = _legendre(nodes(count).places, count)
    powers = np.diagonal(both) / (2 * number + 1)
    left, beyond = (max(mean - float(powers[:orders].sum()), 0.0) for orders in (4, count))
    return _Walks(at_nodes @ both @ at_nodes.T, left, beyond)


@cache
def _courses_of_both_walks(count: int) -> tuple[Floats, Floats]:
    """Independent components of a tilt that is a random walk, and of its double integral, over an aperture of 2 s.

    Returns two arrays (courses, nodes): the components of the double integral, and the components of the tilt. Row i
    of both arrays follows from the same noise.
    """
    both = np.block([[_walks(a, b, count).at_nodes for b in (2, 0)] for a in (2, 0)])
    twice, once = np.split(factor(both).T, 2, axis=1)
    return twice, once


def _legendre(abscissas: Floats, count: int) -> Floats:
    return np.asarray(np.polynomial.legendre.legvander(abscissas, count - 1))


# ---------------------------------------------------------------------- position noise
def position_noise(seen: SensorCases, name: str) -> Iterator[RandomError]:
    """Yield an error for each process of correlated noise that the file states for a platform's position."""
    error, kind = seen.error(name), RANDOM_KIND
    for index, process in enumerate(error.random):
        path = _path_of_sensor(name) if error.is_of_part(kind.name) else kind.path(name, index=index)
        yield _noise(seen, _Process.of(process, name), {name: seen.axes(name)}, path)


def residual_subject(name: str) -> Subject:
    """Subject of the error due to the residuals of a platform's log about the smooth path fitted to it."""
    return subject(name, TRAJECTORY_KIND.name, "residual")


def log_noise(seen: SensorCases, name: str) -> Iterator[RandomError]:
    """Yield the noise of a platform's log if the processor uses its fixes without smoothing; otherwise nothing.

    A Gauss–Markov process represents the residual of the fixes about the smooth path. It has the covariance and the
    correlation time of the residual. Independent fixes that are joined by straight lines are correlated over half an
    interval. As with any noise, the low Legendre orders of the process displace and defocus the image, and its higher
    orders spread power.

    The fixes are rounded to a grid with the step q. The rounding error is uniformly distributed over a step and has
    the variance q²/12 along each coordinate. If the platform crosses many steps within the aperture, the rounding
    differs from fix to fix. It is then part of the residual, and hardly displaces the image. If the platform crosses
    no step, the rounding is a constant error over the aperture, which the residual does not contain. The log does not
    show which of the two applies, and any fraction of the variance may be constant. The whole variance is therefore
    treated as constant, in addition to the residual.
    """
    path: FlownPath | None = getattr(seen.mission.platforms, name).path
    log = None if path is None else path.log_noise
    if log is None or log.processed != RAW:
        return
    for figure, (sizes, axes, correlation_time) in _log_parts(log, seen.cases).items():
        row_subject = subject(name, TRAJECTORY_KIND.name, figure)
        process = _Process(row_subject, tuple(sizes), correlation_time, figure == "residual")
        yield _noise(seen, process, {name: axes}, TRAJECTORY_KIND.path(name))


def _log_parts(log: LogNoise, cases: int) -> dict[str, tuple[Floats, Floats, PerCase]]:
    """Sigmas, axes and correlation time of the noise of a trajectory log, for its parts `residual` and `grid`.

    `residual` is the noise of the fixes, and `grid` is their rounding to a grid. Each part has sigmas (3, cases) [m],
    axes (3, 3, cases) and a correlation time [s].
    """
    residual, grid = (
        np.moveaxis(
            np.array([[np.broadcast_to(value, (cases,)) for value in row] for row in matrix], dtype=float), -1, 0
        )
        for matrix in (log.residual, log.grid)
    )
    variances, ways = np.linalg.eigh(residual)  # (cases, 3), (cases, 3, 3): columns are the directions
    steps = np.linalg.norm(grid, axis=2)
    along = grid / np.where(steps > 0, steps, 1.0)[..., None]
    return {
        "residual": (
            np.sqrt(np.maximum(variances, 0.0)).T,
            np.moveaxis(ways, (2, 1, 0), (0, 1, 2)),
            log.correlation_time,
        ),
        "grid": (_UNIFORM_SIGMA_RATIO * steps.T, np.moveaxis(along, 0, -1), _CONSTANT_S),
    }


def common_noise(seen: SensorCases) -> Iterator[RandomError]:
    """Yield an error for each process of correlated noise that both platforms share.

    The noise along an axis of its frame moves both platforms, and its effects on both legs add with their signs.
    Noise along different axes is independent. A leg is the path between a platform and the scene.
    """
    error = seen.mission.common_motion_error
    for index, process in enumerate(() if error is None else error.random):
        axes = {name: seen.axes(name, error.frame) for name in PLATFORMS} if error is not None else {}
        yield _noise(seen, _Process.of(process, "mission"), axes, RANDOM_KIND.path("mission", index=index))


class _Process(NamedTuple):
    """A Gauss–Markov process that moves platforms: its subject, sigmas along three axes [m] and correlation time [s].

    Numbers may be arrays (cases,). `spreads` is true if part of the process spreads power.
    """

    subject: Subject
    sigma: Sequence[PerCase]
    correlation_time: PerCase
    spreads: bool = True

    @classmethod
    def of(cls, process: GaussMarkov, owner: str) -> "_Process":
        return cls(subject(owner, RANDOM_KIND.name, process.name), process.sigma, process.correlation_time)


def _noise(seen: SensorCases, process: _Process, axes: Mapping[str, Floats], path: KeyPath) -> RandomError:
    """Create the error of a Gauss–Markov process that moves one or both platforms.

    `axes` maps the name of each platform that the process moves to the axes of the process, (axes, 3, cases). `path`
    is the key path of the process in the mission file.
    """
    k = 2 * math.pi / seen.mission.radar.wavelength
    largest, sizes = parts_of_largest(seen.vector(process.sigma))
    moments = gauss_markov(seen.aperture_time, process.correlation_time)
    courses = seen.courses(moments.covariance) if seen.has_edge else np.zeros((0, len(seen.exact.times), 1))
    sighted, moved, moves = list[Floats](), list[Floats](), list[Moves]()
    for name, of_platform in axes.items():
        platform_index, directions = PLATFORMS.index(name), of_platform * sizes[:, None]
        sighted.append((directions * seen.vector(seen.geometry.both[platform_index].look)).sum(axis=1))
        moved.append(seen.range_errors(platform_index, directions[:, :, None]))
        moves.append(Moves(platform_index, directions[:, :, None], courses))
    along = np.sqrt(np.square(sum(sighted)).sum(axis=0))
    quadratic, cubic, left = (np.sqrt(square) for square in moments[:3])
    return RandomError(
        subject=process.subject,
        unit=process.subject.source_kind.unit,
        declared=largest * seen.factor,
        path=path,
        published=RandomEffect(
            k * along * quadratic,
            k * along * cubic,
            k * along * left / seen.factor,
            *seen.moved(moments.constant * along**2, moments.linear * along**2),
        ),
        full=seen.of_gauss_markov(np.asarray(sum(moved)), process.correlation_time),
        spreads=process.spreads,
        moves=tuple(moves),
    )
