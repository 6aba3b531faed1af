"""Small symmetric matrices without an array library: `check` loads none."""

import math
from collections.abc import Sequence
from operator import mul

_SWEEPS = 30  # convergence is quadratic: a 6 x 6 takes about five


def quadratic_form(matrix: Sequence[Sequence[float]], vector: Sequence[float]) -> float:
    """Σ mᵢⱼ vᵢ vⱼ of a positive semi-definite matrix (n, n); what rounding leaves below zero is zero."""
    total: float = sum([v * sum(map(mul, row, vector)) for row, v in zip(matrix, vector, strict=True) if v])
    return max(0.0, total)


def exceed(matrix: Sequence[Sequence[float]], floor: float) -> bool:
    """Whether all eigenvalues of a symmetric matrix (n, n) are above a floor: the pivots of LDLᵀ, shifted, are.

    A thirtieth of the work of finding them.
    """
    n = len(matrix)
    a = [[x - floor * (i == j) for j, x in enumerate(row)] for i, row in enumerate(matrix)]
    for k in range(n):
        pivot = a[k][k]
        if pivot <= 0:
            return False
        for i in range(k + 1, n):
            factor = a[i][k] / pivot
            if factor:
                a[i] = [x - factor * y for x, y in zip(a[i], a[k], strict=True)]
    return True


def eigensystem(matrix: Sequence[Sequence[float]]) -> tuple[list[float], list[list[float]]]:
    """Eigenvalues of a symmetric matrix (n, n) and, as columns, its unit eigenvectors, in no order.

    By Jacobi's rotations.
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
