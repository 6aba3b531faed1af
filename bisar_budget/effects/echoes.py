"""Paired echoes of several vibrations that lie so near each other that they add.

A vibration of n cycles per aperture and peak phase φ makes echoes at n cells from the response, of φ/2 of its
amplitude and of its shape: of a uniform aperture sinc(x) = sin(πx)/(πx), whose sidelobes reach the next echo. The
phases of vibrations are not known. At a place x the echoes of several are at their worst in phase, with
Σ φ_k/2·|sinc(x − n_k)|, and what counts is the place where that is largest. Derived here; held within 0.5 dB to
transforms of the phasor in the worst of its phases, from three cycles per aperture on
(`tests/effects/test_echoes.py`). The echoes at −n_k are left out: they add up to 0.3 dB at three cycles, and less
beyond.
"""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from itertools import accumulate, pairwise
from typing import NamedTuple

NEAR_CYCLES = 2.5  # per aperture; farther apart, two equal lines raise each other's echo by less than 1.1 dB
SLOWEST = 1.0  # cycles per aperture; what is slower makes no echoes

_COARSE, _FINE, _REACH = 0.1, 0.02, 6  # steps of the search, in cells
_SEARCHED = 16  # places around which it looks


class Worst(NamedTuple):
    """Lines in their worst phases: the amplitude of one line with an echo as high, and the place of that echo."""

    amplitude: float
    cycles: float


def near_lines(cycles: Sequence[float]) -> list[tuple[int, ...]]:
    """Indices of lines that follow each other within 2.5 cycles per aperture, two or more together.

    Lines slower than one cycle per aperture are in none.
    """
    order = sorted((n, index) for index, n in enumerate(cycles) if n >= SLOWEST)
    groups = [[index] for _, index in order[:1]]
    for (before, _), (here, index) in pairwise(order):
        if here - before <= NEAR_CYCLES * (1 + 1e-9):
            groups[-1].append(index)
        else:
            groups.append([index])
    return [tuple(sorted(group)) for group in groups if len(group) > 1]


def worst_phases(amplitudes: Sequence[float], cycles: Sequence[float]) -> Worst:
    """Find how high the echoes of several lines stand together in the worst phases.

    Parameters
    ----------
    amplitudes : sequence of float, (n,)
        0 to peak, in any unit.
    cycles : sequence of float, (n,)
        Per aperture.

    Returns
    -------
    Worst
        Amplitude of one line whose echo is as high, in the unit of `amplitudes`; at least the largest of them, and
        their sum where all have one frequency.
    """
    lines = sorted(zip(cycles, amplitudes, strict=True))
    places = [n for n, _ in lines]
    # Within a cell of the highest echo lie those that make most of it.
    summed = [0.0, *accumulate(amplitude for _, amplitude in lines)]

    def around(x: float) -> float:
        return summed[bisect_right(places, x + 1)] - summed[bisect_left(places, x - 1)]

    starts = {*places, *((one + other) / 2 for one, other in pairwise(places))}
    found = []
    for start in sorted(starts, key=lambda x: (-around(x), x))[:_SEARCHED]:
        best = start
        for step in (_COARSE, _FINE):
            best = max((best + k * step for k in range(-_REACH, _REACH + 1)), key=lambda x: _together(lines, x))
        found += [Worst(_together(lines, x), x) for x in (start, best)]
    return max(found)


def _together(lines: Sequence[tuple[float, float]], x: float) -> float:
    return math.fsum([amplitude * abs(sinc(x - n)) for n, amplitude in lines])


def sinc(x: float) -> float:
    """Response of a uniform aperture over its peak, x cells from it."""
    x *= math.pi
    return math.sin(x) / x if x else 1.0
