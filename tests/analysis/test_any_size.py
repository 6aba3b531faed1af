"""The full model is true for errors of any size: a sample of the proof in `docs/prove_any_size.py`."""

import importlib.util
import math
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from numpy.polynomial import legendre

from bisar_budget.budget.check import check_mission
from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.geometry import PlatformState
from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.mission.model import Mission
from tests import reference
from tests.compared import DAY, FLOOR_RAD, SHARE, Compared, _allowable, compared
from tests.conftest import seeds
from tests.families import DIRECT_PATH, FAMILIES, LARGEST_TURN, largest_turn, mission_text
from tests.reference import Error

ROOT = Path(__file__).resolve().parents[2]
SPECS = ROOT / "specs" / "missions"
STEPS = 40
TANDEM_X = """schema_version: 1
name: TanDEM-X on its circular orbit
radar: {{ center_frequency: 9.65 GHz, bandwidth: 100 MHz }}
collection: {{ aperture_time: 5 s }}
scene: {{ height_error: 100 m }}
platforms:
  transmitter: {{ position: [353.9 km, 0, 505.4 km], velocity: [0, 7.6 km/s, 0]{curved} }}
  receiver: {{ position: [354.2 km, 50 m, 505.4 km], velocity: [0, 7.6 km/s, 0]{curved} }}
"""


def _bent(text: str, seed: int) -> str:
    rng, mission = np.random.default_rng(seed), parse_mission(text)
    tree, half = yaml.safe_load(text), mission.collection.aperture_time / 2
    for name in ("transmitter", "receiver"):
        state = getattr(mission.geometry, name)
        for key, power in (("jerk", 3), ("snap", 4)):
            level = [1.0, 1.0, 0.0]  # none of them takes a platform below the ground
            edge = 0.05 * min(state.slant_range, 10e3) * rng.uniform() * rng.normal(size=3) / math.sqrt(3) * level
            tree["platforms"][name][key] = (edge * math.factorial(power) / half**power).tolist()
    return yaml.safe_dump(tree)


def named(mission: Mission, row_id: str) -> Error:
    return next(error for error in reference.errors_of(mission) if error.id == row_id)


class TestTheCheckIsThatOfExactRanges:
    @pytest.mark.parametrize("seed", seeds(6, 2, 3))
    @pytest.mark.parametrize("family", FAMILIES)
    def test_every_number_of_a_random_mission(self, family: str, seed: int) -> None:
        found = compared(parse_mission(mission_text(family, seed)), STEPS)
        assert len(found) > 20
        assert [str(one) for one in found if one.is_miss] == []

    @pytest.mark.parametrize("seed", seeds(3, 1))
    @pytest.mark.parametrize("family", FAMILIES)
    def test_every_number_of_a_random_mission_with_a_direct_path(self, family: str, seed: int) -> None:
        found = compared(parse_mission(mission_text(family, seed) + DIRECT_PATH), STEPS)
        assert len(found) > 20
        assert [str(one) for one in found if one.is_miss] == []

    @pytest.mark.parametrize("family", FAMILIES)
    def test_every_number_on_a_path_that_bends_more_than_once(self, family: str) -> None:
        """Jerk and snap move the ends of the aperture by up to 5 % of the slant range, or 500 m."""
        found = compared(parse_mission(_bent(mission_text(family, 5), 5)), STEPS)
        assert len(found) > 20
        assert [str(one) for one in found if one.is_miss] == []

    @pytest.mark.parametrize("example", ["sentinel1_elements_besancon", "astra_drone", "sentinel1_aircraft_log"])
    def test_every_number_of_an_example_with_an_orbit(self, example: str) -> None:
        """Paths by elements, a log and a place on the Earth; errors that the reference does not have are left out."""
        pytest.importorskip("sgp4")
        mission = load_mission(str(SPECS / f"{example}.yaml"))
        platforms = mission.platforms
        for name, one in zip(platforms._fields, platforms, strict=True):
            bare = one._replace(motion_error=one.motion_error._replace(imu=None))
            platforms = platforms._replace(**{name: bare})
        assert platforms.transmitter.path.age is not None
        found = compared(mission._replace(platforms=platforms), STEPS)
        assert len(found) > 90
        assert [str(one) for one in found if one.is_miss] == []

    def test_a_direct_path_that_turns_far_has_the_nodes_for_it(self) -> None:
        """Jets that pass each other at 3 km, 2.6 km of way in half an aperture: six nodes were 2 % off."""
        found = compared(parse_mission(mission_text("jets", 32) + DIRECT_PATH), STEPS)
        assert [str(one) for one in found if one.is_miss] == []


