"""Independent random variables of which all declared errors of a mission are composed, with their effects.

Monte Carlo draws these variables, and the quantiles of the total error follow from them. A stated error is one
variable. A covariance of a position and velocity error gives six variables. The effects of an error of a sensor, a
clock or the air are correlated; they are sums of independent variables, which follow from the covariance of the
effects. A tone is one variable, its unknown phase.

All effects are first-order effects according to the full model. The coverage factor, which turns sigmas into bounds,
is not applied.

A tone A·cos(2πfτ + ψ) has the effects cos ψ·c + sin ψ·s, where c are the effects of A·cos 2πfτ, and s those of −A·sin
2πfτ. Only the effects that a check judges are included. A vibration has phases if it has less than one cycle per
aperture. A faster vibration, and a tone of an oscillator, only displaces the image; its paired echoes are another
matter. A slow tone in the phase of an oscillator is part of the random errors of the oscillator. The tone that a
vibration causes in an oscillator is a quarter cycle out of phase with the vibration. The two displacements are then
uncorrelated, and they are independent variables here, as in a check.
"""

import math
from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.analysis.tone_displacement import ToneDisplacement
from bisar_budget.arrays import Booleans, Floats, PerCase
from bisar_budget.constants import VECTOR_ROUNDING_FRACTION
from bisar_budget.effects.effect import PLATFORMS, ErrorSource, plain, subject
from bisar_budget.effects.random_effect import RandomError
from bisar_budget.effects.range_processes import effect_weights
from bisar_budget.effects.sources import distribution_of, exact_ranges
from bisar_budget.effects.vibration import SLOWEST_ECHO_CYCLES
from bisar_budget.geometry import Vectors
from bisar_budget.mission.platforms import MotionError
from bisar_budget.ranges.exact_ranges import FINE_NODE_COUNT, QUADRATIC_OF_VARIANCE, ExactRanges

QUADRATIC, CUBIC, EAST, NORTH = range(4)  # indices of the effects of a variable
CONSTANT = "constant"  # distribution of a bias
FIRST_HIDDEN_INDEX = 4  # index of the first part of the hidden phase; all further effects are parts of it too

_EFFECT_COUNT = 8
_TURNED_PART_COUNT = 2  # further parts of the hidden phase if a line of sight turns by more than a radian
_VARIABLE_SUFFIXES = ("", ".cubic", ".east", ".north", ".hidden0", ".hidden1", ".hidden2", ".hidden3")
_BEYOND_SUFFIX = ".beyond"  # of the variable of a random error that has only a hidden phase beyond the cubic
_VARIANCE_ROUNDING_FRACTION = 1e-12  # of a variance; a smaller remainder is a rounding error
_BEYOND_ROUNDING_FRACTION = 1e-9  # of the square of a hidden phase; a smaller remainder is a rounding error
_CORRELATION_ROUNDING_FRACTION = 1e-5  # of a variance; correlations of a file have six decimals


class ToneMotion(NamedTuple):
    """Sinusoidal motion of a platform, or sinusoidal range error, in one case.

    `frequency` is in Hz, and `size` [m] is the amplitude. `platform_index` is the index of the platform, and `way`
    are the components of the direction in which it moves, each a number or (nodes, 1). `platform_index` is None for a
    range error.
    """

    frequency: float
    size: float
    platform_index: int | None = None
    way: Vectors = (0.0, 0.0, 0.0)


