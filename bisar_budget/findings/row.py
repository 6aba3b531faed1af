"""Rows of a budget, with their subject, numbers, status and waivers."""

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
SPECIFICATION = "specification"  # the metric of rows that compare declared errors with `specifications`


class AppliedWaiver(NamedTuple):
    """A waiver that names a failing row or requirement.

    `line` is its line in the file, `until` is its last day, and `id` is written as in the file. `is_expired` tells
    whether the last day has passed. `place` is its index among the waivers of the file.
    """

    line: int | None
    until: date
    reason: str
    is_expired: bool
    id: str
    place: int

    @property
    def words(self) -> Note:
        """Note about the waiver, as a sentence."""
        return phrases.waived(self.line, self.until, self.reason, self.is_expired, self.id)


def in_order(waivers: Iterable[AppliedWaiver]) -> tuple[AppliedWaiver, ...]:
    """Sort waivers in the order of the file, and remove duplicates."""
    return tuple(sorted(dict.fromkeys(waivers), key=lambda waiver: waiver.place))


def holding(status: str, waivers: Iterable[AppliedWaiver]) -> tuple[AppliedWaiver, ...]:
    """Select the waivers of a row or requirement that have not expired.

    `status` is the status of the row or requirement. The result is empty if the status is not `waived`.
    """
    return tuple(waiver for waiver in waivers if not waiver.is_expired) if status == "waived" else ()


class NavigationState(NamedTuple):
    """Errors of an aided navigation at mid-aperture, each the root of the sum of the variances along all axes.

    `tilt_rms_rad` is the error of roll and pitch.
    """

    position_rms_m: float
    velocity_rms_mps: float
    tilt_rms_rad: float
    heading_rms_rad: float
    gyro_bias_rms_radps: float
    accelerometer_bias_rms_mps2: float


class Row(NamedTuple):
    """One row of the budget.

    Numbers are in SI units and radians; None if a value does not exist. `is_independent` marks the row of an error
    along an axis in which the file states it; only such rows are included in sums. Any other row of an error shows it
    along an axis of the scene, although the file states it in another frame. `qpe_exact_rad` is equal to
    `qpe_full_rad`, which comes from exact ranges. `published_margin_db` is the margin of the published rule for a
    vibration relative to first principles. `binding_requirement` is the requirement that sets `allowable`.
    `cubic_rad` is the magnitude of the declared error's cubic phase at the aperture edge. `islr_db` is the ISLR that
    a declared random error adds. `equal_loss_qpe_rad` is the quadratic phase that lowers the peak as much as
    `qpe_full_rad` and the hidden phase together. The hidden phase represents the part of the range error that remains
    for any displacement of the image, because of the finite bandwidth and the turn of the line of sight. `rest_rad`
    is the rms phase beyond the cubic order. `model` is the model that gives these numbers. `waivers` are the waivers,
    valid or expired, that name the row while it fails. `refuted` names the images that refute the limit of the row.
    `bias` is the known, constant part of the error, signed and in its unit, beside the random part `declared`.
    `navigation` has the errors at mid-aperture if the row is that of an aided navigation. `requirement_ids` are the
    ids that the project gives to the row.
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
    requirement_ids: tuple[str, ...] = ()
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
    navigation: NavigationState | None = None
    is_unjudged: bool = False  # the row cannot be judged, waived or not
    bias: float | None = None

    def __repr__(self) -> str:
        """Show the id, the declared and the allowed size, and the status of the row on one line."""
        sizes = ("-" if one is None else f"{one:.6g}" for one in (self.declared, self.allowable))
        return f"<{self.id}: {' of '.join(sizes)} {self.unit}, {self.status}>"

    @property
    def id(self) -> str:
        """Name of the row in reports, waivers and the mission file's `requirement_ids`."""
        return self.subject.id

    @property
    def requirement_id(self) -> str | None:
        """Ids that the project gives to the row, joined by commas; None if there is no such id."""
        return ", ".join(self.requirement_ids) or None

    @property
    def owner(self) -> str:
        """Owner of the share to which the row belongs: transmitter, receiver, clock or mission."""
        return self.subject.owner

    @property
    def waived_by(self) -> tuple[AppliedWaiver, ...]:
        """Valid waivers that cover the row; empty unless the row is waived."""
        return holding(self.status, self.waivers)

    @property
    def is_of_declare(self) -> bool:
        """Whether the status of the row comes only from `requirements.declare`, and not from the size of an error."""
        return self.metric == DECLARE or (
            isinstance(self.reason, Note) and self.reason.code == "not-declared-as-required"
        )

    @property
    def decisive(self) -> tuple[Note, ...]:
        """Notes that decide the status of the row: the reason, waivers, and images that refute the limit."""
        reason = (self.reason,) if self.reason else ()
        return (*reason, *(waiver.words for waiver in self.waivers), *self.refuted)

    @property
    def notes(self) -> tuple[Note, ...]:
        """All notes on the row except the reason for its status."""
        if not (self.waivers or self.refuted):
            return self.remarks
        return (*self.remarks, *(waiver.words for waiver in self.waivers), *self.refuted)


def where_ids_are(file: str) -> str:
    """Phrase that names the command with which a user can list the ids of the rows of a mission file."""
    from shlex import quote

    return f"`bisar-budget check {quote(printable(file))} --all` lists them"


def unknown_id(row_id: str, known: Iterable[str], file: str, of_what: str = "row") -> str:
    """Message about an unknown id, with the command that lists the ids, and the most similar known id."""
    problem = f"no {of_what} has this id; {where_ids_are(file)}"
    return sentences(problem, did_you_mean(row_id, tuple(known)))


def worst_first(rows: Sequence[Row]) -> list[Row]:
    """Sort rows from worst to best, by status and then by utilization; equal rows keep their order.

    A specification that is met comes after all other rows that pass, because an error may use its full specification.
    """

    def use(row: Row) -> float:
        return 0.0 if row.metric == SPECIFICATION and row.status == "pass" else row.utilization or 0.0

    return sorted(rows, key=lambda row: (RANK[row.status], -use(row)))
