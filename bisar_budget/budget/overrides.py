"""Influences from outside a mission file on its verdict: options, settings, the environment, parts of a project."""

import os
from collections.abc import Iterator
from datetime import date
from typing import NamedTuple

from bisar_budget.faults import printable
from bisar_budget.findings.requirement import Override
from bisar_budget.mission.model import Mission
from bisar_budget.resources import resource


class Outside(NamedTuple):
    """Influences on all missions of a run: options that somebody gave, and where the day of waivers comes from."""

    options: tuple[Override, ...] = ()
    day_origin: str = "the caller"
    is_day_given: bool = False  # by the option --date, which is said even where no waiver stands


NOTHING_OUTSIDE = Outside()


def overrides(mission: Mission, outside: Outside, today: date) -> tuple[Override, ...]:
    """Gather what from outside the file bears on the verdict of one mission.

    Parameters
    ----------
    mission : Mission
        As loaded, with the options that changed it and the parts that it takes figures from.
    outside : Outside
        Of the run.
    today : date
        Day on which waivers are judged, UTC. It bears on the verdict where the file has a waiver.
    """
    found = list(outside.options)
    if mission.waivers or outside.is_day_given:
        found.append(Override("--date", today.isoformat(), outside.day_origin))
    found += [Override("--set", f"{change.key}={change.text}", "command line") for change in mission.changes]
    return (*found, *_own_parts(mission))


def _own_parts(mission: Mission) -> Iterator[Override]:
    """Parts of the project that stand in for those of the catalogue with the same name."""
    catalogue = str(resource("specs", "sensors")) if mission.parts else ""
    for name, file, _ in mission.parts:
        if name.endswith((".yaml", ".yml")) or os.path.dirname(file) == catalogue:
            continue
        if any(os.path.exists(os.path.join(catalogue, name + suffix)) for suffix in (".yaml", ".yml")):
            yield Override(
                f"part {printable(name)}", _shown(file, mission.file), "the project's, in place of the catalogue's"
            )


def _shown(file: str, mission_file: str) -> str:
    """Path of a file from the folder of the mission file, the same wherever the command runs."""
    try:
        path = os.path.relpath(file, os.path.dirname(mission_file) or os.curdir)
    except (OSError, ValueError):  # the current folder is gone; another drive
        path = file
    return printable(path.replace(os.sep, "/"))
