"""Size of a single error that a requirement judges, from its declared size, its bias and its distribution.

The file declares an error by the size σ of its random part, and optionally by a bias b, which is known and constant.
The random part is normal with the standard deviation σ, uniform between −σ and σ, or either −σ or σ with equal
probability (`bound`). A requirement with a confidence p judges the size q that the error b + σx does not exceed with
the probability p: the p-quantile of |b + σx|. A requirement without a confidence judges |b| + kσ, where the declared
size already contains the coverage factor k.

Sizes may be arrays of any shape (...), and have the unit of the error.
"""

import math
from functools import cache, lru_cache
from statistics import NormalDist

import numpy as np

from bisar_budget.arrays import Floats, PerCase
from bisar_budget.random_vector import RandomVector

_STANDARD = NormalDist()
_VARIANCE_DIGITS = 7  # of a share of the whole variance; a quantile needs fewer
_BISECTION_COUNT = 60  # bisections, which leave 1e-18 of the first interval
# Largest multiple of the distance to a limit at which a sigma is searched for. Beyond it, the probability that the
# error keeps the limit is below 50 % for every bias.
_WIDEST_RATIO = 2.0


@cache
def quantile_factor(distribution: str, confidence: float | None) -> float:
    """Ratio of the judged size to the declared size of an error without a bias; 1 if there is no confidence.

    `distribution` is `normal`, `uniform` or `bound`.
    """
    if confidence is None or distribution == "bound":
        return 1.0
    return confidence if distribution == "uniform" else _STANDARD.inv_cdf((1 + confidence) / 2)


def judged_size(distribution: str, size: PerCase, bias: PerCase, confidence: float | None) -> PerCase:
    """Size of an error that a requirement with the given confidence judges.

    `size` is the declared size, which may have a sign, and `bias` the bias. The result is not negative.
    """
    size, bias = np.abs(size), np.abs(bias)
    if confidence is None or distribution == "bound":
        # Of two values ±σ one is beyond the bias, and is not exceeded with any probability above a half.
        is_smaller_enough = confidence is not None and confidence <= 0.5
        return np.abs(bias - size) if is_smaller_enough else bias + size
    if distribution == "uniform":
        return np.maximum(confidence * size, bias + (2 * confidence - 1) * size)
    unbiased = quantile_factor(distribution, confidence) * size
    if not np.any(bias):
        return unbiased
    shape = np.broadcast_shapes(np.shape(size), np.shape(bias))
    quantiles = [
        _normal_quantile(sigma, mean, confidence)
        for sigma, mean in zip(np.broadcast_to(size, shape).flat, np.broadcast_to(bias, shape).flat, strict=True)
    ]
    return np.array(quantiles).reshape(shape)[()]


def allowable_size(distribution: str, limit: PerCase, bias: PerCase, confidence: float | None) -> PerCase:
    """Largest declared size with which the judged size of an error does not exceed `limit`.

    The result is 0 where the bias alone exceeds the limit, and infinite where the limit is infinite.
    """
    limit, bias = np.asarray(limit, dtype=float), np.abs(bias)
    if not np.any(bias):
        return np.asarray(limit / quantile_factor(distribution, confidence))[()]
    if confidence is None or distribution == "bound":
        size = limit + bias if confidence is not None and confidence <= 0.5 else limit - bias
    elif distribution == "uniform":
        with np.errstate(divide="ignore", invalid="ignore"):
            size = np.fmin(limit / confidence, (limit - bias) / (2 * confidence - 1))
    else:
        shape = np.broadcast_shapes(limit.shape, np.shape(bias))
        numbers = zip(np.broadcast_to(limit, shape).flat, np.broadcast_to(bias, shape).flat, strict=True)
        size = np.array([_largest_sigma(most, mean, confidence) for most, mean in numbers]).reshape(shape)
    return np.where(bias > limit, 0.0, size)[()]


def _within(limit: float, sigma: float, mean: float) -> float:
    """Probability that the magnitude of a normal number is at most `limit`."""
    if not sigma:
        return 1.0 if limit >= mean else 0.0
    scale = 1 / (sigma * math.sqrt(2))
    return (math.erf((limit - mean) * scale) + math.erf((limit + mean) * scale)) / 2


def _normal_quantile(sigma: float, mean: float, confidence: float) -> float:
    """Quantile of the magnitude of a normal number with the given standard deviation and non-negative mean."""
    if not sigma or not mean or math.isnan(sigma) or math.isnan(mean):
        return mean + sigma * quantile_factor("normal", confidence)
    low, high = (mean + sigma * _STANDARD.inv_cdf(level) for level in (confidence, (1 + confidence) / 2))
    for _ in range(_BISECTION_COUNT):
        middle = (low + high) / 2
        low, high = (middle, high) if _within(middle, sigma, mean) < confidence else (low, middle)
    return high


def _largest_sigma(limit: float, mean: float, confidence: float) -> float:
    """Largest standard deviation of a normal number with the given mean whose magnitude keeps a limit."""
    if math.isnan(limit) or math.isnan(mean) or math.isinf(limit):
        return limit
    if mean >= limit:
        return 0.0
    low, high = 0.0, _WIDEST_RATIO * limit
    for _ in range(_BISECTION_COUNT):
        middle = (low + high) / 2
        low, high = (middle, high) if _within(limit, middle, mean) >= confidence else (low, middle)
    return low


def normal_length_ratio(covariance: Floats, confidence: float) -> Floats:
    """Quantile of the length of a normal vector with mean 0, divided by its rms length, (cases,).

    `covariance` (m, m, cases) is the covariance of the vector. The ratio depends on the proportions of the principal
    variances alone. It is that of a normal number where the covariance is zero or not known.
    """
    _, _, cases = covariance.shape
    total = np.einsum("iic->c", covariance)
    ratios = np.full(cases, quantile_factor("normal", confidence))
    has_variance = np.flatnonzero(np.isfinite(total) & (total > 0))
    variances = np.linalg.eigvalsh(np.moveaxis(covariance[..., has_variance] / total[has_variance], 2, 0))
    for case, principal in zip(has_variance, np.round(variances, _VARIANCE_DIGITS), strict=True):
        ratios[case] = _length_ratio(tuple(principal.tolist()), confidence)
    return ratios


@lru_cache(maxsize=4096)  # cases of a sweep and checks of one mission have the same proportions
def _length_ratio(variances: tuple[float, ...], confidence: float) -> float:
    (quantile,) = RandomVector.of_covariance(np.diag(variances)).quantiles((confidence,))
    return quantile
