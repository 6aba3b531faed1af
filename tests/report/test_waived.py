"""What is waived is not met: no count and no format says that it complies or passes, and each names the waivers."""

import csv
import io
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from click.testing import Result

import bisar_budget as bb
from bisar_budget.findings.solution import Crossing, Solution, State
from bisar_budget.findings.status import RANK, STATUS, complying, exit_code
from bisar_budget.report import Style
from bisar_budget.report.answers import written
from tests.conftest import ROOT

Run = Callable[..., Result]

DAY = "2026-11-01"
WAIVER = "mission.location_error"
BESANCON = ROOT / "specs" / "missions" / "sentinel1_elements_besancon.yaml"
MISSION = """\
schema_version: 1
name: Located badly
radar: {{ center_frequency: 10 GHz, bandwidth: 300 MHz }}
collection: {{ aperture_time: 2 s }}
platforms:
  transmitter:
    position: [30 km, 0, 6 km]
    velocity: [0, 150 m/s, 0]
    motion_error: {{ position: 10 m, velocity: 1 mm/s, source: INS }}
  receiver:
    position: [3 km, 3 km, 1 km]
    velocity: [-20 m/s, 20 m/s, 0 m/s]
    motion_error: {{ position: 10 m, velocity: 1 mm/s, source: INS }}
requirements: {{ location_error: {location}{more} }}
{waivers}
"""


def text(*waivers: str, location: str = "3 m", more: str = "", until: str = "2999-01-01") -> str:
    """A mission whose image is displaced by 11 m, more than three times what it may be."""
    listed = [f'  - {{ id: "{one}", until: {until}, reason: ECR-17 }}' for one in waivers]
    whole = "\n".join(["waivers:", *listed]) if waivers else ""
    return MISSION.format(location=location, more=more, waivers=whole)


@pytest.fixture
def waived(tmp_path: Path) -> Path:
    path = tmp_path / "m.yaml"
    path.write_text(text(WAIVER), encoding="utf-8")
    return path


def checked(run: Run, path: Path, *arguments: str) -> tuple[int, str]:
    found = run("check", path, "--date", DAY, *arguments)
    return found.exit_code, found.stdout


def document(run: Run, path: Path) -> dict[str, Any]:
    (mission,) = json.loads(checked(run, path, "--format", "json")[1])["missions"]
    return mission  # type: ignore[no-any-return]


# ---------------------------------------------------------------- the status
def test_the_order_of_statuses() -> None:
    order = ["error", "fail", "not_evaluated", "waived", "warn", "pass_with_autofocus", "pass"]
    assert [name for name in sorted(RANK, key=RANK.__getitem__) if STATUS[name].gates] == order
    assert (exit_code({"waived"}, strict=False), exit_code({"waived"}, strict=True)) == (0, 0)
    assert exit_code({"waived", "warn"}, strict=True) == 1
    assert complying({"waived": 12, "warn": 1, "pass": 19, "fail": 2, "error": 3, "not_evaluated": 4}) == 20


def test_a_mission_and_its_requirement_are_waived(run: Run, waived: Path) -> None:
    whole = json.loads(checked(run, waived, "--format", "json")[1])
    (mission,) = whole["missions"]
    assert whole["status"] == mission["status"] == "waived"
    assert mission["waived_by"] == [WAIVER]
    phase, location = mission["requirements"]
    assert (phase["status"], phase["waived_by"]) == ("pass", [])
    assert (location["status"], location["waived_by"]) == ("waived", [WAIVER])
    assert location["utilization"] > 3.5
    (row,) = [one for one in mission["rows"] if one["id"] == WAIVER]
    assert (row["status"], row["waived_by"]) == ("waived", [WAIVER])


@pytest.mark.parametrize(("limit", "code"), [("3 m", 0), ("12 m", 1)])
def test_strict_fails_where_something_warns_beside_what_is_waived(
    run: Run, tmp_path: Path, limit: str, code: int
) -> None:
    """The location uses 92 % of 12 m; what is waived is that the file declares no oscillator."""
    path = tmp_path / "m.yaml"
    path.write_text(text(WAIVER, "mission.declare", location=limit, more=", declare: [oscillator]"), encoding="utf-8")
    mission = document(run, path)
    assert mission["status"] == "waived"
    assert checked(run, path)[0] == 0
    assert checked(run, path, "--strict")[0] == code
    assert checked(run, path, "--strict", "--format", "html")[0] == code


