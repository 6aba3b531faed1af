"""The probability that a verdict is wrong, because declared figures have an uncertainty of their own.

A mission declares the size of an error, such as the sigma of a velocity, and the file may state the standard
uncertainty of this size. The utilization of a requirement is then uncertain too. Each uncertain size is changed by a
factor of exp(±u), where u is its relative standard uncertainty, and the mission is checked again. The factor keeps
the sign of the size. The logarithms of the sizes are normal and independent. The logarithm of the utilization is
taken as normal. Its mean and variance follow from the differences of the checks, to second order without mixed terms
(JCGM 100:2008, 5.1.2). The probability that the true utilization is on the other side of 1 is the specific risk of
JCGM 106:2012, 9.3: it belongs to this mission, not to a production.
"""

import math
from collections.abc import Mapping, Sequence
from datetime import date

from bisar_budget.budget.check import CheckedMission, check_missions
from bisar_budget.faults import MissionError
from bisar_budget.findings.guard import Guard, GuardedRequirement
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.mission.model import Mission, UncertainFigure
from bisar_budget.mission.quantities import number_of, tree_of
from bisar_budget.questions.table import Variation
from bisar_budget.units import DB_PER_NEPER

_MIN_LOG_CHANGE_RATIO = 1e-6  # a smaller change of a utilization is the tolerance of a check

LogUses = Mapping[str, float]
"""Natural logarithms of the utilizations of a mission, by the keys of its requirements."""


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
        _guarded(requirement, middle, pairs)
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
) -> tuple[LogUses, list[tuple[LogUses, LogUses]]]:
    """Check a mission as it is, and with each uncertain figure decreased and increased by its uncertainty.

    Returns the logarithms of the utilizations of the mission, and of each pair of changed missions. A changed mission
    that the reader refuses has no utilizations.
    """
    variation = Variation(mission, mission.allocation.model)
    tree = tree_of(mission)
    missions, places = [mission], [0]
    for index, figure in enumerate(figures):
        number = number_of(tree, figure.key)
        size = number.value or 0.0
        for side, sign in enumerate((-1, 1)):
            log_change = sign * figure.relative_uncertainty
            changed = size + DB_PER_NEPER * log_change if number.is_level else size * math.exp(log_change)
            try:
                missions.append(variation.at({number: changed}))
                places.append(1 + 2 * index + side)
            except MissionError:
                continue
    log_uses: list[LogUses] = [{} for _ in range(1 + 2 * len(figures))]
    for index, findings in check_missions(missions, today, keeps_analysis=False):
        log_uses[places[index]] = {
            requirement.key: math.log(requirement.utilization)
            for requirement in findings.requirements
            if requirement.utilization is not None and 0 < requirement.utilization < math.inf
        }
    return log_uses[0], list(zip(log_uses[1::2], log_uses[2::2], strict=True))


def _guarded(
    requirement: JudgedRequirement, middle: LogUses, pairs: Sequence[tuple[LogUses, LogUses]]
) -> GuardedRequirement:
    """Compute the probability that the verdict on a requirement is wrong from the changes of its utilization."""
    key, use = requirement.key, requirement.utilization or 0.0
    shift, variance = 0.0, 0.0
    for low, high in pairs:
        if key not in low or key not in high or key not in middle:
            return GuardedRequirement(key=key, use=use)
        first = (high[key] - low[key]) / 2
        second = high[key] + low[key] - 2 * middle[key]
        shift += second / 2
        variance += first**2 + second**2 / 2
    deviation = math.sqrt(variance)
    if deviation < _MIN_LOG_CHANGE_RATIO:
        return GuardedRequirement(key=key, use=use)
    beyond_limit = _normal_probability((math.log(use) + shift) / deviation)
    is_met = use <= 1
    return GuardedRequirement(
        key=key,
        use=use,
        use_uncertainty=use * deviation,
        false_acceptance=beyond_limit if is_met else None,
        false_rejection=None if is_met else _normal_probability(-(math.log(use) + shift) / deviation),
    )


def _normal_probability(deviations: float) -> float:
    """Probability that a standard normal variable is at most `deviations`."""
    return math.erfc(-deviations / math.sqrt(2)) / 2
