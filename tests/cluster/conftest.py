"""A scheduler and two workers, as processes, for the tests of this folder."""

import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from typing import NamedTuple

import pytest

from tests.conftest import ROOT


class Cluster(NamedTuple):
    """A scheduler and its workers, as processes."""

    address: str
    start_worker: Callable[..., "subprocess.Popen[bytes]"]
    workers: list["subprocess.Popen[bytes]"]
    joined: Callable[[], int]

    def replace_worker(self) -> None:
        """Have two workers again."""
        there = self.joined()
        self.workers.append(self.start_worker())
        wait_until(lambda: self.joined() > there)


def free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        port: int = found.getsockname()[1]
    return port


def wait_until(is_so: Callable[[], object], seconds: float = 60) -> None:
    deadline = time.monotonic() + seconds
    while not is_so():
        assert time.monotonic() < deadline
        time.sleep(0.02)


# What processes of Dask do while they wait, a fiftieth of a core each.
IDLE = {"DASK_DISTRIBUTED__WORKER__PROFILE__ENABLED": "False", "DASK_DISTRIBUTED__ADMIN__TICK__INTERVAL": "1s"}


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    folder = tmp_path_factory.mktemp("cluster")
    log = (folder / "log").open("wb")
    address = f"tcp://127.0.0.1:{free_port()}"
    started: list[subprocess.Popen[bytes]] = []

    def start(*line: str, path: str = "") -> "subprocess.Popen[bytes]":
        environment = {
            **os.environ,
            "PYTHONPATH": os.pathsep.join(filter(None, (path, str(ROOT)))),
            "OMP_NUM_THREADS": "1",
            **IDLE,
        }
        command = [sys.executable, "-W", "ignore", "-m", *line]
        started.append(subprocess.Popen(command, env=environment, cwd=folder, stdout=log, stderr=log))
        return started[-1]

    def start_worker(path: str = "") -> "subprocess.Popen[bytes]":
        options = ("--nthreads", "1", "--no-nanny", "--no-dashboard", "--local-directory", str(folder))
        return start("distributed.cli.dask_worker", address, *options, path=path)

    def joined() -> int:
        return (folder / "log").read_bytes().count(b"Register worker")

    port = address.rpartition(":")[2]
    start("distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", port, "--no-dashboard")
    try:
        workers = [start_worker(), start_worker()]
        wait_until(lambda: joined() >= 2)
        yield Cluster(address, start_worker, workers, joined)
    finally:
        for process in reversed(started):
            process.kill()
            process.wait()
        log.close()