class TestTheReferenceItself:
    """It is held to print and to a plain fit of directly computed ranges before anything is held to it."""

    def test_section_v_of_both_signs(self) -> None:
        """Section V, receiver ṽ_z = ±1.9 m/s: 0.78 and 0.02 rad, of images (physics by exact ranges)."""
        mission = load_mission(str(SPECS / "rigling_moses_section_v.yaml"))
        error = named(mission, "receiver.velocity.z")._replace(declared=1.9)
        both = sorted(np.abs(reference.at_declared(mission, [error]).qpe[:, 0]))
        assert both == pytest.approx([0.02, 0.78], abs=0.005)  # printed digits

    @pytest.mark.parametrize(
        ("curved", "want", "floor"), [("", 0.0, 1e-5), (", acceleration: [-0.431, 0, -8.378]", 1.59, 0.005)]
    )
    def test_a_height_error_under_a_satellite(self, curved: str, want: float, floor: float) -> None:
        mission = parse_mission(TANDEM_X.format(curved=curved))
        (qpe,) = np.abs(reference.at_declared(mission, [named(mission, "mission.terrain")]).qpe).max(axis=0)
        assert qpe == pytest.approx(want, abs=floor)

    @pytest.mark.parametrize("family", FAMILIES)
    def test_against_a_plain_fit_of_ranges(self, family: str) -> None:
        """The range error at the place found, sampled evenly and fitted to order 12: least in V, and the phases."""
        mission = parse_mission(mission_text(family, 1))
        declared = [error for error in reference.errors_of(mission) if error.declared]
        responses = reference.at_declared(mission, declared)
        assert np.isfinite(responses.qpe).mean() > 0.9
        x = np.linspace(-1, 1, 801)
        tau = x * mission.collection.aperture_time / 2
        nodes, weights = legendre.leggauss(24)
        b2 = (mission.radar.bandwidth / mission.radar.center_frequency) ** 2 / 12
        states = (mission.geometry.transmitter, mission.geometry.receiver)
        for index, error in enumerate(declared):
            for sign, size in enumerate((error.declared or 0.0, -(error.declared or 0.0))):
                place = (*responses.place[sign, index], 0.0)
                if math.isnan(place[0]):  # no ground point
                    continue
                left = size * SPEED_OF_LIGHT_MPS * sum(t * tau**n for n, t in enumerate(error.clock))
                slopes = np.zeros((2, len(x)))
                for state, paths in zip(states, error.paths, strict=True):
                    true = path(state, tau)
                    measured = true + size * (
                        paths[0][:, None] + paths[1][:, None] * tau + paths[2][:, None] * tau**2 / 2
                    )
                    left = left + np.linalg.norm(true, axis=0)
                    look = measured - np.array(place)[:, None]
                    left = left - np.linalg.norm(look, axis=0)
                    slopes += look[:2] / np.linalg.norm(look, axis=0)
                p = 2 * math.pi / mission.radar.wavelength * legendre.legfit(x, left, 12)[:4]
                # Directly computed ranges of a geostationary satellite are rounded to 7e-9 m.
                fits = (legendre.legval(nodes, legendre.legfit(x, one, 12)) for one in (*slopes, left))
                east, north, rest = fits
                for slope in (east, north):  # no step has a phase to take away
                    along, square = (
                        (1 + b2) * (weights @ (slope * one)) / 2 - (weights @ slope) * (weights @ one) / 4
                        for one in (rest, slope)
                    )
                    assert 2 * math.pi / mission.radar.wavelength * along / math.sqrt(square) == pytest.approx(
                        0, abs=1e-4
                    )
                assert 1.5 * p[2] == pytest.approx(responses.qpe[sign, index], rel=1e-6, abs=1e-4)
                assert 2.5 * p[3] == pytest.approx(responses.cubic[sign, index], rel=1e-6, abs=1e-4)

    def test_a_horizontal_error_of_both_platforms_moves_the_image_by_itself(self) -> None:
        text = mission_text("aircraft", 1).replace("platforms:", "common_motion_error: { position: 0 }\nplatforms:")
        mission = parse_mission(text)
        error = named(mission, "common.position.x")._replace(declared=7.0)
        found = reference.at_declared(mission, [error])
        assert found.place[:, 0] == pytest.approx(np.array([[7, 0], [-7, 0]]), abs=1e-6)
        assert np.abs(found.qpe).max() < 1e-6

    def test_an_allowable_is_held_from_both_sides(self) -> None:
        """A phase that grows as the size: the limit, 1 rad, is reached at 1."""
        error = Error("a", "transmitter", np.zeros((2, 3, 3)), np.zeros(4), None, 2.0)
        sizes = np.sort(np.append(np.geomspace(0.01, 2, 200), [1 - SHARE, 1, 1 + SHARE]))
        excess = (sizes - 1) / max(SHARE, FLOOR_RAD)

        def missed(found: float | None, sizes: np.ndarray = sizes, excess: np.ndarray = excess) -> bool:
            return _allowable("allowable", error, found, sizes, excess).is_miss

        assert not missed(1.0)
        assert not missed(1 + 0.9 * SHARE)
        assert missed(0.95)
        assert missed(1.05)
        assert missed(None)
        below = sizes <= 0.99
        assert not missed(None, sizes[below], excess[below])
        assert missed(2.1, sizes, np.where(sizes > 2, 0.0, -5.0))
        assert missed(1.0, sizes, np.where((sizes > 0.3) & (sizes < 0.4), 3.0, excess))
        assert missed(None, sizes, np.where(sizes > 1.5, np.inf, -5.0))


