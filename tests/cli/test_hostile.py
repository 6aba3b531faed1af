"""What other people's machines, files and terminals do to a command that runs on every commit.

`run` is the command in this process, which takes a tenth of the time. `spawn` is one of its own, for what only that
shows: signals, descriptors, what Python reads of its environment when it starts.
"""

import codecs
import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

import pytest
import yaml
from click.testing import CliRunner

from bisar_budget import resources
from bisar_budget.budget import check as checking
from bisar_budget.budget.check import check_mission
from bisar_budget.cli import _end as end
from bisar_budget.cli import cli
from bisar_budget.cli.streams import harmless, replacing, write_file
from bisar_budget.effects.vibration import spectrum_pieces
from bisar_budget.faults import MissionError
from bisar_budget.findings.mission import Report
from bisar_budget.mission import load
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.model import mission_schema
from bisar_budget.mission.tree import MAX_FAULT_COUNT
from bisar_budget.mission.vibrations import Spectrum
from bisar_budget.report import Style, render
from bisar_budget.report.drawing import point_plot
from bisar_budget.workers import worker_pool
from tests.conftest import APART, ROOT, TEXT_FORMATS, TODAY, findings, heed_signals, mission_text
from tests.fuzz import RAW, RUN, case, from_schema
from tests.mission.test_path_files import satellite
from tests.paths.orbit_files import TLE

COMMAND = [sys.executable, "-m", "bisar_budget"]
SMALL = {"collection__aperture_time": "1 s", "radar__bandwidth": "20 MHz"}  # an image of few pixels
SECTION_V = ROOT / "specs" / "missions" / "rigling_moses_section_v.yaml"
needs_proc = pytest.mark.skipif(not os.path.isdir("/proc/self/task"), reason="asks /proc for processes")


@pytest.fixture
def mission(tmp_path) -> Path:
    path = tmp_path / "m.yaml"
    path.write_text(mission_text(timing_error__quadratic=6e-13))  # passes, unless strict
    return path


class Done(NamedTuple):
    """A command that ended, as bytes."""

    returncode: int
    stdout: bytes
    stderr: bytes


def run(*arguments, cwd=ROOT, env: Mapping[str, str] | None = None, encoding: str = "utf-8") -> Done:
    """Run the command in this process, with more variables, on streams of an encoding."""
    runner = CliRunner(charset=encoding, **APART)
    with contextlib.chdir(cwd):
        # A process of its own leaves two columns of 80, as Click does.
        result = runner.invoke(cli, [*map(str, arguments)], env=env, terminal_width=78)
    return Done(result.exit_code, result.stdout_bytes, result.stderr_bytes or b"")


def spawn(*arguments, cwd=ROOT, env: Mapping[str, str] | None = None, **options) -> Done:
    """Run the command in a process of its own, with more variables."""
    command = [*COMMAND, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, cwd=cwd, env={**os.environ, **(env or {})}, **options)
    return Done(done.returncode, done.stdout, done.stderr)


def children(pid: int) -> set[int]:
    try:
        return {int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()}
    except OSError:
        return set()


def threads(pid: int) -> int:
    try:
        return len(os.listdir(f"/proc/{pid}/task"))
    except OSError:
        return 0


def is_running(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def until(condition, seconds: float = 60.0) -> bool:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.05)
    return False


