"""Form images with each error set exactly at its limit, and measure whether the limit is true."""

import math
import time
from collections.abc import Iterable, Iterator
from contextlib import suppress
from fnmatch import fnmatchcase
from functools import partial

import numpy as np

from bisar_budget.analysis.allocation import ROOM
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
from bisar_budget.findings.images import FLOOR_DB, ImageEvidence, PointImage, Verdict, VerifiedMission
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.mission.model import Mission, Simulation
from bisar_budget.simulator.collection import CELLS, OVERSAMPLING, RANGE_CELLS, Chip, PointCollection, pulses_for
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

_FINE = 4  # interpolation of a cut, so that its nulls look like nulls
_AROUND = 10  # resolution cells of a cut each way, beyond the smear
_MAX_PIXELS = 96  # of a chip, each way
_CUT_FLOOR_DB = -80.0  # a null is as deep as rounding leaves it; nobody sees more
_LONG = 60.0  # s; far below it nothing is measured
_SLOWEST = 1.0  # s that the smallest image takes on a slow and busy machine
_LARGER = 8  # times the cells of the smallest image: 32 times its pixels and pulses
_BESIDE = 1.25  # images at a limit and on both sides of it, over those at it


def verify_mission(
    mission: Mission,
    only: str = "*",
    jobs: int = 1,
    progress: Progress = unseen,
    mapped: MapBlocks | None = None,
) -> VerifiedMission:
    """Verify every limit of a mission whose row id matches a glob; the verdicts do not depend on the processes.

    They are in the order of `check`, both platforms' vibration together among them. `progress` is told, after each
    row, how many are done, and how many there are; `mapped` has others form the images instead of processes here.
    """
    mission = mission._replace(places={})  # the parser's marks cannot go to another process, and nobody asks here
    known = cases(Study(mission), only)
    wanted = list(known)
    jobs = min(jobs, len(wanted))
    if mapped is None and jobs > 1:
        mapped = in_processes(jobs)
    found: Iterable[tuple[str, Verdict]] = ((row_id, known[row_id]()) for row_id in wanted)
    if mapped is not None:
        found = mapped(_verify_row, mission, wanted, f"{{}} of {printable(mission.name)}".format)
    rows = {}
    for row_id, verdict in found:
        rows[row_id] = verdict
        progress(len(rows), len(wanted))
    return VerifiedMission(
        file=mission.file,
        name=mission.name,
        rows=tuple(rows[row_id] for row_id in wanted),
        conditions=", ".join(_conditions(mission)),
        changes=mission.changes,
    )


def rows_to_verify(mission: Mission, only: str = "*") -> list[str]:
    """Ids of the rows that `verify_mission` would verify."""
    return list(cases(Study(mission), only))


def cases(study: Study, only: str = "*") -> dict[str, Case]:
    """Row ids that match a glob, in the order of `check`, with the call that verifies each."""
    return {row_id: case for row_id, case in _cases(study) if fnmatchcase(row_id, only)}


def _warns_of_the_total(study: Study) -> bool:
    """Whether each error stands alone, and all together exceed the total: only then the row exists."""
    aggregates = Aggregates(Judging(1, study.mission.allocation.warn_above), study.analysis)
    rows = (row for model in study.models for row in aggregates.rows(model.name))
    with np.errstate(all="ignore"):
        return any(row.judged.subject == subject("mission", QUADRATIC) and np.all(row.is_there) for row in rows)


def _verify_row(mission: Mission, row_id: str) -> Verdict:
    return cases(Study(mission))[row_id]()


def _conditions(mission: Mission) -> Iterator[str]:
    """Say of what images the verdicts are, and which keys of the file have no part in them."""
    settings = mission.simulation or Simulation()
    yield f"one point, exact ranges, {settings.window} window"
    yield "no noise" if settings.noise is None else "no noise (simulation.noise is for `simulate`)"
    given = mission.collection.pulses
    yield "pulses as needed" + (f" (the {given} of collection.pulses must not alias)" if given else "")


def _order(one: Subject) -> tuple[int, int]:
    """Sort key of a platform's vibrations, in the order of `check`: lines, lines together, noise."""
    return (("sinusoidal", "sinusoidal.sum", "wideband").index(one.axis), one.entry or 0)


def _of_instruments(study: Study) -> Iterator[tuple[str, Case]]:
    """Sensors and clocks that have a limit, and what all noise spreads together."""
    for error in study.analysis.random:
        sizes = limits_of(study, error)
        if sizes and error.subject.kind == "other":
            yield error.id, partial(phase_cases.stated, study, error.id, min(sizes.values()), error.unit)
        elif sizes:
            yield error.id, partial(verify_random, study, error)
    required = study.mission.requirements.islr
    if required is not None:
        for power in stated_powers(study.mission):
            yield power.subject.id, partial(phase_cases.stated, study, power.subject.id, required, "dB")
    for of_tone, case in tone_cases(study):
        yield of_tone.id, case
    if study.mission.requirements.pslr is not None:
        yield "mission.pslr", partial(verify_pslr, study)
    if study.mission.requirements.islr is not None:
        rows = RandomRows(Judging(1, study.mission.allocation.warn_above), study.analysis)
        with np.errstate(all="ignore"):
            found = [row.judged.subject for row in rows.islr_rows(study.models[-1].name) if row.is_there[0]]
        for of_owner in found:
            yield of_owner.id, partial(verify_islr, study, of_owner)


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
                one = subject(name, "vibration", "sinusoidal", entry=index)
                slow[one] = partial(phase_cases.slow_vibration, study, one)
    swaying = slow | dict(vibration_cases(study))
    for owner in (*PLATFORMS, "mission"):
        for one in sorted((one for one in swaying if one.owner == owner), key=_order):
            yield one.id, swaying[one]
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
    """An image whose size is known, which is all that was asked."""


