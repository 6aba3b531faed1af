"""Vibration limits of the full model in images, and vectors in the simulated data."""

import math

import numpy as np
import pytest

from bisar_budget.mission.load import parse_mission
from bisar_budget.verifier.limits import verify_mission
from tests.conftest import findings, mission_text, row
from tests.simulate.conftest import images_of


def lines(*amplitudes, cycles: float = 10.3):
    return {"vibration": {"sinusoidal": [{"amplitude": a, "frequency": cycles / 6} for a in amplitudes]}}


def verdicts(only: str, **changes):
    changes = {"requirements": {"pslr": -30}, "allocation__model": "full", **changes}
    return {verdict.id: verdict for verdict in verify_mission(parse_mission(mission_text(**changes)), only).rows}


@pytest.mark.parametrize("split", ["equal", {"transmitter": 0.8, "receiver": 0.2}])
def test_both_platforms_in_phase_at_the_full_limits_fill_the_requirement(split) -> None:
    verdict = verdicts("mission.vibration.sinusoidal", allocation={"model": "full", "split": split})
    assert verdict["mission.vibration.sinusoidal"].measured_db == pytest.approx(-30, abs=0.3)
    assert verdict["mission.vibration.sinusoidal"].verdict == "confirmed"


def test_one_platform_alone_at_its_full_limit_is_6_db_inside() -> None:
    (verdict,) = verdicts("receiver.vibration.*").values()
    assert (verdict.model, verdict.verdict) == ("full", "conservative")
    assert verdict.measured_db == pytest.approx(-36.02, abs=0.3)


def test_lines_that_share_a_frequency_are_verified_as_one() -> None:
    error = {"platforms__receiver__motion_error": lines("1 um", "2 um")}
    verdict = verdicts("receiver.vibration.sinusoidal.sum.0", **error)["receiver.vibration.sinusoidal.sum.0"]
    assert verdict.measured_db == pytest.approx(-36.02, abs=0.3)


@pytest.mark.parametrize("apart", [0.7, 1.4, 2.3])
def test_lines_near_each_other_fill_the_requirement_in_their_worst_phases(apart: float) -> None:
    """Of one platform alone, 6 dB inside as one line is; a line at either frequency alone has less."""
    near = {
        "vibration": {
            "sinusoidal": [
                {"amplitude": "2 um", "frequency": 10.3 / 6},
                {"amplitude": "3 um", "frequency": (10.3 + apart) / 6},
            ]
        }
    }
    (verdict,) = verdicts("receiver.vibration.sinusoidal.sum.0", platforms__receiver__motion_error=near).values()
    assert verdict.measured_db == pytest.approx(-36.02, abs=0.5)


@pytest.mark.parametrize(("cycles", "model"), [(0.3, "full"), (0.9, "full"), (0.6, "published")])
def test_the_limit_of_a_slow_vibration_is_the_phase_of_its_image(cycles: float, model: str) -> None:
    slow = lines("1 mm", cycles=cycles)
    changes = {
        "requirements": {"pslr": -30},
        "allocation__model": model,
        "platforms__transmitter__motion_error": slow,
    }
    (verdict,) = verdicts("transmitter.vibration.sinusoidal.0", **changes).values()
    assert verdict.verdict == "confirmed"
    assert verdict.measured_qpe_rad == pytest.approx(math.pi / 8, rel=0.05)
    assert verdict.predicted_qpe_rad == pytest.approx(math.pi / 8, rel=0.01)
    assert verdict.boundary_error == row(findings(**changes), "transmitter.vibration.sinusoidal.0").allowable


def test_a_vector_is_in_the_data_as_its_part_along_the_line_of_sight() -> None:
    vector = {"frame": "track", **lines(["3 mm", "2 mm", "1 mm"])}
    projected = row(findings(platforms__receiver__motion_error=vector), "receiver.vibration.sinusoidal.0").declared
    images = [
        images_of(mission_text(platforms__receiver__motion_error=error), rotated_only=True)
        for error in (vector, lines(projected))
    ]
    assert 1e-3 < projected < 3e-3
    # What lies across turns by some hundredths of itself into the line of sight, which is a phase of some 1e-2.
    peak = np.abs(images[1].rotated).max()
    assert np.abs(images[0].rotated - images[1].rotated).max() < 0.02 * peak
    loss = 20 * math.log10(images[0].response.peak / images[0].clean_response.peak)
    phase = 2 * math.pi * projected / 0.0299792458
    assert loss == pytest.approx(20 * math.log10(1 - phase**2 / 4 + phase**4 / 64), abs=0.05)  # J₀


def test_all_tones_together_fill_the_requirement_of_pslr_in_the_image() -> None:
    """Both platforms' lines, scaled in their declared ratio: J₁(φ)/J₀(φ) of the phase of both is -30 dB."""
    changes = {f"platforms__{name}__motion_error": lines("3 um", "2 um") for name in ("transmitter", "receiver")}
    verdict = verdicts("mission.pslr", **changes)["mission.pslr"]
    assert (verdict.verdict, verdict.requirement_db) == ("confirmed", -30)
    assert verdict.measured_db == pytest.approx(-30, abs=0.3)
    assert verdicts("mission.pslr")["mission.pslr"].verdict == "not_evaluated"


@pytest.mark.parametrize(("model", "excess"), [("full", 0.0), ("published", 0.45)])
def test_a_tone_that_islr_holds_adds_its_power_to_the_image(model: str, excess: float) -> None:
    """Half the power of -20 dB for one platform; a tone leaves J₀² of the response, 1 - φ²/2 to first order."""
    changes = {
        "requirements": {"islr": -20},
        "allocation__model": model,
        "platforms__receiver__motion_error": lines("1 um"),
    }
    verdict = verdicts("receiver.vibration.sinusoidal.0", **changes)["receiver.vibration.sinusoidal.0"]
    assert verdict.boundary_error == row(findings(**changes), "receiver.vibration.sinusoidal.0").allowable
    assert verdict.measured_db == pytest.approx(verdict.requirement_db + excess, abs=0.03)
    assert verdict.verdict == "confirmed"


def test_a_slow_vector_is_imaged_axis_by_axis() -> None:
    """Half a cycle along the track, across the line of sight of mid-aperture: it was 0 rad, and without an image."""
    motion = {"frame": "track", **lines(["30 mm", "1 mm", 0], cycles=0.5)}
    row_id = "transmitter.vibration.sinusoidal.0"
    changes = {"platforms__transmitter__motion_error": motion, "allocation": {"model": "full"}}
    verdict = verdicts(row_id, **changes)[row_id]
    assert verdict.verdict == "confirmed"
    assert verdict.measured_equal_loss_qpe_rad == pytest.approx(math.pi / 8, rel=0.05)
    assert verdict.equal_loss_qpe_rad == pytest.approx(math.pi / 8, rel=0.01)
