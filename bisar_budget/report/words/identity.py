"""Name a mission and its findings in a way that does not depend on the current folder or the machine.

The names are used as ids of needs (requirement items of Sphinx-Needs) and test cases, and for fingerprints. The name
of a mission is the number of its document. If there is none, it is the path of its file within the repository, or
else the file name. A relative path, an absolute path and a symbolic link to the same file all give the same name.
"""

import os
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from bisar_budget.findings.mission import MissionFindings, UnusableMission
from bisar_budget.mission.model import id_of_requirement
from bisar_budget.report import Style

_STANDARD_INPUT = "standard input"


class Identity(NamedTuple):
    """Name of a mission, unique among the files of a run, and the path of its file in reports.

    `shared` holds pairs of a requirement id and a row id that identify a finding only if the mission name is added.
    """

    name: str
    path: str
    shared: frozenset[tuple[str, str]] = frozenset()

    def of(self, subject: str, requirement_id: str | None = None) -> tuple[str, ...]:
        """Unique name of a row or requirement: its first requirement id in the project, and its own id `subject`.

        If the project assigns no requirement id, the mission name is used instead. If the pair of ids is in `shared`,
        the mission name is inserted between them.
        """
        if requirement_id is None:
            return self.name, subject
        if (requirement_id, subject) in self.shared:
            return requirement_id, self.name, subject
        return requirement_id, subject


def identities(missions: Sequence[MissionFindings | UnusableMission], style: Style) -> list[Identity]:
    """Identities of the missions of a run. The names do not depend on the order of the missions.

    If several missions have the same document number, the path is appended to the number. If several files have the
    same path, because they are in different repositories or in no repository, parent folders are added until the
    paths differ.
    """
    locations = [_locate(mission.file, style) for mission in missions]
    files = [location.file for location in locations]
    paths = _with_distinct_folders({location.file: location.portable_path for location in locations})
    names = dict(paths)
    for mission, file in zip(missions, files, strict=True):
        if isinstance(mission, MissionFindings) and mission.document.number:
            names[file] = mission.document.number
    while alike := _alike(names):
        names |= {file: f"{names[file]}/{paths[file]}" for file in alike}
    shared = _shared_requirements(missions, files, names)
    return [Identity(names[location.file], location.portable_path, shared) for location in locations]


def digest(*items: str) -> str:
    """SHA-256 digest of the parts of a name. It is the same on every machine.

    File names that are not valid UTF-8 are accepted.
    """
    from hashlib import sha256  # OpenSSL takes 5 ms to load; a check to a terminal does not need it

    return sha256("\0".join(items).encode(errors="surrogatepass")).hexdigest()


def distinct(spellings: Sequence[str], names: Sequence[tuple[str, ...]]) -> list[str]:
    """Make the spellings of `names` unique. If several names have the same spelling, a digest is appended to each."""
    uses = Counter(spelling for spelling, _ in set(zip(spellings, names, strict=True)))
    return [
        spelling if uses[spelling] == 1 else f"{spelling}_{digest(*name)[:8].upper()}"
        for spelling, name in zip(spellings, names, strict=True)
    ]


def stem(name: str) -> str:
    """Name of a mission without the extension of its file."""
    return name.removesuffix(".yaml").removesuffix(".yml")


def source_path(file: str, style: Style) -> str:
    """Path of a mission file in a report: relative to its repository, or else to `style.root`, or else absolute.

    The path has forward slashes. If `style.root` is empty, the path is returned as given.
    """
    if not style.root or file == "-":
        return file.replace(os.sep, "/")
    location = _locate(file, style)
    if location.is_in_repository:
        return location.portable_path
    for name in (os.path.abspath(file), location.file):
        if path := _below(name, style.root):
            return path.replace(os.sep, "/")
    return os.path.abspath(file).replace(os.sep, "/")


class _FileLocation(NamedTuple):
    """Absolute path of a file with links resolved, and a path that is the same on every machine.

    `portable_path` has forward slashes. It is the path within the repository, or else the name of the file.
    """

    file: str
    portable_path: str
    is_in_repository: bool = False


