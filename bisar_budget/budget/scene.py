"""The scene's edge: how far a quadratic phase error there differs from the one at the centre.

The paper's errors are spatially invariant; in the full model they are not. At a point p of the scene both platforms
have other lines of sight: the whole model (u and its derivatives, s, Q, x̂) is evaluated there, with p in place of the
centre. One autofocus correction is one phase for the whole image, so that it leaves the difference behind. Against
exact ranges and against images at 250 m and 1 km: `tests/simulate/test_scene_edge.py`. Derived here.

What gates is the difference against the total budget, without the gain of autofocus: that is what must be left of any
error after a correction. Without autofocus it is what the edge has more than the centre, where the rows stand; then,
and with a correction that has its own bound, an edge whose phase itself exceeds a limit is a warning.
"""

import math
from collections.abc import Sequence
from itertools import chain
from typing import NamedTuple

from bisar_budget import evaluators
from bisar_budget.budget.allocation import Allocation
from bisar_budget.budget.combine import combine_phases
from bisar_budget.budget.correlation import correlated_errors, phase_parts
from bisar_budget.budget.sources import MOTION_UNITS, PLATFORMS, ErrorSource, full_ground
from bisar_budget.constants import SPEED_OF_LIGHT, UTILIZATION_TOLERANCE
from bisar_budget.geometry import BistaticGeometry, GroundVector, PlatformState
from bisar_budget.mission.model import Mission
from bisar_budget.units import format_quantity

RIM_POINTS = 8
_FARTHEST = 0.5  # of the nearest slant range: the search for a radius ends there
_PRECISION = 1e-3  # of the radius
_TURNS = 3  # of the azimuth along which it is searched
_PER_PLATFORM = 9  # unit errors: position, velocity, acceleration along each axis
_CLOCK_TERMS = ("constant", "linear", "quadratic", "cubic")


class SceneEdge(NamedTuple):
    """What the edge of the scene adds.

    `difference` is the largest of the quadratic phases between edge and centre, combined as the mission says [rad],
    at `azimuth` on the rim. `autofocus_radius` is that within which it stays inside the total budget [m]; None where
    it does as far as `searched` [m]. `degeneracy` says why a part of the edge has no image, `doubt` which error is
    over its limit there and not at the centre.
    """

    radius: float
    difference: float
    azimuth: float
    autofocus_radius: float | None
    searched: float
    degeneracy: str
    doubt: str

    def notes(self, total: float) -> tuple[str, ...]:
        """Where the difference is largest, and how far one autofocus correction serves."""
        if not self.difference:
            return ("the declared errors have the same quadratic phase at the edge and at the centre",)
        return (
            f"largest between the centre and azimuth {math.degrees(self.azimuth):.0f} deg, "
            f"{format_quantity(self.radius, 'm')} away",
            f"one autofocus correction serves {self.served}, by the total of {total:.3g} rad",
        )

    @property
    def served(self) -> str:
        """How far one correction serves, in words."""
        if self.autofocus_radius is None:
            return f"farther than {format_quantity(self.searched, 'm', 3, 'down')} out"
        return f"out to {format_quantity(self.autofocus_radius, 'm', 3, 'down')}"


