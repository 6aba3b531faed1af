"""Findings of the draws of a Monte Carlo."""

from typing import NamedTuple

from bisar_budget.phrases import Note


class Requirement(NamedTuple):
    """How often one requirement holds.

    `sum` and `rss` are the values that these rules of `allocation.combine` would compare with the limit, by the full
    model with the coverage factor; None if a declared error leaves no image. `sigma_rss` is the standard uncertainty
    by root-sum-square. `sigma` is the standard uncertainty of the draws with an image, None without such a draw. For
    displacements both are rms lengths. `probability` comes from the draws, with the ends of its Wilson interval.
    `probability_normal` comes from a normal distribution with `sigma_rss`. `dominant` is the error with the largest
    share of the variance.
    """

    id: str
    unit: str
    limit: float
    sum: float | None
    rss: float | None
    sigma_rss: float
    sigma: float | None
    probability: float
    probability_low: float
    probability_high: float
    probability_normal: float
    dominant: str
    dominant_share: float
    warnings: tuple[str, ...]


class MonteCarlo(NamedTuple):
    """Result of the draws.

    `probability` is the probability that all requirements hold at once; None without a requirement. `is_exact`: exact
    ranges computed every draw, because the errors are too large for sums of effects.
    """

    draws: int
    seed: int
    model: str
    confidence: float
    requirements: tuple[Requirement, ...]
    probability: float | None
    probability_low: float | None
    probability_high: float | None
    is_exact: bool
    notes: tuple[Note, ...]
