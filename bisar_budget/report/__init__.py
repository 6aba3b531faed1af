"""Findings as text: a module per format, found here by name, with one pure function `render(report, style) -> str`.

A format that says one mission after the other has two in its stead, `piece(mission, style) -> str` and
`joined(pieces, version, style) -> str`: a thousand missions can be written where each is checked, and their findings
forgotten. One that has pictures beside its text has a function `pictures(report, style)` too.
"""

from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import NamedTuple

from bisar_budget.findings.mission import MissionFindings, Report, UnusableMission

# Format name to its module; imported when asked for, so that none costs the others anything.
FORMATS = {
    "text": "bisar_budget.report.text_table",
    "json": "bisar_budget.report.json_document",
    "csv": "bisar_budget.report.csv_table",
    "junit": "bisar_budget.report.junit_xml",
    "sarif": "bisar_budget.report.sarif_log",
    "github": "bisar_budget.report.github",
    "needs": "bisar_budget.report.needs_json",
    "html": "bisar_budget.report.html_page",
    "markdown": "bisar_budget.report.markdown_page",
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
    ".html": "html",
    ".htm": "html",
    ".md": "markdown",
    ".markdown": "markdown",
}

# Formats that show a mission itself, and images of verified limits; for the others neither is kept.
ILLUSTRATED = frozenset({"html", "markdown"})
WITH_PICTURES = ("markdown",)
PIECEWISE = ("text", "json", "csv")


def format_of(name: str) -> str | None:
    """Format that the name of a report asks for: `budget.sarif`, `x.needs.json` or `needs.json` itself."""
    # The dot before the name lets `needs.json` end like `x.needs.json`.
    ending = "." + name.replace("\\", "/").rpartition("/")[2].lower()
    if ending.count(".") == 1:
        return None
    return next((format_name for suffix, format_name in SUFFIXES.items() if ending.endswith(suffix)), None)


class Style(NamedTuple):
    """How much to say, and whether in colour; formats for machines ignore both and name files below `root`.

    Pictures lie in the folder `assets` beside the report; empty: nowhere, and the text has none.
    """

    color: bool = False
    verbosity: int = 0  # -1: verdicts only; 0: the table; 1: every row's reason, source and displacement
    root: str = ""  # absolute path of the repository; empty: files are named as given
    assets: str = ""
    all_rows: bool = False  # of the text: what is neither declared nor limits anything too
    detail: str = "summary"  # of a compliance report; full: formulas and undeclared rows too


def render(format_name: str, report: Report, style: Style) -> str:
    """Write a report in a format of `FORMATS`; the text ends with a newline."""
    if format_name in PIECEWISE:
        pieces = [piece(mission, format_name, style) for mission in report.missions]
        return joined(format_name, pieces, report.version, style)
    text: str = import_module(FORMATS[format_name]).render(report, style)
    return text


class Piece(NamedTuple):
    """What a format says of one mission; `unusable` is the file if it cannot be used."""

    status: str
    text: str
    unusable: UnusableMission | None


def piece(mission: MissionFindings | UnusableMission, format_name: str, style: Style) -> Piece:
    """Write the part of one mission, in a format of `PIECEWISE`."""
    text: str = import_module(FORMATS[format_name]).piece(mission, style)
    return Piece(mission.status, text, mission if isinstance(mission, UnusableMission) else None)


def joined(format_name: str, pieces: Sequence[Piece], version: str, style: Style) -> str:
    """Write a report from its pieces: what `render` would."""
    text: str = import_module(FORMATS[format_name]).joined(pieces, version, style)
    return text


def pictures(format_name: str, report: Report, style: Style) -> Mapping[str, bytes]:
    """Content of the files that belong beside a report, by their names within `style.assets`."""
    if format_name not in WITH_PICTURES or not style.assets:
        return {}
    files: Mapping[str, bytes] = import_module(FORMATS[format_name]).pictures(report, style)
    return files
