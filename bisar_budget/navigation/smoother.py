"""Filter and smoother of an aided navigation: the joint covariance of its position error over an aperture.

The errors of a navigation at two moments are correlated, and this correlation decides how an aperture is defocused.
The covariance is computed without simulated flights. A Kalman filter runs over all fixes. After a fix, the error of
the filter is e_k with the covariance P_k, and the next error is M_k·e_k plus new noise, which is independent of e_k.
Two errors of the filter therefore have the covariance

    Cov(e_i, e_j) = P_i·Ψ(j, i)ᵀ,    Ψ(j, i) = M_{j−1} ⋯ M_i,    M_k = (1 − K_{k+1}·H)·Φ_k,    i ≤ j.

A smoother subtracts from e_k the part P_k·λ_k, which it learns from later fixes. The adjoint λ_k has the covariance
Λ_k, which is computed backwards from the last fix: Λ_k = M_kᵀ·Λ_{k+1}·M_k + (H·Φ_k)ᵀ·S⁻¹·H·Φ_k. Two errors of the
smoother have the covariance

    Cov(e_i − P_i·λ_i, e_j − P_j·λ_j) = P_i·Ψ(j, i)ᵀ·(1 − Λ_j·P_j).

The only covariance that is inverted is the covariance S of the innovations. The adjoint form is due to Bryson and
Frazier (1963); the covariance between two moments was derived for this program. `tests/navigation` compares it with a
dense batch solution and with simulated flights.

Only integrals of the position error over the aperture are needed. The sums over pairs of moments are therefore
updated from each moment to the next, together with Ψ, so the memory does not grow with the square of the number of
moments.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from bisar_budget.arrays import Booleans, Floats, Indices
from bisar_budget.navigation.error_state import (
    ACCELEROMETER_BIAS,
    FIX_WANDER,
    GYRO_BIAS,
    POSITION,
    TILT,
    VELOCITY,
    Fixes,
    InertialUnit,
    moved_by_tilt,
    step_noise,
    transitions,
)
from bisar_budget.navigation.timeline import Timeline

_NO_FIX_SIGMA_M = 1e15  # of a fix that is not taken; for a velocity in m/s
_STEP_MATRICES_BYTES = 64e6  # memory of the matrices of the steps of cases that are analysed together


@dataclass(frozen=True, kw_only=True)
class StartSigmas:
    """Errors at the start of the flight, 1 sigma.

    Attributes
    ----------
    position_m, velocity_mps, tilt_rad : float
        Errors of position [m] and velocity [m/s] along each axis, and tilt [rad] about each horizontal axis.
    heading_rad : (cases,)
        Error of the heading. [rad]
    """

    position_m: float = 10.0
    velocity_mps: float = 1.0
    tilt_rad: float = np.pi / 180
    heading_rad: Floats


@dataclass(frozen=True, kw_only=True)
class FlightSteps:
    """Attitude and specific force of a platform over the steps of a timeline.

    Attributes
    ----------
    body : (steps, cases, 3, 3)
        Rotation from the axes of the body to the axes of the scene.
    force : (steps, cases, 3)
        Specific force in the axes of the scene. [m/s²]
    arm : (moments, cases, 3), optional
        Lever arm from the inertial unit to the antenna of the radar, in the axes of the scene. [m]
    """

    body: Floats
    force: Floats
    arm: Floats | None = None

    def of(self, cases: slice) -> "FlightSteps":
        """Select the steps of some cases."""
        arm = None if self.arm is None else self.arm[:, cases]
        return FlightSteps(body=self.body[:, cases], force=self.force[:, cases], arm=arm)


@dataclass(frozen=True, kw_only=True)
class AidedCovariance:
    """Joint covariance of the position error of an aided navigation over an aperture.

    Attributes
    ----------
    of_orders : (orders, 3, orders, 3, cases)
        Covariance of the Legendre coefficients of the position error, for each order and axis east, north, up. [m²]
    beyond : (3, 3, cases)
        Covariance of the part of the position error that belongs to higher orders, averaged over the aperture. [m²]
    at_middle : (states, states, cases)
        Covariance of the state at mid-aperture; `error_state` defines the state.
    fix_count : (cases,)
        Number of fixes during the flight.
    """

    of_orders: Floats
    beyond: Floats
    at_middle: Floats
    fix_count: Indices

    @property
    def order_count(self) -> int:
        """Number of Legendre orders in `of_orders`."""
        return len(self.of_orders)

    def at(self, cases: Indices) -> "AidedCovariance":
        """Select the covariances of some cases by their indices."""
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
    flight: FlightSteps,
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
    flight : FlightSteps
        Attitude and specific force between these moments.
    unit, fixes, start
        Sigmas of the errors of the inertial unit and of the fixes, and of the errors at the start of the flight.
    half_s : (cases,)
        Half the aperture time. [s]
    order_count : int
        Number of Legendre orders of the result.
    is_smoothed : bool
        Whether the position at each moment is also based on later fixes (smoother). Otherwise the covariance is
        computed for the output of the filter.
    """
    steps, cases = timeline.steps.shape
    block = max(1, int(_STEP_MATRICES_BYTES / (steps * fixes.state_size**2 * 8 * 3)))
    navigation = _Navigation(timeline, flight, unit, fixes, start, half_s)
    blocks = [
        _integrals(navigation.of(slice(first, first + block)), order_count, is_smoothed=is_smoothed)
        for first in range(0, cases, block)
    ]
    of_orders, beyond, at_middle = (np.concatenate(arrays, axis=-1) for arrays in zip(*blocks, strict=True))
    return AidedCovariance(
        of_orders=of_orders, beyond=beyond, at_middle=at_middle, fix_count=timeline.is_fix.sum(axis=0)
    )


