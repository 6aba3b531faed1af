"""Checks of missions, and the optional parts of reports: Monte Carlo, images, trade studies and specifications."""

import datetime as dt
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, ParamSpec, TypeVar, cast

from bisar_budget import __version__, phrases
from bisar_budget.budget.check import (
    CheckedMission,
    Draws,
    check_files,
    check_mission,
    whole,
    without_analysis,
)
from bisar_budget.faults import SetValue
from bisar_budget.findings.mission import FileWarning, MissionFindings, Report
from bisar_budget.findings.requirement import NOTHING_OUTSIDE, Outside
from bisar_budget.findings.status import complying
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.model import Mission
from bisar_budget.mission.quantities import QuestionError, tree_of
from bisar_budget.questions.drawn_errors import drawn_here
from bisar_budget.questions.outside import day_of, outside_of
from bisar_budget.questions.progress import watched
from bisar_budget.report import Piece, Style, piece
from bisar_budget.resources import cores

if TYPE_CHECKING:
    from bisar_budget.findings.case_table import Cases
    from bisar_budget.questions.asked import Asked
    from bisar_budget.questions.results import CheckResult
    from bisar_budget.report.drawing.trades import Gathered

MAX_STUDY_CASES = 40_000  # a report page has no room for more cases of a study
MAX_STUDY_KEY_COUNT = 2  # a drawing has no axes for more keys of a study
Arguments = ParamSpec("Arguments")
Answer = TypeVar("Answer")
_OPTION = "--sweep"


# ---------------------------------------------------------------------- one mission
def check(
    mission: Mission,
    *,
    model: str | None = None,
    date: str | dt.date | None = None,
    monte_carlo: int | None = None,
    seed: int | None = None,
    verify: bool = False,
    sweep: Mapping[str, object] | None = None,
    outside: Outside | None = None,
    guard: bool = False,
) -> "CheckResult":
    """Check a mission against its requirements.

    Parameters
    ----------
    mission : Mission
        A result of `load`, `loads` or `Mission.replace`.
    model : str, optional
        Model that replaces the model of the mission: `published`, `full` or `strictest`.
    date : str or date, optional
        Day on which waivers are judged; by default the day of SOURCE_DATE_EPOCH, or else today, UTC.
    monte_carlo : int, optional
        Number of draws of the errors, to report how often each requirement is met.
    seed : int, optional
        Seed of these draws, as in the function `monte_carlo`.
    verify : bool
        Whether to form images with errors at the limits; their verdicts then also influence the status.
    sweep : mapping, optional
        Values of one or two keys, as in the function `sweep`. The mission is also checked with each of these values,
        and the report shows the results.
    outside : Outside, optional
        Origins of `model` and `date` to name in the report. By default both come from the caller.
    guard : bool
        Whether to compute the probability that each verdict is wrong, because figures of the mission have a stated
        uncertainty. The mission is checked twice more for each of these figures.

    Raises
    ------
    MissionError
        The model is unknown.
    QuestionError
        There are too many values in `sweep`, or they do not fit the mission, for example because a key is unknown.
    """
    from bisar_budget.questions.results import CheckResult

    today, influences = day_of(date), outside or outside_of(model, date)
    if model is not None:
        mission = parse_mission(mission.data, mission.file, model, changes=mission.changes)
    findings = check_mission(mission, today, outside=influences)
    if monte_carlo is not None:
        from bisar_budget.sampling.probability import monte_carlo as drawn

        findings = findings._replace(monte_carlo=drawn(findings.analysed(), *drawn_here(monte_carlo, seed)))
    if guard:
        from bisar_budget.questions.guarding import with_guard

        findings = cast("MissionFindings", with_guard(findings, today))
    if verify:
        findings = cast("MissionFindings", with_images([findings], today, is_illustrated=True)[0])
    if sweep:
        findings = cast("MissionFindings", with_studies([findings], sweep, model, today)[0])
    return CheckResult(findings, model, today)