@needs_proc
class TestWorkers:
    """Signals left workers and a resource tracker behind, which held standard output."""

    @pytest.fixture
    def plain(self, tmp_path) -> dict[str, str]:
        """Variables of a process without compiled kernels: three processes start in half the time."""
        (tmp_path / "numba.py").write_text("raise ImportError")
        return {**os.environ, "PYTHONPATH": str(tmp_path)}

    def start(self, **options) -> tuple[subprocess.Popen, set[int]]:
        process = subprocess.Popen(
            [*COMMAND, "verify", str(SECTION_V), "--jobs", "2"], cwd=ROOT, preexec_fn=heed_signals, **options
        )
        # Two workers, with a thread that watches their parent each, and the tracker of their resources.
        assert until(lambda: sum(threads(child) > 1 for child in children(process.pid)) == 2, 120)
        assert len(children(process.pid)) == 3
        return process, children(process.pid)

    @pytest.mark.parametrize(
        ("number", "code"),
        [
            (signal.SIGTERM, 143),
            (signal.SIGHUP, 129),
            (signal.SIGINT, 130),
            (signal.SIGKILL, -signal.SIGKILL),
        ],
    )
    def test_no_signal_leaves_one(self, plain, number: int, code: int) -> None:
        environment = os.environ if number == signal.SIGTERM else plain
        process, workers = self.start(stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment)
        process.send_signal(number)
        output, errors = process.communicate(timeout=60)  # ends when nobody holds the pipes
        assert process.returncode == code
        assert until(lambda: not any(map(is_running, workers)), 20)
        assert output == b""
        assert b"Traceback" not in errors

    def test_the_pool_s_thread_ends_first(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Python woke it at its own exit through a pipe that it was closing: a traceback after an interrupt."""
        monkeypatch.setattr(threading, "excepthook", threading.excepthook)
        before = set(threading.enumerate())

        def those_that_keep_python() -> list[threading.Thread]:
            return [thread for thread in set(threading.enumerate()) - before if not thread.daemon]

        def interrupted() -> None:
            with worker_pool(1, "spawn") as pool:
                pool.submit(time.sleep, 60)
                assert those_that_keep_python()
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            interrupted()
        assert not those_that_keep_python()

    def test_a_killed_worker_is_said(self, plain) -> None:
        process, workers = self.start(stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=plain)
        lines = {pid: Path(f"/proc/{pid}/cmdline").read_bytes() for pid in workers}
        os.kill(next(pid for pid, line in lines.items() if b"spawn_main" in line), signal.SIGKILL)
        output, errors = process.communicate(timeout=60)
        assert process.returncode == 2
        assert b"a worker process was ended from outside" in errors
        assert b"Traceback" not in errors
        assert output == b""
        assert until(lambda: not any(map(is_running, workers)), 20)


def test_a_fault_of_ours_is_no_interrupt(monkeypatch) -> None:
    """An EOFError, as of a module cut off, ended in 130 without a word: Click takes it for Ctrl-D."""

    def cut_off(*_: object) -> None:
        raise EOFError("marshal data too short")

    monkeypatch.setattr("bisar_budget.cli.sweep.load_all", cut_off)
    done = run("sweep", SECTION_V, "--vary", "collection.aperture_time=1:2s:3")
    assert done.returncode == 3
    assert b"EOFError: marshal data too short" in done.stderr


@pytest.mark.skipif(not hasattr(signal, "SIGTERM") or sys.platform == "win32", reason="needs POSIX signals")
class TestInterrupted:
    """A signal comes while the temporary file is written, wherever that is."""

    @pytest.fixture
    def folder(self, tmp_path) -> Path:
        (tmp_path / "m.yaml").write_text(mission_text(**SMALL))
        (tmp_path / "reports").mkdir()
        return tmp_path

    def assert_only_the_old_one_is_left(self, report: Path) -> None:
        assert [path.name for path in report.parent.iterdir()] == [report.name]
        assert report.read_text() == "old"

    def test_a_report_of_a_process_of_its_own(self, folder) -> None:
        script = (
            "import os, signal, sys\n"
            "from bisar_budget.cli import main\n"
            "import bisar_budget.cli.streams\n"
            "chmod = os.chmod\n"
            "os.chmod = lambda *a: (os.kill(os.getpid(), signal.SIGTERM), chmod(*a))\n"
            "main()\n"
        )
        report = folder / "reports" / "r.html"
        report.write_text("old")
        arguments = ["check", str(folder / "m.yaml"), "-o", str(report)]
        assert subprocess.run([sys.executable, "-c", script, *arguments], cwd=ROOT).returncode == 143
        self.assert_only_the_old_one_is_left(report)

    @pytest.mark.parametrize(("option", "name"), [("-o", "images.npz"), ("--plot", "sheet.png")])
    def test_images(self, folder, monkeypatch, option: str, name: str) -> None:
        report = folder / "reports" / name
        report.write_text("old")
        monkeypatch.setattr(
            point_plot, "drawn", lambda *given, **options: b"a sheet"
        )  # what is in it does not matter here
        chmod = os.chmod
        monkeypatch.setattr(os, "chmod", lambda *given: (os.kill(os.getpid(), signal.SIGTERM), chmod(*given)))
        before = signal.signal(signal.SIGTERM, end)
        try:
            done = run("simulate", folder / "m.yaml", option, report)
        finally:
            signal.signal(signal.SIGTERM, before)
        assert done.returncode == 143
        self.assert_only_the_old_one_is_left(report)


class TestSettings:
    """A gate passed because a setting was not read."""

    @pytest.mark.parametrize(
        "text",
        [
            "tool = {bisar-budget = {strict = true}}",
            "tool = { 'bisar-budget' = { strict = true } }",
            'tool = {"x" = 1,"bisar-budget" = {strict = true}}',
            '[tool."bisar\\u002dbudget"]\nstrict = true',
            '["\\u0074ool"."\\U00000062isar-budget"]\nstrict = true',
        ],
    )
    def test_every_form_of_the_table_counts(self, mission, text: str) -> None:
        (mission.parent / "pyproject.toml").write_text(text)
        assert run("check", mission.name, cwd=mission.parent).returncode == 1

    @pytest.mark.parametrize(
        ("data", "message"),
        [
            ("[tool.bisar-budget]\nstrict = true".encode("utf-16"), b"is not UTF-8"),
            ("[tool.bisar-budget]\nstrict = true".encode("utf-16-le"), b"is not valid TOML"),
            (codecs.BOM_UTF8 + b"[tool.bisar-budget]\nstrict = true", b"is not valid TOML"),
            (b'name = "caf\xe9"\n[tool.bisar-budget]\nstrict = true', b"is not UTF-8"),
            (b"[tool.bisar-budget\nstrict = true", b"is not valid TOML"),
            (b'tool = {"bisar-budget"\x1e= {strict = true}}', b"is not valid TOML"),
            (b'tool = {"bisar-budget"-= {strict = true}}', b"is not valid TOML"),
            (b"x = " + b"[" * 5000 + b"]" * 5000 + b"\n[tool.bisar-budget]", b"pyproject.toml: is "),
            (b"# " + b"x" * (1 << 20) + b"\n[tool.bisar-budget]\nstrict = true", b"is larger than 1 MiB"),
        ],
    )
    def test_what_cannot_be_read_is_2(self, mission, data: bytes, message: bytes) -> None:
        (mission.parent / "pyproject.toml").write_bytes(data)
        done = run("check", mission.name, cwd=mission.parent)
        assert done.returncode == 2
        assert message in done.stderr
        assert b"Traceback" not in done.stderr
        assert done.stdout == b""

    @pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
    def test_a_pipe_is_refused_at_once(self, mission) -> None:
        os.mkfifo(mission.parent / "pyproject.toml")
        done = spawn("check", mission.name, cwd=mission.parent, timeout=60)
        assert done.returncode == 2
        assert b"pyproject.toml: is no regular file" in done.stderr

    @pytest.mark.skipif(sys.platform == "win32", reason="a folder in use cannot be deleted there")
    def test_a_deleted_working_folder_has_no_settings(self, mission, tmp_path) -> None:
        folder = tmp_path / "gone"
        folder.mkdir()
        script = "import os, sys; os.rmdir(os.getcwd()); from bisar_budget.cli import main; main()"
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        done = subprocess.run(
            [sys.executable, "-c", script, "check", str(mission)], capture_output=True, cwd=folder, env=environment
        )
        assert done.returncode == 0, done.stderr


class TestEncodings:
    """Machine formats came in the terminal's encoding, which their readers do not know."""

    @pytest.mark.parametrize("format_name", ["json", "csv", "junit", "sarif", "github", "html", "markdown"])
    def test_what_programs_read_is_utf_8_whatever_the_terminal(self, tmp_path, format_name: str) -> None:
        path = tmp_path / "m.yaml"
        name = "Höhe φ 雷達"
        broken = {"other_errors": [{"name": name, "quadratic_phase_error": "90 deg"}]}  # what some formats name alone
        path.write_text(mission_text(name=name, **broken), encoding="utf-8")
        outputs = {
            encoding: run("check", path, "--format", format_name, encoding=encoding)
            for encoding in ("utf-8", "latin-1", "ascii")
        }
        assert len({done.stdout for done in outputs.values()}) == 1
        assert "Höhe" in outputs["ascii"].stdout.decode("utf-8").replace(r"\u00f6", "ö")

    def test_a_table_of_cases_is_utf_8_too(self, tmp_path) -> None:
        path = tmp_path / "m.yaml"
        path.write_text(mission_text(name="Höhe φ 雷達", timing_error__quadratic=6e-13), encoding="utf-8")
        asked = ("sweep", path, "--vary", "collection.aperture_time=1s")
        tables = {run(*asked, encoding=encoding).stdout for encoding in ("utf-8", "ascii")}
        assert len(tables) == 1
        assert "Höhe φ 雷達" in tables.pop().decode("utf-8")

    def test_text_follows_the_terminal_and_escapes_what_it_lacks(self, tmp_path) -> None:
        path = tmp_path / "m.yaml"
        path.write_text(mission_text(name="Höhe φ"), encoding="utf-8")
        done = spawn("check", path, env={"PYTHONIOENCODING": "latin-1"})
        assert "Höhe \\u03c6" in done.stdout.decode("latin-1")
        assert run("check", path, encoding="latin-1") == done
        machine = ("check", path, "--format", "junit")
        assert run(*machine, encoding="ascii") == spawn(*machine, env={"PYTHONIOENCODING": "ascii"})


class TestOutputs:
    @pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full here")
    @pytest.mark.parametrize("arguments", [["--help"], ["--version"], ["check", "--help"], ["schema"], ["init", "-"]])
    def test_a_full_device_is_2(self, arguments) -> None:
        with open("/dev/full", "wb") as full:
            done = subprocess.run([*COMMAND, *arguments], stdout=full, stderr=subprocess.PIPE, cwd=ROOT)
        assert done.returncode == 2
        assert b"cannot write standard output: No space left on device" in done.stderr
        assert b"Traceback" not in done.stderr

    @pytest.mark.skipif(sys.platform == "win32", reason="descriptors are handles there")
    @pytest.mark.parametrize(
        ("arguments", "code"), [(["--help"], 0), (["--version"], 0), (["schema"], 2), (["--nonsense"], 2)]
    )
    @pytest.mark.parametrize("closed", [[1], [2], [0, 1, 2]])
    def test_closed_streams_are_no_fault_of_the_tool(self, arguments, code: int, closed) -> None:
        """A usage error went to standard output where standard error was closed."""
        script = f"exec {' '.join(COMMAND)} {' '.join(arguments)} {' '.join(f'{number}>&-' for number in closed)}"
        done = subprocess.run(["sh", "-c", script], capture_output=True, cwd=ROOT)
        assert done.returncode == (0 if closed == [2] and code == 2 and arguments == ["schema"] else code)
        assert b"Traceback" not in done.stderr
        assert b"Usage" not in done.stdout or arguments == ["--help"]

    @pytest.mark.skipif(sys.platform == "win32", reason="pipes end otherwise there")
    @pytest.mark.parametrize("arguments", [["--help"], ["check", "--help"], ["schema"]])
    def test_a_reader_that_went_away_changes_nothing(self, arguments) -> None:
        reader, writer = os.pipe()
        os.close(reader)
        done = subprocess.run([*COMMAND, *arguments], stdout=writer, stderr=subprocess.PIPE, cwd=ROOT)
        os.close(writer)
        assert (done.returncode, done.stderr) == (0, b"")


@pytest.mark.parametrize("epoch", ["\uff11\uff12", "1_000", "-5", "+5", " 5", "1e9", "9" * 30])
def test_only_ascii_digits_are_a_source_date(mission, epoch: str) -> None:
    done = run("check", mission, env={"SOURCE_DATE_EPOCH": epoch})
    assert done.returncode == 2
    assert b"SOURCE_DATE_EPOCH must be seconds since 1970" in done.stderr


def test_a_report_allows_nothing_but_its_own_styles_and_images(tmp_path, mission) -> None:
    run("check", mission, "--report", tmp_path / "r.html")
    (policy,) = [line for line in (tmp_path / "r.html").read_text().splitlines() if "Content-Security-Policy" in line]
    for part in ("default-src 'none'", "style-src 'unsafe-inline'", "img-src data:", "base-uri 'none'"):
        assert part in policy
    assert "script-src" not in policy


class TestTargets:
    """Two reports in one file, or a report over the mission that standard input came from, were written."""

    def test_two_outputs_to_one_file_are_refused(self, mission, tmp_path) -> None:
        done = run("check", mission, "--report", tmp_path / "a.json", "-o", tmp_path / "." / "a.json")
        assert done.returncode == 2
        assert b"two outputs would be written to one file" in done.stderr
        assert not (tmp_path / "a.json").exists()

    def test_the_file_of_standard_input_is_no_target(self, mission) -> None:
        before = mission.read_bytes()
        with mission.open("rb") as file:
            done = spawn("check", "-", "-o", mission, stdin=file)
        assert done.returncode == 2
        assert b"is to be read; a result would replace it" in done.stderr
        assert mission.read_bytes() == before

    @pytest.mark.skipif(sys.platform == "win32", reason="needs inodes")
    @pytest.mark.parametrize(
        ("arguments", "message"),
        [
            (["--report", "r.md", "-o", "r.assets/1-geometry.svg"], b"is in the folder of a report's pictures"),
            (["--report", "r.md", "--report", "r.markdown"], b"two outputs would be written to one file"),
            (["r.assets/in.yaml", "--report", "r.md"], b"is in the folder of a report's pictures"),
            (["-o", "link.json"], b"is to be read; a result would replace it"),
            (["-o", "hard.json"], b"is to be read; a result would replace it"),
        ],
    )
    def test_pictures_and_links_count(self, mission, arguments, message: bytes) -> None:
        folder = mission.parent
        (folder / "r.assets").mkdir()
        (folder / "r.assets" / "in.yaml").write_bytes(mission.read_bytes())
        (folder / "link.json").symlink_to(mission)
        (folder / "hard.json").hardlink_to(mission)
        before = mission.read_bytes()
        done = run("check", mission.name, *arguments, cwd=folder)
        assert done.returncode == 2
        assert message in done.stderr
        assert mission.read_bytes() == before
        assert not (folder / "r.md").exists()

    @pytest.mark.skipif(sys.platform == "win32", reason="needs inodes")
    def test_neither_standard_output_nor_the_step_summary_goes_to_a_mission(self, mission) -> None:
        before = mission.read_bytes()
        with mission.open("ab") as file:
            done = subprocess.run([*COMMAND, "check", mission], stdout=file, stderr=subprocess.PIPE, cwd=ROOT)
        assert done.returncode == 2
        assert b"standard output goes to it" in done.stderr
        summary = {"GITHUB_STEP_SUMMARY": str(mission)}
        assert run("check", mission, "--format", "github", env=summary).returncode == 2
        assert mission.read_bytes() == before

    @pytest.mark.parametrize(
        "arguments",
        [
            ["check", "m.yaml", "-o", "a.tle"],
            ["check", "m.yaml", "m.yaml", "--format", "json", "-o", "./a.tle"],
            ["diff", "m.yaml", "m.yaml", "-o", "linked"],
        ],
    )
    def test_what_a_mission_names_is_no_target(self, tmp_path, arguments) -> None:
        """A report replaced the orbit that the mission names."""
        pytest.importorskip("sgp4")
        error = {"platforms__transmitter": {"orbit": {"tle": "a.tle"}, "motion_error": {"velocity": "5 mm/s"}}}
        (tmp_path / "m.yaml").write_text(satellite(**error))
        (tmp_path / "a.tle").write_text(TLE)
        (tmp_path / "linked").symlink_to("a.tle")
        done = run(*arguments, cwd=tmp_path)
        assert done.returncode == 2
        assert b"was read by this command; a result would replace it" in done.stderr
        assert (tmp_path / "a.tle").read_text() == TLE

    def test_settings_and_what_another_process_read_are_no_targets(self, mission, monkeypatch) -> None:
        settings = mission.parent / "pyproject.toml"
        settings.write_text("[tool.bisar-budget]\n")
        assert run("check", mission.name, "-o", settings.name, cwd=mission.parent).returncode == 2
        assert settings.read_text() == "[tool.bisar-budget]\n"
        monkeypatch.setattr(checking, "FILES_FOR_TWO_PROCESSES", 2)
        monkeypatch.setattr(checking, "cores", lambda: 2)
        part = mission.with_name("part.yaml")
        part.write_text("kind: oscillator\n")  # is read, and is no part
        named = mission.with_name("n.yaml")
        named.write_text(mission_text(platforms__receiver__oscillator={"sensor": "./part.yaml"}))
        done = run("check", mission.name, named.name, "--format", "json", "-o", "part.yaml", cwd=mission.parent)
        assert b"part.yaml was read by this command" in done.stderr
        assert part.read_text() == "kind: oscillator\n"

    def test_diff_with_a_pattern_spares_what_it_matches(self, mission, tmp_path) -> None:
        done = run("diff", tmp_path / "*.yaml", "--base", "HEAD", "-o", mission)
        assert done.returncode == 2
        assert b"is to be read; a result would replace it" in done.stderr

    def test_a_name_as_long_as_the_system_takes(self, mission, tmp_path) -> None:
        """The temporary file beside it had a longer one."""
        name = "r" * 250 + ".json"
        assert run("check", mission, "-o", tmp_path / name).returncode == 0
        assert (tmp_path / name).exists()

    def test_a_nul_in_the_name_of_a_report(self, mission) -> None:
        (mission.parent / "pyproject.toml").write_text('[tool.bisar-budget]\nreport = ["a\\u0000.json"]\n')
        done = run("check", mission.name, cwd=mission.parent)
        assert done.returncode == 2
        assert rb"a\x00.json: embedded null byte" in done.stderr


class TestPlots:
    @pytest.fixture
    def folder(self, tmp_path) -> Path:
        folder = tmp_path
        (folder / "m.yaml").write_text(mission_text(name="A $\\frac$ of $x_", **SMALL))
        (folder / "matplotlibrc").write_text("backend: nonsense\nfigure.figsize: 1, 1\nfont.size: 40\n")
        return folder

    def test_a_name_is_text_and_settings_of_matplotlib_do_not_matter(self, folder) -> None:
        """A name with a dollar ended in exit 3. Of the same input a plot has the same bytes.

        Matplotlib reads settings when it is imported: theirs in a process of its own, ours here from elsewhere.
        """
        import matplotlib as mpl

        plain = run("simulate", folder / "m.yaml", "--plot", folder / "a.svg")
        assert mpl.rcParams["font.size"] != 40  # not theirs
        theirs = spawn("simulate", "m.yaml", "--plot", "b.svg", cwd=folder, env={"MPLBACKEND": "nonsense"})
        assert (plain.returncode, theirs.returncode) == (0, 0), plain.stderr + theirs.stderr
        assert (folder / "b.svg").read_bytes() == (folder / "a.svg").read_bytes()
        assert b"<dc:date>" not in (folder / "a.svg").read_bytes()

    def test_every_drawing_sees_to_settings_of_matplotlib_first(self, folder) -> None:
        """Bars were drawn with theirs: a backend that Matplotlib does not know ended in exit 3."""
        text = mission_text(timing_error__quadratic=6e-13)
        (folder / "n.yaml").write_text(text)
        theirs = {"MPLBACKEND": "nonsense"}
        done = spawn("sensitivity", "n.yaml", "--plot", "b.svg", cwd=folder, env=theirs)
        assert (done.returncode, done.stderr) == (0, b"")
        assert (folder / "b.svg").read_bytes().rstrip().endswith(b"</svg>")

    def test_an_archive_has_the_name_that_was_asked_for(self, folder) -> None:
        done = run("simulate", "m.yaml", "-o", "X.NPZ", cwd=folder)
        assert done.returncode == 0, done.stderr
        assert (folder / "X.NPZ").exists()
        assert not (folder / "X.NPZ.npz").exists()


# Escape, C1's CSI, marks without width, those that turn the reading direction, isolates.
ACTIVE = "\x1b[2J\x07\x9b31m\u061c\u200b\u200e\u200f\u202a\u202e\u2066\u2069"
COMMANDS = "::error::x ##[group]y ##vso[task.complete]z"


def is_harmless(done: Done) -> bool:
    streams = [stream.decode("utf-8") for stream in (done.stdout, done.stderr)]
    return not any(RAW.search(stream) or RUN.search(stream) for stream in streams)


class TestTerminal:
    """What others write, whichever way it comes, does nothing to a terminal or to the runner that reads a log."""

    HOSTILE = f"{COMMANDS}{ACTIVE}"

    @pytest.mark.parametrize(
        "arguments",
        [
            [f"--{HOSTILE}"],
            [HOSTILE],
            ["check", HOSTILE],
            ["check", "m.yaml", f"--{HOSTILE}"],
            ["check", "m.yaml", "--format", HOSTILE],
            ["check", "m.yaml", "--report", HOSTILE],
            ["check", "m.yaml", "--date", HOSTILE],
            ["check", "m.yaml", "--monte-carlo", HOSTILE],
            ["check", "m.yaml", "--explain", HOSTILE],
            ["check", "m.yaml", "-o", f"m.yaml/{HOSTILE}"],
            ["verify", "m.yaml", "--only", HOSTILE],
            ["verify", HOSTILE],
            ["simulate", HOSTILE],
            ["simulate", "m.yaml", "--plot", HOSTILE],
            ["simulate", "m.yaml", "--targets", HOSTILE],
            ["diff", HOSTILE, HOSTILE],
            ["diff", "m.yaml", "--base", HOSTILE],
            ["diff", "m.yaml", "m.yaml", "--fail-on-erosion", HOSTILE],
            ["derive", "--table", HOSTILE],
            ["init", f"m.yaml/{HOSTILE}"],
            ["init", "--name", HOSTILE, "-"],
            ["schema", "-o", f"m.yaml/{HOSTILE}"],
            ["check", "m.yaml", "--set", HOSTILE],
            ["check", "m.yaml", "--set", f"radar.bandwidth={HOSTILE}"],
            ["solve", "m.yaml", "--for", HOSTILE],
            ["solve", "m.yaml", "--for", "collection.aperture_time", "--between", HOSTILE],
            ["sensitivity", "m.yaml", "--row", HOSTILE],
            ["sweep", "m.yaml", "--vary", HOSTILE],
            ["sweep", "m.yaml", "--vary", f"collection.aperture_time={HOSTILE}"],
            ["sweep", "m.yaml", "--vary", "collection.aperture_time=1s", "--column", HOSTILE],
            ["sweep", "m.yaml", "--vary", "collection.aperture_time=1s", "-o", f"m.yaml/{HOSTILE}.csv"],
            ["sweep", "m.yaml", "--vary", "collection.aperture_time=1s", "-o", "t.csv", "--scheduler", HOSTILE],
            ["sweep", "m.yaml", "--cases", HOSTILE],
            ["sensors", HOSTILE],
            ["import", HOSTILE],
        ],
        ids=lambda arguments: " ".join(arguments[:1] + arguments[-2:-1]).encode("ascii", "ignore").decode()[:40],
    )
    def test_arguments(self, mission, arguments) -> None:
        done = run(*arguments, cwd=mission.parent)
        assert done.returncode == 2
        assert is_harmless(done)

    def test_a_process_of_its_own_says_the_same(self, mission) -> None:
        """Its arguments and variables are bytes, and its streams are the system's."""
        (mission.parent / f"{self.HOSTILE}.yaml").write_text("x", encoding="utf-8")
        for arguments in (["check", "*.yaml", "--format", "github"], ["check", "--report", self.HOSTILE, "m.yaml"]):
            done = spawn(*arguments, cwd=mission.parent, env={"PYTHONUTF8": "1"})
            assert done.returncode == 2
            assert run(*arguments, cwd=mission.parent) == done
        there = {"BISAR_BUDGET_FORMAT": self.HOSTILE}
        done = spawn("check", mission, env={"PYTHONUTF8": "1", **there})
        assert is_harmless(done)
        assert run("check", mission, env=there) == done

    @pytest.mark.parametrize(
        "name", ["BISAR_BUDGET_FORMAT", "BISAR_BUDGET_REPORT", "SOURCE_DATE_EPOCH", "BISAR_BUDGET_"]
    )
    def test_variables(self, mission, name: str) -> None:
        name += self.HOSTILE if name.endswith("_") else ""
        done = run("check", mission, env={name: self.HOSTILE})
        assert done.returncode == 2
        assert is_harmless(done)

    @pytest.mark.parametrize("key", ["format", "model", "report", HOSTILE])
    def test_settings(self, mission, key: str) -> None:
        value = json.dumps([self.HOSTILE] if key == "report" else self.HOSTILE)
        text = f"[tool.bisar-budget]\n{json.dumps(key)} = {value}\n"
        (mission.parent / "pyproject.toml").write_text(text, encoding="utf-8")
        done = run("check", mission.name, cwd=mission.parent)
        assert done.returncode == 2
        assert is_harmless(done)

    @pytest.mark.skipif(sys.platform == "win32", reason="no such names there")
    @pytest.mark.parametrize("format_name", TEXT_FORMATS)
    def test_names_and_content(self, tmp_path, format_name: str) -> None:
        inert = f"{COMMANDS}\u200b\u200e\u061c"  # a mission file may have these, other controls are faults
        content = {
            "name": inert,
            "document": {"number": inert, "author": inert},
            "other_errors": [{"name": inert, "quadratic_phase_error": "90 deg", "source": inert}],
            "requirement_ids": {f"other.{inert}": inert, inert: inert},
            "waivers": [{"id": "nobody.*", "until": "2030-01-01", "reason": inert}],
        }
        # No slash: each of them is one name.
        (tmp_path / f"{self.HOSTILE}.yaml").write_text(mission_text(**content), encoding="utf-8")
        (tmp_path / f"{self.HOSTILE}2.yaml").write_text(json.dumps({self.HOSTILE: self.HOSTILE}), encoding="utf-8")
        options = ["-v"] if format_name == "text" else ["--detail", "full"]
        done = run("check", "*.yaml", "--format", format_name, *options, cwd=tmp_path)
        assert done.returncode == 2
        assert not RAW.search(done.stdout.decode("utf-8"))
        if format_name == "github":  # its own commands are at the start of lines
            lines = done.stdout.decode("utf-8").splitlines()
            assert all(re.match("::(error|warning|notice) file=", line) for line in lines)
            assert not re.search(r"##\[|##vso\[", "".join(lines))
        else:
            assert is_harmless(done)

    def test_a_format_reads_back_what_was_escaped(self) -> None:
        text = json.dumps({"a": COMMANDS})
        assert json.loads(harmless(text, "json")) == {"a": COMMANDS}
        assert harmless("::x ##[y]", "html") == "&#58;:x #&#35;[y]"
        assert harmless(" ::x\n  ##vso[y]") == " \\x3a:x\n  #\\x23vso[y]"
        assert harmless("a::b # ## [x] ##") == "a::b # ## [x] ##"
        assert harmless("\x1b[1;31mFAIL\x1b[0m", "text") == "\x1b[1;31mFAIL\x1b[0m"
        assert harmless("\x1b[1;31mFAIL") == "\\x1b[1;31mFAIL"

    def test_our_own_reports_need_no_escape(self) -> None:
        """A style sheet is not text: there an escape would be an error."""
        for format_name in TEXT_FORMATS:
            text = render(format_name, Report(version="", missions=(findings(),)), Style(detail="full"))
            assert harmless(text, format_name) == text


class TestBounds:
    """Files under 1 MiB that took up to 48 s, or gave up to 63 MB of messages."""

    @pytest.mark.parametrize(
        "more",
        [
            "".join(f"k{i:06d}: 1\n" for i in range(80_000)),
            "requirements:\n" + "".join(f"  k{i:06d}: 1\n" for i in range(70_000)),
            "x: 1\n" * 150_000,
            "l: [" + "~," * 400_000 + "]\n",
            "l: [" + "[]," * 300_000 + "]\n",
            "q: &q 1\nl: [" + "*q," * 250_000 + "]\n",
            "l: [" + "0,5 m, " * 120_000 + "]\n",
            "l: [" + "!!int 1," * 100_000 + "]\n",
            "requirements:\n  declare: [" + "x," * 400_000 + "]\n",
            "waivers:\n" + "- {a: 1, b: 1, c: 1}\n" * 40_000,
            "requirement_ids:\n" + "".join(f"  k{i:06d}: R\n" for i in range(70_000)),
            "x: " + "[" * 400_000 + "]" * 400_000 + "\n",
            "x: " + "{a: " * 150_000 + "}" * 150_000 + "\n",
            "a: &a [x,x,x]\n" + "".join(f"b{i}: &b{i} [*a,*a,*a]\n" for i in range(30)),
            "name: " + "9" * 900_000 + "\n",
            "x" * 900_000 + ": 1\n",
        ],
        ids=lambda more: more[:16].encode("unicode_escape").decode(),
    )
    def test_the_faults_of_a_large_file(self, more: str) -> None:
        """Messages of 15 s of work were made of it: they are few now, and short."""
        with pytest.raises(MissionError) as caught:
            parse_mission(mission_text() + more)
        assert len(caught.value.faults) <= MAX_FAULT_COUNT + 1
        assert sum(map(len, caught.value.lines())) < 200_000

    def test_the_first_faults_are_said_and_that_there_are_more(self) -> None:
        with pytest.raises(MissionError) as caught:
            parse_mission(mission_text() + "".join(f"k{i:03d}: 1\n" for i in range(300)))
        more, first, *_ = caught.value.lines()
        assert more == f"-: has {MAX_FAULT_COUNT} faults or more; what follows them was not read"
        assert "k000: is not a known key" in first

    @pytest.mark.parametrize("until", ["2009-01-01", "2099-01-01"])
    def test_waivers_by_errors(self, until: str) -> None:
        """A thousand notes of 400 characters stood at each of 900 rows."""
        errors = [{"name": f"e{i}", "quadratic_phase_error": "90 deg"} for i in range(900)]
        waivers = [{"id": f"other.e{'*' * (i % 9 + 1)}", "until": until, "reason": "r" * 400} for i in range(1000)]
        found = check_mission(parse_mission(mission_text(other_errors=errors, waivers=waivers)), TODAY)
        others = [row for row in found.rows if row.id.startswith("other.")]
        assert {row.status for row in others} == {"fail" if until < "2026" else "waived"}
        assert all(sum("waiver of line" in note for note in row.notes) == 1 for row in others)

    def test_of_expired_waivers_the_last_is_noted(self) -> None:
        waivers = [{"id": "other.x", "until": f"20{year}-01-01", "reason": f"reason {year}"} for year in (19, 21, 20)]
        found = findings(other_errors=[{"name": "x", "quadratic_phase_error": "90 deg"}], waivers=waivers)
        (notes,) = [row.notes for row in found.rows if row.id == "other.x"]
        assert [note.rpartition(": ")[2] for note in notes if "waiver" in note] == ["reason 21"]

    def test_a_pattern_of_hundreds_of_wildcards_is_refused(self) -> None:
        waiver = {"id": "*a" * 21, "until": "2030-01-01", "reason": "r"}
        with pytest.raises(MissionError, match="must have at most 20 wildcards"):
            findings(waivers=[waiver])
        assert findings(waivers=[{**waiver, "id": "*a" * 20}]).warnings

    @pytest.mark.parametrize(
        ("text", "message"),
        [
            (".".join("a" * 400_000) + " = 1", "dots"),
            ("[" + ".".join(['"a"'] * 200_000) + "]", "dots"),
            ("[tool.bisar-budget]\nx = " + "{a=" * 50_000, "nested too deep"),
            ("[tool.bisar-budget]\nseed = " + "9" * 900_000, "not valid TOML"),
            ("[tool.bisar-budget]\nseed = 0x" + "f" * 900_000, "too large to be shown"),
            ("[tool.bisar-budget]\nformat = " + "[" * 300 + "]" * 300, "must be text"),
            ("[tool.bisar-budget]\n" + "a" * 900_000 + " = 1", "is not a known key"),
        ],
        ids=lambda text: text[:24],
    )
    def test_settings(self, tmp_path, text: str, message: str) -> None:
        """A key of 400 000 parts took hours, a number of 5 000 digits ended in exit 3."""
        from bisar_budget.settings import SettingsError, project_settings

        (tmp_path / "pyproject.toml").write_text(f"{text}\n# .bisar-budget\n")
        with pytest.raises(SettingsError, match=message) as caught:
            project_settings(str(tmp_path))
        assert len(str(caught.value)) < 1000

    @pytest.mark.parametrize(
        "question",
        [
            ["solve", "--for", "platforms.transmitter.motion_error", "--scale", "--between", "0.01..1"],
            ["sensitivity"],
        ],
        ids=["solve", "sensitivity"],
    )
    def test_how_long_a_question_takes_is_said(self, monkeypatch, question) -> None:
        """Each value is a whole check: of a mission that takes 0.6 s, minutes went by in silence."""
        monkeypatch.setattr("bisar_budget.questions.progress.MIN_ANNOUNCED_S", 1e-9)
        done = run(*question, SECTION_V)
        assert done.returncode == 0
        said = rb"Checking Rigling & Moses, Section V for \d+ values or more will take about .*; .*--model published"
        assert re.match(said, done.stderr)
        monkeypatch.setattr("bisar_budget.questions.progress.MIN_ANNOUNCED_S", 3600)
        assert run(*question, SECTION_V).stderr == b""

    def test_a_table_of_cases_without_end(self) -> None:
        """A device was read until memory ran out."""
        done = run("sweep", SECTION_V, "--cases", "/dev/zero")
        assert (done.returncode, done.stderr) == (
            2,
            b"Error: /dev/zero: cannot be read: a device; accepted: a regular file\n",
        )

    def test_a_table_of_cases_that_is_too_large(self, tmp_path, monkeypatch) -> None:
        from bisar_budget.questions import cases

        monkeypatch.setattr(cases, "MAX_TABLE_CHARACTERS", 1 << 20)
        (tmp_path / "cases.csv").write_bytes(b"0" * ((1 << 20) + 1))
        done = run("sweep", SECTION_V, "--cases", tmp_path / "cases.csv")
        assert done.returncode == 2
        assert b"cases.csv: is larger than 1 MiB; accepted: up to 10000000 values" in done.stderr

    @pytest.mark.skipif(sys.platform == "win32", reason="no such limit there")
    @pytest.mark.parametrize("suffix", ["csv", "parquet", "nc"])
    def test_tables_that_do_not_fit(self, tmp_path, monkeypatch, suffix: str) -> None:
        """The library of NetCDF raised what ended in exit 3.

        Python would leave compiled modules that are cut off, for later ones to read.
        """
        monkeypatch.setattr(sys, "dont_write_bytecode", True)
        pytest.importorskip({"parquet": "pyarrow", "nc": "netCDF4"}.get(suffix, "csv"))
        import resource

        before = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (2000, before[1]))
        try:
            cases = ("--vary", "collection.aperture_time=1:2s:99")
            done = run("sweep", SECTION_V, *cases, "-o", tmp_path / f"t.{suffix}")
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)
        assert done.returncode == 2
        assert b"cannot write" in done.stderr
        assert list(tmp_path.iterdir()) == []

    def test_junit_of_two_thousand_missions(self) -> None:
        """Of the missions that come with the tool, which declare more than most."""
        paths = sorted((ROOT / "specs" / "missions").glob("*.yaml"))
        missions = [check_mission(parse_mission(path.read_bytes(), str(path)), TODAY) for path in paths]
        sizes = [len(render("junit", Report(version="", missions=(one,)), Style()).encode()) for one in missions]
        assert 2000 * sum(sizes) / len(sizes) < 40e6


