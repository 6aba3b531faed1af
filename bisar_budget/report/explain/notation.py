"""Write the steps and formulas of an explanation, with numbers, as text, MathML or LaTeX.

The formulas of the derivation come from `catalogue`, where they are already typeset. Other formulas, such as a
projection on an axis or a sum over both platforms, occur only in explanations. These formulas are plain text with the
operators + - * / ^, brackets, | |, sqrt and log, and with symbols such as β̃_2.
"""

import re
from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import NamedTuple
from unicodedata import combining, normalize

from bisar_budget.catalogue import FORMULAS, SYMBOLS, TEXTS
from bisar_budget.error_kinds.path_kinds import StateKind
from bisar_budget.report.words.sentences import xml_text

_FORMULA_TOKEN = re.compile(r"\s*(\d+(?:\.\d+)?|det Q|[^\W\d_][\w\u0300-\u036f\u20d0-\u20ff]*|[-+*/^()|])")
_LETTER = re.compile(r"(?:adj|[^\W\d_][\u0300-\u036f\u20d0-\u20ff]*)(?:_\w+)?")
_FUNCTIONS = ("sqrt", "log")
_ACCENT_COMMANDS = {
    "\u0303": ("tilde", "~"),
    "\u0304": ("bar", "¯"),
    "\u0302": ("hat", "^"),
    "\u0307": ("dot", "˙"),
    "\u0308": ("ddot", "¨"),
    "\u20db": ("dddot", "..."),
    "\u20dc": ("ddddot", "...."),
}
_GREEK_COMMANDS = {
    "β": r"\beta",
    "λ": r"\lambda",
    "π": r"\pi",
    "φ": r"\phi",
    "θ": r"\theta",
    "σ": r"\sigma",
    "τ": r"\tau",
}


class Node(NamedTuple):
    """Node of a formula: an operation on its children, or a leaf with a name or a number."""

    kind: str
    children: tuple["Node", ...] = ()
    text: str = ""


class Language(NamedTuple):
    """Templates for writing formulas in an output language. A template has a `%s` for each child of an operation.

    `catalogue_index` is the index of the language in each entry of the catalogue.
    """

    catalogue_index: int
    number: str
    negative: str
    power_of_ten: str
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
    catalogue_index=1,
    number="<mn>%s</mn>",
    negative="<mrow><mo>−</mo>%s</mrow>",
    power_of_ten="<mrow>%s<mo>·</mo><msup><mn>10</mn>%s</msup></mrow>",
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
    catalogue_index=0,
    number="%s",
    negative="-%s",
    power_of_ten=r"%s \cdot 10^{%s}",
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
    """Whether all symbols of a formula are letters, so that the formula can be typeset.

    Formulas in words, such as budget times share, are not typeset.
    """
    try:
        parsed(formula)
    except ValueError:
        return False
    names = [token for token in _FORMULA_TOKEN.findall(formula) if token[0].isalpha() and token not in _FUNCTIONS]
    return all(name in SYMBOLS or _LETTER.fullmatch(name) for name in names)


@lru_cache(maxsize=256)
def parsed(formula: str) -> Node:
    """Parse the text of a formula into a tree of nodes.

    Raises
    ------
    ValueError
        The text is not a formula in this notation.
    """
    tokens = [match[1] for match in _FORMULA_TOKEN.finditer(formula)]
    if "".join(tokens).replace(" ", "") != formula.replace(" ", ""):
        raise ValueError(f"not a formula: {formula}")
    node, remaining = _sum(tuple(tokens))
    if remaining:
        raise ValueError(f"not a formula: {formula}")
    return node


def formula_text(formula: str, language: Language, numbers: Mapping[str, str] | None = None) -> str:
    """Write a formula in an output language, with its symbols replaced by the strings in `numbers`.

    Raises
    ------
    ValueError
        The text is not a formula in this notation.
    """

    def write(node: Node) -> str:
        cells = tuple(write(child) for child in node.children)
        if node.kind == "leaf":
            if node.text[0].isdigit():
                return language.number % node.text
            return numbers[node.text] if numbers and node.text in numbers else symbol(node.text, language)
        if node.kind == "+":
            return language.row % "".join(cells)
        if node.kind == "*":
            return language.row % (language.times if numbers is None else language.dot).join(cells)
        if node.kind in ("plus", "minus"):
            sign = language.operator % ("+" if node.kind == "plus" else language.minus)
            return (sign.lstrip() if node.text else sign) + cells[0]
        if node.kind == "power" and ("<msup>" in cells[0] or "cdot" in cells[0]):
            return language.power % (language.brackets % cells[0], cells[1])  # a power of ten in the base
        if node.kind == "/":
            return language.fraction % tuple(write(_bare(child)) for child in node.children)
        return str(getattr(language, node.kind) % cells)

    return write(parsed(formula))


