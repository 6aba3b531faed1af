"""Names in reports for requirements tools and code scanning: the same wherever the command runs, and no two alike."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

from bisar_budget.faults import Fault
from bisar_budget.findings.mission import Report, UnusableMission
from bisar_budget.report import Style, render
from tests.conftest import ROOT, findings, mission_text

# A row fails, one has an id of the project's own, an id of the project's own names no row.
MISSION = {
    "platforms__receiver__motion_error__velocity": ["5 m/s", 0, 0],
    "requirement_ids": {"receiver.velocity.x": "SYS-NAV-012", "nobody": "X"},
}
NAMED = ("needs", "junit", "sarif")  # every name of these is the same wherever the command runs, and every other byte


def repository(folder: Path) -> Path:
    """A work tree as far as names go: nothing runs git."""
    (folder / ".git").mkdir(parents=True)
    (folder / "missions").mkdir()
    (folder / "docs").mkdir()
    write(folder / "missions" / "m.yaml")
    return folder


def write(path: Path, **changes) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(mission_text(**{**MISSION, **changes}), encoding="utf-8")
    return path


@pytest.fixture
def repo(tmp_path: Path, monkeypatch) -> Path:
    monkeypatch.delenv("GITHUB_WORKSPACE", raising=False)
    folder = repository(tmp_path / "repo")
    monkeypatch.chdir(folder)
    return folder


@pytest.fixture
def written(run):
    """What a format says of missions, as text."""

    def check(format_name: str, *missions, **options) -> str:
        result = run("check", *missions, "--format", format_name, "--date", "2026-11-21", **options)
        assert result.exit_code in (1, 2), result.output
        return result.stdout

    return check


def needs_ids(text: str) -> list[str]:
    (version,) = json.loads(text)["versions"].values()
    return list(version["needs"])


def cases(text: str) -> list[str]:
    return [f"{case.get('classname')}.{case.get('name')}" for case in ElementTree.fromstring(text).iter("testcase")]


def fingerprints(text: str) -> list[str]:
    (run,) = json.loads(text)["runs"]
    return [result["partialFingerprints"]["primaryLocationLineHash"] for result in run["results"]]


NAMES = {"needs": needs_ids, "junit": cases, "sarif": fingerprints}


@pytest.mark.parametrize("format_name", NAMED)
class TestAMissionOfARepository:
    """Each way to name one file, against `missions/m.yaml` from the root of its repository."""

    @pytest.fixture
    def same(self, repo: Path, written, format_name: str, monkeypatch):
        expected = written(format_name, "missions/m.yaml")
        assert NAMES[format_name](expected)
        assert str(repo) not in expected

        def check(mission, folder: Path = repo, **options) -> None:
            monkeypatch.chdir(folder)
            assert written(format_name, mission, **options) == expected

        return check

    def test_with_a_dot_before_it(self, same) -> None:
        same("./missions/../missions/m.yaml")

    def test_from_its_own_folder(self, same, repo) -> None:
        same("m.yaml", repo / "missions")

    def test_from_another_folder_of_the_repository(self, same, repo) -> None:
        same("../missions/m.yaml", repo / "docs")

    def test_by_its_absolute_path(self, same, repo) -> None:
        same(repo / "missions" / "m.yaml")

    def test_from_outside_of_the_repository(self, same, repo) -> None:
        same("repo/missions/m.yaml", repo.parent)

    def test_from_outside_by_its_absolute_path(self, same, repo) -> None:
        same(repo / "missions" / "m.yaml", Path(repo.anchor))

    def test_by_a_pattern(self, same) -> None:
        same("mis*/*.yaml")

    def test_through_a_link_to_the_file(self, same, repo) -> None:
        (repo / "docs" / "linked.yaml").symlink_to("../missions/m.yaml")
        same("docs/linked.yaml")

    def test_through_a_link_from_outside(self, same, repo, tmp_path) -> None:
        (tmp_path / "linked.yaml").symlink_to(repo / "missions" / "m.yaml")
        same("linked.yaml", tmp_path)

    def test_through_a_link_to_its_folder(self, same, repo, tmp_path) -> None:
        (tmp_path / "elsewhere").symlink_to(repo / "missions")
        same(tmp_path / "elsewhere" / "m.yaml", tmp_path / "elsewhere")

    def test_in_github_s_checkout(self, same, repo) -> None:
        same("m.yaml", repo / "missions", env={"GITHUB_WORKSPACE": str(repo)})

    def test_in_a_checkout_below_github_s_workspace(self, same, repo) -> None:
        """`path:` of actions/checkout: paths are those of the repository, as the pull request has them."""
        same("repo/missions/m.yaml", repo.parent, env={"GITHUB_WORKSPACE": str(repo.parent)})

    def test_in_a_checkout_without_git(self, same, repo, tmp_path) -> None:
        """actions/checkout unpacks an archive where the machine has no git."""
        shutil.rmtree(repo / ".git")
        (tmp_path / ".git").mkdir()  # of whatever the runner lies in
        (tmp_path / "link").symlink_to(repo)
        same("m.yaml", repo / "missions", env={"GITHUB_WORKSPACE": str(tmp_path / "link")})

    def test_in_a_worktree_or_submodule(self, same, repo, tmp_path) -> None:
        """Their `.git` is a file."""
        shutil.copytree(repo, tmp_path / "other")
        (tmp_path / "other" / ".git").rmdir()
        (tmp_path / "other" / ".git").write_text("gitdir: ../repo/.git/worktrees/other\n")
        same("other/missions/m.yaml", tmp_path)

    def test_in_a_store_of_large_files(self, same, repo) -> None:
        """git-annex keeps the content under a name of its own, which changes with it."""
        store = repo / ".git" / "annex"
        store.mkdir()
        (repo / "missions" / "m.yaml").rename(store / "SHA256E-s1--abc.yaml")
        (repo / "missions" / "m.yaml").symlink_to("../.git/annex/SHA256E-s1--abc.yaml")
        same("m.yaml", repo / "missions")


@pytest.mark.parametrize("format_name", NAMED)
class TestStandardInput:
    @pytest.mark.skipif(not os.path.exists("/dev/fd"), reason="no pipes with a name")
    def test_of_a_pipe_with_a_name_is_named_alike_every_time(self, format_name: str, tmp_path) -> None:
        """`check <(generate)`: the system calls the pipe by another number in every run."""
        command = [sys.executable, "-m", "bisar_budget", "check", "/dev/fd/0", "--format", format_name]
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        runs = [
            subprocess.run(
                command, input=mission_text(**MISSION).encode(), capture_output=True, cwd=tmp_path, env=environment
            )
            for _ in range(2)
        ]
        assert runs[0].returncode == 1, runs[0].stderr
        assert runs[0].stdout == runs[1].stdout

    def test_is_named_alike_everywhere(self, repo, written, format_name, monkeypatch, tmp_path) -> None:
        text = mission_text(**MISSION)
        expected = written(format_name, "-", input=text)
        monkeypatch.chdir(tmp_path)
        assert written(format_name, "-", input=text) == expected

    def test_has_the_names_of_the_file_where_the_document_has_a_number(self, repo, written, format_name) -> None:
        path = write(repo / "n.yaml", document={"number": "SYS-12"})
        names = NAMES[format_name]
        found = names(written(format_name, "-", input=path.read_text(encoding="utf-8")))
        assert found == names(written(format_name, path))


class TestNames:
    def test_of_a_mission_are_its_path(self, repo, written) -> None:
        ids = needs_ids(written("needs", "missions/m.yaml"))
        assert "BUDGET_MISSIONS_M_RECEIVER_VELOCITY_Y" in ids
        assert "missions.m.receiver.velocity.x" in cases(written("junit", "missions/m.yaml"))

    def test_of_a_mission_are_the_number_of_its_document(self, repo, written) -> None:
        path = write(repo / "missions" / "m.yaml", document={"number": "SYS-12.3"})
        assert "BUDGET_SYS_12_3_RECEIVER_VELOCITY_Y" in needs_ids(written("needs", path))
        assert "SYS-12_3.receiver.velocity.x" in cases(written("junit", path))

    @pytest.mark.parametrize("format_name", NAMED)
    def test_stay_when_a_numbered_mission_is_moved(self, repo, written, format_name) -> None:
        path = write(repo / "missions" / "m.yaml", document={"number": "SYS-12"})
        before = NAMES[format_name](written(format_name, path))
        (repo / "archive").mkdir()
        moved = path.rename(repo / "archive" / "old.yaml")
        assert NAMES[format_name](written(format_name, moved)) == before

    def test_of_a_row_with_an_id_of_the_project_s_own_stay_when_the_mission_is_moved(self, repo, written) -> None:
        own = "BUDGET_SYS_NAV_012_RECEIVER_VELOCITY_X"
        assert own in needs_ids(written("needs", "missions/m.yaml"))
        first = fingerprints(written("sarif", "missions/m.yaml"))
        Path("missions/m.yaml").rename("docs/old.yaml")
        assert own in needs_ids(written("needs", "docs/old.yaml"))
        assert len(set(first) & set(fingerprints(written("sarif", "docs/old.yaml")))) == 1

    def test_of_a_mission_in_no_repository_are_the_name_of_the_file(self, tmp_path, written, monkeypatch) -> None:
        """A path of this machine would differ on every other."""
        monkeypatch.delenv("GITHUB_WORKSPACE", raising=False)
        write(tmp_path / "a" / "m.yaml")
        expected = {}
        for folder, mission in (
            (tmp_path, "a/m.yaml"),
            (tmp_path / "a", "m.yaml"),
            (Path("/"), tmp_path / "a/m.yaml"),
        ):
            monkeypatch.chdir(folder)
            for name in ("needs", "junit"):
                assert written(name, mission) == expected.setdefault(name, written(name, mission))
            found = fingerprints(written("sarif", mission))
            assert found == expected.setdefault("sarif", found)
        assert "BUDGET_M_RECEIVER_VELOCITY_Y" in needs_ids(expected["needs"])
        assert str(tmp_path) not in expected["needs"] + expected["junit"]

    def test_of_a_file_that_cannot_be_used(self, repo, written, monkeypatch) -> None:
        (repo / "missions" / "bad.yaml").write_text("nonsense: [")
        expected = {name: written(name, "missions/bad.yaml") for name in NAMED}
        assert needs_ids(expected["needs"]) == ["BUDGET_MISSIONS_BAD_MISSION"]
        assert cases(expected["junit"]) == ["missions.bad.mission file"]
        monkeypatch.chdir(repo / "missions")
        for name in NAMED:
            assert written(name, "bad.yaml") == expected[name]


def all_names(format_name: str, written, *missions) -> dict[str, list[str]]:
    """Names by mission, in whatever order they are given."""
    names = NAMES[format_name](written(format_name, *missions))
    size = len(names) // len(missions)
    return {str(one): names[place * size : (place + 1) * size] for place, one in enumerate(missions)}


@pytest.mark.parametrize("format_name", NAMED)
class TestTwoMissions:
    """Names of one run are distinct, and whose they are does not depend on the order of the missions."""

    @pytest.fixture
    def distinct(self, repo, written, format_name):
        def check(first, second) -> None:
            forth = all_names(format_name, written, first, second)
            back = all_names(format_name, written, second, first)
            assert forth == back
            assert not set(forth[str(first)]) & set(forth[str(second)])

        return check

    def test_of_one_name_in_two_folders(self, distinct, repo) -> None:
        distinct(repo / "missions" / "m.yaml", write(repo / "docs" / "m.yaml"))

    def test_of_one_name_in_no_repository(self, distinct, tmp_path) -> None:
        distinct(write(tmp_path / "a" / "m.yaml"), write(tmp_path / "b" / "m.yaml"))

    def test_of_one_path_in_two_repositories(self, distinct, repo, tmp_path) -> None:
        distinct(repo / "missions" / "m.yaml", repository(tmp_path / "other") / "missions" / "m.yaml")

    def test_of_one_document_number(self, distinct, repo) -> None:
        number = {"number": "SYS-12"}
        distinct(write(repo / "a.yaml", document=number), write(repo / "b.yaml", document=number))

    def test_with_the_number_of_the_other_s_requirement(self, distinct, repo) -> None:
        number = {"number": "SYS-NAV-012"}
        distinct(
            write(repo / "a.yaml", document=number, requirement_ids={"nobody": "X"}), repo / "missions" / "m.yaml"
        )

    def test_with_the_other_s_path_for_a_document_number(self, distinct, repo) -> None:
        distinct(write(repo / "a.yaml", document={"number": "missions/m.yaml"}), repo / "missions" / "m.yaml")

    def test_whose_names_are_spelled_alike(self, distinct, repo) -> None:
        distinct(write(repo / "a-b.c" / "m.yaml"), write(repo / "a_b_c" / "m.yaml"))
        distinct(write(repo / "m.yaml"), write(repo / "m.yml"))
        distinct(write(repo / "漢.yaml"), write(repo / "字.yaml"))


@pytest.mark.parametrize("format_name", NAMED)
def test_a_folder_removed_under_the_command_leaves_names_as_given(
    repo, written, format_name, monkeypatch, tmp_path
) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    written(format_name, repo / "missions" / "m.yaml", "m.yaml", env={"GITHUB_WORKSPACE": str(repo)})


@pytest.mark.parametrize("format_name", [*NAMED, "github", "html"])
def test_a_name_that_no_file_can_have_is_an_error_of_the_file(run, format_name) -> None:
    assert run("check", "a\0b.yaml", "--format", format_name).exit_code == 2


def test_one_file_named_twice_has_one_name(repo, written) -> None:
    (repo / "linked.yaml").symlink_to("missions/m.yaml")
    once = fingerprints(written("sarif", "missions/m.yaml"))
    assert fingerprints(written("sarif", "missions/m.yaml", "linked.yaml")) == once * 2
    ids = needs_ids(written("needs", "missions/m.yaml", "linked.yaml"))
    assert len(set(ids)) == len(ids)


class TestPlaces:
    """Where code scanning and pull requests look for a finding."""

    def test_sarif_names_the_file_from_the_root_of_the_repository(self, repo, written, monkeypatch) -> None:
        monkeypatch.chdir(repo / "missions")
        (run,) = json.loads(written("sarif", "m.yaml"))["runs"]
        place = {"uri": "missions/m.yaml", "uriBaseId": "%SRCROOT%"}
        assert [artifact["location"] for artifact in run["artifacts"]] == [place]
        for result in run["results"]:
            (location,) = result["locations"]
            assert location["physicalLocation"]["artifactLocation"] == {**place, "index": 0}

    def test_annotations_name_the_file_from_the_root_of_the_repository(self, repo, written, monkeypatch) -> None:
        monkeypatch.chdir(repo / "missions")
        for workspace in ("", str(repo), str(repo.parent)):
            lines = written("github", "m.yaml", env={"GITHUB_WORKSPACE": workspace}).splitlines()
            assert lines
            assert {re.search("file=([^,]*),", line)[1] for line in lines} == {"missions/m.yaml"}

    def test_outside_of_a_repository_below_the_current_folder_or_absolute(
        self, tmp_path, written, monkeypatch
    ) -> None:
        monkeypatch.delenv("GITHUB_WORKSPACE", raising=False)
        write(tmp_path / "a" / "m.yaml")
        (tmp_path / "b").mkdir()
        for folder, mission, expected in (
            (tmp_path, "a/m.yaml", "a/m.yaml"),
            (tmp_path / "b", "../a/m.yaml", str(tmp_path / "a" / "m.yaml").replace(os.sep, "/")),
        ):
            monkeypatch.chdir(folder)
            assert f"file={expected}," in written("github", mission).splitlines()[0]

    def test_text_and_json_name_the_file_as_it_was_given(self, repo, written, monkeypatch) -> None:
        monkeypatch.chdir(repo / "docs")
        assert json.loads(written("json", "../missions/m.yaml"))["missions"][0]["file"] == "../missions/m.yaml"
        assert "../missions/m.yaml" in written("text", "../missions/m.yaml")


def test_what_strictdoc_reads_of_test_results(repo, written) -> None:
    """Rules of StrictDoc 0.30 for `*.pytest.junit.xml`: else it refuses the whole file."""
    suites = ElementTree.fromstring(written("junit", "missions/m.yaml", write(repo / "docs" / "n.yaml")))
    assert suites.tag == "testsuites"
    uids, fields = [], {}
    for suite in suites:
        assert {"name", "tests", "failures"} <= set(suite.keys())
        for case in suite.findall("testcase"):
            assert {"name", "classname", "time"} <= set(case.keys())
            uids.append(f"{case.get('classname')}.{case.get('name')}")
            names = [one.get("name") for one in case.iter("property")]
            assert len(set(names)) == len(names)
            for name in names:
                assert fields.setdefault(re.sub("[^A-Za-z0-9]", "_", name).upper(), name) == name
    assert len(set(uids)) == len(uids)
    assert not fields.keys() & {"UID", "TEST_PATH", "TEST_FUNCTION", "DURATION", "STATUS", "TITLE", "STATEMENT"}
    assert "REQUIREMENT_ID" in fields


SPHINX = """Requirements
============

