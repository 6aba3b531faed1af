"""`bisar-budget check`: the gate, its defaults, its reports."""

import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from datetime import date, datetime
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from bisar_budget import __version__
from bisar_budget.cli.options import (
    COMMAND_LINE,
    FILE,
    MISSIONS,
    SET,
    ParamType,
    date_option,
    day_and_outside,
    format_option,
    model_option,
    origin_of,
    output_option,
    scheduler_options,
    settings_here,
)
from bisar_budget.cli.streams import (
    EXIT_BROKEN,
    complain,
    deliver,
    expand,
    fail,
    is_terminal,
    load_all,
    root_of_names,
    say_faults,
    spare,
    wants_color,
    write_file,
)
from bisar_budget.constants import MAX_DRAWS, MAX_DRAWS_HERE
from bisar_budget.faults import closed, fault_words, printable
from bisar_budget.report import FORMATS

if TYPE_CHECKING:
    from bisar_budget.faults import SetValue
    from bisar_budget.findings.mission import MissionFindings, Report, UnusableMission
    from bisar_budget.findings.requirement import Outside, Override
    from bisar_budget.report import Style


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
        from bisar_budget.settings import TABLE

        options = {p.opts[0].removeprefix("--"): p for p in self.params if isinstance(p, click.Option) and p.envvar}
        known = ["BISAR_BUDGET_DEBUG", *(str(option.envvar) for option in options.values())]
        for name in os.environ:
            if name.startswith("BISAR_BUDGET_") and name not in known:
                from bisar_budget.mission.readers import did_you_mean

                near = did_you_mean(name, tuple(known))
                problem = fault_words("is not a known variable", "", f"accepted: {', '.join(known)}", near)
                raise click.UsageError(f"{printable(name)}: {closed(problem)}")
        settings = settings_here()
        defaults = {}
        for key, value in settings.values.items() if settings else ():
            if key == "sensors":  # `parts` reads it
                continue
            option = options[key]
            try:
                for item in value if isinstance(value, list) else [value]:
                    option.type.convert(item, option, None)
                    if key == "report":
                        _format_of(item)
                        _hold_below(os.path.dirname(settings.file), item)  # type: ignore[union-attr]
            except click.UsageError as error:
                raise click.UsageError(f"{settings.file}: {TABLE}.{key}: {error.message}") from None  # type: ignore[union-attr]
            defaults[str(option.name)] = value
        return defaults


def _touched(changed: Sequence[str]) -> list[str]:
    """List the missions that a change touches; without any the command ends well, and says so."""
    from bisar_budget.cli.touched import touched_missions

    files = touched_missions(changed)
    if not files:
        complain(f"No mission is among the changed files, and none reads one of them ({len(changed)} given).")
        sys.exit(0)
    return files


def _hold_below(folder: str, report: str) -> None:
    """Hold a report that settings ask for to their folder: a check of somebody's missions writes nowhere else."""
    inside = os.path.join(os.path.realpath(folder), "")
    # A NUL in the name is said where the report is written.
    if "\0" not in report and not os.path.realpath(report).startswith(inside):
        shown = printable(os.path.relpath(report, folder))
        raise click.UsageError(f"{shown} leads out of the folder of this file; `--report` takes any place.")


class _Draws(ParamType[int]):
    """A number of draws: 1000000 or 1e6."""

    name = "number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        from decimal import Decimal, InvalidOperation

        try:
            number = Decimal(str(value).strip())
        except InvalidOperation:
            number = Decimal(0)
        if not (number.is_finite() and 1 <= number <= MAX_DRAWS and number == int(number)):
            most = f"{MAX_DRAWS_HERE:,}, or {MAX_DRAWS:,} with --scheduler"
            accepted = f"must be a whole number of draws from 1 to {most}, such as 100000 or 1e6"
            self.fail(f"{printable(str(value))}: {accepted}.", param, ctx)
        return int(number)


