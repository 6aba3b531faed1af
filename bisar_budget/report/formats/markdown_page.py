"""The compliance report as Markdown for GitHub, which can be read as it is; its drawings are files beside it."""

import re
from collections.abc import Iterator, Mapping
from functools import cache
from html import unescape

from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template
from markupsafe import Markup

from bisar_budget.faults import printable
from bisar_budget.findings.mission import MissionFindings, Report
from bisar_budget.findings.status import STATUS
from bisar_budget.report import Style
from bisar_budget.report.compliance.page import compliance, drawings, illustrations, studied
from bisar_budget.report.compliance.view import Compliance, ShownImage
from bisar_budget.report.explain import notation
from bisar_budget.report.explain.notation import Sum, WorkedEquation
from bisar_budget.report.words.identity import document_words
from bisar_budget.report.words.sentences import dashed, markdown_text, sentence, uri
from bisar_budget.resources import resource

_BAR = 20  # characters
_DESCRIPTION = re.compile("<desc[^>]*>(.*?)</desc>", re.DOTALL)


def render(report: Report, style: Style) -> str:
    """Write the report; drawings are linked where `style.assets` says that they lie."""
    page: Compliance = compliance(report, style)
    text = _template().render(
        report=page,
        words={name: status.words for name, status in STATUS.items()},
        assets=Markup(uri(style.assets)),
        bar=_bar,
        equation=_equation,
        general=_general,
        description=_description,
        chip=_chip,
        command=_command,
    )
    return re.sub(r"\n{3,}", "\n\n", text).rstrip("\n") + "\n"


@cache
def _template() -> Template:
    """Layout of the page; compiling it takes longer than a mission does."""
    environment = Environment(
        loader=FileSystemLoader(resource("templates")),
        autoescape=True,
        undefined=StrictUndefined,
        finalize=lambda value: value if isinstance(value, Markup) else Markup(markdown_text(str(value))),
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {"document_words": document_words, "sentence": sentence, "dashed": dashed}
    return environment.get_template("report.md.j2")


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


def _equation(part: WorkedEquation | str) -> Markup:
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


def _general(left: str, right: str) -> Markup:
    return Markup(_math(f"{notation.latex_of(left)} = {notation.latex_of(right)}"))


def _math(latex: str) -> str:
    """A block of LaTeX, as GitHub takes it."""
    return f"```math\n{latex}\n```"


def _description(svg: str) -> str:
    """The description that a drawing carries, for readers who cannot see it."""
    match = _DESCRIPTION.search(svg)
    return unescape(match[1]) if match else ""
