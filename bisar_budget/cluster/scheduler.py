"""The workers of a Dask scheduler, which check the chunks of a sweep, or make pieces of draws.

A worker gets what all of them are about once: the question of a sweep with the mission and all that it names, or what
is drawn. Then it gets the cases of each chunk, or which draws to make. Dask gives the chunks of a worker that is lost
to others. A worker needs bisar-budget of the same version, nothing else.
"""

import asyncio
import logging
import pickle
import pydoc
import re
import signal
import socket
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from queue import Empty, SimpleQueue
from time import monotonic
from typing import Any, NamedTuple
from urllib.parse import urlsplit

from bisar_budget import __version__
from bisar_budget.cluster.parts_folder import encoded
from bisar_budget.design.sweep import Asked, Chunks, Question, part_of
from bisar_budget.faults import MissionError, printable
from bisar_budget.memory import OF_CLUSTER, hold_room
from bisar_budget.monte_carlo.draws import Drawer, Drawing, DrawsPiece, Tally

_ADDRESS = re.compile(r"(?:tcp|tls)://\S+:\d{1,5}", re.ASCII)
_LOCAL = re.compile(r"local:([1-9]\d{0,2})", re.ASCII)
_ACCEPTED = "accepted: tcp://HOST:PORT, tls://HOST:PORT, or local:N for N processes here"
_PATIENCE = 5.0  # s for a connection
_LOOK = 5.0  # s between two looks at who works
_AHEAD = 4  # chunks for each thread of a worker that are given out at once
_LEAST_AHEAD = 32


class _Task(NamedTuple):
    """One that a worker gets: `name` is the caller's, `about` that in messages."""

    name: Any
    about: str
    arguments: tuple[Any, ...]


class ClusterError(Exception):
    """Workers that cannot be used; the message says why, and what can be done."""


def check_address(address: str) -> None:
    """Refuse what is no address of a scheduler, or a scheduler without its libraries, by a `ClusterError`.

    A `MemoryError` says that there is no room for them.
    """
    if not (_ADDRESS.fullmatch(address) or _LOCAL.fullmatch(address)):
        raise ClusterError(f"--scheduler {printable(address)}: is no scheduler; {_ACCEPTED}")
    hold_room(OF_CLUSTER, "--scheduler")
    try:
        import distributed  # noqa: F401
        import pyarrow  # noqa: F401
    except ImportError as error:
        raise ClusterError(
            f"--scheduler needs {error.name}, which is not installed; pip install 'bisar-budget[cluster]' brings it"
        ) from None


@contextmanager
def connected(address: str, tell: Callable[[str], None]) -> "Iterator[Workers]":
    """Give the workers of a scheduler; `local:N` starts N here, and ends them.

    Parameters
    ----------
    address : str
        One that `check_address` takes.
    tell : callable
        Takes what somebody who waits should know.

    Raises
    ------
    ClusterError
        The scheduler cannot be reached, or a worker has another version of bisar-budget.
    """
    check_address(address)
    with _silence(), ExitStack() as ends:
        try:
            client = _client(address, ends)
        except Exception as error:
            said = f"no answer within {_PATIENCE:g} s" if isinstance(error, TimeoutError) else _first_line(error)
            raise ClusterError(f"--scheduler {address}: cannot be reached: {said}") from None
        workers = Workers(client, address, tell)
        workers.check_versions()
        yield workers


def _client(address: str, ends: ExitStack) -> Any:
    """Connect; `ends` closes what is opened here."""
    from distributed import Client, LocalCluster

    cluster = None
    if match := _LOCAL.fullmatch(address):
        with _interrupts_later():
            cluster = LocalCluster(
                n_workers=int(match[1]),
                threads_per_worker=1,
                dashboard_address="127.0.0.1:0",  # a port of its own: without one all would want 8787
                silence_logs=logging.CRITICAL + 1,
                preload=["bisar_budget.cluster.local_worker"],
            )
            ends.callback(_close, cluster, 10)
    else:
        _greet(address)
    client = Client(cluster or address, timeout=_PATIENCE, set_as_default=False)
    ends.callback(_close, client, 2)
    return client


