"""The probability that a verdict is wrong, because declared figures have an uncertainty of their own.

A mission declares the size of an error, such as the sigma of a velocity, and the file may state the standard
uncertainty of this size. The utilization of a requirement is then uncertain too. Each uncertain size is changed by a
factor of exp(±u), where u is its relative standard uncertainty, and the mission is checked again. The factor keeps
the sign of the size. The logarithms of the sizes are normal and independent. The contributions of independent errors
to a utilization add, or their squares do. Each contribution is a function of its figure, which the three checks
determine. The probability that the true utilization is on the other side of 1 is the specific risk of JCGM 106:2012,
9.3: it belongs to this mission, not to a production.
"""

import math
from collections.abc import Mapping, Sequence
from datetime import date
from typing import NamedTuple

from bisar_budget.budget.check import CheckedMission, requirement_uses
from bisar_budget.faults import MissionError
from bisar_budget.findings.guard import Guard, GuardedRequirement
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.mission.model import Mission, UncertainFigure
from bisar_budget.mission.quantities import number_of, tree_of
from bisar_budget.questions.table import Variation
from bisar_budget.units import DB_PER_NEPER

_MIN_LOG_CHANGE_RATIO = 1e-6  # a smaller change of a utilization is the tolerance of a check
_MIN_RATE_RATIO = 1e-6  # a quantity with a smaller rate changes linearly with the figure
_MAX_RATE_RATIO = 2.0  # rate of a squared utilization whose only figure has an uncertainty of 100 %
_MIN_SKEWNESS_RATIO = 1e-4  # with a smaller skewness a quantity is normal

Uses = Mapping[str, float]
"""Utilizations of a mission by the keys of its requirements."""


def with_guard(findings: CheckedMission, today: date) -> CheckedMission:
    """Add the probability that each verdict is wrong to the findings of a mission.

    An unusable mission is returned unchanged. A mission with n uncertain figures is checked 2n + 1 times.

    Raises
    ------
    ValueError
        The findings have no analysis.
    """
    if not isinstance(findings, MissionFindings):
        return findings
    mission = findings.analysed().mission
    figures = mission.uncertainties
    if not figures:
        return findings._replace(guard=Guard())
    middle, pairs = _checked_again(mission, figures, today)
    requirements = [
        _guarded(requirement, middle, pairs, _power(mission, requirement.key))
        for requirement in findings.requirements
        if _is_judged_by_number(requirement)
    ]
    return findings._replace(guard=Guard(requirements=tuple(requirements), figures=figures))


def _is_judged_by_number(requirement: JudgedRequirement) -> bool:
    """Whether the verdict on a requirement is the comparison of its utilization with 1."""
    use = requirement.utilization
    if use is None or requirement.is_unjudged or requirement.status == "not_evaluated":
        return False
    return 0 < use < math.inf and (use > 1) == (requirement.status in ("fail", "waived"))


def _checked_again(
    mission: Mission, figures: Sequence[UncertainFigure], today: date
) -> tuple[Uses, list[tuple[Uses, Uses]]]:
    """Check a mission as it is, and with each uncertain figure decreased and increased by its uncertainty.

    Returns the utilizations of the mission, and of each pair of changed missions. A changed mission that the reader
    refuses has no utilizations.
    """
    variation = Variation(mission, mission.allocation.model)
    tree = tree_of(mission)
    missions, case_numbers = [mission], [0]
    for index, figure in enumerate(figures):
        number = number_of(tree, figure.key)
        size = number.value or 0.0
        for side, sign in enumerate((-1, 1)):
            log_change = sign * figure.relative_uncertainty
            changed = size + DB_PER_NEPER * log_change if number.is_level else size * math.exp(log_change)
            try:
                missions.append(variation.at({number: changed}))
                case_numbers.append(1 + 2 * index + side)
            except MissionError:
                continue
    uses_by_case: list[Uses] = [{} for _ in range(1 + 2 * len(figures))]
    for case_number, uses in zip(case_numbers, requirement_uses(missions, today), strict=True):
        uses_by_case[case_number] = {key: use for key, use in uses.items() if use > 0}
    return uses_by_case[0], list(zip(uses_by_case[1::2], uses_by_case[2::2], strict=True))


