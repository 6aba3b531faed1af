"""List of all random errors of sensors, clocks and the air that a mission names, for one case or many.

The list also contains errors that were analysed elsewhere, and for which the file states only the effect on the
image: a cubic phase or a displacement. Both are stated without a sign. A displacement is also stated without a
direction, so its east and north components each have half of its mean square. A stated quadratic phase has a sign and
is listed in `sources`. Stated spread power is listed in `analysis.spread`.
"""

import math
from collections.abc import Iterator

import numpy as np

from bisar_budget.effects.aided_navigation import aided_navigation
from bisar_budget.effects.air_delays import delay_errors
from bisar_budget.effects.effect import PLATFORMS, plain, subject
from bisar_budget.effects.navigation_errors import (
    common_noise,
    inertial_errors,
    lever_arm_errors,
    log_noise,
    position_noise,
)
from bisar_budget.effects.oscillator_acceleration import oscillator_acceleration
from bisar_budget.effects.oscillators import link_noise, oscillator_noise
from bisar_budget.effects.random_effect import BiasEffects, RandomEffect, RandomError, SensorCases
from bisar_budget.effects.vibration import vibration_spectrum
from bisar_budget.error_kinds.random_kinds import OTHER_KIND
from bisar_budget.geometry import BistaticGeometry
from bisar_budget.mission.model import Mission

# Effects, the same in both models, of a stated cubic phase of 1 rad and of a stated displacement of 1 m.
_CUBIC_EFFECT = RandomEffect(0.0, 1.0, 0.0, 0.0, 0.0, np.diag([0.0, 1.0] + [0.0] * 6)[..., None])
_DISPLACEMENT_EFFECT = RandomEffect(
    0.0, 0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5), np.diag([0.0, 0.0, 0.5, 0.5] + [0.0] * 4)[..., None]
)
_UNIT_EFFECTS = {"cubic_phase_error": _CUBIC_EFFECT, "location_error": _DISPLACEMENT_EFFECT}


def random_errors(mission: Mission, geometry: BistaticGeometry | None = None, cases: int = 1) -> list[RandomError]:
    """List the errors of sensors, clocks and the air that a mission names, in a fixed order.

    The list is empty for most missions. For a platform with an inertial sensor, all errors of the sensor are listed,
    declared or not. For a platform with a lever arm, the effect of attitude errors through the arm is listed.
    `geometry` is the geometry of many cases, and `cases` is their number. Without `geometry`, the mission is a single
    case, and the numbers of the errors are plain floats.
    """
    seen = SensorCases(mission, geometry or mission.geometry, cases)
    errors = [error for name in PLATFORMS for error in vibration_spectrum(seen, name)]
    errors += [error for name in PLATFORMS for error in inertial_errors(seen, name)]
    errors += [error for name in PLATFORMS for error in aided_navigation(seen, name)]
    errors += [error for name in PLATFORMS for error in lever_arm_errors(seen, name)]
    errors += [error for name in PLATFORMS for error in position_noise(seen, name)]
    errors += [error for name in PLATFORMS for error in log_noise(seen, name)]
    errors += common_noise(seen)
    errors += [error for name in PLATFORMS for error in oscillator_noise(seen, name)]
    errors += [error for name in PLATFORMS for error in oscillator_acceleration(seen, name)]
    errors += link_noise(seen)
    errors += delay_errors(seen)
    errors += _stated_effects(mission)
    return [in_one_case(mission, error) for error in errors] if geometry is None else errors


def _stated_effects(mission: Mission) -> Iterator[RandomError]:
    """Yield the errors for which the file states only a cubic phase or a displacement, as determined by the user."""
    for index, stated in enumerate(mission.other_errors):
        for key, effect in _UNIT_EFFECTS.items():
            size = getattr(stated, key)
            if size is not None:
                row_subject = subject("mission", OTHER_KIND.name, f"{stated.name}.{key}", entry=index)
                unit, path = OTHER_KIND.size(key).unit, OTHER_KIND.path("mission", key, index)
                error = RandomError(row_subject, unit, np.abs(size), path, effect, effect, spreads=False)
                bias = stated.bias.get(key)
                if bias is not None:
                    unit_phase = np.array([0.0, 1.0] + [0.0] * 6)[:, None]
                    error = error._replace(biased=BiasEffects(bias, unit_phase[:4], unit_phase))
                yield error


def in_one_case(mission: Mission, error: RandomError, case: int = 0) -> RandomError:
    """Convert an error of many cases to plain numbers for one case, including the noise spectrum of an oscillator.

    `mission` is the mission of that case, and `case` is its index in the arrays of `error`.
    """
    published, full = error.published.of(case), error.full.of(case)
    noise = None if error.noise_in_case is None else error.noise_in_case(mission, error.owner)
    declared = None if error.declared is None else plain(error.declared, case)
    continued = None if error.continued is None else error.continued.of(case)
    return error._replace(
        declared=declared,
        published=published,
        full=full,
        noise=noise,
        continued=continued,
        is_in_doubt=bool(plain(error.is_in_doubt, case)),
        biased=error.biased and error.biased.of(case),
        navigation=error.navigation and error.navigation.of(case),
    )
