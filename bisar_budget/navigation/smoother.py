"""Filter and smoother of an aided navigation: the joint covariance of its position error over an aperture.

The errors of a navigation at two moments are correlated, and this correlation decides how an aperture is defocused.
The covariance is computed without simulated flights. A Kalman filter runs over all fixes. After a fix, the error of the filter is e_k with the covariance P_k, and the next error is M_k·e_k plus noise
that is new. Two errors of the filter therefore have the covariance

    Cov(e_i, e_j) = P_i·Ψ(j, i)ᵀ,    Ψ(j, i) = M_{j−1} ⋯ M_i,    M_k = (1 − K_{k+1}·H)·Φ_k,    i ≤ j.

A smoother subtracts from e_k what later fixes reveal of it, P_k·λ_k. The adjoint λ_k has the covariance Λ_k, which
follows backwards from the last fix, Λ_k = M_kᵀ·Λ_{k+1}·M_k + (H·Φ_k)ᵀ·S⁻¹·H·Φ_k, and

    Cov(e_i − P_i·λ_i, e_j − P_j·λ_j) = P_i·Ψ(j, i)ᵀ·(1 − Λ_j·P_j).

No covariance is inverted but that of the innovations, S. The adjoint form is that of Bryson and Frazier (1963); the
covariance between two moments is derived here. `tests/navigation` compares it with a dense batch and with flights.

Only integrals of the position error over the aperture are needed, so the sums over pairs of moments are carried along
with Ψ, and the memory does not grow with the square of the number of moments.
"""

from dataclasses import dataclass

import numpy as np

from bisar_budget.arrays import Floats, Indices
from bisar_budget.navigation.error_state import (
    ACCELEROMETER_BIAS,
    FIX_WANDER,
    GYRO_BIAS,
    POSITION,
    TILT,
    VELOCITY,
    Fixes,
    InertialUnit,
    step_noise,
    transitions,
)
from bisar_budget.navigation.timeline import Timeline

_NO_FIX_VARIANCE = 1e30  # of a fix that is not taken, in m² or m²/s²
_BLOCK_BYTES = 64e6  # memory of the matrices of the steps of cases that are analysed together


@dataclass(frozen=True, kw_only=True)
class StartSigmas:
    """Errors at the start of the flight, 1 sigma.

    Attributes
    ----------
    position_m, velocity_mps, tilt_rad : float
        Along each axis, and about each horizontal axis.
    heading_rad : (cases,)
        Error of the heading.
    """

    position_m: float = 10.0
    velocity_mps: float = 1.0
    tilt_rad: float = np.pi / 180
    heading_rad: Floats


@dataclass(frozen=True, kw_only=True)
class Flight:
    """Attitude and specific force of a platform over the steps of a timeline.

    Attributes
    ----------
    body : (steps, cases, 3, 3)
        Rotation from the axes of the body to those of the scene.
    force : (steps, cases, 3)
        Specific force in the axes of the scene. [m/s²]
    arm : (moments, cases, 3), optional
        Lever arm from the inertial unit to the antenna of the radar, in the axes of the scene. [m]
    """

    body: Floats
    force: Floats
    arm: Floats | None = None

    def of(self, cases: slice) -> "Flight":
        """Flight in some of the cases."""
        arm = None if self.arm is None else self.arm[:, cases]
        return Flight(body=self.body[:, cases], force=self.force[:, cases], arm=arm)


@dataclass(frozen=True, kw_only=True)
class AidedCovariance:
    """Joint covariance of the position error of an aided navigation over an aperture.

    Attributes
    ----------
    of_orders : (orders, 3, orders, 3, cases)
        Covariance of the Legendre coefficients of the position error, for each order and axis east, north, up. [m²]
    beyond : (3, 3, cases)
        Mean over the aperture of the covariance in higher orders. [m²]
    at_middle : (states, states, cases)
        Covariance of the state at mid-aperture, see `error_state`.
    fix_count : (cases,)
        Number of fixes during the flight.
    """

    of_orders: Floats
    beyond: Floats
    at_middle: Floats
    fix_count: Indices

    @property
    def order_count(self) -> int:
        """Number of Legendre orders."""
        return len(self.of_orders)

    def at(self, cases: Indices) -> "AidedCovariance":
        """Covariance in a selection of the cases, by their indices."""
        return AidedCovariance(
            of_orders=self.of_orders[..., cases],
            beyond=self.beyond[..., cases],
            at_middle=self.at_middle[..., cases],
            fix_count=self.fix_count[cases],
        )

    def rms(self, states: slice) -> Floats:
        """Root of the sum of the variances of some states at mid-aperture, (cases,)."""
        variances = np.einsum("ssc->sc", self.at_middle)[states].sum(axis=0)
        return np.asarray(np.sqrt(np.maximum(variances, 0.0)))


