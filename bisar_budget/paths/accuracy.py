"""The accuracy that the source of a path states: covariances, sigmas, and figures without a direction.

An ephemeris states covariances at epochs. In the orbit's axes (radial, in-track, cross-track) a covariance changes
little from one epoch to the next. It is interpolated in these axes, and then turned to the Earth.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bisar_budget.constants import EARTH_GRAVITATIONAL_PARAMETER_M3_PER_S2
from bisar_budget.geometry import Vector
from bisar_budget.paths.earth import ROTATION_RATE_RAD_PER_S, Floats
from bisar_budget.paths.instant import Instant, utc

Matrix = tuple[tuple[float, ...], ...]

LOCAL_AXES = ("RTN", "TNW")  # of an orbit; other names of CCSDS for the same axes are in `local_axes`
_EQUAL_VARIANCE_FRACTION = 1e-6  # difference of equal variances after a turn of axes
_ROUNDED_EIGENVALUE_FRACTION = 1e-4  # of the largest; a matrix with few digits may have one this far below 0
_AXES_SYNONYMS = {"RSW": "RTN", "RIC": "RTN", "QSW": "RTN"}
_ROUNDED_VARIANCE_FRACTION = 1e-12  # of a velocity's variance by the turn of axes
_AXES_SUFFIXES = ("_INERTIAL", "_ROTATING")
_VELOCITY_STEP_S = 0.5


class StatedAccuracy(NamedTuple):
    """The one-sigma error that the source of a path states.

    Attributes
    ----------
    words : str
        The statement in reports.
    covariance : (3, 3) or (6, 6), optional
        Covariance of the position [m²], or of position and velocity [m², m²/s, m²/s²], along the axes of the Earth or
        of a scene.
    total : float
        Error without a direction, from a source without covariance. [m]
    is_typical : bool
        Whether the figure is not stated, but usual for the quality that the source states.
    """

    words: str
    covariance: Matrix | None = None
    total: float = 0.0
    is_typical: bool = False

    @property
    def position_m(self) -> float:
        """Root-sum-square of the stated position error over its axes, or `total` without a covariance. [m]"""
        variances = (
            [row[axis] for axis, row in enumerate(self.covariance[:3])] if self.covariance else [self.total**2]
        )
        return math.sqrt(max(math.fsum(variances), 0.0))


class PathNoise(NamedTuple):
    """The error of a path by the noise of its log, as polynomials of slow time over the aperture.

    `modes` (modes, orders, 3) are coefficients of slow time to the power 0, 1, … [m], [m/s], …. Each mode is an error
    of one sigma along one axis of the scene, and is independent of all further modes. Errors beyond order 8 are left
    out.
    """

    modes: tuple[tuple[Vector, ...], ...]


class CovarianceError(ValueError):
    """Numbers that are no covariance."""


def as_matrix(values: Floats) -> Matrix:
    """A symmetric matrix as tuples of plain numbers."""
    return tuple(tuple(float(value) for value in row) for row in (values + values.T) / 2)


def as_rows(values: Floats) -> Matrix:
    """A matrix as tuples of plain numbers."""
    return tuple(tuple(row) for row in np.asarray(values, dtype=float).tolist())


def diagonal(variances: Sequence[float]) -> Matrix:
    """Covariance of independent errors."""
    return as_matrix(np.diag(np.asarray(variances, dtype=float)))


def block_turned(covariance: Floats, axes: Floats) -> Floats:
    """A covariance (3, 3) or (6, 6) along other axes, the rows of a matrix (3, 3)."""
    full = np.kron(np.eye(len(covariance) // 3), axes)
    return np.asarray(full @ covariance @ full.T)


def correlations(covariance: Floats) -> Matrix:
    """Correlation matrix of a covariance. An error without variance has no correlation."""
    sigmas = np.sqrt(np.diag(covariance))
    scale = np.where(sigmas > 0, sigmas, 1.0)
    matrix = covariance / np.outer(scale, scale)
    np.fill_diagonal(matrix, 1.0)
    return as_matrix(matrix)


def covering_sigmas(covariance: Floats) -> Vector:
    """Sigmas of independent errors with at least the variance of a covariance (3, 3) in every direction. [m], [m/s]

    For independent errors they are the sigmas of the covariance, and otherwise up to √3 times as large.
    """
    largest = float(np.linalg.eigvalsh(np.array(correlations(covariance)))[-1])
    factor = math.sqrt(largest) if largest > 1 + _EQUAL_VARIANCE_FRACTION else 1.0
    x, y, z = (factor * np.sqrt(np.diag(covariance))).tolist()
    return (x, y, z)


def held_to_covariance(values: Floats) -> Floats:
    """The nearest covariance to a matrix that is not quite a covariance because of rounding.

    Raises
    ------
    CovarianceError
        A variance is negative, or a correlation is clearly beyond ±1.
    """
    variances = np.diag(values)
    if (variances < 0).any():
        raise CovarianceError("has a negative variance")
    sigmas = np.sqrt(variances)
    scale = np.where(sigmas > 0, sigmas, 1.0)
    sizes, directions = np.linalg.eigh(values / np.outer(scale, scale))
    if sizes[0] < -_ROUNDED_EIGENVALUE_FRACTION * max(float(sizes[-1]), 1.0):
        raise CovarianceError("is not positive semi-definite: no error has such a covariance")
    correlation = (directions * np.maximum(sizes, 0.0)) @ directions.T
    return np.asarray(correlation * np.outer(scale, scale))


# ---------------------------------------------------------------------- covariances of an orbit
def turns_with_orbit(name: str) -> bool:
    """Whether a name of CCSDS for axes of an orbit says that velocities are those in axes that turn with it."""
    return name.endswith("_ROTATING")


def local_axes(name: str) -> str | None:
    """`RTN` or `TNW` from a name of CCSDS for axes that turn with an orbit; None for any further name."""
    for suffix in _AXES_SUFFIXES:
        name = name.removesuffix(suffix)
    name = _AXES_SYNONYMS.get(name, name)
    return name if name in LOCAL_AXES else None


@dataclass(frozen=True, eq=False)
class EpochCovariance:
    """Covariance (6, 6) of position and velocity at an epoch of TAI. [m², m²/s, m²/s²]

    `axes` are `RTN` or `TNW`, `earth` for axes that are fixed to the Earth, or `stars` for axes that `turn` turns to
    the Earth. None means unknown axes: then only the total variance counts. Velocities in axes of an orbit are
    against the stars, or in axes that turn with the orbit if `is_rotating`.
    """

    epoch: Instant
    values: Floats
    axes: str | None
    turn: Callable[[Vector, Instant], Vector] | None = None
    is_rotating: bool = False


class OrbitState(NamedTuple):
    """Position, and velocity against the stars, along the axes of the Earth. [m], [m/s]"""

    position: Vector
    velocity: Vector

    def axes(self, name: str) -> Floats:
        """Unit vectors of the axes `RTN` (radial, in-track, cross-track) or `TNW` (velocity, in-plane, cross-track).

        The vectors are the rows of the result (3, 3), along the axes of the Earth.
        """
        position, velocity = np.array(self.position), np.array(self.velocity)
        across = np.cross(position, velocity)
        across /= np.linalg.norm(across)
        first = (position if name == "RTN" else velocity) / np.linalg.norm(position if name == "RTN" else velocity)
        return np.array((first, np.cross(across, first), across))

    def rate(self, name: str) -> float:
        """Rate at which `RTN` or `TNW` turn about the orbit's normal, against the stars. [rad/s]"""
        position, velocity = np.array(self.position), np.array(self.velocity)
        momentum = float(np.linalg.norm(np.cross(position, velocity)))
        if name == "RTN":
            return momentum / float(position @ position)
        # The velocity turns by gravity across it: |v × a|/v² with a = −μr/r³.
        turned = EARTH_GRAVITATIONAL_PARAMETER_M3_PER_S2 * momentum / float(np.linalg.norm(position)) ** 3
        return turned / float(velocity @ velocity)


