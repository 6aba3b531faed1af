"""Input and output of the commands: file names, standard streams, safe replacement of files, and exit codes."""

import io
import os
import re
import shutil
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from typing import TYPE_CHECKING, NoReturn

import click

from bisar_budget.faults import MissionError, printable
from bisar_budget.resources import FILES_READ, locked, special_file

if TYPE_CHECKING:
    from bisar_budget.faults import Fault, SetValue
    from bisar_budget.mission.model import Mission

MISSION_SUFFIXES = (".yaml", ".yml")
PICTURE_SUFFIXES = (".svg", ".png", ".pdf")
BINARY_FORMATS = ("xlsx",)  # formats that no terminal shows
_TEMPORARY = (".bisar-budget.", ".tmp")  # prefix and suffix of the name of a temporary folder
BROKEN_EXIT_CODE, USAGE_EXIT_CODE, DEFECT_EXIT_CODE, INTERRUPTED_EXIT_CODE = 1, 2, 3, 130


def expand(patterns: Iterable[str]) -> list[str]:
    """Expand glob patterns that the shell did not expand.

    A pattern without a match is returned as it is, and causes an error when it is loaded as a file. A file whose name
    is the pattern itself is added to the matches, so that a file named `*.yaml` is found too.
    """
    files: list[str] = []
    for pattern in patterns:
        if not pattern:
            raise click.UsageError("the name of a file is empty.")
        if any(char in pattern for char in "*?["):
            from glob import glob

            namesake = [pattern] if os.path.exists(pattern) else []
            files += sorted({*glob(pattern, recursive=True), *namesake}) or [pattern]
        else:
            files.append(pattern)
    return list(dict.fromkeys(files))


def load_all(files: Sequence[str], model: str | None = None, changes: "Sequence[SetValue]" = ()) -> "list[Mission]":
    """Load mission files and apply `changes` to them; if a mission is unusable, write all faults and exit."""
    from bisar_budget.mission.load import load_mission

    return read_all(partial(load_mission, file, model, changes) for file in files)


def read_all(reads: "Iterable[Callable[[], Mission]]") -> "list[Mission]":
    """Call functions that each read a mission, and return the missions.

    If a mission is unusable, the faults of all missions are written, and the command exits.
    """
    found, is_usable = [], True
    for read in reads:
        try:
            found.append(read())
        except MissionError as error:
            is_usable = False
            say_faults(error.file, error.faults)
    if not is_usable:
        sys.exit(USAGE_EXIT_CODE)
    return found


def say_faults(file: str, faults: "tuple[Fault, ...]") -> None:
    """Write the faults of a file to standard error, one line for each fault."""
    for line in MissionError(file, faults).lines():
        complain(line)


def suffix_of(name: str | None, suffixes: Sequence[str]) -> str:
    """Suffix of a file name in lower case; empty if the name is None.

    Raises `click.UsageError` if the suffix is not in `suffixes`.
    """
    suffix = os.path.splitext(name or "")[1].lower()
    if name is not None and suffix not in suffixes:
        raise click.UsageError(f"{name}: the suffix must be one of {', '.join(suffixes)}")
    return suffix


def spare(files: Sequence[str], targets: Iterable[str | None], folders: Iterable[str] = ()) -> None:
    """End the command if an output would replace an input file, or if two outputs would be the same file.

    `files` are the input files, and `targets` the output files. Files to which standard input or standard output is
    redirected are checked too. The command also ends if an input or output file is in one of `folders`, the folders
    for the pictures of reports.
    """
    written: dict[str, str] = {}
    for target in [*targets, *folders]:
        if target is None or target == "-":
            continue
        real_path = _real_path(target)
        if real_path in written:
            fail(f"two outputs would be written to one file: {written[real_path]} and {target}")
        written[real_path] = target
    inside = tuple((os.path.join(_real_path(folder), ""), folder) for folder in folders)
    for real_path, name in [*written.items(), *((_real_path(file), file) for file in files if inside)]:
        for start, folder in inside:
            if real_path.startswith(start):
                fail(f"{name} is in the folder of a report's pictures, {folder}")
    for file in files:
        for real_path, target in written.items():
            if _is_open_as(0 if file == "-" else file, real_path):
                fail(f"{target} is to be read; a result would replace it")
        if file != "-" and _is_open_as(1, file):
            fail(f"{file} is to be read; standard output goes to it")


def _real_path(path: str) -> str:
    """Return the absolute path without symbolic links; if it cannot be determined, end the command with an error."""
    try:
        return os.path.realpath(path)
    except (OSError, ValueError) as error:  # the working folder was deleted, or the name has a NUL
        fail(f"cannot write {path}: {getattr(error, 'strerror', None) or error}")


def _is_open_as(file: str | int, path: str) -> bool:
    """Whether `file`, which is a path or the descriptor of an open stream, is the same regular file as `path`."""
    try:
        return os.path.isfile(file) and os.path.samestat(os.stat(file), os.stat(path))
    except (OSError, ValueError):  # one of the files is missing
        return False


