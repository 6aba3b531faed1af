"""What the declared errors add up to: phases of platforms and mission, cubic phase, location, autofocus pull-in."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial

from bisar_budget.budget.allocation import Allocation
from bisar_budget.budget.correlation import (
    Correlated,
    combined_displacement,
    combined_phase,
    correlated_errors,
    correlation_notes,
    displacement_parts,
    phase_parts,
)
from bisar_budget.budget.effects import ErrorSource, ImagePlane, image_plane
from bisar_budget.budget.findings import Row
from bisar_budget.budget.judgement import judged
from bisar_budget.budget.pull_in import caps, needed_sentence
from bisar_budget.budget.validity import Beyond, FirstOrder, of_members
from bisar_budget.constants import UTILIZATION_TOLERANCE
from bisar_budget.geometry import GroundVector
from bisar_budget.mission.model import Mission
from bisar_budget.units import format_limit, format_quantity

NO_REQUIREMENT = "no requirement in the file: computed, not judged"


def aggregate_rows(
    mission: Mission,
    allocation: Allocation,
    sources: Sequence[ErrorSource],
    errors: Sequence[Row],  # of the sources, in their order
    plane: ImagePlane,
    first_order: FirstOrder,
) -> Iterator[Row]:
    """Rows of the declared errors together, under the mission's rule of combination."""
    combine, model = mission.allocation.combine, mission.allocation.model
    groups = correlated_errors(mission)
    notes = correlation_notes(combine, groups) if combine != "each" else ()
    stated = [source for source in sources if source.declared is not None]
    declared = [source for source in stated if source.is_independent]
    if combine != "each":
        yield from _qpe_aggregates(mission, allocation, declared, groups, first_order)
    # `each` looks at single rows, those along the scene's axes included.
    motion = [source for source in (stated if combine == "each" else declared) if source.is_motion]
    cubic_limit, cubic_doubt = mission.requirements.cubic_phase_error, ""
    other = {"published": "full", "full": "published"}.get(model)
    if cubic_limit is not None and other is not None and motion:
        cubic = combined_phase(motion, "cubic", other, combine, groups)
        if cubic > cubic_limit * (1 + UTILIZATION_TOLERANCE):
            cubic_doubt = f"the {other} model says fail: {cubic:.3g} rad, {format_limit(cubic_limit, 'rad')} allowed"
    found = first_order.found
    cubic_notes: tuple[str, ...] = ()
    if found and motion:
        by_exact = combined_phase(first_order.exactly(motion), "cubic", "full", combine, groups)
        cubic_notes, exact_doubt = of_members(found, motion, by_exact, cubic_limit, "rad")
        cubic_doubt = cubic_doubt or exact_doubt
    cubic_phase = combined_phase(motion, "cubic", model, combine, groups) if motion else None
    over = _exceeded(
        "cubic phase", cubic_phase, cubic_limit, "rad", lambda: phase_parts(motion, "cubic", model, combine, groups)
    )
    yield judged(
        mission,
        id="mission.cubic_phase_error",
        metric="cubic_phase_error",
        unit="rad",
        declared=cubic_phase,
        allowable=cubic_limit,
        path=("requirements", "cubic_phase_error"),
        equation="Table I, cubic column" if model == "published" else "full model",
        no_limit=NO_REQUIREMENT,
        info="" if cubic_limit is not None else NO_REQUIREMENT,
        over=f"{over}; autofocus gain does not apply",
        doubt=cubic_doubt,
        notes=(*notes, *_strictest(combine, model), *cubic_notes),
    )
    counted = {source.id for source in motion}
    known = [(row.id, row.displacement_m) for row in errors if row.displacement_m is not None and row.id in counted]
    moved = combined_displacement(known, combine, groups) if motion and len(known) == len(motion) else None
    if model == "strictest" and moved is not None:
        by_25 = image_plane(mission.geometry)
        published = [(s.id, by_25.displacement(s.effect, s.declared or 0.0)) for s in motion]
        moves = [(row_id, move) for row_id, move in published if move is not None]
        moved = max(moved, combined_displacement(moves, combine, groups))
    location_notes: tuple[str, ...] = ()
    location_doubt = _location_doubt(mission, motion, first_order.ground.plane, groups)
    if found and motion:
        exact_moves = [(s.id, _moved_exactly(s, found, first_order.ground.plane)) for s in motion]
        location_notes, exact_doubt = of_members(
            found,
            motion,
            combined_displacement(exact_moves, combine, groups),
            mission.requirements.location_error,
            "m",
        )
        location_doubt = location_doubt or exact_doubt
    yield judged(
        mission,
        id="mission.location_error",
        metric="location_error",
        unit="m",
        declared=moved,
        allowable=mission.requirements.location_error,
        path=("requirements", "location_error"),
        equation="(25)" if model == "published" else "full model",
        no_limit=NO_REQUIREMENT,
        not_evaluated=plane.degeneracy if model == "published" else "",
        is_declared=bool(motion),
        info="" if mission.requirements.location_error is not None else NO_REQUIREMENT,
        over=_exceeded(
            "displacement of the image",
            moved,
            mission.requirements.location_error,
            "m",
            lambda: [(row_id, math.hypot(*move)) for row_id, move in displacement_parts(known, combine, groups)],
        ),
        doubt=location_doubt,
        notes=(*notes, *location_notes),
    )
    if allocation.n_pull is not None:
        pull_in = math.pi * allocation.n_pull
        total = math.fsum(abs(s.qpe(model)) for s in declared) if declared else None
        pull_in_notes: tuple[str, ...] = ()
        pull_in_doubt = ""
        if found:
            by_exact = math.fsum(abs(s.qpe("full")) for s in first_order.exactly(declared))
            pull_in_notes, pull_in_doubt = of_members(found, declared, by_exact, pull_in, "rad")
        by_other = math.fsum(abs(s.qpe(other)) for s in declared) if other is not None else 0.0
        if by_other > pull_in * (1 + UTILIZATION_TOLERANCE):
            pull_in_doubt = (
                f"the {other} model says beyond it: QPE {by_other:.3g} rad, {format_limit(pull_in, 'rad')} allowed"
            )
        yield judged(
            mission,
            id="mission.autofocus_pull_in",
            metric="quadratic_phase_error",
            unit="rad",
            declared=total,
            allowable=pull_in,
            path=("autofocus", "n_pull"),
            equation="Section VI",
            never_fails=True,
            over=_exceeded("QPE", total, pull_in, "rad", lambda: [(s.id, abs(s.qpe(model))) for s in declared])
            + "; autofocus corrects one total, not each error its own",
            doubt=pull_in_doubt,
            notes=(*_strictest("sum", model), *pull_in_notes),
        )


