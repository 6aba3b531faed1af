"""A mission file and the files that it uses (parts, settings, orbits, logs), as committed in a git revision."""

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
from bisar_budget.mission.work_tree import VARIABLES_OF_HOOKS
from bisar_budget.resources import DISK, UnreadableError

# Modes of tree entries: a submodule, and a symbolic link.
_SUBMODULE, _LINK = b"160000", b"120000"


class RevisionError(Exception):
    """No repository, no such revision, or no such file in it; the message says which."""


class Revision:
    """The files of a git repository as committed in a branch, tag or commit.

    If the path `near` is in the repository of the current folder, this repository is read; otherwise the repository
    that contains the path is read. A folder that became a submodule only after the revision is therefore read from
    the enclosing repository. Links are followed within the revision. Submodules are read at the commit that the
    revision records. A file outside the repository is read from the disk; `outside` lists all such files that were
    read.

    Parameters
    ----------
    near : str
        A path within the repository; it need not exist any longer.
    name : str
        Name of the revision: a branch, a tag or a commit.

    Raises
    ------
    RevisionError
        Git is not installed, the path is in no repository, or the revision is unknown.
    """

    def __init__(self, near: str, name: str) -> None:
        self.name = name
        self.outside: list[str] = []
        self.top, refusal = _top(os.curdir)
        if not self.top or self._inside(near) is None:
            self.top, refusal = _top(_existing(near)[0])
        if not self.top:
            raise RevisionError(f"{near} {refusal or 'is not in a git repository'}")
        # Git would take a name that starts with a dash as an option.
        is_known, commit, _ = (
            (False, b"", "")
            if name.startswith("-")
            else _git(self.top, "rev-parse", "--verify", "--quiet", f"{name}^{{commit}}")
        )
        if not is_known:
            raise RevisionError(f"the repository of {near} has no revision {printable(name)}")
        self._commit = commit.decode().strip()
        self._objects: dict[str, _Object] = {}
        self._names_by_tree: dict[str, list[str]] = {}

    def content(self, file: str, most: int, called: str | None = None) -> bytes:
        """Content of a file as committed in the revision.

        Arguments and errors are the same as in `resources.Files`.
        """
        called = file if called is None else called
        inside = self._inside(file)
        if inside is None:
            data = DISK.content(file, most, called)
            self.outside.append(file)
            return data
        git_object = self._object(inside)
        if git_object.kind == b"blob":
            return git_object.content[: most + 1]
        raise UnreadableError(f"{called} {_why_not(git_object)} revision {printable(self.name)}", is_missing=True)

    def names(self, folder: str) -> list[str]:
        """Sorted names of the entries of a folder in the revision; raises `OSError` if there is no such folder."""
        inside = self._inside(folder)
        if inside is None:
            return DISK.names(folder)
        git_object = self._object(inside)
        if git_object.kind != b"tree":
            raise FileNotFoundError(folder)
        if git_object.hash not in self._names_by_tree:
            _, names, _ = _git(git_object.top, "ls-tree", "-z", "--name-only", git_object.hash)
            self._names_by_tree[git_object.hash] = sorted(os.fsdecode(name) for name in names.split(b"\0") if name)
        return self._names_by_tree[git_object.hash]

    def has(self, file: str) -> bool:
        """Whether the revision contains a file at the path `file`.

        Raises `RevisionError` for a link that leads out of the repository, and for a submodule that is not on this
        machine.
        """
        inside = self._inside(file)
        git_object = _Object(b"missing") if inside is None else self._object(inside)
        if git_object.kind in (b"symlink", b"submodule"):
            raise RevisionError(f"{file} {_why_not(git_object)} revision {printable(self.name)}")
        return git_object.kind == b"blob"

    def matching(self, pattern: str) -> list[str]:
        """Sorted paths of the files in the revision that match a name or a glob pattern.

        The pattern and the paths are relative to the current folder, or absolute if the pattern is absolute.
        """
        inside = self._inside(pattern)
        if inside is None:
            return []
        pattern_parts = inside.split("/")
        write = str if os.path.isabs(pattern) else os.path.relpath
        files = self._files(pattern_parts, _Object(b"tree", hash=self._commit, top=self.top))
        return sorted(
            write(os.path.join(self.top, file)) for file in files if _matches(file.split("/"), pattern_parts)
        )

    def _files(
        self, pattern: Sequence[str], tree: "_Object", above: str = "", way: tuple[str, ...] = ()
    ) -> list[str]:
        """List the paths of all files in a folder of the revision.

        A submodule or a linked folder is entered only if the pattern may match files in it. `pattern` is the pattern
        split at slashes, and `tree` is the git object of the folder. `above` is the path of the folder with a slash
        at its end. `way` contains the hashes of the parent folders, which are used to detect circular links.
        """
        _, entries, _ = _git(tree.top, "ls-tree", "-r", "-z", tree.hash)
        files = []
        for entry in filter(None, entries.split(b"\0")):
            head, _, name = entry.partition(b"\t")
            file = above + os.fsdecode(name)
            if head.startswith((_SUBMODULE, _LINK)) and _leads_to(file.split("/"), pattern):
                git_object = self._object(file)
                if git_object.kind == b"tree" and git_object.hash not in way:  # a link to a folder above itself
                    files += self._files(pattern, git_object, f"{file}/", (*way, tree.hash, git_object.hash))
                    continue
            files.append(file)
        return files

    def path_of(self, file: str) -> str:
        """Path of a file relative to the top folder of the repository, with forward slashes.

        The path of a file outside of the repository is returned unchanged.
        """
        return self._inside(file) or file

    def _inside(self, path: str) -> str | None:
        """Path relative to the top folder of the repository, with forward slashes; None for a path outside of it.

        Links inside the repository are not resolved here, because they may differ between the revision and the disk.
        """
        folder, remainder = _existing(path)
        real = os.path.join(os.path.realpath(folder), remainder)
        for full_path in (os.path.abspath(path), real):
            above, below = full_path, os.curdir
            while True:
                if os.path.isdir(above) and os.path.samefile(above, self.top):
                    return below.replace(os.sep, "/")
                above, name = os.path.split(above)
                if not name:
                    break
                below = name if below == os.curdir else os.path.join(name, below)
        return None

    def _object(self, inside: str) -> "_Object":
        """Git object at a path relative to the top folder of the repository.

        If the revision has no such file or folder, the `kind` of the object tells why. The object is kept for the
        next call if its content has at most `MAX_BYTES` bytes.
        """
        git_object = self._objects.get(inside)
        if git_object is None:
            git_object = _object(self.top, self._commit, inside)
            if len(git_object.content) <= MAX_BYTES:  # a log may be large, and is read once
                self._objects[inside] = git_object
        return git_object


