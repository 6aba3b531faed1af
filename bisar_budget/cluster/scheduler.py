"""The workers of a Dask scheduler, which call a function with what is common and with each of many blocks.

A block is some cases of a sweep, some draws of a Monte Carlo, or a row to verify. What is common, such as the mission
with all that it names, goes to a worker once. Dask gives the blocks of a worker that is lost to others. A worker
needs bisar-budget of the same version, nothing else.
"""

import asyncio
import logging
import pickle
import pydoc
import re
import signal
import socket
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from itertools import islice
from multiprocessing import resource_tracker
from queue import Empty, SimpleQueue
from time import monotonic
from typing import Any
from urllib.parse import urlsplit

from bisar_budget import __version__
from bisar_budget.cluster.parts_folder import check_libraries
from bisar_budget.faults import ClusterError, MissionError, printable
from bisar_budget.memory import OF_CLUSTER

_ADDRESS = re.compile(r"(?:tcp|tls)://\S+:\d{1,5}", re.ASCII)
_LOCAL = re.compile(r"local:([1-9]\d{0,2})", re.ASCII)
_ACCEPTED = "accepted: tcp://HOST:PORT, tls://HOST:PORT, or local:N for N processes here"
_CONNECTION = 5.0  # s for a connection
_LOOK = 5.0  # s between two looks at who works
_FETCH = 20.0  # s for what came of a block; then it is looked who works
_AHEAD = 4  # blocks for each thread of a worker that are given out at once
_LEAST_AHEAD = 32


@contextmanager
def connected(address: str, patience: float, tell: Callable[[str], None]) -> "Iterator[Workers]":
    """Give the workers of a scheduler; `local:N` starts N here, and ends them.

    `patience` is how long it may have no worker before it is given up [s]; `tell` takes what somebody who waits is to
    know. A `ClusterError` says that it cannot be reached, has no worker, or one with another version of bisar-budget,
    a `MemoryError` that there is no room for its libraries.
    """
    local = _LOCAL.fullmatch(address)
    if not (local or _ADDRESS.fullmatch(address)):
        raise ClusterError(f"--scheduler {printable(address)}: is no scheduler; {_ACCEPTED}")
    check_libraries("--scheduler", OF_CLUSTER, "cluster", "distributed", "pyarrow")
    from distributed import Client

    with ExitStack() as ends:
        ends.callback(logging.disable, logging.root.manager.disable)
        logging.disable(logging.CRITICAL)  # what matters of what Dask logs is said here
        try:
            if not local:
                _greet(address)
            cluster = _local_cluster(int(local[1]), ends) if local else address
            client: Any = Client(cluster, timeout=_CONNECTION, set_as_default=False)
        except Exception as error:
            reason = f"no answer within {_CONNECTION:g} s" if isinstance(error, TimeoutError) else _first_line(error)
            raise ClusterError(f"--scheduler {address}: cannot be reached: {reason}") from None
        ends.callback(_close, client, 2)
        client.loop.asyncio_loop.set_exception_handler(lambda *_: None)  # it would write of what is given up
        workers = Workers(client, address, patience, tell)
        workers.look()
        # By a function of Python's own, which a worker of any version has.
        versions = client.run(pydoc.locate, "bisar_budget.__version__", on_error="return")
        for worker, version in sorted(versions.items()):
            if version != __version__:
                raise ClusterError(f"--scheduler {address}: {_unlike(worker, version, __version__)}")
        yield workers


def _local_cluster(count: int, ends: ExitStack) -> Any:
    """Start a scheduler and workers here; `ends` closes them.

    A thread does it, which Ctrl-C does not stop half way: half of a cluster cannot be closed.
    """
    from distributed import LocalCluster

    def started() -> Any:
        cluster = LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            dashboard_address="127.0.0.1:0",  # a port of its own: without one all would want 8787
            silence_logs=logging.CRITICAL + 1,
            preload=[__name__],
        )
        ends.callback(_close, cluster, 10)
        return cluster

    resource_tracker.ensure_running()  # else that thread would: it unblocks the signal there
    with ThreadPoolExecutor(1, initializer=_block_interrupts) as starter:
        return starter.submit(started).result()


def _block_interrupts() -> None:
    """Block Ctrl-C in this thread and in the workers that it starts, before they could ignore it."""
    if hasattr(signal, "pthread_sigmask"):  # Windows has none
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})