def _location_doubt(
    mission: Mission, motion: Sequence[ErrorSource], by_full: ImagePlane, groups: Sequence[Correlated]
) -> str:
    """Say that the model that does not gate fails the location; else nothing."""
    model, limit = mission.allocation.model, mission.requirements.location_error
    if limit is None or model == "strictest" or not motion:
        return ""
    other, plane = ("full", by_full) if model == "published" else ("published", image_plane(mission.geometry))
    moves = [(s.id, plane.displacement(s.by(other), s.declared or 0.0)) for s in motion]
    known = [(row_id, move) for row_id, move in moves if move is not None]  # (25) may have none at all
    if sum([math.hypot(x, y) for _, (x, y) in known]) <= limit:
        return ""  # by any rule
    moved = combined_displacement(known, mission.allocation.combine, groups)
    if moved <= limit * (1 + UTILIZATION_TOLERANCE):
        return ""
    return f"the {other} model says fail: {_said(moved, 'm')}, {format_limit(limit, 'm')} allowed"


def _qpe_aggregates(
    mission: Mission,
    allocation: Allocation,
    declared: Sequence[ErrorSource],
    groups: Sequence[Correlated],
    first_order: FirstOrder,
) -> Iterator[Row]:
    combine, model, gain = mission.allocation.combine, mission.allocation.model, allocation.autofocus_gain
    owners = ["transmitter", "receiver", "mission"]
    if allocation.qpe.clock is not None:
        owners.insert(2, "clock")  # else it counts with the receiver
    for owner in owners:
        members = [s for s in declared if owner == "mission" or allocation.qpe.includes(s.owner, owner)]
        published, full = (
            combined_phase(members, "qpe", of, combine, groups) if members else None for of in ("published", "full")
        )
        qpe = published if model == "published" else full
        if model == "strictest" and members:
            qpe = combined_phase(members, "qpe", model, combine, groups)
        limit = allocation.qpe_limit(owner) * gain
        over = ""
        if qpe is not None:
            parts = partial(phase_parts, members, "qpe", model, combine, groups)
            exceeded = _exceeded("QPE", qpe, limit, "rad", parts)
            over = f"{exceeded}; {needed_sentence(allocation.n_pull_needed(qpe, owner), caps(mission))}"
        other = {"published": ("full", full), "full": ("published", published)}.get(model)
        doubt = ""
        if other is not None and other[1] is not None and other[1] > limit * (1 + UTILIZATION_TOLERANCE):
            doubt = f"the {other[0]} model says fail: {other[1]:.3g} rad, {format_limit(limit, 'rad')} allowed"
        exact_notes: tuple[str, ...] = ()
        exact_doubt = ""
        if first_order.found:
            by_exact = combined_phase(first_order.exactly(members), "qpe", "full", combine, groups)
            exact_notes, exact_doubt = of_members(first_order.found, members, by_exact, limit, "rad")
        yield judged(
            mission,
            id=f"{'timing' if owner == 'clock' else owner}.quadratic_phase_error",
            metric="quadratic_phase_error",
            unit="rad",
            declared=qpe,
            allowable=limit,
            path={"mission": ("platforms",), "clock": ("timing_error",)}.get(
                owner, ("platforms", owner, "motion_error")
            ),
            equation="sum of the rows" if combine == "sum" else "root-sum-square of the rows",
            gain=gain,
            over=over,
            doubt=doubt or exact_doubt,
            limits=(limit, limit),
            qpe=published,
            qpe_full=full,
            notes=(
                *correlation_notes(combine, [g for g in groups if owner in (g.platform, "mission")]),
                *_strictest(combine, model),
                *exact_notes,
            ),
        )


