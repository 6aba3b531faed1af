"""Findings of a Monte Carlo simulation of a mission, as frozen data."""

from typing import NamedTuple

from bisar_budget.phrases import Note


class Requirement(NamedTuple):
    """Result of the draws for one requirement: how often it is met.

    `sum` and `rss` are the sizes of the errors, combined according to the rules `sum` and `rss` of
    `allocation.combine`. They follow from the full model and include the coverage factor; they are None if a declared
    error leaves no image. `sigma_rss` is the standard uncertainty as the root-sum-square of the errors. `sigma` is
    the standard uncertainty of the draws with an image; it is None if no draw has an image. For displacements
    `sigma_rss` and `sigma` are rms lengths. `probability` is the fraction of draws that meet the requirement;
    `probability_low` and `probability_high` are the ends of its Wilson interval. `probability_computed` is the
    probability computed without draws, from the distributions of the errors. `probability_normal` is the
    probability for a normal distribution with the variances of the errors. `dominant` is the error with the largest
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
    probability_computed: float
    probability_normal: float
    dominant: str
    dominant_share: float
    warnings: tuple[str, ...]


class MonteCarlo(NamedTuple):
    """Result of the Monte Carlo simulation of one mission.

    `probability` is the probability that all requirements are met at once; None if there is no requirement.
    `is_exact` tells whether every draw was computed from exact ranges, because the errors are too large for the
    linear model.
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
