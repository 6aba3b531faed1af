"""Images that show what a verdict says, as plain numbers, and which of a mission's rows are worth showing.

Axes are those of the rotated image: x′ along the bistatic look direction φ_b, y′ across it, counter-clockwise.
"""

from typing import NamedTuple

from bisar_budget.budget.findings import STATUSES, MissionFindings, Row
from bisar_budget.budget.verdicts import Verdict

FLOOR_DB = -40.0  # of the error-free peak: black in a chip
_ROWS = 4  # shown of a mission
_RANK = {status: index for index, status in enumerate(STATUSES)}


class PointImage(NamedTuple):
    """Image of the point with an error, its cut along y′, and the cut without error at the same place.

    `chip` holds `columns` × `rows` bytes, row by row from the largest y′ to the smallest, in each from the smallest
    x′ to the largest: 0 is `FLOOR_DB` or less, 255 the peak without error. `pixel_m` are its steps along x′ and y′;
    along y′ a pixel stands for `thinned` samples, of which a resolution cell has as many as along x′. The cuts are
    powers over the error-free peak [dB], `step_m` apart, with y′ = 0 at index `len // 2`.
    """

    columns: int
    rows: int
    chip: bytes
    pixel_m: tuple[float, float]
    thinned: int
    step_m: float
    cut_db: tuple[float, ...]
    error_free_db: tuple[float, ...]

    @property
    def extent_m(self) -> tuple[float, float]:
        """Size of the chip along x′ and y′. [m]"""
        return (self.columns * self.pixel_m[0], self.rows * self.pixel_m[1])


class ImageEvidence(NamedTuple):
    """The images behind one verdict: at the limit, and with autofocus at its limit, before and after."""

    file: str
    verdict: Verdict
    look_azimuth_rad: float
    at_limit: PointImage
    before_autofocus: PointImage | None = None
    after_autofocus: PointImage | None = None


def rows_worth_showing(findings: MissionFindings, count: int = _ROWS) -> tuple[Verdict, ...]:
    """Verdicts with a measured quadratic phase whose rows decide most: worst status, limits that images refute.

    A row that nobody declared is shown only if its limit is refuted, or if there is nothing else.
    """
    rows = {row.id: row for row in findings.rows}
    known = [v for v in findings.verdicts or () if v.measured_qpe_rad is not None and v.id in rows]
    ordered = sorted(known, key=lambda verdict: _urgency(rows[verdict.id], verdict))
    wanted = [v for v in ordered if rows[v.id].status != "not_declared" or _is_refuted(v)]
    return tuple((wanted or ordered[:1])[:count])


def _urgency(row: Row, verdict: Verdict) -> tuple[int, bool, bool, float]:
    # Shown again along the scene's axes, an error has the same image as in its own frame.
    return (_RANK[row.status], not _is_refuted(verdict), not row.is_independent, -(row.utilization or 0.0))


def _is_refuted(verdict: Verdict) -> bool:
    return "optimistic" in (verdict.verdict, verdict.verdict_autofocus)