class Variable(NamedTuple):
    """One random variable and its effects on the image.

    The variable has the mean 0 and the variance 1. If `distribution` is `tone`, the variable is instead the phase ψ
    of a tone, which is uniform from 0 to 2π. If it is `constant`, the variable always has the value 1, as for a bias.

    `of` is the id of the error, or of the covariance, to which the variable belongs. `parts` are the errors that the
    variable causes if its value is 1, each with its size in the unit of the error. For random errors and tones
    `parts` is empty.

    `effects` are the effects if the value is 1. The first eight have the order of `effect_weights`: quadratic and
    cubic phase at the aperture edge [rad], displacement east and north [m], and four parts of the hidden phase [rad].
    The square of the hidden phase is the sum of the squares of its parts. If a line of sight turns by more than a
    radian, all that is beyond the cubic order is part of the hidden phase, and there are two further parts. The
    hidden phase of a single error is then exact, and of several errors its mean square is exact, but not its
    distribution, because the parts beyond the cubic are taken to have the same shape over the aperture.

    For a tone, `effects` are the effects at ψ = 0, and `quadrature` the effects at ψ = π/2. For other variables
    `quadrature` is empty. `motion` is the motion of a slow vibration, for exact ranges. It is None for other
    variables, and for tones of which only the displacement is judged.
    """

    id: str
    of: str
    owner: str
    distribution: str
    parts: tuple[tuple[ErrorSource, float], ...]
    effects: tuple[float, ...]
    quadrature: tuple[float, ...] = ()
    motion: ToneMotion | None = None

    @property
    def is_tone(self) -> bool:
        """Whether the variable is the phase of a tone."""
        return self.distribution == "tone"

    def covariance(self, index: int, other: int) -> float:
        """Covariance of two effects with the given indices, in the product of their units."""
        if self.distribution == CONSTANT:
            return 0.0
        product = self.effects[index] * self.effects[other]
        return (product + self.quadrature[index] * self.quadrature[other]) / 2 if self.is_tone else product

    def affects(self, index: int) -> bool:
        """Whether the variable has the effect with the given index."""
        return bool(self.effects[index] or (self.is_tone and self.quadrature[index]))

    @property
    def hides(self) -> bool:
        """Whether the variable has a part of the hidden phase."""
        return any(self.affects(index) for index in range(FIRST_HIDDEN_INDEX, len(self.effects)))


def variables_of(analysis: Analysis, case: int = 0) -> list[Variable]:
    """List the independent variables of all declared errors in the case with the given index.

    For many cases, create `ErrorVariables` once and ask it for each case.
    """
    return ErrorVariables(analysis).of(case)


