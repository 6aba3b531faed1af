"""Results of the draws of a Monte Carlo, as lines of text."""

import math
from collections.abc import Iterator

from bisar_budget.findings.monte_carlo import MonteCarlo, Requirement
from bisar_budget.report.words.layout import wrapped
from bisar_budget.units import format_quantity

_WIDTH = 33  # of the ids


def probabilities(drawn: MonteCarlo) -> list[str]:
    """Table of how often each requirement holds, beside what needs no draws, then doubts and notes."""
    lines = [
        f"Monte Carlo: {drawn.draws:,} draws, seed {drawn.seed}, {drawn.model} model; "
        f"intervals of {100 * drawn.confidence:.0f} % by Wilson",
        "",
    ]
    if drawn.probability is None or drawn.probability_low is None or drawn.probability_high is None:
        return [*lines, "  no declared error has a requirement to hold"]
    lines.append(_cells("requirement", "limit", "sum", "rss", "sigma"))
    for requirement in drawn.requirements:
        lines += _requirement(requirement)
    if len(drawn.requirements) > 1:
        lines += ["all at once", f"  {held(drawn.probability, drawn.probability_low, drawn.probability_high)}"]
    texts = [f"warning: {one.id}: {text}" for one in drawn.requirements for text in one.warnings]
    texts += [f"note: {text}" for text in drawn.notes]
    return [*lines, *[line for text in texts for line in wrapped(f"  {text}", "    ")]]


def _requirement(one: Requirement) -> Iterator[str]:
    limit = format_quantity(one.limit, one.unit, 3, "down")
    yield _cells(one.id, limit, *(_size(size, one.unit) for size in (one.sum, one.rss, one.sigma)))
    decimals = _decimals(one.probability_low, one.probability_high)
    yield (
        f"  {held(one.probability, one.probability_low, one.probability_high)}, "
        f"normal with sigma {format_quantity(one.sigma_rss, one.unit)}: {_percent(one.probability_normal, decimals)}"
    )


def _size(size: float | None, unit: str) -> str:
    return "no image" if size is None else format_quantity(size, unit)


def _cells(name: str, *cells: str) -> str:
    return f"{name:<{_WIDTH}}" + "".join(f"{cell:>11}" for cell in cells)


def held(probability: float, low: float, high: float) -> str:
    """Probability and its interval, to the digits that the interval leaves."""
    decimals = _decimals(low, high)
    ends = f"{_percent(low, decimals)} to {_percent(high, decimals)}".replace(" % to", " to")
    return f"holds in {_percent(probability, decimals)} ({ends})"


def _decimals(low: float, high: float) -> int:
    return max(0, min(9, 1 - math.floor(math.log10(100 * (high - low)))))


def _percent(probability: float, decimals: int) -> str:
    """Percent with so many decimals; what rounds to all or none without."""
    text = f"{100 * probability:.{decimals}f}"
    return f"{float(text):.0f} %" if float(text) in (0.0, 100.0) else f"{text} %"
