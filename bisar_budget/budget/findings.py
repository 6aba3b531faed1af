"""What a check finds, as frozen data. Field names and order are those of the JSON contract."""

from collections.abc import Container, Iterable, Sequence
from datetime import date
from typing import TYPE_CHECKING, NamedTuple

from bisar_budget.budget.allocation import Allocation
from bisar_budget.errors import Fault
from bisar_budget.geometry import BistaticGeometry, GroundVector
from bisar_budget.mission.model import Document, Mission

if TYPE_CHECKING:
    from bisar_budget.budget.images import ImageEvidence, Verdict
    from bisar_budget.budget.monte_carlo import MonteCarlo
    from bisar_budget.budget.scene import SceneEdge

# Worst first. The status of a mission or a run is the worst one found; the last three gate nothing.
GATING = ("error", "fail", "not_evaluated", "warn", "pass_with_autofocus", "pass")
STATUSES = (*GATING, "waived", "info", "not_declared")
# For reading. What is waived breaks its requirement: it stands before all that meets one.
READING = ("error", "fail", "not_evaluated", "warn", "waived", "pass_with_autofocus", "pass", "info", "not_declared")
OPTIMISTIC = "optimistic limit"  # how a note begins by which an image refutes a limit
_RANK = {status: index for index, status in enumerate(READING)}


class Row(NamedTuple):
    """One line of the budget. Numbers in SI and radians; None where a value does not exist.

    `is_independent` marks the rows that sums run over: errors as the file states them. Along the scene's axes an
    error stated in another frame is shown again, but not counted again. `qpe_exact_rad` is `qpe_full_rad`, which is
    that of exact ranges; `published_margin_db` how far the published rule of a vibration stays inside first
    principles. `binding_requirement` is the requirement that sets `allowable`, `cubic_rad` the magnitude of the
    declared error's cubic phase at the aperture edge, `islr_db` the ISLR that a declared random error adds, `model`
    the one whose numbers these are.
    """

    id: str
    metric: str
    unit: str
    declared: float | None
    allowable: float | None
    allowable_published: float | None
    allowable_full: float | None
    qpe_published_rad: float | None
    qpe_full_rad: float | None
    displacement_m: GroundVector | None
    utilization: float | None
    margin: float | None
    status: str
    line: int | None
    reason: str | None
    notes: tuple[str, ...]
    equation: str
    requirement_id: str | None
    evidence: str | None
    is_independent: bool
    qpe_exact_rad: float | None = None
    published_margin_db: float | None = None
    binding_requirement: str | None = None
    cubic_rad: float | None = None
    islr_db: float | None = None
    model: str | None = None


class FileWarning(NamedTuple):
    """Something about the mission file that should not go unsaid.

    Most change no verdict. One that `is_doubt` puts in doubt what was checked: the status is `warn` at least.
    """

    line: int | None
    message: str
    is_doubt: bool = False


class Resolution(NamedTuple):
    """Peak to first null on the ground. [m]"""

    range: float
    cross_range: float


class MissionFindings(NamedTuple):
    """What was found about one mission file that can be used.

    `mission` is what was checked; None where nothing after the check needs it and a thousand would fill memory.
    """

    mission: Mission | None
    file: str
    name: str
    model: str
    combine: str
    coverage_factor: float
    wavelength: float
    geometry: BistaticGeometry
    aperture_time: float
    scene_radius: float | None
    resolution: Resolution
    allocation: Allocation
    rows: tuple[Row, ...]
    warnings: tuple[FileWarning, ...]
    notes: tuple[str, ...]
    scene: "SceneEdge | None" = None  # of missions with a scene.radius and declared errors
    verdicts: "tuple[Verdict, ...] | None" = None  # of images, if any were formed
    is_unverified: bool = False  # images were asked for, and none gave a verdict
    image_evidence: "tuple[ImageEvidence, ...]" = ()  # a few of those images, where a report shows them
    monte_carlo: "MonteCarlo | None" = None  # if errors were drawn
    document: Document = Document()

    @property
    def is_empty(self) -> bool:
        """The file declares no error at all: nothing was judged."""
        return all(row.status == "not_declared" for row in self.rows)

    @property
    def status(self) -> str:
        """Worst status of the rows and of what is doubtful about the whole.

        No better than `not_evaluated` if nothing was judged, or if images were formed and verified nothing; no better
        than `warn` if a warning doubts what was checked.
        """
        doubts = ["not_evaluated"] if self.is_unverified or self.is_empty else []
        doubts += ["warn" for warning in self.warnings if warning.is_doubt]
        return worst([*(row.status for row in self.rows), *doubts])

    @property
    def summary(self) -> dict[str, int]:
        """Number of rows of each status that occurs."""
        found: dict[str, int] = {}
        for row in self.rows:
            found[row.status] = found.get(row.status, 0) + 1
        return {status: found[status] for status in STATUSES if status in found}


class UnusableMission(NamedTuple):
    """A mission file that cannot be used, with its faults; `data` is the file as read, where it was."""

    file: str
    faults: tuple[Fault, ...]
    status: str = "error"
    data: bytes | None = None


class Option(NamedTuple):
    """An option of the run that bears on what is found, and where its value came from."""

    name: str
    value: str
    origin: str


class Report(NamedTuple):
    """The findings about every mission file of a run.

    `day` is the date that somebody gave it, or on which its waivers were judged; None where it decides nothing.
    """

    version: str
    missions: tuple[MissionFindings | UnusableMission, ...]
    options: tuple[Option, ...] = ()
    day: date | None = None

    @property
    def status(self) -> str:
        """Worst status of the missions."""
        return worst(mission.status for mission in self.missions)


def image_notes(row: Row) -> tuple[str, ...]:
    """Those of the notes of a row by which an image refutes its limit."""
    return tuple(note for note in row.notes if note.startswith(OPTIMISTIC))


def exit_code(statuses: Container[str], strict: bool) -> int:
    """Return 2 if a file is unusable, 1 if a requirement is broken, else 0; `strict` breaks on doubt too."""
    if "error" in statuses:
        return 2
    failing = ("fail", "not_evaluated", "warn") if strict else ("fail",)
    return 1 if any(status in statuses for status in failing) else 0


def worst(statuses: Iterable[str]) -> str:
    """Return the worst of the gating statuses; `pass` if there is none."""
    found = set(statuses)
    return next((status for status in GATING if status in found), "pass")


def worst_first(rows: Sequence[Row]) -> list[Row]:
    """Sort rows by status, then by utilization, the highest first; equals keep their order."""
    return sorted(rows, key=lambda row: (_RANK[row.status], -(row.utilization or 0.0)))
