"""Sweeps that reports of `check` show, `--sweep KEY=VALUES`, and the sheets of files that name what to specify."""

from collections import Counter
from collections.abc import Callable, Sequence
from datetime import date
from functools import partial

import click

from bisar_budget import __version__
from bisar_budget.cli.long_work import watched
from bisar_budget.cli.streams import fail
from bisar_budget.design.cases import Cases, Grid, grid
from bisar_budget.design.sweep import sweep
from bisar_budget.findings.mission import FileWarning, MissionFindings, UnusableMission
from bisar_budget.findings.status import complying
from bisar_budget.findings.trade import TradeStudy
from bisar_budget.mission.model import Mission
from bisar_budget.mission.quantities import QuestionError, tree_of
from bisar_budget.phrases import no_specifications
from bisar_budget.report import FORMATS
from bisar_budget.report.drawing.trades import Gathered, uses_of_rows
from bisar_budget.report.tables import Described
from bisar_budget.resources import cores

MAX_CASES = 40_000  # of a page, which has no room for more
_OPTION = "--sweep"


def check_options(texts: Sequence[str], formats: Sequence[str]) -> None:
    """Refuse a sweep that no report shows, and more keys than a drawing has axes."""
    if not any(FORMATS[name].is_illustrated for name in formats):
        raise click.UsageError(
            "--sweep is shown in a compliance report; accepted: --report FILE.html or FILE.md, or --format html or "
            "markdown. `bisar-budget sweep` writes tables and plots."
        )
    if len(texts) > 2:
        raise click.UsageError(f"--sweep draws one key or two, and there are {len(texts)}.")


def with_studies(
    missions: Sequence[MissionFindings | UnusableMission], texts: Sequence[str], model: str | None, today: date
) -> list[MissionFindings | UnusableMission]:
    """Add to each mission that can be used what a sweep of it finds; exits where one cannot be asked."""
    usable = [found.analysed().mission for found in missions if isinstance(found, MissionFindings)]
    asked = {}
    for mission in usable:
        try:
            asked[mission.file] = _cases(mission, texts)
        except QuestionError as error:
            fail(f"{mission.file}: {error}")
    result: list[MissionFindings | UnusableMission] = []
    done, total = 0, sum(cases.count for cases in asked.values())
    with watched("Checking cases", total) as progress:

        def advance(cases: int) -> None:
            nonlocal done
            done += cases
            progress(done, total)

        for found in missions:
            if isinstance(found, UnusableMission):
                result.append(found)
                continue
            mission = found.analysed().mission
            cases = asked[mission.file]
            again = partial(gathered, mission, cases, model, today)
            try:
                trade = again((), advance).trade()
                rows = uses_of_rows(trade, again)
            except QuestionError as error:
                fail(f"{mission.file}: {error}")
            counts = Counter(trade.values["status"].ravel().tolist())
            study = TradeStudy(
                asked=tuple(texts),
                trade=trade,
                rows=rows,
                cases=cases.count,
                complying=complying(counts),
                unevaluated=counts["not_evaluated"],
                missing=counts["error"],
                day=today,
                model=model,
            )
            result.append(found._replace(study=study))
    return result


def _cases(mission: Mission, texts: Sequence[str]) -> Grid:
    """Read the cases, and hold them to what a page can show."""
    cases = grid(tree_of(mission), texts, _OPTION)
    for one, size in zip(cases.varied, cases.shape, strict=True):
        if size < 2:
            raise QuestionError(f"{_OPTION} {one.key}: has one value; accepted: several. --set puts in one")
    if cases.count > MAX_CASES:
        raise QuestionError(
            f"{_OPTION}: {cases.count} cases; accepted: up to {MAX_CASES}, for which a page has room. "
            "`bisar-budget sweep` checks more"
        )
    return cases


def gathered(
    mission: Mission,
    cases: Cases,
    model: str | None,
    today: date,
    columns: Sequence[str],
    advance: Callable[[int], None] = lambda _: None,
    jobs: int | None = None,
) -> Gathered:
    """Check all cases, and gather what a drawing needs, and some columns; `advance` is told how many are done."""
    swept = sweep(mission, cases, columns=columns, model=model, today=today, jobs=jobs or cores())
    found = Gathered(Described(swept, cases, mission, __version__), ("binding_requirement", *columns))
    for part in swept.parts:
        found.add(part)
        advance(part.stop - part.start)
    return found


# ---------------------------------------------------------------- specifications
def with_sheets(
    missions: Sequence[MissionFindings | UnusableMission], model: str | None, today: date
) -> list[MissionFindings | UnusableMission]:
    """Add the sheet of specifications to each mission whose file names what to specify, or say why there is none."""
    return [_with_sheet(found, model, today) if isinstance(found, MissionFindings) else found for found in missions]


def _with_sheet(found: MissionFindings, model: str | None, today: date) -> MissionFindings:
    mission = found.analysed().mission
    if not mission.allocation.specify:
        return found
    from bisar_budget.design.allocate import allocate

    try:
        return found._replace(sheet=allocate(mission, model=model, today=today))
    except QuestionError as error:
        said = FileWarning(mission.line(("allocation", "specify")), no_specifications(str(error)))
        return found._replace(warnings=(*found.warnings, said))
