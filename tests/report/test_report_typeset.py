"""Formulas of a report as MathML and LaTeX: read back, the numbers put in give the result."""

import math
import re
from xml.etree import ElementTree

import pytest

from bisar_budget.budget.check import check_mission
from bisar_budget.catalogue import FORMULAS, SYMBOLS
from bisar_budget.mission.load import load_mission
from bisar_budget.report.explain import notation
from bisar_budget.report.explain.explanation import chain, collection_chain
from bisar_budget.report.explain.notation import WorkedEquation, filled
from tests.conftest import TODAY
from tests.report.test_report_explanation import MISSIONS


def derived_equations(model: str = "published") -> list[tuple[str, WorkedEquation]]:
    found = []
    for path in MISSIONS:
        mission = load_mission(str(path), model)
        findings = check_mission(mission, TODAY)
        chains = {row.id: chain(mission, findings, row) for row in findings.rows}
        for name, steps in (("collection", collection_chain(findings)), *chains.items()):
            found += [
                (f"{path.stem} {name}", part)
                for step in steps
                for part in step.body
                if isinstance(part, WorkedEquation) and part.formula in FORMULAS
            ]
    return found


def python_of_mathml(node: ElementTree.Element) -> str:
    """Presentation MathML, as far as the catalogue uses it, as an expression of Python."""
    children = [python_of_mathml(child) for child in node]
    match node.tag:
        case "mn" | "mi":
            return {"π": "pi"}.get(node.text or "", node.text or "")
        case "mo":
            return {"·": "*", "−": "-"}.get(node.text or "", node.text or "")
        case "mrow" | "math":
            inner = "".join(children)
            if inner.startswith("|") and inner.endswith("|"):
                return f"abs({inner[1:-1]})"
            is_fenced = len(node) > 1 and (node[0].text, node[-1].text) == ("(", ")")
            return f"({inner})" if node.tag == "mrow" and not is_fenced else inner
        case "mfrac":
            return f"(({children[0]})/({children[1]}))"
        case "msup":
            return f"(({children[0]})**({children[1]}))"
        case "msqrt":
            return f"sqrt({''.join(children)})"
    raise AssertionError(node.tag)


def python_of_latex(text: str) -> str:
    text = text.replace(r"\mathop{\mathrm{atan2}}", "atan2")
    text = text.replace(r"\left\lvert", "abs(").replace(r"\right\rvert", ")").replace(r"\left(", "(")
    text = text.replace(r"\right)", ")").replace(r"\cdot", "*").replace(r"\pi", "pi")
    while True:
        innermost = re.search(
            r"\\frac\{([^{}]*)\}\{([^{}]*)\}|\\sqrt\{([^{}]*)\}|\^\{([^{}]*)\}|\\(sin|cos|log)\{([^{}]*)\}", text
        )
        if innermost is None:
            return text
        top, bottom, root, power, function, argument = innermost.groups()
        new = f"sqrt({root})" if root is not None else f"**({power})"
        new = new if function is None else f"{function}({argument})"
        new = new if top is None else f"(({top})/({bottom}))"
        text = text[: innermost.start()] + new + text[innermost.end() :]


def rounding_of(equation: WorkedEquation) -> float:
    """Error at most by rounding each number to six digits, where terms of a formula may cancel; else 0."""
    # Look vectors nearly cancel in forward scatter.
    is_sum_of_looks = "sin(" in equation.formula and " + " in equation.formula
    if equation.symbol != "det Q" and not is_sum_of_looks:
        return 0.0
    formula, functions = equation.formula.replace("^", "**"), {"sin": math.sin, "cos": math.cos, "atan2": math.atan2}
    values = dict(equation.values)
    exact = eval(formula, functions, values)
    moved = (eval(formula, functions, {**values, key: one * (1 + 5e-6)}) for key, one in values.items())
    return math.fsum(abs(one - exact) for one in moved)


def value_of(expression: str) -> float:
    functions = {name: getattr(math, name) for name in ("sqrt", "sin", "cos", "log", "atan2")}
    return float(eval(expression, {"__builtins__": {}}, {"pi": math.pi, "abs": abs, **functions}))


KNOWN = ("π", "sin", "cos", "log", "atan2")


@pytest.fixture(scope="module")
def equations():
    """The collection, Table I, Table II, the clock, vibration, autofocus."""
    return derived_equations()


def test_every_kind_of_formula_is_there(equations) -> None:
    formulas = " ".join({equation.formula for _, equation in equations})
    assert len({equation.formula for _, equation in equations}) > 40
    for part in ("atan2", "-v_xt/R_t", "ã_xt", "ṽ_yr", "p̃_zt", "t̃_2", "PSLR", "ISLR", "N_pull"):
        assert part in formulas


def test_numbers_in_mathml_give_the_result(equations) -> None:
    """Six digits are put in and shown."""
    for name, equation in equations:
        root = ElementTree.fromstring(f"<p>{notation.as_mathml(equation).numbers}</p>")
        (equals, numbers), (equals_again, result) = (element[0] for element in root)
        assert [equals.text, equals_again.text] == ["=", "="], name
        assert not [symbol.text for symbol in numbers.iter("mi") if symbol.text not in KNOWN], name
        shown = python_of_mathml(result[0])
        want = pytest.approx(equation.result, rel=2e-5, abs=max(1e-300, rounding_of(equation)))
        assert value_of(python_of_mathml(numbers)) == want, (name, equation)
        assert value_of(shown) == want, name


