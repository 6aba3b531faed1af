"""Combination of several errors by worst case or root-sum-square, for phases and displacements on the ground.

Under root-sum-square the errors of one covariance C count as one error, √(gᵀCg). With gᵢ the effect of one unit of
error i and φᵢ = gᵢσᵢ, gᵀCg is Σ ρᵢⱼφᵢφⱼ. The result does not depend on the frame: the covariance stays in its own
frame, and the effects are taken along the axes of that frame.

Phases and displacements are arrays over cases, (cases,). For one case they may be numbers.
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeVar

import numpy as np

from bisar_budget import phrases
from bisar_budget.arrays import Floats, Indices, PerCase
from bisar_budget.effects.effect import PLATFORMS, ErrorSource, subject
from bisar_budget.geometry import FRAME_AXES
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import MotionError
from bisar_budget.phrases import Note

Phases = Sequence[tuple[str, PerCase]]  # by row id, signed [rad]
Moves = Sequence[tuple[str, tuple[PerCase, PerCase]]]  # by row id, east and north [m]


Size = TypeVar("Size")  # of an error: a phase, or a displacement


class Correlated(NamedTuple):
    """The six errors of a platform's covariance: the ids of their rows, and their correlations (6, 6)."""

    platform: str
    ids: tuple[str, ...]
    correlation: Sequence[Sequence[PerCase]]

    @property
    def id(self) -> str:
        """Id of the six errors as one entry."""
        return f"{self.platform}.covariance"

    def of(self, cases: Indices) -> "Correlated":
        """Return the covariance of some of the cases."""
        rows = [
            [rho[cases] if isinstance(rho, np.ndarray) and rho.ndim else rho for rho in row]
            for row in self.correlation
        ]
        return self._replace(correlation=rows)

    def phase(self, phases: Sequence[PerCase] | Floats) -> PerCase:
        """Combined phase √(gᵀCg) of the six errors, from their phases gᵢσᵢ. [rad]

        Infinite if any of the phases is infinite.
        """
        with np.errstate(invalid="ignore"):
            size = np.sqrt(squared(self.correlation, phases))
        return np.where(np.isnan(size), math.inf, size)[()]

    def displacement(self, moves: Sequence[tuple[PerCase, PerCase]]) -> tuple[PerCase, PerCase]:
        """Rms length of the combined displacement, as the pair (length, 0). [m]

        The length is the root of the trace of the displacement's covariance. The combined displacement has no
        direction.
        """
        length = np.sqrt(sum(squared(self.correlation, along) for along in zip(*moves, strict=True)))
        return length, 0.0 * length


def correlated_errors(mission: Mission) -> tuple[Correlated, ...]:
    """List the covariances of a mission. Nearly every mission has none."""
    groups = []
    for name in PLATFORMS:
        error: MotionError = getattr(mission.platforms, name).motion_error
        if error.covariance is not None:
            ids = tuple(
                subject(name, kind, axis, error.frame).id
                for kind in ("position", "velocity")
                for axis in FRAME_AXES[error.frame]
            )
            groups.append(Correlated(name, ids, error.covariance.correlation))
    return tuple(groups)


def squared(correlation: Sequence[Sequence[PerCase]], parts: Sequence[PerCase] | Floats) -> PerCase:
    """Square of a sum of correlated parts, Σ ρᵢⱼvᵢvⱼ. A result below zero, due to rounding, is set to zero."""
    values = np.array(np.broadcast_arrays(*parts))
    if any(np.ndim(rho) for row in correlation for rho in row):  # the correlations differ between cases
        of_cases = np.array([np.broadcast_arrays(*row, values[0])[:-1] for row in correlation])
        square: PerCase = np.maximum(0.0, np.einsum("ijc,ic,jc->c", of_cases, values, values))
    else:
        square = np.maximum(0.0, np.einsum("ij,i...,j...->...", np.array(correlation), values, values))
    return square


# ---------------------------------------------------------------------- terms of a combination
def phase_parts(phases: Phases, rule: str, groups: Sequence[Correlated]) -> list[tuple[str, PerCase]]:
    """List the phases that a rule combines, as pairs of id and phase. [rad]

    Under `rss` the six errors of a covariance are one entry; under all other rules they are six entries.
    """
    return _parts(phases, rule, groups, Correlated.phase)


