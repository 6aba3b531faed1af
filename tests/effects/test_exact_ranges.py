"""Exact ranges of the check and of the simulator on random missions: one definition, two functions."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.mission.load import parse_mission
from bisar_budget.ranges import exact_ranges
from bisar_budget.ranges.exact_ranges import FINE_NODE_COUNT, NO_SHIFTS, ExactRanges, Lanes, aperture_nodes, followed
from bisar_budget.simulator.phase_history import cell_centres, exact_effect
from bisar_budget.verifier.study import Study
from tests.conftest import mission_text
from tests.effects.test_models import farthest_size
from tests.families import DIRECT_PATH, FAMILIES
from tests.families import mission_text as family_text


def by_courses(study: Study, source, sizes):
    """Effects of one error at several sizes, at once, as the simulator flies it."""
    nodes = aperture_nodes(study.collection.aperture_time)
    errors = study.errors(source, 1.0)
    scale = np.asarray(sizes)
    shifts = [
        (one.measured - one.actual).T[..., None] * scale for one in study.collection.flight(errors, nodes).paths
    ]
    clock = SPEED_OF_LIGHT_MPS * np.polynomial.polynomial.polyval(nodes, errors.clock)[:, None] * scale
    return followed(of_study(study), clock, shifts, np.zeros(len(sizes), dtype=int))


def of_study(study: Study) -> ExactRanges:
    """Exact ranges of a mission at many nodes."""
    paths, seen = (study.geometry.transmitter, study.geometry.receiver), study.collection
    is_heard = study.mission.has_direct_path
    return ExactRanges.of(paths, seen.radar, seen.aperture_time, FINE_NODE_COUNT, has_direct_path=is_heard)


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("more", ["", DIRECT_PATH], ids=["clock", "direct path"])
def test_check_and_simulator_agree(family: str, more: str) -> None:
    """Every error, at a hundredth and at a tenth of the largest that is one of navigation, both signs.

    As long as the image moves by less than a tenth of the nearest range: farther away a history may have two points.
    """
    study = Study(parse_mission(family_text(family, 1) + more))
    analysis = Analysis(study.mission)
    full = analysis.full
    compared, geometry = 0, study.geometry
    nearest = min(geometry.transmitter.slant_range, geometry.receiver.slant_range)
    for source in study.sources:
        if not source.is_motion or not source.is_heard:
            continue
        farthest = farthest_size(analysis, source)
        sizes = [part * farthest for part in (0.01, -0.01, 0.1, -0.1)]
        found = by_courses(study, source, sizes)
        for index, size in enumerate(sizes):
            scalar = full.at(source, size)
            place = (found.east[index], found.north[index])
            if scalar is None or not np.hypot(*scalar.displacement) < 0.1 * nearest:
                continue
            compared += 1
            assert scalar.displacement == pytest.approx(place, abs=1e-3, rel=1e-5), (source.id, size)
            assert scalar.quadratic == pytest.approx(found.quadratic[index], abs=2e-3, rel=1e-4), (source.id, size)
            assert scalar.cubic == pytest.approx(found.cubic[index], abs=2e-3, rel=1e-4), (source.id, size)
    assert compared > 20


def test_the_phase_varies_least_at_the_point() -> None:
    """The definition itself, on a dense aperture by a sum of rectangles: no Legendre weights, no nodes.

    V = (1 + b²)⟨ρ²⟩ − ⟨ρ⟩² has no slope at the point: by the parabola through V there and 1 cm to both sides, its
    least is less than 0.1 mm away.
    """
    study = Study(parse_mission(mission_text()))
    errors = study.errors(next(s for s in study.sources if s.id == "receiver.velocity.y"), 0.5)
    effect = study.collection.effect(errors)
    radar, T = study.collection.radar, study.collection.aperture_time
    k, band = 2 * math.pi / study.collection.wavelength, (radar.bandwidth / radar.center_frequency) ** 2 / 12
    tau = cell_centres(T, 20000)
    flown, point = study.collection.flight(errors, tau).paths, np.array([*effect.displacement, 0.0])

    def left_at(place):
        return k * sum(np.linalg.norm(p.actual, axis=1) - np.linalg.norm(p.measured - place, axis=1) for p in flown)

    def variance_at(place):
        left = left_at(place)
        return (1 + band) * np.mean(left**2) - np.mean(left) ** 2

    for step in 0.01 * np.eye(3)[:2]:
        before, here, after = (variance_at(point + part * step) for part in (-1, 0, 1))
        assert abs((after - before) / (after - 2 * here + before)) / 2 * 0.01 < 1e-4
    left, place = left_at(point), tau / (T / 2)
    parts = [(2 * n + 1) * np.mean(left * np.polynomial.legendre.Legendre.basis(n)(place)) for n in range(4)]
    assert effect.quadratic == pytest.approx(1.5 * parts[2], abs=1e-5)
    assert effect.cubic == pytest.approx(2.5 * parts[3], abs=1e-4)


def test_samples_anywhere_give_the_same() -> None:
    study = Study(parse_mission(mission_text()))
    errors = study.errors(next(s for s in study.sources if s.id == "receiver.velocity.y"), 0.5)
    want = study.collection.effect(errors)
    tau = cell_centres(study.collection.aperture_time, 200)
    got = exact_effect(tau, *study.collection.flight(errors, tau).paths, 0.0, study.collection.radar, 6.0)
    assert got.displacement == pytest.approx(want.displacement, abs=1e-5)
    assert got.quadratic == pytest.approx(want.quadratic, abs=1e-5)


def test_errors_without_a_point_are_marked_and_leave_the_others_alone() -> None:
    study = Study(parse_mission(mission_text()))
    source = next(s for s in study.sources if s.id == "timing.constant")
    found = by_courses(study, source, [1e-9, -1e-3, 2e-9])  # 300 km nearer than the scene is
    assert found.is_settled.tolist() == [True, False, True]
    assert np.isnan(found.quadratic[1])
    assert np.isfinite(found.east[[0, 2]]).all()


def test_a_start_nearby_changes_nothing() -> None:
    study = Study(parse_mission(mission_text()))
    source = next(s for s in study.sources if s.id == "receiver.velocity.y")
    exact, one = of_study(study), np.zeros(1, dtype=int)
    flown = study.collection.flight(study.errors(source, 0.5), aperture_nodes(6.0)).paths
    given = np.zeros((FINE_NODE_COUNT, 1)), [(path.measured - path.actual).T[..., None] for path in flown]
    first = exact.settled(*given, (0.0, 0.0), one)
    again = exact.settled(*given, (first.east + 0.5, first.north + 0.5), one)
    assert [again.east[0], again.north[0]] == pytest.approx([first.east[0], first.north[0]], abs=1e-6)


@pytest.mark.parametrize("together", [1, 2 * FINE_NODE_COUNT, 3 * FINE_NODE_COUNT])
def test_blocks_change_nothing(monkeypatch: pytest.MonkeyPatch, together: int) -> None:
    """Seven lanes, of which the last block is shorter; one platform is still, and one lane has no point."""
    study = Study(parse_mission(mission_text()))
    exact, generator, case = of_study(study), np.random.default_rng(1), np.zeros(7, dtype=int)
    shifts = [NO_SHIFTS, generator.normal(scale=5.0, size=(3, FINE_NODE_COUNT, 7))]
    clock = generator.normal(size=(FINE_NODE_COUNT, 7))
    clock[:, 3] = -3e5
    at_once = exact.settled(clock, shifts, (0.0, 0.0), case)
    with monkeypatch.context() as changed:
        settings = replace(exact_ranges.POINT_SETTINGS, samples_at_once=together)
        changed.setattr(exact_ranges, "POINT_SETTINGS", settings)
        in_blocks = exact.settled(clock, shifts, (0.0, 0.0), case)
    assert in_blocks.is_settled.tolist() == [True] * 3 + [False] + [True] * 3
    for one, other in zip(in_blocks, at_once, strict=True):
        assert one == pytest.approx(other, rel=1e-9, abs=1e-9, nan_ok=True)


def test_a_far_point_is_followed() -> None:
    """The search from the centre settles on no point for errors as large as the geometry; steps find it."""
    study = Study(parse_mission(family_text("drones", 1)))
    exact = of_study(study)
    nearest = float(exact.nearest[0])
    directions = np.random.default_rng(2).normal(size=(3, 1, 400))
    sizes = nearest * np.linspace(0.0, 0.9, 400)
    shifts = [directions / np.linalg.norm(directions, axis=0) * sizes * np.ones((1, FINE_NODE_COUNT, 1)), NO_SHIFTS]
    case, clock = np.zeros(400, dtype=int), np.zeros((FINE_NODE_COUNT, 400))
    at_once = exact.settled(clock, shifts, (0.0, 0.0), case)
    found = followed(exact, clock, shifts, case)
    assert (found.is_settled & ~at_once.is_settled).any()
    assert not (at_once.is_settled & ~found.is_settled).any()
    # V has no lower value within a metre of what is found, in eight directions.
    some = np.flatnonzero(found.is_settled)
    tracks = [np.stack(track) for track in exact.tracks]
    band = (study.collection.radar.bandwidth / study.collection.radar.center_frequency) ** 2 / 12

    def variance_at(east, north):
        point = np.stack((east, north, 0 * east))[:, None]
        left = sum(
            np.linalg.norm(track, axis=0)
            - np.linalg.norm(track + (np.stack(shift)[..., some] if shift is not NO_SHIFTS else 0) - point, axis=0)
            for track, shift in zip(tracks, shifts, strict=True)
        )
        mean = exact.fit[0]
        return (1 + band) * (mean @ left**2) - (mean @ left) ** 2

    least = variance_at(found.east[some], found.north[some])
    for azimuth in np.arange(8) * math.pi / 4:
        east, north = found.east[some] + math.cos(azimuth), found.north[some] + math.sin(azimuth)
        assert (least <= variance_at(east, north) * (1 + 1e-6)).all()


def test_phases_have_no_rounding_of_the_ranges() -> None:
    """Errors a micrometre apart lie on a line; a range of 4e7 m in doubles is 4e-9 m off, which would be 1e-6 rad."""
    analysis = Analysis(parse_mission(family_text("geostationary_drone", 3)))
    source = next(one for one in analysis.sources if one.id == "transmitter.position.x")
    lanes = analysis.errors.lanes(source).of(np.zeros(10, dtype=int))
    near = analysis.full.displacement(source.full, 1.0)
    found = analysis.exact.phases(lanes, 1 + np.arange(10) * 1e-6, near)
    phases = np.array((found.quadratic, found.cubic)).T
    assert np.abs(phases[0]).max() > 1e-3
    line = phases[0] + np.linspace(0, 1, 10)[:, None] * (phases[-1] - phases[0])
    assert np.abs(phases - line).max() < 1e-10  # a second order of (1e-5)² of the phases


@pytest.mark.parametrize(("part", "is_found"), [(1.0, False), (1 - 1e-7, False), (0.9, True)])
def test_a_point_that_meets_a_platform_has_no_image(part: float, is_found: bool) -> None:
    """Rounding gave the platform a direction in which it was seen from there, so that a search could settle."""
    for place in range(40):
        position = (3000 + place * 0.1, 1000, 4000 + place * 0.37)
        still = {"position": list(position), "velocity": [0, 0, 0], "motion_error": {"position": 1}}
        moving = {"slant_range": 9000, "azimuth": 1.2, "elevation": 0.6, "speed": 50, "motion_azimuth": 2.5}
        platforms = {"transmitter": still, "receiver": {**moving, "motion_error": {"velocity": 0.01}}}
        analysis = Analysis(parse_mission(mission_text(platforms=platforms)))
        ones = np.ones((len(analysis.exact.times), 1))
        directions = np.array((position, (0.0, 0.0, 0.0)))[..., None, None]
        lanes = Lanes(np.zeros(1, dtype=int), ones, np.array(((1.0,), (0.0,))), directions, np.zeros(1, dtype=int))
        found = analysis.exact.phases(lanes, np.array([-part]), (0.0, 0.0))
        assert found.is_settled[0] == is_found
