"""Missions that a change touches: those among its files, and those that read one of its files."""

import os
import re
from collections.abc import Iterator, Sequence

from bisar_budget.faults import MissionError
from bisar_budget.mission.load import folder_of, parse_mission
from bisar_budget.mission.model import names_files
from bisar_budget.mission.parts import finder_of
from bisar_budget.mission.paths import reader_of
from bisar_budget.mission.tree import MAX_BYTES, read_tree
from bisar_budget.resources import DISK, UnreadableError

_SUFFIXES = (".yaml", ".yml")
_FOLDER = "missions"  # every YAML file below one is a mission, but for parts
_IS_MISSION = re.compile(rb"(?m)^[\"']?(?:schema_version|platforms|radar|collection)[\"']?\s*:")
_IS_PART = re.compile(rb"(?m)^[\"']?kind[\"']?\s*:")
_SETTINGS = "pyproject.toml"


class _ReadFiles:
    """The files of the disk, and the real paths of those that were read."""

    def __init__(self) -> None:
        self.read: set[str] = set()

    def content(self, file: str, most: int, called: str | None = None) -> bytes:
        """Content of a file; arguments and `UnreadableError` are those of `resources.Files`."""
        self.read.add(os.path.realpath(file))
        return DISK.content(file, most, called)

    def names(self, folder: str) -> list[str]:
        """Names of the files in a folder."""
        return DISK.names(folder)


def touched_missions(changed: Sequence[str]) -> list[str]:
    """List the missions below the current folder that a change of files touches, sorted.

    A mission is a YAML file with the sections of one, or below a folder `missions`. The settings of a
    `pyproject.toml` touch every mission below its folder. One that names files and cannot be read is touched: a file
    that is gone is in no list of changes.
    """
    paths = {os.path.realpath(file) for file in changed}
    tops = [os.path.join(os.path.dirname(path), "") for path in paths if os.path.basename(path) == _SETTINGS]
    found = dict.fromkeys(file for file in changed if _is_mission(file))
    for file in _missions_below(os.curdir):
        real = os.path.realpath(file)
        if real in paths or real.startswith(tuple(tops)) or _reads_any(file, paths):
            found.setdefault(file)
    unique = {os.path.realpath(file): os.path.relpath(file) for file in found}
    return sorted(unique.values())


def _missions_below(top: str) -> Iterator[str]:
    for folder, folders, names in os.walk(top):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        yield from (file for name in names if _is_mission(file := os.path.join(folder, name)))


def _is_mission(file: str) -> bool:
    if not file.endswith(_SUFFIXES):
        return False
    try:
        data = DISK.content(file, MAX_BYTES, file)
    except UnreadableError:
        return True  # a check says why
    parts = os.path.relpath(file).replace(os.sep, "/").split("/")
    return bool(_IS_MISSION.search(data)) or (_FOLDER in parts[:-1] and not _IS_PART.search(data))


def _reads_any(file: str, paths: set[str]) -> bool:
    """Whether a mission reads one of some files, or names files and cannot be used."""
    folder, files = folder_of(file), _ReadFiles()
    try:
        data = DISK.content(file, MAX_BYTES, file)
        parse_mission(data, file, None, reader_of(folder, files), find=finder_of(folder, files))
    except UnreadableError:
        return True
    except MissionError:
        try:
            return names_files(read_tree(data, file).root)
        except MissionError:
            return False  # no YAML: it was so before
    return not paths.isdisjoint(files.read)
