"""Write the derived equations and tables as text, LaTeX, Markdown or MathML, with the paper's equation numbers."""

import re
import textwrap
import unicodedata
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

from sympy import Basic, MatrixBase, Symbol, atan2
from sympy.printing.latex import LatexPrinter
from sympy.printing.mathml import MathMLPresentationPrinter
from sympy.printing.str import StrPrinter

from bisar_budget.theory import full, published, random_errors
from bisar_budget.theory.published import Equation, FormulaTable

_SYMBOL_PATTERN = re.compile(
    r"(?P<letter>[A-Za-z]+?)(?P<index>_\d)?(?P<accent>tilde|bar|hat|prime|dot|ddot|dddot|ddddot)?(?:_(?P<subscript>\w+))?"
)
_GREEK_LETTERS = {
    "lambda": "λ",
    "tau": "τ",
    "phi": "φ",
    "Phi": "Φ",
    "theta": "θ",
    "beta": "β",
    "sigma": "σ",
    "kappa": "κ",
    "psi": "ψ",
    "epsilon": "ε",
    "Gamma": "Γ",
}
_ACCENT_CHARACTERS = {
    "prime": "′",
    "tilde": "\u0303",
    "bar": "\u0304",
    "hat": "\u0302",
    "dot": "\u0307",
    "ddot": "\u0308",
    "dddot": "\u20db",
    "ddddot": "\u20dc",
}
_ABOVE = {"tilde": "~", "bar": "¯", "hat": "^", "dot": "˙", "ddot": "¨", "dddot": "...", "ddddot": "...."}
_COMMANDS = {
    "Delta": r"\Delta{}",
    "tau": r"\tau",
    "PSLR": r"\mathrm{PSLR}",
    "ISLR": r"\mathrm{ISLR}",
    "pull": r"\mathrm{pull}",
    "defocus": r"\mathrm{defocus}",
}


def _operator(name: str) -> str:
    r"""Name of an operator in LaTeX, without `\operatorname`, which GitHub rejects ("macros are not allowed")."""
    return rf"\mathop{{\mathrm{{{name}}}}}"


@dataclass(frozen=True)
class _Name:
    """Parts of a symbol's name. For example, `vtilde_xt` is the letter v with a tilde and the subscript xt."""

    letter: str
    accent: str
    subscript: str

    @classmethod
    def of(cls, symbol_name: str) -> "_Name":
        match = _SYMBOL_PATTERN.fullmatch(symbol_name)
        if match is None:
            return cls(symbol_name, "", "")
        subscript = (match["index"] or "").lstrip("_") or match["subscript"] or ""
        return cls(match["letter"], match["accent"] or "", subscript)

    @property
    def head(self) -> str:
        letter = self.letter.replace("Delta", "Δ").replace("det", "det ").replace("adj", "adj ")
        return _GREEK_LETTERS.get(letter, letter)

    def text(self) -> str:
        head = unicodedata.normalize("NFC", self.head + _ACCENT_CHARACTERS.get(self.accent, ""))
        return f"{head}_{_GREEK_LETTERS.get(self.subscript, self.subscript)}" if self.subscript else head

    def latex(self) -> str:
        head = f"\\{self.letter}" if self.letter in _GREEK_LETTERS else _COMMANDS.get(self.letter, self.letter)
        for operator in ("det", "adj"):
            if head.startswith(operator):
                head = rf"{_operator(operator)} {head.removeprefix(operator)}"
        if head.startswith("Delta"):
            head = r"\Delta " + head.removeprefix("Delta")
        if self.accent == "prime":
            head += "'"
        elif self.accent:
            # The accent is only on the last letter: Δ R̃.
            start, _, last = head.rpartition(" ")
            head = f"{start} \\{self.accent}{{{last}}}".strip()
        subscript = _COMMANDS.get(self.subscript, self.subscript)
        return f"{head}_{{{subscript}}}" if subscript else head


