"""Formulas that an explanation writes itself, set from their text as MathML and as LaTeX.

The derivation has most formulas in one piece, and `catalogue` has those typeset. What an explanation adds in
between (a projection on an axis, a sum over both platforms) is plain text in the same notation: + - * / ^,
brackets, | |, sqrt and log, and symbols such as β̃_2.
"""

import re
from collections.abc import Mapping
from functools import lru_cache
from typing import NamedTuple
from unicodedata import combining, normalize

from bisar_budget.catalogue import SYMBOLS

_TOKEN = re.compile(r"\s*(\d+(?:\.\d+)?|det Q|[^\W\d_][\w\u0300-\u036f\u20d0-\u20ff]*|[-+*/^()|])")
_LETTER = re.compile(r"(?:adj|[^\W\d_][\u0300-\u036f\u20d0-\u20ff]*)(?:_\w+)?")
_FUNCTIONS = ("sqrt", "log")
_ABOVE = {
    "\u0303": ("tilde", "~"),
    "\u0304": ("bar", "¯"),
    "\u0302": ("hat", "^"),
    "\u0307": ("dot", "˙"),
    "\u0308": ("ddot", "¨"),
    "\u20db": ("dddot", "..."),
    "\u20dc": ("ddddot", "...."),
}
_GREEK = {"β": r"\beta", "λ": r"\lambda", "π": r"\pi", "φ": r"\phi", "θ": r"\theta", "σ": r"\sigma", "τ": r"\tau"}


class Node(NamedTuple):
    """Part of a formula: an operation on other parts, or a name or number."""

    kind: str
    parts: tuple["Node", ...] = ()
    text: str = ""


class Language(NamedTuple):
    """How to write each operation; `%s` stands for its parts."""

    number: str
    fraction: str
    power: str
    sqrt: str
    log: str
    brackets: str
    bars: str
    row: str
    operator: str
    times: str
    dot: str
    minus: str


MATHML = Language(
    number="<mn>%s</mn>",
    fraction="<mfrac><mrow>%s</mrow><mrow>%s</mrow></mfrac>",
    power="<msup><mrow>%s</mrow><mrow>%s</mrow></msup>",
    sqrt="<msqrt>%s</msqrt>",
    log="<mrow><mi>ln</mi><mo>⁡</mo><mrow><mo>(</mo>%s<mo>)</mo></mrow></mrow>",
    brackets="<mrow><mo>(</mo>%s<mo>)</mo></mrow>",
    bars="<mrow><mo>|</mo>%s<mo>|</mo></mrow>",
    row="<mrow>%s</mrow>",
    operator="<mo>%s</mo>",
    times="<mo>\u2062</mo>",
    dot="<mo>·</mo>",
    minus="−",
)
LATEX = Language(
    number="%s",
    fraction=r"\frac{%s}{%s}",
    power="%s^{%s}",
    sqrt=r"\sqrt{%s}",
    log=r"\ln\left(%s\right)",
    brackets=r"\left(%s\right)",
    bars=r"\left\lvert %s\right\rvert ",
    row="%s",
    operator=" %s ",
    times=r" \, ",
    dot=r" \cdot ",
    minus="-",
)


@lru_cache(maxsize=256)
def is_mathematical(formula: str) -> bool:
    """Whether all its symbols are letters: a budget times a share reads better in words."""
    try:
        parsed(formula)
    except ValueError:
        return False
    names = [token for token in _TOKEN.findall(formula) if token[0].isalpha() and token not in _FUNCTIONS]
    return all(name in SYMBOLS or _LETTER.fullmatch(name) for name in names)


@lru_cache(maxsize=256)
def parsed(formula: str) -> Node:
    """Read a formula.

    Raises
    ------
    ValueError
        It is no formula in this notation.
    """
    tokens = [match[1] for match in _TOKEN.finditer(formula)]
    if "".join(tokens).replace(" ", "") != formula.replace(" ", ""):
        raise ValueError(f"not a formula: {formula}")
    node, rest = _sum(tuple(tokens))
    if rest:
        raise ValueError(f"not a formula: {formula}")
    return node


