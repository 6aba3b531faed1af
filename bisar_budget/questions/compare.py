"""Comparison of catalogue parts (sensors and oscillators): the verdict on a mission with each part in turn."""

import json
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from datetime import date
from typing import NamedTuple

from bisar_budget.analysis.analysis import Analysis, Case
from bisar_budget.budget.judged_mission import JudgedMission, judged_mission
from bisar_budget.budget.requirement_table import rows_in_words
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.faults import MissionError, SetValue
from bisar_budget.findings.solution import Comparison, PartState, Standing
from bisar_budget.findings.status import STATUS
from bisar_budget.mission.changes import parts_of
from bisar_budget.mission.load import folder_of
from bisar_budget.mission.model import Mission
from bisar_budget.mission.parts import FIGURES, Part, PartError, entries, evidence, find_part, folders
from bisar_budget.mission.platforms import Platform
from bisar_budget.mission.quantities import QuestionError
from bisar_budget.questions.table import Question, Variation, hold_to_decisions, standing
from bisar_budget.workers import Progress

# Sections of a platform that name parts, with the kinds of part that they accept.
_PART_KINDS_BY_SECTION: Mapping[str, tuple[str, ...]] = {
    "motion_error": ("imu", "gnss"),
    "motion_error.navigation.imu": ("imu",),
    "motion_error.navigation.gnss": ("gnss",),
    "oscillator": ("oscillator",),
}


def is_sensor_key(key: str) -> bool:
    """Whether a key takes the names of catalogue parts as values, so that `solve` compares parts for this key."""
    return key in {f"platforms.{name}.{section}.sensor" for name in PLATFORMS for section in _PART_KINDS_BY_SECTION}


def compare_parts(mission: Mission, question: Question, progress: Progress) -> Comparison:
    """Check a mission with every part of the catalogue that a key can name.

    Each part replaces the part of the same kind in the file; parts of other kinds are kept. If the file names no
    part, parts of every kind that the key accepts are tried one at a time. The key of the question is
    `platforms.NAME.motion_error.sensor`, the key `sensor` of `imu` or `gnss` in
    `platforms.NAME.motion_error.navigation`, or `platforms.NAME.oscillator.sensor`.

    Returns
    -------
    Comparison
        Complying parts in ascending order of margin, followed by all other parts.

    Raises
    ------
    QuestionError
        The catalogue cannot be read, no part has the right kind, the mission takes no figure from any part, or no row
        decides the verdict.
    """
    (key,) = question.keys
    variation = Variation(mission, question.model)
    try:
        search = _PartSearch(variation, key)
    except PartError as error:
        raise QuestionError(f"{key}: {error}") from None
    tried = []
    for done, candidate in enumerate(search.candidates, 1):
        tried.append(search.checked(candidate, question.today))
        progress(done, len(search.candidates))
    judged_missions = [candidate.judged for candidate in tried if candidate.judged is not None]
    if not judged_missions:
        reason = tried[0].reason if tried else "the catalogue has none of its kind"
        raise QuestionError(f"{key}: no part makes a mission: {reason}")
    hold_to_decisions(judged_missions, question.row)
    # A part that gives only a frequency rescales the file's own figures, and is no part to compare.
    if all(set(candidate.figures) <= {"frequency"} for candidate in tried):
        raise QuestionError(
            f"{key}: the file states every figure itself; no more than a frequency would be taken of a part"
        )
    states = [search.state(candidate, question) for candidate in tried]
    return Comparison(
        file=mission.file,
        name=mission.name,
        key=key,
        target=question.target,
        row=question.row,
        model=variation.read().gating_model,
        kinds=search.kinds,
        kept=tuple(search.given) if len(search.given) > 1 else (),
        overridden=tuple(sorted({figure for candidate in tried for figure in candidate.stated})),
        parts=tuple(sorted(_with_silence(states, key), key=_order)),
        changes=mission.changes,
    )


def _with_silence(states: Sequence[PartState], key: str) -> Iterator[PartState]:
    """Yield the states with `silent_on` filled in.

    `silent_on` lists the figures that other parts of the same kind state but this part does not. It is empty for an
    inertial unit of an aided navigation: its scale factor only widens the prior of a bias.
    """
    is_aided = ".navigation." in key
    for state in states:
        if state.standing.status == "error":
            yield state
            continue
        figures_of_kind = dict.fromkeys(
            figure for each in states if each.kind == state.kind for figure in each.figures
        )
        if state.kind == "oscillator":  # its forms of noise replace each other
            figures_of_kind = {figure: None for figure in figures_of_kind if figure == "acceleration_sensitivity"}
        if is_aided and state.kind == "imu":  # navigation refuses units without a needed figure
            figures_of_kind = {}
        yield state._replace(silent_on=tuple(figure for figure in figures_of_kind if figure not in state.figures))


def _order(state: PartState) -> tuple[int, float, float, str]:
    """Return the sort key of a part: complying parts come first, then waived parts, then all other parts.

    Complying parts are sorted by ascending margin, and all other parts by ascending excess. Within each group, parts
    without a utilization, for example because the mission is invalid with them, come last.
    """
    sign = -1 if state.complies else 1
    uses = (state.standing.utilization, state.own_utilization)
    # Utilizations that agree to six digits are a tie.
    worst, own_use = (math.inf if use is None else sign * float(f"{use:.6g}") for use in uses)
    rank = 0 if state.complies else 1 if state.standing.status == "waived" else 2
    return rank, worst, own_use, state.id


