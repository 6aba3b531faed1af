"""Study of one mission: its analysis, its simulated collection, and the images with which limits are verified."""

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from bisar_budget.analysis.analysis import Analysis, Model
from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.effects.declared import QUADRATIC
from bisar_budget.effects.effect import PLATFORMS, ErrorSource, Subject
from bisar_budget.effects.sources import exact_ranges
from bisar_budget.findings.images import Verdict
from bisar_budget.mission.model import Mission
from bisar_budget.ranges.exact_ranges import (
    FINE_NODE_COUNT,
    NO_SHIFTS,
    QUADRATIC_OF_VARIANCE,
    ExactEffect,
    ImagePoints,
    followed,
)
from bisar_budget.simulator.autofocus import ALGORITHMS
from bisar_budget.simulator.collection import (
    CUT_CELLS,
    MAX_CELLS,
    OVERSAMPLING_FACTOR,
    RANGE_CELLS,
    Chip,
    PointCollection,
)
from bisar_budget.simulator.flown_errors import flown, flown_together
from bisar_budget.simulator.impulse_response import highest
from bisar_budget.simulator.phase_history import Errors, Floats, cell_centres, look_sum
from bisar_budget.verifier.aperture_reading import (
    READ_CELLS,
    ApertureReading,
    Shift,
    measured_shift,
    read_aperture,
    refocused,
)

Sizes = Sequence[tuple[ErrorSource, float]]  # errors and their signed sizes
_MAX_DIFFERENCE_RAD = 0.5  # largest difference of quadratic phase between lines that share an estimate
_SCALING_FRACTION, _MAX_SCALING_STEPS = 1e-4, 40  # accuracy, and most steps, of scaling errors to a budget
_HIDDEN_FRACTION = 0.1  # of the equal-loss phase; if less is hidden, the loss is not used to measure it
_SINGLE_PEAK_RAD2 = math.log(2)  # variance of a phase that halves the power of the peak
_DIRECT_SUM_SAMPLES = 256  # pulses, and frequencies, of a direct sum
_ROUND_CELLS = 6  # range cells around the middle line; they distinguish moments with equal positions along the line
_MIN_DOPPLER_RATE_FRACTION = 0.02  # of the highest Doppler rate; lower rates are set to this value


class Spread(NamedTuple):
    """Extent of a smeared response: smear along the line of equal range, and range walk across it.

    Both are in resolution cells. `is_round` is true if Doppler reverses within the aperture. The response then
    spreads in all directions, and `smear` and `walk` are equal. A range cell has `finer` times as many pixels as a
    cross-range cell.
    """

    smear: int
    walk: int
    is_round: bool = False
    finer: float = 1.0


class Responses(NamedTuple):
    """Image of a point with errors, and image of an error-free point, around the same ground point.

    `chip` is the image with errors, in which the scene centre is displaced. `reference` is the error-free image of a
    point at this displaced position, which is the centre of both images. `effect` is the effect of the errors
    computed from exact ranges, and `spread` is the extent of the response.
    """

    errors: Errors
    effect: ExactEffect
    spread: Spread
    chip: Chip
    reference: Chip


VerdictFields = dict[str, Any]
"""Fields of a verdict by name."""


