"""All rows of many cases of a mission, judged together by the formulas and searches of a check."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import date
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.analysis.allocation import allocate
from bisar_budget.analysis.scene import SceneEdges, scene_edges
from bisar_budget.analysis.spread import tones
from bisar_budget.analysis.together import Together
from bisar_budget.budget.aggregates import Aggregates, effect_parts, effect_totals, misplacing
from bisar_budget.budget.error_rows import ErrorRows
from bisar_budget.budget.input_doubt import declared_position_error, is_in_doubt, least_doubt
from bisar_budget.budget.judged_rows import CODE, Judged, Judging
from bisar_budget.budget.orbit import FASTEST_FLIGHT
from bisar_budget.budget.random_rows import RandomRows
from bisar_budget.budget.required import DECLARATIONS, Missing, is_asked_for, missing_declarations
from bisar_budget.budget.requirement_states import (
    KEYS,
    RequirementState,
    SeenRow,
    requirement_states,
    status_of,
    untaken_effects,
)
from bisar_budget.budget.scene_row import judged_edge
from bisar_budget.budget.vibration_rows import Vibrations, judged_pslr, judged_spurs
from bisar_budget.budget.waivers import is_waived
from bisar_budget.effects.declared import LOCATION, MODELS, DeclaredErrors
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.effects.random_errors import random_errors
from bisar_budget.effects.subject import Subject, subject
from bisar_budget.effects.vibration import slow_phases
from bisar_budget.findings.row import DECLARE
from bisar_budget.findings.status import STATUS
from bisar_budget.geometry import BistaticGeometry, norm
from bisar_budget.mission.model import Mission
from bisar_budget.ranges.exact_ranges import ExactRanges

_STATUSES = tuple(STATUS)
_BROKEN = [CODE["fail"], CODE["not_evaluated"]]  # what a waiver covers


class Checked(NamedTuple):
    """Rows of many cases; `floor` is the best status that a case can have."""

    rows: tuple[Judged, ...]
    floor: NDArray[np.int8]
    geometries: BistaticGeometry
    requirements: tuple[RequirementState, ...]


def check_arrays(
    mission: Mission,
    cases: int,
    today: date,
    nodes: int,
    geometries: BistaticGeometry,
    shown: Mapping[str, Subject],
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
    geometries : BistaticGeometry
        Of the mission.
    shown : mapping of str to Subject
        Rows, by id, of which the allowable is asked though nothing is declared.
    """
    T, is_heard = mission.collection.aperture_time, mission.has_direct_path
    exact = ExactRanges.of(geometries.both, mission.radar.wavelength, T, nodes, cases, has_direct_path=is_heard)
    return _Check(DeclaredErrors(mission, cases, geometries, exact, shown), today, shown).checked()


