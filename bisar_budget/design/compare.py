"""Which parts of the catalogue are good enough for a mission."""

import json
import math
import os
from collections.abc import Iterator, Sequence
from datetime import date
from typing import Any, NamedTuple

from bisar_budget.analysis.analysis import Analysis, Case
from bisar_budget.budget.judged_mission import JudgedMission, judged_mission
from bisar_budget.budget.requirement_table import rows_in_words
from bisar_budget.design.quantities import QuestionError, tree_of
from bisar_budget.design.solve import Imaged
from bisar_budget.design.table import Standing, Variation, breaking, hold_to_decisions, standing
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.faults import MissionError, SetValue
from bisar_budget.findings.requirement import Override
from bisar_budget.findings.status import STATUS
from bisar_budget.mission.changes import parts_of
from bisar_budget.mission.model import Mission
from bisar_budget.mission.parts import FIGURES, Part, PartError, entries, evidence, find_part, folders
from bisar_budget.workers import Progress, unseen

_KINDS = {"motion_error": ("imu", "gnss"), "oscillator": ("oscillator",)}


class PartState(NamedTuple):
    """How the mission stands with one part.

    `figures` are those that the mission takes of it; the file's own stand before them. `silent_on` are figures that
    the mission takes of other parts of the kind and this one does not state: they stay undeclared. `own_row` uses
    most of its limit among the rows that rest on these figures alone. `is_given` marks the part that the file names.
    `reason` says why it does not comply where no row does; empty else.
    """

    id: str
    name: str
    kind: str
    file: str
    is_given: bool
    figures: tuple[str, ...]
    standing: Standing
    own_row: str | None = None
    own_utilization: float | None = None
    reason: str = ""
    silent_on: tuple[str, ...] = ()

    @property
    def complies(self) -> bool:
        """Whether the mission does with it."""
        return self.standing.complies


class Comparison(NamedTuple):
    """Parts for one key of one mission.

    `parts` has those that comply first, the smallest margin first, then the others, the nearest miss first. `kinds`
    are those that were compared, `kept` parts of other kinds that stay. `overridden` are figures that parts have and
    the file states itself. `imaged` is what images say of the part with the smallest margin, if any were formed.
    `overrides` is what from outside the file bears on it.
    """

    file: str
    name: str
    key: str
    target: str
    row: str | None
    model: str
    kinds: tuple[str, ...]
    kept: tuple[str, ...]
    overridden: tuple[str, ...]
    parts: tuple[PartState, ...]
    changes: tuple[SetValue, ...] = ()
    imaged: Imaged | None = None
    overrides: tuple[Override, ...] = ()

    @property
    def complying(self) -> tuple[PartState, ...]:
        """The parts with which the mission complies."""
        return tuple(part for part in self.parts if part.complies)

    @property
    def status(self) -> str:
        """Whether `all`, `some` or `none` of the parts comply."""
        count = len(self.complying)
        return "none" if count == 0 else "all" if count == len(self.parts) else "some"


def is_of_parts(key: str) -> bool:
    """Whether a key names parts of the catalogue, which are compared and not solved for."""
    parts = parts_of(key)
    return (
        len(parts) == 4
        and parts[0] == "platforms"
        and parts[1] in PLATFORMS
        and parts[2] in _KINDS
        and (parts[3] == "sensor")
    )


def compare_parts(
    mission: Mission,
    key: str,
    *,
    row: str | None = None,
    target: str = "fail",
    model: str | None = None,
    today: date,
    progress: Progress = unseen,
) -> Comparison:
    """Check a mission with every part of the catalogue that a key can name.

    A part takes the place of the file's part of its kind; parts of other kinds stay. Without one in the file, parts
    of every kind that the key takes are tried alone.

    Parameters
    ----------
    mission : Mission
        As loaded; the file that it came from is read anew for each part, with the options that changed it.
    key : str
        `platforms.NAME.motion_error.sensor` or `platforms.NAME.oscillator.sensor`.
    row : str, optional
        Id of the row that has to comply, instead of the whole mission.
    target : str
        fail: what `check` exits with 0 on complies; warn: what `check --strict` does.
    model : str, optional
        Gating model in place of the mission's own.
    today : date
        Day on which waivers are judged, UTC.
    progress : callable, optional
        Is told how many parts are done, and how many there are.

    Returns
    -------
    Comparison
        Parts in the order of their margins.

    Raises
    ------
    QuestionError
        The catalogue cannot be read, no part is of the right kind, the mission takes nothing of any, or nothing
        decides.
    """
    if not is_of_parts(key):
        raise QuestionError(f"{key}: takes no parts; accepted: platforms.receiver.motion_error.sensor and the like")
    variation = Variation(mission, model)
    try:
        search = _PartSearch(variation, key)
    except PartError as error:
        raise QuestionError(f"{key}: {error}") from None
    tried = []
    for done, one in enumerate(search.candidates, 1):
        tried.append((one, search.checked(one, today)))
        progress(done, len(search.candidates))
    found = [checked.judged for _, checked in tried if checked.judged is not None]
    if not found:
        why = tried[0][1].reason if tried else "the catalogue has none of its kind"
        raise QuestionError(f"{key}: no part makes a mission: {why}")
    hold_to_decisions(found, row)
    if not any(checked.figures for _, checked in tried):
        raise QuestionError(f"{key}: the file states every figure itself; nothing of a part would be taken")
    breaks = breaking(target)
    states = [search.state(one, checked, row, breaks) for one, checked in tried]
    return Comparison(
        file=mission.file,
        name=mission.name,
        key=key,
        target=target,
        row=row,
        model=variation.read().gating_model,
        kinds=search.kinds,
        kept=search.kept,
        overridden=search.overridden(states),
        parts=tuple(sorted(_with_silence(states), key=_order)),
        changes=mission.changes,
    )


