"""Reader of mission files: parses YAML into a tree with file positions (see `tree`), and makes a `Mission` from it.

The result is either a `Mission`, or a `MissionError` that contains all faults of the file with their line numbers.
"""

import os
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import BinaryIO

from bisar_budget.faults import Fault, MissionError, Problem, SetValue, changes_words, file_fault, sentences
from bisar_budget.mission.model import (
    MISSION,
    Mission,
    PartFile,
    UncertainFigure,
    flies_on_earth,
    names_files,
    names_parts,
    names_requirements,
)
from bisar_budget.mission.readers import INVALID, Invalid
from bisar_budget.mission.tree import MAX_BYTES, Tree, UnusableError, has_uncertainty, read_tree
from bisar_budget.resources import UnreadableError, held, special_file, standard_input

# `changes`, `parts` and `paths` are imported in the functions that need them, because most missions do not need them.
# Without cached bytecode, their compilation takes 40 ms, a fifth of the start of a check.
_Find = Callable[[str], tuple[str, bytes]]


def load_mission(
    path: str, model: str | None = None, changes: Sequence[SetValue] = (), *, is_placed: bool = True
) -> Mission:
    """Read the mission file at `path`; `-` means standard input.

    `model` is the model that decides the verdicts; it replaces `allocation.model` of the file. `changes` replace
    other values of the file. `is_placed` is the same as in `parse_mission`.

    Raises
    ------
    MissionError
        The file cannot be read, or is not a usable mission. The error contains every fault.
    """
    try:
        data = held(path, MAX_BYTES, lambda: _content(path))
    except (OSError, ValueError, UnreadableError) as error:  # ValueError: a NUL in the name
        reason = getattr(error, "strerror", None) or str(error)
        is_pattern = isinstance(error, FileNotFoundError) and any(char in path for char in "*?[")
        problem = "not found, and no file matches the pattern" if is_pattern else f"cannot be read: {reason}"
        raise MissionError(path, (file_fault(problem),)) from None
    try:
        return parse_mission(data, path, model, changes=changes, is_placed=is_placed)
    except MissionError as error:
        error.data = data if len(data) <= MAX_BYTES else None
        raise


def _content(path: str) -> bytes:
    """Content of a regular file, or of standard input if `path` is `-`.

    Raises `UnreadableError` for any other kind of file.
    """
    if path == "-":
        return _bounded(standard_input())
    if kind := special_file(path):
        raise UnreadableError(f"{kind}; accepted: a regular file, or - for standard input")
    with open(path, "rb") as file:
        return _bounded(file)


def _bounded(file: BinaryIO) -> bytes:
    """Read at most `MAX_BYTES + 1` bytes of a file.

    The file is read in two steps, because a large buffer would cost page faults even for a small file.
    """
    data = file.read(1 << 14)
    return data + file.read(MAX_BYTES + 1 - len(data)) if len(data) == 1 << 14 else data


def parse_mission(
    data: bytes | str,
    file: str = "-",
    model: str | None = None,
    read_path: Callable[[str], bytes] | None = None,
    changes: Sequence[SetValue] = (),
    find: _Find | None = None,
    *,
    is_placed: bool = True,
) -> Mission:
    """Turn the content of a mission file into a `Mission`.

    Parameters
    ----------
    data : bytes or str
        Content of the file; bytes are UTF-8.
    file : str
        Name of the file for messages.
    model : str, optional
        Model that decides the verdicts, in place of `allocation.model` of the file.
    read_path : callable, optional
        Function that takes the name of an orbit, log or other file that the mission names, and returns its content.
        It may raise `PathFileError`. By default files are read relative to the folder of the mission file.
    changes : sequence of SetValue
        Values that replace values of the file or are added to them, applied in this order.
    find : callable, optional
        Function that takes the name of a part that the mission names, and returns the path and the content of its
        file. It may raise `PartError`. By default parts are searched for in the folders of `parts.folders`.
    is_placed : bool
        Whether to compute the paths of platforms if a mission needs positions on the Earth. Without these paths the
        mission has no geometry, but it can be used for any `collection.center_time`.

    Raises
    ------
    MissionError
        The content is not a usable mission. The error contains every fault.
    """
    return mission_of(read_tree(data, file), data, file, model, read_path, changes, find, is_placed=is_placed)


