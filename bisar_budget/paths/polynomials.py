"""Polynomials of slow time that are paths: least squares through places, and changes of their basis."""

from collections.abc import Iterable
from functools import cache
from typing import TYPE_CHECKING

from bisar_budget.geometry import STRAIGHT, PlatformState, Vector

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]


def least_squares(at: "Floats", places: "Floats", order: int) -> tuple["Floats", "Floats"]:
    """Legendre series of an order through places, and what it leaves of them.

    Parameters
    ----------
    at : (n,) ndarray
        Where the places are, -1 … 1.
    places : (n, 3) ndarray
        [m]

    Returns
    -------
    (order + 1, 3) ndarray, (n, 3) ndarray
        Coefficients, and places less the series. [m]
    """
    import numpy as np

    legendre = np.polynomial.legendre.legvander(at, order)
    coefficients: Floats = np.asarray(np.linalg.lstsq(legendre, places, rcond=None)[0], dtype=float)
    return coefficients, places - legendre @ coefficients


def powers_of(coefficients: "Floats", half_s: float) -> "Floats":
    """Coefficients (order + 1, 3) of τ⁰, τ¹, … of a Legendre series over -`half_s` … `half_s`. [m], [m/s], …"""
    import numpy as np

    count = len(coefficients)
    powers = np.zeros((count, 3))
    for axis in range(3):
        found = np.polynomial.legendre.leg2poly(coefficients[:, axis])  # without the highest that are zero
        powers[: len(found), axis] = found
    return powers / half_s ** np.arange(count)[:, None]


def path_of(powers: Iterable[Iterable[float]]) -> PlatformState:
    """A path from its coefficients of τ⁰, τ¹, …, at least two; the highest bends that are zero are left out."""
    vectors: list[Vector] = [(float(x), float(y), float(z)) for x, y, z in powers]
    position, velocity, (x, y, z), *bends = vectors if len(vectors) > 2 else [*vectors, STRAIGHT]
    while bends and bends[-1] == STRAIGHT:
        bends.pop()
    return PlatformState(position=position, velocity=velocity, acceleration=(2 * x, 2 * y, 2 * z), bends=tuple(bends))


@cache
def powers_of_chebyshev(count: int) -> tuple[tuple[float, ...], ...]:
    """Coefficients of powers in Chebyshev's polynomials T₀ …, row by row."""
    rows = [[1.0], [0.0, 1.0]]
    while len(rows) < count:
        last, before = rows[-1], rows[-2]
        doubled = [0.0, *(2 * one for one in last)]
        rows.append([a - b for a, b in zip(doubled, [*before, 0.0, 0.0], strict=True)])
    return tuple(tuple(row + [0.0] * (count - len(row))) for row in rows[:count])
