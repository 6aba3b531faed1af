"""Errors that a covariance ties together: under root-sum-square they count as one, √(gᵀCg).

With gᵢ the effect of one unit of error i and φᵢ = gᵢσᵢ, gᵀCg is Σ ρᵢⱼφᵢφⱼ. It does not depend on the frame: the
covariance stays in its own, and the effects are those along that frame's axes.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from bisar_budget import file_warnings, phrases
from bisar_budget.effects.combine import combine_displacements, combine_phases
from bisar_budget.effects.effect import PLATFORMS, ErrorSource
from bisar_budget.effects.subject import subject
from bisar_budget.faults import Place
from bisar_budget.geometry import FRAME_AXES, GroundVector
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import MotionError
from bisar_budget.mission.symmetric import quadratic_form
from bisar_budget.phrases import Note


class Correlated(NamedTuple):
    """The six errors of a platform's covariance, by the ids of their rows, and their correlations (6, 6)."""

    platform: str
    ids: tuple[str, ...]
    correlation: tuple[tuple[float, ...], ...]

    @property
    def id(self) -> str:
        """Name of the six together."""
        return f"{self.platform}.covariance"

    def phase(self, phases: Sequence[float]) -> float:
        """√(gᵀCg) of the six phases gᵢσᵢ, signed. [rad]"""
        return math.sqrt(quadratic_form(self.correlation, phases))

    def displacement(self, moves: Sequence[GroundVector]) -> float:
        """Root of the trace of the displacement's covariance on the ground: its rms length. [m]"""
        return math.sqrt(sum(quadratic_form(self.correlation, along) for along in zip(*moves, strict=True)))


def correlated_errors(mission: Mission) -> tuple[Correlated, ...]:
    """List the covariances of a mission; nothing for nearly every one."""
    found = []
    for name in PLATFORMS:
        error: MotionError = getattr(mission.platforms, name).motion_error
        if error.covariance is not None:
            ids = tuple(
                subject(name, kind, axis, error.frame).id
                for kind in ("position", "velocity")
                for axis in FRAME_AXES[error.frame]
            )
            found.append(Correlated(name, ids, error.covariance.correlation))
    return tuple(found)


def phase_parts(
    phases: Sequence[tuple[str, float]], rule: str, groups: Sequence[Correlated]
) -> list[tuple[str, float]]:
    """List what combines of phases by row id, signed: id and phase. [rad]

    Of a covariance the six errors are one part under `rss`, else six.
    """
    if rule != "rss" or not groups:  # few missions have any
        return list(phases)
    left = dict(phases)
    parts = []
    for group in groups:
        if left.keys() >= set(group.ids):
            parts.append((group.id, group.phase([left.pop(row_id) for row_id in group.ids])))
    return [*parts, *left.items()]


def combined_phase(phases: Sequence[tuple[str, float]], rule: str, groups: Sequence[Correlated]) -> float:
    """Combine the phases of errors by a rule, those of a covariance with their correlations. [rad]"""
    return combine_phases([phase for _, phase in phase_parts(phases, rule, groups)], rule)


def displacement_parts(
    moves: Iterable[tuple[str, GroundVector]], rule: str, groups: Sequence[Correlated]
) -> list[tuple[str, GroundVector]]:
    """List what combines to a displacement: id and vector on the ground, (2,). [m]

    Of a covariance the six errors are one part under `rss`, as long as its rms; that has no direction.
    """
    if rule != "rss" or not groups:
        return list(moves)
    left = dict(moves)
    parts: list[tuple[str, GroundVector]] = []
    for group in groups:
        if left.keys() >= set(group.ids):
            parts.append((group.id, (group.displacement([left.pop(row_id) for row_id in group.ids]), 0.0)))
    return [*parts, *left.items()]


def combined_displacement(
    moves: Iterable[tuple[str, GroundVector]], rule: str, groups: Sequence[Correlated]
) -> float:
    """Combine displacements by a rule, those of a covariance with their correlations. [m]"""
    return combine_displacements([move for _, move in displacement_parts(moves, rule, groups)], rule)


def correlation_notes(rule: str, groups: Sequence[Correlated]) -> tuple[Note, ...]:
    """Say what an aggregate makes of covariances."""
    if rule == "rss":
        return tuple(phrases.counted_as_one(group.id) for group in groups)
    return tuple(phrases.correlations_unused(group.id) for group in groups)


def unused_correlations(mission: Mission) -> Iterator[tuple[Place | None, Note]]:
    """Warn of correlations that no row and no aggregate looks at: line and message."""
    if mission.allocation.combine != "each":
        return
    for name in PLATFORMS:
        error: MotionError = getattr(mission.platforms, name).motion_error
        if error.covariance is not None and error.covariance.has_correlations():
            line = mission.line(("platforms", name, "motion_error", "covariance"))
            yield line, file_warnings.correlations_not_used(name)


def likely_error(group: Correlated, members: Sequence[ErrorSource]) -> tuple[float, ...]:
    """Most probable of the errors whose quadratic phase is √(gᵀCg) by the full model: Cg/√(gᵀCg), (6,).

    Along the frame's axes, coverage factor included. Without a phase, each at its sigma.
    """
    sizes = [source.declared or 0.0 for source in members]
    phases = [source.full.qpe * size for source, size in zip(members, sizes, strict=True)]
    total = group.phase(phases)
    if not total:
        return tuple(sizes)
    shares = [math.fsum(rho * phase for rho, phase in zip(row, phases, strict=True)) for row in group.correlation]
    return tuple(size * share / total for size, share in zip(sizes, shares, strict=True))
