"""`bisar-budget check`: the command that checks missions, its option defaults from settings, and its reports."""

import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from datetime import date, datetime
from functools import partial
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from bisar_budget import __version__
from bisar_budget.cli.options import (
    COMMAND_LINE,
    FILE,
    MISSIONS_OR_NONE,
    SET,
    ParamType,
    date_option,
    day_and_outside,
    format_option,
    model_option,
    origin_of,
    output_option,
    scheduler_options,
)
from bisar_budget.cli.projects import Project, by_settings
from bisar_budget.cli.streams import (
    BROKEN_EXIT_CODE,
    complain,
    deliver,
    expand,
    fail,
    is_terminal,
    read_all,
    root_of_names,
    say_faults,
    spare,
    table_width,
    wants_color,
    write_file,
)
from bisar_budget.constants import MAX_DRAWS, MAX_LOCAL_DRAWS
from bisar_budget.faults import closed, fault_words, printable
from bisar_budget.json_types import JsonObject
from bisar_budget.report import FORMATS

if TYPE_CHECKING:
    from bisar_budget.faults import SetValue
    from bisar_budget.findings.mission import MissionFindings, Report, UnusableMission
    from bisar_budget.findings.requirement import Override
    from bisar_budget.report import Piece, Style
    from bisar_budget.settings import Settings


Arguments = dict[str, Any]
"""Arguments of a function by name."""
_PROJECTS = "bisar_budget.projects"  # key of the projects in the `meta` of a context
_OF_RUN = ("format", "color")  # settings of a whole run, if all its projects agree


class _Gate(click.Command):
    """Command class of `check`, which takes defaults of options from environment variables and project settings.

    An environment variable takes precedence over the settings. The settings of a mission are in the `pyproject.toml`
    nearest to it.
    """

    def make_context(self, info_name: str | None, args: list[str], *more: Any, **extra: Any) -> click.Context:
        first_context = self._context({}, info_name, list(args), *more, **extra)
        if first_context.resilient_parsing:
            return first_context
        names = first_context.params["missions"]
        if not names and not first_context.params["is_of_change"]:
            raise click.UsageError("Missing argument 'MISSION...'.", first_context)
        files = _touched(names) if first_context.params["is_of_change"] else expand(names)
        projects: list[Project] = []
        for settings, files_of_project in by_settings(files):
            defaults, context = self._defaults(settings), first_context
            if defaults or projects:
                context = self._context(defaults, info_name, list(args), *more, **extra)
            context.obj = settings
            projects.append(Project(settings, files_of_project, context))
        context = projects[0].context
        if len(projects) > 1:
            defaults = self._common_defaults([project.settings for project in projects])
            context = self._context(defaults, info_name, list(args), *more, **extra)
        context.params["missions"] = tuple(files)
        context.meta[_PROJECTS] = projects
        return context

    def _common_defaults(self, settings: "Sequence[Settings | None]") -> JsonObject:
        """Return option defaults for a run with several projects, from the settings of these projects.

        Only the options in `_OF_RUN` can get a default. The value of such an option must be the same in all settings;
        otherwise a warning is written, and the option gets no default.
        """
        agreed = {}
        for key in _OF_RUN:
            values = {each.values.get(key) if each else None for each in settings}
            if len(values) == 1:
                agreed[key] = values.pop()
            else:
                complain(f"warning: the settings of the missions have different {key}s: none of them is taken.")
        options = {p.opts[0].removeprefix("--"): str(p.name) for p in self.params}
        return {options[key]: value for key, value in agreed.items() if value is not None}

    def _context(self, defaults: JsonObject, *arguments: Any, **extra: Any) -> click.Context:
        try:
            return super().make_context(*arguments, default_map=defaults, **extra)
        except click.BadParameter as error:
            if error.ctx is not None and error.param is not None and error.param.envvar:
                source = error.ctx.get_parameter_source(str(error.param.name))
                if source is ParameterSource.ENVIRONMENT:
                    error.param_hint = str(
                        error.param.envvar
                    )  # name the variable, since the user did not write the option
            raise

    def _defaults(self, settings: "Settings | None") -> JsonObject:
        from bisar_budget.settings import TABLE

        options = {p.opts[0].removeprefix("--"): p for p in self.params if isinstance(p, click.Option) and p.envvar}
        variables = ["BISAR_BUDGET_DEBUG", *(str(option.envvar) for option in options.values())]
        for name in os.environ:
            if name.startswith("BISAR_BUDGET_") and name not in variables:
                from bisar_budget.mission.readers import did_you_mean

                near = did_you_mean(name, tuple(variables))
                problem = fault_words("is not a known variable", "", f"accepted: {', '.join(variables)}", near)
                raise click.UsageError(f"{printable(name)}: {closed(problem)}")
        defaults = {}
        for key, value in settings.values.items() if settings else ():
            if key == "sensors":  # no option: the catalogue reads it
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
    """List the missions that the changed files affect; if there are none, write a message and exit with code 0.

    A mission is affected if its own file, or a file that it reads, has changed.
    """
    from bisar_budget.cli.touched import touched_missions

    files = touched_missions(changed)
    if not files:
        complain(f"No mission is among the changed files, and none reads one of them ({len(changed)} given).")
        sys.exit(0)
    return files


