"""Oscillators: phase noise stated as a mask, an Allan deviation or a power law, and the random errors it causes.

All spectra are one-sided. Synchronization of the clocks removes a part of the noise. The method of synchronization
determines which part remains. The synchronization link adds noise of its own.
"""

import math
from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np

from bisar_budget import evaluators, phrases
from bisar_budget.arrays import Booleans, Floats, PerCase
from bisar_budget.effects.effect import PLATFORMS, subject
from bisar_budget.effects.oscillator_tones import spurs_of
from bisar_budget.effects.random_effect import RandomEffect, RandomError, SensorCases
from bisar_budget.effects.spectra import Parts, PowerLawPiece, heard_parts, left_parts, link_parts, set_parts
from bisar_budget.error_kinds.clock_kinds import OSCILLATOR_KIND, SYNCHRONIZATION_KIND
from bisar_budget.mission.instruments import Oscillator, PowerLaw
from bisar_budget.mission.model import Mission
from bisar_budget.mission.readers import Points, SortedPoints
from bisar_budget.phrases import NOTHING, Note

DEFAULT_BANDWIDTH_HZ = 1e3  # Hz, upper end of the noise spectrum if the file states none
POOR_FIT_FRACTION = 0.2  # of an Allan deviation; with a larger misfit, the power law does not describe the oscillator
_EXACT_FIT_FRACTION, _GOOD_FIT_OF_TERMS_FRACTION = (
    1e-6,
    0.01,
)  # misfits of an Allan deviation: rounding, and a fit so good that no term is added
_RANK_FRACTION = 1e-7  # of the largest singular value; smaller ones leave coefficients undetermined
_BELOW_MASK_EXPONENT = 3.0  # flicker frequency noise; with the points' slope, a higher point could lower a phase
COVERED_CYCLES = 0.1  # cycles per aperture down to which a mask should reach; slower noise hardly matters


class Noise(NamedTuple):
    """Phase-noise spectrum of an oscillator at the radar's centre frequency, with notes on the assumptions behind it.

    `pieces` are the power-law pieces of the one-sided spectrum.
    """

    pieces: tuple[PowerLawPiece, ...]
    notes: tuple[Note, ...] = ()
    extrapolated: Note = NOTHING  # how the noise continues beyond the stated points
    misfit: float = 0.0  # misfit of a power law to an Allan deviation at the worst point


def noise_of(oscillator: Oscillator, center_frequency: float, aperture_time: float) -> Noise:
    """One-sided phase-noise spectrum of an oscillator at a given centre frequency. [rad²/Hz]

    `center_frequency` is in Hz, and `aperture_time` in s. The spectrum is scaled by the `level` [dB] of the
    oscillator. A power law that is fitted to an Allan deviation may depend on the aperture time, see `fitted`.
    """
    center_frequency *= 10 ** (oscillator.level / 20)  # the noise grows as the square of the frequency
    if oscillator.phase_noise is not None:
        return _of_mask(oscillator, center_frequency, aperture_time)
    bandwidth = DEFAULT_BANDWIDTH_HZ if oscillator.bandwidth is None else oscillator.bandwidth
    if oscillator.power_law is not None:
        return Noise(_of_power_law(oscillator.power_law, center_frequency, bandwidth))
    points = oscillator.allan_deviation or ()
    misfit, law = fitted(points, bandwidth, aperture_time)
    notes, beyond, last = [], NOTHING, points[-1][0]
    if len(points) == 1:
        notes.append(phrases.note("one-point-of-allan-deviation"))
    if points[0][0] > aperture_time:
        beyond = phrases.note("allan-deviation-begins", time=points[0][0])
    if last < aperture_time:
        beyond = phrases.note("allan-deviation-ends", time=last)
    if law.flicker_phase:
        notes.append(phrases.note("flicker-is-assumed"))
    return Noise(_of_power_law(law, center_frequency, bandwidth), tuple(notes), beyond, misfit)


def noise_in_case(mission: Mission, name: str) -> Noise:
    """One-sided phase-noise spectrum of a platform's oscillator at the radar's centre frequency. [rad²/Hz]

    `mission` is the mission of a single case, so its numbers are not arrays. `name` is the name of the platform.
    """
    oscillator: Oscillator = getattr(mission.platforms, name).oscillator
    return noise_of(oscillator, mission.radar.center_frequency, mission.collection.aperture_time)


