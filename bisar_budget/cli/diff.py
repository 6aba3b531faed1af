"""`bisar-budget diff`: what a change to a mission does to every margin."""

import sys
from collections.abc import Sequence
from datetime import datetime
from typing import TYPE_CHECKING, Any

import click

from bisar_budget import __version__
from bisar_budget.cli.outside import day, outside
from bisar_budget.cli.streams import (
    DATE,
    EXIT_BROKEN,
    EXIT_USAGE,
    FILE,
    OUTPUT,
    ParamType,
    complain,
    deliver,
    expand,
    fail,
    set_option,
    spare,
)
from bisar_budget.faults import printable

if TYPE_CHECKING:
    from bisar_budget.faults import SetValue


class _Part(ParamType[float]):
    """A part of something: `10%` or 0.1."""

    name = "percent"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
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
@set_option("Compare each MISSION with itself with a value in place of its own, or beside it")
@click.option(
    "--fail-on-erosion",
    "tolerated",
    type=_Part(),
    metavar="PERCENT",
    help="Exit with 1 if a row or a requirement newly fails or is not evaluated any more, or if the change uses up "
    "more than this part of what was left of a row's limit.",
)
@click.option(
    "--format",
    "format_name",
    type=click.Choice(["text", "markdown", "json"]),
    default="text",
    show_default=True,
    help="Format of the comparison.",
)
@click.option("--all", "all_rows", is_flag=True, help="Also show rows that moved by less than 1 %.")
@OUTPUT
@DATE
def diff(
    files: Sequence[str],
    base: str | None,
    changes: "tuple[SetValue, ...]",
    tolerated: float | None,
    format_name: str,
    all_rows: bool,
    output: str | None,
    today: datetime | None,
) -> None:
    """Show what a change to a mission does to every margin.

    Compares two mission files, each with itself in a git revision, or each with itself with other values (--set).
    What changed in the file and in the geometry stands first, then the rows.

    Rows are sorted by erosion. Erosion is the part of what was left of a limit that the change uses up:
    (u2 - u1)/(1 - u1), u1 and u2 being declared over allowable before and after. A row that had nothing left has
    u2/u1 - 1. Exit code: 0; 1 with --fail-on-erosion; 2 for wrong usage, an unusable file or an unknown revision.
    """
    from bisar_budget.budget.check import check_mission
    from bisar_budget.faults import MissionError
    from bisar_budget.mission.load import load_mission
    from bisar_budget.mission.revision import RevisionError, mission_at
    from bisar_budget.report.change import difference
    from bisar_budget.report.change.comparison import compare

    if base is not None and changes:
        raise click.UsageError("--base and --set each say what a mission is compared with; give one of them.")
    is_with_itself = base is not None or bool(changes)
    if not is_with_itself and len(files) != 2:
        raise click.UsageError(
            "give two mission files, OLD and NEW, or mission files and --base REV or --set KEY=VALUE."
        )
    files = expand(files) if is_with_itself else files
    spare(files, [output])
    judged_on, from_outside = day(today), outside(today)
    pairs = [(file, file) for file in files] if is_with_itself else [(files[0], files[1])]
    compared = []
    for before, after in pairs:
        try:
            old = load_mission(before) if base is None else mission_at(before, base)
            new = load_mission(after, changes=changes)
        except RevisionError as error:
            fail(str(error))
        except MissionError as error:
            for line in error.lines():
                complain(line)
            sys.exit(EXIT_USAGE)
        judged = [check_mission(mission, judged_on, outside=from_outside) for mission in (old, new)]
        compared.append(compare(*judged))
    if format_name == "json":
        text = difference.as_json(__version__, compared, tolerated)
    else:
        write = difference.as_text if format_name == "text" else difference.as_markdown
        text = write(compared, tolerated, all_rows)
    deliver(text, output, format_name)
    is_refused = tolerated is not None and any(change.is_refused(tolerated) for change in compared)
    sys.exit(EXIT_BROKEN if is_refused else 0)