# ---------------------------------------------------------------------- many files
def checked(
    files: Sequence[str],
    today: dt.date,
    *,
    model: str | None = None,
    changes: Sequence[SetValue] = (),
    outside: Outside = NOTHING_OUTSIDE,
    drawn: "Draws | None" = None,
    is_verified: bool = False,
    swept: Sequence[str] = (),
    is_illustrated: bool = False,
    is_guarded: bool = False,
) -> list[CheckedMission]:
    """Check mission files, and add the optional parts of the report that were requested.

    Parameters
    ----------
    files : sequence of str
        Names of mission files; `-` is standard input.
    today : date
        Day on which waivers are judged, UTC.
    model, changes, outside
        As in `check_files`.
    drawn : Draws, optional
        Number of draws and seed of a Monte Carlo simulation; by default there is no simulation.
    is_verified : bool
        Whether to form images with errors at the limits, and add their verdicts.
    swept : sequence of str
        Strings `KEY=VALUES` with the values of one or two keys for a trade study; empty if no study is requested.
    is_illustrated : bool
        Whether the report can show pictures. Analyses and images are then kept, and specifications are added.
    is_guarded : bool
        Whether to add the probabilities that verdicts are wrong, because figures have a stated uncertainty.

    Raises
    ------
    QuestionError
        The values of `swept` do not fit a mission; the message begins with the name of its file.
    """
    keep: Callable[[CheckedMission], CheckedMission] = whole if is_verified or is_illustrated else without_analysis
    if is_guarded and keep is without_analysis:
        keep = partial(_guarded_alone, today=today)
    results = check_files(files, today, model, keep, drawn=drawn, changes=changes, outside=outside)
    if is_guarded and keep is whole:
        from bisar_budget.questions.guarding import with_guard

        results = [with_guard(findings, today) for findings in results]
    if is_verified:
        results = with_images(results, today, is_illustrated=is_illustrated)
    if swept:
        results = with_studies(results, swept, model, today)
    return with_sheets(results, model, today) if is_illustrated else results


def _guarded_alone(findings: CheckedMission, today: dt.date) -> CheckedMission:
    """Add the probabilities that verdicts are wrong to the findings, and remove their analysis."""
    from bisar_budget.questions.guarding import with_guard

    return without_analysis(with_guard(findings, today))


def pieces(
    files: Sequence[str],
    today: dt.date,
    format_name: str,
    style: Style,
    *,
    model: str | None = None,
    changes: Sequence[SetValue] = (),
    outside: Outside = NOTHING_OUTSIDE,
) -> list[Piece]:
    """Check mission files, and return the part of the report for each file.

    The findings of a file are not kept in memory.
    """
    keep = partial(piece, format_name=format_name, style=style)
    return check_files(files, today, model, keep, changes=changes, outside=outside)


# ---------------------------------------------------------------------- images
def with_images(missions: Sequence[CheckedMission], today: dt.date, *, is_illustrated: bool) -> list[CheckedMission]:
    """Form images of each usable mission with errors at their limits, and add the verdicts from these images.

    If `is_illustrated`, images for the most important rows are added too. Unusable missions are returned unchanged.
    """
    from bisar_budget.budget.verdicts import with_verdicts
    from bisar_budget.questions.verify import verify_all
    from bisar_budget.verifier.limits import form_image_evidence

    usable = [findings.analysed().mission for findings in missions if isinstance(findings, MissionFindings)]
    verified = iter(verify_all(usable) if usable else ())
    result: list[CheckedMission] = []
    for findings in missions:
        if isinstance(findings, MissionFindings):
            findings = with_verdicts(findings, next(verified), today)
            if is_illustrated:
                findings = findings._replace(
                    image_evidence=form_image_evidence(findings.analysed().mission, findings)
                )
            else:
                findings = findings._replace(analysis=None)
        result.append(findings)
    return result


# ---------------------------------------------------------------------- studies
def with_studies(
    missions: Sequence[CheckedMission], asked: Sequence[str] | Mapping[str, object], model: str | None, today: dt.date
) -> list[CheckedMission]:
    """Check each usable mission with all given values of one or two keys, and add the results as a trade study.

    `asked` contains the values, as strings `KEY=VALUES` or as a mapping of keys to values. Unusable missions are
    returned unchanged.

    Raises
    ------
    QuestionError
        The values do not fit a mission; the message begins with the name of its file.
    """
    from bisar_budget.findings.trade import TradeStudy
    from bisar_budget.questions.asked import Asked
    from bisar_budget.questions.table import listed
    from bisar_budget.report.drawing.trades import uses_of_rows

    usable = [findings.analysed().mission for findings in missions if isinstance(findings, MissionFindings)]
    all_cases = [_of(mission, study_cases, mission, asked) for mission in usable]
    done, total = 0, sum(cases.count for cases in all_cases)
    studies = []
    with watched("Checking cases") as progress:

        def advance(cases: int) -> None:
            nonlocal done
            done += cases
            progress(done, total)

        for mission, cases in zip(usable, all_cases, strict=True):
            check_again = partial(gathered, _of(mission, Asked, mission, cases, model=model, today=today))
            trade = _of(mission, check_again, (), advance).trade()
            rows = _of(mission, uses_of_rows, trade, check_again)
            counts = Counter(trade.values["status"].ravel().tolist())
            waivers = trade.values["waived_by"].ravel().tolist()
            study = TradeStudy(
                asked=tuple(asked),
                trade=trade,
                rows=rows,
                cases=cases.count,
                complying=complying(counts),
                waived=counts["waived"],
                waived_by=tuple(dict.fromkeys(waiver for cell in waivers for waiver in listed(cell))),
                unevaluated=counts["not_evaluated"],
                missing=counts["error"],
                day=today,
                model=model,
            )
            studies.append(study)
    next_study = iter(studies)
    return [each._replace(study=next(next_study)) if isinstance(each, MissionFindings) else each for each in missions]