@dataclass(frozen=True)
class _Navigation:
    """Aided navigations, one in each case; the fields are described in `aided_covariance`."""

    timeline: Timeline
    flight: FlightSteps
    unit: InertialUnit
    fixes: Fixes
    start: StartSigmas
    half_s: Floats

    def of(self, cases: slice) -> "_Navigation":
        """Select the navigations of some cases."""
        timeline = self.timeline
        return _Navigation(
            Timeline(
                timeline.times[:, cases],
                timeline.is_fix[:, cases],
                timeline.weights[:, cases],
                timeline.middle[cases],
            ),
            self.flight.of(cases),
            InertialUnit(**{name: sigmas[cases] for name, sigmas in vars(self.unit).items()}),
            Fixes(**{name: sigmas[cases] for name, sigmas in vars(self.fixes).items()}),
            replace(self.start, heading_rad=self.start.heading_rad[cases]),
            self.half_s[cases],
        )

    @property
    def span(self) -> tuple[int, int]:
        """Indices of the first and the last moment that is a node or mid-aperture in any of the cases."""
        nodes, middle = np.flatnonzero(self.timeline.weights.any(axis=1)), self.timeline.middle
        return int(min(nodes[0], middle.min())), int(max(nodes[-1], middle.max()))


@dataclass(frozen=True)
class _Filtered:
    """Result of the filter: covariances P at the moments of the aperture, and matrices of each step.

    `covariances` maps the index of a moment to P. `propagation` is M of each step, and `information` is
    (H·Φ)ᵀ·S⁻¹·H·Φ of the fix at its end, both (steps, cases, states, states).
    """

    covariances: Mapping[int, Floats]
    propagation: Floats
    information: Floats


def _filtered(navigation: _Navigation) -> _Filtered:
    """Run the filter from the start of the flight to its end."""
    timeline, flight, unit, fixes = navigation.timeline, navigation.flight, navigation.unit, navigation.fixes
    (first, last), steps, size = navigation.span, timeline.steps, fixes.state_size
    phi = transitions(steps, flight.body, flight.force, fixes.wander_time_s, size)
    noise = step_noise(steps, flight.body, flight.force, unit, fixes)
    measured, variances = _measurement(fixes)
    P, covariances, information = _start_covariance(navigation.start, unit, fixes), {}, np.zeros_like(phi)
    has_fix: Booleans = np.asarray(timeline.is_fix.any(axis=1))
    if has_fix[0]:
        P, _, _ = _updated(P, measured, variances, timeline.is_fix[0])
    for step in range(len(steps) + 1):
        if first <= step <= last:
            covariances[step] = P
        if step == len(steps):
            break
        transition = phi[step]
        P = transition @ P @ _transposed(transition) + noise[step]
        if has_fix[step + 1]:
            P, remaining, of_fix = _updated(P, measured, variances, timeline.is_fix[step + 1])
            information[step] = _transposed(transition) @ of_fix @ transition
            phi[step] = remaining @ transition
    return _Filtered(covariances, phi, information)


def _unrevealed(filtered: _Filtered, span: tuple[int, int], *, is_smoothed: bool) -> dict[int, Floats]:
    """Matrix 1 − Λ·P at each moment of the aperture, by the index of the moment.

    The matrix describes the part of an error that later fixes cannot correct. It is the identity matrix for the
    output of a filter.
    """
    (first, last), count = span, len(filtered.propagation)
    identity = np.eye(filtered.information.shape[-1])
    if not is_smoothed:
        return {moment: np.broadcast_to(identity, P.shape) for moment, P in filtered.covariances.items()}
    adjoint, unrevealed = np.zeros_like(filtered.covariances[first]), {}
    for moment in range(count, first - 1, -1):
        if moment < count:
            step = filtered.propagation[moment]
            adjoint = _transposed(step) @ adjoint @ step + filtered.information[moment]
        if moment <= last:
            unrevealed[moment] = identity - adjoint @ filtered.covariances[moment]
    return unrevealed


