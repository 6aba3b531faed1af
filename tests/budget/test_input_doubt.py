"""Paths whose own doubt exceeds the declared position error: not evaluated, with both numbers."""

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bisar_budget.budget.check import check_mission
from bisar_budget.budget.doubts import LEAST_M, input_doubts
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.mission.model import Mission
from bisar_budget.paths.instant import Instant
from bisar_budget.units import format_quantity
from tests.conftest import TODAY, mission_text, row
from tests.mission.test_path_files import aircraft, ephemeris, satellite
from tests.paths.flown import flight, geodetic_csv
from tests.paths.orbit_files import EPOCH, TLE, oem
from tests.questions.test_sweep import assert_as_checked, grid, swept

AXES = "xyz"


def noisy(sigma: float, seed: int = 0) -> bytes:
    """Log of the flight with white noise in its heights. [m]"""
    flown = flight()
    return geodetic_csv(
        flown._replace(height=flown.height + np.random.default_rng(seed).normal(0, sigma, flown.height.shape))
    )


def logged(folder: Path, log: bytes, **error: Any) -> Mission:
    """A mission whose receiver is a log, of which the smooth path is flown: its residual does not spread."""
    (folder / "flight.csv").write_bytes(log)
    receiver = {
        "trajectory": {"file": "flight.csv", "processed": "smoothed"},
        "motion_error": {"velocity": "1 mm/s", **error},
    }
    (folder / "m.yaml").write_text(aircraft(platforms__receiver=receiver))
    return load_mission(str(folder / "m.yaml"))


def orbiting(folder: Path, center: Instant, **error: Any) -> Mission:
    """A mission whose transmitter has elements."""
    (folder / "a.tle").write_text(TLE)
    transmitter = {"orbit": {"tle": "a.tle"}, "motion_error": {"frame": "ric", "velocity": "1 mm/s", **error}}
    (folder / "m.yaml").write_text(satellite(center, platforms__transmitter=transmitter))
    return load_mission(str(folder / "m.yaml"))


def statuses(found: MissionFindings, owner: str) -> set[str]:
    return {one.status for one in found.rows if one.subject.owner == owner and one.subject.kind == "position"}


