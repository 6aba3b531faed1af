"""Write the cases of a sweep with metadata to CSV, Parquet or NetCDF files, or convert them to a dataset."""

import csv
import io
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from importlib import import_module
from math import prod
from types import ModuleType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bisar_budget.extras import MissingExtraError, install_command
from bisar_budget.faults import changes_words, printable
from bisar_budget.findings.case_table import Cases, Column, Part, Swept, Values, in_unit
from bisar_budget.findings.requirement import Override
from bisar_budget.findings.status import STATUS
from bisar_budget.memory import TABLES_MEMORY_BYTES, hold_room
from bisar_budget.mission.model import Mission
from bisar_budget.mission.quantities import Number
from bisar_budget.report.words.sentences import spreadsheet_text

if TYPE_CHECKING:
    from dask.array import Array as DaskArray
    from netCDF4 import Dataset as NetcdfFile
    from pyarrow import Array
    from xarray import Dataset


SWEEP_FORMAT = "bisar-budget/sweep/1"


class Described:
    """A sweep with the columns and metadata of its table file.

    Columns of varied keys have the units in which the sweep was requested. All further columns are in SI units.
    """

    def __init__(
        self, swept: Swept, cases: Cases, mission: Mission, version: str, overrides: Sequence[Override] = ()
    ) -> None:
        self.swept, self.cases = swept, cases
        self.numbers = {key.key: key for key in cases.varied if isinstance(key, Number)}
        changed = changes_words(mission.changes)
        self.facts = {
            "format": SWEEP_FORMAT,
            "mission": printable(swept.mission_name),
            "mission_sha256": swept.mission_sha256,
            **({"set": changed} if changed else {}),
            **({"overrides": _overrides_text(overrides)} if overrides else {}),
            "model": "varies" if "allocation.model" in swept.varied else mission.gating_model,
            "source": f"bisar-budget {version}",
        }

    @cached_property
    def columns(self) -> tuple[Column, ...]:
        """Columns of the table in the order in which they are written, with their units in the table."""
        return tuple(
            column._replace(unit=self.numbers[column.name].unit) if column.name in self.numbers else column
            for column in self.swept.columns
        )

    def values(self, block: Part) -> Mapping[str, Values]:
        """Return the values of a block of cases by column name, converted from SI to the units of the columns."""
        return {name: self.converted(name, values) for name, values in block.values.items()}

    def converted(self, name: str, values: Values) -> Values:
        """Convert the values of the column `name` from SI to the unit of the column in the table."""
        if name not in self.numbers:
            return values
        return in_unit(self.numbers[name], np.asarray(values, float))


def _overrides_text(overrides: Sequence[Override]) -> str:
    """Write the overrides (settings from outside the mission file that affect statuses) on one line."""
    return "; ".join(printable(f"{override.name} {override.value} ({override.origin})") for override in overrides)


def write_csv(described: Described, blocks: Iterable[Part], path: str) -> None:
    """Write a CSV file: metadata as lines `# name: value`, a header with `KEY [unit]`, and one line for each case.

    Numbers are written with as many digits as are needed to read back the same value. A missing value is an empty
    cell.
    """
    with open(path, "w", encoding="utf-8", errors="backslashreplace", newline="") as file:
        file.writelines(texts(described, blocks))


def texts(described: Described, blocks: Iterable[Part]) -> Iterator[str]:
    """Yield the content of a CSV file piece by piece: metadata, header, then the lines of each block."""
    yield "".join(f"# {name}: {value}\n" for name, value in described.facts.items())
    yield ",".join(_quoted(spreadsheet_text(column.heading)) for column in described.columns) + "\n"
    for block in blocks:
        values = described.values(block)
        cells = (_cells(column, values[column.name]) for column in described.columns)
        yield "".join(f"{line}\n" for line in map(",".join, zip(*cells, strict=True)))


def _quoted(text: str | None) -> str:
    output = io.StringIO()
    csv.writer(output, lineterminator="").writerow(("", text))
    return output.getvalue()[1:]


def _cells(column: Column, values: Values) -> list[str]:
    """Write the values of a column as strings for CSV.

    A value shared by several cases is converted only once.
    """
    if column.is_text:
        texts: list[str] = values.tolist()
        quoted = {text: _quoted(spreadsheet_text(text)) for text in set(texts)}
        return [quoted[text] for text in texts]
    numbers = np.asarray(values, float)
    distinct, indices = np.unique(numbers, return_inverse=True)
    if distinct.size > numbers.size / 2:
        return [_number(number) for number in numbers.tolist()]
    words = [_number(number) for number in distinct.tolist()]
    return [words[index] for index in indices.tolist()]


