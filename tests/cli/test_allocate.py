"""`bisar-budget allocate`: exit codes, what is written, what is refused."""

import csv
import io
import json
import os
from xml.etree import ElementTree

import pytest

import bisar_budget as bb
from bisar_budget.mission.load import parse_mission
from bisar_budget.report.drawing.share_bars import limiting, share_bars
from bisar_budget.report.words.key_names import in_words
from tests.conftest import ROOT, TODAY, mission_text

KEY = "platforms.receiver.motion_error.velocity"
RSS = {"allocation__combine": "rss", "allocation__model": "full", "requirements__location_error": "20 m"}


@pytest.fixture
def mission(tmp_path):
    path = tmp_path / "m.yaml"
    path.write_text(mission_text(**RSS))
    return path


def document(run, *arguments) -> dict:
    (found,) = json.loads(run("allocate", *arguments, "--format", "json").stdout)["missions"]
    return found


class TestSheet:
    def test_text_says_what_to_order_and_that_it_holds(self, run, mission) -> None:
        found = run("allocate", mission)
        assert found.exit_code == 0
        lines = found.stdout.splitlines()
        assert lines[0] == "7 specifications that together meet every requirement; result of check: pass"
        assert all(len(line) <= 80 for line in lines)
        assert any(line.startswith("location error") for line in lines)

    def test_json_is_the_contract(self, run, mission) -> None:
        found = json.loads(run("allocate", mission, "--format", "json").stdout)
        assert found["format"] == "bisar-budget/allocate/1"
        (one,) = found["missions"]
        assert {"file", "status", "requirements", "specifications"} <= one.keys()
        for requirement in one["requirements"]:
            assert {"key", "value", "unit", "used"} <= requirement.keys()
        for specification in one["specifications"]:
            assert {"key", "value", "ordered", "unit", "shares", "declared", "parts"} <= specification.keys()
            assert specification["ordered"] <= specification["value"]
        assert [one["key"] for one in one["specifications"]][-1] == "timing_error.quadratic"

    def test_csv_has_a_line_for_each(self, run, mission) -> None:
        lines = list(csv.DictReader(io.StringIO(run("allocate", mission, "--format", "csv").stdout)))
        shares = [float(line["share of location_error"]) for line in lines]
        assert len(lines) == 7
        assert all(0 <= share <= 1 for share in shares)

    @pytest.mark.parametrize("name", ["markdown", "html"])
    def test_documents_name_every_specification(self, run, mission, name: str) -> None:
        text = run("allocate", mission, "--format", name).stdout
        assert "Specification sheet" in text
        for one in document(run, mission)["specifications"]:
            assert one["text"] in text

    def test_the_drawing_has_a_bar_for_each_row_that_limits(self) -> None:
        sheet = bb.allocate(parse_mission(mission_text(**RSS)), date=TODAY).found
        drawing = ElementTree.fromstring(share_bars(sheet))
        texts = ["".join(text.itertext()) for text in drawing.iter() if text.tag.endswith("text")]
        rows = limiting(sheet)
        assert len(rows) > 1
        for row in rows:
            assert {row.id, in_words(row.id)} <= set(texts)
            assert row.fixed + sum(row.shares.values()) == pytest.approx(1, abs=0.01)

    def test_keys_are_those_of_the_file_or_of_the_command(self, run, tmp_path) -> None:
        path = tmp_path / "m.yaml"
        path.write_text(mission_text(**RSS, allocation__specify={KEY: 3}))
        assert [one["key"] for one in document(run, path)["specifications"]] == [KEY]
        assert document(run, path)["specifications"][0]["weight"] == 3
        asked = document(run, path, "--for", "timing_error.quadratic")
        assert [one["key"] for one in asked["specifications"]] == ["timing_error.quadratic"]


