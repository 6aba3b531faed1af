"""The cases of a sweep as files (CSV, Parquet, NetCDF) and as a dataset, with what each says of itself."""

import csv
import io
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from importlib import import_module
from math import prod
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bisar_budget.design.cases import Cases, Values, in_unit
from bisar_budget.design.table import Column, Part, Swept
from bisar_budget.extras import install_command
from bisar_budget.faults import changes_words, printable
from bisar_budget.findings.requirement import Override
from bisar_budget.findings.status import STATUS
from bisar_budget.memory import OF_TABLES, hold_room
from bisar_budget.mission.model import Mission
from bisar_budget.mission.quantities import Number
from bisar_budget.report.words.sentences import spreadsheet_text

if TYPE_CHECKING:
    from xarray import Dataset


FORMAT = "bisar-budget/sweep/1"


class Described:
    """A sweep as a table: keys that vary stand in the unit that they were asked for in, all else in SI."""

    def __init__(
        self, swept: Swept, cases: Cases, mission: Mission, version: str, overrides: Sequence[Override] = ()
    ) -> None:
        self.swept, self.cases = swept, cases
        self.numbers = {one.key: one for one in cases.varied if isinstance(one, Number)}
        changed = changes_words(mission.changes)
        self.facts = {
            "format": FORMAT,
            "mission": printable(swept.mission_name),
            "mission_sha256": swept.mission_sha256,
            **({"set": changed} if changed else {}),
            **({"overrides": _said(overrides)} if overrides else {}),
            "model": "varies" if "allocation.model" in swept.varied else mission.gating_model,
            "source": f"bisar-budget {version}",
        }

    @cached_property
    def columns(self) -> tuple[Column, ...]:
        """Columns in their order."""
        return tuple(
            column._replace(unit=self.numbers[column.name].unit) if column.name in self.numbers else column
            for column in self.swept.columns
        )

    def values(self, part: Part) -> Mapping[str, Values]:
        """Values of a part by the name of their column."""
        return {name: self.said(name, values) for name, values in part.values.items()}

    def said(self, name: str, values: Values) -> Values:
        """Values of a column, of one that varies in its unit."""
        if name not in self.numbers:
            return values
        return in_unit(self.numbers[name], np.asarray(values, float))


def _said(overrides: Sequence[Override]) -> str:
    """The overrides from outside the file that bear on statuses, in a line."""
    return "; ".join(printable(f"{one.name} {one.value} ({one.origin})") for one in overrides)


def write_csv(described: Described, parts: Iterable[Part], path: str) -> None:
    """Write lines `# name: value` about the whole, a header `KEY [unit]`, one line for each case.

    Numbers have all digits that they need to be read back; what has no value is empty.
    """
    with open(path, "w", encoding="utf-8", errors="backslashreplace", newline="") as file:
        file.writelines(texts(described, parts))


def texts(described: Described, parts: Iterable[Part]) -> Iterator[str]:
    """Write what stands above the cases, then each part."""
    yield "".join(f"# {name}: {value}\n" for name, value in described.facts.items())
    yield ",".join(_quoted(spreadsheet_text(column.heading)) for column in described.columns) + "\n"
    for part in parts:
        values = described.values(part)
        cells = (_cells(column, values[column.name]) for column in described.columns)
        yield "".join(f"{line}\n" for line in map(",".join, zip(*cells, strict=True)))


def _quoted(text: str | None) -> str:
    output = io.StringIO()
    csv.writer(output, lineterminator="").writerow(("", text))
    return output.getvalue()[1:]


def _cells(column: Column, values: Values) -> list[str]:
    """Cells of a column; a value that many cases share is written once."""
    if column.is_text:
        texts: list[str] = values.tolist()
        said = {text: _quoted(spreadsheet_text(text)) for text in set(texts)}
        return [said[text] for text in texts]
    numbers = np.asarray(values, float)
    few, places = np.unique(numbers, return_inverse=True)
    if few.size > numbers.size / 2:
        return [_number(number) for number in numbers.tolist()]
    words = [_number(number) for number in few.tolist()]
    return [words[place] for place in places.tolist()]


def _number(number: float) -> str:
    """All digits that a number needs to be read back; nothing for none."""
    return repr(number) if number == number else ""


_ROWS = 1 << 17  # of a group, at least: readers take one at a time