class ErrorVariables:
    """Independent variables of the declared errors of an analysis, for each of its cases."""

    def __init__(self, analysis: Analysis) -> None:
        self.analysis, self.exact = analysis, analysis.exact

    def of(self, case: int = 0) -> list[Variable]:
        """List the variables in the case with the given index, in a fixed order."""
        return [
            *self._of_stated(case),
            *self._of_biases(case),
            *self._of_random(case),
            *self._of_vibrations(case),
            *self._of_tones(case),
        ]

    def _of_biases(self, case: int) -> Iterator[Variable]:
        """Yield the biases of the declared errors, each a variable of the value 1.

        If a line of sight turns by more than a radian, the part beyond the cubic is exact for a single bias only.
        """
        for source in self.analysis.errors.stated:
            if np.any(source.bias) and (bias := plain(source.bias, case)):
                caused = [(source.in_one_case(case), bias)]
                yield self._variable(f"{source.id}.bias", source.id, source.owner, CONSTANT, caused, case)
        further = (0.0,) * (_TURNED_PART_COUNT * bool(self.exact.is_turned[self._column(case)]))
        for error in self.analysis.random:
            if error.biased is not None and not error.counted_in:
                biased = error.biased.of(case)
                effects = (*(biased.bias * biased.full[:, 0]).tolist(), *further)
                yield Variable(f"{error.id}.bias", error.id, error.owner, CONSTANT, (), effects)

    # ---------------------------------------------------------------- stated errors
    def _of_stated(self, case: int) -> Iterator[Variable]:
        mission = self.analysis.mission
        factor = plain(mission.allocation.coverage_factor, case)
        singles = {source.id: source.in_one_case(case) for source in self.analysis.errors.stated}
        for group in self.analysis.groups:
            members = [singles.pop(row_id) for row_id in group.ids]
            correlation = np.array([[plain(rho, case) for rho in row] for row in group.correlation], float)
            for number, column in independent_columns(correlation, _CORRELATION_ROUNDING_FRACTION):
                sizes = column / factor
                caused = [(source, _declared(source) * sizes[axis].item()) for axis, source in enumerate(members)]
                yield self._variable(f"{group.id}.{number}", group.id, group.platform, "normal", caused, case)
        for source in singles.values():
            distribution = distribution_of(mission, source)
            size = abs(_declared(source)) / (factor if source.is_covered else 1.0)
            if distribution == "uniform":
                size /= math.sqrt(3)  # the standard uncertainty of ±a, GUM 4.3.7
            yield self._variable(source.id, source.id, source.owner, distribution, [(source, size)], case)

    def _variable(
        self,
        id: str,
        of: str,
        owner: str,
        distribution: str,
        caused: Sequence[tuple[ErrorSource, float]],
        case: int,
    ) -> Variable:
        return Variable(id, of, owner, distribution, tuple(caused), self._effects(caused, case))

    def _effects(self, caused: Sequence[tuple[ErrorSource, float]], case: int) -> tuple[float, ...]:
        """Sum of the effects of errors in one case, in the form of `Variable.effects`.

        Each item of `caused` has an error and its size.
        """
        moving = [(source.full, size) for source, size in caused if source.is_motion]
        effects = (
            math.fsum(source.full.qpe * size for source, size in caused),
            math.fsum(source.full.cubic * size for source, size in caused),
            math.fsum(full.east * size + 0.0 for full, size in moving),
            math.fsum(full.north * size + 0.0 for full, size in moving),
        )
        range_error = np.zeros(len(self.exact.times))
        for source, size in caused:
            if source.displaces and size:
                range_error = range_error + self._range_errors[source.id][:, self._column(case)] * size
        return (*effects, *self._hidden(range_error, effects[EAST], effects[NORTH], case))

    @cached_property
    def _range_errors(self) -> dict[str, Floats]:
        """Range error at the nodes due to one unit of each stated error that displaces the image, (nodes, cases).

        The keys are the ids of the errors. The unit is m per unit of the error.
        """
        errors = self.analysis.errors
        return {
            source.id: self.exact.range_error(errors.lanes(source)) for source in errors.stated if source.displaces
        }

    def _column(self, case: int) -> int:
        """Index of a case in an array of the exact ranges, which may be shared by all cases."""
        return case if self.exact.half.size > 1 else 0

    def _hidden(self, range_error: Floats, east: float, north: float, case: int) -> list[float]:
        """Parts of the hidden phase due to a range error before the displacement, in one case. [rad]

        `range_error` (nodes,) [m] is the range error at the nodes, and `east` and `north` [m] are the displacement
        that it causes. The parts are as in `Variable.effects`.
        """
        exact, column = self.exact, self._column(case)
        weights = exact.hidden_weights[..., column]
        phases: list[float] = (weights @ range_error).tolist()
        if not exact.is_turned[column]:
            return phases
        by_east, by_north = exact.slopes[..., column]
        remaining = range_error + by_east * east + by_north * north
        beyond = remaining - exact.sampling.polynomials @ (exact.fit @ remaining)
        square = (1 + float(exact.band[column])) * float(exact.fit[0] @ (beyond * beyond))
        phase = QUADRATIC_OF_VARIANCE * float(exact.k[column]) * math.sqrt(square)
        return [*phases, phase, *[0.0] * (_TURNED_PART_COUNT - 1)]

    # ---------------------------------------------------------------- random errors
    def _of_random(self, case: int) -> Iterator[Variable]:
        factor = plain(self.analysis.mission.allocation.coverage_factor, case)
        for error in self.analysis.random:
            yield from self._of_noise(error, factor, case)

    def _of_noise(self, error: RandomError, factor: float, case: int) -> Iterator[Variable]:
        """Yield the independent variables of a random error of a sensor, a clock or the atmosphere.

        The effects of these variables are the columns of the Cholesky factor of the covariance of eight effects. The
        first variable causes the whole quadratic phase, and the part of each further effect that is correlated with
        it. Each following variable causes the part of the next effect that the variables before it do not cause. If a
        line of sight turns by more than a radian, a last variable causes the hidden phase beyond the cubic order,
        which is not in the covariance.

        An error to which the coverage factor does not apply is a bound. Its effects are drawn with their full size
        and a random sign.
        """
        declared = 0.0 if error.declared is None else plain(error.declared, case)
        if not declared or error.full.covariance is None or error.counted_in:
            return
        effect = error.full.of(case) if error.full.covariance.ndim == 3 else error.full
        size = declared / (factor if error.is_covered else 1.0)  # for an oscillator its effects contain the size
        distribution = "normal" if error.is_covered else "bound"
        is_turned = bool(self.exact.is_turned[self._column(case)])
        further = (0.0,) * (_TURNED_PART_COUNT * is_turned)
        covariance = np.array(effect.covariance) * size**2
        for index, column in independent_columns(covariance):
            variable_id = f"{error.id}{_VARIABLE_SUFFIXES[index]}"
            # In a column of the hidden phase, the effects before it are rounding errors.
            if index >= FIRST_HIDDEN_INDEX:
                column[:FIRST_HIDDEN_INDEX] = 0.0
            effects = (*column.tolist(), *further)
            yield Variable(variable_id, error.id, error.owner, distribution, (), effects)
        square = (effect.hidden * size) ** 2
        beyond = square - math.fsum(np.diagonal(covariance)[FIRST_HIDDEN_INDEX:].tolist())
        if is_turned and beyond > _BEYOND_ROUNDING_FRACTION * square:
            effects = (*(0.0,) * _EFFECT_COUNT, math.sqrt(beyond), *further[1:])
            yield Variable(f"{error.id}{_BEYOND_SUFFIX}", error.id, error.owner, distribution, (), effects)

    # ---------------------------------------------------------------- tones
    def _of_vibrations(self, case: int) -> Iterator[Variable]:
        """Yield the variables of the sinusoidal vibrations of platforms, one for each axis of each vibration."""
        moves = {tone.subject.id: tone for tone in self.analysis.displacing_tones}
        for row_id, axes in self._vibrations.items():
            owner = moves[row_id].subject.owner
            for axis, (vibration, displaced) in enumerate(zip(axes, moves[row_id].full, strict=True)):
                both = [
                    [*phases[:EAST, case], *moved[:, case if moved.shape[-1] > 1 else 0], *phases[EAST:, case]]
                    for phases, moved in zip(vibration.phases, displaced.waves, strict=True)
                ]
                is_turned = bool(self.exact.is_turned[self._column(case)])
                effects, quadrature = (
                    tuple(float(effect) for effect in (wave if is_turned else wave[:_EFFECT_COUNT])) for wave in both
                )
                variable_id = row_id if len(axes) == 1 else f"{row_id}.{axis}"
                motion = vibration.motion(case)
                if any(effects) or any(quadrature):
                    yield Variable(variable_id, row_id, owner, "tone", (), effects, quadrature, motion)

    def _of_tones(self, case: int) -> Iterator[Variable]:
        """Yield the variables of the tones of oscillators, which displace the image, one for each frequency."""
        is_turned = bool(self.exact.is_turned[self._column(case)])
        hidden = (0.0,) * (_EFFECT_COUNT - FIRST_HIDDEN_INDEX + _TURNED_PART_COUNT * is_turned)
        for tone in self.analysis.displacing_tones:
            if tone.subject.id in self._vibrations:
                continue
            for index, component in enumerate(tone.full):
                moved = [wave[:, case if wave.shape[-1] > 1 else 0].tolist() for wave in component.waves]
                effects, quadrature = ((0.0, 0.0, east, north, *hidden) for east, north in moved)
                variable_id = tone.subject.id if len(tone.full) == 1 else f"{tone.subject.id}.{index}"
                if any(effects) or any(quadrature):
                    row_id, owner = tone.subject.id, tone.subject.owner
                    yield Variable(variable_id, row_id, owner, "tone", (), effects, quadrature)

    @cached_property
    def _vibrations(self) -> dict[str, list["_Vibration"]]:
        """Sinusoidal vibrations of platforms along each of their axes, by the id of the row."""
        platforms = self.analysis.mission.platforms
        ids = {
            subject(name, "vibration", "sinusoidal", entry=index).id
            for name in PLATFORMS
            for index in range(len(getattr(platforms, name).motion_error.vibration.sinusoidal))
        }
        tones = [tone for tone in self.analysis.displacing_tones if tone.subject.id in ids]
        return {tone.subject.id: self._axes_of(tone) for tone in tones}

    def _axes_of(self, tone: ToneDisplacement) -> list["_Vibration"]:
        mission, geometry = self.analysis.mission, self.analysis.geometry
        name, is_heard = tone.subject.owner, mission.has_direct_path
        platform_index, exact = PLATFORMS.index(name), self._fine
        error: MotionError = getattr(mission.platforms, name).motion_error
        line = error.vibration.sinusoidal[tone.subject.entry or 0]
        value, frequency = line.displacement, line.frequency
        sizes: Sequence[PerCase] = value if isinstance(value, tuple) else (value,)
        ways: Sequence[Vectors]
        if isinstance(value, tuple):
            ways = getattr(geometry, name).frame(error.frame)
            along = [exact.along(platform_index, way) for way in ways]
        else:  # along the line of sight, which turns; all of it is range error without a direct path
            along = [exact.along(platform_index, _sight(exact, platform_index))]
            ways = [_sight(self.exact, platform_index)]
        is_range_error = not (is_heard or isinstance(value, tuple))
        is_slow: Booleans = np.asarray(frequency * mission.collection.aperture_time < SLOWEST_ECHO_CYCLES)
        angle = 2 * math.pi * frequency * exact.times
        waves = np.array((np.cos(angle), -np.sin(angle))) * is_slow
        return [
            _Vibration(
                self._phases(waves * (course * size)),
                frequency,
                size,
                platform_index,
                None if is_range_error else way,
                is_slow,
            )
            for course, size, way in zip(along, sizes, ways, strict=True)
        ]

    @cached_property
    def _fine(self) -> ExactRanges:
        """Exact ranges at enough nodes to resolve a tone of less than one cycle per aperture."""
        analysis = self.analysis
        count = max(FINE_NODE_COUNT, len(self.exact.times))
        return exact_ranges(analysis.mission, analysis.geometry, count, analysis.cases)

    @cached_property
    def _weights(self) -> Floats:
        return effect_weights(self._fine)

    def _phases(self, waves: Floats) -> Floats:
        """Phases due to the cosine and the sine of a tone, (2, 8, cases). [rad]

        `waves` (2, nodes, cases) [m] are the range errors. The eight phases are quadratic, cubic, four parts of the
        hidden phase, and two parts of the hidden phase beyond the cubic. The last two are 0 unless a line of sight
        turns by more than a radian. Two parts are enough for the mean squares of cosine and sine and their mean
        product, that is for the hidden phase in any phase of the tone.
        """
        exact = self._fine
        waves = np.broadcast_to(waves, (2, len(exact.times), self.analysis.cases))
        weighted = self._weights * waves[:, None]
        effects, seen = weighted.sum(axis=2), np.abs(weighted).sum(axis=2)
        effects = np.where(np.abs(effects) > VECTOR_ROUNDING_FRACTION * seen, effects, 0.0)
        remaining = exact.left_of_small(waves, (effects[:, EAST], effects[:, NORTH]))
        beyond = remaining - exact.sampling.polynomials @ (exact.fit @ remaining)
        products = np.einsum("n,anc,bnc->abc", exact.fit[0], beyond, beyond)
        first = np.sqrt(products[0, 0])
        shared = np.divide(products[0, 1], first, out=np.zeros_like(first), where=first > 0)
        second = np.sqrt(np.maximum(products[1, 1] - shared**2, 0.0))
        further = np.array(((first, 0.0 * first), (shared, second)))
        further *= QUADRATIC_OF_VARIANCE * exact.k * np.sqrt(1 + exact.band) * exact.is_turned
        return np.concatenate((effects[:, :EAST], effects[:, FIRST_HIDDEN_INDEX:], further), axis=1)


