"""Findings as text: the table of formats gives the module of each format, whose functions are pure.

The function of SARIF is `as_sarif(report, style) -> str`. A piecewise format, which writes one mission after another,
has two functions instead, `piece(mission, style) -> str` and `joined(pieces, version, style) -> str`: a process that
checks a mission writes its piece and need not keep its findings. A format with pictures also has a function
`pictures(report, style)`.
"""

from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from types import ModuleType

    from bisar_budget.findings.mission import MissionFindings, Report, UnusableMission


class Format(NamedTuple):
    """A format: its module in this package, and the endings of its files, the usual ending first.

    `about` is its description in `--help`. `is_piecewise` and `has_pictures` are explained above. An illustrated
    format shows the mission itself and images of verified limits; other formats do not keep them in memory.
    """

    name: str
    module: str
    suffixes: tuple[str, ...] = ()
    about: str = ""
    is_piecewise: bool = False
    is_illustrated: bool = False
    has_pictures: bool = False


_FORMAT_ENTRIES = (
    Format("text", "formats.text_table", (".txt",), is_piecewise=True),
    Format("json", "formats.json_document", (".json",), is_piecewise=True),
    Format("csv", "formats.csv_table", (".csv",), is_piecewise=True),
    Format("junit", "formats.traceability", (".xml",), "test cases"),
    Format("sarif", "formats.annotations", (".sarif", ".sarif.json"), "code scanning"),
    Format("github", "formats.annotations", (), "annotations of a pull request"),
    Format("needs", "formats.traceability", (".needs.json",), "Sphinx-Needs"),
    Format(
        "html", "compliance.html", (".html", ".htm"), "a compliance report for a review board", is_illustrated=True
    ),
    Format(
        "markdown", "compliance.markdown", (".md", ".markdown"), "the same with its drawings beside it",
        is_illustrated=True, has_pictures=True,
    ),
)  # fmt: skip
FORMATS = {entry.name: entry for entry in _FORMAT_ENTRIES}


def format_of(name: str) -> str | None:
    """Format of a report by the name of its file, such as `budget.sarif`, `x.needs.json` or `needs.json` itself."""
    # With the dot before it, the name `needs.json` ends like `x.needs.json`.
    ending = "." + name.replace("\\", "/").rpartition("/")[2].lower()
    if ending.count(".") == 1:
        return None
    matches = [
        (len(suffix), entry.name) for entry in _FORMAT_ENTRIES for suffix in entry.suffixes if ending.endswith(suffix)
    ]
    return max(matches)[1] if matches else None


class Style(NamedTuple):
    """Verbosity, colour, width of tables and folders of a report. Formats for machines ignore the first three.

    They name a file from the root of its repository (`report.words.identity`), else from `root`. Pictures are in the
    folder `assets` beside the report; without a folder the report has no pictures.
    """

    color: bool = False
    verbosity: int = 0  # -1: verdicts only; 0: the table; 1: every row's reason, source and displacement
    root: str = ""  # absolute path of the current folder, or GitHub's checkout; empty: files are named as given
    is_checkout: bool = False  # whether `root` is GitHub's checkout, which needs no `.git` to be a repository
    assets: str = ""
    all_rows: bool = False  # whether the text shows rows that are neither declared nor limit anything
    detail: str = "summary"  # of a compliance report: summary, or full with formulas and undeclared rows
    table_width: int = 80  # columns of a table for a terminal, which has a row on one line if it fits

    def coloured(self, text: str, sgr: str) -> str:
        """Text for a terminal, with parameters of SGR (ECMA-48) if the style has colour."""
        return f"\x1b[{sgr}m{text}\x1b[0m" if self.color else text


def _module(format_name: str) -> "ModuleType":
    """Module of a format, imported at its first use, so that other formats need not wait for it."""
    return import_module(f"bisar_budget.report.{FORMATS[format_name].module}")


def render(format_name: str, report: "Report", style: Style) -> str:
    """Write a report in a format of `FORMATS`; the text ends with a newline."""
    if FORMATS[format_name].is_piecewise:
        pieces = [piece(mission, format_name, style) for mission in report.missions]
        return joined(format_name, pieces, report.version, style)
    text: str = getattr(_module(format_name), f"as_{format_name}")(report, style)
    return text


class Piece(NamedTuple):
    """Text of a piecewise format for one mission.

    `unusable` holds the faults of an unusable file, else None. `statuses` are those of all rows and requirements,
    `status` is the worst of them.
    """

    status: str
    text: str
    unusable: "UnusableMission | None"
    statuses: frozenset[str] = frozenset()


def piece(mission: "MissionFindings | UnusableMission", format_name: str, style: Style) -> Piece:
    """Write one mission in a piecewise format."""
    from bisar_budget.findings.mission import UnusableMission

    text: str = _module(format_name).piece(mission, style)
    return Piece(mission.status, text, mission if isinstance(mission, UnusableMission) else None, mission.statuses)


def joined(format_name: str, pieces: Sequence[Piece], version: str, style: Style) -> str:
    """Write a report from its pieces, the same text as `render`."""
    text: str = _module(format_name).joined(pieces, version, style)
    return text


def pictures(format_name: str, report: "Report", style: Style) -> Mapping[str, bytes]:
    """Content of the files that belong beside a report, by their names within `style.assets`."""
    if not FORMATS[format_name].has_pictures or not style.assets:
        return {}
    files: Mapping[str, bytes] = _module(format_name).pictures(report, style)
    return files
