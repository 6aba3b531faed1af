"""Check missions: compare declared errors with the allocated budget, with one row for each error and for each sum.

`check_mission` checks one mission. `check_missions` checks several missions, and computes missions whose files have
the same structure together as an array of cases. `check_files` checks files, and uses all cores if there are many
files. The findings of one mission consist of several hundred objects. A caller that needs only a report therefore
passes a function `keep`, which reduces the findings in the process that made them. This saves a quarter of the time
for a thousand missions.
"""

import gc
import math
from collections.abc import Callable, Iterator, Sequence
from datetime import date
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from bisar_budget import phrases
from bisar_budget.analysis.analysis import Analysis, Case, by_nodes
from bisar_budget.analysis.peak_loss import peak_loss_db
from bisar_budget.arrays import Floats
from bisar_budget.budget.confidence import confidence_of
from bisar_budget.budget.declarations import declared_kinds
from bisar_budget.budget.doubts import collection_notes, model_doubt, orbit_notes
from bisar_budget.budget.file_warnings import file_warnings
from bisar_budget.budget.judged_mission import JudgedMission, judged_mission
from bisar_budget.budget.requirement_table import negligible_effects, requirements_in_words, rows_in_words
from bisar_budget.budget.waivers import apply_waivers, overrides
from bisar_budget.effects.effect import PLATFORMS, override_notes
from bisar_budget.faults import MissionError, SetValue
from bisar_budget.findings.mission import MissionFindings, UnusableMission
from bisar_budget.findings.requirement import NOTHING_OUTSIDE, Outside
from bisar_budget.mission.load import load_mission
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import FlownPath
from bisar_budget.mission.stacked import picked, stacked
from bisar_budget.phrases import Note
from bisar_budget.resources import FILES_READ, cores
from bisar_budget.units import format_quantity

if TYPE_CHECKING:
    from bisar_budget.sampling.draws import Share

_CASES_AT_ONCE = 256  # arrays of more cases do not fit into the cache


def check_mission(mission: Mission, today: date, *, outside: Outside = NOTHING_OUTSIDE) -> MissionFindings:
    """Check one mission as a single case, and return the findings, including their text.

    Parameters
    ----------
    mission : Mission
        Mission as loaded from its file.
    today : date
        Day (UTC) on which waivers are judged.
    outside : Outside
        Options, settings and environment variables that affect the verdict.

    Returns
    -------
    MissionFindings
        Findings with the rows of declared and undeclared errors, in the order of the JSON output.
    """
    analysis = Analysis(mission, is_complete=True)
    judged = judged_mission(analysis, today)
    return _findings(judged, Case(analysis), _peak_loss_db(analysis), today, outside, analysis)


def check_missions(
    missions: Sequence[Mission], today: date, *, outside: Outside = NOTHING_OUTSIDE, keeps_analysis: bool = True
) -> Iterator[tuple[int, MissionFindings]]:
    """Check missions, and yield the index and the findings of each mission, in any order.

    Missions whose files have the same structure are checked together as arrays. The findings have the same statuses
    and sentences as the findings of `check_mission`. Their numbers may differ within the tolerance of the numerical
    search. If `keeps_analysis` is true, the findings of each mission include its analysis, for further computations.
    """
    if len(missions) == 1:
        yield 0, check_mission(missions[0], today, outside=outside)
        return
    for block_mission, block in _alike(missions):
        if block.size == 1:
            yield int(block[0]), check_mission(missions[block[0]], today, outside=outside)
            continue
        for analysis, same_nodes in _analysed(block_mission, block.size):
            judged, losses_db = judged_mission(analysis, today), _peak_loss_db(analysis)
            for case_index, index in enumerate(block[same_nodes].tolist()):
                alone = Analysis(missions[index], is_complete=True) if keeps_analysis else None
                case = Case(analysis, missions[index], case_index)
                yield index, _findings(judged, case, losses_db, today, outside, alone)


def requirement_uses(missions: Sequence[Mission], today: date) -> list[dict[str, float]]:
    """Compute the utilizations of the requirements of each mission, by the keys of the requirements.

    Requirements that are not judged, or whose utilization is not finite, are left out. Missions whose files have the
    same structure are computed together as arrays, without any text.
    """
    uses: list[dict[str, float]] = [{} for _ in missions]
    for block_mission, block in _alike(missions):
        for analysis, same_nodes in _analysed(block_mission, block.size):
            judged = judged_mission(analysis, today)
            for case_index, index in enumerate(block[same_nodes].tolist()):
                case = Case(analysis, missions[index], case_index)
                for state in judged.requirements:
                    use = case.number(state.utilization)
                    is_judged = state.user[case_index] >= 0 and not state.is_unjudged[case_index]
                    if is_judged and math.isfinite(use):
                        uses[index][state.key] = use
    return uses


