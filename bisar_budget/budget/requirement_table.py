"""The table of requirements of one mission, with its words: what is asked, what is reached, what decides."""

import math
from collections.abc import Sequence
from datetime import date
from typing import NamedTuple

import numpy as np

from bisar_budget import phrases
from bisar_budget.analysis.allocation import Allocation
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.analysis.spread import islr_db, mainlobe_energy, noise, spread_limit, tones
from bisar_budget.analysis.together import Together
from bisar_budget.analysis.vibration_limits import level_of
from bisar_budget.budget.aggregates import effect_parts, effect_totals, misplacing
from bisar_budget.budget.input_doubt import InputDoubt
from bisar_budget.budget.requirement_states import (
    KEYS,
    TAKEN_BY,
    UNITS,
    RequirementState,
    SeenRow,
    UntakenEffect,
    code,
    requirement_states,
    status_of,
    untaken_effects,
)
from bisar_budget.budget.waivers import Waived, apply_waivers
from bisar_budget.effects.combined import Phases
from bisar_budget.effects.declared import CUBIC, LOCATION, QUADRATIC
from bisar_budget.findings.mission import FileWarning
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.findings.row import Row
from bisar_budget.findings.status import STATUS
from bisar_budget.mission.model import Mission
from bisar_budget.phrases import NOTHING, Note

_STATUSES = tuple(STATUS)
_EXAMPLES = {CUBIC: "22.5 deg", "islr": "-20 dB", "pslr": "-30 dB"}


class JudgedMission(NamedTuple):
    """Rows with what they could not be judged by, the table of requirements, and what is to be said of the whole."""

    rows: list[Row]
    requirements: tuple[JudgedRequirement, ...]
    warnings: list[FileWarning]
    notes: list[Note]


def judged_requirements(
    rows: Sequence[Row], analysis: Analysis, allocation: Allocation, doubts: Sequence[InputDoubt], today: date
) -> JudgedMission:
    """Judge every requirement of a mission, after waivers.

    Parameters
    ----------
    rows : sequence of Row
        As judged, each for itself.
    analysis : Analysis
        Of the mission.
    allocation : Allocation
        Shares of the budgets, and the gain of autofocus.
    doubts : sequence of InputDoubt
        Of the paths, by more than the file declares.
    today : date
        Day on which waivers are judged, UTC.
    """
    mission = analysis.mission
    untaken = untaken_effects(mission, effect_totals(effects_by(analysis)))
    looked_at = [_looked_at(row, mission, untaken) for row in rows]
    unknown_place = _unknown_place(analysis, rows) or (doubts[0].note if doubts else NOTHING)
    if unknown_place and mission.requirements.location_error is not None:
        looked_at = [_misplaced(row, unknown_place) for row in looked_at]
    has_noise = any(noise(mission, analysis.random, model) for model in analysis.gates) or (
        mission.requirements.pslr is None and bool(tones(mission))
    )
    if not has_noise:
        looked_at = [_of_a_cubic_alone(row) for row in looked_at]
    waived = apply_waivers(looked_at, mission, today)
    seen = [
        _seen(waived.rows[place] if waived.rows[place].status == "waived" and is_broken(row) else row, allocation)
        for place, row in enumerate(rows)
    ]
    states = requirement_states(
        mission,
        seen,
        {key: True for key in KEYS if f"mission.{key}" in waived.requirements},
        has_noise=has_noise,
        is_misplaced=bool(unknown_place),
    )
    requirements = tuple(_entry(state, waived, analysis, allocation, unknown_place) for state in states)
    notes = [
        phrases.effect_is_negligible(one.kind, float(one.total[0]), list(TAKEN_BY[one.kind]))
        for one in untaken
        if one.is_negligible[0]
    ]
    return JudgedMission(waived.rows, requirements, waived.unused(requirements), notes)


def is_broken(row: Row) -> bool:
    """Whether a waiver could cover a row as it stands."""
    return row.status in ("fail", "not_evaluated")


def effects_by(analysis: Analysis) -> list[tuple[Together, dict[str, Phases]]]:
    """The declared errors by each model that gates, and the parts of each effect."""
    mission, of_tones = analysis.mission, tones(analysis.mission)
    both = ((analysis.together(model), noise(mission, analysis.random, model)) for model in analysis.gates)
    return [(together, effect_parts(together, spreads, of_tones)) for together, spreads in both]


def _looked_at(row: Row, mission: Mission, untaken: Sequence[UntakenEffect]) -> Row:
    """A row whose effects are looked at too: what no requirement takes is not judged, or negligible."""
    if not any(row.id in one.parts for one in untaken):
        return row
    status = _STATUSES[status_of(code(row.status), row.id, row.allowable is not None, untaken)[0]]
    if status == "info":
        return row if row.status == "info" else row._replace(status=status, utilization=None, margin=None)
    said = [row.reason] if status == "fail" and row.reason else []  # known to be broken, and more of it is not judged
    for one in untaken:
        if row.id in one.makers and one.makers[row.id][0]:
            lines = [f"{key}: {_EXAMPLES[key]}" for key in TAKEN_BY[one.kind]]
            parts = float(one.parts[row.id][0]), float(one.total[0])
            said.append(phrases.effect_is_not_judged(one.kind, *parts, lines))
    return row._replace(status=status, reason=said[0].then(*said[1:]) if said else row.reason)


