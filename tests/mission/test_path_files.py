"""Orbits and logs that missions name: read beside the mission, hashed, doubted, and refused in one line."""

import hashlib
import html
import json
import math
import re
import struct
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bisar_budget.budget.check import check_mission
from bisar_budget.faults import MissionError
from bisar_budget.geometry import Vector
from bisar_budget.mission import paths
from bisar_budget.mission.load import load_mission
from bisar_budget.paths import earth
from bisar_budget.paths.elements import read_tle
from bisar_budget.paths.instant import Instant
from bisar_budget.paths.oem import read_oem
from bisar_budget.units import format_quantity
from tests.conftest import TODAY, mission_text
from tests.paths.flown import flight, geodetic_csv, sbet, smrmsg
from tests.paths.orbit_files import CENTER, EPOCH, LINE_1, LINE_2, START, TLE, oem, omm_json, on_circle
from tests.report.test_report_diff import git

BELOW_FLIGHT = {"latitude": "48.1 deg", "longitude": "11.3 deg", "height": "600 m"}  # beside `flown.flight`
LINEAR = ("INTERPOLATION = LINEAR", "INTERPOLATION_DEGREE = 1")
needs_links = pytest.mark.skipif(sys.platform == "win32", reason="needs links without rights to make them")
FLIGHT = {"latitude": "48.2 deg", "longitude": "11.1 deg", "altitude": "3 km", "heading": "60 deg", "speed": "120 kn"}


def overpass(center: Instant) -> earth.Geodetic:
    """A place some 300 km beside the satellite of `TLE`."""
    below = earth.geodetic(read_tle(TLE.encode(), "x", None, center).place(center))
    return earth.Geodetic(below.latitude, below.longitude + 0.05 / math.cos(below.latitude), 500.0)


def satellite(center: Instant = CENTER, **changes: Any) -> str:
    """A mission whose transmitter is the satellite of an orbit, its receiver an aircraft near the scene."""
    at = overpass(center)
    scene = {"latitude": f"{at.latitude} rad", "longitude": f"{at.longitude} rad", "height": "500 m"}
    receiver = {**FLIGHT, "latitude": f"{at.latitude + 0.001} rad", "longitude": f"{at.longitude + 0.001} rad"}
    return _text({"orbit": {"tle": "a.tle"}}, receiver, scene, center.as_text(), **changes)


def aircraft(**changes: Any) -> str:
    """A mission whose receiver is a log."""
    transmitter = {**FLIGHT, "latitude": "47.6 deg", "altitude": "9 km", "speed": "150 m/s"}
    trajectory = {"trajectory": {"file": "flight.csv"}}
    scene = {**BELOW_FLIGHT, "height": changes.pop("height", "600 m")}
    return _text(transmitter, trajectory, scene, "2026-06-01T05:20:06.250Z", **changes)


def ephemeris(center: str, text: str, **changes: Any) -> str:
    """A mission whose transmitter has the ephemeris a.oem, some 300 km from the scene; `text` is a good one."""
    last = START.after(1199.0)
    below = earth.geodetic(read_oem(text.encode(), "x", None, last).place(last))
    scene = {"latitude": f"{below.latitude} rad", "longitude": f"{below.longitude + 0.05} rad", "height": 0}
    receiver = {**FLIGHT, "latitude": f"{below.latitude + 0.001} rad", "longitude": f"{below.longitude + 0.05} rad"}
    return _text({"orbit": {"oem": "a.oem"}}, receiver, scene, center, **changes)


def _text(transmitter: Any, receiver: Any, scene: Any, center: str, **changes: Any) -> str:
    tree = {
        "scene": scene,
        "platforms__transmitter": transmitter,
        "platforms__receiver": receiver,
        "collection__aperture_time": "2 s",
        "collection__center_time": center,
        "allocation__model": "full",
    }
    return mission_text(**{**tree, **changes})


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """One that has a good file of each kind."""
    (tmp_path / "a.tle").write_text(TLE)
    (tmp_path / "a.json").write_bytes(omm_json())
    (tmp_path / "flight.csv").write_bytes(geodetic_csv(flight()))
    (tmp_path / "sbet.out").write_bytes(sbet(flight()))
    (tmp_path / "smrmsg.out").write_bytes(smrmsg(flight().times))
    return tmp_path