def _of_mask(oscillator: Oscillator, center_frequency: float, aperture_time: float) -> Noise:
    points = oscillator.phase_noise or ()
    scale = 2 * (center_frequency / (oscillator.frequency or 1.0)) ** 2
    densities = [(f, scale * 10 ** (level / 10)) for f, level in points]
    last, pieces = points[-1][0], []
    bandwidth = last if oscillator.bandwidth is None else oscillator.bandwidth
    for (f, density), (g, next_density) in pairwise(densities):
        slope = math.log(density / next_density) / math.log(g / f)
        pieces.append(PowerLawPiece(f, g, density * f**slope, slope))
    first, density = densities[0]
    slope = _BELOW_MASK_EXPONENT
    pieces.insert(0, PowerLawPiece(0.0, first, density * first**slope, slope))
    # Tones of about a cycle per aperture make the quadratic phase.
    below = NOTHING
    if first * aperture_time > 0.5:
        below = phrases.note("mask-begins", frequency=first, slope=slope)
    notes = [phrases.note("points-are-sorted")] if isinstance(points, SortedPoints) else []
    if bandwidth < last:
        beyond = (piece.integral(max(piece.low, bandwidth), piece.high) for piece in pieces if piece.high > bandwidth)
        notes.append(phrases.note("mask-is-cut", bandwidth=bandwidth, last=last, beyond=math.sqrt(math.fsum(beyond))))
    elif bandwidth > last:
        notes.append(phrases.note("mask-ends-within-the-band", last=last, bandwidth=bandwidth))
    counted = (piece._replace(high=min(piece.high, bandwidth)) for piece in pieces if piece.low < bandwidth)
    return Noise(tuple(counted), tuple(notes), below)


def _of_power_law(law: PowerLaw, center_frequency: float, bandwidth: float) -> tuple[PowerLawPiece, ...]:
    """Convert a power law S_y of fractional frequency to the phase spectrum S_φ = f₀²·S_y/f². [rad²/Hz]

    f₀ [Hz] is the centre frequency. The spectrum extends from 0 Hz to `bandwidth` [Hz]. The result has a piece for
    each nonzero coefficient of the power law.
    """
    square = center_frequency**2
    return tuple(
        PowerLawPiece(0.0, bandwidth, square * h, slope)
        for slope, h in zip((4.0, 3.0, 2.0, 1.0, 0.0), law, strict=True)
        if h
    )


def allan_variances(tau: float, bandwidth: float) -> tuple[float, ...]:
    """Allan variances, (5,), due to each of the power-law coefficients h₋₂, h₋₁, h₀, h₁ and h₂ with the value 1.

    `tau` [s] is the averaging time. `bandwidth` [Hz] is the bandwidth of the measurement.
    """
    return (
        2 * math.pi**2 / 3 * tau,
        2 * math.log(2),
        1 / (2 * tau),
        (1.038 + 3 * math.log(2 * math.pi * bandwidth * tau)) / (4 * math.pi**2 * tau**2),
        3 * bandwidth / (4 * math.pi**2 * tau**2),
    )


class Fit(NamedTuple):
    """Power law fitted to an Allan deviation, and its largest misfit as a fraction of the stated deviation."""

    misfit: float
    law: PowerLaw


def fitted(points: Points, bandwidth: float, aperture_time: float) -> Fit:
    """Fit a power law with non-negative coefficients h₋₂ … h₁ to an Allan deviation.

    `points` are pairs of averaging time [s] and Allan deviation. `bandwidth` is in Hz, and `aperture_time` in s. The
    fit minimises the squares of the relative errors of the Allan variances. It uses only as many terms as are needed
    to describe the points. Several sets of terms may describe the points almost equally well. The fit then uses the
    set with the largest quadratic phase over the aperture.
    """
    per_term = evaluators.power_law_parts(aperture_time)[0]

    def phase(fit: Fit) -> float:
        return math.fsum(value * per_unit for value, per_unit in zip(fit.law, reversed(per_term), strict=True))

    best = Fit(math.inf, PowerLaw())
    for candidates in _fits(points, bandwidth):
        least = min(fit.misfit for fit in candidates)
        fits = max((fit for fit in candidates if fit.misfit <= 1.1 * least), key=phase)
        if fits.misfit < 0.9 * best.misfit and best.misfit > _GOOD_FIT_OF_TERMS_FRACTION:
            best = fits
    return best


