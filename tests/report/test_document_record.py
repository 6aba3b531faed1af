"""The document that a report is: change record, repository, inputs; ids of requirements, verification and sources."""

from hashlib import sha256
from pathlib import Path

import pytest

import bisar_budget as bb
from bisar_budget.faults import MissionError
from bisar_budget.findings.mission import Report
from bisar_budget.mission.inputs import input_files
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.work_tree import WorkTree
from bisar_budget.report import Style, render
from bisar_budget.report.answers import written
from bisar_budget.report.compliance.summary import compliance
from tests.conftest import ROOT, findings, found_in, mission_text
from tests.page import read_page
from tests.report.test_report_compliance import LANGUAGES, facts, illustrated, lines, page_of, plain, table_with

CHANGES = [
    {"issue": "A", "date": "2026-05-04", "what": "First issue"},
    {"issue": 2, "date": "2026-11-26", "what": "GNSS receiver | replaced"},
]
DOCUMENT = {"number": "SYS-12", "issue": "2", "applicable": ["ECSS-E-ST-10C", "SYS-REQ-7"], "changes": CHANGES}
LOGGED = ROOT / "specs" / "missions" / "sentinel1_aircraft_log.yaml"
BOARD = Path(__file__).parent / "board.yaml"


@pytest.mark.parametrize("language", LANGUAGES)
def test_change_record_and_applicable_documents(language: str) -> None:
    page = page_of(language, findings(document=DOCUMENT))
    record = table_with(page, "issue", "date", "change")
    assert record == [["A", "2026-05-04", "First issue"], ["2", "2026-11-26", "GNSS receiver | replaced"]]
    assert "ECSS-E-ST-10C; SYS-REQ-7" in page.text


@pytest.mark.parametrize(
    ("document", "key", "problem"),
    [
        ({"changes": [{"issue": "A", "date": "2026-13-04", "what": "x"}]}, "document.changes[0].date", "calendar"),
        ({"changes": [{"issue": "A", "date": "2026-05-04"}]}, "document.changes[0].what", "is missing"),
        ({"changes": {"issue": "A"}}, "document.changes", "must be a list"),
        ({"applicable": "ECSS"}, "document.applicable", "must be a list"),
        ({"applicable": ["ECSS", "ECSS"]}, "document.applicable[1]", "twice"),
        ({"applicable": [""]}, "document.applicable[0]", "must not be empty"),
        ({"change": []}, "document.change", "is not a known key"),
    ],
)
def test_faults_of_the_document_have_their_place(document: dict[str, object], key: str, problem: str) -> None:
    with pytest.raises(MissionError) as caught:
        parse_mission(mission_text(document=document), "m.yaml")
    (fault,) = caught.value.faults
    assert fault.key == key
    assert problem in fault.problem
    assert fault.line
    assert fault.column


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_input_has_its_digest(language: str) -> None:
    found = found_in(LOGGED)
    files = table_with(page_of(language, found), "input", "file", "sha-256")
    assert [cells[0] for cells in files] == ["mission", "path of the transmitter", "path of the receiver"]
    for (_, name, digest), folder in zip(files, (LOGGED.parent, LOGGED.parent, LOGGED.parent), strict=True):
        assert digest == sha256((folder / name).read_bytes()).hexdigest()


def test_parts_are_inputs() -> None:
    mission = found_in(ROOT / "specs" / "missions" / "uav_stim300.yaml").mission
    parts = {file.name: file for file in input_files(mission) if file.use == "part of the catalogue"}
    assert parts["stim300.yaml"].digest == sha256((ROOT / "specs/sensors/stim300.yaml").read_bytes()).hexdigest()
    assert parts["stim300.yaml"].path == ""


