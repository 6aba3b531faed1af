"""Loss of the peak by all declared errors: how losses combine, what is said of them.

`tests/theory/test_image_point.py` holds the loss by one error to images formed by direct sums.
"""

import json
import math
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import bisar_budget as bb
from bisar_budget.cli import cli
from tests.conftest import mission_text

ERROR = "platforms__receiver__motion_error"
EAST, NORTH = ({"velocity": [f"{east} mm/s", f"{north} mm/s", 0]} for east, north in ((8, 0), (0, 5)))
BOTH = {"velocity": ["8 mm/s", "5 mm/s", 0]}


def loss_db(**changes: Any) -> float | None:
    found: float | None = bb.check(bb.loads(mission_text(**changes))).to_dict()["missions"][0]["peak_loss_db"]
    return found


def loss_of(**changes: Any) -> float:
    found = loss_db(**changes)
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("rule", "combined"),
    [
        ("rss", lambda one, other: one + other),
        ("sum", lambda one, other: (math.sqrt(one) + math.sqrt(other)) ** 2),
        ("each", max),
    ],
)
def test_losses_combine_by_the_rule_of_the_mission(rule: str, combined: Any) -> None:
    rules = {"allocation__combine": rule}
    alone = (loss_of(**{ERROR: error}, **rules) for error in (EAST, NORTH))
    assert loss_of(**{ERROR: BOTH}, **rules) == pytest.approx(combined(*alone), rel=1e-9)


def test_a_tone_of_any_phase_loses_its_mean_square() -> None:
    """J₀² of a phase of 0.2 rad is 0.0871 dB, and its mean square, 0.02 rad², is 0.0869 dB."""
    amplitude = 0.2 / (2 * math.pi) * 299792458 / 10e9
    tone = {"amplitude": f"{amplitude} m", "frequency": "20 Hz"}
    found = loss_of(**{ERROR: {"vibration": {"sinusoidal": [tone]}}})
    assert found == pytest.approx(0.0871, rel=0.01)


def test_a_covariance_without_correlations_loses_what_its_errors_do() -> None:
    sigmas = {
        "position": ["1 um"] * 3,
        "velocity": ["8 mm/s", "5 mm/s", "1e-9 m/s"],
        "correlation": np.eye(6).tolist(),
    }
    found = loss_of(**{ERROR: {"covariance": sigmas}}, allocation__combine="rss")
    assert found == pytest.approx(loss_of(**{ERROR: BOTH}, allocation__combine="rss"), rel=1e-3)


def test_without_a_declared_error_there_is_no_loss() -> None:
    assert loss_db() is None


@pytest.mark.parametrize(("velocity", "has_a_single_peak"), [("5 mm/s", True), ("500 mm/s", False)])
def test_above_3_db_an_image_may_have_several_peaks(velocity: str, *, has_a_single_peak: bool) -> None:
    text = mission_text(**{ERROR: {"velocity": ["0 m/s", velocity, 0]}})
    shown = CliRunner().invoke(cli, ["check", "-"], input=text).stdout
    assert "Peak loss " in shown
    assert ("several peaks" in " ".join(shown.split())) is not has_a_single_peak
    found = json.loads(CliRunner().invoke(cli, ["check", "--format", "json", "-"], input=text).stdout)["missions"][0]
    assert (found["peak_loss_db"] < 3) is has_a_single_peak
    assert any("several peaks" in note for note in found["notes"]) is not has_a_single_peak
