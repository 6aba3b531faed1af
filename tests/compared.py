"""What `check` finds about a mission beside what exact ranges find (`reference.py`), number by number.

Rows are told apart by their ids; limits, shares and the gain of autofocus are those of the check's own allocation,
everything else that is compared is computed anew from the mission. Two numbers agree within 1 %, or 0.005 rad, 1 cm.
"""

import math
from collections.abc import Iterator, Sequence
from datetime import date
from typing import NamedTuple

import numpy as np

from bisar_budget.budget.check import check_mission
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.row import Row
from bisar_budget.mission.model import Mission
from tests import reference
from tests.reference import Array, Error, Responses

SHARE, FLOOR_RAD, FLOOR_M = 0.01, 0.005, 0.01
DAY = date(2026, 1, 1)  # on which waivers would be judged; the families have none


class Compared(NamedTuple):
    """One number of one row. `off` is the difference over what is allowed: a miss is above 1."""

    quantity: str
    row: str
    found: float | None
    want: float | None
    off: float

    @property
    def is_miss(self) -> bool:
        """Whether they disagree."""
        return not self.off <= 1

    def __str__(self) -> str:
        found, want = ("none" if value is None else f"{value:.6g}" for value in (self.found, self.want))
        if "allowable" in self.quantity and self.want is None and self.found is not None:
            want = "none up to there"
        return f"{self.quantity} of {self.row}: check {found}, exact ranges {want} ({self.off:.3g} of what may be)"


def compared(mission: Mission, steps: int = 120) -> list[Compared]:
    """Compare every number of a check that exact ranges speak of.

    Parameters
    ----------
    mission : Mission
        Without vibration, covariances and waivers.
    steps : int
        Sizes at which each error is tried, up to its allowable or a tenth of the slant range.
    """
    found = check_mission(mission, DAY)
    rows = {row.id: row for row in found.rows}
    errors = list(reference.errors_of(mission))
    absent = [error.id for error in errors if error.id not in rows]
    assert not absent, f"no row of {absent}"
    return [*_allowables(mission, found, rows, errors, steps), *_of_the_declared(mission, found, rows, errors)]


def _against(quantity: str, row: str, found: float | None, want: float, floor: float) -> Compared:
    """Compare a number with the one it has to be; NaN is a reference without a ground point, none a row without."""
    if found is None or math.isnan(want):
        agree = found is None and math.isnan(want)
        return Compared(quantity, row, found, None if math.isnan(want) else want, 0.0 if agree else math.inf)
    return Compared(quantity, row, found, want, abs(found - want) / max(SHARE * abs(want), floor))


def _within(quantity: str, row: str, found: float | None, wants: Sequence[float], floor: float) -> Compared:
    """Compare with the nearest value between two: of which sign a rule speaks where both are declared."""
    low, high = min(wants), max(wants)
    return _against(quantity, row, found, high if found is None else min(max(found, low), high), floor)


# ---- limits -----------------------------------------------------------------------------------------------------


def _allowables(
    mission: Mission, found: MissionFindings, rows: dict[str, Row], errors: Sequence[Error], steps: int
) -> Iterator[Compared]:
    """At the allowable the worse sign is at a limit, at no smaller size above one; none, where none is reached."""
    required = mission.requirements
    is_full = mission.gating_model == "full"
    limits, gain = _limits(found, errors), found.allocation.autofocus_gain
    caps = np.array([error.cap for error in errors])
    of_phase = np.array([_number(rows[error.id].allowable_full) for error in errors])
    of_all = np.array([_number(rows[error.id].allowable) if is_full else math.nan for error in errors])
    is_end = _ends(found, errors, of_phase)
    ends = np.where(np.isfinite(of_phase), np.minimum(1.01 * of_phase, 1.02 * caps), caps)
    marks = np.stack([of_phase * 0.99, of_phase, of_all * 0.99, of_all, of_all * 1.01], axis=1)
    grid, responses = reference.scanned(mission, errors, ends, marks, steps, limits)
    by_phase = _excess(responses.judged(gain), limits[:, None], FLOOR_RAD)
    for index, error in enumerate(errors):
        size = rows[error.id].allowable_full
        yield _allowable("allowable_full", error, size, grid[index], by_phase[index], is_end[index])
    if not is_full:
        return
    over = by_phase
    if required.cubic_phase_error is not None:
        over = np.maximum(over, _excess(responses.cubic, required.cubic_phase_error, FLOOR_RAD))
    if required.location_error is not None:
        over = np.maximum(over, _excess(responses.moved, required.location_error, FLOOR_M))
    for index, error in enumerate(errors):
        yield _allowable("allowable", error, rows[error.id].allowable, grid[index], over[index], is_end[index])


