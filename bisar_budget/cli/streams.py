"""What the commands read and write: names of files, standard streams, files replaced whole, exit codes."""

import os
import sys
from collections.abc import Iterable, Sequence
from contextlib import suppress
from datetime import UTC, date, datetime
from typing import TYPE_CHECKING, Any, NoReturn

import click

from bisar_budget.errors import printable

if TYPE_CHECKING:
    from click import ParamType as ParamType
    from click.shell_completion import CompletionItem

    from bisar_budget.mission.model import Mission
else:

    class ParamType(click.ParamType):
        """Type of a parameter; that of Click before 8.4 takes no type of its values in brackets."""

        def __class_getitem__(cls, values: object) -> type:  # noqa: D105
            return cls


EXIT_BROKEN, EXIT_USAGE, EXIT_OUR_FAULT, EXIT_INTERRUPTED = 1, 2, 3, 130


class FileName(ParamType[str]):
    """Name of a file, which a shell completes; what can be read is seen when it is."""

    name = "file"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Take the text as it is."""
        return str(value)

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> "list[CompletionItem]":
        """Leave it to the shell, which knows the files."""
        from click.shell_completion import CompletionItem

        return [CompletionItem(incomplete, type="file")]


FILE = FileName()


def expand(patterns: Iterable[str]) -> list[str]:
    """Expand the glob patterns that the shell left; a pattern without a match stays and fails to load."""
    files: list[str] = []
    for pattern in patterns:
        if not pattern:
            raise click.UsageError("the name of a file is empty.")
        if pattern != "-" and any(char in pattern for char in "*?[") and not os.path.exists(pattern):
            from glob import glob

            files += sorted(glob(pattern, recursive=True)) or [pattern]
        else:
            files.append(pattern)
    return list(dict.fromkeys(files))


def load_all(files: Sequence[str], model: str | None = None) -> "list[Mission]":
    """Load every mission, or say every fault of every file and exit."""
    from bisar_budget.errors import MissionError
    from bisar_budget.mission.load import load_mission

    loaded, is_usable = [], True
    for file in files:
        try:
            loaded.append(load_mission(file, model))
        except MissionError as error:
            is_usable = False
            for line in error.lines():
                complain(line)
    if not is_usable:
        sys.exit(EXIT_USAGE)
    return loaded


def spare(files: Sequence[str], targets: Iterable[str | None]) -> None:
    """Refuse to write over a mission, standard input's file too, and to write two outputs to one file."""
    written: dict[str, str] = {}
    for target in targets:
        if target is None or target == "-":
            continue
        place = os.path.realpath(target)
        if place in written:
            fail(f"two outputs would be written to one file: {written[place]} and {target}")
        written[place] = target
    for file in files if written else ():
        for place, target in written.items():
            if os.path.realpath(file) == place if file != "-" else _is_standard_input(place):
                fail(f"{target} is a mission file; a report would replace it")


def _is_standard_input(path: str) -> bool:
    try:
        return os.path.isfile(path) and os.path.samestat(os.fstat(0), os.stat(path))
    except OSError:  # either is missing
        return False


def day_of_run() -> date:
    """SOURCE_DATE_EPOCH, else today, UTC."""
    epoch = os.environ.get("SOURCE_DATE_EPOCH")
    if not epoch:
        return datetime.now(UTC).date()
    try:
        if not (epoch.isascii() and epoch.isdigit()):
            raise ValueError
        return datetime.fromtimestamp(int(epoch), UTC).date()
    except (ValueError, OverflowError, OSError):
        raise click.UsageError(f"SOURCE_DATE_EPOCH must be seconds since 1970 (got {printable(epoch)!r})") from None


def is_terminal() -> bool:
    """Whether somebody sees both standard streams."""
    return all(stream is not None and stream.isatty() for stream in (sys.stdout, sys.stderr))


def wants_color() -> bool:
    """Whether standard output is a terminal that shows colour, and nobody objects."""
    return (
        sys.stdout is not None
        and sys.stdout.isatty()
        and not os.environ.get("NO_COLOR")
        and os.environ.get("TERM") != "dumb"
    )


def print_text(text: str) -> None:
    """Write what a person reads to standard output, characters that its encoding lacks escaped."""
    if hasattr(sys.stdout, "reconfigure"):
        sys.stdout.reconfigure(errors="backslashreplace")
    _print(text)


def print_data(text: str) -> None:
    """Write what a program reads to standard output: UTF-8, whatever a terminal would take."""
    if hasattr(sys.stdout, "reconfigure"):
        sys.stdout.reconfigure(encoding="utf-8", errors="backslashreplace", newline="\n")
    _print(text)


def _print(text: str) -> None:
    """Write to standard output; a reader that went away changes no exit code."""
    if sys.stdout is None:
        fail("cannot write: standard output is closed")
    try:
        sys.stdout.write(text)
        sys.stdout.flush()
    except OSError as error:
        drop_output()
        if not isinstance(error, BrokenPipeError):
            fail(f"cannot write standard output: {error.strerror}")


def drop_output() -> None:
    """Send what is left of standard output nowhere: Python would complain of it again at exit."""
    with suppress(OSError, ValueError, AttributeError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def complain(message: str) -> None:
    """Say something on standard error; that nobody listens changes no exit code."""
    with suppress(OSError):
        click.echo(message, err=True)


def fail(message: str) -> NoReturn:
    """Say what is wrong with how the command was used, and exit with 2."""
    complain(f"Error: {printable(message)}")
    sys.exit(EXIT_USAGE)


def deliver(text: str, output: str | None, format_name: str = "text") -> None:
    """Write to a file, else to standard output: for a person in the format `text`, else for a program."""
    if output is None:
        (print_text if format_name == "text" else print_data)(text)
    else:
        write_file(output, text)


def write_file(path: str, content: str | bytes) -> None:
    """Replace a file whole: written beside it under another name, then renamed. `-` is standard output.

    A link keeps pointing where it does; what is no file, a device or a pipe, is written to as it is.
    """
    import tempfile

    if path == "-" and isinstance(content, str):
        print_data(content)
        return
    data = content.encode("utf-8", "backslashreplace") if isinstance(content, str) else content
    target = os.path.realpath(path)
    folder, name = os.path.split(target)
    temporary = None
    try:
        if os.path.exists(target) and not os.path.isfile(target):
            with open(target, "wb") as special:
                special.write(data)
            return
        os.makedirs(folder, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=folder, prefix=f".{name}.", delete=False) as file:
            temporary = file.name
            file.write(data)
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(temporary, 0o666 & ~mask)  # a temporary file is private, a report is not
        os.replace(temporary, target)
    except BaseException as error:
        if temporary is not None:
            with suppress(OSError):
                os.unlink(temporary)
        if not isinstance(error, (OSError, ValueError)):  # ValueError: a NUL in the name
            raise
        fail(f"cannot write {path}: {getattr(error, 'strerror', None) or error}")