def _of(
    mission: Mission, ask: Callable[Arguments, Answer], *arguments: Arguments.args, **options: Arguments.kwargs
) -> Answer:
    """Call the function `ask` with the arguments, and return its result.

    If the function raises `QuestionError`, the message is prefixed with the file name of `mission`.
    """
    try:
        return ask(*arguments, **options)
    except QuestionError as error:
        raise QuestionError(f"{mission.file}: {error}") from None


def study_cases(mission: Mission, asked: Sequence[str] | Mapping[str, object]) -> "Cases":
    """Make the cases of a trade study, one for every combination of the values of its keys.

    Raises `QuestionError` for more than two keys, a key with a single value, or more than `MAX_STUDY_CASES` cases.
    """
    from bisar_budget.questions.cases import grid
    from bisar_budget.questions.missions import grid_of

    if len(asked) > MAX_STUDY_KEY_COUNT:
        raise QuestionError(f"{_OPTION} draws one key or two, and there are {len(asked)}.")
    cases = grid_of(mission, asked) if isinstance(asked, Mapping) else grid(tree_of(mission), asked, _OPTION)
    for varied, size in zip(cases.varied, cases.shape, strict=True):
        if size < 2:
            raise QuestionError(f"{_OPTION} {varied.key}: has one value; accepted: several. --set puts in one")
    if cases.count > MAX_STUDY_CASES:
        raise QuestionError(
            f"{_OPTION}: {cases.count} cases; accepted: up to {MAX_STUDY_CASES}, for which a page has room. "
            "`bisar-budget sweep` checks more"
        )
    return cases


def gathered(
    asked: "Asked",
    columns: Sequence[str],
    advance: Callable[[int], None] = lambda _: None,
    jobs: int | None = None,
) -> "Gathered":
    """Check all cases of a sweep, and gather the columns of its table that a drawing needs.

    `columns` are further columns to gather. `advance` is called after each part of the cases is checked, with the
    number of cases in this part.
    """
    from bisar_budget.report.drawing.trades import Gathered
    from bisar_budget.report.tables import Described

    swept = asked.again(columns=columns).checked(jobs or cores())
    described = Described(swept, asked.cases, asked.mission, __version__)
    drawing_data = Gathered(described, ("binding_requirement", "waived_by", *columns))
    for part in swept.parts:
        drawing_data.add(part)
        advance(part.stop - part.start)
    return drawing_data


# ---------------------------------------------------------------------- specifications
def with_sheets(missions: Sequence[CheckedMission], model: str | None, today: dt.date) -> list[CheckedMission]:
    """Find specifications for the errors of each mission whose file has `allocation.specify`.

    The specifications are added to the findings of the mission. If no specifications can be found for a mission, its
    findings get a warning that states the reason.
    """
    return [
        _with_sheet(findings, model, today) if isinstance(findings, MissionFindings) else findings
        for findings in missions
    ]


def _with_sheet(findings: MissionFindings, model: str | None, today: dt.date) -> MissionFindings:
    mission = findings.analysed().mission
    if not mission.allocation.specify:
        return findings
    from bisar_budget.questions.allocate import allocate

    try:
        sheet = allocate(mission, model=model, date=today).found
        return findings._replace(sheet=sheet._replace(overrides=()))
    except QuestionError as error:
        warning = FileWarning(
            mission.line(("allocation", "specify")), phrases.note("no-specifications", why=str(error))
        )
        return findings._replace(warnings=(*findings.warnings, warning))


# ---------------------------------------------------------------------- repositories
def with_work_trees(report: Report) -> Report:
    """Add the states of the git repositories of the mission files to a report, for the formats that show them."""
    from bisar_budget.mission.inputs import input_files
    from bisar_budget.mission.work_tree import work_trees

    inputs: dict[str, list[str]] = {}
    for findings in report.missions:
        mission = findings.mission if isinstance(findings, MissionFindings) else None
        files = [] if mission is None else input_files(mission)
        inputs[findings.file] = [file.path for file in files if file.path]
    return report._replace(work_trees=work_trees(inputs))
