"""Images of delays in the air: what `verify` says of their limits, and what `simulate` flies."""

import math

import numpy as np
import pytest

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.mission.load import parse_mission
from bisar_budget.simulator.collection import PointCollection
from bisar_budget.simulator.point import declared_errors
from bisar_budget.simulator.realisations import delay_courses, drawn_errors
from bisar_budget.verifier.limits import verify_mission
from bisar_budget.verifier.spread_cases import verify_random
from bisar_budget.verifier.study import Study
from tests.conftest import mission_text
from tests.effects.test_propagation import ORBITS, SECTION_V, TECU

FULL = {"allocation__model": "full", "allocation__combine": "each"}


def limits(text: str, needs: str, only: str = "propagation.*") -> dict[str, str]:
    mission = parse_mission(f"{text.strip()}\nrequirements: {needs}\n")
    return {one.id.removeprefix("propagation."): one.verdict for one in verify_mission(mission, only).rows}


def test_images_confirm_limits_within_the_air() -> None:
    assert limits(SECTION_V, "{location_error: 1 m}") == {
        "transmitter.zenith_delay": "confirmed",
        "receiver.zenith_delay": "confirmed",
        "zenith_delay": "confirmed",  # of both legs
    }


def test_images_confirm_limits_from_orbit_by_the_phase() -> None:
    found = limits(ORBITS, "{quadratic_phase_error: 10 deg}", "propagation.*zenith_*")
    assert set(found.values()) == {"confirmed"}
    assert len(found) == 6


def test_dispersion_has_no_image_and_says_why() -> None:
    (row,) = verify_mission(parse_mission(ORBITS), "propagation.dispersion").rows
    assert row.verdict == "not_evaluated"
    assert "over the band" in str(row.reason)


def test_a_limit_that_is_wrong_is_seen() -> None:
    """The effect of the group alone: its displacement is another one, and the images say so."""
    text = ORBITS.replace("[500 km, 20 km, 600 km]", "[300 km, 500 km, 600 km]").replace("30 s", "8 s")
    study = Study(parse_mission(f"{text.strip()}\nrequirements: {{location_error: 5 m}}\n"))
    error = next(one for one in study.analysis.random if one.id == "propagation.transmitter.zenith_electron_content")
    assert verify_random(study, error).verdict == "confirmed"
    smaller = error.full._replace(east=error.full.east * 0.8, north=error.full.north * 0.8)
    assert verify_random(study, error._replace(full=smaller, published=smaller)).verdict == "optimistic"


# ---------------------------------------------------------------------- delays that change within the aperture
@pytest.mark.parametrize("correlation_time", ["1 ms", "10 s", "20 min"])
@pytest.mark.parametrize(
    "needs",
    ["{islr: -20 dB, cubic_phase_error: 360 deg}", "{quadratic_phase_error: 30 deg}", "{location_error: 5 mm}"],
)
def test_images_confirm_limits_of_air_that_changes(needs: str, correlation_time: str) -> None:
    text = SECTION_V.replace("zenith_electron_content: 2 TECU", f"correlation_time: {correlation_time}")
    assert limits(text, needs, "propagation.*zenith_delay") == {
        "transmitter.zenith_delay": "confirmed",
        "receiver.zenith_delay": "confirmed",
        "zenith_delay": "confirmed",
    }


@pytest.mark.parametrize("needs", ["{islr: -20 dB, cubic_phase_error: 360 deg}", "{quadratic_phase_error: 10 deg}"])
def test_images_confirm_limits_of_free_electrons_that_change(needs: str) -> None:
    text = ORBITS.replace("20 TECU", "20 TECU, correlation_time: 5 min")
    found = limits(text, needs, "propagation.*zenith_*")
    assert set(found.values()) == {"confirmed"}
    assert len(found) == 6


def test_a_limit_of_what_spreads_that_is_wrong_is_seen() -> None:
    """A spread that is said to be a quarter less, as if the line of sight did not turn."""
    text = SECTION_V.replace("zenith_electron_content: 2 TECU", "correlation_time: 10 s")
    study = Study(parse_mission(f"{text.strip()}\nrequirements: {{islr: -20 dB, cubic_phase_error: 360 deg}}\n"))
    error = next(one for one in study.analysis.random if one.id == "propagation.zenith_delay")
    assert verify_random(study, error).verdict == "confirmed"
    smaller = error.full._replace(spread=error.full.spread * 0.75)
    assert verify_random(study, error._replace(full=smaller, published=smaller)).verdict == "optimistic"


def test_where_only_islr_takes_a_cubic_phase_it_is_drawn_too() -> None:
    """A squinted leg bends the delay by a cubic as well; without a requirement of its own ISLR holds it.

    4/175·φ₃² is more than images show of a cubic phase, by 0.8 dB.
    """
    text = ORBITS.replace("[500 km, 20 km, 600 km]", "[300 km, 500 km, 600 km]")
    mission = parse_mission(f"{text.strip()}\nrequirements: {{islr: -60 dB}}\n")
    (row,) = verify_mission(mission, "propagation.transmitter.zenith_delay").rows
    assert row.verdict == "conservative"
    assert row.measured_db - row.requirement_db == pytest.approx(-0.8, abs=0.3)


