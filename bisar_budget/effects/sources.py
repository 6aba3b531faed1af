"""Every error a mission can have.

The list is complete: an error that the file does not declare is in it too, because a designer comes for its
allowable.
"""

import math
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np

from bisar_budget import evaluators, phrases
from bisar_budget.constants import ROUNDING, SPEED_OF_LIGHT
from bisar_budget.effects.common import common_sources
from bisar_budget.effects.effect import (
    CLOCK_UNITS,
    MOTION_UNITS,
    NOWHERE,
    PLATFORMS,
    Effect,
    ErrorSource,
    override_notes,
)
from bisar_budget.effects.subject import Subject, subject
from bisar_budget.faults import KeyPath
from bisar_budget.geometry import FRAME_AXES, BistaticGeometry, PlatformState, Vector
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import MotionError
from bisar_budget.phrases import NOTHING, Note
from bisar_budget.ranges.exact_ranges import ExactRanges, nodes_for

_AXES: tuple[Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def error_sources(
    mission: Mission, geometry: BistaticGeometry, exact: ExactRanges | None = None
) -> list[ErrorSource]:
    """List every position, velocity, acceleration, clock and other error, declared or not, in a fixed order."""
    sources: list[ErrorSource] = []
    full = _small_effects(exact or exact_ranges(mission, geometry))
    states = (geometry.transmitter, geometry.receiver)
    for name, state, of_platform in zip(PLATFORMS, states, (full[:9], full[9:18]), strict=True):
        sources += _motion(mission, name, state, of_platform)
    sources += _clock(mission, full[18:])
    sources += common_sources(mission, sources)
    sources += _terrain(mission, sources)
    sources += _other(mission)
    return sources


def exact_ranges(mission: Mission, geometry: BistaticGeometry, count: int | None = None) -> ExactRanges:
    """Exact ranges of a mission at its scene centre, at as many nodes as it needs, or a given number."""
    T, is_heard = mission.collection.aperture_time, mission.has_direct_path
    count = count or nodes_for(geometry, T, has_direct_path=is_heard)
    paths = (geometry.transmitter, geometry.receiver)
    return ExactRanges.of(paths, mission.radar.wavelength, T, count, has_direct_path=is_heard)


def _small_effects(exact: ExactRanges) -> list[Effect]:
    """Effects of small units: of each platform position, velocity, acceleration along x, y, z; of clock terms."""
    at_nodes: list[Any] = []
    times: Any = exact.times
    for platform, (track, R) in enumerate(zip(exact.tracks, exact.ranges, strict=True)):
        if exact.has_direct_path:
            kinds: Any = evaluators.direct_motion(*track, R, *exact.heard_along[platform], times)
        else:
            kinds = evaluators.full_motion(*track, R, times)
        at_nodes += [along for of_kind in kinds for along in of_kind]
    silent = 0.0 if exact.has_direct_path else 1.0  # the direct path is the clock
    at_nodes += [silent * SPEED_OF_LIGHT * exact.times**power for power in range(len(CLOCK_UNITS))]
    effects = exact.effect(np.concatenate(at_nodes, axis=1))
    return [Effect._make(one) for one in np.array(effects).T.tolist()]


def _motion(mission: Mission, name: str, state: PlatformState, full_effects: list[Effect]) -> Iterator[ErrorSource]:
    wavelength, T = mission.radar.wavelength, mission.collection.aperture_time
    rows = evaluators.published_motion(*state.position, *state.velocity, state.slant_range, wavelength, T)
    error: MotionError = getattr(mission.platforms, name).motion_error
    factor = mission.allocation.coverage_factor
    in_scene = error.frame == "scene"
    axes = state.frame(error.frame)
    for kind_index, (kind, unit) in enumerate(MOTION_UNITS.items()):
        of_kind = slice(3 * kind_index, 3 * kind_index + 3)
        effects, full = list(map(Effect._make, rows[of_kind])), full_effects[of_kind]
        covariance = error.covariance if kind != "acceleration" else None
        values: Vector | None = getattr(error, kind) if covariance is None else covariance.of(kind)
        declared = None if values is None else tuple([value * factor for value in values])
        key = "covariance" if covariance is not None else error.key_of(kind)
        path: KeyPath = ("platforms", name, "motion_error", key)
        notes = override_notes(name, error.overridden, kind)
        for axis, (what, own_path, equation, no_limit) in enumerate(_scene_axes(name, kind)):
            on_axis = None
            if declared is not None:
                if in_scene:
                    on_axis = declared[axis]
                elif covariance is None:
                    on_axis = _along_scene_axis(declared, axes, axis, error.distribution)
                else:
                    on_axis = factor * covariance.along(kind, [direction[axis] for direction in axes])
            if covariance is not None:
                own_path = (*path, *covariance.path(kind, axis))
            yield ErrorSource(
                subject=what,
                unit=unit,
                declared=on_axis,
                path=own_path if in_scene and declared is not None and key != "sensor" else path,
                effect=effects[axis],
                full=full[axis],
                direction=_AXES[axis],
                equation=equation,
                no_limit=no_limit,
                evidence=error.evidence(kind),
                is_independent=in_scene,
                notes=notes,
            )
        if in_scene or declared is None:
            continue
        for index, (axis_name, direction) in enumerate(zip(FRAME_AXES[error.frame], axes, strict=True)):
            yield ErrorSource(
                subject=subject(name, kind, axis_name, error.frame),
                unit=unit,
                declared=declared[index],
                path=(*path, *((index,) if covariance is None else covariance.path(kind, index))),
                effect=_along(effects, direction),
                full=_along(full, direction),
                direction=direction,
                equation=_equation(kind, None),
                no_limit=_no_limit(kind, f"the {error.frame} frame's {axis_name} axis"),
                evidence=error.evidence(kind),
                notes=notes,
            )


@cache
def _scene_axes(name: str, kind: str) -> tuple[tuple[Subject, KeyPath, str, Note], ...]:
    """Subject, path in the file, equation and reason for no limit, along each axis of the scene."""
    return tuple(
        (
            subject(name, kind, letter),
            ("platforms", name, "motion_error", kind, axis),
            _equation(kind, axis),
            _no_limit(kind, letter),
        )
        for axis, letter in enumerate("xyz")
    )


def _along_scene_axis(
    declared: tuple[float, ...], axes: tuple[Vector, Vector, Vector], axis: int, distribution: str
) -> float:
    """Size along one axis of the scene of errors stated along the axes of another frame.

    The three are independent, so one-sigma values add as squares and bounds add as magnitudes: a signed
    rotation would let them cancel. The sign is that of the signed rotation.
    """
    parts = [value * direction[axis] for value, direction in zip(declared, axes, strict=True)]
    size = math.hypot(*parts) if distribution == "normal" else sum(abs(part) for part in parts)
    return math.copysign(size, sum(parts))


def _along(effects: list[Effect], direction: Vector) -> Effect:
    """Effect of a unit error along a direction: the projection of the three scene effects."""
    u, v, w = direction
    # What is left of terms that cancel exactly is rounding, and would make a limit out of nothing.
    return Effect._make(
        [
            term if abs(term := a * u + b * v + c * w) > ROUNDING * (abs(a * u) + abs(b * v) + abs(c * w)) else 0.0
            for a, b, c in zip(*effects, strict=True)
        ]
    )


def _equation(kind: str, axis: int | None) -> str:
    if kind == "position":
        return "Table I" if axis is None else f"Table I row {2 + 3 * axis}"
    first = 1 if kind == "velocity" else 4
    return f"Table II rows {first}-{first + 2}" if axis is None else f"Table II row {first + axis}"


def _no_limit(kind: str, axis: str) -> Note:
    """Say why an error has no QPE limit, for the case that it has none."""
    if kind == "position":
        return phrases.no_quadratic_term_of_position()
    cause = "velocity" if kind == "velocity" else "line of sight"
    return phrases.no_component(cause, axis)


def _clock(mission: Mission, full_effects: list[Effect]) -> Iterator[ErrorSource]:
    rows = evaluators.published_clock(SPEED_OF_LIGHT, mission.radar.wavelength, mission.collection.aperture_time)
    for (term, unit), row, full in zip(CLOCK_UNITS.items(), rows, full_effects, strict=True):
        value: float | None = getattr(mission.timing_error, term)
        yield ErrorSource(
            subject=subject("clock", "timing", term),
            unit=unit,
            declared=None if value is None else value * mission.allocation.coverage_factor,
            path=("timing_error", term),
            effect=Effect._make(row),
            full=full,
            direction=NOWHERE,
            equation="Table I row 1, step of Table II" if term == "quadratic" else "Table I row 1",
            no_limit=phrases.no_quadratic_term_of_clock(term),
        )


def _terrain(mission: Mission, sources: list[ErrorSource]) -> Iterator[ErrorSource]:
    """A scene that is higher than the processor takes it for: both platforms measured too high by as much."""
    height = mission.scene.height_error
    if height is None:
        return
    of_platforms = [subject(name, "position", "z") for name in PLATFORMS]
    up = [source for source in sources if source.subject in of_platforms]
    yield ErrorSource(
        subject=subject("mission", "terrain"),
        unit="m",
        declared=height,
        path=("scene", "height_error"),
        effect=Effect._make(map(sum, zip(*(source.effect for source in up), strict=True))),
        full=Effect._make(map(sum, zip(*(source.full for source in up), strict=True))),
        direction=_AXES[2],
        equation="full model",
        no_limit=phrases.no_quadratic_term_of_height(),
        notes=(phrases.held_to_the_total("no platform"),),
    )


def _other(mission: Mission) -> Iterator[ErrorSource]:
    for index, other in enumerate(mission.other_errors):
        yield ErrorSource(
            subject=subject("mission", "other", other.name),
            unit="rad",
            declared=other.quadratic_phase_error,
            path=("other_errors", index, "quadratic_phase_error"),
            effect=Effect(constant=0.0, linear=0.0, qpe=1.0, cubic=0.0),
            full=Effect(constant=0.0, linear=0.0, qpe=1.0, cubic=0.0),
            direction=NOWHERE,
            equation="as declared",
            no_limit=NOTHING,
            evidence=other.source,
            notes=(phrases.held_to_the_total("no platform"),),
        )
