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
from functools import cached_property
from typing import NamedTuple

import numpy as np

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.budget.check import check_mission
from bisar_budget.budget.judged_mission import JudgedMission, judged_mission
from bisar_budget.budget.judged_requirements import SMALL_RAD, TENTH
from bisar_budget.budget.judged_rows import CODE, REQUIREMENTS, Why
from bisar_budget.design.geometric_program import Rows, largest_sizes
from bisar_budget.design.specified import Specified, specified_errors
from bisar_budget.design.table import Variation
from bisar_budget.design.varied import is_held
from bisar_budget.effects.declared import CUBIC, END_OF_IMAGE, LOCATION, QUADRATIC
from bisar_budget.effects.oscillators import noise_of
from bisar_budget.faults import MissionError, SetValue
from bisar_budget.findings.specification import Broken, RowUse, Specification, SpecificationSheet
from bisar_budget.mission.changes import ACCEPTED_ERRORS, parts_of
from bisar_budget.mission.load import folder_of
from bisar_budget.mission.model import MetricSplits, Mission
from bisar_budget.mission.parts import Entry, PartError, entries, folders
from bisar_budget.mission.quantities import QuestionError, tree_of, with_number
from bisar_budget.ranges.exact_ranges import Floats, Truths
from bisar_budget.units import format_quantity
from bisar_budget.workers import Progress, unseen