def at_most(count: int) -> None:
    """Let this process open so many files."""
    import resource

    resource.setrlimit(resource.RLIMIT_NOFILE, (count, count))


@cache
def starts_with(count: int) -> bool:
    """Whether the interpreter itself starts with so few descriptors."""
    bare = subprocess.run([sys.executable, "-c", "pass"], preexec_fn=lambda: at_most(count), capture_output=True)
    return not (bare.returncode or bare.stderr)


class TestSystem:
    @pytest.mark.skipif(sys.platform == "win32", reason="no such limit there")
    @pytest.mark.parametrize("count", [5, 6, 9])  # the long round has all up to 24
    @pytest.mark.parametrize(
        "arguments",
        [
            ["check", SECTION_V, "--format", "html"],
            ["verify", SECTION_V, "--only", "receiver.velocity.*", "--jobs", "2"],
            ["diff", SECTION_V, "--base", "HEAD"],
        ],
        ids=["check", "verify", "diff"],
    )
    def test_few_descriptors(self, arguments, count: int) -> None:
        if not starts_with(count):
            pytest.skip("the interpreter itself does not start with so few")
        done = spawn(*arguments, preexec_fn=lambda: at_most(count), stdin=subprocess.DEVNULL)
        assert done.returncode in (0, 1, 2), done.stderr
        assert b"Traceback" not in done.stderr

    @pytest.mark.skipif(sys.platform == "win32", reason="a folder in use cannot be deleted there")
    @pytest.mark.parametrize(
        "arguments",
        [
            ["check", SECTION_V, "-o", "r.json"],
            ["check", SECTION_V, "--report", "r.md"],
            ["check", "m.yaml"],
            ["check", "*.yaml"],
            ["diff", "a.yaml", "b.yaml"],
            ["diff", "a.yaml", "--base", "HEAD"],
            ["simulate", SECTION_V, "--plot", "p.png"],
            ["init"],
            ["schema", "-o", "s.json"],
        ],
        ids=lambda arguments: " ".join(map(str, [arguments[0], *arguments[-2:]]))[-24:],
    )
    def test_a_deleted_folder(self, tmp_path, arguments) -> None:
        (tmp_path / "gone").mkdir()
        script = "import os; os.rmdir(os.getcwd()); from bisar_budget.cli import main; main()"
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "GITHUB_WORKSPACE": "/x"}
        done = subprocess.run(
            [sys.executable, "-c", script, *map(str, arguments)],
            capture_output=True,
            cwd=tmp_path / "gone",
            env=environment,
        )
        assert done.returncode == 2, done.stderr
        assert b"Traceback" not in done.stderr

    @pytest.mark.parametrize(
        "arguments",
        [["--help"], ["check", "--help"], ["schema"], ["check", SECTION_V, "--date", "2026-01-01", "-v"]],
        ids=["help", "check help", "schema", "check"],
    )
    def test_the_same_without_docstrings_and_asserts(self, arguments) -> None:
        """Help was empty, and the schema described its sections by their signatures."""
        plain = run(*arguments)
        optimized = spawn(*arguments, env={"PYTHONOPTIMIZE": "2"})
        assert (optimized.returncode, optimized.stdout) == (plain.returncode, plain.stdout)

    def while_checking(self, mission, statement: str, **variables: str) -> subprocess.CompletedProcess:
        """Check a mission, with something else going on meanwhile."""
        script = (
            "import warnings, bisar_budget.budget.check as checking\n"
            "from bisar_budget.cli import main\n"
            "real = checking.check_missions\n"
            "def check_missions(*given, **named):\n"
            f"    {statement}\n"
            "    return real(*given, **named)\n"
            "checking.check_missions = check_missions\n"
            "main()\n"
        )
        environment = {**os.environ, "PYTHONPATH": str(ROOT), **variables}
        command = [sys.executable, "-c", script, "check", str(mission)]
        return subprocess.run(command, capture_output=True, cwd=ROOT, env=environment)

    @pytest.mark.parametrize("setting", ["default", "error"])
    def test_what_a_library_warns_of_is_not_said(self, mission, setting: str) -> None:
        done = self.while_checking(mission, "warnings.warn('from a library')", PYTHONWARNINGS=setting)
        assert (done.returncode, done.stderr) == (0, b"")

    def test_memory_that_runs_out_is_2(self, mission) -> None:
        done = self.while_checking(mission, "raise MemoryError")
        assert (done.returncode, done.stderr) == (2, b"Error: the system refuses: memory ran out\n")

    def test_a_crash_is_3_with_its_traceback_too(self, mission) -> None:
        """BISAR_BUDGET_DEBUG made it 1: a requirement that is broken."""
        done = self.while_checking(mission, "raise KeyError('x')", BISAR_BUDGET_DEBUG="1")
        assert done.returncode == 3
        assert b"Traceback" in done.stderr
        assert b"a fault of the tool itself" in done.stderr


