"""Time estimates, progress bars and scheduler workers for long computations."""

import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from contextvars import ContextVar
from importlib import import_module
from importlib.util import find_spec
from threading import RLock
from time import monotonic
from typing import TYPE_CHECKING

from bisar_budget.faults import printable
from bisar_budget.memory import TABLES_MEMORY_BYTES

if TYPE_CHECKING:
    from typing import NoReturn

    from tqdm import tqdm

    from bisar_budget.cluster.scheduler import Workers
    from bisar_budget.workers import Progress

MIN_ANNOUNCED_S = 60.0  # work that takes longer is announced
FORMING = "Forming images"  # label of a bar
_MIN_SHOWN_S = 1.0  # work that takes less time has no bar
_LEAST_TRIAL_S = 0.3  # a shorter trial is too short to measure
_TRIAL_GROWTH_FACTOR = 3  # ratio of the sizes of two successive trials


def _unheard(_: str) -> None:
    """Ignore a message; used in place of a function that shows it."""


# Function that shows a message to the user who waits; a caller from Python sees only the bar.
SAYING: ContextVar[Callable[[str], None]] = ContextVar("SAYING", default=_unheard)


def is_heard() -> bool:
    """Whether messages reach a user. If not, the duration of a computation need not be estimated."""
    return SAYING.get() is not _unheard


@contextmanager
def watched(label: str) -> "Iterator[Progress]":
    """Yield a function that shows the progress of a long computation as a bar with the remaining time.

    The caller passes the number of finished items and the number of all items to the function. The bar appears only
    in a notebook or a terminal, and only if the computation takes longer than a second. `label` names the work.
    """
    began, bars = monotonic(), list["tqdm[NoReturn]"]()

    def progress(done: int, total: int) -> None:
        if not bars:
            is_notebook = _is_notebook()
            is_seen = is_notebook or (sys.stderr is not None and sys.stderr.isatty())
            if not is_seen or monotonic() - began < _MIN_SHOWN_S:
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
    """Whether a Jupyter kernel runs this process; it is not sufficient that Jupyter modules are imported."""
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    return hasattr(shell, "kernel")


def _bar(label: str, total: int, is_notebook: bool) -> "tqdm[NoReturn]":
    """Make a tqdm progress bar, for a notebook or a terminal."""
    has_widgets = is_notebook and find_spec("ipywidgets") is not None
    kind = import_module("tqdm.notebook").tqdm_notebook if has_widgets else import_module("tqdm").tqdm
    # The monitor thread of tqdm, and its lock between processes, would not survive a fork. The class is our own, so
    # that bars of the caller keep theirs.
    bar_class = type("Bar", (kind,), {"monitor_interval": 0, "_lock": RLock()})
    return bar_class(total=total, desc=label, leave=not is_notebook, **({} if has_widgets else {"file": sys.stderr}))


@contextmanager
def watched_checks(name: str) -> "Iterator[Progress]":
    """Yield a function that shows the progress of many checks of one mission as a bar.

    The caller passes the number of finished checks and the expected number of checks to the function. The total time
    is estimated at the second call, because the first check also imports modules. `name` is the name of the mission.
    """
    since, calls, before = monotonic(), 0, 0
    with watched("Checking values") as show_progress:

        def progress(done: int, total: int) -> None:
            nonlocal since, calls, before
            now, calls = monotonic(), calls + 1
            if calls == 2:
                doing = f"Checking {printable(name)} for {total} values or more"
                seconds = (now - since) / max(1, done - before) * total
                foretell(seconds, doing, "fewer declared errors and --model published take less")
            since, before = now, done
            show_progress(done, total)

        yield progress


def lasting(seconds: float) -> str:
    """Format a duration in seconds with a suitable unit, such as `3 minutes`."""
    for unit, size in (("years", 365.25 * 86400), ("days", 86400), ("hours", 3600), ("minutes", 60)):
        if seconds >= 2 * size:
            return f"{seconds / size:.0f} {unit}"
    return f"{max(seconds, 1):.0f} s"


def foretell(seconds: float, doing: str, advice: str = "") -> None:
    """Tell the user how long a computation will take, if this is more than a minute.

    `seconds` is the estimated time, `doing` names the computation, and `advice` tells how to speed it up.
    """
    if seconds > MIN_ANNOUNCED_S:
        SAYING.get()(f"{doing} will take about {lasting(seconds)}{'; ' if advice else ''}{advice}.")


def foreseen(count: int, trial: Callable[[int], float], few: int, most: int) -> float:
    """Estimate, from trials with fewer items, the time to process `count` items. [s]

    `trial` processes the given number of items, and returns the elapsed time [s]. The number of items increases from
    trial to trial, from `few` up to about `most`, until a trial takes long enough to be measured.
    """
    trial(few)  # imports modules and fills caches
    tried, seconds = few, trial(few)
    while True:
        before, tried = seconds, _TRIAL_GROWTH_FACTOR * tried
        seconds = trial(tried)
        if seconds > _LEAST_TRIAL_S or _TRIAL_GROWTH_FACTOR * tried > most:
            break
    # The increment between trials leaves out the fixed time of a trial.
    return count * max((seconds - before) / (tried - tried / _TRIAL_GROWTH_FACTOR), seconds / tried / 10)


# ---------------------------------------------------------------------- workers
def workers_of(scheduler: str | None, patience: int) -> "AbstractContextManager[Workers | None]":
    """Context manager that connects to a Dask scheduler, and yields its workers; None if `scheduler` is None.

    `scheduler` is the address of the scheduler. `patience` [s] is the longest time to wait for a worker.
    """
    if scheduler is None:
        return nullcontext()
    from bisar_budget.cluster.scheduler import connected

    return connected(scheduler, patience, SAYING.get())


def hold_to_tables() -> None:
    """Raise an error if a library that `--resume` needs is missing.

    The library stores the checked parts of a sweep in files.
    """
    from bisar_budget.cluster.parts_folder import check_libraries

    check_libraries("--resume", TABLES_MEMORY_BYTES, "tables", "pyarrow")
