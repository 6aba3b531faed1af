"""The git repository of a mission file: its commit, and whether its files are as committed."""

import os
import subprocess
from pathlib import Path

import pytest

from bisar_budget.mission import work_tree
from bisar_budget.mission.work_tree import WorkTree, work_trees


def git(folder: Path, *arguments: str) -> str:
    command = ["git", "-c", "user.name=a", "-c", "user.email=a@b.c", "-C", str(folder), *arguments]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    git(tmp_path, "init", "-q")
    (tmp_path / "missions").mkdir()
    for name in ("m.yaml", "part.yaml"):
        (tmp_path / "missions" / name).write_text("a: 1\n")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-qm", "first")
    return tmp_path


def state(repository: Path) -> WorkTree:
    mission, part = (str(repository / "missions" / name) for name in ("m.yaml", "part.yaml"))
    return work_trees({mission: [part]})[mission]


def test_a_clean_repository(repository: Path) -> None:
    assert state(repository) == WorkTree(commit=git(repository, "rev-parse", "HEAD"))
    assert state(repository).is_clean
    (repository / "report.html").write_text("a report beside the mission changes nothing")
    assert state(repository).is_clean


def test_changed_files_and_new_inputs(repository: Path) -> None:
    (repository / "missions" / "part.yaml").write_text("a: 2\n")
    found = state(repository)
    assert not found.is_clean
    assert found.changed == found.changed_inputs == ("missions/part.yaml",)
    new = repository / "missions" / "new ü.yaml"
    new.write_text("a: 1\n")
    found = work_trees({str(new): []})[str(new)]
    assert found.new_inputs == ("missions/new ü.yaml",)
    assert (found.changed, found.changed_inputs) == (("missions/part.yaml",), ())


def test_a_file_in_no_repository(tmp_path: Path) -> None:
    file = str(tmp_path / "m.yaml")
    assert {one.reason for one in work_trees({file: [], "-": []}).values()} == {"not in a git repository"}


def test_a_repository_without_a_commit(tmp_path: Path) -> None:
    git(tmp_path, "init", "-q")
    file = str(tmp_path / "m.yaml")
    assert work_trees({file: []})[file].reason == "in a git repository without a commit"


def test_without_git_there_is_no_error(repository: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", os.devnull)
    assert state(repository) == WorkTree(reason="in a git repository, but git cannot be run")


def test_git_that_gives_no_answer(repository: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = repository / "bin"
    folder.mkdir()
    (folder / "git").write_text("#!/bin/sh\nexec sleep 5\n")
    (folder / "git").chmod(0o755)
    monkeypatch.setenv("PATH", f"{folder}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setattr(work_tree, "_GIT_TIMEOUT_S", 0.2)
    assert state(repository) == WorkTree(reason="in a git repository, but git gives no answer in time")


def test_variables_of_a_hook_do_not_lead_elsewhere(
    repository: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = tmp_path_factory.mktemp("other")
    git(other, "init", "-q")
    commit = git(repository, "rev-parse", "HEAD")
    monkeypatch.setenv("GIT_DIR", str(other / ".git"))
    assert state(repository).commit == commit


def test_the_settings_of_a_repository_run_no_program(repository: Path) -> None:
    ran = repository.parent / f"{repository.name}-ran"
    git(repository, "config", "core.fsmonitor", f"touch {ran}; false")
    assert state(repository).commit
    assert not ran.exists()