class _Vibration(NamedTuple):
    """Sinusoidal vibration of a platform along one axis, in all cases, and the phases that it causes.

    `phases` (2, 8, cases) [rad] are the phases at ψ = 0 and at ψ = π/2, see `ErrorVariables._phases`. They are 0 in
    cases in which the vibration is not slow. `way` is the direction of the motion, or None if all of the motion is
    range error.
    """

    phases: Floats
    frequency: PerCase
    size: PerCase
    platform_index: int
    way: Vectors | None
    is_slow: Booleans

    def motion(self, case: int) -> ToneMotion | None:
        """Return the motion in the case with the given index; None if the vibration is not slow."""
        if not plain(self.is_slow, case):
            return None
        frequency, size = plain(self.frequency, case), plain(self.size, case)
        if self.way is None:  # a motion along the line of sight, away from the scene, shortens the recorded range
            return ToneMotion(frequency, -size)
        x, y, z = (_component(component, case) for component in self.way)
        return ToneMotion(frequency, size, self.platform_index, (x, y, z))


def _component(component: PerCase, case: int) -> PerCase:
    if np.ndim(component) < 2:
        return plain(component, case)
    array = np.asarray(component)
    return array[:, [case]] if array.shape[1] > 1 else array


def _sight(exact: ExactRanges, platform_index: int) -> Vectors:
    """Unit vector from the scene centre to a platform at the nodes, three components (nodes, cases)."""
    x, y, z = (component / exact.ranges[platform_index] for component in exact.tracks[platform_index])
    return (x, y, z)


def _declared(source: ErrorSource) -> float:
    """Declared size of an error in a single case; 0 if the file declares no size in this case."""
    return 0.0 if source.declared is None or math.isnan(source.declared) else float(source.declared)


def independent_columns(
    covariance: Floats, rounding: float = _VARIANCE_ROUNDING_FRACTION
) -> Iterator[tuple[int, Floats]]:
    """Yield the columns (n,) of the Cholesky factor of a covariance (n, n), each with its index.

    The covariance may be singular, and its rows may have different units. A column is left out if the columns before
    it leave less than the fraction `rounding` of its variance. Eigenvectors are not used: equal eigenvalues have any
    basis of their eigenspace, and LAPACK libraries choose different ones, so that one seed would give different draws
    on different machines.
    """
    variances = np.diagonal(covariance).tolist()
    for index, variance in enumerate(variances):
        remaining = covariance[index, index]
        if remaining > rounding * variance:
            column = covariance[:, index] / math.sqrt(remaining)
            covariance = covariance - np.multiply.outer(column, column)
            yield index, column
