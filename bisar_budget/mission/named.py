"""Files that a mission names, read once and taken along: to processes on machines that do not have them."""

from collections.abc import Sequence
from contextlib import suppress
from hashlib import sha256
from typing import NamedTuple

from bisar_budget.faults import MissionError, SetValue
from bisar_budget.mission.load import folder_of, mission_of, parse_mission
from bisar_budget.mission.model import Mission
from bisar_budget.mission.tree import Tree


class Named(NamedTuple):
    """Name and content of orbits and logs; name, file and content of parts."""

    paths: tuple[tuple[str, bytes], ...] = ()
    parts: tuple[tuple[str, str, bytes], ...] = ()

    def parse(
        self, tree: Tree, data: bytes, file: str, model: str | None = None, *, changes: Sequence[SetValue] = ()
    ) -> Mission:
        """Read a mission that names nothing else; arguments and faults are those of `mission_of`."""
        parts = {name: (of, content) for name, of, content in self.parts}
        return mission_of(tree, data, file, model, dict(self.paths).__getitem__, changes, parts.__getitem__)

    @property
    def sha256(self) -> str:
        """Hash of all names and contents; empty where nothing is named."""
        parts = ((name, content) for name, _, content in self.parts)
        each = [(name, sha256(content).hexdigest()) for name, content in (*self.paths, *parts)]
        return sha256(ascii(each).encode()).hexdigest() if each else ""


def named_by(mission: Mission, also: Sequence[SetValue] = ()) -> Named:
    """Read all that a mission names, and what it names with each of some values that it may get.

    Raises
    ------
    MissionError
        A file has changed since the mission was loaded, and is none that can be used.
    """
    from bisar_budget.mission.parts import finder_of
    from bisar_budget.mission.paths import reader_of

    folder = folder_of(mission.file)
    read, found = reader_of(folder), finder_of(folder)
    paths: dict[str, bytes] = {}
    parts: dict[str, tuple[str, bytes]] = {}

    def beside(name: str) -> bytes:
        paths[name] = read(name)
        return paths[name]

    def find(name: str) -> tuple[str, bytes]:
        parts[name] = found(name)
        return parts[name]

    model = mission.allocation.model  # --model may stand in for one of the file that is none
    parse_mission(mission.data, mission.file, model, beside, mission.changes, find)
    for change in also:
        with suppress(MissionError):  # there is none with it, which is said where it is asked for
            parse_mission(mission.data, mission.file, model, beside, (*mission.changes, change), find)
    return Named(tuple(sorted(paths.items())), tuple((name, *of) for name, of in sorted(parts.items())))
