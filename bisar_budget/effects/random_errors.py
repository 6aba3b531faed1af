"""Every random error of sensors, clocks and the air that a mission names, in one case or in many."""

from bisar_budget.effects.air_delays import delay_errors
from bisar_budget.effects.clock_errors import link_noise, oscillator_noise
from bisar_budget.effects.effect import PLATFORMS, plain
from bisar_budget.effects.lever_arms import lever_arm_errors
from bisar_budget.effects.navigation_errors import common_noise, inertial_errors, position_noise
from bisar_budget.effects.oscillator_acceleration import oscillator_acceleration
from bisar_budget.effects.oscillators import noise_of
from bisar_budget.effects.other_errors import stated_effects
from bisar_budget.effects.random_effect import RandomError, SensorCases
from bisar_budget.effects.vibration_spectra import vibration_spectrum
from bisar_budget.geometry import BistaticGeometry
from bisar_budget.mission.instruments import Oscillator
from bisar_budget.mission.model import Mission


def random_errors(mission: Mission, geometry: BistaticGeometry | None = None, cases: int = 1) -> list[RandomError]:
    """List the errors of sensors, clocks and the air that a mission names, in a fixed order; nothing for most.

    Of a platform with an inertial sensor every figure is listed, declared or not, and of one with a lever arm its
    attitude. `geometry` is that of many cases;
    without it all numbers are floats.
    """
    seen = SensorCases(mission, geometry or mission.geometry, cases)
    found = [error for name in PLATFORMS for error in vibration_spectrum(seen, name)]
    found += [error for name in PLATFORMS for error in inertial_errors(seen, name)]
    found += [error for name in PLATFORMS for error in lever_arm_errors(seen, name)]
    found += [error for name in PLATFORMS for error in position_noise(seen, name)]
    found += common_noise(seen)
    found += [error for name in PLATFORMS for error in oscillator_noise(seen, name)]
    found += [error for name in PLATFORMS for error in oscillator_acceleration(seen, name)]
    found += link_noise(seen)
    found += [error for name in PLATFORMS for error in delay_errors(seen, name)]
    found += stated_effects(mission)
    return [in_one_case(mission, error) for error in found] if geometry is None else found


def in_one_case(mission: Mission, error: RandomError, case: int = 0) -> RandomError:
    """An error in plain numbers, those of a case with its mission, and with the noise of an oscillator."""
    published, full = error.published.of(case), error.full.of(case)
    noise = None
    if error.subject.kind == "oscillator" and not error.subject.axis:
        oscillator: Oscillator = getattr(mission.platforms, error.owner).oscillator
        noise = noise_of(oscillator, mission.radar.center_frequency, mission.collection.aperture_time)
    declared = None if error.declared is None else plain(error.declared, case)
    return error._replace(declared=declared, published=published, full=full, noise=noise)
