"""Covariances and common errors against exact ranges: no expansion, no gradient of ours."""

import math

import numpy as np
import pytest

from bisar_budget.budget.check import check_mission
from bisar_budget.mission.load import parse_mission
from bisar_budget.simulator.phase_history import Errors, PathError
from bisar_budget.verifier.limits import verify_mission
from bisar_budget.verifier.study import Study
from tests.conftest import TODAY, findings, mission_text, row
from tests.simulate.conftest import images_of
from tests.simulate.test_full_model import random_missions

STEP = np.array([0.5, 0.5, 0.5, 2e-3, 2e-3, 2e-3])  # m, m/s: small for the first order, large for the fit


def exact(study: Study, *vectors) -> np.ndarray:
    """Quadratic and cubic phase and displacement, (4,), of position and velocity errors (6,) of the platforms."""
    errors = [PathError(position=tuple(v[:3]), velocity=tuple(v[3:6])) for v in vectors]
    effect = study.collection.effect(Errors(transmitter=errors[0], receiver=errors[1]))
    return np.array([effect.quadratic, effect.cubic, *effect.displacement])


def exact_gradient(study: Study, *platforms: str) -> np.ndarray:
    """Central differences of `exact` by the six errors of the platforms together, (4, 6)."""
    columns = []
    for index, step in enumerate(STEP):
        error = np.zeros(6)
        error[index] = step
        plus, minus = (
            exact(study, *(sign * error * (name in platforms) for name in ("transmitter", "receiver")))
            for sign in (1, -1)
        )
        columns.append((plus - minus) / (2 * step))
    return np.stack(columns, axis=1)


def random_covariance(rng: np.random.Generator) -> np.ndarray:
    factor = np.diag([1, 2, 1, 5e-3, 2e-3, 8e-3]) @ rng.standard_normal((6, 3))
    return factor @ factor.T


def test_root_sum_squares_are_those_of_exact_gradients_on_random_geometries() -> None:
    """40 collections, a covariance of rank 3 in a random frame: QPE, cubic and displacement within 1 %.

    Rank 3 of 6 makes the correlations matter: without them the same aggregates are off by over 20 %.
    """
    rng = np.random.default_rng(5)
    off = []
    for mission in random_missions(40, seed=21):
        geometry = mission.geometry
        platform, frame = rng.choice(["transmitter", "receiver"]), rng.choice(["scene", "track", "look"])
        axes = np.kron(np.eye(2), np.array(getattr(geometry, platform).frame(frame)))
        c = 1e-6 * random_covariance(rng)  # so small that all effects are proportional to the errors
        gradient = exact_gradient(Study(mission), platform) @ axes.T
        want = np.einsum("ij,jk,ik->i", gradient, c, gradient)
        without = np.einsum("ij,jj,ij->i", gradient, c, gradient)
        off.append(abs(math.sqrt(without[0] / want[0]) - 1))
        error = mission.platforms._asdict()[platform].motion_error
        text = {
            "platforms": {
                name: {
                    "position": list(getattr(geometry, name).position),
                    "velocity": list(getattr(geometry, name).velocity),
                    **({"motion_error": {"frame": str(frame), "covariance": c.tolist()}} if name == platform else {}),
                }
                for name in ("transmitter", "receiver")
            },
            "collection": {"aperture_time": 4},
            "allocation": {"combine": "rss", "model": "full"},
        }
        assert error.covariance is None
        found = findings(**text)
        for name in (f"{platform}.quadratic_phase_error", "mission.quadratic_phase_error"):
            assert row(found, name).qpe_full_rad == pytest.approx(math.sqrt(want[0]), rel=0.01)
        assert row(found, "mission.cubic_phase_error").declared == pytest.approx(math.sqrt(want[1]), rel=0.01)
        assert row(found, "mission.location_error").declared == pytest.approx(math.sqrt(want[2] + want[3]), rel=0.01)
    assert np.median(off) > 0.2


def test_root_sum_square_is_the_spread_of_exact_draws() -> None:
    """2000 draws of a correlated error by exact ranges: their rms is known to 1.6 %, three times that is held."""
    rng = np.random.default_rng(2)
    c = random_covariance(rng)
    mission = parse_mission(
        mission_text(
            platforms__receiver__motion_error={"covariance": c.tolist()},
            allocation={"combine": "rss", "model": "full"},
        )
    )
    study = Study(mission)
    draws = rng.multivariate_normal(np.zeros(6), c, 2000)
    results = np.array([exact(study, np.zeros(6), draw) for draw in draws])
    found = check_mission(mission, TODAY)
    rms = np.sqrt(np.mean(results**2, axis=0))
    assert row(found, "receiver.quadratic_phase_error").declared == pytest.approx(rms[0], rel=0.05)
    assert row(found, "mission.location_error").declared == pytest.approx(math.hypot(rms[2], rms[3]), rel=0.05)


