"""Bounds that a verdict rests on."""

from collections.abc import Callable
from pathlib import Path

import pytest

import bisar_budget as bb
from bisar_budget.faults import Fault, MissionError
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.quantities import QuestionError, number_of, range_of, tree_of
from tests.conftest import TODAY, mission_text

RECEIVER = "platforms__receiver__"
ERROR = f"{RECEIVER}motion_error__"
OF_RECEIVER = "platforms.receiver."
LINK = {"interval": "200 ms"}
NOISE = {"frequency": "10 MHz", "power_law": {"h0": "1e-24"}}
OTHER = {"name": "antenna", "quadratic_phase_error": "1 deg"}


def faults(**changes: object) -> tuple[Fault, ...]:
    with pytest.raises(MissionError) as caught:
        parse_mission(mission_text(**changes), "m.yaml")
    # Logs that these missions name are not there, which is said beside it.
    return tuple(fault for fault in caught.value.faults if "cannot be read: No such file" not in fault.problem)


@pytest.mark.parametrize(("value", "is_valid"), [("0.999999", False), ("0.5", False), ("1", True), ("1.01", True)])
def test_a_coverage_factor_is_at_least_one(value: str, is_valid: bool) -> None:
    text = mission_text(allocation__coverage_factor=value)
    if is_valid:
        assert parse_mission(text).allocation.coverage_factor == float(value)
        return
    (fault,) = faults(allocation__coverage_factor=value)
    assert (fault.key, fault.problem) == ("allocation.coverage_factor", "must be at least 1")


@pytest.mark.parametrize(
    ("value", "is_valid"), [("89.9 deg", True), ("1.57 rad", True), ("90 deg", False), ("1.58 rad", False)]
)
@pytest.mark.parametrize("link", [{"interval": "200 ms"}, {"method": "direct_path"}])
def test_a_link_is_wrong_by_less_than_a_quarter_of_a_turn(link: dict[str, str], value: str, is_valid: bool) -> None:
    changes = {"synchronization": link | {"error": value}}
    if is_valid:
        assert parse_mission(mission_text(**changes)).synchronization is not None
        return
    (fault,) = faults(**changes)
    assert (fault.key, fault.problem) == ("synchronization.error", "must be less than 90 deg")


@pytest.mark.parametrize(("between", "is_valid"), [("0.5..3", False), ("0.999..3", False), ("1..3", True)])
def test_nobody_solves_below_a_coverage_factor_of_one(between: str, is_valid: bool) -> None:
    mission = parse_mission(mission_text(allocation__coverage_factor="2"), "m.yaml")
    number = number_of(tree_of(mission), "allocation.coverage_factor")
    assert range_of(number, None)[:2] == (1.0, 20.0)
    if is_valid:
        assert range_of(number, between).low == 1.0
        return
    with pytest.raises(QuestionError, match="must be at least 1"):
        range_of(number, between)


@pytest.mark.parametrize(("values", "code"), [("0.9,1,2", 2), ("1,2", 0)])
def test_nobody_sweeps_below_a_coverage_factor_of_one(run: Callable, tmp_path: Path, values: str, code: int) -> None:
    file = tmp_path / "mission.yaml"
    file.write_text(mission_text(platforms__receiver__motion_error__velocity="1 mm/s"))
    found = run("sweep", str(file), "--vary", f"allocation.coverage_factor={values}")
    assert found.exit_code == code
    assert ("'0.9' must be at least 1" in found.stderr) == bool(code)


def test_at_a_coverage_factor_of_one_a_slope_is_that_above() -> None:
    changes = {"platforms__receiver__motion_error__velocity": "1 mm/s", "allocation__coverage_factor": "1"}
    found = bb.sensitivity(parse_mission(mission_text(**changes), "m.yaml"), date=TODAY)
    (slope,) = (slope for slope in found.slopes if slope.key == "allocation.coverage_factor")
    assert slope.difference == "forward"
    assert slope.change == pytest.approx(0.01 * found.utilization, rel=1e-6)
