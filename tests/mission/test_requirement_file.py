"""Requirements of a mission from a CSV file."""

import json
import math
import re
import subprocess
from pathlib import Path

import jsonschema
import pytest
import yaml

from bisar_budget.cli.touched import touched_missions
from bisar_budget.faults import MissionError
from bisar_budget.mission.changes import read_changes
from bisar_budget.mission.edited import in_folder
from bisar_budget.mission.load import load_mission, named_by
from bisar_budget.mission.model import mission_schema
from bisar_budget.mission.requirement_file import read_requirement_lines
from tests.conftest import mission_text

CSV = """id,text,key,limit,owner
SYS-042,"The image, as a whole, shall be located within 5 m.",location_error,5 m,A. Writer

SYS-043,,location_error,5000 mm,
SYS-012 , Velocity shall be known. , receiver.velocity.x ,,
SYS-050,,declare,"position, velocity",
,,islr,-20 dB,
"""
SAME = {
    "requirements": {"location_error": "5 m", "declare": ["position", "velocity"], "islr": "-20 dB"},
    "requirement_ids": {
        "requirement.location_error": ["SYS-042", "SYS-043"],
        "receiver.velocity.x": "SYS-012",
        "requirement.declare": "SYS-050",
    },
    "requirement_texts": {
        "SYS-042": "The image, as a whole, shall be located within 5 m.",
        "SYS-012": "Velocity shall be known.",
    },
}

OWN = {"requirement_ids": SAME["requirement_ids"], "requirement_texts": SAME["requirement_texts"]}


@pytest.fixture
def stated(tmp_path, monkeypatch):
    """Function that writes a mission and its requirements file, and returns the path of the mission."""
    monkeypatch.chdir(tmp_path)

    def write(csv: str | bytes = CSV, **keys: object) -> Path:
        (tmp_path / "missions").mkdir(exist_ok=True)
        (tmp_path / "missions" / "reqs.csv").write_bytes(csv.encode() if isinstance(csv, str) else csv)
        path = tmp_path / "missions" / "m.yaml"
        path.write_text(mission_text(**{"requirements": {"file": "reqs.csv"}, **keys}))
        return path

    return write


def faults(path: Path) -> list[str]:
    with pytest.raises(MissionError) as refusal:
        load_mission(str(path))
    return [str(fault) for fault in refusal.value.faults]


def the_same(path: Path, tmp_path: Path) -> None:
    other = tmp_path / "same.yaml"
    other.write_text(mission_text(**SAME))
    mission, same = load_mission(str(path)), load_mission(str(other))
    assert mission.requirements._replace(file=None) == same.requirements
    assert mission.requirement_ids == same.requirement_ids
    assert mission.requirement_texts == same.requirement_texts


class TestForms:
    @pytest.mark.parametrize(
        "csv",
        [
            CSV,
            CSV.replace("\n", "\r\n"),
            "\ufeff" + CSV,
            CSV.rstrip("\n"),
            "\n,,,,\n" + CSV,
            CSV.replace("id,text,key,limit", " ID , Text,KEY, Limit "),
            CSV.replace("receiver.velocity.x ,,", "receiver.velocity.x"),
            CSV.replace("location_error,5 m", "requirement.location_error,5 m"),
            CSV.replace('"position, velocity"', '"[position, velocity]"').replace(",-20 dB", ",'-20 dB"),
            CSV.replace("The image, as", '""The image""\nas').replace('""', "").replace("image\nas", "image,\nas"),
        ],
        ids=[
            "plain",
            "dos",
            "bom",
            "no_end",
            "blank_first",
            "header",
            "short",
            "id_of_requirement",
            "quoted",
            "break",
        ],
    )
    def test_give_the_mission_of_the_keys(self, stated, tmp_path, csv) -> None:
        the_same(stated(csv), tmp_path)

    def test_semicolons(self, stated, tmp_path) -> None:
        lines = [
            "id;text;key;limit",
            "SYS-042;The image, as a whole, shall be located within 5 m.;location_error;5 m",
            "SYS-043;;location_error;5 m;",
            "SYS-012;Velocity shall be known.;receiver.velocity.x",
            "SYS-050;;declare;position velocity",
            ";;islr;-20 dB",
        ]
        the_same(stated("\n".join(lines)), tmp_path)

    def test_quotation_marks_within_a_text(self, stated) -> None:
        mission = load_mission(str(stated('id,text,key,limit\nA,"He said ""5 m"".",location_error,5 m\n')))
        assert mission.requirement_texts == {"A": 'He said "5 m".'}


