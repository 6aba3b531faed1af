"""The compliance report as Markdown for GitHub, which can be read as it is; drawings are files beside it."""

import re
from collections.abc import Iterable, Iterator, Mapping
from html import escape, unescape

from bisar_budget.faults import printable
from bisar_budget.findings.mission import Report
from bisar_budget.report import Style
from bisar_budget.report.compliance import document as doc
from bisar_budget.report.compliance.summary import compliance
from bisar_budget.report.explain import notation
from bisar_budget.report.explain.notation import Sum, WorkedEquation
from bisar_budget.report.words.sentences import markdown_row, markdown_text, uri

_BAR, _LIMIT = 20, 16  # characters of a bar, and of a use as large as its limit
_BRACKETED = {"own-id": " ({})", "origin": "({})"}
_DESCRIPTION = re.compile("<desc[^>]*>(.*?)</desc>", re.DOTALL)


def as_markdown(report: Report, style: Style) -> str:
    """Write the report; drawings are linked where `style.assets` says that they lie."""
    return written(compliance(report, style), uri(style.assets))


def written(document: doc.Compliance, assets: str) -> str:
    """Write a document; `assets` is where its drawings lie, empty: nowhere."""
    subject = "Motion-measurement error budget, bistatic SAR."
    parts = [f"# {document.title}", subject, *_blocks([document.facts, *document.chapters], assets)]
    return "\n\n".join(part.rstrip("\n") for part in parts if part) + "\n"


def pictures(report: Report, style: Style) -> Mapping[str, bytes]:
    """Return the drawings and images of the report by the names of their files."""
    files: dict[str, bytes] = {}
    for block in doc.blocks_of(compliance(report, style)):
        if isinstance(block, doc.Figure):
            files[block.name] = block.svg.encode()
        elif isinstance(block, doc.Images):
            files |= {chip.name: chip.png for chip in block.images}
    return files


# ---------------------------------------------------------------------- parts of a line
def _text(text: doc.Text, badge: str = "**{}**") -> str:
    match text:
        case tuple():
            line = "".join(_inside(part, badge) for part in text)
            return line.replace("  ", " ")  # a bar has a space before it where a page has none
        case doc.Name(words):
            return markdown_text(words)
        case doc.Styled(style, inner):
            return _BRACKETED.get(style, "{}").format(_text(inner, badge))
        case doc.Badge():
            return badge.format(markdown_text(text.words))
        case doc.Use(part):
            return "" if part is None else f" {_use(part)}"
        case doc.Bar(part):
            return _bar(part)
        case doc.Swatch(_, part):
            return f"{_bar(part)} "
        case doc.Code(words):
            return f"`{words}`"
    return markdown_text(text)


def _inside(text: doc.Text, badge: str) -> str:
    """A part of a line: a space that it begins with is one."""
    if isinstance(text, str):
        return " " * (len(text) - len(text.lstrip(" "))) + _text(text.lstrip(" "))
    return _text(text, badge)


def _bar(part: float) -> str:
    """A bar of text."""
    return ("█" * round(_BAR * part)).ljust(_BAR, "░")


def _use(part: float) -> str:
    """A bar of text with a mark at the limit; what goes beyond its end has an arrow."""
    bar = _bar(min(1.0, part * _LIMIT / _BAR))
    return f"{bar[:_LIMIT]}┃{bar[_LIMIT:]}{'▶' if part > _BAR / _LIMIT else ''}"


# ---------------------------------------------------------------------- blocks
def _blocks(blocks: Iterable[doc.Block], assets: str) -> Iterator[str]:
    """Pieces that blank lines divide."""
    is_introduced = False
    for block in blocks:
        yield from _block(block, assets, is_introduced)
        is_introduced = isinstance(block, doc.Paragraph) and isinstance(block.text, str) and block.text.endswith(":")


