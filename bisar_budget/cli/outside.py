"""Where the options of a command come from: the command line, the environment, the settings of a project."""

import os
from collections.abc import Iterator
from contextlib import suppress
from datetime import date, datetime
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from bisar_budget.cli.streams import day_of_run

if TYPE_CHECKING:
    from bisar_budget.budget.waivers import Outside
    from bisar_budget.findings.requirement import Override

DAY_OF_RUN = "the day of the run"
_BEARING = ("model", "strict", "exit_zero")  # on the verdict, besides the day and --set


def origin_of(parameter: click.Parameter) -> str:
    """Say where the value of a parameter comes from."""
    source = click.get_current_context().get_parameter_source(str(parameter.name))
    if source is ParameterSource.COMMANDLINE:
        return "command line"
    if source is ParameterSource.ENVIRONMENT:
        return f"environment, {parameter.envvar}"
    return _settings_file() if source is ParameterSource.DEFAULT_MAP else "default"


def _settings_file() -> str:
    from bisar_budget.settings import SettingsError, project_settings

    with suppress(OSError, SettingsError):
        settings = project_settings(os.getcwd())
        if settings is not None:
            return os.path.relpath(settings.file)
    return "pyproject.toml"


def outside(today: datetime | None) -> "Outside":
    """Gather the options of the command that bear on verdicts; `today` is the value of --date."""
    from bisar_budget.budget.waivers import Outside

    return Outside(tuple(_options()), day_origin(today), today is not None)


def day_origin(today: datetime | None) -> str:
    """Say where the day of waivers comes from."""
    if today is not None:
        return "command line"
    return "environment, SOURCE_DATE_EPOCH" if os.environ.get("SOURCE_DATE_EPOCH") else DAY_OF_RUN


def day(today: datetime | None) -> date:
    """Day on which waivers are judged."""
    return today.date() if today else day_of_run()


def _options() -> "Iterator[Override]":
    from bisar_budget.findings.requirement import Override

    context = click.get_current_context()
    for parameter in context.command.params:
        name, origin = str(parameter.name), origin_of(parameter)
        value = context.params.get(name)
        if name in _BEARING and origin != "default" and value is not None:
            yield Override(
                parameter.opts[0], ("yes" if value else "no") if isinstance(value, bool) else value, origin
            )
