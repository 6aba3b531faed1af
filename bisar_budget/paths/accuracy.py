"""The accuracy that the source of a path states of itself: covariances, sigmas, and figures without a direction.

A covariance of an ephemeris is known at epochs of its own. In the orbit's axes (radial, in-track, cross-track) it
changes little from one epoch to the next: there it is interpolated, and turned to the Earth where the path is flown.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bisar_budget.geometry import Vector
from bisar_budget.paths.earth import ROTATION_RATE, Floats
from bisar_budget.paths.instant import Instant, utc

Matrix = tuple[tuple[float, ...], ...]

LOCAL_AXES = ("RTN", "TNW")  # of an orbit; other names of CCSDS for the same axes are in `local_axes`
_EQUAL = 1e-6  # relative, of variances that turning axes leaves alike
_ROUNDED_EIGENVALUE = 1e-4  # of the largest: so far below zero, a matrix has been written with few digits
_SAME_AXES = {"RSW": "RTN", "RIC": "RTN", "QSW": "RTN"}
_SUFFIXES = ("_INERTIAL", "_ROTATING")
_VELOCITY_STEP_S = 0.5


class StatedAccuracy(NamedTuple):
    """The error that the source of a path states of itself, one sigma.

    `covariance` is that of the position (3, 3) [m²], or of position and velocity (6, 6) [m², m²/s, m²/s²], along the
    axes of the Earth or of a scene. A source that names no direction has a `total` instead [m]: in whatever direction
    the error is. A typical figure is usual for what the source says of itself, and stated by nobody.
    """

    words: str
    covariance: Matrix | None = None
    total: float = 0.0
    is_typical: bool = False

    @property
    def position_m(self) -> float:
        """Root-sum-square of the position error over its axes, or what the source states without a direction. [m]"""
        variances = (
            [row[axis] for axis, row in enumerate(self.covariance[:3])] if self.covariance else [self.total**2]
        )
        return math.sqrt(max(math.fsum(variances), 0.0))


class PathNoise(NamedTuple):
    """The error of a path by the noise of its log, as polynomials of slow time over the aperture.

    `modes` (modes, orders, 3) are coefficients of slow time to the power 0, 1, …: errors of one sigma each along one
    axis of the scene, independent of each other [m], [m/s], …. What errs faster than order 8 is left out.
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
    """Covariance of errors that are independent."""
    return as_matrix(np.diag(np.asarray(variances, dtype=float)))


