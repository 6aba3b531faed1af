"""Read a mission file: YAML events to a plain tree with positions, the tree to a `Mission`, faults to their lines.

The tree is built from the parser's events with an explicit stack, so depth is bounded before anything
recurses, and every scalar stays the text that stands in the file: YAML 1.1 would read `9.6e9` as text,
`on` as true and `010` as eight. A text gives a `Mission` or a `MissionError`, nothing else.
"""

import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, get_args

import yaml
from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from bisar_budget.errors import Fault, InvalidValueError, KeyPath, MissionError, Problem
from bisar_budget.mission.model import Mission

MAX_BYTES = 1 << 20  # a mission file has a few kilobytes
MAX_DEPTH = 20  # containers inside each other; the schema needs 9

_PARSER = yaml.CSafeLoader if yaml.__with_libyaml__ else yaml.SafeLoader
_NULLS = ("", "~", "null", "Null", "NULL")


def load_mission(path: str) -> Mission:
    """Read the mission file at `path`; `-` is standard input.

    Raises
    ------
    MissionError
        The file cannot be read, or is no usable mission; carries every fault.
    """
    try:
        if path == "-":
            data = sys.stdin.buffer.read(MAX_BYTES + 1)
        else:
            with open(path, "rb") as file:
                data = file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        reason = getattr(error, "strerror", None) or str(error)
        raise MissionError(path, (_file_fault(f"cannot be read: {reason}"),)) from None
    return parse_mission(data, path)


def parse_mission(data: bytes | str, file: str = "-") -> Mission:
    """Turn the content of a mission file into a `Mission`.

    Parameters
    ----------
    data : bytes or str
        The file's content; bytes are UTF-8.
    file : str
        Name to say in messages.

    Raises
    ------
    MissionError
        Not a usable mission; carries every fault.
    """
    tree = _read_tree(_decoded(data, file), file)
    faults = list(tree.faults)
    mission = None
    try:
        mission = Mission.model_validate(tree.root)
    except ValidationError as error:
        faults += [fault for details in error.errors() for fault in _faults(details, tree)]
    if faults:
        unique = dict.fromkeys(faults)
        ordered = sorted(unique, key=lambda fault: (fault.line or 0, fault.column or 0))
        raise MissionError(file, tuple(ordered))
    assert mission is not None
    mission._file = file
    mission._lines = {path: line + 1 for path, (line, _) in tree.values.items()}
    return mission


def _file_fault(problem: str, hint: str = "") -> Fault:
    return Fault(line=None, column=None, key="", problem=problem, hint=hint)


def _decoded(data: bytes | str, file: str) -> str:
    if len(data) > MAX_BYTES:
        raise MissionError(file, (_file_fault(f"is larger than {MAX_BYTES // 1024} KiB, so no mission file"),))
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


@dataclass
class _Tree:
    """What the file says: nested dict, list and str, with the 0-based (line, column) of every key and value."""

    root: Any = None
    keys: dict[KeyPath, tuple[int, int]] = field(default_factory=dict)
    values: dict[KeyPath, tuple[int, int]] = field(default_factory=dict)
    faults: list[Fault] = field(default_factory=list)
    dropped: set[KeyPath] = field(default_factory=set)  # reported already; a "missing" would repeat it

    def fault(self, mark: tuple[int, int], path: KeyPath, problem: str, **more: str) -> None:
        line, column = mark
        self.faults.append(Fault(line=line + 1, column=column + 1, key=_dotted(path), problem=problem, **more))


def _read_tree(text: str, file: str) -> _Tree:
    tree = _Tree()
    try:
        _build(tree, _events(text))
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        problem = f"is not valid YAML: {' '.join(filter(None, (error.context, error.problem)))}"
        tree.fault((mark.line, mark.column) if mark else (0, 0), (), problem)
        raise MissionError(file, tuple(tree.faults)) from None
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, max(0, error.position)) + 1
        fault = Fault(line=line, column=None, key="", problem=f"is not a text file: {error.reason}")
        raise MissionError(file, (fault,)) from None
    except _UnusableError:
        raise MissionError(file, tuple(tree.faults)) from None
    return tree


