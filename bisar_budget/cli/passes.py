"""`bisar-budget passes`: the passes of a satellite over the scene, and the status of the mission in each pass."""

import math
import os
import sys
from collections.abc import Sequence
from contextlib import suppress
from datetime import date, datetime
from functools import partial
from typing import TYPE_CHECKING

import click

from bisar_budget.cli.options import (
    DATE,
    FILE,
    MODEL,
    SET,
    answer_options,
    day_and_outside,
    plot_option,
    wrong_usage,
)
from bisar_budget.cli.streams import (
    BROKEN_EXIT_CODE,
    MISSION_SUFFIXES,
    PICTURE_SUFFIXES,
    USAGE_EXIT_CODE,
    complain,
    deliver_answer,
    fail,
    read_all,
    say_faults,
    spare,
    suffix_of,
    write_file,
)
from bisar_budget.constants import MAX_DAYS
from bisar_budget.report.words.sentences import waived_count

if TYPE_CHECKING:
    from bisar_budget.faults import SetValue
    from bisar_budget.findings.satellite_passes import SatellitePass
    from bisar_budget.questions.results import PassesResult


@click.command()
@click.argument("mission", type=FILE)
@click.option(
    "--from",
    "start",
    metavar="DATE",
    help="First day, UTC, or an instant such as 2026-07-01T05:30:00Z (default: the day of --date).",
)
@click.option(
    "--days",
    type=click.FloatRange(0, MAX_DAYS, min_open=True),
    default=3.0,
    show_default=True,
    metavar="N",
    help=f"Number of days, up to {MAX_DAYS:g}.",
)
@click.option(
    "--min-elevation",
    "min_elevation",
    default="20 deg",
    show_default=True,
    metavar="ANGLE",
    help="Least elevation of the satellite seen from the scene; of both satellites if both platforms have orbits.",
)
@click.option(
    "--squint",
    default="0 deg",
    show_default=True,
    metavar="ANGLE",
    help="Squint of the mid-time, at which the mission is checked: 0 at broadside, positive looking forward.",
)
@click.option(
    "--platform",
    type=click.Choice(["transmitter", "receiver"]),
    help="Whose passes are listed (default: the platform that has an orbit, of two the transmitter).",
)
@MODEL
@SET
@DATE
@answer_options(
    "passes",
    "ics is a calendar.",
    output="Write to FILE. Into a folder DIR, or a name that ends in /, go mission files, one for each pass that "
    "complies or is waived.",
    metavar="FILE|DIR",
)
@plot_option("Draw tracks in the sky and resolutions: .svg, .png or .pdf.")
def passes(
    mission: str,
    start: str | None,
    days: float,
    min_elevation: str,
    squint: str,
    platform: str | None,
    model: str | None,
    changes: "tuple[SetValue, ...]",
    today: datetime | None,
    format_name: str | None,
    output: str | None,
    plot: str | None,
) -> None:
    """List the passes of a satellite over the scene, with the verdict of the mission in each.

    The mission file must give the orbit of a platform and the location of the scene on the Earth. The mission is
    checked once for each pass, with collection.center_time set to the mid-time of the pass. A pass that cannot be
    checked is listed with the reason. Exit code: 0 if the mission complies or is waived in at least one pass; 1 if
    there is no such pass; 2 for wrong usage, an unusable mission file, or an orbit that is not known at any time of
    the period.
    """
    if math.isnan(days):
        raise click.UsageError(f"--days: nan is no number of days; accepted: more than 0, up to {MAX_DAYS:g}.")
    kind = suffix_of(plot, PICTURE_SUFFIXES)[1:]
    is_folder = output is not None and (output.endswith(("/", os.sep)) or os.path.isdir(output))
    spare([mission], [None if is_folder else output, plot])
    from bisar_budget.faults import MissionError
    from bisar_budget.mission.load import load_mission
    from bisar_budget.mission.quantities import QuestionError
    from bisar_budget.questions import passes as question

    judged_on, from_outside = day_and_outside(today)
    with wrong_usage():
        least = question.angle_of("--min-elevation", min_elevation, 0.0)
        squint_rad = question.angle_of("--squint", squint, -90.0)
    (loaded,) = read_all([partial(load_mission, mission, model, changes, is_placed=False)])
    try:
        result = question.passes(
            loaded,
            start or None,
            days=days,
            platform=platform,
            min_elevation=least,
            squint=squint_rad,
            model=model,
            date=judged_on,
            outside=from_outside,
        )
    except QuestionError as error:
        fail(f"{mission}: {error}")
    except MissionError as error:
        say_faults(error.file, error.faults)
        sys.exit(USAGE_EXIT_CODE)
    if is_folder and output is not None:
        _write_missions(result, output, judged_on)
        output = None
    if plot is not None:
        write_file(plot, result.plot().of(kind))
    deliver_answer("passes", [result.found], format_name, output)
    sys.exit(0 if result.accepted else BROKEN_EXIT_CODE)


# ---------------------------------------------------------------- a mission file for each pass
def _write_missions(result: "PassesResult", folder: str, today: date) -> None:
    """Write a mission file to `folder` for each pass that complies or is waived.

    Every mission is first checked as if its file and the files that it names were already in the folder. If a mission
    is unusable, or its status differs from the status of its pass, no file is written.
    """
    texts = {
        os.path.join(folder, _name(each, result.file)): result.mission_text(each, folder) for each in result.accepted
    }
    spare([result.file], texts)
    if not texts:
        complain(f"no mission file is written to {folder}: no pass complies or is waived")
        return
    is_new = not os.path.isdir(folder)
    try:
        os.makedirs(folder, exist_ok=True)
        _hold_to_statuses(result.accepted, texts, today)
    except OSError as error:
        fail(f"cannot write {folder}: {error.strerror}")
    except SystemExit:
        if is_new:
            with suppress(OSError):
                os.rmdir(folder)
        raise
    for path, text in texts.items():
        write_file(path, text)
    waived = len(texts) - len(result.complying)
    apart = f": {len(result.complying)} comply, {waived_count(waived, result.waived_by)}" if waived else ""
    complain(f"{len(texts)} mission file{'s' if len(texts) != 1 else ''} in {folder}{apart}")


def _name(satellite_pass: "SatellitePass", file: str) -> str:
    """File name for the mission of a pass: the name of the original file, followed by the pass's mid-time in UTC."""
    stem, suffix = os.path.splitext(os.path.basename(file) if file != "-" else "mission.yaml")
    stem, suffix = (stem, suffix) if suffix.lower() in MISSION_SUFFIXES else (stem + suffix, MISSION_SUFFIXES[0])
    time = (
        ""
        if satellite_pass.center is None
        else satellite_pass.center.as_text()[:19].replace("-", "").replace(":", "")
    )
    return f"{stem}_{time}Z{suffix}"


def _hold_to_statuses(passes: "Sequence[SatellitePass]", texts: dict[str, str], today: date) -> None:
    """End the command with an error if a mission is unusable in its new folder, or if its status differs there.

    The status in the folder must be the same as the status of the pass. `texts` maps the path of each mission file to
    its content, in the order of `passes`.
    """
    from bisar_budget.faults import MissionError
    from bisar_budget.questions.checks import check
    from bisar_budget.questions.missions import loads

    for satellite_pass, (path, text) in zip(passes, texts.items(), strict=True):
        try:
            status = check(loads(text, path), date=today).status
        except MissionError as error:
            fail(f"{path} is not written: {error.faults[0]}")
        if status != satellite_pass.status:
            fail(f"{path} is not written: in its folder it is checked to {status}; does it name a part there?")
