"""Missions in which some numbers are arrays with one element for each case.

The functions of this module find the numbers that an array can replace, and the cases that certainly form an image.
They also scale all errors below a key.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import cast

import numpy as np
from numpy.typing import NDArray

from bisar_budget import units
from bisar_budget.arrays import PerCase, PerCaseFlag
from bisar_budget.effects.effect import MOTION, PLATFORMS
from bisar_budget.error_kinds.path_kinds import TIME_TAG_KIND
from bisar_budget.error_kinds.random_kinds import (
    IMU_KIND,
    INERTIAL_FIGURES,
    LEVER_ARM_KIND,
    NAVIGATION_KIND,
    VIBRATION_KIND,
)
from bisar_budget.geometry import STILL_SPEED_MPS, BistaticGeometry, norm
from bisar_budget.image_plane import MIN_SINE, spans_ground
from bisar_budget.mission.changes import parts_of
from bisar_budget.mission.covariance import EIGENVALUE_TOLERANCE_FRACTION, MOTION_KINDS
from bisar_budget.mission.instruments import MAX_FALL_DB_PER_DECADE, MAX_RISE_DB_PER_DECADE
from bisar_budget.mission.model import (
    MISSION,
    PLACE_KEYS,
    SHARE_SUM_TOLERANCE_FRACTION,
    MetricSplits,
    Mission,
    Shares,
    flies_on_earth,
    least_age,
    least_bandwidth,
)
from bisar_budget.mission.navigation import MAX_FIX_COUNT
from bisar_budget.mission.platforms import (
    MAX_TRAVEL_RATIO,
    MIN_BASELINE_M,
    MotionError,
    Platform,
    has_body_axes,
    least_baseline,
)
from bisar_budget.mission.propagation import LEAST_ELEVATION_DEG, least_elevations
from bisar_budget.mission.quantities import QuestionError
from bisar_budget.mission.readers import (
    CONFIDENCE_FIELD,
    ListOf,
    OneOf,
    Quantity,
    Reader,
    RegisteredSizes,
    Section,
    SectionValue,
    Triple,
)
from bisar_budget.mission.vibrations import Spectrum

# ---------------------------------------------------------------- keys for arrays, and cases that are missions
SAFETY_FACTOR = 1 + 1e-6  # around a limit of image formation within which a case is checked alone


def is_held(mission: Mission, key: str, *, is_stated: bool) -> bool:
    """Whether an array with one value for each case can replace the number of a key.

    `is_stated` tells whether the file states the number. An array cannot replace a number from which other content of
    the mission is derived. Such numbers belong to an orbit or a log, to the position of the scene on the Earth, to
    the orientation of the Earth, or to a covariance matrix. A confidence is part of the form of a mission.
    """
    section, *steps = parts_of(key)
    if section == "platforms":
        platform: Platform = getattr(mission.platforms, steps[0])
        if steps[1] == "motion_error":
            return _is_held_of_error(platform.motion_error, steps[2:], is_stated)
        if steps[1] == "oscillator":
            if platform.oscillator is None or (steps[2] == "frequency" and platform.oscillator.sensor is not None):
                return False  # the noise of a part holds at the part's frequency
            return is_stated or steps[2] in _OPTIONAL_OSCILLATOR_SIZES
        return not flies_on_earth(mission) and _is_held_of_path(platform, steps[1], is_stated)
    if section == "earth_orientation" or steps[-1:] == [CONFIDENCE_FIELD]:
        return False
    if key == "collection.aperture_time" or (section == "scene" and steps[0] in PLACE_KEYS):
        return not flies_on_earth(mission)
    return is_stated or section in _FREE or key in _FREE


# Numbers that an array may replace even if the file does not state them: of an oscillator, of a motion error, and
# all numbers of some sections of a motion error.
_OPTIONAL_OSCILLATOR_SIZES = ("frequency", "bandwidth", "level")
_SPECTRUM_LEVEL, *_OPTIONAL_SIZES = (
    kind.path("receiver", axis)[3:]
    for kind, axis in (
        (VIBRATION_KIND, "spectrum"),
        (TIME_TAG_KIND, ""),
        (LEVER_ARM_KIND, "uncertainty"),
        (NAVIGATION_KIND, ""),
    )
)
_OPTIONAL_SECTIONS = (IMU_KIND.name, "registered")


def _is_held_of_error(error: MotionError, steps: Sequence[str], is_stated: bool) -> bool:
    """Whether an array can replace a number of a motion error.

    `steps` are the parts of the number's key below the motion error; `is_stated` tells whether the file states the
    number.
    """
    if steps[0] in MOTION:
        return steps[0] not in MOTION_KINDS or error.covariance is None  # which a covariance replaces
    if steps[0] == "covariance" and error.covariance is not None:
        return is_stated and not error.covariance.is_matrix  # an element of a matrix has a twin
    if tuple(steps) == _SPECTRUM_LEVEL:
        return error.vibration.spectrum is not None  # the level shifts the spectrum
    return is_stated or steps[0] in _OPTIONAL_SECTIONS or tuple(steps) in _OPTIONAL_SIZES


def _is_held_of_path(platform: Platform, name: str, is_stated: bool) -> bool:
    """Whether an array can replace a number of the path of a platform.

    `name` is the name of the number; `is_stated` tells whether the file states it.
    """
    if name == "speed":
        return is_stated and platform.motion_azimuth is not None  # a fixed platform has no direction
    return is_stated or (name == "climb" and platform.slant_range is not None)


# Optional sections and keys that may be stated alone.
_FREE = {
    *("timing_error", "common_motion_error", "requirements", "autofocus", "simulation"),
    *("scene.radius", "scene.height_error", "allocation.coverage_factor", "allocation.warn_above"),
    *("allocation.split.clock", "allocation.split.reserve"),
}


def is_image(mission: Mission, geometries: BistaticGeometry, cases: int) -> NDArray[np.bool_]:
    """Whether each case certainly forms an image, (cases,); numbers of `mission` may be arrays (cases,).

    The result is False for a case without an image, and for a case near a limit of image formation. A case near a
    limit has to be read like a mission file, which decides exactly and gives the reason.
    """
    is_safe = _has_possible_figures(mission, cases)
    half = np.asarray(mission.collection.aperture_time) / 2
    still: PerCaseFlag = True
    for name, paths in zip(PLATFORMS, geometries.both, strict=True):
        platform = getattr(mission.platforms, name)
        is_safe &= (paths.slant_range > SAFETY_FACTOR) & (np.asarray(paths.position[2]) - paths.sinks(half) >= 0)
        is_safe &= paths.has_frame(platform.motion_error.frame, SAFETY_FACTOR)
        if mission.common_motion_error is not None:
            is_safe &= paths.has_frame(mission.common_motion_error.frame, SAFETY_FACTOR)
        if platform.motion_error.lever_arm is not None:
            is_safe &= has_body_axes(paths, np.broadcast_to(half, (cases,)), SAFETY_FACTOR)
        still = still & (norm(paths.velocity) < STILL_SPEED_MPS * SAFETY_FACTOR)
        if np.ndim(platform.speed):
            is_safe &= np.asarray(platform.speed) != 0
    is_safe &= ~np.asarray(still)
    turns, sine = spans_ground(geometries, mission.radar, 2 * half, cases)
    is_safe &= turns & (sine >= SAFETY_FACTOR * MIN_SINE)
    if mission.propagation is not None:
        legs = dict(zip(PLATFORMS, geometries.both, strict=True))
        for _, _, degrees in least_elevations(mission.propagation, legs, mission.collection.aperture_time):
            is_safe &= degrees > LEAST_ELEVATION_DEG * SAFETY_FACTOR
    if mission.has_direct_path:
        halves = np.broadcast_to(half, (cases,))
        least = np.maximum(MIN_BASELINE_M, geometries.apart.travelled(halves) / MAX_TRAVEL_RATIO)
        is_safe &= least_baseline(geometries.apart, halves) > SAFETY_FACTOR * least
    return is_safe & (
        np.asarray(mission.radar.bandwidth) * SAFETY_FACTOR < 2 * np.asarray(mission.radar.center_frequency)
    )


def _has_possible_figures(mission: Mission, cases: int) -> NDArray[np.bool_]:
    """Whether all numbers with interdependent bounds are valid in each case, with a margin, (cases,).

    These numbers are the shares of a budget, the bandwidth and the noise mask of an oscillator, the correlations of a
    covariance, and the age of a holdover.
    """
    is_safe = np.ones(cases, dtype=bool)
    sync = mission.synchronization
    if sync is not None and sync.is_holdover:
        averaging = 0.0 if sync.averaging is None else sync.averaging
        is_safe &= np.asarray(sync.age) > SAFETY_FACTOR * least_age(averaging, mission.collection.aperture_time)
    split = mission.allocation.split
    for shares in split if isinstance(split, MetricSplits) else (split,):
        if isinstance(shares, Shares):
            total = sum(0.0 if share is None else share for share in shares)
            is_safe &= np.abs(np.asarray(total) - 1) * SAFETY_FACTOR < SHARE_SUM_TOLERANCE_FRACTION
    for name in PLATFORMS:
        platform: Platform = getattr(mission.platforms, name)
        if platform.oscillator is not None:
            if platform.oscillator.bandwidth is not None:
                least = least_bandwidth(np.asarray(mission.collection.aperture_time))
                is_safe &= np.asarray(platform.oscillator.bandwidth) > SAFETY_FACTOR * least
            for (f, level), (g, next_level) in pairwise(platform.oscillator.phase_noise or ()):
                slope = (np.asarray(next_level) - level) / math.log10(g / f)
                is_safe &= (slope * SAFETY_FACTOR > -MAX_FALL_DB_PER_DECADE) & (
                    slope * SAFETY_FACTOR < MAX_RISE_DB_PER_DECADE
                )
        navigation = platform.motion_error.navigation
        if navigation is not None:
            is_safe &= np.asarray(navigation.fix_count(mission.collection.aperture_time)) <= MAX_FIX_COUNT
        covariance = platform.motion_error.covariance
        if covariance is not None:
            rows = [[np.broadcast_to(rho, (cases,)) for rho in row] for row in covariance.correlation]
            least = np.linalg.eigvalsh(np.array(rows).transpose(2, 0, 1)).min(axis=1)
            is_safe &= least > -EIGENVALUE_TOLERANCE_FRACTION / 2
    return is_safe


# ---------------------------------------------------------------------- scaled errors
# Dimensions that a factor does not multiply: times and frequencies of errors, and settings.
_UNSCALED_DIMENSIONS = (units.FREQUENCY, units.TIME, units.RATIO, units.MEMORY)
# Exceptions by key: a time and a ratio that are errors, and a length that is no error.
_SCALE_FACTORS = tuple(figure.key for figure in INERTIAL_FIGURES.values() if figure.is_scale)
_OF_ERRORS, _MEASURES = (TIME_TAG_KIND.name, *_SCALE_FACTORS), ("arm",)
_ERROR_SECTIONS = ("motion_error", "common_motion_error", "timing_error", "propagation", "other_errors")
_ACCEPTED_KEYS = (
    "accepted: platforms.transmitter.motion_error, platforms.receiver.motion_error, common_motion_error, "
    "timing_error, propagation, other_errors, or a key below one of them"
)


def scaled(mission: Mission, key: str, factor: PerCase) -> Mission:
    """Multiply all errors below a key of a mission by a factor, and return the changed mission.

    Amplitudes and sigmas are multiplied, including figures that come from parts of the catalogue. Frequencies,
    correlation times and correlations are not changed. The factor may be an array (cases,).

    Raises
    ------
    QuestionError
        There cannot be errors below the key, or the mission does not state any of them.
    """
    steps = parts_of(key)
    if not any(step in _ERROR_SECTIONS for step in steps[:3]):
        raise QuestionError(f"{key}: holds no errors that --scale could multiply; {_ACCEPTED_KEYS}")
    changed, count = _below(mission, MISSION, steps, factor, key)
    if not count:
        raise QuestionError(f"{key}: the mission states no error there that --scale could multiply")
    return cast(Mission, changed)


def _below(
    value: SectionValue, reader: Reader[object], steps: Sequence[str], factor: PerCase, key: str
) -> tuple[SectionValue, int]:
    """Scale all errors below a key by a factor.

    `value` is a section, list or number of the mission, and `steps` are the parts of the key that lead from this
    value to the errors. Returns the changed value, and the number of scaled errors that are not 0.
    """
    if not steps:
        name = parts_of(key)[-1]
        if name in _MEASURES:
            return value, 0
        is_clock = parts_of(key)[0] == "timing_error" or name in _OF_ERRORS
        return _scaled(value, reader, factor, is_clock=is_clock)
    child, *remaining = steps
    reader = _form(reader, value)
    if isinstance(reader, Section) and child in reader.keys and value is not None:
        inner, count = _below(getattr(value, child), reader.keys[child].reader, remaining, factor, key)
        return value._replace(**{child: inner}), count
    if isinstance(reader, ListOf | Triple) and child.isdigit() and value and int(child) < len(value):
        below = reader.section if isinstance(reader, ListOf) else reader.component
        inner, count = _below(value[int(child)], below, remaining, factor, key)
        return (*value[: int(child)], inner, *value[int(child) + 1 :]), count
    if isinstance(reader, RegisteredSizes) and child in value:
        return {**value, child: value[child] * factor}, int(np.any(value[child]))
    raise QuestionError(f"{key}: the mission has no {child}; {_ACCEPTED_KEYS}")


def _scaled(value: SectionValue, reader: Reader[object], factor: PerCase, is_clock: bool) -> tuple[SectionValue, int]:
    """Scale all errors in a section, list or number of the mission by a factor.

    Returns the changed value, and the number of errors that are not 0.
    """
    reader = _form(reader, value)
    if value is None:
        return value, 0
    if isinstance(reader, Section):
        count = 0
        for name, below in reader.keys.items():
            if name in _MEASURES or name == "spectrum_level":  # the spectrum is scaled
                continue
            inner, inner_count = _scaled(getattr(value, name), below.reader, factor, is_clock or name in _OF_ERRORS)
            value, count = value._replace(**{name: inner}), count + inner_count
        return value, count
    if isinstance(reader, ListOf | Triple):
        below_reader = reader.section if isinstance(reader, ListOf) else reader.component
        pairs = [_scaled(entry, below_reader, factor, is_clock) for entry in value]
        return tuple(entry for entry, _ in pairs), sum(inner_count for _, inner_count in pairs)
    if isinstance(reader, RegisteredSizes):
        return {name: size * factor for name, size in value.items()}, sum(
            bool(np.any(size)) for size in value.values()
        )
    if isinstance(reader, Quantity):
        if reader.dimension in units.LEVELS:
            return value + 20 * np.log10(factor), 1
        if reader.dimension in _UNSCALED_DIMENSIONS and not is_clock:
            return value, 0
        return value * factor, int(np.any(value))
    if isinstance(value, Spectrum):
        return value.times(factor**2), 1
    if hasattr(value, "sigmas"):  # a covariance
        return value._replace(sigmas=tuple(sigma * factor for sigma in value.sigmas)), int(np.any(value.sigmas))
    return value, 0


def _form(reader: Reader[object], value: object) -> Reader[object]:
    """Find the reader that fits a value.

    If `reader` is a `OneOf`, the result is the alternative that fits; otherwise it is `reader` itself.
    """
    if isinstance(reader, OneOf):
        kind = Triple if isinstance(value, tuple) and not hasattr(value, "_fields") else Quantity
        matching = [form for form in reader.forms if isinstance(form, Section) and type(value) is form.kind]
        return next(iter([*matching, *(form for form in reader.forms if isinstance(form, kind))]), reader.forms[0])
    return reader