class TestMission:
    def test_it_is_written_with_what_is_ordered_and_its_comments_and_passes(self, run, mission, tmp_path) -> None:
        mission.write_text(f"# ours\n{mission.read_text()}")
        there = tmp_path / "specified.yaml"
        assert run("allocate", mission, "-o", there).exit_code == 0
        assert there.read_text().startswith("# ours\n")
        assert run("check", there).exit_code == 0
        found = document(run, mission)
        again = json.loads(run("check", there, "--format", "json").stdout)["missions"][0]
        assert [one["utilization"] for one in again["requirements"]] == [one["used"] for one in found["requirements"]]

    def test_check_holds_the_mission_to_what_is_ordered_from_then_on(self, run, mission, tmp_path) -> None:
        """A sheet of the mission as written takes the place of the one before."""
        written = tmp_path / "w.yaml"
        run("allocate", mission, "-o", written)
        rows = json.loads(run("check", written, "--format", "json").stdout)["missions"][0]["rows"]
        held = [row for row in rows if row["metric"] == "specification"]
        assert len(held) == 7
        assert all((row["status"], row["utilization"]) == ("pass", 1.0) for row in held)
        ((_, ordered),) = {(row["id"], row["declared"]) for row in held if row["id"].endswith("receiver.velocity")}
        more = run("check", written, "--set", f"{KEY}={1.01 * ordered} m/s", "-q")
        assert more.exit_code == 1
        assert "1 specification exceeded" in more.stdout
        anew = tmp_path / "anew.yaml"
        again = run("allocate", written, "--reserve", "60", "-o", anew)
        assert again.exit_code == 0
        assert run("check", anew, "-q").exit_code == 0

    def test_specifications_that_the_file_has_limit_no_new_ones(self, run, mission) -> None:
        before = document(run, mission)
        after = document(run, mission, "--set", f"specifications.{KEY}=1 um/s")
        assert after["specifications"] == before["specifications"]

    def test_options_are_written_too(self, run, mission, tmp_path) -> None:
        there = tmp_path / "specified.yaml"
        option = "requirements.location_error=5 m"
        assert run("allocate", mission, "--set", option, "-o", there).exit_code == 0
        assert "location_error: 5 m" in there.read_text()
        assert run("check", there).exit_code == 0

    def test_a_model_that_the_sheet_holds_for_is_written(self, run, mission, tmp_path) -> None:
        there = tmp_path / "specified.yaml"
        assert run("allocate", mission, "--model", "published", "--reserve", "0", "-o", there).exit_code == 0
        assert "model: published" in there.read_text()
        assert run("check", there).exit_code == 0

    @pytest.mark.parametrize("folder", ["", "elsewhere"])
    def test_files_that_it_names_are_found_from_where_it_is_written(self, run, tmp_path, folder) -> None:
        """A mission names an orbit beside it: what was written elsewhere was refused."""
        there = tmp_path / folder / "specified.yaml"
        given = ROOT / "specs" / "missions" / "sentinel1_elements_besancon.yaml"
        found = run("allocate", given, "--set", "allocation.combine=rss", "-o", there)
        assert (found.exit_code, found.stderr) == (0, "")
        name = os.path.relpath(given.parent / "paths" / "sentinel1a_2021079.tle", there.parent.resolve())
        assert name in there.read_text()
        assert run("check", there).exit_code == 0

    def test_nothing_is_written_where_there_are_no_specifications(self, run, mission, tmp_path) -> None:
        there = tmp_path / "specified.yaml"
        found = run("allocate", mission, "--set", "requirements.location_error=1 m", "--for", KEY, "-o", there)
        assert run("allocate", mission, "--set", "scene.height_error=500 m", "-o", there).exit_code == 1
        assert found.exit_code in (0, 1)
        assert not there.exists() or found.exit_code == 0


