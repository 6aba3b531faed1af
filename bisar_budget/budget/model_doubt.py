"""Whether the published model holds where it decides: its allowables beside those of the full model."""

from collections.abc import Sequence

from bisar_budget import phrases
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.findings.row import Row
from bisar_budget.phrases import NOTHING, Note

APART = 0.05  # of the full model's allowable; farther from it, the published one does not hold


def model_doubt(analysis: Analysis, rows: Sequence[Row]) -> Note:
    """Say of which declared error the published model, where it decides, does not hold; nothing if it does.

    Named is the row of which the two allowables say most differently how much of them is used.

    Parameters
    ----------
    analysis : Analysis
        Of the mission.
    rows : sequence of Row
        As judged: those that the published model judges are looked at, of errors as stated and not zero.
    """
    stated = {source.id for source in analysis.stated if source.declared}
    apart = [row for row in rows if row.model == "published" and row.id in stated and _is_apart(row)]
    if not apart:
        return NOTHING
    worst = max(apart, key=_difference)
    return phrases.published_model_does_not_hold(
        worst.id, worst.allowable_published, worst.allowable_full, worst.unit, len(apart) - 1
    )


def _is_apart(row: Row) -> bool:
    published, full = row.allowable_published, row.allowable_full
    if published is None or full is None:
        return published is not full
    return abs(published - full) > APART * full


def _difference(row: Row) -> float:
    """How differently the two allowables say how much of them is used."""
    declared, limits = row.declared or 0.0, (row.allowable_published, row.allowable_full)
    published, full = (0.0 if limit is None else declared / limit for limit in limits)
    return abs(published - full)
