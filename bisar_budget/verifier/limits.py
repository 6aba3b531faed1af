"""Verification of limits: images with errors exactly at a limit show whether the limit is correct."""

import math
import time
from collections.abc import Iterable, Iterator
from contextlib import suppress
from fnmatch import fnmatchcase
from functools import partial

import numpy as np

from bisar_budget.analysis.allocation import ROOM
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.analysis.spread import stated_powers
from bisar_budget.budget.aggregates import Aggregates
from bisar_budget.budget.judged_rows import Judging
from bisar_budget.budget.random_rows import RandomRows
from bisar_budget.budget.verdicts import rows_worth_showing
from bisar_budget.effects.air_delays import dispersed_legs
from bisar_budget.effects.declared import QUADRATIC
from bisar_budget.effects.effect import PLATFORMS, Subject, subject
from bisar_budget.effects.vibration import SLOWEST_ECHO_CYCLES, lines_of
from bisar_budget.faults import printable
from bisar_budget.findings.images import CHIP_FLOOR_DB, ImageEvidence, PointImage, Verdict, VerifiedMission
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.mission.model import Mission, Simulation
from bisar_budget.simulator.collection import (
    CUT_CELLS,
    OVERSAMPLING_FACTOR,
    RANGE_CELLS,
    Chip,
    PointCollection,
    pulses_for,
)
from bisar_budget.simulator.impulse_response import line_at, row_of_peak, upsampled
from bisar_budget.simulator.phase_history import Errors, Floats
from bisar_budget.verifier import phase_cases
from bisar_budget.verifier.spread_cases import (
    Case,
    limits_of,
    tone_cases,
    verify_islr,
    verify_pslr,
    verify_random,
    vibration_cases,
)
from bisar_budget.verifier.study import Responses, Study
from bisar_budget.workers import MapBlocks, Progress, in_processes, unseen

_CUT_UPSAMPLING_FACTOR = 4  # upsampling of a cut, so that nulls are visible
_MARGIN_AROUND_SMEAR_CELLS = 10  # resolution cells on each side of the smear in a cut
_MAX_CHIP_PX = 96  # pixels along each axis
_CUT_FLOOR_DB = -80.0  # lower levels of a cut are only rounding errors
_LONG_S = 60.0  # if the upper bound of the time is shorter, no image is timed
_SLOWEST_IMAGE_S = 1.0  # upper bound of the time for the smallest image, on a slow and busy machine
_LARGE_IMAGE_FACTOR = 8  # the large image that is timed has this many times the cells of the smallest one
_NEIGHBOUR_FACTOR = 1.25  # number of all images, including those beside a limit, divided by the number at a limit


def verify_mission(
    mission: Mission,
    only: str = "*",
    jobs: int = 1,
    progress: Progress = unseen,
    mapped: MapBlocks | None = None,
    analysis: Analysis | None = None,
) -> VerifiedMission:
    """Verify the limits of a mission, in all rows whose ids match the glob pattern `only`.

    The verdicts are in the order of the rows of `check`. They include verdicts on the vibration of both platforms
    together. They do not depend on `jobs`, the number of processes. After each row `progress` is called with the
    number of finished rows and the total number of rows. `mapped`, if given, is a function that verifies the rows on
    remote workers instead of in processes on this machine. `analysis` is the analysis of the mission, if the caller
    already has it.
    """
    mission = mission._replace(places={})  # the places of keys cannot be sent to a process and are not needed
    all_cases = cases(Study(mission, analysis), only)
    row_ids = list(all_cases)
    jobs = min(jobs, len(row_ids))
    if mapped is None and jobs > 1:
        mapped = in_processes(jobs)
    verdicts: Iterable[tuple[str, Verdict]] = ((row_id, all_cases[row_id]()) for row_id in row_ids)
    if mapped is not None:
        verdicts = mapped(_verify_row, mission, row_ids, f"{{}} of {printable(mission.name)}".format)
    rows = {}
    for row_id, verdict in verdicts:
        rows[row_id] = verdict
        progress(len(rows), len(row_ids))
    return VerifiedMission(
        file=mission.file,
        name=mission.name,
        rows=tuple(rows[row_id] for row_id in row_ids),
        conditions=", ".join(_conditions(mission)),
        changes=mission.changes,
    )


def rows_to_verify(mission: Mission, only: str = "*", analysis: Analysis | None = None) -> list[str]:
    """Ids of the rows that `verify_mission` would verify."""
    return list(cases(Study(mission, analysis), only))


