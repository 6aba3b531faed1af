"""Which keys take an array of numbers, and which of the cases then are missions; the others are read as files are."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.effects.subject import MOTION
from bisar_budget.geometry import STILL, BistaticGeometry, PlatformState, norm
from bisar_budget.mission.changes import parts_of
from bisar_budget.mission.covariance import EIGENVALUE_TOLERANCE
from bisar_budget.mission.instruments import RISE, STEEPEST
from bisar_budget.mission.model import PLACE_KEYS, WHOLE, MetricSplits, Mission, Shares, flies_on_earth
from bisar_budget.mission.platforms import FARTHEST_BY, LEAST_BASELINE, MotionError, Platform, least_baseline
from bisar_budget.ranges.exact_ranges import Floats

SAFE = 1 + 1e-6  # nearer to a border of what forms an image, a case is checked by itself


def is_held(mission: Mission, key: str, *, is_stated: bool) -> bool:
    """Whether an array can take the place of a number, which the file states or does not.

    It cannot where the number decides more than itself: a path of an orbit or a log, the place of the scene on the
    Earth, an element of a covariance matrix.
    """
    section, *parts = parts_of(key)
    if section == "platforms":
        platform: Platform = getattr(mission.platforms, parts[0])
        if parts[1] == "motion_error":
            return _is_held_of_error(platform.motion_error, parts[2:], is_stated)
        if parts[1] == "oscillator":
            if platform.oscillator is None or (parts[2] == "frequency" and platform.oscillator.sensor is not None):
                return False  # a part holds at the frequency of its own
            return is_stated or parts[2] in ("frequency", "bandwidth")
        return not flies_on_earth(mission) and _is_held_of_path(platform, parts[1], is_stated)
    if key == "collection.aperture_time" or (section == "scene" and parts[0] in PLACE_KEYS):
        return not flies_on_earth(mission)
    return is_stated or section in _FREE or key in _FREE


def _is_held_of_error(error: MotionError, parts: Sequence[str], is_stated: bool) -> bool:
    if parts[0] in MOTION:
        return parts[0] == "acceleration" or error.covariance is None  # which replaces the others
    if parts[0] == "covariance" and error.covariance is not None:
        return is_stated and not error.covariance.is_matrix  # an element of a matrix has a twin
    return is_stated or parts[0] == "imu"


def _is_held_of_path(platform: Platform, name: str, is_stated: bool) -> bool:
    if name == "speed":
        return is_stated and platform.motion_azimuth is not None  # a fixed one has no direction
    return is_stated or (name == "climb" and platform.slant_range is not None)


# Sections and keys that a file may leave out and that may be stated by themselves.
_FREE = {
    *("timing_error", "common_motion_error", "requirements", "autofocus", "simulation"),
    *("scene.radius", "scene.height_error", "allocation.coverage_factor", "allocation.warn_above"),
    *("allocation.split.clock", "allocation.split.reserve"),
}


def is_image(mission: Mission, geometries: BistaticGeometry, cases: int) -> NDArray[np.bool_]:
    """Whether each case forms an image, with room to spare; `mission` may hold arrays, (cases,).

    A file that is read says so to the last digit, and why not.
    """
    is_one = _has_possible_figures(mission, cases)
    half = np.asarray(mission.collection.aperture_time) / 2
    still: Any = True
    for name, paths in zip(PLATFORMS, geometries.both, strict=True):
        platform = getattr(mission.platforms, name)
        is_one &= (paths.slant_range > SAFE) & (np.asarray(paths.position[2]) - paths.sinks(half) >= 0)
        is_one &= paths.has_frame(platform.motion_error.frame, SAFE)
        still = still & (norm(paths.velocity) < STILL * SAFE)
        if np.ndim(platform.speed):
            is_one &= np.asarray(platform.speed) != 0
    is_one &= ~np.asarray(still)
    for spans in geometries.spans_ground(SAFE):
        is_one &= spans
    if mission.has_direct_path:
        is_one &= _has_baseline(geometries.apart, np.broadcast_to(half, (cases,)))
    return is_one & (np.asarray(mission.radar.bandwidth) * SAFE < 2 * np.asarray(mission.radar.center_frequency))


def _has_baseline(apart: PlatformState, half: Floats) -> NDArray[np.bool_]:
    """Whether there is a direct path to follow, with room to spare."""
    return np.asarray(
        least_baseline(apart, half) > SAFE * np.maximum(LEAST_BASELINE, apart.travelled(half) / FARTHEST_BY)
    )


def _has_possible_figures(mission: Mission, cases: int) -> NDArray[np.bool_]:
    """Whether numbers that a file holds to each other fit, with room to spare: shares, masks and correlations."""
    is_one = np.ones(cases, dtype=bool)
    split = mission.allocation.split
    for shares in split if isinstance(split, MetricSplits) else (split,):
        if isinstance(shares, Shares):
            total = sum(0.0 if share is None else share for share in shares)
            is_one &= np.abs(np.asarray(total) - 1) * SAFE < WHOLE
    for name in PLATFORMS:
        platform: Platform = getattr(mission.platforms, name)
        if platform.oscillator is not None:
            for (f, level), (g, next_level) in pairwise(platform.oscillator.phase_noise or ()):
                slope = (np.asarray(next_level) - level) / math.log10(g / f)
                is_one &= (slope * SAFE > -STEEPEST) & (slope * SAFE < RISE)
        covariance = platform.motion_error.covariance
        if covariance is not None:
            rows = [[np.broadcast_to(rho, (cases,)) for rho in row] for row in covariance.correlation]
            least = np.linalg.eigvalsh(np.array(rows).transpose(2, 0, 1)).min(axis=1)
            is_one &= least > -EIGENVALUE_TOLERANCE / 2
    return is_one