def _matches(parts: Sequence[str], pattern: Sequence[str]) -> bool:
    """Whether a path matches a glob pattern under the rules of `glob.glob`; `**` matches any number of folders.

    Both the path and the pattern are split at slashes.
    """
    if not pattern:
        return not parts
    is_open = bool(parts) and (not parts[0].startswith(".") or pattern[0].startswith("."))
    if pattern[0] == "**":
        return _matches(parts, pattern[1:]) or (is_open and _matches(parts[1:], pattern))
    is_name = bool(parts) and (parts[0] == pattern[0] or (is_open and fnmatchcase(parts[0], pattern[0])))
    return is_name and _matches(parts[1:], pattern[1:])


def _leads_to(folder: Sequence[str], pattern: Sequence[str]) -> bool:
    """Whether a glob pattern may match files below a folder; both are split at slashes."""
    start = pattern[: len(folder)]
    return "**" in start or (len(folder) < len(pattern) and _matches(folder, start))


def _top(folder: str) -> tuple[str, str]:
    """Top folder of the git repository that contains `folder`, and the reason if git refuses to read the repository.

    The top folder is empty if there is no repository. The reason is empty if git does not refuse.
    """
    is_found, top, refusal = _git(folder, "rev-parse", "--show-toplevel")
    return (os.fsdecode(top).rstrip("\r\n") if is_found else ""), refusal


