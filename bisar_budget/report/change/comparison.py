"""Compare missions before and after a change: inputs, rules that became looser, and lost margins.

A gate refuses changes that use up too much of a margin or loosen a rule.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from operator import attrgetter
from typing import NamedTuple

from bisar_budget.constants import GATING_MODELS, UTILIZATION_TOLERANCE_FRACTION
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.error_kinds.path_kinds import STATE_KINDS, StateKind
from bisar_budget.error_kinds.registry import names_of_named_kinds
from bisar_budget.faults import Changed, KeyPath
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.requirement import REQUIREMENT_NAMES, JudgedRequirement
from bisar_budget.findings.row import DECLARE, Row
from bisar_budget.findings.status import BROKEN, RANK, STATUS
from bisar_budget.mission.changes import parts_of
from bisar_budget.mission.model import OF_MISSION, Mission, Waiver
from bisar_budget.mission.parts import figure_text
from bisar_budget.mission.readers import SectionValue
from bisar_budget.report.change.fallen_effects import fallen_effects
from bisar_budget.report.change.lost_doubts import lost_doubts
from bisar_budget.report.words.sentences import dotted, percent
from bisar_budget.settings import TABLE
from bisar_budget.units import format_quantity


# ---------------------------------------------------------------------- inputs
class Moved(NamedTuple):
    """The value of a mission key or of a geometry number before and after a change.

    `before` or `after` is None if that version has no such value.
    """

    name: str
    unit: str  # of a number; empty for a text
    before: str | float | None
    after: str | float | None


def moved_inputs(before: Mission, after: Mission) -> Iterator[Moved]:
    """Yield the keys whose values differ. Spellings of the same value, such as `31 km` and `31000 m`, are equal."""
    old, new = texts_of_file(before), texts_of_file(after)
    for path in {**old, **new}:
        if old.get(path) == new.get(path):
            continue
        values = [_value(mission, path) for mission in (before, after)]
        if path in old and path in new and values[0] is not None and values[0] == values[1]:
            continue
        yield Moved(dotted(path), "", old.get(path), new.get(path))
    for name in PLATFORMS:
        files = [getattr(mission.platforms, name).path for mission in (before, after)]
        if None not in files and files[0].file == files[1].file and files[0].sha256 != files[1].sha256:
            contents = [file.sha256 and file.sha256[:12] for file in files]
            yield Moved(f"platforms.{name}: content of {files[1].file}", "", *contents)
        old_files, new_files = ({} if file is None else file.beside for file in files)
        for use in old_files.keys() & new_files.keys():
            old_file, new_file = old_files[use], new_files[use]
            if old_file and new_file and old_file[0] == new_file[0] and old_file[1] != new_file[1]:
                contents = [digest[:12] for _, digest in (old_file, new_file)]
                yield Moved(f"platforms.{name}: content of {new_file[0]}", "", *contents)


def texts_of_file(mission: Mission) -> dict[KeyPath, str]:
    """Texts of the values in a mission file, by key path. A list of plain values counts as one value.

    If a value comes from a catalogue part, its text also contains the name of the part.
    """
    texts = {
        path: event.value for path, event in mission.places.items() if isinstance(getattr(event, "value", None), str)
    }
    for figure in mission.taken:
        texts[tuple(figure.key.split("."))] = f"{figure_text(figure.value)} (part {figure.part})"
    texts |= dict(_set_values(mission))
    lists: dict[KeyPath, list[str]] = {}
    elements = [path for path in texts if isinstance(path[-1], int)]
    for path in sorted(elements, key=lambda path: int(path[-1])):  # an element that was set by an option is last
        lists.setdefault(path[:-1], []).append(texts.pop(path))
    return texts | {path: f"[{', '.join(items)}]" for path, items in lists.items()}


def _set_values(mission: Mission) -> Iterator[tuple[KeyPath, str]]:
    """Yield the key path and text of each value that is set by an option, even if the file does not have the key."""
    changed = {".".join(map(str, path)): path for path, event in mission.places.items() if isinstance(event, Changed)}
    for change in mission.changes:
        parts = parts_of(change.key)
        yield changed.get(".".join(parts), parts), change.text


def _value(mission: Mission, path: KeyPath) -> SectionValue:
    """Value of a mission at a key path; None if the mission has no such attribute."""
    value: SectionValue = mission
    for key in path:
        if isinstance(value, Mapping):
            value = value.get(key)
        elif isinstance(key, int):
            value = value[key] if isinstance(value, tuple) and key < len(value) else None
        else:
            value = getattr(value, key, None)
    return value


def moved_geometry(before: MissionFindings, after: MissionFindings) -> Iterator[Moved]:
    """Yield the geometry values, such as slant ranges and angles, that differ by more than rounding.

    The range and cross-range resolutions are included.
    """
    for (name, unit, old), (_, _, new) in zip(_numbers(before), _numbers(after), strict=True):
        is_unchanged = old == new or (old is not None and new is not None and math.isclose(old, new, rel_tol=1e-9))
        if not is_unchanged:
            yield Moved(name, unit, old, new)


def _numbers(findings: MissionFindings) -> Iterator[tuple[str, str, float | None]]:
    geometry = findings.geometry
    for name, state in (("transmitter", geometry.transmitter), ("receiver", geometry.receiver)):
        yield f"{name} slant range", "m", float(state.slant_range)
        yield f"{name} azimuth", "deg", math.degrees(state.azimuth)
        yield f"{name} elevation", "deg", math.degrees(state.elevation)
        yield f"{name} squint", "deg", None if state.squint is None else math.degrees(state.squint)
    yield "bistatic angle", "deg", math.degrees(geometry.bistatic_angle)
    yield "look azimuth", "deg", math.degrees(geometry.look_azimuth)
    yield "angle between range and Doppler gradients", "deg", math.degrees(geometry.gradient_angle)
    yield "range resolution", "m", float(findings.resolution.range)
    yield "cross-range resolution", "m", float(findings.resolution.cross_range)


# ---------------------------------------------------------------------- loosened rules
# Rules in the order of their strictness, the strictest last.
_RULES_BY_STRICTNESS = {"combine": ("each", "rss", "sum"), "model": GATING_MODELS}

_LIMITED_QUANTITIES = tuple(key for key in REQUIREMENT_NAMES if key != DECLARE)  # requirements with a size
_WIDEST_FIRST = ("normal", "bound", "uniform")
_LIMITING_NUMBERS = (
    ("autofocus", "n_pull", 1),
    ("allocation", "coverage_factor", -1),
    ("allocation", "warn_above", 1),
)


class Loosened(NamedTuple):
    """A rule or declaration that became looser, as text before and after the change.

    `id` is the name to use with `--allow`: a key of the mission file, the id of a row, or the kind of an error.
    """

    id: str
    before: str
    after: str

    @property
    def words(self) -> str:
        """Text `before -> after` for messages."""
        return f"{self.before} -> {self.after}"


def loosenings(before: MissionFindings, after: MissionFindings) -> Iterator[Loosened]:
    """Yield the rules and declarations that became looser. Both `before` and `after` must contain their analysis."""
    missions = (before.analysed().mission, after.analysed().mission)
    yield from _looser_requirements(*missions)
    yield from _looser_specifications(*missions)
    yield from _declarations(*missions)
    yield from _rules(before, after)
    yield from _waivers(*missions)
    yield from _waived_rows(before, after)
    gone_errors = list(_errors(before, after))
    yield from gone_errors
    yield from _distributions(*missions)
    yield from _fallen(before, after, [error.id for error in gone_errors])
    yield from _smaller_biases(before, after)
    yield from (Loosened(*doubt) for doubt in lost_doubts(*missions))
    yield from _sources(before, after)


def loosened_settings(before: Mapping[str, object], after: Mapping[str, object]) -> Iterator[Loosened]:
    """Yield the settings of a project that became looser: a removed `strict`, or an added `exit-zero`."""
    for key, strict_value in (("strict", True), ("exit-zero", False)):
        old, new = (values.get(key, False) for values in (before, after))
        if old is strict_value and new is not strict_value:
            yield Loosened(f"{TABLE}.{key}", *("true" if value else "false" for value in (old, new)))


def _looser_requirements(before: Mission, after: Mission) -> Iterator[Loosened]:
    """Yield the requirements that were removed, or now have a larger value or a smaller confidence."""
    for key in _LIMITED_QUANTITIES:
        path = ("requirements", key)
        old, new = (getattr(mission.requirements, key) for mission in (before, after))
        if old is not None and (new is None or _is_above(new, old)):
            yield Loosened(dotted(path), _value_text(before, path, old), _value_text(after, path, new))
        was, became = (mission.requirements.confidence_of(key) for mission in (before, after))
        if was is not None and new is not None and (became is None or became < was):
            yield Loosened(f"{dotted(path)}.confidence", f"{100 * was:g} %", _percent_or_none(became))


def _percent_or_none(confidence: float | None) -> str:
    return "none" if confidence is None else f"{100 * confidence:g} %"


def _smaller_biases(before: MissionFindings, after: MissionFindings) -> Iterator[Loosened]:
    """Yield the rows of errors that are still declared, and whose bias became smaller."""
    new = {row.id: row for row in after.rows if row.declared is not None}
    for row in before.rows:
        if row.bias is not None and row.is_independent and row.id in new:
            bias = new[row.id].bias or 0.0
            if _is_above(abs(row.bias), abs(bias)):
                words = (format_quantity(size, row.unit) for size in (row.bias, bias))
                yield Loosened(f"{row.id}.bias", *words)


def _looser_specifications(before: Mission, after: Mission) -> Iterator[Loosened]:
    """Yield the specifications that were removed or now have a larger value."""
    for key, old in before.specifications.items():
        path, new = ("specifications", key), after.specifications.get(key)
        if old.value is not None and (new is None or new.value is None or _is_above(new.value, old.value)):
            yield Loosened(
                dotted(path), _value_text(before, path, old.value), _value_text(after, path, new and new.value)
            )


def _declarations(before: Mission, after: Mission) -> Iterator[Loosened]:
    """Yield the entries of `requirements.declare` whose errors no longer all have to be declared."""
    later_kinds = {kind for word in after.requirements.declare for kind in _owned(word)}
    for word in before.requirements.declare:
        kept = later_kinds.intersection(_owned(word))
        if len(kept) < len(_owned(word)):
            yield Loosened(f"requirements.declare.{word}", word, ", ".join(sorted(kept)) or "none")


def _owned(word: str) -> list[str]:
    """Kinds of error, such as `receiver.position`, that an entry of `requirements.declare` requires to be declared.

    If the entry does not name a platform, but its kind of error belongs to a platform, the entry applies to both
    platforms.
    """
    return [word] if "." in word or word in OF_MISSION else [f"{name}.{word}" for name in PLATFORMS]


def _rules(before: MissionFindings, after: MissionFindings) -> Iterator[Loosened]:
    """Yield the rules that became looser.

    The rules are the pull-in range `n_pull` of the autofocus, the coverage factor, the warning threshold, the shares
    of the budget, the gating model (which decides the verdicts), and the rule that combines errors.
    """
    missions = (before.analysed().mission, after.analysed().mission)
    for section, key, sign in _LIMITING_NUMBERS:
        old, new = (getattr(getattr(mission, section), key) for mission in missions)
        if new is not None and (old is None or _is_above(sign * new, sign * old)):
            path = (section, key)
            yield Loosened(dotted(path), _value_text(missions[0], path, old), _value_text(missions[1], path, new))
    if missions[0].allocation.split != missions[1].allocation.split:
        yield from _shares(before, after)
    words = {"combine": (before.combine, after.combine), "model": (before.model, after.model)}
    for key, (old_rule, new_rule) in words.items():
        if _RULES_BY_STRICTNESS[key].index(new_rule) < _RULES_BY_STRICTNESS[key].index(old_rule):
            yield Loosened(f"allocation.{key}", old_rule, new_rule)


def _shares(before: MissionFindings, after: MissionFindings) -> Iterator[Loosened]:
    """Yield the budget reserves that became smaller, and the shares that grew by more than the reserve shrank."""
    for metric, key in (("qpe", "quadratic_phase_error"), ("pslr", "pslr"), ("islr", "islr")):
        old, new = (getattr(findings.allocation, metric) for findings in (before, after))
        if _is_above(old.reserve, new.reserve):
            yield Loosened(f"allocation.split.{key}.reserve", f"{old.reserve:.4g}", f"{new.reserve:.4g}")
        released = max(0.0, old.reserve - new.reserve)
        for owner in PLATFORMS if new.clock is None else (*PLATFORMS, "clock"):
            if _is_above(new.of(owner), old.of(owner) + released):
                yield Loosened(f"allocation.split.{key}.{owner}", f"{old.of(owner):.4g}", f"{new.of(owner):.4g}")


def _waivers(before: Mission, after: Mission) -> Iterator[Loosened]:
    """Yield the waivers that are new, expire later than before, or cover more rows."""
    for waiver in after.waivers:
        covering = [earlier for earlier in before.waivers if _names_as_much(earlier, waiver)]
        if not any(earlier.until >= waiver.until for earlier in covering):
            until = max((earlier.until for earlier in covering), default=None)
            old = "not waived" if until is None else f"waived until {until.isoformat()}"
            yield Loosened(waiver.id, old, f"waived until {waiver.until.isoformat()}")


def _names_as_much(old: Waiver, new: Waiver) -> bool:
    """Whether an earlier waiver covers every row of a new waiver.

    If the new pattern has brackets and differs from the earlier pattern, the result is False, because patterns with
    brackets are not compared.
    """
    is_one_row = not any(char in new.id for char in "*?[")
    # A star of the old pattern also matches wildcards of the new pattern; the text beside the star is in both.
    is_narrower = "[" not in new.id and not any(char in old.id for char in "?[")
    return old.id == new.id or ((is_one_row or is_narrower) and fnmatchcase(new.id, old.id))


def _waived_rows(before: MissionFindings, after: MissionFindings) -> Iterator[Loosened]:
    """Yield the rows and requirements that are waived now but were not waived before."""
    named_ids = {waiver.id for waiver in _waivers(before.analysed().mission, after.analysed().mission)}
    for collection in ("rows", "requirements"):
        old: Mapping[str, Row | JudgedRequirement] = {item.id: item for item in getattr(before, collection)}
        for item in getattr(after, collection):
            old_status = old[item.id].status if item.id in old else "none"
            if item.status == "waived" != old_status and item.id not in named_ids:
                yield Loosened(item.id, old_status.replace("_", " "), "waived")


def _errors(before: MissionFindings, after: MissionFindings) -> Iterator[Loosened]:
    """Yield the errors that are no longer declared, or are now declared as zero.

    A motion error counts as a single error for all its axes.
    """
    old, new = _declared(before), _declared(after)
    stated = (row for row in before.rows if row.declared is not None and row.is_independent)
    for name in dict.fromkeys(_error(row) for row in stated if not _is_sum(row)):
        if name not in new:
            yield Loosened(name, "declared", "not declared")
        elif old[name] and not new[name]:
            yield Loosened(name, "declared", "zero")


def _is_sum(row: Row) -> bool:
    """Whether a row sums the effects of several errors, so that it is not an error itself."""
    return row.subject.facts.is_sum


def _fallen(before: MissionFindings, after: MissionFindings, gone_errors: Sequence[str]) -> Iterator[Loosened]:
    """Yield the rows whose declared effect decreased, except rows of errors that are no longer declared.

    `gone_errors` are the names of these errors, which are listed separately.
    """
    for fall in fallen_effects(before, after):
        if not any(fall.id == name or fall.id.startswith(f"{name}.") for name in gone_errors):
            yield Loosened(fall.id, *fall.words)


def _distributions(before: Mission, after: Mission) -> Iterator[Loosened]:
    """Yield the distributions that became narrower.

    For the same declared value, a normal distribution is the widest, and a uniform distribution the narrowest.
    """
    sections = [
        (f"platforms.{name}.motion_error", attrgetter(f"platforms.{name}.motion_error")) for name in PLATFORMS
    ]
    for key, section in (*sections, ("common_motion_error", attrgetter("common_motion_error"))):
        old, new = (section(mission) for mission in (before, after))
        if old is None or new is None:
            continue
        for kind in STATE_KINDS:
            was, became = old.distribution_of(kind.name), new.distribution_of(kind.name)
            if _WIDEST_FIRST.index(became) > _WIDEST_FIRST.index(was):
                yield Loosened(f"{key}.distribution", was, became)
                break


def _declared(findings: MissionFindings) -> dict[str, bool]:
    """Map each declared error to True if it is nonzero along at least one axis, and to False otherwise.

    Levels in dB and computed sizes count as nonzero.
    """
    is_declared: dict[str, bool] = {}
    for row in findings.rows:
        if row.declared is not None:
            name = _error(row)
            is_more = row.declared != 0 or row.unit == "dB" or row.subject.facts.is_computed
            is_declared[name] = is_declared.get(name, False) or is_more
    return is_declared


def _error(row: Row) -> str:
    """Name of the error to which a row belongs, without the axis."""
    return row.id.rpartition(".")[0] if isinstance(row.subject.facts, StateKind) else row.id


def _sources(before: MissionFindings, after: MissionFindings) -> Iterator[Loosened]:
    """Yield the kinds of error whose source was stated before the change, but is no longer stated after it.

    Errors that have names of their own in the file are listed one by one.
    """
    had_source = set(before.kinds.declared) - set(before.kinds.without_source)
    lost = [
        name
        for name in after.kinds.without_source
        if name in had_source and name.rpartition(".")[2] not in names_of_named_kinds()
    ]
    old, new = (_named_sources(findings.analysed().mission) for findings in (before, after))
    lost += [name for name, source in new.items() if old.get(name) and not source]
    for name in lost:
        yield Loosened(f"{name}.source", "stated", "none")


def _named_sources(mission: Mission) -> dict[str, str | None]:
    """Map the row ids of errors with names of their own to the sources of the errors; None if there is no source."""
    sources = {row_id: one.source for one in mission.other_errors for row_id in one.stated}
    for platform in PLATFORMS:
        error = getattr(mission.platforms, platform).motion_error
        evidence = error.evidence("random")
        sources |= {f"{platform}.random.{one.name}": one.source or evidence for one in error.random}
    common = mission.common_motion_error
    for one in () if common is None else common.random:
        sources[f"common.random.{one.name}"] = one.source or (common and common.source)
    return sources


def _is_above(value: float, limit: float) -> bool:
    """Whether a value exceeds a limit by more than the rounding error of a unit conversion."""
    return value > limit and not math.isclose(value, limit, rel_tol=1e-9)


def _value_text(mission: Mission, path: tuple[str, ...], value: float | None) -> str:
    if value is None:
        return "none"
    default = f"{math.degrees(value):g} deg" if path[-1] == "quadratic_phase_error" else f"{value:g}"
    return texts_of_file(mission).get(mission.written_path(path), f"{default} (default)")


# ---------------------------------------------------------------------- results
SMALL_FRACTION = 0.01  # changes of a row below this fraction are not shown


class Change(NamedTuple):
    """A row before and after a change; `before` or `after` is None if that version does not have the row."""

    id: str
    before: Row | None
    after: Row | None

    @property
    def use(self) -> tuple[float, float]:
        """Utilizations of the row before and after the change; 0 if the row is missing or has no utilization."""
        before, after = (row.utilization or 0.0 if row else 0.0 for row in (self.before, self.after))
        return before, after

    @property
    def erosion(self) -> float:
        """Fraction of the margin that the change uses up, (u₂ − u₁)/(1 − u₁), from the utilizations u₁ and u₂.

        It is 1 if the whole margin is used up, and negative if the margin grows. For a row that had no margin, it is
        the relative growth of the utilization, u₂/u₁ − 1.
        """
        before, after = self.use
        if before == after:
            return 0.0
        remaining = 1 - before
        return (after - before) / remaining if remaining > UTILIZATION_TOLERANCE_FRACTION else after / before - 1

    @property
    def is_newly_failing(self) -> bool:
        """Whether the status of the row became worse.

        It is worse if it became fail, or if it became not evaluated and was not fail before.
        """
        return _is_newly_broken(_status(self.before), _status(self.after))

    @property
    def words(self) -> str:
        """Text for messages that states the lost margin or the new status of the row."""
        if self.is_newly_failing:
            return _worse(_status(self.after))
        before, after = self.use
        if 1 - before <= UTILIZATION_TOLERANCE_FRACTION:
            return f"had used up its limit and uses more: {percent(before)} -> {percent(after)}"
        return f"uses up {percent(self.erosion)} of what was left of its limit"

    @property
    def is_change(self) -> bool:
        """Whether the status, declared value, allowable or utilization changed, or only one version has the row."""
        return _reported(self.before) != _reported(self.after)

    @property
    def is_small(self) -> bool:
        """Whether the status is unchanged, and declared value, allowable and margin changed by less than 1 %."""
        before, after = self.before, self.after
        if before is None or after is None or before.status != after.status or abs(self.erosion) >= SMALL_FRACTION:
            return False
        return _is_near(before.declared, after.declared) and _is_near(before.allowable, after.allowable)

    def breaks(self, tolerated: float) -> bool:
        """Whether a gate refuses the change, because the row newly fails or loses too much of its margin.

        The row may lose at most the fraction `tolerated` of the margin that it had before the change. Only a judged
        row can lose margin. A row that is waived before and after the change counts as judged, because the waiver was
        granted for its earlier value.
        """
        is_judged = self.after is not None and STATUS[self.after.status].is_held
        is_judged = is_judged or _status(self.before) == _status(self.after) == "waived"
        return self.is_newly_failing or (is_judged and self.erosion > tolerated + UTILIZATION_TOLERANCE_FRACTION)


class RequirementMove(NamedTuple):
    """A requirement with its status before and after a change.

    A status is None if that version of the mission does not have the requirement. `requirement_ids` are the ids of
    the requirement in the project.
    """

    key: str
    name: str
    before: str | None
    after: str | None
    requirement_ids: tuple[str, ...] = ()

    @property
    def id(self) -> str:
        """Id of the requirement in waivers and reports."""
        return f"mission.{self.key}"

    @property
    def is_newly_failing(self) -> bool:
        """Whether the status of the requirement became worse.

        It is worse if it became fail, or if it became not evaluated and was not fail before.
        """
        return _is_newly_broken(self.before, self.after)


class Refusal(NamedTuple):
    """A change that a gate refuses, with its id and a text; `is_allowed` is True if `--allow` permits it anyway."""

    id: str
    words: str
    is_allowed: bool


class Gate(NamedTuple):
    """A gate that refuses changes which use up too much of a margin or loosen a rule.

    `tolerated` is the largest fraction of a margin that a change may use up. `allowed` are the ids, or patterns of
    ids, of changes that are accepted nevertheless.
    """

    tolerated: float
    allowed: tuple[str, ...] = ()

    def only(self, allowed: str) -> "Gate":
        """Return a copy of this gate with `allowed` as its only exception, an id or a pattern."""
        return self._replace(allowed=(allowed,))

    def refusal(self, id: str, words: str, file: str) -> Refusal:
        """Create a `Refusal` with the id of the refused change and the text `words`.

        Its field `is_allowed` is True if `id` or `file:id` matches an item of `allowed`.
        """
        names = (id, f"{file}:{id}")
        return Refusal(
            id,
            words,
            any(name == pattern or fnmatchcase(name, pattern) for pattern in self.allowed for name in names),
        )


class MissionChange(NamedTuple):
    """A mission before and after a change, and the differences between both versions.

    `changes` are the changed rows: first the newly failing rows, then all further rows by erosion, the largest first.
    `unchanged` is the number of unchanged rows. `inputs` are the changed keys of the mission file, `requirements` the
    requirements whose status changed, and `loosened` the rules and declarations that became looser.
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
        """Row changes that a gate refuses if each row may lose at most the fraction `tolerated` of its margin."""
        return [change for change in self.changes if change.breaks(tolerated)]

    def refusals(self, gate: Gate) -> list[Refusal]:
        """Refusals of changed rows, requirements and rules, including refusals overridden by `--allow`."""
        return [gate.refusal(id, words, self.after.file) for id, words in self._refused(gate.tolerated)]

    def _refused(self, tolerated: float) -> Iterator[tuple[str, str]]:
        broken = self.broken(tolerated)
        for change in broken:
            yield change.id, change.words
        for requirement in self.requirements:
            if requirement.is_newly_failing and requirement.id not in [change.id for change in broken]:
                yield requirement.id, _worse(requirement.after)
        for loosened in self.loosened:
            yield loosened.id, loosened.words


