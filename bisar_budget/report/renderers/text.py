"""Write a document for a terminal: aligned tables, wrapped sentences, and colours for verdicts and statuses."""

from collections.abc import Iterable, Iterator

from bisar_budget.faults import printable
from bisar_budget.findings.status import STATUS
from bisar_budget.report import Style
from bisar_budget.report import document as doc
from bisar_budget.report.words.heading import wrapped_overrides
from bisar_budget.report.words.sentences import spaced, wrapped, wrapped_counts

_MIN_NAME_WIDTH = 12  # of the names of facts
_STATUS_WIDTH = 8  # characters of a status, the same in every table
_MIN_SENTENCE_WIDTH = 40  # characters of a last column that may be on a line of its own
_VERDICT_SGR = {"optimistic": "1;31", "confirmed": "32", "conservative": "33"}  # of images; others are of `STATUS`


def text(document: doc.AnswerDocument, style: Style) -> str:
    """Write a document as text.

    Lines are at most 80 columns wide, and lines of tables at most `style.table_width` columns.
    """
    chapters = ("\n".join(lines(chapter.blocks, style)) for chapter in document.chapters)
    return "\n\n".join(chapters) + "\n"


# ---------------------------------------------------------------------- parts of a line
def plain(line: doc.Text) -> str:
    """Write text without markup, in characters that every terminal can show.

    Bars and colour swatches are left out, because they only repeat numbers.
    """
    if isinstance(line, str):  # nearly every text, and faster than the patterns below
        return printable(line).replace(" → ", " -> ")
    match line:
        case tuple():
            return "".join(map(plain, line))
        case doc.Styled(_, inner):
            return plain(inner)
        case doc.Badge(status):
            return _badge_words(status)
        case doc.Use() | doc.Bar() | doc.Swatch():
            return ""
        case doc.Name(words) | doc.Code(words):
            return printable(words)


def _badge_words(status: str) -> str:
    return STATUS[status].text if status in STATUS else status.replace("_", " ")


def _sgr(status: str) -> str:
    return STATUS[status].sgr if status in STATUS else _VERDICT_SGR.get(status, "0")


# ---------------------------------------------------------------------- blocks
def lines(blocks: Iterable[doc.Block], style: Style) -> Iterator[str]:
    """Yield the lines of blocks, with an empty line between two blocks."""
    is_first = True
    for block in blocks:
        for number, line in enumerate(_block(block, style)):
            if not (number or is_first):
                yield ""
            yield line
            is_first = False


def _block(block: doc.Block, style: Style) -> Iterator[str]:
    match block:
        case doc.Opening():
            yield from _opening(block, style)
        case doc.Lead(status, words, breaks):
            text = f"{STATUS[status].text} {words}"
            wrap = wrapped(text, "  ") if breaks == " " else wrapped_counts(text) if breaks else [text]
            first, *more = wrap
            yield style.coloured(STATUS[status].text, STATUS[status].sgr) + first.removeprefix(STATUS[status].text)
            yield from more
        case doc.Overrides(texts):
            yield from wrapped_overrides(texts)
        case doc.Close(blocks):
            for inner in blocks:
                yield from _block(inner, style)
        case doc.Only(doc.TERMINAL, blocks):
            yield from lines(blocks, style)
        case doc.Paragraph(words, paragraph_style):
            first, *more = wrapped(plain(words), "  ")
            is_verdict = paragraph_style.startswith("verdict ")
            yield style.coloured(first, _sgr(paragraph_style.removeprefix("verdict "))) if is_verdict else first
            yield from more
        case doc.Facts(pairs):
            width = max([_MIN_NAME_WIDTH, *(len(plain(name)) for name, _ in pairs)])
            for name, value in pairs:
                yield from wrapped(f"{plain(name):<{width}} {plain(value)}", " " * (width + 1))
        case doc.Items():
            yield from _items(block)
        case doc.TextTable():
            yield from _table(block.on(doc.TERMINAL), style)
        case doc.Group(_, [doc.Items() as items], heading) if heading:
            yield plain(heading)
            yield from _items(items, "  ")
        case doc.Group(_, blocks, heading):
            yield from [plain(heading)] if heading else []
            yield from lines(blocks, style)
        case doc.Chapter(title, blocks):
            yield from wrapped(plain(title), "  ")
            yield ""
            yield from lines(blocks, style)