def symbol(name: str, language: Language) -> str:
    """Typeset a symbol: a letter that may have accents and a subscript."""
    if name in SYMBOLS:
        return SYMBOLS[name][language.catalogue_index]
    head, _, below = name.partition("_")
    spelled = normalize("NFD", head)
    letter, *accents = tuple(spelled) if len(normalize("NFC", head)) == 1 or combining(spelled[1]) else (head,)
    if language is LATEX:
        text = _GREEK_COMMANDS.get(letter, letter) if len(letter) == 1 else rf"\mathrm{{{letter}}}"
        for accent in accents:
            text = rf"\{_ACCENT_COMMANDS[accent][0]}{{{text}}}"
        word = below if len(below) < 3 else rf"\mathrm{{{below}}}"
        return f"{text}_{{{word}}}" if below else text
    text = f"<mi>{letter}</mi>"
    for accent in accents:
        text = f'<mover accent="true">{text}<mo>{_ACCENT_COMMANDS[accent][1]}</mo></mover>'
    tag = "mn" if below.isdigit() else "mi"
    return f"<msub>{text}<{tag}>{below}</{tag}></msub>" if below else text


def _bare(node: Node) -> Node:
    """Remove the outer brackets of a node, which are not needed in the numerator or denominator of a fraction."""
    return node.children[0] if node.kind == "brackets" else node


_ParsedPart = tuple[Node, tuple[str, ...]]


def _sum(tokens: tuple[str, ...]) -> _ParsedPart:
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
    is_single = len(terms) == 1 and terms[0].kind != "minus"
    return (terms[0] if is_single else Node("+", tuple(terms))), tokens


def _product(tokens: tuple[str, ...]) -> _ParsedPart:
    node, tokens = _power(tokens)
    while tokens[:1] in (("*",), ("/",)):
        operator = tokens[0]
        factor, tokens = _power(tokens[1:])
        factors = (*node.children, factor) if operator == "*" == node.kind else (node, factor)
        node = Node(operator, factors)
    return node, tokens


def _power(tokens: tuple[str, ...]) -> _ParsedPart:
    base, tokens = _atom(tokens)
    if tokens[:1] == ("^",):
        exponent, tokens = _atom(tokens[1:])
        return Node("power", (base, _bare(exponent))), tokens
    return base, tokens


def _atom(tokens: tuple[str, ...]) -> _ParsedPart:
    if not tokens:
        raise ValueError("a formula ends too early")
    token, remaining = tokens[0], tokens[1:]
    if token in _FUNCTIONS and remaining[:1] == ("(",):
        inner, remaining = _closed(remaining[1:], ")")
        return Node(token, (inner,)), remaining
    if token == "(":
        inner, remaining = _closed(remaining, ")")
        return Node("brackets", (inner,)), remaining
    if token == "|":
        inner, remaining = _closed(remaining, "|")
        return Node("bars", (inner,)), remaining
    if token in "+-*/^)":
        raise ValueError(f"{token} out of place")
    return Node("leaf", text=token), remaining


def _closed(tokens: tuple[str, ...], end: str) -> _ParsedPart:
    inner, tokens = _sum(tokens)
    if tokens[:1] != (end,):
        raise ValueError(f"{end} is missing")
    return inner, tokens[1:]


AXIS_LETTERS = "xyz"
EDGE_PHASE = TEXTS["edge phase"]
CLOCK_PHASE = TEXTS["Table II t̃_2 0"]
VIBRATION = {"pslr": TEXTS["Vibration A 1"], "islr": TEXTS["Vibration σ 1"]}
# From first principles. For a sinusoid φ is the phase whose echoes reach the limit of both platforms.
FULL_VIBRATION = {"pslr": TEXTS["echoes"], "islr": TEXTS["noise"]}
AUTOFOCUS_GAIN = TEXTS["autofocus gain"]
SMEAR = (TEXTS["smear east"], TEXTS["smear north"])
LOOK_AZIMUTH = TEXTS["look azimuth"]
DETERMINANT = TEXTS["determinant"]


def motion_symbol(state: StateKind, axis: str, platform: str) -> str:
    """Symbol of an error of position, velocity or acceleration, such as `ã_xt`."""
    return f"{state.symbol}_{axis}{platform[0]}"


def motion_coefficients(state: StateKind, axis: str, platform: str) -> dict[int, str]:
    """Formulas in Table I of Rigling & Moses for the coefficients of a motion error.

    The keys of the result are the powers of slow time.
    """
    names = {order: f"Table I {motion_symbol(state, axis, platform)} {order}" for order in range(4)}
    return {order: TEXTS[name] for order, name in names.items() if name in TEXTS}