@lru_cache(maxsize=64)
def _fits(points: Points, bandwidth: float) -> tuple[tuple[Fit, ...], ...]:
    """Fit each set of power-law terms to an Allan deviation, and keep the fits with only positive coefficients.

    `points` are pairs of averaging time [s] and Allan deviation. `bandwidth` is in Hz. The result has one tuple for
    each number of terms, with the fits that use this number. A number of terms without any such fit is left out.
    """
    # White and flicker phase noise have nearly the same Allan variance: the fifth term is left out.
    term_count = 4
    variances = np.array([allan_variances(tau, bandwidth)[:term_count] for tau, _ in points])
    relative = variances / np.array([deviation for _, deviation in points])[:, None] ** 2
    fits = []
    for count in range(1, min(term_count, len(points)) + 1):
        laws = (_least_squares(relative, terms) for terms in combinations(range(term_count), count))
        fits_of_count = [Fit(_misfit(relative, law), PowerLaw(*law)) for law in laws if law is not None]
        if fits_of_count:
            fits.append(tuple(fits_of_count))
    return tuple(fits)


def _least_squares(relative: Floats, terms: Sequence[int]) -> list[float] | None:
    """Coefficients of a power law whose relative Allan variances are closest to 1 in the least-squares sense.

    `relative` (points, terms) are the Allan variances due to a unit coefficient of each term, divided by the stated
    variances. `terms` are the indices of the terms that the fit uses. The result has the coefficients of all terms. A
    term that the fit does not use has the coefficient 0.

    The result is None if a coefficient is not positive or not unique. It is also None if a variance in `relative` is
    not positive, which may happen for a narrow band.
    """
    columns = relative[:, terms]
    if (columns <= 0).any():
        return None
    sizes = columns.max(axis=0)
    scaled, _, rank, _ = np.linalg.lstsq(columns / sizes, np.ones(len(columns)), rcond=_RANK_FRACTION)
    if rank < len(terms) or scaled.min() <= 0:
        return None
    law = np.zeros(relative.shape[1])
    law[list(terms)] = scaled / sizes
    coefficients: list[float] = law.tolist()
    return coefficients


def _misfit(relative: Floats, law: Sequence[float]) -> float:
    """Largest relative difference between the Allan deviations of a power law and the stated deviations.

    `relative` is described in `_least_squares`. `law` are the coefficients of the power law. A difference that is
    only rounding error is set to 1e-6.
    """
    return max(float(np.abs(np.sqrt(relative @ law) - 1).max()), _EXACT_FIT_FRACTION)


# ---------------------------------------------------------------------- errors of clocks
def clocks_without_oscillator(mission: Mission) -> tuple[str, ...]:
    """Names of the platforms whose clocks run free after they are set, but whose oscillators are not in the file.

    The random drift of such a clock is unknown, so its contribution is missing from the location budget.
    """
    sync = mission.synchronization
    if sync is None or not sync.is_holdover:
        return ()
    return tuple(name for name in PLATFORMS if getattr(mission.platforms, name).oscillator is None)


def oscillator_noise(seen: SensorCases, name: str) -> Iterator[RandomError]:
    """Yield the random error of a platform's oscillator; nothing if the file states no oscillator.

    The error consists of phase noise, and of spurs that synchronization folds below one cycle per aperture. It
    includes only the noise that remains in the data after the synchronization of the clocks.
    """
    mission = seen.mission
    oscillator: Oscillator | None = getattr(mission.platforms, name).oscillator
    if oscillator is None:
        return
    noise_parts = _left_at_1_hz(seen, name, oscillator.noise_alone)
    scale = mission.radar.center_frequency**2 * 10 ** (np.asarray(oscillator.level) / 10)
    tones = np.zeros_like(noise_parts)
    for spur in spurs_of(mission, seen.geometry):
        slow = spur.slow_parts(seen.aperture_time)
        if spur.name == name and slow is not None:
            tones += slow.rows.reshape(len(tones), -1)
    published, full = _of_clock(seen, Parts(*noise_parts * scale), Parts(*tones))
    kind = OSCILLATOR_KIND
    path = kind.section(name) if oscillator.sensor is None else (*kind.section(name), "sensor")
    error = RandomError(
        subject(name, kind.name), kind.unit, 1.0, path, published.times(seen.factor), full.times(seen.factor)
    )
    yield error._replace(
        continued=_continued(seen, name, oscillator, scale),
        is_in_doubt=_is_in_doubt(seen, oscillator),
        noise_in_case=noise_in_case,
    )