def _ends(found: MissionFindings, errors: Sequence[Error], sizes: Array) -> Array:
    """Whether allowables are where an image ends, (L,): then none is too large that is reached without a limit.

    At a fold the way of a point has a corner or an end, over which the reference may step, to another minimum of V
    too. `tests.effects.test_end_of_image` holds what lies beyond.
    """
    analysis = found.analysed()
    sources = {source.id: source for source in analysis.sources}
    ends = [
        np.isfinite(size) and analysis.full.ends_image(sources[error.id], float(size))
        for error, size in zip(errors, sizes, strict=True)
    ]
    return np.array(ends)


def _limits(found: MissionFindings, errors: Sequence[Error]) -> Array:
    """QPE limit of each error, gain included (L,). [rad]"""
    allocation = found.allocation
    return np.array([allocation.qpe_limit(error.owner) * allocation.autofocus_gain for error in errors])


def _number(value: float | None) -> float:
    return math.nan if value is None else value


def _excess(values: Array, limit: Array | float, floor: float) -> Array:
    """How far the worse sign is above a limit, in what two numbers may differ by; infinite without a ground point."""
    worse = np.abs(np.where(np.isfinite(values), values, np.inf)).max(axis=0)
    excess: Array = (worse - limit) / np.maximum(SHARE * np.asarray(limit), floor)
    return excess


def _allowable(
    quantity: str, error: Error, found: float | None, sizes: Array, excess: Array, is_end: bool = False
) -> Compared:
    """Hold one allowable to the excess (S,) over its limit at ascending sizes (S,)."""
    first = int(np.argmax(excess > 0)) if (excess > 0).any() else None
    want = None if first is None or sizes[first] > error.cap else _crossing(sizes, excess, first)
    end = error.cap if found is None else found
    if found is not None and found > error.cap * (1 + SHARE):
        return Compared(quantity, error.id, found, want, math.inf)
    before = float(excess[sizes < end * (1 - SHARE) * (1 + 1e-12)].max(initial=-math.inf))
    reached = float(excess[sizes <= end * (1 + SHARE) * (1 + 1e-12)].max(initial=-math.inf))
    off = max(before, 0.0) if found is None or is_end else max(before, -reached, 0.0)
    if found is not None and off <= 1 and not is_end:  # say how far off the phase there is, not only that it agrees
        off = max(off, min(1.0, abs(float(excess[np.searchsorted(sizes, found)]))))
    return Compared(quantity, error.id, found, want, off)


def _crossing(sizes: Array, excess: Array, first: int) -> float:
    """Size at which the excess passes zero, by the straight line between two."""
    if not first or not np.isfinite(excess[first]):
        return float(sizes[first])
    low, high = excess[first - 1], excess[first]
    return float(sizes[first - 1] + (sizes[first] - sizes[first - 1]) * -low / (high - low))


# ---- what is declared -------------------------------------------------------------------------------------------


def _of_the_declared(
    mission: Mission, found: MissionFindings, rows: dict[str, Row], errors: Sequence[Error]
) -> Iterator[Compared]:
    """Phases and displacements of the rows, and what they add up to."""
    declared = [error for error in errors if error.declared is not None]
    if not declared:
        return
    is_full = mission.gating_model == "full"
    responses = reference.at_declared(mission, declared)
    qpe, cubic = (np.abs(of).max(axis=0) for of in (responses.qpe, responses.cubic))
    equal_loss, rest = _equal_loss(responses, found.allocation.autofocus_gain), responses.rest.max(axis=0)
    for index, error in enumerate(declared):
        row = rows[error.id]
        size = abs(error.declared or 0.0)
        off = abs((row.declared or 0.0) - size) / (1e-9 * size) if size else 0.0
        yield Compared("declared", error.id, row.declared, size, off)
        yield _against("qpe_full_rad", error.id, _magnitude(row.qpe_full_rad), float(qpe[index]), FLOOR_RAD)
        equal_loss_rad = _magnitude(row.equal_loss_qpe_rad)
        yield _against("equal_loss_qpe_rad", error.id, equal_loss_rad, float(equal_loss[index]), FLOOR_RAD)
        if is_full:
            yield _against("cubic_rad", error.id, row.cubic_rad, float(cubic[index]), FLOOR_RAD)
            # It counts by its power, 2 % are 0.2 dB; the proof of the first order is one of phase and place.
            room = max(FLOOR_RAD, 2 * SHARE * float(rest[index]))
            yield _against("rest_rad", error.id, row.rest_rad, float(rest[index]), room)
            if error.owner != "clock" or row.displacement_m is not None:
                yield _displaced(row, responses.place[0, index])
    stated = [index for index, error in enumerate(declared) if error.is_stated]
    members = [declared[index] for index in stated]
    chosen = Responses(*(part[:, stated] for part in responses))
    if members and np.isfinite(chosen.qpe).all():  # of an error without a ground point nothing is summed
        yield from _together(mission, found, rows, members, chosen)


