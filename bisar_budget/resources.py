"""Resources of a command: bundled files, files of the user, and the number of processors."""

import os
import stat
import sys
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, BinaryIO, Protocol

if TYPE_CHECKING:
    from pathlib import Path


@cache
def resource(*names: str) -> "Path":
    """Path of a bundled file: inside an installed package, or at the top level of a checkout."""
    from pathlib import Path  # a check does not need it

    package = Path(__file__).resolve().parent
    installed = package.joinpath(*names)
    return installed if installed.exists() else package.parent.joinpath(*names)


# Device and inode of the files that were read since a command began: no result may replace such a file.
FILES_READ: set[tuple[int, int]] = set()


class FilesHeld:
    """Contents of the files that a command reads, kept as first read, so that all outputs use the same contents.

    Contents are kept up to a total of 64 MB. Beyond that, only a hash of each further file is kept. If such a file
    has changed when it is read again, an error is raised.
    """

    def __init__(self) -> None:
        self.known: dict[tuple[str, int], bytes | UnreadableError] = {}
        self.hashes: dict[tuple[str, int], bytes] = {}
        self.room = _MAX_HELD_BYTES

    def content(self, file: str, most: int, read: Callable[[], bytes]) -> bytes:
        """Content of a file as first read, at most `most` + 1 bytes.

        `read` is called if the file was not read before, or if only its hash was kept.
        """
        key = (file if file == "-" else os.path.normpath(file), most)
        held_content = self.known.get(key)
        if isinstance(held_content, bytes):
            return held_content
        if held_content is not None:
            raise held_content
        try:
            data = read()
        except UnreadableError as error:
            self.known[key] = error
            raise
        if len(data) <= self.room and key not in self.hashes:
            self.room -= len(data)
            self.known[key] = data
            return data
        from hashlib import sha256

        digest = sha256(data).digest()
        if self.hashes.setdefault(key, digest) != digest:
            raise UnreadableError(f"{file} changed while this command was reading it")
        return data


_MAX_HELD_BYTES = 64 << 20
_held: FilesHeld | None = None  # None outside of a command: a caller of functions reads the current files


def hold_files() -> None:
    """Begin to keep the content of each file that is read, for the duration of a command.

    Contents that were kept for an earlier command are discarded.
    """
    global _held
    FILES_READ.clear()
    _held = FilesHeld()


def release_files() -> None:
    """Discard the file contents kept for a command. This is called when the command ends.

    Afterwards, each file is read with its current content.
    """
    global _held
    _held = None


def held(file: str, most: int, read: Callable[[], bytes]) -> bytes:
    """Content of a file as this command first read it; see `FilesHeld.content`.

    Outside a command, `read` is called and its result is returned.
    """
    return read() if _held is None else _held.content(file, most, read)


_STREAMS = (
    "/dev/fd/",
    "/proc/self/fd/",
    "/dev/stdin",
    "/dev/stdout",
    "/dev/stderr",
    "/dev/tty",
    "/dev/null",
    "/dev/full",
)


def special_file(path: str) -> str:
    """Kind of a special file, such as `a named pipe`; empty for an ordinary file.

    Reading a special file may block or never end. Streams that are already open in this process, such as `<(…)` in a
    shell, do not count as special files.
    """
    if os.path.abspath(path).startswith(_STREAMS):
        return ""
    try:
        mode = os.stat(path).st_mode
    except (OSError, ValueError):
        return ""
    if stat.S_ISFIFO(mode):
        return "a named pipe"
    if stat.S_ISSOCK(mode):
        return "a socket"
    return "a device" if stat.S_ISCHR(mode) or stat.S_ISBLK(mode) else ""


class UnreadableError(Exception):
    """A file cannot be read. The message begins with the file name; `is_missing` is true if there is no such file."""

    def __init__(self, message: str, *, is_missing: bool = False) -> None:
        super().__init__(message)
        self.is_missing = is_missing


def _read(file: str, most: int, called: str) -> bytes:
    try:
        status = os.stat(file)
        if not stat.S_ISREG(status.st_mode):
            raise UnreadableError(f"{called} is no regular file")
        with open(file, "rb") as stream:
            FILES_READ.add((status.st_dev, status.st_ino))
            return stream.read(most + 1)
    except OSError as error:
        is_missing = isinstance(error, FileNotFoundError | NotADirectoryError)
        raise UnreadableError(f"{called} cannot be read: {error.strerror}", is_missing=is_missing) from None
    except ValueError:  # a NUL in the name
        raise UnreadableError("is no name of a file") from None


def standard_input() -> BinaryIO:
    """Binary stream of standard input; raises `ValueError` if there is none."""
    if sys.stdin is None:
        raise ValueError("standard input is closed")
    return sys.stdin.buffer


class Files(Protocol):
    """Source of the files of a project: the disk, or a git revision (`mission.revision`)."""

    def content(self, file: str, most: int, called: str | None = None) -> bytes:
        """Content of a regular file. If the file is larger than `most`, only the first `most` + 1 bytes are returned.

        Parameters
        ----------
        file : str
            Path of the file.
        most : int
            Largest accepted size in bytes. The caller must reject a larger file.
        called : str, optional
            Name of the file in messages, if it differs from `file`.

        Raises
        ------
        UnreadableError
            The file cannot be read, or is not a regular file. Reading a pipe could block, and reading a device could
            go on for ever.
        """

    def names(self, folder: str) -> list[str]:
        """Return the sorted names of the files in a folder. Raises `OSError` if the folder cannot be listed."""


class Disk:
    """The files on the disk. While a command runs, each file keeps the content with which it was first read."""

    @staticmethod
    def content(file: str, most: int, called: str | None = None) -> bytes:
        """Content of a file; see `Files.content`."""
        return held(file, most, lambda: _read(file, most, file if called is None else called))

    @staticmethod
    def names(folder: str) -> list[str]:
        """Names of the files in a folder; see `Files.names`."""
        return sorted(os.listdir(folder))


DISK = Disk()


def locked(folder: str) -> int | None:
    """Lock a folder for this process. The lock is held until the returned descriptor is closed or the process ends.

    Returns None if the operating system or the file system does not support locks.

    Raises
    ------
    BlockingIOError
        Another process holds the lock.
    OSError
        The folder does not exist, or the user may not open it.
    """
    try:
        import fcntl
    except ImportError:  # Windows
        return None
    opened = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        fcntl.flock(opened, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        os.close(opened)
        if isinstance(error, BlockingIOError):
            raise
        return None  # a file system without locks
    return opened


def cores() -> int:
    """Number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def docstring(documented: Callable[..., object] | None) -> str:
    """Docstring of a top-level class or function of a module.

    If Python has removed it (-OO), it is read from the source.
    """
    if sys.flags.optimize < 2:
        return documented.__doc__ or ""
    if documented is None:
        return ""
    import ast
    from inspect import getsourcefile

    with open(getsourcefile(documented) or "", encoding="utf-8") as source:
        for node in ast.parse(source.read()).body:
            if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name == documented.__name__:
                return ast.get_docstring(node) or ""
    return ""
