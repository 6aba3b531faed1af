"""Options that commands share, and the origins of their values: command line, environment, a project's settings."""

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from datetime import date, datetime
from typing import TYPE_CHECKING, Any, TypeVar

import click
from click.core import ParameterSource

from bisar_budget.cli.streams import fail
from bisar_budget.constants import GATING_MODELS
from bisar_budget.faults import printable
from bisar_budget.resources import DISK, Files

if TYPE_CHECKING:
    from click import ParamType as ParamType
    from click.shell_completion import CompletionItem

    from bisar_budget.faults import SetValue
    from bisar_budget.findings.requirement import Outside
    from bisar_budget.mission.model import Mission
    from bisar_budget.settings import Settings
else:

    class ParamType(click.ParamType):
        """Base of parameter types that can be written with a value type in brackets, also with Click before 8.4."""

        def __class_getitem__(cls, values: object) -> type:  # noqa: D105
            return cls


Answer = TypeVar("Answer")
COMMAND_LINE = "command line"
_Function = Callable[..., object]
_Option = Callable[[_Function], _Function]  # a decorator of a command
_BEARING = ("model", "strict", "exit_zero")  # options that influence the verdict, besides --date and --set


class FileName(click.types.StringParamType):
    """Parameter type for a file name, which the shell completes. The file is not opened to check the name."""

    name = "file"

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> "list[CompletionItem]":
        """Tell the shell to complete the value as a file name."""
        from click.shell_completion import CompletionItem

        return [CompletionItem(incomplete, type="file")]


FILE = FileName()
MISSIONS = click.argument("missions", type=FILE, nargs=-1, required=True, metavar="MISSION...")
MISSIONS_OR_NONE = click.argument("missions", type=FILE, nargs=-1, metavar="MISSION...")


def output_option(words: str = "Write to FILE instead of standard output.", metavar: str = "FILE") -> _Option:
    """Make the option `--output`; `words` are its help."""
    return click.option("-o", "--output", type=FILE, metavar=metavar, help=words)


def plot_option(words: str) -> _Option:
    """Make the option `--plot`; `words` are its help."""
    return click.option("--plot", type=FILE, metavar="FILE", help=words)


def format_option(formats: Iterable[str], words: str, **overrides: Any) -> _Option:
    """Make the option `--format` with the choices `formats`; its default is text."""
    settings: dict[str, Any] = {"default": "text", "show_default": True, **overrides}
    return click.option("--format", "format_name", type=click.Choice([*formats]), help=words, **settings)


OUTPUT = output_option()
TEXT_OR_JSON = format_option(("text", "json"), "Format of the output.")


def _read_changes(ctx: click.Context, param: click.Parameter, texts: tuple[str, ...]) -> "tuple[SetValue, ...]":
    """Parse the values of the option `--set`; raises `click.UsageError` for an invalid value."""
    if not texts:
        return ()
    from bisar_budget.faults import InvalidValueError
    from bisar_budget.mission.changes import read_changes

    try:
        return read_changes(texts)
    except InvalidValueError as error:
        raise click.UsageError(f"--set: {error.problem.words}.") from None


def set_option(effect: str) -> _Option:
    """Make the option `--set`; `effect` is the beginning of its help.

    Settings and variables cannot set it, because a gate judges the file of the repository.
    """
    return click.option(
        "--set",
        "changes",
        multiple=True,
        metavar="KEY=VALUE",
        callback=_read_changes,
        help=f"{effect}: KEY is its path in the file, such as platforms.receiver.azimuth or other_errors.0.name, "
        "VALUE as in the file; null removes the key. Repeatable; every report states it.",
    )


SET = set_option("Replace a value of the mission, or add one")

GATING_MODEL = click.Choice(GATING_MODELS)


def model_option(variable: str | None = None) -> _Option:
    """Make the option `--model`; `variable` is an environment variable that may give its value instead."""
    words = "Model that decides, instead of that of the mission file."
    return click.option("--model", envvar=variable, type=GATING_MODEL, help=words)


