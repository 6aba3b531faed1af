"""The table of requirements in every format: what was not judged, or is broken, is named wherever somebody reads."""

import csv
import io
import json
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

from bisar_budget.findings.mission import MissionFindings, Report
from bisar_budget.report import Style, render
from bisar_budget.report.words.requirements import declared_words, kind_names
from tests.conftest import COMPLIES, ROOT, TEXT_FORMATS, findings
from tests.page import read_page

# An ISLR and nothing that spreads; the cubic phase has its own judge. One requirement is not judged, no row fails.
UNJUDGED = {
    **COMPLIES,
    "allocation": {"model": "full", "combine": "rss"},
    "requirements": {
        "quadratic_phase_error": "45 deg",
        "cubic_phase_error": "22.5 deg",
        "islr": "-20 dB",
        "location_error": "10 m",
    },
}
# Vibration that spreads 0.1 rad, and no ISLR: an effect that no requirement takes.
UNTAKEN = {
    "allocation": {"model": "full", "combine": "rss"},
    "platforms__receiver__motion_error": {"velocity": "5 mm/s", "vibration": {"wideband": {"rms": "0.5 mm"}}},
}
WAIVED = {**UNJUDGED, "waivers": [{"id": "mission.islr", "until": "2999-01-01", "reason": "ECR-17"}]}


def said(format_name: str, found: MissionFindings, **style: object) -> str:
    return render(format_name, Report("1", (found,)), Style(**style))  # type: ignore[arg-type]


def text_of(found: MissionFindings, **style: object) -> str:
    return " ".join(said("text", found, **style).split())


@pytest.mark.parametrize("format_name", TEXT_FORMATS)
@pytest.mark.parametrize("changes", [UNJUDGED, WAIVED], ids=["unjudged", "waived"])
def test_a_requirement_without_a_row_that_fails_is_named_with_its_status(format_name: str, changes: dict) -> None:
    found = findings(**changes)
    (islr,) = [one for one in found.requirements if one.key == "islr"]
    assert islr.status in ("not_evaluated", "waived")
    assert all(row.status not in ("fail", "not_evaluated", "waived") for row in found.rows)
    text = said(format_name, found).replace("\\", "")
    assert "ISLR" in text or "islr" in text
    if islr.status == "not_evaluated":
        assert "no declared error adds to the ISLR" in " ".join(text.split())
        assert re.search("not.evaluated|NOT EVAL", text)
    else:
        assert "waived" in text
        assert "ECR-17" in text


class TestMachines:
    """Where tools look, at the line of the requirement."""

    def test_junit_has_a_case_for_each(self) -> None:
        found = findings(**UNJUDGED)
        cases = {case.get("name"): case for case in ElementTree.fromstring(said("junit", found)).iter("testcase")}
        assert [name for name in cases if name.startswith("requirement.")] == [
            f"requirement.{one.key}" for one in found.requirements
        ]
        failure = cases["requirement.islr"].find("failure")
        assert failure is not None
        assert failure.get("type") == "not_evaluated"
        assert cases["requirement.location_error"].find("failure") is None

    @pytest.mark.parametrize(("changes", "has_suppression"), [(UNJUDGED, False), (WAIVED, True)])
    def test_sarif_has_a_result_where_no_row_is_one(self, changes: dict, has_suppression: bool) -> None:
        found = findings(**changes)
        (run,) = json.loads(said("sarif", found))["runs"]
        (result,) = [one for one in run["results"] if one["ruleId"] != "mission_file"]
        (location,) = result["locations"]
        assert (result["ruleId"], result["level"]) == ("islr", "error")
        assert location["logicalLocations"][0]["fullyQualifiedName"] == "requirement.islr"
        assert location["physicalLocation"]["region"]["startLine"] == found.requirements[-1].line
        assert ("suppressions" in result) == has_suppression

    def test_github_annotates_the_line_of_the_requirement(self) -> None:
        found = findings(**UNJUDGED)
        (command,) = said("github", found).splitlines()
        assert command.startswith("::error file=mission.yaml,line=")
        assert f"line={found.requirements[-1].line}," in command
        assert "title=NOT EVAL requirement.islr::ISLR of -20 dB: not evaluated; no declared error " in command

    def test_what_a_row_shows_is_no_second_finding(self) -> None:
        """A requirement that a failing row breaks is one annotation, of ten that a step shows."""
        found = findings(platforms__receiver__motion_error__velocity="5 m/s")
        assert found.requirements[0].status == "fail"
        assert "requirement." not in said("github", found)
        assert '"requirement.quadratic_phase_error"' not in said("sarif", found)

    def test_csv_and_needs_have_each(self) -> None:
        found = findings(**UNJUDGED)
        lines = list(csv.DictReader(io.StringIO(said("csv", found))))
        (line,) = [one for one in lines if one["id"] == "requirement.islr"]
        assert (line["kind"], line["status"], line["metric"]) == ("requirement", "not_evaluated", "islr")
        needs = next(iter(json.loads(said("needs", found))["versions"].values()))["needs"]
        assert needs["BUDGET_MISSION_REQUIREMENT_ISLR"]["status"] == "not_evaluated"
        assert "requirement" in needs["BUDGET_MISSION_REQUIREMENT_ISLR"]["tags"]


