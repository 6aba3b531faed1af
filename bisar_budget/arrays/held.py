"""Which missions, keys and cases arrays hold; what they do not, `check_mission` does one by one."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bisar_budget.arrays.collections import Geometries, norm
from bisar_budget.arrays.declared import SAFE
from bisar_budget.constants import MIN_GRADIENT_ANGLE_DEG, MIN_GROUND_GRADIENT
from bisar_budget.effects.effect import CLOCK_UNITS, PLATFORMS
from bisar_budget.effects.subject import MOTION
from bisar_budget.mission.changes import parts_of
from bisar_budget.mission.model import Mission, flies_on_earth, has_instruments
from bisar_budget.mission.platforms import STILL


def not_held(mission: Mission, keys: Sequence[str]) -> str:
    """Say what of a mission arrays do not hold; empty where they hold all of it.

    `keys` vary. A path that the Earth, an orbit or a log decides is held as long as nothing varies that it follows
    from.
    """
    errors = [getattr(mission.platforms, name).motion_error for name in PLATFORMS]
    reasons = {
        "sensors and clocks": has_instruments(mission),
        "covariance": any(error.covariance is not None for error in errors),
        "allocation.split": any(key.startswith("allocation.split") for key in keys),
    }
    on_earth = flies_on_earth(mission)
    for key in keys:
        parts = list(parts_of(key))
        if key in _PLAIN or (parts[0] == "platforms" and parts[2:3] == ["motion_error"] and parts[3:4][0] in MOTION):
            known = True
        elif parts[0] == "platforms":
            platform = getattr(mission.platforms, parts[1])
            is_added = parts[2] in ("acceleration", "jerk", "snap") or (parts[2] == "climb" and platform.slant_range)
            known = not on_earth and bool(is_added or getattr(platform, parts[2]) is not None)
            known &= parts[2] != "speed" or platform.motion_azimuth is not None  # a fixed one has no direction
        elif parts[0] == "common_motion_error":
            known = mission.common_motion_error is not None
        else:
            known = parts[0] == "other_errors"
        if on_earth and key in ("collection.aperture_time",):
            known = False
        reasons[key] = not known
    return next((reason for reason, is_held in reasons.items() if is_held), "")


_PLAIN = {
    "radar.center_frequency",
    "radar.bandwidth",
    "collection.aperture_time",
    "scene.radius",
    "scene.height_error",
    *(f"timing_error.{term}" for term in CLOCK_UNITS),
    "requirements.quadratic_phase_error",
    "requirements.cubic_phase_error",
    "requirements.location_error",
    "allocation.coverage_factor",
    "allocation.warn_above",
    "autofocus.n_pull",
}


def is_image(mission: Mission, geometries: Geometries, cases: int) -> NDArray[np.bool_]:
    """Whether each case forms an image, with room to spare; `mission` may hold arrays, (cases,)."""
    is_one = np.ones(cases, dtype=bool)
    half = np.asarray(mission.collection.aperture_time) / 2
    still: Any = True
    for name, paths in zip(PLATFORMS, (geometries.transmitter, geometries.receiver), strict=True):
        platform = getattr(mission.platforms, name)
        is_one &= (paths.slant_range > SAFE) & (np.asarray(paths.position[2]) - paths.sinks(half) >= 0)
        is_one &= paths.has_frame(platform.motion_error.frame)
        still = still & (norm(paths.velocity) < STILL * SAFE)
        if np.ndim(platform.speed):
            is_one &= np.asarray(platform.speed) != 0
    turning = sum(norm(path.velocity) / path.slant_range for path in (geometries.transmitter, geometries.receiver))
    is_one &= ~np.asarray(still)
    is_one &= np.hypot(*geometries.range_gradient) > MIN_GROUND_GRADIENT * SAFE
    is_one &= np.hypot(*geometries.doppler_gradient) > 1e-9 * SAFE * turning
    is_one &= np.degrees(geometries.gradient_angle) > MIN_GRADIENT_ANGLE_DEG * SAFE
    return is_one & (np.asarray(mission.radar.bandwidth) * SAFE < 2 * np.asarray(mission.radar.center_frequency))
