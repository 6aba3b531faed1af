"""`bisar-budget verify`: images at the limits."""

import sys
from collections.abc import Sequence
from datetime import date
from typing import TYPE_CHECKING

import click

from bisar_budget import __version__
from bisar_budget.cli.keeping import workers_of
from bisar_budget.cli.streams import (
    EXIT_BROKEN,
    EXIT_USAGE,
    FILE,
    OUTPUT,
    PATIENCE,
    SET,
    TEXT_OR_JSON,
    complain,
    deliver,
    expand,
    load_all,
    spare,
    wants_color,
)
from bisar_budget.cli.waiting import FORMING, foretell, watched
from bisar_budget.faults import printable
from bisar_budget.resources import cores

if TYPE_CHECKING:
    from bisar_budget.cluster.scheduler import Workers
    from bisar_budget.faults import SetValue
    from bisar_budget.findings.images import VerifiedMission
    from bisar_budget.mission.model import Mission


@click.command()
@click.argument("missions", type=FILE, nargs=-1, required=True, metavar="MISSION...")
@click.option("--only", default="*", metavar="GLOB", help="Verify only the rows whose id matches.")
@TEXT_OR_JSON
@OUTPUT
@SET
@click.option(
    "--jobs",
    type=click.IntRange(min=1),
    metavar="N",
    help="Processes to use; default: the number of cores, or 1 with the extra `fast`, which uses all cores itself.",
)
@click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Form them on the workers of a Dask scheduler, tcp://HOST:PORT, or on local:N processes of its own.",
)
@PATIENCE
def verify(
    missions: Sequence[str],
    only: str,
    format_name: str,
    output: str | None,
    changes: "tuple[SetValue, ...]",
    jobs: int | None,
    scheduler: str | None,
    patience: int,
) -> None:
    """Form images at the limits and measure whether they are true.

    The data come from exact ranges, and the phase is measured in the image. A limit is confirmed if the
    image shows its budget within 5 %, optimistic if it shows more, conservative if less. With autofocus
    each limit is formed again with its gain and refocused. Exit code: 0, or 1 if a limit is optimistic, 2
    for wrong usage, an unusable file, or a mission on whose limits no image gave a verdict.
    """
    from bisar_budget.budget.waivers import NOTHING_OUTSIDE, overrides
    from bisar_budget.report import Style
    from bisar_budget.report.formats import verification

    files = expand(missions)
    spare(files, [output])
    loaded = load_all(files, changes=changes)
    with workers_of(scheduler, patience) as workers:
        images = verify_all(loaded, only, jobs, workers)
    verified = [
        found._replace(
            overrides=overrides(mission._replace(waivers=()), NOTHING_OUTSIDE, date.min)
        )  # images waive nothing
        for mission, found in zip(loaded, images, strict=True)
    ]
    if format_name == "json":
        text = verification.as_json(__version__, verified)
    else:
        text = verification.as_text(verified, Style(color=output is None and wants_color()))
    deliver(text, output, format_name)
    doubts = [mission for mission in verified if mission.doubt]
    for mission in doubts:
        complain(f"{printable(mission.file)}: {mission.doubt}")
    if doubts:
        sys.exit(EXIT_USAGE)
    sys.exit(EXIT_BROKEN if any(mission.status == "fail" for mission in verified) else 0)


def verify_all(
    missions: "Sequence[Mission]", only: str, jobs: int | None, workers: "Workers | None" = None
) -> "list[VerifiedMission]":
    """Verify missions in processes here, or on workers of a scheduler; a bar shows it, where somebody watches."""
    from bisar_budget.findings.row import where_ids_are
    from bisar_budget.simulate.image_formation import is_compiled
    from bisar_budget.verify.limits import rows_to_verify, seconds_to_verify, verify_mission

    total = sum(len(rows_to_verify(mission, only)) for mission in missions)
    if not total and only != "*":
        listed = where_ids_are(missions[0].file)
        raise click.UsageError(
            f"--only {printable(only)}: no row with a limit matches, nothing was verified; {listed}."
        )
    jobs = workers.threads if workers else jobs or (1 if is_compiled() else cores())
    seconds = sum(seconds_to_verify(mission, only, jobs) for mission in missions)
    foretell(
        seconds,
        f"Forming the images of {total} rows",
        "--only looks at some of them" + faster(None if workers else jobs),
    )
    found: list[VerifiedMission] = []
    with watched(FORMING, total) as progress:
        for mission in missions:
            before = sum(len(one.rows) for one in found)

            def formed(done: int, _: int, before: int = before) -> None:
                progress(before + done, total)

            found.append(verify_mission(mission, only, jobs, formed, workers.mapped if workers else None))
    return found


def faster(jobs: int | None = None) -> str:
    """Say what would make image formation faster here."""
    from bisar_budget.simulate.image_formation import is_compiled

    if not is_compiled():
        return ", and pip install 'bisar-budget[fast]' makes it tens of times faster"
    return f", --jobs {cores()} uses all cores" if jobs is not None and 1 < jobs < cores() else ""
