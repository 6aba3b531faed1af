"""Work that takes long: shared with workers of a scheduler, and kept in parts to go on from."""

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from functools import partial
from time import perf_counter
from typing import TYPE_CHECKING

from bisar_budget.budget.check import MANY, Draws
from bisar_budget.faults import ClusterError, printable
from bisar_budget.front import progress
from bisar_budget.front.progress import watched
from bisar_budget.memory import OF_TABLES

if TYPE_CHECKING:
    from bisar_budget.cluster.scheduler import Workers
    from bisar_budget.design.sweep import Asked
    from bisar_budget.design.table import Swept
    from bisar_budget.sampling.draws import Drawing, DrawsPiece, Share, Tally

_MANY = 1_000_000  # draws from which on it is measured how long they will take
_FEW = 1 << 12  # draws of the first trial


def workers_of(scheduler: str | None, patience: int) -> "AbstractContextManager[Workers | None]":
    """Give the workers of a scheduler, None where none is named.

    Parameters
    ----------
    scheduler : str or None
        `tcp://HOST:PORT`, or `local:N` for N processes here.
    patience : int
        How long it may have no worker before it is given up. [s]
    """
    if scheduler is None:
        return nullcontext()
    from bisar_budget.cluster.scheduler import connected

    return connected(scheduler, patience, progress.SAYING.get())


def hold_to_tables(option: str) -> None:
    """Refuse an option that keeps parts without the libraries that write them."""
    from bisar_budget.cluster.parts_folder import check_libraries

    check_libraries(option, OF_TABLES, "tables", "pyarrow")


@contextmanager
def kept(asked: "Asked", output: str, jobs: int, workers: "Workers | None", *, is_resumed: bool) -> "Iterator[Swept]":
    """Give a sweep when all its parts are kept beside its output, and take them away when the table is written.

    Workers of a scheduler find them, or processes here. What ends it before leaves the parts, and says how to go on.
    """
    from bisar_budget.cluster.parts_folder import parts_folder, question_of

    chunks, count, say = asked.chunks(), asked.cases.count, progress.SAYING.get()
    question = question_of(asked, chunks)
    with parts_folder(f"{output}.parts", question, chunks, is_resumed=is_resumed) as folder:

        def said() -> str:
            return f"{len(folder.done)} of {len(chunks.starts)} parts"

        try:
            if folder.done:
                say(f"{folder.path} has {said()}.")
            left = [start for start in chunks.starts if start not in folder.done]
            done = sum(chunks.stop(start) - start for start in folder.done)
            with watched("Checking cases") as told:
                for part in asked.shared_out(chunks, left, jobs, workers.mapped if workers else None):
                    folder.put(part)
                    done += part.stop - part.start
                    told(done, count)
            yield asked.swept(folder.parts(chunks.starts))
        except BaseException:
            with suppress(ClusterError, OSError):
                folder.find(chunks, True)  # Ctrl-C may come between a part's rename and its note
            dated = f" --date {question['--date was']}" if question["--date was"] else ""
            say(f"{folder.path} keeps {said()}; the same command with --resume{dated} goes on from there.")
            raise
        folder.remove()


@contextmanager
def drawn_by(
    scheduler: str | None, patience: int, draws: int | None, seed: int | None, files: int = 1
) -> "Iterator[Draws | None]":
    """Say who makes the draws of so many files, the workers of a scheduler at hand; None where none are asked for."""
    if draws is None:
        yield None
        return
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

        seconds = progress.foreseen(drawing.draws, trial, _FEW, min(drawing.chunk, drawing.draws))
        threads = max(workers.threads, 1) if workers else 1
        progress.foretell(seconds / threads, f"{drawing.draws:,} draws of {printable(drawing.name)}")
    done = 0
    with watched("Drawing errors") as told:
        for piece, tally in make(drawing):
            yield piece, tally
            done += piece.stop - piece.start
            told(done, drawing.draws)
