"""Oscillators under acceleration: phase errors due to vibration and to turns of the platform.

An acceleration a changes the fractional frequency of an oscillator by Γ·a, where Γ is the oscillator's acceleration
sensitivity. Γ is a vector of unknown direction. The worst direction is assumed, so Γ·a is the product of the lengths
of both vectors.

- A vibration with acceleration amplitude a at frequency f causes a tone with the peak phase f₀·Γ·a/f. The tone is a
  quarter cycle out of phase with the phase due to the motion itself, so the powers of the two add.
- Random vibration causes the phase spectrum S_φ = (Γ·f₀/f)²·S_a (Filler 1988).
- A clock is assumed to be set in level flight. In a turn, the specific force changes by the acceleration of the path.
  The range error is c·∫Γ·a dτ = c·Γ·(v(τ) − v(0)). A constant acceleration causes a frequency offset, which displaces
  the image; a change of the acceleration within the aperture defocuses it. The effect is computed for a Γ along each
  of three axes, and the root-sum-square of the three effects is the effect in the worst direction of Γ. A platform in
  free fall has no specific force.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from bisar_budget.arrays import Floats, PerCase, PerCaseFlag
from bisar_budget.constants import SPEED_OF_LIGHT_MPS, VECTOR_ROUNDING_FRACTION
from bisar_budget.effects.effect import PLATFORMS, Subject, subject
from bisar_budget.effects.navigation_errors import specific_force
from bisar_budget.effects.oscillator_tones import LeftTone, left_of_tone
from bisar_budget.effects.random_effect import RandomEffect, RandomError, SensorCases
from bisar_budget.effects.spectra import Parts, PowerLawPiece
from bisar_budget.effects.vibration import power_of, spectrum_parts, spectrum_pieces
from bisar_budget.error_kinds.clock_kinds import OSCILLATOR_KIND
from bisar_budget.geometry import BistaticGeometry, PlatformState, norm
from bisar_budget.mission.instruments import Oscillator
from bisar_budget.mission.model import Mission
from bisar_budget.mission.vibrations import FeltVibration, Vibration

PHASE_LAW = (1.0, 2.0)  # S_φ = (Γ·f₀)²·S_a/f²
_FELT_ACCELERATION_MPS2 = 1e-6  # m/s²; smaller accelerations of a path are ignored
_EXCHANGE_START_COUNT = 8  # start times of the exchanges, over which the effect of a turn is averaged


class Felt(NamedTuple):
    """Vibration that acts on an oscillator, and the oscillator's acceleration sensitivity [s²/m].

    `is_own` tells whether the file states the vibration for the oscillator itself, and not for its platform.
    """

    vibration: Vibration | FeltVibration
    sensitivity: PerCase
    is_own: bool


def felt(mission: Mission, name: str) -> Felt | None:
    """Vibration that a platform's oscillator feels, and its sensitivity to acceleration.

    The result is None if the file states no sensitivity.
    """
    platform = getattr(mission.platforms, name)
    oscillator: Oscillator | None = platform.oscillator
    if oscillator is None or oscillator.acceleration_sensitivity is None:
        return None
    felt_vibration = oscillator.vibration
    vibration = platform.motion_error.vibration if felt_vibration is None else felt_vibration
    return Felt(vibration, oscillator.acceleration_sensitivity, felt_vibration is not None)


def lacks_a_spectrum(mission: Mission, name: str) -> PerCaseFlag:
    """Mark the cases in which a wideband vibration without a spectrum affects the data through an oscillator.

    The rms phase of the oscillator is f₀·Γ·4π²·f·σ for an rms displacement σ at the frequency f, where Γ is the
    acceleration sensitivity and f₀ the radar's centre frequency. It cannot be computed, because f is unknown.
    """
    felt_vibration = felt(mission, name)
    if (
        felt_vibration is None
        or not isinstance(felt_vibration.vibration, Vibration)
        or felt_vibration.vibration.wideband is None
    ):
        return False
    rms, is_heard = felt_vibration.vibration.wideband.rms, name == "receiver" or not mission.has_direct_path
    return is_heard & (np.asarray(rms if not isinstance(rms, tuple) else sum(rms)) * felt_vibration.sensitivity > 0)


def is_unshaken(mission: Mission, name: str) -> PerCaseFlag:
    """Whether an oscillator is sensitive to acceleration, but the file states no vibration or turn that acts on it.

    The result is a Boolean or an array (cases,). With a direct path, it is false for the transmitter's oscillator,
    whose phase drops out of the data.
    """
    felt_vibration = felt(mission, name)
    is_heard = name == "receiver" or not mission.has_direct_path
    if felt_vibration is None or not is_heard or felt_vibration.vibration.is_stated:
        return False
    is_sensitive = np.asarray(felt_vibration.sensitivity) != 0
    return np.asarray(is_sensitive & ~np.asarray(flies_a_turn(mission, name)))


class AcceleratedTone(NamedTuple):
    """Tone that a sinusoidal vibration causes in the phase of an oscillator.

    `name` is the platform, and `entry` the index of the vibration in the file. `frequency` is in Hz, and
    `acceleration` [m/s²] is the amplitude of the acceleration. `free` [rad/(s²/m)] is the peak phase before
    synchronization, at the radar's centre frequency and per unit of the sensitivity Γ. `sensitivity` [s²/m] is Γ.
    `left` are the residual tones after synchronization, for a tone of amplitude 1. `echo` is the amplitude of the
    residual tones that cause paired echoes in the image.

    `in_quadrature` is the id of the row of the platform's vibration that causes the tone. The tone is a quarter cycle
    out of phase with that vibration. `in_quadrature` is None for a vibration along several axes, and for a vibration
    that the file states for the oscillator alone.
    """

    name: str
    entry: int
    frequency: PerCase
    acceleration: PerCase
    free: PerCase
    sensitivity: PerCase
    left: LeftTone
    echo: PerCase
    in_quadrature: str | None

    @property
    def subject(self) -> Subject:
        """Subject of the tone's row."""
        return subject(self.name, "oscillator", "acceleration", entry=self.entry)

    @property
    def per_unit(self) -> PerCase:
        """Peak phase per unit of Γ of the residual tone that causes paired echoes. [rad/(s²/m)]

        It applies at the radar's centre frequency.
        """
        return self.free * self.echo

    @property
    def phase(self) -> PerCase:
        """Peak phase of the residual tone that causes paired echoes, at the radar's centre frequency. [rad]"""
        return self.per_unit * self.sensitivity


