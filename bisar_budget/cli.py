"""The `bisar-budget` command. Everything that costs time to import is imported where it is used."""

import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from datetime import UTC, date, datetime
from typing import TYPE_CHECKING, Any, NoReturn

import click
from click.core import ParameterSource

from bisar_budget import __version__
from bisar_budget.constants import MAX_DRAWS
from bisar_budget.errors import printable

if TYPE_CHECKING:
    from click._termui_impl import ProgressBar
    from click.shell_completion import CompletionItem

    from bisar_budget.budget.findings import MissionFindings, Option, Report
    from bisar_budget.budget.verdicts import VerifiedMission
    from bisar_budget.mission.model import Mission
    from bisar_budget.report import Style

EXIT_BROKEN, EXIT_USAGE, EXIT_OUR_FAULT, EXIT_INTERRUPTED = 1, 2, 3, 130


class _Commands(click.Group):
    """A group whose crashes exit with 3: 1 means a broken requirement and nothing else."""

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
            _complain(
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


class _FileName(click.ParamType[str]):
    """Name of a file, which a shell completes; what can be read is seen when it is."""

    name = "file"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Take the text as it is."""
        return str(value)

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> "list[CompletionItem]":
        """Leave it to the shell, which knows the files."""
        from click.shell_completion import CompletionItem

        return [CompletionItem(incomplete, type="file")]


FILE = _FileName()


class _Gate(click.Command):
    """A command whose options default to the project's settings; BISAR_BUDGET_… stands above them."""

    def make_context(self, *args: Any, **extra: Any) -> click.Context:
        try:
            return super().make_context(*args, default_map=self._defaults(), **extra)
        except click.BadParameter as error:
            if error.ctx is not None and error.param is not None and error.param.envvar:
                source = error.ctx.get_parameter_source(str(error.param.name))
                if source is ParameterSource.ENVIRONMENT:
                    error.param_hint = str(error.param.envvar)  # not the option that nobody wrote
            raise

    def _defaults(self) -> dict[str, Any]:
        from bisar_budget.settings import TABLE, SettingsError, project_settings

        options = {p.opts[0].removeprefix("--"): p for p in self.params if isinstance(p, click.Option) and p.envvar}
        known = ["BISAR_BUDGET_DEBUG", *(str(option.envvar) for option in options.values())]
        for name in os.environ:
            if name.startswith("BISAR_BUDGET_") and name not in known:
                raise click.UsageError(f"{printable(name)}: is not a known variable; known: {', '.join(known)}.")
        try:
            settings = project_settings(os.getcwd())
        except SettingsError as error:
            raise click.UsageError(printable(str(error))) from None
        except OSError:  # somebody removed the current folder
            settings = None
        defaults = {}
        for key, value in settings.values.items() if settings else ():
            option = options[key]
            try:
                for item in value if isinstance(value, list) else [value]:
                    option.type.convert(item, option, None)
                    if key == "report":
                        _format_of(item)
            except click.UsageError as error:
                raise click.UsageError(f"{settings.file}: {TABLE}.{key}: {error.message}") from None  # type: ignore[union-attr]
            defaults[str(option.name)] = value
        return defaults


class _Draws(click.ParamType[int]):
    """A number of draws: 1000000 or 1e6."""

    name = "number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        from decimal import Decimal, InvalidOperation

        try:
            number = Decimal(str(value).strip())
        except InvalidOperation:
            number = Decimal(0)
        if not (number.is_finite() and 1 <= number <= MAX_DRAWS and number == int(number)):
            accepted = f"must be a whole number of draws from 1 to {MAX_DRAWS:,}, such as 100000 or 1e6"
            self.fail(f"{printable(str(value))}: {accepted}.", param, ctx)
        return int(number)


@cli.command(cls=_Gate)
@click.argument("missions", type=FILE, nargs=-1, required=True, metavar="MISSION...")
@click.option(
    "--format",
    "format_name",
    envvar="BISAR_BUDGET_FORMAT",
    type=click.Choice(["text", "json", "csv", "junit", "sarif", "github", "needs", "html", "markdown"]),
    default="text",
    show_default=True,
    help="Format of the report; github: annotations of a pull request, needs: for Sphinx-Needs, html and "
    "markdown: a compliance report for a review board.",
)
@click.option(
    "-o", "--output", type=FILE, metavar="FILE", help="Write the report to FILE instead of standard output."
)
@click.option(
    "--report",
    "reports",
    envvar="BISAR_BUDGET_REPORT",
    type=FILE,
    multiple=True,
    metavar="FILE",
    help="Also write a report to FILE, in the format of its suffix: .html, .md, .txt, .json, .csv, .xml (JUnit), "
    ".sarif or .needs.json. Repeatable.",
)
@click.option(
    "--strict/--no-strict",
    envvar="BISAR_BUDGET_STRICT",
    help="Fail on warnings and on rows that could not be evaluated.",
)
@click.option(
    "--exit-zero/--no-exit-zero",
    envvar="BISAR_BUDGET_EXIT_ZERO",
    help="Exit with 0 even if a requirement is broken.",
)
@click.option(
    "--model",
    envvar="BISAR_BUDGET_MODEL",
    type=click.Choice(["published", "full", "strictest"]),
    help="Model that gates, over the mission file's.",
)
@click.option(
    "--date",
    "today",
    type=click.DateTime(["%Y-%m-%d"]),
    help="Day on which waivers are judged (default: SOURCE_DATE_EPOCH, else today, UTC). Only a day that is given "
    "stands in a compliance report.",
)
@click.option("--verify", "verifying", is_flag=True, help="Form images at the limits too and add what they show.")
@click.option(
    "--monte-carlo",
    "draws",
    envvar="BISAR_BUDGET_MONTE_CARLO",
    type=_Draws(),
    metavar="N",
    help="Also draw the declared errors N times from their distributions and say how often each requirement holds.",
)
@click.option(
    "--seed",
    envvar="BISAR_BUDGET_SEED",
    type=click.IntRange(0, 2**53),
    metavar="S",
    help="Seed of --monte-carlo (default: simulation.seed of the mission file, else 1).",
)
@click.option("-q", "--quiet", is_flag=True, help="One line per mission.")
@click.option("-v", "--verbose", is_flag=True, help="Reason, equation, displacement and evidence of every row.")
@click.option(
    "--explain",
    metavar="ID",
    help="Instead of the report, show how the row ID comes to its status: from the line of the file through "
    "the equations, with the numbers put in, to the verdict. Exits with 0.",
)
@click.option(
    "--color",
    envvar="BISAR_BUDGET_COLOR",
    type=click.Choice(["auto", "always", "never"]),
    default="auto",
    show_default=True,
    help="Colour the text; auto: on a terminal, unless NO_COLOR is set.",
)
def check(
    missions: Sequence[str],
    format_name: str,
    output: str | None,
    reports: Sequence[str],
    strict: bool,
    exit_zero: bool,
    model: str | None,
    today: datetime | None,
    verifying: bool,
    draws: int | None,
    seed: int | None,
    quiet: bool,
    verbose: bool,
    explain: str | None,
    color: str,
) -> None:
    """Check mission files against their requirements.

    MISSION is a YAML file, a glob pattern, or - for standard input. Exit code: 0 all met,
    1 a requirement is broken, 2 wrong usage or an unusable mission file, 3 a fault of the tool.

    Defaults of --format, --report, --strict, --exit-zero, --model, --monte-carlo, --seed and --color:
    [tool.bisar-budget] in the nearest pyproject.toml, and over it the variables BISAR_BUDGET_FORMAT and so on.
    """
    from bisar_budget.report import ILLUSTRATED, Style, render

    written = [(name, _format_of(name)) for name in reports]
    files = _expanded(missions)
    _spare(files, [output, *reports])
    given = click.get_current_context().get_parameter_source
    if seed is not None and draws is None and given("seed") is ParameterSource.COMMANDLINE:
        raise click.UsageError("--seed is that of --monte-carlo N: give both.")
    if explain is not None:
        if any(given(name) is ParameterSource.COMMANDLINE for name in ("format_name", "reports", "draws")):
            raise click.UsageError("--explain writes text: it excludes --format, --report and --monte-carlo.")
        _explain(files, explain, today.date() if today else _today(), model, output)
        return
    illustrated = any(name in ILLUSTRATED for name in (format_name, *(name for _, name in written)))
    drawn = None if draws is None else (draws, seed)
    report = _checked(files, today.date() if today else _today(), model, verifying, illustrated, drawn)
    report = report._replace(options=tuple(_options()), day=_given_day(today))
    if format_name != "text" or output is not None or quiet or not _is_terminal():
        _say_faults(report)
    style = Style(verbosity=-1 if quiet else 1 if verbose else 0, root=_repository())
    for path, its_format in written:
        _write_report(path, its_format, report, style)
    use_color = color == "always" or (color == "auto" and output is None and _wants_color())
    style = style._replace(color=use_color)
    if output is None:
        _print(render(format_name, report, style))
    else:
        _write_report(output, format_name, report, style)
    if format_name == "github":
        _append_step_summary(report, style)
    code = report.exit_code(strict)
    sys.exit(0 if exit_zero and code == EXIT_BROKEN else code)


def _options() -> "Iterator[Option]":
    """Say what the options that bear on the result are, and where each came from."""
    from bisar_budget.budget.findings import Option

    context = click.get_current_context()
    origins = {
        ParameterSource.COMMANDLINE: "command line",
        ParameterSource.DEFAULT_MAP: "pyproject.toml",
        ParameterSource.DEFAULT: "default",
    }
    for parameter in context.command.params:
        name, value = str(parameter.name), context.params[str(parameter.name)]
        source = context.get_parameter_source(name)
        origin = origins.get(source, f"environment, {parameter.envvar}") if source else "default"
        if name == "model":
            yield Option("--model", value or "as each file says", origin)
        elif name == "today":
            day = _given_day(value)
            if value is None and day is not None:
                origin = "environment, SOURCE_DATE_EPOCH"
            yield Option("--date", day.isoformat() if day else "the day of the run, which is not recorded", origin)
        elif name == "draws":
            yield Option("--monte-carlo", "no" if value is None else f"{value:,} draws", origin)
        elif name == "seed" and context.params["draws"] is not None:
            yield Option("--seed", "of each file" if value is None else str(value), origin)
        elif name in ("strict", "exit_zero", "verifying"):
            yield Option(parameter.opts[0], "yes" if value else "no", origin)


def _given_day(today: datetime | None) -> date | None:
    """The day that the command line or the environment gives; a report has no other, so as to be reproducible."""
    if today is not None:
        return today.date()
    return _today() if os.environ.get("SOURCE_DATE_EPOCH") else None


def _checked(
    files: Sequence[str],
    today: date,
    model: str | None,
    verifying: bool,
    illustrated: bool = False,
    drawn: tuple[int, int | None] | None = None,
) -> "Report":
    """Check every file; `verifying` adds verdicts of images. `illustrated` keeps the missions, and the images.

    `drawn` is the number of draws of a Monte Carlo and their seed.
    """
    from bisar_budget.budget.check import check_mission
    from bisar_budget.budget.findings import Report, UnusableMission
    from bisar_budget.errors import MissionError
    from bisar_budget.mission.load import load_mission

    if not (verifying or illustrated or drawn):
        from bisar_budget.budget.fleet import check_files

        return Report(version=__version__, missions=tuple(check_files(files, today, model)))
    missions: list[MissionFindings | UnusableMission] = []
    usable: dict[int, Mission] = {}
    for index, file in enumerate(files):
        try:
            mission = load_mission(file, model)
            found = check_mission(mission, today)
            if drawn is not None:
                from bisar_budget.budget.monte_carlo import monte_carlo

                found = found._replace(monte_carlo=monte_carlo(mission, *drawn))
            missions.append(found if illustrated else found._replace(mission=None))
            if verifying:
                usable[index] = mission
        except MissionError as error:
            missions.append(UnusableMission(file=file, faults=error.faults, data=error.data))
    if usable:
        from bisar_budget.budget.verdicts import with_verdicts

        for index, verified in zip(usable, _verified(list(usable.values()), "*", None), strict=True):
            judged = missions[index]
            if not isinstance(judged, UnusableMission):
                judged = with_verdicts(judged, verified)
                missions[index] = _illustrated(usable[index], judged) if illustrated else judged
    return Report(version=__version__, missions=tuple(missions))


def _illustrated(mission: "Mission", found: "MissionFindings") -> "MissionFindings":
    """Add the images of the rows that decide most."""
    from bisar_budget.simulate.image_evidence import form_image_evidence

    return found._replace(image_evidence=form_image_evidence(mission, found))


def _explain(files: Sequence[str], row_id: str, today: date, model: str | None, output: str | None) -> None:
    """Explain a row in every mission that has it."""
    from bisar_budget.budget.check import check_mission
    from bisar_budget.mission.readers import did_you_mean
    from bisar_budget.report.explanation import explain

    texts: list[str] = []
    known: dict[str, None] = {}
    for mission in _loaded(files, model):
        found = check_mission(mission, today)
        known |= dict.fromkeys(row.id for row in found.rows)
        if any(row.id == row_id for row in found.rows):
            texts.append(explain(mission, found, row_id))
    if not texts:
        hint = did_you_mean(row_id, tuple(known))
        raise click.UsageError(f"--explain {printable(row_id)}: no row has this id. {hint or 'A check lists them.'}")
    _deliver("\n".join(texts), output)


def _deliver(text: str, output: str | None) -> None:
    if output is None:
        _print(text)
    else:
        _write(output, text)


def _loaded(files: Sequence[str], model: str | None = None) -> "list[Mission]":
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
                _complain(line)
    if not is_usable:
        sys.exit(EXIT_USAGE)
    return loaded


def _expanded(patterns: Iterable[str]) -> list[str]:
    """Expand the glob patterns that the shell left; a pattern without a match stays and fails to load."""
    files: list[str] = []
    for pattern in patterns:
        if pattern != "-" and any(char in pattern for char in "*?[") and not os.path.exists(pattern):
            from glob import glob

            files += sorted(glob(pattern, recursive=True)) or [pattern]
        else:
            files.append(pattern)
    return list(dict.fromkeys(files))


def _today() -> date:
    epoch = os.environ.get("SOURCE_DATE_EPOCH")
    if not epoch:
        return datetime.now(UTC).date()
    try:
        return datetime.fromtimestamp(int(epoch), UTC).date()
    except (ValueError, OverflowError, OSError):
        raise click.UsageError(f"SOURCE_DATE_EPOCH must be seconds since 1970 (got {epoch!r})") from None


def _format_of(name: str) -> str:
    from bisar_budget.report import SUFFIXES, format_of

    format_name = format_of(name)
    if format_name is None:
        raise click.UsageError(f"--report {name}: the suffix must be one of {', '.join(SUFFIXES)}")
    return format_name


def _repository() -> str:
    """Folder that reports name files from: GitHub's checkout, else the current folder."""
    with suppress(OSError):  # somebody removed it under us
        return os.path.abspath(os.environ.get("GITHUB_WORKSPACE") or os.getcwd())
    return ""


def _append_step_summary(report: "Report", style: "Style") -> None:
    """Add to the page of the run on GitHub; that it cannot be written changes no exit code."""
    path = os.environ.get("GITHUB_STEP_SUMMARY")
    if not path:
        return
    from bisar_budget.report.github import step_summary

    try:
        with open(path, "a", encoding="utf-8", errors="backslashreplace", newline="\n") as file:
            file.write(step_summary(report, style))
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        _complain(f"Warning: cannot write the step summary {printable(path)}: {reason}")


def _say_faults(report: "Report") -> None:
    from bisar_budget.budget.findings import UnusableMission
    from bisar_budget.errors import MissionError

    for mission in report.missions:
        if isinstance(mission, UnusableMission):
            for line in MissionError(mission.file, mission.faults).lines():
                _complain(line)


def _complain(message: str) -> None:
    """Say something on standard error; that nobody listens changes no exit code."""
    with suppress(OSError):
        click.echo(message, err=True)


def _spare(files: Sequence[str], targets: Iterable[str | None]) -> None:
    """Refuse to write a report over a mission."""
    written = {os.path.realpath(target): target for target in targets if target is not None}
    for file in files if written else ():
        if file != "-" and os.path.realpath(file) in written:
            _fail(f"{written[os.path.realpath(file)]} is a mission file; a report would replace it")


def _is_terminal() -> bool:
    return all(stream is not None and stream.isatty() for stream in (sys.stdout, sys.stderr))


def _wants_color() -> bool:
    return (
        sys.stdout is not None
        and sys.stdout.isatty()
        and not os.environ.get("NO_COLOR")
        and os.environ.get("TERM") != "dumb"
    )


def _print(text: str) -> None:
    """Write to standard output; a reader that went away changes no exit code."""
    if sys.stdout is None:
        _fail("cannot write: standard output is closed")
    if hasattr(sys.stdout, "reconfigure"):
        sys.stdout.reconfigure(errors="replace")
    try:
        sys.stdout.write(text)
        sys.stdout.flush()
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # else Python complains again at exit
        if not isinstance(error, BrokenPipeError):
            _fail(f"cannot write standard output: {error.strerror}")


def _write_report(path: str, format_name: str, report: "Report", style: "Style") -> None:
    """Write a report to a file, its pictures first: a text never names a picture that is not there."""
    from bisar_budget.report import WITH_PICTURES, pictures, render

    folder = ""
    if format_name in WITH_PICTURES and path != "-" and (os.path.isfile(path) or not os.path.exists(path)):
        folder = f"{os.path.splitext(path)[0]}.assets"
    style = style._replace(assets=os.path.basename(folder))
    text = render(format_name, report, style)
    for name, content in pictures(format_name, report, style).items():
        _write(os.path.join(folder, name), content)
    _write(path, text)


def _write(path: str, content: str | bytes) -> None:
    """Replace a file whole: written beside it under another name, then renamed. `-` is standard output.

    A link keeps pointing where it does; what is no file, a device or a pipe, is written to as it is.
    """
    import tempfile

    if path == "-" and isinstance(content, str):
        _print(content)
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
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        if temporary is not None and os.path.exists(temporary):
            os.unlink(temporary)
        _fail(f"cannot write {path}: {getattr(error, 'strerror', None) or error}")


def _fail(message: str) -> NoReturn:
    _complain(f"Error: {printable(message)}")
    sys.exit(EXIT_USAGE)


class _Part(click.ParamType[float]):
    """A part of something: `10%` or 0.1."""

    name = "percent"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        from bisar_budget.errors import InvalidValueError
        from bisar_budget.units import RATIO, parse_quantity

        try:
            part = parse_quantity(value, RATIO)
        except InvalidValueError:
            part = -1.0
        if not 0 <= part <= 1:
            self.fail(f"{printable(str(value))}: must be 0% to 100%, such as 10% or 0.1.", param, ctx)
        return part


@cli.command()
@click.argument("files", type=FILE, nargs=-1, required=True, metavar="OLD NEW | MISSION...")
@click.option("--base", metavar="REV", help="Compare each MISSION with itself in this git revision.")
@click.option(
    "--fail-on-erosion",
    "tolerated",
    type=_Part(),
    metavar="PERCENT",
    help="Exit with 1 if a row fails that did not, or uses up more than this part of what was left of its limit.",
)
@click.option(
    "--format",
    "format_name",
    type=click.Choice(["text", "markdown", "json"]),
    default="text",
    show_default=True,
    help="Format of the comparison.",
)
@click.option("-o", "--output", type=FILE, metavar="FILE", help="Write to FILE instead of standard output.")
@click.option(
    "--date",
    "today",
    type=click.DateTime(["%Y-%m-%d"]),
    help="Day on which waivers are judged (default: SOURCE_DATE_EPOCH, else today, UTC).",
)
def diff(
    files: Sequence[str],
    base: str | None,
    tolerated: float | None,
    format_name: str,
    output: str | None,
    today: datetime | None,
) -> None:
    """Show what a change to a mission does to every margin.

    Compares two mission files, or each with itself in a git revision.

    Rows are sorted by erosion: the part of what was left of a limit that the change uses up, (u2 - u1)/(1 - u1)
    with the utilizations before and after. Exit code: 0, or 1 with --fail-on-erosion, 2 for wrong usage,
    an unusable file or an unknown revision.
    """
    from bisar_budget.budget.check import check_mission
    from bisar_budget.errors import MissionError
    from bisar_budget.mission.load import load_mission, parse_mission
    from bisar_budget.mission.revision import RevisionError, file_at
    from bisar_budget.report import difference
    from bisar_budget.report.comparison import compare

    if base is None and len(files) != 2:
        raise click.UsageError("give two mission files, OLD and NEW, or mission files and --base REV.")
    _spare(files, [output])
    day = today.date() if today else _today()
    pairs = [(files[0], files[1])] if base is None else [(file, file) for file in _expanded(files)]
    changes = []
    for before, after in pairs:
        try:
            old = load_mission(before) if base is None else parse_mission(file_at(before, base), f"{base}:{before}")
            new = load_mission(after)
        except RevisionError as error:
            _fail(str(error))
        except MissionError as error:
            for line in error.lines():
                _complain(line)
            sys.exit(EXIT_USAGE)
        changes.append(compare(check_mission(old, day), check_mission(new, day)))
    if format_name == "json":
        text = difference.as_json(__version__, changes, tolerated)
    else:
        text = (difference.as_text if format_name == "text" else difference.as_markdown)(changes, tolerated)
    _deliver(text, output)
    is_refused = tolerated is not None and any(change.broken(tolerated) for change in changes)
    sys.exit(EXIT_BROKEN if is_refused else 0)


@cli.command()
@click.argument("missions", type=FILE, nargs=-1, required=True, metavar="MISSION...")
@click.option("--only", default="*", metavar="GLOB", help="Verify only the rows whose id matches.")
@click.option(
    "--format",
    "format_name",
    type=click.Choice(["text", "json"]),
    default="text",
    show_default=True,
    help="Format of the verdicts.",
)
@click.option("-o", "--output", type=FILE, metavar="FILE", help="Write to FILE instead of standard output.")
@click.option(
    "--jobs",
    type=click.IntRange(min=1),
    metavar="N",
    help="Processes to use; default: the cores, or 1 with the extra `fast`, which uses them itself.",
)
def verify(missions: Sequence[str], only: str, format_name: str, output: str | None, jobs: int | None) -> None:
    """Form images at the limits and measure whether they are true.

    The data come from exact ranges, and the phase is measured in the image. A limit is confirmed if the
    image shows its budget within 5 %, optimistic if it shows more, conservative if less. With autofocus
    each limit is formed again with its gain and refocused. Exit code: 0, or 1 if a limit is optimistic, 2
    for wrong usage, an unusable file, or a mission on whose limits no image gave a verdict.
    """
    from bisar_budget.report import Style, verification

    files = _expanded(missions)
    _spare(files, [output])
    verified = _verified(_loaded(files), only, jobs)
    if format_name == "json":
        text = verification.as_json(__version__, verified)
    else:
        text = verification.as_text(verified, Style(color=output is None and _wants_color()))
    if output is None:
        _print(text)
    else:
        _write(output, text)
    doubts = [mission for mission in verified if mission.doubt]
    for mission in doubts:
        _complain(f"{printable(mission.file)}: {mission.doubt}")
    if doubts:
        sys.exit(EXIT_USAGE)
    sys.exit(EXIT_BROKEN if any(mission.status == "fail" for mission in verified) else 0)


def _verified(missions: "Sequence[Mission]", only: str, jobs: int | None) -> "list[VerifiedMission]":
    """Verify missions, with a progress bar where somebody watches."""
    from bisar_budget.simulate.image_formation import is_compiled
    from bisar_budget.simulate.verify import rows_to_verify, verify_mission

    total = sum(len(rows_to_verify(mission, only)) for mission in missions)
    if not total and only != "*":
        raise click.UsageError(f"--only {printable(only)}: no row with a limit has such an id, nothing was verified.")
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    jobs = jobs or (1 if is_compiled() else cores)
    with _progress_bar(total) as bar:
        return [verify_mission(mission, only, jobs, lambda row_id: bar.update(1)) for mission in missions]


def _progress_bar(total: int = 1) -> "ProgressBar[int]":
    """Bar on standard error, where somebody watches."""
    watched = sys.stderr is not None and sys.stderr.isatty()
    return click.progressbar(length=total, label="Forming images", file=sys.stderr, hidden=not watched)


@cli.command()
@click.argument("mission", type=FILE)
@click.option(
    "--plot", type=FILE, metavar="FILE", help="Draw Figures 3 to 7 of the paper for this mission: .png, .svg or .pdf."
)
@click.option(
    "-o", "--output", type=FILE, metavar="FILE.npz", help="Save the images and what explains them for NumPy."
)
def simulate(mission: str, plot: str | None, output: str | None) -> None:
    """Form the image of a point with the declared errors.

    The data come from exact ranges; the image is formed where the errors move the point, in the scene's
    axes and rotated so that the smear lies in cross range, before and after phase gradient autofocus.
    """
    for name, suffixes in ((plot, (".png", ".svg", ".pdf")), (output, (".npz",))):
        if name is not None and os.path.splitext(name)[1].lower() not in suffixes:
            raise click.UsageError(f"{name}: the suffix must be one of {', '.join(suffixes)}")
    _spare([mission], [plot, output])
    (loaded,) = _loaded([mission])
    from bisar_budget.report import point_plot
    from bisar_budget.simulate.point import SimulationError, simulate_point

    try:
        with _progress_bar() as bar:

            def progress(done: int, work: int) -> None:
                bar.length = work
                bar.update(done)

            images = simulate_point(loaded, progress)
    except (SimulationError, ValueError) as error:
        _fail(f"{mission}: {error}")
    try:
        if output is not None:
            point_plot.save(images, output)
        if plot is not None:
            point_plot.draw(images, loaded.name, plot)
    except OSError as error:
        _fail(f"cannot write {error.filename}: {error.strerror}")
    _print(point_plot.summary(images, loaded.name))


@cli.command()
@click.argument("file", type=FILE, default="mission.yaml")
@click.option("--name", default="My bistatic mission", show_default=True, help="Name of the mission.")
@click.option("--force", is_flag=True, help="Replace an existing file.")
def init(file: str, name: str, force: bool) -> None:
    """Write a commented mission file to start from.

    FILE is mission.yaml by default, - for standard output.
    """
    import json

    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    from bisar_budget.errors import InvalidValueError
    from bisar_budget.mission.readers import Text
    from bisar_budget.resources import resource

    try:
        Text().leaf(name)
    except InvalidValueError as error:
        raise click.UsageError(f"--name {error}") from None
    environment = Environment(
        loader=FileSystemLoader(resource("templates")), undefined=StrictUndefined, keep_trailing_newline=True
    )
    text = environment.get_template("mission.yaml.j2").render(name=json.dumps(name, ensure_ascii=False))
    if file == "-":
        _print(text)
        return
    if os.path.exists(file) and not force:
        _fail(f"{file} exists; --force replaces it")
    _write(file, text)
    _complain(f"Wrote {file}. Next: bisar-budget check {file}")
    _complain("For completion and checks in an editor: bisar-budget schema -o mission.schema.json beside it.")


@cli.command()
@click.option("-o", "--output", type=FILE, metavar="FILE", help="Write to FILE instead of standard output.")
def schema(output: str | None) -> None:
    """Print the JSON Schema of the mission file, for editors."""
    import json

    from bisar_budget.mission.schema import mission_schema

    text = json.dumps(mission_schema(), indent=2) + "\n"
    if output is None:
        _print(text)
    else:
        _write(output, text)


@cli.command()
@click.option(
    "--table",
    type=click.Choice(["all", "equations", "I", "II", "vibration", "full"]),
    default="all",
    show_default=True,
    help="What to derive.",
)
@click.option(
    "--format",
    "format_name",
    type=click.Choice(["text", "latex", "markdown", "mathml"]),
    default="text",
    show_default=True,
    help="How to write it.",
)
@click.option("--check", "check_only", is_flag=True, help="Fail if a generated file is not what it gives.")
@click.option("--write", is_flag=True, help="Rewrite the generated files: evaluators and formulas.")
def derive(table: str, format_name: str, check_only: bool, write: bool) -> None:
    """Derive the paper's tables from the geometry and print them.

    Rigling & Moses, Tables I and II, the equations before them, vibration limits; and the full model.
    Equation and table numbers are the paper's.
    """
    if check_only and write:
        raise click.UsageError("--check and --write exclude each other.")
    if check_only or write:
        _generated(write)
        return
    from bisar_budget.theory import render

    _print(render.derivation(table, format_name))


def _generated(write: bool) -> None:
    import difflib

    from bisar_budget.theory import emit, emit_catalogue

    derived_with = f"(SymPy {emit.SYMPY_VERSION})"
    is_current = True
    for generated in (emit, emit_catalogue):
        name, today = generated.TARGET.name, generated.source()
        if write:
            _write(str(generated.TARGET), today)
            click.echo(f"Wrote {name} {derived_with}.")
            continue
        committed = generated.TARGET.read_text(encoding="utf-8")
        if committed == today:
            click.echo(f"{name} is what the derivation gives {derived_with}.")
            continue
        is_current = False
        pair = (committed.splitlines(), today.splitlines())
        _print("\n".join(difflib.unified_diff(*pair, "committed", "derived", lineterm="", n=1)) + "\n")
        differs = f"{name} differs from the derivation {derived_with}"
        click.echo(f"{differs}; `bisar-budget derive --write` rewrites it.", err=True)
    if not is_current:
        sys.exit(EXIT_BROKEN)


def main() -> None:
    """Run the command."""
    cli()
