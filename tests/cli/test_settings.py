"""Defaults of `check`: command line over environment over pyproject.toml over the tool's own."""

import json

import pytest

from tests.conftest import ROOT, mission_text
from tests.house.test_structure import loaded_after

WARNING = mission_text(timing_error__quadratic=6e-13)  # passes, unless strict


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A folder below one with a pyproject.toml, in which the test runs; returns a writer of the latter."""
    (tmp_path / "missions").mkdir()
    (tmp_path / "missions" / "m.yaml").write_text(WARNING)
    monkeypatch.chdir(tmp_path / "missions")

    def write(text: str) -> None:
        (tmp_path / "pyproject.toml").write_text(text)

    return write


def table(text: str) -> str:
    return f'[project]\nname = "bisar-budget-user"\n\n[tool.bisar-budget]\n{text}\n'


class TestPrecedence:
    def test_project(self, run, project) -> None:
        assert run("check", "m.yaml").exit_code == 0
        project(table("strict = true"))
        assert run("check", "m.yaml").exit_code == 1

    def test_environment_over_project(self, run, project) -> None:
        project(table("strict = true"))
        assert run("check", "m.yaml", env={"BISAR_BUDGET_STRICT": "0"}).exit_code == 0

    def test_command_line_over_both(self, run, project) -> None:
        project(table("strict = true"))
        assert run("check", "m.yaml", "--no-strict", env={"BISAR_BUDGET_STRICT": "1"}).exit_code == 0

    def test_format(self, run, project) -> None:
        project(table('format = "json"'))
        assert run("check", "m.yaml").stdout.startswith("{")
        assert run("check", "m.yaml", env={"BISAR_BUDGET_FORMAT": "csv"}).stdout.startswith("file,")
        assert run("check", "m.yaml", "--format", "text", env={"BISAR_BUDGET_FORMAT": "csv"}).stdout.startswith(
            "WARN m.yaml"
        )

    def test_color_model_and_exit_zero(self, run, project) -> None:
        project(table('color = "always"\nmodel = "published"\nexit-zero = true\nstrict = true'))
        result = run("check", "m.yaml", color=True)
        assert result.exit_code == 0
        assert "\x1b[" in result.stdout
        assert run("check", "m.yaml", "--no-exit-zero").exit_code == 1

    def test_reports_are_relative_to_the_project(self, run, project, tmp_path) -> None:
        project(table('report = ["out/budget.xml", "budget.sarif"]'))
        run("check", "m.yaml")
        assert (tmp_path / "out" / "budget.xml").read_text().startswith("<?xml")
        assert json.loads((tmp_path / "budget.sarif").read_text())["version"] == "2.1.0"

    def test_reports_from_the_environment_are_separated_by_spaces(self, run, project, tmp_path) -> None:
        run("check", "m.yaml", env={"BISAR_BUDGET_REPORT": "a.json b.csv"})
        assert (tmp_path / "missions" / "a.json").exists()
        assert (tmp_path / "missions" / "b.csv").exists()

    def test_explain_takes_no_offence_at_a_format_of_the_project(self, run, project) -> None:
        project(table('format = "github"\nreport = ["a.xml"]'))
        assert "Table I row 1" in run("check", "m.yaml", "--explain", "timing.quadratic").stdout


@pytest.mark.parametrize(
    "text",
    [
        "[tool.bisar-budget]\nstrict = true",
        "[tool]\nbisar-budget = { strict = true }",
        "[tool]\nbisar-budget.strict = true",
        'tool."bisar-budget".strict = true',
        '[ tool . "bisar-budget" ]\nstrict = true',
    ],
)
def test_every_way_to_write_the_table(run, project, text: str) -> None:
    project(text)
    assert run("check", "m.yaml").exit_code == 1


def test_a_nearer_file_without_the_table_does_not_hide_it(run, project, tmp_path) -> None:
    project(table("strict = true"))
    (tmp_path / "missions" / "pyproject.toml").write_text('[project]\nname = "bisar-budget"\n')
    assert run("check", "m.yaml").exit_code == 1
    (tmp_path / "missions" / "pyproject.toml").write_text("[tool.bisar-budget]\n")
    assert run("check", "m.yaml").exit_code == 0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("strikt = true", "tool.bisar-budget.strikt: is not a known key"),
        ("strikt = true", "Did you mean 'strict'?"),
        ('strict = "yes"', "tool.bisar-budget.strict: must be true or false (got 'yes')"),
        ("strict = 1", "must be true or false"),
        ("format = 3", "tool.bisar-budget.format: must be text"),
        ('format = "yaml"', "tool.bisar-budget.format: 'yaml' is not one of"),
        ('model = "best"', "tool.bisar-budget.model: 'best' is not one of"),
        ('report = "a.xml"', "tool.bisar-budget.report: must be a list of file names"),
        ("report = [1]", "must be a list of file names"),
        ('report = ["a.docx"]', "tool.bisar-budget.report: --report"),
        ("strict = ", "is not valid TOML"),
        ("\x00", "is not valid TOML"),
    ],
)
def test_a_wrong_table_is_2_and_names_file_and_key(run, project, tmp_path, text: str, message: str) -> None:
    project(table(text))
    result = run("check", "m.yaml")
    assert result.exit_code == 2
    assert message in result.stderr
    assert str(tmp_path / "pyproject.toml") in result.stderr
    assert result.stdout == ""


@pytest.mark.parametrize("text", ["[tool]\nbisar-budget = 3", "tool = 3\nx.bisar-budget = 1"])
def test_what_is_no_table(run, project, text: str) -> None:
    project(text)
    assert run("check", "m.yaml").exit_code == (2 if "= 3" in text.splitlines()[1] else 0)


@pytest.mark.parametrize(
    ("name", "value"),
    [("BISAR_BUDGET_STRICT", "perhaps"), ("BISAR_BUDGET_FORMAT", "yaml"), ("BISAR_BUDGET_STRCT", "1")],
)
def test_a_wrong_variable_is_2_and_named(run, project, name: str, value: str) -> None:
    result = run("check", "m.yaml", env={name: value})
    assert result.exit_code == 2
    assert name in result.stderr


def test_tomllib_is_loaded_only_where_the_tool_is_named(tmp_path, monkeypatch) -> None:
    code = f"import os\nfrom bisar_budget.settings import project_settings\nproject_settings({str(tmp_path)!r})"
    (tmp_path / "pyproject.toml").write_text(
        '[project]\nname = "x"\ndependencies = ["budget"]\n[tool.ruff]\nline-length = 118\n'
    )
    assert "tomllib" not in loaded_after(code)
    (tmp_path / "pyproject.toml").write_text(table("strict = true"))
    assert "tomllib" in loaded_after(code)
    assert (ROOT / "pyproject.toml").exists()


@pytest.mark.parametrize("name", ["../a.xml", "/tmp/a.xml", "out/../../a.xml", "link.xml", "folder/a.xml"])
def test_a_report_of_the_settings_leads_nowhere_else(run, project, tmp_path, name: str) -> None:
    """The settings of a repository that somebody else wrote would put a report over any file."""
    project(table(f'report = ["{name}"]'))
    outside = tmp_path.parent / f"{tmp_path.name}-elsewhere"
    outside.mkdir()
    (tmp_path / "link.xml").symlink_to(outside / "a.xml")
    (tmp_path / "folder").symlink_to(outside)
    done = run("check", "m.yaml")
    assert done.exit_code == 2
    assert "tool.bisar-budget.report: " in done.stderr
    assert "leads out of the folder of this file" in done.stderr
    assert not list(outside.iterdir())


def test_settings_are_those_of_the_folder_of_the_mission(run, tmp_path, monkeypatch) -> None:
    """From the top of a repository a project below it was checked without its `strict`."""
    for name in ("a", "b"):
        (tmp_path / name / "missions").mkdir(parents=True)
        (tmp_path / name / "missions" / "m.yaml").write_text(WARNING)
    (tmp_path / "a" / "pyproject.toml").write_text(table("strict = true"))
    monkeypatch.chdir(tmp_path)
    done = run("check", "a/missions/m.yaml")
    assert done.exit_code == 1
    assert "--strict" in done.stdout
    assert "a/pyproject.toml" in done.stdout
    assert run("check", "a/**/*.yaml").exit_code == 1
    assert run("check", "b/missions/m.yaml").exit_code == 0
    both = run("check", "a/missions/m.yaml", "b/missions/m.yaml")
    assert both.exit_code == 2
    said = (
        "a/missions/m.yaml has a/pyproject.toml, b/missions/m.yaml has none; check each project in a run of its own."
    )
    assert said in " ".join(both.stderr.split())
