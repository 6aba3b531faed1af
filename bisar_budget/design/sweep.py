"""Check a mission in many cases: arrays of numbers in, columns of what `check` finds out.

Memory does not grow with the number of cases: they are checked in parts, as they are asked for.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from functools import cached_property, lru_cache
from hashlib import sha256
from typing import Any

import numpy as np

from bisar_budget.budget.check import check_mission
from bisar_budget.budget.judged_rows import IN_UNIT
from bisar_budget.design.cases import Cases, words_of
from bisar_budget.design.table import (
    GEOMETRY,
    REASON,
    VERDICT,
    WAIVED_BY,
    Column,
    Part,
    Question,
    Swept,
    Table,
    is_status,
)
from bisar_budget.faults import Fault, MissionError, SetValue, fault_words, shown
from bisar_budget.findings.row import Row, unknown_id
from bisar_budget.mission.load import mission_of, named_by
from bisar_budget.mission.model import Mission
from bisar_budget.mission.quantities import Choices, Number, QuestionError
from bisar_budget.mission.tree import read_tree
from bisar_budget.workers import MapBlocks, in_processes

_SLOW = 1 / 8  # of cases that are read one by one, from which processes share them out
_MANY = 8  # parts, from which processes of their own are worth their start
_TOGETHER = 8192  # cases of a part: their arrays stay in a processor's cache
_FEW = 64  # cases of a part where each is read

Block = tuple[int, int, Mapping[str, Any]]  # first case, the one after the last, values of each key

# Fields of a row that a column may have, and what they hold.
_FIELDS = {
    "status": "Status of {0}.",
    "declared": "Declared value of {0}.",
    "allowable": "Largest value that {0} may have.",
    "allowable_published": "The same by the published model.",
    "allowable_full": "The same by the full model.",
    "utilization": "Declared value of {0} over its allowable.",
    "margin": "Allowable of {0} over its declared value, less one.",
    "qpe_published_rad": "Quadratic phase of {0} by the published model.",
    "qpe_full_rad": "Quadratic phase of {0} by the full model.",
    "qpe_exact_rad": "Quadratic phase of {0} by exact ranges.",
    "cubic_rad": "Cubic phase of {0}.",
    "islr_db": "ISLR that {0} adds.",
    "equal_loss_qpe_rad": "Quadratic phase of as much loss of the peak as {0} by the full model.",
    "rest_rad": "Rms phase of {0} beyond the cubic.",
}
_UNITS = {"rad": "rad", "db": "dB"}  # by what a field's name ends with


class Asked:
    """A mission that is to be checked in many cases, in chunks.

    Arguments are those of `bisar_budget.sweep`. A column that is named twice is there once.

    Raises
    ------
    QuestionError
        A column is of no row, or of no field; a key makes no mission whatever its value.
    """

    def __init__(
        self,
        mission: Mission,
        cases: Cases,
        *,
        columns: Sequence[str] = (),
        model: str | None = None,
        today: date,
    ) -> None:
        choices = tuple(one.key for one in cases.varied if isinstance(one, Choices))
        keys = tuple(one.key for one in cases.varied if one.key not in choices)
        if model is not None and "allocation.model" in choices:
            raise QuestionError("allocation.model: --model stands in for it; accepted: one of the two")
        each = tuple(dict.fromkeys(columns))  # Parquet could not be read with a column twice
        self.question = Question.of(mission, keys, model, today, columns=each, choices=choices)
        self.mission, self.cases, self.table = mission, cases, Table(self.question, mission)
        missions = [self.table.mission, *self._chosen()]
        self.columns = tuple(self._columns(missions) if columns else ())
        for number in cases.varied:
            if isinstance(number, Number) and number.value is None:  # the file may state its path in another way
                self._hold_to_a_mission(number)

    def _chosen(self) -> Iterator[Mission]:
        """The mission with each word alone, where there is one.

        Raises
        ------
        QuestionError
            A word is at fault by itself, such as a part that is not in the catalogue; or no word makes a mission.
        """
        for choices, words in words_of(self.cases):
            problems = set()
            for word in words:
                try:
                    chosen = self.table.variation.read([SetValue(choices.key, word)])
                except MissionError as error:
                    of_word = [fault for fault in error.faults if fault.option == f"--set {choices.key}"]
                    if of_word:
                        key = of_word[0].key
                        said = f"{'' if key == choices.key else f'{key} '}{_said(of_word[0])}"
                        raise QuestionError(f"{choices.key}={shown(word)}: {said}") from None
                    problems.add(f"{error.faults[0].key} {_said(error.faults[0])}")
                else:
                    problems.add("")
                    yield chosen
            if len(problems) == 1 and (problem := problems.pop()):
                raise QuestionError(f"{choices.key}: no value of it makes a mission: {problem}")

    def _hold_to_a_mission(self, number: Number) -> None:
        """Refuse a key that makes no mission at its first, middle and last value, for one reason."""
        problems = set()
        for place in {0, self.cases.count // 2, self.cases.count - 1}:
            values = self.cases.values(place, place + 1)
            words = [SetValue(key, values[key][0]) for key in self.question.choices]
            try:
                self.table.variation.at({number: float(values[number.key][0])}, words)
                return
            except MissionError as error:
                problems.add(f"{error.faults[0].key} {_said(error.faults[0])}")
        if len(problems) == 1:
            raise QuestionError(f"{number.key}: no value of it makes a mission: {problems.pop()}")

    def _columns(self, missions: Sequence[Mission]) -> Iterator[Column]:
        """The columns that were asked for; a row is there if any of the missions has it."""
        rows: dict[str, Row] = {}
        for mission in missions:
            rows = {row.id: row for row in check_mission(mission, self.question.today).rows} | rows
        for name, (row, field) in self.table.fields.items():
            if field not in _FIELDS:
                raise QuestionError(
                    f"--column {name}: {field!r} is no field of a row; accepted: {', '.join(_FIELDS)}"
                )
            if row not in rows:
                raise QuestionError(f"--column {name}: {unknown_id(row, rows, self.question.file)}")
            unit = rows[row].unit if field in IN_UNIT else _UNITS.get(field.rpartition("_")[2], "")
            yield Column(name, unit, _FIELDS[field].format(row), is_text=is_status(name))

    def swept(self, parts: Iterator[Part]) -> Swept:
        """The sweep that has these parts."""
        varied = [
            Column(one.key, one.dimension.si if isinstance(one, Number) else "", "Varies.", isinstance(one, Choices))
            for one in self.cases.varied
        ]
        return Swept(
            mission_name=self.mission.name,
            mission_sha256=sha256(self.mission.data).hexdigest(),
            varied=tuple(column.name for column in varied),
            count=self.cases.count,
            columns=(*varied, *GEOMETRY, *VERDICT, *self.columns, WAIVED_BY, REASON),
            parts=parts,
        )

    def checked(self, jobs: int = 1) -> Swept:
        """The sweep, whose parts are checked as they are asked for, by so many processes."""
        return self.swept(self.shared_out(self.chunks.starts, jobs))

    @cached_property
    def chunks(self) -> "Chunks":
        """How the cases are cut: into few where many are read by themselves, which some of them show."""
        cases, is_slow = self.cases, False
        if cases.count > _FEW:
            places = np.linspace(0, cases.count - 1, _FEW).astype(int)
            some = [cases.values(place, place + 1) for place in places.tolist()]
            values = {one.key: np.concatenate([each[one.key] for each in some]) for one in cases.varied}
            is_slow = self.table.reads(values) > _SLOW * _FEW
        return Chunks(cases.count, _FEW if is_slow else _TOGETHER, is_slow)

    @cached_property
    def travelling(self) -> Question:
        """The question with all that the mission names: other processes see what this one saw."""
        words = [SetValue(one.key, word) for one, chosen in words_of(self.cases) for word in chosen]
        return self.question._replace(named=named_by(self.mission, words))

    def shared_out(self, starts: Sequence[int], jobs: int, mapped: MapBlocks | None = None) -> Iterator[Part]:
        """Check the chunks that begin at `starts`, in their order; processes share out what is read case by case.

        What arrays hold takes less time than to send it from one process to another. Where `mapped` has others do it,
        they do all, and parts come in any order.
        """
        stops = ((start, self.chunks.stop(start)) for start in starts)
        blocks = ((start, stop, self.cases.values(start, stop)) for start, stop in stops)
        if mapped is None and self.chunks.is_slow and jobs > 1 and len(starts) >= _MANY:
            mapped = in_processes(jobs)
        if mapped is None:
            yield from (self.table.part(*block) for block in blocks)
        else:
            found = mapped(part_of, self.travelling, blocks, lambda block: f"cases {block[0]} to {block[1] - 1}")
            yield from (part for _, part in found)


@dataclass(frozen=True)
class Chunks:
    """How cases up to `end` are cut; `is_slow` where many are read by themselves."""

    end: int
    size: int
    is_slow: bool

    @property
    def starts(self) -> range:
        """First case of each chunk."""
        return range(0, self.end, self.size)

    def stop(self, start: int) -> int:
        """End of the chunk that begins at a case."""
        return min(start + self.size, self.end)


@lru_cache(maxsize=1)
def _table(question: Question) -> Table:
    parse = mission_of if question.named is None else question.named.parse
    tree = read_tree(question.data, question.file)
    return Table(question, parse(tree, question.data, question.file, question.model, changes=question.changes))


def part_of(question: Question, block: Block) -> Part:
    """Check a block of cases in a process that knows nothing else; it keeps the last question."""
    return _table(question).part(*block)


def _said(fault: Fault) -> str:
    """Words for a fault: what is wrong, and what would not be."""
    return fault_words(fault.problem, "", fault.accepted, "" if "Read with" in fault.hint else fault.hint)