def _equal_loss(responses: Responses, gain: float) -> Array:
    """Quadratic phase of equal loss, of the sign whose phase is worse in the requirement's eyes, (L,). [rad]

    The hidden phase is what the judged one has beside the larger of both quadratic phases.
    """
    qpe, judged = np.abs(responses.qpe).max(axis=0), responses.judged(gain).max(axis=0)
    equal_loss: Array = np.sqrt(qpe**2 + (judged**2 - qpe**2) / gain**2)
    return equal_loss


def _magnitude(value: float | None) -> float | None:
    return None if value is None else abs(value)


def _displaced(row: Row, want: Array) -> Compared:
    length = float(np.hypot(*want))
    if row.displacement_m is None or math.isnan(length):
        moved = None if row.displacement_m is None else math.hypot(*row.displacement_m)
        return _against("displacement_m", row.id, moved, length, FLOOR_M)
    off = float(np.hypot(row.displacement_m[0] - want[0], row.displacement_m[1] - want[1]))
    return Compared(
        "displacement_m", row.id, math.hypot(*row.displacement_m), length, off / max(SHARE * length, FLOOR_M)
    )


def _together(
    mission: Mission,
    found: MissionFindings,
    rows: dict[str, Row],
    members: Sequence[Error],
    responses: Responses,
) -> Iterator[Compared]:
    """Aggregates by the contract's rules, from the reference's own rows."""
    rule, allocation = mission.allocation.combine, found.allocation
    owners = [error.owner for error in members]
    is_full = mission.gating_model == "full"
    gain = allocation.autofocus_gain
    qpe, cubic = (np.abs(of).max(axis=0) for of in (responses.qpe, responses.cubic))
    equal_loss = _equal_loss(responses, gain)
    if is_full and mission.allocation.split == "balanced":
        judged = np.hypot(qpe, gain * np.sqrt(equal_loss**2 - qpe**2))
        weights = [
            reference.combined(
                judged[[(owner == "transmitter") == is_first and owner != "mission" for owner in owners]], rule
            )
            for is_first in (True, False)
        ]
        share = weights[0] / sum(weights) if sum(weights) else 0.5
        share = min(0.95, max(0.05, share))
        yield _against("balanced share", "transmitter", allocation.qpe.transmitter, share, 0.001)
    others = np.array([abs(other.quadratic_phase_error or 0.0) for other in mission.other_errors])
    if rule != "each":
        for owner in ("transmitter", "receiver", "clock"):
            row_id = f"{'timing' if owner == 'clock' else owner}.quadratic_phase_error"
            parts = [allocation.qpe.includes(of, owner) for of in owners]
            if row_id in rows and any(parts):
                want = reference.combined(qpe[parts], rule)
                yield _against("qpe_full_rad", row_id, rows[row_id].qpe_full_rad, want, FLOOR_RAD)
                want = reference.combined(equal_loss[parts], rule)
                yield _against("equal_loss_qpe_rad", row_id, rows[row_id].equal_loss_qpe_rad, want, FLOOR_RAD)
        row = rows["mission.quadratic_phase_error"]
        everything = reference.combined(np.concatenate([qpe, others]), rule)
        yield _against("qpe_full_rad", row.id, row.qpe_full_rad, everything, FLOOR_RAD)
        everything = reference.combined(np.concatenate([equal_loss, others]), rule)
        yield _against("equal_loss_qpe_rad", row.id, row.equal_loss_qpe_rad, everything, FLOOR_RAD)
    if is_full:
        row = rows["mission.cubic_phase_error"]
        yield _against("cubic_rad", row.id, row.declared, reference.combined(cubic, rule), FLOOR_RAD)
        row = rows["mission.location_error"]
        both = reference.combined_places(responses.place, rule)
        as_declared = reference.combined_places(np.stack([responses.place[0], -responses.place[0]]), rule)
        yield _within("location", row.id, row.declared, (as_declared, both), FLOOR_M)
        if "mission.autofocus_pull_in" in rows:
            row = rows["mission.autofocus_pull_in"]
            yield _against("pull-in", row.id, row.declared, float(qpe.sum() + others.sum()), FLOOR_RAD)
    if mission.scene.radius is not None:
        yield _edge(mission, rows["mission.spatial_variance"], members, rule)


def _edge(mission: Mission, row: Row, members: Sequence[Error], rule: str) -> Compared:
    want = reference.at_the_edge(mission, members, rule)
    if want is None:  # a part of the rim without an image: the check says so, or is wrong
        off = 0.0 if row.qpe_full_rad is None else math.inf
        return Compared("spatial variance", row.id, row.qpe_full_rad, None, off)
    if row.qpe_full_rad is None and row.status == "not_evaluated":  # gradients within 1° of parallel somewhere
        return Compared("spatial variance, no image", row.id, None, want[0], 0.0)
    return _within("spatial variance", row.id, row.qpe_full_rad, want, FLOOR_RAD)
