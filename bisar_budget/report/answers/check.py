"""The answer of the command check as a document: the compliance report of a run."""

from collections.abc import Mapping

from bisar_budget.findings.mission import Report
from bisar_budget.report import Style
from bisar_budget.report import document as doc
from bisar_budget.report.answers import Records
from bisar_budget.report.compliance.summary import compliance
from bisar_budget.report.formats.csv_table import CSV_COLUMNS, lines_of
from bisar_budget.report.renderers import html, markdown, xlsx


def document(report: Report, style: Style) -> doc.AnswerDocument:
    """Text of the answer: the compliance report, which is the same in every format with pages."""
    return compliance(report, style)


def records(report: Report) -> Records:
    """Table of the answer, with the columns of CSV: one line for each requirement, row and fault."""
    lines = [dict(zip(CSV_COLUMNS, cells, strict=True)) for mission in report.missions for cells in lines_of(mission)]
    return Records(CSV_COLUMNS, lines)


def as_html(report: Report, style: Style) -> str:
    """Write the compliance report as a page."""
    return html.page(document(report, style))


def as_markdown(report: Report, style: Style) -> str:
    """Write the compliance report as Markdown, with links to the drawings in the folder `style.assets`."""
    return markdown.markdown(document(report, style), style.assets)


def pictures(report: Report, style: Style) -> Mapping[str, bytes]:
    """Return the drawings and images of the report by the names of their files."""
    return markdown.pictures(document(report, style))


def as_xlsx(report: Report, style: Style) -> bytes:
    """Write the compliance report as a workbook; its last sheet has the lines of CSV."""
    return xlsx.workbook(document(report, style), records(report))