def _hold_below(folder: str, report: str) -> None:
    """Raise `click.UsageError` if settings name a report file outside the folder of the settings file.

    Without this test, the settings of another author's missions could make a check write to any folder of the user.
    """
    inside = os.path.join(os.path.realpath(folder), "")
    # A NUL in the name is reported when the report is written.
    if "\0" not in report and not os.path.realpath(report).startswith(inside):
        shown = printable(os.path.relpath(report, folder))
        raise click.UsageError(f"{shown} leads out of the folder of this file; `--report` takes any place.")


class _Draws(ParamType[int]):
    """Parameter type for a number of draws, such as 1000000 or 1e6."""

    name = "number"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> int:
        from decimal import Decimal, InvalidOperation

        try:
            number = Decimal(str(value).strip())
        except InvalidOperation:
            number = Decimal(0)
        if not (number.is_finite() and 1 <= number <= MAX_DRAWS and number == int(number)):
            most = f"{MAX_LOCAL_DRAWS:,}, or {MAX_DRAWS:,} with --scheduler"
            accepted = f"must be a whole number of draws from 1 to {most}, such as 100000 or 1e6"
            self.fail(f"{printable(str(value))}: {accepted}.", param, ctx)
        return int(number)


@click.command(cls=_Gate)
@MISSIONS_OR_NONE
@format_option(
    FORMATS,
    f"Format of the report: {', '.join(form.name_and_about for form in FORMATS.values())}.",
    metavar="FORMAT",
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
    f"{', '.join(form.suffixes[0] for form in FORMATS.values() if form.suffixes)}. Repeatable.",
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
    help="Exit with 0 even if a requirement is broken or not judged; every report states it.",
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
    help="Also draw the declared errors N times from their distributions: how often each requirement holds.",
)
@click.option(
    "--seed",
    envvar="BISAR_BUDGET_SEED",
    type=click.IntRange(0, 2**53),
    metavar="S",
    help="Seed of --monte-carlo (default: simulation.seed of the mission file, else 1).",
)
@click.option(
    "--guard",
    "guarding",
    is_flag=True,
    help="Also give the probability that each verdict is wrong, from figures of errors with a standard uncertainty, "
    "such as 5 mm ± 20 %. The exit code stays the same.",
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
    "current folder that read one of them (a part, an orbit, a log, a table, settings), or name a file that is gone.",
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
    guarding: bool,
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

    MISSION is a YAML file, a glob pattern, or - for standard input. Exit code: 0 if every requirement is either
    waived, or judged and met; 1 if a requirement is broken or not judged; 2 for wrong usage or an unusable mission
    file; 3 for a fault of the tool itself.

    Defaults of --format, --report, --strict, --exit-zero, --model, --monte-carlo, --seed and --color:
    [tool.bisar-budget] in the pyproject.toml nearest to each mission, overridden by the variables BISAR_BUDGET_FORMAT
    and so on. Each mission is judged by the settings of its own project.
    """
    from bisar_budget.report import Style, joined

    files = list(missions)
    projects: list[Project] = click.get_current_context().meta[_PROJECTS]
    source_of = click.get_current_context().get_parameter_source
    if len(projects) > 1 and source_of("reports") not in (ParameterSource.COMMANDLINE, ParameterSource.ENVIRONMENT):
        reports = ()
    named_reports = [(name, _format_of(name)) for name in reports]
    own_reports = _reports_of(projects) if len(projects) > 1 else []
    formats = [format_name, *(its_format for _, its_format in named_reports), *(each[2] for each in own_reports)]
    destinations = [*named_reports, *(each[1:] for each in own_reports), (output or "-", format_name)]
    for name, its_format in destinations:
        if name == "-" and FORMATS[its_format].is_binary:
            raise click.UsageError(f"--format {its_format} needs -o FILE.")
    folders = [_folder_of_pictures(name, its_format) for name, its_format in destinations]
    spare(
        files,
        [output, *(name for name, _ in destinations[:-1]), _step_summary(format_name)],
        [*filter(None, folders)],
    )
    for project in projects:
        _check_draws(project.context, scheduler)
    is_drawn = any(project.context.params["draws"] is not None for project in projects)
    if explain is not None:
        excluded = ("format_name", "reports", "draws", "scheduler", "swept", "guarding")
        if any(source_of(name) is ParameterSource.COMMANDLINE for name in excluded):
            raise click.UsageError(
                "--explain writes text; it cannot be combined with --format, --report, --monte-carlo, --guard, "
                "--scheduler or --sweep."
            )
        _explain(projects, explain, output, changes, today)
        return
    _check_sweep(swept, formats)
    illustrated = any(FORMATS[name].is_illustrated for name in formats)
    use_color = color == "always" or (color == "auto" and output is None and wants_color())
    verbosity = -1 if quiet else 1 if verbose else 0
    root, is_checkout = root_of_names()
    style = Style(
        color=use_color, verbosity=verbosity, root=root, is_checkout=is_checkout, all_rows=all_rows, detail=detail
    )
    if output is None:
        style = style._replace(table_width=table_width())
    says_faults = format_name != "text" or output is not None or quiet or not is_terminal()
    if FORMATS[format_name].is_piecewise and not (named_reports or own_reports or verifying or is_drawn or guarding):
        from bisar_budget.questions.checks import pieces

        texts: dict[str, Piece] = {}
        for project in projects:
            judged_on, arguments = _asked(project, len(projects) > 1, today, changes)
            texts |= zip(
                project.files, pieces(project.files, judged_on, format_name, style, **arguments), strict=True
            )
        ordered = [texts[file] for file in files]
        if says_faults:
            _say_faults(each.unusable for each in ordered)
        deliver(joined(format_name, ordered, __version__, style), output, format_name)
        statuses = {file: each.statuses for file, each in texts.items()}
    else:
        from bisar_budget.findings.mission import Report
        from bisar_budget.mission.quantities import QuestionError
        from bisar_budget.questions.checks import checked, with_work_trees
        from bisar_budget.questions.drawn_errors import drawn_by

        settings: Arguments = {"swept": swept, "is_verified": verifying, "is_illustrated": illustrated}
        settings["is_guarded"] = guarding
        found: dict[str, MissionFindings | UnusableMission] = {}
        for project in projects:
            judged_on, arguments = _asked(project, len(projects) > 1, today, changes)
            draws, seed = (project.context.params[name] for name in ("draws", "seed"))
            try:
                with drawn_by(scheduler, patience, draws, seed, len(project.files)) as drawn:
                    results_of_project = checked(project.files, judged_on, drawn=drawn, **arguments, **settings)
            except QuestionError as error:
                fail(str(error))
            found |= zip(project.files, results_of_project, strict=True)

        def report_of(of: Sequence[Project], its_files: Sequence[str]) -> Report:
            """Make the report on the mission files `its_files`, using the options of their projects `of`."""
            its_missions = tuple(found[file] for file in its_files)
            # The day is reported only if it was given or decides a waiver, so that other reports are reproducible.
            is_given = today is not None or os.environ.get("SOURCE_DATE_EPOCH")
            reported = [each.name for mission in its_missions for each in getattr(mission, "overrides", ())]
            shown_day = judged_on if is_given or "--date" in reported else None
            options = dict.fromkeys(option for project in of for option in _options(project, shown_day, today))
            report = Report(version=__version__, missions=its_missions, options=tuple(options), day=shown_day)
            return with_work_trees(report) if illustrated else report

        report = report_of(projects, files)
        if says_faults:
            _say_faults(report.missions)
        plain = style._replace(color=False, verbosity=max(style.verbosity, 0), table_width=Style().table_width)
        for path, its_format in named_reports:
            _write_report(path, its_format, report, plain)
        for project, path, its_format in own_reports:
            _write_report(path, its_format, report_of([project], project.files), plain)
        _write_report(output or "-", format_name, report, style)
        if summary := _step_summary(format_name):
            _append_step_summary(summary, report, style)
        statuses = {file: found[file].statuses for file in files}
    sys.exit(max(_code_of(project, [statuses[file] for file in project.files]) for project in projects))


def _code_of(project: Project, statuses: "Sequence[frozenset[str]]") -> int:
    """Return the exit code for the missions of a project.

    It follows from the statuses of the missions, and from the options `strict` and `exit_zero` of the project.
    `statuses` holds a set of statuses for each mission.
    """
    from bisar_budget.findings.status import exit_code

    strict, exit_zero = (project.context.params[name] for name in ("strict", "exit_zero"))
    code = exit_code(frozenset[str]().union(*statuses), strict)
    return 0 if exit_zero and code == BROKEN_EXIT_CODE else code


def _reports_of(projects: Sequence[Project]) -> list[tuple[Project, str, str]]:
    """List the reports that the settings of the projects request, as tuples of project, file name and format.

    Such a report contains only the missions of its project.
    """
    return [
        (project, name, _format_of(name))
        for project in projects
        if project.context.get_parameter_source("reports") is ParameterSource.DEFAULT_MAP
        for name in project.context.params["reports"]
    ]


def _asked(
    project: Project, is_among_others: bool, today: datetime | None, changes: "Sequence[SetValue]"
) -> tuple[date, Arguments]:
    """Return the day on which waivers are judged, and the arguments for the check of a project's missions.

    If `is_among_others` is true, the run has several projects, and the arguments then also record the settings file
    of this project.
    """
    from bisar_budget.findings.requirement import Override

    with project.options() as context:
        judged_on, outside = day_and_outside(today)
    if is_among_others:
        settings = Override("settings", project.settings_file or "none", "folder nearest to the mission")
        outside = outside._replace(options=(*outside.options, settings))
    return judged_on, {"model": context.params["model"], "changes": changes, "outside": outside}


def _options(project: Project, judged_on: date | None, today: datetime | None) -> "list[Override]":
    """List the options that influence the verdicts on a project's missions, each with its value and origin."""
    with project.options() as context:
        return list(_options_in(context, judged_on, today))


def _options_in(context: click.Context, judged_on: date | None, today: datetime | None) -> "Iterator[Override]":
    from bisar_budget.findings.requirement import Override
    from bisar_budget.questions.outside import day_origin

    for parameter in context.command.params:
        name, value = str(parameter.name), context.params[str(parameter.name)]
        origin = origin_of(parameter)
        text = None
        if name == "model":
            text = value or "as in each file"
        elif name == "today":
            if value is None and judged_on is not None:
                origin = day_origin(today, COMMAND_LINE)
            text = "the day of the run (not recorded: no waiver depends on it)"
            text = judged_on.isoformat() if judged_on else text
        elif name == "changes":
            text = ", ".join(f"{change.key}={change.text}" for change in value)
        elif name == "swept":
            text = ", ".join(value)
        elif name == "draws":
            text = "no" if value is None else f"{value:,} draws"
        elif name == "seed" and context.params["draws"] is not None:
            text = "of each file" if value is None else str(value)
        elif name == "guarding":
            text = "yes" if value else None
        elif name in ("strict", "exit_zero", "verifying"):
            text = "yes" if value else "no"
        if text:
            yield Override(parameter.opts[0], text, origin)


def _check_draws(context: click.Context, scheduler: str | None) -> None:
    """Raise `click.UsageError` if the options for Monte Carlo draws are inconsistent.

    `--seed` and `--scheduler` need `--monte-carlo`, and more than `MAX_LOCAL_DRAWS` draws need a scheduler.
    """
    draws, seed = context.params["draws"], context.params["seed"]
    if draws is None:
        if seed is not None and context.get_parameter_source("seed") is ParameterSource.COMMANDLINE:
            raise click.UsageError("--seed needs --monte-carlo N.")
        if scheduler is not None:
            raise click.UsageError(f"--scheduler {scheduler}: shares out draws, and needs --monte-carlo N.")
    elif scheduler is None and draws > MAX_LOCAL_DRAWS:
        raise click.UsageError(
            f"--monte-carlo {draws:,}: must be at most {MAX_LOCAL_DRAWS:,} draws; with --scheduler ADDRESS, whose "
            f"workers share them, {MAX_DRAWS:,}."
        )


def _check_sweep(texts: Sequence[str], formats: Sequence[str]) -> None:
    """Raise `click.UsageError` if `--sweep` varies more than two keys, or if no requested report can show it."""
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
    projects: Sequence[Project],
    row_id: str,
    output: str | None,
    changes: "Sequence[SetValue]",
    today: datetime | None,
) -> None:
    """Write the explanation of the row or requirement with the id `row_id`, for every mission that has it."""
    from bisar_budget.findings.row import unknown_id
    from bisar_budget.mission.load import load_mission
    from bisar_budget.questions.checks import check as ask
    from bisar_budget.questions.outside import DAY_OF_RUN
    from bisar_budget.report.explain.explanation import explain, explain_requirement
    from bisar_budget.report.words.heading import other_overrides, wrapped_overrides
    from bisar_budget.report.words.requirements import requirement_id

    texts: list[str] = []
    ids: dict[str, None] = {}
    asked_by_project = {project: _asked(project, len(projects) > 1, today, changes) for project in projects}
    files = [file for project in projects for file in project.files]
    reads = [
        partial(load_mission, file, asked_by_project[project][1]["model"], changes)
        for project in projects
        for file in project.files
    ]
    asked_by_file = [asked_by_project[project] for project in projects for _ in project.files]
    for mission, (judged_on, arguments) in zip(read_all(reads), asked_by_file, strict=True):
        findings = ask(mission, date=judged_on, outside=arguments["outside"]).findings
        required = {requirement_id(requirement): requirement for requirement in findings.requirements}
        ids |= dict.fromkeys([*(row.id for row in findings.rows), *required])
        required |= {requirement.id: requirement for requirement in findings.requirements}
        if any(row.id == row_id for row in findings.rows):
            text = explain(mission, findings, row_id)
        elif row_id in required:
            text = explain_requirement(mission, findings, required[row_id])
        else:
            continue
        shown_overrides = tuple(override for override in findings.overrides if override.origin != DAY_OF_RUN)
        override_lines = wrapped_overrides(other_overrides(findings._replace(overrides=shown_overrides)))
        texts.append(text + "".join(f"{line}\n" for line in override_lines))
    if not texts:
        problem = closed(unknown_id(row_id, ids, files[0], "row or requirement"))
        raise click.UsageError(f"--explain {printable(row_id)}: {problem}")
    deliver("\n".join(texts), output)


