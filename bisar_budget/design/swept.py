"""What a sweep finds, as columns of arrays: one value a case."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Values = NDArray[np.float64] | NDArray[np.object_]


class Column(NamedTuple):
    """One column of a sweep: its name, unit (SI; empty: a text, or a number without one) and what it holds."""

    name: str
    unit: str
    words: str
    is_text: bool = False

    @property
    def heading(self) -> str:
        """Name and unit, as a table and an axis have them."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


class Part(NamedTuple):
    """Cases `start` to `stop` of a sweep, in their order.

    `values` holds an array (stop - start,) of each column by its name: float64, NaN where there is no value, or
    texts, empty where there is none. `by_case` counts the cases that were checked one by one, as `check` does,
    because arrays do not hold what they need.
    """

    start: int
    stop: int
    values: Mapping[str, Values]
    by_case: int


@dataclass(frozen=True, eq=False)
class Swept:
    """A sweep: what its columns are, and its parts as they are found.

    `shape` is that of the grid of cases, one axis for each key that varies, the last the fastest; None where the
    cases are a table or a sample. `varied` names the columns that vary, in that order.
    """

    mission_name: str
    mission_sha256: str
    varied: tuple[str, ...]
    shape: tuple[int, ...] | None
    count: int
    columns: tuple[Column, ...]
    parts: Iterator[Part]
