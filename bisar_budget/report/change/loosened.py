"""Things that a change loosens: a mission may meet its requirements because it is held to less of them.

Numbers do not show it: a requirement that is gone has no row, and an error that is gone uses nothing of its limit.
"""

import math
from collections.abc import Iterator, Mapping
from fnmatch import fnmatchcase
from typing import Any, NamedTuple

from bisar_budget.effects.effect import MOTION, PLATFORMS
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.requirement import NAMES
from bisar_budget.findings.row import Row
from bisar_budget.mission.model import Mission, Requirements, Waiver
from bisar_budget.report.change.inputs import dotted, written
from bisar_budget.settings import TABLE

_SUMS = (*NAMES, "autofocus_pull_in")  # kinds of rows that are no error
_COMPUTED = ("oscillator", "spatial_variance")  # the file states no such number: a zero is a result
# Each asks for more than the one before it.
_RULES = {"combine": ("each", "rss", "sum"), "model": ("published", "full", "strictest")}

_NAMED = ("other", "random")  # kinds of error of which a file may state several, each with a name
_NUMBERS = (("autofocus", "n_pull", 1), ("allocation", "coverage_factor", -1), ("allocation", "warn_above", 1))


class Loosened(NamedTuple):
    """One thing that holds a mission less than before: its id for `--allow`, and how it was and is.

    The id is a key of the mission file, the id of a row, or the kind of an error.
    """

    id: str
    before: str
    after: str

    @property
    def words(self) -> str:
        """The change in words, before and after, for a gate that refuses it."""
        return f"{self.before} -> {self.after}"


def loosenings(before: MissionFindings, after: MissionFindings) -> Iterator[Loosened]:
    """List what the second of two findings holds less than the first; both carry their mission."""
    missions = (before.analysed().mission, after.analysed().mission)
    yield from _requirements(*missions)
    yield from _declarations(*missions)
    yield from _rules(before, after)
    yield from _waivers(*missions)
    yield from _waived_rows(before, after)
    yield from _errors(before, after)
    yield from _sources(before, after)


def loosened_settings(before: Mapping[str, Any], after: Mapping[str, Any]) -> Iterator[Loosened]:
    """List what the settings of a project hold less than before: `strict` that is gone, `exit-zero` that came."""
    for key, holds in (("strict", True), ("exit-zero", False)):
        old, new = (values.get(key, False) for values in (before, after))
        if old is holds and new is not holds:
            yield Loosened(f"{TABLE}.{key}", *("true" if one else "false" for one in (old, new)))


def _requirements(before: Mission, after: Mission) -> Iterator[Loosened]:
    """Requirements that are gone or larger."""
    for key in Requirements._fields:
        old, new = (getattr(mission.requirements, key) for mission in (before, after))
        if key != "declare" and old is not None and (new is None or _is_above(new, old)):
            path = ("requirements", key)
            yield Loosened(dotted(path), _said(before, path, old), _said(after, path, new))


def _declarations(before: Mission, after: Mission) -> Iterator[Loosened]:
    """Errors that the file has to declare no more, by the words that asked for them."""
    still = {one for asked in after.requirements.declare for one in _owned(asked)}
    for asked in before.requirements.declare:
        left = still.intersection(_owned(asked))
        if len(left) < len(_owned(asked)):
            yield Loosened(f"requirements.declare.{asked}", asked, ", ".join(sorted(left)) or "none")


def _owned(asked: str) -> list[str]:
    """Kinds that a word of `declare` asks for, with their platform."""
    return [asked] if "." in asked or asked == "timing" else [f"{name}.{asked}" for name in PLATFORMS]


def _rules(before: MissionFindings, after: MissionFindings) -> Iterator[Loosened]:
    """Autofocus, coverage, reserve, model and combination that ask for less."""
    missions = (before.analysed().mission, after.analysed().mission)
    for section, key, sign in _NUMBERS:
        old, new = (getattr(getattr(mission, section), key) for mission in missions)
        if new is not None and (old is None or _is_above(sign * new, sign * old)):
            path = (section, key)
            yield Loosened(dotted(path), _said(missions[0], path, old), _said(missions[1], path, new))
    if missions[0].allocation.split != missions[1].allocation.split:
        yield from _shares(before, after)
    words = {"combine": (before.combine, after.combine), "model": (before.model, after.model)}
    for key, (old_rule, new_rule) in words.items():
        if _RULES[key].index(new_rule) < _RULES[key].index(old_rule):
            yield Loosened(f"allocation.{key}", old_rule, new_rule)