def _locate(file: str, style: Style) -> _FileLocation:
    """Find the location of a file, and whether a Git work tree contains it.

    Links are resolved. If the target is outside every work tree, for example in the store of git-annex in `.git`, the
    link itself is located. A link whose target does not exist, such as the link to a pipe in `/proc`, is not
    resolved.
    """
    if file == "-":
        return _FileLocation(_STANDARD_INPUT, _STANDARD_INPUT)
    if not style.root or "\0" in file:  # no name of a file has a NUL
        return _FileLocation(file, file.replace(os.sep, "/"))
    link = os.path.join(os.path.realpath(os.path.dirname(file)), os.path.basename(file))
    target = os.path.realpath(file)
    if not os.path.exists(target):
        target = link
    for path in dict.fromkeys((target, link)):
        root = _work_tree(os.path.dirname(path), style)
        below = _below(path, root) if root else ""
        if below and not below.startswith(f".git{os.sep}"):
            return _FileLocation(path, below.replace(os.sep, "/"), is_in_repository=True)
    return _FileLocation(target, os.path.basename(target))


def _work_tree(folder: str, style: Style) -> str:
    """Nearest folder, from `folder` upwards, that contains `.git` or is the checkout of a GitHub workflow.

    Empty if there is no such folder. In worktrees and submodules `.git` is a file.
    """
    while not (os.path.lexists(os.path.join(folder, ".git")) or (style.is_checkout and folder == style.root)):
        above = os.path.dirname(folder)
        if above == folder:
            return ""
        folder = above
    return folder


def _below(file: str, folder: str) -> str:
    """Path of a file relative to a folder above it; empty if the file is not below the folder."""
    start = os.path.join(folder, "")
    return file[len(start) :] if file.startswith(start) else ""


def _alike(names: Mapping[str, str]) -> list[str]:
    """Return the files that have the same name in `names` as another file. The keys of `names` are files."""
    uses = Counter(names.values())
    return [file for file, name in names.items() if uses[name] > 1]


def _with_distinct_folders(paths: Mapping[str, str]) -> dict[str, str]:
    """Prepend parent folders to equal paths until all paths differ.

    This always succeeds, because absolute paths differ.
    """
    names, added = dict(paths), 0
    while alike := _alike(names):
        added += 1
        names |= {file: _with_folders(file, paths[file], added) for file in alike}
    return names


def _with_folders(file: str, path: str, count: int) -> str:
    """Path of a file that contains `count` more parent folders than `path`."""
    full_path = file.replace(os.sep, "/")
    folders, length = full_path.strip("/").split("/"), path.count("/") + 1 + count
    return "/".join(folders[-length:]) if length <= len(folders) else full_path


def _own_ids(mission: MissionFindings) -> Iterator[tuple[str, str]]:
    """Yield the id of each row and requirement to which the project assigns requirement ids.

    Each id is paired with the first of these requirement ids.
    """
    for requirement in mission.requirements:
        if requirement.requirement_ids:
            yield id_of_requirement(requirement.key), requirement.requirement_ids[0]
    yield from ((row.id, row.requirement_ids[0]) for row in mission.rows if row.requirement_ids)


def _shared_requirements(
    missions: Sequence[MissionFindings | UnusableMission], files: Sequence[str], names: Mapping[str, str]
) -> frozenset[tuple[str, str]]:
    """Return the pairs of requirement id and row id that are unique only together with the mission name.

    A pair is not unique by itself if it occurs in several files, or if its requirement id equals the name of a
    mission.
    """
    used = {
        (own_id, subject, file)
        for mission, file in zip(missions, files, strict=True)
        if isinstance(mission, MissionFindings)
        for subject, own_id in _own_ids(mission)
    }
    uses = Counter((requirement_id, row_id) for requirement_id, row_id, _ in used)
    taken = set(names.values())
    return frozenset(pair for pair, count in uses.items() if count > 1 or pair[0] in taken)
