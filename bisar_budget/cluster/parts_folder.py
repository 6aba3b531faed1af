"""Parts of a sweep that are done: a folder with one Parquet file for each chunk and a manifest of what they are of.

Each file is written beside its name and renamed, so that what is there is whole. Values are those of the engine, in
SI: what is asked for is written from them in the end, as from parts that come from processes.
"""

import io
import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from hashlib import sha256
from typing import Any

import numpy as np

from bisar_budget import __version__
from bisar_budget.design.cases import Cases, CaseTable, Grid
from bisar_budget.design.sweep import Asked, Chunks
from bisar_budget.design.swept import Part, Values
from bisar_budget.faults import changes_words
from bisar_budget.memory import OF_TABLES, hold_room
from bisar_budget.mission.named import Named
from bisar_budget.resources import UnreadableError, content, locked

FORMAT = "bisar-budget/sweep-parts/1"
_MANIFEST = "manifest.json"
_LARGEST_MANIFEST = 16 << 20  # bytes; names of rows and keys take a hundredth
_WORDS = {
    "format": "the form of the parts",
    "version": "the version of bisar-budget",
    "mission_sha256": "the hash of the mission file",
    "named_sha256": "the hash of what the mission names",
    "set": "--set",
    "model": "the model that decides",
    "date": "--date",
    "cases": "the cases",
    "chunks": "the size of the parts",
    "columns": "the columns",
}


class PartsError(Exception):
    """A folder of parts that cannot be used; the message says why, and what can be done."""


def check_library() -> None:
    """Raise a `PartsError` where parts cannot be written, a `MemoryError` where there is no room for that."""
    hold_room(OF_TABLES, "--resume")
    try:
        import pyarrow  # noqa: F401
    except ImportError:
        raise PartsError(
            "--resume needs pyarrow, which is not installed; pip install 'bisar-budget[tables]' brings it"
        ) from None


def manifest_of(asked: Asked, chunks: Chunks, named: Named) -> dict[str, Any]:
    """Say what decides the values of the parts: parts of equal manifests can be mixed."""
    question, mission = asked.question, asked.engine.mission
    swept = asked.swept(iter(()))
    return {
        "format": FORMAT,
        "version": __version__,
        "mission": swept.mission_name,
        "mission_sha256": swept.mission_sha256,
        "named_sha256": named.sha256,
        "set": changes_words(question.changes),
        "model": mission.gating_model,
        "date": question.today.isoformat() if mission.waivers else "",  # the day decides about waivers alone
        "cases": {"count": asked.cases.count, "keys": list(swept.varied), "sha256": _hash_of(asked.cases)},
        "chunks": chunks.size,
        "columns": [
            {"name": column.name, "unit": column.unit, "description": column.words} for column in swept.columns
        ],
    }


def _hash_of(cases: Cases) -> str:
    """SHA-256 of what the cases are made from: the values of each key."""
    whole = sha256(repr((type(cases).__name__, cases.shape, cases.count)).encode())
    for values in cases.axes if isinstance(cases, Grid) else cases.columns if isinstance(cases, CaseTable) else ():
        if values.dtype == object:  # words
            whole.update(json.dumps(values.tolist()).encode())
        else:
            whole.update(np.ascontiguousarray(values, "<f8").tobytes())
    return whole.hexdigest()


def mark_of(manifest: Mapping[str, Any]) -> str:
    """What a file says to be one of a manifest."""
    return sha256(json.dumps(manifest, sort_keys=True).encode()).hexdigest()