class _UnusableError(Exception):
    """Nothing after this point is worth reading; the fault is in the tree."""


def _events(text: str) -> Iterator[Any]:
    parser = _PARSER(text)
    try:
        while True:
            event = parser.get_event()
            yield event
            if type(event) is yaml.StreamEndEvent:
                return
    finally:
        parser.dispose()


def _build(tree: _Tree, events: Iterator[Any]) -> None:
    stack: list[tuple[Any, KeyPath]] = []  # open containers
    key: str | None = None  # of the mapping on top, once read
    skipping = 0  # containers deep inside something already reported
    documents = 0
    for event in events:
        kind = type(event)
        mark = event.start_mark and (event.start_mark.line, event.start_mark.column)
        if kind is yaml.ScalarEvent or kind is yaml.AliasEvent:
            if skipping:
                continue
        elif kind is yaml.MappingStartEvent or kind is yaml.SequenceStartEvent:
            if skipping or len(stack) >= MAX_DEPTH:
                skipping += 1
                if len(stack) + skipping > MAX_DEPTH:
                    tree.fault(mark, (), f"is nested more than {MAX_DEPTH} deep")
                    raise _UnusableError
                continue
        elif kind is yaml.MappingEndEvent or kind is yaml.SequenceEndEvent:
            if skipping:
                skipping -= 1
            else:
                stack.pop()
            continue
        elif kind is yaml.DocumentStartEvent:
            documents += 1
            if documents > 1:
                tree.fault(mark, (), "has a second YAML document", accepted="one mission to a file")
                raise _UnusableError
            continue
        else:
            continue

        # Here the event is a node: a key, or the value of a key, an item or the whole document.
        container, path = stack[-1] if stack else (None, ())
        if type(container) is dict and key is None:
            key = _key(tree, event, mark, path, container)
            if key is None:  # reported; its value must not be read as a key
                key = _SKIPPED
                if kind is not yaml.ScalarEvent and kind is not yaml.AliasEvent:
                    tree.fault(mark, path, "has a key that is not plain text")
                    raise _UnusableError
            continue
        if type(container) is dict:
            here: KeyPath = (*path, key or "")
        elif type(container) is list:
            here = (*path, len(container))
        else:
            here = ()
        skip = key is _SKIPPED
        value = _SKIPPED if skip else _value(tree, event, mark, here)
        key = None
        if value is _SKIPPED or value is None:
            tree.dropped.add(here)
            if kind is yaml.MappingStartEvent or kind is yaml.SequenceStartEvent:
                skipping = 1
            if type(container) is not list:
                continue
            value = _SKIPPED  # keeps the place of the items behind it
        tree.values[here] = mark
        if type(container) is dict:
            container[here[-1]] = value
        elif type(container) is list:
            container.append(value)
        else:
            tree.root = value
        if type(value) is dict or type(value) is list:
            stack.append((value, here))
    if type(tree.root) is not dict:
        if not tree.faults:
            problem = "is empty" if tree.root is None else "is not a mapping of keys to values"
            tree.faults.append(_file_fault(problem, "`bisar-budget init` writes a mission file to start from"))
        raise _UnusableError


_SKIPPED = "\0skipped"  # no text of a YAML file holds a NUL


def _key(tree: _Tree, event: Any, mark: tuple[int, int], path: KeyPath, container: dict[str, Any]) -> str | None:
    """Read a key; None, with a fault, if it cannot be one."""
    if type(event) is not yaml.ScalarEvent:
        return None
    key = str(event.value)
    here = (*path, key)
    if here in tree.keys:
        first = tree.keys[here][0] + 1
        tree.fault(mark, here, f"is a duplicate key; the first is in line {first}", accepted="each key once")
        return None
    tree.keys[here] = mark
    return key


def _value(tree: _Tree, event: Any, mark: tuple[int, int], here: KeyPath) -> Any:
    """Read a scalar as its text, a container as an empty one to be filled; None, with a fault, for the rest."""
    kind = type(event)
    if kind is yaml.AliasEvent:
        tree.fault(mark, here, "is an alias (*)", accepted="write the value out")
        return None
    if event.tag is not None and event.tag != "!":
        tree.fault(mark, here, "carries a YAML tag", given=_shown(event.tag), accepted="plain values")
        return None
    if kind is yaml.MappingStartEvent:
        return {}
    if kind is yaml.SequenceStartEvent:
        return []
    if not event.style and event.value in _NULLS:  # plain: "" from libyaml, None from pure Python
        tree.fault(mark, here, "has no value", hint="Remove the key to get its default")
        return None
    return str(event.value)