class _Text(StrPrinter):  # type: ignore[misc]
    printmethod = "_as_text"  # with SymPy's own name, _print_Indexed would not be called

    def _print_Symbol(self, expr: Symbol) -> str:
        return _Name.of(expr.name).text()

    def _print_Function(self, expr: Basic) -> str:
        arguments = ", ".join(self._print(argument) for argument in expr.args)
        return f"{_Name.of(expr.func.__name__).text()}({arguments})"

    def _print_Abs(self, expr: Basic) -> str:
        return f"|{self._print(expr.args[0])}|"

    def _print_Pi(self, expr: Basic) -> str:
        return "π"

    def _print_ImaginaryUnit(self, expr: Basic) -> str:
        return "j"

    def _print_Indexed(self, expr: Basic) -> str:
        return f"{self._print(expr.base.label)}_{self._print(expr.indices[0])}"

    def _print_Sum(self, expr: Basic) -> str:
        limits = ", ".join(
            f"{n} = {first} … {last}" for n, first, last in (map(self._print, one) for one in expr.limits)
        )
        return f"Σ({self._print(expr.function)}; {limits})"

    def _print_Relational(self, expr: Basic) -> str:
        return f"{self._print(expr.lhs)} = {self._print(expr.rhs)}"

    def _print_MatrixBase(self, expr: MatrixBase) -> str:
        rows = [", ".join(self._print(cell) for cell in expr.row(index)) for index in range(expr.rows)]
        return "[" + "; ".join(rows) + "]"


class _Latex(LatexPrinter):  # type: ignore[misc]
    def _print_Symbol(self, expr: Symbol, style: str = "plain") -> str:
        return _Name.of(expr.name).latex()

    def _print_Function(self, expr: Basic, exp: str | None = None) -> str:
        if expr.func.__module__ is not None:  # functions of SymPy, such as sin and cos
            return str(super()._print_Function(expr, exp))
        arguments = ", ".join(self._print(argument) for argument in expr.args)
        return rf"{_Name.of(expr.func.__name__).latex()}\left({arguments}\right)"

    def _print_atan2(self, expr: Basic, exp: str | None = None) -> str:
        return rf"{_operator('atan2')}\left({', '.join(self._print(argument) for argument in expr.args)}\right)"

    def _print_Abs(self, expr: Basic, exp: str | None = None) -> str:
        # A bare | would end the cell of a Markdown table.
        inner = rf"\left\lvert {self._print(expr.args[0])} \right\rvert"
        return f"{inner}^{{{exp}}}" if exp else inner


class _MathML(MathMLPresentationPrinter):  # type: ignore[misc]
    def _print_Symbol(self, sym: Symbol, style: str = "plain") -> object:
        return self._name(sym.name)

    def _print_Function(self, expr: Basic) -> object:
        if expr.func is atan2:  # SymPy writes arctan, which loses the quadrant
            return self._call(self._leaf("mi", "atan2"), expr)
        if expr.func.__module__ is not None:
            return super()._print_Function(expr)
        return self._call(self._name(expr.func.__name__), expr)

    def _print_Abs(self, expr: Basic) -> object:
        return self._fenced([self._print(expr.args[0])], "||")

    def _print_Sum(self, expr: Basic) -> object:
        row = self.dom.createElement("mrow")
        for n, first, last in expr.limits:  # SymPy's own method writes only the first limit
            sign, under = self.dom.createElement("munderover"), self.dom.createElement("mrow")
            for part in (self._print(n), self._leaf("mo", "="), self._print(first)):
                under.appendChild(part)
            for part in (self._leaf("mo", "∑"), under, self._print(last)):
                sign.appendChild(part)
            row.appendChild(sign)
        row.appendChild(self._print(expr.function))
        return row

    def _call(self, name: object, expr: Basic) -> object:
        row = self.dom.createElement("mrow")
        row.appendChild(name)
        row.appendChild(self._fenced([self._print(argument) for argument in expr.args]))
        return row

    def _fenced(self, parts: Sequence[object], brackets: str = "()") -> object:
        row = self.dom.createElement("mrow")
        row.appendChild(self._leaf("mo", brackets[0]))
        for index, part in enumerate(parts):
            if index:
                row.appendChild(self._leaf("mo", ","))
            row.appendChild(part)
        row.appendChild(self._leaf("mo", brackets[1]))
        return row

    def without_fences(self, node: Any) -> Any:
        """Replace each `mfenced` element by brackets that are written as operators.

        SymPy 1.13 writes `mfenced`, which browsers no longer display. SymPy 1.14 writes brackets itself.
        """
        for child in list(node.childNodes):
            node.replaceChild(self.without_fences(child), child)
        if node.nodeName != "mfenced":
            return node
        brackets = (node.getAttribute("open") or "(") + (node.getAttribute("close") or ")")
        return self._fenced(list(node.childNodes), brackets)

    def _name(self, name: str) -> object:
        parts = _Name.of(name)
        head = self._leaf("mi", parts.head)
        if parts.accent == "prime":
            head = self._leaf("mi", parts.head + _ACCENT_CHARACTERS["prime"])
        elif parts.accent:
            over = self.dom.createElement("mover")
            over.setAttribute("accent", "true")
            over.appendChild(head)
            over.appendChild(self._leaf("mo", _ABOVE[parts.accent]))
            head = over
        if not parts.subscript:
            return head
        sub = self.dom.createElement("msub")
        sub.appendChild(head)
        sub.appendChild(self._leaf("mi", _GREEK_LETTERS.get(parts.subscript, parts.subscript)))
        return sub

    def _print_ImaginaryUnit(self, expr: Basic) -> object:
        return self._leaf("mi", "j")

    def _leaf(self, tag: str, text: str) -> object:
        leaf = self.dom.createElement(tag)
        leaf.appendChild(self.dom.createTextNode(text))
        return leaf


