"""Every answer in every format: it is written, can be read, and says the same as the JSON document."""

import csv
import io
import json
import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from openpyxl import load_workbook

import bisar_budget as bb
from bisar_budget.report import Style
from bisar_budget.report import document as doc
from bisar_budget.report.answers import ANSWERS, Records, format_of_file, module_of, written
from bisar_budget.report.renderers.markdown import markdown
from bisar_budget.report.renderers.text import text as terminal_text
from bisar_budget.report.renderers.xlsx import workbook
from tests.conftest import COMPLIES, ROOT, UAV_FREE_RUNNING, mission_text
from tests.page import read_page

MISSIONS = ROOT / "specs" / "missions"
TIME = "collection.aperture_time"
ORBIT = MISSIONS / "sentinel1_elements_besancon.yaml"
HOSTILE = "=1+1 | <b> `x`"


@cache
def answers() -> Mapping[str, Any]:
    """Results of the Python interface by the name of the command."""
    named = bb.loads(mission_text(name=HOSTILE, **COMPLIES))
    return {
        "solve": bb.solve(named, TIME),
        "sensitivity": bb.sensitivity(named),
        "allocate": bb.allocate(bb.load(UAV_FREE_RUNNING)),
        "passes": bb.passes(bb.load(ORBIT), "2021-03-19", days=1),
        "verify": bb.verify(named, "receiver.velocity.*"),
        "sweep": bb.sweep(named, {TIME: bb.linspace("1 s", "5 s", 3)}),
        "monte_carlo": bb.monte_carlo(named, 1000),
    }


CELLS = [(command, name) for command, form in ANSWERS.items() if command != "diff" for name in form.formats]


@pytest.mark.parametrize(("command", "format_name"), CELLS)
def test_every_answer_is_written_in_every_format_the_same_twice(command: str, format_name: str) -> None:
    given = answers()[command].answers
    content = written(command, format_name, given, Style())
    assert content == written(command, format_name, given, Style())
    assert isinstance(content, bytes) == (format_name == "xlsx")
    if isinstance(content, str):
        assert content.endswith("\n")
        assert not re.search("[\x00-\x09\x0b-\x1f\x7f\u202a-\u202e]", content)


def test_each_answer_of_a_command_is_here() -> None:
    assert answers().keys() | {"diff"} == ANSWERS.keys()


@pytest.mark.parametrize("command", [command for command in ANSWERS if command != "diff"])
def test_a_result_of_python_writes_the_same_as_the_command(command: str, tmp_path: Path) -> None:
    result = answers()[command]
    found = result.to_dict()
    assert found.get("format", "bisar-budget/monte_carlo/1") == f"bisar-budget/{command}/1"
    for suffix in (".json", ".csv", ".html", ".md", ".txt", ".xlsx"):
        result.report(tmp_path / f"{command}{suffix}")
    assert json.loads((tmp_path / f"{command}.json").read_text("utf-8")).items() >= found.items()
    page = (tmp_path / f"{command}.html").read_text("utf-8")
    assert page.startswith("<!DOCTYPE html>")
    assert "<script" not in page
    assert len(list(read_page(page).all("table"))) + page.count("<dl") >= 1
    pictures = re.findall(r"!\[[^\]]*\]\(([^)]+)\)", (tmp_path / f"{command}.md").read_text("utf-8"))
    assert all((tmp_path / picture).is_file() for picture in pictures)
    assert bool(pictures) == (command in ("sensitivity", "allocate", "passes", "sweep"))
    with pytest.raises(ValueError, match=r"the suffix must be one of \.txt, \.json, \.csv"):
        result.report(tmp_path / f"{command}.docx")


@pytest.mark.parametrize("command", [command for command in ANSWERS if command not in ("diff", "sweep")])
def test_csv_and_data_frame_have_the_same_lines(command: str) -> None:
    result = answers()[command]
    frame = result.to_dataframe("polars")
    rows = list(csv.DictReader(io.StringIO(str(written(command, "csv", result.answers, Style())))))
    assert list(frame.columns) == list(rows[0])
    assert len(rows) == frame.height >= 1