def _dotted(path: KeyPath) -> str:
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else str(part)
    return text if text.isprintable() and len(text) <= 200 else _shown(text)


def _shown(value: object) -> str:
    """Say a value from the file so that it cannot do anything to a terminal."""
    text = value if isinstance(value, str) else "a list" if isinstance(value, list) else "a mapping"
    text = text if text.isprintable() else ascii(text)[1:-1]
    return text if len(text) <= 60 else text[:57] + "..."


def _faults(details: ErrorDetails, tree: _Tree) -> Iterator[Fault]:
    """Say what pydantic found, at the place where it stands in the file."""
    loc = tuple(part for part in details["loc"] if not str(part).startswith("<"))  # <…>: forms of `split`
    error = details.get("ctx", {}).get("error")
    if isinstance(error, InvalidValueError):
        for problem in error.problems:
            path = (*loc, *problem.at)
            yield from _value_fault(path, problem, tree)
        return
    kind = details["type"]
    if kind == "extra_forbidden":
        line, column = tree.keys[loc]
        known = tuple(_model_at(loc[:-1]).model_fields)
        yield Fault(
            line=line + 1,
            column=column + 1,
            key=_dotted(loc),
            problem="is not a known key",
            accepted=f"accepted: {', '.join(known)}",
            hint=_nearest(str(loc[-1]), known),
        )
    elif kind == "missing":
        if loc not in tree.dropped:
            yield from _value_fault(loc, Problem(problem="is missing"), tree)
    else:
        words = {
            "string_type": Problem(problem="must be text"),
            "model_type": Problem(problem="must be a mapping of keys to values"),
            "dict_type": Problem(problem="must be a mapping of keys to values"),
            "tuple_type": Problem(problem="must be a list"),
        }
        yield from _value_fault(loc, words.get(kind, Problem(problem=details["msg"].lower())), tree)


def _value_fault(path: KeyPath, problem: Problem, tree: _Tree) -> Iterator[Fault]:
    value: Any = tree.root
    for part in path:
        try:
            value = value[part]
        except (KeyError, IndexError, TypeError):
            value = None
            break
    if value is _SKIPPED:
        return  # reported when the file was read
    mark = (0, 0)
    for length in range(len(path), 0, -1):
        place = tree.values if length == len(path) and value is not None else tree.keys
        found = place.get(path[:length]) or tree.values.get(path[:length])
        if found is not None:
            mark = found
            break
    yield Fault(
        line=mark[0] + 1,
        column=mark[1] + 1,
        key=_dotted(path),
        problem=problem.problem,
        given=_shown(value) if isinstance(value, str) else "",
        accepted=problem.accepted,
        hint=problem.hint,
    )


def _nearest(key: str, known: tuple[str, ...]) -> str:
    from difflib import get_close_matches

    near = get_close_matches(key, known, 1, 0.6)
    return f"Did you mean {near[0]!r}?" if near else ""


def _model_at(path: KeyPath) -> type[BaseModel]:
    """Find the section of the model that a path of the file leads to."""
    model: type[BaseModel] = Mission
    for part in path:
        if isinstance(part, str):
            model = _section(model.model_fields[part].annotation, path)
    return model


def _section(annotation: Any, path: KeyPath) -> type[BaseModel]:
    """Find the section inside `X | None`, `tuple[X, ...]` or the forms of `split`."""
    sections: list[type[BaseModel]] = []
    pending = [annotation]
    while pending:
        current = pending.pop(0)
        if isinstance(current, type) and issubclass(current, BaseModel):
            sections.append(current)
        pending += get_args(current)
    # Of the forms of `split` the one with this path's keys: a metric in the path means per metric.
    with_next = [s for s in sections if any(part in s.model_fields for part in path[2:3])]
    return (with_next or sections)[0]
