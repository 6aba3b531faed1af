"""One mission as `verify` looks at it: its errors put into images, at a limit or at any size."""

import math
from collections.abc import Sequence

from bisar_budget.budget.allocation import allocate
from bisar_budget.budget.effects import ErrorSource, full_ground, image_plane
from bisar_budget.budget.pull_in import ROOM
from bisar_budget.budget.sources import error_sources
from bisar_budget.geometry import GroundVector
from bisar_budget.mission.model import Mission
from bisar_budget.simulate.aperture_reading import ApertureReading, read_aperture
from bisar_budget.simulate.autofocus import ALGORITHMS
from bisar_budget.simulate.collection import (
    CELLS,
    MAX_CELLS,
    RANGE_CELLS,
    Chip,
    Errors,
    PointCollection,
    superposed,
)
from bisar_budget.simulate.exact import ExactEffect
from bisar_budget.simulate.phase_history import MotionError

Sizes = Sequence[tuple[ErrorSource, float]]  # errors and how large each is, signed
_CLOCK_TERMS = ("constant", "linear", "quadratic", "cubic")


class Study:
    """One mission with what its rows share."""

    def __init__(self, mission: Mission) -> None:
        self.mission, self.geometry = mission, mission.geometry
        self.model = mission.allocation.model
        self.sources = error_sources(mission, self.geometry)
        self.allocation = allocate(mission, self.sources)
        self.plane = image_plane(self.geometry)
        self.ground = full_ground(mission, self.geometry)
        self.collection = PointCollection(mission, self.geometry)

    @property
    def declared(self) -> list[ErrorSource]:
        """Declared errors that an image can show; `other` errors are phases without a motion."""
        return [s for s in self.sources if s.declared and s.is_independent and s.is_motion]

    def members(self, owner: str) -> list[ErrorSource]:
        """Declared errors that count against an owner's budget."""
        return [s for s in self.declared if owner == "mission" or self.allocation.qpe.includes(s.owner, owner)]

    def boundary(self, source: ErrorSource, limit: float) -> float | None:
        """Size of an error at which the gating model has it reach a quadratic phase [rad]; None without one."""
        per_unit = abs(source.by(self.model).qpe)
        return limit / per_unit if per_unit else None

    def has_limit(self, source: ErrorSource) -> bool:
        """Whether an error has an allowable by quadratic phase, gain included."""
        limit = self.allocation.qpe_limit(source.owner) * self.allocation.autofocus_gain
        return self.boundary(source, limit) is not None

    def errors(self, source: ErrorSource, size: float) -> Errors:
        """Return one error of a given size and nothing else."""
        owner, *rest = source.id.split(".")
        if owner == "timing":
            order = _CLOCK_TERMS.index(rest[0])
            return Errors(clock=tuple(size if index == order else 0.0 for index in range(4)))
        if owner == "mission":  # a scene that is higher: both platforms measured too high
            up = MotionError(position=(0.0, 0.0, size))
            return Errors(transmitter=up, receiver=up)
        kind = rest[0]
        x, y, z = (size * component for component in source.direction)
        error = {
            "position": MotionError(position=(x, y, z)),
            "velocity": MotionError(velocity=(x, y, z)),
            "acceleration": MotionError(acceleration=(x, y, z)),
        }[kind]
        return Errors(transmitter=error, receiver=error) if owner == "common" else Errors().of(owner, error)

    def together(self, sizes: Sizes, scale: float = 1.0) -> Errors:
        """Several errors at once, each `scale` times its size."""
        return superposed(self.errors(source, scale * size) for source, size in sizes)

    def effect(self, sizes: Sizes, scale: float = 1.0) -> ExactEffect:
        """What several errors do by exact ranges."""
        return self.collection.effect(self.together(sizes, scale))

    def worse_sign(self, sizes: Sizes, scale: float) -> float:
        """The scale with the sign that leaves more quadratic phase: a limit has two signs.

        Raises
        ------
        ValueError
            With neither sign any ground point has the range history.
        """
        phases = {}
        for signed in (scale, -scale):
            try:
                phases[signed] = abs(self.effect(sizes, signed).quadratic)
            except ValueError as error:
                none = error
        if not phases:
            raise none
        return max(phases, key=lambda signed: phases[signed])

    def aligned(self, members: Sequence[ErrorSource]) -> list[tuple[ErrorSource, float]]:
        """Declared errors, each with the sign that makes their phases add."""
        return [(s, math.copysign(s.declared or 0.0, s.by(self.model).qpe)) for s in members if s.by(self.model).qpe]

    def at_limit(self, row_id: str, limit: float) -> Errors:
        """Return the errors that a verdict of quadratic phase was read with."""
        source = next((s for s in self.sources if s.id == row_id), None)
        if source is not None:
            sizes, scale = [(source, 1.0)], limit
        else:
            sizes = self.aligned(self.members(row_id.partition(".")[0].replace("timing", "clock")))
            scale = limit / math.fsum(abs(s.by(self.model).qpe * size) for s, size in sizes)
        return self.together(sizes, self.worse_sign(sizes, scale))

    def images(self, row_id: str, limit: float) -> tuple[Chip, Chip]:
        """Image at a limit of a row of quadratic phase, as its verdict reads it, and of no error at that place."""
        errors = self.at_limit(row_id, limit)
        return self.chips(errors, self.collection.effect(errors))

    def focused(self, chip: Chip) -> Chip:
        """Refocus a chip by the mission's algorithm."""
        return chip._replace(image=ALGORITHMS[self.mission.autofocus.algorithm](chip.image).image)

    def chips(self, errors: Errors, effect: ExactEffect, range_cells: int = RANGE_CELLS) -> tuple[Chip, Chip]:
        """Image of the errors and of no error at the place they move the point to, large enough for the smear."""
        slope = 2 * abs(effect.quadratic) + 3 * abs(effect.cubic)  # at the aperture edge
        smear = 2 * math.ceil(min(slope / math.pi, 1e6))  # cells
        cells = max(CELLS + smear, math.ceil(max(ROOM.values()) * smear))  # with less, autofocus gives out
        return self.collection.pair(errors, effect.displacement, min(cells, MAX_CELLS), range_cells)

    def read(self, errors: Errors, place: GroundVector, chip: Chip, reference: Chip) -> ApertureReading:
        """Quadratic and cubic phase of a response, measured."""
        return read_aperture(self.collection, errors, place, chip, reference)
