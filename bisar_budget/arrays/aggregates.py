"""What the declared errors of many cases add up to: the arrays beside `budget.aggregates` and `analysis.together`."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.analysis.allocation import Split, effective_n_pull
from bisar_budget.budget.judged_rows import BOUND, CODE, Judged, Judging
from bisar_budget.effects.combined import (
    Phases,
    combined_displacement,
    combined_phase,
    largest_signed_sum,
    many_correlated,
)
from bisar_budget.effects.declared import DeclaredErrors
from bisar_budget.effects.models import CUBIC, LOCATION, QUADRATIC
from bisar_budget.effects.subject import Subject, subject
from bisar_budget.effects.vibration import OwnPhase
from bisar_budget.ranges.exact_ranges import Floats

Own = Sequence[OwnPhase]


class Owed(NamedTuple):
    """Phases that add up, and in which cases any of them is declared."""

    phases: Phases
    is_declared: NDArray[np.bool_]


class ManyTogether:
    """Declared errors of many cases by one model; as `Together`."""

    def __init__(self, errors: DeclaredErrors, model: str, own: Own, split: Split) -> None:
        self.errors, self.model, self.own, self.split = errors, model, own, split
        self.motion = [error for error in errors.stated if error.is_motion]
        self.rule, self.groups = errors.mission.allocation.combine, many_correlated(errors.mission)

    def owed(self, owner: str) -> Owed:
        """Quadratic phases that count against the share of an owner."""
        members = [error for error in self.errors.stated if is_owed(error.subject.owner, owner, self.split)]
        own = [one for one in self.own if is_owed(one.owner, owner, self.split)]
        found = [(error.subject.id, self.errors.does(self.model, error).qpe) for error in members]
        return self._with(found, own, [(one.row_id, one.qpe_rad) for one in own])

    def all_cubics(self) -> Owed:
        """Cubic phases of motion, the clock, slow vibrations and sensors."""
        found = [(error.subject.id, self.errors.does(self.model, error).cubic) for error in self.motion]
        return self._with(found, self.own, [(one.row_id, one.cubic_rad) for one in self.own])

    def cubic_without_coverage(self, split: Split, owner: str) -> Floats:
        """Cubic phase of what counts against an owner's share, at the declared sigmas; as of `Together`. [rad]"""
        factor = self.errors.mission.allocation.coverage_factor
        found = [
            (error.subject.id, self.errors.does(self.model, error).cubic / (factor if error.is_covered else 1.0))
            for error in self.motion
            if is_owed(error.subject.owner, owner, split)
        ]
        found += [(one.row_id, one.cubic_rad / one.coverage) for one in self.own if is_owed(one.owner, owner, split)]
        return self.errors.array(combined_phase(found, self.rule_of_all, self.groups))

    @property
    def rule_of_all(self) -> str:
        """Rule by which all declared errors add up; as of `Together`."""
        return "rss" if self.rule == "each" else self.rule

    def _with(self, phases: Phases, own: Own, of_own: Phases) -> Owed:
        is_there = np.full(self.errors.cases, bool(phases))
        for one in own:
            is_there |= one.is_there
        return Owed([*phases, *of_own], is_there)

    def combined(self, phases: Phases, rule: str = "") -> Floats:
        """Combine phases by the mission's rule, or another; cases without any number are left out. [rad]"""
        found = self.errors.array(combined_phase(phases, rule or self.rule, self.groups))
        self.errors.is_left_out |= np.isnan(found)  # a covariance of which an error has no image
        return found

    def moved(self, rule: str) -> Floats:
        """Displacements combined by a rule. [m]"""
        does = {error.subject.id: self.errors.does(self.model, error) for error in self.motion}
        if rule != "sum":
            moves = {row_id: one.farthest for row_id, one in does.items()}
            return self.errors.array(combined_displacement(moves, rule, self.groups))
        ahead, back = (
            np.array([getattr(one, side) for one in does.values()]) for side in ("displacement", "opposite")
        )
        # Half of what lies between the signs, and once the rest, which all signs have in common.
        return largest_signed_sum(np.concatenate(((ahead - back) / 2, ((ahead + back) / 2).sum(axis=0)[None])))


def is_owed(whose: str, owner: str, split: Split) -> bool:
    """Whether somebody's errors count against the share of an owner; against the mission's all do."""
    return owner == "mission" or split.includes(whose, owner)


