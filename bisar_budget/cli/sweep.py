"""`bisar-budget sweep`: a mission checked for many values of its numbers."""

import os
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from datetime import date, datetime
from functools import partial
from time import perf_counter
from typing import TYPE_CHECKING

import click

from bisar_budget import __version__
from bisar_budget.cli.long_work import foreseen, foretell, kept, lasting, watched, workers_of
from bisar_budget.cli.options import DATE, FILE, MODEL, SET, day, outside, scheduler_options
from bisar_budget.cli.streams import (
    EXIT_BROKEN,
    complain,
    deliver_parts,
    fail,
    hold_to_suffixes,
    load_all,
    replacing,
    spare,
    write_file,
)
from bisar_budget.faults import printable
from bisar_budget.resources import cores

if TYPE_CHECKING:
    from bisar_budget.cluster.scheduler import Workers
    from bisar_budget.design.cases import Cases
    from bisar_budget.design.sweep import Asked
    from bisar_budget.design.table import Part, Swept
    from bisar_budget.faults import SetValue
    from bisar_budget.findings.requirement import Override
    from bisar_budget.mission.model import Mission
    from bisar_budget.report.drawing.trades import Gathered
    from bisar_budget.workers import Progress

MAX_CASES = 100_000_000  # that are started without being asked twice: tens of gigabytes
_MANY = 20_000  # cases from which on it is measured how long they will take
_FEW = 100  # cases of the first trial


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
@click.option("-o", "--output", type=FILE, metavar="FILE", help="Write to FILE: .csv, .parquet or .nc (NetCDF).")
@click.option(
    "--plot",
    type=FILE,
    metavar="FILE",
    help="Draw one key as curves of utilization, two as a map: .svg, .png or .pdf.",
)
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
@click.option("--force", is_flag=True, help=f"Start also with more than {MAX_CASES} cases.")
def sweep(
    mission: str,
    varied: Sequence[str],
    cases_file: str | None,
    sample: str | None,
    columns: Sequence[str],
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

    It has what varied, resolutions, angles, the status, the worst row, its utilization, and the requirement that
    binds. Cases for which there is no mission, such as a platform below the ground, have the status error and a
    reason. CSV goes to standard output without -o and --plot. Statuses do not change the exit code, as long as some
    case is judged: 0; 1 if none is; 2 for wrong usage or an unusable mission file.
    """
    hold_to_suffixes(None if output == "-" else output, (".csv", ".parquet", ".nc"))
    if plot == "-":
        raise click.UsageError("--plot needs the name of a file.")
    hold_to_suffixes(plot, (".svg", ".png", ".pdf"))
    if plot is None and (plot_column is not None or is_polar):
        raise click.UsageError("--plot-column and --polar say how to draw; --plot says to which file.")
    if (cases_file is None) == (not varied):
        raise click.UsageError("say which cases there are: either --vary or --cases.")
    if cases_file is not None and sample is not None:
        raise click.UsageError("--sample draws from the ranges of --vary; --cases has cases of its own.")
    spare([mission, *([cases_file] if cases_file else [])], [output, plot])
    from bisar_budget.budget.waivers import overrides
    from bisar_budget.design.cases import TableError
    from bisar_budget.mission.quantities import QuestionError
    from bisar_budget.report.drawing.trades import check_plot
    from bisar_budget.report.tables import MissingTablesError

    (loaded,) = load_all([mission], model, changes)
    try:
        cases = _cases(loaded, varied, cases_file, sample)
        if plot is not None:
            check_plot(cases, is_polar=is_polar)
        judged_on = day(today)
        said = overrides(loaded, outside(today), judged_on)
        if scheduler is not None or is_resumed:
            if output is None or output == "-":
                raise click.UsageError("--scheduler and --resume need -o FILE: parts are kept in FILE.parts.")
            if scheduler is None:
                from bisar_budget.cluster.parts_folder import check_libraries
                from bisar_budget.memory import OF_TABLES

                check_libraries("--resume", OF_TABLES, "tables", "pyarrow")
        with workers_of(scheduler, patience) as workers:
            run = _Run(loaded, cases, columns, model, judged_on, jobs or cores(), said, workers, is_resumed)
            run.foresee(force)
            run.write(output, plot, plot_column, is_polar)
        sys.exit(EXIT_BROKEN if run.is_unjudged else 0)
    except TableError as error:
        for line in error.lines:
            complain(line)
        sys.exit(2)
    except (QuestionError, MissingTablesError) as error:
        fail(f"{mission}: {error}")


def _cases(mission: "Mission", varied: Sequence[str], cases_file: str | None, sample: str | None) -> "Cases":
    """Read the cases that the options ask for."""
    from bisar_budget.design import cases
    from bisar_budget.mission.quantities import tree_of

    tree = tree_of(mission)
    if cases_file is None:
        return cases.grid(tree, varied) if sample is None else cases.sample(tree, varied, sample)
    try:
        with open(cases_file, encoding="utf-8", newline="") as file:
            text = file.read(cases.LARGEST_TABLE + 1)
    except (OSError, ValueError) as error:  # ValueError: not UTF-8, a NUL in the name
        fail(f"{cases_file}: cannot be read: {getattr(error, 'strerror', None) or error}")
    if len(text) > cases.LARGEST_TABLE:
        fail(
            f"{cases_file}: is larger than {cases.LARGEST_TABLE >> 20} MiB; accepted: up to {cases.MAX_VALUES} values"
        )
    return cases.table(tree, text, cases_file)


@dataclass
class _Run:
    """One sweep on its way to a table and a plot; counts the statuses that it finds."""

    mission: "Mission"
    cases: "Cases"
    columns: Sequence[str]
    model: str | None
    day: date
    jobs: int
    overrides: "tuple[Override, ...]"
    workers: "Workers | None"
    is_resumed: bool
    statuses: Counter[str] = field(default_factory=Counter)

    def asked(self, columns: Sequence[str]) -> "Asked":
        """The question, with some columns."""
        from bisar_budget.design.sweep import Asked

        return Asked(self.mission, self.cases, columns=columns, model=self.model, today=self.day)

    def swept(self, cases: "Cases", columns: Sequence[str]) -> "Swept":
        """Ask the engine."""
        from bisar_budget.design.sweep import sweep

        return sweep(self.mission, cases, columns=columns, model=self.model, today=self.day, jobs=self.jobs)

    def foresee(self, force: bool) -> None:
        """Say how many cases there are if they take long, and begin too many only by force."""
        from bisar_budget.design.cases import some_of

        count = self.cases.count
        if count <= _MANY:
            return

        def trial(some: int) -> float:
            parts = self.swept(some_of(self.cases, some), self.columns).parts
            began = perf_counter()
            for _ in parts:
                pass
            return perf_counter() - began

        seconds = foreseen(count, trial, _FEW, count)
        if self.asked(self.columns).chunks().is_slow:  # else processes are no faster than arrays
            seconds /= self.workers.threads if self.workers else min(self.jobs, cores())
        if count > MAX_CASES and not force:
            fail(
                f"{self.mission.file}: {count} cases will take about {lasting(seconds)}; "
                f"accepted: up to {MAX_CASES}, or more with --force"
            )
        foretell(seconds, f"{count} cases")

    def write(self, output: str | None, plot: str | None, plot_column: str | None, is_polar: bool) -> None:
        """Check the cases, write the table as they come, then the plot, and say what was found."""
        from bisar_budget.report.tables import Described, texts, writer_of

        writer = writer_of(os.path.splitext(output)[1].lower()) if output not in (None, "-") else None
        columns = self.columns
        if plot_column is not None and "." in plot_column and plot_column not in columns:
            columns = (*columns, plot_column)
        found: AbstractContextManager[Swept]
        gathered, is_kept = None, self.workers is not None or self.is_resumed
        if is_kept:
            found = kept(self.asked(columns), str(output), self.jobs, self.workers, is_resumed=self.is_resumed)
        else:
            found = nullcontext(self.swept(self.cases, columns))
        with found as swept:
            described = Described(swept, self.cases, self.mission, __version__, self.overrides)
            if plot is not None:
                from bisar_budget.report.drawing.trades import Gathered

                gathered = Gathered(described, column=plot_column)
            with watched("Writing" if is_kept else "Checking cases", self.cases.count) as progress:
                parts = self._counted(swept.parts, progress, gathered)
                if writer is not None:
                    with replacing(str(output)) as name:
                        writer.write(described, parts, name)
                elif output is None and plot is not None:
                    for _ in parts:
                        pass
                else:
                    deliver_parts(texts(described, parts), "csv")
        if plot is not None and gathered is not None:
            self._draw(plot, gathered, is_polar)
        complain(self._summary())

    def _counted(
        self, parts: "Iterator[Part]", progress: "Progress", gathered: "Gathered | None"
    ) -> "Iterator[Part]":
        """Hand the parts on, and take what is counted or drawn."""
        for part in parts:
            self.statuses.update(part.values["status"].tolist())
            if gathered is not None:
                gathered.add(part)
            yield part
            progress(self.statuses.total(), self.cases.count)

    def _draw(self, plot: str, found: "Gathered", is_polar: bool) -> None:
        """Draw what was gathered; over one key also the rows that are the worst somewhere."""
        from bisar_budget.cli.studies import gathered
        from bisar_budget.report.drawing.figure import drawing_file
        from bisar_budget.report.drawing.trade_drawing import head_of, trade_drawing
        from bisar_budget.report.drawing.trades import uses_of_rows

        trade = found.trade(is_polar=is_polar)
        again = partial(gathered, self.mission, self.cases, self.model, self.day, jobs=self.jobs)
        drawing = trade_drawing(
            trade,
            uses_of_rows(trade, again),
            self.mission.file,
            f"Trade study: {' and '.join(axis.key for axis in trade.axes)}, {self.mission.name}",
            self._summary(),
            above=head_of(trade, self.mission, is_polar=is_polar),
            seen_from_above=self.mission.geometry if is_polar else None,
        )
        write_file(plot, drawing_file(drawing, os.path.splitext(plot)[1][1:].lower()))

    @property
    def is_unjudged(self) -> bool:
        """Whether no case that is a mission could be judged."""
        return self.statuses.keys() - {"error"} == {"not_evaluated"}

    def _summary(self) -> str:
        """One line: how many cases, and how many comply."""
        from bisar_budget.findings.status import complying

        done, comply = self.statuses.total(), complying(self.statuses)
        if not done:
            return f"{printable(self.mission.name)}: no case was checked"
        said = [f"{done} case{'' if done == 1 else 's'}"]
        if done < self.cases.count:
            said[0] += f" of {self.cases.count}"
        said.append(f"{comply} comply ({_part(comply, done)})")
        if self.statuses["not_evaluated"]:
            said.append(f"{self.statuses['not_evaluated']} not evaluated")
        if self.statuses["error"]:
            said.append(f"{self.statuses['error']} without a mission")
        return f"{printable(self.mission.name)}: {', '.join(said)}"


def _part(some: int, of: int) -> str:
    """Say a part of a whole; all and none are said only where it is so."""
    if some in (0, of):
        return "100 %" if some else "0 %"
    return f"{min(max(100 * some / of, 0.1), 99.9):.3g} %"