@click.command(cls=_Gate)
@MISSIONS
@format_option(
    FORMATS,
    f"Format of the report; {', '.join(f'{one.name}: {one.about}' for one in FORMATS.values() if one.about)}.",
    envvar="BISAR_BUDGET_FORMAT",
)
@output_option("Write the report to FILE instead of standard output.")
@click.option(
    "--report",
    "reports",
    envvar="BISAR_BUDGET_REPORT",
    type=FILE,
    multiple=True,
    metavar="FILE",
    help="Also write a report to FILE, in the format of its suffix: "
    f"{', '.join(one.suffixes[0] for one in FORMATS.values() if one.suffixes)}. Repeatable.",
)
@click.option(
    "--detail",
    type=click.Choice(["summary", "full"]),
    default="summary",
    show_default=True,
    help="For html and markdown: only the summary, or also an annex with formulas, remarks and undeclared rows.",
)
@click.option(
    "--strict/--no-strict",
    envvar="BISAR_BUDGET_STRICT",
    help="Fail on warnings too.",
)
@click.option(
    "--exit-zero/--no-exit-zero",
    envvar="BISAR_BUDGET_EXIT_ZERO",
    help="Exit with 0 even if a requirement is broken or not judged; every report says it.",
)
@model_option("BISAR_BUDGET_MODEL")
@date_option(" A compliance report shows it only if it is given.")
@SET
@click.option("--verify", "verifying", is_flag=True, help="Also form images at the limits and add their verdicts.")
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
@scheduler_options("Draw", " The result is the same.")
@click.option(
    "--sweep",
    "swept",
    multiple=True,
    metavar="KEY=VALUES",
    help="For html and markdown: also check other values, written as for sweep --vary, and draw what complies: one "
    "key as curves, two as a map.",
)
@click.option(
    "--changed",
    "is_of_change",
    is_flag=True,
    help="MISSION... are the files of a change, of any kind: check the missions among them, and those below the "
    "current folder that read one of them (a part, an orbit, a log, a table, settings).",
)
@click.option("-q", "--quiet", is_flag=True, help="One line per mission.")
@click.option("--all", "all_rows", is_flag=True, help="Show every row, also those that are not declared.")
@click.option(
    "-v",
    "--verbose",
    is_flag=True,
    help="Show every row with its reason, notes, equation, displacement and evidence.",
)
@click.option(
    "--explain",
    metavar="ID",
    help="Explain the row ID instead of writing the report: its line of the file, its equations with the numbers put "
    "in, its verdict. Or a requirement, such as requirement.islr. Exits with 0.",
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
    detail: str,
    strict: bool,
    exit_zero: bool,
    model: str | None,
    today: datetime | None,
    changes: "tuple[SetValue, ...]",
    verifying: bool,
    draws: int | None,
    seed: int | None,
    scheduler: str | None,
    patience: int,
    swept: Sequence[str],
    is_of_change: bool,
    quiet: bool,
    all_rows: bool,
    verbose: bool,
    explain: str | None,
    color: str,
) -> None:
    """Check mission files against their requirements.

    MISSION is a YAML file, a glob pattern, or - for standard input. Exit code: 0 every requirement is judged and
    met, or waived, 1 a requirement is broken or not judged, 2 wrong usage or an unusable mission file, 3 a fault of
    the tool.

    Defaults of --format, --report, --strict, --exit-zero, --model, --monte-carlo, --seed and --color:
    [tool.bisar-budget] in the nearest pyproject.toml, and over it the variables BISAR_BUDGET_FORMAT and so on.
    """
    from bisar_budget.findings.status import exit_code
    from bisar_budget.report import Style, joined

    written = [(name, _format_of(name)) for name in reports]
    formats = [format_name, *(its_format for _, its_format in written)]
    files = _touched(missions) if is_of_change else expand(missions)
    folders = [_folder_of_pictures(name, its_format) for name, its_format in [*written, (output or "-", format_name)]]
    spare(files, [output, *reports, _step_summary(format_name)], [*filter(None, folders)])
    given = click.get_current_context().get_parameter_source
    if seed is not None and draws is None and given("seed") is ParameterSource.COMMANDLINE:
        raise click.UsageError("--seed needs --monte-carlo N.")
    _check_draws(draws, scheduler)
    if explain is not None:
        excluded = ("format_name", "reports", "draws", "scheduler", "swept")
        if any(given(name) is ParameterSource.COMMANDLINE for name in excluded):
            raise click.UsageError(
                "--explain writes text; it cannot be combined with --format, --report, --monte-carlo, --scheduler or "
                "--sweep."
            )
        _explain(files, explain, model, output, changes, *day_and_outside(today))
        return
    _check_sweep(swept, formats)
    illustrated = any(FORMATS[name].is_illustrated for name in formats)
    judged_on, from_outside = day_and_outside(today)
    use_color = color == "always" or (color == "auto" and output is None and wants_color())
    verbosity = -1 if quiet else 1 if verbose else 0
    root, is_checkout = root_of_names()
    style = Style(
        color=use_color, verbosity=verbosity, root=root, is_checkout=is_checkout, all_rows=all_rows, detail=detail
    )
    says_faults = format_name != "text" or output is not None or quiet or not is_terminal()
    asked: dict[str, Any] = {"model": model, "changes": changes, "outside": from_outside}
    if FORMATS[format_name].is_piecewise and not (written or verifying or draws):
        from bisar_budget.front.checks import pieces

        texts = pieces(files, judged_on, format_name, style, **asked)
        if says_faults:
            _say_faults(one.unusable for one in texts)
        deliver(joined(format_name, texts, __version__, style), output, format_name)
        statuses = frozenset[str]().union(*(one.statuses for one in texts))
    else:
        from bisar_budget.findings.mission import Report
        from bisar_budget.front.checks import checked, drawn_by
        from bisar_budget.mission.quantities import QuestionError

        asked |= {"swept": swept, "is_verified": verifying, "is_illustrated": illustrated}
        try:
            with drawn_by(scheduler, patience, draws, seed, len(files)) as drawn:
                found = checked(files, judged_on, drawn=drawn, **asked)
        except QuestionError as error:
            fail(str(error))
        # The day that somebody gave, or that decides: with no other a report is reproducible.
        is_given = today is not None or os.environ.get("SOURCE_DATE_EPOCH")
        told = [one.name for mission in found for one in getattr(mission, "overrides", ())]
        shown_day = judged_on if is_given or "--date" in told else None
        options = tuple(_options(shown_day, today))
        report = Report(version=__version__, missions=tuple(found), options=options, day=shown_day)
        if says_faults:
            _say_faults(report.missions)
        for path, its_format in written:
            _write_report(path, its_format, report, style._replace(color=False, verbosity=max(style.verbosity, 0)))
        _write_report(output or "-", format_name, report, style)
        if summary := _step_summary(format_name):
            _append_step_summary(summary, report, style)
        statuses = frozenset[str]().union(*(mission.statuses for mission in report.missions))
    code = exit_code(statuses, strict)
    sys.exit(0 if exit_zero and code == EXIT_BROKEN else code)


