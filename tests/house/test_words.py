"""How the package reads, by counts that may only fall: names without a meaning, constants without a unit, `Any`.

A count is a thermometer: no sentence and no name is written for it. Who makes a count fall lowers its bound here.
"""

import ast
import re
from collections import Counter
from collections.abc import Callable
from functools import cache

import pytest

from tests.conftest import ROOT

PACKAGE = ROOT / "bisar_budget"
GENERATED = {PACKAGE / "catalogue.py", PACKAGE / "evaluators.py"}

# Words that do not say what a thing is, and words that may stand between them.
_EMPTY = """
one ones found part parts place places said what some known given wanted left made held other others beside own same
whole thing things something anything rest such those these that which
"""
_FILLERS = "the a an of to in at by for is as so no not"

# The last word of a constant's name: a unit, or what is counted or compared.
_UNITS = "rad deg s ms us ns min hours days hz khz mhz ghz m km mm um m2 s2 mps mps2 db kg k pa v w ppm"
_MEASURES = """
ratio factor fraction share degree order exponent power probability count cells lines nodes points rows columns files
cases draws steps rounds samples pulses digits characters width indent version code seed level index id size length
words pages states fixes terms iterations cycles bytes sigma per
"""
EMPTY, FILLERS, UNITS, MEASURES = (frozenset(text.split()) for text in (_EMPTY, _FILLERS, _UNITS, _MEASURES))


@cache
def nodes() -> tuple[ast.AST, ...]:
    """Every node of the package that is written by hand."""
    paths = (path for path in sorted(PACKAGE.rglob("*.py")) if path not in GENERATED)
    return tuple(node for path in paths for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))))


def words(name: str) -> list[str]:
    return [word for word in re.split(r"_+|\d+", re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).lower()) if word]


def is_empty(name: str) -> bool:
    """Whether a name has words of no meaning and fillers alone."""
    found = set(words(name))
    return bool(found & EMPTY) and found <= EMPTY | FILLERS


def bound_names(node: ast.AST) -> list[str]:
    if isinstance(node, ast.arg):
        return [] if node.arg in ("self", "cls", "other") else [node.arg]
    if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
        return [node.id]
    if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
        return [node.attr]
    return [node.name] if isinstance(node, ast.FunctionDef | ast.ClassDef) else []


def is_number(node: ast.AST) -> bool:
    if isinstance(node, ast.UnaryOp):
        return is_number(node.operand)
    if isinstance(node, ast.BinOp):
        return is_number(node.left) and is_number(node.right)
    return isinstance(node, ast.Constant) and type(node.value) in (int, float)


def has_measure(name: str) -> bool:
    *_, last = words(name)
    return last in UNITS | MEASURES or "per" in words(name) or words(name)[0] in MEASURES


@cache
def empty_names() -> int:
    return sum(is_empty(name) for node in nodes() for name in bound_names(node))


@cache
def bare_constants() -> int:
    statements = (statement for node in nodes() if isinstance(node, ast.Module) for statement in node.body)
    return sum(
        is_number(statement.value) and not has_measure(target.id)
        for statement in statements
        if isinstance(statement, ast.Assign)
        for target in statement.targets
        if isinstance(target, ast.Name) and not target.id.startswith("__")
    )


@cache
def any_annotations() -> int:
    return sum(isinstance(node, ast.Name) and node.id == "Any" for node in nodes())


@cache
def classes_defined_twice() -> int:
    counts = Counter(node.name for node in nodes() if isinstance(node, ast.ClassDef))
    return sum(count > 1 for count in counts.values())


@cache
def constants_of_several_values() -> int:
    """Names of module constants that stand for different values in different files."""
    values: dict[str, set[str]] = {}
    modules = (node for node in nodes() if isinstance(node, ast.Module))
    for statement in (statement for module in modules for statement in module.body):
        for target, value in assigned(statement):
            if isinstance(target, ast.Name) and target.id.isupper() and len(target.id.strip("_")) > 1:
                values.setdefault(target.id.strip("_"), set()).add(ast.unparse(value))
    return sum(len(contents) > 1 for contents in values.values())


def assigned(statement: ast.stmt) -> list[tuple[ast.expr, ast.expr]]:
    """Targets of an assignment with their values, those of a tuple one by one."""
    if isinstance(statement, ast.AnnAssign):
        return [(statement.target, statement.value)] if statement.value else []
    if not isinstance(statement, ast.Assign):
        return []
    pairs: list[tuple[ast.expr, ast.expr]] = []
    for target in statement.targets:
        is_paired = isinstance(target, ast.Tuple) and isinstance(statement.value, ast.Tuple)
        pairs += zip(target.elts, statement.value.elts, strict=True) if is_paired else [(target, statement.value)]
    return pairs


BOUNDS = {
    empty_names: 353,
    bare_constants: 38,
    any_annotations: 123,
    classes_defined_twice: 0,
    constants_of_several_values: 0,
}


@pytest.mark.parametrize("count", BOUNDS, ids=lambda count: count.__name__)
def test_the_count_has_not_risen(count: Callable[[], int]) -> None:
    assert count() <= BOUNDS[count]


@pytest.mark.parametrize("count", BOUNDS, ids=lambda count: count.__name__)
def test_a_bound_follows_its_count(count: Callable[[], int]) -> None:
    """A bound far above its count would let it rise again."""
    assert count() >= 0.9 * BOUNDS[count] - 5
