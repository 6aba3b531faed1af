"""Limits of sensors and clocks against time series and images; a limit that is off by a quarter is found."""

import math

import numpy as np
import pytest

from bisar_budget.effects.effect import subject
from bisar_budget.effects.random_effect import RandomError
from bisar_budget.effects.spectra import PowerLawPiece
from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.report.drawing import point_plot
from bisar_budget.simulator.point import simulate_point
from bisar_budget.simulator.realisations import _Tones
from bisar_budget.verifier.limits import verify_mission
from bisar_budget.verifier.spread_cases import verify_islr, verify_random
from bisar_budget.verifier.study import Study
from tests.conftest import ROOT
from tests.effects.test_random_errors import MISSION, OSCILLATORS
from tests.simulate.conftest import only_rotated_images

REST = """requirements: {cubic_phase_error: 45 deg, islr: -20 dB}
allocation: {model: full, combine: rss, coverage_factor: 2}
"""
LOOSE = REST.replace("-20 dB", "-1 dB")


def study(text: str) -> Study:
    return Study(parse_mission(text))


def of(one: Study, row_id: str) -> RandomError:
    return next(error for error in one.analysis.random if error.id == row_id)


def off(error: RandomError, factor: float) -> RandomError:
    """An error whose formulas say so much less than is true."""
    effect = error.full
    phases = effect._replace(covariance=0.0, rest=0.0)
    wrong = type(effect)(*(part * factor for part in phases))._replace(covariance=effect.covariance, rest=effect.rest)
    return error._replace(full=wrong, published=wrong)


@pytest.mark.parametrize(
    "row_id", ["receiver.imu.attitude", "receiver.imu.velocity_random_walk", "receiver.imu.gyro_bias"]
)
def test_a_limit_of_an_inertial_sensor_is_confirmed_and_a_wrong_one_is_not(row_id: str) -> None:
    one = study(MISSION + LOOSE)
    right = verify_random(one, of(one, row_id))
    assert right.verdict == "confirmed"
    measured = right.measured_cubic_rad if "gyro_bias" in row_id else right.measured_qpe_rad
    assert measured == pytest.approx(right.budget_rad, rel=0.05)
    assert verify_random(one, off(of(one, row_id), 0.8)).verdict == "optimistic"
    assert verify_random(one, off(of(one, row_id), 1.25)).verdict == "conservative"


# Of a link fewer time series are drawn.
@pytest.mark.parametrize("row_id", ["receiver.random.GNSS", "receiver.imu.gyro_bias", "timing.synchronization"])
def test_a_limit_by_the_location_is_confirmed_and_a_wrong_one_is_not(row_id: str) -> None:
    """What displaces is flown: slow wander of a position, a bias, errors of a link."""
    needs = "requirements: {quadratic_phase_error: 170 deg, location_error: 1 cm}\n"
    link = "synchronization: {interval: 2 s, error: 6 deg}\n"
    text = MISSION.replace("1.5 s}", "600 s}") + needs + link + "allocation: {model: full, coverage_factor: 2}\n"
    one = study(text)
    right = verify_random(one, of(one, row_id))
    assert (right.verdict, right.budget_rad) == ("confirmed", None)
    sure, much = (0.12, 1.5) if row_id == "timing.synchronization" else (0.06, 1.25)
    assert math.hypot(*right.measured_displacement_m) == pytest.approx(0.01, rel=sure)
    assert verify_random(one, off(of(one, row_id), 1 / much)).verdict == "optimistic"
    assert verify_random(one, off(of(one, row_id), much)).verdict == "conservative"


def test_the_power_that_noise_spreads_is_confirmed_within_half_a_decibel() -> None:
    one = study(MISSION.rstrip() + OSCILLATORS + REST)
    right = verify_random(one, of(one, "receiver.random.GNSS"))
    assert (right.verdict, right.requirement_db) == ("confirmed", pytest.approx(-23.02, abs=0.01))
    assert abs(right.measured_db - right.requirement_db) < 0.5
    assert verify_random(one, off(of(one, "receiver.random.GNSS"), 0.8)).verdict == "optimistic"
    assert verify_islr(one, subject("receiver", "islr")).verdict == "confirmed"
    assert verify_islr(one, subject("mission", "islr")).requirement_db == pytest.approx(-20, abs=0.01)


