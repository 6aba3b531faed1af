"""Splines through the fixes of a log: a long path as a sequence of polynomials, each valid for a piece of time.

A spline of order 5 is continuous in position and in four derivatives; only the fifth derivative jumps between pieces.
A piece is halved if its residual still contains motion. A turn is therefore fitted with short pieces, and the
straight legs before and after it with long pieces.

Two rules separate motion from noise. First, an information criterion weighs the number of coefficients against the
number of independent fixes, so that white noise is not fitted. Second, the mean product of neighbouring residuals
must decrease at least with the inverse square of the number of coefficients. Motion due to finite forces meets the
second rule: even if the acceleration is white noise, the residual in pieces of length h has a variance proportional
to h³. Slowly varying receiver noise (Gauss-Markov) does not meet it: its residual has a variance proportional to h.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bisar_budget.geometry import Pieces, PlatformState, Vector

Floats = NDArray[np.float64]

SPLINE_ORDER = 5
MIN_PIECE_S = 1.0  # faster motion is vibration, which has rows of its own
_MIN_HALF_FIXES = 3  # smallest number of fixes in each half of a piece that is halved
_HALVED_MOTION_FRACTION = 0.5  # pieces with more than this fraction of the largest motion are halved together


def basis(times: Floats, edges: Floats) -> Floats:
    """Values of all B-splines at given times, (n, m + `SPLINE_ORDER`).

    There are n times, and m pieces with ascending edges (m + 1,). The first and the last piece continue beyond the
    edges. Source: the recursion of de Boor (1972) and Cox (1972).
    """
    pieces = len(edges) - 1
    knots = np.concatenate([np.full(SPLINE_ORDER, edges[0]), edges, np.full(SPLINE_ORDER, edges[-1])])
    piece = np.clip(np.searchsorted(edges, times, "right") - 1, 0, pieces - 1)
    # In a piece only SPLINE_ORDER + 1 B-splines differ from zero: `nonzero` has their values, and no 0/0 occurs.
    nonzero = np.ones((len(times), 1))
    for order in range(1, SPLINE_ORDER + 1):
        after = knots[piece[:, None] + SPLINE_ORDER + 1 + np.arange(order)]
        before = knots[piece[:, None] + SPLINE_ORDER + 1 - order + np.arange(order)]
        share = nonzero / (after - before)
        nonzero = np.zeros((len(times), order + 1))
        nonzero[:, :-1] = (after - times[:, None]) * share
        nonzero[:, 1:] += (times[:, None] - before) * share
    matrix = np.zeros((len(times), pieces + SPLINE_ORDER))
    np.put_along_axis(matrix, piece[:, None] + np.arange(SPLINE_ORDER + 1), nonzero, axis=1)
    return matrix


@dataclass(frozen=True, eq=False)
class SplineFit:
    """Least-squares fit of a spline to fixes.

    Attributes
    ----------
    edges : (m + 1,)
        Times at which pieces begin and end. [s]
    center : (3,)
        Mean position of the fixes [m]. The spline is relative to this position, so that no digits are lost if the
        fixes are far from the origin.
    series : (coefficients, 3)
        Coefficients of the spline. [m]
    residuals : (n, 3)
        Positions of the fixes minus the spline. [m]
    root : (coefficients, coefficients)
        Matrix whose product with its transpose is the covariance of the coefficients if the fixes have white noise of
        variance 1.
    """

    edges: Floats
    center: Floats
    series: Floats
    residuals: Floats
    root: Floats

    @classmethod
    def of(cls, times: Floats, positions: Floats, edges: Floats) -> "SplineFit":
        """Fit a spline with the given edges to fixes (n, 3) [m] at times (n,) [s]."""
        design = basis(times, edges)
        root = np.linalg.inv(np.linalg.cholesky(design.T @ design)).T
        center = positions.mean(axis=0)
        series = root @ (root.T @ (design.T @ (positions - center)))
        residuals = positions - center - design @ series
        # Normal equations square the condition number, and so lose digits; the second step restores these digits.
        series += root @ (root.T @ (design.T @ residuals))
        return cls(edges, center, series, positions - center - design @ series, root)

    @cached_property
    def motion(self) -> Floats:
        """Scalar products of neighbouring residuals, which show motion of the platform, (n - 1,). [m²]

        The mean of the products is 0 if the residuals are white noise, and positive if they contain motion.
        """
        return np.asarray((self.residuals[1:] * self.residuals[:-1]).sum(axis=1))

    def halved(self, times: Floats) -> Floats | None:
        """Halve the pieces of the spline whose residuals contain the most motion; return the new edges.

        `times` (n,) [s] are the times of the fixes. Returns None if no piece with motion can be halved.
        """
        lengths, middles = np.diff(self.edges), (self.edges[1:] + self.edges[:-1]) / 2
        piece = np.clip(np.searchsorted(self.edges, times, "right") - 1, 0, len(middles) - 1)
        early = np.bincount(piece, times < middles[piece], len(middles))
        late = np.bincount(piece, minlength=len(middles)) - early
        is_divisible = (lengths >= 2 * MIN_PIECE_S) & (np.minimum(early, late) >= _MIN_HALF_FIXES)
        motion = np.where(is_divisible, np.bincount(piece[:-1], self.motion, len(middles)), 0.0)
        if not motion.max() > 0:
            return None
        return np.sort(np.concatenate([self.edges, middles[motion >= _HALVED_MOTION_FRACTION * motion.max()]]))

    def state(self) -> PlatformState:
        """The spline as a `PlatformState`, a path with one polynomial for each piece."""
        # Coefficients about the middle of a piece, from values at SPLINE_ORDER + 1 nodes; exact except for rounding.
        middles, halves = (self.edges[1:] + self.edges[:-1]) / 2, np.diff(self.edges) / 2
        nodes = np.cos(np.pi * (np.arange(SPLINE_ORDER + 1) + 0.5) / (SPLINE_ORDER + 1))
        values = (basis((middles[:, None] + halves[:, None] * nodes).ravel(), self.edges) @ self.series).reshape(
            len(middles), SPLINE_ORDER + 1, 3
        )
        powers = np.linalg.solve(np.vander(nodes, SPLINE_ORDER + 1, increasing=True), values)
        powers /= halves[:, None, None] ** np.arange(SPLINE_ORDER + 1)[:, None]
        powers[:, 0] += self.center
        middle_piece = min(max(int(np.searchsorted(self.edges, 0.0, "right")) - 1, 0), len(middles) - 1)
        position, velocity, (x, y, z), *bends = _shifted(powers[middle_piece], -middles[middle_piece])
        vectors = [[_vector(power) for power in piece] for piece in powers]
        return PlatformState(
            position=position,
            velocity=velocity,
            acceleration=(2 * x, 2 * y, 2 * z),
            bends=tuple(bends),
            curve=Pieces(tuple(self.edges[1:-1].tolist()), tuple(middles.tolist()), tuple(map(tuple, vectors))),
        )


def _vector(values: Iterable[float]) -> Vector:
    x, y, z = (float(value) for value in values)
    return (x, y, z)


def _shifted(powers: Floats, by_s: float) -> list[Vector]:
    """Move the origin of time of a polynomial from 0 to `by_s` [s]; return its coefficients about the new origin.

    These are the coefficients of its Taylor series, computed by repeated synthetic division.
    """
    shifted = powers.copy()
    for first in range(len(shifted) - 1):
        for power in range(len(shifted) - 2, first - 1, -1):
            shifted[power] += by_s * shifted[power + 1]
    return [_vector(power) for power in shifted]
