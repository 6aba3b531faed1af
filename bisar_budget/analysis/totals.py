"""Distributions of the effects of all declared errors together, and their quantiles.

An effect is what a requirement limits: the quadratic phase with its hidden parts, the cubic phase, or the
displacement of the image on the ground. Each declared error contributes one or more independent random vectors, and a
bias a constant one (see `variables`). A requirement with a confidence p judges the p-quantile of the length of their
sum. A requirement without a confidence judges the length of the sum of the biases, plus k times the root-sum-square
of the random parts, where k is the coverage factor.

The vectors are first-order effects. The vector of an error whose effects are not proportional to its size is scaled
to the effect of its judged size, computed from exact ranges.
"""

import math
from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np

from bisar_budget.analysis import variables as effects_of
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.analysis.variables import CONSTANT, FIRST_HIDDEN_INDEX, ErrorVariables, Variable
from bisar_budget.arrays import Floats, PerCase
from bisar_budget.effects.declared import CUBIC, LIMITING_REQUIREMENTS, LOCATION, QUADRATIC
from bisar_budget.effects.effect import ErrorSource, plain
from bisar_budget.random_vector import RandomVector

PERCENTILES = (0.5, 0.68, 0.9, 0.95, 0.997)  # probabilities that every report states

_UNSEEN_SQUARE_FRACTION = 4e-4  # of the square of a phase; a hidden phase below it adds 0.02 % to a quantile
_UNIFORM_WIDTH = math.sqrt(3)  # largest value of a uniform variable of variance 1
IsMember = Callable[[str], bool]
"""Whether the errors of an owner, such as `receiver`, are part of a sum."""


