"""The cases of a sweep as Parquet: one row for each, units and descriptions as metadata of the fields.

Texts are dictionaries; what has no value is null. The metadata of the file is what a CSV has above its header.
"""

from collections.abc import Iterable, Iterator
from typing import Any

from bisar_budget.design.table import Column, Part, Values
from bisar_budget.report.tables.described import Described

_ROWS = 1 << 17  # of a group, at least: readers take one at a time


def write(described: Described, parts: Iterable[Part], path: str) -> None:
    """Write a file; see `Writer`."""
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
