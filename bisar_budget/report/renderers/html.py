"""Write a document as an HTML page for light and dark screens and paper, without scripts or external files."""

import re
from base64 import b64encode
from collections.abc import Iterable, Sequence
from functools import cache

from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template
from markupsafe import Markup

from bisar_budget.faults import printable
from bisar_budget.findings.status import STATUS
from bisar_budget.report import document as doc
from bisar_budget.report.explain import notation
from bisar_budget.report.explain.notation import Sum, WorkedEquation
from bisar_budget.resources import resource

_BREAK_POINT = re.compile(
    r"([._/])(?=\w{2})"
)  # where a long name may break; one-letter axes stay with the name before
_LONG_WORD = re.compile(r"[^\s._/-]{30}(?=[^\s._/-])")  # may break after it, where no line is as wide
_BAR_ATTRIBUTES = 'viewBox="0 0 {} 8" preserveAspectRatio="none" aria-hidden="true" focusable="false"'
_USE_ATTRIBUTES = _BAR_ATTRIBUTES.format(120)  # a utilization of 100 % is at 96
_SHARE_ATTRIBUTES = _BAR_ATTRIBUTES.format(100)


@cache
def _page() -> Template:
    """Load the template of the page from `resource("templates")`.

    It is loaded only when needed, because compiling it takes as long as a check.
    """
    environment = Environment(
        loader=FileSystemLoader(resource("templates")),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {"css_string": _css_string, "text": _text}
    return environment.get_template("report.html.j2")


def page(document: doc.AnswerDocument) -> str:
    """Write a document as an HTML page."""
    return _page().render(
        document=document,
        facts=_block(document.facts),
        main=blocks_as_html(document.chapters),
        contents=_contents(document.chapters),
        statuses=STATUS.values(),
    )


def _contents(chapters: Sequence[doc.Chapter]) -> list[tuple[doc.Chapter, list[doc.Chapter]]]:
    """List the chapters for the table of contents, each with its subchapters; empty if there is only one entry."""
    listed = [chapter for chapter in chapters if chapter.is_listed]
    inner = [
        [block for block in chapter.blocks if isinstance(block, doc.Chapter) and block.is_listed]
        for chapter in listed
    ]
    return list(zip(listed, inner, strict=True)) if len(listed) + sum(map(len, inner)) > 1 else []


def _css_string(text: str) -> Markup:
    """Write text as a CSS string. Characters other than ASCII letters, digits and blanks become numeric escapes."""
    safe = (c if c.isascii() and (c.isalnum() or c == " ") else f"\\{ord(c):x} " for c in printable(text))
    return Markup(f'"{"".join(safe)}"')


# ---------------------------------------------------------------------- parts of a line
def _text(text: doc.Text) -> Markup:
    match text:
        case tuple():
            return Markup("").join(map(_text, text))
        case doc.Name(words, target):
            broken = Markup(_BREAK_POINT.sub(r"\1<wbr>", str(_plain(words))))
            return Markup('<a href="#{}">{}</a>').format(target, broken) if target else broken
        case doc.Styled("digest", str(digest)):  # without places to break, so that a search finds it
            return Markup('<span class="digest">{}</span>').format(printable(digest))
        case doc.Styled(style, inner):
            return Markup('<span class="{}">{}</span>').format(style, _text(inner))
        case doc.Badge(status):
            return Markup('<span class="status {}">{}</span>').format(status, text.words)
        case doc.Use(fraction, status):
            if fraction is None:
                return Markup("")
            beyond = '<path class="break" d="M108 9l4-10h3l-4 10z"/>' if fraction > 1.25 else ""
            bar = f'<rect class="track" width="120" height="8"/>{_fill(min(96 * fraction, 120))}{beyond}'
            return Markup(f'<svg class="use {status}" {_USE_ATTRIBUTES}>{bar}<path class="limit" d="M96 0v8"/></svg>')
        case doc.Bar(fraction, owner):
            bar = f'<rect class="track" width="100" height="8"/>{_fill(100 * fraction)}'
            return Markup(f'<svg class="part {owner}" {_SHARE_ATTRIBUTES}>{bar}</svg>')
        case doc.Swatch(owner):
            return Markup(f'<span class="swatch {owner}" aria-hidden="true"></span>')
        case doc.Code(words):
            return Markup("<code>{}</code>").format(printable(words))
    return _plain(text)


def _plain(text: str) -> Markup:
    """Write plain text as HTML. Line breaks are allowed within long words."""
    shown_text = printable(text)
    pieces = _LONG_WORD.sub("\\g<0>\n", shown_text).split("\n") if len(shown_text) > 30 else [shown_text]
    return Markup("<wbr>").join(pieces)


def _fill(width: float) -> str:
    return f'<rect class="fill" width="{width:.2f}" height="8"/>'


# ---------------------------------------------------------------------- blocks
def blocks_as_html(blocks: Iterable[doc.Block]) -> Markup:
    """Write blocks as HTML, one after another, for a page or a notebook."""
    return Markup("").join(map(_block, blocks))


def _block(block: doc.Block) -> Markup:
    match block:
        case doc.Paragraph(text, style):
            return _element("p", style, _text(text))
        case doc.Facts(pairs, style):
            rows = [Markup("<div>{}{}</div>\n").format(_cell("dt", key), _cell("dd", value)) for key, value in pairs]
            return _element("dl", style, Markup("\n{}").format(Markup("").join(rows)))
        case doc.Items(items, style, is_numbered):
            return _element("ol" if is_numbered else "ul", style, Markup("\n").join(["", *map(_item, items), ""]))
        case doc.Opening():
            return blocks_as_html(block.page_blocks())
        case doc.Only(medium, blocks):
            return blocks_as_html(blocks if medium == doc.PAGE else ())
        case doc.TextTable():
            return _table(block.on(doc.PAGE))
        case doc.Stack():
            return _stack(block)
        case doc.Figure(title=title, style=style):
            inner = _scroll(block.label, _inline(block))
            caption = Markup("<figcaption>{}</figcaption>").format(_text(title))
            return _element("figure", style, Markup("\n{}{}\n").format(inner, caption))
        case doc.Images(chips):
            images = (
                Markup(
                    '<figure><img src="data:image/png;base64,{}" alt="{}" width="{}" height="{}">'
                    "<figcaption>{}</figcaption></figure>\n"
                ).format(b64encode(chip.png).decode(), printable(chip.title), *chip.size, printable(chip.caption))
                for chip in chips
            )
            return _element("div", "chips", Markup("\n{}").format(Markup("").join(images)))
        case doc.Steps(label, steps, style):
            return _scroll(label, Markup("").join(_step(title, equations, style) for title, equations in steps))
        case doc.Group(style, blocks, heading):
            head = Markup("<h4>{}</h4>\n").format(_text(heading)) if heading else ""
            return _element("div", style, Markup("\n{}{}").format(head, blocks_as_html(blocks)))
        case doc.Chapter():
            return _chapter(block)
    raise TypeError(block)


def _element(tag: str, style: str, content: Markup) -> Markup:
    opening = Markup('<{} class="{}">').format(tag, style) if style else Markup("<{}>").format(tag)
    return Markup("{}{}</{}>\n").format(opening, content, tag)


def _scroll(label: str, content: Markup) -> Markup:
    """Wrap content in a region that can have the keyboard focus.

    The region scrolls if its content is wider than the page.
    """
    region = '<div class="scroll" tabindex="0" role="region" aria-label="{}">{}</div>'
    return Markup(region).format(printable(label), content)


def _chapter(chapter: doc.Chapter) -> Markup:
    level = f"h{chapter.level}"
    title, content = _text(chapter.title), blocks_as_html(chapter.blocks)
    if not chapter.anchor:
        return Markup("<{0}>{1}</{0}>\n{2}").format(level, title, content)
    return Markup(
        '<{tag}{style} id="{anchor}" aria-labelledby="{anchor}-h">\n'
        '<{level} id="{anchor}-h">{title}</{level}>\n{content}</{tag}>\n'
    ).format(
        tag="article" if chapter.is_article else "section",
        style=Markup(' class="{}"').format(chapter.style) if chapter.style else "",
        anchor=chapter.anchor,
        level=level,
        title=title,
        content=content,
    )


def _cell(tag: str, text: doc.Text, style: str = "", scope: str = "") -> Markup:
    """Write a table cell, or an entry in a list of facts, as an HTML element that has the style class of its text."""
    content = _text(text)
    if isinstance(text, doc.Styled):
        style = text.style
        is_digest = style == "digest" and isinstance(text.text, str)
        content = _text(text) if is_digest else _text(text.text)
    scoped = Markup(' scope="{}"').format(scope) if scope else ""
    styled = Markup(' class="{}"').format(style) if style else ""
    return Markup("<{0}{1}{2}>{3}</{0}>").format(tag, scoped, styled, content)


def _item(paragraphs: doc.Line) -> Markup:
    if len(paragraphs) == 1:
        return Markup("<li>{}</li>").format(_text(paragraphs[0]))
    return Markup("<li>{}</li>").format(Markup("").join(_cell("p", (text,)) for text in paragraphs))


def _table(table: doc.TextTable) -> Markup:
    heads = (_cell("th", doc.page_head(head), _head_style(head), "col") for head in table.heads)
    lines = [Markup("<caption>{}</caption>").format(_text(table.caption))]
    lines += [Markup("<thead><tr>{}</tr></thead>").format(Markup("").join(heads)), Markup("<tbody>")]
    styles = [head.style for head in table.heads]
    for first, *values in table.rows:
        cells = [_cell("th", first, styles[0], "row")]
        cells += [_cell("td", doc.page_cell(cell), style) for cell, style in zip(values, styles[1:], strict=True)]
        lines.append(Markup("<tr>{}</tr>").format(Markup("").join(cells)))
    element = _element("table", table.style, Markup("\n").join(["", *lines, Markup("</tbody>\n")]))
    return _scroll(table.label, element) if table.label else element


def _head_style(head: doc.Head) -> str:
    return "number" if head.style == "number" else ""


def _stack(stack: doc.Stack) -> Markup:
    share_words = ", ".join(f"{owner} {words}" for owner, _, words in stack.shares)
    bars = (
        Markup('<span class="{}" style="width:{:.3f}%">{}</span>').format(
            owner, 100 * fraction, owner if fraction > 0.16 else ""
        )
        for owner, fraction, _ in stack.shares
    )
    return Markup(
        '<div class="stack-row"><span class="stack-label">{0}</span>'
        '<div class="stack" role="img" aria-label="{0}: {1}">{2}</div></div>\n'
    ).format(stack.label, share_words, Markup("").join(bars))


def _inline(figure: doc.Figure) -> Markup:
    """Return the SVG of a drawing for use within the page.

    The ids in the drawing are prefixed with its anchor, because the same drawing may occur twice in a report.
    """
    return Markup(re.sub(r'\b(id|aria-labelledby|aria-describedby)="', rf'\1="{figure.anchor}-', figure.svg))


def _step(title: str, equations: Iterable[WorkedEquation | str | doc.Equality], style: str) -> Markup:
    step = '<div class="{}"><p class="step-title">{}</p>{}</div>\n'
    return Markup(step).format(style, printable(title), Markup("").join(map(_equation, equations)))


def _equation(equation: WorkedEquation | str | doc.Equality) -> Markup:
    """Write one item of a derivation step: a formula as MathML, and arithmetic or prose as text."""
    if isinstance(equation, doc.Equality):
        sides = (notation.catalogued(side, notation.MATHML) for side in (equation.left, equation.right))
        formula = notation.math("<mrow>{}<mo>=</mo>{}</mrow>".format(*sides))
        return Markup('<p class="part">{}</p>').format(Markup(formula))
    if not isinstance(equation, WorkedEquation):
        text = notation.readable(equation) if isinstance(equation, Sum) else printable(equation)
        return Markup("<p class=part>{}</p>").format(text)
    if notation.is_formula(equation):
        mathml = notation.as_mathml(equation)
        return Markup("<p class=part>{} {}</p>").format(Markup(mathml.formula), Markup(mathml.numbers))
    formula, numbers = notation.as_text(equation)
    return Markup("<p class=part><span>{}</span> <span>{}</span></p>").format(formula, numbers)