class TestALog:
    def test_30_m_of_noise_in_heights_is_not_a_position_to_5_cm(self, tmp_path: Path) -> None:
        """Of 101 places the residual is 30 m, give or take 30 m/√(2·101) four times."""
        mission = logged(tmp_path, noisy(30.0), position="5 cm")
        (doubt,) = input_doubts(mission)
        assert doubt.owner == "receiver"
        assert doubt.doubt == pytest.approx(30, abs=9)
        assert doubt.declared == pytest.approx(0.05 * math.sqrt(3))
        found = check_mission(mission, TODAY)
        assert found.status == "not_evaluated"
        for axis in AXES:
            one = row(found, f"receiver.position.{axis}")
            assert one.status == "not_evaluated"
            assert one.reason == (
                f"the path may be {format_quantity(doubt.doubt, 'm')} off (residual of the smoothed log at "
                "fixes left out, root mean square), but 86.6 mm is declared: declare the error in "
                "platforms.receiver.motion_error.position"
            )
        assert row(found, "receiver.velocity.x").status != "not_evaluated"

    @pytest.mark.parametrize("factor", [0.99, 1.01])
    def test_the_residual_is_held_to_what_is_declared(self, tmp_path: Path, factor: float) -> None:
        """Root-sum-square of the axes; the coverage factor is for what is declared, not for the doubt."""
        residual = logged(tmp_path, noisy(0.02)).platforms.receiver.path.doubt_m
        assert residual == pytest.approx(0.02, rel=0.3)
        each = factor * residual / math.sqrt(3)
        mission = logged(tmp_path, noisy(0.02), position=each)
        assert bool(input_doubts(mission)) == (factor < 1)
        wider = mission._replace(allocation=mission.allocation._replace(coverage_factor=3.0))
        assert bool(input_doubts(wider)) == (factor < 1)
        assert (statuses(check_mission(mission, TODAY), "receiver") == {"not_evaluated"}) == (factor < 1)

    @pytest.mark.parametrize(
        "error",
        [
            {"position": [0, 0, "3 cm"]},
            {"frame": "track", "position": [0, 0, "3 cm"]},
            {"covariance": {"position": [0, 0, "3 cm"], "velocity": "1 mm/s"}, "velocity": None},
            {"random": [{"name": "GNSS", "sigma": [0, 0, "3 cm"], "correlation_time": "1 s"}]},
        ],
        ids=["position", "frame", "covariance", "random"],
    )
    def test_an_error_is_declared_in_each_of_its_ways(self, tmp_path: Path, error: dict[str, Any]) -> None:
        error = {"velocity": "1 mm/s"} | error
        kept = {key: value for key, value in error.items() if value is not None}
        (tmp_path / "flight.csv").write_bytes(noisy(0.02))
        receiver = {"trajectory": {"file": "flight.csv", "processed": "smoothed"}, "motion_error": kept}
        (tmp_path / "m.yaml").write_text(aircraft(platforms__receiver=receiver))
        assert input_doubts(load_mission(str(tmp_path / "m.yaml"))) == []
        text = (tmp_path / "m.yaml").read_text().replace("3 cm", "1 cm")
        (tmp_path / "m.yaml").write_text(text)
        (doubt,) = input_doubts(load_mission(str(tmp_path / "m.yaml")))
        assert doubt.declared == pytest.approx(0.01)

    def test_a_gnss_part_declares(self, tmp_path: Path) -> None:
        part = "{kind: gnss, name: R, source: test, position: 2 cm}"
        (tmp_path / "r.yaml").write_text(part)
        assert input_doubts(logged(tmp_path, noisy(0.02), sensor="r.yaml")) == []
        (tmp_path / "r.yaml").write_text(part.replace("2 cm", "5 mm"))
        (doubt,) = input_doubts(logged(tmp_path, noisy(0.02), sensor="r.yaml"))
        assert doubt.declared == pytest.approx(0.005 * math.sqrt(3))

    @pytest.mark.parametrize(("noise", "is_doubted"), [(0.7, False), (1.4, True)])
    def test_without_a_declared_error_a_metre_is_doubted(
        self, tmp_path: Path, noise: float, is_doubted: bool
    ) -> None:
        mission = logged(tmp_path, noisy(noise))
        assert (mission.platforms.receiver.path.doubt_m > 1) == is_doubted
        assert bool(input_doubts(mission)) == is_doubted
        found = check_mission(mission, TODAY)
        assert statuses(found, "receiver") == {"not_evaluated" if is_doubted else "not_declared"}
        if is_doubted:
            assert "no position error is declared" in (row(found, "receiver.position.x").reason or "")

    def test_millimetres_are_no_story(self, tmp_path: Path) -> None:
        """Beside a declared zero too."""
        assert input_doubts(logged(tmp_path, noisy(5e-4), position=0)) == []
        (doubt,) = input_doubts(logged(tmp_path, noisy(2e-3), position=0))
        assert doubt.doubt > LEAST_M
        assert doubt.declared == 0

    def test_a_place_that_strays_is_still_said(self, tmp_path: Path) -> None:
        """5 cm at one place of a path that is exact: less than a jump, and no part of the residual's note."""
        flown = flight()
        height = flown.height.copy()
        height[240] += 0.05
        found = check_mission(logged(tmp_path, geodetic_csv(flown._replace(height=height)), position="1 mm"), TODAY)
        assert found.status == "not_evaluated"
        (warning,) = [one.message for one in found.warnings if one.is_doubt]
        assert "a fix of the log, -0.2 s from mid-aperture, is" in warning

    def test_a_row_that_fails_stays_so_and_a_waiver_is_for_one_that_is_named(self, tmp_path: Path) -> None:
        logged(tmp_path, noisy(30.0), position=["1 cm", "5 m", "1 cm"])
        text = (tmp_path / "m.yaml").read_text() + "requirements: {location_error: 2 m}\n"
        (tmp_path / "m.yaml").write_text(text)
        found = check_mission(load_mission(str(tmp_path / "m.yaml")), TODAY)
        assert [row(found, f"receiver.position.{axis}").status for axis in AXES] == [
            "not_evaluated",
            "fail",
            "not_evaluated",
        ]

    @pytest.mark.parametrize("rule", ["each", "sum", "rss"])
    def test_every_rule_says_so(self, tmp_path: Path, rule: str) -> None:
        mission = logged(tmp_path, noisy(1.0), position="5 cm")
        found = check_mission(mission._replace(allocation=mission.allocation._replace(combine=rule)), TODAY)
        assert statuses(found, "receiver") == {"not_evaluated"}
        assert found.status == "not_evaluated"


