"""Hints about quantities of a mission: what is offered has the size that was typed."""

import pytest

from bisar_budget.faults import MissionError
from bisar_budget.mission.load import parse_mission
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
