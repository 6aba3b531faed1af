"""What an input states of its own accuracy: it fills an absent error, and a declared one below it is not judged."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from bisar_budget.budget.check import check_mission
from bisar_budget.budget.doubts import input_doubts
from bisar_budget.faults import MissionError
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.mission.load import load_mission
from bisar_budget.mission.model import Mission
from tests.budget.test_input_doubt import statuses
from tests.conftest import TEXT_FORMATS, TODAY, row
from tests.mission.test_path_files import aircraft, ephemeris, satellite
from tests.paths.flown import flight, geodetic_csv
from tests.paths.log_files import GPS_OF_OLD, SIGMAS, gga, gps_records, nmea, sentence, solution, topic, ulog
from tests.paths.orbit_files import EPOCH, TLE, oem, omm_with_covariance
from tests.paths.test_accuracy import START, triangle, with_covariance
from tests.questions.test_sweep import assert_as_checked, grid, swept

CENTER = "2026-06-01T05:19:30Z"
RIC = ("radial", "in_track", "cross_track")
PLAN = "the orbit is the plan: neither its age nor its interpolation counts"
_PASSES = ("passes", "--from", "2026-06-01", "--days", "1")
COMMANDS = [
    ("check", "-q"),
    *(("check", "--format", name) for name in TEXT_FORMATS),
    ("check", "--explain", "transmitter.velocity.x"),
    *((*_PASSES, "--format", name) for name in ("text", "csv", "json", "ics")),
    ("sweep", "--vary", "collection.aperture_time=1s:2s:2"),
    ("solve", "--for", "collection.aperture_time"),
    ("sensitivity",),
    ("allocate", "--set", "allocation.combine=rss"),
    ("verify", "--only", "transmitter.velocity.x"),
]


def orbiting(
    folder: Path,
    position_m: tuple[float, float, float] = (1.0, 1.0, 1.0),
    velocity_mps: float = 1e-3,
    requirements: dict[str, Any] | None = None,
    **error: Any,
) -> MissionFindings:
    """A mission whose transmitter is an ephemeris with a covariance along radial, in-track, cross-track."""
    text = with_covariance((1170.0, "RTN", triangle(position_m, velocity_mps)))
    (folder / "a.oem").write_text(text)
    transmitter = {"orbit": {"oem": "a.oem"}, "motion_error": {"frame": "ric", "velocity": "1 cm/s", **error}}
    kept = {key: value for key, value in transmitter["motion_error"].items() if value is not None}  # type: ignore[attr-defined]
    changes: dict[str, Any] = {} if requirements is None else {"requirements": requirements}
    (folder / "m.yaml").write_text(
        ephemeris(
            CENTER, oem(times=START.after), platforms__transmitter={**transmitter, "motion_error": kept}, **changes
        )
    )
    return check_mission(load_mission(str(folder / "m.yaml")), TODAY)


class TestACovarianceOfAnEphemeris:
    def test_10_km_are_no_metre(self, tmp_path: Path) -> None:
        found = orbiting(tmp_path, (1e4, 1e4, 1e4), position="1 m")
        assert found.status == "not_evaluated"
        for axis in RIC:
            one = row(found, f"transmitter.position.{axis}")
            assert one.status == "not_evaluated"
            assert one.reason == (
                "a.oem, covariance of 2026-06-01T05:19:30.000Z: a position error of 10 km (radial, in-track, "
                "cross-track) is stated, but 1 m is declared: declare at least that in "
                "platforms.transmitter.motion_error.position"
            )
        assert statuses(found, "receiver") == {"not_declared"}

    def test_a_metre_is_one(self, tmp_path: Path, run: Callable[..., Any]) -> None:
        """Equal is enough; reports show what was read."""
        found = orbiting(tmp_path, position="1 m")
        assert input_doubts(found.analysed().mission) == []
        assert found.status == "pass"
        said = json.loads(run("check", tmp_path / "m.yaml", "--format", "json").stdout)["missions"][0]
        path = said["geometry"]["transmitter"]["path"]
        (stated,) = path["stated"]
        assert stated["source"] == "a.oem, covariance of 2026-06-01T05:19:30.000Z"
        assert stated["position_m"] == pytest.approx([1, 1, 1])
        assert path["doubt_m"] == pytest.approx(3**0.5)
        assert any("replaces [1 m, 1 m, 1 m] of a.oem" in note for note in found.notes)

    @pytest.mark.parametrize(
        ("declared", "is_enough"),
        [
            (["10 m", "10 m", "1 m"], True),
            (["1 m", "1 m", "100 m"], False),  # more as a root-sum-square, and less along two axes
            (["9.9 m", "10 m", "1 m"], False),
            (["10.1 m", "10 m", "1 m"], True),
        ],
    )
    def test_no_direction_may_have_more_than_is_declared(
        self, declared: list[str], is_enough: bool, tmp_path: Path
    ) -> None:
        found = orbiting(tmp_path, (10.0, 10.0, 1.0), position=declared)
        assert (input_doubts(found.analysed().mission) == []) == is_enough

    def test_between_axes_too(self, tmp_path: Path) -> None:
        """10 m radial, declared along east, north, up with the same variance on each axis and no correlation."""
        loose = orbiting(tmp_path, (10.0, 0.1, 0.1), frame="scene", position="10 m")
        assert input_doubts(loose.analysed().mission) == []
        (stated,) = loose.analysed().mission.platforms.transmitter.path.stated
        marginal = [f"{stated.covariance[axis][axis] ** 0.5 * 1.0001} m" for axis in range(3)]
        tight = orbiting(tmp_path, (10.0, 0.1, 0.1), frame="scene", position=marginal)
        (doubt,) = input_doubts(tight.analysed().mission)
        assert "between the axes" in doubt.note
        assert doubt.doubt > doubt.declared

    def test_a_covariance_of_the_mission_is_compared_as_it_stands(self, tmp_path: Path) -> None:
        covariance = {
            "position": "10 m",
            "velocity": "1 cm/s",
            "correlation": {"position.radial-position.in_track": 0.9},
        }
        for size, is_enough in (("10 m", False), ("33 m", True)):  # the narrow direction has 10 % of the variance
            covariance["position"] = size
            found = orbiting(tmp_path, (10.0, 10.0, 10.0), velocity=None, covariance=covariance)
            assert (input_doubts(found.analysed().mission) == []) == is_enough

    def test_where_nothing_is_declared_it_is_the_error(self, tmp_path: Path) -> None:
        found = orbiting(tmp_path, (3.0, 20.0, 5.0))
        error = found.analysed().mission.platforms.transmitter.motion_error
        assert error.position == pytest.approx((3.0, 20.0, 5.0), rel=1e-4)
        assert error.velocity == (0.01, 0.01, 0.01)
        assert (error.evidence("position") or "").startswith("a.oem, covariance of")
        assert row(found, "transmitter.position.in_track").declared == pytest.approx(20.0, rel=1e-4)

    def test_an_absent_line_is_judged_as_the_stated_figure_is(self, tmp_path: Path) -> None:
        """2 km of orbit against 5 m of location: without the line `position:` as with it."""
        needs = {"location_error": "5 m"}
        for error in ({}, {"position": "2 km"}):
            found = orbiting(tmp_path, (2e3, 2e3, 2e3), requirements=needs, **error)
            assert found.status == "fail"
            assert found.requirements[-1].key == "location_error"
            assert found.requirements[-1].status == "fail"
        assert orbiting(tmp_path, (2e3, 2e3, 2e3), requirements=needs, position="1 m").status == "not_evaluated"

    def test_with_neither_declared_position_and_velocity_stay_correlated(self, tmp_path: Path) -> None:
        found = orbiting(tmp_path, (3.0, 20.0, 5.0), 0.1, frame="scene", velocity=None)
        error = found.analysed().mission.platforms.transmitter.motion_error
        assert error.covariance is not None
        (stated,) = found.analysed().mission.platforms.transmitter.path.stated
        sigmas, correlation = error.covariance.sigmas, error.covariance.correlation
        for i in range(6):
            for j in range(6):
                assert sigmas[i] * sigmas[j] * correlation[i][j] == pytest.approx(
                    stated.covariance[i][j], abs=1e-6 * sigmas[i] * sigmas[j] + 1e-12
                )

    @pytest.mark.parametrize(("velocity", "is_judged"), [(0.012, True), (20.0, False)])
    def test_a_velocity_counts_where_it_matters(self, velocity: float, is_judged: bool, tmp_path: Path) -> None:
        """The places are flown: an ephemeris may know its velocities badly, as long as that moves nothing."""
        found = orbiting(tmp_path, velocity_mps=velocity, position="1 m")
        of_velocity = {row(found, f"transmitter.velocity.{axis}").status for axis in RIC}
        assert (of_velocity == {"not_evaluated"}) != is_judged
        assert (found.status == "not_evaluated") != is_judged


class TestACovarianceOfMeanElements:
    """An OMM states it at the epoch of its elements; 4 km are more than what is usual of elements 16 hours old."""

    @pytest.mark.parametrize("form", ["text", "xml", "json", "csv"])
    @pytest.mark.parametrize(("declared", "is_enough"), [("4 km", False), ("50 km", True)])
    def test_50_km_are_no_4_km(self, form: str, declared: str, is_enough: bool, tmp_path: Path) -> None:
        mission = self.orbiting(tmp_path, form, position=declared)
        doubts = input_doubts(mission)
        assert [(one.is_stated, one.note.split(":")[0]) for one in doubts] == (
            [] if is_enough else [(True, "a.omm, covariance of 2026-05-31T10")]
        )

    def test_where_nothing_is_declared_it_is_the_error(self, tmp_path: Path) -> None:
        error = self.orbiting(tmp_path, "json").platforms.transmitter.motion_error
        assert error.position == pytest.approx((5e4, 5e4, 5e4))

    def test_it_turns_with_the_orbit(self, tmp_path: Path) -> None:
        """50 km along the track and 1 km across it: enough where they are declared so, not the other way round."""
        for position, is_enough in ((["1 km", "50 km", "1 km"], True), (["50 km", "1 km", "50 km"], False)):
            mission = self.orbiting(tmp_path, "json", (1e3, 5e4, 1e3), position=position)
            assert (input_doubts(mission) == []) == is_enough

    def test_without_an_element_of_its_matrix_it_is_refused(self, tmp_path: Path) -> None:
        with pytest.raises(MissionError, match="a covariance must be a lower triangle of 6 rows"):
            self.orbiting(tmp_path, "json", position="50 km", CY_X=None)

    @staticmethod
    def orbiting(
        folder: Path,
        form: str,
        position_m: tuple[float, float, float] = (5e4, 5e4, 5e4),
        position: Any = None,
        **changed: Any,
    ) -> Mission:
        (folder / "a.omm").write_bytes(omm_with_covariance(form, triangle(position_m, 1.0), **changed))
        error = {"frame": "ric", "velocity": "100 m/s"} | ({} if position is None else {"position": position})
        text = satellite(
            platforms__transmitter={"orbit": {"omm": "a.omm"}, "motion_error": error},
            requirements={"location_error": "5000 km"},
        )
        (folder / "m.yaml").write_text(text)
        return load_mission(str(folder / "m.yaml"))


class TestALog:
    @pytest.mark.parametrize(("position", "status"), [("1 cm", "not_evaluated"), ("10 m", "pass")])
    def test_sigmas_of_metres(self, position: str, status: str, tmp_path: Path) -> None:
        found = self.logged(tmp_path, "a.pos", solution(flight(), sigmas=(2.4, 3.1, 6.2)), position)
        assert (statuses(found, "receiver") == {"not_evaluated"}) == (status == "not_evaluated")
        if status != "pass":
            reason = row(found, "receiver.position.x").reason
            assert "2.4 m, 3.1 m, 6.2 m (east, north, up) is stated, but 10 mm is declared" in str(reason)

    @pytest.mark.parametrize(("position", "status"), [("1 cm", "not_evaluated"), ("31 m", "pass")])
    def test_eph_of_px4(self, position: str, status: str, tmp_path: Path) -> None:
        records = [{**one, "eph": 30.0} for one in gps_records(flight())]
        found = self.logged(tmp_path, "a.ulg", ulog(topic("sensor_gps", GPS_OF_OLD, 1, records)), position)
        assert (statuses(found, "receiver") == {"not_evaluated"}) == (status == "not_evaluated")

    @pytest.mark.parametrize(("position", "status"), [("1 cm", "not_evaluated"), ("10 m", "pass")])
    def test_sigmas_of_a_csv(self, position: str, status: str, tmp_path: Path) -> None:
        lines = geodetic_csv(flight()).decode().splitlines()
        lines = [f"{lines[0]},sde(m),sdn(m),sdu(m)", *(f"{line},2.4,3.1,6.2" for line in lines[1:])]
        found = self.logged(tmp_path, "a.csv", "\n".join(lines).encode(), position)
        assert (statuses(found, "receiver") == {"not_evaluated"}) == (status == "not_evaluated")

    @pytest.mark.parametrize("cells", ["3,3,", "3,0,3", "n/a,3,3", ",,3"])
    def test_sigmas_of_some_axes_count_for_the_others(self, cells: str, tmp_path: Path) -> None:
        """3 m are stated of two axes, and of the third nothing: 2 cm are not judged, 3 m are."""
        lines = geodetic_csv(flight()).decode().splitlines()
        lines = [f"{lines[0]},sde(m),sdn(m),sdu(m)", *(f"{line},{cells}" for line in lines[1:])]
        log = "\n".join(lines).encode()
        assert statuses(self.logged(tmp_path, "a.csv", log, "2 cm"), "receiver") == {"not_evaluated"}
        assert statuses(self.logged(tmp_path, "a.csv", log, "3.1 m"), "receiver") != {"not_evaluated"}
        filled = self.logged(tmp_path, "a.csv", log, None).analysed().mission.platforms.receiver.motion_error
        assert filled.position == pytest.approx((3.0, 3.0, 3.0))

    @pytest.mark.parametrize(("position", "is_judged"), [("2 cm", False), ("4 m", True)])
    def test_a_solution_without_a_sigma_of_the_height(self, position: str, is_judged: bool, tmp_path: Path) -> None:
        found = self.logged(tmp_path, "a.pos", solution(flight(), sigmas=(3.0, 3.0, 0.0)), position)
        assert ("not_evaluated" in statuses(found, "receiver")) != is_judged

    def test_what_is_usual_of_a_fix_counts_beside_half_a_gst(self, tmp_path: Path) -> None:
        """An autonomous fix whose GST states 1 cm along one axis alone."""
        pytest.importorskip("pynmea2")
        lines = self.fixes(1).decode().splitlines()
        half = [line for line in lines for line in (line, *self.half_of_gst(line))]
        found = self.logged(tmp_path, "a.nmea", "\r\n".join(half).encode(), "2 cm")
        assert statuses(found, "receiver") == {"not_evaluated"}
        assert "GGA quality 1," in str(row(found, "receiver.position.x").reason)

    @staticmethod
    def half_of_gst(line: str) -> list[str]:
        cells = line.split(",")
        return [sentence(f"GNGST,{cells[1]},,,,,0.01,,")] if cells[0].endswith("GGA") else []

    def test_a_covariance_in_place_of_position_and_velocity(self, tmp_path: Path) -> None:
        (tmp_path / "a.pos").write_bytes(solution(flight(), sigmas=SIGMAS))
        for position, is_enough in (("2 cm", True), ("1.9 cm", False)):
            error = {"covariance": {"position": position, "velocity": "1 mm/s"}}
            receiver = {"trajectory": {"file": "a.pos"}, "motion_error": error}
            (tmp_path / "m.yaml").write_text(aircraft(platforms__receiver=receiver))
            assert (input_doubts(load_mission(str(tmp_path / "m.yaml"))) == []) == is_enough

    @pytest.mark.parametrize(
        ("quality", "position", "status"),
        [
            (1, "1 cm", "not_evaluated"),
            (1, "99 cm", "not_evaluated"),
            (1, "1.01 m", "pass"),
            (2, "30 cm", "not_evaluated"),
            (2, "34 cm", "pass"),
            (5, "9 cm", "not_evaluated"),
            (5, "11 cm", "pass"),
            (4, "3 mm", "not_evaluated"),
            (4, "2 cm", "pass"),
        ],
    )
    def test_a_third_of_what_is_usual_of_a_quality(
        self, quality: int, position: str, status: str, tmp_path: Path
    ) -> None:
        pytest.importorskip("pynmea2")
        found = self.logged(tmp_path, "a.nmea", self.fixes(quality), position)
        assert statuses(found, "receiver") == {status}
        if status != "pass":
            assert f"GGA quality {quality}," in str(row(found, "receiver.position.x").reason)

    @pytest.mark.parametrize(("limit", "is_judged"), [("5 m", False), ("5 km", True)])
    def test_a_usual_error_is_no_declared_one(self, limit: str, is_judged: bool, tmp_path: Path) -> None:
        """Nobody declares a position: 3 m count against 5 m, and are negligible against 5 km."""
        pytest.importorskip("pynmea2")
        found = self.logged(tmp_path, "a.nmea", self.fixes(1), None, requirements={"location_error": limit})
        assert statuses(found, "receiver") == {"not_declared" if is_judged else "not_evaluated"}

    @staticmethod
    def fixes(quality: int) -> bytes:
        """Sentences without a GST whose fixes have one quality."""

        def fix(*place: Any, **more: Any) -> str:
            text = gga(*place, **more)
            cells = text[1:].partition("*")[0].split(",")
            return sentence(",".join([*cells[:6], str(quality), *cells[7:]]))

        lines = nmea(flight(), fix).decode().splitlines()
        return "\r\n".join([line for line in lines if "GST" not in line]).encode()

    @staticmethod
    def logged(
        folder: Path, name: str, log: bytes, position: str | None, requirements: dict[str, Any] | None = None
    ) -> MissionFindings:
        (folder / name).write_bytes(log)
        error = {"velocity": "1 mm/s"} | ({} if position is None else {"position": position})
        receiver = {"trajectory": {"file": name}, "motion_error": error}
        changes: dict[str, Any] = {} if requirements is None else {"requirements": requirements}
        (folder / "m.yaml").write_text(aircraft(platforms__receiver=receiver, **changes))
        return check_mission(load_mission(str(folder / "m.yaml")), TODAY)


class TestAPlannedOrbit:
    @pytest.mark.parametrize("days", [3.0, 30.0, 3650.0])
    def test_its_age_does_not_count_and_every_report_says_so(
        self, days: float, tmp_path: Path, run: Callable[..., Any]
    ) -> None:
        """Elements of ten years before too, which are refused without the key."""
        mission = self.mission(tmp_path, days, planned=True)
        path = mission.platforms.transmitter.path
        assert path.doubts == ()
        assert path.doubt_m < 1e-3
        assert input_doubts(mission) == []
        found = check_mission(mission, TODAY)
        assert statuses(found, "transmitter") == {"not_declared"}
        (said,) = found.overrides
        assert said == ("platforms.transmitter.orbit.planned", "true", PLAN)
        assert not any("planned" in one.message for one in found.warnings)
        for form in ("text", "json", "markdown", "html"):
            text = run("check", tmp_path / "m.yaml", "--format", form, "-v").stdout
            assert "its age and its interpolation do not count" in " ".join(text.split())

    @pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
    def test_every_command_says_so_in_every_format(
        self, command: tuple[str, ...], tmp_path: Path, run: Callable[..., Any]
    ) -> None:
        name, *options = command
        self.mission(tmp_path, 0.5, planned=True)
        said = run(name, tmp_path / "m.yaml", *options).stdout.replace("\n ", "").replace("\\", "")
        assert PLAN.replace(" ", "") in "".join(said.split()), said

    def test_an_orbit_that_is_no_plan_is_not_called_so(self, tmp_path: Path, run: Callable[..., Any]) -> None:
        self.mission(tmp_path, 0.5, planned=False)
        assert PLAN not in run("check", tmp_path / "m.yaml", "--format", "json").stdout

    def test_without_the_key_it_counts(self, tmp_path: Path) -> None:
        """3 days of age, 7 km, against 5 m of location: with the line `planned: false` as without it."""
        for planned in (None, False):
            mission = self.mission(tmp_path, 3.0, planned=planned)
            assert statuses(check_mission(mission, TODAY), "transmitter") == {"not_evaluated"}
        with pytest.raises(MissionError, match="more than a tenth of the slant range"):
            self.mission(tmp_path, 3650.0, planned=None)

    def test_what_it_states_of_itself_counts_all_the_same(self, tmp_path: Path) -> None:
        orbiting(tmp_path, (10.0, 10.0, 10.0), position="1 m")
        text = (tmp_path / "m.yaml").read_text()
        text = re.sub(r"^( +)oem: a.oem$", r"\1oem: a.oem\n\1planned: true", text, flags=re.MULTILINE)
        assert "planned: true" in text
        (tmp_path / "m.yaml").write_text(text)
        (doubt,) = input_doubts(load_mission(str(tmp_path / "m.yaml")))
        assert doubt.is_stated

    def test_how_the_earth_is_turned_is_no_part_of_the_plan(self, tmp_path: Path) -> None:
        text = oem(frame="GCRF", times=START.after)
        (tmp_path / "a.oem").write_text(text)
        transmitter = {"orbit": {"oem": "a.oem", "planned": True}}
        (tmp_path / "m.yaml").write_text(ephemeris(CENTER, text, platforms__transmitter=transmitter))
        path = load_mission(str(tmp_path / "m.yaml")).platforms.transmitter.path
        assert 10 < path.doubt_m < 80
        assert "UT1 = UTC" in path.doubts[0]

    @staticmethod
    def mission(folder: Path, days: float, *, planned: bool | None) -> Mission:
        (folder / "a.tle").write_text(TLE)
        orbit = {"tle": "a.tle"} | ({} if planned is None else {"planned": planned})
        text = satellite(
            EPOCH.after(86400 * days),
            platforms__transmitter={"orbit": orbit, "motion_error": {"velocity": "1 mm/s"}},
            requirements={"location_error": "5 m"},
        )
        (folder / "m.yaml").write_text(text)
        return load_mission(str(folder / "m.yaml"))


def test_a_sweep_says_the_same(tmp_path: Path) -> None:
    """On both sides of what is stated, of position and of velocity."""
    mission = orbiting(tmp_path, (3.0, 5.0, 1.0), 0.3, position=["1 m", "1 m", "1 m"]).analysed().mission
    axes = {
        "platforms__transmitter__motion_error__position__1": [1.0, 5.0, 50.0],
        "platforms__transmitter__motion_error__position__0": [1.0, 4.0],
        "radar__center_frequency": [5e9, 10e9],
    }
    columns = [f"transmitter.position.{axis}.status" for axis in RIC]
    cases = grid(mission, **axes)
    assert_as_checked(mission, cases, swept(mission, cases, columns), columns)
    assert_as_checked(mission, cases, swept(mission, cases))