class _Check:
    def __init__(self, errors: DeclaredErrors, today: date, shown: Mapping[str, Subject]) -> None:
        self.shown = shown
        platforms = [getattr(errors.mission.platforms, name) for name in PLATFORMS]
        self.vibrations = [platform.motion_error.vibration for platform in platforms]
        self.errors, self.mission, self.cases, self.today = errors, errors.mission, errors.cases, today
        self.array, self.does, self.combine = errors.array, errors.does, errors.mission.allocation.combine
        self.judging = Judging(errors.cases, errors.mission.allocation.warn_above)
        self.random = random_errors(errors.mission, errors.geometries, errors.cases)
        self.tones = tones(self.mission, errors.geometries)
        self.stated_random = [error for error in self.random if error.declared is not None]

    def checked(self) -> Checked:
        """Judge every row by the model that gates."""
        gating = self.mission.gating_model
        gates = [model for model in MODELS if gating in (model, "strictest")]
        slow = slow_phases(self.mission, self.errors.geometries)
        self.together = {model: Together(self.errors, model, slow, self.random) for model in MODELS}
        total = self.array(self.mission.requirements.quadratic_phase_error)
        self.allocation = allocate(self.mission, (self.together[model] for model in gates))
        self.split = self.allocation.qpe
        self.gain = self.array(self.allocation.autofocus_gain)
        self.swaying = Vibrations(self.judging, self.mission, self.errors.geometries, self.allocation)
        self.total = total
        owners = (*PLATFORMS, "clock", "mission")
        self.limits = {owner: self.array(self.split.of(owner) * total) * self.gain for owner in owners}
        self.error_rows = ErrorRows(self.judging, self.errors, self.limits, self.gain, is_whole=False)
        self.aggregates = Aggregates(self.judging, self.together, self.allocation)
        self.random_rows = RandomRows(
            self.judging, self.mission, self.allocation, self.random, self.errors.geometries
        )
        by_model = [self._rows(model) for model in gates]
        rows = _stricter(*by_model) if len(by_model) > 1 else by_model[0]
        rows = with_required([*self._undeclared(rows), *rows], self.mission, self.errors.geometries, self.cases)
        rows = [self._doubted(row) for row in rows]
        rows, states = self._judged_requirements(rows, gates)
        floors = [
            self._floor(),
            *(np.where(state.status == CODE["waived"], CODE["pass"], state.status) for state in states),
        ]
        floor = np.min(floors, axis=0)
        return Checked(tuple(rows), floor, self.errors.geometries, tuple(states))

    # ---------------------------------------------------------------- requirements
    def _judged_requirements(
        self, rows: Sequence[Judged], gates: Sequence[str]
    ) -> tuple[list[Judged], list[RequirementState]]:
        """Rows with what they could not be judged by, after waivers, and how each requirement stands."""
        mission = self.mission
        by_model = [(self.together[model], self.random_rows.noise(model)) for model in gates]
        effects = [(together, effect_parts(together, spreads, self.tones)) for together, spreads in by_model]
        untaken = untaken_effects(mission, effect_totals(effects))
        (place,) = (row.declared for row in rows if row.subject.id == f"mission.{LOCATION}")
        is_displaced = misplacing(self.together["full"], place).where(self.cases)
        is_misplaced = np.any([is_displaced, *self._in_doubt.values()], axis=0)
        noise = [one.variance for model in gates for one in self.random_rows.noise(model)]
        makes_noise = [~np.isnan(one) for one in noise]
        if mission.requirements.pslr is None:
            makes_noise += [np.broadcast_to(one.is_there, (self.cases,)) for one in self.tones]
        has_noise = np.any([np.zeros(self.cases, bool), *makes_noise], axis=0)
        found, seen = [], []
        for row in rows:
            status = status_of(row.status, row.subject.id, ~np.isnan(row.allowable), untaken)
            if row.subject.id == f"mission.{LOCATION}" and mission.requirements.location_error is not None:
                is_known = np.isin(status, [CODE["fail"], CODE["not_declared"]])
                status = np.where(is_misplaced & ~is_known, CODE["not_evaluated"], status)
            if row.subject.kind == "islr":  # of a cubic phase alone, ISLR is not judged
                is_known = has_noise | np.isin(status, [CODE["fail"], CODE["not_declared"]])
                status = np.where(is_known, status, CODE["not_evaluated"])
            after = waived(row._replace(status=status), mission, self.today)
            found.append(after)
            is_covered = (after.status == CODE["waived"]) & np.isin(row.status, _BROKEN)
            judges = np.where((row.binding >= 0) & (row.binding < len(KEYS)), row.binding, KEYS.index(row.metric))
            if row.is_of_declare and row.metric != DECLARE:  # judges nothing where it is not declared
                judges = np.where(row.status == CODE["not_evaluated"], -1, judges)
            seen.append(
                SeenRow(
                    row.subject.id,
                    np.where(is_covered, CODE["waived"], row.status),
                    row.utilization,
                    judges.astype(np.int8),
                    row.quadratic_use,
                )
            )
        states = requirement_states(
            mission,
            seen,
            {key: is_waived(mission, self.today, [f"mission.{key}"]) for key in KEYS},
            has_noise=has_noise,
            is_misplaced=is_misplaced,
        )
        return found, states

    def _rows(self, gating: str) -> list[Judged]:
        other = "published" if gating == "full" else "full"
        rows = [one.judged for one in self.error_rows.rows(gating, other)]
        rows += self._vibrations(gating)
        rows += self._instruments(gating)
        rows += [one.judged for one in self.aggregates.rows(gating)]
        if self.mission.scene.radius is not None:
            rows.append(judged_edge(self.judging, self._edges, self.total, gating))
        return rows

    @property
    def _vibrates(self) -> bool:
        return any(one.sinusoidal or one.wideband for one in self.vibrations)

    def _vibrations(self, gating: str) -> list[Judged]:
        """Rows of vibrations, where one is declared or asked for."""
        if not self._vibrates and not any(what.kind == "vibration" for what in self.shown.values()):
            return []
        found: dict[str, Judged] = {}
        for one in self.swaying.rows(gating):
            what = one.judged.subject
            found[what.id] = found.get(what.id, Judged.of_none(what, self.cases)).where(one.is_there, one.judged)
        return list(found.values())

    def _instruments(self, gating: str) -> Iterator[Judged]:
        """Rows of sensors and clocks, and of all that echoes and spreads together."""
        rows, needs = self.random_rows, self.mission.requirements
        yield from (one.judged for one in rows.rows(gating))
        for spur in judged_spurs(self.judging, self.mission, self.allocation, gating):
            yield spur.judged
        if needs.pslr is not None:
            yield judged_pslr(self.judging, self.tones, needs.pslr)[0]
        together = self.together[gating]
        split = self.allocation.islr
        if needs.islr is not None:
            sums = rows.islr_rows(gating, self.tones, lambda owner: together.cubic_without_coverage(split, owner))
            yield from (one.judged for one in sums)

    @cached_property
    def _edges(self) -> SceneEdges | None:
        """Differences that the edges of the scenes add; None without a declared error."""
        return scene_edges(self.errors, self.limits, self.split)

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
        """Best status that each case can have: paths may be in doubt, and nothing declared."""
        floor = np.full(self.cases, CODE["pass"])
        for name, path in zip(
            PLATFORMS, (self.errors.geometries.transmitter, self.errors.geometries.receiver), strict=True
        ):
            platform = getattr(self.mission.platforms, name)
            if platform.path is not None and platform.path.doubts:
                floor[~self._in_doubt[name] | bool(platform.path.samples)] = CODE["warn"]
            if platform.acceleration is None and not platform.is_of_the_earth:
                floor[np.broadcast_to(norm(path.velocity) > FASTEST_FLIGHT, floor.shape)] = CODE["warn"]
        if not (self.errors.stated or self._vibrates or self.stated_random):
            floor[:] = CODE["not_evaluated"]
        return floor


