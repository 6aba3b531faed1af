"""Write the answer (the result) of a command in a format; the module `NAME_answer` is for the command NAME.

The module of an answer has three functions, each of which takes a sequence of answers. For most commands, the
sequence has one answer for each mission. An answer of `passes`, `sweep` or `diff` is about a whole run, and is the
only item of its sequence.

- `content(answers)` returns the content of the JSON document, without its first keys `format` and `version`;
- `records(answers)` returns the table of numbers for CSV, data frames and workbooks, in SI units and radians;
- `document(answers, style)` returns the text of the answer, for a terminal, Markdown, HTML and workbooks.

If a format needs its own code for an answer, the module has a function for it, such as `as_sdoc(answers, style)`.
"""

import os
from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from types import ModuleType

    from bisar_budget.report import Style


class AnswerForm(NamedTuple):
    """The answer of a command. Its module has a separate function for each format in `own_formats`."""

    command: str
    own_formats: tuple[str, ...] = ()

    @property
    def formats(self) -> tuple[str, ...]:
        """Names of all formats of the answer."""
        return tuple(dict.fromkeys((*COMMON_FORMATS, *self.own_formats)))


COMMON_FORMATS = ("text", "json", "csv", "markdown", "html", "xlsx")
ANSWERS = {
    form.command: form
    for form in (
        AnswerForm("solve"),
        AnswerForm("sensitivity"),
        AnswerForm("allocate", ("needs", "sdoc")),
        AnswerForm("passes", ("ics",)),
        AnswerForm("verify"),
        AnswerForm("diff"),
        AnswerForm("sweep", ("csv",)),
        AnswerForm("monte_carlo"),
    )
}
_FORMAT_OF_SUFFIX = {
    ".txt": "text", ".json": "json", ".csv": "csv", ".md": "markdown", ".markdown": "markdown", ".html": "html",
    ".htm": "html", ".xlsx": "xlsx", ".needs.json": "needs", ".sdoc": "sdoc", ".ics": "ics",
}  # fmt: skip


class Records(NamedTuple):
    """A table of numbers and short strings.

    `columns` has the names of the columns. Each item of `lines` is a line of the table: it maps the column names to
    values.
    """

    columns: Sequence[str]
    lines: Sequence[Mapping[str, object]]

    def column(self, name: str) -> list[object]:
        """Values of a column; None for a line without a value."""
        return [line.get(name) for line in self.lines]


def suffixes(command: str) -> dict[str, str]:
    """Formats available for the answer of a command, by file name suffix."""
    return {suffix: name for suffix, name in _FORMAT_OF_SUFFIX.items() if name in ANSWERS[command].formats}


def format_of_file(command: str, name: str) -> str | None:
    """Find the format of an answer for a file name such as `limits.csv`; None if the suffix is not known."""
    lowered = name.lower()
    matches = [suffix for suffix in suffixes(command) if lowered.endswith(suffix)]
    return _FORMAT_OF_SUFFIX[max(matches, key=len)] if matches else None


def module_of(command: str) -> "ModuleType":
    """Return the module that writes the answer of a command. The module is imported at its first use."""
    return import_module(f"bisar_budget.report.answers.{ANSWERS[command].command}_answer")


def records_of(command: str, answers: Sequence[object]) -> Records:
    """Return the answers of a command as a table of numbers and short strings."""
    records: Records = module_of(command).records(answers)
    return records


def written(command: str, format_name: str, answers: Sequence[object], style: "Style") -> str | bytes:
    """Write the answers of a command, one for each mission, in the format `format_name`.

    Text ends with a newline. A workbook is returned as bytes. The drawings of a Markdown report are not included.

    Raises
    ------
    MissingExtraError
        The format needs a package that is not installed; the message names the command that installs it.
    """
    return files(command, format_name, answers, style, "")[""]


def files(
    command: str, format_name: str, answers: Sequence[object], style: "Style", path: str
) -> dict[str, str | bytes]:
    """Format the answers of a command as the contents of files, by path; nothing is written to disk.

    The drawings of a Markdown report come first, in a folder beside `path`, and the file `path` itself is last. If
    `path` is empty, there are no drawings. Raises the same errors as `written`.
    """
    module = module_of(command)
    if format_name in ANSWERS[command].own_formats:
        return {path: getattr(module, f"as_{format_name}")(answers, style)}
    if format_name == "json":
        from bisar_budget.report.renderers.json import document_text

        return {path: document_text(f"bisar-budget/{command}/1", module.content(answers))}
    if format_name == "csv":
        from bisar_budget.report.renderers.csv import csv_of

        return {path: csv_of(module.records(answers))}
    document = module.document(answers, style)
    if format_name == "xlsx":
        from bisar_budget.report.renderers.xlsx import workbook

        return {path: workbook(document, module.records(answers))}
    if format_name == "html":
        from bisar_budget.report.renderers.html import page

        return {path: page(document)}
    if format_name == "markdown":
        from bisar_budget.report.renderers.markdown import markdown, pictures

        drawings = pictures(document) if path else {}
        folder = f"{os.path.splitext(path)[0]}.assets" if drawings else ""
        text = markdown(document, os.path.basename(folder))
        return {**{os.path.join(folder, name): drawing for name, drawing in drawings.items()}, path: text}
    from bisar_budget.report.renderers.text import text as terminal_text

    return {path: terminal_text(document, style)}
