"""Shared test helpers: missions built from a base by replacement, rows found by id."""

import copy
import gc
import math
import os
import signal
from collections.abc import Callable, Sequence
from datetime import date
from functools import lru_cache
from inspect import signature
from pathlib import Path
from typing import Any

# Processes that test side by side have a core each: threads that wait for each other there take time from the others.
# Read by NumPy's algebra, finufft and Numba when they are imported.
if "PYTEST_XDIST_WORKER" in os.environ:
    for _library in ("OPENBLAS", "OMP", "MKL", "NUMBA"):
        os.environ.setdefault(f"{_library}_NUM_THREADS", "1")

import numpy as np
import pytest
from click.testing import CliRunner, Result
from hypothesis import settings

from bisar_budget.budget.check import check_mission
from bisar_budget.cli import cli
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.row import Row
from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.report import FORMATS
from tests.yaml_text import yaml_text

TEXT_FORMATS = tuple(name for name, entry in FORMATS.items() if not entry.is_binary)

# Shared machines: how long an example takes says nothing. `-m thorough` loads the second profile (see `examples`).
_DEFAULT_EXAMPLES, _THOROUGH_EXAMPLES = 20, 100
settings.register_profile("default", deadline=None, max_examples=_DEFAULT_EXAMPLES)
settings.register_profile("thorough", deadline=None, max_examples=_THOROUGH_EXAMPLES)
settings.load_profile("default")