def with_required(rows: Sequence[Judged], mission: Mission, geometries: BistaticGeometry, cases: int) -> list[Judged]:
    """Put the row of what must be declared before the others; as `budget.required.with_required`."""
    if not mission.requirements.declare:
        return list(rows)
    still = np.array(
        [np.broadcast_to(path.is_still, (cases,)) for path in (geometries.transmitter, geometries.receiver)]
    )
    whole = Judged.of_none(DECLARATIONS, cases)._replace(metric=DECLARE, is_of_declare=True)
    whole.status[:] = CODE["pass"]
    found = [whole, *rows]
    for which in np.unique(still, axis=1).T:  # nearly always one: a platform that moves does in every case
        these = (still == which[:, None]).all(axis=0)
        names = [name for name, is_still in zip(PLATFORMS, which, strict=True) if is_still]
        missing = missing_declarations(mission, names)
        whole.status[these] = CODE["not_evaluated" if missing else "pass"]
        found = [_required(row, missing, these) for row in found]
    return found


def _required(row: Judged, missing: Sequence[Missing], these: NDArray[np.bool_]) -> Judged:
    """Turn a row that these cases should declare and do not from `not_declared` into `not_evaluated`."""
    is_missing = these & (row.status == CODE["not_declared"])
    if not is_missing.any() or not any(is_asked_for(row.subject, one) for one in missing):
        return row
    return row._replace(status=np.where(is_missing, CODE["not_evaluated"], row.status), is_of_declare=True)


def waived(row: Judged, mission: Mission, today: date) -> Judged:
    """Waive a row where it fails or is not evaluated and a waiver that holds names it."""
    names = [row.subject.id, *([DECLARATIONS.id] if row.is_of_declare else [])]
    if not is_waived(mission, today, names):
        return row
    return row._replace(status=np.where(np.isin(row.status, _BROKEN), CODE["waived"], row.status))


def _stricter(published: Sequence[Judged], full: Sequence[Judged]) -> list[Judged]:
    """Rows of two complete checks: of each the one with the stricter verdict, then the higher utilization."""
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
