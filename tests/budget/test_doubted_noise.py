"""Oscillators whose noise is not what the file states: a mask of another frequency, a power law that does not fit."""

from typing import Any

import numpy as np
import pytest

from bisar_budget.budget.check import check_missions
from bisar_budget.mission.load import parse_mission
from tests.conftest import TODAY, findings, mission_text, row

WAVEFORM = {"radar": {"center_frequency": "10 GHz", "bandwidth": "100 MHz"}, "collection": {"aperture_time": "4 s"}}
NEEDS = {"cubic_phase_error": "45 deg", "islr": "-10 dB"}
LEVELS = {0.025: -57.0, 1.0: -105.0, 10.0: -135.0, 100.0: -150.0, 1000.0: -155.0}  # from 0.1 cycles per aperture on


def mission(oscillator: dict[str, Any], **changes: Any) -> dict[str, Any]:
    motion = {f"platforms__{name}__motion_error": {"velocity": "2 mm/s"} for name in ("transmitter", "receiver")}
    clocks = {"platforms__receiver__oscillator": oscillator, "platforms__transmitter__oscillator": PART}
    rules = {"model": "full", "combine": "rss"}
    return {**WAVEFORM, **motion, **clocks, "requirements": NEEDS, "allocation": rules} | changes


def masked(level: float = 0.0, **beside: Any) -> dict[str, Any]:
    return {"phase_noise": {f"{f:g} Hz": f"{one + level:g} dBc/Hz" for f, one in LEVELS.items()}, **beside}


PART = {"sensor": "wenzel-5mhz"}
POOR = {"1 s": 1e-12, "2 s": 6e-12, "4 s": 1e-12, "8 s": 6e-12}
GOOD = dict.fromkeys(POOR, 2e-12)
DOUBTED = {"of-a-part": masked(**PART), "poor-fit": {"allan_deviation": POOR}}
SOUND = {"own-frequency": masked(frequency="5 MHz", **PART), "good-fit": {"allan_deviation": GOOD}}
QUIET = {
    "of-a-part": masked(-40, **PART),
    "poor-fit": {"allan_deviation": {tau: deviation / 100 for tau, deviation in POOR.items()}},
}
NAMES = {"of-a-part": "add oscillator.frequency", "poor-fit": "state phase_noise or power_law"}


def rules(combine: str) -> dict[str, str]:
    return {"model": "full", "combine": combine}


@pytest.mark.parametrize("combine", ["each", "rss", "sum"])
@pytest.mark.parametrize("kind", DOUBTED)
def test_requirements_that_rest_on_doubted_noise_are_not_evaluated(kind: str, combine: str) -> None:
    """Both were warnings beside a pass, with exit 0."""
    found = findings(**mission(DOUBTED[kind], allocation=rules(combine)))
    assert found.status == "not_evaluated"
    for key in ("quadratic_phase_error", "cubic_phase_error"):
        (entry,) = [one for one in found.requirements if one.key == key]
        assert entry.status == "not_evaluated"
        assert "platforms.receiver.oscillator" in str(entry.reason)
        assert NAMES[kind] in str(entry.reason)
    assert not [one for one in found.warnings if NAMES[kind] in one.message]  # the rows say it


@pytest.mark.parametrize("combine", ["each", "rss", "sum"])
@pytest.mark.parametrize("kind", SOUND)
def test_noise_that_the_file_states_whole_is_judged(kind: str, combine: str) -> None:
    found = findings(**mission(SOUND[kind], allocation=rules(combine)))
    assert found.status == "pass"
    assert not found.warnings


@pytest.mark.parametrize("combine", ["each", "rss", "sum"])
@pytest.mark.parametrize("kind", QUIET)
def test_doubted_noise_that_uses_less_than_a_tenth_is_said(kind: str, combine: str) -> None:
    found = findings(**mission(QUIET[kind], allocation=rules(combine)))
    assert found.status == "pass"
    assert [one for one in found.warnings if NAMES[kind] in one.message]


@pytest.mark.parametrize("kind", DOUBTED)
def test_doubted_noise_under_a_sum_of_others_is_not_evaluated(kind: str) -> None:
    """A tenth of a limit by the noise itself counts, also where most of the sum is of other errors."""
    others = {"platforms__transmitter__motion_error": {"velocity": "60 mm/s"}}
    found = findings(**mission(DOUBTED[kind], **others))
    assert row(found, "mission.quadratic_phase_error").status == "not_evaluated"


@pytest.mark.parametrize("kind", DOUBTED)
def test_what_fails_with_doubted_noise_fails(kind: str) -> None:
    loud = {"platforms__receiver__motion_error": {"velocity": "2 m/s"}}
    assert row(findings(**mission(DOUBTED[kind], **loud)), "receiver.quadratic_phase_error").status == "fail"


def test_spurs_beside_a_mask_at_the_frequency_of_a_part_are_not_evaluated() -> None:
    needs = {**NEEDS, "pslr": "-20 dB"}
    spurs = {"spurs": {"50 Hz": "-100 dBc"}}
    doubted = findings(**mission(masked(**PART, **spurs), requirements=needs))
    sound = findings(**mission(masked(frequency="5 MHz", **PART, **spurs), requirements=needs))
    assert row(doubted, "receiver.oscillator.spur.0").status == "not_evaluated"
    assert row(sound, "receiver.oscillator.spur.0").status == "pass"
    assert next(one.status for one in doubted.requirements if one.key == "pslr") == "not_evaluated"
    assert next(one.status for one in sound.requirements if one.key == "pslr") == "pass"


def test_cases_of_a_sweep_are_doubted_each_by_its_own_fit() -> None:
    """Over another aperture another power law is the worst that fits, but a misfit stays a misfit."""
    texts = [
        mission_text(**mission({"allan_deviation": points}, collection={"aperture_time": f"{T:g} s"}))
        for points in (POOR, GOOD)
        for T in (3.0, 4.0, 5.0)
    ]
    found = dict(check_missions([parse_mission(text) for text in texts], TODAY))
    alone = [
        findings(**mission({"allan_deviation": POOR}, collection={"aperture_time": f"{T:g} s"}))
        for T in (3.0, 4.0, 5.0)
    ]
    assert [found[place].status for place in range(6)] == [*(one.status for one in alone), *["pass"] * 3]
    assert np.all([one.status == "not_evaluated" for one in alone])