def examples(count: int, default: int | None = None, **options: Any) -> settings:
    """Settings of a Hypothesis test with a number of examples of its own.

    Parameters
    ----------
    count : int
        Examples of `-m thorough`.
    default : int, optional
        Examples of every other run; without it a fifth of `count`, at least 10.
    **options
        Other settings.
    """
    fewer = min(count, max(10, count // 5) if default is None else default)
    is_thorough = settings().max_examples == _THOROUGH_EXAMPLES
    return settings(max_examples=count if is_thorough else fewer, deadline=None, **options)


def seeds(count: int, default: int, *found: int) -> list[Any]:
    """Seeds 0 to `count` − 1 as parameters: the first ones, and those that once found a defect, in every run.

    The others are marked `thorough`.
    """
    always = {*range(default), *found}
    return [seed if seed in always else pytest.param(seed, marks=pytest.mark.thorough) for seed in range(count)]


def by_turns(items: Sequence[Any], ways: Sequence[Any], *always: Any) -> list[Any]:
    """Pairs of parameters: each item in one of the ways by turns, or in all of them if it is one of `always`.

    The other pairs are marked `thorough`.
    """
    return [
        pytest.param(item, way, marks=() if item in always or number % len(ways) == turn else pytest.mark.thorough)
        for number, item in enumerate(items)
        for turn, way in enumerate(ways)
    ]


def name_of(value: Any) -> str | None:
    """Id of a parameter: the name of a file without its ending, or pytest's own."""
    return value.stem if isinstance(value, Path) else None


# Files that take longest; begun last, one core would wait for them. The first waits more than it computes.
_FIRST = (
    *("test_scheduler.py", "test_compliance_page.py", "test_hostile.py", "test_gate.py", "test_cphd.py"),
    *("test_sweep.py", "test_scene_edge.py", "test_processors.py", "test_allocate.py", "test_point.py"),
    *("test_front_door.py", "test_navigation_sweep.py", "test_any_size.py", "test_symmetries.py"),
    *("test_report_explanation.py", "test_fallen_effects.py", "test_random_errors.py", "test_report_compliance.py"),
)


def pytest_configure(config: pytest.Config) -> None:
    """Give Hypothesis as many examples as are asked for, before test modules are imported."""
    if _is_thorough(config):
        settings.load_profile("thorough")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out tests that are marked `thorough` unless they are asked for, and begin with what takes longest.

    Tests by Hypothesis have more examples in a thorough run, so they belong to it too.
    """
    for item in items:
        if _is_thorough(config) and getattr(getattr(item, "obj", None), "is_hypothesis_test", False):
            item.add_marker("thorough")
    left_out = [item for item in items if item.get_closest_marker("thorough") and not _is_thorough(config)]
    if left_out:
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if not item.get_closest_marker("thorough")]
    place = {name: number for number, name in enumerate(_FIRST)}
    items.sort(key=lambda item: place.get(item.path.name, len(place)))


def _is_thorough(config: pytest.Config) -> bool:
    """Whether `-m` names the marker."""
    return "thorough" in (config.getoption("markexpr") or "")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int | None:
    """One process more than cores: some tests wait for a browser, a scheduler or a command."""
    return None if "PYTEST_XDIST_AUTO_NUM_WORKERS" in os.environ else (os.cpu_count() or 1) + 1


def pytest_collection_finish() -> None:
    """Leave what was imported and collected out of every later collection of garbage."""
    gc.collect()
    gc.freeze()


_is_patched = False  # whether the test of now may put something into the package


def pytest_runtest_setup(item: pytest.Item) -> None:
    """A test that puts something into the package finds it in its findings, and no other test does."""
    global _is_patched
    _is_patched = "monkeypatch" in getattr(item, "fixturenames", ())


_approx = pytest.approx


def approx(expected: Any, rel: float | None = None, abs: float | None = None, nan_ok: bool = False) -> Any:
    """`pytest.approx` without its absolute tolerance of 1e-12 where all that is expected is smaller than 1e-6.

    A clock error of 3e-13 would else equal any other: the share that it is held to could be another one's.
    """
    if abs is None:
        values = list(expected.values()) if isinstance(expected, dict) else expected
        try:
            largest = np.abs(np.asarray(values)).max(initial=0.0)
        except (TypeError, ValueError):
            largest = math.inf  # not numbers alone
        if 0 < largest < 1e-6:
            rel, abs = 1e-6 if rel is None else rel, 0.0  # given an absolute one alone, pytest drops the relative
    return _approx(expected, rel=rel, abs=abs, nan_ok=nan_ok)


pytest.approx = approx

# Standard error apart from standard output: Click before 8.2 has to be asked.
# Tables for a terminal have the width of COLUMNS.
os.environ.pop("COLUMNS", None)

APART: Any = {"mix_stderr": False} if "mix_stderr" in signature(CliRunner).parameters else {}

ROOT = Path(__file__).resolve().parent.parent
TODAY = date(2026, 11, 21)

# A mission for tests alone, whose inertial unit runs free over the aperture: rows `imu` and `random`.
UAV_FREE_RUNNING = ROOT / "tests" / "missions" / "uav_free_running.yaml"

# Round numbers, both platforms at broadside, so that expectations can be written down by hand.
BASE: dict[str, Any] = {
    "schema_version": 1,
    "name": "base",
    "radar": {"center_frequency": "10 GHz", "bandwidth": "300 MHz"},
    "collection": {"aperture_time": "6 s"},
    "platforms": {
        "transmitter": {"position": ["30 km", 0, "6 km"], "velocity": [0, "150 m/s", 0]},
        "receiver": {"position": ["6 km", "6 km", "2 km"], "velocity": ["-40 m/s", "40 m/s", 0]},
    },
}

# Changes of the base mission with which it declares an error and complies: one that declares nothing is not judged.
COMPLIES: dict[str, Any] = {"platforms__receiver__motion_error__velocity": "5 mm/s"}

# What expectations written down by hand hold for: closed formulas, one error at a time. Tests of the full model and
# of errors together say so.
PAPER = {"model": "published", "combine": "each"}

ANGLES = ("azimuth", "elevation", "motion_azimuth", "quadratic_phase_error", "cubic_phase_error")


def with_radians(value: Any, key: str = "") -> Any:
    """Write the unit behind angles that a test gives as numbers; what it gives as text stays as it is."""
    if isinstance(value, dict):
        return {name: with_radians(item, name) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [with_radians(item) for item in value]
    return f"{value} rad" if key in ANGLES and isinstance(value, int | float) else value


def mission_text(**changes: Any) -> str:
    """Return the base mission as YAML with `a__b=value` putting a value at the path a.b.

    What a test does not say of `allocation` is as the paper has it; the section stands at the end of the file.
    """
    tree = copy.deepcopy(BASE)
    for path, value in changes.items():
        *parents, last = path.split("__")
        node = tree
        for key in parents:
            node = node.setdefault(key, {})
        node[last] = value
    if isinstance(rules := tree.get("allocation", {}), dict):
        tree["allocation"] = rules | {key: rule for key, rule in PAPER.items() if key not in rules}
    return yaml_text(with_radians(tree), allow_unicode=True)


def findings(**changes: Any) -> MissionFindings:
    """Check the base mission with changes."""
    check = _findings_of.__wrapped__ if _is_patched else _findings_of
    return check(mission_text(**changes))


def mission_file(name: str) -> Path:
    """Path of a mission of the repository by its name: an example, or a mission for tests alone."""
    folders = (ROOT / "specs" / "missions", ROOT / "tests" / "missions")
    (path,) = [folder / f"{name}.yaml" for folder in folders if (folder / f"{name}.yaml").is_file()]
    return path


def found_in(path: Path, model: str | None = None) -> MissionFindings:
    """Check a mission file of the repository."""
    assert path.is_relative_to(ROOT)  # what is there stays as it is
    check = _found_in.__wrapped__ if _is_patched else _found_in
    return check(path, model)


# Findings cannot be changed, and many tests ask for the same ones: all examples by each of three models.
@lru_cache(maxsize=64)
def _findings_of(text: str) -> MissionFindings:
    return check_mission(parse_mission(text, "mission.yaml"), TODAY)


@lru_cache(maxsize=160)
def _found_in(path: Path, model: str | None) -> MissionFindings:
    return check_mission(load_mission(str(path), model), TODAY)


def row(found: MissionFindings, row_id: str) -> Row:
    """Find a row by id."""
    (match,) = [row for row in found.rows if row.id == row_id]
    return match


@pytest.fixture
def run() -> Callable[..., Result]:
    """Run the command line in this process."""

    def invoke(*args: str, **options: Any) -> Result:
        return CliRunner(**APART).invoke(cli, [str(arg) for arg in args], **options)

    return invoke


def heed_signals() -> None:
    """In a child before it starts: undo what a runner in the background ignores, SIGINT and SIGHUP."""
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)
