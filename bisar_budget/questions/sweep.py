"""Sweeps: a mission is checked for many sets of values. The result is a table of cases, a drawing and a summary."""

import datetime as dt
import os
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from time import perf_counter
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from bisar_budget import __version__, notebook
from bisar_budget.faults import ClusterError, printable
from bisar_budget.findings.case_table import Cases, Part, Swept, Values
from bisar_budget.findings.requirement import Outside, Override
from bisar_budget.findings.status import complying
from bisar_budget.mission.model import Mission
from bisar_budget.mission.quantities import QuestionError
from bisar_budget.questions import progress
from bisar_budget.questions.asked import Asked, Block, part_of
from bisar_budget.questions.cases import sampled_cases
from bisar_budget.questions.checks import gathered
from bisar_budget.questions.missions import cases_of
from bisar_budget.questions.outside import influences_of
from bisar_budget.questions.results import AnswerResult, DataFrame, MissingPackageError, Picture, frame_of
from bisar_budget.questions.table import Question, listed
from bisar_budget.report.answers.sweep_answer import MAX_ANSWER_CASES, SweptCases, status_of
from bisar_budget.report.drawing.trades import Gathered, check_plot, uses_of_rows
from bisar_budget.report.tables import Described, dataset
from bisar_budget.report.words.sentences import waived_count
from bisar_budget.resources import cores

if TYPE_CHECKING:
    from dask.array import Array
    from xarray import Dataset

    from bisar_budget.cluster.scheduler import Workers

_MANY_CASES = 20_000  # for more cases the time is estimated beforehand
_TRIAL_CASES = 100  # number of cases in the first trial for this estimate
_MAX_SHOWN_CASES = 10  # largest number of cases that a notebook shows, if there is no drawing


def sweep(
    mission: Mission,
    values: "Mapping[str, object] | str | os.PathLike[str] | Cases",
    *,
    paired: bool = False,
    columns: str | Sequence[str] = (),
    model: str | None = None,
    date: str | dt.date | None = None,
    jobs: int | None = None,
    outside: Outside | None = None,
) -> "SweepResult":
    """Check a mission for every combination of values of its keys.

    Parameters
    ----------
    mission : Mission
        As in `check`.
    values : mapping, path or cases
        The values of each key, by the path of the key, such as `collection.aperture_time`. They are a range such as
        `linspace("1 s", "5 s", 101)`, an array of numbers in SI, a quantity with an array, a list of strings with
        units, or a list of names, such as parts of the catalogue. Alternatively `values` is the path of a CSV file,
        whose header has `KEY [unit]` for each column.
    paired : bool
        If true, the n-th case takes the n-th value of every key. By default every combination of the values is a
        case.
    columns : str or sequence of str
        Further columns of the form `ROW.FIELD`, such as `receiver.velocity.x.allowable`.
    model, date, outside
        As in `check`.
    jobs : int, optional
        Number of processes, used if many cases cannot be checked as arrays, but have to be read one by one. By
        default the number of cores.

    Raises
    ------
    QuestionError
        A key or a column is unknown, or no value is given for a key.
    """
    today, influences = influences_of(mission, model, date, outside)
    cases = cases_of(mission, values, paired) if isinstance(values, Mapping | str | os.PathLike) else values
    further_columns = (columns,) if isinstance(columns, str) else tuple(columns)
    asked = Asked(mission, cases, columns=further_columns, model=model, today=today)
    return SweepResult(asked, jobs or cores(), influences)


