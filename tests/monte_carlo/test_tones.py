"""Monte Carlo draws tones with their amplitude and any phase: rms, largest draw, and the same by exact ranges."""

import math
from typing import Any

import numpy as np
import pytest

import bisar_budget as bb
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.analysis.variables import variables_of
from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.sampling.draws import HeldSum, Sums, drawing_of
from bisar_budget.sampling.probability import monte_carlo
from tests.conftest import findings, mission_file, mission_text, row

DRAWS = 40_000
TONE: dict[str, Any] = {"amplitude": "0.4 mm", "frequency": "0.1 Hz"}  # 0.6 cycles per aperture
VIBRATION = "platforms__receiver__motion_error"
FULL = {"model": "full", "combine": "rss"}
LOCATION = {"cubic_phase_error": "45 deg", "location_error": "5 m"}


def drawn(line: dict[str, Any], draws: int = DRAWS, **changes: Any) -> dict[str, Any]:
    error = {VIBRATION: {"vibration": {"sinusoidal": [line]}}}
    text = mission_text(allocation=FULL, requirements=LOCATION, **error, **changes)
    found = monte_carlo(Analysis(parse_mission(text)), draws, 3)
    return {requirement.id: requirement for requirement in found.requirements} | {"notes": found.notes}


def test_a_small_slow_tone_has_the_rms_of_its_worst_phase_over_the_root_of_two() -> None:
    """And the distribution of a cosine: P(|A·cos ψ| ≤ L) = 2/π·asin(L/A)."""
    error = {VIBRATION: {"vibration": {"sinusoidal": [TONE]}}}
    worst = row(findings(allocation=FULL, **error), "receiver.vibration.sinusoidal.0").qpe_full_rad
    quadratic = drawn(TONE)["receiver.quadratic_phase_error"]
    assert quadratic.sigma == pytest.approx(worst / math.sqrt(2), rel=0.01)
    assert quadratic.sigma_rss == pytest.approx(worst / math.sqrt(2), rel=1e-3)
    assert quadratic.rss == pytest.approx(worst, rel=2e-3)
    for fraction in (0.3, 0.9):
        limit = fraction * worst * 2  # half of it is the receiver's share
        text = mission_text(allocation=FULL, requirements={"quadratic_phase_error": limit}, **error)
        (receiver, _) = monte_carlo(Analysis(parse_mission(text)), DRAWS, 3).requirements
        probability = 2 / math.pi * math.asin(receiver.limit / worst)
        assert receiver.probability == pytest.approx(probability, abs=4 * math.sqrt(0.25 / DRAWS))


@pytest.mark.parametrize("amplitude", ["0.4 mm", ["3 mm", "2 mm", "1 mm"]])
def test_no_draw_exceeds_the_worst_phase(amplitude: Any) -> None:
    error = {VIBRATION: {"vibration": {"sinusoidal": [TONE | {"amplitude": amplitude}]}}}
    checked = row(findings(allocation=FULL, **error), "receiver.vibration.sinusoidal.0")
    analysis = Analysis(parse_mission(mission_text(allocation=FULL, **error)))
    variables = variables_of(analysis)
    held = HeldSum("", "rad", 1.0, ("receiver",), (0,), 1.0, hides=True)
    sums = Sums(drawing_of(analysis, variables, [held], 4, 1), 2000, adds=True, keeps_motion=False)
    for index, variable in enumerate(variables):
        sums.add(variable, np.random.default_rng(index).random(2000) * 2 * math.pi)
    largest = math.sqrt(sums.square(held).max())
    assert 0.9 * checked.equal_loss_qpe_rad < largest <= 1.001 * checked.equal_loss_qpe_rad


def test_a_fast_tone_displaces_and_has_no_phase() -> None:
    fast = TONE | {"frequency": "0.4 Hz", "amplitude": "20 mm"}
    error = {VIBRATION: {"vibration": {"sinusoidal": [fast]}}}
    found = findings(allocation=FULL, requirements=LOCATION, **error)
    worst = math.hypot(*row(found, "receiver.vibration.sinusoidal.0").displacement_m)
    by_id = drawn(fast)
    assert by_id.keys() == {"mission.location_error", "notes"}
    assert by_id["mission.location_error"].sigma == pytest.approx(worst / math.sqrt(2), rel=0.01)


