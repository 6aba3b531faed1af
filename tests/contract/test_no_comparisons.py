"""Nothing compares names of kinds of error outside the registry, with a few exceptions that have a reason."""

import ast
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from bisar_budget.error_kinds.kind import SourceKind
from bisar_budget.error_kinds.registry import kinds
from tests.conftest import ROOT

PACKAGE = ROOT / "bisar_budget"
MOST = 29
NAMES = frozenset(kind.name for kind in kinds() if isinstance(kind, SourceKind) and not kind.is_registered)

# Modules in which `kind` is another thing than a kind of error, or the name of a kind is that of another thing.
OTHER_THINGS = {
    "cli/sensors.py": "sorts of parts",
    "cluster/scheduler.py": "classes of Dask",
    "questions/cases.py": "types of NumPy, and words for a distribution of cases",
    "questions/compare.py": "sorts of parts, and their figures",
    "formats/importing.py": "types of NumPy",
    "questions/results.py": "formats of pictures",
    "mission/parts.py": "sorts of parts, and their figures",
    "mission/readers.py": "classes of sections",
    "mission/revision.py": "objects of git",
    "mission/tree.py": "events of YAML",
    "paths": "sorts of columns, messages and logs",
    "phrases/templates.py": "formats of quantities",
    "report/answers/diff_answer.py": "sorts of changes",
    "report/drawing/figure.py": "formats of pictures",
    "report/explain/notation.py": "nodes of a formula",
    "report/tables.py": "types of NumPy",
    "settings.py": "types of settings",
    "theory": "tables of the derivation",
}


def compared(node: ast.AST) -> list[ast.expr]:
    """Operands of a comparison, of a `match`, or of a test of the beginning or the end of a text."""
    if isinstance(node, ast.Compare):
        return [node.left, *node.comparators]
    if isinstance(node, ast.Match):
        patterns = [pattern for case in node.cases for pattern in ast.walk(case.pattern)]
        return [node.subject, *(pattern.value for pattern in patterns if isinstance(pattern, ast.MatchValue))]
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
        return node.args if node.func.attr in ("startswith", "endswith", "removeprefix", "removesuffix") else []
    return []


def comparisons() -> Iterator[tuple[str, str]]:
    """Module and text of each comparison in which an operand is a kind, or the name or a row id of one."""
    for path in sorted(PACKAGE.rglob("*.py")):
        module = path.relative_to(PACKAGE).as_posix()
        if any(module.startswith(other) for other in ("error_kinds/", *OTHER_THINGS)):
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if any(map(is_kind, compared(node))):
                yield module, ast.unparse(node).partition("\n")[0]


def is_kind(node: ast.expr) -> bool:
    if isinstance(node, ast.Tuple | ast.List | ast.Set | ast.JoinedStr):
        return any(map(is_kind, node.elts if not isinstance(node, ast.JoinedStr) else node.values))
    if isinstance(node, ast.Starred):
        return is_kind(node.value)
    if isinstance(node, ast.Constant):
        return isinstance(node.value, str) and not NAMES.isdisjoint(node.value.split("."))
    if isinstance(node, ast.Attribute):  # of a kind's object, or of a subject
        return node.attr == "kind" or (node.attr == "name" and is_kind_name(ast.unparse(node.value)))
    return isinstance(node, ast.Name) and is_kind_name(node.id)


def is_kind_name(name: str) -> bool:
    """Whether a variable holds a kind of error: `kind`, `state_kind`, `TIMING_KIND`, `error.kind`."""
    return name.lower().rpartition(".")[2].rpartition("_")[2] == "kind"


# By module, how many comparisons are left, and why.
LEFT = {
    "budget/declarations.py": (2, "words of `requirements.declare`, some of which are no kinds of a row"),
    "budget/doubts.py": (1, "the object of the kind, which the fixes of a log concern"),
    "questions/allocate.py": (1, "the last part of a key of the file, which is the name of a kind"),
    "questions/specified.py": (1, "sorts of parts"),
    "questions/varied.py": (3, "keys of an oscillator, and classes of sections"),
    "formats/collected.py": (10, "words of parameters of a CPHD file"),
    "formats/exporting.py": (3, "kinds that a CPHD file has elements for"),
    "mission/covariance.py": (1, "words in the names of correlated errors"),
    "mission/platforms.py": (1, "keys of the file that a covariance replaces"),
    "mission/quantities.py": (3, "steps of a path of keys"),
    "report/compliance/summary.py": (1, "an axis of the rows of an oscillator"),
    "report/change/fallen_effects.py": (1, "the same error in two missions"),
    "report/answers/allocate_answer.py": (1, "the last part of a key of the file, which is the name of a kind"),
}


def test_the_registry_alone_compares_names_of_kinds() -> None:
    found = list(comparisons())
    assert Counter(module for module, _ in found) == Counter(
        {module: count for module, (count, _) in LEFT.items()}
    ), found
    assert len(found) <= MOST


def test_a_comparison_is_seen_in_every_form() -> None:
    forms = (
        "kind == other",
        "subject.kind in names",
        "word == 'timing'",
        "name in ('position', 'velocity')",
        "row_id == 'timing.linear'",
        "row_id == f'{name}.oscillator'",
        "row_id.endswith('vibration.wideband')",
        "name == TIMING_KIND.name",
        "state_kind is POSITION_KIND",
        "match name:\n    case 'imu': ...",
    )
    unseen = [
        form for form in forms if not any(any(map(is_kind, compared(node))) for node in ast.walk(ast.parse(form)))
    ]
    assert unseen == []


def test_the_other_things_are_there() -> None:
    assert [name for name in OTHER_THINGS if not (PACKAGE / name).exists()] == []
    assert isinstance(PACKAGE, Path)