def written(formula: str, language: Language, numbers: Mapping[str, str] | None = None) -> str:
    """Write a formula, `numbers` for the names that it has.

    Raises
    ------
    ValueError
        It is no formula in this notation.
    """

    def write(part: Node) -> str:
        cells = tuple(write(inner) for inner in part.parts)
        if part.kind == "leaf":
            if part.text[0].isdigit():
                return language.number % part.text
            return numbers[part.text] if numbers and part.text in numbers else symbol(part.text, language)
        if part.kind == "+":
            return language.row % "".join(cells)
        if part.kind == "*":
            return language.row % (language.times if numbers is None else language.dot).join(cells)
        if part.kind in ("plus", "minus"):
            sign = language.operator % ("+" if part.kind == "plus" else language.minus)
            return (sign.lstrip() if part.text else sign) + cells[0]
        if part.kind == "power" and ("<msup>" in cells[0] or "cdot" in cells[0]):
            return language.power % (language.brackets % cells[0], cells[1])  # of a power of ten
        if part.kind == "/":
            return language.fraction % tuple(write(_bare(inner)) for inner in part.parts)
        return str(getattr(language, part.kind) % cells)

    return write(parsed(formula))


def symbol(name: str, language: Language) -> str:
    """Set a symbol: its letter with what stands above it, and its subscript."""
    if name in SYMBOLS:
        return SYMBOLS[name][language is MATHML]
    head, _, below = name.partition("_")
    spelled = normalize("NFD", head)
    letter, *accents = tuple(spelled) if len(normalize("NFC", head)) == 1 or combining(spelled[1]) else (head,)
    if language is LATEX:
        text = _GREEK.get(letter, letter) if len(letter) == 1 else rf"\mathrm{{{letter}}}"
        for accent in accents:
            text = rf"\{_ABOVE[accent][0]}{{{text}}}"
        word = below if len(below) < 3 else rf"\mathrm{{{below}}}"
        return f"{text}_{{{word}}}" if below else text
    text = f"<mi>{letter}</mi>"
    for accent in accents:
        text = f'<mover accent="true">{text}<mo>{_ABOVE[accent][1]}</mo></mover>'
    tag = "mn" if below.isdigit() else "mi"
    return f"<msub>{text}<{tag}>{below}</{tag}></msub>" if below else text


def _bare(node: Node) -> Node:
    """The node without its brackets, which nothing over or under a line needs."""
    return node.parts[0] if node.kind == "brackets" else node


_Read = tuple[Node, tuple[str, ...]]


def _sum(tokens: tuple[str, ...]) -> _Read:
    terms: list[Node] = []
    if tokens[:1] == ("-",):
        first, tokens = _product(tokens[1:])
        terms.append(Node("minus", (first,), "first"))
    else:
        first, tokens = _product(tokens)
        terms.append(first)
    while tokens[:1] in (("+",), ("-",)):
        kind = "plus" if tokens[0] == "+" else "minus"
        term, tokens = _product(tokens[1:])
        terms.append(Node(kind, (term,)))
    is_one = len(terms) == 1 and terms[0].kind != "minus"
    return (terms[0] if is_one else Node("+", tuple(terms))), tokens


def _product(tokens: tuple[str, ...]) -> _Read:
    node, tokens = _power(tokens)
    while tokens[:1] in (("*",), ("/",)):
        operator = tokens[0]
        factor, tokens = _power(tokens[1:])
        both = (*node.parts, factor) if operator == "*" == node.kind else (node, factor)
        node = Node(operator, both)
    return node, tokens


def _power(tokens: tuple[str, ...]) -> _Read:
    base, tokens = _atom(tokens)
    if tokens[:1] == ("^",):
        exponent, tokens = _atom(tokens[1:])
        return Node("power", (base, _bare(exponent))), tokens
    return base, tokens


def _atom(tokens: tuple[str, ...]) -> _Read:
    if not tokens:
        raise ValueError("a formula ends too early")
    token, rest = tokens[0], tokens[1:]
    if token in _FUNCTIONS and rest[:1] == ("(",):
        inner, rest = _closed(rest[1:], ")")
        return Node(token, (inner,)), rest
    if token == "(":
        inner, rest = _closed(rest, ")")
        return Node("brackets", (inner,)), rest
    if token == "|":
        inner, rest = _closed(rest, "|")
        return Node("bars", (inner,)), rest
    if token in "+-*/^)":
        raise ValueError(f"{token} out of place")
    return Node("leaf", text=token), rest


def _closed(tokens: tuple[str, ...], end: str) -> _Read:
    inner, tokens = _sum(tokens)
    if tokens[:1] != (end,):
        raise ValueError(f"{end} is missing")
    return inner, tokens[1:]