def _continued(seen: SensorCases, name: str, oscillator: Oscillator, scale: PerCase) -> RandomEffect | None:
    """Effect of the noise that is assumed below the first point of a mask; None if the noise is negligible.

    The effect is computed with the full model and includes the coverage factor. `scale` is the square of the centre
    frequency in Hz, multiplied by the level of the oscillator. The result is also None for an oscillator whose noise
    is not stated as a mask.
    """
    mask = oscillator.phase_noise
    if mask is None or np.all(mask[0][0] * seen.aperture_time <= COVERED_CYCLES):
        return None
    left = _left_at_1_hz(seen, name, oscillator.noise_alone, is_below_mask=True)
    _, full = _of_clock(seen, Parts(*left * scale), Parts(*np.zeros_like(left)))
    return full.times(seen.factor)


def _is_in_doubt(seen: SensorCases, oscillator: Oscillator) -> Booleans:
    """Mark the cases in which the spectrum used for an oscillator may differ from its actual spectrum, (cases,).

    A case is marked if the power law fits the Allan deviation poorly. All cases are marked if the file overrides the
    mask of a catalogue part with a mask for which it states no frequency. Such a mask is assumed to apply at the
    frequency of the catalogue part.
    """
    in_doubt = np.full(seen.cases, bool(oscillator.mask_at_frequency_of_part))
    if oscillator.allan_deviation is None:
        return in_doubt
    for alike, cases in seen.alike(oscillator.noise_alone):
        for case in cases.tolist():
            in_doubt[case] |= noise_of(alike, 1.0, float(seen.aperture_time[case])).misfit > POOR_FIT_FRACTION
    return in_doubt


def states_both_terms(mission: Mission) -> bool:
    """Whether the file states both the constant and the linear term of the clock error.

    These terms then replace the constant and the linear phase of free oscillators. With a direct path the result is
    False.
    """
    timing = mission.timing_error
    return not mission.has_direct_path and None not in (timing.constant, timing.linear)


def _of_clock(seen: SensorCases, noise: Parts, tones: Parts) -> tuple[RandomEffect, RandomEffect]:
    """Effects of a clock's phase error in the published and in the full model.

    `noise` and `tones` [rad²] are the mean squares of the Legendre components of the clock's noise and of its slow
    tones over the aperture. Orders 0 and 1 of the noise are included if they are finite. If they are infinite, the
    displacement is set to 0 if the quadratic and cubic phases are 0; otherwise it is unknown and set to NaN. If the
    file states the constant and the linear term of the clock, these terms replace orders 0 and 1 of the noise. Orders
    0 and 1 of the slow tones are then still included. If the line of sight turns, orders 2 and 3 also displace the
    image, which reduces the defocus that they cause.
    """
    k, is_stated = 2 * math.pi / np.asarray(seen.mission.radar.wavelength), states_both_terms(seen.mission)
    quadratic, cubic, spread = np.sqrt(noise.rows[:3] + tones.rows[:3])
    has_both_terms = np.isfinite(noise.constant + noise.linear)
    nothing = np.where(is_stated | (quadratic + cubic == 0), 0.0, math.nan)
    counts = has_both_terms & (not is_stated)
    counted = Parts(*np.where(counts, noise.rows, noise.of_high_orders.rows) + tones.rows).times(1 / k**2)
    is_placed = counts | is_stated
    east, north = (
        np.where(is_placed, sigma, nothing)
        for sigma in seen.moved(counted.constant, counted.linear, counted.constant_linear)
    )
    published = RandomEffect(quadratic, cubic, spread, east, north)
    (quadratic, cubic, east, north, hidden), covariance = seen.of_orders(counted.covariance)
    covariance[2:4, :, ~is_placed] = covariance[:, 2:4, ~is_placed] = 0.0
    east, north = (np.where(is_placed, sigma, nothing) for sigma in (east, north))
    return published, RandomEffect(quadratic, cubic, spread, east, north, covariance, hidden)