class TestBesideKeys:
    def test_other_keys_are_added(self, stated) -> None:
        path = stated(
            requirements={"file": "reqs.csv", "pslr": "-30 dB", "location_error": "0.005 km"},
            requirement_ids={"requirement.location_error": "OWN-1", "requirement.pslr": ["OWN-2"]},
            requirement_texts={"OWN-1": "a text"},
        )
        mission = load_mission(str(path))
        assert mission.requirements.pslr == -30
        assert mission.requirements.location_error == 5
        assert mission.requirement_ids["requirement.location_error"] == ("OWN-1", "SYS-042", "SYS-043")
        assert mission.requirement_ids["requirement.pslr"] == ("OWN-2",)
        assert mission.requirement_texts["OWN-1"] == "a text"

    def test_the_same_id_in_both_counts_once(self, stated) -> None:
        mission = load_mission(str(stated(requirement_ids={"requirement.location_error": ["SYS-043", "SYS-042"]})))
        assert mission.requirement_ids["requirement.location_error"] == ("SYS-043", "SYS-042")

    def test_another_limit_is_a_fault(self, stated) -> None:
        path = stated(requirements={"file": "reqs.csv", "location_error": "6 m"})
        assert faults(path) == [
            f"requirements.location_error: is {limit} (got 6 m); accepted: one of the two, or the same limit"
            for limit in ("5 m in reqs.csv:2", "5000 mm in reqs.csv:4")
        ]

    def test_another_text_is_a_fault(self, stated) -> None:
        (fault,) = faults(stated(requirement_texts={"SYS-042": "another"}))
        assert fault.startswith("requirement_texts.SYS-042: is another text in reqs.csv:2 (got another)")

    def test_a_fault_of_the_mission_is_its_own(self, stated) -> None:
        assert len(faults(stated(requirements={"file": "reqs.csv", "location_error": "6 kg"}))) == 1
        assert len(faults(stated(requirement_ids={"requirement.location_error": {"A": "B"}}))) == 1
        assert "must be a mapping" in faults(stated(requirement_ids="A"))[0]
        assert "must be text" in faults(stated(requirements={"file": ["reqs.csv"]}))[0]

    def test_options_replace_the_file(self, stated, run) -> None:
        path = stated()
        changed = load_mission(str(path)).replace({"requirements.location_error": "7 m"})
        assert changed.requirements.location_error == 7
        assert load_mission(str(path)).replace({"requirements.islr": None}).requirements.islr is None
        ids = load_mission(str(path)).replace({"requirement_ids.requirement.location_error": "X"}).requirement_ids
        assert ids["requirement.location_error"] == ("X",)
        (path.parent / "tight.csv").write_text("id,text,key,limit\nT,,location_error,1 m\n")
        mission = load_mission(str(path)).replace({"requirements.file": "tight.csv"})
        assert (mission.requirements.location_error, mission.requirements.islr) == (1, None)
        assert mission.line(("requirements", "location_error")) is None
        swept = run("sweep", path, "--vary", "requirements.location_error=1m:3m:3")
        assert swept.exit_code < 2, swept.output


def test_a_requirement_has_the_line_of_the_file_and_its_unit(stated, run) -> None:
    path = stated("id,text,key,limit\nA,,location_error,5000 mm\n")
    (mission,) = json.loads(run("check", path, "--format", "json").stdout)["missions"]
    (required,) = [each for each in mission["requirements"] if each["key"] == "location_error"]
    assert required["line"] == 1 + path.read_text().splitlines().index("  file: reqs.csv")
    assert not required["is_default"]
    assert "5000 mm" in run("check", path).stdout


def test_an_id_of_no_row_is_a_warning(stated, run) -> None:
    output = run("check", stated(CSV.replace("velocity.x", "velocity.w"))).output
    assert "no row or requirement has the id receiver.velocity.w" in re.sub(r"\s+", " ", output)


