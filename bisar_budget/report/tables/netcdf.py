"""The cases of a sweep as NetCDF, after the CF conventions: a grid has one dimension for each key, a table `case`.

Texts are flags, numbers with a list of what they mean; reasons, of which every case may have one of its own, are
strings. Numbers without a value are NaN.
"""

import os
from collections.abc import Iterable, Iterator, Mapping
from math import prod
from typing import Any

import numpy as np

from bisar_budget.design.cases import Grid
from bisar_budget.design.table import Column, Part, Values
from bisar_budget.findings.status import STATUS
from bisar_budget.report.tables.described import Described

_UNITS = {"": "1", "deg": "degree", "°": "degree"}  # as UDUNITS has them
_TITLES = {"mission": "title"}
_PROBED = 1 << 20  # bytes: what is left of a disk is less than the library asked for
_NONE = "none"  # the meaning of a flag that says nothing


def write(described: Described, parts: Iterable[Part], path: str) -> None:
    """Write a file; see `Writer`."""
    from netCDF4 import Dataset

    try:
        with Dataset(path, "w", format="NETCDF4") as file:
            file.Conventions = "CF-1.11"
            file.setncatts({_TITLES.get(name, name): value for name, value in described.facts.items()})
            shape = described.cases.shape or (described.cases.count,)
            columns = _dimensions(file, described)
            names = tuple(file.dimensions)
            variables = [_Variable(file, column, names) for column in columns]
            for part in parts:
                values = described.values(part)
                for variable in variables:
                    variable.put(values[variable.column.name], part.start, part.stop, shape)
            for variable in variables:
                variable.close()
    except RuntimeError as error:  # of the library: the disk is full, or a file may not become so large
        if type(error) is not RuntimeError:  # what the parts ended with
            raise
        _hold_to_room(path)
        raise OSError(None, str(error)) from None


def _hold_to_room(path: str) -> None:
    """Write on to a file that the library could not write: the `OSError` of the system says why."""
    with open(path, "ab") as file:
        file.write(bytes(_PROBED))
        file.flush()
        os.fsync(file.fileno())


def _dimensions(file: Any, described: Described) -> list[Column]:
    """Make the dimensions; what is left are the columns that have a value for each case."""
    cases = described.cases
    if not isinstance(cases, Grid):
        file.createDimension("case", cases.count)
        return list(described.columns)
    by_name = {column.name: column for column in described.columns}
    for one, axis in zip(cases.varied, cases.axes, strict=True):
        column = by_name.pop(one.key)
        file.createDimension(one.key, axis.size)
        variable = file.createVariable(one.key, str if column.is_text else "f8", (one.key,))
        variable.setncatts(_attributes(column))
        variable[:] = described.said(one.key, axis)
    return list(by_name.values())


def _attributes(column: Column) -> Mapping[str, str]:
    units = {} if column.is_text else {"units": _UNITS.get(column.unit, column.unit)}
    return {"long_name": column.words, **units}


class _Variable:
    """One column of a file; a text is kept as the number of its meaning."""

    def __init__(self, file: Any, column: Column, names: tuple[str, ...]) -> None:
        self.column = column
        self.is_free = column.is_text and column.name.rpartition(".")[2] == "reason"
        meanings = list(STATUS) if column.name == "status" else [""]
        self.codes = {meaning: code for code, meaning in enumerate(meanings)}
        kind = str if self.is_free else "i4" if column.is_text else "f8"
        fill = {"fill_value": np.nan} if kind == "f8" else {}
        self.variable = file.createVariable(column.name, kind, names, **fill)
        self.variable.setncatts(_attributes(column))

    def put(self, values: Values, start: int, stop: int, shape: tuple[int, ...]) -> None:
        """Write the values of some cases."""
        if self.is_free and not np.any(values != ""):
            return  # what is not written is empty
        if self.column.is_text and not self.is_free:
            values = np.array([self.codes.setdefault(text, len(self.codes)) for text in values.tolist()], "i4")
        begin = 0
        for slab in slabs(start, stop, shape):
            sizes = [piece.stop - piece.start for piece in slab]
            end = begin + prod(sizes)
            self.variable[slab] = values[begin:end].reshape(sizes)
            begin = end

    def close(self) -> None:
        """Say what the numbers of texts mean."""
        if self.column.is_text and not self.is_free:
            self.variable.flag_values = np.arange(len(self.codes), dtype="i4")
            self.variable.flag_meanings = " ".join("_".join(text.split()) or _NONE for text in self.codes)


def slabs(start: int, stop: int, shape: tuple[int, ...]) -> Iterator[tuple[slice, ...]]:
    """Boxes of an array of a shape that hold its elements `start` to `stop`, in order, the last axis the fastest."""
    if start == stop:
        return
    if len(shape) == 1:
        yield (slice(start, stop),)
        return
    inner = prod(shape[1:])
    (first, begin), (last, end) = divmod(start, inner), divmod(stop, inner)
    if first == last:
        yield from ((slice(first, first + 1), *slab) for slab in slabs(begin, end, shape[1:]))
        return
    if begin:
        yield from ((slice(first, first + 1), *slab) for slab in slabs(begin, inner, shape[1:]))
        first += 1
    if first < last:
        yield (slice(first, last), *(slice(0, size) for size in shape[1:]))
    yield from ((slice(last, last + 1), *slab) for slab in slabs(0, end, shape[1:]))