def mission_of(
    tree: Tree,
    data: bytes | str,
    file: str,
    model: str | None = None,
    read_path: Callable[[str], bytes] | None = None,
    changes: Sequence[SetValue] = (),
    find: _Find | None = None,
    *,
    is_placed: bool = True,
) -> Mission:
    """Turn the tree of a mission file into a `Mission`; the tree is changed in place.

    `data` is the content of the file from which the tree was read. The other arguments and the errors are the same as
    in `parse_mission`.
    """
    if changes:
        from bisar_budget.mission.changes import apply_changes

        with suppress(UnusableError):
            apply_changes(tree, changes)
    if model is not None and isinstance(tree.root.get("allocation"), dict):
        tree.root["allocation"]["model"] = model
    mission: Mission | Invalid = INVALID
    uncertainties: tuple[UncertainFigure, ...] = ()
    parts: dict[str, PartFile] = {}
    with suppress(UnusableError):
        folder = folder_of(file)
        if names_requirements(tree.root):
            from bisar_budget.mission.paths import reader_of
            from bisar_budget.mission.requirement_file import add_requirements

            add_requirements(tree, read_path or reader_of(folder), changes)
        if has_uncertainty(tree.root):
            from bisar_budget.mission.uncertain import take_uncertainties

            uncertainties = take_uncertainties(tree)
        mission = MISSION.read(tree.root, (), tree.report)
        if mission is not INVALID and mission.requirements.has_confidence:
            _report_two_confidences(tree)
        if mission is not INVALID and mission.allocation.specify:
            from bisar_budget.mission.changes import report_specified

            report_specified(tree)
        if mission is not INVALID and mission.specifications:
            from bisar_budget.mission.quantities import with_specifications

            mission = with_specifications(mission, tree)
        if (mission is INVALID or not is_placed) and names_files(tree.root):
            from bisar_budget.mission.paths import reader_of, report_files

            report_files(tree.root, read_path or reader_of(folder), tree.report)
        elif mission is not INVALID and is_placed and flies_on_earth(mission):
            from bisar_budget.mission.paths import reader_of, with_paths

            mission = with_paths(mission, read_path or reader_of(folder), tree.report)
        if mission is INVALID and names_files(tree.root):
            from bisar_budget.mission.parts import finder_of, report_parts

            report_parts(tree.root, find or finder_of(folder), tree.report)
        elif mission is not INVALID and names_parts(mission):
            from bisar_budget.mission.parts import finder_of, with_parts

            mission = with_parts(mission, _recording(find or finder_of(folder), parts), tree.report)
    if tree.faults or mission is INVALID:
        ordered = tuple([_with_hint(fault) for fault in tree.in_order()])
        if changes:
            ordered = tuple([_with_changes(fault, changes) for fault in ordered])
        raise MissionError(file, ordered)
    as_bytes = data.encode("utf-8", "surrogatepass") if isinstance(data, str) else data
    finished = mission._replace(file=file, places=tree.values, data=as_bytes, changes=tuple(changes))
    finished = finished._replace(parts=tuple(parts.values()), uncertainties=uncertainties)
    return finished if model is None else finished._replace(allocation=finished.allocation._replace(model=model))


def _report_two_confidences(tree: Tree) -> None:
    """Add a fault to the tree if a coverage factor is stated, although a requirement has a confidence."""
    allocation = tree.root.get("allocation")
    if isinstance(allocation, dict) and "coverage_factor" in allocation:
        problem = "stands beside a requirement with a confidence, which says how many sigmas count"
        tree.report(
            ("allocation", "coverage_factor"),
            Problem(problem, "accepted: one of the two", is_of_key=True),
        )


