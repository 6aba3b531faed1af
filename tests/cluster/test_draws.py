"""Draws on the workers of a scheduler: the bytes of draws without one, whoever is lost, and clear words otherwise."""

import os
import random
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("distributed")
pytest.importorskip("pyarrow")

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.cluster.scheduler import Workers, connected
from bisar_budget.mission.load import load_mission
from bisar_budget.questions import drawn_errors, progress
from bisar_budget.sampling import draws as drawing
from bisar_budget.sampling.draws import Drawing, in_turn, joined, shared_out
from bisar_budget.sampling.probability import monte_carlo
from tests.cli.test_sweep import read_all, terminal, watched_soon
from tests.cluster.conftest import Cluster, wait_until
from tests.cluster.test_scheduler import Client
from tests.conftest import ROOT, heed_signals

DRONES = str(ROOT / "specs" / "missions" / "drones_same_gnss.yaml")
LARGE = str(ROOT / "specs" / "missions" / "uav_pair_l_band.yaml")  # its draws go through exact ranges


@pytest.fixture
def short_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Chunks of some hundredths of a second."""
    monkeypatch.setattr(drawing, "CHUNK_DRAWS", 1 << 15)
    monkeypatch.setattr(drawing, "EXACT_PIECE_DRAWS", 1 << 12)


def drawing_of(file: str, draws: int) -> Drawing:
    """What `monte_carlo` draws of a mission."""
    taken: list[Drawing] = []
    monte_carlo(Analysis(load_mission(file)), draws, 3, lambda one: taken.append(one) or iter(()))  # type: ignore[func-returns-value]
    return taken[0]


@pytest.mark.usefixtures("short_chunks")
def test_who_draws_does_not_matter(run, cluster: Cluster) -> None:
    """The same bytes of one process, of two of its own, and of a scheduler; of a second mission by exact ranges."""
    arguments = ("check", DRONES, LARGE, "--monte-carlo", "70e3", "--seed", "3", "--format", "json")
    alone = run(*arguments)
    assert alone.exit_code == 1
    assert alone.stdout.count('"is_exact": true') == 1
    for address in (cluster.address, "local:2"):
        found = run(*arguments, "--scheduler", address)
        assert (found.exit_code, found.stderr) == (1, "")
        assert found.stdout == alone.stdout


@pytest.mark.usefixtures("short_chunks")
def test_a_lost_worker_costs_only_its_draws(cluster: Cluster) -> None:
    drawn = drawing_of(DRONES, 60 << 15)
    pieces = []
    with connected(cluster.address, 30, pytest.fail) as workers:
        for piece, tally in shared_out(drawn, workers.mapped):
            pieces.append((piece, tally))
            if len(pieces) == 3:
                cluster.workers.pop().kill()
    cluster.replace_worker()
    assert sorted(pieces) == list(in_turn(drawn))
    random.Random(1).shuffle(pieces)
    count = len(drawn.judged)
    assert joined((tally for _, tally in pieces), count) == joined((tally for _, tally in in_turn(drawn)), count)


def test_an_interrupt_while_workers_are_started() -> None:
    """A terminal sends it to them too: they wrote tracebacks, and half of a cluster was closed with another one."""
    line = [sys.executable, "-m", "bisar_budget", "check", DRONES, "--monte-carlo", "1e9", "--scheduler", "local:2"]
    pipes: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(line, start_new_session=True, preexec_fn=heed_signals, **pipes) as process:
        wait_until(lambda: len(children(process.pid)) > 1)
        os.killpg(process.pid, signal.SIGINT)
        output, said = process.communicate(timeout=120)
        assert (output, said.strip()) == (b"", b"")
        assert process.returncode == 130


def children(pid: int) -> list[str]:
    """Processes that any thread of a process has started."""
    return " ".join(path.read_text() for path in Path(f"/proc/{pid}/task").glob("*/children")).split()


@pytest.mark.usefixtures("short_chunks")
def test_which_draws_failed_is_said() -> None:
    workers = Workers(Client(ValueError("a matrix\nis singular")), "tcp://a:0", 30, pytest.fail)
    said = r"^draws 0 to 29999 of Two drones with the same GNSS, on a worker: ValueError: a matrix$"
    with pytest.raises(RuntimeError, match=said):
        list(shared_out(drawing_of(DRONES, 30_000), workers.mapped))


def test_what_cannot_be_shared_out(run, monkeypatch: pytest.MonkeyPatch) -> None:
    found = run("check", DRONES, "--scheduler", "local:2")
    assert found.exit_code == 2
    assert "--scheduler local:2: shares out draws, and needs --monte-carlo N." in found.stderr
    found = run("check", DRONES, "--monte-carlo", "9", "--scheduler", "local:two")
    assert found.exit_code == 2
    assert found.stderr.startswith("Error: --scheduler local:two: is no scheduler; accepted: tcp://HOST:PORT")
    found = run("check", DRONES, "--explain", "mission.location_error", "--scheduler", "local:2")
    assert found.exit_code == 2
    monkeypatch.setitem(sys.modules, "distributed", None)
    found = run("check", DRONES, "--monte-carlo", "9", "--scheduler", "local:2")
    assert found.exit_code == 2
    assert "pip install distributed pyarrow" in found.stderr


def test_how_many_draws_one_machine_makes(run) -> None:
    found = run("check", DRONES, "--monte-carlo", "2e9")
    assert found.exit_code == 2
    assert (
        "--monte-carlo 2,000,000,000: must be at most 1,000,000,000 draws; with --scheduler ADDRESS, whose workers "
        "share them, 1,000,000,000,000.\n"
    ) in found.stderr


def test_a_terminal_has_a_bar() -> None:
    master, slave = terminal()
    line = watched_soon("check", "-q", DRONES, "--monte-carlo", "3e6")
    with subprocess.Popen(line, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=slave) as process:
        os.close(slave)
        shown = read_all(lambda: os.read(master, 65536))
        assert process.wait(timeout=120) == 1
    os.close(master)
    assert "Drawing errors" in shown


def test_how_long_many_draws_take(run, monkeypatch: pytest.MonkeyPatch) -> None:
    """By the time of some of them, shared by as many threads as there are."""
    monkeypatch.setattr(drawn_errors, "_MANY_DRAWS", 10_000)
    monkeypatch.setattr(progress, "_LEAST_TRIAL_S", 0.001)
    monkeypatch.setattr(progress, "MIN_ANNOUNCED_S", 0.0)
    found = run("check", "-q", DRONES, "--monte-carlo", "20e3")
    assert found.stderr.startswith("20,000 draws of Two drones with the same GNSS will take about ")
    assert found.stderr.endswith(" s.\n")
    assert run("check", "-q", DRONES, "--monte-carlo", "10e3").stderr == ""
