"""Specifications that hold together: the largest sizes of errors with which a mission meets every requirement.

Each row of the budget that can fail is held to what it may use. What an error adds to it is a power of the size: the
square where errors combine by root-sum-square or powers add, the size itself where they add up. So much room as is
left by the other errors is divided among the specified ones, so that the sum of weight·log(size) is largest
(`geometric_program`). Errors of any size are followed by exact ranges: what each adds is seen by whole checks, of a
fifth more and a fifth less of it, at the sizes found before, until these change no more. Values in SI and radians.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from datetime import date
from itertools import compress

import numpy as np

from bisar_budget.budget.check import check_mission
from bisar_budget.budget.judged_rows import CODE, REQUIREMENTS
from bisar_budget.design.geometric_program import Rows, largest_sizes
from bisar_budget.design.row_uses import Near, SpecifiedMission
from bisar_budget.design.specified import Specified, catalogue, ordered_noise, specified_errors, suitable_parts
from bisar_budget.design.table import Variation
from bisar_budget.effects.declared import END_OF_IMAGE, LOCATION
from bisar_budget.findings.specification import LEAST_ROOM, Broken, RowUse, Specification, SpecificationSheet
from bisar_budget.mission.changes import parts_of
from bisar_budget.mission.model import Mission
from bisar_budget.mission.parts import Entry
from bisar_budget.mission.quantities import QuestionError, tree_of
from bisar_budget.ranges.exact_ranges import Floats, Truths
from bisar_budget.workers import Progress, unseen

CHANGES = 1e-4  # of a size: less ends the search
ROUNDS = 20  # of it; four are enough where effects are proportional to errors
_ABOUT = 8  # rounds, after which only half of a step is made: where models change, steps go to and fro
_STEPS = 24  # between two sizes, where it is looked for the last that leaves an image
_SHRINKS = 400  # by a tenth: 18 powers of ten
_FREE, _WAKING, _WAKES = 1e18, 73, 1e-3  # times a size, in so many steps, and what a row may use more, to be free
_CLOSE = 1e-9  # of what a row may use


# ---------------------------------------------------------------- the search
def allocate(
    mission: Mission,
    *,
    keys: Mapping[str, float] | None = None,
    reserve: float | None = None,
    model: str | None = None,
    today: date,
    progress: Progress = unseen,
) -> SpecificationSheet:
    """Find the largest sizes of errors with which a mission, as a whole, meets every requirement.

    Arguments are those of `bisar_budget.allocate`; of `keys` the weights. Split, combination, coverage, autofocus and
    model of the mission hold; waivers do not count. The sheet has the verdict of a full check with what is ordered in
    place. `progress` is told how many rounds are done, and how many there may be.

    Raises
    ------
    QuestionError
        The question cannot be asked of this mission; says why.
    """
    if mission.allocation.combine == "each":
        raise QuestionError(_each(mission, keys, model, today))
    of = SpecifiedMission(mission, keys, reserve, model, today)
    broken = _broken(of)
    sizes, rows = (np.full(of.tiny.shape, math.nan), ()) if broken else _SizeSearch(of).found(progress)
    return _sheet(of, sizes, rows, broken)


def _each(mission: Mission, keys: Mapping[str, float] | None, model: str | None, today: date) -> str:
    """Say that each error alone is held to its limit, and list the limits."""
    asked = specified_errors(mission, tree_of(mission), keys)
    rows = check_mission(mission if model is None else Variation(mission, model).read(), today).rows
    said = []
    for one in asked:
        owner, *_, kind = [part for part in parts_of(one.key) if part != "platforms"]
        limits = [row for row in rows if row.subject.owner == owner and row.subject.kind == kind and row.allowable]
        if limits:
            least = min(limits, key=lambda row: row.allowable or math.inf)
            said.append(f"{one.key} {one.ordered(least.allowable or 0.0)[1]}")
    listed = f": {'; '.join(said)}" if said else ""
    return (
        "combine: each holds every error alone to its limit, and the single allowables are the answer"
        f"{listed}. accepted: combine: rss or sum, for specifications that hold together"
    )


def _broken(of: SpecifiedMission) -> tuple[Broken, ...]:
    """Rows in which the other errors leave no room."""
    nothing = np.array([one.nothing for one in of.specified])
    # What cannot be judged without these errors says nothing of them.
    rows = of.judged(nothing[:, None]).rows
    of.unjudged = {row.subject.id for row in rows if row.status[0] == CODE["not_evaluated"]}
    found = of.uses(nothing[:, None])
    return tuple(
        Broken(row_id, requirement, float(use) if math.isfinite(use) else None, float(most))
        for row_id, requirement, use, most in zip(
            found.ids, found.requirements, found.uses[:, 0], of.allowed(found.ids), strict=True
        )
        if use >= most * (1 - LEAST_ROOM)
    )


class _SizeSearch:
    """The search for the sizes of a mission's specified errors."""

    def __init__(self, of: SpecifiedMission) -> None:
        self.of = of

    def found(self, progress: Progress) -> tuple[Floats, tuple[RowUse, ...]]:
        """The sizes, (sizes,), nan: limited by nothing; and the rows that limit any, the one that does most first.

        At each step what rows use is taken as it is near the sizes of the step before.
        """
        sizes = self._begun()
        inside, is_woken = np.minimum(self.of.tiny, sizes), False
        before = Rows(np.zeros((0, sizes.size)), np.zeros(0), np.zeros(0))
        for done in range(ROUNDS):
            progress(done, ROUNDS)
            near = self.of.near(sizes)
            if near is None:  # too far: half of the way back, and no farther again where there is no image
                self._find_ends(inside, sizes)
                sizes = np.sqrt(np.minimum(sizes, self.of.ends) * inside)
                continue
            some = ~near.is_free
            if some.any():
                log = largest_sizes(self.of.weights[some], before.with_rows(near.rows()).of_sizes(some)).log
                inside, sizes = sizes, sizes.copy()
                sizes[some] = np.exp(log)
                if done >= _ABOUT:
                    sizes = np.sqrt(sizes * inside)
                # What adds up over all signs is the largest over all directions: what was seen before still holds.
                if self.of.combine == "sum":
                    before = before.with_rows(near.rows(f"mission.{LOCATION}"))
            self.of.most = np.where(sizes > self.of.largest, self.of.largest, self.of.most)
            if not some.any() or np.abs(np.log(sizes / inside)).max() < CHANGES:
                if is_woken or some.all():
                    break
                sizes, is_woken = self._woken(sizes, ~some), True
        return self._kept(sizes, before)

    def _woken(self, sizes: Floats, is_free: Truths) -> Floats:
        """Sizes at which errors that seem to be limited by nothing begin to use anything; of the others the same."""
        found = sizes.copy()
        for place in np.flatnonzero(is_free).tolist():
            steps = np.geomspace(sizes[place], min(self.of.largest[place], sizes[place] * _FREE), _WAKING)
            cases = np.repeat(sizes[:, None], _WAKING, axis=1)
            cases[place] = steps
            rows = self.of.uses(cases)
            with np.errstate(invalid="ignore"):
                rises = (rows.uses - rows.uses[:, :1]) / self.of.allowed(rows.ids)[:, None] > _WAKES
            first = int(rises.any(axis=0).argmax())
            found[place] = steps[max(first - 1, 0)]
            if first and np.isinf(rows.uses[:, first]).any():
                self.of.ends[place] = self._end_between(place, found, float(steps[first]))
        return found

    def _find_ends(self, inside: Floats, sizes: Floats) -> None:
        """Note the size from which an error leaves no image, of each that leaves none where the others are inside."""
        count = sizes.size
        cases = np.repeat(inside[:, None], count, axis=1)
        cases[np.arange(count), np.arange(count)] = sizes
        for place in np.flatnonzero(np.isinf(self.of.uses(cases).uses).any(axis=0)).tolist():
            self.of.ends[place] = self._end_between(place, inside, min(sizes[place], self.of.ends[place]))

    def _end_between(self, place: int, inside: Floats, high: float) -> float:
        """Largest size of an error, between one that leaves an image and one that does not, that still does."""
        low = float(inside[place])
        for _ in range(2):
            steps = np.geomspace(low, high, _STEPS)
            cases = np.repeat(inside[:, None], _STEPS, axis=1)
            cases[place] = steps
            is_lost = np.isinf(self.of.uses(cases).uses).any(axis=0)
            first = int(is_lost.argmax()) if is_lost.any() else _STEPS - 1
            low, high = float(steps[max(first - 1, 0)]), float(steps[first])
        return low

    def _begun(self) -> Floats:
        """Sizes that alone would each use so little of what limits it that all together have room."""
        count = self.of.tiny.size
        cases = np.repeat(self.of.tiny[:, None], count + 1, axis=1)
        cases[np.arange(count), np.arange(1, count + 1)] *= 2
        rows = self.of.judged(cases, is_of_sums=False).rows
        use = np.array([row.utilization for row in rows])
        is_end = np.array([row.binding[:1] == REQUIREMENTS.index(END_OF_IMAGE) for row in rows])
        with np.errstate(all="ignore"):
            is_own = np.abs(use[:, 1:] / use[:, :1] - 2) < 0.02
            reach = np.where(is_own & (use[:, :1] > 0), self.of.tiny / use[:, :1], math.inf)
            alone = reach.min(axis=0)
            self.of.ends = np.where(is_end, reach, math.inf).min(axis=0)
        return np.where(np.isfinite(alone), alone / (2 * count), self.of.tiny)

    def _kept(self, sizes: Floats, before: Rows) -> tuple[Floats, tuple[RowUse, ...]]:
        """Keep to what rows may use, to the last digit, and say what each error takes of it."""
        near = self.of.near(sizes)
        for _ in range(_SHRINKS):
            if near is not None:
                break
            sizes = sizes * 0.9
            near = self.of.near(sizes)
        if near is None:
            raise QuestionError("no sizes are found that leave an image")
        for _ in range(ROUNDS):
            used = self._used(near, sizes)
            over = float((used / near.allowed)[near.is_limit].max(initial=0.0))
            if over <= 1:
                break
            sizes = np.where(near.is_free, sizes, sizes / (over * (1 + _CLOSE)))
        else:
            used = self._used(near, sizes)
        some, limits = ~near.is_free, near.is_limit
        whole = (near.allowed**near.found.powers)[limits]
        parts, multipliers = near.part[limits] / whole[:, None], np.zeros(whole.size)
        if some.any():
            rows = before.with_rows(near.rows()).of_sizes(some)
            of_room = largest_sizes(self.of.weights[some], rows).multipliers
            multipliers = of_room[-whole.size :] * whole / near.room[limits]
            self._with_earlier(before, of_room, near, sizes, parts, multipliers)
        rows_used = tuple(self._row_uses(near, used, parts, multipliers))
        return np.where(near.is_free, math.nan, sizes), rows_used

    @staticmethod
    def _with_earlier(
        before: Rows, of_room: Floats, near: Near, sizes: Floats, parts: Floats, multipliers: Floats
    ) -> None:
        """Count what a displacement is worth in other directions to its row: parts are those of all, by worth."""
        if not before.room.size:
            return
        place = list(compress(near.found.ids, near.is_limit)).index(f"mission.{LOCATION}")
        allowed = near.allowed[near.is_limit][place]
        worth = of_room[: before.room.size] * allowed / before.room
        whole = multipliers[place] + worth.sum()
        if whole > 0:
            earlier = (worth[:, None] * before.share * sizes / allowed).sum(axis=0)
            parts[place] = (multipliers[place] * parts[place] + earlier) / whole
            multipliers[place] = whole

    def _used(self, near: Near, sizes: Floats) -> Floats:
        """Utilizations with sizes of the rows that are seen near them, (rows,)."""
        found = self.of.uses(sizes[:, None])
        uses = dict(zip(found.ids, found.uses[:, 0].tolist(), strict=True))
        return np.array([uses.get(row, 0.0) for row in near.found.ids])

    def _row_uses(self, near: Near, used: Floats, parts: Floats, multipliers: Floats) -> Iterator[RowUse]:
        """Rows by what they are worth; parts, (limits, sizes), are those of the power of what each may use."""
        places = np.flatnonzero(near.is_limit)
        for limit in np.argsort(-multipliers, kind="stable").tolist():
            place = int(places[limit])
            use, allowed = float(used[place]), float(near.allowed[place])
            taken = zip(self.of.specified, parts[limit].tolist(), strict=True)
            shares = {one.key: part for one, part in taken if part > 0}
            whole, worth = (use / allowed) ** float(near.found.powers[place]), float(multipliers[limit])
            # An error that grows faster than its size takes less than what a little more of it would add.
            excess = max(1.0, sum(shares.values()) / whole) if whole else 1.0
            shares = {key: part / excess for key, part in shares.items()}
            fixed = max(0.0, whole - sum(shares.values()))
            row, requirement = near.found.ids[place], near.found.requirements[place]
            yield RowUse(row, requirement, use, allowed, fixed, shares, worth * excess)


