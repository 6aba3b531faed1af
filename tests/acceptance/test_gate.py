"""The gate as others run it: the scripts of the GitHub action, the pre-commit hook, the example repository."""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Mapping
from pathlib import Path

import pytest
import yaml

from bisar_budget import __version__
from tests.conftest import ROOT

EXAMPLE = ROOT / "examples" / "design-repo"
ACTION = yaml.safe_load((ROOT / "action.yml").read_text(encoding="utf-8"))
PACKAGES = list(dict.fromkeys(sysconfig.get_path(name) for name in ("purelib", "platlib")))
BASH = shutil.which("bash")
EROSION = {"fail-on-erosion": "50%"}


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


# What a repository may have in its root, or a workflow on PYTHONPATH, by the name of what the gate imports, of what
# starts the workers, and of what installs it.
TRAPS = (
    *("bisar_budget", "click", "yaml", "numpy", "jinja2", "json", "pip", "venv", "ensurepip", "sitecustomize"),
    *("multiprocessing", "pickle", "socket", "signal", "distributed"),
)
ON_WORKERS = ("--monte-carlo", "10", "--scheduler", "local:1")


def set_trap(folder: Path, name: str) -> None:
    """Put a package in a folder that makes whoever imports it exit with 0, and leaves its name in `caught`."""
    (folder / name).mkdir()
    lines = [
        "import os",
        f"with open({str(folder.parent / 'caught')!r}, 'a') as file:",
        f"    print({name!r}, file=file)",
    ]
    (folder / name / "__init__.py").write_text("\n".join([*lines, "os._exit(0)"]), encoding="utf-8")
    (folder / name / "__main__.py").write_text("", encoding="utf-8")


def caught(folder: Path) -> list[str]:
    """Names of the traps that somebody imported."""
    file = folder.parent / "caught"
    return file.read_text(encoding="utf-8").split() if file.exists() else []


def set_traps(folder: Path) -> dict[str, str]:
    """Put all traps in a folder; gives the variables that lead there."""
    for name in (*TRAPS, "usercustomize"):  # no environment of its own imports that one
        set_trap(folder, name)
    (folder / "pip.conf").write_text("[global]\ntarget = vendor\n", encoding="utf-8")
    (folder / "setup.cfg").write_text("[install]\nprefix = vendor\n", encoding="utf-8")
    (folder / "constraints.txt").write_text("bisar-budget == 9\n", encoding="utf-8")
    (folder / ".python-version").write_text("2.7\n", encoding="utf-8")
    here = str(folder)
    python = {"PYTHONPATH": here, "PYTHONHOME": here, "PYTHONUSERBASE": here, "PYTHONSTARTUP": "click/__init__.py"}
    pip = {
        "PIP_CONFIG_FILE": "pip.conf",
        "PIP_CONSTRAINT": "constraints.txt",
        "PIP_TARGET": "vendor",
        "PIP_USER": "1",
    }
    return python | pip | {"_BISAR_BUDGET_COMPLETE": "bash_source"}


# Builds a wheel of nothing but the folders where this run has the package and what it imports; asks for no package.
BACKEND = """import zipfile

def build_wheel(folder, settings=None, metadata=None):
    about = "bisar_budget-0.dist-info/"
    files = {
        "at_hand.pth": %r,
        about + "METADATA": "Metadata-Version: 2.1\\nName: bisar-budget\\nVersion: 0\\n",
        about + "WHEEL": "Wheel-Version: 1.0\\nGenerator: t\\nRoot-Is-Purelib: true\\nTag: py3-none-any\\n",
        about + "entry_points.txt": "[console_scripts]\\nbisar-budget = bisar_budget.cli:main\\n",
    }
    name = "bisar_budget-0-py3-none-any.whl"
    with zipfile.ZipFile(f"{folder}/{name}", "w") as wheel:
        for path, text in files.items():
            wheel.writestr(path, text)
        wheel.writestr(about + "RECORD", "".join(f"{path},,\\n" for path in [*files, about + "RECORD"]))
    return name
"""
PROJECT = '[build-system]\nrequires = []\nbuild-backend = "backend"\nbackend-path = ["."]\n'


