"""Changes of values in the text of a mission file; all other text is kept, including comments."""

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import yaml

from bisar_budget.faults import SetValue
from bisar_budget.mission.changes import next_name, pair_at, parts_of, takes_out
from bisar_budget.mission.load import folder_of
from bisar_budget.mission.model import Mission
from bisar_budget.mission.parts import is_file
from bisar_budget.mission.paths import path_files
from bisar_budget.mission.readers import Paired

_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
Node = Any
"""A node of PyYAML: a mapping, a sequence or a scalar, with the marks of its start and end."""


def with_values(text: str, changes: Sequence[SetValue]) -> str:
    """Replace values in the text of a valid mission file.

    The new values are strings as in a mission file. Missing sections are added. A null as the new value removes the
    key.
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
    """Put a section of keys and values into the text of a mission file.

    The section replaces an existing section of the same name, or is added at the end of the file. The keys in the
    section may contain dots.
    """
    is_of_dos, text = "\r\n" in text, text.replace("\r\n", "\n")
    root: Node = yaml.compose(text, Loader=_LOADER)
    inline = f"{name}: {{{', '.join(f'{key}: {value}' for key, value in values.items())}}}"
    lines = "\n".join([f"{name}:", *(f"  {key}: {value}" for key, value in values.items())])
    existing = next(((key, value) for key, value in root.value if key.value == name), None)
    if existing is None:
        end = root.end_mark.index
        if root.flow_style:
            last = root.value[-1][1].end_mark.index  # a comment may follow
            text = f"{text[:last]}, {inline}{text[last:]}"
        else:
            inside = _without_trailing_comments(text[:end])
            text = f"{inside}\n{lines}{text[len(inside) :] or chr(10)}"
    else:
        key, value = existing
        start, end = key.start_mark.index, value.end_mark.index
        replaced = text[start:end] if value.flow_style else _without_trailing_comments(text[start:end])
        text = f"{text[:start]}{inline if value.flow_style else lines}{text[start + len(replaced) :]}"
    return text.replace("\n", "\r\n") if is_of_dos else text


def in_folder(mission: Mission, folder: str) -> Iterator[SetValue]:
    """Yield the changes of relative file names that are necessary if the mission file is moved to `folder`.

    With these changes the mission names the same files as before. Absolute file names need no change.
    """
    for key, name in (*path_files(mission), *_named_part_files(mission)):
        if os.path.isabs(name):
            continue
        file = os.path.realpath(os.path.join(folder_of(mission.file), name))
        try:
            name = os.path.relpath(file, os.path.realpath(folder))
        except ValueError:  # Windows: the file is on another drive
            name = file
        yield SetValue(key, json.dumps(name.replace(os.sep, "/"), ensure_ascii=False))


def _named_part_files(mission: Mission) -> Iterator[tuple[str, str]]:
    """Yield the key and the file name of each part that the mission names by a file instead of a catalogue name."""
    for owner, platform in mission.platforms._asdict().items():
        for key, name in platform.part_names.items():
            if is_file(name):
                yield f"platforms.{owner}.{key}", name


def _with_value(text: str, steps: tuple[str, ...], value: str) -> str:
    """Set the value of a key in the text of a mission file; `steps` are the keys and list indices of its path."""
    node: Node = yaml.compose(text, Loader=_LOADER)
    all_steps = steps
    while True:
        key, remaining = _next(node, steps)
        inner = _below(node, key)
        if inner is None:
            return _with_entry(text, node, key, remaining, value)
        if not remaining:
            return _replaced(text, inner, value, _end_of_key(node, key))
        if (pair := _pair_at(inner, all_steps[: len(all_steps) - len(remaining)], remaining[0])) is not None:
            section = f"{{{pair.name_of_number}: {_in_one_line(text, inner)}}}"
            return _with_value(_replaced(text, inner, section, _end_of_key(node, key)), all_steps, value)
        if not isinstance(inner, yaml.MappingNode | yaml.SequenceNode):  # an empty section
            return _replaced(text, inner, _nested(remaining, value), _end_of_key(node, key))
        node, steps = inner, remaining


def _pair_at(node: Node, path: Sequence[str], step: str) -> Paired | None:
    """Reader of the number at `path`, if the key `step` needs the number in the form of a section.

    The result is None if `node`, the node at `path`, is an empty value or already a section.
    """
    if isinstance(node, yaml.SequenceNode):
        return pair_at([], path, step)
    return pair_at(node.value, path, step) if isinstance(node, yaml.ScalarNode) and node.value else None


def _in_one_line(text: str, node: Node) -> str:
    """Text of a number or a list of numbers that can stand in braces; a list of lines becomes one in brackets."""
    if isinstance(node, yaml.SequenceNode):
        return f"[{', '.join(_in_one_line(text, entry) for entry in node.value)}]"
    return text[node.start_mark.index : node.end_mark.index]


def _without_key(text: str, parts: tuple[str, ...]) -> str:
    """Remove a key and its value from the text of a mission file, if the key exists.

    If this was the only key of its section, the section becomes empty. Comments elsewhere in the file are kept.
    """
    node: Node = yaml.compose(text, Loader=_LOADER)
    end_of_key = 0
    while True:
        key, remaining = _next(node, parts)
        inner = _below(node, key)
        if inner is None or not remaining:
            break
        end_of_key = _end_of_key(node, key)
        node, parts = inner, remaining
    if inner is None or not isinstance(node, yaml.MappingNode):
        return text
    entries = node.value
    index = next(n for n, (name, _) in enumerate(entries) if name.value == key)
    if len(entries) == 1:
        return _replaced(text, node, "{}", end_of_key)
    start = entries[index][0].start_mark.index
    entry = _without_trailing_comments(text[start : inner.end_mark.index])
    line_start = text.rfind("\n", 0, start) + 1
    if node.flow_style and index:
        return text[: entries[index - 1][1].end_mark.index] + text[start + len(entry) :]
    if node.flow_style or text[line_start:start].strip():  # the first key after a brace or after the dash of an entry
        return text[:start] + text[entries[index + 1][0].start_mark.index :]
    line_end = text.find("\n", start + len(entry))
    return text[:line_start] + ("" if line_end < 0 else text[line_end + 1 :])


def _next(node: Node, parts: tuple[str, ...]) -> tuple[str, tuple[str, ...]]:
    """Split a path into the first key or index, which belongs to `node`, and the remaining parts.

    A key may itself contain dots.
    """
    names: dict[str, None] | list[Node] = (
        {key.value: None for key, _ in node.value} if isinstance(node, yaml.MappingNode) else list(node.value)
    )
    name, remaining = next_name(names, parts)
    return str(name), remaining


def _below(node: Node, name: str) -> Node:
    """Node of the value at a key of a mapping, or at an index of a list; None if there is no such value."""
    if isinstance(node, yaml.MappingNode):
        return next((value for key, value in node.value if key.value == name), None)
    return node.value[int(name)] if int(name) < len(node.value) else None


def _end_of_key(node: Node, name: str) -> int:
    """Character index at which a key of a mapping ends; for a list, the index at which the list begins."""
    if not isinstance(node, yaml.MappingNode):
        return int(node.start_mark.index)
    return next(int(key.end_mark.index) for key, _ in node.value if key.value == name)


def _replaced(text: str, node: Node, value: str, end_of_key: int) -> str:
    """Replace the text of a node by `value`; comments inside a node that spans several lines are kept.

    `end_of_key` is the position in `text` at which the key of the node ends.
    """
    start, end = node.start_mark.index, node.end_mark.index
    if isinstance(node, yaml.ScalarNode):
        is_apart = start == 0 or text[start - 1].isspace()
        return f"{text[:start]}{'' if is_apart else ' '}{value}{text[end:]}"
    if node.flow_style:
        return f"{text[:start]}{value}{text[end:]}"
    # The node spans several lines: the value is put after the colon, and the comments of these lines below it.
    colon = text.index(":", end_of_key)
    end = len(text[:end].rstrip(" "))  # the next line keeps its indent
    head, _, inside = text[colon + 1 : end].partition("\n")
    comments = [line[line.index("#") :].rstrip() for line in inside.splitlines() if "#" in line]
    below = "".join(f"{' ' * node.start_mark.column}{comment}\n" for comment in comments)
    return f"{text[: colon + 1]} {value}{head.rstrip()}\n{below}{text[end:]}"


def _without_trailing_comments(inside: str) -> str:
    """Remove comments and blank lines from the end of a piece of text."""
    lines = inside.splitlines(keepends=True)
    while lines and (not lines[-1].strip() or lines[-1].lstrip().startswith("#")):
        lines.pop()
    return "".join(lines).rstrip("\n")


def _nested(parts: Sequence[str], value: str) -> str:
    """Text of nested keys and a value on one line, such as `{a: {b: 1 m}}` for the keys a and b."""
    for part in reversed(parts):
        value = f"{{{part}: {value}}}"
    return value


def _with_entry(text: str, node: Node, key: str, remaining: Sequence[str], value: str) -> str:
    """Add a key to the mapping `node`, or an entry to the list `node`.

    The style of the mapping or list is kept: its content is either on one line or on several lines.
    `remaining` are the nested keys between the new key or entry and the value.
    """
    nested_value, start, end = _nested(remaining, value), node.start_mark.index, node.end_mark.index
    entry = nested_value if isinstance(node, yaml.SequenceNode) else f"{key}: {nested_value}"
    if node.flow_style:
        inside = text[start : end - 1].rstrip()
        comma = ", " if node.value else ""
        return f"{text[:start]}{inside}{comma}{entry}{text[start + len(inside) :]}"
    entry = f"- {entry}" if isinstance(node, yaml.SequenceNode) else entry
    inside = _without_trailing_comments(text[start:end])
    return f"{text[: start + len(inside)]}\n{' ' * node.start_mark.column}{entry}{text[start + len(inside) :]}"
