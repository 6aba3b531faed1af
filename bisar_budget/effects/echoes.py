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
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

NEAR_CYCLES = 2.5  # per aperture; farther apart, two equal lines raise each other's echo by less than 1.1 dB
SLOWEST = 1.0  # cycles per aperture; what is slower makes no echoes

_STEPS = (0.1, 0.02)  # of the search, in cells
_REACH = np.arange(-6, 7)[:, None, None]
_SEARCHED = 16  # places around which it looks
_MOST = 200_000  # echoes that are looked at together

Floats = NDArray[np.float64]
Truths = NDArray[np.bool_]


class Worst(NamedTuple):
    """Lines in their worst phases: the amplitude of one line with an echo as high, and the place of that echo."""

    amplitude: Any
    cycles: Any


def near_groups(cycles: Floats) -> NDArray[np.intp]:
    """Tell which lines, (n, cases), follow each other within 2.5 cycles per aperture, two or more together.

    Groups of a case are numbered from the lowest frequency on; -1 where a line is in none, as those slower than one
    cycle per aperture are.
    """
    order = np.argsort(cycles, axis=0, kind="stable")
    placed = np.take_along_axis(cycles, order, axis=0)
    begins = np.ones(cycles.shape, dtype=bool)
    begins[1:] = (placed[:-1] < SLOWEST) | (np.diff(placed, axis=0) > NEAR_CYCLES * (1 + 1e-9))
    has_next = np.zeros(cycles.shape, dtype=bool)
    has_next[:-1] = ~begins[1:]
    number = np.where(~begins | has_next, np.cumsum(begins & has_next, axis=0) - 1, -1)
    found = np.empty_like(number)
    np.put_along_axis(found, order, number, axis=0)
    return found


def near_lines(cycles: Sequence[float]) -> list[tuple[int, ...]]:
    """Indices of the lines of each group of one mission, by frequency."""
    if not cycles:
        return []
    number = near_groups(np.array(cycles)[:, None])[:, 0]
    return [tuple(np.flatnonzero(number == one).tolist()) for one in range(number.max() + 1)]


def worst_phases(amplitudes: Any, cycles: Any, is_member: Truths | None = None) -> Worst:
    """Find how high the echoes of several lines stand together in the worst phases.

    Parameters
    ----------
    amplitudes : (n,) or (n, cases)
        0 to peak, in any unit.
    cycles : of the same shape
        Per aperture.
    is_member : of the same shape, optional
        Which of the lines are looked at, at least one in each case; all without it.

    Returns
    -------
    Worst
        Amplitude of one line whose echo is as high, in the unit of `amplitudes`; at least the largest of them, and
        their sum where all have one frequency.
    """
    sizes, places = np.asarray(amplitudes, dtype=float), np.asarray(cycles, dtype=float)
    count, *shape = sizes.shape
    sizes, places = sizes.reshape(count, -1), places.reshape(count, -1)
    if is_member is not None:
        is_member = is_member.reshape(count, -1)
        places = np.where(is_member, places, math.inf)
        count = is_member.sum(axis=0).max()
    here = np.arange(places.shape[1])
    order = np.argsort(places, axis=0, kind="stable")[:count]
    sizes, places = sizes[order, here], places[order, here]
    if is_member is not None:  # where a case has fewer, lines without an amplitude beside the last
        is_one = np.isfinite(places)
        sizes = np.where(is_one, sizes, 0.0)
        places = np.where(is_one, places, np.where(is_one, places, 0.0).max(axis=0))
    begins = np.flatnonzero(np.append(True, (places[1:] != places[:-1]).any(axis=1)))
    sizes, places = np.add.reduceat(sizes, begins, axis=0), places[begins]  # lines of one frequency are one
    if len(places) == 1:
        return Worst(sizes[0].reshape(shape)[()], places[0].reshape(shape)[()])
    starts = np.sort(np.concatenate((places, (places[1:] + places[:-1]) / 2)), axis=0)
    starts = starts[np.append(True, (starts[1:] != starts[:-1]).any(axis=1))]
    if len(starts) > _SEARCHED:
        starts = _highest(sizes, places, starts)
    found = np.empty((2, here.size))
    together = max(1, _MOST // (len(starts) * _REACH.size * len(places)))
    for first in range(0, here.size, together):
        some = slice(first, first + together)
        found[:, some] = _searched(sizes[:, some], places[:, some], starts[:, some])
    return Worst(*(column.reshape(shape)[()] for column in found))


def _highest(sizes: Floats, places: Floats, starts: Floats) -> Floats:
    """Places within a cell of which lie the lines that make most of an echo: the highest of them, each once."""
    summed = np.concatenate((np.zeros((1, sizes.shape[1])), np.cumsum(sizes, axis=0)))
    before, until = (_count(places, starts, reach) for reach in (-1, 1))
    around = np.take_along_axis(summed, until, axis=0) - np.take_along_axis(summed, before, axis=0)
    around[1:][starts[1:] == starts[:-1]] = -1.0
    order = np.argsort(-around, axis=0, kind="stable")[:_SEARCHED]
    return np.take_along_axis(starts, order, axis=0)


def _count(places: Floats, starts: Floats, reach: int) -> NDArray[np.intp]:
    """Number of places below each start less a cell, or up to each start and a cell; both are sorted."""
    ends = starts + reach
    both = (places, ends) if reach > 0 else (ends, places)
    order = np.argsort(np.concatenate(both), axis=0, kind="stable")
    is_place = order < len(places) if reach > 0 else order >= len(ends)
    counted = np.empty_like(order)
    np.put_along_axis(counted, order, np.cumsum(is_place, axis=0), axis=0)
    return counted[len(places) :] if reach > 0 else counted[: len(ends)]


def _searched(sizes: Floats, places: Floats, starts: Floats) -> tuple[Floats, Floats]:
    """Height and place of the highest echo at the starts and in steps around them."""
    best = starts
    for step in _STEPS:
        tried = best + step * _REACH
        highest = _heights(sizes, places, tried).argmax(axis=0)
        best = best + step * (highest + _REACH[0, 0, 0])
    ends = np.concatenate((starts, best))
    heights = _heights(sizes, places, ends)
    height = heights.max(axis=0)
    return height, np.where(heights == height, ends, -math.inf).max(axis=0)


def _heights(sizes: Floats, places: Floats, x: Floats) -> Floats:
    """Height of all echoes together, in phase, at places (…, cases)."""
    return np.asarray((sizes * np.abs(np.sinc(x[..., None, :] - places))).sum(axis=-2))
