"""Utilizations of the rows of a budget for given sizes of errors, and the contribution of each error to each row.

The utilization of a row is its error divided by its limit. Each row that can fail has an allowed utilization. An
error contributes a power of its size to the row: the square if errors combine by root-sum-square or if their powers
add, and the size itself if errors add linearly. Values are in SI and radians.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from datetime import date
from functools import cached_property
from typing import NamedTuple

import numpy as np

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.arrays import Booleans, Floats
from bisar_budget.budget.judged_mission import JudgedMission, judged_mission
from bisar_budget.budget.judged_requirements import NEGLIGIBLE_FRACTION, SMALL_RAD
from bisar_budget.budget.judged_rows import CODE, REQUIREMENTS, Why
from bisar_budget.effects.declared import END_OF_IMAGE
from bisar_budget.effects.sources import exact_ranges
from bisar_budget.error_kinds.kind import ErrorKind
from bisar_budget.error_kinds.registry import kind_of
from bisar_budget.faults import MissionError, SetValue
from bisar_budget.mission.changes import ACCEPTED_ERRORS
from bisar_budget.mission.model import MetricSplits, Mission
from bisar_budget.mission.quantities import QuestionError, tree_of, with_number
from bisar_budget.questions.geometric_program import Rows
from bisar_budget.questions.specified import specified_errors
from bisar_budget.questions.table import Variation
from bisar_budget.questions.varied import is_held

PROBE_FACTORS = (0.8, 1.2)  # factors of a size at which the effect of an error is measured
_MAX_STEP_RATIO = 3.0  # largest ratio of utilization to allowed utilization after a step of the search
_SURE_FRACTION = 1 - 1e-5  # of a limit, because a check of a single case differs in the last digits
_END_FRACTION = 0.995  # of the smallest size without an image, which is known to 0.1 %
_ROW_ROUNDING_FRACTION = 1e-13  # of a row; a smaller part of an error is a rounding error
# First words of the ids of rows without a requirement: effects that belong to no row, and largest sizes in a file.
NEGLIGIBLE, LARGEST_ACCEPTED = "negligible", "accepted"
_HAVE_THEIR_OWN_ROW = (Why.EFFECT_NOT_TAKEN, Why.AIR_STAYS)  # reasons of rows without a number; see `uses`


class RowUses(NamedTuple):
    """Utilizations of all rows that can fail, and the ids and requirements of these rows.

    `uses` are the utilizations (rows, cases), one column for each set of sizes. `powers` are the exponents of the
    rows, (rows,): 1 if the errors of a row add linearly, 2 if their squares add.
    """

    ids: Sequence[str]
    requirements: Sequence[str | None]
    powers: Floats
    uses: Floats


class Near(NamedTuple):
    """Utilizations of the rows for given sizes of the errors, and for neighbouring sizes.

    Attributes
    ----------
    found : RowUses
        Utilizations at the sizes and at the neighbouring sizes.
    allowed : (rows,)
        Allowed utilizations.
    sizes : (sizes,)
        Given sizes of the specified errors.
    part : (rows, sizes)
        Contribution of each error to the utilization of each row, raised to the exponent of the row.
    room : (rows,)
        Room for the specified errors in each row: the allowed utilization, raised to the exponent of the row, minus
        the part that all other errors use.
    is_limit : (rows,)
        Whether at least one specified error contributes to the row.
    is_free : (sizes,)
        Whether the error contributes to no row.
    """

    found: RowUses
    allowed: Floats
    sizes: Floats
    part: Floats
    room: Floats
    is_limit: Booleans
    is_free: Booleans

    def rows(self, of: str = "") -> Rows:
        """Make the constraints on the sizes for the geometric program.

        The constraints come from all rows that limit a size, or only from the row with the id `of`.
        """
        limits = self.is_limit & np.array([not of or row == of for row in self.found.ids])
        power = self.found.powers[limits]
        return Rows(self.part[limits] / self.sizes ** power[:, None], power, self.room[limits])


class SpecifiedMission:
    """A mission and its specified errors, without the waivers and specifications of its file.

    Attributes
    ----------
    ends : (sizes,)
        For each error, the size at and above which no image forms. An element is infinite until the search finds this
        size.
    most : (sizes,)
        For each error, the largest size that a mission file may state. An element is infinite until the search
        exceeds this size.
    unjudged : set of str
        Ids of rows that cannot be judged even without the specified errors.
    """

    def __init__(
        self,
        mission: Mission,
        keys: Mapping[str, float] | None,
        reserve: float | None,
        model: str | None,
        today: date,
    ) -> None:
        self.given, self.today, self.notes = mission, today, list[str]()
        if mission.waivers:
            self.notes.append("waivers do not count: a specification has to hold by itself")
        self.variation, self.equal = Variation(mission, model), tuple(self._equal(mission))
        base = self._read(())
        self.specified = specified_errors(base, tree_of(mission), keys)
        self.weights = np.array([error.weight for error in self.specified])
        default_reserve = 1 - base.allocation.warn_above
        self.reserve = default_reserve if reserve is None else reserve
        self.combine, self.model = base.allocation.combine, base.gating_model
        # A mission that states every specified error, so that arrays can replace the numbers.
        tiny = np.array([error.tiny for error in self.specified])
        try:
            self.stated = self.with_values(
                [error.text(size) for error, size in zip(self.specified, tiny, strict=True)]
            )
        except MissionError as error:
            fault = error.faults[0]
            raise QuestionError(f"{fault.key}: {fault.problem}; it cannot be specified beside the rest") from None
        for specified in self.specified:
            if not is_held(self.stated, specified.key, is_stated=True):
                raise QuestionError(f"{specified.key}: decides more than its own size; {ACCEPTED_ERRORS}")
        self.tiny, self.unjudged = tiny, set[str]()
        self.ends, self.most = np.full(tiny.shape, math.inf), np.full(tiny.shape, math.inf)
        self.largest = np.array([error.largest for error in self.specified])

    def _equal(self, mission: Mission) -> Iterator[SetValue]:
        """Yield the changes to the mission file that replace balanced shares by equal shares.

        Balanced shares depend on the sizes of the declared errors, which are still unknown.
        """
        split = mission.allocation.split
        key = "allocation.split"
        if isinstance(split, MetricSplits):
            split, key = split.quadratic_phase_error, f"{key}.quadratic_phase_error"
        if split == "balanced":
            self.notes.append("balanced shares follow what is declared; they are taken as equal")
            yield SetValue(key, "equal")

    def with_values(self, texts: Sequence[str]) -> Mission:
        """Read the mission with new sizes of the specified errors.

        `texts` are the sizes as strings, in the order of the specified errors. An error whose string is empty is not
        changed.
        """
        return self._read(
            [SetValue(error.key, text) for error, text in zip(self.specified, texts, strict=True) if text]
        )

    def _read(self, changes: Sequence[SetValue]) -> Mission:
        """Read the mission with changed values, and remove its waivers and specifications."""
        return self.variation.read([*self.equal, *changes])._replace(waivers=(), specifications={})

    def judged(self, sizes: Floats, *, is_of_sums: bool = True) -> JudgedMission:
        """Judge the mission with given sizes of the specified errors, (sizes, cases).

        If `is_of_sums` is true, only the rows of combined errors are judged, otherwise also the rows of single
        errors.
        """
        mission = self.stated
        for error, column in zip(self.specified, sizes, strict=True):
            mission = with_number(mission, error.key, error.numbers(column))
        cases, geometry = sizes.shape[1], self.stated.geometry
        analysis = Analysis(mission, cases, geometry=geometry, nodes=self._nodes, shown={}, is_of_sums=is_of_sums)
        return judged_mission(analysis, self.today)

    @cached_property
    def _nodes(self) -> int:
        """Number of instants in the aperture at which exact ranges are computed for the fit of a polynomial."""
        return int(exact_ranges(self.stated, self.stated.geometry).fit.shape[1])

    def uses(self, sizes: Floats) -> RowUses:
        """Compute the utilizations of all rows that can fail, for sizes (sizes, cases) of the specified errors."""
        judged = self.judged(sizes)
        rows: list[tuple[str, str | None, float, Floats]] = []
        for row in judged.rows:
            is_judged = ~np.isin(row.status, (CODE["info"], CODE["not_declared"]))
            if not is_judged.any():
                continue
            is_lost = np.isin(row.status, (CODE["fail"], CODE["not_evaluated"])) & np.isnan(row.utilization)
            is_lost &= ~np.isin(row.why, (Why.EFFECT_NOT_TAKEN, Why.AIR_STAYS)) & (
                row.subject.id not in self.unjudged
            )
            is_heeded = self.reserve > 0 or not row.subject.facts.only_warns
            use = np.nan_to_num(row.utilization, nan=0.0, posinf=math.inf) * is_heeded
            use = np.where(is_lost, math.inf, use)
            binding = int(row.binding.max())
            requirement = row.metric if binding < 0 or binding >= len(REQUIREMENTS) - 1 else REQUIREMENTS[binding]
            rows.append((row.subject.id, requirement, self._power(row.subject.facts), use))
        level = min(NEGLIGIBLE_FRACTION * float(np.max(self.stated.requirements.quadratic_phase_error)), SMALL_RAD)
        for air in judged.air.uses.values():
            power = self._power(kind_of(air.key))
            rows.append(
                (f"{NEGLIGIBLE}.{air.row_id}", air.key, power, judged.air.is_long * air.use / NEGLIGIBLE_FRACTION)
            )
        untaken = [(effect.effect, effect) for effect in judged.untaken]
        untaken += [(f"air.{effect.effect}", effect) for effect in judged.air.untaken]
        for name, effect in untaken:
            use = np.broadcast_to(effect.total, sizes.shape[1:]) / level
            rows.append((f"{NEGLIGIBLE}.{name}", None, 1.0 if self.combine == "sum" else 2.0, use))
        for name, limits in ((END_OF_IMAGE, self.ends), (LARGEST_ACCEPTED, self.most)):
            for index in np.flatnonzero(np.isfinite(limits)).tolist():
                rows.append((f"{name}.{self.specified[index].key}", None, 2.0, sizes[index] / limits[index]))
        ids, requirements, powers, uses = zip(*rows, strict=True)
        return RowUses(ids, requirements, np.array(powers), np.array(uses))

    def _power(self, kind: ErrorKind) -> float:
        """Exponent of the rows of one kind: 1 if the errors in a row add linearly, 2 if their squares add."""
        is_summed = self.combine == "sum" and kind.is_by_rule
        return 1.0 if is_summed or kind.only_warns else 2.0

    def allowed(self, ids: Sequence[str]) -> Floats:
        """Compute the allowed utilizations of rows, (rows,).

        The allowed utilization is 1 minus the reserve, reduced by a small margin. Rows without a requirement have no
        reserve. The exception is a row for the largest size at which an image forms: it has the reserve, and its
        margin is at least 0.5 %.
        """
        usual = (1 - self.reserve) * _SURE_FRACTION
        most = {NEGLIGIBLE: _SURE_FRACTION, END_OF_IMAGE: min(usual, _END_FRACTION), LARGEST_ACCEPTED: _SURE_FRACTION}
        return np.array([most.get(row.partition(".")[0], usual) for row in ids])

    def near(self, sizes: Floats) -> Near | None:
        """Compute the utilizations of all rows at given sizes of the errors, (sizes,), and at neighbouring sizes.

        For the neighbouring sizes, each size alone is reduced and increased by 20 %. Returns None if a utilization
        exceeds three times the allowed value, or if a row has no room for the specified errors.
        """
        count = sizes.size
        cases = np.repeat(sizes[:, None], 2 * count + 1, axis=1)
        for number, factor in enumerate(PROBE_FACTORS):
            cases[np.arange(count), 1 + number * count + np.arange(count)] *= factor
        row_uses = self.uses(cases)
        allowed, power = self.allowed(row_uses.ids), row_uses.powers[:, None]
        if not (row_uses.uses[:, 0] <= _MAX_STEP_RATIO * allowed).all():
            return None
        powers = row_uses.uses**power
        base, (less, more) = powers[:, :1], np.split(powers[:, 1:], 2, axis=1)
        is_lost = ~np.isfinite(more)
        low, high = (factor**power for factor in PROBE_FACTORS)
        with np.errstate(invalid="ignore"):
            share: Floats = np.where(is_lost, (base - less) / (1 - low), (more - less) / (high - low))
        share = np.where(share > _ROW_ROUNDING_FRACTION * base, share, 0.0)
        room = allowed**row_uses.powers - (base[:, 0] - share.sum(axis=1))
        is_limit: Booleans = np.any(share > 0, axis=1)
        if (room[is_limit] <= 0).any():
            return None
        is_free: Booleans = ~np.any(share > 0, axis=0)
        return Near(row_uses, allowed, sizes, share, room, is_limit, is_free)
