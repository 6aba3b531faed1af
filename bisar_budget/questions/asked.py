"""Checks of a mission in many cases: values are given as arrays, and results are returned as columns.

The cases are checked in parts. A part is checked only when its results are needed, so memory does not grow with the
number of cases.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from datetime import date
from functools import cached_property, lru_cache
from hashlib import sha256

import numpy as np

from bisar_budget import __version__
from bisar_budget.budget.check import check_mission
from bisar_budget.budget.judged_rows import IN_UNIT
from bisar_budget.faults import Fault, MissionError, SetValue, changes_words, fault_words, shown
from bisar_budget.findings.case_table import Cases, Chunks, Column, Part, Swept, Values
from bisar_budget.findings.row import Row, unknown_id
from bisar_budget.mission.load import mission_of, named_by
from bisar_budget.mission.model import Mission
from bisar_budget.mission.quantities import Choices, Number, QuestionError
from bisar_budget.mission.tree import read_tree
from bisar_budget.questions.cases import words_of
from bisar_budget.questions.table import DOUBTS, GEOMETRY, REASON, VERDICT, WAIVED_BY, Question, Table, is_status
from bisar_budget.report.words.key_names import in_words
from bisar_budget.report.words.sentences import sentence
from bisar_budget.workers import MapBlocks, in_processes

_SLOW_FRACTION = 1 / 8  # if a larger fraction of cases is read one by one, processes share the cases
_MIN_SHARED_PART_COUNT = 8  # for fewer parts it takes longer to start processes
_PART_CASES = 8192  # number of cases in a part, so that their arrays stay in a processor's cache
_READ_PART_CASES = 64  # number of cases in a part if each case is read

Block = tuple[int, int, Mapping[str, Values]]  # first case, the one after the last, values of each key

# Fields of a row that a column may have, with descriptions.
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
_UNIT_BY_SUFFIX = {"rad": "rad", "db": "dB"}  # by the last word of a field's name


class Asked:
    """A requested sweep: a mission, and the cases in which it is checked.

    The arguments are the same as for `bisar_budget.sweep`. A column that is named repeatedly is used only once.

    Raises
    ------
    QuestionError
        A column names an unknown row or field, or the mission is invalid with every value of a key.
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
        choices = tuple(each.key for each in cases.varied if isinstance(each, Choices))
        keys = tuple(each.key for each in cases.varied if each.key not in choices)
        if model is not None and "allocation.model" in choices:
            raise QuestionError("allocation.model: --model stands in for it; accepted: one of the two")
        unique = tuple(dict.fromkeys(columns))  # Parquet files with repeated columns cannot be read
        self.question = Question.of(mission, keys, model, today, columns=unique, choices=choices)
        self.mission, self.cases, self.table = mission, cases, Table(self.question, mission)
        missions = [self.table.mission, *self._chosen()]
        self.columns = tuple(self._columns(missions) if columns else ())
        for number in cases.varied:
            if (
                isinstance(number, Number) and number.value is None
            ):  # the file may state the path of a platform in another way
                self._hold_to_a_mission(number)

    def again(self, *, cases: Cases | None = None, columns: Sequence[str] | None = None) -> "Asked":
        """Make the same request with different cases, or with different columns."""
        question = self.question
        return Asked(
            self.mission,
            self.cases if cases is None else cases,
            columns=question.columns if columns is None else columns,
            model=question.model,
            today=question.today,
        )

    def _chosen(self) -> Iterator[Mission]:
        """Yield the mission with each string value of each varied key, changing one key at a time.

        Values with which the mission is invalid are left out.

        Raises
        ------
        QuestionError
            A value is invalid by itself, such as a part that is not in the catalogue, or the mission is invalid for
            the same reason with every string value of a key.
        """
        for choices, words in words_of(self.cases):
            problems = set()
            for word in words:
                try:
                    chosen = self.table.variation.read([SetValue(choices.key, word)])
                except MissionError as error:
                    faults_of_word = [fault for fault in error.faults if fault.option == f"--set {choices.key}"]
                    if faults_of_word:
                        key = faults_of_word[0].key
                        problem_text = f"{'' if key == choices.key else f'{key} '}{_fault_text(faults_of_word[0])}"
                        raise QuestionError(f"{choices.key}={shown(word)}: {problem_text}") from None
                    problems.add(f"{error.faults[0].key} {_fault_text(error.faults[0])}")
                else:
                    problems.add("")
                    yield chosen
            if len(problems) == 1 and (problem := problems.pop()):
                raise QuestionError(f"{choices.key}: no value of it makes a mission: {problem}")

    def _hold_to_a_mission(self, number: Number) -> None:
        """Raise `QuestionError` if the mission is invalid with every tried value of a key.

        The first, the middle and the last value are tried. The error is raised only if the mission is invalid with
        all three for the same reason.
        """
        problems = set()
        for index in {0, self.cases.count // 2, self.cases.count - 1}:
            values = self.cases.values(index, index + 1)
            words = [SetValue(key, values[key][0]) for key in self.question.choices]
            try:
                self.table.variation.at({number: float(values[number.key][0])}, words)
                return
            except MissionError as error:
                problems.add(f"{error.faults[0].key} {_fault_text(error.faults[0])}")
        if len(problems) == 1:
            raise QuestionError(f"{number.key}: no value of it makes a mission: {problems.pop()}")

    def _columns(self, missions: Sequence[Mission]) -> Iterator[Column]:
        """Yield the requested columns.

        Raises `QuestionError` if a column names an unknown field, or a row that no mission has.
        """
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
            unit = rows[row].unit if field in IN_UNIT else _UNIT_BY_SUFFIX.get(field.rpartition("_")[2], "")
            yield Column(name, unit, _FIELDS[field].format(row), is_text=is_status(name))

    def swept(self, parts: Iterator[Part]) -> Swept:
        """Describe the sweep: its mission, varied keys and columns, together with its results.

        `parts` is the iterator over the checked parts of the results.
        """
        varied = [
            Column(
                each.key,
                each.dimension.si if isinstance(each, Number) else "",
                f"{sentence(in_words(each.key))}, which varies.",
                isinstance(each, Choices),
            )
            for each in self.cases.varied
        ]
        return Swept(
            mission_name=self.mission.name,
            mission_sha256=sha256(self.mission.data).hexdigest(),
            varied=tuple(column.name for column in varied),
            count=self.cases.count,
            columns=(*varied, *GEOMETRY, *VERDICT, *self.columns, DOUBTS, WAIVED_BY, REASON),
            parts=parts,
        )

    def checked(self, jobs: int = 1) -> Swept:
        """Make the sweep, whose results are computed when they are needed.

        `jobs` is the number of processes that check the cases.
        """
        return self.swept(self.shared_out(self.chunks.starts, jobs))

    @cached_property
    def chunks(self) -> "Chunks":
        """The cases divided into chunks, which are checked one at a time.

        Chunks are smaller if many cases in a sample have to be read one by one, because arrays cannot represent them.
        """
        cases, is_slow = self.cases, False
        if cases.count > _READ_PART_CASES:
            indices = np.linspace(0, cases.count - 1, _READ_PART_CASES).astype(int)
            sample = [cases.values(index, index + 1) for index in indices.tolist()]
            values = {varied.key: np.concatenate([each[varied.key] for each in sample]) for varied in cases.varied}
            is_slow = self.table.reads(values) > _SLOW_FRACTION * _READ_PART_CASES
        return Chunks(cases.count, _READ_PART_CASES if is_slow else _PART_CASES, is_slow)

    @cached_property
    def travelling(self) -> Question:
        """The question of the sweep in a form that can be sent to other processes.

        A question is the mission with its varied keys and requested columns. In this form it also contains the
        content of all files that the mission names.
        """
        words = [SetValue(choices.key, word) for choices, chosen in words_of(self.cases) for word in chosen]
        return self.question._replace(named=named_by(self.mission, words))

    @property
    def inputs(self) -> Mapping[str, str]:
        """All inputs that determine the results in a part of the sweep, by the description of each input in messages.

        Parts with equal inputs can be combined.
        """
        question, sweep = self.travelling, self.swept(iter(()))
        has_waivers = bool(self.table.mission.waivers)  # only waivers depend on the day
        return {
            "the version of bisar-budget was": __version__,
            "the hash of the mission file was": sweep.mission_sha256[:16],
            "the hash of what the mission names was": question.named.sha256[:16] if question.named else "",
            "--set was": changes_words(question.changes),
            "the model that decides was": self.table.mission.gating_model,
            "--date was": question.today.isoformat() if has_waivers else "",
            "the cases were": f"{self.cases.count} of {', '.join(sweep.varied)}",
            "the hash of the values of the cases was": _hash_of(self.cases)[:16],
            "the size of the parts was": str(self.chunks.size),
            "the columns were": ", ".join(column.name for column in sweep.columns),
        }

    def shared_out(self, starts: Sequence[int], jobs: int, mapped: MapBlocks | None = None) -> Iterator[Part]:
        """Check the chunks that begin at the cases `starts`, and yield their results, usually in this order.

        `jobs` processes share the work only if many cases have to be read one by one, because cases in arrays take
        less time to check than to send to another process. If `mapped` is given, it distributes all chunks to other
        workers, and the order of the results is arbitrary.
        """
        stops = ((start, self.chunks.stop(start)) for start in starts)
        blocks = ((start, stop, self.cases.values(start, stop)) for start, stop in stops)
        if mapped is None and self.chunks.is_slow and jobs > 1 and len(starts) >= _MIN_SHARED_PART_COUNT:
            mapped = in_processes(jobs)
        if mapped is None:
            yield from (self.table.part(*block) for block in blocks)
        else:
            checked_parts = mapped(
                part_of, self.travelling, blocks, lambda block: f"cases {block[0]} to {block[1] - 1}"
            )
            yield from (part for _, part in checked_parts)


def _hash_of(cases: Cases) -> str:
    """SHA-256 hash of the values that the cases give to the varied keys."""
    digest = sha256(repr((cases.is_grid, cases.shape)).encode())
    for values in cases.columns:
        is_words = values.dtype == object
        digest.update(json.dumps(values.tolist()).encode() if is_words else np.ascontiguousarray(values, "<f8").data)
    return digest.hexdigest()


@lru_cache(maxsize=1)
def _table(question: Question) -> Table:
    """Make the table that checks the cases of a question; the table of the last question is cached."""
    parse = mission_of if question.named is None else question.named.parse
    tree = read_tree(question.data, question.file)
    return Table(question, parse(tree, question.data, question.file, question.model, changes=question.changes))


def part_of(question: Question, block: Block) -> Part:
    """Check a block of cases; worker processes call this function, and keep the table of the last question."""
    return _table(question).part(*block)


def _fault_text(fault: Fault) -> str:
    """Text of a fault, with its problem and the accepted values."""
    return fault_words(fault.problem, "", fault.accepted, "" if "Read with" in fault.hint else fault.hint)
