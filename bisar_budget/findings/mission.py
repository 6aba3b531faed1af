"""Findings about one mission file, and about all files of a run."""

from collections.abc import Mapping
from datetime import date
from typing import TYPE_CHECKING, NamedTuple

from bisar_budget.analysis.allocation import Allocation
from bisar_budget.faults import Fault, SetValue, shown
from bisar_budget.findings.requirement import DeclaredKinds, JudgedRequirement, Override
from bisar_budget.findings.row import AppliedWaiver, Row, in_order
from bisar_budget.findings.status import STATUSES, worst
from bisar_budget.geometry import BistaticGeometry
from bisar_budget.mission.model import Document, Mission
from bisar_budget.mission.platforms import FlownPath
from bisar_budget.mission.work_tree import WorkTree
from bisar_budget.phrases import NOTHING, Note
from bisar_budget.ranges.resolution import Resolution

if TYPE_CHECKING:
    from bisar_budget.analysis.analysis import Analysis
    from bisar_budget.analysis.scene import SceneEdge
    from bisar_budget.findings.guard import Guard
    from bisar_budget.findings.images import ImageEvidence, Verdict
    from bisar_budget.findings.monte_carlo import MonteCarlo
    from bisar_budget.findings.specification import SpecificationSheet
    from bisar_budget.findings.trade import TradeStudy


class FileWarning(NamedTuple):
    """A warning about the mission file.

    Most warnings do not change the verdict. `is_doubt` marks a warning that the checked mission may be wrong; the
    status is then at least `warn`. `is_of_options` marks the warning that options of the command line changed the
    mission.
    """

    line: int | None
    message: Note
    is_doubt: bool = False
    is_of_options: bool = False


class MissionFindings(NamedTuple):
    """Findings of the check of one usable mission file.

    `analysis` is the analysis of the check, for further computations. It is None if a run has many missions, because
    a thousand analyses would fill the memory.
    """

    analysis: "Analysis | None"
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
    peak_loss_db: float | None  # by all declared errors; None without an image or a declared error
    allocation: Allocation
    rows: tuple[Row, ...]
    warnings: tuple[FileWarning, ...]
    notes: tuple[Note, ...]
    place: str = ""  # of the scene on the Earth, and the instant of mid-aperture, if the file states them
    paths: tuple[tuple[str, FlownPath], ...] = ()  # of platforms whose path the mission file does not state
    scene: "SceneEdge | None" = None  # of missions with a scene.radius and declared errors
    verdicts: "tuple[Verdict, ...] | None" = None  # verdicts of images, if any were formed
    is_unverified: bool = False  # images were required, and no image gave a verdict
    image_evidence: "tuple[ImageEvidence, ...]" = ()  # a few of the images, if a report shows them
    monte_carlo: "MonteCarlo | None" = None  # if errors were drawn
    document: Document = Document()
    study: "TradeStudy | None" = None  # sweep of values, if a report shows it
    sheet: "SpecificationSheet | None" = None  # of the errors that the file specifies, if a report shows it
    changes: tuple[SetValue, ...] = ()  # values that options put in place of the file's values
    requirements: tuple[JudgedRequirement, ...] = ()
    kinds: DeclaredKinds = DeclaredKinds()
    overrides: tuple[Override, ...] = ()  # influences from outside the file on the verdict
    model_doubt: Note = NOTHING  # if the published model judges and does not hold
    confidence: Note = NOTHING  # with which requirements are met, if they are met
    guard: "Guard | None" = None  # probabilities that verdicts are wrong, if they were asked for
    requirement_texts: Mapping[str, str] = {}  # texts of requirement ids, as the mission states them

    def __repr__(self) -> str:
        """Show the file, the name and the status of the mission on one line."""
        return f"MissionFindings({self.file!r}, {shown(self.name)!r}, {self.status!r})"

    def texts_of(self, judged: JudgedRequirement | Row) -> list[str]:
        """Texts of the project's requirements to which a row, or a requirement of the mission, refers by id.

        Ids without a text are left out.
        """
        return [
            self.requirement_texts[own_id] for own_id in judged.requirement_ids if own_id in self.requirement_texts
        ]

    @property
    def mission(self) -> Mission | None:
        """The mission that was checked; None if its analysis was not kept."""
        return None if self.analysis is None else self.analysis.mission

    def analysed(self) -> "Analysis":
        """Return the analysis of the check.

        Raises
        ------
        ValueError
            The findings have no analysis.
        """
        if self.analysis is None:
            raise ValueError("these findings do not carry their analysis")
        return self.analysis

    @property
    def is_empty(self) -> bool:
        """Whether the file declares no error, so that nothing was judged."""
        return all(row.status == "not_declared" or row.is_of_declare for row in self.rows)

    @property
    def status(self) -> str:
        """Status of the mission: the worst of its `statuses`."""
        return worst(self.statuses)

    @property
    def statuses(self) -> frozenset[str]:
        """All statuses of the mission: of its rows, of its requirements, and of doubts about it.

        `not_evaluated` is included if nothing was judged, or if images were required and no image gave a verdict.
        `warn` is included if a warning questions the checked mission. A strict run needs all statuses, because a
        waived mission may also have a warning.
        """
        doubts = ["not_evaluated"] if self.is_unverified or self.is_empty else []
        doubts += ["warn" for warning in self.warnings if warning.is_doubt]
        return frozenset([*(row.status for row in self.rows), *(one.status for one in self.requirements), *doubts])

    @property
    def waived_by(self) -> tuple[AppliedWaiver, ...]:
        """Valid waivers that cover rows or requirements of the mission, in the order of the file."""
        of_requirements = (waiver for one in self.requirements for waiver in one.waived_by)
        return in_order([*(waiver for row in self.rows for waiver in row.waived_by), *of_requirements])

    @property
    def summary(self) -> dict[str, int]:
        """Number of rows with each status, by the name of the status; statuses without a row are left out."""
        found: dict[str, int] = {}
        for row in self.rows:
            found[row.status] = found.get(row.status, 0) + 1
        return {status: found[status] for status in STATUSES if status in found}


class UnusableMission(NamedTuple):
    """A mission file that cannot be used, with its faults; `data` is the content of the file, if it was read."""

    file: str
    faults: tuple[Fault, ...]
    status: str = "error"
    data: bytes | None = None

    @property
    def statuses(self) -> frozenset[str]:
        """Set with the single status of a mission file that cannot be used."""
        return frozenset([self.status])


class Report(NamedTuple):
    """The findings about all mission files of a run.

    `options` are the options of the run that affect its results. `day` is the date that the user gave, or on which
    waivers were judged; None if no verdict depends on the date. `work_trees` are the states of the git repositories
    of mission files, by the paths of these files; only compliance reports show them.
    """

    version: str
    missions: tuple[MissionFindings | UnusableMission, ...]
    options: tuple[Override, ...] = ()
    day: date | None = None
    work_trees: Mapping[str, WorkTree] = {}

    @property
    def status(self) -> str:
        """Worst status of all missions in the report."""
        return worst(mission.status for mission in self.missions)