@dataclass(frozen=True)
class _Object:
    """A git object: its kind, its content, its hash, and the folder of its repository."""

    kind: bytes
    content: bytes = b""
    hash: str = ""
    top: str = ""


_MISSING_OBJECT = _Object(b"missing")


def _object(top: str, commit: str, inside: str) -> _Object:
    """Git object at a path in a commit of the repository at `top`; the path may lead into submodules.

    If there is no such file or folder, the `kind` of the object tells why.
    """
    if "\n" in inside:
        return _object_of_lines(top, commit, inside)
    request = os.fsencode(f"{commit}:{'' if inside == os.curdir else inside}")
    is_read, answer, _ = _git(top, "cat-file", "--batch", "--follow-symlinks", stdin=request + b"\n")
    head, _, content = answer.partition(b"\n")
    words = head.split()
    if is_read and words[1:2] in ([b"blob"], [b"tree"]):
        return _Object(words[1], content[: int(words[2])], words[0].decode(), top)
    if words[:1] == [b"symlink"]:
        return _Object(words[0], content.removesuffix(b"\n"))
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
    """Git object at a path that contains a line break, which `git cat-file --batch` does not accept.

    The object is found by its hash. Links and submodules are not followed. If the path is a link or a submodule, or
    is inside one, the kind of the object is "symlink" or "submodule".
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
                _Object(b"symlink" if mode == _LINK else kind, content, hash.decode(), top)
                if is_read
                else _MISSING_OBJECT
            )
    return _MISSING_OBJECT


def _existing(path: str) -> tuple[str, str]:
    """Nearest existing folder above a path on the disk, and the remainder of the path."""
    folder, remainder = os.path.split(os.path.abspath(path))
    while not os.path.isdir(folder) and folder != os.path.dirname(folder):
        folder, name = os.path.split(folder)
        remainder = os.path.join(name, remainder)
    return folder, remainder


def _why_not(git_object: _Object) -> str:
    """Phrase that tells why a git object cannot be read as a file.

    In a message, the phrase is put between the name of the file and the name of the revision.
    """
    if git_object.kind == b"symlink":
        return f"is a link out of the repository, to {printable(os.fsdecode(git_object.content))}, in"
    if git_object.kind == b"submodule":
        return "is in a submodule whose commit is not here (`git submodule update --init`), in"
    if git_object.kind in (b"dangling", b"loop", b"notdir"):
        return "is a link that leads nowhere in"
    return "is a folder in" if git_object.kind == b"tree" else "is not in"


def mission_at(path: str, revision: Revision, model: str | None = None) -> Mission:
    """Read a mission file as committed in `revision`; parts, settings, orbits and logs are read from it as well.

    `model` is the model that decides the verdicts; it replaces the model that the file names.

    Raises
    ------
    RevisionError
        The revision has no such file.
    MissionError
        The file in the revision is not a usable mission.
    """
    try:
        data = revision.content(path, MAX_BYTES)
    except UnreadableError as error:
        raise RevisionError(str(error)) from None
    folder = folder_of(path)
    path_reader, find = reader_of(folder, revision), finder_of(folder, revision)
    return parse_mission(data, f"{revision.name}:{path}", model, path_reader, find=find)


def _git(folder: str, *arguments: str, stdin: bytes = b"") -> tuple[bool, bytes, str]:
    """Run git in a folder; return whether it succeeded, its output, and the reason for a refusal.

    The reason is empty unless git refuses to read a repository that belongs to another user.
    """
    # Committed files can look like a bare repository, with revisions and settings; git must not use them.
    command = ["git", "-c", "safe.bareRepository=explicit", "-C", folder, *arguments]
    variables = {name: value for name, value in os.environ.items() if name not in VARIABLES_OF_HOOKS}
    try:
        done = run(command, input=stdin, capture_output=True, check=False, env=variables)
    except OSError:
        raise RevisionError("git cannot be run; --base needs it") from None
    except ValueError:  # a NUL in the name
        return False, b"", ""
    is_distrusted = b"dubious ownership" in done.stderr
    words = "is in a repository of another owner, which git does not read; `git config safe.directory` lets it"
    return done.returncode == 0, done.stdout, words if is_distrusted else ""
