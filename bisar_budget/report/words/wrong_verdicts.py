"""Sentences about the probability that a verdict is wrong, because declared figures are uncertain."""

from collections.abc import Iterator

from bisar_budget.findings.guard import Guard, GuardedRequirement
from bisar_budget.findings.requirement import REQUIREMENT_NAMES
from bisar_budget.report.words.sentences import percent

_SMALLEST_SHOWN_FRACTION = 1e-5  # a smaller probability is shown as a bound
NO_UNCERTAINTY = (
    "no figure states an uncertainty, such as 5 mm ± 20 %. The probability that a verdict is wrong is not known"
)


def guard_sentences(guard: Guard) -> Iterator[str]:
    """Yield a sentence for each judged requirement, or a single one if no figure states an uncertainty."""
    if not guard.figures:
        yield f"Guard: {NO_UNCERTAINTY}."
    elif not guard.requirements:
        yield "Guard: no requirement is judged by a utilization."
    for requirement in guard.requirements:
        name, verdict = REQUIREMENT_NAMES[requirement.key], verdict_words(requirement)
        if requirement.probability is None:
            yield f"Guard: {name} {verdict}; no probability follows from the uncertain figures."
        else:
            wrong = risk_words(requirement)
            yield (
                f"Guard: {name} {verdict}; the probability that this is wrong is {wrong} "
                f"(use {uncertain_use(requirement)})."
            )


def verdict_words(requirement: GuardedRequirement) -> str:
    """Verdict on a requirement in words."""
    return "is met" if requirement.use <= 1 else "is not met"


def uncertain_use(requirement: GuardedRequirement) -> str:
    """Utilization of a requirement with its standard uncertainty, such as `78.5 % +/- 11 %`."""
    use = percent(requirement.use)
    return use if requirement.use_uncertainty is None else f"{use} +/- {100 * requirement.use_uncertainty:.2g} %"


def risk_words(requirement: GuardedRequirement) -> str:
    """Probability that the verdict is wrong, with two digits; a dash if it is not known."""
    if requirement.probability is None:
        return "–"
    if requirement.probability < _SMALLEST_SHOWN_FRACTION:
        return f"below {100 * _SMALLEST_SHOWN_FRACTION:g} %"
    return f"{100 * requirement.probability:.2g} %"