@dataclass(repr=False, eq=False)
class SweepResult(AnswerResult):
    """Result of `sweep`: a table with the results of checking a mission for many sets of values.

    Each case is `mission` with one set of the values in `cases`, and is a line of the table. Cases are checked when
    their results are first needed. `to_dataframe` and `to_xarray` return the whole table, and `result[name]` returns
    the column with this name. `statuses` counts the checked cases by status, and `waived_by` has the ids of their
    waivers. If `workers` of a scheduler are given, they check the cases. If `beside` is the path of a file, checked
    parts of the table are stored in a folder next to this file; if `is_resumed`, an interrupted sweep continues with
    the stored parts.
    """

    COMMAND: ClassVar[str] = "sweep"
    asked: Asked
    jobs: int
    overrides: tuple[Override, ...] = ()
    workers: "Workers | None" = None
    beside: str | None = None
    is_resumed: bool = False
    statuses: Counter[str] = field(default_factory=Counter)
    waived_by: dict[str, None] = field(default_factory=dict)

    @property
    def mission(self) -> Mission:
        """The mission that is checked with the values of each case."""
        return self.asked.mission

    @property
    def cases(self) -> Cases:
        """The cases of the sweep."""
        return self.asked.cases

    def __repr__(self) -> str:
        """Text on one line with the varied keys, the number of cases, and the number of cases that comply."""
        return f"<sweep of {self.mission.name!r} over {self._keys(', ')}: {self.summary}>"

    def _keys(self, between: str) -> str:
        return between.join(each.key for each in self.cases.varied)

    # ------------------------------------------------------------------ checking cases
    def foreseen(self) -> float:
        """Estimate the time needed to check all cases [s]; 0 if there are so few cases that no estimate is needed."""
        if self.cases.count <= _MANY_CASES:
            return 0.0

        def trial(count: int) -> float:
            blocks = self.asked.again(cases=sampled_cases(self.cases, count)).checked().parts
            began = perf_counter()
            for _ in blocks:
                pass
            return perf_counter() - began

        seconds = progress.foreseen(self.cases.count, trial, _TRIAL_CASES, self.cases.count)
        if self.asked.chunks.is_slow:  # otherwise processes are no faster than arrays
            seconds /= self.workers.threads if self.workers else min(self.jobs, cores())
        return seconds

    @contextmanager
    def checked(self) -> Iterator[tuple[Described, Iterator[Part]]]:
        """Context manager that yields the description of the table, and an iterator over the parts of the table.

        The iterator checks the cases of a part when the part is requested. A notebook or a terminal shows a progress
        bar.
        """
        sweep: AbstractContextManager[Swept]
        if self.beside is None:
            sweep, label = nullcontext(self.asked.checked(self.jobs)), "Checking cases"
        else:
            sweep, label = self._kept(f"{self.beside}.parts"), "Writing"
        with sweep as swept, progress.watched(label) as report:
            yield self._described(swept), self._counted(swept.parts, report)

    @contextmanager
    def _kept(self, path: str) -> Iterator[Swept]:
        """Check all parts of the table, store them in a folder, and yield the table that is read from the folder.

        Workers of a scheduler, or processes on this machine, check the parts. At the end the folder is removed. After
        an interruption the folder remains, and a message tells how to continue the sweep.
        """
        from bisar_budget.cluster.parts_folder import parts_folder

        asked, chunks, say = self.asked, self.asked.chunks, progress.SAYING.get()
        question = asked.inputs
        with parts_folder(path, question, chunks, is_resumed=self.is_resumed) as folder:

            def parts_done() -> str:
                return f"{len(folder.done)} of {len(chunks.starts)} parts"

            try:
                if folder.done:
                    say(f"{folder.path} has {parts_done()}.")
                missing = [start for start in chunks.starts if start not in folder.done]
                done = sum(chunks.stop(start) - start for start in folder.done)
                with progress.watched("Checking cases") as report:
                    for block in asked.shared_out(missing, self.jobs, self.workers.mapped if self.workers else None):
                        folder.put(block)
                        done += block.stop - block.start
                        report(done, self.cases.count)
                yield asked.swept(folder.parts(chunks.starts))
            except BaseException:
                with suppress(ClusterError, OSError):
                    folder.find(chunks, True)  # Ctrl-C may come between the renaming of a part and its record
                dated = f" --date {question['--date was']}" if question["--date was"] else ""
                say(f"{folder.path} keeps {parts_done()}; the same command with --resume{dated} goes on from there.")
                raise
            folder.remove()

    def _described(self, swept: Swept) -> Described:
        return Described(swept, self.cases, self.mission, __version__, self.overrides)

    def _counted(self, blocks: Iterator[Part], report: Callable[[int, int], None]) -> Iterator[Part]:
        self.statuses.clear()
        self.waived_by.clear()
        for block in blocks:
            self.statuses.update(block.values["status"].tolist())
            waivers_of_cases = (listed(waivers) for waivers in dict.fromkeys(block.values["waived_by"].tolist()))
            self.waived_by |= dict.fromkeys(waiver for waivers in waivers_of_cases for waiver in waivers)
            yield block
            report(self.statuses.total(), self.cases.count)

    @property
    def so_far(self) -> str:
        """Phrase with the number of cases checked so far, and how many of them comply."""
        done, comply = self.statuses.total(), complying(self.statuses)
        if not done:
            return "no case was checked"
        words = [f"{done} case{'' if done == 1 else 's'}"]
        if done < self.cases.count:
            words[0] += f" of {self.cases.count}"
        words.append(f"{comply} comply ({percentage(comply, done)})")
        if self.statuses["waived"]:
            words.append(waived_count(self.statuses["waived"], list(self.waived_by)))
        if self.statuses["not_evaluated"]:
            words.append(f"{self.statuses['not_evaluated']} not evaluated")
        if self.statuses["error"]:
            words.append(f"{self.statuses['error']} without a mission")
        return ", ".join(words)

    @property
    def is_unjudged(self) -> bool:
        """Whether there are cases with a valid mission, and all of them have the status `not_evaluated`."""
        return self.statuses.keys() - {"error"} == {"not_evaluated"}

    def drawing(self, trade_data: Gathered, *, is_polar: bool = False) -> str:
        """Draw the checked cases, and return the drawing as SVG text.

        `trade_data` has the columns to draw. If only one key varies, the drawing also shows the utilization of each
        row that is the worst row in at least one case. If `is_polar`, the axes of the drawing are polar.
        """
        from bisar_budget.report.drawing.trade_drawing import head_of, trade_drawing

        trade = trade_data.trade(is_polar=is_polar)
        check_again = partial(gathered, self.asked, jobs=self.jobs)
        return trade_drawing(
            trade,
            uses_of_rows(trade, check_again),
            self.mission.file,
            f"Trade study: {' and '.join(axis.key for axis in trade.axes)}, {self.mission.name}",
            f"{printable(self.mission.name)}: {self.so_far}",
            above=head_of(trade, self.mission, is_polar=is_polar),
            seen_from_above=self.mission.geometry if is_polar else None,
        )

    # ------------------------------------------------------------------ all cases, for a notebook
    @cached_property
    def _parts(self) -> tuple[Swept, tuple[Part, ...]]:
        with self.checked() as (described, blocks):
            return described.swept, tuple(blocks)

    @property
    def _table(self) -> Described:
        swept, blocks = self._parts
        return self._described(replace(swept, parts=iter(blocks)))

    @property
    def summary(self) -> str:
        """Phrase with the number of cases, and how many of them comply; cases not checked yet are checked first."""
        return self.so_far if self._parts else ""  # cases are counted when they are checked

    @cached_property
    def columns(self) -> Mapping[str, Values]:
        """Values (cases,) of each column, by column name.

        The values of a varied key are in the unit in which the sweep was requested.
        """
        table = self._table
        values = [table.values(block) for block in table.swept.parts]
        return {column.name: np.concatenate([block[column.name] for block in values]) for column in table.columns}

    def __getitem__(self, name: str) -> Values:
        """Return the values (cases,) of the column `name`; raises `KeyError` if there is no such column."""
        if name not in self.columns:
            raise KeyError(f"{name}: no such column; accepted: {', '.join(self.columns)}")
        return self.columns[name]

    def to_dataframe(self, library: str | None = None) -> DataFrame:
        """Return the table as a data frame of pandas or polars, with the same columns as the CSV file of `sweep`."""
        columns = self.columns.items()
        lists = {name: values.tolist() if values.dtype == object else values for name, values in columns}
        return frame_of(lists, library)

    def to_xarray(self, chunks: Mapping[str, int] | int | str | None = None) -> "Dataset":
        """Return the table as an `xarray.Dataset` with a dimension for each varied key, CF units and long names.

        Parameters
        ----------
        chunks : mapping, int or "auto", optional
            Chunk size of each dimension, one size for all dimensions, or `"auto"` for the chunks of the sweep. The
            values are then Dask arrays, and cases are checked when Dask computes them.

        Raises
        ------
        MissingExtraError
            xarray is not installed.
        MissingPackageError
            `chunks` is given, and Dask is not installed.
        """
        if chunks is None:
            return dataset(self._table, self.columns)
        lazy = dataset(self._described(self.asked.swept(iter(()))), self._later())
        sizes = (
            {} if chunks == "auto" else chunks if isinstance(chunks, Mapping) else dict.fromkeys(lazy.dims, chunks)
        )
        # `Dataset.chunk` would compute the columns of texts.
        return lazy.map(
            lambda array: array.copy(
                data=array.data.rechunk({array.get_axis_num(key): size for key, size in sizes.items()})
            ),
            keep_attrs=True,
        )

    def _later(self) -> "dict[str, Array]":
        """Return the columns of the table as Dask arrays; the cases of a chunk are checked when Dask computes it.

        The Dask tasks contain copies of all files that the mission names, so later changes to these files have no
        effect.
        """
        try:
            from dask import array
            from dask.delayed import delayed
            from dask.utils import SerializableLock
        except ImportError:
            raise MissingPackageError("chunks need Dask: pip install dask") from None
        table, chunks = self._described(self.asked.swept(iter(()))), self.asked.chunks
        common = delayed((self.asked.travelling, table, SerializableLock()), pure=False)
        columns: dict[str, list[Array]] = {column.name: [] for column in table.columns}
        for start in chunks.starts:
            stop = chunks.stop(start)
            values = delayed(_values)(common, (start, stop, self.cases.values(start, stop)))
            for column in table.columns:
                kind = object if column.is_text else float
                columns[column.name].append(array.from_delayed(values[column.name], (stop - start,), kind))
        return {name: array.concatenate(chunk_arrays) for name, chunk_arrays in columns.items()}

    @property
    def answers(self) -> list[SweptCases]:
        """The checked cases, for output formats that need all cases in memory.

        Raises
        ------
        QuestionError
            There are more than 40 000 cases.
        """
        if self.cases.count > MAX_ANSWER_CASES:
            accepted = f"up to {MAX_ANSWER_CASES}, or more with the suffixes .csv, .parquet and .nc"
            raise QuestionError(f"{self.cases.count} cases are too many for a document; accepted: {accepted}")
        try:
            drawing = self.plot().of("svg").decode()
        except QuestionError:  # the cases have no axes
            drawing = ""
        swept = SweptCases(
            self.mission, self._table, self._parts[1], self.columns, self.summary, "", self.overrides, drawing
        )
        return [swept._replace(status=status_of(self.statuses))]

    def plot(self, column: str | None = None, *, is_polar: bool = False) -> Picture:
        """Draw the utilization as curves over one varied key, or the complying cases as a map over two varied keys.

        Parameters
        ----------
        column : str, optional
            Name of a numeric column that is drawn in place of the utilization or the complying cases.
        is_polar : bool
            Whether to draw the map as seen from above; one of the keys is then an azimuth.

        Raises
        ------
        QuestionError
            Too many keys vary for a drawing, or `column` is not a numeric column.
        """
        from bisar_budget.report.drawing.figure import drawing_file

        check_plot(self.cases, is_polar=is_polar)
        table = self._table
        gathered_cases = Gathered(table, column=column)
        for block in table.swept.parts:
            gathered_cases.add(block)
        return Picture(
            f"{self._keys(' and ')}, {self.mission.name}",
            partial(drawing_file, self.drawing(gathered_cases, is_polar=is_polar)),
        )

    def _repr_html_(self) -> str:
        try:
            drawn = self.plot().of("svg").decode()
        except QuestionError:
            names = list(self.columns)
            rows = zip(*(self.columns[name][:_MAX_SHOWN_CASES] for name in names), strict=True)
            drawn = notebook.table(names, rows)
        return notebook.page(drawn, notebook.note(f"{self.mission.name}: {self.summary}"))


def _values(common: tuple[Question, Described, AbstractContextManager[object]], block: Block) -> Mapping[str, Values]:
    """Check a block of cases, and return the values of every table column for these cases.

    `common` holds the question that the sweep asks, the table, and a lock. With the lock, only one thread at a time
    checks cases, because the table caches results.
    """
    question, table, lock = common
    with lock:
        return table.values(part_of(question, block))


def percentage(count: int, total: int) -> str:
    """Format `count` as a percentage of `total`.

    The text is `0 %` only if `count` is 0, and `100 %` only if `count` equals `total`.
    """
    if count in (0, total):
        return "100 %" if count else "0 %"
    return f"{min(max(100 * count / total, 0.1), 99.9):.3g} %"