def state_of(position_at: Callable[[Instant], Vector], instant: Instant, span: tuple[Instant, Instant]) -> OrbitState:
    """State of an orbit from its Earth-fixed positions near an instant of a span, by a central difference."""
    first = max(instant.after(-_VELOCITY_STEP_S), span[0])
    last = min(instant.after(_VELOCITY_STEP_S), span[1])
    position_before, position, position_after = (np.array(position_at(time)) for time in (first, instant, last))
    velocity = (position_after - position_before) / last.since(first)
    against_stars = velocity + np.cross((0.0, 0.0, ROTATION_RATE_RAD_PER_S), position)
    (x, y, z), (u, v, w) = position.tolist(), against_stars.tolist()
    return OrbitState((x, y, z), (u, v, w))


def with_rate(covariance: Floats, rate: Sequence[float] | Floats) -> Floats:
    """Covariance (6, 6) in axes that turn less by a rate [rad/s]: δv becomes δv + rate × δr.

    A velocity of which only rounding is left has no variance.
    """
    x, y, z = rate
    matrix = np.eye(6)
    matrix[3:, :3] = ((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0))
    turned = matrix @ covariance @ matrix.T
    rounding = _ROUNDED_VARIANCE_FRACTION * np.dot(rate, rate) * np.trace(covariance[:3, :3])
    is_known = np.diag(turned) > np.array((-1.0, -1.0, -1.0, rounding, rounding, rounding))
    return np.where(np.logical_and.outer(is_known, is_known), turned, 0.0)


