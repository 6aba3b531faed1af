"""Colours of a report, light and dark, by their name: what its style sheet says, for drawings that stand alone."""

import re
from collections.abc import Mapping, Sequence
from functools import cache

from bisar_budget.findings.status import STATUS
from bisar_budget.resources import resource

ROWS = ("transmitter", "receiver", "clock", "pass", "mission", "doubt", "reserve")  # of curves, in their order
EMPTY = "reserve"  # of what is no mission


@cache
def light() -> Mapping[str, str]:
    """Colours on white paper."""
    return _colours()[0]


@cache
def dark() -> Mapping[str, str]:
    """Colours on a dark screen."""
    return _colours()[1]


def _colours() -> Sequence[Mapping[str, str]]:
    sheet = resource("templates", "report.css").read_text(encoding="utf-8")
    blocks = sheet.split("}", 2)[:2]
    return [dict(re.findall(r"--([\w-]+): (#[0-9a-f]{3,6})", block)) for block in blocks]


def has_no_mission(status: str) -> bool:
    """Whether a status says that there was nothing to check."""
    return STATUS[status].junit == "error"


def tone_of(status: str) -> str:
    """Name of the colour of a status."""
    return EMPTY if has_no_mission(status) else STATUS[status].color


def status_words(status: str) -> str:
    """The words of a legend for a status."""
    return "no such mission" if has_no_mission(status) else STATUS[status].words


def strengths(statuses: Sequence[str], parts: Sequence[float]) -> Mapping[str, float]:
    """The part of each status: of those that share a colour the first, the worst, has the first of `parts`."""
    used: dict[str, int] = {}
    found: dict[str, float] = {}
    for name in statuses:
        count = used.get(tone_of(name), 0)
        used[tone_of(name)] = count + 1
        found[name] = parts[min(count, len(parts) - 1)]
    return found
