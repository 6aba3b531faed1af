"""Reader of the requirements file of a mission: a CSV file with the columns id, text, key, limit and confidence.

The values are put into the tree of the mission file. The mission is then the same as if the mission file stated them
under the keys `requirements`, `requirement_ids` and `requirement_texts`.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from typing import NamedTuple

from yaml import ScalarEvent

from bisar_budget.faults import (
    Changed,
    Fault,
    KeyPath,
    MissionError,
    ParserEvent,
    Problem,
    SetValue,
    file_fault,
    printable,
    shown,
)
from bisar_budget.mission.changes import parts_of
from bisar_budget.mission.model import Requirements, id_of_requirement
from bisar_budget.mission.readers import (
    CONFIDENCE_FIELD,
    INVALID,
    LIMIT_FIELD,
    Level,
    Reader,
    Section,
    Statement,
    Text,
    WithConfidence,
    did_you_mean,
)
from bisar_budget.mission.tree import MAX_BYTES, Tree
from bisar_budget.paths.flight import PathFileError

COLUMNS = ("id", "text", "key", "limit")
FILE_KEY: KeyPath = ("requirements", "file")
_LIMITS: dict[str, Reader[object]] = {
    key: entry.reader for key, entry in Section(Requirements).keys.items() if key != FILE_KEY[-1]
}
_HAS_DEFAULT = ("quadratic_phase_error",)
_MAX_LINE_COUNT = 4000
_ACCEPTED_ENTRY_KEYS = f"accepted: {', '.join(_LIMITS)}, or the id of a row, such as receiver.velocity.x"
_ACCEPTED_HEADER = f"accepted: a first line with the columns {', '.join(COLUMNS)}, separated by commas or semicolons"


class Cell(NamedTuple):
    """A cell of a CSV file without surrounding blanks, and its line and column, counted from 1 in characters.

    `is_open` is true if the cell begins with a quotation mark that is not closed at the end of the cell.
    """

    text: str
    line: int
    column: int
    is_open: bool = False


class RequirementEntry(NamedTuple):
    """A line of a requirements file; `key` is a key of `requirements` or the id of a row. Cells may be empty."""

    id: Cell
    text: Cell
    key: Cell
    limit: Cell
    confidence: Cell


# ---------------------------------------------------------------------- CSV
def _lines_of(text: str, delimiter: str) -> Iterator[list[Cell]]:
    """Yield the cells of each line of a CSV file; lines in which all cells are blank are left out.

    A cell in quotation marks may contain delimiters, doubled quotation marks, and line breaks, which become blanks.
    """
    blank, end = r"[^\S\r\n]*" if delimiter != "\t" else " *", rf"(?={delimiter}|[\r\n]|\Z)"
    cell_pattern = re.compile(rf'{blank}(?:"((?:[^"]|"")*)"{blank}{end}|([^{delimiter}\r\n]*))')
    position, line, line_start = 0, 1, 0
    cells: list[Cell] = []
    while True:
        match = cell_pattern.match(text, position)
        if match is None:  # the pattern accepts any text
            return
        quoted, plain = match.groups()
        content = " ".join((plain if quoted is None else quoted.replace('""', '"')).split())
        start = match.start(2) if quoted is None else match.start(1)
        is_open = quoted is None and content.startswith('"')
        cells.append(Cell(content, line, start - line_start + 1, is_open))
        if quoted is not None and (breaks := list(re.finditer("\r\n|\r|\n", quoted))):
            line, line_start = line + len(breaks), match.start(1) + breaks[-1].end()
        position = match.end()
        if text[position : position + 1] == delimiter:
            position += 1
            continue
        if any(cell.text for cell in cells):
            yield cells
        if position >= len(text):
            return
        position += 2 if text.startswith("\r\n", position) else 1
        line, line_start, cells = line + 1, position, []


class _Faults:
    """Collector of the faults of a requirements file."""

    def __init__(self) -> None:
        self.faults: list[Fault] = []

    def at(self, cell: Cell, column: str, problem: str, accepted: str = "", hint: str = "", value: str = "") -> None:
        """Record a fault in a cell; `value` is the faulty text, by default the whole text of the cell."""
        value = value or shown(cell.text)
        self.faults.append(Fault(cell.line, cell.column, column, problem, value, accepted, hint))

    def of(self, cell: Cell, column: str) -> Callable[[KeyPath, Problem], None]:
        """Return a function that records each problem that a reader reports for a cell as a fault of that cell."""
        return lambda _, problem: self.at(cell, column, problem.problem, problem.accepted, problem.hint)


@lru_cache(maxsize=16)  # the cases of a sweep read the same file
def read_requirement_lines(data: bytes, file: str) -> tuple[RequirementEntry, ...]:
    """Read the lines of a requirements file, and check them.

    Raises
    ------
    MissionError
        The content is not a valid requirements file. The error contains every fault with its line and column.
    """
    if len(data) > MAX_BYTES:
        raise MissionError(file, (file_fault(f"is larger than {MAX_BYTES // 1024} KiB, so no requirements file"),))
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        fault = Fault(line, None, "", "is not UTF-8 text", f"byte {data[error.start]:#x}")
        raise MissionError(file, (fault,)) from None
    first_line = next((line for line in text.splitlines() if line.strip(" \t,;")), "")
    table = list(_lines_of(text, ";" if first_line.count(";") > first_line.count(",") else ","))
    if not table:
        raise MissionError(file, (file_fault("is empty", f"A{_ACCEPTED_HEADER.removeprefix('accepted: a')}"),))
    faults = _Faults()
    columns = _columns_of(table[0], faults)
    if len(table) > _MAX_LINE_COUNT:
        faults.faults.append(file_fault(f"has more than {_MAX_LINE_COUNT} lines"))
    if faults.faults:
        raise MissionError(file, tuple(faults.faults))
    lines = [_line_of(cells, columns, len(table[0]), faults) for cells in table[1:]]
    _hold_together([line for line in lines if line is not None], faults)
    if faults.faults:
        raise MissionError(file, tuple(sorted(faults.faults, key=lambda fault: (fault.line or 0, fault.column or 0))))
    return tuple(line for line in lines if line is not None)


def _columns_of(header: Sequence[Cell], faults: _Faults) -> dict[str, int]:
    """Indices of the known columns and of a column `confidence`, by name; all other columns are ignored."""
    names = [cell.text.lower() for cell in header]
    for name in (*COLUMNS, CONFIDENCE_FIELD):
        if names.count(name) > 1:
            second = header[names.index(name, names.index(name) + 1)]
            faults.at(second, "", f"the column {name} is there twice")
    missing = [name for name in COLUMNS if name not in names]
    if missing:
        near = did_you_mean(missing[0], tuple(name for name in names if name not in COLUMNS))
        names_words = shown(", ".join(cell.text for cell in header))
        faults.at(header[0], "", f"lacks the column {', '.join(missing)}", _ACCEPTED_HEADER, near, names_words)
    return {name: names.index(name) for name in (*COLUMNS, CONFIDENCE_FIELD) if name in names}


def _line_of(cells: Sequence[Cell], columns: dict[str, int], width: int, faults: _Faults) -> RequirementEntry | None:
    """Check a line of the file on its own, and return its entry; None if the line has a fault.

    A line without text in the known columns is ignored; the result is then also None.
    """
    count = len(faults.faults)
    last = cells[-1]
    behind = Cell("", last.line, last.column + len(last.text))  # stands for cells that the line lacks
    if extra := [cell for cell in cells[width:] if cell.text]:
        accepted = "accepted: quotation marks around a text with commas or semicolons"
        faults.at(extra[0], "", f"is a cell beyond the {width} columns of the first line", accepted)
    if unclosed := [cell for cell in cells if cell.is_open]:
        accepted = "accepted: a cell that begins and ends with one, with doubled marks inside"
        faults.at(unclosed[0], "", "begins with a quotation mark that the cell does not close", accepted)
    by_name = {name: cells[index] if index < len(cells) else behind for name, index in columns.items()}
    line = RequirementEntry(
        *(_without_apostrophe(by_name.get(name, behind)) for name in (*COLUMNS, CONFIDENCE_FIELD))
    )
    if not any(cell.text for cell in line):
        return None  # only columns that are not used have text
    key = line.key.text.removeprefix("requirements.").removeprefix("requirement.")
    key = key if key in _LIMITS else line.key.text
    line = line._replace(key=line.key._replace(text=key))
    for cell, name, reader in ((line.id, "id", Text()), (line.text, "text", Statement())):
        if cell.text:
            reader.read(cell.text, (), faults.of(cell, name))
    if not key:
        faults.at(line.key, "key", "is missing", _ACCEPTED_ENTRY_KEYS)
    elif key not in _LIMITS and "." not in key:
        near = did_you_mean(key, tuple(_LIMITS))
        faults.at(line.key, "key", "is no key of requirements, and no id of a row", _ACCEPTED_ENTRY_KEYS, near)
    elif key not in _LIMITS and line.limit.text:
        faults.at(
            line.limit,
            "limit",
            f"{printable(key)} is the id of a row, which has no limit of its own",
            "accepted: an empty cell",
        )
    elif line.limit.text or line.confidence.text:
        _report_limit(line, faults)
    if not line.id.text and (key not in _LIMITS or line.text.text or not line.limit.text):
        faults.at(line.id, "id", "is missing", "accepted: the id of a requirement of the project")
    return line if len(faults.faults) == count else None


def _report_limit(line: RequirementEntry, faults: _Faults) -> None:
    """Record the faults of the limit and the confidence of a line, each at its cell."""
    key = line.key.text
    if not line.confidence.text:
        _LIMITS[key].read(_written(line), (), faults.of(line.limit, "limit"))
    elif not isinstance(_LIMITS.get(key), WithConfidence):
        level = "is an expectation over all errors, and " if isinstance(_LIMITS.get(key), Level) else ""
        problem = f"{printable(key)} {level}has no confidence"
        faults.at(line.confidence, CONFIDENCE_FIELD, problem, "accepted: an empty cell")
    else:

        def report(path: KeyPath, problem: Problem) -> None:
            is_confidence = path[-1:] == (CONFIDENCE_FIELD,)
            cell, column = (line.confidence, CONFIDENCE_FIELD) if is_confidence else (line.limit, "limit")
            faults.of(cell, column)(path, problem)

        _LIMITS[key].read(_written(line), (), report)


def _without_apostrophe(cell: Cell) -> Cell:
    """Remove a leading apostrophe that keeps spreadsheets from reading a cell as a formula, as in `'-30 dB`."""
    return cell._replace(text=cell.text[1:]) if re.match("'[-+=@]", cell.text) else cell


def _written(line: RequirementEntry) -> str | list[str] | dict[str, str]:
    """Limit of a line as a mission file would state it.

    It is a string, a list of strings for the key `declare`, or a section if the line has a confidence.
    """
    if line.confidence.text:
        limit = {LIMIT_FIELD: line.limit.text} if line.limit.text else {}
        return {**limit, CONFIDENCE_FIELD: line.confidence.text}
    if line.key.text == "declare":
        return [word for word in re.split(r"[\s,;]+", line.limit.text.strip("[] ")) if word]
    return line.limit.text


def _limit(key: str, written: object) -> object:
    """Limit in SI units, as converted by the reader of the key."""
    return _LIMITS[key].read(written, (), lambda path, problem: None)


def _hold_together(lines: Sequence[RequirementEntry], faults: _Faults) -> None:
    """Record a fault for each line that contradicts an earlier line."""
    limits: dict[str, RequirementEntry] = {}
    texts: dict[str, RequirementEntry] = {}
    for line in lines:
        if line.limit.text or line.confidence.text:
            first = limits.setdefault(line.key.text, line)
            if _limit(line.key.text, _written(first)) != _limit(line.key.text, _written(line)):
                problem = f"{line.key.text} has another limit in line {first.limit.line}, {shown(first.limit.text)}"
                faults.at(line.limit, "limit", problem, "accepted: one limit for each key")
        if line.text.text and texts.setdefault(line.id.text, line).text.text != line.text.text:
            problem = f"{printable(line.id.text)} has another text in line {texts[line.id.text].text.line}"
            faults.at(line.text, "text", problem, "accepted: one text for each id")


# ---------------------------------------------------------------------- into the tree of a mission
def add_requirements(tree: Tree, read: Callable[[str], bytes], changes: Sequence[SetValue]) -> None:
    """Put the values of the requirements file that a mission names into the tree of the mission file.

    Values set by options take precedence over values of the requirements file. Faults are recorded in the tree, at
    the key that names the requirements file. `read` takes the name of the file and returns its content, or raises
    `PathFileError`.
    """
    requirements = tree.root.get("requirements")
    name = requirements.get("file") if isinstance(requirements, dict) else None
    if not isinstance(name, str) or Section(Requirements).each({"file": name})["file"] is INVALID:
        return
    try:
        lines = read_requirement_lines(read(name), name)
    except PathFileError as error:
        tree.report(FILE_KEY, Problem(str(error), names_value=True))
        return
    except MissionError as error:
        for fault in error.lines():
            tree.report(FILE_KEY, Problem(fault, names_value=True))
        return
    changed = {".".join(parts_of(change.key)) for change in changes}
    into = _Into(tree, name, changed)
    for line in lines:
        into.add(line)
    for line in lines:
        into.hold_to_limit(line)


class _Into:
    """Puts lines of the requirements file `name` into a tree; options have changed the keys in `changed`."""

    def __init__(self, tree: Tree, name: str, changed: set[str]) -> None:
        self.tree, self.name, self.changed = tree, printable(name), changed
        self.event: ParserEvent = tree.values[FILE_KEY]
        self.added: set[KeyPath] = set()

    def add(self, line: RequirementEntry) -> None:
        """Put the limit, id and text of a line into the tree; it is a fault if the mission file has another value."""
        key, is_limited = line.key.text, line.key.text in _LIMITS
        if is_limited and (line.limit.text or line.confidence.text):
            self._limit(key, line)
        row_id = id_of_requirement(key) if is_limited else key
        if line.id.text:
            self._id(row_id, line.id.text)
        if line.text.text:
            self._text(line)

    def _section(self, name: str) -> dict[str, object] | None:
        """Section of the tree, which is added if it is missing; None if it is not a mapping.

        The reader of the section reports a value that is not a mapping.
        """
        section = self.tree.root.setdefault(name, {})
        self.tree.values.setdefault((name,), self.event)
        return section if isinstance(section, dict) else None

    def _limit(self, key: str, line: RequirementEntry) -> None:
        path = ("requirements", key)
        if "requirements." + key in self.changed or path in self.added:
            return
        section = self.tree.root["requirements"]
        written, of_options = self._beside_options(key, line, section.get(key))
        if key in section and section[key] != of_options:
            stated = section[key]
            value = INVALID if stated is INVALID else _limit(key, stated)
            if value is not INVALID and value != _limit(key, written):
                problem = f"is {shown(line.limit.text)} in {self.name}:{line.limit.line}"
                self.tree.report(path, Problem(problem, "accepted: one of the two, or the same limit"))
            return
        section[key] = written
        self.added.add(path)
        if not of_options:
            self._put(path, line.limit.text)
        if isinstance(written, dict):
            cells = {LIMIT_FIELD: line.limit, CONFIDENCE_FIELD: line.confidence}
            for field in written.keys() - of_options.keys():
                self._put((*path, field), cells[field].text)

    def _beside_options(self, key: str, line: RequirementEntry, stated: object) -> tuple[object, dict[str, object]]:
        """Limit of a line as a mission file would state it, with what options put beside it.

        An option may set the limit or the confidence alone, and the line then still states the other one. `stated` is
        the value in the tree. The second result has the values of options by `limit` and `confidence`.
        """
        written: object = _written(line)
        changed = [
            field for field in (LIMIT_FIELD, CONFIDENCE_FIELD) if f"requirements.{key}.{field}" in self.changed
        ]
        reader, values = _LIMITS[key], stated if isinstance(stated, dict) else {}
        if not isinstance(reader, WithConfidence):
            return written, {}
        if CONFIDENCE_FIELD in values and LIMIT_FIELD not in values and CONFIDENCE_FIELD not in changed:
            # The mission file states only the confidence, as an option may.
            self._compare_confidence(key, line, values[CONFIDENCE_FIELD])
            changed.append(CONFIDENCE_FIELD)
        if not changed:
            return written, {}
        of_options = {field: values[field] for field in changed if field in values}
        pair = written if isinstance(written, dict) else reader.as_section(written)
        # A field that an option takes out is not put back.
        return {field: text for field, text in pair.items() if field not in changed} | of_options, of_options

    def _compare_confidence(self, key: str, line: RequirementEntry, stated: object) -> None:
        """Report a confidence of the mission file, without a limit, that differs from the confidence of a line."""
        of_line, of_file = (
            _limit(key, {LIMIT_FIELD: line.limit.text, CONFIDENCE_FIELD: confidence})
            for confidence in (line.confidence.text, stated)
        )
        if line.confidence.text and of_file is not INVALID and of_line != of_file:
            problem = f"is {shown(line.confidence.text)} in {self.name}:{line.confidence.line}"
            path = ("requirements", key, CONFIDENCE_FIELD)
            self.tree.report(path, Problem(problem, "accepted: one of the two, or the same confidence"))

    def _id(self, row_id: str, own_id: str) -> None:
        section, path = self._section("requirement_ids"), ("requirement_ids", row_id)
        if section is None or ".".join(path) in self.changed:
            return
        stated = section.get(row_id, [])
        ids = [stated] if isinstance(stated, str) else stated
        if not isinstance(ids, list) or own_id in ids:
            return
        if row_id not in section:
            section[row_id] = own_id
            self._put(path, own_id)
            return
        if isinstance(stated, str):
            self.tree.values[*path, 0] = self.tree.values.pop(path)
            self.tree.values[path] = self.event
        section[row_id] = [*ids, own_id]
        self._put((*path, len(ids)), own_id)

    def _text(self, line: RequirementEntry) -> None:
        section, path = self._section("requirement_texts"), ("requirement_texts", line.id.text)
        if section is None or ".".join(path) in self.changed:
            return
        stated = section.setdefault(line.id.text, line.text.text)
        if stated != line.text.text and isinstance(stated, str):
            problem = f"is another text in {self.name}:{line.text.line}"
            self.tree.report(path, Problem(problem, "accepted: one of the two, or the same text"))
        elif path not in self.tree.values:
            self._put(path, line.text.text)

    def _put(self, path: KeyPath, text: str) -> None:
        """Record the text of an added value, at the position of the key that names the requirements file."""
        event = self.event
        if not isinstance(event, Changed):
            event = ScalarEvent(None, None, (True, False), text, event.start_mark, event.end_mark)
        self.tree.values[path] = event

    def hold_to_limit(self, line: RequirementEntry) -> None:
        """Report a requirement that has a line in the requirements file, but no limit there or in the mission."""
        key = line.key.text
        is_stated = key in self.tree.root["requirements"] or "requirements." + key in self.changed
        if key in _LIMITS and key not in _HAS_DEFAULT and not is_stated:
            example = (
                "such as position, velocity"
                if key == "declare"
                else "such as -30 dB"
                if key in ("pslr", "islr")
                else "a limit with its unit"
            )
            position = f"{self.name}:{line.limit.line}:{line.limit.column}"
            self.tree.report(
                FILE_KEY, Problem(f"{position}: limit: {key} has no limit", f"accepted: {example}", names_value=True)
            )
