"""Splines through the fixes of a log: as many polynomials as a long path needs, each over a piece of time.

A spline of order 5 is continuous in place and in four derivatives; only the fifth jumps where pieces meet. Pieces are
halved where the fit leaves motion: a turn gets short pieces, the straight legs beside it long ones.

Motion is told from noise by two rules. The information criterion counts coefficients against independent fixes, so
that white noise is not fitted. And what neighbouring residuals have in common must fall by the square of the number
of coefficients at least. Motion by finite forces does: even acceleration that is white noise leaves a residual of
variance h³ in pieces of length h. Noise of a receiver that wanders (Gauss-Markov) leaves h.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bisar_budget.geometry import Pieces, PlatformState, Vector

Floats = NDArray[np.float64]

ORDER = 5
SHORTEST_S = 1.0  # of a piece; what bends a path faster than that is vibration, which has rows of its own
_FEWEST_FIXES = 3  # in each half of a piece that is halved
_OUTSTANDING = 0.5  # of the largest motion that a piece leaves: pieces with more are halved together


def basis(times: Floats, edges: Floats) -> Floats:
    """B-splines of pieces between rising edges (m + 1,) at times (n,), (n, m + `ORDER`).

    The first and the last piece go on beyond the edges. Source: the recursion of de Boor (1972) and Cox (1972).
    """
    pieces = len(edges) - 1
    knots = np.concatenate([np.full(ORDER, edges[0]), edges, np.full(ORDER, edges[-1])])
    which = np.clip(np.searchsorted(edges, times, "right") - 1, 0, pieces - 1)
    # Only ORDER + 1 of them differ from zero in a piece: `near` holds those, and none is 0/0.
    near = np.ones((len(times), 1))
    for order in range(1, ORDER + 1):
        after = knots[which[:, None] + ORDER + 1 + np.arange(order)]
        before = knots[which[:, None] + ORDER + 1 - order + np.arange(order)]
        share = near / (after - before)
        near = np.zeros((len(times), order + 1))
        near[:, :-1] = (after - times[:, None]) * share
        near[:, 1:] += (times[:, None] - before) * share
    found = np.zeros((len(times), pieces + ORDER))
    np.put_along_axis(found, which[:, None] + np.arange(ORDER + 1), near, axis=1)
    return found


@dataclass(frozen=True, eq=False)
class SplineFit:
    """A spline of pieces between edges (m + 1,) [s] by least squares: coefficients, and what it leaves of fixes [m].

    The coefficients are those of the way from a `middle` (3,): digits of a far place are not lost in it. `root`
    (coefficients, coefficients) times its transpose is the covariance of the coefficients, over the variance of white
    fixes.
    """

    edges: Floats
    middle: Floats
    series: Floats
    left: Floats
    root: Floats

    @classmethod
    def of(cls, times: Floats, places: Floats, edges: Floats) -> "SplineFit":
        """Fit fixes (n, 3) [m] at times (n,) [s]."""
        design = basis(times, edges)
        root = np.linalg.inv(np.linalg.cholesky(design.T @ design)).T
        middle = places.mean(axis=0)
        series = root @ (root.T @ (design.T @ (places - middle)))
        left = places - middle - design @ series
        # Normal equations square the condition of the basis; the second step gives the digits back.
        series += root @ (root.T @ (design.T @ left))
        return cls(edges, middle, series, places - middle - design @ series, root)

    @cached_property
    def motion(self) -> Floats:
        """Product of the residual of each fix and the next one, (n - 1,): white noise has none in the mean. [m²]"""
        return np.asarray((self.left[1:] * self.left[:-1]).sum(axis=1))

    def halved(self, times: Floats) -> Floats | None:
        """Edges with the pieces halved that leave the most motion; None where none leaves any, or can be halved."""
        lengths, middles = np.diff(self.edges), (self.edges[1:] + self.edges[:-1]) / 2
        which = np.clip(np.searchsorted(self.edges, times, "right") - 1, 0, len(middles) - 1)
        early = np.bincount(which, times < middles[which], len(middles))
        late = np.bincount(which, minlength=len(middles)) - early
        can_be = (lengths >= 2 * SHORTEST_S) & (np.minimum(early, late) >= _FEWEST_FIXES)
        left = np.where(can_be, np.bincount(which[:-1], self.motion, len(middles)), 0.0)
        if not left.max() > 0:
            return None
        return np.sort(np.concatenate([self.edges, middles[left >= _OUTSTANDING * left.max()]]))

    def state(self) -> PlatformState:
        """The path that it is, from whose midpoint time counts."""
        # Powers of the time from the middle of a piece, by values in as many places: exact but for rounding.
        middles, halves = (self.edges[1:] + self.edges[:-1]) / 2, np.diff(self.edges) / 2
        places = np.cos(np.pi * (np.arange(ORDER + 1) + 0.5) / (ORDER + 1))
        values = (basis((middles[:, None] + halves[:, None] * places).ravel(), self.edges) @ self.series).reshape(
            len(middles), ORDER + 1, 3
        )
        powers = np.linalg.solve(np.vander(places, ORDER + 1, increasing=True), values)
        powers /= halves[:, None, None] ** np.arange(ORDER + 1)[:, None]
        powers[:, 0] += self.middle
        here = min(max(int(np.searchsorted(self.edges, 0.0, "right")) - 1, 0), len(middles) - 1)
        position, velocity, (x, y, z), *bends = _shifted(powers[here], -middles[here])
        vectors = [[_vector(power) for power in piece] for piece in powers]
        return PlatformState(
            position=position,
            velocity=velocity,
            acceleration=(2 * x, 2 * y, 2 * z),
            bends=tuple(bends),
            curve=Pieces(tuple(self.edges[1:-1].tolist()), tuple(middles.tolist()), tuple(map(tuple, vectors))),
        )


def _vector(values: Any) -> Vector:
    x, y, z = (float(value) for value in values)
    return (x, y, z)


def _shifted(powers: Floats, by_s: float) -> list[Vector]:
    """Coefficients about another time: Taylor's series by repeated synthetic division."""
    found = powers.copy()
    for first in range(len(found) - 1):
        for power in range(len(found) - 2, first - 1, -1):
            found[power] += by_s * found[power + 1]
    return [_vector(power) for power in found]
