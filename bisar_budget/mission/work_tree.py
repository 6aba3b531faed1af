"""State of the git repository that contains a mission file: its commit, and which files differ from the commit."""

import os
from collections.abc import Mapping, Sequence
from typing import NamedTuple

_GIT_TIMEOUT_S = 10.0
# Git sets these variables for hooks. With them, git would use another repository or another top folder.
VARIABLES_OF_HOOKS = ("GIT_DIR", "GIT_WORK_TREE", "GIT_COMMON_DIR", "GIT_NAMESPACE", "GIT_PREFIX")
# The repository may not run a program, and an embedded bare repository may not replace it. Files are not locked.
_GIT_COMMAND = (
    *("git", "--no-optional-locks", "-c", "core.fsmonitor=false", "-c", "safe.bareRepository=explicit"),
    *("-c", "status.relativePaths=false", "-c", "core.quotePath=false"),
)


class WorkTree(NamedTuple):
    """The commit that is checked out in the git repository of a mission, and files that differ from it.

    `commit` is the hash of the commit. It is empty if there is no commit; `reason` then tells why. `changed` lists
    the changed files of the repository. Of the files that the mission reads, `changed_inputs` lists the changed
    files, and `new_inputs` lists the files that were never committed.
    """

    commit: str = ""
    reason: str = ""
    changed: tuple[str, ...] = ()
    changed_inputs: tuple[str, ...] = ()
    new_inputs: tuple[str, ...] = ()

    @property
    def is_clean(self) -> bool:
        """Whether there is a commit, and all committed files and all inputs of the mission are as committed."""
        return bool(self.commit) and not self.changed and not self.new_inputs


_UNREAD = "in a git repository that git does not read"
_NOT_IN_REPOSITORY = WorkTree(reason="not in a git repository")


def work_trees(inputs: Mapping[str, Sequence[str]]) -> dict[str, WorkTree]:
    """Return the state of the git repository of each mission file, by the path of the file.

    `inputs` maps the path of each mission file to the paths of the other files that it reads. All paths are absolute
    or relative to the current folder. `-` means standard input, which is in no repository.
    """
    states: dict[str, WorkTree] = {}
    tops: dict[str, str] = {}
    for file, input_paths in inputs.items():
        try:
            folder = os.path.dirname(os.path.realpath(file))
        except ValueError:  # the name has a NUL
            folder = ""
        if not folder or file == "-" or not _is_below_git(folder):
            states[file] = _NOT_IN_REPOSITORY
            continue
        if folder not in tops:
            is_read, top = _git(folder, "rev-parse", "--show-toplevel")
            tops[folder] = top.removesuffix("\n") if is_read else ""
            states.setdefault(tops[folder], _state(tops[folder]) if is_read else WorkTree(reason=top or _UNREAD))
        state = states[tops[folder]]
        states[file] = _with_inputs(state, tops[folder], [file, *input_paths]) if state.commit else state
    return {file: states[file] for file in inputs}


def _state(top: str) -> WorkTree:
    """State of the repository with the top folder `top`; the inputs of the mission are not considered."""
    is_read, commit = _git(top, "rev-parse", "--verify", "--quiet", "HEAD^{commit}")
    if not is_read:
        return WorkTree(reason=commit or "in a git repository without a commit")
    is_read, listed = _git(top, "status", "--porcelain=v1", "-z", "--no-renames", "--untracked-files=no")
    if not is_read:
        return WorkTree(reason=listed or _UNREAD)
    return WorkTree(commit.strip(), changed=tuple(sorted(entry[3:] for entry in listed.split("\0") if entry)))


def _with_inputs(state: WorkTree, top: str, files: Sequence[str]) -> WorkTree:
    """Add the inputs `files` of a mission to the state of its repository; files outside the repository are ignored.

    A file that was only added to the index counts as changed.
    """
    start = os.path.join(top, "")
    names = {
        path.removeprefix(start).replace(os.sep, "/")
        for path in map(os.path.realpath, files)
        if path.startswith(start)
    }
    if not names:
        return state
    _, tracked = _git(top, "--literal-pathspecs", "ls-files", "-z", "--", *sorted(names))
    return state._replace(
        changed_inputs=tuple(sorted(names.intersection(state.changed))),
        new_inputs=tuple(sorted(names.difference(tracked.split("\0"), state.changed))),
    )


def _is_below_git(folder: str) -> bool:
    """Whether a folder, or a folder above it, contains `.git`. If not, git need not be run."""
    while not os.path.lexists(os.path.join(folder, ".git")):
        above = os.path.dirname(folder)
        if above == folder:
            return False
        folder = above
    return True


def _git(folder: str, *arguments: str) -> tuple[bool, str]:
    """Run git in a folder; return whether it succeeded, and its output, or the reason why git could not be run."""
    from subprocess import TimeoutExpired, run  # a check to a terminal does not need it

    variables = {name: value for name, value in os.environ.items() if name not in VARIABLES_OF_HOOKS}
    variables |= {"LC_ALL": "C", "GIT_TERMINAL_PROMPT": "0"}
    try:
        done = run(
            [*_GIT_COMMAND, "-C", folder, *arguments],
            capture_output=True, check=False, env=variables, timeout=_GIT_TIMEOUT_S,
        )  # fmt: skip
    except OSError:
        return False, "in a git repository, but git cannot be run"
    except TimeoutExpired:
        return False, "in a git repository, but git gives no answer in time"
    if b"dubious ownership" in done.stderr:
        return False, "in a git repository of another owner, which git does not read"
    return done.returncode == 0, os.fsdecode(done.stdout)
