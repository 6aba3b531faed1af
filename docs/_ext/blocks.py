"""Examples of a page, run as a reader would type them and held to what the page says of them.

A console block has commands behind `$ ` and under each the output that it must print; `...` stands for lines that are
left out. Of a decimal number the first six digits are compared: the digits behind them differ between processors. A
command with nothing under it may print anything. One that does not exit with 0 is followed by `$ echo $?`, so that
the page says with what. A YAML block is a mission file, or a section of one, and has to load; one with a `kind` is
the file of a sensor or an oscillator. Python runs. The blocks of a page share a folder, in which `specs` is the
project's, and a Python namespace.
"""

import difflib
import doctest
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import chdir
from pathlib import Path
from typing import Any

import yaml
from click.testing import CliRunner

from bisar_budget.cli import cli

ROOT = Path(__file__).resolve().parent.parent.parent
EXECUTED = ("console", "yaml", "python", "pycon")
_TIMEOUT = 300  # s for one command: a build must end
_COMPARED_DIGITS = 6

# The least that a part of a mission file can be a part of.
_WHOLE = """
schema_version: 1
name: a part of a mission file
radar: { center_frequency: 10 GHz, bandwidth: 300 MHz }
collection: { aperture_time: 5 s }
platforms:
  transmitter: { position: [6 km, 0 km, 2 km], velocity: [0 m/s, 40 m/s, 0 m/s] }
  receiver: { position: [3 km, 3 km, 1 km], velocity: [-20 m/s, 20 m/s, 0 m/s] }
"""


class ExampleError(Exception):
    """An example does not do what its page says; the message says what it does."""


