"""`bisar-budget passes`: exit codes, formats, mission files of passes, and what is refused."""

import csv
import io
import json
import math
import os
import re
import shutil
from datetime import UTC, datetime
from pathlib import Path

import pytest
import yaml

import bisar_budget as bb
from bisar_budget.mission.load import load_mission
from bisar_budget.questions.passes import start_of
from bisar_budget.report import Style
from bisar_budget.report.answers import passes_answer as pass_list
from bisar_budget.report.answers import written
from bisar_budget.report.answers.passes_answer import _folded as folded
from tests.conftest import ROOT, TODAY
from tests.drawing import Drawing
from tests.fuzz import RAW, RUN
from tests.paths.orbit_files import LINE_1, LINE_2, TLE
from tests.paths.test_visibility import ephemeris
from tests.questions.test_passes import ROOF, tree

BESANCON = ROOT / "specs" / "missions" / "sentinel1_elements_besancon.yaml"
SPAN = ("--from", "2021-03-20", "--days", "1")
NAMES = ROOT / "specs" / "missions" / "paths" / "sentinel1a_2021079.tle"
# A comma and a semicolon separate in a calendar, `=` begins a formula, `::` a command of a CI runner.
HOSTILE = "=HYPERLINK(1),;\\n::error::x ##[group]y <b>&amp; ä " + "é" * 60


@pytest.fixture
def mission(tmp_path: Path) -> Path:
    """A copy of the mission over Besançon in a folder of its own, with its elements."""
    folder = tmp_path / "missions"
    shutil.copytree(NAMES.parent, folder / "paths", ignore=shutil.ignore_patterns("*.csv"))
    shutil.copy(BESANCON, folder / "m.yaml")
    return folder / "m.yaml"


def document(run, *arguments) -> dict:
    return json.loads(run("passes", *arguments, "--format", "json").stdout)


