"""Effects of a change on missions: what goes in, what it loosens, how much of each limit it erodes, and a gate."""

import math
from collections.abc import Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from operator import attrgetter
from typing import Any, NamedTuple

from bisar_budget.constants import GATING_MODELS, UTILIZATION_TOLERANCE
from bisar_budget.effects.effect import MOTION, PLATFORMS
from bisar_budget.faults import Changed, KeyPath
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.row import Row
from bisar_budget.findings.status import STATUS
from bisar_budget.mission.changes import parts_of
from bisar_budget.mission.model import Mission, Requirements, Waiver
from bisar_budget.mission.parts import figure_text
from bisar_budget.report.change.fallen_effects import SUMS, fallen_effects
from bisar_budget.report.change.lost_doubts import lost_doubts
from bisar_budget.report.words.sentences import dotted, percent
from bisar_budget.settings import TABLE


# ---------------------------------------------------------------------- what goes in
class Moved(NamedTuple):
    """A value before and after: of a key as the files write it, or of the geometry; None where there is none."""

    name: str
    unit: str  # of a number; empty: text
    before: str | float | None
    after: str | float | None


def moved_inputs(before: Mission, after: Mission) -> Iterator[Moved]:
    """Keys that the files write differently and mean differently: `31 km` is 31000 m."""
    old, new = written(before), written(after)
    for path in {**old, **new}:
        if old.get(path) == new.get(path):
            continue
        meant = [_value(mission, path) for mission in (before, after)]
        if path in old and path in new and meant[0] is not None and meant[0] == meant[1]:
            continue
        yield Moved(dotted(path), "", old.get(path), new.get(path))
    for name in PLATFORMS:
        files = [getattr(mission.platforms, name).path for mission in (before, after)]
        if None not in files and files[0].file == files[1].file and files[0].sha256 != files[1].sha256:
            contents = [file.sha256 and file.sha256[:12] for file in files]
            yield Moved(f"platforms.{name}: content of {files[1].file}", "", *contents)
        before_, after_ = ({} if file is None else file.beside for file in files)
        for said in before_.keys() & after_.keys():
            old_one, new_one = before_[said], after_[said]
            if old_one and new_one and old_one[0] == new_one[0] and old_one[1] != new_one[1]:
                contents = [digest[:12] for _, digest in (old_one, new_one)]
                yield Moved(f"platforms.{name}: content of {new_one[0]}", "", *contents)


def written(mission: Mission) -> dict[KeyPath, str]:
    """Values as the file writes them, or a part that it names, by path; a list of plain values is one."""
    texts = {
        path: event.value for path, event in mission.places.items() if isinstance(getattr(event, "value", None), str)
    }
    for taken in mission.taken:
        texts[tuple(taken.key.split("."))] = f"{figure_text(taken.value)} (part {taken.part})"
    texts |= dict(_set_values(mission))
    lists: dict[KeyPath, list[str]] = {}
    elements = [path for path in texts if isinstance(path[-1], int)]
    for path in sorted(elements, key=lambda path: int(path[-1])):  # an element that was set stands last
        lists.setdefault(path[:-1], []).append(texts.pop(path))
    return texts | {path: f"[{', '.join(items)}]" for path, items in lists.items()}


def _set_values(mission: Mission) -> Iterator[tuple[KeyPath, str]]:
    """Values that options put into it, by path; below a key that is new, by the path that the option named."""
    changed = {".".join(map(str, path)): path for path, event in mission.places.items() if isinstance(event, Changed)}
    for change in mission.changes:
        parts = parts_of(change.key)
        yield changed.get(".".join(parts), parts), change.text


def _value(mission: Mission, path: KeyPath) -> Any:
    """The value at a path; None where the mission has no such attribute."""
    value: Any = mission
    for part in path:
        if isinstance(value, Mapping):
            value = value.get(part)
        elif isinstance(part, int):
            value = value[part] if isinstance(value, tuple) and part < len(value) else None
        else:
            value = getattr(value, part, None)
    return value


def moved_geometry(before: MissionFindings, after: MissionFindings) -> Iterator[Moved]:
    """Numbers of the collection that differ by more than rounding."""
    for (name, unit, old), (_, _, new) in zip(_numbers(before), _numbers(after), strict=True):
        is_same = old == new or (old is not None and new is not None and math.isclose(old, new, rel_tol=1e-9))
        if not is_same:
            yield Moved(name, unit, old, new)