def _left_at_1_hz(seen: SensorCases, name: str, oscillator: Oscillator, *, is_below_mask: bool = False) -> Floats:
    """Mean squares of the Legendre components of the oscillator phase left by synchronization, (parts, cases). [rad²]

    They hold for a centre frequency of 1 Hz. For a centre frequency of f₀ Hz they are f₀² times as large. The first
    axis has the components in the order of the fields of `Parts`. With `is_below_mask`, only the spectrum below the
    first point of the mask is included.

    The remaining phase depends on how the clocks are synchronized. For free clocks, all of the noise remains. If the
    clocks exchange pulses, the noise between the exchanges remains. If the clocks were set before the aperture, the
    noise since the setting remains. If the receiver uses the direct path, no noise of the transmitter remains, and
    for the receiver only the change of its noise between the arrivals of direct signal and echo.
    """
    sync, times = seen.mission.synchronization, seen.aperture_time
    remaining = np.zeros((len(Parts._fields), seen.cases))
    if sync is not None and sync.is_direct_path and name == "transmitter":
        return remaining
    interval = None if sync is None else sync.interval
    for (alike, exchanged), cases in seen.alike((oscillator, interval)):
        spectra: dict[tuple[PowerLawPiece, ...], list[int]] = {}
        for case in cases.tolist():  # the fit to an Allan deviation depends on the aperture
            pieces = noise_of(alike, 1.0, float(times[case])).pieces
            spectra.setdefault(pieces[:1] if is_below_mask else pieces, []).append(case)
        for pieces, cases_of_spectrum in spectra.items():
            remaining[:, cases_of_spectrum] = _left_of(pieces, exchanged, seen, cases_of_spectrum).rows
    return remaining


def _left_of(
    pieces: Sequence[PowerLawPiece], interval: float | None, seen: SensorCases, cases_of_spectrum: Sequence[int]
) -> Parts:
    """Mean squares of the Legendre components of the phase left by synchronization, from a phase spectrum. [rad²]

    `pieces` are the pieces of the spectrum. `interval` is the interval of exchanged pulses [s]; None if there are no
    exchanges. `cases_of_spectrum` are the indices of the cases to which the spectrum applies. Each field of the
    result has the shape (len(cases_of_spectrum),).
    """
    sync, aperture_time = seen.mission.synchronization, seen.aperture_time[cases_of_spectrum]
    if sync is None or interval is not None:
        return left_parts(pieces, aperture_time, interval)

    def of_cases(value: PerCase | None) -> Floats:
        return np.broadcast_to(np.asarray(value), (seen.cases,))[cases_of_spectrum]

    if sync.is_holdover:
        return set_parts(pieces, aperture_time, of_cases(sync.age), of_cases(sync.averaging))
    # A constant phase between direct path and echo does not displace the image.
    return heard_parts(pieces, aperture_time, of_cases(seen.geometry.echo_delay)).without_constant()


def link_noise(seen: SensorCases) -> Iterator[RandomError]:
    """Yield the random phase error of the synchronization link; nothing if the file states no error of the link.

    Each exchange of pulses has an independent error. Between exchanges, the error is interpolated linearly. If the
    file states no interval of exchanges, the error is independent from pulse to pulse, and all of it spreads power.
    """
    sync = seen.mission.synchronization
    if sync is None or sync.error is None:
        return
    parts = np.zeros((len(Parts._fields), seen.cases))
    if sync.interval is None:  # independent from pulse to pulse: all of the error spreads
        parts[Parts._fields.index("left")] = 1.0
    else:
        for interval, cases in seen.alike(sync.interval):
            times, time_index = np.unique(seen.aperture_time[cases], return_inverse=True)
            parts[:, cases] = link_parts(times, interval).rows[:, time_index]
    left = Parts(*parts).without_constant()  # a constant phase does not displace the image
    published, full = _of_clock(seen, left, Parts(*np.zeros_like(parts)))
    published, full = (effect._replace(spread=effect.spread / seen.factor) for effect in (published, full))
    kind = SYNCHRONIZATION_KIND
    row_subject, declared = subject("clock", kind.name), sync.error * seen.factor
    yield RandomError(row_subject, kind.unit, declared, kind.path("clock"), published, full)
