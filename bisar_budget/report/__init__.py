"""Findings as text: one pure function `render(report, style) -> str` per format, found here by name."""

from importlib import import_module
from typing import NamedTuple

from bisar_budget.budget.findings import Report

# Format name to its module; imported when asked for, so that none costs the others anything.
FORMATS = {
    "text": "bisar_budget.report.text_table",
    "json": "bisar_budget.report.json_document",
    "csv": "bisar_budget.report.csv_table",
    "junit": "bisar_budget.report.junit_xml",
    "sarif": "bisar_budget.report.sarif_log",
    "github": "bisar_budget.report.github",
    "needs": "bisar_budget.report.needs_json",
}
# How the name of a file ends, to its format; the first that fits. GitHub's commands are no file.
SUFFIXES = {
    ".needs.json": "needs",
    ".sarif.json": "sarif",
    ".sarif": "sarif",
    ".txt": "text",
    ".json": "json",
    ".csv": "csv",
    ".xml": "junit",
}

# Formats that show images of verified limits; for the others none is kept.
ILLUSTRATED = frozenset({"html", "markdown"})


def format_of(name: str) -> str | None:
    """Format that the name of a report asks for: `budget.sarif`, `x.needs.json` or `needs.json` itself."""
    # The dot before the name lets `needs.json` end like `x.needs.json`.
    ending = "." + name.replace("\\", "/").rpartition("/")[2].lower()
    if ending.count(".") == 1:
        return None
    return next((format_name for suffix, format_name in SUFFIXES.items() if ending.endswith(suffix)), None)


class Style(NamedTuple):
    """How much to say, and whether in colour; formats for machines ignore both and name files below `root`."""

    color: bool = False
    verbosity: int = 0  # -1: verdicts only; 0: the table; 1: every row's reason, source and displacement
    root: str = ""  # absolute path of the repository; empty: files are named as given


def render(format_name: str, report: Report, style: Style) -> str:
    """Write a report in a format of `FORMATS`; the text ends with a newline."""
    text: str = import_module(FORMATS[format_name]).render(report, style)
    return text
