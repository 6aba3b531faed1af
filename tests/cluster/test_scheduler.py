"""A sweep on the workers of a scheduler: the bytes of one without, whoever is lost, and clear words otherwise."""

import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from datetime import date
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from click.testing import CliRunner

pytest.importorskip("distributed")
pytest.importorskip("pyarrow")

from bisar_budget import __version__
from bisar_budget.cli import cli
from bisar_budget.cli.streams import complain
from bisar_budget.cluster import scheduler
from bisar_budget.cluster.scheduler import Workers
from bisar_budget.faults import ClusterError
from bisar_budget.findings.case_table import Chunks
from bisar_budget.mission.load import load_mission
from bisar_budget.mission.quantities import tree_of
from bisar_budget.questions import asked as engine
from bisar_budget.questions.asked import Asked, part_of
from bisar_budget.questions.cases import grid
from bisar_budget.verifier.limits import verify_mission
from tests.cluster.conftest import Cluster, free_port, wait_until
from tests.conftest import APART, ROOT, heed_signals

SECTION_V, ORBIT = (
    str(ROOT / "specs" / "missions" / f"{name}.yaml")
    for name in ("rigling_moses_section_v", "sentinel1_elements_besancon")
)
HEIGHT, TIME = "scene.height", "collection.aperture_time"
# The place of the scene decides the path of a satellite: each case is read, and a part takes some hundredths of a
# second. Twice as many parts as are given out at once: of a command that was held up while its workers went on, half
# is left.
ASKED = (
    *("sweep", ORBIT, "--vary", f"{HEIGHT}=350:420m:16", "--vary", f"{TIME}=0.4:0.6s:16"),
    *("--column", "transmitter.velocity.radial.allowable", "--date", "2026-01-01"),
)
CASES, PARTS = 4, 64  # in a part, and parts
# The command with such parts, that looks soon who works and waits shortly for what a lost worker had.
IMPATIENT = f"""
from bisar_budget.cli import main
from bisar_budget.cluster import scheduler
from bisar_budget.questions import asked as engine
engine._READ_PART_CASES, scheduler._LOOK_PERIOD_S, scheduler._FETCH_TIMEOUT_S = {CASES}, 0.5, 2.0
main()
"""


@pytest.fixture(scope="module", autouse=True)
def small_parts() -> Iterator[None]:
    """Parts of commands in this process too."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(engine, "_READ_PART_CASES", CASES)
        yield


@pytest.fixture(scope="module")
def expected(small_parts: None, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The table without a scheduler."""
    output = tmp_path_factory.mktemp("expected") / "t.csv"
    assert CliRunner(**APART).invoke(cli, [*ASKED, "-o", str(output), "--jobs", "1"]).exit_code == 0
    return output.read_bytes()


def command(*arguments: str, **options: Any) -> "subprocess.Popen[bytes]":
    line = [sys.executable, "-c", IMPATIENT, *ASKED, *arguments]
    return subprocess.Popen(line, cwd=ROOT, stderr=subprocess.PIPE, preexec_fn=heed_signals, **options)


def kept(output: Path) -> int:
    """Parts that are kept."""
    return len(list(Path(f"{output}.parts").glob("part-*")))


def ended(process: "subprocess.Popen[bytes]") -> tuple[int, str]:
    _, said = process.communicate(timeout=120)
    return process.returncode, said.decode()


def test_a_lost_worker_costs_only_its_chunks(cluster: Cluster, expected: bytes, tmp_path: Path) -> None:
    output = tmp_path / "t.csv"
    with command("-o", str(output), "--scheduler", cluster.address) as process:
        wait_until(lambda: kept(output) >= 2)
        cluster.workers.pop().kill()
        assert kept(output) < PARTS - 1  # it had chunks
        assert ended(process)[0] == 0
    assert output.read_bytes() == expected
    assert list(tmp_path.iterdir()) == [output]
    cluster.replace_worker()


