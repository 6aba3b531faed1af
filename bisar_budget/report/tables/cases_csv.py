"""The cases of a sweep as CSV: lines `# name: value` about the whole, a header `KEY [unit]`, one line for each case.

Numbers have all digits that they need to be read back; what has no value is empty.
"""

import csv
import io
from collections.abc import Iterable, Iterator

import numpy as np

from bisar_budget.design.table import Column, Part, Values
from bisar_budget.report.tables.described import Described
from bisar_budget.report.words.sentences import spreadsheet_text


def write(described: Described, parts: Iterable[Part], path: str) -> None:
    """Write a file; see `Writer`."""
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