def root_of_names() -> tuple[str, bool]:
    """Return the folder to which the paths in reports are relative, for files outside any Git repository.

    Returns two values: the path of the folder, and whether the folder is the checkout of a GitHub Actions run.
    Outside such a run, it is the current folder. The path is empty if the current folder was removed.
    """
    try:
        here = os.getcwd()
    except OSError:  # the current folder was removed
        return "", False
    checkout = os.environ.get("GITHUB_WORKSPACE")
    return os.path.realpath(checkout or here), bool(checkout)


def is_terminal() -> bool:
    """Whether standard output and standard error are both terminals."""
    return all(stream is not None and stream.isatty() for stream in (sys.stdout, sys.stderr))


def wants_color() -> bool:
    """Whether standard output is a terminal that shows colours, and the environment variable NO_COLOR is not set."""
    return (
        sys.stdout is not None
        and sys.stdout.isatty()
        and not os.environ.get("NO_COLOR")
        and os.environ.get("TERM") != "dumb"
    )


_TABLE_WIDTHS = (80, 100)  # columns of the narrowest and of the widest table


def table_width() -> int:
    """Width of a table on standard output, in characters.

    It is the width of the terminal, but at least 80 and at most 100. The environment variable COLUMNS replaces the
    width of the terminal. The default is 80.
    """
    least, most = _TABLE_WIDTHS
    return min(max(shutil.get_terminal_size((least, 24)).columns, least), most)


# Characters that change a terminal: controls except tabs and line ends, marks without width, and marks of the reading
# direction.
_ACTIVE = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200b-\u200f\u2028-\u202e\u2066-\u2069\ufeff]")
_COLOR = re.compile(r"\x1b\[[0-9;]*m")
# Texts that a CI runner takes for commands: `::error` at the start of a line, `##[group]` and `##vso[...]` anywhere.
_COMMAND = re.compile(r"(?m)^([^\S\n]*):(?=:)")
_COMMAND_WITHIN = re.compile(r"(?<=#)#(?=[\w.]*\[)")
# Escapes that the readers of a format decode to the character. In other formats the escape itself is visible.
_ESCAPES = dict.fromkeys(("json", "sarif", "needs", "yaml"), "\\u{:04x}")
_ESCAPES |= dict.fromkeys(("html", "markdown", "junit", "mathml"), "&#{};")
_ESCAPES["ics"] = "\\\\x{:02x}"
_LINE_ENDS = {"ics": "\r\n"}  # RFC 5545; lines of other formats end with a line feed


def harmless(text: str, format_name: str = "") -> str:
    """Escape characters of a string that would control a terminal, or a CI runner that reads the log.

    In the format `github`, workflow commands are kept. In the format `text`, the colour codes of a report are kept.
    In messages, which have no format name, both are escaped.
    """

    def escaped(match: re.Match[str]) -> str:
        is_color = format_name == "text" and _COLOR.match(text, match.start())
        return match[0] if is_color else match[0].encode("unicode_escape").decode("ascii")

    text = _ACTIVE.sub(escaped, text)
    escape = _ESCAPES.get(format_name, "\\x{:02x}").format
    if "##" in text:
        text = _COMMAND_WITHIN.sub(lambda match: escape(ord("#")), text)
    if "::" in text and format_name != "github":
        text = _COMMAND.sub(lambda match: match[1] + escape(ord(":")), text)
    return text


def deliver_parts(texts: Iterable[str], format_name: str) -> None:
    """Write strings to standard output, one after another.

    If the program that reads the output has closed the pipe, the remaining strings are dropped without an error. In
    the format `text`, characters that the encoding of the terminal lacks are escaped. Other formats are always
    written in UTF-8.
    """
    if sys.stdout is None:
        fail("cannot write: standard output is closed")
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
        if format_name != "text":
            newline = _LINE_ENDS.get(format_name, "\n")
            sys.stdout.reconfigure(encoding="utf-8", errors="backslashreplace", newline=newline)
    for text in texts:
        try:
            sys.stdout.write(harmless(text, format_name))
            sys.stdout.flush()
        except OSError as error:
            drop_output()
            if not isinstance(error, BrokenPipeError):
                fail(f"cannot write standard output: {error.strerror}")
            return


