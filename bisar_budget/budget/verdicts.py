"""What images say of the limits, as frozen data. Field names are those of the JSON contract of `verify`."""

from typing import NamedTuple

from bisar_budget.geometry import GroundVector


class Verdict(NamedTuple):
    """What the image says of one limit. None where a value does not exist; `reason` says why.

    Phases are magnitudes at the aperture edge [rad], `…_inside` and `…_beyond` at 0.9 and 1.1 times the
    limit. Displacements are on the ground (east, north) [m]: `displacement_m` by exact ranges,
    `displacement_published_m` by (25). The smear azimuth is that of a line, from 0 to π; `…_published_rad`
    by (31). For vibration `measured_db` stands against `requirement_db`. With autofocus the row is formed
    again at `boundary_autofocus` and refocused.
    """

    id: str
    model: str
    boundary_error: float
    unit: str
    budget_rad: float | None = None
    predicted_qpe_rad: float | None = None
    measured_qpe_rad: float | None = None
    measured_inside_rad: float | None = None
    measured_beyond_rad: float | None = None
    predicted_cubic_rad: float | None = None
    measured_cubic_rad: float | None = None
    irw_ratio: float | None = None
    peak_loss_db: float | None = None
    pslr_db: float | None = None
    islr_db: float | None = None
    requirement_db: float | None = None
    measured_db: float | None = None
    measured_db_error: float | None = None
    displacement_m: GroundVector | None = None
    displacement_published_m: GroundVector | None = None
    measured_displacement_m: GroundVector | None = None
    smear_azimuth_published_rad: float | None = None
    measured_smear_azimuth_rad: float | None = None
    boundary_autofocus: float | None = None
    measured_residual_qpe_rad: float | None = None
    refocused_loss_db: float | None = None
    verdict: str = "not_evaluated"
    verdict_autofocus: str | None = None
    reason: str | None = None
    reason_autofocus: str | None = None


class VerifiedMission(NamedTuple):
    """The verdicts on one mission's limits."""

    file: str
    name: str
    rows: tuple[Verdict, ...]

    @property
    def status(self) -> str:
        """`fail` if a limit of the gating model is optimistic, with or without autofocus, else `pass`."""
        verdicts = {row.verdict for row in self.rows} | {row.verdict_autofocus for row in self.rows}
        return "fail" if "optimistic" in verdicts else "pass"
