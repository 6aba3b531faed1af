"""`bisar-budget sweep`: its table is what `check` says case by case, its files are whole or not there."""

import csv
import fcntl
import json
import math
import os
import pty
import signal
import struct
import subprocess
import sys
import termios
import time
from collections.abc import Callable, Iterator
from datetime import date
from pathlib import Path
from typing import Any

import pytest

from bisar_budget.findings.case_table import Part
from bisar_budget.questions import asked as engine
from bisar_budget.questions.progress import lasting
from bisar_budget.questions.sweep import percentage
from tests.conftest import ROOT, heed_signals, mission_text

SECTION_V = str(ROOT / "specs" / "missions" / "rigling_moses_section_v.yaml")
SPOTLIGHT = str(ROOT / "specs" / "missions" / "one_stationary_spotlight.yaml")
TIME = "collection.aperture_time"
DAY = ("--date", "2026-01-01")


def rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))


def test_each_case_is_what_check_finds(run) -> None:
    vary = ("--vary", "platforms.receiver.azimuth=100:128deg:5", "--vary", f"{TIME}=1:2s:3")
    found = run("sweep", SPOTLIGHT, *vary, "--column", "transmitter.position.y.utilization", *DAY)
    assert found.exit_code == 0
    cases = rows(found.stdout)
    assert len(cases) == 15
    for case in cases[::2]:
        values = (f"platforms.receiver.azimuth={case['platforms.receiver.azimuth [deg]']}deg",)
        values += (f"{TIME}={case[f'{TIME} [s]']}s",)
        sets = [part for value in values for part in ("--set", value)]
        (mission,) = json.loads(run("check", SPOTLIGHT, *sets, *DAY, "--format", "json").stdout)["missions"]
        assert mission["status"] == case["status"]
        by_id = {row["id"]: row for row in mission["rows"]}
        assert by_id[case["worst_row"]]["utilization"] == pytest.approx(float(case["utilization"]), rel=1e-9)
        worst = by_id[case["worst_row"]]
        assert (worst["binding_requirement"] or worst["metric"]) == case["binding_requirement"]
        y = by_id["transmitter.position.y"]["utilization"]
        assert y == pytest.approx(float(case["transmitter.position.y.utilization"]), rel=1e-9)


def test_the_head_of_the_table_says_of_which_mission_it_is(run) -> None:
    lines = run("sweep", SECTION_V, "--vary", f"{TIME}=1s", "--set", "radar.bandwidth=150MHz").stdout.splitlines()
    assert lines[0] == "# format: bisar-budget/sweep/1"
    assert lines[1] == "# mission: Rigling & Moses, Section V"
    assert lines[2].startswith("# mission_sha256: ")
    assert lines[3] == "# set: --set radar.bandwidth=150MHz"
    assert "# model: published" in lines[4:7]
    assert next(line for line in lines if line[0] != "#").startswith(
        f"{TIME} [s],range_resolution [m],cross_range_resolution [m],bistatic_angle [rad],"
    )


def test_the_summary_counts_what_check_exits_with_0_on(run) -> None:
    """By hand: the utilization is 11.78 (T / 6 s)², so of 1, 2, ... 6 s one is below 1.748 s."""
    found = run("sweep", SECTION_V, "--vary", f"{TIME}=1:6s:6")
    assert found.stderr.splitlines()[-1].startswith("Rigling & Moses, Section V: 6 cases, 1 comply (16.7 %)")
    assert "\r" not in found.stderr  # no bar in a pipe
    for case in rows(found.stdout):
        assert float(case["utilization"]) == pytest.approx(11.78124183 * (float(case[f"{TIME} [s]"]) / 6) ** 2)


