"""The scene's edge: the full model there against exact ranges and against images, and what follows for the row."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.analysis.scene import ScenePhases, ScenePlaces, at, where
from bisar_budget.budget.check import check_mission
from bisar_budget.effects.declared import QUADRATIC
from bisar_budget.faults import MissionError
from bisar_budget.geometry import PlatformState
from bisar_budget.mission.load import parse_mission
from bisar_budget.simulator.collection import RANGE_CELLS
from bisar_budget.simulator.phase_history import cell_centres, exact_effect, path
from bisar_budget.verifier.aperture_reading import read_aperture
from bisar_budget.verifier.study import Study
from tests.conftest import TODAY, findings, mission_text, row
from tests.image_point import Collection, flight, no_error
from tests.simulate.conftest import collection


def squinted(squint: float, **errors):
    """Section V at 10 GHz, both platforms turned by a squint, with errors."""
    geometry = collection(squint).geometry
    platforms = {
        name: {"position": list(getattr(geometry, name).position), "velocity": list(getattr(geometry, name).velocity)}
        for name in ("transmitter", "receiver")
    }
    return parse_mission(mission_text(platforms=platforms, allocation__model="full", **errors))


def stating(row_id: str, size: float) -> dict:
    """Keys of a mission that declares one error, by the id of its row; the others beside it are nothing."""
    owner, *kind, axis = row_id.split(".")
    if owner == "timing":
        return {"timing_error": {axis: size}}
    if axis == "terrain":
        return {"scene__height_error": size}
    error = {kind[0]: [size * (axis == letter) for letter in "xyz"]}
    return {"common_motion_error": error} if owner == "mission" else {f"platforms__{owner}__motion_error": error}


class Edge:
    """The scene of a mission, at places given one by one or as arrays."""

    def __init__(self, mission) -> None:
        self.phases = ScenePhases(Analysis(mission).errors)
        self.has_large = bool(self.phases.is_large.any())

    @staticmethod
    def _places(radius: float, azimuth):
        azimuths = np.atleast_1d(np.asarray(azimuth, dtype=float))
        return np.full(azimuths.size, radius), azimuths, np.zeros(azimuths.size, dtype=int)

    def places(self, radius: float, azimuth) -> ScenePlaces:
        return self.phases.places(*self._places(radius, azimuth))

    @np.errstate(all="ignore")
    def differences(self, radius: float, azimuth) -> np.ndarray:
        """(errors, places)"""
        return self.phases.differences(*self._places(radius, azimuth))

    def sizes(self, radius: float, azimuth) -> np.ndarray:
        """Differences together."""
        differences = self.differences(radius, azimuth)
        return self.phases.together(differences, np.zeros(differences.shape[1], dtype=int))


def exact_at(study: Study, source, size: float, point):
    """Effect of one error at a point of the scene, by exact ranges from there."""
    mission, slow_time = study.mission, cell_centres(6.0, 256)
    errors = study.errors(source, size)
    states = (mission.geometry.transmitter, mission.geometry.receiver)
    flown = []
    for state, error in zip(states, (errors.transmitter, errors.receiver), strict=True):
        position = (state.position[0] - point[0], state.position[1] - point[1], state.position[2])
        flown.append(path(PlatformState(position=position, velocity=state.velocity), slow_time, error))
    clock = np.polynomial.polynomial.polyval(slow_time, errors.clock)
    return exact_effect(slow_time, *flown, clock, mission.radar, 6.0)


@pytest.mark.parametrize("radius", [250.0, 1000.0])
@pytest.mark.parametrize("squint", [0, 30, 45])
def test_phases_at_the_edge_are_those_of_exact_ranges(squint: float, radius: float) -> None:
    """Every error at its limit of π/8, at eight places of the rim, of the sign that differs more.

    Small errors may leave out a second order bounded by 0.4 % of the phase or 1 mrad. Half of that is allowed here,
    at the edge and at the centre.
    """
    mission = squinted(squint)
    study = Study(mission)
    analysis = study.analysis
    largest, seen = 0.0, 0
    for source in analysis.sources:
        size = analysis.full.allowable(source, QUADRATIC, math.pi / 8) if source.is_motion else None
        if size is None:
            continue
        edge = Edge(squinted(squint, **stating(source.id, size)))
        centre = [exact_at(study, source, signed, (0.0, 0.0)).quadratic for signed in (size, -size)]
        azimuths = np.arange(8) * math.pi / 4
        differences = edge.differences(radius, azimuths).sum(axis=0)  # of the others nothing
        for azimuth, difference in zip(azimuths, differences, strict=True):
            point = at(radius, azimuth)
            there = [exact_at(study, source, signed, point).quadratic for signed in (size, -size)]
            exact = max(abs(a - b) for a, b in zip(there, centre, strict=True))
            assert abs(difference) == pytest.approx(exact, abs=2 * 0.002 * math.pi / 8), (source.id, azimuth)
            largest, seen = max(largest, exact), seen + 1
    assert seen >= 100
    assert largest > 0.01


@pytest.mark.parametrize(("radius", "azimuth"), [(250.0, 1.0), (1000.0, 1.0), (1000.0, 4.2)])
@pytest.mark.parametrize("row_id", ["receiver.velocity.x", "transmitter.velocity.y", "receiver.acceleration.y"])
def test_images_at_the_edge_show_them(row_id: str, radius: float, azimuth: float) -> None:
    """Backprojection, with the collection's own geometry, of a point on the rim; 5 mrad is what an image resolves."""
    mission = squinted(30)
    study = Study(mission)
    source = next(s for s in study.sources if s.id == row_id)
    size = study.analysis.full.allowable(source, QUADRATIC, math.pi / 8)
    edge = Edge(squinted(30, **stating(row_id, size)))
    measured = []
    for signed in (size, -size):
        errors, phases = study.errors(source, signed), []
        for point in ((0.0, 0.0), at(radius, azimuth)):
            moved = exact_at(study, source, signed, point).displacement
            there = (point[0] + moved[0], point[1] + moved[1])
            chip = study.collection.chip(there, errors, scatterer=point, range_cells=RANGE_CELLS)
            reference = study.collection.chip(
                there, errors, scatterer=there, range_cells=RANGE_CELLS, is_reference=True
            )
            phases.append(read_aperture(study.collection, errors, there, chip, reference).quadratic)
        measured.append(phases[1] - phases[0])
    difference = edge.differences(radius, azimuth).sum()
    assert max(map(abs, measured)) == pytest.approx(abs(difference), abs=0.005)


