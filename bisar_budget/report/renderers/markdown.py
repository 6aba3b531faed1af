"""Write a document as Markdown for GitHub that is also readable as plain text. Drawings are separate files."""

import re
from collections.abc import Iterable, Iterator, Mapping
from html import escape, unescape

from bisar_budget.faults import printable
from bisar_budget.report import document as doc
from bisar_budget.report.explain import notation
from bisar_budget.report.explain.notation import Sum, WorkedEquation
from bisar_budget.report.words.sentences import markdown_row, markdown_text, uri

_BAR_WIDTH, _LIMIT_WIDTH = 20, 16  # characters of a whole bar, and of a utilization of 100 %
_BRACKETED = {"own-id": " ({})", "origin": "({})", "own-text": ": {}"}
_DESCRIPTION = re.compile("<desc[^>]*>(.*?)</desc>", re.DOTALL)


def markdown(document: doc.AnswerDocument, assets: str) -> str:
    """Write a document as Markdown.

    `assets` is the folder of the drawings. If it is empty, drawings are left out.
    """
    subject = "Motion-measurement error budget, bistatic SAR."
    texts = [f"# {document.title}", subject, *_blocks([document.facts, *document.chapters], uri(assets))]
    return "\n\n".join(text.rstrip("\n") for text in texts if text) + "\n"


def pictures(document: doc.AnswerDocument) -> Mapping[str, bytes]:
    """Return the contents of the drawings and images of a document, by file name."""
    files: dict[str, bytes] = {}
    for block in doc.blocks_of(document):
        if isinstance(block, doc.Figure):
            files[block.name] = block.svg.encode()
        elif isinstance(block, doc.Images):
            files |= {chip.name: chip.png for chip in block.images}
    return files


# ---------------------------------------------------------------------- parts of a line
def _text(text: doc.Text, badge: str = "**{}**") -> str:
    match text:
        case tuple():
            line = "".join(_inside(inner, badge) for inner in text)
            return line.replace("  ", " ")  # a bar begins with a space, which may follow another one
        case doc.Name(words):
            return markdown_text(words)
        case doc.Styled(style, inner):
            return _BRACKETED.get(style, "{}").format(_text(inner, badge))
        case doc.Badge():
            return badge.format(markdown_text(text.words))
        case doc.Use(fraction):
            return "" if fraction is None else f" {_use(fraction)}"
        case doc.Bar(fraction):
            return _bar(fraction)
        case doc.Swatch(_, fraction):
            return f"{_bar(fraction)} "
        case doc.Code(words):
            return f"`{words}`"
    return markdown_text(text)


def _inside(text: doc.Text, badge: str) -> str:
    """Write part of a line of text. Its leading spaces are kept, and the text after them is escaped."""
    if isinstance(text, str):
        return " " * (len(text) - len(text.lstrip(" "))) + _text(text.lstrip(" "))
    return _text(text, badge)


def _bar(fraction: float) -> str:
    """Draw a fraction from 0 to 1 as a bar of characters."""
    return ("█" * round(_BAR_WIDTH * fraction)).ljust(_BAR_WIDTH, "░")


def _use(fraction: float) -> str:
    """Draw a utilization as a bar of characters with a mark at the limit.

    An arrow is appended if the utilization is beyond the end of the bar.
    """
    bar = _bar(min(1.0, fraction * _LIMIT_WIDTH / _BAR_WIDTH))
    return f"{bar[:_LIMIT_WIDTH]}┃{bar[_LIMIT_WIDTH:]}{'▶' if fraction > _BAR_WIDTH / _LIMIT_WIDTH else ''}"


# ---------------------------------------------------------------------- blocks
def _blocks(blocks: Iterable[doc.Block], assets: str) -> Iterator[str]:
    """Yield the text of each block. The caller puts blank lines between the texts."""
    is_introduced = False
    for block in blocks:
        yield from _block(block, assets, is_introduced)
        is_introduced = isinstance(block, doc.Paragraph) and isinstance(block.text, str) and block.text.endswith(":")


