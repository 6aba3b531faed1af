"""Functions that check a mission many times: sweep, solve, sensitivity, allocate, passes and monte_carlo."""

import datetime as dt
import math
import os
from collections.abc import Mapping, Sequence
from numbers import Real
from typing import TYPE_CHECKING, Any

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.budget.waivers import overrides
from bisar_budget.constants import GATING_MODELS, TARGETS
from bisar_budget.faults import InvalidValueError, closed, printable, shown
from bisar_budget.findings.requirement import Outside, Override
from bisar_budget.front.checks import day_of, drawn_here, outside_of
from bisar_budget.front.missions import cases_of
from bisar_budget.front.progress import FORMING, foretell, watched, watched_checks
from bisar_budget.front.results import (
    AllocateResult,
    MonteCarloResult,
    PassesResult,
    SensitivityResult,
    SolveResult,
)
from bisar_budget.front.sweeps import SweepResult
from bisar_budget.mission.load import load_mission
from bisar_budget.mission.model import Mission
from bisar_budget.mission.quantities import QuestionError, text_of
from bisar_budget.mission.readers import Quantity
from bisar_budget.resources import cores
from bisar_budget.sampling.probability import monte_carlo as monte_carlo_of
from bisar_budget.units import ANGLE

if TYPE_CHECKING:
    from bisar_budget.design.cases import Cases
    from bisar_budget.design.compare import Comparison
    from bisar_budget.design.solve import Solution


def _judged(
    mission: Mission, model: str | None, date: str | dt.date | None, outside: Outside | None
) -> tuple[dt.date, tuple[Override, ...]]:
    """Find the day on which waivers are judged, and list the influences on the verdict from outside the mission file.

    Raises `QuestionError` for an unknown model.
    """
    if model not in (None, *GATING_MODELS):
        raise QuestionError(f"--model {printable(str(model))}: accepted: {', '.join(GATING_MODELS)}")
    today = day_of(date)
    return today, overrides(mission, outside or outside_of(model, date), today)


def sweep(
    mission: Mission,
    values: "Mapping[str, object] | str | os.PathLike[str] | Cases",
    *,
    paired: bool = False,
    columns: str | Sequence[str] = (),
    model: str | None = None,
    date: str | dt.date | None = None,
    jobs: int | None = None,
    outside: Outside | None = None,
) -> SweepResult:
    """Check a mission for every combination of values of its keys.

    Parameters
    ----------
    mission : Mission
        As in `check`.
    values : mapping, path or cases
        Values by the path of a key, such as `collection.aperture_time`. Values are a range such as
        `linspace("1 s", "5 s", 101)`, an array of numbers in SI, a quantity with an array, a list of strings with
        units, or a list of names, such as parts of the catalogue. Alternatively `values` is the path of a CSV file,
        whose header has `KEY [unit]` for each column.
    paired : bool
        If true, the n-th case takes the n-th value of every key. By default every combination of the values is a
        case.
    columns : str or sequence of str
        Further columns of the form `ROW.FIELD`, such as `receiver.velocity.x.allowable`.
    model, date, outside
        As in `check`.
    jobs : int, optional
        Number of processes, used if many cases cannot be checked as arrays, but have to be read one by one. By
        default the number of cores.

    Raises
    ------
    QuestionError
        A key or a column is unknown, or no value is given for a key.
    """
    today, influences = _judged(mission, model, date, outside)
    cases = cases_of(mission, values, paired) if isinstance(values, Mapping | str | os.PathLike) else values
    further_columns = (columns,) if isinstance(columns, str) else tuple(columns)
    return SweepResult(mission, cases, further_columns, model, today, jobs or cores(), influences)