def test_numbers_in_latex_give_the_result(equations) -> None:
    for name, equation in equations:
        _, numbers, result = notation.as_latex(equation).numbers.split("= ")
        want = pytest.approx(equation.result, rel=2e-5, abs=max(1e-300, rounding_of(equation)))
        assert value_of(python_of_latex(numbers)) == want, (name, numbers)
        assert value_of(python_of_latex(result.partition(r"\,")[0])) == want, name


def test_a_small_number_as_base_of_a_power_stands_in_brackets() -> None:
    formula = "π*T^2*|v_xt*ṽ_xt|/(2*R_t*λ)"
    values = {"T": 2e-5, "v_xt": -7e3, "ṽ_xt": 1e-3, "R_t": 7e5, "λ": 0.03}
    equation = WorkedEquation("QPE", formula, values, math.pi * 4e-10 * 7 / (2 * 7e5 * 0.03), "rad")
    root = ElementTree.fromstring(f"<p>{notation.as_mathml(equation).numbers}</p>")
    assert value_of(python_of_mathml(root[0][0][1])) == pytest.approx(equation.result, rel=1e-12)
    numbers = notation.as_latex(equation).numbers.split("= ")[1]
    assert value_of(python_of_latex(numbers)) == pytest.approx(equation.result, rel=1e-12)


@pytest.mark.parametrize("text", [*FORMULAS, *SYMBOLS])
def test_the_catalogue_is_well_formed(text: str) -> None:
    latex, mathml = FORMULAS.get(text) or SYMBOLS[text]
    ElementTree.fromstring(notation.math(mathml))
    assert latex.count("{") == latex.count("}")
    assert "&" not in mathml


def test_atan2_is_no_arctan() -> None:
    _, mathml = next(value for key, value in FORMULAS.items() if key.startswith("atan2"))
    assert "<mi>atan2</mi>" in mathml
    assert "<mo>,</mo>" in mathml


@pytest.mark.parametrize(
    "formula",
    [
        "(-β̃_0*ṡ_y + β̃_1*s_y)/(det Q)",
        "β̃_2 + (s\u0308_x*x\u0302 + s\u0308_y*ŷ)/2",
        "-ã_dr*ü_dr/4",
        "-p̃_x*(u\u20dc_xt + u\u20dc_xr)/24",
        "|φ_t + φ_r|",
        "sqrt(s_k)/(sqrt(s_t) + sqrt(s_r))",
        "s_x*ṡ_y - s_y*ṡ_x",
        "2*T^4*b_4/(3*λ) - T^2/c",
        "a/b/c*d",
    ],
)
def test_formulas_that_no_table_has_are_typeset_from_their_text(formula: str) -> None:
    """Read back from MathML and LaTeX they give what the text gives; the full model's were raw text before."""
    names = set(re.findall(r"det Q|[^\W\d][\w\u0300-\u036f\u20db-\u20dc]*", formula)) - {"sqrt", "π"}
    values = {name: (-1) ** n * (0.37 + n) * 10.0 ** (-3 * (n % 3)) for n, name in enumerate(sorted(names))}
    values |= {name: abs(value) for name, value in values.items() if name.startswith("s_")}
    text = re.sub(r"\|([^|]*)\|", r"abs(\1)", filled(formula, values)).replace("^", "**").replace("π", "pi")
    want = value_of(text)
    equation = WorkedEquation("x", formula, values, want, "m")
    assert notation.is_formula(equation)
    assert formula not in FORMULAS
    mathml = notation.as_mathml(equation)
    numbers = ElementTree.fromstring(f"<p>{mathml.numbers}</p>")[0][0][1]
    assert value_of(python_of_mathml(numbers)) == pytest.approx(want, rel=1e-12)
    latex = notation.as_latex(equation)
    assert value_of(python_of_latex(latex.numbers.split("= ")[1])) == pytest.approx(want, rel=1e-12)
    assert "_" not in mathml.formula
    assert not re.search(r"[^\x00-\x7f]", latex.formula)


def test_words_stay_text() -> None:
    for formula in ("total*share*gain", "limit/(QPE/unit)", "min(published, full)", "10^(dB/10)"):
        assert not notation.is_formula(WorkedEquation("x", formula, {}, 0.0, ""))


def test_a_name_with_an_underscore_has_a_subscript() -> None:
    """`\\mathrm{QPE_full}` puts the f alone below the line."""
    equation = WorkedEquation(
        "QPE_full", "φ_turning + φ_displaced", {"φ_turning": 1.0, "φ_displaced": -2.0}, -1.0, "rad"
    )
    assert notation.as_latex(equation).formula.startswith(r"\mathrm{QPE}_{\mathrm{full}} &= \phi_{\mathrm{turning}}")
    assert "<msub><mi>QPE</mi><mi>full</mi></msub>" in notation.as_mathml(equation).formula