def _recording(find: _Find, parts: dict[str, PartFile]) -> _Find:
    """Return a function that calls `find`, and records each found part by its name in the mapping `parts`."""

    def find_and_record(name: str) -> tuple[str, bytes]:
        file, content = find(name)
        parts[name] = PartFile(name, file, content)
        return file, content

    return find_and_record


def folder_of(file: str) -> str:
    """Folder to which relative file names in a mission file refer.

    An empty string, returned for a mission from standard input, means the current folder.
    """
    return os.path.dirname(file) if file != "-" else ""


def _with_hint(fault: Fault) -> Fault:
    """Add a hint to a fault about an unknown key: the nearest known key, or the sections that have this key.

    Any other fault is returned unchanged.
    """
    is_unknown = fault.problem.endswith("is not a known key")
    if not is_unknown or (fault.hint and not fault.hint.startswith("Did you mean")):
        return fault
    from bisar_budget.mission.changes import nearest_keys, parts_of, section_hint

    if not fault.option:
        return fault._replace(hint=section_hint(fault.key, fault.hint))
    option_key = fault.option.removeprefix("--set ")
    is_above = ".".join(parts_of(option_key)).startswith(".".join(parts_of(fault.key)))
    return fault._replace(hint=nearest_keys(option_key if is_above else fault.key))


def _with_changes(fault: Fault, changes: Sequence[SetValue]) -> Fault:
    """To a fault in the file, add a hint that names all `--set` options, because they may have caused it.

    A fault that is located in an option itself is returned unchanged.
    """
    return (
        fault if fault.option else fault._replace(hint=sentences(fault.hint, f"Read with {changes_words(changes)}"))
    )


# ---------------------------------------------------------------------- files that a mission names
@dataclass(frozen=True)
class Named:
    """Content of the files that a mission names, for machines without them: orbits and logs by name, and parts.

    `paths` has the name and the content of each orbit, log or similar file; `parts` has the files of parts.
    """

    paths: tuple[tuple[str, bytes], ...] = ()
    parts: tuple[PartFile, ...] = ()

    def parse(
        self, tree: Tree, data: bytes, file: str, model: str | None = None, *, changes: Sequence[SetValue] = ()
    ) -> Mission:
        """Parse a mission; the content of all files that it names is taken from this object.

        Arguments and errors are the same as in `mission_of`.
        """
        content_by_name = {part_file.name: (part_file.file, part_file.data) for part_file in self.parts}
        return mission_of(tree, data, file, model, dict(self.paths).__getitem__, changes, content_by_name.__getitem__)

    @property
    def sha256(self) -> str:
        """SHA-256 digest over the names and contents of all files; empty if the mission names no files."""
        from hashlib import sha256  # a check does not need it

        files = (*self.paths, *((part_file.name, part_file.data) for part_file in self.parts))
        digests = [(name, sha256(content).hexdigest()) for name, content in files]
        return sha256(ascii(digests).encode()).hexdigest() if digests else ""


def named_by(mission: Mission, also: Sequence[SetValue] = ()) -> Named:
    """Read all files that a mission names.

    The result also includes the files that the mission would name with a change in `also`. Each change is applied
    alone. A change that makes the mission invalid is skipped.

    Raises
    ------
    MissionError
        A file was changed after the mission was loaded, and can no longer be used.
    """
    from bisar_budget.mission.parts import finder_of
    from bisar_budget.mission.paths import reader_of

    folder = folder_of(mission.file)
    read = reader_of(folder)
    paths: dict[str, bytes] = {}
    parts: dict[str, PartFile] = {}
    find = _recording(finder_of(folder), parts)

    def read_and_record(name: str) -> bytes:
        paths[name] = read(name)
        return paths[name]

    model = mission.allocation.model  # --model may replace an invalid model of the file
    parse_mission(mission.data, mission.file, model, read_and_record, mission.changes, find)
    for change in also:
        with suppress(MissionError):  # an invalid value is reported when it is used
            parse_mission(mission.data, mission.file, model, read_and_record, (*mission.changes, change), find)
    return Named(tuple(sorted(paths.items())), tuple(sorted(parts.values())))
