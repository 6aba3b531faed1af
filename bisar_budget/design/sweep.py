"""Check a mission in many cases: arrays of numbers in, columns of what `check` finds out.

Cases that arrays hold are checked together (`arrays`), the others one by one as `check` does; the numbers are
the same, and how many took the long way is said. Where keys have words instead of numbers, the cases with the same
words are those of one mission. Memory does not grow with the number of cases.
"""

import math
from collections import deque
from collections.abc import Container, Iterator, Mapping, Sequence
from datetime import date
from functools import cached_property, lru_cache
from hashlib import sha256
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from bisar_budget.arrays import judged
from bisar_budget.arrays.held import is_image, not_held
from bisar_budget.arrays.judged import check_arrays, statuses
from bisar_budget.arrays.varied import varied
from bisar_budget.budget.check import check_mission
from bisar_budget.budget.judged_rows import REQUIREMENTS, Judged
from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.design.cases import Cases, words_of
from bisar_budget.design.quantities import Choices, Number, QuestionError, number_of, tree_of
from bisar_budget.design.swept import Column, Part, Swept, Values
from bisar_budget.design.variation import ALIKE, Variation, breaking, standing
from bisar_budget.faults import Fault, MissionError, SetValue, fault_words, shown
from bisar_budget.findings.row import Row, unknown_id
from bisar_budget.findings.status import RANK, STATUS
from bisar_budget.geometry import BistaticGeometry
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.model import Mission
from bisar_budget.mission.named import Named, named_by
from bisar_budget.ranges.exact_ranges import nodes_for
from bisar_budget.workers import MapBlocks, Progress, unseen, worker_pool

if TYPE_CHECKING:
    from concurrent.futures import Future

_SLOW = 1 / 8  # of cases that are checked one by one, from which processes share them out
_MANY = 8  # parts, from which processes of their own are worth their start
_TOGETHER = 8192  # cases of a part: their arrays stay in a processor's cache
_FEW = 64  # cases of a part where each is checked by itself

Block = tuple[int, int, Mapping[str, Any]]  # first case, the one after the last, values of each key

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
}
_UNITS = {
    "qpe_published_rad": "rad",
    "qpe_full_rad": "rad",
    "qpe_exact_rad": "rad",
    "cubic_rad": "rad",
    "islr_db": "dB",
}
_IN_UNIT = ("declared", "allowable", "allowable_published", "allowable_full")


class _Field(NamedTuple):
    """A column that was asked for: a field of a row."""

    name: str
    row: str
    field: str

    @property
    def is_text(self) -> bool:
        """Whether it is no number."""
        return self.field == "status"


def sweep(
    mission: Mission,
    cases: Cases,
    *,
    columns: Sequence[str] = (),
    model: str | None = None,
    today: date,
    jobs: int = 1,
) -> Swept:
    """Check a mission in many cases.

    Parameters
    ----------
    mission : Mission
        As loaded.
    cases : Cases
        Which keys vary, and their values.
    columns : sequence of str
        Further columns, `ROW.FIELD`, such as `receiver.acceleration.x.allowable`; one named twice is there once.
    model : str, optional
        Gating model in place of the mission's own.
    today : date
        Day on which waivers are judged, UTC.
    jobs : int
        Processes to share the cases out to.

    Returns
    -------
    Swept
        Its parts are found as they are asked for.

    Raises
    ------
    QuestionError
        A column is of no row, or of no field; a key makes no mission whatever its value.
    """
    asked = Asked(mission, cases, columns=columns, model=model, today=today)
    return asked.swept(_parts(asked, jobs))


