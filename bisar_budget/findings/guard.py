"""Findings of `check --guard`: the probability that a verdict is wrong, because declared figures are uncertain."""

from dataclasses import dataclass

from bisar_budget.mission.model import UncertainFigure


@dataclass(frozen=True, kw_only=True)
class GuardedRequirement:
    """A judged requirement with the probability that its verdict is wrong.

    `use` is its utilization, and `use_uncertainty` the standard uncertainty of the utilization.
    `false_acceptance` is the probability that the true utilization is above 1, for a requirement that is met;
    `false_rejection` is the probability that it is at most 1, for one that is broken (JCGM 106:2012, 9.3.2 and
    9.3.3). The other one of them is None. All are None except `use` if no uncertain figure changes the utilization,
    or if the utilization with a changed figure is not known.
    """

    key: str
    use: float
    use_uncertainty: float | None = None
    false_acceptance: float | None = None
    false_rejection: float | None = None

    @property
    def probability(self) -> float | None:
        """Probability that the verdict is wrong; None if it is not known."""
        return self.false_rejection if self.false_acceptance is None else self.false_acceptance


@dataclass(frozen=True, kw_only=True)
class Guard:
    """Probabilities that the verdicts on a mission are wrong, and the uncertain figures from which they follow.

    Both are empty if the mission states no uncertainty.
    """

    requirements: tuple[GuardedRequirement, ...] = ()
    figures: tuple[UncertainFigure, ...] = ()
