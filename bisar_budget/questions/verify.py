"""Images of missions with errors at the limits of their rows, which show whether the limits are correct."""

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
from bisar_budget.mission.model import Mission
from bisar_budget.mission.quantities import QuestionError
from bisar_budget.questions.outside import outside_of
from bisar_budget.questions.progress import FORMING, foretell, is_heard, watched
from bisar_budget.questions.results import VerifyResult
from bisar_budget.resources import cores
from bisar_budget.simulator.image_formation import is_compiled
from bisar_budget.simulator.point import SimulationError as SimulationError
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

    `outside` describes the influences on the verdicts that are not in the mission files. The other arguments and the
    exceptions are the same as for `verify`.
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