def _items(block: doc.Items, indent: str = "") -> Iterator[str]:
    for number, paragraphs in enumerate(block.items, start=1):
        start = f"{number}. " if block.is_numbered else ""
        yield from wrapped(indent + start + " ".join(map(plain, paragraphs)), indent + "  ")


def _opening(opening: doc.Opening, style: Style) -> Iterator[str]:
    first, *continuation = wrapped(plain(opening.verdict), "  ")
    yield style.coloured(first, STATUS[opening.status].sgr)
    yield from continuation
    terms = f"; {opening.terms}" if opening.terms else ""
    for words in (*opening.more, f"{opening.file}, {opening.name}{terms}"):
        yield from wrapped(plain(words), "  ")
    yield from wrapped_overrides(opening.overrides)


def _table(table: doc.TextTable, style: Style) -> Iterator[str]:
    """Yield the lines of a table. Statuses are coloured, and a missing value is a hyphen instead of a dash.

    If a name does not fit in its column, it is written on a line above its values. If a sentence in the last column
    does not fit, it is written on separate lines below the values.
    """
    heads = [[plain(head.text) for head in table.heads]]
    heads += [[head.unit for head in table.heads]] if any(head.unit for head in table.heads) else []
    cells = [["-" if cell == "–" else cell for cell in map(plain, row)] for row in table.rows]
    sides = "".join(">" if head.style == "number" else "<" for head in table.heads)
    widths = [
        max([head.width, *(len(row[column]) for row in (*heads, *cells))]) for column, head in enumerate(table.heads)
    ]
    is_long = sides.endswith("<") and widths[-1] > _MIN_SENTENCE_WIDTH
    ends_with_sentence = is_long or table.heads[-1].is_sentence
    if ends_with_sentence:
        widths[-1] = max(len(head[-1]) for head in heads)
    starts_with_status = any(isinstance(row[0], doc.Badge) for row in table.rows)
    widths[0] = max(widths[0], _STATUS_WIDTH) if starts_with_status else widths[0]
    named = 1 if starts_with_status else 0  # the column with the names of the rows
    if sides[named] == "<":  # numbers stay on their line
        fixed_width = sum(widths) - widths[named] + len(widths) - 1
        room = max(style.table_width - fixed_width, *(len(head[named]) for head in heads))
        widths[named] = max(len(row[named]) for row in (*heads, *cells) if len(row[named]) <= room)
    for head in heads:
        yield spaced(head, widths, sides).rstrip()
    below = table.below or [()] * len(cells)
    for line, row, texts in zip(table.rows, cells, below, strict=True):
        if len(row[named]) > widths[named]:
            yield _coloured(
                line[: named + 1], spaced(row[: named + 1], widths[: named + 1], sides[: named + 1]), style
            )
            row = ["" if column <= named else cell for column, cell in enumerate(row)]
        text = spaced(row, widths, sides).rstrip()
        if ends_with_sentence and len(text) > style.table_width:
            yield _coloured(line, spaced([*row[:-1], ""], widths, sides).rstrip(), style)
            yield from wrapped(f"    {row[-1]}", "    ")
        else:
            yield _coloured(line, text, style)
        indent = " " * (widths[0] + 1) if starts_with_status else "    "
        for note in texts:
            yield from wrapped(f"{indent}{note}", indent)


def _coloured(row: doc.Line, text: str, style: Style) -> str:
    """Colour the statuses of a row in `text`, which is the row as written in the table."""
    if not style.color:
        return text
    for column, cell in enumerate(row):
        if isinstance(cell, doc.Badge):
            word = _badge_words(cell.status)
            start = "" if not column else " "
            text = text.replace(f"{start}{word}", start + style.coloured(word, _sgr(cell.status)), 1)
    return text
