"""Rows of many cases, judged at once: the arrays beside `budget`.

A case is judged as `check_mission` judges it, by the same formulas and searches. Where they do not hold it (a
declared error leaves no image, a search takes very many steps), the case is left out and says so.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import date
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget import evaluators
from bisar_budget.analysis.allocation import BALANCED_RANGE, EQUAL, Allocation, Split, allocate
from bisar_budget.arrays.collections import Floats, Geometries, norm
from bisar_budget.arrays.declared import DeclaredErrors, ManyErrors
from bisar_budget.arrays.edge import HeldTogether, ManySceneEdges, many_scene_edges
from bisar_budget.arrays.rim import ManyScenePhases
from bisar_budget.arrays.rows import REQUIREMENTS, Judged
from bisar_budget.arrays.together import (
    Phases,
    combined_displacement,
    combined_phase,
    largest_signed_sum,
    many_correlated,
)
from bisar_budget.arrays.vibrating import judged_vibrations, many_slow_phases
from bisar_budget.budget.orbit import FASTEST_FLIGHT
from bisar_budget.budget.required import missing_declarations
from bisar_budget.budget.waivers import named_by
from bisar_budget.constants import UTILIZATION_TOLERANCE
from bisar_budget.effects import models
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.effects.models import CUBIC, LOCATION, QUADRATIC
from bisar_budget.effects.subject import Subject, subject
from bisar_budget.findings.status import RANK, STATUS
from bisar_budget.mission.model import MetricSplits, Mission, Shares

_BOUND = 1 + UTILIZATION_TOLERANCE
_STATUSES = tuple(STATUS)
_CODE = {name: np.int8(rank) for name, rank in RANK.items()}


class Checked(NamedTuple):
    """Rows of many cases, and which of the cases are not certain; `floor` is the best status that a case can have."""

    rows: tuple[Judged, ...]
    is_left_out: NDArray[np.bool_]
    floor: NDArray[np.int8]
    geometries: Geometries


def check_arrays(
    mission: Mission,
    cases: int,
    today: date,
    nodes: int,
    geometries: Geometries,
    shown: Mapping[str, Subject],
    one: Callable[[int], Mission],
    *,
    is_brief: bool,
) -> Checked:
    """Check cases that need the same number of nodes.

    Parameters
    ----------
    mission : Mission
        Some of its numbers are arrays (cases,).
    cases : int
        How many.
    today : date
        Day on which waivers are judged, UTC.
    nodes : int
        Of the aperture, that all of them need.
    geometries : Geometries
        Of the mission.
    shown : mapping of str to Subject
        Rows, by id, of which the allowable is asked though nothing is declared.
    one : callable
        Gives the mission of one case, with its numbers.
    is_brief : bool
        Search for limits as a brief check does: in an order that finds the one that binds early.
    """
    return _Check(DeclaredErrors(mission, cases, nodes, geometries, shown), today, one, is_brief).checked()


class _Check:
    def __init__(self, errors: DeclaredErrors, today: date, one: Callable[[int], Mission], is_brief: bool) -> None:
        self.one, self.is_brief = one, is_brief
        platforms = [getattr(errors.mission.platforms, name) for name in PLATFORMS]
        self.vibrations = [platform.motion_error.vibration for platform in platforms]
        has_lines = any(vibration.sinusoidal for vibration in self.vibrations)
        self.slow = many_slow_phases(errors.cases, one) if has_lines else []
        self.errors, self.mission, self.cases, self.today = errors, errors.mission, errors.cases, today
        self.array, self.does, self.combine = errors.array, errors.does, errors.mission.allocation.combine
        self.groups = many_correlated(errors.mission)

    # ---------------------------------------------------------------- limits
    def _allowed(self, model: str, error: ManyErrors, limit: Floats) -> tuple[Floats, NDArray[np.int8]]:
        """How large an error may be by a model, and the requirement that sets it: smallest size, NaN where none."""
        needs = self.mission.requirements
        held = [(QUADRATIC, limit)]
        if error.is_motion:
            others = ((CUBIC, needs.cubic_phase_error), (LOCATION, needs.location_error))
            held += [(name, self.array(required)) for name, required in others if required is not None]
        smalls = []
        for name, required in held:
            per_unit = self.array(self.errors.per_unit(model, error, name))
            with np.errstate(all="ignore"):
                smalls.append(np.where(per_unit > 0, required / per_unit, math.inf))
        order = np.argsort(smalls, axis=0, kind="stable")  # the one that binds is likely to be found first
        if not self.is_brief:
            order = np.broadcast_to(np.arange(len(held))[:, None], order.shape)
        smallest, binding = np.full(self.cases, math.inf), np.full(self.cases, -1, dtype=np.int8)
        is_linear = model == "published" or not error.is_motion
        for turn in range(len(held)):
            for place, (name, required) in enumerate(held):
                mine = order[turn] == place
                if not mine.any():
                    continue
                is_whole = name == QUADRATIC and not self.is_brief
                small, upto = smalls[place], math.inf if is_whole else smallest
                sized = small
                if not is_linear:
                    farthest = self.array(
                        np.minimum(upto, np.maximum(self.errors.farthest(error), self._size(error)))
                    )
                    first = np.minimum(small, farthest)
                    with np.errstate(invalid="ignore"):
                        is_sure = self.errors.adds(error, first, name) <= models.SHARE * required
                    sized = np.where(small > farthest, math.inf, small)
                    some = np.flatnonzero(mine & ~is_sure & ~self.errors.is_left_out)
                    if some.size:
                        sized[some] = self.errors.first_reaching(error, name, required, first, farthest, some)
                is_less = mine & (sized < smallest)
                smallest = np.where(is_less, sized, smallest)
                binding[is_less] = REQUIREMENTS.index(name)
        smallest[~np.isfinite(smallest)] = math.nan
        return smallest, binding

    def _size(self, error: ManyErrors) -> Any:
        return 0.0 if error.declared is None else np.abs(error.declared)

    def _split(self, gating: str) -> Split:
        """Shares of the phase; `balanced` are arrays."""
        split = self.mission.allocation.split
        if isinstance(split, MetricSplits):
            split = split.quadratic_phase_error
        if isinstance(split, Shares):
            return Split(split.transmitter, split.receiver, split.clock, split.reserve)
        if split != "balanced":
            return EQUAL
        by = [model for model in ("published", "full") if gating in (model, "strictest")]
        weight = []
        for owner in PLATFORMS:
            members = []
            for error in self.errors.stated:
                if EQUAL.includes(error.subject.owner, owner):
                    phases = np.array([self.does(model, error).qpe for model in by])
                    largest = np.abs(phases).argmax(axis=0)
                    members.append((error.subject.id, np.take_along_axis(phases, largest[None], axis=0)[0]))
            members += [(one.row_id, one.qpe) for one in self.slow if one.owner == owner]
            weight.append(np.minimum(self._combined(members), 1e300))
        with np.errstate(all="ignore"):
            share: Any = np.where(sum(weight) == 0, 0.5, np.clip(weight[0] / sum(weight), *BALANCED_RANGE))
        return Split(transmitter=share, receiver=1 - share)

    def _combined(self, phases: Phases, rule: str = "") -> Floats:
        """Combine phases by the mission's rule, or another."""
        return self.array(combined_phase(phases, rule or self.combine, self.groups))

    # ---------------------------------------------------------------- rows
    def checked(self) -> Checked:
        """Judge every row by the model that gates."""
        gating = self.mission.gating_model
        if gating != "published":  # searches start from what declared errors are known to do
            for error in self.errors.stated:
                self.does("full", error)
        self.split = self._split(gating)
        total = self.array(self.mission.requirements.quadratic_phase_error)
        n_pull = self.mission.autofocus.n_pull
        self.gain = np.ones(self.cases)
        if n_pull is not None:
            self.gain = np.maximum(1.0, self.array(evaluators.autofocus_gain(n_pull, total)))  # type: ignore[arg-type]
        self.total = total
        by_model = [self._rows(model) for model in ("published", "full") if gating in (model, "strictest")]
        rows = _stricter(*by_model) if len(by_model) > 1 else by_model[0]
        return Checked(tuple(map(self._waived, rows)), self.errors.is_left_out, self._floor(), self.errors.geometries)

    def _rows(self, gating: str) -> list[Judged]:
        other = "published" if gating == "full" else "full"
        rows = []
        for error in self.errors.listed:
            rows.append(self._row(gating, other, error))
            if gating == "full" or self.mission.gating_model == "published":
                self.errors.forget(error)
        rows += self._vibrations(gating)
        if self.combine != "each":
            rows += self._sums(gating, other)
        else:
            rows += self._all_together(gating)
        rows += [self._cubic(gating, other), self._location(gating, other)]
        if self.mission.autofocus.n_pull is not None:
            rows.append(self._pull_in(gating, other))
        if self.mission.scene.radius is not None:
            rows.append(self._spatial_variance(gating))
        return rows

    @property
    def _vibrates(self) -> bool:
        return any(one.sinusoidal or one.wideband for one in self.vibrations)

    def _vibrations(self, gating: str) -> list[Judged]:
        """Rows of vibrations, where one is declared or asked for."""
        asked = any(what.kind == "vibration" for what in self.errors.shown.values())
        if not self._vibrates and not asked:
            return []
        shares = [self.array(self.split.of(name)) for name in PLATFORMS]

        def of_case(place: int) -> tuple[Mission, Allocation]:
            mission = self.one(place)
            split = self.split._replace(transmitter=float(shares[0][place]), receiver=float(shares[1][place]))
            return mission, allocate(mission, (), {})._replace(qpe=split)

        return judged_vibrations(np.flatnonzero(~self.errors.is_left_out), self.cases, of_case, gating)

    def _held(self, owner: str) -> Floats:
        """Quadratic phase that an owner is held to, gain of autofocus included. [rad]"""
        return self.array(self.split.of(owner) * self.total) * self.gain

    def _row(self, gating: str, other: str, error: ManyErrors) -> Judged:
        limit = self._held(error.subject.owner)
        allowable, binding = self._allowed(gating, error, limit)
        if other == "full" and not self.is_brief and self.mission.gating_model != "published":
            self._allowed(other, error, limit)  # a whole check asks for it here, and a later search starts from it
        none = np.full(self.cases, math.nan)
        if error.declared is None:
            return self._judged(error.subject, None, allowable)._replace(binding=binding)
        mine, theirs = self.does(gating, error), self.does(other, error)
        published = mine if gating == "published" else theirs
        needs = self.mission.requirements
        held = [(np.abs(theirs.qpe), limit)]
        if error.is_motion:
            moved = np.hypot(*theirs.farthest)
            others = ((np.abs(theirs.cubic), needs.cubic_phase_error), (moved, needs.location_error))
            held += [(size, self.array(required)) for size, required in others if required is not None]
        doubt = np.any([size / required > _BOUND for size, required in held], axis=0)
        judged = self._judged(
            error.subject,
            np.abs(self.array(error.declared)),
            allowable,
            doubt=doubt,
            without_autofocus=np.where(self.gain > 1, np.abs(mine.qpe) / (limit / self.gain), 0.0),
            is_info=self.combine != "each" or error.is_shown_again,
        )
        cubic = np.abs(mine.cubic) if error.is_motion else none
        return judged._replace(binding=binding, qpe_published_rad=np.abs(published.qpe), cubic_rad=cubic)

    def _judged(
        self,
        what: Subject,
        declared: Floats | None,
        allowable: Floats | None,
        *,
        doubt: Any = False,
        without_autofocus: Any = 0.0,
        is_info: bool = False,
        never_fails: bool = False,
    ) -> Judged:
        """Judge a row, as `judgement` does: the first status that applies."""
        none = np.full(self.cases, math.nan)
        allowed = none if allowable is None else allowable
        unknown = np.full(self.cases, -1, dtype=np.int8)
        if declared is None:
            status = np.full(self.cases, _CODE["not_declared"])
            return Judged(what, status, none, allowed, none, unknown, none, none, never_fails)
        with np.errstate(all="ignore"):
            use = np.where(np.isnan(allowed), 0.0, declared / allowed)
        if is_info:
            status = np.full(self.cases, _CODE["info"])
        else:
            status = np.select(
                [
                    use > _BOUND,
                    np.broadcast_to(doubt, (self.cases,)),
                    np.broadcast_to(without_autofocus > _BOUND, (self.cases,)),
                    use > self.mission.allocation.warn_above,
                ],
                [
                    _CODE["warn" if never_fails else "fail"],
                    _CODE["warn"],
                    _CODE["pass_with_autofocus"],
                    _CODE["warn"],
                ],
                _CODE["pass"],
            ).astype(np.int8)
        return Judged(what, status, declared, allowed, use, unknown, none, none, never_fails)

    def _members(self, owner: str) -> list[ManyErrors]:
        return [error for error in self.errors.stated if self._is_owed(error, owner)]

    def _is_owed(self, error: ManyErrors, owner: str) -> bool:
        """Whether an error counts against the share of an owner; against the mission's all do."""
        return owner == "mission" or self.split.includes(error.subject.owner, owner)

    def _counts(self, members: Sequence[ManyErrors], own: Phases) -> bool:
        """Whether anything is declared that counts; cases in which vibrations alone may, or may not, are left out."""
        if own and not members:
            self.errors.is_left_out[:] = True
        return bool(members)

    def _phases(
        self, model: str, errors: Sequence[ManyErrors], *, is_cubic: bool = False
    ) -> list[tuple[str, Floats]]:
        does = [(error.subject.id, self.does(model, error)) for error in errors]
        return [(row_id, one.cubic if is_cubic else one.qpe) for row_id, one in does]

    def _sums(self, gating: str, other: str) -> Iterator[Judged]:
        owners = ["transmitter", "receiver", *(["clock"] if self.split.clock is not None else []), "mission"]
        for owner in owners:
            members, what = self._members(owner), subject(owner, QUADRATIC)
            limit = self._held(owner)
            own = [
                (one.row_id, one.qpe)
                for one in self.slow
                if owner == "mission" or self.split.includes(one.owner, owner)
            ]
            if not self._counts(members, own):
                yield self._judged(what, None, limit)
                continue
            qpe, by_other = (self._combined([*self._phases(model, members), *own]) for model in (gating, other))
            yield self._judged(
                what, qpe, limit, doubt=by_other > limit * _BOUND, without_autofocus=qpe / limit * self.gain
            )

    def _all_together(self, gating: str) -> Iterator[Judged]:
        """A warning where each error stands alone and all together exceed the total; else there is no row."""
        own = [(one.row_id, one.qpe) for one in self.slow]
        if not self._counts(self.errors.stated, own):
            return
        phases = [*self._phases(gating, self.errors.stated), *own]
        limit = self.total * self.gain
        largest = self._combined(phases, "each")
        is_there = (self._combined(phases, "rss") > limit * _BOUND) & (largest <= limit * _BOUND)
        what = subject("mission", QUADRATIC)
        judged, nothing = self._judged(what, largest, limit, doubt=True), self._judged(what, None, None)
        yield judged.where(~is_there, nothing)

    def _cubic(self, gating: str, other: str) -> Judged:
        motion, what = [error for error in self.errors.stated if error.is_motion], subject("mission", CUBIC)
        limit = self.mission.requirements.cubic_phase_error
        own = [(one.row_id, one.cubic) for one in self.slow]
        if not self._counts(motion, own):
            return self._judged(what, None, None if limit is None else self.array(limit))
        phases = [*self._phases(gating, motion, is_cubic=True), *own]
        size = self._combined(phases)
        if limit is None:
            return self._judged(what, size, None, is_info=True)._replace(cubic_rad=size)
        doubt = self._combined([*self._phases(other, motion, is_cubic=True), *own]) > limit * _BOUND
        if self.combine == "each":
            doubt = doubt | (self._combined(phases, "rss") > limit * _BOUND)
        return self._judged(what, size, self.array(limit), doubt=doubt)._replace(cubic_rad=size, metric=CUBIC)

    def _location(self, gating: str, other: str) -> Judged:
        motion, what = [error for error in self.errors.stated if error.is_motion], subject("mission", LOCATION)
        limit = self.mission.requirements.location_error
        if not motion:
            return self._judged(what, None, None if limit is None else self.array(limit))
        moved = self._moved(gating, motion, self.combine)
        if limit is None:
            return self._judged(what, moved, None, is_info=True)
        doubt = self._moved(other, motion, self.combine) > limit * _BOUND
        if self.combine == "each":
            doubt = doubt | (self._moved(gating, motion, "rss") > limit * _BOUND)
        return self._judged(what, moved, self.array(limit), doubt=doubt)._replace(metric=LOCATION)

    def _moved(self, model: str, motion: Sequence[ManyErrors], rule: str) -> Floats:
        """Displacements combined by a rule. [m]"""
        if rule != "sum":
            moves = {error.subject.id: self.does(model, error).farthest for error in motion}
            return self.array(combined_displacement(moves, rule, self.groups))
        found = [self.does(model, error) for error in motion]
        parts = np.array(
            [
                [(ahead - back) / 2 for ahead, back in zip(one.displacement, one.opposite, strict=True)]
                for one in found
            ]
        )
        rest = sum(
            np.array([(ahead + back) / 2 for ahead, back in zip(one.displacement, one.opposite, strict=True)])
            for one in found
        )
        return largest_signed_sum(np.concatenate((parts, np.asarray(rest)[None])))

    def _pull_in(self, gating: str, other: str) -> Judged:
        what, pull_in = subject("mission", "autofocus_pull_in"), math.pi * self.array(self.mission.autofocus.n_pull)
        own = [(one.row_id, one.qpe) for one in self.slow]
        if not self._counts(self.errors.stated, own):
            return self._judged(what, None, pull_in, never_fails=True)
        phases = ([*self._phases(model, self.errors.stated), *own] for model in (gating, other))
        total, by_other = (self._combined(of, "sum") for of in phases)
        return self._judged(what, total, pull_in, doubt=by_other > pull_in * _BOUND, never_fails=True)

    @cached_property
    def _edges(self) -> ManySceneEdges | None:
        """What the edges of the scenes add; none without a declared error."""
        phases = ManyScenePhases(self.errors)
        if not phases.members:
            return None
        if self.combine == "each":
            held = [HeldTogether([i], self._held(error.subject.owner)) for i, error in enumerate(phases.members)]
        else:
            held = [
                HeldTogether([i for i, error in enumerate(phases.members) if self._is_owed(error, owner)], limit)
                for owner in (*PLATFORMS, "clock", "mission")
                for limit in [self._held(owner)]
            ]
        return many_scene_edges(phases, held)

    def _spatial_variance(self, gating: str) -> Judged:
        """Row of the scene's edge; to the published model an error is the same all over the scene."""
        what, edges = subject("mission", "spatial_variance"), self._edges
        allowable = None if gating == "published" else self.total
        if edges is None:
            return self._judged(what, None, allowable)
        doubt = edges.has_doubt
        if gating == "published":
            doubt = doubt | (edges.difference > self.total * _BOUND)
        judged = self._judged(what, edges.difference, allowable, doubt=doubt)
        judged = judged._replace(qpe_published_rad=np.zeros(self.cases))
        nothing = self._judged(what, None, allowable)
        nothing.status[:] = _CODE["not_evaluated"]
        return judged.where(np.isinf(edges.difference), nothing)

    def _waived(self, row: Judged) -> Judged:
        """Waive a row where it fails and a waiver that holds names it."""
        names = [row.subject.id]
        if not any(self.today <= one.until and named_by(one.id, names) for one in self.mission.waivers):
            return row
        return row._replace(status=np.where(row.status == _CODE["fail"], _CODE["waived"], row.status))

    def _floor(self) -> NDArray[np.int8]:
        """Best status that each case can have: paths may be in doubt, and errors missing that must be declared."""
        floor = np.full(self.cases, _CODE["pass"])
        for name, path in zip(
            PLATFORMS, (self.errors.geometries.transmitter, self.errors.geometries.receiver), strict=True
        ):
            platform = getattr(self.mission.platforms, name)
            if platform.path is not None and platform.path.doubts:
                floor[:] = _CODE["warn"]
            if platform.acceleration is None and not platform.is_of_the_earth:
                floor[np.broadcast_to(norm(path.velocity) > FASTEST_FLIGHT, floor.shape)] = _CODE["warn"]
        if not (self.errors.stated or self._vibrates) or any(missing_declarations(self.mission)):
            floor[:] = _CODE["not_evaluated"]
        return floor


