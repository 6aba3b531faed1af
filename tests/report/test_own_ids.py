"""Ids and texts of the project's requirements, in every format."""

import csv
import io
import json
import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

from tests.conftest import TEXT_FORMATS, findings, mission_text, row

IDS = {
    "requirement.location_error": "SYS-042",
    "requirement.declare": "SYS-050",
    "receiver.velocity.x": ["SYS-012", "SYS-013"],
    "mission.location_error": "SYS-043",
}
TEXTS = {"SYS-042": "The image shall be located within 5 m.", "SYS-013": "Velocity shall be known to 5 mm/s."}
STATED = {
    "requirements": {"location_error": "1 mm", "declare": ["position"]},
    "allocation": {"combine": "rss", "model": "full"},
    "requirement_ids": IDS,
    "requirement_texts": TEXTS,
    "platforms__receiver__motion_error__position": "1 m",
}


@pytest.fixture
def mission(tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "m.yaml"
    path.write_text(mission_text(**STATED))
    return path


@pytest.fixture
def written(run, mission):
    return lambda form: run("check", mission.name, "--format", form).stdout


def test_the_ids_are_those_of_the_file() -> None:
    judged = findings(**STATED)
    requirements = {requirement.key: requirement for requirement in judged.requirements}
    assert requirements["location_error"].requirement_ids == ("SYS-042",)
    assert requirements["declare"].requirement_id == "SYS-050"
    assert requirements["quadratic_phase_error"].requirement_ids == ()
    assert requirements["quadratic_phase_error"].requirement_id is None
    assert row(judged, "receiver.velocity.x").requirement_ids == ("SYS-012", "SYS-013")
    assert row(judged, "receiver.velocity.x").requirement_id == "SYS-012, SYS-013"
    assert row(judged, "mission.location_error").requirement_id == "SYS-043"
    assert not [warning for warning in judged.warnings if "requirement_" in warning.message]


def test_json_has_the_list_beside_the_joined_text(written) -> None:
    (mission,) = json.loads(written("json"))["missions"]
    requirements = {requirement["key"]: requirement for requirement in mission["requirements"]}
    assert requirements["location_error"]["requirement_ids"] == ["SYS-042"]
    assert requirements["location_error"]["requirement_id"] == "SYS-042"
    assert requirements["quadratic_phase_error"]["requirement_ids"] == []
    assert requirements["quadratic_phase_error"]["requirement_id"] is None
    rows = {row["id"]: row for row in mission["rows"]}
    assert rows["receiver.velocity.x"]["requirement_ids"] == ["SYS-012", "SYS-013"]
    assert rows["receiver.velocity.x"]["requirement_id"] == "SYS-012, SYS-013"
    assert (rows["receiver.velocity.y"]["requirement_ids"], rows["receiver.velocity.y"]["requirement_id"]) == (
        [],
        None,
    )
    assert mission["requirement_texts"] == TEXTS


def test_json_of_a_mission_without_texts_has_no_key_for_them(run, mission) -> None:
    mission.write_text(mission_text())
    assert "requirement_texts" not in json.loads(run("check", mission, "--format", "json").stdout)["missions"][0]


@pytest.mark.parametrize("form", TEXT_FORMATS)
def test_every_format_carries_the_ids_of_requirements_and_rows(written, form) -> None:
    text = written(form)
    assert {own_id for own_id in ("SYS-042", "SYS-043") if own_id not in text} == set()


@pytest.mark.parametrize("form", ["text", "html", "markdown", "json", "needs", "junit"])
def test_texts_are_in_reports(written, form) -> None:
    text = re.sub(r"\\+(.)", r"\1", written(form))
    assert TEXTS["SYS-042"] in re.sub(r"\s+", " ", re.sub("<wbr>|<[^>]*>", "", text)) or TEXTS["SYS-042"] in text


def test_csv(written) -> None:
    lines = {line["id"]: line["requirement_id"] for line in csv.DictReader(io.StringIO(written("csv")))}
    assert lines["requirement.location_error"] == "SYS-042"
    assert lines["receiver.velocity.x"] == "SYS-012, SYS-013"
    assert lines["requirement.quadratic_phase_error"] == ""


def test_needs_link_to_every_id(written) -> None:
    (version,) = json.loads(written("needs"))["versions"].values()
    links = {need["title"].partition(" of ")[0]: need["links"] for need in version["needs"].values()}
    assert links["location error"] == ["SYS-042"]
    assert links["receiver.velocity.x"] == ["SYS-012", "SYS-013"]
    assert links["quadratic phase error"] == []
    assert "BUDGET_SYS_042_REQUIREMENT_LOCATION_ERROR" in version["needs"]
    assert "BUDGET_SYS_012_RECEIVER_VELOCITY_X" in version["needs"]


def test_junit_properties(written) -> None:
    properties = {
        case.get("name"): {each.get("name"): each.get("value") for each in case.iter("property")}
        for case in ElementTree.fromstring(written("junit")).iter("testcase")
    }
    assert properties["requirement.location_error"]["requirement_id"] == "SYS-042"
    assert properties["requirement.location_error"]["requirement_text"] == TEXTS["SYS-042"]
    assert properties["receiver.velocity.x"]["requirement_id"] == "SYS-012, SYS-013"
    assert properties["receiver.velocity.x"]["requirement_text"] == TEXTS["SYS-013"]
    assert "requirement_id" not in properties["requirement.quadratic_phase_error"]


def test_a_requirement_of_two_missions_has_the_mission_in_its_name(run, mission, tmp_path) -> None:
    (tmp_path / "n.yaml").write_text(mission.read_text())
    (version,) = json.loads(run("check", "m.yaml", "n.yaml", "--format", "needs").stdout)["versions"].values()
    names = [name for name in version["needs"] if name.endswith("REQUIREMENT_LOCATION_ERROR")]
    assert sorted(names) == [
        "BUDGET_SYS_042_M_REQUIREMENT_LOCATION_ERROR",
        "BUDGET_SYS_042_N_REQUIREMENT_LOCATION_ERROR",
    ]


def test_an_explanation_has_the_ids_and_the_text(run, mission) -> None:
    text = run("check", mission, "--explain", "requirement.location_error").stdout
    assert "requirement.location_error [SYS-042]" in text.splitlines()[0]
    assert TEXTS["SYS-042"] in text
    assert "[SYS-012, SYS-013]" in run("check", mission, "--explain", "receiver.velocity.x").stdout.splitlines()[0]


def test_diff_carries_the_ids(run, mission, tmp_path) -> None:
    before = tmp_path / "before.yaml"
    before.write_text(mission_text(**{**STATED, "requirements": {"location_error": "1 km", "declare": ["position"]}}))
    document = json.loads(run("diff", before, mission, "--format", "json").stdout)["missions"][0]
    (moved,) = [each for each in document["requirements"] if each["key"] == "location_error"]
    assert moved["requirement_ids"] == ["SYS-042"]
    assert all("requirement_ids" in each["after"] for each in document["rows"])
    assert "location error [SYS-042]: " in run("diff", before, mission).stdout


def test_allocate_derives_from_the_ids_of_requirements(run, mission) -> None:
    mission.write_text(
        mission_text(
            requirements__location_error="20 m",
            allocation={"combine": "rss", "model": "full"},
            requirement_ids={"requirement.location_error": ["SYS-042", "SYS-044"]},
        )
    )
    text = run("allocate", mission, "--format", "sdoc").stdout
    assert "VALUE: SYS-042\n" in text
    assert "VALUE: SYS-044\n" in text
    document = json.loads(run("allocate", mission, "--format", "json").stdout)["missions"][0]
    ids = {each["key"]: each["requirement_ids"] for each in document["requirements"]}
    assert ids["location_error"] == ["SYS-042", "SYS-044"]


def test_unknown_ids_are_warnings_with_the_nearest_id() -> None:
    judged = findings(
        requirement_ids={
            "receiver.velocity.w": "A",
            "requirement.islr": "B",
            "requirement.quadratic_phase_eror": "C",
        },
        requirement_texts={"A": "a text", "D": "a text"},
    )
    messages = [warning.message for warning in judged.warnings if warning.message.startswith("requirement_")]
    assert len(messages) == 4
    assert messages[0].startswith(
        "requirement_ids: no row or requirement has the id receiver.velocity.w. Did you mean 'rec"
    )
    assert messages[1].startswith("requirement_ids: no row or requirement has the id requirement.islr")
    assert messages[2].endswith("Did you mean 'requirement.quadratic_phase_error'?")
    assert messages[3] == "requirement_texts: requirement_ids does not have the id D"


@pytest.mark.parametrize(
    ("ids", "message"),
    [
        ({"receiver.velocity.x": []}, "must be a list of 1 to 100 ids"),
        ({"receiver.velocity.x": ["A", "A"]}, "is in the list twice"),
        ({"receiver.velocity.x": ["A", ""]}, "must not be empty"),
        ({"receiver.velocity.x": {"A": 1}}, "must be text"),
        ({"receiver.velocity.x": ["A", ["B"]]}, "must be text"),
        ([], "must be a mapping of keys to ids"),
    ],
)
def test_ids_that_are_none(run, mission, ids, message) -> None:
    mission.write_text(mission_text(requirement_ids=ids) if ids else f"{mission_text()}\nrequirement_ids: [A]\n")
    result = run("check", mission)
    assert result.exit_code == 2
    assert message in re.sub(r"\s+", " ", result.output)


def test_a_list_of_ids_as_an_option(run, mission) -> None:
    options = (
        "--set",
        "requirement_ids.requirement.location_error=[A-1, A-2]",
        "--set",
        "requirement_texts.A-1=Near.",
    )
    (document,) = json.loads(run("check", mission, *options, "--format", "json").stdout)["missions"]
    (required,) = [each for each in document["requirements"] if each["key"] == "location_error"]
    assert required["requirement_ids"] == ["A-1", "A-2"]
    assert document["requirement_texts"]["A-1"] == "Near."