def accelerated_tones(mission: Mission, geometry: BistaticGeometry | None = None) -> list[AcceleratedTone]:
    """List the tones that sinusoidal vibrations cause in the oscillators of the platforms.

    If a direct path synchronizes the clocks, only the receiver's tones are listed. They are in the direct signal and
    in the radar echo. If numbers of the mission are arrays over cases, `geometry` is the geometry of all cases. By
    default it is the mission's own geometry.
    """
    tones = []
    for name in PLATFORMS[mission.has_direct_path :]:
        felt_vibration = felt(mission, name)
        if felt_vibration is None:
            continue
        for index, line in enumerate(felt_vibration.vibration.sinusoidal):
            remaining = left_of_tone(line.frequency, mission, geometry or mission.geometry)
            a = norm(line.acceleration) if isinstance(line.acceleration, tuple) else line.acceleration
            free = mission.radar.center_frequency * a / line.frequency
            # Several axes may vibrate in any phase, so the tone may have any phase relative to their echo.
            is_apart = felt_vibration.is_own or isinstance(line.amplitude, tuple)
            shared = None if is_apart else subject(name, "vibration", "sinusoidal", entry=index).id
            echo = remaining.echo(mission)
            tones.append(
                AcceleratedTone(
                    name, index, line.frequency, a, free, felt_vibration.sensitivity, remaining, echo, shared
                )
            )
    return tones


def oscillator_acceleration(seen: SensorCases, name: str) -> Iterator[RandomError]:
    """Yield the error of an oscillator under acceleration; nothing if the file states no sensitivity.

    The error includes the effects of random vibration, of tones below one cycle per aperture, and of turns of the
    platform. Faster tones have rows of their own. The declared size is the sensitivity Γ [s²/m], including the
    coverage factor.
    """
    felt_vibration = felt(seen.mission, name)
    if felt_vibration is None:
        return
    published, full = seen.of_parts(_vibrating(seen, name, felt_vibration))
    # Within the short delay between direct path and echo, a turn hardly changes the phase.
    turn = None if seen.mission.has_direct_path else _turning(seen, name)
    if turn is not None:
        published, full = _together(published, turn[0]), _together(full, turn[1])
    published, full = (effect._replace(spread=effect.spread / seen.factor) for effect in (published, full))
    row_subject, size = subject(name, OSCILLATOR_KIND.name, "acceleration"), OSCILLATOR_KIND.size("acceleration")
    declared = felt_vibration.sensitivity * seen.factor + np.zeros(seen.cases)
    path = OSCILLATOR_KIND.path(name, row_subject.axis)
    yield RandomError(row_subject, size.unit, declared, path, published, full)


def _vibrating(seen: SensorCases, name: str, felt_vibration: Felt) -> Parts:
    """Mean squares of the Legendre parts of the range error due to vibration, per squared unit of Γ. [m²/unit²]

    Γ is the acceleration sensitivity of the oscillator. The mean squares are sums over the vibration spectrum and the
    slow tones. Each tone is taken in its worst phase.
    """
    mission, total = seen.mission, np.zeros((len(Parts._fields), seen.cases))
    if mission.has_direct_path and name == "transmitter":  # the transmitter's oscillator drops out
        return Parts(*total)
    sync, vibration = mission.synchronization, felt_vibration.vibration
    if vibration.spectrum is not None:
        interval = None if sync is None else sync.interval
        delay = seen.geometry.echo_delay if mission.has_direct_path else None
        random = spectrum_parts(seen, vibration.spectrum, PHASE_LAW, interval, delay)
        total += random.rows * (power_of(vibration) * np.square(mission.radar.center_frequency))
    for line in accelerated_tones(mission, seen.geometry):
        if line.name == name:
            total += line.left.slow_parts(seen.aperture_time).times(np.square(line.free)).rows.reshape(len(total), -1)
    return Parts(*total).times(np.square(mission.radar.wavelength) / (4 * math.pi**2))


