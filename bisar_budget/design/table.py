"""The case table: one mission in many cases, which sweeps, solutions, sensitivities and compared parts ask.

Numbers become arrays in the mission itself where that is all that they decide. Any other case is read as a file is,
from the tree of the mission with the case's numbers in it; missions of one shape are then put into one, with arrays
where they differ. Either way all cases are judged together. The worst row is found here, and nowhere else.
"""

import math
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from bisar_budget.analysis.analysis import Analysis, by_nodes
from bisar_budget.budget.judged_mission import JudgedMission, judged_mission
from bisar_budget.budget.judged_requirements import first_highest
from bisar_budget.budget.judged_rows import REQUIREMENTS, WHOLE, Judged, statuses
from bisar_budget.design.cases import Values
from bisar_budget.design.varied import is_held, is_image, scaled
from bisar_budget.faults import MissionError, SetNumber, SetValue
from bisar_budget.findings.row import SPECIFICATION, unknown_id
from bisar_budget.findings.status import RANK, STATUS
from bisar_budget.geometry import BistaticGeometry
from bisar_budget.mission.changes import parts_of
from bisar_budget.mission.load import Named, mission_of
from bisar_budget.mission.model import Mission
from bisar_budget.mission.quantities import FACTOR, Number, QuestionError, number_of, tree_of, with_number
from bisar_budget.mission.stacked import picked, stacked
from bisar_budget.mission.tree import Tree, read_tree
from bisar_budget.ranges.exact_ranges import Indices, Truths
from bisar_budget.workers import Progress, unseen

_SOON, _SELDOM = (2, 12), 48  # cases after which it is told how far many are