@pytest.mark.skipif(sys.platform != "linux", reason="other systems do not hold to RLIMIT_AS")
class TestLittleMemory:
    """OpenBLAS ended the process with 1 or 130, LLVM hung or was a fault of the tool, Arrow ended with SIGSEGV."""

    @staticmethod
    def within(megabytes: int, *arguments) -> Done:
        import resource

        size = megabytes << 20
        return spawn(*arguments, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (size, size)))

    @pytest.mark.parametrize("megabytes", [100, 130, 191])
    def test_too_little_is_2_and_says_so(self, mission, megabytes: int) -> None:
        done = self.within(megabytes, "check", mission)
        words = f"memory ran out; check needs at least 192 MB of memory; the system allows {megabytes} MB"
        assert (done.returncode, done.stdout) == (2, b"")
        assert words.encode() in done.stderr

    def test_as_much_as_is_needed_is_enough(self, mission) -> None:
        done = self.within(192, "check", mission)
        assert (done.returncode, done.stderr) == (0, b"")

    def test_images_are_formed_without_llvm(self, tmp_path) -> None:
        path = tmp_path / "m.yaml"
        path.write_text(mission_text(**SMALL, timing_error__quadratic=6e-13))
        done = self.within(300, "simulate", path)
        assert (done.returncode, done.stderr) == (0, b"")

    def test_tables_say_what_they_need(self, mission, tmp_path) -> None:
        output = tmp_path / "t.parquet"
        done = self.within(399, "sweep", mission, "--vary", "collection.aperture_time=1:2s:3", "-o", output)
        assert done.returncode == 2
        assert b"Parquet needs at least 400 MB of memory" in done.stderr
        assert not output.exists()


@pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX limits and locks")
class TestUnfinishedOutputs:
    """What a full disk, and a run that was killed, leave."""

    @pytest.mark.parametrize("suffix", ["csv", "parquet", "nc"])
    def test_a_file_that_may_not_grow_is_called_so(self, mission, tmp_path, suffix: str) -> None:
        """NetCDF said `NetCDF: HDF error`, or nothing."""
        import resource

        pytest.importorskip({"csv": "numpy", "parquet": "pyarrow", "nc": "netCDF4"}[suffix])
        folder = tmp_path / "out"
        folder.mkdir()
        done = spawn(
            *("sweep", mission, "--vary", "collection.aperture_time=1:6s:3000", "-o", folder / f"t.{suffix}"),
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (9000, 9000)),
        )
        assert done.returncode == 2
        assert done.stderr.endswith(b": File too large\n")
        assert list(folder.iterdir()) == []

    def test_what_a_killed_run_left_is_removed_by_the_next(self, mission, tmp_path) -> None:
        script = (
            "import os, signal\n"
            "from bisar_budget.cli import main\n"
            "os.chmod = lambda *a: os.kill(os.getpid(), signal.SIGKILL)\n"
            "main()\n"
        )
        folder = tmp_path / "out"
        arguments = ["check", str(mission), "-o", str(folder / "r.html")]
        killed = subprocess.run([sys.executable, "-c", script, *arguments], cwd=ROOT)
        assert killed.returncode == -signal.SIGKILL
        assert [path.name.startswith(".bisar-budget.") for path in folder.iterdir()] == [True]
        assert run(*arguments).returncode == 0
        assert [path.name for path in folder.iterdir()] == ["r.html"]

    def test_what_another_run_is_writing_stays(self, tmp_path) -> None:
        with replacing(str(tmp_path / "r.txt")) as name:
            Path(name).write_text("first")
            write_file(str(tmp_path / "r.txt"), "second")
        assert (tmp_path / "r.txt").read_text() == "first"
        assert [path.name for path in tmp_path.iterdir()] == ["r.txt"]

    def test_a_folder_of_somebody_else_stays(self, tmp_path) -> None:
        other = tmp_path / ".bisar-budget.notes"
        other.mkdir()
        write_file(str(tmp_path / "r.txt"), "text")
        assert other.is_dir()


