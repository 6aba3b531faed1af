"""`bisar-budget sweep`: a table with the results of a check for many values of the keys of a mission."""

import os
import sys
from collections.abc import Sequence
from datetime import datetime
from typing import TYPE_CHECKING

import click

from bisar_budget.cli.options import (
    DATE,
    FILE,
    MODEL,
    SET,
    day_and_outside,
    format_option,
    output_option,
    plot_option,
    scheduler_options,
)
from bisar_budget.cli.streams import (
    BROKEN_EXIT_CODE,
    PICTURE_SUFFIXES,
    complain,
    deliver_answer,
    deliver_parts,
    fail,
    load_all,
    replacing,
    spare,
    suffix_of,
    write_file,
)
from bisar_budget.faults import printable
from bisar_budget.report.answers import ANSWERS, format_of_file, suffixes

if TYPE_CHECKING:
    from bisar_budget.faults import SetValue
    from bisar_budget.questions.sweep import SweepResult

_TABLE_SUFFIXES = (".csv", ".parquet", ".nc")
MAX_UNFORCED_CASES = 100_000_000  # more need --force, since the table has tens of gigabytes


@click.command()
@click.argument("mission", type=FILE)
@click.option(
    "--vary",
    "varied",
    multiple=True,
    metavar="KEY=FROM:TO UNIT:COUNT",
    help="Values of a key, such as platforms.receiver.azimuth=0:180deg:181; with :log behind it in equal ratios. Or "
    "a list, KEY=1,2,5 s, also of words: allocation.model=published,full. Repeatable: every combination is a case.",
)
@click.option(
    "--cases",
    "cases_file",
    type=FILE,
    metavar="FILE",
    help="Cases of a CSV file instead: a header KEY [unit] for each column, one line for each case.",
)
@click.option(
    "--sample",
    metavar="latin:COUNT:SEED",
    help="Draw a Latin hypercube over the ranges of --vary instead of every combination.",
)
@click.option(
    "--column",
    "columns",
    multiple=True,
    metavar="ROW.FIELD",
    help="A column more, such as receiver.velocity.x.allowable. Repeatable.",
)
@format_option(
    ANSWERS["sweep"].formats,
    "Format of the table (default: that of the suffix of -o, else csv); xlsx needs -o.",
    default=None,
    show_default=False,
)
@output_option("Write to FILE: .csv, .parquet, .nc (NetCDF), or a format of --format.")
@plot_option("Draw one key as curves of utilization, two as a map: .svg, .png or .pdf.")
@click.option("--plot-column", metavar="NAME", help="Draw this column instead of utilization and status.")
@click.option("--polar", "is_polar", is_flag=True, help="Draw the map over an azimuth as seen from above.")
@MODEL
@SET
@DATE
@click.option("--jobs", type=click.IntRange(min=1), metavar="N", help="Processes to use (default: number of cores).")
@scheduler_options("Check", " Parts are kept in the folder FILE.parts of -o FILE, and joined to FILE at the end.")
@click.option(
    "--resume",
    "is_resumed",
    is_flag=True,
    help="Go on from the parts in FILE.parts that an earlier run left; without any, keep parts to go on from.",
)
@click.option("--force", is_flag=True, help=f"Start also with more than {MAX_UNFORCED_CASES} cases.")
def sweep(
    mission: str,
    varied: Sequence[str],
    cases_file: str | None,
    sample: str | None,
    columns: Sequence[str],
    format_name: str | None,
    output: str | None,
    plot: str | None,
    plot_column: str | None,
    is_polar: bool,
    model: str | None,
    changes: "tuple[SetValue, ...]",
    today: datetime | None,
    jobs: int | None,
    scheduler: str | None,
    patience: int,
    is_resumed: bool,
    force: bool,
) -> None:
    """Check a mission for many values of its keys: a table with one line for each case.

    Its columns are the varied keys, resolutions, angles, the status, the worst row, its utilization, and the binding
    requirement. Cases without a valid mission, such as a platform below the ground, have the status error and a
    reason. CSV goes to standard output without -o and --plot. Exit code: 0 if any case is judged, 1 if none is, 2 for
    wrong usage or an unusable mission file.
    """
    if format_name is None and output not in (None, "-"):
        suffix_of(output, tuple(dict.fromkeys((*_TABLE_SUFFIXES, *suffixes("sweep")))))
        format_name = format_of_file("sweep", str(output))
    is_table = format_name in (None, "csv")
    if plot == "-":
        raise click.UsageError("--plot needs the name of a file.")
    suffix_of(plot, PICTURE_SUFFIXES)
    if plot is None and (plot_column is not None or is_polar):
        raise click.UsageError("--plot-column and --polar say how to draw; --plot says to which file.")
    if (cases_file is None) == (not varied):
        raise click.UsageError("say which cases there are: either --vary or --cases.")
    if cases_file is not None and sample is not None:
        raise click.UsageError("--sample draws from the ranges of --vary; --cases has cases of its own.")
    spare([mission, *([cases_file] if cases_file else [])], [output, plot])
    from bisar_budget.extras import MissingExtraError
    from bisar_budget.mission.quantities import QuestionError, TableError
    from bisar_budget.questions import sweep as question
    from bisar_budget.questions.missions import cases_of, cases_of_texts
    from bisar_budget.questions.progress import hold_to_tables, workers_of
    from bisar_budget.report.drawing.trades import check_plot

    (loaded,) = load_all([mission], model, changes)
    try:
        cases = cases_of_texts(loaded, varied, sample) if cases_file is None else cases_of(loaded, cases_file)
        if plot is not None:
            check_plot(cases, is_polar=is_polar)
        judged_on, from_outside = day_and_outside(today)
        is_kept = scheduler is not None or is_resumed
        if is_kept:
            if output is None or output == "-" or not is_table:
                raise click.UsageError(
                    "--scheduler and --resume need -o FILE.csv, .parquet or .nc: parts are kept in FILE.parts."
                )
            if scheduler is None:
                hold_to_tables()
        if plot_column is not None and "." in plot_column and plot_column not in columns:
            columns = (*columns, plot_column)
        with workers_of(scheduler, patience) as workers:
            run = question.sweep(
                loaded, cases, columns=columns, model=model, date=judged_on, jobs=jobs, outside=from_outside
            )
            run.workers, run.beside, run.is_resumed = workers, output if is_kept else None, is_resumed
            _foresee(run, force)
            if is_table:
                _write(run, output, plot, plot_column, is_polar)
            else:
                deliver_answer("sweep", run.answers, format_name, output)
                if plot is not None:
                    write_file(
                        plot, run.plot(plot_column, is_polar=is_polar).of(suffix_of(plot, PICTURE_SUFFIXES)[1:])
                    )
                complain(f"{printable(run.mission.name)}: {run.so_far}")
        sys.exit(BROKEN_EXIT_CODE if run.is_unjudged else 0)
    except TableError as error:
        for line in error.lines:
            complain(line)
        sys.exit(2)
    except (QuestionError, MissingExtraError) as error:
        fail(f"{mission}: {error}")


