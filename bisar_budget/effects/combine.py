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

    All sums lie in a polygon with two sides along each vector, and the longest is one of its corners. With
    every vector turned into the upper half plane and sorted by angle, flipping them one by one walks along
    half of the outline; the other half is its mirror image.
    """
    upper = [(x, y) if (y, x) > (0, 0) else (-x, -y) for x, y in vectors]
    upper = [vector for _, vector in sorted([(math.atan2(y, x), (x, y)) for x, y in upper])]
    x, y = sum([x for x, _ in upper]), sum([y for _, y in upper])
    corners = [math.hypot(x, y)]
    for step_x, step_y in upper:
        x, y = x - 2 * step_x, y - 2 * step_y
        corners.append(math.hypot(x, y))
    return max(corners)
