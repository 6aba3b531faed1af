"""Sweeps over lever arms, time tags and common errors: each case as a check of its own has it."""

import pytest

import bisar_budget as bb
from bisar_budget.faults import MissionError, SetValue
from bisar_budget.mission.load import parse_mission
from tests.conftest import TODAY, by_turns
from tests.effects.test_navigation_frames import TURN
from tests.families import FAMILIES
from tests.families import mission_text as of_family
from tests.questions.test_sweep import assert_as_checked, grid, swept

ERROR = """{
      imu: {attitude: [0.02 mrad, 0.02 mrad, 0.2 mrad], gyro_bias: 1 deg/h, angle_random_walk: 0.01 deg/sqrt(h)},
      time_tag: 1 ms, lever_arm: {arm: [2 m, 0.3 m, -0.5 m], uncertainty: 5 mm}}"""
COMMON = """common_motion_error:
  {frame: track, position: 1 cm, time_tag: 1 ms, random: [{name: GNSS, sigma: 0.1 mm, correlation_time: 2 s}]}"""
TEXT = TURN.replace("ERROR", ERROR).replace("COMMON", COMMON)
OF_RECEIVER = "platforms__receiver__motion_error__"
ROWS = (
    *("receiver.imu.attitude", "receiver.imu.gyro_bias", "receiver.imu.angle_random_walk"),
    *("receiver.lever_arm.attitude", "receiver.lever_arm.uncertainty", "receiver.time_tag"),
    *("common.time_tag", "common.position.along", "common.velocity.cross", "common.random.GNSS"),
)
FIELDS = ("declared", "allowable", "utilization", "status", "qpe_published_rad", "cubic_rad")
# The cubic phase of a common position is what nearly cancels.
COLUMNS = [f"{row}.{field}" for row in ROWS for field in FIELDS if (row, field) != (ROWS[7], "cubic_rad")]


@pytest.mark.parametrize(
    "axes",
    [
        {f"{OF_RECEIVER}time_tag": [-2e-3, 1e-3, 0.5], "common_motion_error__time_tag": [-1e-3, 5e-2]},
        {f"{OF_RECEIVER}lever_arm__arm__0": [-2.0, 0.0, 30.0], f"{OF_RECEIVER}lever_arm__uncertainty": [0.0, 0.5]},
        {"common_motion_error__position": [0.01, 40.0], "common_motion_error__random__0__sigma": [1e-4, 1e-2]},
        {"platforms__receiver__acceleration__0": [-4.0, 0.0, 4.0], "collection__aperture_time": [1.0, 5.0]},
        {"platforms__receiver__velocity__1": [-20.0, 80.0], f"{OF_RECEIVER}imu__attitude__2": [0.0, 5e-3]},
    ],
)
def test_each_case_is_that_of_a_check(axes: dict[str, list[float]]) -> None:
    mission = parse_mission(TEXT, "m.yaml")
    cases = grid(mission, **axes)
    assert_as_checked(mission, cases, swept(mission, cases, COLUMNS), COLUMNS)


def test_keys_that_the_file_does_not_state() -> None:
    mission = parse_mission(TURN.replace("ERROR", "{position: 1 cm}").replace("COMMON", ""), "m.yaml")
    for key, value in (("time_tag", 1e-3), ("lever_arm__uncertainty", 5e-3)):
        cases = grid(mission, **{f"{OF_RECEIVER}{key}": [value, 3 * value]})
        assert_as_checked(mission, cases, swept(mission, cases))


EXTRAS = {
    "platforms.receiver.motion_error.time_tag": "2 ms",
    "platforms.transmitter.motion_error.lever_arm": "{arm: [1 m, 2 m, 3 m], uncertainty: 1 cm}",
    "platforms.transmitter.motion_error.imu": "{attitude: 1 mrad, angle_random_walk: 0.1 deg/sqrt(h)}",
    "common_motion_error": "{frame: look, velocity: 1 cm/s, time_tag: 1 ms}",
    "scene.radius": "300 m",
}
DIRECT_PATH = {"synchronization": "{error: 1 deg, method: direct_path}"}


@pytest.mark.parametrize(("family", "others"), by_turns(FAMILIES, ({}, DIRECT_PATH)))
@pytest.mark.parametrize("place", [0, pytest.param(1, marks=pytest.mark.thorough)], ids=["first", "second"])
def test_random_missions(family: str, others: dict[str, str], place: int) -> None:
    """With a scene's edge, of errors of any size, also where the direct path is the clock."""
    found = 0
    for seed in range(6):
        changes = [SetValue(key, value) for key, value in (EXTRAS | others).items()]
        try:
            mission = parse_mission(of_family(family, seed), "m.yaml", changes=changes)
        except MissionError:
            continue
        found += 1
        if found <= place:
            continue
        cases = grid(mission, platforms__receiver__motion_error__time_tag=[1e-4, 0.3], radar__bandwidth=[2e7, 4e7])
        rows = ("receiver.time_tag", "common.time_tag", "common.velocity.cross", "transmitter.imu.attitude")
        # Not what is searched for, which settles to 1e-7; the last step of a search for a point leaves 3e-5 rad.
        columns = [f"{row}.{field}" for row in rows for field in ("declared", "status", "qpe_published_rad")]
        assert_as_checked(mission, cases, swept(mission, cases, columns), columns, near=1e-5)
        return


def test_sensitivity_knows_the_numbers() -> None:
    changes = (
        SetValue("requirements.location_error", "5 cm"),
        SetValue("platforms.receiver.motion_error.time_tag", "1 ms"),
    )
    found = bb.sensitivity(parse_mission(TEXT, "m.yaml", changes=changes), date=TODAY)
    slopes = {one.key: one for one in found.slopes}
    assert slopes["platforms.receiver.motion_error.time_tag"].change > 0
    assert slopes["common_motion_error.time_tag"].change != 0
    assert "platforms.receiver.motion_error.lever_arm.uncertainty" in slopes
