"""Monte Carlo: draws of the declared errors, and how often each requirement is met with them."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from time import perf_counter
from typing import TYPE_CHECKING

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.budget.check import FILES_FOR_TWO_PROCESSES, Draws
from bisar_budget.faults import printable
from bisar_budget.mission.model import Mission
from bisar_budget.questions.progress import foreseen, foretell, watched, workers_of
from bisar_budget.questions.results import MonteCarloResult

if TYPE_CHECKING:
    from bisar_budget.cluster.scheduler import Workers
    from bisar_budget.sampling.draws import Drawing, DrawsPiece, Share, Tally

_MANY_DRAWS = 1_000_000  # for more draws the time is estimated beforehand
_TRIAL_DRAWS = 1 << 12  # number of draws in the first trial for this estimate


def monte_carlo(mission: Mission, draws: int = 20_000, *, seed: int | None = None) -> MonteCarloResult:
    """Draw the declared errors from their distributions, and count how often each requirement is met.

    Parameters
    ----------
    mission : Mission
        As in `check`.
    draws : int
        Number of draws.
    seed : int, optional
        Seed of the random numbers; by default `simulation.seed` of the mission file, or else 1. The same seed gives
        the same result.

    Raises
    ------
    ValueError
        The number of draws is too large or too small.
    """
    from bisar_budget.sampling.probability import monte_carlo as monte_carlo_of

    return MonteCarloResult(monte_carlo_of(Analysis(mission, is_complete=True), *drawn_here(draws, seed)))


def drawn_here(draws: int, seed: int | None) -> Draws:
    """Make the settings of a Monte Carlo simulation that runs in this process and shows a progress bar."""
    from bisar_budget.sampling.draws import in_turn

    return Draws(draws, seed, partial(_watched, in_turn, None))


@contextmanager
def drawn_by(
    scheduler: str | None, patience: int, draws: int | None, seed: int | None, files: int
) -> "Iterator[Draws | None]":
    """Context manager that yields the settings of a Monte Carlo simulation, or None if `draws` is None.

    `draws` is the number of draws, and `seed` is the seed of the random numbers. The workers of `scheduler` compute
    the draws; if it is None, this machine computes them. `patience` is the maximum time to wait for a worker of the
    scheduler [s]. `files` is the number of mission files of the command.
    """
    if draws is None:
        yield None
        return
    from bisar_budget.sampling.draws import shared_out

    with workers_of(scheduler, patience) as workers:
        if workers is not None:
            yield Draws(draws, seed, partial(_watched, partial(shared_out, mapped=workers.mapped), workers))
        else:  # processes that share files make their own draws
            yield Draws(draws, seed) if files >= FILES_FOR_TWO_PROCESSES else drawn_here(draws, seed)


def _watched(make: "Share", workers: "Workers | None", drawing: "Drawing") -> "Iterator[tuple[DrawsPiece, Tally]]":
    """Yield each batch of draws from `make` together with its tally, and show a progress bar.

    For more than a million draws, the time is estimated first, and the user is told if it is more than a minute.
    """
    from bisar_budget.sampling.draws import Drawer, DrawsPiece

    if drawing.draws > _MANY_DRAWS and drawing.judged:
        drawer = Drawer(drawing)

        def trial(count: int) -> float:
            began = perf_counter()
            drawer.tally(DrawsPiece(0, count))
            return perf_counter() - began

        seconds = foreseen(drawing.draws, trial, _TRIAL_DRAWS, min(drawing.chunk, drawing.draws))
        threads = max(workers.threads, 1) if workers else 1
        foretell(seconds / threads, f"{drawing.draws:,} draws of {printable(drawing.name)}")
    done = 0
    with watched("Drawing errors") as report_progress:
        for piece, tally in make(drawing):
            yield piece, tally
            done += piece.stop - piece.start
            report_progress(done, drawing.draws)