class ChangeSet(NamedTuple):
    """The effects of a change on all missions of a run.

    `gone` are the mission files that the change removes, `new` the mission files that it adds, and `settings` the
    loosened settings of the project. `outside` are files outside the repository; only their present versions are
    available.
    """

    missions: tuple[MissionChange, ...]
    gone: tuple[str, ...] = ()
    new: tuple[str, ...] = ()
    settings: tuple[Loosened, ...] = ()
    outside: tuple[str, ...] = ()

    def refusals(self, gate: Gate) -> list[Refusal]:
        """Refusals of changes outside the compared missions: removed mission files and loosened settings."""
        refusals = [gate.refusal(file, "the mission file is gone", file) for file in self.gone]
        return refusals + [gate.refusal(loosened.id, loosened.words, "pyproject.toml") for loosened in self.settings]

    def is_refused(self, gate: Gate) -> bool:
        """Whether the gate refuses at least one change that is not accepted by `--allow`."""
        return not all(refusal.is_allowed for refusal in self._all(gate))

    def unused(self, gate: Gate) -> list[str]:
        """Patterns of `--allow` that do not match any refusal."""
        return [
            pattern
            for pattern in gate.allowed
            if not any(refusal.is_allowed for refusal in self._all(gate.only(pattern)))
        ]

    def _all(self, gate: Gate) -> list[Refusal]:
        return self.refusals(gate) + [refusal for mission in self.missions for refusal in mission.refusals(gate)]


