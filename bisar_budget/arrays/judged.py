"""Rows of many cases, judged at once: the arrays beside `budget`.

A case is judged as `check_mission` judges it, by the same formulas and searches. Where they do not hold it (a search
takes very many steps), the case is left out and says so.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from datetime import date
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget import evaluators
from bisar_budget.analysis.allocation import Allocation, Split, allocate
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.arrays.aggregates import Aggregates, ManyTogether, is_owed
from bisar_budget.arrays.collections import Geometries, norm
from bisar_budget.arrays.declared import DeclaredErrors
from bisar_budget.arrays.edge import HeldTogether, ManySceneEdges, many_scene_edges
from bisar_budget.arrays.error_rows import ErrorRows
from bisar_budget.arrays.instruments import many_random_errors
from bisar_budget.arrays.judgement import BOUND, CODE, Judging
from bisar_budget.arrays.random_rows import RandomRows
from bisar_budget.arrays.rim import ManyScenePhases
from bisar_budget.arrays.rows import Judged
from bisar_budget.arrays.shares import is_balanced, shares_of
from bisar_budget.arrays.together import ManyOwnPhases
from bisar_budget.arrays.vibrating import judged_one_by_one, many_slow_phases
from bisar_budget.budget.input_doubt import declared_position_error, is_in_doubt, least_doubt
from bisar_budget.budget.orbit import FASTEST_FLIGHT
from bisar_budget.budget.random_rows import spur_rows
from bisar_budget.budget.required import is_asked_for, missing_declarations
from bisar_budget.budget.vibration_rows import vibration_rows
from bisar_budget.budget.waivers import named_by
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.effects.subject import Subject, subject
from bisar_budget.findings.row import Row
from bisar_budget.findings.status import STATUS
from bisar_budget.mission.model import Mission

MODELS = ("published", "full")
_STATUSES = tuple(STATUS)


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
        self.judging = Judging(errors.cases, errors.mission.allocation.warn_above)
        self.random = many_random_errors(errors.mission, errors.geometries, errors.cases)
        self.stated_random = [error for error in self.random if error.declared is not None]

    def _own(self, model: str) -> list[ManyOwnPhases]:
        """Phases of what displaces nothing: slow vibrations, and the declared errors of sensors and clocks."""
        found = list(self.slow)
        for error in self.stated_random:
            quadratic, cubic, _ = (self.array(part * error.declared) for part in error.effect(model))
            always = np.ones(self.cases, dtype=bool)
            found.append(ManyOwnPhases(error.subject.id, error.subject.owner, quadratic, cubic, always))
        return found

    def checked(self) -> Checked:
        """Judge every row by the model that gates."""
        gating = self.mission.gating_model
        if gating != "published":  # searches start from what declared errors are known to do
            for error in self.errors.stated:
                self.does("full", error)
        gates = [model for model in MODELS if gating in (model, "strictest")]
        own = {model: self._own(model) for model in MODELS}
        self.split = shares_of(self.errors, gates, [own[model] for model in gates])
        total = self.array(self.mission.requirements.quadratic_phase_error)
        n_pull = self.mission.autofocus.n_pull
        self.gain = np.ones(self.cases)
        if n_pull is not None:
            self.gain = np.maximum(1.0, self.array(evaluators.autofocus_gain(n_pull, total)))  # type: ignore[arg-type]
        self.total = total
        owners = (*PLATFORMS, "clock", "mission")
        self.limits = {owner: self.array(self.split.of(owner) * total) * self.gain for owner in owners}
        together = {model: ManyTogether(self.errors, model, own[model], self.split) for model in MODELS}
        self.error_rows = ErrorRows(self.judging, self.errors, self.limits, self.gain, is_brief=self.is_brief)
        self.aggregates = Aggregates(self.judging, self.errors, together, self.limits, self.gain)
        by_model = [self._rows(model) for model in gates]
        rows = _stricter(*by_model) if len(by_model) > 1 else by_model[0]
        return Checked(
            tuple(self._waived(self._doubted(self._required(row))) for row in [*self._undeclared(rows), *rows]),
            self.errors.is_left_out,
            self._floor(),
            self.errors.geometries,
        )

    def _rows(self, gating: str) -> list[Judged]:
        other = "published" if gating == "full" else "full"
        rows = [*self.error_rows.rows(gating, other), *self._vibrations(gating)]
        rows += self._instruments(gating)
        rows += self.aggregates.rows(gating, other)
        if self.mission.scene.radius is not None:
            rows.append(self._spatial_variance(gating))
        return rows

    @property
    def _vibrates(self) -> bool:
        return any(one.sinusoidal or one.wideband for one in self.vibrations)

    def _vibrations(self, gating: str) -> list[Judged]:
        """Rows of vibrations, where one is declared or asked for."""
        if not self._vibrates and not any(what.kind == "vibration" for what in self.errors.shown.values()):
            return []
        return self._one_by_one(lambda mission, allocation: vibration_rows(mission, allocation, gating))

    def _one_by_one(self, rows_of: Callable[[Mission, Allocation], Iterable[Row]]) -> list[Judged]:
        """Rows that follow from the wavelength, the aperture time, the lines of sight and the shares alone."""
        balanced = [self.array(self.split.of(name)) for name in PLATFORMS] if is_balanced(self.mission) else []

        def of_case(place: int) -> Iterable[Row]:
            mission = self.one(place)
            allocation = allocate(mission, (), {})
            if balanced:
                allocation = allocation._replace(qpe=Split(*(float(share[place]) for share in balanced)))
            return rows_of(mission, allocation)

        return judged_one_by_one(np.flatnonzero(~self.errors.is_left_out), self.cases, of_case)

    def _instruments(self, gating: str) -> Iterator[Judged]:
        """Rows of sensors and clocks, which few missions name."""
        if not self.random:
            return
        islr = allocate(self.mission, (), {}).islr
        rows = RandomRows(
            self.judging, self.mission, self.errors.geometries, self.random, self.limits, self.gain, islr
        )
        yield from rows.rows(gating)
        oscillators = [getattr(self.mission.platforms, name).oscillator for name in PLATFORMS]
        if any(one is not None and one.spurs for one in oscillators):
            yield from self._one_by_one(lambda mission, allocation: spur_rows(Analysis(mission), gating, allocation))
        yield from rows.islr_rows(gating)

    @cached_property
    def _edges(self) -> ManySceneEdges | None:
        """What the edges of the scenes add; none without a declared error."""
        phases = ManyScenePhases(self.errors)
        if not phases.members:
            return None
        owners = [error.subject.owner for error in phases.members]
        if self.combine == "each":
            held = [HeldTogether([i], self.limits[owner]) for i, owner in enumerate(owners)]
        else:
            held = [
                HeldTogether([i for i, one in enumerate(owners) if is_owed(one, owner, self.split)], limit)
                for owner, limit in self.limits.items()
            ]
        return many_scene_edges(phases, held)

    def _spatial_variance(self, gating: str) -> Judged:
        """Row of the scene's edge; to the published model an error is the same all over the scene."""
        what, edges = subject("mission", "spatial_variance"), self._edges
        allowable = None if gating == "published" else self.total
        if edges is None:
            return self.judging.row(what, None, allowable)
        doubt = edges.has_doubt
        if gating == "published":
            doubt = doubt | (edges.difference > self.total * BOUND)
        judged = self.judging.row(what, edges.difference, allowable, doubt=doubt)
        judged = judged._replace(qpe_published_rad=np.zeros(self.cases))
        nothing = self.judging.row(what, None, allowable)
        nothing.status[:] = CODE["not_evaluated"]
        return judged.where(np.isinf(edges.difference), nothing)

    def _waived(self, row: Judged) -> Judged:
        """Waive a row where it fails and a waiver that holds names it."""
        names = [row.subject.id]
        if not any(self.today <= one.until and named_by(one.id, names) for one in self.mission.waivers):
            return row
        return row._replace(status=np.where(row.status == CODE["fail"], CODE["waived"], row.status))

    def _required(self, row: Judged) -> Judged:
        """Turn a row that the file should declare and does not from `not_declared` into `not_evaluated`."""
        if not any(is_asked_for(row.subject, one) for one in missing_declarations(self.mission)):
            return row
        is_missing = row.status == CODE["not_declared"]
        return row._replace(status=np.where(is_missing, CODE["not_evaluated"], row.status))

    @cached_property
    def _in_doubt(self) -> dict[str, NDArray[np.bool_]]:
        """Platforms with a path, and in which cases that is in doubt by more than the file declares."""
        found = {}
        for name in PLATFORMS:
            platform = getattr(self.mission.platforms, name)
            if platform.path is not None:
                least = least_doubt(platform.path, declared_position_error(platform.motion_error))
                found[name] = platform.path.doubt_m > self.array(least)
        return found

    def _doubted(self, row: Judged) -> Judged:
        """Turn a row of a position error of a path in doubt into `not_evaluated`; one that fails stays so."""
        for name, is_doubtful in self._in_doubt.items():
            if is_in_doubt(row.subject, name, self.mission):
                is_open = is_doubtful & (row.status != CODE["fail"])
                row = row._replace(status=np.where(is_open, CODE["not_evaluated"], row.status))
        return row

    def _undeclared(self, rows: Sequence[Judged]) -> Iterator[Judged]:
        """Rows of position errors that nobody declared, of paths in doubt: they are not evaluated."""
        known = {row.subject.id for row in rows}
        for name, is_doubtful in self._in_doubt.items():
            own = [subject(name, "position", axis) for axis in "xyz"]
            if is_doubtful.any():
                yield from (
                    Judged.of_none(one, self.cases)
                    for one in own
                    if one.id not in known and is_in_doubt(one, name, self.mission)
                )

    def _floor(self) -> NDArray[np.int8]:
        """Best status that each case can have: paths may be in doubt, and errors missing that must be declared."""
        floor = np.full(self.cases, CODE["pass"])
        for name, path in zip(
            PLATFORMS, (self.errors.geometries.transmitter, self.errors.geometries.receiver), strict=True
        ):
            platform = getattr(self.mission.platforms, name)
            if platform.path is not None and platform.path.doubts:
                floor[~self._in_doubt[name] | bool(platform.path.samples)] = CODE["warn"]
            if platform.acceleration is None and not platform.is_of_the_earth:
                floor[np.broadcast_to(norm(path.velocity) > FASTEST_FLIGHT, floor.shape)] = CODE["warn"]
        if not (self.errors.stated or self._vibrates or self.stated_random) or any(
            missing_declarations(self.mission)
        ):
            floor[:] = CODE["not_evaluated"]
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