def _number(number: float) -> str:
    """Write a number with as many digits as are needed to read back the same value; empty for NaN."""
    return repr(number) if number == number else ""


_MIN_GROUP_ROWS = 1 << 17  # of a row group, which readers load at once


def write_parquet(described: Described, blocks: Iterable[Part], path: str) -> None:
    """Write a Parquet file with one row for each case, and with units and descriptions as metadata of the fields.

    Strings are dictionary-encoded, and missing values are null. The metadata of the file is the same as in a CSV
    file.
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
        for group in _groups(blocks):
            tables = []
            for block in group:
                values = described.values(block)
                arrays = [_array(pa, column, values[column.name]) for column in described.columns]
                tables.append(pa.Table.from_arrays(arrays, schema=schema))
            table = pa.concat_tables(tables).unify_dictionaries()
            writer.write_table(table, row_group_size=table.num_rows)


def _array(pa: ModuleType, column: Column, values: Values) -> "Array":
    if column.is_text:
        return pa.array(values, pa.string(), mask=values == "").dictionary_encode()
    return pa.array(values, pa.float64(), from_pandas=True)  # NaN is null


def _groups(blocks: Iterable[Part]) -> Iterator[list[Part]]:
    """Combine blocks of cases into groups.

    Each group, except possibly the last, has enough rows for a row group of Parquet.
    """
    group: list[Part] = []
    rows = 0
    for block in blocks:
        group.append(block)
        rows += block.stop - block.start
        if rows >= _MIN_GROUP_ROWS:
            yield group
            group, rows = [], 0
    if group:
        yield group


_UDUNITS_NAMES = {"": "1", "deg": "degree", "°": "degree"}
_FACT_TITLES = {"mission": "title"}
_PROBE_BYTES = 1 << 20  # a write of this size fails on a disk that was too full for the library
_EMPTY_MEANING = "none"  # meaning of the flag of an empty text


def write_netcdf(described: Described, blocks: Iterable[Part], path: str) -> None:
    """Write a NetCDF file that follows the CF conventions.

    If the cases form a grid, each varied key is a dimension; otherwise the only dimension is `case`. Strings are
    stored as CF flags, which are numbers with a list of their meanings. The reason why a case has no valid mission is
    stored as a string instead, because every case may have a different reason. Missing numbers are NaN.
    """
    from netCDF4 import Dataset

    try:
        with Dataset(path, "w", format="NETCDF4") as file:
            file.Conventions = "CF-1.11"
            file.setncatts({_FACT_TITLES.get(name, name): value for name, value in described.facts.items()})
            shape = described.cases.shape
            columns = _dimensions(file, described)
            names = tuple(file.dimensions)
            variables = [_Variable(file, column, names) for column in columns]
            for block in blocks:
                values = described.values(block)
                for variable in variables:
                    variable.put(values[variable.column.name], block.start, block.stop, shape)
            for variable in variables:
                variable.close()
    except RuntimeError as error:  # by the library, if the disk is full or the file exceeds a limit
        if type(error) is not RuntimeError:  # an error of the sweep itself
            raise
        _hold_to_room(path)
        raise OSError(None, str(error)) from None


def _hold_to_room(path: str) -> None:
    """Append to a file that the library could not write, to learn the reason.

    The operating system then raises an `OSError` that states the reason, such as a full disk.
    """
    with open(path, "ab") as file:
        file.write(bytes(_PROBE_BYTES))
        file.flush()
        os.fsync(file.fileno())


def _dimensions(file: "NetcdfFile", described: Described) -> list[Column]:
    """Create the dimensions of a NetCDF file, and return the columns that are not dimensions.

    These columns have a separate value for each case.
    """
    cases = described.cases
    if not cases.is_grid:
        file.createDimension("case", cases.count)
        return list(described.columns)
    by_name = {column.name: column for column in described.columns}
    for key, axis in zip(cases.varied, cases.columns, strict=True):
        column = by_name.pop(key.key)
        file.createDimension(key.key, axis.size)
        variable = file.createVariable(key.key, str if column.is_text else "f8", (key.key,))
        variable.setncatts(_attributes(column))
        variable[:] = described.converted(key.key, axis)
    return list(by_name.values())


def _attributes(column: Column) -> Mapping[str, str]:
    units = {} if column.is_text else {"units": _UDUNITS_NAMES.get(column.unit, column.unit)}
    return {"long_name": column.words, **units}


class _Variable:
    """A column of a NetCDF file. Strings are stored as flag numbers."""

    def __init__(self, file: "NetcdfFile", column: Column, names: tuple[str, ...]) -> None:
        self.column = column
        self.is_free = column.is_text and column.name.rpartition(".")[2] == "reason"
        meanings = list(STATUS) if column.name == "status" else [""]
        self.codes = {meaning: code for code, meaning in enumerate(meanings)}
        data_type = str if self.is_free else "i4" if column.is_text else "f8"
        fill: Mapping[str, Any] = {"fill_value": np.nan} if data_type == "f8" else {}
        self.variable = file.createVariable(column.name, data_type, names, **fill)
        self.variable.setncatts(_attributes(column))

    def put(self, values: Values, start: int, stop: int, shape: tuple[int, ...]) -> None:
        """Write the values of the cases `start` to `stop`."""
        if self.is_free and not np.any(values != ""):
            return  # strings are empty unless written
        if self.column.is_text and not self.is_free:
            values = np.array([self.codes.setdefault(text, len(self.codes)) for text in values.tolist()], "i4")
        begin = 0
        for slab in slabs(start, stop, shape):
            sizes = [piece.stop - piece.start for piece in slab]
            end = begin + prod(sizes)
            self.variable[slab] = values[begin:end].reshape(sizes)
            begin = end

    def close(self) -> None:
        """Write the attributes that list the flag numbers and their meanings, if the column contains strings."""
        if self.column.is_text and not self.is_free:
            self.variable.flag_values = np.arange(len(self.codes), dtype="i4")
            self.variable.flag_meanings = " ".join("_".join(text.split()) or _EMPTY_MEANING for text in self.codes)


def slabs(start: int, stop: int, shape: tuple[int, ...]) -> Iterator[tuple[slice, ...]]:
    """Yield slices of an array of shape `shape` that together cover its elements `start` to `stop` in C order."""
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


class TableFormat(NamedTuple):
    """A table format: the function that writes it, and the library that it needs from the extra `tables`.

    `write` writes a table part by part, so that only a few parts are in memory. It raises `OSError` if it cannot
    write the file.
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
    """Return the table format for a file suffix, a key of `TABLES`.

    Raises
    ------
    MissingExtraError
        The library of the format is not installed. The message names the command that installs it.
    """
    table_format = TABLES[suffix]
    if table_format.library:
        hold_room(TABLES_MEMORY_BYTES, table_format.name)
        try:
            import_module(table_format.library)
        except ImportError:
            raise MissingExtraError(_missing(table_format.name, table_format.library)) from None
    return table_format


