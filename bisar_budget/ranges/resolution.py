"""Resolution on the ground: widths of the error-free point response, computed from band and aperture.

A step x over the ground changes the phase at a frequency f and a slow time τ by 2πf·g(τ)·x/c. Here g is the sum of
the horizontal components of both lines of sight. The vectors 2πf·g/c are the wave-number support. The response at the
displacement x from the peak is the mean of e^(i·phase) over the support. The cross-range width is the width along the
line of equal range at mid-aperture. The range width is the width along the conjugate direction, in which the
phase of a step is not correlated with the phase of a step along this line. The range width is given as a distance
perpendicular to the line. For a short aperture the conjugate direction is the line of equal Doppler, and the support
is a parallelogram. The first nulls then lie at c/(B|s|) and λ/(T|ṡ⊥|). Here s is the value of g at mid-aperture, and
ṡ⊥ is the component of its rate perpendicular to s. The full width at half power is 0.886 times the distance to the
first null.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from bisar_budget.arrays import Booleans, Floats, Indices, PerCase
from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.geometry import BistaticGeometry
from bisar_budget.image_plane import Band, nodes
from bisar_budget.ranges.exact_ranges import ExactRanges

BENT_EDGE_FRACTION = 0.05  # of half the support; with straighter edges the closed formulas are accurate to 1 %
_HALF_POWER = 0.5
_HALF_POWER_OF_NULL_RATIO = 0.88589  # full width at half power of a sinc, divided by the distance of its first null
_BAND_NODE_COUNT, _APERTURE_NODE_COUNT = 16, 64  # for phases of ±20 rad, reached at the last step
# Steps in units of the half width at half power of a parabola with the same curvature. In a test of 3000 circular
# arcs, no first minimum was farther away than 6 units.
_STEP_RATIO, _MAX_STEP_COUNT = 0.25, 64
_NEWTON_ROUNDS = 5  # the last round changes a width by a fraction of less than 1e-6
_MAX_CASE_COUNT = 64  # cases in one block of samples


class Resolution(NamedTuple):
    """Range and cross-range widths of the response on the ground, to the first null and at half power. [m]

    `range` and `cross_range` are the distances from the peak to the first null. `range_half_power` and
    `cross_range_half_power` are full widths at half power. If the support is not a parallelogram, the response may
    have no null. The distance to the first minimum is then used.
    """

    range: PerCase
    cross_range: PerCase
    range_half_power: PerCase
    cross_range_half_power: PerCase


def resolution(exact: ExactRanges, geometry: BistaticGeometry, radar: Band, aperture_time_s: PerCase) -> Resolution:
    """Widths of the response at the scene centre, each (cases,). [m]"""
    cases, matrix = exact.half.size, exact.matrix
    with np.errstate(all="ignore"):
        azimuth = geometry.look_azimuth * np.ones(cases)
        ahead, across = np.array((np.cos(azimuth), np.sin(azimuth))), np.array((-np.sin(azimuth), np.cos(azimuth)))
        x, y = matrix.xy * across[0] + matrix.yy * across[1], -matrix.xx * across[0] - matrix.xy * across[1]
        conjugate = np.array((x, y)) / (x * ahead[0] + y * ahead[1])
        wavelength = SPEED_OF_LIGHT_MPS / radar.center_frequency
        nulls = (
            geometry.range_resolution(radar.bandwidth, SPEED_OF_LIGHT_MPS) * np.ones(cases),
            geometry.cross_range_resolution(wavelength, aperture_time_s) * np.ones(cases),
        )
    widths = np.array((*nulls, *(_HALF_POWER_OF_NULL_RATIO * null for null in nulls)))
    relative_band = np.broadcast_to(np.asarray(radar.bandwidth / radar.center_frequency, dtype=float), (cases,))
    long = np.flatnonzero(~_is_short(exact, relative_band, conjugate, across))
    for first in range(0, long.size, _MAX_CASE_COUNT):
        some = long[first : first + _MAX_CASE_COUNT]
        slopes = _slopes(geometry, exact.half, some, max(_APERTURE_NODE_COUNT, exact.sampling.places.size))
        along = np.einsum("anc,dac->ndc", slopes, np.array((conjugate, across))[:, :, some])
        of_both = _widths(np.tile(exact.k[some], 2), np.tile(relative_band[some], 2), along.reshape(len(along), -1))
        widths[:, some] = np.reshape(of_both, (4, -1))
    return Resolution(*widths)


def cells_of_support(sight: Floats, axes: Floats, radar: Band) -> Floats:
    """Size of the resolution cell along each of several axes. [m]

    Samples at this spacing represent the response fully. `axes` (2, axes) are unit vectors on the ground. `sight`
    (times, 2) are the horizontal components of the sum of both lines of sight. The cell is the inverse of the extent
    of the wave-number support along the axis, including the corners of the support.
    """
    band = radar.center_frequency + np.array((-0.5, 0.5)) * radar.bandwidth
    extent: Floats = np.ptp(np.multiply.outer(band, sight @ axes), axis=(0, 1))
    return SPEED_OF_LIGHT_MPS / extent


def _is_short(exact: ExactRanges, relative_band: Floats, conjugate: Floats, across: Floats) -> Booleans:
    """Whether the wave-number support is close enough to a parallelogram for the closed formulas of the widths."""
    band = np.hypot(*exact.gradient[:, 0]) * relative_band / 2
    _, _, *bends = np.abs(np.einsum("aon,an->on", exact.gradient, conjugate))
    _, turn, *bends_across = np.abs(np.einsum("aon,an->on", exact.gradient, across))
    return np.asarray((sum(bends) <= BENT_EDGE_FRACTION * band) & (sum(bends_across) <= BENT_EDGE_FRACTION * turn))


def _slopes(geometry: BistaticGeometry, half: Floats, indices: Indices, count: int) -> Floats:
    """Horizontal components of the sum of both lines of sight at `count` nodes, (2, nodes, cases).

    The result covers only the cases in `indices`. `half` [s] has half the aperture time of every case, including
    cases that are not in `indices`.
    """
    slopes = np.zeros((2, count, indices.size))
    for path in geometry.both:
        x, y, z = path.of(indices).place(nodes(count).places[:, None] * half[indices])
        slopes += np.array(np.broadcast_arrays(x, y)) / np.sqrt(x * x + y * y + z * z)
    return slopes


def _widths(k: Floats, relative_band: Floats, slopes: Floats) -> tuple[Floats, Floats]:
    """Widths of the response along one direction: from peak to first null, and full width at half power. [m]

    `slopes` (nodes, cases) are the changes of range per metre along this direction.
    """
    band = nodes(_BAND_NODE_COUNT)
    wavenumbers = k * (1 + np.multiply.outer(band.places, relative_band / 2))
    mean = np.multiply.outer(band.fit[0], nodes(len(slopes)).fit[0]).ravel()
    rates = (wavenumbers[:, None] * slopes).reshape(mean.size, -1)  # change of phase by a metre [rad/m]
    rates -= mean @ rates
    unit = math.sqrt(_HALF_POWER) / np.sqrt(mean @ rates**2)
    rates *= unit
    moments = mean[:, None] * rates ** np.arange(3)[:, None, None]

    def power(step: Floats) -> tuple[Floats, Floats, Floats]:
        """Power of the response at a distance `step` from the peak, and its first two derivatives."""
        value, slope, bend = np.einsum("knc,nc->kc", moments, np.exp(1j * rates * step))
        slope, bend = 1j * slope, -bend
        first = 2 * (value.conj() * slope).real
        return np.abs(value) ** 2, first, 2 * (np.abs(slope) ** 2 + (value.conj() * bend).real)

    def above_half(step: Floats) -> tuple[Floats, Floats]:
        level, slope, _ = power(step)
        return level - _HALF_POWER, slope

    turn, turned = np.exp(1j * rates * _STEP_RATIO), np.ones(rates.shape, dtype=complex)
    last = float(_MAX_STEP_COUNT)
    level, half, null = np.ones(unit.size), np.full(unit.size, last), np.full(unit.size, last)
    for step in range(1, _MAX_STEP_COUNT):
        turned = turned * turn
        before, level = level, np.abs(mean @ turned) ** 2
        half = np.where((half == last) & (level < _HALF_POWER), step - 0.5, half)
        null = np.where((null == last) & (half < last) & (level > before), step - 1.0, null)
        if (null < last).all():
            break
    null, half = (
        _settled(null * _STEP_RATIO, _STEP_RATIO, lambda step: power(step)[1:]),
        _settled(half * _STEP_RATIO, _STEP_RATIO, above_half),
    )
    return unit * null, 2 * unit * half


def _settled(step: Floats, reach: float, value: Callable[[Floats], tuple[Floats, Floats]]) -> Floats:
    """Find the root of a function by Newton's method, within `reach` of `step`.

    `value` returns the value of the function and its slope.
    """
    low, high = step - reach, step + reach
    for _ in range(_NEWTON_ROUNDS):
        left, slope = value(step)
        step = np.clip(step - left / slope, low, high)
    return step
