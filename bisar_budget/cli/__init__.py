"""The `bisar-budget` command. Everything that costs time to import is imported where it is used."""

import os
import sys
from contextlib import suppress
from importlib import import_module
from typing import Any

import click

from bisar_budget import __version__
from bisar_budget.cli.streams import EXIT_INTERRUPTED, EXIT_OUR_FAULT, complain
from bisar_budget.errors import printable

# Each command to the module that has it, imported when it is asked for.
_MODULES = {
    "check": "check",
    "derive": "derive",
    "diff": "diff",
    "init": "mission_files",
    "schema": "mission_files",
    "simulate": "simulate",
    "verify": "verify",
}


class _Commands(click.Group):
    """A group of late imports, whose crashes exit with 3: 1 means a broken requirement and nothing else."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(_MODULES)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in _MODULES:
            return None
        command: click.Command = getattr(import_module(f"bisar_budget.cli.{_MODULES[cmd_name]}"), cmd_name)
        return command

    def main(self, *args: Any, **kwargs: Any) -> Any:
        kwargs["standalone_mode"] = False  # click would exit with 1 on an interrupt or a broken pipe
        try:
            sys.exit(super().main(*args, **kwargs))
        except click.ClickException as error:
            with suppress(OSError):  # standard error may be closed; the exit code still says it
                error.show()
            sys.exit(error.exit_code)
        except (click.Abort, KeyboardInterrupt):
            sys.exit(EXIT_INTERRUPTED)
        except Exception as error:
            if os.environ.get("BISAR_BUDGET_DEBUG"):
                raise
            complain(
                f"bisar-budget {__version__}: a fault of the tool itself, nothing was judged "
                f"({type(error).__name__}: {printable(str(error))}).\n"
                "Please report it; BISAR_BUDGET_DEBUG=1 shows where it happened."
            )
            sys.exit(EXIT_OUR_FAULT)


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="bisar-budget")
def cli() -> None:
    """Motion-measurement error budgets for bistatic SAR.

    How large may the motion errors of transmitter and receiver be before the image breaks its
    requirements, and are the declared ones inside? After Rigling & Moses.

    Start with: bisar-budget init mission.yaml, then bisar-budget check mission.yaml
    """


def main() -> None:
    """Run the command."""
    cli()
