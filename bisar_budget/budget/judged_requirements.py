"""Judgement of the requirements of a mission, from the rows of its budget and the effects of its declared errors.

The exit code 0 of a check means that every requirement was judged and is met. Each effect of each declared error is
judged against one requirement:

- quadratic phase: against the requirement on the quadratic phase;
- cubic phase: against the requirement on the cubic phase, or against ISLR if there is no such requirement;
- power that spreads over the image: against ISLR;
- tone: against PSLR, or against ISLR if there is no requirement on PSLR;
- displacement of the image: against the location requirement.

An effect that no requirement covers is negligible if its total is below 0.08 rad and below a tenth of the limit on
the quadratic phase. Otherwise the rows of the errors that cause the effect are `not_evaluated`.

All numbers are arrays over n cases, (n,). The check of one mission is a single case.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.arrays import Booleans, Floats, PerCase, PerCaseFlag
from bisar_budget.budget.continued_masks import MIN_USE_FRACTION
from bisar_budget.budget.judged_rows import LIMIT_RATIO, Codes
from bisar_budget.effects.declared import CUBIC, LOCATION, QUADRATIC
from bisar_budget.findings.status import BROKEN, RANK, STATUS
from bisar_budget.mission.model import Mission

REQUIREMENT_KEYS = (QUADRATIC, CUBIC, LOCATION, "pslr", "islr", "declare")
REQUIREMENT_UNITS = {QUADRATIC: "rad", CUBIC: "rad", LOCATION: "m", "pslr": "dB", "islr": "dB", "declare": ""}
EQUAL_USE_FRACTION = 1e-9  # relative difference up to which utilizations are treated as equal
NEGLIGIBLE_FRACTION, SMALL_RAD = 0.1, 0.08  # of the quadratic requirement; phase that is small in any image
# Fraction of the largest part; rows with smaller parts are not named if their sum is negligible.
MAKER_FRACTION = 0.1

# Requirements that cover an effect, in the order in which they are suggested.
TAKEN_BY = {"cubic": (CUBIC, "islr"), "spread": ("islr",), "tone": ("pslr", "islr")}

EXAMPLES = {CUBIC: "22.5 deg", "islr": "-20 dB", "pslr": "-30 dB"}  # example values for lines to add to a file

_NONE = np.int8(len(STATUS))  # code of a row that judges nothing
IS_JUDGED = np.array([status.is_judged for status in STATUS.values()])
# Whether a requirement with a given status is met; the last value belongs to `_NONE`.
IS_MET = np.array([*(status.complies for status in STATUS.values()), False])


class UntakenEffect(NamedTuple):
    """An effect that no requirement covers, for an array of cases, and the rows that cause it.

    `effect` is `cubic`, `spread` or `tone`. `total` is the effect of all errors together [rad]. `parts` maps row ids
    to the magnitude of each error's effect [rad]. `is_negligible` marks the cases in which the total is small but not
    zero. `makers` maps row ids to masks of the cases in which the total is large and the row is one of its causes. A
    row is such a cause if its effect is at least `least` [rad].
    """

    effect: str  # cubic, spread or tone
    total: Floats
    is_negligible: Booleans
    makers: Mapping[str, Booleans]
    least: Floats
    parts: Mapping[str, Floats]


class RequirementState(NamedTuple):
    """A judged requirement for an array of cases: its status, the rows that judge it, and the row that decides it.

    `decider` is the index of the row that decides the status, or -1. `user` is the index of the row that gives the
    `utilization` of the requirement, or -1. If the requirement is met, with or without a warning, `user` is the row
    with the largest utilization. It may differ from `decider`. For example, a row may become a warning because of the
    second model alone. It then decides the status, although its utilization need not be the largest. `is_unjudged`
    marks the cases in which the requirement cannot be judged, whether it is waived or not.
    """

    key: str
    status: Codes
    decider: NDArray[np.intp]
    user: NDArray[np.intp]
    utilization: Floats
    judges: Booleans  # (rows, n)
    is_unjudged: Booleans


def first_highest(uses: Floats) -> NDArray[np.intp]:
    """Index of the row with the highest utilization in each case, (cases,).

    If several rows have the same utilization except for rounding, the first of them is returned. `uses` are the
    utilizations (rows, cases).
    """
    return np.asarray(is_as_high(uses, uses.max(axis=0)).argmax(axis=0))


def is_as_high(uses: PerCase, other_uses: PerCase) -> Booleans:
    """Whether the utilizations `uses` are at least as high as `other_uses`, except for rounding."""
    with np.errstate(invalid="ignore"):  # infinite utilizations are equal, but their difference is NaN
        return np.asarray((uses >= other_uses - EQUAL_USE_FRACTION * np.abs(other_uses)) | (uses == other_uses))


def negligible_rad(mission: Mission) -> PerCase:
    """Total phase below which an effect that no requirement covers is negligible. [rad]"""
    return np.minimum(NEGLIGIBLE_FRACTION * np.asarray(mission.requirements.quadratic_phase_error), SMALL_RAD)


def required_keys(mission: Mission) -> tuple[str, ...]:
    """List the keys of the requirements that a mission states.

    The requirement on the quadratic phase is always included, because it has a default.
    """
    needs = mission.requirements
    return tuple(
        key for key in REQUIREMENT_KEYS if (needs.declare if key == "declare" else getattr(needs, key) is not None)
    )


def requirement_states(
    mission: Mission,
    codes: Codes,
    utilization: Floats,
    judges: Codes,
    quadratic_use: Floats,
    waived: Mapping[str, PerCaseFlag],
    *,
    before: Codes,
    in_doubt: Booleans,
    has_noise: PerCaseFlag,
    is_misplaced: PerCaseFlag,
    unjudged: Mapping[str, PerCaseFlag],
) -> list[RequirementState]:
    """Judge every requirement of a mission for an array of n cases.

    Parameters
    ----------
    mission : Mission
        Mission whose numbers may be arrays (n,).
    codes : (rows, n)
        Statuses of the judged rows; `waived` for waived rows.
    utilization : (rows, n)
        Utilizations of the rows; NaN for a row without a utilization.
    judges : (rows, n)
        Index in `REQUIREMENT_KEYS` of the requirement against which each row is judged; -1 if there is no such
        requirement.
    quadratic_use : (rows, n)
        Quadratic phase of each row divided by the limit of this phase, even if another requirement sets the allowable
        of the row; NaN for a row without a quadratic phase.
    waived : mapping of str to bool
        For each requirement key, whether a valid waiver names the requirement.
    before : (rows, n)
        Statuses of the rows before waivers.
    in_doubt : (rows, n)
        Whether each row belongs to an oscillator whose true noise may differ from the computed noise.
    has_noise : (n,) bool
        Whether an error that spreads power over the image, or a tone that counts against the ISLR, is declared. If
        there is no such error, ISLR is not judged.
    is_misplaced : (n,) bool
        Whether a declared error displaces the image by an amount that no row limits.
    unjudged : mapping of str to bool or (n,) bool
        For each requirement key, whether the requirement cannot be evaluated. This is so if it depends on atmospheric
        delays that are assumed to be constant over a long aperture, or on a cause of error that needs two entries of
        the file, of which only one is given.
    """
    uses, states = np.nan_to_num(utilization, nan=0.0, posinf=np.inf), []
    is_open = before == RANK["not_evaluated"]
    for key in required_keys(mission):
        mine = IS_JUDGED[codes] & (judges == REQUIREMENT_KEYS.index(key))
        levels, used = np.where(mine, codes, _NONE), uses
        if key == QUADRATIC:  # a row whose allowable another requirement sets is judged by this one too
            is_of_other = IS_JUDGED[codes] & ~mine & ~np.isnan(quadratic_use)
            by_autofocus = np.where(codes == RANK["pass_with_autofocus"], codes, RANK["pass"])
            broken = np.where(
                codes == RANK["waived"], codes, RANK["fail"]
            )  # a waiver of a row covers every requirement that the row breaks
            breaks = np.nan_to_num(quadratic_use) > LIMIT_RATIO
            rests_on = in_doubt & is_open & (np.nan_to_num(quadratic_use) > MIN_USE_FRACTION)
            kept = np.where(rests_on, codes, by_autofocus)
            levels = np.where(is_of_other, np.where(breaks, broken, kept), levels)
            used = np.where(is_of_other, quadratic_use, uses)
            mine = mine | is_of_other
        else:  # autofocus corrects only a quadratic phase
            levels = np.where(levels == RANK["pass_with_autofocus"], RANK["pass"], levels)
        worst = levels.min(axis=0)
        # A row that passes by itself may be nearer to breaking the requirement than a row that passes by autofocus.
        is_met = (worst == RANK["pass_with_autofocus"]) & (levels == RANK["pass"])
        # A waived row with a number that breaks the requirement comes before waived rows without a number.
        shown = np.where((codes == RANK["waived"]) & is_open, -0.5, used)
        decider = first_highest(np.where((levels == worst) | is_met, shown, -1.0))
        largest = first_highest(np.where(mine & IS_MET[levels], used, -1.0))
        user = np.where(IS_MET[worst], largest, decider)
        utilization = np.take_along_axis(used, user[None], axis=0)[0]
        is_unknown = np.take_along_axis(is_open, decider[None], axis=0)[0]
        is_unjudged = ~mine.any(axis=0)
        decider, user = np.where(is_unjudged, -1, decider), np.where(is_unjudged, -1, user)
        if key == "islr":
            is_unjudged = is_unjudged | ~np.asarray(has_noise)
        if key == LOCATION:
            is_unjudged = is_unjudged | np.asarray(is_misplaced)
        is_unjudged = is_unjudged | unjudged.get(key, False)
        status = np.where(is_unjudged & (worst != RANK["fail"]), RANK["not_evaluated"], worst)
        is_unknown = (is_unknown & (worst == RANK["waived"])) | (status == RANK["not_evaluated"])
        if waived.get(key):
            status = np.where(np.isin(status, [RANK[name] for name in BROKEN]), RANK["waived"], status)
        states.append(RequirementState(key, status.astype(np.int8), decider, user, utilization, mine, is_unknown))
    return states
