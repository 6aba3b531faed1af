"""Search for the missions that are affected by changed files.

A mission is affected if its own file, or a file that it reads, has changed.
"""

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
_FOLDER = "missions"  # every YAML file below such a folder is a mission, except parts
_IS_MISSION = re.compile(rb"(?m)^[\"']?(?:schema_version|platforms|radar|collection)[\"']?\s*:")
_IS_PART = re.compile(rb"(?m)^[\"']?kind[\"']?\s*:")
_SETTINGS_FILE = "pyproject.toml"


class _ReadFiles:
    """Reader of files on disk; `read` holds the real paths of all files read so far."""

    def __init__(self) -> None:
        self.read: set[str] = set()

    def content(self, file: str, most: int, called: str | None = None) -> bytes:
        """Return the content of a file. Arguments and exceptions are the same as for `resources.Files.content`."""
        self.read.add(os.path.realpath(file))
        return DISK.content(file, most, called)

    def names(self, folder: str) -> list[str]:
        """Names of the files in a folder."""
        return DISK.names(folder)


def touched_missions(changed: Sequence[str]) -> list[str]:
    """Return the sorted paths of the missions that the changed files affect.

    These are the missions among the files `changed`, and missions that read one of these files. All missions below
    the current folder are examined. A mission is a YAML file with the sections of a mission, or any YAML file below a
    folder `missions` that does not describe a part. A changed `pyproject.toml` affects every mission below its
    folder. An unusable mission that names other files is always listed, because it may name a deleted file, and
    deleted files may be missing from the list of changed files.
    """
    paths = {os.path.realpath(file) for file in changed}
    tops = [os.path.join(os.path.dirname(path), "") for path in paths if os.path.basename(path) == _SETTINGS_FILE]
    files = dict.fromkeys(file for file in changed if _is_mission(file))
    for file in _missions_below(os.curdir):
        real = os.path.realpath(file)
        if real in paths or real.startswith(tuple(tops)) or _reads_any(file, paths):
            files.setdefault(file)
    unique = {os.path.realpath(file): os.path.relpath(file) for file in files}
    return sorted(unique.values())


def _missions_below(top: str) -> Iterator[str]:
    """Yield the mission files in a folder and its subfolders, except in hidden folders."""
    for folder, folders, names in os.walk(top):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        yield from (file for name in names if _is_mission(file := os.path.join(folder, name)))


def _is_mission(file: str) -> bool:
    """Whether a YAML file is a mission, judged by its sections or its folder; true if the file cannot be read."""
    if not file.endswith(_SUFFIXES):
        return False
    try:
        data = DISK.content(file, MAX_BYTES, file)
    except UnreadableError:
        return True  # listed, so that its check reports the reason
    parts = os.path.relpath(file).replace(os.sep, "/").split("/")
    return bool(_IS_MISSION.search(data)) or (_FOLDER in parts[:-1] and not _IS_PART.search(data))


def _reads_any(file: str, paths: set[str]) -> bool:
    """Whether reading the mission `file` involves reading one of the files `paths`.

    The result is also true for an unusable mission that names other files, because a change of these files may be the
    reason why it is unusable.
    """
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
            return False  # the file is no valid YAML, whatever the other files
    return not paths.isdisjoint(files.read)
