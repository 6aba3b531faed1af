"""Monte Carlo draws sensors and clocks: quadratic and cubic phases with their sigmas, and with their covariance."""

import math

import pytest

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.mission.load import parse_mission
from bisar_budget.sampling.probability import monte_carlo
from tests.effects.test_random_errors import MISSION, OSCILLATORS

DRAWS = 20_000  # know a sigma to 0.5 %
SIGMA = 0.02
REST = """requirements: {cubic_phase_error: 45 deg, islr: -20 dB, location_error: 100 m}
allocation: {model: full, combine: rss, coverage_factor: 2}
"""


def drawn(text: str):
    analysis = Analysis(parse_mission(text))
    found = monte_carlo(analysis, DRAWS, seed=7)
    return analysis, {one.id: one for one in found.requirements}, found


def test_sigmas_are_those_of_the_rows_without_the_coverage_factor() -> None:
    analysis, by_id, found = drawn(MISSION.rstrip() + OSCILLATORS + REST)
    assert not found.is_exact
    quadratic = math.hypot(
        *(one.full.quadratic * (one.declared or 0) / 2 for one in analysis.random if one.unit != "dB")
    )
    clock = next(one for one in analysis.random if one.unit == "dB")
    quadratic = math.hypot(quadratic, clock.full.quadratic / 2)
    assert by_id["receiver.quadratic_phase_error"].sigma == pytest.approx(quadratic, rel=SIGMA)
    assert by_id["mission.quadratic_phase_error"].sigma == pytest.approx(quadratic, rel=SIGMA)
    sizes = [1.0 if one.unit == "dB" else one.declared or 0.0 for one in analysis.random]
    hidden = math.hypot(*(one.full.hidden * size for one, size in zip(analysis.random, sizes, strict=True)))
    assert by_id["receiver.quadratic_phase_error"].rss == pytest.approx(math.hypot(2 * quadratic, hidden), rel=1e-9)
    cubic = [one.full.cubic * (1 if one.unit == "dB" else one.declared or 0) / 2 for one in analysis.random]
    assert by_id["mission.cubic_phase_error"].sigma == pytest.approx(math.hypot(*cubic), rel=SIGMA)
    assert any("ISLR is not drawn" in note for note in found.notes)
    # Nobody says how the oscillator was set: without it the location is that of the sensors.
    assert "mission.location_error" not in by_id
    assert any("the location is not drawn" in note for note in found.notes)
    analysis, by_id, found = drawn(MISSION + REST)
    moved = math.hypot(*(one.full.displacement * (one.declared or 0) / 2 for one in analysis.random))
    assert by_id["mission.location_error"].sigma == pytest.approx(moved, rel=SIGMA)
    assert by_id["mission.location_error"].rss == pytest.approx(2 * moved, rel=1e-9)
    assert not any("the location is not drawn" in note for note in found.notes)


def test_draws_through_exact_ranges_keep_the_phases_of_noise() -> None:
    """A position error of 300 m past 2 km sends every draw through exact ranges; GNSS noise is on top of it."""
    large = MISSION.replace("      frame: track\n", "      frame: track\n      position: 300 m\n")
    large = large.replace("sigma: 1 cm", "sigma: 10 cm")
    quiet = large[: large.index("      imu:")]
    _, with_noise, found = drawn(large + REST)
    assert found.is_exact
    _, without, _ = drawn(quiet + REST)
    analysis = Analysis(parse_mission(large + REST))
    noise = math.hypot(*(one.full.quadratic * (one.declared or 0) / 2 for one in analysis.random))
    row_id = "receiver.quadratic_phase_error"
    expected = math.hypot(without[row_id].sigma, noise)
    assert noise > 0.2 * expected
    assert with_noise[row_id].sigma == pytest.approx(expected, rel=SIGMA)
    row_id = "mission.cubic_phase_error"
    noise = math.hypot(*(one.full.cubic * (one.declared or 0) / 2 for one in analysis.random))
    assert with_noise[row_id].sigma == pytest.approx(math.hypot(without[row_id].sigma, noise), rel=SIGMA)
    row_id = "mission.location_error"
    noise = math.hypot(*(one.full.displacement * (one.declared or 0) / 2 for one in analysis.random))
    assert with_noise[row_id].sigma == pytest.approx(math.hypot(without[row_id].sigma, noise), rel=SIGMA)


def test_a_bias_along_one_axis_has_one_draw_for_both_phases() -> None:
    """Its quadratic and cubic phase come from one number; of three axes each has its own."""
    head = MISSION[: MISSION.index("        accelerometer_bias")]
    for values, is_one in (("[50 ug, 0 ug, 0 ug]", True), ("50 ug", False)):
        analysis = Analysis(parse_mission(f"{head}        accelerometer_bias: {values}\n"))
        error = next(one for one in analysis.random if one.declared)
        correlation = abs(error.full.covariance[0, 1]) / (error.full.quadratic * error.full.cubic)
        assert bool(correlation == pytest.approx(1, abs=1e-9)) is is_one
        assert correlation < 1 + 1e-9
