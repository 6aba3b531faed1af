"""The confidence with which requirements are met: the sigma or the bounds that declared errors are stated by."""

from collections.abc import Iterator

import numpy as np

from bisar_budget import phrases
from bisar_budget.analysis.analysis import Case
from bisar_budget.effects.sources import distribution_of
from bisar_budget.phrases import Note


def confidence_of(case: Case) -> Note:
    """Confidence of the verdict on one case, as the end of a sentence: `at 1 sigma`, `for the stated bounds`.

    Errors of which the file states a size and no distribution (amplitudes of vibration, errors from elsewhere, the
    terrain) take no part, and an error of 0 only where there is no other.
    """
    stated = list(_stated(case))
    distributions = {name for name, size in stated if size} or {name for name, _ in stated}
    has_sigma, has_bounds = "normal" in distributions, bool(distributions - {"normal"})
    return phrases.confidence(case.mission.allocation.coverage_factor, has_sigma=has_sigma, has_bounds=has_bounds)


def _stated(case: Case) -> Iterator[tuple[str, float]]:
    """Distribution and size of every declared error that has a distribution."""
    for source in case.analysis.stated:
        if source.is_covered:
            yield distribution_of(case.mission, source), np.nan_to_num(case.number(source.declared))
    for error in case.analysis.random:
        if error.is_covered and error.declared is not None and not error.counted_in:
            yield "normal", np.nan_to_num(case.number(error.declared))
