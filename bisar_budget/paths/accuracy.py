"""Accuracy of a path as stated by its source: covariances, sigmas along axes, or only the size of the total error.

An ephemeris states covariances at epochs. Along the axes of the orbit (radial, in-track, cross-track) a covariance
changes little from one epoch to the next. It is therefore interpolated along these axes, and then converted to
Earth-fixed axes.
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

LOCAL_AXES = ("RTN", "TNW")  # axes of an orbit; `local_axes` also accepts the other CCSDS names for them
_EQUAL_VARIANCE_FRACTION = 1e-6  # rounding difference of equal variances after a rotation of the axes
_ROUNDED_EIGENVALUE_FRACTION = 1e-4  # of the largest eigenvalue; rounded digits may make one this far below 0
_AXES_SYNONYMS = {"RSW": "RTN", "RIC": "RTN", "QSW": "RTN"}
_ROUNDED_VARIANCE_FRACTION = 1e-12  # rounding of a velocity variance by the change of the axes' rate
_AXES_SUFFIXES = ("_INERTIAL", "_ROTATING")
_VELOCITY_STEP_S = 0.5


class StatedAccuracy(NamedTuple):
    """1-sigma error of a path as stated by its source.

    Attributes
    ----------
    words : str
        Description of the stated accuracy for reports.
    covariance : (3, 3) or (6, 6), optional
        Covariance of position [m²], or of position and velocity [m², m²/s, m²/s²], along Earth-fixed axes or
        along the axes of a scene.
    total : float
        Total position error, if the source states only its size and no covariance. [m]
    is_typical : bool
        True if the source states only the quality of its fixes. The error is then typical of fixes of this quality.
    """

    words: str
    covariance: Matrix | None = None
    total: float = 0.0
    is_typical: bool = False

    @property
    def position_m(self) -> float:
        """Total position error: root sum of squares over three axes, or `total` if there is no covariance. [m]"""
        variances = (
            [row[axis] for axis, row in enumerate(self.covariance[:3])] if self.covariance else [self.total**2]
        )
        return math.sqrt(max(math.fsum(variances), 0.0))


class PathNoise(NamedTuple):
    """Error of a path due to the noise of its log, as polynomials of slow time over the aperture.

    `modes` (modes, orders, 3) are the polynomial coefficients, in ascending powers of slow time. [m], [m/s], … Each
    mode is a 1-sigma error along one axis of the scene, and is independent of all other modes. Terms above order 8
    are neglected.
    """

    modes: tuple[tuple[Vector, ...], ...]


class CovarianceError(ValueError):
    """A matrix cannot be a covariance; the message tells why."""


def as_matrix(values: Floats) -> Matrix:
    """Make an array (n, n) exactly symmetric, and convert it to nested tuples of Python numbers."""
    return tuple(tuple(float(value) for value in row) for row in (values + values.T) / 2)


def as_rows(values: Floats) -> Matrix:
    """Convert a matrix to tuples of Python numbers, one tuple for each row."""
    return tuple(tuple(row) for row in np.asarray(values, dtype=float).tolist())


def diagonal(variances: Sequence[float]) -> Matrix:
    """Covariance matrix of independent errors with the given variances."""
    return as_matrix(np.diag(np.asarray(variances, dtype=float)))


def block_turned(covariance: Floats, axes: Floats) -> Floats:
    """Convert a covariance (3, 3) or (6, 6) to other axes, whose unit vectors are the rows of a matrix (3, 3)."""
    full = np.kron(np.eye(len(covariance) // 3), axes)
    return np.asarray(full @ covariance @ full.T)


def correlations(covariance: Floats) -> Matrix:
    """Correlation matrix of a covariance matrix (n, n).

    An error with zero variance has the correlation 0 with all other errors.
    """
    sigmas = np.sqrt(np.diag(covariance))
    scale = np.where(sigmas > 0, sigmas, 1.0)
    matrix = covariance / np.outer(scale, scale)
    np.fill_diagonal(matrix, 1.0)
    return as_matrix(matrix)


def covering_sigmas(covariance: Floats) -> Vector:
    """Sigmas (3,) of independent errors along three axes, large enough to cover a covariance (3, 3). [m], [m/s]

    In every direction, the variance of these errors is at least as large as the variance given by the covariance. For
    a diagonal covariance, the sigmas are the square roots of its diagonal. Otherwise they are larger by a factor of
    up to √3.
    """
    largest = float(np.linalg.eigvalsh(np.array(correlations(covariance)))[-1])
    factor = math.sqrt(largest) if largest > 1 + _EQUAL_VARIANCE_FRACTION else 1.0
    x, y, z = (factor * np.sqrt(np.diag(covariance))).tolist()
    return (x, y, z)


def held_to_covariance(values: Floats) -> Floats:
    """Correct rounding errors of a covariance matrix that keep it from being positive semi-definite.

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
    """Whether velocities in the axes with the CCSDS name `name` are relative to axes that rotate with the orbit.

    The names of such axes end with `_ROTATING`.
    """
    return name.endswith("_ROTATING")


