"""Check many mission files: the gate of a fleet is one call, and takes every core.

What is found about a mission is some hundred objects. A caller who only wants what a format makes of it says so, and
nothing else is kept, or sent from one process to another: that is a quarter of the time of a thousand missions.
"""

import gc
from collections.abc import Callable, Sequence
from datetime import date
from functools import partial
from typing import TYPE_CHECKING, NamedTuple, TypeVar

from bisar_budget.budget.check import check_missions
from bisar_budget.budget.waivers import NOTHING_OUTSIDE, Outside
from bisar_budget.faults import MissionError, SetValue
from bisar_budget.findings.mission import MissionFindings, UnusableMission
from bisar_budget.mission.load import load_mission
from bisar_budget.mission.model import Mission
from bisar_budget.resources import FILES_READ, cores

if TYPE_CHECKING:
    from bisar_budget.monte_carlo.draws import Share

Found = MissionFindings | UnusableMission
Kept = TypeVar("Kept")

AT_ONCE = 512  # files that are read before they are checked, those of one shape together
MANY = 200  # files from which a second process pays: starting one costs what checking fifty does


class Draws(NamedTuple):
    """Draws of a Monte Carlo that are asked for; as of `monte_carlo`, whose `share` is for one process."""

    number: int
    seed: int | None
    share: "Share | None" = None


def without_analysis(found: Found) -> Found:
    """Keep all that is found, but not the analysis: a thousand would fill memory."""
    return found if isinstance(found, UnusableMission) else found._replace(analysis=None)


def whole(found: Found) -> Found:
    """Keep everything, in one process: an analysis is larger than what it takes to make it again."""
    return found


def check_files(
    files: Sequence[str],
    today: date,
    model: str | None,
    keep: Callable[[Found], Kept],
    *,
    drawn: Draws | None = None,
    changes: Sequence[SetValue] = (),
    outside: Outside = NOTHING_OUTSIDE,
) -> list[Kept]:
    """Check files, in their order; many are shared out between the cores.

    Parameters
    ----------
    files : sequence of str
        Names of mission files; `-` is standard input.
    today : date
        Day on which waivers are judged, UTC.
    model : str or None
        Gating model in place of each file's own.
    keep : callable
        Makes of the findings about a file what is wanted of them, in the process that found them.
    drawn : Draws, optional
        Of a Monte Carlo; None: no draws.
    changes : sequence of SetValue
        Values in place of each file's.
    outside : Outside
        What else from outside the files bears on their verdicts.

    Returns
    -------
    list
        What `keep` made of each.
    """
    of = partial(_kept, today=today, model=model, keep=keep, drawn=drawn, changes=changes, outside=outside)
    count = cores()
    is_shared = drawn is not None and drawn.share is not None
    if len(files) < MANY or count == 1 or "-" in files or keep is whole or is_shared:
        return of(files)
    from bisar_budget.workers import worker_pool

    size = -(-len(files) // count)
    own, *others = (files[start : start + size] for start in range(0, len(files), size))
    with worker_pool(len(others)) as pool:
        waiting = [pool.submit(_with_files_read, part, of) for part in others]
        kept = of(own)
        for part in waiting:
            found, files_read = part.result()
            kept += found
            FILES_READ.update(files_read)
    return kept


def _with_files_read(
    files: Sequence[str], of: Callable[[Sequence[str]], list[Kept]]
) -> tuple[list[Kept], set[tuple[int, int]]]:
    return of(files), FILES_READ


def _kept(
    files: Sequence[str],
    today: date,
    model: str | None,
    keep: Callable[[Found], Kept],
    drawn: Draws | None,
    changes: Sequence[SetValue],
    outside: Outside,
) -> list[Kept]:
    # The findings of a thousand missions are 10⁵ tuples without a cycle: nothing to collect.
    gc.disable()
    kept: dict[int, Kept] = {}
    for start in range(0, len(files), AT_ONCE):
        missions: dict[int, Mission] = {}
        for place, file in enumerate(files[start : start + AT_ONCE], start):
            try:
                missions[place] = load_mission(file, model, changes)
            except MissionError as error:
                kept[place] = keep(UnusableMission(file=file, faults=error.faults, data=error.data))
        places = list(missions)
        for index, found in check_missions(list(missions.values()), today, outside=outside):
            if drawn is not None:
                from bisar_budget.monte_carlo.probability import monte_carlo

                found = found._replace(monte_carlo=monte_carlo(found.analysed(), *drawn))
            kept[places[index]] = keep(found)
    return [kept[place] for place in range(len(files))]
