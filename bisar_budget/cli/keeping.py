"""Sweeps that keep their parts until they are one table: those of a scheduler, and those that can be gone on with."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from datetime import date
from typing import TYPE_CHECKING, NamedTuple

import click

from bisar_budget.cli.streams import complain
from bisar_budget.cli.waiting import progress_bar

if TYPE_CHECKING:
    from bisar_budget.cluster.parts_folder import PartsFolder
    from bisar_budget.cluster.scheduler import Workers
    from bisar_budget.design.cases import Cases
    from bisar_budget.design.sweep import Asked, Chunks
    from bisar_budget.design.swept import Swept
    from bisar_budget.mission.model import Mission


class Keeping(NamedTuple):
    """How the parts of a sweep are kept, beside its output; workers of a scheduler find them, or processes here."""

    output: str
    is_resumed: bool
    jobs: int
    workers: "Workers | None" = None

    @property
    def threads(self) -> int:
        """How many cases are checked at the same time."""
        return max(self.workers.threads, 1) if self.workers else self.jobs

    @contextmanager
    def swept(
        self, mission: "Mission", cases: "Cases", columns: Sequence[str], model: str | None, today: date
    ) -> "Iterator[Swept]":
        """Give the sweep when all its parts are kept, and take them away when the table is written.

        What ends it before leaves the parts, and says how to go on.
        """
        from bisar_budget.cluster.parts_folder import PartsFolder, manifest_of
        from bisar_budget.design.cases import words_of
        from bisar_budget.design.sweep import Asked
        from bisar_budget.faults import SetValue
        from bisar_budget.mission.named import named_by

        words = [SetValue(one.key, word) for one, words in words_of(cases) for word in words]
        mission, named = named_by(mission, words)
        sent = named if self.workers else None  # processes here read the files themselves
        asked = Asked(mission, cases, columns=columns, model=model, today=today, named=sent)
        chunks = asked.chunks()
        manifest = manifest_of(asked, chunks, named)
        with PartsFolder(f"{self.output}.parts", manifest, is_resumed=self.is_resumed) as folder:
            try:
                if self.is_resumed:
                    folder.find(chunks.starts, chunks.stop)
                    if folder.done:
                        complain(f"{folder.path} has {len(folder.done)} of {len(chunks.starts)} parts.")
                with progress_bar(cases.count, "Checking cases") as bar:
                    bar.update(sum(chunks.stop(start) - start for start in folder.done))
                    left = [start for start in chunks.starts if start not in folder.done]
                    self._find(asked, chunks, left, folder, bar.update)
                yield asked.swept(folder.parts(chunks.starts))
            except BaseException:
                dated = f" --date {today}" if manifest["date"] else ""
                complain(
                    f"{folder.path} keeps {len(folder.done)} of {len(chunks.starts)} parts; the same command with "
                    f"--resume{dated} goes on from there."
                )
                raise
            folder.remove()

    def _find(
        self,
        asked: "Asked",
        chunks: "Chunks",
        left: Sequence[int],
        folder: "PartsFolder",
        progress: Callable[[int], None],
    ) -> None:
        """Check the chunks that are left, and keep each when it is done."""
        if self.workers is None:
            for part in asked.shared_out(chunks, left, self.jobs):
                folder.put(part)
                progress(part.stop - part.start)
            return
        for start, data in self.workers.shared_out(asked, chunks, left, folder.mark):
            folder.put_encoded(start, data)
            progress(chunks.stop(start) - start)


@contextmanager
def keeping(output: str | None, scheduler: str | None, is_resumed: bool, jobs: int) -> Iterator[Keeping | None]:
    """Say how parts are kept, with the workers of a scheduler at hand; None where nobody asks for that."""
    if scheduler is None and not is_resumed:
        yield None
        return
    if output is None or output == "-":
        raise click.UsageError("--scheduler and --resume need -o FILE: parts are kept in FILE.parts.")
    from bisar_budget.cluster.parts_folder import check_library
    from bisar_budget.cluster.scheduler import connected

    if scheduler is None:
        check_library()
        yield Keeping(output, is_resumed, jobs)
        return
    with connected(scheduler, complain) as workers:
        yield Keeping(output, is_resumed, jobs, workers)
