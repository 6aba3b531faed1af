"""A cause of which the file states one half is not judged: deleting the worse half makes no pass."""

import pytest

import bisar_budget as bb
from tests.conftest import ROOT

HOLDOVER = """\
schema_version: 1
name: clocks set a minute ago
radar: { center_frequency: 9.6 GHz, bandwidth: 300 MHz }
collection: { aperture_time: 2 s }
platforms:
  transmitter:
    position: [30 km, 0, 6 km]
    velocity: [0, 150 m/s, 0]
    motion_error: { position: 1 m, velocity: 1 mm/s }
    oscillator: { sensor: wenzel-5mhz }
  receiver:
    position: [6 km, 6 km, 2 km]
    velocity: [-40 m/s, 40 m/s, 0]
    motion_error: { position: 1 m, velocity: 1 mm/s }
    oscillator: { sensor: RECEIVER }
synchronization: { method: holdover, age: 60 s, averaging: 10 s, time_error: 1 ns, frequency_error: 1e-12 }
propagation: { zenith_delay: 1 cm }
requirements: { islr: -20 dB, quadratic_phase_error: 45 deg }
"""
HELD = {"quadratic_phase_error", "islr"}


def statuses(result: bb.CheckResult) -> dict[str, str]:
    return {key: result.requirements[key].status for key in sorted(HELD)}


@pytest.mark.parametrize("combine", ["each", "sum", "rss"])
def test_the_noise_of_one_clock_of_two_in_holdover_is_not_judged(combine: str) -> None:
    """Without the receiver's oscillator QPE and ISLR passed, by the transmitter's noise alone."""
    text = HOLDOVER + f"allocation: {{ combine: {combine} }}\n"
    both = bb.check(bb.loads(text.replace("RECEIVER", "wenzel-5mhz")))
    assert both.status == "pass"
    one = bb.check(bb.loads(text.replace("    oscillator: { sensor: RECEIVER }\n", "")))
    assert one.status == "not_evaluated"
    assert set(statuses(one).values()) == {"not_evaluated"}
    reason = one["transmitter.oscillator"].reason
    assert reason is not None
    assert "add platforms.receiver.oscillator" in reason


VIBRATING = ROOT / "specs" / "missions" / "uav_vibrating_ocxo.yaml"


@pytest.mark.parametrize(("key", "held"), [("spectrum", {"islr"}), ("sinusoidal", {"islr"})])
def test_a_mounted_oscillator_is_not_spared_the_half_that_its_airframe_has(key: str, held: set[str]) -> None:
    """`oscillator.vibration` takes the place of the airframe's: without its spectrum the frame's noise was gone."""
    mission = bb.load(VIBRATING)
    assert bb.check(mission).status == "pass"
    half = bb.check(mission.replace({f"platforms.receiver.oscillator.vibration.{key}": "null"}))
    assert half.status == "not_evaluated"
    assert {name for name, one in half.requirements.items() if one.status == "not_evaluated"} >= held
    (reason,) = {one.reason for one in half.values() if one.status == "not_evaluated" and "oscillator" in one.id}
    assert reason is not None
    assert f"add platforms.receiver.oscillator.vibration.{key}" in reason


def test_a_frame_without_that_half_asks_for_none() -> None:
    mission = bb.load(VIBRATING)
    gone = {f"platforms.receiver.{owner}.vibration.sinusoidal": "null" for owner in ("oscillator", "motion_error")}
    gone |= {"requirements.pslr": "null"}  # of which no tone is left to judge
    assert bb.check(mission.replace(gone)).status == "pass"
