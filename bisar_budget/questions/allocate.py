"""Specifications of several errors: the largest sizes with which a mission meets every requirement.

The utilization of a row of the budget is its error divided by its limit. Each row that can fail has an allowed
utilization. An error contributes a power of its size to the row: the square if errors combine by root-sum-square or
if their powers add, and the size itself if errors add linearly. The errors without a specification use a part of each
allowed utilization. The search divides the remaining part among the specified errors so that the sum of
weight·log(size) is largest; the module `geometric_program` solves this problem. The phases follow from exact ranges.
They are valid for errors of any size, but they are not proportional to the size. In each round of the search, full
checks are therefore made with each error 20 % larger and 20 % smaller than in the round before, to determine the
contribution of the error to each row. The search ends when the sizes no longer change. Values are in SI and radians.
"""

import datetime as dt
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from itertools import compress
from numbers import Real

import numpy as np

from bisar_budget.arrays import Booleans, Floats
from bisar_budget.budget.check import check_mission
from bisar_budget.budget.judged_rows import CODE, REQUIREMENTS
from bisar_budget.effects.declared import END_OF_IMAGE, LOCATION
from bisar_budget.faults import printable
from bisar_budget.findings.requirement import Outside
from bisar_budget.findings.specification import MIN_ROOM_FRACTION, Broken, RowUse, Specification, SpecificationSheet
from bisar_budget.mission.model import Mission
from bisar_budget.mission.parts import Entry
from bisar_budget.mission.quantities import QuestionError, tree_of
from bisar_budget.questions.geometric_program import Rows, largest_sizes
from bisar_budget.questions.offers import compared_offer
from bisar_budget.questions.outside import influences_of
from bisar_budget.questions.progress import watched_checks
from bisar_budget.questions.results import AllocateResult
from bisar_budget.questions.row_uses import Near, SpecifiedMission
from bisar_budget.questions.specified import Specified, catalogue, ordered_noise, specified_errors, suitable_parts
from bisar_budget.questions.table import Variation
from bisar_budget.workers import Progress


@dataclass(frozen=True)
class AllocationSettings:
    """Settings of the search for the largest sizes.

    Attributes
    ----------
    settled_change : float
        The search ends when the logarithm of every size changes by less than this value from one round to the next.
    max_rounds : int
        Largest number of rounds. Four are enough if effects are proportional to errors.
    full_step_rounds : int
        Number of rounds in which the full computed change is applied to the sizes. In later rounds half of it is
        applied (on a logarithmic scale), because full changes can oscillate.
    end_steps : int
        Number of sizes that are tried between two known sizes, to find the largest size at which an image forms.
    max_shrinks : int
        Largest number of times that all sizes are reduced by a tenth. All these reductions together amount to 18
        orders of magnitude.
    free_ratio : float
        For an error that no row seems to limit: ratio of the largest to the smallest size that is tried.
    free_steps : int
        Number of sizes that are tried in the range of `free_ratio`.
    free_fraction : float
        For an error that no row seems to limit: largest fraction of an allowed utilization that it may use.
    close_fraction : float
        Margin that is kept below an allowed utilization when sizes are reduced, as a fraction of this utilization.
    """

    settled_change: float = 1e-4
    max_rounds: int = 20
    full_step_rounds: int = 8
    end_steps: int = 24
    max_shrinks: int = 400
    free_ratio: float = 1e18
    free_steps: int = 73
    free_fraction: float = 1e-3
    close_fraction: float = 1e-9


ALLOCATION_SETTINGS = AllocationSettings()


