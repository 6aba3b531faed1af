"""Declared errors of a mission together: their phases and displacements, whose share they count against."""

from collections.abc import Mapping, Sequence

from bisar_budget.analysis.allocation import Allocation, Split
from bisar_budget.analysis.analysis import Analysis, Model
from bisar_budget.effects.correlation import combined_phase
from bisar_budget.effects.effect import ErrorSource
from bisar_budget.effects.models import Declared
from bisar_budget.geometry import GroundVector

Phases = list[tuple[str, float]]
Moves = list[tuple[str, GroundVector]]


class Together:
    """Declared errors of a mission by one model, along the axes that the file states them in."""

    def __init__(self, analysis: Analysis, model: Model) -> None:
        self.model, self.groups = model, analysis.groups
        self.allocation_rules = analysis.mission.allocation
        self.found: Mapping[str, Declared] = analysis.declared(model)
        self.stated = analysis.stated
        self.motion = [source for source in self.stated if source.is_motion]
        self.own = analysis.own_phases(model.name)
        self.extrapolated = {error.id: error.extrapolated for error in analysis.random if error.extrapolated}

    def members(self, allocation: Allocation, owner: str) -> list[ErrorSource]:
        """Those that count against the share of an owner; against the mission's all."""
        return [s for s in self.stated if owner == "mission" or allocation.qpe.includes(s.owner, owner)]

    def phases(self, members: Sequence[ErrorSource]) -> Phases:
        """Quadratic phase of each, signed. [rad]"""
        return [(source.id, self.found[source.id].qpe) for source in members]

    def owed(self, allocation: Allocation, owner: str) -> Phases:
        """Quadratic phases that count against the share of an owner, those that displace nothing too. [rad]"""
        own = [one for one in self.own if owner == "mission" or allocation.qpe.includes(one.owner, owner)]
        return [*self.phases(self.members(allocation, owner)), *((one.row_id, one.qpe_rad) for one in own)]

    def all_cubics(self) -> Phases:
        """Cubic phases of motion, the clock, slow vibrations and sensors. [rad]"""
        return [*self.cubics(), *((one.row_id, one.cubic_rad) for one in self.own)]

    def cubic_without_coverage(self, split: Split, owner: str) -> float:
        """Cubic phase of what counts against an owner's share, at the declared sigmas; all, for the mission. [rad]

        Added with `combine: sum`, else by root-sum-square: powers add.
        """
        return combined_phase(self.cubics_without_coverage(split, owner), self.rule_of_all, self.groups)

    def cubics_without_coverage(self, split: Split, owner: str) -> Phases:
        """Cubic phase of each error that counts against an owner's share, at the declared sigma, signed. [rad]"""
        factor = self.allocation_rules.coverage_factor
        found = [
            (source.id, self.found[source.id].cubic / (factor if source.is_covered else 1.0))
            for source in self.motion
            if owner == "mission" or split.includes(source.owner, owner)
        ]
        found += [
            (one.row_id, one.cubic_rad / one.coverage)
            for one in self.own
            if owner == "mission" or split.includes(one.owner, owner)
        ]
        return found

    @property
    def rule_of_all(self) -> str:
        """Rule by which all declared errors add up: the mission's, and root-sum-square where each stands alone."""
        return "rss" if self.allocation_rules.combine == "each" else self.allocation_rules.combine

    def cubics(self) -> Phases:
        """Cubic phase of each error that moves something, signed. [rad]"""
        return [(source.id, self.found[source.id].cubic) for source in self.motion]

    def moves(self, rule: str) -> Moves | None:
        """Displacement of each, to be combined by a rule; None where one has none. [m]

        By the sign that moves farther. For a sum over all signs half of what lies between the two signs, and once the
        rest, which all signs have in common.
        """
        moves: Moves = []
        rest = (0.0, 0.0)
        for source in self.motion:
            found = self.found[source.id]
            if found.displacement is None or found.opposite is None or found.farthest is None:
                return None
            (x, y), (u, v) = found.displacement, found.opposite
            moves.append((source.id, found.farthest if rule != "sum" else ((x - u) / 2, (y - v) / 2)))
            rest = (rest[0] + (x + u) / 2, rest[1] + (y + v) / 2)
        if rule == "sum" and any(rest):
            moves.append(("whatever the signs", rest))
        return moves or None