class TestFaults:
    @pytest.mark.parametrize(
        ("line", "fault"),
        [
            ("A,,location_error,5 kg", "2:19: limit: has the unknown unit 'kg' (got 5 kg); accepted: a length in m"),
            ("A,,location_error,-5 m", "2:19: limit: must be greater than 0 m (got -5 m)"),
            ("A, ,location_error,  5", ""),
            ("A,,islr,1 dB", "2:9: limit: must be less than 0 dB (got 1 dB)"),
            (
                "A,,location_eror,5 m",
                "2:4: key: is no key of requirements, and no id of a row (got location_eror); acc",
            ),
            ("A,,file,x.csv", "2:4: key: is no key of requirements"),
            ("A,,,5 m", "2:4: key: is missing; accepted: quadratic_phase_error, "),
            ("A,,receiver.velocity.x,5 m/s", "2:24: limit: receiver.velocity.x is the id of a row"),
            (",,receiver.velocity.x,", "2:1: id: is missing"),
            (",Text,location_error,5 m", "2:1: id: is missing"),
            ("A,,location_error,", "2:19: limit: location_error has no limit; accepted: a limit with its unit"),
            ("A,,declare", "2:11: limit: declare has no limit"),
            ("A,,declare,positon", "2:12: limit: is not a known choice"),
            (
                "A,,location_error,5 m\nB,,location_error,6 m",
                "3:19: limit: location_error has another limit in line 2, 5 m",
            ),
            ("A,a,location_error,5 m\nA,b,pslr,-3 dB", "3:3: text: A has another text in line 2 (got b)"),
            ("A,a,location_error,5 m\nA,,location_error,", ""),
            ("A,The image, as is,location_error,5 m", "2:"),
            ("A,,location_error,5 m,x", "2:23: is a cell beyond the 4 columns of the first line (got x)"),
            ('A,"Never closed,location_error,5 m', "2:3: begins with a quotation mark"),
            ("A\x07,,location_error,5 m", "2:1: id: must be one line of printable text"),
            (f"A,{4001 * 'x'},location_error,5 m", "2:3: text: must be at most 4000 characters"),
        ],
    )
    def test_name_the_cell(self, stated, line, fault) -> None:
        path = stated(f"id,text,key,limit\n{line}\n")
        if not fault:
            load_mission(str(path))
            return
        first, *_ = faults(path)
        assert first.startswith(f"requirements.file: reqs.csv:{fault}")

    def test_a_quoted_break_counts_as_a_line(self, stated) -> None:
        (fault,) = faults(
            stated('id,text,key,limit\nA,"a\nb",location_error,5 m\nB,,islr,1 dB\nC,"c\r\nd",pslr,2 dB\n')
        )[:1]
        assert fault.startswith("requirements.file: reqs.csv:4:9: limit: ")
        assert faults(stated('id,text,key,limit\nA,"a\nbc",islr,1 dB\n'))[0].startswith(
            "requirements.file: reqs.csv:3:10: "
        )

    @pytest.mark.parametrize("level", ["95 %", "0.95"])
    def test_a_confidence_is_that_of_the_limit(self, stated, level) -> None:
        needs = load_mission(
            str(stated(f"id,text,key,limit,confidence\nA,,location_error,5 m,{level}\n"))
        ).requirements
        assert (needs.location_error, needs.confidence_of("location_error")) == (5.0, 0.95)
        needs = load_mission(str(stated("id,text,key,limit,confidence\nA,,location_error,5 m,\n"))).requirements
        assert (needs.location_error, needs.confidence_of("location_error")) == (5.0, None)

    def test_a_confidence_may_stand_beside_the_default_limit(self, stated) -> None:
        needs = load_mission(
            str(stated("id,text,key,limit,confidence\nA,,quadratic_phase_error,,90 %\n"))
        ).requirements
        assert needs.quadratic_phase_error == math.pi / 4
        assert needs.confidence_of("quadratic_phase_error") == 0.9

    @pytest.mark.parametrize(
        ("line", "fault"),
        [
            ("A,,location_error,5 m,95", "2:23: confidence: must be a probability from 50 % to 99.9999 % (got 95)"),
            ("A,,location_error,5 kg,95 %", "2:19: limit: has the unknown unit 'kg'"),
            (
                "A,,islr,-20 dB,95 %",
                "2:16: confidence: islr is an expectation over all errors, and has no confidence",
            ),
            ("A,,cubic_phase_error,,95 %", "2:22: limit: is missing"),
            ("A,,declare,position,95 %", "2:21: confidence: declare has no confidence"),
            ("A,,receiver.velocity.x,,95 %", "2:25: confidence: receiver.velocity.x has no confidence"),
        ],
    )
    def test_a_confidence_that_cannot_be_used_names_its_cell(self, stated, line, fault) -> None:
        (first, *_) = faults(stated(f"id,text,key,limit,confidence\n{line}\n"))
        assert first.startswith(f"requirements.file: reqs.csv:{fault}")

    @pytest.mark.parametrize(
        ("csv", "fault"),
        [
            ("", "reqs.csv: is empty. A first line with the columns id, text, key, limit"),
            ("\n \n,,,\n", "reqs.csv: is empty"),
            ("id,text,key\n", "reqs.csv:1:1: lacks the column limit (got id, text, key); accepted: a first line"),
            ("id,text,key,limt\n", "reqs.csv:1:1: lacks the column limit (got id, text, key, limt); "),
            ("SYS-1,,location_error,5 m\n", "reqs.csv:1:1: lacks the column id, text, key, limit"),
            ("id,text,key,limit,id\n", "reqs.csv:1:19: the column id is there twice (got id)"),
            (b"id,text,key,limit\n\xe4,,islr,-20 dB\n", "reqs.csv:2: is not UTF-8 text (got byte 0xe4)"),
            ("id,text,key,limit\n" + "A,,islr,-20 dB\n" * 4001, "reqs.csv: has more than 4000 lines"),
            ("id,text,key,limit\n" + "x" * (1 << 20), "reqs.csv: is larger than 1024 KiB, so no requirements file"),
        ],
    )
    def test_of_the_whole_file(self, stated, csv, fault) -> None:
        assert faults(stated(csv))[0].startswith(f"requirements.file: {fault}")

    def test_a_missing_file(self, stated) -> None:
        path = stated()
        (path.parent / "reqs.csv").unlink()
        assert faults(path) == ["requirements.file: reqs.csv cannot be read: No such file or directory"]

    def test_all_faults_at_once_in_order(self, stated) -> None:
        path = stated("id,text,key,limit\nA,,islr,1 dB\nB,,pslr,2 dB\n", radar__bandwidth="1 kg")
        assert [fault.partition(":")[0] for fault in faults(path)] == ["radar.bandwidth"] + 2 * ["requirements.file"]

    def test_an_empty_file_without_requirements_is_one(self, stated) -> None:
        assert load_mission(str(stated("id,text,key,limit\n"))).requirement_ids == {}