class TestFilesThatChange:
    """A file that changes during a run was another one in the next format, mission or process."""

    def test_a_mission_is_read_once(self, mission, monkeypatch) -> None:
        real = load._content
        reads = []

        def content(path: str) -> bytes:
            reads.append(path)
            return real(path).replace(b"6.0e-13", b"5e-12") if len(reads) > 1 else real(path)

        monkeypatch.setattr(load, "_content", content)
        done = run("diff", mission, "--set", "name=other")
        assert (done.returncode, len(reads)) == (0, 1)

    def test_a_file_is_one_version_during_a_command(self, tmp_path) -> None:
        path = tmp_path / "part.yaml"
        path.write_bytes(b"one")
        resources.hold_files()
        try:
            assert resources.DISK.content(str(path), 100) == b"one"
            path.write_bytes(b"two")
            assert resources.DISK.content(str(path), 100) == b"one"
        finally:
            resources.release_files()
        assert resources.DISK.content(str(path), 100) == b"two"

    def test_one_too_large_to_be_kept_is_refused(self, tmp_path, monkeypatch) -> None:
        monkeypatch.setattr(resources, "_MAX_HELD_BYTES", 2)
        path = tmp_path / "log.csv"
        path.write_bytes(b"one")
        resources.hold_files()
        try:
            assert resources.DISK.content(str(path), 100) == b"one"
            assert resources.DISK.content(str(path), 100) == b"one"
            path.write_bytes(b"two")
            with pytest.raises(resources.UnreadableError, match="changed while this command was reading it"):
                resources.DISK.content(str(path), 100)
        finally:
            resources.release_files()