class TestAnOrbit:
    @pytest.mark.parametrize(("days", "declared"), [(3.0, 7.0), (-3.0, 7.0), (12.5, 26.0), (0.1, 1.2)])
    def test_elements_are_doubted_by_a_kilometre_and_two_a_day(
        self, tmp_path: Path, days: float, declared: float
    ) -> None:
        center = EPOCH.after(86400 * days)
        for factor in (0.98, 1.02):
            mission = orbiting(tmp_path, center, position=[0, f"{factor * declared} km", 0])
            doubts = input_doubts(mission)
            assert bool(doubts) == (factor < 1)
            for doubt in doubts:
                assert doubt.doubt == pytest.approx(1e3 * declared, rel=1e-4)
                assert f"elements {abs(days):.3g} days from their epoch: 1 km there, 2 km a day" in doubt.note

    def test_rows_along_the_axes_of_the_file_say_it(self, tmp_path: Path) -> None:
        found = check_mission(orbiting(tmp_path, EPOCH.after(86400), position="10 cm"), TODAY)
        of_file = [row(found, f"transmitter.position.{axis}") for axis in ("radial", "in_track", "cross_track")]
        assert {one.status for one in of_file} == {"not_evaluated"}
        assert {row(found, f"transmitter.position.{axis}").status for axis in AXES} == {"info"}
        assert "the path may be 3 km off" in (of_file[0].reason or "")
        assert "173 mm is declared" in (of_file[0].reason or "")
        assert found.status == "not_evaluated"

    @pytest.mark.parametrize(("days", "status"), [(6.9, "not_declared"), (7.1, "not_evaluated")])
    def test_without_a_declared_error_a_week_is_doubted(self, tmp_path: Path, days: float, status: str) -> None:
        """With a quadratic requirement that 15 km do not touch."""
        mission = orbiting(tmp_path, EPOCH.after(86400 * days))
        needs = mission.requirements._replace(quadratic_phase_error=1e6)
        mission = mission._replace(requirements=needs, radar=mission.radar._replace(center_frequency=1e6))
        assert statuses(check_mission(mission, TODAY), "transmitter") == {status}

    def test_a_doubt_is_said_once(self, tmp_path: Path) -> None:
        """As the reason of its rows, or as a warning where the declared error covers it."""
        center = EPOCH.after(86400 * 8)
        found = check_mission(orbiting(tmp_path, center, position="1 km"), TODAY)
        assert [one for one in found.warnings if one.is_doubt] == []
        found = check_mission(orbiting(tmp_path, center, position="20 km"), TODAY)
        (warning,) = [one.message for one in found.warnings if one.is_doubt]
        assert "8.0 days before the aperture" in warning
        assert statuses(found, "transmitter") & {"not_evaluated"} == set()

    def test_an_ephemeris_in_axes_of_the_stars_is_off_by_what_the_earth_does(self, tmp_path: Path) -> None:
        """0.1 s of UT1 - UTC at 7071 km from the axis, where that is the equator, are 52 m."""
        doubts = {}
        for frame in ("GCRF", "ITRF2014"):
            text = oem(frame=frame)
            (tmp_path / "a.oem").write_text(text)
            (tmp_path / "m.yaml").write_text(ephemeris("2026-06-01T05:19:30Z", text))
            doubts[frame] = input_doubts(load_mission(str(tmp_path / "m.yaml")))
        (doubt,) = doubts["GCRF"]
        assert 10 < doubt.doubt < 80
        assert "UT1 - UTC" in doubt.note
        assert doubts["ITRF2014"] == []


class TestSweeps:
    def test_a_sweep_says_the_same(self, tmp_path: Path) -> None:
        """On both sides of the residual, with and without a scene frame, by every rule."""
        mission = logged(tmp_path, noisy(0.02), position=["1 cm", "1 cm", "1 cm"])
        axes = {
            "platforms__receiver__motion_error__position__2": [0.0, 0.01, 0.05, 3.0],
            "allocation__coverage_factor": [1.0, 3.0],
        }
        columns = [f"receiver.position.{axis}.status" for axis in AXES]
        cases = grid(mission, **axes)
        whole = swept(mission, cases, columns)
        assert list(whole["receiver.position.x.status"][:5:2]) == ["not_evaluated", "not_evaluated", "pass"]
        assert_as_checked(mission, cases, whole, columns)
        whole = swept(mission, cases)
        assert_as_checked(mission, cases, whole)

    @pytest.mark.parametrize("error", [{}, {"position": "1 km"}, {"position": "20 km"}], ids=str)
    def test_an_orbit_in_doubt_is_not_evaluated_in_a_sweep(self, tmp_path: Path, error: dict[str, Any]) -> None:
        mission = orbiting(tmp_path, EPOCH.after(86400 * 8), **error)
        cases = grid(mission, radar__center_frequency=[5e9, 10e9])
        whole = swept(mission, cases, ["transmitter.position.x.status"])
        assert_as_checked(mission, cases, whole, ["transmitter.position.x.status"])
        whole = swept(mission, cases)
        assert_as_checked(mission, cases, whole)


def test_a_path_that_the_file_states_has_no_doubt() -> None:
    mission = parse_mission(mission_text(platforms__receiver__motion_error={"position": "1 mm"}))
    assert input_doubts(mission) == []


def test_json_has_the_doubt_of_each_path(run: Callable[..., Any], tmp_path: Path) -> None:
    mission = logged(tmp_path, noisy(0.02), position="5 cm")
    found = json.loads(run("check", tmp_path / "m.yaml", "--format", "json").stdout)["missions"][0]
    path = mission.platforms.receiver.path
    assert found["geometry"]["receiver"]["path"]["doubt_m"] == path.doubt_m
    left = math.sqrt(np.trace(path.log_noise.residual))  # in the aperture, as the doubt
    assert path.doubt_m == pytest.approx(left, rel=0.05)  # of a hundred places few change what is fitted to them
