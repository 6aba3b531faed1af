"""Checks of one mission in many cases, for sweeps, `solve`, sensitivities and comparisons of parts.

If no other content of the mission depends on a varied number, an array with the values of all cases replaces the
number. Otherwise each case is read like a mission file with the numbers of the case, and missions of the same
structure are then joined into one mission with arrays. Either way, all cases are judged together. Only this module
decides which row is the worst.
"""

import math
from collections.abc import Container, Iterator, Mapping, Sequence
from datetime import date
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bisar_budget.analysis.analysis import Analysis, by_nodes
from bisar_budget.arrays import Booleans, Indices
from bisar_budget.budget.judged_mission import JudgedMission, judged_mission
from bisar_budget.budget.judged_requirements import first_highest
from bisar_budget.budget.judged_rows import COMPLETE_FIELDS, REQUIREMENTS, Judged, statuses
from bisar_budget.constants import TARGETS
from bisar_budget.faults import MissionError, SetNumber, SetValue
from bisar_budget.findings.case_table import Column, Part, Values
from bisar_budget.findings.row import SPECIFICATION, unknown_id
from bisar_budget.findings.solution import Standing
from bisar_budget.findings.status import RANK, STATUS
from bisar_budget.geometry import BistaticGeometry
from bisar_budget.mission.changes import parts_of
from bisar_budget.mission.load import Named, mission_of
from bisar_budget.mission.model import Mission
from bisar_budget.mission.quantities import FACTOR, Number, QuestionError, number_of, tree_of, with_number
from bisar_budget.mission.stacked import picked, stacked
from bisar_budget.mission.tree import Tree, read_tree
from bisar_budget.questions.varied import is_held, is_image, scaled
from bisar_budget.workers import Progress, unseen

# Numbers of cases after which progress is reported: the first ones, and then the interval.
_FIRST_REPORTS, _REPORT_INTERVAL_CASES = (2, 12), 48


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
DOUBTS = Column("doubts", "", "Doubts about the mission, by the codes of the warnings of check.", is_text=True)
WAIVED_BY = Column("waived_by", "", "Waivers that hold, as the file writes them.", is_text=True)
REASON = Column("reason", "", "Why there is no mission in this case.", is_text=True)

BETWEEN_TEXTS = "; "  # in a cell with several texts
_IS_JUDGED = np.array([status.is_judged for status in STATUS.values()])


# ---------------------------------------------------------------- the worst row
def breaking(target: str) -> frozenset[str]:
    """Names of the statuses with which a mission does not comply, for the target `fail` or `warn`.

    For the target `fail` these are the statuses with which `check` fails, for `warn` the statuses with which `check
    --strict` fails. `waived` is always included.
    """
    fails = (name for name, status in STATUS.items() if (status.fails if target == "fail" else status.fails_strict))
    return frozenset([*fails, "waived"])