def _options(judged_on: date | None, today: datetime | None) -> "Iterator[Override]":
    """Say what the options that bear on the result are, and where each came from."""
    from bisar_budget.findings.requirement import Override
    from bisar_budget.front.checks import day_origin

    context = click.get_current_context()
    for parameter in context.command.params:
        name, value = str(parameter.name), context.params[str(parameter.name)]
        origin = origin_of(parameter)
        said = None
        if name == "model":
            said = value or "as each file says"
        elif name == "today":
            if value is None and judged_on is not None:
                origin = day_origin(today, COMMAND_LINE)
            said = "the day of the run (not recorded: no waiver depends on it)"
            said = judged_on.isoformat() if judged_on else said
        elif name == "changes":
            said = ", ".join(f"{change.key}={change.text}" for change in value)
        elif name == "swept":
            said = ", ".join(value)
        elif name == "draws":
            said = "no" if value is None else f"{value:,} draws"
        elif name == "seed" and context.params["draws"] is not None:
            said = "of each file" if value is None else str(value)
        elif name in ("strict", "exit_zero", "verifying"):
            said = "yes" if value else "no"
        if said:
            yield Override(parameter.opts[0], said, origin)


def _check_draws(draws: int | None, scheduler: str | None) -> None:
    """Refuse a scheduler that has nothing to draw, and more draws than are made without one."""
    if scheduler is None:
        if draws is not None and draws > MAX_DRAWS_HERE:
            raise click.UsageError(
                f"--monte-carlo {draws:,}: must be at most {MAX_DRAWS_HERE:,} draws; with --scheduler ADDRESS, whose "
                f"workers share them, {MAX_DRAWS:,}."
            )
    elif draws is None:
        raise click.UsageError(f"--scheduler {scheduler}: shares out draws, and needs --monte-carlo N.")