def _numbers(found: MissionFindings) -> Iterator[tuple[str, str, float | None]]:
    geometry = found.geometry
    for name, state in (("transmitter", geometry.transmitter), ("receiver", geometry.receiver)):
        yield f"{name} slant range", "m", state.slant_range
        yield f"{name} azimuth", "deg", math.degrees(state.azimuth)
        yield f"{name} elevation", "deg", math.degrees(state.elevation)
        yield f"{name} squint", "deg", None if state.squint is None else math.degrees(state.squint)
    yield "bistatic angle", "deg", math.degrees(geometry.bistatic_angle)
    yield "look azimuth", "deg", math.degrees(geometry.look_azimuth)
    yield "angle between range and Doppler gradients", "deg", math.degrees(geometry.gradient_angle)
    yield "range resolution", "m", found.resolution.range
    yield "cross-range resolution", "m", found.resolution.cross_range


# ---------------------------------------------------------------------- what is looser
_COMPUTED = (
    "oscillator",
    "spatial_variance",
    "dispersion",
)  # the file states no such number: a zero is a result, as a level is
# Each asks for more than the one before it.
_RULES = {"combine": ("each", "rss", "sum"), "model": GATING_MODELS}

_WIDEST_FIRST = ("normal", "bound", "uniform")
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
    yield from _looser_requirements(*missions)
    yield from _looser_specifications(*missions)
    yield from _declarations(*missions)
    yield from _rules(before, after)
    yield from _waivers(*missions)
    yield from _waived_rows(before, after)
    gone = list(_errors(before, after))
    yield from gone
    yield from _distributions(*missions)
    yield from _fallen(before, after, [one.id for one in gone])
    yield from (Loosened(*lost) for lost in lost_doubts(*missions))
    yield from _sources(before, after)


def loosened_settings(before: Mapping[str, Any], after: Mapping[str, Any]) -> Iterator[Loosened]:
    """List what the settings of a project hold less than before: `strict` that is gone, `exit-zero` that came."""
    for key, holds in (("strict", True), ("exit-zero", False)):
        old, new = (values.get(key, False) for values in (before, after))
        if old is holds and new is not holds:
            yield Loosened(f"{TABLE}.{key}", *("true" if one else "false" for one in (old, new)))


def _looser_requirements(before: Mission, after: Mission) -> Iterator[Loosened]:
    """Requirements that are gone or larger."""
    for key in Requirements._fields:
        old, new = (getattr(mission.requirements, key) for mission in (before, after))
        if key != "declare" and old is not None and (new is None or _is_above(new, old)):
            path = ("requirements", key)
            yield Loosened(dotted(path), _said(before, path, old), _said(after, path, new))


def _looser_specifications(before: Mission, after: Mission) -> Iterator[Loosened]:
    """Specifications that are gone or larger."""
    for key, old in before.specifications.items():
        path, new = ("specifications", key), after.specifications.get(key)
        if old.value is not None and (new is None or new.value is None or _is_above(new.value, old.value)):
            yield Loosened(dotted(path), _said(before, path, old.value), _said(after, path, new and new.value))


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
    stated = (row for row in before.rows if row.declared is not None and row.is_independent)
    for name in dict.fromkeys(_error(row) for row in stated if row.subject.kind not in SUMS):
        if name not in new:
            yield Loosened(name, "declared", "not declared")
        elif old[name] and not new[name]:
            yield Loosened(name, "declared", "zero")


def _fallen(before: MissionFindings, after: MissionFindings, gone: Sequence[str]) -> Iterator[Loosened]:
    """Rows whose declared effect fell; an error that is `gone` is named already."""
    for fall in fallen_effects(before, after):
        if not any(fall.id == name or fall.id.startswith(f"{name}.") for name in gone):
            yield Loosened(fall.id, *fall.words)


def _distributions(before: Mission, after: Mission) -> Iterator[Loosened]:
    """Distributions that are narrower for the same values: a bound is never exceeded, one sigma is."""
    sections = [
        (f"platforms.{name}.motion_error", attrgetter(f"platforms.{name}.motion_error")) for name in PLATFORMS
    ]
    for key, section in (*sections, ("common_motion_error", attrgetter("common_motion_error"))):
        old, new = (getattr(section(mission), "distribution", None) for mission in (before, after))
        if old and new and _WIDEST_FIRST.index(new) > _WIDEST_FIRST.index(old):
            yield Loosened(f"{key}.distribution", old, new)


def _declared(found: MissionFindings) -> dict[str, bool]:
    """Errors that a file declares, and whether as more than zero along any axis."""
    declared: dict[str, bool] = {}
    for row in found.rows:
        if row.declared is not None:
            name = _error(row)
            is_more = row.declared != 0 or row.unit == "dB" or row.subject.kind in _COMPUTED
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
    sources = {row_id: one.source for one in mission.other_errors for row_id in one.stated}
    for platform in PLATFORMS:
        error = getattr(mission.platforms, platform).motion_error
        evidence = error.evidence("random")
        sources |= {f"{platform}.random.{one.name}": one.source or evidence for one in error.random}
    common = mission.common_motion_error
    for one in () if common is None else common.random:
        sources[f"common.random.{one.name}"] = one.source or (common and common.source)
    return sources