def cases(study: Study, only: str = "*") -> dict[str, Case]:
    """Map each row id that matches the glob pattern `only` to a function that verifies the row.

    The ids are in the order of the rows of `check`.
    """
    return {row_id: case for row_id, case in _cases(study) if fnmatchcase(row_id, only)}


def _warns_of_the_total(study: Study) -> bool:
    """Whether `check` has a row for the mission's total quadratic phase under the rule `combine: each`.

    Under this rule, the row is only a warning. `check` adds it if every single error is within the mission's limit on
    quadratic phase, but the root-sum-square of all errors exceeds this limit.
    """
    aggregates = Aggregates(Judging(1, study.mission.allocation.warn_above), study.analysis)
    rows = (row for model in study.models for row in aggregates.rows(model.name))
    with np.errstate(all="ignore"):
        return any(row.judged.subject == subject("mission", QUADRATIC) and np.all(row.is_there) for row in rows)


def _verify_row(mission: Mission, row_id: str) -> Verdict:
    return cases(Study(mission))[row_id]()


def _conditions(mission: Mission) -> Iterator[str]:
    """Yield phrases that state how the images are formed, and which keys of the mission file do not affect them."""
    settings = mission.simulation or Simulation()
    yield f"one point, exact ranges, {settings.window} window"
    yield "no noise" if settings.noise is None else "no noise (simulation.noise is for `simulate`)"
    pulses = mission.collection.pulses
    yield "pulses as needed" + (f" (the {pulses} of collection.pulses must not alias)" if pulses else "")


def _order(vibration: Subject) -> tuple[int, int]:
    """Sort key that puts the vibrations of an owner in the order of `check`: single tones, groups of tones, noise."""
    return (("sinusoidal", "sinusoidal.sum", "wideband").index(vibration.axis), vibration.entry or 0)


def _of_instruments(study: Study) -> Iterator[tuple[str, Case]]:
    """Yield the id of each row with a limit on sensors, clocks or sidelobes, and a function that verifies the limit.

    These are the rows of random errors, of errors whose size the mission file gives as an ISLR, of oscillator tones,
    of the PSLR and of the ISLR.
    """
    for error in study.analysis.random:
        sizes = limits_of(study, error)
        if sizes and error.kind.moves == "image":
            yield error.id, partial(phase_cases.stated, study, error.id, min(sizes.values()), error.unit)
        elif sizes:
            yield error.id, partial(verify_random, study, error)
    required = study.mission.requirements.islr
    if required is not None:
        for power in stated_powers(study.mission):
            yield power.subject.id, partial(phase_cases.stated, study, power.subject.id, required, "dB")
    for tone, case in tone_cases(study):
        yield tone.id, case
    if study.mission.requirements.pslr is not None:
        yield "mission.pslr", partial(verify_pslr, study)
    if study.mission.requirements.islr is not None:
        rows = RandomRows(Judging(1, study.mission.allocation.warn_above), study.analysis)
        with np.errstate(all="ignore"):
            subjects = [row.judged.subject for row in rows.islr_rows(study.models[-1].name) if row.is_there[0]]
        for islr_subject in subjects:
            yield islr_subject.id, partial(verify_islr, study, islr_subject)


def _cases(study: Study) -> Iterator[tuple[str, Case]]:
    mission, allocation = study.mission, study.allocation
    for source in study.sources:
        if not source.is_motion:
            yield source.id, partial(phase_cases.other, study, source)
        elif study.allowed(source)[0] is not None:
            yield source.id, partial(phase_cases.quadratic, study, source)
    slow: dict[Subject, Case] = {}
    for name in PLATFORMS:
        for index, line in enumerate(lines_of(mission, name)):
            if line.frequency * study.collection.aperture_time < SLOWEST_ECHO_CYCLES:
                vibration = subject(name, "vibration", "sinusoidal", entry=index)
                slow[vibration] = partial(phase_cases.slow_vibration, study, vibration)
    swaying = slow | dict(vibration_cases(study))
    for owner in (*PLATFORMS, "mission"):
        for vibration in sorted((vibration for vibration in swaying if vibration.owner == owner), key=_order):
            yield vibration.id, swaying[vibration]
    yield from _of_instruments(study)
    requirements = mission.requirements
    if any(map(np.any, dispersed_legs(mission, mission.geometry).values())):
        yield "propagation.dispersion", partial(phase_cases.dispersion, study)
    if mission.allocation.combine == "each":
        if _warns_of_the_total(study):
            row_id = subject("mission", QUADRATIC).id
            yield row_id, partial(phase_cases.total, study, row_id, "mission")
    else:
        owners = ["transmitter", "receiver", "mission"]
        if allocation.qpe.clock is not None:
            owners.insert(2, "clock")
        for owner in owners:
            row_id = subject(owner, QUADRATIC).id
            yield row_id, partial(phase_cases.total, study, row_id, owner)
    if requirements.cubic_phase_error is not None:
        yield "mission.cubic_phase_error", partial(phase_cases.cubic, study, requirements.cubic_phase_error)
    if requirements.location_error is not None:
        yield "mission.location_error", partial(phase_cases.location, study, requirements.location_error)
    if allocation.n_pull is not None:
        yield "mission.autofocus_pull_in", partial(phase_cases.pull_in, study, allocation.n_pull)
    if mission.scene.radius is not None and study.model != "published":
        yield "mission.spatial_variance", partial(phase_cases.edge, study)


