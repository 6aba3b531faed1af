"""Several errors at once: worst case and root-sum-square, of phases and of displacements on the ground."""

import math
from collections.abc import Iterable, Sequence

from bisar_budget.geometry import GroundVector


def combine_phases(phases: Iterable[float], rule: str) -> float:
    """Combine signed phases by `each` (the largest), `sum` (worst case) or `rss` (independent). [rad]"""
    sizes = [abs(phase) for phase in phases]
    if rule == "each":
        return max(sizes, default=0.0)
    return math.fsum(sizes) if rule == "sum" else math.hypot(*sizes)


def combine_displacements(displacements: Sequence[GroundVector], rule: str) -> float:
    """Combine displacements on the ground, (n, 2): the largest, the largest over all signs, or rss. [m]"""
    if rule == "sum":
        return largest_signed_sum(displacements)
    lengths = [math.hypot(*displacement) for displacement in displacements]
    return max(lengths, default=0.0) if rule == "each" else math.hypot(*lengths)


def largest_signed_sum(vectors: Sequence[GroundVector]) -> float:
    """Length of the longest of the sums ±v₁ ± v₂ … of plane vectors, exactly.

    The longest sum is longest along its own direction, where every vector takes the sign of its projection.
    Signs change only where a vector is perpendicular to that direction, so one candidate on either side of
    each of these n directions covers all 2ⁿ sums.
    """
    longest = 0.0
    for pivot in vectors:
        across = (-pivot[1], pivot[0])
        x = y = 0.0
        for vector in vectors:
            projection = vector[0] * across[0] + vector[1] * across[1]
            if abs(projection) <= 1e-15 * math.hypot(*vector) * math.hypot(*across):
                continue  # parallel to the pivot: turns with it, below
            sign = math.copysign(1.0, projection)
            x, y = x + sign * vector[0], y + sign * vector[1]
        along_x = along_y = 0.0
        for vector in vectors:
            projection = vector[0] * across[0] + vector[1] * across[1]
            if abs(projection) <= 1e-15 * math.hypot(*vector) * math.hypot(*across):
                sign = math.copysign(1.0, vector[0] * pivot[0] + vector[1] * pivot[1])
                along_x, along_y = along_x + sign * vector[0], along_y + sign * vector[1]
        longest = max(longest, math.hypot(x + along_x, y + along_y), math.hypot(x - along_x, y - along_y))
    return longest
