"""Phase noise over an aperture: spectra as pieces of power laws, and what their integrals with a tone's parts give.

Spectra are one-sided, of phase at the radar's centre frequency. [rad²/Hz] A data sheet's L(f) is half of one.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

from bisar_budget import evaluators
from bisar_budget.effects.tones import SLOW, Parts, tone

_FAST = 12 * math.pi  # angle from which what turns with a tone is averaged
_FIRST = 0.1  # angle below which a tone's parts are their first powers, to 4e-4 of the 3 % that lie there
_OCTAVE = 2.0

# Nodes and weights of Gauss and Legendre on 0 … 1.
_NODES = tuple((0.5 + 0.5 * node, weight) for node, weight in zip(*evaluators.LEGENDRE_FITS[6][:2], strict=True))


class Piece(NamedTuple):
    """Part of a spectrum: density·f^(−slope) from `low` to `high`. [Hz]"""

    low: float
    high: float
    density: float
    slope: float

    def at(self, f: float) -> float:
        """Density at a frequency. [rad²/Hz]"""
        return float(self.density * f**-self.slope)

    def integral(self, low: float, high: float, power: float = 0.0) -> float:
        """Integral of the spectrum times f^power between two frequencies; `low` may be zero where it converges."""
        exponent = power - self.slope + 1
        if abs(exponent) < 1e-9:
            return self.density * math.log(high / low)
        return float(self.density * (high**exponent - (low**exponent if low else 0.0)) / exponent)


def parts(
    pieces: Sequence[Piece],
    aperture_time: float,
    interval: float = 0.0,
    weight: Callable[[float], float] | None = None,
) -> Parts:
    """Integrate a spectrum with the parts of a tone, to 1e-4.

    Parameters
    ----------
    pieces : sequence of Piece
        Of a one-sided spectrum. [rad²/Hz]
    aperture_time : float
        [s]
    interval : float
        Of synchronisation. [s]
    weight : callable, optional
        Of 2πf·interval: what synchronisation makes of a tone's power. It ends as a constant: its mean.
    """
    total = Parts(0.0, 0.0, 0.0)
    scale = math.pi * aperture_time
    for piece in pieces:
        for low, high in _panels(piece, scale, interval):
            total = total.plus(_panel(piece, low, high, aperture_time, interval, weight))
    return total


def _panels(piece: Piece, scale: float, interval: float) -> Iterator[tuple[float, float]]:
    """Intervals of frequency within which a tone's parts, and the weight, are smooth. [Hz]"""
    edges = [_FIRST / scale * _OCTAVE**n for n in range(4)]
    edges += [math.pi * n / scale for n in range(1, 13)]
    if interval:
        rate = 1 / (2 * math.pi * interval)
        edges += [SLOW * rate * _OCTAVE**-n for n in range(4)] + [
            SLOW * rate,
            *(math.pi * n * rate for n in range(1, 13)),
        ]
    inside = sorted(edge for edge in edges if piece.low < edge < piece.high)
    yield from pairwise([piece.low, *inside, piece.high])


def _panel(
    piece: Piece,
    low: float,
    high: float,
    aperture_time: float,
    interval: float,
    weight: Callable[[float], float] | None,
) -> Parts:
    scale, rate = math.pi * aperture_time, 2 * math.pi * interval
    is_slow, is_fast = high * scale <= _FIRST * 1.000001, low * scale >= _FAST * 0.999999
    if weight is None and is_slow:
        return _slow(piece, low, high, scale)
    if weight is None and is_fast:
        return _fast(piece, low, high, scale)
    if weight is not None and interval and is_fast and low * rate >= _FAST * 0.999999:
        return _fast(piece, low, high, scale).times(_mean(weight))
    # Over logarithms, where a panel is long.
    quadratic = cubic = left = 0.0
    bottom = low or high * 1e-6
    span = math.log(high / bottom)
    for part, share in _NODES:
        f = bottom * math.exp(span * part)
        angle = f * scale
        if is_fast:
            ((square, cube, rest),) = evaluators.tone_parts_fast(1.0, *(angle**-power for power in (2, 4, 6, 8)))
        else:
            square, cube, rest = tone(angle)
            square, cube = square * square, cube * cube
        power = piece.at(f) * f * span * share
        if weight is not None:
            power *= weight(f * rate)
        quadratic += power * square
        cubic += power * cube
        left += power * rest
    return Parts(quadratic, cubic, left)


def _slow(piece: Piece, low: float, high: float, scale: float) -> Parts:
    """Tones so slow that their parts are their first powers: x²/2, x³/6 and x⁸/99225."""
    return Parts(
        piece.integral(low, high, 4) * scale**4 / 4,
        piece.integral(low, high, 6) * scale**6 / 36,
        piece.integral(low, high, 8) * scale**8 / 99225,
    )


def _fast(piece: Piece, low: float, high: float, scale: float) -> Parts:
    """Tones so fast that what turns with them is averaged."""
    powers = [piece.integral(low, high, -power) * scale**-power for power in (0, 2, 4, 6, 8)]
    (found,) = evaluators.tone_parts_fast(*powers)
    return Parts(*found)


@lru_cache
def _mean(weight: Callable[[float], float]) -> float:
    """What a weight is on average at high frequencies."""
    start, count = 1e6 * math.pi, 64
    return math.fsum(weight(start + 2 * math.pi * n / count) for n in range(count)) / count
