"""The full model against exact ranges on random collections, and against images at squints."""

import importlib.util
import math

import numpy as np
import pytest

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.budget.check import check_mission
from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.faults import MissionError
from bisar_budget.mission.load import parse_mission
from bisar_budget.simulator.phase_history import cell_centres, exact_effect, path
from bisar_budget.verifier.limits import verify_mission
from bisar_budget.verifier.study import Study
from tests.conftest import ROOT, TODAY, findings, mission_text
from tests.conftest import row as row_of
from tests.simulate.conftest import collection, platform


def random_missions(count: int, seed: int, climbing: bool = True):
    """X-band, 4 s, ranges of 4 to 60 km, any azimuth, squints to 60°, gradients at least 10° apart."""
    rng = np.random.default_rng(seed)
    while count:
        platforms = {}
        for name in ("transmitter", "receiver"):
            azimuth, speed = rng.uniform(0, 2 * math.pi), rng.uniform(30, 250)
            motion = azimuth + rng.choice([-1, 1]) * math.pi / 2 + rng.uniform(-1, 1) * math.pi / 3
            platforms[name] = {
                "slant_range": float(10 ** rng.uniform(math.log10(4e3), math.log10(6e4))),
                "azimuth": float(azimuth),
                "elevation": float(rng.uniform(math.radians(5), math.radians(60))),
                "speed": float(speed),
                "motion_azimuth": float(motion),
                "climb": float(rng.uniform(-0.1, 0.1) * speed) if climbing else 0.0,
            }
        try:
            mission = parse_mission(mission_text(platforms=platforms, collection={"aperture_time": 4}))
        except MissionError:  # degenerate, or it dives
            continue
        if math.degrees(mission.geometry.gradient_angle) >= 10:
            count -= 1
            yield mission


@pytest.mark.parametrize("squint", [0, 45])
def test_images_at_the_full_limits_show_their_budgets(squint: float) -> None:
    """Each axis of velocity and acceleration, both platforms, each error at its full limit: within 5 %."""
    geometry = collection(squint).geometry
    platforms = {
        name: {"position": list(getattr(geometry, name).position), "velocity": list(getattr(geometry, name).velocity)}
        for name in ("transmitter", "receiver")
    }
    mission = parse_mission(mission_text(platforms=platforms, allocation__model="full"))
    seen = 0
    for only in ("*.velocity.*", "*.acceleration.*"):
        for row in verify_mission(mission, only).rows:
            assert row.equal_loss_qpe_rad == pytest.approx(row.budget_rad, rel=1e-3)
            assert row.measured_equal_loss_qpe_rad == pytest.approx(row.budget_rad, rel=1e-3)
            assert row.measured_qpe_rad == pytest.approx(row.predicted_qpe_rad, rel=1e-3)
            seen += 1
            assert row.verdict == "confirmed", row
    assert seen >= 8


def test_a_horizontal_error_common_to_both_platforms_only_moves_the_image() -> None:
    """The whole collection is elsewhere: by first order the effects of both cancel, whatever the geometry."""
    for mission in random_missions(20, seed=8):
        analysis = Analysis(mission)
        sources, full = {s.id: s for s in analysis.sources}, analysis.full
        for axis, moved in (("x", (1.0, 0.0)), ("y", (0.0, 1.0))):
            t, r = (sources[f"{name}.position.{axis}"].full for name in ("transmitter", "receiver"))
            assert t.qpe == pytest.approx(-r.qpe, rel=1e-9)
            assert t.cubic == pytest.approx(-r.cubic, rel=1e-9)
            both = [a + b for a, b in zip(full.displacement(t, 1.0), full.displacement(r, 1.0), strict=True)]
            assert both == pytest.approx(moved, abs=1e-9)


@pytest.mark.parametrize(
    ("squint", "platform", "axis", "taylor", "full"),
    [
        (0, "receiver", "y", 1.572, 1.669),
        (30, "receiver", "y", 3.610, 2.071),
        (30, "transmitter", "x", 0.059, 1.718),
        (45, "transmitter", "x", 0.059, 1.813),
    ],
)
def test_phases_at_four_times_the_published_limit(squint, platform, axis, taylor, full) -> None:
    """Computed independently for ranges and heights as printed, to a few in the third digit; Table II says 1.571."""
    geometry = collection(squint).geometry
    platforms = {
        name: {"position": list(getattr(geometry, name).position), "velocity": list(getattr(geometry, name).velocity)}
        for name in ("transmitter", "receiver")
    }
    mission = parse_mission(mission_text(platforms=platforms))
    analysis = Analysis(mission)
    source = next(s for s in analysis.sources if s.id == f"{platform}.velocity.{axis}")
    size = math.pi / 2 / abs(source.effect.qpe)
    exact = analysis.exact
    before = exact.k[0] * float(exact.fit[2] @ exact.range_error(analysis.errors.lanes(source))[:, 0])
    assert abs(before) * size == pytest.approx(taylor, rel=0.005, abs=0.001)
    assert abs(source.full.qpe) * size == pytest.approx(full, rel=0.005)