def _block(block: doc.Block, assets: str, is_introduced: bool) -> Iterator[str]:
    match block:
        case doc.Paragraph(doc.Code(words), "command"):
            yield f"    {printable(words)}"  # indented, since the words could contain a fence
        case doc.Paragraph(text, style):
            yield f"**{_text(text)}**" if style.startswith("verdict") else _text(text)
        case doc.Facts(pairs):
            yield "\n".join(_facts(pairs))
        case doc.Items(items, is_numbered=True):
            for number, paragraphs in enumerate(items, start=1):
                yield f"{number}. " + "\n\n   ".join(map(_text, paragraphs))
        case doc.Items(items):
            yield "\n".join(f"- {' '.join(map(_text, paragraphs))}" for paragraphs in items)
        case doc.Opening():
            yield from _blocks(block.page_blocks(), assets)
        case doc.Only(medium, inner):
            yield from _blocks(inner if medium == doc.PAGE else (), assets)
        case doc.TextTable():
            if not is_introduced:
                caption = _text(block.caption)
                is_sentence = ":" in caption or caption.endswith(".")
                yield f"{caption.removesuffix('.')}." if is_sentence else f"{caption}:"
            yield _table(block.on(doc.PAGE))
        case doc.Figure(title=title):
            if assets:
                yield f"![{_text(title)}]({assets}/{block.name})"
            if not block.is_told:
                match = _DESCRIPTION.search(block.svg)  # for readers who cannot see the drawing
                yield markdown_text(unescape(match[1]) if match else "")
        case doc.Images(chips):
            if assets:
                yield "\n".join(
                    f'<img src="{assets}/{chip.name}" alt="{escape(printable(chip.title))}" '
                    f'width="{chip.size[0]}" height="{chip.size[1]}">'  # Markdown has no syntax for a size
                    for chip in chips
                )
                yield "\n".join(f"- {markdown_text(chip.caption)}" for chip in chips)
        case doc.Steps(_, steps):
            for title, equations in steps:
                yield f"{markdown_text(title)}{':' if equations else ''}"
                yield from _formulas(equations)
        case doc.Group(_, inner, heading):
            if heading:
                yield f"#### {_text(heading)}"
            yield from _blocks(inner, assets)
        case doc.Chapter(title, inner, level=level):
            yield f"{'#' * level} {_text(title)}"
            yield from _blocks(inner, assets)


def _facts(pairs: Iterable[tuple[doc.Text, doc.Text]]) -> Iterator[str]:
    current_name: doc.Text = ""
    for name, value in pairs:
        current_name = name or current_name
        yield f"- {_text(current_name)}: {_text(value)}"


def _table(table: doc.TextTable) -> str:
    heads = [_text(doc.page_head(head)) for head in table.heads]
    rules = ["---:" if head.style == "number" else "---" for head in table.heads]
    rows = [[_text(doc.page_cell(cell), badge="{}") for cell in row] for row in table.rows]
    return "\n".join(map(markdown_row, (heads, rules, *rows)))


def _formulas(equations: Iterable[WorkedEquation | str | doc.Equality]) -> Iterator[str]:
    """Yield formulas and texts in order: each formula as a LaTeX block, and successive texts as a list."""
    lines: list[str] = []
    for equation in equations:
        if latex := _latex(equation):
            yield from ["\n".join(lines)] if lines else []
            lines = []
            yield f"```math\n{latex}\n```"
        elif isinstance(equation, WorkedEquation):
            lines.append(f"- `{' '.join(notation.as_text(equation)).rstrip()}`")  # without text of the user
        else:
            text = str(equation)
            lines.append(
                f"- `{notation.readable(text)}`" if isinstance(equation, Sum) else f"- {markdown_text(text)}"
            )
    yield from ["\n".join(lines)] if lines else []


def _latex(equation: WorkedEquation | str | doc.Equality) -> str:
    """Write a formula as LaTeX. The result is empty for prose or arithmetic."""
    if isinstance(equation, doc.Equality):
        return " = ".join(notation.catalogued(side, notation.LATEX) for side in (equation.left, equation.right))
    if isinstance(equation, WorkedEquation) and equation.formula and notation.is_formula(equation):
        return "\\begin{{aligned}}\n{} \\\\\n{}\n\\end{{aligned}}".format(*notation.as_latex(equation))
    return ""
