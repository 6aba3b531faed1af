"""Work that takes long: announced, shown, shared with workers of a scheduler, and kept in parts to go on from."""

import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext, suppress
from functools import partial
from io import StringIO
from time import monotonic, perf_counter
from typing import TYPE_CHECKING

import click

from bisar_budget.cli.streams import complain
from bisar_budget.constants import MAX_DRAWS, MAX_DRAWS_HERE
from bisar_budget.faults import ClusterError, printable

if TYPE_CHECKING:
    from bisar_budget.budget.check import Draws
    from bisar_budget.cluster.scheduler import Workers
    from bisar_budget.design.sweep import Asked
    from bisar_budget.design.table import Swept
    from bisar_budget.sampling.draws import Drawing, DrawsPiece, Share, Tally
    from bisar_budget.workers import Progress

LONG = 60.0  # s; what takes longer is announced
FORMING = "Forming images"  # label of a bar
_MOMENT = 1.0  # s
_TRIAL = 0.3  # s; a shorter one is too short to measure
_LARGER = 3  # times as much, the next trial
_MANY = 1_000_000  # draws from which on it is measured how long they will take
_FEW = 1 << 12  # draws of the first trial


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


# ---------------------------------------------------------------- shared or kept
def workers_of(scheduler: str | None, patience: int) -> "AbstractContextManager[Workers | None]":
    """Give the workers of a scheduler, None where none is named."""
    if scheduler is None:
        return nullcontext()
    from bisar_budget.cluster.scheduler import connected

    return connected(scheduler, patience, complain)


@contextmanager
def kept(asked: "Asked", output: str, jobs: int, workers: "Workers | None", *, is_resumed: bool) -> "Iterator[Swept]":
    """Give a sweep when all its parts are kept beside its output, and take them away when the table is written.

    Workers of a scheduler find them, or processes here. What ends it before leaves the parts, and says how to go on.
    """
    from bisar_budget.cluster.parts_folder import parts_folder, question_of

    chunks, count = asked.chunks(), asked.cases.count
    question = question_of(asked, chunks)
    with parts_folder(f"{output}.parts", question, chunks, is_resumed=is_resumed) as folder:

        def said() -> str:
            return f"{len(folder.done)} of {len(chunks.starts)} parts"

        try:
            if folder.done:
                complain(f"{folder.path} has {said()}.")
            left = [start for start in chunks.starts if start not in folder.done]
            done = sum(chunks.stop(start) - start for start in folder.done)
            with watched("Checking cases", count, done) as progress:
                for part in asked.shared_out(chunks, left, jobs, workers.mapped if workers else None):
                    folder.put(part)
                    done += part.stop - part.start
                    progress(done, count)
            yield asked.swept(folder.parts(chunks.starts))
        except BaseException:
            with suppress(ClusterError, OSError):
                folder.find(chunks, True)  # Ctrl-C may come between a part's rename and its note
            dated = f" --date {question['--date was']}" if question["--date was"] else ""
            complain(f"{folder.path} keeps {said()}; the same command with --resume{dated} goes on from there.")
            raise
        folder.remove()


def check_draws(draws: int | None, scheduler: str | None) -> None:
    """Refuse a scheduler that has nothing to draw, and more draws than are made without one."""
    if scheduler is None:
        if draws is not None and draws > MAX_DRAWS_HERE:
            raise click.UsageError(
                f"--monte-carlo {draws:,}: must be at most {MAX_DRAWS_HERE:,} draws; with --scheduler ADDRESS, whose "
                f"workers share them, {MAX_DRAWS:,}."
            )
    elif draws is None:
        raise click.UsageError(f"--scheduler {scheduler}: shares out draws, and needs --monte-carlo N.")


@contextmanager
def drawn_by(
    scheduler: str | None, patience: int, draws: int | None, seed: int | None, files: int
) -> "Iterator[Draws | None]":
    """Say who makes the draws of so many files, the workers of a scheduler at hand; None where none are asked for."""
    if draws is None:
        yield None
        return
    from bisar_budget.budget.check import MANY, Draws
    from bisar_budget.sampling.draws import in_turn, shared_out

    with workers_of(scheduler, patience) as workers:
        if workers is not None:
            yield Draws(draws, seed, partial(_watched, partial(shared_out, mapped=workers.mapped), workers))
        else:  # files that processes share out draw for themselves
            yield Draws(draws, seed, None if files >= MANY else partial(_watched, in_turn, None))


def _watched(make: "Share", workers: "Workers | None", drawing: "Drawing") -> "Iterator[tuple[DrawsPiece, Tally]]":
    """Pass on the pieces of draws that `make` gives; say how long they will take, and how far they are."""
    from bisar_budget.sampling.draws import Drawer, DrawsPiece

    if drawing.draws > _MANY and drawing.judged:
        drawer = Drawer(drawing)

        def trial(count: int) -> float:
            began = perf_counter()
            drawer.tally(DrawsPiece(0, count))
            return perf_counter() - began

        seconds = foreseen(drawing.draws, trial, _FEW, min(drawing.chunk, drawing.draws))
        threads = max(workers.threads, 1) if workers else 1
        foretell(seconds / threads, f"{drawing.draws:,} draws of {printable(drawing.name)}")
    done = 0
    with watched("Drawing errors", drawing.draws) as progress:
        for piece, tally in make(drawing):
            yield piece, tally
            done += piece.stop - piece.start
            progress(done, drawing.draws)
