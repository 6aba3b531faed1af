"""Findings as text: one pure function `render(report, style) -> str` per format, found here by name."""

from importlib import import_module
from typing import NamedTuple

from bisar_budget.budget.findings import Report

# Format name to its module; imported when asked for, so that none costs the others anything.
FORMATS = {
    "text": "bisar_budget.report.text_table",
    "json": "bisar_budget.report.json_document",
    "csv": "bisar_budget.report.csv_table",
}
SUFFIXES = {".txt": "text", ".json": "json", ".csv": "csv"}


class Style(NamedTuple):
    """How much to say, and whether in colour; formats for machines ignore it."""

    color: bool = False
    verbosity: int = 0  # -1: verdicts only; 0: the table; 1: every row's reason, source and displacement


def render(format_name: str, report: Report, style: Style) -> str:
    """Write a report in a format of `FORMATS`; the text ends with a newline."""
    text: str = import_module(FORMATS[format_name]).render(report, style)
    return text
