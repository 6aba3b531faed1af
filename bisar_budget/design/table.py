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
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from bisar_budget.analysis.analysis import Analysis, by_nodes
from bisar_budget.budget.judged_mission import JudgedMission, field, judged_mission, statuses
from bisar_budget.budget.judged_requirements import first_highest
from bisar_budget.budget.judged_rows import REQUIREMENTS, WHOLE, Judged
from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.design.quantities import FACTOR, Number, QuestionError, number_of, tree_of
from bisar_budget.design.varied import is_held, is_image, scaled, varied
from bisar_budget.faults import MissionError, SetNumber, SetValue
from bisar_budget.findings.row import unknown_id
from bisar_budget.findings.status import RANK, STATUS
from bisar_budget.geometry import BistaticGeometry
from bisar_budget.mission.changes import parts_of
from bisar_budget.mission.load import Named, mission_of
from bisar_budget.mission.model import Mission
from bisar_budget.mission.stacked import picked, stacked
from bisar_budget.mission.tree import Tree, read_tree
from bisar_budget.workers import Progress, unseen

_SOON, _SELDOM = (2, 12), 48  # cases after which it is told how far many are

Values = NDArray[np.float64] | NDArray[np.object_]
Places = NDArray[np.intp]


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
    """A sweep: what its columns are, and its parts as they are found.

    `shape` is that of the grid of cases, one axis for each key that varies, the last the fastest; None where the
    cases are a table or a sample. `varied` names the columns that vary, in that order.
    """

    mission_name: str
    mission_sha256: str
    varied: tuple[str, ...]
    shape: tuple[int, ...] | None
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
REASON = Column("reason", "", "Why there is no mission in this case.", is_text=True)
IN_UNIT = ("declared", "allowable", "allowable_published", "allowable_full")  # fields in the unit of their row

_IS_JUDGED = np.array([one.is_judged and name != "waived" for name, one in STATUS.items()])


# ---------------------------------------------------------------- the worst row
def breaking(target: str) -> frozenset[str]:
    """Statuses that do not comply: what `check` breaks on (fail), or what `check --strict` does (warn)."""
    return frozenset(name for name, one in STATUS.items() if (one.fails if target == "fail" else one.fails_strict))


def deciding(kinds: Sequence[str], codes: Any, uses: Any, whole: Any, breaks: Container[str]) -> NDArray[np.intp]:
    """Find the row that binds in each case: of the rows that are judged the one that uses most of its limit.

    Of rows that use as much of it, but for rounding, the first. One that is not evaluated and has no number binds
    nothing. Where the whole does not comply, only rows that break are looked at.

    Parameters
    ----------
    kinds : sequence of str
        What kind of row each is, in the order of the contract.
    codes, uses : array
        Places of their statuses in `STATUS`, and their utilizations, NaN where there is none, (rows, cases).
    whole : array
        Status of the mission, or of the row that is asked for, (cases,).
    breaks : container of str
        Statuses that do not comply.

    Returns
    -------
    array
        Place of the row, -1 where none binds, (cases,).
    """
    does_break = np.array([name in breaks for name in STATUS])
    # What only ever warns decides nothing, unless a warning does.
    may_decide = np.array([["warn" in breaks or kind != "autofocus_pull_in"] for kind in kinds])
    decides = may_decide & _IS_JUDGED[codes] & (does_break[codes] | ~does_break[whole])
    decides &= ~np.isnan(uses) | (codes != RANK["not_evaluated"])
    uses = np.where(decides, np.where(np.isnan(uses), -1.0, uses), -2.0)
    return np.where(decides.any(axis=0), first_highest(uses), -1)


class Standing(NamedTuple):
    """How a mission stands: whether it complies, its status, and the row that binds; see `State` of `solve`."""

    complies: bool
    status: str
    row: str | None = None
    requirement: str | None = None
    utilization: float | None = None


