"""Entry point of the `bisar-budget` command.

Modules that take long to import are imported only where they are used.
"""

import errno
import gc
import os
import signal
import sys
import warnings
from importlib import import_module
from io import StringIO
from typing import Any, NoReturn

import click

from bisar_budget import __version__, memory
from bisar_budget.cli.streams import DEFECT_EXIT_CODE, INTERRUPTED_EXIT_CODE, complain, drop_output, fail
from bisar_budget.faults import ClusterError, MotionKindError, WorkerLostError, printable
from bisar_budget.questions.progress import SAYING
from bisar_budget.resources import docstring, hold_files, release_files

_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EBADF)
# Module of each command, which is imported only when the command is used.
_MODULES = {
    "allocate": "allocate",
    "check": "check",
    "derive": "derive",
    "diff": "diff",
    "import": "mission_files",
    "init": "mission_files",
    "passes": "passes",
    "schema": "mission_files",
    "sensitivity": "solve",
    "sensors": "sensors",
    "simulate": "images",
    "solve": "solve",
    "sweep": "sweep",
    "verify": "images",
}
_FRUGAL = ("init", "schema")  # commands that do not use NumPy


class _Commands(click.Group):
    """A command group that imports each command at its first use, and exits with code 3 if a command crashes.

    Python would exit with code 1 after a crash, but here this code means that a requirement is broken or not judged.
    """

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(_MODULES)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in _MODULES:
            return None
        if cmd_name not in _FRUGAL:
            memory.spare_threads()
            memory.hold_room(memory.MIN_MEMORY_BYTES, cmd_name)
        module = import_module(f"bisar_budget.cli.{_MODULES[cmd_name]}")
        command: click.Command = getattr(module, "import_file" if cmd_name == "import" else cmd_name)
        command.help = command.help or docstring(command.callback)  # functions have no docstrings under -OO
        return command

    def main(self, *args: Any, **kwargs: Any) -> Any:
        self.help = self.help or docstring(self.callback)
        hold_files()
        before = SAYING.set(complain)
        output = sys.stdout
        kwargs["standalone_mode"] = False  # click would exit with 1 on an interrupt or a broken pipe
        kwargs["prog_name"] = "bisar-budget"  # also if the program is called by another name
        try:
            sys.exit(super().main(*args, **kwargs))
        except SystemExit:
            if sys.stdout is not output:  # by click after a broken pipe, with 1; nothing was to be judged
                sys.exit(0)
            raise
        except click.ClickException as error:
            message = StringIO()
            error.show(message)
            complain(message.getvalue().rstrip("\n"))
            sys.exit(error.exit_code)
        except (click.Abort, KeyboardInterrupt) as error:
            if isinstance(error.__cause__, EOFError):  # Click takes it for Ctrl-D, but there are no prompts
                _own_fault(error.__cause__)
            sys.exit(INTERRUPTED_EXIT_CODE)
        except OSError as error:
            if error.errno in _NO_ROOM:
                drop_output()
                fail(f"cannot write standard output: {error.strerror}")
            if error.errno in (errno.EMFILE, errno.ENFILE, errno.EAGAIN):
                fail(f"the system refuses: {error.strerror}")
            try:
                os.getcwd()
            except OSError:
                fail("the current folder is gone; a name that does not start with / leads nowhere")
            _own_fault(error)
        except (ClusterError, MotionKindError) as error:
            fail(str(error))
        except WorkerLostError as error:
            fail(f"{error}; fewer processes (--jobs 1) or a smaller simulation.memory_limit need less")
        except Exception as error:
            _own_fault(error)
        finally:
            SAYING.reset(before)
            release_files()


def _own_fault(error: BaseException) -> NoReturn:
    """Report a crash of the program and exit with code 3, or report exhausted memory and exit with code 2.

    If the environment variable BISAR_BUDGET_DEBUG is set, the traceback is written too.
    """
    if os.environ.get("BISAR_BUDGET_DEBUG"):
        import traceback

        complain("".join(traceback.format_exception(error)).rstrip("\n"))
    if memory.ran_out(error):
        reason = str(error) if isinstance(error, MemoryError) and error.args else memory.limit_words()
        fail(f"the system refuses: memory ran out{f'; {reason}' if reason else ''}")
    complain(
        f"bisar-budget {__version__}: a fault of the tool itself, nothing was judged "
        f"({type(error).__name__}: {printable(str(error))}).\n"
        "Please report it; BISAR_BUDGET_DEBUG=1 shows where it happened."
    )
    sys.exit(DEFECT_EXIT_CODE)


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="bisar-budget")
def cli() -> None:
    """Motion-measurement error budgets for bistatic SAR.

    How large may the motion errors of transmitter and receiver be before the image breaks its
    requirements, and are the declared ones inside? After Rigling & Moses.

    Start with: bisar-budget init mission.yaml, then bisar-budget check mission.yaml
    """


def main() -> None:
    """Run the command-line program.

    After SIGTERM or SIGHUP the program exits without leaving worker processes or temporary files. Warnings from
    libraries are ignored, because users cannot fix their causes, and PYTHONWARNINGS could turn the warnings into
    errors.
    """
    warnings.simplefilter("ignore")
    # Workers start as `python -c`, which would import from the current folder, unlike an installed command.
    os.environ["PYTHONSAFEPATH"] = "1"
    if (
        len(sys.argv) > 1
    ):  # completion runs without arguments; with arguments, this variable would turn a check into a completion
        os.environ.pop("_BISAR_BUDGET_COMPLETE", None)
    for name in ("SIGTERM", "SIGHUP"):
        signal_number = getattr(signal, name, None)
        if signal_number is not None and signal.getsignal(signal_number) is signal.SIG_DFL:
            signal.signal(signal_number, _end)
    gc.set_threshold(50_000)  # imported objects stay; a collection after every 700 of them would cost 6 ms
    try:
        cli()
    finally:
        gc.freeze()  # a last collection before the exit would take a tenth of the time of a check


def _end(number: int, frame: object) -> NoReturn:
    sys.exit(128 + number)
