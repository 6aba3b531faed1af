"""The gate as others run it: the scripts of the GitHub action, the pre-commit hook, the example repository."""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
import yaml

from bisar_budget import __version__
from tests.conftest import ROOT

EXAMPLE = ROOT / "examples" / "design-repo"
ACTION = yaml.safe_load((ROOT / "action.yml").read_text(encoding="utf-8"))
BASH = shutil.which("bash")


def environment(**changes: str) -> dict[str, str]:
    """Variables without those of a surrounding git, CI or settings; `python` is the one of this run."""
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("GIT_", "GITHUB_", "BISAR_BUDGET_"))}
    path = os.pathsep.join([str(Path(sys.executable).parent), kept.get("PATH", "")])
    who = {"GIT_CONFIG_GLOBAL": os.devnull, "GIT_AUTHOR_NAME": "t", "GIT_AUTHOR_EMAIL": "t@example.org"}
    who |= {"GIT_COMMITTER_NAME": "t", "GIT_COMMITTER_EMAIL": "t@example.org"}
    return {**kept, **who, "PATH": path, **changes}


def git(folder: Path, *arguments: str) -> None:
    subprocess.run(["git", *arguments], cwd=folder, check=True, capture_output=True, env=environment())


@pytest.fixture
def design(tmp_path: Path) -> Path:
    """The example repository, committed."""
    folder = tmp_path / "design"
    shutil.copytree(EXAMPLE, folder)
    git(folder, "init", "-q")
    git(folder, "add", "-A")
    git(folder, "commit", "-q", "-m", "missions")
    return folder


@pytest.mark.skipif(BASH is None, reason="the action's scripts are for bash")
class TestAction:
    def run(self, design: Path, step_name: str, **inputs: str) -> subprocess.CompletedProcess[str]:
        """Run a step as GitHub's runner does: the script in a file, `bash -eo pipefail`, inputs as variables."""
        (step,) = [step for step in ACTION["runs"]["steps"] if step.get("name") == step_name]
        given = {name: spec.get("default", "") for name, spec in ACTION["inputs"].items()} | inputs
        variables = {}
        for name, value in step["env"].items():
            (used,) = re.fullmatch(r"\$\{\{ inputs\.([\w-]+) \}\}", value).groups()
            variables[name] = given[used]
        script = design.parent / "step.sh"
        script.write_text(step["run"])
        variables |= {"GITHUB_WORKSPACE": str(design), "GITHUB_STEP_SUMMARY": str(design.parent / "summary.md")}
        return subprocess.run(
            [BASH, "--noprofile", "--norc", "-eo", "pipefail", str(script)],
            cwd=design,
            env=environment(**variables),
            capture_output=True,
            text=True,
            check=False,
        )

    def test_the_good_mission_passes(self, design: Path) -> None:
        done = self.run(design, "Check the budgets", missions="missions/survey.yaml")
        assert (done.returncode, done.stderr) == (0, "")
        assert re.findall("::[a-z]+ ", done.stdout) == ["::notice "] * done.stdout.count(
            "title=From outside the file"
        )
        assert "pass" in (design.parent / "summary.md").read_text()

    def test_the_bad_mission_fails_with_an_annotation_at_the_line_of_the_value(self, design: Path) -> None:
        done = self.run(design, "Check the budgets", missions="missions/*.yaml", junit="b.xml", sarif="b.sarif")
        assert done.returncode == 1
        errors = [line for line in done.stdout.splitlines() if line.startswith("::error ")]
        lines = (design / "missions" / "fine_survey.yaml").read_text().splitlines()
        for error in errors:
            place = re.match(
                r"::error file=([^,]+),line=(\d+),col=(\d+),endColumn=(\d+),title=FAIL ([\w.]+)::", error
            )
            file, line, first, last, row = place.groups()
            assert file == "missions/fine_survey.yaml"
            value = "200 ug" if row.startswith("transmitter") else "300 ug"
            assert lines[int(line) - 1][int(first) - 1 : int(last) - 1] == value
        assert len(errors) == 4
        assert (design / "b.xml").exists()
        assert (design / "b.sarif").exists()

    def test_inputs_are_data_to_the_shell(self, design: Path) -> None:
        done = self.run(design, "Check the budgets", missions='$(touch a) "; touch b; "', junit="$(touch c).xml")
        assert done.returncode == 2
        assert not any((design / name).exists() for name in "abc")

    def test_the_project_file_holds_in_ci_too(self, design: Path) -> None:
        (design / "pyproject.toml").write_text("[tool.bisar-budget]\nexit-zero = true\n")
        assert self.run(design, "Check the budgets", missions="missions/*.yaml").returncode == 0

    def test_erosion_is_refused_and_stands_in_the_summary(self, design: Path) -> None:
        mission = design / "missions" / "survey.yaml"
        mission.write_text(mission.read_text().replace("300 ug", "700 ug"))
        (design / "missions" / "new.yaml").write_text(mission.read_text())  # nothing to compare with
        inputs = {"missions": "missions/*.yaml", "base": "HEAD"}
        assert self.run(design, "Compare with the base", **inputs).returncode == 0
        done = self.run(design, "Compare with the base", **inputs, **{"fail-on-erosion": "50%"})
        assert done.returncode == 1
        summary = (design.parent / "summary.md").read_text()
        assert "receiver.acceleration.x" in summary
        assert "new.yaml" not in summary

    def test_an_unknown_base_is_said(self, design: Path) -> None:
        done = self.run(design, "Compare with the base", missions="missions/*.yaml", base="origin/none")
        assert done.returncode == 2
        assert "fetch-depth" in done.stdout

    def test_every_input_is_used_and_none_within_a_script(self) -> None:
        text = (ROOT / "action.yml").read_text(encoding="utf-8")
        for name in ACTION["inputs"]:
            assert f"inputs.{name} " in text
        assert not any("${{" in step.get("run", "") for step in ACTION["runs"]["steps"])