class TestText:
    def test_first_lines(self) -> None:
        lines = said("text", findings(**UNJUDGED)).splitlines()
        assert lines[:3] == [
            "NOT EVAL mission.yaml: 1 requirement cannot be judged",
            "base; full model, root-sum-square",
            "",
        ]
        assert " ".join(lines[3].split()) == "requirement allowed reached use status decided by"

    def test_every_requirement_met(self) -> None:
        changes = {**UNJUDGED, "requirements": {"location_error": "10 m", "cubic_phase_error": "22.5 deg"}}
        first, second, *_ = said("text", findings(**changes)).splitlines()
        assert first == "pass mission.yaml: every requirement is judged and met at 1 sigma,"
        assert second == "  more than 99.99 % of collections"

    def test_a_requirement_that_is_waived_is_not_met(self) -> None:
        words = " ".join(said("text", findings(**WAIVED)).split())
        assert words.startswith("waived mission.yaml: 1 requirement is waived, not met (waiver ")
        assert "requirement is judged and met" not in words

    def test_what_is_broken_and_what_is_not_judged_are_counted_apart(self) -> None:
        changes = {**UNJUDGED, "platforms__receiver__motion_error__velocity": "5 m/s"}
        text = text_of(findings(**changes))
        assert text.startswith("FAIL mission.yaml: 2 requirements are not met, 1 cannot be judged ")
        quiet = text_of(findings(**changes), verbosity=-1)
        assert quiet == "FAIL mission.yaml: 2 requirements not met, 1 cannot be judged"

    def test_an_effect_that_no_requirement_takes_has_the_line_to_add(self) -> None:
        text = text_of(findings(**UNTAKEN))
        assert "1 effect is judged by no requirement" in text
        above, _, below = text.partition("Declared ")
        assert "Not judged: " in above
        assert "add `islr: -20 dB` to requirements (receiver.vibration.wideband of line " in above
        assert "add `islr" not in below  # once

    def test_a_share_says_so(self) -> None:
        """The requirement is 45 deg; the receiver has half of it, and autofocus gains a factor of 8."""
        text = text_of(findings(**UNJUDGED))
        assert re.search(r"quadratic phase error 45 deg [\d.]+ deg", text)
        share = r"receiver\.quadratic_phase_error, receiver's share: [\d.]+ of 22\.5 deg"
        assert re.search(share, text)
        text = text_of(findings(**{**UNJUDGED, "autofocus__n_pull": 2}))
        assert re.search(share + ", autofocus gain 8", text)

    def test_nothing_declared(self) -> None:
        lines = said("text", findings()).splitlines()
        assert "the file declares no error, so nothing is judged" in " ".join(lines[:2])
        assert sum(line.startswith("not decl") for line in lines) == len(findings().rows)

    @pytest.mark.parametrize("changes", [UNJUDGED, UNTAKEN, WAIVED, {}])
    def test_80_columns(self, changes: dict) -> None:
        for verbosity in (0, 1):
            text = said("text", findings(**changes), verbosity=verbosity)
            assert [line for line in text.splitlines() if len(line) > 80] == []


class TestKinds:
    def test_how_many_are_declared_and_which_are_not(self) -> None:
        found = findings(**UNJUDGED)
        said_of = declared_words(found.kinds)
        assert said_of.startswith(f"Declared 1 of {found.kinds.in_all} kinds of error; not declared: ")
        assert "position (both)" in said_of
        assert "velocity (transmitter)" in said_of
        assert said_of.endswith("; without source: 1.")

    def test_both_platforms_are_said_once(self) -> None:
        kinds = ("transmitter.imu", "receiver.imu", "receiver.random", "timing")
        assert kind_names(kinds) == ["imu (both)", "random (receiver)", "timing"]