def test_the_numbers_of_a_workbook_are_those_of_the_json_document() -> None:
    result = answers()["sensitivity"]
    book = load_workbook(io.BytesIO(bytes(written("sensitivity", "xlsx", result.answers, Style()))))
    assert book.sheetnames[0] == "Answer"
    assert {"Numbers", "Data"} <= {*book.sheetnames}
    head, *lines = [[cell.value for cell in line] for line in book["Data"].iter_rows()]
    (mission,) = result.to_dict()["missions"]
    assert len(lines) == len(mission["numbers"])
    for line, number in zip(lines, mission["numbers"], strict=True):
        assert dict(zip(head, line, strict=True))["utilization_change"] == pytest.approx(
            number["utilization_change"], rel=1e-14
        )


@pytest.mark.parametrize("command", [command for command in ANSWERS if command != "diff"])
def test_another_reader_of_workbooks_reads_the_same(command: str) -> None:
    """Calamine shares no code with openpyxl, which writes the workbooks."""
    calamine = pytest.importorskip("python_calamine")
    content = bytes(written(command, "xlsx", answers()[command].answers, Style()))  # type: ignore[arg-type]
    book, other = load_workbook(io.BytesIO(content)), calamine.CalamineWorkbook.from_filelike(io.BytesIO(content))
    assert other.sheet_names == book.sheetnames
    for sheet in book:
        values = [[cell.value for cell in line] for line in sheet.iter_rows()]
        read = other.get_sheet_by_name(sheet.title).to_python(skip_empty_area=False)
        assert [[None if value == "" else value for value in line] for line in read] == values


def test_a_text_that_looks_like_a_formula_stays_a_text_in_a_workbook() -> None:
    """A name such as `=1+1` would be computed by the program that opens the workbook."""
    book = load_workbook(io.BytesIO(bytes(written("solve", "xlsx", answers()["solve"].answers, Style()))))
    cells = [cell for sheet in book for line in sheet.iter_rows() for cell in line if isinstance(cell.value, str)]
    assert any(cell.value == HOSTILE for cell in cells)
    assert {cell.data_type for cell in cells} == {"s"}


def test_the_answer_about_a_check_is_a_workbook_too(run, tmp_path: Path) -> None:
    path = MISSIONS / "uav_stim300.yaml"
    for name in ("a.xlsx", "b.xlsx"):
        assert run("check", path, "-q", "--report", tmp_path / name).exit_code == 0
    assert (tmp_path / "a.xlsx").read_bytes() == (tmp_path / "b.xlsx").read_bytes()
    book = load_workbook(tmp_path / "a.xlsx")
    head, *lines = [[cell.value for cell in line] for line in book["Data"].iter_rows()]
    rows = [dict(zip(head, line, strict=True)) for line in lines]
    document = bb.check(bb.load(path)).to_dict()["missions"][0]
    assert {row["id"]: row["status"] for row in rows if row["kind"] == "row"} == {
        row["id"]: row["status"] for row in document["rows"]
    }
    result = run("check", path, "--format", "xlsx")
    assert result.exit_code == 2
    assert "--format xlsx needs -o FILE." in result.stderr


def test_a_workbook_needs_a_file_and_its_package(run, monkeypatch, tmp_path: Path) -> None:
    path = MISSIONS / "rigling_moses_section_v.yaml"
    result = run("solve", path, "--for", TIME, "--format", "xlsx")
    assert (result.exit_code, "--format xlsx needs -o FILE." in result.stderr) == (2, True)
    monkeypatch.setattr("bisar_budget.report.renderers.xlsx.find_spec", lambda name: None)
    result = run("solve", path, "--for", TIME, "-o", tmp_path / "t.xlsx")
    assert result.exit_code == 2
    assert "xlsx needs openpyxl, which is not installed; pip install openpyxl brings it" in result.stderr
    assert not (tmp_path / "t.xlsx").exists()


@pytest.mark.parametrize(
    ("name", "format_name"), [("a.json", "json"), ("a.MD", "markdown"), ("a.needs.json", None), ("a.b.xlsx", "xlsx")]
)
def test_the_suffix_gives_the_format(name: str, format_name: str | None) -> None:
    assert format_of_file("solve", name) == (format_name or "json")
    assert format_of_file("allocate", "a.needs.json") == "needs"
    assert format_of_file("solve", "a.docx") is None