BESIDE = (0.8, 1.2)  # of a size, at which it is seen what an error adds
CHANGES = 1e-4  # of a size: less ends the search
ROUNDS = 20  # of it; four are enough where effects are proportional to errors
_ABOUT = 8  # rounds, after which only half of a step is made: where models change, steps go to and fro
_STEPS = 24  # between two sizes, where it is looked for the last that leaves an image
_FARTHEST = 3.0  # of what a row may use, up to which a step of the search may go
_SURELY = 1 - 1e-5  # of a limit: a case by itself settles to digits of its own
_SHORT_OF_END = 0.995  # of the size from which there is no image: that is found to 0.1 %
_OFFSETS = (1.0, 10.0, 100.0, 1e3)  # at which the phase noise of an ordered level is said [Hz]
_SHRINKS = 400  # by a tenth: 18 powers of ten
_FREE, _WAKING, _WAKES = 1e18, 73, 1e-3  # times a size, in so many steps, and what a row may use more, to be free
_CLOSE = 1e-9  # of what a row may use
_NOTHING = 1e-13  # of a row: what rounding leaves of it
# What the ids of rows begin with that have no requirement: effects that none takes, and what a file may state.
NEGLIGIBLE, ACCEPTED = "negligible", "accepted"
_WARN_ONLY = ("autofocus_pull_in", "spatial_variance")  # kinds of rows that warn and never fail


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

    Parameters
    ----------
    mission : Mission
        As loaded. Its split, combination, coverage, autofocus and model hold; waivers do not count.
    keys : mapping of str to float, optional
        Keys of the errors to specify, with their weights; omitted: those of `allocation.specify`, else the usual.
    reserve : float, optional
        Part of every limit that is kept free; omitted: what `allocation.warn_above` leaves.
    model : str, optional
        Gating model in place of the mission's own.
    today : date
        Day of the check.
    progress : callable, optional
        Is told how many rounds are done, and how many there may be.

    Returns
    -------
    SpecificationSheet
        With the verdict of a full check that has what is ordered in place.

    Raises
    ------
    QuestionError
        The question cannot be asked of this mission; says why.
    """
    if mission.allocation.combine == "each":
        raise QuestionError(_each(mission, keys, model, today))
    search = _SpecificationSearch(mission, keys, reserve, model, today)
    broken = search.broken()
    if broken:
        return search.sheet(None, broken)
    return search.sheet(search.found(progress), ())


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


class _RowUses(NamedTuple):
    """Utilizations of the rows that can fail in some cases, (rows, cases), by their ids; and what judges each."""

    ids: list[str]
    requirements: list[str | None]
    powers: Floats
    uses: Floats


class _Found(NamedTuple):
    """Sizes as found, (sizes,), nan: limited by nothing; with the rows that limit any, (rows,).

    `parts` are those of the power of what each row may use, (rows, sizes).
    """

    sizes: Floats
    ids: list[str]
    requirements: list[str | None]
    powers: Floats
    used: Floats
    allowed: Floats
    parts: Floats
    multipliers: Floats


class _SpecificationSearch:
    """One mission and the errors of it that are specified."""

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
            mission = mission._replace(waivers=())
            self.notes.append("waivers do not count: a specification has to hold by itself")
        self.variation, self.equal = Variation(mission, model), tuple(self._equal(mission))
        base = self.variation.read(self.equal)._replace(waivers=())
        self.specified = specified_errors(base, tree_of(mission), keys)
        self.weights = np.array([one.weight for one in self.specified])
        least = 1 - base.allocation.warn_above
        self.reserve = least if reserve is None else reserve
        self.combine, self.model = base.allocation.combine, base.gating_model
        # A mission that states each of them: where arrays are put into their places.
        tiny = np.array([one.tiny for one in self.specified])
        try:
            self.stated = self._with([one.text(size) for one, size in zip(self.specified, tiny, strict=True)])
        except MissionError as error:
            fault = error.faults[0]
            raise QuestionError(f"{fault.key}: {fault.problem}; it cannot be specified beside the rest") from None
        for one in self.specified:
            if not is_held(self.stated, one.key, is_stated=True):
                raise QuestionError(f"{one.key}: decides more than its own size; {ACCEPTED_ERRORS}")
        self.tiny, self.unjudged = tiny, set[str]()
        # Sizes that end an image, and those beyond what a mission file may state, once they were met.
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

    def _with(self, texts: Sequence[str]) -> Mission:
        """The mission with numbers, as the file would have them; empty: as it is."""
        changes = [SetValue(one.key, text) for one, text in zip(self.specified, texts, strict=True) if text]
        return self.variation.read([*self.equal, *changes])._replace(waivers=())

    # ---------------------------------------------------------------- what rows use
    def _judged(self, sizes: Floats, *, is_of_sums: bool = True) -> JudgedMission:
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

    def _uses(self, sizes: Floats) -> _RowUses:
        """Utilizations of the rows that can fail, with sizes."""
        judged = self._judged(sizes)
        ids, requirements, powers, uses = list[str](), list[str | None](), list[float](), list[Floats]()
        for row in judged.rows:
            is_judged = ~np.isin(row.status, (CODE["info"], CODE["not_declared"]))
            if not is_judged.any():
                continue
            is_lost = np.isin(row.status, (CODE["fail"], CODE["not_evaluated"])) & np.isnan(row.utilization)
            is_lost &= (row.why != Why.EFFECT_NOT_TAKEN) & (row.subject.id not in self.unjudged)
            is_heeded = self.reserve > 0 or row.subject.kind not in _WARN_ONLY
            use = np.nan_to_num(row.utilization, nan=0.0, posinf=math.inf) * is_heeded
            use = np.where(is_lost, math.inf, use)
            binding = int(row.binding.max())
            ids.append(row.subject.id)
            requirements.append(
                row.metric if binding < 0 or binding >= len(REQUIREMENTS) - 1 else REQUIREMENTS[binding]
            )
            powers.append(self._power(row.subject.kind))
            uses.append(use)
        level = min(TENTH * float(np.max(self.stated.requirements.quadratic_phase_error)), SMALL_RAD)
        for one in judged.untaken:
            ids.append(f"{NEGLIGIBLE}.{one.kind}")
            requirements.append(None)
            powers.append(1.0 if self.combine == "sum" else 2.0)
            uses.append(np.broadcast_to(one.total, sizes.shape[1:]) / level)
        for name, limits in ((END_OF_IMAGE, self.ends), (ACCEPTED, self.most)):
            for place in np.flatnonzero(np.isfinite(limits)).tolist():
                ids.append(f"{name}.{self.specified[place].key}")
                requirements.append(None)
                powers.append(2.0)
                uses.append(sizes[place] / limits[place])
        return _RowUses(ids, requirements, np.array(powers), np.array(uses))

    def _power(self, kind: str) -> float:
        """Power of a size that adds up in a row."""
        is_summed = self.combine == "sum" and kind in (QUADRATIC, CUBIC, LOCATION)
        return 1.0 if is_summed or kind in _WARN_ONLY else 2.0

    def _allowed(self, ids: Sequence[str]) -> Floats:
        """Largest utilization of each row; one without a requirement, or without an image beyond, stays below 1."""
        usual = (1 - self.reserve) * _SURELY
        most = {NEGLIGIBLE: _SURELY, END_OF_IMAGE: min(usual, _SHORT_OF_END), ACCEPTED: _SURELY}
        return np.array([most.get(row.partition(".")[0], usual) for row in ids])

    # ---------------------------------------------------------------- steps
    def broken(self) -> tuple[Broken, ...]:
        """Rows in which the other errors leave no room."""
        nothing = np.array([one.nothing for one in self.specified])
        # What cannot be judged without these errors says nothing of them.
        rows = self._judged(nothing[:, None]).rows
        self.unjudged = {row.subject.id for row in rows if row.status[0] == CODE["not_evaluated"]}
        found = self._uses(nothing[:, None])
        return tuple(
            Broken(row_id, requirement, float(use), float(most))
            for row_id, requirement, use, most in zip(
                found.ids, found.requirements, found.uses[:, 0], self._allowed(found.ids), strict=True
            )
            if use >= most * (1 - 1e-6)
        )

    def found(self, progress: Progress) -> _Found:
        """Search for the sizes: at each step what rows use is taken as it is near the sizes of the step before."""
        sizes = self._begun()
        inside, before, is_woken = np.minimum(self.tiny, sizes), _Cuts([], [], []), False
        for done in range(ROUNDS):
            progress(done, ROUNDS)
            near = self._near(sizes)
            if near is None:  # too far: half of the way back, and no farther again where there is no image
                self._find_ends(inside, sizes)
                sizes = np.sqrt(np.minimum(sizes, self.ends) * inside)
                continue
            some = ~near.is_free
            if some.any():
                log = largest_sizes(self.weights[some], before.with_rows(near).rows(some)).log
                inside, sizes = sizes, sizes.copy()
                sizes[some] = np.exp(log)
                if done >= _ABOUT:
                    sizes = np.sqrt(sizes * inside)
                if self.combine == "sum":
                    before = before.with_rows(near, of=f"mission.{LOCATION}")
            self.most = np.where(sizes > self.largest, self.largest, self.most)
            if not some.any() or np.abs(np.log(sizes / inside)).max() < CHANGES:
                if is_woken or some.all():
                    break
                sizes, is_woken = self._woken(sizes, ~some), True
        return self._kept(sizes, before)

    def _woken(self, sizes: Floats, is_free: Truths) -> Floats:
        """Sizes at which errors that seem to be limited by nothing begin to use anything; of the others the same."""
        found = sizes.copy()
        for place in np.flatnonzero(is_free).tolist():
            steps = np.geomspace(sizes[place], min(self.largest[place], sizes[place] * _FREE), _WAKING)
            cases = np.repeat(sizes[:, None], _WAKING, axis=1)
            cases[place] = steps
            rows = self._uses(cases)
            with np.errstate(invalid="ignore"):
                rises = (rows.uses - rows.uses[:, :1]) / self._allowed(rows.ids)[:, None] > _WAKES
            first = int(rises.any(axis=0).argmax())
            found[place] = steps[max(first - 1, 0)]
            if first and np.isinf(rows.uses[:, first]).any():
                self.ends[place] = self._end_between(place, found, float(steps[first]))
        return found

    def _find_ends(self, inside: Floats, sizes: Floats) -> None:
        """Note the size of each error, between two, from which there is no image, whatever the others are."""
        for place in self._lost_alone(inside, sizes):
            self.ends[place] = self._end_between(place, inside, min(sizes[place], self.ends[place]))

    def _end_between(self, place: int, inside: Floats, high: float) -> float:
        """Largest size of an error, between one that leaves an image and one that does not, that still does."""
        low = float(inside[place])
        for _ in range(2):
            steps = np.geomspace(low, high, _STEPS)
            cases = np.repeat(inside[:, None], _STEPS, axis=1)
            cases[place] = steps
            is_lost = np.isinf(self._uses(cases).uses).any(axis=0)
            first = int(is_lost.argmax()) if is_lost.any() else _STEPS - 1
            low, high = float(steps[max(first - 1, 0)]), float(steps[first])
        return low

    def _lost_alone(self, inside: Floats, sizes: Floats) -> Iterator[int]:
        """Errors that leave no image at their size, where the others are inside."""
        count = sizes.size
        cases = np.repeat(inside[:, None], count, axis=1)
        cases[np.arange(count), np.arange(count)] = sizes
        yield from np.flatnonzero(np.isinf(self._uses(cases).uses).any(axis=0)).tolist()

    def _begun(self) -> Floats:
        """Sizes that alone would each use so little of what limits it that all together have room."""
        count = self.tiny.size
        cases = np.repeat(self.tiny[:, None], count + 1, axis=1)
        cases[np.arange(count), np.arange(1, count + 1)] *= 2
        rows = self._judged(cases, is_of_sums=False).rows
        use = np.array([row.utilization for row in rows])
        is_end = np.array([row.binding[:1] == REQUIREMENTS.index(END_OF_IMAGE) for row in rows])
        with np.errstate(all="ignore"):
            is_own = np.abs(use[:, 1:] / use[:, :1] - 2) < 0.02
            reach = np.where(is_own & (use[:, :1] > 0), self.tiny / use[:, :1], math.inf)
            alone = reach.min(axis=0)
            self.ends = np.where(is_end, reach, math.inf).min(axis=0)
        return np.where(np.isfinite(alone), alone / (2 * count), self.tiny)

    def _near(self, sizes: Floats) -> "_Near | None":
        """The use of rows near sizes; None where it is far beyond what they may use."""
        count = sizes.size
        cases = np.repeat(sizes[:, None], 2 * count + 1, axis=1)
        for place, factor in enumerate(BESIDE):
            cases[np.arange(count), 1 + place * count + np.arange(count)] *= factor
        found = self._uses(cases)
        allowed, power = self._allowed(found.ids), found.powers[:, None]
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
        return _Near(found, allowed, sizes, part, room, is_limit, is_free)

    def _kept(self, sizes: Floats, before: "_Cuts") -> _Found:
        """Keep to what rows may use, to the last digit, and say what each error takes of it."""
        near = self._near(sizes)
        for _ in range(_SHRINKS):
            if near is not None:
                break
            sizes = sizes * 0.9
            near = self._near(sizes)
        if near is None:
            raise QuestionError("no sizes are found that leave an image")
        for _ in range(ROUNDS):
            used = self._used(near, sizes)
            over = float((used / near.allowed)[near.is_limit].max(initial=0.0))
            if over <= 1:
                break
            sizes = np.where(near.is_free, sizes, sizes / (over * (1 + _CLOSE)))
        some, limits = ~near.is_free, near.is_limit
        multipliers = np.zeros(limits.sum())
        if some.any():
            whole = near.allowed**near.found.powers
            cuts = before.with_rows(near)
            of_room = largest_sizes(self.weights[some], cuts.rows(some)).multipliers
            multipliers = of_room[-len(multipliers) :] * whole[limits] / near.room[limits]
        ids = [row for row, is_limit in zip(near.found.ids, limits, strict=True) if is_limit]
        requirements = [row for row, is_limit in zip(near.found.requirements, limits, strict=True) if is_limit]
        parts = near.part[limits] / (near.allowed**near.found.powers)[limits, None]
        if some.any():
            self._with_earlier(before, of_room, near, sizes, ids, parts, multipliers)
        sizes = np.where(near.is_free, math.nan, sizes)
        return _Found(
            sizes,
            ids,
            requirements,
            near.found.powers[limits],
            used[limits],
            near.allowed[limits],
            parts,
            multipliers,
        )

    @staticmethod
    def _with_earlier(
        before: "_Cuts",
        of_room: Floats,
        near: "_Near",
        sizes: Floats,
        ids: Sequence[str],
        parts: Floats,
        multipliers: Floats,
    ) -> None:
        """Count what a displacement is worth in other directions to its row: parts are those of all, by worth."""
        if not any(map(len, before.room)):
            return
        place = ids.index(f"mission.{LOCATION}")
        share, room = np.concatenate(before.share), np.concatenate(before.room)
        allowed = near.allowed[near.is_limit][place]
        worth = of_room[: len(room)] * allowed / room
        whole = multipliers[place] + worth.sum()
        if whole > 0:
            earlier = (worth[:, None] * share * sizes / allowed).sum(axis=0)
            parts[place] = (multipliers[place] * parts[place] + earlier) / whole
            multipliers[place] = whole

    def _used(self, near: "_Near", sizes: Floats) -> Floats:
        """Utilizations with sizes of the rows that are seen near them, (rows,)."""
        found = self._uses(sizes[:, None])
        uses = dict(zip(found.ids, found.uses[:, 0].tolist(), strict=True))
        return np.array([uses.get(row, 0.0) for row in near.found.ids])

    # ---------------------------------------------------------------- the sheet
    def sheet(self, found: _Found | None, broken: tuple[Broken, ...]) -> SpecificationSheet:
        """Put what was found into words and units, and check the mission with what is ordered."""
        values = [math.nan] * len(self.specified) if found is None else self._values(found)
        ordered = [
            (math.nan, "") if math.isnan(value) else one.ordered(value)
            for one, value in zip(self.specified, values, strict=True)
        ]
        texts = [text for _, text in ordered]
        findings = check_mission(
            self._with(texts) if found is not None else self.variation.read(self.equal), self.today
        )
        rows = () if found is None else tuple(_row_uses(found, self.specified))
        specifications = [
            Specification(
                key=one.key,
                weight=one.weight,
                unit=one.number.dimension.si,
                value=None if math.isnan(value) else value,
                ordered=None if math.isnan(value) else number,
                text=text,
                declared=one.number.value,
                declared_text="" if one.number.value is None else one.number.text(one.number.value),
                shares=_shares(rows, one.key) if text else {},
                parts=() if not text else tuple(self._parts(one, number)),
                found_text="" if math.isnan(value) else one.said(value),
                remark="" if not text else self._remark(one, number),
            )
            for one, value, (number, text) in zip(self.specified, values, ordered, strict=True)
        ]
        return SpecificationSheet(
            file=self.given.file,
            name=self.given.name,
            model=self.model,
            combine=self.combine,
            status=findings.status,
            reserve=self.reserve,
            requirements=findings.requirements,
            specifications=tuple(specifications),
            rows=rows,
            broken=broken,
            notes=tuple(self.notes),
            changes=self.given.changes,
            findings=findings,
            is_equal=self.equal,
        )

    def _values(self, found: _Found) -> list[float]:
        return [
            float(one.numbers(np.array([size]))[0]) if not math.isnan(size) else math.nan
            for one, size in zip(self.specified, found.sizes.tolist(), strict=True)
        ]

    def _parts(self, one: Specified, most: float) -> Iterator[str]:
        """Parts of the catalogue whose figure of this name is no larger in any axis."""
        *_, section, figure = parts_of(one.key)
        if section not in ("motion_error", "imu"):
            return
        for entry in self._entries:
            figures = entry.part if entry.part.kind == ("imu" if section == "imu" else "gnss") else None
            value = getattr(figures, figure, None)
            if value is not None and np.abs(value).max() <= most:
                yield entry.id

    def _remark(self, one: Specified, number: float) -> str:
        """The phase noise that a level of an oscillator asks for, where the file states it by its points."""
        _, name, *below = parts_of(one.key)
        if below != ["oscillator", "level"]:
            return ""
        oscillator = getattr(self.stated.platforms, name).oscillator
        carrier = oscillator.frequency or self.stated.radar.center_frequency
        pieces = noise_of(oscillator.noise_alone, carrier, self.stated.collection.aperture_time).pieces
        points = []
        for offset in _OFFSETS:
            density = sum(piece.at(offset) for piece in pieces if piece.low <= offset < piece.high)
            if density > 0:
                points.append(f"{10 * math.log10(density / 2) + number:.1f} dBc/Hz at {offset:g} Hz")
        return f"{', '.join(points)} from {format_quantity(carrier, 'Hz', 4)}" if points else ""

    @cached_property
    def _entries(self) -> list[Entry]:
        try:
            return list(entries(folders(folder_of(self.given.file))))
        except PartError:  # a folder of the project has a file that is no part; `sensors` says which
            return []


class _Near(NamedTuple):
    """The use of rows near sizes, (sizes,): the part of each, of the power of the utilization, and the room for all.

    `is_limit` are the rows that any of the sizes takes part in, `is_free` the sizes that take part in none.
    """

    found: _RowUses
    allowed: Floats
    sizes: Floats
    part: Floats
    room: Floats
    is_limit: Truths
    is_free: Truths


class _Cuts(NamedTuple):
    """Rows of a program, as they were seen at several sizes.

    A displacement that adds up over all signs is the largest over all directions: what was seen before still holds.
    """

    share: list[Floats]
    power: list[Floats]
    room: list[Floats]

    def with_rows(self, near: _Near, of: str = "") -> "_Cuts":
        """These, and what is seen near other sizes: every row that limits any, or one."""
        limits = near.is_limit & np.array([not of or row == of for row in near.found.ids])
        power = near.found.powers[limits]
        share = near.part[limits] / near.sizes ** power[:, None]
        return _Cuts([*self.share, share], [*self.power, power], [*self.room, near.room[limits]])

    def rows(self, some: Truths) -> Rows:
        """The rows for some of the sizes."""
        return Rows(np.concatenate(self.share)[:, some], np.concatenate(self.power), np.concatenate(self.room))


def _shares(rows: Sequence[RowUse], key: str) -> dict[str, float]:
    """Largest part that an error takes of what a row of each requirement may use."""
    shares: dict[str, float] = {}
    for row in rows:
        if row.requirement is not None and key in row.shares:
            shares[row.requirement] = max(shares.get(row.requirement, 0.0), row.shares[key])
    return shares


def _row_uses(found: _Found, specified: Sequence[Specified]) -> Iterator[RowUse]:
    """Rows by what they are worth, the one that limits most first."""
    for place in np.argsort(-found.multipliers, kind="stable").tolist():
        parts = found.parts[place].tolist()
        used, allowed = float(found.used[place]), float(found.allowed[place])
        shares = {one.key: part for one, part in zip(specified, parts, strict=True) if part > 0}
        whole, worth = (used / allowed) ** float(found.powers[place]), float(found.multipliers[place])
        # An error that grows faster than its size takes less than what a little more of it would add.
        excess = max(1.0, sum(shares.values()) / whole) if whole else 1.0
        shares = {key: part / excess for key, part in shares.items()}
        fixed = max(0.0, whole - sum(shares.values()))
        yield RowUse(found.ids[place], found.requirements[place], used, allowed, fixed, shares, worth * excess)
