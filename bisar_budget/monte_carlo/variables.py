"""Variables that are drawn, and what the draws are held to. Needs NumPy, as all of this room does."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.constants import UTILIZATION_TOLERANCE
from bisar_budget.effects.effect import ErrorSource

Floats = NDArray[np.float64]


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