class TestList:
    def test_json_is_the_contract(self, run) -> None:
        found = document(run, BESANCON, *SPAN)
        assert found["format"] == "bisar-budget/passes/1"
        assert (found["platform"], found["from"], found["until"]) == (
            "transmitter",
            "2021-03-20T00:00:00.000Z",
            "2021-03-21T00:00:00.000Z",
        )
        assert len(found["passes"]) == 3
        for one in found["passes"]:
            assert {"center_time", "elevation_rad", "status"} <= one.keys()
            assert one["start_time"] == one["rise_time"] < one["center_time"] < one["set_time"] == one["stop_time"]
        assert [one["status"] for one in found["passes"]] == ["warn", "error", "pass"]

    def test_a_check_at_the_time_says_the_same(self, run) -> None:
        for one in document(run, BESANCON, *SPAN, "--squint", "10 deg")["passes"]:
            if one["status"] == "error" or one["center_time"] is None:
                continue
            at = ("--set", f"collection.center_time={one['center_time']}")
            (checked,) = json.loads(run("check", BESANCON, *at, "--format", "json").stdout)["missions"]
            seen = checked["geometry"]["transmitter"]
            assert one["status"] == checked["status"]
            for key in ("squint_rad", "elevation_rad", "azimuth_rad", "slant_range_m"):
                assert one[key] == seen[key]
            for key in ("bistatic_angle_rad", "gradient_angle_rad"):
                assert one[key] == checked["geometry"][key]
            for key in ("range_resolution_m", "cross_range_resolution_m"):  # arrays of cases take NumPy's functions
                assert one[key] == pytest.approx(checked["geometry"][key], rel=1e-14)
            assert one["doubt_m"] == seen["path"]["doubt_m"]

    def test_text_says_first_how_many_comply_and_fits_a_hundred_columns(self, run) -> None:
        found = run("passes", BESANCON, "--from", "2021-03-19", "--days", "5")
        lines = found.stdout.splitlines()
        assert lines[0].startswith("3 of 16 passes comply: transmitter above 20 deg and at broadside,")
        assert all(len(line) <= 100 for line in lines)
        assert sum(bool(re.match(r"\S.{7} +\d+ 2021-03-", line)) for line in lines) == 16
        assert any(line.startswith("ERROR 5: platforms: range and Doppler gradients") for line in lines)
        assert any(line.startswith("NOT EVAL 1, 2, 7 to 10, ") for line in lines)

    def test_csv_has_a_line_for_each(self, run) -> None:
        lines = list(csv.DictReader(io.StringIO(run("passes", BESANCON, *SPAN, "--format", "csv").stdout)))
        for line, one in zip(lines, document(run, BESANCON, *SPAN)["passes"], strict=True):
            assert line["center_time"] == one["center_time"]
            assert (float(line["utilization"]) if line["utilization"] else None) == one["utilization"]

    @pytest.mark.parametrize(("days", "code"), [("0.9", 0), ("0.4", 1), ("0.1", 1)])
    def test_the_exit_code_is_1_where_no_pass_complies(self, run, days: str, code: int) -> None:
        found = run("passes", BESANCON, "--from", "2021-03-19", "--days", days)
        assert found.exit_code == code
        assert ("none of 2 passes comply" in found.stdout) == (days == "0.4")
        assert ("no pass:" in found.stdout) == (days == "0.1")
        assert run("passes", BESANCON, "--from", "2021-03-19", "--days", days, "--format", "json").exit_code == code

    def test_the_file_needs_no_time_and_may_have_one_at_which_nothing_is_seen(self, run, mission) -> None:
        text = mission.read_text()
        expected = document(run, mission, *SPAN)["passes"]
        for time in ("", "  center_time: 2021-03-20T12:00:00Z\n"):
            mission.write_text(text.replace("  center_time: 2021-03-20T17:24:02Z\n", time))
            assert run("check", mission).exit_code == 2
            assert document(run, mission, *SPAN)["passes"] == expected

    def test_the_day_is_that_of_the_option_or_of_the_environment(self, run, monkeypatch) -> None:
        asked = ("passes", BESANCON, "--days", "0.5", "--format", "json")
        assert json.loads(run(*asked, "--date", "2021-03-20").stdout)["from"] == "2021-03-20T00:00:00.000Z"
        monkeypatch.setenv("SOURCE_DATE_EPOCH", str(int(datetime(2021, 3, 21, 9, tzinfo=UTC).timestamp())))
        assert json.loads(run(*asked).stdout)["from"] == "2021-03-21T00:00:00.000Z"

    def test_values_and_models_of_options_are_said(self, run) -> None:
        found = document(run, BESANCON, *SPAN, "--set", "requirements.location_error=1 km", "--model", "strictest")
        assert found["set"] == [{"key": "requirements.location_error", "text": "1 km"}]
        assert {one["name"] for one in found["overrides"]} == {"--model", "--set"}
        text = run("passes", BESANCON, *SPAN, "--set", "requirements.location_error=1 km").stdout
        assert "--set 'requirements.location_error=1 km'" in " ".join(text.split())


def test_a_use_without_a_number_is_null_and_one_pass_is_said_as_one(tmp_path: Path) -> None:
    """Where an error moves the image out of sight its use is infinite."""
    mission = load_mission(str(BESANCON), is_placed=False)
    found = bb.passes(mission, "2021-03-20", days=0.4, date=TODAY).found
    (one,) = found.found
    assert pass_list.verdict(found).startswith("one pass, which complies: transmitter above 20 deg and at broadside,")
    lost = found._replace(found=(one._replace(utilization=math.inf, status="fail", requirement=None, row=None),))
    assert json.loads(written("passes", "json", [lost], Style()))["passes"][0]["utilization"] is None
    text = str(written("passes", "text", [lost], Style()))
    assert text.startswith("one pass, which does not comply:")
    assert ">1e5 %" in text
    assert "decides" not in text.partition("above:")[0]


class Calendar:
    """A calendar as RFC 5545 has it: content lines unfolded, properties of each event."""

    def __init__(self, data: bytes) -> None:
        assert data.endswith(b"\r\n")
        raw = data[:-2].split(b"\r\n")
        assert not any(b"\n" in line or b"\r" in line for line in raw)
        assert all(len(line) <= 75 for line in raw)
        for line in raw:
            line.decode()  # no character is cut
        lines = re.sub("\r\n[ \t]", "", data[:-2].decode()).split("\r\n")
        assert (lines[0], lines[1], lines[-1]) == ("BEGIN:VCALENDAR", "VERSION:2.0", "END:VCALENDAR")
        assert lines[2].startswith("PRODID:")
        self.events: list[dict[str, str]] = []
        for line in lines[3:-1]:
            name, _, value = line.partition(":")
            assert re.fullmatch("[A-Z-]+", name)
            if line == "BEGIN:VEVENT":
                self.events.append({})
            elif line != "END:VEVENT":
                assert name not in self.events[-1]
                self.events[-1][name] = value

    @staticmethod
    def text(value: str) -> str:
        """A text with what is escaped; nothing that separates stands alone."""
        assert re.fullmatch(r"(?:[^\\;,]|\\[\\;,nN])*", value)
        return re.sub(r"\\(.)", lambda match: "\n" if match[1] in "nN" else match[1], value)