@pytest.mark.parametrize("seed", range(5))
def test_curved_and_climbing_paths(seed: int) -> None:
    """Turns of up to 3 m/s², which Table II does not know: full model and exact ranges agree."""
    rng = np.random.default_rng(seed)
    platforms = {
        "transmitter": {
            "position": [24e3, -9e3, 5e3], "velocity": [40, 130, 5], "acceleration": rng.uniform(-3, 3, 3).tolist(),
        },
        "receiver": {
            "position": [4e3, 7e3, 2e3], "velocity": [-45, 35, -3], "acceleration": rng.uniform(-3, 3, 3).tolist(),
        },
    }  # fmt: skip
    mission = parse_mission(
        mission_text(platforms=platforms, collection={"aperture_time": 4}, allocation__model="full")
    )
    study = Study(mission)
    seen = 0
    for source in study.sources:
        size = study.boundary(source, math.pi / 8)
        if size is None:
            continue
        phases = [study.effect([(source, sign * size)]).equal_loss for sign in (1, -1)]
        assert max(phases) == pytest.approx(math.pi / 8, rel=1e-3), source.id
        seen += 1
    assert seen > 10


def test_images_of_a_curved_path_show_the_full_limits() -> None:
    platforms = {
        "transmitter": {"position": [24e3, -9e3, 5e3], "velocity": [40, 130, 5], "acceleration": [-2, 1, 0.5]},
        "receiver": {"position": [4e3, 7e3, 2e3], "velocity": [-45, 35, -3], "acceleration": [1, 2, -0.3]},
    }
    changes = {"platforms": platforms, "collection": {"aperture_time": 4}, "allocation__model": "full"}
    for row in verify_mission(parse_mission(mission_text(**changes)), "*.acceleration.?").rows:
        assert row.verdict == "confirmed", row


def raised(separation_deg: float, squint_deg: float, height: float, slant_ranges=(8.5e3, 8.5e3), **changes):
    """Two aircraft at 3 km over a scene whose height is wrong."""
    states = [
        platform(slant_range, 3e3, math.radians(azimuth), speed, math.radians(squint_deg))
        for slant_range, azimuth, speed in zip(slant_ranges, (0, separation_deg), (150, 60), strict=True)
    ]
    platforms = {
        name: {"position": list(state.position), "velocity": list(state.velocity)}
        for name, state in zip(("transmitter", "receiver"), states, strict=True)
    }
    return {"platforms": platforms, "scene": {"height_error": height}, **changes}


@pytest.mark.parametrize(
    ("separation", "squint", "size"), [(45, 0, 0.06), (45, 30, 0.24), (120, 0, 1.1), (120, 20, 0.11)]
)
def test_a_height_error_defocuses_a_bistatic_image(separation: float, squint: float, size: float) -> None:
    """10 m with perfect navigation, against exact ranges to a scatterer 10 m up: up to a radian."""
    mission = parse_mission(mission_text(**raised(separation, squint, 10)))
    terrain = row_of(check_mission(mission, TODAY), "mission.terrain")
    slow_time = cell_centres(6.0, 256)
    flown = [path(state, slow_time) for state in (mission.geometry.transmitter, mission.geometry.receiver)]
    up = np.array([0.0, 0.0, 10.0])
    # As a clock error: what the echo's path is longer by than one from the scene centre.
    longer = sum(np.linalg.norm(p.actual - up, axis=1) - np.linalg.norm(p.actual, axis=1) for p in flown)
    effect = exact_effect(slow_time, *flown, longer / SPEED_OF_LIGHT_MPS, mission.radar, 6.0)
    assert terrain.qpe_full_rad == pytest.approx(effect.quadratic, rel=0.02)
    assert abs(terrain.qpe_full_rad) == pytest.approx(size, rel=0.2)
    by_full = row_of(
        check_mission(mission._replace(allocation=mission.allocation._replace(model="full")), TODAY), terrain.id
    )
    assert math.dist(by_full.displacement_m, effect.displacement) < 0.05  # the platforms are 10 m higher


def test_a_height_error_warns_where_the_full_model_fails_it_and_is_imaged() -> None:
    found = findings(**raised(120, 0, 10))
    terrain = row_of(found, "mission.terrain")
    assert (terrain.allowable, terrain.status) == (None, "warn")
    assert "wrong height" in terrain.reason
    mission = parse_mission(mission_text(**raised(120, 0, 1, allocation__model="full")))
    (verdict,) = verify_mission(mission, "mission.terrain").rows
    assert verdict.verdict == "confirmed"
    assert verdict.boundary_error == pytest.approx(math.pi / 4 / 0.112, rel=0.02)


def test_a_flat_monostatic_image_only_shifts_on_a_wrong_height() -> None:
    platforms = {name: {"position": [20e3, 0, 6e3], "velocity": [0, 120, 0]} for name in ("transmitter", "receiver")}
    found = findings(platforms=platforms, scene={"height_error": 20})
    assert abs(row_of(found, "mission.terrain").qpe_full_rad) < 1e-9


def test_the_proof_in_the_documentation_runs(monkeypatch) -> None:
    """At one squint; whole, it writes the table of images in docs/full-model.md."""
    spec = importlib.util.spec_from_file_location("prove_full_model", ROOT / "docs" / "prove_full_model.py")
    proof = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(proof)
    monkeypatch.setattr(proof, "SQUINTS", (30,))
    lines = list(proof.against_images())
    assert sum("`receiver.velocity.y`" in line for line in lines) == 1