def aided_covariance(
    timeline: Timeline,
    flight: Flight,
    unit: InertialUnit,
    fixes: Fixes,
    start: StartSigmas,
    half_s: Floats,
    *,
    order_count: int,
    is_smoothed: bool,
) -> AidedCovariance:
    """Covariance of the position error of the radar's antenna over the aperture of each case.

    Parameters
    ----------
    timeline : Timeline
        Moments of the flight, with the fixes and the nodes over the aperture.
    flight : Flight
        Attitude and specific force between these moments.
    unit, fixes, start
        Sigmas of the inertial unit, of the fixes, and at the start of the flight.
    half_s : (cases,)
        Half the aperture time.
    order_count : int
        Number of Legendre orders of the result.
    is_smoothed : bool
        Whether fixes after a moment contribute; otherwise the errors of the output of the filter are described.
    """
    steps, cases = timeline.steps.shape
    block = max(1, int(_BLOCK_BYTES / (steps * fixes.state_size**2 * 8 * 3)))
    parts = [
        _block_covariance(
            Timeline(
                timeline.times[:, part], timeline.is_fix[:, part], timeline.weights[:, part], timeline.middle[part]
            ),
            flight.of(part),
            InertialUnit(**{name: sigmas[part] for name, sigmas in vars(unit).items()}),
            Fixes(**{name: sigmas[part] for name, sigmas in vars(fixes).items()}),
            StartSigmas(**{**vars(start), "heading_rad": start.heading_rad[part]}),
            half_s[part],
            fixes.state_size,
            order_count,
            is_smoothed=is_smoothed,
        )
        for part in (slice(first, first + block) for first in range(0, cases, block))
    ]
    of_orders, beyond, at_middle = (np.concatenate(arrays, axis=-1) for arrays in zip(*parts, strict=True))
    return AidedCovariance(
        of_orders=of_orders, beyond=beyond, at_middle=at_middle, fix_count=timeline.is_fix.sum(axis=0)
    )


def _block_covariance(
    timeline: Timeline,
    flight: Flight,
    unit: InertialUnit,
    fixes: Fixes,
    start: StartSigmas,
    half_s: Floats,
    size: int,
    order_count: int,
    *,
    is_smoothed: bool,
) -> tuple[Floats, Floats, Floats]:
    """Fields of `AidedCovariance` for a block of cases; `size` is the number of states."""
    steps = timeline.steps
    phi = transitions(steps, flight.body, flight.force, fixes.wander_time_s, size)
    noise = step_noise(steps, flight.body, flight.force, unit, fixes, size)
    measured, fix_variances = _measurement(fixes, size)
    has_fix, has_node = timeline.is_fix.any(axis=1), (timeline.weights > 0).any(axis=1)
    nodes = np.flatnonzero(has_node)
    first, last = min(nodes[0], timeline.middle.min()), max(nodes[-1], timeline.middle.max())

    # Forwards: covariance of the filter after each moment, and the propagation M of its error.
    P = _start_covariance(start, unit, fixes, size)
    kept: dict[int, Floats] = {}
    propagation, information = np.empty_like(phi), np.zeros_like(phi)
    if has_fix[0]:
        P, _, _ = _updated(P, measured, fix_variances, timeline.is_fix[0])
    for k in range(len(steps)):
        if first <= k <= last:
            kept[k] = P
        P = phi[k] @ P @ np.swapaxes(phi[k], -1, -2) + noise[k]
        if has_fix[k + 1]:
            P, remaining, of_fix = _updated(P, measured, fix_variances, timeline.is_fix[k + 1])
            propagation[k] = remaining @ phi[k]
            information[k] = np.swapaxes(phi[k], -1, -2) @ of_fix @ phi[k]
        else:
            propagation[k] = phi[k]
    if last == len(steps):
        kept[last] = P

    # Backwards: covariance of the adjoint, which later fixes add.
    adjoint = np.zeros_like(P)
    unrevealed: dict[int, Floats] = {}  # 1 − Λ·P at each moment of the aperture
    identity = np.eye(size)
    for k in range(len(steps), first - 1, -1):
        if is_smoothed and k < len(steps):
            adjoint = np.swapaxes(propagation[k], -1, -2) @ adjoint @ propagation[k] + information[k]
        if k <= last:
            unrevealed[k] = identity - adjoint @ kept[k] if is_smoothed else np.broadcast_to(identity, P.shape)

    # Forwards through the aperture: sums over pairs of moments, with P·Ψᵀ carried along.
    cases = half_s.size
    carried = np.zeros((cases, order_count, 3, size))
    pairs = np.zeros((cases, order_count, 3, order_count, 3))
    mean_square, at_middle = np.zeros((cases, 3, 3)), np.empty((cases, size, size))
    scaled = 2 * np.arange(order_count) + 1.0
    for k in range(first, last + 1):
        is_middle = timeline.middle == k
        if is_middle.any():
            at_middle[is_middle] = (kept[k] @ unrevealed[k])[is_middle]
        if has_node[k]:
            seen = _antenna(flight, k, size, cases)
            coefficients = timeline.weights[k][:, None] * scaled
            coefficients = coefficients * np.polynomial.legendre.legvander(
                timeline.times[k] / half_s, order_count - 1
            )
            own = seen @ kept[k]
            now = np.swapaxes(seen @ np.swapaxes(unrevealed[k], -1, -2), -1, -2)  # (1 − Λ·P)·Bᵀ, (cases, states, 3)
            joint = own @ now
            mean_square += timeline.weights[k][:, None, None] * joint
            of_earlier = carried.reshape(cases, -1, size) @ now
            pairs += of_earlier.reshape(cases, order_count, 3, 1, 3) * coefficients[:, None, None, :, None]
            both = coefficients[:, :, None] * coefficients[:, None, :] / 2
            pairs += both[:, :, None, :, None] * joint[:, None, :, None, :]
            carried += coefficients[:, :, None, None] * own[:, None]
        if k < last:
            carried = (carried.reshape(cases, -1, size) @ np.swapaxes(propagation[k], -1, -2)).reshape(carried.shape)
    of_orders = pairs + np.transpose(pairs, (0, 3, 4, 1, 2))
    resolved = np.einsum("coaob,o->cab", of_orders, 1 / scaled)
    return tuple(np.moveaxis(array, 0, -1) for array in (of_orders, mean_square - resolved, at_middle))


