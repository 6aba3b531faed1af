"""Long work: how far it is, who shares it, and worker processes that end when the command does, whatever ends it."""

import os
import signal
import threading
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import active_children, get_context, parent_process
from multiprocessing.connection import wait
from typing import Any

from bisar_budget.faults import WorkerLostError

Progress = Callable[[int, int], None]  # is told how much is done, and how much there is in all

# Has others call a function with what is common and each block; gives each block with what came of it, in any order.
# The last argument says of a block what it is, for messages.
MapBlocks = Callable[[Callable[[Any, Any], Any], Any, Iterable[Any], Callable[[Any], str]], Iterator[tuple[Any, Any]]]

_PATIENCE = 10.0  # s for the pool's own thread, which ends as soon as its workers have


def unseen(done: int, total: int) -> None:
    """Progress that nobody looks at."""


@contextmanager
def worker_pool(count: int, start: str | None = None) -> Iterator[ProcessPoolExecutor]:
    """Give a pool of processes that leaves none behind.

    `start` is `spawn` for fresh interpreters: a fork would copy the threads of a numerical library half way. A
    `WorkerLostError` says that something ended a worker: the system does when memory runs out.
    """
    worker_count = set(threading.enumerate())
    pool = ProcessPoolExecutor(count, mp_context=get_context(start), initializer=_begin)
    try:
        yield pool
    except BaseException as error:  # an interrupt or a signal too: the work that is left serves nobody
        threading.excepthook = lambda _: None  # the pool's own thread may stumble over workers that are gone
        pool.shutdown(wait=False, cancel_futures=True)
        for worker in active_children():
            worker.terminate()
        for thread in set(threading.enumerate()) - worker_count:
            if not thread.daemon:  # the pool's own: at its exit Python might write to the pipe that it is closing
                thread.join(_PATIENCE)
        if isinstance(error, BrokenProcessPool):
            raise WorkerLostError("a worker process was ended from outside, as when memory runs out") from None
        raise
    pool.shutdown()


def in_processes(count: int) -> MapBlocks:
    """Processes of its own for blocks, which come in their order; none is far ahead of what has been asked for."""

    def mapped(
        function: Callable[[Any, Any], Any], common: Any, blocks: Iterable[Any], about: Callable[[Any], str]
    ) -> Iterator[tuple[Any, Any]]:
        with worker_pool(count, "spawn") as pool:
            waiting: deque[tuple[Any, Any]] = deque()
            for block in blocks:
                waiting.append((block, pool.submit(function, common, block)))
                if len(waiting) > 3 * count:
                    first, future = waiting.popleft()
                    yield first, future.result()
            for remaining, future in waiting:
                yield remaining, future.result()

    return mapped


def _begin() -> None:
    """Leave interrupts to the parent, end with it, and keep to oneself what a library warns of."""
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