def write_parquet(described: Described, parts: Iterable[Part], path: str) -> None:
    """Write one row for each case, units and descriptions as metadata of the fields.

    Texts are dictionaries; what has no value is null. The metadata of the file is what a CSV has above its header.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    fields = [
        pa.field(
            column.name,
            pa.dictionary(pa.int32(), pa.string()) if column.is_text else pa.float64(),
            metadata={"unit": column.unit, "description": column.words},
        )
        for column in described.columns
    ]
    schema = pa.schema(fields, metadata=described.facts)
    with pq.ParquetWriter(path, schema) as writer:
        for group in _groups(parts):
            tables = []
            for part in group:
                values = described.values(part)
                arrays = [_array(pa, column, values[column.name]) for column in described.columns]
                tables.append(pa.Table.from_arrays(arrays, schema=schema))
            table = pa.concat_tables(tables).unify_dictionaries()
            writer.write_table(table, row_group_size=table.num_rows)


def _array(pa: Any, column: Column, values: Values) -> Any:
    if column.is_text:
        return pa.array(values, pa.string(), mask=values == "").dictionary_encode()
    return pa.array(values, pa.float64(), from_pandas=True)  # NaN is null


def _groups(parts: Iterable[Part]) -> Iterator[list[Part]]:
    """Parts that together have the rows of a group."""
    group: list[Part] = []
    rows = 0
    for part in parts:
        group.append(part)
        rows += part.stop - part.start
        if rows >= _ROWS:
            yield group
            group, rows = [], 0
    if group:
        yield group


_UNITS = {"": "1", "deg": "degree", "°": "degree"}  # as UDUNITS has them
_TITLES = {"mission": "title"}
_PROBED = 1 << 20  # bytes: what is left of a disk is less than the library asked for
_NONE = "none"  # the meaning of a flag that says nothing


def write_netcdf(described: Described, parts: Iterable[Part], path: str) -> None:
    """Write after the CF conventions: a grid has one dimension for each key, a table `case`.

    Texts are flags, numbers with a list of what they mean; reasons, of which every case may have one of its own, are
    strings. Numbers without a value are NaN.
    """
    from netCDF4 import Dataset

    try:
        with Dataset(path, "w", format="NETCDF4") as file:
            file.Conventions = "CF-1.11"
            file.setncatts({_TITLES.get(name, name): value for name, value in described.facts.items()})
            shape = described.cases.shape
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
    if not cases.is_grid:
        file.createDimension("case", cases.count)
        return list(described.columns)
    by_name = {column.name: column for column in described.columns}
    for one, axis in zip(cases.varied, cases.columns, strict=True):
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


class MissingTablesError(Exception):
    """The extra `tables` is not installed."""


class TableFormat(NamedTuple):
    """One format: how to write it, part after part, and the library of the extra `tables` that it needs, if any.

    A file that cannot be written is an `OSError`. Memory holds a few parts.
    """

    name: str
    write: Callable[[Described, Iterable[Part], str], None]
    library: str = ""


TABLES = {
    ".csv": TableFormat("CSV", write_csv),
    ".parquet": TableFormat("Parquet", write_parquet, "pyarrow"),
    ".nc": TableFormat("NetCDF", write_netcdf, "netCDF4"),
}


def writer_of(suffix: str) -> TableFormat:
    """Find what writes the files of a suffix, one of `TABLES`.

    Raises
    ------
    MissingTablesError
        Its library is not installed; says how to have it.
    """
    found = TABLES[suffix]
    if found.library:
        hold_room(OF_TABLES, found.name)
        try:
            import_module(found.library)
        except ImportError:
            raise MissingTablesError(_missing(found.name, found.library)) from None
    return found


def _missing(name: str, library: str) -> str:
    return f"{name} needs {library}, which is not installed; {install_command('tables')} brings it"


def dataset(described: Described, whole: Mapping[str, Any]) -> "Dataset":
    """Lay out the columns of a sweep.

    Parameters
    ----------
    described : Described
        The table.
    whole : mapping
        Values of each column by its name, (cases,): arrays of NumPy or of Dask.

    Returns
    -------
    xarray.Dataset
        A variable for each column, with `units` and `long_name`; numbers are NaN where there is none, texts empty.
        Keys that vary stand in the unit that they were said in, as coordinates. Attributes are those of a table.

    Raises
    ------
    MissingTablesError
        xarray is not installed.
    """
    try:
        from xarray import Dataset
    except ImportError:
        raise MissingTablesError(_missing("a dataset", "xarray")) from None
    cases, varied = described.cases, described.swept.varied
    attributes = {
        column.name: {"long_name": column.words, **({} if column.is_text else {"units": column.unit or "1"})}
        for column in described.columns
    }
    dimensions = tuple(varied) if cases.is_grid else ("case",)
    coordinates = {
        one.key: (one.key if cases.is_grid else "case", described.said(one.key, values), attributes[one.key])
        for one, values in zip(cases.varied, cases.columns, strict=True)
    }
    variables = {
        name: (dimensions, values.reshape(cases.shape), attributes[name])
        for name, values in whole.items()
        if name not in coordinates
    }
    return Dataset(variables, coordinates, described.facts)
