"""Execution of a function on the workers of a Dask scheduler, once for each of many blocks of work.

A block is a number of cases of a sweep, a number of draws of a Monte Carlo simulation, or a row to verify. Data that
all blocks need, such as the mission with its files, are sent to a worker only once. If a worker is lost, Dask gives
its blocks to other workers. A worker needs only the same version of bisar-budget as the command.
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
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from bisar_budget import __version__
from bisar_budget.cluster.parts_folder import check_libraries
from bisar_budget.faults import ClusterError, MissionError, printable
from bisar_budget.memory import CLUSTER_MEMORY_BYTES
from bisar_budget.workers import Block, Common, Result

if TYPE_CHECKING:
    from distributed import Client, Future, LocalCluster

_ADDRESS = re.compile(r"(?:tcp|tls)://\S+:\d{1,5}", re.ASCII)
_LOCAL = re.compile(r"local:([1-9]\d{0,2})", re.ASCII)
_ACCEPTED_ADDRESSES = "accepted: tcp://HOST:PORT, tls://HOST:PORT, or local:N for N processes here"
_CONNECTION_TIMEOUT_S = 5.0
_LOOK_PERIOD_S = 5.0  # time between two counts of the workers
_FETCH_TIMEOUT_S = 20.0  # longest wait for the result of a block before the workers are counted again
_BLOCKS_PER_THREAD = 4  # number of blocks submitted ahead for each thread of a worker
_MIN_PENDING_BLOCKS_COUNT = 32


@contextmanager
def connected(address: str, patience: float, tell: Callable[[str], None]) -> "Iterator[Workers]":
    """Connect to the workers of a scheduler, and close the connection at the end of the context.

    The address `local:N` starts N workers on this machine and ends them later. `patience` is the longest time to wait
    for a worker [s]. `tell` is called with messages for a waiting user. Raises `ClusterError` if the scheduler cannot
    be reached, has no worker, or has a worker with another version of bisar-budget. Raises `MemoryError` if there is
    not enough memory for the Dask libraries.
    """
    local = _LOCAL.fullmatch(address)
    if not (local or _ADDRESS.fullmatch(address)):
        raise ClusterError(f"--scheduler {printable(address)}: is no scheduler; {_ACCEPTED_ADDRESSES}")
    check_libraries("--scheduler", CLUSTER_MEMORY_BYTES, "cluster", "distributed", "pyarrow")
    from distributed import Client

    with ExitStack() as ends:
        ends.callback(logging.disable, logging.root.manager.disable)
        logging.disable(logging.CRITICAL)  # messages of this module replace the log of Dask
        try:
            if not local:
                _greet(address)
            cluster = _local_cluster(int(local[1]), ends) if local else address
            client: Any = Client(cluster, timeout=_CONNECTION_TIMEOUT_S, set_as_default=False)
        except Exception as error:
            timeout_words = f"no answer within {_CONNECTION_TIMEOUT_S:g} s"
            problem = timeout_words if isinstance(error, TimeoutError) else _first_line(error)
            raise ClusterError(f"--scheduler {address}: cannot be reached: {problem}") from None
        ends.callback(_close, client, 2)
        client.loop.asyncio_loop.set_exception_handler(lambda *_: None)  # it would report cancelled work
        workers = Workers(client, address, patience, tell)
        workers.look()
        # The function is from Python's standard library, so that workers of any version have it.
        versions = client.run(pydoc.locate, "bisar_budget.__version__", on_error="return")
        for worker, version in sorted(versions.items()):
            if version != __version__:
                raise ClusterError(f"--scheduler {address}: {_version_problem(worker, version, __version__)}")
        yield workers


def _local_cluster(count: int, ends: ExitStack) -> "LocalCluster":
    """Start a scheduler and `count` workers on this machine, and register their shutdown in `ends`.

    They are started in a separate thread, which Ctrl-C does not interrupt. A cluster whose start was interrupted
    could not be closed.
    """
    from distributed import LocalCluster

    def started() -> LocalCluster:
        cluster = LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            dashboard_address="127.0.0.1:0",  # a free port; by default all clusters use port 8787
            silence_logs=logging.CRITICAL + 1,
            preload=[__name__],
        )
        ends.callback(_close, cluster, 10)
        return cluster

    resource_tracker.ensure_running()  # otherwise the thread would start it and unblock the signal
    with ThreadPoolExecutor(1, initializer=_block_interrupts) as starter:
        return starter.submit(started).result()


def _block_interrupts() -> None:
    """Block Ctrl-C in this thread and in the worker processes that it starts.

    The workers later ignore Ctrl-C themselves, see `dask_setup`.
    """
    if hasattr(signal, "pthread_sigmask"):  # not on Windows
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})


def dask_setup(worker: object) -> None:
    """Make a worker of a local cluster ignore Ctrl-C, because a terminal sends it to every process.

    Dask calls this function by its name when a worker starts.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _close(opened: "Client | LocalCluster", seconds: float) -> None:
    with suppress(Exception):  # anything still open ends with this process
        opened.close(timeout=seconds)


