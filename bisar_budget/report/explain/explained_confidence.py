"""Explanation steps for biases and confidences: the size that a requirement judges, and quantiles of all errors."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.analysis.totals import IsMember, Totals
from bisar_budget.arrays import Floats
from bisar_budget.effects.declared import CUBIC, LIMITING_REQUIREMENTS, LOCATION, QUADRATIC
from bisar_budget.effects.effect import ErrorSource, plain
from bisar_budget.effects.error_quantiles import allowable_size, judged_size, quantile_factor
from bisar_budget.effects.sources import distribution_of
from bisar_budget.findings.row import Row
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

    `bias` is the magnitude of the bias, in the unit of the error.
    """

    requirement: str
    distribution: str
    bias: float
    confidence: float | None
    unit: str

    @classmethod
    def of(cls, analysis: Analysis, source: ErrorSource, requirement: str) -> "SizeRule":
        """Rule for an error and a requirement in the only case of an analysis."""
        confidence, unit = analysis.mission.requirements.confidence_of(requirement), source.unit
        bias = 0.0 if source.declared is None else abs(plain(source.bias))
        return cls(requirement, distribution_of(analysis.mission, source), bias, confidence, unit)

    @property
    def is_plain(self) -> bool:
        """Whether the requirement judges the declared size itself."""
        return self.confidence is None and not self.bias

    @property
    def words(self) -> str:
        """Text that defines the judged size."""
        if self.confidence is None:
            return "|bias| + declared"
        bias = "bias + " if self.bias else ""
        variable = _VARIABLE_WORDS[self.distribution]
        return f"{confidence_percent(self.confidence)} quantile of |{bias}declared*x|, {variable}"

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
        """Line that computes the probability with which a normal error with a bias keeps a limit."""
        bias, scale = number(self.bias), f"(sqrt(2)*{number(size)})"
        terms = " + ".join(f"erf(({number(limit)} {sign} {bias})/{scale})" for sign in "-+")
        probability = sum(math.erf((limit + sign * self.bias) / (math.sqrt(2) * size)) / 2 for sign in (-1, 1))
        return [Sum(f"probability = ({terms})/2 = {number(probability)}")]

    def allowable_step(self, reached: float, allowable: float) -> Step:
        """Step from the size that reaches a limit to the declared size of which this is the judged size."""
        symbol, at_limit = f"by_{_SYMBOLS[self.requirement]}", f"limit_{_SYMBOLS[self.requirement]}"
        title = f"Allowable by requirements.{self.requirement}: {at_limit} is its judged size, {self.words}"
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
    bias = float(np.linalg.norm(vector.mean))
    lines = [_bias_line(vector.mean, bias, unit)] if bias else []
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


def _bias_line(mean: Floats, bias: float, unit: str) -> str:
    terms = " + ".join(f"{number(float(effect))}^2" for effect in mean if effect) or "0"
    return Sum(f"bias = sqrt({terms}) = {with_unit(bias, unit)}")
