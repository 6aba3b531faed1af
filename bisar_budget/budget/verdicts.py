"""What images say of the limits, and what follows for the rows. Field names are the JSON contract's of `verify`."""

from typing import NamedTuple

from bisar_budget.budget.findings import FileWarning, MissionFindings, Row
from bisar_budget.constants import UTILIZATION_TOLERANCE
from bisar_budget.geometry import GroundVector


class Verdict(NamedTuple):
    """What the image says of one limit. None where a value does not exist; `reason` says why.

    Phases are magnitudes at the aperture edge [rad]: by Table II, by the full model's closed form, predicted from
    exact ranges, and measured, `…_inside` and `…_beyond` at 0.9 and 1.1 times the limit. Displacements are on the
    ground (east, north) [m]: `displacement_m` by exact ranges, `…_published_m` by (25), `…_full_m` by the full
    model. The smear azimuth is that of a line, from 0 to π; `…_published_rad` by (31). For vibration
    `measured_db` stands against `requirement_db`. With autofocus the row is formed again at
    `boundary_autofocus` and refocused.
    """

    id: str
    model: str
    boundary_error: float
    unit: str
    budget_rad: float | None = None
    published_qpe_rad: float | None = None
    full_qpe_rad: float | None = None
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
    displacement_full_m: GroundVector | None = None
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
    """The verdicts on one mission's limits; `conditions` says of what images they are."""

    file: str
    name: str
    rows: tuple[Verdict, ...]
    conditions: str = ""

    @property
    def status(self) -> str:
        """`fail` if a limit of the gating model is optimistic, with or without autofocus.

        `not_evaluated` if no limit got a verdict: nothing was verified, which is no pass. Else `pass`.
        """
        verdicts = {row.verdict for row in self.rows} | {row.verdict_autofocus for row in self.rows}
        if "optimistic" in verdicts:
            return "fail"
        return "not_evaluated" if self.doubt else "pass"

    @property
    def doubt(self) -> str:
        """Say that no limit got a verdict; empty if one did."""
        if any({row.verdict, row.verdict_autofocus} - {"not_evaluated", None} for row in self.rows):
            return ""
        rows = f"{len(self.rows)} row{'s' if len(self.rows) != 1 else ''}"
        return f"nothing was verified: {rows} with a limit, and no image gave a verdict on any"


def with_verdicts(findings: MissionFindings, verified: VerifiedMission) -> MissionFindings:
    """Add verdicts to findings: a limit that the image shows to be optimistic is said at its row.

    A row that passes a limit it would fail as measured becomes a warning, and so does one that passes by an autofocus
    that the image refutes: the model that gates says pass, but a gate must not be silent about what it knows. That no
    image gave a verdict is a warning too.
    """
    rows = verified.rows
    by_id = {verdict.id: verdict for verdict in rows}
    judged = tuple(_with_verdict(row, by_id[row.id]) if row.id in by_id else row for row in findings.rows)
    known = {row.id for row in findings.rows}
    warnings = tuple(
        FileWarning(line=None, message=f"{verdict.id}: optimistic limit: {_shown(verdict)}")
        for verdict in rows
        if verdict.id not in known and verdict.verdict == "optimistic"
    )
    if verified.doubt:
        warnings = (FileWarning(line=None, message=verified.doubt), *warnings)
    return findings._replace(
        rows=judged,
        warnings=(*findings.warnings, *warnings),
        notes=(*findings.notes, f"images: {verified.conditions}") if verified.conditions else findings.notes,
        verdicts=rows,
        is_unverified=bool(verified.doubt),
    )


def _with_verdict(row: Row, verdict: Verdict) -> Row:
    notes = row.notes
    if verdict.verdict == "optimistic":
        notes = (*notes, f"optimistic limit: {_shown(verdict)}")
    if verdict.verdict_autofocus == "optimistic":
        notes = (*notes, f"optimistic limit with autofocus: {verdict.reason_autofocus}")
        if row.status == "pass_with_autofocus":
            reason = "passes by autofocus alone, and the image at that limit refutes it"
            return row._replace(status="warn", reason=reason, notes=notes)
    if row.metric == "location_error" and row.status == "pass" and verdict.verdict == "optimistic":
        return row._replace(status="warn", reason="the image is not where the gating model puts it", notes=notes)
    excess = _excess(verdict)
    if (
        row.status in ("pass", "pass_with_autofocus")
        and (row.utilization or 0.0) * excess > 1 + UTILIZATION_TOLERANCE
    ):
        reason = f"inside the limit, but {(row.utilization or 0.0) * excess:.3g} times what the image allows"
        return row._replace(status="warn", reason=reason, notes=notes)
    return row._replace(notes=notes)


def _excess(verdict: Verdict) -> float:
    """What the image shows at the limit, over what the limit promises; 1 where it promises no less."""
    if verdict.verdict != "optimistic":
        return 1.0
    if verdict.measured_db is not None and verdict.requirement_db is not None:
        return 10 ** ((verdict.measured_db - verdict.requirement_db) / 20)
    measured = verdict.measured_cubic_rad if verdict.measured_cubic_rad is not None else verdict.measured_qpe_rad
    return measured / verdict.budget_rad if measured is not None and verdict.budget_rad else 1.0


def _shown(verdict: Verdict) -> str:
    if verdict.measured_db is not None:
        return f"the image shows {verdict.measured_db:.1f} dB at it"
    if verdict.measured_qpe_rad is not None and verdict.budget_rad is not None:
        return f"the image shows {verdict.measured_qpe_rad:.3g} rad at it, the budget is {verdict.budget_rad:.3g} rad"
    return verdict.reason or "the image shows more than it promises"