def local_axes(name: str) -> str | None:
    """Convert the CCSDS name of axes that follow an orbit to `RTN` or `TNW`; None for any other axes."""
    for suffix in _AXES_SUFFIXES:
        name = name.removesuffix(suffix)
    name = _AXES_SYNONYMS.get(name, name)
    return name if name in LOCAL_AXES else None


@dataclass(frozen=True, eq=False)
class EpochCovariance:
    """Covariance (6, 6) of position and velocity at an epoch in TAI. [m², m²/s, m²/s²]

    `axes` is the name of the axes: `RTN` or `TNW` for axes of the orbit, `earth` for Earth-fixed axes, or `stars` for
    celestial axes, which `turn` converts to Earth-fixed axes. If `axes` is None, the axes are unknown, and only the
    total position variance is used. With `RTN` or `TNW`, velocities are relative to axes that rotate with the orbit
    if `is_rotating` is set, and inertial otherwise.
    """

    epoch: Instant
    values: Floats
    axes: str | None
    turn: Callable[[Vector, Instant], Vector] | None = None
    is_rotating: bool = False


class OrbitState(NamedTuple):
    """Position [m] and inertial velocity [m/s] of a satellite, both as components along Earth-fixed axes."""

    position: Vector
    velocity: Vector

    def axes(self, name: str) -> Floats:
        """Unit vectors of the axes `RTN` (radial, in-track, cross-track) or `TNW` (velocity, in-plane, cross-track).

        The vectors are the rows of the result (3, 3), given as components along Earth-fixed axes.
        """
        position, velocity = np.array(self.position), np.array(self.velocity)
        across = np.cross(position, velocity)
        across /= np.linalg.norm(across)
        first = (position if name == "RTN" else velocity) / np.linalg.norm(position if name == "RTN" else velocity)
        return np.array((first, np.cross(across, first), across))

    def rate(self, name: str) -> float:
        """Inertial angular rate at which the axes `RTN` or `TNW` rotate about the orbit normal. [rad/s]"""
        position, velocity = np.array(self.position), np.array(self.velocity)
        momentum = float(np.linalg.norm(np.cross(position, velocity)))
        if name == "RTN":
            return momentum / float(position @ position)
        # The velocity turns by gravity across it: |v × a|/v² with a = −μr/r³.
        turned = EARTH_GRAVITATIONAL_PARAMETER_M3_PER_S2 * momentum / float(np.linalg.norm(position)) ** 3
        return turned / float(velocity @ velocity)


def state_of(position_at: Callable[[Instant], Vector], instant: Instant, span: tuple[Instant, Instant]) -> OrbitState:
    """Position and inertial velocity of a satellite at an instant, computed from Earth-fixed positions.

    The velocity is a central difference of positions. `position_at` returns the Earth-fixed position at an instant
    within `span`, the first and last instant of the orbit.
    """
    first = max(instant.after(-_VELOCITY_STEP_S), span[0])
    last = min(instant.after(_VELOCITY_STEP_S), span[1])
    position_before, position, position_after = (np.array(position_at(time)) for time in (first, instant, last))
    velocity = (position_after - position_before) / last.since(first)
    against_stars = velocity + np.cross((0.0, 0.0, ROTATION_RATE_RAD_PER_S), position)
    (x, y, z), (u, v, w) = position.tolist(), against_stars.tolist()
    return OrbitState((x, y, z), (u, v, w))


def with_rate(covariance: Floats, rate: Sequence[float] | Floats) -> Floats:
    """Convert the velocities of a covariance (6, 6) to axes that rotate differently: δv becomes δv + rate × δr.

    `rate` (3,) [rad/s] is the angular rate of the old axes relative to the new axes.
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
    """Accuracy of an ephemeris at an instant, along Earth-fixed axes, from the covariances in its file.

    Between two epochs the covariance is interpolated linearly along the axes of the orbit. Before the first and after
    the last epoch, the covariance of the nearest epoch is used. A covariance of zero counts as missing. The result is
    None if no covariance is stated. The function `place` returns the Earth-fixed position [m] at an instant.
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
    """Convert a covariance to radial, in-track and cross-track axes; velocities become inertial velocities."""
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
