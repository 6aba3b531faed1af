"""Images at the limits of lever arms, time tags and common errors; a limit that is off is found."""

import pytest

from bisar_budget.mission.load import parse_mission
from bisar_budget.verifier import phase_cases
from bisar_budget.verifier.limits import cases
from bisar_budget.verifier.spread_cases import verify_random
from bisar_budget.verifier.study import Study
from tests.effects.test_navigation_frames import TURN
from tests.verify.test_random_errors import of, off

ERROR = """{
      imu: {attitude: [0.02 mrad, 0.02 mrad, 0.2 mrad]}, time_tag: 1 ms,
      lever_arm: {arm: [2 m, 0.3 m, -0.5 m], uncertainty: 5 mm}}"""
COMMON = "common_motion_error: {frame: track, position: 1 cm, time_tag: 1 ms}"
NEEDS = "{location_error: 10 m, islr: -20 dB}"


def study(needs: str = NEEDS) -> Study:
    text = TURN.replace("ERROR", ERROR).replace("COMMON", COMMON).replace(NEEDS, needs)
    return Study(parse_mission(text))


@pytest.mark.parametrize(
    "row_id", ["receiver.imu.attitude", "receiver.lever_arm.attitude", "receiver.lever_arm.uncertainty"]
)
@pytest.mark.parametrize("needs", [NEEDS, "{quadratic_phase_error: 170 deg, location_error: 20 cm}"])
def test_a_lever_arm(row_id: str, needs: str) -> None:
    """By the phase, and by the location."""
    one = study(needs)
    assert verify_random(one, of(one, row_id)).verdict == "confirmed"
    assert verify_random(one, off(of(one, row_id), 0.8)).verdict == "optimistic"


@pytest.mark.parametrize("row_id", ["receiver.time_tag", "common.time_tag", "common.position.along"])
def test_what_exact_ranges_follow(row_id: str) -> None:
    one = study()
    verdict = cases(one)[row_id]()
    assert verdict.verdict == "confirmed"
    assert verdict.measured_qpe_rad == pytest.approx(verdict.budget_rad, rel=0.05)
    assert verdict.measured_displacement_m == pytest.approx(verdict.displacement_full_m, abs=0.02)


def test_a_time_tag_by_the_location() -> None:
    one = study("{quadratic_phase_error: 170 deg, location_error: 1 m}")
    source = next(one for one in one.sources if one.id == "receiver.time_tag")
    verdict = phase_cases.location(one, 1.0)
    assert verdict.verdict == "confirmed"
    assert one.allowed(source)[1] == "location_error"
