"""Hold a mission's declared errors to its allocated budget: one row for each, and what the rows add up to."""

import math
from collections.abc import Iterator, Sequence
from datetime import date

from bisar_budget import file_warnings, phrases
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.budget.doubts import InputDoubt, collection_notes, input_doubts, model_doubt, straight_orbits
from bisar_budget.budget.judged_mission import judged_mission
from bisar_budget.budget.judged_requirements import declared_kinds
from bisar_budget.budget.overrides import NOTHING_OUTSIDE, Outside, overrides
from bisar_budget.budget.pull_in import pull_in_caps
from bisar_budget.budget.requirement_table import negligible_effects, requirements_in_words, rows_in_words
from bisar_budget.budget.waivers import apply_waivers
from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.effects.combined import unused_correlations
from bisar_budget.effects.effect import PLATFORMS, override_notes
from bisar_budget.effects.oscillators import POOR_FIT
from bisar_budget.faults import changes_words
from bisar_budget.findings.mission import FileWarning, MissionFindings, Resolution
from bisar_budget.findings.row import Row
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import FlownPath
from bisar_budget.phrases import Note
from bisar_budget.units import format_quantity


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
    analysis = Analysis(mission)
    judged = judged_mission(analysis, today, is_whole=True)
    waived = apply_waivers(list(rows_in_words(judged)), mission, today)
    rows, requirements = waived.rows, requirements_in_words(judged, waived)
    geometry = analysis.geometry
    resolution = Resolution(
        range=geometry.range_resolution(mission.radar.bandwidth, SPEED_OF_LIGHT),
        cross_range=geometry.cross_range_resolution(mission.radar.wavelength, mission.collection.aperture_time),
    )
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
        resolution=resolution,
        allocation=analysis.allocation,
        rows=tuple(rows),
        requirements=requirements,
        kinds=declared_kinds(mission),
        overrides=overrides(mission, outside, today),
        warnings=(
            *_changed(mission),
            *_unknown_requirement_ids(mission, rows),
            *_overruled_model(mission),
            *waived.unused(requirements),
            *_unused_correlations(mission),
            *straight_orbits(mission),
            *_doubtful_paths(mission, input_doubts(mission)),
            *_of_instruments(analysis),
            *pull_in_caps(mission, resolution),
            *_nothing_declared(rows),
        ),
        place=_place(mission),
        paths=tuple((name, path) for name, path in _paths(mission) if path.source),
        scene=None if judged.scene is None else judged.scene.edge,
        notes=(
            *negligible_effects(judged),
            *collection_notes(analysis),
            *_unused_keys(mission),
            *_overridden(mission),
        ),
        document=mission.document,
        changes=mission.changes,
        model_doubt=model_doubt(analysis, rows),
    )


def _of_instruments(analysis: Analysis) -> Iterator[FileWarning]:
    """Warn of what sensors and clocks are stated by, and of what is stated twice."""
    mission, sync = analysis.mission, analysis.mission.synchronization
    T = mission.collection.aperture_time
    if sync is not None and not sync.is_direct_path and (sync.interval or 0.0) > T:
        line = mission.line(("synchronization", "interval"))
        yield FileWarning(line=line, message=file_warnings.exchanges_are_rare(T))
    for error in analysis.random:
        if error.noise is not None and error.noise.misfit > POOR_FIT:
            message = file_warnings.no_power_law_fits(f"platforms.{error.owner}.oscillator", error.noise.misfit)
            yield FileWarning(line=mission.line(error.path), message=message)
        declared = error.subject.axis == "accelerometer_bias" and error.declared is not None
        if declared and getattr(mission.platforms, error.owner).motion_error.acceleration is not None:
            yield FileWarning(line=mission.line(error.path), message=file_warnings.stated_twice(error.owner))


def _changed(mission: Mission) -> Iterator[FileWarning]:
    """Say that another mission was checked than the file has."""
    if mission.changes:
        message = file_warnings.another_mission(changes_words(mission.changes))
        yield FileWarning(line=None, message=message, is_of_options=True)


def _unknown_requirement_ids(mission: Mission, rows: Sequence[Row]) -> Iterator[FileWarning]:
    known = {row.id for row in rows} if mission.requirement_ids else set()
    for row_id in mission.requirement_ids:
        if row_id not in known:
            line = mission.line(("requirement_ids", row_id))
            yield FileWarning(line=line, message=file_warnings.id_of_no_row(row_id))


def _overruled_model(mission: Mission) -> Iterator[FileWarning]:
    if mission.gating_model != mission.allocation.model:
        line = mission.line(("synchronization", "method"))
        yield FileWarning(line=line, message=file_warnings.full_model_gates(mission.allocation.model))


def _nothing_declared(rows: Sequence[Row]) -> Iterator[FileWarning]:
    if all(row.status == "not_declared" or row.is_of_declare for row in rows):
        yield FileWarning(line=None, message=file_warnings.nothing_declared())


def _unused_correlations(mission: Mission) -> Iterator[FileWarning]:
    return (FileWarning(line, message) for line, message in unused_correlations(mission))


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


def _doubtful_paths(mission: Mission, said: Sequence[InputDoubt]) -> Iterator[FileWarning]:
    """Warn of paths in doubt where rows do not say it; a place that strays is no part of a log's residual."""
    owners = {one.owner for one in said}
    for name, path in _paths(mission):
        for doubt in path.doubts if name not in owners or path.samples else ():
            place = mission.line(("platforms", name, getattr(mission.platforms, name).way))
            yield FileWarning(line=place, message=file_warnings.path_is_doubtful(name, doubt), is_doubt=True)


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