class TestExample:
    def test_the_workflow_gives_inputs_that_the_action_has(self) -> None:
        workflow = yaml.safe_load((EXAMPLE / ".github/workflows/budget.yml").read_text(encoding="utf-8"))
        (step,) = [s for s in workflow["jobs"]["budget"]["steps"] if "bisar-budget" in s.get("uses", "")]
        assert step["with"].keys() <= ACTION["inputs"].keys()

    def test_everything_names_the_tag_of_this_version(self) -> None:
        for name in (".github/workflows/budget.yml", ".gitlab-ci.yml", ".pre-commit-config.yaml"):
            assert f"v{__version__}" in (EXAMPLE / name).read_text(encoding="utf-8")

    def test_the_gitlab_job_runs(self, run, monkeypatch, design: Path) -> None:
        job = yaml.safe_load((design / ".gitlab-ci.yml").read_text(encoding="utf-8"))["budget"]
        (script,) = job["script"]
        monkeypatch.chdir(design)
        program, *arguments = script.replace('"', "").split()
        assert program == "bisar-budget"
        assert run(*arguments).exit_code == 1
        assert (design / job["artifacts"]["reports"]["junit"]).exists()


AT_HAND = """import os, sys
sys.path += [path for path in os.environ["AT_HAND"].split(os.pathsep) if path not in sys.path]
"""


class TestPreCommit:
    """The hook as pre-commit runs it: the tool cloned, built and installed, then both missions.

    What the tool imports is not installed anew: it is found behind the packages of the hook's own environment, where
    this run has it, and so is what builds it: no package is fetched. CI builds the wheel in an environment of its
    own, and installs it with all that it asks for, outside the checkout.
    """

    @pytest.fixture
    def tool(self, tmp_path: Path) -> Path:
        """A repository with the files of this checkout, whether committed or not, that asks for no other package."""
        for needed in ("pre_commit", "hatchling"):
            pytest.importorskip(needed, reason=f"{needed} is not installed (extra `test`)")
        listed = subprocess.run(
            ["git", "ls-files", "-co", "--exclude-standard"],
            cwd=ROOT,
            capture_output=True,
            text=True,
            env=environment(),
        )
        if listed.returncode != 0:
            pytest.skip("this is no git checkout, so pre-commit could not clone it")
        folder = tmp_path / "tool"
        for name in listed.stdout.splitlines():
            if (ROOT / name).is_file():
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(ROOT / name, folder / name)
        project = (folder / "pyproject.toml").read_text(encoding="utf-8")
        alone, found = re.subn(r"(?ms)^dependencies = \[.*?^\]$", "dependencies = []", project)
        assert found == 1
        (folder / "pyproject.toml").write_text(alone, encoding="utf-8")
        git(folder, "init", "-q")
        git(folder, "add", "-A")
        git(folder, "commit", "-q", "-m", "tool")
        git(folder, "tag", f"v{__version__}")
        return folder

    def test_fails_on_the_bad_mission_and_passes_on_the_good_one(
        self, tool: Path, design: Path, tmp_path: Path
    ) -> None:
        """By the example's configuration, with the tool's repository filled in; `try-repo` would install it anew
        for each of the three runs."""
        config = (design / ".pre-commit-config.yaml").read_text(encoding="utf-8")
        config = re.sub("https://github.com/OWNER/bisar-budget", str(tool), config)
        (design / ".pre-commit-config.yaml").write_text(config, encoding="utf-8")
        git(design, "add", ".pre-commit-config.yaml")
        (tmp_path / "start").mkdir()
        (tmp_path / "start" / "sitecustomize.py").write_text(AT_HAND, encoding="utf-8")
        here = [sysconfig.get_path(name) for name in ("purelib", "platlib")]
        at_hand = {
            "PRE_COMMIT_HOME": str(tmp_path / "cache"),
            "PYTHONPATH": str(tmp_path / "start"),
            "AT_HAND": os.pathsep.join(dict.fromkeys(here)),
            "PIP_NO_BUILD_ISOLATION": "0",  # pip's word for no isolation
            "PIP_NO_COMPILE": "1",
        }

        def hook(*files: str) -> subprocess.CompletedProcess[str]:
            return subprocess.run(
                [sys.executable, "-m", "pre_commit", "run", "bisar-budget", "--files", *files],
                cwd=design,
                env=environment(**at_hand),
                capture_output=True,
                text=True,
                check=False,
            )

        bad = hook("missions/fine_survey.yaml", "missions/survey.yaml", "pyproject.toml")
        assert bad.returncode == 1, bad.stdout + bad.stderr
        assert "FAIL missions/fine_survey.yaml" in bad.stdout
        assert "pass missions/survey.yaml" in bad.stdout
        (installed,) = (tmp_path / "cache").glob("repo*/py_env-*/lib/python*/site-packages/bisar_budget")
        assert not (installed.parent / "yaml").exists()
        good = hook("missions/survey.yaml", "pyproject.toml")
        assert good.returncode == 0, good.stdout + good.stderr
        assert "Passed" in good.stdout
        assert "Skipped" in hook("pyproject.toml").stdout
