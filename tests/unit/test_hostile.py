"""What other people's machines, files and terminals do to a command that runs on every commit."""

import codecs
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.conftest import ROOT, mission_text

COMMAND = [sys.executable, "-m", "bisar_budget"]
SECTION_V = ROOT / "specs" / "missions" / "rigling_moses_section_v.yaml"
needs_proc = pytest.mark.skipif(not os.path.isdir("/proc/self/task"), reason="asks /proc for processes")


@pytest.fixture
def mission(tmp_path) -> Path:
    path = tmp_path / "m.yaml"
    path.write_text(mission_text(timing_error__quadratic=6e-13))  # passes, unless strict
    return path


def run(*arguments, cwd=ROOT, **options) -> subprocess.CompletedProcess:
    return subprocess.run([*COMMAND, *map(str, arguments)], capture_output=True, cwd=cwd, **options)


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

    def start(self, **options) -> tuple[subprocess.Popen, set[int]]:
        process = subprocess.Popen([*COMMAND, "verify", str(SECTION_V), "--jobs", "2"], cwd=ROOT, **options)
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
    def test_no_signal_leaves_one(self, number: int, code: int) -> None:
        process, workers = self.start(stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        process.send_signal(number)
        output, errors = process.communicate(timeout=60)  # ends when nobody holds the pipes
        assert process.returncode == code
        assert until(lambda: not any(map(is_running, workers)), 20)
        assert output == b""
        assert b"Traceback" not in errors

    def test_a_killed_worker_is_said(self) -> None:
        process, workers = self.start(stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        lines = {pid: Path(f"/proc/{pid}/cmdline").read_bytes() for pid in workers}
        os.kill(next(pid for pid, line in lines.items() if b"spawn_main" in line), signal.SIGKILL)
        output, errors = process.communicate(timeout=60)
        assert process.returncode == 2
        assert b"a worker process was ended from outside" in errors
        assert b"Traceback" not in errors
        assert output == b""
        assert until(lambda: not any(map(is_running, workers)), 20)


@pytest.mark.skipif(not hasattr(signal, "SIGTERM") or sys.platform == "win32", reason="needs POSIX signals")
@pytest.mark.parametrize(
    ("command", "option", "name"),
    [("check", "-o", "report.html"), ("simulate", "-o", "images.npz"), ("simulate", "--plot", "sheet.png")],
)
def test_a_report_that_is_interrupted_leaves_the_old_one_and_nothing_else(tmp_path, command, option, name) -> None:
    """The signal comes while the temporary file is written, wherever that is."""
    script = (
        "import os, signal, sys\n"
        "from bisar_budget.cli import main\n"
        "import bisar_budget.cli.streams\n"
        "chmod = os.chmod\n"
        "os.chmod = lambda *a: (os.kill(os.getpid(), signal.SIGTERM), chmod(*a))\n"
        "main()\n"
    )
    report = tmp_path / name
    report.write_text("old")
    done = subprocess.run([sys.executable, "-c", script, command, str(SECTION_V), option, str(report)], cwd=ROOT)
    assert done.returncode == 143
    assert [path.name for path in tmp_path.iterdir()] == [name]
    assert report.read_text() == "old"


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
        done = run("check", mission.name, cwd=mission.parent, timeout=60)
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
        path.write_text(mission_text(name="Höhe φ 雷達"), encoding="utf-8")
        outputs = {
            encoding: run("check", path, "--format", format_name, env={**os.environ, "PYTHONIOENCODING": encoding})
            for encoding in ("utf-8", "latin-1", "ascii")
        }
        assert len({done.stdout for done in outputs.values()}) == 1
        assert outputs["ascii"].stdout.decode("utf-8")

    def test_text_follows_the_terminal_and_escapes_what_it_lacks(self, tmp_path) -> None:
        path = tmp_path / "m.yaml"
        path.write_text(mission_text(name="Höhe φ"), encoding="utf-8")
        done = run("check", path, env={**os.environ, "PYTHONIOENCODING": "latin-1"})
        assert "Höhe \\u03c6" in done.stdout.decode("latin-1")


class TestOutputs:
    @pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full here")
    @pytest.mark.parametrize("arguments", [["--help"], ["--version"], ["check", "--help"], ["schema"], ["init", "-"]])
    def test_a_full_device_is_2(self, arguments) -> None:
        with open("/dev/full", "wb") as full:
            done = subprocess.run([*COMMAND, *arguments], stdout=full, stderr=subprocess.PIPE, cwd=ROOT)
        assert done.returncode == 2
        assert b"cannot write standard output: No space left on device" in done.stderr
        assert b"Traceback" not in done.stderr

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
    done = run("check", mission, env={**os.environ, "SOURCE_DATE_EPOCH": epoch, "PYTHONUTF8": "1"})
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
            done = run("check", "-", "-o", mission, stdin=file)
        assert done.returncode == 2
        assert b"is a mission file; a report would replace it" in done.stderr
        assert mission.read_bytes() == before


class TestPlots:
    @pytest.fixture
    def folder(self, tmp_path) -> Path:
        folder = tmp_path
        (folder / "m.yaml").write_text(mission_text(name="A $\\frac$ of $x_"))
        (folder / "matplotlibrc").write_text("backend: nonsense\nfigure.figsize: 1, 1\nfont.size: 40\n")
        return folder

    def plot(self, folder: Path, name: str, **environment: str) -> bytes:
        done = run("simulate", "m.yaml", "--plot", name, cwd=folder, env={**os.environ, **environment})
        assert done.returncode == 0, done.stderr
        return (folder / name).read_bytes()

    def test_a_name_is_text_and_settings_of_matplotlib_do_not_matter(self, folder) -> None:
        """A name with a dollar ended in exit 3. Of the same input a plot has the same bytes."""
        plain = self.plot(folder, "a.svg", MATPLOTLIBRC=os.devnull)
        theirs = self.plot(folder, "b.svg", MPLBACKEND="nonsense")
        assert theirs == plain
        assert b"<dc:date>" not in plain

    def test_an_archive_has_the_name_that_was_asked_for(self, folder) -> None:
        done = run("simulate", "m.yaml", "-o", "X.NPZ", cwd=folder)
        assert done.returncode == 0, done.stderr
        assert (folder / "X.NPZ").exists()
        assert not (folder / "X.NPZ.npz").exists()
