"""Passes of a mission's orbit: what is said of each is what a check of the mission at that time says."""

import math
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import bisar_budget as bb
from bisar_budget.budget.check import check_mission
from bisar_budget.faults import MissionError, SetValue
from bisar_budget.findings.satellite_passes import Passes, SatellitePass, bearing
from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.mission.model import Mission
from bisar_budget.mission.quantities import QuestionError
from bisar_budget.paths import earth
from bisar_budget.paths.instant import Instant
from bisar_budget.questions.passes import start_of
from tests.conftest import ROOT, TODAY, mission_text
from tests.paths.orbit_files import CENTER, LINE_1, LINE_2, TLE, checked, omm_json
from tests.paths.test_visibility import GEOSTATIONARY, ephemeris, of_elements

BESANCON = ROOT / "specs" / "missions" / "sentinel1_elements_besancon.yaml"
SITE = {"latitude": "47.2512 deg", "longitude": "5.9938 deg", "height": "360 m"}
ROOF = {"latitude": "47.246 deg", "longitude": "5.987 deg", "altitude": "430 m", "speed": "0 m/s"}
# A minute behind on the same orbit: 360° in 98.7 min.
BEHIND = checked(LINE_2[:43] + f"{275.4315 - 360 / 98.7:8.4f}" + LINE_2[51:])


def besancon(**changes: str) -> Mission:
    values = [SetValue(key.replace("__", "."), value) for key, value in changes.items()]
    return load_mission(str(BESANCON), changes=values, is_placed=False)


def tree(transmitter: Any, receiver: Any, **changes: Any) -> str:
    """A mission over Besançon, without a time."""
    base = {
        "scene": SITE,
        "platforms__transmitter": transmitter,
        "platforms__receiver": receiver,
        "collection__aperture_time": "0.5 s",
        "platforms__transmitter__motion_error": {"position": "3 km"},
        "allocation__model": "full",
    }
    return mission_text(**{**base, **changes})


@cache
def found(text: str, days: float = 1, **asked: Any) -> Passes:
    mission = parse_mission(text, "m.yaml", is_placed=False)
    return bb.passes(mission, CENTER.as_text(), days=days, date=TODAY, **asked).found


def lines(*of: str) -> dict[str, Any]:
    return {"orbit": {"tle": list(of)}}


@pytest.fixture(scope="module")
def three_days() -> Passes:
    return bb.passes(besancon(), "2021-03-19", days=3, date=TODAY).found


def at(one: SatellitePass) -> Mission:
    """The mission at the mid-time of a pass, read as a file."""
    assert one.center is not None
    return load_mission(str(BESANCON), changes=[SetValue("collection.center_time", one.center.as_text())])


