"""One row of a budget: what it is about, its numbers, its status."""

from collections.abc import Iterable, Sequence
from datetime import date
from typing import NamedTuple

from bisar_budget import phrases
from bisar_budget.effects.effect import Subject
from bisar_budget.faults import printable, sentences
from bisar_budget.findings.status import RANK
from bisar_budget.geometry import GroundVector
from bisar_budget.mission.readers import did_you_mean
from bisar_budget.phrases import Note

DECLARE = "declare"  # requirements.declare, and the metric of its row
SPECIFICATION = "specification"  # the metric of rows that hold what is declared to `specifications`


class AppliedWaiver(NamedTuple):
    """A waiver that names a failing row or requirement; expired if its last day is over.

    Line of the file, last day, reason, and `id` as the file writes it, which is the `place`-th of the file's waivers.
    """

    line: int | None
    until: date
    reason: str
    is_expired: bool
    id: str
    place: int

    @property
    def words(self) -> Note:
        """The waiver in a sentence."""
        return phrases.waived(self.line, self.until, self.reason, self.is_expired, self.id)


def in_order(waivers: Iterable[AppliedWaiver]) -> tuple[AppliedWaiver, ...]:
    """Each waiver once, in the order of the file."""
    return tuple(sorted(dict.fromkeys(waivers), key=lambda waiver: waiver.place))


def holding(status: str, waivers: Iterable[AppliedWaiver]) -> tuple[AppliedWaiver, ...]:
    """Waivers that something of a status is waived by; none if it is not."""
    return tuple(waiver for waiver in waivers if not waiver.is_expired) if status == "waived" else ()


class Row(NamedTuple):
    """One line of the budget. Numbers in SI and radians; None where a value does not exist.

    `is_independent` marks the rows that sums run over: errors as the file states them. Along the scene's axes an
    error stated in another frame is shown again, but not counted again. `qpe_exact_rad` is `qpe_full_rad`, which is
    that of exact ranges; `published_margin_db` how far the published rule of a vibration stays inside first
    principles. `binding_requirement` is the requirement that sets `allowable`, `cubic_rad` the magnitude of the
    declared error's cubic phase at the aperture edge, `islr_db` the ISLR that a declared random error adds.
    `equal_loss_qpe_rad` is the quadratic phase of as much loss of the peak as `qpe_full_rad` and what band and turn
    do not resolve, `rest_rad` the rms phase beyond the cubic, `model` the one whose numbers these are. `waivers` name
    the row while it fails, valid or expired; `refuted` says by which images its limit does not hold.
    """

    subject: Subject
    metric: str
    unit: str
    declared: float | None = None
    allowable: float | None = None
    allowable_published: float | None = None
    allowable_full: float | None = None
    qpe_published_rad: float | None = None
    qpe_full_rad: float | None = None
    displacement_m: GroundVector | None = None
    utilization: float | None = None
    margin: float | None = None
    status: str = "not_declared"
    line: int | None = None
    reason: Note | None = None
    remarks: tuple[Note, ...] = ()
    equation: str = ""
    requirement_id: str | None = None
    evidence: str | None = None
    is_independent: bool = True
    qpe_exact_rad: float | None = None
    published_margin_db: float | None = None
    binding_requirement: str | None = None
    cubic_rad: float | None = None
    islr_db: float | None = None
    equal_loss_qpe_rad: float | None = None
    rest_rad: float | None = None
    model: str | None = None
    waivers: tuple[AppliedWaiver, ...] = ()
    refuted: tuple[Note, ...] = ()
    is_unjudged: bool = False  # it cannot be judged, be that waived or not

    def __repr__(self) -> str:
        """Id, what is declared of what is allowed, and status, on one line."""
        sizes = ("-" if one is None else f"{one:.6g}" for one in (self.declared, self.allowable))
        return f"<{self.id}: {' of '.join(sizes)} {self.unit}, {self.status}>"

    @property
    def id(self) -> str:
        """Its name in reports, waivers and the mission file's `requirement_ids`."""
        return self.subject.id

    @property
    def owner(self) -> str:
        """Whose share it counts against: transmitter, receiver, clock or mission."""
        return self.subject.owner

    @property
    def waived_by(self) -> tuple[AppliedWaiver, ...]:
        """Waivers that hold; none unless it is waived."""
        return holding(self.status, self.waivers)

    @property
    def is_of_declare(self) -> bool:
        """Whether its status says what `requirements.declare` asks for, and nothing of an error's size."""
        return self.metric == DECLARE or (
            isinstance(self.reason, Note) and self.reason.code == "not-declared-as-required"
        )

    @property
    def decisive(self) -> tuple[Note, ...]:
        """Notes that decide its status: the reason, waivers, and what images say against its limit."""
        reason = (self.reason,) if self.reason else ()
        return (*reason, *(waiver.words for waiver in self.waivers), *self.refuted)

    @property
    def notes(self) -> tuple[Note, ...]:
        """All there is to say besides the reason."""
        if not (self.waivers or self.refuted):
            return self.remarks
        return (*self.remarks, *(waiver.words for waiver in self.waivers), *self.refuted)


def where_ids_are(file: str) -> str:
    """The command that lists the ids of a mission's rows."""
    from shlex import quote

    return f"`bisar-budget check {quote(printable(file))} --all` lists them"


def unknown_id(row_id: str, known: Iterable[str], file: str, of_what: str = "row") -> str:
    """Say that nothing of a mission has an id, where ids are found, and which is the nearest."""
    problem = f"no {of_what} has this id; {where_ids_are(file)}"
    return sentences(problem, did_you_mean(row_id, tuple(known)))


def worst_first(rows: Sequence[Row]) -> list[Row]:
    """Sort rows by status, then by utilization, the highest first; equals keep their order.

    A specification that is met comes last of what passes: it may be used in full.
    """

    def use(row: Row) -> float:
        return 0.0 if row.metric == SPECIFICATION and row.status == "pass" else row.utilization or 0.0

    return sorted(rows, key=lambda row: (RANK[row.status], -use(row)))
