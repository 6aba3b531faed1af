"""A mission file as it stood in a git revision."""

import os
from subprocess import DEVNULL, PIPE, run

from bisar_budget.faults import printable
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.model import Mission
from bisar_budget.paths.flight import PathFileError


class RevisionError(Exception):
    """No such file in no such revision, or no repository; the message says which."""


def file_at(path: str, revision: str) -> bytes:
    """Content of a file as committed in `revision`: a branch, tag or commit. Links are followed within that revision.

    Raises
    ------
    RevisionError
        Git is not there, the file is in no repository, the revision is unknown or has no such file, or has a link
        that leads nowhere or out of the repository.
    """
    folder, name = os.path.split(os.path.abspath(path))
    if not os.path.isdir(folder):
        raise RevisionError(f"{path}: there is no folder {folder}")
    if not _git(folder, "rev-parse", "--git-dir")[0]:
        raise RevisionError(f"{path} is not in a git repository")
    # What starts with a dash would be an option to git.
    is_known, commit = (
        (False, b"")
        if revision.startswith("-")
        else _git(folder, "rev-parse", "--verify", "--quiet", f"{revision}^{{commit}}")
    )
    if not is_known:
        raise RevisionError(f"the repository of {path} has no revision {printable(revision)}")
    asked = os.fsencode(f"{commit.decode().strip()}:./{name}")
    is_read, answer = (
        (False, b"")  # git reads one name from each line
        if b"\n" in asked
        else _git(folder, "cat-file", "--batch", "--follow-symlinks", given=asked + b"\n")
    )
    head, _, rest = answer.partition(b"\n")
    words = head.split()
    if is_read and words[1:2] == [b"blob"]:
        return rest[: int(words[2])]
    raise RevisionError(f"{path} {_why_not(words, rest)} revision {printable(revision)}")


def _why_not(words: list[bytes], rest: bytes) -> str:
    """What git says instead of a file: `symlink` with the way out of the tree, or why a link has no end."""
    if words[:1] == [b"symlink"]:
        outside = printable(os.fsdecode(rest.removesuffix(b"\n")))
        return f"is a link out of the repository, to {outside}, in"
    if words[:1] in ([b"dangling"], [b"loop"], [b"notdir"]):
        return "is a link that leads nowhere in"
    return "is not in"


def mission_at(path: str, revision: str) -> Mission:
    """Read a mission file as committed in `revision`, and the orbits and logs that it names as committed there.

    Raises
    ------
    RevisionError
        As `file_at`.
    MissionError
        Not a usable mission then.
    """

    def beside(name: str) -> bytes:
        try:
            return file_at(os.path.join(os.path.dirname(path), name), revision)
        except RevisionError as error:
            raise PathFileError(str(error)) from None

    return parse_mission(file_at(path, revision), f"{revision}:{path}", beside=beside)


def _git(folder: str, *arguments: str, given: bytes = b"") -> tuple[bool, bytes]:
    # A folder can have the files of a bare repository among those that are committed: its revisions, its settings.
    command = ["git", "-c", "safe.bareRepository=explicit", "-C", folder, *arguments]
    try:
        done = run(command, input=given, stdout=PIPE, stderr=DEVNULL, check=False)
    except OSError:
        raise RevisionError("git cannot be run; --base needs it") from None
    except ValueError:  # a NUL in the name
        return False, b""
    return done.returncode == 0, done.stdout