def motion_phase(state: StateKind, axis: str, platform: str) -> str | None:
    """Formula in Table II of Rigling & Moses for the quadratic phase of a motion error; None for position errors."""
    return TEXTS.get(f"Table II {motion_symbol(state, axis, platform)} 0")


def clock_coefficient(order: int) -> str:
    """Formula in the first row of Table I of Rigling & Moses for a coefficient of a clock error.

    `order` is the power of slow time.
    """
    return TEXTS[f"Table I t̃ {order}"]


def inertial_phases(symbol: str) -> tuple[str, ...]:
    """Formulas for the quadratic phase, the cubic phase and the residual due to an inertial sensor error.

    `symbol` is the symbol of the error. A formula is empty if the error has no such phase.
    """
    return tuple(TEXTS.get(f"Inertial sensors {symbol} {order}", "") for order in range(3))


def amplitude_share(platform: str) -> str:
    """Formula for the amplitude that one platform contributes to a paired echo caused by both platforms."""
    return TEXTS[f"amplitude share {platform[0]}"]


class WorkedEquation(NamedTuple):
    """A formula as text, with the values of its symbols and its result.

    The formula is empty if the result is given directly, as a number.
    """

    symbol: str
    formula: str
    values: Mapping[str, float]
    result: float
    unit: str

    @property
    def lines(self) -> tuple[str, ...]:
        """Two lines with aligned equals signs: the formula with symbols, and the formula with numbers and result.

        A result without a formula is written on a single line.
        """
        if not self.formula:
            return (f"{self.symbol} = {with_unit(self.result, self.unit)}",)
        margin = " " * sum(not combining(letter) for letter in self.symbol)
        numbers = filled(self.formula, self.values)
        return f"{self.symbol} = {self.formula}", f"{margin} = {numbers} = {with_unit(self.result, self.unit)}"


class Sum(str):
    """An equation with numbers only, as text. It contains no text from the user's file."""

    __slots__ = ()


class Step(NamedTuple):
    """One step of an explanation: a title, and the equations or texts below it."""

    title: str
    body: tuple[WorkedEquation | str, ...] = ()

    @property
    def lines(self) -> Iterator[str]:
        """Yield the title and the indented lines below it."""
        yield self.title
        for item in self.body:
            yield from (f"    {line}" for line in (item.lines if isinstance(item, WorkedEquation) else (item,)))


def step(title: str, *body: WorkedEquation | str) -> Step:
    """Make a step of an explanation from its title and the equations or texts below it."""
    return Step(title, body)


def filled(formula: str, values: Mapping[str, float]) -> str:
    """Replace the symbols of a formula by their values with six digits, with brackets around negative values."""
    names = sorted(values, key=len, reverse=True)
    # A symbol ends where no letter, digit or accent follows: v_x is not the start of v_xt.
    pattern = re.compile(r"(?<![\w\u0300-\u036f])(?:" + "|".join(map(re.escape, names)) + r")(?![\w\u0300-\u036f])")
    return pattern.sub(lambda match: number(values[match[0]]), formula)


def number(value: float) -> str:
    """Write a number with six digits, in brackets if it is negative."""
    text = six_digits(value)
    return f"({text})" if text.startswith("-") else text


def six_digits(value: float) -> str:
    """Write a number with six digits; zero is written without a sign."""
    return f"{value + 0.0:.6g}"


def with_unit(value: float, unit: str) -> str:
    """Write a number with six digits and its unit. A ratio (unit `1`) is written without a unit."""
    return f"{six_digits(value)} {'' if unit == '1' else unit.replace('^2', '²')}".rstrip()


_MINUS = re.compile("(?<!e)-")  # except the sign of an exponent of ten


class Typeset(NamedTuple):
    """An equation in one output language, in two parts: `symbol = formula` and `= numbers = result`."""

    formula: str
    numbers: str


def is_formula(equation: WorkedEquation) -> bool:
    """Whether an equation is typeset as a formula.

    It is typeset if it belongs to the derivation, or if all its symbols are letters.
    """
    return not equation.formula or equation.formula in FORMULAS or is_mathematical(equation.formula)


def as_text(equation: WorkedEquation) -> Typeset:
    """Write an equation as text, with · between factors and without carets."""
    formula, *numbers = equation.lines
    return Typeset(readable(formula), readable("".join(numbers).lstrip()))


def readable(text: str) -> str:
    """Replace the operators of a programming language by mathematical signs, such as `*` by `·`."""
    return _MINUS.sub("−", text.replace("*", " · ").replace("^2", "²").replace("sqrt(", "√("))