class Asked:
    """The cases of a mission that a sweep is about, in chunks; arguments and faults are those of `sweep`."""

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
        self.question = Question(mission.data, mission.file, mission.changes, keys, each, model, today, choices)
        self.mission, self.cases, self.engine = mission, cases, Engine(self.question, mission)
        missions = [self.engine.mission, *self._chosen()]
        self.columns = tuple(self._columns(missions) if columns else ())
        for number in cases.varied:
            if isinstance(number, Number) and number.value is None:  # the file may state its path in another way
                self.engine.hold_to_a_mission(number, cases)

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
                    chosen = self.engine.variation.read([SetValue(choices.key, word)])
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

    def _columns(self, missions: Sequence[Mission]) -> Iterator[Column]:
        """The columns that were asked for; a row is there if any of the missions has it."""
        rows: dict[str, Row] = {}
        for mission in missions:
            rows = {row.id: row for row in check_mission(mission, self.question.today).rows} | rows
        for one in self.engine.asked:
            if one.field not in _FIELDS:
                raise QuestionError(
                    f"--column {one.name}: {one.field!r} is no field of a row; accepted: {', '.join(_FIELDS)}"
                )
            if one.row not in rows:
                raise QuestionError(f"--column {one.name}: {unknown_id(one.row, rows, self.question.file)}")
            unit = rows[one.row].unit if one.field in _IN_UNIT else _UNITS.get(one.field, "")
            yield Column(one.name, unit, _FIELDS[one.field].format(one.row), is_text=one.is_text)

    def swept(self, parts: Iterator[Part]) -> Swept:
        """The sweep that has these parts."""
        varied = [
            Column(one.key, "", "Varies.", is_text=True)
            if isinstance(one, Choices)
            else Column(one.key, one.dimension.si, "Varies.")
            for one in self.cases.varied
        ]
        return Swept(
            mission_name=self.mission.name,
            mission_sha256=sha256(self.mission.data).hexdigest(),
            varied=tuple(column.name for column in varied),
            shape=self.cases.shape,
            count=self.cases.count,
            columns=(*varied, *GEOMETRY, *VERDICT, *self.columns, REASON),
            parts=parts,
        )

    def chunks(self) -> "Chunks":
        """How the cases are cut: into few where each is checked by itself, which some of them show."""
        count = self.cases.count
        is_slow = bool(self.engine.not_held and not self.question.choices)
        is_slow = is_slow or (count > _FEW and self._share_by_case() > _SLOW)
        return Chunks(count, _FEW if is_slow else _TOGETHER, is_slow)

    def _share_by_case(self) -> float:
        """Share of cases that are checked one by one, by a few of them that are spread over all."""
        cases = self.cases
        places = np.linspace(0, cases.count - 1, _FEW).astype(int)
        some = [cases.values(place, place + 1) for place in places.tolist()]
        values = {one.key: np.concatenate([each[one.key] for each in some]) for one in cases.varied}
        return self.engine.part(0, _FEW, values).by_case / _FEW

    @cached_property
    def travelling(self) -> "Question":
        """The question with all that the mission names: other processes see what this one saw."""
        words = [SetValue(one.key, word) for one, chosen in words_of(self.cases) for word in chosen]
        return self.question._replace(named=named_by(self.mission, words))

    def shared_out(
        self, chunks: "Chunks", starts: Sequence[int], jobs: int, mapped: MapBlocks | None = None
    ) -> Iterator[Part]:
        """Check the chunks that begin at `starts`, in their order; processes share out what is checked case by case.

        What arrays hold takes less time than to send it from one process to another. Where `mapped` has others do it,
        they do all, and parts come in any order.
        """
        if mapped is not None:
            blocks = (self.block(chunks, start) for start in starts)
            for _, part in mapped(
                part_of, self.travelling, blocks, lambda block: f"cases {block[0]} to {block[1] - 1}"
            ):
                yield part
            return
        if not chunks.is_slow or jobs == 1 or len(starts) < _MANY:
            for start in starts:
                yield self.engine.part(*self.block(chunks, start))
            return
        with worker_pool(jobs, "spawn") as pool:
            waiting: deque[Future[Part]] = deque()
            for start in starts:
                waiting.append(pool.submit(part_of, self.travelling, self.block(chunks, start)))
                if len(waiting) > 3 * jobs:  # none is far ahead of what has been asked for
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()

    def block(self, chunks: "Chunks", start: int) -> Block:
        """The chunk that begins at a case: what `part_of` takes besides the question."""
        stop = chunks.stop(start)
        return start, stop, self.cases.values(start, stop)


class Chunks(NamedTuple):
    """How cases up to `end` are cut; `is_slow` where each is checked by itself."""

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


