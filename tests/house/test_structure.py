"""The house rules of the code itself: floors, import cost, nothing of this machine."""

import ast
import importlib
import importlib.util
import subprocess
import sys
from collections import defaultdict
from functools import cache
from pathlib import Path
from types import ModuleType

import pytest

from tests.conftest import ROOT

PACKAGE = ROOT / "bisar_budget"
# An import goes to a lower floor, or stays inside its own room.
FLOORS = [
    {
        "",
        "constants",
        "extras",
        "faults",
        "notebook",
        "other_units",
        "phrases",
        "units",
        "resources",
        "settings",
        "workers",
    },
    {"geometry", "random_vector"},
    {"error_kinds"},
    {"image_plane"},
    {"theory", "evaluators", "catalogue"},
    {"paths", "navigation"},
    {"mission"},
    {"ranges"},
    {"effects"},
    {"analysis"},
    {"findings"},
    {"sampling"},
    {"budget"},
    {"simulator"},
    {"verifier"},
    {"formats"},
    {"cluster"},
    {"report"},
    {"questions"},
    {"cli"},
    {"__main__"},
]
MODULES = sorted(PACKAGE.rglob("*.py"))


def room(module: str) -> str:
    parts = module.split(".")
    return parts[1] if len(parts) > 1 else ""


def floor(name: str) -> int:
    return next(index for index, rooms in enumerate(FLOORS) if name in rooms)


@cache
def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def imports(path: Path) -> set[str]:
    found: set[str] = set()
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


# The door of the package names what lies behind it, on any floor, and imports it when it is asked for.
@pytest.mark.parametrize("path", [path for path in MODULES if path != PACKAGE / "__init__.py"], ids=module_name)
def test_imports_go_down(path: Path) -> None:
    here = room(module_name(path))
    for imported in imports(path):
        if imported.startswith("bisar_budget"):
            there = room(imported)
            there = there if any(there in rooms for rooms in FLOORS) else ""  # a name of the package itself
            is_ground = floor(here) == floor(there) == 0
            assert there == here or floor(there) < floor(here) or is_ground, f"{module_name(path)}: {imported}"


def test_no_name_of_the_front_door_is_that_of_a_room() -> None:
    """A room that is imported takes the place of a function of its name."""
    import bisar_budget

    assert all(getattr(bisar_budget, name) is not None for name in bisar_budget.__all__)
    rooms = {module_name(path).split(".")[1] for path in MODULES if path != PACKAGE / "__init__.py"}
    assert rooms.isdisjoint(bisar_budget.__all__)


# Rooms that compute; the command line asks the front door instead.
ENGINES = {"ranges", "effects", "analysis", "sampling", "budget", "simulator", "verifier", "cluster"}


def imported_for_use(path: Path) -> set[str]:
    """Modules that a module runs, those left out that only its types name."""
    tree = parsed(path)
    of_types = {
        id(node)
        for block in ast.walk(tree)
        if isinstance(block, ast.If) and getattr(block.test, "id", "") == "TYPE_CHECKING"
        for part in block.body
        for node in ast.walk(part)
    }
    return {
        str(node.module) for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and id(node) not in of_types
    }


@pytest.mark.parametrize("path", sorted((PACKAGE / "cli").glob("*.py")), ids=module_name)
def test_the_command_line_is_a_client_of_the_front_door(path: Path) -> None:
    assert not {name for name in imported_for_use(path) if room(name) in ENGINES}


def door(name: str) -> set[str]:
    """What a room lets others use: names of its modules, or, of `report`, what its `__init__` defines."""
    tree = parsed(PACKAGE / name / "__init__.py")
    (named,) = [
        node.value
        for node in tree.body
        if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "__all__"
    ]
    return set(ast.literal_eval(named))


def test_a_room_is_entered_by_its_door() -> None:
    """Each module that another room uses is named in `__all__` of its own room, and no other is."""
    used: dict[str, set[str]] = {}
    for path in MODULES:
        for imported in imports(path):
            parts = imported.split(".")
            there = room(imported)
            if len(parts) > 2 and (PACKAGE / there).is_dir() and there != room(module_name(path)):
                used.setdefault(there, set()).add(parts[2])
    rooms = {path.parent.name for path in PACKAGE.glob("*/__init__.py")} - {"cli", "report", "phrases"}
    assert {name: door(name) for name in rooms} == {name: used[name] for name in rooms}


