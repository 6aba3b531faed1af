"""What a tone and a correlated process do over an aperture: quadratic phase, cubic phase, and what is left."""

import math
from typing import NamedTuple

from bisar_budget import evaluators

SLOW = 0.5  # angle, or ratio, below which terms cancel and a series is exact to 1e-8


class Parts(NamedTuple):
    """Mean squares of a phase over the aperture [rad²]: quadratic, cubic, and what is left after the cubic."""

    quadratic: float
    cubic: float
    left: float

    def plus(self, other: "Parts") -> "Parts":
        """Parts of two independent processes together."""
        return Parts(self.quadratic + other.quadratic, self.cubic + other.cubic, self.left + other.left)


def gauss_markov(aperture_time: float, correlation_time: float) -> Parts:
    """Parts of a stationary process of variance 1 and correlation exp(−|t|/τ_c)."""
    ratio = aperture_time / (2 * correlation_time)
    if ratio < SLOW:
        (found,) = evaluators.gauss_markov_parts_slow(ratio)
    else:
        (found,) = evaluators.gauss_markov_parts(ratio, math.exp(-2 * ratio))
    return Parts(*found)


def tone(angle: float) -> tuple[float, float, float]:
    """Amplitudes of the quadratic and the cubic phase of a tone of amplitude 1, in its worst phase, and what is left.

    `angle` is πfT; the last number is the share of its power beyond the cubic.
    """
    if angle < SLOW:
        (found,) = evaluators.tone_parts_slow(angle)
    else:
        (found,) = evaluators.tone_parts(angle, math.sin(angle), math.cos(angle))
    return found  # type: ignore[return-value]


def held(step: float) -> float:
    """Spectrum of samples joined by straight lines, over that of white noise of their variance: sinc⁴."""
    half = step / 2
    return (math.sin(half) / half) ** 4 if half else 1.0
