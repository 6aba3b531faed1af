"""What the declared errors of many cases add up to: the arrays beside `budget.aggregates` and `analysis.together`."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from bisar_budget.analysis.allocation import Split
from bisar_budget.arrays.collections import Floats
from bisar_budget.arrays.declared import DeclaredErrors
from bisar_budget.arrays.judgement import BOUND, Judging
from bisar_budget.arrays.rows import Judged
from bisar_budget.arrays.together import (
    ManyOwnPhases,
    Phases,
    combined_displacement,
    combined_phase,
    largest_signed_sum,
    many_correlated,
)
from bisar_budget.effects.models import CUBIC, LOCATION, QUADRATIC
from bisar_budget.effects.subject import subject

Own = Sequence[ManyOwnPhases]


class ManyTogether:
    """Declared errors of many cases by one model; as `Together`."""

    def __init__(self, errors: DeclaredErrors, model: str, own: Own, split: Split) -> None:
        self.errors, self.model, self.own, self.split = errors, model, own, split
        self.motion = [error for error in errors.stated if error.is_motion]
        self.rule, self.groups = errors.mission.allocation.combine, many_correlated(errors.mission)

    def owed(self, owner: str) -> Phases:
        """Quadratic phases that count against the share of an owner; none where nothing is declared that does."""
        members = [error for error in self.errors.stated if is_owed(error.subject.owner, owner, self.split)]
        own = [one for one in self.own if is_owed(one.owner, owner, self.split)]
        found = [(error.subject.id, self.errors.does(self.model, error).qpe) for error in members]
        return self._counted(found, own, [(one.row_id, one.qpe) for one in own])

    def all_cubics(self) -> Phases:
        """Cubic phases of motion, the clock, slow vibrations and sensors."""
        found = [(error.subject.id, self.errors.does(self.model, error).cubic) for error in self.motion]
        return self._counted(found, self.own, [(one.row_id, one.cubic) for one in self.own])

    def _counted(self, phases: Phases, own: Own, of_own: Phases) -> Phases:
        """All of them; cases in which slow vibrations alone count, or do not, are left out."""
        if phases or any(one.is_in_every_case for one in own):
            return [*phases, *of_own]
        if own:
            self.errors.is_left_out[:] = True
        return []

    def combined(self, phases: Phases, rule: str = "") -> Floats:
        """Combine phases by the mission's rule, or another. [rad]"""
        return self.errors.array(combined_phase(phases, rule or self.rule, self.groups))

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
            phases, what, limit = mine.owed(owner), subject(owner, QUADRATIC), self.limits[owner]
            if not phases:
                yield self.judging.row(what, None, limit)
                continue
            qpe, by_other = mine.combined(phases), theirs.combined(theirs.owed(owner))
            doubt = self.errors.doubts(theirs.model, by_other > limit * BOUND)
            yield self.judging.row(what, qpe, limit, doubt=doubt, without_autofocus=qpe / limit * self.gain)

    def _all_together(self, mine: ManyTogether) -> Iterator[Judged]:
        """A warning where each error stands alone and all together exceed the total; else there is no row."""
        phases, limit = mine.owed("mission"), self.limits["mission"]
        if not phases:
            return
        largest = mine.combined(phases, "each")
        is_there = (mine.combined(phases, "rss") > limit * BOUND) & (largest <= limit * BOUND)
        what = subject("mission", QUADRATIC)
        judged, nothing = self.judging.row(what, largest, limit, doubt=True), self.judging.row(what, None, None)
        yield judged.where(~is_there, nothing)

    def _cubic(self, mine: ManyTogether, theirs: ManyTogether) -> Judged:
        phases, what = mine.all_cubics(), subject("mission", CUBIC)
        limit = self._required(self.errors.mission.requirements.cubic_phase_error)
        if not phases:
            return self.judging.row(what, None, limit)
        size = mine.combined(phases)
        if limit is None:
            return self.judging.row(what, size, None, is_info=True)._replace(cubic_rad=size)
        doubt = self.errors.doubts(theirs.model, theirs.combined(theirs.all_cubics()) > limit * BOUND)
        if self.combine == "each":
            doubt = doubt | (mine.combined(phases, "rss") > limit * BOUND)
        return self.judging.row(what, size, limit, doubt=doubt)._replace(cubic_rad=size, metric=CUBIC)

    def _location(self, mine: ManyTogether, theirs: ManyTogether) -> Judged:
        what, limit = subject("mission", LOCATION), self._required(self.errors.mission.requirements.location_error)
        if not mine.motion:
            return self.judging.row(what, None, limit)
        moved = mine.moved(self.combine)
        if limit is None:
            return self.judging.row(what, moved, None, is_info=True)
        doubt = self.errors.doubts(theirs.model, theirs.moved(self.combine) > limit * BOUND)
        if self.combine == "each":
            doubt = doubt | (mine.moved("rss") > limit * BOUND)
        return self.judging.row(what, moved, limit, doubt=doubt)._replace(metric=LOCATION)

    def _pull_in(self, mine: ManyTogether, theirs: ManyTogether) -> Judged:
        what, phases = subject("mission", "autofocus_pull_in"), mine.owed("mission")
        pull_in = self.errors.array(math.pi * np.asarray(self.errors.mission.autofocus.n_pull))
        if not phases:
            return self.judging.row(what, None, pull_in, never_fails=True)
        total, by_other = (one.combined(one.owed("mission"), "sum") for one in (mine, theirs))
        doubt = self.errors.doubts(theirs.model, by_other > pull_in * BOUND)
        return self.judging.row(what, total, pull_in, doubt=doubt, never_fails=True)

    def _required(self, value: Any) -> Floats | None:
        return None if value is None else self.errors.array(value)