@pytest.mark.parametrize("format_name", list(TEXT_FORMATS))
def test_a_waiver_of_an_option_has_no_line(mission, format_name: str) -> None:
    """It was a waiver of line None."""
    waiver = "waivers=[{id: timing.quadratic, until: 2027-01-01, reason: r}]"
    done = run(
        "check", mission, "--set", waiver, "--set", "timing_error.quadratic=9e-12 1/s", "--format", format_name
    )
    assert b"line None" not in done.stdout
    assert done.returncode in (0, 1)


@pytest.mark.parametrize("format_name", ["html", "markdown"])
def test_an_error_that_no_image_has_is_no_part_of_a_sum(format_name: str) -> None:
    """Its phase was `inf rad`, and its part of the sum `nan %`."""
    errors = {"position": ["40 km", 0, 0], "velocity": "5 mm/s"}
    found = findings(platforms__receiver__motion_error=errors, allocation__model="full")
    (row,) = [row for row in found.rows if row.id == "receiver.position.x"]
    assert "no ground point has the range history of so large an error" in row.reason
    text = render(format_name, Report(version="", missions=(found,)), Style(detail="full"))
    assert not re.search(r"\b(nan|inf)\b", re.sub("<style>.*?</style>", "", text, flags=re.DOTALL))
    assert "no image" in text


