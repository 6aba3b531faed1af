"""Probabilities computed from the distributions of errors, against the draws of the same errors."""

import math
from pathlib import Path

import pytest

import bisar_budget as bb

EXAMPLES = sorted((Path(__file__).parents[2] / "specs" / "missions").glob("*.yaml"))
DRAWS, SURE_SIGMA = 5000, 4.0  # one comparison in 16 000 is farther off by chance


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_agrees_with_the_draws_of_every_example(example: Path) -> None:
    for requirement in bb.monte_carlo(bb.load(str(example)), DRAWS, seed=3).to_dict()["requirements"]:
        computed, share = requirement["probability_computed"], requirement["probability"]
        sigma = math.sqrt(max(computed * (1 - computed), 1 / DRAWS) / DRAWS)
        assert abs(computed - share) <= SURE_SIGMA * sigma, requirement["id"]


def test_a_bias_is_drawn() -> None:
    """Beside a normal error of a tenth of it, a bias of the limit keeps the limit in half of the draws."""
    mission = bb.loads(
        """
schema_version: 1
name: bias
radar: { center_frequency: 10 GHz, bandwidth: 300 MHz }
collection: { aperture_time: 2 s }
platforms:
  transmitter: { position: [30 km, 0 m, 6 km], velocity: [0 m/s, 150 m/s, 0 m/s] }
  receiver: { position: [6 km, 6 km, 2 km], velocity: [-42 m/s, 42 m/s, 0 m/s] }
timing_error: { quadratic: { sigma: 1e-12 1/s, bias: 1e-11 1/s } }
"""
    )
    reached = bb.check(mission)["mission.quadratic_phase_error"].declared / 1.1
    at_the_bias = mission.replace({"requirements.quadratic_phase_error": f"{reached} rad"})
    drawn = bb.monte_carlo(at_the_bias, 20_000).to_dict()["requirements"]
    (judged,) = [requirement for requirement in drawn if requirement["id"] == "mission.quadratic_phase_error"]
    assert judged["probability"] == pytest.approx(0.5, abs=0.02)
    assert judged["probability_computed"] == pytest.approx(0.5, abs=1e-3)