class Column(NamedTuple):
    """One column of a table: its name, unit (SI; empty: a text, or a number without one) and what it holds."""

    name: str
    unit: str
    words: str
    is_text: bool = False

    @property
    def heading(self) -> str:
        """Name and unit, as a table and an axis have them."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


class Part(NamedTuple):
    """Cases `start` to `stop` of a table, in their order.

    `values` holds an array (stop - start,) of each column by its name: float64, NaN where there is no value, or
    texts, empty where there is none.
    """

    start: int
    stop: int
    values: Mapping[str, Values]


@dataclass(frozen=True, eq=False)
class Swept:
    """A sweep: what its columns are, those that vary in their order, and its parts as they are found."""

    mission_name: str
    mission_sha256: str
    varied: tuple[str, ...]
    count: int
    columns: tuple[Column, ...]
    parts: Iterator[Part]


GEOMETRY = (
    Column("range_resolution", "m", "Peak to first null along the bistatic look direction, on the ground."),
    Column("cross_range_resolution", "m", "Peak to first null across it, on the ground."),
    Column("bistatic_angle", "rad", "Angle between the lines of sight, seen from the scene centre."),
    Column("gradient_angle", "rad", "Angle between range and Doppler gradient on the ground."),
)
VERDICT = (
    Column("status", "", "Status of the mission.", is_text=True),
    Column("worst_row", "", "Row of the highest utilization among those that decide.", is_text=True),
    Column("utilization", "", "Its declared value over its allowable."),
    Column("binding_requirement", "", "The requirement that sets its allowable.", is_text=True),
)
WAIVED_BY = Column("waived_by", "", "Waivers that hold, as the file writes them.", is_text=True)
REASON = Column("reason", "", "Why there is no mission in this case.", is_text=True)

BETWEEN_WAIVERS = "; "
_IS_JUDGED = np.array([one.is_judged for one in STATUS.values()])


# ---------------------------------------------------------------- the worst row
def breaking(target: str) -> frozenset[str]:
    """Statuses that do not comply: what `check` breaks on (fail), or `check --strict` (warn), and what is waived."""
    fails = (name for name, one in STATUS.items() if (one.fails if target == "fail" else one.fails_strict))
    return frozenset([*fails, "waived"])


def _verdict(
    judged: JudgedMission, by_id: Mapping[str, Judged], row_id: str | None, breaks: Container[str]
) -> dict[str, Any]:
    """Status of each case, or of the row that is asked for; the row that binds, its utilization and requirement.

    Of the rows that are judged the one binds that uses most of its limit; of those that use as much of it, but for
    rounding, the first. One that is not evaluated and has no number binds nothing. Where the whole does not comply,
    only rows that break are looked at, and those that are waived where nothing else breaks. Of what is not evaluated
    no utilization is said: it would not be that of the requirement that decides.
    """
    rows = list(judged.rows) if row_id is None else [by_id[row_id]] if row_id in by_id else []
    if not rows:
        nothing = ("not_evaluated", "", math.nan, "", "")
        return dict(zip((column.name for column in (*VERDICT, WAIVED_BY)), nothing, strict=True))
    does_break = np.array([name in breaks for name in STATUS])
    codes, uses = np.array([one.status for one in rows]), np.array([one.utilization for one in rows])  # (rows, cases)
    status = judged.status if row_id is None else codes[0]
    # What only ever warns decides nothing, unless a warning does, nor does a specification that is met in full.
    may_decide = np.array([["warn" in breaks or one.subject.kind != "autofocus_pull_in"] for one in rows])
    may_decide = may_decide & (does_break[codes] | np.array([[one.metric != SPECIFICATION] for one in rows]))
    decides = may_decide & _IS_JUDGED[codes] & (does_break[codes] | ~does_break[status])
    decides &= (codes != RANK["waived"]) | (status == RANK["waived"])
    decides &= ~np.isnan(uses) | (codes != RANK["not_evaluated"])
    # Of what is waived the first is what has a number that breaks a limit.
    before = {row.subject.id: row.status for row in judged.before}
    is_open = np.array([before.get(row.subject.id, row.status) for row in rows]) == RANK["not_evaluated"]
    is_numbered = ~np.isnan(uses) & ~(is_open & (codes == RANK["waived"]))
    known = np.where(decides, np.where(is_numbered, uses, -1.0), -2.0)
    has_one = decides.any(axis=0)
    place = (
        np.where(has_one, first_highest(known), -1),
        np.arange(has_one.size),
    )  # of the row that binds, and the case
    ids, metrics = (
        np.array(names, dtype=object)[place[0]]
        for names in ([one.subject.id for one in rows], [one.metric for one in rows])
    )
    binding = np.array([one.binding for one in rows])[place]
    requirement = np.where(binding >= 0, np.array(REQUIREMENTS, dtype=object)[binding], metrics)
    unmet = np.full(status.shape, "", dtype=object)  # where no row decides, the requirement that breaks
    if row_id is None:
        for one in reversed(judged.requirements):
            unmet = np.where((one.status == status) & does_break[status], one.key, unmet)
    is_unjudged = (status == RANK["not_evaluated"]) & does_break[status]
    is_known = has_one & ~is_unjudged & is_numbered[place]
    return {
        "status": statuses(status),
        "worst_row": np.where(has_one, ids, ""),
        "utilization": np.where(is_known, uses[place], math.nan),
        "binding_requirement": np.where(has_one, requirement, unmet),
        "waived_by": _waived_by(judged, row_id, status == RANK["waived"]),
    }


def _waived_by(judged: JudgedMission, row_id: str | None, is_waived: Truths) -> Values:
    """Ids of the waivers of the cases that are waived, (cases,), as the file writes them; empty for others."""
    found = np.full(is_waived.shape, "", dtype=object)
    for waiver_id, covers in judged.covering(row_id) if is_waived.any() else ():
        more = np.where(found == "", "", BETWEEN_WAIVERS).astype(object) + waiver_id
        found = np.where(is_waived & covers, found + more, found)
    return found


class Standing(NamedTuple):
    """How a mission stands: whether it complies, its status, and the row that binds; see `State` of `solve`."""

    complies: bool
    status: str
    row: str | None = None
    requirement: str | None = None
    utilization: float | None = None
    waived_by: tuple[str, ...] = ()


def listed(waived_by: str) -> tuple[str, ...]:
    """Ids of waivers of a cell of the table."""
    return tuple(filter(None, waived_by.split(BETWEEN_WAIVERS)))


def standing(judged: JudgedMission, row_id: str | None, breaks: Container[str]) -> Standing:
    """Say how a mission by itself stands, or the row that was asked for."""
    rows = {row.subject.id: row for row in judged.rows}
    (status,), (row,), (use,), (requirement,), (waived_by,) = (
        np.ravel(column) for column in _verdict(judged, rows, row_id, breaks).values()
    )
    utilization = None if math.isnan(use) else float(use)
    complies = status not in breaks
    return Standing(complies, str(status), row or None, requirement or None, utilization, listed(waived_by))


def hold_to_decisions(judged: Sequence[JudgedMission], row_id: str | None) -> None:
    """Refuse what nothing can decide.

    Raises
    ------
    QuestionError
        None of the missions has a declared error, or the row that is asked for is not there or not judged.
    """
    if all(one.is_empty for one in judged):
        raise QuestionError("the mission declares no error: nothing decides whether it complies")
    if row_id is None:
        return
    rows = [row for one in judged for row in one.rows]
    of_row = [STATUS[statuses(row.status)[0]] for row in rows if row.subject.id == row_id]
    if not of_row:
        known = (row.subject.id for row in rows)
        raise QuestionError(f"--row {row_id}: {unknown_id(row_id, known, judged[0].analysis.mission.file)}")
    if not any(status.gates for status in of_row):
        raise QuestionError(f"--row {row_id}: is {of_row[0].words}: nothing is judged there")


# ---------------------------------------------------------------- the mission with other values
class Variation:
    """A mission whose file is read with other values: each is held to everything that a file is.

    Options that changed the mission stay. `model` gates in place of its own, `named` is what it names, where the
    files are not there.
    """

    def __init__(self, mission: Mission, model: str | None, named: Named | None = None) -> None:
        self.mission, self.model = mission, model
        self.parse = mission_of if named is None else named.parse

    @cached_property
    def tree(self) -> Tree:
        """Content of the file as a tree."""
        return read_tree(self.mission.data, self.mission.file)

    def read(self, changes: Sequence[SetValue] = ()) -> Mission:
        """Read the mission with values in place of its own; a `MissionError` says that there is none with them."""
        anew = {parts_of(change.key) for change in changes}
        given = [change for change in self.mission.changes if parts_of(change.key) not in anew]
        mission, tree = self.mission, self.tree.copied()
        return self.parse(tree, mission.data, mission.file, self.model, changes=(*given, *changes))

    def at(self, values: Mapping[Number, float], changes: Sequence[SetValue] = ()) -> Mission:
        """Read the mission with other numbers, in SI, after other changes; raises `MissionError`."""
        numbers = [SetNumber.of(one.key, value, one.dimension.si) for one, value in values.items()]
        return self.read([*changes, *numbers])


# ---------------------------------------------------------------- cases
class Question(NamedTuple):
    """All that a process needs to check cases of a mission; `named` where it cannot read what the mission names.

    `keys` have numbers, `choices` words. `row` is judged instead of the mission, if given; `breaks` are the statuses
    that do not comply.
    """

    data: bytes
    file: str
    changes: tuple[SetValue, ...]
    keys: tuple[str, ...]
    model: str | None
    today: date
    columns: tuple[str, ...] = ()
    choices: tuple[str, ...] = ()
    named: Named | None = None
    row: str | None = None
    breaks: frozenset[str] = breaking("fail")

    @classmethod
    def of(cls, mission: Mission, keys: Sequence[str], model: str | None, today: date, **more: Any) -> "Question":
        """The question about a mission as it was loaded."""
        return cls(mission.data, mission.file, mission.changes, tuple(keys), model, today, **more)


class Table:
    """Checks cases of one mission; a process of its own can have one.

    `numbers` are those of the question's keys, which need not be looked up then; of `FACTOR` the errors below its key
    are scaled.
    """

    def __init__(self, question: Question, mission: Mission, numbers: Sequence[Number] = ()) -> None:
        self.question, self.mission = question, mission
        self.chosen: dict[tuple[str, ...], Table] = {}  # by the words of its cases
        self.variation = Variation(mission, question.model, question.named)
        if question.model is not None:
            self.mission = mission._replace(allocation=mission.allocation._replace(model=question.model))
        tree = tree_of(mission)
        self.numbers = tuple(numbers) or tuple(number_of(tree, key) for key in question.keys)
        self.fields = {name: name.rpartition(".")[::2] for name in question.columns}  # row and field of each column
        wanted = {row for row, _ in self.fields.values()} | ({question.row} if question.row else set())
        rows = judged_mission(Analysis(self.mission), question.today).rows if wanted else ()
        self.subjects = {row.subject.id: row.subject for row in rows if row.subject.id in wanted}
        self.is_complete = any(field in WHOLE for _, field in self.fields.values())
        # Numbers that decide more than themselves: a case that has another value than the mission is read.
        self.to_read = {
            one.key
            for one in self.numbers
            if one.reader is not FACTOR and not is_held(self.mission, one.key, is_stated=one.value is not None)
        }

    def watched(self, values: Mapping[str, Any], progress: Progress = unseen) -> dict[str, Values]:
        """Check cases, and tell how many of how many are done: soon, and then seldom, for it costs time."""
        cases = len(next(iter(values.values())))
        ends = (
            [cases]
            if progress is unseen
            else [end for end in (*_SOON, *range(_SELDOM, cases, _SELDOM)) if end < cases]
        )
        parts = []
        for start, stop in pairwise(dict.fromkeys((0, *ends, cases))):
            parts.append(self.part(start, stop, {key: column[start:stop] for key, column in values.items()}).values)
            progress(stop, cases)
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}

    def part(self, start: int, stop: int, values: Mapping[str, Any]) -> Part:
        """Check cases `start` to `stop`, whose values are (stop - start,)."""
        found = self._columns(values, stop - start)
        if self.question.choices:
            for table, places in self._by_words(found):
                numbers = {number.key: found[number.key][places] for number in self.numbers}
                for name, of_some in table.part(0, places.size, numbers).values.items():
                    found[name][places] = of_some
        else:
            self._fill(found)
        return Part(start, stop, found)

    def reads(self, values: Mapping[str, Any]) -> int:
        """How many of some cases are read, each by itself."""
        cases = len(next(iter(values.values())))
        found = self._columns(values, cases)
        if self.question.choices:
            return sum(
                table.reads({one.key: found[one.key][places] for one in self.numbers})
                for table, places in self._by_words(found)
                if self.numbers
            )
        return cases - int(self._arrays(found, cases)[0].size)

    def _columns(self, values: Mapping[str, Any], cases: int) -> dict[str, Values]:
        """The values of some cases, and room for what is found of them."""
        found: dict[str, Values] = {key: np.asarray(values[key], dtype=object) for key in self.question.choices}
        found |= {number.key: np.asarray(values[number.key], dtype=float) for number in self.numbers}
        is_text = {column.name: column.is_text for column in (*GEOMETRY, *VERDICT, WAIVED_BY, REASON)}
        for name, is_one in (is_text | {name: is_status(name) for name in self.fields}).items():
            found[name] = np.full(cases, "", dtype=object) if is_one else np.full(cases, math.nan)
        return found

    # ---------------------------------------------------------------- one mission for the same words
    def _by_words(self, found: Mapping[str, Values]) -> Iterator[tuple["Table", Indices]]:
        """Tables of the cases that have the same words; what is no mission by any number is said in `found`."""
        same: dict[tuple[str, ...], list[int]] = {}
        for place, words in enumerate(zip(*(found[key].tolist() for key in self.question.choices), strict=True)):
            same.setdefault(words, []).append(place)
        for words, some in same.items():
            if words not in self.chosen:
                changes = [SetValue(*one) for one in zip(self.question.choices, words, strict=True)]
                mission = None
                try:
                    mission = self.variation.read(changes)
                except MissionError:  # the numbers of the first case that makes it one
                    for place in some:
                        mission = mission or self._read(found, place)
                if mission is None:
                    continue
                self.chosen[words] = Table(self.question._replace(changes=mission.changes, choices=()), mission)
            yield self.chosen[words], np.array(some)

    def _read(self, found: Mapping[str, Values], place: int) -> Mission | None:
        """Read the mission of a case; where there is none, say why."""
        words = [SetValue(key, found[key][place]) for key in self.question.choices]
        values = {one: float(found[one.key][place]) for one in self.numbers}
        changed = {
            one: value for one, value in values.items() if one.reader is not FACTOR and (words or value != one.value)
        }
        try:
            mission = self.variation.at(changed, words)
        except MissionError as error:
            fault = error.faults[0]
            found["status"][place], found["reason"][place] = "error", f"{fault.key}: {fault.problem}"
            return None
        for one, value in values.items():
            if one.reader is FACTOR:
                mission = scaled(mission, one.key, value)
        return mission

    # ---------------------------------------------------------------- all together
    def _fill(self, found: dict[str, Values]) -> None:
        """Check every case."""
        cases = found["utilization"].size
        some, together, geometries = self._arrays(found, cases)
        if some.size:
            self._check(found, some, together, geometries)
        places: list[int] = []

        def read() -> Iterator[Mission]:
            """Other cases, one after the other; the place of each that is a mission is noted."""
            for place in np.delete(np.arange(cases), some).tolist():
                mission = self._read(found, place)
                if mission is not None:
                    places.append(place)
                    yield mission

        for mission, same in stacked(read()):
            self._check(found, np.array(places)[same], mission, mission.geometry)

    def _arrays(self, found: Mapping[str, Values], cases: int) -> tuple[Indices, Mission, BistaticGeometry]:
        """The cases whose numbers can be put into the mission, the mission with them, and its geometry."""
        direct = np.ones(cases, dtype=bool)
        for one in self.numbers:
            values, (gt, ge, lt, le) = found[one.key], one.reader.bounds
            is_accepted = (values > gt) & (values >= ge) & (values < lt) & (values <= le)
            direct &= values == one.value if one.key in self.to_read else is_accepted
        some, mission = np.flatnonzero(direct), self.mission
        for one in self.numbers:
            if one.reader is FACTOR:
                mission = scaled(mission, one.key, found[one.key][some])
            elif one.key not in self.to_read:
                mission = with_number(mission, one.key, found[one.key][some])
        geometries = mission.geometry
        is_sure = is_image(mission, geometries, some.size)
        if is_sure.all():
            return some, mission, geometries
        mission = picked(mission, np.flatnonzero(is_sure))
        return some[is_sure], mission, mission.geometry

    def _check(self, found: dict[str, Values], some: Indices, mission: Mission, geometries: BistaticGeometry) -> None:
        """Judge the cases of a mission together, those that need as many nodes."""
        for nodes, same, part, seen in by_nodes(mission, some.size, geometries):
            analysis = Analysis(
                part, same.size, geometry=seen, nodes=nodes, shown=self.subjects, is_complete=self.is_complete
            )
            judged = judged_mission(analysis, self.question.today)
            rows = {row.subject.id: row for row in judged.rows}
            columns = _verdict(judged, rows, self.question.row, self.question.breaks)
            with np.errstate(all="ignore"):
                geometry = (
                    *analysis.resolution[:2],
                    seen.bistatic_angle,
                    seen.gradient_angle,
                )
                columns |= {column.name: number for column, number in zip(GEOMETRY, geometry, strict=True)}
                for name, (row, of_row) in self.fields.items():
                    if row in rows:
                        columns[name] = statuses(rows[row].status) if is_status(name) else getattr(rows[row], of_row)
                    elif is_status(name):
                        columns[name] = "not_declared"
            for name, column in columns.items():
                found[name][some[same]] = np.broadcast_to(column, same.shape)


def is_status(name: str) -> bool:
    """Whether a column, `ROW.FIELD`, has statuses instead of numbers."""
    return name.endswith(".status")
