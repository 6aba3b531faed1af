"""Combination of the phases, or of the displacements on the ground, that several errors cause.

The rules are the largest magnitude, the sum, and the root-sum-square. Under root-sum-square the errors of a
covariance C count as a single error with the effect √(gᵀCg), where gᵢ is the effect of one unit of error i. In terms
of the effects φᵢ = gᵢσᵢ and the correlations ρᵢⱼ, gᵀCg = Σ ρᵢⱼφᵢφⱼ. The result does not depend on the frame of the
covariance, because the effects are computed along the axes of the same frame.

Phases and displacements are arrays over cases, (cases,). For a single case they may be numbers.
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

Phases = Sequence[tuple[str, PerCase]]  # pairs of row id and signed phase [rad]
Moves = Sequence[tuple[str, tuple[PerCase, PerCase]]]  # pairs of row id and displacement, east and north [m]


Size = TypeVar("Size")  # effect of an error: a phase or a displacement


class Correlated(NamedTuple):
    """The six errors of a platform's covariance: the ids of their rows, and their correlations (6, 6).

    They are three position errors and three velocity errors, in this order.
    """

    platform: str
    ids: tuple[str, ...]
    correlation: Sequence[Sequence[PerCase]]

    @property
    def id(self) -> str:
        """Id of the combined error that replaces six correlated errors in a list of phases or displacements."""
        return f"{self.platform}.covariance"

    def of(self, cases: Indices) -> "Correlated":
        """Return a copy of the covariance that has only the correlations in the cases with the given indices."""
        rows = [
            [rho[cases] if isinstance(rho, np.ndarray) and rho.ndim else rho for rho in row]
            for row in self.correlation
        ]
        return self._replace(correlation=rows)

    def phase(self, phases: Sequence[PerCase] | Floats) -> PerCase:
        """Combined phase √(gᵀCg) of the six errors of a platform that have the covariance C. [rad]

        `phases` are the phases gᵢσᵢ of the six errors. The result is infinite if any of them is infinite.
        """
        with np.errstate(invalid="ignore"):
            size = np.sqrt(squared(self.correlation, phases))
        return np.where(np.isnan(size), math.inf, size)[()]

    def displacement(self, moves: Sequence[tuple[PerCase, PerCase]]) -> tuple[PerCase, PerCase]:
        """Rms length of the displacement that six correlated errors cause together, as the pair (length, 0). [m]

        `moves` [m] are the displacements of the six errors, east and north. The length is the root of the trace of
        the covariance of the combined displacement. The combined displacement has no direction.
        """
        length = np.sqrt(sum(squared(self.correlation, along) for along in zip(*moves, strict=True)))
        return length, 0.0 * length


def correlated_errors(mission: Mission) -> tuple[Correlated, ...]:
    """List the covariances that a mission file states for its platforms; empty if it states no covariance."""
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
    """Variance Σ ρᵢⱼvᵢvⱼ of the sum of correlated parts with the sigmas vᵢ, in the squared unit of the parts.

    A negative result, due to rounding, is set to zero.
    """
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

    `phases` are pairs of this form for the single errors. Under `rss` the six errors of a covariance become a single
    entry. Under all other rules they remain six entries.
    """
    return _parts(phases, rule, groups, Correlated.phase)


def displacement_parts(
    moves: Moves, rule: str, groups: Sequence[Correlated]
) -> list[tuple[str, tuple[PerCase, PerCase]]]:
    """List the displacements that a rule combines, as pairs of id and (east, north). [m]

    The errors of a covariance are treated as in `phase_parts`.
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
    """Combined phase of several errors under a rule. [rad]

    Under `rss` the phases of the six errors of a covariance are combined with the correlations of these errors.
    """
    return combined([phase for _, phase in phase_parts(phases, rule, groups)], rule)


def combined_displacement(moves: Moves, rule: str, groups: Sequence[Correlated] = ()) -> PerCase:
    """Length of the combined displacement of several errors under a rule. [m]

    Under `sum` it is the largest length of the vector sum over all combinations of signs. Under `rss` the errors of a
    covariance contribute the rms length of their combined displacement.
    """
    vectors = np.array([move for _, move in displacement_parts(moves, rule, groups)])
    if not vectors.size:
        return 0.0
    return largest_signed_sum(vectors) if rule == "sum" else combined(np.hypot(vectors[:, 0], vectors[:, 1]), rule)


def combined(sizes: Sequence[PerCase] | Floats, rule: str) -> PerCase:
    """Combine the magnitudes of phases or lengths (n, ...) under a rule; the result is (...), in the same unit.

    The rule `each` takes the largest magnitude, `sum` the sum of the magnitudes, and `rss` their root-sum-square. The
    result is 0 if there are no magnitudes.
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
    To find the corners, every vector in the lower half plane is reversed, and the vectors are sorted by angle.
    Reversing one vector after another then gives the corners of one half of the polygon. The second half is its
    mirror image.
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
    """Notes, one for each covariance, on how a combination rule treats its correlations."""
    if rule == "rss":
        return tuple(phrases.note("counted-as-one", group=group.id) for group in groups)
    return tuple(phrases.note("correlations-unused", group=group.id) for group in groups)


def likely_error(group: Correlated, members: Sequence[ErrorSource]) -> tuple[float, ...]:
    """Most probable values (6,) of the six errors of a covariance, given that they together cause the phase √(gᵀCg).

    `members` are the six errors in the order of the covariance. The values are Cg/√(gᵀCg). The phase is the
    first-order quadratic phase of the full model. The values are along the axes of the covariance's frame, in SI
    units, and include the coverage factor. If the phase is zero, each value is the declared size of its error.
    """
    sizes = np.array([source.declared or 0.0 for source in members])
    phases = sizes * [source.full.qpe for source in members]
    total = group.phase(phases)
    return tuple((sizes * (np.array(group.correlation) @ phases) / total if total else sizes).tolist())
