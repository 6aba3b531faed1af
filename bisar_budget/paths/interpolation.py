"""Places between those of a table: the polynomials of Lagrange and of Hermite."""

import math
from bisect import bisect_right
from collections.abc import Sequence
from typing import NamedTuple

from bisar_budget.geometry import Vector
from bisar_budget.paths.instant import Instant


class Sample(NamedTuple):
    """A time of days without leap seconds, and position and velocity. [m], [m/s]"""

    time: Instant
    place: Vector
    velocity: Vector


def interpolate(samples: Sequence[Sample], time: Instant, count: int, is_hermite: bool) -> Vector:
    """Place at a time, from the samples around it. [m]

    The samples are the same throughout an interval between two of them. Neighbouring intervals, where the count is
    even or not, share the sample between them: the path has no jumps.
    """
    after = bisect_right(samples, time, key=lambda one: one.time)
    first = min(max(after - (count + 1) // 2, 0), len(samples) - count)
    near = samples[first : first + count]
    return _through(near, [one.time.since(time) for one in near], is_hermite)


def _through(near: Sequence[Sample], times: Sequence[float], is_hermite: bool) -> Vector:
    """Value at time 0 of the polynomial of Lagrange through places, or that of Hermite through velocities too.

    Sources: Abramowitz & Stegun, equations 25.2.1 and 25.2.2; Burden & Faires, Numerical Analysis, theorem 3.9.
    """
    terms: list[list[float]] = [[], [], []]
    for j, sample in enumerate(near):
        others = [times[j] - one for n, one in enumerate(times) if n != j]
        basis = math.prod(-one / (times[j] - one) for n, one in enumerate(times) if n != j)
        if is_hermite:
            square = basis * basis
            slope = math.fsum(1 / one for one in others)
            of_place, of_velocity = (1 + 2 * times[j] * slope) * square, -times[j] * square
        else:
            of_place, of_velocity = basis, 0.0
        for axis in range(3):
            terms[axis].append(of_place * sample.place[axis])
            if of_velocity:
                terms[axis].append(of_velocity * sample.velocity[axis])
    try:
        x, y, z = (math.fsum(axis) for axis in terms)
    except (OverflowError, ValueError):  # samples that are much nearer to each other than others
        return (math.nan, math.nan, math.nan)
    return (x, y, z)
