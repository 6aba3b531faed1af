"""Parts of a sweep that are done: a Parquet data set, one file for each block of cases, of one question.

Each file says in its metadata which question it answers, and is written beside its name and renamed: what is there is
whole. Values are those of the engine, in SI; the table that was asked for is written from them in the end.
"""

import json
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from hashlib import sha256
from importlib import import_module

import numpy as np

from bisar_budget import __version__
from bisar_budget.design.cases import Cases
from bisar_budget.design.sweep import Asked, Chunks
from bisar_budget.design.table import Part
from bisar_budget.extras import install_command
from bisar_budget.faults import ClusterError, changes_words
from bisar_budget.memory import hold_room
from bisar_budget.resources import locked

Question = Mapping[str, str]
_NAME = re.compile(r"part-\d{12}\.parquet", re.ASCII)


def check_libraries(option: str, room: int, extra: str, *modules: str) -> None:
    """Refuse an option without its libraries; a `MemoryError` says that there is no room for them. [B]"""
    hold_room(room, option)
    try:
        for module in modules:
            import_module(module)
    except ImportError as error:
        message = f"{option} needs {error.name}, which is not installed; {install_command(extra)} brings it"
        raise ClusterError(message) from None


def question_of(asked: Asked) -> Question:
    """All that decides the values of parts, by the words that a message has for it: equal ones can be mixed."""
    question, swept = asked.travelling, asked.swept(iter(()))
    waives = bool(asked.table.mission.waivers)  # the day decides about waivers alone
    return {
        "the version of bisar-budget was": __version__,
        "the hash of the mission file was": swept.mission_sha256[:16],
        "the hash of what the mission names was": question.named.sha256[:16] if question.named else "",
        "--set was": changes_words(question.changes),
        "the model that decides was": asked.table.mission.gating_model,
        "--date was": question.today.isoformat() if waives else "",
        "the cases were": f"{asked.cases.count} of {', '.join(swept.varied)}",
        "the hash of the values of the cases was": _hash_of(asked.cases)[:16],
        "the size of the parts was": str(asked.chunks.size),
        "the columns were": ", ".join(column.name for column in swept.columns),
    }


def _hash_of(cases: Cases) -> str:
    """SHA-256 of what the cases are made from: the values of each key."""
    whole = sha256(repr((cases.is_grid, cases.shape)).encode())
    for values in cases.columns:
        is_words = values.dtype == object
        whole.update(json.dumps(values.tolist()).encode() if is_words else np.ascontiguousarray(values, "<f8").data)
    return whole.hexdigest()


@contextmanager
def parts_folder(path: str, question: Question, chunks: Chunks, *, is_resumed: bool) -> "Iterator[PartsFolder]":
    """Give a folder to this command alone, to go on from what is there or, where not `is_resumed`, to begin in.

    A `ClusterError` says that parts are there and should not be, or are of another question; that the folder cannot
    be written, or that another command has it.
    """
    with ExitStack() as ends:
        try:
            os.makedirs(path, exist_ok=True)
            if (lock := locked(os.path.realpath(path))) is not None:
                ends.callback(os.close, lock)
                for name in os.listdir(path):
                    if name.startswith(".part-"):  # a command that was killed was writing it
                        os.unlink(os.path.join(path, name))
            folder = PartsFolder(path, question)
            folder.find(chunks, is_resumed)
        except BlockingIOError:
            raise ClusterError(f"another command works on {path}; accepted: wait for it, or another output") from None
        except OSError as error:
            raise ClusterError(f"cannot write {path}: {error.strerror or error}") from None
        yield folder


class PartsFolder:
    """The parts of one question; `done` are the first cases of those that are there and whole."""

    def __init__(self, path: str, question: Question) -> None:
        self.path, self.question, self.done = path, question, set[int]()

    def find(self, chunks: Chunks, is_resumed: bool) -> None:
        """Look which parts are there; refuses those of another question, and all where none should be there."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        other: Question | None = None
        for name in filter(_NAME.fullmatch, os.listdir(self.path)):
            if not is_resumed:
                raise ClusterError(
                    f"{self.path} has parts of a sweep that was not finished; accepted: --resume to go on from them, "
                    "or remove the folder"
                )
            start = int(name[5:17])
            # A pipe would be waited for, and a device never ends.
            if start in self.done or not os.path.isfile(self._file(start)):
                continue
            # A machine stopped, its disk without it.
            with suppress(OSError, TypeError, ValueError, pa.ArrowException):
                found = pq.read_metadata(self._file(start))
                said = found.metadata or {}
                question, of = dict(json.loads(said.get(b"question", b"{}"))), int(said.get(b"start", -1))
                if question != self.question:
                    other = question
                elif start in chunks.starts and (of, found.num_rows) == (start, chunks.stop(start) - start):
                    self.done.add(start)
        if other is not None and not self.done:
            words = ((one, other.get(one) or "not there", new or "not there") for one, new in self.question.items())
            differ = "; ".join(f"{one} {old}, and now {new}" for one, old, new in words if old != new)
            raise ClusterError(f"{self.path} is of another sweep: {differ}")

    def put(self, sweep_part: Part) -> None:
        """Keep a part; a `ClusterError` says that it cannot be written."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        metadata = {"question": json.dumps(self.question), "start": str(sweep_part.start)}
        kinds = {name: pa.string() if values.dtype == object else None for name, values in sweep_part.values.items()}
        table = pa.table({name: pa.array(values, kinds[name]) for name, values in sweep_part.values.items()})
        temporary = os.path.join(self.path, f".part-{os.getpid()}")
        try:
            with open(temporary, "wb") as file:
                pq.write_table(table.replace_schema_metadata(metadata), file, write_page_checksum=True)
            os.replace(temporary, self._file(sweep_part.start))
        except OSError as error:
            raise ClusterError(f"cannot write {self.path}: {error.strerror or error}") from None
        finally:
            with suppress(OSError):
                os.unlink(temporary)
        self.done.add(sweep_part.start)

    def parts(self, starts: Iterable[int]) -> Iterator[Part]:
        """Read parts in this order; a `ClusterError` says that one cannot be read, and then it is not kept."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        for start in starts:
            file = self._file(start)
            try:
                table = pq.ParquetFile(file, page_checksum_verification=True).read(use_threads=False)
                values = {name: table.column(name).to_numpy() for name in table.column_names}
            except (OSError, KeyError, ValueError, pa.ArrowException) as error:
                if getattr(error, "errno", None) is None:  # what it holds is at fault, not the system
                    self.done.discard(start)
                    with suppress(OSError):
                        os.unlink(file)
                message = f"{file} cannot be read: {error}; the same command with --resume goes on"
                raise ClusterError(message) from None
            yield Part(start, start + table.num_rows, values)

    def remove(self) -> None:
        """Take away what is done with; what else somebody put there stays."""
        with suppress(OSError):
            for name in os.listdir(self.path):
                if name.startswith(("part-", ".part-")):
                    os.unlink(os.path.join(self.path, name))
            os.rmdir(self.path)

    def _file(self, start: int) -> str:
        return os.path.join(self.path, f"part-{start:012d}.parquet")