def test_what_is_stated_as_an_effect_has_no_image() -> None:
    others = [{"name": "a", "cubic_phase_error": "1 deg", "location_error": "1 cm", "islr": "-40 dB"}]
    needs = {"cubic_phase_error": "22.5 deg", "islr": "-20 dB", "location_error": "1 m"}
    found = verify_mission(parse_mission(mission_text(**FULL, other_errors=others, requirements=needs)), "other.*")
    assert [one.id for one in found.rows] == [f"other.a.{key}" for key in others[0] if key != "name"]
    for one in found.rows:
        assert one.verdict == "not_evaluated"
        assert one.reason == "stated by its effect: there is no motion to simulate"


# ---------------------------------------------------------------------- what is flown
def test_draws_of_a_leg_are_one_number_times_its_course() -> None:
    mission = parse_mission(ORBITS)
    error = next(one for one in Analysis(mission).random if one.id == "propagation.receiver.zenith_electron_content")
    times = np.linspace(-15, 15, 7)
    drawn = delay_courses(mission, error, times, 20_000, np.random.default_rng(4))
    course = drawn[0] / drawn[0, 3]
    assert drawn == pytest.approx(np.outer(drawn[:, 3], course))
    x, y, z = (np.asarray(one) for one in mission.geometry.receiver.place(times))
    level = np.hypot(x, y) / np.sqrt(x**2 + y**2 + z**2) * 6371 / 6721  # a shell at 350 km
    want = 40.308 * 20 * TECU / 1.25e9**2 / np.sqrt(1 - level**2)
    assert drawn.std(axis=0) == pytest.approx(want, rel=0.015)  # 20 000 draws know a sigma to 0.5 %


def test_draws_of_air_that_changes_forget_in_its_time() -> None:
    """Of one air both legs have the same delay at every moment: the mapping of each, added."""
    text = SECTION_V.replace("zenith_electron_content: 2 TECU", "correlation_time: 2 s")
    mission = parse_mission(text)
    by_id = {one.id.removeprefix("propagation."): one for one in Analysis(mission).random}
    times = np.linspace(-3, 3, 7)
    drawn = delay_courses(mission, by_id["zenith_delay"], times, 20_000, np.random.default_rng(4))
    sight = [math.hypot(30.41, 6) / 6, 1 / math.sin(math.radians(13.6))]
    assert drawn[:, 3].std() == pytest.approx(0.05 * sum(sight), rel=0.02)
    between = np.corrcoef(drawn.T)
    assert between[3] == pytest.approx(np.exp(-np.abs(times) / 2), abs=0.02)
    alone = delay_courses(mission, by_id["receiver.zenith_delay"], times, 20_000, np.random.default_rng(4))
    assert alone[:, 3] / drawn[:, 3] == pytest.approx(sight[1] / sum(sight), rel=1e-3)


def test_a_changing_delay_is_flown() -> None:
    """Seeds together have the sigmas of the row."""
    text = ORBITS.replace("zenith_electron_content: 20 TECU", "correlation_time: 5 min")
    text = text.replace("{zenith_delay: 5 cm", "{zenith_delay: 2 mm")
    found = []
    for seed in range(300):
        mission = parse_mission(f"{text.strip()}\nsimulation: {{seed: {seed}}}\n")
        effect = PointCollection(mission, mission.geometry).effect(declared_errors(mission))
        found.append((effect.quadratic, effect.cubic, *effect.displacement))
    (error,) = (one for one in Analysis(mission).random if one.id == "propagation.zenith_delay")
    quadratic, cubic, east, north = np.sqrt(np.square(found).mean(axis=0))  # 300 of them know a sigma to 4 %
    assert quadratic == pytest.approx(error.full.quadratic * error.declared, rel=0.12)
    assert cubic == pytest.approx(error.full.cubic * error.declared, rel=0.12)
    assert math.hypot(east, north) == pytest.approx(error.full.displacement * error.declared, rel=0.12)


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("text", [SECTION_V, ORBITS], ids=["flat", "orbits"])
def test_the_air_is_flown_as_it_is_drawn(text: str, seed: int) -> None:
    """An image of all declared errors has the displacement of the drawn delays, one number of both legs each."""
    mission = parse_mission(f"{text.strip()}\nsimulation: {{seed: {seed}}}\n")
    errors = declared_errors(mission)
    collection = PointCollection(mission, mission.geometry)
    effect = collection.effect(errors)
    analysis = Analysis(mission)
    total = np.zeros(4)
    half = mission.collection.aperture_time / 2
    for error in (one for one in analysis.random if not one.counted_in):
        rng = np.random.default_rng([seed, *error.id.encode()])
        times = np.linspace(-half, half, 4097)
        (drawn,) = delay_courses(mission, error, times, 1, rng)
        if not drawn.any():
            continue
        of_unit = delay_courses(mission, error, times, 1, _One())
        total += drawn[0] / of_unit[0, 0] * _signed(error.full.covariance[:4, :4]) * (error.declared or 0.0)
    assert effect.displacement == pytest.approx(total[2:], rel=0.01, abs=1e-3)
    assert effect.quadratic == pytest.approx(total[0], rel=0.02, abs=2e-3)
    assert (drawn_errors(analysis).electrons is not None) == (text is ORBITS)


class _One(np.random.Generator):
    """A generator whose draws are one sigma."""

    def __init__(self) -> None:
        super().__init__(np.random.PCG64(0))

    def standard_normal(self, *size: object, **_: object) -> np.ndarray:  # type: ignore[override]
        return np.ones(size)


def _signed(covariance: np.ndarray) -> np.ndarray:
    """Effects of a longer leg by a unit: an error of one course has a covariance of rank one. East is negative."""
    effects = np.sqrt(np.diagonal(covariance)) * np.sign(covariance[2])
    return np.asarray(-effects * math.copysign(1.0, effects[2]))