class TestCalendar:
    def test_there_is_an_event_from_rise_to_set_for_each_pass(self, run, tmp_path) -> None:
        file = tmp_path / "passes.ics"
        run("passes", BESANCON, *SPAN, "--date", "2026-11-21", "-o", file)
        events = Calendar(file.read_bytes()).events
        items = document(run, BESANCON, *SPAN)["passes"]
        for event, one in zip(events, items, strict=True):
            assert event["DTSTAMP"] == "20261121T000000Z"
            for key, time, sign in (("DTSTART", one["rise_time"], 1), ("DTEND", one["set_time"], -1)):
                stamp = datetime.strptime(event[key], "%Y%m%dT%H%M%SZ").replace(tzinfo=UTC)
                assert 0 <= sign * (datetime.fromisoformat(time) - stamp).total_seconds() <= 1
            assert f"pass {one['number']} of Sentinel-1A" in Calendar.text(event["SUMMARY"])
            assert one["center_time"] in Calendar.text(event["DESCRIPTION"])
        assert len({event["UID"] for event in events}) == len(events)

    def test_it_is_the_same_each_time_and_the_same_on_standard_output(self, run, tmp_path) -> None:
        file = tmp_path / "passes.ics"
        asked = ("passes", BESANCON, *SPAN, "--date", "2026-11-21")
        run(*asked, "-o", file)
        assert run(*asked, "--format", "ics").stdout_bytes == file.read_bytes()

    def test_newer_elements_keep_the_ids_of_events(self, run, tmp_path) -> None:
        """An epoch a second later, which moves each pass by a second."""
        ids = []
        for line in (LINE_1, LINE_1[:28] + "23" + LINE_1[30:68]):
            file = tmp_path / "m.yaml"
            whole = line[:68] + str(sum(int(c) if c.isdigit() else c == "-" for c in line[:68]) % 10)
            file.write_text(tree({"orbit": {"tle": [whole, LINE_2]}}, ROOF))
            done = run("passes", file, "--from", "2026-06-01", "--days", "1", "--format", "ics")
            ids.append([event["UID"] for event in Calendar(done.stdout_bytes).events])
        assert ids[0] == ids[1]

    def test_a_library_reads_it(self, run) -> None:
        icalendar = pytest.importorskip("icalendar")
        data = run("passes", BESANCON, *SPAN, "--format", "ics").stdout_bytes
        read = icalendar.Calendar.from_ical(data)
        assert len([one for one in read.walk("VEVENT") if one.get("dtstart")]) == 3

    def test_lines_are_folded_at_75_octets_and_no_character_is_cut(self) -> None:
        text = "SUMMARY:" + "aé☃𝄞" * 60
        lines = list(folded(text))
        assert len(lines) > 5
        assert all(len(line.encode()) <= 75 for line in lines)
        assert lines[0] + "".join(line[1:] for line in lines[1:]) == text
        assert all(line[0] == " " and line[1] != ":" for line in lines[1:])


