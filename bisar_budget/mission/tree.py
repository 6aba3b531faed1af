"""A YAML file as a plain tree with file positions, before its keys and values are interpreted.

The tree is built from the events of the YAML parser, so that its depth is limited before any recursion. Every scalar
is kept as written in the file, because YAML 1.1 would read `9.6e9` as text, `on` as true and `010` as eight.
"""

import re
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import yaml
from yaml import AliasEvent, MappingEndEvent, ScalarEvent

from bisar_budget.faults import (
    Fault,
    KeyPath,
    MissionError,
    ParserEvent,
    Problem,
    SetValue,
    file_fault,
    printable,
    shown,
    upwards,
)
from bisar_budget.mission.readers import INVALID, MISSING
from bisar_budget.units import UNCERTAINTY_MARKS, unit_behind

MAX_BYTES = 1 << 20  # of a file; a mission file has a few kilobytes
MAX_NESTING_LEVEL = 20  # containers inside each other; the schema needs 9
TOO_DEEP = f"is nested more than {MAX_NESTING_LEVEL} deep"
MAX_FILE_VALUE_COUNT = 100_000  # of a file; the longest lists that the schema accepts have a third of it
MAX_FAULT_COUNT = 200  # of a file; nobody mends more at once, and each fault costs a line of every report

_PARSER = yaml.CSafeLoader if yaml.__with_libyaml__ else yaml.SafeLoader
_NUMERAL = re.compile(r"[+-]?\.?\d", re.ASCII)  # begins a number
Content = Any
"""Content of a file: texts, lists, mappings, numbers of a sweep, `INVALID`. The readers of `readers` test it."""
NULLS = ("", "~", "null", "Null", "NULL")


def _decoded(data: bytes | str, file: str, file_kind: str) -> str:
    """Decode the content of a file as UTF-8; raises `MissionError` if it is too large or not UTF-8."""
    if len(data) > MAX_BYTES:
        raise MissionError(file, (file_fault(f"is larger than {MAX_BYTES // 1024} KiB, so no {file_kind} file"),))
    if isinstance(data, str):
        return data
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        fault = Fault(
            line=line, column=None, key="", problem="is not UTF-8 text", given=f"byte {data[error.start]:#x}"
        )
        raise MissionError(file, (fault,)) from None


class UnusableError(Exception):
    """The file is not worth reading beyond this point; the fault is in the tree."""


