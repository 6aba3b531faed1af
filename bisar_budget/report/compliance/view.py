"""The content of a compliance report, as plain data for the templates, which escape it each for their language."""

from datetime import date
from typing import NamedTuple

from bisar_budget.findings.mission import Option
from bisar_budget.findings.requirement import Override
from bisar_budget.mission.model import Document
from bisar_budget.report.explain.notation import Step
from bisar_budget.report.words.requirements import RequirementLine


class Driver(NamedTuple):
    """A row that the verdict rests on."""

    id: str
    requirement_id: str
    status: str
    measure: str
    cause: str
    use: float | None


class MatrixRow(NamedTuple):
    """A line of the compliance matrix. `use` is the utilization; None where there is none to show.

    `in_summary` is whether it is declared or limits something, and among the worst: a summary shows no other.
    """

    id: str
    requirement_id: str
    requirement: str
    method: str
    allowable: str
    declared: str
    use: float | None
    use_text: str
    margin: str
    status: str
    waiver: str
    line: int | None
    remarks: tuple[str, ...]
    in_summary: bool


class Remark(NamedTuple):
    """A remark that rows of the matrix carry besides their numbers."""

    rows: tuple[str, ...]
    text: str


class Share(NamedTuple):
    """The share of the quadratic phase error that an owner may use, before and after autofocus. [rad]

    `start` and `part` place it in a bar of length 1 for the whole budget.
    """

    owner: str
    share: str
    before: str
    after: str
    start: float
    part: float


class PowerShare(NamedTuple):
    """Shares of the power that vibration and noise may add; that of the clock only where it has one."""

    metric: str
    requirement: str
    transmitter: str
    receiver: str
    clock: str


class Contribution(NamedTuple):
    """Quadratic phase error of one declared error; `part` is that of the largest, `of_sum` of all together."""

    id: str
    owner: str
    kind: str
    axis: str
    qpe: str
    published: str
    full: str
    part: float
    of_sum: str


class Move(NamedTuple):
    """Displacement of the image by one declared error; `part` is that of the largest."""

    id: str
    owner: str
    kind: str
    axis: str
    size: str
    part: float


class Input(NamedTuple):
    """A value that everything rests on, and whether the file gives it."""

    name: str
    value: str
    origin: str


class Undeclared(NamedTuple):
    """An error that the file does not declare, and what it may be."""

    id: str
    allowable: str
    equation: str


class Source(NamedTuple):
    """Where values come from, as the file says, and for which rows."""

    text: str
    rows: tuple[str, ...]


class Derivation(NamedTuple):
    """How one row comes to its status."""

    id: str
    status: str
    line: int | None
    steps: tuple[Step, ...]


class General(NamedTuple):
    """A formula that no single row has, by its name in the catalogue."""

    number: str
    title: str
    left: str
    right: str


class Evidence(NamedTuple):
    """The evidence of an image about one limit."""

    id: str
    limit: str
    budget: str
    published: str
    full: str
    exact: str
    image: str
    verdict: str
    refocused: tuple[str, ...]
    reasons: tuple[str, ...]


class Probability(NamedTuple):
    """How often a requirement holds over the draws of a Monte Carlo; no cells where all are meant."""

    id: str
    cells: tuple[str, ...]
    held: str


class Picture(NamedTuple):
    """A drawing: `name` of a file within the mission's, what it shows, the SVG."""

    name: str
    title: str
    svg: str


class ShownImage(NamedTuple):
    """A small image: `name` of a file within the mission's, what it shows, the PNG, its size on a page. [px]"""

    name: str
    title: str
    caption: str
    png: bytes
    size: tuple[int, int]


class Illustration(NamedTuple):
    """The images behind the verdict on one limit."""

    id: str
    words: tuple[str, ...]
    chips: tuple[ShownImage, ...]
    cuts: Picture


