"""Draws of a Monte Carlo on their way: who makes them, how long they take, how far they are."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from time import perf_counter
from typing import TYPE_CHECKING

import click

from bisar_budget.cli.keeping import workers_of
from bisar_budget.cli.streams import complain
from bisar_budget.cli.waiting import LONG, lasting, watched
from bisar_budget.constants import MAX_DRAWS, MAX_DRAWS_HERE
from bisar_budget.faults import printable

if TYPE_CHECKING:
    from bisar_budget.budget.fleet import Draws
    from bisar_budget.monte_carlo.draws import Drawing, DrawsPiece, Tally

_MANY = 1_000_000  # draws from which on it is measured how long they will take
_TRIAL = 0.3  # s; a shorter one is too short to measure
_FEW = 1 << 12  # draws of the first trial


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
    from bisar_budget.budget.fleet import MANY, Draws
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
