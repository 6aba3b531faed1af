"""Hints about quantities of a mission: what is offered has the size that was typed."""

import pytest

from bisar_budget.faults import InvalidValueError, MissionError
from bisar_budget.mission.load import parse_mission
from bisar_budget.paths.instant import parse_instant
from bisar_budget.units import ANGLE, parse_quantity
from tests.conftest import mission_text

ERROR = "platforms__receiver__motion_error__"


def hint(**changes: object) -> tuple[str, str]:
    """What is accepted, and the hint, of the one fault of a mission."""
    with pytest.raises(MissionError) as caught:
        parse_mission(mission_text(**changes), "m.yaml")
    (fault,) = caught.value.faults
    return fault.accepted, fault.hint


@pytest.mark.parametrize(
    ("written", "offered"),
    [
        ("1 m, 2 m, 3 m", "Did you mean [1 m, 2 m, 3 m]?"),
        ("1m,2m,3m", "Did you mean [1m, 2m, 3m]?"),
        ("(1 m, 0, 3 mm)", "Did you mean [1 m, 0, 3 mm]?"),
        # [1, 2, 3 km] would be another size, and 1,234,567 m may be one number.
        ("1, 2, 3 km", "Write brackets, and the unit of each"),
        ("1,234,567 m", "Write a point"),
        ("1,5 m", "Write a point"),
    ],
)
def test_three_values_without_brackets(written: str, offered: str) -> None:
    assert hint(**{f"{ERROR}position": written})[1] == offered
    if "Did" in offered:  # what is offered is read
        parse_mission(mission_text(**{f"{ERROR}position": offered[len("Did you mean [") : -2].split(",")}))


def test_three_values_without_brackets_where_a_list_is_needed() -> None:
    assert hint(**{f"{ERROR}lever_arm": {"arm": "1 m, 2 m, 3 m"}})[1] == "Did you mean [1 m, 2 m, 3 m]?"


@pytest.mark.parametrize(
    ("written", "offered"),
    [
        ("1 m, 2 m, 3 m", "Did you mean [1 m, 2 m, 3 m]?"),
        ("1 m, 1 m, 1 m", "Did you mean [1 m, 1 m, 1 m]?"),
        ("-1 m, 0, .5 m, velocity: 0", "Did you mean [-1 m, 0, .5 m]?"),
        ("1, 2, 3 km", "A decimal is written with a point"),
        ("1,234 m", "A decimal is written with a point"),
    ],
)
def test_three_values_without_brackets_in_a_flow_mapping(written: str, offered: str) -> None:
    """YAML makes a key of each; block style offers the same."""
    text = mission_text() + f"\ncommon_motion_error: {{position: {written}}}\n"
    with pytest.raises(MissionError) as caught:
        parse_mission(text)
    (fault,) = caught.value.faults
    assert (fault.key, fault.hint) == ("common_motion_error.position", offered)
    if "Did" in offered:
        parse_mission(text.replace(written, offered[len("Did you mean ") : -1]))


def test_a_key_without_a_value_is_no_number() -> None:
    with pytest.raises(MissionError, match=r"velocity: has no value"):
        parse_mission(mission_text() + "\ncommon_motion_error: {position: 1 m, velocity}\n")


@pytest.mark.parametrize(
    ("amplitude", "offered"),
    [
        ("5 mil", "5 mil is 127 \N{MICRO SIGN}m"),
        ("0.01 in", "0.01 in is 254 \N{MICRO SIGN}m"),
        ("0.3 in/s", "0.3 in/s is 7.62 mm/s, a speed. A velocity divided by 2πf is a displacement"),
        ("3 mm/s", "A velocity divided by 2πf is a displacement"),
        ("3 gee", "3 gee is 29.41995 m/s², an acceleration. Write it in g or m/s^2"),
    ],
)
def test_amplitudes_of_vibration_tables(amplitude: str, offered: str) -> None:
    entry = {"frequency": "100 Hz", "amplitude": amplitude}
    accepted, said = hint(**{f"{ERROR}vibration": {"sinusoidal": [entry]}})
    assert said == offered
    assert accepted.endswith("or its acceleration in g, mg, ug, m/s^2")
    parse_mission(mission_text(**{f"{ERROR}vibration": {"sinusoidal": [entry | {"amplitude": "0.1 g"}]}}))


def test_noise_of_acceleration_is_a_spectrum() -> None:
    assert hint(**{f"{ERROR}vibration": {"wideband": {"rms": "0.1 g"}}})[1] == (
        "Noise of acceleration is a spectrum, in g^2/Hz"
    )


@pytest.mark.parametrize(
    ("written", "decimal"),
    [
        ("47°15'04.3\"", "47.251194444"),
        ("47°15'", "47.25"),
        ("47d15m", "47.25"),
        ("47d15m04.3s", "47.251194444"),
        ("47:15:04.3", "47.251194444"),
        ("-47:15:00", "-47.25"),
        ("47°15'00\"S", "-47.25"),
        ("0°30'00\"N", "0.5"),
    ],
)
def test_degrees_minutes_and_seconds_are_named(written: str, decimal: str) -> None:
    with pytest.raises(InvalidValueError) as error:
        parse_quantity(written, ANGLE)
    assert error.value.problem.problem == "is in degrees, minutes and seconds"
    assert error.value.problem.hint == f"Write {decimal} deg"


@pytest.mark.parametrize("written", ["47°75'", "47:15:75", "47 apples"])
def test_what_is_no_angle_is_no_angle_in_another_form(written: str) -> None:
    with pytest.raises(InvalidValueError) as error:
        parse_quantity(written, ANGLE)
    assert "unknown unit" in error.value.problem.problem


@pytest.mark.parametrize(
    "written", ["2026-06-01T06:20:31.250+01:00", "2026-06-01T06:20:31.250+0100", "2026-06-01T00:50:31.250-04:30"]
)
def test_an_instant_with_an_offset_is_that_of_utc(written: str) -> None:
    mission = parse_mission(mission_text(collection__center_time=written))
    assert mission.collection.center_time == parse_instant("2026-06-01T05:20:31.250Z")


def test_an_offset_goes_over_midnight() -> None:
    assert parse_instant("2026-06-01T00:30:00+01:00") == parse_instant("2026-05-31T23:30:00Z")
    assert parse_instant("2026-06-01T00:30:00+25:00") is None
    assert parse_instant("2026-06-01T00:30:00+01:75") is None


def test_an_instant_without_a_zone_says_that_it_is_missing() -> None:
    with pytest.raises(MissionError) as caught:
        parse_mission(mission_text(collection__center_time="2026-06-01T05:20:31"), "m.yaml")
    (fault,) = caught.value.faults
    assert fault.problem == "has no zone"
    assert fault.hint == "Write Z behind it where it is UTC, or the offset from UTC, such as +01:00"
