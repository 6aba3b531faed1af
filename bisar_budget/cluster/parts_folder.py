"""Storage of the finished parts of a sweep as a Parquet data set, with one file for each block of cases.

A data set belongs to one question, that is the set of all inputs that determine its values. The question is stored in
the metadata of each file. A file is written under a temporary name and then renamed, so that every stored part is
complete. Values are stored as the engine computes them, in SI units. At the end of the sweep, the command builds its
table from the parts.
"""

import json
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from importlib import import_module

from bisar_budget.extras import install_command
from bisar_budget.faults import ClusterError
from bisar_budget.findings.case_table import Chunks, Part
from bisar_budget.memory import hold_room
from bisar_budget.resources import locked

Question = Mapping[str, str]
_PART_NAME = re.compile(r"part-\d{12}\.parquet", re.ASCII)


def check_libraries(option: str, room: int, extra: str, *modules: str) -> None:
    """Check that the libraries that an option needs are installed, and that there is enough memory for them.

    `option` is the name of the option, for messages. `room` is the memory that the libraries need [B]. `extra` is the
    extra of the package `bisar-budget` that installs the libraries. `modules` are the modules to import. Raises
    `MemoryError` if there is not enough memory, and `ClusterError` if a module is missing.
    """
    hold_room(room, option)
    try:
        for module in modules:
            import_module(module)
    except ImportError as error:
        problem = f"{option} needs {error.name}, which is not installed; {install_command(extra)} brings it"
        raise ClusterError(problem) from None


@contextmanager
def parts_folder(path: str, question: Question, chunks: Chunks, *, is_resumed: bool) -> "Iterator[PartsFolder]":
    """Open a folder with the finished parts of a sweep, and lock it so that no other command uses it.

    If `is_resumed` is true, the command continues from the parts in the folder. Otherwise the folder must have no
    parts. `question` identifies the inputs of the sweep. Raises `ClusterError` if there are parts although
    `is_resumed` is false, if the parts belong to another question, if the folder cannot be written, or if another
    command uses it.
    """
    with ExitStack() as ends:
        try:
            os.makedirs(path, exist_ok=True)
            if (lock := locked(os.path.realpath(path))) is not None:
                ends.callback(os.close, lock)
                for name in os.listdir(path):
                    if name.startswith(".part-"):  # left by a command that was killed
                        os.unlink(os.path.join(path, name))
            folder = PartsFolder(path, question)
            folder.find(chunks, is_resumed)
        except BlockingIOError:
            raise ClusterError(f"another command works on {path}; accepted: wait for it, or another output") from None
        except OSError as error:
            raise ClusterError(f"cannot write {path}: {error.strerror or error}") from None
        yield folder


class PartsFolder:
    """Folder with the finished parts of a sweep.

    A part holds the values of a block of cases. `question` identifies the inputs of the sweep, see `question_of`.
    `done` contains the index of the first case of each finished part.
    """

    def __init__(self, path: str, question: Question) -> None:
        self.path, self.question, self.done = path, question, set[int]()

    def find(self, chunks: Chunks, is_resumed: bool) -> None:
        """Find the finished parts that belong to the question, and record them in `done`.

        The question is the set of inputs of the sweep. Raises `ClusterError` if there are parts although `is_resumed`
        is false, or if all parts found belong to another question.
        """
        import pyarrow as pa
        import pyarrow.parquet as pq

        other_question: Question | None = None
        for name in filter(_PART_NAME.fullmatch, os.listdir(self.path)):
            if not is_resumed:
                raise ClusterError(
                    f"{self.path} has parts of a sweep that was not finished; accepted: --resume to go on from them, "
                    "or remove the folder"
                )
            start = int(name[5:17])
            # Opening a pipe would block, and reading a device would never end.
            if start in self.done or not os.path.isfile(self._file(start)):
                continue
            # A part may be damaged if the machine stopped before the data reached the disk.
            with suppress(OSError, TypeError, ValueError, pa.ArrowException):
                part_metadata = pq.read_metadata(self._file(start))
                entries = part_metadata.metadata or {}
                question = dict(json.loads(entries.get(b"question", b"{}")))
                cases = int(entries.get(b"start", -1)), part_metadata.num_rows
                if question != self.question:
                    other_question = question
                elif start in chunks.starts and cases == (start, chunks.stop(start) - start):
                    self.done.add(start)
        if other_question is not None and not self.done:
            values = (
                (key, other_question.get(key) or "not there", new_value or "not there")
                for key, new_value in self.question.items()
            )
            differences = "; ".join(
                f"{key} {old_value}, and now {new_value}"
                for key, old_value, new_value in values
                if old_value != new_value
            )
            raise ClusterError(f"{self.path} is of another sweep: {differences}")

    def put(self, part: Part) -> None:
        """Write a part to the folder. Raises `ClusterError` if it cannot be written."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        metadata = {"question": json.dumps(self.question), "start": str(part.start)}
        kinds = {name: pa.string() if values.dtype == object else None for name, values in part.values.items()}
        table = pa.table({name: pa.array(values, kinds[name]) for name, values in part.values.items()})
        temporary = os.path.join(self.path, f".part-{os.getpid()}")
        try:
            with open(temporary, "wb") as file:
                pq.write_table(table.replace_schema_metadata(metadata), file, write_page_checksum=True)
            os.replace(temporary, self._file(part.start))
        except OSError as error:
            raise ClusterError(f"cannot write {self.path}: {error.strerror or error}") from None
        finally:
            with suppress(OSError):
                os.unlink(temporary)
        self.done.add(part.start)

    def parts(self, starts: Iterable[int]) -> Iterator[Part]:
        """Read the parts that begin at the cases `starts`, and yield them in this order.

        Raises `ClusterError` if a part cannot be read. A part with damaged content is removed first.
        """
        import pyarrow as pa
        import pyarrow.parquet as pq

        for start in starts:
            file = self._file(start)
            try:
                table = pq.ParquetFile(file, page_checksum_verification=True).read(use_threads=False)
                values = {name: table.column(name).to_numpy() for name in table.column_names}
            except (OSError, KeyError, ValueError, pa.ArrowException) as error:
                if getattr(error, "errno", None) is None:  # the content is damaged; the system reported no error
                    self.done.discard(start)
                    with suppress(OSError):
                        os.unlink(file)
                problem = f"{file} cannot be read: {error}; the same command with --resume goes on"
                raise ClusterError(problem) from None
            yield Part(start, start + table.num_rows, values)

    def remove(self) -> None:
        """Remove all parts, and the folder if it is then empty."""
        with suppress(OSError):
            for name in os.listdir(self.path):
                if name.startswith(("part-", ".part-")):
                    os.unlink(os.path.join(self.path, name))
            os.rmdir(self.path)

    def _file(self, start: int) -> str:
        return os.path.join(self.path, f"part-{start:012d}.parquet")