def test_a_note_names_vibrations_that_no_drawn_requirement_holds() -> None:
    fast = TONE | {"frequency": "4 Hz"}
    for changes, is_named in (({"requirements": {}}, True), ({"requirements": LOCATION}, False)):
        error = {VIBRATION: {"vibration": {"sinusoidal": [fast], "wideband": {"rms": "1 mm"}}}}
        text = mission_text(allocation=FULL, **changes, **error)
        notes = monte_carlo(Analysis(parse_mission(text)), 10, 1).notes
        (note,) = (one for one in notes if one.code == "vibration-is-not-drawn")
        assert ("receiver.vibration.sinusoidal.0" in note) is is_named
        assert "receiver.vibration.wideband" in note


def both_ways(mission: bb.Mission, column: tuple[int, ...], draws: int = 400) -> tuple[Any, Any, float]:
    """Errors by sums of effects and by exact ranges, of the same draws, and the rms of the latter."""
    analysis = Analysis(mission)
    variables = variables_of(analysis)
    owners = ("transmitter", "receiver", "clock", "mission")
    held = HeldSum("", "", 1.0, owners, column, hides=column == (0,))
    drawing = drawing_of(analysis, variables, [held], 4, 1)._replace(variables=tuple(variables))
    sums = Sums(drawing, draws, adds=True, keeps_motion=True)
    for index, variable in enumerate(variables):
        random = np.random.default_rng(index)
        sums.add(variable, random.random(draws) * 2 * math.pi if variable.is_tone else random.standard_normal(draws))
    linear, exact = np.sqrt(sums.square(held)), np.sqrt(sums.exact_square(held))
    return linear, exact, math.sqrt(np.square(exact).mean())


@pytest.mark.parametrize("column", [(0,), (1,), (2, 3)])
@pytest.mark.parametrize("heard", [False, True])
@pytest.mark.parametrize("amplitude", ["0.4 mm", ["3 mm", "2 mm", "1 mm"]])
def test_tones_by_exact_ranges_are_those_of_sums(amplitude: Any, column: tuple[int, ...], *, heard: bool) -> None:
    lines = [TONE | {"amplitude": amplitude}, {"amplitude": "1 mm", "frequency": "5 Hz"}]
    names = (VIBRATION, VIBRATION.replace("receiver", "transmitter"))
    error = {name: {"vibration": {"sinusoidal": lines}} for name in names}
    sync = {"synchronization": {"method": "direct_path", "error": "1 deg"}} if heard else {}
    linear, exact, size = both_ways(parse_mission(mission_text(allocation=FULL, **error, **sync)), column)
    assert np.abs(linear - exact).max() <= 0.01 * size


@pytest.mark.parametrize("column", [(0,), (1,), (2, 3)])
@pytest.mark.parametrize("file", ["dvbt_aircraft", "circling_drone"])
def test_a_narrow_band_and_a_wide_turn_hide_as_much_in_sums_as_in_exact_ranges(
    file: str, column: tuple[int, ...]
) -> None:
    linear, exact, size = both_ways(load_mission(mission_file(file)), column)
    assert np.abs(linear - exact).max() <= 0.02 * size + 1e-3 * (column != (2, 3))


def test_a_television_signal_needs_no_exact_ranges() -> None:
    """The hidden phase of a small error is drawn: the sums have what check has."""
    text = mission_file("dvbt_aircraft").read_text().replace("5 cm/s", "5 mm/s")
    mission = bb.loads(text)
    found = monte_carlo(Analysis(mission), DRAWS, 1)
    (receiver,) = (one for one in found.requirements if one.id == "receiver.quadratic_phase_error")
    checked = row(bb.check(mission).findings, "receiver.velocity.y")
    assert not found.is_exact
    assert receiver.sigma_rss == pytest.approx(checked.equal_loss_qpe_rad, rel=1e-3)
    assert receiver.sigma == pytest.approx(checked.equal_loss_qpe_rad, rel=0.02)
    assert receiver.probability_normal == pytest.approx(
        math.erf(receiver.limit / receiver.sigma_rss / math.sqrt(2)), rel=1e-6
    )


def test_a_tone_changes_no_other_draw() -> None:
    """Each variable has a stream of its own: the location, which a slow error moves, is that without the tone."""
    velocity = {"platforms__transmitter__motion_error": {"velocity": ["2 mm/s", 0, 0]}}
    text = mission_text(allocation=FULL, requirements={"location_error": "1 m"}, **velocity)
    alone = monte_carlo(Analysis(parse_mission(text)), 5000, 3)
    by_id = drawn(TONE, 5000, **velocity)
    (transmitter,) = (one for one in alone.requirements if one.id == "transmitter.quadratic_phase_error")
    assert by_id["transmitter.quadratic_phase_error"].sigma == transmitter.sigma