def standing(judged: JudgedMission, row_id: str | None, breaks: Container[str]) -> Standing:
    """Say how a mission by itself stands, or the row that was asked for."""
    rows = {row.subject.id: row for row in judged.rows}
    (status,), (row,), (use,), (requirement,) = (
        np.ravel(column) for column in _verdict(judged, rows, row_id, breaks).values()
    )
    utilization = None if math.isnan(use) else float(use)
    return Standing(status not in breaks, str(status), row or None, requirement or None, utilization)


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

    Parameters
    ----------
    mission : Mission
        As loaded, with the options that changed it; they stay.
    model : str, optional
        Gating model in place of the mission's own.
    named : Named, optional
        What the mission names, where its files are not there.
    """

    def __init__(self, mission: Mission, model: str | None, named: Named | None = None) -> None:
        self.mission, self.model = mission, model
        self.parse = mission_of if named is None else named.parse

    @cached_property
    def tree(self) -> Tree:
        """Content of the file as a tree."""
        return read_tree(self.mission.data, self.mission.file)

    def read(self, changes: Sequence[SetValue] = ()) -> Mission:
        """Read the mission with values in place of its own.

        Raises
        ------
        MissionError
            With them there is no mission.
        """
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
    columns: tuple[str, ...]
    model: str | None
    today: date
    choices: tuple[str, ...] = ()
    named: Named | None = None
    row: str | None = None
    breaks: frozenset[str] = breaking("fail")


class _Field(NamedTuple):
    """A column that was asked for: a field of a row."""

    name: str
    row: str
    field: str

    @property
    def is_text(self) -> bool:
        """Whether it is no number."""
        return self.field == "status"


class Table:
    """Checks cases of one mission; a process of its own can have one.

    Parameters
    ----------
    question : Question
        What is asked of each case.
    mission : Mission
        As loaded.
    numbers : sequence of Number, optional
        Those of the question's keys; of `FACTOR` the errors below its key are scaled.
    """

    def __init__(self, question: Question, mission: Mission, numbers: Sequence[Number] = ()) -> None:
        self.question, model = question, question.model
        self.chosen: dict[tuple[str, ...], Table | None] = {}  # by the words of its cases; None: no mission
        self.mission = mission if model is None else _gated(mission, model)
        self.variation = Variation(mission, model, question.named)
        tree = tree_of(mission)
        self.numbers = tuple(numbers) or tuple(number_of(tree, key) for key in question.keys)
        self.asked = [_Field(name, *_of_row(name)) for name in question.columns]
        wanted = {one.row for one in self.asked} | ({question.row} if question.row else set())
        rows = judged_mission(Analysis(self.mission), question.today).rows if wanted else ()
        self.subjects = {row.subject.id: row.subject for row in rows if row.subject.id in wanted}
        self.is_whole = any(one.field in WHOLE for one in self.asked)
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
        columns = [(column.name, column.is_text) for column in (*GEOMETRY, *VERDICT, REASON)]
        for name, is_text in (*columns, *((one.name, one.is_text) for one in self.asked)):
            found[name] = np.full(cases, "", dtype=object) if is_text else np.full(cases, math.nan)
        return found

    # ---------------------------------------------------------------- one mission for the same words
    def _by_words(self, found: Mapping[str, Values]) -> Iterator[tuple["Table", Places]]:
        """Tables of the cases that have the same words; what is no mission by any number is said in `found`."""
        same: dict[tuple[str, ...], list[int]] = {}
        for place, words in enumerate(zip(*(found[key].tolist() for key in self.question.choices), strict=True)):
            same.setdefault(words, []).append(place)
        for words, some in same.items():
            table = self.chosen.get(words) or self._with(words, found, some)
            if table is not None:
                self.chosen[words] = table
                yield table, np.array(some)

    def _with(self, words: tuple[str, ...], found: Mapping[str, Values], some: Sequence[int]) -> "Table | None":
        """The table of the mission with these words, and with the numbers of the first case that makes it one."""
        changes = [SetValue(*one) for one in zip(self.question.choices, words, strict=True)]
        mission = None
        try:
            mission = self.variation.read(changes)
        except MissionError:
            for place in some:
                mission = mission or self._read(found, place)
        if mission is None:
            return None
        return Table(self.question._replace(changes=mission.changes, choices=()), mission)

    def _read(self, found: Mapping[str, Values], place: int) -> Mission | None:
        """Read the mission of a case; where there is none, say why."""
        words = [SetValue(key, found[key][place]) for key in self.question.choices]
        values = {one: float(found[one.key][place]) for one in self.numbers}
        try:
            mission = self.variation.at(
                {
                    one: value
                    for one, value in values.items()
                    if one.reader is not FACTOR and (words or value != one.value)
                },
                words,
            )
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
        some, mission, geometries = self._arrays(found, cases)
        if some.size:
            self._check(found, some, mission, geometries)
        places: list[int] = []
        read = self._all_read(found, np.delete(np.arange(cases), some).tolist(), places)
        for mission, some in stacked(read):
            self._check(found, np.array(places)[some], mission, mission.geometry)

    def _arrays(self, found: Mapping[str, Values], cases: int) -> tuple[Places, Mission, BistaticGeometry]:
        """The cases whose numbers can be put into the mission, the mission with them, and its geometry."""
        direct = np.ones(cases, dtype=bool)
        for one in self.numbers:
            values = found[one.key]
            direct &= values == one.value if one.key in self.to_read else _within(one, values)
        some, mission = np.flatnonzero(direct), self.mission
        for one in self.numbers:
            if one.reader is FACTOR:
                mission = scaled(mission, one.key, found[one.key][some])
            elif one.key not in self.to_read:
                mission = varied(mission, one.key, found[one.key][some])
        geometries = mission.geometry
        is_sure = is_image(mission, geometries, some.size)
        if is_sure.all():
            return some, mission, geometries
        mission = picked(mission, np.flatnonzero(is_sure))
        return some[is_sure], mission, mission.geometry

    def _all_read(self, found: dict[str, Values], others: Sequence[int], places: list[int]) -> Iterator[Mission]:
        """Read other cases, one after the other, and note the place of each that is a mission."""
        for place in others:
            mission = self._read(found, place)
            if mission is not None:
                places.append(place)
                yield mission

    def _check(self, found: dict[str, Values], some: Places, mission: Mission, geometries: BistaticGeometry) -> None:
        """Judge the cases of a mission together, those that need as many nodes."""
        for nodes, same, part, of_part in by_nodes(mission, some.size, geometries):
            self._judge(found, some[same], part, of_part, nodes)

    def _judge(
        self, found: dict[str, Values], some: Places, mission: Mission, geometries: BistaticGeometry, nodes: int
    ) -> None:
        question, T = self.question, mission.collection.aperture_time
        analysis = Analysis(
            mission,
            some.size,
            geometry=geometries,
            nodes=nodes,
            shown=self.subjects,
            is_whole=self.is_whole,
        )
        judged = judged_mission(analysis, question.today)
        rows = {row.subject.id: row for row in judged.rows}
        columns = _verdict(judged, rows, question.row, question.breaks)
        with np.errstate(all="ignore"):
            geometry = (
                geometries.range_resolution(mission.radar.bandwidth, SPEED_OF_LIGHT),
                geometries.cross_range_resolution(mission.radar.wavelength, T),
                geometries.bistatic_angle,
                geometries.gradient_angle,
            )
            columns |= {column.name: number for column, number in zip(GEOMETRY, geometry, strict=True)}
            for one in self.asked:
                if one.row in rows:
                    columns[one.name] = field(rows[one.row], one.field)
                elif one.is_text:
                    columns[one.name] = "not_declared"
        for name, column in columns.items():
            found[name][some] = np.broadcast_to(column, some.shape)


def _verdict(
    judged: JudgedMission, by_id: Mapping[str, Judged], row_id: str | None, breaks: Container[str]
) -> dict[str, Any]:
    """Status, worst row, utilization and requirement of each case, or of the row that is asked for."""
    rows = list(judged.rows) if row_id is None else [by_id[row_id]] if row_id in by_id else []
    does_break = np.array([name in breaks for name in STATUS])
    if not rows:
        nothing = "not_evaluated"
        return {"status": nothing, "worst_row": "", "utilization": math.nan, "binding_requirement": ""}
    codes, uses = np.array([one.status for one in rows]), np.array([one.utilization for one in rows])
    status = judged.status if row_id is None else codes[0]
    worst = deciding([one.subject.kind for one in rows], codes, uses, status, breaks)
    has_one = worst >= 0
    ids, metrics = (
        np.array(names, dtype=object) for names in ([one.subject.id for one in rows], [one.metric for one in rows])
    )
    each = np.arange(worst.size)
    binding = np.array([one.binding for one in rows])[worst, each]
    requirement = np.where(binding >= 0, np.array(REQUIREMENTS, dtype=object)[binding], metrics[worst])
    unmet = np.full(status.shape, "", dtype=object)  # where no row decides, the requirement that breaks
    if row_id is None:
        for one in reversed(judged.requirements):
            unmet = np.where((one.status == status) & does_break[status], one.key, unmet)
    return {
        "status": statuses(status),
        "worst_row": np.where(has_one, ids[worst], ""),
        "utilization": np.where(has_one, uses[worst, each], math.nan),
        "binding_requirement": np.where(has_one, requirement, unmet),
    }


def _within(number: Number, values: Any) -> NDArray[np.bool_]:
    """Whether each value is one that the file may have."""
    gt, ge, lt, le = number.reader.bounds
    return cast("NDArray[np.bool_]", (values > gt) & (values >= ge) & (values < lt) & (values <= le))


def _gated(mission: Mission, model: str) -> Mission:
    return mission._replace(allocation=mission.allocation._replace(model=model))


def _of_row(name: str) -> tuple[str, str]:
    """Row and field of a column."""
    row, _, field = name.rpartition(".")
    return row, field