def _check_sweep(texts: Sequence[str], formats: Sequence[str]) -> None:
    """Refuse a sweep that no report shows, and more keys than a drawing has axes."""
    if not texts:
        return
    if not any(FORMATS[name].is_illustrated for name in formats):
        raise click.UsageError(
            "--sweep is shown in a compliance report; accepted: --report FILE.html or FILE.md, or --format html or "
            "markdown. `bisar-budget sweep` writes tables and plots."
        )
    if len(texts) > 2:
        raise click.UsageError(f"--sweep draws one key or two, and there are {len(texts)}.")


def _explain(
    files: Sequence[str],
    row_id: str,
    model: str | None,
    output: str | None,
    changes: "Sequence[SetValue]",
    today: date,
    from_outside: "Outside",
) -> None:
    """Explain a row, or a requirement, in every mission that has it."""
    from bisar_budget.findings.row import unknown_id
    from bisar_budget.front.checks import DAY_OF_RUN
    from bisar_budget.front.checks import check as ask
    from bisar_budget.report.explain.explanation import explain, explain_requirement
    from bisar_budget.report.words.heading import overrides_lines
    from bisar_budget.report.words.requirements import requirement_id

    texts: list[str] = []
    known: dict[str, None] = {}
    for mission in load_all(files, model, changes):
        found = ask(mission, date=today, outside=from_outside).findings
        required = {requirement_id(one): one for one in found.requirements}
        known |= dict.fromkeys([*(row.id for row in found.rows), *required])
        required |= {one.id: one for one in found.requirements}
        if any(row.id == row_id for row in found.rows):
            text = explain(mission, found, row_id)
        elif row_id in required:
            text = explain_requirement(mission, found, required[row_id])
        else:
            continue
        given = tuple(one for one in found.overrides if one.origin != DAY_OF_RUN)
        said = overrides_lines(found._replace(overrides=given))
        texts.append(text + "".join(f"{line}\n" for line in said))
    if not texts:
        problem = closed(unknown_id(row_id, known, files[0], "row or requirement"))
        raise click.UsageError(f"--explain {printable(row_id)}: {problem}")
    deliver("\n".join(texts), output)


def _format_of(name: str) -> str:
    from bisar_budget.report import format_of

    format_name = format_of(name)
    if format_name is None:
        suffixes = (suffix for one in FORMATS.values() for suffix in one.suffixes)
        raise click.UsageError(f"--report {name}: the suffix must be one of {', '.join(suffixes)}")
    return format_name


def _step_summary(format_name: str) -> str | None:
    """File that GitHub shows on the page of a run; None where there is none."""
    return (os.environ.get("GITHUB_STEP_SUMMARY") or None) if format_name == "github" else None


def _append_step_summary(path: str, report: "Report", style: "Style") -> None:
    """Add to the page of the run on GitHub; that it cannot be written changes no exit code."""
    from bisar_budget.report.formats.annotations import step_summary

    try:
        with open(path, "a", encoding="utf-8", errors="backslashreplace", newline="\n") as file:
            file.write(step_summary(report, style))
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        complain(f"warning: cannot write the step summary {printable(path)}: {reason}")


def _say_faults(missions: "Iterable[MissionFindings | UnusableMission | None]") -> None:
    from bisar_budget.findings.mission import UnusableMission

    for mission in missions:
        if isinstance(mission, UnusableMission):
            say_faults(mission.file, mission.faults)


def _write_report(path: str, format_name: str, report: "Report", style: "Style") -> None:
    """Write a report to a file, its pictures first: a text never names a picture that is not there."""
    from bisar_budget.report import pictures, render

    folder = _folder_of_pictures(path, format_name)
    style = style._replace(assets=os.path.basename(folder))
    text = render(format_name, report, style)
    for name, content in pictures(format_name, report, style).items():
        write_file(os.path.join(folder, name), content)
    deliver(text, path, format_name)


def _folder_of_pictures(path: str, format_name: str) -> str:
    """Folder beside a report for its pictures; empty if the format has none, or nothing can stand beside it."""
    if not FORMATS[format_name].has_pictures or path == "-" or (os.path.exists(path) and not os.path.isfile(path)):
        return ""
    return f"{os.path.splitext(path)[0]}.assets"
