"""Splines through the fixes of a log: a long path as several polynomials, each over a piece of time.

A spline of order 5 is continuous in position and in four derivatives; only the fifth jumps where pieces meet. Pieces
are halved where the fit leaves motion: a turn gets short pieces, the straight legs before and after it long pieces.

Two rules tell motion from noise. The information criterion counts coefficients against independent fixes, so that
white noise is not fitted. And the mean product of neighbouring residuals must fall at least by the square of the
number of coefficients. For motion by finite forces it does: even acceleration that is white noise leaves a residual
of variance h³ in pieces of length h. Noise of a receiver that wanders (Gauss-Markov) leaves h.
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
_MIN_HALF_FIXES = 3  # in each half of a piece that is halved
_HALVED_MOTION_FRACTION = 0.5  # pieces with more than this fraction of the largest motion are halved together


def basis(times: Floats, edges: Floats) -> Floats:
    """B-splines of pieces between rising edges (m + 1,) at times (n,), (n, m + `SPLINE_ORDER`).

    The first and the last piece go on beyond the edges. Source: the recursion of de Boor (1972) and Cox (1972).
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
    """A spline that fits fixes by least squares.

    Attributes
    ----------
    edges : (m + 1,)
        Times at which pieces begin and end. [s]
    center : (3,)
        Mean position of the fixes. The spline is relative to it, so that a distant position loses no digits. [m]
    series : (coefficients, 3)
        Coefficients of the spline. [m]
    residuals : (n, 3)
        Fixes less the spline. [m]
    root : (coefficients, coefficients)
        Its product with its transpose is the covariance of the coefficients over the variance of white fixes.
    """

    edges: Floats
    center: Floats
    series: Floats
    residuals: Floats
    root: Floats

    @classmethod
    def of(cls, times: Floats, positions: Floats, edges: Floats) -> "SplineFit":
        """Fit fixes (n, 3) [m] at times (n,) [s]."""
        design = basis(times, edges)
        root = np.linalg.inv(np.linalg.cholesky(design.T @ design)).T
        center = positions.mean(axis=0)
        series = root @ (root.T @ (design.T @ (positions - center)))
        residuals = positions - center - design @ series
        # Normal equations square the condition of the basis; the second step gives the digits back.
        series += root @ (root.T @ (design.T @ residuals))
        return cls(edges, center, series, positions - center - design @ series, root)

    @cached_property
    def motion(self) -> Floats:
        """Product of the residuals of each fix and the next fix, (n - 1,); its mean is 0 for white noise. [m²]"""
        return np.asarray((self.residuals[1:] * self.residuals[:-1]).sum(axis=1))

    def halved(self, times: Floats) -> Floats | None:
        """Edges after the pieces with the most motion are halved; None if no piece with motion can be halved."""
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
        """The path of the spline."""
        # Powers of the time from the middle of a piece, from SPLINE_ORDER + 1 nodes: exact but for rounding.
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
    """Coefficients about another time: Taylor's series by repeated synthetic division."""
    shifted = powers.copy()
    for first in range(len(shifted) - 1):
        for power in range(len(shifted) - 2, first - 1, -1):
            shifted[power] += by_s * shifted[power + 1]
    return [_vector(power) for power in shifted]