@pytest.mark.parametrize(
    ("state", "words"),
    [
        (WorkTree(reason="not in a git repository"), "not in a git repository"),
        (WorkTree("0123abc"), "commit 0123abc, clean"),
        (WorkTree("0123abc", changed=("a", "b")), "commit 0123abc, not clean, 2 files changed since"),
        (WorkTree("0123abc", new_inputs=("m.yaml",)), "commit 0123abc, inputs never committed: m.yaml"),
    ],
)
def test_the_repository_of_the_mission(state: WorkTree, words: str) -> None:
    found = findings()
    report = Report("1.2.3", (found,), work_trees={found.file: state})
    assert ("Repository", words) in facts(compliance(report, Style()), "facts")


def test_the_command_names_the_commit_or_that_there_is_none(run, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("m.yaml").write_text(mission_text(), encoding="utf-8")
    assert "not in a git repository" in run("check", "m.yaml", "--format", "html").stdout


def test_the_verification_is_what_was_done() -> None:
    document = compliance(Report("1", (illustrated(),)), Style())
    (line,) = lines(document, "Requirement", "Verification")
    assert plain(line["Verification"]) == "analysis, image (1 confirmed)"
    document = compliance(Report("1", (findings(requirements={"islr": "-20 dB"}),)), Style())
    methods = [plain(line["Verification"]) for line in lines(document, "Requirement", "Verification")]
    assert methods[-1] == "none"


def test_who_declares_what_from_which_source() -> None:
    document = compliance(Report("1", (found_in(BOARD),)), Style())
    shown = {tuple(map(plain, line.values())) for line in lines(document, "Platform", "Source")}
    assert ("transmitter", "lever arm", "survey of the aircraft") in shown
    assert ("both platforms", "position, velocity, acceleration", "GNSS") in shown
    assert ("clock", "timing", "the mission file") in shown
    assert any(owner == "receiver" and source == "no source stated" for owner, _, source in shown)


def test_ids_of_the_project_have_a_column() -> None:
    document = compliance(Report("1", (found_in(BOARD),)), Style())
    ids = {plain(line["Requirement"]): plain(line["Id"]) for line in lines(document, "Id", "Requirement", "Limit")}
    named = {
        name: next(own for words, own in ids.items() if words.startswith(name))
        for name in ("Location error", "ISLR", "PSLR")
    }
    assert named == {"Location error": "SYS-042", "ISLR": "SYS-043", "PSLR": "–"}


def test_the_overview_has_the_smallest_margin_of_each_requirement() -> None:
    missions = [found_in(ROOT / "specs" / "missions" / f"{name}.yaml") for name in ("circling_drone", "astra_drone")]
    text = render("html", Report("1", tuple(missions)), Style())
    margins = {cells[0]: cells[1:] for cells in table_with(read_page(text), "requirement", "largest use", "mission")}
    assert margins["Location error"][0] == "148 %"
    assert margins["Location error"][3] == missions[0].name
    assert margins["Quadratic phase error"][3] == missions[1].name


def test_a_requirement_that_nothing_judges_follows_the_smallest_margins() -> None:
    """It was left out, as if it were not required."""
    quiet = findings(requirements__location_error="10 m", requirements__islr="-20 dB")
    judged = found_in(ROOT / "specs" / "missions" / "uav_stim300.yaml")
    text = render("html", Report("1", (quiet, judged)), Style())
    margins = table_with(read_page(text), "requirement", "largest use", "mission")
    of_islr = [cells[1:5] for cells in margins if cells[0] == "ISLR"]
    assert of_islr[0][0].endswith("%")
    assert of_islr[0][3] == judged.name
    assert of_islr[1] == ["not evaluated", "–", "–", quiet.name]
    assert margins[-1][0] == "ISLR"


@pytest.mark.parametrize("names", [["tandem_x"], ["tandem_x", "astra_drone"]])
def test_contents_have_more_than_one_entry(names: list[str]) -> None:
    missions = [bb.load(ROOT / "specs" / "missions" / f"{name}.yaml") for name in names]
    answers = [bb.sensitivity(mission, date="2026-01-01").found for mission in missions]
    text = str(written("sensitivity", "html", answers, Style()))
    assert ("Contents" in text) == (len(names) > 1)
