"""Division of a mission's budgets between transmitter, receiver and clock, and the gain that autofocus adds.

The gain depends on N_pull, the pull-in range of autofocus in units of π rad. The module also gives upper bounds on
N_pull.
"""

import math
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from bisar_budget import evaluators, phrases
from bisar_budget.analysis.together import Together
from bisar_budget.arrays import Floats, PerCase
from bisar_budget.effects.effect import plain
from bisar_budget.mission.model import MetricSplits, Mission, Shares
from bisar_budget.phrases import Note
from bisar_budget.units import format_quantity

BALANCED_RANGE = (0.05, 0.95)  # each platform keeps a budget


EQUAL = Shares(transmitter=0.5, receiver=0.5)


class Allocation(NamedTuple):
    """Budgets of a mission, divided between transmitter, receiver and clock.

    `qpe_total` [rad] is the budget of the quadratic phase error (QPE) for the whole mission, without autofocus. The
    owners of a budget are transmitter, receiver and clock. `qpe`, `pslr` and `islr` are their shares of the budgets
    of QPE, PSLR and ISLR. The shares of PSLR and ISLR are shares of power.

    Autofocus corrects up to π·N_pull rad at the aperture edge. `n_pull_stated` is the N_pull in the mission file
    (`autofocus.n_pull`), and `n_pull` is this value after `effective_n_pull` has limited it. Both are None if the
    mission has no autofocus.
    """

    qpe_total: float
    qpe: Shares
    pslr: Shares
    islr: Shares
    n_pull: float | None
    n_pull_stated: float | None

    @property
    def autofocus_gain(self) -> Any:
        """Factor by which autofocus raises the limits of the quadratic phase error: π·N_pull/`qpe_total`, at least 1.

        The factor is 1 without autofocus. The formula follows from Section VI of Rigling & Moses. For a `qpe_total`
        of π/4 it gives 4·N_pull.
        """
        return _gain(self.n_pull, self.qpe_total)

    def qpe_limit(self, owner: str) -> float:
        """Largest quadratic phase error that an owner may have without autofocus. [rad]

        `owner` is `transmitter`, `receiver`, `clock`, or `mission` for the whole mission.
        """
        return self.qpe.of(owner) * self.qpe_total

    def qpe_allowed(self, owner: str) -> Any:
        """Largest quadratic phase error that an owner may have with the mission's autofocus. [rad]

        `owner` is `transmitter`, `receiver`, `clock`, or `mission` for the whole mission.
        """
        return self.qpe_limit(owner) * self.autofocus_gain

    def of(self, case: int) -> "Allocation":
        """Return the budgets of one case as single numbers instead of arrays.

        `case` is the index of the case in the arrays (cases,).
        """
        return Allocation._make(_plain(figure, case) for figure in self)

    def passes_with(self, qpe: float, hidden: float, owner: str, mission: Mission) -> Note:
        """Write a note with the smallest N_pull for which a phase error passes, or with the reason why it fails.

        `qpe` [rad] is the quadratic phase at the aperture edge, which autofocus corrects. `hidden` [rad] is the
        quadratic phase that would cause the same peak loss as the part of the error that autofocus does not correct.
        The phase to compare with the limit is the root-sum-square of two phases: `qpe`, and `hidden` times the
        autofocus gain. The limit grows with the same gain. If `hidden` reaches the limit that the owner has without
        autofocus, the phase error therefore fails for any N_pull.
        """
        room = 1 - (hidden / self.qpe_limit(owner)) ** 2
        if room <= 0:
            return phrases.note("no-autofocus-helps", hidden=hidden, limit=self.qpe_limit(owner))
        return needed_sentence(qpe / math.sqrt(room) / (self.qpe.of(owner) * math.pi), caps(mission))


def _gain(n_pull: float | None, qpe_total: float) -> PerCase:
    if n_pull is None:
        return 1.0
    gain = evaluators.autofocus_gain(n_pull, qpe_total)
    return gain * (gain > 1) + 1.0 * (gain <= 1)  # the larger number, also of arrays


