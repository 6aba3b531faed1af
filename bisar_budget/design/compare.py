"""Which parts of the catalogue are good enough for a mission."""

import json
import math
import os
from collections.abc import Iterator, Sequence
from datetime import date
from typing import NamedTuple

from bisar_budget.analysis.analysis import Analysis, Case
from bisar_budget.budget.judged_mission import JudgedMission, judged_mission
from bisar_budget.budget.requirement_table import rows_in_words
from bisar_budget.design.solve import Imaged
from bisar_budget.design.table import Standing, Variation, breaking, hold_to_decisions, standing
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.faults import MissionError, SetValue
from bisar_budget.findings.requirement import Override
from bisar_budget.findings.status import STATUS
from bisar_budget.mission.changes import parts_of
from bisar_budget.mission.load import folder_of
from bisar_budget.mission.model import Mission
from bisar_budget.mission.parts import FIGURES, Part, PartError, entries, evidence, find_part, folders
from bisar_budget.mission.quantities import QuestionError
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
        """Whether `all`, `some` or `none` of the parts comply; `waived` where none does and some are waived."""
        count = len(self.complying)
        if count:
            return "all" if count == len(self.parts) else "some"
        return "waived" if any(part.standing.status == "waived" for part in self.parts) else "none"


def is_of_parts(key: str) -> bool:
    """Whether a key names parts of the catalogue, which are compared and not solved for."""
    return parts_of(key) in {("platforms", name, section, "sensor") for name in PLATFORMS for section in _KINDS}


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
    """Check a mission with every part of the catalogue that a key can name; other arguments are those of `solve`.

    A part takes the place of the file's part of its kind; parts of other kinds stay. Without one in the file, parts
    of every kind that the key takes are tried alone.

    Parameters
    ----------
    key : str
        `platforms.NAME.motion_error.sensor` or `platforms.NAME.oscillator.sensor`.

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
        tried.append(search.checked(one, today))
        progress(done, len(search.candidates))
    found = [one.judged for one in tried if one.judged is not None]
    if not found:
        why = tried[0].reason if tried else "the catalogue has none of its kind"
        raise QuestionError(f"{key}: no part makes a mission: {why}")
    hold_to_decisions(found, row)
    # A frequency alone makes another scale of what the file states, and no part.
    if all(set(one.figures) <= {"frequency"} for one in tried):
        raise QuestionError(
            f"{key}: the file states every figure itself; no more than a frequency would be taken of a part"
        )
    states = [search.state(one, row, breaking(target)) for one in tried]
    return Comparison(
        file=mission.file,
        name=mission.name,
        key=key,
        target=target,
        row=row,
        model=variation.read().gating_model,
        kinds=search.kinds,
        kept=tuple(search.given) if len(search.given) > 1 else (),
        overridden=tuple(sorted({figure for one in tried for figure in one.stated})),
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


def _order(state: PartState) -> tuple[int, float, float, str]:
    """Sort key: what complies first, the smallest margin first; what is waived; the nearest miss; no mission last."""
    sign = -1 if state.complies else 1
    uses = (state.standing.utilization, state.own_utilization)
    # Parts that use the same but for a millionth are a tie.
    worst, own = (math.inf if use is None else sign * float(f"{use:.6g}") for use in uses)
    rank = 0 if state.complies else 1 if state.standing.status == "waived" else 2
    return rank, worst, own, state.id


class _Candidate(NamedTuple):
    """A part; of the mission with it what was judged, or why there is none, and its figures.

    `figures` are those that it takes of the part, `stated` those that the file states in place of the part's.
    """

    id: str
    file: str
    part: Part
    judged: JudgedMission | None = None
    figures: tuple[str, ...] = ()
    stated: tuple[str, ...] = ()
    reason: str = ""


class _PartSearch:
    """The parts that one key of a mission can name, and those that its file names; raises `PartError`."""

    def __init__(self, variation: Variation, key: str) -> None:
        self.variation, self.key = variation, key
        _, self.platform, self.section, _ = parts_of(key)
        beside = folder_of(variation.mission.file)
        section = getattr(getattr(variation.mission.platforms, self.platform), self.section)
        named = None if section is None else section.sensor
        names = named if isinstance(named, tuple) else [named] if named else []
        self.given = {name: find_part(name, beside) for name in names}
        of_given = {part.kind for part in self.given.values()}
        self.kinds = tuple(kind for kind in _KINDS[self.section] if not of_given or kind in of_given)
        listed = {entry.id: _Candidate(entry.id, entry.file, entry.part) for entry in entries(folders(beside))}
        own = [
            _Candidate(name, os.path.join(beside, name), part)
            for name, part in self.given.items()
            if name not in listed
        ]
        self.candidates = [one for one in (*own, *listed.values()) if one.part.kind in self.kinds]

    def value(self, name: str, kind: str) -> str:
        """Write the key's value with a part, as the file would have it."""
        others = [other for other, part in self.given.items() if part.kind != kind]
        return json.dumps([*others, name] if others else name, ensure_ascii=False)

    def checked(self, one: _Candidate, today: date) -> _Candidate:
        """Check the mission with a part."""
        try:
            mission = self.variation.read([SetValue(self.key, self.value(one.id, one.part.kind))])
        except MissionError as error:
            fault = error.faults[0]
            return one._replace(reason=f"{fault.key}: {fault.problem}")
        here = f"platforms.{self.platform}.{self.section}."
        taken = {
            each.key.rpartition(".")[2] for each in mission.taken if each.part == one.id and each.key.startswith(here)
        }
        of_part = tuple(figure for figure in FIGURES[one.part.kind] if figure in taken and getattr(one.part, figure))
        section = getattr(getattr(mission.platforms, self.platform), self.section)
        stated = tuple(each.figure for each in section.overridden if each.part == one.part.name)
        return one._replace(judged=judged_mission(Analysis(mission), today), figures=of_part, stated=stated)

    def state(self, one: _Candidate, row: str | None, breaks: frozenset[str]) -> PartState:
        """Say how the mission stands with a part."""
        state = PartState(
            id=one.id,
            name=one.part.name,
            kind=one.part.kind,
            file=one.file,
            is_given=one.id in self.given,
            figures=one.figures,
            standing=Standing(complies=False, status="error"),
            reason=one.reason,
        )
        found = one.judged
        if found is None:
            return state
        if not one.figures or one.figures == ("frequency",):
            taken = "nothing" if not one.figures else "no more than its frequency"
            return state._replace(reason=f"{taken} would be taken of it: the file states the rest")
        stands = standing(found, row, breaks)
        if row is not None and not STATUS[stands.status].is_judged:
            reason = f"{row} is {STATUS[stands.status].words} with it"
            return state._replace(standing=stands._replace(complies=False), reason=reason)
        texts = {evidence(one.part, figure) for figure in one.figures}
        own = [
            (each.utilization, each.id)
            for each in rows_in_words(found, Case(found.analysis))
            if each.owner == self.platform and each.evidence in texts and each.utilization is not None
        ]
        use, own_row = max(own, default=(None, None))
        return state._replace(standing=stands, own_row=own_row, own_utilization=use)


def mission_with(variation: Variation, key: str, part: PartState) -> Mission:
    """Read the mission with a part that was compared."""
    return variation.read([SetValue(key, _PartSearch(variation, key).value(part.id, part.kind))])
