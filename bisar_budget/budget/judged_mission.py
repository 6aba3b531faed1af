"""Judgement of all rows and requirements of a mission, for an array of cases.

The check of one mission is a single case. Each family of rows is judged by every gating model, that is every model
whose verdict counts. With two such models, the stricter verdict is used. Some judgements need more than one row and
are made afterwards. They concern required declarations, inaccurate paths, effects that no requirement covers, and
waivers.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import date

import numpy as np
from numpy.typing import NDArray

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.analysis.scene import scene_edges
from bisar_budget.analysis.totals import Totals
from bisar_budget.arrays import Booleans, PerCaseFlag
from bisar_budget.budget.aggregates import Aggregates, JudgedScene, unplaced, untaken_effects
from bisar_budget.budget.declarations import DECLARATIONS, groups_alike, is_asked_for, missing_declarations
from bisar_budget.budget.dispersion_row import dispersion_rows
from bisar_budget.budget.doubts import doubted_platforms, is_in_doubt
from bisar_budget.budget.error_rows import ErrorRows, specification_rows
from bisar_budget.budget.half_causes import HalfCause, half_causes
from bisar_budget.budget.judged_requirements import (
    REQUIREMENT_KEYS,
    RequirementState,
    UntakenEffect,
    is_as_high,
    negligible_rad,
    requirement_states,
)
from bisar_budget.budget.judged_rows import CODE, REQUIREMENTS, Codes, FamilyRow, Judged, Judging, Why
from bisar_budget.budget.log_rows import log_rows
from bisar_budget.budget.mission_doubts import mission_doubts
from bisar_budget.budget.random_rows import RandomRows
from bisar_budget.budget.staying_air import StayingAir, staying_air
from bisar_budget.budget.tone_rows import accelerated_rows, pslr_row, spur_rows
from bisar_budget.budget.vibration_rows import Vibrations
from bisar_budget.budget.waivers import holding_place
from bisar_budget.effects.declared import END_OF_IMAGE, LOCATION, MODELS
from bisar_budget.effects.effect import PLATFORMS, subject
from bisar_budget.error_kinds.path_kinds import StateKind
from bisar_budget.error_kinds.registry import SPREAD_POWER
from bisar_budget.findings.row import DECLARE, SPECIFICATION
from bisar_budget.findings.status import BROKEN, STATUS
from bisar_budget.geometry import BistaticGeometry
from bisar_budget.mission.model import Mission
from bisar_budget.mission.stacked import picked

_BROKEN_CODES = [CODE[name] for name in BROKEN]
_GATES = np.array([status.gates for status in STATUS.values()])
_OWNERS = (*PLATFORMS, "clock", "mission")


@dataclass(frozen=True, eq=False)
class JudgedMission:
    """The verdicts on a mission, for an array of cases.

    `rows` are the rows after waivers, in the order of the JSON output. `before` are the same rows before waivers. The
    field `why` of a row gives the reason for its status if the numbers of the row do not decide it. `families` holds
    the rows of each gating model, before the rows of both models are merged. `doubts` maps the code of each warning
    that casts doubt on the mission to a mask of the cases with this doubt. `totals` are the distributions of the sums
    of all errors.
    """

    analysis: Analysis
    totals: Totals
    families: Mapping[str, Sequence[FamilyRow]]
    rows: tuple[Judged, ...]
    before: tuple[Judged, ...]
    requirements: tuple[RequirementState, ...]
    untaken: Sequence[UntakenEffect]
    unplaced: Mapping[str, Booleans]
    air: StayingAir
    scene: JudgedScene | None
    doubts: Mapping[str, Booleans]
    status: Codes  # of the mission in each case, (cases,)
    waivers: NDArray[np.intp]  # index in the file of each row's waiver, (rows, n); -1: no waiver
    waived_requirements: Sequence[tuple[Booleans, int]]  # waived cases, and index of waiver or -1

    @property
    def is_empty(self) -> bool:
        """Whether no error is declared in any case, so that nothing was judged."""
        nothing = (
            row.metric in (DECLARE, SPECIFICATION)
            or np.all((row.status == CODE["not_declared"]) | (row.why == Why.NOT_DECLARED_AS_REQUIRED))
            for row in self.rows
        )
        return all(nothing)

    def covering(self, row_id: str | None = None) -> Iterator[tuple[str, Booleans]]:
        """Yield the id of each waiver, with a mask of the cases in which it covers a row or a requirement.

        The waivers are in the order of the file. If `row_id` is given, the mask marks only the cases in which the
        waiver covers this row.
        """
        rows = [row_id is None or row.subject.id == row_id for row in self.rows]
        requirements = self.waived_requirements if row_id is None else ()
        for waiver_index, waiver in enumerate(self.analysis.mission.waivers):
            covered = (is_waived for is_waived, index in requirements if index == waiver_index)
            yield waiver.id, np.any([(self.waivers[rows] == waiver_index).any(axis=0), *covered], axis=0)


@np.errstate(all="ignore")
def judged_mission(analysis: Analysis, today: date) -> JudgedMission:
    """Judge every row and every requirement for the analysed cases.

    Parameters
    ----------
    analysis : Analysis
        Analysis of cases that need the same number of quadrature nodes over the aperture.
    today : date
        Day (UTC) on which waivers are judged.
    """
    mission, cases = analysis.mission, analysis.cases
    judging = Judging(cases, mission.allocation.warn_above, analysis.is_complete)
    # Limit on the quadratic phase of each owner, including the autofocus gain.
    limits = {owner: judging.array(analysis.allocation.qpe_allowed(owner)) for owner in _OWNERS}
    in_doubt = doubted_platforms(mission, cases)
    errors = ErrorRows(judging, analysis, limits)
    vibrations = Vibrations(judging, analysis) if _has_vibration_rows(analysis) else None
    random = RandomRows(judging, analysis)
    scene = None
    if mission.scene.radius is not None:  # a search around the edge, which only a stated radius needs
        scene = JudgedScene(analysis, scene_edges(analysis.errors, analysis.random, limits, analysis.allocation.qpe))
    totals = Totals(analysis)
    families = {
        model: list(_families(model, judging, analysis, errors, vibrations, random, scene, totals))
        for model in analysis.gates
    }
    by_model = [_rows(model, rows_of_model, cases) for model, rows_of_model in families.items()]
    rows = [*_undeclared(by_model[-1], analysis, in_doubt), *_stricter(*reversed(by_model))]
    if mission.requirements.declare:
        rows.insert(0, Judged.of_none(DECLARATIONS, cases)._replace(metric=DECLARE))
    of_all = RowStatuses(rows, mission)
    of_all.require_declarations(analysis.geometry)
    of_all.doubt_inputs(in_doubt)
    untaken = untaken_effects(analysis)
    drifting = unplaced(analysis.together("full"))
    nowhere = np.zeros(cases, dtype=bool)
    paths = [is_doubtful for (_, state), is_doubtful in in_doubt.items() if state is not None]
    is_misplaced = np.any([nowhere, *drifting.values(), *paths], axis=0)
    has_noise = _has_noise(judging, analysis)
    air = staying_air(analysis, rows)
    of_all.doubt_air(air.doubted_rows())
    by_themselves = of_all.status.copy()
    of_all.judge_effects(untaken)
    of_all.doubt_air(air.untaken_rows())
    of_all.judge_place(is_misplaced)
    of_all.judge_spread(has_noise)
    halves = list(half_causes(mission))
    of_all.judge_halves(halves)
    before = of_all.status
    waivers = of_all.waivers(today)
    after = np.where(waivers >= 0, CODE["waived"], before)
    of_requirements = {key: holding_place(mission, today, [f"mission.{key}"]) for key in REQUIREMENT_KEYS}
    states = requirement_states(
        mission,
        # The status of a row for other reasons does not matter here, but a waiver of the row counts.
        np.where((after == CODE["waived"]) & np.isin(by_themselves, _BROKEN_CODES), CODE["waived"], by_themselves),
        np.array([row.utilization for row in rows]),
        of_all.judges(),
        np.array([row.quadratic_use for row in rows]),
        {key: waiver_index >= 0 for key, waiver_index in of_requirements.items()},
        before=by_themselves,
        in_doubt=_doubted_rows(analysis, rows),
        has_noise=has_noise,
        is_misplaced=is_misplaced,
        unjudged=air.doubted_requirements() | {key: True for half in halves for key in half.requirements},
    )
    doubts = mission_doubts(mission, analysis.geometry, cases)
    floor = np.min([_floor(analysis, doubts), *(state.status for state in states)], axis=0)
    return JudgedMission(
        analysis=analysis,
        totals=totals,
        families=families,
        rows=of_all.rows_with(after),
        before=of_all.rows_with(before),
        requirements=tuple(states),
        untaken=untaken,
        unplaced=drifting,
        air=air,
        scene=scene,
        doubts=doubts,
        status=_worst(after, floor),
        waivers=waivers,
        waived_requirements=[(state.status == CODE["waived"], of_requirements[state.key]) for state in states],
    )


# ---------------------------------------------------------------------- rows of the families
def _families(
    model: str,
    judging: Judging,
    analysis: Analysis,
    errors: ErrorRows,
    vibrations: Vibrations | None,
    random: RandomRows,
    scene: JudgedScene | None,
    totals: Totals,
) -> Iterator[FamilyRow]:
    """Yield all rows, as judged by one model, in the order of the JSON output.

    `model` is `published` or `full`.
    """
    needs = analysis.mission.requirements
    yield from errors.rows(model)
    if vibrations is not None:
        yield from vibrations.rows(model)
    yield from random.rows(model)
    yield from random.stated_rows(model)
    yield from spur_rows(judging, analysis, model)
    yield from accelerated_rows(judging, analysis, model)
    yield from dispersion_rows(judging, analysis)
    yield from log_rows(judging, analysis.mission)
    if needs.pslr is not None:
        yield pslr_row(judging, analysis.tones, needs.pslr)
    if needs.islr is not None:
        yield from random.islr_rows(model)
    yield from Aggregates(judging, analysis, totals).rows(model)
    if scene is not None:
        yield scene.row(judging, model)
    yield from specification_rows(judging, analysis)


def _rows(model: str, families: Sequence[FamilyRow], cases: int) -> dict[str, Judged]:
    """Return the rows of one model by their ids; rows that do not exist in any case are omitted.

    Different families may contain the same row for different cases. These parts are merged into one row.
    """
    rows: dict[str, Judged] = {}
    by_model = np.full(cases, MODELS.index(model), np.int8)
    for row in families:
        judged = row.judged._replace(model=by_model)
        row_id = judged.subject.id
        if row.is_there is True or np.all(row.is_there):
            rows[row_id] = judged
        elif np.any(row.is_there):
            rows[row_id] = (
                rows.get(row_id, Judged.of_none(judged.subject, cases))
                .where(row.is_there, judged)
                ._replace(metric=judged.metric)
            )
    return rows


def _has_vibration_rows(analysis: Analysis) -> bool:
    """Whether a vibration is declared, or the row of a vibration must be shown."""
    return (
        _vibrates(analysis.mission)
        or analysis.shown is None
        or any(row_subject.facts.is_vibration for row_subject in analysis.shown.values())
    )


def _vibrates(mission: Mission) -> bool:
    """Whether the mission declares a sinusoidal or wideband vibration."""
    motions = (getattr(mission.platforms, name).motion_error.vibration for name in PLATFORMS)
    return any(vibration.sinusoidal or vibration.wideband for vibration in motions)


# ---------------------------------------------------------------------- judgements beyond single rows
def _undeclared(
    judged_rows: Mapping[str, Judged],
    analysis: Analysis,
    in_doubt: Mapping[tuple[str, StateKind | None], Booleans],
) -> Iterator[Judged]:
    """Yield rows for errors that are not declared in any case.

    There are two kinds of such rows: rows that are always shown, and rows of path errors of platforms whose path may
    be less accurate than declared. `in_doubt` marks the cases with such a path, for each platform and kind of error.
    """
    subjects = dict(analysis.shown or {})
    for (name, state), is_doubtful in in_doubt.items():
        if state is None or not is_doubtful.any():  # the residual of a log has its own rows
            continue
        axes = (subject(name, state.name, axis) for axis in "xyz")
        subjects |= {
            axis_subject.id: axis_subject
            for axis_subject in axes
            if is_in_doubt(axis_subject, name, analysis.mission, state)
        }
    there = {*judged_rows, DECLARATIONS.id}
    return (
        Judged.of_none(axis_subject, analysis.cases)
        for row_id, axis_subject in subjects.items()
        if row_id not in there
    )


def _has_noise(judging: Judging, analysis: Analysis) -> Booleans:
    """Find the cases that declare an error that spreads power over the image, (cases,).

    Tones that count against the ISLR are included. A motion error spreads power if the part of its phase beyond the
    cubic term is not negligible.
    """
    array, gates, cases = judging.array, analysis.gates, analysis.cases
    level = negligible_rad(analysis.mission)
    has_any = [~np.isnan(array(phase.variance)) for model in gates for phase in analysis.noise[model]]
    has_any += [np.sqrt(array(phase.variance)) >= level for model in gates for phase in analysis.rests[model]]
    if analysis.mission.requirements.pslr is None:
        has_any += [np.broadcast_to(phase.is_there, (cases,)) for phase in analysis.tones]
    return np.asarray(np.any([np.zeros(cases, bool), *has_any], axis=0))


def _doubted_rows(analysis: Analysis, rows: Sequence[Judged]) -> Booleans:
    """Mark the rows of oscillators with doubtful noise, (rows, cases)."""
    doubted = {error.id: error.is_in_doubt for error in analysis.random if np.any(error.is_in_doubt)}
    in_doubt = np.zeros((len(rows), analysis.cases), dtype=bool)
    for row_index, row in enumerate(rows) if doubted else ():
        in_doubt[row_index] = doubted.get(row.subject.id, False)
    return in_doubt


def _floor(analysis: Analysis, doubts: Mapping[str, Booleans]) -> Codes:
    """Return the best status that each case can have, (cases,).

    It is `not_evaluated` if no error is declared, and `warn` if the mission is doubtful. Otherwise it is `pass`.
    """
    is_random = any(error.declared is not None for error in analysis.random)
    if not (analysis.errors.stated or _vibrates(analysis.mission) or is_random):
        return np.full(analysis.cases, CODE["not_evaluated"])
    return np.where(np.any([*doubts.values()], axis=0), CODE["warn"], CODE["pass"])


def _worst(codes: Codes, floor: Codes) -> Codes:
    """Return the worst row status that counts in the verdict on a mission, (cases,).

    `codes` (rows, cases) are the statuses of the rows. If `floor` (cases,) is worse, it is returned instead.
    """
    worst = np.where(_GATES[codes], codes, CODE["pass"]).min(axis=0)
    return np.asarray(np.minimum(worst, floor), dtype=np.int8)


class RowStatuses:
    """Statuses of all rows, (rows, cases), and the reasons for changes that do not follow from a row alone.

    Each method sets some rows to `not_evaluated`. A row that fails keeps the status `fail`.
    """

    def __init__(self, rows: Sequence[Judged], mission: Mission) -> None:
        self.rows, self.mission = rows, mission
        self.subjects = [row.subject for row in rows]
        self.status, self.why = np.array([row.status for row in rows]), np.array([row.why for row in rows])

    def _settle(self, rows: Sequence[bool], is_so: PerCaseFlag, why: Why) -> None:
        """Set `rows` to `not_evaluated` where `is_so` is true, and record the reason `why`.

        `is_so` has the shape (rows, cases) or (cases,).
        """
        are_settled = np.array(rows, dtype=bool)[:, None] & is_so
        self.status = np.where(are_settled, CODE["not_evaluated"], self.status)
        self.why = np.where(are_settled, np.int8(why), self.why)

    def require_declarations(self, geometry: BistaticGeometry) -> None:
        """Set rows to `not_evaluated` if their error must be declared but is not declared.

        The first row represents all required declarations. It becomes `not_evaluated` if a declaration is missing,
        and `pass` otherwise.
        """
        if not self.mission.requirements.declare:
            return
        still = np.array([np.broadcast_to(path.is_still, self.status.shape[1:]) for path in geometry.both])
        for cases in groups_alike(self.mission, geometry, self.status.shape[1]):
            names = [name for name, is_still in zip(PLATFORMS, still[:, cases][:, 0], strict=True) if is_still]
            mission = self.mission if cases.all() else picked(self.mission, np.flatnonzero(cases))
            missing = missing_declarations(mission, names)
            self.status[0, cases] = CODE["not_evaluated" if missing else "pass"]
            owed = [any(is_asked_for(row_subject, error) for error in missing) for row_subject in self.subjects]
            self._settle(owed, cases & (self.status == CODE["not_declared"]), Why.NOT_DECLARED_AS_REQUIRED)

    def doubt_inputs(self, in_doubt: Mapping[tuple[str, StateKind | None], Booleans]) -> None:
        """Set rows of path errors to `not_evaluated` where the path may be less accurate than declared."""
        for (name, state), is_doubtful in in_doubt.items():
            if is_doubtful.any():
                owed = [is_in_doubt(row_subject, name, self.mission, state) for row_subject in self.subjects]
                self._settle(owed, is_doubtful & (self.status != CODE["fail"]), Why.INPUT_IN_DOUBT)

    def doubt_air(self, doubted: Mapping[str, Booleans]) -> None:
        """Set rows to `not_evaluated` if they depend on the assumption that atmospheric delays are constant.

        `doubted` maps row ids to masks of the cases to set, (cases,).
        """
        for row_id, is_doubted in doubted.items():
            if is_doubted.any():
                rows = [row_subject.id == row_id for row_subject in self.subjects]
                is_new = self.why != Why.EFFECT_NOT_TAKEN  # keep the reason that names the requirement to add
                self._settle(rows, is_doubted & self._is_open & is_new, Why.AIR_STAYS)

    def judge_effects(self, untaken: Sequence[UntakenEffect]) -> None:
        """Set rows to `not_evaluated` if their errors cause an effect that no requirement limits.

        A row gets the status `info` if its contribution to such an effect is negligible and it passes only because it
        has no limit.
        """
        for row_index, row in enumerate(self.rows):
            row_id, status = row.subject.id, self.status[row_index]
            of_row = [effect for effect in untaken if row_id in effect.parts]
            if not of_row:
                continue
            for effect in of_row:
                is_unlimited = np.isnan(row.allowable) & (effect.parts[row_id] > 0)
                status = np.where(is_unlimited & (status == CODE["pass"]), CODE["info"], status)
                is_better = (status != CODE["fail"]) & (status != CODE["not_declared"])
                status = np.where(effect.makers[row_id] & is_better, CODE["not_evaluated"], status)
            is_judged = (status == CODE["not_evaluated"]) | (status == CODE["fail"])
            makes_up = is_judged & np.any([effect.makers[row_id] for effect in of_row], axis=0)
            self.status[row_index] = status
            self.why[row_index] = np.where(makes_up, np.int8(Why.EFFECT_NOT_TAKEN), self.why[row_index])

    def judge_place(self, is_misplaced: Booleans) -> None:
        """Set the row of the location requirement to `not_evaluated` where the displacement of the image is unknown.

        The displacement is unknown if an error displaces the image by an amount that no row limits.
        """
        if self.mission.requirements.location_error is not None:
            rows = [row_subject.id == f"mission.{LOCATION}" for row_subject in self.subjects]
            self._settle(rows, is_misplaced & self._is_open, Why.NO_PLACE)

    def judge_halves(self, halves: Sequence[HalfCause]) -> None:
        """Set rows to `not_evaluated` if they depend on an incompletely declared cause of error.

        Such a cause needs two entries of the mission file, of which only one is given.
        """
        for half in halves:
            self._settle([half.holds(row_subject) for row_subject in self.subjects], self._is_open, Why.HALF_A_CAUSE)

    def judge_spread(self, has_noise: Booleans) -> None:
        """Set the ISLR rows to `not_evaluated` in the cases in which only a cubic phase contributes to the ISLR.

        `has_noise` marks the cases with further contributions, (cases,).
        """
        if not has_noise.all():
            rows = [row_subject.facts is SPREAD_POWER for row_subject in self.subjects]
            is_new = ~np.isin(self.why, (Why.INPUT_IN_DOUBT, Why.AIR_STAYS))
            self._settle(rows, ~has_noise & self._is_open & is_new, Why.NOTHING_SPREADS)

    @property
    def _is_open(self) -> Booleans:
        return np.asarray((self.status != CODE["fail"]) & (self.status != CODE["not_declared"]))

    def waivers(self, today: date) -> NDArray[np.intp]:
        """Find the first valid waiver that covers each broken row, (rows, cases).

        The result is the index of the waiver in the file, or -1 if no waiver covers the row. A row is broken if it
        fails or is not evaluated. `today` is the day (UTC) on which waivers must be valid.
        """
        indices = np.full(self.status.shape, -1)
        if not self.mission.waivers:
            return indices
        is_missing = self.why == Why.NOT_DECLARED_AS_REQUIRED
        of_missing = holding_place(self.mission, today, [DECLARATIONS.id])
        for row, row_subject in enumerate(self.subjects):
            waiver_of_row = holding_place(self.mission, today, [row_subject.id])
            both = [waiver_index for waiver_index in (waiver_of_row, of_missing) if waiver_index >= 0]
            indices[row] = np.where(is_missing[row], min(both, default=-1), waiver_of_row)
        return np.where(np.isin(self.status, _BROKEN_CODES), indices, -1)

    def judges(self) -> Codes:
        """Find the requirement against which each row is judged, (rows, cases), as an index in `REQUIREMENT_KEYS`.

        The index is -1 for a row that is not judged against a requirement. It is also -1 for a row whose error must
        be declared but is not declared.
        """
        binding = np.array([row.binding for row in self.rows])
        metric = np.array(
            [[REQUIREMENT_KEYS.index(row.metric) if row.metric in REQUIREMENT_KEYS else -1] for row in self.rows]
        )
        judges = np.where((binding >= 0) & (binding < REQUIREMENTS.index(END_OF_IMAGE)), binding, metric)
        return np.where(self.why == Why.NOT_DECLARED_AS_REQUIRED, -1, judges).astype(np.int8)

    def rows_with(self, status: Codes) -> tuple[Judged, ...]:
        """Return the rows with their statuses replaced by `status`, (rows, cases).

        A row whose status has become `info` has no utilization.
        """
        becomes_info = (status == CODE["info"]) & (np.array([row.status for row in self.rows]) != status)
        utilizations = np.where(becomes_info, np.nan, np.array([row.utilization for row in self.rows]))
        changes = zip(self.rows, status, self.why, utilizations, strict=True)
        return tuple(row._replace(status=code, why=why, utilization=use) for row, code, why, use in changes)


def _stricter(full: Mapping[str, Judged], published: Mapping[str, Judged] | None = None) -> list[Judged]:
    """Merge the rows of both models by taking, for each row and case, the model with the stricter verdict.

    If both statuses are equal, the model with the higher utilization is used.
    """
    if published is None:
        return list(full.values())
    stricter, only_published = [], dict(published)
    for row_id, by_full in full.items():
        by_published = only_published.pop(row_id, None)
        if by_published is None:
            stricter.append(by_full)
            continue
        use = [np.nan_to_num(row.utilization, nan=0.0) for row in (by_full, by_published)]
        size = [np.where(np.isnan(row.allowable), np.inf, row.allowable) for row in (by_full, by_published)]
        tie = by_published.status == by_full.status
        is_equal = is_as_high(use[0], use[1]) & is_as_high(use[1], use[0])
        takes_published = (by_published.status < by_full.status) | (tie & ~is_equal & (use[1] > use[0]))
        takes_published |= tie & is_equal & ~is_as_high(size[1], size[0])
        stricter.append(by_full.where(takes_published, by_published))
    return [*stricter, *only_published.values()]  # sums that only the published model has
