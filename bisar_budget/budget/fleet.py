"""Check many mission files: the gate of a fleet is one call, and takes every core."""

import gc
import os
from collections.abc import Sequence
from datetime import date

from bisar_budget.budget.check import check_mission
from bisar_budget.budget.findings import MissionFindings, UnusableMission
from bisar_budget.errors import MissionError
from bisar_budget.mission.load import load_mission

MANY = 200  # files from which a second process pays: starting one costs what checking fifty does


def check_files(
    files: Sequence[str], today: date, model: str | None = None
) -> list[MissionFindings | UnusableMission]:
    """Check files, in their order; many are shared out between the cores.

    Parameters
    ----------
    files : sequence of str
        Names of mission files; `-` is standard input.
    today : date
        Day on which waivers are judged, UTC.
    model : str, optional
        Gating model in place of each file's own.

    Returns
    -------
    list of MissionFindings or UnusableMission
        Without their missions: a thousand would fill memory.
    """
    cores = _cores()
    if len(files) < MANY or cores == 1 or "-" in files:
        return _checked(files, today, model)
    from concurrent.futures import ProcessPoolExecutor

    size = -(-len(files) // cores)
    own, *others = (files[start : start + size] for start in range(0, len(files), size))
    with ProcessPoolExecutor(len(others)) as pool:
        waiting = [pool.submit(_checked, part, today, model) for part in others]
        found = _checked(own, today, model)
        for part in waiting:
            found += part.result()
    return found


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _checked(files: Sequence[str], today: date, model: str | None) -> list[MissionFindings | UnusableMission]:
    # The findings of a thousand missions are 10⁵ tuples without a cycle: nothing to collect.
    gc.disable()
    found: list[MissionFindings | UnusableMission] = []
    for file in files:
        try:
            found.append(check_mission(load_mission(file, model), today)._replace(mission=None))
        except MissionError as error:
            found.append(UnusableMission(file=file, faults=error.faults, data=error.data))
    return found
