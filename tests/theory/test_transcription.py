"""The `expression` of each published cell is what its `printed` LaTeX says, read by a small reader of its own."""

import re

import pytest
from sympy import Expr, Integer, Symbol, cos, parse_expr, pi, simplify, sin, sqrt

from tests.theory.test_published_tables import printed

TOKEN = re.compile(r"\\[a-zA-Z]+|[a-zA-Z]+|\d+|\S")
FUNCTIONS = {"\\sin": sin, "\\cos": cos, "\\sqrt": sqrt}
MARKS = {"\\tilde": "tilde", "\\bar": "bar"}


class Reader:
    """Products, quotients and powers as the tables print them; what it does not know is an error."""

    def __init__(self, latex: str) -> None:
        self.tokens = TOKEN.findall(latex)

    def take(self, expected: str | None = None) -> str:
        token = self.tokens.pop(0)
        assert expected in (None, token), f"{token} where {expected} was expected"
        return token

    @property
    def next(self) -> str:
        return self.tokens[0] if self.tokens else ""

    def expression(self) -> Expr:
        sign = -1 if self.next == "-" and self.take() else 1
        if not self.tokens:
            return Integer(0)  # a dash alone: no such term
        value = self.factor()
        while self.next not in ("", "}", ")"):
            value = value / self.factor() if self.next == "/" and self.take() else value * self.factor()
        return sign * value

    def group(self, opening: str, closing: str) -> Expr:
        self.take(opening)
        value = self.expression()
        self.take(closing)
        return value

    def factor(self) -> Expr:
        value = self.atom()
        if self.next == "^":
            self.take()
            value = value ** Integer(self.take())
        return value

    def atom(self) -> Expr:
        if self.next == "(":
            return self.group("(", ")")
        token = self.take()
        if token.isdigit():
            return Integer(token)
        if token == "\\frac":
            return self.group("{", "}") / self.group("{", "}")
        if token in FUNCTIONS:
            return FUNCTIONS[token](self.group("{", "}") if self.next == "{" else self.group("(", ")"))
        if token == "\\pi":
            return pi
        mark = ""
        if token in MARKS:
            self.take("{")
            mark, token = MARKS[token], self.take()
            self.take("}")
        name = token.removeprefix("\\") + mark
        assert name.isalpha(), f"{name} is no symbol"
        if self.next == "_":
            self.take()
            if self.next == "{":
                self.take()
                end = self.tokens.index("}")
                subscript, self.tokens = "".join(self.tokens[:end]), self.tokens[end + 1 :]
            else:
                subscript = self.take()
            name += f"_{subscript}"
        return Symbol(name, positive=True)


def read(latex: str) -> Expr:
    reader = Reader(latex)
    value = reader.expression()
    assert not reader.tokens, f"left unread: {reader.tokens}"
    return value


def of_plain_names(expression: str) -> Expr:
    text = expression.replace("lambda", "lambda_")
    names = {str(s): Symbol(str(s).rstrip("_"), positive=True) for s in parse_expr(text).free_symbols}
    return parse_expr(text, local_dict=names)


CELLS = [(table, cell) for table in ("table_1", "table_2", "vibration") for cell in printed(table)]


@pytest.mark.parametrize(
    ("table", "cell"), CELLS, ids=[f"{table} row {cell['row']} {cell['column']}" for table, cell in CELLS]
)
def test_the_expression_of_a_cell_is_what_is_printed(table: str, cell: dict[str, str]) -> None:
    bounded, _, formula = re.split(r"(<|\\leq)", cell["printed"]) if cell["column"] == "allowable" else ("", "", "")
    assert simplify(read(formula or cell["printed"]) - of_plain_names(cell["expression"])) == 0
    if bounded:
        error = cell["mme"].partition("=")[2] or cell["mme"]  # what the row is about, as printed beside it
        assert str(read(bounded)) in {str(symbol) for symbol in read(error).free_symbols}


@pytest.mark.parametrize(
    ("latex", "plain"),
    [
        (r"-\frac{\tilde{a}_{xt}v_{xt}}{2R_t}", "-atilde_xt*v_xt/(2*R_t)"),
        (r"\lambda/(2\pi)\sqrt{PSLR/2}", "lambda*sqrt(2)*sqrt(PSLR)/(4*pi)"),
        (r"2T^2 \sin(\bar{\theta}_t)", "2*T**2*sin(thetabar_t)"),
    ],
)
def test_the_reader(latex: str, plain: str) -> None:
    assert simplify(read(latex) - of_plain_names(plain)) == 0


@pytest.mark.parametrize(
    ("latex", "other"),
    [
        (r"\frac{\tilde{v}_{xt}x_t}{R_t}", "-vtilde_xt*x_t/R_t"),
        (r"\frac{\tilde{v}_{xt}x_t}{2R_t}", "vtilde_xt*x_t/R_t"),
        (r"\frac{\tilde{v}_{yt}x_t}{R_t}", "vtilde_xt*x_t/R_t"),
    ],
)
def test_the_reader_tells_a_sign_a_factor_and_a_subscript(latex: str, other: str) -> None:
    assert simplify(read(latex) - of_plain_names(other)) != 0
