"""Variables that are drawn, and what the draws are held to. Needs NumPy, as all of this room does."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.constants import UTILIZATION_TOLERANCE
from bisar_budget.effects.effect import ErrorSource

Floats = NDArray[np.float64]

_SWEEPS = 30  # convergence is quadratic: a 6 x 6 takes about five


class Variable(NamedTuple):
    """One standard variable, mean 0 and variance 1, and what it does.

    `of` is the error, or the covariance, that it belongs to. `parts` are the errors it makes, and how much of each
    [unit]; none where it is noise, which is phases alone. Effects: quadratic and cubic phase at the aperture edge
    [rad], displacement east and north [m].
    """

    id: str
    of: str
    owner: str
    distribution: str
    parts: tuple[tuple[ErrorSource, float], ...]
    effects: tuple[float, float, float, float]


class HeldSum(NamedTuple):
    """A requirement before the draws: the sum of whose errors, in which effects, is held to which limit."""

    id: str
    unit: str
    limit: float
    owners: tuple[str, ...]
    columns: tuple[int, ...]  # of the effects: one phase, or east and north

    def holds(self, square: Floats) -> NDArray[np.bool_]:
        """Whether sums whose squares are given are within the limit."""
        held: NDArray[np.bool_] = square <= (self.limit * (1 + UTILIZATION_TOLERANCE)) ** 2
        return held


def eigensystem(matrix: Sequence[Sequence[float]]) -> tuple[list[float], list[list[float]]]:
    """Eigenvalues of a symmetric matrix (n, n) and, as columns, its unit eigenvectors, in no order.

    By Jacobi's rotations. Of equal eigenvalues LAPACK takes other vectors than these, and a seed would draw others.
    """
    n = len(matrix)
    a = [list(row) for row in matrix]
    v = [[float(i == j) for j in range(n)] for i in range(n)]
    # Below this an element moves no eigenvalue by more than rounding does.
    negligible = 1e-17 * max((abs(x) for row in a for x in row), default=0.0)
    for _ in range(_SWEEPS):
        is_done = True
        for p in range(n - 1):
            for q in range(p + 1, n):
                if abs(a[p][q]) <= negligible:
                    continue
                is_done = False
                theta = (a[q][q] - a[p][p]) / (2 * a[p][q])
                t = math.copysign(1.0, theta) / (abs(theta) + math.hypot(theta, 1.0))
                cosine = 1 / math.hypot(t, 1.0)
                _rotate(a, v, p, q, cosine, t * cosine)
        if is_done:
            break
    return [a[i][i] for i in range(n)], v


def _rotate(a: list[list[float]], v: list[list[float]], p: int, q: int, c: float, s: float) -> None:
    """Turn the plane of p and q so that a[p][q] vanishes; `v` collects the turns."""
    for row in (*a, *v):
        row[p], row[q] = c * row[p] - s * row[q], s * row[p] + c * row[q]
    upper, lower = a[p], a[q]
    a[p] = [c * x - s * y for x, y in zip(upper, lower, strict=True)]
    a[q] = [s * x + c * y for x, y in zip(upper, lower, strict=True)]
    a[p][q] = a[q][p] = 0.0
