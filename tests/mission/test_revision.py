"""Files of a revision: by name, by pattern, through links, in the top of the repository and below."""

import os
from glob import glob
from pathlib import Path

import pytest

from bisar_budget.mission.revision import Revision, RevisionError
from bisar_budget.resources import UnreadableError
from tests.report.test_loosened import commit
from tests.report.test_report_diff import git

FILES = ("a.yaml", "m/a.yaml", "m/b.yml", "m/.c.yaml", "m/deep/er/a.yaml", ".h/a.yaml", "m/[x].yaml", "m/ä b.yaml")
PATTERNS = (
    "*.yaml", "m/*", "m/*.yaml", "**/*.yaml", "**", "m/**", "m/**/a.yaml", "**/deep/**", "m/?.y*ml", "m/[ab].y*",
    "m/[!a].y*", "m/.*", ".h/*", "m/[[]x].yaml", "m/./a.yaml", "m/../a.y*", "none/*", "**/**/a.yaml", "m/ä*",
)  # fmt: skip


@pytest.fixture
def repository(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in FILES:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(name)
    git(tmp_path, "init", "-q")
    commit(tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("pattern", PATTERNS)
def test_a_pattern_names_what_glob_finds(repository: Path, pattern: str) -> None:
    found = {os.path.normpath(name) for name in glob(pattern, recursive=True) if os.path.isfile(name)}
    assert Revision(pattern, "HEAD").matching(pattern) == sorted(found)
    whole = str(repository / pattern)
    assert Revision(whole, "HEAD").matching(whole) == sorted(str(repository / name) for name in found)


def test_from_a_folder_below(repository: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(repository / "m" / "deep")
    revision = Revision("../*.yml", "HEAD")
    assert revision.matching("../*.yml") == ["../b.yml"]
    assert revision.content("../b.yml", 100) == b"m/b.yml"
    assert revision.path_of("../b.yml") == "m/b.yml"
    assert revision.names("..") == sorted(os.listdir(".."))
    assert revision.names(str(repository)) == sorted(set(os.listdir(repository)) - {".git"})


def test_a_folder_that_is_gone(repository: Path) -> None:
    for file in (repository / "m" / "deep" / "er").iterdir():
        file.unlink()
    (repository / "m" / "deep" / "er").rmdir()
    revision = Revision("m/deep/er/a.yaml", "HEAD")
    assert revision.content("m/deep/er/a.yaml", 100) == b"m/deep/er/a.yaml"
    assert revision.names("m/deep/er") == ["a.yaml"]
    with pytest.raises(FileNotFoundError):
        revision.names("m/none")


def test_content_is_bounded(repository: Path) -> None:
    assert Revision("a.yaml", "HEAD").content("a.yaml", 2) == b"a.y"


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("m", "m is a folder in revision HEAD"),
        ("none", "none is not in revision HEAD"),
        ("a\nb", "is not in revision HEAD"),
        ("out", "is a link out of the repository, to ../../x, in revision HEAD"),
        ("round", "is a link that leads nowhere in revision HEAD"),
        ("no\0name", "is not in revision HEAD"),
    ],
)
def test_no_such_file(repository: Path, name: str, words: str) -> None:
    (repository / "out").symlink_to("../../x")
    (repository / "round").symlink_to("round")
    commit(repository)
    with pytest.raises(UnreadableError, match=words.replace(".", r"\.")):
        Revision("a.yaml", "HEAD").content(name, 100)


def test_a_repository_of_another_owner_is_said(repository: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GIT_TEST_ASSUME_DIFFERENT_OWNER", "1")
    with pytest.raises(RevisionError, match=r"safe\.directory"):
        Revision("a.yaml", "HEAD")


def test_a_folder_that_became_a_repository_does_not_answer_for_itself(repository: Path) -> None:
    """One with a revision of the same name, in which the file was as it is now."""
    (repository / "m" / "a.yaml").write_text("looser")
    git(repository / "m", "init", "-q")
    commit(repository / "m")
    assert Revision("m/a.yaml", "HEAD").content("m/a.yaml", 100) == b"m/a.yaml"


def test_a_folder_of_the_revision_that_another_repository_or_a_link_holds(
    repository: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """A mission that is gone from a linked folder, or from a submodule, was not missed."""
    other = tmp_path_factory.mktemp("other")
    (other / "a.yaml").write_text("theirs")
    git(other, "init", "-q")
    commit(other)
    git(repository, "-c", "protocol.file.allow=always", "submodule", "add", "-q", str(other), "sub")
    (repository / "link").symlink_to("m")
    (repository / "m" / "up").symlink_to("..")
    commit(repository)
    (repository / "sub" / "a.yaml").unlink()
    (repository / "m" / "b.yml").unlink()
    for pattern, files in (("sub/*.yaml", ["sub/a.yaml"]), ("link/*.yml", ["link/b.yml"]), ("s*/*", ["sub/a.yaml"])):
        assert Revision(pattern, "HEAD").matching(pattern) == files
    assert "sub/a.yaml" in Revision("**/*.yaml", "HEAD").matching("**/*.yaml")


def test_a_submodule_or_a_link_that_became_a_folder_is_not_new(
    repository: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Its missions were compared with nothing, as if they were new."""
    other = tmp_path_factory.mktemp("other")
    (other / "a.yaml").write_text("theirs")
    git(other, "init", "-q")
    commit(other)
    git(repository, "-c", "protocol.file.allow=always", "submodule", "add", "-q", str(other), "sub")
    (repository / "out").symlink_to(other)
    commit(repository)
    (repository / "sub" / ".git").unlink()
    (repository / "out").unlink()
    (repository / "out").mkdir()
    revision = Revision("sub/a.yaml", "HEAD")
    for file, words in (
        ("sub/a.yaml", "is in a submodule whose commit is not here"),
        ("out/a.yaml", "is a link out"),
    ):
        with pytest.raises(RevisionError, match=words):
            revision.has(file)
    assert not revision.has("new.yaml")


@pytest.mark.parametrize("name", ["GIT_DIR", "GIT_WORK_TREE"])
def test_variables_of_a_hook_name_no_other_repository(
    repository: Path, name: str, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = tmp_path_factory.mktemp("other")
    git(other, "init", "-q")
    monkeypatch.setenv("GIT_DIR", str(repository / ".git"))
    monkeypatch.setenv(name, str(other / ".git" if name == "GIT_DIR" else other))
    monkeypatch.chdir(repository / "m")
    assert Revision("a.yaml", "HEAD").has("a.yaml")


def test_git_is_asked_once_for_what_every_mission_shares(repository: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Settings and folders of parts: sixteen processes for each mission."""
    from bisar_budget.mission import revision as module

    asked: list[tuple[str, ...]] = []
    ask = module._git
    monkeypatch.setattr(module, "_git", lambda *said, **given: asked.append(said[1:]) or ask(*said, **given))
    revision = Revision("a.yaml", "HEAD")
    for is_first in (True, False):
        asked.clear()
        assert not revision.has("pyproject.toml")
        assert revision.content("m/a.yaml", 100) == b"m/a.yaml"
        assert "a.yaml" in revision.names("m")
        assert bool(asked) is is_first