class TestAgainstCheck:
    def test_each_pass_is_what_a_check_says_of_its_time(self, three_days: Passes) -> None:
        checked_passes = [one for one in three_days.found if one.status != "error"]
        assert len(checked_passes) == 9
        for one in checked_passes:
            result = check_mission(at(one), TODAY)
            state = result.geometry.transmitter
            assert one.state is not None
            assert one.status == result.status
            assert (one.state.position, one.state.velocity) == (state.position, state.velocity)
            assert (one.bistatic_angle, one.gradient_angle) == (
                result.geometry.bistatic_angle,
                result.geometry.gradient_angle,
            )
            widths = one.range_resolution, one.cross_range_resolution
            assert widths == pytest.approx(result.resolution[:2], rel=1e-14)  # arrays of cases take NumPy's functions
            assert one.doubt == at(one).platforms.transmitter.path.doubt_m  # type: ignore[union-attr]
            (judged,) = [each for each in result.requirements if each.key == one.requirement]
            # Checked together with others, digits beyond those that a search settles to may differ.
            assert one.row == judged.row
            if one.status == "not_evaluated":  # a small row's would read as a margin
                assert one.utilization is judged.utilization is None
                continue
            assert one.utilization == pytest.approx(judged.utilization, rel=1e-6)
            assert one.utilization == pytest.approx(max(each.utilization or 0 for each in result.requirements))

    def test_statuses_differ_and_those_that_break_nothing_comply(self, three_days: Passes) -> None:
        assert [one.number for one in three_days.found] == list(range(1, 11))
        assert {one.status for one in three_days.found} == {"pass", "warn", "not_evaluated", "error"}
        assert [one.number for one in three_days.complying] == [3, 4, 6]

    def test_a_pass_that_a_check_refuses_is_listed_with_its_reason(self, three_days: Passes) -> None:
        (refused,) = [one for one in three_days.found if one.status == "error"]
        with pytest.raises(MissionError) as error:
            at(refused)
        assert error.value.faults[0].problem in refused.reason
        assert "no image plane" in refused.reason
        assert refused.state is not None
        assert refused.utilization is None

    def test_elements_of_another_season_are_refused_in_each_pass(self) -> None:
        """Their doubt, 1 km and 2 km a day, is more than a tenth of the slant range: a check says error."""
        later = bb.passes(besancon(), "2021-09-19", days=1, date=TODAY).found
        assert len(later.found) >= 2
        assert {one.status for one in later.found} == {"error"}
        assert all("more than a tenth of the slant range" in one.reason for one in later.found)
        assert all(one.doubt == pytest.approx(1e3 + 2e3 * 183, rel=0.01) for one in later.found)

    @pytest.mark.parametrize("degrees", [0.0, 30.0, -20.0])
    def test_the_mid_time_has_the_squint_that_was_asked_for(self, degrees: float) -> None:
        result = bb.passes(besancon(), "2021-03-19", days=2, squint=math.radians(degrees), date=TODAY).found
        having = [one for one in result.found if one.center is not None]
        assert len(having) >= 5
        for one in having:
            assert one.state is not None
            assert one.state.squint == pytest.approx(math.radians(degrees), abs=1e-5)  # center_time to 1 ms
        for one in result.found:
            if one.center is None:
                assert one.status == "not_evaluated"
                assert f"never {degrees:g} deg" in one.reason
                assert not one.complies

    def test_the_model_and_values_of_options_are_those_of_the_check(self, three_days: Passes) -> None:
        mission = besancon(requirements__location_error="1 m")
        strict = bb.passes(mission, "2021-03-19", days=2, date=TODAY).found
        for loose, tight in zip(three_days.found, strict.found, strict=False):
            if loose.utilization is not None and loose.status != "not_evaluated":
                assert tight.utilization == pytest.approx(5 * loose.utilization, rel=0.05)  # all but linear
        assert not strict.complying
        assert strict.changes == mission.changes
        text = tree(lines(LINE_1, LINE_2), ROOF, allocation__model="published")
        assert found(text).model == "published"
        assert found(text, model="full").model == "full"


class TestWhereItStands:
    def test_side_and_direction_are_those_of_the_ground_track(self, three_days: Passes) -> None:
        """By the bearings of the next place below the satellite and of the scene, on a sphere."""
        orbit = of_elements(BESANCON.parent.joinpath("paths", "sentinel1a_2021079.tle").read_text())

        def below(instant: Instant) -> earth.Geodetic:
            return earth.geodetic(orbit(instant).place(instant))

        def turn(a: earth.Geodetic, latitude: float, longitude: float) -> float:
            apart = longitude - a.longitude
            return math.atan2(
                math.sin(apart) * math.cos(latitude),
                math.cos(a.latitude) * math.sin(latitude)
                - math.sin(a.latitude) * math.cos(latitude) * math.cos(apart),
            )

        for one in three_days.found:
            assert one.center is not None
            here, next_place = below(one.center), below(one.center.after(1.0))
            ahead = turn(here, next_place.latitude, next_place.longitude)
            scene = turn(here, math.radians(47.2512), math.radians(5.9938))
            assert one.side == ("right" if math.sin(scene - ahead) > 0 else "left")
            assert one.is_ascending == (next_place.latitude > here.latitude)
        # Sentinel-1 looks to the right. The mission file has its ascending pass of 17:24.
        (known,) = [one for one in three_days.found if one.center and one.center.as_text()[:16] == "2021-03-20T17:24"]
        assert (known.side, known.is_ascending, known.status) == ("right", True, "pass")

    def test_a_bearing_is_counted_from_north_clockwise(self) -> None:
        for azimuth, expected in ((0, 90), (90, 0), (180, 270), (-90, 180), (135, 315)):
            assert math.degrees(bearing(math.radians(azimuth))) == pytest.approx(expected, abs=1e-9)

    def test_a_track_goes_from_the_rise_to_the_set(self, three_days: Passes) -> None:
        for one in three_days.found:
            elevations = one.track[:, 1]
            assert elevations[[0, -1]] == pytest.approx([math.radians(20)] * 2, abs=1e-6)
            assert math.radians(20) < elevations[1:-1].max() <= one.max_elevation + 1e-9


