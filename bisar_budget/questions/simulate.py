"""Images of a mission with its declared errors."""

from bisar_budget.faults import printable
from bisar_budget.mission.model import Mission
from bisar_budget.mission.quantities import QuestionError
from bisar_budget.questions.progress import FORMING, foretell, is_heard, watched
from bisar_budget.questions.results import SimulateResult
from bisar_budget.questions.verify import faster
from bisar_budget.simulator.point import SimulationError as SimulationError
from bisar_budget.simulator.point import simulate_point
from bisar_budget.simulator.targets import Targets, parse_targets


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
