"""The cases of a sweep: which keys of a mission vary, and their values in each case."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from bisar_budget.design.quantities import Number

Floats = NDArray[np.float64]


class Cases(Protocol):
    """Cases by their number, from 0 to `count`."""

    numbers: tuple[Number, ...]
    count: int
    shape: tuple[int, ...] | None

    def values(self, start: int, stop: int) -> Mapping[str, Floats]:
        """Value of each key, in SI, of some cases: (stop - start,) by the key."""


@dataclass(frozen=True)
class Grid:
    """Every combination of the values of each key; the last key is the fastest."""

    numbers: tuple[Number, ...]
    axes: tuple[Floats, ...]

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each key."""
        return tuple(axis.size for axis in self.axes)

    @property
    def count(self) -> int:
        """Number of cases; beyond what an array could hold too."""
        total = 1
        for axis in self.axes:
            total *= axis.size
        return total

    def values(self, start: int, stop: int) -> Mapping[str, Floats]:
        """Value of each key, in SI, of some cases: (stop - start,) by the key."""
        places = np.unravel_index(np.arange(start, stop), self.shape)
        return {number.key: axis[place] for number, axis, place in zip(self.numbers, self.axes, places, strict=True)}
