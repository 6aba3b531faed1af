"""Many files in one call: shared out between processes, the findings are those of one."""

from datetime import date

import pytest

from bisar_budget.budget import check
from bisar_budget.findings.mission import Report
from bisar_budget.report import Style, render
from tests.conftest import mission_text

DAY = date(2026, 11, 21)


@pytest.fixture
def files(tmp_path):
    """Missions that differ, and among them one that cannot be used and one that does not exist."""
    names = []
    for index in range(11):
        path = tmp_path / f"mission_{index:02}.yaml"
        path.write_text(mission_text(name=f"mission {index}", collection={"aperture_time": f"{2 + index} s"}))
        names.append(str(path))
    (tmp_path / "mission_04.yaml").write_text("schema_version: 1\nname: [\n")
    (tmp_path / "mission_09.yaml").unlink()
    return names


@pytest.mark.parametrize("cores", [2, 3, 16])
def test_every_format_says_the_same_for_any_number_of_processes(files, monkeypatch, cores: int) -> None:
    monkeypatch.setattr(check, "FILES_FOR_TWO_PROCESSES", 2)
    monkeypatch.setattr(check, "FILES_AT_ONCE", 2)
    monkeypatch.setattr(check, "cores", lambda: 1)
    one = check.check_files(files, DAY, None, check.without_analysis)
    monkeypatch.setattr(check, "cores", lambda: cores)
    several = check.check_files(files, DAY, None, check.without_analysis)
    assert [found.file for found in several] == files
    assert [found.status for found in several].count("error") == 2
    for format_name in ("text", "json", "sarif", "junit", "csv"):  # SARIF knows each value's column
        texts = [render(format_name, Report("1", tuple(found)), Style(verbosity=1)) for found in (one, several)]
        assert texts[0] == texts[1], format_name


def test_standard_input_is_read_once_by_one_process(monkeypatch) -> None:
    monkeypatch.setattr(check, "FILES_FOR_TWO_PROCESSES", 1)
    monkeypatch.setattr(check, "_kept", lambda files, **_: list(files))
    assert check.check_files(["a", "-", "b"], DAY, None, check.without_analysis) == ["a", "-", "b"]


def test_the_command_checks_a_fleet(run, files, monkeypatch) -> None:
    serial = run("check", "-q", *files)
    monkeypatch.setattr(check, "FILES_FOR_TWO_PROCESSES", 2)
    monkeypatch.setattr(check, "cores", lambda: 2)
    parallel = run("check", "-q", *files)
    assert parallel.exit_code == serial.exit_code == 2
    assert parallel.stdout == serial.stdout
