"""Rows of the budget with errors of given sizes: how much each uses, and what each error adds to it. SI, radians.

Each row that can fail is held to what it may use. What an error adds to it is a power of the size: the square where
errors combine by root-sum-square or powers add, the size itself where they add up.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from datetime import date
from functools import cached_property
from typing import NamedTuple

import numpy as np

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.budget.judged_mission import JudgedMission, judged_mission
from bisar_budget.budget.judged_requirements import NEGLIGIBLE_FRACTION, SMALL_RAD
from bisar_budget.budget.judged_rows import CODE, REQUIREMENTS, Why
from bisar_budget.budget.random_rows import ISLR
from bisar_budget.design.geometric_program import Rows
from bisar_budget.design.specified import specified_errors
from bisar_budget.design.table import Variation
from bisar_budget.design.varied import is_held
from bisar_budget.effects.declared import CUBIC, END_OF_IMAGE, LOCATION, QUADRATIC
from bisar_budget.faults import MissionError, SetValue
from bisar_budget.mission.changes import ACCEPTED_ERRORS
from bisar_budget.mission.model import MetricSplits, Mission
from bisar_budget.mission.quantities import QuestionError, tree_of, with_number
from bisar_budget.ranges.exact_ranges import Floats, Truths

BESIDE = (0.8, 1.2)  # of a size, at which it is seen what an error adds
_FARTHEST = 3.0  # of what a row may use, up to which a step of the search may go
_SURELY = 1 - 1e-5  # of a limit: a case by itself settles to digits of its own
_SHORT_OF_END = 0.995  # of the size from which there is no image: that is found to 0.1 %
_NOTHING = 1e-13  # of a row: what rounding leaves of it
# What the ids of rows begin with that have no requirement: effects that none takes, and what a file may state.
NEGLIGIBLE, ACCEPTED = "negligible", "accepted"
_WARN_ONLY = ("autofocus_pull_in",)  # kinds of rows that warn and never fail
_HAVE_THEIR_OWN_ROW = (Why.EFFECT_NOT_TAKEN, Why.AIR_STAYS)  # below: why rows that have no number are not judged
_AS_COMBINED = (
    QUADRATIC,
    CUBIC,
    LOCATION,
    "spatial_variance",
    "dispersion",
)  # kinds of rows that combine errors by the rule


class RowUses(NamedTuple):
    """Utilizations of the rows that can fail in some cases, (rows, cases), by their ids; and what judges each."""

    ids: Sequence[str]
    requirements: Sequence[str | None]
    powers: Floats
    uses: Floats


class Near(NamedTuple):
    """The use of rows near sizes, (sizes,): the part of each, of the power of the utilization, and the room for all.

    `is_limit` are the rows that any of the sizes takes part in, `is_free` the sizes that take part in none.
    """

    found: RowUses
    allowed: Floats
    sizes: Floats
    part: Floats
    room: Floats
    is_limit: Truths
    is_free: Truths

    def rows(self, of: str = "") -> Rows:
        """Rows of a program: every one that limits any size, or one."""
        limits = self.is_limit & np.array([not of or row == of for row in self.found.ids])
        power = self.found.powers[limits]
        return Rows(self.part[limits] / self.sizes ** power[:, None], power, self.room[limits])


class SpecifiedMission:
    """One mission and the errors of it that are specified; without its waivers and the specifications that it has.

    `ends` are sizes that end an image, and `most` those beyond what a mission file may state, once they were met;
    `unjudged` are rows that cannot be judged without these errors.
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
        self.weights = np.array([one.weight for one in self.specified])
        least = 1 - base.allocation.warn_above
        self.reserve = least if reserve is None else reserve
        self.combine, self.model = base.allocation.combine, base.gating_model
        # A mission that states each of them: where arrays are put into their places.
        tiny = np.array([one.tiny for one in self.specified])
        try:
            self.stated = self.with_values([one.text(size) for one, size in zip(self.specified, tiny, strict=True)])
        except MissionError as error:
            fault = error.faults[0]
            raise QuestionError(f"{fault.key}: {fault.problem}; it cannot be specified beside the rest") from None
        for one in self.specified:
            if not is_held(self.stated, one.key, is_stated=True):
                raise QuestionError(f"{one.key}: decides more than its own size; {ACCEPTED_ERRORS}")
        self.tiny, self.unjudged = tiny, set[str]()
        self.ends, self.most = np.full(tiny.shape, math.inf), np.full(tiny.shape, math.inf)
        self.largest = np.array([one.largest for one in self.specified])

    def _equal(self, mission: Mission) -> Iterator[SetValue]:
        """Balanced shares follow what is declared, and what is declared is looked for: they are taken as equal."""
        split = mission.allocation.split
        key = "allocation.split"
        if isinstance(split, MetricSplits):
            split, key = split.quadratic_phase_error, f"{key}.quadratic_phase_error"
        if split == "balanced":
            self.notes.append("balanced shares follow what is declared; they are taken as equal")
            yield SetValue(key, "equal")

    def with_values(self, texts: Sequence[str]) -> Mission:
        """The mission with numbers, as the file would have them; empty: as it is."""
        return self._read([SetValue(one.key, text) for one, text in zip(self.specified, texts, strict=True) if text])

    def _read(self, changes: Sequence[SetValue]) -> Mission:
        return self.variation.read([*self.equal, *changes])._replace(waivers=(), specifications={})

    def judged(self, sizes: Floats, *, is_of_sums: bool = True) -> JudgedMission:
        """Judge the mission with sizes, (sizes, cases): what errors add up to, or each by itself too."""
        mission = self.stated
        for one, column in zip(self.specified, sizes, strict=True):
            mission = with_number(mission, one.key, one.numbers(column))
        cases, geometry = sizes.shape[1], self.stated.geometry
        analysis = Analysis(mission, cases, geometry=geometry, nodes=self._nodes, shown={}, is_of_sums=is_of_sums)
        return judged_mission(analysis, self.today)

    @cached_property
    def _nodes(self) -> int:
        return int(Analysis(self.stated).exact.fit.shape[1])

    def uses(self, sizes: Floats) -> RowUses:
        """Utilizations of the rows that can fail, with sizes."""
        judged = self.judged(sizes)
        found: list[tuple[str, str | None, float, Floats]] = []
        for row in judged.rows:
            is_judged = ~np.isin(row.status, (CODE["info"], CODE["not_declared"]))
            if not is_judged.any():
                continue
            is_lost = np.isin(row.status, (CODE["fail"], CODE["not_evaluated"])) & np.isnan(row.utilization)
            is_lost &= ~np.isin(row.why, (Why.EFFECT_NOT_TAKEN, Why.AIR_STAYS)) & (
                row.subject.id not in self.unjudged
            )
            is_heeded = self.reserve > 0 or row.subject.kind not in _WARN_ONLY
            use = np.nan_to_num(row.utilization, nan=0.0, posinf=math.inf) * is_heeded
            use = np.where(is_lost, math.inf, use)
            binding = int(row.binding.max())
            requirement = row.metric if binding < 0 or binding >= len(REQUIREMENTS) - 1 else REQUIREMENTS[binding]
            found.append((row.subject.id, requirement, self._power(row.subject.kind), use))
        level = min(NEGLIGIBLE_FRACTION * float(np.max(self.stated.requirements.quadratic_phase_error)), SMALL_RAD)
        for air in judged.air.uses.values():
            power = self._power(air.key if air.key != ISLR else "")
            found.append(
                (f"{NEGLIGIBLE}.{air.row_id}", air.key, power, judged.air.is_long * air.use / NEGLIGIBLE_FRACTION)
            )
        untaken = [(one.kind, one) for one in judged.untaken]
        untaken += [(f"air.{one.kind}", one) for one in judged.air.untaken]
        for name, one in untaken:
            use = np.broadcast_to(one.total, sizes.shape[1:]) / level
            found.append((f"{NEGLIGIBLE}.{name}", None, 1.0 if self.combine == "sum" else 2.0, use))
        for name, limits in ((END_OF_IMAGE, self.ends), (ACCEPTED, self.most)):
            for place in np.flatnonzero(np.isfinite(limits)).tolist():
                found.append((f"{name}.{self.specified[place].key}", None, 2.0, sizes[place] / limits[place]))
        ids, requirements, powers, uses = zip(*found, strict=True)
        return RowUses(ids, requirements, np.array(powers), np.array(uses))

    def _power(self, kind: str) -> float:
        """Power of a size that adds up in a row."""
        is_summed = self.combine == "sum" and kind in _AS_COMBINED
        return 1.0 if is_summed or kind in _WARN_ONLY else 2.0

    def allowed(self, ids: Sequence[str]) -> Floats:
        """Largest utilization of each row; one without a requirement, or without an image beyond, stays below 1."""
        usual = (1 - self.reserve) * _SURELY
        most = {NEGLIGIBLE: _SURELY, END_OF_IMAGE: min(usual, _SHORT_OF_END), ACCEPTED: _SURELY}
        return np.array([most.get(row.partition(".")[0], usual) for row in ids])

    def near(self, sizes: Floats) -> Near | None:
        """The use of rows near sizes; None where it is far beyond what they may use."""
        count = sizes.size
        cases = np.repeat(sizes[:, None], 2 * count + 1, axis=1)
        for place, factor in enumerate(BESIDE):
            cases[np.arange(count), 1 + place * count + np.arange(count)] *= factor
        found = self.uses(cases)
        allowed, power = self.allowed(found.ids), found.powers[:, None]
        if not (found.uses[:, 0] <= _FARTHEST * allowed).all():
            return None
        whole = found.uses**power
        base, (less, more) = whole[:, :1], np.split(whole[:, 1:], 2, axis=1)
        is_lost = ~np.isfinite(more)
        low, high = (factor**power for factor in BESIDE)
        with np.errstate(invalid="ignore"):
            part: Floats = np.where(is_lost, (base - less) / (1 - low), (more - less) / (high - low))
        part = np.where(part > _NOTHING * base, part, 0.0)
        room = allowed**found.powers - (base[:, 0] - part.sum(axis=1))
        is_limit: Truths = np.any(part > 0, axis=1)
        if (room[is_limit] <= 0).any():
            return None
        is_free: Truths = ~np.any(part > 0, axis=0)
        return Near(found, allowed, sizes, part, room, is_limit, is_free)