def _verdict(
    judged: JudgedMission, by_id: Mapping[str, Judged], row_id: str | None, breaks: Container[str]
) -> dict[str, ArrayLike]:
    """Make the columns of the verdict: the status of the mission or of one row, and the binding row, in each case.

    The binding row is the judged row with the highest utilization; among rows that differ only by rounding, it is the
    first row. A row that is not evaluated and has no utilization cannot be the binding row. If the mission does not
    comply, the binding row is a row that breaks a limit; it is a waived row only if no other row breaks a limit.
    If the verdict of a case is `not_evaluated`, its utilization is NaN: the missing evaluation decides the verdict,
    not the utilization of any row.
    """
    rows = list(judged.rows) if row_id is None else [by_id[row_id]] if row_id in by_id else []
    if not rows:
        no_verdict = ("not_evaluated", "", math.nan, "", "")
        return dict(zip((column.name for column in (*VERDICT, WAIVED_BY)), no_verdict, strict=True))
    does_break = np.array([name in breaks for name in STATUS])
    codes, uses = np.array([row.status for row in rows]), np.array([row.utilization for row in rows])  # (rows, cases)
    status = judged.status if row_id is None else codes[0]
    # Rows that only warn decide only if a warning breaks. A specification that is met decides nothing.
    may_decide = np.array([["warn" in breaks or not row.subject.facts.only_warns] for row in rows])
    may_decide = may_decide & (does_break[codes] | np.array([[row.metric != SPECIFICATION] for row in rows]))
    decides = may_decide & _IS_JUDGED[codes] & (does_break[codes] | ~does_break[status])
    decides &= (codes != RANK["waived"]) | (status == RANK["waived"])
    decides &= ~np.isnan(uses) | (codes != RANK["not_evaluated"])
    # Among waived rows, a row with a number that breaks a limit comes first.
    before = {row.subject.id: row.status for row in judged.before}
    is_open = np.array([before.get(row.subject.id, row.status) for row in rows]) == RANK["not_evaluated"]
    is_numbered = ~np.isnan(uses) & ~(is_open & (codes == RANK["waived"]))
    ranked_uses = np.where(decides, np.where(is_numbered, uses, -1.0), -2.0)
    has_binding = decides.any(axis=0)
    binding_at = (
        np.where(has_binding, first_highest(ranked_uses), -1),
        np.arange(has_binding.size),
    )  # indices of the binding row, and of the case
    ids, metrics = (
        np.array(names, dtype=object)[binding_at[0]]
        for names in ([row.subject.id for row in rows], [row.metric for row in rows])
    )
    binding = np.array([row.binding for row in rows])[binding_at]
    requirement = np.where(binding >= 0, np.array(REQUIREMENTS, dtype=object)[binding], metrics)
    unmet = np.full(status.shape, "", dtype=object)  # the requirement that breaks, if no row decides
    if row_id is None:
        for required in reversed(judged.requirements):
            unmet = np.where((required.status == status) & does_break[status], required.key, unmet)
    is_unjudged = (status == RANK["not_evaluated"]) & does_break[status]
    is_decided = has_binding & ~is_unjudged & is_numbered[binding_at]
    return {
        "status": statuses(status),
        "worst_row": np.where(has_binding, ids, ""),
        "utilization": np.where(is_decided, uses[binding_at], math.nan),
        "binding_requirement": np.where(has_binding, requirement, unmet),
        "waived_by": _waived_by(judged, row_id, status == RANK["waived"]),
    }


def _waived_by(judged: JudgedMission, row_id: str | None, is_waived: Booleans) -> Values:
    """Return, for each case, a string with the ids of the waivers that apply to it, (cases,).

    Ids are written as in the mission file. The string is empty if the case is not waived.
    """
    ids = np.full(is_waived.shape, "", dtype=object)
    for waiver_id, covers in judged.covering(row_id) if is_waived.any() else ():
        ids = _with_text(ids, waiver_id, is_waived & covers)
    return ids


def _doubts(judged: JudgedMission) -> Values:
    """Return, for each case, a string with the codes of the doubts about the mission, (cases,)."""
    codes = np.full(judged.status.shape, "", dtype=object)
    for code, is_doubted in judged.doubts.items():
        if is_doubted.any():
            codes = _with_text(codes, code, is_doubted)
    return codes


def _with_text(texts: NDArray[np.object_], text: str, is_added: Booleans) -> NDArray[np.object_]:
    """Append a text to the strings (cases,) of the cases in which `is_added` is true."""
    extended = np.where(texts == "", "", BETWEEN_TEXTS).astype(object) + text
    return np.where(is_added, texts + extended, texts)


def listed(cell: str) -> tuple[str, ...]:
    """Split a cell of the columns `waived_by` or `doubts` into its ids or codes."""
    return tuple(filter(None, cell.split(BETWEEN_TEXTS)))


def standing(judged: JudgedMission, row_id: str | None, breaks: Container[str]) -> Standing:
    """Return the verdict on a single mission, or on its row `row_id` if it is set.

    The mission does not comply if its status is in `breaks`.
    """
    rows = {row.subject.id: row for row in judged.rows}
    (status,), (row,), (use,), (requirement,), (waived_by,) = (
        np.ravel(column) for column in _verdict(judged, rows, row_id, breaks).values()
    )
    utilization = None if math.isnan(use) else float(use)
    complies = status not in breaks
    return Standing(complies, str(status), row or None, requirement or None, utilization, listed(waived_by))


