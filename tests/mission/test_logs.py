"""Missions whose platform is a log of some format: the same verdict as by the CSV of the flight."""

import json
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bisar_budget.budget.check import check_mission
from bisar_budget.mission.load import load_mission
from tests import conftest
from tests.conftest import TODAY
from tests.mission.test_path_files import aircraft
from tests.paths.flown import flight, geodetic_csv
from tests.paths.log_files import SIGMAS, every_format, solution

FLOWN = flight()
FILES = every_format(FLOWN)
# Last digits of places [m]. White rounding by q moves the acceleration of a parabola through N = 101 places over
# T = 2 s by q/√12·√720/(T²√N) = 0.2 q/s² (one sigma). It is 0.4 m/s² here, and decides on the velocities: 1 q/m
# covers them. What is not written coarsely is rounded as allowables are, at 1e-11.
DIGITS = {
    "a.pos": 1.1e-4,
    "seconds.pos": 3.1e-4,
    "ecef.pos": 1e-4,
    **dict.fromkeys(("a.nmea", "gns.log", "a.gpx"), 1.9e-4),
    **dict.fromkeys(("a.ulg", "px4.csv", "dataflash.log", "mavlogdump.csv"), 1.1e-2),
    **dict.fromkeys(("now.ulg", "own.ulg", "px4_now.csv", "airdata.csv"), 1e-7),
}


def checked(folder: Path, route: dict[str, Any], **more: Any) -> Any:
    """Findings of a mission that flies a smooth path through a log: steps of 1e-7 deg are 11 mm."""
    platform = {
        "trajectory": {**route, "processed": "smoothed"},
        "motion_error": {"position": "2 cm", "velocity": "2 mm/s"},
        **more,
    }
    (folder / "m.yaml").write_text(aircraft(platforms__receiver=platform))
    return check_mission(load_mission(str(folder / "m.yaml")), TODAY)


@pytest.fixture(scope="module")
def by_csv(tmp_path_factory: pytest.TempPathFactory) -> Any:
    folder = tmp_path_factory.mktemp("csv")
    (folder / "flight.csv").write_bytes(geodetic_csv(FLOWN))
    return checked(folder, {"file": "flight.csv"})


@pytest.mark.parametrize("is_stated", [False, True])
@pytest.mark.parametrize("name", FILES)
def test_a_check_is_that_of_the_csv(name: str, is_stated: bool, by_csv: Any, tmp_path: Path) -> None:
    kind, data, keys = FILES[name]
    if kind == "nmea":
        pytest.importorskip("pynmea2")
    (tmp_path / name).write_bytes(data)
    found = checked(tmp_path, {"file": name, **keys, **({"format": kind} if is_stated else {})})
    assert found.status == by_csv.status
    rows, expected = ({row.id: row for row in one.rows} for one in (found, by_csv))
    assert rows.keys() == expected.keys()
    compared = 0
    for id, row in rows.items():
        if expected[id].allowable is not None and expected[id].allowable > 0:
            assert row.allowable == pytest.approx(expected[id].allowable, rel=DIGITS[name]), id
            compared += 1
    assert compared > 5


class TestSolutionsSayTheirErrors:
    def test_they_fill_what_the_mission_leaves_open(self, tmp_path: Path) -> None:
        (tmp_path / "a.pos").write_bytes(solution(FLOWN))
        found = checked(tmp_path, {"file": "a.pos"}, motion_error={"velocity": "2 mm/s"})
        error = load_mission(str(tmp_path / "m.yaml")).platforms.receiver.motion_error
        assert error.position == pytest.approx(SIGMAS)
        assert error.evidence("position") == "solution a.pos"
        assert not [note for note in found.notes if "a.pos" in note]

    def test_the_largest_in_the_aperture_counts(self, tmp_path: Path) -> None:
        """Of 2 s around the middle: one in it, one far outside."""
        lines = solution(FLOWN).decode().splitlines()
        for at, figure in ((3 + 260, "0.0700"), (3 + 20, "0.9000")):
            lines[at] = lines[at].replace("0.0200", figure)
        (tmp_path / "a.pos").write_text("\n".join(lines))
        checked(tmp_path, {"file": "a.pos"}, motion_error={})
        error = load_mission(str(tmp_path / "m.yaml")).platforms.receiver.motion_error
        assert error.position == pytest.approx((*SIGMAS[:2], 0.07))

    def test_what_the_mission_states_is_noted_beside_them(self, tmp_path: Path) -> None:
        (tmp_path / "a.pos").write_bytes(solution(FLOWN))
        found = checked(tmp_path, {"file": "a.pos"})
        said = "platforms.receiver.motion_error.position replaces [8 mm, 10 mm, 20 mm] of solution a.pos"
        assert said in found.notes
        assert {row.id for row in found.rows if said in row.remarks} == {f"receiver.position.{one}" for one in "xyz"}

    def test_bounds_leave_the_position_open_and_in_doubt(self, tmp_path: Path) -> None:
        """A sigma is no bound; and what the log states is more than nothing."""
        (tmp_path / "a.pos").write_bytes(solution(FLOWN))
        found = checked(tmp_path, {"file": "a.pos"}, motion_error={"velocity": "2 mm/s", "distribution": "bound"})
        assert load_mission(str(tmp_path / "m.yaml")).platforms.receiver.motion_error.position is None
        assert conftest.row(found, "receiver.position.x").status == "not_evaluated"
        assert "no position error is declared" in str(conftest.row(found, "receiver.position.x").reason)

    def test_other_axes_have_at_least_as_much_in_every_direction(self, tmp_path: Path) -> None:
        """Independent errors along the track that cover sigmas along east, north, up."""
        (tmp_path / "a.pos").write_bytes(solution(FLOWN))
        checked(tmp_path, {"file": "a.pos"}, motion_error={"velocity": "2 mm/s", "frame": "track"})
        receiver = load_mission(str(tmp_path / "m.yaml")).platforms.receiver
        axes = np.array(receiver.state.frame("track"))
        covered = axes.T @ np.diag(np.square(receiver.motion_error.position)) @ axes
        assert np.linalg.eigvalsh(covered - np.diag(np.square(SIGMAS)))[0] > -1e-12
        assert max(receiver.motion_error.position) < math.sqrt(3) * max(SIGMAS)

    def test_zeros_say_nothing(self, tmp_path: Path) -> None:
        (tmp_path / "a.pos").write_bytes(solution(FLOWN, sigmas=(0.0, 0.0, 0.0)))
        checked(tmp_path, {"file": "a.pos"}, motion_error={})
        assert load_mission(str(tmp_path / "m.yaml")).platforms.receiver.motion_error.position is None


