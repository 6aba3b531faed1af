"""Write findings in a report format. `FORMATS` lists the formats and the module of each.

The functions of these modules are pure. The module of a format NAME has a function `as_NAME(report, style) -> str`,
such as `as_sarif`. A format with `is_piecewise` is written mission by mission, and its module has two other functions
instead: `piece(mission, style) -> str` and `joined(pieces, version, style) -> str`. A process that has checked a
mission can then write the piece about this mission, and discard the findings. If a format has `has_pictures` set, its
module also has a function `pictures(report, style)`.
"""

from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from types import ModuleType

    from bisar_budget.findings.mission import MissionFindings, Report, UnusableMission


class Format(NamedTuple):
    """A report format, with the module that writes it and the endings of its file names.

    The most usual ending comes first. `about` is the description of the format in `--help`. The docstring of this
    module explains `is_piecewise` and `has_pictures`. If `is_binary` is set, the files of the format are not text. If
    `is_illustrated` is set, the mission and the images of verified limits are kept in memory for the writer; they are
    discarded for all other formats.
    """

    name: str
    module: str
    suffixes: tuple[str, ...] = ()
    about: str = ""
    is_piecewise: bool = False
    is_illustrated: bool = False
    has_pictures: bool = False
    is_binary: bool = False

    @property
    def name_and_about(self) -> str:
        """Name of the format, with its description in brackets if it has one."""
        return f"{self.name} ({self.about})" if self.about else self.name


_FORMAT_ENTRIES = (
    Format("text", "answers.check_text", (".txt",), is_piecewise=True),
    Format("json", "answers.check_content", (".json",), is_piecewise=True),
    Format("csv", "formats.csv_table", (".csv",), is_piecewise=True),
    Format("junit", "formats.traceability", (".xml",), "test cases"),
    Format("sarif", "formats.annotations", (".sarif", ".sarif.json"), "code scanning"),
    Format("github", "formats.annotations", (), "annotations of a pull request"),
    Format("needs", "formats.traceability", (".needs.json",), "Sphinx-Needs"),
    Format("sdoc", "formats.strictdoc", (".sdoc",), "StrictDoc, and ReqIF through it"),
    Format(
        "requirements", "formats.requirement_list", (".requirements.csv",), "a requirements file with status",
        is_piecewise=True,
    ),
    Format(
        "html", "answers.check_answer", (".html", ".htm"), "a compliance report for a review board",
        is_illustrated=True,
    ),
    Format(
        "markdown", "answers.check_answer", (".md", ".markdown"), "the same with its drawings beside it",
        is_illustrated=True, has_pictures=True,
    ),
    Format("xlsx", "answers.check_answer", (".xlsx",), "the same as a workbook", is_illustrated=True, is_binary=True),
)  # fmt: skip
FORMATS = {entry.name: entry for entry in _FORMAT_ENTRIES}


def format_of(name: str) -> str | None:
    """Find the report format for a file name such as `budget.sarif` or `needs.json`; None if no format fits."""
    # With the dot before it, the name `needs.json` ends like `x.needs.json`.
    ending = "." + name.replace("\\", "/").rpartition("/")[2].lower()
    if ending.count(".") == 1:
        return None
    matches = [
        (len(suffix), entry.name) for entry in _FORMAT_ENTRIES for suffix in entry.suffixes if ending.endswith(suffix)
    ]
    return max(matches)[1] if matches else None


class Style(NamedTuple):
    """Settings of a report: verbosity, colour, table width and folders.

    Machine-readable formats ignore verbosity, colour and table width. They write the path of a file relative to the
    root of its repository (see `report.words.identity`), or relative to `root` if there is no repository. Pictures
    are stored in the folder `assets` beside the report. If `assets` is empty, the report has no pictures.
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
        """Enclose text in the SGR escape sequence `sgr` (ECMA-48) and a reset, unless the style has no colour."""
        return f"\x1b[{sgr}m{text}\x1b[0m" if self.color else text


def _module(format_name: str) -> "ModuleType":
    """Import the module of a format at its first use, so that other formats load faster, and return it."""
    return import_module(f"bisar_budget.report.{FORMATS[format_name].module}")


def render(format_name: str, report: "Report", style: Style) -> str:
    """Write a report in one of the text formats of `FORMATS`; the text ends with a newline."""
    if FORMATS[format_name].is_piecewise:
        pieces = [piece(mission, format_name, style) for mission in report.missions]
        return joined(format_name, pieces, report.version, style)
    text: str = getattr(_module(format_name), f"as_{format_name}")(report, style)
    return text


def content(format_name: str, report: "Report", style: Style) -> bytes:
    """Write a report in a format of `FORMATS`, as the content of a file.

    Raises
    ------
    MissingExtraError
        The format needs a package that is not installed; the message names the command that installs it.
    """
    if not FORMATS[format_name].is_binary:
        return render(format_name, report, style).encode()
    data: bytes = getattr(_module(format_name), f"as_{format_name}")(report, style)
    return data


class Piece(NamedTuple):
    """Text of one mission in a format that is written mission by mission.

    If the mission file is unusable, `unusable` has its faults; otherwise it is None. `statuses` are the statuses of
    all rows and requirements; `status` is the worst of these statuses.
    """

    status: str
    text: str
    unusable: "UnusableMission | None"
    statuses: frozenset[str] = frozenset()


def piece(mission: "MissionFindings | UnusableMission", format_name: str, style: Style) -> Piece:
    """Write the piece for one mission of a report in a piecewise format."""
    from bisar_budget.findings.mission import UnusableMission

    text: str = _module(format_name).piece(mission, style)
    return Piece(mission.status, text, mission if isinstance(mission, UnusableMission) else None, mission.statuses)


def joined(format_name: str, pieces: Sequence[Piece], version: str, style: Style) -> str:
    """Join the pieces of all missions into a report; the result is the same as from `render`."""
    text: str = _module(format_name).joined(pieces, version, style)
    return text


def pictures(format_name: str, report: "Report", style: Style) -> Mapping[str, bytes]:
    """Contents of the picture files of a report, by their names in `style.assets`; empty if there are no pictures."""
    if not FORMATS[format_name].has_pictures or not style.assets:
        return {}
    files: Mapping[str, bytes] = _module(format_name).pictures(report, style)
    return files