class TestHostile:
    @pytest.mark.parametrize("format_name", ["text", "json", "csv", "ics"])
    def test_names_do_nothing_to_who_reads(self, run, tmp_path, format_name: str) -> None:
        file = tmp_path / "m;,.yaml"
        file.write_text(tree({"orbit": {"tle": [LINE_1, LINE_2]}}, ROOF, name=HOSTILE))
        done = run("passes", file, "--from", "2026-06-01", "--days", "1", "--format", format_name)
        assert done.exit_code in (0, 1)
        for text in (done.stdout, done.stderr):
            assert not RAW.search(text.replace("\r\n", "\n"))
            assert not RUN.search(text)
        if format_name == "ics":
            summaries = [Calendar.text(event["SUMMARY"]) for event in Calendar(done.stdout_bytes).events]
            assert all("=HYPERLINK(1),;\\n" in one and "é" * 60 in one for one in summaries)
        if format_name == "csv":
            assert all(line["name"][:2] == "'=" for line in csv.DictReader(io.StringIO(done.stdout)))
        if format_name == "json":
            assert json.loads(done.stdout)["name"] == HOSTILE

    def test_a_drawing_has_the_name_as_text(self, run, tmp_path) -> None:
        file, plot = tmp_path / "m.yaml", tmp_path / "p.svg"
        file.write_text(tree({"orbit": {"tle": [LINE_1, LINE_2]}}, ROOF, name=HOSTILE))
        run("passes", file, "--from", "2026-06-01", "--days", "1", "--plot", plot)
        assert any("<b>&amp;" in text for text in Drawing(plot.read_bytes()).texts)


class TestMissions:
    def test_each_pass_that_complies_has_a_file_that_is_checked_to_its_status(self, run, mission, tmp_path) -> None:
        folder = tmp_path / "out" / "passes"
        done = run("passes", mission, *SPAN, "-o", f"{folder}/")
        assert done.exit_code == 0
        assert done.stderr == f"2 mission files in {folder}/\n"
        assert done.stdout == run("passes", mission, *SPAN).stdout
        complying = [one for one in document(run, mission, *SPAN)["passes"] if one["status"] in ("pass", "warn")]
        names = sorted(os.listdir(folder))
        assert names == ["m_20210320T061610Z.yaml", "m_20210320T172401Z.yaml"]
        for name, one in zip(names, complying, strict=True):
            (checked,) = json.loads(run("check", folder / name, "--format", "json").stdout)["missions"]
            assert (checked["status"], checked["set"]) == (one["status"], [])
            assert checked["geometry"]["transmitter"]["squint_rad"] == one["squint_rad"]
            assert (folder / name).read_text().startswith("# Sentinel-1A by its two-line elements, a receiver on a")
            assert yaml.safe_load((folder / name).read_text())["platforms"]["transmitter"]["orbit"] == {
                "tle": "../../missions/paths/sentinel1a_2021079.tle"
            }

    def test_a_folder_needs_no_slash_and_a_time_no_place(self, run, tmp_path) -> None:
        file = tmp_path / "m.yaml"
        text = tree({"orbit": {"tle": [LINE_1, LINE_2]}, "motion_error": {"position": "5 mm"}}, ROOF)
        file.write_text(text.replace("position: 5 mm", "velocity: 1 mm/s"))
        done = run("passes", file, "--from", "2026-06-01", "--days", "1", "-o", tmp_path, "--format", "json")
        items = json.loads(done.stdout)["passes"]
        count = sum(one["status"] in ("pass", "warn") for one in items)
        assert done.exit_code == (0 if count else 1)
        assert len(list(tmp_path.glob("m_2026*.yaml"))) == count

    def test_options_are_written_too(self, run, mission, tmp_path) -> None:
        options = ("--set", "requirements.location_error=20 m", "--model", "strictest")
        run("passes", mission, *SPAN, *options, "-o", f"{tmp_path / 'o'}/")
        for file in (tmp_path / "o").iterdir():
            written = load_mission(str(file))
            assert (written.requirements.location_error, written.allocation.model) == (20.0, "strictest")

    def test_a_part_beside_the_mission_is_named_from_the_folder(self, run, mission, tmp_path) -> None:
        (mission.parent / "own.yaml").write_text("kind: imu\nname: x\nsource: y\ngyro_bias: 0.01 deg/h\n")
        mission.write_text(
            mission.read_text().replace(
                "      position: 2 cm\n", "      position: 2 cm\n      sensor: [own.yaml, um980-rtk]\n"
            )
        )
        done = run("passes", mission, *SPAN, "-o", f"{tmp_path / 'o'}/", "--set", "requirements.islr=-3 dB")
        written = [yaml.safe_load(file.read_text()) for file in (tmp_path / "o").iterdir()]
        assert len(written) >= 1, done.stderr
        for one in written:
            sensors = one["platforms"]["receiver"]["motion_error"]["sensor"]
            assert sensors == ["../missions/own.yaml", "um980-rtk"]

    def test_a_part_of_the_project_that_is_not_there_leaves_no_file(self, run, mission, tmp_path) -> None:
        """The catalogue of a project is that of the folder of its mission."""
        project = mission.parent
        (project / "pyproject.toml").write_text('[tool.bisar-budget]\nsensors = ["parts"]\n')
        (project / "parts").mkdir()
        (project / "parts" / "ours.yaml").write_text("kind: imu\nname: x\nsource: y\ngyro_bias: 0.01 deg/h\n")
        text = mission.read_text().replace("      position: 2 cm\n", "      position: 2 cm\n      sensor: ours\n")
        mission.write_text(text)
        folder = tmp_path / "o"
        done = run("passes", mission, *SPAN, "-o", f"{folder}/", "--set", "requirements.islr=-3 dB")
        assert done.exit_code == 2
        assert "is not written: platforms.receiver.motion_error.sensor: is no part of the catalogue" in done.stderr
        assert not done.stdout
        assert not folder.exists()

    def test_nothing_is_written_where_no_pass_complies(self, run, mission, tmp_path) -> None:
        done = run("passes", mission, "--from", "2021-03-19", "--days", "0.4", "-o", f"{tmp_path / 'o'}/")
        assert done.exit_code == 1
        assert "no mission file is written" in done.stderr
        assert not (tmp_path / "o").exists()

    def test_a_folder_that_cannot_be_made_is_said(self, run, mission, tmp_path) -> None:
        (tmp_path / "file").write_text("")
        done = run("passes", mission, *SPAN, "-o", f"{tmp_path / 'file' / 'o'}/")
        assert done.exit_code == 2
        assert "cannot write" in done.stderr
        assert not done.stdout


