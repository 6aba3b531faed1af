"""Explanation steps for biases and confidences: the size that a requirement judges, and quantiles of all errors."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.analysis.totals import IsMember, Totals
from bisar_budget.arrays import Floats
from bisar_budget.effects.declared import CUBIC, LIMITING_REQUIREMENTS, LOCATION, QUADRATIC
from bisar_budget.effects.effect import ErrorSource, plain
from bisar_budget.effects.error_quantiles import allowable_size, judged_size, quantile_factor
from bisar_budget.effects.random_effect import RandomError
from bisar_budget.effects.sources import distribution_of
from bisar_budget.faults import printable
from bisar_budget.findings.row import Row
from bisar_budget.mission.model import Mission
from bisar_budget.report.explain.notation import Step, Sum, WorkedEquation, number, step, with_unit

_VARIABLE_WORDS = {
    "normal": "x standard normal",
    "uniform": "x uniform from −1 to 1",
    "bound": "x either −1 or 1",
}
_SYMBOLS = {QUADRATIC: "QPE", CUBIC: "cubic", LOCATION: "location"}  # of sizes and allowables by each requirement


def confidence_percent(confidence: float) -> str:
    """Confidence in percent, such as `95 %`."""
    return f"{100 * confidence:.8g} %"


@dataclass(frozen=True, slots=True)
class SizeRule:
    """Rule by which the size that a requirement judges follows from the declared size of an error.

    `bias` is the magnitude of the bias, in the unit of the error. A rule may also have effects of the bias and of the
    random part instead of their sizes. `names` are the symbols of the two in the explanation.
    """

    requirement: str
    distribution: str
    bias: float
    confidence: float | None
    unit: str
    names: tuple[str, str] = ("bias", "declared")

    @classmethod
    def of(cls, analysis: Analysis, source: ErrorSource, requirement: str) -> "SizeRule":
        """Rule for an error and a requirement in the only case of an analysis."""
        confidence, unit = analysis.mission.requirements.confidence_of(requirement), source.unit
        bias = 0.0 if source.declared is None else abs(plain(source.bias))
        return cls(requirement, distribution_of(analysis.mission, source), bias, confidence, unit)

    @property
    def symbol(self) -> str:
        """Symbol of what the requirement limits, such as `location`."""
        return _SYMBOLS[self.requirement]

    @property
    def is_plain(self) -> bool:
        """Whether the requirement judges the declared size itself."""
        return self.confidence is None and not self.bias

    @property
    def words(self) -> str:
        """Text that defines the judged size."""
        bias, declared = self.names
        if self.confidence is None:
            return f"|{bias}| + {declared}"
        terms = f"{bias} + {declared}*x" if self.bias else f"{declared}*x"
        return f"{confidence_percent(self.confidence)} quantile of |{terms}|, {_VARIABLE_WORDS[self.distribution]}"

    def judged(self, size: float) -> float:
        """Judged size of an error of the declared size `size`."""
        return float(judged_size(self.distribution, size, self.bias, self.confidence))

    def allowable(self, reached: float) -> float:
        """Largest declared size of an error whose judged size is at most `reached`."""
        return float(allowable_size(self.distribution, reached, self.bias, self.confidence))

    def judged_line(self, symbol: str, size: float) -> list[str]:
        """Lines that compute the judged size from the declared size."""
        judged, terms = self.judged(size), self._terms(size)
        if terms:
            return [Sum(f"{symbol} = {terms} = {with_unit(judged, self.unit)}")]
        return [f"{symbol} = {with_unit(judged, self.unit)}", *self._probability(judged, size)]

    def _terms(self, size: float) -> str:
        """Formula of the judged size with numbers; empty for a normal error with a bias, which has none."""
        bias, declared, p = number(self.bias), number(size), self.confidence
        if p is None:
            return f"{bias} + {declared}"
        if self.distribution == "bound":
            return f"|{bias} - {declared}|" if p <= 0.5 else f"{bias} + {declared}"
        if self.distribution == "uniform":
            unbiased = f"{number(p)}*{declared}"
            return f"max({unbiased}, {bias} + {number(2 * p - 1)}*{declared})" if self.bias else unbiased
        if not size:
            return bias
        return "" if self.bias else f"{number(quantile_factor('normal', p))}*{declared}"

    def _probability(self, limit: float, size: float) -> list[str]:
        """Lines that compute the probability with which a normal error with a bias keeps a limit.

        The distances from the bias to the limit of either sign have their own lines, with six digits of their own:
        the difference of two rounded numbers would be too coarse for a bias near the limit.
        """
        distances = {"near": limit - self.bias, "far": limit + self.bias}
        terms = " + ".join(f"erf({number(distance)}/(sqrt(2)*{number(size)}))" for distance in distances.values())
        probability = sum(math.erf(distance / (math.sqrt(2) * size)) / 2 for distance in distances.values())
        return [
            *(
                Sum(f"{name} = {number(limit)} {sign} {number(self.bias)} = {with_unit(distances[name], self.unit)}")
                for name, sign in (("near", "-"), ("far", "+"))
            ),
            Sum(f"probability = ({terms})/2 = {number(probability)}"),
        ]

    def allowable_step(self, reached: float, allowable: float, symbol: str = "", at_limit: str = "") -> Step:
        """Step from the size that reaches a limit to the declared size of which this is the judged size.

        `symbol` and `at_limit` are the symbols of the declared size and of the size that reaches the limit. By
        default they are named after the requirement.
        """
        symbol, at_limit = symbol or f"by_{self.symbol}", at_limit or f"limit_{self.symbol}"
        title = f"Allowable by requirements.{self.requirement}: {at_limit} is its judged size, {self.words}"
        if self.names != ("bias", "declared"):
            title = (
                f"{self.names[1]} at the limit of requirements.{self.requirement} on the judged effect, {self.words}"
            )
        if not allowable:
            return step(f"{title}; the bias alone exceeds it", f"{symbol} = {with_unit(allowable, self.unit)}")
        terms = self._allowable_terms(number(reached))
        if terms:
            return step(title, Sum(f"{symbol} = {terms} = {with_unit(allowable, self.unit)}"))
        return step(title, f"{symbol} = {with_unit(allowable, self.unit)}", *self._probability(reached, allowable))

    def _allowable_terms(self, reached: str) -> str:
        bias, p = number(self.bias), self.confidence
        if p is None or self.distribution == "bound":
            return f"{reached} {'+' if p is not None and p <= 0.5 else '-'} {bias}"
        if self.distribution == "uniform":
            unbiased = f"{reached}/{number(p)}"
            has_two = self.bias and p > 0.5
            return f"min({unbiased}, ({reached} - {bias})/{number(2 * p - 1)})" if has_two else unbiased
        return "" if self.bias else f"{reached}/{number(quantile_factor('normal', p))}"


def rules_of(analysis: Analysis, source: ErrorSource) -> dict[str, SizeRule]:
    """Rules for the requirements that judge an error, by requirement."""
    required = analysis.mission.requirements
    return {
        requirement: SizeRule.of(analysis, source, requirement)
        for requirement in LIMITING_REQUIREMENTS
        if getattr(required, requirement) is not None and (source.is_motion or requirement == QUADRATIC)
    }


def judged_steps(analysis: Analysis, source: ErrorSource) -> Iterator[Step]:
    """Yield the steps from the declared size of an error to the sizes that the requirements judge.

    There are none if the requirements judge the declared size itself.
    """
    if source.declared is None:
        return
    if bias := plain(source.bias):
        yield step("Known and constant, with its sign", f"bias = {with_unit(bias, source.unit)}")
    for requirement, rule in rules_of(analysis, source).items():
        if not rule.is_plain:
            title = f"Judged size for requirements.{requirement}, {rule.words}"
            yield step(title, *rule.judged_line(f"judged_{_SYMBOLS[requirement]}", abs(source.declared)))


def biased_use(analysis: Analysis, source: ErrorSource, row: Row) -> Step:
    """Step for the utilization of an error with a bias, from the sizes that reach the limits."""
    size, terms, required = abs(source.declared or 0.0), list[str](), analysis.mission.requirements
    model = analysis.full if row.model == "full" else analysis.published
    for requirement, rule in rules_of(analysis, source).items():
        limit = getattr(required, requirement)
        if requirement == QUADRATIC:
            limit = analysis.allocation.qpe_allowed(source.owner)
        reached = model.allowable(source, requirement, float(limit))
        if reached is not None:
            terms.append(f"{number(rule.judged(size))}/{number(reached)}")
    text = f"max({', '.join(terms)})" if len(terms) > 1 else terms[0]
    line = Sum(f"utilization = {text} = {number(row.utilization or 0.0)}")
    return step("Utilization, the largest judged size / size at the limit", line)


@dataclass(frozen=True, slots=True)
class BiasedEffect:
    """Effect of a random error with a bias, on the quantity that a requirement limits: the bias and the random part.

    `per_unit` is the effect of one unit of the random part, and `lines` compute the effect of the bias.
    """

    rule: SizeRule
    per_unit: float
    lines: tuple[WorkedEquation, ...]
    declared: float

    @classmethod
    def of(cls, mission: Mission, error: RandomError, model: str, requirement: str, gain: float) -> "BiasedEffect":
        """Effect of an error with a bias in one case, with the gain of autofocus."""
        assert error.biased is not None
        name, bias, effect = _SYMBOLS[requirement], plain(error.biased.bias), error.effect(model)
        per_unit = [float(each) for each in error.biased.of(0)._asdict()[model][:, 0]]
        unit = "m" if requirement == LOCATION else "rad"
        if requirement == LOCATION:
            components, sigma = {"east": per_unit[2], "north": per_unit[3]}, plain(effect.displacement)
        elif requirement == CUBIC:
            components, sigma = {"cubic": per_unit[1]}, plain(effect.cubic)
        else:
            hidden = math.hypot(*per_unit[4:])
            components = {"QPE": per_unit[0]} | ({"hidden": hidden} if hidden else {})
            sigma = plain(effect.judged(gain))
        lines, values = list[WorkedEquation](), dict[str, float]()
        for component, each in components.items():
            known_values = {"bias": bias, f"{component}/unit": each}
            values[f"of_bias_{component}"] = bias * each
            lines.append(
                WorkedEquation(f"of_bias_{component}", f"bias*{component}/unit", known_values, bias * each, unit)
            )
        formula = "sqrt(" + " + ".join(f"{symbol}^2" for symbol in values) + ")"
        if "hidden" in components:
            formula, values["gain"] = "sqrt(of_bias_QPE^2 + (gain*of_bias_hidden)^2)", gain
        length = error.biased.sizes(model, gain)[LIMITING_REQUIREMENTS.index(requirement)]
        names = (f"bias_{name}", f"random_{name}")
        lines.append(WorkedEquation(names[0], formula, values, plain(length), unit))
        confidence = mission.requirements.confidence_of(requirement)
        rule = SizeRule(requirement, error.distribution, plain(length), confidence, unit, names)
        return cls(rule, sigma, tuple(lines), plain(error.declared))

    @property
    def judged(self) -> float:
        """Judged effect of the declared error."""
        return self.rule.judged(self.per_unit * self.declared)

    @property
    def is_felt(self) -> bool:
        """Whether the bias or the random part has the effect."""
        return self.rule.bias > 0 or self.per_unit > 0

    @property
    def symbol(self) -> str:
        """Symbol of the effect, such as `location`."""
        return self.rule.symbol

    def judged_steps(self, effect_symbol: str) -> Iterator[Step]:
        """Yield the steps to the judged effect.

        `effect_symbol` is the symbol of the effect of one unit, such as `QPE/unit`.
        """
        random_effect, unit = self.per_unit * self.declared, self.rule.unit
        values = {effect_symbol: self.per_unit, "declared": self.declared}
        random_line = WorkedEquation(self.rule.names[1], f"{effect_symbol}*declared", values, random_effect, unit)
        yield step(
            f"For requirements.{self.rule.requirement}: effect of the bias, and of the random part",
            *self.lines,
            random_line,
        )
        lines = self.rule.judged_line(f"judged_{self.symbol}", random_effect)
        yield step(f"Judged effect, {self.rule.words}", *lines)

    def allowable_steps(self, limit: float, effect_symbol: str, unit: str) -> Iterator[Step]:
        """Yield the steps from a limit to the declared size whose judged effect is the limit."""
        most, size = self.rule.allowable(limit), self.allowable(limit)
        if size is None:
            return
        if not self.per_unit:
            yield step("The bias alone exceeds the limit", f"by_{self.symbol} = {with_unit(size, unit)}")
            return
        yield self.rule.allowable_step(limit, most, f"most_{self.symbol}")
        values = {f"most_{self.symbol}": most, effect_symbol: self.per_unit}
        formula = f"most_{self.symbol}/({effect_symbol})"
        yield step(
            "Declared size with this random part", WorkedEquation(f"by_{self.symbol}", formula, values, size, unit)
        )

    def allowable(self, limit: float) -> float | None:
        """Declared size whose judged effect is a limit; None if every size keeps the limit."""
        if self.per_unit > 0:
            return self.rule.allowable(limit) / self.per_unit
        return 0.0 if self.rule.bias > limit else None


def quantile_step(name: str, rms_name: str, rms: float, quantile: float, unit: str, confidence: float) -> Step:
    """Step from the rms effect of a random error to the effect that it does not exceed with a confidence.

    The ratio of the two depends on the proportions of the independent parts of the effect.
    """
    title = f"{confidence_percent(confidence)} quantile of the length of this normal effect, over its rms length"
    values = {"ratio": quantile / rms, rms_name: rms}
    return step(title, WorkedEquation(name, f"ratio*({rms_name})", values, quantile, unit))


def total_steps(
    analysis: Analysis,
    model: str,
    requirement: str,
    is_member: IsMember,
    root_sum_square: float,
    total: float | None,
    *,
    gain: float = 1.0,
    symbol: str = "combined",
) -> Iterator[Step]:
    """Yield the steps from the root-sum-square of errors to the size that a requirement judges for them together.

    `total` is this size. There are no steps if the requirement judges the root-sum-square itself.
    """
    totals = Totals(analysis)
    if total is None or not totals.is_asked(requirement) or not math.isfinite(root_sum_square):
        return
    unit = "m" if requirement == LOCATION else "rad"
    vector = totals.vector(model, requirement, is_member, 0, gain)
    if not vector.is_finite:  # an error leaves no image
        return
    bias = float(np.linalg.norm(vector.mean))
    biases = totals.biases(model, requirement, is_member, 0, gain)
    lines = _bias_lines(requirement, biases, vector.mean, unit) if bias else []
    confidence = analysis.mission.requirements.confidence_of(requirement)
    if confidence is None:
        text = f"{number(bias)} + {number(root_sum_square)}"
        yield step("Biases, which add with their signs, and the root-sum-square", *lines)
        yield step("Together", Sum(f"{symbol} = {text} = {with_unit(total, unit)}"))
        return
    title = (
        f"Quantile of all errors together at {confidence_percent(confidence)}, by the distribution of the length of "
        "their sum"
    )
    ratio = [f"{symbol}/rss = {number(total / root_sum_square)}"] if root_sum_square else []
    yield step(title, *lines, f"{symbol} = {with_unit(total, unit)}", *ratio)


def _bias_lines(requirement: str, biases: Sequence[tuple[str, Floats]], mean: Floats, unit: str) -> list[str]:
    """Lines with the effect of each bias, their sum along each component, and the length of this sum.

    The phases that a finite band hides are components of the quadratic phase, because they have signs too. They
    include the gain of autofocus.
    """
    names = {LOCATION: ["east", "north"], CUBIC: ["cubic"]}.get(requirement, ["QPE"])
    names += [f"hidden_{index + 1}" for index in range(len(mean) - len(names))]
    lines = []
    for error_id, effects in biases:
        components = [
            f"{with_unit(float(each), unit)} {name}" for name, each in zip(names, effects, strict=True) if each
        ]
        if components:
            lines.append(f"bias of {printable(error_id)}: {', '.join(components)}")
    for index, name in enumerate(names):
        along = [number(float(effects[index])) for _, effects in biases if effects[index]]
        if len(along) > 1:
            lines.append(Sum(f"bias_{name} = {' + '.join(along)} = {with_unit(float(mean[index]), unit)}"))
    terms = " + ".join(f"{number(float(effect))}^2" for effect in mean if effect) or "0"
    return [*lines, Sum(f"bias = sqrt({terms}) = {with_unit(float(np.linalg.norm(mean)), unit)}")]