class Tree:
    """Content of the file: nested dict, list and str, with the parser's event of every key and value.

    Attributes
    ----------
    file_kind : str
        "mission" or "part", for messages about the file as a whole.
    root : dict
        The content. An unreadable value is reported and replaced by `INVALID`.
    keys, values : dict of KeyPath to event
        The parser's events for keys and for values, by path. An event has the start and end positions in the file.
    faults : list of Fault
        Faults in the order in which they were found.
    changes : dict of KeyPath to SetValue
        The options that put values into the tree, each under the highest path that it changed. A sweep puts floats
        into the tree.
    """

    def __init__(self, file_kind: str = "mission") -> None:
        self.file_kind = file_kind
        self.root: Content = INVALID
        self.keys: dict[KeyPath, ParserEvent] = {}
        self.values: dict[KeyPath, ParserEvent] = {}
        self.faults: list[Fault] = []
        self.changes: dict[KeyPath, SetValue] = {}

    def copied(self) -> "Tree":
        """Copy of the tree; changes to the copy do not affect this tree."""
        tree = Tree(self.file_kind)
        tree.root, tree.faults = _copied(self.root), list(self.faults)
        tree.keys, tree.values, tree.changes = dict(self.keys), dict(self.values), dict(self.changes)
        return tree

    def fault(self, mark: ParserEvent, path: KeyPath, problem: str, **details: str) -> None:
        """Record a fault at the position `mark` in the file; if it is None, the fault is at the start of the file.

        If an option set the value at `path`, the fault names the option and has no line. `details` are further fields
        of the fault. Raises `UnusableError` as soon as the file has `MAX_FAULT_COUNT` faults.
        """
        change = self._change_at(path)
        if change is not None:
            details["option"] = change.option
            if problem == MISSING and change.text in NULLS:
                problem = "must not be taken out: it is required"
            self.faults.append(Fault(line=None, column=None, key=_dotted(path), problem=problem, **details))
        else:
            line, column = (mark.line + 1, mark.column + 1) if mark else (1, 1)
            self.faults.append(Fault(line=line, column=column, key=_dotted(path), problem=problem, **details))
        if len(self.faults) >= MAX_FAULT_COUNT:
            self.faults.append(file_fault(f"has {MAX_FAULT_COUNT} faults or more; what follows them was not read"))
            raise UnusableError

    def _change_at(self, path: KeyPath) -> SetValue | None:
        """Option that set the value at `path`, or a section or list that contains it; None if no option did."""
        return next(filter(None, map(self.changes.get, upwards(path))), None)

    def in_order(self) -> tuple[Fault, ...]:
        """All distinct faults, sorted by their position in the file."""
        return tuple(sorted(dict.fromkeys(self.faults), key=lambda fault: (fault.line or 0, fault.column or 0)))

    def report(self, path: KeyPath, problem: Problem) -> None:
        """Record a problem, which a reader has found, as a fault of the file.

        The fault is at the value or key at `path`; if the file has neither, it is at the nearest key above.
        """
        path = (*path, *problem.at)
        value: Content = self.root
        for name in path:
            try:
                value = value[name]
            except (KeyError, IndexError, TypeError):
                value = None
                break
        is_key = value is None or problem.is_of_key
        above = (self.keys.get(key_path) or self.values.get(key_path) for key_path in upwards(path[:-1]))
        event = (self.keys if is_key else self.values).get(path) or next(filter(None, above), None)
        mark = None if event is None else event.start_mark
        given = shown(value) if isinstance(value, str) and not is_key and not problem.names_value else ""
        self.fault(mark, path, problem.problem, given=given, accepted=problem.accepted, hint=problem.hint)

    def document(self, text: str, path: KeyPath, accepted: str) -> Content:
        """Read a single YAML document into the tree at `path`, and return its value; `INVALID` if the text is empty.

        Raises `UnusableError` if there is a second document, and `yaml.YAMLError` if the text is not YAML. `accepted`
        describes the accepted content; it is part of the error message about a second document.
        """
        next_event: Callable[[], ParserEvent] = _PARSER(text).get_event
        while type(event := next_event()) is not yaml.DocumentStartEvent:
            if type(event) is yaml.StreamEndEvent:
                return INVALID
        value = self.node(next_event, next_event(), path)
        while type(event := next_event()) is not yaml.StreamEndEvent:
            if type(event) is yaml.DocumentStartEvent:
                self.fault(event.start_mark, path, "has a second YAML document", accepted=f"accepted: {accepted}")
                raise UnusableError
        return value

    def node(self, next_event: Callable[[], ParserEvent], event: ParserEvent, path: KeyPath) -> Content:
        """Read the value that begins with the parser's event `event`, and all values inside it; return the content.

        The depth of the recursion is bounded by `MAX_NESTING_LEVEL`.
        """
        self.values[path] = event
        if len(self.values) > MAX_FILE_VALUE_COUNT:
            self.faults.append(
                file_fault(f"has more than {MAX_FILE_VALUE_COUNT} values, so no {self.file_kind} file")
            )
            raise UnusableError
        mark = event.start_mark
        kind = type(event)
        if kind is ScalarEvent:
            value: object = event.value
            if not event.style and value in NULLS:  # plain: "" from libyaml, None from pure Python
                hint = "Give it one" + ("" if self._change_at(path) else ", or remove the key")
                self.fault(mark, path, "has no value", hint=hint)
                value = INVALID
        elif kind is AliasEvent:
            self.fault(mark, path, "is an alias (*)", accepted="write the value out")
            return INVALID
        elif len(path) >= MAX_NESTING_LEVEL:
            self.fault(mark, (), TOO_DEEP)
            raise UnusableError
        elif kind is yaml.MappingStartEvent:
            value = self._mapping(next_event, path, is_flow=bool(event.flow_style))
        else:
            value = []
            items: list[ParserEvent] = []
            while type(item := next_event()) is not yaml.SequenceEndEvent:
                items.append(item)
                value.append(self.node(next_event, item, (*path, len(value))))
            if event.flow_style:
                self._decimal_commas(items, path)
        if event.tag is not None and event.tag != "!":
            self.fault(mark, path, "carries a YAML tag", given=shown(event.tag), accepted="accepted: plain values")
            return INVALID
        return value

    def _decimal_commas(self, items: list[ParserEvent], path: KeyPath) -> None:
        """Record a fault for a list with decimal commas, such as `[0,5 m, 1 m, 2 m]` or `[0,5 m, 1 m]`.

        YAML reads these two lists as four and as three values. A comma counts as a decimal comma if it is not
        followed by a blank although other commas in the list are.
        """
        commas = []
        for index, (before, item) in enumerate(pairwise(items), start=1):
            if all(type(scalar) is ScalarEvent for scalar in (before, item)):
                is_tight = item.start_mark.column - before.end_mark.column == 1
                commas.append((index, is_tight, before, item))
        if all(is_tight for _, is_tight, _, _ in commas):
            return
        for index, is_tight, before, item in commas:
            has_unit = any(char.isalpha() and char not in "eE" for char in item.value)
            if is_tight and has_unit and before.value.lstrip("+-").isdigit() and item.value[:1].isdigit():
                given = shown(f"{before.value},{item.value}")
                problem, accepted = (
                    "may be half of a number with a decimal comma",
                    "accepted: a point, or a blank behind commas",
                )
                self.fault(item.start_mark, (*path, index), problem, given=given, accepted=accepted)

    def _mapping(self, next_event: Callable[[], ParserEvent], path: KeyPath, *, is_flow: bool) -> dict[str, Content]:
        """Read the keys and values of a mapping whose start event has already been read.

        `is_flow` is true if the mapping is written in braces.
        """
        mapping: dict[str, Content] = {}
        split: dict[str, list[str]] = {}  # by key: parts of its value, split at the commas of a flow mapping
        name = ""
        while type(event := next_event()) is not MappingEndEvent:
            mark = event.start_mark
            if type(event) is not ScalarEvent:
                self.fault(mark, path, "has a key that is not plain text")
                raise UnusableError
            key = event.value
            here = (*path, key)
            item = next_event()
            if is_flow and _is_bare(event, item) and isinstance(mapping.get(name), str):
                split.setdefault(name, [mapping[name]]).append(key)
                continue
            if key in mapping:
                first = self.keys[here].start_mark.line + 1
                problem = f"is a duplicate key; the first is in line {first}"
                self.fault(mark, here, problem, accepted="accepted: each key once")
                self.node(next_event, item, (*path, f"{key} (again)"))
                continue
            self.keys[here] = event
            name = "" if _NUMERAL.match(key) else key
            if type(item) is ScalarEvent and item.tag is None and item.value not in NULLS:
                self.values[here] = item  # the same as in `node`; a faster path for most values
                mapping[key] = item.value
            else:
                mapping[key] = self.node(next_event, item, here)
        for key, texts in split.items():
            self._without_brackets((*path, key), texts)
            mapping[key] = INVALID
        return mapping

    def _without_brackets(self, path: KeyPath, texts: list[str]) -> None:
        """Record a fault for a value without brackets, as in `{position: 1 m, 2 m, 3 m}`.

        YAML reads this as three keys. `texts` are the parts of the value between the commas.
        """
        is_sure = len(texts) == 3 and all(unit_behind(text) or text == "0" for text in texts)
        hint = f"Did you mean [{', '.join(texts)}]?" if is_sure else "A decimal is written with a point"
        accepted = "accepted: one value, or [a, b, c]"
        given = shown(", ".join(texts))
        self.fault(self.values[path].start_mark, path, "has commas", given=given, accepted=accepted, hint=hint)


