"""`bisar-budget solve` and `sensitivity`: the effects of the numbers in a mission file on the verdict.

`solve` finds the values of one number at which the mission begins or ceases to comply. `sensitivity` ranks all
numbers by their effects on the worst utilization.
"""

import sys
from collections.abc import Sequence
from datetime import datetime
from functools import partial
from typing import TYPE_CHECKING

import click

from bisar_budget.cli.options import (
    DATE,
    MISSIONS,
    MODEL,
    SET,
    answer_options,
    ask_each,
    plot_option,
    wrong_usage,
)
from bisar_budget.cli.streams import (
    BROKEN_EXIT_CODE,
    PICTURE_SUFFIXES,
    deliver_answer,
    expand,
    load_all,
    spare,
    suffix_of,
    write_file,
)
from bisar_budget.constants import TARGETS

if TYPE_CHECKING:
    from bisar_budget.faults import SetValue


@click.command()
@MISSIONS
@click.option(
    "--for",
    "key",
    required=True,
    metavar="KEY",
    help="Path of the number in the file, such as collection.aperture_time or platforms.receiver.azimuth.",
)
@click.option(
    "--scale",
    "is_scale",
    is_flag=True,
    help="KEY is a section of errors: solve for the factor that multiplies all of them.",
)
@click.option(
    "--between",
    metavar="A..B",
    help="Range to search, with units (default: a tenth to ten times the stated value; for azimuths the circle).",
)
@click.option("--row", metavar="ID", help="The row that must comply, instead of the whole mission.")
@click.option(
    "--target",
    type=click.Choice(TARGETS),
    default=TARGETS[0],
    show_default=True,
    help="Status to avoid: fail, or also warn and whatever fails check --strict.",
)
@MODEL
@SET
@DATE
@click.option("--verify", "is_imaged", is_flag=True, help="Form images of the row that binds at the solution.")
@answer_options("solve")
def solve(
    missions: Sequence[str],
    key: str,
    is_scale: bool,
    between: str | None,
    row: str | None,
    target: str,
    model: str | None,
    changes: "tuple[SetValue, ...]",
    today: datetime | None,
    format_name: str | None,
    is_imaged: bool,
    output: str | None,
) -> None:
    """Find the values of a number at which a mission begins or ceases to comply.

    Finds every such value of the range, names the binding row on both sides of it, and checks both sides as
    they are written. Two values closer than the search step are found only if the worst utilization has an extremum
    between them. For platforms.receiver.motion_error.sensor and the like every part of the catalogue is tried. Exit
    code: 0, also if nothing complies but some value is waived; 1 if no value of the range and no part complies or is
    waived, or if the image refutes the limit (--verify); 2 for wrong usage or an unusable mission file.
    """
    from bisar_budget.questions import solve as question

    with wrong_usage():
        question.hold_to_parts(key, between, is_scale)
    files = expand(missions)
    spare(files, [output])
    ask = partial(question.solve, key=key, between=between, scale=is_scale, row=row, target=target, verify=is_imaged)
    solutions = [answer.found for answer in ask_each(load_all(files, model, changes), model, today, ask)]
    deliver_answer("solve", solutions, format_name, output)
    is_broken = any(each.status == "none" or (each.imaged and each.imaged.is_optimistic) for each in solutions)
    sys.exit(BROKEN_EXIT_CODE if is_broken else 0)


@click.command()
@MISSIONS
@click.option("--row", metavar="ID", help="Also follow this row; numbers are sorted by their effect on it.")
@MODEL
@SET
@DATE
@answer_options("sensitivity")
@plot_option("Draw the effects of a mission as bars: .svg, .png, .pdf.")
def sensitivity(
    missions: Sequence[str],
    row: str | None,
    model: str | None,
    changes: "tuple[SetValue, ...]",
    today: datetime | None,
    format_name: str | None,
    output: str | None,
    plot: str | None,
) -> None:
    """Rank the numbers of a mission by their effect on its worst utilization.

    Each number that the file states, or takes from a part of the catalogue, is increased and decreased alone, and
    the mission is checked again. Most numbers change by 1 %. Directions change by a quarter of a degree and levels
    by a quarter of a decibel; their effects are reported per degree and per decibel. Latitudes and longitudes change
    by 1 % of the smaller slant range. With balanced shares, a second table shows how much the other errors lose if
    one error is doubled. Exit code: 0, or 2 for wrong usage or an unusable mission file.
    """
    from bisar_budget.questions import sensitivity as question

    kind = suffix_of(plot, PICTURE_SUFFIXES)[1:]
    files = expand(missions)
    if plot is not None and len(files) > 1:
        raise click.UsageError("--plot draws one mission.")
    spare(files, [output, plot])
    ask = partial(question.sensitivity, row=row)
    results = [*ask_each(load_all(files, model, changes), model, today, ask)]
    if plot is not None:
        write_file(plot, results[0].plot().of(kind))
    deliver_answer("sensitivity", [result.found for result in results], format_name, output)
