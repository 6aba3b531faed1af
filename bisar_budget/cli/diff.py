"""`bisar-budget diff`: the effect that a change of a mission has on every margin."""

import os
import sys
from collections.abc import Callable, Sequence
from datetime import datetime
from functools import partial
from typing import TYPE_CHECKING

import click

from bisar_budget.cli.options import (
    DATE,
    FILE,
    GATING_MODEL,
    ParamType,
    answer_options,
    day_and_outside,
    set_option,
    settings_here,
)
from bisar_budget.cli.projects import folder_of_file
from bisar_budget.cli.streams import BROKEN_EXIT_CODE, deliver_answer, expand, fail, read_all, spare
from bisar_budget.faults import printable
from bisar_budget.resources import DISK, Files

if TYPE_CHECKING:
    from bisar_budget.faults import SetValue
    from bisar_budget.mission.model import Mission
    from bisar_budget.report.change.comparison import ChangeSet, Loosened, MissionChange
    from bisar_budget.settings import SettingValues

_Read = Callable[[], "Mission"]


class _Part(ParamType[float]):
    """Parameter type for a fraction from 0 to 1, written as `10%` or as 0.1."""

    name = "percent"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> float:
        from bisar_budget.faults import InvalidValueError
        from bisar_budget.units import RATIO, parse_quantity

        try:
            part = parse_quantity(value, RATIO)
        except InvalidValueError:
            part = -1.0
        if not 0 <= part <= 1:
            self.fail(f"{printable(str(value))}: must be 0% to 100%, such as 10% or 0.1.", param, ctx)
        return part


@click.command()
@click.argument("files", type=FILE, nargs=-1, required=True, metavar="OLD NEW | MISSION...")
@click.option("--base", metavar="REV", help="Compare each MISSION with itself in this git revision.")
@set_option("Compare each MISSION with itself with a value replaced or added")
@click.option(
    "--fail-on-erosion",
    "tolerated",
    type=_Part(),
    metavar="PERCENT",
    help="Exit with 1 if the change loosens anything, if a row or a requirement newly fails or is no longer "
    "evaluated, or if the erosion of a row exceeds this value.",
)
@click.option(
    "--allow",
    "allowed",
    multiple=True,
    metavar="ID",
    help="With --fail-on-erosion: accept this change. ID is that of the comparison, or a pattern; FILE:ID for one "
    "mission only. Repeatable.",
)
@answer_options("diff")
@click.option("--all", "all_rows", is_flag=True, help="Also show rows that changed by less than 1 %.")
@DATE
def diff(
    files: Sequence[str],
    base: str | None,
    changes: "tuple[SetValue, ...]",
    tolerated: float | None,
    allowed: tuple[str, ...],
    format_name: str | None,
    all_rows: bool,
    output: str | None,
    today: datetime | None,
) -> None:
    """Show what a change to a mission does to every margin, and what it loosens.

    Compares two mission files, or each mission file with its version in a git revision (--base), or with other values
    (--set). Lists changes of the file and the geometry, then the rows. With --base the parts, settings, orbits
    and logs are those of the revision too, and a pattern names the missions of both.

    Rows are sorted by erosion, the fraction of the remaining margin that the change uses up: (u2 - u1)/(1 - u1),
    u1 and u2 being declared over allowable before and after; u2/u1 - 1 for a row without margin before.

    Also lists what is loosened, which margins do not show: a mission file, a requirement, an error, its source or an
    entry of requirements.declare that was removed, a larger requirement, a new or longer waiver, a newly waived row,
    more autofocus, and less coverage, reserve, model or combination; and an error whose effect is smaller
    than before in the same geometry although its part and its source are the same.

    Exit code: 0; 1 with --fail-on-erosion; 2 for wrong usage, an unusable file or an unknown revision.
    """
    from bisar_budget.report.answers.diff_answer import Compared
    from bisar_budget.report.change.comparison import Gate

    if base is not None and changes:
        raise click.UsageError("--base and --set each say what a mission is compared with; give one of them.")
    if allowed and tolerated is None:
        raise click.UsageError("--allow is for --fail-on-erosion, which refuses; give both, or neither.")
    if base is None and not changes and len(files) != 2:
        raise click.UsageError(
            "give two mission files, OLD and NEW, or mission files and --base REV or --set KEY=VALUE."
        )
    if base is not None:
        comparison = _with_revision(files, base, output, today)
    else:
        comparison = _with_files(files, changes, output, today)
    gate = None if tolerated is None else Gate(tolerated, allowed)
    deliver_answer("diff", [Compared(comparison, gate, all_rows)], format_name, output)
    sys.exit(BROKEN_EXIT_CODE if gate is not None and comparison.is_refused(gate) else 0)


