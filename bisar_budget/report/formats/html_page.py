"""The compliance report as one HTML page: no script, nothing from elsewhere, light, dark and on paper."""

import re
from base64 import b64encode
from functools import cache

from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template
from markupsafe import Markup, escape

from bisar_budget.faults import printable
from bisar_budget.findings.mission import Report
from bisar_budget.findings.status import STATUS
from bisar_budget.report import Style
from bisar_budget.report.compliance.page import compliance
from bisar_budget.report.explain import notation
from bisar_budget.report.explain.notation import Sum, WorkedEquation
from bisar_budget.report.words.identity import document_words
from bisar_budget.report.words.sentences import dashed, sentence
from bisar_budget.resources import resource

_AFTER = re.compile(r"([._/])(?=\w{2})")  # where a long name may break: an axis stays with what it is of


def render(report: Report, style: Style) -> str:
    """Write the page; `resource("templates")` has its layout."""
    return _template().render(
        report=compliance(report, style),
        words={name: status.words for name, status in STATUS.items()},
        statuses=STATUS.values(),
        equation=_equation,
        general=_general,
        inline=_inline,
        data_uri=_data_uri,
    )


@cache
def _template() -> Template:
    """Layout of the page; compiling it takes longer than a mission does."""
    environment = Environment(
        loader=FileSystemLoader(resource("templates")),
        autoescape=True,
        undefined=StrictUndefined,
        finalize=_harmless,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {
        "breakable": _breakable,
        "sentence": sentence,
        "dashed": dashed,
        "css_string": _css_string,
        "document_words": document_words,
    }
    return environment.get_template("report.html.j2")


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


def _equation(part: WorkedEquation | str) -> Markup:
    """One part of a step: a formula as MathML, words and text as text."""
    if not isinstance(part, WorkedEquation):
        text = notation.readable(part) if isinstance(part, Sum) else printable(part)
        return Markup("<p class=part>{}</p>").format(text)
    if notation.is_formula(part):
        mathml = notation.as_mathml(part)
        return Markup("<p class=part>{} {}</p>").format(Markup(mathml.formula), Markup(mathml.numbers))
    formula, numbers = notation.as_text(part)
    return Markup("<p class=part><span>{}</span> <span>{}</span></p>").format(formula, numbers)


def _general(left: str, right: str) -> Markup:
    content = f"<mrow>{notation.mathml_of(left)}<mo>=</mo>{notation.mathml_of(right)}</mrow>"
    return Markup(notation.math(content))


def _data_uri(png: bytes) -> Markup:
    return Markup(f"data:image/png;base64,{b64encode(png).decode()}")


def _inline(svg: str, anchor: str) -> Markup:
    """A drawing within the page; the same mission may stand in a report twice."""
    return Markup(re.sub(r'\b(id|aria-labelledby|aria-describedby)="', rf'\1="{anchor}-', svg))
