"""Write the table of an answer as CSV, in SI units and radians."""

from bisar_budget.faults import printable
from bisar_budget.report.answers import Records
from bisar_budget.report.formats.csv_table import csv_text


def csv_of(records: Records) -> str:
    """Write the header and the lines of a table as CSV.

    A missing value is an empty cell. The items of a list are separated by blanks.
    """
    return csv_text(
        [records.columns, *([_cell(line.get(name)) for name in records.columns] for line in records.lines)]
    )


def _cell(value: object) -> object:
    if isinstance(value, list | tuple):
        return " ".join(map(str, value)) or None
    if isinstance(value, bool):
        return "yes" if value else "no"
    return printable(value) if isinstance(value, str) else value