class Aggregates:
    """Rows of the declared errors together.

    Parameters
    ----------
    judging : Judging
        Of the cases.
    errors : DeclaredErrors
        Of the cases.
    together : mapping of str to ManyTogether
        The same by each model.
    limits : mapping of str to (cases,)
        Quadratic phase that each owner is held to, gain of autofocus included. [rad]
    gain : (cases,)
        Of autofocus.
    """

    def __init__(
        self,
        judging: Judging,
        errors: DeclaredErrors,
        together: Mapping[str, ManyTogether],
        limits: Mapping[str, Floats],
        gain: Floats,
    ) -> None:
        self.judging, self.errors, self.together, self.limits, self.gain = judging, errors, together, limits, gain
        self.combine = errors.mission.allocation.combine

    def rows(self, gating: str, other: str) -> Iterator[Judged]:
        """Rows of one model, which the other may doubt."""
        mine, theirs = self.together[gating], self.together[other]
        if self.combine != "each":
            yield from self._sums(mine, theirs)
        else:
            yield from self._all_together(mine)
        yield self._cubic(mine, theirs)
        yield self._location(mine, theirs)
        if self.errors.mission.autofocus.n_pull is not None:
            yield self._pull_in(mine, theirs)

    def _sums(self, mine: ManyTogether, theirs: ManyTogether) -> Iterator[Judged]:
        has_clock = mine.split.clock is not None  # else it counts with the receiver
        for owner in ("transmitter", "receiver", *(["clock"] if has_clock else []), "mission"):
            (phases, is_declared), what, limit = mine.owed(owner), subject(owner, QUADRATIC), self.limits[owner]
            qpe, by_other = mine.combined(phases), theirs.combined(theirs.owed(owner).phases)
            doubt = self.errors.doubts(theirs.model, by_other > limit * BOUND)
            judged = self._judged(what, qpe, limit, doubt=doubt, without_autofocus=qpe / limit * self.gain)
            yield judged.where(~is_declared, self.judging.row(what, None, limit))

    def _all_together(self, mine: ManyTogether) -> Iterator[Judged]:
        """A warning where each error stands alone and all together exceed the total; else there is no row."""
        phases, limit = mine.owed("mission").phases, self.limits["mission"]
        largest = mine.combined(phases, "each")
        is_there = (mine.combined(phases, "rss") > limit * BOUND) & (largest <= limit * BOUND)
        what = subject("mission", QUADRATIC)
        judged, nothing = self.judging.row(what, largest, limit, doubt=True), self.judging.row(what, None, None)
        yield judged.where(~is_there, nothing)

    def _cubic(self, mine: ManyTogether, theirs: ManyTogether) -> Judged:
        (phases, is_declared), what = mine.all_cubics(), subject("mission", CUBIC)
        limit, size = self._required(self.errors.mission.requirements.cubic_phase_error), mine.combined(phases)
        doubt: Any = False
        if limit is not None:
            by_other = theirs.combined(theirs.all_cubics().phases)
            doubt = self.errors.doubts(theirs.model, by_other > limit * BOUND)
            if self.combine == "each":
                doubt = doubt | (mine.combined(phases, "rss") > limit * BOUND)
        judged = self._judged(what, size, limit, doubt=doubt, is_info=limit is None)
        return judged._replace(cubic_rad=judged.declared, metric=CUBIC).where(
            ~is_declared, self.judging.row(what, None, limit)
        )

    def _location(self, mine: ManyTogether, theirs: ManyTogether) -> Judged:
        what, limit = subject("mission", LOCATION), self._required(self.errors.mission.requirements.location_error)
        if not mine.motion:
            return self.judging.row(what, None, limit)
        moved = mine.moved(self.combine)
        doubt: Any = False
        if limit is not None:
            doubt = self.errors.doubts(theirs.model, theirs.moved(self.combine) > limit * BOUND)
            if self.combine == "each":
                doubt = doubt | (mine.moved("rss") > limit * BOUND)
        judged = self.judging.row(what, moved, limit, doubt=doubt, is_info=limit is None)._replace(metric=LOCATION)
        nothing = self.judging.row(what, None, limit)
        nothing.status[:] = CODE["info" if limit is None else "not_evaluated"]
        return judged.where(np.isnan(moved), nothing)  # one of the errors has no image to place

    def _pull_in(self, mine: ManyTogether, theirs: ManyTogether) -> Judged:
        (phases, is_declared), what = mine.owed("mission"), subject("mission", "autofocus_pull_in")
        pull_in = self.errors.array(math.pi * np.asarray(effective_n_pull(self.errors.mission)))
        by_other = theirs.combined(theirs.owed("mission").phases, "sum")
        doubt = self.errors.doubts(theirs.model, by_other > pull_in * BOUND)
        total = mine.combined(phases, "sum")
        judged = self._judged(what, total, pull_in, doubt=doubt, never_fails=True)
        return judged.where(~is_declared, self.judging.row(what, None, pull_in, never_fails=True))

    def _judged(self, what: Subject, size: Floats, limit: Floats | None, **of_row: Any) -> Judged:
        """Judge a sum; one without a finite value fails, since one of its errors has no image at all."""
        judged = self.judging.row(what, size, limit, **of_row)
        is_endless = ~np.isfinite(size)
        if not is_endless.any():
            return judged
        nothing = self.judging.row(what, None, limit, never_fails=judged.never_fails)
        if not of_row.get("is_info"):
            nothing.status[:] = CODE["fail"]
        return judged.where(is_endless, nothing)

    def _required(self, value: Any) -> Floats | None:
        return None if value is None else self.errors.array(value)
