"""Questions of a mission: what `import bisar_budget as bb` offers beside reading one."""

import datetime as dt
import os
from collections.abc import Mapping, Sequence
from typing import Any

from bisar_budget.budget.check import check_mission
from bisar_budget.budget.waivers import Outside, overrides
from bisar_budget.design.table import Swept
from bisar_budget.findings.requirement import Override
from bisar_budget.front.missions import cases_of
from bisar_budget.front.progress import watched, watched_parts
from bisar_budget.front.results import (
    AllocateResult,
    CheckResult,
    MonteCarloResult,
    PassesResult,
    SensitivityResult,
    SimulateResult,
    SolveResult,
    SweepResult,
    VerifyResult,
)
from bisar_budget.mission.given import text_of
from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.mission.model import Mission
from bisar_budget.resources import cores
from bisar_budget.units import ANGLE, parse_quantity

_CALLER = "the caller"


def day_of(given: str | dt.date | None) -> dt.date:
    """Day on which waivers are judged: one that is given, else of SOURCE_DATE_EPOCH, else today, UTC.

    Raises
    ------
    ValueError
        It is no day.
    """
    if isinstance(given, dt.datetime):
        return given.date()
    if given is not None:
        return given if isinstance(given, dt.date) else dt.date.fromisoformat(given)
    epoch = os.environ.get("SOURCE_DATE_EPOCH")
    return dt.datetime.fromtimestamp(int(epoch), dt.UTC).date() if epoch else dt.datetime.now(dt.UTC).date()


def _outside(model: str | None, given: str | dt.date | None) -> Outside:
    """Influences of a question's arguments on its verdict."""
    options = () if model is None else (Override("--model", model, _CALLER),)
    origin = "environment, SOURCE_DATE_EPOCH" if os.environ.get("SOURCE_DATE_EPOCH") else "the day of the run"
    return Outside(options, _CALLER if given is not None else origin, given is not None, _CALLER)


def _with_model(mission: Mission, model: str | None) -> Mission:
    """The mission with another gating model, as `--model` puts it."""
    if model is None:
        return mission
    return parse_mission(mission.data, mission.file, model, changes=mission.changes)


def check(mission: Mission, *, model: str | None = None, date: str | dt.date | None = None) -> CheckResult:
    """Check a mission against its requirements.

    Parameters
    ----------
    mission : Mission
        Of `load`, `loads` or `Mission.replace`.
    model : str, optional
        `published`, `full` or `strictest` in place of the mission's own.
    date : str or date, optional
        Day on which waivers are judged; omitted: that of SOURCE_DATE_EPOCH, else today, UTC.

    Raises
    ------
    MissionError
        The model is none.
    """
    return CheckResult(check_mission(_with_model(mission, model), day_of(date), outside=_outside(model, date)))


def sweep(
    mission: Mission,
    values: Mapping[str, Any],
    *,
    columns: Sequence[str] = (),
    model: str | None = None,
    date: str | dt.date | None = None,
    jobs: int | None = None,
) -> SweepResult:
    """Check a mission for every combination of values of its keys.

    Parameters
    ----------
    mission : Mission
        As of `check`.
    values : mapping
        By the path of a key, such as `collection.aperture_time`: `linspace("1 s", "5 s", 101)`, an array of numbers
        in SI, a quantity that holds an array, a list of texts with units, or of words such as parts of the catalogue.
    columns : sequence of str
        Columns more, `ROW.FIELD` such as `receiver.velocity.x.allowable`.
    model, date
        As of `check`.
    jobs : int, optional
        Processes, for cases that are read one by one; omitted: the number of cores.

    Raises
    ------
    QuestionError
        No such key, no value for it, no such column.
    """
    from bisar_budget.design.sweep import Asked

    cases, today = cases_of(mission, values), day_of(date)

    def ask(more: Sequence[str]) -> Swept:
        asked = Asked(mission, cases, columns=(*columns, *more), model=model, today=today)
        chunks = asked.chunks()
        return asked.swept(watched_parts(asked.shared_out(chunks, chunks.starts, jobs or cores()), cases.count))

    Asked(mission, cases, columns=columns, model=model, today=today)  # a question that cannot be asked is said here
    return SweepResult(mission, cases, ask)


def solve(
    mission: Mission,
    key: str,
    *,
    between: tuple[Any, Any] | str | None = None,
    row: str | None = None,
    target: str = "fail",
    model: str | None = None,
    date: str | dt.date | None = None,
) -> SolveResult:
    """Find the values of a number at which a mission begins or ceases to comply.

    Parameters
    ----------
    mission : Mission
        As of `check`.
    key : str
        Path of the number, such as `collection.aperture_time`.
    between : pair, optional
        Range to look at, `("0.2 s", "20 s")`; omitted: a tenth to ten times the file's value, of an azimuth the
        circle.
    row : str, optional
        The row that has to comply, instead of the whole mission.
    target : str
        What must not happen: `fail`, or also `warn`.
    model, date
        As of `check`.

    Raises
    ------
    QuestionError
        The question cannot be asked of this mission.
    """
    from bisar_budget.design.solve import solve as solved

    if between is not None and not isinstance(between, str):
        between = "..".join(text_of("", one) for one in between)
    with watched("Checking values") as progress:
        found = solved(
            mission, key, between=between, row=row, target=target, model=model, today=day_of(date), progress=progress
        )
    return SolveResult(found._replace(overrides=overrides(mission, _outside(model, date), day_of(date))))