# ---------------------------------------------------------------------- how long it will take
class _NotFormedError(ValueError):
    """The image is not formed, because only its size was needed."""


class _Sizes(PointCollection):
    """A collection that forms no images but records their sizes, which are used to estimate the computing time."""

    def __init__(self, mission: Mission, study: Study) -> None:
        super().__init__(mission, study.geometry)
        self.asked: list[float] = []  # sizes, see `_size`

    def pair(
        self,
        errors: Errors,
        ground_point: tuple[float, float],
        cells: int = CUT_CELLS,
        range_cells: int = RANGE_CELLS,
    ) -> tuple[Chip, Chip]:
        """Record the size of a pair of images, and raise `_NotFormedError` instead of forming them."""
        self._require_room(cells, range_cells)
        self.asked.append(_size(cells, range_cells))
        raise _NotFormedError("its size is known")

    def window(self, count: int) -> Floats:
        """Raise `_NotFormedError` instead of returning a window, so that no noise is drawn.

        Drawing noise would take seconds, even for small images.
        """
        raise _NotFormedError(f"{count} weights are not needed")

    def chip(self, centre: tuple[float, float], errors: Errors, *, cells: int = CUT_CELLS, **_: object) -> Chip:
        """Record the size of a pair of single-line images, and raise `_NotFormedError` instead of forming an image.

        The size of a pair is recorded because the image would be compared with a second image of the same size.
        """
        self._require_room(cells, 0)
        self.asked.append(_size(cells, 1))
        raise _NotFormedError("its size is known")


def seconds_to_verify(mission: Mission, only: str = "*", jobs: int = 1, analysis: Analysis | None = None) -> float:
    """Estimate the time that `verify_mission` will take. [s]

    The time per pixel and pulse depends on the machine, on its load, and on whether kernels are compiled. It is
    therefore measured with a small and a larger image of the mission. If all images together certainly take less than
    a minute, no time is measured, and the result is 0. The result is also 0 if hardly any image can be formed.
    """
    mission = mission._replace(places={})
    study = Study(mission, analysis)
    study.collection = sizes = _Sizes(mission, study)
    row_cases = cases(study, only)
    for case in row_cases.values():
        with suppress(_NotFormedError):
            case()
    image_sizes = [max(1.0, size) for size in sizes.asked]
    if _NEIGHBOUR_FACTOR * sum(image_sizes) * _SLOWEST_IMAGE_S <= _LONG_S:
        return 0.0
    study = Study(mission, study.analysis)
    try:
        study.collection.chip((0.0, 0.0), Errors(), cells=2)  # compile and import before the time is measured
        smallest_seconds = _seconds(study, CUT_CELLS)
    except ValueError:
        return 0.0  # hardly any image of the mission can be formed either
    try:
        seconds_per_size = max(0.0, _seconds(study, _LARGE_IMAGE_FACTOR * CUT_CELLS) - smallest_seconds) / (
            _size(_LARGE_IMAGE_FACTOR * CUT_CELLS, RANGE_CELLS) - 1
        )
    except ValueError:
        seconds_per_size = smallest_seconds  # there is no memory for the larger image
    seconds = _NEIGHBOUR_FACTOR * sum(smallest_seconds + seconds_per_size * (size - 1) for size in image_sizes)
    return seconds / max(1, min(jobs, len(row_cases)))