def _is_above(one: float, other: float) -> bool:
    """Whether by more than reading the same value from another unit makes."""
    return one > other and not math.isclose(one, other, rel_tol=1e-9)


def _said(mission: Mission, path: tuple[str, ...], value: float | None) -> str:
    if value is None:
        return "none"
    default = f"{math.degrees(value):g} deg" if path[-1] == "quadratic_phase_error" else f"{value:g}"
    return written(mission).get(path, f"{default} (default)")


# ---------------------------------------------------------------------- what comes out
SMALL = 0.01  # a row that moves by less than this part tells a reader nothing


class Change(NamedTuple):
    """One row before and after; None where the mission has no such row."""

    id: str
    before: Row | None
    after: Row | None

    @property
    def use(self) -> tuple[float, float]:
        """Part of the limit that is used before and after; what is not declared uses nothing."""
        before, after = (row.utilization or 0.0 if row else 0.0 for row in (self.before, self.after))
        return before, after

    @property
    def erosion(self) -> float:
        """Part of what was left of the limit that the change uses up, (u₂ − u₁)/(1 − u₁); negative is a gain.

        1 uses up everything. For a row that had nothing left, the relative growth of its use, u₂/u₁ − 1.
        """
        before, after = self.use
        if before == after:
            return 0.0
        left = 1 - before
        return (after - before) / left if left > UTILIZATION_TOLERANCE else after / before - 1

    @property
    def is_newly_failing(self) -> bool:
        """Whether it fails, or is not evaluated, now and was not."""
        return _is_newly_broken(_status(self.before), _status(self.after))

    @property
    def words(self) -> str:
        """The effect on the limit in words, for a gate that refuses it."""
        if self.is_newly_failing:
            return _worse(_status(self.after))
        before, after = self.use
        if 1 - before <= UTILIZATION_TOLERANCE:
            return f"had used up its limit and uses more: {percent(before)} -> {percent(after)}"
        return f"uses up {percent(self.erosion)} of what was left of its limit"

    @property
    def is_change(self) -> bool:
        """Whether anything that is reported differs; that it moved to another line does not count."""
        return _reported(self.before) != _reported(self.after)

    @property
    def is_small(self) -> bool:
        """Whether status and requirement stay, and declared, allowable and what is left move by less than 1 %."""
        before, after = self.before, self.after
        if before is None or after is None or before.status != after.status or abs(self.erosion) >= SMALL:
            return False
        return _is_near(before.declared, after.declared) and _is_near(before.allowable, after.allowable)

    def breaks(self, tolerated: float) -> bool:
        """Whether it newly fails, or a row that is judged loses more than the tolerated part of what was left.

        So does one that a waiver keeps from failing, before as after: it was granted for the row as it stood.
        """
        is_judged = self.after is not None and STATUS[self.after.status].is_held
        is_judged = is_judged or _status(self.before) == _status(self.after) == "waived"
        return self.is_newly_failing or (is_judged and self.erosion > tolerated + UTILIZATION_TOLERANCE)


class RequirementMove(NamedTuple):
    """Statuses of a requirement before and after; None where the mission has no such requirement."""

    key: str
    name: str
    before: str | None
    after: str | None

    @property
    def id(self) -> str:
        """Its name in waivers and reports."""
        return f"mission.{self.key}"

    @property
    def is_newly_failing(self) -> bool:
        """Whether it is not met, or not evaluated, now and was not."""
        return _is_newly_broken(self.before, self.after)


class Refusal(NamedTuple):
    """One thing that a gate refuses: its id, what it does, and whether `--allow` lets it through."""

    id: str
    words: str
    is_allowed: bool


class Gate(NamedTuple):
    """A gate: the part of what was left of a limit that a change may use up, and the ids that it lets through."""

    tolerated: float
    allowed: tuple[str, ...] = ()

    def only(self, allowed: str) -> "Gate":
        """The same with one id let through."""
        return self._replace(allowed=(allowed,))

    def refusal(self, id: str, words: str, file: str) -> Refusal:
        """Refuse, or let through: the id, or the id behind the file and a colon, may be named or match a pattern."""
        names = (id, f"{file}:{id}")
        return Refusal(
            id, words, any(name == one or fnmatchcase(name, one) for one in self.allowed for name in names)
        )


