"""Keys of lever arms, time tags and common errors: what is read, and what is refused."""

import pytest

from bisar_budget.faults import Fault, MissionError
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.model import mission_schema
from tests.conftest import mission_text

ERROR = "platforms__receiver__motion_error__"
OF_RECEIVER = "platforms.receiver.motion_error."


def faults(**changes: object) -> tuple[Fault, ...]:
    with pytest.raises(MissionError) as caught:
        parse_mission(mission_text(**changes), "m.yaml")
    return caught.value.faults


def test_what_is_read() -> None:
    arm = {"arm": ["2 m", "-10 cm", 0], "uncertainty": "5 mm", "source": "survey"}
    text = mission_text(**{f"{ERROR}lever_arm": arm, f"{ERROR}time_tag": "-1 ms"})
    error = parse_mission(text).platforms.receiver.motion_error
    assert error.lever_arm == ((2.0, -0.1, 0.0), (0.005, 0.005, 0.005), "survey")
    assert error.time_tag == -1e-3


@pytest.mark.parametrize(
    ("changes", "key", "problem"),
    [
        ({f"{ERROR}lever_arm": {}}, "lever_arm", "is empty"),
        ({f"{ERROR}lever_arm": {"source": "survey"}}, "lever_arm", "is empty"),
        ({f"{ERROR}lever_arm": {"arm": ["2 m", 0]}}, "lever_arm.arm", "must be three components, 2 given"),
        ({f"{ERROR}lever_arm": {"arm": "2 m"}}, "lever_arm.arm", "must be three components"),
        ({f"{ERROR}lever_arm": {"arm": ["2 m", 0, "2 km"]}}, "lever_arm.arm[2]", "must be at most"),
        ({f"{ERROR}lever_arm": {"uncertainty": "-5 mm"}}, "lever_arm.uncertainty", "must be at least 0 m"),
        ({f"{ERROR}lever_arm": {"uncertainty": "5 ms"}}, "lever_arm.uncertainty", ""),
        ({f"{ERROR}lever_arm": {"uncertainty": 0, "arms": [0, 0, 0]}}, "lever_arm.arms", "is not a known key"),
        ({f"{ERROR}time_tag": "1 m"}, "time_tag", ""),
        ({f"{ERROR}time_tag": "2000 s"}, "time_tag", "must be at most"),
        ({f"{ERROR}time_tag": ["1 ms", 0, 0]}, "time_tag", ""),
    ],
)
def test_what_is_refused(changes: dict[str, object], key: str, problem: str) -> None:
    (fault, *others) = faults(**changes)
    assert not others
    assert fault.key == OF_RECEIVER + key
    assert problem in fault.problem
    assert fault.line is not None


@pytest.mark.parametrize("velocity", [[0, 0, "10 m/s"], ["1 mm/s", 0, "10 m/s"]])
def test_a_body_that_flies_straight_up_has_no_axes(velocity: list[object]) -> None:
    (fault,) = faults(
        platforms__receiver__velocity=velocity, **{f"{ERROR}lever_arm": {"uncertainty": "5 mm"}}
    )  # fmt: skip
    assert fault.key == f"{OF_RECEIVER}lever_arm"
    assert "stops or is vertical" in fault.problem


def test_nor_has_one_that_stops_within_the_aperture() -> None:
    (fault,) = faults(
        platforms__receiver__velocity=["10 m/s", 0, 0],
        platforms__receiver__acceleration=["-10 m/s^2", 0, 0],
        **{f"{ERROR}lever_arm": {"uncertainty": "5 mm"}},
    )
    assert fault.key == f"{OF_RECEIVER}lever_arm"


class TestCommon:
    @pytest.mark.parametrize("frame", ["track", "look"])
    def test_every_frame_is_read(self, frame: str) -> None:
        text = mission_text(common_motion_error={"frame": frame, "position": "1 m", "time_tag": "1 ms"})
        assert parse_mission(text).common_motion_error.frame == frame

    def test_a_still_platform_has_no_track(self) -> None:
        (fault,) = faults(
            common_motion_error={"frame": "track", "position": "1 m"}, platforms__receiver__velocity=[0, 0, 0]
        )
        assert fault.key == "common_motion_error.frame"
        assert fault.problem == "of the receiver: a still platform has no track frame"

    def test_ric_needs_a_place_on_the_earth(self) -> None:
        found = faults(common_motion_error={"frame": "ric", "position": "1 m"})
        assert {fault.key for fault in found} == {"common_motion_error.frame"}
        place = {"latitude": "47 deg", "longitude": "6 deg", "height": "0 m"}
        mission = parse_mission(mission_text(common_motion_error={"frame": "ric", "position": "1 m"}, scene=place))
        assert mission.common_motion_error.frame == "ric"

    def test_names_are_of_one_each(self) -> None:
        one = {"name": "GNSS", "sigma": "1 cm", "correlation_time": "2 s"}
        (fault,) = faults(common_motion_error={"random": [one, one]})
        assert fault.key == "common_motion_error.random[1].name"

    def test_an_unknown_frame_is_told_the_known_ones(self) -> None:
        (fault,) = faults(common_motion_error={"frame": "body"})
        assert fault.accepted == "accepted: scene, track, look, ric"


def test_the_schema_has_them() -> None:
    definitions = mission_schema()["definitions"]
    assert set(definitions["LeverArm"]["properties"]) == {"arm", "uncertainty", "source"}
    assert {"time_tag", "lever_arm"} <= set(definitions["MotionError"]["properties"])
    common = definitions["CommonMotionError"]["properties"]
    assert common["frame"]["enum"] == ["scene", "track", "look", "ric"]
    assert {"random", "time_tag"} <= set(common)