def test_the_suffix_of_an_output_gives_its_format(run, tmp_path: Path) -> None:
    path, target = MISSIONS / "rigling_moses_section_v.yaml", tmp_path / "t.json"
    assert run("solve", path, "--for", TIME, "-o", target).exit_code == 0
    assert json.loads(target.read_text("utf-8"))["format"] == "bisar-budget/solve/1"
    result = run("solve", path, "--for", TIME, "-o", tmp_path / "t.docx")
    assert (result.exit_code, "the suffix must be one of .txt, .json" in result.stderr) == (2, True)
    assert run("solve", path, "--for", TIME, "-o", tmp_path / "limits").exit_code == 0
    assert (tmp_path / "limits").read_text("utf-8").startswith("collection.aperture_time: complies")


def test_the_comparison_of_two_missions_in_every_format(run, tmp_path: Path) -> None:
    old, new = MISSIONS / "rigling_moses_section_v.yaml", MISSIONS / "uav_stim300.yaml"
    found = json.loads(run("diff", old, new, "--format", "json").stdout)
    lines = list(csv.DictReader(io.StringIO(run("diff", old, new, "--format", "csv").stdout)))
    changed = [line["id"] for line in lines if line["kind"] == "row"]
    assert changed == [row["id"] for row in found["missions"][0]["rows"]]
    assert [line["id"] for line in lines if line["kind"] == "loosened"]
    page = run("diff", old, new, "--format", "html").stdout
    assert all(row in read_page(page).text for row in changed[:3])
    assert run("diff", old, new, "-o", tmp_path / "d.xlsx").exit_code == 0
    assert "Data" in load_workbook(tmp_path / "d.xlsx").sheetnames


# ---------------------------------------------------------------------- the renderers
TABLE = doc.TextTable(
    "Things",
    "Things of a kind",
    [doc.Head("thing"), doc.Head("size", "number", "m"), doc.Head("page", medium=doc.PAGE), doc.Head("status")],
    [[doc.Name("a.long.name"), "–", "only there", doc.Badge("fail")], ["b", "12", "x", doc.Badge("pass")]],
)
DOCUMENT = doc.AnswerDocument(
    "1",
    "subject",
    doc.Facts([("Tool", "t")]),
    [],
    [doc.Chapter("Title", [TABLE, doc.Only(doc.TERMINAL, [doc.Paragraph("here only")]), doc.Items([["→ a"]])])],
    title="Kind",
)


def test_a_terminal_has_its_columns_hyphens_and_colours() -> None:
    assert terminal_text(DOCUMENT, Style()).splitlines() == [
        "thing       size status",
        "               m",
        "a.long.name    - FAIL",
        "b             12 pass",
        "",
        "here only",
        "",
        "→ a",
    ]
    coloured = terminal_text(DOCUMENT, Style(color=True))
    assert "\x1b[1;31mFAIL\x1b[0m" in coloured
    assert "\x1b[32mpass\x1b[0m" in coloured


def test_a_page_has_its_columns_dashes_and_units() -> None:
    text = markdown(DOCUMENT, "")
    assert "| Thing | Size \\[m\\] | Page | Status |" in text
    assert "| a.long.name | – | only there | fail |" in text
    assert "here only" not in text


def test_a_name_that_is_too_long_has_a_line_of_its_own() -> None:
    rows = [
        [doc.Name("x" * 75), "12 m", "decided by the sentence that is written here in full"],
        ["y", "3 m", "short"],
    ]
    table = doc.TextTable("", "", doc.heads("thing", *doc.numbers("size"), "why"), rows)
    document = doc.AnswerDocument("1", "", doc.Facts([]), [], [doc.Chapter("", [table])])
    lines = terminal_text(document, Style()).splitlines()
    assert all(len(line) <= 80 for line in lines)
    assert lines[1] == "x" * 75
    assert "    decided by the sentence that is written here in full" in lines or lines[2].endswith("in full")


def test_a_workbook_has_a_sheet_for_each_table() -> None:
    book = load_workbook(io.BytesIO(workbook(DOCUMENT, Records(("a", "b"), [{"a": 1.5, "b": "x"}, {"a": None}]))))
    assert book.sheetnames == ["Answer", "Things", "Data"]
    assert [cell.value for cell in book["Things"][1]] == ["thing", "size [m]", "page", "status"]
    assert [cell.value for cell in book["Data"][2]] == [1.5, "x"]


@pytest.mark.parametrize("command", ANSWERS)
def test_the_module_of_an_answer_has_its_functions(command: str) -> None:
    module = module_of(command)
    for name in ("content", "records", "document", *(f"as_{own}" for own in ANSWERS[command].own_formats)):
        assert callable(getattr(module, name)), name
