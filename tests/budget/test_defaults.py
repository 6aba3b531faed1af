"""How a file is judged that says nothing of `allocation`: by the full model, its errors together."""

import copy
import json
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from bisar_budget.budget.check import check_mission
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.model import mission_schema
from bisar_budget.mission.quantities import tree_of
from bisar_budget.questions.asked import Asked
from bisar_budget.questions.cases import grid_of
from tests.conftest import BASE, PAPER, ROOT, TODAY, row

SQUINT = math.radians(50)  # of the transmitter, which flies level


def text_of(rules: dict[str, Any] | None = None, **motion_errors: Any) -> str:
    """Return the base mission, its transmitter at a squint, with `allocation` only where rules are given."""
    tree = copy.deepcopy(BASE)
    platforms = tree["platforms"]
    platforms["transmitter"]["velocity"] = [-150 * math.sin(SQUINT), 150 * math.cos(SQUINT), 0]
    for name, error in motion_errors.items():
        platforms[name]["motion_error"] = error
    if rules is not None:
        tree["allocation"] = rules
    return yaml.safe_dump(tree)


def found_in(rules: dict[str, Any] | None = None, **motion_errors: Any) -> MissionFindings:
    return check_mission(parse_mission(text_of(rules, **motion_errors)), TODAY)


def together(factor: float) -> dict[str, Any]:
    """Two errors of the receiver with equal phases, whose root-sum-square is a factor times its limit."""
    limits = [row(found_in(), f"receiver.acceleration.{axis}").allowable for axis in "xy"]
    return {"acceleration": [*(factor / math.sqrt(2) * (limit or 0.0) for limit in limits), 0]}


def test_the_defaults_are_the_full_model_and_the_root_sum_square() -> None:
    rules = parse_mission(text_of()).allocation
    assert (rules.model, rules.combine) == ("full", "rss")
    assert (found_in().model, found_in().combine) == ("full", "rss")
    schema = json.dumps(mission_schema())
    assert '"default": "full"' in schema
    assert '"default": "rss"' in schema


@pytest.mark.parametrize("rules", [None, {}, {"coverage_factor": 1}, {"model": "full", "combine": "rss"}])
def test_a_file_without_the_section_or_its_keys_is_judged_the_same(rules: dict[str, Any] | None) -> None:
    errors = {"transmitter": {"velocity": "3 cm/s"}, "receiver": {"acceleration": "1 mm/s^2"}}
    stated = found_in({"model": "full", "combine": "rss"}, **errors)
    found = found_in(rules, **errors)
    assert [(one.id, one.status, one.declared, one.allowable) for one in found.rows] == [
        (one.id, one.status, one.declared, one.allowable) for one in stated.rows
    ]
    assert found.warnings == stated.warnings


@pytest.mark.parametrize(
    ("velocity", "by_default", "by_the_paper"),
    [
        ([0, 0, 0.3], "pass", "pass"),
        ([0, 0, 0.4], "fail", "warn"),  # the published model knows no limit of it
        ([0.1, 0, 0], "warn", "fail"),  # by the paper five times too strict; what it says is a warning
    ],
)
def test_a_squint_is_judged_by_exact_ranges(velocity: list[float], by_default: str, by_the_paper: str) -> None:
    error = {"transmitter": {"velocity": velocity}}
    id_ = f"transmitter.velocity.{'xyz'[max(range(3), key=velocity.__getitem__)]}"
    rules = {"warn_above": 1}
    assert row(found_in({"combine": "each", **rules}, **error), id_).status == by_default
    assert found_in(rules, **error).status == by_default
    assert row(found_in({**PAPER, **rules}, **error), id_).status == by_the_paper


@pytest.mark.parametrize(("factor", "status"), [(0.99, "pass"), (1.01, "fail")])
def test_errors_that_pass_alone_are_held_together(factor: float, status: str) -> None:
    errors, rules = together(factor), {"warn_above": 1}
    found = found_in(rules, receiver=errors)
    assert row(found, "receiver.quadratic_phase_error").utilization == pytest.approx(factor, rel=1e-3)
    assert found.status == status
    alone = found_in({**rules, "combine": "each"}, receiver=errors)
    assert [row(alone, f"receiver.{kind}").status for kind in ("acceleration.x", "acceleration.y")] == 2 * ["pass"]


def test_a_sweep_judges_such_a_file_likewise() -> None:
    """Arrays and floats read the same defaults."""
    mission = parse_mission(text_of(receiver={"velocity": "1 cm/s"}))
    cases = grid_of(tree_of(mission), {"collection.aperture_time": [3.0, 6.0]})
    column = "receiver.quadratic_phase_error.utilization"
    (part,) = Asked(mission, cases, columns=[column], today=TODAY).checked().parts
    one = row(check_mission(mission, TODAY), "receiver.quadratic_phase_error")
    assert part.values[column][1] == pytest.approx(one.utilization, rel=1e-9)


def test_a_direct_path_gates_as_the_default_does_and_warns_of_nothing() -> None:
    heard = "synchronization: {method: direct_path, error: 1 deg}\n"
    found = check_mission(parse_mission(text_of(receiver={"velocity": "1 mm/s"}) + heard), TODAY)
    assert found.model == "full"
    assert found.warnings == ()


def test_the_starter_file_states_them(run: Callable[..., Any]) -> None:
    allocation = yaml.safe_load(run("init", "-").stdout)["allocation"]
    assert (allocation["model"], allocation["combine"]) == ("full", "rss")


@pytest.mark.parametrize("path", sorted((ROOT / "specs" / "missions").glob("*.yaml")), ids=lambda path: path.stem)
def test_an_example_states_what_it_means(path: Path) -> None:
    """The paper's own by the paper's model, each error alone; none depends on a default."""
    allocation = yaml.safe_load(path.read_text(encoding="utf-8"))["allocation"]
    assert {"model", "combine"} <= allocation.keys()
    if re.match("rigling_moses", path.stem):
        assert {key: allocation[key] for key in PAPER} == PAPER
