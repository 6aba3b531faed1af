"""Output of the `check` command as a document: the compliance report of a run."""

from collections.abc import Mapping

from bisar_budget.findings.mission import MissionFindings, Report
from bisar_budget.findings.row import worst_first
from bisar_budget.report import Style
from bisar_budget.report import document as doc
from bisar_budget.report.answers import Records
from bisar_budget.report.answers.shared_blocks import (
    guard_blocks,
    mission_chapter,
    mission_document,
    opening,
    requirement_table,
)
from bisar_budget.report.compliance.summary import compliance
from bisar_budget.report.formats.csv_table import CSV_COLUMNS, lines_of
from bisar_budget.report.renderers import html, markdown, xlsx
from bisar_budget.report.words.heading import rule_words
from bisar_budget.report.words.requirements import declared_words, verdict
from bisar_budget.report.words.sentences import allowable_words, declared_size, matters, shown_use, use_words


def document(report: Report, style: Style) -> doc.AnswerDocument:
    """Text of the answer: the compliance report, which is the same in HTML, Markdown and workbooks."""
    return compliance(report, style)


def records(report: Report) -> Records:
    """Table of the answer with the columns of the CSV format: one line for each requirement, row and fault."""
    lines = [dict(zip(CSV_COLUMNS, cells, strict=True)) for mission in report.missions for cells in lines_of(mission)]
    return Records(CSV_COLUMNS, lines)


def as_html(report: Report, style: Style) -> str:
    """Write the compliance report as an HTML page."""
    return html.page(document(report, style))


def as_markdown(report: Report, style: Style) -> str:
    """Write the compliance report as Markdown, with links to the drawings in the folder `style.assets`."""
    return markdown.markdown(document(report, style), style.assets)


def pictures(report: Report, style: Style) -> Mapping[str, bytes]:
    """Return the contents of the drawings and images of the report, by file name."""
    return markdown.pictures(document(report, style))


def as_xlsx(report: Report, style: Style) -> bytes:
    """Write the compliance report as a workbook; its last sheet has the same lines as the CSV format."""
    return xlsx.workbook(document(report, style), records(report))


_MAX_NOTEBOOK_ROWS = 12  # largest number of rows of a notebook


def brief(findings: MissionFindings) -> doc.AnswerDocument:
    """Short compliance report for a notebook: the table of requirements, and the rows that matter most."""
    rows = [row for row in worst_first(findings.rows) if matters(row) or findings.is_empty]
    blocks: list[doc.Block] = [
        opening(findings, verdict(findings), findings.status, rule_words(findings)),
        requirement_table(findings),
        *guard_blocks(findings.guard),
        doc.TextTable(
            "Rows",
            "Rows, worst first",
            doc.heads("row", *doc.numbers("declared", "allowable", "use"), "status"),
            [
                [
                    doc.Name(row.id),
                    declared_size(row, findings),
                    allowable_words(row, findings),
                    use_words(shown_use(row)),
                    doc.Badge(row.status),
                ]
                for row in rows[:_MAX_NOTEBOOK_ROWS]
            ],
        ),
        doc.Paragraph(
            f"{declared_words(findings.kinds)} {len(findings.rows) - len(rows[:_MAX_NOTEBOOK_ROWS])} rows more: "
            "to_dataframe()."
        ),
    ]
    return mission_document("Check", [findings], [mission_chapter(findings, 1, blocks)])
