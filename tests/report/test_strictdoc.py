"""The document of StrictDoc: requirements with their status, and the results that decide it below them."""

import re

import pytest

from bisar_budget.findings.mission import Report
from bisar_budget.report import Style, format_of, render
from bisar_budget.report.formats.strictdoc import strict_uid
from tests.conftest import findings, mission_text

STATED = {
    "requirements": {"location_error": "1 mm", "declare": ["position"], "pslr": "-30 dB"},
    "allocation": {"combine": "rss", "model": "full"},
    "platforms__receiver__motion_error": {"position": "1 m", "velocity": "1 mm/s"},
    "requirement_ids": {
        "requirement.location_error": ["SYS-042", "SYS-043"],
        "requirement.declare": "SYS-043",
        "receiver.velocity.x": "NAV-12",
    },
    "requirement_texts": {"SYS-042": "The image shall be located within 1 mm."},
}


def nodes(text: str) -> dict[str, tuple[str, dict[str, str], list[str]]]:
    """Tag, fields and parents of each node, by its UID."""
    read = {}
    for tag, block in re.findall(r"(?ms)^\[(REQUIREMENT|RESULT)\]\n(.*?)\n(?:\n|\Z)", text):
        fields = dict(re.findall(r"(?m)^([A-Z]+): (.+)$", block))
        assert fields["UID"] not in read
        read[fields["UID"]] = tag, fields, re.findall(r"(?m)^  VALUE: (.*)$", block)
    return read


def written(*missions: dict) -> dict:
    return nodes(render("sdoc", Report("1", tuple(findings(**mission) for mission in missions)), Style()))


def test_a_requirement_has_the_ids_of_the_project_or_the_id_of_needs() -> None:
    requirements = {uid: fields for uid, (tag, fields, _) in written(STATED).items() if tag == "REQUIREMENT"}
    assert list(requirements) == [
        "BUDGET_MISSION_REQUIREMENT_QUADRATIC_PHASE_ERROR",
        "SYS-042",
        "SYS-043",
        "BUDGET_MISSION_REQUIREMENT_PSLR",
        "NAV-12",
    ]
    located = requirements["SYS-042"]
    assert located["STATEMENT"] == "The image shall be located within 1 mm."
    assert (located["STATUS"], located["KEY"], located["LIMIT"]) == ("fail", "location_error", "1 mm")
    both = requirements["SYS-043"]
    assert both["STATUS"] == "fail"
    assert both["TITLE"] == "location error of base; declarations of base"
    assert both["STATEMENT"] == (
        "The location error shall be at most 1 mm. The mission file shall declare the errors position."
    )
    assert (both["KEY"], both["LIMIT"]) == ("location_error; declare", "1 mm; position")
    assert requirements["NAV-12"]["STATEMENT"].startswith("receiver.velocity.x shall be at most ")
    assert "LIMIT" not in requirements["NAV-12"]


def test_results_are_below_their_requirements() -> None:
    document = written(STATED)
    parents = {uid: above for uid, (tag, _, above) in document.items() if tag == "RESULT"}
    assert parents["BUDGET_MISSION_MISSION_LOCATION_ERROR"] == ["SYS-042", "SYS-043"]
    assert parents["BUDGET_MISSION_MISSION_DECLARE"] == ["SYS-043"]
    assert parents["BUDGET_MISSION_RECEIVER_VELOCITY_X"] == ["NAV-12"]
    assert parents["BUDGET_MISSION_REQUIREMENT_PSLR_RESULT"] == ["BUDGET_MISSION_REQUIREMENT_PSLR"]
    _, fields, _ = document["BUDGET_MISSION_MISSION_LOCATION_ERROR"]
    assert fields["STATUS"] == "fail"
    assert fields["STATEMENT"].startswith("mission.location_error: declared ")
    assert re.match(r"base, mission.yaml:\d+$", fields["COMMENT"])


def test_one_id_in_two_missions_is_one_node_with_the_worst_status() -> None:
    met = {**STATED, "name": "other", "requirements": {**STATED["requirements"], "location_error": "1 km"}}
    document = written(met, STATED)
    _, fields, _ = document["SYS-042"]
    assert fields["STATUS"] == "fail"
    assert fields["TITLE"] == "location error of other; location error of base"
    assert fields["LIMIT"] == "1 km; 1 mm"


def test_a_file_that_cannot_be_used_is_a_result(run, tmp_path) -> None:
    (tmp_path / "broken.yaml").write_text("name: broken\n")
    document = nodes(run("check", tmp_path / "broken.yaml", "--format", "sdoc").stdout)
    ((tag, fields, above),) = document.values()
    assert (tag, fields["STATUS"], above) == ("RESULT", "error", [])
    assert "radar: is missing" in fields["STATEMENT"]


@pytest.mark.parametrize(
    ("own_id", "uid"),
    [
        ("SYS-042", "SYS-042"),
        ("NAV 12.3: a/b (c)", "NAV 12.3: a/b (c)"),
        ("SYS, 042 [x]", "SYS_ 042 _x_"),
        ("-1", "_-1"),
        (" ", "_"),
        ("漢", "漢"),
    ],
)
def test_an_id_becomes_a_uid_of_the_syntax(own_id, uid) -> None:
    assert strict_uid(own_id) == uid
    assert re.fullmatch(r"\w[\w()\-/.: ]*", strict_uid(own_id))


def test_ids_that_become_equal_are_kept_apart() -> None:
    ids = {"requirement_ids": {"receiver.velocity.x": "A,1", "receiver.velocity.y": "A;1"}}
    uids = [uid for uid in written({**STATED, **ids}) if uid.startswith("A_1")]
    assert len(uids) == 2


def test_the_name_of_the_file_selects_the_format(run, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "m.yaml").write_text(mission_text())
    assert format_of("x.sdoc") == "sdoc"
    run("check", "m.yaml", "--report", "x.sdoc")
    assert (tmp_path / "x.sdoc").read_text().startswith("[DOCUMENT]\nTITLE: requirements and results")