def compare(before: MissionFindings, after: MissionFindings) -> MissionChange:
    """Compare the findings of a mission before and after a change. Rows are paired by id."""
    old, new = ({row.id: row for row in findings.rows} for findings in (before, after))
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
    """Yield the requirements whose status changed."""
    old, new = ({each.key: each for each in findings.requirements} for findings in (before, after))
    for key, requirement in {**old, **new}.items():
        earlier, later = (judged[key].status if key in judged else None for judged in (old, new))
        if earlier != later:
            yield RequirementMove(key, requirement.name, earlier, later, requirement.requirement_ids)


def _is_newly_broken(before: str | None, after: str | None) -> bool:
    """Whether a status became fail, or became not evaluated and was not fail before."""
    return after in BROKEN and (before is None or RANK[after] < RANK[before])


def _worse(status: str | None) -> str:
    return "is not evaluated now" if status == "not_evaluated" else "fails now"


def _is_near(before: float | None, after: float | None) -> bool:
    if before is None or after is None:
        return before is after
    return abs(after - before) < SMALL_FRACTION * max(abs(before), abs(after)) or before == after


def _status(row: Row | None) -> str | None:
    return None if row is None else row.status


def _reported(row: Row | None) -> tuple[object, ...]:
    return () if row is None else (row.status, row.declared, row.allowable, row.utilization)
