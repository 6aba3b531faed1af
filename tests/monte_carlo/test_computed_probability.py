"""Probabilities computed from the distributions of errors, against the draws of the same errors."""

import math

import pytest

import bisar_budget as bb
from tests.conftest import examples

DRAWS, SURE_SIGMA = 5000, 4.0  # one comparison in 16 000 is farther off by chance


@pytest.mark.parametrize("example", examples(), ids=lambda path: path.stem)
def test_agrees_with_the_draws_of_every_example(example) -> None:
    drawn = bb.monte_carlo(bb.load(str(example)), DRAWS, seed=3).to_dict()
    for requirement in drawn["requirements"]:
        computed, share = requirement["probability_computed"], requirement["probability"]
        sigma = math.sqrt(max(computed * (1 - computed), 1 / DRAWS) / DRAWS)
        assert abs(computed - share) <= SURE_SIGMA * sigma, requirement["id"]


def test_biases_are_drawn(mission_text=None) -> None:
    """A bias of the limit: a normal error beside it keeps the limit in half of the draws, hardly less."""
    mission = bb.load(str(examples()[0]))
    biased = mission.replace({"other_errors": '[{name: cable, quadratic_phase_error: {sigma: 0.01 deg, bias: 3 rad}}]'})
    (judged,) = [one for one in bb.monte_carlo(biased, 2000).to_dict()["requirements"] if one["id"].startswith("mission.q")]
    assert judged["probability"] == judged["probability_computed"] == 0.0
