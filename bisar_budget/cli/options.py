"""Options shared by several commands, and the origin of each option value: command line, environment or settings."""

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
        """Base class of parameter types that also allows `ParamType[int]` with versions of Click before 8.4."""

        def __class_getitem__(cls, values: object) -> type:  # noqa: D105
            return cls


Answer = TypeVar("Answer")
COMMAND_LINE = "command line"
_Function = Callable[..., object]
_Option = Callable[[_Function], _Function]  # a decorator of a command
_BEARING = ("model", "strict", "exit_zero")  # options that influence the verdict, besides --date and --set


class FileName(click.types.StringParamType):
    """Parameter type for a file name that the shell can complete. It is not checked whether the file exists."""

    name = "file"

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> "list[CompletionItem]":
        """Tell the shell to complete the value as a file name."""
        from click.shell_completion import CompletionItem

        return [CompletionItem(incomplete, type="file")]


FILE = FileName()
MISSIONS = click.argument("missions", type=FILE, nargs=-1, required=True, metavar="MISSION...")
MISSIONS_OR_NONE = click.argument("missions", type=FILE, nargs=-1, metavar="MISSION...")


def output_option(words: str = "Write to FILE instead of standard output.", metavar: str = "FILE") -> _Option:
    """Make the option `--output` with the help text `words`."""
    return click.option("-o", "--output", type=FILE, metavar=metavar, help=words)


def plot_option(words: str) -> _Option:
    """Make the option `--plot` with the help text `words`."""
    return click.option("--plot", type=FILE, metavar="FILE", help=words)


def format_option(formats: Iterable[str], words: str, **overrides: Any) -> _Option:
    """Make the option `--format` with the choices `formats`, the default `text` and the help text `words`."""
    settings: dict[str, Any] = {"default": "text", "show_default": True, **overrides}
    return click.option("--format", "format_name", type=click.Choice([*formats]), help=words, **settings)


OUTPUT = output_option()


def answer_options(command: str, words: str = "", output: str = "", metavar: str = "FILE") -> _Option:
    """Make the options `--format` and `--output` of a command that is listed in `ANSWERS`.

    `words` is appended to the help text of `--format`. `output` replaces the help text of `--output`, and `metavar`
    is the placeholder of its value.
    """
    from bisar_budget.report.answers import ANSWERS

    formats = format_option(
        ANSWERS[command].formats,
        f"Format of the answer (default: that of the suffix of -o, else text); xlsx needs -o.{words and f' {words}'}",
        default=None,
        show_default=False,
    )
    target = output_option(output, metavar) if output else output_option()
    return lambda function: formats(target(function))


def _read_changes(ctx: click.Context, param: click.Parameter, texts: tuple[str, ...]) -> "tuple[SetValue, ...]":
    """Parse the values of the option `--set`, and raise `click.UsageError` for an invalid value."""
    if not texts:
        return ()
    from bisar_budget.faults import InvalidValueError
    from bisar_budget.mission.changes import read_changes

    try:
        return read_changes(texts)
    except InvalidValueError as error:
        raise click.UsageError(f"--set: {error.problem.words}.") from None


def set_option(effect: str) -> _Option:
    """Make the option `--set`; `effect` is the beginning of its help text.

    The option cannot be set by settings or environment variables, because a check in CI has to judge the mission file
    as it is in the repository.
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
    """Make the option `--model`; `variable` names the environment variable that provides its default, if any."""
    words = "Model that decides, instead of that of the mission file."
    return click.option("--model", envvar=variable, type=GATING_MODEL, help=words)


def date_option(more: str = "") -> _Option:
    """Make the option `--date`; `more` is appended to its help text."""
    words = "Day on which waivers are judged (default: SOURCE_DATE_EPOCH, else today, UTC)." + more
    return click.option("--date", "today", type=click.DateTime(["%Y-%m-%d"]), help=words)


MODEL, DATE = model_option(), date_option()


def scheduler_options(doing: str, more: str = "") -> _Option:
    """Make the options `--scheduler` and `--scheduler-timeout`.

    The help text of `--scheduler` begins with `doing`, which describes the task of its workers, and ends with `more`.
    """
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
    """Describe where the value of a parameter comes from.

    The result names the command line, an environment variable, a settings file, or the default.
    """
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
    """Return the settings of the project that contains `folder`; None if the project has no settings.

    By default `folder` is the current folder. `files` reads the files of the project from disk, or from a Git
    revision.
    """
    from bisar_budget.settings import SettingsError, project_settings

    try:
        return project_settings(os.getcwd() if folder is None else folder, files)
    except SettingsError as error:
        raise click.UsageError(printable(str(error))) from None
    except OSError:  # the current folder was removed
        return None


def day_and_outside(today: datetime | None) -> "tuple[date, Outside]":
    """Return the day on which waivers are judged, and the options of the running command that influence verdicts.

    `today` is the value of `--date`. If it is None, the day is given by SOURCE_DATE_EPOCH if this variable is set,
    otherwise by the current date in UTC.
    """
    from bisar_budget.findings.requirement import Outside, Override
    from bisar_budget.questions.outside import day_of, day_origin

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
    """Context manager that reports a `QuestionError` as wrong usage of the command.

    The error message does not name a mission.
    """
    from bisar_budget.mission.quantities import QuestionError

    try:
        yield
    except QuestionError as error:
        raise click.UsageError(str(error)) from None


def ask_each(
    missions: "Sequence[Mission]", model: str | None, today: datetime | None, ask: Callable[..., Answer]
) -> Iterator[Answer]:
    """Call `ask` with each mission in turn, and yield its results.

    If `ask` raises `QuestionError`, the command ends with an error message that names the mission file.
    """
    from bisar_budget.mission.quantities import QuestionError

    judged_on, from_outside = day_and_outside(today)
    for mission in missions:
        try:
            yield ask(mission, model=model, date=judged_on, outside=from_outside)
        except QuestionError as error:
            fail(f"{mission.file}: {error}")
