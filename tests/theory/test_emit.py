"""The committed evaluators are what the derivation gives, are plain arithmetic, and are accurate to the last bits."""

import ast
import inspect
import os
import subprocess
import sys
from functools import cache

import mpmath
import numpy as np
import pytest
from sympy import lambdify

from bisar_budget import evaluators
from bisar_budget.theory import emit, render
from bisar_budget.theory.symbols import tau
from tests.conftest import ROOT

ALLOWED = (
    ast.Add
    | ast.Sub
    | ast.Mult
    | ast.Div
    | ast.Pow
    | ast.USub
    | ast.BinOp
    | ast.UnaryOp
    | ast.Constant
    | ast.Name
    | ast.Load
    | ast.Store
    | ast.Assign
    | ast.Return
    | ast.Tuple
    | ast.Expr
)


def test_committed_files_are_current_whatever_the_process() -> None:
    """By the command, in a process that has a seed of hashes of its own: each run of the tests tries another one.

    The files were written by a process with one more, and CI runs the command of the wheel. One derivation takes ten
    seconds.
    """
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONHASHSEED"}
    command = [sys.executable, "-m", "bisar_budget", "derive", "--check"]
    done = subprocess.run(command, env=environment, cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, ""), done.stdout + done.stderr


def test_brackets_that_sympy_1_13_writes_as_fences_are_operators() -> None:
    """The catalogue does not depend on SymPy's version: fences become the operators that 1.14 writes."""
    printer = render._MathML()
    inner = printer.dom.createElement("mfenced")
    inner.setAttribute("open", "|")
    inner.setAttribute("close", "|")
    inner.appendChild(printer._print(tau))
    outer = printer.dom.createElement("mfenced")
    for part in (inner, printer._print(tau)):
        outer.appendChild(part)
    row = "<mrow><mo>(</mo><mrow><mo>|</mo><mi>τ</mi><mo>|</mo></mrow><mo>,</mo><mi>τ</mi><mo>)</mo></mrow>"
    assert printer.without_fences(outer).toxml() == row


def test_evaluators_are_pure_arithmetic_without_imports() -> None:
    module = ast.parse(inspect.getsource(evaluators))
    for node in module.body:
        if isinstance(node, ast.AnnAssign):  # a table of numbers
            assert node.value is not None
            assert ast.literal_eval(node.value)
            continue
        assert isinstance(node, ast.FunctionDef) or isinstance(getattr(node, "value", None), ast.Constant)
        if isinstance(node, ast.FunctionDef):
            for statement in node.body:
                for part in ast.walk(statement):
                    assert isinstance(part, ALLOWED), ast.dump(part)


def _terms(expression) -> list:
    return list(expression.expand().as_ordered_terms())


@cache
def derived() -> dict[str, emit.Evaluator]:
    return {evaluator.name: evaluator for evaluator in emit.evaluators()}


EMITTED = [name for name, _ in inspect.getmembers(evaluators, inspect.isfunction)]


def test_every_evaluator_is_emitted_and_no_other() -> None:
    assert sorted(derived()) == EMITTED


@pytest.mark.parametrize("name", EMITTED)
def test_evaluator_equals_its_terms_at_50_digits(name: str) -> None:
    """Error below 1e-12 of the sum of absolute terms, over random geometries of 1 km to 1000 km."""
    evaluator = derived()[name]
    rng = np.random.default_rng(20261121)
    function = getattr(evaluators, evaluator.name)
    symbols = [symbol for symbol, _ in evaluator.arguments]
    terms = [[lambdify(symbols, _terms(expression), "mpmath") for expression in row] for row in evaluator.rows]
    for _ in range(40):
        values = {}
        for symbol, name in evaluator.arguments:
            size = 10.0 ** rng.uniform(-3, 6)
            sign = 1.0 if symbol.is_positive else rng.choice([-1.0, 1.0])
            values[name] = sign * size
        result = function(**values)
        rows = result if isinstance(result, tuple) else ((result,),)
        with mpmath.workdps(50):
            exact = [mpmath.mpf(value) for value in values.values()]
            for row, got in zip(terms, rows, strict=True):
                for parts_of, number in zip(row, got, strict=True):
                    parts = parts_of(*exact)
                    assert abs(number - mpmath.fsum(parts)) <= 1e-12 * mpmath.fsum(parts, absolute=True)


def test_evaluators_broadcast_over_arrays_like_floats() -> None:
    rng = np.random.default_rng(3)
    position, velocity = rng.uniform(-3e4, 3e4, (3, 5, 1)), rng.uniform(-200, 200, (3, 1, 7))
    slant_range = np.sqrt((position**2).sum(axis=0))
    arrays = evaluators.published_motion(*position, *velocity, slant_range, 0.03, 6.0)
    for i, j in ((0, 0), (4, 6), (2, 3)):
        scalars = evaluators.published_motion(*position[:, i, 0], *velocity[:, 0, j], slant_range[i, 0], 0.03, 6.0)
        for array_row, scalar_row in zip(arrays, scalars, strict=True):
            for array, scalar in zip(array_row, scalar_row, strict=True):
                assert np.broadcast_to(array, (5, 7))[i, j] == scalar