class TestRow:
    VELOCITY = {"platforms__receiver__motion_error": {"velocity": [0, 0.6, 0]}}

    def found(self, radius: float, **changes):
        changes = {"allocation__model": "full", **self.VELOCITY, **changes}
        return findings(scene={"radius": radius}, **changes)

    def test_no_radius_no_row(self) -> None:
        assert "mission.spatial_variance" not in [r.id for r in findings(**self.VELOCITY).rows]
        assert findings(**self.VELOCITY).scene is None

    def test_nothing_declared(self) -> None:
        found = findings(scene={"radius": 250})
        variance = row(found, "mission.spatial_variance")
        assert (variance.status, variance.declared, variance.allowable_full) == ("not_declared", None, math.pi / 4)

    def test_the_radius_that_one_correction_serves_is_where_the_row_fails(self) -> None:
        """Both sides, with autofocus that pulls in far more: its gain is not in this row."""
        changes = {"autofocus": {"n_pull": 40}}
        served = self.found(100, **changes).scene.autofocus_radius
        for factor, is_over in ((0.99, False), (1.01, True)):
            variance = row(self.found(factor * served, **changes), "mission.spatial_variance")
            assert variance.allowable == pytest.approx(math.pi / 4)
            assert (variance.status == "fail") == is_over
            assert variance.declared == pytest.approx(math.pi / 4, rel=0.03)

    def test_it_is_the_same_from_a_scene_that_is_too_large(self) -> None:
        outward, inward = (self.found(radius).scene.autofocus_radius for radius in (100, 5000))
        assert outward == pytest.approx(inward, rel=0.01)

    def test_the_worst_azimuth_is_found_between_the_rim_points(self) -> None:
        """Against a rim of 720 points."""
        mission = parse_mission(mission_text(scene={"radius": 500}, allocation__model="full", **self.VELOCITY))
        found = check_mission(mission, TODAY)
        worst = Edge(mission).sizes(500, np.arange(720) * math.pi / 360).max()
        assert row(found, "mission.spatial_variance").declared == pytest.approx(worst, rel=1e-3)

    @pytest.mark.parametrize("rule", ["each", "sum", "rss"])
    def test_differences_combine_as_the_mission_says(self, rule: str) -> None:
        errors = {"platforms__receiver__motion_error": {"velocity": [0.3, 0.6, 0]}}
        found = self.found(300, allocation__combine=rule, **errors)
        differences = Edge(parse_mission(mission_text(**errors))).differences(300, np.radians(range(360)))
        worst = np.linalg.norm(differences, {"each": math.inf, "sum": 1, "rss": 2}[rule], axis=0).max()
        variance = row(found, "mission.spatial_variance")
        assert variance.declared == pytest.approx(worst, rel=1e-3)
        assert variance.status != "info"

    def test_a_covariance_counts_with_its_correlations(self) -> None:
        """√(dᵀRd) of the differences, R the correlations."""
        correlation = np.eye(6)
        correlation[0, 3] = correlation[3, 0] = -0.9
        sigmas = [3, 3, 3, 0.2, 0.2, 0.2]
        covariance = {"position": [3, 3, 3], "velocity": [0.2, 0.2, 0.2], "correlation": correlation.tolist()}
        errors = {"platforms__receiver__motion_error": {"covariance": covariance}}
        mission = parse_mission(mission_text(scene={"radius": 500}, allocation__combine="rss", **errors))
        variance = row(check_mission(mission, TODAY), "mission.spatial_variance")
        alone = {"position": sigmas[:3], "velocity": sigmas[3:]}
        edge = Edge(parse_mission(mission_text(platforms__receiver__motion_error=alone)))
        assert edge.phases.ids == [f"receiver.{kind}.{axis}" for kind in alone for axis in "xyz"]
        differences = edge.differences(500, np.radians(range(360)))
        worst = math.sqrt(max(np.einsum("ik,ij,jk->k", differences, correlation, differences)))
        assert variance.declared == pytest.approx(worst, rel=1e-3)
        assert worst < np.linalg.norm(differences, axis=0).max()

    @pytest.mark.parametrize("model", ["published", "full", "strictest"])
    def test_the_published_model_has_no_limit_but_warns(self, model: str) -> None:
        variance = row(self.found(5000, allocation__model=model), "mission.spatial_variance")
        assert variance.status == {"published": "warn"}.get(model, "fail")
        assert (variance.allowable is None) == (model == "published")
        assert variance.allowable_full == pytest.approx(math.pi / 4)

    def test_an_error_over_its_limit_at_the_edge_alone_is_a_warning(self) -> None:
        """Just inside at the centre; the difference itself is far inside the total."""
        limit = row(findings(allocation__model="full"), "receiver.velocity.y").allowable
        error = {"platforms__receiver__motion_error": {"velocity": [0, 0.999 * limit, 0]}}
        variance = row(self.found(500, **error), "mission.spatial_variance")
        assert variance.utilization < 0.5
        assert variance.status == "warn"
        assert "receiver.velocity.y" in variance.reason

    def test_an_edge_without_an_image_is_not_evaluated(self) -> None:
        """A receiver on the ground, at the edge itself."""
        receiver = {"position": [6000, 0, 0], "velocity": [0, 40, 0], "motion_error": {"velocity": 0.01}}
        for radius, is_there in ((5000, True), (6000, False)):
            variance = row(
                findings(scene={"radius": radius}, platforms__receiver=receiver), "mission.spatial_variance"
            )
            assert (variance.status != "not_evaluated") == is_there
        assert "a platform is within 1 m of it" in variance.reason

    def test_an_edge_beyond_parallel_gradients_has_no_image(self) -> None:
        """At eight even places of the edge they are far from it; between the centre and three of them they are."""
        platforms = {
            "transmitter": {"position": [12e3, 7e3, 3e3], "velocity": [120, 40, 0]},
            "receiver": {"position": [2e3, 8e3, 3e3], "velocity": [-10, 10, 0], "motion_error": {"velocity": 0.01}},
        }
        inner, outer = (
            row(findings(platforms=platforms, scene={"radius": radius}), "mission.spatial_variance")
            for radius in (500, 2000)
        )
        assert inner.status != "not_evaluated"
        assert outer.status == "not_evaluated"
        assert "on the way there range and Doppler gradients become parallel" in outer.reason
        found = findings(platforms=platforms, scene={"radius": 500})
        assert found.scene.autofocus_radius is not None
        edge = Edge(parse_mission(mission_text(platforms=platforms)))
        assert edge.places(found.scene.autofocus_radius, np.radians(range(360))).has_image.all()

    def test_a_place_of_the_edge_without_any_gradient_is_not_evaluated(self) -> None:
        """A receiver that climbs above it, and a transmitter that stands: neither line of sight turns there."""
        platforms = {
            "transmitter": {"position": [0, -20e3, 5e3], "velocity": [0, 0, 0]},
            "receiver": {"position": [2e3, 0, 3e3], "velocity": [0, 0, 10], "motion_error": {"velocity": 0.005}},
        }
        found = row(findings(platforms=platforms, scene={"radius": 2000}), "mission.spatial_variance")
        assert found.status == "not_evaluated"
        assert "no image at the scene's edge" in found.reason

    def test_a_place_where_the_lines_of_sight_cancel_has_an_image_all_the_same(self) -> None:
        """At (2, 0) km they cancel at mid-aperture, to the last digit; over the aperture the range gradient grows.

        The difference is that of another search, by exact ranges, at 120 places of the edge.
        """
        positions = {"transmitter": (12e3, 0.0, 5e3), "receiver": (-8e3, 0.0, 5e3)}
        velocities = {"transmitter": (0.0, 150.0, 0.0), "receiver": (0.0, 60.0, 0.0)}
        size = 0.005  # m/s
        platforms = {
            name: {"position": list(positions[name]), "velocity": list(velocities[name])} for name in positions
        }
        platforms["receiver"]["motion_error"] = {"velocity": size}
        mission = parse_mission(mission_text(platforms=platforms, scene={"radius": 2000}))

        def quadratics(east: float, north: float) -> list[float]:
            paths = [flight(np.subtract(positions[name], (east, north, 0)), velocities[name]) for name in positions]
            radar, aperture_time = mission.radar, mission.collection.aperture_time
            return [
                Collection(
                    radar.center_frequency,
                    radar.bandwidth,
                    aperture_time,
                    (paths[0], paths[1]),
                    (no_error, flight((0, 0, 0), size * axis)),
                )
                .least_variance_point(steps=2)
                .quadratic_rad
                for axis in np.eye(3)
            ]

        edge = [quadratics(*at(2000, azimuth)) for azimuth in np.radians(range(0, 360, 3))]
        worst = np.abs(np.subtract(edge, quadratics(0, 0))).max()
        variance = row(check_mission(mission, TODAY), "mission.spatial_variance")
        assert variance.status == "pass"
        # The closed form serves these errors, to 1 % of a limit; a place of 3 degrees is near enough.
        assert variance.qpe_full_rad == pytest.approx(worst, rel=2e-3)

    def test_a_narrow_arc_without_an_image_is_not_hidden_by_a_short_range_gradient(self) -> None:
        """14° around azimuth 126° with gradients parallel to 1°; beside it the range gradient is nearer to 0.02."""
        velocities = ([223.48, 165.06, 8.766], [40.53, 24.197, 1.0026])
        positions = ([-903.7, 453.007, 4911.339], [-96.108, -46.558, 4249.289])
        platforms = {
            name: {"position": position, "velocity": velocity, "motion_error": {"velocity": 0.0006}}
            for name, position, velocity in zip(("transmitter", "receiver"), positions, velocities, strict=True)
        }
        found = row(findings(platforms=platforms, scene={"radius": 422.9}), "mission.spatial_variance")
        assert found.status == "not_evaluated"
        assert "azimuth 126 deg" in found.reason

    def test_clock_and_terrain_vary_over_the_scene(self) -> None:
        """A constant clock error moves the image, and so bends it differently at the edge: exact ranges agree."""
        mission = parse_mission(mission_text(timing_error={"constant": "20 ns"}, scene={"radius": 1000}))
        variance = row(check_mission(mission, TODAY), "mission.spatial_variance")
        study = Study(mission)
        source = next(s for s in study.sources if s.id == "timing.constant")
        centre = exact_at(study, source, 20e-9, (0, 0)).quadratic
        worst = max(
            abs(exact_at(study, source, 20e-9, at(1000, azimuth)).quadratic - centre)
            for azimuth in np.linspace(0, 2 * math.pi, 72)
        )
        assert variance.qpe_full_rad == pytest.approx(worst, rel=0.02, abs=1e-3)
        raised = row(findings(scene={"radius": 1000, "height_error": 5}), "mission.spatial_variance")
        assert raised.qpe_full_rad > 0.001