.. req:: Velocity of the receiver
   :id: SYS-NAV-012

   Known to 5 mm/s. The result is :need:`BUDGET_SYS_NAV_012_RECEIVER_VELOCITY_X`.

.. needimport:: needs.json
"""


class TestSphinxNeeds:
    """The current release reads what is written, by the guide's own directive, and warns of nothing."""

    def build(self, folder: Path) -> dict:
        pytest.importorskip("sphinx_needs", reason="sphinx-needs is not installed")
        (folder / "conf.py").write_text('extensions = ["sphinx_needs"]\nneeds_id_regex = "^[A-Z0-9_-]{5,}"\n')
        (folder / "index.rst").write_text(SPHINX)
        command = [sys.executable, "-m", "sphinx", "-W", "-q", "-b", "needs", ".", "out"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300)
        assert done.returncode == 0, done.stderr
        (version,) = json.loads((folder / "out" / "needs.json").read_text(encoding="utf-8"))["versions"].values()
        return version["needs"]

    def test_imports_findings_and_links_them_to_the_requirement(self, repo, written, tmp_path) -> None:
        text = written("needs", "missions/m.yaml", write(repo / "docs" / "n.yaml", requirement_ids={}))
        (tmp_path / "needs.json").write_text(text, encoding="utf-8")
        needs = self.build(tmp_path)
        result = needs["BUDGET_SYS_NAV_012_RECEIVER_VELOCITY_X"]
        assert (result["type"], result["status"], result["links"]) == ("test", "fail", ["SYS-NAV-012"])
        assert needs["SYS-NAV-012"]["links_back"] == [result["id"]]
        assert needs.keys() == {"SYS-NAV-012", *needs_ids(text)}

    def test_imports_whatever_a_mission_is_called(self, tmp_path) -> None:
        hostile = "<script>|`x`]]> [[copy('id')]] <<x>> .. raw:: html {{7*7}} 漢 *a* _b_"
        found = findings(**{**MISSION, "name": hostile, "requirement_ids": {"receiver.velocity.x": "SYS-NAV-012"}})
        broken = UnusableMission(file=f"{hostile}.yaml", faults=(Fault(3, 7, "radar.bandwidth", hostile),))
        (tmp_path / "needs.json").write_text(
            render("needs", Report(version="1", missions=(found, broken)), Style()), encoding="utf-8"
        )
        assert len(self.build(tmp_path)) == len(found.rows) + len(found.requirements) + 2
