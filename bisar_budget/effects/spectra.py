"""Phase noise over an aperture: spectra as pieces of power laws, and what their integrals with a tone's parts give.

Spectra are one-sided, of phase at the radar's centre frequency. [rad²/Hz] A data sheet's L(f) is half of one.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

from bisar_budget import evaluators
from bisar_budget.effects.tones import Parts, held, tone

_TURNS = 24  # half turns of a tone within the aperture that are followed one by one
FAST = _TURNS * math.pi  # angle from which what turns with a tone is averaged
FIRST = 0.1  # angle below which a tone's parts are their first powers, to 4e-4 of the 3 % that lie there
_OCTAVE = 2.0
SAME = 1.000001  # of two edges, computed in two ways
NOTHING = 1e-6  # of the first edge: nothing of a tone's parts is below
FOLDED = 8  # intervals of sampling beyond which straight lines pass less than 1e-5 of a tone's power
ALIASES = 3  # tones folded from so many rates away are counted one by one, those beyond by an integral

# Nodes and weights of Gauss and Legendre on 0 … 1.
NODES = tuple((0.5 + 0.5 * node, weight) for node, weight in zip(*evaluators.LEGENDRE_FITS[6][:2], strict=True))


class PowerLawPiece(NamedTuple):
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


def parts(pieces: Sequence[PowerLawPiece], aperture_time: float) -> Parts:
    """Integrate a spectrum with the parts of a tone, to 1e-4.

    Parameters
    ----------
    pieces : sequence of PowerLawPiece
        Of a one-sided spectrum. [rad²/Hz]
    aperture_time : float
        [s]
    """
    scale, total = math.pi * aperture_time, Parts(0.0, 0.0, 0.0)
    for piece in pieces:
        for low, high in panels(piece.low, piece.high, tone_edges(aperture_time)):
            if high * scale <= FIRST * SAME:
                found = _slow(piece, low, high, scale)
            elif low * scale >= FAST / SAME:
                found = _fast(piece, low, high, scale)
            else:
                found = _panel(piece.at, low, high, scale)
            total = total.plus(found)
    return total


def synchronized_parts(pieces: Sequence[PowerLawPiece], aperture_time: float, interval: float) -> Parts:
    """The same of what synchronisation leaves: a phase less the straight lines between samples of it.

    Straight lines pass sinc²(f·T_s) of a tone, and fold every tone that is m/T_s away on it: of a spectrum S they
    leave S·(1 − sinc²)² + sinc⁴·Σ S(|f + m/T_s|), m ≠ 0. The lines begin anywhere in the interval.
    """
    rate = 1 / interval
    edges = [*exchange_edges(aperture_time, rate), *image_edges(pieces, rate)]
    scale, total = math.pi * aperture_time, Parts(0.0, 0.0, 0.0)
    beyond = [folded_from_beyond(piece, rate) for piece in pieces]

    def left(f: float) -> float:
        return _left(pieces, beyond, f, rate)

    last = max(FOLDED * rate, FAST / scale)
    for low, high in panels(0.0, last, edges):
        total = total.plus(_panel(left, low, high, scale))
    # Where straight lines pass nothing any more.
    for piece in pieces:
        if piece.high > last:
            total = total.plus(_fast(piece, max(piece.low, last), piece.high, scale))
    return total


def _left(pieces: Sequence[PowerLawPiece], beyond: Sequence[float], f: float, rate: float) -> float:
    """Spectrum that straight lines between samples leave. [rad²/Hz]"""
    passed = held(2 * math.pi * f / rate)  # sinc⁴
    nearest = round(f / rate)
    start = f - nearest * rate
    total = 0.0
    for piece, far in zip(pieces, beyond, strict=True):
        own, aliases = 0.0, far
        for n in range(-ALIASES, ALIASES + 1):
            at = abs(start + n * rate)
            if piece.low <= at < piece.high:
                if n == nearest:
                    own = piece.at(at)
                else:
                    aliases += piece.at(at)
        if abs(nearest) > ALIASES and piece.low <= f < piece.high:
            own = piece.at(f)
        total += own * (1 - math.sqrt(passed)) ** 2 + passed * aliases
    return total


def folded_from_beyond(piece: PowerLawPiece, rate: float) -> float:
    """Sum of what is folded from farther away, as an integral; its first correction is that of the midpoint rule."""
    low = max(piece.low, (ALIASES + 0.5) * rate)
    if low >= piece.high:
        return 0.0
    rise = -piece.slope * piece.at(low) / low  # of the spectrum, at the integral's beginning
    return 2 * (piece.integral(low, piece.high) / rate + rise * rate / 24)


def exchange_edges(aperture_time: float, rate: float) -> list[float]:
    """Frequencies between which a tone's parts, and what straight lines pass, are smooth. [Hz]"""
    edges = tone_edges(aperture_time) + [rate * n / 4 for n in range(1, 4 * FOLDED + 1)]
    octave = _TURNS / aperture_time
    while octave < rate / 4:
        edges.append(octave)
        octave *= _OCTAVE
    return edges