def _shares(before: MissionFindings, after: MissionFindings) -> Iterator[Loosened]:
    """Reserves that are smaller, and shares that grow by more than their reserve gave."""
    for metric, key in (("qpe", "quadratic_phase_error"), ("pslr", "pslr"), ("islr", "islr")):
        old, new = (getattr(found.allocation, metric) for found in (before, after))
        if _is_above(old.reserve, new.reserve):
            yield Loosened(f"allocation.split.{key}.reserve", f"{old.reserve:.4g}", f"{new.reserve:.4g}")
        given = max(0.0, old.reserve - new.reserve)
        for owner in PLATFORMS if new.clock is None else (*PLATFORMS, "clock"):
            if _is_above(new.of(owner), old.of(owner) + given):
                yield Loosened(f"allocation.split.{key}.{owner}", f"{old.of(owner):.4g}", f"{new.of(owner):.4g}")


def _waivers(before: Mission, after: Mission) -> Iterator[Loosened]:
    """Waivers that are new, last longer, or name more rows."""
    for waiver in after.waivers:
        covering = [one for one in before.waivers if _names_as_much(one, waiver)]
        if not any(one.until >= waiver.until for one in covering):
            was = max((one.until for one in covering), default=None)
            old = "not waived" if was is None else f"waived until {was.isoformat()}"
            yield Loosened(waiver.id, old, f"waived until {waiver.until.isoformat()}")


def _names_as_much(old: Waiver, new: Waiver) -> bool:
    """Whether an earlier waiver names every row that one names; of a pattern in brackets nothing is said."""
    is_one_row = not any(char in new.id for char in "*?[")
    # A star of the old one takes wildcards of the new one too, and what stands beside the star is in both.
    is_part = "[" not in new.id and not any(char in old.id for char in "?[")
    return old.id == new.id or ((is_one_row or is_part) and fnmatchcase(new.id, old.id))


def _waived_rows(before: MissionFindings, after: MissionFindings) -> Iterator[Loosened]:
    """Rows and requirements that a waiver keeps from failing, and did not."""
    named = {waiver.id for waiver in _waivers(before.analysed().mission, after.analysed().mission)}
    for of in ("rows", "requirements"):
        old: Mapping[str, Any] = {one.id: one for one in getattr(before, of)}
        for one in getattr(after, of):
            was = old[one.id].status if one.id in old else "none"
            if one.status == "waived" != was and one.id not in named:
                yield Loosened(one.id, was.replace("_", " "), "waived")


def _errors(before: MissionFindings, after: MissionFindings) -> Iterator[Loosened]:
    """Errors that the file declares no more, or as zero; of motion along whatever axes."""
    old, new = _declared(before), _declared(after)
    for name in dict.fromkeys(_error(row) for row in before.rows if row.declared is not None and row.is_independent):
        if name.rpartition(".")[2] in _SUMS:
            continue
        if name not in new:
            yield Loosened(name, "declared", "not declared")
        elif old[name] and not new[name]:
            yield Loosened(name, "declared", "zero")


def _declared(found: MissionFindings) -> dict[str, bool]:
    """Errors that a file declares, and whether as more than zero along any axis."""
    declared: dict[str, bool] = {}
    for row in found.rows:
        if row.declared is not None:
            name = _error(row)
            is_more = row.declared != 0 or row.subject.kind in _COMPUTED
            declared[name] = declared.get(name, False) or is_more
    return declared


def _error(row: Row) -> str:
    """Name of the error that a row is about, without its axis."""
    return row.id.rpartition(".")[0] if row.subject.kind in MOTION else row.id


def _sources(before: MissionFindings, after: MissionFindings) -> Iterator[Loosened]:
    """Kinds of error that state their source no more; of those with a name each by its own."""
    had = set(before.kinds.declared) - set(before.kinds.without_source)
    gone = [kind for kind in after.kinds.without_source if kind in had and kind.rpartition(".")[2] not in _NAMED]
    old, new = (_named_sources(found.analysed().mission) for found in (before, after))
    gone += [name for name, source in new.items() if old.get(name) and not source]
    for name in gone:
        yield Loosened(f"{name}.source", "stated", "none")


def _named_sources(mission: Mission) -> dict[str, str | None]:
    """Source of each error that has a name of its own, by the id of its row."""
    sources = {f"other.{one.name}": one.source for one in mission.other_errors}
    for platform in PLATFORMS:
        error = getattr(mission.platforms, platform).motion_error
        evidence = error.evidence("random")
        sources |= {f"{platform}.random.{one.name}": one.source or evidence for one in error.random}
    return sources


def _is_above(one: float, other: float) -> bool:
    """Whether by more than reading the same value from another unit makes."""
    return one > other and not math.isclose(one, other, rel_tol=1e-9)


def _said(mission: Mission, path: tuple[str, ...], value: float | None) -> str:
    if value is None:
        return "none"
    default = f"{math.degrees(value):g} deg" if path[-1] == "quadratic_phase_error" else f"{value:g}"
    return written(mission).get(path, f"{default} (default)")
