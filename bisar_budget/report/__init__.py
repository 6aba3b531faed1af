"""Findings as text: each format has a module, found here by name, with a pure function of the format's name.

That of SARIF is `as_sarif(report, style) -> str`. A format that says one mission after the other has two in its
stead, `piece(mission, style) -> str` and `joined(pieces, version, style) -> str`: a thousand missions can be written
where each is checked, and their findings forgotten. One that has pictures beside its text has a function
`pictures(report, style)` too.
"""

from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from bisar_budget.findings.mission import MissionFindings, Report, UnusableMission


class Format(NamedTuple):
    """One format: its module here, and how the names of its files end, the usual ending first.

    `about` is what `--help` says of it. `is_piecewise`, `has_pictures`: see above. `is_illustrated` is whether it
    shows the mission itself, and images of verified limits; for the others neither is kept.
    """

    name: str
    module: str
    suffixes: tuple[str, ...] = ()
    about: str = ""
    is_piecewise: bool = False
    is_illustrated: bool = False
    has_pictures: bool = False


_FORMATS = (
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
FORMATS = {one.name: one for one in _FORMATS}


def format_of(name: str) -> str | None:
    """Format that the name of a report asks for: `budget.sarif`, `x.needs.json` or `needs.json` itself."""
    # The dot before the name lets `needs.json` end like `x.needs.json`.
    ending = "." + name.replace("\\", "/").rpartition("/")[2].lower()
    if ending.count(".") == 1:
        return None
    fitting = [(len(suffix), one.name) for one in _FORMATS for suffix in one.suffixes if ending.endswith(suffix)]
    return max(fitting)[1] if fitting else None


class Style(NamedTuple):
    """How much to say, and whether in colour; formats for machines ignore both.

    They name files from the root of the repository that each lies in (`report.words.identity`), else from `root`.
    Pictures lie in the folder `assets` beside the report; empty: nowhere, and the text has none.
    """

    color: bool = False
    verbosity: int = 0  # -1: verdicts only; 0: the table; 1: every row's reason, source and displacement
    root: str = ""  # absolute path of the current folder, or GitHub's checkout; empty: files are named as given
    is_checkout: bool = False  # whether `root` is GitHub's checkout, which needs no `.git` to be a repository
    assets: str = ""
    all_rows: bool = False  # of the text: what is neither declared nor limits anything too
    detail: str = "summary"  # of a compliance report; full: formulas and undeclared rows too

    def coloured(self, text: str, sgr: str) -> str:
        """Text for a terminal with parameters of SGR (ECMA-48), where there is colour."""
        return f"\x1b[{sgr}m{text}\x1b[0m" if self.color else text


def _module(format_name: str) -> Any:
    """Imported when it is asked for, so that none costs the others anything."""
    return import_module(f"bisar_budget.report.{FORMATS[format_name].module}")


def render(format_name: str, report: "Report", style: Style) -> str:
    """Write a report in a format of `FORMATS`; the text ends with a newline."""
    if FORMATS[format_name].is_piecewise:
        pieces = [piece(mission, format_name, style) for mission in report.missions]
        return joined(format_name, pieces, report.version, style)
    text: str = getattr(_module(format_name), f"as_{format_name}")(report, style)
    return text


class Piece(NamedTuple):
    """The text of a format for one mission; `unusable` is the file if it cannot be used.

    `statuses` are all of its rows and requirements, of which `status` is the worst.
    """

    status: str
    text: str
    unusable: "UnusableMission | None"
    statuses: frozenset[str] = frozenset()


def piece(mission: "MissionFindings | UnusableMission", format_name: str, style: Style) -> Piece:
    """Write the part of one mission, in a piecewise format."""
    from bisar_budget.findings.mission import UnusableMission

    text: str = _module(format_name).piece(mission, style)
    return Piece(mission.status, text, mission if isinstance(mission, UnusableMission) else None, mission.statuses)


def joined(format_name: str, pieces: Sequence[Piece], version: str, style: Style) -> str:
    """Write a report from its pieces: what `render` would."""
    text: str = _module(format_name).joined(pieces, version, style)
    return text


def pictures(format_name: str, report: "Report", style: Style) -> Mapping[str, bytes]:
    """Content of the files that belong beside a report, by their names within `style.assets`."""
    if not FORMATS[format_name].has_pictures or not style.assets:
        return {}
    files: Mapping[str, bytes] = _module(format_name).pictures(report, style)
    return files