def random_scenes(count: int, seed: int):
    """Missions with errors of every kind and rule, and a radius of 0.5, 2 or 10 % of the nearest slant range."""
    rng = np.random.default_rng(seed)
    while count:
        platforms = {}
        for name in ("transmitter", "receiver"):
            errors = {
                kind: [float(part) for part in rng.uniform(-size, size, 3)]
                for kind, size in (("position", 3.0), ("velocity", 0.05), ("acceleration", 0.005))
                if rng.random() < 0.6
            }
            platforms[name] = {
                "slant_range": float(10 ** rng.uniform(3, 5)),
                "azimuth": float(rng.uniform(-3.1, 3.1)),
                "elevation": float(rng.uniform(0.1, 1.2)),
                "speed": float(rng.uniform(20, 300)),
                "motion_azimuth": float(rng.uniform(-3.1, 3.1)),
                "climb": 0.0,
                "motion_error": errors or {"velocity": 0.01},
            }
        radius = float(rng.choice([0.005, 0.02, 0.1])) * min(p["slant_range"] for p in platforms.values())
        allocation = {"combine": str(rng.choice(["each", "sum", "rss"])), "model": "full"}
        changes = {"platforms": platforms, "collection": {"aperture_time": 3}, "allocation": allocation}
        try:
            mission = parse_mission(
                mission_text(**changes, scene={"radius": radius}, timing_error={"constant": 5e-9})
            )
        except MissionError:  # degenerate
            continue
        count -= 1
        yield mission