def hold_to_decisions(judged: Sequence[JudgedMission], row_id: str | None) -> None:
    """Raise an error if no row of the missions can decide whether they comply.

    Raises
    ------
    QuestionError
        No mission has a declared error, or the row `row_id` is missing or not judged.
    """
    if all(mission.is_empty for mission in judged):
        raise QuestionError("the mission declares no error: nothing decides whether it complies")
    if row_id is None:
        return
    rows = [row for mission in judged for row in mission.rows]
    statuses_of_row = [STATUS[statuses(row.status)[0]] for row in rows if row.subject.id == row_id]
    if not statuses_of_row:
        ids = (row.subject.id for row in rows)
        raise QuestionError(f"--row {row_id}: {unknown_id(row_id, ids, judged[0].analysis.mission.file)}")
    if not any(status.gates for status in statuses_of_row):
        raise QuestionError(f"--row {row_id}: is {statuses_of_row[0].words}: nothing is judged there")


# ---------------------------------------------------------------- the mission with changed values
class Variation:
    """A mission that can be read again with changed values, which are checked like the values of a file.

    Values changed by command-line options stay changed. `model` replaces the model that decides the verdict on the
    mission. `named` has the content of the files that the mission names, for machines without these files.
    """

    def __init__(self, mission: Mission, model: str | None, named: Named | None = None) -> None:
        self.mission, self.model = mission, model
        self.parse = mission_of if named is None else named.parse

    @cached_property
    def tree(self) -> Tree:
        """Content of the mission file as a tree of keys and values."""
        return read_tree(self.mission.data, self.mission.file)

    def read(self, changes: Sequence[SetValue] = ()) -> Mission:
        """Read the mission with changed values; raises `MissionError` if the mission is invalid with them."""
        changed_keys = {parts_of(change.key) for change in changes}
        kept = [change for change in self.mission.changes if parts_of(change.key) not in changed_keys]
        mission, tree = self.mission, self.tree.copied()
        return self.parse(tree, mission.data, mission.file, self.model, changes=(*kept, *changes))

    def at(self, values: Mapping[Number, float], changes: Sequence[SetValue] = ()) -> Mission:
        """Read the mission with changed values and with new numbers in SI.

        Raises `MissionError` if the mission is invalid with them.
        """
        numbers = [SetNumber.of(number.key, value, number.dimension.si) for number, value in values.items()]
        return self.read([*changes, *numbers])