def _format_of(name: str) -> str:
    """Return the report format that belongs to the suffix of a file name.

    Raises `click.UsageError` if the suffix is unknown.
    """
    from bisar_budget.report import format_of

    format_name = format_of(name)
    if format_name is None:
        suffixes = (suffix for form in FORMATS.values() for suffix in form.suffixes)
        raise click.UsageError(f"--report {name}: the suffix must be one of {', '.join(suffixes)}")
    return format_name


def _step_summary(format_name: str) -> str | None:
    """Path of the summary file of a GitHub Actions run, or None if no summary is to be written.

    The result is None outside GitHub Actions, or if the format is not `github`.
    """
    return (os.environ.get("GITHUB_STEP_SUMMARY") or None) if format_name == "github" else None


def _append_step_summary(path: str, report: "Report", style: "Style") -> None:
    """Append the summary of a report to the summary file of a GitHub Actions run.

    If the file cannot be written, only a warning is given.
    """
    from bisar_budget.report.formats.annotations import step_summary

    try:
        with open(path, "a", encoding="utf-8", errors="backslashreplace", newline="\n") as file:
            file.write(step_summary(report, style))
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        complain(f"warning: cannot write the step summary {printable(path)}: {reason}")


def _say_faults(missions: "Iterable[MissionFindings | UnusableMission | None]") -> None:
    """Write the faults of unusable missions to standard error."""
    from bisar_budget.findings.mission import UnusableMission

    for mission in missions:
        if isinstance(mission, UnusableMission):
            say_faults(mission.file, mission.faults)


def _write_report(path: str, format_name: str, report: "Report", style: "Style") -> None:
    """Write the pictures of a report and then its text, so that the text never names a missing picture."""
    from bisar_budget.extras import MissingExtraError
    from bisar_budget.report import content, pictures, render

    if FORMATS[format_name].is_binary:
        try:
            write_file(path, content(format_name, report, style))
        except MissingExtraError as error:
            fail(str(error))
        return
    folder = _folder_of_pictures(path, format_name)
    style = style._replace(assets=os.path.basename(folder))
    text = render(format_name, report, style)
    for name, picture in pictures(format_name, report, style).items():
        write_file(os.path.join(folder, name), picture)
    deliver(text, path, format_name)


def _folder_of_pictures(path: str, format_name: str) -> str:
    """Path of the folder for the pictures of the report `path`, beside the report.

    The result is empty if the format has no pictures, or if the report is not written to a regular file.
    """
    if not FORMATS[format_name].has_pictures or path == "-" or (os.path.exists(path) and not os.path.isfile(path)):
        return ""
    return f"{os.path.splitext(path)[0]}.assets"