def image_edges(pieces: Sequence[PowerLawPiece], rate: float) -> list[float]:
    """Frequencies at which pieces of a spectrum begin and end, and where images of it end. [Hz]"""
    end = max((piece.high for piece in pieces), default=0.0)  # an oscillator may be stated to have no noise
    edges = [edge for piece in pieces for edge in (piece.low, piece.high)]
    return edges + [abs(n * rate + sign * end) for n in range(FOLDED + 1) for sign in (1, -1)]


def tone_edges(aperture_time: float) -> list[float]:
    """Frequencies between which a tone's parts are smooth. [Hz]"""
    scale = math.pi * aperture_time
    edges = [FIRST / scale * _OCTAVE**n for n in range(4)]
    return edges + [math.pi * n / scale for n in range(1, _TURNS + 1)]


def panels(low: float, high: float, edges: Sequence[float]) -> Iterator[tuple[float, float]]:
    """Neighbouring edges; of two that are the same, computed in two ways, one.

    Between the two a tone would be folded on 0 Hz, where a spectrum has no value.
    """
    kept = [low]
    for edge in sorted(edges):
        if kept[-1] * SAME < edge < high / SAME:
            kept.append(edge)
    return pairwise([*kept, high])


def _panel(density: Callable[[float], float], low: float, high: float, scale: float) -> Parts:
    """Integrate between two edges, over logarithms: a panel may be long."""
    quadratic = cubic = left = 0.0
    low = low or high * NOTHING
    is_fast, span = low * scale >= FAST / SAME, math.log(high / low)
    for part, share in NODES:
        f = low * math.exp(span * part)
        angle = f * scale
        if is_fast:
            ((square, cube, rest),) = evaluators.tone_parts_fast(1.0, *(angle**-power for power in (2, 4, 6, 8)))
        else:
            square, cube, rest = tone(angle)
            square, cube = square * square, cube * cube
        power = density(f) * f * span * share
        quadratic += power * square
        cubic += power * cube
        left += power * rest
    return Parts(quadratic, cubic, left)


def _slow(piece: PowerLawPiece, low: float, high: float, scale: float) -> Parts:
    """Tones so slow that their parts are their first powers: x²/2, x³/6 and x⁸/99225."""
    return Parts(
        piece.integral(low, high, 4) * scale**4 / 4,
        piece.integral(low, high, 6) * scale**6 / 36,
        piece.integral(low, high, 8) * scale**8 / 99225,
    )


def _fast(piece: PowerLawPiece, low: float, high: float, scale: float) -> Parts:
    """Tones so fast that what turns with them is averaged."""
    powers = [piece.integral(low, high, -power) * scale**-power for power in (0, 2, 4, 6, 8)]
    (found,) = evaluators.tone_parts_fast(*powers)
    return Parts(*found)


def link_parts(aperture_time: float, interval: float) -> Parts:
    """Parts of samples of variance 1 with straight lines between: one-sided 2·T_s·sinc⁴(f·T_s), ⅔ in all."""
    rate, scale = 1 / interval, math.pi * aperture_time
    edges = exchange_edges(aperture_time, rate)
    total = Parts(0.0, 0.0, 0.0)
    for low, high in panels(0.0, FOLDED * rate, edges):
        total = total.plus(_panel(lambda f: 2 * interval * held(2 * math.pi * f * interval), low, high, scale))
    return total