def _alike(missions: Sequence[Mission]) -> Iterator[tuple[Mission, NDArray[np.intp]]]:
    """Yield blocks of missions whose files have the same structure: the combined mission, and their indices."""
    for alike, indices in stacked(missions):
        for start in range(0, indices.size, _CASES_AT_ONCE):
            block = indices[start : start + _CASES_AT_ONCE]
            yield picked(alike, np.arange(start, start + block.size)), block


def _analysed(block_mission: Mission, count: int) -> Iterator[tuple[Analysis, NDArray[np.intp]]]:
    """Yield the analyses of the `count` cases of a combined mission, each with the indices of its cases."""
    for nodes, same_nodes, mission_of_nodes, geometry in by_nodes(block_mission, count, block_mission.geometry):
        yield (
            Analysis(mission_of_nodes, same_nodes.size, geometry=geometry, nodes=nodes, is_complete=True),
            same_nodes,
        )


def _peak_loss_db(analysis: Analysis) -> Floats:
    spreads = (*analysis.noise["full"], *analysis.rests["full"])
    return peak_loss_db(analysis.errors, analysis.together("full"), spreads, analysis.tones)


def _findings(
    judged: JudgedMission,
    case: Case,
    losses_db: Floats,
    today: date,
    outside: Outside,
    analysis: Analysis | None,
) -> MissionFindings:
    """Collect the findings for one judged case, including their text.

    `losses_db` [dB] are the losses of the image peak in all judged cases, see `peak_loss_db`.
    """
    loss_db = case.number(losses_db)
    peak_loss = loss_db if math.isfinite(loss_db) else None  # no image, or no declared error
    mission, geometry = case.mission, case.geometry
    waived = apply_waivers(list(rows_in_words(judged, case)), mission, today)
    rows, requirements = waived.rows, requirements_in_words(judged, case, waived)
    return MissionFindings(
        analysis=analysis,
        file=mission.file,
        name=mission.name,
        model=mission.gating_model,
        combine=mission.allocation.combine,
        coverage_factor=mission.allocation.coverage_factor,
        wavelength=mission.radar.wavelength,
        geometry=geometry,
        aperture_time=mission.collection.aperture_time,
        scene_radius=mission.scene.radius,
        resolution=case.resolution,
        peak_loss_db=peak_loss,
        allocation=case.allocation,
        rows=tuple(rows),
        requirements=requirements,
        kinds=declared_kinds(mission),
        overrides=overrides(mission, outside, today),
        warnings=file_warnings(case, rows, list(waived.unused(requirements))),
        place=_place(mission),
        paths=_flown_paths(mission),
        scene=None if judged.scene is None else judged.scene.edge(case),
        notes=(
            *negligible_effects(judged, case),
            *collection_notes(case, peak_loss),
            *orbit_notes(case, rows),
            *_unused_keys(mission),
            *_overridden(mission),
        ),
        document=mission.document,
        changes=mission.changes,
        model_doubt=model_doubt(case, rows),
        confidence=confidence_of(case),
        requirement_texts=case.mission.requirement_texts,
    )


def _place(mission: Mission) -> str:
    scene, instant, texts = mission.scene, mission.collection.center_time, []
    if scene.latitude is not None and scene.longitude is not None:
        for angle, (positive, negative) in ((scene.latitude, "NS"), (scene.longitude, "EW")):
            texts.append(f"{abs(math.degrees(angle)):.5f}° {positive if angle >= 0 else negative}")
        texts.append(f"{format_quantity(scene.height or 0.0, 'm', 4)} above the ellipsoid")
    if instant is not None:
        texts.append(f"mid-aperture {instant.as_text()}")
    return ", ".join(texts)


def _flown_paths(mission: Mission) -> tuple[tuple[str, FlownPath], ...]:
    paths = ((name, getattr(mission.platforms, name).path) for name in PLATFORMS)
    return tuple((name, path) for name, path in paths if path is not None and path.source)


def _overridden(mission: Mission) -> Iterator[Note]:
    """Yield a note for each value of a catalogue part that the mission file overrides."""
    for name in PLATFORMS:
        platform = getattr(mission.platforms, name)
        for section in filter(None, (platform.motion_error, platform.oscillator)):
            yield from override_notes(name, section.overridden)


def _unused_keys(mission: Mission) -> Iterator[Note]:
    """Yield a note for each key of the mission file that a check does not use."""
    keys = {
        "collection.pulses": mission.collection.pulses is not None,
        "simulation": mission.simulation is not None,
    }
    unused = [key for key, is_stated in keys.items() if is_stated]
    if unused:
        yield phrases.note("keys-not-used", keys=unused)


# ---------------------------------------------------------------------- many files
CheckedMission = MissionFindings | UnusableMission
Kept = TypeVar("Kept")

