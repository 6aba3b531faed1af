"""A mission file with other values in place, and all else of it as it was written, comments included."""

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import yaml

from bisar_budget.faults import SetValue
from bisar_budget.mission.changes import next_name, parts_of, takes_out
from bisar_budget.mission.load import folder_of
from bisar_budget.mission.model import Mission
from bisar_budget.mission.parts import is_file
from bisar_budget.mission.paths import path_files

_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


def with_values(text: str, changes: Sequence[SetValue]) -> str:
    """Put values, as a file has them, into the text of one that can be read as a mission.

    Sections that are not there are made.
    """
    is_of_dos = "\r\n" in text
    text = text.replace("\r\n", "\n")
    for change in changes:
        if takes_out(change):
            text = _without_key(text, parts_of(change.key))
        else:
            text = _with_value(text, parts_of(change.key), change.text)
    return text.replace("\n", "\r\n") if is_of_dos else text


def with_section(text: str, name: str, values: Mapping[str, str]) -> str:
    """Put a section of keys and values into the text of a mission file, in place of one that it has, else at its end.

    A key of the section may have dots.
    """
    is_of_dos, text = "\r\n" in text, text.replace("\r\n", "\n")
    root: Any = yaml.compose(text, Loader=_LOADER)
    inline = f"{name}: {{{', '.join(f'{key}: {value}' for key, value in values.items())}}}"
    lines = "\n".join([f"{name}:", *(f"  {key}: {value}" for key, value in values.items())])
    there = next(((key, value) for key, value in root.value if key.value == name), None)
    if there is None:
        end = root.end_mark.index
        if root.flow_style:
            last = root.value[-1][1].end_mark.index  # a remark may stand behind it
            text = f"{text[:last]}, {inline}{text[last:]}"
        else:
            inside = _without_comments(text[:end])
            text = f"{inside}\n{lines}{text[len(inside) :] or chr(10)}"
    else:
        key, value = there
        start, end = key.start_mark.index, value.end_mark.index
        whole = text[start:end] if value.flow_style else _without_comments(text[start:end])
        text = f"{text[:start]}{inline if value.flow_style else lines}{text[start + len(whole) :]}"
    return text.replace("\n", "\r\n") if is_of_dos else text


def in_folder(mission: Mission, folder: str) -> Iterator[SetValue]:
    """Values with which the file of a mission, put into another folder, names the same files from there."""
    for key, name in (*path_files(mission), *_parts_beside(mission)):
        if os.path.isabs(name):
            continue
        file = os.path.realpath(os.path.join(folder_of(mission.file), name))
        try:
            name = os.path.relpath(file, os.path.realpath(folder))
        except ValueError:  # on another drive
            name = file
        yield SetValue(key, json.dumps(name.replace(os.sep, "/"), ensure_ascii=False))


def _parts_beside(mission: Mission) -> Iterator[tuple[str, str]]:
    """Keys under which a mission names files of parts, not parts of a catalogue, and the names."""
    for owner, platform in mission.platforms._asdict().items():
        sensor = platform.motion_error.sensor
        key = f"platforms.{owner}.motion_error.sensor"
        each = {key: sensor} if isinstance(sensor, str) else {f"{key}.{n}": one for n, one in enumerate(sensor or ())}
        if platform.oscillator is not None and platform.oscillator.sensor is not None:
            each[f"platforms.{owner}.oscillator.sensor"] = platform.oscillator.sensor
        yield from ((key, name) for key, name in each.items() if is_file(name))


def _with_value(text: str, parts: tuple[str, ...], value: str) -> str:
    node: Any = yaml.compose(text, Loader=_LOADER)
    while True:
        key, rest = _next(node, parts)
        inner = _below(node, key)
        if inner is None:
            return _beside(text, node, key, rest, value)
        if not rest:
            return _replaced(text, inner, value, _end_of_key(node, key))
        if not isinstance(inner, yaml.MappingNode | yaml.SequenceNode):  # a section that has nothing in it
            return _replaced(text, inner, _nested(rest, value), _end_of_key(node, key))
        node, parts = inner, rest