# ---------------------------------------------------------------- the search
def allocate(
    mission: Mission,
    keys: str | Sequence[str] | Mapping[str, float] | None = None,
    *,
    reserve: float | None = None,
    offer: Mission | None = None,
    model: str | None = None,
    date: str | dt.date | None = None,
    outside: Outside | None = None,
) -> AllocateResult:
    """Find specifications for errors of a mission; if all of them are met, the mission meets every requirement.

    The split, the rule of combination, the coverage factor, autofocus and the model are taken from the mission.
    Waivers are ignored. The specification sheet in the result contains the verdict of a full check of the mission
    with the specified sizes.

    Parameters
    ----------
    mission : Mission
        As in `check`.
    keys : str, sequence or mapping, optional
        Keys of the errors to specify, or positive weights by key; by default `allocation.specify` of the file, or
        else the usual keys.
    reserve : float, optional
        Fraction of every limit to keep free, 0 to 1; by default 1 minus `allocation.warn_above`.
    offer : Mission, optional
        Mission of a supplier, whose declared errors are compared with the specifications.
    model, date, outside
        As in `check`.

    Raises
    ------
    QuestionError
        The question cannot be answered for this mission, for example because a key is unknown; the message says why.
    """
    today, influences = influences_of(mission, model, date, outside)
    if reserve is not None and not (isinstance(reserve, Real) and 0 <= reserve < 1):
        raise QuestionError(f"reserve {reserve!r}: accepted: a part from 0 to less than 1")
    weights = _weighted([keys] if isinstance(keys, str) else keys)
    if mission.allocation.combine == "each":
        raise QuestionError(_each(mission, weights, model, today))
    specified_mission = SpecifiedMission(mission, weights, reserve, model, today)
    broken = _broken(specified_mission)
    sizes, rows = np.full(specified_mission.tiny.shape, math.nan), tuple[RowUse, ...]()
    if not broken:
        with watched_checks(mission.name) as progress:
            sizes, rows = _SizeSearch(specified_mission).found(progress)
    sheet = _sheet(specified_mission, sizes, rows, broken)._replace(overrides=influences)
    return AllocateResult(sheet, None if offer is None else compared_offer(sheet, offer, today))


def _weighted(keys: Sequence[str] | Mapping[str, float] | None) -> Mapping[str, float] | None:
    """Return the weights of the errors to specify, by key.

    Keys that are given without weights get the weight 1. The result is None if `keys` is None. Raises `QuestionError`
    for a weight that is not a positive number.
    """
    if not isinstance(keys, Mapping):
        return keys if keys is None else dict.fromkeys(keys, 1.0)
    for key, weight in keys.items():
        if not (isinstance(weight, Real) and 0 < weight < math.inf):
            raise QuestionError(f"--for {printable(key)}: has the weight {weight!r}; accepted: a number above 0")
    return keys


def _each(mission: Mission, keys: Mapping[str, float] | None, model: str | None, today: date) -> str:
    """Make the error message for a mission with `combine: each`, for which no joint sizes of errors exist.

    With this rule every error is judged alone. The error message therefore lists the allowable size of each error.
    """
    errors = specified_errors(mission, tree_of(mission), keys)
    rows = check_mission(mission if model is None else Variation(mission, model).read(), today).rows
    limits_in_words = []
    for error in errors:
        owner, *_, name = [part for part in error.steps if part != "platforms"]
        limits = [row for row in rows if (row.owner, row.subject.kind) == (owner, name) and row.allowable]
        if limits:
            least = min(limits, key=lambda row: row.allowable or math.inf)
            limits_in_words.append(f"{error.key} {error.ordered(least.allowable or 0.0)[1]}")
    listed = f": {'; '.join(limits_in_words)}" if limits_in_words else ""
    return (
        "combine: each judges every error alone, so the allowables of the single errors are the answer"
        f"{listed}. accepted: combine: rss or sum, for specifications that hold together"
    )


def _broken(specified_mission: SpecifiedMission) -> tuple[Broken, ...]:
    """Find the rows in which errors without a specification already use the allowed utilization.

    Such a row leaves no room for the specified errors.
    """
    no_errors = np.array([error.nothing for error in specified_mission.specified])
    # Rows that cannot be judged even without the specified errors do not limit them.
    rows = specified_mission.judged(no_errors[:, None]).rows
    specified_mission.unjudged = {row.subject.id for row in rows if row.status[0] == CODE["not_evaluated"]}
    row_uses = specified_mission.uses(no_errors[:, None])
    return tuple(
        Broken(row_id, requirement, float(use) if math.isfinite(use) else None, float(most))
        for row_id, requirement, use, most in zip(
            row_uses.ids,
            row_uses.requirements,
            row_uses.uses[:, 0],
            specified_mission.allowed(row_uses.ids),
            strict=True,
        )
        if use >= most * (1 - MIN_ROOM_FRACTION)
    )


