"""One mission as `verify` looks at it: its errors put into images, at a limit or at any size."""

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from bisar_budget.analysis.analysis import Analysis, Model
from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.effects.declared import QUADRATIC
from bisar_budget.effects.effect import PLATFORMS, ErrorSource, Subject
from bisar_budget.effects.sources import exact_ranges
from bisar_budget.findings.images import Verdict
from bisar_budget.mission.model import Mission
from bisar_budget.ranges.exact_ranges import (
    FINE_NODE_COUNT,
    QUADRATIC_OF_VARIANCE,
    STILL,
    ExactEffect,
    ImagePoints,
    followed,
)
from bisar_budget.simulator.autofocus import ALGORITHMS
from bisar_budget.simulator.collection import CELLS, MAX_CELLS, OVERSAMPLING, RANGE_CELLS, Chip, PointCollection
from bisar_budget.simulator.impulse_response import highest
from bisar_budget.simulator.phase_history import Errors, Floats, PathError, cell_centres, look_sum, superposed
from bisar_budget.verifier.aperture_reading import (
    READ_CELLS,
    ApertureReading,
    Shift,
    measured_shift,
    read_aperture,
    refocused,
)

Sizes = Sequence[tuple[ErrorSource, float]]  # errors and how large each is, signed
_SHARED_RAD = 0.5  # of phase by which lines on which one phase is estimated may differ
_SCALED, _SCALINGS = 1e-4, 40  # of a budget; steps at most
_HIDDEN = 0.1  # of the equal-loss phase: less than that is hidden, and a phase is measured better than a loss
_ONE_PEAK = math.log(2)  # variance of a phase that takes half the peak's power [rad²]
_SUMMED = 256  # pulses, and frequencies, of a direct sum
_ROUND_CELLS = 6  # around the middle line, that tell moments apart which look alike along it
_SLOWEST = 0.02  # of the fastest turn of Doppler: slower, a part of the aperture is not followed


class Spread(NamedTuple):
    """Resolution cells over which a response is smeared along its line, and over which it walks in range.

    Where Doppler turns back (`is_round`) it spreads all ways, and both are the same. A range cell has `finer` times
    as many pixels as one across.
    """

    smear: int
    walk: int
    is_round: bool = False
    finer: float = 1.0


class Responses(NamedTuple):
    """Images of a point with errors, around the place they move it to, and of one without error at that place."""

    errors: Errors
    effect: ExactEffect
    spread: Spread
    chip: Chip
    reference: Chip