def as_mathml(equation: WorkedEquation) -> Typeset:
    """Write an equation as MathML.

    It has up to three `math` elements, so that lines on a narrow page can break between them.
    """
    unit = ""
    if equation.unit:
        unit = f'<mspace width="0.25em"/><mtext>{xml_text(equation.unit.replace("^2", "²"))}</mtext>'
    result = f"<mrow>{_number_in(MATHML, equation.result)}{unit}</mrow>"
    symbol_mathml = symbol(equation.symbol, MATHML)
    if not equation.formula:
        return Typeset(math(f"<mrow>{symbol_mathml}<mo>=</mo>{result}</mrow>"), "")
    formula, numbers = _in_letters_and_numbers(equation, MATHML)
    return Typeset(
        math(f"<mrow>{symbol_mathml}<mo>=</mo>{formula}</mrow>"),
        f"{math(f'<mrow><mo>=</mo>{numbers}</mrow>')} {math(f'<mrow><mo>=</mo>{result}</mrow>')}",
    )


def as_latex(equation: WorkedEquation) -> Typeset:
    """Write an equation as LaTeX without math delimiters, as two lines that are aligned at their first `=`."""
    unit = rf"\,\mathrm{{{equation.unit.replace('^2', '^{2}')}}}" if equation.unit else ""
    result = f"{_number_in(LATEX, equation.result)}{unit}"
    formula, numbers = _in_letters_and_numbers(equation, LATEX)
    return Typeset(f"{symbol(equation.symbol, LATEX)} &= {formula}", f"&= {numbers} = {result}")


def _in_letters_and_numbers(equation: WorkedEquation, language: Language) -> tuple[str, str]:
    """Typeset the formula of an equation twice: with symbols, then with numbers. Negative numbers get brackets."""
    if equation.formula in FORMULAS:
        formula = FORMULAS[equation.formula][language.catalogue_index]
        index = language.catalogue_index
        values_by_symbol = {SYMBOLS[name][index]: value for name, value in equation.values.items() if name in SYMBOLS}
        return formula, (_mathml_filled if language is MATHML else _latex_filled)(formula, values_by_symbol)
    numbers = {name: _number_in(language, value) for name, value in equation.values.items()}
    numbers |= {name: language.brackets % numbers[name] for name, value in equation.values.items() if value < 0}
    return formula_text(equation.formula, language), formula_text(equation.formula, language, numbers)


def math(content: str) -> str:
    """Wrap MathML in an inline `math` element that has the size of a displayed formula."""
    return f'<math displaystyle="true">{content}</math>'


def catalogued(formula: str, language: Language) -> str:
    """Typeset a formula or symbol of the catalogue, with symbols only and without an enclosing `math` element."""
    return (FORMULAS.get(formula) or SYMBOLS[formula])[language.catalogue_index]


def _mathml_filled(formula: str, values: Mapping[str, float]) -> str:
    """Replace the symbols in a MathML formula by their values.

    Brackets are put around negative values, and around values with a power of ten that the formula raises to a power.
    """

    def filled_match(match: re.Match[str]) -> str:
        value = values[match[2]]
        bare = _number_in(MATHML, value)
        needs_brackets = value < 0 or (match[1] and "<msup>" in bare)
        return match[1] + (f"<mrow><mo>(</mo>{bare}<mo>)</mo></mrow>" if needs_brackets else bare)

    elements = "|".join(re.escape(element) for element in sorted(values, key=len, reverse=True))
    text = re.sub(f"(<msup>|)({elements})", filled_match, formula) if values else formula
    return text.replace("<mo>\u2062</mo>", "<mo>·</mo>")


def _latex_filled(formula: str, values: Mapping[str, float]) -> str:
    def filled_match(match: re.Match[str]) -> str:
        value = values[match[0]]
        bare = _number_in(LATEX, value)
        is_base = formula[match.end() : match.end() + 1] == "^"
        needs_brackets = value < 0 or (is_base and "cdot" in bare)
        return rf"\left({bare}\right)" if needs_brackets else bare

    if values:
        formula = _latex_symbols(values).sub(filled_match, formula)
    return formula.replace(r"\,", r"\cdot")


def _latex_symbols(values: Mapping[str, float]) -> re.Pattern[str]:
    """Pattern that matches symbols in LaTeX text, but not inside longer names or commands."""
    longest_first = "|".join(re.escape(symbol) for symbol in sorted(values, key=len, reverse=True))
    return re.compile(rf"(?<![A-Za-z\\])(?:{longest_first})(?![A-Za-z])")


def _number_in(language: Language, value: float) -> str:
    """Write a number with six digits in an output language.

    A very large or small number is written with a power of ten.
    """
    digits, _, exponent = six_digits(abs(value)).partition("e")
    number = language.number % digits
    if exponent:
        number = language.power_of_ten % (number, _number_in(language, int(exponent)))
    return language.negative % number if value < 0 else number
