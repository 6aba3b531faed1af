"""ISLR that noise adds to an image, from as many draws of its phase as it takes to say whether a limit is true.

The image is a line across range: the transform of the aperture under its window. Its mainlobe is what lies within the
first nulls of the error-free response, its sidelobes are all the rest of one repeat interval, so that by Parseval
only the mainlobe has to be transformed. Energies are means over the draws, as those of many images.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from bisar_budget.simulate.phase_history import Floats, cell_centres

TOLERANCE_DB = 0.5

_FIRST, _MOST = 64, 8192  # draws
_AT_ONCE = 256
_NORMAL_95 = 1.96  # standard errors on either side of a mean
_SURE = 3.3  # of them within one verdict, 99.9 %: another seed must not draw another verdict
_KNOWN_DB = 0.25  # half of an interval at most: one that is drawn too early may lie anywhere
_NODES = 32  # of the mainlobe's integral
_FINE = 64  # steps per cell in which the first null is sought: the response is 0 there, and so is what a step holds
_TINY = 1e-300


class AddedIslr(NamedTuple):
    """ISLR that noise adds, the ends of its interval at 95 %, and of how many draws it is the mean. [dB]"""

    level: float
    low: float
    high: float
    draws: int

    @property
    def error(self) -> float:
        """Standard error. [dB]"""
        return (self.high - self.low) / (2 * _NORMAL_95)

    def verdict(self, required_db: float) -> str:
        """Verdict on a limit that was to add an ISLR; `not_evaluated` where the mean may have another one.

        After all draws, on the border of what is confirmed and what is conservative, it is `conservative`: no limit
        there adds too much.
        """
        excess, doubt = self.level - required_db, _SURE * self.error
        low, high = excess - doubt, excess + doubt
        if low > TOLERANCE_DB:
            return "optimistic"
        if high < -TOLERANCE_DB:
            return "conservative"
        if low >= -TOLERANCE_DB and high <= TOLERANCE_DB:
            return "confirmed"
        return "conservative" if self.draws >= _MOST and high < 0 else "not_evaluated"


class Mainlobe:
    """The part of an error-free response that lies within its first nulls.

    Parameters
    ----------
    weights : (moments,) ndarray
        Window over the aperture, at the centres of equal cells.
    """

    def __init__(self, weights: Floats) -> None:
        place = cell_centres(1.0, weights.size)
        response = np.abs(np.fft.rfft(weights, weights.size * _FINE))
        null = int(np.argmax(np.diff(response) > 0)) / _FINE
        nodes, self._steps = np.polynomial.legendre.leggauss(_NODES)
        waves = np.exp(-2j * math.pi * np.outer(place, null * nodes))
        self._waves = waves * weights[:, None] / weights.size
        self._clean = self._waves.sum(axis=0).real
        self._steps = self._steps * null / np.mean(weights**2)
        self.energy = float(self._clean**2 @ self._steps)

    def lost(self, phases: Floats) -> Floats:
        """Energy that phases (draws, moments) take out of it, over all energy of an image, (draws,)."""
        # exp(jφ) - 1 without rounding: a limit of -100 dB is an energy of 1e-10.
        change = (-2 * np.sin(phases / 2) ** 2 + 1j * np.sin(phases)) @ self._waves
        found: Floats = -(2 * self._clean * change.real + np.abs(change) ** 2) @ self._steps
        return found

    def added_db(self, lost: float) -> float:
        """ISLR that goes with a mean energy lost. [dB]"""
        left = max(self.energy - lost, _TINY)
        return 10 * math.log10(max(lost, _TINY) / (self.energy * left))


def added_islr(weights: Floats, draw: Callable[[int], Floats], required_db: float) -> AddedIslr:
    """Draw phases until their interval has one verdict against what is required, or there are too many.

    Parameters
    ----------
    weights : (moments,) ndarray
        Window over the aperture.
    draw : callable
        Gives so many phases, (draws, moments). [rad]
    required_db : float
        ISLR that may be added.
    """
    mainlobe = Mainlobe(weights)
    lost: Floats = np.empty(0)
    while True:
        count = min(_AT_ONCE, max(_FIRST, lost.size))
        lost = np.concatenate((lost, mainlobe.lost(draw(count))))
        if lost.size < _FIRST or lost.size & (lost.size - 1):  # each look is at twice as many as the one before
            continue
        mean, error = float(lost.mean()), float(lost.std(ddof=1)) / math.sqrt(lost.size)
        level, low, high = (mainlobe.added_db(mean + sign * _NORMAL_95 * error) for sign in (0, -1, 1))
        found = AddedIslr(level, low, high, lost.size)
        is_known = found.high - found.low <= 2 * _KNOWN_DB
        if lost.size >= _MOST or (is_known and found.verdict(required_db) != "not_evaluated"):
            return found
