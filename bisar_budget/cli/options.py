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
        """Type of a parameter that accepts the type of its values in brackets, which Click before 8.4 does not."""

        def __class_getitem__(cls, values: object) -> type:  # noqa: D105
            return cls


Answer = TypeVar("Answer")
COMMAND_LINE = "command line"
_Function = Callable[..., object]
_Option = Callable[[_Function], _Function]  # a decorator of a command
_BEARING = ("model", "strict", "exit_zero")  # options with influence on the verdict, besides the day and --set


class FileName(click.types.StringParamType):
    """Name of a file, which a shell completes; reading checks whether it is readable."""

    name = "file"

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> "list[CompletionItem]":
        """Leave the completion to the shell, which knows the files."""
        from click.shell_completion import CompletionItem

        return [CompletionItem(incomplete, type="file")]


FILE = FileName()
MISSIONS = click.argument("missions", type=FILE, nargs=-1, required=True, metavar="MISSION...")
MISSIONS_OR_NONE = click.argument("missions", type=FILE, nargs=-1, metavar="MISSION...")


def output_option(words: str = "Write to FILE instead of standard output.", metavar: str = "FILE") -> _Option:
    """The option `--output`."""
    return click.option("-o", "--output", type=FILE, metavar=metavar, help=words)


def plot_option(words: str) -> _Option:
    """The option `--plot`."""
    return click.option("--plot", type=FILE, metavar="FILE", help=words)


def format_option(formats: Iterable[str], words: str, **overrides: Any) -> _Option:
    """The option `--format`; its default is text."""
    settings: dict[str, Any] = {"default": "text", "show_default": True, **overrides}
    return click.option("--format", "format_name", type=click.Choice([*formats]), help=words, **settings)


OUTPUT = output_option()
TEXT_OR_JSON = format_option(("text", "json"), "Format of the output.")


def _read_changes(ctx: click.Context, param: click.Parameter, texts: tuple[str, ...]) -> "tuple[SetValue, ...]":
    """Values of the option `--set`; raises `click.UsageError`."""
    if not texts:
        return ()
    from bisar_budget.faults import InvalidValueError
    from bisar_budget.mission.changes import read_changes

    try:
        return read_changes(texts)
    except InvalidValueError as error:
        raise click.UsageError(f"--set: {error.problem.words}.") from None


def set_option(effect: str) -> _Option:
    """The option `--set`; `effect` are words of the help.

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
    """The option `--model`, whose value may come from an environment variable instead."""
    words = "Model that decides, instead of that of the mission file."
    return click.option("--model", envvar=variable, type=GATING_MODEL, help=words)


def date_option(more: str = "") -> _Option:
    """The option `--date`; `more` are further words of the help."""
    words = "Day on which waivers are judged (default: SOURCE_DATE_EPOCH, else today, UTC)." + more
    return click.option("--date", "today", type=click.DateTime(["%Y-%m-%d"]), help=words)


MODEL, DATE = model_option(), date_option()


def scheduler_options(doing: str, more: str = "") -> _Option:
    """The options `--scheduler` and its time-out; `doing` and `more` are words of the help."""
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
    """Origin of the value of a parameter, in words."""
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
    """Settings of the project of a folder, by default the current one, on disk or in a revision; None without any."""
    from bisar_budget.settings import SettingsError, project_settings

    try:
        return project_settings(os.getcwd() if folder is None else folder, files)
    except SettingsError as error:
        raise click.UsageError(printable(str(error))) from None
    except OSError:  # somebody removed the current folder
        return None


def day_and_outside(today: datetime | None) -> "tuple[date, Outside]":
    """Day on which waivers are judged, and the options of the command with influence on verdicts.

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
    """Answers of each mission in turn; exits if a mission cannot answer the question."""
    from bisar_budget.mission.quantities import QuestionError

    judged_on, from_outside = day_and_outside(today)
    for mission in missions:
        try:
            yield ask(mission, model=model, date=judged_on, outside=from_outside)
        except QuestionError as error:
            fail(f"{mission.file}: {error}")