def _stricter(published: Sequence[Judged], full: Sequence[Judged]) -> list[Judged]:
    """Of two complete checks each row of the stricter verdict, then of the higher utilization."""
    found, of_full = [], {row.subject.id: row for row in full}
    for one in published:
        other = of_full.pop(one.subject.id, None) or Judged.of_none(one.subject, one.status.size)
        use = [np.nan_to_num(row.utilization, nan=0.0) for row in (one, other)]
        size = [np.where(np.isnan(row.allowable), math.inf, row.allowable) for row in (one, other)]
        is_other = other.status < one.status
        tie = other.status == one.status
        is_other |= tie & (use[1] > use[0])
        is_other |= tie & (use[1] == use[0]) & (size[1] <= size[0])
        found.append(one.where(is_other, other))
    return [*found, *of_full.values()]


def statuses(codes: NDArray[np.int8]) -> NDArray[np.object_]:
    """Names of statuses by their codes."""
    return np.array(_STATUSES, dtype=object)[codes]


Read = Callable[[Judged], Any]
_FIELDS: dict[str, Read] = {
    "status": lambda row: statuses(row.status),
    "declared": lambda row: row.declared,
    "allowable": lambda row: row.allowable,
    "utilization": lambda row: row.utilization,
    "margin": lambda row: row.margin,
    "qpe_published_rad": lambda row: row.qpe_published_rad,
    "cubic_rad": lambda row: row.cubic_rad,
}
FIELDS = tuple(_FIELDS)


def field(row: Judged, name: str) -> Any:
    """One field of a row, (cases,)."""
    return _FIELDS[name](row)
