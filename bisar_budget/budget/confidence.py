"""The confidence level of a verdict, derived from the stated distributions (sigmas or bounds) of the errors."""

import math
from collections.abc import Iterator

from bisar_budget import phrases
from bisar_budget.analysis.analysis import Case
from bisar_budget.effects.declared import LIMITING_REQUIREMENTS
from bisar_budget.effects.sources import distribution_of
from bisar_budget.findings.requirement import REQUIREMENT_NAMES
from bisar_budget.phrases import Note


def confidence_of(case: Case) -> Note:
    """Return the confidence level of the verdict on one case, as the end of a sentence, for example `at 1 sigma`.

    If the file states bounds, the wording is for example `for the stated bounds`, and if its requirements state a
    confidence, `with 95 % confidence`. Errors for which the file gives a
    size but no distribution are ignored: amplitudes of vibration, `other` errors and the terrain. Errors whose size
    is 0 are considered only if all errors are 0.
    """
    stated = list(_stated(case))
    distributions = {name for name, is_nonzero in stated if is_nonzero} or {name for name, _ in stated}
    has_sigma, has_bounds = "normal" in distributions, bool(distributions - {"normal"})
    factor, needs = case.mission.allocation.coverage_factor, case.mission.requirements
    of_sizes = phrases.confidence(factor, has_sigma=has_sigma, has_bounds=has_bounds)
    if not needs.has_confidence:
        return of_sizes
    levels = {key: needs.confidence_of(key) for key in LIMITING_REQUIREMENTS if getattr(needs, key) is not None}
    confidences = {REQUIREMENT_NAMES[key]: level for key, level in levels.items() if level is not None}
    return phrases.stated_confidence(confidences, of_sizes if None in levels.values() else "")


def _stated(case: Case) -> Iterator[tuple[str, bool]]:
    """Yield the distribution of each declared error, and whether the error's size is known and nonzero.

    Errors without a distribution are omitted.
    """
    for source in case.analysis.errors.stated:
        if source.is_covered:
            yield distribution_of(case.mission, source), _is_nonzero(case.number(source.declared))
    for error in case.analysis.random:
        if error.is_covered and error.declared is not None and not error.counted_in:
            yield "normal", _is_nonzero(case.number(error.declared))


def _is_nonzero(size: float) -> bool:
    return size != 0 and not math.isnan(size)
