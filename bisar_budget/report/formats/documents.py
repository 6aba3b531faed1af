"""The compliance report as an HTML page and as Markdown, whose drawings are files beside it."""

import re
from base64 import b64encode
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from html import unescape

from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template
from markupsafe import Markup, escape

from bisar_budget.faults import printable
from bisar_budget.findings.mission import MissionFindings, Report
from bisar_budget.findings.status import STATUS
from bisar_budget.report import Style
from bisar_budget.report.compliance.page import compliance, drawings, illustrations, studied
from bisar_budget.report.compliance.view import ShownImage
from bisar_budget.report.explain import notation
from bisar_budget.report.explain.notation import Sum, WorkedEquation
from bisar_budget.report.words.identity import document_words
from bisar_budget.report.words.sentences import dashed, markdown_text, sentence, uri
from bisar_budget.resources import resource

_AFTER = re.compile(r"([._/])(?=\w{2})")  # where a long name may break: an axis stays with what it is of
_BAR = 20  # characters
_DESCRIPTION = re.compile("<desc[^>]*>(.*?)</desc>", re.DOTALL)


@cache
def _template(name: str, finalize: Callable[[object], object]) -> Template:
    """Layout of a report, a file of `resource("templates")`; compiling it takes longer than a mission does."""
    environment = Environment(
        loader=FileSystemLoader(resource("templates")),
        autoescape=True,
        undefined=StrictUndefined,
        finalize=finalize,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.globals["words"] = {name: status.words for name, status in STATUS.items()}
    environment.filters |= {
        "breakable": _breakable,
        "sentence": sentence,
        "dashed": dashed,
        "css_string": _css_string,
        "document_words": document_words,
    }
    return environment.get_template(name)


def as_html(report: Report, style: Style) -> str:
    """Write one page: no script, nothing from elsewhere, light, dark and on paper."""
    return _template("report.html.j2", _harmless).render(
        report=compliance(report, style),
        statuses=STATUS.values(),
        equation=_html_equation,
        general=_html_general,
        inline=_inline,
        data_uri=_data_uri,
    )


def _harmless(value: object) -> object:
    """Nothing that turns the reading direction or controls anything; jinja2 escapes what is no markup."""
    return printable(value) if isinstance(value, str) and not isinstance(value, Markup) else value


def _breakable(text: str) -> Markup:
    """Let a long name break after its dots, underscores and slashes."""
    return Markup(_AFTER.sub(r"\1<wbr>", str(escape(printable(text)))))


def _css_string(text: str) -> Markup:
    """A string of a style sheet: every character but letters, digits and blanks of ASCII is its number."""
    safe = (c if c.isascii() and (c.isalnum() or c == " ") else f"\\{ord(c):x} " for c in printable(text))
    return Markup(f'"{"".join(safe)}"')


def _html_equation(part: WorkedEquation | str) -> Markup:
    """One part of a step: a formula as MathML, words and text as text."""
    if not isinstance(part, WorkedEquation):
        text = notation.readable(part) if isinstance(part, Sum) else printable(part)
        return Markup("<p class=part>{}</p>").format(text)
    if notation.is_formula(part):
        mathml = notation.as_mathml(part)
        return Markup("<p class=part>{} {}</p>").format(Markup(mathml.formula), Markup(mathml.numbers))
    formula, numbers = notation.as_text(part)
    return Markup("<p class=part><span>{}</span> <span>{}</span></p>").format(formula, numbers)


def _html_general(left: str, right: str) -> Markup:
    content = f"<mrow>{notation.mathml_of(left)}<mo>=</mo>{notation.mathml_of(right)}</mrow>"
    return Markup(notation.math(content))


def _data_uri(png: bytes) -> Markup:
    return Markup(f"data:image/png;base64,{b64encode(png).decode()}")


def _inline(svg: str, anchor: str) -> Markup:
    """A drawing within the page; the same mission may stand in a report twice."""
    return Markup(re.sub(r'\b(id|aria-labelledby|aria-describedby)="', rf'\1="{anchor}-', svg))


def as_markdown(report: Report, style: Style) -> str:
    """Write for GitHub what can be read as it is; drawings are linked where `style.assets` says that they lie."""
    text = _template("report.md.j2", _escaped).render(
        report=compliance(report, style),
        assets=Markup(uri(style.assets)),
        bar=_bar,
        equation=_markdown_equation,
        general=_markdown_general,
        description=_description,
        chip=_chip,
        command=_command,
    )
    return re.sub(r"\n{3,}", "\n\n", text).rstrip("\n") + "\n"


def _escaped(value: object) -> Markup:
    """Text of the user's own as Markdown shows it."""
    return value if isinstance(value, Markup) else Markup(markdown_text(str(value)))


def pictures(report: Report, style: Style) -> Mapping[str, bytes]:
    """Return the drawings of every mission, named by its place in the report."""
    return {
        f"{number}-{name}": content
        for number, mission in enumerate(report.missions, start=1)
        if isinstance(mission, MissionFindings)
        for name, content in _pictures(mission)
    }


def _pictures(mission: MissionFindings) -> Iterator[tuple[str, bytes]]:
    shown = illustrations(mission)
    if (study := studied(mission, mission.file)) is not None:
        yield study.picture.name, study.picture.svg.encode()
    yield from (
        (picture.name, picture.svg.encode()) for picture in (*drawings(mission), *(one.cuts for one in shown))
    )
    yield from ((chip.name, chip.png) for one in shown for chip in one.chips)


def _bar(part: float | None) -> Markup:
    """A bar of text; what goes beyond its end has an arrow."""
    if part is None:
        return Markup("")
    filled = "█" * round(_BAR * min(1.0, part))
    return Markup(filled.ljust(_BAR, "░") + ("▶" if part > 1 + 1e-9 else ""))


def _markdown_equation(part: WorkedEquation | str) -> Markup:
    """One part of a step: a formula as a block of LaTeX, words and text as a line."""
    if not isinstance(part, WorkedEquation):
        return _sum(notation.readable(part)) if isinstance(part, Sum) else Markup(f"- {markdown_text(part)}\n")
    if part.formula and notation.is_formula(part):
        formula, numbers = notation.as_latex(part)
        block = f"\\begin{{aligned}}\n{formula} \\\\\n{numbers}\n\\end{{aligned}}"
        return Markup(f"\n{_math(block)}\n\n")
    formula, numbers = notation.as_text(part)
    return _sum(f"{formula} {numbers}".rstrip())


def _sum(text: str) -> Markup:
    """Arithmetic as code, in which nothing needs escaping; there is nothing of the user's in it."""
    return Markup(f"- `{text}`\n")


def _chip(chip: ShownImage, path: str) -> Markup:
    """An image at its size, which Markdown cannot say."""
    width, height = chip.size
    return Markup('<img src="{}" alt="{}" width="{}" height="{}">').format(
        Markup(path), printable(chip.title), width, height
    )


def _command(text: str) -> Markup:
    """A command as code that is indented: no fence of its own can end it."""
    return Markup("    {}").format(Markup(printable(text)))


def _markdown_general(left: str, right: str) -> Markup:
    return Markup(_math(f"{notation.latex_of(left)} = {notation.latex_of(right)}"))


def _math(latex: str) -> str:
    """A block of LaTeX, as GitHub takes it."""
    return f"```math\n{latex}\n```"


def _description(svg: str) -> str:
    """The description that a drawing carries, for readers who cannot see it."""
    match = _DESCRIPTION.search(svg)
    return unescape(match[1]) if match else ""