def test_edge_and_radius_are_those_of_a_circle_of_720_places() -> None:
    """To 0.2 %: the largest difference, the radius that one correction serves, and whether there is an image."""
    seen = {"image": 0, "none": 0, "served": 0}
    for mission in random_scenes(30, seed=1):
        edge, azimuths = Edge(mission), np.arange(720) * math.pi / 360
        scene = check_mission(mission, TODAY).scene
        # Of large errors at fewer places: each is searched for by exact ranges. 1 % is what lies between two of them.
        fewer = azimuths[::8] if edge.has_large else azimuths[:0]
        of_large, rim = edge.sizes(scene.radius, fewer), edge.places(scene.radius, azimuths)
        has_image = rim.has_image.all() and np.isfinite(of_large).all()
        assert has_image == (not scene.degeneracy), mission
        seen["image" if has_image else "none"] += 1
        if not has_image:
            continue
        if edge.has_large:
            assert of_large.max() * (1 - 2e-3) <= scene.difference <= of_large.max() * 1.01
        else:
            assert scene.difference == pytest.approx(rim.size.max(), rel=2e-3, abs=1e-9)
        served = scene.autofocus_radius or scene.searched

        def is_served(radius: float, edge=edge, azimuths=azimuths, fewer=fewer) -> bool:
            if not edge.has_large:
                circle = edge.places(radius, azimuths)
                return bool((circle.has_image & (circle.size <= math.pi / 4)).all())
            return bool((edge.sizes(radius, fewer) <= math.pi / 4).all())

        # Of large errors it is right to 0.5 % of the total, and so is what 90 places can miss.
        assert is_served((0.985 if edge.has_large else 0.998) * served)
        if scene.autofocus_radius is not None:
            assert not is_served(1.01 * served)
            seen["served"] += 1
    # Nearly all have an image: what mid-aperture alone does not span, the aperture and its band do.
    assert min(seen["image"], seen["served"]) >= 3, seen
    assert seen["none"] >= 1


