"""Announcements and progress of work that takes long."""

import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from io import StringIO
from time import monotonic
from typing import TYPE_CHECKING

import click

from bisar_budget.cli.streams import complain
from bisar_budget.faults import printable

if TYPE_CHECKING:
    from bisar_budget.workers import Progress

LONG = 60.0  # s; what takes longer is announced
FORMING = "Forming images"  # label of a bar
_MOMENT = 1.0  # s
_TRIAL = 0.3  # s; a shorter one is too short to measure
_LARGER = 3  # times as much, the next trial


def lasting(seconds: float) -> str:
    """Say how long something takes."""
    for unit, size in (("years", 365.25 * 86400), ("days", 86400), ("hours", 3600), ("minutes", 60)):
        if seconds >= 2 * size:
            return f"{seconds / size:.0f} {unit}"
    return f"{max(seconds, 1):.0f} s"


def foretell(seconds: float, doing: str, advice: str = "") -> None:
    """Say on standard error that something will take long, and what to change."""
    if seconds > LONG:
        complain(f"{doing} will take about {lasting(seconds)}{'; ' if advice else ''}{advice}.")


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


@contextmanager
def watched(label: str, total: int = 1, done: int = 0) -> "Iterator[Progress]":
    """Give what takes how far long work is; a bar with the time left shows it, where somebody watches."""
    seen = sys.stderr is not None and sys.stderr.isatty()
    with click.progressbar(length=total, label=label, file=sys.stderr if seen else StringIO()) as bar:

        def progress(done: int, total: int) -> None:
            bar.length = total
            bar.update(done - bar.pos)

        progress(done, total)
        yield progress


@contextmanager
def watched_checks(name: str) -> "Iterator[Progress]":
    """Give what takes how many checks of a mission are done, and how many there will be.

    The second time it is told says how long all will take: the first imports what it needs. A bar shows them after a
    moment.
    """
    began = monotonic()
    with ExitStack() as ends:
        shown: list[Progress] = []
        since, calls, before = began, 0, 0

        def progress(done: int, total: int) -> None:
            nonlocal since, calls, before
            now, calls = monotonic(), calls + 1
            if calls == 2:
                doing = f"Checking {printable(name)} for {total} values or more"
                seconds = (now - since) / max(1, done - before) * total
                foretell(seconds, doing, "fewer declared errors and --model published take less")
            since, before = now, done
            if not shown:
                if now - began < _MOMENT:
                    return
                shown.append(ends.enter_context(watched("Checking values", total)))
            shown[0](done, total)

        yield progress