def _strictest(combine: str, model: str) -> tuple[str, ...]:
    if model != "strictest" or combine == "each":
        return ()
    return ("each error counts by the model that gives it more: together they can be more than by either alone",)


def _exceeded(
    what: str, size: float | None, limit: float | None, unit: str, members: Callable[[], Sequence[tuple[str, float]]]
) -> str:
    """Say how large an aggregate is, what is allowed, and which of its members is the largest; nothing if inside."""
    if size is None or limit is None or size <= limit:
        return ""
    row_id, largest = max(members(), key=lambda member: abs(member[1]))
    allowed = f"{_said(size, unit)}, {format_limit(limit, unit)} allowed"
    return f"{what} {allowed}; largest: {row_id}, {_said(abs(largest), unit)}"


def _said(size: float, unit: str) -> str:
    """Metres with a prefix, as everywhere; phases in radians, to be compared with π/4."""
    return format_quantity(size, unit) if unit == "m" else f"{size:.3g} {unit}"


def _moved_exactly(source: ErrorSource, found: Mapping[str, Beyond], plane: ImagePlane) -> GroundVector:
    """Displacement by the full model, beyond first order by exact ranges. [m]"""
    if source.id in found:
        return found[source.id].displacement
    return plane.displacement(source.full, source.declared or 0.0) or (0.0, 0.0)