def radius_where(size_at: Callable, inside: tuple[float, float], outside: tuple[float, float]) -> float:
    """The second of three places whose sizes pass 1, by `where`, which looks at two of them."""
    ends = [tuple(np.full(3, part) for part in pair) for pair in (inside, outside)]
    found = where(lambda radius, places: size_at(radius), np.ones(3), np.array([0, 1]), *ends)
    assert found[0] == found[1]
    return float(found[1])


@pytest.mark.parametrize("power", [0.3, 1.0, 3.0])
@pytest.mark.parametrize("start", [0.0, 0.9, 0.99999])
def test_the_radius_where_a_size_passes_a_total_is_between_its_bounds(power: float, start: float) -> None:
    """Size = radius to a power, which is 1 at 1: to a thousandth of the size, also from just inside the total."""
    low = radius_where(lambda radius: radius**power, (start, start**power), (2.0, 2.0**power))
    assert start <= low <= 1
    assert low**power >= 1 - 1.1e-3 * max(1.0, power)


def test_a_radius_is_found_below_a_place_without_an_image() -> None:
    low = radius_where(lambda radius: np.where(radius < 0.7, radius, math.inf), (0.0, 0.0), (2.0, math.inf))
    assert 0.699 <= low < 0.7


def test_an_error_without_an_image_is_not_lost_among_those_it_is_correlated_with() -> None:
    """Its phase is infinite: zero, or minus, times that was no number, and then no difference at all."""
    covariance = {"position": [3, 3, 3], "velocity": [0.2, 0.2, 0.2], "correlation": np.eye(6).tolist()}
    error = {"covariance": covariance}
    edge = Edge(parse_mission(mission_text(platforms__receiver__motion_error=error, allocation__combine="rss")))
    here, phases = np.zeros(1, dtype=int), np.ones((6, 1))
    assert edge.phases.together(phases, here)[0] == pytest.approx(math.sqrt(6))
    phases[2] = math.inf
    with np.errstate(invalid="ignore"):  # as a check has it
        assert edge.phases.together(phases, here)[0] == math.inf