class TestFilesOfAMission:
    def test_a_changed_file_touches_the_mission(self, stated) -> None:
        path = stated()
        assert touched_missions(["missions/reqs.csv"]) == ["missions/m.yaml"]
        assert touched_missions(["missions/other.csv"]) == []
        (path.parent / "reqs.csv").write_text("nothing")
        assert touched_missions(["missions/other.csv"]) == ["missions/m.yaml"]

    def test_a_revision_has_its_own_file(self, stated, run, tmp_path) -> None:
        path = stated()
        for command in (
            ["init", "-q"],
            ["add", "."],
            ["-c", "user.name=a", "-c", "user.email=a@b", "commit", "-qm", "a"],
        ):
            subprocess.run(["git", "-C", str(tmp_path), *command], check=True)
        (path.parent / "reqs.csv").write_text(CSV.replace("5 m,", "6 m,").replace("5000 mm", "6 m"))
        text = run("diff", path, "--base", "HEAD").stdout
        assert "requirements.location_error: 5 m -> 6 m" in text
        assert "Loosened" in text

    def test_a_machine_without_the_file_gets_it(self, stated) -> None:
        assert [name for name, _ in named_by(load_mission(str(stated()))).paths] == ["reqs.csv"]

    def test_a_mission_that_moves_still_names_it(self, stated, tmp_path) -> None:
        (change,) = in_folder(load_mission(str(stated())), str(tmp_path))
        assert (change.key, change.text) == ("requirements.file", '"missions/reqs.csv"')

    def test_the_schema_takes_it(self) -> None:
        validator = jsonschema.Draft7Validator(mission_schema())
        assert validator.is_valid(yaml.safe_load(mission_text(requirements={"file": "reqs.csv"}, **OWN)))
        assert not validator.is_valid(yaml.safe_load(mission_text(requirements={"file": ["reqs.csv"]})))