def _shares(rows: Sequence[RowUse], key: str) -> dict[str, float]:
    """Largest part that an error takes of what a row of each requirement may use."""
    shares: dict[str, float] = {}
    for row in rows:
        if row.requirement is not None and key in row.shares:
            shares[row.requirement] = max(shares.get(row.requirement, 0.0), row.shares[key])
    return shares


# ---------------------------------------------------------------- the sheet
def _sheet(
    of: SpecifiedMission, sizes: Floats, rows: tuple[RowUse, ...], broken: tuple[Broken, ...]
) -> SpecificationSheet:
    """Put what was found into words and units, and check the mission with what is ordered."""
    among = catalogue(of.stated)
    specifications = tuple(
        _specification(of.stated, one, float(one.numbers(np.array(size))), rows, among)
        for one, size in zip(of.specified, sizes.tolist(), strict=True)
    )
    findings = check_mission(of.with_values([one.text for one in specifications]), of.today)
    return SpecificationSheet(
        file=of.given.file,
        name=of.given.name,
        model=of.model,
        combine=of.combine,
        status=findings.status,
        reserve=of.reserve,
        requirements=findings.requirements,
        specifications=specifications,
        rows=rows,
        broken=broken,
        notes=tuple(of.notes),
        changes=of.given.changes,
        findings=findings,
        is_equal=of.equal,
    )


def _specification(
    mission: Mission, one: Specified, value: float, rows: Sequence[RowUse], among: Sequence[Entry]
) -> Specification:
    """The size to order of an error, by its number as found; nan: nothing limits it."""
    declared = one.number.value
    silent = Specification(
        key=one.key,
        weight=one.weight,
        unit=one.number.dimension.si,
        value=None,
        ordered=None,
        text="",
        declared=declared,
        declared_text="" if declared is None else one.number.text(declared),
        shares={},
    )
    if math.isnan(value):
        return silent
    ordered, text = one.ordered(value)
    return silent._replace(
        value=value,
        ordered=ordered,
        text=text,
        shares=_shares(rows, one.key),
        parts=tuple(suitable_parts(mission, one, ordered, among)),
        found_text=one.said(value),
        remark=ordered_noise(mission, one, ordered),
    )