def test_what_is_done_when_a_sweep_is_ended_is_not_done_again(
    cluster: Cluster, expected: bytes, run, tmp_path: Path
) -> None:
    """Interrupted; gone on with and killed; gone on with without the scheduler."""
    output = tmp_path / "t.csv"
    arguments = ("-o", str(output), "--scheduler", cluster.address)
    for _ in range(3):  # one that was held up may have ended before it heard
        with command(*arguments) as process:
            wait_until(lambda: kept(output) >= 2)
            process.send_signal(signal.SIGINT)
            code, said = ended(process)
        if code:
            break
        output.unlink()
    done = kept(output)
    assert 2 <= done < PARTS - 1
    assert code == 130
    assert said.strip().splitlines() == [
        f"{output}.parts keeps {done} of {PARTS} parts; the same command with --resume goes on from there."
    ]
    with command(*arguments, "--resume") as process:
        wait_until(lambda: kept(output) > done)
        process.kill()
        _, said = ended(process)
    assert said == f"{output}.parts has {done} of {PARTS} parts.\n"
    before, done = done, kept(output)
    assert before < done < PARTS
    assert not output.exists()
    found = run(*ASKED, "-o", str(output), "--resume")
    assert found.exit_code == 0
    assert found.stderr.startswith(f"{output}.parts has {done} of {PARTS} parts.\n")
    assert output.read_bytes() == expected
    assert list(tmp_path.iterdir()) == [output]


def test_processes_of_its_own(run, tmp_path: Path) -> None:
    """Of a grid in NetCDF, whose parts are not whole rows of it. Ctrl-C, which they get too, is not their affair."""
    assert run(*ASKED, "-o", str(tmp_path / "a.nc"), "--jobs", "1").exit_code == 0
    arguments = ("-o", str(tmp_path / "b.nc"), "--scheduler", "local:1")
    with command(*arguments, start_new_session=True) as process:
        wait_until(lambda: kept(tmp_path / "b.nc") >= 2)
        os.killpg(process.pid, signal.SIGINT)
        code, said = ended(process)
    assert code == 130
    assert len(said.strip().splitlines()) == 1
    assert "parts; the same command with --resume goes on from there." in said
    with command(*arguments, "--resume") as process:
        code, said = ended(process)
    assert code == 0
    assert len(said.splitlines()) == 2
    assert (tmp_path / "a.nc").read_bytes() == (tmp_path / "b.nc").read_bytes()


def test_a_worker_of_another_version_is_refused(cluster: Cluster, tmp_path: Path) -> None:
    (tmp_path / "bisar_budget").mkdir()
    (tmp_path / "bisar_budget" / "__init__.py").write_text('__version__ = "0.0.1"\n')
    there = cluster.joined()
    other = cluster.start_worker(path=str(tmp_path))
    try:
        wait_until(lambda: cluster.joined() > there)
        with pytest.raises(ClusterError) as error:
            scheduler.connected(cluster.address, 30, pytest.fail).__enter__()
    finally:
        other.kill()
    assert str(error.value).endswith(f" has bisar-budget 0.0.1; accepted: {__version__}, as here")


@pytest.mark.parametrize("address", ["tcp://127.0.0.1", "local:0", "local:x", "127.0.0.1:8786", "tcp://:8786x"])
def test_what_is_no_address(run, tmp_path: Path, address: str) -> None:
    found = run(*ASKED, "-o", str(tmp_path / "t.csv"), "--scheduler", address)
    assert found.exit_code == 2
    assert found.stderr == (
        f"Error: --scheduler {address}: is no scheduler; accepted: tcp://HOST:PORT, tls://HOST:PORT, or local:N for "
        "N processes here\n"
    )
    assert list(tmp_path.iterdir()) == []


def test_an_address_where_nobody_answers(run, tmp_path: Path) -> None:
    address = f"tcp://127.0.0.1:{free_port()}"
    found = run(*ASKED, "-o", str(tmp_path / "t.csv"), "--scheduler", address)
    assert found.exit_code == 2
    assert found.stderr == f"Error: --scheduler {address}: cannot be reached: Connection refused\n"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("answer", [b"HTTP/1.1 400 Bad Request\r\nContent-Type: text/html\r\n\r\n", b""])
def test_something_else_answers(monkeypatch: pytest.MonkeyPatch, answer: bytes) -> None:
    """Dask takes the first bytes of a web server for the length of a message, and has no memory for it."""
    monkeypatch.setattr(scheduler, "_CONNECTION_TIMEOUT_S", 0.5)

    def reply(listening: socket.socket) -> None:
        while True:
            try:
                one, _ = listening.accept()
            except OSError:
                return
            one.sendall(answer)
            opened.append(one)

    opened: list[socket.socket] = []
    with socket.create_server(("127.0.0.1", 0)) as listening:
        answering = threading.Thread(target=reply, args=(listening,))
        answering.start()
        with pytest.raises(ClusterError, match=r"cannot be reached: (what answers is no Dask|no answer within)"):
            scheduler.connected(f"tcp://127.0.0.1:{listening.getsockname()[1]}", 30, pytest.fail).__enter__()
        listening.shutdown(socket.SHUT_RDWR)
        answering.join()
    for one in opened:
        one.close()