def date_option(more: str = "") -> _Option:
    """Make the option `--date`; `more` is added to its help."""
    words = "Day on which waivers are judged (default: SOURCE_DATE_EPOCH, else today, UTC)." + more
    return click.option("--date", "today", type=click.DateTime(["%Y-%m-%d"]), help=words)


MODEL, DATE = model_option(), date_option()


def scheduler_options(doing: str, more: str = "") -> _Option:
    """Make the options `--scheduler` and `--scheduler-timeout`; the help begins with `doing` and ends with `more`."""
    named = click.option(
        "--scheduler",
        metavar="ADDRESS",
        help=f"{doing} on the workers of a Dask scheduler, tcp://HOST:PORT, or on local:N processes of its own."
        + more,
    )
    patience = click.option(
        "--scheduler-timeout",
        "patience",
        type=click.IntRange(min=1),
        default=30,
        show_default=True,
        metavar="SECONDS",
        help="How long a scheduler may have no worker before it is given up.",
    )
    return lambda command: named(patience(command))


def origin_of(parameter: click.Parameter) -> str:
    """Text about the origin of the value of a parameter: command line, environment, default or a settings file."""
    source = click.get_current_context().get_parameter_source(str(parameter.name))
    if source is ParameterSource.COMMANDLINE:
        return COMMAND_LINE
    if source is ParameterSource.ENVIRONMENT:
        return f"environment, {parameter.envvar}"
    if source is not ParameterSource.DEFAULT_MAP:
        return "default"
    settings = click.get_current_context().obj
    return os.path.relpath(settings.file) if settings else "pyproject.toml"


def settings_here(files: Files = DISK, folder: str | None = None) -> "Settings | None":
    """Settings of the project that contains a folder, by default the current one; None without settings.

    `files` are those of the disk or of a revision.
    """
    from bisar_budget.settings import SettingsError, project_settings

    try:
        return project_settings(os.getcwd() if folder is None else folder, files)
    except SettingsError as error:
        raise click.UsageError(printable(str(error))) from None
    except OSError:  # the current folder was removed
        return None


def day_and_outside(today: datetime | None) -> "tuple[date, Outside]":
    """Day on which waivers are judged, and the options of the current command that influence verdicts.

    `today` is the value of --date. Without it the day is that of SOURCE_DATE_EPOCH, or else today, UTC.
    """
    from bisar_budget.findings.requirement import Outside, Override
    from bisar_budget.front.checks import day_of, day_origin

    try:
        judged_on = day_of(today)
    except ValueError as error:
        raise click.UsageError(str(error)) from None

    context, overrides = click.get_current_context(), []
    for parameter in context.command.params:
        name, origin = str(parameter.name), origin_of(parameter)
        value = context.params.get(name)
        if name in _BEARING and origin != "default" and value is not None:
            text = ("yes" if value else "no") if isinstance(value, bool) else value
            overrides.append(Override(parameter.opts[0], text, origin))
    return judged_on, Outside(tuple(overrides), day_origin(today, COMMAND_LINE), today is not None)


@contextmanager
def wrong_usage() -> Iterator[None]:
    """Turn a `QuestionError` that does not depend on the mission into wrong usage of the command."""
    from bisar_budget.mission.quantities import QuestionError

    try:
        yield
    except QuestionError as error:
        raise click.UsageError(str(error)) from None


def ask_each(
    missions: "Sequence[Mission]", model: str | None, today: datetime | None, ask: Callable[..., Answer]
) -> Iterator[Answer]:
    """Yield the result of `ask` for each mission in turn.

    If a mission cannot answer the question, the command ends with an error message that names the file.
    """
    from bisar_budget.mission.quantities import QuestionError

    judged_on, from_outside = day_and_outside(today)
    for mission in missions:
        try:
            yield ask(mission, model=model, date=judged_on, outside=from_outside)
        except QuestionError as error:
            fail(f"{mission.file}: {error}")
