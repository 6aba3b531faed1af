"""The statuses of rows, missions and runs, with their effect on the verdict and their names in every format.

A new status needs one entry here, and a rule that assigns it (`budget.judged_rows`).
"""

from collections.abc import Container, Iterable, Mapping
from typing import NamedTuple


class Status(NamedTuple):
    """One status, with the properties that all output formats need, so that no format has its own list of statuses.

    `gates` tells whether the status of a row can become the status of its mission. `fails` and `fails_strict` tell
    whether the status makes a run, or a strict run, fail. `is_judged` tells whether a row counts as judged, even if
    the comparison with a requirement was not possible. `is_met` tells whether the requirement is met. `is_explained`
    tells whether reports give the reason for the status. `sarif` and `github` are levels of findings; if a level is
    empty, the status is not reported as a finding in that format. `junit` is the outcome of a test case: failure,
    skipped, passed, or passed with a remark. `verdict` is the verdict on a mission in a compliance report. `sgr` is
    the colour on a terminal (ECMA-48), `color` is the colour on a page, and `symbol` is the mark before the status.
    """

    name: str
    text: str  # on a terminal, at most 8 letters
    words: str  # on a page
    gates: bool = False
    fails: bool = False
    fails_strict: bool = False
    is_judged: bool = False
    is_met: bool = False
    is_explained: bool = False
    sarif: str = ""
    github: str = ""
    junit: str = "passed"
    junit_words: str = ""
    verdict: str = ""
    sgr: str = "0"
    color: str = "mission"
    symbol: str = "open square"

    @property
    def is_held(self) -> bool:
        """Whether a number was compared with a limit, so that there is a verdict, and this verdict is not waived."""
        return self.is_judged and not self.junit_words

    @property
    def complies(self) -> bool:
        """Whether all requirements were judged and are met, with or without warnings; `waived` does not comply."""
        return self.is_held and not self.fails


# Worst first. A waived row breaks its requirement: it breaks no run, and is worse than any row that meets it.
_STATUSES_WORST_FIRST = (
    Status(
        "error", "ERROR", "unusable",
        gates=True, junit="error", verdict="Cannot be judged",
        sgr="1;31", color="fail", symbol="square",
    ),
    Status(
        "fail", "FAIL", "fail",
        gates=True, fails=True, fails_strict=True, is_judged=True, is_explained=True,
        sarif="error", github="error", junit="failure", verdict="Does not comply",
        sgr="1;31", color="fail", symbol="square",
    ),
    Status(
        "not_evaluated", "NOT EVAL", "not evaluated",
        gates=True, fails=True, fails_strict=True, is_judged=True, is_explained=True,
        sarif="error", github="error", junit="failure", junit_words="not evaluated",
        verdict="Not shown to comply", sgr="35", color="doubt", symbol="diamond",
    ),
    Status(
        "waived", "waived", "waived",
        gates=True, is_judged=True, is_explained=True,
        sarif="error", github="notice", junit="skipped", junit_words="waived",
        verdict="Not met; accepted by waiver", sgr="36", color="doubt", symbol="open square",
    ),
    Status(
        "warn", "WARN", "warning",
        gates=True, fails_strict=True, is_judged=True, is_explained=True,
        sarif="warning", github="warning", junit="remark", verdict="Complies, with warnings",
        sgr="33", color="doubt", symbol="diamond",
    ),
    Status(
        "pass_with_autofocus", "pass AF", "pass with autofocus",
        gates=True, is_judged=True, is_met=True,
        sarif="note", github="notice", junit="remark", verdict="Complies, with autofocus",
        sgr="32", color="pass", symbol="circle",
    ),
    Status(
        "pass", "pass", "pass",
        gates=True, is_judged=True, is_met=True, verdict="Complies", sgr="32", color="pass", symbol="circle",
    ),
    Status("info", "info", "info", junit="skipped", junit_words="computed, not judged"),
    Status("not_declared", "not decl", "not declared", junit="skipped", junit_words="not declared", sgr="2"),
)  # fmt: skip
STATUS = {status.name: status for status in _STATUSES_WORST_FIRST}
RANK = {name: place for place, name in enumerate(STATUS)}  # the worst status has the lowest rank
BROKEN = tuple(name for name, one in STATUS.items() if one.fails)  # a waiver covers them
# In the order of summaries: statuses that a mission can have, then statuses that gate nothing.
STATUSES = tuple(sorted(STATUS, key=lambda name: not STATUS[name].gates))


def worst(statuses: Iterable[str]) -> str:
    """Return the worst status in `statuses`; statuses that a mission cannot have are ignored.

    The result is `pass` if `statuses` contains no status that a mission can have.
    """
    return min((name for name in statuses if STATUS[name].gates), key=RANK.__getitem__, default="pass")


def complying(counts: Mapping[str, int]) -> int:
    """Number of missions that comply; `counts` has the number of missions with each status.

    Waived missions do not comply.
    """
    return sum(count for name, count in counts.items() if STATUS[name].complies)


def exit_code(statuses: Container[str], strict: bool) -> int:
    """Return the exit code of a run: 2 if a file is unusable, 1 if a requirement is not met or not judged, else 0.

    With `strict`, the code is also 1 for warnings.
    """
    if "error" in statuses:
        return 2
    breaks = (one.name for one in _STATUSES_WORST_FIRST if one.fails or (strict and one.fails_strict))
    return 1 if any(name in statuses for name in breaks) else 0
