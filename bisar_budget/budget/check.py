"""Hold a mission's declared errors to its allocated budget: one row for each, and what the rows add up to."""

import math
from collections.abc import Iterator, Sequence
from datetime import date

import numpy as np

from bisar_budget import phrases
from bisar_budget.analysis.analysis import Analysis, by_nodes
from bisar_budget.analysis.case import Case
from bisar_budget.budget.doubts import collection_notes, model_doubt
from bisar_budget.budget.file_warnings import file_warnings
from bisar_budget.budget.judged_mission import JudgedMission, judged_mission
from bisar_budget.budget.judged_requirements import declared_kinds
from bisar_budget.budget.requirement_table import negligible_effects, requirements_in_words, rows_in_words
from bisar_budget.budget.waivers import NOTHING_OUTSIDE, Outside, apply_waivers, overrides
from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.effects.effect import PLATFORMS, override_notes
from bisar_budget.findings.mission import MissionFindings, Resolution
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import FlownPath
from bisar_budget.mission.stacked import picked, stacked
from bisar_budget.phrases import Note
from bisar_budget.units import format_quantity

_TOGETHER = 256  # cases: arrays of more do not stay in a cache


def check_mission(mission: Mission, today: date, *, outside: Outside = NOTHING_OUTSIDE) -> MissionFindings:
    """Check one mission: judge it, as a single case, and put what is found into words.

    Parameters
    ----------
    mission : Mission
        As loaded.
    today : date
        Day on which waivers are judged, UTC.
    outside : Outside
        What from outside the file bears on the verdict, besides what the mission itself carries.

    Returns
    -------
    MissionFindings
        Rows in the order of the contract, declared or not.
    """
    analysis = Analysis(mission, is_whole=True)
    return _findings(judged_mission(analysis, today), Case(analysis), today, outside)


def check_missions(
    missions: Sequence[Mission], today: date, *, outside: Outside = NOTHING_OUTSIDE
) -> Iterator[tuple[int, MissionFindings]]:
    """Check missions, those of one shape together; each with its place, in any order.

    What is found of a mission is what `check_mission` finds: what others are checked beside it makes no difference.
    """
    if len(missions) == 1:
        yield 0, check_mission(missions[0], today, outside=outside)
        return
    for alike, places in stacked(missions):
        for start in range(0, places.size, _TOGETHER):
            some = places[start : start + _TOGETHER]
            if some.size == 1:
                yield int(some[0]), check_mission(missions[some[0]], today, outside=outside)
                continue
            part = picked(alike, np.arange(start, start + some.size))
            for nodes, same, of_same, geometry in by_nodes(part, some.size, part.geometry):
                analysis = Analysis(of_same, same.size, geometry=geometry, nodes=nodes, is_whole=True)
                judged = judged_mission(analysis, today)
                for place, index in enumerate(some[same].tolist()):
                    yield index, _findings(judged, Case(analysis, missions[index], place), today, outside)


def _findings(judged: JudgedMission, case: Case, today: date, outside: Outside) -> MissionFindings:
    """What is found of one of the judged cases, in words."""
    mission, geometry = case.mission, case.geometry
    waived = apply_waivers(list(rows_in_words(judged, case)), mission, today)
    rows, requirements = waived.rows, requirements_in_words(judged, case, waived)
    resolution = Resolution(
        range=geometry.range_resolution(mission.radar.bandwidth, SPEED_OF_LIGHT),
        cross_range=geometry.cross_range_resolution(mission.radar.wavelength, mission.collection.aperture_time),
    )
    return MissionFindings(
        analysis=case.analysis if case.analysis.is_by_itself else Analysis(mission, is_whole=True),
        file=mission.file,
        name=mission.name,
        model=mission.gating_model,
        combine=mission.allocation.combine,
        coverage_factor=mission.allocation.coverage_factor,
        wavelength=mission.radar.wavelength,
        geometry=geometry,
        aperture_time=mission.collection.aperture_time,
        scene_radius=mission.scene.radius,
        resolution=resolution,
        allocation=case.allocation,
        rows=tuple(rows),
        requirements=requirements,
        kinds=declared_kinds(mission),
        overrides=overrides(mission, outside, today),
        warnings=file_warnings(case, rows, list(waived.unused(requirements)), resolution),
        place=_place(mission),
        paths=tuple((name, path) for name, path in _paths(mission) if path.source),
        scene=None if judged.scene is None else judged.scene.edge(case),
        notes=(
            *negligible_effects(judged, case),
            *collection_notes(case),
            *_unused_keys(mission),
            *_overridden(mission),
        ),
        document=mission.document,
        changes=mission.changes,
        model_doubt=model_doubt(case, rows),
    )


def _place(mission: Mission) -> str:
    scene, instant, said = mission.scene, mission.collection.center_time, []
    if scene.latitude is not None and scene.longitude is not None:
        for angle, (positive, negative) in ((scene.latitude, "NS"), (scene.longitude, "EW")):
            said.append(f"{abs(math.degrees(angle)):.5f}° {positive if angle >= 0 else negative}")
        said.append(f"{format_quantity(scene.height or 0.0, 'm', 4)} above the ellipsoid")
    if instant is not None:
        said.append(f"mid-aperture {instant.as_text()}")
    return ", ".join(said)


def _paths(mission: Mission) -> Iterator[tuple[str, FlownPath]]:
    for name in PLATFORMS:
        path = getattr(mission.platforms, name).path
        if path is not None:
            yield name, path


def _overridden(mission: Mission) -> Iterator[Note]:
    """Say which figures of parts the file replaces."""
    for name in PLATFORMS:
        platform = getattr(mission.platforms, name)
        for section in filter(None, (platform.motion_error, platform.oscillator)):
            yield from override_notes(name, section.overridden)


def _unused_keys(mission: Mission) -> Iterator[Note]:
    """Say which keys that the file gives have no part in this check."""
    keys = {
        "collection.pulses": mission.collection.pulses is not None,
        "simulation": mission.simulation is not None,
    }
    given = [key for key, is_given in keys.items() if is_given]
    if given:
        yield phrases.keys_not_used(given)