def test_cases_without_a_mission_are_rows(run, tmp_path: Path) -> None:
    """Both platforms in one vertical plane, and flying in it, have one gradient on the ground; -1 s is no time."""
    mission, table = tmp_path / "m.yaml", tmp_path / "cases.csv"
    text = Path(SECTION_V).read_text(encoding="utf-8")
    mission.write_text(text.replace("velocity: [0 m/s, 150 m/s, 0 m/s]", "velocity: [-150 m/s, 0 m/s, 0 m/s]"))
    angles = "platforms.receiver.azimuth [deg],platforms.receiver.motion_azimuth [deg]"
    table.write_text(f"{angles},{TIME} [s]\n45,135,1\n0,180,1\n45,135,-1\n")
    found = run("sweep", mission, "--cases", str(table))
    assert [case["status"] for case in rows(found.stdout)] == ["pass", "error", "error"]
    reasons = [case["reason"] for case in rows(found.stdout)]
    assert reasons[0] == ""
    assert "no image plane" in reasons[1]
    assert "greater than 0" in reasons[2]
    assert "2 without a mission" in found.stderr
    assert found.exit_code == 0


def test_look_vectors_that_cancel_are_a_mission_where_band_and_turn_resolve_the_ground(run, tmp_path: Path) -> None:
    """Opposite platforms at 11.16 and 13.61 deg: |s| = cos 11.16° - cos 13.61° = 0.0092, a cell of c/(B|s|)."""
    table = tmp_path / "cases.csv"
    table.write_text(f"platforms.receiver.azimuth [deg],{TIME} [s]\n180,1\n")
    (case,) = rows(run("sweep", SECTION_V, "--cases", str(table)).stdout)
    assert case["status"] == "pass"
    ground = 30.414 / math.hypot(30.414, 6) - math.cos(math.radians(13.609))
    assert float(case["range_resolution [m]"]) == pytest.approx(299_792_458 / 300e6 / ground, rel=1e-6)


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".nc"])
def test_a_file_of_each_format(run, tmp_path: Path, suffix: str) -> None:
    output = tmp_path / f"new/t{suffix}"
    found = run("sweep", SECTION_V, "--vary", f"{TIME}=1:6s:6", "-o", str(output))
    assert (found.exit_code, found.stdout) == (0, "")
    assert read(output) == pytest.approx([11.78124183 * (time / 6) ** 2 for time in range(1, 7)])
    assert [file.name for file in output.parent.iterdir()] == [output.name]


def read(output: Path) -> list[float]:
    """The utilizations of a file."""
    if output.suffix == ".csv":
        return [float(case["utilization"]) for case in rows(output.read_text(encoding="utf-8"))]
    if output.suffix == ".parquet":
        import pyarrow.parquet as pq

        found: list[float] = pq.read_table(output).column("utilization").to_pylist()
        return found
    import xarray

    with xarray.open_dataset(output) as dataset:
        values: list[float] = dataset["utilization"].values.tolist()
    return values


def test_a_sample(run) -> None:
    ranges = ("--vary", f"{TIME}=1:2s", "--vary", "radar.bandwidth=100:300MHz")
    found = run("sweep", SECTION_V, *ranges, "--sample", "latin:20:7")
    cases = rows(found.stdout)
    assert sorted(math.floor((float(case[f"{TIME} [s]"]) - 1) * 20) for case in cases) == list(range(20))
    assert run("sweep", SECTION_V, *ranges, "--sample", "latin:20:7").stdout == found.stdout


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "either --vary or --cases"),
        (("--vary", f"{TIME}=1s", "--cases", "c.csv"), "either --vary or --cases"),
        (("--cases", "c.csv", "--sample", "latin:3:1"), "--sample draws from the ranges of --vary"),
        (("--cases", "nothing.csv"), "nothing.csv: cannot be read: No such file"),
        (("--vary", f"{TIME}=6:1s:6"), "the range is reversed"),
        (("--vary", "collection.aperture_tim=1:6s:6"), "Did you mean 'collection.aperture_time'?"),
        (("--vary", f"{TIME}=1s", "--column", "receiver.velocity.x.nothing"), "--column receiver.velocity.x.nothing"),
        (("--vary", f"{TIME}=1s", "-o", "t.docx"), "the suffix must be one of .csv, .parquet, .nc"),
        (("--vary", f"{TIME}=1:2s:3", "--plot", "t.jpg"), "the suffix must be one of .svg, .png, .pdf"),
        (("--vary", f"{TIME}=1:2s:3", "--plot", "-"), "--plot needs the name of a file"),
        (("--vary", f"{TIME}=1:2s:3", "--polar"), "--plot says to which file"),
        (("--vary", f"{TIME}=1s", "--plot", "t.svg"), "0 keys vary; accepted: --vary of one key, or of two"),
        (("--vary", f"{TIME}=1:2s:3", "--plot", "t.svg", "--polar"), "--polar draws a key over an azimuth"),
        (("--vary", f"{TIME}=1:2s", "--sample", "latin:3:1", "--plot", "t.svg"), "a table or a sample have no axes"),
        (("--vary", f"{TIME}=1:2s:3", "--plot", "t.svg", "--plot-column", "status"), "is no column of numbers"),
    ],
)
def test_what_cannot_be_asked(run, tmp_path: Path, monkeypatch, arguments: tuple[str, ...], said: str) -> None:
    monkeypatch.chdir(tmp_path)
    found = run("sweep", SECTION_V, *arguments)
    assert found.exit_code == 2
    assert said in " ".join(found.stderr.split())
    assert list(tmp_path.iterdir()) == []