class TestTwoOrbits:
    TEXT = tree(lines(LINE_1, LINE_2), lines(LINE_1, BEHIND))

    def test_both_must_see_the_scene(self) -> None:
        both, ahead = found(self.TEXT), found(tree(lines(LINE_1, LINE_2), ROOF))
        behind = found(tree(lines(LINE_1, BEHIND), ROOF))
        assert both.platform == "transmitter"
        assert len(both.found) == len(ahead.found) == len(behind.found) > 2
        for one, first, second in zip(both.found, ahead.found, behind.found, strict=True):
            assert one.start == max(first.start, second.start) == second.start
            assert one.stop == min(first.stop, second.stop) == first.stop
            assert second.start.since(first.start) == pytest.approx(60, abs=10)

    def test_the_platform_that_is_asked_for_is_listed(self) -> None:
        of_receiver = found(self.TEXT, platform="receiver")
        assert of_receiver.platform == "receiver"
        for one, other in zip(of_receiver.found, found(self.TEXT).found, strict=True):
            assert one.start == other.start
            assert one.center is None or other.center is None or one.center.since(other.center) > 30

    def test_the_platform_with_an_orbit_is_listed(self) -> None:
        still = tree(ROOF, lines(LINE_1, LINE_2), platforms__transmitter__motion_error={"position": "1 m"})
        assert found(still).platform == "receiver"


class TestUnknown:
    def test_an_ephemeris_that_ends_within_the_span_is_said(self, tmp_path: Path) -> None:
        (tmp_path / "a.oem").write_bytes(ephemeris(CENTER, 43200.0))
        file = tmp_path / "m.yaml"
        file.write_text(tree({"orbit": {"oem": "a.oem"}}, ROOF))
        result = bb.passes(load_mission(str(file), is_placed=False), CENTER.as_text(), days=1, date=TODAY).found
        (gap,) = result.unknown
        assert gap.platform == "transmitter"
        assert gap.start.since(CENTER) == pytest.approx(43200, abs=0.01)
        assert gap.stop == CENTER.after(86400)
        whole = found(tree(lines(LINE_1, LINE_2), ROOF), days=0.5)
        assert [one.number for one in result.found] == [one.number for one in whole.found]
        for one, other in zip(result.found, whole.found, strict=True):
            assert one.center is not None
            assert other.center is not None
            assert one.center.since(other.center) == pytest.approx(0, abs=0.01)

    def test_a_satellite_that_does_not_set_has_one_pass_without_rise_and_set(self) -> None:
        east = {"latitude": "10 deg", "longitude": "0 deg", "height": "0 m"}
        below = earth.geodetic(of_elements(GEOSTATIONARY)(CENTER).place(CENTER))
        east["longitude"] = f"{below.longitude + 0.1} rad"
        roof = {**ROOF, "latitude": "10.01 deg", "longitude": east["longitude"]}
        (one,) = found(tree(lines(*GEOSTATIONARY.split("\n")[:2]), roof, scene=east), days=2).found
        assert (one.rises, one.sets) == (False, False)
        assert (one.start, one.stop) == (CENTER, CENTER.after(2 * 86400))