def solve(
    mission: Mission,
    key: str,
    *,
    between: tuple[object, object] | str | None = None,
    scale: bool = False,
    row: str | None = None,
    target: str = "fail",
    verify: bool = False,
    model: str | None = None,
    date: str | dt.date | None = None,
    outside: Outside | None = None,
) -> SolveResult:
    """Find the values of a number at which a mission starts or stops complying with its requirements.

    Parameters
    ----------
    mission : Mission
        As in `check`.
    key : str
        Path of the number, such as `collection.aperture_time`. For keys such as
        `platforms.receiver.motion_error.sensor`, every part of the catalogue is tried.
    between : pair, optional
        Range of the search, such as `("0.2 s", "20 s")`. The default is a tenth to ten times the value of the file,
        and the full circle for an azimuth.
    scale : bool
        Whether to solve for a factor that multiplies all errors of a section; `key` is then the path of the section.
    row : str, optional
        Id of a row. If given, this row alone has to comply, instead of the whole mission.
    target : str
        With `fail`, a mission complies if nothing fails. With `warn`, it must have no warnings either.
    verify : bool
        Whether to form images at the solution, to verify the binding row, and add their verdict.
    model, date, outside
        As in `check`.

    Raises
    ------
    QuestionError
        The question cannot be answered for this mission, such as for an unknown key; the message says why.
    """
    from bisar_budget.design.compare import compare_parts, is_sensor_key
    from bisar_budget.design.solve import solve as solved

    today, influences = _judged(mission, model, date, outside)
    if target not in TARGETS:
        raise QuestionError(f"--target {printable(str(target))}: accepted: {' or '.join(TARGETS)}")
    if between is not None and not isinstance(between, str):
        between = "..".join(text_of("", end) for end in between)
    arguments: dict[str, Any] = {"row": row, "target": target, "model": model, "today": today}
    hold_to_parts(key, between, scale)
    solution: Solution | Comparison
    with watched_checks(mission.name) as progress:
        if is_sensor_key(key):
            solution = compare_parts(mission, key, **arguments, progress=progress)
        else:
            solution = solved(mission, key, between=between, is_scale=scale, **arguments, progress=progress)
    solution = solution._replace(overrides=influences)
    return SolveResult(_imaged(mission, solution, model) if verify else solution)


def hold_to_parts(key: str, between: object, scale: bool) -> None:
    """Raise an error if a range or a scale factor is given for a key whose values are parts of the catalogue.

    Raises
    ------
    QuestionError
        The key names a part of the catalogue, and `between` or `scale` is given.
    """
    from bisar_budget.design.compare import is_sensor_key

    if is_sensor_key(key) and (between is not None or scale):
        option = "--scale" if scale else "--between"
        raise QuestionError(f"{option}: {key} names parts of the catalogue, which are compared one by one.")


def _imaged(mission: Mission, solution: "Solution | Comparison", model: str | None) -> "Solution | Comparison":
    """Form images at the solution to verify the binding row, and return the solution with their verdict.

    If there is no row to image, the solution is returned unchanged.
    """
    from bisar_budget.design.imaged import imaged, to_image
    from bisar_budget.front.imaging import faster

    case = to_image(mission, solution, model)
    if case is None:
        return solution
    foretell(case.seconds, f"Forming the images of {case.row}", "without --verify none is formed" + faster())
    with watched(FORMING) as progress:
        return solution._replace(imaged=imaged(case, progress))


def sensitivity(
    mission: Mission,
    *,
    row: str | None = None,
    model: str | None = None,
    date: str | dt.date | None = None,
    outside: Outside | None = None,
) -> SensitivityResult:
    """Rank the numbers in a mission by their effects on its worst utilization, or on the utilization of `row`.

    The arguments are those of `solve`.
    """
    from bisar_budget.design.sensitivity import sensitivity as sensitivity_of

    today, influences = _judged(mission, model, date, outside)
    with watched_checks(mission.name) as progress:
        effects = sensitivity_of(mission, row=row, model=model, today=today, progress=progress)
    return SensitivityResult(effects._replace(overrides=influences))


def allocate(
    mission: Mission,
    keys: str | Sequence[str] | Mapping[str, float] | None = None,
    *,
    reserve: float | None = None,
    offer: Mission | None = None,
    model: str | None = None,
    date: str | dt.date | None = None,
    outside: Outside | None = None,
) -> AllocateResult:
    """Find specifications for the errors of a mission that together meet every requirement.

    Parameters
    ----------
    mission : Mission
        As in `check`.
    keys : str, sequence or mapping, optional
        Keys of the errors to specify, or positive weights by key; by default `allocation.specify` of the file, or
        else the usual keys.
    reserve : float, optional
        Fraction of every limit to keep free, 0 to 1; by default 1 minus `allocation.warn_above`.
    offer : Mission, optional
        Mission of a supplier, whose declared errors are compared with the specifications.
    model, date, outside
        As in `check`.

    Raises
    ------
    QuestionError
        The question cannot be answered for this mission, such as for an unknown key; the message says why.
    """
    from bisar_budget.design.allocate import allocate as allocated
    from bisar_budget.design.offers import offer as offered

    today, influences = _judged(mission, model, date, outside)
    if reserve is not None and not (isinstance(reserve, Real) and 0 <= reserve < 1):
        raise QuestionError(f"reserve {reserve!r}: accepted: a part from 0 to less than 1")
    weights = _weighted([keys] if isinstance(keys, str) else keys)
    with watched_checks(mission.name) as progress:
        sheet = allocated(mission, keys=weights, reserve=reserve, model=model, today=today, progress=progress)
    sheet = sheet._replace(overrides=influences)
    return AllocateResult(sheet, None if offer is None else offered(sheet, offer, today))