class TestPlot:
    def test_the_drawing_has_a_track_and_a_number_for_each_pass(self, run, tmp_path) -> None:
        plot = tmp_path / "p.svg"
        done = run("passes", BESANCON, *SPAN, "--plot", plot)
        assert done.exit_code == 0
        assert done.stdout.startswith("2 of 3 passes comply")
        drawing = Drawing(plot.read_bytes())
        passes = document(run, BESANCON, *SPAN)["passes"]
        for status in {one["status"] for one in passes}:
            same = [one for one in passes if one["status"] == status]
            assert len(drawing.paths(f"track is-{status}")) == len(same) + 1  # that of the legend
            marks = drawing.circles(f"dot is-{status}")
            assert len(marks) == len(same)
        assert [text for text in drawing.texts if text.isdecimal()].count("3") == 2  # in the sky and beside it
        assert {"N", "E", "S", "W", "03-20", "03-21", "resolution on the ground [m]"} <= set(drawing.texts)

    def test_directions_are_those_of_a_map(self, run, tmp_path) -> None:
        plot = tmp_path / "p.svg"
        run("passes", BESANCON, *SPAN, "--plot", plot)
        drawing = Drawing(plot.read_bytes())
        north, east = drawing.place("N"), drawing.place("E")
        zenith = north[0], east[1] - 4
        (rim,) = [line for line in drawing.lines("frame") if len(line) > 100]
        radius = max(y for _, y in rim) - zenith[1]
        passing = [one for one in document(run, BESANCON, *SPAN)["passes"] if one["status"] == "pass"]
        expected = []
        for one in passing:
            away = radius * (1 - one["elevation_rad"] / (math.pi / 2))
            expected.append(
                (zenith[0] + away * math.sin(one["bearing_rad"]), zenith[1] - away * math.cos(one["bearing_rad"]))
            )
        marks = drawing.circles("dot is-pass")
        for (x, y), place in zip(marks, expected, strict=True):
            assert (x, y) == pytest.approx(place, abs=0.02)

    def test_it_is_the_same_each_time_and_there_are_other_kinds(self, run, tmp_path) -> None:
        a, b, png, pdf = (tmp_path / name for name in ("a.svg", "b.svg", "p.png", "p.pdf"))
        for plot in (a, b, png, pdf):
            run("passes", BESANCON, *SPAN, "--plot", plot)
        assert a.read_bytes() == b.read_bytes()
        assert png.read_bytes().startswith(b"\x89PNG")
        assert pdf.read_bytes().startswith(b"%PDF")

    @pytest.mark.parametrize("days", ["0.1", "0.4"])
    def test_without_passes_or_images_there_is_a_drawing_too(self, run, tmp_path, days: str) -> None:
        plot = tmp_path / "p.svg"
        run("passes", BESANCON, "--from", "2021-03-20T15:00:00Z", "--days", days, "--plot", plot)
        assert "N" in Drawing(plot.read_bytes()).texts


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (
            ["--from", "tomorrow"],
            "--from tomorrow: is no day and no instant of UTC from 1957 to 2199; accepted",
        ),
        (["--days", "0"], "--days"),
        (["--days", "1000"], "--days"),
        (["--days", "nan"], "--days"),
        (["--min-elevation", "20"], "only zero needs no unit. Did you mean '20 deg' or '20 rad'?\n"),
        (["--min-elevation", "95 deg"], "must be less than 90 deg"),
        (["--min-elevation=-5 deg"], "must be at least 0 deg"),
        (["--squint", "90 deg"], "--squint 90 deg: must be less than 90 deg"),
        (["--platform", "receiver"], "--platform receiver: has no orbit; accepted: transmitter"),
        (["--plot", "p.gif"], "the suffix must be one of .svg, .png, .pdf"),
        (["-o", "p.docx"], "the suffix must be one of .txt, .json, .csv, "),
        (["--set", "platforms.transmitter.orbit.tle=nowhere.tle"], "nowhere.tle cannot be read"),
        (["--set", "radar.bandwidth=0 Hz"], "must be greater than 0 Hz"),
        (["--date", "yesterday"], "--date"),
    ],
    ids=lambda value: str(value)[:40],
)
def test_what_cannot_be_asked_says_why(run, arguments, said: str, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    done = run("passes", BESANCON, *arguments)
    assert done.exit_code == 2
    assert said in done.stderr
    assert not done.stdout
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("given", "wanted", "said"),
    [
        ("latitude: 47.2512 deg\n  longitude: 5.9938 deg\n  height: 360 m", "radius: 1 km", "scene: passes are over"),
        (
            "tle: paths/sentinel1a_2021079.tle",
            "tle: paths/none.tle",
            "m.yaml:32:19: platforms.transmitter.orbit",
        ),
        ("tle: paths/sentinel1a_2021079.tle", "oem: paths/sentinel1a_2021079.tle", "m.yaml:32:19: platforms.transmi"),
        ("aperture_time: 0.5 s", "aperture_time: -1 s", "m.yaml:28:18: collection.aperture_time: must be"),
    ],
    ids=["no place", "no file", "no ephemeris", "no mission"],
)
def test_a_file_that_cannot_be_used_has_its_place(run, mission, given: str, wanted: str, said: str) -> None:
    mission.write_text(mission.read_text().replace(given, wanted))
    done = run("passes", mission, *SPAN)
    assert done.exit_code == 2
    assert said in done.stderr
    assert "Read with" not in done.stderr
    assert "Traceback" not in done.stderr


