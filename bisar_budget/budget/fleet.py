"""Check many mission files: the gate of a fleet is one call, and takes every core.

What is found about a mission is some hundred objects. A caller who only wants what a format makes of it says so, and
nothing else is kept, or sent from one process to another: that is a quarter of the time of a thousand missions.
"""

import gc
import math
from collections.abc import Callable, Sequence
from datetime import date
from functools import partial
from itertools import pairwise
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

MANY = 200  # files, of which half pay for a second process
AT_ONCE = 500  # files that are checked together at most


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
    chunks, count = _chunks(files), cores()
    is_shared = drawn is not None and drawn.share is not None
    if len(chunks) == 1 or count == 1 or "-" in files or keep is whole or is_shared:
        return [one for chunk in chunks for one in of(chunk)]
    from bisar_budget.workers import worker_pool

    own, *others = (chunks[start::count] for start in range(min(count, len(chunks))))
    kept: list[list[Kept]] = [[]] * len(chunks)
    with worker_pool(len(others)) as pool:
        waiting = [pool.submit(_with_files_read, part, of) for part in others]
        kept[::count] = [of(chunk) for chunk in own]
        for start, part in enumerate(waiting, 1):
            kept[start::count], files_read = part.result()
            FILES_READ.update(files_read)
    return [one for of_chunk in kept for one in of_chunk]


def _chunks(files: Sequence[str]) -> list[Sequence[str]]:
    """Files that are checked together: of many an even number of parts, whatever the number of cores.

    What is found of a mission differs, in its last digits, by what is checked together with it.
    """
    count = 1 if len(files) < MANY else 2 * math.ceil(len(files) / (2 * AT_ONCE))
    ends = [place * len(files) // count for place in range(count + 1)]
    return [files[start:stop] for start, stop in pairwise(ends)]


def _with_files_read(
    chunks: Sequence[Sequence[str]], of: Callable[[Sequence[str]], list[Kept]]
) -> tuple[list[list[Kept]], set[tuple[int, int]]]:
    return [of(chunk) for chunk in chunks], FILES_READ


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
    missions: dict[int, Mission] = {}
    for place, file in enumerate(files):
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