def _size(cells: int, range_cells: int) -> float:
    """Cost of forming an image, as the product of pixels and pulses, relative to the cost of the smallest image."""
    return cells * range_cells * pulses_for(cells) / (CUT_CELLS * RANGE_CELLS * pulses_for(CUT_CELLS))


def _seconds(study: Study, cells: int) -> float:
    """Measure the time to form an image pair without errors, and to measure the phase over the aperture in it. [s]"""
    errors, start_time = Errors(), time.perf_counter()
    effect = study.collection.effect(errors)
    chips = study.collection.pair(errors, effect.displacement, cells)
    study.read(Responses(errors, effect, study.spread(errors, effect), *chips))
    return time.perf_counter() - start_time


# ---------------------------------------------------------------------- images that a report shows
def form_image_evidence(mission: Mission, findings: MissionFindings) -> tuple[ImageEvidence, ...]:
    """Form the images that a report shows for the most important rows of a verified mission.

    The worst row comes first. The result is empty if no row has an image. `findings` must contain the verdicts of the
    verification.
    """
    verdicts = rows_worth_showing(findings)
    if not verdicts:
        return ()
    study = Study(mission, findings.analysis)
    subjects = {row.id: row.subject for row in findings.rows}
    return tuple(_evidence(study, findings.file, subjects[verdict.id], verdict) for verdict in verdicts)


def _evidence(study: Study, file: str, subject: Subject, verdict: Verdict) -> ImageEvidence:
    evidence = ImageEvidence(
        file=file,
        verdict=verdict,
        look_azimuth_rad=float(study.geometry.look_azimuth),
        at_limit=_shown(study.at_limit(subject, verdict.boundary_error)),
    )
    if verdict.boundary_autofocus is None or verdict.measured_residual_qpe_rad is None:
        return evidence
    images = study.at_limit(subject, verdict.boundary_autofocus, ROOM[study.mission.autofocus.algorithm])
    return evidence._replace(before_autofocus=_shown(images), after_autofocus=_shown(study.focused(images)))


def _shown(images: Responses) -> PointImage:
    return _point_image(images.chip, images.reference, images.spread.smear)


def _point_image(chip: Chip, reference: Chip, smear_cells: float) -> PointImage:
    """Convert a chip to the picture shown in a report: the smeared response with its sidelobes, and a cut through it.

    `smear_cells` is the length of the smear in resolution cells.
    """
    spacing, middle = chip.spacing, chip.image.shape[1] // 2
    reach = _MARGIN_AROUND_SMEAR_CELLS + smear_cells / 2
    half = min(math.ceil(reach * OVERSAMPLING_FACTOR), middle - 1)
    stride = math.ceil(2 * half / _MAX_CHIP_PX)
    half -= half % stride
    lines = reference.cut, line_at(chip.image, row_of_peak(chip.image))
    clean, cut = (np.abs(upsampled(line, _CUT_UPSAMPLING_FACTOR)) for line in lines)
    peak = float(clean.max())
    cut_samples = slice(_CUT_UPSAMPLING_FACTOR * (middle - half), _CUT_UPSAMPLING_FACTOR * (middle + half) + 1)
    # To fit a long smear, each pixel shows the brightest of `stride` samples.
    line = chip.image.shape[0] // 2
    patch = chip.image[max(0, line - half) : line + half, middle - half : middle + half]  # no farther along x′
    magnitude = np.abs(patch).reshape(len(patch), -1, stride).max(axis=2)
    grey = np.rint(255 * np.clip(1 - _decibel(magnitude, peak) / CHIP_FLOOR_DB, 0, 1)).astype(np.uint8)
    upright = grey.T[::-1]
    return PointImage(
        columns=upright.shape[1],
        rows=upright.shape[0],
        chip=upright.tobytes(),
        pixel_m=(spacing[0], spacing[1] * stride),
        thinned=stride,
        step_m=spacing[1] / _CUT_UPSAMPLING_FACTOR,
        cut_db=_levels(cut[cut_samples], peak),
        error_free_db=_levels(clean[cut_samples], peak),
    )


def _decibel(magnitude: Floats, peak: float) -> Floats:
    level: Floats = 20 * np.log10(np.maximum(magnitude / peak, 10 ** (_CUT_FLOOR_DB / 20)))
    return level


def _levels(magnitude: Floats, peak: float) -> tuple[float, ...]:
    return tuple(round(float(level), 2) for level in _decibel(magnitude, peak))
