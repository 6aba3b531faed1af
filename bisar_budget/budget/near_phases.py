"""Limits on the phase errors that tones between one and three cycles per aperture cause in addition to echoes.

Such a tone makes echoes. At its worst starting phase it also causes a quadratic and a cubic phase error. No sum of
errors includes these phase errors, because PSLR or ISLR already limits the tone. The row of the tone itself therefore
limits them. The limit on the quadratic phase is the platform's share, including the autofocus gain. The limit on the
cubic phase is the full requirement.
"""

import math
from typing import NamedTuple

import numpy as np

from bisar_budget import phrases
from bisar_budget.analysis.allocation import Allocation
from bisar_budget.analysis.analysis import Case
from bisar_budget.arrays import Booleans, Floats, PerCase, PerCaseFlag
from bisar_budget.budget.judged_rows import LIMIT_RATIO, REQUIREMENTS, Judged, Judging
from bisar_budget.effects.declared import CUBIC, QUADRATIC
from bisar_budget.effects.effect import Subject
from bisar_budget.mission.model import Mission
from bisar_budget.phrases import NOTHING, Note


class NearPhases(NamedTuple):
    """Phase errors [rad] that a slow tone causes at its worst starting phase, and their utilizations, (cases,).

    `quadratic_use` is the utilization of the limit on the quadratic phase. `use` is the larger of this utilization
    and the utilization of the limit on the cubic phase. Both are NaN for a tone that is too fast to cause such phase
    errors. `without_autofocus` is the utilization of the limit on the quadratic phase without the autofocus
    gain; it is 0 for a tone that is too fast.
    """

    use: Floats
    quadratic_use: Floats
    without_autofocus: Floats
    quadratic: Floats
    cubic: Floats
    equal_loss: Floats

    @classmethod
    def of(
        cls,
        mission: Mission,
        allocation: Allocation,
        owner: str,
        is_near: Booleans,
        phases: tuple[PerCase, PerCase, PerCase, PerCase],
    ) -> "NearPhases":
        """Compute the utilizations of a tone from the phase errors that it causes.

        `owner` is the platform of the tone. `phases` [rad] are the quadratic phase of the tone, its cubic phase, the
        quadratic phase that would lower the peak as much as the tone does, and the judged phase, which is compared
        with the limit. `is_near` marks the cases in which the tone is slow enough to cause these phase errors.
        """
        quadratic, cubic, equal_loss, judged = (np.where(is_near, phase, math.nan) for phase in phases)
        use = quadratic_use = judged / allocation.qpe_allowed(owner)
        allowed = mission.requirements.cubic_phase_error
        if allowed is not None:
            use = np.maximum(use, cubic / allowed)
        without = np.nan_to_num(equal_loss / allocation.qpe_limit(owner))
        return cls(use, quadratic_use, without, quadratic, cubic, equal_loss)

    @property
    def is_over(self) -> Booleans:
        """Mask of the cases in which the phase errors exceed a requirement, (cases,)."""
        return np.asarray(self.use > LIMIT_RATIO)

    def limit(self, declared: Floats) -> Floats:
        """Size at which the phase errors of the tone reach the first of their limits, in the unit of `declared`.

        `declared` is the declared size of the tone. The result is infinite for a tone without such phase errors.
        """
        with np.errstate(all="ignore"):
            return np.where(self.use > 0, declared / self.use, math.inf)

    def row(
        self,
        judging: Judging,
        row_subject: Subject,
        metric: str,
        declared: Floats,
        by_echoes: Floats | None,
        *,
        doubt: PerCaseFlag = False,
        is_unknown: PerCaseFlag = False,
    ) -> Judged:
        """Judge both the echoes and the phase errors of a tone.

        `declared` is the declared size of the tone. `by_echoes` is the size at which its echoes reach the requirement
        on PSLR or ISLR; it is None if there is no such requirement. Where `is_unknown` is true, the level of the
        echoes is unknown, but the tone still fails if its phase errors exceed a requirement.
        """
        limit = self.limit(declared)
        echoes = np.full(declared.shape, math.inf) if by_echoes is None else by_echoes
        allowable = np.fmin(echoes, limit)
        judged = judging.row(
            row_subject,
            declared,
            np.where(np.isinf(allowable), math.nan, allowable),
            doubt=doubt,
            without_autofocus=self.without_autofocus,
            is_info=np.isnan(self.use) & (by_echoes is None),
            is_unknown=is_unknown & ~self.is_over,
        ).held_to(metric)
        of_phase = np.where(self.use > self.quadratic_use, *map(REQUIREMENTS.index, (CUBIC, QUADRATIC)))
        is_by_phase = np.isfinite(limit) & ~(echoes <= limit)
        return judged._replace(
            binding=np.where(is_by_phase, of_phase, judged.binding).astype(np.int8),
            qpe_published_rad=self.quadratic,
            qpe_full_rad=self.quadratic,
            cubic_rad=self.cubic,
            equal_loss_qpe_rad=self.equal_loss,
            quadratic_use=self.quadratic_use,
        )


def phase_over(case: Case, judged: Judged) -> Note:
    """Explain why a tone fails because of its phase errors.

    The note is empty if no phase requirement sets the tone's allowable.
    """
    mission, allocation, owner = case.mission, case.allocation, judged.subject.owner
    binding = phase_requirement(case, judged)
    if binding is None:
        return NOTHING
    if binding == CUBIC:
        allowed = mission.requirements.cubic_phase_error or 0.0
        return phrases.note("slow-cubic-phase-over", phase=case.number(judged.cubic_rad), limit=allowed)
    qpe, limit = case.number(judged.qpe_published_rad), allocation.qpe_allowed(owner)
    over = phrases.note("slow-quadratic-phase-over", phase=qpe, limit=limit)
    return over.then(allocation.passes_with(qpe, 0.0, owner, mission)) if qpe > limit else over


def phase_requirement(case: Case, judged: Judged) -> str | None:
    """Return the key of the phase requirement that sets the allowable of a tone; None if its echoes set it."""
    binding = judged.requirement(case)
    return binding if binding in (QUADRATIC, CUBIC) else None