@pytest.mark.parametrize(
    ("name", "keys", "key", "says"),
    [
        (
            "a.ulg",
            {"format": "csv"},
            "format",
            "a.ulg: is a PX4 ULog (got csv); accepted: CSV with a header. trajectory.format: ulog reads it",
        ),
        (
            "a.pos",
            {"time_scale": "utc"},
            "time_scale",
            "a.pos: counts in GPST, and trajectory.time_scale says UTC (got utc); accepted: gps. Leave "
            "trajectory.time_scale out: the log says it",
        ),
        (
            "a.nmea",
            {"geoid_separation": "47 m"},
            "geoid_separation",
            "a.nmea: gives the geoid separation itself, and trajectory.geoid_separation is given beside it "
            "(got 47 m). Leave trajectory.geoid_separation out",
        ),
        (
            "a.gpx",
            {"week": 2421},
            "week",
            "is for an SBET; a.gpx is a GPX track (got 2421). Leave trajectory.week out",
        ),
        (
            "dataflash.log",
            {"geoid_separation": None},
            "file",
            "dataflash.log: has heights above mean sea level, and no geoid separation; accepted: "
            "trajectory.geoid_separation: 47 m and the like, the height of the geoid above the ellipsoid there. 0 m "
            "where the heights are above the ellipsoid",
        ),
        ("a.gpx", {"geoid_separation": "470 m"}, "geoid_separation", "must be at most 200 m (got 470 m)"),
        ("a.gpx", {"time_scale": "gpst"}, "time_scale", "accepted: utc, gps, tai. Did you mean 'gps'?"),
    ],
)
def test_a_conflict_is_one_line_at_its_key(
    run: Callable[..., Any], name: str, keys: dict[str, Any], key: str, says: str, tmp_path: Path
) -> None:
    kind, data, own = FILES[name]
    if kind == "nmea":
        pytest.importorskip("pynmea2")
    (tmp_path / name).write_bytes(data)
    route = {key: value for key, value in {"file": name, **own, **keys}.items() if value is not None}
    (tmp_path / "m.yaml").write_text(aircraft(platforms__receiver={"trajectory": route}))
    result = run("check", tmp_path / "m.yaml")
    assert result.exit_code == 2
    (fault,) = [line for line in result.stderr.splitlines() if "m.yaml:" in line]
    assert re.search(rf"m\.yaml:\d+:\d+: platforms\.receiver\.trajectory\.{key}: ", fault)
    assert says in fault


def test_a_report_says_format_and_scale(run: Callable[..., Any], tmp_path: Path) -> None:
    (tmp_path / "a.pos").write_bytes(solution(FLOWN))
    (tmp_path / "m.yaml").write_text(aircraft(platforms__receiver={"trajectory": {"file": "a.pos"}}))
    report = json.loads(run("check", tmp_path / "m.yaml", "--format", "json").stdout)
    path = report["missions"][0]["geometry"]["receiver"]["path"]
    assert path["source"] == "RTKLIB solution (fix 490, float 11), 501 fixes over 10 s, UTC is GPS less 18 s"
    assert path["stretch_s"] >= 2
    assert path["samples"] == 2 * int(path["stretch_s"] / 2 * 50) + 1  # on both sides of the middle, and it
