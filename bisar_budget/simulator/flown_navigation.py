"""Simulated flights with an inertial unit aided by GNSS fixes: position errors of the filter or of the smoother.

For every flight, the errors of the inertial unit and of each fix are drawn, and the filter is applied to them. The
smoother then corrects the estimates backwards in time, with the innovations of this flight. The flights are an
independent check of the joint covariance from `navigation.smoother`. They do not use its formulas: the transition of
a step is computed from a series, and its noise by quadrature.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bisar_budget.arrays import Floats
from bisar_budget.constants import STANDARD_GRAVITY_MPS2
from bisar_budget.effects.aided_navigation import WHITE_SIGMA_RATIO, fix_schedule, flight_of
from bisar_budget.mission.model import Mission
from bisar_budget.mission.navigation import Navigation
from bisar_budget.navigation.error_state import BIAS_WALK_TIME_S
from bisar_budget.navigation.smoother import StartSigmas
from bisar_budget.navigation.timeline import Timeline

_LONGEST_STEP_S = 0.1
_APERTURE_STEP_COUNT = 256
_STATE_COUNT, _QUADRATURE_NODE_COUNT = 15, 5
_FLIGHT_COUNT = 500  # flights that are simulated together


def navigation_courses(mission: Mission, name: str, times: Floats, draws: int, rng: np.random.Generator) -> Floats:
    """Draw position errors of a platform's aided navigation within an aperture, (draws, times, 3). [m]

    `times` (times,) [s] are slow times within the aperture. The result holds the errors of the antenna position:
    east, north and up. They have the declared size, including the `level` in the mission file, without the coverage
    factor.
    """
    navigation: Navigation = getattr(mission.platforms, name).motion_error.navigation
    flights = _Flights(mission, name, navigation)
    blocks = [flights.drawn(min(_FLIGHT_COUNT, draws - first), rng) for first in range(0, draws, _FLIGHT_COUNT)]
    errors = np.concatenate(blocks) * 10 ** (navigation.level / 20)
    series = [[np.interp(times, flights.shown, course) for course in flight.T] for flight in errors]
    return np.moveaxis(np.array(series).reshape(draws, 3, times.size), 1, 2)


@dataclass(frozen=True)
class _Step:
    """A step of the flight: transition of the state, process noise, and gain of a fix at the end of the step.

    `noise` is a factor F of the noise covariance FFᵀ. `inverse` is the inverse covariance of the innovation. `gain`
    and `inverse` are None if there is no fix.
    """

    transition: Floats
    noise: Floats
    gain: Floats | None = None
    inverse: Floats | None = None


class _Flights:
    """Simulated flights of one platform, divided into steps. All flights share the gains of the filter."""

    def __init__(self, mission: Mission, name: str, navigation: Navigation) -> None:
        half = mission.collection.aperture_time / 2
        schedule = fix_schedule(navigation, half)
        grid = np.linspace(-half, half, _APERTURE_STEP_COUNT + 1)
        ends = (-half - navigation.before, half + navigation.after_s)
        coarse = np.linspace(*ends, 2 + math.ceil((ends[1] - ends[0]) / _LONGEST_STEP_S))
        moments: Floats = np.unique(np.round(np.concatenate((grid, coarse, schedule.fixes())), 9)).astype(float)
        is_fix = np.isin(moments, np.round(schedule.fixes(), 9))
        is_shown = np.isin(moments, np.round(grid, 9))
        self.navigation, self.is_fix, self.is_shown = navigation, is_fix, is_shown
        self.shown: Floats = np.asarray(moments[is_shown], float)
        error = getattr(mission.platforms, name).motion_error
        arm = None if error.lever_arm is None or error.lever_arm.arm is None else np.array(error.lever_arm.arm)
        timeline = Timeline(moments[:, None], is_fix[:, None], np.zeros((moments.size, 1)), np.zeros(1, int))
        flight = flight_of(
            mission,
            name,
            getattr(mission.platforms, name).state,
            np.array([half]),
            timeline,
            None if arm is None else arm[:, None],
        )
        self.arms = None if flight.arm is None else flight.arm[is_shown, 0]
        self.wanders = navigation.gnss.correlation_time is not None
        self.size = _STATE_COUNT + (3 if self.wanders else 0)
        self._steps(moments, flight.body[:, 0], flight.force[:, 0])

    def _steps(self, moments: Floats, body: Floats, force: Floats) -> None:
        """Run the filter once, and store the transition, noise and gain of each step.

        The covariance at the beginning of the flight and after each step is stored for the smoother.
        """
        gnss, measured = self.navigation.gnss, np.zeros((6, self.size))
        measured[:6, :6] = np.eye(6)
        position = np.array(gnss.position or ())
        sigmas = position / WHITE_SIGMA_RATIO if self.wanders else position
        if self.wanders:
            measured[:3, _STATE_COUNT:] = np.eye(3)
        if gnss.velocity is None:
            measured = measured[:3]
        else:
            sigmas = np.concatenate((sigmas, gnss.velocity))
        self.measured, self.sigmas = measured, sigmas
        self.start = self._start()
        P = np.diag(np.square(self.start))
        self.first_gain = self._gain(P) if self.is_fix[0] else None
        if self.first_gain is not None:
            P = P - self.first_gain[0] @ measured @ P
        self.steps: list[_Step] = []
        self.covariances = [P]
        for step, duration in enumerate(np.diff(moments).tolist()):
            transition, noise = self._moved(duration, body[step], force[step])
            P = transition @ P @ transition.T + noise
            gain, inverse = self._gain(P) if self.is_fix[step + 1] else (None, None)
            if gain is not None:
                P = P - gain @ measured @ P
                P = (P + P.T) / 2
            self.steps.append(_Step(transition, _square_root(noise), gain, inverse))
            self.covariances.append(P)

    def _start(self) -> Floats:
        """Standard deviations of the errors of the state at the start of the flight."""
        imu, sigmas = self.navigation.imu, StartSigmas(heading_rad=np.array([self.navigation.heading]))
        bias = np.array(imu.accelerometer_bias or ())
        if imu.accelerometer_scale_factor is not None:
            bias[2] = math.hypot(bias[2], imu.accelerometer_scale_factor[2] * STANDARD_GRAVITY_MPS2)
        start = [*[sigmas.position_m] * 3, *[sigmas.velocity_mps] * 3, *[sigmas.tilt_rad] * 2]
        start += [*sigmas.heading_rad, *bias, *(imu.gyro_bias or ())]
        return np.array([*start, *(self.navigation.gnss.position or ())] if self.wanders else start, float)

    def _gain(self, P: Floats) -> tuple[Floats, Floats]:
        """Filter gain of a fix, and the inverse covariance of its innovation.

        `P` is the covariance of the state before the fix.
        """
        inverse = np.linalg.inv(self.measured @ P @ self.measured.T + np.diag(np.square(self.sigmas)))
        return np.asarray(P @ self.measured.T @ inverse), np.asarray(inverse, float)

    def _moved(self, duration: float, body: Floats, force: Floats) -> tuple[Floats, Floats]:
        """Transition matrix of a step, and the covariance of its process noise.

        The matrix is computed from the series of the exponential, and the covariance by Gauss–Legendre quadrature.
        The wander of the fixes is a Gauss–Markov process of its own, exact for steps of any duration.
        """
        imu, rate = self.navigation.imu, np.zeros((self.size, self.size))
        rate[0:3, 3:6] = np.eye(3)
        rate[6:9, 12:15] = rate[3:6, 9:12] = body
        for axis, tilt in enumerate(np.eye(3)):
            rate[3:6, 6 + axis] = np.cross(tilt, force)
        densities = np.zeros((self.size, 12))
        densities[3:6, 0:3] = body * np.array(imu.velocity_random_walk)
        densities[6:9, 3:6] = body * np.array(imu.angle_random_walk)
        biases = np.concatenate((imu.accelerometer_bias or (), imu.gyro_bias or ()))
        densities[9:15, 6:12] = np.diag(biases * math.sqrt(2 / BIAS_WALK_TIME_S))
        noise = np.zeros((self.size, self.size))
        for abscissa, weight in zip(*np.polynomial.legendre.leggauss(_QUADRATURE_NODE_COUNT), strict=True):
            moved = _exponential(rate * (duration * (1 - abscissa) / 2)) @ densities
            noise += weight * duration / 2 * moved @ moved.T
        transition = _exponential(rate * duration)
        if self.wanders:  # a step may be longer than the correlation time, for which no series converges
            kept = math.exp(-duration / float(self.navigation.gnss.correlation_time or math.inf))
            wander = slice(_STATE_COUNT, self.size)
            transition[wander, wander] = kept * np.eye(3)
            noise[wander, wander] = np.diag(np.square(self.start[wander]) * (1 - kept**2))
        return transition, noise

    def drawn(self, draws: int, rng: np.random.Generator) -> Floats:
        """Draw flights, and return the position errors of the antenna in the aperture, (draws, shown, 3). [m]

        The attribute `shown` holds the slow times of the errors.
        """
        errors, innovations = self._filtered(draws, rng)
        if self.navigation.is_smoothed:
            shown = self._smoothed(errors, innovations)
        else:
            shown = [
                self._at_antenna(error) for error, is_shown in zip(errors, self.is_shown, strict=True) if is_shown
            ]
        positions = np.array(shown)  # (shown, draws, 6): position and tilt
        result = positions[..., :3]
        if self.arms is not None:
            result = result + np.cross(positions[..., 3:], self.arms[:, None])
        return np.moveaxis(result, 0, 1)

    @staticmethod
    def _at_antenna(error: Floats) -> Floats:
        """Select the errors of the state that displace the antenna: position and tilt, (draws, 6)."""
        return np.concatenate((error[:, :3], error[:, 6:9]), axis=1)

    def _filtered(self, draws: int, rng: np.random.Generator) -> tuple[Sequence[Floats], Sequence[Floats | None]]:
        """Draw the errors of the filter at the start and after each step, and the innovation of each fix.

        An innovation is None for a step that does not end with a fix.
        """
        error = self.start * rng.standard_normal((draws, self.size))
        innovations: list[Floats | None] = [None]
        if self.first_gain is not None:
            error, innovations[0] = self._corrected(error, self.first_gain[0], rng)
        errors = [error]
        for step in self.steps:
            error = error @ step.transition.T + rng.standard_normal((draws, self.size)) @ step.noise.T
            innovation = None
            if step.gain is not None:
                error, innovation = self._corrected(error, step.gain, rng)
            errors.append(error)
            innovations.append(innovation)
        return errors, innovations

    def _corrected(self, error: Floats, gain: Floats, rng: np.random.Generator) -> tuple[Floats, Floats]:
        innovation = error @ self.measured.T + self.sigmas * rng.standard_normal((len(error), self.sigmas.size))
        return error - innovation @ gain.T, innovation

    def _smoothed(self, errors: Sequence[Floats], innovations: Sequence[Floats | None]) -> list[Floats]:
        """Errors of the smoother in position and tilt, at each of the times `shown` in the aperture."""
        adjoint, shown = np.zeros_like(errors[0]), list[Floats]()
        for moment in range(len(errors) - 1, -1, -1):
            if self.is_shown[moment]:
                shown.append(self._at_antenna(errors[moment] - adjoint @ self.covariances[moment]))
            if moment:
                step, innovation = self.steps[moment - 1], innovations[moment]
                if step.gain is not None and step.inverse is not None and innovation is not None:
                    adjoint = adjoint - adjoint @ step.gain @ self.measured
                    adjoint = adjoint + innovation @ step.inverse @ self.measured
                adjoint = adjoint @ step.transition
        return shown[::-1]


def _exponential(matrix: Floats) -> Floats:
    """Exponential of a matrix with small elements, computed from its power series."""
    total, power = np.eye(len(matrix)), np.eye(len(matrix))
    for order in range(1, 7):
        power = power @ matrix / order
        total = total + power
    return total


def _square_root(covariance: Floats) -> Floats:
    """Factor F of a covariance matrix, such that FFᵀ is the matrix.

    The states are scaled to unit variance first, because they may have very different sizes.
    """
    sigmas = np.sqrt(np.diagonal(covariance))
    units = np.where(sigmas > 0, sigmas, 1.0)
    squares, ways = np.linalg.eigh(covariance / np.multiply.outer(units, units))
    return np.asarray(units[:, None] * ways * np.sqrt(np.maximum(squares, 0.0)))
