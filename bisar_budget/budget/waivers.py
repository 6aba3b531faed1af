"""Application of waivers to rows and requirements, and list of outside influences on the verdict.

Valid, expired and unused waivers are listed in the findings. The options, settings, environment variables and project
catalogue parts that affect the verdict from outside the mission file are listed too.
"""

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from datetime import date
from fnmatch import translate
from typing import NamedTuple

from bisar_budget import phrases
from bisar_budget.budget.declarations import shifted_figures
from bisar_budget.budget.judged_requirements import REQUIREMENT_KEYS
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.faults import KeyPath, printable
from bisar_budget.findings.requirement import JudgedRequirement, Outside, Override
from bisar_budget.findings.row import DECLARE, AppliedWaiver, Row
from bisar_budget.findings.status import BROKEN
from bisar_budget.mission.model import Mission
from bisar_budget.phrases import Note
from bisar_budget.resources import resource

_PLANNED = "the orbit is the plan: neither its age nor its interpolation counts"


class Waived(NamedTuple):
    """Rows after waivers are applied, and the valid waivers of requirements.

    A row that fails or is not evaluated becomes `waived` if a valid waiver names it. A row for which all waivers have
    expired keeps its status and shows the waiver that expired last. `requirements` maps the id of each requirement to
    its first valid waiver.
    """

    mission: Mission
    rows: list[Row]
    requirements: Mapping[str, tuple[AppliedWaiver, ...]]
    covered: Sequence[tuple[int, int]]  # per waiver: number of named rows, and number of broken rows among them

    def unused(self, judged: Sequence[JudgedRequirement]) -> Iterator[tuple[KeyPath, Note]]:
        """Yield a warning for each waiver that has no effect, and for each waiver that covers every row.

        A waiver has an effect if at least one of the rows or requirements that it names is broken. A row is broken if
        it fails or is not evaluated.
        """
        broken = {requirement.id for requirement in judged if requirement.status in (*BROKEN, "waived")}
        ids = [requirement.id for requirement in judged]
        for index, (waiver, (named, failing)) in enumerate(zip(self.mission.waivers, self.covered, strict=True)):
            key = ("waivers", index, "id")
            requirements = [ids[requirement_index] for requirement_index in named_by(waiver.id, ids)]
            if not named and not requirements:
                yield key, phrases.note("waiver-matches-nothing", row_id=waiver.id)
            elif named == len(self.rows):
                yield key, phrases.note("waiver-matches-everything", row_id=waiver.id)
            elif not failing and broken.isdisjoint(requirements):
                yield key, phrases.note("waiver-not-used", row_id=waiver.id)


def apply_waivers(rows: Sequence[Row], mission: Mission, today: date) -> Waived:
    """Apply each valid waiver to the rows that it names, if they fail or are not evaluated.

    Parameters
    ----------
    rows : sequence of Row
        Judged rows.
    mission : Mission
        Mission with the waivers.
    today : date
        Current day (UTC). A waiver is valid through its last day.
    """
    ids = [row.id for row in rows]
    broken = {position for position, row in enumerate(rows) if row.status in BROKEN}
    requirements = [f"mission.{key}" for key in REQUIREMENT_KEYS]
    missing = [n for n, row in enumerate(rows) if row.is_of_declare and row.status == "not_evaluated"]
    # A row shows only its first valid and its last expired waiver, because a thousand waivers would fill a report.
    holding: dict[int, AppliedWaiver] = {}
    of_requirements: dict[str, tuple[AppliedWaiver, ...]] = {}
    over: list[tuple[AppliedWaiver, set[int]]] = []
    covered = []
    for index, waiver in enumerate(mission.waivers):
        line = mission.line(("waivers", index, "id"))
        named = named_by(waiver.id, ids)
        if any(rows[position].metric == DECLARE for position in named):  # the waiver covers all missing declarations
            named = sorted({*named, *missing})
        failing = broken.intersection(named)
        covered.append((len(named), len(failing)))
        applied = AppliedWaiver(line, waiver.until, waiver.reason, today > waiver.until, waiver.id, index)
        if applied.is_expired:
            over.append((applied, failing))
            continue
        holding = dict.fromkeys(failing, applied) | holding
        for requirement_index in named_by(waiver.id, requirements):
            of_requirements.setdefault(requirements[requirement_index], (applied,))
    last: dict[int, AppliedWaiver] = {}
    for applied, failing in sorted(over, key=lambda expired: expired[0].until):
        last |= dict.fromkeys(failing, applied)
    waived = [_waived(row, holding.get(position), last.get(position)) for position, row in enumerate(rows)]
    return Waived(mission, waived, of_requirements, covered)


