"""Write an answer as a workbook for Excel and similar programs: its text, its tables, and its numbers in SI units.

The same answer always gives the same file, byte for byte.
"""

import re
from collections.abc import Iterator, Sequence
from datetime import datetime
from importlib.util import find_spec
from io import BytesIO
from typing import TYPE_CHECKING
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from bisar_budget.extras import MissingExtraError, install_command
from bisar_budget.faults import printable
from bisar_budget.report import document as doc
from bisar_budget.report.answers import Records
from bisar_budget.report.renderers.text import plain

if TYPE_CHECKING:
    from openpyxl import Workbook
    from openpyxl.worksheet.worksheet import Worksheet

_MAX_TITLE_CHARACTERS = 31  # characters of the name of a sheet
_FORBIDDEN = re.compile(r"[\[\]:*?/\\']")  # characters that Excel refuses in the name of a sheet
_CONTROLS = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f]")  # characters that XML refuses
_TIME_OF_WRITING = re.compile(rb"(<dcterms:modified[^>]*>)[^<]*(?=</dcterms:modified>)")  # of openpyxl
_MAX_COLUMN_CHARACTERS = 60  # characters
_NO_DATE = datetime(1980, 1, 1)  # the first day of a ZIP archive
_TEXT_SHEET, _DATA_SHEET = "Answer", "Data"  # names of the first and of the last sheet


def workbook(document: doc.AnswerDocument, records: Records) -> bytes:
    """Write a workbook: a sheet with the text, a sheet for each table, and a sheet with the numbers.

    Raises
    ------
    MissingExtraError
        openpyxl is not installed.
    """
    if find_spec("openpyxl") is None:
        raise MissingExtraError(f"xlsx needs openpyxl, which is not installed; {install_command('office')} brings it")
    from openpyxl import Workbook

    book = Workbook()
    book.properties.creator = f"bisar-budget {document.version}"
    book.properties.created = book.properties.modified = _NO_DATE
    texts = book.worksheets[0]
    texts.title = _TEXT_SHEET
    for line in [[document.title, plain(document.subject)], *_texts(document)]:
        _append(texts, line)
    _fit(texts)
    for block in doc.blocks_of(document):
        if isinstance(block, doc.TextTable) and block.rows:
            _table(book, block.on(doc.PAGE))
    _numbers(book, records)
    file = BytesIO()
    book.save(file)
    return _undated(file)


def _texts(document: doc.AnswerDocument) -> Iterator[list[str]]:
    """Yield the cells of each line of the sheet that contains the text of the document.

    A fact has two cells, for its name and its value. Any other line has a single cell.
    """
    yield from ([plain(name), plain(value)] for name, value in document.facts.pairs)
    for block in doc.blocks_of(document):
        match block:
            case doc.Chapter(title):
                yield []
                yield [plain(title)]
            case doc.Opening():
                for inner in block.page_blocks():
                    yield from _lines(inner)
            case _:
                yield from _lines(block)


def _lines(block: doc.Block) -> Iterator[list[str]]:
    match block:
        case doc.Paragraph(text):
            yield [plain(text)]
        case doc.Facts(pairs):
            yield from ([plain(name), plain(value)] for name, value in pairs)
        case doc.Items(items):
            yield from ([" ".join(map(plain, paragraphs))] for paragraphs in items)


def _table(book: "Workbook", table: doc.TextTable) -> None:
    sheet = book.create_sheet(_sheet_title(table.label or plain(table.caption)))
    heads = [f"{plain(head.text)} [{head.unit}]" if head.unit else plain(head.text) for head in table.heads]
    _append(sheet, heads, is_head=True)
    for row in table.rows:
        _append(sheet, [plain(cell) for cell in row])
    _fit(sheet)


def _sheet_title(text: str) -> str:
    return _FORBIDDEN.sub(" ", printable(text))[:_MAX_TITLE_CHARACTERS].strip() or "Table"


def _numbers(book: "Workbook", records: Records) -> None:
    sheet = book.create_sheet(_DATA_SHEET)
    _append(sheet, list(records.columns), is_head=True)
    for line in records.lines:
        _append(sheet, [_number_or_text(line.get(name)) for name in records.columns])
    sheet.freeze_panes = "A2"
    _fit(sheet)


def _number_or_text(value: object) -> str | float | None:
    if value is None or isinstance(value, bool | int | float):
        return value
    return " ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)


def _append(sheet: "Worksheet", cells: Sequence[str | float | None], *, is_head: bool = False) -> None:
    """Append a line to a sheet. A string that looks like a formula is written as text."""
    from openpyxl.styles import Font

    line = sheet.max_row + 1 if sheet.max_row > 1 or sheet["A1"].value is not None else 1
    for column, value in enumerate(cells, start=1):
        text = _CONTROLS.sub(" ", value) if isinstance(value, str) else value
        cell = sheet.cell(line, column, text)
        if isinstance(value, str):
            cell.data_type = "s"
        if is_head:
            cell.font = Font(bold=True)
    if not cells:
        sheet.cell(line, 1, " ")


def _fit(sheet: "Worksheet") -> None:
    """Make each column wide enough for its longest text, up to a limit."""
    from openpyxl.utils import get_column_letter

    for number, column in enumerate(sheet.columns, start=1):
        longest = max((len(str(cell.value)) for cell in column if cell.value is not None), default=0)
        sheet.column_dimensions[get_column_letter(number)].width = min(longest, _MAX_COLUMN_CHARACTERS) + 2


def _undated(file: BytesIO) -> bytes:
    """Copy a ZIP archive without the dates of its files, and return its bytes."""
    undated = BytesIO()
    with ZipFile(file) as dated, ZipFile(undated, "w", ZIP_DEFLATED) as archive:
        for name in dated.namelist():
            archive.writestr(
                ZipInfo(name),
                _TIME_OF_WRITING.sub(rb"\g<1>" + _NO_DATE.isoformat().encode() + b"Z", dated.read(name)),
                ZIP_DEFLATED,
            )
    return undated.getvalue()
