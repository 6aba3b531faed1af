"""Keys that do nothing in their mission: a warning says so, and nothing where something makes them work."""

from typing import Any

import pytest

import bisar_budget as bb
from bisar_budget.faults import MissionError
from tests.conftest import findings, mission_text

RECEIVER = "platforms__receiver__"
SENSITIVE = {f"{RECEIVER}oscillator": {"power_law": {"h0": 1e-26}, "acceleration_sensitivity": "1e-9 /g"}}
SHAKEN = {"vibration": {"sinusoidal": [{"amplitude": "1 um", "frequency": "20 Hz"}]}}
HOLDOVER = {"synchronization": {"method": "holdover", "age": "60 s", "averaging": "10 s"}}
BOTH = {f"platforms__{name}__oscillator": {"power_law": {"h0": 1e-26}} for name in ("transmitter", "receiver")}

SHAKES, TURNS = "vibration and turns act on it", "no platform has an orbit"


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        (SENSITIVE, SHAKES),
        ({"earth_orientation": {"ut1_minus_utc": "0.1 s"}}, TURNS),
    ],
)
def test_a_key_that_does_nothing_is_a_warning(changes: dict[str, Any], says: str) -> None:
    assert any(says in one.message for one in findings(**changes).warnings)


@pytest.mark.parametrize(
    "changes",
    [
        SENSITIVE | {f"{RECEIVER}motion_error": SHAKEN},
        SENSITIVE | {f"{RECEIVER}acceleration": ["1 m/s^2", 0, 0]},
        {f"{RECEIVER}oscillator": {"sensor": "bva"}},  # its sensitivity is of the catalogue
        HOLDOVER | BOTH,
        {},
    ],
)
def test_one_that_works_is_none(changes: dict[str, Any]) -> None:
    said = " ".join(one.message for one in findings(**changes).warnings)
    assert not any(one in said for one in (SHAKES, TURNS))


CUT = {f"{RECEIVER}oscillator": {"power_law": {"h0": 1e-26}, "bandwidth": "0.17 Hz"}}


def test_a_bandwidth_leaves_a_cycle_of_noise_in_an_aperture() -> None:
    """Of 6 s: a sixth of a hertz, 0.167. A sweep holds each case to it: 5 s take 0.2 Hz."""
    with pytest.raises(MissionError, match="counts no noise within an aperture of 6 s"):
        findings(**{f"{RECEIVER}oscillator": CUT[f"{RECEIVER}oscillator"] | {"bandwidth": "0.16 Hz"}})
    mission = bb.loads(mission_text(**CUT))
    statuses = bb.sweep(mission, {"collection.aperture_time": ["5 s", "6 s", "7 s"]}).to_dataframe()["status"]
    assert [one == "error" for one in statuses] == [True, False, False]