def dask_setup(worker: object) -> None:
    """Leave Ctrl-C, which a terminal sends to every process, to the command; Dask calls this in workers of here."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _close(opened: Any, seconds: float) -> None:
    with suppress(Exception):  # what is left of it ends with this process
        opened.close(timeout=seconds)


def _greet(address: str) -> None:
    """Raise what is wrong with an address before a client tries it, which takes longer and knows less."""
    from distributed.core import rpc
    from distributed.security import Security

    url = urlsplit(address)
    socket.create_connection((url.hostname or "", url.port or 0), timeout=_CONNECTION).close()

    async def identity() -> Any:
        secured = Security().get_connection_args("client")
        async with rpc(address, timeout=_CONNECTION, connection_args=secured) as scheduler:
            return await asyncio.wait_for(scheduler.identity(), _CONNECTION)

    try:
        kind = asyncio.run(identity())["type"]
    except MemoryError:  # the first bytes of a web server were taken for the length of a message
        raise OSError("what answers is no Dask scheduler") from None
    if kind != "Scheduler":
        raise OSError(f"a Dask {kind.lower()} answers, no scheduler")


@dataclass
class Workers:
    """Workers of a scheduler; `threads` is how many they had at the last look."""

    client: Any
    address: str
    patience: float
    tell: Callable[[str], None]
    threads: int = 0

    def look(self) -> None:
        """Look who works; where nobody does, wait for a worker, and raise a `ClusterError` where none comes."""
        with suppress(Exception):  # a scheduler that is gone: the blocks say so
            self.threads = sum(self.client.nthreads().values())
        if self.threads:
            return
        self.tell(f"{self.address} has no worker; waiting {self.patience:g} s for one.")
        try:
            self.client.wait_for_workers(1, timeout=self.patience)
        except TimeoutError:
            raise ClusterError(
                f"--scheduler {self.address}: had no worker for {self.patience:g} s; accepted: a scheduler that has "
                f"one (dask worker {self.address} starts one), or a longer --scheduler-timeout"
            ) from None
        except Exception:
            raise self._gone() from None
        self.threads = sum(self.client.nthreads().values())

    def mapped(
        self, function: Callable[[Any, Any], Any], common: Any, blocks: Iterable[Any], about: Callable[[Any], str]
    ) -> Iterator[tuple[Any, Any]]:
        """Have workers call `function(common, block)`; gives each block with what came of it, in any order.

        `about` says of a block what it is, for messages. Few blocks are given out ahead. A `ClusterError` says that
        the scheduler went away, or all workers, that a block ended every worker that had it, or that one cannot do
        it; a `RuntimeError` what the function raised, and where.
        """
        finished: SimpleQueue[Any] = SimpleQueue()
        # A task gives what is common, not the client: Dask makes it again where a worker that has it is lost.
        shared = self.client.submit(pickle.loads, pickle.dumps(common), pure=False)
        pending: dict[str, tuple[Any, Any]] = {}
        remaining, next_look = iter(blocks), 0.0
        try:
            while True:
                if monotonic() >= next_look:
                    self.look()
                    next_look = monotonic() + _LOOK
                ahead = max(_LEAST_AHEAD, _AHEAD * self.threads)
                for block in islice(remaining, max(0, ahead - len(pending))):
                    future = self.client.submit(_called, __version__, function, shared, block, pure=False)
                    pending[future.key] = future, block
                    future.add_done_callback(finished.put)
                if not pending:
                    return
                with suppress(Empty):
                    future = finished.get(timeout=max(next_look - monotonic(), 0.05))
                    try:  # Dask makes again what a worker took with it between done and fetched
                        result = future.result(timeout=_FETCH)
                    except Exception as error:
                        if future.status == "error":
                            raise _why(future.exception(), about(pending[future.key][1])) from None
                        if not isinstance(error, TimeoutError):  # cancelled, with the connection
                            raise self._gone() from error
                        finished.put(future)
                        continue
                    yield pending.pop(future.key)[1], result
        finally:
            with suppress(Exception):
                self.client.cancel([shared, *(future for future, _ in pending.values())])

    def _gone(self) -> ClusterError:
        return ClusterError(f"--scheduler {self.address}: went away")


def _called(version: str, function: Callable[[Any, Any], Any], common: Any, block: Any) -> Any:
    """Do a block on a worker; one that came after the others were asked may have another version."""
    from distributed import get_worker

    here = get_worker().address
    if version != __version__:
        raise ClusterError(_unlike(here, __version__, version))
    try:
        return function(common, block)
    except MissionError as error:
        raise ClusterError(f"worker {here} cannot use the mission: {'; '.join(error.lines())}") from None


def _unlike(worker: str, installed_version: object, version: str) -> str:
    has = (
        f"bisar-budget {installed_version}"
        if isinstance(installed_version, str)
        else "no bisar-budget that can be imported"
    )
    return f"worker {worker} has {has}; accepted: {version}, as here"


def _why(error: BaseException, about: str) -> Exception:
    """Words for the fault of a block that failed."""
    from distributed.scheduler import KilledWorker

    if isinstance(error, ClusterError):  # the worker is not like this process
        return ClusterError(f"{about}: {error}")
    if isinstance(error, KilledWorker):
        last = error.last_worker.address
        return ClusterError(
            f"{about} ended {error.allowed_failures + 1} workers, the last of them {last}, as when memory runs out"
        )
    message = f"{about}, on a worker: {type(error).__name__}: {_first_line(error)}"
    return (ClusterError if isinstance(error, ImportError | MemoryError) else RuntimeError)(message)


def _first_line(error: BaseException) -> str:
    text = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return printable(text.partition("\n")[0])