def test_every_fault_of_a_table_is_a_line(run, tmp_path: Path) -> None:
    table = tmp_path / "cases.csv"
    table.write_text(f"{TIME} [s]\nx\n1\n2,3\n")
    found = run("sweep", SECTION_V, "--cases", str(table))
    assert found.exit_code == 2
    assert found.stderr.splitlines() == [
        f"{table}:2:1: {TIME}: is no number (got x); accepted: a number of s",
        f"{table}:4:3: has 2 cells; accepted: 1, as the header has",
    ]
    table.write_bytes(b"\xff\n")
    assert "cannot be read" in run("sweep", SECTION_V, "--cases", str(table)).stderr


def test_nothing_that_is_read_is_replaced(run, tmp_path: Path) -> None:
    table = tmp_path / "cases.csv"
    table.write_text(f"{TIME} [s]\n1\n")
    found = run("sweep", SECTION_V, "--cases", str(table), "-o", str(table))
    assert found.exit_code == 2
    assert table.read_text() == f"{TIME} [s]\n1\n"


def test_very_many_cases_are_started_only_by_force(run, tmp_path: Path) -> None:
    """It says how many there are, and how long they take here."""
    vary = (f"{TIME}=1:6s:1000000", "platforms.receiver.azimuth=0:180deg:1000000")
    output = tmp_path / "t.csv"
    found = run("sweep", SECTION_V, *(part for text in vary for part in ("--vary", text)), "-o", str(output))
    assert found.exit_code == 2
    assert "1000000000000 cases will take about " in found.stderr
    assert "accepted: up to 100000000, or more with --force" in found.stderr
    assert not output.exists()


@pytest.mark.parametrize(
    ("seconds", "words"), [(0.1, "1 s"), (119, "119 s"), (121, "2 minutes"), (9e3, "2 hours"), (1e6, "12 days")]
)
def test_how_long(seconds: float, words: str) -> None:
    assert lasting(seconds) == words


def test_parts_of_a_whole() -> None:
    assert [percentage(some, 10**6) for some in (0, 1, 233_000, 999_999, 10**6)] == [
        "0 %",
        "0.1 %",
        "23.3 %",
        "99.9 %",
        "100 %",
    ]


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".nc"])
@pytest.mark.parametrize("error", [KeyboardInterrupt, MemoryError])
def test_what_ends_in_the_middle_leaves_no_half_file(
    run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str, error: type[BaseException]
) -> None:
    whole = engine.Asked.shared_out

    def broken(*args: Any, **kwargs: Any) -> Iterator[Part]:
        yield next(whole(*args, **kwargs))
        raise error

    monkeypatch.setattr(engine.Asked, "shared_out", broken)
    output = tmp_path / f"t{suffix}"
    output.write_text("what was there")
    found = run("sweep", SECTION_V, "--vary", f"{TIME}=1:6s:9", "-o", str(output))
    assert found.exit_code in (2, 130)
    assert output.read_text() == "what was there"
    assert list(tmp_path.iterdir()) == [output]


