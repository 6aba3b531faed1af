"""The statuses of rows, missions and runs: what each gates, and how every format says it.

One line here is all that a new status needs, besides the rule that gives it (`budget.judged_rows`).
"""

from collections.abc import Container, Iterable, Mapping
from typing import NamedTuple


class Status(NamedTuple):
    """One status. Formats are told apart by fields: none holds a list of statuses of its own.

    `gates` is whether a mission can have it. `fails` and `fails_strict` are whether it breaks a run. `is_judged` is
    whether a requirement was held to a number or could not be; `is_met`, that it is met; `is_explained`, that its
    reason decides something. `sarif` and `github` are levels, empty: not a finding there. `junit` is the outcome of a
    test case: failure, skipped, passed, or passed with a remark. `verdict` is what a compliance report says of a
    mission. `sgr` is its colour on a terminal (ECMA-48), `color` that on a page, and `symbol` the mark before it.
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
        """Whether a number was held to a limit and the outcome stands: neither waived nor without a value."""
        return self.is_judged and not self.junit_words

    @property
    def complies(self) -> bool:
        """Whether all was judged and is met, with warnings or without; a waiver meets nothing."""
        return self.is_held and not self.fails


# Worst first. What is waived breaks its requirement: it breaks no run, and is worse than all that meets one.
_WORST_FIRST = (
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
STATUS = {status.name: status for status in _WORST_FIRST}
RANK = {name: place for place, name in enumerate(STATUS)}  # the worst has the lowest
BROKEN = tuple(name for name, one in STATUS.items() if one.fails)  # a waiver covers them
# In the order of summaries: what a mission can have, then what gates nothing.
STATUSES = tuple(sorted(STATUS, key=lambda name: not STATUS[name].gates))


def worst(statuses: Iterable[str]) -> str:
    """Return the worst of the statuses that gate; `pass` if there is none."""
    return min((name for name in statuses if STATUS[name].gates), key=RANK.__getitem__, default="pass")


def complying(counts: Mapping[str, int]) -> int:
    """Number of missions that comply, by the number of each status; those that are waived do not."""
    return sum(count for name, count in counts.items() if STATUS[name].complies)


def exit_code(statuses: Container[str], strict: bool) -> int:
    """Return 2 if a file is unusable, 1 if a requirement is broken or not judged, else 0; `strict`: on doubt too."""
    if "error" in statuses:
        return 2
    breaks = (one.name for one in _WORST_FIRST if one.fails or (strict and one.fails_strict))
    return 1 if any(name in statuses for name in breaks) else 0