def test_a_worker_is_no_scheduler(cluster: Cluster) -> None:
    from distributed import Client

    with Client(cluster.address, set_as_default=False) as client:
        worker = next(iter(client.nthreads()))
    with pytest.raises(ClusterError, match="cannot be reached: a Dask worker answers, no scheduler"):
        scheduler.connected(worker, 30, pytest.fail).__enter__()


def test_a_scheduler_needs_a_file_and_its_library(run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = run(*ASKED, "--scheduler", "local:2")
    assert found.exit_code == 2
    assert "--scheduler and --resume need -o FILE" in found.stderr
    monkeypatch.setitem(sys.modules, "distributed", None)
    found = run(*ASKED, "--scheduler", "local:2", "-o", str(tmp_path / "t.csv"))
    assert found.exit_code == 2
    assert "pip install distributed pyarrow" in found.stderr


class Future:
    """One of a chunk that failed, as Dask's are."""

    key, status = "chunk", "error"

    def __init__(self, error: BaseException) -> None:
        self.error = error

    def result(self, timeout: float) -> None:
        raise self.error

    def exception(self) -> BaseException:
        return self.error

    def add_done_callback(self, tell: Callable[[Any], None]) -> None:
        tell(self)


class Client:
    """A client of two workers, whose chunks fail."""

    def __init__(self, error: BaseException) -> None:
        self.error = error

    def nthreads(self) -> dict[str, int]:
        return {"tcp://a:1": 1, "tcp://b:1": 2}

    def submit(self, *arguments: Any, **options: Any) -> Future:
        return Future(self.error)

    def cancel(self, futures: list[Future]) -> None:
        self.is_cancelled = True


def asked(cases: int) -> Asked:
    mission = load_mission(SECTION_V)
    found = Asked(mission, grid(tree_of(mission), [f"{TIME}=1:2s:1000"]), today=date(2026, 1, 1))
    found.chunks = Chunks(cases, 64, True)
    return found


@pytest.mark.parametrize(
    ("error", "kind", "said"),
    [
        (ValueError("a matrix\nis singular"), RuntimeError, "^cases 64 to 127, on a worker: ValueError: a matrix$"),
        (ModuleNotFoundError("No module named 'x'"), ClusterError, "on a worker: ModuleNotFoundError: No module"),
        (ClusterError("worker w has another"), ClusterError, "^cases 64 to 127: worker w has another$"),
        (ClusterError("worker w cannot use"), ClusterError, "^cases 64 to 127: worker w cannot use$"),
    ],
)
def test_what_a_worker_raises_is_said_once(error: BaseException, kind: type[Exception], said: str) -> None:
    client = Client(error)
    workers = Workers(client, "tcp://a:0", 30, pytest.fail)
    with pytest.raises(kind, match=said):
        list(asked(1000).shared_out([64], 1, workers.mapped))
    assert workers.threads == 3
    assert client.is_cancelled


def test_what_ended_every_worker_that_had_it_is_said() -> None:
    from distributed.scheduler import KilledWorker

    error = KilledWorker("chunk", SimpleNamespace(address="tcp://b:1"), 3)
    workers = Workers(Client(error), "tcp://a:0", 30, pytest.fail)
    with pytest.raises(ClusterError, match=r"^cases 64 to 99 ended 4 workers, the last of them tcp://b:1, as when"):
        list(asked(100).shared_out([64], 1, workers.mapped))


def test_a_cluster_may_shrink(monkeypatch: pytest.MonkeyPatch) -> None:
    """More is given out then than would be given to those who are left."""
    monkeypatch.setattr(scheduler, "_LOOK_PERIOD_S", 0.0)
    sizes = iter([100])

    class Done(Future):
        def result(self, timeout: float) -> None:
            self.fetched = True

    def submit(*arguments: Any, **options: Any) -> Future:
        future = Done(ValueError())
        future.key = str(id(future))
        return future

    client = Client(ValueError())
    monkeypatch.setattr(client, "nthreads", lambda: {"tcp://a:1": next(sizes, 1)})
    monkeypatch.setattr(client, "submit", submit)
    mapped = Workers(client, "tcp://a:0", 30, pytest.fail).mapped
    assert [block for block, _ in mapped(part_of, None, range(500), str)] == list(range(500))


def test_a_scheduler_without_workers_is_given_up(run, tmp_path: Path) -> None:
    """It was waited for without end."""
    from distributed import LocalCluster

    output, said = tmp_path / "t.csv", []
    with LocalCluster(n_workers=0, processes=False, dashboard_address="127.0.0.1:0", protocol="tcp") as empty:
        address = empty.scheduler_address
        more = ("--scheduler", address, "--scheduler-timeout", "1")
        commands = (*ASKED, "-o", str(output)), ("check", SECTION_V, "--monte-carlo", "9"), ("verify", SECTION_V)
        for arguments in commands:
            found = run(*arguments, *more)
            assert (found.exit_code, found.stdout) == (2, "")
            said.append(found.stderr)
    assert set(said) == {
        f"{address} has no worker; waiting 1 s for one.\n"
        f"Error: --scheduler {address}: had no worker for 1 s; accepted: a scheduler that has one (dask worker "
        f"{address} starts one), or a longer --scheduler-timeout\n"
    }
    assert list(tmp_path.iterdir()) == []


def test_a_worker_that_comes_in_time_does_the_work(
    expected: bytes, run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from distributed import LocalCluster

    output = tmp_path / "t.csv"
    with LocalCluster(n_workers=0, processes=False, dashboard_address="127.0.0.1:0", protocol="tcp") as empty:
        later = threading.Timer(0.5, empty.scale, (1,))
        # It is started when the command says that it waits.
        monkeypatch.setattr("bisar_budget.cli.complain", lambda text: (complain(text), later.start()))
        found = run(*ASKED, "-o", str(output), "--scheduler", empty.scheduler_address)
        later.join()
    assert found.exit_code == 0, found.stderr
    assert found.stderr.startswith(f"{empty.scheduler_address} has no worker; waiting 30 s for one.\n")
    assert output.read_bytes() == expected


def test_workers_that_all_went_away_are_given_up(cluster: Cluster, tmp_path: Path, expected: bytes, run) -> None:
    """What is done stays, and can be gone on with."""
    output = tmp_path / "t.csv"
    with command("-o", str(output), "--scheduler", cluster.address, "--scheduler-timeout", "1") as process:
        wait_until(lambda: kept(output) >= 2)
        for worker in cluster.workers:
            worker.kill()
        code, said = ended(process)
    there = cluster.joined()
    cluster.workers[:] = [cluster.start_worker() for _ in cluster.workers]
    wait_until(lambda: cluster.joined() == there + len(cluster.workers))
    done = kept(output)
    assert code == 2
    assert 2 <= done < PARTS
    assert said.splitlines() == [
        f"{cluster.address} has no worker; waiting 1 s for one.",
        f"{output}.parts keeps {done} of {PARTS} parts; the same command with --resume goes on from there.",
        f"Error: --scheduler {cluster.address}: had no worker for 1 s; accepted: a scheduler that has one (dask "
        f"worker {cluster.address} starts one), or a longer --scheduler-timeout",
    ]
    assert run(*ASKED, "-o", str(output), "--resume", "--jobs", "1").exit_code == 0
    assert output.read_bytes() == expected


def test_images_are_formed_on_workers(cluster: Cluster, run) -> None:
    asked = ("verify", SECTION_V, "--only", "receiver.velocity.?")
    alone, shared = run(*asked, "--jobs", "1"), run(*asked, "--scheduler", cluster.address)
    assert (shared.exit_code, shared.stderr) == (alone.exit_code, "")
    assert shared.stdout == alone.stdout


def test_which_row_failed_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    mapped = Workers(Client(ValueError("a matrix")), "tcp://a:0", 30, pytest.fail).mapped
    with pytest.raises(RuntimeError, match=r"^timing.quadratic of .*Section V.*, on a worker: ValueError: a matrix$"):
        verify_mission(load_mission(SECTION_V), "timing.quadratic", mapped=mapped)
