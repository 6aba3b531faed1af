"""The table of requirements: what each asks for, what is reached, and which row decides."""

from dataclasses import dataclass
from typing import NamedTuple

from bisar_budget.faults import printable
from bisar_budget.findings.row import AppliedWaiver, holding
from bisar_budget.phrases import Note

NAMES = {
    "quadratic_phase_error": "quadratic phase error",
    "cubic_phase_error": "cubic phase error",
    "location_error": "location error",
    "pslr": "PSLR",
    "islr": "ISLR",
    "declare": "declarations",
}


@dataclass(frozen=True, kw_only=True)
class DecidingShare:
    """A share of a requirement that decides in place of the whole, in the unit of the requirement; without gain.

    `owner` is the platform or the clock that has the share; `autofocus`, where the sum of all phases is held to what
    autofocus pulls in; `scene`, where the difference at the scene's edge is held to the requirement; `band`, where
    the phase is that of dispersion over the band.
    """

    owner: str
    allowed: float | None
    reached: float | None
    utilization: float | None


class JudgedRequirement(NamedTuple):
    """A requirement of the mission and how it stands. Numbers in SI, radians and decibel; None where there is none.

    `value` and `allowed` are the requirement as the file, or the default, states it; `reached` is the total of the
    mission, with `combine: each` the largest row's. `utilization` is that of what decides: the ratio of the two, or
    that of `share`, where a share decides. `autofocus_gain` is the factor by which autofocus lets quadratic phases
    exceed what is allowed, in all and of a platform's share; None of other requirements. `row` is the row that
    decides the status, `use_row` the one with the utilization, `rows` are all that judge the requirement. `reason`
    says why it cannot be judged, or why it is not met. `waivers` cover it or rows that judge it; empty unless it is
    waived. `is_unjudged` is whether it cannot be judged, be that waived or not.
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
        """Key, what is reached of what is allowed, and status, on one line."""
        sizes = ("-" if one is None else f"{one:.6g}" for one in (self.reached, self.allowed))
        return f"<{self.key}: {' of '.join(sizes)} {self.unit}, {self.status}>"

    @property
    def waived_by(self) -> tuple[AppliedWaiver, ...]:
        """Waivers that hold; none unless it is waived."""
        return holding(self.status, self.waivers)

    @property
    def id(self) -> str:
        """Its name in waivers and reports: that of the mission's own row, should there be one."""
        return f"mission.{self.key}"

    @property
    def name(self) -> str:
        """Its name in a sentence."""
        return NAMES[self.key]


@dataclass(frozen=True)
class ShiftedFigure:
    """Figures of a kind of error that the file shifts by a level off what their source states."""

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
        """Where from the figures are shifted."""
        if self.source is not None:
            return f"off {printable(self.source)}"
        return "off the file's own spectrum" if self.key.endswith("spectrum_level") else "off the data sheet"


class DeclaredKinds(NamedTuple):
    """Kinds of error that a mission can declare, by the names of `requirements.declare` with their owner.

    `declared` and `missing` are all of them; `without_source` are the declared ones that state no source, `shifted`
    what a level shifts off its source.
    """

    declared: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    without_source: tuple[str, ...] = ()
    shifted: tuple[ShiftedFigure, ...] = ()

    @property
    def in_all(self) -> int:
        """Number of kinds in all."""
        return len(self.declared) + len(self.missing)


class Override(NamedTuple):
    """Something from outside the file that bears on the verdict: its name, its value, and where it came from."""

    name: str
    value: str
    origin: str


class Outside(NamedTuple):
    """Influences on all missions of a run: options that somebody gave, and where the day of waivers comes from."""

    options: tuple[Override, ...] = ()
    day_origin: str = "the caller"
    is_day_given: bool = False  # by the option --date, which is said even where no waiver stands
    set_origin: str = "command line"  # of values in place of the file's


NOTHING_OUTSIDE = Outside()