class TestEveryKindOfPath:
    def test_elements_put_the_satellite_above_the_scene(self, folder: Path) -> None:
        """Its inclination and height say where it can be: a circle of 7.07 Mm, at most 8.2° from the pole."""
        (folder / "m.yaml").write_text(satellite())
        state = load_mission(str(folder / "m.yaml")).platforms.transmitter.state
        axes = earth.axes_at(overpass(CENTER))
        assert math.hypot(*axes.earth_fixed(state.position)) == pytest.approx(7.07e6, abs=2e4)
        assert math.hypot(*state.velocity) == pytest.approx(7.5e3, abs=150)
        # In Earth-fixed axes: gravity less what the rotation adds, up to 1.1 m/s².
        assert math.hypot(*state.acceleration) == pytest.approx(3.986e14 / 7.07e6**2, abs=1.2)

    def test_two_lines_a_file_and_a_message_are_one_path(self, folder: Path) -> None:
        ways: list[dict[str, Any]] = [
            {"tle": [LINE_1, LINE_2]},
            {"tle": "a.tle", "object": "39634"},
            {"omm": "a.json"},
        ]
        states = []
        for orbit in ways:
            (folder / "m.yaml").write_text(satellite(platforms__transmitter={"orbit": orbit}))
            states.append(load_mission(str(folder / "m.yaml")).platforms.transmitter.state)
        # The message has two digits less of the mean motion: 5e-9 turns a day over 0.8 days are 0.2 m.
        for state in states[1:]:
            assert np.allclose(state.position, states[0].position, rtol=0, atol=0.3)

    def test_a_log_and_a_trajectory_are_where_the_flight_was(self, folder: Path) -> None:
        flown = flight()
        middle = flown.places[250]
        axes = earth.axes_at(earth.Geodetic(math.radians(48.1), math.radians(11.3), 600.0))
        for route in (
            {"file": "flight.csv"},
            {"file": "sbet.out", "week": 2421},
            {"file": "sbet.out", "center": 1e5},
        ):
            if "center" in route:
                route["center"] = "105624.25 s"
            (folder / "m.yaml").write_text(aircraft(platforms__receiver={"trajectory": route}))
            path = load_mission(str(folder / "m.yaml")).platforms.receiver.path
            assert path.state.position == pytest.approx(axes.place(tuple(middle)), abs=1e-3)
            assert path.samples == 101
            assert path.farthest < 1e-6

    def test_a_log_that_has_not_changed_is_read_once(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        """`solve` reads its mission some hundred times."""
        monkeypatch.setattr(paths, "_logs", {})
        monkeypatch.setattr(paths, "_paths", {})
        read, reads = paths.read_log, []
        monkeypatch.setattr(paths, "read_log", lambda *given: reads.append(given) or read(*given))
        (folder / "m.yaml").write_text(aircraft())
        first, again = (load_mission(str(folder / "m.yaml")).platforms.receiver.path for _ in range(2))
        assert again == first
        assert len(reads) == 1
        higher = flight()
        (folder / "flight.csv").write_bytes(geodetic_csv(higher._replace(height=higher.height + 100)))
        other = load_mission(str(folder / "m.yaml")).platforms.receiver.path
        assert len(reads) == 2
        assert other.state.position[2] == pytest.approx(first.state.position[2] + 100, abs=0.1)
        assert other.sha256 != first.sha256

    def test_an_accuracy_file_fills_what_the_mission_leaves_open(self, folder: Path) -> None:
        route = {"file": "sbet.out", "week": 2421, "accuracy": "smrmsg.out"}
        stated = {"trajectory": route, "motion_error": {"velocity": "1 cm/s"}}
        (folder / "m.yaml").write_text(aircraft(platforms__receiver=stated))
        error = load_mission(str(folder / "m.yaml")).platforms.receiver.motion_error
        assert error.position == pytest.approx((0.03, 0.02, 0.05))  # east, north, up
        assert error.velocity == pytest.approx((0.01,) * 3)
        assert error.evidence("position") == "accuracy file smrmsg.out"
        found = check_mission(load_mission(str(folder / "m.yaml")), TODAY)
        said = (
            "platforms.receiver.motion_error.velocity replaces [5 mm/s, 4 mm/s, 6 mm/s] of accuracy file smrmsg.out"
        )
        assert said in found.notes
        assert {row.id for row in found.rows if said in row.remarks} == {f"receiver.velocity.{one}" for one in "xyz"}

    def test_an_accuracy_file_stands_before_a_part_and_behind_a_covariance_and_says_so(self, folder: Path) -> None:
        """The evidence of the accuracy file was lost beside a part, and a covariance replaced it in silence."""
        route = {"file": "sbet.out", "week": 2421, "accuracy": "smrmsg.out"}
        stated = {"trajectory": route, "motion_error": {"sensor": ["stim300", "mosaic-x5-rtk"]}}
        (folder / "m.yaml").write_text(aircraft(platforms__receiver=stated))
        mission = load_mission(str(folder / "m.yaml"))
        error = mission.platforms.receiver.motion_error
        assert error.position == pytest.approx((0.03, 0.02, 0.05))
        assert error.evidence("position") == error.evidence("velocity") == "accuracy file smrmsg.out"
        said = [note for note in check_mission(mission, TODAY).notes if "replaces" in note]
        names = [note.partition(" replaces ")[0] for note in said]
        assert names == ["platforms.receiver.trajectory.accuracy"] * 2
        stated["motion_error"] = {"covariance": {"position": "1 cm", "velocity": "1 cm/s"}}
        (folder / "m.yaml").write_text(aircraft(platforms__receiver=stated))
        said = [note for note in check_mission(load_mission(str(folder / "m.yaml")), TODAY).notes if "smrmsg" in note]
        names = [note.partition(" replaces ")[0] for note in said]
        assert names == ["platforms.receiver.motion_error.covariance"] * 2


class TestWhatIsSaid:
    def test_source_age_and_residual(self, run: Callable[..., Any], folder: Path) -> None:
        (folder / "m.yaml").write_text(satellite())
        report = run("check", folder / "m.yaml", "--format", "json")
        path = json.loads(report.stdout)["missions"][0]["geometry"]["transmitter"]["path"]
        assert path["file"] == "a.tle"
        assert path["sha256"] == hashlib.sha256(TLE.encode()).hexdigest()
        assert path["age_s"] == pytest.approx(
            68898.127568, abs=1e-3
        )  # 05:20:31.250 less 10:12:13.122432 the day before
        assert path["residual_max_m"] < 1e-6
        assert "SENTINEL-1A (39634), epoch 2026-05-31T10:12:13.122Z" in path["source"]
        page = run("check", folder / "m.yaml", "--format", "html").stdout
        assert hashlib.sha256(TLE.encode()).hexdigest() in page
        assert "0.797 days old" in html.unescape(page)

    def test_old_elements_are_a_doubt(self, run: Callable[..., Any], folder: Path) -> None:
        (folder / "m.yaml").write_text(satellite(EPOCH.after(6.9 * 86400)))
        assert "days" not in str(
            json.loads(run("check", folder / "m.yaml", "--format", "json").stdout)["missions"][0]["warnings"]
        )
        (folder / "m.yaml").write_text(
            satellite(EPOCH.after(7.1 * 86400), platforms__receiver__motion_error={"position": "1 mm"})
        )
        found = json.loads(run("check", folder / "m.yaml", "--format", "json").stdout)["missions"][0]
        (doubt,) = {one["reason"] for one in found["rows"] if "days" in (one["reason"] or "")}
        assert "elements 7.1 days from their epoch" in doubt
        assert found["status"] == "not_evaluated"

    def test_a_place_that_strays_is_a_doubt(self, run: Callable[..., Any], folder: Path) -> None:
        """One height of 501 is wrong by 9 cm; of what is wrong by more see the logs that jump."""
        stated = {"trajectory": {"file": "flight.csv"}, "motion_error": {"position": "1 cm"}}
        (folder / "m.yaml").write_text(aircraft(platforms__receiver=stated))
        assert run("check", "--strict", folder / "m.yaml").exit_code == 0
        header, *rest = geodetic_csv(flight()).split(b"\n")
        cells = rest[240].split(b",")
        rest[240] = b",".join([*cells[:3], b"3000.09"])
        (folder / "flight.csv").write_bytes(b"\n".join([header, *rest]))
        found = run("check", "--strict", folder / "m.yaml")
        assert found.exit_code == 1
        assert "a fix of the log, -0.2 s from mid-aperture, is" in " ".join(found.stdout.split())

    def test_chords_of_an_ephemeris_are_a_doubt_wherever_the_middle_is(
        self, run: Callable[..., Any], folder: Path
    ) -> None:
        (folder / "a.oem").write_text(oem(interpolation=LINEAR))
        for center in ("2026-06-01T05:19:00Z", "2026-06-01T05:19:30Z"):  # at a place of the file, and between two
            declared = {"platforms__receiver__motion_error": {"position": "1 mm"}}
            (folder / "m.yaml").write_text(ephemeris(center, oem(), **declared))
            found = json.loads(run("check", folder / "m.yaml", "--format", "json").stdout)["missions"][0]
            assert found["status"] == "not_evaluated"
            (reason,) = {one["reason"] for one in found["rows"] if one["id"].startswith("transmitter.position")}
            said = re.fullmatch(
                r"the path may be (.*) km off \(interpolation of the ephemeris\), but no position error is declared: "
                ".*",
                reason,
            )
            assert float(said[1]) == pytest.approx(3.587, rel=0.02)  # r(ωh)²/8 of a chord of 60 s

    def test_the_accuracy_of_a_log_is_hashed_too(self, run: Callable[..., Any], folder: Path) -> None:
        route = {"file": "sbet.out", "week": 2421, "accuracy": "smrmsg.out"}
        (folder / "m.yaml").write_text(aircraft(platforms__receiver={"trajectory": route}))
        digest = hashlib.sha256((folder / "smrmsg.out").read_bytes()).hexdigest()
        assert digest in run("check", folder / "m.yaml", "--format", "html").stdout
        report = json.loads(run("check", folder / "m.yaml", "--format", "json").stdout)
        path = report["missions"][0]["geometry"]["receiver"]["path"]
        assert path["accuracy"] == {"file": "smrmsg.out", "sha256": digest}

    def test_diff_reads_files_as_they_were_committed(self, run: Callable[..., Any], folder: Path) -> None:
        (folder / "m.yaml").write_text(satellite())
        git(folder, "init", "-q")
        git(folder, "add", ".")
        git(folder, "-c", "user.name=t", "-c", "user.email=t@example.org", "commit", "-q", "-m", "x")
        (folder / "a.tle").write_text(oem())  # no element set any more
        (folder / "b.tle").write_text(TLE.replace("SENTINEL-1A", "SENTINEL"))
        (folder / "m.yaml").write_text(satellite(platforms__transmitter={"orbit": {"tle": "b.tle"}}))
        same = run("diff", folder / "m.yaml", "--base", "HEAD")
        assert same.exit_code == 0, same.stderr
        (folder / "a.tle").write_text(TLE.replace("SENTINEL-1A", "SENTINEL"))
        (folder / "m.yaml").write_text(satellite())
        changed = run("diff", folder / "m.yaml", "--base", "HEAD")
        assert "content of a.tle" in changed.stdout

    @needs_links
    @pytest.mark.parametrize(
        ("target", "said"),
        [
            ("store/orbits/a.tle", ""),
            ("../outside.tle", "a.tle is a link out of the repository, to ../outside.tle, in revision HEAD"),
            ("none.tle", "a.tle is a link that leads nowhere in revision HEAD"),
        ],
    )
    def test_diff_follows_links_within_the_revision(
        self, run: Callable[..., Any], folder: Path, target: str, said: str
    ) -> None:
        """The text of the link was taken for the file. Here a file and a folder above it are links."""
        repository = folder / "repository"
        (repository / "real").mkdir(parents=True)
        (repository / "real" / "a.tle").write_text(TLE)
        (repository / "store").mkdir()
        (repository / "store" / "orbits").symlink_to("../real")
        (repository / "a.tle").symlink_to(target)
        (repository / "real.yaml").write_text(satellite())
        (repository / "m.yaml").symlink_to("real.yaml")
        git(repository, "init", "-q")
        git(repository, "add", ".")
        git(repository, "-c", "user.name=t", "-c", "user.email=t@example.org", "commit", "-q", "-m", "x")
        (repository / "a.tle").unlink()
        (repository / "a.tle").write_text(TLE.replace("SENTINEL-1A", "SENTINEL"))
        found = run("diff", repository / "m.yaml", "--base", "HEAD")
        assert found.exit_code == (2 if said else 0), found.stderr
        assert said in found.stderr
        assert ("content of a.tle" in found.stdout) is (not said)


def rows(keep: Callable[[list[bytes]], list[bytes]]) -> bytes:
    """The log of the flight with some of its rows."""
    header, *rest = geodetic_csv(flight()).split(b"\n")
    return b"\n".join([header, *keep(rest)])


def replaced(change: Callable[[int, list[bytes]], list[bytes]]) -> bytes:
    """The log of the flight with other places: `change` takes the number of a row, and its cells."""
    header, *rest = geodetic_csv(flight()).split(b"\n")
    cells = [change(n, one.split(b",")) if one else [one] for n, one in enumerate(rest)]
    return b"\n".join([header, *(b",".join(one) for one in cells)])


FIRST = geodetic_csv(flight()).split(b"\n")[1].split(b",")


LATER = [one.split(b",")[1:] for one in geodetic_csv(flight()).split(b"\n")[1:]]


def in_metres(seconds: float) -> tuple[Vector, Vector]:
    place, velocity = on_circle(seconds)
    return tuple(1000 * one for one in place), velocity


BROKEN: dict[str, tuple[Callable[[], str], dict[str, bytes | str], str]] = {
    "no such file": (satellite, {"a.tle": ""}, "a.tle: has no element set"),
    "a missing file": (
        lambda: satellite(platforms__transmitter={"orbit": {"tle": "none.tle"}}),
        {},
        "none.tle cannot be read: No such",
    ),
    "a folder": (lambda: satellite(platforms__transmitter={"orbit": {"tle": "."}}), {}, ". is no regular file"),
    "a wrong checksum": (satellite, {"a.tle": TLE[:-2] + "7\n"}, "a.tle:3: the checksum is 7, its digits give"),
    "one line": (satellite, {"a.tle": LINE_1}, "a.tle:1: "),
    "another object": (
        lambda: satellite(platforms__transmitter={"orbit": {"tle": "a.tle", "object": "ENVISAT"}}),
        {},
        "ENVISAT",
    ),
    "no text": (satellite, {"a.tle": b"\xff\xfe1\0"}, "a.tle:1: is not a text in UTF-8"),
    "an ephemeris without its frame": (
        lambda: satellite(platforms__transmitter={"orbit": {"oem": "a.oem"}}),
        {"a.oem": "\n".join(line for line in oem().splitlines() if "REF_FRAME" not in line)},
        "a.oem:",
    ),
    "an ephemeris of another time": (
        lambda: satellite(
            platforms__transmitter={"orbit": {"oem": "a.oem"}}, collection__center_time="2026-06-01T09:00:00Z"
        ),
        {"a.oem": oem()},
        "2026-06-01T05:20:00.000Z",
    ),
    "an ephemeris that ends within the aperture": (
        lambda: satellite(
            platforms__transmitter={"orbit": {"oem": "a.oem"}}, collection__center_time="2026-06-01T05:19:59.500Z"
        ),
        {"a.oem": oem()},
        "2026-06-01T05:20:00.000Z",
    ),
    "hostile XML": (
        lambda: satellite(platforms__transmitter={"orbit": {"omm": "a.xml"}}),
        {"a.xml": '<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/passwd">]><omm>&x;</omm>'},
        "a.xml:1: ",
    ),
    "a log that misses the aperture": (
        lambda: aircraft(collection__center_time="2026-06-01T05:30:00Z"),
        {},
        "flight.csv: covers 2026-06-01T05:20:01.250Z",
    ),
    "a log with a gap": (
        aircraft,
        {"flight.csv": rows(lambda rest: rest[:240] + rest[270:])},
        "flight.csv: has a gap of",
    ),
    "elements ten years old": (
        lambda: satellite(EPOCH.after(3652.2 * 86400)),
        {},
        "3652.2 days before the aperture; its position by SGP4 may be 3653 to 10958 km off; a doubt of 7305 km is "
        "more",
    ),
    "an ephemeris that is missed by 80 km": (
        lambda: ephemeris("2026-06-01T05:20:00Z", oem()),
        {"a.oem": oem(interpolation=LINEAR, step=282.0)},
        "too sparse around 2026-06-01T05:20:00.000Z to interpolate",
    ),
    "a log that stands still": (
        aircraft,
        {"flight.csv": replaced(lambda _, cells: [cells[0], *FIRST[1:]])},
        "flight.csv: stands still: its 101 fixes around the aperture are the same to 1 mm; accepted: the log of a "
        "platform that moves. A fixed platform needs no log: give its position, and speed 0",
    ),
    "a log that repeats fixes": (
        aircraft,
        {"flight.csv": replaced(lambda n, cells: [cells[0], *LATER[5 * (n // 5)]])},
        "flight.csv: repeats fixes: 80 of 101 around the aperture equal the fix before",
    ),
    "a log that jumps": (
        aircraft,
        {"flight.csv": replaced(lambda n, cells: [*cells[:3], b"9000" if n == 240 else cells[3]])},
        "flight.csv: jumps by 6 km within 0.02 s",
    ),
    "a log of three places": (
        aircraft,
        {"flight.csv": rows(lambda rest: rest[::400])},
        "flight.csv",
    ),
    "a log out of order": (
        aircraft,
        {"flight.csv": rows(lambda rest: rest[::-1])},
        "flight.csv:",
    ),
    "a log without units": (
        aircraft,
        {"flight.csv": geodetic_csv(flight()).replace(b" [deg]", b"", 1)},
        "flight.csv:1: ",
    ),
    "a log in seconds of which nobody knows the middle": (
        lambda: aircraft(platforms__receiver={"trajectory": {"file": "sbet.out"}}),
        {},
        "sbet.out: counts seconds of a GPS week, ",
    ),
    "a trajectory cut off": (
        lambda: aircraft(platforms__receiver={"trajectory": {"file": "sbet.out", "week": 2421}}),
        {"sbet.out": sbet(flight())[:1000]},
        "sbet.out",
    ),
    "a trajectory in degrees": (
        lambda: aircraft(platforms__receiver={"trajectory": {"file": "sbet.out", "week": 2421}}),
        {"sbet.out": sbet(flight(), latitude=48.0)},
        "sbet.out",
    ),
    "an accuracy file that is a trajectory": (
        lambda: aircraft(
            platforms__receiver={"trajectory": {"file": "sbet.out", "week": 2421, "accuracy": "sbet.out"}}
        ),
        {},
        "sbet.out",
    ),
    "an accuracy of zeros": (
        lambda: aircraft(
            platforms__receiver={"trajectory": {"file": "sbet.out", "week": 2421, "accuracy": "zeros.out"}}
        ),
        {"zeros.out": smrmsg(np.arange(61.0), north=0, east=0, down=0, rates=(0, 0, 0))},
        "no trajectory is without error",
    ),
    "an accuracy that is no bound": (
        lambda: aircraft(
            platforms__receiver={
                "trajectory": {"file": "sbet.out", "week": 2421, "accuracy": "smrmsg.out"},
                "motion_error": {"distribution": "uniform", "velocity": "1 cm/s"},
            }
        ),
        {},
        "states one sigma",
    ),
    "an accuracy in another frame": (
        lambda: aircraft(
            platforms__receiver={
                "trajectory": {"file": "sbet.out", "week": 2421, "accuracy": "smrmsg.out"},
                "motion_error": {"frame": "track"},
            }
        ),
        {},
        "states errors east, north, up",
    ),
    "an ephemeris in metres": (
        lambda: satellite(
            platforms__transmitter={"orbit": {"oem": "a.oem"}}, collection__center_time="2026-06-01T05:10:00Z"
        ),
        {"a.oem": oem(path=in_metres, interpolation=("INTERPOLATION = LAGRANGE", "INTERPOLATION_DEGREE = 7"))},
        "farther than the Moon; are its units km?",
    ),
    "a week of a log in UTC": (
        lambda: aircraft(platforms__receiver={"trajectory": {"file": "flight.csv", "week": 2421}}),
        {},
        "trajectory.week: is for an SBET; flight.csv is CSV with a header (got 2421). Leave trajectory.week out",
    ),
    "a path below the ground": (lambda: aircraft(height="3500 m"), {}, "below the scene's horizon"),
    "a name with a control character": (
        lambda: satellite(platforms__transmitter={"orbit": {"tle": "a\u001b[31m.tle"}}),
        {},
        "printable",
    ),
    "NaN in a trajectory": (
        lambda: aircraft(platforms__receiver={"trajectory": {"file": "sbet.out", "week": 2421}}),
        {"sbet.out": struct.pack("<17d", *[math.nan] * 17) * 10},
        "sbet.out",
    ),
}


@pytest.mark.parametrize(("text", "files", "said"), BROKEN.values(), ids=BROKEN)
def test_a_path_that_cannot_be_read_is_one_line_and_no_report(
    run: Callable[..., Any], folder: Path, text: Callable[[], str], files: dict[str, bytes | str], said: str
) -> None:
    for name, content in files.items():
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    (folder / "m.yaml").write_text(text())
    result = run("check", folder / "m.yaml", "--report", folder / "report.html")
    assert result.exit_code == 2
    faults = [line for line in result.stderr.splitlines() if "m.yaml:" in line]
    assert len(faults) == 1, result.stderr
    assert said in faults[0]
    assert all(faults[0].count(name) <= 1 for name in ("a.tle", "flight.csv", "sbet.out")), faults[0]
    assert "Traceback" not in result.stderr
    assert all(one.isprintable() for one in result.stderr.splitlines())


def test_a_missing_package_is_named(run: Callable[..., Any], folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "m.yaml").write_text(satellite())
    monkeypatch.setattr(paths, "_paths", {})
    monkeypatch.setitem(sys.modules, "sgp4", None)
    monkeypatch.setitem(sys.modules, "sgp4.api", None)
    result = run("check", folder / "m.yaml")
    assert result.exit_code == 2
    assert "pip install pyerfa sgp4" in result.stderr


def test_a_report_says_where_and_when(run: Callable[..., Any], folder: Path) -> None:
    (folder / "m.yaml").write_text(aircraft(platforms__receiver__motion_error={"position": "1 mm"}))
    place = "48.10000° N, 11.30000° E, 600 m above the ellipsoid, mid-aperture 2026-06-01T05:20:06.250Z"
    assert place in " ".join(run("check", folder / "m.yaml").stdout.split())
    assert place in html.unescape(run("check", folder / "m.yaml", "--format", "html").stdout)


@pytest.mark.parametrize("days", [30.0, 36.0, 38.0, 40.0, 42.0, 50.0])
def test_elements_are_refused_from_a_tenth_of_the_slant_range_on(folder: Path, days: float) -> None:
    """A kilometre and two a day, against the distance of the satellite, by the places of both on the Earth."""
    center = EPOCH.after(days * 86400)
    (folder / "m.yaml").write_text(satellite(center))
    scene = earth.earth_fixed(overpass(center))
    away = math.dist(read_tle(TLE.encode(), "x", None, center).place(center), scene)
    if 1e3 + 2e3 * days <= away / 10:
        assert load_mission(str(folder / "m.yaml")).platforms.transmitter.path.doubt_m > 6e4
        return
    with pytest.raises(MissionError) as error:
        load_mission(str(folder / "m.yaml"))
    (fault,) = error.value.faults
    assert (fault.line, fault.key) == (12, "platforms.transmitter.orbit.tle")
    assert fault.accepted == f"accepted: an orbit that is known to {format_quantity(away / 10, 'm', 4)}"
    assert f"is more than a tenth of the slant range, {format_quantity(away, 'm', 4)}" in fault.problem
    assert fault.hint == "Take elements whose epoch is nearer to collection.center_time"


@pytest.mark.parametrize("step", [200.0, 215.0, 230.0, 240.0])
def test_an_ephemeris_is_refused_from_50_km_on(folder: Path, step: float) -> None:
    """Chords, at a place of the file too: the velocity is wrong there. r(ωh)²/8 is 50 km from h = 224 s on."""
    missed = 7_071_000.0 * (1.0617e-3 * step) ** 2 / 8
    (folder / "a.oem").write_text(oem(interpolation=LINEAR, step=step))
    for seconds in (5 * step, 5.5 * step):
        (folder / "m.yaml").write_text(ephemeris(START.after(seconds).as_text(), oem()))
        if missed < 49e3:
            path = load_mission(str(folder / "m.yaml")).platforms.transmitter.path
            assert path.doubt_m == pytest.approx(missed, rel=0.05)
            continue
        with pytest.raises(MissionError) as error:
            load_mission(str(folder / "m.yaml"))
        assert [fault.hint for fault in error.value.faults] == ["Write the ephemeris more often"]


def test_faults_of_both_paths_are_said_at_once(folder: Path) -> None:
    (folder / "flight.csv").write_bytes(replaced(lambda n, cells: [*cells[:3], b"9000" if n == 240 else cells[3]]))
    (folder / "held.csv").write_bytes(replaced(lambda _, cells: [cells[0], *FIRST[1:]]))
    transmitter = {"trajectory": {"file": "held.csv"}}
    (folder / "m.yaml").write_text(aircraft(platforms__transmitter=transmitter))
    with pytest.raises(MissionError) as error:
        load_mission(str(folder / "m.yaml"))
    assert [fault.key.split(".")[1] for fault in error.value.faults] == ["transmitter", "receiver"]
    assert "stands still" in error.value.faults[0].problem
    assert "jumps by 6 km" in error.value.faults[1].problem


# ---------------------------------------------------------------------- orbits in files of others
FILES = Path(__file__).parent.parent / "paths" / "files"
EOF = "S1A_RESORB_20230823_excerpt.EOF"


def sentinel(**changes: Any) -> str:
    """A mission whose transmitter is a real orbit file of Sentinel-1A, over the sea south of India."""
    scene = {"latitude": "7 deg", "longitude": "53 deg", "height": 0}
    receiver = {**FLIGHT, "latitude": "7.01 deg", "longitude": "53.01 deg"}
    orbit = {"orbit": {"eof": EOF}, "motion_error": {"position": "30 cm"}}
    return _text(orbit, receiver, scene, "2023-08-23T14:10:00Z", **changes)


def test_a_sentinel_by_its_orbit_file(run: Callable[..., Any], tmp_path: Path) -> None:
    (tmp_path / EOF).write_bytes((FILES / EOF).read_bytes())
    (tmp_path / "m.yaml").write_text(sentinel())
    found = json.loads(run("check", tmp_path / "m.yaml", "--format", "json").stdout)["missions"][0]
    path = found["geometry"]["transmitter"]["path"]
    assert path["source"] == "AUX_RESORB of Sentinel-1A, Hermite degree 7"
    assert path["sha256"] == hashlib.sha256((FILES / EOF).read_bytes()).hexdigest()
    assert path["doubt_m"] == pytest.approx(0.1, abs=1e-3)
    assert path["residual_max_m"] < 1e-6
    # 10 cm are more than 5 cm along each axis root-sum-square: what is declared is not the whole truth.
    (tmp_path / "m.yaml").write_text(sentinel().replace("30 cm", "5 cm"))
    found = json.loads(run("check", tmp_path / "m.yaml", "--format", "json").stdout)["missions"][0]
    (reason,) = {one["reason"] for one in found["rows"] if one["id"].startswith("transmitter.position")}
    assert reason == (
        f"{EOF}, accuracy of AUX_RESORB: a position error of 100 mm is stated, but 86.6 mm is declared: "
        "declare at least that in platforms.transmitter.motion_error.position"
    )


TABLE = (FILES / "finals2000A_excerpt.all").read_bytes()


def turned(stated: Mapping[str, Any] | None, **changes: Any) -> str:
    """A mission whose transmitter is an ephemeris in axes of the stars, on the day that the table is of."""
    begins = Instant(60179, 0.0)
    text = oem(frame="GCRF", times=begins.after)
    middle = begins.after(600.0)
    below = earth.geodetic(read_oem(text.encode(), "x", None, middle).place(middle))
    at = {"latitude": f"{below.latitude} rad", "longitude": f"{below.longitude + 0.05} rad"}
    receiver = {**FLIGHT, **at, "latitude": f"{below.latitude + 0.001} rad"}
    more = {} if stated is None else {"earth_orientation": stated}
    return _text({"orbit": {"oem": "t.oem"}}, receiver, {**at, "height": 0}, middle.as_text(), **more, **changes)


@pytest.fixture
def stars(tmp_path: Path) -> Path:
    (tmp_path / "t.oem").write_text(oem(frame="GCRF", times=Instant(60179, 0.0).after))
    (tmp_path / "finals.all").write_bytes(TABLE)
    return tmp_path


class TestEarthOrientation:
    def place(self, folder: Path, stated: Mapping[str, Any] | None) -> Any:
        (folder / "m.yaml").write_text(turned(stated))
        path = load_mission(str(folder / "m.yaml")).platforms.transmitter.path
        assert path is not None
        return path

    def test_figures_and_the_table_are_one_path(self, stars: Path) -> None:
        """UT1 - UTC and the pole at 2023-08-23T00:10 by hand from two rows of the table, Bulletin B."""
        part = 600 / 86400
        figures = {
            "ut1_minus_utc": f"{-0.0027933 + part * (-0.0020899 + 0.0027933)} s",
            "polar_motion_x": f"{0.291358 + part * (0.292539 - 0.291358)} arcsec",
            "polar_motion_y": f"{0.429819 + part * (0.427299 - 0.429819)} arcsec",
        }
        by_file, by_hand = (self.place(stars, one) for one in ({"file": "finals.all"}, figures))
        assert by_file.orientation == ("finals.all", hashlib.sha256(TABLE).hexdigest())
        assert by_hand.orientation is None
        assert math.dist(by_file.state.position, by_hand.state.position) < 1e-4
        for path in (by_file, by_hand):
            assert path.doubt_m < 0.1
            assert path.doubts == ()

    def test_it_moves_the_satellite_by_what_the_earth_turns(self, stars: Path) -> None:
        without, moved = (self.place(stars, one) for one in (None, {"ut1_minus_utc": "-0.5 s"}))
        (folder,) = [stars]
        level = math.hypot(*without.state.velocity)
        assert level > 7e3
        assert math.dist(without.state.position, moved.state.position) == pytest.approx(
            0.5 * 7.292115e-5 * self.radius(folder), rel=1e-3
        )
        assert "UT1 = UTC and without polar motion" in without.doubts[0]
        assert "GCRF is turned to the Earth to about 21 m" in moved.doubts[0]

    def radius(self, folder: Path) -> float:
        """Distance of the satellite from the Earth's axis. [m]"""
        begins = Instant(60179, 0.0)
        x, y, _ = read_oem((folder / "t.oem").read_bytes(), "x", None, begins.after(600)).place(begins.after(600))
        return math.hypot(x, y)

    def test_a_sweep_over_it_is_as_checked(self, run: Callable[..., Any], stars: Path) -> None:
        key, column = "earth_orientation.ut1_minus_utc", "transmitter.velocity.y.allowable"
        (stars / "m.yaml").write_text(turned({"ut1_minus_utc": "0 s"}))
        swept = run("sweep", stars / "m.yaml", "--vary", f"{key}=-0.5,0.5 s", "--column", column).stdout
        rows = [line.split(",") for line in swept.splitlines() if not line.startswith("#")]
        found = [float(row[rows[0].index(column + " [m/s]")]) for row in rows[1:]]
        for value, one in zip(("-0.5 s", "0.5 s"), found, strict=True):
            text = run("check", stars / "m.yaml", "--set", f"{key}={value}", "--format", "json").stdout
            (row,) = [row for row in json.loads(text)["missions"][0]["rows"] if row["id"] == "transmitter.velocity.y"]
            assert one == pytest.approx(row["allowable"], rel=1e-6)  # searched to 1e-8
        assert found[0] != pytest.approx(found[1], rel=1e-5)

    def test_its_file_stands_in_the_report_and_diff_sees_what_it_says(
        self, run: Callable[..., Any], stars: Path
    ) -> None:
        (stars / "m.yaml").write_text(turned({"file": "finals.all"}))
        assert hashlib.sha256(TABLE).hexdigest() in run("check", stars / "m.yaml", "--format", "html").stdout
        found = json.loads(run("check", stars / "m.yaml", "--format", "json").stdout)["missions"][0]
        path = found["geometry"]["transmitter"]["path"]
        assert path["earth_orientation"] == {"file": "finals.all", "sha256": hashlib.sha256(TABLE).hexdigest()}
        git(stars, "init", "-q")
        git(stars, "add", ".")
        git(stars, "-c", "user.name=t", "-c", "user.email=t@example.org", "commit", "-q", "-m", "x")
        (stars / "finals.all").write_bytes(TABLE.replace(b"-0.0027933", b"-0.0028933"))
        assert "content of finals.all" in run("diff", stars / "m.yaml", "--base", "HEAD").stdout

    @pytest.mark.parametrize(
        ("stated", "key", "said"),
        [
            ({}, "earth_orientation", "lacks ut1_minus_utc"),
            ({"polar_motion_x": "0.1 arcsec"}, "earth_orientation", "lacks ut1_minus_utc"),
            (
                {"ut1_minus_utc": "0.1 s", "polar_motion_x": "0.1 arcsec"},
                "earth_orientation.polar_motion_x",
                "has half of the polar motion",
            ),
            ({"ut1_minus_utc": "0.91 s"}, "earth_orientation.ut1_minus_utc", "must be at most 900 ms"),
            ({"ut1_minus_utc": "0.1 m"}, "earth_orientation.ut1_minus_utc", "must be a time"),
            ({"file": "finals.all", "ut1_minus_utc": "0.1 s"}, "earth_orientation.ut1_minus_utc", "mixes file with"),
            (
                {"file": "t.oem"},
                "earth_orientation.file",
                "t.oem:1: MJD must be a number, in the columns of the IERS",
            ),
            ({"file": "none.all"}, "earth_orientation.file", "none.all cannot be read: No such file"),
        ],
    )
    def test_what_is_refused(self, stars: Path, stated: Mapping[str, Any], key: str, said: str) -> None:
        (stars / "m.yaml").write_text(turned(stated))
        with pytest.raises(MissionError) as caught:
            load_mission(str(stars / "m.yaml"))
        faults = [fault for fault in caught.value.faults if fault.key == key]
        assert len(faults) == 1
        assert faults[0].problem.startswith(said)
        assert faults[0].line is not None