def _missing(name: str, library: str) -> str:
    return f"{name} needs {library}, which is not installed; {install_command('tables')} brings it"


def dataset(described: Described, values_by_column: "Mapping[str, Values | DaskArray]") -> "Dataset":
    """Make an xarray dataset from the columns of a sweep.

    Parameters
    ----------
    described : Described
        Sweep with the columns and metadata of its table.
    values_by_column : mapping
        Values of each column, by column name: NumPy or Dask arrays of shape (cases,).

    Returns
    -------
    xarray.Dataset
        A variable for each column, with `units` and `long_name`. Missing numbers are NaN, missing strings are empty.
        Varied keys are coordinates, in the units in which the sweep was requested. The attributes are the metadata of
        the table.

    Raises
    ------
    MissingExtraError
        xarray is not installed.
    """
    try:
        from xarray import Dataset
    except ImportError:
        raise MissingExtraError(_missing("a dataset", "xarray")) from None
    cases, varied = described.cases, described.swept.varied
    attributes = {
        column.name: {"long_name": column.words, **({} if column.is_text else {"units": column.unit or "1"})}
        for column in described.columns
    }
    dimensions = tuple(varied) if cases.is_grid else ("case",)
    coordinates = {
        key.key: (key.key if cases.is_grid else "case", described.converted(key.key, values), attributes[key.key])
        for key, values in zip(cases.varied, cases.columns, strict=True)
    }
    variables = {
        name: (dimensions, values.reshape(cases.shape), attributes[name])
        for name, values in values_by_column.items()
        if name not in coordinates
    }
    return Dataset(variables, coordinates, described.facts)