class _SizeSearch:
    """Search for the largest sizes of a mission's specified errors."""

    def __init__(self, mission: SpecifiedMission) -> None:
        self.mission = mission

    def found(self, progress: Progress) -> tuple[Floats, tuple[RowUse, ...]]:
        """Find the largest sizes, and the rows that limit them.

        Returns two values: the sizes (sizes,), which are NaN for errors that no row limits, and the limiting rows,
        with the most restrictive row first. In each round, the search evaluates the utilizations near the sizes found
        in the previous round.
        """
        sizes = self._first_sizes()
        inside, is_extended = np.minimum(self.mission.tiny, sizes), False
        before = Rows(np.zeros((0, sizes.size)), np.zeros(0), np.zeros(0))
        for done in range(ALLOCATION_SETTINGS.max_rounds):
            progress(done, ALLOCATION_SETTINGS.max_rounds)
            near = self.mission.near(sizes)
            if near is None:  # too far: halfway back, and never again to sizes without an image
                self._find_ends(inside, sizes)
                sizes = np.sqrt(np.minimum(sizes, self.mission.ends) * inside)
                continue
            is_limited = ~near.is_free
            if is_limited.any():
                log = largest_sizes(
                    self.mission.weights[is_limited], before.with_rows(near.rows()).of_sizes(is_limited)
                ).log
                inside, sizes = sizes, sizes.copy()
                sizes[is_limited] = np.exp(log)
                if done >= ALLOCATION_SETTINGS.full_step_rounds:
                    sizes = np.sqrt(sizes * inside)
                # A sum over all signs is the largest over all directions, so earlier directions still limit it.
                if self.mission.combine == "sum":
                    before = before.with_rows(near.rows(f"mission.{LOCATION}"))
            self.mission.most = np.where(sizes > self.mission.largest, self.mission.largest, self.mission.most)
            if not is_limited.any() or np.abs(np.log(sizes / inside)).max() < ALLOCATION_SETTINGS.settled_change:
                if is_extended or is_limited.all():
                    break
                sizes, is_extended = self._free_sizes(sizes, ~is_limited), True
        return self._kept(sizes, before)

    def _free_sizes(self, sizes: Floats, is_free: Booleans) -> Floats:
        """Enlarge the sizes of errors that no row seems to limit, and return all sizes (sizes,).

        The size of such an error is increased in steps until the error uses more than the fraction `free_fraction` of
        an allowed utilization; the last size before this point is returned. `is_free` marks the errors to enlarge,
        (sizes,). The other sizes are returned unchanged.
        """
        extended = sizes.copy()
        for index in np.flatnonzero(is_free).tolist():
            steps = np.geomspace(
                sizes[index],
                min(self.mission.largest[index], sizes[index] * ALLOCATION_SETTINGS.free_ratio),
                ALLOCATION_SETTINGS.free_steps,
            )
            cases = np.repeat(sizes[:, None], ALLOCATION_SETTINGS.free_steps, axis=1)
            cases[index] = steps
            rows = self.mission.uses(cases)
            with np.errstate(invalid="ignore"):
                rise = (rows.uses - rows.uses[:, :1]) / self.mission.allowed(rows.ids)[:, None]
                begins = rise > ALLOCATION_SETTINGS.free_fraction
            first = int(begins.any(axis=0).argmax())
            extended[index] = steps[max(first - 1, 0)]
            if first and np.isinf(rows.uses[:, first]).any():
                self.mission.ends[index] = self._end_between(index, extended, float(steps[first]))
        return extended

    def _find_ends(self, inside: Floats, sizes: Floats) -> None:
        """Update `ends`, which holds for each error the size at and above which no image forms.

        `sizes` (sizes,) are the sizes to try, and `inside` (sizes,) are sizes at which an image forms. For each
        error, the mission is checked with the size of this error from `sizes` and the sizes of all other errors from
        `inside`. An element of `ends` is updated only if this check finds no image.
        """
        count = sizes.size
        cases = np.repeat(inside[:, None], count, axis=1)
        cases[np.arange(count), np.arange(count)] = sizes
        for index in np.flatnonzero(np.isinf(self.mission.uses(cases).uses).any(axis=0)).tolist():
            self.mission.ends[index] = self._end_between(index, inside, min(sizes[index], self.mission.ends[index]))

    def _end_between(self, index: int, inside: Floats, high: float) -> float:
        """Find the largest size of the error with index `index` at which an image still forms.

        Sizes from `inside[index]`, at which an image forms, to `high` are tried. All other errors have the sizes in
        `inside`.
        """
        low = float(inside[index])
        for _ in range(2):
            steps = np.geomspace(low, high, ALLOCATION_SETTINGS.end_steps)
            cases = np.repeat(inside[:, None], ALLOCATION_SETTINGS.end_steps, axis=1)
            cases[index] = steps
            is_lost = np.isinf(self.mission.uses(cases).uses).any(axis=0)
            first = int(is_lost.argmax()) if is_lost.any() else ALLOCATION_SETTINGS.end_steps - 1
            low, high = float(steps[max(first - 1, 0)]), float(steps[first])
        return low

    def _first_sizes(self) -> Floats:
        """Choose initial sizes for the search, (sizes,), small enough that all errors together exceed no limit."""
        count = self.mission.tiny.size
        cases = np.repeat(self.mission.tiny[:, None], count + 1, axis=1)
        cases[np.arange(count), np.arange(1, count + 1)] *= 2
        rows = self.mission.judged(cases, is_of_sums=False).rows
        use = np.array([row.utilization for row in rows])
        is_end = np.array([row.binding[:1] == REQUIREMENTS.index(END_OF_IMAGE) for row in rows])
        with np.errstate(all="ignore"):
            is_proportional = np.abs(use[:, 1:] / use[:, :1] - 2) < 0.02
            size_at_limit = np.where(is_proportional & (use[:, :1] > 0), self.mission.tiny / use[:, :1], math.inf)
            alone = size_at_limit.min(axis=0)
            self.mission.ends = np.where(is_end, size_at_limit, math.inf).min(axis=0)
        return np.where(np.isfinite(alone), alone / (2 * count), self.mission.tiny)

    def _kept(self, sizes: Floats, before: Rows) -> tuple[Floats, tuple[RowUse, ...]]:
        """Reduce the sizes until no row exceeds its allowed utilization.

        Returns two values: the sizes (sizes,), which are NaN for errors that no row limits, and the limiting rows,
        with the share of their limits that each error uses. `before` contains the constraints on the location error
        from earlier rounds of the search, in which the largest displacement had a different direction.
        """
        near = self.mission.near(sizes)
        for _ in range(ALLOCATION_SETTINGS.max_shrinks):
            if near is not None:
                break
            sizes = sizes * 0.9
            near = self.mission.near(sizes)
        if near is None:
            raise QuestionError("no sizes are found that leave an image")
        for _ in range(ALLOCATION_SETTINGS.max_rounds):
            used = self._used(near, sizes)
            over = float((used / near.allowed)[near.is_limit].max(initial=0.0))
            if over <= 1:
                break
            sizes = np.where(near.is_free, sizes, sizes / (over * (1 + ALLOCATION_SETTINGS.close_fraction)))
        else:
            used = self._used(near, sizes)
        is_limited, limits = ~near.is_free, near.is_limit
        limit_powers = (near.allowed**near.found.powers)[limits]
        shares, multipliers = near.part[limits] / limit_powers[:, None], np.zeros(limit_powers.size)
        if is_limited.any():
            rows = before.with_rows(near.rows()).of_sizes(is_limited)
            program_multipliers = largest_sizes(self.mission.weights[is_limited], rows).multipliers
            multipliers = program_multipliers[-limit_powers.size :] * limit_powers / near.room[limits]
            self._with_earlier(before, program_multipliers, near, sizes, shares, multipliers)
        rows_used = tuple(self._row_uses(near, used, shares, multipliers))
        return np.where(near.is_free, math.nan, sizes), rows_used

    @staticmethod
    def _with_earlier(
        before: Rows, program_multipliers: Floats, near: Near, sizes: Floats, shares: Floats, multipliers: Floats
    ) -> None:
        """Merge earlier constraints on the location error into the row of the location error.

        The constraints `before` are from earlier rounds of the search, in which the largest displacement had a
        different direction. Their multipliers are added to the multiplier of the row. The shares of the errors are
        averaged with the multipliers as weights. `shares` and `multipliers` are changed in place.
        """
        if not before.room.size:
            return
        index = list(compress(near.found.ids, near.is_limit)).index(f"mission.{LOCATION}")
        allowed = near.allowed[near.is_limit][index]
        earlier_multipliers = program_multipliers[: before.room.size] * allowed / before.room
        total = multipliers[index] + earlier_multipliers.sum()
        if total > 0:
            earlier_shares = (earlier_multipliers[:, None] * before.share * sizes / allowed).sum(axis=0)
            shares[index] = (multipliers[index] * shares[index] + earlier_shares) / total
            multipliers[index] = total

    def _used(self, near: Near, sizes: Floats) -> Floats:
        """Compute the utilizations (rows,) of the rows in `near` for given sizes of the errors, (sizes,)."""
        row_uses = self.mission.uses(sizes[:, None])
        uses = dict(zip(row_uses.ids, row_uses.uses[:, 0].tolist(), strict=True))
        return np.array([uses.get(row, 0.0) for row in near.found.ids])

    def _row_uses(self, near: Near, used: Floats, parts: Floats, multipliers: Floats) -> Iterator[RowUse]:
        """Yield the rows that limit the sizes, in descending order of their multipliers.

        `used` (rows,) are the utilizations of the rows in `near`. In a row with the exponent p, the p-th powers of
        the contributions of the errors add. `parts` (limiting rows, sizes) are these p-th powers, divided by the p-th
        power of the allowed utilization. `multipliers` (limiting rows,) describe how strongly each row limits the
        sizes, see `RowUse`.
        """
        row_indices = np.flatnonzero(near.is_limit)
        for limit in np.argsort(-multipliers, kind="stable").tolist():
            index = int(row_indices[limit])
            use, allowed = float(used[index]), float(near.allowed[index])
            parts_by_error = zip(self.mission.specified, parts[limit].tolist(), strict=True)
            shares = {error.key: share for error, share in parts_by_error if share > 0}
            used_power, multiplier = (use / allowed) ** float(near.found.powers[index]), float(multipliers[limit])
            # The effect of an error that grows faster than its size is smaller than its slope times the size.
            excess = max(1.0, sum(shares.values()) / used_power) if used_power else 1.0
            shares = {key: share / excess for key, share in shares.items()}
            fixed = max(0.0, used_power - sum(shares.values()))
            row, requirement = near.found.ids[index], near.found.requirements[index]
            yield RowUse(row, requirement, use, allowed, fixed, shares, multiplier * excess)


