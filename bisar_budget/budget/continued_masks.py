"""Warnings for rows that depend on phase noise at frequencies for which no data sheet gives a value.

A mask gives the phase noise of an oscillator at several offset frequencies. Below its first point it is extrapolated
as f⁻³. A pass becomes a warning if more than half of a row's power comes from this extrapolated part and the row uses
more than a tenth of its limit. The warning gives the frequency down to which the mask should reach.
"""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from bisar_budget import phrases
from bisar_budget.analysis.analysis import Case
from bisar_budget.arrays import PerCase, PerCaseFlag
from bisar_budget.effects.oscillators import COVERED_CYCLES
from bisar_budget.effects.random_effect import RandomEffect, RandomError
from bisar_budget.phrases import NOTHING, Note

MOST_OF_POWER = 0.5  # fraction of a row's power above which the row depends on the extrapolated part
MIN_USE_FRACTION = 0.1  # utilization of a limit up to which the source of the noise does not matter

Part = str  # quadratic, cubic, spread or displacement


def part_of(effect: RandomEffect, effect_kind: Part) -> Any:
    """Return one kind of effect that one unit of an error causes.

    The effect is a phase [rad], an rms phase [rad] or a displacement [m]. `effect_kind` names its kind, such as
    `quadratic`.
    """
    return getattr(effect, effect_kind)


def continued_power(errors: Iterable[RandomError], effect_kind: Part) -> PerCase:
    """Sum the squared effects of phase noise at frequencies below the first points of masks; 0 without such noise.

    The sum includes all declared errors among `errors`. `effect_kind` names the kind of effect, such as `quadratic`.
    """
    power: PerCase = 0.0
    for error in errors:
        if error.continued is not None and error.declared is not None:
            power = power + np.nan_to_num(np.square(part_of(error.continued, effect_kind) * error.declared))
    return power


def rests_on_masks(errors: Iterable[RandomError], effect_kind: Part, size: PerCase, limit: PerCase) -> PerCaseFlag:
    """Decide whether a row depends on phase noise at frequencies below the first points of phase-noise masks.

    This is so if such noise makes up more than half of the power of the row, and if the `size` of the row exceeds a
    tenth of its `limit`. The result is a Boolean or an array (cases,).
    """
    power = continued_power(errors, effect_kind)
    with np.errstate(all="ignore"):
        return (power > MOST_OF_POWER * np.square(size)) & (size > MIN_USE_FRACTION * np.asarray(limit))


def continuation_note(case: Case, errors: Sequence[RandomError], effect_kind: Part, size: float) -> Note:
    """Write a note that a row depends on phase noise at frequencies below the first points of phase-noise masks.

    The note gives the fraction of the row's power that is due to this noise, and the frequency down to which the
    masks should reach. It is empty if no declared error has such noise or if `size` is 0.
    """
    makers = [error for error in errors if error.continued is not None and error.declared is not None]
    if not makers or not size:
        return NOTHING
    percent = 100 * min(1.0, float(np.max(continued_power(makers, effect_kind))) / size**2)
    least = COVERED_CYCLES / case.mission.collection.aperture_time
    return phrases.note(
        "rests-on-the-continuation", platforms=[error.owner for error in makers], percent=percent, least=least
    )