def as_text(expression: Basic) -> str:
    """Write an expression as one line of plain text, such as `π*T^2*|v_xt*ṽ_xt|/(2*R_t*λ)`."""
    return str(_Text().doprint(expression)).replace("**", "^")


def as_latex(expression: Basic, times: str = " ") -> str:
    """Write an expression in LaTeX without delimiters. `times` is inserted between factors."""
    return str(_Latex({"mul_symbol": times, "imaginary_unit": "j"}).doprint(expression))


def as_mathml(expression: Basic) -> str:
    """Write an expression in presentation MathML, as a single `math` element."""
    return f'<math xmlns="http://www.w3.org/1998/Math/MathML">{as_mathml_content(expression)}</math>'


def as_mathml_content(expression: Basic) -> str:
    """Write an expression in presentation MathML, without the `math` element around it."""
    printer = _MathML()
    xml = str(printer.without_fences(printer._print(expression)).toxml())
    for name, character in (
        ("InvisibleTimes", "\u2062"),
        ("ApplyFunction", "\u2061"),
        ("pi", "π"),
        ("ExponentialE", "e"),
    ):
        xml = xml.replace(f"&{name};", character)  # XML knows no HTML entities
    return xml.replace("<mo>-</mo>", "<mo>−</mo>")  # SymPy writes a hyphen instead of a minus


def derivation(selection: str, format_name: str) -> str:
    """Return the text that `bisar-budget derive` prints for a selection.

    The selections are `all`, `equations`, `I`, `II`, `vibration`, `full` and `random`.
    """
    tables: dict[str, Callable[[], FormulaTable]] = {
        "I": published.table_1,
        "II": published.table_2,
        "vibration": published.vibration,
        "full": full.table,
        "random": random_errors.table,
    }
    blocks = []
    if selection in ("all", "equations"):
        blocks.append(_EQUATION_RENDERERS[format_name](_TITLE, published.equations()))
    for name, table in tables.items():
        if selection in ("all", name):
            if name == "random":
                title = "Equations of random errors, spectra one-sided"
                blocks.append(_EQUATION_RENDERERS[format_name](title, random_errors.equations()))
            if name == "full":
                blocks.append(_EQUATION_RENDERERS[format_name]("Equations of the full model", full.equations()))
            blocks.append(_TABLE_RENDERERS[format_name](table()))
            if name == "vibration":
                blocks.append(_TABLE_RENDERERS[format_name](full.vibration()))
    return "\n".join(blocks)


def numbered(number: int, format_name: str) -> str:
    """Write all equations of the paper with the number `number`, in the format `format_name`."""
    return _EQUATION_RENDERERS[format_name](
        _TITLE, tuple(e for e in published.equations() if e.number == f"({number})")
    )


_TITLE = "Equations of Rigling & Moses"


def _heading(equation: Equation) -> str:
    """Number and title of an equation.

    For an equation of the paper, the text also tells whether the equation is a definition or was derived by SymPy.
    """
    return f"{equation.number} {equation.title} [{equation.origin}]" if equation.number else equation.title


def _slip(equation: Equation) -> list[str]:
    return [f"In print: {equation.slip}."] if equation.slip else []


def _text_equations(title: str, equations: tuple[Equation, ...]) -> str:
    lines = [title, ""]
    for equation in equations:
        formula = f"    {as_text(equation.left)} = {as_text(equation.right)}"
        lines.append(_heading(equation))
        lines += textwrap.wrap(formula, 100, subsequent_indent=" " * 8, break_long_words=False)
        lines += (f"    {line}" for line in _slip(equation))
    return "\n".join(lines) + "\n"


def _latex_equations(title: str, equations: tuple[Equation, ...]) -> str:
    lines = [f"% {title}"]
    for equation in equations:
        tag = rf" \tag*{{{equation.number}}}" if equation.number else ""
        lines += [
            f"% {_heading(equation)}",
            *(f"% {line}" for line in _slip(equation)),
            rf"\[ {as_latex(equation.left)} = {as_latex(equation.right)}{tag} \]",
        ]
    return "\n".join(lines) + "\n"