def _measurement(fixes: Fixes, size: int) -> tuple[Floats, Floats]:
    """Matrix H of a fix, (6, states), and the variances of its errors, (cases, 6)."""
    measured = np.zeros((6, size))
    measured[:3, POSITION] = measured[3:, VELOCITY] = np.eye(3)
    if size > FIX_WANDER.start:
        measured[:3, FIX_WANDER] = np.eye(3)
    variances = np.square(np.concatenate((fixes.position_m, fixes.velocity_mps), axis=1))
    return measured, np.minimum(variances, _NO_FIX_VARIANCE)


def _start_covariance(start: StartSigmas, unit: InertialUnit, fixes: Fixes, size: int) -> Floats:
    """Covariance of the state at the start of the flight, (cases, states, states)."""
    sigmas = np.zeros((start.heading_rad.size, size))
    sigmas[:, POSITION], sigmas[:, VELOCITY], sigmas[:, TILT] = start.position_m, start.velocity_mps, start.tilt_rad
    sigmas[:, TILT.stop - 1] = start.heading_rad
    sigmas[:, ACCELEROMETER_BIAS], sigmas[:, GYRO_BIAS] = unit.first_accelerometer_bias_mps2, unit.gyro_bias_radps
    if size > FIX_WANDER.start:
        sigmas[:, FIX_WANDER] = fixes.wander_m
    return np.asarray(np.square(sigmas)[:, :, None] * np.eye(size))


def _updated(P: Floats, measured: Floats, variances: Floats, is_taken: Floats) -> tuple[Floats, Floats, Floats]:
    """Covariance after a fix, the matrix 1 − K·H, and the information Hᵀ·S⁻¹·H of the fix.

    Cases in which `is_taken` is false take a fix without information.
    """
    R = np.where(is_taken[:, None], variances, _NO_FIX_VARIANCE)
    seen = measured @ P
    S = seen @ measured.T
    S[:, range(6), range(6)] += R
    of_fix = measured.T @ np.linalg.solve(S, np.broadcast_to(measured, (len(P), *measured.shape)))
    remaining = np.eye(P.shape[-1]) - P @ of_fix
    updated = remaining @ P
    return (updated + np.swapaxes(updated, -1, -2)) / 2, remaining, of_fix


def _antenna(flight: Flight, k: int, size: int, cases: int) -> Floats:
    """Matrix B of the position error B·e of the radar's antenna at a moment, (cases, 3, states).

    A tilt ψ moves the antenna by ψ × l, with the lever arm l.
    """
    seen = np.zeros((cases, 3, size))
    seen[:, range(3), range(POSITION.start, POSITION.stop)] = 1.0
    if flight.arm is not None:
        x, y, z = flight.arm[k].T
        zero = np.zeros_like(x)
        seen[:, :, TILT] = np.stack([zero, z, -y, -z, zero, x, y, -x, zero], axis=-1).reshape(-1, 3, 3)
    return seen
