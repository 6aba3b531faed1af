"""Budget row for dispersion: free electrons cause a quadratic phase over the band, which blurs the image in range.

Dispersion is compared with the requirement on the quadratic phase separately from all other errors, because a phase
error over frequency does not combine with phase errors over slow time. Dispersion may use the full requirement,
because no share of it belongs to the atmosphere. Autofocus does not correct dispersion.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from bisar_budget import phrases
from bisar_budget.analysis.analysis import Analysis, Case
from bisar_budget.budget.judged_rows import FamilyRow, Judging, worded
from bisar_budget.effects.air_delays import CONTENT, dispersed
from bisar_budget.effects.declared import QUADRATIC
from bisar_budget.effects.effect import PLATFORMS, subject
from bisar_budget.findings.row import Row
from bisar_budget.phrases import NOTHING

DISPERSION = subject("mission", "dispersion")


def dispersion_rows(judging: Judging, analysis: Analysis) -> Iterator["DispersionRow"]:
    """Yield the row that judges the quadratic phase due to free electrons at the edges of the band.

    There is no row if the file declares no electron content.
    """
    propagation = analysis.mission.propagation
    if propagation is None or all(propagation.content(name) is None for name in PLATFORMS):
        return
    phase = judging.array(dispersed(analysis.mission, analysis.geometry))
    total = judging.array(analysis.allocation.qpe_total)
    judged = judging.row(DISPERSION, phase, total)
    judged = judged._replace(allowable_published=total, allowable_full=total)
    yield DispersionRow(judged.held_to(QUADRATIC))


@dataclass(frozen=True, slots=True, eq=False)
class DispersionRow(FamilyRow):
    """Budget row for the quadratic phase [rad] that free electrons cause over the band, for an array of cases."""

    def in_words(self, case: Case, model: str) -> Row:
        """Build the report row for one case, including its text. The row is the same for both models."""
        propagation = case.mission.propagation
        assert propagation is not None  # else there is no row
        contents: dict[str, Any] = {name: propagation.content(name) for name in PLATFORMS}
        stated = next(name for name, content in contents.items() if content is not None)
        phase, limit = case.number(self.judged.declared), case.number(self.judged.allowable)
        over = remark = NOTHING
        if phase:
            over = phrases.note("dispersion-over", phase=phase, limit=limit)
        if phase and propagation.is_one_air:
            remark = phrases.note("content-allowed", content=float(np.asarray(contents[stated])) * limit / phase)
        path = propagation.path(stated, CONTENT)
        return worded(
            case,
            self.judged,
            unit="rad",
            path=path,
            equation="(2π/λ)·g·(B/2f₀)²",
            over=over,
            remarks=tuple(filter(None, (remark,))),
            evidence=case.mission.propagation and propagation.source_of(stated),
            binding_requirement=QUADRATIC,
        )