# ---------------------------------------------------------------- cases
class Question(NamedTuple):
    """Everything that a process needs to check cases of a mission.

    `keys` are the varied keys with numerical values, and `choices` are the varied keys with string values. If `row`
    is set, this row is judged instead of the whole mission. `target` is the argument of `solve`, or empty if every
    status complies. `named` holds the files that the mission names, for a process that cannot read them itself.
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
    target: str = TARGETS[0]

    @property
    def breaks(self) -> frozenset[str]:
        """Names of the statuses with which a case does not comply."""
        return breaking(self.target) if self.target else frozenset()

    @classmethod
    def of(cls, mission: Mission, keys: Sequence[str], model: str | None, today: date, **settings: Any) -> "Question":
        """Make a question about a loaded mission; `settings` are further fields of the question."""
        return cls(mission.data, mission.file, mission.changes, tuple(keys), model, today, **settings)


class Table:
    """Checks of the cases of one mission; any process can build the same table from a question.

    `numbers` are the numbers of the question's keys, by default the numbers of the file. A number with the reader
    `FACTOR` is a factor by which the errors below its key are multiplied.
    """

    def __init__(self, question: Question, mission: Mission, numbers: Sequence[Number] = ()) -> None:
        self.question, self.mission = question, mission
        self.chosen: dict[tuple[str, ...], Table] = {}  # tables by the words of their cases
        self.variation = Variation(mission, question.model, question.named)
        if question.model is not None:
            self.mission = mission._replace(allocation=mission.allocation._replace(model=question.model))
        tree = tree_of(mission)
        self.numbers = tuple(numbers) or tuple(number_of(tree, key) for key in question.keys)
        self.fields = {name: name.rpartition(".")[::2] for name in question.columns}  # row and field of each column
        row_ids = {row for row, _ in self.fields.values()} | ({question.row} if question.row else set())
        rows = judged_mission(Analysis(self.mission), question.today).rows if row_ids else ()
        self.subjects = {row.subject.id: row.subject for row in rows if row.subject.id in row_ids}
        self.is_complete = any(field in COMPLETE_FIELDS for _, field in self.fields.values())
        # Numbers that decide more than their own value: a case with another value has to be read.
        self.to_read = {
            number.key
            for number in self.numbers
            if number.reader is not FACTOR
            and not is_held(self.mission, number.key, is_stated=number.value is not None)
        }

    def watched(self, values: Mapping[str, Values], progress: Progress = unseen) -> dict[str, Values]:
        """Check all cases and report progress; returns the columns by name.

        `values` has an array (cases,) for each key. The first reports come early, so that the total time can be
        estimated. Later reports are rare, because each costs time.
        """
        cases = len(next(iter(values.values())))
        ends = (
            [cases]
            if progress is unseen
            else [
                end
                for end in (*_FIRST_REPORTS, *range(_REPORT_INTERVAL_CASES, cases, _REPORT_INTERVAL_CASES))
                if end < cases
            ]
        )
        blocks = []
        for start, stop in pairwise(dict.fromkeys((0, *ends, cases))):
            blocks.append(self.part(start, stop, {key: column[start:stop] for key, column in values.items()}).values)
            progress(stop, cases)
        return {name: np.concatenate([block[name] for block in blocks]) for name in blocks[0]}

    def part(self, start: int, stop: int, values: Mapping[str, Values]) -> Part:
        """Check the cases `start` to `stop` - 1; `values` has an array (stop - start,) for each varied key."""
        columns = self._columns(values, stop - start)
        if self.question.choices:
            for table, cases in self._by_words(columns):
                numbers = {number.key: columns[number.key][cases] for number in self.numbers}
                for name, column in table.part(0, cases.size, numbers).values.items():
                    columns[name][cases] = column
        else:
            self._fill(columns)
        return Part(start, stop, columns)

    def reads(self, values: Mapping[str, Values]) -> int:
        """Count the cases that have to be read one by one; `values` has an array (cases,) for each varied key."""
        cases = len(next(iter(values.values())))
        columns = self._columns(values, cases)
        if self.question.choices:
            return sum(
                table.reads({number.key: columns[number.key][indices] for number in self.numbers})
                for table, indices in self._by_words(columns)
                if self.numbers
            )
        return cases - int(self._arrays(columns, cases)[0].size)

    def _columns(self, values: Mapping[str, Values], cases: int) -> dict[str, Values]:
        """Make the columns of `cases` cases: columns of the given values, and empty columns for the results."""
        columns: dict[str, Values] = {key: np.asarray(values[key], dtype=object) for key in self.question.choices}
        columns |= {number.key: np.asarray(values[number.key], dtype=float) for number in self.numbers}
        is_text = {column.name: column.is_text for column in (*GEOMETRY, *VERDICT, DOUBTS, WAIVED_BY, REASON)}
        for name, is_of_texts in (is_text | {name: is_status(name) for name in self.fields}).items():
            columns[name] = np.full(cases, "", dtype=object) if is_of_texts else np.full(cases, math.nan)
        return columns

    # ---------------------------------------------------------------- one mission for the same words
    def _by_words(self, columns: Mapping[str, Values]) -> Iterator[tuple["Table", Indices]]:
        """Yield a table for each combination of string values, with the indices of its cases.

        A combination with which the mission is invalid in all cases yields no table. The status and the reason of
        these cases are written into `columns`.
        """
        indices_by_words: dict[tuple[str, ...], list[int]] = {}
        for index, words in enumerate(zip(*(columns[key].tolist() for key in self.question.choices), strict=True)):
            indices_by_words.setdefault(words, []).append(index)
        for words, indices in indices_by_words.items():
            if words not in self.chosen:
                changes = [SetValue(key, word) for key, word in zip(self.question.choices, words, strict=True)]
                mission = None
                try:
                    mission = self.variation.read(changes)
                except MissionError:  # with the numbers of the first case that makes a mission
                    for index in indices:
                        mission = mission or self._read(columns, index)
                if mission is None:
                    continue
                self.chosen[words] = Table(self.question._replace(changes=mission.changes, choices=()), mission)
            yield self.chosen[words], np.array(indices)

    def _read(self, columns: Mapping[str, Values], index: int) -> Mission | None:
        """Read the mission of a case.

        Returns None if the mission is invalid; its status and the reason are then written into `columns`.
        """
        words = [SetValue(key, columns[key][index]) for key in self.question.choices]
        values = {number: float(columns[number.key][index]) for number in self.numbers}
        changed = {
            number: value
            for number, value in values.items()
            if number.reader is not FACTOR and (words or value != number.value)
        }
        try:
            mission = self.variation.at(changed, words)
        except MissionError as error:
            fault = error.faults[0]
            columns["status"][index], columns["reason"][index] = "error", f"{fault.key}: {fault.problem}"
            return None
        for number, value in values.items():
            if number.reader is FACTOR:
                mission = scaled(mission, number.key, value)
        return mission

    # ---------------------------------------------------------------- all together
    def _fill(self, columns: dict[str, Values]) -> None:
        """Check every case, and write the results into the columns."""
        cases = columns["utilization"].size
        indices, mission_of_arrays, geometries = self._arrays(columns, cases)
        if indices.size:
            self._check(columns, indices, mission_of_arrays, geometries)
        read_indices: list[int] = []

        def read() -> Iterator[Mission]:
            """Yield the missions of all cases that arrays cannot represent, read one by one.

            The indices of cases with a valid mission are appended to `read_indices`.
            """
            for index in np.delete(np.arange(cases), indices).tolist():
                mission = self._read(columns, index)
                if mission is not None:
                    read_indices.append(index)
                    yield mission

        for mission, cases_of_shape in stacked(read()):
            self._check(columns, np.array(read_indices)[cases_of_shape], mission, mission.geometry)

    def _arrays(self, columns: Mapping[str, Values], cases: int) -> tuple[Indices, Mission, BistaticGeometry]:
        """Find the cases that arrays of numbers can represent, so that they are not read one by one.

        Returns the indices of these cases, the mission with the arrays, and its geometry.
        """
        is_direct = np.ones(cases, dtype=bool)
        for number in self.numbers:
            values, (gt, ge, lt, le) = columns[number.key], number.reader.bounds
            is_accepted = (values > gt) & (values >= ge) & (values < lt) & (values <= le)
            is_direct &= values == number.value if number.key in self.to_read else is_accepted
        indices, mission = np.flatnonzero(is_direct), self.mission
        for number in self.numbers:
            if number.reader is FACTOR:
                mission = scaled(mission, number.key, np.asarray(columns[number.key], dtype=float)[indices])
            elif number.key not in self.to_read:
                mission = with_number(mission, number.key, columns[number.key][indices])
        geometries = mission.geometry
        is_sure = is_image(mission, geometries, indices.size)
        if is_sure.all():
            return indices, mission, geometries
        mission = picked(mission, np.flatnonzero(is_sure))
        return indices[is_sure], mission, mission.geometry

    def _check(
        self, all_columns: dict[str, Values], indices: Indices, mission: Mission, geometries: BistaticGeometry
    ) -> None:
        """Judge all cases of a mission with arrays, and write the results into `all_columns`.

        Cases are judged in groups that need the same number of nodes in the aperture. `indices` are the indices of
        the cases in `all_columns`.
        """
        for nodes, group, mission_of_group, geometry_of_group in by_nodes(mission, indices.size, geometries):
            analysis = Analysis(
                mission_of_group,
                group.size,
                geometry=geometry_of_group,
                nodes=nodes,
                shown=self.subjects,
                is_complete=self.is_complete,
            )
            judged = judged_mission(analysis, self.question.today)
            rows = {row.subject.id: row for row in judged.rows}
            columns = _verdict(judged, rows, self.question.row, self.question.breaks)
            columns[DOUBTS.name] = _doubts(judged)
            with np.errstate(all="ignore"):
                geometry = (
                    *analysis.resolution[:2],
                    geometry_of_group.bistatic_angle,
                    geometry_of_group.gradient_angle,
                )
                columns |= {column.name: number for column, number in zip(GEOMETRY, geometry, strict=True)}
                for name, (row, field_name) in self.fields.items():
                    if row in rows:
                        columns[name] = (
                            statuses(rows[row].status) if is_status(name) else getattr(rows[row], field_name)
                        )
                    elif is_status(name):
                        columns[name] = "not_declared"
            for name, column in columns.items():
                all_columns[name][indices[group]] = np.broadcast_to(column, group.shape)


def is_status(name: str) -> bool:
    """Whether the column with this name, such as `ROW.status`, has statuses instead of numbers."""
    return name.endswith(".status")
