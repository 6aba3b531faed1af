"""The table of requirements: the limit of each, the value reached, and the row that decides."""

from dataclasses import dataclass
from typing import NamedTuple

from bisar_budget.faults import printable
from bisar_budget.findings.row import AppliedWaiver, holding
from bisar_budget.phrases import Note

REQUIREMENT_NAMES = {
    "quadratic_phase_error": "quadratic phase error",
    "cubic_phase_error": "cubic phase error",
    "location_error": "location error",
    "pslr": "PSLR",
    "islr": "ISLR",
    "declare": "declarations",
}


@dataclass(frozen=True, kw_only=True)
class DecidingShare:
    """A share of a requirement that decides in place of the full requirement, in its unit, without gain.

    `owner` is the platform or the clock that has the share. It is `autofocus` if the pull-in range of autofocus
    limits the sum of all phases, `scene` if the requirement limits the difference at the scene's edge, and `band` for
    the phase of dispersion over the band.
    """

    owner: str
    allowed: float | None
    reached: float | None
    utilization: float | None


class JudgedRequirement(NamedTuple):
    """A judged requirement of the mission. Numbers in SI, radians and decibel; None if a value does not exist.

    `value` and `allowed` are the requirement as the file, or the default, states it. `reached` is the total of the
    mission, with `combine: each` the value of the largest row. `utilization` is the ratio of `reached` and `allowed`,
    or the utilization of `share` if a share decides. `autofocus_gain` is the factor by which quadratic phases may
    exceed the requirement and the platforms' shares with autofocus; None for requirements on anything else. `row` is
    the row that decides the status, `use_row` the row with the utilization, and `rows` are all rows that judge the
    requirement. `reason` says why the requirement cannot be judged, or why it is not met. `waivers` cover the
    requirement or rows that judge it; empty unless it is waived. `is_unjudged`: it cannot be judged, waived or not.
    """

    key: str
    value: float | None
    unit: str
    is_default: bool
    status: str
    allowed: float | None = None
    reached: float | None = None
    utilization: float | None = None
    row: str | None = None
    rows: tuple[str, ...] = ()
    reason: Note | None = None
    line: int | None = None
    waivers: tuple[AppliedWaiver, ...] = ()
    is_unjudged: bool = False
    share: DecidingShare | None = None
    autofocus_gain: float | None = None
    use_row: str | None = None

    def __repr__(self) -> str:
        """Key, reached and allowed value, and status, on one line."""
        sizes = ("-" if one is None else f"{one:.6g}" for one in (self.reached, self.allowed))
        return f"<{self.key}: {' of '.join(sizes)} {self.unit}, {self.status}>"

    @property
    def waived_by(self) -> tuple[AppliedWaiver, ...]:
        """Valid waivers; empty unless the requirement is waived."""
        return holding(self.status, self.waivers)

    @property
    def id(self) -> str:
        """Name of the requirement in waivers and reports: the id of the mission's own row, if there is such a row."""
        return f"mission.{self.key}"

    @property
    def name(self) -> str:
        """Name of the requirement in a sentence."""
        return REQUIREMENT_NAMES[self.key]


@dataclass(frozen=True)
class ShiftedFigure:
    """Figures of a kind of error that the file shifts by a level from the values of their source."""

    kind: str
    key: str
    level_db: float
    source: str | None

    @property
    def level(self) -> str:
        """The level in a sentence."""
        return f"{self.level_db:g} dB"

    @property
    def off(self) -> str:
        """Words for the origin of the shift: the source of the figures."""
        if self.source is not None:
            return f"off {printable(self.source)}"
        return "off the file's own spectrum" if self.key.endswith("spectrum_level") else "off the data sheet"


class DeclaredKinds(NamedTuple):
    """Kinds of error that a mission can declare, by the names of `requirements.declare` with their owner.

    `declared` and `missing` together are all kinds. `without_source` are the declared kinds that state no source.
    `shifted` are the figures that a level shifts from their source.
    """

    declared: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    without_source: tuple[str, ...] = ()
    shifted: tuple[ShiftedFigure, ...] = ()

    @property
    def in_all(self) -> int:
        """Number of all kinds."""
        return len(self.declared) + len(self.missing)


class Override(NamedTuple):
    """An influence from outside the file on the verdict: its name, its value and its origin."""

    name: str
    value: str
    origin: str


class Outside(NamedTuple):
    """Influences on all missions of a run: options that the user gave, and the origin of the day for waivers."""

    options: tuple[Override, ...] = ()
    day_origin: str = "the caller"
    is_day_given: bool = False  # by the option --date, which is reported also without a waiver
    set_origin: str = "command line"  # origin of values in place of the file's values


NOTHING_OUTSIDE = Outside()
