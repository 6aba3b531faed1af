"""What comes from outside a mission file and bears on its verdict is said beside it, in every format."""

import json
from pathlib import Path

import pytest

from tests.conftest import COMPLIES, ROOT, TEXT_FORMATS, mission_text

WAIVED = mission_text(
    **COMPLIES,
    requirements__islr="-20 dB",
    waivers=[{"id": "mission.islr", "until": "2029-12-31", "reason": "ECR-17"}],
)
EPOCH = {"SOURCE_DATE_EPOCH": "1700000000"}  # 2023-11-14


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("SOURCE_DATE_EPOCH", raising=False)
    (tmp_path / "m.yaml").write_text(mission_text(**COMPLIES), encoding="utf-8")
    (tmp_path / "waived.yaml").write_text(WAIVED, encoding="utf-8")
    return tmp_path


def overrides(run, *arguments: str, **more) -> list[tuple[str, str, str]]:
    (mission,) = json.loads(run("check", *arguments, "--format", "json", **more).stdout)["missions"]
    return [(one["name"], one["value"], one["origin"]) for one in mission["overrides"]]


def readable(text: str) -> str:
    return text.replace("\\", "").replace("&#45;", "-").replace("%3A", ":").replace("%2C", ",")


def test_nothing_is_overridden(run, folder) -> None:
    assert overrides(run, "m.yaml") == []
    assert "Overrides" not in run("check", "m.yaml").stdout


@pytest.mark.parametrize(
    ("arguments", "settings", "environment", "expected"),
    [
        (["--model", "full"], "", {}, ("--model", "full", "command line")),
        ([], "model = 'full'", {}, ("--model", "full", "pyproject.toml")),
        ([], "", {"BISAR_BUDGET_MODEL": "full"}, ("--model", "full", "environment, BISAR_BUDGET_MODEL")),
        (["--exit-zero"], "", {}, ("--exit-zero", "yes", "command line")),
        ([], "exit-zero = true", {}, ("--exit-zero", "yes", "pyproject.toml")),
        ([], "", {"BISAR_BUDGET_EXIT_ZERO": "1"}, ("--exit-zero", "yes", "environment, BISAR_BUDGET_EXIT_ZERO")),
        ([], "strict = true", {}, ("--strict", "yes", "pyproject.toml")),
        (["--no-strict"], "strict = true", {}, ("--strict", "no", "command line")),
        (
            ["--set", "collection.aperture_time=5 s"],
            "",
            {},
            ("--set", "collection.aperture_time=5 s", "command line"),
        ),
        (["--date", "2027-01-01"], "", {}, ("--date", "2027-01-01", "command line")),
    ],
)
def test_each_with_its_origin(run, folder, arguments, settings, environment, expected) -> None:
    if settings:
        (folder / "pyproject.toml").write_text(f"[tool.bisar-budget]\n{settings}\n")
    assert overrides(run, "m.yaml", *arguments, env=environment) == [expected]


def test_the_settings_of_a_folder_above_are_named(run, folder, monkeypatch) -> None:
    (folder / "pyproject.toml").write_text("[tool.bisar-budget]\nexit-zero = true\n")
    (folder / "below").mkdir()
    monkeypatch.chdir(folder / "below")
    assert overrides(run, "../m.yaml") == [("--exit-zero", "yes", "../pyproject.toml")]


class TestDay:
    """Where a waiver stands, every format says which day was taken, and from where."""

    def test_the_environment_that_revives_a_waiver(self, run, folder) -> None:
        """The waiver is over in 2030, and SOURCE_DATE_EPOCH is of 2023: it passed and said nothing."""
        assert run("check", "waived.yaml", "--date", "2030-01-01").exit_code == 1
        assert run("check", "waived.yaml", env=EPOCH).exit_code == 0
        found = overrides(run, "waived.yaml", env=EPOCH)
        assert found == [("--date", "2023-11-14", "environment, SOURCE_DATE_EPOCH")]

    @pytest.mark.parametrize("format_name", TEXT_FORMATS)
    def test_every_format(self, run, folder, format_name: str) -> None:
        text = readable(run("check", "waived.yaml", "--format", format_name, env=EPOCH).stdout)
        assert "2023-11-14" in text
        assert "SOURCE_DATE_EPOCH" in text

    def test_the_clock(self, run, folder) -> None:
        ((name, _, origin),) = overrides(run, "waived.yaml")
        assert (name, origin) == ("--date", "the day of the run")

    def test_without_a_waiver_the_day_decides_nothing(self, run, folder) -> None:
        assert overrides(run, "m.yaml", env=EPOCH) == []


@pytest.mark.parametrize("format_name", TEXT_FORMATS)
def test_every_format_says_that_a_setting_exits_with_0(run, folder, format_name: str) -> None:
    (folder / "pyproject.toml").write_text("[tool.bisar-budget]\nexit-zero = true\n")
    (folder / "m.yaml").write_text(mission_text(), encoding="utf-8")
    done = run("check", "m.yaml", "--format", format_name)
    assert done.exit_code == 0
    assert "--exit-zero" in readable(done.stdout)
    assert "--exit-zero" in run("check", "-q", "m.yaml").stdout


class TestParts:
    MISSION = mission_text(
        platforms__receiver__motion_error={"sensor": "stim300"},
        requirements__islr="-20 dB",
        allocation__model="full",
    )

    @pytest.fixture
    def project(self, folder) -> Path:
        (folder / "parts").mkdir()
        (folder / "m.yaml").write_text(self.MISSION, encoding="utf-8")
        (folder / "pyproject.toml").write_text("[tool.bisar-budget]\nsensors = ['parts']\n")
        return folder

    def copy(self, project: Path, name: str) -> None:
        text = (ROOT / "specs" / "sensors" / "stim300.yaml").read_text(encoding="utf-8")
        (project / "parts" / f"{name}.yaml").write_text(text, encoding="utf-8")

    def test_one_with_the_name_of_the_catalogues(self, run, project) -> None:
        assert overrides(run, "m.yaml") == []
        self.copy(project, "stim300")
        found = overrides(run, "m.yaml")
        assert found == [("part stim300", "parts/stim300.yaml", "the project's, in place of the catalogue's")]
        for format_name in TEXT_FORMATS:
            text = readable(run("check", "m.yaml", "--format", format_name).stdout)
            assert "parts/stim300.yaml" in text.replace("<wbr>", ""), format_name

    def test_one_with_a_name_of_its_own(self, run, project) -> None:
        """The file names it: nothing stands in for anything."""
        self.copy(project, "own")
        (project / "m.yaml").write_text(self.MISSION.replace("stim300", "own"), encoding="utf-8")
        assert overrides(run, "m.yaml") == []


@pytest.mark.parametrize(
    "command",
    [
        ["solve", "waived.yaml", "--for", "collection.aperture_time"],
        ["sensitivity", "waived.yaml"],
        ["diff", "m.yaml", "waived.yaml"],
        ["sweep", "waived.yaml", "--vary", "collection.aperture_time=1s:2s:2"],
    ],
    ids=lambda command: command[0],
)
def test_other_commands_say_it_too(run, folder, command) -> None:
    text = " ".join(run(*command, env=EPOCH).stdout.split())
    assert "--date 2023-11-14 (environment, SOURCE_DATE_EPOCH)" in text
    if command[0] not in ("diff", "sweep"):
        assert "--model full (command line)" in " ".join(run(*command, "--model", "full").stdout.split())
