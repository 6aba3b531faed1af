"""Work that others do, or that is kept: workers of a scheduler, the parts of a sweep, the draws of a Monte Carlo."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from functools import partial
from time import perf_counter
from typing import TYPE_CHECKING

import click

from bisar_budget.cli.streams import complain
from bisar_budget.cli.waiting import LONG, lasting, watched
from bisar_budget.constants import MAX_DRAWS, MAX_DRAWS_HERE
from bisar_budget.faults import printable

if TYPE_CHECKING:
    from bisar_budget.budget.check import Draws
    from bisar_budget.cluster.scheduler import Workers
    from bisar_budget.design.sweep import Asked
    from bisar_budget.design.table import Swept
    from bisar_budget.monte_carlo.draws import Drawing, DrawsPiece, Tally

_MANY = 1_000_000  # draws from which on it is measured how long they will take
_TRIAL = 0.3  # s; a shorter one is too short to measure
_FEW = 1 << 12  # draws of the first trial


@dataclass(frozen=True)
class Keeping:
    """How the parts of a sweep are kept, beside its output; workers of a scheduler find them, or processes here."""

    output: str
    is_resumed: bool
    jobs: int
    workers: "Workers | None" = None

    @contextmanager
    def swept(self, asked: "Asked") -> "Iterator[Swept]":
        """Give the sweep when all its parts are kept, and take them away when the table is written.

        What ends it before leaves the parts, and says how to go on.
        """
        from bisar_budget.cluster.parts_folder import parts_folder, question_of

        chunks, count = asked.chunks(), asked.cases.count
        question = question_of(asked, chunks)
        with parts_folder(f"{self.output}.parts", question, chunks, is_resumed=self.is_resumed) as folder:

            def kept() -> str:
                return f"{len(folder.done)} of {len(chunks.starts)} parts"

            try:
                if folder.done:
                    complain(f"{folder.path} has {kept()}.")
                left = [start for start in chunks.starts if start not in folder.done]
                done = sum(chunks.stop(start) - start for start in folder.done)
                with watched("Checking cases", count, done) as progress:
                    mapped = self.workers.mapped if self.workers else None
                    for part in asked.shared_out(chunks, left, self.jobs, mapped):
                        folder.put(part)
                        done += part.stop - part.start
                        progress(done, count)
                yield asked.swept(folder.parts(chunks.starts))
            except BaseException:
                dated = f" --date {question['--date was']}" if question["--date was"] else ""
                complain(f"{folder.path} keeps {kept()}; the same command with --resume{dated} goes on from there.")
                raise
            folder.remove()


@contextmanager
def keeping(
    output: str | None, scheduler: str | None, patience: int, is_resumed: bool, jobs: int
) -> Iterator[Keeping | None]:
    """Say how parts are kept, with the workers of a scheduler at hand; None where nobody asks for that."""
    if scheduler is None and not is_resumed:
        yield None
        return
    if output is None or output == "-":
        raise click.UsageError("--scheduler and --resume need -o FILE: parts are kept in FILE.parts.")
    if scheduler is None:
        from bisar_budget.cluster.parts_folder import check_libraries
        from bisar_budget.memory import OF_TABLES

        check_libraries("--resume", OF_TABLES, "tables", "pyarrow")
    with workers_of(scheduler, patience) as workers:
        yield Keeping(output, is_resumed, jobs, workers)


def workers_of(scheduler: str | None, patience: int) -> "AbstractContextManager[Workers | None]":
    """Give the workers of a scheduler, None where none is named."""
    if scheduler is None:
        return nullcontext()
    from bisar_budget.cluster.scheduler import connected

    return connected(scheduler, patience, complain)


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
    from bisar_budget.monte_carlo.draws import in_turn, shared_out

    with workers_of(scheduler, patience) as workers:
        if workers is not None:
            share = partial(shared_out, mapped=workers.mapped)
            yield Draws(draws, seed, _Watched(share, lambda: workers.threads))
        else:  # files that processes share out draw for themselves
            yield Draws(draws, seed, None if files >= MANY else _Watched(in_turn, lambda: 1))


class _Watched:
    """Passes on the pieces of draws that `make` gives; says how long they will take, and how far they are."""

    def __init__(
        self, make: "Callable[[Drawing], Iterator[tuple[DrawsPiece, Tally]]]", threads: Callable[[], int]
    ) -> None:
        self._make, self._threads = make, threads

    def __call__(self, drawing: "Drawing") -> "Iterator[tuple[DrawsPiece, Tally]]":
        if drawing.draws > _MANY and drawing.judged:
            seconds = _seconds(drawing) / max(self._threads(), 1)
            if seconds > LONG:
                complain(f"{drawing.draws:,} draws of {printable(drawing.name)} will take about {lasting(seconds)}.")
        done = 0
        with watched("Drawing errors", drawing.draws) as progress:
            for piece, tally in self._make(drawing):
                yield piece, tally
                done += piece.stop - piece.start
                progress(done, drawing.draws)


def _seconds(drawing: "Drawing") -> float:
    """Measure how long all draws will take in one thread, by some of them."""
    from bisar_budget.monte_carlo.draws import Drawer, DrawsPiece

    drawer, tried = Drawer(drawing), _FEW
    drawer.tally(DrawsPiece(0, tried))  # it makes what the others find
    while True:
        began = perf_counter()
        drawer.tally(DrawsPiece(0, tried))
        seconds = perf_counter() - began
        if seconds > _TRIAL or tried >= min(drawing.chunk, drawing.draws):
            return seconds * drawing.draws / tried
        tried *= 4