def autofocus_gain_of(mission: Mission) -> PerCase:
    """Return the factor by which a mission's autofocus raises the limits of the quadratic phase error.

    The factor is at least 1, and it is 1 without autofocus. It does not depend on how the budget is divided between
    transmitter, receiver and clock.
    """
    return _gain(effective_n_pull(mission), mission.requirements.quadratic_phase_error)


def _plain(figure: Any, case: int) -> Any:
    if isinstance(figure, Shares):
        return Shares._make(_plain(share, case) for share in figure)
    return None if figure is None else plain(figure, case)


def is_balanced(mission: Mission) -> bool:
    """Whether the mission file divides the budget of the quadratic phase in proportion to the declared errors."""
    split = mission.allocation.split
    return (split.quadratic_phase_error if isinstance(split, MetricSplits) else split) == "balanced"


def allocate(mission: Mission, gates: Iterable[Together]) -> Allocation:
    """Divide the budgets of a mission according to its `allocation.split`.

    Parameters
    ----------
    mission : Mission
        Mission whose budgets are divided. Some of its numbers may be arrays (cases,).
    gates : iterable of Together
        Declared errors in each gating model, that is each model whose verdict counts. They are used only for the
        split `balanced`, which sets the shares in proportion to the phases of these errors. The shares are then
        arrays (cases,) if there are several cases.
    """
    split = mission.allocation.split
    qpe, pslr, islr = (
        (split.quadratic_phase_error, split.pslr, split.islr) if isinstance(split, MetricSplits) else (split,) * 3
    )
    return Allocation(
        qpe_total=mission.requirements.quadratic_phase_error,
        qpe=_balanced(list(gates)) if qpe == "balanced" else _shares(qpe),
        pslr=_shares(pslr),
        islr=_shares(islr),
        n_pull=effective_n_pull(mission),
        n_pull_stated=mission.autofocus.n_pull,
    )


def _balanced(gates: Sequence[Together]) -> Shares:
    """Divide a budget between transmitter and receiver in proportion to the combined phases of their declared errors.

    `gates` holds the declared errors in each gating model, that is each model whose verdict counts. With two such
    models, the larger of the two phases of an error is used. Each share is limited to `BALANCED_RANGE`. Both shares
    are 1/2 if all phases are 0.
    """
    weights = []
    for owner in ("transmitter", "receiver"):
        by_model = zip(*(together.judged_parts(together.owed(EQUAL, owner)) for together in gates), strict=True)
        phases = [(of_platform[0][0], _largest([phase for _, phase in of_platform])) for of_platform in by_model]
        # An error that leaves no image has an infinite phase: its platform gets the largest share allowed.
        weights.append(np.minimum(gates[0].combined(phases), 1e300))
    total = weights[0] + weights[1]
    with np.errstate(invalid="ignore"):
        share: Any = np.where(total == 0, 0.5, np.clip(weights[0] / total, *BALANCED_RANGE))
    if share.size == 1:
        share = float(share[0])
    return Shares(transmitter=share, receiver=1 - share)


def _largest(phases: Sequence[Floats]) -> Floats:
    """For each case, return the signed phase with the largest magnitude among several arrays (cases,). [rad]"""
    if len(phases) == 1:
        return phases[0]
    of_all = np.array(phases)
    largest = np.abs(of_all).argmax(axis=0)
    return np.asarray(np.take_along_axis(of_all, largest[None], axis=0)[0])


def _shares(split: str | Shares) -> Shares:
    return EQUAL if isinstance(split, str) else split  # `balanced` divides only the phase, in proportion


# ---------------------------------------------------------------------- autofocus
ROOM = {"pga": 3.0, "map_drift": 1.5}  # smallest size of the patch, in units of the smear


