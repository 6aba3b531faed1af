"""Search for the largest sizes for which sums of their powers stay within limits: a geometric program.

Let x be the logarithms of the sizes. The constraint of each row, Σ aᵢ·e^(p·xᵢ) ≤ room, is convex, and the objective Σ
wᵢ·xᵢ is linear, so there is one maximum. It is found by a barrier method: a barrier keeps the sizes within the
constraints, and Newton's method follows the maximum while the barrier is weakened step by step. The method is
described in Boyd & Vandenberghe, Convex Optimization, Sections 4.5 and 11.3; its formulas for this problem are
derived here.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bisar_budget.arrays import Booleans, Floats


@dataclass(frozen=True)
class BarrierSettings:
    """Settings of the barrier method.

    Attributes
    ----------
    gap_fraction : float
        Largest allowed difference between Σ w·x and its maximum, as a fraction of Σ w.
    firmness_factor : float
        Factor by which the weight of the objective relative to the barrier grows in each round.
    max_newton_steps : int
        Largest number of Newton steps in each round; ten are usually enough.
    decrement_ratio : float
        A round ends when half the square of Newton's decrement is below this value.
    """

    gap_fraction: float = 1e-8
    firmness_factor: float = 30.0
    max_newton_steps: int = 60
    decrement_ratio: float = 1e-9


_BARRIER = BarrierSettings()


class Rows(NamedTuple):
    """Constraints Σ aᵢ·sᵢ^p ≤ room on sizes s, one for each row.

    `share` are the coefficients a, (rows, sizes). `power` are the exponents p, (rows,). `room` are the right-hand
    sides, (rows,).
    """

    share: Floats
    power: Floats
    room: Floats

    def at(self, x: Floats) -> Floats:
        """Compute the fraction of each row's right-hand side that each size takes up, (rows, sizes).

        The sizes are e^x. The right-hand side of a row's constraint is its `room`.
        """
        fractions: Floats = self.share * np.exp(self.power[:, None] * x) / self.room[:, None]
        return fractions

    def with_rows(self, further: "Rows") -> "Rows":
        """Make new constraints that consist of the rows of these constraints, followed by the rows of `further`."""
        return Rows(*(np.concatenate(both) for both in zip(self, further, strict=True)))

    def of_sizes(self, chosen: Booleans) -> "Rows":
        """Make new constraints that contain only the columns of the chosen sizes; `chosen` is a mask (sizes,)."""
        return self._replace(share=self.share[:, chosen])


class Largest(NamedTuple):
    """Solution of a geometric program: logarithms of the largest sizes, and a multiplier for each row.

    A row is a constraint on the sizes (see `Rows`). The multipliers satisfy Σⱼ multiplierⱼ·partⱼᵢ = weightᵢ. Here
    weightᵢ is the weight of size i in the objective Σ wᵢ·log sᵢ, and partⱼᵢ is the fraction of the right-hand side of
    row j that size i takes up.
    """

    log: Floats
    multipliers: Floats


def largest_sizes(weights: Floats, rows: Rows) -> Largest:
    """Find the sizes sᵢ that maximise Σ wᵢ·log sᵢ while every constraint of `rows` holds.

    Parameters
    ----------
    weights : (sizes,)
        Weights wᵢ, all of which are positive.
    rows : Rows
        Constraints. The right-hand side (`room`) of each row is positive, and each size has a positive coefficient in
        at least one row.
    """
    with np.errstate(divide="ignore"):
        alone = (np.log(rows.room[:, None] / rows.share) - np.log(2 * weights.size)) / rows.power[:, None]
    x: Floats = alone.min(axis=0)  # half of every room is left
    firmness, count = max(1.0, float(weights.sum())), rows.room.size
    while True:
        for _ in range(_BARRIER.max_newton_steps):
            part = rows.at(x)
            left = 1 - part.sum(axis=1)
            slope = rows.power[:, None] * part / left[:, None]  # of each row's barrier
            gradient = slope.sum(axis=0) - firmness * weights
            curvature = np.diag((rows.power[:, None] * slope).sum(axis=0)) + slope.T @ slope
            step = -np.linalg.solve(curvature, gradient)
            decrement = float(-gradient @ step)
            if decrement / 2 < _BARRIER.decrement_ratio:
                break
            x = _towards(x, step, gradient, firmness * weights, rows)
        if count / firmness < _BARRIER.gap_fraction * max(1.0, float(weights.sum())):
            part = rows.at(x)
            multipliers = rows.power / (firmness * (1 - part.sum(axis=1)))
            return Largest(x, multipliers)
        firmness *= _BARRIER.firmness_factor


def _towards(x: Floats, step: Floats, gradient: Floats, pull: Floats, rows: Rows) -> Floats:
    """Take a Newton step, and return the new logarithms of the sizes, (sizes,).

    The step is halved until the function to minimise, which is the negative objective plus the barrier, falls enough
    and no row exceeds its right-hand side (`room`). `pull` are the weights of the objective relative to the barrier,
    (sizes,).
    """
    before, falls = _value(x, pull, rows), float(gradient @ step)
    length = min(1.0, 2.0 / float(np.abs(step).max()))
    while _value(x + length * step, pull, rows) > before + 0.1 * length * falls and length > 1e-12:
        length /= 2
    there: Floats = x + length * step
    return there


def _value(x: Floats, pull: Floats, rows: Rows) -> float:
    left = 1 - rows.at(x).sum(axis=1)
    return float(-np.log(left).sum() - pull @ x) if (left > 0).all() else np.inf