def test_the_sentences_that_others_use_are_the_door_of_phrases() -> None:
    used: set[str] = set()
    for path in MODULES:
        if room(module_name(path)) == "phrases":
            continue
        for node in ast.walk(parsed(path)):
            if isinstance(node, ast.Attribute) and ast.unparse(node.value) == "phrases":
                used.add(node.attr)
            elif isinstance(node, ast.ImportFrom) and room(str(node.module)) == "phrases":
                assert node.module == "bisar_budget.phrases", path
                used |= {alias.name for alias in node.names}
    assert door("phrases") == used


@pytest.mark.parametrize("path", MODULES, ids=module_name)
def test_only_theory_imports_sympy(path: Path) -> None:
    if any(name.split(".")[0] == "sympy" for name in imports(path)):
        assert room(module_name(path)) == "theory"


@pytest.mark.parametrize("path", MODULES, ids=module_name)
def test_only_the_command_prints(path: Path) -> None:
    if room(module_name(path)) == "cli":
        return
    for node in ast.walk(parsed(path)):
        assert not (isinstance(node, ast.Call) and getattr(node.func, "id", "") == "print")


HEAVY = ("sympy", "numba", "matplotlib", "jinja2", "mpmath", "sarkit", "lxml", "pyarrow", "netCDF4")


def loaded_after(code: str) -> set[str]:
    done = subprocess.run(
        [sys.executable, "-c", f"{code}\nimport sys; print(*sys.modules)"],
        capture_output=True,
        text=True,
        cwd=ROOT,
        check=True,
    )
    return set(done.stdout.split())


def test_importing_the_command_is_cheap() -> None:
    loaded = loaded_after("import bisar_budget.cli.check")
    assert not loaded & {*HEAVY, "numpy", "yaml", "pathlib", "tomllib"}


@pytest.mark.parametrize("is_for_people", [False, True])
@pytest.mark.parametrize("name", ["rigling_moses_section_v", "drones_same_gnss"])
def test_a_check_loads_nothing_heavy(name: str, is_for_people: bool) -> None:
    """Compliance reports are laid out by jinja2; they too derive nothing and plot nothing."""
    mission = ROOT / "specs" / "missions" / f"{name}.yaml"
    code = f"""
from bisar_budget.budget.check import check_mission
from bisar_budget.mission.load import load_mission
from bisar_budget.report import FORMATS, Style, render
from bisar_budget.findings.mission import Report
from datetime import date
found = check_mission(load_mission({str(mission)!r}), date(2026, 1, 1))
for name in [one.name for one in FORMATS.values() if one.is_illustrated == {is_for_people} and not one.is_binary]:
    render(name, Report(version="", missions=(found,)), Style())
"""
    loaded = loaded_after(code)
    assert not loaded & ({*HEAVY} - ({"jinja2"} if is_for_people else set()))
    assert "bisar_budget.paths.path_formats" not in loaded  # the readers of logs: 5 % of the start


# Rooms whose modules are beside those of another: the command, the derivation.
BESIDE = {"cli", "theory"}


def is_submodule(package: ModuleType, name: str) -> bool:
    return hasattr(package, "__path__") and importlib.util.find_spec(f"{package.__name__}.{name}") is not None


@pytest.mark.parametrize("path", sorted((ROOT / "benchmarks").glob("*.py")), ids=lambda path: path.stem)
def test_a_benchmark_imports_names_that_the_package_has(path: Path) -> None:
    """Nothing else runs them: one imported a table that had been removed."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("bisar_budget"):
            module = importlib.import_module(str(node.module))
            for alias in node.names:
                assert hasattr(module, alias.name) or is_submodule(module, alias.name), f"{node.module}.{alias.name}"


def test_no_name_has_two_meanings() -> None:
    """A class has its name alone, and so has a module, but those that stand beside another by design."""
    classes, modules = defaultdict(list), defaultdict(list)
    for path in MODULES:
        tree = parsed(path)
        names = {node.name for node in ast.walk(tree) if isinstance(node, ast.ClassDef)}
        for name in names:
            classes[name].append(room(module_name(path)))
        if path.stem not in ("__init__", "compiled"):  # kernels, of images and of draws
            modules[path.stem].append(room(module_name(path)))
    for name, rooms in (*classes.items(), *modules.items()):
        assert len([one for one in rooms if one not in BESIDE]) <= 1, (name, rooms)
        assert len(set(rooms)) == len(rooms), (name, rooms)


@pytest.mark.parametrize("path", MODULES, ids=module_name)
def test_docstrings_say_what_a_thing_is_or_returns(path: Path) -> None:
    kinds = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    said = (ast.get_docstring(node) or "" for node in ast.walk(parsed(path)) if isinstance(node, kinds))
    assert [text for text in said if text.startswith(("Of ", "What "))] == []