class MissionChange(NamedTuple):
    """A mission before and after; changes have the largest erosion first. `inputs` are keys of the mission file.

    `requirements` are those that stand otherwise now, `loosened` what holds the mission less than before.
    """

    before: MissionFindings
    after: MissionFindings
    changes: tuple[Change, ...]
    unchanged: int
    inputs: tuple[Moved, ...] = ()
    geometry: tuple[Moved, ...] = ()
    requirements: tuple[RequirementMove, ...] = ()
    loosened: tuple[Loosened, ...] = ()

    def broken(self, tolerated: float) -> list[Change]:
        """List the rows that a gate refuses."""
        return [change for change in self.changes if change.breaks(tolerated)]

    def refusals(self, gate: Gate) -> list[Refusal]:
        """List what a gate refuses, and what of it is let through: rows, requirements, and what is loosened."""
        return [gate.refusal(id, words, self.after.file) for id, words in self._refused(gate.tolerated)]

    def _refused(self, tolerated: float) -> Iterator[tuple[str, str]]:
        broken = self.broken(tolerated)
        for change in broken:
            yield change.id, change.words
        for one in self.requirements:
            if one.is_newly_failing and one.id not in [change.id for change in broken]:
                yield one.id, _worse(one.after)
        for loosened in self.loosened:
            yield loosened.id, loosened.words


class ChangeSet(NamedTuple):
    """The effects of a change on all missions of a run.

    `gone` are mission files that the change removes, `new` those that it adds, `settings` what of the project's
    settings holds less than before, and `outside` files outside of the repository, which have one version.
    """

    missions: tuple[MissionChange, ...]
    gone: tuple[str, ...] = ()
    new: tuple[str, ...] = ()
    settings: tuple[Loosened, ...] = ()
    outside: tuple[str, ...] = ()

    def refusals(self, gate: Gate) -> list[Refusal]:
        """List what a gate refuses that is of no one mission."""
        gone = [gate.refusal(file, "the mission file is gone", file) for file in self.gone]
        return gone + [gate.refusal(one.id, one.words, "pyproject.toml") for one in self.settings]

    def is_refused(self, gate: Gate) -> bool:
        """Whether a gate refuses anything that is not let through."""
        return not all(one.is_allowed for one in self._all(gate))

    def unused(self, gate: Gate) -> list[str]:
        """List what `--allow` names and nothing needs."""
        return [one for one in gate.allowed if not any(found.is_allowed for found in self._all(gate.only(one)))]

    def _all(self, gate: Gate) -> list[Refusal]:
        return self.refusals(gate) + [one for mission in self.missions for one in mission.refusals(gate)]


def compare(before: MissionFindings, after: MissionFindings) -> MissionChange:
    """Pair the rows of two findings by id."""
    old, new = ({row.id: row for row in found.rows} for found in (before, after))
    changes = [Change(row_id, old.get(row_id), new.get(row_id)) for row_id in {**old, **new}]
    changed = [change for change in changes if change.is_change]
    changed.sort(key=lambda change: (not change.is_newly_failing, -change.erosion))
    missions = (before.mission, after.mission) if before.mission and after.mission else ()
    return MissionChange(
        before,
        after,
        tuple(changed),
        len(changes) - len(changed),
        inputs=tuple(moved_inputs(*missions)) if missions else (),
        geometry=tuple(moved_geometry(before, after)),
        requirements=tuple(_requirements(before, after)),
        loosened=tuple(loosenings(before, after)) if missions else (),
    )


def _requirements(before: MissionFindings, after: MissionFindings) -> Iterator[RequirementMove]:
    """Requirements that stand otherwise now."""
    old, new = ({one.key: one for one in found.requirements} for found in (before, after))
    for key, one in {**old, **new}.items():
        statuses = [found[key].status if key in found else None for found in (old, new)]
        if statuses[0] != statuses[1]:
            yield RequirementMove(key, one.name, *statuses)


def _is_newly_broken(before: str | None, after: str | None) -> bool:
    """Whether what was held is so no more; what could not be judged and fails now is worse too."""
    return (after == "fail" != before) or (after == "not_evaluated" and before not in ("fail", "not_evaluated"))


def _worse(status: str | None) -> str:
    return "is not evaluated now" if status == "not_evaluated" else "fails now"


def _is_near(before: float | None, after: float | None) -> bool:
    if before is None or after is None:
        return before is after
    return abs(after - before) < SMALL * max(abs(before), abs(after)) or before == after


def _status(row: Row | None) -> str | None:
    return None if row is None else row.status


def _reported(row: Row | None) -> tuple[object, ...]:
    return () if row is None else (row.status, row.declared, row.allowable, row.utilization)
