"""How many draws of noise a verdict takes, and that it does not depend on which were drawn."""

import math

import numpy as np
import pytest

from bisar_budget.budget.check import check_mission
from bisar_budget.mission.load import parse_mission
from bisar_budget.simulator.image_formation import taylor_window
from bisar_budget.verifier.limits import verify_mission
from bisar_budget.verifier.spread_cases import Mainlobe, added_islr
from tests.conftest import TODAY, mission_text
from tests.effects.test_random_errors import MISSION
from tests.responses import energy_within, shown_db

MOMENTS = 1024
UNIFORM = np.ones(MOMENTS)


def phase_rms(level_db: float) -> float:
    """Rms of white noise that adds an ISLR under a uniform window; the mask holds 2 cells of its power. [rad]"""
    return math.sqrt(math.log1p(energy_within("uniform") * 10 ** (level_db / 10)) * (1 + 2 / MOMENTS))


def white(level_db: float, seed: int):
    rng, rms = np.random.default_rng(seed), phase_rms(level_db)
    return lambda draws: rms * rng.standard_normal((draws, MOMENTS))


@pytest.mark.parametrize("window", ["uniform", "taylor"])
def test_the_mainlobe_holds_its_share_and_loses_what_a_transform_says(window: str) -> None:
    weights = UNIFORM if window == "uniform" else taylor_window(MOMENTS)
    mainlobe = Mainlobe(weights)
    assert mainlobe.energy == pytest.approx(energy_within(window), abs=1e-5)
    phases = 0.3 * np.random.default_rng(3).standard_normal((4, MOMENTS))
    null, fine = 1.0 if window == "uniform" else 1.66955, 64
    within = round(null * fine)
    signals = weights * np.exp(1j * np.concatenate([np.zeros((1, MOMENTS)), phases]))
    power = np.abs(np.fft.fft(signals, MOMENTS * fine, axis=1)) ** 2
    inside = (power[:, : within + 1].sum(axis=1) + power[:, -within:].sum(axis=1)) / power.sum(axis=1)
    assert mainlobe.lost(phases) == pytest.approx(inside[0] - inside[1:], abs=2e-4)


def test_a_phase_of_a_microradian_is_not_lost_in_rounding() -> None:
    """1e-12 of the energy: a difference of two energies would be known to four digits at best."""
    mainlobe = Mainlobe(UNIFORM)
    phases = 1e-6 * np.random.default_rng(4).standard_normal((64, MOMENTS))
    assert mainlobe.added_db(float(mainlobe.lost(phases).mean())) == pytest.approx(shown_db(1e-12), abs=0.05)


@pytest.mark.parametrize(
    ("excess", "verdict"), [(0.0, "confirmed"), (0.44, "confirmed"), (0.56, "optimistic"), (-0.56, "conservative")]
)
def test_both_sides_of_half_a_decibel_by_a_dozen_seeds(excess: float, verdict: str) -> None:
    for seed in range(12):
        found = added_islr(UNIFORM, white(-20 + excess, seed), -20)
        assert found.verdict(-20) == verdict
        assert found.low < found.level < found.high < found.low + 0.5
        assert found.level == pytest.approx(-20 + excess, abs=4 * found.error)


def test_an_interval_at_95_percent_holds_the_mean_of_19_in_20() -> None:
    """100 intervals of what -20 dB of white noise adds: 95 hold it, with a standard deviation of 2.2."""
    inside = 0
    for seed in range(100):
        found = added_islr(UNIFORM, white(-20, seed), -20)
        inside += found.low <= -20 <= found.high
    assert 88 <= inside <= 99


def test_what_is_on_the_border_gets_no_verdict_but_an_interval() -> None:
    found = added_islr(UNIFORM, white(-19.5, 5), -20)
    assert (found.verdict(-20), found.draws) == ("not_evaluated", 8192)
    assert found.high - found.low < 0.02


