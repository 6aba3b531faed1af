"""Judged and allowable sizes of one error, against closed forms and against its cumulated probability."""

import math
from statistics import NormalDist

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bisar_budget.effects.error_quantiles import allowable_size, judged_size, normal_length_ratio, quantile_factor

CONFIDENCES = (0.5, 0.6827, 0.95, 0.997, 0.999999)
SIZES, BIASES = st.floats(1e-3, 1e3), st.floats(0.0, 1e3)


def probability(distribution: str, size: float, bias: float, limit: float) -> float:
    """Probability that |bias + size·x| is at most the limit."""
    if distribution == "normal":
        normal = NormalDist(bias, size)
        return normal.cdf(limit) - normal.cdf(-limit)
    if distribution == "uniform":
        return max(0.0, min(limit, bias + size) - max(-limit, bias - size)) / (2 * size)
    return sum(abs(bias + sign * size) <= limit * (1 + 1e-12) for sign in (-1, 1)) / 2


@pytest.mark.parametrize("confidence", CONFIDENCES)
def test_a_normal_error_without_a_bias_is_that_of_erf(confidence: float) -> None:
    factor = quantile_factor("normal", confidence)
    assert math.erf(factor / math.sqrt(2)) == pytest.approx(confidence, rel=1e-12)
    assert judged_size("normal", 3.0, 0.0, confidence) == pytest.approx(3 * factor, rel=1e-15)
    assert allowable_size("normal", 3 * factor, 0.0, confidence) == pytest.approx(3.0, rel=1e-12)


def test_a_uniform_error_and_a_bound_without_a_bias() -> None:
    assert judged_size("uniform", 2.0, 0.0, 0.95) == 1.9
    assert judged_size("bound", 2.0, 0.0, 0.95) == 2.0
    assert allowable_size("uniform", 1.9, 0.0, 0.95) == pytest.approx(2.0)


def test_without_a_confidence_the_coverage_factor_leaves_the_bias_alone() -> None:
    """The declared size contains the factor k: |b| + k·sigma."""
    assert judged_size("normal", -2 * 3.0, 1.5, None) == 7.5
    assert allowable_size("normal", 7.5, -1.5, None) == 6.0


@given(st.sampled_from(["normal", "uniform", "bound"]), SIZES, BIASES, st.sampled_from(CONFIDENCES))
def test_the_judged_size_is_the_smallest_that_is_kept(
    distribution: str, size: float, bias: float, confidence: float
) -> None:
    judged = float(judged_size(distribution, size, bias, confidence))
    scale = size + bias
    assert probability(distribution, size, bias, judged + 1e-9 * scale) >= confidence - 1e-9
    assert probability(distribution, size, bias, judged - 1e-6 * scale) < confidence + 1e-9


@given(st.sampled_from(["normal", "uniform", "bound"]), SIZES, BIASES, st.sampled_from([0.6827, 0.95, 0.997, None]))
def test_the_allowable_size_has_the_limit_as_its_judged_size(
    distribution: str, limit: float, bias: float, confidence: float | None
) -> None:
    size = float(allowable_size(distribution, limit, bias, confidence))
    if bias > limit:
        assert size == 0
        return
    assert judged_size(distribution, size, bias, confidence) == pytest.approx(limit, rel=1e-6)


def test_arrays_have_the_numbers_of_each_case() -> None:
    sizes, biases = np.array([1.0, 2.0, 0.0]), np.array([0.0, 1.0, 3.0])
    judged = judged_size("normal", sizes, biases, 0.95)
    assert judged.tolist() == [judged_size("normal", *pair, 0.95) for pair in zip(sizes, biases, strict=True)]
    assert judged[2] == 3.0


def test_equal_axes_have_the_length_of_rayleigh() -> None:
    ratio = normal_length_ratio(np.eye(2)[..., None], 0.95)
    assert ratio == pytest.approx(math.sqrt(-2 * math.log(0.05)) / math.sqrt(2), rel=1e-6)
    line = normal_length_ratio(np.diag([1.0, 0.0])[..., None], 0.95)
    assert line == pytest.approx(quantile_factor("normal", 0.95), rel=1e-9)