def _with_silence(states: Sequence[PartState]) -> Iterator[PartState]:
    """Note of inertial sensors and GNSS which figures only others of their kind have."""
    for state in states:
        if state.standing.status == "error":
            yield state
            continue
        known = dict.fromkeys(figure for other in states if other.kind == state.kind for figure in other.figures)
        if state.kind == "oscillator":  # whose forms of noise stand in for each other
            known = {figure: None for figure in known if figure == "acceleration_sensitivity"}
        yield state._replace(silent_on=tuple(figure for figure in known if figure not in state.figures))


def _order(state: PartState) -> tuple[bool, float, float, str]:
    """Sort key: what complies first, the smallest margin first; then the nearest miss, at last what is no mission."""
    sign = -1 if state.complies else 1
    uses = (state.standing.utilization, state.own_utilization)
    worst, own = (math.inf if use is None else sign * use for use in uses)
    return not state.complies, worst, own, state.id


class _Candidate(NamedTuple):
    id: str
    file: str
    part: Part


class _CheckedPart(NamedTuple):
    """The mission with a part, judged; the figures that it takes of the part; why there is no mission."""

    judged: JudgedMission | None
    figures: tuple[str, ...] = ()
    reason: str = ""


class _PartSearch:
    """The parts that one key of a mission can name; raises `PartError`."""

    def __init__(self, variation: Variation, key: str) -> None:
        self.variation, self.key = variation, key
        _, self.platform, self.section, _ = parts_of(key)
        file = variation.mission.file
        beside = os.path.dirname(file) if file != "-" else ""
        self.given = {name: find_part(name, beside) for name in _names(tree_of(variation.mission), parts_of(key))}
        of_given = {part.kind for part in self.given.values()}
        self.kinds = tuple(kind for kind in _KINDS[self.section] if not of_given or kind in of_given)
        listed = {entry.id: _Candidate(entry.id, entry.file, entry.part) for entry in entries(folders(beside))}
        own = {
            name: _Candidate(name, os.path.join(beside, name), part)
            for name, part in self.given.items()
            if name not in listed
        }
        self.candidates = [one for one in (own | listed).values() if one.part.kind in self.kinds]

    @property
    def kept(self) -> tuple[str, ...]:
        """Names of the file's parts of which another kind is compared too: each stays while the others change."""
        return tuple(self.given) if len(self.given) > 1 else ()

    def value(self, name: str, kind: str) -> str:
        """Write the key's value with a part, as the file would have it."""
        others = [other for other, part in self.given.items() if part.kind != kind]
        return json.dumps([*others, name] if others else name, ensure_ascii=False)

    def checked(self, one: _Candidate, today: date) -> _CheckedPart:
        """Check the mission with a part."""
        try:
            mission = self.variation.read([SetValue(self.key, self.value(one.id, one.part.kind))])
        except MissionError as error:
            fault = error.faults[0]
            return _CheckedPart(None, reason=f"{fault.key}: {fault.problem}")
        return _CheckedPart(judged_mission(Analysis(mission), today), self._taken(mission, one.part))

    def _taken(self, mission: Mission, part: Part) -> tuple[str, ...]:
        platform = getattr(mission.platforms, self.platform)
        taken = {} if self.section == "oscillator" else dict(platform.motion_error.of_parts)
        if self.section == "oscillator":
            taken = dict.fromkeys(FIGURES["oscillator"], platform.oscillator.source)
            taken |= dict(platform.oscillator.of_parts)
        figures = (figure for figure in FIGURES[part.kind] if getattr(part, figure))
        return tuple(figure for figure in figures if taken.get(figure) == evidence(part, figure))

    def state(self, one: _Candidate, checked: _CheckedPart, row: str | None, breaks: frozenset[str]) -> PartState:
        """Say how the mission stands with a part."""
        state = PartState(
            id=one.id,
            name=one.part.name,
            kind=one.part.kind,
            file=one.file,
            is_given=one.id in self.given,
            figures=checked.figures,
            standing=Standing(complies=False, status="error"),
            reason=checked.reason,
        )
        found = checked.judged
        if found is None:
            return state
        stands = standing(found, row, breaks)
        if row is not None and not STATUS[stands.status].is_judged:
            reason = f"{row} is {STATUS[stands.status].words} with it"
            return state._replace(standing=stands._replace(complies=False), reason=reason)
        texts = {evidence(one.part, figure) for figure in checked.figures}
        own = [
            (each.utilization, each.id)
            for each in rows_in_words(found, Case(found.analysis))
            if each.owner == self.platform and each.evidence in texts and each.utilization is not None
        ]
        use, own_row = max(own, default=(None, None))
        return state._replace(standing=stands, own_row=own_row, own_utilization=use)

    def overridden(self, states: Sequence[PartState]) -> tuple[str, ...]:
        """Figures that parts have, and that the mission takes of none."""
        offered = {
            figure for one in self.candidates for figure in FIGURES[one.part.kind] if getattr(one.part, figure)
        }
        taken = {figure for state in states for figure in state.figures}
        return tuple(sorted(offered - taken))


def _names(tree: Any, parts: Sequence[str]) -> list[str]:
    """Parts that the file names at a key."""
    for part in parts:
        tree = tree.get(part) if isinstance(tree, dict) else None
    return tree if isinstance(tree, list) else [tree] if isinstance(tree, str) else []


def mission_with(variation: Variation, key: str, part: PartState) -> Mission:
    """Read the mission with a part that was compared."""
    return variation.read([SetValue(key, _PartSearch(variation, key).value(part.id, part.kind))])
