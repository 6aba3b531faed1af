"""`allocation.specify`: keys with weights, or a list of keys; what is none of them is a fault in its place."""

import pytest

from bisar_budget.faults import MissionError, SetValue
from bisar_budget.mission.load import parse_mission
from tests.conftest import mission_text

KEY = "platforms.receiver.motion_error.velocity"


def faults(specify: object) -> list[str]:
    with pytest.raises(MissionError) as error:
        parse_mission(mission_text(allocation__specify=specify), "m.yaml")
    assert all(fault.line is not None for fault in error.value.faults)
    return error.value.lines()


def test_keys_have_their_weights_and_those_of_a_list_one() -> None:
    for specify, weight in (({KEY: 2}, 2.0), ([KEY], 1.0), ({KEY: "0.5"}, 0.5)):
        assert parse_mission(mission_text(allocation__specify=specify)).allocation.specify == {KEY: weight}
    assert parse_mission(mission_text()).allocation.specify == {}


@pytest.mark.parametrize(
    ("specify", "said"),
    [
        ({KEY: 0}, "must be greater than 0"),
        ({KEY: -1}, "must be greater than 0"),
        ({KEY: "much"}, "must be a number (got much)"),
        ([KEY, KEY], "is given twice"),
        ("velocity", "must be keys with their weights, or a list of keys"),
        ([f"{KEY}s"], f"names no key of a mission file; accepted: a key of an error with one number, such as {KEY}"),
        (["velocity"], "names no key of a mission file"),
        ({"radar.bandwidth": 1}, "names no error that can be specified"),
        ({"synchronization.age": 1}, "names no error that can be specified"),
        ([["a"]], "must be text"),
    ],
)
def test_what_is_no_key_of_an_error_or_no_weight_is_a_fault(specify: object, said: str) -> None:
    (line,) = faults(specify)
    assert "allocation.specify" in line
    assert said in line


def test_a_key_that_is_misspelt_is_told_which_was_meant() -> None:
    (line,) = faults([f"{KEY}s"])
    assert f"Did you mean '{KEY}'?" in line


def test_an_option_gives_one_key_its_weight() -> None:
    changes = [SetValue(f"allocation.specify.{KEY}", "2"), SetValue("allocation.specify.timing_error.quadratic", "3")]
    found = parse_mission(mission_text(), "m.yaml", changes=changes).allocation.specify
    assert found == {KEY: 2.0, "timing_error.quadratic": 3.0}