def sensitivity(
    mission: Mission, *, row: str | None = None, model: str | None = None, date: str | dt.date | None = None
) -> SensitivityResult:
    """Rank the numbers of a mission by what they do to its worst utilization; arguments are those of `solve`."""
    from bisar_budget.design.sensitivity import sensitivity as asked

    with watched("Checking values") as progress:
        found = asked(mission, row=row, model=model, today=day_of(date), progress=progress)
    return SensitivityResult(found._replace(overrides=overrides(mission, _outside(model, date), day_of(date))))


def allocate(
    mission: Mission,
    keys: Sequence[str] | Mapping[str, float] | None = None,
    *,
    reserve: float | None = None,
    model: str | None = None,
    date: str | dt.date | None = None,
) -> AllocateResult:
    """Find specifications for the errors of a mission that together meet every requirement.

    Parameters
    ----------
    mission : Mission
        As of `check`.
    keys : sequence or mapping, optional
        Keys of the errors to specify, or their weights; omitted: `allocation.specify` of the file, else the usual.
    reserve : float, optional
        Part of every limit that is kept free, 0 to 1; omitted: what `allocation.warn_above` leaves.
    model, date
        As of `check`.

    Raises
    ------
    QuestionError
        The question cannot be asked of this mission.
    """
    from bisar_budget.design.allocate import allocate as allocated

    wanted = keys if keys is None or isinstance(keys, Mapping) else dict.fromkeys(keys, 1.0)
    with watched("Checking sizes") as progress:
        found = allocated(mission, keys=wanted, reserve=reserve, model=model, today=day_of(date), progress=progress)
    return AllocateResult(found._replace(overrides=overrides(mission, _outside(model, date), day_of(date))))


def passes(
    mission: Mission | str | os.PathLike[str],
    start: str | dt.date | None = None,
    *,
    days: float = 3.0,
    min_elevation: Any = "20 deg",
    squint: Any = "0 deg",
    platform: str | None = None,
    model: str | None = None,
    date: str | dt.date | None = None,
) -> PassesResult:
    """List the passes of a satellite over the scene, with the verdict of the mission in each.

    Parameters
    ----------
    mission : Mission or path
        Of which a platform has an orbit. A file needs no `collection.center_time`.
    start : str or date, optional
        Day of UTC to begin with, or an instant such as `2026-07-01T05:30:00Z`; omitted: the day of the check.
    days : float
        How many to look at.
    min_elevation, squint : str, float or quantity
        Least elevation seen from the scene, and the squint of the mid-time: texts with a unit, or radians.
    platform : str, optional
        Whose passes: `transmitter` or `receiver`; omitted: the one that has an orbit, of two the transmitter.
    model, date
        As of `check`.

    Raises
    ------
    QuestionError
        The question cannot be asked of this mission.
    """
    from bisar_budget.design.passes import passes as listed
    from bisar_budget.design.passes import start_of

    asked = mission if isinstance(mission, Mission) else load_mission(os.fspath(mission), is_placed=False)
    judged_on = day_of(date)
    least, wanted = (parse_quantity(text_of("rad", one), ANGLE) for one in (min_elevation, squint))
    with watched("Checking passes") as progress:
        found = listed(
            asked,
            start_of(str(start) if start is not None else judged_on.isoformat()),
            days=days,
            min_elevation=least,
            squint=wanted,
            platform=platform,
            model=model,
            today=judged_on,
            progress=progress,
        )
    return PassesResult(found._replace(overrides=overrides(asked, _outside(model, date), judged_on)))


def monte_carlo(mission: Mission, draws: int = 20_000, *, seed: int | None = None) -> MonteCarloResult:
    """Draw the declared errors from their distributions, and count how often each requirement holds.

    Parameters
    ----------
    mission : Mission
        As of `check`.
    draws : int
        How often.
    seed : int, optional
        Omitted: `simulation.seed` of the mission file, else 1. The same seed gives the same result.

    Raises
    ------
    ValueError
        So many draws cannot be made.
    """
    from bisar_budget.analysis.analysis import Analysis
    from bisar_budget.sampling.probability import monte_carlo as drawn

    return MonteCarloResult(drawn(Analysis(mission, is_whole=True), draws, seed))


def verify(mission: Mission, only: str = "*", *, jobs: int | None = None) -> VerifyResult:
    """Form images at the limits of a mission, and measure whether they are true.

    Parameters
    ----------
    mission : Mission
        As of `check`.
    only : str
        Glob of row ids.
    jobs : int, optional
        Processes; omitted: the number of cores, or 1 with the extra `fast`, which uses all cores itself.
    """
    from bisar_budget.simulator.image_formation import is_compiled
    from bisar_budget.verifier.limits import verify_mission

    with watched("Forming images") as progress:
        return VerifyResult(verify_mission(mission, only, jobs or (1 if is_compiled() else cores()), progress))


def simulate(mission: Mission, targets: str | None = None, *, image_former: str = "backprojection") -> SimulateResult:
    """Form the image of a point, or of a scene, with the declared errors, before and after autofocus.

    Parameters
    ----------
    mission : Mission
        As of `check`.
    targets : str, optional
        What stands in the scene, as `simulate --targets` has it; omitted: one point at its centre.
    image_former : str
        `backprojection`, `polar_format`, `matched_filter` or `far_field`.

    Raises
    ------
    SimulationError
        The images cannot be formed as asked; says what to change.
    """
    from bisar_budget.simulator.point import simulate_point
    from bisar_budget.simulator.targets import Targets, parse_targets

    standing = Targets() if targets is None else parse_targets(targets)
    with watched("Forming images") as progress:
        return SimulateResult(simulate_point(mission, progress, image_former=image_former, targets=standing), mission)