def _integrals(navigation: _Navigation, order_count: int, *, is_smoothed: bool) -> tuple[Floats, Floats, Floats]:
    """Compute the fields `of_orders`, `beyond` and `at_middle` of an `AidedCovariance`."""
    timeline, half, span = navigation.timeline, navigation.half_s, navigation.span
    filtered = _filtered(navigation)
    unrevealed = _unrevealed(filtered, span, is_smoothed=is_smoothed)
    cases, size, degrees = half.size, navigation.fixes.state_size, 2 * np.arange(order_count) + 1.0
    at_middle, mean_square = np.empty((cases, size, size)), np.zeros((cases, 3, 3))
    # Sums over pairs of moments of the coefficients of the orders. `earlier` is the sum over all earlier moments with
    # their covariance P·Ψᵀ to the present moment.
    earlier, pairs = np.zeros((cases, order_count, 3, size)), np.zeros((cases, order_count, 3, order_count, 3))
    for moment in range(span[0], span[1] + 1):
        P, kept = filtered.covariances[moment], unrevealed[moment]
        is_middle = timeline.middle == moment
        at_middle[is_middle] = (P @ kept)[is_middle]
        weights = timeline.weights[moment]
        if np.any(weights):
            antenna = _antenna(navigation, moment)
            orders = np.polynomial.legendre.legvander(timeline.times[moment] / half, order_count - 1)
            coefficients = weights[:, None] * degrees * orders
            now, later = antenna @ P, kept @ _transposed(antenna)
            with_itself = now @ later
            mean_square += weights[:, None, None] * with_itself
            with_earlier = (earlier.reshape(cases, -1, size) @ later).reshape(cases, order_count, 3, 3)
            pairs += with_earlier[:, :, :, None] * coefficients[:, None, None, :, None]
            pairs += np.einsum("co,cp,cab->coapb", coefficients / 2, coefficients, with_itself)
            earlier += coefficients[:, :, None, None] * now[:, None]
        if moment < span[1]:
            step = _transposed(filtered.propagation[moment])
            earlier = (earlier.reshape(cases, -1, size) @ step).reshape(earlier.shape)
    of_orders = pairs + np.transpose(pairs, (0, 3, 4, 1, 2))
    resolved = np.einsum("coaob,o->cab", of_orders, 1 / degrees)
    return np.moveaxis(of_orders, 0, -1), np.moveaxis(mean_square - resolved, 0, -1), np.moveaxis(at_middle, 0, -1)


def _measurement(fixes: Fixes) -> tuple[Floats, Floats]:
    """Matrix H of a fix, (6, states), and the variances of its errors, (cases, 6)."""
    measured = np.zeros((6, fixes.state_size))
    measured[:3, POSITION] = measured[3:, VELOCITY] = np.eye(3)
    if fixes.state_size > FIX_WANDER.start:
        measured[:3, FIX_WANDER] = np.eye(3)
    variances = np.square(np.concatenate((fixes.position_m, fixes.velocity_mps), axis=1))
    return measured, np.minimum(variances, _NO_FIX_SIGMA_M**2)


def _start_covariance(start: StartSigmas, unit: InertialUnit, fixes: Fixes) -> Floats:
    """Covariance of the state at the start of the flight, (cases, states, states)."""
    size = fixes.state_size
    sigmas = np.zeros((start.heading_rad.size, size))
    sigmas[:, POSITION], sigmas[:, VELOCITY], sigmas[:, TILT] = start.position_m, start.velocity_mps, start.tilt_rad
    sigmas[:, TILT.stop - 1] = start.heading_rad
    sigmas[:, ACCELEROMETER_BIAS], sigmas[:, GYRO_BIAS] = unit.first_accelerometer_bias_mps2, unit.gyro_bias_radps
    if size > FIX_WANDER.start:
        sigmas[:, FIX_WANDER] = fixes.wander_m
    return np.asarray(np.square(sigmas)[:, :, None] * np.eye(size))


def _updated(P: Floats, measured: Floats, variances: Floats, is_taken: Booleans) -> tuple[Floats, Floats, Floats]:
    """Covariance after a fix, the matrix 1 − K·H, and the information Hᵀ·S⁻¹·H of the fix.

    `P` is the covariance before the fix, and `measured` is the matrix H. In cases in which `is_taken` is false, the
    fix has practically no effect, because its variances are set to a very large value.
    """
    R = np.where(is_taken[:, None], variances, _NO_FIX_SIGMA_M**2)
    seen = measured @ P
    S = seen @ measured.T
    S[:, range(6), range(6)] += R
    of_fix = measured.T @ np.linalg.solve(S, np.broadcast_to(measured, (len(P), *measured.shape)))
    remaining = np.eye(P.shape[-1]) - P @ of_fix
    updated = remaining @ P
    return (updated + _transposed(updated)) / 2, remaining, of_fix


def _antenna(navigation: _Navigation, moment: int) -> Floats:
    """Matrix B (cases, 3, states) by which errors e of the state displace the radar's antenna by B·e at a moment.

    A tilt ψ moves the antenna by ψ × l, with the lever arm l.
    """
    seen = np.zeros((navigation.half_s.size, 3, navigation.fixes.state_size))
    seen[:, range(3), range(POSITION.start, POSITION.stop)] = 1.0
    if navigation.flight.arm is not None:
        seen[:, :, TILT] = moved_by_tilt(navigation.flight.arm[moment])
    return seen


def _transposed(matrices: Floats) -> Floats:
    return np.swapaxes(matrices, -1, -2)