class TestFamilies:
    @pytest.mark.parametrize("family", FAMILIES)
    def test_a_seed_names_one_mission_within_the_bounds(self, family: str) -> None:
        texts = [mission_text(family, seed) for seed in range(20)]
        assert texts == [mission_text(family, seed) for seed in range(20)]
        assert len(set(texts)) == 20
        missions = [parse_mission(text) for text in texts]
        assert max(map(largest_turn, missions)) <= LARGEST_TURN
        squints = [state.squint for m in missions for state in (m.geometry.transmitter, m.geometry.receiver)]
        assert max(abs(squint or 0) for squint in squints) <= math.radians(60.1)


class TestTheScript:
    """`docs/prove_any_size.py` counts what disagrees, and says so by its exit code."""

    def run(self, monkeypatch: pytest.MonkeyPatch, found: list[Compared] | Exception) -> int:
        spec = importlib.util.spec_from_file_location("prove_any_size", ROOT / "docs" / "prove_any_size.py")
        assert spec is not None
        assert spec.loader is not None
        script = importlib.util.module_from_spec(spec)
        monkeypatch.setattr(sys, "path", [*sys.path])
        spec.loader.exec_module(script)

        def given(*_: object) -> list[Compared]:
            if isinstance(found, Exception):
                raise found
            return found

        monkeypatch.setattr(script, "compared", given)
        monkeypatch.setattr(sys, "argv", ["prove_any_size.py", "--missions", "6", "--processes", "1", "--all"])
        code: int = script.main()
        return code

    def test_agreement_and_a_miss(self, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
        near, far = (Compared("qpe_full_rad", "a", 1.0, 1.0 + off / 100, off) for off in (0.9, 1.1))
        assert self.run(monkeypatch, [near]) == 0
        assert "6 missions, 6 numbers, 0 misses" in capsys.readouterr().out
        assert self.run(monkeypatch, [near, far]) == 1
        assert "jets 0: qpe_full_rad of a" in capsys.readouterr().out

    def test_a_crash_is_no_agreement(
        self, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
    ) -> None:
        assert self.run(monkeypatch, ZeroDivisionError("x")) == 1
        assert "crash: seed 0: ZeroDivisionError: x" in capsys.readouterr().out


def path(state: PlatformState, tau: np.ndarray) -> np.ndarray:
    """Positions (3, n). [m]"""
    return np.array([state.at(float(t))[0] for t in tau]).T


def test_a_velocity_error_that_turns_doppler_away_is_followed_exactly() -> None:
    """9 m/s of 72 m/s leave 7 % of what the gradients span: with the slopes of the centre it was 177 mm of 187."""
    mission = parse_mission(mission_text("aircraft", 126))
    error = next(e for e in reference.errors_of(mission) if e.id == "receiver.velocity.cross")
    want = reference.at_declared(mission, [error]).place[0, 0]
    found = next(r for r in check_mission(mission, DAY).rows if r.id == error.id)
    assert found.displacement_m == pytest.approx(tuple(want), rel=1e-3)


def test_beside_a_fold_the_hidden_phase_reaches_the_limit() -> None:
    """The point moves 12 km and passes near a fold: the way goes on, and what is hidden grows to the limit."""
    mission = parse_mission(mission_text("aircraft", 126))
    error = next(e for e in reference.errors_of(mission) if e.id == "transmitter.position.z")
    size = next(r for r in check_mission(mission, DAY).rows if r.id == error.id).allowable_full
    found = reference.Lanes(mission, [error]).follow(np.array([[-0.5, -0.9, -0.999, -1.001]]) * size)
    judged = found.judged(1.0)[0] / (0.5 * mission.requirements.quadratic_phase_error)  # the platform's half
    assert (judged[:3] < 1).all()
    assert judged[3] > 1
    assert found.hidden[0, 3] > 5 * abs(found.qpe[0, 3])


def test_a_crest_between_two_sizes_is_not_stepped_over() -> None:
    """The phase is up to 2.6 % above its limit from 2.90 to 3.40 km, and again from 4.22 km on."""
    mission = parse_mission(mission_text("satellite_aircraft", 535))
    error = next(e for e in reference.errors_of(mission) if e.id == "transmitter.position.z")
    size = next(r for r in check_mission(mission, DAY).rows if r.id == error.id).allowable_full
    limit = 0.5 * math.pi * 1.28  # the platform's half of what autofocus corrects
    sizes = np.array([0.5, 0.99, 1.0, 1.01, 1.1, 1.4]) * size
    qpe = np.abs(reference.Lanes(mission, [error]).follow(sizes[None]).qpe[0])
    assert qpe[2] == pytest.approx(limit, rel=0.003)
    assert (qpe[[0, 1, 5]] < limit).all()
    assert (qpe[[3, 4]] > limit).all()