def displacement_parts(
    moves: Moves, rule: str, groups: Sequence[Correlated]
) -> list[tuple[str, tuple[PerCase, PerCase]]]:
    """List the displacements that a rule combines, as pairs of id and (east, north). [m]

    A covariance is treated as in `phase_parts`.
    """
    return _parts(moves, rule, groups, Correlated.displacement)


def _parts(
    named_sizes: Sequence[tuple[str, Size]],
    rule: str,
    groups: Sequence[Correlated],
    combine: Callable[[Correlated, list[Size]], Size],
) -> list[tuple[str, Size]]:
    if rule != "rss" or not groups:  # few missions have a covariance
        return list(named_sizes)
    singles, combined_parts = dict(named_sizes), []
    for group in groups:
        if singles.keys() >= set(group.ids):
            combined_parts.append((group.id, combine(group, [singles.pop(row_id) for row_id in group.ids])))
    return [*combined_parts, *singles.items()]


# ---------------------------------------------------------------------- combined sizes
def combined_phase(phases: Phases, rule: str, groups: Sequence[Correlated] = ()) -> PerCase:
    """Combine the phases of errors by a rule. [rad]

    Under `rss` the phases of the six errors of a covariance are combined with the correlations of these errors.
    """
    return combined([phase for _, phase in phase_parts(phases, rule, groups)], rule)


def combined_displacement(moves: Moves, rule: str, groups: Sequence[Correlated] = ()) -> PerCase:
    """Combine displacements by a rule. [m]

    `sum` takes the longest vector sum over all signs of the displacements. `rss` uses the rms length of a covariance.
    """
    vectors = np.array([move for _, move in displacement_parts(moves, rule, groups)])
    if not vectors.size:
        return 0.0
    return largest_signed_sum(vectors) if rule == "sum" else combined(np.hypot(vectors[:, 0], vectors[:, 1]), rule)


def combined(sizes: Sequence[PerCase] | Floats, rule: str) -> PerCase:
    """Combine phases or lengths (n, ...) by a rule.

    `each` takes the largest magnitude, `sum` the sum of the magnitudes, and `rss` the root-sum-square.
    """
    if not len(sizes):
        return 0.0
    magnitudes: Floats = np.abs(np.array(sizes))
    total: PerCase
    if rule == "each":
        total = magnitudes.max(axis=0)
    elif rule == "sum":
        total = magnitudes.sum(axis=0)
    else:
        total = np.sqrt((magnitudes**2).sum(axis=0))
    return total


def largest_signed_sum(vectors: Floats) -> PerCase:
    """Length of the longest of all sums ±v₁ ± v₂ … of plane vectors (n, 2, ...), computed exactly.

    All sums lie in a polygon that has two sides parallel to each vector. The longest sum is a corner of this polygon.
    With every vector turned into the upper half plane and the vectors sorted by angle, reversing one vector after
    another gives the corners of one half of the polygon. The other half is its mirror image.
    """
    x, y = vectors[:, 0], vectors[:, 1]
    is_upper = (y > 0) | ((y == 0) & (x > 0))
    x, y = np.where(is_upper, x, -x), np.where(is_upper, y, -y)
    order = np.argsort(np.arctan2(y, x), axis=0)
    x, y = np.take_along_axis(x, order, axis=0), np.take_along_axis(y, order, axis=0)
    corners_x, corners_y = (component.sum(axis=0) - 2 * np.cumsum(component, axis=0) for component in (x, y))
    longest: PerCase = np.hypot(corners_x, corners_y).max(axis=0, initial=0.0)
    return longest


# ---------------------------------------------------------------------- notes
def correlation_notes(rule: str, groups: Sequence[Correlated]) -> tuple[Note, ...]:
    """Notes on how an aggregate treats covariances."""
    if rule == "rss":
        return tuple(phrases.note("counted-as-one", group=group.id) for group in groups)
    return tuple(phrases.note("correlations-unused", group=group.id) for group in groups)


def likely_error(group: Correlated, members: Sequence[ErrorSource]) -> tuple[float, ...]:
    """Most probable six errors of a covariance that together cause the phase √(gᵀCg): Cg/√(gᵀCg), (6,).

    The phase is the quadratic phase of the full model. The components are along the axes of the covariance's frame
    and include the coverage factor. If the phase is zero, each component is its sigma.
    """
    sizes = np.array([source.declared or 0.0 for source in members])
    phases = sizes * [source.full.qpe for source in members]
    total = group.phase(phases)
    return tuple((sizes * (np.array(group.correlation) @ phases) / total if total else sizes).tolist())