def _weighted(keys: Sequence[str] | Mapping[str, float] | None) -> Mapping[str, float] | None:
    """Return weights of the errors to specify, by key; keys given without weights get the weight 1, None stays None.

    Raises `QuestionError` for a weight that is not a positive number.
    """
    if not isinstance(keys, Mapping):
        return keys if keys is None else dict.fromkeys(keys, 1.0)
    for key, weight in keys.items():
        if not (isinstance(weight, Real) and 0 < weight < math.inf):
            raise QuestionError(f"--for {printable(key)}: has the weight {weight!r}; accepted: a number above 0")
    return keys


def passes(
    mission: Mission | str | os.PathLike[str],
    start: str | dt.date | None = None,
    *,
    days: float = 3.0,
    min_elevation: object = "20 deg",
    squint: object = "0 deg",
    platform: str | None = None,
    model: str | None = None,
    date: str | dt.date | None = None,
    outside: Outside | None = None,
) -> PassesResult:
    """List the passes of a satellite over the scene, with the verdict of the mission in each.

    Parameters
    ----------
    mission : Mission or path
        A mission with an orbit. A file needs no `collection.center_time`.
    start : str or date, optional
        First day (UTC), or an instant such as `2026-07-01T05:30:00Z`; by default the day of the check.
    days : float
        Length of the period that is searched for passes. [d]
    min_elevation, squint : str, float or quantity
        Minimum elevation of the satellite as seen from the scene, and squint angle at the mid-time of the aperture.
        Each is a string with a unit, or a number in radians.
    platform : str, optional
        Which platform is the satellite, `transmitter` or `receiver`; by default the first platform with an orbit.
    model, date, outside
        As in `check`.

    Raises
    ------
    QuestionError
        The passes cannot be found, for example because the mission has no orbit; the message says why.
    """
    from bisar_budget.design.passes import passes as find_passes
    from bisar_budget.design.passes import start_of

    loaded = mission if isinstance(mission, Mission) else load_mission(os.fspath(mission), is_placed=False)
    today, influences = _judged(loaded, model, date, outside)
    least, squint_rad = angle_of("--min-elevation", min_elevation, 0.0), angle_of("--squint", squint, -90.0)
    with watched("Checking passes") as progress:
        found_passes = find_passes(
            loaded,
            start_of(str(start) if start is not None else today.isoformat()),
            days=days,
            min_elevation=least,
            squint=squint_rad,
            platform=platform,
            model=model,
            today=today,
            progress=progress,
        )
    return PassesResult(found_passes._replace(overrides=influences), loaded, model)


def angle_of(option: str, value: object, least: float) -> float:
    """Convert the value of an angle option to radians; it must lie between `least` [deg] and 90 deg.

    Raises
    ------
    QuestionError
        The value is not an angle, or is out of range.
    """
    bounds = {"ge": 0.0} if least == 0 else {"gt": math.radians(least)}
    text = text_of("rad", value)
    try:
        return Quantity(ANGLE, lt=math.pi / 2, **bounds).leaf(text)
    except InvalidValueError as error:
        raise QuestionError(f"{option} {shown(text)}: {closed(error.problem.words)}") from None


def monte_carlo(mission: Mission, draws: int = 20_000, *, seed: int | None = None) -> MonteCarloResult:
    """Draw the declared errors from their distributions, and count how often each requirement is met.

    Parameters
    ----------
    mission : Mission
        As in `check`.
    draws : int
        Number of draws.
    seed : int, optional
        Seed of the random numbers; by default `simulation.seed` of the mission file, or else 1. The same seed gives
        the same result.

    Raises
    ------
    ValueError
        The number of draws is too large or too small.
    """
    return MonteCarloResult(monte_carlo_of(Analysis(mission, is_complete=True), *drawn_here(draws, seed)))
