"""Nothing compares names of kinds of error outside the registry, with a few exceptions that have a reason."""

import ast
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from tests.conftest import ROOT

PACKAGE = ROOT / "bisar_budget"
MOST = 20

# Modules in which `kind` is another thing than a kind of error.
OTHER_THINGS = {
    "cli/sensors.py": "sorts of parts",
    "cluster/scheduler.py": "classes of Dask",
    "questions/cases.py": "types of NumPy, and words for a distribution of cases",
    "questions/compare.py": "sorts of parts",
    "questions/specified.py": "sorts of parts",
    "questions/varied.py": "classes of sections",
    "formats/importing.py": "types of NumPy",
    "questions/results.py": "formats of pictures",
    "mission/parts.py": "sorts of parts",
    "mission/readers.py": "classes of sections",
    "mission/revision.py": "objects of git",
    "mission/tree.py": "events of YAML",
    "paths": "sorts of columns, messages and logs",
    "phrases/templates.py": "formats of quantities",
    "report/change/comparison.py": "keys of paths of files",
    "report/answers/diff_answer.py": "sorts of changes",
    "report/drawing/figure.py": "formats of pictures",
    "report/explain/notation.py": "nodes of a formula",
    "report/tables.py": "types of NumPy",
    "settings.py": "types of settings",
}


def comparisons() -> Iterator[tuple[str, str]]:
    """Module and text of each comparison in which an operand is a kind."""
    for path in sorted(PACKAGE.rglob("*.py")):
        module = path.relative_to(PACKAGE).as_posix()
        if module == "error_kinds.py" or any(module.startswith(other) for other in OTHER_THINGS):
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Compare | ast.Match):
                operands = [node.left, *node.comparators] if isinstance(node, ast.Compare) else [node.subject]
                if any(is_kind(operand) for operand in operands):
                    yield module, ast.unparse(node).partition("\n")[0]


def is_kind(node: ast.expr) -> bool:
    name = node.attr if isinstance(node, ast.Attribute) else node.id if isinstance(node, ast.Name) else ""
    return name == "kind" or (isinstance(node, ast.Tuple) and any(map(is_kind, node.elts)))


# By module, how many comparisons are left, and why.
LEFT = {
    "budget/declarations.py": (2, "words of `requirements.declare`, some of which are no kinds of a row"),
    "budget/random_rows.py": (1, "an oscillator's row about acceleration may lack a spectrum"),
    "questions/allocate.py": (1, "the last part of a key of the file, which is the name of a kind"),
    "formats/collected.py": (5, "words of parameters of a CPHD file"),
    "mission/covariance.py": (1, "words in the names of correlated errors"),
    "mission/platforms.py": (1, "keys of the file that a covariance replaces"),
    "mission/quantities.py": (2, "steps of a path of keys"),
    "report/change/fallen_effects.py": (1, "the same error in two missions"),
    "report/answers/allocate_answer.py": (1, "the last part of a key of the file, which is the name of a kind"),
}


def test_the_registry_alone_compares_names_of_kinds() -> None:
    found = list(comparisons())
    assert Counter(module for module, _ in found) == Counter(
        {module: count for module, (count, _) in LEFT.items()}
    ), found
    assert len(found) <= MOST


def test_the_other_things_are_there() -> None:
    assert [name for name in OTHER_THINGS if not (PACKAGE / name).exists()] == []
    assert isinstance(PACKAGE, Path)