class ScenePhases:
    """Quadratic phases of the declared errors at any point of the scene."""

    def __init__(self, mission: Mission, geometry: BistaticGeometry, members: Sequence[ErrorSource]) -> None:
        self.mission, self.geometry, self.members = mission, geometry, members
        self.combine = mission.allocation.combine
        self.centre = [source.qpe("full") for source in members]
        self.groups = correlated_errors(mission) if self.combine == "rss" else ()
        self.clock = evaluators.published_clock(
            SPEED_OF_LIGHT, mission.radar.wavelength, mission.collection.aperture_time
        )
        self.terms = [self._terms(source) for source in members]

    def geometry_at(self, point: GroundVector) -> BistaticGeometry:
        """Both platforms as a point of the ground has them."""
        states = (self.geometry.transmitter, self.geometry.receiver)
        transmitter, receiver = (
            PlatformState(
                position=(s.position[0] - point[0], s.position[1] - point[1], s.position[2]),
                velocity=s.velocity,
                acceleration=s.acceleration,
            )
            for s in states
        )
        return BistaticGeometry(transmitter=transmitter, receiver=receiver)

    def phases(self, point: GroundVector) -> list[float]:
        """Quadratic phase of each error there, signed. [rad]"""
        wavelength, T = self.mission.radar.wavelength, self.mission.collection.aperture_time
        ground = full_ground(self.mission, self.geometry_at(point))
        transmitter, receiver = (
            evaluators.full_motion(*(*chain.from_iterable(looks), wavelength, T)) for looks in ground.looks
        )
        of_a_unit = ground.quadratic_phases((*transmitter, *receiver, *self.clock))
        return [
            centre if terms is None else sum([of_a_unit[unit] * size for unit, size in terms])
            for terms, centre in zip(self.terms, self.centre, strict=True)
        ]

    def _terms(self, source: ErrorSource) -> list[tuple[int, float]] | None:
        """An error as unit errors, by their place among those of both platforms and the clock, and how much of each.

        None for a phase as such, which is the same everywhere.
        """
        size = source.declared or 0.0
        if source.owner == "clock":
            return [(2 * _PER_PLATFORM + _CLOCK_TERMS.index(source.id.rpartition(".")[2]), size)]
        if not source.is_position:
            return None
        first = 3 * _KINDS[source.unit]
        return [
            (_PER_PLATFORM * platform + first + axis, part * size)
            for platform, name in enumerate(PLATFORMS)
            if source.moves(name)
            for axis, part in enumerate(source.direction)
            if part
        ]

    def differences(self, point: GroundVector) -> list[float]:
        """Of each error, its phase there less that at the centre. [rad]"""
        return [there - centre for there, centre in zip(self.phases(point), self.centre, strict=True)]

    def combined(self, phases: Sequence[float]) -> float:
        """Differences of phases to the centre's, combined: the largest, their sum or root-sum-square. [rad]"""
        return self.together([there - c for there, c in zip(phases, self.centre, strict=True)])

    def together(self, phases: Sequence[float], indices: Sequence[int] | None = None) -> float:
        """Phases of the errors, or of some of them, combined; those of a covariance with their correlations. [rad]"""
        if not self.groups:
            return combine_phases(phases if indices is None else [phases[i] for i in indices], self.combine)
        return combine_phases([phase for _, phase in self.parts(phases, indices)], self.combine)

    def parts(self, phases: Sequence[float], indices: Sequence[int] | None = None) -> list[tuple[str, float]]:
        """What they combine from: ids and phases, of a covariance one under `rss`. [rad]"""
        chosen = range(len(self.members)) if indices is None else indices
        members = []
        for i in chosen:
            source = self.members[i]
            per_unit = phases[i] / (source.declared or 1.0)
            members.append(source._replace(full=source.full._replace(qpe=per_unit)))
        return phase_parts(members, "qpe", "full", self.combine, self.groups)

    def difference(self, radius: float, azimuth: float) -> float:
        """The same at one point. [rad]"""
        return self.combined(self.phases(at(radius, azimuth)))

    def rim(self, radius: float) -> "Rim":
        """Evaluate a circle evenly, and around the worst point at the vertex of the parabola through it, twice.

        Linear in the radius, a difference is a cosine of the azimuth, whose vertex that is to a few degrees.
        """
        step = 2 * math.pi / RIM_POINTS
        phases = [self.phases(at(radius, step * k)) for k in range(RIM_POINTS)]
        sizes = [self.combined(there) for there in phases]
        top = max(range(RIM_POINTS), key=sizes.__getitem__)
        best = (sizes[top], step * top)
        before, size, after = sizes[top - 1], sizes[top], sizes[(top + 1) % RIM_POINTS]
        vertex = step * top
        for _ in range(2):
            bend = before - 2 * size + after
            if bend >= 0:
                break
            vertex += step * (before - after) / (2 * bend)
            step /= 4
            before, size, after = (self.difference(radius, vertex + side * step) for side in (-1, 0, 1))
            best = max(best, (before, vertex - step), (size, vertex), (after, vertex + step))
        size, azimuth = best
        return Rim(azimuth % (2 * math.pi), size, phases)


class Rim(NamedTuple):
    """A circle about the centre: where the largest difference is, that difference, and all phases around it. [rad]"""

    azimuth: float
    difference: float
    phases: list[list[float]]


_KINDS = {unit: index for index, unit in enumerate(MOTION_UNITS.values())}


def at(radius: float, azimuth: float) -> GroundVector:
    """Point of the ground, east and north. [m]"""
    return (radius * math.cos(azimuth), radius * math.sin(azimuth))