class Page:
    """What the examples of one page share: a folder, a shell's last exit code, a Python namespace."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.names: dict[str, Any] = {"__name__": "example"}
        self.exit_code = 0
        (folder / "specs").symlink_to(ROOT / "specs")

    def run(self, language: str, text: str, file: str = "") -> str:
        """Run one block; a YAML block with the name of a file is kept under it. Return what the page is to show.

        Raises
        ------
        ExampleError
            It does something else than it says.
        """
        if language == "console":
            return self._console(text)
        if language == "yaml":
            self._mission(text)
        elif language == "python":
            with chdir(self.folder):
                self._python(text)
        elif language == "pycon":
            with chdir(self.folder):
                self._session(text)
        if file:
            (self.folder / file).write_text(text, encoding="utf-8")
        return text

    def _console(self, text: str) -> str:
        shown: list[str] = []
        faults: list[str] = []  # of all commands: a build that names the first alone must run once for each
        for command, stated in commands(text):
            if self.exit_code and command != "echo $?":
                faults.append(self._silent(f"the one before `{command}`"))
            got = self._shell(command)
            if stated and not re.fullmatch(_pattern(stated), got):
                difference = difflib.unified_diff(
                    stated.splitlines(), got.splitlines(), "page", "command", lineterm=""
                )
                faults += [f"`{command}` prints something else:", *difference]
            shown.append(f"$ {command}\n{stated or got}")
        if self.exit_code:
            faults.append(self._silent("the last one"))
        if faults:
            raise ExampleError("\n".join(faults))
        return "".join(shown).rstrip("\n")

    def _silent(self, which: str) -> str:
        code, self.exit_code = self.exit_code, 0
        return f"of the commands {which} exits with {code}, and no `$ echo $?` says so"

    def _command(self, *arguments: str, given: str) -> tuple[int, str]:
        """Exit code and output of our command in this process: the page shows neither, and a new one takes longer."""
        unset = dict.fromkeys(os.environ.keys() - _environment().keys())
        with chdir(self.folder):
            done = CliRunner(env=unset).invoke(cli, arguments, input=given, catch_exceptions=False)
        return done.exit_code, done.output

    def _shell(self, command: str) -> str:
        done = subprocess.run(
            ["bash", "-c", f"(exit {self.exit_code}); {command}"],
            cwd=self.folder,
            env=_environment(),
            input="",
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
            timeout=_TIMEOUT,
            check=False,
        )
        self.exit_code = done.returncode
        return done.stdout

    def _mission(self, text: str) -> None:
        """Check a mission file; what has no `schema_version` is put into one. What has a `kind` is no mission."""
        part = yaml.load(text, yaml.BaseLoader)
        if "kind" in part:
            exit_code, told = self._command("sensors", "--check", "-", given=text)
            if exit_code:
                raise ExampleError(f"{told}{text}")
            return
        if "schema_version" not in part:
            whole = _merged(yaml.load(_WHOLE, yaml.BaseLoader), part)
            for platform in whole["platforms"].values():
                if platform.keys() & {"orbit", "trajectory", "latitude"}:  # another way to say where it flies
                    del platform["position"], platform["velocity"]
            text = yaml.safe_dump(whole, sort_keys=False)
        exit_code, told = self._command("check", "-q", "-", given=text)
        if exit_code > 1:
            raise ExampleError(f"{told}{text}")

    def _python(self, text: str) -> None:
        try:
            exec(compile(text, "example", "exec"), self.names)
        except Exception as error:
            raise ExampleError(f"{type(error).__name__}: {error}\n{text}") from error

    def _session(self, text: str) -> None:
        test = doctest.DocTestParser().get_doctest(text, self.names, "example", None, 0)
        told: list[str] = []
        doctest.DocTestRunner(verbose=False).run(test, out=told.append, clear_globs=False)
        self.names.update(test.globs)
        if told:
            raise ExampleError("".join(told))


def blocks(page: str) -> list[tuple[str, str]]:
    """The fenced blocks of a Markdown page, each with the word behind its fence."""
    return re.findall(r"(?ms)^```(\S+)[^\n]*\n(.*?)^```", page)


def commands(text: str) -> Iterator[tuple[str, str]]:
    """Split a console block into commands, each with the output stated under it."""
    for part in re.split(r"(?m)^\$ ", text)[1:]:
        command, _, stated = part.partition("\n")
        yield command, stated.rstrip("\n") + "\n" if stated.strip() else ""


def _pattern(stated: str) -> str:
    lines = ("(?:.*\n)*?" if line == "..." else _line_pattern(line) + "\n" for line in stated.splitlines())
    return "".join(lines)


def _line_pattern(line: str) -> str:
    """The expression of a line, with any digits behind the sixth of a decimal number."""
    return re.sub(r"(\d+)\\\.(\d+)", _number_pattern, re.escape(line))


def _number_pattern(number: re.Match[str]) -> str:
    whole, decimals = number.groups()
    spare_count = len(f"{whole}{decimals}".lstrip("0")) - _COMPARED_DIGITS
    if spare_count <= 0:
        return number[0]
    return rf"{whole}\.{decimals[: max(len(decimals) - spare_count, 0)]}\d*"


def _environment() -> dict[str, str]:
    """This environment without what would change an output, with this interpreter's commands first."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("BISAR_BUDGET_", "GIT_"))}
    for name in ("COLUMNS", "NO_COLOR", "SOURCE_DATE_EPOCH", "CI", "GITHUB_ACTIONS"):
        kept.pop(name, None)
    who = {f"GIT_{role}_{what}": "engineer" for role in ("AUTHOR", "COMMITTER") for what in ("NAME", "EMAIL")}
    path = f"{Path(sys.executable).parent}{os.pathsep}{kept.get('PATH', '')}"
    return kept | who | {"PATH": path, "LC_ALL": "C.UTF-8", "GIT_CONFIG_GLOBAL": os.devnull}


def _merged(whole: dict[str, Any], part: dict[str, Any]) -> dict[str, Any]:
    both = {key: _merged(whole[key], part[key]) for key in whole.keys() & part.keys() if isinstance(part[key], dict)}
    return whole | part | both