def test_without_waivers_all_is_as_before(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "m.yaml"
    for limit, status, code in (("3 m", "fail", 1), ("12 m", "warn", 0), ("20 m", "pass", 0)):
        path.write_text(text(location=limit), encoding="utf-8")
        mission = document(run, path)
        assert (mission["status"], mission["waived_by"]) == (status, [])
        assert checked(run, path)[0] == code
    words = " ".join(checked(run, path)[1].split())
    assert words.startswith(f"pass {path}: every requirement is judged and met")
    assert "waive" not in words.replace(str(path), "")


@pytest.mark.parametrize(
    ("waivers", "more", "status"),
    [
        (
            (WAIVER,),
            ", quadratic_phase_error: 0.1 deg",
            "fail",
        ),  # another requirement is broken, and no waiver names it
        (("receiver.position.x",), "", "fail"),  # what the errors make up fails, whoever waives one of them
        (("mission.*",), "", "waived"),
        (("*location*",), "", "waived"),
        (("receiver.*",), "", "fail"),
    ],
)
def test_what_a_waiver_does_not_name_fails(
    run: Run, tmp_path: Path, waivers: tuple[str, ...], more: str, status: str
) -> None:
    path = tmp_path / "m.yaml"
    path.write_text(text(*waivers, more=more), encoding="utf-8")
    mission = document(run, path)
    assert mission["status"] == status
    assert checked(run, path)[0] == (1 if status == "fail" else 0)
    location = next(one for one in mission["requirements"] if one["key"] == "location_error")
    assert location["waived_by"] == (list(waivers) if location["status"] == "waived" else [])


def test_a_waiver_that_is_over_waives_nothing(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "m.yaml"
    path.write_text(text(WAIVER, until="2026-10-31"), encoding="utf-8")
    mission = document(run, path)
    assert (mission["status"], mission["waived_by"]) == ("fail", [])
    assert checked(run, path)[0] == 1


def test_a_row_that_breaks_two_requirements_meets_neither(run: Run, tmp_path: Path) -> None:
    """The displacement binds the row; its phase breaks the quadratic requirement too, which said pass."""
    path = tmp_path / "m.yaml"
    each = text("receiver.velocity.*", WAIVER, location="1 mm") + "allocation: { combine: each }\n"
    large = each.replace("position: 10 m, velocity: 1 mm/s", "velocity: [0, 0, 100 m/s]").replace(
        "velocity: [0, 0, 100 m/s]", "velocity: 0", 1
    )
    path.write_text(large, encoding="utf-8")
    mission = document(run, path)
    (row,) = [one for one in mission["rows"] if one["id"] == "receiver.velocity.z"]
    assert row["status"] == "waived"
    phase = mission["requirements"][0]
    assert row["binding_requirement"] == "location_error"
    assert (phase["status"], phase["waived_by"]) == ("waived", ["receiver.velocity.*"])


# ---------------------------------------------------------------- every format
@pytest.mark.parametrize("form", ["text", "html", "markdown", "junit", "sarif", "github", "needs", "csv", "json"])
def test_no_format_says_that_it_complies(run: Run, waived: Path, form: str) -> None:
    code, said = checked(run, waived, "--format", form)
    assert code == 0
    assert not re.search(r"\b(complies|comply|judged and met|met or waived)\b", said, re.IGNORECASE)
    assert re.search(r"mission\.location(?:\\+)?_error", said)
    assert "ECR" in said
    assert "waived" in said


def test_the_verdicts_of_a_page_and_a_terminal(run: Run, waived: Path) -> None:
    page = checked(run, waived, "--format", "html")[1]
    assert 'class="verdict waived">Not met; accepted by waiver; 1 row over its limit is waived' in page
    assert checked(run, waived, "-q")[1].startswith(
        f"waived {waived}: 1 requirement waived, not met (waiver {WAIVER})"
    )
    other = waived.with_name("other.yaml")
    other.write_text(text(WAIVER), encoding="utf-8")
    two = " ".join(run("check", waived, other, "-q", "--date", DAY).stdout.split())
    assert two.endswith("waived 2 missions: 2 waived")


def test_csv_and_junit_have_the_waivers(run: Run, waived: Path) -> None:
    lines = list(csv.DictReader(io.StringIO(checked(run, waived, "--format", "csv")[1])))
    by = {line["id"]: line["waived_by"] for line in lines if line["status"] == "waived"}
    assert by == {"requirement.location_error": WAIVER, WAIVER: WAIVER}
    assert not any(line["waived_by"] for line in lines if line["status"] != "waived")
    suite = ElementTree.fromstring(checked(run, waived, "--format", "junit")[1]).find("testsuite")
    assert suite is not None
    values = {one.get("name"): one.get("value") for one in suite.iterfind("properties/property")}
    assert (values["budget_status"], values["waived_by"]) == ("waived", WAIVER)
    assert (suite.get("failures"), suite.find("testcase[@name='requirement.location_error']/skipped") is None) == (
        "0",
        False,
    )


# ---------------------------------------------------------------- questions
def test_passes_are_counted_apart(run: Run, tmp_path: Path) -> None:
    """Three of ten passes break the location by up to 314 %, which is waived; six are in doubt."""
    waivers = f'waivers=[{{"id": "{WAIVER}", "until": "2999-01-01", "reason": "ECR-17"}}]'
    ask = ["passes", BESANCON, "--from", "2021-03-19", "--days", "3", "--date", DAY]
    ask += ["--set", "requirements.location_error=1.5 m", "--set", "allocation.combine=rss"]
    found = run(*ask, "--set", waivers)
    said = " ".join(found.stdout.split())
    assert found.exit_code == 0
    assert said.startswith(f"10 passes: 0 comply, 3 waived ({WAIVER}), 0 fail, 6 not evaluated, 1 without a mission")
    assert found.stdout.count(f" {WAIVER}\n") == 3  # in the line of each
    whole = json.loads(run(*ask, "--set", waivers, "--format", "json").stdout)
    assert whole["summary"] == {"comply": 0, "waived": 3, "fail": 0, "not_evaluated": 6, "without_mission": 1}
    for one in whole["passes"]:
        assert one["waived_by"] == ([WAIVER] if one["status"] == "waived" else [])
        assert (one["utilization"] is None) == (one["status"] in ("not_evaluated", "error"))
        assert one["status"] != "waived" or one["utilization"] > 1
    calendar = run(*ask, "--set", waivers, "--format", "ics").stdout.replace("\n ", "")
    assert calendar.count("CATEGORIES:waived") == calendar.count(f"(waiver {WAIVER})") == 3
    written = run(*ask, "--set", waivers, "-o", f"{tmp_path}/out/")
    assert f"3 mission files in {tmp_path}/out/: 0 comply, 3 waived ({WAIVER})" in written.stderr
    unwaived = run(*ask)
    assert unwaived.exit_code == 1
    assert "none of 10 passes comply" in unwaived.stdout


def test_cases_of_a_sweep_are_counted_apart(run: Run, waived: Path) -> None:
    found = run("sweep", waived, "--vary", "requirements.location_error=3m:20m:18", "--date", DAY)
    assert f"18 cases, 9 comply (50 %), 9 waived ({WAIVER})" in found.stderr
    lines = list(csv.DictReader(line for line in found.stdout.splitlines() if not line.startswith("#")))
    for line in lines:
        is_over = float(line["requirements.location_error [m]"]) < 11.01
        assert (line["status"] == "waived") == is_over
        assert line["waived_by"] == (WAIVER if is_over else "")
        assert not is_over or (line["worst_row"] == WAIVER and float(line["utilization"]) > 1)


def test_a_solution_is_where_it_complies_without_the_waiver(run: Run, waived: Path) -> None:
    ask = ["solve", waived, "--date", DAY, "--format", "json", "--for", "requirements.location_error", "--between"]
    found = run(*ask, "1m..100m")
    (one,) = json.loads(found.stdout)["missions"]
    assert one["value"] == pytest.approx(11.0171, rel=1e-4)
    (crossing,) = one["crossings"]
    assert (crossing["inside"]["waived_by"], crossing["outside"]["waived_by"]) == ([], [WAIVER])
    assert crossing["outside"]["status"] == "waived"
    none = run(*ask, "1m..3m")
    (one,) = json.loads(none.stdout)["missions"]
    assert (none.exit_code, one["status"], one["value"]) == (0, "waived", None)
    assert (one["waived_by"], one["places_waived"] > 0) == ([WAIVER], True)
    said = " ".join(
        run(
            "solve", waived, "--for", "requirements.location_error", "--between", "1m..3m", "--date", DAY
        ).stdout.split()
    )
    assert re.search(rf"no value of the range complies, \d+ waived \({WAIVER}\)", said)
    usage = " ".join(run("solve", "--help").stdout.split())
    assert "Exit code: 0, also if nothing complies but some value is waived; 1 if" in usage


def test_a_solution_in_python_counts_it_apart(waived: Path) -> None:
    mission = bb.load(str(waived))
    for between, said in (
        (("1 m", "3 m"), rf"no value of the range complies, \d+ waived \({WAIVER}\)"),
        (("1 m", "100 m"), rf"11\.01\d* m, \d+ waived \({WAIVER}\)"),
        (("20 m", "100 m"), "every value of the range complies"),
    ):
        found = bb.solve(mission, "requirements.location_error", between=between, date=DAY)
        assert re.fullmatch(f"<solve of requirements.location_error for 'Located badly': {said}>", repr(found))
    other = bb.loads(text())
    found = bb.solve(other, "requirements.location_error", between=("1 m", "3 m"), date=DAY)
    assert repr(found).endswith(": no value of the range complies>")


def test_parts_that_are_waived_stand_apart(run: Run, waived: Path) -> None:
    key = "platforms.receiver.oscillator.sensor"
    found = run("solve", waived, "--for", key, "--date", DAY, "--format", "json")
    (one,) = json.loads(found.stdout)["missions"]
    assert (found.exit_code, one["status"]) == (0, "waived")
    parts = [part for part in one["parts"] if part["status"] == "waived"]
    assert parts == one["parts"][: len(parts)]
    assert not any(part["complies"] for part in one["parts"])
    assert all(part["waived_by"] == [WAIVER] for part in parts)


def test_a_study_in_a_report_counts_it_apart(run: Run, waived: Path, tmp_path: Path) -> None:
    ask = ("--sweep", "requirements.location_error=3m:20m:18", "--report", tmp_path / "r.html")
    run("check", waived, "--date", DAY, *ask, "--report", tmp_path / "r.json")
    (mission,) = json.loads((tmp_path / "r.json").read_text(encoding="utf-8"))["missions"]
    assert (mission["sweep"]["comply"], mission["sweep"]["waived"], mission["sweep"]["waived_by"]) == (9, 9, [WAIVER])
    assert f"18 cases: 9 comply (50 %), 9 waived ({WAIVER})" in (tmp_path / "r.html").read_text(encoding="utf-8")


def test_an_allocation_does_not_look_at_waivers(run: Run, waived: Path) -> None:
    """A requirement that other errors break leaves no room, waived or not; an offer's own waivers count as little."""
    key = "platforms.receiver.motion_error.velocity"
    found = run("allocate", waived, "--for", key, "--date", DAY, "--format", "json")
    (one,) = json.loads(found.stdout)["missions"]
    assert (found.exit_code, one["complies"]) == (1, False)
    key = "platforms.receiver.motion_error.position"
    alone = text(WAIVER).replace("motion_error: { position: 10 m,", "motion_error: { position: 1 m,", 1)
    waived.write_text(alone, encoding="utf-8")
    found = run("allocate", waived, "--for", key, "--date", DAY, "--compare", waived, "--format", "json")
    (one,) = json.loads(found.stdout)["missions"]
    assert one["complies"]
    assert (found.exit_code, one["offer"]["status"], one["offer"]["complies"]) == (1, "fail", False)


def test_python_counts_it_apart(waived: Path) -> None:
    mission = bb.load(str(waived))
    result = bb.check(mission, date=DAY)
    assert (result.status, result.exit_code, result.waived_by) == ("waived", 0, (WAIVER,))
    assert result.requirements["location_error"].status == "waived"
    page = result._repr_html_()
    assert "waived, not met" in page
    assert "is judged and met" not in page
    table = bb.sweep(mission, {"requirements.location_error": ["3 m", "20 m"]}, date=DAY)
    assert list(table["status"]) == ["waived", "pass"]
    assert list(table["waived_by"]) == [WAIVER, ""]
    assert "1 comply (50 %), 1 waived" in repr(table)


# ---------------------------------------------------------------- seams to the user
def test_all_of_several_missions_have_to_comply_with_their_specifications(run: Run, tmp_path: Path) -> None:
    good, bad = tmp_path / "good.yaml", tmp_path / "bad.yaml"
    good.write_text(text(location="50 m"), encoding="utf-8")
    bad.write_text(text(), encoding="utf-8")
    key = "platforms.receiver.motion_error.velocity"
    codes = [run("allocate", *files, "--for", key).exit_code for files in ((good,), (bad,), (good, bad))]
    assert codes == [0, 1, 1]


def test_a_displacement_in_csv_is_east_then_north(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "m.yaml"
    path.write_text(text(), encoding="utf-8")
    rows = {one["id"]: one["displacement_m"] for one in document(run, path)["rows"]}
    lines = csv.DictReader(io.StringIO(checked(run, path, "--format", "csv")[1]))
    said = {one["id"]: (one["displacement_x_m"], one["displacement_y_m"]) for one in lines if one["kind"] == "row"}
    moved = {name: both for name, both in rows.items() if both and both[0] != both[1]}
    assert moved
    for name, both in moved.items():
        assert [float(one) for one in said[name]] == both


def test_sarif_says_what_a_requirement_allows(run: Run, tmp_path: Path) -> None:
    """Nothing that spreads is declared: no row shows that ISLR cannot be judged, and the requirement is a result."""
    path = tmp_path / "m.yaml"
    path.write_text(text(location="50 m", more=", islr: -20 dB"), encoding="utf-8")
    (log,) = json.loads(checked(run, path, "--format", "sarif")[1])["runs"]
    (found,) = [one["properties"] for one in log["results"] if one.get("properties", {}).get("metric") == "islr"]
    assert (found["status"], found["allowable"], found["unit"]) == ("not_evaluated", -20.0, "dB")


def test_an_ascending_pass_flies_north(run: Run) -> None:
    """The evening pass of Sentinel-1 over Europe is the ascending one, by its mission's source."""
    found = run("passes", BESANCON, "--from", "2021-03-20", "--days", "2", "--format", "json")
    directions = {one["center_time"][:13]: one["direction"] for one in json.loads(found.stdout)["passes"]}
    assert (directions["2021-03-20T17"], directions["2021-03-20T06"]) == ("ascending", "descending")


def test_the_binding_row_is_the_one_that_breaks() -> None:
    inside, outside = State(1.0, True, "pass", row="a"), State(2.0, False, "fail", row="b", requirement="islr")
    found = Solution(
        file="m.yaml", name="m", key="k", unit="m", is_scale=False, target="fail", row=None, model="full", low=0.0,
        high=3.0, is_circle=False, given=None, crossings=(Crossing(inside, outside, True, True),), nearest=inside,
        is_constant=False, skipped=0, texts={1.0: "1 m", 2.0: "2 m", 0.0: "0 m", 3.0: "3 m"},
    )  # fmt: skip
    (one,) = json.loads(str(written("solve", "json", [found], Style())))["missions"]
    assert (one["binding_row"], one["binding_requirement"]) == ("b", "islr")