def test_lines_are_read_with_their_places() -> None:
    first, *_ = read_requirement_lines(b"id,text,key,limit\n A ,x,islr, -3 dB\n", "x.csv")
    assert [(cell.text, cell.line, cell.column) for cell in first] == [
        ("A", 2, 2),
        ("x", 2, 5),
        ("islr", 2, 7),
        ("-3 dB", 2, 13),
        ("", 2, 18),
    ]


class TestOptionsBesideAConfidence:
    """An option sets the limit or the confidence alone, and the table still states the other one."""

    PLAIN = "id,text,key,limit\nA-1,,location_error,5 m\n"
    BOTH = "id,text,key,limit,confidence\nA-1,,location_error,5 m,95 %\n"

    @pytest.mark.parametrize("csv", [PLAIN, BOTH])
    @pytest.mark.parametrize(
        ("option", "limit", "confidence"),
        [
            ("confidence=99 %", 5.0, 0.99),
            ("limit=7 m", 7.0, 0.95),
            ("confidence=null", 5.0, None),
        ],
    )
    def test_the_other_is_that_of_the_table(self, stated, csv, option, limit, confidence) -> None:
        given = load_mission(str(stated(csv)), changes=read_changes([f"requirements.location_error.{option}"]))
        stays = csv == self.BOTH or not option.startswith("limit")
        needs = given.requirements
        assert needs.location_error == limit
        assert needs.confidence_of("location_error") == (confidence if stays else None)
        assert given.requirement_ids == {"requirement.location_error": ("A-1",)}

    def test_a_file_that_states_the_same_may_be_changed_too(self, stated) -> None:
        both = {"file": "reqs.csv", "location_error": {"limit": "5 m", "confidence": "95 %"}}
        path = str(stated(self.BOTH, requirements=both))
        given = load_mission(path, changes=read_changes(["requirements.location_error.confidence=99 %"]))
        assert given.requirements.confidence_of("location_error") == 0.99

    def test_the_file_may_state_the_confidence_of_a_limit_in_the_table(self, stated) -> None:
        path = stated(self.PLAIN, requirements={"file": "reqs.csv", "location_error": {"confidence": "99 %"}})
        needs = load_mission(str(path)).requirements
        assert (needs.location_error, needs.confidence_of("location_error")) == (5.0, 0.99)

    def test_a_confidence_of_the_file_without_a_limit_agrees_with_the_table(self, stated) -> None:
        alone = {"file": "reqs.csv", "location_error": {"confidence": "0.95"}}
        needs = load_mission(str(stated(self.BOTH, requirements=alone))).requirements
        assert (needs.location_error, needs.confidence_of("location_error")) == (5.0, 0.95)
        (line,) = faults(stated(self.BOTH.replace("95", "90"), requirements=alone))
        assert (
            "requirements.location_error.confidence: is 90 % in reqs.csv:2 (got 0.95); accepted: one of the" in line
        )

    def test_two_different_confidences_are_a_fault(self, stated) -> None:
        both = {"file": "reqs.csv", "location_error": {"limit": "5 m", "confidence": "99 %"}}
        assert any("accepted: one of the two" in line for line in faults(stated(self.BOTH, requirements=both)))

    def test_a_wrong_confidence_is_that_of_the_option(self, stated) -> None:
        with pytest.raises(MissionError, match=r"--set requirements\.location_error\.confidence: must be a"):
            load_mission(str(stated()), changes=read_changes(["requirements.location_error.confidence=9"]))