def test_a_folder_that_cannot_be_written(run, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    found = run("sweep", SECTION_V, "--vary", f"{TIME}=1:6s:9", "-o", str(tmp_path / "file" / "t.csv"))
    assert found.exit_code == 2
    assert "cannot write" in found.stderr


def started(*arguments: str, **more: Any) -> "subprocess.Popen[bytes]":
    line = [sys.executable, "-m", "bisar_budget", "sweep", SPOTLIGHT, *arguments]
    return subprocess.Popen(line, cwd=ROOT, stdout=subprocess.PIPE, preexec_fn=heed_signals, **more)


def test_an_interrupt_leaves_no_half_file(tmp_path: Path) -> None:
    """A hundred million cases, ended when the first are written."""
    vary = ("--vary", f"{TIME}=1:2s:10000", "--vary", "platforms.receiver.azimuth=0:90deg:10000", "--jobs", "1")
    with started(*vary, "-o", str(tmp_path / "t.csv"), stderr=subprocess.PIPE) as process:
        try:
            deadline = time.monotonic() + 60
            while not any(file.stat().st_size for file in tmp_path.rglob("*.csv")):
                assert time.monotonic() < deadline
                assert process.poll() is None
                time.sleep(0.05)
            process.send_signal(signal.SIGINT)
            assert process.wait(timeout=60) == 130
        finally:
            process.kill()
    assert list(tmp_path.iterdir()) == []


def test_nobody_reads_on(run) -> None:
    """`sweep | head` ends, and with 0."""
    with started("--vary", f"{TIME}=1:2s:3000", stderr=subprocess.DEVNULL) as process:
        assert process.stdout is not None
        process.stdout.readline()
        process.stdout.close()
        assert process.wait(timeout=120) == 0


def test_a_terminal_has_a_bar(tmp_path: Path) -> None:
    """Work that takes a moment has one."""
    master, slave = terminal()
    line = [*watched_soon("sweep", SPOTLIGHT, "--vary", f"{TIME}=1:2s:40000"), "-o", str(tmp_path / "t.csv")]
    with subprocess.Popen(line, cwd=ROOT, stdout=subprocess.PIPE, stderr=slave) as process:
        os.close(slave)
        shown = read_all(lambda: os.read(master, 65536))
        assert process.wait(timeout=120) == 0
    os.close(master)
    assert "Checking cases" in shown
    assert "40000 cases" in shown


def watched_soon(*arguments: str) -> list[str]:
    """A command that has a bar after a tenth of a second; what follows is as long as that takes."""
    imports = "from bisar_budget.cli import main; from bisar_budget.questions import progress"
    code = f"{imports}; progress._MIN_SHOWN_S = 0.1; main()"
    return [sys.executable, "-c", code, *arguments]


def terminal() -> tuple[int, int]:
    """Both ends of a terminal of 80 columns."""
    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("4H", 24, 80, 0, 0))
    return master, slave


def read_all(read: Callable[[], bytes]) -> str:
    """All that comes until the other side closes."""
    data = b""
    while True:
        try:
            more = read()
        except OSError:  # how Linux says that a terminal was closed
            more = b""
        if not more:
            return data.decode()
        data += more


def test_the_day_decides_about_waivers(run, tmp_path: Path) -> None:
    """A waiver that is over fails again."""
    text = Path(SECTION_V).read_text(encoding="utf-8")
    mission = tmp_path / "m.yaml"
    until = date(2026, 6, 30)
    mission.write_text(
        f"{text}\nwaivers:\n  - {{id: 'transmitter.acceleration.*', until: {until}, reason: tested by hand}}\n",
        encoding="utf-8",
    )
    found = [
        [case["status"] for case in rows(run("sweep", str(mission), "--vary", f"{TIME}=3s", "--date", day).stdout)]
        for day in ("2026-06-30", "2026-07-01")
    ]
    assert found[0] != ["fail"]
    assert found[1] == ["fail"]


@pytest.mark.parametrize(("islr", "code"), [("", 0), ("requirements: { islr: -20 dB }", 1)])
def test_a_sweep_of_which_no_case_is_judged_exits_with_1(run, tmp_path, islr: str, code: int) -> None:
    file = tmp_path / "m.yaml"
    text = mission_text(platforms__receiver__motion_error__velocity="1 um/s")
    file.write_text(f"{text}{islr}", encoding="utf-8")
    assert run("sweep", file, "--vary", f"{TIME}=1,2s").exit_code == code
