"""The table of requirements of a mission.

For each requirement it has the limit, the value that the mission reaches, and the row that decides the status.
"""

from collections.abc import Mapping
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
    """Limit that decides the status of a requirement in place of the full limit: usually a share of the full limit.

    `allowed` and `reached` are in the unit of the requirement, without the gain of autofocus. For a share of the
    requirement, `owner` is the platform or the clock to which the share belongs. For a limit that is not a share,
    `owner` names its subject: `autofocus` for the pull-in range of autofocus, which limits the sum of all phases;
    `scene` for the difference between the phases at the edge and at the centre of the scene; or `band` for the phase
    of dispersion over the radar band.
    """

    owner: str
    allowed: float | None
    reached: float | None
    utilization: float | None


class JudgedRequirement(NamedTuple):
    """A requirement of the mission, with its verdict.

    Numbers are in SI units, radians and decibels; they are None if they are not available. `value` and `allowed` are
    the requirement as the file states it, or its default. `reached` is the total of the mission; with `combine: each`
    it is the value of the largest row. `utilization` is the ratio of `reached` to `allowed`, or the utilization of
    the share in `share` if this share decides the status. `autofocus_gain` is the factor by which autofocus allows
    quadratic phases to exceed the requirement and the shares of the platforms; None for requirements on other
    quantities. `row` is the row that decides the status, `use_row` is the row from which `utilization` comes, if it
    comes from a row, and `rows` are all rows that judge the requirement. `reason` tells why the requirement cannot be
    judged, or why it is not met. `waivers` are the waivers that cover the requirement or its rows; empty unless the
    requirement is waived. `is_unjudged` tells whether it cannot be judged, even if it is waived. `requirement_ids`
    are the ids that the project gives to the requirement.

    `confidence` is the probability with which the file asks for the limit; None without one. `probability` is the
    probability that all declared errors, drawn together, keep the limit. `percentiles` are the sizes of the limited
    quantity that they do not exceed with a probability: of a location error, the length of the displacement, and
    `percentiles_range` and `percentiles_azimuth` its magnitude along the range gradient on the ground, and across it.
    The keys are probabilities in percent. They are None for levels, which are expectations, and where errors are so
    large that there is no image, or displace the image by an unknown amount.
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
    requirement_ids: tuple[str, ...] = ()
    confidence: float | None = None
    probability: float | None = None
    percentiles: Mapping[str, float] | None = None
    percentiles_range: Mapping[str, float] | None = None
    percentiles_azimuth: Mapping[str, float] | None = None

    def __repr__(self) -> str:
        """Show the key, the reached and the allowed value, and the status of the requirement on one line."""
        sizes = ("-" if one is None else f"{one:.6g}" for one in (self.reached, self.allowed))
        return f"<{self.key}: {' of '.join(sizes)} {self.unit}, {self.status}>"

    @property
    def waived_by(self) -> tuple[AppliedWaiver, ...]:
        """Valid waivers that cover the requirement or its rows; empty unless the requirement is waived."""
        return holding(self.status, self.waivers)

    @property
    def id(self) -> str:
        """Id of the requirement in waivers and reports; the row for the whole mission, if any, has the same id."""
        return f"mission.{self.key}"

    @property
    def requirement_id(self) -> str | None:
        """Ids that the project gives to the requirement, joined by commas; None if there is no such id."""
        return ", ".join(self.requirement_ids) or None

    @property
    def name(self) -> str:
        """Name of the requirement for use in a sentence."""
        return REQUIREMENT_NAMES[self.key]


@dataclass(frozen=True)
class ShiftedFigure:
    """A noise or vibration spectrum that the mission file shifts by `level_db` [dB], relative to its source."""

    kind: str
    key: str
    level_db: float
    source: str | None

    @property
    def level(self) -> str:
        """The shift in decibels with its unit as text, such as `-3 dB`."""
        return f"{self.level_db:g} dB"

    @property
    def off(self) -> str:
        """Phrase that names the source from which the shifted spectrum deviates, such as `off the data sheet`."""
        if self.source is not None:
            return f"off {printable(self.source)}"
        return "off the file's own spectrum" if self.key.endswith("spectrum_level") else "off the data sheet"


class DeclaredKinds(NamedTuple):
    """Kinds of error that a mission can declare.

    Each kind is named as in `requirements.declare`, such as `transmitter.position`. `declared` and `missing` together
    are all kinds. `without_source` are the declared kinds for which the file states no source. `shifted` are the
    noise and vibration spectra that the file shifts by a level in decibels relative to their source. `required` are
    the names that the file lists in `requirements.declare`.
    """

    declared: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    without_source: tuple[str, ...] = ()
    shifted: tuple[ShiftedFigure, ...] = ()
    required: tuple[str, ...] = ()

    @property
    def in_all(self) -> int:
        """Number of all kinds of error, declared or missing."""
        return len(self.declared) + len(self.missing)


class Override(NamedTuple):
    """An influence on the verdict that is not in the mission file: its name, its value and its origin."""

    name: str
    value: str
    origin: str


class Outside(NamedTuple):
    """Settings that come from outside the mission files and affect all missions of a run.

    `options` are the options of the run. `day_origin` names the origin of the date for which waivers are judged.
    """

    options: tuple[Override, ...] = ()
    day_origin: str = "the caller"
    is_day_given: bool = False  # by the option --date, which is reported also without a waiver
    set_origin: str = "command line"  # origin of values in place of the file's values


NOTHING_OUTSIDE = Outside()
