"""`bisar-budget sensitivity`: what each number of a mission does to its worst utilization."""

import os
from collections.abc import Sequence
from datetime import datetime
from typing import TYPE_CHECKING

import click

from bisar_budget.cli.options import DATE, FILE, MISSIONS, MODEL, OUTPUT, SET, TEXT_OR_JSON, day, outside
from bisar_budget.cli.streams import deliver_found, expand, fail, hold_to_suffixes, load_all, spare, write_file
from bisar_budget.cli.waiting import watched_checks

if TYPE_CHECKING:
    from bisar_budget.faults import SetValue


@click.command()
@MISSIONS
@click.option("--row", metavar="ID", help="A row to follow too; numbers are ordered by what they do to it.")
@MODEL
@SET
@DATE
@TEXT_OR_JSON
@OUTPUT
@click.option("--plot", type=FILE, metavar="FILE", help="Draw the effects of a mission as bars: .svg, .png, .pdf.")
def sensitivity(
    missions: Sequence[str],
    row: str | None,
    model: str | None,
    changes: "tuple[SetValue, ...]",
    today: datetime | None,
    format_name: str,
    output: str | None,
    plot: str | None,
) -> None:
    """Rank the numbers of a mission by what they do to its worst utilization.

    Each number that the file states, or takes from a part of the catalogue, is changed by itself and the mission
    checked anew: by 1 % of it to both sides,
    directions and levels by a quarter of what is said, a degree or a decibel, places on the Earth by 1 % of the
    smaller slant range. With balanced shares a second table says what relaxing an error costs the others. Exit code:
    0, or 2 for wrong usage or an unusable mission file.
    """
    from bisar_budget.budget.waivers import overrides
    from bisar_budget.design import sensitivity as asking
    from bisar_budget.design.quantities import QuestionError
    from bisar_budget.report.formats import answers

    hold_to_suffixes(plot, (".svg", ".png", ".pdf"))
    files = expand(missions)
    if plot is not None and len(files) > 1:
        raise click.UsageError("--plot draws one mission.")
    spare(files, [output, plot])
    judged_on, from_outside = day(today), outside(today)
    found = []
    for mission in load_all(files, model, changes):
        try:
            with watched_checks(mission.name) as progress:
                asked = asking.sensitivity(mission, row=row, model=model, today=judged_on, progress=progress)
            found.append(asked._replace(overrides=overrides(mission, from_outside, judged_on)))
        except QuestionError as error:
            fail(f"{mission.file}: {error}")
    if plot is not None:
        from bisar_budget.report.drawing.tornado import tornado

        write_file(plot, tornado(found[0], os.path.splitext(plot)[1][1:].lower()))
    deliver_found(answers, found, format_name, output)