class Study:
    """One mission with what its rows share."""

    def __init__(self, mission: Mission, analysis: Analysis | None = None) -> None:
        self.mission, self.analysis = mission, analysis or Analysis(mission)
        self.geometry, self.sources = self.analysis.geometry, self.analysis.sources
        self.model = mission.gating_model
        self.allocation = self.analysis.allocation
        self.collection = PointCollection(mission, self.geometry)

    def blank(self, row_id: str, limit: float, unit: str, **known: Any) -> Verdict:
        """Verdict on a limit of the gating model before its image is formed."""
        return Verdict(id=row_id, model=self.model, boundary_error=limit, unit=unit, **known)

    @property
    def is_full(self) -> bool:
        """Whether exact ranges say where the image goes and what its cubic phase is; else Table I and (25)."""
        return self.model != "published"

    @property
    def models(self) -> tuple[Model, ...]:
        """Models that gate: under `strictest` both."""
        return tuple(getattr(self.analysis, name) for name in self.analysis.gates)

    @property
    def declared(self) -> list[ErrorSource]:
        """Declared errors that an image can show; `other` errors are phases without a motion."""
        return [s for s in self.analysis.stated if s.declared and s.displaces]

    def members(self, owner: str) -> list[ErrorSource]:
        """Declared errors that count against an owner's budget."""
        return [s for s in self.declared if self.allocation.qpe.includes(s.owner, owner)]

    @cached_property
    def unfocused_models(self) -> tuple[Model, ...]:
        """Models that gate, of the mission without autofocus: the phases that they judge have no gain in them."""
        if self.allocation.autofocus_gain == 1:
            return self.models
        unfocused = self.mission._replace(autofocus=self.mission.autofocus._replace(n_pull=None))
        analysis = Analysis(unfocused)
        return tuple(getattr(analysis, name) for name in analysis.gates)

    def boundary(self, source: ErrorSource, limit: float, *, is_focused: bool = False) -> float | None:
        """Smallest size at which a gating model has an error reach a quadratic phase [rad]; None without one.

        With autofocus the limit has its gain in it.
        """
        models = self.models if is_focused else self.unfocused_models
        sizes = (model.allowable(source, QUADRATIC, limit) for model in models)
        return min((size for size in sizes if size is not None), default=None)

    def allowed(self, source: ErrorSource) -> tuple[float | None, str | None]:
        """Allowable of an error's row by all requirements, autofocus included, and which one binds."""
        limit = self.allocation.qpe_allowed(source.owner)
        needs = self.mission.requirements
        limits = (limit, needs.cubic_phase_error, needs.location_error)
        found = [model.allowed(source, limits) for model in self.models]
        return min(found, key=lambda one: math.inf if one[0] is None else one[0])

    def errors(self, source: ErrorSource, size: float) -> Errors:
        """Return one error of a given size and nothing else."""
        if source.clock is not None:
            return Errors(clock=tuple(size * term for term in source.clock))
        kind, found = source.subject.kind, Errors()
        if kind == "terrain":  # a higher scene: both platforms measured too high
            kind = "position"
        for place in source.platforms:
            stated: Any = size
            if not source.is_time_tag:
                stated = tuple(size * component for component in source.direction_of(place))
            found = found.of(PLATFORMS[place], PathError(**{kind: stated}))
        return found

    def together(self, sizes: Sizes, scale: float = 1.0) -> Errors:
        """Several errors at once, each `scale` times its size."""
        return superposed(self.errors(source, scale * size) for source, size in sizes)

    def effect(self, sizes: Sizes, scale: float = 1.0) -> ExactEffect:
        """Effect of several errors by exact ranges."""
        return self.collection.effect(self.together(sizes, scale))

    def exact_effects(self, courses: Mapping[str, Floats]) -> ImagePoints:
        """Effects of many histories: of position errors of platforms, (draws, nodes, 3), or of the clock's. [m]

        They are by the name of what has them. That of the clock is a range error, (draws, nodes). The nodes are those
        of `aperture_nodes`.
        """
        exact = exact_ranges(self.mission, self.geometry, FINE_NODE_COUNT)
        moved = {name: np.ascontiguousarray(one.T) for name, one in courses.items()}
        shifts = [moved.get(name, STILL) for name in PLATFORMS]
        draws = len(next(iter(courses.values())))
        clock = moved.get("clock", np.zeros((FINE_NODE_COUNT, draws)))
        return followed(exact, clock, shifts, np.zeros(draws, dtype=int))

    def worse_sign(self, sizes: Sizes) -> float:
        """The sign whose quadratic phase of equal loss is larger, 1 or -1: a limit has two signs.

        Raises
        ------
        ValueError
            With neither sign any ground point has the range history.
        """
        phases = {}
        for sign in (1.0, -1.0):
            try:
                phases[sign] = self.effect(sizes, sign).equal_loss
            except ValueError as error:
                none = error
        if not phases:
            raise none
        return max(phases, key=lambda sign: phases[sign])

    def summed(self, members: Sequence[ErrorSource], budget: float) -> list[tuple[ErrorSource, float]]:
        """Declared errors scaled until their phases by the gating model, of the worse sign each, sum to a budget.

        Signs are those that make the phases add; empty where there is no phase.
        """
        model = self.models[-1]

        def phases(scale: float) -> list[float]:
            return [self._worst(model, s, scale * (s.declared or 0.0)) for s in members]

        total = math.fsum(map(abs, phases(1.0)))
        if not total:
            return []
        scale = 1.0
        for _ in range(_SCALINGS):
            if not math.isfinite(total):
                scale /= 2
            elif abs(total / budget - 1) < _SCALED:
                break
            else:
                scale *= min(4.0, max(0.25, budget / total))
            total = math.fsum(map(abs, phases(scale)))
        return [
            (s, math.copysign(scale * (s.declared or 0.0), qpe * (s.declared or 0.0)))
            for s, qpe in zip(members, phases(scale), strict=True)
            if qpe
        ]

    def _worst(self, model: Model, source: ErrorSource, size: float) -> float:
        """Quadratic phase of equal loss, of the worse sign of an error, signed like that of a small one. [rad]"""
        found = model.does(source, size)
        return math.copysign(found.equal_loss, found.qpe) if math.isfinite(found.qpe) else math.inf

    def at_limit(self, of: Subject, limit: float, room: float = 1.0) -> Responses:
        """Images at a limit of a row of quadratic phase, as its verdict reads them."""
        source = next((s for s in self.sources if s.subject == of), None)
        sizes = [(source, limit)] if source is not None else self.summed(self.members(of.owner), limit)
        return self.images(self.together(sizes, self.worse_sign(sizes)), room=room)

    def images(self, errors: Errors, range_cells: int = RANGE_CELLS, room: float = 1.0) -> Responses:
        """Images of errors, large enough for the smear.

        `room` is how often the smear must fit: autofocus gives out in less than it needs.

        Raises
        ------
        ValueError
            No ground point has the recorded range history, or the patch cannot be formed.
        """
        effect = self.collection.effect(errors)
        spread = self.spread(errors, effect)
        cells = min(MAX_CELLS, max(CELLS + spread.smear, math.ceil(room * spread.smear)))
        high = cells if spread.is_round else range_cells + spread.walk
        chips = self.collection.pair(errors, effect.displacement, cells, high)
        return Responses(errors, effect, spread, *chips)

    def read(self, images: Responses, *, is_focused: bool = False) -> ApertureReading:
        """Quadratic and cubic phase of a response, measured."""
        spread = images.spread
        cells = spread.walk + (_ROUND_CELLS if spread.is_round else READ_CELLS if spread.walk else 0)
        return read_aperture(
            self.collection,
            images.errors,
            images.effect.displacement,
            images.chip,
            images.reference,
            round(cells * OVERSAMPLING * spread.finer / 2),
            None if is_focused else images.effect,
        )

    def equal_loss(self, images: Responses, reading: ApertureReading) -> float:
        """Quadratic phase of as much loss of the peak as an image shows, its cubic phase and rest aside. [rad]

        Where little is hidden the phase over the aperture says it best, else the loss of the peak does. That is
        compared with what a direct sum by exact ranges loses under the same window, for a loss is the variance of
        the phase to second order only, and of another one under each window. Beyond some 3 dB an image has no one
        peak: then what exact ranges say is hidden is added to the measured phase.
        """
        effect = images.effect
        variance, others = _phase_variances(effect)
        if effect.hidden <= _HIDDEN * effect.equal_loss or variance + others > _ONE_PEAK:
            return math.hypot(reading.quadratic, effect.hidden)
        with_error, without = (highest(one.image) for one in (images.chip, images.reference))
        loss = 2 * math.log(without / with_error)
        measured = loss * (variance + others) / self._expected_loss(images) - others
        return QUADRATIC_OF_VARIANCE * math.sqrt(max(measured, 0.0))

    def shift(self, images: Responses, reading: ApertureReading) -> Shift:
        """Displacement of a response from where exact ranges put it, and the line of its smear.

        It is where the image peaks, up to some 3 dB of loss, and always where Doppler turns back: there no slope over
        the aperture says where a response lies along a line.
        """
        variance, others = _phase_variances(images.effect)
        has_line = variance + others > _ONE_PEAK and not images.spread.is_round
        return measured_shift(images.chip, images.reference, reading if has_line else None)

    def _expected_loss(self, images: Responses) -> float:
        """Minus the logarithm of the peak's power by exact ranges, under the window: a direct sum over the pulses."""
        collection = self.collection
        times = cell_centres(collection.aperture_time, _SUMMED)
        left = collection.flight(images.errors.slow(), times).range_error((0.0, 0.0), images.effect.displacement)
        frequency = collection.radar.center_frequency + cell_centres(collection.radar.bandwidth, _SUMMED)
        weights = collection.window(_SUMMED)
        phases = np.exp(2j * math.pi / SPEED_OF_LIGHT * np.outer(left, frequency))
        return -2 * math.log(abs(weights @ phases @ weights) / weights.sum() ** 2)

    def focused(self, images: Responses) -> Responses:
        """Refocus a response by the mission's algorithm, its phase estimated on lines that share it.

        Where range cells are long, lines beside the response show it with a quadratic phase of their own.
        """
        algorithm = ALGORITHMS[self.mission.autofocus.algorithm]
        lines = images.chip.image.shape[0]
        half = min(lines // 2, lines - 1 - lines // 2, self.shared_lines(images.spread))
        centre = images.effect.displacement
        return images._replace(chip=refocused(self.collection, images.errors, centre, images.chip, algorithm, half))

    def shared_lines(self, spread: Spread) -> int:
        """Lines on either side of the middle one that share its quadratic phase, or that the response walks over."""
        exact = self.analysis.exact
        (a, c, east, _), (b, d, north, _) = (gradient[:, 0] for gradient in exact.gradient)
        # A metre of range along equal Doppler leads by (d, −c) over the determinant.
        area, bends = abs(a * d - b * c), abs(float(exact.k[0]) * (d * east - c * north))
        per_line = bends * self.collection.range_cell / (OVERSAMPLING * spread.finer)
        shared = int(min(_SHARED_RAD * area / per_line if per_line else 1e6, 1e6))
        return max(shared, round(spread.walk * OVERSAMPLING * spread.finer / 2))

    def spread(self, errors: Errors, effect: ExactEffect) -> Spread:
        """Where an error puts the parts of a response, by the range error that it leaves over the aperture.

        A part lies along the line of equal range where the Doppler that is left is that of the place. Where Doppler
        turns slowly, in part of a long aperture or with nearly parallel gradients, a small slope is a long way.
        """
        half = self.collection.aperture_time / 2
        time = np.linspace(-half, half, 257)
        point = np.array([*effect.displacement, 0.0])
        flight = self.collection.flight(errors.smooth(), time)
        left = flight.range_error((0.0, 0.0), effect.displacement)
        slopes = -look_sum(*(one.measured - point for one in flight.paths))[:, :2]
        lines = self.collection.range_lines(errors)
        cells = lines.cells(effect.displacement, self.mission.radar)
        if lines.turns_back:  # each moment sees the point at a place of its own, along the turn of the line of sight
            turn = np.hypot(*np.gradient(slopes, time, axis=0).T)
            reach = 2 * math.ceil(min(float(np.abs(np.gradient(left, time) / turn).max()) / min(cells), 1e6))
            return Spread(reach, reach, is_round=True)
        by_range = slopes[time.size // 2]
        doppler = slopes @ (np.array([by_range[1], -by_range[0]]) / np.hypot(*by_range))
        rate = np.gradient(doppler, time)
        least = _SLOWEST * np.abs(rate).max()
        places = np.gradient(left, time) / np.where(np.abs(rate) < least, np.copysign(least, rate), rate)
        walk = left - places * (doppler - doppler[time.size // 2])
        return Spread(
            2 * math.ceil(min(float(np.abs(places).max()) / cells[1], 1e6)),
            2 * math.ceil(min(float(np.abs(walk).max()) / self.collection.range_cell - 0.25, 64)),
            finer=cells[0] / lines.sampled(effect.displacement, self.mission.radar)[0],
        )


def _phase_variances(effect: ExactEffect) -> tuple[float, float]:
    """Variance of a quadratic phase of equal loss, and that of the cubic phase and the rest. [rad²]"""
    return (effect.equal_loss / QUADRATIC_OF_VARIANCE) ** 2, 4 / 175 * effect.cubic**2 + effect.rest**2
