"""Limits of vibration: the largest motion of a platform along the line of sight that meets the requirements.

Each limit is computed twice: by the rule of Rigling & Moses, and from first principles. A motion of amplitude A along
the line of sight causes a phase with the peak φ = 2πA/λ. A sinusoidal motion makes paired echoes. Their amplitude
relative to the impulse response is J₁(φ)/J₀(φ), about φ/2. Gaussian noise with the rms phase σ leaves the fraction
exp(-σ²) of the power in the response and spreads the remaining power. An image then shows an ISLR of (exp(σ²) - 1)/E,
see `spread`. These relations are derived here. They were checked against the Fourier transform of an error-affected
aperture phase.

The requirement is divided between the platforms so that both together meet it if each stays within its share. If both
vibrate at the same frequency, the amplitudes of their echoes add in the worst phase. The allowable amplitude is
therefore divided, in the ratio of the square roots of the platforms' shares of the allowed power. The noise of the
two platforms is independent, so its variances add, and the allowed power itself is divided.

The rule of Rigling & Moses is φ² ≤ PSLR·share and σ² ≤ ISLR·share. At equal shares, its limit for sinusoids is 3 dB
below the limit from first principles. Its limit for noise exceeds the limit from first principles by the factor 1/E,
which is 0.44 dB with a uniform window. If the noise were identical on both platforms instead of independent, the ISLR
would be 3 dB higher.

A vibration between one and three cycles per aperture counts as a vibration that makes echoes, although it also causes
a quadratic phase. A slower vibration makes no echoes, see `effects.vibration`.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget import evaluators
from bisar_budget.analysis.allocation import Allocation
from bisar_budget.analysis.spread import Tone, mainlobe_energy, spread_phase
from bisar_budget.arrays import Booleans, Floats, PerCase
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.effects.slow_tones import SlowTone
from bisar_budget.effects.vibration import near_groups, worst_phases
from bisar_budget.mission.model import Mission, Shares

MAX_ECHO_PHASE_RAD = 2.0  # with a larger phase, echoes are above the response


# The evaluators take and give numbers, or arrays of cases.
_motion_of_phase: Callable[..., PerCase] = evaluators.motion_of_phase


class VibrationLimits(NamedTuple):
    """Largest allowed vibration of a platform along the line of sight, as an amplitude or an rms value. [m]

    The limit `published` follows the rule of Rigling & Moses, and `full` is derived from first principles. Amplitudes
    are measured from 0 to peak.
    """

    published: Any
    full: Any

    def by(self, model: str) -> Any:
        """Return the limit for a choice of the gating model: `published`, `full` or `strictest`. [m]

        The gating model is the model that decides the verdict. Under `strictest` the limit is the smaller of the two
        limits.
        """
        return np.minimum(*self) if model == "strictest" else self.full if model == "full" else self.published

    @property
    def margin_db(self) -> Any:
        """Ratio of the limit derived from first principles to the limit by the rule of Rigling & Moses. [dB]"""
        return 20 * np.log10(self.full / self.published)


def echo_level(phase: PerCase) -> PerCase:
    """Amplitude of a paired echo relative to the impulse response, J₁(φ)/J₀(φ).

    `phase` is the peak phase φ of the sinusoid, up to 2 rad.
    """
    j0, j1 = bessel(phase)
    return j1 / j0


def bessel(phase: PerCase) -> tuple[PerCase, PerCase]:
    """Bessel functions J₀(φ) and J₁(φ) of a phase φ of up to 2 rad."""
    term: PerCase = 1.0
    j0: PerCase = 0.0
    j1: PerCase = 0.0
    square = -((phase / 2) ** 2)
    for k in range(1, 13):  # the series of both; the last terms are rounding
        j0 = j0 + term
        j1 = j1 + term / k
        term = term * square / (k * k)
    return j0, phase / 2 * j1


class Echo(NamedTuple):
    """Paired echo of a single tone, or of several tones with neighbouring frequencies in their worst phases.

    `phase` [rad] is the peak phase of a single tone that would make an echo of the same height. `cycles` is the
    number of cycles per aperture, which is also the distance of the echo from the main response in resolution cells.
    `level` is the amplitude of the echo relative to the main response. `is_of` (tones, ...) marks the tones that make
    the echo.
    """

    phase: Any
    cycles: Any
    level: Any
    is_of: NDArray[np.bool_]


def level_of(phase: PerCase) -> PerCase:
    """Amplitude of a paired echo relative to the impulse response, for any peak phase.

    Up to a peak phase of 2 rad it is `echo_level`. Above 2 rad it is taken as half the phase.
    """
    return np.where(phase <= MAX_ECHO_PHASE_RAD, echo_level(np.minimum(phase, MAX_ECHO_PHASE_RAD)), phase / 2)[()]


def quadratures(tones: Sequence[Tone]) -> list[tuple[int, int]]:
    """List the pairs of tones that are in quadrature, which means a quarter cycle apart.

    Each item is a pair of indices in `tones`.
    """
    index_by_id = {tone.subject.id: index for index, tone in enumerate(tones)}
    return [
        (here, index_by_id[tone.in_quadrature])
        for here, tone in enumerate(tones)
        if tone.in_quadrature in index_by_id
    ]


def highest_echo(tones: Sequence[Tone], shape: tuple[int, ...] = ()) -> Echo | None:
    """Find the highest paired echo of a single tone, or of a group of tones with neighbouring frequencies.

    `shape` is the shape of the numbers in `tones`. It is (cases,), or () for plain numbers. The result is None if
    `tones` is empty. In a case without a tone, the level of the echo is 0.
    """
    if not tones:
        return None
    count = len(tones)
    phases, cycles, is_there = (
        np.array([np.broadcast_to(column, shape) for column in columns]).reshape(count, -1)
        for columns in zip(*(tone[1:4] for tone in tones), strict=True)
    )
    phases = np.where(is_there, phases, 0.0)
    pairs = quadratures(tones)
    for first, second in pairs:  # both have one frequency and together form one tone
        phases[second], phases[first] = np.hypot(phases[first], phases[second]), 0.0
    number = near_groups(np.where(is_there, cycles, 0.0))
    here = np.arange(phases.shape[1])
    levels = np.asarray(level_of(phases))
    largest = levels.argmax(axis=0)
    phase, frequency, level = (column[largest, here] for column in (phases, cycles, levels))
    is_of = np.arange(count)[:, None] == largest
    for group in range(number.max() + 1):
        members = number == group
        cases_with_group = np.flatnonzero(members.any(axis=0))
        worst = worst_phases(phases[:, cases_with_group], cycles[:, cases_with_group], members[:, cases_with_group])
        height = level_of(worst.amplitude)
        is_higher = height > level[cases_with_group]
        cases_with_group = cases_with_group[is_higher]
        phase[cases_with_group], frequency[cases_with_group], level[cases_with_group] = (
            np.asarray(column)[is_higher] for column in (*worst, height)
        )
        is_of[:, cases_with_group] = members[:, cases_with_group]
    for first, second in pairs:
        is_of[first] = is_of[second] & is_there[first].astype(bool)
    phase, frequency, level = (column.reshape(shape)[()] for column in (phase, frequency, level))
    return Echo(phase, frequency, level, is_of.reshape(count, *shape))


def echo_phase(level: PerCase) -> PerCase:
    """Peak phase of a sinusoid whose paired echoes have a given amplitude relative to the impulse response. [rad]

    `level` is this amplitude, up to 1. The function is the inverse of `echo_level`.
    """
    # J₁/J₀ is above φ/2, convex, and 1 at 1.43: from here Newton's steps go down to it.
    phase = np.minimum(2 * level, 1.5)
    for _ in range(8):
        reached = echo_level(phase)
        phase = phase - (reached - level) / (1 - reached / phase + reached**2)
    return phase


def vibration_limits(mission: Mission, allocation: Allocation, metric: str) -> dict[str, VibrationLimits]:
    """Limits of the platforms' vibrations along the line of sight, set by the requirement on PSLR or ISLR. [m]

    `metric` is `pslr`, which limits amplitudes, or `islr`, which limits rms values. The result maps the names of the
    platforms to their limits. It is empty if the mission has no such requirement.
    """
    requirement_db, split = getattr(mission.requirements, metric), getattr(allocation, metric)
    if requirement_db is None:
        return {}
    power: float = 10 ** (requirement_db / 10)  # -30 dB is 10⁻³: PSLR and ISLR are power ratios
    if metric == "pslr":
        largest = echo_phase(np.sqrt(power * (split.transmitter + split.receiver)))
    else:
        largest = spread_phase(power, "full", mainlobe_energy(mission))
    wavelength, limits = mission.radar.wavelength, {}
    for name in PLATFORMS:
        # The shares of power divide the square of the rms phase.
        share = amplitude_share(split, name) if metric == "pslr" else np.sqrt(split.of(name))
        published = evaluators.vibration_limit(wavelength, power, split.of(name))
        limits[name] = VibrationLimits(published, _motion_of_phase(wavelength, largest * share))
    return limits


def tone_limits(mission: Mission, allocation: Allocation) -> tuple[str, dict[str, VibrationLimits]]:
    """Name of the requirement that limits tones, and the largest amplitude of a tone for each platform. [m]

    The requirement on PSLR limits tones. If the mission has no such requirement, the requirement on ISLR limits them.
    A tone with the peak phase φ then counts with its phase variance φ²/2. If the mission has neither requirement, the
    name is `pslr` and the mapping of limits is empty.
    """
    needs = mission.requirements
    if needs.pslr is not None or needs.islr is None:
        return "pslr", vibration_limits(mission, allocation, "pslr")
    rms = vibration_limits(mission, allocation, "islr")
    root = math.sqrt(2)
    return "islr", {
        name: VibrationLimits(root * limits.published, root * limits.full) for name, limits in rms.items()
    }


def amplitude_share(split: Shares, name: str) -> PerCase:
    """Share of a platform in the allowed amplitude of paired echoes.

    The shares of both platforms sum to 1. Their ratio is the square root of the ratio of the shares of power in
    `split`. `name` is the name of the platform.
    """
    share, share_of_other = split.of(name), split.of(next(platform for platform in PLATFORMS if platform != name))
    return evaluators.amplitude_share(share, share_of_other)


class SlowLimits(NamedTuple):
    """Amplitudes along the line of sight at which a slow vibration reaches its phase limits. [m]

    At the amplitude `quadratic` the vibration reaches the platform's limit of the quadratic phase. At the amplitude
    `cubic` it reaches the required cubic phase. `cubic` is None without a requirement on the cubic phase.

    `quadratic_use` is the fraction of the quadratic-phase limit that the declared vibration uses (its utilization).
    `use` is the larger of the utilizations of the two limits.
    """

    quadratic: Floats
    cubic: Floats | None
    use: Floats
    quadratic_use: Floats

    @property
    def smallest(self) -> Floats:
        """Smaller of the amplitudes `quadratic` and `cubic`, (cases,). [m]

        Without a requirement on the cubic phase it is `quadratic`.
        """
        return self.quadratic if self.cubic is None else np.minimum(self.quadratic, self.cubic)

    @property
    def is_cubic(self) -> Booleans:
        """Whether the cubic phase limits the vibration more strictly than the quadratic phase, (cases,)."""
        return self.use > self.quadratic_use


def slow_limits(mission: Mission, allocation: Allocation, tone: SlowTone) -> SlowLimits:
    """Largest allowed amplitudes of a vibration below one cycle per aperture. [m]

    The vibration is taken in its worst phase, see `effects.slow_tones`. The limit of the quadratic phase is the
    platform's share of the budget, autofocus gain included. The limit of the cubic phase is the mission's requirement
    on it, if there is one; it is not divided between the platforms, and autofocus does not raise it.
    """
    gain, allowed = allocation.autofocus_gain, allocation.qpe_allowed(tone.subject.owner)
    required = mission.requirements.cubic_phase_error
    with np.errstate(all="ignore"):
        quadratic, use = allowed / tone.per_metre.judged(gain), tone.declared.judged(gain) / allowed
        if required is None:
            return SlowLimits(quadratic, None, use, use)
        of_cubic = tone.declared.cubic / required
        return SlowLimits(quadratic, required / tone.per_metre.cubic, np.maximum(use, of_cubic), use)