FILES_FOR_TWO_PROCESSES = 200  # starting a second process takes as long as checking half of them
FILES_AT_ONCE = 500  # largest number of files that are checked together


class Draws(NamedTuple):
    """Arguments of `monte_carlo`: number of draws, seed, and the share of the draws to compute.

    If `share` is not None, the files are checked within a single process.
    """

    number: int
    seed: int | None
    share: "Share | None" = None


def without_analysis(findings: CheckedMission) -> CheckedMission:
    """Return the findings without their analysis, because a thousand analyses would fill the memory."""
    return findings if isinstance(findings, UnusableMission) else findings._replace(analysis=None)


def whole(findings: CheckedMission) -> CheckedMission:
    """Return the findings unchanged, with their analysis.

    Use this only within one process, because the analysis is too large to be sent to another process.
    """
    return findings


def check_files(
    files: Sequence[str],
    today: date,
    model: str | None,
    keep: Callable[[CheckedMission], Kept],
    *,
    drawn: Draws | None = None,
    changes: Sequence[SetValue] = (),
    outside: Outside = NOTHING_OUTSIDE,
) -> list[Kept]:
    """Check mission files, and return the results in the order of the files. Many files are checked on all cores.

    Parameters
    ----------
    files : sequence of str
        Names of mission files; `-` is standard input.
    today : date
        Day (UTC) on which waivers are judged.
    model : str or None
        Model that decides the verdicts (gating model), instead of the model that each file states. If None, each
        file's own model is used.
    keep : callable
        Function that reduces the findings of a file to the result, in the process that made the findings.
    drawn : Draws, optional
        Arguments of a Monte Carlo simulation. If None, there is no simulation.
    changes : sequence of SetValue
        Values that replace values in each file.
    outside : Outside
        Options, settings and environment variables that affect the verdicts.

    Returns
    -------
    list
        The result of `keep` for each file.
    """
    of = partial(_kept, today=today, model=model, keep=keep, drawn=drawn, changes=changes, outside=outside)
    chunks, count = _chunks(files), cores()
    is_shared = drawn is not None and drawn.share is not None
    if len(chunks) == 1 or count == 1 or "-" in files or keep is whole or is_shared:
        return [findings for chunk in chunks for findings in of(chunk)]
    from bisar_budget.workers import worker_pool

    own_chunks, *worker_chunks = (chunks[start::count] for start in range(min(count, len(chunks))))
    kept: list[list[Kept]] = [[]] * len(chunks)
    with worker_pool(len(worker_chunks)) as pool:
        waiting = [pool.submit(_with_files_read, chunks_of_worker, of) for chunks_of_worker in worker_chunks]
        kept[::count] = [of(chunk) for chunk in own_chunks]
        for start, result in enumerate(waiting, 1):
            kept[start::count], files_read = result.result()
            FILES_READ.update(files_read)
    return [findings for of_chunk in kept for findings in of_chunk]


def _chunks(files: Sequence[str]) -> list[Sequence[str]]:
    """Divide files into chunks that are checked together. If there are many files, the number of chunks is even.

    The division does not depend on the number of cores, because the last digits of a result depend on the chunk to
    which a file belongs.
    """
    count = 1 if len(files) < FILES_FOR_TWO_PROCESSES else 2 * math.ceil(len(files) / (2 * FILES_AT_ONCE))
    ends = [chunk * len(files) // count for chunk in range(count + 1)]
    return [files[start:stop] for start, stop in pairwise(ends)]


def _with_files_read(
    chunks: Sequence[Sequence[str]], of: Callable[[Sequence[str]], list[Kept]]
) -> tuple[list[list[Kept]], set[tuple[int, int]]]:
    return [of(chunk) for chunk in chunks], FILES_READ


def _kept(
    files: Sequence[str],
    today: date,
    model: str | None,
    keep: Callable[[CheckedMission], Kept],
    drawn: Draws | None,
    changes: Sequence[SetValue],
    outside: Outside,
) -> list[Kept]:
    # The findings of a thousand missions are 10⁵ tuples without reference cycles: there is no garbage to collect.
    gc.disable()
    kept: dict[int, Kept] = {}
    missions: dict[int, Mission] = {}
    for file_index, file in enumerate(files):
        try:
            missions[file_index] = load_mission(file, model, changes)
        except MissionError as error:
            kept[file_index] = keep(UnusableMission(file=file, faults=error.faults, data=error.data))
    indices = list(missions)
    keeps_analysis = keep is not without_analysis or drawn is not None
    for index, findings in check_missions(
        list(missions.values()), today, outside=outside, keeps_analysis=keeps_analysis
    ):
        if drawn is not None:
            from bisar_budget.sampling.probability import monte_carlo

            findings = findings._replace(monte_carlo=monte_carlo(findings.analysed(), *drawn))
        kept[indices[index]] = keep(findings)
    return [kept[file_index] for file_index in range(len(files))]
