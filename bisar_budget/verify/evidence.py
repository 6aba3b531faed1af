"""Form again the few images that a report shows, the same as those that the verdicts were read from."""

import math

import numpy as np

from bisar_budget.budget.pull_in import ROOM
from bisar_budget.budget.verdicts import rows_worth_showing
from bisar_budget.effects.effect import Subject
from bisar_budget.findings.images import FLOOR_DB, ImageEvidence, PointImage, Verdict
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.mission.model import Mission
from bisar_budget.simulate.collection import OVERSAMPLING, Chip
from bisar_budget.simulate.impulse_response import upsampled
from bisar_budget.simulate.phase_history import Floats
from bisar_budget.verify.study import Study

_FINE = 4  # interpolation of a cut, so that its nulls look like nulls
_AROUND = 10  # resolution cells of a cut each way, beyond the smear
_MAX_PIXELS = 96  # of a chip, each way
_CUT_FLOOR_DB = -80.0  # a null is as deep as rounding leaves it; nobody sees more


def form_image_evidence(mission: Mission, findings: MissionFindings) -> tuple[ImageEvidence, ...]:
    """Form the images of the rows that decide most about a verified mission.

    Parameters
    ----------
    mission : Mission
        As loaded.
    findings : MissionFindings
        About it, with the verdicts of its images.

    Returns
    -------
    tuple of ImageEvidence
        The worst row first; empty where no row has an image.
    """
    verdicts = rows_worth_showing(findings)
    if not verdicts:
        return ()
    study = Study(mission, findings.analysis)
    subjects = {row.id: row.subject for row in findings.rows}
    return tuple(_evidence(study, findings.file, subjects[verdict.id], verdict) for verdict in verdicts)


def _evidence(study: Study, file: str, subject: Subject, verdict: Verdict) -> ImageEvidence:
    chip, reference, errors, effect = study.images(subject, verdict.boundary_error)
    found = ImageEvidence(
        file=file,
        verdict=verdict,
        look_azimuth_rad=study.geometry.look_azimuth,
        at_limit=_point_image(chip, reference, study.spread(errors, effect).smear),
    )
    if verdict.boundary_autofocus is None or verdict.measured_residual_qpe_rad is None:
        return found
    chip, reference, errors, effect = study.images(
        subject, verdict.boundary_autofocus, ROOM[study.mission.autofocus.algorithm]
    )
    return found._replace(
        before_autofocus=_point_image(chip, reference, study.spread(errors, effect).smear),
        after_autofocus=_point_image(
            study.focused(errors, effect, chip), reference, study.spread(errors, effect).smear
        ),
    )


def _point_image(chip: Chip, reference: Chip, smear_cells: float) -> PointImage:
    """Reduce a chip to what is shown: as far as the response is smeared, and sidelobes."""
    spacing, middle = chip.spacing, chip.cut.size // 2
    reach = _AROUND + smear_cells / 2
    half = min(math.ceil(reach * OVERSAMPLING), middle - 1)
    stride = math.ceil(2 * half / _MAX_PIXELS)
    half -= half % stride
    cut, clean = (np.abs(upsampled(one.cut, _FINE)) for one in (chip, reference))
    peak = float(clean.max())
    fine = slice(_FINE * (middle - half), _FINE * (middle + half) + 1)
    # A long smear fits into a chip by the brightest of each few samples.
    shown = np.abs(chip.image[:, middle - half : middle + half]).reshape(chip.image.shape[0], -1, stride).max(axis=2)
    grey = np.rint(255 * np.clip(1 - _decibel(shown, peak) / FLOOR_DB, 0, 1)).astype(np.uint8)
    upright = grey.T[::-1]
    return PointImage(
        columns=upright.shape[1],
        rows=upright.shape[0],
        chip=upright.tobytes(),
        pixel_m=(spacing[0], spacing[1] * stride),
        thinned=stride,
        step_m=spacing[1] / _FINE,
        cut_db=_levels(cut[fine], peak),
        error_free_db=_levels(clean[fine], peak),
    )


def _decibel(magnitude: Floats, peak: float) -> Floats:
    level: Floats = 20 * np.log10(np.maximum(magnitude / peak, 10 ** (_CUT_FLOOR_DB / 20)))
    return level


def _levels(magnitude: Floats, peak: float) -> tuple[float, ...]:
    return tuple(round(float(level), 2) for level in _decibel(magnitude, peak))
