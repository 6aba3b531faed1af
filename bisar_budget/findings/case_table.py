"""Cases of a sweep: the varied keys, the values of each case, and the columns of the results."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.arrays import Floats
from bisar_budget.mission.quantities import Number, Varied

Values = Floats | NDArray[np.object_]  # numbers in SI, or words
_FLOAT_DIGITS = 15  # decimal digits that every float keeps


@dataclass(frozen=True, eq=False)
class Cases:
    """Cases of a sweep: the varied keys, and for each key a column of values.

    Values are numbers in SI, or strings. The cases of a grid are all combinations of the values of the columns, and
    the last key varies fastest. Without a grid all columns have the same length, and each case consists of one value
    from each column.
    """

    varied: tuple[Varied, ...]
    columns: tuple[Values, ...]
    is_grid: bool = False

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the array of cases: the number of values of each key for a grid, otherwise the number of cases."""
        return tuple(column.size for column in (self.columns if self.is_grid else self.columns[:1]))

    @property
    def count(self) -> int:
        """Number of cases, which may be too large for an array."""
        return math.prod(self.shape)

    def values(self, start: int, stop: int) -> Mapping[str, Values]:
        """Values of the cases `start` to `stop` - 1, as an array (stop - start,) for each key."""
        indices: Sequence[slice | NDArray[np.intp]] = [slice(start, stop)] * len(self.columns)
        if self.is_grid:
            indices = np.unravel_index(np.arange(start, stop), self.shape)
        columns = zip(self.varied, self.columns, indices, strict=True)
        return {varied.key: column[index] for varied, column, index in columns}


def in_unit(number: Number, values: Floats) -> Floats:
    """Convert values from SI to the unit of a number.

    A converted value is rounded if the rounded value converts back to the same SI value.
    """
    factor, divisor = number.scale
    values_in_unit: Floats = values / factor * divisor
    rounded = rounded_values(values_in_unit)
    return np.where(rounded * factor / divisor == values, rounded, values_in_unit)


def rounded_values(values: Floats) -> Floats:
    """Round numbers to `_FLOAT_DIGITS` digits, so that 0.30000000000000004 becomes 0.3."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        power = _FLOAT_DIGITS - 1 - np.floor(np.log10(np.abs(values)))
        scale = 10.0 ** np.abs(power)
        rounded = np.where(power >= 0, np.rint(values * scale) / scale, np.rint(values / scale) * scale)
    return np.where(np.isfinite(rounded), rounded, values)


class Column(NamedTuple):
    """One column of a table: its name, its SI unit (empty for strings and plain numbers) and its description."""

    name: str
    unit: str
    words: str
    is_text: bool = False

    @property
    def heading(self) -> str:
        """Name and unit of the column, as a heading for tables and axes."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


class Part(NamedTuple):
    """Results for the cases `start` to `stop` - 1 of a table, in their order.

    `values` has an array (stop - start,) for each column, by the name of the column. Numbers are float64, with NaN
    for missing values; strings are empty for missing values.
    """

    start: int
    stop: int
    values: Mapping[str, Values]


@dataclass(frozen=True, eq=False)
class Swept:
    """A sweep: the varied keys in their order, the columns, and an iterator that checks the parts on demand."""

    mission_name: str
    mission_sha256: str
    varied: tuple[str, ...]
    count: int
    columns: tuple[Column, ...]
    parts: Iterator[Part]


@dataclass(frozen=True)
class Chunks:
    """The cases 0 to `end` - 1, divided into chunks of `size` cases.

    `is_slow` tells whether many cases have to be read one by one.
    """

    end: int
    size: int
    is_slow: bool

    @property
    def starts(self) -> range:
        """Index of the first case of each chunk."""
        return range(0, self.end, self.size)

    def stop(self, start: int) -> int:
        """Index after the last case of the chunk that begins at case `start`."""
        return min(start + self.size, self.end)