class TestOffer:
    @pytest.fixture
    def offer(self, tmp_path):
        """An offer whose receiver is worse in velocity than the sheet has it, and better in the rest."""
        error = {"position": "1 cm", "velocity": "20 mm/s", "acceleration": "1e-6 m/s^2"}
        path = tmp_path / "offer.yaml"
        path.write_text(
            mission_text(
                **RSS,
                platforms__receiver__motion_error=error,
                platforms__transmitter__motion_error={"position": "1 cm", "velocity": "1 mm/s", "acceleration": 0},
                timing_error={"quadratic": "0 1/s"},
            )
        )
        return path

    def test_a_figure_may_be_outside_where_others_leave_room(self, run, mission, offer) -> None:
        sides = {
            one["key"]: one["is_inside"] for one in document(run, mission, "--compare", offer)["offer"]["figures"]
        }
        assert not sides.pop(KEY)
        assert all(sides.values())
        found = run("allocate", mission, "--compare", offer)
        assert found.exit_code == 0
        assert "1 of 7 figures outside" in found.stdout
        assert "OUTSIDE" in found.stdout

    def test_an_offer_with_which_the_mission_fails_is_exit_1(self, run, mission, offer) -> None:
        offer.write_text(offer.read_text().replace("20 mm/s", "900 mm/s"))
        found = run("allocate", mission, "--compare", offer)
        assert found.exit_code == 1
        assert "result of check FAIL" in found.stdout

    def test_a_figure_that_the_offer_does_not_state_is_outside(self, run, mission, tmp_path) -> None:
        silent = tmp_path / "silent.yaml"
        silent.write_text(mission_text(**RSS))
        figures = document(run, mission, "--compare", silent)["offer"]["figures"]
        assert {one["text"]: one["is_inside"] for one in figures}[""] is False

    def test_figures_of_a_part_are_those_of_the_offer(self, run, mission, tmp_path) -> None:
        path = tmp_path / "part.yaml"
        path.write_text(mission_text(**RSS, platforms__receiver__motion_error={"sensor": "mosaic-x5-rtk"}))
        figures = {one["key"]: one for one in document(run, mission, "--compare", path)["offer"]["figures"]}
        assert figures["platforms.receiver.motion_error.position"]["is_inside"] is True

    def test_a_level_of_another_spectrum_is_not_compared(self, run, tmp_path) -> None:
        own = {"frequency": "10 MHz", "phase_noise": {"1 Hz": "-95 dBc/Hz", "1 kHz": "-150 dBc/Hz"}}
        other = own | {"phase_noise": {"1 Hz": "-65 dBc/Hz", "1 kHz": "-120 dBc/Hz"}, "level": "-10 dB"}
        paths = [tmp_path / "own.yaml", tmp_path / "other.yaml"]
        rules = {"allocation__combine": "rss", "allocation__model": "full", "requirements__islr": "-20 dB"}
        for path, one in zip(paths, (own, other), strict=True):
            path.write_text(mission_text(**rules, platforms__receiver__oscillator=one))
        key = "platforms.receiver.oscillator.level"
        (figure,) = document(run, paths[0], "--for", key, "--compare", paths[1])["offer"]["figures"]
        assert (figure["is_inside"], figure["remark"]) == (None, "another spectrum")
        (figure,) = document(run, paths[0], "--for", key, "--compare", paths[0])["offer"]["figures"]
        assert figure["text"] == "0 dB"

    def test_specifications_of_its_own_file_do_not_count(self, run, mission, offer) -> None:
        offer.write_text(f"{offer.read_text()}\nspecifications: {{{KEY}: 1 mm/s}}\n")
        assert run("check", offer, "-q").exit_code == 1
        assert run("allocate", mission, "--compare", offer).exit_code == 0

    def test_balanced_shares_are_no_difference(self, run, mission, offer) -> None:
        found = document(run, mission, "--set", "allocation.split=balanced", "--compare", offer)
        assert "allocation" not in found["offer"]["differs_in"]
        found = document(run, mission, "--set", "allocation.coverage_factor=2", "--compare", offer)
        assert "allocation" not in found["offer"]["differs_in"]  # options hold for both

    def test_an_offer_for_another_mission_is_said(self, run, mission, tmp_path) -> None:
        assert document(run, mission, "--compare", mission)["offer"]["differs_in"] == []
        path = tmp_path / "other.yaml"
        path.write_text(mission_text(**RSS, radar__bandwidth="100 MHz", collection__aperture_time="2 s"))
        assert "it differs in radar, collection too" in " ".join(
            run("allocate", mission, "--compare", path).stdout.split()
        )


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["--for", "radar.bandwidth"], 2, "is no error that can be specified"),
        (["--for", KEY, "--for", KEY], 2, "is given twice"),
        (["--for", f"{KEY}s"], 2, f"Did you mean '{KEY}'"),
        (["--reserve", "100"], 2, "--reserve"),
        (["--reserve", "nan"], 2, "--reserve: nan is no part of a limit"),
        (["--set", "allocation.combine=each"], 2, "the allowables of the single errors are the answer"),
        (["--set", "scene.height_error=500 m"], 1, "other errors leave no room"),
        (["--compare", "nowhere.yaml"], 2, "nowhere.yaml"),
    ],
)
def test_what_cannot_be_asked_says_why(run, mission, arguments, code: int, said: str) -> None:
    found = run("allocate", mission, *arguments)
    assert found.exit_code == code
    assert said in found.stdout + found.stderr
    assert "Traceback" not in found.stderr


def test_one_mission_is_written_and_one_offer_compared(run, mission, tmp_path) -> None:
    other = tmp_path / "n.yaml"
    other.write_text(mission.read_text())
    assert run("allocate", mission, other, "-o", tmp_path / "x.yaml").exit_code == 2
    assert run("allocate", mission, other, "--compare", other).exit_code == 2
    assert run("allocate", mission, other).exit_code == 0


class TestReport:
    """A compliance report of a mission whose file names what to specify has the sheet in its annex."""

    @pytest.mark.parametrize("suffix", ["html", "md"])
    def test_the_annex_has_the_sheet_and_its_drawing(self, run, tmp_path, suffix: str) -> None:
        path, report = tmp_path / "m.yaml", tmp_path / f"report.{suffix}"
        path.write_text(mission_text(**RSS, allocation__specify=[KEY, "timing_error.quadratic"]))
        run("check", path, "--report", report)
        text = report.read_text()
        assert "Specifications, rounded down to two digits" in text
        assert "not declared: 2" in text
        assert document(run, path)["specifications"][0]["text"] in text
        assert "shares" in text

    def test_a_report_says_why_there_is_none(self, run, tmp_path) -> None:
        path, report = tmp_path / "m.yaml", tmp_path / "report.md"
        path.write_text(mission_text(allocation__combine="each", allocation__specify=[KEY]))
        assert run("check", path, "--report", report).exit_code in (0, 1)
        assert "no specifications: combine: each judges every error alone" in report.read_text()