def _waived(row: Row, holding: AppliedWaiver | None, last: AppliedWaiver | None) -> Row:
    applied = [waiver for waiver in (holding, last) if waiver is not None]
    status = row.status if holding is None else "waived"
    return row._replace(status=status, waivers=(*row.waivers, *applied)) if applied else row


def holding_place(mission: Mission, today: date, ids: Sequence[str]) -> int:
    """Index, in the mission file, of the first valid waiver that names one of the ids; -1 if there is none."""
    valid = (
        waiver_index
        for waiver_index, waiver in enumerate(mission.waivers)
        if today <= waiver.until and named_by(waiver.id, ids)
    )
    return next(valid, -1)


def named_by(pattern: str, ids: Sequence[str]) -> list[int]:
    """List the indices of the ids that match the pattern of a waiver.

    The pattern may contain the wildcards `*`, `?` and `[…]`. An id with a bracket also matches a pattern that is
    equal to it.
    """
    if not any(char in pattern for char in "*?["):
        return [id_index for id_index, row_id in enumerate(ids) if row_id == pattern]
    matches = map(re.compile(translate(pattern)).match, ids)
    return [id_index for id_index, match in enumerate(matches) if match or ids[id_index] == pattern]


# ---------------------------------------------------------------------- from outside the file
def overrides(mission: Mission, outside: Outside, today: date) -> tuple[Override, ...]:
    """Collect all options, settings and files outside the mission file that affect the verdict on one mission.

    Parameters
    ----------
    mission : Mission
        Mission as loaded from its file, with the options that changed it and the catalogue parts that it uses.
    outside : Outside
        Influences from outside the mission files that affect all missions of the run.
    today : date
        Day (UTC) on which waivers are judged. It affects the verdict if the file has a waiver.
    """
    from_outside = list(outside.options)
    if mission.waivers or outside.is_day_given:
        from_outside.append(Override("--date", today.isoformat(), outside.day_origin))
    from_outside += [
        Override("--set", f"{change.key}={change.text}", outside.set_origin) for change in mission.changes
    ]
    levels = (Override(figure.key, figure.level, figure.off) for figure in shifted_figures(mission))
    return (*from_outside, *_own_parts(mission), *levels, *_planned_orbits(mission))


def _planned_orbits(mission: Mission) -> Iterator[Override]:
    """Yield an entry for each orbit that the mission file declares as planned.

    The platform is then assumed to follow the planned orbit. Neither the age of the orbit nor its interpolation
    affects the verdict.
    """
    for name in PLATFORMS:
        orbit = getattr(mission.platforms, name).orbit
        if orbit is not None and orbit.planned:
            yield Override(f"platforms.{name}.orbit.planned", "true", _PLANNED)


def _own_parts(mission: Mission) -> Iterator[Override]:
    """Yield an entry for each part file of the user's project that replaces a catalogue part of the same name."""
    catalogue = str(resource("specs", "sensors")) if mission.parts else ""
    for name, file, _ in mission.parts:
        if name.endswith((".yaml", ".yml")) or os.path.dirname(file) == catalogue:
            continue
        if any(os.path.exists(os.path.join(catalogue, name + suffix)) for suffix in (".yaml", ".yml")):
            yield Override(
                f"part {printable(name)}", _shown(file, mission.file), "the project's, in place of the catalogue's"
            )


def _shown(file: str, mission_file: str) -> str:
    """Path of a file relative to the folder of the mission file.

    This path does not depend on the current folder.
    """
    try:
        path = os.path.relpath(file, os.path.dirname(mission_file) or os.curdir)
    except (OSError, ValueError):  # the current folder no longer exists, or the file is on another drive
        path = file
    return printable(path.replace(os.sep, "/"))
