"""Sweeps that keep their parts until they are one table: those of a scheduler, and those that can be gone on with."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, NamedTuple

import click

from bisar_budget.cli.streams import complain, fail
from bisar_budget.cli.waiting import watched

if TYPE_CHECKING:
    from bisar_budget.cluster.scheduler import Workers
    from bisar_budget.design.sweep import Asked
    from bisar_budget.design.table import Swept


class Keeping(NamedTuple):
    """How the parts of a sweep are kept, beside its output; workers of a scheduler find them, or processes here."""

    output: str
    is_resumed: bool
    jobs: int
    workers: "Workers | None" = None

    @contextmanager
    def swept(self, asked: "Asked") -> "Iterator[Swept]":
        """Give the sweep when all its parts are kept, and take them away when the table is written.

        What ends it before leaves the parts, and says how to go on.
        """
        from bisar_budget.cluster.parts_folder import parts_folder, question_of

        chunks, count = asked.chunks(), asked.cases.count
        question = question_of(asked, chunks)
        with parts_folder(f"{self.output}.parts", question, chunks, is_resumed=self.is_resumed) as folder:

            def kept() -> str:
                return f"{len(folder.done)} of {len(chunks.starts)} parts"

            try:
                if folder.done:
                    complain(f"{folder.path} has {kept()}.")
                left = [start for start in chunks.starts if start not in folder.done]
                done = sum(chunks.stop(start) - start for start in folder.done)
                with watched("Checking cases", count, done) as progress:
                    mapped = self.workers.mapped if self.workers else None
                    for part in asked.shared_out(chunks, left, self.jobs, mapped):
                        folder.put(part)
                        done += part.stop - part.start
                        progress(done, count)
                yield asked.swept(folder.parts(chunks.starts))
            except BaseException:
                dated = f" --date {question['--date was']}" if question["--date was"] else ""
                complain(f"{folder.path} keeps {kept()}; the same command with --resume{dated} goes on from there.")
                raise
            folder.remove()


@contextmanager
def keeping(
    output: str | None, scheduler: str | None, patience: int, is_resumed: bool, jobs: int
) -> Iterator[Keeping | None]:
    """Say how parts are kept, with the workers of a scheduler at hand; None where nobody asks for that."""
    if scheduler is None and not is_resumed:
        yield None
        return
    if output is None or output == "-":
        raise click.UsageError("--scheduler and --resume need -o FILE: parts are kept in FILE.parts.")
    if scheduler is None:
        from bisar_budget.cluster.parts_folder import check_libraries
        from bisar_budget.memory import OF_TABLES

        check_libraries("--resume", OF_TABLES, "tables", "pyarrow")
    with workers_of(scheduler, patience) as workers:
        yield Keeping(output, is_resumed, jobs, workers)


@contextmanager
def workers_of(scheduler: str | None, patience: int) -> "Iterator[Workers | None]":
    """Give the workers of a scheduler, None where none is named; what is wrong with them ends the command."""
    if scheduler is None:
        yield None
        return
    from bisar_budget.cluster.parts_folder import ClusterError
    from bisar_budget.cluster.scheduler import connected

    try:
        with connected(scheduler, patience, complain) as workers:
            yield workers
    except ClusterError as error:
        fail(str(error))