def drop_output() -> None:
    """Discard all further standard output, so that Python does not report a failed write once more when it exits."""
    with suppress(OSError, ValueError, AttributeError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def complain(message: str) -> None:
    """Write a message to standard error, ignoring any failure to write it."""
    with suppress(OSError):
        click.echo(harmless(message), err=True)


def fail(message: str) -> NoReturn:
    """Write an error message to standard error, and exit with code 2."""
    complain(f"Error: {printable(message)}")
    sys.exit(USAGE_EXIT_CODE)


def deliver(text: str, output: str | None = None, format_name: str = "text") -> None:
    """Write a string to the file `output`, or to standard output if `output` is None or `-`."""
    if output is None or output == "-":
        deliver_parts([text], format_name)
    else:
        write_file(output, harmless(text, format_name).replace("\n", _LINE_ENDS.get(format_name, "\n")))


def deliver_answer(command: str, answers: "Sequence[object]", format_name: str | None, output: str | None) -> None:
    """Write the answers of a command, one for each mission, to a file or to standard output.

    The file is `output`; standard output is used if it is None or `-`. If `format_name` is None, the format follows
    from the suffix of `output`, and it is `text` if there is no suffix.
    """
    from bisar_budget.extras import MissingExtraError
    from bisar_budget.report import Style
    from bisar_budget.report.answers import files

    is_file = output is not None and output != "-"
    format_name = format_name or _format_of_output(command, output)
    if format_name in BINARY_FORMATS and not is_file:
        raise click.UsageError(f"--format {format_name} needs -o FILE.")
    root, is_checkout = root_of_names()
    style = Style(root=root, is_checkout=is_checkout)
    if not is_file:
        style = style._replace(color=wants_color(), table_width=table_width())
    try:
        contents = files(command, format_name, answers, style, output if output is not None and is_file else "")
    except MissingExtraError as error:
        fail(str(error))
    for path, content in contents.items():
        if isinstance(content, bytes):
            write_file(path, content)
        else:
            deliver(content, path or None, format_name)


def _format_of_output(command: str, output: str | None) -> str:
    """Return the format that the suffix of an output file implies.

    The format is `text` for a name without a suffix and for standard output. Raises `click.UsageError` if the command
    has no format with this suffix.
    """
    from bisar_budget.report.answers import format_of_file, suffixes

    if output is None or output == "-" or not os.path.splitext(output)[1]:
        return "text"
    format_name = format_of_file(command, output)
    if format_name is None:
        raise click.UsageError(f"{output}: the suffix must be one of {', '.join(suffixes(command))}")
    return format_name


def write_file(path: str, content: str | bytes) -> None:
    """Write content to a file. An existing file is replaced only once writing is complete, see `replacing`."""
    data = content.encode("utf-8", "backslashreplace") if isinstance(content, str) else content
    with replacing(path) as name, open(name, "wb") as file:
        file.write(data)


@contextmanager
def replacing(path: str) -> Iterator[str]:
    """Context manager that yields the path of a temporary file, and finally replaces the file `path` with this file.

    The temporary file is in a temporary folder beside `path`. If `path` is a symbolic link, its target is replaced
    and the link remains. After an error or an interrupt, the old file remains. Named pipes, sockets and devices are
    refused, except for open streams of this process, which are written directly. Temporary folders left behind by
    killed commands are removed.
    """
    temporary = lock = None
    try:
        if kind := special_file(path):
            fail(f"cannot write {path}: {kind}; accepted: a regular file, or - for standard output")
        target = os.path.realpath(path)
        with suppress(OSError):  # refuse a file that was read, such as an orbit, a log or a part
            status = os.stat(target)
            if (status.st_dev, status.st_ino) in FILES_READ:
                fail(f"{path} was read by this command; a result would replace it")
        if os.path.exists(target) and not os.path.isfile(target):
            yield target
            return
        folder = os.path.dirname(target)
        os.makedirs(folder, exist_ok=True)
        _remove_abandoned(folder)
        temporary, lock = _own_folder(folder)
        file = os.path.join(temporary, f"output{os.path.splitext(target)[1]}")
        yield file
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(file, 0o666 & ~mask)  # a library may have set other permissions
        os.replace(file, target)
    except BaseException as error:
        if not isinstance(error, OSError) and not (isinstance(error, ValueError) and temporary is None):  # a NUL
            raise
        number = getattr(error, "errno", None)  # libraries change the message of the system
        fail(f"cannot write {path}: {os.strerror(number) if number else error}")
    finally:
        if temporary is not None:
            with suppress(OSError):
                os.unlink(file)
            with suppress(OSError):  # without listing the folder, since memory may be exhausted
                os.rmdir(temporary)
        if lock is not None:
            os.close(lock)


def _own_folder(folder: str) -> tuple[str, int | None]:
    """Make a temporary folder in `folder`, and lock it so that no other command removes it.

    Returns the path of the temporary folder and the file descriptor of the lock. The descriptor is None if the system
    does not support locks. The lock is released when the process ends.
    """
    import tempfile

    while True:
        temporary = tempfile.mkdtemp(_TEMPORARY[1], _TEMPORARY[0], folder)
        try:
            lock = locked(temporary)
        except (BlockingIOError, FileNotFoundError):  # another command is removing it, since it was not yet locked
            continue
        if os.path.isdir(temporary):
            return temporary, lock
        if lock is not None:
            os.close(lock)


def _remove_abandoned(folder: str) -> None:
    """Remove the unlocked temporary folders in `folder`, which commands have left behind."""
    import shutil

    prefix, suffix = _TEMPORARY
    with os.scandir(folder) as entries:
        paths = [entry.path for entry in entries if entry.name.startswith(prefix) and entry.name.endswith(suffix)]
    for path in paths:
        with suppress(OSError):  # the command still runs, or the folder is gone or belongs to another user
            lock = locked(path)
            if lock is not None:
                shutil.rmtree(path, ignore_errors=True)
                os.close(lock)
