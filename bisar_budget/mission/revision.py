"""A mission file as it stood in a git revision, with all that it names: parts, settings, orbits, logs."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from subprocess import run

from bisar_budget.faults import printable
from bisar_budget.mission.load import folder_of, parse_mission
from bisar_budget.mission.model import Mission
from bisar_budget.mission.parts import finder_of
from bisar_budget.mission.paths import reader_of
from bisar_budget.mission.tree import MAX_BYTES
from bisar_budget.resources import DISK, UnreadableError

# Modes of an entry that is a commit of another repository, and of a link.
_SUBMODULE, _LINK = b"160000", b"120000"
# Left by a hook, they would put another repository, or another top, in the place of that of the missions.
_OF_ANOTHER = ("GIT_DIR", "GIT_WORK_TREE", "GIT_COMMON_DIR", "GIT_NAMESPACE", "GIT_PREFIX")


class RevisionError(Exception):
    """No repository, no such revision, or no such file in it; the message says which."""


class Revision:
    """The files of a git repository as committed in a branch, tag or commit.

    The repository is that of the current folder where the path is in it, else its own: a folder that became a
    submodule since does not answer for itself. Links are followed within the revision, submodules are read at the
    commit that it names. A file outside of the repository has one version, that on the disk; `outside` lists those
    that were read.

    Parameters
    ----------
    near : str
        A path within the repository; it need not exist any more.
    name : str
        The revision.

    Raises
    ------
    RevisionError
        Git is not there, the path is in no repository, or the revision is unknown.
    """

    def __init__(self, near: str, name: str) -> None:
        self.name = name
        self.outside: list[str] = []
        self.top, said = _top(os.curdir)
        if not self.top or self._inside(near) is None:
            self.top, said = _top(_existing(near)[0])
        if not self.top:
            raise RevisionError(f"{near} {said or 'is not in a git repository'}")
        # What starts with a dash would be an option to git.
        is_known, commit, _ = (
            (False, b"", "")
            if name.startswith("-")
            else _git(self.top, "rev-parse", "--verify", "--quiet", f"{name}^{{commit}}")
        )
        if not is_known:
            raise RevisionError(f"the repository of {near} has no revision {printable(name)}")
        self._commit = commit.decode().strip()
        self._known: dict[str, _Object] = {}
        self._listed: dict[str, list[str]] = {}

    def content(self, file: str, most: int, called: str | None = None) -> bytes:
        """Content of a file then; arguments and `UnreadableError` are those of `resources.Files`."""
        called = file if called is None else called
        inside = self._inside(file)
        if inside is None:
            data = DISK.content(file, most, called)
            self.outside.append(file)
            return data
        found = self._object(inside)
        if found.kind == b"blob":
            return found.content[: most + 1]
        raise UnreadableError(f"{called} {_why_not(found)} revision {printable(self.name)}", is_missing=True)

    def names(self, folder: str) -> list[str]:
        """Names of the files in a folder then, sorted; `OSError` where there was none."""
        inside = self._inside(folder)
        if inside is None:
            return DISK.names(folder)
        found = self._object(inside)
        if found.kind != b"tree":
            raise FileNotFoundError(folder)
        if found.hash not in self._listed:
            _, names, _ = _git(found.top, "ls-tree", "-z", "--name-only", found.hash)
            self._listed[found.hash] = sorted(os.fsdecode(name) for name in names.split(b"\0") if name)
        return self._listed[found.hash]

    def has(self, file: str) -> bool:
        """Whether there was such a file; raises `RevisionError` where the revision alone does not tell."""
        inside = self._inside(file)
        found = _Object(b"missing") if inside is None else self._object(inside)
        if found.kind in (b"symlink", b"submodule"):
            raise RevisionError(f"{file} {_why_not(found)} revision {printable(self.name)}")
        return found.kind == b"blob"

    def matching(self, pattern: str) -> list[str]:
        """Files of the revision that a name or a glob pattern names from the current folder, sorted."""
        inside = self._inside(pattern)
        if inside is None:
            return []
        wanted = inside.split("/")
        write = str if os.path.isabs(pattern) else os.path.relpath
        files = self._files(wanted, _Object(b"tree", hash=self._commit, top=self.top))
        return sorted(write(os.path.join(self.top, file)) for file in files if _matches(file.split("/"), wanted))

    def _files(self, wanted: Sequence[str], tree: "_Object", above: str = "", way: tuple[str, ...] = ()) -> list[str]:
        """Paths of the files below a tree, in submodules and linked folders that a pattern may look into too."""
        _, entries, _ = _git(tree.top, "ls-tree", "-r", "-z", tree.hash)
        files = []
        for entry in filter(None, entries.split(b"\0")):
            head, _, name = entry.partition(b"\t")
            file = above + os.fsdecode(name)
            if head.startswith((_SUBMODULE, _LINK)) and _leads_to(file.split("/"), wanted):
                found = self._object(file)
                if found.kind == b"tree" and found.hash not in way:  # a link to a folder above itself
                    files += self._files(wanted, found, f"{file}/", (*way, tree.hash, found.hash))
                    continue
            files.append(file)
        return files

    def path_of(self, file: str) -> str:
        """Path of a file from the top of the repository, with forward slashes; of one outside as given."""
        return self._inside(file) or file

    def _inside(self, path: str) -> str | None:
        """Path from the top of the repository, with forward slashes; None for what is outside.

        Links below the top are left to the revision, which may have others.
        """
        folder, rest = _existing(path)
        real = os.path.join(os.path.realpath(folder), rest)
        for whole in (os.path.abspath(path), real):
            above, below = whole, os.curdir
            while True:
                if os.path.isdir(above) and os.path.samefile(above, self.top):
                    return below.replace(os.sep, "/")
                above, name = os.path.split(above)
                if not name:
                    break
                below = name if below == os.curdir else os.path.join(name, below)
        return None

    def _object(self, inside: str) -> "_Object":
        """Find what stands at a path; of nothing what git says instead. Settings and parts are asked for again."""
        found = self._known.get(inside)
        if found is None:
            found = _object(self.top, self._commit, inside)
            if len(found.content) <= MAX_BYTES:  # a log may be large, and is read once
                self._known[inside] = found
        return found


def _matches(parts: Sequence[str], pattern: Sequence[str]) -> bool:
    """Whether the parts of a path are those of a pattern, as `glob.glob` has it: `**` is any folders."""
    if not pattern:
        return not parts
    is_open = bool(parts) and (not parts[0].startswith(".") or pattern[0].startswith("."))
    if pattern[0] == "**":
        return _matches(parts, pattern[1:]) or (is_open and _matches(parts[1:], pattern))
    is_name = bool(parts) and (parts[0] == pattern[0] or (is_open and fnmatchcase(parts[0], pattern[0])))
    return is_name and _matches(parts[1:], pattern[1:])


def _leads_to(folder: Sequence[str], pattern: Sequence[str]) -> bool:
    """Whether a pattern may name files below a folder."""
    start = pattern[: len(folder)]
    return "**" in start or (len(folder) < len(pattern) and _matches(folder, start))


def _top(folder: str) -> tuple[str, str]:
    """Top of the repository of a folder, empty where there is none, and what git says of it."""
    is_found, top, said = _git(folder, "rev-parse", "--show-toplevel")
    return (os.fsdecode(top).rstrip("\r\n") if is_found else ""), said


@dataclass(frozen=True)
class _Object:
    """An object of git: its kind, its content, its hash, and the folder of its repository."""

    kind: bytes
    content: bytes = b""
    hash: str = ""
    top: str = ""


_MISSING = _Object(b"missing")


def _object(top: str, commit: str, inside: str) -> _Object:
    """Find what stands at a path of a commit, in submodules too."""
    if "\n" in inside:
        return _object_of_lines(top, commit, inside)
    asked = os.fsencode(f"{commit}:{'' if inside == os.curdir else inside}")
    is_read, answer, _ = _git(top, "cat-file", "--batch", "--follow-symlinks", given=asked + b"\n")
    head, _, rest = answer.partition(b"\n")
    words = head.split()
    if is_read and words[1:2] in ([b"blob"], [b"tree"]):
        return _Object(words[1], rest[: int(words[2])], words[0].decode(), top)
    if words[:1] == [b"symlink"]:
        return _Object(words[0], rest.removesuffix(b"\n"))
    parts = inside.split("/")
    for length in range(1, len(parts) + 1):
        module = "/".join(parts[:length])
        _, entry, _ = _git(top, "ls-tree", "-z", commit, "--", module)
        if entry.startswith(_SUBMODULE):
            below = "/".join(parts[length:]) or os.curdir
            folder, its_commit = os.path.join(top, module), entry.split()[2].decode()
            is_here, _, _ = _git(folder, "cat-file", "-e", its_commit)
            return _object(folder, its_commit, below) if is_here else _Object(b"submodule")
    return _Object(words[0] if words else b"missing")


def _object_of_lines(top: str, commit: str, inside: str) -> _Object:
    """Find what stands at a path with a line end, which `cat-file` cannot be asked for, by its hash.

    Neither links nor submodules are followed: what is one, or below one, is said to be.
    """
    parts = inside.split("/")
    for length in range(1, len(parts) + 1):
        path = "/".join(parts[:length])
        _, listed, _ = _git(top, "ls-tree", "-z", commit, "--", path)
        head, _, name = listed.partition(b"\0")[0].partition(b"\t")
        if name != os.fsencode(path):
            break
        mode, kind, hash = head.split()
        if mode == _SUBMODULE:
            return _Object(b"submodule")
        if mode == _LINK or length == len(parts):
            is_read, content, _ = _git(top, "cat-file", kind.decode(), hash.decode())
            return (
                _Object(b"symlink" if mode == _LINK else kind, content, hash.decode(), top) if is_read else _MISSING
            )
    return _MISSING


def _existing(path: str) -> tuple[str, str]:
    """The nearest folder of a path that exists, and the rest of it."""
    folder, rest = os.path.split(os.path.abspath(path))
    while not os.path.isdir(folder) and folder != os.path.dirname(folder):
        folder, name = os.path.split(folder)
        rest = os.path.join(name, rest)
    return folder, rest


def _why_not(found: _Object) -> str:
    """Return why git gives no file: `symlink` with the way out of the tree, or why a link has no end."""
    if found.kind == b"symlink":
        return f"is a link out of the repository, to {printable(os.fsdecode(found.content))}, in"
    if found.kind == b"submodule":
        return "is in a submodule whose commit is not here (`git submodule update --init`), in"
    if found.kind in (b"dangling", b"loop", b"notdir"):
        return "is a link that leads nowhere in"
    return "is a folder in" if found.kind == b"tree" else "is not in"


def mission_at(path: str, revision: Revision, model: str | None = None) -> Mission:
    """Read a mission file as committed in `revision`, with the parts, settings, orbits and logs of then.

    `model` stands in for the file's own.

    Raises
    ------
    RevisionError
        It is not there.
    MissionError
        Not a usable mission then.
    """
    try:
        data = revision.content(path, MAX_BYTES)
    except UnreadableError as error:
        raise RevisionError(str(error)) from None
    folder = folder_of(path)
    beside, find = reader_of(folder, revision), finder_of(folder, revision)
    return parse_mission(data, f"{revision.name}:{path}", model, beside, find=find)


def _git(folder: str, *arguments: str, given: bytes = b"") -> tuple[bool, bytes, str]:
    """Whether git did it, what it wrote, and what it refuses that has nothing to do with what was asked."""
    # A folder can have the files of a bare repository among those that are committed: its revisions, its settings.
    command = ["git", "-c", "safe.bareRepository=explicit", "-C", folder, *arguments]
    variables = {name: value for name, value in os.environ.items() if name not in _OF_ANOTHER}
    try:
        done = run(command, input=given, capture_output=True, check=False, env=variables)
    except OSError:
        raise RevisionError("git cannot be run; --base needs it") from None
    except ValueError:  # a NUL in the name
        return False, b"", ""
    is_distrusted = b"dubious ownership" in done.stderr
    words = "is in a repository of another owner, which git does not read; `git config safe.directory` lets it"
    return done.returncode == 0, done.stdout, words if is_distrusted else ""