def _block(block: doc.Block, assets: str, is_introduced: bool) -> Iterator[str]:
    match block:
        case doc.Paragraph(doc.Code(words), "command"):
            yield f"    {printable(words)}"  # indented: no fence of its own can end it
        case doc.Paragraph(text, style):
            yield f"**{_text(text)}**" if style.startswith("verdict") else _text(text)
        case doc.Facts(pairs):
            yield "\n".join(_facts(pairs))
        case doc.Items(items, is_numbered=True):
            for number, paragraphs in enumerate(items, start=1):
                yield f"{number}. " + "\n\n   ".join(map(_text, paragraphs))
        case doc.Items(items):
            yield "\n".join(f"- {' '.join(map(_text, paragraphs))}" for paragraphs in items)
        case doc.TextTable():
            if not is_introduced:
                caption = _text(block.caption)
                is_complete = ":" in caption or caption.endswith(".")
                yield f"{caption.removesuffix('.')}." if is_complete else f"{caption}:"
            yield _table(block)
        case doc.Figure(title=title):
            if assets:
                yield f"![{_text(title)}]({assets}/{block.name})"
            if not block.is_told:
                match = _DESCRIPTION.search(block.svg)  # for readers who cannot see it
                yield markdown_text(unescape(match[1]) if match else "")
        case doc.Images(chips):
            if assets:
                yield "\n".join(
                    f'<img src="{assets}/{one.name}" alt="{escape(printable(one.title))}" '
                    f'width="{one.size[0]}" height="{one.size[1]}">'  # a size, which Markdown cannot say
                    for one in chips
                )
                yield "\n".join(f"- {markdown_text(one.caption)}" for one in chips)
        case doc.Steps(_, steps):
            for title, parts in steps:
                yield f"{markdown_text(title)}{':' if parts else ''}"
                yield from _formulas(parts)
        case doc.Group(_, inner, heading):
            if heading:
                yield f"#### {_text(heading)}"
            yield from _blocks(inner, assets)
        case doc.Chapter(title, inner, level=level):
            yield f"{'#' * level} {_text(title)}"
            yield from _blocks(inner, assets)


def _facts(pairs: Iterable[tuple[doc.Text, doc.Text]]) -> Iterator[str]:
    before: doc.Text = ""
    for name, value in pairs:
        before = name or before
        yield f"- {_text(before)}: {_text(value)}"


def _table(table: doc.TextTable) -> str:
    heads = [_text(head.text) for head in table.heads]
    rules = ["---:" if head.style == "number" else "---" for head in table.heads]
    rows = [[_text(cell, badge="{}") for cell in row] for row in table.rows]
    return "\n".join(map(markdown_row, (heads, rules, *rows)))


def _formulas(parts: Iterable[WorkedEquation | str | doc.Equality]) -> Iterator[str]:
    """A block of LaTeX for each formula, a list of what stands between them."""
    lines: list[str] = []
    for part in parts:
        if latex := _latex(part):
            yield from ["\n".join(lines)] if lines else []
            lines = []
            yield f"```math\n{latex}\n```"
        elif isinstance(part, WorkedEquation):
            lines.append(f"- `{' '.join(notation.as_text(part)).rstrip()}`")  # nothing of the user's is in it
        else:
            text = str(part)
            lines.append(f"- `{notation.readable(text)}`" if isinstance(part, Sum) else f"- {markdown_text(text)}")
    yield from ["\n".join(lines)] if lines else []


def _latex(part: WorkedEquation | str | doc.Equality) -> str:
    """A formula as LaTeX; nothing of words and of arithmetic."""
    if isinstance(part, doc.Equality):
        return " = ".join(notation.catalogued(side, notation.LATEX) for side in (part.left, part.right))
    if isinstance(part, WorkedEquation) and part.formula and notation.is_formula(part):
        return "\\begin{{aligned}}\n{} \\\\\n{}\n\\end{{aligned}}".format(*notation.as_latex(part))
    return ""