def test_on_the_harmless_border_a_limit_is_conservative() -> None:
    """Half a decibel inside what is required it is confirmed or conservative: of neither border a limit is unsafe."""
    found = added_islr(UNIFORM, white(-20.5, 5), -20)
    assert (found.verdict(-20), found.draws) == ("conservative", 8192)


class TestVerdicts:
    """Of whole missions, by the images of what they declare."""

    @pytest.mark.parametrize(
        ("error", "verdict"),
        [
            ({"vibration": {"wideband": {"rms": "100 um"}}}, "confirmed"),
            ({"vibration": {"sinusoidal": [{"amplitude": "100 um", "frequency": 5}]}}, "confirmed"),
            ({"acceleration": [0, "2 mm/s^2", 0]}, "conservative"),  # (4/175)·φ₃² is safe: an image shows 1.2 dB less
        ],
    )
    def test_what_islr_holds_besides_noise_is_drawn_as_what_it_is(self, error, verdict: str) -> None:
        """A tone without a PSLR requirement, and a cubic phase without one of its own."""
        allocation = {"model": "full", "combine": "rss"}
        changes = {"platforms__receiver__motion_error": error, "allocation": allocation}
        mission = parse_mission(mission_text(requirements__islr=-20, **changes))
        (row,) = verify_mission(mission, "mission.islr").rows
        assert (row.verdict, row.requirement_db) == (verdict, pytest.approx(-20))

    def test_the_limit_of_correlated_noise_has_one_verdict_whatever_the_seed(self) -> None:
        """48 series had an error of 0.3 dB, and the verdict of a limit 0.4 dB off was that of the seed."""
        rest = "requirements: {islr: -20 dB}\nallocation: {model: full, combine: rss}\n"
        for seed in range(1, 13):
            mission = parse_mission(MISSION + rest + f"simulation: {{seed: {seed}}}\n")
            (row,) = verify_mission(mission, "receiver.random.GNSS").rows
            assert row.verdict == "confirmed"
            assert row.measured_db_interval[0] < row.measured_db < row.measured_db_interval[1]
            assert f"{row.measured_db_interval[0]:.2f} to {row.measured_db_interval[1]:.2f} dB at 95 %" in row.reason

    @pytest.mark.parametrize(("model", "excess"), [("published", 0.46), ("full", 0.0)])
    @pytest.mark.parametrize("window", ["uniform", "taylor"])
    def test_white_vibration_of_both_platforms_fills_the_requirement(self, model, excess, window) -> None:
        """By the published rule it is 0.46 dB beyond under a uniform window, still confirmed; 0.03 dB by Taylor's."""
        excess = {"uniform": excess, "taylor": shown_db(0.01, "taylor") + 20 if model == "published" else 0.0}[window]
        for seed in range(1, 5):
            changes = {"allocation__model": model, "simulation": {"seed": seed, "window": window}}
            mission = parse_mission(mission_text(requirements__islr=-20, **changes))
            (row,) = verify_mission(mission, "mission.vibration.wideband").rows
            assert row.verdict == "confirmed"
            assert row.measured_db + 20 == pytest.approx(excess, abs=0.01 + 4 * row.measured_db_error)

    @pytest.mark.parametrize("required", ["", "cubic_phase_error: 45 deg, "])
    def test_an_error_is_verified_with_the_cubic_phase_that_islr_holds(self, required: str) -> None:
        """The cubic of a velocity random walk has 1.8 times the power of what is beyond: both are at its limit."""
        allocation = "allocation: {model: full, combine: rss}\n"
        text = f"{MISSION}requirements: {{quadratic_phase_error: 180 deg, {required}islr: -30 dB}}\n{allocation}"
        mission = parse_mission(text)
        (row,) = verify_mission(mission, "receiver.imu.velocity_random_walk").rows
        (checked,) = [one for one in check_mission(mission, TODAY).rows if one.id == row.id]
        assert (row.boundary_error, checked.binding_requirement) == (pytest.approx(checked.allowable), "islr")
        assert row.verdict in ("confirmed", "conservative")
        assert row.measured_db == pytest.approx(row.requirement_db, abs=1.5)