class _Candidate(NamedTuple):
    """A part of the catalogue to try, and the judged mission with this part.

    If the mission is invalid with the part, `judged` is None and `reason` is set. `figures` are the figures that the
    mission takes from the part. `stated` are figures of the part that are overridden by the mission file.
    """

    id: str
    file: str
    part: Part
    judged: JudgedMission | None = None
    figures: tuple[str, ...] = ()
    stated: tuple[str, ...] = ()
    reason: str = ""


class _PartSearch:
    """Search over the parts that a key can name; the mission is checked with each of them.

    `given` are the parts that the mission file names, and `candidates` are all parts to try. The constructor raises
    `PartError` if the catalogue cannot be read.
    """

    def __init__(self, variation: Variation, key: str) -> None:
        self.variation, self.key = variation, key
        _, self.platform, *section_keys, _ = parts_of(key)
        self.section = ".".join(section_keys)
        folder = folder_of(variation.mission.file)
        platform: Platform = getattr(variation.mission.platforms, self.platform)
        names = [name for path, name in platform.part_names.items() if path.startswith(f"{self.section}.sensor")]
        self.given = {name: find_part(name, folder) for name in names}
        given_kinds = {device.kind for device in self.given.values()}
        self.kinds = tuple(
            kind for kind in _PART_KINDS_BY_SECTION[self.section] if not given_kinds or kind in given_kinds
        )
        catalogued = {entry.id: _Candidate(entry.id, entry.file, entry.part) for entry in entries(folders(folder))}
        project_files = [
            _Candidate(name, os.path.join(folder, name), device)
            for name, device in self.given.items()
            if name not in catalogued
        ]
        self.candidates = [each for each in (*project_files, *catalogued.values()) if each.part.kind in self.kinds]

    def value(self, name: str, kind: str) -> str:
        """Make a value for the key in which the part `name` is the only part of the kind `kind`.

        Parts of other kinds that the mission file names are kept. The value is a string as in a mission file.
        """
        kept = [named for named, device in self.given.items() if device.kind != kind]
        return json.dumps([*kept, name] if kept else name, ensure_ascii=False)

    def checked(self, candidate: _Candidate, today: date) -> _Candidate:
        """Judge the mission with a candidate, or find the reason why the mission is invalid with this candidate."""
        try:
            mission = self.variation.read([SetValue(self.key, self.value(candidate.id, candidate.part.kind))])
        except MissionError as error:
            fault = error.faults[0]
            return candidate._replace(reason=f"{fault.key}: {fault.problem}")
        prefix = f"platforms.{self.platform}.{self.section}."
        taken = {
            each.key.rpartition(".")[2]
            for each in mission.taken
            if each.part == candidate.id and each.key.startswith(prefix)
        }
        part_figures = tuple(
            figure for figure in FIGURES[candidate.part.kind] if figure in taken and getattr(candidate.part, figure)
        )
        platform: Platform = getattr(mission.platforms, self.platform)
        stated = tuple(
            each.figure.rpartition(".")[2]
            for each in platform.overridden
            if each.part == candidate.part.name and each.key.startswith(self.section)
        )
        return candidate._replace(
            judged=judged_mission(Analysis(mission), today), figures=part_figures, stated=stated
        )

    def state(self, candidate: _Candidate, question: Question) -> PartState:
        """Make the state of a checked candidate, which contains the verdict on the mission with this part.

        If the question is about a row, the verdict is on this row alone.
        """
        state = PartState(
            id=candidate.id,
            name=candidate.part.name,
            kind=candidate.part.kind,
            file=candidate.file,
            is_given=candidate.id in self.given,
            figures=candidate.figures,
            standing=Standing(complies=False, status="error"),
            reason=candidate.reason,
        )
        judged = candidate.judged
        if judged is None:
            return state
        if not candidate.figures or candidate.figures == ("frequency",):
            taken = "nothing" if not candidate.figures else "no more than its frequency"
            return state._replace(reason=f"{taken} would be taken of it: the file states the rest")
        row = question.row
        part_standing = standing(judged, row, question.breaks)
        if row is not None and not STATUS[part_standing.status].is_judged:
            reason = f"{row} is {STATUS[part_standing.status].words} with it"
            return state._replace(standing=part_standing._replace(complies=False), reason=reason)
        texts = {evidence(candidate.part, figure) for figure in candidate.figures}
        own_rows = [
            (each.utilization, each.id)
            for each in rows_in_words(judged, Case(judged.analysis))
            if each.owner == self.platform
            and any(text in (each.evidence or "") for text in texts)
            and each.utilization is not None
        ]
        use, own_row = max(own_rows, default=(None, None))
        return state._replace(standing=part_standing, own_row=own_row, own_utilization=use)


def mission_with(variation: Variation, key: str, state: PartState) -> Mission:
    """Read the mission with one of the compared parts, given by `state`, as the value of the key."""
    return variation.read([SetValue(key, _PartSearch(variation, key).value(state.id, state.kind))])