def _shares(rows: Sequence[RowUse], key: str) -> dict[str, float]:
    """Return, for each requirement, the largest share of a row's limit that an error uses.

    Only rows that belong to the requirement are considered. `key` is the key of the error. The result maps
    requirements to shares.
    """
    shares: dict[str, float] = {}
    for row in rows:
        if row.requirement is not None and key in row.shares:
            shares[row.requirement] = max(shares.get(row.requirement, 0.0), row.shares[key])
    return shares


# ---------------------------------------------------------------- the sheet
def _sheet(
    specified_mission: SpecifiedMission, sizes: Floats, rows: tuple[RowUse, ...], broken: tuple[Broken, ...]
) -> SpecificationSheet:
    """Make the sheet of specifications from the sizes found by the search.

    It includes the findings of a check of the mission with the specified sizes. `broken` are rows that leave no room
    for specified errors.
    """
    parts = catalogue(specified_mission.stated)
    specifications = tuple(
        _specification(specified_mission.stated, error, float(error.numbers(np.array(size))), rows, parts)
        for error, size in zip(specified_mission.specified, sizes.tolist(), strict=True)
    )
    findings = check_mission(
        specified_mission.with_values([each.text for each in specifications]), specified_mission.today
    )
    return SpecificationSheet(
        file=specified_mission.given.file,
        name=specified_mission.given.name,
        model=specified_mission.model,
        combine=specified_mission.combine,
        status=findings.status,
        reserve=specified_mission.reserve,
        requirements=findings.requirements,
        specifications=specifications,
        rows=rows,
        broken=broken,
        notes=tuple(specified_mission.notes),
        changes=specified_mission.given.changes,
        findings=findings,
        is_equal=specified_mission.equal,
    )


def _specification(
    mission: Mission, error: Specified, value: float, rows: Sequence[RowUse], parts: Sequence[Entry]
) -> Specification:
    """Make the specification of an error from its computed value.

    `value` is NaN if no row limits the error.
    """
    declared = error.number.value
    unlimited = Specification(
        key=error.key,
        weight=error.weight,
        unit=error.number.dimension.si,
        value=None,
        ordered=None,
        text="",
        declared=declared,
        declared_text="" if declared is None else error.number.text(declared),
        shares={},
    )
    if math.isnan(value):
        return unlimited
    ordered, text = error.ordered(value)
    return unlimited._replace(
        value=value,
        ordered=ordered,
        text=text,
        shares=_shares(rows, error.key),
        parts=tuple(suitable_parts(mission, error, ordered, parts)),
        found_text=error.said(value),
        remark=ordered_noise(mission, error, ordered),
    )