class Study:
    """One mission, with the analysis and the simulated collection on which the verdicts on all rows are based."""

    def __init__(self, mission: Mission, analysis: Analysis | None = None) -> None:
        self.mission, self.analysis = mission, analysis or Analysis(mission)
        self.geometry, self.sources = self.analysis.geometry, self.analysis.sources
        self.model = mission.gating_model
        self.allocation = self.analysis.allocation
        self.collection = PointCollection(mission, self.geometry)

    def blank(self, row_id: str, limit: float, unit: str, **fields: Any) -> Verdict:
        """Create a verdict on a limit, in which the measurements are still missing.

        The limit belongs to the model that decides the mission's status. `limit` is in `unit`. `fields` are
        additional fields of the verdict.
        """
        return Verdict(id=row_id, model=self.model, boundary_error=limit, unit=unit, **fields)

    @property
    def is_full(self) -> bool:
        """Whether the model that decides the status computes displacement and cubic phase from exact ranges.

        Otherwise it computes them by equation (25) and Table I of Rigling & Moses.
        """
        return self.model != "published"

    @property
    def models(self) -> tuple[Model, ...]:
        """Models whose limits are verified: the model that decides the status, or for `strictest` both models."""
        return tuple(getattr(self.analysis, name) for name in self.analysis.gates)

    @property
    def declared(self) -> list[ErrorSource]:
        """Declared errors that a simulated image can contain.

        Errors of the kind `other`, which are phases without a motion, are not included.
        """
        return [s for s in self.analysis.stated if s.declared and s.displaces]

    def members(self, owner: str) -> list[ErrorSource]:
        """Declared errors that count towards the quadratic-phase budget of an owner, such as a platform."""
        return [s for s in self.declared if self.allocation.qpe.includes(s.owner, owner)]

    @cached_property
    def unfocused_models(self) -> tuple[Model, ...]:
        """Models that decide the mission's status, but with autofocus switched off.

        Their limits do not include the autofocus gain.
        """
        if self.allocation.autofocus_gain == 1:
            return self.models
        unfocused = self.mission._replace(autofocus=self.mission.autofocus._replace(n_pull=None))
        analysis = Analysis(unfocused)
        return tuple(getattr(analysis, name) for name in analysis.gates)

    def boundary(self, source: ErrorSource, limit: float, *, is_focused: bool = False) -> float | None:
        """Smallest size at which an error's quadratic phase reaches a limit in any model that decides the status.

        The size is in the unit of the error. It is None if the error never reaches the limit. `limit` [rad] is the
        largest permitted quadratic phase. `is_focused` is true if this limit includes the autofocus gain.
        """
        models = self.models if is_focused else self.unfocused_models
        sizes = (model.allowable(source, QUADRATIC, limit) for model in models)
        return min((size for size in sizes if size is not None), default=None)

    def allowed(self, source: ErrorSource) -> tuple[float | None, str | None]:
        """Allowable size of an error under all requirements, and the name of the requirement that sets it.

        The autofocus gain is taken into account. Both results are None if no requirement limits the error.
        """
        limit = self.allocation.qpe_allowed(source.owner)
        needs = self.mission.requirements
        limits = (limit, needs.cubic_phase_error, needs.location_error)
        allowables = [model.allowed(source, limits) for model in self.models]
        return min(allowables, key=lambda allowable: math.inf if allowable[0] is None else allowable[0])

    def errors(self, source: ErrorSource, size: float) -> Errors:
        """Convert an error of a given size, in its own unit, to the errors that the simulator applies to an image."""
        return flown(source, size, self.geometry, self.collection.aperture_time)

    def together(self, sizes: Sizes, scale: float = 1.0) -> Errors:
        """Combine several errors, each with its size times `scale`, into the errors that the simulator applies."""
        scaled = ((source, scale * size) for source, size in sizes)
        return flown_together(scaled, self.geometry, self.collection.aperture_time)

    def effect(self, sizes: Sizes, scale: float = 1.0) -> ExactEffect:
        """Compute from exact ranges the joint effect of several errors, each with its size times `scale`."""
        return self.collection.effect(self.together(sizes, scale))

    def exact_effects(self, courses: Mapping[str, Floats]) -> ImagePoints:
        """Compute from exact ranges the effects of many errors that are arbitrary functions of slow time.

        `courses` maps the name of a platform to its motion errors, (draws, nodes, 3) [m], and "clock" to range
        errors, (draws, nodes) [m]. The slow times of the nodes are given by `aperture_nodes`. The fields of the
        result are (draws,). If no ground point has the range history of a draw, they are NaN for this draw.
        """
        exact = exact_ranges(self.mission, self.geometry, FINE_NODE_COUNT)
        courses_by_draw = {name: np.ascontiguousarray(course.T) for name, course in courses.items()}
        shifts = [courses_by_draw.get(name, NO_SHIFTS) for name in PLATFORMS]
        draws = len(next(iter(courses.values())))
        clock = courses_by_draw.get("clock", np.zeros((FINE_NODE_COUNT, draws)))
        return followed(exact, clock, shifts, np.zeros(draws, dtype=int))

    def worse_sign(self, sizes: Sizes) -> float:
        """Sign of the errors, 1 or -1, that gives the larger equal-loss quadratic phase (see `equal_loss`).

        Raises
        ------
        ValueError
            No ground point has the recorded range history with either sign.
        """
        phases = {}
        for sign in (1.0, -1.0):
            try:
                phases[sign] = self.effect(sizes, sign).equal_loss
            except ValueError as error:
                last_error = error
        if not phases:
            raise last_error
        return max(phases, key=lambda sign: phases[sign])

    def summed(self, members: Sequence[ErrorSource], budget: float) -> list[tuple[ErrorSource, float]]:
        """Scale declared errors until the sum of their quadratic phases equals `budget` [rad].

        The phases are computed by the model that decides the mission's status. Returns pairs of an error and its
        scaled size. The signs of the sizes are chosen so that the phases add. The list is empty if no error has a
        quadratic phase.
        """
        model = self.models[-1]

        def phases(scale: float) -> list[float]:
            return [self._worst(model, s, scale * (s.declared or 0.0)) for s in members]

        total = math.fsum(map(abs, phases(1.0)))
        if not total:
            return []
        scale = 1.0
        for _ in range(_MAX_SCALING_STEPS):
            if not math.isfinite(total):
                scale /= 2
            elif abs(total / budget - 1) < _SCALING_FRACTION:
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
        """Equal-loss quadratic phase of an error, computed by a model for the sign that gives the larger phase. [rad]

        The method `equal_loss` describes this phase. The result has the sign of the quadratic phase of a small error.
        It is infinite if the phase is not finite.
        """
        effect = model.does(source, size)
        return math.copysign(effect.equal_loss, effect.qpe) if math.isfinite(effect.qpe) else math.inf

    def at_limit(self, subject: Subject, limit: float, room: float = 1.0) -> Responses:
        """Form the images with the errors of a row at its quadratic-phase limit, for the worse sign of the errors.

        For the row of a single error, `limit` is the size of the error. For the row of a sum of errors, `limit` is
        the budget [rad] for the sum of their phases. `room` is described in `images`.
        """
        source = next((s for s in self.sources if s.subject == subject), None)
        sizes = [(source, limit)] if source is not None else self.summed(self.members(subject.owner), limit)
        return self.images(self.together(sizes, self.worse_sign(sizes)), room=room)

    def images(self, errors: Errors, range_cells: int = RANGE_CELLS, room: float = 1.0) -> Responses:
        """Form the images of a point with errors and of an error-free point, on patches large enough for the smear.

        `room` is the minimum ratio of the width of a patch to the length of the smear; autofocus fails in a narrower
        patch. `range_cells` is the height of the patch in range cells if there is no range walk.

        Raises
        ------
        ValueError
            No ground point has the recorded range history, or the patch cannot be formed.
        """
        effect = self.collection.effect(errors)
        spread = self.spread(errors, effect)
        cells = min(MAX_CELLS, max(CUT_CELLS + spread.smear, math.ceil(room * spread.smear)))
        high = cells if spread.is_round else range_cells + spread.walk
        chips = self.collection.pair(errors, effect.displacement, cells, high)
        return Responses(errors, effect, spread, *chips)

    def read(self, images: Responses, *, is_focused: bool = False) -> ApertureReading:
        """Measure the quadratic and cubic phase over the aperture in an image with errors. [rad]

        `is_focused` is true if autofocus has been applied to the image.
        """
        spread = images.spread
        cells = spread.walk + (_ROUND_CELLS if spread.is_round else READ_CELLS if spread.walk else 0)
        return read_aperture(
            self.collection,
            images.errors,
            images.effect.displacement,
            images.chip,
            images.reference,
            round(cells * OVERSAMPLING_FACTOR * spread.finer / 2),
            None if is_focused else images.effect,
        )

    def equal_loss(self, images: Responses, reading: ApertureReading) -> float:
        """Measure the equal-loss quadratic phase of an image. [rad]

        It is the purely quadratic phase that would reduce the peak as much as the errors in the image do, apart from
        the loss due to the cubic phase and higher orders.

        The hidden phase is the part of the phase that the bandwidth and the turn of the line of sight do not resolve.
        If it is small, or if the loss is more than about 3 dB so that the image has no single peak, the result is the
        root-sum-square of two phases: the quadratic phase measured over the aperture, and the hidden phase computed
        from exact ranges.

        Otherwise the result follows from the peak loss measured in the image. The loss equals the variance of the
        phase only to second order, and depends on the window. It is therefore converted to a variance by the ratio of
        variance to loss that exact ranges give under the same window. The variance of the cubic and higher phases is
        subtracted, and the rest is converted to a quadratic phase.
        """
        effect = images.effect
        variance, other_variance = _phase_variances(effect)
        if effect.hidden <= _HIDDEN_FRACTION * effect.equal_loss or variance + other_variance > _SINGLE_PEAK_RAD2:
            return math.hypot(reading.quadratic, effect.hidden)
        with_error, without = (highest(chip.image) for chip in (images.chip, images.reference))
        loss = 2 * math.log(without / with_error)
        measured = loss * (variance + other_variance) / self._expected_loss(images) - other_variance
        return QUADRATIC_OF_VARIANCE * math.sqrt(max(measured, 0.0))

    def shift(self, images: Responses, reading: ApertureReading) -> Shift:
        """Measure the displacement of a response, and the direction of its smear.

        The displacement is relative to the position that follows from exact ranges. Up to a peak loss of about 3 dB,
        the position of the response is the peak of the image. For a larger loss, the position follows from `reading`.
        If Doppler reverses within the aperture, the position is always the peak, because the slope of the phase over
        the aperture then does not determine a position along a line.
        """
        variance, other_variance = _phase_variances(images.effect)
        has_line = variance + other_variance > _SINGLE_PEAK_RAD2 and not images.spread.is_round
        return measured_shift(images.chip, images.reference, reading if has_line else None)

    def _expected_loss(self, images: Responses) -> float:
        """Expected peak loss of an image with errors: minus the natural logarithm of its relative peak power.

        The peak power is relative to an error-free image. It is computed from exact ranges, by a sum over pulses and
        frequencies under the window of the mission.
        """
        collection = self.collection
        times = cell_centres(collection.aperture_time, _DIRECT_SUM_SAMPLES)
        remaining_range = collection.flight(images.errors.slow(), times).range_error(
            (0.0, 0.0), images.effect.displacement
        )
        frequency = collection.radar.center_frequency + cell_centres(collection.radar.bandwidth, _DIRECT_SUM_SAMPLES)
        weights = collection.window(_DIRECT_SUM_SAMPLES)
        phases = np.exp(2j * math.pi / SPEED_OF_LIGHT_MPS * np.outer(remaining_range, frequency))
        return -2 * math.log(abs(weights @ phases @ weights) / weights.sum() ** 2)

    def focused(self, images: Responses) -> Responses:
        """Apply the autofocus algorithm of the mission to the image with errors.

        The quadratic phase changes from image line to image line. Therefore it is estimated only from the middle
        lines; their number is given by `shared_lines`.
        """
        algorithm = ALGORITHMS[self.mission.autofocus.algorithm]
        lines = images.chip.image.shape[0]
        half = min(lines // 2, lines - 1 - lines // 2, self.shared_lines(images.spread))
        centre = images.effect.displacement
        return images._replace(chip=refocused(self.collection, images.errors, centre, images.chip, algorithm, half))

    def shared_lines(self, spread: Spread) -> int:
        """Number of image lines on either side of the middle line that autofocus uses to estimate the phase.

        A line is used if its quadratic phase is nearly that of the middle line, or if it contains part of the
        response.
        """
        exact = self.analysis.exact
        (a, c, east, _), (b, d, north, _) = (gradient[:, 0] for gradient in exact.gradient)
        # At equal Doppler, one metre of range is a displacement on the ground by (d, −c)/(ad − bc).
        area, bends = abs(a * d - b * c), abs(float(exact.k[0]) * (d * east - c * north))
        per_line = bends * self.collection.range_cell / (OVERSAMPLING_FACTOR * spread.finer)
        shared = int(min(_MAX_DIFFERENCE_RAD * area / per_line if per_line else 1e6, 1e6))
        return max(shared, round(spread.walk * OVERSAMPLING_FACTOR * spread.finer / 2))

    def spread(self, errors: Errors, effect: ExactEffect) -> Spread:
        """Estimate how far a response spreads, from the range error that remains over the aperture.

        Each part of the aperture places the response on the line of equal range, at the point whose Doppler matches
        the slope of the remaining range error. If Doppler changes slowly along this line, even a small slope
        corresponds to a long distance. This is the case in parts of a long aperture, or if the gradients of range and
        Doppler are nearly parallel.
        """
        half = self.collection.aperture_time / 2
        time = np.linspace(-half, half, 257)
        point = np.array([*effect.displacement, 0.0])
        flight = self.collection.flight(errors.smooth(), time)
        remaining_range = flight.range_error((0.0, 0.0), effect.displacement)
        slopes = -look_sum(*(path.measured - point for path in flight.paths))[:, :2]
        lines = self.collection.range_lines(errors)
        cells = lines.cells(effect.displacement, self.mission.radar)
        if lines.turns_back:  # each moment displaces the point in the direction in which the line of sight turns
            turn = np.hypot(*np.gradient(slopes, time, axis=0).T)
            reach = 2 * math.ceil(
                min(float(np.abs(np.gradient(remaining_range, time) / turn).max()) / min(cells), 1e6)
            )
            return Spread(reach, reach, is_round=True)
        by_range = slopes[time.size // 2]
        doppler = slopes @ (np.array([by_range[1], -by_range[0]]) / np.hypot(*by_range))
        rate = np.gradient(doppler, time)
        min_rate = _MIN_DOPPLER_RATE_FRACTION * np.abs(rate).max()
        positions = np.gradient(remaining_range, time) / np.where(
            np.abs(rate) < min_rate, np.copysign(min_rate, rate), rate
        )
        walk = remaining_range - positions * (doppler - doppler[time.size // 2])
        return Spread(
            2 * math.ceil(min(float(np.abs(positions).max()) / cells[1], 1e6)),
            2 * math.ceil(min(float(np.abs(walk).max()) / self.collection.range_cell - 0.25, 64)),
            finer=cells[0] / lines.sampled(effect.displacement, self.mission.radar)[0],
        )


def _phase_variances(effect: ExactEffect) -> tuple[float, float]:
    """Variances over the aperture of the equal-loss quadratic phase, and of the cubic and higher phases. [rad²]

    The equal-loss quadratic phase is described in `Study.equal_loss`.
    """
    return (effect.equal_loss / QUADRATIC_OF_VARIANCE) ** 2, 4 / 175 * effect.cubic**2 + effect.rest**2
