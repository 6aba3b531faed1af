"""What a mission names, read once and taken along: to processes on machines that do not have its files."""

from collections.abc import Sequence
from contextlib import suppress
from hashlib import sha256
from typing import NamedTuple

from bisar_budget.faults import MissionError, SetValue
from bisar_budget.mission.load import folder_of, parse_mission
from bisar_budget.mission.model import Mission


class Named(NamedTuple):
    """Name and content of orbits and logs; name, file and content of parts."""

    paths: tuple[tuple[str, bytes], ...] = ()
    parts: tuple[tuple[str, str, bytes], ...] = ()

    def parse(self, data: bytes, file: str, model: str | None = None, *, changes: Sequence[SetValue] = ()) -> Mission:
        """Read a mission that names nothing else; arguments and faults are those of `parse_mission`."""
        paths = dict(self.paths)
        parts = {name: (of, content) for name, of, content in self.parts}
        return parse_mission(data, file, model, paths.__getitem__, changes, parts.__getitem__)

    @property
    def sha256(self) -> str:
        """Hash of all names and contents; empty where nothing is named."""
        if not (self.paths or self.parts):
            return ""
        whole = sha256()
        for name, content in (*self.paths, *((name, content) for name, _, content in self.parts)):
            for piece in (name.encode("utf-8", "surrogatepass"), content):
                whole.update(sha256(piece).digest())
        return whole.hexdigest()


def named_by(mission: Mission, also: Sequence[SetValue] = ()) -> tuple[Mission, Named]:
    """Read a mission anew, and all that it names.

    Parameters
    ----------
    mission : Mission
        As loaded.
    also : sequence of SetValue
        Values that the mission may get: what it names with each of them is read too.

    Returns
    -------
    tuple of Mission and Named
        The mission by what its files say now, and their content.

    Raises
    ------
    MissionError
        A file has changed since, and is none that can be used.
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
    again = parse_mission(mission.data, mission.file, model, beside, mission.changes, find)
    for change in also:
        with suppress(MissionError):  # there is none with it, which is said where it is asked for
            parse_mission(mission.data, mission.file, model, beside, (*mission.changes, change), find)
    named = Named(tuple(sorted(paths.items())), tuple((name, *of) for name, of in sorted(parts.items())))
    return again, named