def _with_files(
    files: Sequence[str], changes: "tuple[SetValue, ...]", output: str | None, today: datetime | None
) -> "ChangeSet":
    """Compare two mission files, or compare mission files with themselves after changes.

    If `changes` is empty, `files` are two files, the first of which is the earlier version. Otherwise each file is
    compared with itself after the changes are applied.
    """
    from bisar_budget.mission.load import load_mission
    from bisar_budget.report.change.comparison import ChangeSet, loosened_settings

    files = expand(files) if changes else files
    spare(files, [output])
    old, new = (files, files) if changes else (files[:1], files[1:])
    settings_before, settings_after = ([_settings(file) for file in of] for of in (old, new))
    before = [
        partial(load_mission, file, settings.get("model"))
        for file, settings in zip(old, settings_before, strict=True)
    ]
    after = [
        partial(load_mission, file, settings.get("model"), changes)
        for file, settings in zip(new, settings_after, strict=True)
    ]
    pairs = zip(settings_before, settings_after, strict=True)
    loosened = dict.fromkeys(setting for pair in pairs for setting in loosened_settings(*pair))
    return ChangeSet(_compared(before, after, today), settings=tuple(loosened))


def _with_revision(patterns: Sequence[str], base: str, output: str | None, today: datetime | None) -> "ChangeSet":
    """Compare mission files with their versions in the Git revision `base`.

    The patterns are applied both to the files on disk and to the files in the revision, so that new and removed
    mission files are found too.
    """
    from bisar_budget.mission.load import load_mission
    from bisar_budget.mission.revision import Revision, RevisionError, mission_at
    from bisar_budget.report.change.comparison import ChangeSet, loosened_settings
    from bisar_budget.resources import resource

    if "-" in patterns:
        raise click.UsageError("--base needs files: standard input is in no revision.")
    spare(expand(patterns), [output])
    loosened: dict[Loosened, None] = {}
    gone, new, before, after = list[str](), list[str](), list[_Read](), list[_Read]()
    revisions: dict[str, Revision] = {}
    try:
        for pattern in patterns:
            revision = Revision(pattern, base)
            revision = revisions.setdefault(revision.top, revision)
            present = [file for file in expand([pattern]) if os.path.lexists(file)]
            past = revision.matching(pattern)
            gone += [revision.path_of(file) for file in past if not os.path.lexists(file)]
            for file in present or ([] if past else [pattern]):
                if present and not revision.has(file):
                    new.append(revision.path_of(file))
                    continue
                past_settings, settings = _settings(file, revision), _settings(file)
                loosened |= dict.fromkeys(loosened_settings(past_settings, settings))
                before.append(partial(mission_at, file, revision, past_settings.get("model")))
                after.append(partial(load_mission, file, settings.get("model")))
        changes = _compared(before, after, today)
    except RevisionError as error:
        fail(str(error))
    bundled = str(resource("specs"))
    outside = [file for revision in revisions.values() for file in revision.outside if not file.startswith(bundled)]
    return ChangeSet(
        changes,
        gone=tuple(dict.fromkeys(gone)),
        new=tuple(dict.fromkeys(new)),
        settings=tuple(loosened),
        outside=tuple(dict.fromkeys(outside)),
    )


def _compared(before: Sequence[_Read], after: Sequence[_Read], today: datetime | None) -> "tuple[MissionChange, ...]":
    """Compare each mission in `before` with its counterpart in `after`.

    Both are sequences of functions, each of which reads one mission. If a mission is unusable, the faults of all
    missions are written, and the command ends.
    """
    from bisar_budget.questions.checks import check
    from bisar_budget.report.change.comparison import compare

    missions = read_all(read for pair in zip(before, after, strict=True) for read in pair)
    judged_on, from_outside = day_and_outside(today)
    findings = [check(mission, date=judged_on, outside=from_outside).findings for mission in missions]
    return tuple(compare(*pair) for pair in zip(findings[::2], findings[1::2], strict=True))


def _settings(mission: str, files: Files = DISK) -> "SettingValues":
    """Return the values of the settings nearest to a mission file; empty if there are no settings.

    `files` reads the settings from disk or from a Git revision.
    """
    from bisar_budget.settings import TABLE

    settings = settings_here(files, None if mission == "-" else folder_of_file(mission))
    if settings is None:
        return {}
    try:
        GATING_MODEL.convert(settings.values.get("model", "full"), None, None)
    except click.UsageError as error:
        raise click.UsageError(f"{printable(settings.file)}: {TABLE}.model: {error.message}") from None
    return settings.values