def stated_of_orbit(
    covariances: Sequence[EpochCovariance],
    place: Callable[[Instant], Vector],
    instant: Instant,
    span: tuple[Instant, Instant],
) -> StatedAccuracy | None:
    """Accuracy that the covariances of an ephemeris state at an instant of its span, along the axes of the Earth.

    Between two epochs the covariance is interpolated linearly in the orbit's axes. Outside all epochs the nearest
    epoch counts. None without a covariance; a covariance of zero counts as missing.
    """
    nonzero = (covariance for covariance in covariances if np.trace(covariance.values[:3, :3]) > 0)
    stated = sorted(nonzero, key=lambda covariance: covariance.epoch)
    if not stated:
        return None
    epochs = [utc(covariance.epoch) for covariance in stated]
    after = sum(instant.since(epoch) >= 0 for epoch in epochs)
    nearest = sorted({max(after - 1, 0), min(after, len(stated) - 1)})
    words = f"covariance{'s' * (len(nearest) > 1)} of {' and '.join(epochs[index].as_text() for index in nearest)}"
    if any(stated[index].axes is None for index in nearest):
        total = max(math.sqrt(float(np.trace(stated[index].values[:3, :3]))) for index in nearest)
        return StatedAccuracy(f"{words}, in axes that are not known", total=total)

    def along_orbit(index: int) -> Floats:
        time = min(max(epochs[index], span[0]), span[1])
        return _covariance_along_orbit(stated[index], state_of(place, time, span), time)

    at_epochs = [along_orbit(index) for index in nearest]
    if len(nearest) > 1:
        first, last = (epochs[index] for index in nearest)
        fraction = instant.since(first) / max(last.since(first), 1e-9)
        interpolated = (1 - fraction) * at_epochs[0] + fraction * at_epochs[1]
    else:
        interpolated = at_epochs[0]
    state = state_of(place, instant, span)
    along_stars = block_turned(interpolated, state.axes("RTN").T)
    return StatedAccuracy(words, as_matrix(with_rate(along_stars, (0.0, 0.0, -ROTATION_RATE_RAD_PER_S))))


def _covariance_along_orbit(covariance: EpochCovariance, state: OrbitState, instant: Instant) -> Floats:
    """A covariance along radial, in-track and cross-track, for a velocity against the stars."""
    if covariance.axes in LOCAL_AXES:
        values = covariance.values
        if covariance.is_rotating:
            values = with_rate(values, (0.0, 0.0, state.rate(covariance.axes)))
        fixed = block_turned(values, state.axes(covariance.axes).T)
    elif covariance.turn is not None:
        turned_axes = [covariance.turn(axis, instant) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
        fixed = block_turned(covariance.values, np.array(turned_axes).T)
    else:
        fixed = with_rate(covariance.values, (0.0, 0.0, ROTATION_RATE_RAD_PER_S))
    return block_turned(fixed, state.axes("RTN"))
