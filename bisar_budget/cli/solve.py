"""`bisar-budget solve`: where a number of a mission begins or ceases to comply."""

import sys
from collections.abc import Sequence
from datetime import datetime
from typing import TYPE_CHECKING, Any

import click

from bisar_budget.cli.options import DATE, MISSIONS, MODEL, OUTPUT, SET, TEXT_OR_JSON, day, outside
from bisar_budget.cli.streams import EXIT_BROKEN, deliver_found, expand, fail, load_all, spare
from bisar_budget.cli.waiting import FORMING, foretell, watched, watched_checks

if TYPE_CHECKING:
    from bisar_budget.design.compare import Comparison
    from bisar_budget.design.solve import Solution
    from bisar_budget.faults import SetValue
    from bisar_budget.mission.model import Mission


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
    help="Range to look at, with units (default: a tenth to ten times the file's value; of azimuths the circle).",
)
@click.option("--row", metavar="ID", help="The row that has to comply, instead of the whole mission.")
@click.option(
    "--target",
    type=click.Choice(["fail", "warn"]),
    default="fail",
    show_default=True,
    help="What must not happen: fail, or also warn and what check --strict breaks on.",
)
@MODEL
@SET
@DATE
@click.option("--verify", "is_imaged", is_flag=True, help="Form images of the row that binds at the solution.")
@TEXT_OR_JSON
@OUTPUT
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
    format_name: str,
    is_imaged: bool,
    output: str | None,
) -> None:
    """Find the values of a number at which a mission begins or ceases to comply.

    Every such value of the range is found, what binds on both sides of it is named, and both sides are checked as
    they are written. A pair of values closer than the places looked at is found only if the worst utilization turns
    there. Of platforms.receiver.motion_error.sensor and the like every part of the catalogue is tried. Exit code: 0,
    1 if no value of the range or no part complies or if the image refutes the limit (--verify), 2 for wrong usage or
    an unusable mission file.
    """
    from bisar_budget.budget.waivers import overrides
    from bisar_budget.design import compare
    from bisar_budget.design import solve as solving
    from bisar_budget.design.quantities import QuestionError
    from bisar_budget.report.formats import answers

    is_of_parts = compare.is_of_parts(key)
    if is_of_parts and (between is not None or is_scale):
        option = "--scale" if is_scale else "--between"
        raise click.UsageError(f"{option}: {key} names parts of the catalogue, which are compared one by one.")
    files = expand(missions)
    spare(files, [output])
    judged_on, from_outside = day(today), outside(today)
    solved: list[Solution | Comparison] = []
    for mission in load_all(files, model, changes):
        try:
            found: Solution | Comparison
            with watched_checks(mission.name) as progress:
                asked: dict[str, Any] = {
                    "row": row, "target": target, "model": model, "today": judged_on, "progress": progress
                }  # fmt: skip
                if is_of_parts:
                    found = compare.compare_parts(mission, key, **asked)
                else:
                    found = solving.solve(mission, key, between=between, is_scale=is_scale, **asked)
        except QuestionError as error:
            fail(f"{mission.file}: {error}")
        found = found._replace(overrides=overrides(mission, from_outside, judged_on))
        solved.append(_imaged(mission, found, model) if is_imaged else found)
    deliver_found(answers, solved, format_name, output)
    is_broken = any(one.status == "none" or (one.imaged and one.imaged.is_optimistic) for one in solved)
    sys.exit(EXIT_BROKEN if is_broken else 0)


def _imaged(mission: "Mission", found: "Solution | Comparison", model: str | None) -> "Solution | Comparison":
    """Add what images say of the solution."""
    from bisar_budget.cli.verify import faster
    from bisar_budget.design.imaged import imaged, to_image

    asked = to_image(mission, found, model)
    if asked is None:
        return found
    foretell(asked.seconds, f"Forming the images of {asked.row}", "without --verify none is formed" + faster())
    with watched(FORMING) as progress:
        return found._replace(imaged=imaged(asked, progress))