class Caps(NamedTuple):
    """Upper bounds on a useful N_pull: `walk`, set by range walk, and `scene`, set by the size of the scene.

    N_pull is the pull-in range of autofocus in units of π rad. `walk` is f₀/B, the ratio of centre frequency to
    bandwidth. A larger N_pull is reduced to `walk`. `scene` is None if the mission file gives no size of the scene.
    If N_pull exceeds `scene`, the report contains a warning.

    A phase of π·N at the aperture edge corresponds to a range walk of λN/2, which is N·B/2f₀ range cells. Such a
    phase smears a point target over 4N cross-range cells. The bounds were measured on images of point targets
    (`tests/simulate/test_pull_in_caps.py`). One-dimensional autofocus still works for a range walk of half a cell or
    more. However, no phase correction recovers the loss that range walk causes. The loss is 0.6 dB for a range walk
    of half a cell and 1.3 dB for a whole cell.

    Autofocus also fails, and leaves the image smeared, if it works on too small a patch of the image. This does not
    depend on range walk or bandwidth. Phase gradient autofocus needs a patch three times as wide as the smear, and
    map drift autofocus needs a patch 1.5 times as wide. Both factors were found for range walks of a hundredth of a
    cell and of a third of a cell.
    """

    walk: float
    scene: float | None = None


def caps(mission: Mission) -> Caps:
    """Return the upper bounds on N_pull, the pull-in range of a mission's autofocus in units of π rad, see `Caps`."""
    walk = range_walk_cap(mission)
    if mission.scene.radius is None:
        return Caps(walk)
    cell = float(mission.geometry.cross_range_resolution(mission.radar.wavelength, mission.collection.aperture_time))
    return Caps(walk, 2 * mission.scene.radius / (4 * cell * ROOM[mission.autofocus.algorithm]))


def range_walk_cap(mission: Mission) -> float:
    """Upper bound that range walk sets on N_pull, the pull-in range of autofocus in units of π rad.

    It is the ratio f₀/B of centre frequency to bandwidth, as a number or as an array (cases,).
    """
    return mission.radar.center_frequency / mission.radar.bandwidth


def effective_n_pull(mission: Mission) -> float | None:
    """N_pull that a mission's autofocus reaches: the value in the mission file, but at most `range_walk_cap`.

    N_pull is the pull-in range in units of π rad. The result is None if the file declares no autofocus.
    """
    stated, cap = mission.autofocus.n_pull, range_walk_cap(mission)
    if stated is None:
        return None
    return stated * (stated <= cap) + cap * (stated > cap)  # the smaller number, also of arrays


def needed_sentence(n_pull: float, caps: Caps) -> Note:
    """Write a note with the N_pull that an error needs to pass.

    N_pull is the pull-in range of autofocus in units of π rad. If the needed N_pull exceeds one of the upper bounds,
    the note gives the bound as well.

    Parameters
    ----------
    n_pull : float
        Smallest N_pull with which the error would pass.
    caps : Caps
        Upper bounds on the mission's N_pull, from the function `caps`.
    """
    if caps.scene is not None and caps.scene < min(n_pull, caps.walk):
        allowed = f"the scene's size allows {rounded_down(caps.scene)}"
    elif n_pull > caps.walk:
        allowed = f"range walk allows {rounded_down(caps.walk)}"
    else:
        return phrases.note("passes-from", n_pull=math.ceil(n_pull * 100 * (1 - 1e-12)) / 100)
    return phrases.note("beyond-autofocus", n_pull=_up(n_pull), allowed=allowed)


def _up(number: float) -> str:
    """Format a number with three significant digits, rounded up.

    Numbers of 100 or more are written as whole numbers, with a space as thousands separator.
    """
    if number >= 100:
        return f"{math.ceil(number * (1 - 1e-12)):,}".replace(",", " ")
    step = 10.0 ** (math.floor(math.log10(number)) - 2)
    return f"{math.ceil(number / step * (1 - 1e-12)) * step:.3g}"


def rounded_down(number: float) -> str:
    """Format a number with three significant digits, rounded down.

    Numbers of 100 or more are written as whole numbers, with a space as thousands separator.
    """
    if number >= 100:
        return f"{math.floor(number * (1 + 1e-12)):,}".replace(",", " ")
    return format_quantity(number, "", 3, "down")