def _is_bare(key: ParserEvent, item: ParserEvent) -> bool:
    """Whether a key of a mapping has no value and looks like a number, with or without a unit."""
    is_empty = type(item) is ScalarEvent and not item.style and not item.value
    return is_empty and not key.style and bool(_NUMERAL.match(key.value))


_STARTS = {
    "mission": "`bisar-budget init` writes a mission file to start from",
    "part": "A part begins with kind: imu, kind: gnss or kind: oscillator",
}


def read_tree(data: bytes | str, file: str, file_kind: str = "mission") -> Tree:
    """Read a file that contains a single YAML document into a tree; `file_kind` is "mission" or "part".

    If `data` are bytes, they must be UTF-8.

    Raises
    ------
    MissionError
        The file is not a mapping in YAML, or is too large. The error contains every fault.
    """
    text = _decoded(data, file, file_kind)
    tree = Tree(file_kind)
    try:
        tree.root = tree.document(text, (), f"one {file_kind} in a file")
        if not isinstance(tree.root, dict) and not tree.faults:
            problem = "is empty" if tree.root is INVALID else "is not a mapping of keys to values"
            tree.faults.append(file_fault(problem, _STARTS[file_kind]))
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        problem = f"is not valid YAML: {', '.join(filter(None, (error.context, error.problem)))}"
        if "maximum nesting depth" in (
            error.problem or ""
        ):  # libyaml scans ahead, and reports this before `node` does
            problem = TOO_DEEP
        tree.fault(mark, (), problem)
        raise MissionError(file, tuple(tree.faults)) from None
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, max(0, error.position)) + 1
        fault = Fault(line=line, column=None, key="", problem=f"is not a text file: {error.reason}")
        raise MissionError(file, (fault,)) from None
    except UnusableError:
        raise MissionError(file, tuple(tree.faults)) from None
    if not isinstance(tree.root, dict):
        raise MissionError(file, tuple(tree.faults))
    return tree


def has_uncertainty(value: Content) -> bool:
    """Whether a text, or a text inside a section or list, contains the sign of an uncertainty, `±` or `+/-`."""
    if isinstance(value, str):
        return any(mark in value for mark in UNCERTAINTY_MARKS)
    if isinstance(value, dict):
        return any(map(has_uncertainty, value.values()))
    return isinstance(value, list) and any(map(has_uncertainty, value))


def _copied(value: Content) -> Content:
    """Deep copy of nested mappings and lists."""
    if isinstance(value, dict):
        return {key: _copied(item) for key, item in value.items()}
    return [_copied(item) for item in value] if isinstance(value, list) else value


def _dotted(path: KeyPath) -> str:
    """Format a key path as text, such as `other_errors[0].name`; text of more than 200 characters is shortened."""
    text = ""
    for name in path:
        text += f"[{name}]" if isinstance(name, int) else f".{name}" if text else str(name)
    return printable(text) if len(text) <= 200 else shown(text)