def test_an_ephemeris_that_ends_is_said(run, mission) -> None:
    """The orbit of the elements as an ephemeris of half a day."""
    (mission.parent / "a.oem").write_bytes(ephemeris(start_of("2026-06-01"), 12 * 3600.0))
    mission.write_text(tree({"orbit": {"oem": "a.oem"}}, ROOF))
    done = run("passes", mission, "--from", "2026-06-01", "--days", "1")
    said = " ".join(done.stdout.split())
    assert "No orbit of the transmitter 2026-06-01 12:00 to 2026-06-02 00:00: a.oem:" in said
    (gap,) = document(run, mission, "--from", "2026-06-01", "--days", "1")["without_orbit"]
    assert gap["until"] == "2026-06-02T00:00:00.000Z"


def test_what_is_read_is_not_written_over(run, mission) -> None:
    for target in (mission, mission.parent / "paths" / NAMES.name):
        before = target.read_bytes()
        done = run("passes", mission, *SPAN, "--format", "json", "-o", target)
        assert done.exit_code == 2
        assert target.read_bytes() == before


def test_a_satellite_of_standard_input(run, monkeypatch, tmp_path) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.tle").write_text(TLE)
    done = run(*("passes", "-", "--from", "2026-06-01", "--days", "1"), input=tree({"orbit": {"tle": "a.tle"}}, ROOF))
    assert done.exit_code in (0, 1)
    assert "passes" in done.stdout.splitlines()[0]