class TestQuestions:
    @pytest.mark.parametrize(
        ("text", "asked", "said"),
        [
            (mission_text(scene=SITE), {}, "platforms: neither has an orbit, so that nothing passes"),
            (
                tree(lines(LINE_1, LINE_2), {"position": ["1 km", 0, "1 km"], "velocity": [0, 0, 0]}, scene={}),
                {},
                "scene: passes are over a place on the Earth; accepted: latitude, longitude and height",
            ),
            (tree(lines(LINE_1, LINE_2), ROOF), {"platform": "receiver"}, "--platform receiver: has no orbit"),
            (tree(lines(LINE_1, LINE_2), ROOF), {"days": 400}, "--days 400: accepted: more than 0, up to 366"),
        ],
        ids=["no orbit", "no place", "platform without one", "days"],
    )
    def test_what_cannot_be_asked_says_why(self, text: str, asked: dict[str, Any], said: str) -> None:
        with pytest.raises(QuestionError, match=said):
            found(text, **asked)

    def test_a_message_of_mean_elements_has_the_passes_of_its_element_set(self, tmp_path: Path) -> None:
        (tmp_path / "a.json").write_bytes(omm_json())
        file = tmp_path / "m.yaml"
        file.write_text(tree({"orbit": {"omm": "a.json"}}, ROOF))
        result = bb.passes(load_mission(str(file), is_placed=False), CENTER.as_text(), days=1, date=TODAY).found
        ours, theirs = result.found, found(tree(lines(LINE_1, LINE_2), ROOF)).found
        assert len(ours) == len(theirs) > 2
        for one, other in zip(ours, theirs, strict=True):
            # Digits of the epoch: 0.4 ms, and those of the mean motion.
            assert one.start.since(other.start) == pytest.approx(0, abs=0.01)

    def test_an_orbit_without_a_place_at_any_time_is_the_fault_of_a_check(self, tmp_path: Path) -> None:
        (tmp_path / "a.oem").write_bytes(ephemeris(CENTER, 3600.0))
        file = tmp_path / "m.yaml"
        file.write_text(tree({"orbit": {"oem": "a.oem"}}, ROOF))
        with pytest.raises(MissionError) as error:
            bb.passes(load_mission(str(file), is_placed=False), CENTER.after(86400).as_text(), days=2, date=TODAY)
        (fault,) = error.value.faults
        assert fault.key == "platforms.transmitter.orbit.oem"
        assert "its useable time is" in fault.problem
        assert fault.line is not None

    @pytest.mark.parametrize("text", ["2026-07-01", "2026-07-01T00:00:00Z", " 2026-07-01 "])
    def test_a_day_begins_at_midnight(self, text: str) -> None:
        assert start_of(text).as_text() == "2026-07-01T00:00:00.000Z"

    @pytest.mark.parametrize(
        "text", ["tomorrow", "2026-02-30", "2026-07-01T05:00:00", "", "01.07.2026", "0001-01-01", "2200-01-01"]
    )
    def test_what_is_no_day_is_refused(self, text: str) -> None:
        with pytest.raises(
            QuestionError, match="is no day and no instant of UTC from 1957 to 2199; accepted: 2026-07-01"
        ):
            start_of(text)

    def test_elements_of_a_file_are_those_of_a_check(self, tmp_path: Path) -> None:
        """Of several element sets each pass has the nearest, as the check of its mission file has."""
        later = checked("1 39634U 14016A   26153.42515188  .00000355  00000+0  84975-4 0  9990")
        (tmp_path / "a.tle").write_text(f"{TLE}SENTINEL-1A\n{later}\n{LINE_2}\n")
        file = tmp_path / "m.yaml"
        file.write_text(tree({"orbit": {"tle": "a.tle"}}, ROOF))
        result = bb.passes(load_mission(str(file), is_placed=False), CENTER.as_text(), days=2, date=TODAY).found
        epochs = set()
        for one in result.found:
            assert one.center is not None
            mission = load_mission(str(file), changes=[SetValue("collection.center_time", one.center.as_text())])
            path = mission.platforms.transmitter.path
            assert path is not None
            assert one.doubt == path.doubt_m
            epochs.add(path.source)
        assert len(epochs) == 2