@contextmanager
def _interrupts_later() -> Iterator[None]:
    """Hold Ctrl-C back while workers are started: half of a cluster cannot be closed.

    A terminal sends it to them too. They and the thread that starts them have it blocked from the beginning, before
    they could ignore it.
    """
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or before is None:
        yield
        return
    held: list[int] = []
    signal.signal(signal.SIGINT, lambda number, _: held.append(number))
    can_block = hasattr(signal, "pthread_sigmask")
    if can_block:
        from multiprocessing import resource_tracker

        resource_tracker.ensure_running()  # else that thread would: it unblocks the signal there
        mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        if can_block:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        signal.signal(signal.SIGINT, before)
        if held:
            signal.raise_signal(signal.SIGINT)


def _close(opened: Any, seconds: float) -> None:
    with suppress(Exception):  # what is left of it ends with this process
        opened.close(timeout=seconds)


@contextmanager
def _silence() -> Iterator[None]:
    """Keep what Dask logs to oneself: what matters of it is said here."""
    before = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        yield
    finally:
        logging.disable(before)


def _greet(address: str) -> None:
    """Raise what is wrong with an address before a client tries it, which takes longer and knows less.

    Of what answers otherwise than Dask does, its client may take some bytes for the length of a message.
    """
    from distributed.core import rpc
    from distributed.security import Security

    url = urlsplit(address)
    socket.create_connection((url.hostname or "", url.port or 0), timeout=_PATIENCE).close()

    async def identity() -> Any:
        secured = Security().get_connection_args("client")
        async with rpc(address, timeout=_PATIENCE, connection_args=secured) as scheduler:
            return await asyncio.wait_for(scheduler.identity(), _PATIENCE)

    try:
        kind = asyncio.run(identity())["type"]
    except MemoryError:
        kind = ""
    if kind != "Scheduler":
        raise OSError(f"a Dask {kind.lower()} answers, no scheduler" if kind else "what answers is no Dask scheduler")


