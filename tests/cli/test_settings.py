"""Defaults of `check`: command line over environment over pyproject.toml over the tool's own."""

import json

import pytest

from tests.conftest import COMPLIES, ROOT, mission_text
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


@pytest.fixture
def two_projects(tmp_path, monkeypatch):
    """Two projects, of which the first is strict; the test runs above both."""
    for name in ("a", "b"):
        (tmp_path / name / "missions").mkdir(parents=True)
        (tmp_path / name / "missions" / "m.yaml").write_text(WARNING)
    (tmp_path / "a" / "pyproject.toml").write_text(table("strict = true"))
    (tmp_path / "b" / "pyproject.toml").write_text(table("strict = false"))
    monkeypatch.chdir(tmp_path)
    return tmp_path


BOTH = ("a/missions/m.yaml", "b/missions/m.yaml")


class TestTwoProjects:
    """They were refused in one run; each is judged by its own settings, and says their file."""

    def test_the_strict_one_fails_and_the_other_does_not(self, run, two_projects) -> None:
        assert run("check", *BOTH).exit_code == 1
        assert run("check", BOTH[1]).exit_code == 0
        (two_projects / "a" / "missions" / "m.yaml").write_text(mission_text(**COMPLIES))
        assert run("check", *BOTH).exit_code == 0

    def test_each_says_its_settings(self, run, two_projects) -> None:
        text = run("check", *BOTH).stdout
        assert all(f"settings {name}/pyproject.toml" in text for name in "ab")
        (two_projects / "b" / "pyproject.toml").unlink()
        missions = json.loads(run("check", *BOTH, "--format", "json").stdout)["missions"]
        assert [one["file"] for one in missions] == list(BOTH)
        said = [{each["name"]: each["value"] for each in one["overrides"]} for one in missions]
        assert said[0] == {"--strict": "yes", "settings": "a/pyproject.toml"}
        assert said[1] == {"settings": "none"}

    @pytest.mark.parametrize("format_name", ["markdown", "html", "junit", "csv", "github", "sarif"])
    def test_every_format_has_both_in_their_order(self, run, two_projects, format_name: str) -> None:
        done = run("check", *reversed(BOTH), "--format", format_name)
        assert done.exit_code == 1
        text = done.stdout.replace("<wbr>", "").replace("\\", "")
        places = [text.find(f"settings {name}/pyproject.toml") for name in "ba"]
        assert -1 < places[0] < places[1]

    def test_a_model_holds_for_its_own_project(self, run, two_projects) -> None:
        (two_projects / "a" / "pyproject.toml").write_text(table('model = "full"'))
        missions = json.loads(run("check", *BOTH, "--format", "json").stdout)["missions"]
        assert [one["model"] for one in missions] == ["full", "published"]

    def test_exit_zero_holds_for_its_own_project(self, run, two_projects) -> None:
        (two_projects / "a" / "pyproject.toml").write_text(table("strict = true\nexit-zero = true"))
        assert run("check", *BOTH).exit_code == 0
        (two_projects / "b" / "pyproject.toml").write_text(table("strict = true"))
        assert run("check", *BOTH).exit_code == 1

    def test_the_command_line_holds_for_both(self, run, two_projects) -> None:
        assert run("check", *BOTH, "--no-strict").exit_code == 0

    def test_reports_of_settings_have_their_own_missions(self, run, two_projects) -> None:
        (two_projects / "a" / "pyproject.toml").write_text(table('strict = true\nreport = ["a.json"]'))
        (two_projects / "b" / "pyproject.toml").write_text(table('report = ["b.json"]'))
        run("check", *BOTH, "--report", "both.json")
        assert not (two_projects / "a" / "a.json").exists()  # the command line stands above
        assert len(json.loads((two_projects / "both.json").read_text())["missions"]) == 2
        run("check", *BOTH)
        for name, file in zip("ab", BOTH, strict=True):
            (mission,) = json.loads((two_projects / name / f"{name}.json").read_text())["missions"]
            assert mission["file"] == file

    def test_different_formats_are_said(self, run, two_projects) -> None:
        (two_projects / "a" / "pyproject.toml").write_text(table('format = "json"'))
        done = run("check", *BOTH)
        assert done.stdout.startswith("WARN")
        assert "the settings of the missions have different formats: none of them is taken" in done.stderr
        (two_projects / "b" / "pyproject.toml").write_text(table('format = "json"'))
        assert run("check", *BOTH).stdout.startswith("{")

    def test_a_row_is_explained_in_each(self, run, two_projects) -> None:
        (two_projects / "a" / "pyproject.toml").write_text(table('model = "full"'))
        text = run("check", *BOTH, "--explain", "timing.quadratic").stdout
        assert all(f"settings {name}/pyproject.toml" in text for name in "ab")

    def test_a_change_of_files_in_both(self, run, two_projects) -> None:
        (two_projects / "a" / "notes.txt").write_text("x")
        assert run("check", "--changed", "a/notes.txt", *BOTH).exit_code == 1
        assert run("check", "--changed", "a/pyproject.toml").exit_code == 1
        assert run("check", "--changed", "a/notes.txt").exit_code == 0

    def test_draws_are_those_of_each_project(self, run, two_projects) -> None:
        (two_projects / "a" / "pyproject.toml").write_text(table("monte-carlo = 1000"))
        missions = json.loads(run("check", *BOTH, "--format", "json").stdout)["missions"]
        assert [one["monte_carlo"] is not None for one in missions] == [True, False]