def _greet(address: str) -> None:
    """Check that a Dask scheduler answers at an address, and raise `OSError` if another program answers.

    A Dask client would take longer to detect this problem, and its error message would be less specific.
    """
    from distributed.core import rpc
    from distributed.security import Security

    url = urlsplit(address)
    socket.create_connection((url.hostname or "", url.port or 0), timeout=_CONNECTION_TIMEOUT_S).close()

    async def identity() -> dict[str, str]:
        secured = Security().get_connection_args("client")
        async with rpc(address, timeout=_CONNECTION_TIMEOUT_S, connection_args=secured) as scheduler:
            return await asyncio.wait_for(scheduler.identity(), _CONNECTION_TIMEOUT_S)

    try:
        kind = asyncio.run(identity())["type"]
    except MemoryError:  # the first bytes of a web server's answer were read as the length of a message
        raise OSError("what answers is no Dask scheduler") from None
    if kind != "Scheduler":
        raise OSError(f"a Dask {kind.lower()} answers, no scheduler")


@dataclass
class Workers:
    """The workers of a scheduler; `threads` is their number of threads at the last count."""

    client: "Client"
    address: str
    patience: float
    tell: Callable[[str], None]
    threads: int = 0

    def look(self) -> None:
        """Count the threads of the workers, and wait for a worker if there are none.

        Raises `ClusterError` if no worker appears in time, or if the connection to the scheduler is lost.
        """
        with suppress(Exception):  # a lost scheduler is reported later, with the blocks
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
        self,
        function: Callable[[Common, Block], Result],
        common: Common,
        blocks: Iterable[Block],
        about: Callable[[Block], str],
    ) -> Iterator[tuple[Block, Result]]:
        """Call `function(common, block)` on workers for each block, and yield the blocks with their results.

        The order of the results is arbitrary. `about` returns the name of a block for messages. Only a few blocks per
        thread are submitted in advance. Raises `ClusterError` if the scheduler or all workers are lost, if a block
        has caused the loss of several workers in turn, or if a worker cannot compute a block. Raises `RuntimeError`
        if the function raised an error.
        """
        finished: SimpleQueue[Future[Result]] = SimpleQueue()
        # The common data are the result of a task, so that Dask can create them again if their worker is lost.
        shared = self.client.submit(pickle.loads, pickle.dumps(common), pure=False)
        pending: dict[object, tuple[Future[Result], Block]] = {}
        remaining, next_look = iter(blocks), 0.0
        try:
            while True:
                if monotonic() >= next_look:
                    self.look()
                    next_look = monotonic() + _LOOK_PERIOD_S
                max_pending = max(_MIN_PENDING_BLOCKS_COUNT, _BLOCKS_PER_THREAD * self.threads)
                for block in islice(remaining, max(0, max_pending - len(pending))):
                    future = self.client.submit(_called, __version__, function, shared, block, pure=False)
                    pending[future.key] = future, block
                    future.add_done_callback(finished.put)
                if not pending:
                    return
                with suppress(Empty):
                    future = finished.get(timeout=max(next_look - monotonic(), 0.05))
                    try:  # Dask repeats a block if its worker is lost before the result is fetched
                        result = future.result(timeout=_FETCH_TIMEOUT_S)
                    except Exception as error:
                        if future.status == "error":
                            raise _fault_of_block(future.exception(), about(pending[future.key][1])) from None
                        if not isinstance(error, TimeoutError):  # cancelled because the connection is lost
                            raise self._gone() from error
                        finished.put(future)
                        continue
                    yield pending.pop(future.key)[1], result
        finally:
            with suppress(Exception):
                self.client.cancel([shared, *(future for future, _ in pending.values())])

    def _gone(self) -> ClusterError:
        return ClusterError(f"--scheduler {self.address}: went away")


def _called(version: str, function: Callable[[Common, Block], Result], common: Common, block: Block) -> Result:
    """Call `function(common, block)` on a worker, if the worker has the expected version of bisar-budget.

    Raises `ClusterError` if the version differs or if the worker cannot use the mission. The version can differ if
    the worker joined after the first check.
    """
    from distributed import get_worker

    worker = get_worker().address
    if version != __version__:
        raise ClusterError(_version_problem(worker, __version__, version))
    try:
        return function(common, block)
    except MissionError as error:
        raise ClusterError(f"worker {worker} cannot use the mission: {'; '.join(error.lines())}") from None


def _version_problem(worker: str, worker_version: object, version: str) -> str:
    is_installed = isinstance(worker_version, str)
    installed = f"bisar-budget {worker_version}" if is_installed else "no bisar-budget that can be imported"
    return f"worker {worker} has {installed}; accepted: {version}, as here"


def _fault_of_block(error: BaseException, about: str) -> Exception:
    """Convert the error of a failed block to the exception to raise.

    `about` is the name of the block in the error message.
    """
    from distributed.scheduler import KilledWorker

    if isinstance(error, ClusterError):  # the worker has another version or cannot use the mission
        return ClusterError(f"{about}: {error}")
    if isinstance(error, KilledWorker):
        last_worker = error.last_worker.address
        return ClusterError(
            f"{about} ended {error.allowed_failures + 1} workers, the last of them {last_worker}, as when "
            "memory runs out"
        )
    message = f"{about}, on a worker: {type(error).__name__}: {_first_line(error)}"
    return (ClusterError if isinstance(error, ImportError | MemoryError) else RuntimeError)(message)


def _first_line(error: BaseException) -> str:
    text = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return printable(text.partition("\n")[0])