class Workers:
    """What works for a scheduler; `threads` of it at the last look."""

    def __init__(self, client: Any, address: str, tell: Callable[[str], None]) -> None:
        self.client, self.address, self.tell = client, address, tell
        self.threads = self._threads()
        self._is_told = False

    def _threads(self) -> int:
        return sum(self.client.nthreads().values())

    def check_versions(self) -> None:
        """Refuse workers that have another version of bisar-budget, or none."""
        # By a function of Python's own, which a worker of any version has.
        found = self.client.run(pydoc.locate, "bisar_budget.__version__", on_error="return")
        for worker, version in sorted(found.items()):
            if version != __version__:
                raise ClusterError(self._unlike(worker, version))

    def _unlike(self, worker: str, version: object) -> str:
        has = f"bisar-budget {version}" if isinstance(version, str) else "no bisar-budget that can be imported"
        return f"--scheduler {self.address}: worker {worker} has {has}; accepted: {__version__}, as here"

    def shared_out(
        self, asked: Asked, chunks: Chunks, starts: Sequence[int], mark: str
    ) -> Iterator[tuple[int, bytes]]:
        """Check the chunks that begin at `starts`; gives each, encoded, when it is done, in any order.

        Faults are those of `_done`.
        """
        tasks = (
            _Task(start, f"cases {start} to {chunks.stop(start) - 1}", (mark, *asked.sent(chunks, start)))
            for start in starts
        )
        return self._done(checked, asked.question, tasks)

    def drawn(self, drawing: Drawing) -> Iterator[tuple[DrawsPiece, Tally]]:
        """Make all pieces of the draws; gives each when it is done, in any order. Faults are those of `_done`."""
        tasks = (
            _Task(piece, f"draws {piece.start} to {piece.stop - 1} of {printable(drawing.name)}", (piece,))
            for piece in drawing.pieces()
        )
        return self._done(tallied, drawing, tasks)

    def _done(
        self, function: Callable[..., Any], common: object, tasks: Iterable[_Task]
    ) -> Iterator[tuple[Any, Any]]:
        """Have workers call a function with what is common, the version, and the arguments of each task.

        Gives the name of each task, and what came of it.

        Raises
        ------
        ClusterError
            The scheduler went away, a task ended every worker that had it, or a worker cannot do it.
        RuntimeError
            The function raised; says what and where.
        """
        finished: SimpleQueue[Any] = SimpleQueue()
        # A task gives what is common, not the client: Dask makes it again where a worker that has it is lost.
        shared = self.client.submit(pickle.loads, pickle.dumps(common), pure=False)
        pending: dict[str, tuple[Any, _Task]] = {}
        left, next_look = iter(tasks), 0.0
        try:
            while True:
                if monotonic() >= next_look:
                    ahead, next_look = self._look(), monotonic() + _LOOK
                while len(pending) < ahead and (task := next(left, None)) is not None:
                    future = self.client.submit(function, shared, __version__, *task.arguments, pure=False)
                    pending[future.key] = future, task
                    future.add_done_callback(finished.put)
                if not pending:
                    return
                done = _taken(finished, max(next_look - monotonic(), 0.05))
                for future, data in zip(done, self._fetched(done, pending), strict=True):
                    yield pending.pop(future.key)[1].name, data
        finally:
            with suppress(Exception):
                self.client.cancel([shared, *(future for future, _ in pending.values())])

    def _look(self) -> int:
        """Chunks to give out at once; says it where nobody works."""
        with suppress(Exception):  # a scheduler that is gone: the chunks say so
            self.threads = self._threads()
        if not self.threads and not self._is_told:
            self.tell(f"{self.address} has no worker; waiting for one.")
        self._is_told = not self.threads
        return max(_LEAST_AHEAD, _AHEAD * self.threads)

    def _fetched(self, done: list[Any], pending: Mapping[str, tuple[Any, _Task]]) -> list[Any]:
        """Fetch what is done; Dask makes again what a worker took with it between done and fetched."""
        try:
            data: list[Any] = self.client.gather(done) if done else []
        except Exception as error:
            for future in done:
                if future.status in ("error", "cancelled"):
                    raise self._why(future, pending[future.key][1].about) from None
            raise self._gone() from error
        return data

    def _gone(self) -> ClusterError:
        return ClusterError(f"--scheduler {self.address}: went away")

    def _why(self, future: Any, about: str) -> Exception:
        from distributed.scheduler import KilledWorker

        if future.status == "cancelled":  # with the connection
            return self._gone()
        error = future.exception()
        if isinstance(error, UnlikeWorkerError):
            said = error.args[0]
            return ClusterError(self._unlike(*said) if isinstance(said, tuple) else f"{about}: {said}")
        if isinstance(error, KilledWorker):
            return ClusterError(
                f"{about} ended {error.allowed_failures + 1} workers, the last of them {error.last_worker.address}, "
                "as when memory runs out"
            )
        said = f"{about}, on a worker: {type(error).__name__}: {_first_line(error)}"
        if isinstance(error, ImportError | MemoryError):
            return ClusterError(said)
        return RuntimeError(said)


class UnlikeWorkerError(Exception):
    """A worker that is not like the one who asks: its address and version, or what it cannot do."""


def checked(question: Question, version: str, mark: str, start: int, stop: int, values: Mapping[str, Any]) -> bytes:
    """Check a chunk of cases on a worker."""
    here = _like(version)
    try:
        return encoded(part_of(question, start, stop, values), mark)
    except MissionError as error:
        raise UnlikeWorkerError(f"worker {here} cannot use the mission: {'; '.join(error.lines())}") from None


def tallied(drawing: Drawing, version: str, piece: DrawsPiece) -> Tally:
    """Make a piece of draws on a worker."""
    _like(version)
    return Drawer(drawing).tally(piece)


def _like(version: str) -> str:
    """Address of the worker; raises where it came after the others were asked, with another version."""
    from distributed import get_worker

    here: str = get_worker().address
    if version != __version__:
        raise UnlikeWorkerError((here, __version__))
    return here


def _taken(finished: "SimpleQueue[Any]", seconds: float) -> list[Any]:
    """What is finished; waits for the first of it."""
    done: list[Any] = []
    with suppress(Empty):
        done.append(finished.get(timeout=seconds))
        while True:
            done.append(finished.get_nowait())
    return done


def _first_line(error: BaseException) -> str:
    said = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return printable(said.partition("\n")[0])
