"""Phase noise over many aperture times: the arrays beside `effects.spectra`, of one spectrum.

Panels and their nodes are those of the floats, so that the numbers are too. In the angle x = πfT the edges of the
panels are the same in every case, and so is what a power law gives between two of them: only the ends of a piece are
integrated case by case.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bisar_budget import evaluators
from bisar_budget.effects import spectra as scalar
from bisar_budget.effects.spectra import PowerLawPiece
from bisar_budget.effects.tones import SLOW
from bisar_budget.ranges.exact_ranges import Floats

ManyParts = Floats  # (3, cases): mean squares as `Parts` has them [rad²]

_EDGES = np.array(scalar.tone_edges(1 / math.pi))  # angles
_NODES, _WEIGHTS = (np.array(column)[:, None] for column in zip(*scalar.NODES, strict=True))
_MOST = 4096  # panels that are integrated at once


def many_parts(pieces: Sequence[PowerLawPiece], aperture_time: Floats) -> ManyParts:
    """Integrate a spectrum with the parts of a tone, over aperture times (cases,); as `parts`."""
    scale = math.pi * aperture_time
    total = np.zeros((3, *aperture_time.shape))
    for piece in pieces:
        to_angle = piece.density * scale ** (piece.slope - 1)
        total += to_angle * _of_power_law(piece.slope, piece.low * scale, piece.high * scale)
    return total


def _of_power_law(slope: float, low: Floats, high: Floats) -> ManyParts:
    """Parts of x^(−slope) between two angles."""
    first = np.searchsorted(_EDGES, low * scalar.SAME, side="right")
    last = np.searchsorted(_EDGES, high / scalar.SAME, side="left")
    has_edge = last > first
    until = np.where(has_edge, _EDGES[np.minimum(first, _EDGES.size - 1)], high)
    start = np.where(has_edge, _EDGES[last - 1], high)
    between = np.concatenate(
        (np.zeros((3, 1)), np.cumsum(_power_panels(slope, _EDGES[:-1], _EDGES[1:]), axis=1)), axis=1
    )
    whole = np.where(has_edge, between[:, last - 1] - between[:, np.minimum(first, _EDGES.size - 1)], 0.0)
    return whole + _at_an_end(slope, low, until) + _at_an_end(slope, start, high)


def _at_an_end(slope: float, low: Floats, high: Floats) -> ManyParts:
    """Parts of a panel at the end of a piece, which may be slow or fast; nothing of one without length."""
    found = np.zeros((3, low.size))
    is_slow, is_fast = high <= scalar.FIRST * scalar.SAME, low >= scalar.FAST / scalar.SAME
    for some, of_panel in (
        (is_slow, _slow),
        (~is_slow & is_fast, _fast),
        (~is_slow & ~is_fast, _power_panels),
    ):
        chosen = some & (low < high)
        found[:, chosen] = of_panel(slope, low[chosen], high[chosen])
    return found


def _integral(exponent: float, low: Floats, high: Floats) -> Floats:
    """Integral of x^exponent; `low` may be zero where it converges."""
    power = exponent + 1
    if abs(power) < 1e-9:
        return np.asarray(np.log(high / low))
    lower = np.where(low > 0, np.where(low > 0, low, 1.0) ** power, 0.0)
    return np.asarray((high**power - lower) / power)


def _slow(slope: float, low: Floats, high: Floats) -> ManyParts:
    parts = ((4, 4), (6, 36), (8, 99225))
    return np.array([_integral(power - slope, low, high) / divisor for power, divisor in parts])


def _fast(slope: float, low: Floats, high: Floats) -> ManyParts:
    (found,) = evaluators.tone_parts_fast(*(_integral(-power - slope, low, high) for power in (0, 2, 4, 6, 8)))  # type: ignore[arg-type]
    return np.array(found)


def _power_panels(slope: float, low: Floats, high: Floats) -> ManyParts:
    """Parts of x^(−slope) over panels (n,), by their nodes."""
    span = np.log(high / low)
    x = low * np.exp(span * _NODES)
    power = x**-slope * x * span * _WEIGHTS
    return np.asarray((power * _squares(x)).sum(axis=1))


def _squares(angle: Floats) -> Floats:
    """Squares of the amplitudes of a tone, and the share of its power that is left, (3, …); as `tone`."""
    slow = np.array(*evaluators.tone_parts_slow(np.minimum(angle, SLOW)))  # type: ignore[arg-type]
    exact = np.array(*evaluators.tone_parts(angle, np.sin(angle), np.cos(angle)))  # type: ignore[arg-type]
    found = np.where(angle < SLOW, slow, exact)
    found[:2] *= found[:2]
    return np.asarray(found)


# ---------------------------------------------------------------------- synchronisation
def many_synchronized_parts(pieces: Sequence[PowerLawPiece], aperture_time: Floats, interval: float) -> ManyParts:
    """The same of what synchronisation leaves; as `synchronized_parts`."""
    rate = 1 / interval
    beyond = [scalar.folded_from_beyond(piece, rate) for piece in pieces]
    scale = math.pi * aperture_time
    last = np.maximum(scalar.FOLDED * rate, scalar.FAST / scale)
    edges = [[*scalar.exchange_edges(T, rate), *scalar.image_edges(pieces, rate)] for T in aperture_time.tolist()]
    total = _over_panels(lambda f: _left(pieces, beyond, f, rate), edges, last, scale)
    for piece in pieces:  # where straight lines pass nothing any more
        to_angle = piece.density * scale ** (piece.slope - 1)
        low, high = np.maximum(piece.low, last) * scale, piece.high * scale
        some = piece.high > last
        total[:, some] += to_angle[some] * _fast(piece.slope, low[some], high[some])
    return total


def many_link_parts(aperture_time: Floats, interval: float) -> ManyParts:
    """Parts of samples of variance 1 with straight lines between; as `link_parts`."""
    rate = 1 / interval
    edges = [scalar.exchange_edges(T, rate) for T in aperture_time.tolist()]
    last = np.full(aperture_time.shape, scalar.FOLDED * rate)
    return _over_panels(
        lambda f: 2 * interval * _held(2 * math.pi * f * interval), edges, last, math.pi * aperture_time
    )


def _over_panels(
    density: Callable[[Floats], Floats], edges: Sequence[Sequence[float]], high: Floats, scale: Floats
) -> ManyParts:
    """Integrate a density with the parts of a tone from 0 Hz, between the edges of each case."""
    panels = [
        (low, top, place)
        for place, (of_case, end) in enumerate(zip(edges, high.tolist(), strict=True))
        for low, top in scalar.panels(0.0, end, of_case)
    ]
    low, top, cases = (np.array(column) for column in zip(*panels, strict=True))
    total = np.zeros((3, high.size))
    for start in range(0, low.size, _MOST):
        some = slice(start, start + _MOST)
        parts = _panels_of(density, low[some], top[some], scale[cases[some]])
        for kept, part in zip(total, parts, strict=True):
            kept += np.bincount(cases[some], part, high.size)
    return total


def _panels_of(density: Callable[[Floats], Floats], low: Floats, high: Floats, scale: Floats) -> ManyParts:
    """Parts of panels (n,); as `_panel`."""
    low = np.where(low > 0, low, high * scalar.NOTHING)
    span = np.log(high / low)
    f = low * np.exp(span * _NODES)
    angle = f * scale
    fast = np.array(*evaluators.tone_parts_fast(1.0, *(angle**-power for power in (2, 4, 6, 8))))  # type: ignore[arg-type]
    parts = np.where(low * scale >= scalar.FAST / scalar.SAME, fast, _squares(angle))
    return np.asarray((density(f) * f * span * _WEIGHTS * parts).sum(axis=1))


def _held(step: Floats) -> Floats:
    """Spectrum of samples joined by straight lines; as `held`."""
    half = step / 2
    return np.asarray((np.sin(half) / half) ** 4)


def _left(pieces: Sequence[PowerLawPiece], beyond: Sequence[float], f: Floats, rate: float) -> Floats:
    """Spectrum that straight lines between samples leave [rad²/Hz]; as `_left`."""
    passed, nearest = _held(2 * math.pi * f / rate), np.rint(f / rate)
    start = f - nearest * rate
    total = np.zeros_like(f)
    for piece, far in zip(pieces, beyond, strict=True):
        own, aliases = np.zeros_like(f), np.full_like(f, far)
        for n in range(-scalar.ALIASES, scalar.ALIASES + 1):
            density = _at(piece, np.abs(start + n * rate))
            own = np.where(nearest == n, density, own)
            aliases = aliases + np.where(nearest == n, 0.0, density)
        own = np.where(np.abs(nearest) > scalar.ALIASES, _at(piece, f), own)
        total += own * (1 - np.sqrt(passed)) ** 2 + passed * aliases
    return total


def _at(piece: PowerLawPiece, f: Floats) -> Floats:
    """Density of a piece, 0 beside it. [rad²/Hz]"""
    is_in: NDArray[Any] = (piece.low <= f) & (f < piece.high)
    return np.where(is_in, piece.density * np.where(is_in, f, 1.0) ** -piece.slope, 0.0)
