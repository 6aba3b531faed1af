"""Conversion of the errors of a mission to the path and clock errors that the simulator applies to the data."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from bisar_budget.effects.effect import PLATFORMS, ErrorSource
from bisar_budget.error_kinds.path_kinds import StateKind
from bisar_budget.error_kinds.registry import MotionKind
from bisar_budget.geometry import BistaticGeometry, PlatformState, Vector, Vectors, plain_vector
from bisar_budget.simulator.phase_history import Course, Errors, PathError, superposed

_MOTION_SAMPLES = 513  # of the smooth motion that a registered kind states


def flown(source: ErrorSource, size: float, geometry: BistaticGeometry, aperture_time_s: float) -> Errors:
    """Convert a single error of a given size to the path or clock errors that the simulator applies to the data.

    Parameters
    ----------
    source : ErrorSource
        Error of a platform, a clock or the terrain. It must displace the image point (`source.displaces` is true).
    size : float
        Signed size in the unit of the error, including the coverage factor.
    geometry : BistaticGeometry
        True paths of the mission.
    aperture_time_s : float
        Aperture time. [s]
    """
    if source.clock is not None:
        return Errors(clock=tuple(size * float(term) for term in source.clock))
    errors = Errors()
    for platform_index in source.platforms:
        path_error = _path_error(source, size, platform_index, geometry.both[platform_index], aperture_time_s)
        errors = errors.of(PLATFORMS[platform_index], path_error)
    return errors


def _path_error(
    source: ErrorSource, size: float, platform_index: int, path: PlatformState, aperture_time_s: float
) -> PathError:
    """Convert a declared error to a `PathError` of one platform. The kind of error determines which field is set."""
    kind, fields = source.kind, dict[str, Any]()
    if isinstance(kind, MotionKind):
        times = np.linspace(-aperture_time_s / 2, aperture_time_s / 2, _MOTION_SAMPLES)
        fields = {kind.flown_as: Course(times, size * np.array(kind.moved(path, times)).T)}
    elif isinstance(kind, StateKind):
        fields = {kind.flown_as: _times(size, source.direction_of(platform_index))}
        if source.rates is not None:
            fields["velocity"] = _times(size, source.rates[platform_index])
    else:
        fields = {kind.flown_as: size}
    return PathError(**fields)


def _times(size: float, vector: Vectors) -> Vector:
    x, y, z = plain_vector(vector)
    return size * x, size * y, size * z


def flown_together(
    sizes: Iterable[tuple[ErrorSource, float]], geometry: BistaticGeometry, aperture_time_s: float
) -> Errors:
    """Convert several errors of given sizes to the total errors that the simulator applies to the data.

    `sizes` holds pairs of an error and its signed size. The remaining arguments are the same as for `flown`.
    """
    return superposed(flown(source, size, geometry, aperture_time_s) for source, size in sizes)
