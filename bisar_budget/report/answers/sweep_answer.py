"""Output of the `sweep` command: the verdict on a mission for many sets of values.

CSV, Parquet and NetCDF files are written part by part by `report.tables`. The formats in this module need all cases
in memory.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from bisar_budget.faults import SetValue, printable
from bisar_budget.findings.case_table import Column, Part, Values
from bisar_budget.findings.requirement import Override
from bisar_budget.findings.status import STATUS
from bisar_budget.mission.model import Mission
from bisar_budget.report import Style
from bisar_budget.report import document as doc
from bisar_budget.report.answers import Records
from bisar_budget.report.answers.shared_blocks import mission_chapter, mission_document, opening
from bisar_budget.report.tables import Described, texts
from bisar_budget.report.words.sentences import BINDING_WORDS, use_words

MAX_ANSWER_CASES = 40_000  # a document with more is too long for its readers
_MAX_LISTED_CASES = {doc.TERMINAL: 40, doc.PAGE: 500}  # lines of the table of cases
_NUMBER_FORMAT = ".6g"


class SweptCases(NamedTuple):
    """All cases of a sweep: a description of the table, its blocks in SI units, its columns (cases,), and a summary.

    `status` determines the colour of the summary. `drawing` is SVG text, and is empty if the cases have no axes to
    draw.
    """

    mission: Mission
    described: Described
    blocks: Sequence[Part]
    columns: Mapping[str, Values]
    summary: str
    status: str
    overrides: tuple[Override, ...] = ()
    drawing: str = ""

    @property
    def file(self) -> str:
        """Path of the mission file."""
        return self.mission.file

    @property
    def name(self) -> str:
        """Name of the mission."""
        return self.mission.name

    @property
    def changes(self) -> tuple[SetValue, ...]:
        """Values that were set by options in place of the values in the file."""
        return self.mission.changes


# ---------------------------------------------------------------- for programs
def content(answers: Sequence[SweptCases]) -> dict[str, object]:
    """Content of the JSON document `sweep/1`: the columns with their units, and the values of each case.

    The values of varied keys have the units that the user gave, and all other values have SI units. A missing value
    is null.
    """
    (swept,) = answers
    facts = {name: value for name, value in swept.described.facts.items() if name not in ("format", "source")}
    columns = [
        {"name": column.name, "unit": column.unit or None, "description": column.words}
        for column in swept.described.columns
    ]
    return {"file": swept.file, **facts, "columns": columns, "cases": list(_cases(swept))}


def _cases(swept: SweptCases) -> Iterator[dict[str, object]]:
    names = [column.name for column in swept.described.columns]
    lists = [_values(column, swept.columns[column.name]) for column in swept.described.columns]
    for values in zip(*lists, strict=True):
        yield dict(zip(names, values, strict=True))


def _values(column: Column, values: Values) -> list[object]:
    """List the values of a column; a missing number or an empty text becomes None."""
    if column.is_text:
        return [text or None for text in values.tolist()]
    return [number if np.isfinite(number) else None for number in np.asarray(values, float).tolist()]


def records(answers: Sequence[SweptCases]) -> Records:
    """Table of the answer: one line for each case; the names of the columns include their units."""
    (swept,) = answers
    headings = {column.name: column.heading for column in swept.described.columns}
    lines = [{headings[name]: value for name, value in case.items()} for case in _cases(swept)]
    return Records(tuple(headings.values()), lines)


def as_csv(answers: Sequence[SweptCases], style: Style) -> str:
    """Write the table of all cases with its metadata as CSV, in the same form as in the files of `sweep`."""
    (swept,) = answers
    return "".join(texts(swept.described, swept.blocks))


# ---------------------------------------------------------------- for people
def document(answers: Sequence[SweptCases], style: Style) -> doc.AnswerDocument:
    """Text of the answer: the number of cases that comply, a drawing of the cases, and a table of them."""
    (swept,) = answers
    return mission_document("Trade study", answers, [mission_chapter(swept, 1, _blocks(swept))])


def _blocks(swept: SweptCases) -> Iterator[doc.Block]:
    varied = [column for column in swept.described.columns if column.name in swept.described.swept.varied]
    keys = " and ".join(column.name for column in varied)
    terms = f"{swept.described.facts['model']} model"
    yield opening(swept, f"{keys}: {swept.summary}", swept.status, terms)
    if swept.drawing:
        yield doc.Figure("cases.svg", "mission-1", f"Cases of {keys}", "Cases", swept.drawing)
    for medium, count in _MAX_LISTED_CASES.items():
        yield doc.Only(medium, list(_listed(swept, varied, count)))


def _listed(swept: SweptCases, varied: Sequence[Column], count: int) -> Iterator[doc.Block]:
    """Yield a table of the first `count` cases, and a remark if there are further cases."""
    heads = [
        *(doc.Head(column.name, "" if column.is_text else "number", column.unit) for column in varied),
        doc.Head("status"),
        doc.Head("use", "number"),
        doc.Head("decided by"),
        doc.Head("requirement", medium=doc.PAGE),
    ]
    cases = list(_cases(swept))
    rows: list[doc.Line] = []
    for case in cases[:count]:
        values = [_shown(case[column.name]) for column in varied]
        status = str(case["status"])
        requirement = BINDING_WORDS.get(str(case["binding_requirement"]), case["binding_requirement"])
        decided = [case["worst_row"] or case["reason"], case["doubts"] if status == "warn" else None]
        decided_by = printable(", ".join(str(text) for text in decided if text) or "–")
        use = case["utilization"]
        use_text = use_words(use if isinstance(use, float) else None)
        rows.append([*values, doc.Badge(status), use_text, decided_by, str(requirement or "–")])
    yield doc.TextTable("Cases", "Cases of the study", heads, rows)
    if len(cases) > count:
        yield doc.Paragraph(f"{len(cases) - count} more cases: CSV, JSON and the workbook have all of them.")


def _shown(value: object) -> str:
    if value is None:
        return "–"
    return f"{value:{_NUMBER_FORMAT}}" if isinstance(value, float) else printable(str(value))


def status_of(statuses: Mapping[str, int]) -> str:
    """Status that determines the colour of a summary: the best status of all cases; `fail` if there are no cases.

    `statuses` has the number of cases with each status.
    """
    return next((name for name in reversed(STATUS) if STATUS[name].gates and statuses.get(name)), "fail")