def _power(mission: Mission, key: str) -> int:
    """Power of the utilization to which independent errors contribute by addition: 1 for `sum`, 2 otherwise.

    The ISLR is a sum of powers by any rule.
    """
    return 1 if mission.allocation.combine == "sum" and key != "islr" else 2


def _guarded(
    requirement: JudgedRequirement, middle: Uses, pairs: Sequence[tuple[Uses, Uses]], power: int
) -> GuardedRequirement:
    """Compute the probability that the verdict on a requirement is wrong from the changes of its utilization."""
    key, use = requirement.key, requirement.utilization or 0.0
    unknown = GuardedRequirement(key=key, use=use)
    if any(key not in uses for uses in (middle, *(uses for pair in pairs for uses in pair))):
        return unknown
    log_changes = [math.log(high[key] / low[key]) / 2 for low, high in pairs]
    deviation = math.hypot(*log_changes)
    if deviation < _MIN_LOG_CHANGE_RATIO:
        return unknown
    terms = [
        _Term.through(*(uses[key] ** power for uses in (low, middle, high)))
        for (low, high), log_change in zip(pairs, log_changes, strict=True)
        if abs(log_change) > _MIN_LOG_CHANGE_RATIO / 10
    ]
    normal_deviate = _deviate_of_limit(use**power, terms)
    is_met = use <= 1
    return GuardedRequirement(
        key=key,
        use=use,
        use_uncertainty=use * deviation,
        false_acceptance=_normal_probability(-normal_deviate) if is_met else None,
        false_rejection=None if is_met else _normal_probability(normal_deviate),
    )


class _Term(NamedTuple):
    """Change of a quantity with one figure: amplitude · (exp(rate · z) - 1), where z is standard normal."""

    amplitude: float
    rate: float

    @classmethod
    def through(cls, low: float, middle: float, high: float) -> "_Term":
        """Return the term whose quantity is `low`, `middle` and `high` at z = -1, 0 and 1.

        The rate is limited, because a quantity that another figure bounds on one side gives no finite rate. The term
        then has the difference of `high` and `low`.
        """
        above, below = high - middle, middle - low
        rate = (
            math.log(above / below) if above * below > 0 else math.copysign(_MAX_RATE_RATIO, abs(above) - abs(below))
        )
        rate = math.copysign(min(max(abs(rate), _MIN_RATE_RATIO), _MAX_RATE_RATIO), rate)
        return cls((high - low) / (2 * math.sinh(rate)), rate)

    @property
    def cumulants(self) -> tuple[float, float, float]:
        """Mean, variance and third cumulant of the change."""
        growth = math.expm1(self.rate**2)  # of the square of a log-normal variable, by its mean squared, less 1
        mean = self.amplitude * math.exp(self.rate**2 / 2)
        return mean - self.amplitude, mean**2 * growth, mean**3 * growth**2 * (growth + 3)


def _deviate_of_limit(middle: float, terms: Sequence[_Term]) -> float:
    """Standard normal deviate up to which a quantity is within the limit 1; it is `middle` plus independent terms.

    The quantity is taken as a shifted log-normal variable with the same three first cumulants. This is exact for one
    term, whether it is all of the quantity or added to a constant.
    """
    change, variance, third = (
        math.fsum(cumulants) for cumulants in zip(*(term.cumulants for term in terms), strict=True)
    )
    mean, sigma = middle + change, math.sqrt(variance)
    skewness = third / sigma**3
    if abs(skewness) < _MIN_SKEWNESS_RATIO:
        return (1 - mean) / sigma
    # The skewness of a log-normal variable is (w + 2)·√(w - 1), where w = exp(its variance of the logarithm).
    root = math.asinh(abs(skewness) / 2) / 3 * 2
    growth = 2 * math.cosh(root) - 2  # w - 1
    log_sigma = math.sqrt(math.log1p(growth))
    scale = sigma / math.sqrt((1 + growth) * growth)  # median of the log-normal part
    sign = math.copysign(1.0, skewness)
    shift = mean - sign * scale * math.sqrt(1 + growth)
    distance = sign * (1 - shift) / scale
    if distance <= 0:
        return -sign * math.inf
    deviate: float = sign * math.log(distance) / log_sigma
    return deviate


def _normal_probability(deviate: float) -> float:
    """Probability that a standard normal variable is at most `deviate`."""
    return math.erfc(-deviate / math.sqrt(2)) / 2
