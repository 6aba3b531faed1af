"""Equations of an explanation as MathML and as LaTeX: the formula from the derivation, and the same with numbers.

What the derivation has not in one piece is set from its text; words (a budget times a share) stay text.
"""

import re
from collections.abc import Mapping
from typing import NamedTuple

from bisar_budget.catalogue import FORMULAS, SYMBOLS
from bisar_budget.report.explain.formulas import WorkedEquation, filled, six_digits, with_unit
from bisar_budget.report.explain.notation import LATEX, MATHML, Language, is_mathematical, symbol, written
from bisar_budget.report.words.escapes import xml_text

_LATEX, _MATHML = 0, 1
_MINUS = re.compile("(?<!e)-")  # not the one of a power of ten


class Typeset(NamedTuple):
    """One equation in one language: `symbol = formula`, then `= numbers = result`."""

    formula: str
    numbers: str


def is_formula(equation: WorkedEquation) -> bool:
    """Whether it is to be set as a formula: one of the derivation, or one in letters."""
    return not equation.formula or equation.formula in FORMULAS or is_mathematical(equation.formula)


def as_text(equation: WorkedEquation) -> Typeset:
    """For a reader: · between factors, no carets."""
    if not equation.formula:
        return Typeset(readable(equation.lines[0]), "")
    numbers = f"= {filled(equation.formula, equation.values)} = {with_unit(equation.result, equation.unit)}"
    return Typeset(readable(f"{equation.symbol} = {equation.formula}"), readable(numbers))


def readable(text: str) -> str:
    """Write a sum as people do, not as programs."""
    return _MINUS.sub("−", text.replace("*", " · ").replace("^2", "²").replace("sqrt(", "√("))


def as_mathml(equation: WorkedEquation) -> Typeset:
    """Three `math` elements, so that a narrow page can break between them."""
    result = f"<mrow>{mathml_number(equation.result)}{_mathml_unit(equation.unit)}</mrow>"
    left = symbol(equation.symbol, MATHML)
    if not equation.formula:
        return Typeset(math(f"<mrow>{left}<mo>=</mo>{result}</mrow>"), "")
    if equation.formula in FORMULAS:
        formula = FORMULAS[equation.formula][_MATHML]
        values = {SYMBOLS[name][_MATHML]: value for name, value in equation.values.items() if name in SYMBOLS}
        numbers = _mathml_filled(formula, values)
    else:
        formula = written(equation.formula, MATHML)
        cells = {name: (mathml_number(value), value) for name, value in equation.values.items()}
        numbers = written(equation.formula, MATHML, _bracketed(cells, MATHML))
    return Typeset(
        math(f"<mrow>{left}<mo>=</mo>{formula}</mrow>"),
        f"{math(f'<mrow><mo>=</mo>{numbers}</mrow>')} {math(f'<mrow><mo>=</mo>{result}</mrow>')}",
    )


def math(content: str) -> str:
    """Wrap content in a `math` element that stands in a line and is as large as on one of its own."""
    return f'<math displaystyle="true">{content}</math>'


def mathml_of(formula: str) -> str:
    """MathML of a formula or symbol of the catalogue, without numbers and without the element around it."""
    return (FORMULAS.get(formula) or SYMBOLS[formula])[_MATHML]


def latex_of(formula: str) -> str:
    """LaTeX of a formula or symbol of the catalogue."""
    return (FORMULAS.get(formula) or SYMBOLS[formula])[_LATEX]


def _mathml_filled(formula: str, values: Mapping[str, float]) -> str:
    """Put numbers for elements. What is a power's base, or negative, stands in brackets."""

    def written(match: re.Match[str]) -> str:
        value = values[match[2]]
        bare = mathml_number(value)
        needs_brackets = value < 0 or (match[1] and "<msup>" in bare)
        return match[1] + (f"<mrow><mo>(</mo>{bare}<mo>)</mo></mrow>" if needs_brackets else bare)

    elements = "|".join(re.escape(element) for element in sorted(values, key=len, reverse=True))
    text = re.sub(f"(<msup>|)({elements})", written, formula) if values else formula
    return text.replace("<mo>\u2062</mo>", "<mo>·</mo>")


def mathml_number(value: float) -> str:
    """Six digits as one element; large and small ones as a power of ten."""
    is_negative, digits, exponent = _parts(value)
    number = f"<mn>{digits}</mn>"
    if exponent:
        power = f"<mn>{exponent}</mn>" if exponent > 0 else f"<mrow><mo>−</mo><mn>{-exponent}</mn></mrow>"
        number = f"<mrow>{number}<mo>·</mo><msup><mn>10</mn>{power}</msup></mrow>"
    return f"<mrow><mo>−</mo>{number}</mrow>" if is_negative else number


def _mathml_unit(unit: str) -> str:
    if not unit:
        return ""
    return f'<mspace width="0.25em"/><mtext>{xml_text(unit.replace("^2", "²"))}</mtext>'


def as_latex(equation: WorkedEquation) -> Typeset:
    """Without delimiters; both parts are aligned at their first `=`."""
    unit = rf"\,\mathrm{{{equation.unit.replace('^2', '^{2}')}}}" if equation.unit else ""
    result = f"{latex_number(equation.result)}{unit}"
    if equation.formula in FORMULAS:
        formula = FORMULAS[equation.formula][_LATEX]
        values = {SYMBOLS[name][_LATEX]: value for name, value in equation.values.items() if name in SYMBOLS}
        numbers = _latex_filled(formula, values)
    else:
        formula = written(equation.formula, LATEX)
        cells = {name: (latex_number(value), value) for name, value in equation.values.items()}
        numbers = written(equation.formula, LATEX, _bracketed(cells, LATEX))
    return Typeset(f"{symbol(equation.symbol, LATEX)} &= {formula}", f"&= {numbers} = {result}")


def _bracketed(cells: Mapping[str, tuple[str, float]], language: Language) -> dict[str, str]:
    """Numbers in their language, negative ones in brackets."""
    return {name: language.brackets % text if value < 0 else text for name, (text, value) in cells.items()}


def _latex_filled(formula: str, values: Mapping[str, float]) -> str:
    def written(match: re.Match[str]) -> str:
        value = values[match[0]]
        bare = latex_number(value)
        is_base = formula[match.end() : match.end() + 1] == "^"
        needs_brackets = value < 0 or (is_base and "cdot" in bare)
        return rf"\left({bare}\right)" if needs_brackets else bare

    if values:
        formula = _latex_symbols(values).sub(written, formula)
    return formula.replace(r"\,", r"\cdot")


def _latex_symbols(values: Mapping[str, float]) -> re.Pattern[str]:
    """Symbols, each whole: neither a letter of a command nor the start of one."""
    longest_first = "|".join(re.escape(symbol) for symbol in sorted(values, key=len, reverse=True))
    return re.compile(rf"(?<![A-Za-z\\])(?:{longest_first})(?![A-Za-z])")


def latex_number(value: float) -> str:
    """Six digits; large and small ones as a power of ten."""
    is_negative, digits, exponent = _parts(value)
    number = rf"{digits} \cdot 10^{{{exponent}}}" if exponent else digits
    return f"-{number}" if is_negative else number


def _parts(value: float) -> tuple[bool, str, int]:
    """Sign, digits and power of ten."""
    text = six_digits(value)
    digits, _, exponent = text.removeprefix("-").partition("e")
    return text.startswith("-"), digits, int(exponent or 0)