def _foresee(run: "SweepResult", force: bool) -> None:
    """Report the expected duration of a long sweep, and refuse a sweep that is too large.

    More than `MAX_UNFORCED_CASES` cases are refused unless `force` is true.
    """
    from bisar_budget.questions.progress import foretell, lasting

    count, seconds = run.cases.count, run.foreseen()
    if count > MAX_UNFORCED_CASES and not force:
        fail(
            f"{run.mission.file}: {count} cases will take about {lasting(seconds)}; "
            f"accepted: up to {MAX_UNFORCED_CASES}, or more with --force"
        )
    foretell(seconds, f"{count} cases")


def _write(run: "SweepResult", output: str | None, plot: str | None, plot_column: str | None, is_polar: bool) -> None:
    """Check the cases and write the table block by block, then write the plot, and a summary to standard error."""
    from bisar_budget.report.drawing.figure import drawing_file
    from bisar_budget.report.drawing.trades import Gathered
    from bisar_budget.report.tables import texts, writer_of

    writer = writer_of(os.path.splitext(output)[1].lower()) if output not in (None, "-") else None
    with run.checked() as (described, parts):
        gathered = None
        if plot is not None:
            gathered = Gathered(described, column=plot_column)
            parts = gathered.passing(parts)
        if writer is not None:
            with replacing(str(output)) as name:
                writer.write(described, parts, name)
        elif output is None and plot is not None:
            for _ in parts:
                pass
        else:
            deliver_parts(texts(described, parts), "csv")
    if plot is not None and gathered is not None:
        kind = os.path.splitext(plot)[1][1:].lower()
        write_file(plot, drawing_file(run.drawing(gathered, is_polar=is_polar), kind))
    complain(f"{printable(run.mission.name)}: {run.so_far}")
