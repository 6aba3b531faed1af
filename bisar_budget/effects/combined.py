"""Errors together in many cases: the arrays beside `effects.combine` and `effects.correlation`."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.effects.correlation import correlated_errors
from bisar_budget.mission.model import Mission
from bisar_budget.ranges.exact_ranges import Floats

Phases = Sequence[tuple[str, Floats]]  # by row id, signed [rad]
Moves = Mapping[str, tuple[Floats, Floats]]  # by row id, east and north [m]


class ManyCorrelated(NamedTuple):
    """The six errors of a covariance, by the ids of their rows, and their correlations (6, 6); as `Correlated`."""

    id: str
    ids: tuple[str, ...]
    correlation: Sequence[Sequence[Any]]

    def of(self, some: NDArray[Any]) -> "ManyCorrelated":
        """The same in some of the cases."""
        rows = [[rho[some] if np.ndim(rho) else rho for rho in row] for row in self.correlation]
        return self._replace(correlation=rows)


def many_correlated(mission: Mission) -> tuple[ManyCorrelated, ...]:
    """List the covariances of a mission; nothing for nearly every one."""
    return tuple(ManyCorrelated(one.id, one.ids, one.correlation) for one in correlated_errors(mission))


def squared(correlation: Sequence[Sequence[Any]], parts: Sequence[Any]) -> Any:
    """What correlated parts add up to, squared: Σ ρᵢⱼvᵢvⱼ; what rounding leaves below zero is zero."""
    rows = [sum(rho * v for rho, v in zip(row, parts, strict=True)) for row in correlation]
    return np.maximum(0.0, sum(v * row for v, row in zip(parts, rows, strict=True)))


def combined_phase(phases: Phases, rule: str, groups: Sequence[ManyCorrelated] = ()) -> Any:
    """Combine phases by a rule, those of a covariance with their correlations; as `combined_phase`. [rad]"""
    left, parts = dict(phases), []
    if rule == "rss":
        for group in groups:
            if left.keys() >= set(group.ids):
                parts.append(np.sqrt(squared(group.correlation, [left.pop(row_id) for row_id in group.ids])))
    return combined([*parts, *left.values()], rule)


def combined(parts: Sequence[Floats], rule: str) -> Any:
    """Combine phases or lengths by a rule: the largest, the sum of magnitudes or the root-sum-square."""
    if not parts:
        return 0.0
    sizes = np.abs(np.array(parts))
    if rule == "each":
        return sizes.max(axis=0)
    return sizes.sum(axis=0) if rule == "sum" else np.sqrt((sizes**2).sum(axis=0))


def combined_displacement(moves: Moves, rule: str, groups: Sequence[ManyCorrelated]) -> Any:
    """Combine displacements by `each` or `rss`, those of a covariance by the trace of theirs. [m]"""
    left, parts = dict(moves), []
    if rule == "rss":
        for group in groups:
            if left.keys() >= set(group.ids):
                of_axes = zip(*(left.pop(row_id) for row_id in group.ids), strict=True)
                parts.append(np.sqrt(sum(squared(group.correlation, along) for along in of_axes)))
    return combined([*parts, *(np.hypot(*move) for move in left.values())], rule)


def largest_signed_sum(vectors: Floats) -> Floats:
    """Length of the longest of the sums ±v₁ ± v₂ …, (cases,), of vectors (n, 2, cases); as `largest_signed_sum`."""
    x, y = vectors[:, 0], vectors[:, 1]
    is_upper = (y > 0) | ((y == 0) & (x > 0))
    x, y = np.where(is_upper, x, -x), np.where(is_upper, y, -y)
    order = np.argsort(np.arctan2(y, x), axis=0)
    x, y = np.take_along_axis(x, order, axis=0), np.take_along_axis(y, order, axis=0)
    corners_x, corners_y = (part.sum(axis=0) - 2 * np.cumsum(part, axis=0) for part in (x, y))
    whole = np.hypot(x.sum(axis=0), y.sum(axis=0))
    return np.asarray(np.maximum(whole, np.hypot(corners_x, corners_y).max(axis=0)))