def test_an_arc_of_the_rim_without_an_image_between_two_places_is_found() -> None:
    """A height error of 52 m ends the image of the rim on an arc of 20 degrees: the row had passed over it.

    At 49.31 m the band hides 1.9 rad of phase at most, by the least variance of exact ranges: an image is there all
    round. At 52 m it hides more than π around an azimuth of 50°, and less at 30° and at 80°.
    """
    from tests.families import mission_text as of_family

    text = of_family("geostationary_drone", 1102)

    def hidden(height: float, azimuth: float) -> float:
        mission = parse_mission(text)
        paths = [
            flight(
                np.subtract(state.position, (*at(238.4, math.radians(azimuth)), 0)),
                state.velocity,
                state.acceleration,
            )
            for state in (mission.geometry.transmitter, mission.geometry.receiver)
        ]
        radar, aperture_time = mission.radar, mission.collection.aperture_time
        up = flight((0.0, 0.0, height), (0.0, 0.0, 0.0))
        errors = (up, up)
        collection = Collection(radar.center_frequency, radar.bandwidth, aperture_time, (paths[0], paths[1]), errors)
        left = collection.least_variance_point(steps=60)
        return math.sqrt(left.equal_loss_rad**2 - left.quadratic_rad**2)

    assert max(hidden(sign * 49.31, azimuth) for azimuth in range(0, 360, 10) for sign in (1, -1)) < 2
    assert max(hidden(52, 30), hidden(52, 80)) < math.pi < min(hidden(52, 46), hidden(52, 56))
    for height, is_there in ((49.31, True), (52, False)):
        found = check_mission(parse_mission(text.replace("height_error: -49.31", f"height_error: {-height}")), TODAY)
        variance = row(found, "mission.spatial_variance")
        assert (variance.declared is not None) == is_there
        assert variance.status == ("fail" if is_there else "not_evaluated")
        assert ("no ground point" in (variance.reason or "")) == (not is_there)