def _parts(asked: Asked, jobs: int) -> Iterator[Part]:
    """Find the parts in their order, as they are asked for."""
    chunks = asked.chunks()
    yield from asked.shared_out(chunks, chunks.starts, jobs)


class Question(NamedTuple):
    """What a process needs to check cases of a mission; `named` where it cannot read what the mission names.

    `keys` have numbers, `choices` words. `row` and `target` are those of `standing` and `breaking`: the row that is
    judged instead of the mission, one of its rows; and what must not happen.
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
    target: str = "fail"


@lru_cache(maxsize=1)
def _engine(question: Question) -> "Engine":
    parse = parse_mission if question.named is None else question.named.parse
    return Engine(question, parse(question.data, question.file, question.model, changes=question.changes))


def part_of(question: Question, block: Block) -> Part:
    """Check a block of cases in a process that knows nothing else; it keeps the last question."""
    return _engine(question).part(*block)


class Engine:
    """Checks cases of one mission; a process of its own can have one."""

    def __init__(self, question: Question, mission: Mission) -> None:
        self.question, model = question, question.model
        self.chosen: dict[tuple[str, ...], Engine | None] = {}  # by the words of its cases; None: see `_by_word`
        self.mission = mission if model is None else _gated(mission, model)
        self.variation = Variation(mission, model, question.named)
        tree = tree_of(mission)
        self.numbers = tuple(number_of(tree, key) for key in question.keys)
        self.asked = [_Field(name, *_of_row(name)) for name in question.columns]
        rows = {row.id: row for row in check_mission(self.mission, question.today).rows} if self.asked else {}
        here = [one for one in self.asked if one.row in rows]
        self.subjects = {one.row: rows[one.row].subject for one in here}
        self.not_held = not_held(self.mission, {number.key: number.value is not None for number in self.numbers})
        # A brief check leaves out allowables of what is not declared, and those of the model that does not gate.
        self.is_brief = not any(
            one.field in ("allowable_published", "allowable_full")
            or (one.field in _IN_UNIT and rows[one.row].declared is None)
            or not rows[one.row].is_independent
            for one in here
        )
        strange = [one.name for one in self.asked if one.field not in judged.FIELDS]
        self.not_held = self.not_held or next(iter(strange), "")

    def hold_to_a_mission(self, number: Number, cases: Cases) -> None:
        """Refuse a key that makes no mission at its first, middle and last value, for one reason."""
        problems = set()
        for place in {0, cases.count // 2, cases.count - 1}:
            values = cases.values(place, place + 1)
            words = [SetValue(key, values[key][0]) for key in self.question.choices]
            try:
                self.variation.at({number: float(values[number.key][0])}, words)
            except MissionError as error:
                problems.add(f"{error.faults[0].key} {_said(error.faults[0])}")
            else:
                return
        if len(problems) == 1:
            raise QuestionError(f"{number.key}: no value of it makes a mission: {problems.pop()}")

    def part(self, start: int, stop: int, values: Mapping[str, Any], progress: Progress = unseen) -> Part:
        """Check cases `start` to `stop`, whose values are (stop - start,).

        `progress` is told, after each that is checked by itself, how many are done, and how many there are.
        """
        cases = stop - start
        found: dict[str, Values] = {key: np.asarray(values[key], dtype=object) for key in self.question.choices}
        found |= {number.key: np.asarray(values[number.key], dtype=float) for number in self.numbers}
        columns = [(column.name, column.is_text) for column in (*GEOMETRY, *VERDICT, REASON)]
        for name, is_text in (*columns, *((one.name, one.is_text) for one in self.asked)):
            found[name] = np.full(cases, "", dtype=object) if is_text else np.full(cases, math.nan)
        if self.question.choices:
            return Part(start, stop, found, self._by_word(found))
        alone = np.ones(cases, dtype=bool)
        if not self.not_held:
            alone[:] = ~self._together(found)
        by_case = int(alone.sum())
        for done, place in enumerate(np.flatnonzero(alone), cases - by_case + 1):
            self._by_itself(found, int(place))
            progress(done, cases)
        return Part(start, stop, found, by_case)

    # ---------------------------------------------------------------- one mission for the same words
    def _by_word(self, found: dict[str, Values]) -> int:
        """Check the cases of the same words as those of one mission; says how many were checked one by one."""
        places: dict[tuple[str, ...], list[int]] = {}
        for place, words in enumerate(zip(*(found[key].tolist() for key in self.question.choices), strict=True)):
            places.setdefault(words, []).append(place)
        by_case = 0
        for words, some in places.items():
            engine = self._with(words)
            if engine is None:
                for place in some:
                    self._by_itself(found, place)
                by_case += len(some)
                continue
            part = engine.part(0, len(some), {number.key: found[number.key][some] for number in self.numbers})
            by_case += part.by_case
            for name, of_some in part.values.items():
                found[name][some] = of_some
        return by_case

    def _with(self, words: tuple[str, ...]) -> "Engine | None":
        """The engine of the mission with these words; None if there is none, but may be with other numbers."""
        if words not in self.chosen:
            changes = [SetValue(*one) for one in zip(self.question.choices, words, strict=True)]
            try:
                mission = self.variation.read(changes)
            except MissionError:
                self.chosen[words] = None
            else:
                question = self.question._replace(changes=mission.changes, choices=())
                self.chosen[words] = Engine(question, mission)
        return self.chosen[words]

    # ---------------------------------------------------------------- together
    def _together(self, found: dict[str, Values]) -> NDArray[np.bool_]:
        """Check what arrays hold; says which cases that were."""
        held = np.ones(found["utilization"].size, dtype=bool)
        for number in self.numbers:
            held &= _within(number, found[number.key])
        some = np.flatnonzero(held)
        if not some.size:
            return held
        mission, geometries = self._arrays(found, some)
        held[some] &= is_image(mission, geometries, some.size)
        counts = np.zeros(held.size, dtype=int)
        T = np.broadcast_to(mission.collection.aperture_time, (some.size,))
        counts[some] = nodes_for(geometries, T, has_direct_path=mission.has_direct_path)
        for count in np.unique(counts[held]):
            same = np.flatnonzero(held & (counts == count))
            held[same] = self._of_same_nodes(found, same, int(count))
        return held

    def _arrays(self, found: Mapping[str, Values], some: NDArray[Any]) -> tuple[Mission, BistaticGeometry]:
        mission = self.mission
        for number in self.numbers:
            mission = varied(mission, number.key, found[number.key][some])
        return mission, mission.geometry

    def _of_same_nodes(self, found: dict[str, Values], some: NDArray[Any], nodes: int) -> NDArray[np.bool_]:
        mission, geometries = self._arrays(found, some)
        # A brief check finds no allowable of what is not declared; vibrations have rows of their own.
        shown = {id: what for id, what in self.subjects.items() if not self.is_brief or what.kind == "vibration"}
        with np.errstate(all="ignore"):
            checked = check_arrays(
                mission,
                some.size,
                self.question.today,
                nodes,
                geometries,
                shown,
                is_brief=self.is_brief,
            )
            rows = {row.subject.id: row for row in checked.rows}
            if self.question.row not in (None, *rows):
                return np.zeros(some.size, dtype=bool)
            verdict = _verdict(checked, self.question.row, breaking(self.question.target))
        sure = ~checked.is_left_out
        to = some[sure]
        geometry = (
            geometries.range_resolution(mission.radar.bandwidth, SPEED_OF_LIGHT),
            geometries.cross_range_resolution(mission.radar.wavelength, mission.collection.aperture_time),
            geometries.bistatic_angle,
            geometries.gradient_angle,
        )
        for column, number in zip(GEOMETRY, geometry, strict=True):
            found[column.name][to] = np.broadcast_to(number, some.shape)[sure]
        for name, of_verdict in verdict.items():
            found[name][to] = of_verdict[sure]
        for one in self.asked:
            if one.row in rows:
                found[one.name][to] = judged.field(rows[one.row], one.field)[sure]
            elif one.field == "status":
                of_nothing = self._status_of_nothing(one.row, mission, geometries, some.size)
                found[one.name][to] = np.broadcast_to(of_nothing, some.shape)[sure]
        return sure

    def _status_of_nothing(self, row_id: str, mission: Mission, geometries: BistaticGeometry, cases: int) -> Any:
        """Status of a row that is not declared in any case."""
        what = self.subjects.get(row_id)
        if what is None:
            return "not_declared"
        row = judged.with_required([Judged.of_none(what, cases)], mission, geometries, cases)[-1]
        return judged.statuses(judged.waived(row, mission, self.question.today).status)

    # ---------------------------------------------------------------- one by one
    def _by_itself(self, found: dict[str, Values], place: int) -> None:
        """Check one case as `check` does."""
        try:
            words = [SetValue(key, found[key][place]) for key in self.question.choices]
            case = self.variation.at({one: float(found[one.key][place]) for one in self.numbers}, words)
        except MissionError as error:
            fault = error.faults[0]
            found["status"][place], found["reason"][place] = "error", f"{fault.key}: {fault.problem}"
            return
        checked = check_mission(case, self.question.today, is_bare=True)
        geometry = checked.geometry
        numbers_found = (
            checked.resolution.range,
            checked.resolution.cross_range,
            geometry.bistatic_angle,
            geometry.gradient_angle,
        )
        for column, number in zip(GEOMETRY, numbers_found, strict=True):
            found[column.name][place] = number
        stands = standing(checked, self.question.row, breaking(self.question.target))
        found["status"][place] = stands.status
        found["binding_requirement"][place] = stands.requirement or ""
        if stands.row is not None:
            found["worst_row"][place] = stands.row
            found["utilization"][place] = math.nan if stands.utilization is None else stands.utilization
        rows = {row.id: row for row in checked.rows}
        for one in self.asked:
            row = rows.get(one.row)
            value = "not_declared" if one.field == "status" else None
            if row is not None:
                value = getattr(row, one.field)
            found[one.name][place] = math.nan if value is None else value


def _verdict(checked: judged.Checked, row_id: str | None, breaks: Container[str]) -> dict[str, Any]:
    """Status, worst row, utilization and requirement of each case; as `standing`."""
    names = list(STATUS)
    judged = np.array([STATUS[name].is_judged and name != "waived" for name in names])
    does_break = np.array([name in breaks for name in names])
    rows = [one for one in checked.rows if row_id in (None, one.subject.id)]
    codes = np.array([one.status for one in rows])
    if row_id is None:
        gates = np.array([STATUS[name].gates for name in names])
        status = np.minimum(np.where(gates[codes], codes, RANK["pass"]).min(axis=0), checked.floor)
    else:
        status = codes[0]
    may_decide = np.array([[not one.never_fails or "warn" in breaks] for one in rows])
    decides = may_decide & judged[codes] & (does_break[codes] | ~does_break[status])
    has_number = np.array([~np.isnan(one.utilization) for one in rows])
    decides &= has_number | (codes != RANK["not_evaluated"])
    use = np.array([np.nan_to_num(one.utilization, nan=-1.0, posinf=math.inf) for one in rows])
    use = np.where(decides, use, -2.0)
    highest = use.max(axis=0)
    worst = (use >= highest - ALIKE * np.abs(highest)).argmax(axis=0)
    has_one = decides.any(axis=0)
    ids = np.array([row.subject.id for row in rows], dtype=object)
    metrics = np.array([row.metric for row in rows], dtype=object)
    binding = np.take_along_axis(np.array([row.binding for row in rows]), worst[None], axis=0)[0]
    requirement = np.where(binding >= 0, np.array(REQUIREMENTS, dtype=object)[binding], metrics[worst])
    utilization = np.take_along_axis(np.array([row.utilization for row in rows]), worst[None], axis=0)[0]
    unmet = np.full(status.shape, "", dtype=object)  # where no row decides, the requirement that breaks
    if row_id is None:
        for one in reversed(checked.requirements):
            unmet = np.where((one.status == status) & does_break[status], one.key, unmet)
    return {
        "status": statuses(status),
        "worst_row": np.where(has_one, ids[worst], ""),
        "utilization": np.where(has_one, utilization, math.nan),
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


def _said(fault: Fault) -> str:
    """What is wrong, and what would not be."""
    return fault_words(fault.problem, "", fault.accepted, "" if "Read with" in fault.hint else fault.hint)
