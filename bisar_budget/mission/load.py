"""Read a mission file: a plain tree with positions (`tree`), the tree to a `Mission`, faults to their lines.

A text gives a `Mission` or a `MissionError`, nothing else.
"""

import os
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import BinaryIO, cast

from bisar_budget.faults import Fault, MissionError, SetValue, changes_words
from bisar_budget.mission.model import MISSION, Mission, flies_on_earth, names_files, names_parts
from bisar_budget.mission.readers import INVALID
from bisar_budget.mission.tree import MAX_BYTES, UnusableError, file_fault, read_tree
from bisar_budget.resources import UnreadableError, held


def load_mission(path: str, model: str | None = None, changes: Sequence[SetValue] = ()) -> Mission:
    """Read the mission file at `path`; `-` is standard input.

    `model` stands in for the file's own, `changes` for values.

    Raises
    ------
    MissionError
        The file cannot be read, or is no usable mission; carries every fault.
    """
    try:
        data = held(path, MAX_BYTES, lambda: _content(path))
    except (OSError, ValueError, UnreadableError) as error:  # ValueError: a NUL in the name
        reason = getattr(error, "strerror", None) or str(error)
        is_pattern = isinstance(error, FileNotFoundError) and any(char in path for char in "*?[")
        problem = "not found, and no file matches the pattern" if is_pattern else f"cannot be read: {reason}"
        raise MissionError(path, (file_fault(problem),)) from None
    try:
        return parse_mission(data, path, model, changes=changes)
    except MissionError as error:
        error.data = data if len(data) <= MAX_BYTES else None
        raise


def _content(path: str) -> bytes:
    if path == "-":
        if sys.stdin is None:
            raise ValueError("standard input is closed")
        return _bounded(sys.stdin.buffer)
    with open(path, "rb") as file:
        return _bounded(file)


def _bounded(file: BinaryIO) -> bytes:
    """Read at most one byte more than a mission file may have, in two steps: a large buffer costs page faults."""
    data = file.read(1 << 14)
    return data + file.read(MAX_BYTES + 1 - len(data)) if len(data) == 1 << 14 else data


def parse_mission(
    data: bytes | str,
    file: str = "-",
    model: str | None = None,
    beside: Callable[[str], bytes] | None = None,
    changes: Sequence[SetValue] = (),
    find: Callable[[str], tuple[str, bytes]] | None = None,
) -> Mission:
    """Turn the content of a mission file into a `Mission`.

    Parameters
    ----------
    data : bytes or str
        The file's content; bytes are UTF-8.
    file : str
        Name to say in messages.
    model : str, optional
        Gating model in place of `allocation.model`.
    beside : callable, optional
        Gives the content of a file that the mission names, and raises `PathFileError`; omitted: files beside it.
    changes : sequence of SetValue
        Values in place of the file's, and beside them, in this order.
    find : callable, optional
        Gives file and content of a part that the mission names, and raises `PartError`; omitted: where parts are.

    Raises
    ------
    MissionError
        Not a usable mission; carries every fault.
    """
    tree = read_tree(data, file)
    if changes:
        from bisar_budget.mission.changes import apply_changes

        with suppress(UnusableError):
            apply_changes(tree, changes)
    if model is not None and isinstance(tree.root.get("allocation"), dict):
        tree.root["allocation"]["model"] = model
    mission = INVALID
    parts: dict[str, str] = {}
    with suppress(UnusableError):
        mission = MISSION.read(tree.root, (), tree.report)
        folder = folder_of(file)
        if mission is INVALID and names_files(tree.root):
            from bisar_budget.mission.paths import reader_of, report_files

            report_files(tree.root, beside or reader_of(folder), tree.report)
        elif mission is not INVALID and flies_on_earth(mission):
            from bisar_budget.mission.paths import reader_of, with_paths

            mission = with_paths(mission, beside or reader_of(folder), tree.report)
        if mission is INVALID and names_files(tree.root):
            from bisar_budget.mission.parts import finder_of, report_parts

            report_parts(tree.root, folder, find or finder_of(folder), tree.report)
        elif mission is not INVALID and names_parts(mission):
            from bisar_budget.mission.parts import finder_of, with_parts

            mission = with_parts(mission, folder, _noted(find or finder_of(folder), parts), tree.report)
    if tree.faults:
        ordered = sorted(dict.fromkeys(tree.faults), key=lambda fault: (fault.line or 0, fault.column or 0))
        if changes:
            ordered = [_with_changes(fault, changes) for fault in ordered]
        raise MissionError(file, tuple(ordered))
    as_bytes = data.encode("utf-8", "surrogatepass") if isinstance(data, str) else data
    read = cast(Mission, mission._replace(file=file, places=tree.values, data=as_bytes, changes=tuple(changes)))
    read = read._replace(parts=tuple(parts.items()))
    return read if model is None else read._replace(allocation=read.allocation._replace(model=model))


def _noted(find: Callable[[str], tuple[str, bytes]], files: dict[str, str]) -> Callable[[str], tuple[str, bytes]]:
    """The same, and the file of each part is noted by its name."""

    def found(name: str) -> tuple[str, bytes]:
        file, content = find(name)
        files[name] = file
        return file, content

    return found


def folder_of(file: str) -> str:
    """Folder from which the names in a mission file start; that of standard input is the current one."""
    return os.path.dirname(file) if file != "-" else ""


def _with_changes(fault: Fault, changes: Sequence[SetValue]) -> Fault:
    """Say of an unknown key of an option which was meant, and with what options a fault of the file was found.

    Without them there may be none.
    """
    if fault.option:
        if fault.hint or not fault.problem.endswith("is not a known key"):
            return fault
        from bisar_budget.mission.keys import nearest_keys

        return fault._replace(hint=nearest_keys(fault.option.removeprefix("--set ")))
    return fault._replace(hint=f"{fault.hint}{'. ' if fault.hint else ''}Read with {changes_words(changes)}")
