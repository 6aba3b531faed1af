"""Levels that shift a part or a spectrum are said beside the verdict, with what they are off from."""

import pytest

from bisar_budget.findings.mission import Report
from bisar_budget.report import FORMATS, Style, render
from tests.conftest import findings

SPECTRUM = {"spectrum": {"20 Hz": "1 g^2/Hz", "1 kHz": "1 g^2/Hz"}}
SHIFTED = {
    "oscillator.level": {"platforms__receiver__oscillator": {"sensor": "sit5358", "level": "-100 dB"}},
    "motion_error.vibration.spectrum_level": {
        "platforms__receiver__motion_error": {"vibration": SPECTRUM | {"spectrum_level": "-100 dB"}}
    },
}


@pytest.mark.parametrize("key", SHIFTED)
@pytest.mark.parametrize("format_name", sorted(FORMATS))
def test_a_level_is_among_the_overrides_in_every_format(format_name: str, key: str) -> None:
    found = findings(**SHIFTED[key], requirements__islr="-20 dB")
    (override,) = found.overrides
    assert (override.name, override.value) == (f"platforms.receiver.{key}", "-100 dB")
    assert override.origin.startswith("off ")
    assert "100 dB" in render(format_name, Report(version="0", missions=(found,)), Style())


def test_a_level_of_zero_shifts_nothing() -> None:
    level = {"platforms__receiver__oscillator": {"sensor": "sit5358", "level": "0 dB"}}
    assert findings(**level).overrides == ()
