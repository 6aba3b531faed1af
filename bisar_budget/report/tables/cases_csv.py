"""The cases of a sweep as CSV: lines `# name: value` about the whole, a header `KEY [unit]`, one line for each case.

Numbers have all digits that they need to be read back; what has no value is empty.
"""

import csv
import io
from collections.abc import Iterable, Iterator

import numpy as np

from bisar_budget.design.swept import Column, Part, Values
from bisar_budget.report.tables.described import Described
from bisar_budget.report.words.escapes import spreadsheet_text


def write(described: Described, parts: Iterable[Part], path: str) -> None:
    """Write a file; see `Writer`."""
    with open(path, "w", encoding="utf-8", errors="backslashreplace", newline="") as file:
        file.writelines(texts(described, parts))


def texts(described: Described, parts: Iterable[Part]) -> Iterator[str]:
    """Write what stands above the cases, then each part."""
    header = [spreadsheet_text(column.heading) for column in described.columns]
    yield "".join(f"# {name}: {value}\n" for name, value in described.facts.items()) + _lines([header])
    for part in parts:
        values = described.values(part)
        yield _lines(zip(*(_cells(column, values[column.name]) for column in described.columns), strict=True))


def _lines(rows: Iterable[Iterable[object]]) -> str:
    output = io.StringIO()
    csv.writer(output, lineterminator="\n").writerows(rows)
    return output.getvalue()


def _cells(column: Column, values: Values) -> list[object]:
    cells: list[object] = values.tolist()
    if column.is_text:
        said = {text: spreadsheet_text(str(text)) for text in set(cells)}
        return [said[text] for text in cells]
    if np.isnan(np.asarray(values, float)).any():
        return ["" if cell != cell else cell for cell in cells]
    return cells