def scene_edge(
    mission: Mission, geometry: BistaticGeometry, allocation: Allocation, sources: Sequence[ErrorSource]
) -> SceneEdge | None:
    """Evaluate the errors of a mission at the edge of its scene; None without a radius or a declared error.

    Parameters
    ----------
    mission : Mission
        With `scene.radius`.
    geometry : BistaticGeometry
        Seen from the centre.
    allocation : Allocation
        Total budget, and limits of the owners.
    sources : sequence of ErrorSource
        Those that the combination runs over.
    """
    radius = mission.scene.radius
    members = [source for source in sources if source.declared is not None and source.is_motion]
    if radius is None or not members:
        return None
    edge = ScenePhases(mission, geometry, members)
    searched = _FARTHEST * min(geometry.transmitter.slant_range, geometry.receiver.slant_range)
    if reason := _no_image(edge, radius):
        return SceneEdge(radius, math.nan, 0.0, None, searched, reason, "")
    rim = edge.rim(radius)
    searched = max(searched, radius)
    reach = _autofocus_radius(edge, radius, rim, allocation.qpe_total, searched)
    doubt = _over_at_the_edge(edge, allocation, rim)
    return SceneEdge(radius, rim.difference, rim.azimuth, reach, searched, "", doubt)


def _no_image(edge: ScenePhases, radius: float) -> str:
    """Say where on the rim no image can be formed; else nothing."""
    for k in range(RIM_POINTS):
        azimuth = 2 * math.pi * k / RIM_POINTS
        there = edge.geometry_at(at(radius, azimuth))
        where = f"no image at the scene's edge, azimuth {math.degrees(azimuth):.0f} deg"
        if min(there.transmitter.slant_range, there.receiver.slant_range) < 1:
            return f"{where}: a platform is within 1 m of it"
        if degeneracy := there.degeneracy():
            return f"{where}: {degeneracy}"
    return ""


def _autofocus_radius(edge: ScenePhases, radius: float, rim: Rim, total: float, searched: float) -> float | None:
    """Radius at which the largest difference reaches the total, to a thousandth; None if it does not by `searched`.

    Along the worst azimuth, and again where the rim at the radius found has a worse one.
    """
    azimuth, size, low, high = rim.azimuth, rim.difference, 0.0, radius
    if not size:
        return None
    for _ in range(_TURNS):
        while size <= total:
            if high >= searched:
                break
            low, high = high, min(searched, high * max(1.05, min(4.0, 1.05 * total / size)))
            size = edge.difference(high, azimuth)
        while size > total and high - low > _PRECISION * high:
            # About linear in the radius: just below where a line from the centre reaches the total, else half way.
            guess = high * total / size * (1 - _PRECISION / 2)
            middle = guess if low < guess < high else (low + high) / 2
            there = edge.difference(middle, azimuth)
            if there > total:
                high, size = middle, there
            elif there > total * (1 - _PRECISION):
                low = high = middle
            else:
                low = middle
        found = edge.rim(low if size > total else high)
        if found.difference <= total * (1 + _PRECISION):
            return None if size <= total else low
        azimuth, size, low, high = found.azimuth, found.difference, 0.0, low if size > total else high
    return low


def _over_at_the_edge(edge: ScenePhases, allocation: Allocation, rim: Rim) -> str:
    """Say which error is inside its limit at the centre and over it at the edge; else nothing."""
    gain, rule = allocation.autofocus_gain, edge.combine
    owners = ["transmitter", "receiver", "clock", "mission"]
    if rule == "each":
        groups = [(s.id, [i], allocation.qpe_limit(s.owner) * gain) for i, s in enumerate(edge.members)]
    else:
        groups = [
            (
                f"{owner}.quadratic_phase_error",
                [
                    i
                    for i, s in enumerate(edge.members)
                    if owner == "mission" or allocation.qpe.includes(s.owner, owner)
                ],
                allocation.qpe_limit(owner) * gain,
            )
            for owner in owners
        ]
    worst = ("", 0.0, 0.0)
    for name, indices, limit in groups:
        if edge.together(edge.centre, indices) > limit * (1 + UTILIZATION_TOLERANCE):
            continue  # its own row says so
        phase = max(edge.together(there, indices) for there in rim.phases)
        if phase > limit * (1 + UTILIZATION_TOLERANCE) and phase > worst[1]:
            worst = (name, phase, limit)
    name, phase, limit = worst
    return f"{name} is {phase:.3g} rad at the scene's edge, {limit:.3g} rad allowed" if name else ""