def _turning(seen: SensorCases, name: str) -> tuple[RandomEffect, RandomEffect] | None:
    """Effects of a path's acceleration on the oscillator per unit of Γ, in the published and in the full model.

    Γ is the acceleration sensitivity. The result is None for a path without acceleration and for a path in free fall,
    where no acceleration acts on the oscillator.
    """
    state: PlatformState = getattr(seen.geometry, name)
    if state.is_quadratic and not np.any(norm(state.acceleration) > _FELT_ACCELERATION_MPS2):
        return None
    felt_part = np.where(_falls(seen.mission, state), 0.0, 1.0)
    if not np.any(felt_part):
        return None
    sync = seen.mission.synchronization
    interval = None if sync is None else sync.interval
    courses = SPEED_OF_LIGHT_MPS * felt_part * turn_courses(state, seen.exact.times, interval)
    return seen.of_courses(courses, courses)


def turn_courses(state: PlatformState, moments: Floats, interval: PerCase | None = None) -> Floats:
    """Time error per unit of acceleration sensitivity along each axis of the scene, (3, moments, …). [s/(s²/m)]

    It is v(τ) − v(0), the change of the velocity v since mid-aperture. `moments` [s] are slow times. If the clocks
    exchange pulses, once per `interval` [s], the result is the remainder after synchronization. The first exchange
    may be at any time within an interval, so the remainders for several start times are returned, (3 · start times,
    moments, …). They are scaled so that the sum of their squares is the mean square over the start times.
    """

    def gained(tau: PerCase) -> Floats:
        now, middle = state.at(tau)[1], state.velocity
        return np.array([np.broadcast_to(a - b, np.shape(tau)) for a, b in zip(now, middle, strict=True)])

    if interval is None:
        return gained(moments)
    courses = []
    for start in range(_EXCHANGE_START_COUNT):
        offset = interval * start / _EXCHANGE_START_COUNT
        before = np.floor((moments - offset) / interval) * interval + offset
        fraction = (moments - before) / interval
        exact_gain, joined = gained(moments), gained(before) * (1 - fraction) + gained(before + interval) * fraction
        remaining = exact_gain - joined  # for a constant acceleration only rounding
        courses.append(
            np.where(np.abs(remaining) > VECTOR_ROUNDING_FRACTION * np.abs(exact_gain).max(), remaining, 0.0)
            / math.sqrt(_EXCHANGE_START_COUNT)
        )
    return np.concatenate(courses)


def _falls(mission: Mission, state: PlatformState) -> PerCaseFlag:
    """Whether a platform is in free fall, for one case or an array of cases.

    The criterion is that the magnitude of the specific force is smaller than the acceleration of the path.
    """
    return norm(specific_force(mission, state)) < norm(state.acceleration)


def flies_a_turn(mission: Mission, name: str) -> PerCaseFlag:
    """Whether a turn of a platform's path accelerates its oscillator, as a Boolean or an array (cases,)."""
    state: PlatformState = getattr(mission.geometry, name)
    bends = np.asarray(not state.is_quadratic or norm(state.acceleration) > _FELT_ACCELERATION_MPS2)
    return np.asarray(bends & ~np.asarray(_falls(mission, state)))


def _together(first: RandomEffect, second: RandomEffect) -> RandomEffect:
    """Combined effect of two independent errors that have the same unit, as the root-sum-square of both effects."""
    quadratic, cubic, spread, east, north = (np.hypot(*both) for both in zip(first[:5], second[:5], strict=True))
    covariance = None
    if first.covariance is not None and second.covariance is not None:
        covariance = first.covariance + second.covariance
    hidden, higher_orders = np.hypot(first.hidden, second.hidden), np.hypot(first.rest, second.rest)
    return RandomEffect(quadratic, cubic, spread, east, north, covariance, hidden, higher_orders)


def pieces_by_acceleration(mission: Mission, name: str) -> tuple[PowerLawPiece, ...]:
    """Phase spectrum of an oscillator under random vibration, per squared unit of sensitivity. [rad²/Hz/unit²]

    The result is empty if no vibration spectrum acts on the oscillator.
    """
    felt_vibration = felt(mission, name)
    is_heard = not mission.has_direct_path or name == "receiver"
    if felt_vibration is None or felt_vibration.vibration.spectrum is None or not is_heard:
        return ()
    factor = mission.radar.center_frequency**2 * float(power_of(felt_vibration.vibration))
    return spectrum_pieces(felt_vibration.vibration.spectrum, (factor, PHASE_LAW[1]))