def run_step(
    folder: Path, step_name: str, inputs: Mapping[str, str], outputs: Mapping[str, str], **variables: str
) -> subprocess.CompletedProcess[str]:
    """Run a step of the action as a runner of GitHub: the script in a file, `bash -eo pipefail`, inputs as variables.

    `outputs` are those of the steps before it, by the names that the action calls them.
    """
    (step,) = [step for step in ACTION["runs"]["steps"] if step.get("name") == step_name]
    given = {f"inputs.{name}": spec.get("default", "") for name, spec in ACTION["inputs"].items()}
    given |= {f"inputs.{name}": text for name, text in inputs.items()} | outputs
    for name, value in step["env"].items():
        (used,) = re.fullmatch(r"\$\{\{ ([\w.-]+) \}\}", value).groups()
        variables[name] = given[used]
    script = folder.parent / "step.sh"
    script.write_text(step["run"], encoding="utf-8")
    variables |= {"GITHUB_WORKSPACE": str(folder), "GITHUB_STEP_SUMMARY": str(folder.parent / "summary.md")}
    return subprocess.run(
        [BASH, "--noprofile", "--norc", "-eo", "pipefail", str(script)],
        cwd=folder,
        env=environment(**variables),
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture(scope="module")
def python(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Python with the tool, as the action's own step installs it, in a repository full of traps."""
    folder = tmp_path_factory.mktemp("install")
    design, tool = folder / "design", folder / "tool"
    for made in (design, tool, folder / "temp"):
        made.mkdir()
    variables = set_traps(design)
    (tool / "pyproject.toml").write_text(PROJECT, encoding="utf-8")
    (tool / "backend.py").write_text(BACKEND % "\n".join([str(ROOT), *PACKAGES]), encoding="utf-8")
    variables |= {"RUNNER_OS": "Linux", "RUNNER_TEMP": str(folder / "temp"), "GITHUB_ACTION_PATH": str(tool)}
    variables |= {"GITHUB_OUTPUT": str(folder / "output"), "PIP_NO_INDEX": "1"}
    done = run_step(
        design, "Install bisar-budget", {}, {"steps.setup.outputs.python-path": sys.executable}, **variables
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert caught(design) == []
    assert f"bisar-budget, version {__version__}" in done.stdout
    assert not (design / "vendor").exists()
    (line,) = (folder / "output").read_text(encoding="utf-8").splitlines()
    name, _, path = line.partition("=")
    assert name == "python"
    assert Path(path).is_relative_to(folder / "temp")
    return path


@pytest.mark.skipif(BASH is None, reason="the action's scripts are for bash")
class TestAction:
    @pytest.fixture(autouse=True)
    def tool(self, python: str) -> None:
        self.outputs = {"steps.install.outputs.python": python}

    def run(
        self, design: Path, step_name: str, variables: Mapping[str, str] = {}, **inputs: str
    ) -> subprocess.CompletedProcess[str]:
        return run_step(design, step_name, inputs, self.outputs, **variables)

    @pytest.mark.parametrize("name", TRAPS)
    def test_a_trap_catches_who_is_not_isolated(self, design: Path, python: str, name: str) -> None:
        """Else the tests below would show nothing: each of the traps lets a Python pass that is not isolated."""
        if name == "distributed":
            pytest.importorskip("distributed", reason="not installed (extra `cluster`)")
        set_trap(design, name)
        program = name if name in ("pip", "venv", "ensurepip") else "bisar_budget"
        command = [python, "-m", program, "check", "missions/fine_survey.yaml", "--report", "b.html", *ON_WORKERS]
        done = subprocess.run(command, cwd=design, env=environment(PYTHONPATH=str(design)), capture_output=True)
        assert (done.returncode, caught(design)) == (0, [name])

    def test_no_file_and_no_variable_takes_the_place_of_the_tool(self, design: Path) -> None:
        mission = design / "missions" / "survey.yaml"
        mission.write_text(mission.read_text().replace("300 ug", "700 ug"))
        variables = set_traps(design)
        inputs = {"missions": "missions/*.yaml", "base": "HEAD", "junit": "b.xml", "sarif": "b.sarif"} | EROSION
        check = self.run(design, "Check the budgets", variables, **inputs)
        assert (check.returncode, check.stderr) == (1, "")
        assert len(re.findall("(?m)^::error .*title=FAIL ", check.stdout)) >= 4
        diff = self.run(design, "Compare with the base", variables, **inputs)
        assert (diff.returncode, diff.stderr) == (1, "")
        assert "receiver.acceleration.x" in (design.parent / "summary.md").read_text()
        assert caught(design) == []

    @pytest.mark.parametrize("is_script", [True, False])
    def test_no_file_takes_the_place_of_a_module_in_a_worker(
        self, design: Path, python: str, is_script: bool
    ) -> None:
        """A worker is an interpreter of its own, that of a command too that is not isolated."""
        pytest.importorskip("distributed", reason="not installed (extra `cluster`)")
        variables = {} if is_script else {"PYTHONPATH": str(design)}
        set_traps(design)
        program = [str(Path(python).with_name("bisar-budget"))] if is_script else [python, "-I", "-m", "bisar_budget"]
        done = subprocess.run(
            [*program, "check", "-q", "missions/fine_survey.yaml", *ON_WORKERS],
            cwd=design,
            env=environment(**variables),
            capture_output=True,
            text=True,
        )
        assert (done.returncode, caught(design)) == (1, []), done.stderr

    @pytest.mark.parametrize(
        ("strict", "code"),
        [
            *((word, 1) for word in ("true", "True", "TRUE", "yes", "on", "1", " true\n")),
            *((word, 0) for word in ("false", "False", "FALSE", "no", "off", "0", "", " ", "false\n")),
            *(
                (word, 2)
                for word in ("yes?", "2", "t rue", "strict", "true false", "*", "--", "x\n::notice::y", "50%0A")
            ),
        ],
    )
    def test_strict_is_read_or_refused(self, design: Path, strict: str, code: int) -> None:
        (design / "pyproject.toml").unlink()  # says strict
        mission = design / "missions" / "survey.yaml"
        mission.write_text(mission.read_text().replace("combine: each", "combine: each\n  warn_above: 0.1"))
        done = self.run(design, "Check the budgets", missions="missions/survey.yaml", strict=strict)
        assert done.returncode == code, done.stdout + done.stderr
        if code == 2:
            (line,) = done.stdout.splitlines()
            assert line.startswith("::error title=bisar-budget::input strict: must be true or false (got ")
            assert "%0A" not in line

    @pytest.mark.parametrize("name", ["*.yaml", "[a-z]*.yaml", "?*.yaml"])
    def test_a_file_named_like_the_pattern_is_one_of_many(self, design: Path, name: str) -> None:
        (design / "missions" / name).write_text((design / "missions" / "survey.yaml").read_text())
        done = self.run(design, "Check the budgets", missions=f"missions/{name}")
        assert done.returncode == 1
        assert "missions/fine_survey.yaml" in done.stdout

    def test_a_file_named_like_an_option_is_a_mission(self, design: Path) -> None:
        shutil.copy(design / "missions" / "fine_survey.yaml", design / "--exit-zero.yaml")
        shutil.copy(design / "missions" / "fine_survey.yaml", design / "--exit-zero")
        for pattern in ("*.yaml", "--exit-zero", "-*"):
            done = self.run(design, "Check the budgets", missions=pattern)
            assert (done.returncode, "FAIL transmitter" in done.stdout) == (1, True)

    @pytest.mark.parametrize("command", ["tag", "branch"])
    def test_the_branch_of_the_remote_is_the_base(self, design: Path, command: str) -> None:
        """Whoever may push could make a tag of the same name, which Git would take, at the change itself."""
        git(design, "update-ref", "refs/remotes/origin/main", "HEAD")
        mission = design / "missions" / "survey.yaml"
        mission.write_text(mission.read_text().replace("300 ug", "700 ug"))
        git(design, "commit", "-qam", "looser")
        git(design, command, "origin/main")
        inputs = {"missions": "missions/survey.yaml", "base": "origin/main"}
        assert self.run(design, "Compare with the base", **inputs, **EROSION).returncode == 1

    def test_a_bare_repository_among_the_missions_is_not_asked(self, design: Path) -> None:
        """One with a revision of the same name, in which the mission was as loose as it is now."""
        mission = design / "missions" / "survey.yaml"
        mission.write_text(mission.read_text().replace("300 ug", "700 ug"))
        other = design.parent / "other"
        other.mkdir()
        git(other, "init", "-q", "-b", "main")
        shutil.copy(mission, other)
        git(other, "add", "-A")
        git(other, "commit", "-q", "-m", "as loose as now")
        git(design, "branch", "-M", "main")
        git(other, "config", "core.worktree", ".")
        shutil.copytree(other / ".git", mission.parent, dirs_exist_ok=True)
        done = self.run(design, "Compare with the base", missions="missions/survey.yaml", base="main", **EROSION)
        assert done.returncode == 1
        _, _, refused = done.stdout.partition("#### Refused")
        assert "- receiver.acceleration.x: uses up" in refused

    def test_a_windows_runner_is_refused(self, design: Path) -> None:
        outputs = {"steps.setup.outputs.python-path": sys.executable}
        done = run_step(
            design, "Install bisar-budget", {}, outputs, RUNNER_OS="Windows", RUNNER_TEMP=str(design.parent)
        )
        assert done.returncode == 2
        assert done.stdout.startswith("::error title=bisar-budget::")

    def test_the_good_mission_passes(self, design: Path) -> None:
        done = self.run(design, "Check the budgets", missions="missions/survey.yaml")
        assert (done.returncode, done.stderr) == (0, "")
        assert re.findall("::[a-z]+ ", done.stdout) == ["::notice "] * done.stdout.count("title=Overrides")
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

    def test_a_folder_of_the_checkout_is_where_the_missions_are(self) -> None:
        steps = [step for step in ACTION["runs"]["steps"] if "inputs.missions" in str(step.get("env"))]
        assert {step["working-directory"] for step in steps} == {"${{ inputs.working-directory || '.' }}"}

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
        done = self.run(design, "Compare with the base", **inputs, **EROSION)
        assert done.returncode == 1
        summary = (design.parent / "summary.md").read_text()
        assert "receiver.acceleration.x" in summary
        assert "missions/new.yaml: new, there is nothing to compare it with" in summary

    def test_an_unknown_base_is_said(self, design: Path) -> None:
        done = self.run(design, "Compare with the base", missions="missions/*.yaml", base="origin/none")
        assert done.returncode == 2
        assert "fetch-depth" in done.stdout

    def test_every_input_is_used_and_none_within_a_script(self) -> None:
        text = (ROOT / "action.yml").read_text(encoding="utf-8")
        for name in ACTION["inputs"]:
            assert f"inputs.{name} " in text
        assert not any("${{" in step.get("run", "") for step in ACTION["runs"]["steps"])

    def test_a_step_uses_outputs_of_steps_before_it(self) -> None:
        known: list[str] = []
        for step in ACTION["runs"]["steps"]:
            assert set(re.findall(r"steps\.([\w-]+)\.", str(step))) <= set(known)
            known += [step["id"]] if "id" in step else []
        assert known == ["setup", "install"]


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
        program = "python -I -m bisar_budget "
        assert script.startswith(program)
        arguments = script.removeprefix(program).replace('"', "").split()
        assert run(*arguments).exit_code == 1
        assert (design / job["artifacts"]["reports"]["junit"]).exists()


class TestPreCommit:
    """The hook as pre-commit runs it: the tool cloned, built and installed, then both missions.

    What the tool imports is not installed anew: a list in its wheel leads to where this run has it, behind the
    packages of the hook's own environment. PYTHONPATH leads to what builds it, and no package is fetched. CI builds
    the wheel in an environment of its own, and installs it with all that it asks for, outside the checkout.
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
        table = "[tool.hatch.build.targets.wheel.force-include]\n"
        alone = alone.replace(table, f'{table}"at_hand.pth" = "at_hand.pth"\n')
        (folder / "pyproject.toml").write_text(alone, encoding="utf-8")
        (folder / "at_hand.pth").write_text("\n".join(PACKAGES), encoding="utf-8")
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
        variables = {
            "PRE_COMMIT_HOME": str(tmp_path / "cache"),
            "PYTHONPATH": os.pathsep.join(PACKAGES),
            "PIP_NO_BUILD_ISOLATION": "0",  # pip's word for no isolation
            "PIP_NO_COMPILE": "1",
        }

        def hook(*files: str) -> subprocess.CompletedProcess[str]:
            return subprocess.run(
                [sys.executable, "-I", "-m", "pre_commit", "run", "bisar-budget", *(files and ("--files", *files))],
                cwd=design,
                env=environment(**variables),
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
        good = hook("missions/survey.yaml", "README.md")
        assert good.returncode == 0, good.stdout + good.stderr
        assert "Passed" in good.stdout
        assert hook("README.md").returncode == 0
        settings = hook("pyproject.toml")  # hold every mission below their folder
        assert settings.returncode == 1
        assert "FAIL missions/fine_survey.yaml" in settings.stdout

        # A commit that only deletes: pre-commit has no file to pass on.
        (design / "unit.yaml").write_text("kind: imu\nname: unit\naccelerometer_bias: 100 ug\nsource: sheet\n")
        good_mission = design / "missions" / "survey.yaml"
        text = good_mission.read_text(encoding="utf-8")
        text = text.replace("    motion_error:\n", "    motion_error:\n      sensor: ../unit.yaml\n", 1)
        assert "../unit.yaml" in text
        good_mission.write_text(text, encoding="utf-8")
        git(design, "add", "-A")
        git(design, "commit", "-q", "--no-verify", "-m", "a part")
        git(design, "rm", "-q", "unit.yaml")
        deleted = hook()
        assert deleted.returncode == 1
        assert "missions/survey.yaml" in deleted.stdout
        git(design, "reset", "-q", "--hard", "HEAD")

        variables["PYTHONPATH"] = set_traps(design)["PYTHONPATH"]
        trapped = hook("missions/fine_survey.yaml")
        assert trapped.returncode == 1, trapped.stdout + trapped.stderr
        assert "FAIL missions/fine_survey.yaml" in trapped.stdout
        assert caught(design) == []