@pytest.mark.parametrize("model", ["full", "strictest"])
def test_an_error_without_an_image_has_no_phase_to_compare(model: str) -> None:
    """A clock of another row's requirement was used infinitely: JSON has no such number, and the exit code was 3."""
    changes = {"timing_error__linear": 1e-6, "requirements__location_error": 2.0, "allocation__combine": "each"}
    found = findings(**changes, allocation__model=model)
    entry = next(one for one in found.requirements if one.key == "quadratic_phase_error")
    assert (entry.status, entry.row, entry.reached, entry.utilization) == ("fail", "timing.linear", None, None)
    json.loads(render("json", Report(version="", missions=(found,)), Style()))


@pytest.mark.parametrize("format_name", ["text", "html", "markdown"])
def test_a_slow_vibration_that_displaces_too_much_is_said(tmp_path, format_name: str) -> None:
    """The sentence had lost a part that the table of requirements took from it: exit code 3."""
    path = tmp_path / "m.yaml"
    shake = {"vibration": {"sinusoidal": [{"amplitude": "1 mm", "frequency": "0.1 Hz"}]}}
    path.write_text(mission_text(requirements__location_error=1e-3, platforms__receiver__motion_error=shake))
    done = run("check", path, "--format", format_name)
    assert done.returncode == 1
    assert b"largest: receiver.vibration.sinusoidal.0" in b" ".join(done.stdout.split()).replace(b"\\", b"")


def test_what_has_no_image_leaves_no_room_and_no_number() -> None:
    """`allocate` used infinitely much of a limit, which JSON cannot say: exit code 3."""
    path = ROOT / "specs" / "missions" / "astra_drone.yaml"
    options = ("--set", "common_motion_error.velocity=1053 m/s", "--set", "allocation.combine=sum")
    done = run("allocate", path, *options, "--format", "json")
    assert done.returncode == 1
    (found,) = json.loads(done.stdout)["missions"]
    assert None in [one["used"] for one in found["broken"]]
    assert b"they leave no image" in run("allocate", path, *options).stdout


def test_a_density_that_became_nothing_is_nothing() -> None:
    """`allocate` makes a density smaller until it is 0, which was divided by: exit code 3."""
    flat = Spectrum(((20.0, 1.0), (100.0, 1.0), (1000.0, 0.0)), is_accelerated=True)
    assert [(piece.low, piece.high) for piece in spectrum_pieces(flat)] == [(20.0, 100.0)]


@pytest.mark.parametrize("where", ["orbit: {eof: %s}", "trajectory: {file: %s}"])
def test_a_name_of_a_file_is_printed_so_that_it_is_seen(tmp_path, where: str) -> None:
    """A space of no width went to the terminal as it was."""
    document = yaml.safe_load(mission_text(scene={"latitude": "48 deg", "longitude": "11 deg", "height": "0 m"}))
    document["collection"]["center_time"] = "2026-06-01T05:20:31Z"
    document["platforms"]["receiver"] = yaml.safe_load(where % '"\\u200b"')
    with pytest.raises(MissionError) as caught:
        parse_mission(yaml.safe_dump(document), str(tmp_path / "m.yaml"))
    assert any("\\u200b cannot be read" in line for line in caught.value.lines())
    assert not any(RAW.search(line) for line in caught.value.lines())


def test_cases_have_every_key_of_a_mission_file() -> None:
    """A key that the long round never writes is a key that it never damages."""
    schema, found = mission_schema(), set[str]()
    for seed in range(6000):
        tree: dict[str, Any] = {"platforms": {"transmitter": {}, "receiver": {}}}
        from_schema(tree, tree, "", Random(seed))
        found |= set(re.findall(r'"(\w[\w-]*)":', json.dumps(tree)))
    listed = (schema, *schema["definitions"].values(), schema["definitions"]["Oscillator"]["properties"]["power_law"])
    assert {key for part in listed for key in part.get("properties", {})} <= found


@pytest.mark.parametrize("seed", [*range(0, 400, 4), 52552])
def test_a_fuzzed_file_is_a_mission_or_faults(seed: int) -> None:
    """The first cases of the long round, `docs/prove_hostile.py`."""
    hostile = case(seed)
    assert case(seed) == hostile
    try:
        found = check_mission(parse_mission(hostile.data, "m.yaml"), TODAY)
    except MissionError as error:
        assert not any(RAW.search(line) for line in error.lines())
    else:
        assert not hostile.is_misspelt
        assert not RAW.search(harmless(render("text", Report(version="", missions=(found,)), Style())))