class Totals:
    """Distributions of the sums of all declared errors of an analysis, in each of its cases and in both models."""

    def __init__(self, analysis: Analysis) -> None:
        self.analysis, self.errors = analysis, analysis.errors
        self._variables: dict[tuple[str, int], list[Variable]] = {}

    @cached_property
    def _listing(self) -> ErrorVariables:
        return ErrorVariables(self.analysis)

    @cached_property
    def is_biased(self) -> bool:
        """Whether any declared error has a bias."""
        return any(np.any(source.bias) for source in self.errors.stated) or any(
            error.biased is not None for error in self.analysis.random
        )

    def is_asked(self, requirement: str) -> bool:
        """Whether a requirement judges anything but the declared sizes: a confidence, or biases."""
        return self.is_biased or self.errors.confidence(requirement) is not None

    # ---------------------------------------------------------------- distributions
    def vector(
        self, model: str, requirement: str, is_member: IsMember, case: int, gain: PerCase = 1.0
    ) -> RandomVector:
        """Random vector whose length is the effect that a requirement limits, due to the errors of some owners.

        Parameters
        ----------
        model : str
            `published` or `full`.
        requirement : str
            `quadratic_phase_error` [rad], `cubic_phase_error` [rad] or `location_error` [m].
        is_member : callable
            Whether the errors of an owner are part of the sum.
        case : int
            Index of the case.
        gain : float or (cases,)
            Gain of autofocus, which multiplies the hidden phase; see `Declared.judged`.
        """
        variables = [each for each in self._of(model, case) if is_member(each.owner)]
        columns, weights = _columns(requirement, _hidden_count(variables, plain(gain, case)), plain(gain, case))
        vectors_of: dict[str, list[Floats]] = {
            "normal": [],
            "uniform": [],
            "bound": [],
            "tone": [],
            CONSTANT: [],
        }
        for variable in variables:
            scale = self._scale(model, requirement, variable, case, gain)
            vector = _taken(variable.effects, columns) * weights * scale
            if variable.distribution == "tone":
                vectors_of["tone"].append(np.array((vector, _taken(variable.quadrature, columns) * weights)))
            elif variable.distribution == "uniform":
                vectors_of["uniform"].append(vector * _UNIFORM_WIDTH)
            else:
                vectors_of[variable.distribution].append(vector)
        mean = sum(vectors_of.pop(CONSTANT), np.zeros(len(columns)))
        shapes = {"tone": (-1, 2, len(columns))}
        arrays = {
            name: np.array(vectors, dtype=float).reshape(shapes.get(name, (-1, len(columns))))
            for name, vectors in vectors_of.items()
        }
        return RandomVector(mean, **arrays)

    def biases(
        self, model: str, requirement: str, is_member: IsMember, case: int, gain: PerCase = 1.0
    ) -> list[tuple[str, Floats]]:
        """Effects of the biases of the errors of some owners, each with the id of its error.

        The parameters are those of `vector`, and the effects have its components. Their sum is its mean.
        """
        variables = [each for each in self._of(model, case) if is_member(each.owner)]
        columns, weights = _columns(requirement, _hidden_count(variables, plain(gain, case)), plain(gain, case))
        return [
            (
                each.of,
                _taken(each.effects, columns) * weights * self._scale(model, requirement, each, case, gain),
            )
            for each in variables
            if each.distribution == CONSTANT
        ]

    def reached(
        self, model: str, requirement: str, is_member: IsMember, root_sum_square: Floats, gain: PerCase = 1.0
    ) -> Floats:
        """Size that a requirement judges for the sum of the errors of some owners, (cases,), in its unit.

        The parameters are those of `vector`. `root_sum_square` (cases,) is the size without biases and a confidence.
        The result is infinite or NaN in the cases in which an error leaves no image, at its declared size, at the
        size that the requirement judges, or as a bias.
        """
        if not self.is_asked(requirement):
            return root_sum_square
        confidence, reached = self.errors.confidence(requirement), np.array(root_sum_square, dtype=float)
        for case in np.flatnonzero(np.isfinite(reached)):
            vector = self.vector(model, requirement, is_member, int(case), gain)
            if not vector.is_finite:
                reached[case] = math.nan
            elif confidence is None:
                reached[case] += np.linalg.norm(vector.mean)
            else:
                (reached[case],) = vector.quantiles((confidence,))
        return reached

    def of_all(self, model: str, requirement: str, case: int) -> RandomVector:
        """Random vector of the effect of all declared errors, without the gain of autofocus; see `vector`."""
        return self.vector(model, requirement, lambda owner: True, case)

    # ---------------------------------------------------------------- variables of a model
    def _of(self, model: str, case: int) -> list[Variable]:
        if (model, case) not in self._variables:
            variables = self._listing.of(case)
            if model == "published":
                variables = self._published(variables, case)
            self._variables[model, case] = variables
        return self._variables[model, case]

    def _published(self, variables: Sequence[Variable], case: int) -> list[Variable]:
        """Replace the effects of variables by those of the published model, which hides no phase.

        The published model has only the sigmas of random errors. Their effects are independent there.
        """
        published = [
            each._replace(effects=self._published_effects(each.parts, case)) for each in variables if each.parts
        ]
        for error in self.analysis.random:
            if error.declared is None or error.counted_in:
                continue
            if error.biased is not None:
                bias = error.biased.of(case)
                effects = tuple((bias.bias * np.nan_to_num(bias.published[:, 0])).tolist())
                published.append(Variable(f"{error.id}.bias", error.id, error.owner, CONSTANT, (), effects))
            effect, size = error.published.of(case), plain(error.declared, case)
            size /= plain(error.coverage(self.analysis.mission), case)
            distribution = "normal" if error.is_covered else "bound"
            for index, sigma in enumerate((effect.quadratic, effect.cubic, effect.east, effect.north)):
                if sigma and math.isfinite(sigma):
                    effects = tuple(sigma * size if column == index else 0.0 for column in range(FIRST_HIDDEN_INDEX))
                    published.append(
                        Variable(f"{error.id}.{index}", error.id, error.owner, distribution, (), effects)
                    )
        moved = {tone.subject.id: tone for tone in self.analysis.displacing_tones}
        seen = set[str]()
        for each in variables:
            if each.distribution != "tone":
                continue
            effects, quadrature = each.effects[: effects_of.EAST], each.quadrature[: effects_of.EAST]
            published.append(each._replace(effects=(*effects, 0.0, 0.0), quadrature=(*quadrature, 0.0, 0.0)))
            seen.add(each.of)
        for row_id, tone in moved.items():
            for index, tone_part in enumerate(tone.published):
                ahead, behind = (
                    np.nan_to_num(wave[:, case if wave.shape[-1] > 1 else 0]) for wave in tone_part.waves
                )
                published.append(
                    Variable(
                        f"{row_id}.published{index}",
                        row_id,
                        tone.subject.owner,
                        "tone",
                        (),
                        (0.0, 0.0, *ahead.tolist()),
                        (0.0, 0.0, *behind.tolist()),
                    )
                )
        return published

    def _published_effects(self, parts: Sequence[tuple[ErrorSource, float]], case: int) -> tuple[float, ...]:
        plane = self.errors.planes["published"]
        effects = np.zeros(FIRST_HIDDEN_INDEX)
        for source, size in parts:
            moved = (
                [plain(each, case) for each in plane.displacement(source.effect, size)] if source.is_motion else []
            )
            effects += (
                source.effect.qpe * size,
                source.effect.cubic * size,
                *(np.nan_to_num(moved) if moved else (0.0, 0.0)),
            )
        return tuple(effects.tolist())

    def _scale(self, model: str, requirement: str, variable: Variable, case: int, gain: PerCase) -> float:
        """Ratio of the exact effect of an error at its judged size to its first-order effect; 1 for small errors.

        The result is NaN if an error of this size leaves no image.
        """
        if model == "published" or len(variable.parts) != 1:
            return 1.0
        ((source, _),) = variable.parts
        stated = next(each for each in self.errors.stated if each.id == source.id)
        if not self.errors.is_large(stated)[case]:
            return 1.0
        block, index = self.errors.block_of(stated)
        exact = self.errors.judged("full", stated).in_one_case(case)
        size = abs(plain(block.judged_sizes(requirement)[index], case))
        per_unit = plain(block.per_unit("full")[LIMITING_REQUIREMENTS.index(requirement), index], case)
        if requirement == QUADRATIC:  # with this gain, not with that of the mission
            hidden = plain(gain, case) * plain(block.hidden_per_unit[0, index], case)
            per_unit = math.hypot(plain(block.effects["full"].qpe[index], case), hidden)
        moved = math.nan if exact.farthest is None else math.hypot(*exact.farthest)
        effect = {QUADRATIC: exact.judged(plain(gain, case)), CUBIC: abs(exact.cubic), LOCATION: moved}[requirement]
        first_order = per_unit * size
        return float(effect / first_order) if first_order else 1.0