class TestUnits:
    """A quantity stands in the unit that the file gives it in, and its allowable beside it in the same."""

    IMU = {
        "allocation": {"model": "full", "combine": "rss"},
        "requirements": {"quadratic_phase_error": "45 deg", "islr": "-20 dB"},
        "platforms__receiver__motion_error": {"imu": {"attitude": "0.02 deg", "accelerometer_bias": "50 ug"}},
    }

    @pytest.mark.parametrize("format_name", ["text", "html", "markdown"])
    def test_the_files_unit(self, format_name: str) -> None:
        """It was 349 µrad."""
        text = said(format_name, findings(**self.IMU), all_rows=True)
        assert "0.02 deg" in text
        assert "50 µg" in text
        assert "µrad" not in text

    def test_an_allowable_is_rounded_down(self) -> None:
        found = findings(**self.IMU)
        (row,) = [row for row in found.rows if row.id == "receiver.imu.attitude"]
        assert row.allowable is not None
        lines = said("text", found, all_rows=True).splitlines()
        (line,) = [one for one in lines if one.startswith("info") and "receiver.imu.attitude" in one]
        shown = float(re.findall(r"([\d.]+) deg", line)[1])
        degrees = row.allowable * 57.29577951308232
        assert 0.99 * degrees <= shown <= degrees

    def test_without_a_unit_as_before(self) -> None:
        found = findings(platforms__receiver__motion_error__velocity=0.005)
        assert " 5 mm/s " in said("text", found)


@pytest.mark.parametrize("format_name", ["html", "markdown"])
def test_the_first_table_of_a_page_is_that_of_requirements(format_name: str) -> None:
    text = said(format_name, findings(**UNJUDGED))
    if format_name == "html":
        (table, *_) = read_page(text).all("table")
        cells = [[" ".join(cell.text.split()) for cell in row.all("th", "td")] for row in table.all("tr")]
        assert cells[0] == ["Requirement", "Limit", "Reached", "Use", "Status", "Verification", "Decided by"]
        assert cells[-1][0] == "ISLR"
        assert cells[-1][4] == "not evaluated"
        assert "no declared error adds to the ISLR" in cells[-1][6]
    else:
        assert "| ISLR | -20 dB | – | – | not evaluated | none | no declared error adds to the ISLR" in text
    assert re.search("1 of 17 kinds of error", text)


@pytest.mark.parametrize("format_name", TEXT_FORMATS)
def test_a_file_name_keeps_its_letters(format_name: str) -> None:
    """A sentence that began with the name of a file or a row got a capital letter."""
    found = findings(**COMPLIES)._replace(file="läufe/Über_uns.yaml")
    text = said(format_name, found)
    if format_name in ("json", "needs"):
        text = json.dumps(json.loads(text), ensure_ascii=False)
    plain = text.replace("\\", "").replace("<wbr>", "").replace("%C3%A4", "ä").replace("%C3%9C", "Ü")
    if format_name == "github":  # it has findings only
        plain += said(format_name, findings()._replace(file=found.file))
    assert "läufe/Über_uns" in plain or "läufe.Über_uns" in plain


def test_a_path_of_an_orbit_keeps_its_letters() -> None:
    from bisar_budget.budget.check import check_mission
    from bisar_budget.mission.load import load_mission
    from tests.conftest import TODAY

    file = ROOT / "specs" / "missions" / "astra_drone.yaml"
    text = said("html", check_mission(load_mission(str(file)), TODAY)).replace("<wbr>", "")
    assert "paths/astra1n_2026282.tle" in text
    assert "Paths/" not in text
    assert Path(file).exists()


def test_the_overview_of_a_report_shows_the_requirement_that_decides() -> None:
    """Beside `not evaluated` stood the row that uses most of its limit, which passes."""
    unjudged, met = findings(**UNJUDGED), findings(**COMPLIES)
    text = render("markdown", Report(version="", missions=(unjudged, met)), Style())
    lines = [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("| base (mission.yaml)")]
    assert [(cells[1], cells[5]) for cells in lines] == [("not evaluated", "not evaluated"), ("pass", "–")]
    (head,) = [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("| Mission | Status")]
    assert head[5] == "ISLR"