def encoded(part: Part, mark: str) -> bytes:
    """Write a part as Parquet; texts as dictionaries, NaN as it is."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    arrays = [
        pa.array(values, pa.string()).dictionary_encode() if values.dtype == object else pa.array(values)
        for values in part.values.values()
    ]
    said = {"sweep": mark, "start": str(part.start), "stop": str(part.stop), "by_case": str(part.by_case)}
    table = pa.Table.from_arrays(arrays, names=list(part.values)).replace_schema_metadata(said)
    buffer = io.BytesIO()
    pq.write_table(table, buffer, write_page_checksum=True)
    return buffer.getvalue()


class PartsFolder:
    """The parts of one sweep; `done` are the first cases of those that are there. One command at a time has it.

    Parameters
    ----------
    path : str
        The folder.
    manifest : dict
        What its parts are of.
    is_resumed : bool
        Go on from what is there; else nothing may be there.

    Raises
    ------
    PartsError
        Parts are there and should not be, or are of another sweep; the folder cannot be written, or another command
        has it.
    """

    def __init__(self, path: str, manifest: Mapping[str, Any], *, is_resumed: bool) -> None:
        self.path, self.mark, self.done = path, mark_of(manifest), set[int]()
        try:
            os.makedirs(path, exist_ok=True)
            self._lock = locked(os.path.realpath(path))
        except BlockingIOError:
            raise PartsError(f"another command works on {path}; accepted: wait for it, or another output") from None
        except OSError as error:
            raise PartsError(f"cannot write {path}: {error.strerror or error}") from None
        try:
            self._begin(manifest, is_resumed)
        except OSError as error:
            self.close()
            raise PartsError(f"cannot write {path}: {error.strerror or error}") from None
        except BaseException:
            self.close()
            raise

    def _begin(self, manifest: Mapping[str, Any], is_resumed: bool) -> None:
        """Hold what is there to the manifest, or write it; remove what a command that was killed was writing."""
        if self._lock is not None:
            for name in os.listdir(self.path):
                if name.startswith((".part-", f".{_MANIFEST}.")):
                    os.unlink(self._file(name))
        there = self._manifest()
        if there is not None and not is_resumed:
            raise PartsError(
                f"{self.path} has parts of a sweep that was not finished; accepted: --resume to go on from them, "
                "or remove the folder"
            )
        if there is not None and mark_of(there) != self.mark:
            raise PartsError(f"{self.path} is of another sweep: {_differences(there, manifest)}")
        if there is None:
            self._write(_MANIFEST, (json.dumps(manifest, indent=2) + "\n").encode())

    def __enter__(self) -> "PartsFolder":
        """Keep the folder to this command."""
        return self

    def __exit__(self, *_: object) -> None:
        """Let another command have it."""
        self.close()

    def close(self) -> None:
        """Let another command have the folder."""
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def _manifest(self) -> dict[str, Any] | None:
        try:
            found = json.loads(content(self._file(_MANIFEST), _LARGEST_MANIFEST))
        except UnreadableError as error:
            if error.is_missing:
                return None
            found = None
        except (ValueError, RecursionError):
            found = None
        if not isinstance(found, dict):
            raise PartsError(f"{self._file(_MANIFEST)} is no manifest of parts; accepted: remove the folder")
        return found

    def find(self, starts: Iterable[int], stop: Callable[[int], int]) -> None:
        """Look which parts are there, whole and of this sweep."""
        for start in starts:
            if self._is_there(start, stop(start)):
                self.done.add(start)

    def _is_there(self, start: int, stop: int) -> bool:
        import pyarrow as pa
        import pyarrow.parquet as pq

        if not os.path.isfile(self._file(_name(start))):  # a pipe would be waited for, and a device never ends
            return False
        try:
            found = pq.read_metadata(self._file(_name(start)))
        except (OSError, pa.ArrowException):  # there is none, or a machine stopped before its disk had it
            return False
        said = found.metadata or {}
        wanted = {b"sweep": self.mark, b"start": str(start), b"stop": str(stop)}
        is_of_this = all(said.get(name) == value.encode() for name, value in wanted.items())
        return is_of_this and found.num_rows == stop - start

    def put(self, part: Part) -> None:
        """Keep a part; a `PartsError` says that it cannot be written."""
        self.put_encoded(part.start, encoded(part, self.mark))

    def put_encoded(self, start: int, data: bytes) -> None:
        """Keep the part that begins at a case, as `encoded` writes it."""
        try:
            self._write(_name(start), data)
        except OSError as error:
            raise PartsError(f"cannot write {self.path}: {error.strerror or error}") from None
        self.done.add(start)

    def _write(self, name: str, data: bytes) -> None:
        temporary = self._file(f".{name}.{os.getpid()}")
        try:
            with open(temporary, "wb") as file:
                file.write(data)
            os.replace(temporary, self._file(name))
        except BaseException:
            with suppress(OSError):
                os.unlink(temporary)
            raise

    def parts(self, starts: Iterable[int]) -> Iterator[Part]:
        """Read parts in this order.

        Raises
        ------
        PartsError
            One cannot be read.
        """
        import pyarrow as pa
        import pyarrow.parquet as pq

        for start in starts:
            file = self._file(_name(start))
            try:
                table = pq.ParquetFile(file, page_checksum_verification=True).read(use_threads=False)
            except (OSError, pa.ArrowException) as error:
                raise PartsError(f"{file} cannot be read: {error}; the same command with --resume goes on") from None
            said = table.schema.metadata
            values = {name: _values(table.column(name)) for name in table.column_names}
            yield Part(int(said[b"start"]), int(said[b"stop"]), values, int(said[b"by_case"]))

    def remove(self) -> None:
        """Take away what is done with; what else somebody put there stays."""
        with suppress(OSError):
            for name in os.listdir(self.path):
                if name == _MANIFEST or name.startswith(("part-", ".part-")):
                    os.unlink(self._file(name))
            os.rmdir(self.path)

    def _file(self, name: str) -> str:
        return os.path.join(self.path, name)


def _name(start: int) -> str:
    return f"part-{start:012d}.parquet"


def _values(column: Any) -> Values:
    column = column.combine_chunks()
    if not hasattr(column, "dictionary"):
        found: Values = column.to_numpy()
        return found
    words = np.array([*column.dictionary.to_pylist(), ""], object)[:-1]  # texts alone would be made a str array
    texts: Values = words[column.indices.to_numpy()]
    return texts


def _differences(there: Mapping[str, Any], here: Mapping[str, Any]) -> str:
    said = []
    for name, words in _WORDS.items():
        if there.get(name) == here[name]:
            continue
        old, new = (_shown(name, manifest.get(name)) for manifest in (there, here))
        if old == new:  # of cases and columns not everything is said
            said.append(f"{words} are others of the same names")
        else:
            said.append(f"{words} {'were' if name in ('cases', 'columns') else 'was'} {old}, and now {new}")
    return "; ".join(said) or "its manifest is another"


def _shown(name: str, value: Any) -> str:
    if not value:
        return "not there"
    if name.endswith("sha256"):
        return f"{value[:12]}..."
    if name == "cases" and isinstance(value, dict):
        return f"{value.get('count')} of {', '.join(map(str, value.get('keys', ())))}"
    if name == "columns" and isinstance(value, list):
        return ", ".join(str(column.get("name")) for column in value if isinstance(column, dict))
    return str(value)
