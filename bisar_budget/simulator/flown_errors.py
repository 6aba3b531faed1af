"""Conversion of the errors of a mission to the path and clock errors that the simulator applies to an image."""

from collections.abc import Iterable

import numpy as np

from bisar_budget.effects.effect import PLATFORMS, ErrorSource
from bisar_budget.geometry import BistaticGeometry
from bisar_budget.simulator.phase_history import Course, Errors, PathError, superposed

_MOTION_SAMPLES = 513  # of the smooth motion that a registered kind states


def flown(source: ErrorSource, size: float, geometry: BistaticGeometry, aperture_time_s: float) -> Errors:
    """Convert a single error of a given size to the path or clock errors that the simulator applies to an image.

    Parameters
    ----------
    source : ErrorSource
        Error of a platform, a clock or the terrain. It must displace the image point (`source.displaces` is true).
    size : float
        Signed size in the unit of the error, coverage factor included.
    geometry : BistaticGeometry
        True paths of the mission.
    aperture_time_s : float
        Aperture time. [s]
    """
    if source.clock is not None:
        return Errors(clock=tuple(size * float(term) for term in source.clock))
    errors = Errors()
    for platform_index in source.platforms:
        if source.motion is not None:
            times = np.linspace(-aperture_time_s / 2, aperture_time_s / 2, _MOTION_SAMPLES)
            motion = source.motion(geometry.both[platform_index], times)
            error = PathError(course=Course(times, size * motion.T))
        elif source.kind.flown_as == "time_tag":
            error = PathError(time_tag=size)
        elif source.kind.flown_as == "height":
            error = PathError(height=size)
        else:
            position, velocity, acceleration = (
                (size * x, size * y, size * z) for x, y, z in source.state_of(platform_index)
            )
            error = PathError(position, velocity, acceleration)
        errors = errors.of(PLATFORMS[platform_index], error)
    return errors


def flown_together(
    sizes: Iterable[tuple[ErrorSource, float]], geometry: BistaticGeometry, aperture_time_s: float
) -> Errors:
    """Convert several errors of given sizes to the total errors that the simulator applies to an image.

    `sizes` are pairs of an error and its signed size. The remaining arguments are those of `flown`.
    """
    return superposed(flown(source, size, geometry, aperture_time_s) for source, size in sizes)
