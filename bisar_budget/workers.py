"""Tools for long computations: progress reports, and worker processes that end when the command ends."""

import os
import signal
import threading
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import active_children, get_context, parent_process
from multiprocessing.connection import wait
from typing import Protocol, TypeVar

from bisar_budget.faults import WorkerLostError

Progress = Callable[[int, int], None]  # receives the finished amount and the total amount

Common = TypeVar("Common")
Block = TypeVar("Block")
Result = TypeVar("Result")


class MapBlocks(Protocol):
    """Type of a function that distributes many blocks of work to worker processes.

    Such a function calls `function` with the common data and each block, and yields each block with its result, in
    any order. `about` returns a description of a block for messages.
    """

    def __call__(
        self,
        function: Callable[[Common, Block], Result],
        common: Common,
        blocks: Iterable[Block],
        about: Callable[[Block], str],
        /,
    ) -> Iterator[tuple[Block, Result]]:
        """Call `function` with the common data and each block, and yield each block with its result."""


_POOL_TIMEOUT_S = 10.0  # to wait for the pool's own thread, which ends as soon as its workers end


def unseen(done: int, total: int) -> None:
    """Ignore a progress report. This function is used if progress is not shown."""


@contextmanager
def worker_pool(count: int, start: str | None = None) -> Iterator[ProcessPoolExecutor]:
    """Context manager for a pool of processes, all of which have ended when the context is left.

    `start` is a start method of `multiprocessing`. With `spawn`, workers are fresh interpreters, whereas a fork would
    copy the threads of a numerical library in an undefined state. Raises a `WorkerLostError` if a worker is ended
    from outside, for example by the operating system when memory runs out.
    """
    worker_count = set(threading.enumerate())
    pool = ProcessPoolExecutor(count, mp_context=get_context(start), initializer=_begin)
    try:
        yield pool
    except BaseException as error:  # also for an interrupt or a signal: the remaining work is useless
        threading.excepthook = lambda _: None  # the pool's own thread may fail on workers that have ended
        pool.shutdown(wait=False, cancel_futures=True)
        for worker in active_children():
            worker.terminate()
        for thread in set(threading.enumerate()) - worker_count:
            if not thread.daemon:  # the pool's own: at its exit Python might write to the pipe that it is closing
                thread.join(_POOL_TIMEOUT_S)
        if isinstance(error, BrokenProcessPool):
            raise WorkerLostError("a worker process was ended from outside, as when memory runs out") from None
        raise
    pool.shutdown()


def in_processes(count: int) -> MapBlocks:
    """Return a `MapBlocks` function that uses `count` worker processes of this machine.

    The function yields results in the order of the blocks, and computes only a few blocks in advance.
    """

    def mapped(
        function: Callable[[Common, Block], Result],
        common: Common,
        blocks: Iterable[Block],
        about: Callable[[Block], str],
    ) -> Iterator[tuple[Block, Result]]:
        with worker_pool(count, "spawn") as pool:
            waiting: deque[tuple[Block, Future[Result]]] = deque()
            for block in blocks:
                waiting.append((block, pool.submit(function, common, block)))
                if len(waiting) > 3 * count:
                    first, future = waiting.popleft()
                    yield first, future.result()
            for remaining, future in waiting:
                yield remaining, future.result()

    return mapped


def _begin() -> None:
    """Set up a worker process: ignore interrupts, end with the parent process, and suppress warnings of libraries."""
    warnings.simplefilter("ignore")
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for name in ("SIGTERM", "SIGHUP"):  # a fork has the handlers of the command
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_DFL)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
