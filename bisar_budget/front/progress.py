"""How long work will take, who shares it, and how far it is: a bar in a notebook or a terminal, nothing elsewhere."""

import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from contextvars import ContextVar
from importlib import import_module
from importlib.util import find_spec
from threading import RLock
from time import monotonic
from typing import TYPE_CHECKING, Any

from bisar_budget.faults import printable
from bisar_budget.memory import OF_TABLES

if TYPE_CHECKING:
    from bisar_budget.cluster.scheduler import Workers
    from bisar_budget.workers import Progress

LONG = 60.0  # s; what takes longer is announced
FORMING = "Forming images"  # label of a bar
_MOMENT = 1.0  # s; what is done before has no bar
_TRIAL = 0.3  # s; a shorter one is too short to measure
_LARGER = 3  # times as much, the next trial

# Takes what somebody who waits is to know; a caller from Python sees the bar alone.
SAYING: ContextVar[Callable[[str], None]] = ContextVar("SAYING", default=lambda _: None)


@contextmanager
def watched(label: str) -> "Iterator[Progress]":
    """Give what takes how far long work is; a bar with the time left shows it, where somebody watches."""
    began, bars = monotonic(), list[Any]()

    def progress(done: int, total: int) -> None:
        if not bars:
            is_notebook = _is_notebook()
            is_seen = is_notebook or (sys.stderr is not None and sys.stderr.isatty())
            if not is_seen or monotonic() - began < _MOMENT:
                return
            bars.append(_bar(label, total, is_notebook))
        bars[0].total = total
        bars[0].update(done - bars[0].n)

    try:
        yield progress
    finally:
        for bar in bars:
            bar.close()


def _is_notebook() -> bool:
    """Whether a kernel of Jupyter runs this; that its modules are there is not enough."""
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    return hasattr(shell, "kernel")


def _bar(label: str, total: int, is_notebook: bool) -> Any:
    has_widgets = is_notebook and find_spec("ipywidgets") is not None
    kind = import_module("tqdm.notebook").tqdm_notebook if has_widgets else import_module("tqdm").tqdm
    # A thread that looks after bars, and a lock between processes, would outlive what forks here. Bars of the caller
    # keep theirs.
    own = type("Bar", (kind,), {"monitor_interval": 0, "_lock": RLock()})
    return own(total=total, desc=label, leave=not is_notebook, **({} if has_widgets else {"file": sys.stderr}))


@contextmanager
def watched_checks(name: str) -> "Iterator[Progress]":
    """Give what takes how many checks of a mission are done, and how many there will be.

    The second time it is told says how long all will take: the first imports what it needs.
    """
    since, calls, before = monotonic(), 0, 0
    with watched("Checking values") as shown:

        def progress(done: int, total: int) -> None:
            nonlocal since, calls, before
            now, calls = monotonic(), calls + 1
            if calls == 2:
                doing = f"Checking {printable(name)} for {total} values or more"
                seconds = (now - since) / max(1, done - before) * total
                foretell(seconds, doing, "fewer declared errors and --model published take less")
            since, before = now, done
            shown(done, total)

        yield progress


def lasting(seconds: float) -> str:
    """Say how long something takes."""
    for unit, size in (("years", 365.25 * 86400), ("days", 86400), ("hours", 3600), ("minutes", 60)):
        if seconds >= 2 * size:
            return f"{seconds / size:.0f} {unit}"
    return f"{max(seconds, 1):.0f} s"


def foretell(seconds: float, doing: str, advice: str = "") -> None:
    """Say to who waits that something will take long, and what to change."""
    if seconds > LONG:
        SAYING.get()(f"{doing} will take about {lasting(seconds)}{'; ' if advice else ''}{advice}.")


def foreseen(count: int, trial: Callable[[int], float], few: int, most: int) -> float:
    """How long so many of something will take, by trials of `few` to `most`, which say how long they took. [s]"""
    trial(few)  # it imports and makes what the others find
    tried, seconds = few, trial(few)
    while True:
        before, tried = seconds, _LARGER * tried
        seconds = trial(tried)
        if seconds > _TRIAL or _LARGER * tried > most:
            break
    # Few take their time too, but not once more for each part of them all.
    return count * max((seconds - before) / (tried - tried / _LARGER), seconds / tried / 10)


# ---------------------------------------------------------------------- who shares it
def workers_of(scheduler: str | None, patience: int) -> "AbstractContextManager[Workers | None]":
    """Give the workers of a scheduler, None where none is named; `patience` is how long it may have no worker. [s]"""
    if scheduler is None:
        return nullcontext()
    from bisar_budget.cluster.scheduler import connected

    return connected(scheduler, patience, SAYING.get())


def hold_to_tables() -> None:
    """Refuse to keep parts without the libraries that write them."""
    from bisar_budget.cluster.parts_folder import check_libraries

    check_libraries("--resume", OF_TABLES, "tables", "pyarrow")
