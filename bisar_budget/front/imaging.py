"""Functions that simulate images of a mission, with errors at the limits of its rows or with its declared errors."""

from collections.abc import Sequence
from datetime import date
from typing import TYPE_CHECKING

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.budget.waivers import overrides
from bisar_budget.extras import install_command
from bisar_budget.faults import printable
from bisar_budget.findings.images import VerifiedMission
from bisar_budget.findings.requirement import NOTHING_OUTSIDE, Outside
from bisar_budget.findings.row import where_ids_are
from bisar_budget.front.checks import outside_of
from bisar_budget.front.progress import FORMING, foretell, is_heard, watched
from bisar_budget.front.results import SimulateResult, VerifyResult
from bisar_budget.mission.model import Mission
from bisar_budget.mission.quantities import QuestionError
from bisar_budget.resources import cores
from bisar_budget.simulator.image_formation import is_compiled
from bisar_budget.simulator.point import SimulationError as SimulationError
from bisar_budget.simulator.point import simulate_point
from bisar_budget.simulator.targets import Targets, parse_targets
from bisar_budget.verifier.limits import rows_to_verify, seconds_to_verify, verify_mission

if TYPE_CHECKING:
    from bisar_budget.cluster.scheduler import Workers


def verify(mission: Mission, only: str = "*", *, jobs: int | None = None) -> VerifyResult:
    """Form images with errors at the limits of a mission's rows, and measure whether the limits are correct.

    Parameters
    ----------
    mission : Mission
        As in `check`.
    only : str
        Glob pattern that selects row ids.
    jobs : int, optional
        Number of processes; by default the number of cores, or 1 with the extra `fast`, which uses all cores itself.

    Raises
    ------
    QuestionError
        No row with a limit has an id that matches the pattern `only`.
    """
    (verified,) = verify_all([mission], only, jobs, outside=outside_of(None, None))
    return VerifyResult(verified)


def verify_all(
    missions: Sequence[Mission],
    only: str = "*",
    jobs: int | None = None,
    workers: "Workers | None" = None,
    *,
    outside: Outside = NOTHING_OUTSIDE,
) -> list[VerifiedMission]:
    """Form images at the limits of several missions, in processes on this machine or on the workers of a scheduler.

    `outside` describes influences on the verdicts from outside the mission files. The other arguments and the
    exceptions are those of `verify`.
    """
    analysed = [(mission, Analysis(mission)) for mission in missions]
    total = sum(len(rows_to_verify(mission, only, analysis)) for mission, analysis in analysed)
    if not total and only != "*":
        where_listed = where_ids_are(missions[0].file)
        raise QuestionError(
            f"--only {printable(only)}: no row with a limit matches, nothing was verified; {where_listed}."
        )
    jobs = workers.threads if workers else jobs or (1 if is_compiled() else cores())
    if is_heard():
        seconds = sum(seconds_to_verify(mission, only, jobs, analysis) for mission, analysis in analysed)
        advice = "--only looks at some of them" + faster(None if workers else jobs)
        foretell(seconds, f"Forming the images of {total} rows", advice)
    verified_missions: list[VerifiedMission] = []
    with watched(FORMING) as progress:
        for mission, analysis in analysed:
            before = sum(len(verified.rows) for verified in verified_missions)

            def formed(done: int, _: int, before: int = before) -> None:
                progress(before + done, total)

            mapped = workers.mapped if workers else None
            images = verify_mission(mission, only, jobs, formed, mapped, analysis)
            options = overrides(mission._replace(waivers=()), outside, date.min)  # images waive nothing
            verified_missions.append(images._replace(overrides=options))
    return verified_missions


def faster(jobs: int | None = None) -> str:
    """Advice, as a phrase, on how to form images faster on this machine; empty if there is no advice.

    The phrase begins with a comma, so that it can follow a sentence.
    """
    if not is_compiled():
        return f", and {install_command('fast')} makes it tens of times faster"
    return f", --jobs {cores()} uses all cores" if jobs is not None and 1 < jobs < cores() else ""


def standing(targets: str | None) -> Targets:
    """Parse the targets of a simulation from a string; None gives a single point at the scene centre.

    Raises
    ------
    QuestionError
        The string does not describe valid targets; the message begins with `--targets`.
    """
    try:
        return Targets() if targets is None else parse_targets(targets)
    except ValueError as error:
        raise QuestionError(f"--targets: {printable(str(error))}.") from None


def simulate(
    mission: Mission, targets: str | Targets | None = None, *, image_former: str = "backprojection"
) -> SimulateResult:
    """Form the image of a point, or of several targets, with the declared errors, before and after autofocus.

    Parameters
    ----------
    mission : Mission
        As in `check`.
    targets : str, optional
        Targets in the scene, as in `simulate --targets`; by default a point at the scene's centre.
    image_former : str
        Algorithm: `backprojection`, `polar_format`, `matched_filter` or `far_field`.

    Raises
    ------
    QuestionError
        The targets are invalid.
    SimulationError
        The images cannot be formed with these arguments; the message says what to change.
    """

    def foreseen(seconds: float) -> None:
        advice = "smaller errors, targets nearer to each other, no clutter and fewer collection.pulses take less"
        foretell(seconds, f"Forming the images of {printable(mission.name)}", advice + faster())

    scene = targets if isinstance(targets, Targets) else standing(targets)
    with watched(FORMING) as progress:
        told = foreseen if is_heard() else None
        images = simulate_point(mission, progress, image_former=image_former, targets=scene, foreseen=told)
    return SimulateResult(images, mission)
