"""Growth of the errors of an inertial navigation between two moments, as a linear state-space model.

The state consists of the errors of position and velocity, the tilt of the navigation's axes, and the biases of
accelerometers and gyros. If a part of the position error of the fixes is correlated in time, it belongs to the state
as well, as a Gauss–Markov process. The equations of motion are

    δṗ = δv,    δv̇ = ψ × f + R·(b_a + n_a),    ψ̇ = R·(b_g + n_g).

f is the specific force [m/s²], and R is the rotation from the axes of the body to the axes of the scene; both are
constant during a step. n_a and n_g are white noise. The biases b_a and b_g are random walks. Position, velocity and
tilt are given along the axes of the scene. The rotation and the curvature of the Earth and the Schuler oscillation
are neglected, which is accurate enough for flights of a few minutes.

The matrix F of the model is nilpotent, F⁴ = 0. Its exponential over a step is therefore a polynomial, and so is the
covariance of the noise that a step adds. Both are exact for constant f and R. They were derived for this program;
`tests/navigation` compares them with series and with a dense batch solution.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from bisar_budget.arrays import Floats

POSITION, VELOCITY, TILT, ACCELEROMETER_BIAS, GYRO_BIAS, FIX_WANDER = (slice(k, k + 3) for k in range(0, 18, 3))
LEVEL_TILT, HEADING = slice(6, 8), slice(8, 9)  # of the tilt, about the horizontal axes and about up
_STATE_COUNT = 15
_WANDERING_STATE_COUNT = 18
BIAS_WALK_TIME_S = 600.0  # a bias walks by √2 of its own size in this time


@dataclass(frozen=True, kw_only=True)
class InertialUnit:
    """Errors of an inertial unit along the axes of the body, 1 sigma, (cases, 3).

    Attributes
    ----------
    accelerometer_bias_mps2, gyro_bias_radps : (cases, 3)
        Sigma of the biases, which also determines their random walk during the flight. [m/s²], [rad/s]
    first_accelerometer_bias_mps2 : (cases, 3)
        Bias of the accelerometers at the start of the flight, including the effect of their scale factors. [m/s²]
    velocity_random_walk, angle_random_walk : (cases, 3)
        White noise of accelerometers [m/s/√s] and gyros [rad/√s].
    """

    accelerometer_bias_mps2: Floats
    first_accelerometer_bias_mps2: Floats
    gyro_bias_radps: Floats
    velocity_random_walk: Floats
    angle_random_walk: Floats


@dataclass(frozen=True, kw_only=True)
class Fixes:
    """Errors of the fixes of a GNSS receiver, 1 sigma along east, north and up.

    Attributes
    ----------
    position_m : (cases, 3)
        Sigma of the white noise of a position. [m]
    velocity_mps : (cases, 3)
        Sigma of the white noise of a velocity; infinite if the receiver gives no velocity. [m/s]
    wander_m : (cases, 3)
        Sigma of a Gauss–Markov process that is added to the white noise of a position. [m]
    wander_time_s : (cases,)
        Correlation time of this process; infinite if there is no such process. [s]
    """

    position_m: Floats
    velocity_mps: Floats
    wander_m: Floats
    wander_time_s: Floats

    @property
    def state_size(self) -> int:
        """Number of states that an analysis with these fixes needs."""
        return _WANDERING_STATE_COUNT if np.any(self.wander_m > 0) else _STATE_COUNT


def transitions(steps: Floats, body: Floats, force: Floats, wander_time_s: Floats, size: int) -> Floats:
    """Matrices that propagate the state over each step, (steps, cases, size, size).

    Parameters
    ----------
    steps : (steps, cases)
        Durations of the steps. [s]
    body : (steps, cases, 3, 3)
        Rotation from the axes of the body to the axes of the scene.
    force : (steps, cases, 3)
        Specific force in the axes of the scene. [m/s²]
    wander_time_s : (cases,)
        Correlation time of the Gauss–Markov process in the position error of the fixes. [s]
    size : int
        Number of states, 15 or 18.
    """
    matrices = np.zeros((*steps.shape, size, size))
    matrices[..., range(size), range(size)] = 1.0
    tilted = moved_by_tilt(force)
    tilted_by_gyro, t = tilted @ body, steps[..., None, None]
    for rows, columns, block, power in (
        (POSITION, VELOCITY, np.eye(3), 1),
        (POSITION, TILT, tilted, 2),
        (POSITION, ACCELEROMETER_BIAS, body, 2),
        (POSITION, GYRO_BIAS, tilted_by_gyro, 3),
        (VELOCITY, TILT, tilted, 1),
        (VELOCITY, ACCELEROMETER_BIAS, body, 1),
        (VELOCITY, GYRO_BIAS, tilted_by_gyro, 2),
        (TILT, GYRO_BIAS, body, 1),
    ):
        matrices[..., rows, columns] = block * t**power / math.factorial(power)
    if size > _STATE_COUNT:
        for state in range(FIX_WANDER.start, FIX_WANDER.stop):
            matrices[..., state, state] = np.exp(-steps / wander_time_s)
    return matrices


def step_noise(steps: Floats, body: Floats, force: Floats, unit: InertialUnit, fixes: Fixes) -> Floats:
    """Covariance of the noise that each step adds to the state, (steps, cases, size, size).

    `steps`, `body` and `force` are the same as in `transitions`. `unit` and `fixes` are the errors of the inertial
    unit and of the fixes.
    """
    size = fixes.state_size
    noise, tilted = np.zeros((*steps.shape, size, size)), moved_by_tilt(force)
    walk = math.sqrt(2 / BIAS_WALK_TIME_S)
    accelerations, rates = body * unit.velocity_random_walk[:, None], body * unit.angle_random_walk[:, None]
    accelerometer_walk = walk * unit.accelerometer_bias_mps2[:, None]
    gyro_walk = walk * unit.gyro_bias_radps[:, None]
    bias_rates = body * gyro_walk
    # Response of each block of the state, t seconds after an impulse of the noise: matrix · t^power / power!.
    for responses in (
        ((VELOCITY, accelerations, 0), (POSITION, accelerations, 1)),
        ((TILT, rates, 0), (VELOCITY, tilted @ rates, 1), (POSITION, tilted @ rates, 2)),
        (
            (ACCELEROMETER_BIAS, np.eye(3) * accelerometer_walk, 0),
            (VELOCITY, body * accelerometer_walk, 1),
            (POSITION, body * accelerometer_walk, 2),
        ),
        (
            (GYRO_BIAS, np.eye(3) * gyro_walk, 0),
            (TILT, bias_rates, 1),
            (VELOCITY, tilted @ bias_rates, 2),
            (POSITION, tilted @ bias_rates, 3),
        ),
    ):
        _add_impulse_responses(noise, steps, responses)
    if size > _STATE_COUNT:
        grown = -np.expm1(-2 * steps / fixes.wander_time_s)
        for axis in range(3):
            state = FIX_WANDER.start + axis
            noise[..., state, state] = np.square(fixes.wander_m[:, axis]) * grown
    return noise


def _add_impulse_responses(noise: Floats, steps: Floats, responses: Sequence[tuple[slice, Floats, int]]) -> None:
    """Add to `noise` the covariance that a single source of white noise causes during each step.

    `responses` describe how parts of the state respond to an impulse of this noise: each item has the slice of the
    state, a matrix, and the power of the time since the impulse.
    """
    for (rows, a, m), (columns, b, n) in product(responses, repeat=2):
        power = m + n + 1
        growth = steps[..., None, None] ** power / (math.factorial(m) * math.factorial(n) * power)
        noise[..., rows, columns] += a @ np.swapaxes(b, -1, -2) * growth


def moved_by_tilt(vectors: Floats) -> Floats:
    """Matrices A (..., 3, 3) with A·ψ = ψ × v for any tilt ψ, where v are the given vectors (..., 3).

    If v is the specific force, A·ψ is the acceleration error due to the tilt. If v is a lever arm, A·ψ is the
    displacement of its end.
    """
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    return np.stack([zero, z, -y, -z, zero, x, y, -x, zero], axis=-1).reshape(*vectors.shape[:-1], 3, 3)
