"""Requirements written back as a requirements file, with their status."""

import csv
import io
import math

import pytest

import bisar_budget as bb
from bisar_budget.mission.load import load_mission
from bisar_budget.report import format_of
from tests.conftest import mission_text

COLUMNS = [
    *("id", "text", "key", "limit", "status", "reached", "use", "decided_by"),
    *("file", "finding", "overrides", "confidence"),
]
REQUIREMENTS = """id,text,key,limit,owner
SYS-042,"The image, as a whole, shall be located within 1 mm.",location_error,1.0 mm,A
SYS-043,,location_error,1 mm,B
SYS-012,Velocity shall be known.,receiver.velocity.x,,
SYS-050,,declare,"position, velocity",
,=1+1,,,
,,pslr,-30 dB,
"""


@pytest.fixture
def mission(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "reqs.csv").write_text(REQUIREMENTS.replace(",=1+1,,,\n", ""))
    path = tmp_path / "m.yaml"
    path.write_text(
        mission_text(
            requirements={"file": "reqs.csv"},
            allocation={"combine": "rss", "model": "full"},
            platforms__receiver__motion_error={"position": "1 m", "velocity": "1 mm/s"},
        )
    )
    return path


def lines(text: str) -> list[dict[str, str]]:
    reader = csv.DictReader(io.StringIO(text))
    assert reader.fieldnames == COLUMNS
    return list(reader)


def test_has_a_line_for_each_id_and_each_requirement(run, mission) -> None:
    written = lines(run("check", mission.name, "--format", "requirements").stdout)
    assert [(line["id"], line["key"], line["limit"]) for line in written] == [
        ("", "quadratic_phase_error", "45 deg"),
        ("SYS-042", "location_error", "1.0 mm"),
        ("SYS-043", "location_error", "1.0 mm"),
        ("", "pslr", "-30 dB"),
        ("SYS-050", "declare", "position, velocity"),
        ("SYS-012", "receiver.velocity.x", ""),
    ]
    located = written[1]
    assert located["text"] == "The image, as a whole, shall be located within 1 mm."
    assert located["status"] == "fail"
    assert located["reached"].endswith(" mm")
    assert located["use"].endswith(" %")
    assert located["decided_by"] == "mission.location_error"
    assert {line["file"] for line in written} == {"m.yaml"}
    assert written[3]["reached"] == written[3]["use"] == ""
    assert written[5]["reached"] == "1 mm/s"


def test_reads_back_as_the_same_mission(run, mission) -> None:
    before = load_mission(str(mission))
    run("check", mission, "--report", "status.requirements.csv")
    mission.write_text(mission.read_text().replace("reqs.csv", "status.requirements.csv"))
    after = load_mission(str(mission))
    assert after.requirements._replace(file=None) == before.requirements._replace(file=None)
    assert after.requirement_ids == before.requirement_ids
    assert after.requirement_texts == before.requirement_texts


def test_of_several_missions_and_a_broken_one(run, mission, tmp_path) -> None:
    (tmp_path / "n.yaml").write_text(mission.read_text())
    (tmp_path / "o.yaml").write_text("name: broken\n")
    text = run("check", "m.yaml", "n.yaml", "o.yaml", "--format", "requirements").stdout
    written = lines(text)
    assert [line["status"] for line in written if line["file"] == "o.yaml"] == ["error"]
    assert len(written) == 13
    (tmp_path / "status.csv").write_text(text)
    mission.write_text(mission.read_text().replace("reqs.csv", "status.csv"))
    assert load_mission(str(mission)).requirement_ids["requirement.location_error"] == ("SYS-042", "SYS-043")


def test_limits_that_no_file_states_have_all_digits(run, mission) -> None:
    options = ("--set", "requirements.location_error=1 m", "--set", "requirements.quadratic_phase_error=0.1 rad")
    limits = {
        line["key"]: line["limit"]
        for line in lines(run("check", mission, *options, "--format", "requirements").stdout)
    }
    assert limits["location_error"] == "1.0 m"
    assert bb.load(str(mission)).replace(
        {"requirements.quadratic_phase_error": limits["quadratic_phase_error"]}
    ).requirements.quadratic_phase_error == pytest.approx(0.1, rel=1e-15)
    assert math.isclose(float(limits["quadratic_phase_error"].removesuffix(" deg")), math.degrees(0.1))


def test_the_name_of_the_file_selects_the_format() -> None:
    assert format_of("out.requirements.csv") == "requirements"
    assert format_of("requirements.csv") == "requirements"
    assert format_of("out.csv") == format_of("my_requirements.csv") == "csv"


def test_text_that_a_spreadsheet_would_run_is_text(run, mission) -> None:
    mission.write_text(
        mission_text(requirement_ids={"receiver.velocity.x": "=1+1"}, requirement_texts={"=1+1": "@x"})
    )
    (line,) = [line for line in lines(run("check", mission, "--format", "requirements").stdout) if line["id"]]
    assert (line["id"], line["text"]) == ("'=1+1", "'@x")
    run("check", mission, "--report", "back.requirements.csv")
    mission.write_text(mission_text(requirements={"file": "back.requirements.csv"}))
    assert load_mission(str(mission)).requirement_texts == {"=1+1": "@x"}