def _hidden_count(variables: Sequence[Variable], gain: float) -> int:
    """Number of parts of the hidden phase that variables have; 0 if they change no quantile."""
    phase = hidden = 0.0
    for variable in variables:
        for effects in (variable.effects, variable.quadrature):
            phase += sum(effect**2 for effect in effects[effects_of.QUADRATIC : effects_of.QUADRATIC + 1])
            hidden += sum(effect**2 for effect in effects[FIRST_HIDDEN_INDEX:])
    if gain**2 * hidden <= _UNSEEN_SQUARE_FRACTION * phase:
        return 0
    return max(len(variable.effects) for variable in variables) - FIRST_HIDDEN_INDEX


def _columns(requirement: str, hidden_count: int, gain: float) -> tuple[list[int], Floats]:
    """Indices of the effects whose length a requirement limits, and the factors of these effects."""
    if requirement == LOCATION:
        return [effects_of.EAST, effects_of.NORTH], np.ones(2)
    if requirement == CUBIC:
        return [effects_of.CUBIC], np.ones(1)
    hidden = list(range(FIRST_HIDDEN_INDEX, FIRST_HIDDEN_INDEX + hidden_count))
    return [effects_of.QUADRATIC, *hidden], np.array([1.0, *(gain for _ in hidden)])


def _taken(effects: Sequence[float], columns: Sequence[int]) -> Floats:
    """Select effects; those that a variable does not have are 0."""
    return np.array([effects[column] if column < len(effects) else 0.0 for column in columns])