def _markdown_equations(title: str, equations: tuple[Equation, ...]) -> str:
    lines = [f"## {title}", ""]
    for equation in equations:
        lines += [
            " ".join([_heading(equation), *_slip(equation)]),
            "",
            "```math",
            f"{as_latex(equation.left)} = {as_latex(equation.right)}",
            "```",
            "",
        ]
    return "\n".join(lines)


def _mathml_equations(title: str, equations: tuple[Equation, ...]) -> str:
    lines = [f"<h2>{escape(title)}</h2>", "<dl>"]
    for equation in equations:
        heading = " ".join([_heading(equation), *_slip(equation)])
        lines.append(f"<dt>{escape(heading)}</dt><dd>{as_mathml(equation.left)} = {as_mathml(equation.right)}</dd>")
    return "\n".join([*lines, "</dl>"]) + "\n"


def _cells(table: FormulaTable, write: Callable[[Basic], str]) -> list[list[str]]:
    rows = []
    for row in table.rows:
        cells = [write(cell) if cell != 0 else "-" for cell in row.cells]
        rows.append([str(row.number or "-"), write(row.label), *cells])
    return rows


def _notes(table: FormulaTable) -> list[str]:
    return [*table.notes, *(f"{as_text(row.error)}: {row.note}." for row in table.rows if row.note)]


def _text_table(table: FormulaTable) -> str:
    rows = [["Row", "Error", *table.columns], *_cells(table, as_text)]
    widths = [max(_width(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = [f"{table.number}. {table.title}", ""]
    for row in rows:
        cells = [cell + " " * (width - _width(cell)) for cell, width in zip(row, widths, strict=True)]
        lines.append("  ".join(cells).rstrip())
    return "\n".join([*lines, "", *_notes(table)]) + "\n"


def _width(text: str) -> int:
    return sum(not unicodedata.combining(character) for character in text)


def _latex_table(table: FormulaTable) -> str:
    heads = [column.replace("β̃", r"$\tilde{\beta}_").translate(_SUBSCRIPTS) for column in table.columns]
    heads = [f"{head}$" if "$" in head else head for head in heads]
    lines = [
        f"% {table.number}. {table.title}",
        rf"\begin{{tabular}}{{rl{'l' * len(table.columns)}}}",
        " & ".join(["Row", "Error", *heads]) + r" \\ \hline",
    ]
    for number, label, *cells in _cells(table, as_latex):
        math = [f"${cell}$" if cell != "-" else "--" for cell in (label, *cells)]
        lines.append(" & ".join([number, *math]) + r" \\")
    return "\n".join([*lines, r"\end{tabular}", *(f"% {note}" for note in _notes(table))]) + "\n"


_SUBSCRIPTS = str.maketrans("₀₁₂₃₄", "01234")


def _markdown_table(table: FormulaTable) -> str:
    lines = [
        f"## {table.number}. {table.title}",
        "",
        "| " + " | ".join(["Row", "Error", *table.columns]) + " |",
    ]
    lines.append("|" + " --- |" * (len(table.columns) + 2))
    for number, label, *cells in _cells(table, as_latex):
        math = [f"${cell}$" if cell != "-" else "–" for cell in (label, *cells)]
        lines.append("| " + " | ".join([number, *math]) + " |")
    return "\n".join([*lines, "", *_notes(table)]) + "\n"


def _mathml_table(table: FormulaTable) -> str:
    heads = "".join(f'<th scope="col">{head}</th>' for head in ("Row", "Error", *table.columns))
    lines = [
        "<table>",
        f"<caption>{table.number}. {table.title}</caption>",
        f"<thead><tr>{heads}</tr></thead>",
        "<tbody>",
    ]
    for number, *cells in _cells(table, as_mathml):
        row = "".join(f"<td>{cell}</td>" for cell in cells)
        lines.append(f'<tr><th scope="row">{number}</th>{row}</tr>')
    notes = "".join(f"<p>{note}</p>" for note in _notes(table))
    return "\n".join([*lines, "</tbody>", "</table>", notes]) + "\n"


_EQUATION_RENDERERS: dict[str, Callable[[str, tuple[Equation, ...]], str]] = {
    "text": _text_equations,
    "latex": _latex_equations,
    "markdown": _markdown_equations,
    "mathml": _mathml_equations,
}
_TABLE_RENDERERS: dict[str, Callable[[FormulaTable], str]] = {
    "text": _text_table,
    "latex": _latex_table,
    "markdown": _markdown_table,
    "mathml": _mathml_table,
}
