"""Names that a mission and its findings keep wherever the command runs: ids of needs, fingerprints, test cases.

A mission is named by the number of its document, else by its path within its repository, else by the file's name.
The path is that of the file itself: given from the root of the repository, from a folder, absolutely or through a
symbolic link, it is one.
"""

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from bisar_budget.findings.mission import MissionFindings, UnusableMission
from bisar_budget.report import Style

_STANDARD_INPUT = "standard input"


class Identity(NamedTuple):
    """Name of a mission, which no other file of the run has, and the path by which reports name its file.

    `shared` are requirement ids, each with a row, that would name findings of other missions of the run too.
    """

    name: str
    path: str
    shared: frozenset[tuple[str, str]] = frozenset()

    def of(self, subject: str, requirement_id: str | None = None) -> tuple[str, ...]:
        """Parts of the name of a row or requirement: the project's own requirement id, else the mission, and it."""
        if requirement_id is None:
            return self.name, subject
        if (requirement_id, subject) in self.shared:
            return requirement_id, self.name, subject
        return requirement_id, subject


def identities(missions: Sequence[MissionFindings | UnusableMission], style: Style) -> list[Identity]:
    """Name every mission of a run; no name depends on the order in which they were given.

    Missions that share a document number have their path beside it. Files that share a path, in different
    repositories or in none, have as many folders before it as tell them apart.
    """
    places = [_place(mission.file, style) for mission in missions]
    files = [place.file for place in places]
    paths = _told_apart({place.file: place.portable_path for place in places})
    names = dict(paths)
    for mission, file in zip(missions, files, strict=True):
        if isinstance(mission, MissionFindings) and mission.document.number:
            names[file] = mission.document.number
    while alike := _alike(names):
        names |= {file: f"{names[file]}/{paths[file]}" for file in alike}
    shared = _shared_requirements(missions, files, names)
    return [Identity(names[place.file], place.portable_path, shared) for place in places]


def digest(*parts: str) -> str:
    """Digest of a name, the same on every machine, also of half a character, which the name of a file may have."""
    from hashlib import sha256  # loads OpenSSL: 5 ms, and a check to a terminal does without

    return sha256("\0".join(parts).encode(errors="surrogatepass")).hexdigest()


def distinct(spelled: Sequence[str], names: Sequence[tuple[str, ...]]) -> list[str]:
    """Spellings of names in a smaller alphabet; one that several names share has a digest of the name behind it."""
    uses = Counter(word for word, _ in set(zip(spelled, names, strict=True)))
    return [
        word if uses[word] == 1 else f"{word}_{digest(*name)[:8].upper()}"
        for word, name in zip(spelled, names, strict=True)
    ]


def stem(name: str) -> str:
    """Name of a mission without the ending of its file."""
    return name.removesuffix(".yaml").removesuffix(".yml")


def source_path(file: str, style: Style) -> str:
    """Path by which a mission file is found: within its repository, else below `style.root`, else absolute.

    With forward slashes; without a root the file is named as given.
    """
    if not style.root or file == "-":
        return file.replace(os.sep, "/")
    place = _place(file, style)
    if place.is_in_repository:
        return place.portable_path
    for name in (os.path.abspath(file), place.file):
        if path := _below(name, style.root):
            return path.replace(os.sep, "/")
    return os.path.abspath(file).replace(os.sep, "/")


class _FilePlace(NamedTuple):
    """Absolute path of a file, links followed, and the path that is the same on every machine, with forward slashes.

    That is within the repository, else the name of the file alone.
    """

    file: str
    portable_path: str
    is_in_repository: bool = False


def _place(file: str, style: Style) -> _FilePlace:
    """Find a file and the Git work tree that holds it.

    A link is followed. Where that leads out of every work tree, to a store of large files such as git-annex has in
    `.git`, the link itself is the file of the repository. One that leads to no file is that of a pipe.
    """
    if file == "-":
        return _FilePlace(_STANDARD_INPUT, _STANDARD_INPUT)
    if not style.root or "\0" in file:  # which no file has in its name
        return _FilePlace(file, file.replace(os.sep, "/"))
    link = os.path.join(os.path.realpath(os.path.dirname(file)), os.path.basename(file))
    target = os.path.realpath(file)
    if not os.path.exists(target):
        target = link
    for path in dict.fromkeys((target, link)):
        root = _work_tree(os.path.dirname(path), style)
        below = _below(path, root) if root else ""
        if below and not below.startswith(f".git{os.sep}"):
            return _FilePlace(path, below.replace(os.sep, "/"), is_in_repository=True)
    return _FilePlace(target, os.path.basename(target))


def _work_tree(folder: str, style: Style) -> str:
    """Nearest folder from here up with a `.git` (in worktrees and submodules a file), or GitHub's checkout."""
    while not (os.path.lexists(os.path.join(folder, ".git")) or (style.is_checkout and folder == style.root)):
        above = os.path.dirname(folder)
        if above == folder:
            return ""
        folder = above
    return folder


def _below(file: str, folder: str) -> str:
    """Path of a file from a folder that it lies in, however deep; empty if it does not."""
    start = os.path.join(folder, "")
    return file[len(start) :] if file.startswith(start) else ""


def _alike(names: Mapping[str, str]) -> list[str]:
    """Files that have not a name of their own."""
    uses = Counter(names.values())
    return [file for file, name in names.items() if uses[name] > 1]


def _told_apart(paths: Mapping[str, str]) -> dict[str, str]:
    """Put folders before the paths that several files have, until no two files have one; whole paths differ."""
    names, added = dict(paths), 0
    while alike := _alike(names):
        added += 1
        names |= {file: _with_folders(file, paths[file], added) for file in alike}
    return names


def _with_folders(file: str, path: str, count: int) -> str:
    """Path of a file with so many of the folders that stand before it."""
    whole = file.replace(os.sep, "/")
    parts, length = whole.strip("/").split("/"), path.count("/") + 1 + count
    return "/".join(parts[-length:]) if length <= len(parts) else whole


def _shared_requirements(
    missions: Sequence[MissionFindings | UnusableMission], files: Sequence[str], names: Mapping[str, str]
) -> frozenset[tuple[str, str]]:
    """Requirement ids with their row that stand in several files, or that are the name of a mission too."""
    used = {
        (row.requirement_id, row.id, file)
        for mission, file in zip(missions, files, strict=True)
        if isinstance(mission, MissionFindings)
        for row in mission.rows
        if row.requirement_id is not None
    }
    uses = Counter((requirement_id, row_id) for requirement_id, row_id, _ in used)
    taken = set(names.values())
    return frozenset(pair for pair, count in uses.items() if count > 1 or pair[0] in taken)