def _without_key(text: str, parts: tuple[str, ...]) -> str:
    """The text without a key and its value; a section that had no other key is empty. Comments of others stay."""
    node: Any = yaml.compose(text, Loader=_LOADER)
    end_of_key = 0
    while True:
        key, rest = _next(node, parts)
        inner = _below(node, key)
        if inner is None or not rest:
            break
        end_of_key = _end_of_key(node, key)
        node, parts = inner, rest
    if inner is None or not isinstance(node, yaml.MappingNode):
        return text
    entries = node.value
    place = next(n for n, (name, _) in enumerate(entries) if name.value == key)
    if len(entries) == 1:
        return _replaced(text, node, "{}", end_of_key)
    start = entries[place][0].start_mark.index
    whole = _without_comments(text[start : inner.end_mark.index])
    line_start = text.rfind("\n", 0, start) + 1
    if node.flow_style and place:
        return text[: entries[place - 1][1].end_mark.index] + text[start + len(whole) :]
    if node.flow_style or text[line_start:start].strip():  # the first behind a brace, or behind the dash of an entry
        return text[:start] + text[entries[place + 1][0].start_mark.index :]
    line_end = text.find("\n", start + len(whole))
    return text[:line_start] + ("" if line_end < 0 else text[line_end + 1 :])


def _next(node: Any, parts: tuple[str, ...]) -> tuple[str, tuple[str, ...]]:
    """The key or number that a path goes on with; a key may have dots itself."""
    names: Any = (
        {key.value: None for key, _ in node.value} if isinstance(node, yaml.MappingNode) else list(node.value)
    )
    name, rest = next_name(names, parts)
    return str(name), rest


def _below(node: Any, name: str) -> Any:
    """The node of a key or a number; None where there is none."""
    if isinstance(node, yaml.MappingNode):
        return next((value for key, value in node.value if key.value == name), None)
    return node.value[int(name)] if int(name) < len(node.value) else None


def _end_of_key(node: Any, name: str) -> int:
    """Where the key ends whose value stands in a mapping, or where a list begins."""
    if not isinstance(node, yaml.MappingNode):
        return int(node.start_mark.index)
    return next(int(key.end_mark.index) for key, _ in node.value if key.value == name)


def _replaced(text: str, node: Any, value: str, end_of_key: int) -> str:
    """Put a value in the place of a node; of one in lines of its own comments stay."""
    start, end = node.start_mark.index, node.end_mark.index
    if isinstance(node, yaml.ScalarNode):
        is_apart = start == 0 or text[start - 1].isspace()
        return f"{text[:start]}{'' if is_apart else ' '}{value}{text[end:]}"
    if node.flow_style:
        return f"{text[:start]}{value}{text[end:]}"
    # A list in lines of its own: the value stands behind the colon, and what its lines remark below it.
    colon = text.index(":", end_of_key)
    end = len(text[:end].rstrip(" "))  # the next line keeps its indent
    head, _, inside = text[colon + 1 : end].partition("\n")
    remarks = [line[line.index("#") :].rstrip() for line in inside.splitlines() if "#" in line]
    below = "".join(f"{' ' * node.start_mark.column}{remark}\n" for remark in remarks)
    return f"{text[: colon + 1]} {value}{head.rstrip()}\n{below}{text[end:]}"


def _without_comments(inside: str) -> str:
    """Lines without those at the end that are comments or blank."""
    lines = inside.splitlines(keepends=True)
    while lines and (not lines[-1].strip() or lines[-1].lstrip().startswith("#")):
        lines.pop()
    return "".join(lines).rstrip("\n")


def _nested(parts: Sequence[str], value: str) -> str:
    """A value below keys, in one line."""
    for part in reversed(parts):
        value = f"{{{part}: {value}}}"
    return value


def _beside(text: str, node: Any, key: str, rest: Sequence[str], value: str) -> str:
    """Put a key beside those of a mapping, or a value at the end of a list, as the others are written."""
    whole, start, end = _nested(rest, value), node.start_mark.index, node.end_mark.index
    entry = whole if isinstance(node, yaml.SequenceNode) else f"{key}: {whole}"
    if node.flow_style:
        inside = text[start : end - 1].rstrip()
        comma = ", " if node.value else ""
        return f"{text[:start]}{inside}{comma}{entry}{text[start + len(inside) :]}"
    entry = f"- {entry}" if isinstance(node, yaml.SequenceNode) else entry
    inside = _without_comments(text[start:end])
    return f"{text[: start + len(inside)]}\n{' ' * node.start_mark.column}{entry}{text[start + len(inside) :]}"