def _of_a_cubic_alone(row: Row) -> Row:
    """A sum of powers without anything that spreads: it shows the cubic phase, and does not judge ISLR."""
    if row.subject.kind != "islr" or row.status in ("fail", "not_declared"):
        return row
    return row._replace(status="not_evaluated", reason=phrases.nothing_judges("islr"))


def _unknown_place(analysis: Analysis, rows: Sequence[Row]) -> Note:
    """Say which errors displace the image by an amount that no row holds: what varies at random, or slowly."""
    place = next((row.declared for row in rows if row.id == f"mission.{LOCATION}"), None)
    found = misplacing(analysis.together("full"), np.array([math.nan if place is None else place]))
    at_random, slow = ([row_id for row_id, is_there in of_kind if is_there[0]] for of_kind in found)
    if not slow and not at_random:
        return NOTHING
    causes = [*(["random errors"] if at_random else []), *(["slow vibration"] if slow else [])]
    cause = f"{' and '.join(causes)} {'move' if at_random else 'moves'}"
    return phrases.place_is_not_known([*at_random, *slow], cause)


def _misplaced(row: Row, unknown_place: Note) -> Row:
    is_location = row.owner == "mission" and row.subject.kind == LOCATION
    if not is_location or row.status in ("fail", "not_declared"):
        return row
    return row._replace(status="not_evaluated", reason=unknown_place)


def _seen(row: Row, allocation: Allocation) -> SeenRow:
    """A row as an array of one case."""
    binding = row.binding_requirement or row.metric
    key = binding if binding in KEYS else row.metric
    if row.is_of_declare and row.metric != "declare":
        key = ""  # judges nothing: it is not declared
    qpe = row.qpe_full_rad if row.model == "full" else row.qpe_published_rad
    use = math.nan
    if qpe is not None and row.metric == QUADRATIC:
        use = abs(qpe) / (allocation.qpe_limit(row.owner) * allocation.autofocus_gain)
    return SeenRow(
        row.id,
        code(row.status),
        np.array([math.nan if row.utilization is None else row.utilization]),
        np.array([KEYS.index(key) if key in KEYS else -1], dtype=np.int8),
        np.array([use]),
    )


# ---------------------------------------------------------------------- words
def _entry(
    state: RequirementState, waived: Waived, analysis: Analysis, allocation: Allocation, unknown_place: Note
) -> JudgedRequirement:
    mission, key = analysis.mission, state.key
    rows = waived.rows
    value = getattr(mission.requirements, key)
    status = _STATUSES[state.status[0]]
    decider = rows[state.decider[0]] if state.decider[0] >= 0 else None
    allowed, reached = _sizes(decider, key, mission, allocation) if decider is not None else (None, None)
    reason: Note | None = None
    if status == "not_evaluated" and (decider is None or decider.status != status or key == "islr"):
        reason = _why_not_judged(key, unknown_place)
    elif decider is not None and status not in ("pass", "info"):
        reason = decider.reason
    path = ("requirements", key)
    return JudgedRequirement(
        key=key,
        value=None if key == "declare" else value,
        unit=UNITS[key],
        is_default=path not in mission.places and not mission.is_changed(path),
        status=status,
        allowed=allowed,
        reached=reached,
        utilization=None if decider is None or decider.utilization is None else float(state.utilization[0]),
        row=None if decider is None else decider.id,
        rows=tuple(row.id for row, judges in zip(rows, state.judges[:, 0], strict=True) if judges),
        reason=reason,
        line=mission.line(path),
        waivers=waived.requirements.get(f"mission.{key}", ()),
    )


def _why_not_judged(key: str, unknown_place: Note) -> Note:
    if key == LOCATION and unknown_place:
        return unknown_place
    return phrases.nothing_judges(key)


def _sizes(row: Row, key: str, mission: Mission, allocation: Allocation) -> tuple[float | None, float | None]:
    """Size that a row is allowed, and size that it reaches, in the unit of a requirement that it judges."""
    if row.declared is None and row.metric != key:
        return None, None
    if row.unit == UNITS[key] and (
        row.subject.kind in (key, QUADRATIC, "spatial_variance", "autofocus_pull_in", "other")
        or (key == "pslr" and row.unit == "dB")
    ):
        return row.allowable, row.declared
    if key == QUADRATIC:
        qpe = row.qpe_full_rad if row.model == "full" else row.qpe_published_rad
        limit = allocation.qpe_limit(row.owner) * allocation.autofocus_gain
        return limit, None if qpe is None else abs(qpe)
    if key == CUBIC:
        return mission.requirements.cubic_phase_error, row.cubic_rad
    if key == LOCATION:
        moved = None if row.displacement_m is None else math.hypot(*row.displacement_m)
        return mission.requirements.location_error, moved
    if key == "islr":
        model = row.model or "full"
        limit, use = spread_limit(mission, allocation, row.owner, model) or 0.0, row.utilization or 0.0
        sizes = [islr_db(rms**2, model, mainlobe_energy(mission)) if rms else None for rms in (limit, limit * use)]
        return sizes[0], sizes[1]
    k = 2 * math.pi / mission.radar.wavelength
    levels = [None if size is None else _echo_db(k * size) for size in (row.allowable, row.declared)]
    return levels[0], levels[1]


def _echo_db(phase: float) -> float | None:
    amplitude = level_of(phase)
    return 20 * math.log10(amplitude) if amplitude else None