@pytest.mark.parametrize("time", ["1 ms", "40 ms", "0.4 s"])
def test_a_limit_of_noise_of_a_short_correlation_time_is_confirmed(time: str) -> None:
    """Drawn at the nodes of the exact ranges alone, 40 ms of 6 s had twice the phase that a whole time series has."""
    one = study(MISSION.replace("1.5 s", time) + LOOSE.replace(", islr: -1 dB", ""))
    right = verify_random(one, of(one, "receiver.random.GNSS"))
    assert right.verdict == "confirmed"
    assert right.measured_qpe_rad == pytest.approx(right.budget_rad, rel=0.05)
    assert verify_random(one, off(of(one, "receiver.random.GNSS"), 0.8)).verdict == "optimistic"


def test_noise_faster_than_every_drawn_tone_has_its_power() -> None:
    """Flat from 1 Hz to 1 GHz, which no tones resolve; it was left out and no longer spread anything."""
    tones = _Tones((PowerLawPiece(1.0, 1e9, 1e-12, 0.0),), 6.0)
    moments = np.linspace(-3, 3, 4001)
    (drawn,) = tones.at(moments, 1, np.random.default_rng(5))
    assert np.var(drawn) == pytest.approx(1e-12 * 1e9, rel=0.1)  # 4001 samples: 2.2 % of a variance


def test_the_limit_of_a_clock_is_in_decibels() -> None:
    one = study(MISSION.rstrip() + OSCILLATORS + LOOSE)
    found = verify_random(one, of(one, "receiver.oscillator"))
    assert (found.unit, found.verdict) == ("dB", "confirmed")
    factor = 10 ** (found.boundary_error / 20)
    assert of(one, "receiver.oscillator").full.judged(1.0) * factor == pytest.approx(found.budget_rad)


def test_one_time_series_is_flown_and_a_seed_names_it() -> None:
    text = MISSION.rstrip() + OSCILLATORS
    still = text[: text.index("    motion_error")]
    with only_rotated_images():
        *phases, without = (
            simulate_point(parse_mission(one)).effect.quadratic
            for one in (*(text + f"simulation: {{seed: {seed}}}\n" for seed in (1, 1, 2)), still)
        )
    assert phases[0] == phases[1] != phases[2]
    assert abs(without) < 1e-6
    one = study(text)
    sigma = math.hypot(*(e.full.quadratic * (e.declared or 0) for e in one.analysis.random))
    assert 0 < abs(phases[0]) < 5 * sigma
    assert np.isfinite(phases).all()


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_an_oscillator_is_flown_as_it_is_set(seed: int) -> None:
    """Free, nobody says when it was set: tones slower than an aperture moved the image by 200 m either way."""
    head = MISSION[: MISSION.index("    motion_error")]
    text = f"{head.rstrip()}{OSCILLATORS}simulation: {{seed: {seed}}}\n"
    clock, link = (
        "timing_error: {constant: 10 ns, linear: 1e-10}\n",
        "synchronization: {interval: 0.5 s, error: 0 deg}\n",
    )
    missions = [parse_mission(one) for one in (text, text + clock, head + clock, text + link)]
    free, stated, quiet, linked = map(simulate_point, missions)
    said = [" ".join(point_plot.summary(*one).split()) for one in ((free, missions[0]), (stated, missions[1]))]
    assert ["without mean and slope" in one for one in said] == [True, False]
    cell = 1.0  # m of range, at 150 MHz: what is left of a clock's quadratic phase moves the image by less
    assert math.hypot(*free.effect.displacement) < cell
    assert math.hypot(*quiet.effect.displacement) > cell
    assert math.dist(stated.effect.displacement, quiet.effect.displacement) < cell
    assert abs(free.effect.quadratic) > 0.01  # and defocuses as before
    assert 0 < math.hypot(*linked.effect.displacement) < cell


def test_an_oscillator_that_a_direct_path_cancels_is_not_in_the_images_of_islr() -> None:
    """It spreads nothing; drawn with the rest, it made an image of -7.7 dB at a limit of -23 dB."""
    mission = load_mission(str(ROOT / "specs" / "missions" / "ocxo_direct_path.yaml"))
    verdicts = {row.id: row.verdict for row in verify_mission(mission, "*.islr").rows}
    assert verdicts == {
        "transmitter.islr": "not_evaluated",  # nothing that spreads is its own
        "receiver.islr": "confirmed",
        "mission.islr": "confirmed",
    }
