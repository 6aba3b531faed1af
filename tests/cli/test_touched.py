"""`check --changed`: the missions that a change touches, by whichever of their files."""

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.conftest import COMPLIES, mission_text

PART = "kind: imu\nname: unit\naccelerometer_bias: 100 ug\nsource: sheet\n"


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Missions in folders and subfolders, two of which take a part from a file or the project's catalogue."""
    for folder in ("missions/sub", "parts", "sensors", "other", ".hidden/missions"):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "pyproject.toml").write_text('[tool.bisar-budget]\nsensors = ["sensors"]\n')
    (tmp_path / "parts" / "imu.yaml").write_text(PART)
    (tmp_path / "sensors" / "own.yaml").write_text(PART)
    for name, error in (
        ("missions/plain.yaml", {"velocity": "5 mm/s"}),
        ("missions/sub/beside.yaml", {"sensor": "../../parts/imu.yaml"}),
        ("other/named.yml", {"sensor": "own"}),
        (".hidden/missions/none.yaml", {"sensor": "own"}),
    ):
        (tmp_path / name).write_text(mission_text(platforms__receiver__motion_error=error))
    (tmp_path / "README.md").write_text("words\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


ALL = {"missions/plain.yaml", "missions/sub/beside.yaml", "other/named.yml"}


@pytest.mark.parametrize(
    ("changed", "touched"),
    [
        (["missions/plain.yaml"], {"missions/plain.yaml"}),
        (["missions/sub/beside.yaml", "README.md"], {"missions/sub/beside.yaml"}),
        (["parts/imu.yaml"], {"missions/sub/beside.yaml"}),
        (["sensors/own.yaml"], {"other/named.yml"}),
        (["pyproject.toml"], ALL),
        (["README.md"], set()),
    ],
)
def test_missions_by_their_files(run, project: Path, changed: list[str], touched: set[str]) -> None:
    done = run("check", "--changed", "-q", *changed)
    assert {name for name in ALL if name in done.stdout} == touched
    if not touched:
        assert done.exit_code == 0
        assert done.stderr == "No mission is among the changed files, and none reads one of them (1 given).\n"


def test_an_orbit_a_log_and_a_table(run, project: Path) -> None:
    """They touch the mission that names them although it cannot be used with what they hold."""
    text = mission_text(**COMPLIES).replace(
        "    position:\n    - 30 km\n    - 0\n    - 6 km\n", "    orbit: {tle: a.tle}\n"
    )
    text = text.replace("    velocity:\n    - 0\n    - 150 m/s\n    - 0\n", "")
    assert "orbit" in text
    (project / "missions" / "orbit.yaml").write_text(text)
    (project / "missions" / "a.tle").write_text("y\n")
    done = run("check", "--changed", "-q", "missions/a.tle")
    assert done.exit_code == 2
    assert "missions/orbit.yaml" in done.stdout


def test_a_part_that_is_gone_touches_its_mission(run, project: Path) -> None:
    (project / "parts" / "imu.yaml").unlink()
    done = run("check", "--changed", "-q", "README.md")
    assert done.exit_code == 2
    assert "missions/sub/beside.yaml" in done.stdout


def test_a_file_below_missions_is_one_whatever_it_says(run: Callable, project: Path) -> None:
    """Else a mission that lost its sections would pass; a part that lies there is none."""
    (project / "missions" / "sub" / "b.yaml").write_text("a: 1\n")
    (project / "missions" / "sub" / "part.yaml").write_text(PART)
    assert run("check", "--changed", "missions/sub/b.yaml").exit_code == 2
    assert run("check", "--changed", "missions/sub/part.yaml").exit_code == 0


def test_a_commit_that_only_deletes_has_no_file(run: Callable, project: Path) -> None:
    """pre-commit passes no deleted file on: the missions that name one that is gone are checked without any."""
    whole = run("check", "--changed", "-q")
    assert whole.exit_code == 0
    assert whole.stderr == "No mission is among the changed files, and none reads one of them (0 given).\n"
    (project / "parts" / "imu.yaml").unlink()
    done = run("check", "--changed", "-q")
    assert done.exit_code == 2
    assert {name for name in ALL if name in done.stdout} == {"missions/sub/beside.yaml"}


def test_without_a_change_a_mission_is_needed(run: Callable, project: Path) -> None:
    done = run("check")
    assert done.exit_code == 2
    assert "Missing argument 'MISSION...'" in done.stderr