def block_turned(covariance: Floats, axes: Floats) -> Floats:
    """A covariance (3, 3) or (6, 6) along other axes, the rows of a matrix (3, 3)."""
    full = np.kron(np.eye(len(covariance) // 3), axes)
    return np.asarray(full @ covariance @ full.T)


def correlations(covariance: Floats) -> Matrix:
    """Correlation matrix of a covariance; an error without a variance is correlated with none."""
    sigmas = np.sqrt(np.diag(covariance))
    scale = np.where(sigmas > 0, sigmas, 1.0)
    found = covariance / np.outer(scale, scale)
    np.fill_diagonal(found, 1.0)
    return as_matrix(found)


def covering_sigmas(covariance: Floats) -> Vector:
    """Sigmas of independent errors that have, in no direction, less variance than a covariance (3, 3). [m], [m/s]

    They are its own sigmas where these are independent, and up to √3 times as large where they are not.
    """
    largest = float(np.linalg.eigvalsh(np.array(correlations(covariance)))[-1])
    factor = math.sqrt(largest) if largest > 1 + _EQUAL else 1.0
    x, y, z = (factor * np.sqrt(np.diag(covariance))).tolist()
    return (x, y, z)


def held_to_covariance(values: Floats) -> Floats:
    """The nearest covariance to numbers that rounding has left a little beside one.

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
    if sizes[0] < -_ROUNDED_EIGENVALUE * max(float(sizes[-1]), 1.0):
        raise CovarianceError("is not positive semi-definite: no error has such a covariance")
    held = (directions * np.maximum(sizes, 0.0)) @ directions.T
    return np.asarray(held * np.outer(scale, scale))


# ---------------------------------------------------------------------- covariances of an orbit
def local_axes(name: str) -> str | None:
    """`RTN` or `TNW` of a name of CCSDS for axes that turn with an orbit; None for other names."""
    for suffix in _SUFFIXES:
        name = name.removesuffix(suffix)
    name = _SAME_AXES.get(name, name)
    return name if name in LOCAL_AXES else None


@dataclass(frozen=True, eq=False)
class EpochCovariance:
    """Covariance (6, 6) of position and velocity at an epoch of TAI. [m², m²/s, m²/s²]

    `axes` are `RTN` or `TNW`, `earth` for axes that are fixed to the Earth, or `stars` for axes that `turn` takes to
    the Earth. None: axes that are not known, of which only the total counts.
    """

    epoch: Instant
    values: Floats
    axes: str | None
    turn: Callable[[Vector, Instant], Vector] | None = None


class OrbitState(NamedTuple):
    """Place and velocity against the stars, along the axes of the Earth. [m], [m/s]"""

    place: Vector
    velocity: Vector

    def axes(self, name: str) -> Floats:
        """Rows of `RTN` (radial, in-track, cross-track) or `TNW` (along the velocity, in-plane, cross-track)."""
        place, velocity = np.array(self.place), np.array(self.velocity)
        across = np.cross(place, velocity)
        across /= np.linalg.norm(across)
        first = (place if name == "RTN" else velocity) / np.linalg.norm(place if name == "RTN" else velocity)
        return np.array((first, np.cross(across, first), across))


def state_of(place: Callable[[Instant], Vector], instant: Instant, span: tuple[Instant, Instant]) -> OrbitState:
    """State of an orbit from its Earth-fixed places near an instant of a span, by a central difference."""
    first = max(instant.after(-_VELOCITY_STEP_S), span[0])
    last = min(instant.after(_VELOCITY_STEP_S), span[1])
    before, here, after = (np.array(place(time)) for time in (first, instant, last))
    moved = (after - before) / last.since(first)
    against_stars = moved + np.cross((0.0, 0.0, ROTATION_RATE), here)
    (x, y, z), (u, v, w) = here.tolist(), against_stars.tolist()
    return OrbitState((x, y, z), (u, v, w))


def _turning(sign: float) -> Floats:
    """Change of place and velocity (6, 6) by the Earth's rotation: to a velocity against the stars, or back."""
    found = np.eye(6)
    found[3:, :3] = sign * ROTATION_RATE * np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    return found


def stated_of_orbit(
    covariances: Sequence[EpochCovariance],
    place: Callable[[Instant], Vector],
    instant: Instant,
    span: tuple[Instant, Instant],
) -> StatedAccuracy | None:
    """Accuracy that the covariances of an ephemeris state at an instant of its span, along the axes of the Earth.

    Between two epochs it is linear, in the orbit's axes; outside them that of the nearest epoch. None where there is
    no covariance, or where it is zero, which states nothing.
    """
    known = sorted((one for one in covariances if np.trace(one.values[:3, :3]) > 0), key=lambda one: one.epoch)
    if not known:
        return None
    epochs = [utc(one.epoch) for one in known]
    after = sum(instant.since(epoch) >= 0 for epoch in epochs)
    near = sorted({max(after - 1, 0), min(after, len(known) - 1)})
    words = f"covariance{'s' * (len(near) > 1)} of {' and '.join(epochs[index].as_text() for index in near)}"
    if any(known[index].axes is None for index in near):
        total = max(math.sqrt(float(np.trace(known[index].values[:3, :3]))) for index in near)
        return StatedAccuracy(f"{words}, in axes that are not known", total=total)

    def along_orbit(index: int) -> Floats:
        own = min(max(epochs[index], span[0]), span[1])
        return _along_orbit(known[index], state_of(place, own, span), own)

    parts = [along_orbit(index) for index in near]
    if len(near) > 1:
        first, last = (epochs[index] for index in near)
        share = instant.since(first) / max(last.since(first), 1e-9)
        values = (1 - share) * parts[0] + share * parts[1]
    else:
        values = parts[0]
    here = state_of(place, instant, span)
    along_stars = block_turned(values, here.axes("RTN").T)
    back = _turning(-1.0)
    return StatedAccuracy(words, as_matrix(back @ along_stars @ back.T))


def _along_orbit(one: EpochCovariance, state: OrbitState, instant: Instant) -> Floats:
    """A covariance along radial, in-track and cross-track, of a velocity against the stars."""
    if one.axes in LOCAL_AXES:
        fixed = block_turned(one.values, state.axes(one.axes).T)
    elif one.turn is not None:
        ends = np.array([one.turn(axis, instant) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))])
        fixed = block_turned(one.values, ends.T)
    else:
        turning = _turning(1.0)
        fixed = turning @ one.values @ turning.T
    return block_turned(fixed, state.axes("RTN"))
