"""Work that takes long, and is shared with workers of a scheduler."""

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import partial
from time import perf_counter
from typing import TYPE_CHECKING

from bisar_budget.budget.check import MANY, Draws
from bisar_budget.faults import printable
from bisar_budget.front import progress
from bisar_budget.front.progress import watched
from bisar_budget.memory import OF_TABLES

if TYPE_CHECKING:
    from bisar_budget.cluster.scheduler import Workers
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


def drawn_here(draws: int, seed: int | None) -> Draws:
    """Draws that this process makes, seen by who waits."""
    from bisar_budget.sampling.draws import in_turn

    return Draws(draws, seed, partial(_watched, in_turn, None))


@contextmanager
def drawn_by(
    scheduler: str | None, patience: int, draws: int | None, seed: int | None, files: int
) -> "Iterator[Draws | None]":
    """Say who makes the draws of so many files, the workers of a scheduler at hand; None where none are asked for."""
    if draws is None:
        yield None
        return
    from bisar_budget.sampling.draws import shared_out

    with workers_of(scheduler, patience) as workers:
        if workers is not None:
            yield Draws(draws, seed, partial(_watched, partial(shared_out, mapped=workers.mapped), workers))
        else:  # files that processes share out draw for themselves
            yield Draws(draws, seed) if files >= MANY else drawn_here(draws, seed)


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