class Stretch(NamedTuple):
    """Neighbouring values of a sweep, or one word, with one status and one worst row.

    `requirement` sets its limit; empty where the name of the row says it.
    """

    where: str
    status: str
    row: str
    requirement: str
    use: str


class StudyPart(NamedTuple):
    """Cases of a sweep over two keys that have a word or a worst row in common."""

    name: str
    cases: int
    complying: int
    use: str


class Studied(NamedTuple):
    """A sweep: its question, the command that gives its cases, what was found; of one key `stretches`, else `parts`.

    `hidden` is how many of them are not listed.
    """

    question: str
    command: str
    counts: str
    picture: Picture
    stretches: tuple[Stretch, ...] = ()
    parts: tuple[StudyPart, ...] = ()
    parts_are: str = ""
    hidden: int = 0


class MissionPage(NamedTuple):
    """Everything about one mission; `faults` of an unusable one, which has nothing else but its head."""

    anchor: str
    file: str
    sha256: str
    status: str
    verdict: str
    name: str
    document: Document = Document()
    is_empty: bool = False  # the file declares no error
    said: str = ""  # how many requirements are met, and judged
    rule: str = ""  # by which model, and which rule
    requirements: tuple[RequirementLine, ...] = ()
    effects: tuple[str, ...] = ()  # that no requirement takes
    declared: str = ""  # kinds of error: how many of how many
    missing: str = ""
    without_source: str = ""
    overrides: tuple[Override, ...] = ()
    alone: str = ""  # behind the verdict where errors are judged one by one
    doubt: str = ""  # where the published model judges and does not hold
    narrow: str = ""  # what gradients close to parallel do to displacements
    tone: str = ""  # of the verdict: a pass that rests on waivers looks like a warning
    counts: str = ""
    worst: str = ""
    worst_use: str = ""
    faults: tuple[tuple[str, str], ...] = ()
    head: tuple[tuple[str, str], ...] = ()
    drivers: tuple[Driver, ...] = ()
    matrix: tuple[MatrixRow, ...] = ()
    remarks: tuple[Remark, ...] = ()
    reasons: tuple[Remark, ...] = ()  # of rows that do not pass and drive nothing
    hidden: int = 0  # rows of the matrix that a summary leaves out
    pictures: tuple[Picture, ...] = ()
    total: str = ""
    gain: float = 1.0
    gain_text: str = ""
    shares: tuple[Share, ...] = ()
    power_shares: tuple[PowerShare, ...] = ()
    contributions: tuple[Contribution, ...] = ()
    moves: tuple[Move, ...] = ()
    validity: tuple[tuple[str, str], ...] = ()
    inputs: tuple[Input, ...] = ()
    undeclared: tuple[Undeclared, ...] = ()
    notes: tuple[str, ...] = ()
    warnings: tuple[tuple[str, str], ...] = ()
    sources: tuple[Source, ...] = ()
    unsourced: tuple[str, ...] = ()
    collection: tuple[Step, ...] = ()
    general: tuple[General, ...] = ()
    derivations: tuple[Derivation, ...] = ()
    evidence: tuple[Evidence, ...] | None = None
    evidence_remarks: tuple[str, ...] = ()
    has_refocused: bool = False
    illustrations: tuple[Illustration, ...] = ()
    draws: str = ""
    probabilities: tuple[Probability, ...] = ()
    draws_remarks: tuple[str, ...] = ()
    study: Studied | None = None

    @property
    def has_waivers(self) -> bool:
        """Whether a row of the matrix has one."""
        return any(row.waiver for row in self.matrix)

    def has_annex(self, is_full: bool) -> bool:
        """Whether there is more than the summary: everything, or images, draws, a sweep that somebody asked for."""
        is_asked = self.evidence is not None or bool(self.draws) or self.study is not None
        return not self.faults and (is_full or is_asked)


class Compliance(NamedTuple):
    """A whole report."""

    version: str
    day: date | None
    status: str
    verdict: str
    is_full: bool
    options: tuple[Option, ...]
    missions: tuple[MissionPage, ...]