def test_common_errors_are_those_of_exact_ranges() -> None:
    """40 collections, both platforms wrong by the same: phases and displacement of each axis, signed.

    As near as the platforms' own rows come, 2 %; of the cubic phase the fit leaves 5 %. The floors are a
    millimetre and the phase of half a micrometre.
    """
    for mission in random_missions(40, seed=22):
        mission = mission._replace(common_motion_error=_common(position=1, velocity=1))
        study = Study(mission)
        gradient = exact_gradient(study, "transmitter", "receiver")
        sources = {source.id: source for source in study.sources}
        for index in range(6):
            source = sources[f"common.{('position', 'velocity')[index // 3]}.{'xyz'[index % 3]}"]
            moved = study.analysis.full.displacement(source.full, 1.0)
            got = np.array([source.full.qpe, source.full.cubic, *moved]) * STEP[index]
            want = gradient[:, index] * STEP[index]
            assert got[0] == pytest.approx(want[0], rel=0.02, abs=1e-4), source.id
            assert got[1] == pytest.approx(want[1], rel=0.05, abs=1e-4), source.id
            assert list(got[2:]) == pytest.approx(list(want[2:]), rel=0.02, abs=1e-3), source.id


def test_a_horizontal_common_position_error_has_no_limit_and_moves_the_image_by_itself() -> None:
    """The whole collection is elsewhere: exactly no phase, by 10 m and in exact ranges too."""
    for mission in random_missions(20, seed=23):
        study = Study(mission._replace(common_motion_error=_common(position=1)))
        sources = {source.id: source for source in study.sources}
        assert sources["common.position.x"].full.qpe == 0
        error = np.array([7.0, -7.0, 0, 0, 0, 0])
        quadratic, cubic, east, north = exact(study, error, error)
        assert abs(quadratic) < 1e-4
        assert abs(cubic) < 1e-4
        assert (east, north) == pytest.approx((7, -7), abs=1e-5)


def _common(**changes):
    return parse_mission(mission_text(common_motion_error=changes)).common_motion_error


def test_images_at_the_limits_of_common_errors_show_their_budgets() -> None:
    mission = parse_mission(mission_text(common_motion_error__velocity="1 mm/s", allocation__model="full"))
    rows = verify_mission(mission, "common.*").rows
    assert {r.verdict for r in rows} == {"confirmed"}
    assert [r.id for r in rows] == [
        "common.velocity.x",
        "common.velocity.y",
        "common.velocity.z",
        "common.acceleration.x",
        "common.acceleration.y",
        "common.acceleration.z",
    ]
    for r in rows:
        assert r.budget_rad == pytest.approx(math.pi / 4)


def test_simulated_is_the_most_probable_error_of_one_sigma_of_phase() -> None:
    """Its phase, by exact ranges, is √(gᵀCg)."""
    pairs = {"velocity.x-velocity.y": -0.8, "position.x-velocity.x": 0.3}
    covariance = {"position": "0.5 m", "velocity": "5 mm/s", "correlation": pairs}
    text = mission_text(
        platforms__receiver__motion_error={"covariance": covariance}, allocation={"combine": "rss", "model": "full"}
    )
    mission = parse_mission(text)
    one_sigma = row(check_mission(mission, TODAY), "receiver.quadratic_phase_error").declared
    assert images_of(text, rotated_only=True).effect.quadratic == pytest.approx(one_sigma, rel=0.01)


def test_simulated_common_errors_add_to_the_platforms_own() -> None:
    own = {"platforms__receiver__motion_error": {"velocity": ["5 mm/s", 0, 0]}}
    common = {"common_motion_error": {"velocity": ["5 mm/s", 0, 0]}}
    twice = {"platforms__receiver__motion_error": {"velocity": ["10 mm/s", 0, 0]}}
    t = {"platforms__transmitter__motion_error": {"velocity": ["5 mm/s", 0, 0]}}
    both = images_of(mission_text(**own, **common), rotated_only=True).effect
    same = images_of(mission_text(**twice, **t), rotated_only=True).effect
    assert (both.quadratic, *both.displacement) == pytest.approx((same.quadratic, *same.displacement))
