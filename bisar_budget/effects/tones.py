"""Effects of a tone and of a correlated process over an aperture: quadratic phase, cubic phase, and what is left.

Numbers and arrays of many cases alike.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget import evaluators

Floats = NDArray[np.float64]

SLOW = 0.5  # angle, or ratio, below which terms cancel and a series is exact to 1e-8


class Parts(NamedTuple):
    """Mean squares of a phase over the aperture [rad²]: quadratic, cubic, and what is left after the cubic."""

    quadratic: Any
    cubic: Any
    left: Any


def gauss_markov(aperture_time: Any, correlation_time: Any) -> Parts:
    """Parts of a stationary process of variance 1 and correlation exp(−|t|/τ_c)."""
    ratio = np.asarray(aperture_time / (2 * correlation_time))
    (slow,) = evaluators.gauss_markov_parts_slow(np.minimum(ratio, SLOW))
    fast = np.maximum(ratio, SLOW)
    (exact,) = evaluators.gauss_markov_parts(fast, np.exp(-2 * fast))
    return Parts(*(np.where(ratio < SLOW, *both)[()] for both in zip(slow, exact, strict=True)))


def tone(angle: Any) -> Floats:
    """Amplitudes of the quadratic and the cubic phase of a tone of amplitude 1, in its worst phase, and what is left.

    `angle` is πfT; the last of the three is the share of its power beyond the cubic.
    """
    angle = np.asarray(angle)
    slow = np.array(*evaluators.tone_parts_slow(np.minimum(angle, SLOW)))  # type: ignore[arg-type]
    fast = np.maximum(angle, SLOW)
    exact = np.array(*evaluators.tone_parts(fast, np.sin(fast), np.cos(fast)))  # type: ignore[arg-type]
    return np.where(angle < SLOW, slow, exact)


def held(step: Any) -> Any:
    """Spectrum of samples joined by straight lines, over that of white noise of their variance: sinc⁴."""
    return np.sinc(step / (2 * math.pi)) ** 4