class _Sizes(PointCollection):
    """A collection that notes the size of every image it is asked for, and forms none."""

    def __init__(self, mission: Mission, study: Study) -> None:
        super().__init__(mission, study.geometry)
        self.asked: list[float] = []  # sizes, see `_size`

    def pair(
        self, errors: Errors, place: tuple[float, float], cells: int = CELLS, range_cells: int = RANGE_CELLS
    ) -> tuple[Chip, Chip]:
        """Note two images."""
        self._require_room(cells, range_cells)
        self.asked.append(_size(cells, range_cells))
        raise _NotFormedError("its size is known")

    def window(self, count: int) -> Floats:
        """Draw no noise: that takes seconds, however large the images."""
        raise _NotFormedError(f"{count} weights are not needed")

    def chip(self, centre: tuple[float, float], errors: Errors, *, cells: int = CELLS, **_: object) -> Chip:
        """Note one of two images of a single line."""
        self._require_room(cells, 0)
        self.asked.append(_size(cells, 1))
        raise _NotFormedError("its size is known")


def seconds_to_verify(mission: Mission, only: str = "*", jobs: int = 1) -> float:
    """About how long `verify_mission` will take; 0 where it is far below a minute. [s]

    What one pixel and pulse take depends on the machine, on what else runs on it, and on whether kernels are
    compiled. So it is measured, on a small and a larger image of the mission itself, where the size leaves any doubt.
    """
    mission = mission._replace(places={})
    study = Study(mission)
    study.collection = sizes = _Sizes(mission, study)
    wanted = cases(study, only)
    for case in wanted.values():
        with suppress(_NotFormedError):
            case()
    asked = [max(1.0, size) for size in sizes.asked]
    if _BESIDE * sum(asked) * _SLOWEST <= _LONG:
        return 0.0
    study = Study(mission)
    try:
        study.collection.chip((0.0, 0.0), Errors(), cells=2)  # compiled, imported
        smallest = _seconds(study, CELLS)
    except ValueError:
        return 0.0  # where there is none of these, there is hardly any image
    try:
        grows = max(0.0, _seconds(study, _LARGER * CELLS) - smallest) / (_size(_LARGER * CELLS, RANGE_CELLS) - 1)
    except ValueError:
        grows = smallest  # no room for a larger one
    seconds = _BESIDE * sum(smallest + grows * (size - 1) for size in asked)
    return seconds / max(1, min(jobs, len(wanted)))


def _size(cells: int, range_cells: int) -> float:
    """Pixels times pulses of an image, over those of the smallest."""
    return cells * range_cells * pulses_for(cells) / (CELLS * RANGE_CELLS * pulses_for(CELLS))


def _seconds(study: Study, cells: int) -> float:
    """Time that two images of no error and their reading take. [s]"""
    errors, begun = Errors(), time.perf_counter()
    effect = study.collection.effect(errors)
    chips = study.collection.pair(errors, effect.displacement, cells)
    study.read(Responses(errors, effect, study.spread(errors, effect), *chips))
    return time.perf_counter() - begun


# ---------------------------------------------------------------------- images that a report shows
def form_image_evidence(mission: Mission, findings: MissionFindings) -> tuple[ImageEvidence, ...]:
    """Form the images of the rows that decide most about a verified mission; empty where no row has one.

    The worst row comes first. Its findings have the verdicts of its images.
    """
    verdicts = rows_worth_showing(findings)
    if not verdicts:
        return ()
    study = Study(mission, findings.analysis)
    subjects = {row.id: row.subject for row in findings.rows}
    return tuple(_evidence(study, findings.file, subjects[verdict.id], verdict) for verdict in verdicts)


def _evidence(study: Study, file: str, subject: Subject, verdict: Verdict) -> ImageEvidence:
    found = ImageEvidence(
        file=file,
        verdict=verdict,
        look_azimuth_rad=study.geometry.look_azimuth,
        at_limit=_shown(study.at_limit(subject, verdict.boundary_error)),
    )
    if verdict.boundary_autofocus is None or verdict.measured_residual_qpe_rad is None:
        return found
    images = study.at_limit(subject, verdict.boundary_autofocus, ROOM[study.mission.autofocus.algorithm])
    return found._replace(before_autofocus=_shown(images), after_autofocus=_shown(study.focused(images)))


def _shown(images: Responses) -> PointImage:
    return _point_image(images.chip, images.reference, images.spread.smear)


def _point_image(chip: Chip, reference: Chip, smear_cells: float) -> PointImage:
    """Reduce a chip to what is shown: as far as the response is smeared, and sidelobes."""
    spacing, middle = chip.spacing, chip.image.shape[1] // 2
    reach = _AROUND + smear_cells / 2
    half = min(math.ceil(reach * OVERSAMPLING), middle - 1)
    stride = math.ceil(2 * half / _MAX_PIXELS)
    half -= half % stride
    lines = reference.cut, line_at(chip.image, row_of_peak(chip.image))
    clean, cut = (np.abs(upsampled(line, _FINE)) for line in lines)
    peak = float(clean.max())
    fine = slice(_FINE * (middle - half), _FINE * (middle + half) + 1)
    # A long smear fits into a chip by the brightest of each few samples.
    line = chip.image.shape[0] // 2
    patch = chip.image[max(0, line - half) : line + half, middle - half : middle + half]  # no farther along x′
    shown = np.abs(patch).reshape(len(patch), -1, stride).max(axis=2)
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
