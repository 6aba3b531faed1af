"""Hints at keys: they know the section that the unknown key stands in."""

import pytest

from bisar_budget.faults import MissionError, SetValue
from bisar_budget.mission.changes import nearest_keys, section_hint
from bisar_budget.mission.load import parse_mission
from tests.conftest import mission_text

NEAR = "Did you mean 'near'?"


@pytest.mark.parametrize(
    ("path", "hint"),
    [
        ("radar.aperture_time", "'aperture_time' is a key of 'collection'"),
        ("requirements.n_pull", "'n_pull' is a key of 'autofocus'"),
        ("platforms.receiver.motion_error.speed", "'speed' is a key of 'platforms.receiver'"),
        (
            "platforms.receiver.imu",
            "'imu' is a key of 'platforms.receiver.motion_error' and 'platforms.receiver.motion_error.navigation'",
        ),
        ("platforms.transmitter.bandwidth", "'bandwidth' is a key of 'platforms.transmitter.oscillator'"),
        (
            "platforms.transmitter.motion_error.vibration.sinusoidal[0].speed",
            "'speed' is a key of 'platforms.transmitter'",
        ),
        ("speed", "'speed' is a key of 'platforms.transmitter' and 'platforms.receiver'"),
        ("radar.schema_version", "'schema_version' is a key of the file itself"),
        ("position", ""),  # seven sections have it, and nothing of the first level is meant
        ("radar.center_frequenzy", NEAR),
        ("radar.bandwidth.x", NEAR),
        ("radar.irw", NEAR),
        ("", NEAR),
    ],
)
def test_the_section_that_has_a_key_is_named(path: str, hint: str) -> None:
    assert section_hint(path, NEAR) == hint


@pytest.mark.parametrize(
    ("path", "hint"),
    [
        ("radar.bandwith", "Did you mean 'radar.bandwidth'?"),
        ("platfoms.reciever.spead", "Did you mean 'platforms.receiver.speed'?"),
        ("other_errors.0.nam", "Did you mean 'other_errors.0.name'?"),
        ("receiver.speed", "Did you mean 'platforms.receiver.speed'?"),
        ("platforms.receiver.imu.attitude", "Did you mean 'platforms.receiver.motion_error.imu.attitude'?"),
        ("collection.n_pull", "'n_pull' is a key of 'autofocus'"),
        ("requirements.velocity", ""),  # was: Did you mean 'requirements.pslr'?
        ("simulation.radius", "'radius' is a key of 'scene'"),  # was: Did you mean 'scene.radius'?
    ],
)
def test_a_path_is_looked_for_in_its_own_section(path: str, hint: str) -> None:
    assert nearest_keys(path) == hint


def faults(text: str, *changes: SetValue) -> list[str]:
    with pytest.raises(MissionError) as error:
        parse_mission(text, "m.yaml", changes=changes)
    return [str(fault) for fault in error.value.faults]


def test_a_key_of_another_section_is_no_spelling() -> None:
    """A `speed` on the first level was a misspelt `scene`."""
    (said,) = faults(f"{mission_text()}speed: 60 m/s\n")
    assert "Did you mean" not in said
    assert said.endswith("simulation, waivers. 'speed' is a key of 'platforms.transmitter' and 'platforms.receiver'")


def test_a_key_nearly_of_this_section_is_a_spelling() -> None:
    (said,) = faults(f"{mission_text()}requirement: {{}}\n")
    assert said.endswith("Did you mean 'requirements'?")


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("collection.n_pull", "2", "accepted: aperture_time, pulses, center_time. 'n_pull' is a key of 'autofocus'"),
        ("receiver.climb", "2 m/s", "Did you mean 'platforms.receiver.climb'?"),
        ("autofocus", "{n_pul: 2}", "accepted: algorithm, n_pull. Did you mean 'autofocus.n_pull'?"),
    ],
)
def test_an_option_has_the_hint_of_a_path(key: str, value: str, said: str) -> None:
    assert any(fault.endswith(said) for fault in faults(mission_text(), SetValue(key, value)))
