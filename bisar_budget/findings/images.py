"""Results of forming images, as frozen data: verdicts on the limits of rows, and pictures of the images.

The fields of verdicts have the names that are used in the JSON output of `verify`. Pictures have the axes of the
rotated image: x′ is along the bistatic look direction φ_b, and y′ is across it, counter-clockwise.
"""

from typing import NamedTuple

from bisar_budget import phrases
from bisar_budget.faults import SetValue
from bisar_budget.findings.requirement import Override
from bisar_budget.geometry import GroundVector
from bisar_budget.phrases import NOTHING, Note

CHIP_FLOOR_DB = -40.0  # relative to the error-free peak: black in a chip


class Verdict(NamedTuple):
    """Verdict on the limit of one row, reached from simulated images; values that are not available are None.

    Phases are magnitudes at the aperture edge [rad]: `published_…` follow from Table II of Rigling & Moses, `full_…`
    from the closed form of the full model, and `predicted_…` from exact ranges; `measured_…` are measured in the
    image. `…_inside` and `…_beyond` are measured at 0.9 and 1.1 times the limit. Displacements are on the ground
    (east, north) [m]: `displacement_m` follows from exact ranges, `…_published_m` from equation (25) of Rigling &
    Moses, and `…_full_m` from the full model. The smear azimuth is the direction of a line, from 0 to π;
    `…_published_rad` follows from equation (31) of Rigling & Moses. For vibration and noise `measured_db` is compared
    with `requirement_db`; for noise it has a standard error and a 95 % interval. With autofocus a second image is
    formed at the limit `boundary_autofocus`, and refocused. `reason` and `reason_autofocus` explain the verdicts.
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
    equal_loss_qpe_rad: float | None = None
    measured_equal_loss_qpe_rad: float | None = None
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
    measured_db_interval: tuple[float, float] | None = None
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
    reason: Note | None = None
    reason_autofocus: Note | None = None

    @property
    def judged_phases_rad(self) -> tuple[float | None, float | None]:
        """Phase that the budget limits, as predicted from exact ranges and as measured in the image. [rad]

        It is the cubic phase if the row limits the cubic phase. Otherwise it is the quadratic phase that would cause
        the same loss of the peak.
        """
        if self.measured_cubic_rad is not None:
            return self.predicted_cubic_rad, self.measured_cubic_rad
        if self.measured_equal_loss_qpe_rad is not None:
            return self.equal_loss_qpe_rad, self.measured_equal_loss_qpe_rad
        return self.predicted_qpe_rad, self.measured_qpe_rad

    @property
    def of_equal_loss(self) -> str:
        """Suffix for the name of the judged phase: ` of equal loss`, or an empty string.

        The suffix says that the judged phase is the quadratic phase that would cause the same loss of the peak as the
        actual phases. The result is empty if at least 99 % of the judged phase is quadratic phase in the image, or if
        the row limits the cubic phase.
        """
        phase, quadratic = self.measured_equal_loss_qpe_rad, self.measured_qpe_rad
        is_more = self.measured_cubic_rad is None and phase is not None and (quadratic or 0.0) < 0.99 * phase
        return " of equal loss" if is_more else ""


class VerifiedMission(NamedTuple):
    """Verdicts on the limits of one mission, reached from simulated images.

    `conditions` describes how the images were formed. `changes` are values that options put in place of the file's
    values. `overrides` are all influences on the verdicts that are not in the file.
    """

    file: str
    name: str
    rows: tuple[Verdict, ...]
    conditions: str = ""
    changes: tuple[SetValue, ...] = ()
    overrides: tuple[Override, ...] = ()

    @property
    def status(self) -> str:
        """Status of the verification: `fail`, `not_evaluated` or `pass`.

        It is `fail` if a limit of the model that decides the verdict is optimistic, with or without autofocus. It is
        `not_evaluated` if no limit has a verdict, because then nothing was verified. Otherwise it is `pass`.
        """
        verdicts = {row.verdict for row in self.rows} | {row.verdict_autofocus for row in self.rows}
        if "optimistic" in verdicts:
            return "fail"
        return "not_evaluated" if self.doubt else "pass"

    @property
    def doubt(self) -> Note:
        """Note stating that no limit has a verdict; it is empty if at least one limit has a verdict."""
        if any({row.verdict, row.verdict_autofocus} - {"not_evaluated", None} for row in self.rows):
            return NOTHING
        return phrases.note("nothing-verified", rows=len(self.rows))


class PointImage(NamedTuple):
    """Image of a point target with an error, with its cut along y′ and the same cut of the error-free image.

    `chip` has `columns` × `rows` bytes. Rows run from the largest y′ to the smallest, columns from the smallest x′ to
    the largest. The value 0 is `CHIP_FLOOR_DB` or less, and 255 is the peak without error. `pixel_m` are the pixel
    spacings along x′ and y′ [m]. A pixel along y′ represents `thinned` samples; a resolution cell has as many samples
    along y′ as along x′. The cuts are powers relative to the error-free peak [dB]. Their samples are `step_m` apart,
    and y′ = 0 is at index `len // 2`.
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
        """Size of the image chip along x′ and y′. [m]"""
        return (self.columns * self.pixel_m[0], self.rows * self.pixel_m[1])


class ImageEvidence(NamedTuple):
    """Images on which one verdict is based.

    They are the image at the limit, and the images at the limit with autofocus, before and after refocusing.
    """

    file: str
    verdict: Verdict
    look_azimuth_rad: float
    at_limit: PointImage
    before_autofocus: PointImage | None = None
    after_autofocus: PointImage | None = None
