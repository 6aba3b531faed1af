"""The table of requirements: what each asks for, what is reached, and which row decides."""

from typing import NamedTuple

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


class JudgedRequirement(NamedTuple):
    """A requirement of the mission and how it stands. Numbers in SI, radians and decibel; None where there is none.

    `value` is what the file, or the default, requires in all; `allowed` what the deciding row is held to (the share
    of a platform, autofocus included) and `reached` what is declared there, in the unit of the requirement. `row` is
    the deciding one, `rows` are all that judge it. `reason` says why it cannot be judged, or why it is not met.
    `waivers` cover it or rows that judge it; empty unless it is waived. `is_unjudged` is whether it cannot be judged,
    be that waived or not.
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


class DeclaredKinds(NamedTuple):
    """Kinds of error that a mission can declare, by the names of `requirements.declare` with their owner.

    `declared` and `missing` are all of them; `without_source` are the declared ones that state no source.
    """

    declared: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    without_source: tuple[str, ...] = ()

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
