"""Legendre components of phase noise over an aperture, computed from spectra that consist of power-law pieces.

The components, or parts, are the constant, linear, quadratic and cubic component, and the phase beyond the cubic.
Their mean squares are integrals of the spectrum, weighted by the squared Legendre components of a tone. Spectra
[rad²/Hz] are one-sided, for phase at the radar's centre frequency. The L(f) of a data sheet is half of such a
spectrum.

The integrals use the angle x = πfT in place of the frequency f. The edges of the integration panels are then the same
for every aperture time T, and so is the integral of a power law between two edges. Only the ends of a piece are
integrated separately.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache, partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget import evaluators
from bisar_budget.arrays import Floats, PerCase
from bisar_budget.image_plane import nodes

SERIES_ANGLE_RAD = 0.5  # angle or ratio; below it, terms cancel, and a series is used that is exact to 1e-8


class Parts(NamedTuple):
    """Mean squares and mean products of the Legendre components of a phase over the aperture. [rad²]

    `quadratic` and `cubic` are the mean squares of the quadratic and the cubic part at the aperture edge. `left` is
    the mean square of the phase beyond the cubic. `constant` and `linear` are the mean squares of the constant and
    the linear part at the aperture edge, which displace the image. `constant_quadratic` and `linear_cubic` are mean
    products of two parts. `constant`, `linear` and these two mean products are infinite if the slow noise is
    unbounded.

    `constant_linear`, `constant_cubic` and `linear_quadratic` are mean products of a part of even order and a part of
    odd order. They are nonzero only for the phase of a clock that was set before the aperture. In any other phase,
    even and odd orders are uncorrelated.
    """

    quadratic: PerCase
    cubic: PerCase
    left: PerCase
    constant: PerCase = math.inf
    linear: PerCase = math.inf
    constant_quadratic: PerCase = -math.inf
    linear_cubic: PerCase = -math.inf
    constant_linear: PerCase = 0.0
    constant_cubic: PerCase = 0.0
    linear_quadratic: PerCase = 0.0

    @property
    def covariance(self) -> Floats:
        """Covariance of the constant, linear, quadratic and cubic part at the aperture edge, (4, 4, ...). [rad²]"""
        zero = np.zeros(np.shape(self.quadratic))
        both, to_cubic, to_quadratic = (
            product + zero for product in (self.constant_linear, self.constant_cubic, self.linear_quadratic)
        )
        return np.array([
            [self.constant, both, self.constant_quadratic, to_cubic],
            [both, self.linear, to_quadratic, self.linear_cubic],
            [self.constant_quadratic, to_quadratic, self.quadratic, zero],
            [to_cubic, self.linear_cubic, zero, self.cubic],
        ])  # fmt: skip

    @property
    def rows(self) -> Floats:
        """All fields as one array, (fields, ...). [rad²]"""
        return np.array(np.broadcast_arrays(*self))

    def times(self, power: PerCase) -> "Parts":
        """Multiply all mean squares and mean products by the power ratio `power`."""
        return Parts(*(mean_square * power for mean_square in self))

    @property
    def of_high_orders(self) -> "Parts":
        """Copy in which the constant part, the linear part and their mean products are 0."""
        nothing = 0.0 * self.quadratic
        return Parts(self.quadratic, self.cubic, self.left, *(nothing,) * (len(self) - 3))

    def without_constant(self) -> "Parts":
        """Copy in which the constant part and its mean product with the quadratic part are 0.

        It is used if a constant phase does not displace the image.
        """
        nothing = 0.0 * self.quadratic
        return self._replace(constant=nothing, constant_quadratic=nothing)


def gauss_markov(aperture_time: PerCase, correlation_time: PerCase) -> Parts:
    """Mean squares of the Legendre components of a Gauss–Markov process of variance 1 and correlation exp(−|t|/τ_c).

    The process is stationary. `aperture_time` and `correlation_time` τ_c are in s.
    """
    ratio = np.asarray(aperture_time / (2 * correlation_time))
    (slow,) = evaluators.gauss_markov_parts_slow(np.minimum(ratio, SERIES_ANGLE_RAD))
    fast = np.maximum(ratio, SERIES_ANGLE_RAD)
    (exact,) = evaluators.gauss_markov_parts(fast, np.exp(-2 * fast))
    return Parts(*(np.where(ratio < SERIES_ANGLE_RAD, *both)[()] for both in zip(slow, exact, strict=True)))


def tone(angle: PerCase) -> Floats:
    """Largest Legendre components of a tone of amplitude 1 over the aperture, each at its worst phase, (5, ...).

    `angle` [rad] is πfT. The rows are quadratic part, cubic part, fraction of the tone's power beyond the cubic,
    constant part, and linear part. The quadratic, cubic, constant and linear part are given as amplitudes at the
    aperture edge.
    """
    angle = np.asarray(angle)
    slow = np.array(*evaluators.tone_parts_slow(np.minimum(angle, SERIES_ANGLE_RAD)))  # type: ignore[arg-type]
    fast = np.maximum(angle, SERIES_ANGLE_RAD)
    exact = np.array(*evaluators.tone_parts(fast, np.sin(fast), np.cos(fast)))  # type: ignore[arg-type]
    return np.where(angle < SERIES_ANGLE_RAD, slow, exact)


def held(step: PerCase) -> PerCase:
    """Spectrum of independent samples joined by straight lines, relative to its value at 0 Hz: sinc⁴.

    `step` [rad] is 2π times frequency times sampling interval.
    """
    return np.sinc(step / (2 * math.pi)) ** 4


_INTEGRAL_COUNT = 7  # leading fields of `Parts`, which are computed for any spectrum
_FOLLOWED_TURN_COUNT = 24  # cycles of a tone within the aperture up to which panels resolve them
_FAST = _FOLLOWED_TURN_COUNT * math.pi  # angle above which terms that oscillate with a tone are averaged
_RESOLVED_TURN_COUNT = 1.5  # width of a panel, in cycles per aperture, up to which its nodes resolve any tone
_FIRST_POWER_ANGLE_RAD = (
    0.1  # angle below which each part of a tone is its leading power; only 3 % lie there, exact to 4e-4
)
_OCTAVE_RATIO = 2.0
_SAME_EDGE_RATIO = 1.000001  # largest ratio of two computations of the same edge
_MIN_EDGE_RATIO = 1 + 1e-10  # least ratio of two edges of panels
_FOLLOWED_IMAGE_COUNT = 10  # sampling rates up to which each image is computed singly
_PASSED_IMAGE_COUNT = 50  # sampling rates beyond which straight lines pass less than 1e-4 of a tone's amplitude
_NEAR_ALIAS_COUNT = 3  # sampling rates, plus half the slope, within which aliases are added singly
_STEEP_EXPONENT = 4.0  # slope beyond which straight lines do not flatten an image of a piece
_FALL_EXPONENT = 6.0  # powers of e by which a steep piece falls from edge to edge

# Nodes and weights of Gauss and Legendre on 0 … 1.
_LEGENDRE_NODES, _LEGENDRE_WEIGHTS = (
    (0.5 + 0.5 * nodes(6).places)[:, None],
    nodes(6).fit[0][:, None],
)
_MAX_PANEL_COUNT = 4096  # panels in one integration


def _tone_edges(aperture_time: float) -> list[float]:
    """Edges of the frequency panels for integrals that contain the Legendre components of a tone. [Hz]

    The edges are in ascending order. Within a panel, these components are smooth functions of frequency.
    `aperture_time` is in s.
    """
    scale = math.pi * aperture_time
    edges = [_FIRST_POWER_ANGLE_RAD / scale * _OCTAVE_RATIO**n for n in range(4)]
    return edges + [math.pi * n / scale for n in range(1, _FOLLOWED_TURN_COUNT + 1)]


_EDGES = np.array(_tone_edges(1 / math.pi))  # edges as angles πfT


class PowerLawPiece(NamedTuple):
    """Piece of a spectrum: the power law density·f^(−slope) [rad²/Hz] from the frequency `low` to `high` [Hz]."""

    low: float
    high: float
    density: float
    slope: float

    def at(self, f: PerCase) -> PerCase:
        """Density of the power law at the frequencies `f` [Hz], which may also be outside the piece. [rad²/Hz]"""
        return self.density * f**-self.slope

    def integral(self, low: float, high: float) -> float:
        """Integral of the power law from the frequency `low` to `high` [Hz], which may be outside the piece. [rad²]

        `low` may be zero if the integral converges.
        """
        exponent = 1 - self.slope
        if abs(exponent) < 1e-9:
            return self.density * math.log(high / low)
        return float(self.density * (high**exponent - (low**exponent if low else 0.0)) / exponent)


def density(pieces: Sequence[PowerLawPiece], frequency: Floats) -> Floats:
    """Density of a spectrum at the given frequencies [Hz]; 0 outside all pieces. [rad²/Hz]"""
    total = np.zeros_like(frequency)
    for piece in pieces:
        is_in = (piece.low <= frequency) & (frequency < piece.high)
        total += np.where(is_in, piece.at(np.where(is_in, frequency, 1.0)), 0.0)
    return total


def parts(pieces: Sequence[PowerLawPiece], aperture_time: PerCase, above: PerCase = 0.0) -> Parts:
    """Mean squares and mean products of the Legendre components of a phase over the aperture, from its spectrum.

    They are integrals of the spectrum, weighted by the squared Legendre components of a tone. `Parts` lists the
    components, and the pairs of components whose mean products are returned. The result is accurate to 1e-4.

    Parameters
    ----------
    pieces : sequence of PowerLawPiece
        Pieces of a one-sided spectrum. [rad²/Hz]
    aperture_time : float or (cases,)
        Aperture time. [s]
    above : float or (cases,)
        Lower limit of the integral. [Hz]
    """
    scale = math.pi * np.atleast_1d(aperture_time)
    total = np.zeros((_INTEGRAL_COUNT, *scale.shape))
    for piece in pieces:
        to_angle = piece.density * scale ** (piece.slope - 1)
        low = np.minimum(np.maximum(piece.low, above), piece.high)
        total += to_angle * _of_power_law(piece.slope, low * scale, piece.high * scale)
    return _like(total, aperture_time)


def left_parts(pieces: Sequence[PowerLawPiece], aperture_time: Floats, interval: float | None) -> Parts:
    """Mean squares of the Legendre components of the phase that remains after synchronization, (cases,) each.

    `pieces` are the pieces of the phase spectrum before synchronization. `aperture_time` [s] has the shape (cases,).
    `interval` [s] is the interval of the exchanged pulses; it is None if pulses are not exchanged, so that all of the
    phase remains.
    """
    times, time_index = np.unique(aperture_time, return_inverse=True)
    parts_of_times = parts(pieces, times) if interval is None else synchronized_parts(pieces, times, interval)
    return Parts(*parts_of_times.rows[:, time_index])


def _like(total: Floats, aperture_time: PerCase) -> Parts:
    """Convert an array (parts, cases) to `Parts`, with plain numbers as fields if `aperture_time` is a number."""
    return Parts(*total) if np.ndim(aperture_time) else Parts(*total[:, 0].tolist())


def _of_power_law(slope: float, low: Floats, high: Floats) -> Floats:
    """Integrals of a spectrum x^(−slope), weighted by the squared Legendre components of a tone, (parts, cases).

    The angle x [rad] is πfT, where f is the frequency and T the aperture time. `low` and `high` (cases,) are the
    limits of the integrals in x. The first axis has the components in the order of `squares`.
    """
    first = np.searchsorted(_EDGES, low * _SAME_EDGE_RATIO, side="right")
    last = np.searchsorted(_EDGES, high / _SAME_EDGE_RATIO, side="left")
    has_edge = last > first
    until = np.where(has_edge, _EDGES[np.minimum(first, _EDGES.size - 1)], high)
    start = np.where(has_edge, _EDGES[last - 1], high)
    between = _between_edges(slope)
    between_edges = np.where(has_edge, between[:, last - 1] - between[:, np.minimum(first, _EDGES.size - 1)], 0.0)
    return between_edges + _at_an_end(slope, low, until) + _at_an_end(slope, start, high)


@lru_cache(maxsize=256)
def _between_edges(slope: float) -> Floats:
    """Integrals, up to each panel edge, of a spectrum x^(−slope) weighted by a tone's squared Legendre components.

    The angle x [rad] is πfT, where f is the frequency and T the aperture time. The integrals begin at the first edge
    of the panels. The result is (parts, edges), with the components in the order of `squares`.
    """
    panels = _power_panels(slope, _EDGES[:-1], _EDGES[1:])
    return np.concatenate((np.zeros((len(panels), 1)), np.cumsum(panels, axis=1)), axis=1)


def _at_an_end(slope: float, low: Floats, high: Floats) -> Floats:
    """Integrals of a spectrum x^(−slope), weighted by the squared Legendre components of a tone, within one panel.

    The function is used at the ends of a spectrum, which cover a panel only partly. The angle x [rad] is πfT, where f
    is the frequency and T the aperture time. `low` and `high` (cases,) are the limits of the integrals in x. The
    result is (parts, cases), with the components in the order of `squares`. Separate formulas are used for low and
    for high frequencies. The result is 0 if `low` equals `high`.
    """
    total = np.zeros((_INTEGRAL_COUNT, low.size))
    is_slow = high <= _FIRST_POWER_ANGLE_RAD * _SAME_EDGE_RATIO
    is_fast = (low >= _FAST / _SAME_EDGE_RATIO) & (high > low + _RESOLVED_TURN_COUNT * math.pi)
    for is_chosen, of_panel in (
        (is_slow, _slow),
        (~is_slow & is_fast, _fast),
        (~is_slow & ~is_fast, _power_panels),
    ):
        chosen = is_chosen & (low < high)
        if chosen.any():
            total[:, chosen] = of_panel(slope, low[chosen], high[chosen])
    return total


def _integral(exponent: float, low: Floats, high: Floats) -> Floats:
    """Integral of x^exponent between two angles; infinite if the lower angle is zero and the integral diverges."""
    power = exponent + 1
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(high / low) if abs(power) < 1e-9 else (high**power - low**power) / power)


def _slow(slope: float, low: Floats, high: Floats) -> Floats:
    """Integrals of a spectrum x^(−slope), weighted by the squared Legendre components of a slow tone, (parts, cases).

    The angle x [rad] is πfT, where f is the frequency and T the aperture time. `low` and `high` (cases,) are the
    limits of the integrals in x. The first axis has the components in the order of `squares`. The quadratic and cubic
    component, the power beyond the cubic, the constant and the linear component of a tone are replaced by their
    leading powers x²/2, x³/6, x⁸/99225, 1 and x.
    """
    powers = ((4, 4), (6, 36), (8, 99225), (0, 1), (2, 1), (2, -2), (4, -6))
    return np.array([_integral(power - slope, low, high) / divisor for power, divisor in powers])


def _fast(slope: float, low: Floats, high: Floats) -> Floats:
    """Integrals of a spectrum x^(−slope), weighted by the squared Legendre components of a fast tone, (parts, cases).

    The angle x [rad] is πfT, where f is the frequency and T the aperture time. `low` and `high` (cases,) are the
    limits of the integrals in x. The first axis has the components in the order of `squares`. Terms that oscillate
    with x are averaged.
    """
    (means,) = evaluators.tone_parts_fast(*(_integral(-power - slope, low, high) for power in (0, 2, 4, 6, 8)))  # type: ignore[arg-type]
    return np.array(means)


def _power_panels(slope: float, low: Floats, high: Floats) -> Floats:
    """Integrals of a spectrum x^(−slope), weighted by a tone's squared Legendre components, over panels, (parts, n).

    The integrals are computed by Gauss–Legendre quadrature. The angle x [rad] is πfT, where f is the frequency and T
    the aperture time. `low` and `high` (n,) are the ends of the n panels in x. The first axis has the components in
    the order of `squares`.
    """
    span = np.log(high / low)
    x = low * np.exp(span * _LEGENDRE_NODES)
    power = x**-slope * x * span * _LEGENDRE_WEIGHTS
    return np.asarray((power * squares(x)).sum(axis=1))


def squares(angle: Floats) -> Floats:
    """Squares and products of the Legendre components of a tone over the aperture, (7, …).

    The rows are the squares of the quadratic and cubic part, the power beyond the cubic, the squares of the constant
    and linear part, the product of the constant and quadratic part, and the product of the linear and cubic part.
    `angle` [rad] is πfT. All values are mean values for a tone of power 1 and random phase. They are also the values
    for a tone of amplitude 1 if each part has its worst phase. The part of order n is shifted in phase by n quarter
    cycles, so parts whose orders differ by two have opposite signs.
    """
    quadratic, cubic, spread, constant, linear = tone(angle)
    both = -constant * quadratic, -linear * cubic
    return np.array((quadratic**2, cubic**2, spread, constant**2, linear**2, *both))


# ---------------------------------------------------------------------- clocks that were set
_RESOLVED_AGE_CYCLES = (
    24.0  # cycles within the age of the setting up to which aperture and setting are followed together
)
_GRID_AGES_CYCLES = np.concatenate(
    (np.geomspace(1e-6, 0.125, 18), np.arange(0.25, _RESOLVED_AGE_CYCLES + 0.1, 0.25))
)  # panel edges, in cycles within the age


def set_parts(pieces: Sequence[PowerLawPiece], aperture_time: Floats, age: Floats, averaging: Floats) -> Parts:
    """Mean squares and mean products of the Legendre components of the phase of a clock set before the aperture.

    The parts, (cases,) each, are computed from the spectrum of the phase. Setting the clock subtracts a line that is
    fitted to the clock's phase over the averaging time, at an age H before mid-aperture. With x = πfT, y = πft_c and
    θ = 2πfH, the constant part of a tone is then A₀ = j₀(x) − e^(−iθ)·[j₀(y) + H·(6i/t_c)·j₁(y)], and its linear part
    at the aperture edge is A₁ = 3i·j₁(x) − (T/2)·e^(−iθ)·(6i/t_c)·j₁(y). The higher orders are equal to the orders
    for a clock that was never set. These relations are derived here, not taken from a publication. The result is
    bounded for spectra up to a slope of f⁻⁴. For tones with more than 24 cycles within the age, the phases during the
    setting and during the aperture are treated as uncorrelated.

    Parameters
    ----------
    pieces : sequence of PowerLawPiece
        Pieces of a one-sided spectrum. [rad²/Hz]
    aperture_time, age, averaging : (cases,)
        Aperture time T, age H, and averaging time t_c [s]. The age runs from the middle of the averaging to
        mid-aperture, and is at least (t_c + T)/2.
    """
    beyond = _RESOLVED_AGE_CYCLES / age
    times, above = (aperture_time, aperture_time, averaging), (0.0 * beyond, beyond, beyond)
    of_each = np.array(parts(pieces, np.concatenate(times), np.concatenate(above))[:_INTEGRAL_COUNT])
    free, of_clock, of_line = (Parts(*columns) for columns in np.split(of_each, 3, axis=1))
    fast = of_line.linear * (2 / averaging) ** 2  # mean square of the line's slope
    half = aperture_time / 2
    together = [
        of_clock.constant + of_line.constant + age**2 * fast,
        of_clock.linear + half**2 * fast,
        age * half * fast,
        of_clock.constant_quadratic,
        0.0,
        0.0,
        of_clock.linear_cubic,
    ]
    ends = np.array([edge for piece in pieces for edge in (piece.low, piece.high)])[:, None] * age
    edges = (
        np.sort(
            np.concatenate(
                (_GRID_AGES_CYCLES[:, None] + 0.0 * age, np.clip(ends, _GRID_AGES_CYCLES[0], _RESOLVED_AGE_CYCLES))
            ),
            axis=0,
        )
        / age
    )
    span = np.log(edges[1:] / edges[:-1])
    f = edges[:-1] * np.exp(span * _LEGENDRE_NODES[:, None])  # (nodes, panels, cases)
    weight = density(pieces, f) * f * span * _LEGENDRE_WEIGHTS[:, None]
    for order_index, square in enumerate(_squares_of_set(f, aperture_time, age, averaging)):
        together[order_index] = together[order_index] + (weight * square).sum(axis=(0, 1))
    constant, linear, both, even, to_cubic, to_quadratic, odd = together
    return Parts(free.quadratic, free.cubic, free.left, constant, linear, even, odd, both, to_cubic, to_quadratic)


def _squares_of_set(f: Floats, aperture_time: Floats, age: Floats, averaging: Floats) -> Iterator[Floats]:
    """Yield the mean squares and products of the Legendre orders of a tone of power 1, for a clock set beforehand.

    The line that was fitted to set the clock is subtracted. The values are Re(A_m·A_n*), in the shape of `f` [Hz],
    for the pairs of orders mn = 00, 11, 01, 02, 03, 12, 13. The amplitudes A₀ and A₁ are given in `set_parts`.
    """
    quadratic, cubic, _, constant, linear = tone(math.pi * f * aperture_time)
    *_, mean, slope = tone(math.pi * f * averaging)
    turn, rate = np.exp(-2j * math.pi * f * age), 2j / averaging * slope
    orders = (
        constant - turn * (mean + age * rate),
        1j * linear - aperture_time / 2 * turn * rate,
        -quadratic,
        -1j * cubic,
    )
    for first, second in ((0, 0), (1, 1), (0, 1), (0, 2), (0, 3), (1, 2), (1, 3)):
        yield (orders[first] * orders[second].conjugate()).real


# ---------------------------------------------------------------------- a clock that is heard twice
_FOLLOWED_DELAY_CYCLES = 12  # cycles of a tone within the delay up to which panels resolve them


def heard_parts(pieces: Sequence[PowerLawPiece], aperture_time: PerCase, delay: PerCase) -> Parts:
    """Mean squares and mean products of the Legendre components of the change of a clock's phase over a delay.

    They are integrals of the spectrum S·4 sin²(πfΔt) of the change, where S is the spectrum of the phase itself.

    Parameters
    ----------
    pieces : sequence of PowerLawPiece
        Pieces of the one-sided spectrum S. [rad²/Hz]
    aperture_time, delay : float or (cases,)
        Aperture time T, and delay Δt. [s]
    """
    times, delays = np.broadcast_arrays(np.atleast_1d(aperture_time), np.atleast_1d(delay))
    end = max((piece.high for piece in pieces), default=0.0)
    last = np.minimum(_FOLLOWED_DELAY_CYCLES / delays, end)
    edges = [
        [*_exchange_edges(T, 1 / gap), *(edge for piece in pieces for edge in (piece.low, piece.high))]
        for T, gap in zip(times.tolist(), delays.tolist(), strict=True)
    ]

    def heard(f: Floats, cases: NDArray[np.intp]) -> Floats:
        return np.asarray(density(pieces, f) * 4 * np.sin(math.pi * f * delays[cases]) ** 2)

    scale = math.pi * times
    total = _over_panels(heard, edges, last, scale)
    _add_fast(total, pieces, last, scale, 2.0)  # for fast noise the mean of 4 sin², which is 2, is sufficient
    return _like(total, aperture_time)


# ---------------------------------------------------------------------- synchronisation
def synchronized_parts(pieces: Sequence[PowerLawPiece], aperture_time: PerCase, interval: float) -> Parts:
    """Mean squares and mean products of the Legendre components of a phase after synchronization by exchanged pulses.

    They are integrals of the spectrum of the phase that remains after synchronization. `Parts` lists the components,
    and the pairs of components whose mean products are returned. The exchanged pulses sample the phase at intervals
    T_s = `interval` [s]. The remaining phase is the phase minus the linear interpolation of its samples. The
    interpolation reproduces a tone of frequency f with the gain sinc²(f·T_s), and aliases every tone at f + m/T_s to
    f. A spectrum S therefore becomes S·(1 − sinc²)² + sinc⁴·Σ S(|f + m/T_s|), m ≠ 0. This is the mean over all
    positions of the first sample within an interval.

    The pieces of the spectrum may be narrow or steep, with arbitrary limits. The result is accurate to 1e-4, except
    for tones of more than 24 cycles per aperture. For such tones, the squared components are replaced by their
    averages over a cycle.
    """
    rate, times = 1 / interval, np.atleast_1d(aperture_time)
    scale = math.pi * times
    ends = [edge for piece in pieces for edge in _ends(piece)]
    near = _PASSED_IMAGE_COUNT if max(ends, default=0.0) > _FOLLOWED_IMAGE_COUNT * rate else _FOLLOWED_IMAGE_COUNT
    last = np.maximum(near * rate, _FAST / scale)
    images = _image_edges(ends, rate)
    edges = [[*_exchange_edges(T, rate), *images] for T in times.tolist()]
    total = _over_panels(lambda f, cases: _unjoined(pieces, f, rate), edges, last, scale)
    _add_fast(total, pieces, last, scale, 1.0)  # straight lines pass no fast noise
    total += np.array(parts(_far_images(pieces, images, rate), times)[:_INTEGRAL_COUNT])
    return _like(total, aperture_time)


def link_parts(aperture_time: PerCase, interval: float) -> Parts:
    """Mean squares of the Legendre components of a phase that is interpolated linearly between independent samples.

    `interval` [s] is the time T_s between the samples. The samples have variance 1. The one-sided spectrum of the
    phase is 2·T_s·sinc⁴(f·T_s). Its total power is ⅔.
    """
    rate, times = 1 / interval, np.atleast_1d(aperture_time)
    edges = [_exchange_edges(T, rate) for T in times.tolist()]
    last = np.full(times.shape, _FOLLOWED_IMAGE_COUNT * rate)
    total = _over_panels(
        lambda f, cases: np.asarray(2 * interval * held(2 * math.pi * f * interval)), edges, last, math.pi * times
    )
    return _like(total, aperture_time)


def _over_panels(
    density: Callable[..., Floats],
    edges: Sequence[Sequence[float]],
    high: Floats,
    scale: Floats,
) -> Floats:
    """Integrals of a spectrum, weighted by the squared Legendre components of a tone, from 0 Hz to `high`.

    The result is (parts, cases), with the components in the order of `squares`.

    `density` is the spectrum, a function of frequencies and of the indices of their cases. The integrals are computed
    panel by panel. `edges` are the edges of the panels of each case, and `high` (cases,) [Hz] is the end of the last
    panel. `scale` (cases,) [s] is πT, where T is the aperture time.
    """
    panels = [
        (low, top, case)
        for case, (of_case, end) in enumerate(zip(edges, high.tolist(), strict=True))
        for low, top in _panels(end, of_case)
    ]
    low, top, cases = (np.array(column) for column in zip(*panels, strict=True))
    total = np.zeros((_INTEGRAL_COUNT, high.size))
    for start in range(0, low.size, _MAX_PANEL_COUNT):
        block = slice(start, start + _MAX_PANEL_COUNT)
        here = cases[block]
        panel_parts = _panels_of(partial(density, cases=here), low[block], top[block], scale[here])
        for kept, parts_of_panels in zip(total, panel_parts, strict=True):
            kept += np.bincount(cases[block], parts_of_panels, high.size)
    return total


def _add_fast(total: Floats, pieces: Sequence[PowerLawPiece], last: Floats, scale: Floats, times: float) -> None:
    """Add to `total` the integrals of a spectrum above the frequencies `last` [Hz], multiplied by `times`.

    The integrals are weighted by the squared Legendre components of a tone. `total` is (parts, cases), with the
    components in the order of `squares`. `scale` [s] is πT, where T is the aperture time. Terms that oscillate with
    the angle πfT are averaged.
    """
    for piece in pieces:
        to_angle = times * piece.density * scale ** (piece.slope - 1)
        low, high = np.maximum(piece.low, last) * scale, piece.high * scale
        is_beyond = piece.high > last
        total[:, is_beyond] += to_angle[is_beyond] * _at_an_end(piece.slope, low[is_beyond], high[is_beyond])


def _panels_of(density: Callable[[Floats], Floats], low: Floats, high: Floats, scale: Floats) -> Floats:
    """Integrals of a spectrum, weighted by a tone's squared Legendre components, over n frequency panels, (parts, n).

    The first axis has the components in the order of `squares`. The integrals are computed by Gauss–Legendre
    quadrature. `density` is the spectrum as a function of frequency. `low` and `high` (n,) [Hz] are the ends of the
    panels. `scale` (n,) [s] is πT, where T is the aperture time.
    """
    is_first = low == 0
    span = np.log(high / np.where(is_first, high, low))
    f = np.where(is_first, high * _LEGENDRE_NODES, low * np.exp(span * _LEGENDRE_NODES))
    width = np.where(is_first, high, f * span) * _LEGENDRE_WEIGHTS
    angle, of_tone = f * scale, np.empty((_INTEGRAL_COUNT, *f.shape))
    is_mean = (low * scale >= _FAST / _SAME_EDGE_RATIO) & ((high - low) * scale > _RESOLVED_TURN_COUNT * math.pi)
    of_tone[..., ~is_mean] = squares(angle[:, ~is_mean])
    (mean,) = evaluators.tone_parts_fast(1.0, *(angle[:, is_mean] ** -power for power in (2, 4, 6, 8)))  # type: ignore[arg-type]
    of_tone[..., is_mean] = np.array(mean)
    return np.asarray((density(f) * width * of_tone).sum(axis=1))


def _unjoined(pieces: Sequence[PowerLawPiece], f: Floats, rate: float) -> Floats:
    """Spectrum of the phase that remains after synchronization, at the frequencies `f` [Hz]. [rad²/Hz]

    `f` (nodes, n) are the frequencies of the quadrature nodes of n panels. `rate` [Hz] is the rate at which
    synchronization samples the phase.
    """
    _, once, again = np.unique(f[0] + 1j * f[-1], return_index=True, return_inverse=True)  # cases share panels
    f = f[:, once]
    density_here, passed = density(pieces, f), np.sinc(f / rate) ** 2
    total = density_here * (1 - passed) ** 2
    is_folded = f < _FOLLOWED_IMAGE_COUNT * rate
    nearest = np.rint(f[is_folded] / rate)
    start = np.abs(f[is_folded] - nearest * rate)
    aliases = sum((_aliases(piece, start, rate) for piece in pieces), np.zeros_like(start))
    aliases += np.where(nearest == 0, 0.0, density(pieces, start) - density_here[is_folded])
    total[is_folded] += passed[is_folded] ** 2 * aliases
    return np.asarray(total[:, again])


def _aliases(piece: PowerLawPiece, start: Floats, rate: float) -> Floats:
    """Sum of the densities of a piece at the frequencies m·rate ± start, for m = 1, 2 … [rad²/Hz]

    `start` [Hz] is at most half the sampling rate. Aliases near 0 Hz, where the power law changes strongly within one
    sampling rate, are added one by one. The Euler–Maclaurin formula gives the sum of the remaining aliases.
    """
    far = math.ceil(_NEAR_ALIAS_COUNT + abs(piece.slope) / 2)
    first, end = max(1, math.floor(piece.low / rate)), min(far, math.ceil(piece.high / rate) + 1)
    sides = np.array((start, -start))
    total = np.zeros_like(sides)
    for m in range(first, end):
        total += density([piece], m * rate + sides)
    low = np.maximum(np.ceil((piece.low - sides) / rate), far)
    high = np.ceil((piece.high - sides) / rate) - 1
    there = high >= low
    total[there] += _sum_at_steps(piece, (low * rate + sides)[there], (high * rate + sides)[there], rate)
    return np.asarray(total.sum(axis=0))


def _far_images(pieces: Sequence[PowerLawPiece], edges: Sequence[float], rate: float) -> list[PowerLawPiece]:
    """Mean spectrum of the images that are not computed one by one, as pieces of a power law f⁻⁴.

    An image is the part of a spectrum that synchronization folds to another frequency. The images of the frequency
    x/T_s lie at the distance x/T_s from the multiples of the sampling rate 1/T_s. The mean replaces the sum over the
    images by an integral. At the frequency f it is (2/T_s³)·∫ S(ν)·sin⁴(πνT_s) dν/(πf)⁴.

    To this integral the Euler–Maclaurin formula adds a term with B₂(x) and the slope of f⁻⁴ at the lower end of the
    integral. Two pieces approximate this term; they begin half a sampling rate below and above that end.
    """
    low, high = np.array(list(_panels(rate / 2, [rate / 4, *edges]))).T
    f = low + (high - low) * _LEGENDRE_NODES
    aliases = density(pieces, f) + sum((_aliases(piece, f, rate) for piece in pieces), np.zeros_like(f))
    x = f / rate
    powers = aliases * np.sin(math.pi * x) ** 4 * (high - low) * _LEGENDRE_WEIGHTS
    at_half = 2 * float((powers * (x**2 - x + 1 / 6)).sum())
    integral, last = float(powers.sum()), float(_FOLLOWED_IMAGE_COUNT)
    return [
        PowerLawPiece(begin * rate, math.inf, 2 * rate**3 / math.pi**4 * power, 4.0)
        for begin, power in ((last - 0.5, at_half), (last, integral - 2 * at_half), (last + 0.5, at_half))
    ]


def _sum_at_steps(piece: PowerLawPiece, low: Floats, high: Floats, step: float) -> Floats:
    """Sum of a power law at steps from `low` to `high`, both included, by the Euler–Maclaurin formula. [rad²/Hz]

    `low`, `high` and `step` are in Hz. The sum is the integral divided by the step, plus half of the values at both
    ends, plus correction terms for k = 1, 2 and 3. Term k is B₂ₖ/(2k)!·step^(2k−1) times the difference between the
    derivatives of order 2k − 1 at both ends.
    """
    slope, density, derivatives = piece.slope, [], []
    for f in (low, high):
        at, bend = piece.at(f), step / f
        first = -slope * at * bend
        third = first * (slope + 1) * (slope + 2) * bend**2
        fifth = third * (slope + 3) * (slope + 4) * bend**2
        density.append(at)
        derivatives.append(first / 12 - third / 720 + fifth / 30240)
    integral = piece.density * _integral(-slope, low, high) / step
    return np.asarray(integral + sum(density) / 2 + derivatives[1] - derivatives[0])


def _exchange_edges(aperture_time: float, rate: float) -> list[float]:
    """Edges of the frequency panels for a synchronized phase, or for the change of a phase over an interval. [Hz]

    `aperture_time` is in seconds. `rate` [Hz] is the inverse of the interval. Within a panel, the Legendre components
    of a tone are smooth functions of frequency, and so is the fraction of the tone that linear interpolation between
    samples reproduces.
    """
    edges = [*_tone_edges(aperture_time), rate / 4, *(rate * n / 2 for n in range(1, 2 * _FOLLOWED_IMAGE_COUNT + 1))]
    octave = _FOLLOWED_TURN_COUNT / aperture_time
    while octave < rate / 4:
        edges.append(octave)
        octave *= _OCTAVE_RATIO
    return edges


def _image_edges(ends: Sequence[float], rate: float) -> list[float]:
    """Edges of frequency panels within which a spectrum and its images are smooth. [Hz]

    An image is the part of a spectrum that synchronization folds to another frequency. `ends` [Hz] are the ends of
    the pieces of the spectrum. `rate` [Hz] is the sampling rate of the synchronization.
    """
    starts = {abs(end - round(end / rate) * rate) for end in ends}
    images = [
        abs(n * rate + sign * start) for start in starts for n in range(_FOLLOWED_IMAGE_COUNT + 1) for sign in (1, -1)
    ]
    least = min((start for start in starts if start), default=rate)
    grown = (least * _OCTAVE_RATIO ** (3 * n) for n in range(1, math.ceil(math.log2(max(rate / least, 1.0)) / 3)))
    return [*ends, *images, *grown, *(n * rate for n in range(_FOLLOWED_IMAGE_COUNT + 1, _PASSED_IMAGE_COUNT))]


def _ends(piece: PowerLawPiece) -> Iterator[float]:
    """Yield the ends of a piece, and the frequencies at which a steep piece has fallen by e⁶, e¹² and e¹⁸. [Hz]"""
    yield from (piece.low, piece.high)
    if abs(piece.slope) > _STEEP_EXPONENT:
        dense = piece.low if piece.slope > 0 else piece.high
        fallen = (dense * math.exp(_FALL_EXPONENT * n / piece.slope) for n in range(1, 4))
        yield from (f for f in fallen if piece.low < f < piece.high)


def _panels(high: float, edges: Sequence[float]) -> Iterator[tuple[float, float]]:
    """Lower and upper ends of the frequency panels into which `edges` divide the range from 0 Hz to `high`. [Hz]

    Edges that differ only by rounding count as a single edge. Otherwise a frequency in the panel between them could
    be folded onto 0 Hz, where a spectrum has no value.
    """
    kept = [0.0]
    for edge in sorted(edges):
        if kept[-1] * _MIN_EDGE_RATIO < edge < high / _MIN_EDGE_RATIO:
            kept.append(edge)
    return pairwise([*kept, high])
